!> What the trapezoidal rule needs to conserve momenta and energy: a projection of the velocities after each increment.
!>
!> The rule goes along chords, d = h (v_n + v_{n+1})/2, with the mean of the forces at both ends. That keeps the momentum. It
!> changes the angular momentum by the moment of the mean of the internal forces about the middle of the chords, which is not zero,
!> and the kinetic energy by d times the mean, which is not what the stored energy loses. Both errors are of the third order in h,
!> and they grow in long motions of stiff bodies. Velocities change by
!>
!>     z alpha,  z: rigid motions that the supports leave free; alpha such that their momenta have changed by the impulse of loads
!>               and damping alone, taken at the middle of the chords;
!>     v' mu,    v': velocities less their rigid part, so that it leaves the momenta alone; mu such that the sum of kinetic and
!>               stored energy has changed by the work of loads and supports, less what damping took, since the step began.
!>
!> (Projection onto invariants: Hairer, Lubich and Wanner 2006, IV.4; constraints of energy and momenta: Hughes, Caughey and Liu
!> 1978, Kuhl and Ramm 1996.) Where v' is too small to give or take what is wanted, at turning points, the rest is left to the
!> increments that follow.
module finshell_conservation
   use finshell_equations, only: equations_t, free_part
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_kinds, only: wp
   use finshell_mechanism, only: null_space
   use finshell_rotation, only: cross_product
   implicit none
   private
   public :: keep_momenta, keep_energy, rigid_t, new_rigid

   !> Rigid motions that the supports leave free, about a point.
   type :: rigid_t
      integer :: count = 0
      real(wp) :: modes(n_nodal, n_nodal) = 0 !< translation, length times rotation; the first `count` columns
      real(wp) :: centre(3) = 0, length = 1
   end type rigid_t

   real(wp), parameter :: largest_scale = 2 !< of v', in an increment

