!> What the parts of an analysis cost, once each: for bench/scale.py, which runs it on meshes of many sizes.
!>
!>     bench_scale INPUT.nml [assembly | output]
!>
!> A line for each part: its name, seconds (wall), seconds (CPU), and the largest memory of the process so far (bytes). The parts:
!> set-up (input, mesh, equations, pattern), assembly of force and tangent, ordering, factorisation, solution of one right side,
!> output (result files are begun, with the mesh and the unloaded state), increment (one is written). `assembly`: nothing after
!> that; `output`: without what lies between set-up and output.
!> Then a line `size` with elements, unknowns, entries of the matrix, bytes of the factors.
program bench_scale
   use, intrinsic :: iso_fortran_env, only: error_unit, int64
   use finshell_assembly, only: paying_threads
   use finshell_blas_threads, only: to_openmp
   use finshell_equilibrium, only: equilibrium_t, new_equilibrium
   use finshell_error, only: error_t
   use finshell_input, only: input_t, read_input
   use finshell_kinds, only: dp
   use finshell_observer, only: record_t
   use finshell_reporter, only: reporter_t
   use finshell_trial, only: check_steps, mesh_warning, warning_of
!$ use omp_lib, only: omp_set_num_threads
   implicit none
   type(input_t), target :: input
   type(equilibrium_t), target :: problem
   type(reporter_t), target :: reporter
   type(error_t), allocatable :: error
   real(dp), allocatable :: x(:)
   character(len=:), allocatable :: warning
   character(len=200) :: name, word
   integer :: threads
   integer(int64) :: start
   real(dp) :: cpu

   call get_command_argument(1, name)
   call get_command_argument(2, word)
   call tick()
   call read_input(trim(name), input, error)
   call check()
   threads = paying_threads(size(input%structure%mesh%triangles, 2))
!$ call omp_set_num_threads(threads)
   call to_openmp()
   call new_equilibrium(problem, input%structure, error)
   call check()
   call check_steps(input, problem, error)
   warning = warning_of(input, problem)//mesh_warning(input)
   call tock('set-up')
   allocate (x(problem%n), source=0.0_dp)
   if (word /= 'output') then
      call problem%evaluate(.true., error)
      call tock('assembly')
      if (word == 'assembly') stop
      call problem%solver%prepare(error)
      call tock('ordering')
      call problem%factorise(error)
      call tock('factorisation')
      call problem%solve(problem%rate, x, error)
      call tock('solution')
   else
      call random_number(x)
      x = 1e-6_dp*problem%detail*(x - 0.5_dp)
   end if
   call problem%move(x, 1e-6_dp)
   problem%state%increment = 1
   reporter%quiet = .true.
   call tick()
   call reporter%open(input%name, input%text, problem, input%monitors, input%outputs, input%probes, [real(dp) ::], error)
   call check()
   call tock('output')
   call reporter%begin_step(input%steps(1), 1)
   call reporter%increment(problem%state, record_t(increment=1), error)
   call tock('increment')
   call reporter%finish(problem%state, error)
   call check()
   write (*, '(a,3i12,f16.0)') 'size ', size(input%structure%mesh%triangles, 2), problem%n, size(problem%values), &
      problem%solver%memory()
   if (warning /= '') write (*, '(2a)') 'warning ', warning

contains

   subroutine tick()
      call system_clock(start)
      call cpu_time(cpu)
   end subroutine tick

   subroutine tock(part)
      character(len=*), intent(in) :: part
      integer(int64) :: now, rate
      real(dp) :: seconds
      call check()
      call system_clock(now, rate)
      call cpu_time(seconds)
      write (*, '(a,2f12.4,i16)') part, real(now - start, dp)/rate, seconds - cpu, memory()
      call tick()
   end subroutine tock

   !> Largest so far, as Linux counts it; 0 elsewhere.
   integer(int64) function memory()
      character(len=100) :: line
      integer :: status, unit
      memory = 0
      open (newunit=unit, file='/proc/self/status', action='read', status='old', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (index(line, 'VmHWM:') == 1) read (line(7:index(line, 'kB') - 1), *) memory
      end do
      close (unit)
      memory = 1024*memory
   end function memory

   subroutine check()
      if (.not. allocated(error)) return
      write (error_unit, '(a)') error%message
      error stop 1
   end subroutine check
end program bench_scale
