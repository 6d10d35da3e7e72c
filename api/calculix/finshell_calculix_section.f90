!> Sections as CalculiX describes them: *MATERIAL, *USER MATERIAL, *DENSITY and *USER SECTION.
!>
!> The law is the name of the material up to the first '-'; its parameters are the user constants, in the order of
!> `material_parameters`. The section has eight constants: thickness, number of points through the thickness, formulation, beta0,
!> offset (0 in these four: the default) and three components of the material direction (0, 0, 0: global x).
!>
!> CalculiX asks for one element at a time, from several threads. So a section is built when the first of its elements is
!> met, and kept.
module finshell_calculix_section
   use finshell_error, only: error_t, text_of
   use finshell_kinds, only: i4, wp
   use finshell_material, only: material_t
   use finshell_registry, only: material_parameters, new_material, parameter_t
   use finshell_section, only: formulation_s, new_section, points_by_law, section_t
   use finshell_status, only: status_invalid_argument, status_ok
   implicit none
   private
   public :: known_section_t, section_of

   integer, parameter :: n_constants = 8

   !> A section, or the reason why there is none. Entries are never removed, so that pointers to them stay valid.
   type :: known_section_t
      integer :: material = 0 !< number of the material in CalculiX
      integer :: property = 0 !< where the constants of the section begin
      type(section_t) :: section
      real(wp) :: direction(3) = 0
      integer(i4) :: code = status_ok
      character(len=:), allocatable :: message
      type(known_section_t), pointer :: next => null()
   end type known_section_t

   type(known_section_t), pointer :: first => null()

contains

   !> The section of an element, from the arrays of CalculiX (names and bounds as there). `known%code` < 0: the input is wrong, and
   !> `known%message` says why. Safe for any number of threads.
   subroutine section_of(known, label, material, property, matname, nelcon, elcon, ncmat_, ntmat_, nrhcon, rhcon, prop)
      type(known_section_t), pointer, intent(out) :: known
      character(len=8), intent(in) :: label !< type of the element; then numbers of points, freedoms and nodes
      integer, intent(in) :: material, property, ncmat_, ntmat_
      character(len=80), intent(in) :: matname(*)
      integer, intent(in) :: nelcon(2, *), nrhcon(*)
      real(wp), intent(in) :: elcon(0:ncmat_, ntmat_, *), rhcon(0:1, ntmat_, *), prop(*)
      real(wp) :: density
!$omp critical (finshell_calculix)
      known => first
      do while (associated(known))
         if (known%material == material .and. known%property == property) exit
         known => known%next
      end do
      if (.not. associated(known)) then
         allocate (known)
         known%material = material
         known%property = property
         if (iachar(label(6:6)) < 3 .or. label(7:8) /= achar(6)//achar(3)) then
            call refuse(known, '*USER ELEMENT: INTEGRATION POINTS=3, MAXDOF=6, NODES=3 expected')
         else if (material < 1 .or. property < 0) then
            call refuse(known, '*USER SECTION with MATERIAL and CONSTANTS=8 expected')
         else if (nelcon(1, max(1, material)) > -100) then
            call refuse(known, 'material '//trim(matname(material))//': *USER MATERIAL expected')
         else
            density = 0
            if (nrhcon(material) > 0) density = rhcon(1, 1, material)
            call describe(known, matname(material), elcon(1:-100 - nelcon(1, material), 1, material), &
                          prop(property + 1:property + n_constants), density)
         end if
         known%next => first
         first => known
      end if
!$omp end critical (finshell_calculix)
   end subroutine section_of

   subroutine refuse(known, message)
      type(known_section_t), intent(inout) :: known
      character(len=*), intent(in) :: message
      known%code = status_invalid_argument
      known%message = message
   end subroutine refuse

   subroutine describe(known, name, values, constants, density)
      type(known_section_t), intent(inout) :: known
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values(:), constants(n_constants), density
      type(parameter_t), allocatable :: parameters(:)
      class(material_t), allocatable :: law
      type(error_t), allocatable :: error
      real(wp), allocatable :: beta0
      integer :: formulation, points

      parameters = material_parameters(law_of(name))
      if (size(parameters) > 0 .and. size(values) > size(parameters)) then
         call refuse(known, 'material '//trim(name)//': '//text_of(size(values))//' constants, but the law takes '// &
                     text_of(size(parameters)))
         return
      end if
      associate (n => min(size(values), size(parameters)))
         call new_material(law, law_of(name), parameters(:n)%name, values(:n), error)
      end associate
      if (.not. allocated(error)) then
         points = or_default(constants(2), points_by_law)
         formulation = or_default(constants(3), formulation_s)
         if (abs(constants(4)) > 0) beta0 = constants(4)
         call new_section(known%section, law, constants(1), error, formulation, beta0, points, density, constants(5))
      end if
      known%direction = constants(6:8)
      if (.not. norm2(known%direction) > 0) known%direction = [1.0_wp, 0.0_wp, 0.0_wp]
      if (.not. allocated(error)) return
      known%code = error%code
      known%message = error%message
   end subroutine describe

   !> A whole number among the constants; -1, which `new_section` refuses, if it is none.
   pure integer function or_default(constant, default)
      real(wp), intent(in) :: constant
      integer, intent(in) :: default
      or_default = default
      if (.not. abs(constant) > 0) return
      or_default = -1
      if (constant > 0 .and. constant < 100 .and. abs(constant - anint(constant)) < 1.0e-6_wp) or_default = nint(constant)
   end function or_default

   !> 'NEO_HOOKEAN-WALL': the law is neo_hookean.
   pure function law_of(name) result(law)
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: law
      law = trim(name)
      if (index(law, '-') > 0) law = law(:index(law, '-') - 1)
   end function law_of
end module finshell_calculix_section
