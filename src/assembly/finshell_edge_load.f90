!> Loads on the edges of an edge set: dead and follower forces and moments per reference length.
module finshell_edge_load
   use finshell_acting_load, only: load_item_t
   use finshell_dead_load, only: add_edge, add_edge_moment, dead_load_t
   use finshell_equations, only: equations_t
   use finshell_error, only: error_t
   use finshell_follower_bulge, only: add_follower_bulge
   use finshell_follower_line, only: add_follower_line, add_follower_moment
   use finshell_load, only: load_t, load_edge
   use finshell_loaded_set, only: loaded_edges
   use finshell_side_load, only: add_side_load
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: add_edge_load

contains

   !> Errors: no such set; what the kind refuses.
   subroutine add_edge_load(load, structure, equations, dead, list, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(dead_load_t), intent(inout) :: dead !< of its factor
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      integer, allocatable :: edges(:, :)
      call loaded_edges(load, structure, edges, error)
      if (allocated(error)) return
      if (load%kind == load_edge) then
         call add_edge(load, structure%mesh, edges, dead)
         call add_side_load(load, structure, edges, equations%held, list)
      else if (load%kind == 'follower_line') then
         call add_follower_line(load, structure, equations, edges, list, error)
         if (.not. allocated(error)) call add_follower_bulge(load, structure, equations, edges, list)
      else if (abs(load%numbers(1)) > 0) then
         call add_follower_moment(load, structure, equations, edges, list, error)
      else
         call add_edge_moment(load, structure%mesh, edges, dead)
      end if
   end subroutine add_edge_load
end module finshell_edge_load
