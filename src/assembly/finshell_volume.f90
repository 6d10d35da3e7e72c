!> The volume that a surface encloses, as a quantity to monitor and to prescribe: its value and its gradient.
!>
!> The volume lies between the surface, with the caps of elements with a curved reference, and an origin: the one enclosed if the
!> boundary of the surface is fixed or stays in planes through the origin (finshell_pressure_region), for which the gradient is
!> the force of a unit pressure.
module finshell_volume
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_membrane, n_nodal, n_shell, ux, uz
   use finshell_status, only: status_input_error
   use finshell_error, only: error_t, raise
   use finshell_cap_terms, only: caps_at
   use finshell_acting_load, only: positions
   use finshell_mesh, only: find_element_set, element_set_names
   use finshell_state, only: state_t
   use finshell_enclosed_volume, only: volume_behind
   use finshell_equations, only: equations_t, unknowns_of
   use finshell_held_motion, only: motion_at
   use finshell_external, only: external_t
   use finshell_factor, only: by_load_factor
   use finshell_pressure, only: follower_pressure
   use finshell_pressure_region, only: symmetric_origin
   use finshell_structure, only: structure_t, curved_elements
   use finshell_watched, only: watched_t
   implicit none
   private
   public :: volume_t, new_volume

   type, extends(watched_t) :: volume_t
      integer, allocatable :: elements(:), curved(:) !< those of them with a curved reference
      integer, allocatable :: held(:, :) !< (3, elements of the structure) sides that supports hold
      real(wp) :: origin(3) = 0
   contains
      procedure :: value => volume_value
      procedure :: gradient => volume_gradient
   end type volume_t

contains

   !> The volume behind an element set; by default behind the elements with a pressure that follows the load factor.
   !> Errors: unknown set, no pressure, a surface that does not enclose a volume.
   subroutine new_volume(self, structure, equations, loads, error, element_set)
      type(volume_t), intent(out) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(external_t), intent(in) :: loads
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: element_set
      logical, allocatable :: member(:)
      logical :: closed
      integer :: at, e, i

      allocate (member(size(structure%mesh%triangles, 2)), source=.false.)
      if (present(element_set)) then
         at = find_element_set(structure%mesh, element_set)
         if (at == 0) then
            call raise(error, status_input_error, "step: the mesh has no element set '"//element_set//"'; it has: " &
               //element_set_names(structure%mesh))
            return
         end if
         member(structure%mesh%element_sets(at)%members) = .true.
      else
         do i = 1, size(loads%pressures)
            if (loads%pressures(i)%scaling == by_load_factor) member(loads%pressures(i)%elements) = .true.
         end do
      end if
      self%elements = pack([(e, e=1, size(member))], member)
      if (size(self%elements) == 0) then
         call raise(error, status_input_error, 'step: a volume is to be monitored, but no pressure scales with the load factor')
         return
      end if
      self%curved = curved_elements(structure, self%elements)
      if (size(self%curved) > 0 .and. allocated(equations%held)) self%held = equations%held
      call symmetric_origin(structure%mesh, equations, self%elements, closed, self%origin)
      if (.not. closed) call raise(error, status_input_error, 'step: the elements do not enclose a volume: part of their ' &
         //'boundary is neither fixed nor in a plane of symmetry')
   end subroutine new_volume

   function volume_value(self, structure, state) result(volume)
      class(volume_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp) :: volume
      volume = volume_behind(structure, self%elements, self%curved, self%origin, state, self%held)
   end function volume_value

   subroutine volume_gradient(self, structure, equations, state, gradient, rate)
      class(volume_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: gradient(:), rate
      real(wp), allocatable :: force(:, :), caps(:, :), nodal(:, :), pressure(:)
      integer :: i, n

      n = size(self%elements)
      allocate (force(n_membrane, n), pressure(n), caps(n_shell, size(self%curved)))
      allocate (nodal(n_nodal, size(structure%mesh%coordinates, 2)), source=0.0_wp)
      pressure = 1
      call follower_pressure(n, pressure, positions(structure, state, self%elements), .true., self%origin, force)
      do i = 1, n
         associate (nodes => structure%mesh%triangles(:, self%elements(i)))
            nodal(ux:uz, nodes) = nodal(ux:uz, nodes) + reshape(force(:, i), [uz, size(nodes)])
         end associate
      end do
      if (size(self%curved) > 0) call caps_at(structure, self%curved, state, force=caps, held=self%held)
      do i = 1, size(self%curved)
         associate (nodes => structure%mesh%triangles(:, self%curved(i)))
            nodal(:, nodes) = nodal(:, nodes) + reshape(caps(:, i), [n_nodal, size(nodes)])
         end associate
      end do
      call equations%links%fold(nodal)
      call unknowns_of(equations, nodal, gradient)
      rate = 0
      do i = 1, size(equations%moved)
         rate = rate + dot_product(nodal(:, equations%moved(i)), motion_at(equations, i, by_load_factor, state))
      end do
   end subroutine volume_gradient
end module finshell_volume
