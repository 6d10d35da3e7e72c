!> Namelist files with repeatable groups: typed access with messages a user can act on.
!>
!> read_namelist parses a file; check_groups refuses unknown groups. For each group, `get` takes the values of the keys it
!> knows, then check_all_used refuses the rest. `get` does nothing when an error is already there, so a series of calls needs one
!> test at its end. Messages are `FILE:LINE: &group key = 'what was found': what was expected`.
module finshell_namelist
   use finshell_kinds, only: wp
   use finshell_error, only: error_t, raise, text_of
   use finshell_setting, only: apply_setting, setting_t
   use finshell_status, only: status_input_error
   use finshell_text, only: read_whole_file
   use finshell_namelist_parser, only: namelist_t, group_t, value_t, parse_namelist
   use finshell_namelist_values, only: to_integer, to_real, to_logical, to_string, suggestion
   implicit none
   private
   public :: namelist_t, group_t, read_namelist, parse_namelist, check_groups, check_all_used, get_number_or_switch
   public :: get, get_strings, has, line_of, complain_about, count_groups

   !> Take the value of a key: integer, real, logical or string; scalar, or allocatable array for any number of values.
   !>
   !> Without `default` the key is required. `minimum` and `maximum` are inclusive, `above` is exclusive; `choices` is a
   !> comma-separated list (either case; the value becomes as it is written in the list). An array that is absent and has no
   !> default stays empty unless `required`; `number` is the number of values it must have.
   interface get
      module procedure :: get_integer
      module procedure :: get_real
      module procedure :: get_logical
      module procedure :: get_string
      module procedure :: get_integers
      module procedure :: get_reals
      module procedure :: get_logicals
   end interface get

