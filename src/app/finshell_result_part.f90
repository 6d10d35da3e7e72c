!> A result file of a run: the whole mesh, or a part of it with nodes and elements of its own numbers, and which increments it has.
module finshell_result_part
   use finshell_disk, only: check_replaceable, full_name, remove_in_system
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise
   use finshell_field, only: field_t, increment_t, name_t
   use finshell_gaps, only: count_gaps, gap_t
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t, elements_at, find_element_set, find_node_set
   use finshell_mesh_part, only: part_of_mesh
   use finshell_monitor, only: output_t
   use finshell_observer, only: record_t
   use finshell_recovery, only: recovery_t
   use finshell_report_rules, only: has_fields, passes
   use finshell_results, only: results_file_t
   use finshell_state, only: linear_change_t, state_t
   use finshell_status, only: status_input_error
   use finshell_step, only: is_in_time, leaves_state
   use finshell_storage, only: storage_t
   use finshell_version, only: version
   use finshell_written_fields, only: cell_entries, cell_fields, point_fields
   implicit none
   private
   public :: result_part_t

   type :: result_part_t
      type(output_t) :: output
      type(results_file_t) :: file
      character(len=:), allocatable :: name !< of the file, without its ending
      integer, allocatable :: entries(:) !< element fields
      integer, allocatable :: elements(:), nodes(:) !< of the mesh; unallocated: all
      integer :: last_written = -1
      logical :: due = .false. !< the increment under way is to be written
      type(field_t), allocatable :: more_points(:), more_cells(:) !< fields of the whole mesh, beside those of `output`
   contains
      procedure :: lay_out
      procedure :: find_due
      procedure :: check
      procedure :: create
      procedure :: go_on
      procedure :: append
      procedure :: remove
   end type result_part_t

