!> Values of fields along a line: where it is nearest to the surface, of the reference or of the deformed one. Fields on nodes are
!> interpolated in the element there, fields on elements are those of the element.
module finshell_probing
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use finshell_equilibrium, only: equilibrium_t
   use finshell_field_batch, only: element_field_t, element_fields, field_places, n_element_fields
   use finshell_kinds, only: wp
   use finshell_monitoring, only: new_node_results
   use finshell_nearest, only: find_nearest, place_t
   use finshell_node_fields, only: node_field_t, node_fields, n_node_fields, node_results_t
   use finshell_probe, only: points_of, probe_t
   use finshell_recovery, only: most_layers, recover, recovered, recovery_t
   use finshell_result_fields, only: error_entry, on_elements, on_nodes, place_name, result_field_t, result_fields
   use finshell_state, only: linear_change_t, state_t
   implicit none
   private
   public :: probe_columns, probe_values

contains

   !> Names of the columns of `probe_values`, separated by commas.
   function probe_columns(problem, probe) result(names)
      type(equilibrium_t), intent(in) :: problem
      type(probe_t), intent(in) :: probe
      character(len=:), allocatable :: names
      type(element_field_t) :: table(n_element_fields)
      type(result_field_t), allocatable :: fields(:)
      integer :: f, p
      table = element_fields()
      fields = result_fields()
      names = 's,x,y,z,distance,element'
      do f = 1, size(probe%wanted)
         associate (field => fields(probe%wanted(f)))
            if (field%on == on_nodes .or. field%entry == error_entry) then
               call add(trim(field%name), trim(field%components))
            else
               do p = 1, field_places(table(field%entry), most_layers(problem%structure))
                  call add(place_name(table(field%entry), p), trim(field%components))
               end do
            end if
         end associate
      end do

   contains

      subroutine add(name, components)
         character(len=*), intent(in) :: name, components !< 'x, y, z'
         integer :: first, last
         first = 1
         do
            last = index(components(first:)//',', ',') + first - 2
            names = names//','//name
            if (components /= '') names = names//'_'//components(first:last)
            if (last >= len(components)) exit
            first = last + 3
         end do
      end subroutine add
   end function probe_columns

   !> Rows of a probe at a state, or of a linear change: (columns, points).
   subroutine probe_values(problem, state, probe, places, values, change)
      type(equilibrium_t), intent(in), target :: problem
      type(state_t), intent(in), target :: state
      type(probe_t), intent(in) :: probe
      type(place_t), allocatable, intent(inout) :: places(:) !< found before; unallocated: not yet
      real(wp), allocatable, intent(out) :: values(:, :)
      type(linear_change_t), intent(in), optional, target :: change
      type(result_field_t), allocatable :: fields(:)
      type(node_field_t) :: nodal(n_node_fields)
      type(node_results_t) :: results
      type(recovery_t) :: recovery
      real(wp), allocatable :: points(:, :), row(:)
      integer, allocatable :: entries(:), elements(:)
      integer :: f, i, k, p

      fields = result_fields()
      nodal = node_fields()
      points = points_of(probe)
      associate (mesh => problem%structure%mesh)
         if (.not. allocated(places)) then
            allocate (places(probe%points))
            call find_nearest(mesh%coordinates, mesh%triangles, points, places)
         end if
         if (probe%deformed) call find_nearest(mesh%coordinates + problem%state%displacement, mesh%triangles, points, places)
         elements = listed(places%element, size(mesh%triangles, 2))
         entries = pack(fields(probe%wanted)%entry, fields(probe%wanted)%on == on_elements)
         if (size(entries) > 0) call recover(problem, state, elements, entries, recovery, change)
         call new_node_results(problem, state, results, change)
         do k = 1, probe%points
            associate (nodes => mesh%triangles(:, places(k)%element), w => places(k)%weights)
               row = [norm2(points(:, k) - points(:, 1)), &
                      matmul(mesh%coordinates(:, nodes) + state%displacement(:, nodes), w), places(k)%distance, &
                      real(places(k)%element, wp)]
               do f = 1, size(probe%wanted)
                  associate (field => fields(probe%wanted(f)))
                     if (field%on == on_nodes) then
                        row = [row, matmul(reshape([(nodal(field%entry)%recover(results, nodes(i)), i=1, 3)], [3, 3]), w)]
                     else
                        associate (made => recovery%fields(recovered(recovery, field%entry)), &
                                   at => recovery%place(places(k)%element))
                           do p = 1, size(made%values, 2)
                              row = [row, merge(ieee_value(1.0_wp, ieee_quiet_nan), made%values(:, p, at), made%missing(p, at))]
                           end do
                        end associate
                     end if
                  end associate
               end do
            end associate
            if (.not. allocated(values)) allocate (values(size(row), probe%points))
            values(:, k) = row
         end do
      end associate
   end subroutine probe_values

   !> The numbers that stand in a list, each once, rising.
   pure function listed(list, most) result(numbers)
      integer, intent(in) :: list(:), most
      integer, allocatable :: numbers(:)
      logical :: member(most)
      integer :: i
      member = .false.
      member(list) = .true.
      numbers = pack([(i, i=1, most)], member)
   end function listed
end module finshell_probing
