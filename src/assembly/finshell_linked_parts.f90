!> Parts of a structure that springs and bars link: do they hold each other? A part is connected elements, or a node of no element.
!>
!> The rigid motions of all parts of a group meet in one matrix: what supports hold of each (finshell_mechanism), and what links
!> resist. Each link counts as a support does, however weak. Lines hold their ends along all directions: what hangs on them is held
!> when they are taut.
module finshell_linked_parts
   use finshell_acting_load, only: load_item_t
   use finshell_axis_spring, only: axis_spring_t
   use finshell_equations, only: equations_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_external, only: external_t, springs_t
   use finshell_factor, only: unscaled
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_joined_load, only: joined_load_t
   use finshell_kinds, only: wp
   use finshell_line_spring, only: line_spring_t, line_stiffness
   use finshell_mechanism, only: add_springs, check_mechanism, conditions_of_part, find_parts, name_free_motions, &
      name_mode, null_space
   use finshell_rotation, only: cross_product
   use finshell_state, only: state_t, new_state
   use finshell_status, only: status_singular_matrix
   use finshell_structure, only: structure_t
   use finshell_union_find, only: join, new_forest, root_of
   implicit none
   private
   public :: check_held, name_mode

   integer, parameter :: most = 40 !< parts of a group that are judged here; larger ones are left to the factorisation

   !> Links: nodes, 0 being the ground, and stiffness over their motions.
   type :: link_t
      integer :: node(2) = 0
      real(wp), allocatable :: stiffness(:, :) !< (n_nodal*ends, n_nodal*ends), of the order of 1
   end type link_t

