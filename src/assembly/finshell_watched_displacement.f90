!> The mean displacement of a node set as a function of the unknowns: what displacement control prescribes.
module finshell_watched_displacement
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_nodal
   use finshell_status, only: status_invalid_argument, status_input_error
   use finshell_error, only: error_t, raise, text_of
   use finshell_mesh, only: mesh_t, find_node_set, node_set_names
   use finshell_equations, only: equations_t, unknowns_of
   use finshell_held_motion, only: motion_at
   use finshell_factor, only: by_load_factor
   use finshell_freedoms, only: n_nodal
   use finshell_state, only: state_t
   implicit none
   private
   public :: watch_displacement, displacement_gradient, mean_displacement

contains

   !> Nodes, derivative with respect to the unknowns (n) and to the load factor. Errors: unknown set, bad component, one that is
   !> held.
   subroutine watch_displacement(mesh, equations, state, node_set, component, nodes, gradient, rate, error)
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      character(len=*), intent(in) :: node_set
      integer, intent(in) :: component !< 1 to 3, global
      integer, allocatable, intent(inout) :: nodes(:)
      real(wp), allocatable, intent(inout) :: gradient(:)
      real(wp), intent(inout) :: rate
      type(error_t), allocatable, intent(out) :: error
      integer :: at
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
      call displacement_gradient(equations, state, nodes, component, gradient, rate, moves)
      if (.not. any(abs(gradient) > 0) .and. .not. moves) &
         call raise(error, status_input_error, "step: displacement "//text_of(component)//" of '"//node_set &
         //"' is held by the supports; monitor one that can move")
   end subroutine watch_displacement

   !> Derivatives of the mean of a global displacement component with respect to the unknowns and to the load factor.
   pure subroutine displacement_gradient(equations, state, nodes, component, gradient, rate, moves)
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      integer, intent(in) :: nodes(:), component !< 1 to 3
      real(wp), allocatable, intent(inout) :: gradient(:) !< (n)
      real(wp), intent(out) :: rate
      logical, intent(out), optional :: moves !< some factor moves it through supports
      real(wp), allocatable :: nodal(:, :)
      integer :: i, k
      allocate (nodal(n_nodal, size(equations%number, 2)), source=0.0_wp)
      do i = 1, size(nodes)
         nodal(component, nodes(i)) = 1.0_wp/size(nodes)
      end do
      call equations%links%fold(nodal)
      if (.not. allocated(gradient)) allocate (gradient(equations%n))
      call unknowns_of(equations, nodal, gradient)
      rate = 0
      do i = 1, size(equations%moved)
         rate = rate + dot_product(motion_at(equations, i, by_load_factor, state), nodal(:, equations%moved(i)))
      end do
      if (.not. present(moves)) return
      moves = .false.
      do k = 1, size(equations%motion, 3)
         do i = 1, size(equations%moved)
            moves = moves .or. abs(dot_product(equations%motion(:, i, k), nodal(:, equations%moved(i)))) > 0
         end do
      end do
   end subroutine displacement_gradient

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
