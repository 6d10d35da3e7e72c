!> What the result files receive at every converged increment: one record of numbers, and fields on nodes and elements.
!>
!> A number that does not exist (a stress where the law has ended) is declared `missing` by whoever made the field; it alone is
!> written as NaN. A NaN that nobody declared is refused, as is an infinity.
module finshell_field
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan, ieee_quiet_nan, ieee_value
   use finshell_kinds, only: wp
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_invalid_argument, status_not_a_number
   implicit none
   private
   public :: field_t, increment_t, name_t, check_field, check_fields, check_increment, layout
   public :: gaps, monitor_value, with_gaps, without_slash, name_characters, motion_columns

   !> What names of fields, monitors and jobs are made of: they are parts of paths in result files, and of their names.
   character(len=*), parameter :: name_characters = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-'

   !> Columns of the history in inputs with steps in time.
   character(len=*), parameter :: motion_columns(11) = [character(len=18) :: 'time', 'kinetic_energy', 'stored_energy', 'work', &
      'damped', 'momentum_x', 'momentum_y', 'momentum_z', 'angular_momentum_x', 'angular_momentum_y', 'angular_momentum_z']

   !> Refuse a list of fields: before a file is created, because of its names, or later, because of its values.
   interface check_fields
      module procedure :: check_names
      module procedure :: check_values
   end interface check_fields

   !> A named field on the nodes or on the elements.
   type :: field_t
      character(len=:), allocatable :: name !< letters, digits, _ . - only: it becomes part of a path
      integer :: components = 1 !< 1: scalar, 3: vector, ...
      real(wp), allocatable :: values(:, :) !< (components, items); may stay unallocated until the first increment
      logical, allocatable :: missing(:) !< (items) there is no value; unallocated: there are all
   end type field_t

   !> The numbers of one converged increment.
   type :: increment_t
      integer :: increment = 0 !< 0 for the unloaded state, rising by any steps
      real(wp) :: load_factor = 0.0_wp
      integer :: iterations = 0
      integer :: negative_pivots = 0 !< -1: unknown
      real(wp), allocatable :: monitors(:) !< in the order of the monitor names
      !> In the history only: 1 limit, 2 bifurcation, 3 both since the row before; 11, 12, 13 located here.
      integer :: critical_point = 0
      real(wp) :: residual = 0 !< in the history only: relative, at convergence
      real(wp) :: correction = 0
      integer :: snap = 0 !< in the history only: 1 the increment has snapped to another state
      integer :: found_by = 0 !< in the history only: 0 Newton's method, 1 a descent, 2 dynamic relaxation
      real(wp) :: stabilisation = 0 !< in the history only: taken since the step began, in parts of the stored energy
      logical, allocatable :: missing(:) !< (monitors) there is no value; unallocated: there are all
      real(wp), allocatable :: motion(:) !< values of `motion_columns`; unallocated in inputs without steps in time
   end type increment_t

   !> A name of its own length, for lists of names.
   type :: name_t
      character(len=:), allocatable :: text
   end type name_t

