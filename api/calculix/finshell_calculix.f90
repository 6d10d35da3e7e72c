!> The element in CalculiX: stiffness and nodal forces of one element, as its dispatchers for user elements want them.
!>
!> CalculiX adds up rotational unknowns, so that they are total rotation vectors. It asks for the stiffness and for the forces in
!> different routines, the stiffness at the displacements of the last iteration.
module finshell_calculix
   use finshell_batch, only: evaluate_elements, recover_elements, rotation_vector
   use finshell_calculix_section, only: known_section_t
   use finshell_kinds, only: i4, wp
   use finshell_mass, only: mass_elements
   use finshell_status, only: status_ok
   implicit none
   private
   public :: element_forces, element_mass, element_stiffness, element_stress

contains

   !> Tangent at displacements u and rotation vectors t. Where there is none (code > 0) that of the undeformed element: CalculiX
   !> offers no way to refuse here, and learns from the forces that the increment has to be cut.
   subroutine element_stiffness(known, x, u, t, stiffness, code)
      type(known_section_t), intent(in) :: known
      real(wp), intent(in) :: x(3, 3), u(3, 3), t(3, 3) !< (component, node)
      real(wp), intent(out) :: stiffness(18, 18)
      integer(i4), intent(out) :: code
      real(wp) :: k(18, 18, 1)
      integer(i4) :: status(1)
      call evaluate_elements(known%section, 1, [x], [u], reshape(t, [3, 3, 1]), rotation_vector, status, tangent=k, &
                             direction=[known%direction], threads=1)
      if (status(1) > 0) then
         call evaluate_elements(known%section, 1, [x], [0*u], reshape(0*t, [3, 3, 1]), rotation_vector, status, tangent=k, &
                                direction=[known%direction], threads=1)
      end if
      stiffness = k(:, :, 1)
      code = status(1)
   end subroutine element_stiffness

   !> Internal forces; in a linear analysis stiffness of the undeformed element times displacements.
   subroutine element_forces(known, x, u, t, linear, force, code)
      type(known_section_t), intent(in) :: known
      real(wp), intent(in) :: x(3, 3), u(3, 3), t(3, 3)
      logical, intent(in) :: linear
      real(wp), intent(out) :: force(6, 3) !< (component, node)
      integer(i4), intent(out) :: code
      real(wp) :: f(18, 1), k(18, 18)
      integer(i4) :: status(1)
      if (linear) then
         call element_stiffness(known, x, 0*u, 0*t, k, code)
         force(1:3, :) = u
         force(4:6, :) = t
         force = reshape(matmul(k, [force]), [6, 3])
      else
         call evaluate_elements(known%section, 1, [x], [u], reshape(t, [3, 3, 1]), rotation_vector, status, force=f, &
                                direction=[known%direction], threads=1)
         force = reshape(f, [6, 3])
         code = status(1)
      end if
   end subroutine element_forces

   !> Cauchy stress at bottom, middle and top, components 11, 22, 12 in material directions; zeros where there is none.
   subroutine element_stress(known, x, u, t, stress)
      type(known_section_t), intent(in) :: known
      real(wp), intent(in) :: x(3, 3), u(3, 3), t(3, 3)
      real(wp), intent(out) :: stress(3, 3) !< (component; bottom, middle, top)
      real(wp) :: s(3, 3, 1)
      integer(i4) :: status(1)
      call recover_elements(known%section, 1, [x], [u], reshape(t, [3, 3, 1]), rotation_vector, status, stress=s, &
                            direction=[known%direction])
      stress = s(:, :, 1)
   end subroutine element_stress

   !> Consistent mass matrix.
   subroutine element_mass(known, x, mass, code)
      type(known_section_t), intent(in) :: known
      real(wp), intent(in) :: x(3, 3)
      real(wp), intent(out) :: mass(18, 18)
      integer(i4), intent(out) :: code
      real(wp) :: m(18, 18, 1)
      integer(i4) :: status(1)
      call mass_elements(known%section, 1, [x], status, consistent=m)
      mass = m(:, :, 1)
      code = status(1)
      if (code /= status_ok) mass = 0
   end subroutine element_mass
end module finshell_calculix
