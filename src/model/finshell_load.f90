!> Loads as the input states them. A load scales with the load factor unless it is constant; constant loads are brought in
!> before the first step and then stay.
module finshell_load
   use finshell_kinds, only: wp
   use finshell_factor, only: by_load_factor
   use finshell_span, only: span_t
   implicit none
   private
   public :: load_t
   public :: load_nodal, load_edge, load_traction, load_gravity, load_pressure
   public :: pressure_automatic, pressure_symmetric, pressure_unsymmetric

   !> Kinds: dead force and moment at the nodes of a node set; dead force per reference length of an edge set; dead force per
   !> reference area of an element set; acceleration acting on the mass of an element set; follower pressure on the deformed
   !> surface of an element set. Others have the names by which finshell_external knows them, and say in their files what they need.
   character(len=*), parameter :: load_nodal = 'force', load_edge = 'line', load_traction = 'traction', &
      load_gravity = 'gravity', load_pressure = 'pressure'

   !> Load stiffness of a pressure. Automatic: symmetric where that is exact (`finshell_pressure_region`), else unsymmetric.
   integer, parameter :: pressure_automatic = 0, pressure_symmetric = 1, pressure_unsymmetric = 2

   type :: load_t
      character(len=16) :: kind = load_nodal
      character(len=:), allocatable :: set !< node set (nodal), edge set (edge), element set (others)
      logical :: at_nodes = .false. !< of a kind that acts on elements or at nodes: `set` is a node set
      integer :: scaling = by_load_factor !< see finshell_factor
      type(span_t) :: span !< steps in which it is there
      !> Global components: force (nodal), force per length (edge), force per area (traction), acceleration (gravity).
      real(wp) :: vector(3) = 0
      real(wp) :: moment(3) = 0 !< nodal: works on the spin, so its direction stays fixed in space
      real(wp) :: pressure = 0 !< along the element normal (nodes counter-clockwise about it) when positive
      logical :: total = .false. !< nodal: the values are totals, shared equally by the nodes of the set
      integer :: stiffness = pressure_automatic
      !> What other kinds need.
      real(wp) :: point(3) = 0, direction(3) = 0, numbers(2) = 0
   end type load_t
end module finshell_load