contains

   !> Rigid motions about the centre of mass that no held component resists.
   pure subroutine new_rigid(self, equations, mass, turns, x)
      type(rigid_t), intent(out) :: self
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: mass(:, :) !< (n_nodal, nodes)
      logical, intent(in) :: turns(:) !< (nodes) whether a node has rotations
      real(wp), intent(in) :: x(:, :) !< (3, nodes) coordinates
      integer :: i
      self%centre = matmul(x, mass(ux, :))/sum(mass(ux, :))
      self%length = 0
      do i = 1, size(x, 2)
         self%length = max(self%length, norm2(x(:, i) - self%centre))
      end do
      call free_motions(equations, turns, (x - spread(self%centre, 2, size(x, 2)))/self%length, self%modes, self%count)
   end subroutine new_rigid

   !> Velocities with the momenta of rigid motions that an impulse demands.
   subroutine keep_momenta(rigid, equations, mass, x, before, impulse, velocity)
      type(rigid_t), intent(in) :: rigid
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: mass(:, :) !< (n_nodal, nodes)
      real(wp), intent(in) :: x(:, :, :) !< (3, nodes, 3) coordinates at the beginning, in the middle, and at the end
      real(wp), intent(in) :: before(:, :) !< (n_nodal, nodes) velocities at the beginning
      real(wp), intent(in) :: impulse(:, :) !< (n_nodal, nodes) of loads and damping
      real(wp), intent(inout) :: velocity(:, :) !< (n_nodal, nodes) at the end
      real(wp) :: wanted(rigid%count)
      integer :: j
      if (rigid%count == 0) return
      do j = 1, rigid%count
         wanted(j) = sum(motion_of(rigid, rigid%modes(:, j), x(:, :, 1))*mass*free_part(equations, before)) &
                     + sum(motion_of(rigid, rigid%modes(:, j), x(:, :, 2))*free_part(equations, impulse)) &
                     - sum(motion_of(rigid, rigid%modes(:, j), x(:, :, 3))*mass*free_part(equations, velocity))
      end do
      velocity = velocity + free_part(equations, rigid_velocity(rigid, mass, x(:, :, 3), wanted))
   end subroutine keep_momenta

   !> Velocities with a change of the kinetic energy, as far as the part of them that is not rigid allows.
   subroutine keep_energy(rigid, equations, mass, x, change, velocity)
      type(rigid_t), intent(in) :: rigid
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: mass(:, :) !< (n_nodal, nodes)
      real(wp), intent(in) :: x(:, :) !< (3, nodes) coordinates
      real(wp), intent(in) :: change
      real(wp), intent(inout) :: velocity(:, :) !< (n_nodal, nodes)
      real(wp), allocatable :: own(:, :)
      real(wp) :: energy, scale, momenta(rigid%count)
      integer :: j
      own = free_part(equations, velocity)
      if (rigid%count > 0) then
         do j = 1, rigid%count
            momenta(j) = sum(motion_of(rigid, rigid%modes(:, j), x)*mass*own)
         end do
         own = own - rigid_velocity(rigid, mass, x, momenta)
      end if
      energy = 0.5_wp*sum(own*mass*own)
      if (.not. energy > 0) return
      scale = largest_scale
      if (change < largest_scale**2*energy) scale = min(largest_scale, sqrt(max(0.0_wp, 1 + change/energy)))
      velocity = velocity + (scale - 1)*own
   end subroutine keep_energy

   !> The rigid motion that has given momenta.
   pure function rigid_velocity(rigid, mass, x, momenta) result(velocity)
      type(rigid_t), intent(in) :: rigid
      real(wp), intent(in) :: mass(:, :), x(:, :), momenta(:)
      real(wp) :: velocity(n_nodal, size(x, 2))
      real(wp) :: matrix(rigid%count, rigid%count)
      integer :: i, j
      do j = 1, rigid%count
         velocity = mass*motion_of(rigid, rigid%modes(:, j), x)
         do i = 1, j
            matrix(i, j) = sum(velocity*motion_of(rigid, rigid%modes(:, i), x))
            matrix(j, i) = matrix(i, j)
         end do
      end do
      velocity = motion_of(rigid, matmul(rigid%modes(:, :rigid%count), solved(matrix, momenta)), x)
   end function rigid_velocity

   !> Orthonormal rigid motions (translation, length times rotation) that no held component resists.
   pure subroutine free_motions(equations, turns, arm, modes, count)
      type(equations_t), intent(in) :: equations
      logical, intent(in) :: turns(:)
      real(wp), intent(in) :: arm(:, :)
      real(wp), intent(out) :: modes(n_nodal, n_nodal)
      integer, intent(out) :: count
      real(wp) :: conditions(n_nodal, n_nodal), row(n_nodal)
      integer :: i, k, node
      conditions = 0
      do i = 1, size(equations%supported)
         node = equations%supported(i)%node
         do k = 1, equations%supported(i)%displacements
            row(ux:uz) = equations%supported(i)%displacement_axes(:, k)
            row(rx:rz) = cross_product(arm(:, node), row(ux:uz))
            call add_row(row, conditions)
         end do
         if (.not. turns(node)) cycle
         do k = 1, equations%supported(i)%rotations
            row(ux:uz) = 0
            row(rx:rz) = equations%supported(i)%rotation_axes(:, k)
            call add_row(row, conditions)
         end do
      end do
      call null_space(conditions, modes, count)
   end subroutine free_motions

   pure subroutine add_row(row, conditions)
      real(wp), intent(in) :: row(n_nodal)
      real(wp), intent(inout) :: conditions(n_nodal, n_nodal)
      integer :: c
      do c = 1, n_nodal
         conditions(:, c) = conditions(:, c) + row*row(c)
      end do
   end subroutine add_row

   !> The nodal motion of a rigid one.
   pure function motion_of(rigid, mode, x) result(motion)
      type(rigid_t), intent(in) :: rigid
      real(wp), intent(in) :: mode(n_nodal), x(:, :)
      real(wp) :: motion(n_nodal, size(x, 2))
      integer :: i
      do i = 1, size(x, 2)
         motion(ux:uz, i) = mode(ux:uz) + cross_product(mode(rx:rz), x(:, i) - rigid%centre)/rigid%length
         motion(rx:rz, i) = mode(rx:rz)/rigid%length
      end do
   end function motion_of

   !> Solution of a small symmetric positive definite system, by Cholesky's factor; zero along what has no mass.
   pure function solved(matrix, load) result(x)
      real(wp), intent(in) :: matrix(:, :), load(:)
      real(wp) :: x(size(load))
      real(wp) :: l(size(load), size(load)), pivot
      integer :: i, n
      n = size(load)
      l = matrix
      x = load
      do i = 1, n
         pivot = l(i, i) - sum(l(i, :i - 1)**2)
         if (pivot > epsilon(1.0_wp)*matrix(i, i)) then
            l(i, i) = sqrt(pivot)
            l(i + 1:, i) = (l(i + 1:, i) - matmul(l(i + 1:, :i - 1), l(i, :i - 1)))/l(i, i)
            x(i) = (x(i) - sum(l(i, :i - 1)*x(:i - 1)))/l(i, i)
         else
            l(i:, i) = 0
            l(i, i) = 1
            x(i) = 0
         end if
      end do
      do i = n, 1, -1
         x(i) = (x(i) - sum(l(i + 1:, i)*x(i + 1:)))/l(i, i)
      end do
   end function solved
end module finshell_conservation
