!> What stands in a Gmsh MSH 4.1 file, with Gmsh's own tags.
module finshell_gmsh_content
   use finshell_kinds, only: wp, i8
   use finshell_error, only: error_t, text_of
   use finshell_mesh_sorting, only: sorted_order
   use finshell_gmsh_scanner, only: gmsh_scanner_t
   implicit none
   private
   public :: physical_t, block_t, list_t, content_t, read_content, tag_text

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
      integer :: place = 0 !< of its head in the file
   end type block_t

   !> Elements of one dimension.
   type :: list_t
      integer(i8), allocatable :: nodes(:, :) !< tags (dimension + 1, elements)
      integer(i8), allocatable :: tags(:) !< of the elements
      integer, allocatable :: places(:) !< in the file: lines, in a binary file bytes
   end type list_t

   !> What has been read, with Gmsh's own tags.
   type :: content_t
      type(physical_t), allocatable :: physical(:)
      integer, allocatable :: entities(:, :) !< (2, :): dimension, tag; only if the file has $Entities
      integer, allocatable :: membership(:, :) !< (3, :): dimension, entity, physical tag (negative: reversed)
      type(block_t), allocatable :: blocks(:)
      integer(i8), allocatable :: node_tags(:)
      real(wp), allocatable :: coordinates(:, :)
      integer, allocatable :: node_places(:) !< in the file, as in list_t
      type(list_t) :: elements(0:2) !< points, lines, triangles
   end type content_t

