!> The largest stable increment of central differences: 2/omega, with the highest frequency of the structure at its present state.
!>
!> Lanczos' iteration on M^-1/2 K M^-1/2. Products with K are differences of the forces along a small motion, so loads and springs
!> are in it, nothing is stored, and an iteration costs what an increment costs. From a vector without pattern the largest
!> eigenvalue comes out within a per cent after some twenty; a bound from single elements (Irons & Treharne 1971) would ask for
!> increments of little more than half the length here, because drilling rotations of neighbours hold each other.
module finshell_stable_step
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_kinds, only: wp
   use finshell_leapfrog, only: leapfrog_t
   use finshell_motion_force, only: evaluate_forces
   use finshell_section, only: section_t
   use finshell_state, only: moved_state, small_part, state_t
   implicit none
   private
   public :: stable_increment, highest_eigenvalue

   integer, parameter :: fewest = 10, most = 60 !< iterations
   integer, parameter :: apart = 4 !< iterations over which the eigenvalue is compared
   real(wp), parameter :: tolerance = 1.0e-2_wp !< change of it over these

contains

   !> At the present state, forces at which are known and are kept.
   subroutine stable_increment(problem, leapfrog, increment, error)
      class(equilibrium_t), intent(inout) :: problem
      type(leapfrog_t), intent(in) :: leapfrog !< has the masses
      real(wp), intent(out) :: increment !< huge: no stiffness
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: damping, highest
      call highest_eigenvalue(problem, leapfrog, highest, error)
      increment = huge(increment)
      if (allocated(error)) return
      ! with dashpots, whose velocities are half an increment old: z^2 - (2 - h c - h^2 k) z + 1 - h c has no root below -1
      damping = problem%external%dashpots%fastest(problem%structure, leapfrog%mass)
      if (highest > 0 .or. damping > 0) increment = 4/(damping + sqrt(damping**2 + 4*highest))
   end subroutine stable_increment

   !> The square of the highest frequency. Sheets that wrinkle and cables are taken as taut: they may become so in the next
   !> increment.
   subroutine highest_eigenvalue(problem, leapfrog, highest, error)
      class(equilibrium_t), intent(inout) :: problem
      type(leapfrog_t), intent(in) :: leapfrog
      real(wp), intent(out) :: highest
      type(error_t), allocatable, intent(out) :: error
      type(section_t), allocatable :: taut(:)
      type(state_t) :: state
      real(wp), allocatable :: internal(:, :), external(:, :), force(:, :), last(:, :), x(:, :), y(:, :), motion(:, :)
      real(wp) :: alpha(most), beta(0:most), found(most), energy, part
      integer :: i

      highest = 0
      taut = problem%structure%sections
      taut%wrinkling = .false.
      state = problem%state
      internal = problem%internal_force
      external = problem%external_force
      energy = problem%entry%energy
      call problem%external%tauten(.true.)
      call evaluate_forces(problem, error, taut)
      if (.not. allocated(error)) then
         force = problem%external_force - problem%internal_force
         allocate (x, mold=force)
         call fill(x)
         x = leapfrog%without_held(x)
         beta = 0
         beta(0) = norm2(x)
         last = 0*x
         do i = 1, most
            if (.not. beta(i - 1) > 0) exit
            x = x/beta(i - 1)
            motion = leapfrog%over_root_mass(x)
            part = small_part(motion, problem%detail)
            problem%state = moved_state(state, motion, part)
            call evaluate_forces(problem, error, taut)
            if (allocated(error)) exit
            y = leapfrog%over_root_mass(force - problem%external_force + problem%internal_force)/part
            alpha(i) = sum(x*y)
            y = y - alpha(i)*x - beta(i - 1)*last
            beta(i) = norm2(y)
            last = x
            x = y
            found(i) = largest_of_tridiagonal(alpha(:i), beta(1:i - 1))
            highest = max(highest, found(i))
            if (i < fewest) cycle
            if (found(i) - found(i - apart) <= tolerance*found(i)) exit
         end do
      end if
      call problem%external%tauten(.false.)
      problem%state = state
      problem%internal_force = internal
      problem%external_force = external
      problem%entry%energy = energy
   end subroutine highest_eigenvalue

   !> Numbers without pattern, the same ones every time.
   pure subroutine fill(x)
      real(wp), intent(out) :: x(:, :)
      integer :: i, j, seed
      seed = 4711
      do j = 1, size(x, 2)
         do i = 1, size(x, 1)
            seed = mod(1103*seed + 12721, 65536)
            x(i, j) = real(seed, wp)/32768 - 1
         end do
      end do
   end subroutine fill

   !> Largest eigenvalue of a symmetric tridiagonal matrix, by bisection: above it all pivots of matrix - x are negative.
   pure real(wp) function largest_of_tridiagonal(diagonal, beside) result(x)
      real(wp), intent(in) :: diagonal(:), beside(:)
      real(wp) :: low, high, pivot
      integer :: i, k
      logical :: above
      low = maxval(diagonal)
      high = low + 2*maxval([0.0_wp, abs(beside)])
      do k = 1, 60
         x = 0.5_wp*(low + high)
         pivot = diagonal(1) - x
         above = pivot < 0
         do i = 2, size(diagonal)
            if (.not. above) exit
            pivot = diagonal(i) - x - beside(i - 1)**2/pivot
            above = pivot < 0
         end do
         if (above) then
            high = x
         else
            low = x
         end if
      end do
   end function largest_of_tridiagonal
end module finshell_stable_step
