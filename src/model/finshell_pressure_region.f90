!> When does a follower pressure have a symmetric load stiffness, and about which origin?
!>
!> A pressure on a closed volume has a potential. A region with a boundary is closed by the cone from its boundary to an origin;
!> the cone does no work when each boundary edge either is fixed or stays in a plane through the origin. So the symmetric form is
!> exact when every boundary edge has both ends fixed in all directions, or both ends held along the normal of a
!> fixed plane that contains the edge, and one origin lies in all these planes.
module finshell_pressure_region
   use finshell_joint, only: joint_t
   use finshell_kinds, only: dp, i8, wp
   use finshell_rotation, only: cross_product
   use finshell_mesh, only: mesh_t, mesh_size
   use finshell_mesh_sorting, only: sorted_order
   use finshell_equations, only: equations_t
   use finshell_support, only: node_support_t
   implicit none
   private
   public :: boundary_edges, symmetric_origin

   real(wp), parameter :: tolerance = 1.0e-7_wp

contains

   !> Edges (2, :) where the elements end: those that are not run through as often in one direction as in the other. Where nodes
   !> are tied to others at the same place, or to a side between two others, the elements go on.
   pure subroutine boundary_edges(mesh, elements, edges, turned, joints)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: elements(:)
      integer, allocatable, intent(out) :: edges(:, :)
      logical, intent(in), optional :: turned(:) !< (size(elements)) those that count with their other side
      type(joint_t), intent(in), optional :: joints(:)
      integer(i8), allocatable :: key(:)
      integer, allocatable :: order(:), all_edges(:, :)
      logical, allocatable :: single(:)
      integer :: first, i, k, e, net
      allocate (all_edges(2, 3*size(elements)))
      do i = 1, size(elements)
         do k = 1, 3
            e = 3*(i - 1) + k
            all_edges(1, e) = mesh%triangles(k, elements(i))
            all_edges(2, e) = mesh%triangles(mod(k, 3) + 1, elements(i))
            if (present(turned)) then
               if (turned(i)) all_edges(:, e) = all_edges([2, 1], e)
            end if
         end do
      end do
      if (present(joints)) call join_edges(joints, size(mesh%coordinates, 2), all_edges)
      key = edge_key(all_edges(1, :), all_edges(2, :), size(mesh%coordinates, 2))
      allocate (single(size(key)))
      order = sorted_order(key)
      single = .false.
      net = 0
      first = 1
      do i = 1, size(order)
         if (i > 1) then
            if (key(order(i)) /= key(order(first))) then
               first = i
               net = 0
            end if
         end if
         net = net + merge(1, -1, all_edges(1, order(i)) < all_edges(2, order(i)))
         single(order(first)) = net /= 0
      end do
      allocate (edges(2, count(single)))
      edges(1, :) = pack(all_edges(1, :), single)
      edges(2, :) = pack(all_edges(2, :), single)
   end subroutine boundary_edges

   elemental integer(i8) function edge_key(a, b, nodes)
      integer, intent(in) :: a, b, nodes
      edge_key = int(min(a, b), i8)*(nodes + 1_i8) + max(a, b)
   end function edge_key

   !> Edges between the nodes that others are tied to. An edge with tied nodes on it becomes several, end to end.
   pure subroutine join_edges(joints, nodes, edges)
      type(joint_t), intent(in) :: joints(:)
      integer, intent(in) :: nodes
      integer, allocatable, intent(inout) :: edges(:, :)
      integer, allocatable :: own(:), inside(:), side(:, :), pieces(:, :), chain(:), ends(:)
      integer(i8), allocatable :: key(:)
      real(dp), allocatable :: way(:) !< from the lower number of the side to the higher
      logical, allocatable :: busy(:)
      integer :: e, i, j
      own = [(i, i=1, nodes)]
      allocate (busy(nodes), source=.false.)
      allocate (inside(0), side(2, 0), way(0), pieces(2, 0))
      do j = 1, size(joints)
         associate (joint => joints(j))
            if (joint%on_arm) cycle
            select case (count(joint%weight(:joint%masters) > tolerance))
            case (1)
               own(joint%node) = joint%master(maxloc(joint%weight(:joint%masters), 1))
            case (2)
               inside = [inside, joint%node]
               ends = pack([1, 2, 3], joint%weight > tolerance)
               side = reshape([side, joint%master(ends)], [2, size(inside)])
               way = [way, real(joint%weight(ends(2)), dp)]
            end select
         end associate
      end do
      do i = 1, nodes
         do while (own(own(i)) /= own(i))
            own(i) = own(own(i))
         end do
      end do
      do i = 1, size(inside)
         side(:, i) = own(side(:, i))
         if (side(1, i) > side(2, i)) way(i) = 1 - way(i)
      end do
      key = edge_key(side(1, :), side(2, :), nodes)
      busy(side(1, :)) = .true.
      busy(side(2, :)) = .true.
      do e = 1, size(edges, 2)
         edges(:, e) = own(edges(:, e))
         if (.not. all(busy(edges(:, e)))) cycle
         chain = pack([(i, i=1, size(key))], key == edge_key(edges(1, e), edges(2, e), nodes))
         if (size(chain) == 0) cycle
         chain = chain(sorted_order(way(chain)))
         if (edges(1, e) > edges(2, e)) chain = chain(size(chain):1:-1)
         do i = 1, size(chain)
            pieces = reshape([pieces, edges(1, e), inside(chain(i))], [2, size(pieces, 2) + 1])
            edges(1, e) = inside(chain(i))
         end do
      end do
      edges = reshape([edges, pieces], [2, size(edges, 2) + size(pieces, 2)])
   end subroutine join_edges

   !> Is the symmetric load stiffness exact for a pressure on these elements, and about which origin?
   pure subroutine symmetric_origin(mesh, equations, elements, valid, origin, turned)
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: elements(:)
      logical, intent(out) :: valid
      real(wp), intent(out) :: origin(3)
      logical, intent(in), optional :: turned(:) !< see `boundary_edges`
      integer, allocatable :: edges(:, :)
      real(wp) :: normal(3), normals(3, 3), offset(3), centre(3), rest(3), distance, length
      integer :: i, k, planes
      logical :: plane

      call boundary_edges(mesh, elements, edges, turned, equations%links%joints)
      centre = 0
      do i = 1, size(elements)
         centre = centre + sum(mesh%coordinates(:, mesh%triangles(:, elements(i))), 2)/(3*size(elements))
      end do
      length = mesh_size(mesh)
      planes = 0
      normals = 0
      offset = 0
      valid = .true.
      do i = 1, size(edges, 2)
         call edge_plane(mesh, equations, edges(:, i), valid, plane, normal)
         if (.not. valid) return
         if (.not. plane) cycle
         distance = dot_product(normal, mesh%coordinates(:, edges(1, i)) - centre)
         rest = normal
         do k = 1, planes
            distance = distance - dot_product(normals(:, k), rest)*offset(k)
            rest = rest - dot_product(normals(:, k), rest)*normals(:, k)
         end do
         if (norm2(rest) > tolerance .and. planes < 3) then
            planes = planes + 1
            normals(:, planes) = rest/norm2(rest)
            offset(planes) = distance/norm2(rest)
         else if (abs(distance) > tolerance*length) then
            valid = .false.
            return
         end if
      end do
      origin = centre + matmul(normals, offset)
   end subroutine symmetric_origin

   !> What holds a boundary edge: nothing (invalid), everything (no plane), or the normal of a plane that contains it.
   pure subroutine edge_plane(mesh, equations, edge, valid, plane, normal)
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: edge(2)
      logical, intent(out) :: valid, plane
      real(wp), intent(out) :: normal(3)
      type(node_support_t) :: a, b
      real(wp) :: along(3), held(3, 3), candidate(3)
      integer :: k, count

      plane = .false.
      normal = 0
      valid = equations%support_of(edge(1)) > 0 .and. equations%support_of(edge(2)) > 0
      if (.not. valid) return
      a = equations%supported(equations%support_of(edge(1)))
      b = equations%supported(equations%support_of(edge(2)))
      along = mesh%coordinates(:, edge(2)) - mesh%coordinates(:, edge(1))
      along = along/norm2(along)
      valid = .not. any(equations%moved == edge(1)) .and. .not. any(equations%moved == edge(2))
      if (.not. valid) return
      if (a%displacements == 3 .and. b%displacements == 3) return

      ! The directions in which both ends are held.
      count = 0
      held = 0
      if (a%displacements == 3) then
         count = b%displacements
         held(:, :count) = b%displacement_axes(:, :count)
      else if (b%displacements == 3) then
         count = a%displacements
         held(:, :count) = a%displacement_axes(:, :count)
      else if (a%displacements == 2 .and. b%displacements == 2) then
         normal = cross_product(cross_product(a%displacement_axes(:, 1), a%displacement_axes(:, 2)), &
                        cross_product(b%displacement_axes(:, 1), b%displacement_axes(:, 2)))
         if (norm2(normal) > tolerance) then
            count = 1
            held(:, 1) = normal/norm2(normal)
         else
            count = 2
            held(:, :2) = a%displacement_axes(:, :2)
         end if
      else
         do k = 1, a%displacements
            candidate = a%displacement_axes(:, k)
            if (a%displacements == 2) candidate = b%displacement_axes(:, 1)
            if (.not. in_span(candidate, a) .or. .not. in_span(candidate, b)) cycle
            count = 1
            held(:, 1) = candidate
         end do
      end if

      select case (count)
      case (1)
         normal = held(:, 1)
         plane = .true.
         valid = abs(dot_product(normal, along)) < tolerance
      case (2)
         ! Free along one line only: the plane of the edge and that line, or any plane when they coincide.
         candidate = cross_product(held(:, 1), held(:, 2))
         normal = cross_product(candidate, along)
         plane = norm2(normal) > tolerance
         if (plane) normal = normal/norm2(normal)
      case default
         valid = .false.
      end select
   end subroutine edge_plane

   pure function in_span(direction, support) result(yes)
      real(wp), intent(in) :: direction(3)
      type(node_support_t), intent(in) :: support
      logical :: yes
      real(wp) :: rest(3)
      integer :: k
      rest = direction
      do k = 1, support%displacements
         rest = rest - dot_product(support%displacement_axes(:, k), direction)*support%displacement_axes(:, k)
      end do
      yes = norm2(rest) < tolerance
   end function in_span
end module finshell_pressure_region
