!> The part of pFUnit's module `funit` that finshell's tests use, for machines without pFUnit.
!>
!> Names, argument order and meaning follow pFUnit 4, so that the same `.pf` files run with both (translate_pf.py turns them
!> into programs that use this module). A NaN fails every comparison; the check comes first, so that tests also run with
!> floating-point traps. A test that makes no assertion fails.
module funit
   use, intrinsic :: iso_fortran_env, only: int8, int64, real32, real64
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_is_finite
   use funit_core, only: SourceLocation, anyExceptions, funit_begin, funit_run, funit_finish
   use funit_core, only: conclude, compare, compare_integers, value_of, text_i, text_r
   implicit none
   private
   public :: SourceLocation, anyExceptions
   public :: assertEqual, assertRelativelyEqual, assertLessThan, assertLessThanOrEqual, assertGreaterThan
   public :: assertGreaterThanOrEqual, assertTrue, assertFalse, assertIsNaN, assertIsFinite, assertFail
   public :: funit_begin, funit_run, funit_finish

   interface assertEqual
      module procedure :: equal_i0, equal_i1, equal_i01, equal_i2, equal_i02, equal_l0, equal_l00, equal_l1, equal_b0
      module procedure :: equal_r0, equal_r1, equal_r01, equal_r2, equal_r02, equal_ir0, equal_sr0
      module procedure :: equal_s0, equal_s1, equal_logical, equal_logical_1, equal_text
   end interface assertEqual
   interface assertRelativelyEqual
      module procedure :: relatively_0, relatively_1, relatively_2
   end interface assertRelativelyEqual
   interface assertLessThan
      module procedure :: less_i, less_l, less_r
   end interface assertLessThan
   interface assertLessThanOrEqual
      module procedure :: less_equal_i, less_equal_l, less_equal_r
   end interface assertLessThanOrEqual
   interface assertGreaterThan
      module procedure :: greater_i, greater_l, greater_r
   end interface assertGreaterThan
   interface assertGreaterThanOrEqual
      module procedure :: greater_equal_i, greater_equal_l, greater_equal_r
   end interface assertGreaterThanOrEqual
   interface assertTrue
      module procedure :: true_0, true_1
   end interface assertTrue
   interface assertFalse
      module procedure :: false_0, false_1
   end interface assertFalse
   interface assertIsNaN
      module procedure :: is_nan_r, is_nan_s
   end interface assertIsNaN
   interface assertIsFinite
      module procedure :: is_finite_r, is_finite_s
   end interface assertIsFinite

