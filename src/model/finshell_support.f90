!> Supports: what is held at the nodes of a named set, and the axes in which it is held.
!>
!> Each support adds constraints "component along a unit direction = value" to the displacement and to the rotation of its
!> nodes. All supports of a node are merged: the constrained directions of the displacement and of the rotation span two
!> subspaces, and the node gets one orthonormal set of axes in which both are spanned by axes. Two planes of symmetry that
!> meet at any angle are therefore fine; only different values for the same direction, or subspaces without common axes, are errors.
module finshell_support
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_nodal, uz
   use finshell_rotation, only: cross_product
   use finshell_status, only: status_invalid_argument
   use finshell_error, only: error_t, raise, text_of
   use finshell_factor, only: by_load_factor, by_constant_factor
   use finshell_span, only: span_t
   implicit none
   private
   public :: support_t, node_support_t
   public :: constrain_displacement, constrain_rotation, settle_axes
   public :: support_components, support_clamp, support_hinge, support_symmetry
   public :: axes_global, axes_given, axes_cylindrical

   !> Kinds: chosen components; all; the three displacements; a plane of symmetry (displacement along the normal and
   !> rotations about the two axes in the plane).
   integer, parameter :: support_components = 0, support_clamp = 1, support_hinge = 2, support_symmetry = 3
   !> Axes of a support: global; the columns of `axes`; radial, tangential and axial about a line.
   integer, parameter :: axes_global = 0, axes_given = 1, axes_cylindrical = 2

   type :: support_t
      character(len=:), allocatable :: node_set
      integer :: kind = support_components
      logical :: fixed(n_nodal) = .false. !< support_components: what is held (finshell_freedoms), in the axes of the support
      !> Prescribed values of held components. Rotations: with one or two held, turned about the fixed axis; with all three
      !> held, a rotation vector.
      real(wp) :: value(n_nodal) = 0
      integer :: scaling = by_load_factor !< what scales the values (finshell_factor)
      type(span_t) :: span !< steps in which it is there
      real(wp) :: normal(3) = 0 !< support_symmetry: normal of the plane, any length
      integer :: axes_kind = axes_global
      real(wp) :: axes(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3]) !< axes_given: orthonormal columns
      real(wp) :: origin(3) = 0 !< axes_cylindrical: a point of the line
      real(wp) :: axis(3) = [0, 0, 1] !< axes_cylindrical: direction of the line
   end type support_t

   !> What is held at one node, merged from all its supports.
   type :: node_support_t
      integer :: node = 0
      integer :: displacements = 0 !< number of constrained displacement directions
      integer :: rotations = 0
      real(wp) :: displacement_axes(3, 3) = 0 !< the first `displacements` columns are orthonormal and span what is held
      real(wp) :: rotation_axes(3, 3) = 0
      !> (3, factors) prescribed vectors (global, within the held subspace), as many as were prescribed; unallocated: none.
      real(wp), allocatable :: displacement_value(:, :), rotation_value(:, :)
   end type node_support_t

   real(wp), parameter :: tolerance = 1.0e-8_wp !< of unit directions: below it two directions are the same

