!> The mean displacement of a node set as a function of the unknowns: what displacement control prescribes.
module finshell_watched_displacement
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_nodal
   use finshell_status, only: status_invalid_argument, status_input_error
   use finshell_error, only: error_t, raise, text_of
   use finshell_mesh, only: mesh_t, find_node_set, node_set_names
   use finshell_equations, only: equations_t
   use finshell_held_motion, only: motion_at
   use finshell_factor, only: by_load_factor
   use finshell_state, only: state_t
   implicit none
   private
   public :: watch_displacement, mean_displacement, mean_rate

contains

   !> Nodes, derivative with respect to the unknowns (n) and to the load factor. Errors: unknown set, bad component, one that is
   !> held.
   subroutine watch_displacement(mesh, equations, state, moved_of, node_set, component, nodes, gradient, rate, error)
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      integer, intent(in) :: moved_of(:) !< (nodes) index into equations%moved, 0: not moved
      character(len=*), intent(in) :: node_set
      integer, intent(in) :: component !< 1 to 3, global
      integer, allocatable, intent(inout) :: nodes(:)
      real(wp), allocatable, intent(inout) :: gradient(:)
      real(wp), intent(inout) :: rate
      type(error_t), allocatable, intent(out) :: error
      integer :: at, i, k, node
      real(wp) :: share, axis(3)
      logical :: moves

      at = find_node_set(mesh, node_set)
      if (at == 0) then
         call raise(error, status_input_error, "step: the mesh has no node set '"//node_set//"'; it has: " &
            //node_set_names(mesh))
         return
      end if
      if (component < 1 .or. component > 3) then
         call raise(error, status_invalid_argument, 'step: the monitored component must be a displacement, 1 to 3; found ' &
            //text_of(component))
         return
      end if
      nodes = mesh%node_sets(at)%members
      share = 1.0_wp/size(nodes)
      allocate (gradient(equations%n), source=0.0_wp)
      rate = mean_rate(equations, state, moved_of, nodes, component)
      moves = abs(rate) > 0
      do i = 1, size(nodes)
         node = nodes(i)
         axis = 0
         axis(component) = 1
         if (equations%frame(node) > 0) axis = equations%frames(component, :, equations%frame(node))
         do k = 1, 3
            if (equations%number(k, node) > 0) gradient(equations%number(k, node)) = share*axis(k)
         end do
         if (moved_of(node) > 0) moves = moves .or. any(abs(equations%motion(component, moved_of(node), :)) > 0)
      end do
      if (.not. any(abs(gradient) > 0) .and. .not. moves) &
         call raise(error, status_input_error, "step: displacement "//text_of(component)//" of '"//node_set &
         //"' is held by the supports; monitor one that can move")
   end subroutine watch_displacement

   !> What its nodes that supports move contribute per change of the load factor.
   pure function mean_rate(equations, state, moved_of, nodes, component) result(rate)
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      integer, intent(in) :: moved_of(:), nodes(:), component !< as for `watch_displacement`
      real(wp) :: rate, share, motion(n_nodal)
      integer :: i
      rate = 0
      share = 1.0_wp/size(nodes)
      do i = 1, size(nodes)
         if (moved_of(nodes(i)) == 0) cycle
         motion = motion_at(equations, moved_of(nodes(i)), by_load_factor, state)
         rate = rate + share*motion(component)
      end do
   end function mean_rate

   !> Mean of a global displacement component over nodes.
   pure function mean_displacement(state, nodes, component) result(mean)
      type(state_t), intent(in) :: state
      integer, intent(in) :: nodes(:), component
      real(wp) :: mean
      integer :: i
      mean = 0
      do i = 1, size(nodes)
         mean = mean + state%displacement(component, nodes(i))
      end do
      mean = mean/size(nodes)
   end function mean_displacement
end module finshell_watched_displacement
