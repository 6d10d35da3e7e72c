!> Forces and prescribed displacements that a host gives from outside, beside those of the input.
!>
!> They belong to the last two cases of the structure. The factor of the one, `standing`, is 1 throughout: forces that act. That of
!> the other, `coming`, goes from 0 to 1 while they change to what the host wants: before an increment of a static step
!> (finshell_path), in the course of one in time. What has come is then added to what stands.
module finshell_host
   use finshell_acting_load, only: append
   use finshell_dead_load, only: dead_load_t, new_dead_load
   use finshell_equations, only: equations_t
   use finshell_error, only: error_t, raise
   use finshell_external, only: external_t
   use finshell_factor, only: by_case
   use finshell_freedoms, only: n_nodal, ux, uz
   use finshell_kinds, only: wp
   use finshell_mesh, only: node_text
   use finshell_status, only: status_input_error
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: host_t, host_cases, standing, coming

   integer, parameter :: host_cases = 2

   type :: host_t
      real(wp), allocatable :: force(:, :) !< (3, nodes) that act
      real(wp), allocatable :: change(:, :) !< (3, nodes) of forces, as `coming` goes to 1
      real(wp), allocatable :: motion(:, :) !< (3, nodes) of held components likewise
      logical, allocatable :: moves(:, :) !< (3, nodes) components that the host has moved
   contains
      procedure :: begin
      procedure :: join
      procedure :: renew
   end type host_t

contains

   !> The factors of a structure (finshell_factor).
   pure integer function standing(structure)
      type(structure_t), intent(in) :: structure
      standing = by_case + structure%cases - 1
   end function standing

   pure integer function coming(structure)
      type(structure_t), intent(in) :: structure
      coming = by_case + structure%cases
   end function coming

   !> Nothing yet.
   pure subroutine begin(self, nodes)
      class(host_t), intent(inout) :: self
      integer, intent(in) :: nodes
      allocate (self%force(3, nodes), self%change(3, nodes), self%motion(3, nodes), source=0.0_wp)
      allocate (self%moves(3, nodes), source=.false.)
   end subroutine begin

   !> Add both cases to loads and supports that have been numbered anew. Errors: see `renew`.
   subroutine join(self, structure, equations, external, error)
      class(host_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(inout) :: equations
      type(external_t), intent(inout) :: external
      type(error_t), allocatable, intent(out) :: error
      type(dead_load_t) :: dead
      integer :: k
      do k = standing(structure), coming(structure)
         call new_dead_load(dead, size(self%force, 2), k)
         call append(external%list, dead)
      end do
      call self%renew(structure, equations, external, error)
   end subroutine join

   !> Forces and motions are now these. Errors: a component is to move that no support holds.
   subroutine renew(self, structure, equations, external, error)
      class(host_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(inout) :: equations
      type(external_t), intent(inout) :: external
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      call check(self, structure, equations, error)
      if (allocated(error)) return
      do i = 1, size(external%list)
         associate (load => external%list(i)%load)
            if (load%scaling == standing(structure)) load%nodal(ux:uz, :) = self%force
            if (load%scaling == coming(structure)) load%nodal(ux:uz, :) = self%change
         end associate
      end do
      call move_nodes(equations, pack([(i, i=1, size(self%moves, 2))], any(self%moves, dim=1)))
      do i = 1, size(equations%moved)
         equations%motion(ux:uz, i, coming(structure)) = self%motion(:, equations%moved(i))
      end do
   end subroutine renew

   subroutine check(self, structure, equations, error)
      type(host_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      if (.not. any(self%moves)) return
      if (equations%links%any()) then
         call raise(error, status_input_error, 'a host cannot prescribe displacements where there are joints (&tie, &equal, ' &
                    //'&equation, &rigid_body)')
         return
      end if
      do i = 1, size(self%moves, 2)
         if (.not. any(self%moves(:, i))) cycle
         if (equations%frame(i) == 0 .and. .not. any(self%moves(:, i) .and. equations%number(ux:uz, i) > 0)) cycle
         call raise(error, status_input_error, 'a displacement is prescribed at '//node_text(structure%mesh, i) &
                    //', where no &support of this step holds that component in global axes; add one (its value is then the ' &
                    //"host's)")
         return
      end do
   end subroutine check

   !> Let these nodes be among those that are moved.
   subroutine move_nodes(equations, nodes)
      type(equations_t), intent(inout) :: equations
      integer, intent(in) :: nodes(:)
      real(wp), allocatable :: motion(:, :, :)
      integer, allocatable :: more(:)
      integer :: before, i
      more = pack(nodes, [(all(equations%moved /= nodes(i)), i=1, size(nodes))])
      if (size(more) == 0) return
      before = size(equations%moved)
      allocate (motion(n_nodal, before + size(more), size(equations%motion, 3)), source=0.0_wp)
      motion(:, :before, :) = equations%motion
      call move_alloc(motion, equations%motion)
      equations%moved = [equations%moved, more]
      equations%turned = [equations%turned, &
                          (equations%supported(equations%support_of(more(i)))%rotations == 3, i=1, size(more))]
   end subroutine move_nodes
end module finshell_host
