!> The volume that a surface encloses, as a quantity to monitor and to prescribe: its value and its gradient.
!>
!> The volume lies between the surface and an origin: the one enclosed if the boundary of the surface is fixed or stays in
!> planes through the origin (finshell_pressure_region), for which the gradient is the force of a unit pressure.
module finshell_volume
   use finshell_kinds, only: wp
   use finshell_status, only: status_input_error
   use finshell_error, only: error_t, raise
   use finshell_mesh, only: mesh_t, find_element_set, element_set_names
   use finshell_state, only: state_t
   use finshell_equations, only: equations_t, gather
   use finshell_external, only: external_t
   use finshell_pressure, only: follower_pressure, enclosed_volume
   use finshell_pressure_region, only: symmetric_origin
   implicit none
   private
   public :: volume_t, new_volume

   type :: volume_t
      integer, allocatable :: elements(:)
      real(wp) :: origin(3) = 0
   contains
      procedure :: value => volume_value
      procedure :: gradient => volume_gradient
      procedure, private :: positions
   end type volume_t

contains

   !> The volume behind an element set; by default behind the elements with a pressure that follows the load factor.
   !> Errors: unknown set, no pressure, a surface that does not enclose a volume.
   subroutine new_volume(self, mesh, equations, loads, error, element_set)
      type(volume_t), intent(out) :: self
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      type(external_t), intent(in) :: loads
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: element_set
      logical, allocatable :: member(:)
      logical :: closed
      integer :: at, e, i

      allocate (member(size(mesh%triangles, 2)), source=.false.)
      if (present(element_set)) then
         at = find_element_set(mesh, element_set)
         if (at == 0) then
            call raise(error, status_input_error, "step: the mesh has no element set '"//element_set//"'; it has: " &
               //element_set_names(mesh))
            return
         end if
         member(mesh%element_sets(at)%members) = .true.
      else
         do i = 1, size(loads%pressures)
            if (loads%pressures(i)%scaling == 1) member(loads%pressures(i)%elements) = .true.
         end do
      end if
      self%elements = pack([(e, e=1, size(member))], member)
      if (size(self%elements) == 0) then
         call raise(error, status_input_error, 'step: a volume is to be monitored, but no pressure scales with the load factor')
         return
      end if
      call symmetric_origin(mesh, equations, self%elements, closed, self%origin)
      if (.not. closed) call raise(error, status_input_error, 'step: the elements do not enclose a volume: part of their ' &
         //'boundary is neither fixed nor in a plane of symmetry')
   end subroutine new_volume

   pure function positions(self, mesh, state) result(x)
      class(volume_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      type(state_t), intent(in) :: state
      real(wp) :: x(3, 3, size(self%elements))
      integer :: e, k, node
      do e = 1, size(self%elements)
         do k = 1, 3
            node = mesh%triangles(k, self%elements(e))
            x(:, k, e) = mesh%coordinates(:, node) + state%displacement(:, node)
         end do
      end do
   end function positions

   pure function volume_value(self, mesh, state) result(volume)
      class(volume_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      type(state_t), intent(in) :: state
      real(wp) :: volume
      volume = enclosed_volume(size(self%elements), self%positions(mesh, state), self%origin)
   end function volume_value

   !> Derivatives of the volume with respect to the unknowns and to the load factor, by which held nodes may move.
   pure subroutine volume_gradient(self, mesh, equations, state, gradient, rate)
      class(volume_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: gradient(:), rate
      real(wp), allocatable :: force(:, :), nodal(:, :), pressure(:)
      integer :: e, i, k, n, node

      n = size(self%elements)
      allocate (force(9, n), pressure(n))
      allocate (nodal(6, size(mesh%coordinates, 2)), source=0.0_wp)
      pressure = 1
      call follower_pressure(n, pressure, self%positions(mesh, state), .true., self%origin, force)
      do e = 1, n
         do k = 1, 3
            node = mesh%triangles(k, self%elements(e))
            nodal(1:3, node) = nodal(1:3, node) + force(3*k - 2:3*k, e)
         end do
      end do
      call gather(equations, nodal, gradient)
      rate = 0
      do i = 1, size(equations%moved)
         rate = rate + dot_product(nodal(1:3, equations%moved(i)), equations%motion(1:3, i, 1))
      end do
   end subroutine volume_gradient
end module finshell_volume
