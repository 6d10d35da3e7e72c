!> Elements with dependent nodes: their matrices go through blocks (finshell_blocks).
!>
!> They write where others do, whatever their nodes are: all that hang on one master write to it. So they are kept while elements
!> are evaluated side by side, and added one by one in an order that does not depend on threads.
module finshell_linked_elements
   use finshell_blocks, only: blocks_t
   use finshell_freedoms, only: n_shell, shell_displacements
   use finshell_kinds, only: wp, i4
   use finshell_places, only: places_t
   implicit none
   private
   public :: linked_elements_t

   type :: linked_elements_t
      type(blocks_t) :: blocks !< of the linked elements; behind them those of joints and nodes (finshell_joint_stiffness)
      integer :: elements = 0 !< linked ones, which have the first blocks
      integer :: joints = 0 !< whose masters have the next
      integer, allocatable :: block_of(:) !< (nodes) of a node that is dependent or belongs to no element: its block; 0: others
      integer, allocatable :: block(:) !< (slots of the assembly) index into the blocks, 0: not linked; unallocated: none is
   contains
      procedure :: has
      procedure :: room
      procedure :: keep
      procedure :: add_kept
      procedure :: add_loads
   end type linked_elements_t

contains

   !> Is the element at a slot linked?
   pure logical function has(self, slot)
      class(linked_elements_t), intent(in) :: self
      integer, intent(in) :: slot
      has = .false.
      if (allocated(self%block)) has = self%block(slot) > 0
   end function has

   !> Room for their matrices.
   pure subroutine room(self, kept)
      class(linked_elements_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: kept(:, :, :) !< (n_shell, n_shell, linked elements)
      allocate (kept(n_shell, n_shell, self%elements), source=0.0_wp)
   end subroutine room

   pure subroutine keep(self, slot, k, kept)
      class(linked_elements_t), intent(in) :: self
      integer, intent(in) :: slot
      real(wp), intent(in) :: k(:, :) !< of a shell or a membrane, global axes
      real(wp), intent(inout) :: kept(:, :, :)
      associate (mine => kept(:, :, self%block(slot)))
         if (size(k, 1) == n_shell) then
            mine = k
         else
            mine(shell_displacements, shell_displacements) = k
         end if
      end associate
   end subroutine keep

   pure subroutine add_kept(self, kept, values)
      class(linked_elements_t), intent(in) :: self
      real(wp), intent(in) :: kept(:, :, :)
      real(wp), intent(inout) :: values(:) !< of the matrix
      integer :: s
      if (.not. allocated(self%block)) return
      do s = 1, size(self%block)
         if (self%block(s) > 0) call self%blocks%add(self%block(s), kept(:, :, self%block(s)), values)
      end do
   end subroutine add_kept

   !> Take the stiffness of loads that act through linked elements from the matrix.
   pure subroutine add_loads(self, places, stiffness, values)
      class(linked_elements_t), intent(in) :: self
      type(places_t), intent(in) :: places !< of the elements of the loads
      real(wp), intent(in) :: stiffness(:, :, :) !< (rows, rows, elements of the loads)
      real(wp), intent(inout) :: values(:)
      real(wp) :: one(n_shell, n_shell, 1)
      type(linked_elements_t) :: whole
      integer :: l, s
      if (.not. allocated(self%block)) return
      whole%block = [1]
      do s = 1, size(self%block)
         if (self%block(s) == 0) cycle
         do l = places%first(s), places%first(s + 1) - 1_i4
            one = 0
            call whole%keep(1, -stiffness(:, :, places%order(l)), one)
            call self%blocks%add(self%block(s), one(:, :, 1), values)
         end do
      end do
   end subroutine add_loads
end module finshell_linked_elements
