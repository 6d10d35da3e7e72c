!> Work that the residual does on a given motion of the nodes, differentiated with respect to the thickness of each element or to
!> the position of each node: what an adjoint solution is multiplied with.
!>
!> The model is taken apart: every element gets three nodes of its own, at the places, displacements and rotations of those it has.
!> Then one evaluation of all elements with all of them changed alike gives the change of each: two evaluations for all
!> thicknesses, twelve for all positions (six coordinates of each element; what its third node does follows from the first two, as
!> internal forces do not change when an element goes with its nodes). Loads go the same way; weights are proportional to the
!> thickness.
module finshell_element_sensitivity
   use finshell_acting_load, only: load_item_t
   use finshell_centrifugal, only: add_centrifugal
   use finshell_dead_load, only: add_area, dead_load_t, new_dead_load
   use finshell_discretisation, only: evaluate_gathered, freedoms, gather_elements, gathered_t
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise
   use finshell_factor, only: factor_at
   use finshell_freedoms, only: n_corners, n_nodal
   use finshell_kinds, only: i4, wp
   use finshell_load, only: load_gravity, load_traction
   use finshell_mesh, only: twice_area_vector
   use finshell_state, only: state_t
   use finshell_status, only: status_not_converged, status_ok
   use finshell_structure, only: structure_t, thickness_of
   implicit none
   private
   public :: thickness_work, position_work, pieces_t, take_apart

   !> The model in pieces.
   type :: pieces_t
      private
      type(structure_t) :: structure
      type(state_t) :: state
      real(wp), allocatable :: dual(:, :) ! (n_nodal, 3 elements) the motion
   end type pieces_t

   !> Part of the thickness, or of the size of an element, over which central differences are taken: truncation (step^2) and
   !> rounding (epsilon/step) meet at the third root of epsilon.
   real(wp), parameter :: small_part = epsilon(1.0_wp)**(1/3.0_wp)

