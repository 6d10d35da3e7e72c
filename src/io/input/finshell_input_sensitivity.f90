!> The groups &sensitivity of an input file: what is differentiated, and with respect to what.
module finshell_input_sensitivity
   use, intrinsic :: iso_fortran_env, only: int64
   use finshell_error, only: error_t
   use finshell_input_common, only: check_name
   use finshell_kinds, only: wp
   use finshell_monitor, only: monitor_t
   use finshell_namelist, only: check_all_used, complain_about, count_groups, get, group_t, namelist_t
   use finshell_sensitivity_choice, only: has_gradient, held_by_control, held_load_factor, per_element, per_node, per_parameter, &
      sensitivity_choice_t, the_load_factor
   use finshell_setting, only: find_group, new_setting, setting_t
   use finshell_step, only: prescribes_monitored, step_t
   use finshell_text, only: parse_integer, parse_real
   implicit none
   private
   public :: read_sensitivities

   character(len=*), parameter :: gradients = 'displacement (mean or sum), volume and energy'

contains

   subroutine read_sensitivities(namelist, monitors, steps, choices, error)
      type(namelist_t), intent(inout) :: namelist
      type(monitor_t), intent(in) :: monitors(:)
      type(step_t), intent(in) :: steps(:)
      type(sensitivity_choice_t), allocatable, intent(out) :: choices(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: i, k, n
      allocate (choices(count_groups(namelist, 'sensitivity')))
      n = 0
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name /= 'sensitivity' .or. allocated(error)) cycle
         n = n + 1
         call read_sensitivity(namelist, i, monitors, any(prescribes_monitored(steps%control)), choices(n), error)
         if (allocated(error)) return
         do k = 1, n - 1
            if (choices(k)%name == choices(n)%name) call complain_about(namelist%groups(i), 'name', "there is a sensitivity '" &
                                                                        //choices(n)%name//"' already", error)
         end do
         if (any([(monitors(k)%name == choices(n)%name, k=1, size(monitors))])) call complain_about(namelist%groups(i), 'name', &
            "there is a monitor '"//choices(n)%name//"' already", error)
      end do
   end subroutine read_sensitivities

   subroutine read_sensitivity(namelist, at, monitors, prescribed, choice, error)
      type(namelist_t), intent(inout) :: namelist
      integer, intent(in) :: at !< number of the group
      type(monitor_t), intent(in) :: monitors(:)
      logical, intent(in) :: prescribed !< a step prescribes a displacement or a volume
      type(sensitivity_choice_t), intent(out) :: choice
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: monitor, fixed, parameter
      associate (group => namelist%groups(at))
         choice%line = group%line
         call get(group, 'monitor', monitor, error)
         call get(group, 'parameter', parameter, error)
         call get(group, 'fixed', fixed, error, default='')
         call get(group, 'scale', choice%scale, error, default=0.0_wp, minimum=0.0_wp)
         call find_monitor(group, 'monitor', monitor, monitors, choice%monitor, error)
         if (allocated(error)) return
         if (fixed /= '') call find_monitor(group, 'fixed', fixed, monitors, choice%fixed, error)
         if (allocated(error)) return
         if (choice%monitor == the_load_factor .and. (choice%fixed == held_load_factor .or. &
                                                      (choice%fixed == held_by_control .and. .not. prescribed))) then
            call complain_about(group, 'monitor', "the load factor is what is held fixed; say what is instead: fixed = 'NAME' of " &
                                //'a monitor, or a step that prescribes a displacement or a volume', error)
         else if (choice%monitor > 0 .and. choice%monitor == choice%fixed) then
            call complain_about(group, 'fixed', "the monitor '"//fixed//"' is held fixed, its derivative is 0", error)
         else if (choice%fixed > 0) then
            if (.not. has_gradient(monitors(choice%fixed))) call complain_about(group, 'fixed', "'"//fixed &
               //"' cannot be held fixed; these quantities can: "//gradients, error)
         end if
         if (allocated(error)) return
         select case (parameter)
         case ('element_thickness'); choice%per = per_element
         case ('node_position'); choice%per = per_node
         end select
         if (choice%per == per_parameter) then
            call find_parameter(namelist, at, parameter, choice, error)
         else if (choice%monitor > 0) then
            if (.not. has_gradient(monitors(choice%monitor))) call complain_about(group, 'monitor', "'"//monitor &
               //"' has no derivative for each element or node; these quantities have: "//gradients &
               //'. With respect to a parameter of the input all have', error)
         end if
         if (allocated(error)) return
         call get(group, 'name', choice%name, error, default='d_'//monitor//'_d_'//plain(parameter))
         call check_name(group, 'name', choice%name, error)
         call check_all_used(group, error)
      end associate
   end subroutine read_sensitivity

   !> A monitor by its name, or the load factor.
   subroutine find_monitor(group, key, name, monitors, number, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key, name
      type(monitor_t), intent(in) :: monitors(:)
      integer, intent(out) :: number
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: names
      integer :: i
      number = the_load_factor
      if (allocated(error) .or. name == 'load_factor') return
      names = 'load_factor'
      do i = 1, size(monitors)
         if (monitors(i)%name == name) number = i
         names = names//', '//monitors(i)%name
      end do
      if (number == the_load_factor) call complain_about(group, key, "there is no monitor '"//name//"'; expected one of: " &
                                                         //names, error)
   end subroutine find_monitor

   !> A number of the input: 'group.key', 'group[name].key', with several numbers 'group.key(2)'.
   subroutine find_parameter(namelist, at, parameter, choice, error)
      type(namelist_t), intent(in) :: namelist
      integer, intent(in) :: at !< the group that asks
      character(len=*), intent(in) :: parameter
      type(sensitivity_choice_t), intent(inout) :: choice
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: expected = 'a number of the input (material.c10, section[2].thickness, load.vector(3)), ' &
                                     //'element_thickness or node_position'
      character(len=:), allocatable :: complaint, place
      type(setting_t) :: setting
      type(error_t), allocatable :: refusal
      integer(int64) :: taken
      integer :: i, k, number, which
      logical :: ok

      place = parameter
      which = 0
      i = index(parameter, '(', back=.true.)
      if (i > 1 .and. parameter(len(parameter):) == ')') then
         place = parameter(:i - 1)
         call parse_integer(parameter(i + 1:len(parameter) - 1), taken, ok)
         which = int(min(taken, 1000000_int64))
         if (.not. ok) which = -1
      end if
      call new_setting(setting, place//'=1', complaint)
      if (.not. allocated(complaint)) call find_group(setting, namelist, k, refusal)
      if (allocated(complaint) .or. allocated(refusal)) k = 0
      if (k > 0) then
         associate (there => namelist%groups(k))
            do i = 1, size(there%entries)
               if (there%entries(i)%key == setting%key) exit
            end do
            if (i > size(there%entries)) then
               call complain_about(namelist%groups(at), 'parameter', '&'//there%name//" has no '"//setting%key &
                                   //"'; what is to be varied has to be given", error)
               return
            end if
            number = size(there%entries(i)%values)
            if (which == 0 .and. number == 1) which = 1
            if (which < 1 .or. which > number) then
               call complain_about(namelist%groups(at), 'parameter', "say which of its numbers, as '"//place//"(1)'", error)
               return
            end if
            choice%parameter = parameter
            choice%before = place//'='
            choice%behind = ''
            do k = 1, number
               call parse_real(there%entries(i)%values(k)%text, choice%value, ok)
               if (.not. ok .or. there%entries(i)%values(k)%quoted) then
                  call complain_about(namelist%groups(at), 'parameter', "'"//place//"' is no number", error)
                  return
               end if
               if (k < which) choice%before = choice%before//there%entries(i)%values(k)%text//' '
               if (k > which) choice%behind = choice%behind//' '//there%entries(i)%values(k)%text
            end do
            call parse_real(there%entries(i)%values(which)%text, choice%value, ok)
         end associate
         if (.not. choice%scale > 0) choice%scale = abs(choice%value)
         if (.not. choice%scale > 0) call complain_about(namelist%groups(at), 'parameter', &
            "'"//parameter//"' is 0; say of what magnitude it may be: scale = ...", error)
      else if (allocated(refusal) .and. index(parameter, '.') > 0) then
         call complain_about(namelist%groups(at), 'parameter', &
                             refusal%message(index(refusal%message, '=1: ') + len('=1: '):), error)
      else
         call complain_about(namelist%groups(at), 'parameter', "found '"//parameter//"', expected "//expected, error)
      end if
   end subroutine find_parameter

   !> As part of a name.
   pure function plain(parameter) result(name)
      character(len=*), intent(in) :: parameter
      character(len=:), allocatable :: name
      integer :: i
      name = ''
      do i = 1, len(parameter)
         if (scan(parameter(i:i), '[(') > 0) name = name//'.'
         if (scan(parameter(i:i), '[]()') == 0) name = name//parameter(i:i)
      end do
   end function plain
end module finshell_input_sensitivity
