!> Strains of many elements point by point, with the tangent stiffness of their sections: what estimates of the error of a mesh
!> are made of.
module finshell_strain_batch
   use finshell_block, only: bad_shape, check_input, gather, gather_own
   use finshell_element, only: block_t, recover_block
   use finshell_environment, only: environment_t, hold, release
   use finshell_evaluation, only: level_tangent
   use finshell_kinds, only: wp, i4, lanes
   use finshell_material_direction, only: material_direction
   use finshell_growth, only: layer_volume
   use finshell_membrane, only: membrane_t, recover_membrane
   use finshell_membrane_chunk, only: check_membranes, gather_membranes
   use finshell_membrane_section, only: integrate_membrane, membrane_force_t
   use finshell_own, only: at_points, n_growth, own_t
   use finshell_recovered, only: recovered_t
   use finshell_reference, only: zeta
   use finshell_resultants, only: integrate, points_per_block, resultants_t
   use finshell_section, only: section_t
   use finshell_status, only: status_invalid_argument, status_material_limit, status_ok
   use finshell_triangle, only: new_triangle, triangle_t
   use finshell_voigt, only: column, rotate_strain, row
   implicit none
   private
   public :: element_strains_t, recover_strains, strain_points

   !> Area coordinates of the points at which curvatures are given (node, point), each of weight 1/3.
   real(wp), parameter :: strain_points(3, 3) = zeta

   !> Of n elements side by side; components 11, 22, 2 12 in the axes below.
   type :: element_strains_t
      real(wp), allocatable :: axes(:, :, :) !< (3, 2, n) material direction and in-plane normal to it, on the facet; global
      real(wp), allocatable :: area(:) !< of the reference facets
      real(wp), allocatable :: membrane(:, :) !< (3, n) Green-Lagrange strain of the surface of the nodes, mean
      real(wp), allocatable :: curvature(:, :, :) !< (3, 3, n) component, point
      !> (6, 6, n) second derivative of the energy per reference area with respect to membrane strain and curvature, and the work of
      !> the membrane force (see `initial_stress`).
      real(wp), allocatable :: stiffness(:, :, :)
      real(wp), allocatable :: energy(:) !< of each element
      integer(i4), allocatable :: status(:) !< where it is not status_ok the rest is 0, but for area and axes
   end type element_strains_t

