!> What a run reports: monitored quantities (columns of the history) and fields (result file). Data only.
module finshell_monitor
   use finshell_kinds, only: wp
   implicit none
   private
   public :: monitor_t, output_t, quantity_of
   public :: monitor_displacement, monitor_rotation, monitor_reaction, monitor_reaction_moment, monitor_thickness_stretch, &
      monitor_volume, monitor_energy, monitor_membrane_force, monitor_moment

   !> Displacement, rotation vector: mean over a node set. Reaction force and moment: sum over a node set. Thickness stretch,
   !> membrane force, moment: mean over the elements of an element set, or over those that touch a node set. Volume: enclosed
   !> by the pressurised elements. Energy: stored in the whole structure.
   integer, parameter :: monitor_displacement = 1, monitor_rotation = 2, monitor_reaction = 3, monitor_reaction_moment = 4, &
      monitor_thickness_stretch = 5, monitor_volume = 6, monitor_energy = 7, monitor_membrane_force = 8, monitor_moment = 9

   character(len=*), parameter :: quantity_names(9) = [character(len=17) :: 'displacement', 'rotation', 'reaction', &
                                                       'reaction_moment', 'thickness_stretch', 'volume', 'energy', &
                                                       'membrane_force', 'moment']

   type :: monitor_t
      character(len=:), allocatable :: name !< column heading
      integer :: quantity = monitor_displacement
      integer :: component = 0 !< 1..3: x, y, z, or 11, 22, 12 of resultants; 0 for scalars
      character(len=:), allocatable :: node_set, element_set !< one of them, as the quantity needs
      real(wp) :: factor = 1 !< multiplies the value, e.g. -1 for a downward displacement
   end type monitor_t

   type :: output_t
      logical :: fields = .true. !< write the result file at all
      integer :: every = 1 !< increments from one set of fields to the next; requested load levels are always written
      logical :: rotation = .false., reaction = .false.
      logical :: thickness_stretch = .true., membrane_force = .false., moment = .false., stress = .false.
      logical :: restart = .false. !< keep what a restart needs
   end type output_t

contains

   !> The number of a named quantity, 0 when unknown; `names` receives all of them, separated by commas.
   subroutine quantity_of(name, quantity, names)
      character(len=*), intent(in) :: name
      integer, intent(out) :: quantity
      character(len=:), allocatable, intent(out) :: names
      integer :: i
      quantity = findloc(quantity_names, name, dim=1)
      names = trim(quantity_names(1))
      do i = 2, size(quantity_names)
         names = names//', '//trim(quantity_names(i))
      end do
   end subroutine quantity_of
end module finshell_monitor
