!> From the text of one value to a number, a truth value or a string, or a message that says what was expected.
module finshell_namelist_values
   use, intrinsic :: iso_fortran_env, only: int64
   use finshell_kinds, only: wp, dp
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_input_error
   use finshell_text, only: lower_case, parse_integer, parse_real, nearest_name
   use finshell_namelist_parser, only: group_t, value_t
   implicit none
   private
   public :: to_integer, to_real, to_logical, to_string, suggestion

contains

   !> ", did you mean 'name'?" when a name of the comma-separated list is close to the word, else nothing.
   pure function suggestion(word, names) result(text)
      character(len=*), intent(in) :: word, names
      character(len=:), allocatable :: text
      text = nearest_name(word, names)
      if (text /= '') text = ", did you mean '"//text//"'?"
   end function suggestion

   subroutine wrong_value(group, key, value, expected, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      type(value_t), intent(in) :: value
      character(len=*), intent(in) :: expected
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: shown

      shown = value%text
      if (len(shown) > 60) shown = shown(:60)//'...'
      if (value%quoted) shown = "'"//shown//"'"
      call raise(error, status_input_error, group%file//':'//text_of(value%line)//': &'//group%name//' '//key//' = '//shown &
         //': expected '//expected)
   end subroutine wrong_value

   subroutine to_integer(group, key, value, number, error, minimum, maximum)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      type(value_t), intent(in) :: value
      integer, intent(out) :: number
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: minimum, maximum
      integer(int64) :: wide
      logical :: ok

      number = 0
      call parse_integer(value%text, wide, ok)
      if (ok) ok = abs(wide) <= huge(number)
      if (.not. ok .or. value%quoted) then
         call wrong_value(group, key, value, 'an integer', error)
         return
      end if
      number = int(wide)
      if (present(minimum)) then
         if (number < minimum) call wrong_value(group, key, value, 'an integer of at least '//text_of(minimum), error)
      end if
      if (present(maximum)) then
         if (number > maximum) call wrong_value(group, key, value, 'an integer of at most '//text_of(maximum), error)
      end if
   end subroutine to_integer

   subroutine to_real(group, key, value, number, error, minimum, maximum, above)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      type(value_t), intent(in) :: value
      real(wp), intent(out) :: number
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in), optional :: minimum, maximum, above
      logical :: ok

      call parse_real(value%text, number, ok)
      if (.not. ok .or. value%quoted) then
         call wrong_value(group, key, value, 'a number', error)
         return
      end if
      if (present(minimum)) then
         if (number < minimum) call wrong_value(group, key, value, 'a number of at least '//text_of(real(minimum, dp)), error)
      end if
      if (present(maximum)) then
         if (number > maximum) call wrong_value(group, key, value, 'a number of at most '//text_of(real(maximum, dp)), error)
      end if
      if (present(above)) then
         if (number <= above) call wrong_value(group, key, value, 'a number greater than '//text_of(real(above, dp)), error)
      end if
   end subroutine to_real

   subroutine to_logical(group, key, value, truth, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      type(value_t), intent(in) :: value
      logical, intent(out) :: truth
      type(error_t), allocatable, intent(inout) :: error

      truth = .false.
      select case (lower_case(value%text))
      case ('.true.', 't', 'true')
         truth = .true.
      case ('.false.', 'f', 'false')
      case default
         call wrong_value(group, key, value, '.true. or .false.', error)
         return
      end select
      if (value%quoted) call wrong_value(group, key, value, '.true. or .false. (without quotes)', error)
   end subroutine to_logical

   subroutine to_string(group, key, raw, value, error, choices)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      type(value_t), intent(in) :: raw
      character(len=:), allocatable, intent(inout) :: value
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: choices
      integer :: at

      value = raw%text
      if (.not. raw%quoted) then
         call wrong_value(group, key, raw, 'a string in quotes', error)
      else if (present(choices)) then
         at = index(lower_case(', '//choices//','), ', '//lower_case(raw%text)//',')
         if (at == 0 .or. raw%text == '' .or. index(raw%text, ',') > 0) then
            call wrong_value(group, key, raw, 'one of: '//choices//suggestion(raw%text, choices), error)
         else
            value = choices(at:at + len(raw%text) - 1)
         end if
      end if
   end subroutine to_string
end module finshell_namelist_values
