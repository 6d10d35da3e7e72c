!> What became of several runs: a table on the screen, and one of a sweep as a file.
module finshell_runs_table
   use, intrinsic :: iso_fortran_env, only: output_unit
   use finshell_commands, only: exit_incomplete, exit_input, exit_interrupted, exit_ok
   use finshell_error, only: error_t, raise, text_of
   use finshell_history_table, only: find_column, history_table_t, number_at, own_columns
   use finshell_kinds, only: wp
   use finshell_setting, only: setting_t
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: run_t, print_runs, write_sweep

   type :: run_t
      integer :: input = 1 !< number of the input on the command line
      character(len=:), allocatable :: file !< the input
      character(len=:), allocatable :: base, name !< of the job of the input; of the files of this run
      integer, allocatable :: choice(:) !< of the values of each setting
      integer :: code = -1 !< exit code; negative: it was not started
      real(wp) :: seconds = 0 !< elapsed
      type(history_table_t) :: table !< its history; names unallocated: there is none
      character(len=:), allocatable :: words !< why it did not come to its end
   contains
      procedure :: outcome
      procedure :: increments
      procedure :: iterations
      procedure :: load_factor
   end type run_t

contains

   pure function outcome(self) result(text)
      class(run_t), intent(in) :: self
      character(len=:), allocatable :: text
      select case (self%code)
      case (:-1); text = 'not started'
      case (exit_ok); text = 'done'
      case (exit_incomplete); text = 'stopped early'
      case (exit_input); text = 'wrong input'
      case (exit_interrupted); text = 'interrupted'
      case default; text = 'ended by signal '//text_of(self%code - 128)
      end select
   end function outcome

   pure integer function increments(self)
      class(run_t), intent(in) :: self
      increments = 0
      if (allocated(self%table%words)) increments = size(self%table%words, 2)
   end function increments

   integer function iterations(self)
      class(run_t), intent(in) :: self
      integer :: i, k
      iterations = 0
      if (self%increments() == 0) return
      k = find_column(self%table, 'iterations')
      do i = 1, merge(self%increments(), 0, k > 0)
         iterations = iterations + nint(number_at(self%table, k, i))
      end do
   end function iterations

   !> The last one, as text; '' where there is none.
   function load_factor(self) result(text)
      class(run_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = ''
      if (self%increments() > 0) text = self%table%words(2, self%increments())%text
   end function load_factor

   !> Name, outcome, last load factor, increments, iterations, seconds; then why runs did not come to their end.
   subroutine print_runs(runs)
      type(run_t), intent(in) :: runs(:)
      character(len=:), allocatable :: heading, line
      character(len=12) :: factor
      integer :: i, width
      width = 4
      do i = 1, size(runs)
         width = max(width, len(runs(i)%name))
      end do
      heading = repeat(' ', width)
      heading(:4) = 'name'
      write (output_unit, '(a)') heading//'  outcome             load factor  increments  iterations   seconds'
      do i = 1, size(runs)
         line = repeat(' ', width + len('  ended by signal 99'))
         line(:len(runs(i)%name)) = runs(i)%name
         line(width + 3:) = runs(i)%outcome()
         factor = ''
         if (runs(i)%load_factor() /= '') then
            write (factor, '(g12.5)') number_at(runs(i)%table, 2, runs(i)%increments())
         end if
         write (output_unit, '(2a,2i12,f10.2)') line, adjustr('   '//factor), runs(i)%increments(), runs(i)%iterations(), &
            runs(i)%seconds
      end do
      do i = 1, size(runs)
         if (.not. allocated(runs(i)%words)) cycle
         if (runs(i)%words /= '') write (output_unit, '(a)') runs(i)%name//': '//runs(i)%words
      end do
   end subroutine print_runs

   !> A row for each run: its name, the values that were set, how it ended, and the last value of every monitor. Error: the file
   !> cannot be written.
   subroutine write_sweep(file, runs, settings, error)
      character(len=*), intent(in) :: file
      type(run_t), intent(in) :: runs(:) !< of one input
      type(setting_t), intent(in) :: settings(:)
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: line
      character(len=256) :: reason
      integer :: i, k, s, status, unit, with_history

      with_history = 0
      do i = size(runs), 1, -1
         if (runs(i)%increments() > 0) with_history = i
      end do
      line = 'run'
      do s = 1, size(settings)
         if (size(settings(s)%values) > 1) line = line//','//quoted(settings(s)%text(:index(settings(s)%text, '=') - 1))
      end do
      line = line//',outcome,increments,iterations,seconds,load_factor'
      if (with_history > 0) then
         associate (names => runs(with_history)%table%names)
            do k = 1, size(names)
               if (index(own_columns, ','//names(k)%text//',') == 0) line = line//','//quoted(names(k)%text)
            end do
         end associate
      end if
      open (newunit=unit, file=file, status='replace', action='write', iostat=status, iomsg=reason)
      if (status == 0) write (unit, '(a)', iostat=status, iomsg=reason) line
      do i = 1, size(runs)
         if (status /= 0) exit
         line = runs(i)%name
         do s = 1, size(settings)
            if (size(settings(s)%values) > 1) line = line//','//quoted(settings(s)%values(runs(i)%choice(s))%text)
         end do
         line = line//','//runs(i)%outcome()//','//text_of(runs(i)%increments())//','//text_of(runs(i)%iterations())//',' &
            //text_of(runs(i)%seconds)//','//runs(i)%load_factor()
         if (with_history > 0) then
            associate (names => runs(with_history)%table%names)
               do k = 1, size(names)
                  if (index(own_columns, ','//names(k)%text//',') == 0) line = line//','//last_value(runs(i), names(k)%text)
               end do
            end associate
         end if
         write (unit, '(a)', iostat=status, iomsg=reason) line
      end do
      if (status == 0) close (unit, iostat=status, iomsg=reason)
      if (status /= 0) call raise(error, status_io_error, file//': cannot be written: '//trim(reason))
   end subroutine write_sweep

   !> The last value of a column; '' where there is none.
   pure function last_value(run, name) result(text)
      type(run_t), intent(in) :: run
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: text
      integer :: k
      text = ''
      if (run%increments() == 0) return
      k = find_column(run%table, name)
      if (k > 0) text = run%table%words(k, run%increments())%text
   end function last_value

   !> Strings of a namelist lose their quotes, values with a comma get those of CSV.
   pure function quoted(word) result(text)
      character(len=*), intent(in) :: word
      character(len=:), allocatable :: text
      integer :: i
      text = word
      if (index(word, ',') == 0 .and. len(word) > 1) then
         if (word(1:1) == "'" .and. word(len(word):) == "'") text = word(2:len(word) - 1)
      end if
      if (scan(text, ',"') == 0) return
      i = 1
      do while (i <= len(text))
         if (text(i:i) == '"') then
            text = text(:i)//text(i:)
            i = i + 1
         end if
         i = i + 1
      end do
      text = '"'//text//'"'
   end function quoted
end module finshell_runs_table
