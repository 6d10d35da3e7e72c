!> A value that the command line gives to a key of an input: `--set section.thickness=0.1`.
!>
!> GROUP.KEY=VALUE, where GROUP is the name of a group, with step[2] the second one of that name, and with material[rubber] the one
!> whose `name` is rubber. Commas separate alternatives, blanks the values of one: load.vector='0 0 1, 0 0 2'. Words that are no
!> number and no truth value get the quotes that namelists want. The input is changed as text, so that whatever keeps the input
!> keeps what was set.
module finshell_setting
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: wp
   use finshell_namelist_parser, only: group_t, namelist_t, parse_namelist
   use finshell_status, only: status_input_error
   use finshell_text, only: figures, is_name, lower_case, parse_real
   implicit none
   private
   public :: alternative_t, setting_t, new_setting, apply_setting, find_group, single_setting

   type :: alternative_t
      character(len=:), allocatable :: text !< as a namelist has it
   end type alternative_t

   type :: setting_t
      character(len=:), allocatable :: text !< as it was given
      character(len=:), allocatable :: group, key
      character(len=:), allocatable :: which !< the number or the name of the group; '': there is one
      type(alternative_t), allocatable :: values(:)
   end type setting_t

   character(len=*), parameter :: added_groups = ' job output accuracy ' !< of which there is one, if not in the file

