!> What a run will need, said by `check`.
module finshell_effort_report
   use, intrinsic :: iso_fortran_env, only: output_unit
   use finshell_back_ends, only: can_work_on_disk
   use finshell_effort, only: factorisation_seconds
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_kinds, only: dp
   use finshell_memory, only: memory_left, memory_needed
   implicit none
   private
   public :: print_effort

contains

   !> Memory and time, estimated from the size; with `factor` the equations are ordered, too, and the factor is known.
   !> Errors: as of the ordering.
   subroutine print_effort(problem, factor, speaks, error)
      type(equilibrium_t), intent(inout) :: problem
      logical, intent(in) :: factor, speaks
      type(error_t), allocatable, intent(out) :: error
      real(dp) :: begun, ended, nodes, needed
      logical :: on_disk

      nodes = size(problem%structure%mesh%coordinates, 2)
      on_disk = problem%solver%options%out_of_core
      if (can_work_on_disk()) on_disk = on_disk .or. memory_needed(nodes, .false.) > memory_left(0.0_dp)
      needed = memory_needed(nodes, on_disk)
      if (speaks) write (output_unit, '(a)') 'Estimate: '//number(needed/1e9_dp)//' GB of memory'// &
         trim(merge(' (factors on disk)', '                  ', on_disk))//', '//number(factorisation_seconds(problem%n))// &
         ' s of CPU time for a factorisation, of which an iteration takes one at most'
      if (.not. factor) return
      call cpu_time(begun)
      call problem%solver%prepare(error)
      call cpu_time(ended)
      if (allocated(error)) return
      if (speaks) write (output_unit, '(a)') 'Ordered in '//number(ended - begun)//' s of CPU time: the factor takes '// &
         number(problem%solver%memory()/1e9_dp)//' GB'//trim(merge(' on disk', '        ', problem%solver%on_disk()))
   end subroutine print_effort

   !> Two digits.
   function number(x) result(text)
      real(dp), intent(in) :: x
      character(len=:), allocatable :: text
      character(len=20) :: buffer
      integer :: decimals
      decimals = 0
      if (x > 0) decimals = max(0, min(4, 1 - floor(log10(x))))
      write (buffer, '(f0.'//achar(iachar('0') + decimals)//')') x
      text = trim(buffer)
      if (text(1:1) == '.') text = '0'//text
      if (text(len(text):) == '.') text = text(:len(text) - 1)
   end function number
end module finshell_effort_report
