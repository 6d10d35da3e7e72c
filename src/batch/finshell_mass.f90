!> Mass matrix of the element, consistent or lumped, with rotational inertia.
!>
!> Displacement and spin are interpolated linearly. Kinetic energy per reference area, with the inertia I0, I1, I2 of the
!> section (integrals of density times 1, z, z^2) and the reference normal d:
!>
!>     (I0 v.v + 2 I1 v.(w x d) + I2 w.w)/2
!>
!> I2 acts on all three spins, the drilling one included: the matrix is positive definite and, without offset, does not depend
!> on the direction of the normal, so that it stays constant in large motions. Rates refer to displacements and
!> spins; at a rotation vector theta the spin is T(theta) times its rate. Membranes have the first term alone.
module finshell_mass
   use finshell_freedoms, only: n_corners, n_membrane, n_shell, rx, rz, shell_at, ux, uz
   use finshell_kinds, only: wp, i4
   use finshell_own, only: own_inertia
   use finshell_rotation, only: cross_product, spin
   use finshell_section, only: section_t
   use finshell_status, only: status_invalid_argument, status_not_a_number, status_ok
   use finshell_triangle, only: judge_triangles
   implicit none
   private
   public :: mass_elements, mass_membranes

contains

   !> Mass matrices of n elements. What is not present is not computed; a failed element gets zeros and its status.
   pure subroutine mass_elements(section, n, x, status, consistent, lumped, present_normal, thickness, offset)
      type(section_t), intent(in) :: section
      integer, intent(in) :: n !< number of elements
      real(wp), intent(in) :: x(3, 3, n) !< reference coordinates (component, node, element)
      integer(i4), intent(out) :: status(n)
      real(wp), intent(out), optional :: consistent(n_shell, n_shell, n) !< order u1 t1 u2 t2 u3 t3, symmetric
      real(wp), intent(out), optional :: lumped(n_shell, n) !< diagonal: a third of the element per node; no I1
      real(wp), intent(in), optional :: present_normal(3, n) !< unit normals of a deformed state, for I1; default: of the reference
      real(wp), intent(in), optional :: thickness(n), offset(n) !< of the elements' own, as in evaluate_elements
      real(wp) :: normal(3), area, coupling(3, 3), share, inertia(3)
      integer :: c, e, i, j, p, q

      do e = 1, n
         inertia = inertia_of(section, e, thickness, offset)
         call measure(inertia, x(:, :, e), area, normal, status(e))
         if (present(thickness)) call judge_thickness(thickness(e), status(e))
         if (present(lumped)) lumped(:, e) = 0
         if (present(consistent)) consistent(:, :, e) = 0
         if (status(e) /= status_ok) cycle
         if (present(lumped)) then
            do i = 1, n_corners
               lumped(shell_at(i) + ux:shell_at(i) + uz, e) = inertia(1)*area/3
               lumped(shell_at(i) + rx:shell_at(i) + rz, e) = inertia(3)*area/3
            end do
         end if
         if (.not. present(consistent)) cycle
         if (present(present_normal)) normal = present_normal(:, e)
         ! v.(w x d) = v.(spin(d)' w)
         coupling = transpose(spin(normal))
         do j = 1, 3
            do i = 1, 3
               share = area/12
               if (i == j) share = area/6
               p = shell_at(i)
               q = shell_at(j)
               do c = 1, 3
                  consistent(p + c, q + c, e) = inertia(1)*share
                  consistent(p + uz + c, q + uz + c, e) = inertia(3)*share
               end do
               consistent(p + ux:p + uz, q + rx:q + rz, e) = (inertia(2)*share)*coupling
               consistent(p + rx:p + rz, q + ux:q + uz, e) = (inertia(2)*share)*transpose(coupling)
            end do
         end do
      end do
   end subroutine mass_elements

   !> Mass matrices of n membranes, as `mass_elements`; the sheet has its mass at the nodes' surface.
   pure subroutine mass_membranes(section, n, x, status, consistent, lumped, thickness)
      type(section_t), intent(in) :: section
      integer, intent(in) :: n
      real(wp), intent(in) :: x(3, 3, n)
      integer(i4), intent(out) :: status(n)
      real(wp), intent(out), optional :: consistent(n_membrane, n_membrane, n) !< order u1 u2 u3, symmetric
      real(wp), intent(out), optional :: lumped(n_membrane, n)
      real(wp), intent(in), optional :: thickness(n)
      real(wp) :: normal(3), area, inertia(3)
      integer :: e, i, j

      do e = 1, n
         inertia = inertia_of(section, e, thickness)
         call measure(inertia, x(:, :, e), area, normal, status(e))
         if (present(thickness)) call judge_thickness(thickness(e), status(e))
         if (status(e) /= status_ok) then
            area = 0
            inertia = 0
         end if
         if (present(lumped)) lumped(:, e) = inertia(1)*area/3
         if (.not. present(consistent)) cycle
         consistent(:, :, e) = 0
         do j = 1, n_membrane
            do i = modulo(j - 1, uz) + ux, n_membrane, uz
               consistent(i, j, e) = inertia(1)*merge(area/6, area/12, i == j)
            end do
         end do
      end do
   end subroutine mass_membranes

   !> Integrals of the density through the thickness of element e.
   pure function inertia_of(section, e, thickness, offset) result(inertia)
      type(section_t), intent(in) :: section
      integer, intent(in) :: e
      real(wp), intent(in), optional :: thickness(*), offset(*)
      real(wp) :: inertia(3)
      if (present(thickness) .and. present(offset)) then
         inertia = own_inertia(section, thickness(e), offset(e))
      else if (present(thickness)) then
         inertia = own_inertia(section, thickness(e))
      else if (present(offset)) then
         inertia = own_inertia(section, offset=offset(e))
      else
         inertia = section%inertia
      end if
   end function inertia_of

   !> A thickness of its own must be positive.
   pure subroutine judge_thickness(thickness, status)
      real(wp), intent(in) :: thickness
      integer(i4), intent(inout) :: status
      if (status == status_ok .and. .not. thickness > 0) status = status_invalid_argument
   end subroutine judge_thickness

   !> Area and unit normal of an element, and what is wrong with it or its mass.
   pure subroutine measure(inertia, x, area, normal, status)
      real(wp), intent(in) :: inertia(3), x(3, 3)
      real(wp), intent(out) :: area, normal(3)
      integer(i4), intent(out) :: status
      real(wp) :: a(3), b(3), length
      integer(i4) :: found(1)
      a = x(:, 2) - x(:, 1)
      b = x(:, 3) - x(:, 1)
      normal = cross_product(a, b)
      length = norm2(normal)
      area = 0.5_wp*length
      found = status_ok
      if (.not. sum(0*x) + sum(0*inertia) <= 0) then
         found = status_not_a_number
      else
         call judge_triangles(1, [length], [max(sum(a*a), sum(b*b), sum((b - a)**2))], found)
      end if
      status = found(1)
      if (status == status_ok .and. .not. maxval(abs(inertia))*max(1.0_wp, area) <= huge(1.0_wp)) &
         status = status_invalid_argument
      if (status == status_ok) normal = normal/length
   end subroutine measure
end module finshell_mass
