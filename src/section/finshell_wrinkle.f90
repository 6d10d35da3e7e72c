!> Wrinkles of a sheet: their direction and amplitude, by minimising the energy.
!>
!> A wrinkled sheet has more width than its facet shows. With t along the ridges, n across them and a >= 0 the strain that ironing
!> adds, the material is strained by E + a n (x) n, and the sheet takes direction and amplitude of least energy: there S n = 0. In
!> axes t, n Newton's equations for S_nn = 0 and S_nt = 0 are, with h = 2 a (D_gg - D_ng^2/D_nn) + S_tt - S_nn,
!>
!>     h dphi = S_nt - D_ng/D_nn S_nn,    D_nn da = 2 a D_ng dphi - S_nn
!>
!> (terms with S_nt, which vanish at the solution, are left out). A step is shortened where the energy rises again at its end, to
!> where the slope vanishes by the stiffness found there: fibres that begin to bear may be a million times stiffer than the rest.
module finshell_wrinkle
   use finshell_kinds, only: wp, i4, lanes
   use finshell_evaluation, only: level_tangent
   use finshell_membrane_section, only: integrate_membrane, membrane_force_t
   use finshell_section, only: section_t
   use finshell_status, only: status_ok
   use finshell_voigt, only: rotate_strain
   implicit none
   private
   public :: wrinkle_t, find_wrinkles, principal_axes

   !> Wrinkles of a block of elements; where `found` is false only `refused` means anything.
   type :: wrinkle_t
      real(wp) :: ridge(lanes, 2) !< cosine, sine of the direction of the ridges
      real(wp) :: amplitude(lanes) !< strain added across them
      real(wp) :: strain(lanes, 3) !< of the material, along and across the ridges
      type(membrane_force_t) :: force !< in these axes
      logical :: found(lanes)
      logical :: refused(lanes) !< the law has ended on the way
   end type wrinkle_t

   integer, parameter :: most_iterations = 60, patience = 20, angles = 16
   !> The error of a quadratic iteration is the square of its last step.
   real(wp), parameter :: last_step = epsilon(1.0_wp)**0.6_wp, rounding = 8*epsilon(1.0_wp)
   real(wp), parameter :: largest_turn = 0.3_wp, shortest = 1.0e-9_wp
   integer, parameter :: iterating = 0, last = 1, finished = 2

