!> `finshell study`: an input on coarser and finer meshes, each a run of its own, until the answer is known or the time is over.
!>
!> Rungs are processes of this program. They are started from the cheapest on, side by side as long as there are processors for the
!> threads that pay; a rung that was not predicted from a cheaper one, or would not fit into the budget, is not started.
module finshell_study
   use, intrinsic :: iso_fortran_env, only: error_unit, int64, output_unit
   use finshell_assembly, only: paying_threads
   use finshell_disk, only: remove_in_system, set_environment
   use finshell_error, only: error_t, text_of
   use finshell_input, only: input_t, read_input
   use finshell_interrupt, only: interrupted, watch_interrupts
   use finshell_kinds, only: wp
   use finshell_ladder, only: new_study, predicted_cost, rung_done, rung_failed, rung_left, rung_planned, rung_t, study_t
   use finshell_options, only: exit_incomplete, exit_input, exit_interrupted, exit_ok, options_t
   use finshell_process, only: arguments_t, last_words, make_folder, process_t, rest, start_process
   use finshell_rung, only: read_rung, watch_rung, watches_load
   use finshell_setting, only: single_setting
   use finshell_step, only: control_frequencies, is_mode
   use finshell_study_report, only: label_t, print_study, text_of_seconds, write_study
   use finshell_team, only: leads
!$ use omp_lib, only: omp_get_max_threads
   implicit none
   private
   public :: study

   integer, parameter :: most_coarser = 2, usual_rungs = 4, most_rungs = 8, fewest_elements = 8
   integer, parameter :: first_together = 2 !< rungs that start before any cost is known
   integer, parameter :: pause = 3 !< milliseconds

   type :: running_t
      integer :: rung = 0, threads = 0
      type(process_t) :: process
      integer(int64) :: since = 0
      logical :: stopped = .false., told = .false. !< killed; interrupted
      character(len=:), allocatable :: name !< of its files
   end type running_t

