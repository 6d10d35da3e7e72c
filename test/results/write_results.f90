!> Writes a result file with known values, for test_vtkhdf.py.
!>
!> write_results FILE CELLS STEPS [close|kill|restart [COMPRESS [double|single|large [LAST]]]]
!>    FILE     name of the VTKHDF file; the history goes to FILE.history.csv
!>    CELLS    cells along a side of the unit square, two triangles each
!>    STEPS    number of steps to write (restart: more steps)
!>    kill     end without closing anything, as a killed run does
!>    restart  continue an existing file after increment LAST
!>    COMPRESS level of compression, default 1; single: fields in single precision; large: with values that it cannot hold
program write_results
   use, intrinsic :: iso_c_binding, only: c_int, c_intptr_t
   use, intrinsic :: iso_fortran_env, only: error_unit
   use finshell_error, only: error_t
   use finshell_field, only: field_t, increment_t, name_t
   use finshell_history, only: history_file_t
   use finshell_kinds, only: wp
   use finshell_results, only: results_file_t
   use finshell_storage, only: storage_t
   implicit none
   interface
      function c_raise(signal) bind(c, name='raise') result(status)
         import :: c_int
         integer(c_int), value :: signal
         integer(c_int) :: status
      end function c_raise
      function c_signal(signal, handler) bind(c, name='signal') result(previous)
         import :: c_int, c_intptr_t
         integer(c_int), value :: signal
         integer(c_intptr_t), value :: handler
         integer(c_intptr_t) :: previous
      end function c_signal
   end interface
   integer(c_int), parameter :: signal_kill = 9, signal_file_size = 25
   integer(c_intptr_t), parameter :: ignore = 1
   character(len=*), parameter :: input = '&job name = "square" /'//new_line('a')//'! größer'//new_line('a')
   type(results_file_t) :: results
   type(storage_t) :: storage
   type(history_file_t) :: history
   type(error_t), allocatable :: error
   type(field_t) :: points(3), cells(2)
   type(name_t) :: monitors(2)
   type(increment_t) :: record
   real(wp), allocatable :: x(:, :)
   integer, allocatable :: triangles(:, :)
   character(len=:), allocatable :: file, mode
   integer :: step, steps, first

   ! a limit on the size of a file is to act like a full disk; the backtrace of gfortran would catch its signal
   if (c_signal(signal_file_size, ignore) < 0) error stop 'signal'
   file = argument(1, 'results.vtkhdf')
   mode = argument(4, 'close')
   steps = number(argument(3, '3'))
   storage = storage_t(number(argument(5, '1')), argument(6, 'double') /= 'double')
   call square(number(argument(2, '4')))
   points = [field_t('displacement', 3), field_t('rotation', 3), field_t('temperature', 1)]
   cells = [field_t('thickness_stretch', 1), field_t('membrane_force', 3)]
   monitors(1)%text = 'w'
   monitors(2)%text = 'p, in "psi"'
   first = 0
   if (mode == 'restart') then
      first = number(argument(7, '0')) + 1
      call results%open_for_restart(file, file//'.restart', '0.0.0', input, x, triangles, points, cells, monitors, first - 1, &
         & error, storage)
      call stop_on(error)
      call results%publish(error)
      call stop_on(error)
      call history%open_for_restart(file//'.history.csv', file//'~.history.csv', monitors, first - 1, error)
      call stop_on(error)
      call history%publish(file//'.history.csv', error)
   else
      call results%create(file, '0.0.0', input, x, triangles, points, cells, monitors, error, storage=storage)
      call stop_on(error)
      call history%create(file//'.history.csv', monitors, error)
   end if
   call stop_on(error)
   do step = first, first + steps - 1
      call fill(step)
      record = increment_t(step, sin(0.3_wp*step), 3 + step, 0, [0.1_wp*step, 1.0_wp/(1 + step)])
      call results%log_line('increment converged', error)
      call stop_on(error)
      call history%append(record, error)
      call stop_on(error)
      call results%append(record, points, cells, error)
      call stop_on(error)
   end do
   if (mode == 'kill') step = c_raise(signal_kill)
   call results%close(error)
   call stop_on(error)
   call history%close()

contains

   function argument(i, default) result(text)
      integer, intent(in) :: i
      character(len=*), intent(in) :: default
      character(len=:), allocatable :: text
      character(len=4096) :: buffer
      call get_command_argument(i, buffer)
      text = trim(buffer)
      if (len(text) == 0) text = default
   end function argument

   integer function number(text)
      character(len=*), intent(in) :: text
      read (text, *) number
   end function number

   subroutine square(m)
      integer, intent(in) :: m
      integer :: i, j, a
      allocate (x(3, (m + 1)**2), triangles(3, 2*m*m))
      do j = 0, m
         do i = 0, m
            x(:, 1 + i + (m + 1)*j) = [real(i, wp)/m, real(j, wp)/m, 0.0_wp]
         end do
      end do
      do j = 0, m - 1
         do i = 0, m - 1
            a = 1 + i + (m + 1)*j
            triangles(:, 1 + 2*(i + m*j)) = [a, a + 1, a + m + 2]
            triangles(:, 2 + 2*(i + m*j)) = [a, a + m + 2, a + m + 1]
         end do
      end do
   end subroutine square

   !> displacement = step*(x, y, 1 + x*y), rotation = 2*displacement, temperature = node + 1000*step,
   !> thickness_stretch = element + 0.5*step, membrane_force = (step, element, -1).
   subroutine fill(k)
      integer, intent(in) :: k
      integer :: i
      points(1)%values = k*x
      points(1)%values(3, :) = k*(1.0_wp + x(1, :)*x(2, :))
      points(2)%values = 2.0_wp*points(1)%values
      points(3)%values = reshape([(i + 1000.0_wp*k, i=1, size(x, 2))], [1, size(x, 2)])
      cells(1)%values = reshape([(i + 0.5_wp*k, i=1, size(triangles, 2))], [1, size(triangles, 2)])
      if (argument(6, '') == 'large') points(2)%values(1, 1) = -3.5e38_wp
      cells(2)%values = reshape([(real(k, wp), real(i, wp), -1.0_wp, i=1, size(triangles, 2))], [3, size(triangles, 2)])
   end subroutine fill

   subroutine stop_on(failure)
      type(error_t), allocatable, intent(in) :: failure
      if (.not. allocated(failure)) return
      write (error_unit, '(a)') failure%message
      stop 3, quiet=.true.
   end subroutine stop_on
end program write_results
