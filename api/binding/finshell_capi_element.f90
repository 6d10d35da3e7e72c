!> C interface: the element, many at a time. See finshell.h for what the functions promise.
!>
!> A C pointer that may be NULL is an optional argument, absent when NULL. The short forms make a block of their arguments and go
!> the same way.
module finshell_capi_element
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int32_t, c_null_ptr, c_ptr
   use finshell_batch, only: evaluate_elements, recover_elements
   use finshell_capi_common, only: c_status_t, check_batch, judge, refuse, refuse_memory
   use finshell_capi_elements, only: as_seen_by, c_elements_t, conclude, freedoms_of, read_block, receive, &
      receive_own, receive_section, receive_states, whole_block
   use finshell_environment, only: environment_t, hold, release
   use finshell_fork, only: forked
   use finshell_law_states, only: law_states_t
   use finshell_mass, only: mass_elements, mass_membranes
   use finshell_membrane_batch, only: evaluate_membranes, recover_membranes
   use finshell_section, only: section_t
   use finshell_status, only: status_ok
   implicit none
   private
   public :: elements_evaluate, elements_recover, elements_mass, evaluate, evaluate_given, most_threads, recover, mass

   integer, parameter :: few = 64 !< elements whose codes need no heap
   integer, parameter :: most_threads = 256 !< results do not depend on it; OpenMP ends the program when it gets too few

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

   function evaluate_given(place, section, given, energy, force, tangent, codes, status) result(code)
      character(len=*), intent(in) :: place
      type(c_ptr), intent(in) :: section
      type(c_elements_t), intent(in) :: given
      real(c_double), intent(out), optional :: energy(given%n), force(*), tangent(*)
      integer(c_int32_t), intent(out), optional, target :: codes(given%n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(section_t), pointer :: s
      type(c_elements_t) :: block
      type(law_states_t) :: states
      real(c_double), pointer, contiguous, dimension(:, :, :) :: x, u, r, state, normal
      real(c_double), pointer, contiguous, dimension(:, :) :: direction, toward
      real(c_double), pointer, contiguous :: thickness(:), offset(:), growth(:, :, :)
      integer, allocatable :: held(:, :)
      integer(c_int32_t), target :: local(few)
      integer(c_int32_t), allocatable, target :: many(:)
      integer(c_int32_t), pointer, contiguous :: found(:)
      integer, target :: number
      integer, pointer :: team
      integer :: memory

      code = receive_section(place, section, s, status)
      if (code /= status_ok) return
      block = as_seen_by(s, given)
      code = receive(place, block, freedoms_of(s), x, u, r, state, direction, normal, toward, held, status)
      if (code == status_ok) code = receive_states(place, s, block, states, status)
      if (code /= status_ok .or. block%n == 0) return
      call receive_own(block, s, thickness, offset, growth)
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
      number = min(block%threads, most_threads)
      if (number /= 1) then
         if (forked()) number = 1
      end if
      nullify (team) ! and so absent in the call: as OpenMP chooses
      if (number /= 0) team => number
      if (s%membrane) then
         call evaluate_membranes(s, block%n, x, u, found, energy, force, tangent, direction, team, toward, &
                                 thickness=thickness, growth=growth)
      else
         call evaluate_elements(s, block%n, x, u, r, block%convention, found, energy, force, tangent, direction, team, state, &
                                toward=toward, held=held, normal=normal, thickness=thickness, offset=offset, growth=growth, &
                                states=states)
      end if
      code = conclude(place, block, found, status)
   end function evaluate_given

   function recover_given(place, section, given, stretch, membrane_force, moment, stress, codes, status) result(code)
      character(len=*), intent(in) :: place
      type(c_ptr), intent(in) :: section
      type(c_elements_t), intent(in) :: given
      real(c_double), intent(out), optional :: stretch(given%n), membrane_force(3, given%n), moment(3, given%n), &
                                               stress(3, 3, given%n)
      integer(c_int32_t), intent(out), optional :: codes(given%n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(section_t), pointer :: s
      type(c_elements_t) :: block
      type(law_states_t) :: states
      real(c_double), pointer, contiguous, dimension(:, :, :) :: x, u, r, state, normal
      real(c_double), pointer, contiguous, dimension(:, :) :: direction, toward
      real(c_double), pointer, contiguous :: thickness(:), offset(:), growth(:, :, :)
      integer, allocatable :: held(:, :)
      integer(c_int32_t), allocatable :: found(:)
      integer :: memory

      code = receive_section(place, section, s, status)
      if (code /= status_ok) return
      block = as_seen_by(s, given)
      code = receive(place, block, freedoms_of(s), x, u, r, state, direction, normal, toward, held, status)
      if (code == status_ok) code = receive_states(place, s, block, states, status)
      if (code /= status_ok .or. block%n == 0) return
      call receive_own(block, s, thickness, offset, growth)
      allocate (found(block%n), stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      if (s%membrane) then
         call recover_membranes(s, block%n, x, u, found, stretch, membrane_force, stress, direction=direction, &
                                thickness=thickness, growth=growth)
         if (present(moment)) moment = 0
      else
         call recover_elements(s, block%n, x, u, r, block%convention, found, stretch, membrane_force, moment, stress, direction, &
                               state, held=held, normal=normal, thickness=thickness, offset=offset, growth=growth, states=states)
      end if
      if (present(codes)) codes = found
      code = conclude(place, block, found, status)
   end function recover_given

   function elements_mass(section, elements, consistent, lumped, codes, status) result(code) bind(c, name='finshell_elements_mass')
      type(c_ptr), value :: section, elements
      real(c_double), intent(out), optional :: consistent(*), lumped(*)
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_elements_mass'
      type(c_elements_t) :: block
      code = read_block(place, elements, block, status)
      if (code == status_ok) code = mass_given(place, section, block, consistent, lumped, codes, status)
   end function elements_mass

   function mass(section, n, x, consistent, lumped, codes, status) result(code) bind(c, name='finshell_mass_matrix')
      type(c_ptr), value :: section, x
      integer(c_int32_t), value :: n
      real(c_double), intent(out), optional :: consistent(*), lumped(*)
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(c_elements_t) :: block
      block%n = n
      block%x = x
      code = mass_given('finshell_mass_matrix', section, block, consistent, lumped, codes, status)
   end function mass

   !> Of a block only the reference coordinates, thickness and offset count.
   function mass_given(place, section, block, consistent, lumped, codes, status) result(code)
      character(len=*), intent(in) :: place
      type(c_ptr), intent(in) :: section
      type(c_elements_t), intent(in) :: block
      real(c_double), intent(out), optional :: consistent(*), lumped(*)
      integer(c_int32_t), intent(out), optional :: codes(block%n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      type(section_t), pointer :: s
      real(c_double), pointer, contiguous :: x(:, :, :), thickness(:), offset(:), growth(:, :, :)
      integer(c_int32_t), allocatable :: found(:)
      integer :: memory

      code = check_batch(place, block%n, status)
      if (code == status_ok) code = receive_section(place, section, s, status)
      if (code /= status_ok .or. block%n == 0) return
      if (.not. c_associated(block%x)) then
         code = refuse(status, place, 'X is NULL')
         return
      end if
      call c_f_pointer(block%x, x, [3, 3, block%n])
      call receive_own(as_seen_by(s, block), s, thickness, offset, growth)
      allocate (found(block%n), stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      call hold(environment)
      if (s%membrane) then
         call mass_membranes(s, block%n, x, found, consistent, lumped, thickness)
      else
         call mass_elements(s, block%n, x, found, consistent, lumped, thickness=thickness, offset=offset)
      end if
      call release(environment)
      if (present(codes)) codes = found
      code = judge(status, place, block%n, found)
   end function mass_given
end module finshell_capi_element
