!> `finshell run` of several inputs, or of one with several values for some of its keys: each is a process of this program, as many
!> side by side as there are processors (--jobs), and a table says what became of them.
module finshell_runs
   use, intrinsic :: iso_fortran_env, only: error_unit, int64, output_unit
   use finshell_disk, only: set_environment
   use finshell_error, only: error_t, raise, text_of
   use finshell_history_table, only: history_table_t, read_history
   use finshell_input, only: job_name
   use finshell_interrupt, only: interrupted, is_terminal, watch_interrupts
   use finshell_kinds, only: wp
   use finshell_options, only: exit_incomplete, exit_input, exit_interrupted, exit_ok, options_t
   use finshell_process, only: arguments_t, last_words, process_t, rest, start_process
   use finshell_runs_table, only: print_runs, run_t, write_sweep
   use finshell_setting, only: single_setting
   use finshell_status, only: status_input_error
!$ use omp_lib, only: omp_get_num_procs
   implicit none
   private
   public :: several_runs, is_several

   integer, parameter :: pause = 5 !< milliseconds
   integer, parameter :: most_runs = 10000

contains

   !> Is there more to do than one run?
   pure logical function is_several(options)
      type(options_t), intent(in) :: options
      integer :: i
      is_several = size(options%words) > 1
      do i = 1, size(options%settings)
         is_several = is_several .or. size(options%settings(i)%values) > 1
      end do
   end function is_several

   !> Run them all. The exit code is the worst: an input that is wrong, then an interrupt, then a run that stopped early.
   subroutine several_runs(options, code)
      type(options_t), intent(in) :: options
      integer, intent(out) :: code
      type(run_t), allocatable :: runs(:)
      type(error_t), allocatable :: error
      integer :: first, i, last

      code = exit_input
      call plan(options, runs, error)
      if (allocated(error)) then
         write (error_unit, '(a)') 'finshell: '//error%message
         return
      end if
      call watch_interrupts(.not. options%quiet)
      call run_all(options, runs)
      call print_runs(runs)
      first = 1
      do while (first <= size(runs) .and. size(runs) > size(options%words))
         last = first + count(runs%input == runs(first)%input) - 1
         call write_sweep(options%folder//runs(first)%base//'.sweep.csv', runs(first:last), options%settings, error)
         if (allocated(error)) exit
         write (output_unit, '(a)') 'Table: '//options%folder//runs(first)%base//'.sweep.csv'
         first = last + 1
      end do
      code = exit_ok
      do i = 1, size(runs)
         if (runs(i)%code == exit_incomplete .or. runs(i)%code > exit_interrupted) code = max(code, exit_incomplete)
      end do
      if (interrupted() .or. any(runs%code == exit_interrupted .or. runs%code < 0)) code = exit_interrupted
      if (any(runs%code == exit_input)) code = exit_input
      if (.not. allocated(error)) return
      write (error_unit, '(a)') 'finshell: '//error%message
      if (code == exit_ok) code = exit_incomplete
   end subroutine several_runs

   !> All combinations of an input and the values that were given. Errors: an input that cannot be read; two runs of one name.
   subroutine plan(options, runs, error)
      type(options_t), intent(in) :: options
      type(run_t), allocatable, intent(out) :: runs(:)
      type(error_t), allocatable, intent(out) :: error
      type(run_t) :: run
      integer :: combination, combinations, i, j, rest_of, s
      real(wp) :: number

      combinations = 1
      number = 1
      do s = 1, size(options%settings)
         number = number*size(options%settings(s)%values)
         if (number > most_runs) call raise(error, status_input_error, '--set: more than '//text_of(most_runs)//' runs')
         if (allocated(error)) return
         combinations = combinations*size(options%settings(s)%values)
      end do
      allocate (runs(0))
      do i = 1, size(options%words)
         do combination = 1, combinations
            run = run_t(input=i)
            run%file = options%words(i)%text
            allocate (run%choice(size(options%settings)))
            rest_of = combination - 1
            do s = size(options%settings), 1, -1 ! the last one changes fastest
               run%choice(s) = 1 + mod(rest_of, size(options%settings(s)%values))
               rest_of = rest_of/size(options%settings(s)%values)
            end do
            call job_name(run%file, options%settings, run%base, error)
            if (allocated(error)) return
            run%name = run%base
            if (combinations > 1) run%name = run%base//'.'//text_of(combination)
            do j = 1, size(runs)
               if (runs(j)%name == run%name) call raise(error, status_input_error, run%file//' and '//runs(j)%file &
                  //' would both write '//options%folder//run%name//'.history.csv: give one of them another name (name in &job)')
               if (allocated(error)) return
            end do
            runs = [runs, run]
         end do
      end do
   end subroutine plan

   !> Start them, in their order, and wait for them.
   subroutine run_all(options, runs)
      type(options_t), intent(in) :: options
      type(run_t), intent(inout) :: runs(:)
      type(process_t) :: process(size(runs))
      integer(int64) :: began(size(runs))
      logical :: running(size(runs)), told
      integer :: i, jobs, next, processors

      processors = 1
      !$ processors = omp_get_num_procs()
      jobs = options%jobs
      if (jobs == 0) jobs = processors
      jobs = min(jobs, size(runs))
      call set_threads(max(1, processors/jobs))
      running = .false.
      told = .false.
      next = 1
      do
         do while (next <= size(runs) .and. count(running) < jobs .and. .not. interrupted())
            call start(options, runs(next), process(next))
            call system_clock(began(next))
            running(next) = .true.
            next = next + 1
         end do
         if (.not. any(running)) exit
         call rest(pause)
         do i = 1, next - 1
            if (.not. running(i)) cycle
            if (interrupted() .and. .not. told) call process(i)%interrupt()
            if (.not. process(i)%ended()) cycle
            running(i) = .false.
            call finish(options, since(began(i)), process(i), runs(i))
            call say_progress(options, runs, next - 1 - count(running), i)
         end do
         told = interrupted()
      end do
   end subroutine run_all

   !> Threads of each run, unless the user says how many.
   subroutine set_threads(number)
      integer, intent(in) :: number
      integer :: length
      call get_environment_variable('OMP_NUM_THREADS', length=length)
      if (length == 0) call set_environment('OMP_NUM_THREADS', text_of(number))
   end subroutine set_threads

   !> Start this program for one run; what it says goes to NAME.log.
   subroutine start(options, run, process)
      type(options_t), intent(in) :: options
      type(run_t), intent(in) :: run
      type(process_t), intent(inout) :: process
      type(arguments_t) :: arguments
      integer :: s
      call arguments%add('run', run%file)
      call arguments%add('--refine', text_of(options%refine))
      call arguments%add('--child')
      if (options%folder /= '') call arguments%add('-o', options%folder(:len(options%folder) - 1))
      do s = 1, size(options%settings)
         call arguments%add('--set', single_setting(options%settings(s), run%choice(s)))
      end do
      if (run%name /= run%base) call arguments%add('--set', "job.name='"//run%name//"'")
      call start_process(process, arguments, options%folder//run%name//'.log')
   end subroutine start

   !> What came of it: from its exit code, the history that it has written, and its last words.
   subroutine finish(options, seconds, process, run)
      type(options_t), intent(in) :: options
      real(wp), intent(in) :: seconds
      type(process_t), intent(in) :: process
      type(run_t), intent(inout) :: run
      type(history_table_t) :: table
      type(error_t), allocatable :: error
      run%code = process%code
      run%seconds = seconds
      if (any(run%code == [exit_ok, exit_incomplete, exit_interrupted])) then
         call read_history(options%folder//run%name//'.history.csv', table, error)
         if (.not. allocated(error)) run%table = table
      end if
      if (run%code /= exit_ok) run%words = last_words(options%folder//run%name//'.log')
   end subroutine finish

   !> That a run has ended, and how many are left.
   subroutine say_progress(options, runs, done, i)
      type(options_t), intent(in) :: options
      type(run_t), intent(in) :: runs(:)
      integer, intent(in) :: done, i
      character(len=*), parameter :: wipe = achar(13)//achar(27)//'[K'
      if (options%quiet) return
      if (is_terminal()) then
         write (output_unit, '(a)', advance='no') wipe//text_of(done)//' of '//text_of(size(runs))//' runs: '//runs(i)%name//' ' &
            //runs(i)%outcome()
         if (done == size(runs)) write (output_unit, '(a)', advance='no') wipe
      else
         write (output_unit, '(a)') text_of(done)//' of '//text_of(size(runs))//': '//runs(i)%name//' '//runs(i)%outcome()
      end if
      flush (output_unit)
   end subroutine say_progress

   !> Seconds since then.
   real(wp) function since(start)
      integer(int64), intent(in) :: start
      integer(int64) :: now, rate
      call system_clock(now, rate)
      since = real(now - start, wp)/rate
   end function since
end module finshell_runs
