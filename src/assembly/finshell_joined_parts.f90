!> Parts of a structure that share no node but may be joined: which they are, and what joints demand of their rigid motions.
module finshell_joined_parts
   use finshell_equations, only: equations_t
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t
   use finshell_rotation, only: cross_product
   use finshell_union_find, only: join, new_forest, root_of
   implicit none
   private
   public :: find_parts, extent, add_link_conditions, part_link_t, add_part_links

   !> Springs and bars: nodes, 0 being the ground, and their stiffness over the motions of these, of the order of 1.
   type :: part_link_t
      integer :: node(2) = 0
      real(wp), allocatable :: stiffness(:, :) !< (n_nodal*ends, n_nodal*ends)
   end type part_link_t

contains

   !> Number the connected parts of the mesh. A node without element is a part if joints or springs know it, and belongs to
   !> part 0 if not.
   subroutine find_parts(mesh, equations, part, parts, cluster, springs)
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      integer, allocatable, intent(out) :: part(:)
      integer, intent(out) :: parts
      integer, allocatable, intent(out) :: cluster(:) !< (0:parts) of parts that joints connect, the first of which numbers them
      type(part_link_t), intent(in), optional :: springs(:) !< and these
      integer, allocatable :: root(:), number(:)
      integer :: e, k, i
      root = new_forest(size(mesh%coordinates, 2))
      do e = 1, size(mesh%triangles, 2)
         do k = 2, 3
            call join(root, mesh%triangles(1, e), mesh%triangles(k, e))
         end do
      end do
      allocate (part(size(root)), number(size(root)), source=0)
      parts = 0
      do e = 1, size(mesh%triangles, 2)
         do k = 1, 3
            i = root_of(root, mesh%triangles(k, e))
            if (number(i) == 0) then
               parts = parts + 1
               number(i) = parts
            end if
            part(mesh%triangles(k, e)) = number(i)
         end do
      end do
      if (equations%links%any()) then
         do k = 1, size(equations%links%node)
            call count_part(equations%links%node(k))
         end do
         do k = 1, size(equations%links%master)
            call count_part(equations%links%master(k))
         end do
      end if
      if (present(springs)) then
         do k = 1, size(springs)
            do i = 1, 2
               if (springs(k)%node(i) > 0) call count_part(springs(k)%node(i))
            end do
         end do
      end if
      root = new_forest(parts)
      if (equations%links%any()) then
         associate (links => equations%links)
            do k = 1, size(links%node)
               do e = links%first(k), links%first(k + 1) - 1
                  call join(root, part(links%node(k)), part(links%master(e)))
               end do
            end do
         end associate
      end if
      if (present(springs)) then
         do k = 1, size(springs)
            if (all(springs(k)%node > 0)) call join(root, part(springs(k)%node(1)), part(springs(k)%node(2)))
         end do
      end if
      allocate (cluster(0:parts))
      cluster(0) = 0
      number = 0
      do k = 1, parts
         i = root_of(root, k)
         if (number(i) == 0) number(i) = k
         cluster(k) = number(i)
      end do

   contains

      subroutine count_part(node)
         integer, intent(in) :: node
         if (part(node) > 0) return
         parts = parts + 1
         part(node) = parts
      end subroutine count_part
   end subroutine find_parts

   !> Middle and size of the nodes of a group.
   pure subroutine extent(mesh, group, g, centre, length)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: group(:), g !< of each node; which one
      real(wp), intent(out) :: centre(3), length
      real(wp) :: lowest(3), highest(3)
      integer :: i
      lowest = huge(1.0_wp)
      highest = -huge(1.0_wp)
      do i = 1, size(group)
         if (group(i) /= g) cycle
         lowest = min(lowest, mesh%coordinates(:, i))
         highest = max(highest, mesh%coordinates(:, i))
      end do
      centre = 0.5_wp*(lowest + highest)
      length = norm2(highest - lowest)
      if (.not. length > 0) length = 1
   end subroutine extent

   !> Add the squared conditions of links on the rigid motions (t, length*r) of some parts, in the reference state.
   subroutine add_link_conditions(mesh, equations, part, members, centre, length, conditions)
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: part(:) !< (nodes)
      integer, intent(in) :: members(:) !< the parts
      real(wp), intent(in) :: centre(3), length
      real(wp), intent(inout) :: conditions(:, :) !< (n_nodal*parts, n_nodal*parts)
      real(wp) :: row(n_nodal, size(members)), flat(n_nodal*size(members))
      integer :: at(0:maxval(part)), e, i, k, r, rows
      at = 0
      at(members) = [(i, i=1, size(members))]
      associate (links => equations%links)
         rows = 0
         if (links%any()) rows = size(links%node)
         do r = 1, rows
            if (at(part(links%node(r))) == 0) cycle
            row = 0
            call add_motion_of(links%component(r), links%node(r), -1.0_wp)
            do e = links%first(r), links%first(r + 1) - 1
               call add_motion_of(links%along(e), links%master(e), links%coefficient(e))
            end do
            flat = reshape(row, [size(flat)])
            do k = 1, size(flat)
               if (abs(flat(k)) > 0) conditions(:, k) = conditions(:, k) + flat*flat(k)
            end do
         end do
      end associate
      ! a node alone without rotation cannot turn
      do i = 1, size(part)
         if (at(part(i)) == 0 .or. i <= size(part) - mesh%loose) cycle
         if (any(equations%number(rx:rz, i) > 0)) cycle
         if (equations%support_of(i) > 0) then
            if (equations%supported(equations%support_of(i))%rotations > 0) cycle
         end if
         do k = n_nodal*(at(part(i)) - 1) + rx, n_nodal*at(part(i))
            conditions(k, k) = conditions(k, k) + 1
         end do
      end do

   contains

      !> A component of a node that moves with its part, times a factor; rotations times the length.
      subroutine add_motion_of(component, node, factor)
         integer, intent(in) :: component, node
         real(wp), intent(in) :: factor
         real(wp) :: unit(3)
         unit = 0
         unit(1 + mod(component - 1, uz)) = 1
         associate (mine => row(:, at(part(node))))
            if (component <= uz) then
               mine(ux:uz) = mine(ux:uz) + factor*unit
               mine(rx:rz) = mine(rx:rz) + factor*cross_product((mesh%coordinates(:, node) - centre)/length, unit)
            else
               mine(rx:rz) = mine(rx:rz) + factor*unit/merge(length, 1.0_wp, links_to_displacement())
            end if
         end associate
      end subroutine add_motion_of

      !> Rows of rotations are left times the length.
      pure logical function links_to_displacement()
         links_to_displacement = equations%links%component(r) <= uz
      end function links_to_displacement
   end subroutine add_link_conditions

   !> Add what springs and bars resist of the same motions.
   subroutine add_part_links(mesh, springs, part, members, centre, length, conditions, sprung)
      type(mesh_t), intent(in) :: mesh
      type(part_link_t), intent(in) :: springs(:)
      integer, intent(in) :: part(:), members(:) !< as for `add_link_conditions`
      real(wp), intent(in) :: centre(3), length
      real(wp), intent(inout) :: conditions(:, :)
      logical, intent(out) :: sprung !< there are some
      real(wp), allocatable :: rigid(:, :)
      real(wp) :: unit(3)
      integer :: at(0:maxval(part)), e, first, i, k
      at = 0
      at(members) = [(i, i=1, size(members))]
      sprung = .false.
      do i = 1, size(springs)
         associate (link => springs(i))
            e = maxval(link%node)
            if (at(part(e)) == 0) cycle
            sprung = .true.
            allocate (rigid(size(link%stiffness, 1), size(conditions, 1)), source=0.0_wp)
            do e = 1, size(rigid, 1)/n_nodal
               first = n_nodal*(at(part(link%node(e))) - 1)
               do k = 1, 3
                  unit = 0
                  unit(k) = 1
                  rigid(n_nodal*(e - 1) + ux:n_nodal*(e - 1) + uz, first + k) = unit
                  rigid(n_nodal*(e - 1) + ux:n_nodal*(e - 1) + uz, first + uz + k) = &
                     cross_product(unit, (mesh%coordinates(:, link%node(e)) - centre)/length)
                  rigid(n_nodal*(e - 1) + uz + k, first + uz + k) = 1
               end do
            end do
            conditions = conditions + matmul(transpose(rigid), matmul(link%stiffness, rigid))
            deallocate (rigid)
         end associate
      end do
   end subroutine add_part_links
end module finshell_joined_parts
