!> The state of a mesh on its bisection: new nodes lie in the middle of the deformed, curved edges.
!>
!> An edge of the reference surface whose middle is off its chord by B is taken as the cubic with the end tangents chord + 4 B and
!> chord - 4 B. In the deformed state B turns with the middle and stretches with the chord, and the tangents, of the deformed
!> chord now, turn as their nodes do beyond the middle. The cubic along them says how far the middle is off the deformed chord along
!> the normal there; across the normal it is B, since rotations say nothing about shear. Rigid motions and bending to circular arcs
!> (to fourth order) come out as they are.
module finshell_state_transfer
   use finshell_edges, only: edges_t, find_edge, new_edges
   use finshell_equations, only: equations_t
   use finshell_held_motion, only: held_rotation
   use finshell_factor, only: factor_at
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t, twice_area_vector
   use finshell_quaternion, only: quaternion_conjugate, quaternion_product, quaternion_to_matrix, quaternion_to_rotation_vector, &
      rotation_vector_to_quaternion
   use finshell_rotation, only: cross_product
   use finshell_state, only: state_t
   implicit none
   private
   public :: carry_over, hold_supports

contains

   !> The state on the fine mesh, whose last nodes are the middles of the edges `ends` of the mesh before. Load factors and the
   !> number of the increment stay.
   pure function carry_over(state, mesh, turns, ends, fine) result(carried)
      type(state_t), intent(in) :: state
      type(mesh_t), intent(in) :: mesh, fine
      logical, intent(in) :: turns(:) !< (nodes before) those that have rotations
      integer, intent(in) :: ends(:, :) !< (2, new nodes)
      type(state_t) :: carried
      type(edges_t) :: edges
      real(wp), allocatable :: u(:, :), q(:, :)
      real(wp) :: normal(3)
      integer :: i, k, n, edge

      n = size(mesh%coordinates, 2)
      allocate (u(3, size(ends, 2)), q(4, size(ends, 2)), source=0.0_wp)
      q(1, :) = 1
      call new_edges(edges, mesh%triangles)
      do i = 1, size(ends, 2)
         associate (a => ends(1, i), b => ends(2, i))
            if (.not. (turns(a) .and. turns(b))) then
               u(:, i) = 0.5_wp*(state%displacement(:, a) + state%displacement(:, b))
               cycle
            end if
            edge = find_edge(edges, a, b)
            normal = 0
            do k = 1, 2
               if (edges%elements(k, edge) > 0) normal = normal + twice_area_vector(mesh, edges%elements(k, edge))
            end do
            call middle_of(mesh%coordinates(:, [a, b]), fine%coordinates(:, n + i), normal, state%displacement(:, [a, b]), &
                           state%rotation(:, [a, b]), u(:, i), q(:, i))
         end associate
      end do
      carried = state
      carried%displacement = reshape([state%displacement, u], [3, n + size(ends, 2)])
      carried%rotation = reshape([state%rotation, q], [4, n + size(ends, 2)])
   end function carry_over

   !> Displacement and rotation of the middle of one edge.
   pure subroutine middle_of(x, x_middle, normal, u, q, u_middle, q_middle)
      real(wp), intent(in) :: x(3, 2), x_middle(3), normal(3) !< reference: ends, middle, normal of any length
      real(wp), intent(in) :: u(3, 2), q(4, 2)
      real(wp), intent(out) :: u_middle(3), q_middle(4)
      real(wp) :: chord(3), bulge(3), deformed(3), off(3), tangent(3, 2), n(3), turned(3), turn(3), between(3)
      real(wp) :: stretch
      integer :: k

      chord = x(:, 2) - x(:, 1)
      bulge = x_middle - 0.5_wp*(x(:, 1) + x(:, 2))
      deformed = chord + u(:, 2) - u(:, 1)
      stretch = norm2(deformed)/norm2(chord)
      between = quaternion_to_rotation_vector(quaternion_product(q(:, 2), quaternion_conjugate(q(:, 1))))
      q_middle = quaternion_product(rotation_vector_to_quaternion(0.5_wp*between), q(:, 1))
      n = matmul(quaternion_to_matrix(q_middle), normal/norm2(normal))
      turned = stretch*matmul(quaternion_to_matrix(q_middle), bulge)
      do k = 1, 2
         tangent(:, k) = matmul(quaternion_to_matrix(quaternion_product(q(:, k), quaternion_conjugate(q_middle))), &
                                deformed - dot_product(deformed, n)*n + merge(4, -4, k == 1)*turned)
      end do
      off = (tangent(:, 1) - tangent(:, 2))/8
      off = turned + dot_product(off - turned, n)*n
      u_middle = 0.5_wp*(u(:, 1) + u(:, 2)) + off - bulge
      ! the normal stands across the cubic
      turned = 1.5_wp*deformed - 0.25_wp*sum(tangent, 2)
      turned = n - dot_product(n, turned)/dot_product(turned, turned)*turned
      turn = cross_product(n, turned/norm2(turned))
      if (norm2(turn) > 0) turn = turn*asin(min(1.0_wp, norm2(turn)))/norm2(turn)
      q_middle = quaternion_product(rotation_vector_to_quaternion(turn), q_middle)
   end subroutine middle_of

   !> Put what supports hold where they hold it at the factors of the state.
   pure subroutine hold_supports(equations, state)
      type(equations_t), intent(in) :: equations
      type(state_t), intent(inout) :: state
      real(wp) :: motion(n_nodal), u(3), v(3), axes(3, 3)
      integer :: i, k, m
      integer, allocatable :: moved_of(:)
      allocate (moved_of(size(equations%number, 2)), source=0)
      moved_of(equations%moved) = [(i, i=1, size(equations%moved))]
      do i = 1, size(moved_of)
         if (all(equations%number(:, i) > 0)) cycle
         axes = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
         if (equations%frame(i) > 0) axes = equations%frames(:, :, equations%frame(i))
         motion = 0
         m = moved_of(i)
         do k = 1, merge(size(equations%motion, 3), 0, m > 0)
            motion = motion + factor_at(state, k)*equations%motion(:, m, k)
         end do
         u = matmul(state%displacement(:, i) - motion(ux:uz), axes)
         where (equations%number(ux:uz, i) == 0) u = 0
         state%displacement(:, i) = motion(ux:uz) + matmul(axes, u)
         if (all(equations%number(rx:rz, i) > 0)) cycle
         if (m > 0) then
            if (equations%turned(m)) then
               state%rotation(:, i) = held_rotation(equations, m, state)
               cycle
            end if
            if (any(abs(motion(rx:rz)) > 0)) cycle
         end if
         v = matmul(quaternion_to_rotation_vector(state%rotation(:, i)), axes)
         do k = 1, 3
            if (equations%number(rx + k - 1, i) == 0) v(k) = 0
         end do
         state%rotation(:, i) = rotation_vector_to_quaternion(matmul(axes, v))
      end do
   end subroutine hold_supports
end module finshell_state_transfer
