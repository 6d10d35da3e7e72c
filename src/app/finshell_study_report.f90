!> What a study says: tables, a plot and advice on the screen; NAME.study.csv, and NAME.study.py that draws it.
module finshell_study_report
   use, intrinsic :: iso_fortran_env, only: output_unit
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: wp
   use finshell_ladder, only: predicted_cost, rung_done, rung_failed, rung_t, study_t
   use finshell_options, only: options_t
   use finshell_status, only: status_io_error
   use finshell_text_plot, only: text_plot
   implicit none
   private
   public :: label_t, print_study, write_study, text_of_seconds

   type :: label_t
      character(len=:), allocatable :: name
      integer :: kind = 0 !< monitors of one kind can be compared
   end type label_t

contains

   subroutine print_study(options, rungs, labels, study, elapsed)
      type(options_t), intent(in) :: options
      type(rung_t), intent(in) :: rungs(:)
      type(label_t), intent(in) :: labels(:)
      type(study_t), intent(in) :: study
      real(wp), intent(in) :: elapsed
      integer :: i, k

      write (output_unit, '(/,a)') ' level    nodes  elements  iterations      CPU s  predicted  largest error'
      do i = 1, size(rungs)
         associate (r => rungs(i))
            if (r%state == rung_done) then
               write (output_unit, '(i6,i9,i10,i12,2a11,a15)') r%level, r%nodes, r%elements, r%iterations, column(r%seconds), &
                  column(r%predicted), error_text(study%worst(i))
            else if (allocated(r%reason)) then
               write (output_unit, '(i6,2x,a)') r%level, trim(merge('FAILED: ', '        ', r%state == rung_failed))//' '//r%reason
            else
               write (output_unit, '(i6,2x,a)') r%level, trim(merge('not run: see above    ', 'not needed            ', &
                                                                    .not. options%accuracy_given))
            end if
         end associate
      end do
      do k = 1, size(labels)
         associate (e => study%estimates(k))
            write (output_unit, '(/,a)', advance='no') 'Monitor '//labels(k)%name//': '
            if (.not. study%scale(k) > 0) then
               write (output_unit, '(a)') 'zero on every mesh'
               cycle
            else if (e%settled) then
               write (output_unit, '(a)') 'the same on every mesh, '//text_of(e%limit)
            else if (e%asymptotic) then
               write (output_unit, '(a,f0.2,a)') 'limit '//text_of(e%limit)//', observed order ', e%order, &
                  ' on the last three meshes'
            else
               write (output_unit, '(a)') 'NOT YET IN THE ASYMPTOTIC RANGE: errors are differences to the finest mesh, and what ' &
                  //'may be left behind it'
            end if
         end associate
         do i = 1, size(rungs)
            if (rungs(i)%state /= rung_done) cycle
            if (rungs(i)%missing(k)) then
               write (output_unit, '(i6,a)') rungs(i)%level, '  missing'
            else
               write (output_unit, '(i6,a17,a15)') rungs(i)%level, text_of(rungs(i)%values(k)), error_text(study%error(k, i))
            end if
         end do
      end do
      call print_plot(rungs, study, options%accuracy)
      write (output_unit, '(/,a)') advice(options, rungs, study)
      write (output_unit, '(a)') 'The study took '//text_of_seconds(elapsed)//'; '//text_of_seconds(sum(rungs%seconds)) &
         //' of CPU time.'
   end subroutine print_study

   subroutine print_plot(rungs, study, accuracy)
      type(rung_t), intent(in) :: rungs(:)
      type(study_t), intent(in) :: study
      real(wp), intent(in) :: accuracy
      character(len=72), allocatable :: lines(:)
      integer :: i
      if (count(study%worst > 0) < 2) return
      lines = text_plot(rungs%seconds, study%worst, [(digit(rungs(i)%level), i=1, size(rungs))], &
                        'CPU time, seconds', 'largest error (marks: level, negative ones as a, b)', accuracy)
      write (output_unit, '(a)') ''
      do i = 1, size(lines)
         write (output_unit, '(a)') trim(lines(i))
      end do
   end subroutine print_plot

   pure character function digit(level)
      integer, intent(in) :: level
      digit = achar(iachar('0') + level)
      if (level < 0) digit = achar(iachar('a') - level - 1)
   end function digit

   !> One line: which mesh to take.
   function advice(options, rungs, study) result(text)
      type(options_t), intent(in) :: options
      type(rung_t), intent(in) :: rungs(:)
      type(study_t), intent(in) :: study
      character(len=:), allocatable :: text
      integer :: finest
      finest = findloc(rungs%state == rung_done, .true., dim=1, back=.true.)
      if (count(rungs%state == rung_done) < 2) then
         text = 'No advice: fewer than two meshes were solved.'
      else if (study%advised > 0) then
         associate (r => rungs(study%advised))
            text = 'For '//percent(options%accuracy)//' take level '//text_of(r%level)
            if (r%level /= 0) text = text//' (finshell run --refine '//text_of(r%level)//')'
            text = text//': error about '//percent(study%worst(study%advised))//', '//text_of_seconds(r%seconds)//' of CPU time.'
         end associate
         if (.not. study%trusted) text = text//' With care: not every monitor is in the asymptotic range.'
      else if (study%worst(finest) < 0) then
         text = 'No advice: a monitor is missing on the finest meshes.'
      else
         text = 'No mesh reaches '//percent(options%accuracy)//': level '//text_of(rungs(finest)%level)//' has ' &
            //percent(study%worst(finest))//'. '
         if (study%trusted) then
            associate (level => ceiling(study%wanted_level - 0.05_wp))
               text = text//'Level '//text_of(level)//' should, at about ' &
                  //text_of_seconds(max(0.0_wp, predicted_cost(rungs, level)))//' of CPU time.'
            end associate
         else
            text = text//'Which one would is not known: not every monitor is in the asymptotic range.'
         end if
      end if
   end function advice

   !> Write the table NAME.csv, and NAME.py that draws it. Error: cannot be written.
   subroutine write_study(name, rungs, labels, study, error)
      character(len=*), intent(in) :: name
      type(rung_t), intent(in) :: rungs(:)
      type(label_t), intent(in) :: labels(:)
      type(study_t), intent(in) :: study
      type(error_t), allocatable, intent(inout) :: error
      integer :: i, k, status, unit
      open (newunit=unit, file=name//'.csv', status='replace', action='write', iostat=status)
      if (status == 0) write (unit, '(a)', iostat=status) &
         'level,state,nodes,elements,unknowns,iterations,cpu_s,elapsed_s,predicted_cpu_s,monitor,value,relative_error,limit,' &
         //'order,asymptotic'
      do i = 1, size(rungs)
         if (rungs(i)%state /= rung_done .and. status == 0) write (unit, '(a)', iostat=status) start_of(rungs(i))//',,,,,,'
         if (rungs(i)%state /= rung_done) cycle
         do k = 1, size(labels)
            if (status /= 0) exit
            associate (e => study%estimates(k))
               write (unit, '(a)', iostat=status) start_of(rungs(i))//','//labels(k)%name &
                  //','//filled(rungs(i)%values(k), .not. rungs(i)%missing(k)) &
                  //','//filled(study%error(k, i), study%error(k, i) >= 0)//','//filled(e%limit, e%asymptotic) &
                  //','//filled(e%order, e%asymptotic)//','//trim(merge('yes', 'no ', e%asymptotic))
            end associate
         end do
      end do
      close (unit)
      if (status == 0) open (newunit=unit, file=name//'.py', status='replace', action='write', iostat=status)
      if (status == 0) write (unit, '(a)', iostat=status) &
         '#!/usr/bin/env python3', &
         '"""Draws '//name(index(name, '/', back=.true.) + 1:)//'.csv: error of each monitor against CPU time."""', &
         'import csv', &
         'from pathlib import Path', &
         '', &
         'import matplotlib', &
         '', &
         'matplotlib.use("Agg")', &
         'import matplotlib.pyplot as plt', &
         '', &
         'table = Path(__file__).with_suffix(".csv")', &
         'rows = [r for r in csv.DictReader(table.open()) if r["relative_error"] and float(r["relative_error"]) > 0]', &
         'for name in dict.fromkeys(r["monitor"] for r in rows):', &
         '    mine = [r for r in rows if r["monitor"] == name]', &
         '    x, y = [float(r["cpu_s"]) for r in mine], [float(r["relative_error"]) for r in mine]', &
         '    plt.loglog(x, y, "o-" if mine[0]["asymptotic"] == "yes" else "o:", label=name)', &
         '    for r, a, b in zip(mine, x, y):', &
         '        plt.annotate(r["level"], (a, b), textcoords="offset points", xytext=(4, 4))', &
         'plt.xlabel("CPU time, s")', &
         'plt.ylabel("relative error (dotted: not in the asymptotic range)")', &
         'plt.grid(True, which="both", alpha=0.3)', &
         'plt.legend()', &
         'plt.savefig(table.with_suffix(".png"), dpi=150)'
      close (unit)
      if (status /= 0) call raise(error, status_io_error, name//'.csv, '//name//'.py: cannot be written')
   end subroutine write_study

   function start_of(rung) result(text)
      type(rung_t), intent(in) :: rung
      character(len=:), allocatable :: text
      character(len=7), parameter :: states(0:3) = [character(len=7) :: 'planned', 'done', 'failed', 'not run']
      text = text_of(rung%level)//','//trim(states(rung%state))//','//text_of(rung%nodes)//','//text_of(rung%elements)//',' &
         //text_of(rung%unknowns)//','//text_of(rung%iterations)//','//filled(rung%seconds, .true.)//',' &
         //filled(rung%elapsed, .true.)//','//filled(rung%predicted, rung%predicted >= 0)
   end function start_of

   pure function filled(x, there) result(text)
      real(wp), intent(in) :: x
      logical, intent(in) :: there
      character(len=:), allocatable :: text
      character(len=32) :: buffer
      text = ''
      if (.not. there) return
      write (buffer, '(es24.16e3)') x
      text = trim(adjustl(buffer))
   end function filled

   !> '12.3 %', '0.012 %'.
   pure function percent(x) result(text)
      real(wp), intent(in) :: x
      character(len=:), allocatable :: text
      character(len=32) :: buffer
      integer :: digits
      digits = 1
      if (x > 0) digits = max(0, min(8, 1 - floor(log10(100*x))))
      if (100*x >= 1.0e5_wp) then
         write (buffer, '(es9.1)') 100*x
      else
         write (buffer, '(f0.'//text_of(digits)//')') 100*x
      end if
      if (buffer(1:1) == '.') buffer = '0'//buffer
      if (index(buffer, '.') > 0 .and. index(buffer, 'E') == 0) then
         do while (verify(buffer(len_trim(buffer):len_trim(buffer)), '0') == 0)
            buffer(len_trim(buffer):) = ' '
         end do
         if (buffer(len_trim(buffer):) == '.') buffer(len_trim(buffer):) = ' '
      end if
      text = trim(adjustl(buffer))//' %'
   end function percent

   pure function error_text(x) result(text)
      real(wp), intent(in) :: x
      character(len=15) :: text
      text = '?'
      if (x >= 0) text = percent(x)
      text = adjustr(text)
   end function error_text

   pure function column(x) result(text)
      real(wp), intent(in) :: x
      character(len=11) :: text
      text = '-'
      if (x >= 0) write (text, '(f11.2)') x
      text = adjustr(text)
   end function column

   !> '0.02 s', '75 s', '1.3 h'.
   pure function text_of_seconds(x) result(text)
      real(wp), intent(in) :: x
      character(len=:), allocatable :: text
      character(len=32) :: buffer
      if (x < 10) then
         write (buffer, '(f6.2,a)') x, ' s'
      else if (x < 3600) then
         write (buffer, '(i0,a)') nint(x), ' s'
      else
         write (buffer, '(f12.1,a)') x/3600, ' h'
      end if
      text = trim(adjustl(buffer))
   end function text_of_seconds
end module finshell_study_report
