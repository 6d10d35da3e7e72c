!> What the screen shows of an increment.
module finshell_increment_lines
   use, intrinsic :: iso_fortran_env, only: output_unit
   use finshell_error, only: text_of
   use finshell_kinds, only: wp
   use finshell_monitor, only: monitor_t
   use finshell_observer, only: record_t, vibration_t
   use finshell_stability, only: event_name, no_event
   use finshell_step, only: control_frequencies
   implicit none
   private
   public :: show_record

   integer, parameter :: shown = 3 !< monitors on the screen

contains

   !> All that is shown of an increment.
   subroutine show_record(record, turns, headed, monitors, values, motion)
      type(record_t), intent(in) :: record
      logical, intent(in) :: turns !< arc-length begins or ceases to stand in
      logical, intent(in) :: headed !< with the headings of the columns
      type(monitor_t), intent(in) :: monitors(:)
      real(wp), intent(in) :: values(:)
      real(wp), intent(in), optional :: motion(:) !< values of motion_columns, time first
      if (turns) write (output_unit, '(5x,a)') trim(merge( &
         'arc-length stands in from here: what the step prescribes turns round  ', &
         'the control of the step takes over again                              ', record%stands_in))
      call show_increment(record, headed, monitors, values, motion)
      if (record%control == control_frequencies) call show_vibration(record%vibration)
      call show_ways(record)
      if (record%event /= no_event) call show_event(record)
      if (record%snap) call show_snap(record)
   end subroutine show_record

   !> A limit or bifurcation point.
   subroutine show_event(record)
      type(record_t), intent(in) :: record
      if (record%located) then
         write (output_unit, '(5x,a)') event_name(record%event)//' located at load factor '//text_of(record%load_factor) &
            //'; cosine between null vector and load '//text_of(record%load_cosine)
      else
         write (output_unit, '(5x,a)') event_name(record%event)//' passed since the increment before'
      end if
   end subroutine show_event

   !> An increment that has left the path.
   subroutine show_snap(record)
      type(record_t), intent(in) :: record
      if (abs(record%misfit) > 0.01_wp) then
         write (output_unit, '(5x,a,f0.1,a)') 'SNAP: this state is not the continuation of the path; work and stored energy ' &
            //'differ by ', 100*abs(record%misfit), ' %'
      else
         write (output_unit, '(5x,a)') 'SNAP: this state is not the continuation of the path; shorter increments found none'
      end if
   end subroutine show_snap

   !> In what ways an increment was found, where Newton's iteration was not all.
   subroutine show_ways(record)
      type(record_t), intent(in) :: record
      if (record%regularised > 0) write (output_unit, '(5x,a,i0,a)') &
         'the tangent of the law was singular here: ', record%regularised, ' iterations used a stand-in; the solution is unchanged'
      if (record%descended) write (output_unit, '(5x,a)') &
         'Newton''s iteration failed; a descent in energy found this stable state (not along a path; others may exist)'
      if (record%switched > 1) write (output_unit, '(5x,a,i0,a)') &
         'fibres act where the linear solution stretches them: found in ', record%switched, ' solutions'
      if (record%relaxed) write (output_unit, '(5x,a,i0,a)') 'found by dynamic relaxation in ', record%steps, &
         ' steps, finished by Newton''s iteration (not along a path; others may exist)'
   end subroutine show_ways

   !> Progress: increment, load factor, time where there is motion, monitors, iterations, cuts, pivots, CPU seconds.
   subroutine show_increment(record, headed, monitors, values, motion)
      type(record_t), intent(in) :: record
      logical, intent(in) :: headed !< with the headings of the columns
      type(monitor_t), intent(in) :: monitors(:)
      real(wp), intent(in) :: values(:)
      real(wp), intent(in), optional :: motion(:) !< values of motion_columns, time first
      character(len=14) :: heading
      integer :: i, n
      n = min(shown, size(values))
      if (headed) then
         write (output_unit, '(a)', advance='no') '  inc    load factor'
         if (present(motion)) write (output_unit, '(a15)', advance='no') 'time'
         do i = 1, n
            heading = monitors(i)%name
            write (output_unit, '(1x,a)', advance='no') adjustr(heading)
         end do
         write (output_unit, '(a)') '  iterations  cuts  negative pivots   CPU s'
      end if
      write (output_unit, '(i5,a)', advance='no') record%increment, column(record%load_factor)
      if (present(motion)) write (output_unit, '(a)', advance='no') column(motion(1))
      do i = 1, n
         write (output_unit, '(a)', advance='no') column(values(i))
      end do
      if (record%negative_pivots < 0) then
         write (output_unit, '(i12,i6,a17,f8.2)') record%iterations, record%cuts, '?', record%cpu_time
      else
         write (output_unit, '(i12,i6,i17,f8.2)') record%iterations, record%cuts, record%negative_pivots, record%cpu_time
      end if
      flush (output_unit)
   end subroutine show_increment

   !> Frequency and effective masses of a mode.
   subroutine show_vibration(v)
      type(vibration_t), intent(in) :: v
      character(len=60) :: shares
      write (shares, '(3(f6.1,a))') 100*v%effective_mass(1)/v%whole_mass, ' %,', 100*v%effective_mass(2)/v%whole_mass, ' %,', &
         100*v%effective_mass(3)/v%whole_mass, ' %'
      write (output_unit, '(5x,a)') 'frequency '//text_of(v%frequency)//'; effective mass along x, y, z: '//trim(adjustl(shares))
   end subroutine show_vibration

   !> A number as a column, with a blank before it.
   pure function column(x) result(text)
      real(wp), intent(in) :: x
      character(len=15) :: text
      text = text_of(x)
      text = adjustr(text)
   end function column
end module finshell_increment_lines
