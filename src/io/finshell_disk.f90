!> What Fortran cannot ask the operating system (POSIX): to rename a file, and whether the disk has room.
module finshell_disk
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_int64_t, c_null_char, c_ptr
   use finshell_kinds, only: i8
   implicit none
   private
   public :: has_room, rename_in_system

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

      function c_ftruncate(descriptor, length) bind(c, name='ftruncate') result(status)
         import :: c_int, c_int64_t
         integer(c_int), value :: descriptor
         integer(c_int64_t), value :: length
         integer(c_int) :: status
      end function c_ftruncate
   end interface

contains

   !> Rename a file, replacing another one of the new name; false when it cannot be done.
   logical function rename_in_system(old, new)
      character(len=*), intent(in) :: old, new
      rename_in_system = c_rename(old//c_null_char, new//c_null_char) == 0
   end function rename_in_system

   !> Whether the existing file `name` could grow by `bytes`: tries it, and gives the room back.
   logical function has_room(name, bytes)
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: bytes
      type(c_ptr) :: file
      integer(c_int) :: descriptor, ignored
      integer(i8) :: length
      has_room = .false.
      inquire (file=name, size=length)
      if (length < 0) return
      file = c_fopen(name//c_null_char, 'r+'//c_null_char)
      if (.not. c_associated(file)) return
      descriptor = c_fileno(file)
      has_room = c_posix_fallocate(descriptor, length, bytes) == 0
      ignored = c_ftruncate(descriptor, length)
      ignored = c_fclose(file)
   end function has_room
end module finshell_disk
