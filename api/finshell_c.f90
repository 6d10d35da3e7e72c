!> libfinshell for Fortran compilers other than the one that built it: the C interface, as a module to compile with your own.
!>
!> finshell.h says what the functions do; names are the same. An argument that may be NULL in C is optional here. Arrays have the
!> shapes of the header in the opposite order, first index fastest: X [n][3][3] is x(3, 3, n). Texts end with c_null_char.
!> A program that is compiled by the compiler of the library takes the module finshell instead.
module finshell_c
   use, intrinsic :: iso_c_binding, only: c_char, c_double, c_funptr, c_int32_t, c_int64_t, c_null_funptr, c_null_ptr, c_ptr
   implicit none
   private :: c_char, c_double, c_funptr, c_int32_t, c_int64_t, c_null_funptr, c_null_ptr, c_ptr
   public

   integer(c_int32_t), parameter :: finshell_ok = 0
   integer(c_int32_t), parameter :: finshell_collapsed_element = 1
   integer(c_int32_t), parameter :: finshell_material_limit = 2
   integer(c_int32_t), parameter :: finshell_large_rotation = 3
   integer(c_int32_t), parameter :: finshell_not_converged = 4
   integer(c_int32_t), parameter :: finshell_invalid_argument = -1
   integer(c_int32_t), parameter :: finshell_degenerate_reference = -2
   integer(c_int32_t), parameter :: finshell_not_a_number = -3
   integer(c_int32_t), parameter :: finshell_out_of_memory = -6
   integer(c_int32_t), parameter :: finshell_rotation_vector = 1
   integer(c_int32_t), parameter :: finshell_rotation_quaternion = 2
   integer(c_int32_t), parameter :: finshell_rotation_increment = 3
   integer(c_int32_t), parameter :: finshell_at_element = 1
   integer(c_int32_t), parameter :: finshell_at_surfaces = 2
   integer(c_int32_t), parameter :: finshell_at_layers = 3
   integer(c_int32_t), parameter :: finshell_sheet_slack = 0
   integer(c_int32_t), parameter :: finshell_sheet_wrinkled = 1
   integer(c_int32_t), parameter :: finshell_sheet_taut = 2
   integer(c_int32_t), parameter :: finshell_whole = 0
   integer(c_int32_t), parameter :: finshell_upper = 1
   integer(c_int32_t), parameter :: finshell_law_plane = 1
   integer(c_int32_t), parameter :: finshell_law_solid = 2
   integer(c_int32_t), parameter :: finshell_law_incompressible = 3
   integer(c_int32_t), parameter :: finshell_law_findings = 12 !< of finshell_law_check
   integer(c_int32_t), parameter :: finshell_abi_number = 2 !< what finshell_abi must return

   type, bind(c) :: finshell_status
      integer(c_int32_t) :: code
      integer(c_int32_t) :: index !< from 0, as in C
      integer(c_int32_t) :: failed
      character(kind=c_char) :: message(244)
   end type finshell_status

   type, bind(c) :: finshell_parameter
      character(kind=c_char) :: name(32)
      character(kind=c_char) :: meaning(128)
      real(c_double) :: default_value
      real(c_double) :: example
      integer(c_int32_t) :: required
      integer(c_int32_t) :: padding
   end type finshell_parameter

   type, bind(c) :: finshell_properties
      integer(c_int64_t) :: size = 0 !< c_sizeof of this
      integer(c_int32_t) :: layers = 0
      integer(c_int32_t) :: freedoms = 0
      integer(c_int32_t) :: formulation = 0
      integer(c_int32_t) :: isotropic = 0
      integer(c_int32_t) :: membrane = 0
      integer(c_int32_t) :: wrinkling = 0
      real(c_double) :: thickness = 0
      real(c_double) :: offset = 0
      real(c_double) :: areal_mass = 0
      real(c_double) :: first_moment = 0
      real(c_double) :: rotatory_inertia = 0
   end type finshell_properties

   type, bind(c) :: finshell_layer
      integer(c_int64_t) :: size = 0 !< c_sizeof of this
      character(kind=c_char) :: law(32) = ' '
      integer(c_int32_t) :: parameters = 0
      integer(c_int32_t) :: points = 0
      real(c_double) :: thickness = 0
      real(c_double) :: angle = 0
      real(c_double) :: density = 0
      real(c_double) :: height = 0
   end type finshell_layer

   type, bind(c) :: finshell_elements
      integer(c_int64_t) :: size = 0 !< c_sizeof of this
      integer(c_int32_t) :: n = 0
      integer(c_int32_t) :: convention = 0
      integer(c_int32_t) :: threads = 0
      integer(c_int32_t) :: reserved = 0
      type(c_ptr) :: x = c_null_ptr !< c_loc of an array, as the others
      type(c_ptr) :: u = c_null_ptr
      type(c_ptr) :: rotations = c_null_ptr
      type(c_ptr) :: state = c_null_ptr
      type(c_ptr) :: direction = c_null_ptr
      type(c_ptr) :: normals = c_null_ptr
      type(c_ptr) :: toward = c_null_ptr
      type(c_ptr) :: straight = c_null_ptr
      type(c_ptr) :: thickness = c_null_ptr
      type(c_ptr) :: offset = c_null_ptr
      type(c_ptr) :: growth = c_null_ptr
      type(c_ptr) :: states_begin = c_null_ptr
      type(c_ptr) :: states_end = c_null_ptr
      real(c_double) :: time = 0
      real(c_double) :: time_step = 0
   end type finshell_elements

   type, bind(c) :: finshell_mesh
      integer(c_int64_t) :: size = 0 !< c_sizeof of this
      integer(c_int32_t) :: nodes = 0
      integer(c_int32_t) :: elements = 0
      integer(c_int32_t) :: nodal = 0
      integer(c_int32_t) :: triangle = 0
      integer(c_int32_t) :: rows = 0
      integer(c_int32_t) :: reserved = 0
      type(c_ptr) :: triangles = c_null_ptr !< c_loc of an array, nodes from 0, as the others
      type(c_ptr) :: sections = c_null_ptr
      type(c_ptr) :: held = c_null_ptr
      type(c_ptr) :: freedoms = c_null_ptr
      type(c_ptr) :: starts = c_null_ptr
      type(c_ptr) :: columns = c_null_ptr
   end type finshell_mesh

   type, bind(c) :: finshell_points
      integer(c_int32_t) :: n
      integer(c_int32_t) :: level
      real(c_double) :: time
      real(c_double) :: time_step
      type(c_ptr) :: data
   end type finshell_points

   type, bind(c) :: finshell_law
      integer(c_int64_t) :: size = 0 !< c_sizeof of this
      type(c_ptr) :: name = c_null_ptr
      integer(c_int32_t) :: kind = 0
      integer(c_int32_t) :: isotropic = 0
      integer(c_int32_t) :: states = 0
      integer(c_int32_t) :: parameters = 0
      type(c_ptr) :: parameter = c_null_ptr
      type(c_funptr) :: evaluate = c_null_funptr !< c_funloc of a procedure with bind(c)
      type(c_funptr) :: stretch = c_null_funptr
      type(c_ptr) :: data = c_null_ptr
   end type finshell_law

   type, bind(c) :: finshell_law_finding
      character(kind=c_char) :: name(24)
      character(kind=c_char) :: meaning(112)
      real(c_double) :: found
      real(c_double) :: allowed
      integer(c_int32_t) :: passed
      integer(c_int32_t) :: padding
   end type finshell_law_finding

   type, bind(c) :: finshell_field_entry
      character(kind=c_char) :: name(32)
      character(kind=c_char) :: components(32)
      character(kind=c_char) :: dimension(32)
      character(kind=c_char) :: meaning(128)
      integer(c_int32_t) :: number
      integer(c_int32_t) :: at
   end type finshell_field_entry

   interface
      function finshell_version_text() result(text) bind(c)
         import :: c_ptr
         type(c_ptr) :: text
      end function finshell_version_text

      function finshell_version_number() result(number) bind(c)
         import :: c_int32_t
         integer(c_int32_t) :: number
      end function finshell_version_number

      function finshell_abi() result(number) bind(c)
         import :: c_int32_t
         integer(c_int32_t) :: number
      end function finshell_abi

      function finshell_cpu_level() result(number) bind(c)
         import :: c_int32_t
         integer(c_int32_t) :: number
      end function finshell_cpu_level

      function finshell_message(code, buffer, size) result(length) bind(c)
         import :: c_char, c_int32_t
         integer(c_int32_t), value :: code
         ! allow(C072)
         character(kind=c_char), intent(inout), optional :: buffer(*)
         integer(c_int32_t), value :: size
         integer(c_int32_t) :: length
      end function finshell_message

      function finshell_material_count() result(number) bind(c)
         import :: c_int32_t
         integer(c_int32_t) :: number
      end function finshell_material_count

      function finshell_material_name(i, buffer, size, status) result(code) bind(c)
         import :: c_char, c_int32_t, finshell_status
         integer(c_int32_t), value :: i
         ! allow(C072)
         character(kind=c_char), intent(inout), optional :: buffer(*)
         integer(c_int32_t), value :: size
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_material_name

      function finshell_material_parameter_count(material, status) result(code) bind(c)
         import :: c_char, c_int32_t, finshell_status
         character(kind=c_char), intent(in) :: material(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_material_parameter_count

      function finshell_material_parameter(material, i, parameter, status) result(code) bind(c)
         import :: c_char, c_int32_t, finshell_parameter, finshell_status
         character(kind=c_char), intent(in) :: material(*)
         integer(c_int32_t), value :: i
         type(finshell_parameter), intent(out), optional :: parameter
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_material_parameter

      function finshell_section_create(material, parameters, names, values, thickness, options, option_names, option_values, &
         section, status) result(code) bind(c)
         import :: c_char, c_double, c_int32_t, c_ptr, finshell_status
         character(kind=c_char), intent(in) :: material(*)
         integer(c_int32_t), value :: parameters
         type(c_ptr), intent(in), optional :: names(*)
         real(c_double), intent(in), optional :: values(*)
         real(c_double), value :: thickness
         integer(c_int32_t), value :: options
         type(c_ptr), intent(in), optional :: option_names(*)
         real(c_double), intent(in), optional :: option_values(*)
         type(c_ptr), intent(out) :: section
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_section_create

      function finshell_builder_begin(builder, status) result(code) bind(c)
         import :: c_int32_t, c_ptr, finshell_status
         type(c_ptr), intent(out) :: builder
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_builder_begin

      function finshell_builder_layer(builder, thickness, angle, points, density, status) result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: builder
         real(c_double), value :: thickness
         real(c_double), value :: angle
         integer(c_int32_t), value :: points
         real(c_double), value :: density
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_builder_layer

      function finshell_builder_law(builder, material, parameters, names, values, status) result(code) bind(c)
         import :: c_char, c_double, c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: builder
         character(kind=c_char), intent(in) :: material(*)
         integer(c_int32_t), value :: parameters
         type(c_ptr), intent(in), optional :: names(*)
         real(c_double), intent(in), optional :: values(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_builder_law

      function finshell_builder_own_law(builder, law, parameters, names, values, status) result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_law, finshell_status
         type(c_ptr), value :: builder
         type(finshell_law), intent(in), optional :: law
         integer(c_int32_t), value :: parameters
         type(c_ptr), intent(in), optional :: names(*)
         real(c_double), intent(in), optional :: values(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_builder_own_law

      function finshell_section_states(section, status) result(number) bind(c)
         import :: c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: section
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: number
      end function finshell_section_states

      function finshell_section_layer_states(section, layer, first, points, variables, status) result(code) bind(c)
         import :: c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: section
         integer(c_int32_t), value :: layer
         integer(c_int32_t), intent(out), optional :: first(*)
         integer(c_int32_t), intent(out), optional :: points(*)
         integer(c_int32_t), intent(out), optional :: variables(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_section_layer_states

      function finshell_law_check(law, material, parameters, names, values, finding, status) result(code) bind(c)
         import :: c_char, c_double, c_int32_t, c_ptr, finshell_law, finshell_law_finding, finshell_status
         type(finshell_law), intent(in), optional :: law
         character(kind=c_char), intent(in) :: material(*)
         integer(c_int32_t), value :: parameters
         type(c_ptr), intent(in), optional :: names(*)
         real(c_double), intent(in), optional :: values(*)
         ! allow(C072)
         type(finshell_law_finding), intent(out), optional :: finding(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_law_check

      function finshell_builder_option(builder, name, value, status) result(code) bind(c)
         import :: c_char, c_double, c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: builder
         character(kind=c_char), intent(in) :: name(*)
         real(c_double), value :: value
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_builder_option

      function finshell_builder_build(builder, section, status) result(code) bind(c)
         import :: c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: builder
         type(c_ptr), intent(out) :: section
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_builder_build

      subroutine finshell_builder_destroy(builder) bind(c)
         import :: c_ptr
         type(c_ptr), value :: builder
      end subroutine finshell_builder_destroy

      subroutine finshell_section_destroy(section) bind(c)
         import :: c_ptr
         type(c_ptr), value :: section
      end subroutine finshell_section_destroy

      function finshell_section_freedoms(section, status) result(number) bind(c)
         import :: c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: section
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: number
      end function finshell_section_freedoms

      function finshell_section_properties(section, properties, status) result(code) bind(c)
         import :: c_int32_t, c_ptr, finshell_properties, finshell_status
         type(c_ptr), value :: section
         type(finshell_properties), intent(inout), optional :: properties
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_section_properties

      function finshell_section_layer(section, i, layer, status) result(code) bind(c)
         import :: c_int32_t, c_ptr, finshell_layer, finshell_status
         type(c_ptr), value :: section
         integer(c_int32_t), value :: i
         type(finshell_layer), intent(inout), optional :: layer
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_section_layer

      function finshell_section_parameter(section, layer, i, name, size, value, status) result(code) bind(c)
         import :: c_char, c_double, c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: section
         integer(c_int32_t), value :: layer
         integer(c_int32_t), value :: i
         ! allow(C072)
         character(kind=c_char), intent(inout), optional :: name(*)
         integer(c_int32_t), value :: size
         real(c_double), intent(out), optional :: value
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_section_parameter

      function finshell_section_stiffness(section, stiffness, status) result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: section
         real(c_double), intent(out), optional :: stiffness(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_section_stiffness

      function finshell_elements_evaluate(section, elements, energy, force, tangent, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_elements, finshell_status
         type(c_ptr), value :: section
         type(finshell_elements), intent(in) :: elements
         real(c_double), intent(out), optional :: energy(*)
         real(c_double), intent(out), optional :: force(*)
         real(c_double), intent(out), optional :: tangent(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_elements_evaluate

      function finshell_elements_recover(section, elements, stretch, membrane_force, moment, stress, codes, &
         status) result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_elements, finshell_status
         type(c_ptr), value :: section
         type(finshell_elements), intent(in) :: elements
         real(c_double), intent(out), optional :: stretch(*)
         real(c_double), intent(out), optional :: membrane_force(*)
         real(c_double), intent(out), optional :: moment(*)
         real(c_double), intent(out), optional :: stress(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_elements_recover

      function finshell_elements_wrinkles(section, elements, state, ridge, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_elements, finshell_status
         type(c_ptr), value :: section
         type(finshell_elements), intent(in) :: elements
         integer(c_int32_t), intent(out), optional :: state(*)
         real(c_double), intent(out), optional :: ridge(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_elements_wrinkles

      function finshell_elements_pressure(elements, pressure, form, origin, volume, force, stiffness, codes, status) &
         result(code) bind(c)
         import :: c_double, c_int32_t, finshell_elements, finshell_status
         type(finshell_elements), intent(in) :: elements
         real(c_double), intent(in), optional :: pressure(*)
         integer(c_int32_t), value :: form
         real(c_double), intent(in), optional :: origin(*)
         real(c_double), intent(out), optional :: volume(*)
         real(c_double), intent(out), optional :: force(*)
         real(c_double), intent(out), optional :: stiffness(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_elements_pressure

      function finshell_evaluate(section, n, x, u, rotations, convention, state, direction, energy, force, tangent, codes, &
         threads, status) result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: section
         integer(c_int32_t), value :: n
         real(c_double), intent(in), optional :: x(*)
         real(c_double), intent(in), optional :: u(*)
         real(c_double), intent(in), optional :: rotations(*)
         integer(c_int32_t), value :: convention
         real(c_double), intent(in), optional :: state(*)
         real(c_double), intent(in), optional :: direction(*)
         real(c_double), intent(out), optional :: energy(*)
         real(c_double), intent(out), optional :: force(*)
         real(c_double), intent(out), optional :: tangent(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         integer(c_int32_t), value :: threads
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_evaluate

      function finshell_recover(section, n, x, u, rotations, convention, state, direction, stretch, membrane_force, moment, &
         stress, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: section
         integer(c_int32_t), value :: n
         real(c_double), intent(in), optional :: x(*)
         real(c_double), intent(in), optional :: u(*)
         real(c_double), intent(in), optional :: rotations(*)
         integer(c_int32_t), value :: convention
         real(c_double), intent(in), optional :: state(*)
         real(c_double), intent(in), optional :: direction(*)
         real(c_double), intent(out), optional :: stretch(*)
         real(c_double), intent(out), optional :: membrane_force(*)
         real(c_double), intent(out), optional :: moment(*)
         real(c_double), intent(out), optional :: stress(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_recover

      function finshell_mass_matrix(section, n, x, consistent, lumped, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: section
         integer(c_int32_t), value :: n
         real(c_double), intent(in), optional :: x(*)
         real(c_double), intent(out), optional :: consistent(*)
         real(c_double), intent(out), optional :: lumped(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_mass_matrix

      function finshell_elements_mass(section, elements, consistent, lumped, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_elements, finshell_status
         type(c_ptr), value :: section
         type(finshell_elements), intent(in) :: elements
         real(c_double), intent(out), optional :: consistent(*)
         real(c_double), intent(out), optional :: lumped(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_elements_mass

      function finshell_pressure_load(n, pressure, x, u, form, origin, force, stiffness, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, finshell_status
         integer(c_int32_t), value :: n
         real(c_double), intent(in), optional :: pressure(*)
         real(c_double), intent(in), optional :: x(*)
         real(c_double), intent(in), optional :: u(*)
         integer(c_int32_t), value :: form
         real(c_double), intent(in), optional :: origin(*)
         real(c_double), intent(out), optional :: force(*)
         real(c_double), intent(out), optional :: stiffness(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_pressure_load

      function finshell_assembly_create(mesh, sections, section, assembly, status) result(code) bind(c)
         import :: c_int32_t, c_ptr, finshell_mesh, finshell_status
         type(finshell_mesh), intent(in) :: mesh
         integer(c_int32_t), value :: sections
         type(c_ptr), intent(in), optional :: section(*)
         type(c_ptr), intent(out) :: assembly
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_assembly_create

      subroutine finshell_assembly_destroy(assembly) bind(c)
         import :: c_ptr
         type(c_ptr), value :: assembly
      end subroutine finshell_assembly_destroy

      function finshell_assembly_size(assembly, nodal, rows, entries, status) result(code) bind(c)
         import :: c_int32_t, c_int64_t, c_ptr, finshell_status
         type(c_ptr), value :: assembly
         integer(c_int32_t), intent(out), optional :: nodal(*)
         integer(c_int32_t), intent(out), optional :: rows(*)
         integer(c_int64_t), intent(out), optional :: entries(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_assembly_size

      function finshell_assembly_freedoms(assembly, freedoms, status) result(code) bind(c)
         import :: c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: assembly
         integer(c_int32_t), intent(out), optional :: freedoms(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_assembly_freedoms

      function finshell_assembly_pattern(assembly, starts, columns, status) result(code) bind(c)
         import :: c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: assembly
         integer(c_int32_t), intent(out), optional :: starts(*)
         integer(c_int32_t), intent(out), optional :: columns(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_assembly_pattern

      function finshell_assembly_pattern_64(assembly, starts, columns, status) result(code) bind(c)
         import :: c_int32_t, c_int64_t, c_ptr, finshell_status
         type(c_ptr), value :: assembly
         integer(c_int64_t), intent(out), optional :: starts(*)
         integer(c_int64_t), intent(out), optional :: columns(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_assembly_pattern_64

      function finshell_assembly_evaluate(assembly, sections, section, elements, energy, force, values, codes, status) &
         result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_elements, finshell_status
         type(c_ptr), value :: assembly
         integer(c_int32_t), value :: sections
         type(c_ptr), intent(in), optional :: section(*)
         type(finshell_elements), intent(in) :: elements
         real(c_double), intent(out), optional :: energy(*)
         real(c_double), intent(inout), optional :: force(*)
         real(c_double), intent(inout), optional :: values(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_assembly_evaluate

      function finshell_assembly_pressure(assembly, elements, pressure, form, origin, factor, force, values, codes, status) &
         result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_elements, finshell_status
         type(c_ptr), value :: assembly
         type(finshell_elements), intent(in) :: elements
         real(c_double), intent(in), optional :: pressure(*)
         integer(c_int32_t), value :: form
         real(c_double), intent(in), optional :: origin(*)
         real(c_double), value :: factor
         real(c_double), intent(inout), optional :: force(*)
         real(c_double), intent(inout), optional :: values(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_assembly_pressure

      function finshell_assembly_volume(assembly, elements, side, origin, volume, gradient, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_elements, finshell_status
         type(c_ptr), value :: assembly
         type(finshell_elements), intent(in) :: elements
         real(c_double), intent(in), optional :: side(*)
         real(c_double), intent(in), optional :: origin(*)
         real(c_double), intent(out), optional :: volume(*)
         real(c_double), intent(inout), optional :: gradient(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_assembly_volume

      function finshell_assembly_mass(assembly, sections, section, elements, factor, lumped, values, codes, status) &
         result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_elements, finshell_status
         type(c_ptr), value :: assembly
         integer(c_int32_t), value :: sections
         type(c_ptr), intent(in), optional :: section(*)
         type(finshell_elements), intent(in) :: elements
         real(c_double), value :: factor
         real(c_double), intent(inout), optional :: lumped(*)
         real(c_double), intent(inout), optional :: values(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_assembly_mass

      function finshell_assembly_traction(assembly, x, traction, factor, force, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_status
         type(c_ptr), value :: assembly
         real(c_double), intent(in), optional :: x(*)
         real(c_double), intent(in), optional :: traction(*)
         real(c_double), value :: factor
         real(c_double), intent(inout), optional :: force(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_assembly_traction

      function finshell_assembly_gravity(assembly, sections, section, elements, acceleration, factor, force, codes, status) &
         result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_elements, finshell_status
         type(c_ptr), value :: assembly
         integer(c_int32_t), value :: sections
         type(c_ptr), intent(in), optional :: section(*)
         type(finshell_elements), intent(in) :: elements
         real(c_double), intent(in), optional :: acceleration(*)
         real(c_double), value :: factor
         real(c_double), intent(inout), optional :: force(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_assembly_gravity

      function finshell_assembly_line_load(assembly, elements, n, element, side, load, factor, force, values, codes, status) &
         result(code) bind(c)
         import :: c_double, c_int32_t, c_ptr, finshell_elements, finshell_status
         type(c_ptr), value :: assembly
         type(finshell_elements), intent(in) :: elements
         integer(c_int32_t), value :: n
         integer(c_int32_t), intent(in), optional :: element(*)
         integer(c_int32_t), intent(in), optional :: side(*)
         real(c_double), intent(in), optional :: load(*)
         real(c_double), value :: factor
         real(c_double), intent(inout), optional :: force(*)
         real(c_double), intent(inout), optional :: values(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_assembly_line_load

      function finshell_field_count() result(number) bind(c)
         import :: c_int32_t
         integer(c_int32_t) :: number
      end function finshell_field_count

      function finshell_field_information(i, field, status) result(code) bind(c)
         import :: c_int32_t, finshell_field_entry, finshell_status
         integer(c_int32_t), value :: i
         type(finshell_field_entry), intent(out), optional :: field
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_field_information

      function finshell_recover_field(section, elements, name, values, codes, status) result(code) bind(c)
         import :: c_char, c_double, c_int32_t, c_ptr, finshell_elements, finshell_status
         type(c_ptr), value :: section
         type(finshell_elements), intent(in) :: elements
         character(kind=c_char), intent(in) :: name(*)
         real(c_double), intent(out), optional :: values(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_recover_field

      function finshell_rotation_exp(n, vector, quaternion, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, finshell_status
         integer(c_int32_t), value :: n
         real(c_double), intent(in), optional :: vector(*)
         real(c_double), intent(out), optional :: quaternion(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_rotation_exp

      function finshell_rotation_log(n, quaternion, vector, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, finshell_status
         integer(c_int32_t), value :: n
         real(c_double), intent(in), optional :: quaternion(*)
         real(c_double), intent(out), optional :: vector(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_rotation_log

      function finshell_rotation_compose(n, a, b, c, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, finshell_status
         integer(c_int32_t), value :: n
         real(c_double), intent(in), optional :: a(*)
         real(c_double), intent(in), optional :: b(*)
         real(c_double), intent(out), optional :: c(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_rotation_compose

      function finshell_rotation_update(n, spin, quaternion, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, finshell_status
         integer(c_int32_t), value :: n
         real(c_double), intent(in), optional :: spin(*)
         real(c_double), intent(inout), optional :: quaternion(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_rotation_update

      function finshell_rotation_matrix(n, quaternion, matrix, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, finshell_status
         integer(c_int32_t), value :: n
         real(c_double), intent(in), optional :: quaternion(*)
         real(c_double), intent(out), optional :: matrix(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_rotation_matrix

      function finshell_rotation_tangent(n, vector, tangent, codes, status) result(code) bind(c)
         import :: c_double, c_int32_t, finshell_status
         integer(c_int32_t), value :: n
         real(c_double), intent(in), optional :: vector(*)
         real(c_double), intent(out), optional :: tangent(*)
         integer(c_int32_t), intent(out), optional :: codes(*)
         type(finshell_status), intent(out), optional :: status
         integer(c_int32_t) :: code
      end function finshell_rotation_tangent
   end interface
end module finshell_c