contains

   !> Give each element nodes of its own, at the state of the problem.
   subroutine take_apart(problem, dual, pieces)
      type(equilibrium_t), intent(in) :: problem
      real(wp), intent(in) :: dual(:, :) !< (n_nodal, nodes)
      type(pieces_t), intent(out) :: pieces
      integer, allocatable :: from(:)
      integer :: i
      associate (s => problem%structure, mine => pieces%structure)
         from = reshape(s%mesh%triangles, [size(s%mesh%triangles)])
         mine = s ! whatever elements have comes along
         mine%mesh%coordinates = s%mesh%coordinates(:, from)
         mine%mesh%triangles = reshape([(i, i=1, size(from))], shape(s%mesh%triangles))
      end associate
      pieces%state = problem%state
      pieces%state%displacement = problem%state%displacement(:, from)
      pieces%state%rotation = problem%state%rotation(:, from)
      pieces%dual = dual(:, from)
   end subroutine take_apart

   !> Derivatives with respect to the thickness of each element, of all its layers in proportion: of the work of external less
   !> internal forces, and of the stored energy.
   subroutine thickness_work(problem, pieces, work, energy, error)
      type(equilibrium_t), intent(in) :: problem
      type(pieces_t), intent(inout) :: pieces
      real(wp), intent(out) :: work(:), energy(:) !< (elements)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: w(size(work)), e(size(work)), thickness(size(work))
      integer, parameter :: place(2) = [-1, 1]
      integer :: i, k
      thickness = thickness_of(problem%structure, [(i, i=1, size(work))])
      work = 0
      energy = 0
      do k = 1, size(place)
         pieces%structure%thickness = (1 + place(k)*small_part)*thickness
         call internal_work(problem, pieces, w, e, error)
         if (allocated(error)) return
         work = work + place(k)/(2*small_part)*w
         energy = energy + place(k)/(2*small_part)*e
      end do
      pieces%structure%thickness = thickness
      call weight_work(problem, pieces, w, error)
      work = (work + w)/thickness
      energy = energy/thickness
   end subroutine thickness_work

   !> Derivatives with respect to the reference position of each node, at fixed displacements and rotations, of the same.
   subroutine position_work(problem, pieces, work, energy, error)
      type(equilibrium_t), intent(in) :: problem
      type(pieces_t), intent(inout) :: pieces
      real(wp), intent(out) :: work(:, :), energy(:, :) !< (3, nodes)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: coordinates(:, :), distance(:), w(:, :), e(:, :), load(:, :)
      real(wp), allocatable :: of_element(:, :, :), of_energy(:, :, :)
      integer :: c, i, k, n
      n = size(problem%structure%element_section)
      allocate (distance(n), w(n, 2), e(n, 2), load(n, 2))
      allocate (of_element(3, n_corners, n), of_energy(3, n_corners, n))
      distance = [(small_part*sqrt(norm2(twice_area_vector(problem%structure%mesh, i))), i=1, n)]
      coordinates = pieces%structure%mesh%coordinates
      do k = 1, n_corners
         do c = 1, 3
            do i = 1, 2
               pieces%structure%mesh%coordinates(c, k::n_corners) = coordinates(c, k::n_corners) + (2*i - 3)*distance
               if (k < n_corners) call internal_work(problem, pieces, w(:, i), e(:, i), error)
               if (.not. allocated(error)) call load_work(problem, pieces, load(:, i), error)
               if (allocated(error)) return
            end do
            pieces%structure%mesh%coordinates(c, :) = coordinates(c, :)
            if (k < n_corners) then
               of_element(c, k, :) = (w(:, 2) - w(:, 1))/(2*distance)
               of_energy(c, k, :) = (e(:, 2) - e(:, 1))/(2*distance)
            else
               of_element(c, k, :) = -sum(of_element(c, :k - 1, :), dim=1)
               of_energy(c, k, :) = -sum(of_energy(c, :k - 1, :), dim=1)
            end if
            ! kept apart until the third node is done
            load(:, 1) = (load(:, 2) - load(:, 1))/(2*distance)
            call add_at(problem, k, c, load(:, 1), k == 1 .and. c == 1, work)
         end do
      end do
      energy = 0
      do i = 1, n
         associate (nodes => problem%structure%mesh%triangles(:, i))
            work(:, nodes) = work(:, nodes) + of_element(:, :, i)
            energy(:, nodes) = energy(:, nodes) + of_energy(:, :, i)
         end associate
      end do
   end subroutine position_work

   !> Add a number of each element at one of its nodes.
   pure subroutine add_at(problem, corner, component, values, begins, sum_of)
      type(equilibrium_t), intent(in) :: problem
      integer, intent(in) :: corner, component
      real(wp), intent(in) :: values(:) !< (elements)
      logical, intent(in) :: begins
      real(wp), intent(inout) :: sum_of(:, :) !< (3, nodes)
      integer :: i
      if (begins) sum_of = 0
      associate (nodes => problem%structure%mesh%triangles(corner, :))
         do i = 1, size(values)
            sum_of(component, nodes(i)) = sum_of(component, nodes(i)) + values(i)
         end do
      end associate
   end subroutine add_at

   !> Minus the work of the internal forces of each element, and its energy.
   subroutine internal_work(problem, pieces, work, energy, error)
      type(equilibrium_t), intent(in) :: problem
      type(pieces_t), intent(in) :: pieces
      real(wp), intent(out) :: work(:), energy(:)
      type(error_t), allocatable, intent(out) :: error
      type(gathered_t) :: g
      integer, allocatable :: mine(:)
      integer(i4), allocatable :: status(:)
      real(wp), allocatable :: force(:, :), e(:)
      integer :: i, m, s
      associate (p => pieces%structure)
         do s = 1, size(p%sections)
            mine = pack([(i, i=1, size(work))], p%element_section == s)
            m = freedoms(p%sections(s))
            if (allocated(status)) deallocate (status, force, e)
            allocate (status(size(mine)), e(size(mine)), force(m, size(mine)))
            call gather_elements(p, pieces%state, mine, g, problem%equations%held)
            call evaluate_gathered(p%sections(s), g, status, energy=e, force=force)
            if (any(status /= status_ok)) then
               call raise(error, status_not_converged, 'an element cannot be evaluated with the changed parameter')
               return
            end if
            energy(mine) = e
            do i = 1, size(mine)
               work(mine(i)) = -against(pieces, mine(i), force(:, i))
            end do
         end do
      end associate
   end subroutine internal_work

   !> Work of forces on the nodes of an element.
   pure real(wp) function against(pieces, element, force) result(work)
      type(pieces_t), intent(in) :: pieces
      integer, intent(in) :: element
      real(wp), intent(in) :: force(:) !< (freedoms)
      integer :: j, m
      m = size(force)/n_corners
      work = 0
      do j = 1, n_corners
         work = work + dot_product(force(m*(j - 1) + 1:m*j), pieces%dual(:m, n_corners*(element - 1) + j))
      end do
   end function against

   !> Work of the loads on each element at the present factors: those that depend on places, but for what acts at nodes and edges.
   subroutine load_work(problem, pieces, work, error)
      type(equilibrium_t), intent(in) :: problem
      type(pieces_t), intent(in) :: pieces
      real(wp), intent(out) :: work(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      call dead_work(problem, pieces, [character(len=8) :: load_gravity, load_traction], work, error)
      do i = 1, size(problem%external%list)
         call add_acting(problem, pieces, problem%external%list(i), work)
      end do
   end subroutine load_work

   !> Work of what is proportional to the mass of the elements.
   subroutine weight_work(problem, pieces, work, error)
      type(equilibrium_t), intent(in) :: problem
      type(pieces_t), intent(in) :: pieces
      real(wp), intent(out) :: work(:)
      type(error_t), allocatable, intent(out) :: error
      type(load_item_t), allocatable :: list(:)
      integer :: i
      call dead_work(problem, pieces, [load_gravity], work, error)
      allocate (list(0))
      associate (loads => problem%structure%loads)
         do i = 1, size(loads)
            if (loads(i)%kind == 'centrifugal' .and. loads(i)%span%covers(problem%stage) .and. .not. allocated(error)) &
               call add_centrifugal(loads(i), pieces%structure, list, error)
         end do
      end associate
      do i = 1, size(list)
         call add_acting(problem, pieces, list(i), work)
      end do
   end subroutine weight_work

   subroutine dead_work(problem, pieces, kinds, work, error)
      type(equilibrium_t), intent(in) :: problem
      type(pieces_t), intent(in) :: pieces
      character(len=*), intent(in) :: kinds(:)
      real(wp), intent(out) :: work(:)
      type(error_t), allocatable, intent(out) :: error
      type(dead_load_t) :: dead
      real(wp) :: factor
      integer :: e, i
      work = 0
      associate (loads => problem%structure%loads)
         do i = 1, size(loads)
            if (.not. (any(loads(i)%kind == kinds) .and. loads(i)%span%covers(problem%stage))) cycle
            call new_dead_load(dead, size(pieces%dual, 2), loads(i)%scaling)
            call add_area(loads(i), pieces%structure, dead, error)
            if (allocated(error)) return
            factor = factor_at(pieces%state, loads(i)%scaling)
            do e = 1, size(work)
               work(e) = work(e) + factor*against(pieces, e, &
                  reshape(dead%nodal(:, n_corners*(e - 1) + 1:n_corners*e), [n_nodal*n_corners]))
            end do
         end do
      end associate
   end subroutine dead_work

   subroutine add_acting(problem, pieces, item, work)
      type(equilibrium_t), intent(in) :: problem
      type(pieces_t), intent(in) :: pieces
      type(load_item_t), intent(in) :: item
      real(wp), intent(inout) :: work(:)
      real(wp), allocatable :: force(:, :)
      real(wp) :: factor
      integer :: i
      associate (load => item%load)
         factor = factor_at(pieces%state, load%scaling)
         if (load%rows == 0 .or. .not. abs(factor) > 0 .or. size(load%elements) == 0) return
         allocate (force(load%rows, size(load%elements)))
         call load%evaluate(pieces%structure, problem%equations, pieces%state, force)
         do i = 1, size(load%elements)
            work(load%elements(i)) = work(load%elements(i)) + factor*against(pieces, load%elements(i), force(:, i))
         end do
      end associate
   end subroutine add_acting
end module finshell_element_sensitivity
