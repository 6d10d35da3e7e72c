!> The generalised-alpha method (Chung and Hulbert 1993) on the rotation group (Brüls and Cardona 2010). With auxiliary
!> accelerations a beside the true ones, vdot, an increment of the length h moves by
!>
!>     d = h v_n + h^2 ((1/2 - beta) a_n + beta a),    v = v_n + h ((1 - gamma) a_n + gamma a),
!>     (1 - am) a + am a_n = (1 - af) vdot + af vdot_n,    q = exp(d) q_n,
!>
!> and equilibrium holds at its end, with vdot. rho_infinity, from 1 to 0, is what an increment leaves of the fastest vibrations.
!> With 1 it is the trapezoidal rule, a = vdot.
module finshell_newmark
   use finshell_inertia, only: inertia_t
   use finshell_kinds, only: wp
   use finshell_state, only: state_t
   implicit none
   private
   public :: newmark_t, new_newmark

   type :: newmark_t
      real(wp) :: am = 0, af = 0, beta = 0, gamma = 0
      real(wp) :: error_constant = 0 !< of h^2 (vdot - vdot_n): local error of the displacements
   contains
      procedure :: prepare
      procedure :: advance
   end type newmark_t

   real(wp), parameter :: sixth = 1/6.0_wp

contains

   !> The method of second order with the given radius, the one with the least damping of slow vibrations.
   pure function new_newmark(rho_infinity) result(self)
      real(wp), intent(in) :: rho_infinity
      type(newmark_t) :: self
      self%am = (2*rho_infinity - 1)/(rho_infinity + 1)
      self%af = rho_infinity/(rho_infinity + 1)
      self%gamma = 0.5_wp - self%am + self%af
      self%beta = 0.25_wp*(1 - self%am + self%af)**2
      ! a_n is vdot at the time t_n + (am - af) h, to the second order
      self%error_constant = abs(0.5_wp*(self%am - self%af) + self%beta - sixth)
   end function new_newmark

   !> The rates of `inertia` for an increment.
   pure subroutine prepare(self, base, auxiliary, increment, inertia)
      class(newmark_t), intent(in) :: self
      type(state_t), intent(in) :: base
      real(wp), intent(in) :: auxiliary(:, :) !< (n_nodal, nodes) a_n
      real(wp), intent(in) :: increment !< h
      type(inertia_t), intent(inout) :: inertia
      real(wp) :: share
      associate (h => increment, beta => self%beta, gamma => self%gamma)
         share = (1 - self%am)/(1 - self%af)
         inertia%a1 = share/(beta*h**2)
         inertia%v1 = gamma/(beta*h)
         inertia%v0 = (1 - gamma/beta)*base%velocity + h*(1 - 0.5_wp*gamma/beta)*auxiliary
         inertia%a0 = -share/(beta*h)*base%velocity + (self%am/(1 - self%af) - share*(0.5_wp - beta)/beta)*auxiliary &
            - self%af/(1 - self%af)*base%acceleration
      end associate
   end subroutine prepare

   !> The auxiliary accelerations at the end of an increment.
   pure subroutine advance(self, base, acceleration, auxiliary)
      class(newmark_t), intent(in) :: self
      type(state_t), intent(in) :: base
      real(wp), intent(in) :: acceleration(:, :) !< (n_nodal, nodes) vdot
      real(wp), intent(inout) :: auxiliary(:, :) !< (n_nodal, nodes) a_n, then a
      auxiliary = ((1 - self%af)*acceleration + self%af*base%acceleration - self%am*auxiliary)/(1 - self%am)
   end subroutine advance
end module finshell_newmark
