!> What a support holds at a node.
module finshell_node_support
   use finshell_error, only: error_t, raise, text_of
   use finshell_factor, only: by_constant_factor
   use finshell_freedoms, only: n_nodal, ux, uz
   use finshell_kinds, only: wp
   use finshell_rotation, only: cross_product
   use finshell_status, only: status_invalid_argument
   use finshell_support, only: support_t, node_support_t, constrain_displacement, constrain_rotation, support_components, &
      support_clamp, support_hinge, support_symmetry, axes_global, axes_given, axes_cylindrical
   implicit none
   private
   public :: add_support

contains

   !> The constraints of one support at one node.
   subroutine add_support(self, support, position, parts, error)
      type(node_support_t), intent(inout) :: self
      type(support_t), intent(in) :: support
      real(wp), intent(in) :: position(3)
      logical, intent(in) :: parts(2) !< whether it counts for displacements, for rotations
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: axes(3, 3), normal(3), first(3), second(3)
      logical :: fixed(n_nodal)
      real(wp) :: value(n_nodal)
      integer :: k

      fixed = support%fixed
      value = support%value
      select case (support%kind)
      case (support_components)
      case (support_clamp)
         fixed = .true.
      case (support_hinge)
         fixed = .false.
         fixed(ux:uz) = .true.
      case (support_symmetry)
         if (norm2(support%normal) <= 0) then
            call raise(error, status_invalid_argument, 'a symmetry plane needs a normal; (0, 0, 0) was given')
            return
         end if
         normal = support%normal/norm2(support%normal)
         first = 0
         first(minloc(abs(normal), 1)) = 1
         first = first - dot_product(first, normal)*normal
         first = first/norm2(first)
         second = cross_product(normal, first)
         if (parts(1)) call constrain_displacement(self, normal, 0.0_wp, by_constant_factor, error)
         if (parts(2) .and. .not. allocated(error)) call constrain_rotation(self, first, 0.0_wp, by_constant_factor, error)
         if (parts(2) .and. .not. allocated(error)) call constrain_rotation(self, second, 0.0_wp, by_constant_factor, error)
         return
      case default
         call raise(error, status_invalid_argument, 'unknown kind of support '//text_of(support%kind))
         return
      end select

      call support_axes(support, position, self%node, axes, error)
      do k = 1, 3
         if (allocated(error)) return
         if (fixed(k) .and. parts(1)) call constrain_displacement(self, axes(:, k), value(k), support%scaling, error)
         if (allocated(error)) return
         if (fixed(uz + k) .and. parts(2)) call constrain_rotation(self, axes(:, k), value(uz + k), support%scaling, error)
      end do
   end subroutine add_support

   !> The axes of a support at a position, as columns.
   subroutine support_axes(support, position, node, axes, error)
      type(support_t), intent(in) :: support
      real(wp), intent(in) :: position(3)
      integer, intent(in) :: node
      real(wp), intent(out) :: axes(3, 3)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), parameter :: identity(3, 3) = reshape(real([1, 0, 0, 0, 1, 0, 0, 0, 1], wp), [3, 3])
      real(wp) :: radius(3), axis(3)

      axes = identity
      select case (support%axes_kind)
      case (axes_global)
      case (axes_given)
         axes = support%axes
         if (maxval(abs(matmul(transpose(axes), axes) - identity)) > 1.0e-8_wp) &
            call raise(error, status_invalid_argument, 'the axes are not orthonormal')
      case (axes_cylindrical)
         if (norm2(support%axis) <= 0) then
            call raise(error, status_invalid_argument, 'cylindrical axes need a direction of the line; (0, 0, 0) was given')
            return
         end if
         axis = support%axis/norm2(support%axis)
         radius = position - support%origin
         radius = radius - dot_product(radius, axis)*axis
         if (norm2(radius) <= 1.0e-9_wp*norm2(position - support%origin) .or. norm2(radius) <= 0) then
            call raise(error, status_invalid_argument, 'node '//text_of(node)//' lies on the line of the cylindrical axes, where ' &
               //'the radial direction is not defined')
            return
         end if
         axes(:, 1) = radius/norm2(radius)
         axes(:, 3) = axis
         axes(:, 2) = cross_product(axes(:, 3), axes(:, 1))
      case default
         call raise(error, status_invalid_argument, 'unknown kind of axes '//text_of(support%axes_kind))
      end select
   end subroutine support_axes
end module finshell_node_support