contains

   !> Run all rungs, print what they say and write NAME.study.csv and NAME.study.py.
   subroutine study(options, code)
      type(options_t), intent(in) :: options
      integer, intent(out) :: code
      type(input_t) :: input
      type(rung_t), allocatable :: rungs(:)
      type(label_t), allocatable :: labels(:)
      type(study_t) :: result
      type(error_t), allocatable :: error
      character(len=:), allocatable :: folder
      logical, allocatable :: shown(:)
      logical :: automatic
      real(wp) :: seconds

      code = exit_input
      if (associated(options%team)) then
         if (leads(options%team)) write (error_unit, '(a)') 'finshell: a study runs its meshes as processes of their own: ' &
            //'take finshell, not finshell_mpi'
         return
      end if
      call read_input(options%input, input, error, settings=options%settings)
      if (allocated(error)) then
         write (error_unit, '(a)') 'finshell: '//error%message
         return
      end if
      folder = options%folder//input%name//'.study'
      if (.not. make_folder(folder)) then
         write (error_unit, '(a)') 'finshell: '//folder//': this folder cannot be made'
         return
      end if
      automatic = size(input%monitors) == 0
      call watch_rung(input)
      rungs = planned_rungs(options)
      if (.not. options%quiet) write (output_unit, '(a)') 'Study of '//options%input//': '//text_of(size(rungs)) &
         //' meshes from level '//text_of(rungs(1)%level)//' on; level 0 is that of the input, with ' &
         //text_of(size(input%structure%mesh%triangles, 2))//' elements. Budget '//text_of_seconds(options%budget)
      call watch_interrupts(.not. options%quiet)
      call climb(options, folder, input, automatic, rungs, seconds)
      shown = shown_columns(rungs, input, automatic)
      call select_columns(rungs, shown)
      labels = labels_of(input, shown)
      call new_study(result, rungs, options%accuracy, labels%kind)
      call print_study(options, rungs, labels, result, seconds)
      call write_study(options%folder//input%name//'.study', rungs, labels, result, error)
      code = exit_ok
      if (count(rungs%state == rung_done) < 2) code = exit_incomplete
      if (interrupted()) code = exit_interrupted
      if (.not. allocated(error)) return
      write (error_unit, '(a)') 'finshell: '//error%message
      code = exit_incomplete
   end subroutine study

   !> Meshes coarser than that of the input where there are some, itself, and finer ones.
   function planned_rungs(options) result(rungs)
      type(options_t), intent(in) :: options
      type(rung_t), allocatable :: rungs(:)
      type(input_t) :: input
      type(error_t), allocatable :: error
      integer :: coarser, lowest, n
      coarser = 0
      do while (coarser < most_coarser)
         call read_input(options%input, input, error, -coarser - 1, settings=options%settings)
         if (allocated(error)) exit
         if (size(input%structure%mesh%triangles, 2) < fewest_elements) exit
         coarser = coarser + 1
      end do
      n = usual_rungs
      lowest = -coarser
      if (options%levels > 0) then
         n = options%levels
         lowest = max(lowest, min(0, 2 - n))
      end if
      allocate (rungs(n))
      rungs%level = [(lowest + n, n=0, size(rungs) - 1)]
   end function planned_rungs

   !> Start rungs and wait for them, until all are done, or the accuracy is met, or the time is over.
   subroutine climb(options, folder, input, automatic, rungs, seconds)
      type(options_t), intent(in) :: options
      character(len=*), intent(in) :: folder
      type(input_t), intent(in) :: input
      logical, intent(in) :: automatic !< no monitors in the input
      type(rung_t), allocatable, intent(inout) :: rungs(:)
      real(wp), intent(out) :: seconds !< elapsed
      type(running_t), allocatable :: running(:)
      integer(int64) :: start
      integer :: base, i, most, next, threads
      logical :: enough

      call system_clock(start)
      base = size(input%structure%mesh%triangles, 2)
      most = 1
      !$ most = omp_get_max_threads()
      allocate (running(0))
      next = 1
      enough = .false.
      do
         ! start what can be started
         if (interrupted() .and. next <= size(rungs)) then
            rungs(next:)%state = rung_left
            rungs(next)%reason = 'not run: interrupted'
            next = size(rungs) + 1
         end if
         do while (next <= size(rungs) .and. .not. enough)
            associate (rung => rungs(next))
               threads = min(most, wanted_threads(input%threads, base*4.0_wp**rung%level))
               if (size(running) > 0 .and. sum(running%threads) + threads > most) exit
               rung%predicted = predicted_cost(rungs, rung%level)
               if (rung%predicted < 0 .and. next > first_together .and. size(running) > 0) exit
               if (rung%predicted > options%budget - since(start)) then
                  if (size(running) > 0) exit ! what ends now may tell better
                  rung%reason = 'not run: it would take about '//text_of_seconds(rung%predicted)//', and ' &
                     //text_of_seconds(max(0.0_wp, options%budget - since(start)))//' of the budget are left'
                  rungs(next:)%state = rung_left
                  next = size(rungs) + 1
                  exit
               end if
               if (.not. options%quiet) call announce(rung)
               running = [running, running_t(next, threads, process_t())]
               call start_rung(options, folder, rung%level, threads, running(size(running)))
            end associate
            next = next + 1
         end do
         if (size(running) == 0) exit
         call rest(pause)
         do i = size(running), 1, -1
            if (since(start) > options%budget .and. .not. running(i)%stopped) then
               call running(i)%process%stop()
               running(i)%stopped = .true.
            end if
            if (interrupted() .and. .not. running(i)%told) call running(i)%process%interrupt()
            running(i)%told = interrupted()
            if (.not. running(i)%process%ended()) cycle
            call finish_rung(folder, size(input%monitors) + 1, running(i), rungs(running(i)%rung))
            if (.not. options%quiet) call announce(rungs(running(i)%rung))
            running = [running(:i - 1), running(i + 1:)]
            if (options%accuracy_given) enough = is_enough()
            if (enough) rungs(next:)%state = rung_left
            if (size(running) == 0 .and. next > size(rungs) .and. .not. enough) call add_rung()
         end do
      end do
      seconds = since(start)

   contains

      !> Is a rung good enough, and are all estimates worth something?
      logical function is_enough()
         type(rung_t), allocatable :: chosen(:)
         type(study_t) :: so_far
         type(label_t), allocatable :: labels(:)
         chosen = rungs
         labels = labels_of(input, shown_columns(rungs, input, automatic))
         call select_columns(chosen, shown_columns(rungs, input, automatic))
         is_enough = .false.
         if (count(rungs%state == rung_done) < 3) return
         call new_study(so_far, chosen, options%accuracy, labels%kind)
         is_enough = so_far%trusted .and. so_far%advised > 0
      end function is_enough

      !> An accuracy was asked for and is not met: one mesh more, if the user did not say how many.
      subroutine add_rung()
         if (interrupted() .or. .not. options%accuracy_given .or. options%levels > 0 .or. size(rungs) >= most_rungs) return
         if (rungs(size(rungs))%state /= rung_done) return
         rungs = [rungs, rung_t(rungs(size(rungs))%level + 1)]
      end subroutine add_rung
   end subroutine climb

   !> Processes side by side cost nothing, threads wait for each other: small meshes get one.
   integer function wanted_threads(given, elements) result(threads)
      integer, intent(in) :: given !< in the input
      real(wp), intent(in) :: elements
      real(wp), parameter :: many = 2.0e4_wp
      threads = 1
      if (elements > many) threads = paying_threads(int(min(1.0e8_wp, elements)))
      if (given > 0) threads = given
   end function wanted_threads

   !> Seconds since then.
   real(wp) function since(start)
      integer(int64), intent(in) :: start
      integer(int64) :: now, rate
      call system_clock(now, rate)
      since = real(now - start, wp)/rate
   end function since

   !> Run this program for one mesh. It writes into the folder: its history, what it says (.log), and what came out (.rung).
   subroutine start_rung(options, folder, level, threads, running)
      type(options_t), intent(in) :: options
      character(len=*), intent(in) :: folder
      integer, intent(in) :: level, threads
      type(running_t), intent(inout) :: running
      type(arguments_t) :: arguments
      integer :: i
      running%name = 'level_'//text_of(level)
      call remove_in_system(folder//'/'//running%name//'.rung')
      call set_environment('OMP_NUM_THREADS', text_of(threads))
      call arguments%add('run', options%input)
      call arguments%add('--refine', text_of(level))
      call arguments%add('--rung', running%name)
      call arguments%add('-o', folder)
      call arguments%add('-q')
      do i = 1, size(options%settings)
         call arguments%add('--set', single_setting(options%settings(i), 1))
      end do
      call system_clock(running%since)
      call start_process(running%process, arguments, folder//'/'//running%name//'.log')
   end subroutine start_rung

   !> What came of it.
   subroutine finish_rung(folder, number, running, rung)
      character(len=*), intent(in) :: folder
      integer, intent(in) :: number !< of values
      type(running_t), intent(in) :: running
      type(rung_t), intent(inout) :: rung
      rung%seconds = running%process%seconds
      rung%elapsed = since(running%since)
      rung%state = rung_failed
      if (running%stopped) then
         rung%reason = 'stopped at the end of the budget'
      else if (running%process%code /= 0) then
         rung%reason = last_words(folder//'/'//running%name//'.log')
         if (rung%reason == '') rung%reason = 'the process ended with code '//text_of(running%process%code)
      else if (read_rung(folder//'/'//running%name//'.rung', number, rung)) then
         rung%state = rung_done
      else
         rung%reason = folder//'/'//running%name//'.rung is not whole'
      end if
   end subroutine finish_rung

   !> Say that a rung begins, at what cost, or how it ended.
   subroutine announce(rung)
      type(rung_t), intent(in) :: rung
      character(len=:), allocatable :: text
      text = '  level '//text_of(rung%level)//': '
      select case (rung%state)
      case (rung_planned)
         text = text//'begins'
         if (rung%predicted >= 0) text = text//', about '//text_of_seconds(rung%predicted)//' of CPU time'
      case (rung_done)
         text = text//text_of(rung%elements)//' elements, '//text_of_seconds(rung%seconds)//' of CPU time'
      case default
         text = text//'FAILED: '//rung%reason
      end select
      write (output_unit, '(a)') text
      flush (output_unit)
   end subroutine announce

   !> Which columns count: the monitors, or of those that were added the largest in the finest mesh (none of a mode, which
   !> has no size), and the load factor where it is an answer.
   function shown_columns(rungs, input, automatic) result(shown)
      type(rung_t), intent(in) :: rungs(:)
      type(input_t), intent(in) :: input
      logical, intent(in) :: automatic
      logical :: shown(size(input%monitors) + 1)
      integer :: finest
      shown = .true.
      shown(size(shown)) = watches_load(input%steps(size(input%steps)))
      if (.not. automatic) return
      shown(:size(input%monitors)) = .false.
      if (is_mode(input%steps(size(input%steps))%control)) return
      finest = findloc(rungs%state == rung_done, .true., dim=1, back=.true.)
      if (finest == 0) then
         shown(1) = .true.
      else
         shown(maxloc(abs(rungs(finest)%values(:size(input%monitors))), dim=1)) = .true.
      end if
   end function shown_columns

   subroutine select_columns(rungs, shown)
      type(rung_t), intent(inout) :: rungs(:)
      logical, intent(in) :: shown(:)
      integer :: i
      do i = 1, size(rungs)
         if (rungs(i)%state /= rung_done) cycle
         rungs(i)%values = pack(rungs(i)%values, shown)
         rungs(i)%missing = pack(rungs(i)%missing, shown)
      end do
   end subroutine select_columns

   !> Names of the columns of a rung that are shown: monitors and load factor.
   function labels_of(input, shown) result(labels)
      type(input_t), intent(in) :: input
      logical, intent(in) :: shown(:)
      type(label_t), allocatable :: labels(:)
      integer :: i, k
      allocate (labels(count(shown)))
      k = 0
      do i = 1, size(shown)
         if (.not. shown(i)) cycle
         k = k + 1
         if (i <= size(input%monitors)) then
            labels(k)%name = input%monitors(i)%name
            labels(k)%kind = input%monitors(i)%quantity
         else
            labels(k)%name = 'load_factor'
            if (input%steps(size(input%steps))%control == control_frequencies) labels(k)%name = 'frequency'
            labels(k)%kind = -1
         end if
      end do
   end function labels_of
end module finshell_study
