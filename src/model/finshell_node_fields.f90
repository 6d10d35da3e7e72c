!> The table of nodal fields: names, components, units, and one short procedure each. The like of finshell_element_fields.
module finshell_node_fields
   use finshell_freedoms, only: rx, rz, ux, uz
   use finshell_kinds, only: wp
   use finshell_quaternion, only: quaternion_to_rotation_vector
   use finshell_state, only: state_t
   implicit none
   private
   public :: node_field_t, node_fields, node_results_t, n_node_fields

   integer, parameter :: n_node_fields = 7

   !> What nodal fields are made of.
   type :: node_results_t
      type(state_t), pointer :: state => null()
      real(wp), pointer :: internal_force(:, :) => null(), external_force(:, :) => null() !< (n_nodal, nodes), global
      real(wp), allocatable :: joined(:, :) !< their difference, with that of dependent nodes at what these depend on
      !> (3, nodes) spins of a linear change, which may be any multiple of a turn that a quaternion does not know; and the
      !> quaternions (4, nodes) that they change, null where the change is reported alone.
      real(wp), pointer :: spin(:, :) => null(), base(:, :) => null()
   end type node_results_t

   type :: node_field_t
      character(len=24) :: name = ''
      character(len=12) :: components = ''
      character(len=16) :: dimension = ''
      logical :: adds_up = .false. !< the value of several nodes is the sum, else the mean
      character(len=128) :: meaning = ''
      procedure(node_interface), pointer, nopass :: recover => null()
   end type node_field_t

   abstract interface
      pure function node_interface(results, node) result(values)
         import :: node_results_t, wp
         type(node_results_t), intent(in) :: results
         integer, intent(in) :: node
         real(wp) :: values(3)
      end function node_interface
   end interface

contains

   !> All nodal fields, in the order of the result files.
   pure function node_fields() result(table)
      type(node_field_t) :: table(n_node_fields)
      table = [ &
         field('displacement', 'x, y, z', 'length', .false., displacement, &
               'from the reference to the deformed position'), &
         field('rotation', 'x, y, z', '-', .false., rotation, &
               'vector of the rotation that takes directors of the reference to those of the deformed shell, in radians'), &
         field('reaction', 'x, y, z', 'force', .true., reaction, &
               'force that holds the node: what holds it is in balance with the loads'), &
         field('reaction_moment', 'x, y, z', 'force length', .true., reaction_moment, &
               'moment that holds the node, without the moments of forces about a point'), &
         field('velocity', 'x, y, z', 'length/time', .false., velocity, &
               'rate of the displacement in motion; zero at rest'), &
         field('spin', 'x, y, z', '1/time', .false., spin, &
               'angular velocity of the director in motion, in radians; zero at rest'), &
         field('acceleration', 'x, y, z', 'length/time^2', .false., acceleration, &
               'rate of the velocity in motion; zero at rest')]
   end function node_fields

   pure function displacement(results, node) result(values)
      type(node_results_t), intent(in) :: results
      integer, intent(in) :: node
      real(wp) :: values(3)
      values = results%state%displacement(:, node)
   end function displacement

   pure function rotation(results, node) result(values)
      type(node_results_t), intent(in) :: results
      integer, intent(in) :: node
      real(wp) :: values(3)
      logical :: linear
      linear = associated(results%spin)
      if (linear .and. associated(results%base)) linear = .not. any(abs(results%base(2:4, node)) > 0)
      if (linear) then
         values = results%spin(:, node)
      else
         values = quaternion_to_rotation_vector(results%state%rotation(:, node))
      end if
   end function rotation

   pure function reaction(results, node) result(values)
      type(node_results_t), intent(in) :: results
      integer, intent(in) :: node
      real(wp) :: values(3)
      values = results%internal_force(ux:uz, node) - results%external_force(ux:uz, node)
      if (allocated(results%joined)) values = results%joined(ux:uz, node)
   end function reaction

   pure function reaction_moment(results, node) result(values)
      type(node_results_t), intent(in) :: results
      integer, intent(in) :: node
      real(wp) :: values(3)
      values = results%internal_force(rx:rz, node) - results%external_force(rx:rz, node)
      if (allocated(results%joined)) values = results%joined(rx:rz, node)
   end function reaction_moment

   pure function velocity(results, node) result(values)
      type(node_results_t), intent(in) :: results
      integer, intent(in) :: node
      real(wp) :: values(3)
      values = 0
      if (in_motion(results)) values = results%state%velocity(ux:uz, node)
   end function velocity

   pure function spin(results, node) result(values)
      type(node_results_t), intent(in) :: results
      integer, intent(in) :: node
      real(wp) :: values(3)
      values = 0
      if (in_motion(results)) values = results%state%velocity(rx:rz, node)
   end function spin

   pure function acceleration(results, node) result(values)
      type(node_results_t), intent(in) :: results
      integer, intent(in) :: node
      real(wp) :: values(3)
      values = 0
      if (in_motion(results) .and. allocated(results%state%acceleration)) values = results%state%acceleration(ux:uz, node)
   end function acceleration

   !> Has the state rates? Linear changes have none.
   pure logical function in_motion(results)
      type(node_results_t), intent(in) :: results
      in_motion = allocated(results%state%velocity) .and. .not. associated(results%spin)
   end function in_motion

   !> An entry of the table.
   pure function field(name, components, dimension, adds_up, recover, meaning) result(entry)
      character(len=*), intent(in) :: name, components, dimension, meaning
      logical, intent(in) :: adds_up
      procedure(node_interface) :: recover
      type(node_field_t) :: entry
      entry%name = name
      entry%components = components
      entry%dimension = dimension
      entry%adds_up = adds_up
      entry%meaning = meaning
      entry%recover => recover
   end function field
end module finshell_node_fields
