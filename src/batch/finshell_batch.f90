!> The one door to the kernel: many elements in one call, on as many threads as allowed.
!>
!> Assembly, C interface and tests all come through here. Elements are gathered into blocks of `lanes`, evaluated side by side
!> and scattered back; every element is computed by the same operations wherever it stands, so results do not depend on the
!> number of threads nor on how a mesh is split into calls.
module finshell_batch
   use finshell_kinds, only: wp, i4, lanes
   use finshell_element, only: evaluate_block, predict_block, recover_block, stress_t, rotation_vector, rotation_quaternion, &
      rotation_increment
   use finshell_material, only: level_energy, level_force, level_tangent
   use finshell_section, only: section_t
   use finshell_status, only: status_ok, status_invalid_argument, status_not_a_number
!$ use omp_lib, only: omp_get_max_threads, omp_in_parallel
   implicit none
   private
   public :: evaluate_elements, predict_resultants, recover_elements
   public :: rotation_vector, rotation_quaternion, rotation_increment, n_resultants

   !> Resultants of an element at its three in-plane points: N11, N22, N12, M11, M22, M12 of each point in turn.
   integer, parameter :: n_resultants = 18
   !> Blocks a thread must have to pay (some 100 us of work; waking a team takes about 10).
   integer, parameter :: blocks_per_thread = 32

   !> A block of elements, side by side.
   type :: block_t
      real(wp) :: x(lanes, 3, 3), u(lanes, 3, 3), rotation(lanes, 4, 3), direction(lanes, 3), state(lanes, 4, 3)
      real(wp) :: bulge(lanes, 3) !< 0 for a straight side, else 1
   end type block_t

contains

   !> Energy, nodal force and tangent of n elements.
   !>
   !> Force is the derivative of the stored energy with respect to u1 t1 u2 t2 u3 t3 (displacement and rotation of each node),
   !> the tangent its second derivative, symmetric, both triangles filled. What is not present is not computed.
   !> An element that fails gets its status and zeros; the others are done.
   subroutine evaluate_elements(section, n, x, u, rotation, convention, status, energy, force, tangent, direction, threads, &
                                state, resultants, straight)
      type(section_t), intent(in) :: section
      integer, intent(in) :: n !< number of elements
      real(wp), intent(in) :: x(3, 3, n) !< reference coordinates (component, node, element)
      real(wp), intent(in) :: u(3, 3, n) !< displacements
      !> Nodal rotations, (4, 3, n) quaternions or (3, 3, n) rotation vectors as `convention` says.
      real(wp), intent(in) :: rotation(:, :, :)
      integer, intent(in) :: convention !< rotation_quaternion, rotation_vector or rotation_increment
      integer(i4), intent(out) :: status(n) !< per element, see finshell_status
      real(wp), intent(out), optional :: energy(n), force(18, n), tangent(18, 18, n)
      real(wp), intent(in), optional :: direction(3, n) !< material direction 1, projected on the element; default global x
      integer, intent(in), optional :: threads !< default: OpenMP's, but no more than pay; 1 inside a parallel region
      !> Quaternions that rotation_increment starts from: R = exp(rotation) state. Required by it, not looked at otherwise.
      real(wp), intent(in), optional :: state(4, 3, n)
      !> For the geometric part of the tangent instead of the elements' own (mixed-integration-point Newton, `predict_resultants`).
      real(wp), intent(in), optional :: resultants(n_resultants, n)
      !> Sides (nodes 1-2, 2-3, 3-1) that drilling rotations do not bend: those whose displacement is prescribed.
      logical, intent(in), optional :: straight(3, n)
      integer :: b, blocks, level, team

      if (bad_shape(rotation, convention, n, present(state))) then
         status = status_invalid_argument
         if (present(energy)) energy = 0
         if (present(force)) force = 0
         if (present(tangent)) tangent = 0
         return
      end if
      level = level_energy
      if (present(force)) level = level_force
      if (present(tangent)) level = level_tangent
      blocks = (n + lanes - 1)/lanes
      team = 1
