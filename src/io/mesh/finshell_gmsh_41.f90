!> Nodes and elements of Gmsh files of version 4.1.
module finshell_gmsh_41
   use finshell_kinds, only: wp, i8
   use finshell_error, only: error_t, text_of
   use finshell_gmsh_content, only: block_t, check_tag, check_twice, complain_of_kind, content_t, kind_of
   use finshell_gmsh_scanner, only: gmsh_scanner_t
   implicit none
   private
   public :: read_nodes, read_elements, check_element_tags

contains

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
      integer(i8) :: corner(9), tag, node
      integer :: dim, entity, type_of_element, kind, before, k, kept, nodes, place
      type(block_t) :: new

      blocks = scanner%take_size(error, count=.true.)
      elements = scanner%take_size(error, count=.true.)
      least = scanner%take_size(error)
      largest = scanner%take_size(error)
      done = 0
      kept = 0
      if (.not. allocated(error)) then
         deallocate (content%blocks)
         allocate (content%blocks(blocks))
      end if
      do b = 1, blocks
         dim = scanner%take_integer(error)
         entity = scanner%take_integer(error)
         type_of_element = scanner%take_integer(error)
         n = scanner%take_size(error, count=.true.)
         if (done + n > elements) call scanner%complain('there are more elements than the '//text_of(int(elements)) &
            //' that $Elements announces', error)
         if (allocated(error)) return
         call complain_of_kind(scanner, type_of_element, error)
         call kind_of(type_of_element, kind, nodes)
         if (dim /= kind) call scanner%complain('a block of elements of type '//text_of(type_of_element)//' belongs to an ' &
            //'entity of dimension '//text_of(dim)//'; '//text_of(kind)//' is expected (is the number of elements of the block ' &
            //'before right?)', error)
         if (allocated(error)) return
         new = block_t(dim, entity, scanner%place())
         do i = 1, n
            tag = scanner%take_size(error)
            place = scanner%place()
            call check_tag(scanner, 'element', tag, least, largest, error)
            do k = 1, nodes
               node = scanner%take_size(error)
               if (k <= size(corner)) corner(k) = node
            end do
            if (allocated(error)) return
            if (dim == 3) cycle
            before = content%elements(dim)%count
            call content%add(dim, corner(:nodes), tag, place)
            call new%add_range(before + 1, content%elements(dim)%count)
         end do
         if (dim == 3) content%left_out = content%left_out + int(n)
         if (dim < 3) then
            kept = kept + 1
            content%blocks(kept) = new
         end if
         done = done + n
      end do
      if (allocated(error)) return
      content%blocks = content%blocks(:kept)
      if (done < elements) call scanner%complain('there are '//text_of(int(done))//' elements, but $Elements announces ' &
         //text_of(int(elements)), error)
      call check_element_tags(scanner, content, error)
   end subroutine read_elements

   subroutine check_element_tags(scanner, content, error)
      type(gmsh_scanner_t), intent(in) :: scanner
      type(content_t), intent(in) :: content
      type(error_t), allocatable, intent(inout) :: error
      integer(i8), allocatable :: tags(:)
      integer, allocatable :: places(:)
      integer :: d
      allocate (tags(0), places(0))
      do d = 0, 2
         associate (list => content%elements(d))
            if (list%count == 0) cycle
            tags = [tags, list%tags(:list%count)]
            places = [places, list%places(:list%count)]
         end associate
      end do
      call check_twice(tags, places, 'element', scanner, error)
   end subroutine check_element_tags
end module finshell_gmsh_41
