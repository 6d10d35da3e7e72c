!> Springs to the ground that act through elements, for the check of rigid motions.
module finshell_ground_springs
   use finshell_acting_load, only: displacements_only, load_item_t
   use finshell_equations, only: equations_t
   use finshell_factor, only: factor_at, unscaled
   use finshell_kinds, only: wp
   use finshell_state, only: new_state, state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: springs_t, ground_springs

   !> Elements and minus the derivative of the forces that springs exert on their nodes, (n_membrane, n_membrane, elements).
   type :: springs_t
      integer, allocatable :: elements(:)
      real(wp), allocatable :: stiffness(:, :, :)
   end type springs_t

contains

   !> Stiffness in the reference state of what no factor scales: it holds the structure as supports do.
   function ground_springs(list, structure, equations) result(springs)
      type(load_item_t), intent(in) :: list(:)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(springs_t) :: springs
      type(state_t) :: reference
      real(wp), allocatable :: force(:, :), k(:, :, :)
      integer :: i
      allocate (springs%elements(0))
      allocate (springs%stiffness(displacements_only, displacements_only, 0))
      call new_state(reference, size(structure%mesh%coordinates, 2))
      do i = 1, size(list)
         associate (load => list(i)%load)
            if (load%scaling /= unscaled .or. load%rows /= displacements_only .or. size(load%elements) == 0) cycle
            allocate (force(load%rows, size(load%elements)), k(load%rows, load%rows, size(load%elements)))
            call load%evaluate(structure, equations, reference, force, factor_at(reference, load%scaling), k)
            springs%elements = [springs%elements, load%elements]
            springs%stiffness = reshape([springs%stiffness, -k], [load%rows, load%rows, size(springs%elements)])
            deallocate (force, k)
         end associate
      end do
   end function ground_springs
end module finshell_ground_springs
