!> What an iteration for one increment has come to.
module finshell_newton_result
   use finshell_kinds, only: wp, i4
   use finshell_status, only: status_ok, status_text
   use finshell_balance, only: tangent_t
   implicit none
   private
   public :: newton_result_t, give_up

   type :: newton_result_t
      logical :: converged = .false.
      integer :: iterations = 0 !< linear solves
      real(wp) :: residual = huge(1.0_wp) !< finshell_convergence
      real(wp) :: correction = huge(1.0_wp)
      logical :: rounding = .false. !< rounding kept one of them above its tolerance
      real(wp) :: stand_in = 0 !< part of the stand-in stiffness in the matrix now
      integer :: first_pivots = -1 !< negative pivots of the first tangent
      integer :: first_determinant = 0
      real(wp) :: first_change = 0 !< of the load factor, in the first correction
      real(wp) :: first_rotation = 0 !< largest of the first correction, before it was shortened
      type(tangent_t) :: first !< tangent to the path where the iteration began
      type(tangent_t) :: last !< where it ended; both a correction before that
      real(wp), allocatable :: x_t(:) !< change of the unknowns per load factor, last iteration; unallocated in load control
      logical :: spent = .false. !< a descent has cost all that one may
      integer :: regularised = 0 !< iterations with a stand-in stiffness or, in a descent, with inertia
      integer :: steps = 0 !< explicit ones, of a relaxation
      integer(i4) :: code = status_ok
      character(len=:), allocatable :: reason !< why it did not converge
   end type newton_result_t

contains

   subroutine give_up(result, code, reason)
      type(newton_result_t), intent(inout) :: result
      integer(i4), intent(in) :: code
      character(len=*), intent(in) :: reason
      result%converged = .false.
      result%code = code
      result%reason = reason
      if (len(reason) == 0) result%reason = status_text(code)
   end subroutine give_up
end module finshell_newton_result
