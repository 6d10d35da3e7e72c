!> Masses for motions that are not meant: with them no vibration of a structure is faster than steps of length 1 can follow
!> (finshell_relaxation).
!>
!> Central differences are stable where no frequency is above 2. Gershgorin bounds the eigenvalues of M^-1 K by the sums of the
!> magnitudes in its rows, in any scale of the unknowns: a rotation counts as the displacement that it makes over an element.
module finshell_fictitious_mass
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_nodal
   use finshell_equations, only: equations_t, field_displacement
   use finshell_linear_solver, only: linear_solver_t
   implicit none
   private
   public :: fictitious_mass

   integer, parameter :: together = 3 !< components of displacement, or of rotation
   real(wp), parameter :: enough = 0.25_wp !< over the square of the highest frequency

contains

   !> The displacements of a node have one mass, and its rotations one: stiff directions turn.
   function fictitious_mass(equations, detail, solver, values, gradient, compliance) result(mass)
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: detail !< length of an element
      type(linear_solver_t), intent(in) :: solver !< of the pattern
      real(wp), intent(in) :: values(:) !< of K
      real(wp), intent(in), optional :: gradient(:, :), compliance(:) !< of chambers, which add g g^T/compliance to K
      real(wp), allocatable :: mass(:) !< of the equations; 1 of each pressure, which has no motion
      real(wp) :: bound(equations%n), unit(equations%n)
      integer :: c, i, k, first
      unit = merge(1.0_wp, 1/detail, equations%field == field_displacement)
      call solver%magnitude(unit, bound, values)
      if (present(gradient) .and. present(compliance)) then
         do c = 1, size(compliance)
            if (compliance(c) > 0) bound = bound + abs(gradient(:, c))*(sum(abs(gradient(:, c))*unit)/compliance(c))
         end do
      end if
      bound = enough*bound/unit
      mass = bound
      do i = 1, size(equations%number, 2)
         do first = 1, n_nodal, together
            do k = first, first + together - 1
               if (equations%number(k, i) > 0) mass(equations%number(k, i)) = &
                  maxval(bound(pack(equations%number(first:first + together - 1, i), &
                                    equations%number(first:first + together - 1, i) > 0)))
            end do
         end do
      end do
      if (present(compliance)) mass = [mass, spread(1.0_wp, 1, size(compliance))]
   end function fictitious_mass
end module finshell_fictitious_mass
