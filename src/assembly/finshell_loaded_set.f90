!> What a load acts on: the members of its set, and their mass.
module finshell_loaded_set
   use finshell_kinds, only: wp
   use finshell_error, only: error_t, raise, text_of
   use finshell_load, only: load_t
   use finshell_mesh, only: find_node_set, find_element_set, find_edge_set, node_set_names, element_set_names, edge_set_names
   use finshell_status, only: status_input_error
   use finshell_structure, only: structure_t, thickness_of
   implicit none
   private
   public :: loaded_nodes, loaded_elements, loaded_edges, mass_per_area

contains

   !> The nodes of the node set of a load. Error: there is no such set.
   subroutine loaded_nodes(load, structure, nodes, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      integer, allocatable, intent(out) :: nodes(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: at
      at = find_node_set(structure%mesh, load%set)
      if (at == 0) call unknown('node', load%set, node_set_names(structure%mesh), error)
      if (at > 0) nodes = structure%mesh%node_sets(at)%members
   end subroutine loaded_nodes

   !> The elements of the element set of a load. Error: there is no such set.
   subroutine loaded_elements(load, structure, elements, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      integer, allocatable, intent(out) :: elements(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: at
      at = find_element_set(structure%mesh, load%set)
      if (at == 0) call unknown('element', load%set, element_set_names(structure%mesh), error)
      if (at > 0) elements = structure%mesh%element_sets(at)%members
   end subroutine loaded_elements

   !> The edges of the edge set of a load, (2, :). Error: there is no such set.
   subroutine loaded_edges(load, structure, edges, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      integer, allocatable, intent(out) :: edges(:, :)
      type(error_t), allocatable, intent(inout) :: error
      integer :: at
      at = find_edge_set(structure%mesh, load%set)
      if (at == 0) call unknown('edge', load%set, edge_set_names(structure%mesh), error)
      if (at > 0) edges = structure%mesh%edge_sets(at)%edges
   end subroutine loaded_edges

   subroutine unknown(what, set, names, error)
      character(len=*), intent(in) :: what, set, names
      type(error_t), allocatable, intent(inout) :: error
      call raise(error, status_input_error, 'load: the mesh has no '//what//" set '"//set//"'; it has: "//names)
   end subroutine unknown

   !> Mass per reference area of elements that a load sets in motion. Error: no density.
   subroutine mass_per_area(load, structure, elements, mass, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: elements(:)
      real(wp), allocatable, intent(out) :: mass(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: i, section
      if (.not. allocated(structure%density)) then
         call raise(error, status_input_error, 'load: '//trim(load%kind)//" on '"//load%set//"' needs the density of its section")
         return
      end if
      allocate (mass(size(elements)))
      do i = 1, size(elements)
         section = structure%element_section(elements(i))
         mass(i) = structure%density(section)*thickness_of(structure, elements(i))
         if (structure%density(section) > 0) cycle
         call raise(error, status_input_error, 'load: '//trim(load%kind)//" on '"//load%set//"' acts on section " &
            //text_of(section)//', whose density is not positive')
         return
      end do
   end subroutine mass_per_area
end module finshell_loaded_set
