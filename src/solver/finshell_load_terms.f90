!> What loads and moved supports add to the equations beside dead forces: pressures with their stiffness, the stiffness of dead
!> moments, and the forces due to the motion of held nodes.
module finshell_load_terms
   use finshell_kinds, only: wp, i4
   use finshell_rotation, only: spin
   use finshell_batch, only: evaluate_elements, rotation_quaternion
   use finshell_pressure, only: follower_pressure
   use finshell_mesh, only: mesh_t
   use finshell_structure, only: structure_t
   use finshell_state, only: state_t
   use finshell_equations, only: equations_t
   use finshell_external, only: external_t
   use finshell_assembly, only: assembly_t, add_element_contributions
   implicit none
   private
   public :: add_pressures, add_turning, add_motion

contains

   !> Pressures: force for a factor of 1 to unit_force. With values and rate: stiffness at the present factor to the matrix, and
   !> the force due to the motion of held nodes to rate.
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
               call follower_pressure(n, p, x, region%symmetric, region%origin, force, stiffness)
               stiffness = factor*stiffness
               call add_element_contributions(assembly, region%elements, force, unit_force(:, :, region%scaling), stiffness, values)
               if (present(rate)) call add_pressure_rate(mesh%triangles(:, region%elements), stiffness, equations, moved_of, &
                                                         active, rate)
               deallocate (stiffness)
            else
               call follower_pressure(n, p, x, region%symmetric, region%origin, force)
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

   !> Stiffness of nodal moments with respect to spins: -spin(m)/2.
   subroutine add_turning(loads, internal_force, assembly, values)
      type(external_t), intent(in) :: loads
      real(wp), intent(in) :: internal_force(:, :) !< (6, nodes)
      type(assembly_t), intent(in) :: assembly
      real(wp), intent(inout) :: values(:)
      real(wp), allocatable :: force(:, :), stiffness(:, :, :), unused(:, :)
      integer :: i, first
      if (size(loads%turning_nodes) == 0) return
      allocate (force(18, size(loads%turning_nodes)), stiffness(18, 18, size(loads%turning_nodes)), source=0.0_wp)
      allocate (unused(6, size(internal_force, 2)), source=0.0_wp)
      do i = 1, size(loads%turning_nodes)
         first = 6*loads%turning_corners(i) - 2
         stiffness(first:first + 2, first:first + 2, i) = 0.5_wp*spin(internal_force(4:6, loads%turning_nodes(i)))
      end do
      call add_element_contributions(assembly, loads%turning_elements, force, unused, stiffness, values)
   end subroutine add_turning

   !> Take the internal forces due to the motion of held nodes from rate.
   subroutine add_motion(structure, equations, moved_of, elements, state, active, rate)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: moved_of(:) !< (nodes) index into equations%moved, 0: not moved
      integer, intent(in) :: elements(:) !< those with a moved node
      type(state_t), intent(in) :: state
      integer, intent(in) :: active !< factor that changes: 1 load factor, 2 constant factor
      real(wp), intent(inout) :: rate(:, :) !< (6, nodes)
      real(wp) :: x(3, 3, 1), u(3, 3, 1), q(4, 3, 1), force(18, 1), tangent(18, 18, 1), motion(18), direction(3, 1)
      integer(i4) :: status(1)
      integer :: i, e, k, node

      do i = 1, size(elements)
         e = elements(i)
         motion = 0
         do k = 1, 3
            node = structure%mesh%triangles(k, e)
            x(:, k, 1) = structure%mesh%coordinates(:, node)
            u(:, k, 1) = state%displacement(:, node)
            q(:, k, 1) = state%rotation(:, node)
            if (moved_of(node) > 0) motion(6*k - 5:6*k) = equations%motion(:, moved_of(node), active)
         end do
         direction(:, 1) = [1, 0, 0]
         if (allocated(structure%direction)) direction(:, 1) = structure%direction(:, e)
         call evaluate_elements(structure%sections(structure%element_section(e)), 1, x, u, q, rotation_quaternion, &
            status, force=force, tangent=tangent, direction=direction, threads=1)
         motion = matmul(tangent(:, :, 1), motion)
         do k = 1, 3
            node = structure%mesh%triangles(k, e)
            rate(:, node) = rate(:, node) - motion(6*k - 5:6*k)
         end do
      end do
   end subroutine add_motion
end module finshell_load_terms
