!> What a run differentiates: a monitor, or the load factor, with respect to a parameter of the input, or to the thickness of each
!> element, or to the position of each node. Data only.
module finshell_sensitivity_choice
   use finshell_kinds, only: wp
   use finshell_monitor, only: monitor_t, reduce_sum
   use finshell_result_fields, only: result_field_t, result_fields
   implicit none
   private
   public :: sensitivity_choice_t, per_parameter, per_element, per_node
   public :: held_by_control, held_load_factor, the_load_factor, has_gradient

   !> One number; one of each element (thickness); three of each node (position).
   integer, parameter :: per_parameter = 0, per_element = 1, per_node = 2
   !> What is held fixed, beside the number of a monitor: what the step prescribes, or the load factor.
   integer, parameter :: held_by_control = -1, held_load_factor = 0
   !> In place of the number of a monitor that is differentiated.
   integer, parameter :: the_load_factor = 0

   type :: sensitivity_choice_t
      character(len=:), allocatable :: name !< of the column of the history, or of the field
      integer :: monitor = the_load_factor !< number of a monitor
      integer :: fixed = held_by_control !< number of a monitor
      integer :: per = per_parameter
      character(len=:), allocatable :: parameter !< 'group.key', as in a setting of the command line; unallocated: a field
      character(len=:), allocatable :: before, behind !< the other values of the key
      real(wp) :: value = 0 !< in the input
      real(wp) :: scale = 0 !< magnitude, > 0, of which differences are a small part
      integer :: line = 0 !< of the group in the input
   end type sensitivity_choice_t
contains

   !> Does a monitor have a gradient (finshell_monitor_gradient)? Displacements (mean or sum), the volume behind pressures, the
   !> stored energy have.
   pure logical function has_gradient(monitor)
      type(monitor_t), intent(in) :: monitor
      type(result_field_t), allocatable :: table(:)
      table = result_fields()
      select case (table(monitor%quantity)%name)
      case ('displacement'); has_gradient = monitor%reduce <= reduce_sum
      case ('volume', 'energy'); has_gradient = .true.
      case default; has_gradient = .false.
      end select
   end function has_gradient
end module finshell_sensitivity_choice
