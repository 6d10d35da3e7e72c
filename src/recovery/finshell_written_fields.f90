!> Fields of a state that go into result files: those of the nodes, and those of elements that have been recovered.
module finshell_written_fields
   use finshell_equilibrium, only: equilibrium_t
   use finshell_field, only: field_t
   use finshell_field_batch, only: element_field_t, element_fields, n_element_fields
   use finshell_monitor, only: output_t, wanted_fields
   use finshell_monitoring, only: new_node_results
   use finshell_node_fields, only: node_field_t, node_fields, node_results_t, n_node_fields
   use finshell_recovery, only: recovery_t, recovered
   use finshell_result_fields, only: result_field_t, result_fields, place_name, error_entry, on_nodes, on_elements
   use finshell_state, only: state_t, linear_change_t
   implicit none
   private
   public :: point_fields, cell_fields, cell_entries

contains

   !> Nodal result fields.
   function point_fields(problem, state, output, change, nodes) result(fields)
      type(equilibrium_t), intent(in), target :: problem
      type(state_t), intent(in), target :: state
      type(output_t), intent(in) :: output
      type(linear_change_t), intent(in), optional, target :: change
      integer, intent(in), optional :: nodes(:) !< of these alone
      type(field_t), allocatable :: fields(:)
      type(node_results_t) :: results
      type(node_field_t) :: table(n_node_fields)
      integer, allocatable :: entries(:)
      integer :: i, k, node, number
      table = node_fields()
      call new_node_results(problem, state, results, change)
      entries = wanted_entries(output, on_nodes)
      allocate (fields(size(entries)))
      number = size(state%displacement, 2)
      if (present(nodes)) number = size(nodes)
      do i = 1, size(entries)
         fields(i)%name = trim(table(entries(i))%name)
         fields(i)%components = 3
         allocate (fields(i)%values(3, number))
         do k = 1, number
            node = k
            if (present(nodes)) node = nodes(k)
            fields(i)%values(:, k) = table(entries(i))%recover(results, node)
         end do
      end do
   end function point_fields

   !> The element fields to be written.
   pure function cell_entries(output) result(entries)
      type(output_t), intent(in) :: output
      integer, allocatable :: entries(:)
      entries = wanted_entries(output, on_elements)
   end function cell_entries

   !> Element result fields, one for each place: of all elements, in whose order they were recovered, or of some that were.
   function cell_fields(output, recovery, elements) result(fields)
      type(output_t), intent(in) :: output
      type(recovery_t), intent(in) :: recovery
      integer, intent(in), optional :: elements(:)
      type(field_t), allocatable :: fields(:)
      type(element_field_t) :: table(n_element_fields)
      integer, allocatable :: entries(:)
      integer :: i, n, p
      table = element_fields()
      entries = cell_entries(output)
      allocate (fields(sum([(size(recovery%fields(recovered(recovery, entries(i)))%values, 2), i=1, size(entries))])))
      n = 0
      do i = 1, size(entries)
         associate (made => recovery%fields(recovered(recovery, entries(i))))
            do p = 1, size(made%values, 2)
               n = n + 1
               if (entries(i) == error_entry) then
                  fields(n)%name = 'error'
                  fields(n)%components = 1
               else
                  fields(n)%name = place_name(table(entries(i)), p)
                  fields(n)%components = table(entries(i))%number
               end if
               if (present(elements)) then
                  fields(n)%values = made%values(:, p, recovery%place(elements))
                  fields(n)%missing = made%missing(p, recovery%place(elements))
               else
                  fields(n)%values = made%values(:, p, :)
                  fields(n)%missing = made%missing(p, :)
               end if
            end do
         end associate
      end do
   end function cell_fields

   !> Entries of the table of nodal or of element fields that are to be written.
   pure function wanted_entries(output, on) result(entries)
      type(output_t), intent(in) :: output
      integer, intent(in) :: on
      integer, allocatable :: entries(:)
      type(result_field_t), allocatable :: table(:)
      integer, allocatable :: wanted(:)
      table = result_fields()
      wanted = wanted_fields(output)
      entries = pack(table(wanted)%entry, table(wanted)%on == on)
   end function wanted_entries
end module finshell_written_fields
