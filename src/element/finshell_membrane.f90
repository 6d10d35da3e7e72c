!> The membrane element: three nodes, three freedoms a node, constant strain over the flat triangle, no bending.
!>
!> With f_i the derivatives of the position along in-plane axes, E_ij = (f_i . f_j - delta_ij)/2, made of derivatives of the
!> displacement so that small strains keep their digits. Energy area times that of the section, force and tangent exact:
!> P_i = N_ij f_j, dP_i/df_j = N_ij I + D_ikjl f_k (x) f_l. Any in-plane axes do; a wrinkled sheet's are those of its ridges.
!> A sheet that has grown is one whose reference triangle is the stress-free one; its strains count from there.
module finshell_membrane
   use finshell_kinds, only: wp, i4, lanes
   use finshell_freedoms, only: n_membrane
   use finshell_evaluation, only: level_energy, level_force, level_tangent
   use finshell_growth, only: free_over_reference
   use finshell_material_direction, only: material_direction
   use finshell_membrane_response, only: membrane_t, respond, turn
   use finshell_membrane_section, only: membrane_force_t
   use finshell_metric_change, only: new_metric_change, pull_back_stress
   use finshell_own, only: own_t, n_growth
   use finshell_recovered, only: recovered_t
   use finshell_resultants, only: midsurface_thickness
   use finshell_section, only: section_t
   use finshell_status, only: status_ok
   use finshell_tension_field, only: state_wrinkled, tension_field_t
   use finshell_triangle, only: triangle_t
   use finshell_voigt, only: rotate_strain, rotate_stress
   implicit none
   private
   public :: membrane_t, evaluate_membrane, recover_membrane

