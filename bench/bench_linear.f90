!> What the direct solvers cost: definite against indefinite matrices of the same pattern.
!>
!>     bench_linear INPUT.nml SOLVER [LOW_RANK]
!>
!> The definite matrix is the tangent at the unloaded state; a multiple of the lumped weights is taken from it until at least ten
!> pivots are negative. One line: unknowns, entries, seconds of CPU time of ordering, of the definite and of the indefinite
!> factorisation (the second of each), of a solution, negative pivots, gigabytes of the factors (definite, indefinite), refinements
!> and residual of the solutions; seconds of the clock for the two factorisations and the solution.
program bench_linear
   use, intrinsic :: iso_fortran_env, only: error_unit, int64
   use finshell_equilibrium, only: equilibrium_t, new_equilibrium
   use finshell_error, only: error_t
   use finshell_input, only: input_t, read_input
   use finshell_kinds, only: dp
   use finshell_linear_solver, only: linear_solver_t
   use finshell_sparsity, only: new_sparsity, sparsity_t
   implicit none
   type(input_t), target :: input
   type(equilibrium_t), target :: problem
   type(linear_solver_t) :: solver
   type(sparsity_t) :: pattern
   type(error_t), allocatable :: error
   real(dp), allocatable :: k(:), weight(:), x(:), b(:)
   real(dp) :: shift, ordering, definite, indefinite, solution, memory(2), residual
   integer, allocatable :: diagonal(:)
   integer :: i, refinements, false_pivots
   character(len=200) :: word
   real(dp) :: mark, wall, walls(3)
   integer(int64) :: clock, rate

   call get_command_argument(1, word)
   call read_input(trim(word), input, error)
   call check()
   call get_command_argument(2, word)
   solver%options%solver = trim(word)
   call get_command_argument(3, word)
   if (word /= '') read (word, *) solver%options%low_rank
   call new_equilibrium(problem, input%structure, error)
   call check()
   call problem%evaluate(.true., error)
   call check()
   k = problem%values
   weight = problem%weight
   call new_sparsity(pattern, input%structure%mesh%triangles, problem%equations%number, .true., error)
   call check()
   diagonal = [(pattern%find(i, i), i=1, pattern%n)]

   call solver%analyse(pattern, error)
   call check()
   call tick()
   call solver%prepare(error)
   call check()
   ordering = tock()
   call factorise(definite)
   call factorise(definite)
   walls(1) = wall
   false_pivots = solver%negative_pivots
   memory(1) = solver%memory()
   b = [(sin(real(i, dp)), i=1, pattern%n)]
   x = b
   call tick()
   call solver%solve(b, x, error)
   call check()
   solution = tock()
   walls(3) = wall
   refinements = solver%refinements
   residual = solver%residual
   shift = 1e-8_dp*maxval(k(diagonal)/weight)
   do
      k = problem%values
      k(diagonal) = k(diagonal) - shift*weight
      call factorise(indefinite)
      if (solver%negative_pivots >= 10) exit
      shift = shift*1.7_dp
   end do
   call factorise(indefinite)
   walls(2) = wall
   memory(2) = solver%memory()
   call solver%solve(b, x, error)
   call check()
   if (false_pivots > 0) write (error_unit, '(i0,a)') false_pivots, ' negative pivots of the definite matrix'
   write (*, '(2i10,4f9.3,i5,2f8.3,2(i4,es9.1),3f9.3)') pattern%n, pattern%entries(), ordering, definite, indefinite, solution, &
      solver%negative_pivots, memory/1e9_dp, refinements, residual, solver%refinements, solver%residual, walls

contains

   subroutine factorise(seconds)
      real(dp), intent(out) :: seconds
      call tick()
      call solver%factorise(k, error)
      seconds = tock()
      call check()
   end subroutine factorise

   subroutine tick()
      call cpu_time(mark)
      call system_clock(clock, rate)
   end subroutine tick

   real(dp) function tock()
      integer(int64) :: now
      call cpu_time(tock)
      tock = tock - mark
      call system_clock(now)
      wall = real(now - clock, dp)/real(rate, dp)
   end function tock

   subroutine check()
      if (.not. allocated(error)) return
      write (error_unit, '(a)') error%message
      error stop 1
   end subroutine check
end program bench_linear
