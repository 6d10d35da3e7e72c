!> A stand-in for the stiffness of structures whose law has none in the reference state (the exponential fibre law: its stress
!> starts with the cube of the strain), or whose membranes have none along their normals. It is the stiffness, in the reference
!> state, of the same structure made of an incompressible isotropic material with the shear modulus by which the law scales its
!> drilling stiffness; where there are membranes, uniformly stretched a little.
!>
!> Path following adds a part of it to the matrix of the first iterations, never to the forces, so solutions are unchanged.
!> A descent (finshell_descent) does likewise with a mass.
module finshell_ground
   use finshell_kinds, only: wp, i4, strip
   use finshell_freedoms, only: n_nodal, uz
   use finshell_component, only: expand_component, most_unknowns
   use finshell_error, only: error_t
   use finshell_status, only: status_ok
   use finshell_evaluation, only: level_tangent
   use finshell_material, only: material_t
   use finshell_registry, only: new_material
   use finshell_section, only: section_t
   use finshell_connectors, only: stand_in_for_lines
   use finshell_external, only: external_t
   use finshell_mesh, only: mesh_t, twice_area_vector
   use finshell_equations, only: equations_t, field_displacement
   use finshell_state, only: state_t, new_state
   use finshell_structure, only: structure_t
   use finshell_assembly, only: assembly_t, assemble
   use finshell_voigt, only: row
   implicit none
   private
   public :: is_soft, add_ground, ground_stiffness, lumped_weight

   real(wp), parameter :: tension = 0.05_wp !< strain of the stand-in of a membrane
   real(wp), parameter :: negligible = 1.0e-10_wp !< shear stiffness relative to the scale of the law

contains

   !> Has a section a law that offers no resistance to shear in the reference state, or is it a membrane, which offers none to
   !> motion along its normal?
   pure function is_soft(sections) result(soft)
      type(section_t), intent(in) :: sections(:)
      logical :: soft
      integer :: i, k
      soft = .false.
      do i = 1, size(sections)
         soft = soft .or. sections(i)%membrane
         do k = 1, size(sections(i)%layers)
            soft = soft .or. law_is_soft(sections(i)%layers(k)%law)
         end do
      end do
   end function is_soft

   pure function law_is_soft(law) result(soft)
      class(material_t), intent(in) :: law
      logical :: soft
      real(wp) :: e(strip, 3), w(strip), s(strip, 3), d(strip, size(row)), scale(size(row))
      integer(i4) :: status(strip)
      e = 0
      w = 0
      s = 0
      d = 0
      status = status_ok
      call law%plane_stress(strip, level_tangent, e, w, s, d, status)
      scale = law%reference_tangent()
      soft = abs(d(1, 3)) <= negligible*abs(scale(3))
   end function law_is_soft

   !> Add a part of the matrix of the stand-in.
   subroutine add_ground(assembly, structure, loads, state, part, ground, values, error)
      type(assembly_t), intent(in) :: assembly
      type(structure_t), intent(in) :: structure
      type(external_t), intent(in) :: loads !< may have lines at nodes of no element
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: part
      real(wp), intent(inout), allocatable :: ground(:) !< the whole, once it was needed
      real(wp), intent(inout) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      if (.not. allocated(ground)) then
         allocate (ground(size(values)))
         call ground_stiffness(assembly, structure, ground, error)
         if (allocated(error)) return
      end if
      values = values + part*ground
      call stand_in_for_lines(loads%list, structure, state, part, values)
   end subroutine add_ground

   !> Values of the matrix of the stand-in.
   subroutine ground_stiffness(assembly, structure, values, error)
      type(assembly_t), intent(in) :: assembly
      type(structure_t), intent(in) :: structure
      real(wp), intent(out) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      type(section_t), allocatable :: sections(:)
      class(material_t), allocatable :: law
      real(wp), allocatable :: force(:, :)
      type(state_t) :: reference
      real(wp) :: tangent(size(row))
      integer(i4) :: status
      integer :: i, k, element, nodes

      sections = structure%sections
      do i = 1, size(sections)
         do k = 1, size(sections(i)%layers)
            tangent = sections(i)%layers(k)%law%reference_tangent()
            call new_material(law, 'neo_hookean', ['mu'], [tangent(3)], error)
            if (allocated(error)) return
            call move_alloc(law, sections(i)%layers(k)%law)
         end do
      end do
      nodes = size(structure%mesh%coordinates, 2)
      allocate (force(n_nodal, nodes))
      call new_state(reference, nodes)
      ! in tension: a membrane has stiffness along its normal then
      if (any(sections%membrane)) reference%displacement = tension*structure%mesh%coordinates
      call assemble(assembly, structure, reference, force, status, element, values, sections=sections)
   end subroutine ground_stiffness

   !> A mass of one per area, a third of an element at each node, with the radius of gyration of an element.
   function lumped_weight(mesh, equations, detail) result(weight)
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: detail
      real(wp), allocatable :: weight(:)
      real(wp), allocatable :: around(:) !< (nodes) area
      real(wp) :: area, coefficient(most_unknowns)
      integer :: e, equation(most_unknowns), i, k, n
      allocate (weight(equations%n), around(size(mesh%coordinates, 2)), source=0.0_wp)
      do e = 1, size(mesh%triangles, 2)
         area = 0.5_wp*norm2(twice_area_vector(mesh, e))
         do i = 1, 3
            around(mesh%triangles(i, e)) = around(mesh%triangles(i, e)) + area/3
         end do
      end do
      do i = 1, size(around)
         do k = 1, n_nodal
            associate (at => equations%number(k, i), share => around(i)*merge(1.0_wp, detail**2, k <= uz))
               if (at > 0) weight(at) = weight(at) + share
               if (.not. equations%links%depends(k, i)) cycle
               ! no row of the mass of what depends on others, but its diagonal: enough for a scale
               call expand_component(equations, i, k, equation, coefficient, n)
               weight(equation(:n)) = weight(equation(:n)) + share*coefficient(:n)**2
            end associate
         end do
      end do
      ! nodes of no element have that of the others in the mean
      area = detail**2
      e = count(weight > 0 .and. equations%field == field_displacement)
      if (e > 0) area = sum(weight, mask=equations%field == field_displacement)/e
      where (.not. weight > 0) weight = area*merge(1.0_wp, detail**2, equations%field == field_displacement)
   end function lumped_weight
end module finshell_ground
