!> The floating-point environment of the host: held while the library computes, given back as it was.
!>
!> A host may stop at floating-point exceptions, or look at their flags. Neither is disturbed: elements are computed side by side,
!> refused ones with the others, and the compiler computes some quotients before it knows whether they are needed. Traps and flags
!> belong to a thread, so each thread of a team holds its own. What could not be computed is told by codes alone.
!>
!> With FINSHELL_TRAPS (preset `debug`) nothing is held: a NaN is to be found where it arises.
module finshell_environment
   use, intrinsic :: iso_c_binding, only: c_int
   use finshell_kinds, only: i8
   implicit none
   private
   public :: environment_t, hold, release, all_quiet

   !> Larger than any fenv_t.
   type :: environment_t
      private
      integer(i8) :: store(32)
   end type environment_t

#ifndef FINSHELL_TRAPS
   interface
      subroutine hold_environment(store) bind(c, name='__finshell_environment_MOD_c_hold')
         import :: i8
         integer(i8), intent(inout) :: store(*)
      end subroutine hold_environment

      subroutine release_environment(store) bind(c, name='__finshell_environment_MOD_c_release')
         import :: i8
         integer(i8), intent(in) :: store(*)
      end subroutine release_environment

      function environment_flags() result(raised) bind(c, name='__finshell_environment_MOD_c_flags')
         import :: c_int
         integer(c_int) :: raised
      end function environment_flags
   end interface
#endif

contains

   !> From here on nothing traps; flags that are raised will be forgotten.
   subroutine hold(environment)
      type(environment_t), intent(inout) :: environment
#ifndef FINSHELL_TRAPS
      call hold_environment(environment%store)
#endif
   end subroutine hold

   !> Flags and traps as they were at `hold`.
   subroutine release(environment)
      type(environment_t), intent(in) :: environment
#ifndef FINSHELL_TRAPS
      call release_environment(environment%store)
#endif
   end subroutine release

   !> True when all results since `hold` are sure to be finite, provided the operands were; false says nothing.
   logical function all_quiet()
      all_quiet = .false.
#ifndef FINSHELL_TRAPS
      all_quiet = environment_flags() == 0
#endif
   end function all_quiet
end module finshell_environment
