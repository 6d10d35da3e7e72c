!> Springs between the rotations of two nodes, or of a node and the ground.
!>
!> They go by the rotation vector theta = log(R2' R1) of the first end as the second sees it, |theta| <= pi, in axes that turn with
!> the second end from the global ones: energy W(theta), linear by axes, or any law along one axis d, by theta.d. A spin of the
!> first end less that of the second, a = R2'(s1 - s2), changes theta by H a (H: finshell_rotation), so with g = H' dW/dtheta the
!> moments are -R2 g on the first end and R2 g on the second. The second order has exp(-s2) exp(s1) = exp(s1 - s2 - s2 x s1/2 ..):
!> stiffness A = R2 sym((H' W'' + d(H' W')/dtheta) H) R2' between equal ends, and -A -+ spin(R2 g)/2 between the two.
module finshell_turn_spring
   use finshell_connector, only: connector_t, spring_rotation
   use finshell_equations, only: equations_t
   use finshell_factor, only: unscaled
   use finshell_freedoms, only: n_nodal, rx, rz
   use finshell_joined_load, only: joined_load_t
   use finshell_kinds, only: wp
   use finshell_quaternion, only: quaternion_conjugate, quaternion_product, quaternion_to_matrix, quaternion_to_rotation_vector
   use finshell_rotation, only: inverse_tangent_operator, inverse_tangent_transpose_derivative, spin
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: turn_spring_t, new_turn_spring

   type, extends(joined_load_t) :: turn_spring_t
      type(connector_t) :: connector
   contains
      procedure :: evaluate
      procedure :: energy
      procedure :: measure
      procedure :: add_geometric
   end type turn_spring_t

contains

   subroutine new_turn_spring(self, connector, equations)
      type(turn_spring_t), intent(out) :: self
      type(connector_t), intent(in) :: connector
      type(equations_t), intent(in) :: equations
      self%connector = connector
      self%scaling = unscaled
      self%has_energy = .true.
      call self%join(equations, connector%node, .true.)
   end subroutine new_turn_spring

   !> Relative rotation vector of one of them, and the axes in which it is.
   pure subroutine relative(self, b, state, theta, axes)
      class(turn_spring_t), intent(in) :: self
      integer, intent(in) :: b
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: theta(3), axes(3, 3)
      real(wp) :: q(4)
      q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
      if (self%nodes == 2) q = state%rotation(:, self%node(2, b))
      axes = quaternion_to_matrix(q)
      theta = quaternion_to_rotation_vector(quaternion_product(quaternion_conjugate(q), state%rotation(:, self%node(1, b))))
   end subroutine relative

   !> Energy and its first and second derivative at a relative rotation.
   pure subroutine potential(c, theta, w, first, second)
      type(connector_t), intent(in) :: c
      real(wp), intent(in) :: theta(3)
      real(wp), intent(out) :: w, first(3), second(3, 3)
      real(wp) :: f, tangent
      integer :: i
      if (c%kind == spring_rotation) then
         w = sum((0.5_wp*c%vector*theta + c%preload)*theta)
         first = c%vector*theta + c%preload
         second = 0
         do i = 1, 3
            second(i, i) = c%vector(i)
         end do
      else
         call c%law%evaluate(dot_product(theta, c%direction), 0.0_wp, w, f, tangent)
         first = f*c%direction
         second = tangent*spread(c%direction, 2, 3)*spread(c%direction, 1, 3)
      end if
      w = c%share*w
      first = c%share*first
      second = c%share*second
   end subroutine potential

   !> Moment and angle of one of them: about its axis, or the lengths of the vectors.
   pure subroutine measure(self, b, state, force, extension)
      class(turn_spring_t), intent(in) :: self
      integer, intent(in) :: b
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: force, extension
      real(wp) :: theta(3), axes(3, 3), w, first(3), second(3, 3)
      call relative(self, b, state, theta, axes)
      call potential(self%connector, theta, w, first, second)
      if (self%connector%kind == spring_rotation) then
         force = norm2(first)
         extension = norm2(theta)
      else
         force = dot_product(first, self%connector%direction)
         extension = dot_product(theta, self%connector%direction)
      end if
   end subroutine measure

   !> See finshell_connectors.
   subroutine add_geometric(self, structure, equations, state, motion, values)
      class(turn_spring_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: motion(:, :)
      real(wp), intent(inout) :: values(:)
      real(wp) :: force(2*n_nodal, self%count()), stiffness(2*n_nodal, 2*n_nodal, self%count()), k(2*n_nodal, 2*n_nodal)
      real(wp) :: change(2*n_nodal), half(3, 3)
      integer, parameter :: one = 0, two = n_nodal
      integer :: b
      if (self%nodes == 1) return
      call self%evaluate(structure, equations, state, force, 1.0_wp, stiffness)
      do b = 1, self%count()
         change = matmul(stiffness(:, :, b), [motion(:, self%node(1, b)), motion(:, self%node(2, b))])
         k = 0
         half = 0.5_wp*spin(change(two + rx:two + rz))
         k(one + rx:one + rz, two + rx:two + rz) = -half
         k(two + rx:two + rz, one + rx:one + rz) = half
         call self%blocks%add(b, k, values)
      end do
   end subroutine add_geometric

   subroutine evaluate(self, structure, equations, state, force, factor, stiffness)
      class(turn_spring_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      real(wp) :: theta(3), axes(3, 3), w, first(3), second(3, 3), h(3, 3), moment(3), a(3, 3)
      integer, parameter :: one = 0, two = n_nodal
      integer :: b
      force = 0
      if (present(stiffness)) stiffness = 0
      do b = 1, self%count()
         call relative(self, b, state, theta, axes)
         call potential(self%connector, theta, w, first, second)
         h = inverse_tangent_operator(theta)
         moment = matmul(axes, matmul(first, h))
         force(one + rx:one + rz, b) = -moment
         if (self%nodes == 2) force(two + rx:two + rz, b) = moment
         if (.not. present(stiffness)) cycle
         a = matmul(matmul(transpose(h), second) + inverse_tangent_transpose_derivative(theta, first), h)
         a = matmul(axes, matmul(0.5_wp*(a + transpose(a)), transpose(axes)))
         stiffness(one + rx:one + rz, one + rx:one + rz, b) = -factor*a
         if (self%nodes == 1) cycle
         stiffness(two + rx:two + rz, two + rx:two + rz, b) = -factor*a
         stiffness(one + rx:one + rz, two + rx:two + rz, b) = factor*(a + 0.5_wp*spin(moment))
         stiffness(two + rx:two + rz, one + rx:one + rz, b) = factor*(a - 0.5_wp*spin(moment))
      end do
      if (equations%n < 0 .or. size(structure%sections) < 0) force = 0
   end subroutine evaluate

   function energy(self, structure, equations, state)
      class(turn_spring_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp) :: energy, theta(3), axes(3, 3), w, first(3), second(3, 3)
      integer :: b
      energy = 0*equations%n*size(structure%sections)
      do b = 1, self%count()
         call relative(self, b, state, theta, axes)
         call potential(self%connector, theta, w, first, second)
         energy = energy + w
      end do
   end function energy
end module finshell_turn_spring
