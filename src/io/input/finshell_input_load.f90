!> The group &load of an input file.
module finshell_input_load
   use finshell_error, only: error_t, text_of
   use finshell_factor, only: unscaled
   use finshell_input_case, only: get_scaling, get_span, scales_t
   use finshell_kinds, only: wp
   use finshell_load, only: load_t, load_nodal
   use finshell_load, only: pressure_automatic, pressure_symmetric, pressure_unsymmetric
   use finshell_mesh, only: find_element_set, find_node_set, mesh_t
   use finshell_structure, only: structure_t
   use finshell_namelist, only: group_t, get, has, check_all_used, complain_about
   use finshell_input_common, only: get_set, get_vector, kind_node, kind_edge, kind_element
   implicit none
   private
   public :: read_load

   character(len=*), parameter :: kinds = &
      'force, moment, line, line_moment, follower_line, traction, pressure, gravity, hydrostatic, centrifugal, foundation'

contains

   !> &load: append one load. The sections of the structure must be there (density).
   subroutine read_load(group, structure, scales, error)
      type(group_t), intent(inout) :: group
      type(structure_t), intent(inout) :: structure
      type(scales_t), intent(inout) :: scales
      type(error_t), allocatable, intent(inout) :: error
      type(load_t) :: load
      type(load_t), allocatable :: grown(:)
      character(len=:), allocatable :: kind_name
      integer :: i

      if (allocated(error)) return
      call get(group, 'type', kind_name, error, choices=kinds)
      if (allocated(error)) return
      load%kind = kind_name
      if (kind_name == 'foundation') then
         load%scaling = unscaled
      else
         call get_scaling(group, scales, load%scaling, error)
      end if
      call get_span(group, scales, load%span, error)
      select case (kind_name)
      case ('force', 'moment')
         load%kind = load_nodal
         call get_set(group, kind_node, structure%mesh, load%set, error)
         if (kind_name == 'force') call get_vector(group, 'vector', load%vector, error)
         if (kind_name == 'moment') call get_vector(group, 'vector', load%moment, error)
         call get(group, 'total', load%total, error, default=.false.)
      case ('line')
         call get_set(group, kind_edge, structure%mesh, load%set, error)
         call get_vector(group, 'vector', load%vector, error)
      case ('line_moment')
         call get_set(group, kind_edge, structure%mesh, load%set, error)
         if (has(group, 'about_edge')) then
            call get(group, 'about_edge', load%numbers(1), error)
         else
            call get_vector(group, 'vector', load%moment, error)
         end if
      case ('follower_line')
         call get_set(group, kind_edge, structure%mesh, load%set, error)
         call get(group, 'in_plane', load%vector(1), error, default=0.0_wp)
         call get(group, 'normal', load%vector(2), error, default=0.0_wp)
         call get(group, 'tangential', load%vector(3), error, default=0.0_wp)
      case ('foundation')
         call read_foundation(group, structure, load, error)
      case default
         call get_set(group, kind_element, structure%mesh, load%set, error, default='all')
         call read_on_elements(group, structure, load, error)
      end select
      call check_all_used(group, error)
      if (allocated(error)) return
      if ((load%kind == load_nodal .and. .not. load%total) .or. load%at_nodes) then
         load%vector = share(structure%mesh, load%set)*load%vector
         load%moment = share(structure%mesh, load%set)*load%moment
      end if
      allocate (grown(size(structure%loads) + 1))
      do i = 1, size(structure%loads)
         grown(i) = structure%loads(i)
      end do
      grown(size(grown)) = load
      call move_alloc(grown, structure%loads)
   end subroutine read_load

   !> What a node of a set bears of what one bore before refinement: the sum stays.
   pure real(wp) function share(mesh, name)
      type(mesh_t), intent(in) :: mesh
      character(len=*), intent(in) :: name
      integer :: i
      share = 1
      if (.not. allocated(mesh%former_node_sets)) return
      do i = 1, size(mesh%former_node_sets)
         if (mesh%former_node_sets(i)%name == name) share = real(size(mesh%former_node_sets(i)%members), wp) &
            /size(mesh%node_sets(find_node_set(mesh, name))%members)
      end do
   end function share

   !> What loads on an element set need beside it.
   subroutine read_on_elements(group, structure, load, error)
      type(group_t), intent(inout) :: group
      type(structure_t), intent(in) :: structure
      type(load_t), intent(inout) :: load
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: stiffness

      select case (load%kind)
      case ('traction')
         call get_vector(group, 'vector', load%vector, error)
      case ('pressure')
         call get(group, 'pressure', load%pressure, error)
         call get(group, 'stiffness', stiffness, error, default='auto', choices='auto, symmetric, unsymmetric')
         if (allocated(error)) return
         select case (stiffness)
         case ('symmetric'); load%stiffness = pressure_symmetric
         case ('unsymmetric'); load%stiffness = pressure_unsymmetric
         case default; load%stiffness = pressure_automatic
         end select
      case ('gravity')
         call get_vector(group, 'vector', load%vector, error)
         call check_density(group, structure, load, error)
      case ('hydrostatic')
         call get(group, 'level', load%numbers(1), error)
         call get(group, 'weight', load%numbers(2), error)
         call get_vector(group, 'up', load%direction, error, default=[0.0_wp, 0.0_wp, 1.0_wp], nonzero=.true.)
         if (.not. allocated(error) .and. .not. abs(load%numbers(2)) > 0) &
            call complain_about(group, 'weight', 'the weight of the fluid per volume is zero', error)
      case ('centrifugal')
         call get(group, 'angular_velocity', load%numbers(1), error)
         call get_vector(group, 'axis', load%direction, error, nonzero=.true.)
         call get_vector(group, 'origin', load%point, error, default=[0.0_wp, 0.0_wp, 0.0_wp])
         call check_density(group, structure, load, error)
      end select
   end subroutine read_on_elements

   !> Springs on elements or at nodes, in global axes or, on elements, along the normal and across it.
   subroutine read_foundation(group, structure, load, error)
      type(group_t), intent(inout) :: group
      type(structure_t), intent(in) :: structure
      type(load_t), intent(inout) :: load
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: least

      load%at_nodes = has(group, 'node_set')
      if (load%at_nodes) then
         call get_set(group, kind_node, structure%mesh, load%set, error)
      else
         call get_set(group, kind_element, structure%mesh, load%set, error, default='all')
      end if
      if (load%at_nodes .or. has(group, 'vector')) then
         call get_vector(group, 'vector', load%vector, error)
      else
         call get(group, 'normal', load%numbers(1), error)
         call get(group, 'tangential', load%numbers(2), error, default=0.0_wp)
      end if
      if (allocated(error)) return
      least = min(minval(load%vector), minval(load%numbers))
      if (least < 0) then
         call complain_about(group, '', 'the stiffness of a foundation is not negative; '//text_of(least)//' was given', error)
      else if (.not. any([load%vector, load%numbers] > 0)) then
         call complain_about(group, '', 'all stiffnesses of the foundation are zero', error)
      end if
   end subroutine read_foundation

   !> What acts on mass needs a density.
   subroutine check_density(group, structure, load, error)
      type(group_t), intent(in) :: group
      type(structure_t), intent(in) :: structure
      type(load_t), intent(in) :: load
      type(error_t), allocatable, intent(inout) :: error
      integer :: e, section

      if (allocated(error)) return
      associate (elements => structure%mesh%element_sets(find_element_set(structure%mesh, load%set))%members)
         do e = 1, size(elements)
            section = structure%element_section(elements(e))
            if (structure%density(section) > 0) cycle
            call complain_about(group, '', trim(load%kind)//' acts on element '//text_of(elements(e)) &
               //', whose material has no density', error)
            return
         end do
      end associate
   end subroutine check_density
end module finshell_input_load
