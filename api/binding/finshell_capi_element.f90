!> C interface: the element, many at a time. See finshell.h for what the functions promise.
!>
!> A C pointer that may be NULL is an optional argument, absent when NULL. The short forms make a block of their arguments and go
!> the same way.
module finshell_capi_element
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_int, c_int32_t, c_null_ptr, c_ptr
   use finshell_batch, only: evaluate_elements, recover_elements
   use finshell_capi_common, only: accept, c_status_t, judge, refuse, refuse_memory
   use finshell_capi_elements, only: c_elements_t, complaint, no_handle, read_block, receive, whole_block
   use finshell_capi_handle, only: section_of
   use finshell_environment, only: environment_t, hold, release
   use finshell_mass, only: mass_elements
   use finshell_pressure, only: follower_pressure
   use finshell_section, only: section_t
   use finshell_status, only: status_collapsed_element, status_not_a_number, status_ok
   implicit none
   private
   public :: elements_evaluate, elements_recover, evaluate, recover, mass, pressure, conclude

   integer, parameter :: few = 64 !< elements whose codes need no heap
   integer, parameter :: most_threads = 256 !< results do not depend on it; OpenMP ends the program when it gets too few

   interface
      function getpid() result(process) bind(c)
         import :: c_int
         integer(c_int) :: process
      end function getpid
   end interface

