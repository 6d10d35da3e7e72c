!> Nodes and elements of Gmsh files of version 2 (2.0 to 2.2). Groups come with each element; an element of several groups is there
!> several times, one after the other.
module finshell_gmsh_22
   use finshell_kinds, only: i8
   use finshell_error, only: error_t, text_of
   use finshell_gmsh_content, only: block_t, check_twice, complain_of_kind, content_t, kind_of
   use finshell_gmsh_scanner, only: gmsh_scanner_t
   implicit none
   private
   public :: read_old_nodes, read_old_elements

   !> The element that came last, of a dimension.
   type :: last_t
      integer :: first = 1, last = 0 !< its pieces
      integer(i8) :: nodes(9) = 0
      integer :: n = 0
   end type last_t

contains

   subroutine read_old_nodes(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      integer(i8) :: i, n
      integer :: k
      n = count_of(scanner, error)
      if (allocated(error)) return
      allocate (content%node_tags(n), content%coordinates(3, n), content%node_places(n))
      do i = 1, n
         content%node_tags(i) = scanner%take_integer(error)
         content%node_places(i) = scanner%place()
         if (content%node_tags(i) < 1) call scanner%complain('the number of a node is above 0, found ' &
            //text_of(content%node_tags(i)), error)
         do k = 1, 3
            content%coordinates(k, i) = scanner%take_real(error)
         end do
         if (allocated(error)) return
      end do
      call check_twice(content%node_tags, content%node_places, 'node', scanner, error)
   end subroutine read_old_nodes

   subroutine read_old_elements(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      type(last_t) :: last(0:2)
      integer(i8) :: n, done, i, many
      integer :: type_of_element, tag, n_tags

      n = count_of(scanner, error)
      done = 0
      do while (done < n .and. .not. allocated(error))
         if (scanner%binary) then
            type_of_element = scanner%take_integer(error)
            many = scanner%take_integer(error)
            n_tags = scanner%take_integer(error)
            if (many < 1 .or. done + many > n) call scanner%complain('a block of '//text_of(many)//' elements: $Elements ' &
               //'announces '//text_of(n)//', and '//text_of(done)//' came before', error)
            do i = 1, many
               tag = scanner%take_integer(error)
               call read_element(scanner, content, type_of_element, n_tags, tag, last, error)
               if (allocated(error)) return
            end do
            done = done + many
         else
            tag = scanner%take_integer(error)
            type_of_element = scanner%take_integer(error)
            n_tags = scanner%take_integer(error)
            call read_element(scanner, content, type_of_element, n_tags, tag, last, error)
            done = done + 1
         end if
      end do
   end subroutine read_old_elements

   !> What follows the tag of an element and the number of its further tags: these (physical group, entity, partitions), its nodes.
   subroutine read_element(scanner, content, type_of_element, n_tags, tag, last, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(inout) :: content
      integer, intent(in) :: type_of_element, n_tags, tag
      type(last_t), intent(inout) :: last(0:2)
      type(error_t), allocatable, intent(inout) :: error
      integer(i8) :: nodes(9)
      integer :: before, dimension, k, n, node, number, physical, place

      place = scanner%place()
      call complain_of_kind(scanner, type_of_element, error)
      if (tag < 1) call scanner%complain('the number of an element is above 0, found '//text_of(tag), error)
      if (n_tags < 0) call scanner%complain('an element has '//text_of(n_tags)//' tags', error)
      if (allocated(error)) return
      call kind_of(type_of_element, dimension, n)
      physical = 0
      do k = 1, n_tags
         number = scanner%take_integer(error)
         if (k == 1) physical = number
         if (allocated(error)) return
      end do
      do k = 1, n
         node = scanner%take_integer(error)
         if (k <= size(nodes)) nodes(k) = node
      end do
      if (allocated(error)) return
      if (dimension == 3) then
         content%left_out = content%left_out + 1
         return
      end if
      associate (now => last(dimension))
         before = content%elements(dimension)%count
         if (now%n == n .and. all(now%nodes(:n) == nodes(:n))) then
            if (physical /= 0) call enter(content, dimension, physical, now%first, now%last, place)
            return
         end if
         call content%add(dimension, nodes(:n), int(tag, i8), place)
         now = last_t(before + 1, content%elements(dimension)%count, nodes, n)
         if (physical /= 0) call enter(content, dimension, physical, now%first, now%last, place)
      end associate
   end subroutine read_element

   !> Enter pieces into the block of a physical group, which is an entity of its own here.
   subroutine enter(content, dimension, physical, first, last, place)
      type(content_t), intent(inout) :: content
      integer, intent(in) :: dimension, physical, first, last, place
      integer :: b
      do b = size(content%blocks), 1, -1
         if (content%blocks(b)%dimension == dimension .and. content%blocks(b)%entity == physical) exit
      end do
      if (b == 0) then
         content%blocks = [content%blocks, block_t(dimension, physical, place)]
         content%membership = reshape([content%membership, dimension, physical, physical], [3, size(content%membership, 2) + 1])
         b = size(content%blocks)
      end if
      call content%blocks(b)%add_range(first, last)
   end subroutine enter

   !> The number at the head of a section, which is text in binary files too.
   integer(i8) function count_of(scanner, error) result(n)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(error_t), allocatable, intent(inout) :: error
      logical :: binary
      character(len=:), allocatable :: rest
      binary = scanner%binary
      scanner%binary = .false.
      n = scanner%take_size(error, count=.true.)
      if (binary) call scanner%take_line(rest)
      scanner%binary = binary
   end function count_of
end module finshell_gmsh_22
