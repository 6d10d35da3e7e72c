!> Dashpots between two nodes, or from a node to the ground: in steps in time they resist the relative velocity of their ends, along
!> the global axes, along the line between them, or the relative spin.
!>
!> Along a line with direction n, length l and relative velocity w: force -c (n.w) n, derivative with the positions
!> -c [P (n.w)/l + n (P w)'/l], P = I - n n'.
module finshell_dashpots
   use finshell_blocks, only: blocks_t, new_blocks
   use finshell_connector, only: connector_t, dashpot_axes, dashpot_line, dashpot_rotation, is_dashpot
   use finshell_equations, only: equations_t
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_kinds, only: wp
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: dashpots_t, new_dashpots

   type :: dashpots_t
      type(blocks_t) :: blocks
      integer, allocatable :: of(:) !< (blocks) number of the connector
      logical :: in_matrix = .true. !< of a team, one member has them in its part of the matrix
   contains
      procedure :: add
      procedure :: fastest
   end type dashpots_t

contains

   pure subroutine new_dashpots(self, structure, equations)
      type(dashpots_t), intent(out) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      integer, allocatable :: first(:), nodes(:)
      integer :: c, i
      first = [1]
      allocate (nodes(0), self%of(0))
      if (allocated(structure%connectors)) then
         do c = 1, size(structure%connectors)
            if (.not. is_dashpot(structure%connectors(c))) cycle
            associate (node => structure%connectors(c)%node)
               nodes = [nodes, reshape(node, [size(node)])]
               self%of = [self%of, spread(c, 1, size(node, 2))]
               first = [first, [(first(size(first)) + i*size(node, 1), i=1, size(node, 2))]]
            end associate
         end do
      end if
      call new_blocks(self%blocks, equations, first, nodes, n_nodal)
   end subroutine new_dashpots

   !> Add their forces for nodal velocities; with values, rate times the derivative with velocities, and that with positions.
   pure subroutine add(self, structure, state, velocity, force, rate, values)
      class(dashpots_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: velocity(:, :) !< (n_nodal, nodes)
      real(wp), intent(inout) :: force(:, :) !< (n_nodal, nodes)
      real(wp), intent(in), optional :: rate !< of the velocity with the displacement
      real(wp), intent(inout), optional :: values(:) !< of the matrix
      real(wp) :: w(n_nodal), f(n_nodal), k(n_nodal, n_nodal), both(2*n_nodal, 2*n_nodal)
      integer :: b
      do b = 1, self%blocks%count()
         associate (node => self%blocks%node(self%blocks%first(b):self%blocks%first(b + 1) - 1))
            w = velocity(:, node(1))
            if (size(node) == 2) w = w - velocity(:, node(2))
            if (present(rate)) then
               call resist(structure%connectors(self%of(b)), structure, state, node, w, f, rate, k)
            else
               call resist(structure%connectors(self%of(b)), structure, state, node, w, f, 0.0_wp, k)
            end if
            force(:, node(1)) = force(:, node(1)) + f
            if (size(node) == 2) force(:, node(2)) = force(:, node(2)) - f
            if (.not. present(values) .or. .not. self%in_matrix) cycle
            if (size(node) == 1) then
               call self%blocks%add(b, k, values)
            else
               both(:n_nodal, :n_nodal) = k
               both(n_nodal + 1:, :n_nodal) = -k
               both(:n_nodal, n_nodal + 1:) = -k
               both(n_nodal + 1:, n_nodal + 1:) = k
               call self%blocks%add(b, both, values)
            end if
         end associate
      end do
   end subroutine add

   !> Force on the first end, and minus its derivative with the motion of that end.
   pure subroutine resist(it, structure, state, node, w, force, rate, k)
      type(connector_t), intent(in) :: it
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      integer, intent(in) :: node(:)
      real(wp), intent(in) :: w(n_nodal), rate
      real(wp), intent(out) :: force(n_nodal), k(n_nodal, n_nodal)
      real(wp) :: n(3), l, speed, across(3)
      integer :: i
      force = 0
      k = 0
      select case (it%kind)
      case (dashpot_axes)
         force(ux:uz) = -it%share*it%vector*w(ux:uz)
         do i = ux, uz
            k(i, i) = rate*it%share*it%vector(i)
         end do
      case (dashpot_rotation)
         force(rx:rz) = -it%share*it%vector*w(rx:rz)
         do i = rx, rz
            k(i, i) = rate*it%share*it%vector(i - uz)
         end do
      case (dashpot_line)
         n = structure%mesh%coordinates(:, node(1)) + state%displacement(:, node(1))
         if (size(node) == 2) then
            n = n - structure%mesh%coordinates(:, node(2)) - state%displacement(:, node(2))
         else
            n = n - it%anchor
         end if
         l = norm2(n)
         if (.not. l > 0) return
         n = n/l
         speed = dot_product(n, w(ux:uz))
         across = w(ux:uz) - speed*n
         force(ux:uz) = -it%share*it%vector(1)*speed*n
         k(ux:uz, ux:uz) = it%share*it%vector(1)*((rate - speed/l)*spread(n, 2, 3)*spread(n, 1, 3) &
                                                  + spread(n, 2, 3)*spread(across, 1, 3)/l)
         do i = ux, uz
            k(i, i) = k(i, i) + it%share*it%vector(1)*speed/l
         end do
      end select
   end subroutine resist

   !> A bound of the fastest decay of a motion that they cause alone: the largest sum of viscosities over mass at a node.
   pure real(wp) function fastest(self, structure, mass)
      class(dashpots_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      real(wp), intent(in) :: mass(:, :) !< (n_nodal, nodes)
      real(wp), allocatable :: sums(:, :)
      real(wp) :: most
      integer :: b, i, first
      allocate (sums(size(mass, 1), size(mass, 2)), source=0.0_wp)
      do b = 1, self%blocks%count()
         associate (it => structure%connectors(self%of(b)), &
                    node => self%blocks%node(self%blocks%first(b):self%blocks%first(b + 1) - 1))
            first = merge(rx, ux, it%kind == dashpot_rotation)
            most = it%share*maxval(it%vector)
            do i = 1, size(node)
               sums(first:first + 2, node(i)) = sums(first:first + 2, node(i)) + size(node)*most
            end do
         end associate
      end do
      fastest = 0
      if (any(mass > 0)) fastest = maxval(sums/merge(mass, 1.0_wp, mass > 0), mask=mass > 0)
   end function fastest
end module finshell_dashpots
