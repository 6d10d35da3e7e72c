!> The group &accuracy of an input file: how good the answer is to be, and what it may cost.
module finshell_input_accuracy
   use finshell_edges, only: edges_t, has_junctions, new_edges
   use finshell_error, only: error_t
   use finshell_kinds, only: wp
   use finshell_load, only: load_nodal
   use finshell_mesh, only: find_node_set
   use finshell_monitor, only: monitor_t, reduce_mean
   use finshell_namelist, only: check_all_used, complain_about, get, group_t, has, namelist_t
   use finshell_result_fields, only: find_field
   use finshell_step, only: control_linear, is_in_time, is_mode, step_t
   use finshell_structure, only: remembers, structure_t
   implicit none
   private
   public :: accuracy_t, read_accuracy, read_coarser

   integer, parameter :: most_levels = 8

   type :: accuracy_t
      real(wp) :: target = 0.01_wp !< relative error that is wanted
      integer :: monitor = 0 !< number of the monitor whose error it is; 0: of the stresses, in the energy norm
      real(wp) :: budget = 600 !< seconds of CPU time
      integer :: most_elements = 200000
      integer :: most_meshes = 30
      integer :: coarser = 0 !< the path is followed on a mesh of so many levels less, its end carried to the mesh of the input
      logical :: judged = .true. !< meshes beyond that of the input may be wanted
      integer :: line = 0 !< where the group stands
   end type accuracy_t

