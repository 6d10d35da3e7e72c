!> What the trapezoidal rule needs to conserve momenta and energy.
!>
!> With internal forces that are the mean of those at both ends, an increment along chords, d = h (v_n + v_{n+1})/2, keeps the
!> momentum. It changes the angular momentum by the moment of that mean about the middle of the chords, which is not zero, and
!> the kinetic by d times the mean, which is not what the stored energy loses. Both errors are of the third order in h. Two small
!> forces balance them (constraints of energy and momentum: Hughes, Caughey and Liu 1978; Kuhl and Ramm 1996):
!>
!>     M z alpha,  z: rigid motions that the supports leave free, about the middle; alpha such that the mean and this have no
!>                 resultant along z;
!>     M v' mu,    v': the mean velocity less its rigid part, so that it does not touch the momenta; mu such that the sum of
!>                 kinetic and stored energy changes by the work of the loads.
module finshell_inertia_rigid
   use finshell_equations, only: equations_t, gather, scatter
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_kinds, only: wp
   use finshell_mechanism, only: null_space
   use finshell_rotation, only: cross_product
   use finshell_state, only: state_t
   implicit none
   private
   public :: keep_momenta, free_part

   !> Of mu h: above it the mean velocity is a rigid motion but for rounding, and nothing is there to take energy from.
   real(wp), parameter :: largest_share = 0.1_wp

contains

   !> Accelerations by the two forces. Those of held components are of no use.
   subroutine keep_momenta(coordinates, equations, mass, turns, base, state, increment, motion, internal, force, gain, &
                           correction)
      real(wp), intent(in) :: coordinates(:, :) !< (3, nodes)
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: mass(:, :) !< (n_nodal, nodes)
      logical, intent(in) :: turns(:) !< (nodes) whether a node has rotations
      type(state_t), intent(in) :: base, state
      real(wp), intent(in) :: increment !< h
      real(wp), intent(in) :: motion(:, :) !< (n_nodal, nodes) d
      real(wp), intent(in) :: internal(:, :), force(:, :) !< (n_nodal, nodes) means of internal and of out-of-balance forces
      real(wp), intent(in) :: gain !< work of the loads less what has been stored
      real(wp), intent(out), allocatable :: correction(:, :) !< (n_nodal, nodes)
      real(wp), allocatable :: arm(:, :), velocity(:, :), z(:, :)
      real(wp) :: centre(3), length, modes(n_nodal, n_nodal), matrix(n_nodal, n_nodal), load(n_nodal), share, power
      integer :: count, i, j

      arm = coordinates + 0.5_wp*(base%displacement + state%displacement)
      centre = matmul(arm, mass(ux, :))/sum(mass(ux, :))
      do i = 1, size(arm, 2)
         arm(:, i) = arm(:, i) - centre
      end do
      length = sqrt(max(sum(mass(ux:uz, :)*arm**2)/sum(mass(ux, :)), tiny(1.0_wp)))
      arm = arm/length
      call free_motions(equations, turns, arm, modes, count)

      velocity = free_part(equations, motion/increment)
      allocate (correction(n_nodal, size(mass, 2)), source=0.0_wp)
      if (count > 0) then
         do j = 1, count
            z = rigid(arm, length, modes(:, j))
            load(j) = sum(z*internal)
            do i = 1, j
               matrix(i, j) = sum(z*mass*rigid(arm, length, modes(:, i)))
               matrix(j, i) = matrix(i, j)
            end do
         end do
         correction = rigid(arm, length, matmul(modes(:, :count), solved(matrix(:count, :count), load(:count))))
         do j = 1, count
            load(j) = sum(rigid(arm, length, modes(:, j))*mass*velocity)
         end do
         velocity = velocity - rigid(arm, length, matmul(modes(:, :count), solved(matrix(:count, :count), load(:count))))
      end if
      power = sum(velocity*mass*velocity)
      share = gain - sum(motion*force) - sum(motion*mass*correction)
      if (abs(share) <= largest_share*power) correction = correction + share/(power*increment)*velocity
   end subroutine keep_momenta

   !> A nodal vector without its held components. Free rigid motions have none there.
   pure function free_part(equations, nodal) result(free)
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: nodal(:, :) !< (n_nodal, nodes)
      real(wp) :: free(size(nodal, 1), size(nodal, 2))
      real(wp) :: x(equations%n)
      call gather(equations, nodal, x)
      call scatter(equations, x, free)
   end function free_part

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
   pure function rigid(arm, length, mode) result(motion)
      real(wp), intent(in) :: arm(:, :), length, mode(n_nodal)
      real(wp) :: motion(n_nodal, size(arm, 2))
      integer :: i
      do i = 1, size(arm, 2)
         motion(ux:uz, i) = mode(ux:uz) + cross_product(mode(rx:rz), arm(:, i))
         motion(rx:rz, i) = mode(rx:rz)/length
      end do
   end function rigid

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
end module finshell_inertia_rigid
