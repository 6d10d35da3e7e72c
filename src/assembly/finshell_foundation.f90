!> Elastic foundation: springs between the structure and the ground, which is where the structure is in its reference state. It
!> is always there in full and stores energy, so no factor scales it.
!>
!> Springs per reference area act on the linearly interpolated displacement: force -k A (1 + delta_ij)/12 u_j at node i of an
!> element. Those at nodes act through an element at each.
module finshell_foundation
   use finshell_kinds, only: wp
   use finshell_freedoms, only: membrane_at, n_membrane, ux, uz
   use finshell_acting_load, only: acting_load_t, load_item_t, append
   use finshell_equations, only: equations_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_factor, only: unscaled
   use finshell_load, only: load_t
   use finshell_loaded_set, only: loaded_elements, loaded_nodes
   use finshell_rotation, only: cross_product
   use finshell_state, only: state_t
   use finshell_status, only: status_input_error
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: add_foundation

   type, extends(acting_load_t) :: foundation_t
      real(wp), allocatable :: springs(:, :, :) !< (3, 3, elements) of an element times A/12, or of a node
      integer, allocatable :: corners(:) !< springs at this corner of each element; unallocated: on its area
   contains
      procedure :: evaluate
      procedure :: energy
      procedure :: keep
   end type foundation_t

contains

   !> `vector` of the load: stiffness along the global axes, per area or at each node; or its `numbers`: along the reference normal
   !> and across it, per area. Errors: no such set, a node without element.
   subroutine add_foundation(load, structure, list, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      type(foundation_t) :: self
      self%scaling = unscaled
      self%has_energy = .true.
      if (load%at_nodes) then
         call place_at_nodes(load, structure, self, error)
      else
         call spread_on_elements(load, structure, self, error)
      end if
      if (.not. allocated(error)) call append(list, self)
   end subroutine add_foundation

   !> See finshell_acting_load.
   subroutine keep(self, kept)
      class(foundation_t), intent(inout) :: self
      logical, intent(in) :: kept(:)
      integer :: i
      if (allocated(self%corners)) self%corners = pack(self%corners, kept)
      self%springs = self%springs(:, :, pack([(i, i=1, size(kept))], kept))
      self%elements = pack(self%elements, kept)
   end subroutine keep

   subroutine spread_on_elements(load, structure, self, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(foundation_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: area(3)
      integer :: e, i
      call loaded_elements(load, structure, self%elements, error)
      if (allocated(error)) return
      allocate (self%springs(3, 3, size(self%elements)))
      do e = 1, size(self%elements)
         associate (x => structure%mesh%coordinates(:, structure%mesh%triangles(:, self%elements(e))))
            area = 0.5_wp*cross_product(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1))
         end associate
         self%springs(:, :, e) = ((load%numbers(1) - load%numbers(2))/norm2(area)/12)*spread(area, 2, 3)*spread(area, 1, 3)
         do i = 1, 3
            self%springs(i, i, e) = self%springs(i, i, e) + norm2(area)/12*(load%numbers(2) + load%vector(i))
         end do
      end do
   end subroutine spread_on_elements

   subroutine place_at_nodes(load, structure, self, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(foundation_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      integer, allocatable :: nodes(:), place(:)
      integer :: e, i, k
      call loaded_nodes(load, structure, nodes, error)
      if (allocated(error)) return
      allocate (place(size(structure%mesh%coordinates, 2)), source=0)
      allocate (self%elements(size(nodes)), self%corners(size(nodes)), source=0)
      allocate (self%springs(3, 3, size(nodes)), source=0.0_wp)
      place(nodes) = [(i, i=1, size(nodes))]
      do e = 1, size(structure%mesh%triangles, 2)
         do k = 1, 3
            i = place(structure%mesh%triangles(k, e))
            if (i == 0) cycle
            self%elements(i) = e
            self%corners(i) = k
         end do
      end do
      do i = 1, size(nodes)
         if (self%elements(i) == 0) then
            call raise(error, status_input_error, "load: the foundation at '"//load%set//"' acts on node "//text_of(nodes(i)) &
               //', which belongs to no element')
            return
         end if
         do k = 1, 3
            self%springs(k, k, i) = load%vector(k)
         end do
      end do
   end subroutine place_at_nodes

   subroutine evaluate(self, structure, equations, state, force, factor, stiffness)
      class(foundation_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      real(wp) :: u(3, 3), share(3, 3)
      integer :: e, i, j
      do e = 1, size(self%elements)
         u = state%displacement(:, structure%mesh%triangles(:, self%elements(e)))
         share = shares(self, e)
         force(:, e) = -reshape(matmul(self%springs(:, :, e), matmul(u, share)), [n_membrane])
         if (.not. present(stiffness)) cycle
         do j = 1, 3
            do i = 1, 3
               stiffness(membrane_at(i) + ux:membrane_at(i) + uz, membrane_at(j) + ux:membrane_at(j) + uz, e) &
                  = -(factor*share(i, j))*self%springs(:, :, e)
            end do
         end do
      end do
      if (equations%n < 0) force = 0
   end subroutine evaluate

   !> How springs couple the corners of an element.
   pure function shares(self, e) result(share)
      class(foundation_t), intent(in) :: self
      integer, intent(in) :: e
      real(wp) :: share(3, 3)
      if (allocated(self%corners)) then
         share = 0
         share(self%corners(e), self%corners(e)) = 1
      else
         share = reshape(real([2, 1, 1, 1, 2, 1, 1, 1, 2], wp), [3, 3])
      end if
   end function shares

   function energy(self, structure, equations, state)
      class(foundation_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp) :: energy, u(3, 3)
      integer :: e
      energy = 0*equations%n
      do e = 1, size(self%elements)
         u = state%displacement(:, structure%mesh%triangles(:, self%elements(e)))
         energy = energy + 0.5_wp*sum(u*matmul(self%springs(:, :, e), matmul(u, shares(self, e))))
      end do
   end function energy
end module finshell_foundation
