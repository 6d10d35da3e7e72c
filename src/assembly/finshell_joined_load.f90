!> Loads that act between a few nodes which need not share an element: springs, bars, forces on edges. They are blocks in the
!> matrix (finshell_blocks) instead of elements.
module finshell_joined_load
   use finshell_acting_load, only: acting_load_t, displacements_only, with_rotations
   use finshell_assembly, only: assembly_t
   use finshell_blocks, only: blocks_t, new_blocks
   use finshell_equations, only: equations_t
   use finshell_factor, only: factor_at
   use finshell_freedoms, only: n_nodal, rx, rz, uz
   use finshell_kinds, only: wp
   use finshell_rotation, only: cross_product
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: joined_load_t

   !> `evaluate` gives (rows, blocks), rows being 3 or 6 of each node; all blocks have as many nodes.
   type, abstract, extends(acting_load_t) :: joined_load_t
      type(blocks_t) :: blocks
      integer :: nodes = 2 !< of a block
      logical :: in_matrix = .true. !< of a team, one member has them in its part of the matrix
   contains
      procedure :: join
      procedure :: count => count_blocks
      procedure :: node
      procedure :: position
      procedure :: add
      procedure :: add_force
      procedure :: place
      procedure :: add_change
      procedure :: keep
   end type joined_load_t

contains

   !> Act on these nodes, (nodes of a block, blocks).
   pure subroutine join(self, equations, list, turns)
      class(joined_load_t), intent(inout) :: self
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: list(:, :)
      logical, intent(in) :: turns !< rotations, too
      integer :: i
      self%nodes = size(list, 1)
      self%rows = merge(with_rotations, displacements_only, turns)
      allocate (self%elements(0))
      call new_blocks(self%blocks, equations, [(1 + i*self%nodes, i=0, size(list, 2))], reshape(list, [size(list)]), &
                      merge(n_nodal, uz, turns))
   end subroutine join

   pure integer function count_blocks(self)
      class(joined_load_t), intent(in) :: self
      count_blocks = self%blocks%count()
   end function count_blocks

   !> Node i of block b.
   pure integer function node(self, i, b)
      class(joined_load_t), intent(in) :: self
      integer, intent(in) :: i, b
      node = self%blocks%node(self%nodes*(b - 1) + i)
   end function node

   !> Where it is.
   pure function position(self, i, b, structure, state) result(x)
      class(joined_load_t), intent(in) :: self
      integer, intent(in) :: i, b
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp) :: x(3)
      integer :: at
      at = self%node(i, b)
      x = structure%mesh%coordinates(:, at) + state%displacement(:, at)
   end function position

   !> See finshell_acting_load.
   subroutine add(self, structure, equations, state, assembly, unit_force, values)
      class(joined_load_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      type(assembly_t), intent(in) :: assembly
      real(wp), intent(inout) :: unit_force(:, :, :)
      real(wp), intent(inout), optional :: values(:)
      real(wp), allocatable :: force(:, :), stiffness(:, :, :)
      real(wp) :: factor
      integer :: b
      if (assembly%elements < 0) return
      associate (rows => self%blocks%rows*self%nodes)
         allocate (force(rows, self%count()))
         factor = factor_at(state, self%scaling)
         if (present(values) .and. abs(factor) > 0 .and. self%in_matrix) then
            allocate (stiffness(rows, rows, self%count()))
            call self%evaluate(structure, equations, state, force, factor, stiffness)
            do b = 1, self%count()
               call self%blocks%add(b, -stiffness(:, :, b), values)
            end do
         else
            call self%evaluate(structure, equations, state, force)
         end if
      end associate
      call to_nodes(self, force, 1.0_wp, unit_force(:, :, self%scaling))
   end subroutine add

   !> See finshell_acting_load.
   subroutine add_force(self, structure, equations, state, assembly, total)
      class(joined_load_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      type(assembly_t), intent(in) :: assembly
      real(wp), intent(inout), contiguous :: total(:, :)
      real(wp), allocatable :: force(:, :)
      real(wp) :: factor
      factor = factor_at(state, self%scaling)
      if (assembly%elements < 0 .or. .not. abs(factor) > 0) return
      allocate (force(self%blocks%rows*self%nodes, self%count()))
      call self%evaluate(structure, equations, state, force)
      call to_nodes(self, force, factor, total)
   end subroutine add_force

   pure subroutine to_nodes(self, force, factor, total)
      class(joined_load_t), intent(in) :: self
      real(wp), intent(in) :: force(:, :), factor
      real(wp), intent(inout) :: total(:, :) !< (n_nodal, nodes) is added to
      integer :: b, i, m
      m = self%blocks%rows
      do b = 1, self%count()
         do i = 1, self%nodes
            associate (at => total(:m, self%node(i, b)))
               at = at + factor*force(m*(i - 1) + 1:m*i, b)
            end associate
         end do
      end do
   end subroutine to_nodes

   !> It has no elements to be found.
   subroutine place(self, assembly)
      class(joined_load_t), intent(inout) :: self
      type(assembly_t), intent(in) :: assembly
      if (assembly%elements < 0) self%rows = 0
   end subroutine place

   !> See finshell_acting_load.
   subroutine add_change(self, structure, equations, state, motion, change)
      class(joined_load_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: motion(:, :)
      real(wp), intent(inout) :: change(:, :)
      real(wp), allocatable :: force(:, :), stiffness(:, :, :), f(:, :), moved(:, :)
      real(wp) :: factor
      integer :: b, i, m
      factor = factor_at(state, self%scaling)
      if (.not. abs(factor) > 0) return
      m = self%blocks%rows
      associate (rows => m*self%nodes)
         allocate (force(rows, self%count()), stiffness(rows, rows, self%count()))
         call self%evaluate(structure, equations, state, force, factor, stiffness)
         do b = 1, self%count()
            moved = motion(:m, [(self%node(i, b), i=1, self%nodes)])
            f = reshape(matmul(stiffness(:, :, b), reshape(moved, [rows])), [m, self%nodes])
            do i = 1, self%nodes
               if (m == n_nodal) f(rx:rz, i) = f(rx:rz, i) &
                  - 0.5_wp*factor*cross_product(force(m*(i - 1) + rx:m*(i - 1) + rz, b), moved(rx:rz, i))
               associate (at => change(:m, self%node(i, b)))
                  at = at + f(:, i)
               end associate
            end do
         end do
      end associate
   end subroutine add_change

   !> Every member of a team acts through all blocks.
   subroutine keep(self, kept)
      class(joined_load_t), intent(inout) :: self
      logical, intent(in) :: kept(:)
      if (size(kept) > 0) self%elements = pack(self%elements, kept)
   end subroutine keep
end module finshell_joined_load
