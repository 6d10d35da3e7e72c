!> The command info: what run some results are of, what is in them, and how it ended.
module finshell_info
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use finshell_disk, only: lock_t, take_lock
   use finshell_error, only: error_t, raise, text_of
   use finshell_history_table, only: find_column, history_table_t, number_at, own_columns, read_history
   use finshell_kinds, only: wp
   use finshell_namelist_parser, only: namelist_t, parse_namelist
   use finshell_options, only: exit_input, exit_ok, options_t
   use finshell_restart_file, only: read_restart, restart_head_t
   use finshell_results_summary, only: read_summary, results_summary_t
   use finshell_resume, only: base_of
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: show_info

contains

   !> Print what the files of a run say, those that are there.
   subroutine show_info(options, code)
      type(options_t), intent(in) :: options
      integer, intent(out) :: code
      character(len=:), allocatable :: base
      type(error_t), allocatable :: error
      type(history_table_t) :: table
      type(restart_head_t) :: head
      type(results_summary_t) :: summary
      integer, allocatable :: increments(:)
      logical :: has_history, has_restart, has_results

      code = exit_input
      base = base_of(options%results)
      inquire (file=base//'.history.csv', exist=has_history)
      inquire (file=base//'.vtkhdf', exist=has_results)
      inquire (file=base//'.restart', exist=has_restart)
      if (.not. (has_history .or. has_results .or. has_restart)) call raise(error, status_io_error, base &
         //': there are no results of this name: no .history.csv, no .vtkhdf, no .restart')
      if (has_results) call read_summary(base//'.vtkhdf', summary, error)
      if (has_restart .and. .not. allocated(error)) call read_restart(base//'.restart', head, increments, error)
      if (has_history .and. .not. allocated(error)) call read_history(base//'.history.csv', table, error)
      if (allocated(error)) then
         write (error_unit, '(a)') 'finshell: '//error%message
         return
      end if
      code = exit_ok
      if (has_restart) write (output_unit, '(a)') 'Input: '//head%input_file
      if (has_restart) then
         call print_input(head%input_text)
      else if (has_results) then
         call print_input(summary%input)
      end if
      if (has_results) call print_results(summary)
      if (has_history) call print_history(table)
      if (has_restart) write (output_unit, '(a)') 'Can go on from increment ' &
         //trim(merge('one of ', '       ', size(increments) > 1))//trim(range_of(increments))//': finshell restart '//base
      write (output_unit, '(a)') how_it_ended(base, has_results, summary)
   end subroutine show_info

   !> Title and steps of an input, and what was set on the command line.
   subroutine print_input(text)
      character(len=*), intent(in) :: text
      type(namelist_t) :: namelist
      type(error_t), allocatable :: error
      character(len=:), allocatable :: step
      integer :: at, first, i, k, steps
      call parse_namelist(text, 'input', namelist, error)
      if (allocated(error)) return
      steps = 0
      do i = 1, size(namelist%groups)
         associate (group => namelist%groups(i))
            if (all(group%name /= [character(len=4) :: 'job', 'step'])) cycle
            step = ''
            do k = 1, size(group%entries)
               associate (entry => group%entries(k))
                  if (group%name == 'job' .and. entry%key == 'title') write (output_unit, '(a)') 'Title: '//entry%values(1)%text
                  if (any(entry%key == [character(len=11) :: 'control', 'name', 'load_factor', 'duration'])) &
                     step = step//' '//entry%key//' = '//entry%values(1)%text
               end associate
            end do
            if (group%name /= 'step') cycle
            steps = steps + 1
            if (step == '') step = ' control = load'
            write (output_unit, '(a)') 'Step '//text_of(steps)//':'//step
         end associate
      end do
      at = 1
      do
         first = index(text(at:), new_line('a')//'! --set ')
         if (first == 0) exit
         at = at + first
         first = index(text(at:)//new_line('a'), new_line('a'))
         write (output_unit, '(a)') 'Set on the command line: '//text(at + len('! --set '):at + first - 2)
      end do
   end subroutine print_input

   subroutine print_results(summary)
      type(results_summary_t), intent(in) :: summary
      write (output_unit, '(a)') 'Written by finshell '//summary%version//': '//text_of(summary%nodes)//' nodes, ' &
         //text_of(summary%elements)//' elements, fields of '//text_of(summary%steps)//' states', &
         'On nodes: '//summary%on_nodes, 'On elements: '//summary%on_elements
   end subroutine print_results

   !> How far it came.
   subroutine print_history(table)
      type(history_table_t), intent(in) :: table
      integer :: i, k, rows
      real(wp) :: iterations
      rows = size(table%words, 2)
      if (rows == 0) write (output_unit, '(a)') 'No increment has converged.'
      if (rows == 0) return
      k = find_column(table, 'iterations')
      iterations = 0
      if (k > 0) iterations = sum([(number_at(table, k, i), i=1, rows)])
      write (output_unit, '(a)') text_of(rows)//' increments, '//text_of(nint(iterations))//' iterations, load factor ' &
         //text_of(number_at(table, 2, rows))
      do k = 1, size(table%names)
         if (index(own_columns, ','//table%names(k)%text//',') == 0) write (output_unit, '(a)') '  '//table%names(k)%text//' = ' &
            //table%words(k, rows)%text
      end do
   end subroutine print_history

   function range_of(increments) result(text)
      integer, intent(in) :: increments(:)
      character(len=:), allocatable :: text
      text = ' '//text_of(increments(1))
      if (size(increments) > 1) text = ' '//text_of(size(increments))//', '//text_of(increments(1))//' to ' &
         //text_of(increments(size(increments)))
   end function range_of

   !> What the run said last; or nothing, when it runs or was killed.
   function how_it_ended(base, has_results, summary) result(text)
      character(len=*), intent(in) :: base
      logical, intent(in) :: has_results
      type(results_summary_t), intent(in) :: summary
      character(len=:), allocatable :: text, reason
      type(lock_t) :: lock
      logical :: locked
      inquire (file=base//'.lock', exist=locked)
      if (locked) then
         call take_lock(base//'.lock', lock, reason)
         if (reason /= '') then
            text = 'It runs now.'
            return
         end if
         text = 'It was killed.' ! the lock is let go when this program ends, its file stays for the next who asks
      else if (.not. has_results) then
         text = 'How it ended is not known: it has written no fields.'
      else if (summary%said == '') then
         text = 'How it ended is not known.'
      else
         text = 'It ended so: '//summary%said
      end if
   end function how_it_ended
end module finshell_info
