!> Whether a model fits into memory, estimated from its number of nodes before anything large is made. Where Linux does not say
!> how much memory there is, nothing is refused.
module finshell_memory
   use finshell_kinds, only: i8, wp
   implicit none
   private
   public :: lack_of_memory, memory_left, memory_needed

   real(wp), parameter :: gigabyte = 1.0e9_wp
   !> Address space that OpenBLAS (which waits for ever where it does not get it) and the stacks of threads reserve beside that.
   real(wp), parameter :: reserved = 1.8e8_wp

contains

   !> Bytes that a model needs, most of them for the factor of its matrix unless that is on disk. Measured for symmetric matrices of
   !> 1 700 to 51 000 nodes: 17 to 19 kB a node and 20 to 40 MB, 7.5 to 8.5 kB with the factor on disk; unsymmetric ones need more.
   pure real(wp) function memory_needed(nodes, on_disk)
      real(wp), intent(in) :: nodes
      logical, intent(in) :: on_disk
      real(wp) :: doublings
      doublings = log(max(nodes, 2.0_wp))/log(2.0_wp)
      memory_needed = 4.0e7_wp + nodes*merge(2.0e3_wp + 4.0e2_wp*doublings, 1.1e4_wp + 4.5e2_wp*doublings, on_disk)
   end function memory_needed

   !> '' if so many nodes fit, else a sentence. A fifth is left to the error of the estimate.
   function lack_of_memory(nodes, on_disk) result(reason)
      real(wp), intent(in) :: nodes
      logical, intent(in) :: on_disk !< the factor may be
      character(len=:), allocatable :: reason
      real(wp) :: left, needed
      character(len=9) :: needed_text, left_text, nodes_text
      reason = ''
      needed = memory_needed(nodes, on_disk)
      left = machine_memory_left()
      if (0.8_wp*needed < left) then
         needed = needed + reserved
         left = address_space_left()
         if (0.8_wp*memory_needed(nodes, on_disk) + reserved < left) return
      end if
      write (needed_text, '(f9.2)') needed/gigabyte
      write (left_text, '(f9.2)') left/gigabyte
      write (nodes_text, '(es9.2)') nodes
      reason = 'the model has '//trim(adjustl(nodes_text))//' nodes and needs about '//trim(adjustl(needed_text)) &
         //' GB of memory, ' &
         //trim(merge('with the factor of its matrix on disk  ', 'most of it for the factor of the matrix', on_disk)) &
         //'; there are '//trim(adjustl(left_text)) &
         //' GB (see free -g and ulimit -v)'
   end function lack_of_memory

   !> Bytes that may still be taken: what is given, or 0 for all that this machine has for this process.
   real(wp) function memory_left(given) result(left)
      real(wp), intent(in) :: given
      left = given
      if (.not. given > 0) left = min(machine_memory_left(), max(0.0_wp, address_space_left() - reserved))
   end function memory_left

   !> Bytes that this process may still take, of the machine and of its control group.
   real(wp) function machine_memory_left() result(left)
      real(wp) :: limit, used
      left = huge(left)
      limit = 1024*number_in('/proc/meminfo', 'MemAvailable:')
      if (limit >= 0) left = limit
      limit = number_in('/sys/fs/cgroup/memory.max', '')
      used = number_in('/sys/fs/cgroup/memory.current', '')
      if (limit >= 0 .and. used >= 0) left = min(left, max(0.0_wp, limit - used))
   end function machine_memory_left

   !> Bytes of address space that are left (ulimit -v).
   real(wp) function address_space_left() result(left)
      real(wp) :: limit, used
      left = huge(left)
      limit = number_in('/proc/self/limits', 'Max address space')
      used = 1024*number_in('/proc/self/status', 'VmSize:')
      if (limit >= 0 .and. used >= 0) left = max(0.0_wp, limit - used)
   end function address_space_left

   !> The number behind a heading at the beginning of a line; negative where there is none.
   real(wp) function number_in(file, heading) result(number)
      character(len=*), intent(in) :: file, heading
      character(len=200) :: line
      integer(i8) :: whole
      integer :: unit, status
      number = -1
      open (newunit=unit, file=file, status='old', action='read', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (index(line, heading) /= 1) cycle
         read (line(len(heading) + 1:), *, iostat=status) whole
         if (status == 0) number = real(whole, wp)
         exit
      end do
      close (unit)
   end function number_in
end module finshell_memory
