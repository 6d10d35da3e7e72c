!> The door to the membrane: many elements in one call, on as many threads as allowed. What finshell_batch is to the shell.
module finshell_membrane_batch
   use finshell_block, only: check_results, gather_own, vanishing
   use finshell_environment, only: all_quiet, environment_t, hold, release
   use finshell_kinds, only: wp, i4, lanes
   use finshell_freedoms, only: n_membrane
   use finshell_evaluation, only: level_energy, level_force, level_tangent
   use finshell_element_fields, only: surface_stress
   use finshell_membrane, only: membrane_t, recover_membrane
   use finshell_membrane_chunk, only: check_membranes, evaluate_membrane_chunk, gather_membranes
   use finshell_own, only: n_growth
   use finshell_recovered, only: recovered_t
   use finshell_section, only: section_t
   use finshell_single, only: evaluate_single_membrane, most_membranes_alone
   use finshell_status, only: status_material_limit, status_ok
   use finshell_tension_field, only: state_slack, state_taut, state_wrinkled
!$ use omp_lib, only: omp_get_max_threads, omp_in_parallel
   implicit none
   private
   public :: evaluate_membranes, recover_membranes
   public :: state_slack, state_taut, state_wrinkled

   !> Blocks a thread must have to pay (some 100 us of work).
   integer, parameter :: blocks_per_thread = 256

contains

   !> Energy, nodal force and tangent of n membrane elements.
   !>
   !> Force is the derivative of the stored energy with respect to u1 u2 u3 (displacement of each node), the tangent its second
   !> derivative, symmetric, both triangles filled. What is not present is not computed. An element that fails gets its status and
   !> zeros; the others are done. With `wrinkling` of the section the energy is the relaxed one (finshell_tension_field): no element
   !> bears compression, and none fails by it but where its wrinkles are not found (status_not_converged).
   subroutine evaluate_membranes(section, n, x, u, status, energy, force, tangent, direction, threads, toward, slack_energy, &
                                 thickness, growth)
      type(section_t), intent(in) :: section
      integer, intent(in) :: n !< number of elements
      real(wp), intent(in) :: x(3, 3, n) !< reference coordinates (component, node, element)
      real(wp), intent(in) :: u(3, 3, n) !< displacements
      integer(i4), intent(out) :: status(n) !< per element, see finshell_status
      real(wp), intent(out), optional :: energy(n), force(n_membrane, n), tangent(n_membrane, n_membrane, n)
      real(wp), intent(in), optional :: direction(3, n) !< material direction 1, projected on the element; default global x
      integer, intent(in), optional :: threads !< default: OpenMP's, but no more than pay; 1 inside a parallel region
      !> Nodal displacements, with `tangent`: where a law has a switch, as fibres in tension only have it in the reference state,
      !> the tangent is the one-sided one in this direction; default: that without the fibres.
      real(wp), intent(in), optional :: toward(n_membrane, n)
      !> Of the elements' own, as in evaluate_elements (finshell_batch); all layers of a membrane grow the same.
      real(wp), intent(in), optional :: thickness(n), growth(n_growth, size(section%layers), n)
      real(wp), intent(out), optional :: slack_energy(n) !< part of the energy: what is left against compression (finshell_slack)
      type(environment_t) :: environment
      integer :: b, blocks, level, team
      logical :: quiet

      level = level_energy
      if (present(force)) level = level_force
      if (present(tangent)) level = level_tangent
      blocks = (n + lanes - 1)/lanes
      team = 1
!$    if (.not. omp_in_parallel()) team = min(omp_get_max_threads(), 1 + blocks/blocks_per_thread)
      if (present(threads)) team = max(1, threads)
      quiet = .true.
      if (n <= most_membranes_alone) then
         call hold(environment)
         do b = 0, n - 1
            call evaluate_single_membrane(section, level, b, n, x, u, status, energy, force, tangent, direction, toward, &
                                          slack_energy, thickness, growth)
         end do
         quiet = all_quiet()
         call release(environment)
      else if (team == 1 .or. blocks == 1) then
         call hold(environment)
         do b = 1, blocks
            call evaluate_membrane_chunk(section, level, (b - 1)*lanes, n, x, u, status, energy, force, tangent, direction, &
                                         toward, slack_energy, thickness, growth)
         end do
         quiet = all_quiet()
         call release(environment)
      else
