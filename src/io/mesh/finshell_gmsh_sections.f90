!> The sections of a Gmsh file, MSH 4.1 or 2, text or binary.
module finshell_gmsh_sections
   use finshell_kinds, only: wp, i8
   use finshell_error, only: error_t, text_of
   use finshell_gmsh_22, only: read_old_elements, read_old_nodes
   use finshell_gmsh_41, only: read_elements, read_nodes
   use finshell_gmsh_content, only: check_twice, content_t
   use finshell_gmsh_scanner, only: gmsh_scanner_t
   implicit none
   private
   public :: read_content

contains

   !> Read all sections of interest.
   subroutine read_content(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(out) :: content
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: known = '$MeshFormat $PhysicalNames $Entities $PartitionedEntities $Nodes ' &
         //'$Elements '
      character(len=:), allocatable :: name, seen
      integer :: here

      allocate (content%physical(0), content%membership(3, 0), content%blocks(0))
      seen = ''
      if (index(scanner%text, '$NOD') == 1) then
         call scanner%complain('this is a Gmsh mesh of version 1; save it as MSH 4.1 or 2.2', error)
      else if (index(scanner%text, '$MeshFormat') /= 1 .and. index(scanner%text, '$Comments') /= 1) then
         call scanner%complain('this is no Gmsh mesh: it does not begin with $MeshFormat', error)
      end if
      if (allocated(error)) return
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
            call read_format(scanner, content, error)
         case ('PhysicalNames')
            call read_physical_names(scanner, content, error)
         case ('Entities')
            call read_entities(scanner, content, error)
         case ('PartitionedEntities')
            call read_partitions(scanner, content, error)
         case ('Nodes')
            if (content%version == '4.1') then
               call read_nodes(scanner, content, error)
            else
               call read_old_nodes(scanner, content, error)
            end if
         case ('Elements')
            if (content%version == '4.1') then
               call read_elements(scanner, content, error)
            else
               call read_old_elements(scanner, content, error)
            end if
         case default
            call scanner%skip_section(name, error)
            if (allocated(error)) return
            cycle
         end select
         call scanner%end_section(name, error)
         if (allocated(error)) return
      end do
   end subroutine read_content

   subroutine read_format(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: version, rest
      integer :: kind_of_file, size_of_size

      call scanner%take_word(version, error)
      kind_of_file = scanner%take_integer(error)
      size_of_size = scanner%take_integer(error)
      if (allocated(error)) return
      content%version = version
      if (.not. any(version == [character(len=3) :: '4.1', '2', '2.0', '2.1', '2.2'])) then
         call scanner%complain("the format is MSH '"//version(:min(len(version), 20)) &
            //"', MSH 4.1 or 2.2 is expected (gmsh -format msh41)", error)
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

   !> A file that Gmsh has partitioned: further entities, parts of those before, with the physical groups of these.
   subroutine read_partitions(scanner, content, error)
      type(gmsh_scanner_t), intent(inout) :: scanner
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      integer(i8) :: number(0:3), i, j, n
      integer :: dim, entity, k, unused
      real(wp) :: ignored

      n = scanner%take_size(error) ! partitions
      n = scanner%take_size(error, count=.true.)
      do i = 1, 2*n
         unused = scanner%take_integer(error)
      end do
      do dim = 0, 3
         number(dim) = scanner%take_size(error, count=.true.)
      end do
      if (allocated(error)) return
      if (.not. allocated(content%entities)) allocate (content%entities(2, 0))
      do dim = 0, 3
         do i = 1, number(dim)
            entity = scanner%take_integer(error)
            content%entities = reshape([content%entities, dim, entity], [2, size(content%entities, 2) + 1])
            unused = scanner%take_integer(error) ! dimension and tag of the parent
            unused = scanner%take_integer(error)
            call skip_integers()
            do k = 1, merge(3, 6, dim == 0)
               ignored = scanner%take_real(error)
            end do
            n = scanner%take_size(error, count=.true.)
            do j = 1, n
               content%membership = reshape([content%membership, dim, entity, scanner%take_integer(error)], &
                                            [3, size(content%membership, 2) + 1])
               if (allocated(error)) return
            end do
            if (dim > 0) call skip_integers()
            if (allocated(error)) return
         end do
      end do

   contains

      subroutine skip_integers()
         integer(i8) :: many, m
         many = scanner%take_size(error, count=.true.)
         do m = 1, many
            unused = scanner%take_integer(error)
         end do
      end subroutine skip_integers
   end subroutine read_partitions
end module finshell_gmsh_sections
