!> Initial imperfections: the reference shape is moved by a small field before anything is solved, without stress.
module finshell_imperfection
   use finshell_equations, only: equations_t, free_part, new_equations
   use finshell_error, only: error_t
   use finshell_freedoms, only: n_nodal, ux, uz
   use finshell_kinds, only: i8, wp
   use finshell_mesh, only: mesh_t
   use finshell_rotation, only: cross_product
   use finshell_structure, only: structure_t, turning_nodes
   implicit none
   private
   public :: imperfection_t, from_step, from_results, from_file, random_waves, bend_reference, wave_field

   !> Where it comes from: modes of a step of the same input; increments of a results file; a file with three numbers for each
   !> node; waves of random directions and phases.
   integer, parameter :: from_step = 1, from_results = 2, from_file = 3, random_waves = 4

   type :: imperfection_t
      integer :: kind = from_step
      integer :: line = 0 !< of the input
      integer :: step = 0
      integer, allocatable :: modes(:) !< or increments of the results
      real(wp), allocatable :: amplitudes(:) !< largest displacement of a node, with a sign; of a file: none leaves it as it is
      character(len=:), allocatable :: file
      real(wp), allocatable :: field(:, :) !< (3, nodes) of a file
      real(wp) :: wave_length = 0
      integer :: seed = 1
   end type imperfection_t

   integer, parameter :: waves = 64

