!> The inner part of funit: runs tests, counts assertions, compares lists of numbers. See funit.
module funit_core
   use, intrinsic :: iso_fortran_env, only: int64, real64, output_unit
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_is_finite
   implicit none
   private
   public :: SourceLocation, anyExceptions, funit_begin, funit_run, funit_finish
   public :: conclude, compare, compare_integers, value_of, text_i, text_r

   !> Where an assertion stands in its `.pf` file.
   type :: SourceLocation
      character(len=256) :: file = ''
      integer :: line = 0
   end type SourceLocation

   abstract interface
      subroutine test_procedure()
      end subroutine test_procedure
   end interface

   integer :: assertions = 0 !< in the test under way
   logical :: failed = .false. !< in the test under way
   integer :: tests_run = 0, tests_failed = 0, assertions_total = 0
   character(len=256) :: suite = ''
   character(len=256) :: wanted = '' !< from the command line: run this test only

contains

   !> Start a test program. Its first command argument, if any, is the name of the one test to run.
   subroutine funit_begin(name)
      character(len=*), intent(in) :: name
      suite = name
      if (command_argument_count() > 0) call get_command_argument(1, wanted)
   end subroutine funit_begin

   !> Run one test between its fixtures.
   subroutine funit_run(name, test, before, after)
      character(len=*), intent(in) :: name
      procedure(test_procedure) :: test
      procedure(test_procedure), optional :: before, after
      if (wanted /= '' .and. wanted /= name) return
      assertions = 0
      failed = .false.
      tests_run = tests_run + 1
      if (present(before)) call before()
      if (.not. failed) call test()
      if (present(after)) call after()
      if (assertions == 0) then
         failed = .true.
         write (output_unit, '(5a)') trim(suite), '.', name, ': made no assertion'
      end if
      if (failed) then
         tests_failed = tests_failed + 1
         write (output_unit, '(4a)') 'FAILED ', trim(suite), '.', name
      else
         write (output_unit, '(5a,i0,a)') 'ok     ', trim(suite), '.', name, ' (', assertions, ' assertions)'
      end if
      flush (output_unit)
      assertions_total = assertions_total + assertions
   end subroutine funit_run

   !> Print the summary; end the program with a status other than 0 when a test failed or none ran.
   subroutine funit_finish()
      write (output_unit, '(2a,3(i0,a))') trim(suite), ': ', tests_run, ' tests, ', assertions_total, ' assertions, ', &
         tests_failed, ' tests failed'
      flush (output_unit)
      if (tests_run == 0) then
         write (output_unit, '(a)') 'no test of that name'
         stop 2, quiet=.true.
      end if
      if (tests_failed > 0) stop 1, quiet=.true.
   end subroutine funit_finish

   !> True when an assertion of the test under way has failed: the test then returns.
   logical function anyExceptions()
      anyExceptions = failed
   end function anyExceptions

   !> Count an assertion and, when it does not hold, print why.
   subroutine conclude(holds, what, message, location)
      logical, intent(in) :: holds
      character(len=*), intent(in) :: what
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      assertions = assertions + 1
      if (holds) return
      failed = .true.
      if (present(location)) write (output_unit, '(2a,i0,a)', advance='no') trim(location%file), ':', location%line, ': '
      write (output_unit, '(a)') what
      if (present(message)) write (output_unit, '(2a)') '   ', trim(message)
   end subroutine conclude

   pure function text_i(i) result(t)
      integer(int64), intent(in) :: i
      character(len=:), allocatable :: t
      character(len=24) :: buffer
      write (buffer, '(i0)') i
      t = trim(buffer)
   end function text_i

   pure function text_r(x) result(t)
      real(real64), intent(in) :: x
      character(len=:), allocatable :: t
      character(len=32) :: buffer
      write (buffer, '(es24.16e3)') x
      t = trim(adjustl(buffer))
   end function text_r

   !> The one comparison of reals: lists of the same length (a scalar `expected` comes as a list of one and stands for all).
   subroutine compare(expected, actual, tolerance, relative, shape_e, shape_a, message, location)
      real(real64), intent(in) :: expected(:), actual(:)
      real(real64), intent(in) :: tolerance
      logical, intent(in) :: relative !< tolerance is a fraction of |expected|
      integer, intent(in) :: shape_e(:), shape_a(:) !< shapes before flattening
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      real(real64) :: e, a, allowed
      integer :: i
      if (.not. conformable(shape_e, shape_a)) then
         call conclude(.false., 'expected and found differ in shape', message, location)
         return
      end if
      do i = 1, size(actual)
         e = expected(min(i, size(expected)))
         a = actual(i)
         allowed = tolerance
         if (relative) allowed = tolerance*abs(e)
         if (close_to(e, a, allowed)) cycle
         call conclude(.false., 'expected '//text_r(e)//', found '//text_r(a)//index_text(i, shape_a)// &
            ' (tolerance '//text_r(allowed)//')', message, location)
         return
      end do
      call conclude(.true., '', message, location)
   end subroutine compare

   !> A scalar goes with any shape.
   pure logical function conformable(shape_e, shape_a)
      integer, intent(in) :: shape_e(:), shape_a(:)
      conformable = size(shape_e) == 0
      if (size(shape_e) == size(shape_a)) conformable = all(shape_e == shape_a)
   end function conformable

   pure logical function close_to(e, a, allowed)
      real(real64), intent(in) :: e, a, allowed
      close_to = .false.
      if (ieee_is_nan(e) .or. ieee_is_nan(a) .or. ieee_is_nan(allowed)) return
      close_to = e == a
      if (close_to .or. .not. (ieee_is_finite(e) .and. ieee_is_finite(a))) return
      close_to = abs(a - e) <= allowed
   end function close_to

   !> ' at (i, j)' for the i-th value of an array, nothing for a scalar.
   pure function index_text(i, extents) result(t)
      integer, intent(in) :: i, extents(:)
      character(len=:), allocatable :: t
      integer :: k, rest
      t = ''
      if (size(extents) == 0) return
      rest = i - 1
      t = ' at ('
      do k = 1, size(extents)
         if (k > 1) t = t//', '
         t = t//text_i(int(mod(rest, extents(k)) + 1, int64))
         rest = rest/extents(k)
      end do
      t = t//')'
   end function index_text

   pure real(real64) function value_of(tolerance)
      real(real64), intent(in), optional :: tolerance
      value_of = 0
      if (present(tolerance)) value_of = tolerance
   end function value_of

   subroutine compare_integers(expected, actual, shape_e, shape_a, message, location)
      integer(int64), intent(in) :: expected(:), actual(:)
      integer, intent(in) :: shape_e(:), shape_a(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      integer(int64) :: e
      integer :: i
      if (.not. conformable(shape_e, shape_a)) then
         call conclude(.false., 'expected and found differ in shape', message, location)
         return
      end if
      do i = 1, size(actual)
         e = expected(min(i, size(expected)))
         if (e == actual(i)) cycle
         call conclude(.false., 'expected '//text_i(e)//', found '//text_i(actual(i))//index_text(i, shape_a), &
            message, location)
         return
      end do
      call conclude(.true., '', message, location)
   end subroutine compare_integers
end module funit_core
