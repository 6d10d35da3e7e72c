!> A rotation between those of three nodes, as a function of them: R = R1 exp(p), p = sum of weight(i) log(R1^T Ri).
!>
!> It turns with the three (objective), and is their rotation where they are the same. Its spin is
!>
!>     w = w1 + R1 T(p) sum of weight(i) T(pi)^-1 R1^T (wi - w1),   pi = log(R1^T Ri),
!>
!> T of finshell_rotation. (Crisfield and Jelenic 1999, whose interpolation has the same two properties.)
module finshell_interpolated_rotation
   use finshell_kinds, only: wp
   use finshell_quaternion, only: quaternion_conjugate, quaternion_product, quaternion_to_matrix, quaternion_to_rotation_vector, &
      rotation_vector_to_quaternion
   use finshell_rotation, only: inverse_tangent_operator, tangent_operator
   implicit none
   private
   public :: interpolated, spin_operators, second_spins, n_spins

   integer, parameter :: n_spins = 3*3 !< of three nodes

contains

   !> Quaternion of the rotation.
   pure function interpolated(weight, q) result(r)
      real(wp), intent(in) :: weight(3)
      real(wp), intent(in) :: q(4, 3) !< quaternions of the three
      real(wp) :: r(4)
      real(wp) :: p(3)
      integer :: i
      p = 0
      do i = 2, 3
         p = p + weight(i)*quaternion_to_rotation_vector(quaternion_product(quaternion_conjugate(q(:, 1)), q(:, i)))
      end do
      r = quaternion_product(q(:, 1), rotation_vector_to_quaternion(p))
   end function interpolated

   !> B: its spin is the sum of B(:, :, i) wi.
   pure function spin_operators(weight, q) result(b)
      real(wp), intent(in) :: weight(3), q(4, 3)
      real(wp) :: b(3, 3, 3)
      real(wp) :: first(3, 3), p(3), each(3, 2:3)
      integer :: i
      first = quaternion_to_matrix(q(:, 1))
      p = 0
      do i = 2, 3
         each(:, i) = quaternion_to_rotation_vector(quaternion_product(quaternion_conjugate(q(:, 1)), q(:, i)))
         p = p + weight(i)*each(:, i)
      end do
      b = 0
      do i = 1, 3
         b(i, i, 1) = 1
      end do
      do i = 2, 3
         b(:, :, i) = weight(i)*matmul(matmul(first, matmul(tangent_operator(p), inverse_tangent_operator(each(:, i)))), &
                                       transpose(first))
         b(:, :, 1) = b(:, :, 1) - b(:, :, i)
      end do
   end function spin_operators

   !> Second derivatives of m . log(R(exp(w) q) R(q)^T) with respect to the nine spins w at 0, by fourth-order differences: their
   !> error of 1e-9 is one of the tangent, not of what it converges to.
   pure function second_spins(weight, q, m) result(h)
      real(wp), intent(in) :: weight(3), q(4, 3)
      real(wp), intent(in) :: m(3) !< moment
      real(wp) :: h(n_spins, n_spins)
      real(wp), parameter :: step = 2.0e-3_wp
      real(wp) :: back(4), at(-2:2), mixed
      integer :: i, j, s
      back = quaternion_conjugate(interpolated(weight, q))
      do j = 1, n_spins
         do i = 1, j
            do s = -2, 2
               at(s) = along(i, s*step, j, s*step)
            end do
            ! along a diagonal of the plane (i, j); on the axes themselves the two steps add up
            h(i, j) = second(at)
         end do
      end do
      do j = 1, n_spins
         h(j, j) = 0.25_wp*h(j, j)
      end do
      do j = 1, n_spins
         do i = 1, j - 1
            mixed = 0.5_wp*(h(i, j) - h(i, i) - h(j, j))
            h(i, j) = mixed
            h(j, i) = mixed
         end do
      end do

   contains

      pure real(wp) function second(f)
         real(wp), intent(in) :: f(-2:2)
         second = (-f(-2) + 16*f(-1) - 30*f(0) + 16*f(1) - f(2))/(12*step**2)
      end function second

      pure real(wp) function along(a, da, b, db)
         integer, intent(in) :: a, b
         real(wp), intent(in) :: da, db
         real(wp) :: w(n_spins), turned(4, 3)
         integer :: n
         w = 0
         w(a) = da
         w(b) = w(b) + db
         do n = 1, 3
            turned(:, n) = quaternion_product(rotation_vector_to_quaternion(w(3*n - 2:3*n)), q(:, n))
         end do
         along = dot_product(m, quaternion_to_rotation_vector(quaternion_product(interpolated(weight, turned), back)))
      end function along
   end function second_spins
end module finshell_interpolated_rotation
