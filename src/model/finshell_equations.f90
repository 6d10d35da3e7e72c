!> Numbering of the unknowns: which components of which nodes have an equation, in which axes, and what the others are made to do.
!>
!> The components of a node are those of finshell_freedoms, in the axes of the node: the global ones, or the columns of
!> `frames(:, :, frame(node))`. Held components have no equation, and those that depend on others have none (finshell_links).
module finshell_equations
   use finshell_kinds, only: wp, i1
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_status, only: status_input_error
   use finshell_error, only: error_t, raise, text_of
   use finshell_factor, only: by_constant_factor
   use finshell_held_side, only: find_held_sides
   use finshell_joint, only: joints_t
   use finshell_link_builder, only: new_links
   use finshell_links, only: links_t
   use finshell_mesh, only: mesh_t, find_node_set, node_set_names
   use finshell_node_support, only: add_support
   use finshell_state, only: new_state, state_t
   use finshell_support, only: support_t, node_support_t, settle_axes
   implicit none
   private
   public :: equations_t, new_equations, gather, unknowns_of, scatter, free_part
   public :: field_displacement, field_rotation, field_pressure

   !> Pressures of chambers are unknowns beside those of the nodes.
   integer(i1), parameter :: field_displacement = 1_i1, field_rotation = 2_i1, field_pressure = 3_i1

   type :: equations_t
      integer :: n = 0 !< number of equations
      integer, allocatable :: number(:, :) !< (n_nodal, nodes) equation of each component, 0: held, or dependent
      integer(i1), allocatable :: field(:) !< (n) displacement or rotation
      integer, allocatable :: frame(:) !< (nodes) index into frames, 0: global axes
      real(wp), allocatable :: frames(:, :, :) !< (3, 3, :) orthonormal columns
      !> Nodes whose held components are moved, and by how much for factors of 1: global displacement and rotation vectors.
      integer, allocatable :: moved(:)
      real(wp), allocatable :: motion(:, :, :) !< (n_nodal, moved, factors) finshell_factor
      logical, allocatable :: turned(:) !< (moved) all three rotations are held: the vectors give the whole rotation
      !> Since supports changed (finshell_stage): rotations of all nodes (4, nodes) and factors when they did, from which those
      !> vectors count. Unallocated: from the reference.
      real(wp), allocatable :: anchor_rotation(:, :), anchor_factor(:)
      type(node_support_t), allocatable :: supported(:) !< what is held, by node (ascending), for messages and checks
      integer, allocatable :: support_of(:) !< (nodes) index into supported, 0: free
      type(links_t) :: links !< what depends on others
      integer, allocatable :: held(:, :) !< (3, elements) sides that supports hold; unallocated: none (finshell_held_side)
   end type equations_t

