!> The model: mesh, sections, supports and loads. It is built once and then only read.
module finshell_structure
   use finshell_connector, only: connector_t, turns_nodes
   use finshell_factor, only: by_constant_factor
   use finshell_stress_free, only: growths_t
   use finshell_joint, only: joints_t
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t
   use finshell_own, only: own_inertia
   use finshell_section, only: section_t, formulation_s, states_of
   use finshell_support, only: support_t
   use finshell_chamber, only: chamber_t
   use finshell_load, only: load_t
   use finshell_table, only: follower_t
   implicit none
   private
   public :: structure_t, curved_elements, has_constants, inertia_of, is_membrane, remembers, thickness_of, turning_nodes

   type :: structure_t
      type(mesh_t) :: mesh
      type(section_t), allocatable :: sections(:)
      real(wp), allocatable :: density(:) !< mass per reference volume of each section: needed by gravity only
      integer, allocatable :: element_section(:) !< (elements) index into sections
      !> (3, elements) material direction 1, projected on each element; unallocated: global x.
      real(wp), allocatable :: direction(:, :)
      !> (3, 3, elements) normals of the curved surface at the nodes of each element; unallocated: flat facets.
      real(wp), allocatable :: normal(:, :, :)
      real(wp), allocatable :: thickness(:) !< (elements) of the whole section; unallocated: as the sections have it
      real(wp), allocatable :: offset(:) !< (elements) likewise: height of the middle above the surface of the nodes
      type(growths_t), allocatable :: growths !< unallocated: none
      type(support_t), allocatable :: supports(:)
      type(load_t), allocatable :: loads(:)
      type(connector_t), allocatable :: connectors(:) !< unallocated: none
      type(joints_t), allocatable :: joints !< unallocated: none
      type(chamber_t), allocatable :: chambers(:) !< unallocated: none
      integer :: cases = 0 !< factors of loads and supports, beside that of the first case, which has no name
      integer :: hosted = 0 !< the last of them, which belong to a host (finshell_host) and have no names
      type(follower_t), allocatable :: followers(:) !< those of them that follow tables; unallocated: none
   end type structure_t

contains

   !> Those of some elements that have a curved reference: none in a structure of facets, nor with the published element.
   pure function curved_elements(structure, elements) result(list)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: elements(:)
      integer, allocatable :: list(:)
      logical :: curved(size(elements))
      curved = .false.
      if (allocated(structure%normal)) &
         curved = structure%sections(structure%element_section(elements))%formulation == formulation_s &
                  .and. .not. is_membrane(structure, elements)
      list = pack(elements, curved)
   end function curved_elements

   !> Has an element displacements only?
   elemental function is_membrane(structure, element) result(membrane)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: element
      logical :: membrane
      membrane = structure%sections(structure%element_section(element))%membrane
   end function is_membrane

   !> Has a section a law with states?
   pure logical function remembers(structure)
      type(structure_t), intent(in) :: structure
      integer :: i
      remembers = .false.
      do i = 1, size(structure%sections)
         remembers = remembers .or. states_of(structure%sections(i)) > 0
      end do
   end function remembers

   !> Is there a load, support, growth or chamber that is brought in before the first step?
   pure logical function has_constants(structure)
      type(structure_t), intent(in) :: structure
      has_constants = any(structure%loads%scaling == by_constant_factor) &
                      .or. any(structure%chambers%scaling == by_constant_factor) &
                      .or. any(structure%supports%scaling == by_constant_factor)
      if (allocated(structure%growths)) has_constants = has_constants &
         .or. any(structure%growths%list%scaling == by_constant_factor)
   end function has_constants

   !> Of the section of an element, where this element has it.
   elemental real(wp) function thickness_of(structure, element) result(thickness)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: element
      if (allocated(structure%thickness)) then
         thickness = structure%thickness(element)
      else
         thickness = structure%sections(structure%element_section(element))%thickness
      end if
   end function thickness_of

   !> Integrals of density times 1, z, z^2 through the thickness of an element, z from the surface of the nodes.
   pure function inertia_of(structure, element) result(inertia)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: element
      real(wp) :: inertia(3)
      associate (section => structure%sections(structure%element_section(element)))
         inertia = section%inertia
         if (allocated(structure%offset)) then
            inertia = own_inertia(section, thickness_of(structure, element), structure%offset(element))
         else if (allocated(structure%thickness)) then
            inertia = own_inertia(section, structure%thickness(element))
         end if
      end associate
   end function inertia_of

   !> (nodes) Those that have rotations: of an element that has, or of no element with a node that goes with its rotation, or where
   !> a connector turns them.
   pure function turning_nodes(structure) result(turns)
      type(structure_t), intent(in) :: structure
      logical :: turns(size(structure%mesh%coordinates, 2))
      integer :: e, i, j, k
      turns = .false.
      if (allocated(structure%joints)) then
         do j = 1, size(structure%joints%list)
            associate (joint => structure%joints%list(j))
               if (joint%masters == 1 .and. (joint%on_arm .or. joint%turns)) turns(joint%master(1)) = .true.
            end associate
         end do
      end if
      do e = 1, size(structure%mesh%triangles, 2)
         if (.not. is_membrane(structure, e)) turns(structure%mesh%triangles(:, e)) = .true.
      end do
      if (.not. allocated(structure%connectors)) return
      do i = 1, size(structure%connectors)
         if (.not. turns_nodes(structure%connectors(i))) cycle
         do k = 1, size(structure%connectors(i)%node, 2)
            associate (node => structure%connectors(i)%node(:, k))
               turns(node) = turns(node) .or. node > size(turns) - structure%mesh%loose
            end associate
         end do
      end do
   end function turning_nodes
end module finshell_structure
