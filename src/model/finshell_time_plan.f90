!> What a step in time is to do: how long it lasts, the load factor over time, the times to land on. Times count from the beginning
!> of the step.
module finshell_time_plan
   use finshell_kinds, only: wp
   use finshell_table, only: table_t
   implicit none
   private
   public :: time_plan_t, increments_for

   type :: time_plan_t
      real(wp) :: duration = 0
      !> Load factors at times, ascending; between them it goes along a straight line, or smoothly, and keeps the last. Where the
      !> first time is not 0 it begins at the factor that the step finds. Unallocated: `constant` from the beginning.
      !> Of a static step under displacement or volume control: the monitored quantity likewise.
      type(table_t), allocatable :: table
      real(wp) :: constant = 1
      real(wp), allocatable :: stops(:) !< other times to land on, where something else has a corner
      real(wp), allocatable :: output_times(:) !< ascending
      real(wp) :: output_interval = 0 !< and multiples of this; 0: none
   contains
      procedure :: factor
      procedure :: factor_rates
      procedure :: begun
      procedure :: spread_evenly
      procedure :: next_landing
      procedure :: is_corner
      procedure :: is_output
      procedure :: next_row
   end type time_plan_t

   real(wp), parameter :: rounding = 1.0e-10_wp !< of the duration

contains

   !> The load factor at a time.
   pure function factor(self, time, at_start)
      class(time_plan_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp), intent(in) :: at_start !< the load factor that the step has found
      real(wp) :: factor
      type(table_t) :: table
      factor = self%constant
      if (.not. allocated(self%table)) return
      table = self%begun(at_start)
      factor = table%value(time)
   end function factor

   !> First and second derivative of the load factor with respect to time; at a corner those of what comes before it or, with
   !> `after`, behind it.
   pure function factor_rates(self, time, at_start, after) result(rates)
      class(time_plan_t), intent(in) :: self
      real(wp), intent(in) :: time, at_start !< see `factor`
      logical, intent(in) :: after
      real(wp) :: rates(2)
      type(table_t) :: table
      rates = 0
      if (.not. allocated(self%table)) return
      table = self%begun(at_start)
      rates = table%rates(time, after)
   end function factor_rates

   !> The table, from the load factor that the step has found on; there must be one.
   pure function begun(self, at_start) result(table)
      class(time_plan_t), intent(in) :: self
      real(wp), intent(in) :: at_start
      type(table_t) :: table
      table = self%table
      if (.not. table%x(1) > 0) return
      table%x = [0.0_wp, table%x]
      table%y = [at_start, table%y]
   end function begun

   !> Give values without times theirs: such that what goes through them does so at an even rate.
   pure subroutine spread_evenly(self, at_start)
      class(time_plan_t), intent(inout) :: self
      real(wp), intent(in) :: at_start
      real(wp), allocatable :: way(:)
      integer :: i
      associate (table => self%table)
         if (size(table%x) > 0) return
         allocate (way(size(table%y)))
         way(1) = abs(table%y(1) - at_start)
         do i = 2, size(way)
            way(i) = way(i - 1) + abs(table%y(i) - table%y(i - 1))
         end do
         i = size(way)
         if (.not. way(i) > 0) way(i) = 1 ! a hold
         table%x = [self%duration*way(:i - 1)/way(i), self%duration]
         table%y = pack(table%y, [table%x(2:) > table%x(:i - 1), .true.])
         table%x = pack(table%x, [table%x(2:) > table%x(:i - 1), .true.])
      end associate
   end subroutine spread_evenly

   !> The first time after this one at which an increment has to end: output, a corner of the load factor, or the end of the step.
   pure real(wp) function next_landing(self, time)
      class(time_plan_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp) :: after
      after = time + rounding*self%duration
      next_landing = self%duration
      if (allocated(self%table)) next_landing = min(next_landing, minval(self%table%x, mask=self%table%x > after))
      if (allocated(self%stops)) next_landing = min(next_landing, minval(self%stops, mask=self%stops > after))
      if (allocated(self%output_times)) next_landing = min(next_landing, minval(self%output_times, mask=self%output_times > after))
      if (self%output_interval > 0) next_landing = min(next_landing, self%output_interval*(1 + floor(after/self%output_interval)))
   end function next_landing

   !> Has the load factor, or something that follows it or the time, a corner at this time?
   pure logical function is_corner(self, time)
      class(time_plan_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp) :: near
      near = rounding*self%duration
      is_corner = .false.
      if (allocated(self%table)) is_corner = any(abs(time - self%table%x) <= near)
      if (allocated(self%stops)) is_corner = is_corner .or. any(abs(time - self%stops) <= near)
   end function is_corner

   !> Are fields to be written at this time?
   pure logical function is_output(self, time)
      class(time_plan_t), intent(in) :: self
      real(wp), intent(in) :: time
      real(wp) :: near
      near = rounding*self%duration
      is_output = abs(time - self%duration) <= near
      if (allocated(self%output_times)) is_output = is_output .or. any(abs(time - self%output_times) <= near)
      if (self%output_interval > 0) is_output = is_output &
         .or. abs(time - self%output_interval*nint(time/self%output_interval)) <= near
   end function is_output

   !> The number of the first one after a time of so many evenly spaced times.
   pure integer function next_row(self, time, rows)
      class(time_plan_t), intent(in) :: self
      real(wp), intent(in) :: time
      integer, intent(in) :: rows
      next_row = 1 + int(time*max(1, rows)/self%duration*(1 + epsilon(time)))
   end function next_row

   !> As many equal increments as a way in time needs, none of them longer than the largest.
   pure integer function increments_for(way, largest) result(number)
      real(wp), intent(in) :: way, largest
      real(wp), parameter :: slack = 1.0e-9_wp
      number = max(1, int(min(way/largest*(1 - slack), real(huge(1) - 1, wp))) + 1)
   end function increments_for
end module finshell_time_plan
