!> Ctrl-C once: stop when the increment is done, with everything saved. Twice: at once. SIGTERM likewise.
module finshell_interrupt
   use, intrinsic :: iso_c_binding, only: c_int
   implicit none
   private
   public :: watch_interrupts, interrupted, is_terminal

   interface
      subroutine c_watch(aloud) bind(c, name='finshell_interrupt_watch')
         import :: c_int
         integer(c_int), value :: aloud
      end subroutine c_watch

      function c_asked() bind(c, name='finshell_interrupt_asked') result(yes)
         import :: c_int
         integer(c_int) :: yes
      end function c_asked

      function c_isatty(descriptor) bind(c, name='isatty') result(yes)
         import :: c_int
         integer(c_int), value :: descriptor
         integer(c_int) :: yes
      end function c_isatty
   end interface

contains

   !> From now on interrupts are noted.
   subroutine watch_interrupts(aloud)
      logical, intent(in) :: aloud !< say so when one comes
      call c_watch(merge(1_c_int, 0_c_int, aloud))
   end subroutine watch_interrupts

   !> Has one come?
   logical function interrupted()
      interrupted = c_asked() /= 0
   end function interrupted

   !> Is the standard output a terminal?
   logical function is_terminal()
      is_terminal = c_isatty(1_c_int) /= 0
   end function is_terminal
end module finshell_interrupt
