!> What a host wants of a model: forces at nodes, places of held components. It is brought to the problem in two cases of loads
!> (finshell_host).
module finshell_wishes
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_host, only: coming
   use finshell_kinds, only: wp
   use finshell_mesh, only: find_node_set
   use finshell_status, only: status_input_error
   use finshell_table, only: by_time, follower_t
   implicit none
   private
   public :: wishes_t, gather, follow_time, let_stand

   type :: wishes_t
      real(wp), allocatable :: force(:, :) !< (3, nodes)
      real(wp), allocatable :: place(:, :) !< (3, nodes) displacements, where the host prescribes them
   contains
      procedure :: begin
      procedure :: set_force
      procedure :: set_displacement
      procedure :: pending
      procedure :: announce
   end type wishes_t

contains

   !> None, of a problem that is yet to be made.
   subroutine begin(self, problem, nodes)
      class(wishes_t), intent(inout) :: self
      type(equilibrium_t), intent(inout) :: problem
      integer, intent(in) :: nodes
      allocate (self%force(3, nodes), self%place(3, nodes), source=0.0_wp)
      allocate (problem%host)
      call problem%host%begin(nodes)
   end subroutine begin

   !> Forces that the host wants at the nodes of a set, (3, members) or (3, 1) for each of them. Errors: no such set, a number that
   !> does not fit, a value that is none.
   subroutine set_force(self, problem, node_set, values, error)
      class(wishes_t), intent(inout) :: self
      type(equilibrium_t), intent(in) :: problem
      character(len=*), intent(in) :: node_set
      real(wp), intent(in) :: values(:, :)
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: nodes(:)
      integer :: i
      call members_of(problem, node_set, size(values, 2), nodes, error)
      if (allocated(error)) return
      call check_finite(values, 'force', error)
      if (allocated(error)) return
      do i = 1, size(nodes)
         self%force(:, nodes(i)) = values(:, min(i, size(values, 2)))
      end do
   end subroutine set_force

   !> Displacements that the host wants one component of the nodes of a set to have, which supports hold. Errors: as for forces, and
   !> a component that no support holds.
   subroutine set_displacement(self, problem, node_set, component, values, error)
      class(wishes_t), intent(inout) :: self
      type(equilibrium_t), intent(inout) :: problem
      character(len=*), intent(in) :: node_set
      integer, intent(in) :: component !< 1, 2 or 3
      real(wp), intent(in) :: values(:) !< of each member, or one for all
      type(error_t), allocatable, intent(out) :: error
      logical, allocatable :: before(:, :)
      type(error_t), allocatable :: ignored
      integer, allocatable :: nodes(:)
      integer :: i
      if (component < 1 .or. component > 3) call raise(error, status_input_error, 'component '//text_of(component - 1) &
         //' of a displacement; expected 0, 1 or 2 for x, y or z')
      if (.not. allocated(error)) call members_of(problem, node_set, size(values), nodes, error)
      if (.not. allocated(error)) call check_finite(reshape(values, [1, size(values)]), 'displacement', error)
      if (allocated(error)) return
      before = problem%host%moves
      problem%host%moves(component, nodes) = .true.
      call problem%take_host(error)
      if (allocated(error)) then
         problem%host%moves = before
         call problem%take_host(ignored)
         return
      end if
      do i = 1, 3 ! what was not the host's so far is to stay where it is
         where (problem%host%moves(i, :) .and. .not. before(i, :)) self%place(i, :) = problem%state%displacement(i, :)
      end do
      do i = 1, size(nodes)
         self%place(component, nodes(i)) = values(min(i, size(values)))
      end do
   end subroutine set_displacement

   !> Does the host want anything else than there is?
   pure logical function pending(self, problem)
      class(wishes_t), intent(in) :: self
      type(equilibrium_t), intent(in) :: problem
      pending = any(abs(self%force - problem%host%force) > 0) .or. any(abs(way_to_go(self, problem)) > 0)
   end function pending

   !> (3, nodes) How far held components are to move.
   pure function way_to_go(self, problem) result(motion)
      class(wishes_t), intent(in) :: self
      type(equilibrium_t), intent(in) :: problem
      real(wp) :: motion(3, size(self%place, 2))
      motion = merge(self%place - problem%state%displacement, 0.0_wp, problem%host%moves)
   end function way_to_go

   !> What is to come as the factor of the host goes from 0 to 1. Errors: a component is to move that no support holds any more.
   subroutine announce(self, problem, error)
      class(wishes_t), intent(in) :: self
      type(equilibrium_t), intent(inout) :: problem
      type(error_t), allocatable, intent(out) :: error
      problem%host%change = self%force - problem%host%force
      problem%host%motion = way_to_go(self, problem)
      call problem%take_host(error)
   end subroutine announce

   !> Add what has come to what stands: forces stay as they are, and nothing is on its way.
   subroutine gather(problem, error)
      type(equilibrium_t), intent(inout) :: problem
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: part
      associate (host => problem%host, structure => problem%structure)
         if (allocated(problem%state%followers)) call stop_following(problem)
         part = problem%state%case_factor(structure%cases)
         if (.not. (any(abs(host%change) > 0) .or. any(abs(host%motion) > 0) .or. abs(part) > 0)) return
         host%force = host%force + part*host%change
         host%change = 0
         host%motion = 0
         call set_case(problem, structure%cases, 0.0_wp)
         call problem%take_host(error)
         if (.not. allocated(error)) call problem%evaluate(.false., error)
         if (.not. allocated(error)) call problem%accept()
      end associate
   end subroutine gather

   !> It comes over time, from now on. The increments land at the end of that time.
   subroutine follow_time(problem, length)
      type(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: length
      type(follower_t) :: follower
      type(follower_t), allocatable :: followers(:)
      follower%factor = coming(problem%structure)
      follower%parent = by_time
      follower%table%x = problem%state%time + [0.0_wp, length]
      follower%table%y = [0.0_wp, 1.0_wp]
      allocate (followers(0))
      if (allocated(problem%state%followers)) followers = problem%state%followers
      followers = [followers, follower]
      call set_followers(problem, followers)
   end subroutine follow_time

   !> The last follower, if it is ours, goes.
   subroutine stop_following(problem)
      type(equilibrium_t), intent(inout) :: problem
      type(follower_t), allocatable :: followers(:)
      integer :: n
      n = size(problem%state%followers)
      if (n == 0) return
      if (problem%state%followers(n)%factor /= coming(problem%structure)) return
      if (n > 1) followers = problem%state%followers(:n - 1)
      call set_followers(problem, followers)
   end subroutine stop_following

   subroutine set_followers(problem, followers)
      type(equilibrium_t), intent(inout) :: problem
      type(follower_t), allocatable, intent(in) :: followers(:)
      if (allocated(problem%state%followers)) deallocate (problem%state%followers)
      if (allocated(problem%base%followers)) deallocate (problem%base%followers)
      if (allocated(problem%iterate%followers)) deallocate (problem%iterate%followers)
      if (.not. allocated(followers)) return
      problem%state%followers = followers
      problem%base%followers = followers
      problem%iterate%followers = followers
   end subroutine set_followers

   !> The forces that stand have a factor of 1.
   subroutine let_stand(problem)
      type(equilibrium_t), intent(inout) :: problem
      call set_case(problem, problem%structure%cases - 1, 1.0_wp)
   end subroutine let_stand

   subroutine set_case(problem, case, value)
      type(equilibrium_t), intent(inout) :: problem
      integer, intent(in) :: case
      real(wp), intent(in) :: value
      problem%state%case_factor(case) = value
      problem%base%case_factor(case) = value
      problem%iterate%case_factor(case) = value
   end subroutine set_case

   !> The nodes of a set, for a number of values.
   subroutine members_of(problem, node_set, number, nodes, error)
      type(equilibrium_t), intent(in) :: problem
      character(len=*), intent(in) :: node_set
      integer, intent(in) :: number
      integer, allocatable, intent(out) :: nodes(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: found
      associate (mesh => problem%structure%mesh)
         found = find_node_set(mesh, node_set)
         if (found == 0) then
            call raise(error, status_input_error, "the mesh has no node set '"//node_set//"'")
            return
         end if
         nodes = mesh%node_sets(found)%members
      end associate
      if (number /= 1 .and. number /= size(nodes)) call raise(error, status_input_error, text_of(number)//' values for the node ' &
         //"set '"//node_set//"' of "//text_of(size(nodes))//' nodes; expected as many, or one for all')
   end subroutine members_of

   subroutine check_finite(values, what, error)
      real(wp), intent(in) :: values(:, :)
      character(len=*), intent(in) :: what
      type(error_t), allocatable, intent(inout) :: error
      if (.not. all(abs(values) < huge(1.0_wp))) call raise(error, status_input_error, 'a '//what//' is NaN or infinite')
   end subroutine check_finite
end module finshell_wishes
