!> The result file: VTKHDF (UnstructuredGrid with Steps, version 2.0), and finshell's own data in the group /finshell.
!>
!> The mesh is written once, in reference coordinates; every converged increment appends one step of each field and is
!> flushed, so that a killed run leaves a readable file. Readers count steps by the attribute NSteps, which is written last.
!> VTK wants rising times. Where nothing moves in time (storage_t%duration 0) the time of a step is its increment number, as a load
!> factor may fall; elsewhere it is that of the state, and states of the same time follow each other closely (`same_time`). Load
!> factor and, in the latter case, time are field data. An XDMF file of the same base name describes the same datasets to readers
!> that do not know VTKHDF. Use:
!> `create` or `open_for_restart`, then `append` for every increment, then `close`; others may read the file meanwhile.
module finshell_results
   use finshell_error, only: error_t, raise, text_of
   use finshell_field, only: check_fields, check_increment, field_t, gaps, increment_t, layout, name_t, with_gaps
   use finshell_hdf5, only: hdf5_file_t, hdf5_integer, hdf5_line, hdf5_real, hdf5_single, hdf5_table_t
   use finshell_kinds, only: i8, wp
   use finshell_mesh, only: mesh_t
   use finshell_record_tables, only: attach_table, record_tables_t
   use finshell_status, only: status_invalid_argument
   use finshell_storage, only: check_range, storage_t
   use finshell_stored_sets, only: write_sets
   use finshell_vtkhdf, only: compare_mesh, index_splits, same_lists, same_ranks, same_values, write_mesh
   use finshell_xdmf, only: xdmf_file_t, xdmf_name
   implicit none
   private
   public :: results_file_t

   !> A field and the list of where each of its steps begins.
   type :: series_t
      type(hdf5_table_t) :: values, offsets
      integer :: bytes = 8 !< of a number in the file
   end type series_t

   type :: results_file_t
      private
      type(hdf5_file_t) :: file
      type(xdmf_file_t) :: xdmf
      character(len=:), allocatable :: name
      integer :: nodes = 0, elements = 0
      integer(i8) :: steps = 0, lines = 0
      type(storage_t) :: storage
      type(field_t), allocatable :: point_layout(:), cell_layout(:) !< names and components
      type(series_t), allocatable :: points(:), cells(:)
      type(series_t) :: load_factor, time !< as field data of VTKHDF
      real(wp) :: instant = 0 !< time of the last step
      type(name_t), allocatable :: monitors(:)
      type(hdf5_table_t) :: times, same(size(same_lists)), log
      type(record_tables_t) :: history
   contains
      procedure :: create, open_for_restart, publish, append, log_line
      procedure :: close => close_results
      procedure, private :: attach, write_step, step_size, next_instant
   end type results_file_t

   !> Distance of steps of the same time, as a part of the duration of the input.
   real(wp), parameter :: same_time = 1.0e-9_wp