contains

   !> Refuse rigid motions that nothing holds.
   subroutine check_held(structure, equations, external, error)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(external_t), intent(in) :: external
      type(error_t), allocatable, intent(out) :: error
      type(springs_t) :: springs
      springs = external%springs(structure, equations)
      call check_mechanism(structure%mesh, equations, error, springs, linked_nodes(structure, external))
      if (.not. allocated(error)) call check_links(structure, equations, external, springs, error)
   end subroutine check_held

   !> (nodes) Those of parts that have links.
   function linked_nodes(structure, external) result(linked)
      type(structure_t), intent(in) :: structure
      type(external_t), intent(in) :: external
      logical :: linked(size(structure%mesh%coordinates, 2))
      integer, allocatable :: part(:)
      logical, allocatable :: has(:)
      integer :: i, parts
      linked = .false.
      do i = 1, size(external%list)
         select type (load => external%list(i)%load)
         class is (joined_load_t)
            if (load%scaling == unscaled) linked(load%blocks%node) = .true.
         end select
      end do
      if (.not. any(linked)) return
      call find_parts(structure%mesh, part, parts)
      allocate (has(parts), source=.false.)
      do i = 1, size(part)
         if (linked(i) .and. part(i) > 0) has(part(i)) = .true.
      end do
      do i = 1, size(part)
         if (part(i) > 0) linked(i) = has(part(i))
      end do
   end function linked_nodes

   !> Raise an error that names the free rigid motions of a linked part, if there are any.
   subroutine check_links(structure, equations, external, springs, error)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(external_t), intent(in) :: external
      type(springs_t), intent(in) :: springs !< of elements to the ground
      type(error_t), allocatable, intent(out) :: error
      type(link_t), allocatable :: links(:)
      integer, allocatable :: part(:), root(:), members(:)
      logical, allocatable :: judged(:)
      integer :: i, p, parts
      call list_links(structure, equations, external, links)
      if (size(links) == 0) return
      call find_parts(structure%mesh, part, parts)
      do i = 1, size(part)
         if (part(i) > 0 .or. .not. any(equations%number(:, i) > 0)) cycle
         parts = parts + 1
         part(i) = parts
      end do
      root = new_forest(parts)
      allocate (judged(parts), source=.true.)
      do i = 1, size(links)
         associate (node => links(i)%node)
            do p = 1, 2
               if (node(p) == 0) cycle
               if (part(node(p)) > 0) judged(part(node(p))) = .false.
            end do
            if (any(node == 0)) cycle
            if (all(part(node) > 0)) call join(root, part(node(1)), part(node(2)))
         end associate
      end do
      do i = 1, parts
         if (judged(i)) cycle
         members = pack([(p, p=1, parts)], [(root_of(root, p) == root_of(root, i), p=1, parts)])
         judged(members) = .true.
         if (size(members) > most) cycle
         call judge(structure, equations, springs, links, part, members, error)
         if (allocated(error)) return
      end do
   end subroutine check_links

   !> The links of springs and bars, in the reference state.
   subroutine list_links(structure, equations, external, links)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(external_t), intent(in) :: external
      type(link_t), allocatable, intent(out) :: links(:)
      type(state_t) :: reference
      integer :: i, n
      n = 0
      do i = 1, size(external%list)
         n = n + blocks_of(external%list(i))
      end do
      allocate (links(n))
      if (n == 0) return
      call new_state(reference, size(structure%mesh%coordinates, 2))
      n = 0
      do i = 1, size(external%list)
         if (blocks_of(external%list(i)) == 0) cycle
         select type (load => external%list(i)%load)
         class is (joined_load_t)
            call add_links(load, structure, equations, reference, links(n + 1:n + load%count()))
            n = n + load%count()
         end select
      end do
   end subroutine list_links

   integer function blocks_of(item)
      type(load_item_t), intent(in) :: item
      blocks_of = 0
      select type (load => item%load)
      class is (joined_load_t)
         if (load%scaling == unscaled) blocks_of = load%count()
      end select
   end function blocks_of

   subroutine add_links(load, structure, equations, reference, links)
      class(joined_load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: reference
      type(link_t), intent(inout) :: links(:)
      real(wp), allocatable :: force(:, :), k(:, :, :)
      integer, allocatable :: at(:)
      integer :: b, i, j, m
      m = load%blocks%rows
      allocate (force(m*load%nodes, load%count()), k(m*load%nodes, m*load%nodes, load%count()))
      call load%evaluate(structure, equations, reference, force, 1.0_wp, k)
      at = [((n_nodal*(i - 1) + j, j=1, m), i=1, load%nodes)]
      do b = 1, load%count()
         links(b)%node(:load%nodes) = [(load%node(i, b), i=1, load%nodes)]
         allocate (links(b)%stiffness(n_nodal*load%nodes, n_nodal*load%nodes), source=0.0_wp)
         select type (load)
         class is (line_spring_t)
            links(b)%stiffness(at, at) = line_stiffness([1.0_wp, 0.0_wp, 0.0_wp], 1.0_wp, 1.0_wp, load%nodes)
         class is (axis_spring_t)
            ! a law that begins without stiffness, as a table may, holds nevertheless
            links(b)%stiffness(at, at) = -k(:, :, b)
            if (.not. any(abs(k(:, :, b)) > 0)) links(b)%stiffness(at, at) = &
               line_stiffness(load%connector%direction, 1.0_wp, 0.0_wp, load%nodes)
         class default
            links(b)%stiffness(at, at) = -k(:, :, b)
         end select
         if (any(abs(links(b)%stiffness) > 0)) links(b)%stiffness = links(b)%stiffness/maxval(abs(links(b)%stiffness))
      end do
   end subroutine add_links

   !> One group of parts.
   subroutine judge(structure, equations, springs, links, part, members, error)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(springs_t), intent(in) :: springs
      type(link_t), intent(in) :: links(:)
      integer, intent(in) :: part(:), members(:)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: conditions(n_nodal*size(members), n_nodal*size(members)), free(n_nodal*size(members), n_nodal*size(members))
      real(wp) :: centre(3, size(members)), sizes(size(members)), own(n_nodal, n_nodal), length, stiffest
      real(wp), allocatable :: rigid(:, :)
      character(len=:), allocatable :: names, whose
      integer :: at(size(members)), count, e, first, i, j, m, node

      m = size(members)
      conditions = 0
      do i = 1, m
         first = findloc(part, members(i), 1)
         at(i) = first
         if (is_loose(first)) then
            centre(:, i) = structure%mesh%coordinates(:, first)
            sizes(i) = 1
            own = 0
            if (.not. any(equations%number(rx:rz, first) > 0)) own = identity_of_rotations()
         else
            call conditions_of_part(structure%mesh, equations, part, members(i), centre(:, i), sizes(i), own)
         end if
         conditions(at_part(i, 1):at_part(i, n_nodal), at_part(i, 1):at_part(i, n_nodal)) = own
      end do
      do i = 1, m
         if (is_loose(at(i))) call hold_loose(i)
      end do
      length = maxval(sizes)
      stiffest = max(maxval(abs(springs%stiffness)), tiny(1.0_wp))
      do e = 1, size(springs%elements)
         associate (nodes => structure%mesh%triangles(:, springs%elements(e)))
            i = findloc(members, part(nodes(1)), 1)
            if (i == 0) cycle
            associate (mine => conditions(at_part(i, 1):at_part(i, n_nodal), at_part(i, 1):at_part(i, n_nodal)))
               own = mine
               call add_springs(structure%mesh%coordinates(:, nodes), springs%stiffness(:, :, e)/stiffest, centre(:, i), sizes(i), &
                                own)
               mine = own
            end associate
         end associate
      end do
      do i = 1, size(links)
         if (.not. concerns(links(i))) cycle
         allocate (rigid(size(links(i)%stiffness, 1), n_nodal*m), source=0.0_wp)
         do e = 1, size(rigid, 1)/n_nodal
            node = links(i)%node(e)
            j = findloc(members, part(node), 1)
            if (j > 0) rigid(n_nodal*(e - 1) + 1:n_nodal*e, at_part(j, 1):at_part(j, n_nodal)) = &
               motion_of(structure%mesh%coordinates(:, node) - centre(:, j), sizes(j), length)
         end do
         conditions = conditions + matmul(transpose(rigid), matmul(links(i)%stiffness, rigid))
         deallocate (rigid)
      end do
      call null_space(conditions, free, count)
      do i = 1, m
         if (count == 0) return
         own = complement(free(at_part(i, 1):at_part(i, n_nodal), :count))
         call name_free_motions(own, centre(:, i), sizes(i), names)
         if (names == '') cycle
         whose = 'the part with node '//text_of(at(i))
         if (is_loose(at(i))) whose = 'node '//text_of(at(i))//', which belongs to no element'
         call raise(error, status_singular_matrix, 'springs and bars leave a rigid-body motion free: '//names//' (of '//whose &
            //'); add supports or springs that prevent it')
         return
      end do

   contains

      pure integer function at_part(i, k)
         integer, intent(in) :: i, k
         at_part = n_nodal*(i - 1) + k
      end function at_part

      pure logical function is_loose(node)
         integer, intent(in) :: node
         is_loose = node > size(structure%mesh%coordinates, 2) - structure%mesh%loose
      end function is_loose

      pure function identity_of_rotations() result(held)
         real(wp) :: held(n_nodal, n_nodal)
         integer :: k
         held = 0
         do k = rx, rz
            held(k, k) = 1
         end do
      end function identity_of_rotations

      !> What supports hold of a node of no element.
      subroutine hold_loose(i)
         integer, intent(in) :: i
         real(wp) :: row(3)
         integer :: k, s
         s = equations%support_of(at(i))
         if (s == 0) return
         associate (mine => conditions(at_part(i, 1):at_part(i, n_nodal), at_part(i, 1):at_part(i, n_nodal)), &
                    support => equations%supported(s))
            do k = 1, support%displacements
               row = support%displacement_axes(:, k)
               mine(ux:uz, ux:uz) = mine(ux:uz, ux:uz) + spread(row, 2, 3)*spread(row, 1, 3)
            end do
            do k = 1, support%rotations
               row = support%rotation_axes(:, k)
               mine(rx:rz, rx:rz) = mine(rx:rz, rx:rz) + spread(row, 2, 3)*spread(row, 1, 3)
            end do
         end associate
      end subroutine hold_loose

      pure logical function concerns(link)
         type(link_t), intent(in) :: link
         integer :: k
         concerns = .false.
         do k = 1, 2
            if (link%node(k) > 0) concerns = concerns .or. any(members == part(link%node(k)))
         end do
      end function concerns
   end subroutine judge

   !> Displacement and rotation (times a length) of a point at an arm of a part, per (t, size * r).
   pure function motion_of(arm, size_of_part, length) result(rigid)
      real(wp), intent(in) :: arm(3), size_of_part, length
      real(wp) :: rigid(n_nodal, n_nodal), unit(3)
      integer :: k
      rigid = 0
      do k = 1, 3
         unit = 0
         unit(k) = 1
         rigid(ux:uz, k) = unit
         rigid(ux:uz, uz + k) = cross_product(unit, arm/size_of_part)
         rigid(uz + k, uz + k) = length/size_of_part
      end do
   end function motion_of

   !> The projection on what some vectors do not span.
   pure function complement(vectors) result(rest)
      real(wp), intent(in) :: vectors(:, :) !< (n_nodal, some)
      real(wp) :: rest(n_nodal, n_nodal), gram(n_nodal, n_nodal), basis(n_nodal, n_nodal)
      integer :: k, other
      gram = matmul(vectors, transpose(vectors))
      rest = 0
      if (.not. maxval(abs(gram)) > 1.0e-12_wp) then
         do k = 1, n_nodal
            rest(k, k) = 1
         end do
         return
      end if
      call null_space(gram/maxval(abs(gram)), basis, other)
      rest = matmul(basis(:, :other), transpose(basis(:, :other)))
   end function complement
end module finshell_linked_parts
