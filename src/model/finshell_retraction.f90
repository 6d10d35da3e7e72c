!> How nodes turn in a finite motion, where elements are smaller than the thickness: a retraction.
!>
!> A correction solves linear equations: its displacements add, its spins turn. In it nodes turn with their elements, to first
!> order. To second order they do not: a side that turns by theta and stretches by epsilon in one correction turns by
!> theta/(1 + epsilon), its nodes by theta. What is missing bends an element of side l and thickness h by 3 h/l times that angle at
!> its surfaces: at h/l = 20 a correction by a tenth tears it. So nodes turn on by what the normals of the elements around them tilt
!> beyond the linear spin. That is of second order: Newton's method stays what it is, and so do the states that it converges to.
!>
!> Vectors over the equations are coordinates of states as seen from one of them. Seen from another the same motion has other spins,
!> those of its elements there (`transport`); a predictor that adds them up as they were bends elements as wrongly.
!>
!> Thick elements only: on coarse meshes, where an element turns far against the next, the mean is no better than nothing.
module finshell_retraction
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_equations, only: equations_t, scatter, unknowns_of
   use finshell_mesh, only: mesh_t
   use finshell_quaternion, only: quaternion_to_rotation_vector
   use finshell_rotation, only: cross_product
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t, thickness_of
   implicit none
   private
   public :: retraction_t, new_retraction

   type :: retraction_t
      private
      logical :: any = .false. !< an element is that thick; else nothing is to be done
      real(wp), allocatable :: share(:, :) !< (3, elements) of an element in the mean at its nodes
   contains
      procedure :: turn_on
      procedure :: transport
      procedure, private :: beyond
      procedure, private :: transported
   end type retraction_t

   !> Thickness over longest side up to which elements have no say, and from which on all of it.
   real(wp), parameter :: from_ratio = 2, to_ratio = 3
   !> Cosine of the tilt of a normal, and the area over that before, beyond which an element has none either.
   real(wp), parameter :: least_cosine = -0.5_wp, least_area = 1.0e-6_wp

