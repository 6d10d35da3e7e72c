!> Where a step has to pass and where it ends: load levels and displacements, in the order of passing.
module finshell_targets
   use finshell_kinds, only: wp, dp
   use finshell_status, only: status_invalid_argument
   use finshell_error, only: error_t, raise, text_of
   use finshell_step, only: step_t, control_load, control_displacement, control_arc_length
   implicit none
   private
   public :: targets_t, new_targets

   type :: targets_t
      real(wp), allocatable :: level(:), displacement(:)
      integer :: at_level = 1, at_displacement = 1 !< the next ones
      logical :: ends_at_level = .true., ends_at_displacement = .false.
      real(wp) :: first_size = 0, largest_size = 0, smallest_size = 0 !< magnitudes, in the measure of the control
      real(wp) :: sense = 1 !< of the load factor in the first increment
   contains
      procedure :: has_level, has_displacement, next_level, next_displacement, pass, reached
   end type targets_t

   real(wp), parameter :: rounding = 1.0e-10_wp !< relative to the way of the step

contains

   !> The targets of a step that begins at a load factor and monitored displacement. Errors: settings that lead nowhere.
   subroutine new_targets(self, step, factor, displacement, error)
      type(targets_t), intent(out) :: self
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: factor, displacement
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: way
      character(len=:), allocatable :: name

      name = 'step'
      if (allocated(step%name)) name = "step '"//step%name//"'"
      allocate (self%level(0), self%displacement(0))
      if (allocated(step%load_levels)) self%level = step%load_levels
      self%ends_at_level = step%ends_at_load_factor
      if (self%ends_at_level) then
         if (size(self%level) == 0) then
            self%level = [step%final_load_factor]
         else if (abs(self%level(size(self%level)) - step%final_load_factor) > 0) then
            self%level = [self%level, step%final_load_factor]
         end if
      end if
      if (allocated(step%displacements)) self%displacement = step%displacements
      self%ends_at_displacement = size(self%displacement) > 0
      if (size(self%displacement) > 0 .and. .not. allocated(step%node_set)) then
         call raise(error, status_invalid_argument, name//': displacements are given, but no node set to monitor')
         return
      end if
      if (step%control < control_load .or. step%control > control_arc_length) then
         call raise(error, status_invalid_argument, name//': unknown control '//text_of(step%control))
         return
      end if
      if (step%control == control_displacement .and. size(self%displacement) == 0) then
         call raise(error, status_invalid_argument, name//': displacement control needs a node set and at least one displacement')
         return
      end if
      if (step%control == control_load .and. .not. self%ends_at_level) then
         call raise(error, status_invalid_argument, name//': load control needs a final load factor')
         return
      end if

      if (step%control == control_displacement) then
         way = self%displacement(size(self%displacement)) - displacement
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
      call self%pass(factor, displacement)
   end subroutine new_targets

   pure function has_level(self) result(yes)
      class(targets_t), intent(in) :: self
      logical :: yes
      yes = self%at_level <= size(self%level)
   end function has_level

   pure function has_displacement(self) result(yes)
      class(targets_t), intent(in) :: self
      logical :: yes
      yes = self%at_displacement <= size(self%displacement)
   end function has_displacement

   !> The next load level; there must be one.
   pure function next_level(self) result(value)
      class(targets_t), intent(in) :: self
      real(wp) :: value
      value = self%level(self%at_level)
   end function next_level

   !> The next displacement; there must be one.
   pure function next_displacement(self) result(value)
      class(targets_t), intent(in) :: self
      real(wp) :: value
      value = self%displacement(self%at_displacement)
   end function next_displacement

   !> Tick off what has been reached.
   pure subroutine pass(self, factor, displacement)
      class(targets_t), intent(inout) :: self
      real(wp), intent(in) :: factor, displacement
      do while (self%has_level())
         if (abs(factor - self%next_level()) > rounding*max(abs(factor), maxval(abs(self%level)))) exit
         self%at_level = self%at_level + 1
      end do
      do while (self%has_displacement())
         if (abs(displacement - self%next_displacement()) > rounding*maxval(abs(self%displacement))) exit
         self%at_displacement = self%at_displacement + 1
      end do
   end subroutine pass

   !> Is the step done?
   pure function reached(self) result(yes)
      class(targets_t), intent(in) :: self
      logical :: yes
      yes = (self%ends_at_level .and. .not. self%has_level()) .or. (self%ends_at_displacement .and. .not. self%has_displacement())
   end function reached
end module finshell_targets
