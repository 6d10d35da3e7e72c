!> What a run reports: monitored quantities (columns of the history) and fields (result file). Data only.
module finshell_monitor
   use finshell_kinds, only: wp
   use finshell_result_fields, only: find_field
   implicit none
   private
   public :: monitor_t, output_t, wanted_fields
   public :: restart_all, restart_last, restart_none
   public :: reduce_mean, reduce_sum, reduce_max, reduce_min, reduce_names

   !> How the values of several nodes or elements become one.
   integer, parameter :: reduce_mean = 1, reduce_sum = 2, reduce_max = 3, reduce_min = 4
   character(len=*), parameter :: reduce_names = 'mean, sum, max, min'

   !> What is kept for a run that is to go on: nothing; the last increment; all that have fields.
   integer, parameter :: restart_none = 0, restart_last = 1, restart_all = 2

   type :: monitor_t
      character(len=:), allocatable :: name !< column heading
      integer :: quantity = 0 !< number of the field (finshell_result_fields)
      integer :: component = 0 !< 0 for scalars
      integer :: place = 1 !< bottom, middle, top, or layer, of element fields that have places
      integer :: reduce = reduce_mean
      character(len=:), allocatable :: node_set, element_set, connector !< one of them, as the quantity needs
      real(wp) :: factor = 1 !< multiplies the value, e.g. -1 for a downward displacement
      real(wp), allocatable :: point(:) !< (3) about which moments are taken; unallocated: the quantity's own choice
   end type monitor_t

   !> A result file, and of the first one what else a run writes.
   type :: output_t
      character(len=:), allocatable :: name !< of the file, behind that of the job; unallocated: the first one
      character(len=:), allocatable :: element_set, node_set !< the part of the mesh: elements, or those that touch nodes
      logical :: fields = .true. !< write the result file at all
      integer :: every = 1 !< increments from one set of fields to the next; requested load levels are always written
      real(wp), allocatable :: load_levels(:), times(:) !< only increments that reach or pass these (and by `every`)
      logical :: last = .false. !< only the last increment
      integer, allocatable :: wanted(:) !< numbers of the fields, rising; unallocated: the default
      integer :: restart = restart_last !< keep what a restart needs
      integer :: compress = 1 !< level of zlib for the result file, 0 to 9
      logical :: single = .false. !< fields of the result file in single precision
      logical :: verbose = .false. !< a log of iterations
      logical :: energy = .false. !< the balance of energy in the history
   end type output_t

contains

   !> The fields of the result file, in its order.
   pure function wanted_fields(output) result(wanted)
      type(output_t), intent(in) :: output
      integer, allocatable :: wanted(:)
      if (allocated(output%wanted)) then
         wanted = output%wanted
      else
         wanted = [find_field('displacement'), find_field('thickness_stretch')]
      end if
   end function wanted_fields
end module finshell_monitor