contains

   !> Energy, force and tangent of a block of elements.
   pure subroutine evaluate_membrane(section, level, block, energy, force, tangent, status, slack_energy)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level !< level_energy, level_force or level_tangent
      type(membrane_t), intent(in) :: block
      real(wp), intent(inout) :: energy(lanes), force(lanes, n_membrane)
      real(wp), intent(inout) :: tangent(lanes, n_membrane, n_membrane) !< upper triangle
      integer(i4), intent(out) :: status(lanes)
      real(wp), intent(inout) :: slack_energy(lanes) !< part of the energy: what slack and wrinkled sheets bear (finshell_slack)
      type(triangle_t) :: triangle
      type(tension_field_t) :: field
      real(wp), dimension(lanes, 3) :: f1, f2, g1, g2, strain
      real(wp) :: axes(lanes, 2)
      integer :: i

      call respond(section, level, block, triangle, f1, f2, strain, axes, field, status)
      energy = triangle%area*field%force%energy
      slack_energy = triangle%area*field%slack_energy
      if (level < level_force) return
      if (section%wrinkling) then
         call turn(field%axes, f1, f2)
         g1 = triangle%gradient(:, 1, :)
         g2 = triangle%gradient(:, 2, :)
         call turn(field%axes, g1, g2)
         do i = 1, 3
            triangle%gradient(:, 1, i) = g1(:, i)
            triangle%gradient(:, 2, i) = g2(:, i)
         end do
      end if
      call assemble_force(triangle, f1, f2, field%force%n, force)
      if (level >= level_tangent) call assemble_tangent(triangle, f1, f2, field%force, tangent)
   end subroutine evaluate_membrane

   !> Strains, resultants and frames of a block of elements: what its fields are made of (finshell_element_fields).
   pure subroutine recover_membrane(section, block, r, status)
      type(section_t), intent(in) :: section
      type(membrane_t), intent(in) :: block
      type(recovered_t), intent(out) :: r
      integer(i4), intent(out) :: status(lanes)
      type(triangle_t) :: triangle
      type(tension_field_t) :: field
      real(wp), dimension(lanes, 3) :: f1, f2, strain, dl
      real(wp) :: axes(lanes, 2), ddl(lanes, 6), length(lanes), factor(lanes)
      integer(i4) :: no_stretch(lanes)
      integer :: i

      call respond(section, level_force, block, triangle, f1, f2, strain, axes, field, status)
      ! material direction in the axes of the ridges
      call material_direction(triangle%frame, block%direction, axes, status)
      r%axes(:, 1) = axes(:, 1)*field%axes(:, 1) + axes(:, 2)*field%axes(:, 2)
      r%axes(:, 2) = axes(:, 2)*field%axes(:, 1) - axes(:, 1)*field%axes(:, 2)
      r%membrane = field%strain
      r%curvature = 0
      r%curvatures = 0
      r%state = field%state
      no_stretch = status_ok
      call midsurface_thickness(section, level_energy, field%strain, r%axes, r%stretch, dl, ddl, no_stretch)
      where (status == status_ok) status = no_stretch
      factor = 1/section%thickness
      if (block%own%sized) factor = factor/block%own%ratio
      if (block%own%grown) then
         factor = factor*free_over_reference(block%own, 1)
         r%stretch = (1 + block%own%growth(:, n_growth, 1))*r%stretch
      end if
      r%energy = factor*field%force%energy
      r%slack_energy = factor*field%slack_energy
      r%force = field%tension
      r%moment = 0
      r%back(:, 1) = r%axes(:, 1)
      r%back(:, 2) = -r%axes(:, 2)
      call rotate_stress(lanes, r%back, r%force)
      if (block%own%grown) call to_reference(block%own, r%force)
      r%own%sized = block%own%sized
      if (r%own%sized) then
         r%own%ratio = block%own%ratio
         r%own%shift = block%own%shift
      end if
      r%bend = 0
      call turn_ironed(field, strain, r%back)
      call turn(field%axes, f1, f2)
      call frame_of(field, f1, f2, r%axes, r%frame)
      length = sqrt(f1(:, 1)**2 + f1(:, 2)**2 + f1(:, 3)**2)
      do i = 1, 3
         r%ridge(:, i) = merge(f1(:, i)/length, 0.0_wp, field%state == state_wrinkled .and. length > 0)
      end do
   end subroutine recover_membrane

   !> Membrane forces along the material direction, per length of the stress-free state: per reference length.
   pure subroutine to_reference(own, force)
      type(own_t), intent(in) :: own
      real(wp), intent(inout) :: force(lanes, 3)
      real(wp) :: v(lanes, 3), map(lanes, 3, 3), area(lanes)
      v(:, 1:2) = 2*own%growth(:, 1:2, 1)
      v(:, 3) = own%growth(:, 3, 1)
      call new_metric_change(lanes, v, map, area)
      call pull_back_stress(lanes, map, area, force)
   end subroutine to_reference

   !> Material direction and the in-plane normal to it, carried along by the rotation of the ironed material: it brings U e_1 to the
   !> line of the ridges, f_1.
   pure subroutine frame_of(field, f1, f2, axes, frame)
      type(tension_field_t), intent(in) :: field
      real(wp), intent(in) :: f1(lanes, 3), f2(lanes, 3) !< along the axes of the ridges
      real(wp), intent(in) :: axes(lanes, 2) !< of the material direction in those
      real(wp), intent(out) :: frame(lanes, 3, 2)
      real(wp) :: t(3, 2), p(2), jacobian
      integer :: l
      do l = 1, lanes
         ! slack sheets may have collapsed: no direction
         t(:, 1) = f1(l, :)/max(norm2(f1(l, :)), tiny(1.0_wp))
         t(:, 2) = f2(l, :) - t(:, 1)*dot_product(t(:, 1), f2(l, :))
         t(:, 2) = t(:, 2)/max(norm2(t(:, 2)), tiny(1.0_wp))
         jacobian = sqrt(max((1 + 2*field%strain(l, 1))*(1 + 2*field%strain(l, 2)) - field%strain(l, 3)**2, 0.0_wp))
         p = [1 + 2*field%strain(l, 1) + jacobian, field%strain(l, 3)]
         p = p/max(norm2(p), tiny(1.0_wp))
         ! the axes against U e_1
         p = [axes(l, 1)*p(1) + axes(l, 2)*p(2), axes(l, 2)*p(1) - axes(l, 1)*p(2)]
         frame(l, :, 1) = p(1)*t(:, 1) + p(2)*t(:, 2)
         frame(l, :, 2) = p(1)*t(:, 2) - p(2)*t(:, 1)
      end do
   end subroutine frame_of

   !> Bring stresses of the ironed material to the facet: both share the line of the ridges, so that is what their rotations must
   !> bring to the same place.
   pure subroutine turn_ironed(field, strain, back)
      type(tension_field_t), intent(in) :: field
      real(wp), intent(in) :: strain(lanes, 3)
      real(wp), intent(inout) :: back(lanes, 2) !< cosine, sine of the axes of stress in those they are wanted in
      real(wp) :: e(lanes, 3), p(2), q(2), jacobian, c, s, length
      integer :: l
      call rotate_strain(lanes, field%axes, strain, e)
      do l = 1, lanes
         if (field%state(l) /= state_wrinkled) cycle
         ! U e_1 up to a factor, U = (C + J I)/t
         jacobian = sqrt(max((1 + 2*e(l, 1))*(1 + 2*e(l, 2)) - e(l, 3)**2, 0.0_wp))
         p = [1 + 2*e(l, 1) + jacobian, e(l, 3)]
         jacobian = sqrt(max((1 + 2*field%strain(l, 1))*(1 + 2*field%strain(l, 2)) - field%strain(l, 3)**2, 0.0_wp))
         q = [1 + 2*field%strain(l, 1) + jacobian, field%strain(l, 3)]
         ! turned by the angle from q to p
         length = norm2(p)*norm2(q)
         c = dot_product(p, q)/length
         s = (p(2)*q(1) - p(1)*q(2))/length
         p = back(l, :)
         back(l, :) = [p(1)*c - p(2)*s, p(2)*c + p(1)*s]
      end do
   end subroutine turn_ironed

   pure subroutine assemble_force(triangle, f1, f2, n, force)
      type(triangle_t), intent(in) :: triangle
      real(wp), intent(in) :: f1(lanes, 3), f2(lanes, 3), n(lanes, 3)
      real(wp), intent(inout) :: force(lanes, n_membrane)
      real(wp) :: p1(lanes), p2(lanes)
      integer :: i, k
      do i = 1, 3
         p1 = triangle%area*(n(:, 1)*f1(:, i) + n(:, 3)*f2(:, i))
         p2 = triangle%area*(n(:, 3)*f1(:, i) + n(:, 2)*f2(:, i))
         do k = 1, 3
            force(:, 3*k - 3 + i) = triangle%gradient(:, 1, k)*p1 + triangle%gradient(:, 2, k)*p2
         end do
      end do
   end subroutine assemble_force

   pure subroutine assemble_tangent(triangle, f1, f2, r, tangent)
      type(triangle_t), intent(in) :: triangle
      real(wp), intent(in) :: f1(lanes, 3), f2(lanes, 3)
      type(membrane_force_t), intent(in) :: r
      real(wp), intent(inout) :: tangent(lanes, n_membrane, n_membrane)
      ! h11, h22: symmetric; h12: rows of axis 1, columns of axis 2
      real(wp), dimension(lanes) :: a11, a12, b11, b12, h11, h12, h21, h22, aa, ab, ba, bb
      real(wp) :: a(lanes, 6), n(lanes, 3)
      integer :: i, j, k, l
      do i = 1, 6
         a(:, i) = triangle%area*r%a(:, i)
      end do
      do i = 1, 3
         n(:, i) = triangle%area*r%n(:, i)
      end do
      do j = 1, 3
         do i = 1, j
            aa = f1(:, i)*f1(:, j)
            ab = f1(:, i)*f2(:, j)
            ba = f2(:, i)*f1(:, j)
            bb = f2(:, i)*f2(:, j)
            h11 = a(:, 1)*aa + a(:, 5)*(ab + ba) + a(:, 3)*bb
            h22 = a(:, 2)*bb + a(:, 6)*(ab + ba) + a(:, 3)*aa
            h12 = a(:, 5)*aa + a(:, 4)*ab + a(:, 3)*ba + a(:, 6)*bb
            h21 = a(:, 5)*aa + a(:, 4)*ba + a(:, 3)*ab + a(:, 6)*bb
            if (i == j) then
               h11 = h11 + n(:, 1)
               h22 = h22 + n(:, 2)
               h12 = h12 + n(:, 3)
               h21 = h21 + n(:, 3)
            end if
            associate (g => triangle%gradient)
               do l = 1, 3
                  a11 = h11*g(:, 1, l) + h12*g(:, 2, l)
                  a12 = h21*g(:, 1, l) + h22*g(:, 2, l)
                  do k = 1, l
                     tangent(:, 3*k - 3 + i, 3*l - 3 + j) = g(:, 1, k)*a11 + g(:, 2, k)*a12
                  end do
                  if (i == j) cycle
                  ! the other half of a block off the diagonal
                  b11 = h11*g(:, 1, l) + h21*g(:, 2, l)
                  b12 = h12*g(:, 1, l) + h22*g(:, 2, l)
                  do k = 1, l - 1
                     tangent(:, 3*k - 3 + j, 3*l - 3 + i) = g(:, 1, k)*b11 + g(:, 2, k)*b12
                  end do
               end do
            end associate
         end do
      end do
   end subroutine assemble_tangent
end module finshell_membrane
