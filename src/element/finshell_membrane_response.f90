!> How a block of membranes responds to its motion: strains, and resultants of the sheet, which may have grown.
module finshell_membrane_response
   use finshell_kinds, only: wp, i4, lanes
   use finshell_freedoms, only: n_membrane
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_growth, only: stress_free_stretch
   use finshell_material_direction, only: material_direction
   use finshell_membrane_section, only: integrate_membrane, membrane_switches_t
   use finshell_own, only: own_t, n_growth
   use finshell_section, only: section_t
   use finshell_status, only: status_collapsed_element, status_ok
   use finshell_strain_floor, only: rounding_of_solution, strain_floor
   use finshell_tension_field, only: relax, state_taut, tension_field_t
   use finshell_triangle, only: new_triangle, triangle_t
   implicit none
   private
   public :: membrane_t, respond, turn

   !> Least J over tr C of a sheet that does not wrinkle, as for the shell.
   real(wp), parameter :: smallest_jacobian = 1.0e-8_wp

   !> Elements side by side.
   type :: membrane_t
      real(wp) :: x(lanes, 3, 3), u(lanes, 3, 3) !< reference coordinates and displacements (element, component, node)
      real(wp) :: direction(lanes, 3) !< material direction 1, global; used when the section is not isotropic
      type(own_t) :: own !< thickness and growth of their own
      logical :: has_toward !< with level_tangent: the tangent is the one-sided one in this direction where a law has a switch
      real(wp) :: toward(lanes, n_membrane)
   end type membrane_t

