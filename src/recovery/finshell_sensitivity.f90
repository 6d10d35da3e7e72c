!> Derivatives of monitors, and of the load factor, at an equilibrium state (doc/sensitivity.md).
!>
!> A number of the input: its variants (finshell_variant) give the change of the residual and of the monitors at the state, by
!> central differences; one solution with the tangent gives the motion that goes with it, and the change of all monitors
!> along this motion is added. Thickness of each element, position of each node: one adjoint solution for a monitor, and its
!> work (finshell_element_sensitivity).
module finshell_sensitivity
   use finshell_element_sensitivity, only: pieces_t, position_work, take_apart, thickness_work
   use finshell_equations, only: scatter
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_factor, only: by_load_factor
   use finshell_field, only: field_t, name_t
   use finshell_freedoms, only: n_nodal, ux, uz
   use finshell_kinds, only: wp
   use finshell_linear_response, only: border_row_t, linear_response_t
   use finshell_monitor_gradient, only: monitor_gradient, pressed_volume_gradient
   use finshell_monitor_response, only: find_along, find_gradient, find_row
   use finshell_monitoring, only: monitored_values, watch_t
   use finshell_sensitivity_choice, only: held_by_control, held_load_factor, per_element, per_node, per_parameter, &
      sensitivity_choice_t, the_load_factor
   use finshell_step, only: control_volume, prescribes_monitored
   use finshell_structure, only: structure_t
   use finshell_variant, only: variant_t
   implicit none
   private
   public :: sensitivities_t, varied_t, places, small_step

   !> A parameter is varied by a step to both sides: in central differences truncation (step^2) and rounding (epsilon/step) meet at
   !> the third root of epsilon, and residuals are linear in most parameters.
   integer, parameter :: places(2) = [-1, 1]
   real(wp), parameter :: coefficients(2) = places/2.0_wp
   real(wp), parameter :: small_step = epsilon(1.0_wp)**(1/3.0_wp)

   !> A parameter of the input and its variants, made once.
   type :: varied_t
      character(len=:), allocatable :: parameter
      real(wp) :: step = 0
      type(variant_t) :: variant(size(places))
   end type varied_t

   type :: sensitivities_t
      type(sensitivity_choice_t), allocatable :: choices(:)
      type(varied_t), allocatable :: varied(:)
      type(linear_response_t) :: response
      real(wp), allocatable :: values(:) !< columns of the history, in the order of the choices
      logical, allocatable :: missing(:)
      type(field_t), allocatable :: points(:), cells(:) !< of the result file, in the order of the choices
      integer :: gaps = 0 !< increments without values
      character(len=:), allocatable :: trouble !< why, at the first of them
   contains
      procedure :: column_names
      procedure :: clear
      procedure :: differentiate
      procedure :: complaint
   end type sensitivities_t

