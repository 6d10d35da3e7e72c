!> The groups &node_set and &element_set of an input file.
module finshell_input_sets
   use finshell_kinds, only: wp, dp
   use finshell_error, only: error_t, text_of
   use finshell_lineage, only: children_of, inherited_by_place, inherited_nodes
   use finshell_mesh, only: mesh_t, add_node_set, add_element_set, find_node_set, find_element_set, mesh_size
   use finshell_namelist, only: group_t, get, has, check_all_used, complain_about
   use finshell_input_common, only: get_sets, get_vector, in_element_sets, in_node_sets, kind_node, kind_element
   implicit none
   private
   public :: read_node_set, read_element_set

contains

   !> &node_set: nodes by place, by number, of other sets or of element sets, joined.
   subroutine read_node_set(group, mesh, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(inout) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name, sets(:)
      integer, allocatable :: numbers(:)
      logical, allocatable :: chosen(:), numbered(:)
      real(wp) :: tolerance, point(3)
      integer :: i, e, n, nearest
      logical :: by_place

      if (allocated(error)) return
      ! of a refined mesh, places and numbers are those of the mesh before, whose nodes come first
      n = size(mesh%coordinates, 2)
      if (allocated(mesh%lineage)) n = mesh%lineage%nodes
      allocate (chosen(n), numbered(n), source=.false.)
      call get(group, 'name', name, error)
      call get(group, 'tolerance', tolerance, error, default=1.0e-6_wp*mesh_size(mesh), minimum=0.0_wp)
      call choose_by_place(group, mesh%coordinates(:, :n), tolerance, chosen, by_place, error)
      call get_vector(group, 'point', point, error, default=[0.0_wp, 0.0_wp, 0.0_wp])
      if (has(group, 'point') .and. .not. allocated(error)) then
         nearest = minloc(norm2(mesh%coordinates(:, :n) - spread(point, 2, n), dim=1), dim=1)
         associate (x => mesh%coordinates(:, nearest))
            if (norm2(x - point) > tolerance) then
               call complain_about(group, 'point', 'no node lies within '//text_of(real(tolerance, dp)) &
                  //' (tolerance); the nearest is node '//text_of(nearest)//' at '//text_of(real(x(1), dp))//', ' &
                  //text_of(real(x(2), dp))//', '//text_of(real(x(3), dp)), error)
            end if
         end associate
      end if
      call get(group, 'nodes', numbers, error, minimum=1, maximum=n)
      if (.not. allocated(error)) numbered(numbers) = .true.
      if (allocated(mesh%lineage)) then
         chosen = inherited_by_place(mesh%lineage, chosen) .or. inherited_nodes(mesh%lineage, numbered)
      else
         chosen = chosen .or. numbered
      end if
      if (has(group, 'point') .and. .not. allocated(error)) chosen(nearest) = .true.
      call get_sets(group, kind_node, mesh, sets, error, required=.false.)
      if (.not. allocated(error)) chosen = chosen .or. in_node_sets(mesh, sets)
      call get_sets(group, kind_element, mesh, sets, error, required=.false.)
      do i = 1, size(sets)
         if (allocated(error)) return
         associate (elements => mesh%element_sets(find_element_set(mesh, trim(sets(i))))%members)
            do e = 1, size(elements)
               chosen(mesh%triangles(:, elements(e))) = .true.
            end do
         end associate
      end do
      call check_new_set(group, name, find_node_set(mesh, name), chosen, error)
      if (allocated(error)) return
      call add_node_set(mesh, name, pack([(i, i=1, size(chosen))], chosen))
   end subroutine read_node_set

   !> &element_set: elements by the place of their centroid, by number or of other sets, joined.
   subroutine read_element_set(group, mesh, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(inout) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name, sets(:)
      integer, allocatable :: numbers(:)
      logical, allocatable :: chosen(:)
      real(wp), allocatable :: centroids(:, :)
      real(wp) :: tolerance
      integer, allocatable :: triangles(:, :)
      integer :: i
      logical :: by_place

      if (allocated(error)) return
      triangles = mesh%triangles
      if (allocated(mesh%lineage)) triangles = mesh%lineage%triangles
      allocate (chosen(size(triangles, 2)), source=.false.)
      allocate (centroids(3, size(chosen)))
      do i = 1, size(chosen)
         centroids(:, i) = sum(mesh%coordinates(:, triangles(:, i)), dim=2)/3
      end do
      call get(group, 'name', name, error)
      call get(group, 'tolerance', tolerance, error, default=1.0e-6_wp*mesh_size(mesh), minimum=0.0_wp)
      call choose_by_place(group, centroids, tolerance, chosen, by_place, error)
      call get(group, 'elements', numbers, error, minimum=1, maximum=size(chosen))
      if (.not. allocated(error)) chosen(numbers) = .true.
      if (allocated(mesh%lineage)) then
         numbers = children_of(mesh%lineage, pack([(i, i=1, size(chosen))], chosen))
         deallocate (chosen)
         allocate (chosen(size(mesh%triangles, 2)), source=.false.)
         chosen(numbers) = .true.
      end if
      call get_sets(group, kind_element, mesh, sets, error, required=.false.)
      if (.not. allocated(error)) chosen = chosen .or. in_element_sets(mesh, sets)
      call check_new_set(group, name, find_element_set(mesh, name), chosen, error)
      if (allocated(error)) return
      call add_element_set(mesh, name, pack([(i, i=1, size(chosen))], chosen))
   end subroutine read_element_set

   !> Keys x, y, z: one value (a plane) or two (a range); plane_point and plane_normal: the side of a plane that the normal points
   !> to. All that are given must hold.
   subroutine choose_by_place(group, positions, tolerance, chosen, by_place, error)
      type(group_t), intent(inout) :: group
      real(wp), intent(in) :: positions(:, :)
      real(wp), intent(in) :: tolerance
      logical, intent(inout) :: chosen(:)
      logical, intent(out) :: by_place !< one of the keys is given
      type(error_t), allocatable, intent(inout) :: error
      character, parameter :: axes(3) = ['x', 'y', 'z']
      real(wp), allocatable :: range(:)
      logical :: inside(size(chosen))
      real(wp) :: point(3), normal(3)
      integer :: i, k

      inside = .true.
      by_place = .false.
      do k = 1, 3
         call get(group, axes(k), range, error)
         if (allocated(error)) return
         if (size(range) == 0) cycle
         by_place = .true.
         if (size(range) > 2) then
            call complain_about(group, axes(k), 'one value or a range of two is expected', error)
            return
         end if
         inside = inside .and. positions(k, :) >= range(1) - tolerance .and. positions(k, :) <= range(size(range)) + tolerance
      end do
      if (has(group, 'plane_point') .or. has(group, 'plane_normal')) then
         call get_vector(group, 'plane_point', point, error)
         call get_vector(group, 'plane_normal', normal, error, nonzero=.true.)
         if (allocated(error)) return
         by_place = .true.
         normal = normal/norm2(normal)
         inside = inside .and. [(dot_product(positions(:, i) - point, normal) >= -tolerance, i=1, size(inside))]
      end if
      if (by_place) chosen = chosen .or. inside
   end subroutine choose_by_place

   subroutine check_new_set(group, name, existing, chosen, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: name
      integer, intent(in) :: existing !< position of a set of that name, or 0
      logical, intent(in) :: chosen(:)
      type(error_t), allocatable, intent(inout) :: error

      call check_all_used(group, error)
      if (allocated(error)) return
      if (name == '') then
         call complain_about(group, 'name', 'the name is empty', error)
      else if (existing > 0) then
         call complain_about(group, 'name', "there is already a set named '"//name//"'", error)
      else if (.not. any(chosen)) then
         call complain_about(group, '', "the set '"//name//"' is empty", error)
      end if
   end subroutine check_new_set
end module finshell_input_sets
