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

   integer, parameter :: of_exp = 1, of_log = 2, of_product = 3, of_update = 4, of_matrix = 5, of_tangent = 6

contains

   function exponential(n, vector, quaternion, codes, status) result(code) bind(c, name='finshell_rotation_exp')
      integer(c_int32_t), value :: n
      real(c_double), intent(in), optional :: vector(3, n)
      real(c_double), intent(out), optional :: quaternion(4, n)
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      code = each('finshell_rotation_exp', n, of_exp, 3, vector, 3, vector, 4, quaternion, codes, status)
   end function exponential

   function logarithm(n, quaternion, vector, codes, status) result(code) bind(c, name='finshell_rotation_log')
      integer(c_int32_t), value :: n
      real(c_double), intent(in), optional :: quaternion(4, n)
      real(c_double), intent(out), optional :: vector(3, n)
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      code = each('finshell_rotation_log', n, of_log, 4, quaternion, 4, quaternion, 3, vector, codes, status)
   end function logarithm

   function compose(n, a, b, c, codes, status) result(code) bind(c, name='finshell_rotation_compose')
      integer(c_int32_t), value :: n
      ! targets, since c may be a or b
      real(c_double), intent(in), optional, target :: a(4, n), b(4, n)
      real(c_double), intent(inout), optional, target :: c(4, n)
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      code = each('finshell_rotation_compose', n, of_product, 4, a, 4, b, 4, c, codes, status)
   end function compose

   function update(n, spin, quaternion, codes, status) result(code) bind(c, name='finshell_rotation_update')
      integer(c_int32_t), value :: n
      real(c_double), intent(in), optional :: spin(3, n)
      real(c_double), intent(inout), optional, target :: quaternion(4, n)
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      code = each('finshell_rotation_update', n, of_update, 3, spin, 4, quaternion, 4, quaternion, codes, status)
   end function update

   function matrix(n, quaternion, r, codes, status) result(code) bind(c, name='finshell_rotation_matrix')
      integer(c_int32_t), value :: n
      real(c_double), intent(in), optional :: quaternion(4, n)
      real(c_double), intent(out), optional :: r(3, 3, n) !< by rows
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      code = each('finshell_rotation_matrix', n, of_matrix, 4, quaternion, 4, quaternion, 9, r, codes, status)
   end function matrix

   function tangent(n, vector, t, codes, status) result(code) bind(c, name='finshell_rotation_tangent')
      integer(c_int32_t), value :: n
      real(c_double), intent(in), optional :: vector(3, n)
      real(c_double), intent(out), optional :: t(3, 3, n) !< by rows
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      code = each('finshell_rotation_tangent', n, of_tangent, 3, vector, 3, vector, 9, t, codes, status)
   end function tangent

   !> The frame of all functions: an operation on each pair of columns, codes, status. The result may be one of the arguments. Where
   !> there is none it is zero, or what it was before an update.
   function each(place, n, operation, na, a, nb, b, nr, made, codes, status) result(code)
      character(len=*), intent(in) :: place
      integer(c_int32_t), intent(in) :: n, na, nb, nr
      integer, intent(in) :: operation
      real(c_double), intent(in), optional, target :: a(na, n), b(nb, n)
      real(c_double), intent(inout), optional, target :: made(nr, n)
      integer(c_int32_t), intent(out), optional :: codes(n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      integer(c_int32_t), allocatable :: found(:)
      real(c_double) :: one(nr)
      integer :: e, memory
      code = accept(status)
      if (n < 0) then
         code = refuse(status, place, 'n is #, expected a number >= 0', n)
      else if (n > 0 .and. .not. (present(a) .and. present(b) .and. present(made))) then
         code = refuse(status, place, 'an array is NULL')
      else if (n > 0) then
         allocate (found(n), stat=memory)
         if (memory /= 0) code = refuse_memory(status, place)
      end if
      if (.not. allocated(found)) return
      call hold(environment)
      do e = 1, n
         one = 0
         if (operation == of_update) one = made(:, e)
         call operate(operation, a(:, e), b(:, e), one, found(e))
         made(:, e) = one
      end do
      call release(environment)
      if (present(codes)) codes = found
      code = judge(status, place, n, found)
   end function each

   !> One column of the result; what is wrong with a or b, and then the result is left as it is.
   pure subroutine operate(operation, a, b, made, found)
      integer, intent(in) :: operation
      real(c_double), intent(in) :: a(*), b(*)
      real(c_double), intent(inout) :: made(*)
      integer(c_int32_t), intent(out) :: found
      select case (operation)
      case (of_exp, of_tangent); found = finite(a(:3))
      case (of_log, of_matrix); found = rotation(a(:4))
      case (of_update); found = min(finite(a(:3)), rotation(b(:4)))
      case default; found = min(rotation(a(:4)), rotation(b(:4)))
      end select
      if (found /= status_ok) return
      select case (operation)
      case (of_exp); made(:4) = rotation_vector_to_quaternion(a(:3))
      case (of_tangent); made(:9) = reshape(transpose(tangent_operator(a(:3))), [9])
      case (of_log); made(:3) = quaternion_to_rotation_vector(unit(a(:4)))
      case (of_matrix); made(:9) = reshape(transpose(quaternion_to_matrix(unit(a(:4)))), [9])
      case (of_update); made(:4) = update_quaternion(unit(b(:4)), a(:3))
      case (of_product); made(:4) = quaternion_normalise(quaternion_product(unit(a(:4)), unit(b(:4))))
      end select
   end subroutine operate

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
