!> What implicit and explicit steps in time begin with.
module finshell_motion_start
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_freedoms, only: n_nodal
   use finshell_kinds, only: wp
   use finshell_mass_assembly, only: mass_kind_t, masses_times
   use finshell_step, only: mass_lumped
   implicit none
   private
   public :: begin_motion, lumped_masses

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

   !> Masses and rotatory inertias at the nodes. Errors: a section without density.
   subroutine lumped_masses(problem, mass, error)
      class(equilibrium_t), intent(in) :: problem
      real(wp), allocatable, intent(out) :: mass(:, :) !< (n_nodal, nodes)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: ones(:, :)
      allocate (ones(n_nodal, size(problem%state%displacement, 2)), source=1.0_wp)
      call masses_times(problem%assembly, problem%structure, problem%state, mass_kind_t(mass_lumped, .true.), ones, mass, error)
   end subroutine lumped_masses
end module finshell_motion_start
