!> C interface: finite rotations. See finshell.h for what the functions promise.
module finshell_capi_rotation
   use, intrinsic :: iso_c_binding, only: c_double, c_int32_t
   use finshell_capi_common, only: accept, c_status_t, judge, refuse, refuse_memory
   use finshell_environment, only: environment_t, hold, release
   use finshell_quaternion, only: quaternion_normalise, quaternion_product, quaternion_to_matrix, quaternion_to_rotation_vector, &
      rotation_vector_to_quaternion, update_quaternion
   use finshell_rotation, only: tangent_operator
   use finshell_status, only: status_invalid_argument, status_not_a_number, status_ok
   implicit none
   private
   public :: exponential, logarithm, compose, update, matrix, tangent

   real(c_double), parameter :: longest_vector = 1.0e60_c_double !< of a longer rotation vector no digit says where it ends

contains

   function exponential(n, vector, quaternion, codes, status) result(code) bind(c, name='finshell_rotation_exp')
      integer(c_int32_t), value :: n
      real(c_double), intent(in), optional :: vector(3, n)
      real(c_double), intent(out), optional :: quaternion(4, n)
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      integer(c_int32_t), allocatable :: found(:)
      integer :: e
      character(len=*), parameter :: place = 'finshell_rotation_exp'
      call start(place, n, present(vector) .and. present(quaternion), found, code, status)
      if (.not. allocated(found)) return
      call hold(environment)
      do e = 1, n
         quaternion(:, e) = 0
         found(e) = finite(vector(:, e))
         if (found(e) == status_ok) quaternion(:, e) = rotation_vector_to_quaternion(vector(:, e))
      end do
      call release(environment)
      if (present(codes)) codes = found
      code = judge(status, place, n, found)
   end function exponential

   function logarithm(n, quaternion, vector, codes, status) result(code) bind(c, name='finshell_rotation_log')
      integer(c_int32_t), value :: n
      real(c_double), intent(in), optional :: quaternion(4, n)
      real(c_double), intent(out), optional :: vector(3, n)
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      integer(c_int32_t), allocatable :: found(:)
      integer :: e
      character(len=*), parameter :: place = 'finshell_rotation_log'
      call start(place, n, present(vector) .and. present(quaternion), found, code, status)
      if (.not. allocated(found)) return
      call hold(environment)
      do e = 1, n
         vector(:, e) = 0
         found(e) = rotation(quaternion(:, e))
         if (found(e) == status_ok) vector(:, e) = quaternion_to_rotation_vector(unit(quaternion(:, e)))
      end do
      call release(environment)
      if (present(codes)) codes = found
      code = judge(status, place, n, found)
   end function logarithm

   function compose(n, a, b, c, codes, status) result(code) bind(c, name='finshell_rotation_compose')
      integer(c_int32_t), value :: n
      ! targets, since c may be a or b
      real(c_double), intent(in), optional, target :: a(4, n), b(4, n)
      real(c_double), intent(inout), optional, target :: c(4, n)
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      real(c_double) :: product(4)
      type(environment_t) :: environment
      integer(c_int32_t), allocatable :: found(:)
      integer :: e
      character(len=*), parameter :: place = 'finshell_rotation_compose'
      call start(place, n, present(a) .and. present(b) .and. present(c), found, code, status)
      if (.not. allocated(found)) return
      call hold(environment)
      do e = 1, n
         product = 0
         found(e) = min(rotation(a(:, e)), rotation(b(:, e)))
         if (found(e) == status_ok) product = quaternion_normalise(quaternion_product(unit(a(:, e)), unit(b(:, e))))
         c(:, e) = product
      end do
      call release(environment)
      if (present(codes)) codes = found
      code = judge(status, place, n, found)
   end function compose

   function update(n, spin, quaternion, codes, status) result(code) bind(c, name='finshell_rotation_update')
      integer(c_int32_t), value :: n
      real(c_double), intent(in), optional :: spin(3, n)
      real(c_double), intent(inout), optional :: quaternion(4, n)
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      integer(c_int32_t), allocatable :: found(:)
      integer :: e
      character(len=*), parameter :: place = 'finshell_rotation_update'
      call start(place, n, present(spin) .and. present(quaternion), found, code, status)
      if (.not. allocated(found)) return
      call hold(environment)
      do e = 1, n
         found(e) = min(finite(spin(:, e)), rotation(quaternion(:, e)))
         if (found(e) == status_ok) quaternion(:, e) = update_quaternion(unit(quaternion(:, e)), spin(:, e))
      end do
      call release(environment)
      if (present(codes)) codes = found
      code = judge(status, place, n, found)
   end function update

   function matrix(n, quaternion, r, codes, status) result(code) bind(c, name='finshell_rotation_matrix')
      integer(c_int32_t), value :: n
      real(c_double), intent(in), optional :: quaternion(4, n)
      real(c_double), intent(out), optional :: r(3, 3, n) !< by rows
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      integer(c_int32_t), allocatable :: found(:)
      integer :: e
      character(len=*), parameter :: place = 'finshell_rotation_matrix'
      call start(place, n, present(quaternion) .and. present(r), found, code, status)
      if (.not. allocated(found)) return
      call hold(environment)
      do e = 1, n
         r(:, :, e) = 0
         found(e) = rotation(quaternion(:, e))
         if (found(e) == status_ok) r(:, :, e) = transpose(quaternion_to_matrix(unit(quaternion(:, e))))
      end do
      call release(environment)
      if (present(codes)) codes = found
      code = judge(status, place, n, found)
   end function matrix

   function tangent(n, vector, t, codes, status) result(code) bind(c, name='finshell_rotation_tangent')
      integer(c_int32_t), value :: n
      real(c_double), intent(in), optional :: vector(3, n)
      real(c_double), intent(out), optional :: t(3, 3, n) !< by rows
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      integer(c_int32_t), allocatable :: found(:)
      integer :: e
      character(len=*), parameter :: place = 'finshell_rotation_tangent'
      call start(place, n, present(vector) .and. present(t), found, code, status)
      if (.not. allocated(found)) return
      call hold(environment)
      do e = 1, n
         t(:, :, e) = 0
         found(e) = finite(vector(:, e))
         if (found(e) == status_ok) t(:, :, e) = transpose(tangent_operator(vector(:, e)))
      end do
      call release(environment)
      if (present(codes)) codes = found
      code = judge(status, place, n, found)
   end function tangent

   !> Allocates `found` when there is something to do; otherwise code and status are final.
   subroutine start(place, n, complete, found, code, status)
      character(len=*), intent(in) :: place
      integer(c_int32_t), intent(in) :: n
      logical, intent(in) :: complete
      integer(c_int32_t), allocatable, intent(out) :: found(:)
      integer(c_int32_t), intent(out) :: code
      type(c_status_t), intent(out), optional :: status
      integer :: memory
      code = accept(status)
      if (n < 0) then
         code = refuse(status, place, 'n is #, expected a number >= 0', n)
      else if (n > 0 .and. .not. complete) then
         code = refuse(status, place, 'an array is NULL')
      else if (n > 0) then
         allocate (found(n), stat=memory)
         if (memory /= 0) code = refuse_memory(status, place)
      end if
   end subroutine start

   pure integer(c_int32_t) function finite(v)
      real(c_double), intent(in) :: v(3)
      finite = status_ok
      if (maxval(abs(v)) > longest_vector) finite = status_invalid_argument
      if (.not. sum(0*v) <= 0) finite = status_not_a_number
   end function finite

   !> Unit quaternion of one of any length: squares of the scaled one neither overflow nor vanish.
   pure function unit(q) result(p)
      real(c_double), intent(in) :: q(4)
      real(c_double) :: p(4)
      p = quaternion_normalise(scale(q, -exponent(maxval(abs(q)))))
   end function unit

   !> A quaternion that is a rotation: finite, not zero.
   pure integer(c_int32_t) function rotation(q)
      real(c_double), intent(in) :: q(4)
      rotation = status_ok
      if (.not. sum(0*q) <= 0) then
         rotation = status_not_a_number
      else if (maxval(abs(q)) <= 0) then
         rotation = status_invalid_argument
      end if
   end function rotation
end module finshell_capi_rotation
