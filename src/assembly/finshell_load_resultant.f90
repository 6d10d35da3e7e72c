!> What one load of a structure comes to.
module finshell_load_resultant
   use finshell_assembly, only: assembly_t
   use finshell_equations, only: equations_t
   use finshell_error, only: error_t
   use finshell_external, only: external_t, new_external
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_kinds, only: wp
   use finshell_rotation, only: cross_product
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: resultant_of

contains

   !> Force, and moment about the origin, of a load in a state, for a factor of 1; zero for a load that is refused.
   function resultant_of(number, structure, equations, state, assembly) result(resultant)
      integer, intent(in) :: number !< of the load
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      type(assembly_t), intent(in) :: assembly
      real(wp) :: resultant(n_nodal)
      type(structure_t) :: alone
      type(external_t) :: external
      type(error_t), allocatable :: error
      real(wp), allocatable :: bulges(:, :, :), force(:, :, :)
      integer :: factor, i
      resultant = 0
      alone = structure
      alone%loads = structure%loads(number:number)
      call new_external(external, alone, equations, error)
      if (allocated(error)) return
      call external%evaluate(alone, equations, state, assembly, force, bulges)
      force = force + bulges
      do factor = 1, size(force, 3)
         do i = 1, size(force, 2)
            resultant = resultant + force(:, i, factor)
            resultant(rx:rz) = resultant(rx:rz) &
               + cross_product(structure%mesh%coordinates(:, i) + state%displacement(:, i), force(ux:uz, i, factor))
         end do
      end do
   end function resultant_of
end module finshell_load_resultant
