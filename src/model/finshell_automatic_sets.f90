!> Sets that files of meshes need not have: the free edges of the mesh, loop by loop and side by side, and its creases.
module finshell_automatic_sets
   use finshell_edges, only: edges_t, new_edges
   use finshell_error, only: text_of
   use finshell_kinds, only: wp
   use finshell_mesh, only: add_edge_set, find_edge_set, find_element_set, find_node_set, mesh_t, twice_area_vector
   use finshell_mesh_sorting, only: sorted_order
   implicit none
   private
   public :: add_automatic_sets

   real(wp), parameter :: degree = acos(-1.0_wp)/180
   real(wp), parameter :: rounding = 1.0e-9_wp !< of lengths: loops that differ by less keep their order
   real(wp), parameter :: corner = 40*degree !< a boundary that turns by more has a corner there

contains

   !> Add the edge sets `crease`, of edges where triangles meet at more than an angle; `junction`, where more than two meet;
   !> `boundary`, of all free edges; `boundary_1`, ... its loops, the longest first; `boundary_1_1`, ... the sides of a loop between
   !> its corners, from the corner with the lowest number on along the loop, the surface on the left. A name that is taken keeps
   !> what it has.
   subroutine add_automatic_sets(mesh, crease_angle)
      type(mesh_t), intent(inout) :: mesh
      real(wp), intent(in) :: crease_angle !< degrees
      type(edges_t) :: edges
      integer, allocatable :: line(:, :), first(:), found(:, :)
      integer :: i, n

      call new_edges(edges, mesh%triangles)
      call find_creases(mesh, edges, crease_angle*degree, found)
      call add('crease', found)
      call add('junction', edges%nodes(:, pack([(i, i=1, size(edges%junction))], edges%junction)))
      call find_loops(mesh, edges, line, first)
      if (size(line) == 0) return
      call add('boundary', line)
      n = size(first) - 1
      do i = 1, n
         call add('boundary_'//text_of(i), line(:, first(i):first(i + 1) - 1))
      end do
      do i = 1, n
         call add_sides('boundary_'//text_of(i), line(:, first(i):first(i + 1) - 1))
      end do

   contains

      subroutine add(name, some)
         character(len=*), intent(in) :: name
         integer, intent(in) :: some(:, :)
         if (size(some) == 0) return
         if (find_edge_set(mesh, name) > 0 .or. find_node_set(mesh, name) > 0 .or. find_element_set(mesh, name) > 0) return
         call add_edge_set(mesh, name, some)
      end subroutine add

      !> The sides of a loop, if it has two corners or more.
      subroutine add_sides(name, loop)
         character(len=*), intent(in) :: name
         integer, intent(in) :: loop(:, :)
         integer, allocatable :: at(:), turned(:, :)
         integer :: begin, k, m
         m = size(loop, 2)
         if (loop(2, m) /= loop(1, 1)) return
         at = pack([(k, k=1, m)], [(turns(loop(1, 1 + modulo(k - 2, m)), loop(1, k), loop(2, k)), k=1, m)])
         if (size(at) < 2) return
         begin = at(minloc(loop(1, at), 1))
         turned = cshift(loop, begin - 1, dim=2)
         at = modulo(at - begin, m) + 1
         at = [cshift(at, minloc(at, 1) - 1), m + 1]
         do k = 1, size(at) - 1
            call add(name//'_'//text_of(k), turned(:, at(k):at(k + 1) - 1))
         end do
      end subroutine add_sides

      !> Whether a line through three nodes has a corner at the second.
      logical function turns(a, b, c)
         integer, intent(in) :: a, b, c
         real(wp) :: u(3), v(3)
         u = mesh%coordinates(:, b) - mesh%coordinates(:, a)
         v = mesh%coordinates(:, c) - mesh%coordinates(:, b)
         turns = dot_product(u, v) < cos(corner)*norm2(u)*norm2(v)
      end function turns
   end subroutine add_automatic_sets

   !> Edges where two triangles meet at more than an angle (radian).
   subroutine find_creases(mesh, edges, angle, found)
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      real(wp), intent(in) :: angle
      integer, allocatable, intent(out) :: found(:, :) !< (2, :) nodes
      real(wp), allocatable :: normal(:, :)
      logical, allocatable :: sharp(:)
      integer :: e
      allocate (normal(3, size(mesh%triangles, 2)), sharp(size(edges%nodes, 2)))
      do e = 1, size(normal, 2)
         normal(:, e) = twice_area_vector(mesh, e)
         if (norm2(normal(:, e)) > 0) normal(:, e) = normal(:, e)/norm2(normal(:, e))
      end do
      do e = 1, size(sharp)
         sharp(e) = .false.
         if (edges%elements(2, e) > 0) sharp(e) = dot_product(normal(:, edges%elements(1, e)), normal(:, edges%elements(2, e))) &
            < cos(angle)
      end do
      found = edges%nodes(:, pack([(e, e=1, size(sharp))], sharp))
   end subroutine find_creases

   !> Free edges, loop after loop, each in the direction of its triangle; loops by falling length. Where more than two of them meet
   !> at a node a loop goes on with any.
   subroutine find_loops(mesh, edges, line, first)
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      integer, allocatable, intent(out) :: line(:, :) !< (2, :) nodes
      integer, allocatable, intent(out) :: first(:) !< of each loop, and one behind the last
      integer, allocatable :: sides(:, :), next(:), start_at(:), begins(:), order(:)
      logical, allocatable :: taken(:)
      real(wp), allocatable :: length(:)
      integer :: e, here, i, k, loops, n

      allocate (sides(2, count(edges%elements(2, :) == 0 .and. .not. edges%junction)))
      n = 0
      do e = 1, size(mesh%triangles, 2)
         do k = 1, 3
            if (edges%elements(2, edges%of_side(k, e)) /= 0 .or. edges%junction(edges%of_side(k, e))) cycle
            n = n + 1
            sides(:, n) = [mesh%triangles(k, e), mesh%triangles(1 + mod(k, 3), e)]
         end do
      end do
      ! edges that begin at a node, as a linked list
      allocate (start_at(size(mesh%coordinates, 2)), next(n), source=0)
      do i = n, 1, -1
         next(i) = start_at(sides(1, i))
         start_at(sides(1, i)) = i
      end do
      allocate (line(2, n), taken(n), begins(n + 1), length(n))
      taken = .false.
      loops = 0
      k = 0
      do i = 1, n
         if (taken(i)) cycle
         loops = loops + 1
         begins(loops) = k + 1
         length(loops) = 0
         here = i
         do while (here > 0)
            taken(here) = .true.
            k = k + 1
            line(:, k) = sides(:, here)
            length(loops) = length(loops) + norm2(mesh%coordinates(:, sides(2, here)) - mesh%coordinates(:, sides(1, here)))
            here = start_at(sides(2, here))
            do while (here > 0)
               if (.not. taken(here)) exit
               here = next(here)
            end do
         end do
      end do
      begins(loops + 1) = n + 1
      order = sorted_order(-anint(length(:loops)/maxval(length(:loops))/rounding))
      sides = line
      allocate (first(loops + 1))
      k = 1
      do i = 1, loops
         first(i) = k
         n = begins(order(i) + 1) - begins(order(i))
         line(:, k:k + n - 1) = sides(:, begins(order(i)):begins(order(i) + 1) - 1)
         k = k + n
      end do
      first(loops + 1) = k
   end subroutine find_loops
end module finshell_automatic_sets
