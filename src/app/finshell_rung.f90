!> A run as a rung of a study: what it watches, and the file in which it says what came out.
module finshell_rung
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use finshell_error, only: error_t, raise
   use finshell_input, only: input_t
   use finshell_kinds, only: wp
   use finshell_ladder, only: rung_t
   use finshell_monitor, only: monitor_t, reduce_max, reduce_min, restart_none
   use finshell_result_fields, only: find_field
   use finshell_status, only: status_io_error
   use finshell_step, only: control_arc_length, control_buckling, control_frequencies, control_linear, control_load, step_t
   implicit none
   private
   public :: watch_rung, watches_load, write_rung, read_rung

contains

   !> No fields, and if the input has no monitors the largest displacements along the axes and against them.
   subroutine watch_rung(input)
      type(input_t), intent(inout) :: input
      character, parameter :: axes(3) = ['x', 'y', 'z']
      type(monitor_t) :: monitor
      integer :: k
      input%outputs%fields = .false.
      input%outputs%verbose = .false.
      input%outputs%energy = .false.
      deallocate (input%probes)
      allocate (input%probes(0))
      input%outputs%restart = restart_none
      if (size(input%monitors) > 0) return
      monitor%quantity = find_field('displacement')
      monitor%node_set = 'all'
      do k = 1, 3
         monitor%component = k
         monitor%reduce = reduce_max
         monitor%name = 'largest_u'//axes(k)
         input%monitors = [input%monitors, monitor]
         monitor%reduce = reduce_min
         monitor%name = 'smallest_u'//axes(k)
         input%monitors = [input%monitors, monitor]
      end do
   end subroutine watch_rung

   !> Is the load factor at the end of a step an answer, and not given?
   pure logical function watches_load(step)
      type(step_t), intent(in) :: step
      select case (step%control)
      case (control_load, control_linear); watches_load = .false.
      case (control_buckling, control_frequencies); watches_load = .true.
      case (control_arc_length); watches_load = (allocated(step%displacements) .or. allocated(step%volumes)) &
         .and. .not. step%ends_at_load_factor
      case default; watches_load = .not. step%ends_at_load_factor
      end select
   end function watches_load

   !> Write the file. Error: it cannot be written.
   subroutine write_rung(file, nodes, elements, unknowns, iterations, values, error)
      character(len=*), intent(in) :: file
      integer, intent(in) :: nodes, elements, unknowns, iterations
      real(wp), intent(in) :: values(:) !< of the monitors and the load factor; NaN: missing
      type(error_t), allocatable, intent(inout) :: error
      character(len=40) :: word
      integer :: i, status, unit
      if (allocated(error)) return
      open (newunit=unit, file=file, status='replace', action='write', iostat=status)
      if (status /= 0) then
         call raise(error, status_io_error, file//': cannot be written')
         return
      end if
      write (unit, '(i0)', iostat=status) nodes, elements, unknowns, iterations, size(values)
      do i = 1, size(values)
         if (status /= 0) exit
         word = 'missing'
         if (ieee_is_finite(values(i))) write (word, '(es25.16e3)') values(i)
         write (unit, '(a)', iostat=status) trim(word)
      end do
      close (unit)
      if (status /= 0) call raise(error, status_io_error, file//': cannot be written')
   end subroutine write_rung

   !> Read it; false: it is not there, or not whole.
   logical function read_rung(file, number, rung) result(done)
      character(len=*), intent(in) :: file
      integer, intent(in) :: number !< of values
      type(rung_t), intent(inout) :: rung
      character(len=40) :: word
      integer :: found, i, status, unit
      done = .false.
      open (newunit=unit, file=file, status='old', action='read', iostat=status)
      if (status /= 0) return
      read (unit, *, iostat=status) rung%nodes, rung%elements, rung%unknowns, rung%iterations, found
      done = status == 0 .and. found == number
      allocate (rung%values(number), source=0.0_wp)
      allocate (rung%missing(number), source=.false.)
      do i = 1, number
         if (.not. done) exit
         read (unit, '(a)', iostat=status) word
         done = status == 0
         rung%missing(i) = index(word, 'missing') > 0
         if (done .and. .not. rung%missing(i)) read (word, *, iostat=status) rung%values(i)
         done = done .and. status == 0
      end do
      close (unit)
   end function read_rung
end module finshell_rung
