!> Reading whole files, and words: what the readers of input files share.
module finshell_text
   use, intrinsic :: iso_c_binding, only: c_char, c_double, c_null_char, c_null_ptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: int64, real64
   use finshell_error, only: error_t, raise
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: read_whole_file, lower_case, is_letter, is_digit, is_blank, is_name, parse_integer, parse_real, nearest_name
   public :: figures

   character(len=*), parameter :: figures = '0123456789'
   integer, parameter :: most_digits = range(1_int64) !< of a number that fits into an integer of 64 bits, whatever it is
   integer, parameter :: digits_of_double = digits(1.0_real64) !< integers up to two to this power are double numbers
   integer :: i_power
   real(real64), parameter :: powers(0:22) = [(10.0_real64**i_power, i_power=0, 22)] !< all that are double numbers

   interface
      !> The nearest number to a decimal one. Fortran's READ takes it from there too, at thirty times the cost.
      pure function c_strtod(text, rest) bind(c, name='strtod') result(value)
         import :: c_char, c_double, c_ptr
         character(kind=c_char), intent(in) :: text(*)
         type(c_ptr), value :: rest !< null
         real(c_double) :: value
      end function c_strtod
   end interface

contains

   !> The bytes of a file. Errors: missing, a directory, not readable, larger than 2 GiB.
   subroutine read_whole_file(file_name, text, error)
      character(len=*), intent(in) :: file_name
      character(len=:), allocatable, intent(out) :: text
      type(error_t), allocatable, intent(out) :: error
      integer(int64) :: bytes
      integer :: unit, status
      character(len=256) :: reason

      reason = ''
      open (newunit=unit, file=file_name, access='stream', form='unformatted', status='old', action='read', &
         iostat=status, iomsg=reason)
      if (status /= 0) then
         call raise(error, status_io_error, "cannot open the file '"//file_name//"': "//trim(reason))
         return
      end if
      inquire (unit=unit, size=bytes)
      if (bytes < 0 .or. bytes > huge(1)) then
         call raise(error, status_io_error, "cannot read the file '"//file_name//"': it is no ordinary file or larger than 2 GiB")
         close (unit)
         return
      end if
      allocate (character(len=bytes) :: text)
      if (bytes > 0) read (unit, iostat=status, iomsg=reason) text
      close (unit)
      if (status /= 0) call raise(error, status_io_error, "cannot read the file '"//file_name//"': "//trim(reason))
   end subroutine read_whole_file

   pure function lower_case(text) result(lower)
      character(len=*), intent(in) :: text
      character(len=len(text)) :: lower
      integer :: i
      lower = text
      do i = 1, len(text)
         if (text(i:i) >= 'A' .and. text(i:i) <= 'Z') lower(i:i) = achar(iachar(text(i:i)) + 32)
      end do
   end function lower_case

   pure logical function is_letter(c)
      character, intent(in) :: c
      is_letter = (c >= 'a' .and. c <= 'z') .or. (c >= 'A' .and. c <= 'Z')
   end function is_letter

   pure logical function is_digit(c)
      character, intent(in) :: c
      is_digit = c >= '0' .and. c <= '9'
   end function is_digit

   !> Space, tab, carriage return or form feed; not the end of a line.
   pure logical function is_blank(c)
      character, intent(in) :: c
      is_blank = c == ' ' .or. c == achar(9) .or. c == achar(13) .or. c == achar(12)
   end function is_blank

   !> A letter followed by letters, digits and underscores.
   pure logical function is_name(word)
      character(len=*), intent(in) :: word
      integer :: i
      is_name = .false.
      if (len(word) == 0) return
      if (.not. is_letter(word(1:1))) return
      do i = 2, len(word)
         if (.not. (is_letter(word(i:i)) .or. is_digit(word(i:i)) .or. word(i:i) == '_')) return
      end do
      is_name = .true.
   end function is_name

   !> A decimal integer with optional sign; ok is false for anything else and for overflow.
   pure subroutine parse_integer(word, value, ok)
      character(len=*), intent(in) :: word
      integer(int64), intent(out) :: value
      logical, intent(out) :: ok
      integer :: first, status

      value = 0
      ok = .false.
      if (len(word) == 0 .or. len(word) > 20) return
      first = 1
      if (word(1:1) == '+' .or. word(1:1) == '-') first = 2
      if (first > len(word) .or. verify(word(first:), figures) /= 0) return
      if (len(word) - first < most_digits) then
         value = figures_of(word(first:))
         if (word(1:1) == '-') value = -value
         ok = .true.
      else
         read (word, '(i20)', iostat=status) value
         ok = status == 0
      end if
   end subroutine parse_integer

   !> A decimal number with optional sign, point and exponent (e or d); ok is false for anything else, NaN, and overflow.
   pure subroutine parse_real(word, value, ok)
      use finshell_kinds, only: wp
      character(len=*), intent(in) :: word
      real(wp), intent(out) :: value
      logical, intent(out) :: ok
      character(len=len(word) + 1) :: number
      integer :: i, digits, before_point, first, last, status, exponent
      integer(int64) :: mantissa

      value = 0
      ok = .false.
      if (len(word) == 0 .or. len(word) > 999) return
      i = 1
      if (word(1:1) == '+' .or. word(1:1) == '-') i = 2
      first = i
      digits = 0
      call skip_digits(word, i, digits)
      before_point = digits
      if (i <= len(word)) then
         if (word(i:i) == '.') then
            i = i + 1
            call skip_digits(word, i, digits)
         end if
      end if
      if (digits == 0) return
      last = i - 1
      if (i <= len(word)) then
         if (scan(word(i:i), 'eEdD') == 0) return
         if (i == len(word) .or. len(word) - i > 6) return
         if (verify(word(i + 1:i + 1), '+-'//figures) /= 0) return
         if (len(word) > i + 1) then
            if (verify(word(i + 2:), figures) /= 0) return
         else if (.not. is_digit(word(i + 1:i + 1))) then
            return
         end if
         read (word(i + 1:), '(i8)', iostat=status) exponent
         if (status /= 0) return
      else
         exponent = 0
      end if
      ! Both are exact as double numbers here, so their quotient or product is rounded once, as it must be.
      if (digits <= most_digits .and. precision(value) == precision(powers)) then
         mantissa = figures_of(word(first:last))
         exponent = exponent - (digits - before_point)
         if (mantissa <= 2_int64**digits_of_double .and. abs(exponent) <= ubound(powers, 1)) then
            value = real(mantissa, kind(value))
            if (exponent < 0) value = value/powers(-exponent)
            if (exponent > 0) value = value*powers(exponent)
            if (word(1:1) == '-') value = -value
            ok = .true.
            return
         end if
         exponent = exponent + (digits - before_point)
      end if
      ! A conversion that overflows would trap where overflow traps.
      if (exponent + before_point - 1 > range(value)) return
      number = word//c_null_char
      if (last < len(word)) number(last + 1:last + 1) = 'e'
      value = real(c_strtod(number, c_null_ptr), wp)
      ok = .true.
   end subroutine parse_real

   !> The number that at most most_digits figures make, a point among them left out.
   pure function figures_of(word) result(number)
      character(len=*), intent(in) :: word
      integer(int64) :: number
      integer :: i
      number = 0
      do i = 1, len(word)
         if (word(i:i) /= '.') number = 10*number + (iachar(word(i:i)) - iachar('0'))
      end do
   end function figures_of

   pure subroutine skip_digits(word, i, digits)
      character(len=*), intent(in) :: word
      integer, intent(inout) :: i !< position
      integer, intent(inout) :: digits !< number of digits so far
      do while (i <= len(word))
         if (.not. is_digit(word(i:i))) exit
         digits = digits + 1
         i = i + 1
      end do
   end subroutine skip_digits

   !> The name of a comma-separated list that was probably meant, '' when none is close.
   pure function nearest_name(word, names) result(nearest)
      character(len=*), intent(in) :: word
      character(len=*), intent(in) :: names !< 'one, two, three'
      character(len=:), allocatable :: nearest
      integer :: first, comma, distance, least

      nearest = ''
      least = min(2, len(word)/2) + 1
      first = 1
      do while (first <= len(names))
         comma = index(names(first:), ',') + first - 1
         if (comma < first) comma = len(names) + 1
         distance = edit_distance(lower_case(word), lower_case(trim(adjustl(names(first:comma - 1)))))
         if (distance < least) then
            least = distance
            nearest = trim(adjustl(names(first:comma - 1)))
         end if
         first = comma + 1
      end do
   end function nearest_name

   !> Number of letters to insert, delete or replace to turn one word into the other.
   pure integer function edit_distance(a, b)
      character(len=*), intent(in) :: a, b
      integer :: d(0:min(len(a), 64), 0:min(len(b), 64))
      integer :: i, j, change

      do i = 0, ubound(d, 1)
         d(i, 0) = i
      end do
      do j = 0, ubound(d, 2)
         d(0, j) = j
      end do
      do j = 1, ubound(d, 2)
         do i = 1, ubound(d, 1)
            change = 1
            if (a(i:i) == b(j:j)) change = 0
            d(i, j) = min(d(i - 1, j) + 1, d(i, j - 1) + 1, d(i - 1, j - 1) + change)
         end do
      end do
      edit_distance = d(ubound(d, 1), ubound(d, 2)) + abs(len(a) - len(b))*merge(1, 0, max(len(a), len(b)) > 64)
   end function edit_distance
end module finshell_text
