!> Keeps what a run needs to go on from its last increments (restart in &output), and takes it up again.
module finshell_checkpoint
   use, intrinsic :: iso_fortran_env, only: int64
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise
   use finshell_kinds, only: i8, wp
   use finshell_memo, only: memo_t
   use finshell_monitor, only: restart_all, restart_none
   use finshell_path, only: path_t
   use finshell_path_memory, only: carry_path, carry_state
   use finshell_restart_file, only: restart_file_t, restart_head_t
   use finshell_stage, only: carry_stage
   use finshell_status, only: status_io_error
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: checkpoint_t, fingerprint, record_of, restore

   !> A record is written when so many seconds have passed, and so many times the seconds that the last one took.
   real(wp), parameter :: shortest_pause = 0.5_wp, pause_of_cost = 20

   type :: checkpoint_t
      type(restart_file_t) :: file
      type(equilibrium_t), pointer, private :: problem => null()
      type(path_t), pointer, private :: path => null()
      integer :: step = 1 !< of the input, under way or to begin
      logical, private :: due = .false. !< the last state has no record yet
      integer(int64), private :: written = 0 !< on the system's clock
      real(wp), private :: cost = 0 !< seconds of a record
   contains
      procedure :: attach
      procedure :: start
      procedure :: keep
      procedure :: note
      procedure :: end_step
      procedure :: write => write_record
   end type checkpoint_t

