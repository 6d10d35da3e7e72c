!> What springs and bars are to the rigid motions of the parts that they link (finshell_mechanism). Each counts as a support does,
!> however weak. Lines hold their ends along all directions: what hangs on them is held when they are taut.
module finshell_linked_parts
   use finshell_acting_load, only: load_item_t
   use finshell_axis_spring, only: axis_spring_t
   use finshell_equations, only: equations_t
   use finshell_error, only: error_t
   use finshell_external, only: external_t
   use finshell_factor, only: unscaled
   use finshell_freedoms, only: n_nodal
   use finshell_ground_springs, only: ground_springs
   use finshell_joined_load, only: joined_load_t
   use finshell_joined_parts, only: part_link_t
   use finshell_kinds, only: wp
   use finshell_line_spring, only: line_spring_t, line_stiffness
   use finshell_mechanism, only: check_mechanism, name_mode
   use finshell_state, only: state_t, new_state
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: check_held, name_mode

contains

   !> Refuse rigid motions that nothing holds.
   subroutine check_held(structure, equations, external, error)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(external_t), intent(in) :: external
      type(error_t), allocatable, intent(out) :: error
      type(part_link_t), allocatable :: links(:)
      call list_links(structure, equations, external, links)
      call check_mechanism(structure%mesh, equations, error, ground_springs(external%list, structure, equations), links)
   end subroutine check_held

   !> The links of springs and bars, in the reference state.
   subroutine list_links(structure, equations, external, links)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(external_t), intent(in) :: external
      type(part_link_t), allocatable, intent(out) :: links(:)
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
      type(part_link_t), intent(inout) :: links(:)
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
end module finshell_linked_parts
