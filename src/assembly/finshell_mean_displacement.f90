!> The mean displacement of a node set as a quantity to monitor and to prescribe: what displacement control goes by.
module finshell_mean_displacement
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_nodal
   use finshell_status, only: status_invalid_argument, status_input_error
   use finshell_error, only: error_t, raise, text_of
   use finshell_mesh, only: mesh_t, find_node_set, node_set_names
   use finshell_equations, only: equations_t, unknowns_of
   use finshell_held_motion, only: motion_at
   use finshell_factor, only: by_load_factor
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   use finshell_watched, only: watched_t
   implicit none
   private
   public :: mean_displacement_t, new_mean_displacement

   type, extends(watched_t) :: mean_displacement_t
      integer, allocatable :: nodes(:)
      integer :: component = 0 !< 1 to 3, global
   contains
      procedure :: value => mean_displacement
      procedure :: gradient => displacement_gradient
   end type mean_displacement_t

contains

   !> Errors: unknown set, bad component, one that is held.
   subroutine new_mean_displacement(self, mesh, equations, node_set, component, error)
      type(mean_displacement_t), intent(out) :: self
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      character(len=*), intent(in) :: node_set
      integer, intent(in) :: component !< 1 to 3, global
      type(error_t), allocatable, intent(out) :: error
      integer :: at

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
      self%nodes = mesh%node_sets(at)%members
      self%component = component
      if (.not. can_move(self, equations)) &
         call raise(error, status_input_error, "step: displacement "//text_of(component)//" of '"//node_set &
         //"' is held by the supports; monitor one that can move")
   end subroutine new_mean_displacement

   pure function mean_displacement(self, structure, state) result(value)
      class(mean_displacement_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp) :: value
      integer :: i
      value = 0*size(structure%sections)
      do i = 1, size(self%nodes)
         value = value + state%displacement(self%component, self%nodes(i))
      end do
      value = value/size(self%nodes)
   end function mean_displacement

   pure subroutine displacement_gradient(self, structure, equations, state, gradient, rate)
      class(mean_displacement_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: gradient(:), rate
      real(wp), allocatable :: nodal(:, :)
      integer :: i
      nodal = shares(self, equations)
      call unknowns_of(equations, nodal, gradient)
      rate = 0*size(structure%sections)
      do i = 1, size(equations%moved)
         rate = rate + dot_product(motion_at(equations, i, by_load_factor, state), nodal(:, equations%moved(i)))
      end do
   end subroutine displacement_gradient

   !> Do supports leave it free, or does some factor move it through them?
   pure logical function can_move(self, equations)
      type(mean_displacement_t), intent(in) :: self
      type(equations_t), intent(in) :: equations
      real(wp), allocatable :: nodal(:, :), gradient(:)
      integer :: i, k
      nodal = shares(self, equations)
      allocate (gradient(equations%n))
      call unknowns_of(equations, nodal, gradient)
      can_move = any(abs(gradient) > 0)
      do k = 1, size(equations%motion, 3)
         do i = 1, size(equations%moved)
            can_move = can_move .or. abs(dot_product(equations%motion(:, i, k), nodal(:, equations%moved(i)))) > 0
         end do
      end do
   end function can_move

   !> (n_nodal, nodes) Derivatives with respect to the motions of nodes that depend on no others.
   pure function shares(self, equations) result(nodal)
      class(mean_displacement_t), intent(in) :: self
      type(equations_t), intent(in) :: equations
      real(wp), allocatable :: nodal(:, :)
      integer :: i
      allocate (nodal(n_nodal, size(equations%number, 2)), source=0.0_wp)
      do i = 1, size(self%nodes)
         nodal(self%component, self%nodes(i)) = 1.0_wp/size(self%nodes)
      end do
      call equations%links%fold(nodal)
   end function shares
end module finshell_mean_displacement
