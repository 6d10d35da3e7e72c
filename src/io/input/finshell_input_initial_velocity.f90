!> The groups &initial_velocity of an input file: with what the first step in time begins.
module finshell_input_initial_velocity
   use finshell_error, only: error_t
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_input_common, only: get_set, get_vector, kind_node
   use finshell_kinds, only: wp
   use finshell_mesh, only: find_node_set, mesh_t
   use finshell_namelist, only: check_all_used, complain_about, group_t
   use finshell_rotation, only: cross_product
   use finshell_step, only: is_motion, step_t
   implicit none
   private
   public :: add_initial_velocity

contains

   !> Add one group's to the velocities: that of a rigid body at the nodes of the set. Errors: no step in time; an empty group.
   subroutine add_initial_velocity(group, mesh, steps, velocity, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(step_t), intent(in) :: steps(:)
      real(wp), allocatable, intent(inout) :: velocity(:, :) !< (n_nodal, nodes) and spins; allocated by the first group
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: set
      real(wp) :: translation(3), spin(3), origin(3)
      integer :: i

      call get_set(group, kind_node, mesh, set, error, default='all')
      call get_vector(group, 'velocity', translation, error, default=[0.0_wp, 0.0_wp, 0.0_wp])
      call get_vector(group, 'spin', spin, error, default=[0.0_wp, 0.0_wp, 0.0_wp])
      call get_vector(group, 'origin', origin, error, default=[0.0_wp, 0.0_wp, 0.0_wp])
      call check_all_used(group, error)
      if (allocated(error)) return
      if (.not. any(is_motion(steps%control))) then
         call complain_about(group, '', "no step goes through time; expected is one with control = 'dynamic' or 'explicit'", error)
      else if (.not. any(abs([translation, spin]) > 0)) then
         call complain_about(group, '', 'velocity and spin are zero; expected is one of them, or both', error)
      end if
      if (allocated(error)) return
      if (.not. allocated(velocity)) allocate (velocity(n_nodal, size(mesh%coordinates, 2)), source=0.0_wp)
      associate (members => mesh%node_sets(find_node_set(mesh, set))%members)
         do i = 1, size(members)
            velocity(ux:uz, members(i)) = velocity(ux:uz, members(i)) + translation &
               + cross_product(spin, mesh%coordinates(:, members(i)) - origin)
            velocity(rx:rz, members(i)) = velocity(rx:rz, members(i)) + spin
         end do
      end associate
   end subroutine add_initial_velocity
end module finshell_input_initial_velocity
