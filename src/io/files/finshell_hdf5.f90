!> The only file that names HDF5: thin helpers for files, attributes, fixed arrays and tables that grow by rows.
!>
!> Every failure becomes an error_t that names the file and the operation; HDF5's own printing is switched off.
!> Arrays are in Fortran order: values(components, rows) is what other languages see as rows x components.
module finshell_hdf5
   use, intrinsic :: iso_c_binding, only: c_loc, c_ptr
   use hdf5, only: hid_t, hsize_t, size_t, h5open_f, h5dont_atexit_f, h5eset_auto_f, h5kind_to_type
   use hdf5, only: h5fcreate_f, h5fopen_f, h5fclose_f, h5fflush_f, h5gcreate_f, h5gclose_f
   use hdf5, only: h5oopen_f, h5oclose_f, h5aopen_f, h5acreate_f, h5aexists_f, h5awrite_f, h5aread_f, h5aclose_f
   use hdf5, only: h5screate_f, h5screate_simple_f, h5sclose_f, h5sselect_hyperslab_f
   use hdf5, only: h5aget_space_f, h5sget_simple_extent_npoints_f, h5sget_simple_extent_ndims_f, h5sget_simple_extent_dims_f
   use hdf5, only: h5dcreate_f, h5dopen_f, h5dclose_f, h5dwrite_f, h5dread_f, h5dget_space_f, h5dset_extent_f
   use hdf5, only: h5pcreate_f, h5pclose_f, h5pset_chunk_f, h5pset_fill_time_f, h5pset_shuffle_f, h5pset_deflate_f
   use hdf5, only: h5gn_members_f, h5gget_obj_info_idx_f, h5aget_type_f, h5dget_type_f, h5tget_size_f
   use hdf5, only: h5zfilter_avail_f, h5z_filter_deflate_f
   use hdf5, only: h5tcopy_f, h5tclose_f, h5tset_size_f, h5tset_cset_f, h5tset_strpad_f
   use hdf5, only: h5f_acc_trunc_f, h5f_acc_rdonly_f, h5f_scope_global_f, h5s_scalar_f, h5s_select_set_f, h5s_unlimited_f
   use hdf5, only: h5p_dataset_create_f, h5d_fill_time_never_f, h5t_cset_utf8_f, h5t_str_nullpad_f, h5_integer_kind
   use hdf5, only: h5t_ieee_f32le, h5t_ieee_f64le, h5t_std_i64le, h5t_std_u8le, h5t_native_double, h5t_fortran_s1
   use finshell_kinds, only: dp, i8
   use finshell_disk, only: copy_in_system, lack_of_room, length_in_system, link_in_system, lock_t, remove_in_system
   use finshell_disk, only: rename_in_system, set_environment
   use finshell_error, only: error_t, raise
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: hdf5_file_t, hdf5_table_t, hdf5_real, hdf5_single, hdf5_integer, hdf5_byte, hdf5_line

   !> What a table holds: real(dp), integer(i8), integer(i8) stored as unsigned bytes, lines of text (longer ones are cut), or
   !> real(dp) stored in single precision.
   integer, parameter :: hdf5_real = 1, hdf5_integer = 2, hdf5_byte = 3, hdf5_line = 4, hdf5_single = 5
   integer, parameter :: line_length = 160
   integer(hsize_t), parameter :: worth_compressing = 256 !< numbers in a chunk

   type :: hdf5_file_t
      private
      integer(hid_t) :: id = -1
      character(len=:), allocatable :: name
      type(lock_t) :: lock
      logical :: stand_in = .false. !< a copy stands under the name of the file
      integer :: compress = 0 !< level of zlib for large tables
   contains
      procedure :: create => create_file
      procedure :: open => open_file
      procedure :: close => close_file
      procedure :: is_open
      procedure :: flush => flush_file
      procedure :: rename => rename_file
      procedure :: make_room
      procedure :: begin_writing, end_writing
      procedure :: make_group
      procedure :: set_integers
      procedure :: get_integer, get_integers => get_integer_list
      procedure :: set_text
      procedure :: write_text
      procedure :: get_text, read_text, members
   end type hdf5_file_t

   !> A dataset that grows by rows; its handle stays open until the table is closed.
   type :: hdf5_table_t
      private
      integer(hid_t) :: id = -1
      integer(hid_t) :: memory_type = -1
      integer :: components = 1
      integer :: rank = 1
      character(len=:), allocatable :: place !< 'file: path', for messages
   contains
      procedure :: create => create_table
      procedure :: open => open_table
      procedure :: close => close_table
      procedure, private :: resize
      procedure :: put_reals
      procedure :: put_integers
      procedure :: put_line
      procedure :: get_reals
      procedure :: get_integers
      procedure :: get_line
      procedure, private :: transfer_rows
   end type hdf5_table_t

