!> Where a step has to pass and where it ends: load levels and values of the monitored displacement or volume, in the order of
!> passing.
module finshell_targets
   use finshell_kinds, only: wp, dp
   use finshell_status, only: status_invalid_argument
   use finshell_error, only: error_t, raise, text_of
   use finshell_step, only: step_t, control_load, control_displacement, control_volume, prescribes_monitored, off_the_way
   implicit none
   private
   public :: targets_t, new_targets

   type :: targets_t
      real(wp), allocatable :: level(:), value(:)
      real(wp), allocatable :: corner(:) !< of tables of what follows the factor: to land on whenever they are passed
      integer :: at_level = 1, at_value = 1 !< the next ones
      logical :: ends_at_level = .true., ends_at_value = .false.
      logical :: of_volume = .false. !< the values are volumes
      real(wp) :: first_size = 0, largest_size = 0, smallest_size = 0 !< magnitudes, in the measure of the control
      real(wp) :: sense = 1 !< of the load factor in the first increment
   contains
      procedure :: has_level, has_value, next_level, next_value, pass, reached, distance, corner_at, passed_corner, way_to_stop
   end type targets_t

   real(wp), parameter :: rounding = 1.0e-10_wp !< relative to the way of the step

contains

   !> The targets of a step that begins at a load factor and a monitored value. Errors: settings that lead nowhere.
   subroutine new_targets(self, step, factor, monitored, error, corners)
      type(targets_t), intent(out) :: self
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: factor, monitored
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: corners(:) !< of what follows the factor
      real(wp) :: way
      character(len=:), allocatable :: name

      name = 'step'
      if (allocated(step%name)) name = "step '"//step%name//"'"
      allocate (self%level(0), self%value(0))
      if (allocated(step%load_levels)) self%level = step%load_levels
      self%ends_at_level = step%ends_at_load_factor
      if (self%ends_at_level) then
         if (size(self%level) == 0) then
            self%level = [step%final_load_factor]
         else if (abs(self%level(size(self%level)) - step%final_load_factor) > 0) then
            self%level = [self%level, step%final_load_factor]
         end if
      end if
      if (allocated(step%displacements)) self%value = step%displacements
      self%of_volume = allocated(step%volumes)
      if (self%of_volume) self%value = step%volumes
      self%ends_at_value = size(self%value) > 0
      if (allocated(step%displacements) .and. allocated(step%volumes)) then
         call raise(error, status_invalid_argument, name//': displacements and volumes are given; one quantity can be monitored')
         return
      end if
      if (size(self%value) > 0 .and. .not. (allocated(step%node_set) .or. allocated(step%volumes))) then
         call raise(error, status_invalid_argument, name//': displacements are given, but no node set to monitor')
         return
      end if
      if (step%control < control_load .or. step%control > control_volume) then
         call raise(error, status_invalid_argument, name//': unknown control '//text_of(step%control))
         return
      end if
      if (step%control == control_displacement .and. .not. allocated(step%displacements)) then
         call raise(error, status_invalid_argument, name//': displacement control needs a node set and at least one displacement')
         return
      end if
      if (step%control == control_volume .and. .not. allocated(step%volumes)) then
         call raise(error, status_invalid_argument, name//': volume control needs at least one volume')
         return
      end if
      if (step%control == control_load .and. .not. self%ends_at_level) then
         call raise(error, status_invalid_argument, name//': load control needs a final load factor')
         return
      end if
      allocate (self%corner(0))
      if (present(corners)) self%corner = corners
      if (step%control == control_load) call check_way(name, self%level, factor, 'load factor', error)
      if (prescribes_monitored(step%control)) &
         call check_way(name, self%value, monitored, merge('volume      ', 'displacement', self%of_volume), error)
      if (allocated(error)) return

      if (prescribes_monitored(step%control)) then
         way = self%value(size(self%value)) - monitored
      else if (self%ends_at_level) then
         way = step%final_load_factor - factor
      else
         way = sign(1.0_wp, step%first_increment)
      end if
      self%sense = sign(1.0_wp, way)
      self%first_size = abs(step%first_increment)
      if (.not. self%first_size > 0) self%first_size = 0.1_wp*abs(way)
      self%largest_size = abs(step%largest_increment)
      self%smallest_size = abs(step%smallest_increment)
      if (.not. self%smallest_size > 0) self%smallest_size = 1.0e-6_wp*abs(way)
      if (.not. self%first_size > 0) self%first_size = 1
      if (step%control == control_load) call add_corners(self, factor)
      call self%pass(factor, monitored)
   end subroutine new_targets

   !> A prescribed load factor passes the corners on its way as it does its levels.
   subroutine add_corners(self, start)
      class(targets_t), intent(inout) :: self
      real(wp), intent(in) :: start
      real(wp), allocatable :: merged(:)
      real(wp) :: from, last
      integer :: i
      allocate (merged(0))
      from = start
      last = self%level(size(self%level))
      do i = 1, size(self%level)
         do
            if (.not. any(ahead(self%corner, from, self%level(i)))) exit
            if (self%level(i) > from) from = minval(self%corner, mask=ahead(self%corner, from, self%level(i)))
            if (.not. self%level(i) > from) from = maxval(self%corner, mask=ahead(self%corner, from, self%level(i)))
            merged = [merged, from]
         end do
         from = self%level(i)
         merged = [merged, from]
      end do
      self%level = merged

   contains

      !> Between two values, and not as good as one of them.
      elemental logical function ahead(x, from, to)
         real(wp), intent(in) :: x, from, to
         real(wp) :: near
         near = rounding*max(abs(last), abs(start))
         ahead = (x - from)*(to - x) > 0 .and. abs(x - from) > near .and. abs(to - x) > near
      end function ahead
   end subroutine add_corners

   !> Refuse values that a prescribed quantity could meet only by turning round.
   subroutine check_way(name, values, start, quantity, error)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values(:), start
      character(len=*), intent(in) :: quantity
      type(error_t), allocatable, intent(inout) :: error
      integer :: at
      at = off_the_way(values, start)
      if (at > 0) call raise(error, status_invalid_argument, name//': '//trim(quantity)//' '//text_of(real(values(at), dp)) &
         //' does not lie on the way from '//text_of(real(start, dp))//' over '//text_of(real(values(at - 1), dp)) &
         //': it turns round; a step goes one way, take another step for the way back')
   end subroutine check_way

   pure function has_level(self) result(yes)
      class(targets_t), intent(in) :: self
      logical :: yes
      yes = self%at_level <= size(self%level)
   end function has_level

   pure function has_value(self) result(yes)
      class(targets_t), intent(in) :: self
      logical :: yes
      yes = self%at_value <= size(self%value)
   end function has_value

   !> The next load level; there must be one.
   pure function next_level(self) result(value)
      class(targets_t), intent(in) :: self
      real(wp) :: value
      value = self%level(self%at_level)
   end function next_level

   !> The next monitored value; there must be one.
   pure function next_value(self) result(value)
      class(targets_t), intent(in) :: self
      real(wp) :: value
      value = self%value(self%at_value)
   end function next_value

   !> The corner at a factor, to rounding; without one the factor itself.
   pure real(wp) function corner_at(self, factor) result(x)
      class(targets_t), intent(in) :: self
      real(wp), intent(in) :: factor
      integer :: i
      x = factor
      do i = 1, size(self%corner)
         if (is_near(self%corner(i), factor)) x = self%corner(i)
      end do
   end function corner_at

   !> The first corner that an increment has passed; where it ended if there is none.
   pure real(wp) function passed_corner(self, from, to) result(x)
      class(targets_t), intent(in) :: self
      real(wp), intent(in) :: from, to !< factors
      integer :: i
      x = to
      do i = 1, size(self%corner)
         if (is_near(self%corner(i), from) .or. is_near(self%corner(i), to)) cycle
         if ((self%corner(i) - from)*(x - self%corner(i)) > 0) x = self%corner(i)
      end do
   end function passed_corner

   !> From a load factor to the next level or corner that it meets as it changes; huge where there is none.
   pure real(wp) function way_to_stop(self, factor, change) result(way)
      class(targets_t), intent(in) :: self
      real(wp), intent(in) :: factor, change
      integer :: i
      way = huge(way)
      if (self%has_level()) then
         if ((self%next_level() - factor)*change > 0) way = self%next_level() - factor
      end if
      do i = 1, size(self%corner)
         if (is_near(self%corner(i), factor) .or. .not. (self%corner(i) - factor)*change > 0) cycle
         if (abs(self%corner(i) - factor) < abs(way)) way = self%corner(i) - factor
      end do
   end function way_to_stop

   elemental logical function is_near(a, b)
      real(wp), intent(in) :: a, b
      is_near = abs(a - b) <= rounding*max(abs(a), abs(b))
   end function is_near

   !> Tick off what has been reached.
   pure subroutine pass(self, factor, monitored)
      class(targets_t), intent(inout) :: self
      real(wp), intent(in) :: factor, monitored
      do while (self%has_level())
         if (abs(factor - self%next_level()) > rounding*max(abs(factor), maxval(abs(self%level)))) exit
         self%at_level = self%at_level + 1
      end do
      do while (self%has_value())
         if (abs(monitored - self%next_value()) > rounding*maxval(abs(self%value))) exit
         self%at_value = self%at_value + 1
      end do
   end subroutine pass

   !> From a load factor and a monitored value to the end of the step, as part of the levels and values to pass; the nearer counts.
   pure function distance(self, factor, monitored) result(part)
      class(targets_t), intent(in) :: self
      real(wp), intent(in) :: factor, monitored
      real(wp) :: part
      part = huge(part)
      if (self%has_level()) part = abs(factor - self%level(size(self%level)))/max(maxval(abs(self%level)), tiny(part))
      if (self%has_value()) &
         part = min(part, abs(monitored - self%value(size(self%value)))/max(maxval(abs(self%value)), tiny(part)))
   end function distance

   !> Is the step done?
   pure function reached(self) result(yes)
      class(targets_t), intent(in) :: self
      logical :: yes
      yes = (self%ends_at_level .and. .not. self%has_level()) .or. (self%ends_at_value .and. .not. self%has_value())
   end function reached
end module finshell_targets
