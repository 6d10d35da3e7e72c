!> States that the last step of a job is asked for on its way: at load levels, displacements and volumes. They are kept to be found
!> again on finer meshes (&accuracy coarser).
module finshell_stations
   use finshell_kinds, only: wp
   use finshell_observer, only: record_t
   use finshell_state, only: state_t
   use finshell_step, only: prescribes_monitored, step_t
   implicit none
   private
   public :: station_t, stations_t

   real(wp), parameter :: near = 0.01_wp !< of the way from one to the next: volumes are met to the tolerance of corrections

   type :: station_t
      type(state_t) :: state
      real(wp), allocatable :: stress(:, :) !< (n_resultants, elements) of the elements, once it is carried to a finer mesh
      real(wp) :: value = 0 !< of what the step monitors
      logical :: stable = .false. !< no negative pivots
   end type station_t

   type :: stations_t
      logical :: wanted = .false.
      type(station_t), allocatable :: list(:) !< in the order of the way; its end is not among them
      logical, private :: by_value = .false. !< of displacement or volume
      real(wp), allocatable, private :: levels(:) !< load factors, displacements or volumes
   contains
      procedure :: begin
      procedure :: note
      procedure, private :: step_to
   end type stations_t

contains

   !> A step begins.
   subroutine begin(self, step, is_last)
      class(stations_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      logical, intent(in) :: is_last !< of the job
      if (allocated(self%list)) deallocate (self%list)
      allocate (self%list(0))
      self%by_value = prescribes_monitored(step%control)
      self%levels = [real(wp) ::]
      if (.not. (self%wanted .and. is_last)) return
      if (allocated(step%volumes)) then
         self%levels = step%volumes
      else if (self%by_value) then
         self%levels = step%displacements
      else if (allocated(step%load_levels)) then
         self%levels = step%load_levels
      end if
      if (self%by_value) self%levels = self%levels(:size(self%levels) - 1)
      if (.not. self%by_value) self%levels = pack(self%levels, abs(self%levels - step%final_load_factor) > 0)
   end subroutine begin

   !> An increment: is it one of them?
   subroutine note(self, state, record)
      class(stations_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(station_t) :: station
      real(wp) :: reached
      integer :: k
      if (.not. allocated(self%levels)) return
      if (size(self%levels) == 0) return
      reached = merge(record%monitored, record%load_factor, self%by_value)
      k = minloc(abs(self%levels - reached), dim=1)
      if (abs(self%levels(k) - reached) > near*abs(self%step_to(k))) return
      station%state = state
      station%value = self%levels(k)
      station%stable = record%negative_pivots == 0
      self%list = [self%list, station]
   end subroutine note

   !> From the level before, or from zero.
   pure real(wp) function step_to(self, k)
      class(stations_t), intent(in) :: self
      integer, intent(in) :: k
      step_to = self%levels(k)
      if (k > 1) step_to = self%levels(k) - self%levels(k - 1)
   end function step_to
end module finshell_stations
