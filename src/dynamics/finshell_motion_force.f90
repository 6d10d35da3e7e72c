!> Forces alone, for those who solve no equations.
module finshell_motion_force
   use finshell_assembly, only: assemble
   use finshell_element_limit, only: element_trouble
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise
   use finshell_kinds, only: wp
   use finshell_section, only: section_t
   use finshell_status, only: status_ok
   implicit none
   private
   public :: evaluate_forces, stored_energy

contains

   !> Forces of elements, with what stands beside them (springs, foundations), and of loads, at the state of a
   !> problem, and the energy in its elements.
   subroutine evaluate_forces(problem, error, sections, velocity)
      class(equilibrium_t), intent(inout) :: problem !< internal_force, external_force and entry%energy are set
      type(error_t), allocatable, intent(out) :: error
      type(section_t), intent(in), optional :: sections(:) !< instead of its own
      real(wp), intent(in), optional :: velocity(:, :) !< (n_nodal, nodes) for dashpots; absent: at rest
      real(wp), allocatable :: standing(:, :), remembered(:, :)
      integer :: status, element
      problem%force_evaluations = problem%force_evaluations + 1
      if (allocated(problem%state%past)) call move_alloc(problem%state%past%end, remembered)
      call assemble(problem%assembly, problem%structure, problem%state, problem%internal_force, status, element, &
                    energy=problem%entry%energy, sections=sections, remembered=remembered)
      if (allocated(problem%state%past)) call move_alloc(remembered, problem%state%past%end)
      if (status /= status_ok) then
         call raise(error, status, element_trouble(problem%structure, element, status, problem%base, problem%state))
         return
      end if
      call problem%external%chambers%follow(problem%structure, problem%equations, problem%state, error)
      if (allocated(error)) return
      problem%external_force = 0
      call problem%external%add_forces(problem%structure, problem%equations, problem%state, problem%assembly, .false., &
                                       problem%external_force)
      if (problem%external%stands()) then
         ! its energy is stored, so its forces do no work from outside
         allocate (standing(size(problem%external_force, 1), size(problem%external_force, 2)), source=0.0_wp)
         call problem%external%add_forces(problem%structure, problem%equations, problem%state, problem%assembly, .true., standing)
         problem%internal_force = problem%internal_force - standing
      end if
      if (present(velocity)) call problem%external%dashpots%add(problem%structure, problem%state, velocity, problem%external_force)
   end subroutine evaluate_forces

   !> In elements and foundations, after `evaluate_forces`.
   real(wp) function stored_energy(problem)
      class(equilibrium_t), intent(in) :: problem
      stored_energy = problem%entry%energy + problem%external%standing_energy(problem%structure, problem%equations, problem%state)
   end function stored_energy
end module finshell_motion_force
