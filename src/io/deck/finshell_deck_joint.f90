!> Ties, rigid bodies, couplings and multi-point constraints of a deck as joints.
module finshell_deck_joint
   use finshell_deck, only: data_t, deck_t
   use finshell_deck_connector, only: add_node
   use finshell_deck_writer, only: alias_t, body_t, number_text, quoted, writer_t
   use finshell_kinds, only: i8, wp
   use finshell_mesh, only: find_edge_set
   use finshell_mesh_sorting, only: position_in_sorted
   use finshell_text, only: lower_case, parse_integer, parse_real
   implicit none
   private
   public :: convert_joints

   character, parameter :: lf = achar(10)
   character(len=2), parameter :: components(3) = ['ux', 'uy', 'uz']

contains

   !> All of them. To be called before what refers to their nodes.
   subroutine convert_joints(deck, writer)
      type(deck_t), intent(in) :: deck
      type(writer_t), intent(inout) :: writer
      integer :: c
      do c = 1, size(deck%cards)
         select case (deck%cards(c)%keyword)
         case ('TIE'); call convert_tie(deck, c, writer)
         case ('RIGID BODY'); call convert_rigid_body(deck, c, writer)
         case ('COUPLING'); call convert_coupling(deck, c, writer)
         case ('KINEMATIC COUPLING'); call convert_kinematic(deck, c, writer)
         case ('MPC'); call convert_mpc(deck, c, writer)
         end select
      end do
   end subroutine convert_joints

   !> The node set of a set of nodes, or of a surface; '': there is none.
   function nodes_of(field, writer) result(name)
      character(len=*), intent(in) :: field
      type(writer_t), intent(inout) :: writer
      character(len=:), allocatable :: name, elements
      name = writer%node_set(field) ! edges make a set of their nodes, too
      if (name /= '') return
      elements = writer%element_set(field)
      if (elements == '') return
      name = 'nodes_of_'//elements
      if (index(writer%sets, "&node_set name = '"//name//"'") == 0) writer%sets = writer%sets//'&node_set name = '//quoted(name) &
         //' element_set = '//quoted(elements)//' /'//lf
   end function nodes_of

   !> *TIE: slave and master surface.
   subroutine convert_tie(deck, c, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      character(len=:), allocatable :: group, master, slave
      integer, allocatable :: members(:)
      real(wp) :: tolerance
      logical :: ok

      if (deck%cards(c)%has('CYCLIC SYMMETRY') .or. deck%cards(c)%has('MULTISTAGE')) then
         call writer%miss(deck, c, 'CYCLIC SYMMETRY')
         return
      end if
      call deck%start(c, line)
      do while (deck%next(line))
         slave = ''
         if (line%fields >= 2) slave = nodes_of(line%field(1)%text, writer)
         master = ''
         if (slave /= '') master = writer%element_set(line%field(2)%text)
         group = '&tie node_set = '//quoted(slave)
         if (master == '' .and. slave /= '') then
            ! edges: the elements that have them
            master = writer%edge_set(line%field(2)%text)
            if (master /= '') master = writer%list_set('element_set', elements_at_edges(writer, master))
         end if
         if (master /= '') then
            group = group//' to_element_set = '//quoted(master)
         else
            if (slave /= '') master = writer%node_set(line%field(2)%text)
            group = group//' to_node_set = '//quoted(master)
         end if
         if (master == '') then
            call writer%miss(deck, c, 'two surfaces with nodes of a shell are expected', line%line)
            cycle
         end if
         if (deck%cards(c)%has('POSITION TOLERANCE')) then
            call parse_real(deck%cards(c)%value('POSITION TOLERANCE'), tolerance, ok)
            if (ok .and. tolerance > 0) group = group//' tolerance = '//number_text(tolerance)
         end if
         if (deck%cards(c)%has('NO ROTATION')) group = group//' rotations = .false.'
         if (lower_case(deck%cards(c)%value('ADJUST')) /= 'no') group = group//' adjust = .true.'
         writer%joints = writer%joints//group//' /'//lf
         members = writer%members_of('node_set', slave)
         if (index(slave, 'nodes_of_') == 1) members = nodes_in(writer, slave)
         writer%bodies = [writer%bodies, body_t(members, '')]
      end do
   end subroutine convert_tie

   !> The elements with two nodes of an edge set.
   function elements_at_edges(writer, name) result(list)
      type(writer_t), intent(in) :: writer
      character(len=*), intent(in) :: name
      integer, allocatable :: list(:)
      logical, allocatable :: inside(:)
      integer :: e, i
      allocate (inside(size(writer%mesh%coordinates, 2)), source=.false.)
      associate (edges => writer%mesh%edge_sets(find_edge_set(writer%mesh, name))%edges)
         do i = 1, size(edges, 2)
            inside(edges(:, i)) = .true.
         end do
      end associate
      associate (triangles => writer%mesh%triangles)
         list = pack([(e, e=1, size(triangles, 2))], [(count(inside(triangles(:, e))) >= 2, e=1, size(triangles, 2))])
      end associate
   end function elements_at_edges

   !> A reference node of a body: a node of the mesh, or one beside it, which the sets that consist of it then name.
   function reference_of(deck, field, writer) result(name)
      type(deck_t), intent(in) :: deck
      character(len=*), intent(in) :: field
      type(writer_t), intent(inout) :: writer
      character(len=:), allocatable :: name
      call add_node(deck, field, writer)
      name = writer%node_set(field)
      if (name /= '') call name_alone(deck, field, name, 0, writer)
   end function reference_of

   !> Sets of the deck that consist of one node, which is not in the mesh, stand for it.
   subroutine name_alone(deck, field, set, shift, writer)
      type(deck_t), intent(in) :: deck
      character(len=*), intent(in) :: field, set
      integer, intent(in) :: shift
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      integer(i8) :: tag
      integer :: c, n
      logical :: ok
      character(len=:), allocatable :: word
      call parse_integer(field, tag, ok)
      if (.not. ok) return
      if (position_in_sorted(writer%mesh%node_tags, tag) > 0) return
      if (shift > 0) writer%aliases = [writer%aliases, alias_t(field, set, shift)]
      do c = 1, size(deck%cards)
         if (deck%cards(c)%keyword /= 'NSET' .and. .not. (deck%cards(c)%keyword == 'NODE' .and. deck%cards(c)%has('NSET'))) cycle
         n = 0
         word = ''
         call deck%start(c, line)
         do while (deck%next(line))
            if (deck%cards(c)%keyword == 'NODE') n = n + 1
            if (deck%cards(c)%keyword /= 'NODE') n = n + line%fields
            word = line%field(1)%text
         end do
         if (n /= 1 .or. word /= field) cycle
         word = lower_case(deck%cards(c)%value('NSET'))
         if (writer%node_set(word) == '') writer%aliases = [writer%aliases, alias_t(word, set, shift)]
      end do
   end subroutine name_alone

   !> *RIGID BODY of a set of nodes or elements, with a reference node and a node whose displacements are its rotations.
   subroutine convert_rigid_body(deck, c, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      character(len=:), allocatable :: body, reference, turning

      body = ''
      associate (card => deck%cards(c))
         if (card%has('NSET')) body = nodes_of(card%value('NSET'), writer)
         if (card%has('ELSET')) body = nodes_of(card%value('ELSET'), writer)
         if (card%has('TIE NSET')) body = nodes_of(card%value('TIE NSET'), writer)
         if (card%has('ANALYTICAL SURFACE')) body = ''
         reference = card%value('REF NODE')
         if (reference /= '' .and. body /= '') reference = reference_of(deck, reference, writer)
         if (body == '' .or. reference == '') then
            call writer%miss(deck, c, 'NSET or ELSET with nodes of a shell and REF NODE are expected')
            return
         end if
         if (card%has('PIN NSET')) call writer%miss(deck, c, 'PIN NSET')
         call add_body(body, reference, .true., writer)
         turning = card%value('ROT NODE')
         if (turning /= '') call name_alone(deck, turning, reference, 3, writer)
      end associate
   end subroutine convert_rigid_body

   !> A rigid body without its reference node among its nodes.
   subroutine add_body(body, reference, rotations, writer)
      character(len=*), intent(in) :: body, reference
      logical, intent(in) :: rotations
      type(writer_t), intent(inout) :: writer
      character(len=:), allocatable :: set, words
      integer, allocatable :: members(:), master(:)
      set = body
      words = ''
      if (.not. rotations) words = ' rotations = .false.'
      master = writer%members_of('node_set', reference)
      members = writer%members_of('node_set', body)
      if (index(body, 'nodes_of_') == 1) members = nodes_in(writer, body)
      if (size(master) == 1) then
         if (any(members == master(1))) then
            members = pack(members, members /= master(1))
            set = writer%list_set('node_set', members)
         end if
      end if
      writer%bodies = [writer%bodies, body_t(members, reference)]
      writer%joints = writer%joints//'&rigid_body node_set = '//quoted(set)//' reference = '//quoted(reference)//words//' /'//lf
   end subroutine add_body

   !> The nodes of the elements of a set that `nodes_of` has named.
   function nodes_in(writer, name) result(list)
      type(writer_t), intent(inout) :: writer
      character(len=*), intent(in) :: name
      integer, allocatable :: list(:), elements(:)
      logical, allocatable :: inside(:)
      integer :: i
      elements = writer%members_of('element_set', name(len('nodes_of_') + 1:))
      allocate (inside(size(writer%mesh%coordinates, 2)), source=.false.)
      do i = 1, size(elements)
         inside(writer%mesh%triangles(:, elements(i))) = .true.
      end do
      list = pack([(i, i=1, size(inside))], inside)
   end function nodes_in

   !> *COUPLING with *KINEMATIC behind it.
   subroutine convert_coupling(deck, c, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      character(len=:), allocatable :: body
      logical :: held(6)
      held = .false.
      if (c < size(deck%cards)) then
         if (deck%cards(c + 1)%keyword == 'KINEMATIC') then
            call deck%start(c + 1, line)
            if (.not. deck%next(line)) held = .true.
            call deck%start(c + 1, line)
            do while (deck%next(line))
               call mark(line, 1, held)
            end do
         end if
      end if
      if (deck%cards(c)%has('ORIENTATION')) held = .false.
      body = nodes_of(deck%cards(c)%value('SURFACE'), writer)
      call couple(deck, c, body, held, writer)
   end subroutine convert_coupling

   !> *KINEMATIC COUPLING: sets and the degrees of freedom that go with the reference node.
   subroutine convert_kinematic(deck, c, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      character(len=:), allocatable :: body, next
      logical :: held(6)
      body = ''
      held = .false.
      call deck%start(c, line)
      do while (deck%next(line))
         next = nodes_of(line%field(1)%text, writer)
         if (body /= '' .and. next /= body) then
            call couple(deck, c, body, held, writer)
            held = .false.
         end if
         body = next
         call mark(line, 2, held)
      end do
      call couple(deck, c, body, held, writer)
   end subroutine convert_kinematic

   !> Degrees of freedom from field `at` to the next; all where there are none.
   subroutine mark(line, at, held)
      type(data_t), intent(in) :: line
      integer, intent(in) :: at
      logical, intent(inout) :: held(6)
      integer(i8) :: first, last
      logical :: ok
      call line%whole(at, first, ok)
      if (.not. ok) then
         held = .true.
         return
      end if
      call line%whole(at + 1, last, ok)
      if (.not. ok) last = first
      if (first >= 1 .and. last <= 6) held(first:last) = .true.
   end subroutine mark

   subroutine couple(deck, c, body, held, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      character(len=*), intent(in) :: body
      logical, intent(in) :: held(6)
      type(writer_t), intent(inout) :: writer
      character(len=:), allocatable :: reference
      logical :: whole
      whole = body /= '' .and. all(held(:3)) .and. (all(held(4:)) .or. .not. any(held(4:)))
      reference = ''
      if (whole) reference = reference_of(deck, deck%cards(c)%value('REF NODE'), writer)
      if (reference == '') then
         call writer%miss(deck, c, 'nodes of a shell that go with a reference node in all displacements, and in all rotations ' &
                          //'or none, are expected')
      else
         call add_body(body, reference, all(held(4:)), writer)
      end if
   end subroutine couple

   !> *MPC of two nodes: BEAM, TIE, PIN; the first depends.
   subroutine convert_mpc(deck, c, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      character(len=:), allocatable :: a, b, kind
      character(len=4), parameter :: known(3) = ['beam', 'tie ', 'pin ']
      integer :: k
      logical :: together

      call deck%start(c, line)
      do while (deck%next(line))
         kind = lower_case(line%field(1)%text)
         a = ''
         b = ''
         if (line%fields == 3) then
            if (any(kind == known)) a = writer%node_set(line%field(2)%text)
            if (a /= '') b = reference_of(deck, line%field(3)%text, writer)
         end if
         if (a == '' .or. b == '') then
            call writer%miss(deck, c, 'BEAM, TIE or PIN, a node of a shell and another node are expected', line%line)
            cycle
         end if
         together = at_one_place(writer, a, b)
         if (kind == 'tie' .and. .not. together) then
            call writer%miss(deck, c, 'TIE of nodes that are not at one place', line%line)
         else if (kind == 'beam') then
            call add_body(a, b, .true., writer)
         else if (kind == 'tie') then
            writer%joints = writer%joints//'&tie node_set = '//quoted(a)//' to_node_set = '//quoted(b)//' /'//lf
            writer%bodies = [writer%bodies, body_t(writer%members_of('node_set', a), '')]
         else
            do k = 1, size(components)
               writer%joints = writer%joints//'&equation node_set = '//quoted(a)//', '//quoted(b)//' components = ' &
                  //quoted(components(k))//', '//quoted(components(k))//' coefficients = 1.0, -1.0 /'//lf
            end do
         end if
      end do
   end subroutine convert_mpc

   logical function at_one_place(writer, a, b)
      type(writer_t), intent(in) :: writer
      character(len=*), intent(in) :: a, b
      integer, allocatable :: i(:), j(:)
      i = writer%members_of('node_set', a)
      j = writer%members_of('node_set', b)
      at_one_place = .false.
      if (size(i) /= 1 .or. size(j) /= 1) return
      if (i(1) < 1 .or. j(1) < 1) return
      associate (x => writer%mesh%coordinates)
         at_one_place = norm2(x(:, i(1)) - x(:, j(1))) <= 1.0e-6_wp*maxval(maxval(x, dim=2) - minval(x, dim=2))
      end associate
   end function at_one_place
end module finshell_deck_joint
