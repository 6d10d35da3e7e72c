!> What dead moments and moved supports add to the equations: the stiffness of moments at nodes that turn, and the forces due to the
!> motion of held nodes.
module finshell_load_terms
   use finshell_kinds, only: wp, i4, lanes
   use finshell_freedoms, only: n_nodal, n_shell, rx, rz, shell_at
   use finshell_rotation, only: cross_product, spin
   use finshell_discretisation, only: evaluate_gathered, freedoms, gather_elements, gather_motion, gathered_t
   use finshell_structure, only: structure_t
   use finshell_state, only: state_t
   use finshell_equations, only: equations_t
   use finshell_held_motion, only: motion_at
   use finshell_factor, only: slope_of
   use finshell_external, only: external_t
   use finshell_joint_stiffness, only: add_at_node
   use finshell_assembly, only: assembly_t, add_element_contributions
   implicit none
   private
   public :: add_turning, turn_moments, add_motion, add_rate, moving_nodes, add_stiffness_times

contains

   !> Stiffness of nodal moments with respect to spins: -spin(m)/2.
   subroutine add_turning(loads, moments, assembly, values)
      type(external_t), intent(in) :: loads
      !> (n_nodal, nodes) internal forces, without those that bulges balance; those of dependent nodes are where these depend on
      real(wp), intent(in) :: moments(:, :)
      type(assembly_t), intent(in) :: assembly
      real(wp), intent(inout) :: values(:)
      real(wp), allocatable :: force(:, :), stiffness(:, :, :), unused(:, :)
      real(wp) :: own(n_nodal, n_nodal)
      integer, allocatable :: mine(:)
      integer :: i, at
      if (size(loads%turning_nodes) == 0) return
      own = 0
      do i = 1, size(loads%turning_nodes)
         if (loads%turning_elements(i) > 0) cycle
         own(rx:rz, rx:rz) = -0.5_wp*spin(moments(rx:rz, loads%turning_nodes(i)))
         call add_at_node(assembly%linked, loads%turning_nodes(i), own, values)
      end do
      mine = pack([(i, i=1, size(loads%turning_nodes))], loads%turning_elements > 0)
      allocate (force(n_shell, size(mine)), stiffness(n_shell, n_shell, size(mine)), source=0.0_wp)
      allocate (unused(n_nodal, size(moments, 2)), source=0.0_wp)
      do i = 1, size(mine)
         at = shell_at(loads%turning_corners(mine(i)))
         stiffness(at + rx:at + rz, at + rx:at + rz, i) = 0.5_wp*spin(moments(rx:rz, loads%turning_nodes(mine(i))))
      end do
      call add_element_contributions(assembly, loads%turning_elements(mine), force, unused, stiffness, values)
   end subroutine add_turning

   !> The moments of nodes turn with their spins: what the symmetric tangent leaves out of the change of the internal moments.
   pure subroutine turn_moments(moments, motion, force)
      real(wp), intent(in) :: moments(:, :) !< (n_nodal, nodes) internal forces and moments
      real(wp), intent(in) :: motion(:, :) !< (n_nodal, nodes) displacements and spins
      real(wp), intent(inout) :: force(:, :) !< (n_nodal, nodes) change of the internal forces
      integer :: i
      do i = 1, size(motion, 2)
         force(rx:rz, i) = force(rx:rz, i) - 0.5_wp*cross_product(moments(rx:rz, i), motion(rx:rz, i))
      end do
   end subroutine turn_moments

   !> Displacements and spins of held nodes per change of a factor, and of what depends on them.
   pure function motion_of_held(equations, state, active) result(motion)
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      integer, intent(in) :: active !< factor that changes (finshell_factor)
      real(wp) :: motion(n_nodal, size(equations%frame))
      integer :: i
      motion = 0
      do i = 1, size(equations%moved)
         motion(:, equations%moved(i)) = motion_at(equations, i, active, state)
      end do
      call equations%links%extend(motion)
   end function motion_of_held

   !> Add the change of forces with a factor and with those that follow it.
   pure subroutine add_rate(state, active, unit_force, rate)
      type(state_t), intent(in) :: state
      integer, intent(in) :: active !< factor that changes (finshell_factor)
      real(wp), intent(in) :: unit_force(:, :, :) !< (n_nodal, nodes, factors) for factors of 1
      real(wp), intent(inout) :: rate(:, :) !< (n_nodal, nodes)
      real(wp) :: slope
      integer :: k
      do k = 1, size(unit_force, 3)
         slope = slope_of(state, active, k)
         if (abs(slope) > 0) rate = rate + slope*unit_force(:, :, k)
      end do
   end subroutine add_rate

   !> (nodes) Those that supports move, and those that depend on them.
   pure function moving_nodes(equations) result(moves)
      type(equations_t), intent(in) :: equations
      logical :: moves(size(equations%frame))
      integer :: r
      moves = .false.
      moves(equations%moved) = .true.
      if (.not. equations%links%any()) return
      associate (links => equations%links)
         do r = 1, size(links%node)
            moves(links%node(r)) = moves(links%node(r)) .or. any(moves(links%master(links%first(r):links%first(r + 1) - 1)))
         end do
      end associate
   end function moving_nodes

   !> Take the internal forces due to the motion of held nodes from rate, and add what the loads change by.
   subroutine add_motion(structure, equations, loads, elements, state, active, internal_force, external_force, rate, toward)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(external_t), intent(in) :: loads
      integer, intent(in) :: elements(:) !< those with a moved node
      type(state_t), intent(in) :: state
      integer, intent(in) :: active !< factor that changes (finshell_factor)
      real(wp), intent(in) :: internal_force(:, :), external_force(:, :) !< (n_nodal, nodes) at the state
      real(wp), intent(inout) :: rate(:, :) !< (n_nodal, nodes)
      real(wp), intent(in), optional :: toward(:, :) !< (n_nodal, nodes) see `assemble`
      real(wp), allocatable :: motion(:, :)
      if (size(equations%moved) == 0) return
      motion = motion_of_held(equations, state, active)
      call loads%add_change(structure, equations, state, motion, rate)
      motion = -motion
      call add_stiffness_times(structure, equations, elements, state, motion, rate, toward)
      call turn_moments(internal_force, motion, rate)
      call equations%links%turn_arms(state, internal_force - external_force, motion, rate)
   end subroutine add_motion

   !> Add the change of the internal forces of some elements with the motion of their nodes, linearised at a state.
   subroutine add_stiffness_times(structure, equations, elements, state, motion, force, toward)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: elements(:)
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: motion(:, :) !< (n_nodal, nodes) displacements and spins
      real(wp), intent(inout) :: force(:, :) !< (n_nodal, nodes)
      real(wp), intent(in), optional :: toward(:, :) !< (n_nodal, nodes) see `assemble`
      real(wp), allocatable :: heading(:, :) ! unallocated it counts as absent in the call
      real(wp), allocatable :: f(:, :), k(:, :, :), moved(:, :)
      type(gathered_t) :: g
      integer(i4) :: status(lanes)
      integer :: first, i, j, last, m, section

      first = 1
      do while (first <= size(elements))
         section = structure%element_section(elements(first))
         last = first
         do while (last < size(elements) .and. last - first + 1 < lanes)
            if (structure%element_section(elements(last + 1)) /= section) exit
            last = last + 1
         end do
         m = freedoms(structure%sections(section))
         allocate (f(m, lanes), k(m, m, lanes), moved(m, lanes))
         if (present(toward)) allocate (heading(m, lanes))
         associate (mine => elements(first:last))
            if (present(toward)) call gather_motion(structure, toward, mine, heading)
            call gather_elements(structure, state, mine, g, equations%held)
            call gather_motion(structure, motion, mine, moved)
            call evaluate_gathered(structure%sections(section), g, status, force=f, tangent=k, toward=heading, threads=1)
            do i = 1, size(mine)
               moved(:, i) = matmul(k(:, :, i), moved(:, i))
               do j = 1, 3
                  associate (node => structure%mesh%triangles(j, mine(i)))
                     force(:m/3, node) = force(:m/3, node) + moved(m/3*(j - 1) + 1:m/3*j, i)
                  end associate
               end do
            end do
         end associate
         deallocate (f, k, moved)
         if (allocated(heading)) deallocate (heading)
         first = last + 1
      end do
   end subroutine add_stiffness_times
end module finshell_load_terms
