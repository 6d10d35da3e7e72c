!> The direct solvers that this build has, by name, and which of them are for which matrix.
!>
!> FINSHELL_NO_MUMPS, FINSHELL_NO_SUITESPARSE: built without.
module finshell_back_ends
#ifndef FINSHELL_NO_SUITESPARSE
   use finshell_cholmod, only: cholmod_t
   use finshell_umfpack, only: umfpack_t
#endif
   use finshell_direct_solver, only: direct_solver_t, solver_options_t
#ifndef FINSHELL_NO_MUMPS
   use finshell_mumps, only: mumps_t
#endif
   implicit none
   private
   public :: choose_solvers, lack_of_solver, solver_words

   !> What `solver =` may be.
   character(len=*), parameter :: solver_words = 'auto, mumps, suitesparse'

contains

   !> The solver of a matrix, and another for when a symmetric one turns out to be indefinite (not allocated: the same).
   subroutine choose_solvers(options, symmetric, in_parts, first, indefinite)
      type(solver_options_t), intent(in) :: options
      logical, intent(in) :: symmetric
      logical, intent(in) :: in_parts !< many processes have parts of the matrix: for MUMPS only
      class(direct_solver_t), allocatable, intent(out) :: first, indefinite
      if (word_of(options) /= 'mumps' .and. .not. in_parts) call new_solver(trim(merge('cholmod', 'umfpack', symmetric)), first)
      if (word_of(options) /= 'suitesparse') then
         if (.not. allocated(first)) then
            call new_solver('mumps', first)
         else if (symmetric) then
            call new_solver('mumps', indefinite)
         end if
      end if
      if (allocated(first)) first%options = options
      if (allocated(indefinite)) indefinite%options = options
   end subroutine choose_solvers

   !> '' if this build can do what is asked for, else a sentence.
   function lack_of_solver(options, in_parts) result(reason)
      type(solver_options_t), intent(in) :: options
      logical, intent(in) :: in_parts !< many processes have parts of the matrix
      character(len=:), allocatable :: reason
      class(direct_solver_t), allocatable :: first
      reason = ''
      select case (word_of(options))
      case ('mumps')
         call new_solver('mumps', first)
         if (.not. allocated(first)) reason = 'this finshell was built without MUMPS'
      case ('suitesparse')
         call new_solver('cholmod', first)
         if (.not. allocated(first)) reason = 'this finshell was built without SuiteSparse'
         if (in_parts) reason = 'SuiteSparse works on one process only; many need MUMPS'
      end select
      if (reason /= '') return
      call new_solver('mumps', first)
      if (options%low_rank > 0 .or. options%out_of_core) then
         if (.not. allocated(first)) reason = 'this finshell was built without MUMPS, which alone has low_rank and out_of_core'
      end if
   end function lack_of_solver

   !> Not allocated if there is none of this name.
   subroutine new_solver(name, solver)
      character(len=*), intent(in) :: name
      class(direct_solver_t), allocatable, intent(out) :: solver
      select case (name)
#ifndef FINSHELL_NO_SUITESPARSE
      case ('cholmod')
         allocate (cholmod_t :: solver)
      case ('umfpack')
         allocate (umfpack_t :: solver)
#endif
#ifndef FINSHELL_NO_MUMPS
      case ('mumps')
         allocate (mumps_t :: solver)
#endif
      end select
   end subroutine new_solver

   !> The solver that is asked for. Only MUMPS compresses factors, or keeps them on disk.
   pure function word_of(options) result(word)
      type(solver_options_t), intent(in) :: options
      character(len=:), allocatable :: word
      word = 'auto'
      if (allocated(options%solver)) word = options%solver
      if (word == 'auto' .and. (options%low_rank > 0 .or. options%out_of_core)) word = 'mumps'
   end function word_of
end module finshell_back_ends
