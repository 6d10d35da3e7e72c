!> Derivatives of monitors with respect to the motion of all nodes at a state: the right-hand sides of adjoint systems.
module finshell_monitor_gradient
   use finshell_acting_load, only: positions
   use finshell_cap_terms, only: caps_at
   use finshell_equilibrium, only: equilibrium_t
   use finshell_factor, only: by_load_factor, unscaled
   use finshell_freedoms, only: n_corners, n_membrane, n_nodal, n_shell, ux, uz
   use finshell_kinds, only: wp
   use finshell_monitor, only: reduce_sum
   use finshell_monitoring, only: watch_t
   use finshell_pressure, only: follower_pressure
   implicit none
   private
   public :: knows_gradient, monitor_gradient, pressed_volume_gradient

contains

   !> Is there one (also `has_gradient` of finshell_sensitivity_choice)?
   elemental logical function knows_gradient(watch)
      type(watch_t), intent(in) :: watch
      knows_gradient = watch%field%name == 'volume' .or. watch%field%name == 'energy' &
                       .or. (watch%field%name == 'displacement' .and. watch%reduce <= reduce_sum)
   end function knows_gradient

   !> Per displacement and spin of each node, (n_nodal, nodes), global axes. The problem has been evaluated at its state.
   subroutine monitor_gradient(problem, watch, nodal)
      type(equilibrium_t), intent(in) :: problem
      type(watch_t), intent(in) :: watch !< of a quantity that has one (finshell_sensitivity_choice)
      real(wp), allocatable, intent(out) :: nodal(:, :)
      integer :: i
      allocate (nodal(n_nodal, size(problem%state%displacement, 2)), source=0.0_wp)
      select case (watch%field%name)
      case ('displacement')
         do i = 1, size(watch%nodes)
            nodal(watch%component, watch%nodes(i)) = nodal(watch%component, watch%nodes(i)) &
                                                     + merge(1.0_wp, 1.0_wp/size(watch%nodes), watch%reduce == reduce_sum)
         end do
      case ('volume')
         call pressed_volume_gradient(problem, .false., nodal)
      case ('energy')
         nodal = problem%internal_force
         associate (e => problem%entry)
            if (size(e%unit_force, 3) >= unscaled) nodal = nodal - e%unit_force(:, :, unscaled) - e%bulges(:, :, unscaled)
         end associate
      end select
      nodal = watch%factor*nodal
   end subroutine monitor_gradient

   !> The same of the volume behind the pressures, or behind those alone that follow the load factor.
   subroutine pressed_volume_gradient(problem, following, nodal)
      type(equilibrium_t), intent(in) :: problem
      logical, intent(in) :: following
      real(wp), allocatable, intent(out) :: nodal(:, :)
      integer :: i
      allocate (nodal(n_nodal, size(problem%state%displacement, 2)), source=0.0_wp)
      associate (regions => problem%external%pressures)
         do i = 1, size(regions)
            if (.not. following .or. regions(i)%scaling == by_load_factor) call add_volume(problem, i, nodal)
         end do
      end associate
   end subroutine pressed_volume_gradient

   !> The volume behind one region: forces of a unit pressure.
   subroutine add_volume(problem, region, nodal)
      type(equilibrium_t), intent(in) :: problem
      integer, intent(in) :: region
      real(wp), intent(inout) :: nodal(:, :)
      real(wp), allocatable :: force(:, :), caps(:, :), unit_pressure(:)
      integer, allocatable :: curved(:)
      integer :: i
      associate (elements => problem%external%pressures(region)%elements, s => problem%structure)
         curved = problem%external%pressures(region)%curved
         allocate (force(n_membrane, size(elements)), caps(n_shell, size(curved)))
         unit_pressure = spread(1.0_wp, 1, size(elements))
         call follower_pressure(size(elements), unit_pressure, positions(s, problem%state, elements), .true., &
                                problem%external%pressures(region)%origin, force)
         do i = 1, size(elements)
            associate (nodes => s%mesh%triangles(:, elements(i)))
               nodal(ux:uz, nodes) = nodal(ux:uz, nodes) + reshape(force(:, i), [uz, n_corners])
            end associate
         end do
         if (size(curved) == 0) return
         call caps_at(s, curved, problem%state, force=caps, held=problem%equations%held)
         do i = 1, size(curved)
            associate (nodes => s%mesh%triangles(:, curved(i)))
               nodal(:, nodes) = nodal(:, nodes) + reshape(caps(:, i), [n_nodal, n_corners])
            end associate
         end do
      end associate
   end subroutine add_volume
end module finshell_monitor_gradient
