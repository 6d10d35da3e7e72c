!> The rungs of a study: an input on meshes of different size, what each gave and cost, what the next will cost, which one to take.
module finshell_ladder
   use finshell_kinds, only: wp
   use finshell_richardson, only: estimate_errors, estimate_t
   implicit none
   private
   public :: rung_t, study_t, new_study, predicted_cost, rung_done, rung_failed, rung_left, rung_planned

   integer, parameter :: rung_planned = 0, rung_done = 1, rung_failed = 2, rung_left = 3 !< left: not run, for want of time or need

   !> Model: time grows with a power of the number of elements.
   real(wp), parameter :: usual_power = 1.25_wp, least_power = 1, most_power = 1.8_wp
   real(wp), parameter :: shortest = 0.1_wp !< seconds: below this starting takes more than solving

   type :: rung_t
      integer :: level = 0 !< of refinement
      integer :: state = rung_planned
      integer :: nodes = 0, elements = 0, unknowns = 0, iterations = 0
      real(wp) :: seconds = 0 !< of processor time
      real(wp) :: elapsed = 0
      real(wp) :: predicted = -1 !< seconds of processor time, before it ran; -1: not known
      character(len=:), allocatable :: reason !< why it failed or was left
      real(wp), allocatable :: values(:) !< of the monitors
      logical, allocatable :: missing(:)
   end type rung_t

   type :: study_t
      type(estimate_t), allocatable :: estimates(:) !< of each monitor
      real(wp), allocatable :: error(:, :) !< (monitors, rungs) relative; -1: nothing is known
      real(wp), allocatable :: scale(:) !< of each monitor: what errors are relative to; 0: it is zero
      real(wp), allocatable :: worst(:) !< (rungs) largest relative error; -1: nothing is known
      integer :: advised = 0 !< cheapest rung whose errors all meet the accuracy; 0: none
      logical :: trusted = .false. !< all monitors are in the asymptotic range
      real(wp) :: wanted_level = 0 !< level at which the errors of the finest rung would meet it, if none does
   end type study_t

contains

   !> Errors of all rungs that were done, and advice.
   pure subroutine new_study(study, rungs, accuracy, kinds)
      type(study_t), intent(out) :: study
      type(rung_t), intent(in) :: rungs(:) !< from coarse to fine
      real(wp), intent(in) :: accuracy !< relative
      integer, intent(in) :: kinds(:) !< of each monitor; those of one kind can be compared
      real(wp), parameter :: nothing = 1.0e-8_wp !< of the largest value of its kind
      !> A displacement that happens to come to nearly nothing is measured against this part of the largest one.
      real(wp), parameter :: part = 0.01_wp
      real(wp), allocatable :: largest(:)
      integer, allocatable :: at(:)
      integer :: i, k, m

      m = size(kinds)
      allocate (study%estimates(m), study%scale(m), largest(m), study%error(m, size(rungs)), study%worst(size(rungs)))
      study%error = -1
      study%worst = -1
      do k = 1, m
         at = pack([(i, i=1, size(rungs))], [(usable(rungs(i), k), i=1, size(rungs))])
         study%estimates(k) = estimate_errors([(rungs(at(i))%level, i=1, size(at))], [(rungs(at(i))%values(k), i=1, size(at))])
         largest(k) = 0
         do i = 1, size(at)
            largest(k) = max(largest(k), abs(rungs(at(i))%values(k)))
         end do
         study%scale(k) = abs(study%estimates(k)%limit)
      end do
      do k = 1, m
         associate (greatest => maxval(largest, mask=kinds == kinds(k)))
            study%scale(k) = max(study%scale(k), part*greatest)
            if (largest(k) <= nothing*greatest) study%scale(k) = 0
         end associate
         at = pack([(i, i=1, size(rungs))], [(usable(rungs(i), k), i=1, size(rungs))])
         do i = 1, size(at)
            if (study%estimates(k)%error(i) < 0) cycle
            if (study%scale(k) > 0) study%error(k, at(i)) = study%estimates(k)%error(i)/study%scale(k)
            if (.not. study%scale(k) > 0) study%error(k, at(i)) = 0
         end do
      end do
      if (m == 0) return
      do i = 1, size(rungs)
         if (all(study%error(:, i) >= 0)) study%worst(i) = maxval(study%error(:, i))
         if (study%worst(i) < 0 .or. study%worst(i) > accuracy) cycle
         if (study%advised == 0) study%advised = i
         if (rungs(i)%seconds < rungs(study%advised)%seconds) study%advised = i
      end do
      study%trusted = all(study%estimates%asymptotic .or. .not. study%scale > 0)
      do k = 1, m
         i = findloc(study%error(k, :) >= 0, .true., dim=1, back=.true.)
         if (i == 0) cycle
         associate (order => merge(study%estimates(k)%order, 1.0_wp, study%estimates(k)%asymptotic))
            if (study%error(k, i) > accuracy) study%wanted_level = max(study%wanted_level, &
               rungs(i)%level + log(study%error(k, i)/accuracy)/log(2.0_wp)/min(2.0_wp, max(0.5_wp, order)))
         end associate
      end do
   end subroutine new_study

   pure logical function usable(rung, k)
      type(rung_t), intent(in) :: rung
      integer, intent(in) :: k
      usable = rung%state == rung_done
      if (usable) usable = .not. rung%missing(k)
   end function usable

   !> Seconds of processor time of a rung, from those that are done: by the power with which the last two grew. -1: none is done.
   pure real(wp) function predicted_cost(rungs, level) result(seconds)
      type(rung_t), intent(in) :: rungs(:) !< from coarse to fine
      integer, intent(in) :: level
      integer, allocatable :: at(:)
      real(wp) :: power, start
      integer :: i
      seconds = -1
      at = pack([(i, i=1, size(rungs))], rungs%state == rung_done .and. rungs%level < level)
      if (size(at) == 0) return
      ! the cheapest shows what starting takes
      start = minval(rungs(at)%seconds)
      if (start > shortest) start = 0
      power = usual_power
      associate (last => rungs(at(size(at))))
         if (size(at) > 1) then
            associate (before => rungs(at(size(at) - 1)))
               if (before%seconds - start > shortest) power = log((last%seconds - start)/(before%seconds - start)) &
                  /log(real(last%elements, wp)/before%elements)
            end associate
         end if
         seconds = start + max(last%seconds - start, 0.2_wp*last%seconds) &
            *4.0_wp**((level - last%level)*min(most_power, max(least_power, power)))
      end associate
   end function predicted_cost
end module finshell_ladder
