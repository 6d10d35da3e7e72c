!> The factors of the tangent of an equilibrium: of its sparse matrix or, for a descent, of the symmetric part of this, and the
!> border that the pressures of chambers are.
module finshell_tangent_factors
   use finshell_bordered, only: border_t
   use finshell_error, only: error_t
   use finshell_kinds, only: wp
   use finshell_linear_solver, only: linear_solver_t
   use finshell_symmetric_part, only: symmetric_part_t
   use finshell_team, only: leads, team_t
   implicit none
   private
   public :: tangent_factors_t

   type :: tangent_factors_t
      logical :: by_half = .false. !< of the symmetric part
      integer :: negative_pivots = -1 !< -1: not known
      integer :: determinant_sign = 0 !< 0: not known
      logical, private :: has_border = .false.
      type(border_t), private :: border
   contains
      procedure :: factorise
      procedure :: solve
   end type tangent_factors_t

contains

   !> Factorise, with the damping added to the diagonal. Without it the matrix itself is taken.
   subroutine factorise(self, solver, half, values, diagonal, weight, damping, gradient, compliance, team, error)
      class(tangent_factors_t), intent(inout) :: self
      type(linear_solver_t), intent(inout) :: solver
      type(symmetric_part_t), intent(inout) :: half
      real(wp), intent(in), contiguous :: values(:)
      integer, intent(in) :: diagonal(:) !< (n) where it stands among the values
      real(wp), intent(in) :: weight(:) !< (n or more)
      real(wp), intent(in), optional :: damping !< times the weight
      real(wp), intent(in), optional :: gradient(:, :), compliance(:) !< of the border
      class(team_t), pointer, intent(in) :: team
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: damped(:)
      real(wp) :: a
      a = 0
      if (present(damping)) a = damping
      self%by_half = a > 0 .and. half%exists()
      if (a > 0) then
         damped = values
         if (leads(team)) damped(diagonal) = damped(diagonal) + a*weight(:size(diagonal))
      end if
      if (self%by_half) then
         call half%prepare(error)
         if (.not. allocated(error)) call by(half%solver, half%values_of(damped), half%diagonal())
      else if (a > 0) then
         call by(solver, damped, diagonal)
      else
         call by(solver, values, diagonal)
      end if

   contains

      subroutine by(one, matrix, places)
         type(linear_solver_t), intent(inout) :: one
         real(wp), intent(in), contiguous :: matrix(:)
         integer, intent(in) :: places(:)
         self%has_border = present(gradient) .and. present(compliance)
         if (self%has_border) then
            call self%border%factorise(one, matrix, places, team, gradient, compliance, error)
            self%negative_pivots = self%border%negative_pivots
            self%determinant_sign = self%border%determinant_sign
         else
            call one%factorise(matrix, error)
            self%negative_pivots = one%negative_pivots
            self%determinant_sign = one%determinant_sign
         end if
      end subroutine by
   end subroutine factorise

   subroutine solve(self, solver, half, b, x, error)
      class(tangent_factors_t), intent(in) :: self
      type(linear_solver_t), intent(inout) :: solver
      type(symmetric_part_t), intent(inout) :: half
      real(wp), intent(in), contiguous :: b(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error
      if (self%by_half) then
         call by(half%solver)
      else
         call by(solver)
      end if

   contains

      subroutine by(one)
         type(linear_solver_t), intent(inout) :: one
         if (self%has_border) then
            call self%border%solve(one, b, x, error)
         else
            call one%solve(b, x, error)
         end if
      end subroutine by
   end subroutine solve
end module finshell_tangent_factors