contains

   !> Find the part of the mesh, and name the file after the job.
   subroutine lay_out(self, base_name, mesh)
      class(result_part_t), intent(inout) :: self
      character(len=*), intent(in) :: base_name
      type(mesh_t), intent(in) :: mesh
      logical, allocatable :: member(:)
      integer :: i
      self%name = base_name
      if (allocated(self%output%name)) self%name = base_name//'.'//self%output%name
      self%entries = cell_entries(self%output)
      if (allocated(self%elements)) deallocate (self%elements, self%nodes)
      if (.not. (allocated(self%output%element_set) .or. allocated(self%output%node_set))) return
      allocate (member(size(mesh%coordinates, 2)), source=.false.)
      if (allocated(self%output%element_set)) then
         self%elements = mesh%element_sets(find_element_set(mesh, self%output%element_set))%members
      else
         member(mesh%node_sets(find_node_set(mesh, self%output%node_set))%members) = .true.
         self%elements = elements_at(mesh, member)
         member = .false.
      end if
      do i = 1, size(self%elements)
         member(mesh%triangles(:, self%elements(i))) = .true.
      end do
      self%nodes = pack([(i, i=1, size(member))], member)
   end subroutine lay_out

   !> Is an increment to be written?
   subroutine find_due(self, record, before, at_landings, levels)
      class(result_part_t), intent(inout) :: self
      type(record_t), intent(in) :: record
      real(wp), intent(in) :: before(2) !< load factor and time at the increment before
      logical, intent(in) :: at_landings !< see has_fields
      real(wp), intent(in) :: levels(:) !< see has_fields
      associate (o => self%output)
         if (.not. o%fields) then
            self%due = .false.
         else if (leaves_state(record%control)) then
            self%due = .true.
         else if (o%last) then
            self%due = .false. ! `finish` of the reporter writes it
         else if (allocated(o%load_levels) .or. allocated(o%times)) then
            self%due = .false.
            if (o%every > 0) self%due = mod(record%increment, o%every) == 0
            if (allocated(o%load_levels)) &
               self%due = self%due .or. any(passes(before(1), record%load_factor, o%load_levels))
            if (allocated(o%times) .and. is_in_time(record%control)) &
               self%due = self%due .or. any(passes(before(2), record%motion%time, o%times))
         else
            self%due = has_fields(record, o%every, at_landings, levels)
         end if
      end associate
   end subroutine find_due

   !> Can the files take the place of older ones? That of the mesh stays.
   subroutine check(self, mesh, error)
      class(result_part_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      if (.not. (self%output%fields .or. allocated(error))) return
      if (allocated(mesh%results)) then
         if (full_name(mesh%results) == full_name(self%name//'.vtkhdf')) call raise(error, status_input_error, self%name &
            //'.vtkhdf: the results would replace the file that the mesh is read from; take another name (name in &job) or ' &
            //'folder (-o)')
      end if
      if (.not. allocated(error)) call check_replaceable(self%name//'.vtkhdf', error)
      if (.not. allocated(error)) call check_replaceable(self%name//'.xdmf', error)
   end subroutine check

   !> Create the file under another name (see `publish` of results_file_t), for fields as of this state.
   subroutine create(self, input_text, problem, recovery, columns, duration, error)
      class(result_part_t), intent(inout) :: self
      character(len=*), intent(in) :: input_text
      type(equilibrium_t), intent(in) :: problem
      type(recovery_t), intent(in) :: recovery
      type(name_t), intent(in) :: columns(:) !< of the history
      real(wp), intent(in) :: duration !< of all steps in time
      type(error_t), allocatable, intent(out) :: error
      type(field_t), allocatable :: points(:), cells(:)
      type(mesh_t) :: part
      call fields_of(self, problem, problem%state, recovery, points, cells)
      associate (mesh => problem%structure%mesh, o => self%output)
         part = mesh_of(self, mesh)
         call self%file%create(self%name//'~.vtkhdf', version, input_text, part%coordinates, part%triangles, points, cells, &
                               columns, error, published_as=self%name//'.vtkhdf', &
                               storage=storage_t(o%compress, o%single, duration), sets=part)
      end associate
   end subroutine create

   !> Go on with the file of an earlier run, if there is one, after an increment; `exists`: there is.
   subroutine go_on(self, input_text, problem, recovery, columns, duration, last, exists, error)
      class(result_part_t), intent(inout) :: self
      character(len=*), intent(in) :: input_text
      type(equilibrium_t), intent(in) :: problem
      type(recovery_t), intent(in) :: recovery
      type(name_t), intent(in) :: columns(:)
      real(wp), intent(in) :: duration
      integer, intent(in) :: last
      logical, intent(out) :: exists
      type(error_t), allocatable, intent(out) :: error
      type(field_t), allocatable :: points(:), cells(:)
      type(mesh_t) :: part
      inquire (file=self%name//'.vtkhdf', exist=exists)
      if (.not. exists) return
      call fields_of(self, problem, problem%state, recovery, points, cells)
      associate (mesh => problem%structure%mesh, o => self%output)
         part = mesh_of(self, mesh)
         call self%file%open_for_restart(self%name//'.vtkhdf', self%name//'~.vtkhdf', version, input_text, part%coordinates, &
                                         part%triangles, points, cells, columns, last, error, &
                                         storage_t(o%compress, o%single, duration), part)
      end associate
      self%last_written = last
   end subroutine go_on

   !> Write an increment.
   subroutine append(self, problem, state, row, recovery, gaps, error, change)
      class(result_part_t), intent(inout) :: self
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(increment_t), intent(in) :: row
      type(recovery_t), intent(in) :: recovery
      type(gap_t), allocatable, intent(inout) :: gaps(:)
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t), intent(in), optional, target :: change
      type(field_t), allocatable :: points(:), cells(:)
      integer :: i, k
      call fields_of(self, problem, state, recovery, points, cells, change)
      call self%file%append(row, points, cells, error)
      if (allocated(error)) return
      self%last_written = row%increment
      do i = 1, size(cells)
         if (.not. allocated(cells(i)%missing)) cycle
         ! derivatives account for their gaps themselves (finshell_sensitivity)
         if (allocated(self%more_cells)) then
            if (any([(cells(i)%name == self%more_cells(k)%name, k=1, size(self%more_cells))])) cycle
         end if
         call count_gaps(gaps, cells(i)%name, cells(i)%missing)
      end do
   end subroutine append

   !> Close and remove what was not published.
   subroutine remove(self)
      class(result_part_t), intent(inout) :: self
      type(error_t), allocatable :: ignored
      call self%file%close(ignored)
      call remove_in_system(self%name//'~.vtkhdf')
      call remove_in_system(self%name//'~.xdmf')
   end subroutine remove

   !> The fields of the part; of a part of the mesh also the numbers that its nodes and elements have in the whole.
   subroutine fields_of(self, problem, state, recovery, points, cells, change)
      class(result_part_t), intent(in) :: self
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(recovery_t), intent(in) :: recovery
      type(field_t), allocatable, intent(out) :: points(:), cells(:)
      type(linear_change_t), intent(in), optional, target :: change
      points = point_fields(problem, state, self%output, change, self%nodes)
      cells = cell_fields(self%output, recovery, self%elements)
      if (allocated(self%more_points)) then
         points = [points, part_of_fields(self%more_points, self%nodes)]
         cells = [cells, part_of_fields(self%more_cells, self%elements)]
      end if
      if (.not. allocated(self%nodes)) return
      points = [points, field_t('node_number', 1, reshape(real(self%nodes, wp), [1, size(self%nodes)]))]
      cells = [cells, field_t('element_number', 1, reshape(real(self%elements, wp), [1, size(self%elements)]))]
   end subroutine fields_of

   !> Fields of some of the items; unallocated: of all.
   pure function part_of_fields(fields, items) result(part)
      type(field_t), intent(in) :: fields(:)
      integer, allocatable, intent(in) :: items(:)
      type(field_t), allocatable :: part(:)
      integer :: i
      part = fields
      if (.not. allocated(items)) return
      do i = 1, size(part)
         part(i)%values = fields(i)%values(:, items)
         part(i)%missing = fields(i)%missing(items)
      end do
   end function part_of_fields

   !> The part as a mesh.
   function mesh_of(self, mesh) result(part)
      class(result_part_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      type(mesh_t) :: part
      if (allocated(self%nodes)) then
         call part_of_mesh(mesh, self%nodes, self%elements, part)
      else
         part = mesh
      end if
   end function mesh_of
end module finshell_result_part
