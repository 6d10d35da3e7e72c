!> The program: command line, then input -> model -> path -> results.
module finshell_driver
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use finshell_adaptation, only: adapt
   use finshell_bisection, only: bisection_t
   use finshell_job, only: follow_steps
   use finshell_kinds, only: dp, wp
   use finshell_effort_report, only: print_effort
   use finshell_disk, only: write_failures_return
   use finshell_blas_threads, only: to_openmp
   use finshell_checkpoint, only: restore
   use finshell_coarser_advice, only: coarser_advice
   use finshell_convert, only: convert
   use finshell_law_report, only: report_law
   use finshell_check_report, only: print_check
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_help, only: print_completion, print_help, print_manual
   use finshell_history_view, only: show_history
   use finshell_imperfect, only: apply_given, apply_modes
   use finshell_info, only: show_info
   use finshell_input, only: input_t, read_input
   use finshell_input_imperfection, only: modes_end
   use finshell_interrupt, only: watch_interrupts
   use finshell_iteration_log, only: iteration_log_t
   use finshell_mesh_report, only: report_mesh
   use finshell_monitor, only: restart_none
   use finshell_monitoring, only: slack_share
   use finshell_options, only: exit_incomplete, exit_input, exit_interrupted, exit_ok, options_t, read_command_line
   use finshell_observer, only: stop_is_wanted
   use finshell_path, only: path_t
   use finshell_preparation, only: prepare
   use finshell_process, only: end_with_parent
   use finshell_reporter, only: reporter_t
   use finshell_resume, only: find_record, new_head, resume_t, resumed_input
   use finshell_restart_file, only: restart_head_t
   use finshell_rung, only: watch_rung, write_rung
   use finshell_runs, only: is_several, several_runs
   use finshell_sensitivity_models, only: prepare_sensitivities
   use finshell_speaker, only: speaker_t
   use finshell_step, only: is_in_time
   use finshell_structure, only: remembers
   use finshell_status, only: status_input_error
   use finshell_study, only: study
   use finshell_team, only: agree, leads, team_t
   use finshell_thread_choice, only: choose_threads
   use finshell_trial, only: warning_of, mesh_warning
   use finshell_version, only: version
   implicit none
   private
   public :: main

   !> Commands that are no work to share.
   character(len=10), parameter :: for_one(*) = [character(len=10) :: 'mesh', 'check-law', 'convert', 'info', 'history', &
                                                        'completion', 'man']

