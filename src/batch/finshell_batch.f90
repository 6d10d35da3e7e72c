!> The one door to the kernel: many elements in one call, on as many threads as allowed.
!>
!> Assembly, C interface and tests all come through here. Elements are gathered into blocks of `lanes`, evaluated side by side
!> and scattered back; every element is computed by the same operations wherever it stands, so results do not depend on the
!> number of threads nor on how a mesh is split into calls. But for calls of up to three elements (finshell_single): the same
!> formulas, other instructions, so that their results differ by rounding.
module finshell_batch
   use finshell_block, only: bad_shape, check_input, check_results, gather, gather_own, vanishing
   use finshell_chunk, only: evaluate_chunk, n_resultants
   use finshell_environment, only: all_quiet, environment_t, hold, release
   use finshell_kinds, only: wp, i4, lanes
   use finshell_freedoms, only: n_shell
   use finshell_element, only: block_t, predict_block, recover_block, stress_t, rotation_vector, rotation_quaternion, &
      rotation_increment
   use finshell_element_fields, only: surface_stress
   use finshell_evaluation, only: level_energy, level_force, level_tangent
   use finshell_recovered, only: recovered_t
   use finshell_law_states, only: law_states_t
   use finshell_point_states, only: new_point_states, point_states_t
   use finshell_own, only: n_growth
   use finshell_reference, only: side_free, side_straight, side_fixed
   use finshell_section, only: section_t
   use finshell_single, only: evaluate_single, most_alone
   use finshell_status, only: status_invalid_argument, status_material_limit, status_ok
!$ use omp_lib, only: omp_get_max_threads, omp_in_parallel
   implicit none
   private
   public :: evaluate_elements, predict_resultants, recover_elements
   public :: rotation_vector, rotation_quaternion, rotation_increment, n_resultants, n_growth, side_free, side_straight, side_fixed

   !> Blocks a thread must have to pay (some 100 us of work; waking a team takes about 10).
   integer, parameter :: blocks_per_thread = 32

contains

   !> Energy, nodal force and tangent of n elements.
   !>
   !> Force is the derivative of the stored energy with respect to u1 t1 u2 t2 u3 t3 (displacement and rotation of each node),
   !> the tangent its second derivative, symmetric, both triangles filled. What is not present is not computed.
   !> An element that fails gets its status and zeros; the others are done.
   subroutine evaluate_elements(section, n, x, u, rotation, convention, status, energy, force, tangent, direction, threads, &
                                state, resultants, toward, held, normal, thickness, offset, growth, states)
      type(section_t), intent(in) :: section
      integer, intent(in) :: n !< number of elements
      real(wp), intent(in) :: x(3, 3, n) !< reference coordinates (component, node, element)
      real(wp), intent(in) :: u(3, 3, n) !< displacements
      !> Nodal rotations, (4, 3, n) quaternions or (3, 3, n) rotation vectors as `convention` says.
      real(wp), intent(in) :: rotation(:, :, :)
      integer, intent(in) :: convention !< rotation_quaternion, rotation_vector or rotation_increment
      integer(i4), intent(out) :: status(n) !< per element, see finshell_status
      real(wp), intent(out), optional :: energy(n), force(n_shell, n), tangent(n_shell, n_shell, n)
      real(wp), intent(in), optional :: direction(3, n) !< material direction 1, projected on the element; default global x
      integer, intent(in), optional :: threads !< default: OpenMP's, but no more than pay; 1 inside a parallel region
      !> Quaternions that rotation_increment starts from: R = exp(rotation) state. Required by it, not looked at otherwise.
      real(wp), intent(in), optional :: state(4, 3, n)
      !> For the geometric part of the tangent instead of the elements' own (mixed-integration-point Newton, `predict_resultants`).
      real(wp), intent(in), optional :: resultants(n_resultants, n)
      !> Nodal displacements and spins, with rotation_quaternion and `tangent`: where a law has a switch, as fibres in tension only
      !> have it in the reference state, the tangent is the one-sided one in this direction; default: that without the fibres.
      real(wp), intent(in), optional :: toward(n_shell, n)
      !> Sides (nodes 1-2, 2-3, 3-1) whose displacement is prescribed, in the plane of the element (side_straight) or in it and
      !> along its normal (side_fixed); else side_free.
      integer, intent(in), optional :: held(3, n)
      !> Normals of the surface at the nodes of each element (component, node, element), of any length: the reference is curved. In
      !> (S) only; absent: flat facets.
      real(wp), intent(in), optional :: normal(3, 3, n)
      !> Of laws that have states (finshell_law_states); absent: none has been strained before, and the step has no time.
      type(law_states_t), intent(in), optional :: states
      !> Of the elements' own instead of the section's: thickness of the whole section, in which all layers share, and height of its
      !> middle above the surface of the nodes.
      real(wp), intent(in), optional :: thickness(n), offset(n)
      !> Stress-free state of each layer: Green-Lagrange strain 11, 22, 2 12 along the material direction, from the reference, and
      !> growth of the thickness, less 1 (finshell_growth). Zeros: the reference.
      real(wp), intent(in), optional :: growth(n_growth, size(section%layers), n)
      type(environment_t) :: environment
      integer :: b, blocks, level, team
      logical :: quiet

      if (section%membrane .or. bad_shape(rotation, convention, n, present(state))) then ! of membranes: finshell_membrane_batch
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
      quiet = .true.
      if (n <= most_alone) then
         call hold(environment)
         do b = 0, n - 1
            call evaluate_single(section, level, b, n, x, u, rotation, convention, status, energy, force, tangent, direction, &
                                 state, resultants, toward, held, normal, thickness, offset, growth, states)
         end do
         quiet = all_quiet()
         call release(environment)
      else if (team == 1 .or. blocks == 1) then
         call hold(environment)
         do b = 1, blocks
            call evaluate_chunk(section, level, (b - 1)*lanes, n, x, u, rotation, convention, status, energy, force, tangent, &
                                direction, state, resultants, toward, held, normal, thickness, offset, growth, states)
         end do
         quiet = all_quiet()
         call release(environment)
      else