contains

   !> Create NAME.vtkhdf and NAME.xdmf for a file name NAME.vtkhdf, replacing existing ones.
   subroutine create(self, file_name, version, input_text, coordinates, triangles, point_fields, cell_fields, monitors, error, &
      & published_as, storage, sets)
      class(results_file_t), intent(inout) :: self
      character(len=*), intent(in) :: file_name
      character(len=*), intent(in) :: version !< of finshell
      character(len=*), intent(in) :: input_text !< the whole input file
      real(wp), intent(in) :: coordinates(:, :) !< (3, nodes), reference configuration
      integer, intent(in) :: triangles(:, :) !< (3, elements)
      type(field_t), intent(in) :: point_fields(:), cell_fields(:) !< names and components of what `append` will receive
      type(name_t), intent(in) :: monitors(:)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), optional, intent(in) :: published_as !< the name the file will have after `publish`, if another one
      type(storage_t), optional, intent(in) :: storage
      type(mesh_t), optional, intent(in) :: sets !< the same mesh, whose sets are to be kept
      call check_fields(point_fields, 'point field', error)
      if (.not. allocated(error)) call check_fields(cell_fields, 'cell field', error)
      if (.not. allocated(error)) call self%close(error)
      if (allocated(error)) return
      self%name = file_name
      if (present(published_as)) self%name = published_as
      self%nodes = size(coordinates, 2)
      self%elements = size(triangles, 2)
      self%steps = 0
      self%storage = storage_t()
      if (present(storage)) self%storage = storage
      call self%file%create(file_name, error, self%storage%compress)
      if (allocated(error)) return
      call write_mesh(self%file, coordinates, triangles, error)
      if (.not. allocated(error)) call self%file%make_group('/finshell', error)
      if (.not. allocated(error)) call self%file%set_text('/finshell', 'version', version, error)
      if (.not. allocated(error)) call self%file%write_text('/finshell/input', input_text, error)
      if (present(sets) .and. .not. allocated(error)) call write_sets(self%file, sets, error)
      if (.not. allocated(error)) call self%file%make_group('/finshell/history', error)
      if (.not. allocated(error)) call self%attach(.true., point_fields, cell_fields, monitors, error)
      if (.not. allocated(error)) call self%file%flush(error)
      if (.not. allocated(error)) call self%xdmf%create(xdmf_name(file_name), self%name, self%nodes, self%elements, error)
   end subroutine create

   !> Give the files the names they are to be found under, replacing older ones.
   subroutine publish(self, error)
      class(results_file_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      call self%file%rename(self%name, error)
      if (.not. allocated(error)) call self%xdmf%publish(xdmf_name(self%name), error)
   end subroutine publish

   !> Continue a file of the same mesh, fields and monitors after increment `last`; arguments otherwise as for `create`. What is to
   !> stay is copied to a new file, for `publish`: a run that was killed while it wrote can leave traces of a further
   !> step, which can be ignored but not safely overwritten.
   subroutine open_for_restart(self, file_name, new_name, version, input_text, coordinates, triangles, point_fields, cell_fields, &
      & monitors, last, error, storage, sets)
      class(results_file_t), intent(inout) :: self
      character(len=*), intent(in) :: file_name, new_name, version, input_text
      real(wp), intent(in) :: coordinates(:, :)
      integer, intent(in) :: triangles(:, :)
      type(field_t), intent(in) :: point_fields(:), cell_fields(:)
      type(name_t), intent(in) :: monitors(:)
      integer, intent(in) :: last
      type(error_t), allocatable, intent(out) :: error
      type(storage_t), optional, intent(in) :: storage
      type(mesh_t), optional, intent(in) :: sets
      type(results_file_t) :: old
      type(error_t), allocatable :: ignored
      old%name = file_name
      old%nodes = size(coordinates, 2)
      old%elements = size(triangles, 2)
      if (present(storage)) old%storage = storage
      call old%file%open(file_name, error)
      if (allocated(error)) return
      call old%file%get_integer('/VTKHDF/Steps', 'NSteps', old%steps, error)
      if (.not. allocated(error)) call compare_mesh(old%file, file_name, coordinates, triangles, error)
      if (.not. allocated(error)) call old%attach(.false., point_fields, cell_fields, monitors, error)
      if (.not. allocated(error)) call self%create(new_name, version, input_text, coordinates, triangles, &
         & point_fields, cell_fields, monitors, error, published_as=file_name, storage=storage, sets=sets)
      if (.not. allocated(error)) call copy_steps(old, self, point_fields, cell_fields, last, error)
      call old%close(ignored)
   end subroutine open_for_restart

   !> Append the complete steps of a file up to an increment to a new one.
   subroutine copy_steps(old, new, point_fields, cell_fields, last, error)
      type(results_file_t), intent(in) :: old
      type(results_file_t), intent(inout) :: new
      type(field_t), intent(in) :: point_fields(:), cell_fields(:)
      integer, intent(in) :: last
      type(error_t), allocatable, intent(out) :: error
      type(increment_t), allocatable :: records(:)
      type(field_t), allocatable :: points(:), cells(:)
      character(len=:), allocatable :: line
      integer(i8) :: step
      integer :: i
      points = point_fields
      cells = cell_fields
      call old%history%read_all(old%steps, records, error)
      if (.not. allocated(error) .and. old%storage%duration > 0) call get_times()
      do step = 0, old%lines - 1
         if (.not. allocated(error)) call old%log%get_line(step, line, error)
         if (.not. allocated(error)) call new%log_line(line, error)
      end do
      do step = 0, old%steps - 1
         if (allocated(error)) return
         if (records(step + 1)%increment > last) exit
         do i = 1, size(points)
            call get_step(old%points(i), old%nodes, points(i))
         end do
         do i = 1, size(cells)
            call get_step(old%cells(i), old%elements, cells(i))
         end do
         if (.not. allocated(error)) call new%append(records(step + 1), points, cells, error)
      end do
   contains
      subroutine get_step(series, items, field)
         type(series_t), intent(in) :: series
         integer, intent(in) :: items
         type(field_t), intent(inout) :: field
         if (.not. allocated(field%values)) allocate (field%values(field%components, items))
         if (.not. allocated(error)) call series%values%get_reals(step*items, field%values, error)
         field%missing = gaps(field%values)
      end subroutine get_step

      subroutine get_times()
         real(wp) :: times(1, old%steps)
         integer :: k
         call old%time%values%get_reals(0_i8, times, error)
         do k = 1, merge(size(records), 0, .not. allocated(error))
            records(k)%motion = times(:, k)
         end do
      end subroutine get_times
   end subroutine copy_steps

   !> Append one converged increment: fields in the order of `create`, with values. Nothing is written if anything is wrong.
   subroutine append(self, record, point_fields, cell_fields, error)
      class(results_file_t), intent(inout) :: self
      type(increment_t), intent(in) :: record
      type(field_t), intent(in) :: point_fields(:), cell_fields(:)
      type(error_t), allocatable, intent(out) :: error
      if (.not. self%file%is_open()) then
         call raise(error, status_invalid_argument, 'results cannot be appended: the result file is not open')
      else if (self%storage%duration > 0 .and. .not. allocated(record%motion)) then
         call raise(error, status_invalid_argument, self%name//': increment '//text_of(record%increment)//' has no time')
      end if
      if (.not. allocated(error)) call check_increment(record, self%monitors, error)
      if (.not. allocated(error)) call check_fields(point_fields, self%point_layout, self%nodes, 'node', record%increment, error)
      if (.not. allocated(error)) call check_fields(cell_fields, self%cell_layout, self%elements, 'element', &
         & record%increment, error)
      if (.not. allocated(error)) call check_range(point_fields, self%points%bytes, record%increment, error)
      if (.not. allocated(error)) call check_range(cell_fields, self%cells%bytes, record%increment, error)
      if (.not. allocated(error)) call self%file%begin_writing(self%step_size(), index_splits(self%steps), error)
      if (.not. allocated(error)) call self%write_step(record, point_fields, cell_fields, error)
      if (.not. allocated(error)) call self%file%flush(error) ! the data first: what a reader finds is complete
      if (.not. allocated(error)) call self%file%set_integers('/VTKHDF/Steps', 'NSteps', [self%steps + 1], error)
      if (.not. allocated(error)) call self%file%flush(error)
      call self%file%end_writing()
      if (allocated(error)) return
      self%instant = self%next_instant(record)
      self%steps = self%steps + 1
      call self%xdmf%append(int(self%steps) - 1, record, self%instant, point_fields, cell_fields, self%points%bytes, &
                            self%cells%bytes, error)
   end subroutine append

   !> The time of the next step of the file.
   pure real(wp) function next_instant(self, record)
      class(results_file_t), intent(in) :: self
      type(increment_t), intent(in) :: record
      next_instant = record%increment
      if (.not. self%storage%duration > 0) return
      next_instant = record%motion(1)
      if (self%steps > 0) next_instant = max(next_instant, self%instant + same_time*self%storage%duration)
   end function next_instant

   !> Append a line to the solver log in the file; it reaches the disk with the next increment.
   subroutine log_line(self, line, error)
      class(results_file_t), intent(inout) :: self
      character(len=*), intent(in) :: line
      type(error_t), allocatable, intent(out) :: error
      call self%log%put_line(self%lines, line, error)
      if (.not. allocated(error)) self%lines = self%lines + 1
   end subroutine log_line

   subroutine close_results(self, error)
      class(results_file_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      call self%xdmf%close()
      if (.not. self%file%is_open()) return
      if (allocated(self%points)) then
         call close_series(self%points)
         call close_series(self%cells)
         deallocate (self%points, self%cells)
      end if
      call close_series(self%load_factor)
      call close_series(self%time)
      call self%same%close()
      call self%history%close()
      call self%times%close()
      call self%log%close()
      call self%file%close(error)
   end subroutine close_results

   !> Create the tables that grow, or open those of an existing file, which must hold all complete steps.
   subroutine attach(self, fresh, point_fields, cell_fields, monitors, error)
      class(results_file_t), intent(inout) :: self
      logical, intent(in) :: fresh
      type(field_t), intent(in) :: point_fields(:), cell_fields(:)
      type(name_t), intent(in) :: monitors(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      self%monitors = monitors
      self%point_layout = layout(point_fields)
      self%cell_layout = layout(cell_fields)
      allocate (self%points(size(point_fields)), self%cells(size(cell_fields)))
      call grow(self%times, '/VTKHDF/Steps/Values', hdf5_real, 1)
      do i = 1, size(same_lists)
         call grow(self%same(i), '/VTKHDF/Steps/'//trim(same_lists(i)), hdf5_integer, 1, rank=same_ranks(i))
      end do
      do i = 1, size(point_fields)
         self%points(i)%bytes = self%storage%bytes()
         call grow_series(self%points(i), 'PointData', point_fields(i), self%nodes)
      end do
      do i = 1, size(cell_fields)
         self%cells(i)%bytes = self%storage%bytes()
         call grow_series(self%cells(i), 'CellData', cell_fields(i), self%elements)
      end do
      call grow_series(self%load_factor, 'FieldData', field_t('load_factor', 1), 1)
      if (self%storage%duration > 0) call grow_series(self%time, 'FieldData', field_t('time', 1), 1)
      call self%history%attach(self%file, self%name, monitors, fresh, self%steps, error)
      self%lines = 0
      if (.not. allocated(error)) then
         if (fresh) then
            call self%log%create(self%file, '/finshell/log', hdf5_line, error)
         else
            call self%log%open(self%file, '/finshell/log', hdf5_line, self%lines, error)
         end if
      end if
   contains
      subroutine grow(table, path, kind, components, items, rank)
         type(hdf5_table_t), intent(inout) :: table
         character(len=*), intent(in) :: path
         integer, intent(in) :: kind, components
         integer, optional, intent(in) :: items, rank
         call attach_table(table, self%file, self%name, path, kind, components, fresh, self%steps, error, items, rank)
      end subroutine grow

      subroutine grow_series(series, group, field, items)
         type(series_t), intent(inout) :: series
         character(len=*), intent(in) :: group
         type(field_t), intent(in) :: field
         integer, intent(in) :: items
         call grow(series%values, '/VTKHDF/'//group//'/'//field%name, &
            & merge(hdf5_single, hdf5_real, series%bytes == 4), field%components, items=items)
         call grow(series%offsets, '/VTKHDF/Steps/'//group//'Offsets/'//field%name, hdf5_integer, 1)
      end subroutine grow_series
   end subroutine attach

   subroutine write_step(self, record, point_fields, cell_fields, error)
      class(results_file_t), intent(inout) :: self
      type(increment_t), intent(in) :: record
      type(field_t), intent(in) :: point_fields(:), cell_fields(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      do i = 1, size(point_fields)
         call put_series(self%points(i), self%nodes, with_gaps(point_fields(i)%values, point_fields(i)%missing))
      end do
      do i = 1, size(cell_fields)
         call put_series(self%cells(i), self%elements, with_gaps(cell_fields(i)%values, cell_fields(i)%missing))
      end do
      call put_series(self%load_factor, 1, reshape([record%load_factor], [1, 1]))
      if (self%storage%duration > 0) call put_series(self%time, 1, reshape(record%motion(1:1), [1, 1]))
      if (.not. allocated(error)) call self%times%put_reals(self%steps, reshape([self%next_instant(record)], [1, 1]), error)
      do i = 1, size(same_lists)
         call put_integer(self%same(i), same_values(i))
      end do
      if (.not. allocated(error)) call self%history%append(self%steps, record, error)
   contains
      subroutine put_series(series, items, values)
         type(series_t), intent(in) :: series
         integer, intent(in) :: items
         real(wp), contiguous, intent(in) :: values(:, :)
         if (.not. allocated(error)) call series%values%put_reals(self%steps*items, values, error)
         call put_integer(series%offsets, self%steps*items)
      end subroutine put_series

      subroutine put_integer(table, value)
         type(hdf5_table_t), intent(in) :: table
         integer(i8), intent(in) :: value
         if (.not. allocated(error)) call table%put_integers(self%steps, [value], error)
      end subroutine put_integer
   end subroutine write_step

   !> Upper bound of the bytes that one step adds to the file.
   pure integer(i8) function step_size(self)
      class(results_file_t), intent(in) :: self
      integer(i8), parameter :: bytes = storage_size(1.0_wp)/8, overhead = 8192 ! a new chunk of a list, a new node of its index
      step_size = 32*overhead + sum(int(self%point_layout%components, i8))*self%nodes*bytes &
         & + sum(int(self%cell_layout%components, i8))*self%elements*bytes &
         & + overhead*(2*(size(self%points) + size(self%cells)) + size(self%monitors))
   end function step_size

   impure elemental subroutine close_series(series)
      type(series_t), intent(inout) :: series
      call series%values%close()
      call series%offsets%close()
   end subroutine close_series
end module finshell_results
