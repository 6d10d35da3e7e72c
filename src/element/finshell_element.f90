!> The element on one screen: reference geometry, polar filter, core, lift.
!>
!> A block of `lanes` elements is evaluated at once; state in, state out, no history. Element numbers, threads and error
!> lists belong to finshell_batch.
module finshell_element
   use finshell_kinds, only: wp, i4, lanes, points_per_block, rows_3
   use finshell_freedoms, only: n_shell
   use finshell_cap, only: cap_volume
   use finshell_curved, only: curved_t, turned_t, new_curved, new_turned, reference_curvature, turn_nodes
   use finshell_core, only: core_t, stress_t, heading_t, evaluate_core, n_core
   use finshell_filter, only: filter_t, new_filter
   use finshell_heading, only: new_heading, set_direction
   use finshell_lift, only: lift, core_variation
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_material_direction, only: material_direction
   use finshell_point_states, only: point_states_t
   use finshell_own, only: own_t
   use finshell_reference, only: reference_t, new_reference, hold_sides
   use finshell_recovered, only: recovered_t
   use finshell_section, only: section_t, formulation_s
   use finshell_vector_rotation, only: vector_rotation_t, new_vector_rotation, turn_state, turned_frame, add_vector_curvature
   use finshell_voigt, only: rotate_stress
   implicit none
   private
   public :: block_t, evaluate_block, predict_block, recover_block, cap_block, stress_t, rotation_vector, rotation_quaternion, &
      rotation_increment

   !> How nodal rotations are given, and what force and tangent refer to.
   !> rotation_vector: total rotation vectors (3 numbers), exact Hessian. rotation_quaternion: unit quaternions (4 numbers, scalar
   !> first), spins. rotation_increment: rotation vectors since a state given as quaternions, R = exp(increment) R_state; the exact
   !> Hessian with respect to the increment.
   integer, parameter :: rotation_vector = 1, rotation_quaternion = 2, rotation_increment = 3

   !> Elements side by side, and what is common to them.
   type :: block_t
      real(wp) :: x(lanes, 3, 3), u(lanes, 3, 3) !< reference coordinates and displacements (element, component, node)
      real(wp) :: rotation(lanes, 4, 3) !< quaternion, or rotation vector in the first three components
      integer :: convention !< rotation_vector, rotation_quaternion or rotation_increment
      real(wp) :: state(lanes, 4, 3) !< quaternions an increment starts from
      real(wp) :: direction(lanes, 3) !< material direction 1, global; used when the section is not isotropic
      real(wp) :: bulge(lanes, 3) !< 0 for sides that drilling rotations do not bend, else 1
      real(wp) :: bow(lanes, 3) !< 0 for sides that slopes do not bend either, else 1/8
      !> With quaternions and level_tangent only. Displacements and spins: the tangent is the one-sided one in this direction where
      !> a law has a switch (finshell_material).
      logical :: has_toward
      real(wp) :: toward(lanes, n_shell)
      type(own_t) :: own !< thickness, offset, growth of their own
      logical :: has_normals
      real(wp) :: normal(lanes, 3, 3) !< of the curved reference at the nodes (element, component, node)
   end type block_t

