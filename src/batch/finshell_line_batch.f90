!> Dead line loads on sides of many elements, in the unknowns of the element: half to each end, and what the load does on the bulge
!> of the side (finshell_line_load).
module finshell_line_batch
   use finshell_element, only: rotation_increment, rotation_quaternion
   use finshell_environment, only: environment_t, hold, release
   use finshell_freedoms, only: n_corners, n_nodal, n_shell, rx, rz, shell_at, ux, uz
   use finshell_kinds, only: wp, i4
   use finshell_line_load, only: bulge_load
   use finshell_quaternion, only: quaternion_normalise, quaternion_product, quaternion_to_matrix, rotation_vector_to_quaternion
   use finshell_rotation, only: cross_product, spin, tangent_operator, tangent_transpose_derivative
   use finshell_status, only: status_collapsed_element, status_invalid_argument, status_large_rotation, status_not_a_number, &
      status_ok
   use finshell_triangle, only: judge_triangles
   implicit none
   private
   public :: line_loads

   real(wp), parameter :: longest = 1.0e60_wp !< of a rotation vector something is left of the angle

contains

   !> External forces of dead loads on n sides, and their stiffness. A side that fails gets its status and zeros.
   subroutine line_loads(n, side, load, bulges, x, u, rotation, convention, status, force, stiffness, state)
      integer, intent(in) :: n !< one side each, of an element
      integer, intent(in) :: side(n) !< from node `side` to the next one
      real(wp), intent(in) :: load(3, n) !< force per reference length
      logical, intent(in) :: bulges(n) !< not the sides that supports keep straight, nor those of membranes
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), rotation(:, :, :) !< as in evaluate_elements (finshell_batch)
      integer, intent(in) :: convention
      integer(i4), intent(out) :: status(n)
      real(wp), intent(out) :: force(n_shell, n)
      real(wp), intent(out), optional :: stiffness(n_shell, n_shell, n) !< d force(i) / d unknown(j)
      real(wp), intent(in), optional :: state(4, 3, n) !< rotation_increment needs it
      type(environment_t) :: environment
      real(wp) :: length, k(n_shell, n_shell), total
      integer :: e, i
      call hold(environment)
      do e = 1, n
         force(:, e) = 0
         if (present(stiffness)) stiffness(:, :, e) = 0
         call check(x(:, :, e), u(:, :, e), load(:, e), status(e))
         if (status(e) /= status_ok) cycle
         length = norm2(x(:, 1 + mod(side(e), n_corners), e) - x(:, side(e), e))
         do i = 0, 1
            associate (at => shell_at(1 + mod(side(e) + i - 1, n_corners)))
               force(at + ux:at + uz, e) = 0.5_wp*length*load(:, e)
            end associate
         end do
         if (bulges(e)) then
            if (present(state)) then
               call add_bulge(e, state(:, :, e))
            else
               call add_bulge(e)
            end if
         end if
         total = sum(0*force(:, e))
         if (present(stiffness)) then
            do i = 1, n_shell
               total = total + sum(0*stiffness(:, i, e))
            end do
         end if
         if (.not. total <= 0 .and. status(e) == status_ok) status(e) = status_collapsed_element
         if (status(e) == status_ok) cycle
         force(:, e) = 0
         if (present(stiffness)) stiffness(:, :, e) = 0
      end do
      call release(environment)

   contains

      subroutine add_bulge(e, origin)
         integer, intent(in) :: e
         real(wp), intent(in), optional :: origin(4, 3)
         real(wp) :: position(3, 3), turned(3, 2), f(n_shell), direction(3), q(4, 2)
         integer :: corner(3), place(n_shell), c, j
         corner = [(1 + mod(side(e) + j - 2, n_corners), j=1, 3)]
         do j = 1, n_corners
            position(:, j) = x(:, corner(j), e) + u(:, corner(j), e)
            place(shell_at(j) + 1:shell_at(j) + n_nodal) = [(shell_at(corner(j)) + c, c=1, n_nodal)]
         end do
         direction = (x(:, corner(2), e) - x(:, corner(1), e))/length
         do j = 1, 2
            call turn(rotation(:, corner(j), e), origin, corner(j), q(:, j), status(e))
            if (status(e) /= status_ok) return
            turned(:, j) = matmul(quaternion_to_matrix(q(:, j)), direction)
         end do
         if (present(stiffness)) then
            call bulge_load(length, load(:, e), position, turned, f, k)
         else
            call bulge_load(length, load(:, e), position, turned, f)
         end if
         if (convention /= rotation_quaternion) then
            do j = 1, 2
               call to_vector(rotation(1:3, corner(j), e), shell_at(j), f)
            end do
         end if
         force(place, e) = force(place, e) + f
         if (present(stiffness)) stiffness(place, place, e) = k
      end subroutine add_bulge

      !> From spins to a rotation vector at the node whose freedoms follow `at`.
      subroutine to_vector(theta, at, f)
         real(wp), intent(in) :: theta(3)
         integer, intent(in) :: at
         real(wp), intent(inout) :: f(n_shell)
         real(wp) :: t(3, 3), moment(3)
         t = tangent_operator(theta)
         moment = f(at + rx:at + rz)
         f(at + rx:at + rz) = matmul(moment, t)
         if (.not. present(stiffness)) return
         ! the moment turns with the spins, which the symmetric stiffness leaves out
         k(at + rx:at + rz, at + rx:at + rz) = k(at + rx:at + rz, at + rx:at + rz) - 0.5_wp*spin(moment)
         k(:, at + rx:at + rz) = matmul(k(:, at + rx:at + rz), t)
         k(at + rx:at + rz, :) = matmul(transpose(t), k(at + rx:at + rz, :))
         k(at + rx:at + rz, at + rx:at + rz) = k(at + rx:at + rz, at + rx:at + rz) + tangent_transpose_derivative(theta, moment)
      end subroutine to_vector

      subroutine turn(given, origin, corner, q, found)
         real(wp), intent(in) :: given(:)
         real(wp), intent(in), optional :: origin(4, 3)
         integer, intent(in) :: corner
         real(wp), intent(out) :: q(4)
         integer(i4), intent(inout) :: found
         real(wp) :: from(4)
         q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
         from = q
         if (present(origin) .and. convention == rotation_increment) from = origin(:, corner)
         if (.not. sum(0*given) + sum(0*from) <= 0) then
            found = status_not_a_number
         else if (convention == rotation_quaternion) then
            if (maxval(abs(given)) > 0) then
               q = quaternion_normalise(scale(given, -exponent(maxval(abs(given)))))
            else
               found = status_invalid_argument
            end if
         else if (maxval(abs(given)) > longest) then
            found = status_large_rotation
         else if (maxval(abs(from)) > 0) then
            q = quaternion_product(rotation_vector_to_quaternion(given), &
                                   quaternion_normalise(scale(from, -exponent(maxval(abs(from))))))
         else
            found = status_invalid_argument
         end if
      end subroutine turn
   end subroutine line_loads

   pure subroutine check(x, u, load, status)
      real(wp), intent(in) :: x(3, 3), u(3, 3), load(3)
      integer(i4), intent(out) :: status
      real(wp) :: a(3), b(3)
      integer(i4) :: found(1)
      found = status_ok
      if (.not. sum(0*x) + sum(0*u) + sum(0*load) <= 0) then
         found = status_not_a_number
      else
         a = x(:, 2) - x(:, 1)
         b = x(:, 3) - x(:, 1)
         call judge_triangles(1, [norm2(cross_product(a, b))], [max(sum(a*a), sum(b*b), sum((b - a)**2))], found)
      end if
      status = found(1)
   end subroutine check
end module finshell_line_batch
