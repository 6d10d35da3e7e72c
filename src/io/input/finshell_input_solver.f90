!> What the group &job says about the solver of the linear systems.
module finshell_input_solver
   use finshell_error, only: error_t
   use finshell_kinds, only: wp
   use finshell_namelist, only: get, group_t
   implicit none
   private
   public :: solver_choice_t, read_solver

   type :: solver_choice_t
      character(len=:), allocatable :: solver !< 'auto', 'suitesparse', 'mumps' or 'iterative'
      real(wp) :: low_rank = 0 !< relative accuracy of compressed factors; 0: exact
      logical :: out_of_core = .false. !< factors on disk
      integer :: line = 0 !< where the group stands; 0: nowhere
   end type solver_choice_t

contains

   !> The keys of the solver.
   subroutine read_solver(group, choice, error)
      type(group_t), intent(inout) :: group
      type(solver_choice_t), intent(out) :: choice
      type(error_t), allocatable, intent(inout) :: error
      choice%line = group%line
      call get(group, 'solver', choice%solver, error, default='auto', choices='auto, iterative, mumps, suitesparse')
      call get(group, 'low_rank', choice%low_rank, error, default=0.0_wp, minimum=0.0_wp, maximum=1.0e-3_wp)
      call get(group, 'out_of_core', choice%out_of_core, error, default=.false.)
   end subroutine read_solver
end module finshell_input_solver
