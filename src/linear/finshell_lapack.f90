!> What more than one module calls of LAPACK.
module finshell_lapack
   use finshell_kinds, only: dp
   implicit none
   private
   public :: dgetrf, dgetrs, dlauum, dpotrf, dpotrs, dsyev, dsytrf, dsytrs, dtrmv

   interface
      !> Cholesky's factor of a dense matrix, in its place.
      subroutine dpotrf(uplo, n, a, lda, info)
         import :: dp
         character, intent(in) :: uplo
         integer, intent(in) :: n, lda
         real(dp), intent(inout) :: a(lda, *)
         integer, intent(out) :: info
      end subroutine dpotrf

      !> Solve with it.
      subroutine dpotrs(uplo, n, nrhs, a, lda, b, ldb, info)
         import :: dp
         character, intent(in) :: uplo
         integer, intent(in) :: n, nrhs, lda, ldb
         real(dp), intent(in) :: a(lda, *)
         real(dp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dpotrs

      !> L D L^T of a dense symmetric matrix, with the pivots of Bunch and Kaufman.
      subroutine dsytrf(uplo, n, a, lda, ipiv, work, lwork, info)
         import :: dp
         character, intent(in) :: uplo
         integer, intent(in) :: n, lda, lwork
         real(dp), intent(inout) :: a(lda, *)
         integer, intent(out) :: ipiv(*)
         real(dp), intent(out) :: work(*)
         integer, intent(out) :: info
      end subroutine dsytrf

      !> Solve with it.
      subroutine dsytrs(uplo, n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: dp
         character, intent(in) :: uplo
         integer, intent(in) :: n, nrhs, lda, ldb, ipiv(*)
         real(dp), intent(in) :: a(lda, *)
         real(dp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dsytrs

      !> Eigenvalues, rising, of a dense symmetric matrix, and its eigenvectors in its place. It fails for no finite one.
      pure subroutine dsyev(jobz, uplo, n, a, lda, w, work, lwork, info)
         import :: dp
         character, intent(in) :: jobz, uplo
         integer, intent(in) :: n, lda, lwork
         real(dp), intent(inout) :: a(lda, *)
         real(dp), intent(out) :: w(*), work(*)
         integer, intent(out) :: info
      end subroutine dsyev

      !> P L U of a dense matrix, in its place.
      subroutine dgetrf(m, n, a, lda, ipiv, info)
         import :: dp
         integer, intent(in) :: m, n, lda
         real(dp), intent(inout) :: a(lda, *)
         integer, intent(out) :: ipiv(*), info
      end subroutine dgetrf

      !> Solve with it.
      subroutine dgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: dp
         character, intent(in) :: trans
         integer, intent(in) :: n, nrhs, lda, ldb, ipiv(*)
         real(dp), intent(in) :: a(lda, *)
         real(dp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dgetrs

      !> U U^T or L^T L of a triangle, in its place.
      subroutine dlauum(uplo, n, a, lda, info)
         import :: dp
         character, intent(in) :: uplo
         integer, intent(in) :: n, lda
         real(dp), intent(inout) :: a(lda, *)
         integer, intent(out) :: info
      end subroutine dlauum

      !> x = A x or A^T x of a triangle.
      subroutine dtrmv(uplo, trans, diag, n, a, lda, x, incx)
         import :: dp
         character, intent(in) :: uplo, trans, diag
         integer, intent(in) :: n, lda, incx
         real(dp), intent(in) :: a(lda, *)
         real(dp), intent(inout) :: x(*)
      end subroutine dtrmv
   end interface
end module finshell_lapack
