!> What the C interface costs over the Fortran batch call: force and tangent, one thread, Mooney-Rivlin, 3 x 3 points.
!>
!> The two calls take turns, round after round: whatever else the machine does hits both; the least of all rounds counts. One
!> element alone is computed as a block of eight: its line shows what that costs.
!>
!>     bench_capi            the figures above
!>     bench_capi check      fails when 1000 elements cost more than 1 % over, or one element more than 0.3 microseconds over
program bench_capi
   use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_loc, c_null_ptr, c_ptr
   use, intrinsic :: iso_fortran_env, only: int64
   use finshell_batch, only: evaluate_elements, rotation_vector
   use finshell_capi_handle, only: handle_t, new_handle
   use finshell_error, only: error_t
   use finshell_kinds, only: dp, i4, wp
   use finshell_material, only: material_t
   use finshell_registry, only: new_material
   use finshell_section, only: new_section, section_t
   implicit none

   interface
      function finshell_evaluate(section, n, x, u, rotations, convention, state, direction, energy, force, tangent, codes, &
                                 threads, status) result(code) bind(c, name='finshell_evaluate')
         import :: c_double, c_int32_t, c_ptr
         type(c_ptr), value :: section, state, direction, energy, codes, status
         integer(c_int32_t), value :: n, convention, threads
         real(c_double), intent(in) :: x(*), u(*), rotations(*)
         real(c_double), intent(inout) :: force(*), tangent(*)
         integer(c_int32_t) :: code
      end function finshell_evaluate
   end interface

   integer, parameter :: sizes(*) = [1, 8, 64, 1000, 10000], rounds = 1001
   integer, parameter :: longest = 10000
   type(section_t) :: section
   type(handle_t), pointer :: handle
   class(material_t), allocatable :: law
   type(error_t), allocatable :: error
   real(wp), allocatable :: x(:, :, :), u(:, :, :), t(:, :, :), force(:, :), tangent(:, :, :)
   integer(i4), allocatable :: codes(:)
   real(dp) :: fortran, c, over, percent(size(sizes)), over_one
   integer :: i
   logical :: right
   character(len=16) :: mode

   call new_material(law, 'mooney_rivlin', ['c10', 'c01'], [80.0_wp, 20.0_wp], error)
   if (.not. allocated(error)) call new_section(section, law, 0.1_wp, error)
   if (allocated(error)) error stop error%message
   handle => new_handle()
   handle%section = section
   allocate (x(3, 3, longest), u(3, 3, longest), t(3, 3, longest), force(18, longest), tangent(18, 18, longest), codes(longest))
   call motion()
   call get_command_argument(1, mode)

   write (*, '(a)') 'force + tangent, one thread, microseconds per call'
   write (*, '(a)') '  elements    Fortran          C   C - Fortran    per cent   per element'
   do i = 1, size(sizes)
      call compare(sizes(i), fortran, c, over)
      percent(i) = 100*over/fortran
      if (sizes(i) == 1) over_one = over
      write (*, '(i10,3f13.4,f11.3,f13.4)') sizes(i), fortran, c, over, percent(i), c/sizes(i)
   end do
   right = over_one < 0.3_dp .and. percent(4) < 1
   write (*, '(a,f7.4,a)') 'one element alone: the C call adds ', over_one, ' microseconds (limit 0.3)'
   write (*, '(a,f7.4,a)') '1000 elements: the C call adds ', percent(4), ' per cent (limit 1)'
   if (mode == 'check' .and. .not. right) error stop 'bench_capi: a limit is exceeded'

contains

   !> Stretched, bent triangles.
   subroutine motion()
      real(wp), parameter :: corner(2, 3) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 3])
      integer :: e, j
      do e = 1, longest
         do j = 1, 3
            x(1:2, j, e) = corner(:, j) + 0.05_wp*[sin(1.0_wp*e + j), cos(2.0_wp*e - j)]
            x(3, j, e) = 0.02_wp*sin(3.0_wp*e + j)
            u(:, j, e) = [0.2_wp*x(1, j, e), -0.1_wp*x(2, j, e), 0.3_wp*x(1, j, e)**2]
            t(:, j, e) = [0.0_wp, -0.6_wp*x(1, j, e), 0.0_wp] + 0.01_wp*sin(5.0_wp*e + j)
         end do
      end do
   end subroutine motion

   !> Times per call (microseconds) and their difference.
   subroutine compare(n, fortran, c, over)
      integer, intent(in) :: n
      real(dp), intent(out) :: fortran, c, over
      real(dp) :: times(2)
      integer :: calls, first, r, w, which
      calls = max(1, 200/n)
      times = huge(1.0_dp)
      do r = 1, min(rounds, 2000000/n)
         do w = 1, 2
            which = 1 + mod(w + r, 2) ! each is first every other round
            first = 1 + mod(7*r, max(1, longest - n))
            times(which) = min(times(which), elapsed(which, n, calls, first))
         end do
      end do
      fortran = times(1)
      c = times(2)
      over = c - fortran
   end subroutine compare

   !> Microseconds per call.
   real(dp) function elapsed(which, n, calls, first)
      integer, intent(in) :: which, n, calls, first
      integer(int64) :: start, finish, rate
      integer(c_int32_t) :: code
      integer :: i
      call system_clock(start, rate)
      if (which == 1) then
         do i = 1, calls
            call evaluate_elements(section, n, x(:, :, first:first + n - 1), u(:, :, first:first + n - 1), &
                                   t(:, :, first:first + n - 1), rotation_vector, codes, force=force, tangent=tangent, threads=1)
         end do
      else
         do i = 1, calls
            code = finshell_evaluate(c_loc(handle), n, x(:, :, first:), u(:, :, first:), t(:, :, first:), rotation_vector, &
                                     c_null_ptr, c_null_ptr, c_null_ptr, force, tangent, c_null_ptr, 1, c_null_ptr)
            if (code /= 0) error stop 'bench_capi: an element failed'
         end do
      end if
      call system_clock(finish)
      elapsed = 1.0e6_dp*(finish - start)/(real(rate, dp)*calls)
   end function elapsed
end program bench_capi
