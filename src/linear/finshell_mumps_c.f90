!> MUMPS as finshell_mumps_c.c shows it: a handle, its numbers, its calls.
module finshell_mumps_c
   use, intrinsic :: iso_c_binding, only: c_double, c_int, c_int64_t, c_ptr
   implicit none
   private
   public :: finshell_mumps_open, finshell_mumps_call, finshell_mumps_close, finshell_mumps_icntl, finshell_mumps_cntl
   public :: finshell_mumps_infog, finshell_mumps_rinfog, finshell_mumps_sym_perm, finshell_mumps_matrix
   public :: finshell_mumps_local_matrix, finshell_mumps_order, finshell_mumps_scaling, finshell_mumps_rhs

   interface
      type(c_ptr) function finshell_mumps_open(single, symmetry, communicator) bind(C)
         import :: c_ptr, c_int
         integer(c_int), value :: single !< 1: in single precision
         integer(c_int), value :: symmetry, communicator
      end function finshell_mumps_open

      subroutine finshell_mumps_call(handle, job) bind(C)
         import :: c_ptr, c_int
         type(c_ptr), value :: handle
         integer(c_int), value :: job
      end subroutine finshell_mumps_call

      subroutine finshell_mumps_close(handle) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle
      end subroutine finshell_mumps_close

      type(c_ptr) function finshell_mumps_icntl(handle) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle
      end function finshell_mumps_icntl

      subroutine finshell_mumps_cntl(handle, i, value) bind(C)
         import :: c_ptr, c_int, c_double
         type(c_ptr), value :: handle
         integer(c_int), value :: i
         real(c_double), value :: value
      end subroutine finshell_mumps_cntl

      type(c_ptr) function finshell_mumps_infog(handle) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle
      end function finshell_mumps_infog

      real(c_double) function finshell_mumps_rinfog(handle, i) bind(C)
         import :: c_ptr, c_int, c_double
         type(c_ptr), value :: handle
         integer(c_int), value :: i
      end function finshell_mumps_rinfog

      type(c_ptr) function finshell_mumps_sym_perm(handle) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle
      end function finshell_mumps_sym_perm

      subroutine finshell_mumps_matrix(handle, n, entries, rows, columns, values) bind(C)
         import :: c_ptr, c_int, c_int64_t
         type(c_ptr), value :: handle, rows, columns, values
         integer(c_int), value :: n
         integer(c_int64_t), value :: entries
      end subroutine finshell_mumps_matrix

      subroutine finshell_mumps_local_matrix(handle, n, entries, rows, columns, values) bind(C)
         import :: c_ptr, c_int, c_int64_t
         type(c_ptr), value :: handle, rows, columns, values
         integer(c_int), value :: n
         integer(c_int64_t), value :: entries
      end subroutine finshell_mumps_local_matrix

      subroutine finshell_mumps_order(handle, position) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle, position
      end subroutine finshell_mumps_order

      subroutine finshell_mumps_scaling(handle, rows, columns) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle, rows, columns
      end subroutine finshell_mumps_scaling

      subroutine finshell_mumps_rhs(handle, rhs, n, count) bind(C)
         import :: c_ptr, c_int
         type(c_ptr), value :: handle, rhs
         integer(c_int), value :: n, count
      end subroutine finshell_mumps_rhs
   end interface
end module finshell_mumps_c
