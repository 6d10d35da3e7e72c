!> Follower loads on edges: a force per reference length that keeps its direction to the structure, and a moment per reference
!> length about the present edge. Both are half at each end of an edge.
!>
!> With the edge d from its first end to the second, counter-clockwise in its element, and e to the third node: t = d/|d|,
!> n = (d x e)/|d x e| the normal of the element and t x n, in the plane of the element and away from it. A side that two elements
!> share has half of each; its tangent is that of the first.
module finshell_follower_line
   use finshell_acting_load, only: append, load_item_t
   use finshell_equations, only: equations_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_freedoms, only: membrane_at, n_membrane, n_nodal, rx, rz, uz
   use finshell_joined_load, only: joined_load_t
   use finshell_kinds, only: wp
   use finshell_load, only: load_t
   use finshell_rotation, only: cross_product, spin
   use finshell_sides, only: side_list_t, sides_on
   use finshell_state, only: state_t
   use finshell_status, only: status_input_error
   use finshell_structure, only: structure_t, is_membrane
   implicit none
   private
   public :: add_follower_line, add_follower_moment, line_force

   type, extends(joined_load_t) :: follower_line_t
      real(wp) :: along(3) = 0 !< force per reference length: in the plane, along the normal, along the edge
      real(wp), allocatable :: length(:) !< (blocks) reference length, or the share of an element
      real(wp), allocatable :: sense(:) !< (blocks) of the tangent
   contains
      procedure :: evaluate => evaluate_force
   end type follower_line_t

   type, extends(joined_load_t) :: follower_moment_t
      real(wp) :: moment = 0 !< per reference length
      real(wp), allocatable :: length(:) !< (blocks)
   contains
      procedure :: evaluate => evaluate_moment
   end type follower_moment_t

contains

   !> `vector` of the load: see follower_line_t. Error: a force in the plane on an edge that two elements share, or more.
   subroutine add_follower_line(load, structure, equations, edges, list, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: edges(:, :)
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      type(follower_line_t) :: self
      type(side_list_t) :: sides
      integer :: i
      call sides_on(structure%mesh, edges, sides)
      i = findloc(sides%shared > 1, .true., dim=1)
      if (i > 0 .and. abs(load%vector(1)) > 0) then
         call raise(error, status_input_error, "load: '"//load%set//"' has an edge between nodes "//text_of(sides%nodes(1, i)) &
            //' and '//text_of(sides%nodes(2, i))//' on which '//text_of(sides%shared(i)) &
            //' elements meet: in the plane no side of it is outside')
         return
      end if
      self%along = load%vector
      self%length = sides%length/sides%shared
      self%sense = sides%sense
      self%scaling = load%scaling
      self%symmetric = .false.
      call self%join(equations, sides%nodes, .false.)
      call append(list, self)
   end subroutine add_follower_line

   !> First of the `numbers` of the load: moment per reference length about the edge. Error: an edge of membranes.
   subroutine add_follower_moment(load, structure, equations, edges, list, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: edges(:, :)
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      type(follower_moment_t) :: self
      type(side_list_t) :: sides
      integer, allocatable :: first(:)
      integer :: i
      call sides_on(structure%mesh, edges, sides)
      first = pack([(i, i=1, size(sides%element))], sides%first)
      if (any(is_membrane(structure, sides%element(first)))) then
         call raise(error, status_input_error, "load: '"//load%set//"' has edges of membranes, which bear no moments")
         return
      end if
      self%moment = load%numbers(1)
      self%length = sides%length(first)
      self%scaling = load%scaling
      self%symmetric = .false.
      call self%join(equations, sides%nodes(:2, first), .true.)
      call append(list, self)
   end subroutine add_follower_moment

   !> Direction of a force with components `along` (see follower_line_t) at positions x, and its derivative with these.
   pure subroutine line_force(along, x, force, derivative)
      real(wp), intent(in) :: along(3), x(3, 3) !< ends of the edge and the third node
      real(wp), intent(out) :: force(3)
      real(wp), intent(out), optional :: derivative(3, n_membrane)
      real(wp), dimension(3) :: d, e, a, t, n, unit, dd, de, da, dt, dn
      integer :: i
      d = x(:, 2) - x(:, 1)
      e = x(:, 3) - x(:, 1)
      a = cross_product(d, e)
      t = d/norm2(d)
      n = a/norm2(a)
      force = along(1)*cross_product(t, n) + along(2)*n + along(3)*t
      if (.not. present(derivative)) return
      do i = 1, n_membrane
         unit = 0
         unit(1 + mod(i - 1, 3)) = 1
         dd = 0
         de = 0
         if (i <= 3) dd = -unit
         if (i <= 3) de = -unit
         if (i > membrane_at(2) .and. i <= membrane_at(3)) dd = unit
         if (i > membrane_at(3)) de = unit
         da = cross_product(dd, e) + cross_product(d, de)
         dt = (dd - t*dot_product(t, dd))/norm2(d)
         dn = (da - n*dot_product(n, da))/norm2(a)
         derivative(:, i) = along(1)*(cross_product(dt, n) + cross_product(t, dn)) + along(2)*dn + along(3)*dt
      end do
   end subroutine line_force

   subroutine evaluate_force(self, structure, equations, state, force, factor, stiffness)
      class(follower_line_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      real(wp) :: x(3, 3), f(3), derivative(3, n_membrane), along(3)
      integer :: b, i
      do b = 1, self%count()
         do i = 1, 3
            x(:, i) = self%position(i, b, structure, state)
         end do
         along = 0.5_wp*self%length(b)*self%along*[1.0_wp, 1.0_wp, self%sense(b)]
         if (present(stiffness)) then
            call line_force(along, x, f, derivative)
            stiffness(:, :, b) = 0
            stiffness(:uz, :, b) = factor*derivative
            stiffness(uz + 1:2*uz, :, b) = factor*derivative
         else
            call line_force(along, x, f)
         end if
         force(:, b) = [f, f, 0*f]
      end do
      if (equations%n < 0) force = 0
   end subroutine evaluate_force

   !> The stiffness is that along exp(spin) R, which the turning of the moments is not part of (finshell_acting_load).
   subroutine evaluate_moment(self, structure, equations, state, force, factor, stiffness)
      class(follower_moment_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      real(wp) :: d(3), t(3), m(3), turn(3, 3)
      integer :: at, b, i
      force = 0
      if (present(stiffness)) stiffness = 0
      do b = 1, self%count()
         d = self%position(2, b, structure, state) - self%position(1, b, structure, state)
         t = d/norm2(d)
         m = 0.5_wp*self%moment*self%length(b)*t
         force(rx:rz, b) = m
         force(n_nodal + rx:n_nodal + rz, b) = m
         if (.not. present(stiffness)) cycle
         turn = -spread(t, 2, 3)*spread(t, 1, 3)
         do i = 1, 3
            turn(i, i) = turn(i, i) + 1
         end do
         turn = 0.5_wp*factor*self%moment*self%length(b)/norm2(d)*turn
         do at = 0, n_nodal, n_nodal
            stiffness(at + rx:at + rz, :uz, b) = -turn
            stiffness(at + rx:at + rz, n_nodal + 1:n_nodal + uz, b) = turn
            stiffness(at + rx:at + rz, at + rx:at + rz, b) = 0.5_wp*factor*spin(m)
         end do
      end do
      if (equations%n < 0) force = 0
   end subroutine evaluate_moment
end module finshell_follower_line
