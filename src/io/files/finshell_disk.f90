!> What Fortran cannot ask the operating system (POSIX): to rename, remove, cut and lock files, and whether the disk has room.
module finshell_disk
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_int, c_int64_t, c_intptr_t, c_loc, c_long
   use, intrinsic :: iso_c_binding, only: c_null_char, c_null_ptr, c_ptr, c_size_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: i8
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: check_replaceable, full_name, lack_of_room
   public :: rename_in_system, remove_in_system, copy_in_system, link_in_system, cut_in_system
   public :: write_failures_return, set_environment
   public :: length_in_system, lock_t, take_lock

   !> A file that is locked as long as this process lives or until it is released; others see the lock if they ask.
   type :: lock_t
      private
      type(c_ptr) :: file = c_null_ptr
   contains
      procedure :: lock_now
      procedure :: unlock_now
      procedure :: held
      procedure :: release
   end type lock_t

   integer(c_int), parameter :: exclusive = 2, without_waiting = 4, unlock = 8 ! arguments of flock
   integer(c_int), parameter :: would_block = 11, file_too_large = 27 ! errno
   integer(c_int), parameter :: size_limit_signal = 25
   integer(c_intptr_t), parameter :: ignore_signal = 1

   interface
      function c_rename(old, new) bind(c, name='rename') result(status)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: old(*), new(*)
         integer(c_int) :: status
      end function c_rename

      function c_fopen(name, mode) bind(c, name='fopen') result(file)
         import :: c_char, c_ptr
         character(kind=c_char), intent(in) :: name(*), mode(*)
         type(c_ptr) :: file
      end function c_fopen

      function c_fileno(file) bind(c, name='fileno') result(descriptor)
         import :: c_int, c_ptr
         type(c_ptr), value :: file
         integer(c_int) :: descriptor
      end function c_fileno

      function c_fclose(file) bind(c, name='fclose') result(status)
         import :: c_int, c_ptr
         type(c_ptr), value :: file
         integer(c_int) :: status
      end function c_fclose

      function c_posix_fallocate(descriptor, offset, length) bind(c, name='posix_fallocate') result(status)
         import :: c_int, c_int64_t
         integer(c_int), value :: descriptor
         integer(c_int64_t), value :: offset, length
         integer(c_int) :: status
      end function c_posix_fallocate

      function c_flock(descriptor, operation) bind(c, name='flock') result(status)
         import :: c_int
         integer(c_int), value :: descriptor, operation
         integer(c_int) :: status
      end function c_flock

      function c_errno() bind(c, name='__errno_location') result(place)
         import :: c_ptr
         type(c_ptr) :: place
      end function c_errno

      function c_getcwd(buffer, size) bind(c, name='getcwd') result(place)
         import :: c_ptr, c_size_t
         type(c_ptr), value :: buffer
         integer(c_size_t), value :: size
         type(c_ptr) :: place
      end function c_getcwd

      function c_getpid() bind(c, name='getpid') result(pid)
         import :: c_int
         integer(c_int) :: pid
      end function c_getpid

      function c_fputs(text, file) bind(c, name='fputs') result(status)
         import :: c_char, c_int, c_ptr
         character(kind=c_char), intent(in) :: text(*)
         type(c_ptr), value :: file
         integer(c_int) :: status
      end function c_fputs

      function c_fflush(file) bind(c, name='fflush') result(status)
         import :: c_int, c_ptr
         type(c_ptr), value :: file
         integer(c_int) :: status
      end function c_fflush

      function c_remove(name) bind(c, name='remove') result(status)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int) :: status
      end function c_remove

      function c_fseek(file, offset, origin) bind(c, name='fseek') result(status)
         import :: c_int, c_long, c_ptr
         type(c_ptr), value :: file
         integer(c_long), value :: offset
         integer(c_int), value :: origin
         integer(c_int) :: status
      end function c_fseek

      function c_ftell(file) bind(c, name='ftell') result(place)
         import :: c_long, c_ptr
         type(c_ptr), value :: file
         integer(c_long) :: place
      end function c_ftell

      function c_fread(buffer, size, count, file) bind(c, name='fread') result(done)
         import :: c_ptr, c_size_t
         type(c_ptr), value :: buffer, file
         integer(c_size_t), value :: size, count
         integer(c_size_t) :: done
      end function c_fread

      function c_fwrite(buffer, size, count, file) bind(c, name='fwrite') result(done)
         import :: c_ptr, c_size_t
         type(c_ptr), value :: buffer, file
         integer(c_size_t), value :: size, count
         integer(c_size_t) :: done
      end function c_fwrite

      function c_link(old, new) bind(c, name='link') result(status)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: old(*), new(*)
         integer(c_int) :: status
      end function c_link

      function c_truncate(name, length) bind(c, name='truncate') result(status)
         import :: c_char, c_int, c_int64_t
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int64_t), value :: length
         integer(c_int) :: status
      end function c_truncate

      function c_signal(number, action) bind(c, name='signal') result(before)
         import :: c_int, c_intptr_t
         integer(c_int), value :: number
         integer(c_intptr_t), value :: action
         integer(c_intptr_t) :: before
      end function c_signal

      function c_setenv(name, value, overwrite) bind(c, name='setenv') result(status)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*), value(*)
         integer(c_int), value :: overwrite
         integer(c_int) :: status
      end function c_setenv

      function c_ftruncate(descriptor, length) bind(c, name='ftruncate') result(status)
         import :: c_int, c_int64_t
         integer(c_int), value :: descriptor
         integer(c_int64_t), value :: length
         integer(c_int) :: status
      end function c_ftruncate
   end interface

