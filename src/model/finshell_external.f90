!> External forces of a structure: dead nodal forces, summed up once, and follower pressures, evaluated on the deformed surface.
!>
!> Dead distributed loads are lumped consistently with the linear interpolation of the translations: a third of an
!> element's load to each of its nodes, half of an edge's. Loads on edges also work on the bulge of the sides, which depends on
!> the drilling rotations: that part follows the deformation (finshell_line_load).
module finshell_external
   use finshell_kinds, only: wp, i4, i8
   use finshell_status, only: status_input_error, status_invalid_argument
   use finshell_error, only: error_t, raise, text_of
   use finshell_mesh, only: mesh_t, find_node_set, find_element_set, find_edge_set, &
      node_set_names, element_set_names, edge_set_names
   use finshell_mesh_sorting, only: sorted_order, position_in_sorted
   use finshell_structure, only: structure_t, curved_elements, is_membrane
   use finshell_equations, only: equations_t
   use finshell_batch, only: side_free
   use finshell_load, only: load_t, load_nodal, load_edge, load_traction, load_gravity, load_pressure, &
      pressure_automatic, pressure_symmetric, pressure_unsymmetric
   use finshell_pressure_region, only: symmetric_origin
   implicit none
   private
   public :: external_t, pressure_t, side_load_t, new_external

   type :: pressure_t
      integer, allocatable :: elements(:)
      integer, allocatable :: curved(:) !< those of them with a curved reference: the pressure acts on their caps, too
      real(wp) :: pressure = 0 !< for a factor of 1
      integer :: scaling = 1 !< 1: with the load factor, 2: with the constant factor
      logical :: symmetric = .false. !< the load stiffness is symmetric when assembled
      real(wp) :: origin(3) = 0 !< of the enclosed volume
   end type pressure_t

   !> A dead load on a side of an element that can bulge.
   type :: side_load_t
      integer :: element = 0
      integer :: corners(3) = 0 !< ends of the side and the third node, as corners of the element, counter-clockwise
      integer :: scaling = 1 !< as in pressure_t
      real(wp) :: vector(3) = 0 !< force per reference length, for a factor of 1
      real(wp) :: length = 0 !< reference length, or this element's share of it
      real(wp) :: direction(3) = 0 !< of the side, reference
   end type side_load_t

   type :: external_t
      real(wp), allocatable :: dead(:, :, :) !< (6, nodes, 2) forces and moments: proportional, constant
      type(pressure_t), allocatable :: pressures(:)
      type(side_load_t), allocatable :: sides(:)
      !> Nodes with dead moments that are free to turn about two axes or more, and an element and its corner at each: such a
      !> moment is not conservative and has an unsymmetric stiffness.
      integer, allocatable :: turning_nodes(:), turning_elements(:), turning_corners(:)
      logical :: bulges = .false. !< loads act on bulges of sides, or on caps
      logical :: symmetric = .true. !< all load stiffnesses are symmetric
      logical :: has_constants = .false.
   end type external_t

