!> What a follower force on an edge does beside pushing its nodes: its work on the bulge of the side (finshell_line_load), with the
!> force q of the present state. Linear in q, so its derivative is that for a fixed q and its values for unit forces times dq/dx.
module finshell_follower_bulge
   use finshell_acting_load, only: append, load_item_t
   use finshell_batch, only: side_free
   use finshell_equations, only: equations_t
   use finshell_follower_line, only: line_force
   use finshell_freedoms, only: membrane_at, n_corners, n_membrane, n_shell, shell_at, uz
   use finshell_joined_load, only: joined_load_t
   use finshell_kinds, only: wp
   use finshell_line_load, only: bulge_load
   use finshell_load, only: load_t
   use finshell_quaternion, only: quaternion_to_matrix
   use finshell_sides, only: side_list_t, sides_on
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t, is_membrane
   implicit none
   private
   public :: add_follower_bulge

   type, extends(joined_load_t) :: follower_bulge_t
      real(wp), allocatable :: along(:, :) !< (3, blocks) force per reference length, see finshell_follower_line
      real(wp), allocatable :: length(:) !< (blocks) reference length, or the share of an element
      real(wp), allocatable :: direction(:, :) !< (3, blocks) of the side, reference
   contains
      procedure :: evaluate
   end type follower_bulge_t

contains

   !> On the sides of edges but those that supports keep straight, and those of membranes.
   subroutine add_follower_bulge(load, structure, equations, edges, list)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: edges(:, :)
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(follower_bulge_t) :: self
      type(side_list_t) :: sides
      logical, allocatable :: bulges(:)
      integer, allocatable :: at(:)
      integer :: b, i
      call sides_on(structure%mesh, edges, sides)
      bulges = .not. is_membrane(structure, sides%element)
      if (allocated(equations%held)) then
         do i = 1, size(bulges)
            bulges(i) = bulges(i) .and. equations%held(sides%side(i), sides%element(i)) == side_free
         end do
      end if
      at = pack([(i, i=1, size(bulges))], bulges)
      if (size(at) == 0) return
      allocate (self%along(3, size(at)), self%direction(3, size(at)))
      self%length = sides%length(at)/sides%shared(at)
      do b = 1, size(at)
         self%along(:, b) = load%vector*[1.0_wp, 1.0_wp, sides%sense(at(b))]
         self%direction(:, b) = (structure%mesh%coordinates(:, sides%nodes(2, at(b))) &
                                 - structure%mesh%coordinates(:, sides%nodes(1, at(b))))/sides%length(at(b))
      end do
      self%scaling = load%scaling
      self%symmetric = .false.
      call self%join(equations, sides%nodes(:, at), .true.)
      call append(list, self)
   end subroutine add_follower_bulge

   subroutine evaluate(self, structure, equations, state, force, factor, stiffness)
      class(follower_bulge_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      real(wp) :: x(3, n_corners), t(3, 2), q(3), derivative(3, n_membrane), unit(3), f(n_shell), k(n_shell, n_shell)
      integer :: b, i, j
      do b = 1, self%count()
         do i = 1, n_corners
            x(:, i) = self%position(i, b, structure, state)
            if (i < n_corners) t(:, i) = matmul(quaternion_to_matrix(state%rotation(:, self%node(i, b))), self%direction(:, b))
         end do
         if (.not. present(stiffness)) then
            call line_force(self%along(:, b), x, q)
            call bulge_load(self%length(b), q, x, t, force(:, b))
            cycle
         end if
         call line_force(self%along(:, b), x, q, derivative)
         call bulge_load(self%length(b), q, x, t, force(:, b), k)
         do j = 1, 3
            unit = 0
            unit(j) = 1
            call bulge_load(self%length(b), unit, x, t, f)
            do i = 1, n_corners
               associate (columns => k(:, shell_at(i) + 1:shell_at(i) + uz))
                  columns = columns + spread(f, 2, uz)*spread(derivative(j, membrane_at(i) + 1:membrane_at(i) + uz), 1, n_shell)
               end associate
            end do
         end do
         stiffness(:, :, b) = factor*k
      end do
      if (equations%n < 0) force = 0
   end subroutine evaluate
end module finshell_follower_bulge
