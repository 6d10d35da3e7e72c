! What the dispatchers of CalculiX call (see patch_calculix): external procedures, arguments under the names they have in
! CalculiX, no module around them because their callers are Fortran 77. code < 0: the message says what is wrong with the input, and
! the dispatcher stops.

!> Stiffness s and, if mass(1) = 1, mass sm of an element. CalculiX would pass over distributed loads on user elements in
!> silence: they are refused here, ff = 0.
! allow(C092)
subroutine finshell_stiffness(nelem, lakonl, co, konl, vold, mi, iperturb, mass, buckling, nload, nelemload, nbody, bodyfx, omx, &
                              material, property, matname, nelcon, elcon, ncmat_, ntmat_, nrhcon, rhcon, prop, s, sm, ff, &
                              code, message)
   use finshell_calculix, only: element_mass, element_stiffness
   use finshell_calculix_section, only: known_section_t, section_of
   use finshell_kinds, only: i4, wp
   use finshell_status, only: status_invalid_argument, status_text
   implicit none
   character(len=8), intent(in) :: lakonl
   character(len=80), intent(in) :: matname(*)
   integer, intent(in) :: nelem, konl(3), mi(*), iperturb(*), mass(*), buckling, nload, nelemload(2, *), nbody, material, &
                          property, nelcon(2, *), ncmat_, ntmat_, nrhcon(*)
   real(wp), intent(in) :: co(3, *), vold(0:mi(2), *), bodyfx(3), omx, elcon(0:ncmat_, ntmat_, *), rhcon(0:1, ntmat_, *), prop(*)
   real(wp), intent(inout) :: s(60, 60), sm(60, 60), ff(60)
   integer, intent(out) :: code
   character(len=400), intent(out) :: message
   type(known_section_t), pointer :: known
   real(wp) :: u(3, 3), t(3, 3)
   integer(i4) :: found

   code = status_invalid_argument
   message = 'buckling steps are not supported: use *STATIC, NLGEOM'
   if (buckling == 1) return
   message = 'distributed loads on elements US3F are not supported: use *CLOAD'
   if (any(nelemload(1, 1:nload) == nelem)) return
   if (nbody > 0) then
      if (maxval(abs(bodyfx)) > 0 .or. abs(omx) > 0) return
   end if
   call section_of(known, lakonl, material, property, matname, nelcon, elcon, ncmat_, ntmat_, nrhcon, rhcon, prop)
   code = known%code
   if (code < 0) then
      message = known%message
      return
   end if
   u = 0
   t = 0
   ! as CalculiX's own elements do: the deformed state counts in geometrically nonlinear steps and after them
   if (iperturb(1) > 0 .and. iperturb(2) == 1) then
      u = vold(1:3, konl)
      t = vold(4:6, konl)
   end if
   ff(1:18) = 0
   call element_stiffness(known, co(:, konl), u, t, s(1:18, 1:18), found)
   if (found >= 0 .and. mass(1) == 1) call element_mass(known, co(:, konl), sm(1:18, 1:18), found)
   code = found
   message = status_text(found)
end subroutine finshell_stiffness

!> Nodal forces of an element, added to fn and to the mean force qa(1), nal; Cauchy stress stx for output (iout > 0). qa(3) > 0
!> asks for a smaller increment.
! allow(C092)
subroutine finshell_forces(lakonl, co, konl, v, mi, iperturb, iout, calcul_fn, calcul_qa, material, property, matname, nelcon, &
                           elcon, ncmat_, ntmat_, nrhcon, rhcon, prop, fn, stx, qa, nal, code, message)
   use finshell_calculix, only: element_forces, element_stress
   use finshell_calculix_section, only: known_section_t, section_of
   use finshell_kinds, only: i4, wp
   use finshell_status, only: status_text
   implicit none
   character(len=8), intent(in) :: lakonl
   character(len=80), intent(in) :: matname(*)
   integer, intent(in) :: konl(3), mi(*), iperturb(*), iout, calcul_fn, calcul_qa, material, property, nelcon(2, *), ncmat_, &
                          ntmat_, nrhcon(*)
   real(wp), intent(in) :: co(3, *), v(0:mi(2), *), elcon(0:ncmat_, ntmat_, *), rhcon(0:1, ntmat_, *), prop(*)
   real(wp), intent(inout) :: fn(0:mi(2), *), qa(*)
   real(wp), intent(inout) :: stx(6, *) !< of the integration points of this element
   integer, intent(inout) :: nal
   integer, intent(out) :: code
   character(len=400), intent(out) :: message
   real(wp), parameter :: cut = 0.25_wp ! of the increment, when an element cannot be evaluated
   type(known_section_t), pointer :: known
   real(wp) :: force(6, 3), stress(3, 3)
   integer(i4) :: found
   logical :: linear
   integer :: j

   call section_of(known, lakonl, material, property, matname, nelcon, elcon, ncmat_, ntmat_, nrhcon, rhcon, prop)
   code = known%code
   if (code < 0) then
      message = known%message
      return
   end if
   linear = iperturb(1) < 2 .or. iperturb(2) /= 1
   call element_forces(known, co(:, konl), v(1:3, konl), v(4:6, konl), linear, force, found)
   code = found
   message = status_text(found)
   if (found < 0) return
   if (found > 0) then
      if (qa(3) < 0 .or. qa(3) > cut) qa(3) = cut
   end if
   if (calcul_fn == 1) fn(1:6, konl) = fn(1:6, konl) + force
   if (calcul_qa == 1) then
      qa(1) = qa(1) + sum(abs(force(1:3, :)))
      nal = nal + 9
   end if
   if (iout <= 0) return
   call element_stress(known, co(:, konl), v(1:3, konl), v(4:6, konl), stress)
   do j = 1, 3
      stx(1:6, j) = [stress(1, j), stress(2, j), 0.0_wp, stress(3, j), 0.0_wp, 0.0_wp]
   end do
end subroutine finshell_forces
