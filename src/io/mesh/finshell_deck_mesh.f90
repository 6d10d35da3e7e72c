!> The mesh of an Abaqus or CalculiX deck: nodes, shells, membranes and plane elements, with their sets and surfaces. Other elements
!> (volumes, beams, springs) are left out. Sets keep their names (finshell_deck_sets). Of parts and instances there may be one.
module finshell_deck_mesh
   use finshell_deck, only: data_t, deck_t, read_deck
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: i8, wp
   use finshell_deck_sets, only: add_tag, deck_sets_t, enter_sets, find_set, read_set, read_surface
   use finshell_mesh, only: mesh_t
   use finshell_mesh_sorting, only: sorted_order
   use finshell_raw_mesh, only: raw_mesh_t
   use finshell_status, only: status_input_error
   use finshell_text, only: lower_case
   implicit none
   private
   public :: read_deck_mesh, mesh_of_deck

   type :: content_t
      type(raw_mesh_t) :: raw
      type(deck_sets_t) :: sets
      integer :: nodes = 0
      character(len=:), allocatable :: instance
   end type content_t

contains

   !> Read a deck; its mesh is not yet checked (check_mesh).
   subroutine read_deck_mesh(file_name, mesh, error)
      character(len=*), intent(in) :: file_name
      type(mesh_t), intent(out) :: mesh
      type(error_t), allocatable, intent(out) :: error
      type(deck_t) :: deck
      call read_deck(file_name, deck, error)
      if (.not. allocated(error)) call mesh_of_deck(deck, mesh, error)
   end subroutine read_deck_mesh

   subroutine mesh_of_deck(deck, mesh, error)
      type(deck_t), intent(in) :: deck
      type(mesh_t), intent(out) :: mesh
      type(error_t), allocatable, intent(out) :: error
      type(content_t) :: content
      integer(i8) :: bad_node
      integer :: bad_dimension, bad_element, c

      allocate (content%sets%sets(0), content%sets%sides(0), content%sets%element_tags(256), content%sets%element_nodes(9, 256))
      allocate (content%raw%node_tags(1024), content%raw%coordinates(3, 1024))
      do c = 1, size(deck%cards)
         select case (deck%cards(c)%keyword)
         case ('NODE'); call read_nodes(deck, c, content, error)
         case ('ELEMENT'); call read_elements(deck, c, content, error)
         case ('NSET'); call read_set(deck, c, 'NSET', content%sets, error)
         case ('ELSET'); call read_set(deck, c, 'ELSET', content%sets, error)
         case ('SURFACE'); call read_surface(deck, c, content%sets, error)
         case ('INSTANCE'); call read_instance(deck, c, content, error)
         end select
         if (allocated(error)) return
      end do
      if (.not. allocated(deck%sources)) return
      associate (file => deck%sources(1)%file)
         content%raw%node_tags = content%raw%node_tags(:content%nodes)
         content%raw%coordinates = content%raw%coordinates(:, :content%nodes)
         if (content%raw%elements(2)%count == 0) then
            call raise(error, status_input_error, file//': the deck has no shells, membranes or plane elements (' &
               //text_of(content%raw%left_out)//' other elements)')
            return
         end if
         call check_once(deck, content, error)
         if (allocated(error)) return
         call content%raw%make(mesh, bad_dimension, bad_element, bad_node)
         if (bad_dimension >= 0) then
            call raise(error, status_input_error, file//': element ' &
               //text_of(content%raw%elements(bad_dimension)%tags(bad_element))//' refers to the node '//text_of(bad_node) &
               //', which does not exist')
            return
         end if
      end associate
      call enter_sets(content%sets, content%raw, mesh)
   end subroutine mesh_of_deck

   subroutine read_nodes(deck, c, content, error)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      type(data_t) :: line
      integer(i8), allocatable :: tags(:)
      real(wp), allocatable :: grown(:, :)
      integer(i8) :: tag
      real(wp) :: x(3)
      integer :: k, n, set
      logical :: ok, fine

      set = 0
      if (deck%cards(c)%has('NSET')) call find_set(content%sets, deck%cards(c)%value('NSET'), .true., set)
      if (deck%cards(c)%has('SYSTEM')) then
         if (lower_case(deck%cards(c)%value('SYSTEM')) /= 'r') call deck%complain(c, 'cylindrical and spherical coordinates are ' &
            //'not taken (SYSTEM)', error)
      end if
      call deck%start(c, line)
      do while (deck%next(line) .and. .not. allocated(error))
         call line%whole(1, tag, ok)
         do k = 1, 3
            call line%number(k + 1, x(k), fine)
            ok = ok .and. fine
         end do
         if (.not. ok .or. tag < 1) then
            call deck%complain(c, 'a node number and up to three coordinates are expected', error, line%line)
            return
         end if
         n = content%nodes
         if (n == size(content%raw%node_tags)) then
            allocate (tags(2*n), grown(3, 2*n))
            tags(:n) = content%raw%node_tags
            grown(:, :n) = content%raw%coordinates
            call move_alloc(tags, content%raw%node_tags)
            call move_alloc(grown, content%raw%coordinates)
         end if
         content%nodes = n + 1
         content%raw%node_tags(n + 1) = tag
         content%raw%coordinates(:, n + 1) = x
         if (set > 0) call add_tag(content%sets%sets(set), tag)
      end do
   end subroutine read_nodes

   subroutine read_elements(deck, c, content, error)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      type(data_t) :: line
      integer(i8) :: numbers(10)
      integer :: i, n, nodes, set, at
      logical :: ok

      set = 0
      if (deck%cards(c)%has('ELSET')) call find_set(content%sets, deck%cards(c)%value('ELSET'), .false., set)
      nodes = nodes_of(deck%cards(c)%value('TYPE'))
      if (index(lower_case(deck%cards(c)%value('TYPE')), 'cp') == 1) content%sets%plane = .true.
      call deck%start(c, line)
      do while (deck%next(line))
         n = 0
         at = line%line
         do
            do i = 1, line%fields
               n = n + 1
               if (n > nodes + 1) exit
               call line%whole(i, numbers(n), ok)
               if (ok) ok = numbers(n) > 0
               if (nodes > 0 .and. .not. ok) then
                  call deck%complain(c, "found '"//line%field(i)%text//"' where the number of an element or node is expected", &
                                     error, line%line)
                  return
               end if
            end do
            if (.not. line%goes_on .or. (nodes > 0 .and. n > nodes)) exit
            if (.not. deck%next(line)) exit
         end do
         if (nodes == 0) then
            content%raw%left_out = content%raw%left_out + 1
            cycle
         end if
         if (n /= nodes + 1) then
            call deck%complain(c, 'an element of type '//deck%cards(c)%value('TYPE')//' has its number and '//text_of(nodes) &
               //' nodes, found '//text_of(n - 1)//' nodes', error, at)
            return
         end if
         call content%raw%add(2, numbers(2:nodes + 1), numbers(1), at)
         call keep_nodes(content%sets, numbers(1), numbers(2:nodes + 1))
         if (set > 0) call add_tag(content%sets%sets(set), numbers(1))
      end do
   end subroutine read_elements

   !> Remember the nodes of an element, for surfaces of edges.
   subroutine keep_nodes(sets, tag, nodes)
      type(deck_sets_t), intent(inout) :: sets
      integer(i8), intent(in) :: tag, nodes(:)
      integer(i8), allocatable :: tags(:), grown(:, :)
      integer :: n
      n = sets%elements
      if (n == size(sets%element_tags)) then
         allocate (tags(2*n), grown(9, 2*n))
         tags(:n) = sets%element_tags
         grown(:, :n) = sets%element_nodes
         call move_alloc(tags, sets%element_tags)
         call move_alloc(grown, sets%element_nodes)
      end if
      sets%elements = n + 1
      sets%element_tags(n + 1) = tag
      sets%element_nodes(:, n + 1) = 0
      sets%element_nodes(:size(nodes), n + 1) = nodes
   end subroutine keep_nodes

   !> Nodes of a type of surface elements; 0: it is something else.
   pure integer function nodes_of(type_name)
      character(len=*), intent(in) :: type_name
      character(len=:), allocatable :: name
      name = lower_case(type_name)
      select case (name)
      case ('s3', 's3r', 's3rs', 'stri3', 'm3d3', 'cps3', 'cpe3', 'ds3', 'sfm3d3', 'r3d3'); nodes_of = 3
      case ('s4', 's4r', 's4rs', 's4rsw', 's4r5', 'm3d4', 'm3d4r', 'cps4', 'cps4r', 'cps4i', 'ds4', 'sfm3d4', 'sfm3d4r', 'r3d4')
         nodes_of = 4
      case ('s6', 'stri65', 'm3d6', 'cps6', 'cps6m', 'ds6', 'sfm3d6'); nodes_of = 6
      case ('s8', 's8r', 's8r5', 'm3d8', 'm3d8r', 'cps8', 'cps8r', 'ds8', 'sfm3d8', 'sfm3d8r'); nodes_of = 8
      case ('s9r5', 'm3d9', 'm3d9r'); nodes_of = 9
      case default; nodes_of = 0
      end select
   end function nodes_of

   !> One instance, where its part is.
   subroutine read_instance(deck, c, content, error)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(content_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      type(data_t) :: line
      real(wp) :: x
      integer :: i
      logical :: ok
      if (allocated(content%instance)) then
         call deck%complain(c, 'a second instance; decks of one part and one instance are taken', error)
         return
      end if
      content%instance = deck%cards(c)%value('NAME')
      call deck%start(c, line)
      do while (deck%next(line))
         do i = 1, line%fields
            call line%number(i, x, ok)
            if (.not. ok .or. abs(x) > 0) then
               call deck%complain(c, 'an instance that is moved is not taken', error, line%line)
               return
            end if
         end do
      end do
   end subroutine read_instance

   !> No node and no element may be there twice.
   subroutine check_once(deck, content, error)
      type(deck_t), intent(in) :: deck
      type(content_t), intent(in) :: content
      type(error_t), allocatable, intent(inout) :: error
      integer, allocatable :: order(:)
      integer :: i
      associate (tags => content%raw%node_tags, list => content%raw%elements(2), file => deck%sources(1)%file)
         order = sorted_order(tags)
         do i = 2, size(order)
            if (tags(order(i)) /= tags(order(i - 1))) cycle
            call raise(error, status_input_error, file//': the node '//text_of(tags(order(i)))//' is there twice')
            return
         end do
         order = sorted_order(list%tags(:list%count))
         do i = 2, size(order)
            if (list%tags(order(i)) /= list%tags(order(i - 1)) .or. list%places(order(i)) == list%places(order(i - 1))) cycle
            call raise(error, status_input_error, file//': the element '//text_of(list%tags(order(i))) &
               //' is there twice, in lines '//text_of(list%places(order(i - 1)))//' and '//text_of(list%places(order(i))))
            return
         end do
      end associate
   end subroutine check_once

end module finshell_deck_mesh