contains

   !> Energy, force and tangent of a block of elements.
   pure subroutine evaluate_block(section, level, block, energy, force, tangent, status, stress, states)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level !< level_energy, level_force or level_tangent
      type(block_t), intent(in) :: block
      real(wp), intent(inout) :: energy(lanes), force(lanes, n_shell)
      real(wp), intent(inout) :: tangent(lanes, n_shell, n_shell)
      integer(i4), intent(out) :: status(lanes)
      type(stress_t), intent(in), optional :: stress !< resultants for the geometric part of the tangent
      type(point_states_t), intent(inout), optional :: states !< of laws with states
      type(reference_t) :: ref
      type(curved_t) :: curved
      type(filter_t) :: filter
      type(core_t) :: core
      type(heading_t) :: heading
      type(vector_rotation_t) :: vectors
      real(wp) :: quaternion(lanes, 4, 3), axes(lanes, 2)

      call deform(section, level, block, ref, curved, filter, vectors, quaternion, heading, status)
      axes(:, 1) = 1
      axes(:, 2) = 0
      if (.not. section%isotropic .or. block%own%grown) call material_direction(ref%frame, block%direction, axes, status)
      call evaluate_core(section, block%own, level, ref, curved, filter, axes, heading, core, status, stress, &
                         states=states)
      energy = core%energy
      if (level >= level_force) call lift_block(level, block, ref, filter, vectors, core, force, tangent)
   end subroutine evaluate_block

   !> Volume between facet and curved surface of a block of elements (finshell_cap), gradient and Hessian.
   !>
   !> Zero without normals and where they are those of the facet. There no motion is out of reach, beside whatever neighbours.
   pure subroutine cap_block(level, block, volume, force, tangent, status)
      integer, intent(in) :: level !< level_energy: the volume, level_force or level_tangent
      type(block_t), intent(in) :: block
      real(wp), intent(inout) :: volume(lanes), force(lanes, n_shell)
      real(wp), intent(inout) :: tangent(lanes, n_shell, n_shell)
      integer(i4), intent(out) :: status(lanes)
      type(reference_t) :: ref
      type(turned_t) :: turned
      type(filter_t) :: filter
      type(core_t) :: core
      type(vector_rotation_t) :: vectors
      real(wp) :: quaternion(lanes, 4, 3)
      integer(i4) :: moved(lanes)
      integer :: l

      status = 0
      call new_reference(block%x, ref, status)
      ref%bow = block%bow
      turned%any = .false.
      if (block%has_normals) call new_turned(ref, block%normal, turned, status)
      volume = 0
      if (level >= level_force) force = 0
      if (level >= level_tangent) tangent = 0
      if (.not. turned%any) return
      call nodal_rotations(level, block, vectors, quaternion)
      call turn_nodes(turned, quaternion)
      moved = status
      call new_filter(ref, block%u, quaternion, filter, moved)
      call cap_volume(level, ref, turned, filter, core)
      volume = core%energy
      if (level >= level_force) call lift_block(level, block, ref, filter, vectors, core, force, tangent)
      do l = 1, lanes
         if (any(abs(turned%slope(l, :)) > 0)) then
            status(l) = moved(l)
         else
            volume(l) = 0
            if (level >= level_force) force(l, :) = 0
            if (level >= level_tangent) tangent(l, :, :) = 0
         end if
      end do
   end subroutine cap_block

   !> Force and tangent of nodes from those of the core.
   pure subroutine lift_block(level, block, ref, filter, vectors, core, force, tangent)
      integer, intent(in) :: level
      type(block_t), intent(in) :: block
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      type(vector_rotation_t), intent(in) :: vectors
      type(core_t), intent(in) :: core
      real(wp), intent(inout) :: force(lanes, n_shell), tangent(lanes, n_shell, n_shell)
      real(wp) :: node_frame(lanes, rows_3, 3, 0:3), moment(lanes, 3, 3)
      integer :: i
      node_frame(:, rows_3, :, :) = 0
      node_frame(:, 1:3, :, 0) = filter%rotation
      do i = 1, 3
         if (block%convention == rotation_quaternion) then
            node_frame(:, :, :, i) = node_frame(:, :, :, 0)
         else
            call turned_frame(vectors, i, filter%rotation, node_frame(:, 1:3, :, i))
         end if
      end do
      call lift(level, ref, filter, core, node_frame, force, moment, tangent)
      if (level == level_tangent .and. block%convention /= rotation_quaternion) call add_vector_curvature(vectors, moment, tangent)
   end subroutine lift_block

   !> Resultants at the points of a block of elements, linearised at this state for nodal displacements and spins.
   pure subroutine predict_block(section, block, increment, stress, status, states)
      type(section_t), intent(in) :: section
      type(block_t), intent(in) :: block !< quaternions
      real(wp), intent(in) :: increment(lanes, n_shell) !< u1 t1 u2 t2 u3 t3, spins
      type(stress_t), intent(out) :: stress
      integer(i4), intent(out) :: status(lanes)
      type(point_states_t), intent(inout), optional :: states !< of laws with states
      type(reference_t) :: ref
      type(curved_t) :: curved
      type(filter_t) :: filter
      type(core_t) :: core
      type(heading_t) :: heading
      type(vector_rotation_t) :: vectors
      real(wp) :: quaternion(lanes, 4, 3), axes(lanes, 2), variation(lanes, n_core)
      call deform(section, level_tangent, block, ref, curved, filter, vectors, quaternion, heading, status)
      axes(:, 1) = 1
      axes(:, 2) = 0
      if (.not. section%isotropic .or. block%own%grown) call material_direction(ref%frame, block%direction, axes, status)
      call core_variation(ref, filter, increment, variation)
      call evaluate_core(section, block%own, level_tangent, ref, curved, filter, axes, heading, core, status, variation=variation, &
                         predicted=stress, states=states)
   end subroutine predict_block

   !> Strains, resultants and frames of a block of elements: what its fields are made of (finshell_element_fields).
   pure subroutine recover_block(section, block, r, status, states)
      type(section_t), intent(in) :: section
      type(block_t), intent(in) :: block
      type(recovered_t), intent(out) :: r
      integer(i4), intent(out) :: status(lanes)
      type(point_states_t), intent(inout), optional :: states !< of laws with states
      type(reference_t) :: ref
      type(curved_t) :: curved
      type(filter_t) :: filter
      type(core_t) :: core
      type(heading_t) :: heading
      type(vector_rotation_t) :: vectors
      real(wp) :: quaternion(lanes, 4, 3), bend(points_per_block, 3)
      integer :: i

      if (present(states)) r%states = states
      call deform(section, level_force, block, ref, curved, filter, vectors, quaternion, heading, status)
      call material_direction(ref%frame, block%direction, r%axes, status)
      call evaluate_core(section, block%own, level_force, ref, curved, filter, r%axes, heading, core, status, recovers=.true., &
                         states=r%states)
      r%stretch = core%stretch
      do i = 1, 3
         if (curved%any) then
            r%force(:, i) = mean(core%force(:, i))
            r%moment(:, i) = mean(core%moment(:, i))
         else
            r%force(:, i) = mean(core%resultants%n(:, i))
            r%moment(:, i) = mean(core%resultants%m(:, i))
         end if
         r%membrane(:, i) = mean(core%membrane(:, i))
         r%curvature(:, i) = mean(core%curvature(:, i))
         r%curvatures(:, i, :) = reshape(core%curvature(:3*lanes, i), [lanes, 3])
         r%frame(:, i, 1) = r%axes(:, 1)*filter%rotation(:, i, 1) + r%axes(:, 2)*filter%rotation(:, i, 2)
         r%frame(:, i, 2) = r%axes(:, 1)*filter%rotation(:, i, 2) - r%axes(:, 2)*filter%rotation(:, i, 1)
      end do
      r%energy = core%energy/(ref%area*section%thickness)
      if (block%own%sized) r%energy = r%energy/block%own%ratio
      r%own = block%own
      r%bend = 0
      if (curved%any .and. block%own%grown) then
         call reference_curvature(curved, bend)
         do i = 1, 3
            r%bend(:, i) = mean(bend(:, i))
         end do
      end if
      if (curved%any) r%energy = r%energy/curved%area
      ! from the element frame into the material direction
      r%back(:, 1) = r%axes(:, 1)
      r%back(:, 2) = -r%axes(:, 2)
      call rotate_stress(lanes, r%back, r%force)
      call rotate_stress(lanes, r%back, r%moment)
   end subroutine recover_block

   !> Mean over the three in-plane points.
   pure function mean(values) result(m)
      real(wp), intent(in) :: values(3*lanes)
      real(wp) :: m(lanes)
      m = (values(1:lanes) + values(lanes + 1:2*lanes) + values(2*lanes + 1:3*lanes))/3
   end function mean

   !> Reference geometry and filtered motion of a block, and which way its laws' switches are looked at.
   pure subroutine deform(section, level, block, ref, curved, filter, vectors, quaternion, heading, status)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level
      type(block_t), intent(in) :: block
      type(reference_t), intent(out) :: ref
      type(curved_t), intent(inout) :: curved
      type(filter_t), intent(out) :: filter
      type(vector_rotation_t), intent(inout) :: vectors !< set unless the rotations are quaternions
      real(wp), intent(out) :: quaternion(lanes, 4, 3)
      type(heading_t), intent(inout) :: heading
      integer(i4), intent(out) :: status(lanes)
      logical :: switched
      status = 0
      call new_reference(block%x, ref, status)
      ref%bulge = block%bulge
      ref%bow = block%bow
      if (any(block%bulge < 1)) call hold_sides(ref)
      curved%any = .false.
      if (block%has_normals .and. section%formulation == formulation_s) &
         call new_curved(section, ref, block%normal, curved, status)
      call nodal_rotations(level, block, vectors, quaternion)
      heading%floor = 0
      heading%directed = .false.
      switched = section%switched .and. level >= level_tangent
      if (switched) call new_heading(section, block%own, ref, curved, block%x, block%u, quaternion, heading)
      if (curved%any) call turn_nodes(curved, quaternion)
      call new_filter(ref, block%u, quaternion, filter, status)
      if (switched .and. block%has_toward) call set_direction(section, block%own, ref, filter, block%toward, heading)
   end subroutine deform

   !> Nodal rotations as quaternions.
   pure subroutine nodal_rotations(level, block, vectors, quaternion)
      integer, intent(in) :: level
      type(block_t), intent(in) :: block
      type(vector_rotation_t), intent(inout) :: vectors !< set unless the rotations are quaternions
      real(wp), intent(out) :: quaternion(lanes, 4, 3)
      if (block%convention == rotation_quaternion) then
         quaternion = block%rotation
      else
         call new_vector_rotation(level, block%rotation, vectors)
         if (block%convention == rotation_increment) call turn_state(vectors, block%state)
         quaternion = vectors%quaternion
      end if
   end subroutine nodal_rotations
end module finshell_element