contains

   !> &accuracy, when all else has been read.
   subroutine read_accuracy(group, structure, load_lines, steps, monitors, accuracy, error)
      type(group_t), intent(inout) :: group
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: load_lines(:)
      type(step_t), intent(in) :: steps(:)
      type(monitor_t), intent(in) :: monitors(:)
      type(accuracy_t), intent(out) :: accuracy
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name

      accuracy%line = group%line
      call get(group, 'target', accuracy%target, error, default=accuracy%target, above=0.0_wp, maximum=1.0_wp)
      call get(group, 'monitor', name, error, default='')
      call get(group, 'budget', accuracy%budget, error, default=accuracy%budget, above=0.0_wp)
      call get(group, 'most_elements', accuracy%most_elements, error, default=accuracy%most_elements, minimum=1)
      call get(group, 'most_meshes', accuracy%most_meshes, error, default=accuracy%most_meshes, minimum=1)
      call get(group, 'coarser', accuracy%coarser, error, default=0, minimum=0, maximum=most_levels)
      accuracy%judged = accuracy%coarser == 0 .or. has(group, 'target') .or. has(group, 'monitor')
      call check_all_used(group, error)
      if (allocated(error)) return
      if (has(group, 'monitor')) call find_goal(group, name, monitors, accuracy, error)
      if (.not. allocated(error)) call check_analysis(group, structure, load_lines, steps, monitors, accuracy, error)
   end subroutine read_accuracy

   !> The key `coarser`, which is needed before the mesh is read.
   subroutine read_coarser(namelist, coarser, error)
      type(namelist_t), intent(inout) :: namelist
      integer, intent(out) :: coarser
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      coarser = 0
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name == 'accuracy') &
            call get(namelist%groups(i), 'coarser', coarser, error, default=0, minimum=0, maximum=most_levels)
      end do
   end subroutine read_coarser

   !> The monitor whose error is estimated: the mean of a displacement component.
   subroutine find_goal(group, name, monitors, accuracy, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: name
      type(monitor_t), intent(in) :: monitors(:)
      type(accuracy_t), intent(inout) :: accuracy
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: known
      integer :: i
      known = ''
      do i = 1, size(monitors)
         if (monitors(i)%name == name) accuracy%monitor = i
         if (known /= '') known = known//', '
         known = known//monitors(i)%name
      end do
      if (known == '') known = '(none)'
      if (accuracy%monitor == 0) then
         call complain_about(group, 'monitor', "there is no monitor '"//name//"'; there are: "//known, error)
         return
      end if
      associate (monitor => monitors(accuracy%monitor))
         if (monitor%quantity /= find_field('displacement') .or. monitor%component == 0 .or. monitor%reduce /= reduce_mean) &
            call complain_about(group, 'monitor', "found '"//name//"', which is not the mean of a displacement; expected is a " &
                                //"monitor with quantity = 'displacement' and reduce = 'mean', or none for the energy norm", error)
      end associate
   end subroutine find_goal

   !> Is there growth that some steps have and others have not?
   pure logical function comes_or_goes(structure)
      type(structure_t), intent(in) :: structure
      comes_or_goes = .false.
      if (allocated(structure%growths)) comes_or_goes = .not. all(structure%growths%list%span%is_whole())
   end function comes_or_goes

   !> What cannot go on from mesh to mesh.
   subroutine check_analysis(group, structure, load_lines, steps, monitors, accuracy, error)
      type(group_t), intent(in) :: group
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: load_lines(:)
      type(step_t), intent(in) :: steps(:)
      type(monitor_t), intent(in) :: monitors(:)
      type(accuracy_t), intent(in) :: accuracy
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      if (structure%cases > 0) then
         call complain_about(group, '', 'loads and supports have cases or amplitudes, which cannot go on from mesh to mesh', error)
      else if (.not. (all(structure%loads%span%is_whole()) .and. all(structure%supports%span%is_whole()))) then
         call complain_about(group, '', 'loads or supports come or go between steps, which cannot go on from mesh to mesh', error)
      else if (comes_or_goes(structure)) then
         call complain_about(group, '', 'growth comes or goes between steps, which cannot go on from mesh to mesh', error)
      else if (size(structure%chambers) > 0) then
         call complain_about(group, '', 'what is in chambers cannot go on from mesh to mesh; finshell study refines ' &
                             //'their meshes', error)
      else if (remembers(structure)) then
         call complain_about(group, '', 'what laws with states remember cannot go on from mesh to mesh; finshell study refines ' &
                             //'meshes from the beginning', error)
      else if (any(is_mode(steps%control))) then
         call complain_about(group, '', 'modes have no estimate of their error; finshell study refines their meshes', error)
      else if (any(is_in_time(steps%control))) then
         call complain_about(group, '', 'a motion cannot go on from mesh to mesh: with this group no step goes through time; ' &
                             //'finshell study refines the mesh of the whole motion', error)
      else if (accuracy%coarser > 0 .and. all(steps%control == control_linear)) then
         call complain_about(group, 'coarser', 'linear steps follow no path: nothing would be saved', error)
      else if (any(steps%control == control_linear) .and. .not. all(steps%control == control_linear)) then
         call complain_about(group, '', 'either all steps are linear or none is expected', error)
      else if (size(structure%connectors) > 0 .or. structure%mesh%loose > 0) then
         call complain_about(group, '', 'there are connectors or nodes beside the mesh, which cannot go on from mesh to mesh; ' &
                             //'finshell study refines it with them', error)
      else if (any([(monitors(i)%name == 'mesh', i=1, size(monitors))])) then
         call complain_about(group, '', "a monitor is called 'mesh'; with this group the history has a column 'mesh' of its own", &
                             error)
      end if
      if (.not. allocated(error)) then
         if (has_junctions(structure%mesh%triangles)) call complain_about(group, '', 'more than two triangles meet at an edge of ' &
            //'the mesh, which this group cannot refine; finshell study can', error)
      end if
      do i = 1, size(structure%loads)
         if (allocated(error)) return
         associate (load => structure%loads(i))
            if (.not. (load%kind == load_nodal .or. load%at_nodes)) cycle
            if (.not. spread_out(load%set)) cycle
            error = error_of_load(load%set, load_lines(i))
         end associate
      end do

   contains

      !> Are there neighbours in a node set? What acts at each node would act at new ones between them.
      logical function spread_out(set)
         character(len=*), intent(in) :: set
         type(edges_t) :: edges
         logical, allocatable :: member(:)
         integer :: k
         call new_edges(edges, structure%mesh%triangles)
         allocate (member(size(structure%mesh%coordinates, 2)), source=.false.)
         member(structure%mesh%node_sets(find_node_set(structure%mesh, set))%members) = .true.
         spread_out = any([(all(member(edges%nodes(:, k))), k=1, size(edges%nodes, 2))])
      end function spread_out

      function error_of_load(set, line) result(refusal)
         character(len=*), intent(in) :: set
         integer, intent(in) :: line
         type(error_t), allocatable :: refusal
         type(group_t) :: place
         place = group
         place%line = line
         place%name = 'load'
         call complain_about(place, '', "with &accuracy it cannot act at the nodes of '"//set//"', which are neighbours: those " &
            //"between them are not known yet; expected are single nodes, or a load on an edge or element set", refusal)
      end function error_of_load
   end subroutine check_analysis
end module finshell_input_accuracy
