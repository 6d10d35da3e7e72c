!> What path following is told of a structure.
module finshell_description
   use finshell_connectors, only: is_limp
   use finshell_equations, only: equations_t
   use finshell_ground, only: is_soft
   use finshell_mesh, only: mean_side, mesh_size
   use finshell_problem, only: problem_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: describe

contains

   !> Its unknowns, size and slenderness, and what is peculiar about its stiffness; nothing is monitored yet.
   subroutine describe(problem, structure, equations)
      class(problem_t), intent(inout) :: problem
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      problem%n = equations%n
      problem%field = equations%field
      problem%soft = is_soft(structure%sections) .or. is_limp(structure, equations)
      problem%limp = any(structure%sections%membrane) .or. is_limp(structure, equations)
      problem%crumples = any(structure%sections%membrane .and. .not. structure%sections%wrinkling)
      problem%size = mesh_size(structure%mesh)
      problem%slenderness = minval(structure%sections%thickness)/problem%size
      if (allocated(structure%thickness)) problem%slenderness = minval(structure%thickness)/problem%size
      problem%detail = mean_side(structure%mesh)
      if (allocated(problem%watched)) deallocate (problem%watched)
   end subroutine describe
end module finshell_description