contains

   !> Refuse a field whose values are missing, of another shape than (components, items), or not finite.
   !> `what` is 'node' or 'element'.
   subroutine check_field(field, components, items, what, increment, error)
      type(field_t), intent(in) :: field
      integer, intent(in) :: components, items, increment
      character(len=*), intent(in) :: what
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      if (.not. allocated(field%values)) then
         call raise(error, status_invalid_argument, 'result field '//field%name//' has no values at increment '//text_of(increment))
      else if (size(field%values, 1) /= components .or. size(field%values, 2) /= items) then
         call raise(error, status_invalid_argument, 'result field '//field%name//' at increment '//text_of(increment) &
            & //': found '//text_of(size(field%values, 1))//' x '//text_of(size(field%values, 2))//' values, expected ' &
            & //text_of(components)//' components for each '//what//', '//text_of(items)//' '//what//'s')
      else
         do i = 1, items
            if (all(ieee_is_finite(field%values(:, i)))) cycle
            if (allocated(field%missing)) then
               if (field%missing(i)) cycle
            end if
            call raise(error, status_not_a_number, 'result field '//field%name//' is not finite at '//what//' ' &
               & //text_of(i)//' of increment '//text_of(increment)//'; the increment was not written')
            exit
         end do
      end if
   end subroutine check_field

   !> Refuse an increment with the wrong number of monitored quantities, or one that is not finite.
   subroutine check_increment(record, monitors, error)
      type(increment_t), intent(in) :: record
      type(name_t), intent(in) :: monitors(:)
      type(error_t), allocatable, intent(out) :: error
      integer :: i, found
      found = 0
      if (allocated(record%monitors)) found = size(record%monitors)
      if (found /= size(monitors)) then
         call raise(error, status_invalid_argument, 'increment '//text_of(record%increment)//': found '//text_of(found) &
            & //' monitored quantities, expected '//text_of(size(monitors)))
         return
      end if
      if (.not. ieee_is_finite(record%load_factor)) call raise(error, status_not_a_number, &
         & 'the load factor of increment '//text_of(record%increment)//' is not finite; the increment was not written')
      do i = 1, found
         if (allocated(record%missing)) then
            if (record%missing(i)) cycle
         end if
         if (.not. ieee_is_finite(record%monitors(i))) call raise(error, status_not_a_number, 'monitored quantity ' &
            & //monitors(i)%text//' is not finite at increment '//text_of(record%increment)//'; the increment was not written')
      end do
      if (.not. allocated(record%motion)) return
      do i = 1, size(record%motion)
         if (.not. ieee_is_finite(record%motion(i))) call raise(error, status_not_a_number, trim(motion_columns(i)) &
            & //' is not finite at increment '//text_of(record%increment)//'; the increment was not written')
      end do
   end subroutine check_increment

   !> Refuse a name that cannot be part of a path in the result files.
   subroutine check_name(name, what, error)
      character(len=*), intent(in) :: name, what
      type(error_t), allocatable, intent(out) :: error
      if (len(name) == 0 .or. verify(name, name_characters) /= 0 .or. verify(name, '.') == 0) &
         call raise(error, status_invalid_argument, what//' "'//name//'": a name is made of letters, digits, "_", "-" and "."')
   end subroutine check_name

   subroutine check_values(fields, expected, items, what, increment, error)
      type(field_t), intent(in) :: fields(:)
      type(field_t), intent(in) :: expected(:) !< names and components
      integer, intent(in) :: items, increment
      character(len=*), intent(in) :: what
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      if (size(fields) /= size(expected)) call raise(error, status_invalid_argument, 'found '//text_of(size(fields))//' ' &
         & //what//' fields at increment '//text_of(increment)//', expected '//text_of(size(expected)))
      do i = 1, size(expected)
         if (allocated(error)) return
         call check_field(fields(i), expected(i)%components, items, what, increment, error)
         if (.not. allocated(error) .and. fields(i)%name /= expected(i)%name) call raise(error, status_invalid_argument, &
            & 'found '//what//' field '//fields(i)%name//' at increment '//text_of(increment)//', expected '//expected(i)%name)
      end do
   end subroutine check_values

   subroutine check_names(fields, what, error)
      type(field_t), intent(in) :: fields(:)
      character(len=*), intent(in) :: what
      type(error_t), allocatable, intent(out) :: error
      integer :: i, j
      do i = 1, size(fields)
         call check_name(fields(i)%name, what, error)
         if (allocated(error)) return
         do j = 1, i - 1
            if (fields(i)%name == fields(j)%name) call raise(error, status_invalid_argument, what//' '//fields(i)%name &
               & //' is requested twice')
         end do
         if (fields(i)%components < 1) call raise(error, status_invalid_argument, what//' '//fields(i)%name &
            & //' needs at least one component')
         if (allocated(error)) return
      end do
   end subroutine check_names

   !> Values as they are written: NaN where there is none.
   pure function with_gaps(values, missing) result(written)
      real(wp), intent(in) :: values(:, :) !< (components, items)
      logical, intent(in), optional :: missing(:) !< (items)
      real(wp), allocatable :: written(:, :)
      integer :: i
      written = values
      if (.not. present(missing)) return
      do i = 1, size(missing)
         if (missing(i)) written(:, i) = ieee_value(1.0_wp, ieee_quiet_nan)
      end do
   end function with_gaps

   !> Which items were written as missing.
   pure function gaps(written) result(missing)
      real(wp), intent(in) :: written(:, :) !< (components, items)
      logical :: missing(size(written, 2))
      missing = any(ieee_is_nan(written), dim=1)
   end function gaps

   !> A monitored quantity as it is written: NaN where there is none.
   pure real(wp) function monitor_value(record, i)
      type(increment_t), intent(in) :: record
      integer, intent(in) :: i
      monitor_value = record%monitors(i)
      if (.not. allocated(record%missing)) return
      if (record%missing(i)) monitor_value = ieee_value(1.0_wp, ieee_quiet_nan)
   end function monitor_value

   !> The fields without their values.
   pure function layout(fields) result(names)
      type(field_t), intent(in) :: fields(:)
      type(field_t) :: names(size(fields))
      integer :: i
      do i = 1, size(fields)
         names(i)%name = fields(i)%name
         names(i)%components = fields(i)%components
      end do
   end function layout

   !> A name that does not open a group of its own.
   pure function without_slash(name) result(safe)
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: safe
      integer :: i
      safe = name
      do i = 1, len(safe)
         if (safe(i:i) == '/') safe(i:i) = '_'
      end do
   end function without_slash
end module finshell_field
