!> The direct solvers that this build has, by name, and which of them are for which matrix.
!>
!> FINSHELL_NO_MUMPS, FINSHELL_NO_SUITESPARSE: built without.
module finshell_back_ends
#ifndef FINSHELL_NO_SUITESPARSE
   use finshell_cholmod, only: cholmod_t
   use finshell_parts, only: parts_t
   use finshell_umfpack, only: umfpack_t
#endif
   use finshell_direct_solver, only: direct_solver_t, solver_options_t, threads_of
#ifndef FINSHELL_NO_MUMPS
   use finshell_mumps, only: mumps_t
#endif
   use finshell_kinds, only: dp
   use finshell_sparsity, only: sparsity_t
   use finshell_team, only: shared
   implicit none
   private
   public :: can_work_on_disk, choose_solvers, lack_of_solver

   !> Of an iteration with factors of single precision. Compressed they precondition better, not worse: hemisphere of radius over
   !> thickness 2500 with 10^5 unknowns: 16 iterations; 40 do not do without.
   real(dp), parameter :: usual_low_rank = 1e-5_dp

   !> Unknowns from which on cutting a matrix in parts for several threads pays.
   integer, parameter :: large = 40000

contains

   !> The solver of a matrix, and another for when a symmetric one turns out to be indefinite (not allocated: the same).
   subroutine choose_solvers(options, pattern, first, indefinite)
      type(solver_options_t), intent(in) :: options
      type(sparsity_t), intent(in) :: pattern !< shared by processes: for MUMPS only
      class(direct_solver_t), allocatable, intent(out) :: first, indefinite
      logical :: symmetric, in_parts
      symmetric = pattern%symmetric
      in_parts = shared(pattern%team)
      select case (word_of(options))
      case ('mumps', 'iterative')
         call new_solver(word_of(options), first)
      case ('parts') ! for tests: whatever the size
         call new_solver(trim(merge('parts  ', 'umfpack', symmetric)), first)
         if (symmetric) call new_solver('mumps', indefinite)
      case ('suitesparse')
         call new_solver(trim(merge('cholmod', 'umfpack', symmetric)), first)
      case default
         if (symmetric .and. .not. in_parts .and. pattern%n >= large .and. threads_of(options) > 1) call new_solver('parts', first)
         if (.not. (in_parts .or. allocated(first))) call new_solver(trim(merge('cholmod', 'umfpack', symmetric)), first)
         if (.not. allocated(first)) then
            call new_solver('mumps', first)
         else if (symmetric) then
            call new_solver('mumps', indefinite)
         end if
      end select
      if (allocated(first)) first%options = options
      if (word_of(options) == 'iterative' .and. allocated(first) .and. .not. options%low_rank > 0) &
         first%options%low_rank = usual_low_rank
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
      case ('mumps', 'iterative')
         call new_solver('mumps', first)
         if (.not. allocated(first)) reason = 'this finshell was built without MUMPS, which alone is for '// &
                                              what_for(options)
      case ('parts')
         call new_solver('parts', first)
         if (.not. allocated(first)) reason = 'parts need both SuiteSparse and MUMPS'
      case ('suitesparse')
         call new_solver('cholmod', first)
         if (.not. allocated(first)) reason = 'this finshell was built without SuiteSparse'
         if (in_parts) reason = 'SuiteSparse works on one process only; many need MUMPS'
         if (options%low_rank > 0) reason = 'low_rank is for MUMPS, not for SuiteSparse'
         if (options%out_of_core) reason = 'out_of_core is for MUMPS, not for SuiteSparse'
      end select
   end function lack_of_solver

   !> Whether a factor that does not fit into memory is kept on disk.
   logical function can_work_on_disk() result(yes)
      yes = lack_of_solver(solver_options_t(out_of_core=.true.), .false.) == ''
   end function can_work_on_disk

   !> What asks for MUMPS.
   pure function what_for(options) result(keys)
      type(solver_options_t), intent(in) :: options
      character(len=:), allocatable :: keys
      keys = "solver = 'mumps'"
      if (allocated(options%solver)) keys = "solver = '"//options%solver//"'"
      if (options%out_of_core) keys = 'out_of_core'
      if (options%low_rank > 0) keys = 'low_rank'
   end function what_for

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
#ifndef FINSHELL_NO_MUMPS
      case ('parts') ! what they refuse needs another
         allocate (parts_t :: solver)
#endif
#endif
#ifndef FINSHELL_NO_MUMPS
      case ('mumps')
         allocate (mumps_t :: solver)
      case ('iterative')
         allocate (solver, source=mumps_t(single=.true.))
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