contains

   !> Means are weighted by reference area.
   pure subroutine new_retraction(self, structure)
      type(retraction_t), intent(out) :: self
      type(structure_t), intent(in) :: structure
      real(wp), allocatable :: total(:)
      real(wp) :: x(3, 3), longest, area, ratio
      integer :: i, k

      associate (mesh => structure%mesh)
         allocate (self%share(3, size(mesh%triangles, 2)))
         allocate (total(size(mesh%coordinates, 2)), source=0.0_wp)
         do i = 1, size(mesh%triangles, 2)
            x = mesh%coordinates(:, mesh%triangles(:, i))
            longest = max(norm2(x(:, 2) - x(:, 1)), norm2(x(:, 3) - x(:, 2)), norm2(x(:, 1) - x(:, 3)))
            area = norm2(cross_product(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1)))
            do k = 1, 3
               total(mesh%triangles(k, i)) = total(mesh%triangles(k, i)) + area
            end do
            associate (section => structure%sections(structure%element_section(i)))
               ratio = 0
               if (longest > 0 .and. .not. section%membrane) ratio = thickness_of(structure, i)/longest
            end associate
            self%share(:, i) = area*min(max((ratio - from_ratio)/(to_ratio - from_ratio), 0.0_wp), 1.0_wp)
         end do
         do i = 1, size(mesh%triangles, 2)
            do k = 1, 3
               if (total(mesh%triangles(k, i)) > 0) self%share(k, i) = self%share(k, i)/total(mesh%triangles(k, i))
            end do
         end do
      end associate
      self%any = any(self%share > 0)
   end subroutine new_retraction

   !> Add to the spins of a motion from a state, or take away, by how much the nodes turn beyond them, where no support holds them.
   pure subroutine turn_on(self, mesh, equations, from, part, nodal)
      class(retraction_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: from
      real(wp), intent(in) :: part !< 1: add, -1: take away
      real(wp), intent(inout) :: nodal(:, :) !< (n_nodal, nodes)
      real(wp), allocatable :: x(:), more(:, :)
      if (.not. self%any) return
      allocate (x(equations%n), more(n_nodal, size(nodal, 2)))
      more(ux:uz, :) = 0
      more(rx:rz, :) = self%beyond(mesh, from%displacement, nodal)
      call unknowns_of(equations, more, x)
      call scatter(equations, x, more)
      nodal(rx:rz, :) = nodal(rx:rz, :) + part*more(rx:rz, :)
   end subroutine turn_on

   !> A motion x over the equations as seen from an old state, to what it is as seen from a new one.
   pure subroutine transport(self, mesh, equations, old, new, x)
      class(retraction_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: old, new
      real(wp), intent(inout) :: x(:)
      real(wp), allocatable :: change(:), nodal(:, :)
      if (.not. self%any) return
      allocate (change(equations%n), nodal(n_nodal, size(old%displacement, 2)))
      call scatter(equations, x, nodal)
      nodal(rx:rz, :) = self%transported(mesh, old%displacement, new%displacement, nodal)
      nodal(ux:uz, :) = 0
      call unknowns_of(equations, nodal, change)
      x = x + change
   end subroutine transport

   !> Rotation vectors of the nodes beyond their spins in a motion from a displaced state.
   pure function beyond(self, mesh, displacement, motion) result(turn)
      class(retraction_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(in) :: displacement(:, :) !< (3, nodes)
      real(wp), intent(in) :: motion(:, :) !< (>= 3, nodes) displacements come first
      real(wp) :: turn(3, size(displacement, 2))
      real(wp) :: x(3, 3), v(3, 3), spin(3), more(3)
      integer :: i
      turn = 0
      do i = 1, size(mesh%triangles, 2)
         if (.not. self%share(1, i) > 0) cycle
         x = mesh%coordinates(:, mesh%triangles(:, i)) + displacement(:, mesh%triangles(:, i))
         v = motion(:3, mesh%triangles(:, i))
         call tilt(x, v, spin, more)
         call spread(self%share(:, i), mesh%triangles(:, i), more, turn)
      end do
   end function beyond

   !> Spins that a motion has as seen from a new state, minus those as seen from an old one.
   pure function transported(self, mesh, old, new, motion) result(change)
      class(retraction_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(in) :: old(:, :), new(:, :) !< (3, nodes) displacements of the states
      real(wp), intent(in) :: motion(:, :) !< (>= 3, nodes) displacements come first
      real(wp) :: change(3, size(old, 2))
      real(wp) :: x(3, 3), v(3, 3), before(3), after(3)
      integer :: i
      change = 0
      do i = 1, size(mesh%triangles, 2)
         if (.not. self%share(1, i) > 0) cycle
         x = mesh%coordinates(:, mesh%triangles(:, i))
         v = motion(:3, mesh%triangles(:, i))
         call tilt(x + old(:, mesh%triangles(:, i)), v, before)
         call tilt(x + new(:, mesh%triangles(:, i)), v, after)
         call spread(self%share(:, i), mesh%triangles(:, i), after - before, change)
      end do
   end function transported

   pure subroutine spread(share, nodes, turn, at_nodes)
      real(wp), intent(in) :: share(3), turn(3)
      integer, intent(in) :: nodes(3)
      real(wp), intent(inout) :: at_nodes(:, :)
      integer :: k
      do k = 1, 3
         at_nodes(:, nodes(k)) = at_nodes(:, nodes(k)) + share(k)*turn
      end do
   end subroutine spread

   !> Spin of the normal of a triangle whose corners move by v, and what it tilts beyond that.
   pure subroutine tilt(x, v, spin, more)
      real(wp), intent(in) :: x(3, 3), v(3, 3) !< (component, corner)
      real(wp), intent(out) :: spin(3)
      real(wp), intent(out), optional :: more(3)
      real(wp) :: a(3), b(3), n(3), m(3), da(3), db(3), area, cosine, half

      spin = 0
      if (present(more)) more = 0
      a = x(:, 2) - x(:, 1)
      b = x(:, 3) - x(:, 1)
      da = v(:, 2) - v(:, 1)
      db = v(:, 3) - v(:, 1)
      n = cross_product(a, b)
      area = norm2(n)
      if (.not. area > 0) return
      n = n/area
      ! n x dn, as n x (da x b + a x db) = da (n.b) - b (n.da) + a (n.db) - db (n.a)
      spin = (dot_product(n, db)/area)*a - (dot_product(n, da)/area)*b
      if (.not. present(more)) return
      m = cross_product(a + da, b + db)
      if (.not. norm2(m) > least_area*area) return
      m = m/norm2(m)
      cosine = dot_product(n, m)
      if (.not. cosine > least_cosine) return
      half = sqrt(0.5_wp*(1 + cosine))
      more = quaternion_to_rotation_vector([half, cross_product(n, m)/(2*half)]) - spin
   end subroutine tilt
end module finshell_retraction
