!> A quantity that a step monitors and may prescribe, as a function of the unknowns.
module finshell_watched
   use finshell_equations, only: equations_t
   use finshell_kinds, only: wp
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: watched_t

   type, abstract :: watched_t
   contains
      procedure(value_interface), deferred :: value
      procedure(gradient_interface), deferred :: gradient
   end type watched_t

   abstract interface
      function value_interface(self, structure, state) result(value)
         import :: watched_t, state_t, structure_t, wp
         class(watched_t), intent(in) :: self
         type(structure_t), intent(in) :: structure
         type(state_t), intent(in) :: state
         real(wp) :: value
      end function value_interface

      !> Derivatives with respect to the unknowns and to the load factor, by which held nodes may move.
      subroutine gradient_interface(self, structure, equations, state, gradient, rate)
         import :: watched_t, equations_t, state_t, structure_t, wp
         class(watched_t), intent(in) :: self
         type(structure_t), intent(in) :: structure
         type(equations_t), intent(in) :: equations
         type(state_t), intent(in) :: state
         real(wp), intent(out) :: gradient(:) !< (equations%n)
         real(wp), intent(out) :: rate
      end subroutine gradient_interface
   end interface
end module finshell_watched
