!> Connectors as the input states them: springs, bars, dashpots between nodes or to the ground, masses at nodes. Data only.
module finshell_connector
   use finshell_force_law, only: force_law_t
   use finshell_kinds, only: wp
   implicit none
   private
   public :: connector_t, find_connector, turns_nodes, is_spring, is_dashpot
   public :: spring_axes, spring_axis, spring_line, spring_rotation, spring_turn, bar, dashpot_axes, dashpot_line, &
      dashpot_rotation, point_mass

   !> Springs along the global axes, along a fixed direction, along the line between their ends; between rotations, isotropic or by
   !> axes, and about one axis. Dashpots likewise.
   integer, parameter :: spring_axes = 1, spring_axis = 2, spring_line = 3, spring_rotation = 4, spring_turn = 5, bar = 6, &
      dashpot_axes = 7, dashpot_line = 8, dashpot_rotation = 9, point_mass = 10

   type :: connector_t
      integer :: kind = 0
      character(len=:), allocatable :: name
      !> (ends, members): the nodes; of one end, the other is the ground, or `anchor`.
      integer, allocatable :: node(:, :)
      real(wp) :: anchor(3) = 0 !< other end of lines to the ground
      real(wp) :: vector(3) = 0 !< stiffnesses, or viscosities, along or about the axes
      real(wp) :: preload(3) = 0 !< forces or moments at rest, along or about the axes
      real(wp) :: direction(3) = 0 !< unit
      type(force_law_t) :: law !< along a line or a direction, about an axis
      real(wp), allocatable :: rest(:) !< (members) unstretched length
      real(wp) :: share = 1 !< of the values given that each member has
      real(wp) :: mass = 0 !< of a point; of a bar per reference length
      real(wp) :: inertia = 0 !< of a point against rotation
   end type connector_t

contains

   pure elemental logical function is_spring(self)
      type(connector_t), intent(in) :: self
      is_spring = self%kind >= spring_axes .and. self%kind <= bar
   end function is_spring

   pure elemental logical function is_dashpot(self)
      type(connector_t), intent(in) :: self
      is_dashpot = self%kind >= dashpot_axes .and. self%kind <= dashpot_rotation
   end function is_dashpot

   !> Does it act on the rotations of its nodes?
   pure elemental logical function turns_nodes(self)
      type(connector_t), intent(in) :: self
      select case (self%kind)
      case (spring_rotation, spring_turn, dashpot_rotation); turns_nodes = .true.
      case (point_mass); turns_nodes = self%inertia > 0
      case default; turns_nodes = .false.
      end select
   end function turns_nodes

   !> Its number by its name, 0: there is none.
   pure integer function find_connector(list, name) result(at)
      type(connector_t), intent(in) :: list(:)
      character(len=*), intent(in) :: name
      do at = size(list), 1, -1
         if (list(at)%name == name) return
      end do
   end function find_connector
end module finshell_connector