contains

   !> Read and parse a file, with other values for some of its keys.
   subroutine read_namelist(file_name, namelist, error, text, settings)
      character(len=*), intent(in) :: file_name
      type(namelist_t), intent(out) :: namelist
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable, intent(out), optional :: text !< the whole input
      type(setting_t), intent(in), optional :: settings(:)
      character(len=:), allocatable :: content
      integer :: i

      call read_whole_file(file_name, content, error)
      if (present(settings)) then
         do i = 1, size(settings)
            if (.not. allocated(error)) call apply_setting(settings(i), file_name, content, error)
         end do
      end if
      if (allocated(error)) return
      call parse_namelist(content, file_name, namelist, error)
      if (present(text)) call move_alloc(content, text)
   end subroutine read_namelist

   !> Refuse groups whose name is not in a comma-separated list.
   subroutine check_groups(namelist, names, error)
      type(namelist_t), intent(in) :: namelist
      character(len=*), intent(in) :: names
      type(error_t), allocatable, intent(inout) :: error
      integer :: i

      if (allocated(error)) return
      do i = 1, size(namelist%groups)
         associate (group => namelist%groups(i))
            if (index(', '//names//',', ', '//group%name//',') > 0) cycle
            call raise(error, status_input_error, group%file//':'//text_of(group%line)//': unknown group &'//group%name &
               //suggestion(group%name, names)//'; known groups: '//names)
            return
         end associate
      end do
   end subroutine check_groups

   !> Number of groups of a name.
   pure integer function count_groups(namelist, name) result(number)
      type(namelist_t), intent(in) :: namelist
      character(len=*), intent(in) :: name
      integer :: i
      number = 0
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name == name) number = number + 1
      end do
   end function count_groups

   !> Refuse keys that nobody asked for.
   subroutine check_all_used(group, error)
      type(group_t), intent(in) :: group
      type(error_t), allocatable, intent(inout) :: error
      integer :: i

      if (allocated(error)) return
      do i = 1, size(group%entries)
         associate (entry => group%entries(i))
            if (entry%used) cycle
            call raise(error, status_input_error, group%file//':'//text_of(entry%line)//': &'//group%name//': unknown key ' &
               //entry%key//suggestion(entry%key, group%known_keys)//'; known keys here: '//group%known_keys)
            return
         end associate
      end do
   end subroutine check_all_used

   !> Is the key given?
   pure logical function has(group, key)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      has = position_of(group, key) > 0
   end function has

   !> Line of a key, or of the group when the key is not given.
   pure integer function line_of(group, key) result(line)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      integer :: i
      line = group%line
      i = position_of(group, key)
      if (i > 0) line = group%entries(i)%line
   end function line_of

   !> Raise an error at the place of a key (at the group when key is '' or not given).
   subroutine complain_about(group, key, message, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      character(len=*), intent(in) :: message
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: subject

      subject = '&'//group%name
      if (has(group, key)) subject = subject//' '//key
      call raise(error, status_input_error, group%file//':'//text_of(line_of(group, key))//': '//subject//': '//message)
   end subroutine complain_about

   pure integer function position_of(group, key) result(position)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      do position = size(group%entries), 1, -1
         if (group%entries(position)%key == key) return
      end do
      position = 0
   end function position_of

   !> Find a key, mark it used, remember that it is known; position 0 when absent (an error when it is required).
   subroutine look_up(group, key, required, position, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      logical, intent(in) :: required
      integer, intent(out) :: position
      type(error_t), allocatable, intent(inout) :: error

      position = 0
      if (allocated(error)) return
      if (index(', '//group%known_keys//',', ', '//key//',') == 0) then
         if (group%known_keys /= '') group%known_keys = group%known_keys//', '
         group%known_keys = group%known_keys//key
      end if
      position = position_of(group, key)
      if (position > 0) then
         group%entries(position)%used = .true.
      else if (required) then
         call complain_about(group, '', 'the key '//key//' is required', error)
      end if
   end subroutine look_up

   !> The only value of a key; an error when there are several.
   subroutine take_one(group, key, required, value, found, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      logical, intent(in) :: required
      type(value_t), intent(out) :: value
      logical, intent(out) :: found
      type(error_t), allocatable, intent(inout) :: error
      integer :: position

      call look_up(group, key, required, position, error)
      found = position > 0
      if (.not. found) return
      if (size(group%entries(position)%values) > 1) then
         call complain_about(group, key, 'one value is expected, found '//text_of(size(group%entries(position)%values)), error)
         found = .false.
         return
      end if
      value = group%entries(position)%values(1)
   end subroutine take_one

   subroutine get_integer(group, key, value, error, default, minimum, maximum)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      integer, intent(inout) :: value
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: default, minimum, maximum
      type(value_t) :: raw
      logical :: found

      if (present(default)) value = default
      call take_one(group, key, .not. present(default), raw, found, error)
      if (found) call to_integer(group, key, raw, value, error, minimum, maximum)
   end subroutine get_integer

   subroutine get_real(group, key, value, error, default, minimum, maximum, above)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      real(wp), intent(inout) :: value
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in), optional :: default, minimum, maximum, above
      type(value_t) :: raw
      logical :: found

      if (present(default)) value = default
      call take_one(group, key, .not. present(default), raw, found, error)
      if (found) call to_real(group, key, raw, value, error, minimum, maximum, above)
   end subroutine get_real

   subroutine get_logical(group, key, value, error, default)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      logical, intent(inout) :: value
      type(error_t), allocatable, intent(inout) :: error
      logical, intent(in), optional :: default
      type(value_t) :: raw
      logical :: found

      if (present(default)) value = default
      call take_one(group, key, .not. present(default), raw, found, error)
      if (found) call to_logical(group, key, raw, value, error)
   end subroutine get_logical

   !> A number, or a switch that stands for one: .true. for `on`, .false. for 0.
   subroutine get_number_or_switch(group, key, value, error, default, on, minimum)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      real(wp), intent(inout) :: value
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in) :: default, on, minimum
      type(value_t) :: raw
      logical :: found, switch

      value = default
      call take_one(group, key, .false., raw, found, error)
      if (.not. found) return
      if (scan(raw%text, '0123456789') > 0) then
         call to_real(group, key, raw, value, error, minimum)
      else
         call to_logical(group, key, raw, switch, error)
         value = merge(on, 0.0_wp, switch)
      end if
   end subroutine get_number_or_switch

   subroutine get_string(group, key, value, error, default, choices)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      character(len=:), allocatable, intent(inout) :: value
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: default
      character(len=*), intent(in), optional :: choices
      type(value_t) :: raw
      logical :: found

      if (present(default)) value = default
      call take_one(group, key, .not. present(default), raw, found, error)
      if (found) call to_string(group, key, raw, value, error, choices)
      if (.not. allocated(value)) value = ''
   end subroutine get_string

   !> Find an array; `number_found` is 0 when it is absent.
   subroutine look_up_array(group, key, position, number_found, error, required, number)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      integer, intent(out) :: position, number_found
      type(error_t), allocatable, intent(inout) :: error
      logical, intent(in), optional :: required
      integer, intent(in), optional :: number
      logical :: must

      must = .false.
      if (present(required)) must = required
      call look_up(group, key, must, position, error)
      number_found = 0
      if (position == 0) return
      number_found = size(group%entries(position)%values)
      if (.not. present(number)) return
      if (number_found /= number) call complain_about(group, key, text_of(number)//' values are expected, found ' &
         //text_of(number_found), error)
   end subroutine look_up_array

   subroutine get_integers(group, key, values, error, required, number, minimum, maximum)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      integer, allocatable, intent(out) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      logical, intent(in), optional :: required
      integer, intent(in), optional :: number, minimum, maximum
      integer :: position, n, i

      call look_up_array(group, key, position, n, error, required, number)
      allocate (values(n), source=0)
      do i = 1, n
         if (allocated(error)) return
         call to_integer(group, key, group%entries(position)%values(i), values(i), error, minimum, maximum)
      end do
   end subroutine get_integers

   subroutine get_reals(group, key, values, error, required, number, minimum, maximum, above)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      real(wp), allocatable, intent(out) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      logical, intent(in), optional :: required
      integer, intent(in), optional :: number
      real(wp), intent(in), optional :: minimum, maximum, above
      integer :: position, n, i

      call look_up_array(group, key, position, n, error, required, number)
      allocate (values(n), source=0.0_wp)
      do i = 1, n
         if (allocated(error)) return
         call to_real(group, key, group%entries(position)%values(i), values(i), error, minimum, maximum, above)
      end do
   end subroutine get_reals

   subroutine get_logicals(group, key, values, error, required, number)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      logical, allocatable, intent(out) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      logical, intent(in), optional :: required
      integer, intent(in), optional :: number
      integer :: position, n, i

      call look_up_array(group, key, position, n, error, required, number)
      allocate (values(n), source=.false.)
      do i = 1, n
         if (allocated(error)) return
         call to_logical(group, key, group%entries(position)%values(i), values(i), error)
      end do
   end subroutine get_logicals

   !> Take the strings of a key, padded with blanks to the longest.
   subroutine get_strings(group, key, values, error, required, choices)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      character(len=:), allocatable, intent(out) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      logical, intent(in), optional :: required
      character(len=*), intent(in), optional :: choices
      character(len=:), allocatable :: one
      integer :: position, n, i, longest

      call look_up_array(group, key, position, n, error, required)
      longest = 1
      do i = 1, n
         longest = max(longest, len(group%entries(position)%values(i)%text))
      end do
      allocate (character(len=longest) :: values(n))
      do i = 1, n
         values(i) = ''
      end do
      do i = 1, n
         if (allocated(error)) return
         call to_string(group, key, group%entries(position)%values(i), one, error, choices)
         values(i) = one
      end do
   end subroutine get_strings
end module finshell_namelist