contains

   subroutine equal_r0(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected, actual
      real(real64), intent(in), optional :: tolerance
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare([expected], [actual], value_of(tolerance), .false., [integer ::], [integer ::], &
         message, location)
   end subroutine equal_r0

   subroutine equal_r1(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected(:), actual(:)
      real(real64), intent(in), optional :: tolerance
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare(expected, actual, value_of(tolerance), .false., shape(expected), shape(actual), &
         message, location)
   end subroutine equal_r1

   subroutine equal_r01(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected, actual(:)
      real(real64), intent(in), optional :: tolerance
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare([expected], actual, value_of(tolerance), .false., shape(expected), shape(actual), &
         message, location)
   end subroutine equal_r01

   subroutine equal_r2(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected(:, :), actual(:, :)
      real(real64), intent(in), optional :: tolerance
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare(reshape(expected, [size(expected)]), reshape(actual, [size(actual)]), value_of(tolerance), .false., &
         shape(expected), shape(actual), &
         message, location)
   end subroutine equal_r2

   subroutine equal_r02(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected, actual(:, :)
      real(real64), intent(in), optional :: tolerance
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare([expected], reshape(actual, [size(actual)]), value_of(tolerance), .false., shape(expected), &
         shape(actual), &
         message, location)
   end subroutine equal_r02

   subroutine equal_ir0(expected, actual, tolerance, message, location)
      integer, intent(in) :: expected
      real(real64), intent(in) :: actual
      real(real64), intent(in), optional :: tolerance
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call equal_r0(real(expected, real64), actual, tolerance, message, location)
   end subroutine equal_ir0

   subroutine equal_sr0(expected, actual, tolerance, message, location)
      real(real32), intent(in) :: expected
      real(real64), intent(in) :: actual
      real(real64), intent(in), optional :: tolerance
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call equal_r0(real(expected, real64), actual, tolerance, message, location)
   end subroutine equal_sr0

   subroutine equal_s0(expected, actual, tolerance, message, location)
      real(real32), intent(in) :: expected, actual
      real(real32), intent(in), optional :: tolerance
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      real(real64) :: allowed
      allowed = 0
      if (present(tolerance)) allowed = real(tolerance, real64)
      call assertEqual(real(expected, real64), real(actual, real64), allowed, message, location)
   end subroutine equal_s0

   subroutine equal_s1(expected, actual, tolerance, message, location)
      real(real32), intent(in) :: expected(:), actual(:)
      real(real32), intent(in), optional :: tolerance
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      real(real64) :: allowed
      allowed = 0
      if (present(tolerance)) allowed = real(tolerance, real64)
      call assertEqual(real(expected, real64), real(actual, real64), allowed, message, location)
   end subroutine equal_s1

   subroutine relatively_0(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected, actual
      real(real64), intent(in) :: tolerance
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare([expected], [actual], tolerance, .true., [integer ::], [integer ::], message, location)
   end subroutine relatively_0

   subroutine relatively_1(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected(:), actual(:)
      real(real64), intent(in) :: tolerance
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare(expected, actual, tolerance, .true., shape(expected), shape(actual), message, location)
   end subroutine relatively_1

   subroutine relatively_2(expected, actual, tolerance, message, location)
      real(real64), intent(in) :: expected(:, :), actual(:, :)
      real(real64), intent(in) :: tolerance
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare(reshape(expected, [size(expected)]), reshape(actual, [size(actual)]), tolerance, .true., &
         shape(expected), shape(actual), message, location)
   end subroutine relatively_2

   subroutine equal_i0(expected, actual, message, location)
      integer, intent(in) :: expected, actual
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare_integers([int(expected, int64)], [int(actual, int64)], [integer ::], [integer ::], message, location)
   end subroutine equal_i0

   subroutine equal_i1(expected, actual, message, location)
      integer, intent(in) :: expected(:), actual(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare_integers(int(expected, int64), int(actual, int64), shape(expected), shape(actual), message, location)
   end subroutine equal_i1

   subroutine equal_i01(expected, actual, message, location)
      integer, intent(in) :: expected, actual(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare_integers([int(expected, int64)], int(actual, int64), shape(expected), shape(actual), message, location)
   end subroutine equal_i01

   subroutine equal_i2(expected, actual, message, location)
      integer, intent(in) :: expected(:, :), actual(:, :)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare_integers(int(reshape(expected, [size(expected)]), int64), int(reshape(actual, [size(actual)]), int64), &
         shape(expected), shape(actual), message, location)
   end subroutine equal_i2

   subroutine equal_i02(expected, actual, message, location)
      integer, intent(in) :: expected, actual(:, :)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare_integers([int(expected, int64)], int(reshape(actual, [size(actual)]), int64), shape(expected), &
         shape(actual), message, location)
   end subroutine equal_i02

   subroutine equal_l0(expected, actual, message, location)
      integer(int64), intent(in) :: expected, actual
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare_integers([int(expected, int64)], [int(actual, int64)], [integer ::], [integer ::], message, location)
   end subroutine equal_l0

   subroutine equal_l1(expected, actual, message, location)
      integer(int64), intent(in) :: expected(:), actual(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare_integers(int(expected, int64), int(actual, int64), shape(expected), shape(actual), message, location)
   end subroutine equal_l1

   subroutine equal_l00(expected, actual, message, location)
      integer, intent(in) :: expected
      integer(int64), intent(in) :: actual
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare_integers([int(expected, int64)], [int(actual, int64)], [integer ::], [integer ::], message, location)
   end subroutine equal_l00

   subroutine equal_b0(expected, actual, message, location)
      integer, intent(in) :: expected
      integer(int8), intent(in) :: actual
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call compare_integers([int(expected, int64)], [int(actual, int64)], [integer ::], [integer ::], message, location)
   end subroutine equal_b0

   subroutine equal_logical(expected, actual, message, location)
      logical, intent(in) :: expected, actual
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(expected .eqv. actual, 'expected '//merge('true ', 'false', expected)//', found '//merge('true ', &
         'false', actual), &
         message, location)
   end subroutine equal_logical

   subroutine equal_logical_1(expected, actual, message, location)
      logical, intent(in) :: expected(:), actual(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      if (size(expected) /= size(actual)) then
         call conclude(.false., 'expected and found differ in shape', message, location)
      else
         call conclude(all(expected .eqv. actual), 'logical arrays differ at ('// &
            text_i(int(findloc(expected .neqv. actual, .true., 1), int64))//')', message, location)
      end if
   end subroutine equal_logical_1

   subroutine equal_text(expected, actual, message, location)
      character(len=*), intent(in) :: expected, actual
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      ! Trailing blanks do not count, as in pFUnit's default.
      call conclude(expected == actual, 'expected "'//trim(expected)//'", found "'//trim(actual)//'"', message, location)
   end subroutine equal_text

   ! ---------------------------------------------------------------- order

   subroutine less_i(a, b, message, location)
      integer, intent(in) :: a, b
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(a < b, 'expected '//text_i(int(a, int64))//' to be less than '//text_i(int(b, int64)), message, location)
   end subroutine less_i

   subroutine less_l(a, b, message, location)
      integer(int64), intent(in) :: a, b
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(a < b, 'expected '//text_i(a)//' to be less than '//text_i(b), message, location)
   end subroutine less_l

   subroutine less_r(a, b, message, location)
      real(real64), intent(in) :: a, b
      logical :: holds
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      holds = .false.
      if (.not. (ieee_is_nan(a) .or. ieee_is_nan(b))) holds = a < b
      call conclude(holds, 'expected '//text_r(a)//' to be less than '//text_r(b), message, location)
   end subroutine less_r

   subroutine less_equal_i(a, b, message, location)
      integer, intent(in) :: a, b
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(a <= b, 'expected '//text_i(int(a, int64))//' to be at most '//text_i(int(b, int64)), message, location)
   end subroutine less_equal_i

   subroutine less_equal_l(a, b, message, location)
      integer(int64), intent(in) :: a, b
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(a <= b, 'expected '//text_i(a)//' to be at most '//text_i(b), message, location)
   end subroutine less_equal_l

   subroutine less_equal_r(a, b, message, location)
      real(real64), intent(in) :: a, b
      logical :: holds
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      holds = .false.
      if (.not. (ieee_is_nan(a) .or. ieee_is_nan(b))) holds = a <= b
      call conclude(holds, 'expected '//text_r(a)//' to be at most '//text_r(b), message, location)
   end subroutine less_equal_r

   subroutine greater_i(a, b, message, location)
      integer, intent(in) :: a, b
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(a > b, 'expected '//text_i(int(a, int64))//' to be more than '//text_i(int(b, int64)), message, location)
   end subroutine greater_i

   subroutine greater_l(a, b, message, location)
      integer(int64), intent(in) :: a, b
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(a > b, 'expected '//text_i(a)//' to be more than '//text_i(b), message, location)
   end subroutine greater_l

   subroutine greater_r(a, b, message, location)
      real(real64), intent(in) :: a, b
      logical :: holds
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      holds = .false.
      if (.not. (ieee_is_nan(a) .or. ieee_is_nan(b))) holds = a > b
      call conclude(holds, 'expected '//text_r(a)//' to be more than '//text_r(b), message, location)
   end subroutine greater_r

   subroutine greater_equal_i(a, b, message, location)
      integer, intent(in) :: a, b
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(a >= b, 'expected '//text_i(int(a, int64))//' to be at least '//text_i(int(b, int64)), message, location)
   end subroutine greater_equal_i

   subroutine greater_equal_l(a, b, message, location)
      integer(int64), intent(in) :: a, b
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(a >= b, 'expected '//text_i(a)//' to be at least '//text_i(b), message, location)
   end subroutine greater_equal_l

   subroutine greater_equal_r(a, b, message, location)
      real(real64), intent(in) :: a, b
      logical :: holds
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      holds = .false.
      if (.not. (ieee_is_nan(a) .or. ieee_is_nan(b))) holds = a >= b
      call conclude(holds, 'expected '//text_r(a)//' to be at least '//text_r(b), message, location)
   end subroutine greater_equal_r

   ! ---------------------------------------------------------------- conditions

   subroutine true_0(condition, message, location)
      logical, intent(in) :: condition
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(condition, 'expected true, found false', message, location)
   end subroutine true_0

   subroutine true_1(condition, message, location)
      logical, intent(in) :: condition(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(all(condition), 'expected all true, found false', message, location)
   end subroutine true_1

   subroutine false_0(condition, message, location)
      logical, intent(in) :: condition
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(.not. condition, 'expected false, found true', message, location)
   end subroutine false_0

   subroutine false_1(condition, message, location)
      logical, intent(in) :: condition(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(.not. any(condition), 'expected all false, found true', message, location)
   end subroutine false_1

   subroutine is_nan_r(x, message, location)
      real(real64), intent(in) :: x
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(ieee_is_nan(x), 'expected NaN, found '//text_r(x), message, location)
   end subroutine is_nan_r

   subroutine is_finite_r(x, message, location)
      real(real64), intent(in) :: x
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(ieee_is_finite(x), 'expected a finite value, found '//text_r(x), message, location)
   end subroutine is_finite_r

   subroutine is_nan_s(x, message, location)
      real(real32), intent(in) :: x
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(ieee_is_nan(x), 'expected NaN, found '//text_r(real(x, real64)), message, location)
   end subroutine is_nan_s

   subroutine is_finite_s(x, message, location)
      real(real32), intent(in) :: x
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(ieee_is_finite(x), 'expected a finite value, found '//text_r(real(x, real64)), message, location)
   end subroutine is_finite_s

   !> Fail, whatever happens.
   subroutine assertFail(message, location)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      call conclude(.false., 'this place was not to be reached', message, location)
   end subroutine assertFail
end module funit