contains

   !> Read all sections of interest.
   subroutine read_content(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(out) :: content
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: known = '$MeshFormat $PhysicalNames $Entities $Nodes $Elements '
      character(len=:), allocatable :: name, seen
      integer :: dim, here

      allocate (content%physical(0), content%membership(3, 0), content%blocks(0))
      do dim = 0, 2
         allocate (content%elements(dim)%nodes(dim + 1, 0), content%elements(dim)%tags(0), content%elements(dim)%places(0))
      end do
      seen = ''
      if (index(scanner%bytes, '$MeshFormat') /= 1) then
         call scanner%complain('this is no Gmsh mesh: it does not begin with $MeshFormat', error)
         return
      end if
      do while (.not. scanner%at_end())
         here = scanner%place()
         call scanner%take_line(name)
         if (name(1:1) /= '$') then
            call scanner%complain("found '"//name(:min(30, len(name)))//"' where a section ($...) is expected", error, here)
            return
         end if
         if (index(seen, name//' ') > 0) call scanner%complain('there is a second section '//name, error, here)
         if (allocated(error)) return
         if (index(known, name//' ') > 0) seen = seen//name//' '
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
         case default
            call scanner%skip_section(name, error)
            if (allocated(error)) return
            cycle
         end select
         call scanner%end_section(name, error)
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
      integer :: n, i, k, first, last
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
         associate (p => content%physical)
            if (p(i)%dimension < 0 .or. p(i)%dimension > 3 .or. p(i)%tag < 1) call scanner%complain('a physical group has a ' &
               //'dimension from 0 to 3 and a tag above 0, found '//text_of(p(i)%dimension)//' and '//text_of(p(i)%tag), error, &
               scanner%line - 1)
            do k = 1, i - 1
               if (p(k)%dimension == p(i)%dimension .and. p(k)%tag == p(i)%tag) call scanner%complain('the physical group ' &
                  //text_of(p(i)%tag)//' of dimension '//text_of(p(i)%dimension)//' has two names', error, scanner%line - 1)
            end do
         end associate
         if (allocated(error)) return
      end do
      scanner%binary = binary
   end subroutine read_physical_names

   subroutine read_entities(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      integer, allocatable :: membership(:, :), places(:)
      integer(i8) :: number(0:3), i, j, n
      integer :: dim, entity, k, links, unused, last, m
      real(wp) :: ignored

      do dim = 0, 3
         number(dim) = scanner%take_size(error, count=.true.)
      end do
      if (allocated(error)) return
      allocate (membership(3, 16), content%entities(2, sum(number)), places(sum(number)))
      links = 0
      last = 0
      do dim = 0, 3
         do i = 1, number(dim)
            entity = scanner%take_integer(error)
            last = last + 1
            content%entities(:, last) = [dim, entity]
            places(last) = scanner%place()
            do k = 1, merge(3, 6, dim == 0)
               ignored = scanner%take_real(error)
            end do
            n = scanner%take_size(error, count=.true.)
            do j = 1, n
               links = links + 1
               if (links > size(membership, 2)) membership = reshape(membership, [3, 2*links], pad=[0])
               membership(:, links) = [dim, entity, scanner%take_integer(error)]
               if (membership(3, links) == 0) call scanner%complain('a physical group with the tag 0', error)
               do m = links - int(j) + 1, links - 1
                  if (abs(membership(3, m)) == abs(membership(3, links))) call scanner%complain('the physical group ' &
                     //text_of(abs(membership(3, m)))//' is named twice for one entity', error)
               end do
               if (dim == 2 .and. membership(3, links)*membership(3, links - int(j) + 1) < 0) call scanner%complain( &
                  'surface '//text_of(entity)//' enters its physical groups with both signs', error)
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
      call check_twice(int(content%entities(1, :), i8)*2_i8**33 + content%entities(2, :), places, &
                       'entity of this dimension', scanner, error)
   end subroutine read_entities

   subroutine read_nodes(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      integer(i8) :: blocks, nodes, b, n, i, done, least, largest
      integer :: dim, entity, parametric, k
      real(wp) :: ignored

      blocks = scanner%take_size(error, count=.true.)
      nodes = scanner%take_size(error, count=.true.)
      least = scanner%take_size(error)
      largest = scanner%take_size(error)
      if (allocated(error)) return
      allocate (content%node_tags(nodes), content%coordinates(3, nodes), content%node_places(nodes))
      done = 0
      do b = 1, blocks
         dim = scanner%take_integer(error)
         entity = scanner%take_integer(error)
         parametric = scanner%take_integer(error)
         if (dim < 0 .or. dim > 3 .or. parametric < 0 .or. parametric > 1) call scanner%complain( &
            'a block of nodes begins with a dimension from 0 to 3, an entity, and 0 or 1 for parametric; found ' &
            //text_of(dim)//', '//text_of(entity)//', '//text_of(parametric), error)
         n = scanner%take_size(error, count=.true.)
         if (done + n > nodes) call scanner%complain('there are more nodes than the '//text_of(int(nodes))//' that $Nodes ' &
            //'announces', error)
         if (allocated(error)) return
         do i = done + 1, done + n
            content%node_tags(i) = scanner%take_size(error)
            content%node_places(i) = scanner%place()
            call check_tag(scanner, 'node', content%node_tags(i), least, largest, error)
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
      if (done < nodes) call scanner%complain('there are '//text_of(int(done))//' nodes, but $Nodes announces ' &
         //text_of(int(nodes)), error)
      call check_twice(content%node_tags, content%node_places, 'node', scanner, error)
   end subroutine read_nodes

   subroutine read_elements(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      integer(i8) :: blocks, elements, b, n, i, done, least, largest
      integer :: dim, entity, type_of_element, k
      type(list_t) :: new

      blocks = scanner%take_size(error, count=.true.)
      elements = scanner%take_size(error, count=.true.)
      least = scanner%take_size(error)
      largest = scanner%take_size(error)
      done = 0
      do b = 1, blocks
         dim = scanner%take_integer(error)
         entity = scanner%take_integer(error)
         type_of_element = scanner%take_integer(error)
         n = scanner%take_size(error, count=.true.)
         if (done + n > elements) call scanner%complain('there are more elements than the '//text_of(int(elements)) &
            //' that $Elements announces', error)
         if (allocated(error)) return
         if (.not. any(type_of_element == [15, 1, 2])) then
            call scanner%complain('entity '//text_of(entity)//' has elements of type '//text_of(type_of_element) &
               //element_name(type_of_element)//'; finshell takes 3-node triangles (type 2) and 2-node lines (type 1) only', error)
         else if (dim /= mod(type_of_element, 15)) then
            call scanner%complain('a block of elements of type '//text_of(type_of_element)//' belongs to an entity of ' &
               //'dimension '//text_of(dim)//'; '//text_of(mod(type_of_element, 15))//' is expected (is the number of elements ' &
               //'of the block before right?)', error)
         end if
         if (allocated(error)) return
         associate (list => content%elements(dim))
            content%blocks = [content%blocks, block_t(dim, entity, size(list%tags) + 1, size(list%tags) + int(n), scanner%place())]
            allocate (new%nodes(dim + 1, n), new%tags(n), new%places(n))
            do i = 1, n
               new%tags(i) = scanner%take_size(error)
               new%places(i) = scanner%place()
               call check_tag(scanner, 'element', new%tags(i), least, largest, error)
               do k = 1, dim + 1
                  new%nodes(k, i) = scanner%take_size(error)
               end do
               if (allocated(error)) return
            end do
            list%nodes = reshape([list%nodes, new%nodes], [dim + 1, size(list%tags) + int(n)])
            list%tags = [list%tags, new%tags]
            list%places = [list%places, new%places]
            deallocate (new%nodes, new%tags, new%places)
         end associate
         done = done + n
      end do
      if (done < elements) call scanner%complain('there are '//text_of(int(done))//' elements, but $Elements announces ' &
         //text_of(int(elements)), error)
      associate (e => content%elements)
         call check_twice([e(0)%tags, e(1)%tags, e(2)%tags], [e(0)%places, e(1)%places, e(2)%places], 'element', scanner, error)
      end associate
   end subroutine read_elements

   !> A tag must lie in the range that its section announces.
   subroutine check_tag(scanner, what, tag, least, largest, error)
      type(gmsh_scanner_t), intent(in) :: scanner
      character(len=*), intent(in) :: what
      integer(i8), intent(in) :: tag, least, largest
      type(error_t), allocatable, intent(inout) :: error
      if (tag >= max(1_i8, least) .and. tag <= largest .or. allocated(error)) return
      call scanner%complain('the tag '//tag_text(tag)//' of this '//what//' is not one of '//tag_text(max(1_i8, least))//' to ' &
         //tag_text(largest)//', which the section announces', error)
   end subroutine check_tag

   !> No two things may have the same tag; the second one is named.
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
         if (tags(order(i)) /= tags(order(i - 1))) cycle
         call scanner%complain('there is a second '//what//' with the same tag; the first is in '//trim(unit)//' ' &
            //text_of(places(order(i - 1))), error, places(order(i)))
         return
      end do
   end subroutine check_twice

   !> A tag as text.
   pure function tag_text(tag) result(text)
      integer(i8), intent(in) :: tag
      character(len=:), allocatable :: text
      character(len=24) :: buffer
      write (buffer, '(i0)') tag
      text = trim(buffer)
   end function tag_text

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
