!> The steps of a deck and when they are: what becomes of them, and how loads and supports are to follow them.
!>
!> Of three ways the first that can say it is taken.
!> plain: loads of one step only; the load factor of the steps scales them.
!> apart: linear steps; each has the loads that act at its end, by from_step and until_step.
!> clock: the load factor counts the steps (the k-th goes from k - 1 to k), and tables over it say what each load is when.
module finshell_deck_schedule
   use finshell_deck, only: data_t, deck_t
   use finshell_kinds, only: wp
   use finshell_text, only: lower_case
   implicit none
   private
   public :: schedule_t, step_t, table_t, read_schedule, read_table, plain, apart, clock, no_step, static, riks, linear, &
             perturbation, modes, in_time, window, acts

   integer, parameter :: plain = 1, apart = 2, clock = 3
   integer, parameter :: no_step = 0, static = 1, riks = 2, linear = 3, perturbation = 4, modes = 5, in_time = 6
   !> Of load factor behind a step, where loads of perturbations grow and all others stay.
   real(wp), parameter :: window = 1.0_wp/64

   type :: step_t
      integer :: kind = no_step
      integer :: number = 0 !< among the steps of the namelist; 0: it is none of them
      real(wp) :: duration = 1
      real(wp) :: began = 0 !< total time
      real(wp) :: first = 0, ramp = 0, last = 0 !< load factors: where the step begins, loads begin to change, it ends
      logical :: at_once = .false. !< loads without a table come in full at its beginning
   end type step_t

   type :: schedule_t
      integer :: way = plain
      type(step_t), allocatable :: steps(:)
      integer :: count = 0 !< of steps of the namelist
   end type schedule_t

   !> A table over time; not allocated: none.
   type :: table_t
      logical :: total = .false. !< over total time, not that of the step
      real(wp), allocatable :: times(:), values(:)
   contains
      procedure :: at
   end type table_t

