!> What the tests of the element share: reproducible random states, sections, eigenvalues, one-element calls.
module support_element
   use, intrinsic :: iso_fortran_env, only: int64, real64
   use finshell_batch, only: evaluate_elements, rotation_quaternion, rotation_vector
   use finshell_error, only: error_t
   use finshell_kinds, only: wp, i4, strip
   use finshell_evaluation, only: level_tangent
   use finshell_material, only: material_t
   use finshell_quaternion, only: quaternion_product, rotation_vector_to_quaternion
   use finshell_registry, only: material_parameters, new_material, parameter_t
   use finshell_rotation, only: exp_rotation
   use finshell_section, only: section_t, new_section
   implicit none
   private
   public :: uniform, uniform_array, section_of, has_regular_reference, random_triangle, random_state, turn, eigenvalues
   public :: one_element, as_real64, quaternions_of

contains

   !> Next number in [-1, 1] of the minimal standard generator (Park & Miller 1988): the same everywhere.
   function uniform(seed) result(x)
      integer(int64), intent(inout) :: seed
      real(wp) :: x
      seed = mod(16807_int64*seed, 2147483647_int64)
      x = 2*real(seed, wp)/2147483647.0_wp - 1
   end function uniform

   subroutine uniform_array(seed, x)
      integer(int64), intent(inout) :: seed
      real(wp), intent(out) :: x(:, :)
      integer :: i, j
      do j = 1, size(x, 2)
         do i = 1, size(x, 1)
            x(i, j) = uniform(seed)
         end do
      end do
   end subroutine uniform_array

   !> Section of a registered law with the example parameters of the registry.
   subroutine section_of(name, thickness, formulation, section, points, beta0)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: thickness
      integer, intent(in) :: formulation
      type(section_t), intent(out) :: section
      integer, intent(in), optional :: points
      real(wp), intent(in), optional :: beta0
      class(material_t), allocatable :: law
      type(error_t), allocatable :: error
      type(parameter_t), allocatable :: parameters(:)
      character(len=16), allocatable :: names(:)
      real(wp), allocatable :: values(:)
      integer :: n
      real(wp) :: b
      n = 3
      if (present(points)) n = points
      b = 0.01_wp
      if (present(beta0)) b = beta0
      parameters = material_parameters(name)
      allocate (names(size(parameters)), values(size(parameters)))
      names = parameters%name
      values = parameters%example
      call new_material(law, name, names, values, error)
      if (allocated(error)) error stop 'support_element: the example parameters of a law are refused'
      call new_section(section, law, thickness, error, formulation=formulation, thickness_points=n, beta0=b)
      if (allocated(error)) error stop 'support_element: section refused'
   end subroutine section_of

   !> Whether the law of the section is stress-free at the reference with a tangent that is positive definite and continuous there
   !> (fibres that act in tension only have none).
   function has_regular_reference(section) result(regular)
      type(section_t), intent(in) :: section
      logical :: regular
      real(wp), parameter :: small = 1.0e-9_wp
      real(wp) :: e(strip, 3), w(strip), s(strip, 3), d(strip, 6), a(3, 3), l(3)
      integer(i4) :: status(strip)
      integer :: i
      e = 0
      do i = 1, 3
         e(2*i, i) = small
         e(2*i + 1, i) = -small
      end do
      status = 0
      call section%layers(1)%law%plane_stress(strip, level_tangent, e, w, s, d, status)
      regular = all(status == 0) .and. .not. abs(w(1)) > 0 .and. .not. maxval(abs(s(1, :))) > 0
      if (.not. regular) return
      a(:, 1) = [d(1, 1), d(1, 4), d(1, 5)]
      a(:, 2) = [d(1, 4), d(1, 2), d(1, 6)]
      a(:, 3) = [d(1, 5), d(1, 6), d(1, 3)]
      l = eigenvalues(a)
      regular = minval(l) > 1.0e-6_wp*maxval(l) .and. maxval(abs(d - spread(d(1, :), 1, strip))) < 1.0e-5_wp*maxval(abs(d))
   end function has_regular_reference

   !> A triangle in space, sides of about 1, not too flat.
   subroutine random_triangle(seed, x)
      integer(int64), intent(inout) :: seed
      real(wp), intent(out) :: x(3, 3)
      real(wp) :: shift(3, 3), r(3, 3)
      call uniform_array(seed, shift)
      x(:, 1) = [0.0_wp, 0.0_wp, 0.0_wp]
      x(:, 2) = [1.0_wp, 0.1_wp, 0.0_wp]
      x(:, 3) = [0.3_wp, 0.9_wp, 0.0_wp]
      x = x + 0.2_wp*shift
      call uniform_array(seed, shift)
      r = exp_rotation(2*shift(:, 1))
      x = matmul(r, x)
   end subroutine random_triangle

   !> A state: homogeneous stretch about (l1, l2) in random directions, distorted by `amount`, nodal rotations that differ from the
   !> element's by about `amount`, a large rigid rotation on top. Rotations as vectors.
   subroutine random_state(seed, x, l1, l2, amount, u, theta)
      integer(int64), intent(inout) :: seed
      real(wp), intent(in) :: x(3, 3), l1, l2, amount
      real(wp), intent(out) :: u(3, 3), theta(3, 3)
      real(wp) :: a(3, 3), b(3, 3), e(3, 3), p(3, 3), q(4), w(3), angle
      integer :: i
      call uniform_array(seed, a)
      call uniform_array(seed, b)
      ! in-plane axes of the triangle, turned by a random angle
      e(:, 1) = (x(:, 2) - x(:, 1))/norm2(x(:, 2) - x(:, 1))
      e(:, 3) = cross(e(:, 1), x(:, 3) - x(:, 1))
      e(:, 3) = e(:, 3)/norm2(e(:, 3))
      e(:, 2) = cross(e(:, 3), e(:, 1))
      angle = 3*uniform(seed)
      w = cos(angle)*e(:, 1) + sin(angle)*e(:, 2)
      e(:, 2) = cross(e(:, 3), w)
      e(:, 1) = w
      do i = 1, 3
         w = x(:, i) - x(:, 1)
         p(:, i) = l1*dot_product(w, e(:, 1))*e(:, 1) + l2*dot_product(w, e(:, 2))*e(:, 2)
      end do
      p = p + 0.1_wp*amount*min(l1, l2)*a
      w = [uniform(seed), uniform(seed), uniform(seed)]
      w = 1.7_wp*w
      p = matmul(exp_rotation(w), p)
      u = p - x
      do i = 1, 3
         q = quaternion_product(rotation_vector_to_quaternion(amount*b(:, i)), rotation_vector_to_quaternion(w))
         theta(:, i) = log_of(q)
      end do
   contains
      pure function cross(s, t) result(c)
         real(wp), intent(in) :: s(3), t(3)
         real(wp) :: c(3)
         c = [s(2)*t(3) - s(3)*t(2), s(3)*t(1) - s(1)*t(3), s(1)*t(2) - s(2)*t(1)]
      end function cross
      pure function log_of(r) result(v)
         real(wp), intent(in) :: r(4)
         real(wp) :: v(3), s
         s = norm2(r(2:4))
         v = 2*atan2(s, r(1))/s*r(2:4)
      end function log_of
   end subroutine random_state

   !> Quaternions of nodal rotation vectors.
   function quaternions_of(theta) result(q)
      real(wp), intent(in) :: theta(3, 3)
      real(wp) :: q(4, 3)
      integer :: i
      do i = 1, 3
         q(:, i) = rotation_vector_to_quaternion(theta(:, i))
      end do
   end function quaternions_of

   !> Every node turned rigidly: positions about the origin, then the rotations.
   subroutine turn(w, x, u, q)
      real(wp), intent(in) :: w(3), x(3, 3)
      real(wp), intent(inout) :: u(3, 3), q(4, 3)
      integer :: i
      u = matmul(exp_rotation(w), x + u) - x
      do i = 1, 3
         q(:, i) = quaternion_product(rotation_vector_to_quaternion(w), q(:, i))
      end do
   end subroutine turn

   !> Energy, force and tangent of one element; rotation is (3, 3) or (4, 3).
   subroutine one_element(section, x, u, rotation, energy, force, tangent, status, held)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: x(3, 3), u(3, 3), rotation(:, :)
      real(wp), intent(out) :: energy, force(18), tangent(18, 18)
      integer(i4), intent(out) :: status
      integer, intent(in), optional :: held(3, 1)
      real(wp) :: e(1), f(18, 1), k(18, 18, 1)
      integer(i4) :: s(1)
      call evaluate_elements(section, 1, reshape(x, [3, 3, 1]), reshape(u, [3, 3, 1]), &
                             reshape(rotation, [size(rotation, 1), 3, 1]), &
                             merge(rotation_quaternion, rotation_vector, size(rotation, 1) == 4), s, e, f, k, held=held)
      energy = e(1)
      force = f(:, 1)
      tangent = k(:, :, 1)
      status = s(1)
   end subroutine one_element

   !> Eigenvalues of a symmetric matrix, ascending (cyclic Jacobi).
   function eigenvalues(matrix) result(values)
      real(wp), intent(in) :: matrix(:, :)
      real(wp) :: values(size(matrix, 1))
      real(wp) :: a(size(matrix, 1), size(matrix, 1)), c, s, t, z, p(size(matrix, 1))
      integer :: i, j, n, sweep
      a = matrix
      n = size(a, 1)
      do sweep = 1, 60
         z = 0
         do j = 2, n
            do i = 1, j - 1
               z = max(z, abs(a(i, j)))
            end do
         end do
         if (z <= tiny(z)/epsilon(z)) exit
         do j = 2, n
            do i = 1, j - 1
               if (abs(a(i, j)) <= 1.0e-100_wp*abs(a(j, j) - a(i, i))) then ! nothing to turn, and the quotient might overflow
                  a(i, j) = 0
                  a(j, i) = 0
               end if
               if (abs(a(i, j)) <= tiny(z)/epsilon(z)) cycle
               z = (a(j, j) - a(i, i))/(2*a(i, j))
               if (abs(z) > 1.0e15_wp) then
                  t = 0.5_wp/z
               else
                  t = sign(1.0_wp, z)/(abs(z) + sqrt(1 + z*z))
               end if
               c = 1/sqrt(1 + t*t)
               s = t*c
               p = a(:, i)
               a(:, i) = c*p - s*a(:, j)
               a(:, j) = s*p + c*a(:, j)
               p = a(i, :)
               a(i, :) = c*p - s*a(j, :)
               a(j, :) = s*p + c*a(j, :)
               a(i, j) = 0
               a(j, i) = 0
            end do
         end do
      end do
      do i = 1, n
         values(i) = a(i, i)
      end do
      do i = 2, n
         z = values(i)
         do j = i - 1, 1, -1
            if (values(j) <= z) exit
            values(j + 1) = values(j)
         end do
         values(j + 1) = z
      end do
   end function eigenvalues

   !> For assertions, which compare 64-bit reals.
   elemental function as_real64(x) result(y)
      real(wp), intent(in) :: x
      real(real64) :: y
      y = real(x, real64)
   end function as_real64
end module support_element
