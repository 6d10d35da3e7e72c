!> The model: mesh, sections, supports and loads. It is built once and then only read.
module finshell_structure
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t
   use finshell_section, only: section_t
   use finshell_support, only: support_t
   use finshell_load, only: load_t
   implicit none
   private
   public :: structure_t

   type :: structure_t
      type(mesh_t) :: mesh
      type(section_t), allocatable :: sections(:)
      real(wp), allocatable :: density(:) !< mass per reference volume of each section: needed by gravity only
      integer, allocatable :: element_section(:) !< (elements) index into sections
      !> (3, elements) material direction 1, projected on each element; unallocated: global x.
      real(wp), allocatable :: direction(:, :)
      !> (3, 3, elements) normals of the curved surface at the nodes of each element; unallocated: flat facets.
      real(wp), allocatable :: normal(:, :, :)
      type(support_t), allocatable :: supports(:)
      type(load_t), allocatable :: loads(:)
   end type structure_t
end module finshell_structure
