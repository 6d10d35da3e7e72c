!> What loads and supports of a deck are step by step.
!>
!> An entry is one number of one set: a component of a support, a force along an axis, a pressure. A later step replaces it where
!> nodes (or elements) are the same, and the set is split where only some are; within a step loads add up. OP = NEW takes away what
!> earlier steps brought.
module finshell_deck_history
   use finshell_deck_schedule, only: perturbation, schedule_t, step_t, table_t
   use finshell_kinds, only: wp
   implicit none
   private
   public :: history_t, entry_t, boundary, nodal, distributed, on_surface, temperature

   integer, parameter :: boundary = 1, nodal = 2, distributed = 3, on_surface = 4, temperature = 5

   type :: entry_t
      integer :: kind = 0 !< card that brings it
      character(len=:), allocatable :: key !< what it is; entries of one key replace each other
      character(len=:), allocatable :: before, after, more !< of the group: before the set and the number, behind it
      character(len=:), allocatable :: set_key, set !< which key names the set, and its name
      integer, allocatable :: members(:) !< nodes or elements, ascending
      logical :: whole = .true. !< the members are those of the set, which are else to be listed
      real(wp) :: direction(3) = 0 !< of a number that is a vector
      integer :: form = 1 !< how the number is written: 1 number, 2 vector, 3 its root
      integer :: born = 0, touched = 0 !< steps; 0: before the first
      logical :: alive = .true.
      real(wp) :: magnitude = 0
      type(table_t) :: table
      !> For each step: value where it begins (a jump, if it is not the last one) and ends, whether it is there, corners between
      real(wp), allocatable :: start(:), value(:)
      logical, allocatable :: present(:)
      type(table_t), allocatable :: corners(:)
   end type entry_t

   type :: history_t
      type(schedule_t) :: schedule
      type(entry_t), allocatable :: entries(:)
      integer :: count = 0 !< of them
      integer :: step = 0 !< that is read
      integer :: cleared(5) = -1 !< step in which OP = NEW stood, by kind
   contains
      procedure :: begin
      procedure :: put
      procedure :: clear
      procedure :: end_step
   end type history_t

