!> Stages: between steps supports, loads and growths come and go.
!>
!> The equations are numbered anew, the state stays. A support that comes holds its nodes where they are, and moves them by what its
!> factor changes from then on. What is out of balance - reactions of supports that have gone, loads that have come or gone - is
!> balanced by nodal forces that are let go before the step, from all of them to none, under load control (finshell_path): the path
!> goes on without a jump, whatever the step itself prescribes.
module finshell_stage
   use finshell_balance, only: tangent_t
   use finshell_equations, only: scatter
   use finshell_held_motion, only: anchor
   use finshell_equilibrium, only: equilibrium_t, new_equilibrium
   use finshell_error, only: error_t
   use finshell_factor, only: factors_at
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_kinds, only: wp
   use finshell_load_case, only: arrange_cases, case_of_steps
   use finshell_memo, only: memo_t
   use finshell_path, only: path_t
   use finshell_predictor, only: history_t
   use finshell_stability, only: stability_t
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: is_same_stage, change_stage, forget_path, let_go, carry_stage

contains

   !> Are the same loads and supports there in two steps?
   pure logical function is_same_stage(structure, one, other) result(same)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: one, other !< steps
      same = .true.
      if (allocated(structure%supports)) &
         same = all(structure%supports%span%covers(one) .eqv. structure%supports%span%covers(other))
      if (allocated(structure%loads)) &
         same = same .and. all(structure%loads%span%covers(one) .eqv. structure%loads%span%covers(other))
      if (allocated(structure%growths)) same = same .and. &
         all(structure%growths%list%span%covers(one) .eqv. structure%growths%list%span%covers(other))
   end function is_same_stage

   !> Go from an equilibrium state to the loads and supports of a step. Errors: those of `new_equilibrium`.
   subroutine change_stage(problem, step, error)
      type(equilibrium_t), intent(inout) :: problem
      integer, intent(in) :: step
      type(error_t), allocatable, intent(out) :: error
      integer :: case
      case = case_of_steps(problem)
      call renumber(problem, step, error)
      if (allocated(error)) return
      call anchor(problem%equations, problem%state%rotation, factors_at(problem%state, size(problem%equations%motion, 3)))
      call arrange_cases(problem, case)
      call problem%evaluate(.false., error)
      if (.not. allocated(error)) call problem%accept()
   end subroutine change_stage

   !> Equations and loads of a step, with the state as it is; the first case is that of the steps.
   subroutine renumber(problem, step, error)
      type(equilibrium_t), intent(inout) :: problem
      integer, intent(in) :: step
      type(error_t), allocatable, intent(out) :: error
      type(state_t) :: state
      call arrange_cases(problem, 1)
      state = problem%state
      problem%stage = step
      if (allocated(problem%released)) deallocate (problem%released)
      call new_equilibrium(problem, problem%structure, error)
      if (allocated(error)) return
      problem%state = state
      problem%state%stage = step
      problem%base = problem%state
      problem%iterate = problem%state
   end subroutine renumber

   !> The equations have been numbered anew: vectors over them mean nothing any more.
   pure subroutine forget_path(path)
      type(path_t), intent(inout) :: path
      path%history = history_t()
      path%tangent = tangent_t()
      path%stability = stability_t()
      path%underway = .false.
      path%kinked = .false.
      if (allocated(path%branch)) deallocate (path%branch)
      if (allocated(path%refused)) deallocate (path%refused)
      if (allocated(path%overshoot)) deallocate (path%overshoot)
   end subroutine forget_path

   !> Balance what is out of balance by forces that are to be let go, unless it is less than a part of the loads and reactions.
   subroutine let_go(problem, part, error)
      type(equilibrium_t), intent(inout) :: problem !< evaluated at its state
      real(wp), intent(in) :: part
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: nodal(:, :)
      logical :: much
      allocate (nodal(n_nodal, size(problem%state%displacement, 2)))
      call scatter(problem%equations, -problem%residual, nodal)
      much = norm2(nodal(ux:uz, :)) > part*problem%force_level .or. norm2(nodal(rx:rz, :)) > part*problem%moment_level
      if (.not. much) return
      problem%released = nodal
      problem%state%release_factor = 1
      call problem%external%let_go(nodal)
      call problem%evaluate(.false., error)
      if (.not. allocated(error)) call problem%accept()
   end subroutine let_go

   !> The stage of a problem and its case, before its state. Errors when reading leave the memo not whole.
   subroutine carry_stage(memo, problem)
      type(memo_t), intent(inout) :: memo
      type(equilibrium_t), intent(inout) :: problem
      type(error_t), allocatable :: error
      integer :: case, stage
      stage = problem%stage
      case = case_of_steps(problem)
      call memo%carry(stage)
      call memo%carry(problem%may_float)
      call memo%carry(case)
      if (memo%reading .and. memo%whole) then
         if (.not. is_same_stage(problem%structure, stage, problem%stage)) call renumber(problem, stage, error)
         problem%stage = stage
         memo%whole = .not. allocated(error)
         if (memo%whole) call arrange_cases(problem, case)
      end if
      call memo%carry(problem%equations%anchor_rotation)
      call memo%carry(problem%equations%anchor_factor)
      call memo%carry(problem%released)
      if (memo%reading .and. allocated(problem%released)) call problem%external%let_go(problem%released)
   end subroutine carry_stage
end module finshell_stage
