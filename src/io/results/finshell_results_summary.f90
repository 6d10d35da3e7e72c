!> What is in a result file, without its fields.
module finshell_results_summary
   use finshell_error, only: error_t
   use finshell_hdf5, only: hdf5_file_t, hdf5_integer, hdf5_line, hdf5_table_t
   use finshell_kinds, only: i8
   implicit none
   private
   public :: results_summary_t, read_summary

   type :: results_summary_t
      character(len=:), allocatable :: version !< of finshell, that wrote it
      character(len=:), allocatable :: input !< its text
      integer(i8) :: nodes = 0, elements = 0
      integer(i8) :: steps = 0 !< states with fields, the unloaded one included
      character(len=:), allocatable :: on_nodes, on_elements !< names of the fields
      character(len=:), allocatable :: said !< the last line of its log: how the run ended; '' where it did not say
   end type results_summary_t

contains

   !> Read it. Errors: no such file; not one of ours.
   subroutine read_summary(name, summary, error)
      character(len=*), intent(in) :: name
      type(results_summary_t), intent(out) :: summary
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_file_t) :: file
      type(error_t), allocatable :: ignored

      summary%version = ''
      summary%input = ''
      summary%said = ''
      call file%open(name, error)
      if (allocated(error)) return
      call file%get_integer('/VTKHDF/Steps', 'NSteps', summary%steps, error)
      if (.not. allocated(error)) call file%get_text('/finshell', 'version', summary%version, error)
      if (.not. allocated(error)) call file%read_text('/finshell/input', summary%input, error)
      call take_number('/VTKHDF/NumberOfPoints', summary%nodes)
      call take_number('/VTKHDF/NumberOfCells', summary%elements)
      call take_last_line('/finshell/log')
      summary%on_nodes = file%members('/VTKHDF/PointData')
      summary%on_elements = file%members('/VTKHDF/CellData')
      call file%close(ignored)

   contains

      subroutine take_number(path, number)
         character(len=*), intent(in) :: path
         integer(i8), intent(out) :: number
         type(hdf5_table_t) :: table
         integer(i8) :: rows, values(1)
         values = 0
         if (.not. allocated(error)) call table%open(file, path, hdf5_integer, rows, error)
         if (.not. allocated(error)) call table%get_integers(0_i8, values, error)
         number = values(1)
         call table%close()
      end subroutine take_number

      subroutine take_last_line(path)
         character(len=*), intent(in) :: path
         type(hdf5_table_t) :: table
         integer(i8) :: rows
         if (.not. allocated(error)) call table%open(file, path, hdf5_line, rows, error)
         if (.not. allocated(error)) then
            if (rows > 0) call table%get_line(rows - 1, summary%said, error)
         end if
         call table%close()
      end subroutine take_last_line
   end subroutine read_summary
end module finshell_results_summary
