!> Nodes and elements as a mesh file has them, under its own numbers ("tags"); quadrilaterals and elements of second order cut into
!> triangles, with all their nodes.
module finshell_raw_mesh
   use finshell_error, only: text_of
   use finshell_kinds, only: i8, wp
   use finshell_mesh, only: mesh_t, new_mesh
   use finshell_mesh_sorting, only: position_in_sorted, sorted_order
   implicit none
   private
   public :: list_t, raw_mesh_t, can_cut

   !> Elements of one dimension: points, lines, triangles. `count` of them are there.
   type :: list_t
      integer :: count = 0
      integer(i8), allocatable :: nodes(:, :) !< tags (dimension + 1, elements)
      integer(i8), allocatable :: tags(:) !< of the elements; pieces of one element have one tag
      integer, allocatable :: places(:) !< in the file: lines, in a binary file bytes
   end type list_t

   type :: raw_mesh_t
      integer(i8), allocatable :: node_tags(:)
      real(wp), allocatable :: coordinates(:, :) !< (3, nodes)
      integer, allocatable :: node_places(:) !< in the file, as in list_t
      type(list_t) :: elements(0:2)
      integer, allocatable :: number(:) !< (nodes, in ascending order of tags) number in the mesh, 0: of no triangle; see `make`
      integer, allocatable, private :: pairs(:) ! first of two triangles that are a quadrilateral
      integer, private :: n_pairs = 0
      integer :: quadrilaterals = 0, second_order = 0 !< elements that were cut
      integer :: left_out = 0 !< elements that are no surfaces
   contains
      procedure :: add
      procedure :: make
      procedure :: number_of
      procedure :: notes
   end type raw_mesh_t

   integer, parameter :: first_capacity = 1024
   !> Diagonals of a quadrilateral that are equal to this part count as equal: then it is cut from its first node to its third.
   real(wp), parameter :: equal_diagonals = 1.0e-6_wp

