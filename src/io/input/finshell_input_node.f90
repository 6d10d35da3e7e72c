!> The groups &node of an input file: nodes beside those of the mesh, for what is joined to it.
module finshell_input_node
   use finshell_error, only: error_t
   use finshell_input_common, only: check_name, get_vector
   use finshell_input_ends, only: get_ends
   use finshell_kinds, only: wp
   use finshell_mesh, only: add_loose_node, find_node_set, mesh_t
   use finshell_namelist, only: check_all_used, complain_about, get, group_t, has, namelist_t
   implicit none
   private
   public :: add_nodes

contains

   !> Add them to the mesh, each as a node set with its name. Errors: a name that a set of the mesh has already.
   subroutine add_nodes(namelist, mesh, error)
      type(namelist_t), intent(inout) :: namelist
      type(mesh_t), intent(inout) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      real(wp) :: position(3)
      integer :: i
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name /= 'node' .or. allocated(error)) cycle
         associate (group => namelist%groups(i))
            call get(group, 'name', name, error)
            call check_name(group, 'name', name, error)
            call get_vector(group, 'position', position, error)
            call check_all_used(group, error)
            if (allocated(error)) return
            if (find_node_set(mesh, name) > 0) then
               call complain_about(group, 'name', "the mesh has a node set '"//name//"' already; take another name", error)
            else
               call add_loose_node(mesh, name, position)
            end if
         end associate
      end do
      do i = 1, size(namelist%groups)
         if (allocated(error)) return
         if (namelist%groups(i)%name == 'bar' .or. namelist%groups(i)%name == 'cable') &
            call add_inner_nodes(namelist%groups(i), mesh, error)
      end do
   end subroutine add_nodes

   !> The nodes between the ends of bars and cables in pieces, one line after the other: a node set with their name.
   subroutine add_inner_nodes(group, mesh, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(inout) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      integer, allocatable :: ends(:, :)
      integer :: divisions, i, k
      if (.not. has(group, 'divisions')) return
      call get(group, 'divisions', divisions, error, minimum=1, maximum=100000)
      call get(group, 'name', name, error)
      if (.not. allocated(error)) call get_ends(group, mesh, ends, error, ground=.false.)
      if (allocated(error) .or. divisions < 2) return
      if (find_node_set(mesh, name) > 0) then
         call complain_about(group, 'name', "the mesh has a node set '"//name &
            //"' already, and the nodes between the pieces are to have the name; take another name", error)
         return
      end if
      do i = 1, size(ends, 2)
         do k = 1, divisions - 1
            associate (a => mesh%coordinates(:, ends(1, i)), b => mesh%coordinates(:, ends(2, i)))
               call add_loose_node(mesh, name, a + real(k, wp)/divisions*(b - a))
            end associate
         end do
      end do
   end subroutine add_inner_nodes
end module finshell_input_node
