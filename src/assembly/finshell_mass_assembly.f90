!> The mass matrix of a structure, in the pattern of its tangent, and its products with nodal motions.
module finshell_mass_assembly
   use finshell_kinds, only: wp, i4
   use finshell_assembly, only: assembly_t, add_element_contributions
   use finshell_discretisation, only: gather_motion, freedoms
   use finshell_error, only: error_t, raise, text_of
   use finshell_freedoms, only: n_corners, n_nodal
   use finshell_linked_mass, only: linked_mass
   use finshell_mass, only: mass_elements, mass_membranes
   use finshell_rotation, only: cross_product
   use finshell_section, only: section_t
   use finshell_state, only: state_t
   use finshell_status, only: status_input_error, status_ok, status_text
   use finshell_structure, only: structure_t, inertia_of
   use finshell_step, only: mass_higher_order, mass_lumped
   implicit none
   private
   public :: mass_kind_t, add_masses, masses_times, check_masses

   !> Which mass matrix.
   type :: mass_kind_t
      integer :: interpolation = mass_higher_order !< see finshell_step
      logical :: rotatory = .true. !< with the inertia of the thickness against rotation
   end type mass_kind_t

   !> Elements at a time: 42 MB of matrices.
   integer, parameter :: together = 16384

contains

   !> Add the mass matrix to values in the pattern of the assembly, in the axes of its nodes. Errors: a section without density.
   subroutine add_masses(assembly, structure, state, kind, values, error)
      type(assembly_t), intent(in) :: assembly
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state !< its normals count
      type(mass_kind_t), intent(in) :: kind
      real(wp), intent(inout) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: nothing(:, :)
      allocate (nothing(n_nodal, size(structure%mesh%coordinates, 2)), source=0.0_wp)
      call visit(assembly, structure, state, kind, nothing, error, values=values)
   end subroutine add_masses

   !> M r of nodal vectors, held components included. Errors: as `add_masses`.
   subroutine masses_times(assembly, structure, state, kind, motion, product, error)
      type(assembly_t), intent(in) :: assembly
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state !< its normals count
      type(mass_kind_t), intent(in) :: kind
      real(wp), intent(in) :: motion(:, :) !< (n_nodal, nodes) displacements and spins or their rates, global axes
      real(wp), allocatable, intent(out) :: product(:, :) !< (n_nodal, nodes)
      type(error_t), allocatable, intent(out) :: error
      allocate (product(n_nodal, size(motion, 2)), source=0.0_wp)
      call visit(assembly, structure, state, kind, product, error, motion=motion)
   end subroutine masses_times

   !> Refuse a section without mass that elements have.
   subroutine check_masses(structure, error)
      type(structure_t), intent(in) :: structure
      type(error_t), allocatable, intent(out) :: error
      integer :: k
      do k = 1, size(structure%sections)
         if (structure%sections(k)%inertia(1) > 0 .or. .not. any(structure%element_section == k)) cycle
         call raise(error, status_input_error, 'section '//text_of(k)//' has no mass: its material needs a density > 0')
         return
      end do
   end subroutine check_masses

   !> The elements of all sections, some at a time: their masses to `values`, or times `motion` to `product`.
   subroutine visit(assembly, structure, state, kind, product, error, motion, values)
      type(assembly_t), intent(in) :: assembly
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state !< its normals count
      type(mass_kind_t), intent(in) :: kind
      real(wp), intent(inout) :: product(:, :)
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: motion(:, :)
      real(wp), intent(inout), optional :: values(:)
      real(wp), allocatable :: mass(:, :, :), force(:, :)
      integer, allocatable :: list(:), some(:)
      integer :: e, first, k, m

      call check_masses(structure, error)
      if (allocated(error)) return
      do k = 1, size(structure%sections)
         list = pack([(e, e=1, size(structure%element_section))], structure%element_section == k)
         m = freedoms(structure%sections(k))
         do first = 1, size(list), together
            some = list(first:min(size(list), first + together - 1))
            allocate (mass(m, m, size(some)), force(m, size(some)))
            call element_masses(structure, state, structure%sections(k), kind, some, mass, error)
            if (allocated(error)) return
            force = 0
            if (present(motion)) then
               call gather_motion(structure, motion, some, force)
               do e = 1, size(some)
                  force(:, e) = matmul(mass(:, :, e), force(:, e))
               end do
               call add_element_contributions(assembly, some, force, product)
            else
               ! it takes stiffness from the tangent
               call add_element_contributions(assembly, some, force, product, -mass, values)
            end if
            deallocate (mass, force)
         end do
      end do
   end subroutine visit

   !> Masses of some elements of one section, in global axes, at the present state.
   subroutine element_masses(structure, state, section, kind, list, mass, error)
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      type(section_t), intent(in) :: section
      type(mass_kind_t), intent(in) :: kind
      integer, intent(in) :: list(:)
      real(wp), intent(out) :: mass(:, :, :) !< (freedoms, freedoms, size(list))
      type(error_t), allocatable, intent(out) :: error
      type(section_t) :: own
      real(wp) :: x(3, 3, size(list)), now(3, 3, size(list)), normal(3, size(list))
      real(wp), allocatable :: diagonal(:, :)
      integer(i4) :: status(size(list))
      real(wp), allocatable :: thickness(:), offset(:) ! unallocated they count as absent in the calls
      real(wp) :: inertia(3)
      integer :: e

      own = section
      if (allocated(structure%thickness)) thickness = structure%thickness(list)
      if (allocated(structure%offset)) offset = structure%offset(list)
      if (.not. kind%rotatory) then ! as if all mass were at the nodes
         own%inertia(2:) = 0
         own%offset = 0
         if (allocated(offset)) deallocate (offset)
      end if
      do e = 1, size(list)
         associate (nodes => structure%mesh%triangles(:, list(e)))
            x(:, :, e) = structure%mesh%coordinates(:, nodes)
            now(:, :, e) = x(:, :, e) + state%displacement(:, nodes)
         end associate
         normal(:, e) = facet_normal(now(:, :, e))
      end do
      allocate (diagonal(size(mass, 1), size(list)))
      if (section%membrane) then
         call mass_membranes(own, size(list), x, status, mass, diagonal, thickness=thickness)
         ! half the mass of each kind: their errors of a wave cancel (Hughes 1987, 7.3)
         if (kind%interpolation == mass_higher_order) call mix(0.5_wp)
         if (kind%interpolation == mass_lumped) call mix(1.0_wp)
      else if (kind%interpolation == mass_lumped) then
         call mass_elements(own, size(list), x, status, lumped=diagonal, thickness=thickness, offset=offset)
         mass = 0
         call mix(1.0_wp)
      else
         call mass_elements(own, size(list), x, status, consistent=mass, present_normal=normal, thickness=thickness, &
                            offset=offset)
         do e = 1, merge(size(list), 0, kind%interpolation == mass_higher_order)
            inertia = inertia_of(structure, list(e))
            mass(:, :, e) = mass(:, :, e) + linked_mass(inertia(1)*triangle_area(x(:, :, e)), normal(:, e), now(:, :, e))
         end do
      end if
      e = findloc(status /= status_ok, .true., dim=1)
      if (e > 0) call raise(error, status(e), 'mass of element '//text_of(list(e))//': '//status_text(status(e)))

   contains

      !> A part of the masses lumped.
      subroutine mix(part)
         real(wp), intent(in) :: part
         integer :: i
         mass = (1 - part)*mass
         do i = 1, size(diagonal, 1)
            mass(i, i, :) = mass(i, i, :) + part*diagonal(i, :)
         end do
      end subroutine mix
   end subroutine element_masses

   pure real(wp) function triangle_area(x) result(area)
      real(wp), intent(in) :: x(3, n_corners)
      area = 0.5_wp*norm2(cross_product(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1)))
   end function triangle_area

   !> Unit normal of a triangle; zero where it has no area.
   pure function facet_normal(x) result(normal)
      real(wp), intent(in) :: x(3, n_corners)
      real(wp) :: normal(3)
      normal = cross_product(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1))
      if (norm2(normal) > 0) normal = normal/norm2(normal)
   end function facet_normal
end module finshell_mass_assembly