contains

   pure function column_names(self) result(names)
      class(sensitivities_t), intent(in) :: self
      type(name_t), allocatable :: names(:)
      integer :: i, n
      allocate (names(count(self%choices%per == per_parameter)))
      n = 0
      do i = 1, size(self%choices)
         if (self%choices(i)%per /= per_parameter) cycle
         n = n + 1
         names(n)%text = self%choices(i)%name
      end do
   end function column_names

   !> No values, of a structure with so many nodes and elements.
   subroutine clear(self, structure)
      class(sensitivities_t), intent(inout) :: self
      type(structure_t), intent(in) :: structure
      type(field_t) :: field
      integer :: i, n
      n = count(self%choices%per == per_parameter)
      self%values = spread(0.0_wp, 1, n)
      self%missing = spread(.true., 1, n)
      if (allocated(self%points)) deallocate (self%points, self%cells)
      allocate (self%points(0), self%cells(0))
      do i = 1, size(self%choices)
         field%name = self%choices(i)%name
         select case (self%choices(i)%per)
         case (per_element)
            n = size(structure%element_section)
            field%components = 1
         case (per_node)
            n = size(structure%mesh%coordinates, 2)
            field%components = 3
         case default
            cycle
         end select
         field%values = spread(spread(0.0_wp, 1, field%components), 2, n)
         field%missing = spread(.true., 1, n)
         if (field%components == 1) self%cells = [self%cells, field]
         if (field%components == 3) self%points = [self%points, field]
      end do
   end subroutine clear

   !> All derivatives at the converged state of a problem, which is left as it was.
   subroutine differentiate(self, problem, watches, control, with_fields)
      class(sensitivities_t), intent(inout) :: self
      type(equilibrium_t), intent(inout) :: problem
      type(watch_t), intent(in) :: watches(:)
      integer, intent(in) :: control !< of the increment
      logical, intent(in) :: with_fields !< they are to be written
      type(error_t), allocatable :: error
      integer :: i
      call self%clear(problem%structure)
      call self%response%begin(problem, by_load_factor, error)
      if (.not. allocated(error) .and. with_fields) call find_fields(self, problem, watches, control, error)
      do i = 1, size(self%varied)
         if (.not. allocated(error)) call find_columns(self, problem, watches, control, i, error)
      end do
      call self%response%finish(problem)
      if (.not. allocated(error)) return
      self%gaps = self%gaps + 1
      if (.not. allocated(self%trouble)) self%trouble = error%message
   end subroutine differentiate

   !> What is to be said at the end: '' or a sentence.
   pure function complaint(self) result(text)
      class(sensitivities_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = ''
      if (allocated(self%trouble)) text = '&sensitivity: some increments have no derivatives: '//self%trouble
   end function complaint

   !> What is held fixed, as a number of a monitor, held_load_factor or held_by_control (what the step prescribes).
   pure integer function held_in(choice, control) result(fixed)
      type(sensitivity_choice_t), intent(in) :: choice
      integer, intent(in) :: control
      fixed = choice%fixed
      if (fixed == held_by_control .and. .not. prescribes_monitored(control)) fixed = held_load_factor
   end function held_in

   !> All derivatives with respect to one parameter.
   subroutine find_columns(self, problem, watches, control, number, error)
      class(sensitivities_t), intent(inout) :: self
      type(equilibrium_t), intent(inout) :: problem
      type(watch_t), intent(in) :: watches(:)
      integer, intent(in) :: control
      integer, intent(in) :: number !< of the parameter
      type(error_t), allocatable, intent(inout) :: error
      type(border_row_t), allocatable :: row
      real(wp), allocatable :: load(:), x(:), own(:), along(:)
      logical, allocatable :: no_own(:), no_along(:)
      integer, allocatable :: used(:)
      real(wp) :: held, s, held_change
      integer :: at, fixed, i, k, last

      allocate (x(problem%n))
      used = used_watches(self, watches, number)
      call find_explicit(problem, self%varied(number), watches, used, prescribes_monitored(control), load, own, no_own, held, error)
      if (allocated(error)) return
      last = -huge(1)
      at = 0
      do i = 1, size(self%choices)
         associate (choice => self%choices(i))
            if (choice%per /= per_parameter) cycle
            at = at + 1
            if (choice%parameter /= self%varied(number)%parameter) cycle
            fixed = held_in(choice, control)
            if (fixed /= last) then
               call find_row(problem, watches, fixed, row)
               s = 0
               if (allocated(row)) then
                  held_change = held
                  if (fixed > 0) held_change = own(fixed)
                  call self%response%solve(problem, load, x, error, row, -held_change, s)
               else
                  call self%response%solve(problem, load, x, error)
               end if
               if (allocated(error)) return
               call find_along(problem, watches, used, x, s, along, no_along, error)
               if (allocated(error)) return
               last = fixed
            end if
            k = choice%monitor
            if (k == the_load_factor) then
               self%values(at) = s
               self%missing(at) = .false.
            else
               self%missing(at) = no_own(k) .or. no_along(k)
               if (.not. self%missing(at)) self%values(at) = own(k) + along(k)
            end if
         end associate
      end do
   end subroutine find_columns

   !> The monitors that are differentiated with respect to a parameter, or held fixed meanwhile.
   pure function used_watches(self, watches, number) result(used)
      type(sensitivities_t), intent(in) :: self
      type(watch_t), intent(in) :: watches(:)
      integer, intent(in) :: number
      integer, allocatable :: used(:)
      logical :: wanted(size(watches))
      integer :: i
      wanted = .false.
      do i = 1, size(self%choices)
         if (self%choices(i)%per /= per_parameter) cycle
         if (self%choices(i)%parameter /= self%varied(number)%parameter) cycle
         if (self%choices(i)%monitor > 0) wanted(self%choices(i)%monitor) = .true.
         if (self%choices(i)%fixed > 0) wanted(self%choices(i)%fixed) = .true.
      end do
      used = pack([(i, i=1, size(watches))], wanted)
   end function used_watches

   !> What a parameter does at the state as it is: to the residual, to the monitors, to what the step prescribes.
   subroutine find_explicit(problem, varied, watches, used, prescribed, load, own, missing, held, error)
      type(equilibrium_t), intent(inout) :: problem
      type(varied_t), intent(inout), target :: varied
      type(watch_t), intent(in) :: watches(:)
      integer, intent(in) :: used(:) !< of the watches; the others get 0
      logical, intent(in) :: prescribed !< the step prescribes something
      real(wp), allocatable, intent(out) :: load(:), own(:)
      logical, allocatable, intent(out) :: missing(:)
      real(wp), intent(out) :: held
      type(error_t), allocatable, intent(inout) :: error
      type(structure_t), pointer :: structure
      real(wp) :: r(problem%n), values(size(used))
      logical :: gone(size(used))
      integer :: k
      load = spread(0.0_wp, 1, problem%n)
      own = spread(0.0_wp, 1, size(watches))
      missing = spread(.false., 1, size(watches))
      held = 0
      structure => problem%structure
      do k = 1, size(places)
         associate (variant => varied%variant(k), part => coefficients(k)/varied%step)
            call variant%follow(problem, error)
            if (.not. allocated(error)) call variant%residual(problem, r, error)
            if (allocated(error)) then
               error%message = varied%parameter//': '//error%message
               return
            end if
            load = load + part*r
            if (size(used) > 0) call monitored_values(variant%problem, variant%problem%state, watches(used), values, gone)
            own(used) = own(used) + part*values
            missing(used) = missing(used) .or. gone
            if (.not. prescribed) cycle
            problem%structure => variant%structure
            held = held + part*problem%monitored(variant%problem%state)
            problem%structure => structure
         end associate
      end do
   end subroutine find_explicit

   !> Derivatives for each element and each node.
   subroutine find_fields(self, problem, watches, control, error)
      class(sensitivities_t), intent(inout) :: self
      type(equilibrium_t), intent(inout) :: problem
      type(watch_t), intent(in) :: watches(:)
      integer, intent(in) :: control
      type(error_t), allocatable, intent(inout) :: error
      type(border_row_t), allocatable :: row
      type(pieces_t) :: pieces
      real(wp), allocatable :: gradient(:), adjoint(:), dual(:, :), nodal(:, :), own(:, :), held(:, :)
      real(wp) :: rate, weight
      integer :: cell, fixed, i, point

      cell = 0
      point = 0
      allocate (adjoint(problem%n), dual(n_nodal, size(problem%state%displacement, 2)))
      do i = 1, size(self%choices)
         associate (choice => self%choices(i))
            if (choice%per == per_parameter) cycle
            fixed = held_in(choice, control)
            call find_row(problem, watches, fixed, row)
            if (choice%monitor == the_load_factor) then
               gradient = spread(0.0_wp, 1, problem%n)
               nodal = 0*dual
               rate = 1
            else
               call find_gradient(problem, watches(choice%monitor), gradient, rate, nodal)
            end if
            weight = 0
            if (allocated(row)) then
               call self%response%solve(problem, gradient, adjoint, error, row, rate, weight, adjoint=.true.)
            else
               call self%response%solve(problem, gradient, adjoint, error, adjoint=.true.)
            end if
            if (allocated(error)) return
            call scatter(problem%equations, adjoint(:problem%equations%n), dual)
            call take_apart(problem, dual, pieces)
            select case (choice%per)
            case (per_element)
               cell = cell + 1
               associate (field => self%cells(cell))
                  own = 0*field%values
                  call thickness_work(problem, pieces, field%values(1, :), own(1, :), error)
                  if (allocated(error)) return
                  field%values = field%values + (energy_part(choice%monitor) - weight*energy_part(fixed))*own
                  field%missing = .false.
               end associate
            case default
               point = point + 1
               associate (field => self%points(point))
                  own = 0*field%values
                  call position_work(problem, pieces, field%values, own, error)
                  if (allocated(error)) return
                  field%values = field%values + (energy_part(choice%monitor) - weight*energy_part(fixed))*own
                  if (volume_part(choice%monitor)) field%values = field%values + nodal(ux:uz, :)
                  if (fixed == held_by_control .and. control == control_volume) then
                     call pressed_volume_gradient(problem, .true., held)
                     field%values = field%values - weight*held(ux:uz, :)
                  else if (volume_part(fixed)) then
                     call monitor_gradient(problem, watches(fixed), held)
                     field%values = field%values - weight*held(ux:uz, :)
                  end if
                  field%missing = .false.
               end associate
            end select
         end associate
      end do

   contains

      !> What the stored energy counts for in a quantity.
      real(wp) function energy_part(monitor)
         integer, intent(in) :: monitor
         energy_part = 0
         if (monitor < 1) return
         if (watches(monitor)%field%name == 'energy') energy_part = watches(monitor)%factor
      end function energy_part

      logical function volume_part(monitor)
         integer, intent(in) :: monitor
         volume_part = .false.
         if (monitor > 0) volume_part = watches(monitor)%field%name == 'volume'
      end function volume_part
   end subroutine find_fields
end module finshell_sensitivity