contains

   !> Wrinkles of the elements that are `wanted`, from the force that the sheet would bear without them.
   pure subroutine find_wrinkles(section, strain, axes, wanted, flat, evaluated, wrinkle)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: strain(lanes, 3)
      real(wp), intent(in) :: axes(lanes, 2) !< material direction in the axes of the strain
      logical, intent(in) :: wanted(lanes)
      type(membrane_force_t), intent(in) :: flat !< at the strain, with the tangent unless the section is isotropic
      logical, intent(in) :: evaluated(lanes) !< false: the law refuses this strain, so there is no `flat`
      type(wrinkle_t), intent(out) :: wrinkle
      real(wp) :: ridge(lanes, 2), guess
      integer :: l
      logical :: missing(lanes)

      wrinkle%found = .false.
      wrinkle%refused = .false.
      call principal_axes(strain, 0.5_wp, wrinkle%ridge)
      if (.not. section%isotropic) then
         ! where the law refused, the axes of strain must do
         call principal_axes(flat%n, 1.0_wp, ridge)
         do l = 1, lanes
            if (evaluated(l)) wrinkle%ridge(l, :) = ridge(l, :)
         end do
      end if
      call natural_amplitude(strain, wrinkle%ridge, wrinkle%amplitude)
      if (.not. section%isotropic) then
         do l = 1, lanes
            if (.not. evaluated(l)) cycle
            guess = newton_amplitude(flat%n(l, :), flat%a(l, :), wrinkle%ridge(l, :))
            if (guess > 0 .and. guess < 0.1_wp + wrinkle%amplitude(l)) wrinkle%amplitude(l) = guess
         end do
      end if
      call search(section, strain, axes, wanted, .not. section%isotropic, wrinkle)
      missing = wanted .and. .not. wrinkle%found
      if (.not. section%isotropic .and. any(missing)) call look_around(section, strain, axes, missing, wrinkle)
   end subroutine find_wrinkles

   !> The rare case, fibres so stiff that Newton's iteration zigzags where they begin to bear: the least energy of fixed directions,
   !> then bisection by the slope of the energy over the direction, which ends in any case.
   pure subroutine look_around(section, strain, axes, missing, wrinkle)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: strain(lanes, 3), axes(lanes, 2)
      logical, intent(inout) :: missing(lanes)
      type(wrinkle_t), intent(inout) :: wrinkle
      real(wp), parameter :: pi = acos(-1.0_wp), spacing = pi/angles
      real(wp), dimension(lanes) :: amplitude, angle, best, energy, from, to
      real(wp) :: noise
      integer :: j, l
      logical :: after

      energy = huge(1.0_wp)
      best = 0
      from = 0
      to = 0
      do j = 1, angles + digits(1.0_wp)
         angle = merge((j - 0.5_wp)*spacing, 0.5_wp*(from + to), j <= angles)
         do l = 1, lanes
            if (missing(l)) wrinkle%ridge(l, :) = [cos(angle(l)), sin(angle(l))]
         end do
         call natural_amplitude(strain, wrinkle%ridge, amplitude)
         wrinkle%amplitude = merge(amplitude, wrinkle%amplitude, missing)
         call search(section, strain, axes, missing, .false., wrinkle)
         do l = 1, lanes
            if (.not. missing(l)) cycle
            ! the energy falls with the angle where S_nt > 0; a direction that makes no wrinkles lies outside
            after = angle(l) < best(l)
            if (wrinkle%amplitude(l) > epsilon(1.0_wp)*sum(abs(strain(l, :))) .and. wrinkle%force%energy(l) < huge(1.0_wp)) &
               after = wrinkle%force%n(l, 3) > 0
            if (wrinkle%force%energy(l) < energy(l)) then
               energy(l) = wrinkle%force%energy(l)
               best(l) = angle(l)
            end if
            if (j > angles) then
               if (after) then
                  from(l) = angle(l)
               else
                  to(l) = angle(l)
               end if
            end if
         end do
         if (j == angles) then
            from = best - spacing
            to = best + spacing
            missing = missing .and. energy < huge(1.0_wp)
            if (.not. any(missing)) return
         end if
      end do
      do l = 1, lanes
         if (.not. missing(l)) cycle
         associate (n => wrinkle%force%n(l, :), a => wrinkle%force%a(l, :))
            noise = rounding*max(section%natural_stiffness, maxval(abs(a(1:3))))*sum(abs(strain(l, :)))
            wrinkle%found(l) = max(abs(n(2)), abs(n(3))) <= last_step*abs(n(1)) + noise .and. n(1) >= -noise .and. a(2) > 0
         end associate
      end do
   end subroutine look_around

   !> Newton's iteration from ridge and amplitude as they come in; lanes that are not active stay as they are.
   pure subroutine search(section, strain, axes, active, turning, wrinkle)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: strain(lanes, 3), axes(lanes, 2)
      logical, intent(in) :: active(lanes)
      logical, intent(in) :: turning !< false: the direction is kept
      type(wrinkle_t), intent(inout) :: wrinkle
      type(membrane_force_t) :: r
      real(wp) :: ridge(lanes, 2), amplitude(lanes), e(lanes, 3), local(lanes, 2), beyond(lanes, 6), d(6)
      real(wp), dimension(lanes) :: turn, change, fraction, fall, whole
      real(wp) :: rise, size_of_strain, size_of_step, tolerance, noise, across, shear, h
      integer(i4) :: status(lanes)
      integer :: iteration, l, phase(lanes)
      logical :: started(lanes), bounded, converged

      ridge = wrinkle%ridge
      amplitude = wrinkle%amplitude
      phase = merge(iterating, finished, active)
      started = .false.
      beyond = 0
      whole = abs(strain(:, 1)) + abs(strain(:, 2)) + abs(strain(:, 3))
      where (active) wrinkle%found = .false.
      where (active) wrinkle%force%energy = huge(1.0_wp)
      do iteration = 1, most_iterations
         if (all(phase == finished)) exit
         call rotate_strain(lanes, ridge, strain, e)
         e(:, 2) = e(:, 2) + amplitude
         ! the shear that rounding leaves in principal axes, times a large stiffness along, is no small stiffness across
         if (section%isotropic) e(:, 3) = 0
         local(:, 1) = axes(:, 1)*ridge(:, 1) + axes(:, 2)*ridge(:, 2)
         local(:, 2) = axes(:, 2)*ridge(:, 1) - axes(:, 1)*ridge(:, 2)
         do l = 1, lanes
            if (phase(l) == finished) e(l, :) = 0
         end do
         status = status_ok
         call integrate_membrane(section, level_tangent, e, local, r, status)
         do l = 1, lanes
            if (phase(l) == finished) cycle
            if (status(l) /= status_ok .or. .not. abs(r%energy(l)) + abs(r%n(l, 2)) + abs(r%n(l, 3)) <= huge(1.0_wp)) then
               wrinkle%refused(l) = .true.
               if (phase(l) == last .or. .not. started(l)) then
                  phase(l) = finished
                  cycle
               end if
               fraction(l) = 0.3_wp*fraction(l)
               call advance(wrinkle, l, fraction(l)*turn(l), fraction(l)*change(l), ridge, amplitude)
               cycle
            end if
            if (phase(l) == iterating .and. started(l)) then
               rise = r%n(l, 2)*change(l) - 2*amplitude(l)*r%n(l, 3)*turn(l)
               if (rise > 0.5_wp*fall(l) .and. fraction(l) > shortest) then
                  h = -2*amplitude(l)*turn(l)
                  h = r%a(l, 2)*change(l)**2 + 2*r%a(l, 6)*change(l)*h + r%a(l, 3)*h**2 &
                     + 2*amplitude(l)*(r%n(l, 1) - r%n(l, 2))*turn(l)**2
                  beyond(l, :) = r%a(l, :)
                  h = fraction(l) - rise/max(h, rise/fraction(l))
                  fraction(l) = min(max(h, 1.0e-3_wp*fraction(l)), 0.9_wp*fraction(l))
                  call advance(wrinkle, l, fraction(l)*turn(l), fraction(l)*change(l), ridge, amplitude)
                  cycle
               end if
            end if
            started(l) = .true.
            wrinkle%ridge(l, :) = ridge(l, :)
            wrinkle%amplitude(l) = amplitude(l)
            wrinkle%strain(l, :) = e(l, :)
            wrinkle%force%energy(l) = r%energy(l)
            wrinkle%force%n(l, :) = r%n(l, :)
            wrinkle%force%a(l, :) = r%a(l, :)
            d = r%a(l, :)
            ! where fibres begin to bear just ahead, the next step goes along them
            bounded = phase(l) == iterating .and. maxval(abs(beyond(l, 1:3))) > 10*maxval(abs(d(1:3)))
            if (bounded) d = beyond(l, :)
            beyond(l, :) = 0
            across = d(2)
            ! a saddle: some stiffness that leads downhill
            if (.not. across > 0) across = 1.0e-3_wp*max(abs(d(1)), abs(d(2)), abs(d(3)), tiny(1.0_wp))
            shear = d(6)/across
            h = 2*amplitude(l)*(d(3) - shear*d(6)) + (r%n(l, 1) - r%n(l, 2))
            turn(l) = 0
            ! where h is not positive the direction is that of steepest descent
            if (turning .and. abs(h) > 0) turn(l) = (r%n(l, 3) - shear*r%n(l, 2))/abs(h)
            if (abs(turn(l)) > largest_turn) then
               bounded = .true.
               turn(l) = sign(largest_turn, turn(l))
            end if
            change(l) = (2*amplitude(l)*d(6)*turn(l) - r%n(l, 2))/across
            if (change(l) < -0.9_wp*amplitude(l)) then
               bounded = .true.
               change(l) = -0.9_wp*amplitude(l)
            end if
            if (change(l) > 2*(amplitude(l) + whole(l))) then
               bounded = .true.
               change(l) = 2*(amplitude(l) + whole(l))
            end if
            size_of_strain = abs(e(l, 1)) + abs(e(l, 2)) + abs(e(l, 3)) + epsilon(1.0_wp)*whole(l)
            size_of_step = abs(change(l)) + 2*amplitude(l)*abs(turn(l))
            noise = rounding*max(section%natural_stiffness, maxval(abs(d(1:3))))*whole(l)
            ! a step that is not Newton's says nothing
            converged = .not. bounded .and. size_of_step <= last_step*size_of_strain + rounding*whole(l)
            wrinkle%found(l) = converged .and. sound(r%n(l, :), r%a(l, :), h, noise)
            ! the last step may have come upon fibres, and then it is not the last
            tolerance = rounding*size_of_strain
            if (phase(l) == last) tolerance = rounding*(16*size_of_strain + 8*whole(l))
            ! no stress is better than the rounding of the strain makes it
            if (iteration > patience .and. abs(r%n(l, 2)) + merge(abs(r%n(l, 3)), 0.0_wp, turning) &
                <= noise) then
               wrinkle%found(l) = sound(r%n(l, :), r%a(l, :), h, noise)
               phase(l) = finished
               cycle
            end if
            if (.not. bounded .and. size_of_step <= tolerance) then
               wrinkle%found(l) = sound(r%n(l, :), r%a(l, :), h, noise)
               phase(l) = finished
               cycle
            end if
            ! nothing to iron in this direction
            if (.not. turning .and. amplitude(l) < epsilon(1.0_wp)*whole(l)) then
               phase(l) = finished
               cycle
            end if
            phase(l) = merge(last, iterating, converged)
            fraction(l) = 1
            fall(l) = 2*amplitude(l)*r%n(l, 3)*turn(l) - r%n(l, 2)*change(l)
            call advance(wrinkle, l, turn(l), change(l), ridge, amplitude)
         end do
      end do
   end subroutine search

   !> From the best point of element l on by a step.
   pure subroutine advance(wrinkle, l, turn, change, ridge, amplitude)
      type(wrinkle_t), intent(in) :: wrinkle
      integer, intent(in) :: l
      real(wp), intent(in) :: turn, change
      real(wp), intent(inout) :: ridge(lanes, 2), amplitude(lanes)
      real(wp) :: c, s, length
      c = wrinkle%ridge(l, 1)*cos(turn) - wrinkle%ridge(l, 2)*sin(turn)
      s = wrinkle%ridge(l, 2)*cos(turn) + wrinkle%ridge(l, 1)*sin(turn)
      length = sqrt(c*c + s*s)
      ridge(l, :) = [c, s]/length
      amplitude(l) = wrinkle%amplitude(l) + change
   end subroutine advance

   !> Whether it is a minimum, with tension along the ridges: then no other ironing has less energy.
   pure function sound(n, a, h, noise)
      real(wp), intent(in) :: n(3), a(6), h
      real(wp), intent(in) :: noise !< stress that is none
      logical :: sound
      sound = n(1) >= -noise .and. a(2) > 0 .and. h >= -noise
   end function sound

   !> Amplitude that gives an incompressible isotropic sheet its natural width, and others one to start from.
   pure subroutine natural_amplitude(strain, ridge, amplitude)
      real(wp), intent(in) :: strain(lanes, 3), ridge(lanes, 2)
      real(wp), intent(out) :: amplitude(lanes)
      real(wp) :: e(lanes, 3), along, stretch, across
      integer :: l
      call rotate_strain(lanes, ridge, strain, e)
      do l = 1, lanes
         along = max(e(l, 1), -0.45_wp)
         stretch = sqrt(1 + 2*along)
         across = -along/(stretch*(1 + stretch)) ! ((1 + 2 along)^(-1/2) - 1)/2
         across = max(across, 0.5_wp*(1.1_wp*e(l, 3)**2/(1 + 2*along) - 1))
         amplitude(l) = max(across - e(l, 2), 1.0e-3_wp*abs(e(l, 2)) + tiny(1.0_wp))
      end do
   end subroutine natural_amplitude

   !> -S_nn/D_nn.
   pure function newton_amplitude(s, d, ridge) result(amplitude)
      real(wp), intent(in) :: s(3), d(6), ridge(2)
      real(wp) :: amplitude
      real(wp) :: n(3), dnn
      n = [ridge(2)**2, ridge(1)**2, -2*ridge(1)*ridge(2)]
      dnn = d(1)*n(1)**2 + d(2)*n(2)**2 + d(3)*n(3)**2 + 2*(d(4)*n(1)*n(2) + d(5)*n(1)*n(3) + d(6)*n(2)*n(3))
      amplitude = 0
      if (dnn > 0) amplitude = -dot_product(s, n)/dnn
   end function newton_amplitude

   !> Direction of the larger principal value of symmetric 2x2 tensors.
   pure subroutine principal_axes(tensor, half, direction)
      real(wp), intent(in) :: tensor(lanes, 3)
      real(wp), intent(in) :: half !< of the third component: 1/2 for strains, 1 for stresses
      real(wp), intent(out) :: direction(lanes, 2) !< cosine, sine
      real(wp) :: a, b, c, s, radius
      integer :: l
      do l = 1, lanes
         a = 0.5_wp*(tensor(l, 1) - tensor(l, 2))
         b = half*tensor(l, 3)
         radius = hypot(a, b)
         direction(l, :) = [1.0_wp, 0.0_wp]
         if (.not. radius > 0) cycle
         if (a >= 0) then
            c = sqrt(0.5_wp*(1 + a/radius))
            s = 0.5_wp*(b/radius)/c
         else
            s = sqrt(0.5_wp*(1 - a/radius))
            c = 0.5_wp*(b/radius)/s
         end if
         direction(l, :) = [c, s]
      end do
   end subroutine principal_axes
end module finshell_wrinkle