contains

   !> An older file may be replaced if it may be written to.
   subroutine check_replaceable(name, error)
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      character(len=256) :: reason
      logical :: exists
      integer :: unit, status
      inquire (file=name, exist=exists)
      if (.not. exists) return
      open (newunit=unit, file=name, status='old', action='readwrite', iostat=status, iomsg=reason)
      if (status == 0) then
         close (unit)
      else
         call raise(error, status_io_error, name//': cannot be replaced: '//trim(reason))
      end if
   end subroutine check_replaceable

   !> A file name with its folders from the root on; as it is where the system does not say where we are.
   function full_name(name) result(full)
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: full
      integer, parameter :: longest = 4096
      character(kind=c_char), target :: buffer(longest)
      integer :: i
      full = name
      if (index(name, '/') == 1) return
      if (.not. c_associated(c_getcwd(c_loc(buffer), int(longest, c_size_t)))) return
      full = '/'//name
      do i = findloc(buffer, c_null_char, dim=1) - 1, 1, -1
         full = buffer(i)//full
      end do
   end function full_name

   !> Rename a file, replacing another one of the new name; false when it cannot be done.
   logical function rename_in_system(old, new)
      character(len=*), intent(in) :: old, new
      rename_in_system = c_rename(old//c_null_char, new//c_null_char) == 0
   end function rename_in_system

   !> Remove a file; nothing happens when there is none.
   subroutine remove_in_system(name)
      character(len=*), intent(in) :: name
      integer(c_int) :: ignored
      ignored = c_remove(name//c_null_char)
   end subroutine remove_in_system

   !> Give a file a second name; false when it cannot be done.
   logical function link_in_system(old, new)
      character(len=*), intent(in) :: old, new
      link_in_system = c_link(old//c_null_char, new//c_null_char) == 0
   end function link_in_system

   !> Copy a file; false, and no copy, when it cannot be done.
   logical function copy_in_system(old, new) result(ok)
      character(len=*), intent(in) :: old, new
      character(kind=c_char), allocatable, target :: buffer(:)
      type(c_ptr) :: from, to
      integer(c_size_t) :: n
      integer(c_int) :: ignored
      ok = .false.
      from = c_fopen(old//c_null_char, 'r'//c_null_char)
      if (.not. c_associated(from)) return
      to = c_fopen(new//c_null_char, 'w'//c_null_char)
      if (c_associated(to)) then
         allocate (buffer(1048576))
         do
            n = c_fread(c_loc(buffer), 1_c_size_t, size(buffer, kind=c_size_t), from)
            ok = c_fwrite(c_loc(buffer), 1_c_size_t, n, to) == n
            if (n < size(buffer) .or. .not. ok) exit
         end do
         ok = c_fclose(to) == 0 .and. ok
         ok = ok .and. length_in_system(new) == length_in_system(old)
         if (.not. ok) call remove_in_system(new)
      end if
      ignored = c_fclose(from)
   end function copy_in_system

   !> Length of a file in bytes as others see it, -1 when there is none.
   integer(i8) function length_in_system(name) result(length)
      character(len=*), intent(in) :: name
      type(c_ptr) :: file
      integer(c_int) :: ignored
      length = -1
      file = c_fopen(name//c_null_char, 'r'//c_null_char)
      if (.not. c_associated(file)) return
      if (c_fseek(file, 0_c_long, 2_c_int) == 0) length = c_ftell(file)
      ignored = c_fclose(file)
   end function length_in_system

   !> Cut a file to its first `length` bytes.
   subroutine cut_in_system(name, length)
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: length
      integer(c_int) :: ignored
      ignored = c_truncate(name//c_null_char, length)
   end subroutine cut_in_system

   !> From now on a file that grows beyond the limit of the process (ulimit -f) is a failed write, not the end of the program.
   subroutine write_failures_return()
      integer(c_intptr_t) :: before
      before = c_signal(size_limit_signal, ignore_signal)
   end subroutine write_failures_return

   !> Set a variable of the environment of this process, for the libraries it uses.
   subroutine set_environment(name, value)
      character(len=*), intent(in) :: name, value
      integer(c_int) :: ignored
      ignored = c_setenv(name//c_null_char, value//c_null_char, 1_c_int)
   end subroutine set_environment

   !> Why the existing file `name` could not grow by `bytes`, '' if it could: tries it, and gives the room back.
   function lack_of_room(name, bytes) result(reason)
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: bytes
      character(len=:), allocatable :: reason
      type(c_ptr) :: file
      integer(c_int) :: descriptor, status, ignored
      integer(i8) :: length
      reason = 'it has vanished'
      inquire (file=name, size=length)
      if (length < 0) return
      file = c_fopen(name//c_null_char, 'r+'//c_null_char)
      if (.not. c_associated(file)) return
      descriptor = c_fileno(file)
      status = c_posix_fallocate(descriptor, length, bytes)
      ignored = c_ftruncate(descriptor, length)
      ignored = c_fclose(file)
      reason = ''
      if (status == file_too_large) then
         reason = 'it would become larger than files may be here (ulimit -f)'
      else if (status /= 0) then
         reason = 'the disk is full'
      end if
   end function lack_of_room

   !> Lock the file `name`, which is created if need be and then tells the process; `reason` is '' or why this cannot be. A process
   !> that dies gives its locks back. Where the file system knows no locks there is no protection.
   subroutine take_lock(name, lock, reason)
      character(len=*), intent(in) :: name
      type(lock_t), intent(out) :: lock
      character(len=:), allocatable, intent(out) :: reason
      character(len=32) :: owner
      integer(c_int) :: ignored
      integer :: attempt

      reason = ''
      do attempt = 1, 5
         lock%file = c_fopen(name//c_null_char, 'a'//c_null_char)
         if (.not. c_associated(lock%file)) return
         if (c_flock(c_fileno(lock%file), exclusive + without_waiting) /= 0) then
            if (last_error() /= would_block) return
            reason = 'another run is writing these results'
            owner = first_line(name)
            if (owner /= '') reason = reason//' (process '//trim(owner)//')'
            ignored = c_fclose(lock%file)
            lock%file = c_null_ptr
            return
         end if
         ignored = c_ftruncate(c_fileno(lock%file), 0_c_int64_t)
         ignored = c_fputs(text_of(int(c_getpid()))//new_line('a')//c_null_char, lock%file)
         ignored = c_fflush(lock%file)
         ! the run before may have removed the file between opening and locking: then this lock is on a file nobody can see
         if (first_line(name) == text_of(int(c_getpid()))) return
         ignored = c_fclose(lock%file)
         lock%file = c_null_ptr
      end do
   end subroutine take_lock

   pure logical function held(self)
      class(lock_t), intent(in) :: self
      held = c_associated(self%file)
   end function held

   !> Give a lock back, and remove its file.
   subroutine release(self, name)
      class(lock_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(c_int) :: ignored
      if (.not. c_associated(self%file)) return
      call remove_in_system(name)
      ignored = c_fclose(self%file)
      self%file = c_null_ptr
   end subroutine release

   !> Lock an existing file until `unlock_now`, unless somebody else has it locked.
   subroutine lock_now(self, name)
      class(lock_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(c_int) :: ignored
      if (.not. c_associated(self%file)) self%file = c_fopen(name//c_null_char, 'r+'//c_null_char)
      if (c_associated(self%file)) ignored = c_flock(c_fileno(self%file), exclusive + without_waiting)
   end subroutine lock_now

   subroutine unlock_now(self)
      class(lock_t), intent(inout) :: self
      integer(c_int) :: ignored
      if (.not. c_associated(self%file)) return
      ignored = c_flock(c_fileno(self%file), unlock)
      ignored = c_fclose(self%file)
      self%file = c_null_ptr
   end subroutine unlock_now

   integer(c_int) function last_error()
      integer(c_int), pointer :: number
      call c_f_pointer(c_errno(), number)
      last_error = number
   end function last_error

   function first_line(name) result(line)
      character(len=*), intent(in) :: name
      character(len=32) :: line
      integer :: unit, status
      line = ''
      open (newunit=unit, file=name, status='old', action='read', iostat=status)
      if (status /= 0) return
      read (unit, '(a)', iostat=status) line
      if (status /= 0) line = ''
      close (unit)
   end function first_line
end module finshell_disk
