!> States on their way from a mesh to the next (&accuracy): cut elements, carry over, bring to equilibrium.
module finshell_carrying
   use finshell_bisection, only: bisect, bisection_t
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_input, only: input_t, read_input
   use finshell_input_normals, only: crease_edges_of
   use finshell_observer, only: record_t
   use finshell_options, only: options_t
   use finshell_path, only: path_t
   use finshell_reporter, only: reporter_t
   use finshell_resettle, only: resettle
   use finshell_speaker, only: speaker_t
   use finshell_state_transfer, only: carry_over, hold_supports
   use finshell_stations, only: station_t
   use finshell_step, only: control_linear, prescribes_monitored, step_t
   use finshell_stress_transfer, only: in_order_of, inherit_resultants, resultants_of
   use finshell_structure, only: turning_nodes
   implicit none
   private
   public :: carry_on, end_of, find_stress, is_linear, settle

contains

   !> Are all steps linear?
   pure logical function is_linear(input)
      type(input_t), intent(in) :: input
      is_linear = all(input%steps%control == control_linear)
   end function is_linear

   !> The state of a mesh at the end of its steps.
   function end_of(input, problem) result(station)
      type(input_t), intent(in) :: input
      type(equilibrium_t), intent(in) :: problem
      type(station_t) :: station
      station%state = problem%state
      station%stable = problem%negative_pivots == 0
      if (prescribes_monitored(input%steps(size(input%steps))%control)) station%value = problem%monitored(problem%state)
   end function end_of

   !> Resultants of the elements, which go over with the states.
   subroutine find_stress(problem, input, carried)
      type(equilibrium_t), intent(in) :: problem
      type(input_t), intent(in) :: input
      type(station_t), intent(inout) :: carried(:)
      integer :: i
      do i = 1, size(carried)
         carried(i)%stress = resultants_of(problem%assembly, input%structure, carried(i)%state)
      end do
   end subroutine find_stress

   !> Cut elements and carry states over.
   subroutine carry_on(options, bisection, before, carried, next, error, marked)
      type(options_t), intent(in) :: options
      type(bisection_t), intent(inout) :: bisection
      type(input_t), intent(in) :: before
      type(station_t), intent(inout) :: carried(:)
      type(input_t), intent(out) :: next
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: marked(:) !< absent: all
      integer :: i
      call cut(bisection, before, marked)
      call read_input(options%input, next, error, options%refine, bisection, options%settings)
      if (allocated(error) .or. is_linear(before)) return
      associate (old => before%structure)
         do i = 1, size(carried)
            carried(i)%state = carry_over(carried(i)%state, old%mesh, turning_nodes(old), bisection%ends, next%structure%mesh)
            carried(i)%stress = inherit_resultants(carried(i)%stress, old%mesh, bisection%parent, next%structure%mesh)
         end do
      end associate
   end subroutine carry_on

   !> Cut the marked elements, or all in four.
   subroutine cut(bisection, input, marked)
      type(bisection_t), intent(inout) :: bisection
      type(input_t), intent(in) :: input
      logical, intent(in), optional :: marked(:)
      associate (structure => input%structure, normals => input%normals)
         ! normals of a file were read after the mesh
         if (allocated(structure%mesh%normal)) bisection%mesh%normal = structure%mesh%normal
         if (normals%kind == 'facet') then
            call bisect(bisection, marked)
         else
            call bisect(bisection, marked, normals%crease_angle, structure%normal, crease_edges_of(normals, structure%mesh))
         end if
      end associate
   end subroutine cut

   !> Bring a carried-over state to equilibrium; it comes to be that.
   subroutine settle(step, station, problem, path, reporter, speaker, failure, error)
      type(step_t), intent(in) :: step
      type(station_t), intent(inout) :: station
      type(equilibrium_t), intent(inout) :: problem
      type(path_t), intent(inout) :: path
      type(reporter_t), intent(in) :: reporter
      type(speaker_t), intent(inout) :: speaker
      type(error_t), allocatable, intent(out) :: failure !< no equilibrium was found
      type(error_t), allocatable, intent(out) :: error
      type(record_t) :: record
      call hold_supports(problem%equations, station%state)
      call resettle(problem, step, station%state, station%value, record, failure, &
                    predicted=in_order_of(problem%assembly, station%stress), stable=station%stable, &
                    rescue=reporter%descents + reporter%relaxations > 0) ! else the path is the shorter way
      path%iterations = path%iterations + record%iterations
      if (allocated(failure)) return
      station%state = problem%state
      station%stable = record%negative_pivots == 0
      call speaker%increment(problem%state, record, error)
   end subroutine settle
end module finshell_carrying