contains

   !> Take a setting apart.
   subroutine new_setting(self, text, complaint)
      type(setting_t), intent(out) :: self
      character(len=*), intent(in) :: text
      character(len=:), allocatable, intent(inout) :: complaint
      character(len=:), allocatable :: place
      type(alternative_t) :: one
      integer :: bracket, dot, equals, first, i
      character :: quote

      self%text = text
      allocate (self%values(0))
      equals = index(text, '=')
      place = text(:max(0, equals - 1))
      dot = index(place, '.', back=.true.)
      self%key = lower_case(trim(adjustl(place(dot + 1:))))
      self%group = trim(adjustl(place(:max(0, dot - 1))))
      self%which = ''
      bracket = index(self%group, '[')
      if (bracket > 0 .and. index(self%group, ']', back=.true.) == len(self%group)) then
         self%which = self%group(bracket + 1:len(self%group) - 1)
         self%group = self%group(:bracket - 1)
         if (self%which == '') self%group = ''
      end if
      self%group = lower_case(self%group)
      if (.not. (is_name(self%group) .and. is_name(self%key)) .or. index(text, new_line('a')) > 0) then
         complaint = "--set needs GROUP.KEY=VALUE, as section.thickness=0.1 or step[2].load_factor=3, found '"//text//"'"
         return
      end if
      quote = ' '
      first = equals + 1
      do i = equals + 1, len(text) + 1
         if (i <= len(text)) then
            if (quote /= ' ') then
               if (text(i:i) == quote) quote = ' '
               cycle
            end if
            if (scan(text(i:i), '''"') > 0 .and. scan(text(i - 1:i - 1), ' ,=') > 0) quote = text(i:i) ! it begins a word
            if (text(i:i) /= ',') cycle
         end if
         one%text = as_namelist(text(first:i - 1))
         self%values = [self%values, one]
         if (self%values(size(self%values))%text == '' .or. quote /= ' ') then
            complaint = '--set '//text//': a value is missing'
            if (quote /= ' ') complaint = '--set '//text//': a quote is not closed'
            return
         end if
         first = i + 1
      end do
   end subroutine new_setting

   !> Words in quotes where they are no numbers and no truth values.
   pure function as_namelist(words) result(text)
      character(len=*), intent(in) :: words
      character(len=:), allocatable :: text
      character(len=:), allocatable :: word
      integer :: at, last
      text = ''
      at = 1
      do while (at <= len(words))
         last = at
         if (scan(words(at:at), '''"') > 0) then
            last = at + index(words(at + 1:), words(at:at))
            if (last == at) last = len(words)
            word = words(at:last)
         else if (words(at:at) /= ' ') then
            last = at + index(words(at:)//' ', ' ') - 2
            word = words(at:last)
            if (.not. is_plain(word)) word = "'"//doubled(word)//"'"
         end if
         if (words(at:at) /= ' ') then
            if (text /= '') text = text//', '
            text = text//word
         end if
         at = last + 1
      end do
   end function as_namelist

   !> A number, also one with a repeat count, or a truth value.
   pure logical function is_plain(word)
      character(len=*), intent(in) :: word
      real(wp) :: number
      integer :: star
      star = index(word, '*')
      if (star > 1) then
         if (verify(word(:star - 1), figures) > 0) star = 0
      end if
      call parse_real(word(star + 1:), number, is_plain)
      is_plain = is_plain .or. any(lower_case(word) == [character(len=7) :: '.true.', '.false.', 'true', 'false'])
   end function is_plain

   pure function doubled(word) result(text)
      character(len=*), intent(in) :: word
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, len(word)
         text = text//word(i:i)
         if (word(i:i) == "'") text = text//"'"
      end do
   end function doubled

   !> The same with one of its alternatives, as an argument of --set.
   pure function single_setting(self, number) result(text)
      type(setting_t), intent(in) :: self
      integer, intent(in) :: number
      character(len=:), allocatable :: text
      integer :: i
      logical :: quoted
      text = self%text(:index(self%text, '='))//self%values(number)%text
      quoted = .false.
      do i = index(text, '='), len(text) ! commas of a namelist are blanks here
         if (text(i:i) == "'") quoted = .not. quoted
         if (text(i:i) == ',' .and. .not. quoted) text(i:i) = ' '
      end do
   end function single_setting

   !> Put the first of its alternatives into the text of an input. Errors: the text is no namelist; no such group, or several.
   subroutine apply_setting(self, file, text, error)
      type(setting_t), intent(in) :: self
      character(len=*), intent(in) :: file !< for messages
      character(len=:), allocatable, intent(inout) :: text
      type(error_t), allocatable, intent(out) :: error
      type(namelist_t) :: namelist
      character(len=:), allocatable :: assignment
      integer :: at, first, i

      call parse_namelist(text, file, namelist, error)
      if (allocated(error)) return
      assignment = self%key//' = '//self%values(1)%text
      call find_group(self, namelist, at, error)
      if (allocated(error)) return
      if (at == 0) then
         text = text//new_line('a')//'&'//self%group//' '//assignment//' /'
      else
         associate (group => namelist%groups(at))
            do i = 1, size(group%entries)
               if (group%entries(i)%key /= self%key) cycle
               first = group%entries(i)%first
               assignment = assignment//repeat(new_line('a'), group%entries(i)%values(size(group%entries(i)%values))%line &
                                               - group%entries(i)%line) ! lines keep their numbers
               text = text(:first - 1)//assignment//text(group%entries(i)%last + 1:)
               exit
            end do
            if (i > size(group%entries)) text = text(:group%last - 1)//' '//assignment//' '//text(group%last:)
         end associate
      end if
      text = text//new_line('a')//'! --set '//self%text//new_line('a')
   end subroutine apply_setting

   !> The group that is meant; 0: there is none, and may be none.
   subroutine find_group(self, namelist, at, error)
      type(setting_t), intent(in) :: self
      type(namelist_t), intent(in) :: namelist
      integer, intent(out) :: at
      type(error_t), allocatable, intent(inout) :: error
      integer, allocatable :: places(:)
      character(len=:), allocatable :: names, there
      integer :: i, number

      places = pack([(i, i=1, size(namelist%groups))], [(namelist%groups(i)%name == self%group, i=1, size(namelist%groups))])
      at = 0
      if (size(places) == 0) then
         if (index(added_groups, ' '//self%group//' ') > 0 .and. self%which == '') return
         there = ''
         do i = 1, size(namelist%groups)
            if (index(there//',', ' '//namelist%groups(i)%name//',') == 0) there = there//', '//namelist%groups(i)%name
         end do
         call complain('has no group &'//self%group//'; its groups: '//there(3:))
         return
      end if
      names = ''
      do i = 1, size(places)
         there = name_of(namelist%groups(places(i)))
         if (there /= '') names = names//', '//there
         if (self%which /= '' .and. (there == self%which .or. text_of(i) == self%which)) at = places(i)
      end do
      if (names /= '') names = ' (their names: '//names(3:)//')'
      if (self%which == '' .and. size(places) == 1) at = places(1)
      if (at > 0) return
      number = size(places)
      if (self%which == '') then
         call complain('has '//text_of(number)//' groups &'//self%group//': say which, as '//self%group//'[2].'//self%key//names)
      else
         call complain('has '//text_of(number)//' group'//trim(merge('s', ' ', number > 1))//' &'//self%group//' and none [' &
                       //self%which//']'//names)
      end if

   contains

      subroutine complain(message)
         character(len=*), intent(in) :: message
         call raise(error, status_input_error, '--set '//self%text//': '//namelist%file//' '//message)
      end subroutine complain
   end subroutine find_group

   !> What the group calls itself; '': nothing.
   pure function name_of(group) result(name)
      type(group_t), intent(in) :: group
      character(len=:), allocatable :: name
      integer :: i
      name = ''
      do i = 1, size(group%entries)
         if (group%entries(i)%key == 'name') name = group%entries(i)%values(1)%text
      end do
   end function name_of
end module finshell_setting
