!> What is told about iterations on the way to an increment, and to whom (finshell_problem has the pointer). Most runs have no
!> listener, and then nothing of this is computed.
module finshell_listener
   use finshell_kinds, only: wp
   implicit none
   private
   public :: iteration_t, listener_t

   !> After a correction; number 0: the state where an attempt begins, of which the residual alone is known.
   type :: iteration_t
      character(len=:), allocatable :: method !< 'Newton', 'mixed', 'descent', ...
      integer :: number = 0
      real(wp) :: residual(2) = 0 !< of forces and of moments, in the measure of the tolerance (finshell_convergence)
      real(wp) :: correction = 0 !< relative
      real(wp) :: rotation = 0 !< largest of the correction (radian)
      real(wp) :: part = 1 !< of it that was made: less than 1 where rotations, an element or a constraint limit it
      logical :: factorised = .true. !< a matrix was, for this correction
      integer :: negative_pivots = -1 !< of it; -1: not known
      real(wp) :: factor = 0 !< the load factor, or whatever factor changes
   end type iteration_t

   type, abstract :: listener_t
   contains
      procedure(iteration_interface), deferred :: iteration
      procedure(say_interface), deferred :: say
   end type listener_t

   abstract interface
      subroutine iteration_interface(self, iteration)
         import :: listener_t, iteration_t
         class(listener_t), intent(inout) :: self
         type(iteration_t), intent(in) :: iteration
      end subroutine iteration_interface

      !> What is about to be tried, and why it failed.
      subroutine say_interface(self, text)
         import :: listener_t
         class(listener_t), intent(inout) :: self
         character(len=*), intent(in) :: text
      end subroutine say_interface
   end interface
end module finshell_listener