contains

   !> Number the unknowns of a mesh under its supports. Errors: unknown set, bad axes, contradictory supports.
   subroutine new_equations(self, mesh, supports, error, turns, factors, step, joints)
      type(equations_t), intent(out) :: self
      type(mesh_t), intent(in) :: mesh
      type(support_t), intent(in) :: supports(:)
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: turns(:) !< (nodes) whether a node has rotations: those of membranes alone have none
      integer, intent(in), optional :: factors !< that scale loads and supports (finshell_factor)
      integer, intent(in), optional :: step !< whose supports these are, the first by default
      type(joints_t), intent(in), optional :: joints
      real(wp) :: axes(3, 3)
      logical :: held(n_nodal), global
      integer :: nodes, i, k, frames, many, stage

      stage = 1
      if (present(step)) stage = step
      nodes = size(mesh%coordinates, 2)
      call merge_supports(self, mesh, supports, stage, error, joints)
      if (allocated(error)) return
      if (present(turns)) call refuse_rotations(self, turns, error)
      if (allocated(error)) return

      allocate (self%number(n_nodal, nodes), source=1)
      if (present(turns)) then
         do i = 1, nodes
            if (.not. turns(i)) self%number(rx:rz, i) = 0
         end do
      end if
      allocate (self%frame(nodes), source=0)
      allocate (self%frames(3, 3, size(self%supported)))
      frames = 0
      do i = 1, size(self%supported)
         call settle_axes(self%supported(i), axes, held, global, error)
         if (allocated(error)) return
         where (held) self%number(:, self%supported(i)%node) = 0
         if (global) cycle
         frames = frames + 1
         self%frames(:, :, frames) = axes
         self%frame(self%supported(i)%node) = frames
      end do
      self%frames = self%frames(:, :, :frames)
      many = by_constant_factor
      if (present(factors)) many = factors
      call find_motion(self, max(many, maxval(supports%scaling)))
      if (present(joints)) call new_links(self%links, joints, mesh, self%number, self%frame, self%moved, self%motion, error)
      if (allocated(error)) return

      allocate (self%field(count(self%number == 1)))
      do i = 1, nodes
         do k = 1, n_nodal
            if (self%number(k, i) == 0) cycle
            self%n = self%n + 1
            self%number(k, i) = self%n
            self%field(self%n) = merge(field_displacement, field_rotation, k <= uz)
         end do
      end do
      if (self%n == 0) then
         call raise(error, status_input_error, 'supports: every component of every node is held; nothing is left to solve for')
         return
      end if
      call refresh_links(self, nodes)
      call find_held_sides(mesh, self%supported, self%support_of, self%held)
   end subroutine new_equations

   !> Links as in the reference state.
   pure subroutine refresh_links(self, nodes)
      type(equations_t), intent(inout) :: self
      integer, intent(in) :: nodes
      type(state_t) :: reference
      call new_state(reference, nodes)
      call self%links%refresh(reference)
   end subroutine refresh_links

   !> Nodes of membranes alone have no rotations: a support that prescribes one there is an error. One that holds it is not, as
   !> planes of symmetry do; of rigid-body motions it says the same as for a shell.
   subroutine refuse_rotations(self, turns, error)
      type(equations_t), intent(in) :: self
      logical, intent(in) :: turns(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      do i = 1, size(self%supported)
         if (turns(self%supported(i)%node)) cycle
         if (moves(self%supported(i)%rotation_value)) then
            call raise(error, status_input_error, 'support: a rotation is prescribed at node '//text_of(self%supported(i)%node) &
               //', which has none: all its elements are membranes')
            return
         end if
      end do
   end subroutine refuse_rotations

   !> Collect the constraints of all supports, node by node. What holds a node that is where its master is holds the master.
   subroutine merge_supports(self, mesh, supports, step, error, joints)
      type(equations_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(support_t), intent(in) :: supports(:)
      integer, intent(in) :: step
      type(error_t), allocatable, intent(inout) :: error
      type(joints_t), intent(in), optional :: joints
      integer, allocatable :: set_of(:), bearer(:, :)
      integer :: s, i, node, nodes, found

      nodes = size(mesh%coordinates, 2)
      allocate (self%support_of(nodes), source=0)
      allocate (set_of(size(supports)))
      call find_bearers(nodes, bearer, joints)
      do s = 1, size(supports)
         set_of(s) = find_node_set(mesh, supports(s)%node_set)
         if (set_of(s) == 0) then
            call raise(error, status_input_error, "support: the mesh has no node set '"//supports(s)%node_set &
               //"'; it has: "//node_set_names(mesh))
            return
         end if
         if (.not. supports(s)%span%covers(step)) cycle
         do i = 1, 2
            self%support_of(bearer(i, mesh%node_sets(set_of(s))%members)) = 1
         end do
      end do
      allocate (self%supported(count(self%support_of > 0)))
      found = 0
      do node = 1, nodes
         if (self%support_of(node) == 0) cycle
         found = found + 1
         self%support_of(node) = found
         self%supported(found)%node = node
      end do
      do s = 1, size(supports)
         if (.not. supports(s)%span%covers(step)) cycle
         do i = 1, size(mesh%node_sets(set_of(s))%members)
            node = mesh%node_sets(set_of(s))%members(i)
            if (bearer(1, node) == bearer(2, node)) then
               call add_support(self%supported(self%support_of(bearer(1, node))), supports(s), mesh%coordinates(:, node), &
                                [.true., .true.], error)
            else
               call add_support(self%supported(self%support_of(bearer(1, node))), supports(s), mesh%coordinates(:, node), &
                                [.true., .false.], error)
               if (.not. allocated(error)) call add_support(self%supported(self%support_of(bearer(2, node))), supports(s), &
                                                            mesh%coordinates(:, node), [.false., .true.], error)
            end if
            if (.not. allocated(error)) cycle
            error%message = "support of '"//supports(s)%node_set//"': "//error%message
            return
         end do
      end do
      ! sides between nodes at one place are held alike
      do node = 1, nodes
         if (bearer(1, node) == bearer(2, node)) self%support_of(node) = self%support_of(bearer(1, node))
      end do
   end subroutine merge_supports

   !> (2, nodes) Nodes on which supports of a node act: of its displacement, of its rotation.
   pure subroutine find_bearers(nodes, bearer, joints)
      integer, intent(in) :: nodes
      integer, allocatable, intent(out) :: bearer(:, :)
      type(joints_t), intent(in), optional :: joints
      integer :: i, j, part, steps
      allocate (bearer(2, nodes))
      bearer = spread([(i, i=1, nodes)], 1, 2)
      if (.not. present(joints)) return
      do j = 1, size(joints%list)
         associate (joint => joints%list(j))
            if (joint%masters > 1 .or. joint%on_arm) cycle
            bearer(1, joint%node) = joint%master(1)
            if (joint%turns) bearer(2, joint%node) = joint%master(1)
         end associate
      end do
      do part = 1, 2
         do i = 1, nodes
            do steps = 1, size(joints%list) ! a circle is refused later
               if (bearer(part, i) == bearer(part, bearer(part, i))) exit
               bearer(part, i) = bearer(part, bearer(part, i))
            end do
         end do
      end do
   end subroutine find_bearers

   !> List the nodes whose held components are moved.
   subroutine find_motion(self, factors)
      type(equations_t), intent(inout) :: self
      integer, intent(in) :: factors
      logical, allocatable :: moved(:)
      integer :: i, k
      moved = [(moves(self%supported(i)%displacement_value) .or. moves(self%supported(i)%rotation_value), &
                i=1, size(self%supported))]
      allocate (self%moved(count(moved)), self%turned(count(moved)))
      allocate (self%motion(n_nodal, count(moved), factors), source=0.0_wp)
      k = 0
      do i = 1, size(self%supported)
         if (.not. moved(i)) cycle
         k = k + 1
         associate (s => self%supported(i))
            self%moved(k) = s%node
            if (allocated(s%displacement_value)) &
               self%motion(ux:uz, k, :size(s%displacement_value, 2)) = s%displacement_value
            if (allocated(s%rotation_value)) self%motion(rx:rz, k, :size(s%rotation_value, 2)) = s%rotation_value
            self%turned(k) = s%rotations == 3
         end associate
      end do
   end subroutine find_motion

   pure logical function moves(values)
      real(wp), allocatable, intent(in) :: values(:, :)
      moves = .false.
      if (allocated(values)) moves = any(abs(values) > 0)
   end function moves

   !> Nodal forces (n_nodal, nodes), global, to the equations: those on dependent components go to what these depend on.
   pure subroutine gather(self, nodal, x)
      type(equations_t), intent(in) :: self
      real(wp), intent(in) :: nodal(:, :)
      real(wp), intent(out) :: x(:) !< (n)
      if (self%links%any()) then
         call unknowns_of(self, self%links%folded(nodal), x)
      else
         call unknowns_of(self, nodal, x)
      end if
   end subroutine gather

   !> Nodal motions to the equations: components in node axes, held and dependent ones left out.
   pure subroutine unknowns_of(self, nodal, x)
      type(equations_t), intent(in) :: self
      real(wp), intent(in) :: nodal(:, :)
      real(wp), intent(out) :: x(:) !< (n)
      real(wp) :: local(n_nodal)
      integer :: i, k
      do i = 1, size(self%number, 2)
         local = nodal(:, i)
         if (self%frame(i) > 0) then
            local(ux:uz) = matmul(nodal(ux:uz, i), self%frames(:, :, self%frame(i)))
            local(rx:rz) = matmul(nodal(rx:rz, i), self%frames(:, :, self%frame(i)))
         end if
         do k = 1, n_nodal
            if (self%number(k, i) > 0) x(self%number(k, i)) = local(k)
         end do
      end do
   end subroutine unknowns_of

   !> Equations to nodal motions (n_nodal, nodes), global: held components are zero.
   pure subroutine scatter(self, x, nodal)
      type(equations_t), intent(in) :: self
      real(wp), intent(in) :: x(:) !< (n)
      real(wp), intent(out) :: nodal(:, :)
      real(wp) :: local(n_nodal)
      integer :: i, k
      do i = 1, size(self%number, 2)
         local = 0
         do k = 1, n_nodal
            if (self%number(k, i) > 0) local(k) = x(self%number(k, i))
         end do
         nodal(:, i) = local
         if (self%frame(i) > 0) then
            nodal(ux:uz, i) = matmul(self%frames(:, :, self%frame(i)), local(ux:uz))
            nodal(rx:rz, i) = matmul(self%frames(:, :, self%frame(i)), local(rx:rz))
         end if
      end do
      call self%links%extend(nodal)
   end subroutine scatter

   !> Nodal vectors (n_nodal, nodes) without their held components; dependent ones stay as they are.
   pure function free_part(self, nodal) result(free)
      type(equations_t), intent(in) :: self
      real(wp), intent(in) :: nodal(:, :)
      real(wp) :: free(n_nodal, size(nodal, 2))
      real(wp) :: x(self%n)
      call unknowns_of(self, nodal, x)
      call scatter(self, x, free)
      if (self%links%any()) free = merge(nodal, free, self%links%row > 0)
   end function free_part
end module finshell_equations
