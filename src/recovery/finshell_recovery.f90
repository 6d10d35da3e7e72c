!> Fields on elements at a state, or of a linear change: by the table of finshell_element_fields, and the estimated error.
!>
!> What cannot be recovered is missing; it never ends a run. This happens to stresses, where the law ends before the surface of the
!> section but beyond the integration points, which are all that equilibrium asks for.
module finshell_recovery
   use finshell_kinds, only: wp, i4
   use finshell_assembly, only: paying_threads
   use finshell_discretisation, only: at_once, gather_elements, gathered_t, recover_gathered
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error_indicator, only: estimate_error, indicator_t
   use finshell_field_batch, only: element_field_t, element_fields, field_value, field_places, n_element_fields, change_quadratic, &
      change_none
   use finshell_result_fields, only: error_entry
   use finshell_growing, only: changed_state
   use finshell_state, only: state_t, moved_state, linear_change_t, small_part
   use finshell_status, only: status_ok
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: recovery_t, recovered_field_t, recover, recovered, most_layers

   !> A field of a list of elements. What is missing is 0.
   type :: recovered_field_t
      integer :: entry = 0 !< in the table, or error_entry
      real(wp), allocatable :: values(:, :, :) !< (component, place, element of the list)
      logical, allocatable :: missing(:, :) !< (place, element of the list)
   end type recovered_field_t

   !> Fields of a list of elements.
   type :: recovery_t
      integer, allocatable :: place(:) !< (elements of the mesh) where an element is in the list, 0: it is not
      type(recovered_field_t), allocatable :: fields(:)
   end type recovery_t

   !> The like before the last stage: what the table's procedures find, see recover_fields.
   type :: raw_t
      real(wp), allocatable :: values(:, :) !< (row, element)
      logical, allocatable :: missing(:, :) !< (place of a field, element)
      real(wp), allocatable :: frame(:, :, :) !< (3, 2, element)
   end type raw_t

