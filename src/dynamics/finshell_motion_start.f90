!> What implicit and explicit steps in time begin with.
module finshell_motion_start
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_freedoms, only: n_nodal, uz
   use finshell_kinds, only: wp
   use finshell_linked_start, only: node_without_mass
   use finshell_mass_assembly, only: mass_kind_t, masses_times
   use finshell_point_masses, only: point_masses
   use finshell_status, only: status_input_error
   use finshell_step, only: mass_lumped
   implicit none
   private
   public :: begin_motion, check_mobile, lumped_masses

contains

   !> A state at rest gets rates of zero; constant loads and supports act from now on.
   subroutine begin_motion(problem)
      class(equilibrium_t), intent(inout) :: problem
      integer :: nodes
      associate (state => problem%state)
         nodes = size(state%displacement, 2)
         if (.not. allocated(state%velocity)) allocate (state%velocity(n_nodal, nodes), source=0.0_wp)
         if (.not. allocated(state%acceleration)) allocate (state%acceleration(n_nodal, nodes), source=0.0_wp)
         state%constant_factor = 1
      end associate
      call problem%accept()
   end subroutine begin_motion

   !> Refuse what can move and has no mass.
   subroutine check_mobile(problem, what, mass, components, error)
      class(equilibrium_t), intent(in) :: problem
      character(len=*), intent(in) :: what !< kind of the step, for the message
      real(wp), intent(in) :: mass(:, :) !< (n_nodal, nodes)
      integer, intent(in) :: components !< those that need mass: displacements, or all
      type(error_t), allocatable, intent(inout) :: error
      integer :: node
      node = node_without_mass(problem%equations, mass, uz)
      if (node > 0) then
         call raise(error, status_input_error, what//': node '//text_of(node)//' can move but has no mass: it belongs to no ' &
            //'element; give it some by &point_mass, or mass to its bars')
         return
      end if
      node = node_without_mass(problem%equations, mass, components)
      if (node > 0) call raise(error, status_input_error, what//': node '//text_of(node)//' can turn but has no rotatory ' &
         //'inertia: it belongs to no element; give it some by &point_mass')
   end subroutine check_mobile

   !> Masses and rotatory inertias at the nodes. Errors: a section without density.
   subroutine lumped_masses(problem, mass, error)
      class(equilibrium_t), intent(in) :: problem
      real(wp), allocatable, intent(out) :: mass(:, :) !< (n_nodal, nodes)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: ones(:, :)
      allocate (ones(n_nodal, size(problem%state%displacement, 2)), source=1.0_wp)
      call masses_times(problem%assembly, problem%structure, problem%state, mass_kind_t(mass_lumped, .true.), ones, mass, error)
      if (.not. allocated(error)) mass = mass + point_masses(problem%structure)
   end subroutine lumped_masses
end module finshell_motion_start
