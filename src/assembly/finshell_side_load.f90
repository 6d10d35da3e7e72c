!> A dead load on sides of elements that can bulge: what it does beside pushing the nodes (finshell_line_load).
module finshell_side_load
   use finshell_kinds, only: wp, i8
   use finshell_freedoms, only: n_nodal, n_shell, shell_at
   use finshell_acting_load, only: acting_load_t, load_item_t, append, with_rotations
   use finshell_batch, only: side_free
   use finshell_equations, only: equations_t
   use finshell_line_load, only: bulge_load
   use finshell_load, only: load_t
   use finshell_mesh_sorting, only: sorted_order, position_in_sorted
   use finshell_quaternion, only: quaternion_to_matrix
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t, is_membrane
   implicit none
   private
   public :: add_side_load

   type :: side_t
      integer :: corners(3) = 0 !< ends of the side and the third node, as corners of the element, counter-clockwise
      real(wp) :: length = 0 !< reference length, or this element's share of it
      real(wp) :: direction(3) = 0 !< of the side, reference
   end type side_t

   type, extends(acting_load_t) :: side_load_t
      type(side_t), allocatable :: sides(:) !< of the elements
      real(wp) :: vector(3) = 0 !< force per reference length
   contains
      procedure :: evaluate => evaluate_sides
      procedure :: keep
   end type side_load_t

contains

   !> See finshell_acting_load.
   subroutine keep(self, kept)
      class(side_load_t), intent(inout) :: self
      logical, intent(in) :: kept(:)
      self%sides = pack(self%sides, kept)
      self%elements = pack(self%elements, kept)
   end subroutine keep

   !> The sides of elements that lie on edges, but those that supports keep straight, and those of membranes.
   subroutine add_side_load(load, structure, edges, held, list)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: edges(:, :)
      integer, intent(in), optional :: held(:, :) !< (3, elements)
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(side_load_t) :: found
      integer(i8) :: key(size(edges, 2))
      integer :: shared(size(edges, 2)), at(3*size(structure%mesh%triangles, 2)), e, i, k, n
      logical :: marked(size(structure%mesh%coordinates, 2)), straight

      marked = .false.
      do i = 1, size(edges, 2)
         marked(edges(:, i)) = .true.
         key(i) = edge_key(edges(:, i))
      end do
      key = key(sorted_order(key))
      shared = 0
      n = 0
      do e = 1, size(structure%mesh%triangles, 2)
         do k = 1, 3
            n = n + 1
            at(n) = 0
            if (.not. all(marked(structure%mesh%triangles([k, 1 + mod(k, 3)], e)))) cycle
            at(n) = position_in_sorted(key, edge_key(structure%mesh%triangles([k, 1 + mod(k, 3)], e)))
            if (at(n) > 0) shared(at(n)) = shared(at(n)) + 1
            straight = is_membrane(structure, e)
            if (present(held)) straight = straight .or. held(k, e) /= side_free
            if (straight) at(n) = -at(n)
         end do
      end do
      found%elements = [((n + 2)/3, n=1, size(at))]
      found%elements = pack(found%elements, at > 0)
      allocate (found%sides(size(found%elements)))
      i = 0
      do n = 1, size(at)
         if (at(n) <= 0) cycle
         e = (n + 2)/3
         k = n - 3*(e - 1)
         i = i + 1
         associate (side => found%sides(i), x => structure%mesh%coordinates, nodes => structure%mesh%triangles(:, e))
            side%corners = [k, 1 + mod(k, 3), 1 + mod(k + 1, 3)]
            side%direction = x(:, nodes(1 + mod(k, 3))) - x(:, nodes(k))
            side%length = norm2(side%direction)
            side%direction = side%direction/side%length
            side%length = side%length/shared(at(n))
         end associate
      end do
      if (i == 0) return
      found%rows = with_rotations
      found%scaling = load%scaling
      found%vector = load%vector
      call append(list, found)

   contains

      pure integer(i8) function edge_key(nodes)
         integer, intent(in) :: nodes(2)
         edge_key = int(minval(nodes), i8)*(size(structure%mesh%coordinates, 2) + 1_i8) + maxval(nodes)
      end function edge_key
   end subroutine add_side_load

   subroutine evaluate_sides(self, structure, equations, state, force, factor, stiffness)
      class(side_load_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      real(wp) :: x(3, 3), t(3, 2), f(n_shell), k(n_shell, n_shell)
      integer :: i, j, n, node, place(n_shell)
      do n = 1, size(self%elements)
         associate (side => self%sides(n), mesh => structure%mesh)
            do i = 1, 3
               node = mesh%triangles(side%corners(i), self%elements(n))
               x(:, i) = mesh%coordinates(:, node) + state%displacement(:, node)
               if (i < 3) t(:, i) = matmul(quaternion_to_matrix(state%rotation(:, node)), side%direction)
               place(shell_at(i) + 1:shell_at(i) + n_nodal) = [(shell_at(side%corners(i)) + j, j=1, n_nodal)]
            end do
            if (present(stiffness)) then
               call bulge_load(side%length, self%vector, x, t, f, k)
               stiffness(place, place, n) = factor*k
            else
               call bulge_load(side%length, self%vector, x, t, f)
            end if
            force(place, n) = f
         end associate
      end do
      if (equations%n < 0) force = 0
   end subroutine evaluate_sides
end module finshell_side_load