contains

   !> Number of layers of the section that has most.
   pure integer function most_layers(structure)
      type(structure_t), intent(in) :: structure
      integer :: i
      most_layers = maxval([(size(structure%sections(i)%layers), i=1, size(structure%sections))])
   end function most_layers

   !> Fields of some elements at a state, or of a linear change of the state of the problem.
   subroutine recover(problem, state, elements, wanted, r, change)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: elements(:)
      integer, intent(in) :: wanted(:) !< entries of the table of element fields, error_entry
      type(recovery_t), intent(out) :: r
      type(linear_change_t), intent(in), optional :: change
      real(wp), parameter :: fibre_part = 1.0e-3_wp !< of a mode: small beside the motion that decides which fibres act
      type(element_field_t) :: table(n_element_fields)
      type(raw_t) :: raw, near, far
      type(state_t) :: base
      integer, allocatable :: entries(:)
      real(wp) :: part
      integer :: i

      allocate (r%place(size(problem%structure%element_section)), source=0)
      r%place(elements) = [(i, i=1, size(elements))]
      table = element_fields()
      entries = pack(wanted, wanted /= error_entry)
      if (.not. present(change)) then
         call recover_at(problem, state, elements, entries, table, raw)
      else
         base = problem%state
         part = small_part(change%motion, problem%detail)
         if (change%alone) then
            ! A mode has no sign: from both sides, with the fibres that counted for it.
            if (allocated(change%toward)) then
               base = moved_state(base, change%toward, small_part(change%toward, problem%detail))
               part = fibre_part*part
            end if
            call recover_at(problem, base, elements, entries, table, raw)
            call recover_at(problem, changed_state(base, change, part), elements, entries, table, near)
            call recover_at(problem, changed_state(base, change, -part), elements, entries, table, far)
            call combine([0.0_wp, 0.5_wp/part, -0.5_wp/part], [-2.0_wp, 1.0_wp, 1.0_wp]/(2*part**2))
         else
            ! From one side: where fibres begin to act the other one has another derivative.
            call recover_at(problem, base, elements, entries, table, raw)
            call recover_at(problem, changed_state(base, change, part), elements, entries, table, near)
            call recover_at(problem, changed_state(base, change, 2*part), elements, entries, table, far)
            call combine([1 - 1.5_wp/part, 2/part, -0.5_wp/part], &
                         [1 - 1.5_wp/part, 2/part, -0.5_wp/part] + [1.0_wp, -2.0_wp, 1.0_wp]/(2*part**2))
         end if
      end if
      call finish(table, entries, most_layers(problem%structure), raw, r)
      if (size(entries) < size(wanted)) r%fields = [r%fields, error_field(problem, state, elements, change)]

   contains

      !> To first order with weights w, to second with w2.
      subroutine combine(w, w2)
         real(wp), intent(in) :: w(3), w2(3)
         real(wp) :: v(3)
         integer :: f, first, last
         raw%missing = raw%missing .or. near%missing .or. far%missing
         last = 0
         do f = 1, size(entries)
            associate (field => table(entries(f)))
               first = last + 1
               last = last + field%raw*field_places(field, most_layers(problem%structure))
               if (field%change == change_none) cycle
               v = w
               if (field%change == change_quadratic) v = w2
               raw%values(first:last, :) = v(1)*raw%values(first:last, :) + v(2)*near%values(first:last, :) &
                  + v(3)*far%values(first:last, :)
            end associate
         end do
      end subroutine combine
   end subroutine recover

   !> The field `error`.
   function error_field(problem, state, elements, change) result(field)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: elements(:)
      type(linear_change_t), intent(in), optional :: change
      type(recovered_field_t) :: field
      type(indicator_t) :: indicator
      call estimate_error(problem, state, indicator, change)
      field%entry = error_entry
      field%values = reshape(indicator%eta(elements), [1, 1, size(elements)])
      field%missing = reshape(indicator%missing(elements), [1, size(elements)])
   end function error_field

   !> What the table's procedures find at one state, whatever the sections; in the order of `elements`.
   subroutine recover_at(problem, state, elements, entries, table, raw)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: elements(:), entries(:)
      type(element_field_t), intent(in) :: table(:)
      type(raw_t), intent(out) :: raw
      type(gathered_t) :: g
      real(wp), allocatable :: values(:, :), frame(:, :, :)
      integer, allocatable :: mine(:), places(:)
      integer(i4), allocatable :: status(:, :)
      integer :: first, i, last, layers, rows, s

      associate (structure => problem%structure)
         layers = most_layers(structure)
         places = [(field_places(table(entries(i)), layers), i=1, size(entries))]
         rows = sum(places*table(entries)%raw)
         allocate (raw%values(rows, size(elements)), raw%missing(sum(places), size(elements)), raw%frame(3, 2, size(elements)))
         do s = 1, size(structure%sections)
            mine = pack([(i, i=1, size(elements))], structure%element_section(elements) == s)
            !$omp parallel do schedule(dynamic) num_threads(paying_threads(size(mine))) default(shared) &
            !$omp private(g, values, status, frame, i, last)
            do first = 1, size(mine), at_once
               last = min(first + at_once - 1, size(mine))
               call gather_elements(structure, state, elements(mine(first:last)), g, problem%equations%held)
               allocate (values(rows, last - first + 1), status(sum(places), last - first + 1), frame(3, 2, last - first + 1))
               call recover_gathered(structure%sections(s), g, entries, layers, values, status, frame)
               do i = first, last
                  raw%values(:, mine(i)) = values(:, i - first + 1)
                  raw%missing(:, mine(i)) = status(:, i - first + 1) /= status_ok
                  raw%frame(:, :, mine(i)) = frame(:, :, i - first + 1)
               end do
               deallocate (values, status, frame)
            end do
            !$omp end parallel do
         end do
      end associate
   end subroutine recover_at

   !> The last stage, field by field.
   subroutine finish(table, entries, layers, raw, r)
      type(element_field_t), intent(in) :: table(:)
      integer, intent(in) :: entries(:), layers
      type(raw_t), intent(in) :: raw
      type(recovery_t), intent(inout) :: r
      integer :: e, f, p, place, row
      allocate (r%fields(size(entries)))
      row = 0
      place = 0
      do f = 1, size(entries)
         associate (field => table(entries(f)), made => r%fields(f), elements => size(raw%values, 2))
            made%entry = entries(f)
            allocate (made%values(field%number, field_places(field, layers), elements), source=0.0_wp)
            made%missing = raw%missing(place + 1:place + size(made%values, 2), :)
            do p = 1, size(made%values, 2)
               do e = 1, elements
                  if (.not. made%missing(p, e)) &
                     made%values(:, p, e) = field_value(field, raw%values(row + 1:row + field%raw, e), raw%frame(:, :, e))
               end do
               row = row + field%raw
            end do
            place = place + size(made%values, 2)
         end associate
      end do
   end subroutine finish

   !> Where a field of the table is in a recovery, which has it.
   pure integer function recovered(r, entry)
      type(recovery_t), intent(in) :: r
      integer, intent(in) :: entry
      do recovered = size(r%fields), 2, -1
         if (r%fields(recovered)%entry == entry) exit
      end do
   end function recovered
end module finshell_recovery
