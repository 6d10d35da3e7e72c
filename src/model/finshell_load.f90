!> Loads as the input states them. A load scales with the load factor unless it is `constant`; constant loads are brought in
!> before the first step and then stay.
module finshell_load
   use finshell_kinds, only: wp
   implicit none
   private
   public :: load_t
   public :: load_nodal, load_edge, load_traction, load_gravity, load_pressure
   public :: pressure_automatic, pressure_symmetric, pressure_unsymmetric

   !> Kinds: dead force and moment at the nodes of a node set; dead force per reference length of an edge set; dead force per
   !> reference area of an element set; acceleration acting on the mass of an element set; follower pressure on the deformed
   !> surface of an element set.
   integer, parameter :: load_nodal = 1, load_edge = 2, load_traction = 3, load_gravity = 4, load_pressure = 5

   !> Load stiffness of a pressure. Automatic: symmetric where that is exact (`finshell_pressure_region`), else unsymmetric.
   integer, parameter :: pressure_automatic = 0, pressure_symmetric = 1, pressure_unsymmetric = 2

   type :: load_t
      integer :: kind = load_nodal
      character(len=:), allocatable :: set !< node set (nodal), edge set (edge), element set (traction, gravity, pressure)
      !> Global components: force (nodal), force per length (edge), force per area (traction), acceleration (gravity).
      real(wp) :: vector(3) = 0
      real(wp) :: moment(3) = 0 !< nodal: works on the spin, so its direction stays fixed in space
      real(wp) :: pressure = 0 !< along the element normal (nodes counter-clockwise about it) when positive
      logical :: total = .false. !< nodal: the values are totals, shared equally by the nodes of the set
      logical :: constant = .false.
      integer :: stiffness = pressure_automatic
   end type load_t
end module finshell_load
