!> Can the values that a step is to land on be met on its way? What a step prescribes does not turn round by itself.
module finshell_input_way
   use finshell_kinds, only: wp, dp
   use finshell_error, only: error_t, text_of
   use finshell_step, only: control_timed, off_the_way, prescribes_monitored, step_t
   use finshell_step, only: control_load, control_displacement, control_arc_length, control_volume, is_in_time, leaves_state
   use finshell_namelist, only: namelist_t, group_t, has, complain_about
   implicit none
   private
   public :: check_ways

   !> Factor of a case where a step begins; unallocated where that is not known.
   type :: place_t
      real(wp), allocatable :: factor
   end type place_t

contains

   !> Check the steps of an input one after the other.
   subroutine check_ways(namelist, steps, anew, constants, error)
      type(namelist_t), intent(in) :: namelist
      type(step_t), intent(in) :: steps(:) !< of the groups &step, in their order
      integer, intent(in) :: anew !< behind this step the next begins unloaded; 0: none
      logical, intent(in) :: constants !< constant loads or supports move the structure before the first step
      type(error_t), allocatable, intent(inout) :: error
      type(place_t) :: at(maxval(steps%case))
      logical :: at_rest
      integer :: i, k, n

      do i = 1, size(at)
         at(i)%factor = 0
      end do
      at_rest = .not. constants
      n = 0
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name /= 'step') cycle
         n = n + 1
         if (n == anew + 1 .and. anew > 0) then
            do k = 1, size(at)
               at(k)%factor = 0
            end do
            at_rest = .not. constants
         end if
         if (leaves_state(steps(n)%control)) cycle
         call check_way(namelist%groups(i), steps(n), at(steps(n)%case)%factor, at_rest, error)
         if (allocated(error)) return
         at_rest = .false.
      end do
   end subroutine check_ways

   !> Refuse values to land on that the step could meet only by turning round, which what it prescribes does not do by itself. What
   !> other controls pass may come in any order, but not twice in a row. `factor`: where the step begins, unallocated where
   !> that is not known; on return where it ends. `at_rest`: it begins with displacements of zero.
   subroutine check_way(group, step, factor, at_rest, error)
      type(group_t), intent(in) :: group
      type(step_t), intent(in) :: step
      real(wp), allocatable, intent(inout) :: factor
      logical, intent(in) :: at_rest
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: advice = ': a step goes one way; take another step for the way back'
      real(wp), allocatable :: levels(:)
      integer :: at

      allocate (levels(0))
      if (allocated(step%load_levels)) levels = step%load_levels
      if (step%ends_at_load_factor) then
         if (size(levels) == 0) then
            levels = [step%final_load_factor]
         else if (abs(levels(size(levels)) - step%final_load_factor) > 0) then
            levels = [levels, step%final_load_factor]
         end if
      end if
      if (step%control == control_timed .and. prescribes_monitored(step%prescribes)) then
         if (allocated(factor)) deallocate (factor)
         return
      else if (is_in_time(step%control)) then
         call pass_time(step, factor)
         return
      end if
      at = 0
      if (step%control == control_load) then
         if (allocated(factor)) then
            at = off_the_way(levels, factor)
         else
            at = off_the_way(levels)
         end if
      else if (step%control == control_arc_length .and. size(levels) > 2 .and. .not. has(group, 'load_factor')) then
         ! The end of the step was not chosen: levels that rise beyond it have forgotten it.
         if (off_the_way(levels(:size(levels) - 1)) == 0) at = off_the_way(levels)
      end if
      if (at > 0) call complain_about(group, 'load_levels', 'the load would go past the level or load_factor '//number(levels(at)) &
                                      //' to '//number(levels(at - 1))//' and come back'//advice, error)
      call check_repeated(group, 'load_levels', step%load_levels, error)
      call check_monitored(group, 'displacements', step%displacements, step%control == control_displacement, at_rest, error)
      call check_monitored(group, 'volumes', step%volumes, step%control == control_volume, .false., error)
      if (allocated(factor)) deallocate (factor)
      if (step%ends_at_load_factor .and. .not. (allocated(step%displacements) .or. allocated(step%volumes))) &
         factor = step%final_load_factor
   end subroutine check_way

   !> The load factor where a step in time ends; `factor` as for `check_way`.
   pure subroutine pass_time(step, factor)
      type(step_t), intent(in) :: step
      real(wp), allocatable, intent(inout) :: factor
      logical :: from_start
      from_start = .false.
      if (allocated(step%time%table)) from_start = step%time%table%x(1) > step%time%duration
      if (from_start .and. .not. allocated(factor)) return
      if (.not. allocated(factor)) factor = 0
      factor = step%time%factor(step%time%duration, factor)
   end subroutine pass_time

   !> The same for displacements or volumes.
   subroutine check_monitored(group, key, values, prescribed, from_zero, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      real(wp), allocatable, intent(in) :: values(:)
      logical, intent(in) :: prescribed
      logical, intent(in) :: from_zero !< the quantity is 0 at the start
      type(error_t), allocatable, intent(inout) :: error
      integer :: at

      if (.not. allocated(values) .or. allocated(error)) return
      at = 0
      if (prescribed .and. from_zero) at = off_the_way(values, 0.0_wp)
      if (prescribed .and. .not. from_zero) at = off_the_way(values)
      if (at > 0) then
         call complain_about(group, key, number(values(at))//' does not lie behind '//number(values(at - 1))//' on the way: ' &
                             //'what is prescribed would turn round; a step goes one way. Take another step for the way back, or ' &
                             //"control = 'arc_length' where the path itself turns round", error)
      else
         call check_repeated(group, key, values, error)
      end if
   end subroutine check_monitored

   subroutine check_repeated(group, key, values, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      real(wp), allocatable, intent(in) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      if (.not. allocated(values) .or. allocated(error)) return
      do i = 2, size(values)
         if (abs(values(i) - values(i - 1)) > 0) cycle
         call complain_about(group, key, number(values(i))//' stands there twice in a row; once is enough', error)
         return
      end do
   end subroutine check_repeated

   function number(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      text = text_of(real(value, dp))
   end function number
end module finshell_input_way