contains

   subroutine begin(self, schedule)
      class(history_t), intent(out) :: self
      type(schedule_t), intent(in) :: schedule
      self%schedule = schedule
      allocate (self%entries(16))
   end subroutine begin

   !> OP = NEW on a card of this kind.
   pure subroutine clear(self, kind)
      class(history_t), intent(inout) :: self
      integer, intent(in) :: kind
      if (self%step > 0) self%cleared(kind) = self%step
   end subroutine clear

   !> Enter a number of the present step. `split`: an earlier entry had to be split.
   subroutine put(self, new, split)
      class(history_t), intent(inout) :: self
      type(entry_t), intent(in) :: new
      logical, intent(out) :: split
      type(entry_t) :: entry
      integer, allocatable :: common(:), rest(:)
      logical :: passing
      integer :: i, known, n

      split = .false.
      rest = new%members
      passing = .false.
      if (self%step > 0 .and. new%kind /= boundary) passing = self%schedule%steps(self%step)%kind == perturbation
      known = merge(0, self%count, passing)
      do i = 1, known
         if (.not. self%entries(i)%alive .or. self%entries(i)%key /= new%key .or. any_perturbation(self, self%entries(i))) cycle
         if (size(self%entries(i)%members) == 0 .or. size(new%members) == 0) cycle
         if (self%entries(i)%members(1) > new%members(size(new%members)) .or. &
             self%entries(i)%members(size(self%entries(i)%members)) < new%members(1)) cycle
         common = intersection(self%entries(i)%members, new%members)
         if (size(common) == 0) cycle
         if (self%entries(i)%touched == self%step) then
            if (new%kind /= boundary) cycle ! they add up
            ! supports of one step may overlap where they say the same
            if (abs(self%entries(i)%magnitude - new%magnitude) <= 0 .and. same_table(self%entries(i)%table, new%table)) cycle
         end if
         if (size(common) < size(self%entries(i)%members)) then
            ! the rest of the earlier entry stays as it was
            split = .true.
            entry = self%entries(i)
            entry%members = without(entry%members, common)
            entry%whole = .false.
            call add(self, entry)
            self%entries(i)%members = common
            self%entries(i)%whole = .false.
            if (size(common) == size(new%members)) then
               self%entries(i)%set = new%set
               self%entries(i)%whole = new%whole
            end if
         end if
         associate (old => self%entries(i))
            old%touched = self%step
            old%magnitude = new%magnitude
            old%table = new%table
            if (new%kind == boundary) then
               rest = without(rest, common)
            else if (size(common) == size(new%members) .and. size(rest) > 0) then
               rest = [integer ::] ! this one goes on as the new one
            else
               old%magnitude = 0 ! the new one comes beside it
            end if
         end associate
      end do
      if (size(rest) == 0) return
      entry = new
      entry%born = self%step
      entry%touched = self%step
      entry%whole = new%whole .and. size(rest) == size(new%members)
      split = split .or. size(rest) < size(new%members)
      entry%members = rest
      n = size(self%schedule%steps)
      allocate (entry%start(n), entry%value(n), source=0.0_wp)
      allocate (entry%present(n), source=.false.)
      allocate (entry%corners(n))
      call add(self, entry)
   end subroutine put

   subroutine add(self, entry)
      class(history_t), intent(inout) :: self
      type(entry_t), intent(in) :: entry
      type(entry_t), allocatable :: grown(:)
      if (self%count == size(self%entries)) then
         allocate (grown(2*self%count))
         grown(:self%count) = self%entries
         call move_alloc(grown, self%entries)
      end if
      self%count = self%count + 1
      self%entries(self%count) = entry
   end subroutine add

   pure logical function same_table(a, b)
      type(table_t), intent(in) :: a, b
      same_table = allocated(a%times) .eqv. allocated(b%times)
      if (.not. (same_table .and. allocated(a%times))) return
      same_table = a%total .eqv. b%total
      if (same_table) same_table = size(a%times) == size(b%times)
      if (same_table) same_table = all(abs(a%times - b%times) <= 0) .and. all(abs(a%values - b%values) <= 0)
   end function same_table

   !> Whether an entry is of the one perturbation that it is born in.
   pure logical function any_perturbation(self, entry)
      class(history_t), intent(in) :: self
      type(entry_t), intent(in) :: entry
      any_perturbation = .false.
      if (entry%born > 0 .and. entry%kind /= boundary) any_perturbation = self%schedule%steps(entry%born)%kind == perturbation
   end function any_perturbation

   !> What all entries are in the step that has been read.
   subroutine end_step(self)
      class(history_t), intent(inout) :: self
      real(wp) :: last
      integer :: i, k
      logical :: touched

      k = self%step
      if (k == 0) return
      associate (step => self%schedule%steps(k))
         do i = 1, self%count
            associate (entry => self%entries(i))
               if (.not. entry%alive) cycle
               last = 0
               if (k > 1) last = entry%value(k - 1)
               entry%start(k) = last
               entry%value(k) = last
               if (any_perturbation(self, entry)) then
                  entry%present(k) = entry%born == k
                  if (entry%born == k) entry%value(k) = entry%magnitude
                  entry%alive = .false.
                  cycle
               end if
               touched = entry%touched == k .or. (k == 1 .and. entry%touched == 0)
               if (entry%touched < k .and. self%cleared(entry%kind) == k .and. step%kind /= perturbation) then
                  if (entry%kind == boundary) then
                     entry%alive = .false.
                     entry%value(k) = 0
                     cycle
                  end if
                  entry%magnitude = 0
                  if (allocated(entry%table%times)) deallocate (entry%table%times, entry%table%values)
                  touched = .true.
               end if
               entry%present(k) = .true.
               if (allocated(entry%table%times)) then
                  if (touched .or. entry%table%total) then
                     call keep_corners(entry%table, step, entry%magnitude, entry%corners(k))
                     entry%start(k) = entry%magnitude*entry%table%at(merge(step%began, 0.0_wp, entry%table%total))
                     entry%value(k) = entry%magnitude*entry%table%at(step%duration + merge(step%began, 0.0_wp, entry%table%total))
                  end if
               else if (touched) then
                  entry%value(k) = entry%magnitude
                  if (step%at_once) entry%start(k) = entry%magnitude
               end if
            end associate
         end do
      end associate
   end subroutine end_step

   !> What a table says within a step: times of the step, and values.
   pure subroutine keep_corners(table, step, magnitude, corners)
      type(table_t), intent(in) :: table
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: magnitude
      type(table_t), intent(out) :: corners
      real(wp), allocatable :: t(:)
      t = table%times
      if (table%total) t = t - step%began
      corners%values = magnitude*pack(table%values, t > 0 .and. t < step%duration)
      corners%times = pack(t, t > 0 .and. t < step%duration)
   end subroutine keep_corners

   pure function intersection(a, b) result(c)
      integer, intent(in) :: a(:), b(:)
      integer, allocatable :: c(:)
      integer :: i, j, n
      allocate (c(min(size(a), size(b))))
      i = 1
      j = 1
      n = 0
      do while (i <= size(a) .and. j <= size(b))
         if (a(i) == b(j)) then
            n = n + 1
            c(n) = a(i)
            i = i + 1
            j = j + 1
         else if (a(i) < b(j)) then
            i = i + 1
         else
            j = j + 1
         end if
      end do
      c = c(:n)
   end function intersection

   !> Members of an ascending list that are not in another.
   pure function without(a, b) result(c)
      integer, intent(in) :: a(:), b(:)
      integer, allocatable :: c(:)
      integer :: i, j, n
      allocate (c(size(a)))
      j = 1
      n = 0
      do i = 1, size(a)
         do while (j <= size(b))
            if (b(j) >= a(i)) exit
            j = j + 1
         end do
         if (j <= size(b)) then
            if (b(j) == a(i)) cycle
         end if
         n = n + 1
         c(n) = a(i)
      end do
      c = c(:n)
   end function without
end module finshell_deck_history
