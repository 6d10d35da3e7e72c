!> Meshes from Gmsh files, formats MSH 4.1 and 2 (text or binary).
!>
!> Every surface element of the file is taken (finshell_raw_mesh); a physical surface becomes an element set, a physical curve an
!> edge set and a node set, a physical point a node set, under its name (or surface_TAG, curve_TAG, point_TAG when it has none). A
!> surface that enters its physical group with a minus sign has its triangles turned over. Nodes are renumbered in the order of
!> their tags; nodes that belong to no triangle are dropped.
module finshell_gmsh
   use finshell_kinds, only: i8
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_input_error
   use finshell_text, only: read_whole_file
   use finshell_mesh, only: mesh_t, add_node_set, add_element_set, add_edge_set, find_node_set, find_element_set
   use finshell_gmsh_scanner, only: gmsh_scanner_t
   use finshell_gmsh_content, only: content_t
   use finshell_gmsh_sections, only: read_content
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
      scanner%text = bytes
      call read_content(scanner, content, error)
      if (allocated(error)) return
      if (.not. allocated(content%node_tags)) then
         call raise(error, status_input_error, file//': the file has no $Nodes')
      else if (content%elements(2)%count == 0) then
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
      integer(i8) :: node
      integer :: dimension, e, i, k

      call check_entities(scanner, content, error)
      if (allocated(error)) return
      do k = 1, size(content%membership, 2)
         if (content%membership(1, k) == 2 .and. content%membership(3, k) < 0) call turn_over(content, content%membership(2, k))
      end do
      call content%make(mesh, dimension, e, node)
      if (dimension >= 0) then
         call scanner%complain('element '//text_of(content%elements(dimension)%tags(e))//' refers to the node ' &
            //text_of(node)//', which does not exist', error, content%elements(dimension)%places(e))
         return
      end if
      do i = 1, size(content%membership, 2)
         call add_sets(scanner%file, content, content%membership(:, i), mesh, error)
         if (allocated(error)) return
      end do
      call name_empty_groups(content, mesh)
   end subroutine build

   !> Turn the triangles of a surface over.
   subroutine turn_over(content, entity)
      type(content_t), intent(inout) :: content
      integer, intent(in) :: entity
      integer :: b, i
      do b = 1, size(content%blocks)
         if (content%blocks(b)%dimension /= 2 .or. content%blocks(b)%entity /= entity) cycle
         do i = 1, content%blocks(b)%count
            associate (nodes => content%elements(2)%nodes(:, content%blocks(b)%members(i)))
               nodes(2:3) = nodes([3, 2])
            end associate
         end do
      end do
   end subroutine turn_over

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
   subroutine add_sets(file, content, membership, mesh, error)
      character(len=*), intent(in) :: file
      type(content_t), intent(in) :: content
      integer, intent(in) :: membership(3)
      type(mesh_t), intent(inout) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      integer :: i

      if (membership(1) > 2) return
      name = group_name(content, membership(1), abs(membership(3)))
      do i = 1, size(content%blocks)
         associate (b => content%blocks(i))
            if (b%dimension /= membership(1) .or. b%entity /= membership(2) .or. b%count == 0) cycle
            select case (membership(1))
            case (0)
               call add_node_set(mesh, name, reshape(mesh_numbers(content%elements(0)%nodes(:, b%members(:b%count))), [b%count]))
            case (1)
               call add_edge_set(mesh, name, mesh_numbers(content%elements(1)%nodes(:, b%members(:b%count))))
            case (2)
               call add_element_set(mesh, name, b%members(:b%count))
            end select
         end associate
         if (allocated(error)) return
      end do

   contains

      function mesh_numbers(tags) result(numbers)
         integer(i8), intent(in) :: tags(:, :)
         integer :: numbers(size(tags, 1), size(tags, 2))
         integer :: p, q
         numbers = 1
         do q = 1, size(tags, 2)
            do p = 1, size(tags, 1)
               numbers(p, q) = content%number_of(tags(p, q))
               if (numbers(p, q) > 0) cycle
               call raise(error, status_input_error, file//": the physical group '"//name//"' contains the node " &
                  //text_of(tags(p, q))//', which belongs to no triangle')
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