contains

   !> Whether elements of a dimension with so many nodes can be taken.
   pure logical function can_cut(dimension, nodes)
      integer, intent(in) :: dimension, nodes
      select case (dimension)
      case (0); can_cut = nodes == 1
      case (1); can_cut = nodes == 2 .or. nodes == 3
      case (2); can_cut = any(nodes == [3, 4, 6, 8, 9])
      case default; can_cut = .false.
      end select
   end function can_cut

   !> Add an element, in pieces where it has more nodes than a line or triangle: corners first, then mid-side nodes in the order of
   !> the sides (of lines: the ends, then the middle), then the centre.
   subroutine add(self, dimension, nodes, tag, place)
      class(raw_mesh_t), intent(inout) :: self
      integer, intent(in) :: dimension
      integer(i8), intent(in) :: nodes(:)
      integer(i8), intent(in) :: tag
      integer, intent(in) :: place

      if (dimension < 2) then
         if (size(nodes) == 3) then
            call put([1, 3])
            call put([3, 2])
         else
            call put([1, 2])
         end if
         return
      end if
      if (size(nodes) == 4 .or. size(nodes) >= 8) self%quadrilaterals = self%quadrilaterals + 1
      if (size(nodes) > 4) self%second_order = self%second_order + 1
      select case (size(nodes))
      case (3); call put([1, 2, 3])
      case (4); call put_quadrilateral(1, 2, 3, 4)
      case (6)
         call put([1, 4, 6])
         call put([4, 2, 5])
         call put([6, 5, 3])
         call put([4, 5, 6])
      case (8)
         call put([1, 5, 8])
         call put([2, 6, 5])
         call put([3, 7, 6])
         call put([4, 8, 7])
         call put_quadrilateral(5, 6, 7, 8)
      case (9)
         call put_quadrilateral(1, 5, 9, 8)
         call put_quadrilateral(5, 2, 6, 9)
         call put_quadrilateral(9, 6, 3, 7)
         call put_quadrilateral(8, 9, 7, 4)
      end select

   contains

      subroutine put_quadrilateral(a, b, c, d)
         integer, intent(in) :: a, b, c, d
         integer, allocatable :: grown(:)
         if (.not. allocated(self%pairs)) allocate (self%pairs(first_capacity))
         if (self%n_pairs == size(self%pairs)) then
            allocate (grown(2*self%n_pairs))
            grown(:self%n_pairs) = self%pairs
            call move_alloc(grown, self%pairs)
         end if
         self%n_pairs = self%n_pairs + 1
         self%pairs(self%n_pairs) = self%elements(2)%count + 1
         call put([a, b, c])
         call put([a, c, d])
      end subroutine put_quadrilateral

      subroutine put(which)
         integer, intent(in) :: which(:)
         associate (list => self%elements(dimension))
            call reserve(list, dimension + 1)
            list%count = list%count + 1
            list%nodes(:, list%count) = nodes(which(:dimension + 1))
            list%tags(list%count) = tag
            list%places(list%count) = place
         end associate
      end subroutine put
   end subroutine add

   !> Room for one more.
   pure subroutine reserve(list, nodes)
      type(list_t), intent(inout) :: list
      integer, intent(in) :: nodes !< of an element
      integer(i8), allocatable :: wide(:, :), tags(:)
      integer, allocatable :: places(:)
      integer :: n
      if (.not. allocated(list%tags)) then
         allocate (list%nodes(nodes, first_capacity), list%tags(first_capacity), list%places(first_capacity))
      end if
      n = list%count
      if (n < size(list%tags)) return
      allocate (wide(nodes, 2*n), tags(2*n), places(2*n))
      wide(:, :n) = list%nodes
      tags(:n) = list%tags
      places(:n) = list%places
      call move_alloc(wide, list%nodes)
      call move_alloc(tags, list%tags)
      call move_alloc(places, list%places)
   end subroutine reserve

   !> The mesh of all triangles: nodes in the order of their tags, those of no triangle dropped. An element that refers to a node
   !> which the file does not have is told by its dimension and position; dimension -1: there is none.
   subroutine make(self, mesh, bad_dimension, bad_element, bad_node)
      class(raw_mesh_t), intent(inout) :: self
      type(mesh_t), intent(out) :: mesh
      integer, intent(out) :: bad_dimension, bad_element
      integer(i8), intent(out) :: bad_node
      integer, allocatable :: order(:), triangles(:, :)
      logical, allocatable :: used(:)
      integer :: d, e, i, k

      bad_dimension = -1
      bad_element = 0
      bad_node = 0
      order = sorted_order(self%node_tags)
      self%node_tags = self%node_tags(order)
      self%coordinates = self%coordinates(:, order)
      allocate (used(size(order)), source=.false.)
      allocate (triangles(3, self%elements(2)%count))
      do d = 0, 2
         associate (list => self%elements(d))
            do e = 1, list%count
               do k = 1, d + 1
                  i = position_in_sorted(self%node_tags, list%nodes(k, e))
                  if (i == 0) then
                     bad_dimension = d
                     bad_element = e
                     bad_node = list%nodes(k, e)
                     return
                  end if
                  if (d < 2) cycle
                  triangles(k, e) = i
                  used(i) = .true.
               end do
            end do
         end associate
      end do
      do i = 1, self%n_pairs
         call cut_shorter(self%coordinates, triangles(:, self%pairs(i):self%pairs(i) + 1))
      end do
      if (allocated(self%number)) deallocate (self%number)
      allocate (self%number(size(order)), source=0)
      k = 0
      do i = 1, size(order)
         if (.not. used(i)) cycle
         k = k + 1
         self%number(i) = k
      end do
      do e = 1, size(triangles, 2)
         triangles(:, e) = self%number(triangles(:, e))
      end do
      call new_mesh(mesh, self%coordinates(:, pack([(i, i=1, size(order))], used)), triangles)
      mesh%node_tags = pack(self%node_tags, used)
      mesh%element_tags = self%elements(2)%tags(:self%elements(2)%count)
      mesh%notes = self%notes()
   end subroutine make

   !> Cut a quadrilateral along its shorter diagonal; it comes cut from its first node to its third.
   pure subroutine cut_shorter(x, pair)
      real(wp), intent(in) :: x(:, :)
      integer, intent(inout) :: pair(3, 2) !< (1, 2, 3) and (1, 3, 4)
      integer :: a, b, c, d
      a = pair(1, 1)
      b = pair(2, 1)
      c = pair(3, 1)
      d = pair(3, 2)
      if (norm2(x(:, d) - x(:, b)) > (1 - equal_diagonals)*norm2(x(:, c) - x(:, a))) return
      pair(:, 1) = [a, b, d]
      pair(:, 2) = [b, c, d]
   end subroutine cut_shorter

   !> The number in the mesh of a node, 0: it belongs to no triangle, or is not there. After `make`.
   pure integer function number_of(self, tag)
      class(raw_mesh_t), intent(in) :: self
      integer(i8), intent(in) :: tag
      number_of = position_in_sorted(self%node_tags, tag)
      if (number_of > 0) number_of = self%number(number_of)
   end function number_of

   !> What was done to elements that are no triangles; '': nothing.
   pure function notes(self) result(text)
      class(raw_mesh_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = ''
      if (self%quadrilaterals > 0) text = text//'; '//text_of(self%quadrilaterals)//' quadrilaterals were cut into triangles'
      if (self%second_order > 0) text = text//'; '//text_of(self%second_order)//' elements of second order were split at their ' &
         //'mid-side nodes'
      if (self%left_out > 0) text = text//'; '//text_of(self%left_out)//' elements that are no surfaces were left out'
      text = text(min(3, len(text) + 1):)
   end function notes
end module finshell_raw_mesh