contains

   !> Whose records these are, and how many are kept: restart_none, ... (finshell_monitor).
   subroutine attach(self, problem, path, keeps, head)
      class(checkpoint_t), intent(inout) :: self
      type(equilibrium_t), intent(in), target :: problem
      type(path_t), intent(in), target :: path
      integer, intent(in) :: keeps
      type(restart_head_t), intent(in) :: head
      if (keeps == restart_none) return
      self%problem => problem
      self%path => path
      self%file%head = head
      self%file%keeps_all = keeps == restart_all
   end subroutine attach

   !> Begin a file with the present state.
   subroutine start(self, name, error)
      class(checkpoint_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      self%file%name = name
      call self%write(error)
   end subroutine start

   !> Go on with the file of an earlier run, without its records behind an increment.
   subroutine keep(self, name, last, error)
      class(checkpoint_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: last
      type(error_t), allocatable, intent(out) :: error
      if (.not. associated(self%path)) return
      self%file%name = name
      call self%file%keep(last, error)
   end subroutine keep

   !> A state has been reported; `marked`: it is among those to keep; `in_time`: it moves.
   subroutine note(self, marked, in_time, error)
      class(checkpoint_t), intent(inout) :: self
      logical, intent(in) :: marked, in_time
      type(error_t), allocatable, intent(out) :: error
      if (.not. associated(self%path)) return
      self%due = self%path%underway .and. (allocated(self%path%course) .eqv. in_time)
      if (.not. self%due) return
      if (self%file%keeps_all .and. marked) then
         call self%write(error)
      else if (.not. self%file%keeps_all .and. since(self%written) > max(shortest_pause, pause_of_cost*self%cost)) then
         call self%write(error)
      end if
   end subroutine note

   !> A step has ended that cannot be taken up in its middle.
   subroutine end_step(self, step, error)
      class(checkpoint_t), intent(inout) :: self
      integer, intent(in) :: step
      type(error_t), allocatable, intent(out) :: error
      if (.not. associated(self%path)) return
      self%step = step + 1
      self%path%underway = .false.
      if (allocated(self%path%course)) deallocate (self%path%course)
      call self%write(error)
   end subroutine end_step

   !> Write the present state, unless it has a record.
   subroutine write_record(self, error, if_due)
      class(checkpoint_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: if_due
      real(wp), allocatable :: numbers(:)
      integer(int64) :: began
      if (.not. associated(self%path)) return
      if (present(if_due)) then
         if (if_due .and. .not. self%due) return
      end if
      call system_clock(began)
      numbers = record_of(self%problem, self%path, self%step)
      call self%file%write(self%problem%state%increment, numbers, error)
      self%cost = since(began)
      call system_clock(self%written)
      self%due = .false.
   end subroutine write_record

   !> All that a run needs to go on from here.
   function record_of(problem, path, step) result(numbers)
      type(equilibrium_t), intent(inout) :: problem
      type(path_t), intent(inout) :: path
      integer, intent(in) :: step !< of the input, under way or to begin
      real(wp), allocatable :: numbers(:)
      type(memo_t) :: memo
      integer :: present_step
      present_step = step
      call carry_run(memo, problem, path, present_step)
      numbers = memo%numbers(:memo%at)
   end function record_of

   !> Put a record back: the state, forces in it, and the path. Errors: it is of another model.
   subroutine restore(numbers, problem, path, step, error)
      real(wp), intent(in) :: numbers(:)
      type(equilibrium_t), intent(inout) :: problem
      type(path_t), intent(inout) :: path
      integer, intent(out) :: step !< of the input, under way or to begin
      type(error_t), allocatable, intent(out) :: error
      type(memo_t) :: memo
      integer :: nodes
      nodes = size(problem%state%displacement, 2)
      if (allocated(problem%kept_inertia)) deallocate (problem%kept_inertia)
      memo = memo_t(numbers=numbers, reading=.true.)
      step = 1
      call carry_run(memo, problem, path, step)
      if (memo%whole) memo%whole = memo%at == size(numbers) .and. allocated(problem%state%displacement)
      if (memo%whole) memo%whole = size(problem%state%displacement, 2) == nodes
      if (memo%whole .and. allocated(path%history%vector)) memo%whole = size(path%history%vector, 1) == problem%n
      if (memo%whole) then
         problem%base = problem%state
         problem%iterate = problem%state
         call problem%evaluate(.false., error)
         if (allocated(error)) return
         call problem%state%forget_trial()
         call problem%accept()
      else
         call raise(error, status_io_error, 'cannot restart: the state is one of another model, or of another version of finshell')
      end if
   end subroutine restore

   !> All that goes from increment to increment.
   subroutine carry_run(memo, problem, path, step)
      type(memo_t), intent(inout) :: memo
      type(equilibrium_t), intent(inout) :: problem
      type(path_t), intent(inout) :: path
      integer, intent(inout) :: step
      call memo%carry(step)
      call carry_stage(memo, problem)
      call carry_state(memo, problem%state)
      call carry_path(memo, path, problem)
      call memo%carry(problem%solver%expect_definite)
      call memo%carry(problem%half%solver%expect_definite)
   end subroutine carry_run

   !> Changes when the mesh does, or what elements have that may have been read beside the input: directions, normals, thickness,
   !> offset, growth.
   pure function fingerprint(structure) result(print)
      type(structure_t), intent(in) :: structure
      integer(i8) :: print
      integer :: i
      print = size(structure%mesh%triangles, kind=i8)
      call add(structure%mesh%coordinates)
      call add(real(structure%mesh%triangles, wp))
      call add(reshape(real(structure%element_section, wp), [1, size(structure%element_section)]))
      do i = 1, size(structure%mesh%node_sets)
         call add(reshape(real(structure%mesh%node_sets(i)%members, wp), [1, size(structure%mesh%node_sets(i)%members)]))
      end do
      if (allocated(structure%direction)) call add(structure%direction)
      if (allocated(structure%normal)) call add(reshape(structure%normal, [size(structure%normal), 1]))
      if (allocated(structure%thickness)) call add(reshape(structure%thickness, [1, size(structure%thickness)]))
      if (allocated(structure%offset)) call add(reshape(structure%offset, [1, size(structure%offset)]))
      if (.not. allocated(structure%growths)) return
      do i = 1, size(structure%growths%list)
         call add(structure%growths%list(i)%stretch)
      end do

   contains

      pure subroutine add(x)
         real(wp), intent(in) :: x(:, :)
         integer :: j, k
         do j = 1, size(x, 2)
            do k = 1, size(x, 1)
               print = ieor(ishftc(print, 5), transfer(x(k, j), print))
            end do
         end do
      end subroutine add
   end function fingerprint

   !> Seconds since then.
   real(wp) function since(start)
      integer(int64), intent(in) :: start
      integer(int64) :: now, rate
      call system_clock(now, rate)
      since = real(now - start, wp)/rate
   end function since
end module finshell_checkpoint
