!> Nobody who listens.
module deaf_observer
   use finshell_error, only: error_t
   use finshell_observer, only: observer_t, record_t
   use finshell_state, only: linear_change_t, state_t
   implicit none
   private
   public :: deaf_t

   type, extends(observer_t) :: deaf_t
      type(record_t) :: last
   contains
      procedure :: increment
   end type deaf_t

contains

   subroutine increment(self, state, record, error, change)
      class(deaf_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t), intent(in), optional, target :: change
      self%last = record
      if (state%increment < 0 .or. present(change)) self%last%increment = -1
   end subroutine increment
end module deaf_observer

!> What an increment of an explicit step costs, for bench/explicit.py, which runs it on meshes of many sizes.
!>
!>     bench_explicit INPUT.nml THREADS [step]
!>
!> The input has one explicit step. Prints lines of a name and numbers: `elements`; `increments` of the step; ns of the wall and of
!> CPU time per element of the kernel's force alone (`kernel`: all elements in calls of one patch, gathered before), of forces
!> added up over the mesh (`assembly`), of one estimate of the stable increment (`estimate`), of an increment of the step, core and
!> all (`step`); `stable` and `limit`: the estimated increment and, by a power iteration over the whole structure, 2/omega.
program bench_explicit
   use deaf_observer, only: deaf_t
   use, intrinsic :: iso_fortran_env, only: error_unit, int64
   use finshell_assembly, only: assemble
   use finshell_discretisation, only: evaluate_gathered, freedoms, gather_elements, gathered_t
   use finshell_equilibrium, only: equilibrium_t, new_equilibrium
   use finshell_error, only: error_t
   use finshell_explicit, only: solve_explicit
   use finshell_freedoms, only: n_nodal, rx
   use finshell_input, only: input_t, read_input
   use finshell_kinds, only: dp, i4
   use finshell_leapfrog, only: leapfrog_t, new_leapfrog
   use finshell_load_terms, only: add_stiffness_times
   use finshell_motion_start, only: begin_motion, lumped_masses
   use finshell_rotatory_inertia, only: scale_rotatory_inertia
   use finshell_stable_step, only: stable_increment
!$ use omp_lib, only: omp_set_num_threads
   implicit none

   type(input_t), target :: input
   type(equilibrium_t), target :: problem
   type(error_t), allocatable :: error
   type(leapfrog_t) :: leapfrog
   type(deaf_t) :: deaf
   real(dp), allocatable :: mass(:, :)
   character(len=200) :: name, number
   integer :: told, done, elements, repeats, threads, r
   integer(int64) :: start
   integer(i4) :: status
   real(dp) :: longest, cpu
   integer :: bad

   call get_command_argument(1, name)
   call get_command_argument(2, number)
   read (number, *) threads
!$ call omp_set_num_threads(threads)
   call read_input(trim(name), input, error)
   call check()
   problem%may_float = .true.
   call new_equilibrium(problem, input%structure, error)
   call check()
   elements = size(input%structure%mesh%triangles, 2)
   repeats = max(3, 200000/elements)
   write (*, '(a,i0)') 'elements ', elements

   told = 0
   done = 0
   call tick()
   call solve_explicit(problem, input%steps(1), deaf, told, done, error)
   call check()
   call tock('step', done)
   write (*, '(a,i0)') 'increments ', done

   call get_command_argument(3, number)
   if (number == 'step') stop
   call measure_kernel()
   call tick()
   do r = 1, repeats
      call assemble(problem%assembly, input%structure, problem%state, problem%internal_force, status, bad)
   end do
   call tock('assembly', repeats)

   call begin_motion(problem)
   call lumped_masses(problem, mass, error)
   call check()
   call scale_rotatory_inertia(input%structure, input%steps(1)%rotation_scaling, mass)
   call new_leapfrog(leapfrog, problem%equations, problem%state, mass, 0.0_dp)
   call tick()
   call stable_increment(problem, leapfrog, longest, error)
   call check()
   call tock('estimate', 1)
   write (*, '(a,es14.6)') 'stable ', longest, 'limit ', limit()

contains

   subroutine tick()
      call system_clock(start)
      call cpu_time(cpu)
   end subroutine tick

   !> ns for each element, of the wall and of all cores.
   subroutine tock(part, times)
      character(len=*), intent(in) :: part
      integer, intent(in) :: times
      integer(int64) :: now, rate
      real(dp) :: used
      call system_clock(now, rate)
      call cpu_time(used)
      write (*, '(a,2f12.1)') part//' ', [real(now - start, dp)/rate, used - cpu]*1e9_dp/elements/times
   end subroutine tock

   !> Force of all elements, patch by patch; what is gathered is gathered before.
   subroutine measure_kernel()
      type(gathered_t), allocatable :: g(:)
      real(dp), allocatable :: f(:, :)
      integer(i4), allocatable :: found(:)
      integer :: p, n
      associate (patches => problem%assembly%patches, s => input%structure)
         allocate (g(size(patches%group)))
         do p = 1, size(g)
            call gather_elements(s, problem%state, patches%element(patches%first(p):patches%first(p + 1) - 1), g(p), &
                                 problem%equations%held)
         end do
         call tick()
         !$omp parallel private(f, found, n, r, p)
         do r = 1, repeats
            !$omp do schedule(static)
            do p = 1, size(g)
               n = size(g(p)%x, 3)
               if (.not. allocated(f)) allocate (f(freedoms(s%sections(patches%group(p))), n), found(n))
               if (size(found) /= n) then
                  deallocate (f, found)
                  allocate (f(freedoms(s%sections(patches%group(p))), n), found(n))
               end if
               call evaluate_gathered(s%sections(patches%group(p)), g(p), found, force=f, threads=1)
            end do
            !$omp end do
         end do
         !$omp end parallel
      end associate
      call tock('kernel', repeats)
   end subroutine measure_kernel

   !> 2/omega of the whole structure by a power iteration; supports hold.
   real(dp) function limit()
      real(dp), allocatable :: x(:, :), y(:, :), inverse(:, :)
      integer, allocatable :: list(:)
      integer :: i, seed, k, m
      real(dp) :: value
      allocate (x(n_nodal, size(mass, 2)), y(n_nodal, size(mass, 2)), inverse(n_nodal, size(mass, 2)), source=0.0_dp)
      where (problem%equations%number > 0 .and. mass > 0) inverse = 1/sqrt(mass)
      seed = 4711
      do k = 1, size(x, 2)
         do m = 1, n_nodal
            seed = mod(1103*seed + 12721, 65536)
            x(m, k) = (real(seed, dp)/32768 - 1)
         end do
      end do
      list = [(i, i=1, elements)]
      value = 0
      do i = 1, merge(300, 20, elements < 20000)
         x = x/norm2(x)
         y = 0
         call add_stiffness_times(input%structure, problem%equations, list, problem%state, inverse*x, y)
         y = inverse*y
         value = norm2(y)
         x = y
      end do
      limit = 2/sqrt(value)
   end function limit

   subroutine check()
      if (.not. allocated(error)) return
      write (error_unit, '(a)') error%message
      error stop 1
   end subroutine check
end program bench_explicit
