!> What loads and moved supports add to the equations beside dead forces: pressures and loads on bulges with their stiffness, the
!> stiffness of dead moments, and the forces due to the motion of held nodes.
!>
!> Bulges depend on the rotations of the nodes: those of loaded sides in the surface, and the caps of elements under pressure.
module finshell_load_terms
   use finshell_kinds, only: wp, i4, lanes
   use finshell_rotation, only: cross_product, spin
   use finshell_discretisation, only: evaluate_gathered, freedoms, gather_elements, gather_motion, gathered_t
   use finshell_line_load, only: bulge_load
   use finshell_pressure, only: follower_pressure
   use finshell_cap_terms, only: caps_at
   use finshell_quaternion, only: quaternion_to_matrix
   use finshell_mesh, only: mesh_t
   use finshell_structure, only: structure_t
   use finshell_state, only: state_t
   use finshell_equations, only: equations_t, motion_at
   use finshell_external, only: external_t, side_load_t
   use finshell_assembly, only: assembly_t, add_element_contributions
   implicit none
   private
   public :: add_pressures, add_bulges, change_of_bulges, add_turning, turn_moments, motion_of_held, add_motion, &
      add_stiffness_times

contains

   !> Pressures: force for a factor of 1 to unit_force. With values and rate: stiffness at the present factor to the matrix, and
   !> the force due to the motion of held nodes to rate.
   !>
   !> Always in the follower form: it is the pressure at held nodes too, so reactions are right. Where the symmetric form is
   !> exact (finshell_pressure_region), the stiffness of the follower form becomes symmetric when it is assembled.
   subroutine add_pressures(loads, equations, moved_of, mesh, state, assembly, active, unit_force, values, rate)
      type(external_t), intent(in) :: loads
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: moved_of(:) !< (nodes) index into equations%moved, 0: not moved
      type(mesh_t), intent(in) :: mesh
      type(state_t), intent(in) :: state
      type(assembly_t), intent(in) :: assembly
      integer, intent(in) :: active !< factor that changes: 1 load factor, 2 constant factor
      real(wp), intent(inout) :: unit_force(:, :, :) !< (6, nodes, 2)
      real(wp), intent(inout), optional :: values(:) !< of the matrix
      real(wp), intent(inout), optional :: rate(:, :) !< (6, nodes)
      real(wp), allocatable :: x(:, :, :), p(:), force(:, :), stiffness(:, :, :)
      real(wp) :: factor
      integer :: i, j, k, n, node

      do i = 1, size(loads%pressures)
         associate (region => loads%pressures(i))
            n = size(region%elements)
            factor = merge(state%load_factor, state%constant_factor, region%scaling == 1)
            allocate (x(3, 3, n), p(n), force(9, n))
            do j = 1, n
               do k = 1, 3
                  node = mesh%triangles(k, region%elements(j))
                  x(:, k, j) = mesh%coordinates(:, node) + state%displacement(:, node)
               end do
            end do
            p = region%pressure
            if (present(values) .and. abs(factor) > 0) then
               allocate (stiffness(9, 9, n))
               call follower_pressure(n, p, x, .false., region%origin, force, stiffness)
               stiffness = factor*stiffness
               call add_element_contributions(assembly, region%elements, force, unit_force(:, :, region%scaling), stiffness, values)
               if (present(rate)) call add_pressure_rate(mesh%triangles(:, region%elements), stiffness, equations, moved_of, &
                                                         active, rate)
               deallocate (stiffness)
            else
               call follower_pressure(n, p, x, .false., region%origin, force)
               call add_element_contributions(assembly, region%elements, force, unit_force(:, :, region%scaling))
            end if
            deallocate (x, p, force)
         end associate
      end do
   end subroutine add_pressures

   !> Change of the pressure forces with the motion of held nodes.
   pure subroutine add_pressure_rate(triangles, stiffness, equations, moved_of, active, rate)
      integer, intent(in) :: triangles(:, :), moved_of(:), active
      real(wp), intent(in) :: stiffness(:, :, :)
      type(equations_t), intent(in) :: equations
      real(wp), intent(inout) :: rate(:, :)
      real(wp) :: motion(9)
      integer :: j, k, node
      do j = 1, size(triangles, 2)
         if (all(moved_of(triangles(:, j)) == 0)) cycle
         motion = 0
         do k = 1, 3
            node = moved_of(triangles(k, j))
            if (node > 0) motion(3*k - 2:3*k) = equations%motion(1:3, node, active)
         end do
         motion = matmul(stiffness(:, :, j), motion)
         do k = 1, 3
            rate(1:3, triangles(k, j)) = rate(1:3, triangles(k, j)) + motion(3*k - 2:3*k)
         end do
      end do
   end subroutine add_pressure_rate

   !> Loads on bulges: forces and moments for a factor of 1 to unit_force; with values, the stiffness at the present factor to the
   !> matrix.
   subroutine add_bulges(loads, equations, structure, state, assembly, unit_force, values)
      type(external_t), intent(in) :: loads
      type(equations_t), intent(in) :: equations
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      type(assembly_t), intent(in) :: assembly
      real(wp), intent(inout) :: unit_force(:, :, :) !< (6, nodes, 2)
      real(wp), intent(inout), optional :: values(:) !< of the matrix
      real(wp), allocatable :: force(:, :), stiffness(:, :, :)
      integer, allocatable :: mine(:)
      integer :: i, scaling
      do scaling = 1, 2
         mine = pack([(i, i=1, size(loads%sides))], loads%sides%scaling == scaling)
         if (size(mine) == 0) cycle
         allocate (force(18, size(mine)))
         if (present(values)) then
            allocate (stiffness(18, 18, size(mine)))
            do i = 1, size(mine)
               call side_force(loads%sides(mine(i)), structure%mesh, state, force(:, i), stiffness(:, :, i))
            end do
            stiffness = merge(state%load_factor, state%constant_factor, scaling == 1)*stiffness
            call add_element_contributions(assembly, loads%sides(mine)%element, force, unit_force(:, :, scaling), stiffness, values)
            deallocate (stiffness)
         else
            do i = 1, size(mine)
               call side_force(loads%sides(mine(i)), structure%mesh, state, force(:, i))
            end do
            call add_element_contributions(assembly, loads%sides(mine)%element, force, unit_force(:, :, scaling))
         end if
         deallocate (force)
      end do
      do i = 1, size(loads%pressures)
         associate (region => loads%pressures(i))
            if (size(region%curved) == 0) cycle
            allocate (force(18, size(region%curved)))
            if (present(values)) then
               allocate (stiffness(18, 18, size(region%curved)))
               call caps_at(structure, region%curved, state, force=force, stiffness=stiffness, held=equations%held)
               force = region%pressure*force
               stiffness = (merge(state%load_factor, state%constant_factor, region%scaling == 1)*region%pressure)*stiffness
               call add_element_contributions(assembly, region%curved, force, unit_force(:, :, region%scaling), stiffness, values)
               deallocate (stiffness)
            else
               call caps_at(structure, region%curved, state, force=force, held=equations%held)
               force = region%pressure*force
               call add_element_contributions(assembly, region%curved, force, unit_force(:, :, region%scaling))
            end if
            deallocate (force)
         end associate
      end do
   end subroutine add_bulges

   !> Change of the forces on bulges with a motion of the nodes, at the present factors.
   subroutine change_of_bulges(loads, equations, structure, state, motion, change)
      type(external_t), intent(in) :: loads
      type(equations_t), intent(in) :: equations
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: motion(:, :) !< (6, nodes) displacements and spins
      real(wp), intent(inout) :: change(:, :) !< (6, nodes) is added to
      real(wp), allocatable :: forces(:, :), stiffnesses(:, :, :)
      real(wp) :: force(18), stiffness(18, 18)
      integer :: i, j
      do i = 1, size(loads%sides)
         call side_force(loads%sides(i), structure%mesh, state, force, stiffness)
         call add_change(loads%sides(i)%element, factor(loads%sides(i)%scaling), force, stiffness)
      end do
      do i = 1, size(loads%pressures)
         associate (region => loads%pressures(i))
            if (size(region%curved) == 0) cycle
            allocate (forces(18, size(region%curved)), stiffnesses(18, 18, size(region%curved)))
            call caps_at(structure, region%curved, state, force=forces, stiffness=stiffnesses, held=equations%held)
            do j = 1, size(region%curved)
               call add_change(region%curved(j), factor(region%scaling)*region%pressure, forces(:, j), stiffnesses(:, :, j))
            end do
            deallocate (forces, stiffnesses)
         end associate
      end do

   contains

      pure real(wp) function factor(scaling)
         integer, intent(in) :: scaling
         factor = merge(state%load_factor, state%constant_factor, scaling == 1)
      end function factor

      !> Of one element. The symmetric stiffness leaves out that moments turn with the nodes.
      subroutine add_change(element, factor, force, stiffness)
         integer, intent(in) :: element
         real(wp), intent(in) :: factor, force(18), stiffness(18, 18)
         real(wp) :: f(6, 3), moment(6, 3)
         integer :: k
         associate (nodes => structure%mesh%triangles(:, element))
            moment = reshape(force, [6, 3])
            f = reshape(matmul(stiffness, reshape(motion(:, nodes), [18])), [6, 3])
            do k = 1, 3
               f(4:6, k) = f(4:6, k) - 0.5_wp*cross_product(moment(4:6, k), motion(4:6, nodes(k)))
               change(:, nodes(k)) = change(:, nodes(k)) + factor*f(:, k)
            end do
         end associate
      end subroutine add_change
   end subroutine change_of_bulges

   !> One side: forces at the nodes of its element in turn, for a factor of 1.
   pure subroutine side_force(side, mesh, state, force, stiffness)
      type(side_load_t), intent(in) :: side
      type(mesh_t), intent(in) :: mesh
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: force(18)
      real(wp), intent(out), optional :: stiffness(18, 18)
      real(wp) :: x(3, 3), t(3, 2), f(18), k(18, 18)
      integer :: i, j, node, place(18)
      do i = 1, 3
         node = mesh%triangles(side%corners(i), side%element)
         x(:, i) = mesh%coordinates(:, node) + state%displacement(:, node)
         if (i < 3) t(:, i) = matmul(quaternion_to_matrix(state%rotation(:, node)), side%direction)
         place(6*i - 5:6*i) = [(6*(side%corners(i) - 1) + j, j=1, 6)]
      end do
      if (present(stiffness)) then
         call bulge_load(side%length, side%vector, x, t, f, k)
         stiffness(place, place) = k
      else
         call bulge_load(side%length, side%vector, x, t, f)
      end if
      force(place) = f
   end subroutine side_force

   !> Stiffness of nodal moments with respect to spins: -spin(m)/2.
   subroutine add_turning(loads, moments, assembly, values)
      type(external_t), intent(in) :: loads
      real(wp), intent(in) :: moments(:, :) !< (6, nodes) internal forces, without those that bulges balance
      type(assembly_t), intent(in) :: assembly
      real(wp), intent(inout) :: values(:)
      real(wp), allocatable :: force(:, :), stiffness(:, :, :), unused(:, :)
      integer :: i, first
      if (size(loads%turning_nodes) == 0) return
      allocate (force(18, size(loads%turning_nodes)), stiffness(18, 18, size(loads%turning_nodes)), source=0.0_wp)
      allocate (unused(6, size(moments, 2)), source=0.0_wp)
      do i = 1, size(loads%turning_nodes)
         first = 6*loads%turning_corners(i) - 2
         stiffness(first:first + 2, first:first + 2, i) = 0.5_wp*spin(moments(4:6, loads%turning_nodes(i)))
      end do
      call add_element_contributions(assembly, loads%turning_elements, force, unused, stiffness, values)
   end subroutine add_turning

   !> The moments of nodes turn with their spins: what the symmetric tangent leaves out of the change of the internal moments.
   pure subroutine turn_moments(moments, motion, force)
      real(wp), intent(in) :: moments(:, :) !< (6, nodes) internal forces and moments
      real(wp), intent(in) :: motion(:, :) !< (6, nodes) displacements and spins
      real(wp), intent(inout) :: force(:, :) !< (6, nodes) change of the internal forces
      integer :: i
      do i = 1, size(motion, 2)
         force(4:6, i) = force(4:6, i) - 0.5_wp*cross_product(moments(4:6, i), motion(4:6, i))
      end do
   end subroutine turn_moments

   !> Displacements and spins of held nodes per change of a factor.
   pure function motion_of_held(equations, state, active) result(motion)
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      integer, intent(in) :: active !< factor that changes: 1 load factor, 2 constant factor
      real(wp) :: motion(6, size(equations%frame))
      integer :: i
      motion = 0
      do i = 1, size(equations%moved)
         motion(:, equations%moved(i)) = motion_at(equations, i, active, state%load_factor, state%constant_factor)
      end do
   end function motion_of_held

   !> Take the internal forces due to the motion of held nodes from rate.
   subroutine add_motion(structure, equations, elements, state, active, internal_force, rate, toward)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: elements(:) !< those with a moved node
      type(state_t), intent(in) :: state
      integer, intent(in) :: active !< factor that changes: 1 load factor, 2 constant factor
      real(wp), intent(in) :: internal_force(:, :) !< (6, nodes) at the state
      real(wp), intent(inout) :: rate(:, :) !< (6, nodes)
      real(wp), intent(in), optional :: toward(:, :) !< (6, nodes) see `assemble`
      real(wp), allocatable :: motion(:, :)
      if (size(elements) == 0) return
      motion = -motion_of_held(equations, state, active)
      call add_stiffness_times(structure, equations, elements, state, motion, rate, toward)
      call turn_moments(internal_force, motion, rate)
   end subroutine add_motion

   !> Add the change of the internal forces of some elements with the motion of their nodes, linearised at a state.
   subroutine add_stiffness_times(structure, equations, elements, state, motion, force, toward)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: elements(:)
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: motion(:, :) !< (6, nodes) displacements and spins
      real(wp), intent(inout) :: force(:, :) !< (6, nodes)
      real(wp), intent(in), optional :: toward(:, :) !< (6, nodes) see `assemble`
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