contains

   !> Run the program; `code` is its exit code: 0 done, 1 the analysis stopped early (results so far are kept), 2 wrong input.
   subroutine main(code, team)
      integer, intent(out) :: code
      class(team_t), intent(in), target, optional :: team !< processes that share the work, each of which calls
      type(options_t) :: options
      character(len=:), allocatable :: complaint

      call read_command_line(options, complaint)
      if (present(team)) options%team => team
      code = exit_input
      if (allocated(complaint)) then
         if (leads(options%team)) write (error_unit, '(a)') 'finshell: '//complaint, 'Try: finshell --help'
         return
      end if
      if (any(options%command == for_one) .and. .not. leads(options%team)) then
         code = exit_ok ! the first process of a team does it
         return
      end if
      select case (options%command)
      case ('run')
         if (is_several(options)) then
            call run_several(options, code)
         else
            call run(options, .true., code)
         end if
      case ('check'); call run(options, .false., code)
      case ('study'); call study(options, code)
      case ('convert'); call convert(options, code)
      case ('check-law'); call report_law(options, code)
      case ('mesh'); call report_mesh(options, code)
      case ('restart'); call run(options, .true., code)
      case ('info'); call show_info(options, code)
      case ('history'); call show_history(options, code)
      case ('man')
         call print_manual()
         code = exit_ok
      case ('completion')
         if (print_completion(options%input)) code = exit_ok
         if (code /= exit_ok) write (error_unit, '(a)') "finshell: no completion for '"//options%input &
            //"'; expected bash, zsh or fish"
      case ('version')
         if (leads(options%team)) write (output_unit, '(a)') 'finshell '//version
         code = exit_ok
      case default
         if (leads(options%team)) call print_help()
         code = exit_ok
      end select
   end subroutine main

   !> Several runs are processes of their own.
   subroutine run_several(options, code)
      type(options_t), intent(in) :: options
      integer, intent(out) :: code
      code = exit_input
      if (associated(options%team)) then
         if (leads(options%team)) write (error_unit, '(a)') 'finshell: several runs are processes of their own: take finshell, ' &
            //'not finshell_mpi'
      else
         call several_runs(options, code)
      end if
   end subroutine run_several

   !> Check the input and, with `solve`, follow the path through all steps.
   subroutine run(options, solve, code)
      type(options_t), intent(inout) :: options
      logical, intent(in) :: solve
      integer, intent(out) :: code
      type(input_t), target :: input
      type(equilibrium_t), target :: problem
      type(path_t), target :: path
      type(reporter_t), target :: reporter
      type(iteration_log_t), target :: log
      type(resume_t) :: resume
      type(restart_head_t) :: head
      type(speaker_t) :: speaker
      type(bisection_t) :: bisection
      type(error_t), allocatable :: error, late
      real(wp), allocatable :: levels(:)
      character(len=:), allocatable :: advice
      logical :: speaks, stopped
      integer :: first, i

      code = exit_input
      speaks = leads(options%team)
      if (options%child .or. allocated(options%rung)) call end_with_parent()
      call to_openmp()
      call write_failures_return()
      if (options%command == 'restart') then
         if (associated(options%team)) call raise(error, status_input_error, 'a run goes on in one process: take finshell, not ' &
                                                  //'finshell_mpi')
         if (.not. allocated(error)) call find_record(options, resume, error)
         if (.not. allocated(error)) call resumed_input(options, resume, input, error)
      else
         if (solve .and. .not. allocated(options%rung)) then
            call read_input(options%input, input, error, options%refine, bisection, options%settings)
         else
            call read_input(options%input, input, error, options%refine, settings=options%settings)
         end if
         call apply_given(input, error)
      end if
      call agree(options%team, error)
      if (complain(error, speaks)) return
      if (allocated(options%rung)) then
         input%name = options%rung
         call watch_rung(input)
         if (allocated(input%accuracy)) deallocate (input%accuracy) ! a study refines as a whole
      end if
      if (associated(options%team)) call check_team(input, error)
      if (complain(error, speaks)) return
      i = size(input%structure%mesh%triangles, 2)
      if (allocated(input%accuracy)) i = i*4**input%accuracy%coarser
      call choose_threads(input%threads, i)
      call prepare(input, problem, options%team, error)
      if (complain(error, speaks)) return
      call prepare_sensitivities(input, options%refine, associated(options%team), problem, reporter%sensitivities, error)
      if (complain(error, speaks)) return
      if (speaks) then
         call warn(warning_of(input, problem))
         call warn(mesh_warning(input))
         if (.not. options%quiet) call print_model(options, input, problem)
      end if
      if (.not. solve) then
         if (speaks .and. .not. options%quiet) call print_check(input, problem)
         if (.not. options%quiet) call print_effort(problem, options%factor, speaks, error)
         if (complain(error, speaks)) return
         if (speaks) write (output_unit, '(a)') 'The input is complete and consistent.'
         code = exit_ok
         return
      end if

      allocate (levels(0))
      do i = 1, size(input%steps)
         if (allocated(input%steps(i)%load_levels)) levels = [levels, input%steps(i)%load_levels]
         if (.not. is_in_time(input%steps(i)%control)) levels = [levels, input%steps(i)%final_load_factor]
      end do
      reporter%quiet = options%quiet
      reporter%cases = input%factors
      reporter%duration = sum(input%steps%time%duration)
      if (allocated(input%accuracy)) reporter%mesh = 1
      if (allocated(input%accuracy)) reporter%judged = input%accuracy%judged
      if (allocated(input%accuracy)) input%outputs(1)%restart = restart_none
      first = 1
      head = new_head(options, input)
      if (modes_end(input%imperfections) > 0) then
         call apply_modes(input, problem, speaks .and. .not. options%quiet, error)
         call agree(options%team, error)
         if (complain(error, speaks)) return
         first = modes_end(input%imperfections) + 1
      end if
      reporter%energy = input%outputs(1)%energy
      path%account%kept = reporter%energy
      if (allocated(resume%numbers)) then
         call restore(resume%numbers, problem, path, first, error)
         if (complain(error, speaks)) return
         reporter%continued = resume%increment
         reporter%continues = options%folder//input%name == resume%base
         if (.not. options%quiet) write (output_unit, '(a)') 'Goes on after increment '//text_of(resume%increment)//' of ' &
            //resume%base
      end if
      if (speaks) call reporter%checkpoint%attach(problem, path, input%outputs(1)%restart, head)
      reporter%checkpoint%step = first
      call watch_interrupts(speaks .and. .not. options%quiet) ! from here on there is something to keep
      if (speaks .and. (input%outputs(1)%verbose .or. options%verbose)) then
         call log%open(options%folder//input%name//'.iterations.log', options%quiet, reporter%continues, error)
         problem%listener => log
      end if
      if (speaks .and. .not. allocated(error)) &
         call reporter%open(options%folder//input%name, input%text, problem, input%monitors, input%outputs, &
                            input%probes, levels, error)
      if (reporter%continues .and. input%outputs(1)%fields .and. .not. allocated(error)) &
         call reporter%parts(1)%file%log_line('went on after increment '//text_of(reporter%continued), error)
      call agree(options%team, error)
      if (complain(error, speaks)) return
      call speaker%take(reporter, options%team)
      if (allocated(input%accuracy)) speaker%stations%wanted = input%accuracy%coarser > 0
      call follow_steps(input%steps, problem, path, reporter, speaker, error, input%velocity, first)
      if (allocated(input%accuracy) .and. .not. allocated(error)) &
         call adapt(options, bisection, input, problem, path, reporter, speaker, error)
      call speaker%line%clear()
      stopped = .false.
      if (allocated(error)) stopped = error%code == stop_is_wanted
      if (stopped .and. speaks .and. allocated(path%course)) then
         call reporter%checkpoint%note(.false., .true., late)
         ! between two rows the fields are those of neither
         if (abs(problem%state%time - reporter%last%motion%time) > 0) then
            reporter%parts%last_written = reporter%last%increment
            reporter%probes%last_written = reporter%last%increment
         end if
      end if
      if (stopped) error%message = interrupt_text(options, input)
      if (speaks .and. input%outputs(1)%fields) call reporter%parts(1)%file%log_line(ending_text(error), late)
      if (speaks) call reporter%finish(problem%state, late)
      nullify (problem%listener)
      call log%close()
      if (.not. allocated(error) .and. allocated(late)) call move_alloc(late, error)
      if (allocated(options%rung) .and. allocated(reporter%final)) call write_rung(options%folder//options%rung//'.rung', &
         size(input%structure%mesh%coordinates, 2), size(input%structure%mesh%triangles, 2), problem%n, path%iterations, &
         reporter%final, error)
      if (speaks .and. allocated(reporter%sensitivities)) call warn(reporter%sensitivities%complaint())
      if (speaks) call print_summary(options, input, problem, path, reporter, allocated(error))
      if (speaks .and. .not. (allocated(error) .or. options%quiet)) then
         advice = coarser_advice(options, input, problem%n, path%iterations)
         if (advice /= '') write (output_unit, '(a)') advice
      end if
      code = exit_ok
      if (complain(error, speaks)) code = merge(exit_interrupted, exit_incomplete, stopped)
   end subroutine run

   !> What can be done after an interrupt.
   function interrupt_text(options, input) result(text)
      type(options_t), intent(in) :: options
      type(input_t), intent(in) :: input
      character(len=:), allocatable :: text
      text = 'interrupted: finshell restart '//options%folder//input%name//' goes on from here'
      if (input%outputs(1)%restart == restart_none) text = 'interrupted; this run cannot go on, as it keeps nothing for a restart' &
         //trim(merge(' (&accuracy)                  ', ' (restart = ''none'' in &output)', allocated(input%accuracy)))
   end function interrupt_text

   !> How a run has ended, for the results.
   function ending_text(error) result(text)
      type(error_t), allocatable, intent(in) :: error
      character(len=:), allocatable :: text
      text = 'done'
      if (.not. allocated(error)) return
      text = 'stopped early: '//error%message
      if (error%code == stop_is_wanted) text = 'interrupted'
   end function ending_text

   !> Print an error, if there is one and this process speaks.
   logical function complain(error, speaks)
      type(error_t), allocatable, intent(in) :: error
      logical, intent(in) :: speaks
      complain = allocated(error)
      if (complain .and. speaks) write (error_unit, '(a)') 'finshell: '//error%message
   end function complain

   !> Refuse what one process does alone.
   subroutine check_team(input, error)
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error
      integer :: step
      step = findloc(is_in_time(input%steps%control), .true., dim=1)
      if (allocated(input%accuracy)) then
         call refuse(':'//text_of(input%accuracy%line)//': &accuracy: meshes are refined')
      else if (step > 0) then
         call refuse(':'//text_of(input%step_lines(step))//': &step: steps in time run')
      else if (remembers(input%structure)) then
         call refuse(': &material: laws with states run')
      end if
   contains
      subroutine refuse(what)
         character(len=*), intent(in) :: what
         call raise(error, status_input_error, input%file//what//' in one process: take finshell, not finshell_mpi')
      end subroutine refuse
   end subroutine check_team

   !> Say it, if there is something.
   subroutine warn(text)
      character(len=*), intent(in) :: text
      if (text /= '') write (error_unit, '(a)') 'finshell: warning: '//text
   end subroutine warn

   subroutine print_model(options, input, problem)
      type(options_t), intent(in) :: options
      type(input_t), intent(in) :: input
      type(equilibrium_t), intent(in) :: problem
      if (len(input%title) > 0) write (output_unit, '(a)') input%title
      write (output_unit, '(5(a,i0),a)') 'finshell '//version//': ', size(input%structure%mesh%coordinates, 2), ' nodes, ', &
         size(input%structure%mesh%triangles, 2), ' elements, ', problem%n, ' unknowns, ', size(input%structure%sections), &
         ' section(s), ', size(input%steps), ' step(s)'
      if (allocated(input%structure%mesh%notes)) then
         if (input%structure%mesh%notes /= '') write (output_unit, '(a)') 'Mesh: '//input%structure%mesh%notes
      end if
      if (input%preset%given) write (output_unit, '(a)') input%preset%summary()
      if (associated(options%team)) write (output_unit, '(i0,a)') options%team%members, ' processes share the work'
   end subroutine print_model

   !> What was reached, at what cost, and what to be careful about.
   subroutine print_summary(options, input, problem, path, reporter, failed)
      type(options_t), intent(in) :: options
      type(input_t), intent(in) :: input
      type(equilibrium_t), intent(in) :: problem
      type(path_t), intent(in) :: path
      type(reporter_t), intent(in) :: reporter
      logical, intent(in) :: failed
      real(dp) :: seconds
      character(len=:), allocatable :: until
      integer :: i

      call cpu_time(seconds)
      until = ''
      if (reporter%duration > 0) until = ', time '//text_of(problem%state%time)
      if (failed) then
         write (output_unit, '(a,g0.7,a)') 'STOPPED EARLY at load factor ', problem%state%load_factor, &
            until//'; everything up to there has been written.'
      else
         write (output_unit, '(a,g0.7,a)') 'Done: load factor ', problem%state%load_factor, until
      end if
      if (reporter%linear > 0) write (output_unit, '(i0,a)') reporter%linear, &
         ' linear solutions or modes, which leave the state as it is'
      if (reporter%switched > 0) write (output_unit, '(i0,a)') reporter%switched, &
         ' linear or buckling steps in which fibres act where the linear solution stretches them, and are slack elsewhere'
      if (reporter%moved > 0) write (output_unit, '(i0,a)') reporter%moved, ' reported increments in time'
      write (output_unit, '(3(i0,a),f0.2,a)') path%increments, ' increments, ', path%iterations, ' iterations, ', path%cuts, &
         ' cuts, ', seconds, ' s of CPU time'
      if (path%increments > 0) write (output_unit, '(a)') 'Worst accuracy of an increment: residual '//text_of(reporter%residual) &
         //' of the loads and reactions, correction '//text_of(reporter%correction)//' of the increment'
      if (reporter%relative_error >= 0) write (output_unit, '(a,g0.3,a)') 'Estimated relative error in energy norm: ', &
         100*reporter%relative_error, ' %'
      if (reporter%rounded > 0) write (output_unit, '(i0,a)') reporter%rounded, &
         ' increments came to rest at the limit of rounding, above the tolerance that was asked for.'
      if (reporter%rounded > 0 .and. reporter%residual > 0.01_wp) write (output_unit, '(a)') &
         'Their loads and reactions are hardly more than rounding: a rigid motion, or loads too small for this stiffness.'
      if (reporter%critical_points > 0) write (output_unit, '(i0,a)') reporter%critical_points, &
         ' limit or bifurcation points were passed (column critical_point of the history).'
      if (reporter%descents > 0) write (output_unit, '(i0,a)') reporter%descents, &
         ' increments were found by a descent to a stable state, where Newton''s iteration failed; others may exist.'
      if (reporter%relaxations > 0) write (output_unit, '(3(i0,a))') reporter%relaxations, &
         ' increments were found by dynamic relaxation in ', reporter%steps, ' steps, the first is number ', &
         reporter%first_relaxed, ' (column found_by of the history): no path leads there.'
      if (reporter%stabilisation > 0) write (output_unit, '(a,g0.3,a)') 'Stabilisation took ', 100*reporter%stabilisation, &
         ' % of the stored energy on the way; states at load levels and at the end are in equilibrium without it.'
      if (reporter%snaps > 0) write (output_unit, '(2(i0,a))') reporter%snaps, &
         ' increments SNAPPED to another state, the first is number ', reporter%first_snap, &
         ' (column snap of the history): what follows may lie on another branch. Follow the path by arc-length to see it.'
      if (reporter%unstable > 0) write (output_unit, '(i0,a)') reporter%unstable, &
         ' increments had negative pivots: under dead load these states are unstable (see the history).'
      if (problem%solver%on_disk()) write (output_unit, '(a)') 'The factors of the matrix were kept on disk.'
      if (problem%crumples .and. (reporter%descents + reporter%relaxations + reporter%snaps + reporter%unstable > 0)) &
         write (output_unit, '(a)') 'Membranes bear compression here, and under it they fold from element to element: the result ' &
         //'depends on the mesh. Let them wrinkle (wrinkling = .true. in &section).'
      if (path%increments > 0 .and. any(input%structure%sections%wrinkling)) write (output_unit, '(a)') &
         'Sheets that wrinkle hold '//text_of(real(slack_share(problem), dp)) &
         //' of their energy by what is left of their stiffness against compression (slack in &section).'
      do i = 1, size(reporter%gaps)
         write (output_unit, '(a,i0,a)') 'Missing in '//reporter%gaps(i)%name//': ', reporter%gaps(i)%values, &
            ' values, written as NaN: the law ends before the surface, or there is no such layer or fibre (doc/namelist.md).'
      end do
      write (output_unit, '(a)') 'Results: '//options%folder//input%name//'.history.csv' &
         //merge(', .vtkhdf, .xdmf', '                ', input%outputs(1)%fields)
   end subroutine print_summary
end module finshell_driver
