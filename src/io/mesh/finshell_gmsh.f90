!> Meshes from Gmsh files, format MSH 4.1 (text or binary).
!>
!> Every triangle of the file is taken; a physical surface becomes an element set, a physical curve an edge set and a node set, a
!> physical point a node set, under its name (or surface_TAG, curve_TAG, point_TAG when it has none). A surface that enters its
!> physical group with a minus sign has its triangles turned over. Nodes are renumbered in the order of their tags; nodes that
!> belong to no triangle are dropped.
module finshell_gmsh
   use finshell_kinds, only: wp, i8
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_input_error
   use finshell_text, only: read_whole_file
   use finshell_mesh, only: mesh_t, new_mesh, add_node_set, add_element_set, add_edge_set, find_node_set, find_element_set
   use finshell_mesh_sorting, only: sorted_order, position_in_sorted
   use finshell_gmsh_scanner, only: gmsh_scanner_t
   use finshell_gmsh_content, only: content_t, read_content, tag_text
   implicit none
   private
   public :: read_gmsh, parse_gmsh

contains

   !> Read a file. The mesh is not yet checked (check_mesh).
   subroutine read_gmsh(file_name, mesh, error)
      character(len=*), intent(in) :: file_name
      type(mesh_t), intent(out) :: mesh
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: bytes

      call read_whole_file(file_name, bytes, error)
      if (.not. allocated(error)) call parse_gmsh(bytes, file_name, mesh, error)
   end subroutine read_gmsh

   !> Turn the bytes of a file into a mesh; file is the name used in messages.
   subroutine parse_gmsh(bytes, file, mesh, error)
      character(len=*), intent(in) :: bytes
      character(len=*), intent(in) :: file
      type(mesh_t), intent(out) :: mesh
      type(error_t), allocatable, intent(out) :: error
      type(gmsh_scanner_t) :: scanner
      type(content_t) :: content

      scanner%file = file
      scanner%bytes = bytes
      call read_content(scanner, content, error)
      if (allocated(error)) return
      if (.not. allocated(content%node_tags)) then
         call raise(error, status_input_error, file//': the file has no $Nodes')
      else if (size(content%elements(2)%tags) == 0) then
         call raise(error, status_input_error, file//': the file has no triangles; mesh the surfaces (gmsh -2) and, if there ' &
            //'are physical groups, put the surfaces into physical surfaces')
      else
         call build(scanner, content, mesh, error)
      end if
   end subroutine parse_gmsh

   subroutine build(scanner, content, mesh, error)
      type(gmsh_scanner_t), intent(in) :: scanner !< for messages
      type(content_t), intent(inout) :: content
      type(mesh_t), intent(out) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      integer, allocatable :: order(:), number(:)
      integer, allocatable :: triangles(:, :)
      logical, allocatable :: used(:)
      integer :: i, k, e, m

      call check_entities(scanner, content, error)
      order = sorted_order(content%node_tags)
      content%node_tags = content%node_tags(order)
      content%coordinates = content%coordinates(:, order)
      allocate (used(size(order)), source=.false.)
      allocate (triangles(3, size(content%elements(2)%tags)))
      do m = 0, 2
         do e = 1, size(content%elements(m)%tags)
            do k = 1, m + 1
               i = position_in_sorted(content%node_tags, content%elements(m)%nodes(k, e))
               if (i == 0) call scanner%complain('element '//tag_text(content%elements(m)%tags(e))//' refers to the node ' &
                  //tag_text(content%elements(m)%nodes(k, e))//', which does not exist', error, content%elements(m)%places(e))
               if (allocated(error)) return
               if (m < 2) cycle
               triangles(k, e) = i
               used(i) = .true.
            end do
         end do
      end do
      allocate (number(size(order)), source=0)
      m = 0
      do i = 1, size(order)
         if (.not. used(i)) cycle
         m = m + 1
         number(i) = m
      end do
      do e = 1, size(triangles, 2)
         triangles(:, e) = number(triangles(:, e))
      end do
      do k = 1, size(content%blocks)
         associate (b => content%blocks(k), of => content%membership)
            if (b%dimension == 2 .and. any(of(1, :) == 2 .and. of(2, :) == b%entity .and. of(3, :) < 0)) &
               triangles(2:3, b%first:b%last) = triangles([3, 2], b%first:b%last)
         end associate
      end do
      call new_mesh(mesh, content%coordinates(:, pack([(i, i=1, size(order))], used)), triangles)
      mesh%node_tags = pack(content%node_tags, used)
      mesh%element_tags = content%elements(2)%tags
      do i = 1, size(content%membership, 2)
         call add_sets(scanner%file, content, number, content%membership(:, i), mesh, error)
         if (allocated(error)) return
      end do
      call name_empty_groups(content, mesh)
   end subroutine build

   !> Elements of an entity that the file does not describe would be left out of the physical groups without a word.
   subroutine check_entities(scanner, content, error)
      type(gmsh_scanner_t), intent(in) :: scanner
      type(content_t), intent(in) :: content
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      if (.not. allocated(content%entities)) return
      do i = 1, size(content%blocks)
         associate (b => content%blocks(i), known => content%entities)
            if (any(known(1, :) == b%dimension .and. known(2, :) == b%entity)) cycle
            call scanner%complain('these elements belong to the entity '//text_of(b%entity)//' of dimension ' &
               //text_of(b%dimension)//', which $Entities does not have', error, b%place)
            return
         end associate
      end do
   end subroutine check_entities

   !> Physical groups that have a name but no elements: no set, but worth a word when one asks for them.
   subroutine name_empty_groups(content, mesh)
      type(content_t), intent(in) :: content
      type(mesh_t), intent(inout) :: mesh
      integer :: i
      mesh%empty_sets = ''
      do i = 1, size(content%physical)
         associate (name => content%physical(i)%name)
            if (find_node_set(mesh, name) == 0 .and. find_element_set(mesh, name) == 0) mesh%empty_sets = mesh%empty_sets &
               //'"'//name//'"'
         end associate
      end do
   end subroutine name_empty_groups

   !> Enter the elements of one entity into the sets of one of its physical groups.
   subroutine add_sets(file, content, number, membership, mesh, error)
      character(len=*), intent(in) :: file
      type(content_t), intent(in) :: content
      integer, intent(in) :: number(:) !< of the nodes in the mesh, in the order of the tags
      integer, intent(in) :: membership(3)
      type(mesh_t), intent(inout) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      integer :: i, k

      if (membership(1) > 2) return
      name = group_name(content, membership(1), abs(membership(3)))
      do i = 1, size(content%blocks)
         associate (b => content%blocks(i))
            if (b%dimension /= membership(1) .or. b%entity /= membership(2)) cycle
            select case (membership(1))
            case (0)
               call add_node_set(mesh, name, reshape(mesh_numbers(content%elements(0)%nodes(:, b%first:b%last)), &
                  [b%last - b%first + 1]))
            case (1)
               call add_edge_set(mesh, name, mesh_numbers(content%elements(1)%nodes(:, b%first:b%last)))
            case (2)
               call add_element_set(mesh, name, [(k, k=b%first, b%last)])
            end select
         end associate
         if (allocated(error)) return
      end do

   contains

      function mesh_numbers(tags) result(numbers)
         integer(i8), intent(in) :: tags(:, :)
         integer :: numbers(size(tags, 1), size(tags, 2))
         integer :: p, q, position
         numbers = 1
         do q = 1, size(tags, 2)
            do p = 1, size(tags, 1)
               position = position_in_sorted(content%node_tags, tags(p, q))
               if (position > 0) numbers(p, q) = number(position)
               if (position > 0 .and. numbers(p, q) > 0) cycle
               call raise(error, status_input_error, file//": the physical group '"//name//"' contains the node " &
                  //tag_text(tags(p, q))//', which belongs to no triangle')
               return
            end do
         end do
      end function mesh_numbers
   end subroutine add_sets

   pure function group_name(content, dimension, tag) result(name)
      type(content_t), intent(in) :: content
      integer, intent(in) :: dimension, tag
      character(len=:), allocatable :: name
      character(len=7), parameter :: kinds(0:2) = [character(len=7) :: 'point', 'curve', 'surface']
      integer :: i

      do i = 1, size(content%physical)
         if (content%physical(i)%dimension /= dimension .or. content%physical(i)%tag /= tag) cycle
         name = content%physical(i)%name
         return
      end do
      name = trim(kinds(dimension))//'_'//text_of(tag)
   end function group_name
end module finshell_gmsh
