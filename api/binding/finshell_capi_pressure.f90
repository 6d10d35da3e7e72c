!> C interface: pressure, on triangles and on the elements of a block. See finshell.h for what the functions promise.
module finshell_capi_pressure
   use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_ptr
   use finshell_capi_common, only: c_status_t, check_batch, judge, refuse, refuse_memory
   use finshell_capi_elements, only: c_elements_t, conclude, read_block, receive
   use finshell_environment, only: environment_t, hold, release
   use finshell_freedoms, only: n_membrane, n_shell
   use finshell_pressure, only: follower_pressure
   use finshell_status, only: status_collapsed_element, status_not_a_number, status_ok
   use finshell_surface_pressure, only: pressure_elements
   implicit none
   private
   public :: elements_pressure, pressure

   character(len=*), parameter :: no_form = 'form is #, expected 0 (follower) or 1 (symmetric)'

contains

   function elements_pressure(elements, pressure, form, origin, volume, force, stiffness, codes, status) result(code) &
      bind(c, name='finshell_elements_pressure')
      type(c_ptr), value :: elements
      real(c_double), intent(in), optional :: pressure(*), origin(3)
      integer(c_int32_t), value :: form
      real(c_double), intent(out), optional :: volume(*), force(*), stiffness(*)
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_elements_pressure'
      type(c_elements_t) :: block
      code = read_block(place, elements, block, status)
      if (code == status_ok) code = pressure_given(place, block, pressure, form, origin, volume, force, stiffness, codes, status)
   end function elements_pressure

   function pressure_given(place, block, p, form, origin, volume, force, stiffness, codes, status) result(code)
      character(len=*), intent(in) :: place
      type(c_elements_t), intent(in) :: block
      real(c_double), intent(in), optional :: p(block%n), origin(3)
      integer(c_int32_t), intent(in) :: form
      real(c_double), intent(out), optional :: volume(block%n), force(n_shell, block%n), stiffness(n_shell, n_shell, block%n)
      integer(c_int32_t), intent(out), optional :: codes(block%n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      real(c_double), pointer, contiguous, dimension(:, :, :) :: x, u, r, state, normal
      real(c_double), pointer, contiguous, dimension(:, :) :: direction, toward
      integer, allocatable :: held(:, :)
      integer(c_int32_t), allocatable :: found(:)
      real(c_double) :: part(3, 3)
      integer :: e, i, j, memory

      code = receive(place, block, n_shell, x, u, r, state, direction, normal, toward, held, status)
      if (code /= status_ok) return
      if (form /= 0 .and. form /= 1) then
         code = refuse(status, place, no_form, form)
      else if (block%n > 0 .and. (present(force) .or. present(stiffness)) .and. .not. present(p)) then
         code = refuse(status, place, 'pressure is NULL, and force and stiffness need it')
      end if
      if (code /= status_ok .or. block%n == 0) return
      allocate (found(block%n), stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      call pressure_elements(block%n, x, u, r, block%convention, found, p, form == 1, origin, volume, force, stiffness, state, &
                             normal, held)
      if (present(stiffness) .and. form == 0) then
         ! by rows, where it is not symmetric: displacements on forces
         do e = 1, block%n
            do j = 0, 2
               do i = 0, j
                  part = stiffness(6*i + 1:6*i + 3, 6*j + 1:6*j + 3, e)
                  stiffness(6*i + 1:6*i + 3, 6*j + 1:6*j + 3, e) = transpose(stiffness(6*j + 1:6*j + 3, 6*i + 1:6*i + 3, e))
                  stiffness(6*j + 1:6*j + 3, 6*i + 1:6*i + 3, e) = transpose(part)
               end do
            end do
         end do
      end if
      if (present(codes)) codes = found
      code = conclude(place, block, found, status)
   end function pressure_given

   function pressure(n, p, x, u, form, origin, force, stiffness, codes, status) result(code) bind(c, name='finshell_pressure_load')
      integer(c_int32_t), value :: n, form
      real(c_double), intent(in), optional :: p(n), x(3, 3, n), u(3, 3, n), origin(3)
      real(c_double), intent(out), optional :: force(n_membrane, n), stiffness(n_membrane, n_membrane, n)
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_pressure_load'
      type(environment_t) :: environment
      real(c_double) :: position(3, 3, 1), centre(3), f(n_membrane, 1), total
      integer(c_int32_t), allocatable :: found(:)
      integer :: e, memory

      code = check_batch(place, n, status)
      if (code /= status_ok) return
      if (form /= 0 .and. form /= 1) then
         code = refuse(status, place, no_form, form)
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
end module finshell_capi_pressure