contains

   function elements_evaluate(section, elements, energy, force, tangent, codes, status) result(code) &
      bind(c, name='finshell_elements_evaluate')
      type(c_ptr), value :: section, elements
      real(c_double), intent(out), optional :: energy(*), force(*), tangent(*)
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_elements_evaluate'
      type(c_elements_t) :: block
      code = read_block(place, elements, block, status)
      if (code == status_ok) code = evaluate_given(place, section, block, energy, force, tangent, codes, status)
   end function elements_evaluate

   function elements_recover(section, elements, stretch, membrane_force, moment, stress, codes, status) result(code) &
      bind(c, name='finshell_elements_recover')
      type(c_ptr), value :: section, elements
      real(c_double), intent(out), optional :: stretch(*), membrane_force(*), moment(*), stress(*)
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_elements_recover'
      type(c_elements_t) :: block
      code = read_block(place, elements, block, status)
      if (code == status_ok) code = recover_given(place, section, block, stretch, membrane_force, moment, stress, codes, status)
   end function elements_recover

   function evaluate(section, n, x, u, rotations, convention, state, direction, energy, force, tangent, codes, threads, status) &
      result(code) bind(c, name='finshell_evaluate')
      type(c_ptr), value :: section, x, u, rotations, state, direction
      integer(c_int32_t), value :: n, convention, threads
      real(c_double), intent(out), optional :: energy(*), force(*), tangent(*)
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(c_elements_t) :: block
      block = c_elements_t(whole_block(), n, convention, threads, 0, x, u, rotations, state, direction)
      code = evaluate_given('finshell_evaluate', section, block, energy, force, tangent, codes, status)
   end function evaluate

   function recover(section, n, x, u, rotations, convention, state, direction, stretch, membrane_force, moment, stress, codes, &
                    status) result(code) bind(c, name='finshell_recover')
      type(c_ptr), value :: section, x, u, rotations, state, direction
      integer(c_int32_t), value :: n, convention
      real(c_double), intent(out), optional :: stretch(*), membrane_force(*), moment(*), stress(*)
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(c_elements_t) :: block
      block = c_elements_t(whole_block(), n, convention, 1, 0, x, u, rotations, state, direction)
      code = recover_given('finshell_recover', section, block, stretch, membrane_force, moment, stress, codes, status)
   end function recover

   function evaluate_given(place, section, block, energy, force, tangent, codes, status) result(code)
      character(len=*), intent(in) :: place
      type(c_ptr), intent(in) :: section
      type(c_elements_t), intent(in) :: block
      real(c_double), intent(out), optional :: energy(block%n), force(18, block%n), tangent(18, 18, block%n)
      integer(c_int32_t), intent(out), optional, target :: codes(block%n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(section_t), pointer :: s
      real(c_double), pointer, contiguous, dimension(:, :, :) :: x, u, r, state, normal
      real(c_double), pointer, contiguous, dimension(:, :) :: direction, toward
      integer, allocatable :: held(:, :)
      integer(c_int32_t), target :: local(few)
      integer(c_int32_t), allocatable, target :: many(:)
      integer(c_int32_t), pointer, contiguous :: found(:)
      integer :: memory, team

      code = receive(place, section, block, s, x, u, r, state, direction, normal, toward, held, status)
      if (code /= status_ok .or. block%n == 0) return
      if (present(codes)) then
         found => codes
      else if (block%n <= few) then
         found => local(:block%n)
      else
         allocate (many(block%n), stat=memory)
         if (memory /= 0) then
            code = refuse_memory(status, place)
            return
         end if
         found => many
      end if
      if (block%threads == 0 .and. .not. forked()) then
         call evaluate_elements(s, block%n, x, u, r, block%convention, found, energy, force, tangent, direction, state=state, &
                                toward=toward, held=held, normal=normal)
      else
         team = min(block%threads, most_threads)
         if (team > 1) team = merge(1, team, forked())
         call evaluate_elements(s, block%n, x, u, r, block%convention, found, energy, force, tangent, direction, max(1, team), &
                                state, toward=toward, held=held, normal=normal)
      end if
      code = conclude(place, block, found, status)
   end function evaluate_given

   function recover_given(place, section, block, stretch, membrane_force, moment, stress, codes, status) result(code)
      character(len=*), intent(in) :: place
      type(c_ptr), intent(in) :: section
      type(c_elements_t), intent(in) :: block
      real(c_double), intent(out), optional :: stretch(block%n), membrane_force(3, block%n), moment(3, block%n), &
                                               stress(3, 3, block%n)
      integer(c_int32_t), intent(out), optional :: codes(block%n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(section_t), pointer :: s
      real(c_double), pointer, contiguous, dimension(:, :, :) :: x, u, r, state, normal
      real(c_double), pointer, contiguous, dimension(:, :) :: direction, toward
      integer, allocatable :: held(:, :)
      integer(c_int32_t), allocatable :: found(:)
      integer :: memory

      code = receive(place, section, block, s, x, u, r, state, direction, normal, toward, held, status)
      if (code /= status_ok .or. block%n == 0) return
      allocate (found(block%n), stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      call recover_elements(s, block%n, x, u, r, block%convention, found, stretch, membrane_force, moment, stress, direction, &
                            state, held=held, normal=normal)
      if (present(codes)) codes = found
      code = conclude(place, block, found, status)
   end function recover_given

   !> What a call returns.
   function conclude(place, block, codes, status) result(code)
      character(len=*), intent(in) :: place
      type(c_elements_t), intent(in) :: block
      integer(c_int32_t), intent(in) :: codes(:)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      if (all(codes >= status_ok)) then
         code = judge(status, place, block%n, codes)
      else
         call hold(environment)
         code = judge(status, place, block%n, codes, complaint(block, codes))
         call release(environment)
      end if
   end function conclude

   function mass(section, n, x, consistent, lumped, codes, status) result(code) bind(c, name='finshell_mass_matrix')
      type(c_ptr), value :: section
      integer(c_int32_t), value :: n
      real(c_double), intent(in), optional :: x(3, 3, n)
      real(c_double), intent(out), optional :: consistent(18, 18, n), lumped(18, n)
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_mass_matrix'
      type(environment_t) :: environment
      type(section_t), pointer :: s
      integer(c_int32_t), allocatable :: found(:)
      integer :: memory

      code = check_batch(place, n, status)
      if (code /= status_ok) return
      if (.not. c_associated(section)) then
         code = refuse(status, place, 'section is NULL')
      else if (.not. associated(section_of(section))) then
         code = refuse(status, place, no_handle)
      else if (n > 0 .and. .not. present(x)) then
         code = refuse(status, place, 'X is NULL')
      end if
      if (code /= status_ok .or. n == 0) return
      s => section_of(section)
      allocate (found(n), stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      call hold(environment)
      call mass_elements(s, n, x, found, consistent, lumped)
      call release(environment)
      if (present(codes)) codes = found
      code = judge(status, place, n, found)
   end function mass

   function pressure(n, p, x, u, form, origin, force, stiffness, codes, status) result(code) bind(c, name='finshell_pressure_load')
      integer(c_int32_t), value :: n, form
      real(c_double), intent(in), optional :: p(n), x(3, 3, n), u(3, 3, n), origin(3)
      real(c_double), intent(out), optional :: force(9, n), stiffness(9, 9, n)
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_pressure_load'
      type(environment_t) :: environment
      real(c_double) :: position(3, 3, 1), centre(3), f(9, 1), total
      integer(c_int32_t), allocatable :: found(:)
      integer :: e, memory

      code = check_batch(place, n, status)
      if (code /= status_ok) return
      if (form /= 0 .and. form /= 1) then
         code = refuse(status, place, 'form is #, expected 0 (follower) or 1 (symmetric)', form)
      else if (n > 0 .and. .not. (present(p) .and. present(x) .and. present(u))) then
         code = refuse(status, place, 'pressure, X or u is NULL')
      end if
      if (code /= status_ok .or. n == 0) return
      allocate (found(n), stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      call hold(environment)
      centre = 0
      if (present(origin)) centre = origin
      do e = 1, n
         position(:, :, 1) = x(:, :, e) + u(:, :, e)
         found(e) = status_ok
         if (.not. sum(0*x(:, :, e)) + sum(0*u(:, :, e)) + 0*p(e) + sum(0*centre) <= 0) found(e) = status_not_a_number
         if (present(stiffness)) then
            call follower_pressure(1, p(e:e), position, form == 1, centre, f, stiffness(:, :, e:e))
            total = sum(0*f) + sum(0*stiffness(:, :, e))
         else
            call follower_pressure(1, p(e:e), position, form == 1, centre, f)
            total = sum(0*f)
         end if
         ! an area that overflows
         if (found(e) == status_ok .and. .not. total <= 0) found(e) = status_collapsed_element
         if (found(e) /= status_ok) then
            f = 0
            if (present(stiffness)) stiffness(:, :, e) = 0
         end if
         if (present(force)) force(:, e) = f(:, 1)
      end do
      call release(environment)
      if (present(codes)) codes = found
      code = judge(status, place, n, found)
   end function pressure

   !> Whether this process is the child of one that called us with several threads.
   !>
   !> The threads of OpenMP do not follow into a child, but OpenMP does not know and would wait for them for ever.
   function forked() result(answer)
      logical :: answer
      integer(c_int), save :: owner = 0 ! process whose threads were used first
      integer(c_int) :: known, here
      here = getpid()
!$omp atomic read
      known = owner
      answer = known /= 0 .and. known /= here
      if (known /= 0) return
!$omp atomic write
      owner = here
   end function forked

   !> n makes sense; sets `status` to done.
   function check_batch(place, n, status) result(code)
      character(len=*), intent(in) :: place
      integer(c_int32_t), intent(in) :: n
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      if (n < 0) then
         code = refuse(status, place, 'n is #, expected a number of elements >= 0', n)
      else
         code = accept(status)
      end if
   end function check_batch
end module finshell_capi_element