contains

   !> Move the nodes of the reference shape; normals at the corners of elements turn with the facets around them.
   subroutine bend_reference(structure, displacement)
      type(structure_t), intent(inout) :: structure
      real(wp), intent(in) :: displacement(:, :) !< (3, nodes)
      type(mesh_t) :: before
      real(wp), allocatable :: turned(:, :, :)
      real(wp) :: n(3), sum(3)
      integer, allocatable :: first(:), corners(:)
      integer :: e, i, k, node
      before = structure%mesh
      structure%mesh%coordinates = structure%mesh%coordinates + displacement
      if (.not. allocated(structure%normal)) return
      call corners_of_nodes(structure%mesh, first, corners)
      turned = structure%normal
      do e = 1, size(structure%mesh%triangles, 2)
         do k = 1, 3
            node = structure%mesh%triangles(k, e)
            n = structure%normal(:, k, e)
            sum = 0
            do i = first(node), first(node + 1) - 1
               associate (other => (corners(i) - 1)/3 + 1, corner => mod(corners(i) - 1, 3) + 1)
                  if (alike(structure%normal(:, corner, other), n)) sum = sum + carried(before, structure%mesh, other, n)
               end associate
            end do
            if (norm2(sum) > 0) turned(:, k, e) = norm2(n)/norm2(sum)*sum
         end do
      end do
      structure%normal = turned
   end subroutine bend_reference

   !> A vector that keeps its components along two sides and the normal of a facet, times the area.
   pure function carried(before, after, e, n) result(vector)
      type(mesh_t), intent(in) :: before, after
      integer, intent(in) :: e
      real(wp), intent(in) :: n(3)
      real(wp) :: vector(3), old(3, 3), new(3, 3), area
      old = sides_and_normal(before, e)
      new = sides_and_normal(after, e)
      area = norm2(cross_product(old(:, 1), old(:, 2)))
      vector = 0
      if (.not. area > 0) return
      vector = dot_product(cross_product(n, old(:, 2)), old(:, 3))*new(:, 1) &
               + dot_product(cross_product(old(:, 1), n), old(:, 3))*new(:, 2) + area*dot_product(n, old(:, 3))*new(:, 3)
   end function carried

   pure function sides_and_normal(mesh, e) result(a)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: e
      real(wp) :: a(3, 3)
      associate (x => mesh%coordinates, t => mesh%triangles(:, e))
         a(:, 1) = x(:, t(2)) - x(:, t(1))
         a(:, 2) = x(:, t(3)) - x(:, t(1))
         a(:, 3) = cross_product(a(:, 1), a(:, 2))
         if (norm2(a(:, 3)) > 0) a(:, 3) = a(:, 3)/norm2(a(:, 3))
      end associate
   end function sides_and_normal

   !> Are two normals the same, so that the surface is smooth between their elements?
   pure logical function alike(a, b)
      real(wp), intent(in) :: a(3), b(3)
      real(wp), parameter :: rounding = 1.0e-9_wp
      alike = dot_product(a, b) > (1 - rounding)*norm2(a)*norm2(b)
   end function alike

   !> (3, elements) normals of the facets, of twice their area.
   pure function area_normals(mesh) result(n)
      type(mesh_t), intent(in) :: mesh
      real(wp) :: n(3, size(mesh%triangles, 2))
      integer :: e
      do e = 1, size(n, 2)
         associate (x => mesh%coordinates, t => mesh%triangles(:, e))
            n(:, e) = cross_product(x(:, t(2)) - x(:, t(1)), x(:, t(3)) - x(:, t(1)))
         end associate
      end do
   end function area_normals

   !> Corners, numbered through the elements, at each node: corners(first(node):first(node + 1) - 1).
   pure subroutine corners_of_nodes(mesh, first, corners)
      type(mesh_t), intent(in) :: mesh
      integer, allocatable, intent(out) :: first(:), corners(:)
      integer, allocatable :: at(:)
      integer :: e, k
      allocate (first(size(mesh%coordinates, 2) + 1), source=0)
      allocate (corners(size(mesh%triangles)))
      do e = 1, size(mesh%triangles, 2)
         first(mesh%triangles(:, e) + 1) = first(mesh%triangles(:, e) + 1) + 1
      end do
      first(1) = 1
      do k = 2, size(first)
         first(k) = first(k) + first(k - 1)
      end do
      at = first(:size(first) - 1)
      do e = 1, size(mesh%triangles, 2)
         do k = 1, 3
            associate (node => mesh%triangles(k, e))
               corners(at(node)) = 3*(e - 1) + k
               at(node) = at(node) + 1
            end associate
         end do
      end do
   end subroutine corners_of_nodes

   !> A smooth random field along the normals: waves of one length in space, of random directions and phases; largest
   !> displacement 1. Of the same seed it is the same on any mesh of the shape, but for its scale; what supports hold stays.
   subroutine wave_field(structure, wave_length, seed, displacement, error)
      type(structure_t), intent(in) :: structure
      real(wp), intent(in) :: wave_length
      integer, intent(in) :: seed
      real(wp), allocatable, intent(out) :: displacement(:, :) !< (3, nodes)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: two_pi = 2*acos(-1.0_wp)
      type(equations_t) :: equations
      real(wp), allocatable :: normal(:, :), height(:), nodal(:, :)
      real(wp) :: direction(3), phase, z, around
      integer(i8) :: random
      integer :: i

      call new_equations(equations, structure%mesh, structure%supports, error, turning_nodes(structure))
      if (allocated(error)) return
      allocate (height(size(structure%mesh%coordinates, 2)), source=0.0_wp)
      random = 1 + mod(int(abs(int(seed, i8)), i8)*7919_i8, 2147483646_i8)
      do i = 1, waves
         z = 2*next() - 1
         around = two_pi*next()
         phase = two_pi*next()
         direction = two_pi/wave_length*[sqrt(1 - z**2)*cos(around), sqrt(1 - z**2)*sin(around), z]
         height = height + cos(matmul(direction, structure%mesh%coordinates) + phase)
      end do
      normal = node_normals(structure%mesh)
      allocate (nodal(n_nodal, size(height)), source=0.0_wp)
      do i = 1, size(height)
         nodal(ux:uz, i) = height(i)*normal(:, i)
      end do
      nodal = free_part(equations, nodal)
      displacement = nodal(ux:uz, :)/max(maxval(norm2(nodal(ux:uz, :), dim=1)), tiny(1.0_wp))

   contains

      !> Uniform in (0, 1), the generator of Park and Miller: the same everywhere.
      real(wp) function next()
         random = mod(48271_i8*random, 2147483647_i8)
         next = real(random, wp)/2147483647
      end function next
   end subroutine wave_field

   !> (3, nodes) unit normals, means of the facets around.
   pure function node_normals(mesh) result(n)
      type(mesh_t), intent(in) :: mesh
      real(wp) :: n(3, size(mesh%coordinates, 2)), facets(3, size(mesh%triangles, 2))
      integer :: e, i, k
      facets = area_normals(mesh)
      n = 0
      do e = 1, size(facets, 2)
         do k = 1, 3
            n(:, mesh%triangles(k, e)) = n(:, mesh%triangles(k, e)) + facets(:, e)
         end do
      end do
      do i = 1, size(n, 2)
         if (norm2(n(:, i)) > 0) n(:, i) = n(:, i)/norm2(n(:, i))
      end do
   end function node_normals
end module finshell_imperfection
