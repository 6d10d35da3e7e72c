!> The transposed of a sparse matrix that is not symmetric, in the same pattern: where there is an entry, there is one across the
!> diagonal.
module finshell_transposed
   use finshell_kinds, only: dp
   use finshell_sparsity, only: sparsity_t
   implicit none
   private
   public :: multiply_transposed, transposed_values

contains

   !> y = A^T x.
   pure subroutine multiply_transposed(pattern, values, x, y)
      type(sparsity_t), intent(in) :: pattern !< not symmetric
      real(dp), intent(in) :: values(:), x(:)
      real(dp), intent(out) :: y(:) !< (n)
      integer :: j, p
      do j = 1, pattern%n
         y(j) = 0
         do p = pattern%column_pointer(j), pattern%column_pointer(j + 1) - 1
            y(j) = y(j) + values(p)*x(pattern%row(p))
         end do
      end do
   end subroutine multiply_transposed

   !> The values of A^T.
   pure function transposed_values(pattern, values) result(turned)
      type(sparsity_t), intent(in) :: pattern !< not symmetric
      real(dp), intent(in) :: values(:)
      real(dp) :: turned(size(values))
      integer :: j, p
      turned = 0
      do j = 1, pattern%n
         do p = pattern%column_pointer(j), pattern%column_pointer(j + 1) - 1
            turned(pattern%find(j, int(pattern%row(p)))) = values(p)
         end do
      end do
   end function transposed_values
end module finshell_transposed
