!> Triangles turned alike: neighbours run through their common edge in opposite directions.
module finshell_orientation
   use finshell_edges, only: edges_t, new_edges
   use finshell_error, only: error_t, raise
   use finshell_kinds, only: wp
   use finshell_mesh, only: element_text, mesh_t, twice_area_vector
   use finshell_status, only: status_input_error
   implicit none
   private
   public :: orient_triangles

contains

   !> Turn the triangles of each connected part alike: those of a closed surface outward; of an open one as most of its area is, or
   !> to the side of a point. Errors: a surface with one side only (a Moebius strip).
   subroutine orient_triangles(mesh, turned, error, toward)
      type(mesh_t), intent(inout) :: mesh
      integer, intent(out) :: turned !< number of triangles that were turned
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: toward(3) !< normals point to its side
      type(edges_t) :: edges
      integer, allocatable :: part(:), sense(:)
      integer :: e, parts
      logical, allocatable :: turns(:)

      call new_edges(edges, mesh%triangles)
      call find_parts(mesh, edges, part, sense, parts, error)
      turned = 0
      if (allocated(error)) return
      call decide(mesh, edges, part, sense, parts, turns, toward)
      do e = 1, size(sense)
         if ((sense(e) > 0) .neqv. turns(part(e))) cycle
         mesh%triangles(2:3, e) = mesh%triangles([3, 2], e)
         turned = turned + 1
      end do
   end subroutine orient_triangles

   !> Connected parts, and how each triangle stands to the first of its part: 1 alike, -1 turned.
   subroutine find_parts(mesh, edges, part, sense, parts, error)
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      integer, allocatable, intent(out) :: part(:), sense(:) !< (elements)
      integer, intent(out) :: parts
      type(error_t), allocatable, intent(inout) :: error
      integer, allocatable :: queue(:)
      integer :: e, head, k, neighbour, relative, tail, start

      allocate (part(size(mesh%triangles, 2)), sense(size(mesh%triangles, 2)), source=0)
      allocate (queue(size(part)))
      parts = 0
      do start = 1, size(part)
         if (part(start) > 0) cycle
         parts = parts + 1
         part(start) = parts
         sense(start) = 1
         queue(1) = start
         head = 1
         tail = 1
         do while (head <= tail)
            e = queue(head)
            head = head + 1
            do k = 1, 3
               associate (sides => edges%elements(:, edges%of_side(k, e)))
                  if (sides(2) == 0) cycle
                  neighbour = merge(sides(2), sides(1), sides(1) == e)
               end associate
               relative = sense(e)*merge(-1, 1, runs_alike(mesh%triangles(:, e), mesh%triangles(:, neighbour), k))
               if (part(neighbour) == 0) then
                  part(neighbour) = parts
                  sense(neighbour) = relative
                  tail = tail + 1
                  queue(tail) = neighbour
               else if (sense(neighbour) /= relative) then
                  call raise(error, status_input_error, 'mesh: the triangles cannot be turned alike: '//element_text(mesh, e) &
                     //' and '//element_text(mesh, neighbour)//' close a surface that has one side only (a Moebius strip)')
                  return
               end if
            end do
         end do
      end do
   end subroutine find_parts

   !> Whether the neighbour at side k runs through it in the same direction.
   pure logical function runs_alike(triangle, neighbour, k)
      integer, intent(in) :: triangle(3), neighbour(3), k
      integer :: i
      runs_alike = .false.
      do i = 1, 3
         if (neighbour(i) == triangle(k)) runs_alike = neighbour(1 + mod(i, 3)) == triangle(1 + mod(k, 3))
      end do
   end function runs_alike

   !> Which parts, turned alike, have to be turned as a whole.
   subroutine decide(mesh, edges, part, sense, parts, turns, toward)
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      integer, intent(in) :: part(:), sense(:) !< (elements)
      integer, intent(in) :: parts
      logical, allocatable, intent(out) :: turns(:) !< (parts)
      real(wp), intent(in), optional :: toward(3)
      real(wp) :: balance(parts), nearest(parts), side(parts), volume(parts), origin(3, parts), x(3, 3), area(3), distance
      logical :: open(parts)
      integer :: e, k

      open = .false.
      balance = 0
      volume = 0
      side = 0
      nearest = huge(nearest)
      do e = size(part), 1, -1
         origin(:, part(e)) = mesh%coordinates(:, mesh%triangles(1, e))
      end do
      do e = 1, size(part)
         associate (p => part(e))
            do k = 1, 3
               open(p) = open(p) .or. edges%elements(2, edges%of_side(k, e)) == 0 ! junctions too
            end do
            area = sense(e)*twice_area_vector(mesh, e)
            x = mesh%coordinates(:, mesh%triangles(:, e))
            balance(p) = balance(p) + sense(e)*norm2(area)
            volume(p) = volume(p) + dot_product(x(:, 1) - origin(:, p), area)
            if (.not. present(toward)) cycle
            distance = norm2(sum(x, dim=2)/3 - toward)
            if (distance >= nearest(p)) cycle
            nearest(p) = distance
            side(p) = dot_product(toward - x(:, 1), area)
         end associate
      end do
      turns = merge(balance < 0, volume < 0, open)
      if (present(toward)) turns = side < 0
   end subroutine decide
end module finshell_orientation
