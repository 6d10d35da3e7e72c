!> Blocks: matrices over the motion of a few nodes each, which need not belong to one element, in the matrix of the structure.
!> Springs and bars between nodes are blocks; so is every element whose nodes depend on others.
!>
!> A block is given in global axes. Its rows become those of the unknowns on which its nodes depend: T^T K T with T from
!> finshell_component.
module finshell_blocks
   use finshell_cliques, only: cliques_t
   use finshell_component, only: expand_component, most_unknowns
   use finshell_equations, only: equations_t
   use finshell_kinds, only: wp, i4
   use finshell_sparsity, only: sparsity_t
   implicit none
   private
   public :: blocks_t, new_blocks

   type :: blocks_t
      integer :: rows = 0 !< components of a node: 3 displacements, or with rotations 6
      integer, allocatable :: first(:) !< (blocks + 1) block b has the nodes node(first(b)) .. node(first(b + 1) - 1)
      integer, allocatable :: node(:)
      type(cliques_t) :: equations !< a clique each
      integer, allocatable, private :: first_factor(:), first_place(:) ! (blocks + 1)
      real(wp), allocatable, private :: factor(:) ! T of each block, by columns
      integer(i4), allocatable, private :: place(:) ! of each entry in the values: lower triangle by columns, or all
      logical, private :: symmetric = .true.
   contains
      procedure :: count => count_blocks
      procedure :: expand
      procedure :: find_places
      procedure :: add
   end type blocks_t

contains

   !> Blocks over the first `rows` components of lists of nodes.
   pure subroutine new_blocks(self, equations, first, node, rows)
      type(blocks_t), intent(out) :: self
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: first(:), node(:), rows !< see blocks_t
      self%rows = rows
      self%first = first
      self%node = node
      call self%expand(equations)
   end subroutine new_blocks

   pure integer function count_blocks(self)
      class(blocks_t), intent(in) :: self
      count_blocks = 0
      if (allocated(self%first)) count_blocks = size(self%first) - 1
   end function count_blocks

   !> Find the unknowns of each block and T. To be called again when what T says has changed: the unknowns are the same.
   pure subroutine expand(self, equations)
      class(blocks_t), intent(inout) :: self
      type(equations_t), intent(in) :: equations
      integer, allocatable :: known(:)
      real(wp), allocatable :: t(:, :), factors(:)
      integer(i4), allocatable :: list(:)
      integer :: equation(most_unknowns), b, found, i, j, k, l, n, node, equations_so_far, factors_so_far
      real(wp) :: coefficient(most_unknowns)
      if (allocated(self%equations%first)) deallocate (self%equations%first)
      if (allocated(self%first_factor)) deallocate (self%first_factor)
      allocate (self%equations%first(self%count() + 1), self%first_factor(self%count() + 1))
      self%equations%first(1) = 1
      self%first_factor(1) = 1
      n = 0
      do b = 1, self%count()
         n = n + self%rows**2*most_unknowns*(self%first(b + 1) - self%first(b))**2
      end do
      allocate (list(self%rows*most_unknowns*size(self%node)), factors(n))
      equations_so_far = 0
      factors_so_far = 0
      do b = 1, self%count()
         associate (nodes => self%first(b + 1) - self%first(b))
            allocate (known(self%rows*nodes*most_unknowns), t(self%rows*nodes, self%rows*nodes*most_unknowns))
         end associate
         t = 0
         found = 0
         l = 0
         do node = self%first(b), self%first(b + 1) - 1
            do k = 1, self%rows
               l = l + 1
               call expand_component(equations, self%node(node), k, equation, coefficient, n)
               do i = 1, n
                  j = findloc(known(:found), equation(i), dim=1)
                  if (j == 0) then
                     found = found + 1
                     j = found
                     known(j) = equation(i)
                  end if
                  t(l, j) = t(l, j) + coefficient(i)
               end do
            end do
         end do
         list(equations_so_far + 1:equations_so_far + found) = int(known(:found), i4)
         equations_so_far = equations_so_far + found
         n = size(t, 1)*found
         factors(factors_so_far + 1:factors_so_far + n) = reshape(t(:, :found), [n])
         factors_so_far = factors_so_far + n
         self%equations%first(b + 1) = int(equations_so_far + 1, i4)
         self%first_factor(b + 1) = factors_so_far + 1
         deallocate (known, t)
      end do
      self%equations%equation = list(:equations_so_far)
      self%factor = factors(:factors_so_far)
   end subroutine expand

   !> Find the entries of each block in a pattern that has its cliques.
   pure subroutine find_places(self, pattern)
      class(blocks_t), intent(inout) :: self
      type(sparsity_t), intent(in) :: pattern
      integer :: b, c, m, r, at
      self%symmetric = pattern%symmetric
      if (allocated(self%first_place)) deallocate (self%first_place)
      allocate (self%first_place(self%count() + 1))
      self%first_place(1) = 1
      do b = 1, self%count()
         m = self%equations%first(b + 1) - self%equations%first(b)
         self%first_place(b + 1) = self%first_place(b) + merge(m*(m + 1)/2, m*m, self%symmetric)
      end do
      if (allocated(self%place)) deallocate (self%place)
      allocate (self%place(self%first_place(size(self%first_place)) - 1))
      at = 0
      do b = 1, self%count()
         associate (mine => self%equations%equation(self%equations%first(b):self%equations%first(b + 1) - 1))
            do c = 1, size(mine)
               do r = merge(c, 1, self%symmetric), size(mine)
                  at = at + 1
                  if (self%symmetric) then
                     self%place(at) = int(pattern%find(int(max(mine(r), mine(c))), int(min(mine(r), mine(c)))), i4)
                  else
                     self%place(at) = int(pattern%find(int(mine(r)), int(mine(c))), i4)
                  end if
               end do
            end do
         end associate
      end do
   end subroutine find_places

   !> values <- values + the matrix of block b, global axes. A symmetric pattern takes its symmetric part.
   pure subroutine add(self, b, matrix, values)
      class(blocks_t), intent(in) :: self
      integer, intent(in) :: b
      real(wp), intent(in) :: matrix(:, :) !< (rows*nodes, rows*nodes) node by node
      real(wp), intent(inout) :: values(:) !< of the pattern
      real(wp), allocatable :: t(:, :), k(:, :)
      integer :: at, c, m, r
      m = self%equations%first(b + 1) - self%equations%first(b)
      t = reshape(self%factor(self%first_factor(b):self%first_factor(b + 1) - 1), [size(matrix, 1), m])
      k = matmul(transpose(t), matmul(matrix, t))
      at = self%first_place(b) - 1
      do c = 1, m
         do r = merge(c, 1, self%symmetric), m
            at = at + 1
            if (self%symmetric) then
               values(self%place(at)) = values(self%place(at)) + 0.5_wp*(k(r, c) + k(c, r))
            else
               values(self%place(at)) = values(self%place(at)) + k(r, c)
            end if
         end do
      end do
   end subroutine add
end module finshell_blocks
