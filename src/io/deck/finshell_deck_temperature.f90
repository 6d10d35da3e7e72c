!> Temperatures of a deck as growth: *INITIAL CONDITIONS, *TEMPERATURE, and the *EXPANSION of materials.
!>
!> A temperature of a node set becomes &growth of each section whose material expands, by the change since the beginning.
module finshell_deck_temperature
   use finshell_deck, only: data_t, deck_t
   use finshell_deck_history, only: entry_t, history_t, temperature
   use finshell_deck_load, only: enter, new_entry
   use finshell_deck_writer, only: number_text, quoted, writer_t
   use finshell_error, only: text_of
   use finshell_kinds, only: wp
   use finshell_text, only: lower_case
   implicit none
   private
   public :: convert_temperature, write_temperature

   character, parameter :: lf = achar(10)

contains

   !> *TEMPERATURE: sets of nodes, or single ones.
   subroutine convert_temperature(deck, c, writer, history)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(writer_t), intent(inout) :: writer
      type(history_t), intent(inout) :: history
      type(data_t) :: line
      type(entry_t) :: entry
      character(len=:), allocatable :: set
      real(wp), allocatable :: before(:)
      real(wp) :: gradient, value
      logical :: fine, ok

      if (deck%cards(c)%has('FILE') .or. deck%cards(c)%has('USER')) then
         call writer%miss(deck, c, 'temperatures of a file or of a program')
         return
      end if
      call new_entry(deck, c, temperature, writer, history, entry)
      entry%key = 'temperature'
      call initial_temperatures(deck, writer, before)
      call deck%start(c, line)
      do while (deck%next(line))
         set = writer%node_set(line%field(1)%text)
         call line%number(2, value, ok)
         if (set == '' .or. .not. ok .or. line%fields < 2) then
            call writer%miss(deck, c, "'"//line%field(1)%text//"': nodes of a shell and a temperature are expected", line%line)
            cycle
         end if
         gradient = 0
         fine = .true.
         if (line%fields > 2) call line%number(3, gradient, fine)
         if (abs(gradient) > 0 .or. .not. fine) &
            call writer%miss(deck, c, 'a gradient through the thickness: layers of their own can have it', line%line)
         associate (t => before(writer%members_of('node_set', set)))
            if (maxval(t) > minval(t)) call writer%miss(deck, c, 'nodes that begin at different temperatures: they count ' &
                                                        //'from '//number_text(minval(t)), line%line)
            if (allocated(entry%table%times) .and. abs(minval(t)) > 0) call writer%miss(deck, c, 'AMPLITUDE where the initial ' &
               //'temperature is not zero: it scales the change', line%line)
            call enter(deck, c, line%line, writer, history, entry, 'node_set', set, value - minval(t))
         end associate
      end do
   end subroutine convert_temperature

   !> (nodes) Temperatures before the first step; zero where the deck says none.
   subroutine initial_temperatures(deck, writer, before)
      type(deck_t), intent(in) :: deck
      type(writer_t), intent(inout) :: writer
      real(wp), allocatable, intent(out) :: before(:)
      type(data_t) :: line
      character(len=:), allocatable :: set
      real(wp) :: value
      integer :: c
      logical :: ok
      allocate (before(size(writer%mesh%coordinates, 2)), source=0.0_wp)
      do c = 1, size(deck%cards)
         if (deck%cards(c)%keyword /= 'INITIAL CONDITIONS') cycle
         if (lower_case(deck%cards(c)%value('TYPE')) /= 'temperature') cycle
         call deck%start(c, line)
         do while (deck%next(line))
            set = writer%node_set(line%field(1)%text)
            call line%number(2, value, ok)
            if (set /= '' .and. ok) before(writer%members_of('node_set', set)) = value
         end do
      end do
   end subroutine initial_temperatures

   !> A change of the temperature of a node set, for all that expands.
   subroutine write_temperature(set, members, change, when, writer)
      character(len=*), intent(in) :: set
      integer, intent(in) :: members(:)
      real(wp), intent(in) :: change
      character(len=*), intent(in) :: when !< keys
      type(writer_t), intent(inout) :: writer
      character(len=:), allocatable :: field, where_it_is
      integer :: i, k
      field = ''
      if (size(members) < size(writer%mesh%coordinates, 2)) then
         field = quoted('heated_'//set)
         if (index(writer%sets, '&field name = '//field) == 0) writer%sets = writer%sets//'&field name = '//field &
            //' node_set = '//quoted(set)//' value = 1.0 otherwise = 0.0 /'//lf
         field = ' temperature_field = '//field
      end if
      do i = 1, size(writer%plies)
         do k = 1, size(writer%expansions)
            if (writer%expansions(k)%material /= writer%plies(i)%material) cycle
            where_it_is = ' element_set = '//quoted(writer%plies(i)%set)
            if (writer%plies(i)%layer > 0) where_it_is = where_it_is//' layer = '//text_of(writer%plies(i)%layer)
            writer%loads = writer%loads//'&growth'//where_it_is//' expansion ='//writer%expansions(k)%coefficients &
               //' temperature = '//number_text(change)//field//when//' /'//lf
         end do
      end do
   end subroutine write_temperature
end module finshell_deck_temperature
