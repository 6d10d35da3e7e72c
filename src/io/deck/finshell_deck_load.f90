!> Supports and loads of a deck as groups of a namelist.
module finshell_deck_load
   use finshell_deck, only: data_t, deck_t
   use finshell_deck_history, only: boundary, distributed, entry_t, history_t, nodal, on_surface
   use finshell_deck_plane, only: side_thickness
   use finshell_deck_schedule, only: clock, read_table, riks
   use finshell_deck_sets, only: side_name
   use finshell_deck_writer, only: vector_text, writer_t
   use finshell_kinds, only: i8, wp
   use finshell_mesh, only: find_edge_set
   use finshell_text, only: lower_case
   implicit none
   private
   public :: new_entry, enter, convert_boundary, convert_nodal_load, convert_distributed_load

   character(len=2), parameter :: components(6) = ['ux', 'uy', 'uz', 'rx', 'ry', 'rz']

contains

   !> *BOUNDARY.
   subroutine convert_boundary(deck, c, writer, history)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      type(history_t), intent(inout) :: history
      type(data_t) :: line
      type(entry_t) :: entry
      character(len=:), allocatable :: set
      integer(i8) :: first, last
      real(wp) :: value
      integer :: k, shift
      integer, allocatable :: held(:)
      logical :: ok, fine

      call new_entry(deck, c, boundary, writer, history, entry)
      if (deck%cards(c)%has('TYPE')) call writer%miss(deck, c, 'TYPE = '//deck%cards(c)%value('TYPE'))
      call deck%start(c, line)
      do while (deck%next(line))
         set = writer%node_set(line%field(1)%text)
         shift = writer%shift_of(line%field(1)%text)
         if (set == '' .or. line%fields < 2) then
            call writer%miss(deck, c, "'"//line%field(1)%text//"': it has no node of a shell, or nothing is held", line%line)
            cycle
         end if
         call line%whole(2, first, ok)
         value = 0
         if (.not. ok) then
            held = held_by(line%field(2)%text)
            if (size(held) == 0) call writer%miss(deck, c, "'"//line%field(2)%text//"' is not known", line%line)
         else
            last = first
            if (line%fields > 2) call line%whole(3, last, fine)
            if (line%fields > 2 .and. .not. fine) last = first
            call line%number(4, value, ok)
            if (shift > 0 .and. last <= size(components)) last = min(last, 3_i8)
            if (first < 1 .or. last + shift > size(components) .or. last < first .or. .not. ok) then
               call writer%miss(deck, c, 'degrees of freedom 1 to 6 and a number are expected', line%line)
               cycle
            end if
            held = [(k + shift, k=int(first), int(last))]
         end if
         if (late(history)) call writer%miss(deck, c, 'a support that comes with a later step holds nodes where ' &
                                                  //'they are then, and moves them from there', line%line)
         do k = 1, size(held)
            entry%key = components(held(k))
            call enter(deck, c, line%line, writer, history, entry, 'node_set', set, value)
         end do
      end do

   contains

      !> Whether nodes may have moved when a support comes that was not there.
      logical function late(history)
         type(history_t), intent(in) :: history
         integer :: i
         integer, allocatable :: members(:), known(:)
         late = .false.
         if (history%schedule%way /= clock .or. history%step < 2 .or. deck%cards(c)%has('FIXED')) return
         members = writer%members_of('node_set', set)
         do k = 1, size(held)
            known = [integer ::]
            do i = 1, history%count
               if (history%entries(i)%alive .and. history%entries(i)%key == components(held(k))) known = &
                  [known, history%entries(i)%members]
            end do
            do i = 1, size(members)
               late = late .or. .not. any(known == members(i))
            end do
         end do
      end function late
   end subroutine convert_boundary

   !> What Abaqus' named boundary conditions hold.
   pure function held_by(name) result(list)
      character(len=*), intent(in) :: name
      integer, allocatable :: list(:)
      select case (lower_case(name))
      case ('encastre'); list = [1, 2, 3, 4, 5, 6]
      case ('pinned'); list = [1, 2, 3]
      case ('xsymm'); list = [1, 5, 6]
      case ('ysymm'); list = [2, 4, 6]
      case ('zsymm'); list = [3, 4, 5]
      case ('xasymm'); list = [2, 3, 4]
      case ('yasymm'); list = [1, 3, 5]
      case ('zasymm'); list = [1, 2, 6]
      case default; list = [integer ::]
      end select
   end function held_by

   !> *CLOAD.
   subroutine convert_nodal_load(deck, c, writer, history)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      type(history_t), intent(inout) :: history
      type(data_t) :: line
      type(entry_t) :: entry
      character(len=:), allocatable :: set
      integer(i8) :: component
      real(wp) :: value
      logical :: ok, fine

      if (deck%cards(c)%has('FOLLOWER')) call writer%miss(deck, c, 'FOLLOWER: the direction stays')
      call new_entry(deck, c, nodal, writer, history, entry)
      entry%form = 2
      entry%after = 'vector'
      call deck%start(c, line)
      do while (deck%next(line))
         set = writer%node_set(line%field(1)%text)
         call line%whole(2, component, ok)
         component = component + writer%shift_of(line%field(1)%text)
         call line%number(3, value, fine)
         if (set == '' .or. .not. (ok .and. fine) .or. component < 1 .or. component > size(components)) then
            call writer%miss(deck, c, "'"//line%field(1)%text//"': a node or set of a shell, a degree of freedom 1 to 6 and a " &
               //'number are expected', line%line)
            cycle
         end if
         entry%direction = 0
         entry%direction(1 + mod(int(component) - 1, 3)) = 1
         entry%key = 'force '//components(component)
         entry%before = '&load type = '//trim(merge("'force' ", "'moment'", component <= 3))
         call enter(deck, c, line%line, writer, history, entry, 'node_set', set, value)
      end do
   end subroutine convert_nodal_load

   !> *DLOAD, *DSLOAD. A pressure on elements is positive along their normal; on a surface it is positive against its outer side.
   subroutine convert_distributed_load(deck, c, writer, history)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      type(history_t), intent(inout) :: history
      type(data_t) :: line
      type(entry_t) :: entry
      character(len=:), allocatable :: label, set, where_it_acts
      real(wp) :: a(3), b(3), sense, thickness, value
      integer :: first, k
      logical :: ok, fine, on_edges

      call new_entry(deck, c, merge(on_surface, distributed, deck%cards(c)%keyword == 'DSLOAD'), writer, history, entry)
      call deck%start(c, line)
      do while (deck%next(line))
         ! without a set it acts on all
         first = 1
         set = 'all'
         where_it_acts = line%field(1)%text
         on_edges = deck%cards(c)%keyword == 'DSLOAD' .and. writer%edge_set(where_it_acts) /= ''
         if (where_it_acts /= '') set = writer%element_set(where_it_acts)
         if (set == '' .and. is_label(where_it_acts)) then
            set = 'all'
            first = 0
         end if
         label = ''
         if (line%fields > first) label = lower_case(line%field(first + 1)%text)
         call line%number(first + 2, value, ok)
         sense = 1
         if (deck%cards(c)%keyword == 'DSLOAD' .and. .not. on_edges) sense = side_of(deck, where_it_acts)
         if (on_edges) set = writer%edge_set(where_it_acts)
         if (set == '' .or. .not. ok .or. .not. abs(sense) > 0) then
            call writer%miss(deck, c, "'"//where_it_acts//"': no elements of a shell, no one side of them, or no number", line%line)
            cycle
         end if
         fine = .true.
         do k = 1, 3
            call line%number(first + 2 + k, a(k), ok)
            fine = fine .and. ok
            call line%number(first + 5 + k, b(k), ok)
            fine = fine .and. ok
         end do
         entry%key = label
         entry%before = "&load type = 'pressure'"
         entry%after = 'pressure'
         entry%more = ''
         entry%form = 1
         if (on_edges) label = 'edge '//label
         if (any(label == ['p1', 'p2', 'p3', 'p4'])) label = 'side'
         if (index(label, 'ednor') == 1) label = 'ednor'
         select case (label)
         case ('p')
            call enter(deck, c, line%line, writer, history, entry, 'element_set', set, sense*value)
         case ('side', 'ednor', 'edge p', 'edge ednor')
            ! pressure on the side of a plane element acts on its thickness; that of an edge is per length
            thickness = 1
            if (label == 'side' .or. label == 'edge p') thickness = side_thickness(deck, writer, set, on_edges)
            if (.not. on_edges) set = side_name(where_it_acts, line%field(first + 1)%text)
            if (find_edge_set(writer%mesh, set) == 0 .or. .not. thickness > 0) then
               call writer%miss(deck, c, "'"//where_it_acts//"': pressure on a side is for plane elements of one thickness with " &
                  //'*SOLID SECTION', line%line)
               cycle
            end if
            entry%before = "&load type = 'follower_line'"
            entry%after = 'in_plane'
            call enter(deck, c, line%line, writer, history, entry, 'edge_set', set, -thickness*value)
         case ('grav')
            if (.not. (fine .and. norm2(a) > 0)) then
               call writer%miss(deck, c, 'a number and a direction are expected', line%line)
               cycle
            end if
            entry%key = 'grav '//vector_text(a/norm2(a))
            entry%before = "&load type = 'gravity'"
            entry%after = 'vector'
            entry%direction = a/norm2(a)
            entry%form = 2
            call enter(deck, c, line%line, writer, history, entry, 'element_set', set, value)
         case ('centrif')
            if (.not. (fine .and. norm2(b) > 0 .and. value >= 0)) then
               call writer%miss(deck, c, 'a number, a point and a direction of an axis are expected', line%line)
               cycle
            end if
            entry%key = 'centrif '//vector_text(a)//vector_text(b)
            entry%before = "&load type = 'centrifugal'"
            entry%after = 'angular_velocity'
            entry%more = ' origin = '//vector_text(a)//' axis = '//vector_text(b)
            entry%form = 3
            call enter(deck, c, line%line, writer, history, entry, 'element_set', set, value)
         case default
            call writer%miss(deck, c, "load '"//label//"'", line%line)
         end select
      end do
   end subroutine convert_distributed_load

   !> What all lines of a card have in common: its table, and OP.
   subroutine new_entry(deck, c, kind, writer, history, entry)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c, kind
      type(writer_t), intent(inout) :: writer
      type(history_t), intent(inout) :: history
      type(entry_t), intent(out) :: entry
      character(len=:), allocatable :: refusal
      entry%kind = kind
      entry%before = ''
      entry%after = ''
      entry%more = ''
      if (lower_case(deck%cards(c)%value('OP')) == 'new') call history%clear(kind)
      if (.not. deck%cards(c)%has('AMPLITUDE')) return
      call read_table(deck, deck%cards(c)%value('AMPLITUDE'), entry%table, refusal)
      if (refusal /= '') call writer%miss(deck, c, 'AMPLITUDE: '//refusal//'; it ramps over the step')
   end subroutine new_entry

   !> Enter a number for a set.
   subroutine enter(deck, c, line, writer, history, entry, set_key, set, value)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c, line
      type(writer_t), intent(inout) :: writer
      type(history_t), intent(inout) :: history
      type(entry_t), intent(inout) :: entry
      character(len=*), intent(in) :: set_key, set
      real(wp), intent(in) :: value
      logical :: split
      entry%set_key = set_key
      entry%set = set
      entry%members = writer%members_of(set_key, set)
      entry%magnitude = value
      call history%put(entry, split)
      if (entry%kind /= boundary .or. history%step == 0 .or. history%schedule%way /= clock .or. .not. abs(value) > 0) return
      if (history%schedule%steps(history%step)%kind == riks) call writer%miss(deck, c, 'a support that moves in a step of ' &
         //'RIKS: it stays', line)
      if (history%schedule%steps(history%step)%at_once .and. .not. allocated(entry%table%times)) call writer%miss(deck, c, &
         'a support that jumps: it moves evenly through the step', line)
   end subroutine enter

   pure logical function is_label(word)
      character(len=*), intent(in) :: word
      is_label = any(lower_case(word) == [character(len=7) :: 'p', 'grav', 'centrif'])
   end function is_label

   !> The side of the elements that a surface is: pressure on it acts along (1) or against (-1) the normal; 0: both, edges, or none.
   function side_of(deck, name) result(sense)
      type(deck_t), intent(in) :: deck
      character(len=*), intent(in) :: name
      real(wp) :: sense
      type(data_t) :: line
      character(len=:), allocatable :: face
      real(wp) :: this
      integer :: c
      sense = 0
      do c = 1, size(deck%cards)
         if (deck%cards(c)%keyword /= 'SURFACE') cycle
         if (lower_case(deck%cards(c)%value('NAME')) /= lower_case(name)) cycle
         call deck%start(c, line)
         do while (deck%next(line))
            face = 'spos'
            if (line%fields > 1) face = lower_case(line%field(2)%text)
            this = 0
            if (face == 'spos' .or. face == '') this = -1
            if (face == 'sneg') this = 1
            if (abs(sense) > 0 .and. abs(sense - this) > 0 .or. .not. abs(this) > 0) then
               sense = 0
               return
            end if
            sense = this
         end do
      end do
   end function side_of
end module finshell_deck_load
