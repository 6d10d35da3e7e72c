!> Supports and loads of a deck as groups of a namelist.
module finshell_deck_load
   use finshell_deck, only: data_t, deck_t
   use finshell_deck_writer, only: number_text, quoted, vector_text, writer_t
   use finshell_kinds, only: i8, wp
   use finshell_text, only: lower_case, parse_integer
   implicit none
   private
   public :: convert_boundary, convert_nodal_load, convert_distributed_load

   character(len=2), parameter :: components(6) = ['ux', 'uy', 'uz', 'rx', 'ry', 'rz']
   character, parameter :: lf = achar(10)

contains

   !> *BOUNDARY.
   subroutine convert_boundary(deck, c, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      character(len=:), allocatable :: group, kind, set
      integer(i8) :: first, last
      real(wp) :: value
      integer :: k
      logical :: ok, fine

      if (deck%cards(c)%has('AMPLITUDE')) call writer%miss(deck, c, 'AMPLITUDE: it follows the load factor')
      if (deck%cards(c)%has('TYPE')) call writer%miss(deck, c, 'TYPE = '//deck%cards(c)%value('TYPE'))
      if (lower_case(deck%cards(c)%value('OP')) == 'new') call writer%miss(deck, c, 'OP = NEW: supports stay in all steps')
      call deck%start(c, line)
      do while (deck%next(line))
         set = writer%node_set(line%field(1)%text)
         if (set == '' .or. line%fields < 2) then
            call writer%miss(deck, c, "'"//line%field(1)%text//"': it has no node of a shell, or nothing is held", line%line)
            cycle
         end if
         call line%whole(2, first, ok)
         if (.not. ok) then
            kind = type_of(line%field(2)%text)
            if (kind == '') call writer%miss(deck, c, "'"//line%field(2)%text//"' is not known", line%line)
            if (kind /= '') writer%supports = writer%supports//'&support node_set = '//quoted(set)//kind//' /'//lf
            cycle
         end if
         last = first
         if (line%fields > 2) call line%whole(3, last, fine)
         if (line%fields > 2 .and. .not. fine) last = first
         call line%number(4, value, ok)
         if (first < 1 .or. last > size(components) .or. last < first .or. .not. ok) then
            call writer%miss(deck, c, 'degrees of freedom 1 to 6 and a number are expected', line%line)
            cycle
         end if
         group = '&support node_set = '//quoted(set)
         if (abs(value) > 0) then
            do k = int(first), int(last)
               group = group//' '//components(k)//' = '//number_text(value)
            end do
         else
            group = group//' fixed ='
            do k = int(first), int(last)
               group = group//' '//quoted(components(k))
            end do
         end if
         writer%supports = writer%supports//group//' /'//lf
      end do
   end subroutine convert_boundary

   !> What Abaqus' named boundary conditions hold.
   pure function type_of(name) result(text)
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: text
      select case (lower_case(name))
      case ('encastre'); text = " type = 'clamped'"
      case ('pinned'); text = " type = 'pinned'"
      case ('xsymm'); text = " type = 'symmetry_x'"
      case ('ysymm'); text = " type = 'symmetry_y'"
      case ('zsymm'); text = " type = 'symmetry_z'"
      case ('xasymm'); text = " fixed = 'uy' 'uz' 'rx'"
      case ('yasymm'); text = " fixed = 'ux' 'uz' 'ry'"
      case ('zasymm'); text = " fixed = 'ux' 'uy' 'rz'"
      case default; text = ''
      end select
   end function type_of

   !> *CLOAD.
   subroutine convert_nodal_load(deck, c, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      character(len=:), allocatable :: set
      integer(i8) :: component
      real(wp) :: value, vector(3)
      logical :: ok, fine

      if (deck%cards(c)%has('FOLLOWER')) call writer%miss(deck, c, 'FOLLOWER: the direction stays')
      call note_amplitude(deck, c, writer)
      call deck%start(c, line)
      do while (deck%next(line))
         set = writer%node_set(line%field(1)%text)
         call line%whole(2, component, ok)
         call line%number(3, value, fine)
         if (set == '' .or. .not. (ok .and. fine) .or. component < 1 .or. component > size(components)) then
            call writer%miss(deck, c, "'"//line%field(1)%text//"': a node or set of a shell, a degree of freedom 1 to 6 and a " &
               //'number are expected', line%line)
            cycle
         end if
         vector = 0
         vector(1 + mod(int(component) - 1, 3)) = value
         writer%loads = writer%loads//'&load type = '//trim(merge("'force' ", "'moment'", component <= 3))//' node_set = ' &
            //quoted(set)//' vector = '//vector_text(vector)//' /'//lf
      end do
   end subroutine convert_nodal_load

   !> *DLOAD, *DSLOAD. A pressure on elements is positive along their normal; on a surface it is positive against its outer side.
   subroutine convert_distributed_load(deck, c, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      character(len=:), allocatable :: label, set, where_it_acts
      real(wp) :: a(3), b(3), sense, value
      integer :: first, k
      logical :: ok, fine

      call note_amplitude(deck, c, writer)
      call deck%start(c, line)
      do while (deck%next(line))
         ! without a set it acts on all
         first = 1
         set = 'all'
         where_it_acts = line%field(1)%text
         if (where_it_acts /= '') set = writer%element_set(where_it_acts)
         if (set == '' .and. is_label(where_it_acts)) then
            set = 'all'
            first = 0
         end if
         label = ''
         if (line%fields > first) label = lower_case(line%field(first + 1)%text)
         call line%number(first + 2, value, ok)
         sense = 1
         if (deck%cards(c)%keyword == 'DSLOAD') sense = side_of(deck, where_it_acts)
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
         select case (label)
         case ('p')
            writer%loads = writer%loads//"&load type = 'pressure' element_set = "//quoted(set)//' pressure = ' &
               //number_text(sense*value)//' /'//lf
         case ('grav')
            if (fine .and. norm2(a) > 0) writer%loads = writer%loads//"&load type = 'gravity' element_set = "//quoted(set) &
               //' vector = '//vector_text(value*a/norm2(a))//' /'//lf
         case ('centrif')
            if (fine .and. norm2(b) > 0 .and. value >= 0) writer%loads = writer%loads &
               //"&load type = 'centrifugal' element_set = "//quoted(set)//' angular_velocity = '//number_text(sqrt(value)) &
               //' origin = '//vector_text(a)//' axis = '//vector_text(b)//' /'//lf
         case default
            call writer%miss(deck, c, "load '"//label//"'", line%line)
         end select
      end do
   end subroutine convert_distributed_load

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

   subroutine note_amplitude(deck, c, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      if (deck%cards(c)%has('AMPLITUDE')) call writer%miss(deck, c, 'AMPLITUDE: it follows the load factor')
      if (lower_case(deck%cards(c)%value('OP')) == 'new') call writer%miss(deck, c, 'OP = NEW: loads stay in all steps')
   end subroutine note_amplitude
end module finshell_deck_load