!$omp parallel num_threads(team) private(environment) reduction(.and.: quiet)
         call hold(environment)
!$omp do schedule(static)
         do b = 1, blocks
            call evaluate_chunk(section, level, (b - 1)*lanes, n, x, u, rotation, convention, status, energy, force, tangent, &
                                direction, state, resultants, toward, held, normal, thickness, offset, growth, states)
         end do
!$omp end do
         quiet = all_quiet()
         call release(environment)
!$omp end parallel
      end if
      if (.not. quiet) then
         call hold(environment)
         call check_results(n, n_shell, status, energy, force, tangent)
         call release(environment)
      end if
   end subroutine evaluate_elements

   !> Resultants of n elements, linearised: those of this state plus tangent times the strains of nodal increments.
   !>
   !> Mixed-integration-point Newton (Magisano, Leonetti & Garcea 2017): the stress of the next iterate is taken from the
   !> linearisation of the last one. The solution is unchanged, thin shells take much larger increments.
   subroutine predict_resultants(section, n, x, u, quaternion, increment, resultants, status, direction, toward, held, &
                                 normal, thickness, offset, growth, states)
      type(section_t), intent(in) :: section
      integer, intent(in) :: n
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), quaternion(4, 3, n)
      real(wp), intent(in) :: increment(n_shell, n) !< nodal displacements and spins, u1 t1 u2 t2 u3 t3
      real(wp), intent(out) :: resultants(n_resultants, n)
      integer(i4), intent(out) :: status(n)
      real(wp), intent(in), optional :: direction(3, n)
      real(wp), intent(in), optional :: toward(n_shell, n) !< as in `evaluate_elements`
      integer, intent(in), optional :: held(3, n)
      real(wp), intent(in), optional :: normal(3, 3, n)
      real(wp), intent(in), optional :: thickness(n), offset(n), growth(n_growth, size(section%layers), n)
      type(law_states_t), intent(in), optional :: states !< those at the end are not looked at
      type(block_t) :: block
      type(environment_t) :: environment
      type(point_states_t) :: remembered
      type(stress_t) :: stress
      real(wp) :: increments(lanes, n_shell)
      integer(i4) :: found(lanes)
      integer :: first, g, l, v

      call hold(environment)
      do first = 0, n - 1, lanes
         call gather(first, n, x, u, quaternion, rotation_quaternion, block, direction, held=held, toward=toward, &
                     normal=normal)
         call gather_own(section, first, n, block%own, thickness, offset, growth)
         increments = 0
         do l = 1, min(lanes, n - first)
            increments(l, :) = increment(:, first + l)
         end do
         if (present(states)) call new_point_states(states, first, n, remembered)
         nullify (remembered%all%end)
         call predict_block(section, block, increments, stress, found, remembered)
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
      call release(environment)
   end subroutine predict_resultants

   !> Recovered results of n elements: thickness stretch, resultants, stresses. Arguments as in `evaluate_elements`.
   !>
   !> Components 11, 22, 12 refer to the material direction projected on the element (global x by default, z where x is normal
   !> to the element), carried along by the element's rotation. Stresses are evaluated only if they are asked for: a law may end at
   !> the surfaces and not before. What fails is 0.
   subroutine recover_elements(section, n, x, u, rotation, convention, status, stretch, membrane_force, moment, stress, direction, &
                               state, stress_status, held, normal, thickness, offset, growth, states)
      type(section_t), intent(in) :: section
      integer, intent(in) :: n, convention
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), rotation(:, :, :)
      integer(i4), intent(out) :: status(n)
      real(wp), intent(out), optional :: stretch(n) !< thickness stretch of the midsurface
      real(wp), intent(out), optional :: membrane_force(3, n) !< per reference length, conjugate to Green-Lagrange strain
      real(wp), intent(out), optional :: moment(3, n)
      real(wp), intent(out), optional :: stress(3, 3, n) !< Cauchy stress (component; bottom, middle, top; element)
      real(wp), intent(in), optional :: direction(3, n), state(4, 3, n)
      !> Of the stresses (bottom, middle, top; element). Not present: a stress that fails is the element's failure.
      integer(i4), intent(out), optional :: stress_status(3, n)
      integer, intent(in), optional :: held(3, n)
      real(wp), intent(in), optional :: normal(3, 3, n)
      type(law_states_t), intent(in), optional :: states !< those at the end are not looked at
      real(wp), intent(in), optional :: thickness(n), offset(n), growth(n_growth, size(section%layers), n)
      type(block_t) :: block
      type(environment_t) :: environment
      type(recovered_t) :: r
      type(point_states_t) :: remembered
      real(wp) :: sigma(lanes, 3, 3)
      integer(i4) :: surface(lanes, 3)
      integer(i4) :: found(lanes), input(lanes)
      integer :: first, i, l
      logical :: changed

      if (section%membrane .or. bad_shape(rotation, convention, n, present(state))) then ! of membranes: finshell_membrane_batch
         status = status_invalid_argument
         if (present(stretch)) stretch = 0
         if (present(membrane_force)) membrane_force = 0
         if (present(moment)) moment = 0
         if (present(stress)) stress = 0
         if (present(stress_status)) stress_status = status_invalid_argument
         return
      end if
      call hold(environment)
      do first = 0, n - 1, lanes
         call gather(first, n, x, u, rotation, convention, block, direction, state, held, normal=normal)
         call gather_own(section, first, n, block%own, thickness, offset, growth)
         input = status_ok
         call check_input(block, present(direction), input, changed)
         if (present(states)) call new_point_states(states, first, n, remembered)
         nullify (remembered%all%end)
         call recover_block(section, block, r, found, remembered)
         if (present(stress)) surface = spread(found, 2, 3)
         where (found == status_ok .and. .not. vanishing(reshape(r%force, [3*lanes])) + vanishing(reshape(r%moment, [3*lanes])) &
                + 0*r%stretch <= 0) found = status_material_limit
         where (input /= status_ok) found = input
         if (present(stress)) then
            do i = 1, 3
               call surface_stress(section, r, i, sigma(:, :, i), surface(:, i))
               where (surface(:, i) == status_ok .and. .not. vanishing(reshape(sigma(:, :, i), [3*lanes])) <= 0) &
                  surface(:, i) = status_material_limit
               where (found /= status_ok) surface(:, i) = found
            end do
            if (.not. present(stress_status)) then
               found = max(found, maxval(surface, dim=2))
               surface = spread(found, 2, 3)
            end if
         end if
         do l = 1, min(lanes, n - first)
            status(first + l) = found(l)
            if (present(stretch)) stretch(first + l) = merge(r%stretch(l), 0.0_wp, found(l) == status_ok)
            if (present(membrane_force)) membrane_force(:, first + l) = merge(r%force(l, :), 0.0_wp, found(l) == status_ok)
            if (present(moment)) moment(:, first + l) = merge(r%moment(l, :), 0.0_wp, found(l) == status_ok)
            if (.not. present(stress)) cycle
            do i = 1, 3
               stress(:, i, first + l) = merge(sigma(l, :, i), 0.0_wp, surface(l, i) == status_ok)
            end do
            if (present(stress_status)) stress_status(:, first + l) = surface(l, :)
         end do
      end do
      call release(environment)
   end subroutine recover_elements
end module finshell_batch
