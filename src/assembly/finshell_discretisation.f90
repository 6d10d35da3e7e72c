!> The elements of a structure as the kernel takes them: the arrays of any list of elements, gathered here and nowhere else, and
!> the calls of the kernel with them.
!>
!> Whatever an element needs to know beside its nodes (material direction, normals, held sides, thickness, growth, what its laws
!> remember) is gathered with them, so no caller can forget it.
module finshell_discretisation
   use finshell_batch, only: evaluate_elements, n_growth, predict_resultants, rotation_quaternion
   use finshell_field_batch, only: recover_fields
   use finshell_freedoms, only: n_corners, n_membrane, n_shell
   use finshell_kinds, only: wp, i4
   use finshell_law_states, only: law_states_t
   use finshell_membrane_batch, only: evaluate_membranes
   use finshell_section, only: section_t, states_of
   use finshell_state, only: state_t
   use finshell_status, only: status_ok
   use finshell_stress_free, only: stress_free
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: gathered_t, gather_elements, gather_motion, evaluate_gathered, predict_gathered, recover_gathered, freedoms, at_once

   integer, parameter :: at_once = 512 !< elements that a thread gathers where any number would do: as many as its caches hold

   !> Arrays of elements side by side, as evaluate_elements describes them; unallocated: absent.
   type :: gathered_t
      real(wp), allocatable :: x(:, :, :), u(:, :, :), q(:, :, :)
      real(wp), allocatable :: direction(:, :)
      real(wp), allocatable :: normal(:, :, :)
      integer, allocatable :: held(:, :)
      real(wp), allocatable :: thickness(:), offset(:)
      real(wp), allocatable :: growth(:, :, :)
      real(wp), allocatable :: begin(:, :), end(:, :) !< (numbers of an element, elements) of laws with states
      real(wp) :: time = 0, step = 0 !< at the end of the increment; since it began
   end type gathered_t

