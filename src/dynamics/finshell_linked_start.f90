!> Where a step in time begins with nodes that depend on others: their velocities are those of what they depend on, and so are their
!> accelerations, with what the turning of arms adds to them (w x (w x a)).
module finshell_linked_start
   use finshell_component, only: expand_component, most_unknowns
   use finshell_equations, only: equations_t, gather, scatter
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_freedoms, only: n_nodal
   use finshell_inertia, only: stiffen
   use finshell_kinds, only: wp
   use finshell_status, only: status_singular_matrix
   implicit none
   private
   public :: node_without_mass, linked_velocities, linked_accelerations

contains

   !> A node some of whose first components can move and have no mass, of their own or on them; 0: there is none.
   pure integer function node_without_mass(equations, mass, components) result(node)
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: mass(:, :) !< (n_nodal, nodes)
      integer, intent(in) :: components !< so many: displacements, or all
      logical :: bears(equations%n), without(size(mass, 2))
      real(wp) :: coefficient(most_unknowns)
      integer :: equation(most_unknowns), i, k, n
      bears = .false.
      do i = 1, size(mass, 2)
         do k = 1, n_nodal
            if (.not. mass(k, i) > 0) cycle
            if (equations%links%depends(k, i)) then
               call expand_component(equations, i, k, equation, coefficient, n)
               bears(equation(:n)) = .true.
            else if (equations%number(k, i) > 0) then
               bears(equations%number(k, i)) = .true.
            end if
         end do
      end do
      without = .false.
      do i = 1, size(mass, 2)
         do k = 1, components
            if (equations%number(k, i) > 0) without(i) = without(i) .or. .not. bears(equations%number(k, i))
         end do
      end do
      node = findloc(without, .true., dim=1)
   end function node_without_mass

   !> Velocities that joints allow, with the same momenta in all motions that they allow: (T^T M T) x = T^T M v.
   subroutine linked_velocities(problem, velocity, error)
      class(equilibrium_t), intent(inout) :: problem
      real(wp), intent(inout) :: velocity(:, :) !< (n_nodal, nodes)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: held(:, :)
      held = problem%inertia%held_velocity
      call problem%equations%links%extend(held)
      call solve_masses(problem, problem%inertia%mass*(velocity - held), velocity, error)
      velocity = velocity + held
   end subroutine linked_velocities

   !> Accelerations under given forces: T^T M (T a + c) = T^T f, c what turning arms have when their masters have none.
   subroutine linked_accelerations(problem, force, acceleration, error)
      class(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: force(:, :) !< (n_nodal, nodes)
      real(wp), intent(out) :: acceleration(:, :) !< (n_nodal, nodes)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: turning(:, :)
      turning = problem%equations%links%turning_rates(problem%state, problem%state%velocity)
      call solve_masses(problem, force - problem%inertia%mass*turning, acceleration, error)
      acceleration = acceleration + turning
   end subroutine linked_accelerations

   !> T x with (T^T M T) x = T^T f. What has no inertia stays. Errors: what turns and has no inertia against it.
   subroutine solve_masses(problem, force, motion, error)
      class(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: force(:, :) !< (n_nodal, nodes)
      real(wp), intent(out) :: motion(:, :) !< (n_nodal, nodes)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: values(:), b(:), x(:)
      integer, allocatable :: diagonal(:)
      integer :: i
      real(wp) :: a1
      motion = 0
      allocate (values(size(problem%values)), source=0.0_wp)
      allocate (b(problem%equations%n), x(problem%equations%n))
      diagonal = problem%diagonal_places()
      call gather(problem%equations, force, b)
      associate (inertia => problem%inertia)
         a1 = inertia%a1
         inertia%a1 = 1
         call stiffen(inertia, problem%equations, diagonal, problem%assembly%linked, values)
         inertia%a1 = a1
      end associate
      do i = 1, problem%equations%n
         if (values(diagonal(i)) > 0) cycle
         values(diagonal(i)) = 1
         b(i) = 0
      end do
      call problem%solver%factorise(values, error)
      if (.not. allocated(error)) call problem%solver%solve(b, x, error)
      if (allocated(error)) then
         if (error%code == status_singular_matrix) error%message = 'dynamic: what is joined to a node has no inertia against its ' &
            //'turning about some axis: '//error%message
         return
      end if
      call scatter(problem%equations, x, motion)
   end subroutine solve_masses
end module finshell_linked_start
