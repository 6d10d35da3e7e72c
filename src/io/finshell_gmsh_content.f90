!> What stands in a Gmsh MSH 4.1 file, with Gmsh's own tags.
module finshell_gmsh_content
   use finshell_kinds, only: wp, i8
   use finshell_error, only: error_t, text_of
   use finshell_gmsh_scanner, only: gmsh_scanner_t
   implicit none
   private
   public :: physical_t, block_t, content_t, read_content

   !> A physical group and its name.
   type :: physical_t
      integer :: dimension = 0
      integer :: tag = 0
      character(len=:), allocatable :: name
   end type physical_t

   !> Elements of one entity: positions first..last in the list of elements of their dimension.
   type :: block_t
      integer :: dimension = 0
      integer :: entity = 0
      integer :: first = 1
      integer :: last = 0
   end type block_t

   !> What has been read, with Gmsh's own tags.
   type :: content_t
      type(physical_t), allocatable :: physical(:)
      integer, allocatable :: membership(:, :) !< (3, :): dimension, entity, physical tag (negative: reversed)
      type(block_t), allocatable :: blocks(:)
      integer(i8), allocatable :: node_tags(:)
      real(wp), allocatable :: coordinates(:, :)
      integer(i8), allocatable :: points(:, :), lines(:, :), triangles(:, :) !< node tags (dimension + 1, elements)
   end type content_t

