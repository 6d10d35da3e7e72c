!> What stands in a Gmsh file, with Gmsh's own tags.
module finshell_gmsh_content
   use finshell_kinds, only: i8
   use finshell_error, only: error_t, text_of
   use finshell_mesh_sorting, only: sorted_order
   use finshell_gmsh_scanner, only: gmsh_scanner_t
   use finshell_raw_mesh, only: raw_mesh_t, can_cut
   implicit none
   private
   public :: physical_t, block_t, content_t, check_tag, check_twice, kind_of, complain_of_kind

   !> A physical group and its name.
   type :: physical_t
      integer :: dimension = 0
      integer :: tag = 0
      character(len=:), allocatable :: name
   end type physical_t

   !> Elements of one entity: `count` positions in the list of elements of their dimension.
   type :: block_t
      integer :: dimension = 0
      integer :: entity = 0
      integer :: place = 0 !< of its head in the file
      integer :: count = 0
      integer, allocatable :: members(:)
   contains
      procedure :: add_range
   end type block_t

   !> What has been read.
   type, extends(raw_mesh_t) :: content_t
      character(len=3) :: version = '4.1'
      type(physical_t), allocatable :: physical(:)
      integer, allocatable :: entities(:, :) !< (2, :): dimension, tag; only if the file has $Entities
      integer, allocatable :: membership(:, :) !< (3, :): dimension, entity, physical tag (negative: reversed)
      type(block_t), allocatable :: blocks(:)
   end type content_t

   !> Gmsh's types of elements by number: dimension and nodes.
   integer, parameter :: known_kinds = 31
   integer, parameter :: dimensions(known_kinds) = [1, 2, 2, 3, 3, 3, 3, 1, 2, 2, 3, 3, 3, 3, 0, 2, 3, 3, 3, 2, 2, 2, 2, 2, 2, 1, &
      1, 1, 3, 3, 3]
   integer, parameter :: nodes_of(known_kinds) = [2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10, 12, 15, &
      15, 21, 4, 5, 6, 20, 35, 56]

contains

   !> Add the positions first..last.
   pure subroutine add_range(self, first, last)
      class(block_t), intent(inout) :: self
      integer, intent(in) :: first, last
      integer, allocatable :: grown(:)
      integer :: i
      if (.not. allocated(self%members)) allocate (self%members(max(16, last - first + 1)))
      if (self%count + last - first + 1 > size(self%members)) then
         allocate (grown(2*(self%count + last - first + 1)))
         grown(:self%count) = self%members(:self%count)
         call move_alloc(grown, self%members)
      end if
      do i = first, last
         self%count = self%count + 1
         self%members(self%count) = i
      end do
   end subroutine add_range

   !> Dimension and nodes of a type of elements; 0 nodes: not known.
   pure subroutine kind_of(type_of_element, dimension, nodes)
      integer, intent(in) :: type_of_element
      integer, intent(out) :: dimension, nodes
      dimension = 0
      nodes = 0
      if (type_of_element == 92 .or. type_of_element == 93) then
         dimension = 3
         nodes = merge(64, 125, type_of_element == 92)
      else if (type_of_element >= 1 .and. type_of_element <= known_kinds) then
         dimension = dimensions(type_of_element)
         nodes = nodes_of(type_of_element)
      end if
   end subroutine kind_of

   !> Refuse lines and surfaces of higher order, and what is not known.
   subroutine complain_of_kind(scanner, type_of_element, error)
      type(gmsh_scanner_t), intent(in) :: scanner
      integer, intent(in) :: type_of_element
      type(error_t), allocatable, intent(inout) :: error
      integer :: dimension, nodes
      call kind_of(type_of_element, dimension, nodes)
      if (nodes == 0) then
         call scanner%complain('elements of type '//text_of(type_of_element)//' are not known', error)
      else if (dimension < 3 .and. .not. can_cut(dimension, nodes)) then
         call scanner%complain('elements of type '//text_of(type_of_element)//' ('//text_of(nodes)//' nodes) are of third order ' &
            //'or higher; mesh with order 1 or 2', error)
      end if
   end subroutine complain_of_kind

   !> A tag must lie in the range that its section announces.
   subroutine check_tag(scanner, what, tag, least, largest, error)
      type(gmsh_scanner_t), intent(in) :: scanner
      character(len=*), intent(in) :: what
      integer(i8), intent(in) :: tag, least, largest
      type(error_t), allocatable, intent(inout) :: error
      if (tag >= max(1_i8, least) .and. tag <= largest .or. allocated(error)) return
      call scanner%complain('the tag '//text_of(tag)//' of this '//what//' is not one of '//text_of(max(1_i8, least))//' to ' &
         //text_of(largest)//', which the section announces', error)
   end subroutine check_tag

   !> No two things may have the same tag, except pieces of one; the second one is named.
   subroutine check_twice(tags, places, what, scanner, error)
      integer(i8), intent(in) :: tags(:)
      integer, intent(in) :: places(:)
      character(len=*), intent(in) :: what
      type(gmsh_scanner_t), intent(in) :: scanner
      type(error_t), allocatable, intent(inout) :: error
      integer, allocatable :: order(:)
      integer :: i
      character(len=6) :: unit

      if (allocated(error)) return
      unit = merge('byte  ', 'line  ', scanner%binary)
      order = sorted_order(tags)
      do i = 2, size(order)
         if (tags(order(i)) /= tags(order(i - 1)) .or. places(order(i)) == places(order(i - 1))) cycle
         call scanner%complain('there is a second '//what//' with the same tag; the first is in '//trim(unit)//' ' &
            //text_of(places(order(i - 1))), error, places(order(i)))
         return
      end do
   end subroutine check_twice
end module finshell_gmsh_content
