!> The digits that the factors of a matrix do not give: corrections from the residual, and where they do not bring it down because
!> the factors are approximate, GMRES.
!>
!> Equation i is measured by scale(i), as everywhere (finshell_linear_solver).
module finshell_refinement
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use finshell_error, only: error_t
   use finshell_gmres, only: enough, factored_t, gmres, krylov_t
   use finshell_kinds, only: dp
   implicit none
   private
   public :: refine

   integer, parameter :: most_refinements = 30
   integer, parameter :: most_iterations = 200

contains

   !> Improve a solution of A x = b. Errors: those of the factors.
   subroutine refine(matrix, scale, approximate, b, x, steps, residual, error)
      class(factored_t), intent(inout) :: matrix
      real(dp), intent(in) :: scale(:) !< (n)
      logical, intent(in) :: approximate !< the factors are
      real(dp), intent(in) :: b(:) !< (n)
      real(dp), intent(inout) :: x(:) !< (n)
      integer, intent(out) :: steps !< solutions with the factors
      real(dp), intent(out) :: residual !< relative, that is left
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: r(:), better(:), size_of(:), dx(:, :)
      real(dp) :: after, before, slow
      type(krylov_t) :: space
      integer :: k

      slow = merge(0.1_dp, 0.5_dp, approximate)
      allocate (r(size(b)), size_of(size(b)), dx(size(b), 1))
      call measure(x, residual)
      before = residual
      steps = 0
      do k = 1, most_refinements
         if (residual <= epsilon(residual)) exit
         call matrix%backend(reshape(r, [size(b), 1]), dx, error)
         if (allocated(error)) return
         better = x + dx(:, 1)
         call measure(better, after)
         if (.not. after < residual) exit
         x = better
         steps = k
         before = residual
         residual = after
         if (after > slow*before) exit
      end do
      if (.not. approximate) return
      do while (residual > enough .and. steps < most_iterations)
         call measure(x, before)
         call gmres(matrix, scale, enough*residual_norm()/before, r, dx(:, 1), space, error)
         if (allocated(error)) return
         steps = steps + space%used
         better = x + dx(:, 1)
         call measure(better, residual)
         if (residual < before) x = better
         if (residual > 0.5_dp*before) exit
      end do
      residual = min(residual, before)

   contains

      !> The residual r, relative to what rounding makes of it.
      subroutine measure(solution, relative)
         real(dp), intent(in) :: solution(:)
         real(dp), intent(out) :: relative
         real(dp) :: largest
         call matrix%multiply(solution, r, size_of)
         r = b - r
         largest = maxval((size_of + abs(b))/scale)
         relative = 0
         if (largest > 0) relative = maxval(abs(r)/scale)/largest
         ! maxval passes over NaN.
         if (.not. all(ieee_is_finite(r))) relative = huge(relative)
      end subroutine measure

      real(dp) function residual_norm()
         residual_norm = norm2(r/scale)
      end function residual_norm
   end subroutine refine
end module finshell_refinement