contains

   !> Read all sections of interest.
   subroutine read_content(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(out) :: content
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name

      allocate (content%physical(0), content%membership(3, 0), content%blocks(0))
      allocate (content%points(1, 0), content%lines(2, 0), content%triangles(3, 0))
      if (index(scanner%bytes, '$MeshFormat') /= 1) then
         call scanner%complain('this is no Gmsh mesh: it does not begin with $MeshFormat', error)
         return
      end if
      do while (.not. scanner%at_end())
         call scanner%take_line(name)
         if (name(1:1) /= '$') then
            call scanner%complain("found '"//name(:min(30, len(name)))//"' where a section ($...) is expected", &
               error, scanner%line - 1)
            return
         end if
         name = name(2:)
         select case (name)
         case ('MeshFormat')
            call read_format(scanner, error)
         case ('PhysicalNames')
            call read_physical_names(scanner, content, error)
         case ('Entities')
            call read_entities(scanner, content, error)
         case ('PartitionedEntities')
            call scanner%complain('partitioned meshes are not supported; save the mesh without partitions', error)
         case ('Nodes')
            call read_nodes(scanner, content, error)
         case ('Elements')
            call read_elements(scanner, content, error)
         end select
         if (allocated(error)) return
         ! Sections of no interest are skipped as a whole, the others are at their end.
         call scanner%skip_section(name, error)
         if (allocated(error)) return
      end do
   end subroutine read_content

   subroutine read_format(scanner, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: version, rest
      integer :: kind_of_file, size_of_size

      call scanner%take_word(version, error)
      kind_of_file = scanner%take_integer(error)
      size_of_size = scanner%take_integer(error)
      if (allocated(error)) return
      if (version /= '4.1') then
         call scanner%complain("the format is MSH '"//version(:min(len(version), 20)) &
            //"', MSH 4.1 is expected (gmsh -format msh41)", error)
      else if (size_of_size /= 8) then
         call scanner%complain('the size of an integer is '//text_of(size_of_size)//' bytes, 8 is expected', error)
      else if (kind_of_file == 1) then
         call scanner%take_line(rest)
         scanner%binary = .true.
         if (scanner%take_integer(error) /= 1) call scanner%complain('the byte order is that of another kind of machine', error)
      end if
   end subroutine read_format

   !> This section is text in binary files, too.
   subroutine read_physical_names(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: rest
      integer :: n, i, first, last
      logical :: binary

      binary = scanner%binary
      scanner%binary = .false.
      n = int(scanner%take_size(error, count=.true.))
      deallocate (content%physical)
      allocate (content%physical(n))
      do i = 1, n
         content%physical(i)%dimension = scanner%take_integer(error)
         content%physical(i)%tag = scanner%take_integer(error)
         if (allocated(error)) return
         call scanner%take_line(rest)
         first = index(rest, '"')
         last = index(rest, '"', back=.true.)
         if (last <= first + 1) then
            call scanner%complain('the name of a physical group is missing', error, scanner%line - 1)
            return
         end if
         content%physical(i)%name = rest(first + 1:last - 1)
         if (content%physical(i)%name == 'all') then
            call scanner%complain("a physical group is named 'all'; that name is kept for the whole mesh", error, scanner%line - 1)
            return
         end if
      end do
      scanner%binary = binary
   end subroutine read_physical_names

   subroutine read_entities(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      integer, allocatable :: membership(:, :)
      integer(i8) :: number(0:3), i, j, n
      integer :: dim, entity, k, links, unused
      real(wp) :: ignored

      do dim = 0, 3
         number(dim) = scanner%take_size(error, count=.true.)
      end do
      allocate (membership(3, 16))
      links = 0
      do dim = 0, 3
         do i = 1, number(dim)
            entity = scanner%take_integer(error)
            do k = 1, merge(3, 6, dim == 0)
               ignored = scanner%take_real(error)
            end do
            n = scanner%take_size(error, count=.true.)
            do j = 1, n
               links = links + 1
               if (links > size(membership, 2)) membership = reshape(membership, [3, 2*links], pad=[0])
               membership(:, links) = [dim, entity, scanner%take_integer(error)]
            end do
            if (dim > 0) then
               n = scanner%take_size(error, count=.true.)
               do j = 1, n
                  unused = scanner%take_integer(error)
               end do
            end if
            if (allocated(error)) return
         end do
      end do
      content%membership = membership(:, :links)
   end subroutine read_entities

   subroutine read_nodes(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      integer(i8) :: blocks, nodes, b, n, i, done, ignored_size
      integer :: dim, entity, parametric, k
      real(wp) :: ignored

      blocks = scanner%take_size(error, count=.true.)
      nodes = scanner%take_size(error, count=.true.)
      ignored_size = scanner%take_size(error)
      ignored_size = scanner%take_size(error)
      if (allocated(content%node_tags)) call scanner%complain('there is a second section $Nodes', error)
      if (allocated(error)) return
      allocate (content%node_tags(nodes), content%coordinates(3, nodes))
      done = 0
      do b = 1, blocks
         dim = scanner%take_integer(error)
         entity = scanner%take_integer(error)
         parametric = scanner%take_integer(error)
         n = scanner%take_size(error, count=.true.)
         if (done + n > nodes) call scanner%complain('there are more nodes than $Nodes announces', error)
         if (allocated(error)) return
         do i = done + 1, done + n
            content%node_tags(i) = scanner%take_size(error)
         end do
         do i = done + 1, done + n
            do k = 1, 3
               content%coordinates(k, i) = scanner%take_real(error)
            end do
            do k = 1, merge(dim, 0, parametric /= 0)
               ignored = scanner%take_real(error)
            end do
            if (allocated(error)) return
         end do
         done = done + n
      end do
      if (done < nodes) call scanner%complain('there are fewer nodes than $Nodes announces', error)
   end subroutine read_nodes

   subroutine read_elements(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      integer(i8), allocatable :: nodes(:, :)
      integer(i8) :: blocks, b, n, i, ignored
      integer :: dim, entity, type_of_element, k

      blocks = scanner%take_size(error, count=.true.)
      do k = 1, 3
         ignored = scanner%take_size(error)
      end do
      do b = 1, blocks
         dim = scanner%take_integer(error)
         entity = scanner%take_integer(error)
         type_of_element = scanner%take_integer(error)
         n = scanner%take_size(error, count=.true.)
         if (allocated(error)) return
         select case (type_of_element)
         case (15)
            dim = 0
         case (1)
            dim = 1
         case (2)
            dim = 2
         case default
            call scanner%complain('entity '//text_of(entity)//' has elements of type '//text_of(type_of_element) &
               //element_name(type_of_element)//'; finshell takes 3-node triangles (type 2) and 2-node lines (type 1) only', error)
            return
         end select
         allocate (nodes(dim + 1, n))
         do i = 1, n
            ignored = scanner%take_size(error)
            do k = 1, dim + 1
               nodes(k, i) = scanner%take_size(error)
            end do
            if (allocated(error)) return
         end do
         select case (dim)
         case (0); call append(content%points)
         case (1); call append(content%lines)
         case (2); call append(content%triangles)
         end select
         deallocate (nodes)
      end do

   contains

      subroutine append(list)
         integer(i8), allocatable, intent(inout) :: list(:, :)
         integer :: before
         before = size(list, 2)
         content%blocks = [content%blocks, block_t(dim, entity, before + 1, before + int(n))]
         list = reshape([list, nodes], [dim + 1, before + int(n)])
      end subroutine append
   end subroutine read_elements

   pure function element_name(type_of_element) result(text)
      integer, intent(in) :: type_of_element
      character(len=:), allocatable :: text
      select case (type_of_element)
      case (3); text = ' (4-node quadrilaterals: do not recombine)'
      case (8, 26:28); text = ' (curved lines: mesh with order 1)'
      case (9, 20:25); text = ' (triangles with more than 3 nodes: mesh with order 1)'
      case (10, 16); text = ' (quadrilaterals with more than 4 nodes: do not recombine, mesh with order 1)'
      case (4:7, 11:14, 17:19, 29:31, 92, 93); text = ' (volume elements: save surfaces only)'
      case default; text = ''
      end select
   end function element_name
end module finshell_gmsh_content
