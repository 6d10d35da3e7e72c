!> What factors do not say about their matrix: whether it is singular and, if they are approximate, how many eigenvalues are
!> negative.
!>
!> Exact factors: a vector that the matrix takes to nothing is found by inverse iteration.
!>
!> Approximate factors are those of a matrix M next to A, whose smallest eigenvalues may have other signs. On the way M + t (A - M)
!> an eigenvalue passes zero for each negative eigenvalue lambda of A x = lambda M x, upwards where x A x is positive. Those
!> eigenvalues stand apart from all others, which are next to one, so that GMRES finds them before it converges for a right-hand
!> side without pattern; what it converges to is a step of inverse iteration. With a residual above rounding level, or where many
!> vectors were needed because M z = v is solved to too few digits, eigenvalues were missed in tests: then nothing is said.
module finshell_inspection
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use finshell_error, only: error_t
   use finshell_gmres, only: enough, factored_t, gmres, krylov_t
   use finshell_kinds, only: dp
   implicit none
   private
   public :: finding_t, examine, inspect

   integer, parameter :: most_inverse_iterations = 30
   integer, parameter :: most_vectors_to_trust = 24 !< wrong counts were seen from 37 on

   type :: finding_t
      integer :: singular_equation = 0 !< where the null vector is largest; 0: not singular
      real(dp), allocatable :: null_vector(:) !< largest component (scaled) = 1; allocated if singular and finite
      logical :: known = .true. !< what follows is
      integer :: more_negative = 0 !< eigenvalues of the symmetric matrix than of the factors, or fewer (-)
      integer :: passed = 0 !< eigenvalues whose sign differs
   end type finding_t

   interface
      subroutine dgeev(jobvl, jobvr, n, a, lda, wr, wi, vl, ldvl, vr, ldvr, work, lwork, info)
         import :: dp
         character(len=1), intent(in) :: jobvl, jobvr
         integer, intent(in) :: n, lda, ldvl, ldvr, lwork
         real(dp), intent(inout) :: a(lda, *)
         real(dp), intent(out) :: wr(*), wi(*), vl(ldvl, *), vr(ldvr, *), work(*)
         integer, intent(out) :: info
      end subroutine dgeev
   end interface

contains

   !> With exact factors, by inverse iteration: once is enough, unless they are those of a shifted matrix. Errors: those of the
   !> factors.
   subroutine examine(matrix, scale, tolerance, finding, error)
      class(factored_t), intent(inout) :: matrix
      real(dp), intent(in) :: scale(:) !< (n) measure of the equations
      real(dp), intent(in) :: tolerance !< singular is what takes a vector to so little of its length
      type(finding_t), intent(out) :: finding
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: b(:, :), v(:, :)
      real(dp) :: reduction, previous
      integer :: k

      allocate (b(size(scale), 1), v(size(scale), 1))
      b(:, 1) = numbers_without_pattern(size(scale))*scale
      previous = 1
      do k = 1, most_inverse_iterations
         call matrix%backend(b, v, error)
         if (allocated(error)) return
         call try_null_vector(matrix, scale, tolerance, v(:, 1), finding, reduction)
         if (finding%singular_equation > 0 .or. reduction > 0.1_dp*previous) return
         previous = reduction
         b(:, 1) = v(:, 1)*scale**2
      end do
   end subroutine examine

   !> With approximate factors. Errors: those of the factors.
   subroutine inspect(matrix, scale, tolerance, finding, error)
      class(factored_t), intent(inout) :: matrix
      real(dp), intent(in) :: scale(:) !< (n) measure of the equations
      real(dp), intent(in) :: tolerance !< singular is what takes a vector to so little of its length
      type(finding_t), intent(out) :: finding
      type(error_t), allocatable, intent(out) :: error
      type(krylov_t) :: space, again
      real(dp), allocatable :: h(:, :), real_part(:), imaginary_part(:), vectors(:, :), work(:), b(:), x(:), mx(:)
      real(dp) :: unused(1, 1), reduction
      integer :: i, info, m

      allocate (x(size(scale)))
      b = numbers_without_pattern(size(scale))*scale
      call gmres(matrix, scale, enough*norm2(b/scale), b, x, space, error)
      m = space%used
      finding%known = space%converged .and. m <= most_vectors_to_trust
      if (allocated(error) .or. m == 0) return
      call try_null_vector(matrix, scale, tolerance, x, finding, reduction)
      if (finding%singular_equation == 0 .and. reduction < 100*tolerance) then
         b = x*scale**2
         call gmres(matrix, scale, enough*norm2(b/scale), b, x, again, error)
         if (allocated(error)) return
         call try_null_vector(matrix, scale, tolerance, x, finding, reduction)
      end if
      if (finding%singular_equation > 0 .or. .not. finding%known) return
      h = space%h(:m, :m)
      allocate (real_part(m), imaginary_part(m), vectors(m, m), work(20*m))
      call dgeev('N', 'V', m, h, m, real_part, imaginary_part, unused, 1, vectors, m, work, size(work), info)
      finding%known = info == 0
      if (info /= 0) return
      do i = 1, m
         if (abs(imaginary_part(i)) > 0 .or. real_part(i) >= 0) cycle
         finding%passed = finding%passed + 1
         x = matmul(space%z(:, :m), vectors(:, i))
         mx = scale*matmul(space%v(:, :m), vectors(:, i))
         ! lambda is negative, so that x A x has the opposite sign of x M x
         finding%more_negative = finding%more_negative + merge(1, -1, dot_product(x, mx) > 0)
      end do
   end subroutine inspect

   !> Is this a null vector?
   subroutine try_null_vector(matrix, scale, tolerance, v, finding, reduction)
      class(factored_t), intent(in) :: matrix
      real(dp), intent(in) :: scale(:), tolerance
      real(dp), intent(inout) :: v(:) !< (n) its largest component, scaled, is made one
      type(finding_t), intent(inout) :: finding
      real(dp), intent(out) :: reduction !< |A v| over |v|, scaled
      real(dp), allocatable :: y(:), unused(:)
      integer :: i

      reduction = 0
      if (.not. all(ieee_is_finite(v))) then
         finding%singular_equation = minloc(scale, 1)
         return
      end if
      i = maxloc(abs(v)*scale, 1)
      v = v/v(i)
      allocate (y(size(v)), unused(size(v)))
      call matrix%multiply(v, y, unused)
      reduction = norm2(y/scale)/norm2(v*scale)
      if (reduction > tolerance) return
      finding%singular_equation = i
      finding%null_vector = v
   end subroutine try_null_vector

   !> In (-1, 1), the same ones every time: a null vector orthogonal to them is as good as impossible.
   pure function numbers_without_pattern(n) result(b)
      integer, intent(in) :: n
      real(dp) :: b(n)
      integer :: i, seed
      seed = 12345
      do i = 1, n
         seed = mod(1103*seed + 12721, 65536)
         b(i) = real(seed, dp)/32768 - 1
      end do
   end function numbers_without_pattern
end module finshell_inspection