contains

   !> Create a file, replacing an existing one that may be written to.
   subroutine create_file(self, name, error, compress)
      class(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      !> Level of zlib for large tables, 0 (default) to 9. Without effect where the HDF5 library has no zlib.
      integer, optional, intent(in) :: compress
      logical :: available
      integer :: status
      call start(error)
      if (.not. allocated(error)) call ask_system(name, 'unknown', 'readwrite', 'create', error)
      if (allocated(error)) return
      self%name = name
      call h5fcreate_f(name, h5f_acc_trunc_f, self%id, status)
      if (status < 0) then
         self%id = -1
         call raise(error, status_io_error, name//': cannot create the result file: is the disk full?')
      end if
      self%compress = 0
      if (present(compress)) self%compress = compress
      call h5zfilter_avail_f(h5z_filter_deflate_f, available, status)
      if (.not. available) self%compress = 0
   end subroutine create_file

   !> Open an existing file for reading.
   subroutine open_file(self, name, error)
      class(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      integer :: status
      call start(error)
      if (.not. allocated(error)) call ask_system(name, 'old', 'read', 'open', error)
      if (allocated(error)) return
      self%name = name
      call h5fopen_f(name, h5f_acc_rdonly_f, self%id, status)
      if (status < 0) then
         self%id = -1
         call raise(error, status_io_error, name//': cannot open the result file: it is not an HDF5 file, or it is damaged')
      end if
   end subroutine open_file

   !> Close the file; its tables must have been closed before.
   subroutine close_file(self, error)
      class(hdf5_file_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer :: status
      if (self%id < 0) return
      call h5fclose_f(self%id, status)
      self%id = -1
      call check(status >= 0, self%name, 'close the result file', error)
   end subroutine close_file

   pure logical function is_open(self)
      class(hdf5_file_t), intent(in) :: self
      is_open = self%id >= 0
   end function is_open

   !> Hand everything written so far to the operating system.
   subroutine flush_file(self, error)
      class(hdf5_file_t), intent(in) :: self
      type(error_t), allocatable, intent(out) :: error
      integer :: status
      call h5fflush_f(self%id, h5f_scope_global_f, status)
      call check(status >= 0, self%name, 'write to the result file (is the disk full?)', error)
   end subroutine flush_file

   !> Rename the open file, replacing another one of that name.
   subroutine rename_file(self, name, error)
      class(hdf5_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      call check(rename_in_system(self%name, name), self%name, 'rename the result file to '//name, error)
      if (.not. allocated(error)) self%name = name
   end subroutine rename_file

   !> Make sure that the disk has room for further `bytes`. HDF5 does not survive a full disk: what was written before is
   !> lost, because the start of the file already counts on what could not be written.
   subroutine make_room(self, bytes, error)
      class(hdf5_file_t), intent(in) :: self
      integer(i8), intent(in) :: bytes
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: reason
      reason = lack_of_room(self%name, bytes)
      call check(reason == '', self%name, 'write to the result file: '//reason, error)
   end subroutine make_room

   !> Make room, and keep readers away until `end_writing` (their attempt to open the file fails), because the file is between
   !> two states. One that has the file open already does not hinder, and finds the steps it knows where they were.
   !>
   !> With `splits`, what was written before is in danger: HDF5 splits the index of a dataset, which takes several writes, and a
   !> process that is killed between them loses the dataset. So a copy stands under the name of the file meanwhile (if it is not too
   !> large, and the disk has room).
   subroutine begin_writing(self, bytes, splits, error)
      class(hdf5_file_t), intent(inout) :: self
      integer(i8), intent(in) :: bytes
      logical, intent(in) :: splits
      type(error_t), allocatable, intent(out) :: error
      integer(i8), parameter :: too_large = 2_i8**29
      integer(i8) :: length
      call self%make_room(bytes, error)
      if (allocated(error)) return
      call self%lock%lock_now(self%name)
      if (.not. splits) return
      length = length_in_system(self%name)
      if (length > too_large) return
      if (lack_of_room(self%name, length + bytes) /= '') return
      if (.not. copy_in_system(self%name, self%name//'~copy')) return
      call remove_in_system(self%name//'~live')
      self%stand_in = link_in_system(self%name, self%name//'~live')
      if (self%stand_in) self%stand_in = rename_in_system(self%name//'~copy', self%name)
      if (self%stand_in) return
      call remove_in_system(self%name//'~copy')
      call remove_in_system(self%name//'~live')
   end subroutine begin_writing

   subroutine end_writing(self)
      class(hdf5_file_t), intent(inout) :: self
      logical :: ignored
      if (self%stand_in) ignored = rename_in_system(self%name//'~live', self%name)
      self%stand_in = .false.
      call self%lock%unlock_now()
   end subroutine end_writing

   subroutine make_group(self, path, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: group
      integer :: status
      call h5gcreate_f(self%id, path, group, status)
      if (status >= 0) call h5gclose_f(group, status)
      call check(status >= 0, self%name, 'create group '//path, error)
   end subroutine make_group

   !> Set an integer attribute of the object at `path`: a scalar when one value is given, a list otherwise.
   subroutine set_integers(self, path, attribute, values, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: path, attribute
      integer(i8), contiguous, target, intent(in) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: object, space, id
      integer :: status, ignored
      logical :: exists
      ! the object stays open meanwhile: HDF5 1.10 cannot write an attribute that was opened by the path of its object
      call h5oopen_f(self%id, path, object, status)
      if (status >= 0) then
         call h5aexists_f(object, attribute, exists, status)
         if (status >= 0 .and. exists) then
            call h5aopen_f(object, attribute, id, status)
         else if (status >= 0) then
            if (size(values) == 1) then
               call h5screate_f(h5s_scalar_f, space, ignored)
            else
               call h5screate_simple_f(1, [size(values, kind=hsize_t)], space, ignored)
            end if
            call h5acreate_f(object, attribute, h5t_std_i64le, space, id, status)
            call h5sclose_f(space, ignored)
         end if
         if (status >= 0) then
            call h5awrite_f(id, h5kind_to_type(i8, h5_integer_kind), c_loc(values), status)
            call h5aclose_f(id, ignored)
         end if
         call h5oclose_f(object, ignored)
      end if
      call check(status >= 0, self%name, 'write attribute '//attribute//' of '//path, error)
   end subroutine set_integers

   !> Read a scalar integer attribute.
   subroutine get_integer(self, path, attribute, value, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: path, attribute
      integer(i8), target, intent(out) :: value
      type(error_t), allocatable, intent(out) :: error
      type(c_ptr) :: buffer
      integer(hid_t) :: object, id
      integer :: status, ignored
      value = 0
      buffer = c_loc(value)
      call h5oopen_f(self%id, path, object, status)
      if (status >= 0) then
         call h5aopen_f(object, attribute, id, status)
         if (status >= 0) then
            call h5aread_f(id, h5kind_to_type(i8, h5_integer_kind), buffer, status)
            call h5aclose_f(id, ignored)
         end if
         call h5oclose_f(object, ignored)
      end if
      call check(status >= 0, self%name, 'read attribute '//attribute//' of '//path//' (was this file written by finshell?)', error)
   end subroutine get_integer

   !> Read an integer attribute of several values. Error: it is not there, or has another number of values.
   subroutine get_integer_list(self, path, attribute, values, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: path, attribute
      integer(i8), contiguous, target, intent(out) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      type(c_ptr) :: buffer
      integer(hid_t) :: object, id, space
      integer(hsize_t) :: number
      integer :: status, ignored
      values = 0
      buffer = c_loc(values)
      call h5oopen_f(self%id, path, object, status)
      if (status >= 0) then
         call h5aopen_f(object, attribute, id, status)
         if (status >= 0) then
            call h5aget_space_f(id, space, ignored)
            call h5sget_simple_extent_npoints_f(space, number, ignored)
            call h5sclose_f(space, ignored)
            if (number /= size(values)) status = -1
            if (status >= 0) call h5aread_f(id, h5kind_to_type(i8, h5_integer_kind), buffer, status)
            call h5aclose_f(id, ignored)
         end if
         call h5oclose_f(object, ignored)
      end if
      call check(status >= 0, self%name, 'read attribute '//attribute//' of '//path//' (was this file written by finshell?)', error)
   end subroutine get_integer_list

   !> Set a text attribute of exactly the length of the text (VTKHDF wants no padding), which must not be empty.
   subroutine set_text(self, path, attribute, text, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: path, attribute
      character(len=*), target, intent(in) :: text
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: object, space, type, id
      integer :: status, ignored
      call h5oopen_f(self%id, path, object, status)
      if (status >= 0) then
         call new_text_type(len(text), .false., type)
         call h5screate_f(h5s_scalar_f, space, ignored)
         call h5acreate_f(object, attribute, type, space, id, status)
         if (status >= 0) then
            call h5awrite_f(id, type, c_loc(text), status)
            call h5aclose_f(id, ignored)
         end if
         call h5sclose_f(space, ignored)
         call h5tclose_f(type, ignored)
         call h5oclose_f(object, ignored)
      end if
      call check(status >= 0, self%name, 'write attribute '//attribute//' of '//path, error)
   end subroutine set_text

   !> Write a whole text as one string.
   subroutine write_text(self, path, text, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: path, text
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable, target :: buffer
      integer(hid_t) :: type, space, id
      integer :: status, ignored
      buffer = text
      if (len(buffer) == 0) buffer = ' ' ! HDF5 has no string of length zero
      call new_text_type(len(buffer), .true., type)
      call h5screate_f(h5s_scalar_f, space, ignored)
      call h5dcreate_f(self%id, path, type, space, id, status)
      if (status >= 0) then
         call h5dwrite_f(id, type, c_loc(buffer), status)
         call h5dclose_f(id, ignored)
      end if
      call h5sclose_f(space, ignored)
      call h5tclose_f(type, ignored)
      call check(status >= 0, self%name, 'write dataset '//path//' (is the disk full?)', error)
   end subroutine write_text

   !> Create a table without rows. One component makes a list (rank 1) unless `rank` says 2.
   !> `rows` is the number of rows that are usually written together: the size of a chunk. So a chunk is written once and not
   !> touched again, and whoever reads such rows reads (and unpacks) a single piece, or a few where HDF5 allows no larger ones.
   subroutine create_table(self, file, path, kind, error, components, rows, rank)
      class(hdf5_table_t), intent(inout) :: self
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: path
      integer, intent(in) :: kind
      type(error_t), allocatable, intent(out) :: error
      integer, optional, intent(in) :: components, rows, rank
      integer(hid_t) :: space, properties, file_type
      integer(hsize_t) :: dims(2), limits(2), chunk(2)
      integer :: status, ignored
      call set_kind(self, file, path, kind, components, rank)
      select case (kind)
      case (hdf5_real); file_type = h5t_ieee_f64le
      case (hdf5_single); file_type = h5t_ieee_f32le
      case (hdf5_integer); file_type = h5t_std_i64le
      case (hdf5_byte); file_type = h5t_std_u8le
      case default; file_type = self%memory_type
      end select
      dims = [int(self%components, hsize_t), 0_hsize_t]
      chunk = [int(self%components, hsize_t), 128_hsize_t]
      if (present(rows)) chunk(2) = max(1, (rows - 1)/pieces(self%components, rows) + 1)
      limits = [dims(1), h5s_unlimited_f]
      if (self%rank == 1) then
         dims(1) = dims(2)
         limits(1) = limits(2)
         chunk(1) = chunk(2)
      end if
      call h5screate_simple_f(self%rank, dims(:self%rank), space, ignored, limits(:self%rank))
      call h5pcreate_f(h5p_dataset_create_f, properties, ignored)
      call h5pset_chunk_f(properties, self%rank, chunk(:self%rank), ignored)
      call h5pset_fill_time_f(properties, h5d_fill_time_never_f, ignored)
      if (present(rows) .and. file%compress > 0 .and. product(chunk(:self%rank)) >= worth_compressing) then
         call h5pset_shuffle_f(properties, ignored)
         call h5pset_deflate_f(properties, file%compress, ignored)
      end if
      call h5dcreate_f(file%id, path, file_type, space, self%id, status, properties)
      call h5pclose_f(properties, ignored)
      call h5sclose_f(space, ignored)
      if (status < 0) self%id = -1
      call check(status >= 0, self%place, 'create the dataset', error)
   end subroutine create_table

   !> Chunks that so many rows need: HDF5 takes none of 4 GiB or more.
   pure integer function pieces(components, rows)
      integer, intent(in) :: components, rows
      integer(i8), parameter :: most_bytes = 2_i8**31
      pieces = int(8_i8*components*rows/most_bytes) + 1
   end function pieces

   !> Read a text attribute.
   subroutine get_text(self, path, attribute, text, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: path, attribute
      character(len=:), allocatable, intent(out) :: text
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable, target :: buffer
      type(c_ptr) :: place
      integer(hid_t) :: object, id, type
      integer(size_t) :: length
      integer :: status, ignored
      text = ''
      call h5oopen_f(self%id, path, object, status)
      if (status >= 0) then
         call h5aopen_f(object, attribute, id, status)
         if (status >= 0) then
            call h5aget_type_f(id, type, ignored)
            call h5tget_size_f(type, length, ignored)
            allocate (character(len=length) :: buffer)
            place = c_loc(buffer)
            call h5aread_f(id, type, place, status)
            if (status >= 0) text = buffer
            call h5tclose_f(type, ignored)
            call h5aclose_f(id, ignored)
         end if
         call h5oclose_f(object, ignored)
      end if
      call check(status >= 0, self%name, 'read attribute '//attribute//' of '//path//' (was this file written by finshell?)', error)
   end subroutine get_text

   !> Read a whole text that `write_text` wrote.
   subroutine read_text(self, path, text, error)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: text
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable, target :: buffer
      type(c_ptr) :: place
      integer(hid_t) :: type, id
      integer(size_t) :: length
      integer :: status, ignored
      text = ''
      call h5dopen_f(self%id, path, id, status)
      if (status >= 0) then
         call h5dget_type_f(id, type, ignored)
         call h5tget_size_f(type, length, ignored)
         allocate (character(len=length) :: buffer)
         place = c_loc(buffer)
         call h5dread_f(id, type, place, status)
         if (status >= 0) text = buffer
         call h5tclose_f(type, ignored)
         call h5dclose_f(id, ignored)
      end if
      call check(status >= 0, self%name, 'read dataset '//path//' (was this file written by finshell?)', error)
   end subroutine read_text

   !> Names of what is in a group, 'one, two'; '' where there is no such group.
   function members(self, path) result(names)
      class(hdf5_file_t), intent(in) :: self
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: names
      character(len=256) :: name
      integer :: i, kind, number, status
      names = ''
      call h5gn_members_f(self%id, path, number, status)
      if (status < 0) return
      do i = 0, number - 1
         call h5gget_obj_info_idx_f(self%id, path, i, name, kind, status)
         if (names /= '') names = names//', '
         if (status >= 0) names = names//trim(name)
      end do
   end function members

   !> Open an existing table, which must have these components; `rows` returns how many rows it has.
   subroutine open_table(self, file, path, kind, rows, error, components, rank)
      class(hdf5_table_t), intent(inout) :: self
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: path
      integer, intent(in) :: kind
      integer(i8), intent(out) :: rows
      type(error_t), allocatable, intent(out) :: error
      integer, optional, intent(in) :: components, rank
      integer(hid_t) :: space
      integer(hsize_t) :: dims(2), limits(2)
      integer :: status, ignored, found_rank
      rows = 0
      call set_kind(self, file, path, kind, components, rank)
      call h5dopen_f(file%id, path, self%id, status)
      if (status < 0) self%id = -1
      call check(status >= 0, self%place, 'find the dataset', error)
      if (allocated(error)) return
      dims = 0
      call h5dget_space_f(self%id, space, status)
      call h5sget_simple_extent_ndims_f(space, found_rank, status)
      if (found_rank == self%rank) call h5sget_simple_extent_dims_f(space, dims(:self%rank), limits(:self%rank), status)
      call h5sclose_f(space, ignored)
      if (self%rank == 1) dims = [1_hsize_t, dims(1)]
      rows = dims(2)
      call check(found_rank == self%rank .and. dims(1) == self%components, self%place, &
         & 'use the dataset: it has other dimensions than expected', error)
   end subroutine open_table

   impure elemental subroutine close_table(self)
      class(hdf5_table_t), intent(inout) :: self
      integer :: ignored
      if (self%id >= 0) call h5dclose_f(self%id, ignored)
      if (self%id >= 0 .and. self%memory_type /= h5t_native_double) call h5tclose_f(self%memory_type, ignored)
      self%id = -1
   end subroutine close_table

   !> Set the number of rows; rows beyond it are dropped.
   subroutine resize(self, rows, error)
      class(hdf5_table_t), intent(in) :: self
      integer(i8), intent(in) :: rows
      type(error_t), allocatable, intent(out) :: error
      integer :: status
      integer(hsize_t) :: dims(2)
      dims = [int(self%components, hsize_t), int(rows, hsize_t)]
      call h5dset_extent_f(self%id, dims(3 - self%rank:), status)
      call check(status >= 0, self%place, 'change the size of the dataset', error)
   end subroutine resize

   !> Write values(components, rows) after the first `offset` rows; the table ends with them.
   subroutine put_reals(self, offset, values, error)
      class(hdf5_table_t), intent(in) :: self
      integer(i8), intent(in) :: offset
      real(dp), contiguous, target, intent(in) :: values(:, :)
      type(error_t), allocatable, intent(out) :: error
      call self%resize(offset + size(values, 2), error)
      if (.not. allocated(error)) call self%transfer_rows(offset, size(values, 2), c_loc(values), .true., error)
   end subroutine put_reals

   !> Write integers after the first `offset` rows of a list; the table ends with them.
   subroutine put_integers(self, offset, values, error)
      class(hdf5_table_t), intent(in) :: self
      integer(i8), intent(in) :: offset
      integer(i8), contiguous, target, intent(in) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      call self%resize(offset + size(values), error)
      if (.not. allocated(error)) call self%transfer_rows(offset, size(values), c_loc(values), .true., error)
   end subroutine put_integers

   !> Write one line after the first `offset` lines; the table ends with it.
   subroutine put_line(self, offset, line, error)
      class(hdf5_table_t), intent(in) :: self
      integer(i8), intent(in) :: offset
      character(len=*), intent(in) :: line
      type(error_t), allocatable, intent(out) :: error
      character(len=line_length), target :: buffer
      buffer = line
      call self%resize(offset + 1, error)
      if (.not. allocated(error)) call self%transfer_rows(offset, 1, c_loc(buffer), .true., error)
   end subroutine put_line

   !> Read the rows offset + 1 ... offset + size(values, 2).
   subroutine get_reals(self, offset, values, error)
      class(hdf5_table_t), intent(in) :: self
      integer(i8), intent(in) :: offset
      real(dp), contiguous, target, intent(out) :: values(:, :)
      type(error_t), allocatable, intent(out) :: error
      call self%transfer_rows(offset, size(values, 2), c_loc(values), .false., error)
   end subroutine get_reals

   subroutine get_integers(self, offset, values, error)
      class(hdf5_table_t), intent(in) :: self
      integer(i8), intent(in) :: offset
      integer(i8), contiguous, target, intent(out) :: values(:)
      type(error_t), allocatable, intent(out) :: error
      call self%transfer_rows(offset, size(values), c_loc(values), .false., error)
   end subroutine get_integers

   subroutine get_line(self, offset, line, error)
      class(hdf5_table_t), intent(in) :: self
      integer(i8), intent(in) :: offset
      character(len=:), allocatable, intent(out) :: line
      type(error_t), allocatable, intent(out) :: error
      character(len=line_length), target :: buffer
      call self%transfer_rows(offset, 1, c_loc(buffer), .false., error)
      line = trim(buffer)
   end subroutine get_line

   subroutine transfer_rows(self, offset, rows, values, write, error)
      class(hdf5_table_t), intent(in) :: self
      integer(i8), intent(in) :: offset
      integer, intent(in) :: rows
      type(c_ptr), intent(in) :: values
      logical, intent(in) :: write
      type(error_t), allocatable, intent(out) :: error
      integer(hid_t) :: file_space, memory_space
      integer(hsize_t) :: first(2), dims(2)
      type(c_ptr) :: buffer
      integer :: status, ignored, k
      if (rows == 0) return
      buffer = values
      k = 3 - self%rank
      first = [0_hsize_t, int(offset, hsize_t)]
      dims = [int(self%components, hsize_t), int(rows, hsize_t)]
      call h5screate_simple_f(self%rank, dims(k:), memory_space, ignored)
      call h5dget_space_f(self%id, file_space, ignored)
      call h5sselect_hyperslab_f(file_space, h5s_select_set_f, first(k:), dims(k:), status)
      if (status >= 0) then
         if (write) then
            call h5dwrite_f(self%id, self%memory_type, values, status, memory_space, file_space)
         else
            call h5dread_f(self%id, self%memory_type, buffer, status, memory_space, file_space)
         end if
      end if
      call h5sclose_f(file_space, ignored)
      call h5sclose_f(memory_space, ignored)
      call check(status >= 0, self%place, trim(merge('write the dataset (is the disk full?)', &
         & 'read the dataset: damaged file?      ', write)), error)
   end subroutine transfer_rows

   subroutine set_kind(table, file, path, kind, components, rank)
      class(hdf5_table_t), intent(inout) :: table
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: path
      integer, intent(in) :: kind
      integer, optional, intent(in) :: components, rank
      integer :: ignored
      table%place = file%name//': '//path
      table%components = 1
      if (present(components)) table%components = components
      table%rank = merge(1, 2, table%components == 1)
      if (present(rank)) table%rank = rank
      select case (kind)
      case (hdf5_real, hdf5_single); table%memory_type = h5t_native_double
      case (hdf5_integer, hdf5_byte); call h5tcopy_f(h5kind_to_type(i8, h5_integer_kind), table%memory_type, ignored)
      case default; call new_text_type(line_length, .true., table%memory_type)
      end select
   end subroutine set_kind

   subroutine new_text_type(length, utf8, type)
      integer, intent(in) :: length
      logical, intent(in) :: utf8
      integer(hid_t), intent(out) :: type
      integer :: ignored
      call h5tcopy_f(h5t_fortran_s1, type, ignored)
      call h5tset_size_f(type, int(length, size_t), ignored)
      if (utf8) then
         call h5tset_cset_f(type, h5t_cset_utf8_f, ignored)
      else
         call h5tset_strpad_f(type, h5t_str_nullpad_f, ignored)
      end if
   end subroutine new_text_type

   !> Start the library (harmless when it runs already) and keep it silent.
   subroutine start(error)
      type(error_t), allocatable, intent(out) :: error
      integer :: status
      ! once in a process: some versions of HDF5 refuse a second start after h5dont_atexit
      logical, save :: started = .false.
      if (started) return
      ! else HDF5 would lock the file as long as a run lasts, and refuse to write it while somebody reads it
      call set_environment('HDF5_USE_FILE_LOCKING', 'FALSE')
      ! HDF5 1.10 crashes in its exit handler after a write has failed; files are closed by their owners
      call h5dont_atexit_f(status)
      call h5open_f(status)
      if (status >= 0) call h5eset_auto_f(0, status)
      started = status >= 0
      if (.not. started) call raise(error, status_io_error, 'the HDF5 library cannot be started')
   end subroutine start

   !> Ask the operating system first: it says why a file cannot be written, HDF5 does not.
   subroutine ask_system(name, file_status, action, verb, error)
      character(len=*), intent(in) :: name, file_status, action, verb
      type(error_t), allocatable, intent(out) :: error
      character(len=256) :: reason
      integer :: unit, status
      open (newunit=unit, file=name, status=file_status, action=action, form='unformatted', access='stream', &
         & iostat=status, iomsg=reason)
      if (status == 0) then
         close (unit)
      else
         call raise(error, status_io_error, name//': cannot '//verb//' the result file: '//trim(reason))
      end if
   end subroutine ask_system

   subroutine check(ok, place, operation, error)
      logical, intent(in) :: ok
      character(len=*), intent(in) :: place, operation
      type(error_t), allocatable, intent(inout) :: error
      if (.not. ok) call raise(error, status_io_error, place//': cannot '//operation)
   end subroutine check
end module finshell_hdf5