!$omp parallel num_threads(team) private(environment) reduction(.and.: quiet)
         call hold(environment)
!$omp do schedule(static)
         do b = 1, blocks
            call evaluate_membrane_chunk(section, level, (b - 1)*lanes, n, x, u, status, energy, force, tangent, direction, &
                                         toward, slack_energy, thickness, growth)
         end do
!$omp end do
         quiet = all_quiet()
         call release(environment)
!$omp end parallel
      end if
      if (quiet) return
      call hold(environment)
      call check_results(n, n_membrane, status, energy, force, tangent)
      call release(environment)
      if (present(slack_energy)) where (status /= status_ok) slack_energy = 0
   end subroutine evaluate_membranes

   !> Recovered results of n membrane elements. Arguments as in `evaluate_membranes`.
   !>
   !> Components 11, 22, 12 refer to the material direction projected on the element (global x by default, z where x is normal
   !> to the element), carried along by the element's rotation. Where the sheet is wrinkled stretch and stress are those of the
   !> material, which is wider than its facet. Membrane force and stress leave out what slack sheets bear. What fails is 0.
   subroutine recover_membranes(section, n, x, u, status, stretch, membrane_force, stress, state, ridge, direction, stress_status, &
                                thickness, growth)
      type(section_t), intent(in) :: section
      integer, intent(in) :: n
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n)
      integer(i4), intent(out) :: status(n)
      real(wp), intent(out), optional :: stretch(n) !< of the thickness
      real(wp), intent(out), optional :: membrane_force(3, n) !< per reference length, conjugate to Green-Lagrange strain
      real(wp), intent(out), optional :: stress(3, 3, n) !< Cauchy stress (component; bottom, middle, top; element)
      integer(i4), intent(out), optional :: state(n) !< state_slack 0, state_wrinkled 1, state_taut 2; taut unless sheets wrinkle
      !> Unit vector along the ridges of wrinkles in the deformed state, global components; zero where there are none.
      real(wp), intent(out), optional :: ridge(3, n)
      real(wp), intent(in), optional :: direction(3, n)
      real(wp), intent(in), optional :: thickness(n), growth(n_growth, size(section%layers), n)
      !> Of the stresses (bottom, middle, top; element). Not present: a stress that fails is the element's failure.
      integer(i4), intent(out), optional :: stress_status(3, n)
      type(environment_t) :: environment
      type(membrane_t) :: block
      type(recovered_t) :: r
      real(wp) :: sigma(lanes, 3, 3)
      integer(i4) :: surface(lanes, 3)
      integer(i4), dimension(lanes) :: found, input
      integer :: first, i, l
      logical :: changed, good

      call hold(environment)
      do first = 0, n - 1, lanes
         call gather_membranes(first, n, x, u, block, direction)
         call gather_own(section, first, n, block%own, thickness, growth=growth)
         input = status_ok
         call check_membranes(block, present(direction), input, changed)
         call recover_membrane(section, block, r, found)
         if (present(stress)) surface = spread(found, 2, 3)
         where (found == status_ok .and. .not. vanishing(reshape(r%force, [3*lanes])) + 0*r%stretch <= 0) &
            found = status_material_limit
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
            good = found(l) == status_ok
            if (present(stretch)) stretch(first + l) = merge(r%stretch(l), 0.0_wp, good)
            if (present(membrane_force)) membrane_force(:, first + l) = merge(r%force(l, :), 0.0_wp, good)
            if (present(state)) state(first + l) = merge(r%state(l), 0_i4, good)
            if (present(ridge)) ridge(:, first + l) = merge(r%ridge(l, :), 0.0_wp, good)
            if (present(stress)) then
               do i = 1, 3
                  stress(:, i, first + l) = merge(sigma(l, :, i), 0.0_wp, surface(l, i) == status_ok)
               end do
            end if
            if (.not. present(stress_status)) cycle
            stress_status(:, first + l) = found(l)
            if (present(stress)) stress_status(:, first + l) = surface(l, :)
         end do
      end do
      call release(environment)
   end subroutine recover_membranes
end module finshell_membrane_batch