contains

   !> Hold the displacement of a node along a unit direction at a value.
   pure subroutine constrain_displacement(self, direction, value, scaling, error)
      type(node_support_t), intent(inout) :: self
      real(wp), intent(in) :: direction(3), value
      integer, intent(in) :: scaling !< of the value (finshell_factor)
      type(error_t), allocatable, intent(inout) :: error
      call constrain(self%displacements, self%displacement_axes, self%displacement_value, direction, value, scaling, &
         self%node, 'displacement', error)
   end subroutine constrain_displacement

   !> Hold the rotation of a node about a unit direction at a value.
   pure subroutine constrain_rotation(self, direction, value, scaling, error)
      type(node_support_t), intent(inout) :: self
      real(wp), intent(in) :: direction(3), value
      integer, intent(in) :: scaling
      type(error_t), allocatable, intent(inout) :: error
      call constrain(self%rotations, self%rotation_axes, self%rotation_value, direction, value, scaling, &
         self%node, 'rotation', error)
   end subroutine constrain_rotation

   !> Add one constraint to a subspace; a direction already held must be held at the same value.
   pure subroutine constrain(count, axes, values, direction, value, scaling, node, what, error)
      integer, intent(inout) :: count
      real(wp), intent(inout) :: axes(3, 3)
      real(wp), allocatable, intent(inout) :: values(:, :)
      real(wp), intent(in) :: direction(3), value
      integer, intent(in) :: scaling
      integer, intent(in) :: node
      character(len=*), intent(in) :: what
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: wanted(:), held(:), grown(:, :)
      real(wp) :: rest(3), length, rounding
      integer :: k
      if (.not. allocated(values)) allocate (values(3, max(scaling, by_constant_factor)), source=0.0_wp)
      if (size(values, 2) < scaling) then
         allocate (grown(3, scaling), source=0.0_wp)
         grown(:, :size(values, 2)) = values
         call move_alloc(grown, values)
      end if
      allocate (wanted(size(values, 2)), source=0.0_wp)
      wanted(scaling) = value
      rest = direction
      do k = 1, count
         rest = rest - dot_product(axes(:, k), direction)*axes(:, k)
      end do
      length = norm2(rest)
      held = matmul(direction, values)
      if (length > tolerance .and. count < 3) then
         count = count + 1
         axes(:, count) = rest/length
         do k = 1, size(values, 2)
            values(:, k) = values(:, k) + (wanted(k) - held(k))/length*axes(:, count)
         end do
      else
         rounding = 1.0e-6_wp*max(maxval(abs(values)), abs(value))
         if (any(abs(wanted - held) > rounding)) call raise(error, status_invalid_argument, 'node '//text_of(node)//': the ' &
            //what//' is prescribed as '//text_of(real(sum(held), kind(1.0d0)))//' and as ' &
            //text_of(real(value, kind(1.0d0)))//' along the same direction; give it one value')
      end if
   end subroutine constrain

   !> Orthonormal axes (columns) such that held displacements and held rotations are each spanned by some of them.
   !> Global axes are kept wherever they serve. An error names the node when no such axes exist.
   pure subroutine settle_axes(self, axes, held, global, error)
      type(node_support_t), intent(in) :: self
      real(wp), intent(out) :: axes(3, 3)
      logical, intent(out) :: held(n_nodal) !< components constrained in these axes
      logical, intent(out) :: global !< the axes are the global ones
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: first(3), second(3)
      logical :: has_first, has_second
      integer :: k
      axes = reshape(real([1, 0, 0, 0, 1, 0, 0, 0, 1], wp), [3, 3])
      global = aligned(self%displacements, self%displacement_axes, axes) .and. aligned(self%rotations, self%rotation_axes, axes)
      if (.not. global) then
         call special_line(self%displacements, self%displacement_axes, has_first, first)
         call special_line(self%rotations, self%rotation_axes, has_second, second)
         if (.not. has_first) first = second
         if (has_first .and. has_second) then
            if (abs(dot_product(first, second)) > 1 - tolerance) then
               has_second = .false.
            else if (abs(dot_product(first, second)) > sqrt(tolerance)) then
               call raise(error, status_invalid_argument, 'node '//text_of(self%node)//': the axes of its supports contradict ' &
                  //'each other: displacements and rotations are held along oblique directions; use one set of axes at this node')
               held = .false.
               return
            end if
         else
            has_second = .false.
         end if
         axes(:, 1) = first
         if (has_second) then
            second = second - dot_product(first, second)*first
            axes(:, 2) = second/norm2(second)
         else
            axes(:, 2) = any_normal(first)
         end if
         axes(:, 3) = cross_product(axes(:, 1), axes(:, 2))
      end if
      do k = 1, 3
         held(k) = inside(axes(:, k), self%displacements, self%displacement_axes)
         held(uz + k) = inside(axes(:, k), self%rotations, self%rotation_axes)
      end do
   end subroutine settle_axes

   !> The line that characterises a subspace of dimension 1 (itself) or 2 (its normal); dimensions 0 and 3 have none.
   pure subroutine special_line(count, basis, exists, line)
      integer, intent(in) :: count
      real(wp), intent(in) :: basis(3, 3)
      logical, intent(out) :: exists
      real(wp), intent(out) :: line(3)
      exists = count == 1 .or. count == 2
      line = [1, 0, 0]
      if (count == 1) line = basis(:, 1)
      if (count == 2) line = cross_product(basis(:, 1), basis(:, 2))
   end subroutine special_line

   !> Is the subspace spanned by some of the axes?
   pure function aligned(count, basis, axes) result(yes)
      integer, intent(in) :: count
      real(wp), intent(in) :: basis(3, 3), axes(3, 3)
      logical :: yes
      integer :: k, inside_count
      inside_count = 0
      do k = 1, 3
         if (inside(axes(:, k), count, basis)) inside_count = inside_count + 1
      end do
      yes = inside_count == count
   end function aligned

   !> Does a unit vector lie in the subspace?
   pure function inside(direction, count, basis) result(yes)
      real(wp), intent(in) :: direction(3), basis(3, 3)
      integer, intent(in) :: count
      logical :: yes
      real(wp) :: rest(3)
      integer :: k
      rest = direction
      do k = 1, count
         rest = rest - dot_product(basis(:, k), direction)*basis(:, k)
      end do
      yes = norm2(rest) < 10*tolerance
   end function inside

   pure function any_normal(a) result(b)
      real(wp), intent(in) :: a(3)
      real(wp) :: b(3)
      b = 0
      b(minloc(abs(a), 1)) = 1
      b = b - dot_product(a, b)*a
      b = b/norm2(b)
   end function any_normal
end module finshell_support
