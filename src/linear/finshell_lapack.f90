!> What more than one module calls of LAPACK.
module finshell_lapack
   use finshell_kinds, only: dp
   implicit none
   private
   public :: dpotrf

   interface
      !> Cholesky's factor of a dense matrix, in its place.
      subroutine dpotrf(uplo, n, a, lda, info)
         import :: dp
         character, intent(in) :: uplo
         integer, intent(in) :: n, lda
         real(dp), intent(inout) :: a(lda, *)
         integer, intent(out) :: info
      end subroutine dpotrf
   end interface
end module finshell_lapack