!$    if (.not. omp_in_parallel()) team = min(omp_get_max_threads(), 1 + blocks/blocks_per_thread)
      if (present(threads)) team = max(1, threads)
      if (team == 1 .or. blocks == 1) then
         do b = 1, blocks
            call evaluate_chunk(section, level, (b - 1)*lanes, n, x, u, rotation, convention, status, energy, force, tangent, &
                                direction, state, resultants, straight)
         end do
      else
!$omp parallel do schedule(static) num_threads(team)
         do b = 1, blocks
            call evaluate_chunk(section, level, (b - 1)*lanes, n, x, u, rotation, convention, status, energy, force, tangent, &
                                direction, state, resultants, straight)
         end do
!$omp end parallel do
      end if
   end subroutine evaluate_elements

   !> Resultants of n elements, linearised: those of this state plus tangent times the strains of nodal increments.
   !>
   !> Mixed-integration-point Newton (Magisano, Leonetti & Garcea 2017): the stress of the next iterate is taken from the
   !> linearisation of the last one. The solution is unchanged, thin shells take much larger increments.
   subroutine predict_resultants(section, n, x, u, quaternion, increment, resultants, status, direction, straight)
      type(section_t), intent(in) :: section
      integer, intent(in) :: n
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), quaternion(4, 3, n)
      real(wp), intent(in) :: increment(18, n) !< nodal displacements and spins, u1 t1 u2 t2 u3 t3
      real(wp), intent(out) :: resultants(n_resultants, n)
      integer(i4), intent(out) :: status(n)
      real(wp), intent(in), optional :: direction(3, n)
      logical, intent(in), optional :: straight(3, n)
      type(block_t) :: block
      type(stress_t) :: stress
      real(wp) :: increments(lanes, 18)
      integer(i4) :: found(lanes)
      integer :: first, g, l, v

      do first = 0, n - 1, lanes
         call gather(first, n, x, u, quaternion, rotation_quaternion, block, direction, straight=straight)
         increments = 0
         do l = 1, min(lanes, n - first)
            increments(l, :) = increment(:, first + l)
         end do
         call predict_block(section, block%x, block%u, block%rotation, increments, block%direction, block%bulge, stress, found)
         do l = 1, min(lanes, n - first)
            status(first + l) = found(l)
            do g = 1, 3
               do v = 1, 3
                  resultants(6*g - 6 + v, first + l) = stress%n(lanes*(g - 1) + l, v)
                  resultants(6*g - 3 + v, first + l) = stress%m(lanes*(g - 1) + l, v)
               end do
            end do
         end do
      end do
   end subroutine predict_resultants

   !> Recovered results of n elements: thickness stretch, resultants, stresses. Arguments as in `evaluate_elements`.
   !>
   !> Components 11, 22, 12 refer to the material direction projected on the element (global x by default, z where x is normal
   !> to the element), carried along by the element's rotation.
   subroutine recover_elements(section, n, x, u, rotation, convention, status, stretch, membrane_force, moment, stress, direction, &
                               state, straight)
      type(section_t), intent(in) :: section
      integer, intent(in) :: n, convention
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), rotation(:, :, :)
      integer(i4), intent(out) :: status(n)
      real(wp), intent(out), optional :: stretch(n) !< thickness stretch of the midsurface
      real(wp), intent(out), optional :: membrane_force(3, n) !< per reference length, conjugate to Green-Lagrange strain
      real(wp), intent(out), optional :: moment(3, n)
      real(wp), intent(out), optional :: stress(3, 3, n) !< Cauchy stress (component; bottom, middle, top; element)
      real(wp), intent(in), optional :: direction(3, n), state(4, 3, n)
      logical, intent(in), optional :: straight(3, n)
      type(block_t) :: block
      real(wp) :: s(lanes), f(lanes, 3), m(lanes, 3), sigma(lanes, 3, 3)
      integer(i4) :: found(lanes)
      integer :: first, l

      if (bad_shape(rotation, convention, n, present(state))) then
         status = status_invalid_argument
         if (present(stretch)) stretch = 0
         if (present(membrane_force)) membrane_force = 0
         if (present(moment)) moment = 0
         if (present(stress)) stress = 0
         return
      end if
      do first = 0, n - 1, lanes
         call gather(first, n, x, u, rotation, convention, block, direction, state, straight)
         if (convention == rotation_increment) then
            call recover_block(section, block%x, block%u, block%rotation, convention, block%direction, block%bulge, s, f, m, &
                               sigma, found, block%state)
         else
            call recover_block(section, block%x, block%u, block%rotation, convention, block%direction, block%bulge, s, f, m, &
                               sigma, found)
         end if
         call check_input(block, convention, found)
         do l = 1, min(lanes, n - first)
            status(first + l) = found(l)
            if (present(stretch)) stretch(first + l) = merge(s(l), 0.0_wp, found(l) == status_ok)
            if (present(membrane_force)) membrane_force(:, first + l) = merge(f(l, :), 0.0_wp, found(l) == status_ok)
            if (present(moment)) moment(:, first + l) = merge(m(l, :), 0.0_wp, found(l) == status_ok)
            if (present(stress)) stress(:, :, first + l) = merge(sigma(l, :, :), 0.0_wp, found(l) == status_ok)
         end do
      end do
   end subroutine recover_elements

   !> Rotations must be (4, 3, >= n) quaternions or (3, 3, >= n) vectors; increments need a state.
   pure logical function bad_shape(rotation, convention, n, has_state)
      real(wp), intent(in) :: rotation(:, :, :)
      integer, intent(in) :: convention, n
      logical, intent(in) :: has_state
      bad_shape = size(rotation, 1) /= merge(4, 3, convention == rotation_quaternion) .or. size(rotation, 2) /= 3 &
                  .or. size(rotation, 3) < n .or. convention < rotation_vector .or. convention > rotation_increment &
                  .or. (convention == rotation_increment .and. .not. has_state)
   end function bad_shape

   !> Elements first + 1 ... of the batch, side by side; missing ones at the end repeat the first of the block.
   pure subroutine gather(first, n, x, u, rotation, convention, block, direction, state, straight)
      integer, intent(in) :: first, n, convention
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), rotation(:, :, :)
      type(block_t), intent(out) :: block
      real(wp), intent(in), optional :: direction(3, n), state(4, 3, n)
      logical, intent(in), optional :: straight(3, n)
      integer :: c, e, j, l
      do l = 1, lanes
         e = first + merge(l, 1, first + l <= n)
         do j = 1, 3
            do c = 1, 3
               block%x(l, c, j) = x(c, j, e)
               block%u(l, c, j) = u(c, j, e)
               block%rotation(l, c, j) = rotation(c, j, e)
            end do
            block%rotation(l, 4, j) = 0
            if (convention == rotation_quaternion) block%rotation(l, 4, j) = rotation(4, j, e)
         end do
         block%direction(l, :) = [1.0_wp, 0.0_wp, 0.0_wp]
         if (present(direction)) block%direction(l, :) = direction(:, e)
         if (convention == rotation_increment) block%state(l, :, :) = state(:, :, e)
      end do
      block%bulge = 1
      if (.not. present(straight)) return
      do l = 1, lanes
         block%bulge(l, :) = merge(0.0_wp, 1.0_wp, straight(:, first + merge(l, 1, first + l <= n)))
      end do
   end subroutine gather

   !> NaN and infinity in the input, found by one sum over it.
   pure subroutine check_input(block, convention, status)
      type(block_t), intent(in) :: block
      integer, intent(in) :: convention
      integer(i4), intent(inout) :: status(lanes)
      real(wp) :: total(lanes), length(lanes)
      integer :: c, j
      total = 0
      do j = 1, 3
         do c = 1, 3
            total = total + abs(block%x(:, c, j)) + abs(block%u(:, c, j)) + abs(block%rotation(:, c, j))
         end do
         total = total + abs(block%rotation(:, 4, j)) + abs(block%direction(:, j))
         if (convention == rotation_vector) cycle
         if (convention == rotation_quaternion) then
            length = absolute_sum(block%rotation(:, :, j))
         else
            length = absolute_sum(block%state(:, :, j))
            total = total + length
         end if
         ! a quaternion of zeros is no rotation
         where (length <= 0) status = status_invalid_argument
      end do
      where (.not. total <= huge(1.0_wp)) status = status_not_a_number
   end subroutine check_input

   pure function absolute_sum(q) result(s)
      real(wp), intent(in) :: q(lanes, 4)
      real(wp) :: s(lanes)
      s = abs(q(:, 1)) + abs(q(:, 2)) + abs(q(:, 3)) + abs(q(:, 4))
   end function absolute_sum

   !> Elements first + 1 ... of the batch.
   subroutine evaluate_chunk(section, level, first, n, x, u, rotation, convention, status, energy, force, tangent, direction, &
                             state, resultants, straight)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level, first, n, convention
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), rotation(:, :, :)
      integer(i4), intent(inout) :: status(n)
      real(wp), intent(inout), optional :: energy(n), force(18, n), tangent(18, 18, n)
      real(wp), intent(in), optional :: direction(3, n), state(4, 3, n), resultants(n_resultants, n)
      logical, intent(in), optional :: straight(3, n)
      type(block_t) :: block
      type(stress_t) :: stress
      real(wp) :: eb(lanes), fb(lanes, 18), kb(lanes, 18, 18)
      integer(i4) :: found(lanes)
      integer :: i, l, used

      used = min(lanes, n - first)
      call gather(first, n, x, u, rotation, convention, block, direction, state, straight)
      if (convention == rotation_increment) then
         call evaluate_block(section, level, block%x, block%u, block%rotation, convention, block%direction, block%bulge, eb, &
                             fb, kb, found, block%state)
      else if (present(resultants)) then
         call gather_stress(first, n, resultants, stress)
         call evaluate_block(section, level, block%x, block%u, block%rotation, convention, block%direction, block%bulge, eb, &
                             fb, kb, found, stress=stress)
      else
         call evaluate_block(section, level, block%x, block%u, block%rotation, convention, block%direction, block%bulge, eb, &
                             fb, kb, found)
      end if
      call check_input(block, convention, found)
      status(first + 1:first + used) = found(1:used)
      do l = 1, used
         if (found(l) == status_ok) cycle
         eb(l) = 0
         fb(l, :) = 0
         if (level == level_tangent) kb(l, :, :) = 0
      end do
      if (present(energy)) energy(first + 1:first + used) = eb(1:used)
      if (present(force)) then
         do l = 1, used
            do i = 1, 18
               force(i, first + l) = fb(l, i)
            end do
         end do
      end if
      if (present(tangent)) call separate(used, kb, tangent(:, :, first + 1:first + used))
   end subroutine evaluate_chunk

   !> Resultants of the elements first + 1 ..., side by side.
   pure subroutine gather_stress(first, n, resultants, stress)
      integer, intent(in) :: first, n
      real(wp), intent(in) :: resultants(n_resultants, n)
      type(stress_t), intent(out) :: stress
      integer :: e, g, l, v
      do l = 1, lanes
         e = first + merge(l, 1, first + l <= n)
         do g = 1, 3
            do v = 1, 3
               stress%n(lanes*(g - 1) + l, v) = resultants(6*g - 6 + v, e)
               stress%m(lanes*(g - 1) + l, v) = resultants(6*g - 3 + v, e)
            end do
         end do
      end do
   end subroutine gather_stress

   !> Tangents of a block, upper triangles side by side, as full matrices one after the other.
   pure subroutine separate(used, block, elements)
      integer, intent(in) :: used
      real(wp), intent(in) :: block(lanes, 18, 18)
      real(wp), intent(inout) :: elements(18, 18, used)
      integer :: i, j, l
      do l = 1, used
         do j = 1, 18
            do i = 1, j
               elements(i, j, l) = block(l, i, j)
            end do
            do i = j + 1, 18
               elements(i, j, l) = block(l, j, i)
            end do
         end do
      end do
   end subroutine separate
end module finshell_batch
