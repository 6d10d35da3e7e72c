!> The group &tie of an input file: nodes joined to nodes at the same place, or to a surface.
module finshell_input_tie
   use finshell_error, only: error_t, text_of
   use finshell_input_common, only: get_set, kind_node
   use finshell_joint, only: joint_t, joints_t
   use finshell_kinds, only: wp
   use finshell_mesh, only: element_set_names, find_element_set, find_node_set, mesh_size, mesh_t, node_set_names, node_text
   use finshell_namelist, only: complain_about, get, group_t, has
   use finshell_partner, only: nearest_node, project
   implicit none
   private
   public :: read_tie

   !> Of the size of the mesh: nodes are at the same place, and a point of a triangle is its corner.
   real(wp), parameter :: same_place = 1.0e-6_wp, no_gap = 1.0e-9_wp

contains

   subroutine read_tie(group, mesh, thickness, turns, joints, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(inout) :: mesh !< nodes may be moved onto a surface
      real(wp), intent(in) :: thickness(:) !< of the sections
      logical, intent(in) :: turns(:) !< (nodes) whether a node has rotations
      type(joints_t), intent(inout) :: joints !< the last origin is that of this group
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name, other
      integer, allocatable :: members(:)
      real(wp) :: length, tolerance
      logical :: adjust, rotations, surface

      length = mesh_size(mesh)
      call get_set(group, kind_node, mesh, name, error)
      call get(group, 'rotations', rotations, error, default=.true.)
      call get(group, 'adjust', adjust, error, default=.false.)
      surface = has(group, 'to_element_set')
      call get(group, 'tolerance', tolerance, error, above=0.0_wp, &
               default=merge(max(maxval(thickness), same_place*length), same_place*length, surface))
      if (allocated(error)) return
      if (surface .eqv. has(group, 'to_node_set')) then
         call complain_about(group, '', 'to_node_set or to_element_set is expected, what the nodes are tied to; ' &
            //trim(merge('both were found', 'none was found ', surface)), error)
         return
      end if
      members = mesh%node_sets(find_node_set(mesh, name))%members
      if (surface) then
         call get(group, 'to_element_set', other, error)
         if (allocated(error)) return
         if (find_element_set(mesh, other) == 0) then
            call complain_about(group, 'to_element_set', "there is no element set '"//other//"'; the mesh has: " &
               //element_set_names(mesh), error)
            return
         end if
         call tie_to_surface(group, mesh, members, other, rotations, adjust, tolerance, turns, joints, error)
      else
         call get(group, 'to_node_set', other, error)
         if (allocated(error)) return
         if (find_node_set(mesh, other) == 0) then
            call complain_about(group, 'to_node_set', "there is no node set '"//other//"'; the mesh has: " &
               //node_set_names(mesh), error)
            return
         end if
         call tie_to_nodes(group, mesh, members, other, rotations, adjust, tolerance, turns, joints, error)
      end if
   end subroutine read_tie

   !> Pairs of nodes. A node that depends already passes the tie on to what it depends on, if that is at the same place.
   subroutine tie_to_nodes(group, mesh, members, other, rotations, adjust, tolerance, turns, joints, error)
      type(group_t), intent(in) :: group
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: members(:)
      character(len=*), intent(in) :: other
      logical, intent(in) :: rotations, adjust, turns(:)
      real(wp), intent(in) :: tolerance
      type(joints_t), intent(inout) :: joints
      type(error_t), allocatable, intent(inout) :: error
      type(joint_t) :: joint
      integer, allocatable :: joint_of(:), partners(:)
      type(joint_t), allocatable :: list(:)
      real(wp) :: distance, gap
      integer :: a, b, i, found

      allocate (joint_of(size(mesh%coordinates, 2)), source=0)
      list = joints%list
      found = size(list)
      list = [list, [(joint_t(), i=1, size(members))]]
      do i = 1, found
         joint_of(list(i)%node) = i
      end do
      gap = no_gap*mesh_size(mesh)
      associate (to => mesh%node_sets(find_node_set(mesh, other))%members)
         partners = to
         do i = 1, size(members)
            a = members(i)
            if (any(to == a)) cycle
            call nearest_node(mesh, to, mesh%coordinates(:, a), b, distance)
            if (distance > tolerance) then
               call complain_about(group, 'node_set', node_text(mesh, a)//" has no partner in '"//other//"': the nearest, " &
                  //node_text(mesh, b)//', is '//text_of(real(distance, kind(1.0d0)))//' away; at most tolerance = ' &
                  //text_of(real(tolerance, kind(1.0d0)))//' is expected', error)
               return
            end if
            if (adjust) mesh%coordinates(:, a) = mesh%coordinates(:, b)
            joint = joint_t(node=root(a), origin=size(joints%origins))
            joint%master(1) = root(b)
            if (joint%node == joint%master(1)) cycle
            if (joint_of(joint%node) > 0 .and. joint_of(joint%master(1)) == 0) then
               joint%master(1) = joint%node
               joint%node = root(b)
            end if
            joint%arm = mesh%coordinates(:, joint%node) - mesh%coordinates(:, joint%master(1))
            joint%on_arm = norm2(joint%arm) > gap
            if (joint%on_arm .and. .not. turns(joint%master(1))) then
               call complain_about(group, 'node_set', node_text(mesh, a)//' and '//node_text(mesh, b)//' are ' &
                  //text_of(real(distance, kind(1.0d0)))//' apart, and the second has no rotation, being of membranes only; ' &
                  //'give adjust = .true., which moves the first, or let the second depend on it', error)
               return
            end if
            joint%turns = rotations .and. turns(joint%node) .and. turns(joint%master(1))
            found = found + 1
            list(found) = joint
            joint_of(joint%node) = found
         end do
      end associate
      joints%list = list(:found)

   contains

      !> What a node depends on at the same place, with its rotation or without as in this tie.
      integer function root(node)
         integer, intent(in) :: node
         integer :: steps
         root = node
         do steps = 1, found
            if (joint_of(root) == 0) return
            associate (before => list(joint_of(root)))
               if (before%masters > 1 .or. before%on_arm .or. (before%turns .neqv. rotations)) return
               root = before%master(1)
            end associate
         end do
      end function root
   end subroutine tie_to_nodes

   !> Nodes and the points of a surface that are nearest to them.
   subroutine tie_to_surface(group, mesh, members, other, rotations, adjust, tolerance, turns, joints, error)
      type(group_t), intent(in) :: group
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: members(:)
      character(len=*), intent(in) :: other
      logical, intent(in) :: rotations, adjust, turns(:)
      real(wp), intent(in) :: tolerance
      type(joints_t), intent(inout) :: joints
      type(error_t), allocatable, intent(inout) :: error
      type(joint_t), allocatable :: list(:)
      type(joint_t) :: joint
      real(wp) :: distance, gap
      integer :: element, found, i, corner
      gap = no_gap*mesh_size(mesh)
      allocate (list(size(members)))
      found = 0
      associate (to => mesh%element_sets(find_element_set(mesh, other))%members)
         do i = 1, size(members)
            joint = joint_t(node=members(i), origin=size(joints%origins))
            if (any(mesh%triangles(:, to) == members(i))) then
               call complain_about(group, 'node_set', node_text(mesh, members(i))//" belongs to '"//other &
                  //"' itself; take it out of the set, it is joined already", error)
               return
            end if
            call project(mesh, to, members(i), element, joint%weight, distance)
            if (distance > tolerance) then
               call complain_about(group, 'node_set', node_text(mesh, members(i))//' is '//text_of(real(distance, kind(1.0d0))) &
                  //" away from '"//other//"'; at most tolerance = "//text_of(real(tolerance, kind(1.0d0)))//' is expected', error)
               return
            end if
            joint%masters = 3
            joint%master = mesh%triangles(:, element)
            corner = maxloc(joint%weight, 1)
            if (joint%weight(corner) > 1 - no_gap) then
               joint%masters = 1
               joint%master = [joint%master(corner), 0, 0]
               joint%weight = [1, 0, 0]
               if (adjust) mesh%coordinates(:, members(i)) = mesh%coordinates(:, joint%master(1))
               joint%arm = mesh%coordinates(:, members(i)) - mesh%coordinates(:, joint%master(1))
            else
               associate (x => matmul(mesh%coordinates(:, joint%master), joint%weight))
                  if (adjust) mesh%coordinates(:, members(i)) = x
                  joint%arm = mesh%coordinates(:, members(i)) - x
               end associate
            end if
            associate (masters => joint%master(:joint%masters))
               joint%on_arm = norm2(joint%arm) > gap
               if (joint%on_arm .and. .not. all(turns(masters))) then
                  call complain_about(group, 'node_set', node_text(mesh, members(i))//' is ' &
                     //text_of(real(distance, kind(1.0d0)))//" away from '"//other//"', whose membranes have no rotation that " &
                     //'would carry it; give adjust = .true., which moves it onto them', error)
                  return
               end if
               joint%turns = rotations .and. turns(members(i)) .and. all(turns(masters))
            end associate
            found = found + 1
            list(found) = joint
         end do
      end associate
      joints%list = [joints%list, list(:found)]
   end subroutine tie_to_surface
end module finshell_input_tie