contains

   pure logical function acts(keyword)
      character(len=*), intent(in) :: keyword
      acts = keyword == 'BOUNDARY' .or. keyword == 'CLOAD' .or. keyword == 'DLOAD' .or. keyword == 'DSLOAD' &
             .or. keyword == 'TEMPERATURE'
   end function acts

   subroutine read_schedule(deck, schedule)
      type(deck_t), intent(in) :: deck
      type(schedule_t), intent(out) :: schedule
      integer :: c, k, n
      logical :: nonlinear, perturbing
      character(len=:), allocatable :: word

      n = count([(deck%cards(c)%keyword == 'STEP', c=1, size(deck%cards))])
      allocate (schedule%steps(n))
      k = 0
      nonlinear = .false.
      perturbing = .false.
      do c = 1, size(deck%cards)
         select case (deck%cards(c)%keyword)
         case ('STEP')
            k = k + 1
            perturbing = deck%cards(c)%has('PERTURBATION')
            ! it stays switched on until a step says no
            if (deck%cards(c)%has('NLGEOM')) nonlinear = lower_case(deck%cards(c)%value('NLGEOM')) /= 'no'
            word = lower_case(deck%cards(c)%value('AMPLITUDE'))
         case ('STATIC', 'BUCKLE', 'FREQUENCY', 'DYNAMIC')
            if (k == 0) cycle
            associate (step => schedule%steps(k))
               if (step%kind /= no_step) cycle
               select case (deck%cards(c)%keyword)
               case ('BUCKLE'); step%kind = perturbation
               case ('FREQUENCY'); step%kind = modes
               case ('DYNAMIC'); step%kind = in_time
               case default
                  step%kind = merge(static, linear, nonlinear)
                  if (perturbing) step%kind = perturbation
                  if (deck%cards(c)%has('RIKS')) step%kind = riks
               end select
               schedule%count = schedule%count + 1
               step%number = schedule%count
               step%duration = duration_of(deck, c)
               if (step%kind >= perturbation .and. step%kind <= modes) step%duration = 0
               step%at_once = step%kind == in_time
               if (word == 'step') step%at_once = .true.
               if (word == 'ramp') step%at_once = .false.
            end associate
         end select
      end do
      call choose_way(deck, schedule)
      call set_clock(schedule)
   end subroutine read_schedule

   !> The time that a step takes: the second number, 1 where there is none.
   real(wp) function duration_of(deck, c)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(data_t) :: line
      real(wp) :: t
      logical :: ok
      duration_of = 1
      call deck%start(c, line)
      if (.not. deck%next(line)) return
      call line%number(2, t, ok)
      if (ok .and. t > 0) duration_of = t
   end function duration_of

   subroutine choose_way(deck, schedule)
      type(deck_t), intent(in) :: deck
      type(schedule_t), intent(inout) :: schedule
      integer :: c, k, loaded
      logical :: several

      loaded = 0
      several = .false.
      k = 0
      do c = 1, size(deck%cards)
         if (deck%cards(c)%keyword == 'STEP') k = k + 1
         if (.not. acts(deck%cards(c)%keyword)) cycle
         several = several .or. deck%cards(c)%has('AMPLITUDE')
         if (k > 0) then
            several = several .or. (loaded > 0 .and. loaded /= k) .or. lower_case(deck%cards(c)%value('OP')) == 'new' &
                      .and. deck%cards(c)%keyword == 'BOUNDARY'
            if (loaded == 0) several = several .or. any(schedule%steps(:k - 1)%kind /= modes) &
                                       .or. (schedule%steps(k)%kind == in_time .and. .not. schedule%steps(k)%at_once) &
                                       .or. (schedule%steps(k)%kind /= in_time .and. schedule%steps(k)%kind /= no_step &
                                             .and. any(schedule%steps(k + 1:)%kind == in_time))
            loaded = k
         end if
         if (deck%cards(c)%keyword == 'BOUNDARY' .and. any(schedule%steps%kind == in_time)) several = several .or. moves(deck, c)
      end do
      schedule%way = plain
      if (.not. several .or. size(schedule%steps) == 0) return
      schedule%way = clock
      if (all(schedule%steps%kind == linear .or. schedule%steps%kind == modes .or. schedule%steps%kind == no_step)) &
         schedule%way = apart
   end subroutine choose_way

   !> Whether a *BOUNDARY moves something.
   logical function moves(deck, c)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(data_t) :: line
      real(wp) :: x
      logical :: ok
      moves = .false.
      call deck%start(c, line)
      do while (deck%next(line))
         call line%number(4, x, ok)
         moves = moves .or. (ok .and. abs(x) > 0)
      end do
   end function moves

   subroutine set_clock(schedule)
      type(schedule_t), intent(inout) :: schedule
      real(wp) :: now, time
      logical :: disturbed
      integer :: k
      now = 0
      time = 0
      disturbed = .false.
      do k = 1, size(schedule%steps)
         associate (step => schedule%steps(k))
            step%began = time
            step%first = now
            step%ramp = now
            step%last = now
            select case (step%kind)
            case (perturbation); disturbed = .true.
            case (static, linear, in_time)
               if (disturbed) step%ramp = now + window
               disturbed = .false.
               now = now + 1
               step%last = now
            end select
            if (step%kind /= no_step) time = time + step%duration
         end associate
      end do
   end subroutine set_clock

   !> *AMPLITUDE of this name. `refusal`: '', or why not.
   subroutine read_table(deck, name, table, refusal)
      type(deck_t), intent(in) :: deck
      character(len=*), intent(in) :: name
      type(table_t), intent(out) :: table
      character(len=:), allocatable, intent(out) :: refusal
      type(data_t) :: line
      real(wp), allocatable :: x(:)
      real(wp) :: value
      integer :: c, i
      logical :: ok

      refusal = "there is no *AMPLITUDE '"//name//"'"
      do c = 1, size(deck%cards)
         if (deck%cards(c)%keyword /= 'AMPLITUDE') cycle
         if (lower_case(deck%cards(c)%value('NAME')) /= lower_case(name)) cycle
         refusal = ''
         associate (card => deck%cards(c))
            if (card%has('DEFINITION') .and. lower_case(card%value('DEFINITION')) /= 'tabular') &
               refusal = 'DEFINITION = '//card%value('DEFINITION')
            if (lower_case(card%value('VALUE')) == 'absolute') refusal = 'VALUE = ABSOLUTE'
            if (card%has('USER')) refusal = 'USER'
            if (card%has('SHIFTX') .or. card%has('SHIFTY')) refusal = 'SHIFTX or SHIFTY'
            if (refusal /= '') return
            table%total = lower_case(card%value('TIME')) == 'total time'
         end associate
         x = [real(wp) ::]
         call deck%start(c, line)
         do while (deck%next(line))
            do i = 1, line%fields
               call line%number(i, value, ok)
               if (.not. ok) refusal = "'"//line%field(i)%text//"' is no number"
               x = [x, value]
            end do
         end do
         if (refusal /= '') return
         if (size(x) < 2 .or. mod(size(x), 2) /= 0) then
            refusal = 'pairs of time and factor are expected'
         else if (any(x(3::2) <= x(1:size(x) - 2:2))) then
            refusal = 'its times do not ascend'
         else
            table%times = x(1::2)
            table%values = x(2::2)
         end if
         return
      end do
   end subroutine read_table

   !> The factor at a time; beyond its ends the table stays.
   pure real(wp) function at(self, time)
      class(table_t), intent(in) :: self
      real(wp), intent(in) :: time
      integer :: i, n
      n = size(self%times)
      if (time <= self%times(1)) then
         at = self%values(1)
      else if (time >= self%times(n)) then
         at = self%values(n)
      else
         i = count(self%times <= time)
         at = self%values(i) + (self%values(i + 1) - self%values(i))*(time - self%times(i))/(self%times(i + 1) - self%times(i))
      end if
   end function at
end module finshell_deck_schedule
