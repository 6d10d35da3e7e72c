!> GMRES with the approximate factors of a matrix (compressed ones, or of single precision) as preconditioner (Saad & Schultz 1986;
!> in its flexible form, Saad 1993, as such factors solve with rounding errors of their own). It finds the least residual over all
!> corrections so far, whether the matrix is definite or not, symmetric or not.
module finshell_gmres
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use finshell_error, only: error_t
   use finshell_kinds, only: dp
   implicit none
   private
   public :: enough, factored_t, gmres, krylov_t

   integer, parameter :: most_vectors = 40 !< of a cycle: memory is taken as they come
   real(dp), parameter :: enough = 1e-14_dp !< relative residual beyond which there is nothing to gain

   !> The vectors of a cycle. With S the scale: A z = S v h, where z solves M z = S v(:, :used), and M is the matrix that the
   !> factors give.
   type :: krylov_t
      integer :: used = 0
      logical :: converged = .false.
      real(dp), allocatable :: v(:, :) !< (n, used + 1) orthonormal
      real(dp), allocatable :: z(:, :) !< (n, used)
      real(dp), allocatable :: h(:, :) !< (used + 1, used)
   end type krylov_t

   !> A matrix with factors, exact or not.
   type, abstract :: factored_t
   contains
      procedure(multiply_interface), deferred :: multiply
      procedure(backend_interface), deferred :: backend
   end type factored_t

   abstract interface
      !> y = A x, and y_abs = |A| |x|.
      subroutine multiply_interface(self, x, y, y_abs)
         import :: factored_t, dp
         class(factored_t), intent(in) :: self
         real(dp), intent(in) :: x(:) !< (n)
         real(dp), intent(out), contiguous :: y(:) !< (n)
         real(dp), intent(out), contiguous :: y_abs(:) !< (n)
      end subroutine multiply_interface

      !> Solve with the factors.
      subroutine backend_interface(self, b, x, error)
         import :: factored_t, dp, error_t
         class(factored_t), intent(inout) :: self
         real(dp), intent(in), contiguous :: b(:, :) !< (n, right-hand sides)
         real(dp), intent(inout), contiguous :: x(:, :) !< (n, right-hand sides)
         type(error_t), allocatable, intent(out) :: error
      end subroutine backend_interface
   end interface

contains

   !> The correction dx for which |r - A dx| is least.
   subroutine gmres(matrix, scale, goal, r, dx, space, error)
      class(factored_t), intent(inout) :: matrix
      real(dp), intent(in) :: scale(:) !< (n)
      real(dp), intent(in) :: goal !< norm of the scaled residual at which to end
      real(dp), intent(in) :: r(:) !< (n)
      real(dp), intent(out) :: dx(:) !< (n)
      type(krylov_t), intent(out) :: space
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: h(most_vectors + 1, most_vectors), c(most_vectors), s(most_vectors), g(most_vectors + 1), t
      real(dp), allocatable :: w(:), unused(:)
      integer :: i, j, n, pass

      n = size(r)
      dx = 0
      allocate (space%v(n, most_vectors + 1), space%z(n, most_vectors), w(n), unused(n))
      allocate (space%h(most_vectors + 1, most_vectors), source=0.0_dp)
      g = 0
      g(1) = norm2(r/scale)
      if (.not. g(1) > 0) return
      associate (v => space%v, z => space%z)
         v(:, 1) = r/scale/g(1)
         do j = 1, most_vectors
            call matrix%backend(reshape(v(:, j)*scale, [n, 1]), z(:, j:j), error)
            if (allocated(error)) return
            call matrix%multiply(z(:, j), w, unused)
            w = w/scale
            if (.not. all(ieee_is_finite(w))) exit
            do pass = 1, 2 ! twice is enough
               do i = 1, j
                  t = dot_product(v(:, i), w)
                  space%h(i, j) = space%h(i, j) + t
                  w = w - t*v(:, i)
               end do
            end do
            space%h(j + 1, j) = norm2(w)
            if (space%h(j + 1, j) > 0) v(:, j + 1) = w/space%h(j + 1, j)
            h(:, j) = space%h(:, j)
            do i = 1, j - 1
               t = c(i)*h(i, j) + s(i)*h(i + 1, j)
               h(i + 1, j) = c(i)*h(i + 1, j) - s(i)*h(i, j)
               h(i, j) = t
            end do
            t = hypot(h(j, j), h(j + 1, j))
            if (.not. t > 0) exit
            c(j) = h(j, j)/t
            s(j) = h(j + 1, j)/t
            h(j, j) = t
            g(j + 1) = -s(j)*g(j)
            g(j) = c(j)*g(j)
            space%used = j
            space%converged = abs(g(j + 1)) <= goal
            if (space%converged .or. .not. space%h(j + 1, j) > 0) exit
         end do
         do i = space%used, 1, -1
            g(i) = (g(i) - dot_product(h(i, i + 1:space%used), g(i + 1:space%used)))/h(i, i)
            dx = dx + g(i)*z(:, i)
         end do
      end associate
   end subroutine gmres
end module finshell_gmres
