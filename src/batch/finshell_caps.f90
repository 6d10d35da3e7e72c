!> Caps of many elements: the volume between the facets and their curved surface, which a pressure on the facets misses.
module finshell_caps
   use finshell_block, only: bad_shape, check_input, gather, separate
   use finshell_element, only: block_t, cap_block
   use finshell_environment, only: environment_t, hold, release
   use finshell_kinds, only: wp, i4, lanes
   use finshell_freedoms, only: n_shell
   use finshell_evaluation, only: level_energy, level_force, level_tangent
   use finshell_status, only: status_invalid_argument, status_ok
   implicit none
   private
   public :: evaluate_caps

contains

   !> Volume of the cap of each of n elements, along its normal, with gradient and Hessian (finshell_cap).
   !>
   !> Arguments as in evaluate_elements (finshell_batch); what is not present is not computed. A pressure p (positive along the
   !> normals) on the curved surface has the nodal forces of the pressure on the facets plus p times `force`, and its stiffness
   !> that of the facets plus p times `tangent`. Zero for an element whose normals are those of its facet.
   subroutine evaluate_caps(n, x, u, rotation, convention, normal, status, volume, force, tangent, state, held)
      integer, intent(in) :: n, convention
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), rotation(:, :, :)
      !> Of the surface at the nodes of each element (component, node, element). Not present: facets, whose input is checked all the
      !> same.
      real(wp), intent(in), optional :: normal(3, 3, n)
      integer(i4), intent(out) :: status(n)
      real(wp), intent(out), optional :: volume(n), force(n_shell, n), tangent(n_shell, n_shell, n)
      real(wp), intent(in), optional :: state(4, 3, n)
      integer, intent(in), optional :: held(3, n)
      type(block_t) :: block
      type(environment_t) :: environment
      real(wp) :: v(lanes), f(lanes, n_shell), k(lanes, n_shell, n_shell)
      integer(i4) :: found(lanes), input(lanes)
      integer :: first, l, level, used
      logical :: changed

      if (present(volume)) volume = 0
      if (present(force)) force = 0
      if (present(tangent)) tangent = 0
      status = status_invalid_argument
      if (bad_shape(rotation, convention, n, present(state))) return
      level = level_energy
      if (present(force)) level = level_force
      if (present(tangent)) level = level_tangent
      if (.not. present(normal)) level = level_energy
      call hold(environment)
      do first = 0, n - 1, lanes
         used = min(lanes, n - first)
         call gather(first, n, x, u, rotation, convention, block, state=state, held=held, normal=normal)
         input = status_ok
         call check_input(block, .false., input, changed)
         call cap_block(level, block, v, f, k, found)
         where (input /= status_ok) found = input
         status(first + 1:first + used) = found(:used)
         if (.not. present(normal)) cycle
         do l = 1, used
            if (found(l) == status_ok) cycle
            v(l) = 0
            if (level >= level_force) f(l, :) = 0
            if (level >= level_tangent) k(l, :, :) = 0
         end do
         if (present(volume)) volume(first + 1:first + used) = v(:used)
         if (present(force)) force(:, first + 1:first + used) = transpose(f(:used, :))
         if (present(tangent)) call separate(used, k, tangent(:, :, first + 1:first + used))
      end do
      call release(environment)
   end subroutine evaluate_caps
end module finshell_caps