contains

   !> Arguments as in recover_fields (finshell_field_batch). Without `stiff` the stiffness is not evaluated, nor allocated.
   subroutine recover_strains(section, n, x, u, rotation, convention, strains, stiff, direction, held, normal, &
                              thickness, offset, growth)
      type(section_t), intent(in) :: section
      integer, intent(in) :: n, convention
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), rotation(:, :, :)
      type(element_strains_t), intent(out) :: strains
      logical, intent(in) :: stiff
      real(wp), intent(in), optional :: direction(3, n)
      integer, intent(in), optional :: held(3, n)
      real(wp), intent(in), optional :: normal(3, 3, n)
      real(wp), intent(in), optional :: thickness(n), offset(n), growth(n_growth, size(section%layers), n)
      type(block_t) :: block
      type(membrane_t) :: membrane
      type(environment_t) :: environment
      type(recovered_t) :: r
      type(triangle_t) :: triangle
      real(wp) :: axes(lanes, 2), e(lanes, 3), bend(lanes, 3), curvature(lanes, 3, 3), k(6, 6, lanes), material(lanes, 3)
      integer(i4) :: found(lanes), input(lanes), shape_status(lanes)
      integer :: first, i, l, used
      logical :: changed, sound

      allocate (strains%axes(3, 2, n), strains%area(n), strains%membrane(3, n), strains%curvature(3, 3, n), strains%energy(n), &
                source=0.0_wp)
      allocate (strains%status(n), source=status_ok)
      if (stiff) allocate (strains%stiffness(6, 6, n), source=0.0_wp)
      if (bad_shape(rotation, convention, n, .false.)) then
         strains%status = status_invalid_argument
         return
      end if
      call hold(environment)
      do first = 0, n - 1, lanes
         used = min(lanes, n - first)
         input = status_ok
         shape_status = status_ok
         if (section%membrane) then
            call gather_membranes(first, n, x, u, membrane, direction)
            call gather_own(section, first, n, membrane%own, thickness, growth=growth)
            call check_membranes(membrane, present(direction), input, changed)
            call recover_membrane(section, membrane, r, found)
            call new_triangle(membrane%x, triangle, shape_status)
            material = membrane%direction
         else
            call gather(first, n, x, u, rotation, convention, block, direction, held=held, normal=normal)
            call gather_own(section, first, n, block%own, thickness, offset, growth)
            call check_input(block, present(direction), input, changed)
            call recover_block(section, block, r, found)
            call new_triangle(block%x, triangle, shape_status)
            material = block%direction
         end if
         where (input /= status_ok) found = input
         call material_direction(triangle%frame, material, axes, shape_status)
         call rotate_strain(lanes, r%axes, r%membrane, e)
         do i = 1, 3
            call rotate_strain(lanes, r%axes, r%curvatures(:, :, i), curvature(:, :, i))
         end do
         if (stiff) then
            call rotate_strain(lanes, r%axes, r%bend, bend)
            call section_stiffness(section, r%own, e, curvature, bend, k, found)
            if (section%membrane) k = k*spread(spread(sheet_over_section(membrane%own), 1, 6), 2, 6)
         end if
         do l = 1, used
            strains%area(first + l) = triangle%area(l)
            strains%axes(:, 1, first + l) = axes(l, 1)*triangle%frame(l, :, 1) + axes(l, 2)*triangle%frame(l, :, 2)
            strains%axes(:, 2, first + l) = axes(l, 1)*triangle%frame(l, :, 2) - axes(l, 2)*triangle%frame(l, :, 1)
            sound = all(abs(e(l, :)) < huge(1.0_wp)) .and. all(abs(curvature(l, :, :)) < huge(1.0_wp)) &
               .and. abs(r%energy(l)) < huge(1.0_wp)
            if (found(l) == status_ok .and. .not. sound) found(l) = status_material_limit
            strains%status(first + l) = found(l)
            if (found(l) /= status_ok) cycle
            strains%membrane(:, first + l) = e(l, :)
            strains%curvature(:, :, first + l) = curvature(l, :, :)
            strains%energy(first + l) = r%energy(l)*triangle%area(l)*section%thickness
            if (r%own%sized) strains%energy(first + l) = r%own%ratio(l)*strains%energy(first + l)
            if (stiff) strains%stiffness(:, :, first + l) = k(:, :, l)
         end do
      end do
      call release(environment)
   end subroutine recover_strains

   !> Tangent stiffness of a block of sections at mean strains in material axes.
   pure subroutine section_stiffness(section, own, e, curvature, bend, k, status)
      type(section_t), intent(in) :: section
      type(own_t), intent(in) :: own
      real(wp), intent(in) :: e(lanes, 3), curvature(lanes, 3, 3), bend(lanes, 3)
      real(wp), intent(out) :: k(6, 6, lanes)
      integer(i4), intent(inout) :: status(lanes)
      type(resultants_t) :: r
      type(membrane_force_t) :: f
      real(wp) :: membrane(points_per_block, 3), bending(points_per_block, 3), along(points_per_block, 2), initial(3, 3)
      real(wp) :: bent(points_per_block, 3)
      integer(i4) :: found(points_per_block)
      integer :: i, j, l, m

      along(:, 1) = 1
      along(:, 2) = 0
      found = status_ok
      if (section%membrane) then
         call integrate_membrane(section, level_tangent, e, along(:lanes, :), f, found(:lanes))
         r%n(:lanes, :) = f%n
         r%a(:lanes, :) = f%a
         r%b(:lanes, :) = 0
         r%d(:lanes, :) = 0
      else
         do i = 1, 3
            membrane(:, i) = e(1, i)
            bending(:, i) = sum(curvature(1, i, :))/3
            membrane(:lanes, i) = e(:, i)
            bending(:lanes, i) = sum(curvature(:, i, :), 2)/3
            bent(:, i) = at_points(bend(:, i))
         end do
         call integrate(section, level_tangent, membrane, bending, along, r, found, own=own, bend=bent)
      end if
      do l = 1, lanes
         if (status(l) == status_ok) status(l) = found(l)
         do m = 1, 6
            i = row(m)
            j = column(m)
            k(i, j, l) = r%a(l, m)
            k(j, i, l) = r%a(l, m)
            k(i, j + 3, l) = r%b(l, m)
            k(j, i + 3, l) = r%b(l, m)
            k(i + 3, j, l) = r%b(l, m)
            k(j + 3, i, l) = r%b(l, m)
            k(i + 3, j + 3, l) = r%d(l, m)
            k(j + 3, i + 3, l) = r%d(l, m)
         end do
         call initial_stress(e(l, :), r%n(l, :), initial)
         k(:3, :3, l) = k(:3, :3, l) + initial
      end do
   end subroutine section_stiffness

   !> Stiffness of the sheets of membranes, per reference area, over that of their section.
   pure function sheet_over_section(own) result(factor)
      type(own_t), intent(in) :: own
      real(wp) :: factor(lanes)
      factor = 1
      if (own%sized) factor = own%ratio
      if (own%grown) factor = factor*layer_volume(own, 1)
   end function sheet_over_section

   !> The quadratic form N:(D C^-1 D) of a change D of the strain: work of the membrane force where the deformed surface stretches
   !> by a symmetric gradient. Without it the tangent of rubber is indefinite in strains long before the sheet is unstable.
   pure subroutine initial_stress(e, n, k)
      real(wp), intent(in) :: e(3), n(3)
      real(wp), intent(out) :: k(3, 3)
      real(wp) :: c(3), determinant
      determinant = (1 + 2*e(1))*(1 + 2*e(2)) - e(3)**2
      k = 0
      if (.not. determinant > 0) return
      c = [1 + 2*e(2), 1 + 2*e(1), -e(3)]/determinant
      ! D = [d1 d3/2; d3/2 d2]
      k(1, 1) = n(1)*c(1)
      k(2, 2) = n(2)*c(2)
      k(3, 3) = 0.25_wp*(n(1)*c(2) + n(2)*c(1) + 2*n(3)*c(3))
      k(1, 2) = n(3)*c(3)
      k(1, 3) = 0.5_wp*(n(1)*c(3) + n(3)*c(1))
      k(2, 3) = 0.5_wp*(n(2)*c(3) + n(3)*c(2))
      k(2, 1) = k(1, 2)
      k(3, 1) = k(1, 3)
      k(3, 2) = k(2, 3)
   end subroutine initial_stress
end module finshell_strain_batch