contains

   !> Strain, material direction and resultants of a block.
   pure subroutine respond(section, level, block, triangle, f1, f2, strain, axes, field, status)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level
      type(membrane_t), intent(in) :: block
      type(triangle_t), intent(out) :: triangle
      real(wp), intent(out) :: f1(lanes, 3), f2(lanes, 3) !< derivatives of the position
      real(wp), intent(out) :: strain(lanes, 3), axes(lanes, 2)
      type(tension_field_t), intent(inout) :: field
      integer(i4), intent(out) :: status(lanes)
      type(membrane_t) :: free
      real(wp) :: factor(lanes)
      integer :: i

      if (block%own%grown) then
         call stress_free(block, free, status)
         call respond_from(section, level, free, triangle, f1, f2, strain, axes, field, status)
      else
         status = status_ok
         call respond_from(section, level, block, triangle, f1, f2, strain, axes, field, status)
      end if
      if (.not. (block%own%grown .or. block%own%sized)) return
      factor = 1
      if (block%own%grown) factor = 1 + block%own%growth(:, n_growth, 1)
      if (block%own%sized) factor = factor*block%own%ratio
      field%force%energy = factor*field%force%energy
      field%slack_energy = factor*field%slack_energy
      if (level < level_force) return
      do i = 1, 3
         field%force%n(:, i) = factor*field%force%n(:, i)
         field%tension(:, i) = factor*field%tension(:, i)
      end do
      if (level < level_tangent) return
      do i = 1, 6
         field%force%a(:, i) = factor*field%force%a(:, i)
      end do
   end subroutine respond

   !> The elements with their stress-free triangles for reference: in the plane the same, U about the first node.
   pure subroutine stress_free(block, free, status)
      type(membrane_t), intent(in) :: block
      type(membrane_t), intent(out) :: free
      integer(i4), intent(out) :: status(lanes)
      type(triangle_t) :: triangle
      real(wp) :: axes(lanes, 2), stretch(lanes, 3), a(lanes, 3), b(lanes, 3)
      real(wp), dimension(lanes) :: p, q, along, across
      integer :: i, k
      status = status_ok
      call new_triangle(block%x, triangle, status)
      call material_direction(triangle%frame, block%direction, axes, status)
      call stress_free_stretch(block%own, stretch)
      do i = 1, 3
         a(:, i) = axes(:, 1)*triangle%frame(:, i, 1) + axes(:, 2)*triangle%frame(:, i, 2)
         b(:, i) = axes(:, 1)*triangle%frame(:, i, 2) - axes(:, 2)*triangle%frame(:, i, 1)
      end do
      free%x = block%x
      free%u = block%u
      do k = 2, 3
         p = 0
         q = 0
         do i = 1, 3
            p = p + a(:, i)*(block%x(:, i, k) - block%x(:, i, 1))
            q = q + b(:, i)*(block%x(:, i, k) - block%x(:, i, 1))
         end do
         along = stretch(:, 1)*p + stretch(:, 3)*q
         across = stretch(:, 3)*p + stretch(:, 2)*q
         do i = 1, 3
            p = a(:, i)*along + b(:, i)*across
            free%x(:, i, k) = free%x(:, i, k) + p
            free%u(:, i, k) = free%u(:, i, k) - p
         end do
      end do
      free%direction = block%direction
      free%has_toward = block%has_toward
      if (block%has_toward) free%toward = block%toward
   end subroutine stress_free

   !> Strain, material direction and resultants of a block of the thickness of its section, from its reference.
   pure subroutine respond_from(section, level, block, triangle, f1, f2, strain, axes, field, status)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level
      type(membrane_t), intent(in) :: block
      type(triangle_t), intent(out) :: triangle
      real(wp), intent(out) :: f1(lanes, 3), f2(lanes, 3)
      real(wp), intent(out) :: strain(lanes, 3), axes(lanes, 2)
      type(tension_field_t), intent(inout) :: field
      integer(i4), intent(inout) :: status(lanes)
      type(membrane_switches_t) :: switches
      real(wp) :: h1(lanes, 3), h2(lanes, 3), normal(lanes, 3), jacobian(lanes)
      integer(i4) :: refused(lanes)
      integer :: i

      call new_triangle(block%x, triangle, status)
      call displacement_gradient(triangle, block%u, h1, h2)
      do i = 1, 3
         f1(:, i) = triangle%frame(:, i, 1) + h1(:, i)
         f2(:, i) = triangle%frame(:, i, 2) + h2(:, i)
      end do
      call strain_of(triangle, h1, h2, strain)
      axes(:, 1) = 1
      axes(:, 2) = 0
      if (.not. section%isotropic) call material_direction(triangle%frame, block%direction, axes, status)
      if (section%wrinkling .or. section%switched .and. level >= level_tangent) &
         call look_at_switches(triangle, block, f1, f2, switches)
      if (section%wrinkling) then
         call relax(section, level, strain, axes, switches, field, status)
         return
      end if
      normal(:, 1) = f1(:, 2)*f2(:, 3) - f1(:, 3)*f2(:, 2)
      normal(:, 2) = f1(:, 3)*f2(:, 1) - f1(:, 1)*f2(:, 3)
      normal(:, 3) = f1(:, 1)*f2(:, 2) - f1(:, 2)*f2(:, 1)
      jacobian = sqrt(normal(:, 1)**2 + normal(:, 2)**2 + normal(:, 3)**2)
      where (status == status_ok .and. (.not. jacobian > smallest_jacobian*max(2 + 2*strain(:, 1) + 2*strain(:, 2), 1.0_wp) &
                                        .or. jacobian > huge(1.0_wp)*epsilon(1.0_wp))) status = status_collapsed_element
      refused = status_ok
      if (section%switched .and. level >= level_tangent) then
         call integrate_membrane(section, level, strain, axes, field%force, refused, switches)
      else
         call integrate_membrane(section, level, strain, axes, field%force, refused)
      end if
      where (status == status_ok) status = refused
      field%state = state_taut
      field%axes(:, 1) = 1
      field%axes(:, 2) = 0
      field%strain = strain
      if (level >= level_force) field%tension = field%force%n
      field%slack_energy = 0
   end subroutine respond_from

   !> Derivatives of a displacement along the axes of the triangle, global components.
   pure subroutine displacement_gradient(triangle, u, h1, h2)
      type(triangle_t), intent(in) :: triangle
      real(wp), intent(in) :: u(lanes, 3, 3)
      real(wp), intent(out) :: h1(lanes, 3), h2(lanes, 3)
      real(wp), dimension(lanes) :: a, b
      integer :: i
      do i = 1, 3
         a = u(:, i, 2) - u(:, i, 1)
         b = u(:, i, 3) - u(:, i, 1)
         h1(:, i) = a*triangle%gradient(:, 1, 2) + b*triangle%gradient(:, 1, 3)
         h2(:, i) = a*triangle%gradient(:, 2, 2) + b*triangle%gradient(:, 2, 3)
      end do
   end subroutine displacement_gradient

   !> Green-Lagrange strain from derivatives of the displacement.
   pure subroutine strain_of(triangle, h1, h2, strain)
      type(triangle_t), intent(in) :: triangle
      real(wp), intent(in) :: h1(lanes, 3), h2(lanes, 3)
      real(wp), intent(out) :: strain(lanes, 3)
      associate (a => triangle%frame)
         strain(:, 1) = a(:, 1, 1)*h1(:, 1) + a(:, 2, 1)*h1(:, 2) + a(:, 3, 1)*h1(:, 3) &
            + 0.5_wp*(h1(:, 1)**2 + h1(:, 2)**2 + h1(:, 3)**2)
         strain(:, 2) = a(:, 1, 2)*h2(:, 1) + a(:, 2, 2)*h2(:, 2) + a(:, 3, 2)*h2(:, 3) &
            + 0.5_wp*(h2(:, 1)**2 + h2(:, 2)**2 + h2(:, 3)**2)
         strain(:, 3) = (a(:, 1, 1)*h2(:, 1) + a(:, 2, 1)*h2(:, 2) + a(:, 3, 1)*h2(:, 3)) &
            + (a(:, 1, 2)*h1(:, 1) + a(:, 2, 2)*h1(:, 2) + a(:, 3, 2)*h1(:, 3)) &
            + (h1(:, 1)*h2(:, 1) + h1(:, 2)*h2(:, 2) + h1(:, 3)*h2(:, 3))
      end associate
   end subroutine strain_of

   !> What of the strain may be rounding, and the rates of strain of the direction that is looked in.
   pure subroutine look_at_switches(triangle, block, f1, f2, switches)
      type(triangle_t), intent(in) :: triangle
      type(membrane_t), intent(in) :: block
      real(wp), intent(in) :: f1(lanes, 3), f2(lanes, 3)
      type(membrane_switches_t), intent(out) :: switches
      real(wp), dimension(lanes) :: inverse, motion, position
      real(wp) :: v(lanes, 3, 3), v1(lanes, 3), v2(lanes, 3)
      integer :: i, k
      inverse = 0
      motion = 0
      position = 0
      do k = 1, 3
         inverse = max(inverse, abs(triangle%gradient(:, 1, k)) + abs(triangle%gradient(:, 2, k)))
         do i = 1, 3
            motion = max(motion, abs(block%u(:, i, k)))
            position = max(position, abs(block%x(:, i, k)))
         end do
      end do
      switches%floor = strain_floor(motion*inverse, position*inverse)
      switches%directed = block%has_toward
      if (.not. block%has_toward) return
      do k = 1, 3
         v(:, :, k) = block%toward(:, 3*k - 2:3*k)
      end do
      call displacement_gradient(triangle, v, v1, v2)
      switches%rate(:, 1) = f1(:, 1)*v1(:, 1) + f1(:, 2)*v1(:, 2) + f1(:, 3)*v1(:, 3)
      switches%rate(:, 2) = f2(:, 1)*v2(:, 1) + f2(:, 2)*v2(:, 2) + f2(:, 3)*v2(:, 3)
      switches%rate(:, 3) = f1(:, 1)*v2(:, 1) + f1(:, 2)*v2(:, 2) + f1(:, 3)*v2(:, 3) &
         + (f2(:, 1)*v1(:, 1) + f2(:, 2)*v1(:, 2) + f2(:, 3)*v1(:, 3))
      switches%rate_floor = rounding_of_solution*maxval(abs(block%toward), 2)*inverse
   end subroutine look_at_switches

   !> Components along other in-plane axes.
   pure subroutine turn(axes, a1, a2)
      real(wp), intent(in) :: axes(lanes, 2)
      real(wp), intent(inout) :: a1(lanes, 3), a2(lanes, 3)
      real(wp) :: a(lanes)
      integer :: i
      do i = 1, 3
         a = a1(:, i)
         a1(:, i) = axes(:, 1)*a + axes(:, 2)*a2(:, i)
         a2(:, i) = axes(:, 1)*a2(:, i) - axes(:, 2)*a
      end do
   end subroutine turn
end module finshell_membrane_response