contains

   !> Freedoms of an element: displacements and rotations of three nodes, or displacements alone.
   pure integer function freedoms(section)
      type(section_t), intent(in) :: section
      freedoms = merge(n_membrane, n_shell, section%membrane)
   end function freedoms

   !> Gather a list of elements at a state.
   pure subroutine gather_elements(structure, state, list, gathered, held)
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      integer, intent(in) :: list(:) !< element numbers, of one section where they are to be evaluated
      type(gathered_t), intent(inout) :: gathered !< arrays that fit already are kept
      integer, intent(in), optional :: held(:, :) !< (3, elements of the structure), see finshell_held_side
      integer :: c, i, k, n, node
      n = size(list)
      if (allocated(gathered%x)) then
         if (size(gathered%x, 3) /= n) deallocate (gathered%x, gathered%u, gathered%q)
      end if
      if (.not. allocated(gathered%x)) then
         allocate (gathered%x(3, 3, n), gathered%u(3, 3, n), gathered%q(4, 3, n))
         if (allocated(gathered%direction)) deallocate (gathered%direction)
         if (allocated(gathered%normal)) deallocate (gathered%normal)
         if (allocated(gathered%held)) deallocate (gathered%held)
         if (allocated(gathered%thickness)) deallocate (gathered%thickness)
         if (allocated(gathered%offset)) deallocate (gathered%offset)
         if (allocated(structure%direction)) allocate (gathered%direction(3, n))
         if (allocated(structure%normal)) allocate (gathered%normal(3, 3, n))
         if (present(held)) allocate (gathered%held(3, n))
         if (allocated(structure%thickness)) allocate (gathered%thickness(n))
         if (allocated(structure%offset)) allocate (gathered%offset(n))
      end if
      if (allocated(structure%growths)) call gather_growth(structure, state, list, gathered%growth)
      if (allocated(state%past)) call gather_past(structure, state, list, gathered)
      do i = 1, n
         ! One by one: whole columns would be calls of memmove.
         do k = 1, 3
            node = structure%mesh%triangles(k, list(i))
            do c = 1, 3
               gathered%x(c, k, i) = structure%mesh%coordinates(c, node)
               gathered%u(c, k, i) = state%displacement(c, node)
               gathered%q(c, k, i) = state%rotation(c, node)
            end do
            gathered%q(4, k, i) = state%rotation(4, node)
         end do
         if (allocated(gathered%direction)) gathered%direction(:, i) = structure%direction(:, list(i))
         if (allocated(gathered%normal)) gathered%normal(:, :, i) = structure%normal(:, :, list(i))
         if (allocated(gathered%held) .and. present(held)) gathered%held(:, i) = held(:, list(i))
         if (allocated(gathered%thickness)) gathered%thickness(i) = structure%thickness(list(i))
         if (allocated(gathered%offset)) gathered%offset(i) = structure%offset(list(i))
      end do
   end subroutine gather_elements

   !> What the laws of a list of elements remember, as many numbers as the section of the first one has.
   pure subroutine gather_past(structure, state, list, gathered)
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      integer, intent(in) :: list(:)
      type(gathered_t), intent(inout) :: gathered
      integer :: i, n
      n = 0
      if (size(list) > 0) n = states_of(structure%sections(structure%element_section(list(1))))
      if (allocated(gathered%begin)) then
         if (size(gathered%begin, 1) /= n .or. size(gathered%begin, 2) /= size(list)) deallocate (gathered%begin, gathered%end)
      end if
      if (n == 0) return
      if (.not. allocated(gathered%begin)) allocate (gathered%begin(n, size(list)), gathered%end(n, size(list)))
      do i = 1, size(list)
         gathered%begin(:, i) = state%past%begin(:n, list(i))
      end do
      gathered%time = state%time
      gathered%step = max(0.0_wp, state%time - state%past%since)
   end subroutine gather_past

   !> Growth of the layers of a list of elements at a state, as many layers as the section of the first one has.
   pure subroutine gather_growth(structure, state, list, growth)
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      integer, intent(in) :: list(:)
      real(wp), allocatable, intent(inout) :: growth(:, :, :) !< (n_growth, layers, elements)
      integer :: i, layers, section
      layers = 0
      if (size(list) > 0) layers = size(structure%sections(structure%element_section(list(1)))%layers)
      if (allocated(growth)) then
         if (size(growth, 2) /= layers .or. size(growth, 3) /= size(list)) deallocate (growth)
      end if
      if (.not. allocated(growth)) allocate (growth(n_growth, layers, size(list)))
      do i = 1, size(list)
         section = structure%element_section(list(i))
         if (size(structure%sections(section)%layers) /= layers) then
            growth(:, :, i) = 0 ! of another section
         else
            growth(:, :, i) = stress_free(structure%growths, structure%sections(section)%layers, state, list(i))
         end if
      end do
   end subroutine gather_growth

   !> Displacements and spins of the nodes of a list of elements, u1 t1 u2 t2 u3 t3; of membranes the displacements.
   pure subroutine gather_motion(structure, motion, list, gathered)
      type(structure_t), intent(in) :: structure
      real(wp), intent(in) :: motion(:, :) !< (n_nodal, nodes)
      integer, intent(in) :: list(:)
      real(wp), intent(out) :: gathered(:, :) !< (freedoms of an element, size(list) or more)
      integer :: i, k, m
      m = size(gathered, 1)/n_corners
      do i = 1, size(list)
         do k = 1, n_corners
            gathered(m*(k - 1) + 1:m*k, i) = motion(:m, structure%mesh%triangles(k, list(i)))
         end do
      end do
   end subroutine gather_motion

   !> evaluate_elements, or evaluate_membranes, of gathered ones. What is not allocated on the side of the caller counts as absent.
   !> Forces and tangents are those of the freedoms that the elements have.
   subroutine evaluate_gathered(section, gathered, status, energy, force, tangent, resultants, toward, threads)
      type(section_t), intent(in) :: section
      type(gathered_t), intent(inout), target :: gathered !< what laws remember at the end is set
      integer(i4), intent(out), contiguous :: status(:)
      real(wp), intent(out), optional, contiguous :: energy(:), force(:, :), tangent(:, :, :)
      real(wp), intent(in), optional, contiguous :: resultants(:, :), toward(:, :)
      integer, intent(in), optional :: threads
      type(law_states_t), allocatable :: states
      if (section%membrane) then
         call evaluate_membranes(section, size(gathered%x, 3), gathered%x, gathered%u, status, energy, force, tangent, &
                                 gathered%direction, threads, toward, thickness=gathered%thickness, &
                                 growth=gathered%growth)
         return
      end if
      call point_to(gathered, section, states)
      call evaluate_elements(section, size(gathered%x, 3), gathered%x, gathered%u, gathered%q, rotation_quaternion, status, &
                             energy=energy, force=force, tangent=tangent, direction=gathered%direction, threads=threads, &
                             resultants=resultants, toward=toward, held=gathered%held, normal=gathered%normal, &
                             thickness=gathered%thickness, offset=gathered%offset, growth=gathered%growth, states=states)
   end subroutine evaluate_gathered

   !> What the laws of a section remember; unallocated, which counts as absent, where none does.
   subroutine point_to(gathered, section, states)
      type(gathered_t), intent(in), target :: gathered
      type(section_t), intent(in) :: section
      type(law_states_t), allocatable, intent(out) :: states
      if (.not. allocated(gathered%begin)) return
      if (size(gathered%begin, 1) /= states_of(section)) return
      allocate (states)
      states%begin => gathered%begin
      states%end => gathered%end
      states%time = gathered%time
      states%step = gathered%step
   end subroutine point_to

   !> predict_resultants of gathered ones.
   subroutine predict_gathered(section, gathered, increment, resultants, status, toward)
      type(section_t), intent(in) :: section
      type(gathered_t), intent(in), target :: gathered
      real(wp), intent(in), contiguous :: increment(:, :) !< (n_shell, elements)
      real(wp), intent(out), contiguous :: resultants(:, :) !< (n_resultants, elements)
      integer(i4), intent(out), contiguous :: status(:)
      real(wp), intent(in), optional, contiguous :: toward(:, :)
      type(law_states_t), allocatable :: states
      resultants = 0 ! membranes: mixed iteration has nothing to gain where there is no bending
      status = status_ok
      if (section%membrane) return
      call point_to(gathered, section, states)
      call predict_resultants(section, size(gathered%x, 3), gathered%x, gathered%u, gathered%q, increment, resultants, status, &
                              gathered%direction, toward, gathered%held, gathered%normal, thickness=gathered%thickness, &
                              offset=gathered%offset, growth=gathered%growth, states=states)
   end subroutine predict_gathered

   !> recover_fields of gathered ones.
   subroutine recover_gathered(section, gathered, fields, layers, raw, status, frame)
      type(section_t), intent(in) :: section
      type(gathered_t), intent(in), target :: gathered
      integer, intent(in) :: fields(:), layers
      real(wp), intent(out), contiguous :: raw(:, :), frame(:, :, :)
      integer(i4), intent(out), contiguous :: status(:, :)
      type(law_states_t), allocatable :: states
      call point_to(gathered, section, states)
      call recover_fields(section, size(gathered%x, 3), gathered%x, gathered%u, gathered%q, rotation_quaternion, fields, layers, &
                          raw, status, frame, gathered%direction, held=gathered%held, normal=gathered%normal, &
                          thickness=gathered%thickness, offset=gathered%offset, growth=gathered%growth, states=states)
   end subroutine recover_gathered
end module finshell_discretisation
