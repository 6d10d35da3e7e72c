!> The history in the result file: a row of numbers for each of its steps, in double precision.
module finshell_record_tables
   use finshell_error, only: error_t, raise
   use finshell_field, only: gaps, increment_t, monitor_value, name_t, without_slash
   use finshell_hdf5, only: hdf5_file_t, hdf5_integer, hdf5_real, hdf5_table_t
   use finshell_kinds, only: i8, wp
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: record_tables_t, attach_table

   character(len=*), parameter :: folder = '/finshell/history/'
   character(len=*), parameter :: counters(3) = [character(len=15) :: 'increment', 'iterations', 'negative_pivots']

   type :: record_tables_t
      private
      type(hdf5_table_t) :: counts(size(counters)), factors
      type(hdf5_table_t), allocatable :: monitored(:)
   contains
      procedure :: attach, append, read_all
      procedure :: close => close_tables
   end type record_tables_t

contains

   !> Create a table or, unless the file is `fresh`, open that of an existing file, which must have so many complete steps of
   !> `items` rows.
   subroutine attach_table(table, file, name, path, kind, components, fresh, steps, error, items, rank)
      type(hdf5_table_t), intent(inout) :: table
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name !< of the file, for messages
      character(len=*), intent(in) :: path
      integer, intent(in) :: kind, components
      logical, intent(in) :: fresh
      integer(i8), intent(in) :: steps
      type(error_t), allocatable, intent(inout) :: error
      integer, optional, intent(in) :: items !< default 1
      integer, optional, intent(in) :: rank
      integer(i8) :: rows, complete
      if (allocated(error)) return
      if (fresh) then
         call table%create(file, path, kind, error, components, items, rank)
      else
         call table%open(file, path, kind, rows, error, components, rank)
         complete = steps
         if (present(items)) complete = complete*items
         if (.not. allocated(error) .and. rows < complete) call raise(error, status_io_error, name//': ' &
            & //path//' is shorter than the number of steps: the file is damaged')
      end if
   end subroutine attach_table

   !> All tables of the history; arguments as of attach_table.
   subroutine attach(self, file, name, monitors, fresh, steps, error)
      class(record_tables_t), intent(inout) :: self
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(name_t), intent(in) :: monitors(:)
      logical, intent(in) :: fresh
      integer(i8), intent(in) :: steps
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      allocate (self%monitored(size(monitors)))
      do i = 1, size(counters)
         call attach_table(self%counts(i), file, name, folder//trim(counters(i)), hdf5_integer, 1, fresh, steps, error)
      end do
      call attach_table(self%factors, file, name, folder//'load_factor', hdf5_real, 1, fresh, steps, error)
      do i = 1, size(monitors)
         call attach_table(self%monitored(i), file, name, folder//without_slash(monitors(i)%text), hdf5_real, 1, fresh, &
                           steps, error)
      end do
   end subroutine attach

   !> The row after the first `steps`.
   subroutine append(self, steps, record, error)
      class(record_tables_t), intent(in) :: self
      integer(i8), intent(in) :: steps
      type(increment_t), intent(in) :: record
      type(error_t), allocatable, intent(inout) :: error
      integer :: counts(size(counters)), i
      counts = [record%increment, record%iterations, record%negative_pivots]
      do i = 1, size(counters)
         if (.not. allocated(error)) call self%counts(i)%put_integers(steps, [int(counts(i), i8)], error)
      end do
      if (.not. allocated(error)) call self%factors%put_reals(steps, reshape([record%load_factor], [1, 1]), error)
      do i = 1, size(self%monitored)
         if (.not. allocated(error)) call self%monitored(i)%put_reals(steps, reshape([monitor_value(record, i)], [1, 1]), error)
      end do
   end subroutine append

   !> The rows of all steps.
   subroutine read_all(self, steps, records, error)
      class(record_tables_t), intent(in) :: self
      integer(i8), intent(in) :: steps
      type(increment_t), allocatable, intent(out) :: records(:)
      type(error_t), allocatable, intent(out) :: error
      integer(i8), allocatable :: counts(:, :)
      real(wp), allocatable :: factors(:, :), monitors(:, :, :)
      integer :: i
      allocate (records(steps), counts(steps, size(counters)), factors(1, steps), monitors(1, steps, size(self%monitored)))
      do i = 1, size(counters)
         if (.not. allocated(error)) call self%counts(i)%get_integers(0_i8, counts(:, i), error)
      end do
      if (.not. allocated(error)) call self%factors%get_reals(0_i8, factors, error)
      do i = 1, size(self%monitored)
         if (.not. allocated(error)) call self%monitored(i)%get_reals(0_i8, monitors(:, :, i), error)
      end do
      do i = 1, merge(0, size(records), allocated(error))
         records(i) = increment_t(int(counts(i, 1)), factors(1, i), int(counts(i, 2)), int(counts(i, 3)))
         records(i)%monitors = monitors(1, i, :) ! gfortran 12 mistakes the stride in the line above
         records(i)%missing = gaps(monitors(:, i, :))
      end do
   end subroutine read_all

   subroutine close_tables(self)
      class(record_tables_t), intent(inout) :: self
      call self%counts%close()
      call self%factors%close()
      if (allocated(self%monitored)) call self%monitored%close()
      if (allocated(self%monitored)) deallocate (self%monitored)
   end subroutine close_tables
end module finshell_record_tables