contains

   !> Sum up the loads of a structure. Errors: unknown set, no density, unknown kind.
   subroutine new_external(self, structure, equations, error)
      type(external_t), intent(out) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(error_t), allocatable, intent(out) :: error
      integer :: i, at, pressures

      allocate (self%dead(6, size(structure%mesh%coordinates, 2), 2), source=0.0_wp)
      pressures = 0
      allocate (self%sides(0))
      if (.not. allocated(structure%loads)) then
         allocate (self%pressures(0), self%turning_nodes(0), self%turning_elements(0), self%turning_corners(0))
         return
      end if
      allocate (self%pressures(count(structure%loads%kind == load_pressure)))
      do i = 1, size(structure%loads)
         associate (load => structure%loads(i), mesh => structure%mesh)
            if (load%constant) self%has_constants = .true.
            select case (load%kind)
            case (load_nodal)
               at = find_node_set(mesh, load%set)
               if (at == 0) call unknown('node', load%set, node_set_names(mesh), error)
               if (at > 0) call add_nodal(self%dead, load, mesh%node_sets(at)%members)
            case (load_edge)
               at = find_edge_set(mesh, load%set)
               if (at == 0) call unknown('edge', load%set, edge_set_names(mesh), error)
               if (at > 0) call add_edge(self%dead, load, mesh, mesh%edge_sets(at)%edges)
               if (at > 0) call add_sides(self%sides, load, mesh, mesh%edge_sets(at)%edges, equations%held)
            case (load_traction, load_gravity)
               at = find_element_set(mesh, load%set)
               if (at == 0) call unknown('element', load%set, element_set_names(mesh), error)
               if (at > 0) call add_area(self%dead, load, structure, mesh%element_sets(at)%members, error)
            case (load_pressure)
               at = find_element_set(mesh, load%set)
               if (at == 0) call unknown('element', load%set, element_set_names(mesh), error)
               pressures = pressures + 1
               if (at > 0) call add_pressure(self, self%pressures(pressures), load, structure, mesh%element_sets(at)%members, &
                                             equations, error)
            case default
               call raise(error, status_invalid_argument, 'load: unknown kind '//text_of(load%kind))
            end select
         end associate
         if (allocated(error)) return
      end do
      if (any(structure%sections%membrane)) self%sides = pack(self%sides, .not. is_membrane(structure, self%sides%element))
      self%bulges = size(self%sides) > 0
      do i = 1, size(self%pressures)
         self%bulges = self%bulges .or. size(self%pressures(i)%curved) > 0
      end do
      call find_turning(self, structure%mesh, equations)
      if (size(self%turning_nodes) > 0) self%symmetric = .false.
   end subroutine new_external

   !> List the nodes whose dead moments have a stiffness.
   pure subroutine find_turning(self, mesh, equations)
      type(external_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      integer, allocatable :: at(:)
      integer :: e, i, k, node
      allocate (at(size(mesh%coordinates, 2)), source=0)
      do i = 1, size(at)
         if (any(abs(self%dead(4:6, i, :)) > 0) .and. count(equations%number(4:6, i) > 0) >= 2) at(i) = 1
      end do
      self%turning_nodes = pack([(i, i=1, size(at))], at > 0)
      allocate (self%turning_elements(size(self%turning_nodes)), self%turning_corners(size(self%turning_nodes)), source=0)
      do i = 1, size(self%turning_nodes)
         at(self%turning_nodes(i)) = i
      end do
      do e = 1, size(mesh%triangles, 2)
         do k = 1, 3
            node = mesh%triangles(k, e)
            if (at(node) == 0) cycle
            self%turning_elements(at(node)) = e
            self%turning_corners(at(node)) = k
         end do
      end do
   end subroutine find_turning

   subroutine unknown(what, set, names, error)
      character(len=*), intent(in) :: what, set, names
      type(error_t), allocatable, intent(inout) :: error
      call raise(error, status_input_error, 'load: the mesh has no '//what//" set '"//set//"'; it has: "//names)
   end subroutine unknown

   pure integer function column_of(load)
      type(load_t), intent(in) :: load
      column_of = merge(2, 1, load%constant)
   end function column_of

   pure subroutine add_nodal(dead, load, nodes)
      real(wp), intent(inout) :: dead(:, :, :)
      type(load_t), intent(in) :: load
      integer, intent(in) :: nodes(:)
      real(wp) :: share
      integer :: i
      share = 1
      if (load%total) share = 1.0_wp/size(nodes)
      do i = 1, size(nodes)
         dead(1:3, nodes(i), column_of(load)) = dead(1:3, nodes(i), column_of(load)) + share*load%vector
         dead(4:6, nodes(i), column_of(load)) = dead(4:6, nodes(i), column_of(load)) + share*load%moment
      end do
   end subroutine add_nodal

   pure subroutine add_edge(dead, load, mesh, edges)
      real(wp), intent(inout) :: dead(:, :, :)
      type(load_t), intent(in) :: load
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: edges(:, :)
      real(wp) :: length
      integer :: i, k
      do i = 1, size(edges, 2)
         length = norm2(mesh%coordinates(:, edges(2, i)) - mesh%coordinates(:, edges(1, i)))
         do k = 1, 2
            associate (force => dead(1:3, edges(k, i), column_of(load)))
               force = force + 0.5_wp*length*load%vector
            end associate
         end do
      end do
   end subroutine add_edge

   !> The sides of elements that lie on edges, but those that supports keep straight.
   pure subroutine add_sides(sides, load, mesh, edges, held)
      type(side_load_t), allocatable, intent(inout) :: sides(:)
      type(load_t), intent(in) :: load
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: edges(:, :)
      integer, intent(in), optional :: held(:, :) !< (3, elements)
      type(side_load_t), allocatable :: found(:)
      integer(i8) :: key(size(edges, 2))
      integer :: shared(size(edges, 2)), at(3*size(mesh%triangles, 2)), e, i, k, n
      logical :: marked(size(mesh%coordinates, 2))

      marked = .false.
      do i = 1, size(edges, 2)
         marked(edges(:, i)) = .true.
         key(i) = edge_key(edges(:, i))
      end do
      key = key(sorted_order(key))
      shared = 0
      n = 0
      do e = 1, size(mesh%triangles, 2)
         do k = 1, 3
            n = n + 1
            at(n) = 0
            if (.not. all(marked(mesh%triangles([k, 1 + mod(k, 3)], e)))) cycle
            at(n) = position_in_sorted(key, edge_key(mesh%triangles([k, 1 + mod(k, 3)], e)))
            if (at(n) > 0) shared(at(n)) = shared(at(n)) + 1
         end do
      end do
      allocate (found(count(at > 0)))
      i = 0
      do n = 1, size(at)
         if (at(n) == 0) cycle
         e = (n + 2)/3
         k = n - 3*(e - 1)
         if (present(held)) then
            if (held(k, e) /= side_free) cycle
         end if
         i = i + 1
         found(i)%element = e
         found(i)%corners = [k, 1 + mod(k, 3), 1 + mod(k + 1, 3)]
         found(i)%scaling = column_of(load)
         found(i)%vector = load%vector
         found(i)%direction = mesh%coordinates(:, mesh%triangles(1 + mod(k, 3), e)) - mesh%coordinates(:, mesh%triangles(k, e))
         found(i)%length = norm2(found(i)%direction)
         found(i)%direction = found(i)%direction/found(i)%length
         found(i)%length = found(i)%length/shared(at(n))
      end do
      sides = [sides, found(:i)]

   contains

      pure integer(i8) function edge_key(nodes)
         integer, intent(in) :: nodes(2)
         edge_key = int(minval(nodes), i8)*(size(mesh%coordinates, 2) + 1_i8) + maxval(nodes)
      end function edge_key
   end subroutine add_sides

   subroutine add_area(dead, load, structure, elements, error)
      real(wp), intent(inout) :: dead(:, :, :)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: elements(:)
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: a(3), b(3), area, per_area(3)
      integer :: i, k, section
      if (load%kind == load_gravity .and. .not. allocated(structure%density)) then
         call raise(error, status_input_error, "load: gravity on '"//load%set//"' needs the density of its section")
         return
      end if
      do i = 1, size(elements)
         associate (nodes => structure%mesh%triangles(:, elements(i)), x => structure%mesh%coordinates)
            a = x(:, nodes(2)) - x(:, nodes(1))
            b = x(:, nodes(3)) - x(:, nodes(1))
            area = 0.5_wp*norm2([a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)])
            per_area = load%vector
            if (load%kind == load_gravity) then
               section = structure%element_section(elements(i))
               if (.not. structure%density(section) > 0) then
                  call raise(error, status_input_error, "load: gravity on '"//load%set//"' acts on section "//text_of(section) &
                     //', whose density is not positive')
                  return
               end if
               per_area = structure%density(section)*structure%sections(section)%thickness*load%vector
            end if
            do k = 1, 3
               associate (force => dead(1:3, nodes(k), column_of(load)))
                  force = force + area/3*per_area
               end associate
            end do
         end associate
      end do
   end subroutine add_area

   subroutine add_pressure(self, pressure, load, structure, elements, equations, error)
      type(external_t), intent(inout) :: self
      type(pressure_t), intent(inout) :: pressure
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: elements(:)
      type(equations_t), intent(in) :: equations
      type(error_t), allocatable, intent(inout) :: error
      logical :: valid
      real(wp) :: origin(3)
      pressure%elements = elements
      pressure%curved = curved_elements(structure, elements)
      pressure%pressure = load%pressure
      pressure%scaling = column_of(load)
      call symmetric_origin(structure%mesh, equations, elements, valid, origin)
      if (valid) pressure%origin = origin
      select case (load%stiffness)
      case (pressure_symmetric)
         pressure%symmetric = .true.
         if (.not. valid) call raise(error, status_input_error, "load: the pressure on '"//load%set//"' has no symmetric " &
            //'stiffness: part of the boundary of the set is neither fixed nor in a plane of symmetry; ' &
            //'use automatic or unsymmetric')
      case (pressure_unsymmetric)
         pressure%symmetric = .false.
      case default
         pressure%symmetric = valid
      end select
      if (.not. pressure%symmetric) self%symmetric = .false.
   end subroutine add_pressure
end module finshell_external
