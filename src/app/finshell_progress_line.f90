!> How far a step is and how long it will still take: a line on a terminal that is written anew with each increment.
!>
!> The time left goes by the way of the step: what is left of it takes as long for its length as what has been done since the
!> first increment that was seen. A path that turns back, or has no end that is known, says nothing.
module finshell_progress_line
   use, intrinsic :: iso_fortran_env, only: int64, output_unit
   use finshell_error, only: text_of
   use finshell_kinds, only: wp
   use finshell_observer, only: record_t
   use finshell_step, only: control_arc_length, control_displacement, control_load, control_volume, is_in_time, step_t
   implicit none
   private
   public :: progress_line_t, share_of_way, seconds_left

   type :: progress_line_t
      private
      logical :: enabled = .false.
      logical :: visible = .false. !< the line is there
      character(len=:), allocatable :: name !< of the step
      type(step_t) :: step
      real(wp) :: start = 0 !< load factor or time at the beginning of the step
      real(wp) :: first = -1 !< share of the way at the first increment that was seen; negative: none was
      integer(int64) :: since = 0 !< when that was
   contains
      procedure :: enable
      procedure :: begin_step
      procedure :: show
      procedure :: clear
   end type progress_line_t

   character(len=*), parameter :: wipe = achar(13)//achar(27)//'[K'

contains

   subroutine enable(self)
      class(progress_line_t), intent(inout) :: self
      self%enabled = .true.
   end subroutine enable

   subroutine begin_step(self, step, number, steps, load_factor, time)
      class(progress_line_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      integer, intent(in) :: number, steps
      real(wp), intent(in) :: load_factor, time !< where it begins
      if (.not. self%enabled) return
      self%name = 'step '//text_of(number)//' of '//text_of(steps)
      self%step = step
      self%start = merge(time, load_factor, is_in_time(step%control))
      self%first = -1
   end subroutine begin_step

   !> After an increment.
   subroutine show(self, record)
      class(progress_line_t), intent(inout) :: self
      type(record_t), intent(in) :: record
      character(len=:), allocatable :: text
      integer(int64) :: now, rate
      real(wp) :: left, share
      if (.not. self%enabled) return
      share = share_of_way(self%step, self%start, record)
      if (share < 0) return
      call system_clock(now, rate)
      text = '  '//self%name//': '//text_of(int(100*share))//' %'
      if (self%first < 0) then
         self%first = share
         self%since = now
      end if
      left = seconds_left(real(now - self%since, wp)/rate, self%first, share)
      if (left >= 0) text = text//', about '//text_of(nint(min(left, 1.0e9_wp)))//' s left'
      write (output_unit, '(a)', advance='no') wipe//text
      flush (output_unit)
      self%visible = .true.
   end subroutine show

   !> Make room for another line.
   subroutine clear(self)
      class(progress_line_t), intent(inout) :: self
      if (self%visible) write (output_unit, '(a)', advance='no') wipe
      self%visible = .false.
   end subroutine clear

   !> Part of the way of a step that an increment has come, 0 to 1; negative where that is not known.
   pure real(wp) function share_of_way(step, start, record) result(share)
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: start !< load factor or time when it began
      type(record_t), intent(in) :: record
      share = -1
      if (is_in_time(step%control)) then
         share = part(start, record%motion%time, start + step%time%duration)
         return
      end if
      if (all(step%control /= [control_load, control_displacement, control_arc_length, control_volume])) return
      if (step%ends_at_load_factor) share = part(start, record%load_factor, step%final_load_factor)
      if (allocated(step%displacements)) then
         if (size(step%displacements) > 0) share = max(share, part(0.0_wp, record%monitored, last(step%displacements)))
      else if (allocated(step%volumes)) then
         if (size(step%volumes) > 0) share = max(share, part(0.0_wp, record%monitored, last(step%volumes)))
      end if
   end function share_of_way

   pure real(wp) function last(values)
      real(wp), intent(in) :: values(:)
      last = values(size(values))
   end function last

   !> Where a value lies between two others; negative where it does not.
   pure real(wp) function part(from, now, to)
      real(wp), intent(in) :: from, now, to
      part = -1
      if (.not. abs(to - from) > 1.0e-12_wp*max(abs(to), abs(from))) return
      if ((now - from)*sign(1.0_wp, to - from) < 0 .or. (to - now)*sign(1.0_wp, to - from) < 0) return
      part = min(1.0_wp, (now - from)/(to - from))
   end function part

   !> Seconds that the rest of the way will take; negative where that is not known.
   pure real(wp) function seconds_left(seconds, first, share) result(left)
      real(wp), intent(in) :: seconds !< since the first share
      real(wp), intent(in) :: first, share
      left = -1
      if (first >= 0 .and. share > first + 1.0e-6_wp) left = max(0.0_wp, seconds*(1 - share)/(share - first))
   end function seconds_left
end module finshell_progress_line
