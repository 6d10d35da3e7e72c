!> The command line.
module finshell_options
   use finshell_commands, only: commands, exit_incomplete, exit_input, exit_interrupted, exit_ok, find_command, find_option, &
      list_of_commands, of_table => options, takes_option
   use finshell_error, only: text_of
   use finshell_field, only: name_t
   use finshell_kinds, only: wp
   use finshell_setting, only: new_setting, setting_t
   use finshell_team, only: team_t
   use finshell_text, only: nearest_name
   implicit none
   private
   public :: options_t, read_command_line
   public :: exit_ok, exit_incomplete, exit_input, exit_interrupted

   integer, parameter :: most_levels = 10, most_jobs = 1024

   type :: options_t
      character(len=:), allocatable :: command, input
      type(name_t), allocatable :: words(:) !< all that stands behind the command: inputs, columns
      character(len=:), allocatable :: results !< restart, info, history: of a run
      integer :: from = -1 !< restart: after this increment; negative: the last one
      character(len=:), allocatable :: folder !< prefix of all output files
      logical :: quiet = .false.
      logical :: verbose = .false. !< run, restart: a log of iterations
      logical :: factor = .false. !< with check: order the equations
      character(len=:), allocatable :: formats !< mesh: of the files, between commas
      integer :: refine = 0 !< levels of refinement beyond what the input says
      type(setting_t), allocatable :: settings(:) !< other values in the input
      integer :: jobs = 0 !< runs side by side; 0: as many as there are processors
      logical :: child = .false. !< run: this program has started itself, and ends with what did so
      character(len=:), allocatable :: rung !< of a study, with the name of its files; unallocated: an ordinary run
      real(wp) :: accuracy = 0.01_wp !< study: relative error that is wanted
      logical :: accuracy_given = .false.
      real(wp) :: budget = 600 !< study: seconds that it may take
      integer :: levels = 0 !< study: number of meshes; 0: as many as are sensible
      logical :: plot = .false. !< history
      class(team_t), pointer :: team => null() !< processes that share the work; the first one speaks
   end type options_t

contains

   !> Options of the arguments; a complaint where they make no sense.
   subroutine read_command_line(options, complaint)
      type(options_t), intent(out) :: options
      character(len=:), allocatable, intent(out) :: complaint
      character(len=:), allocatable :: value, word
      logical, allocatable :: given(:)
      integer :: at, equals, i

      options%command = ''
      options%folder = ''
      options%formats = 'msh'
      allocate (options%words(0), options%settings(0))
      allocate (given(size(of_table)), source=.false.)
      i = 0
      do while (i < command_argument_count())
         i = i + 1
         word = argument(i)
         if (any(word == [character(len=9) :: 'help', '--help', '-h', 'version', '--version', '-V'])) then
            options%command = 'help'
            if (scan(word, 'vV') > 0) options%command = 'version'
            return
         end if
         if (index(word, '-') /= 1) then
            call take_word(options, word, complaint)
            if (allocated(complaint)) return
            cycle
         end if
         equals = index(word, '=')
         value = ''
         if (index(word, '--') == 1 .and. equals > 0) then
            value = word(equals + 1:)
            word = word(:equals - 1)
         end if
         at = find_option(word)
         if (at == 0) then
            complaint = "unknown option '"//word//"'"//meant(word, nearest_name(word, names_of_options()))
            return
         end if
         given(at) = .true.
         if (of_table(at)%value /= '' .and. equals == 0) then
            i = i + 1
            value = argument(i)
         else if (of_table(at)%value == '' .and. equals > 0) then
            complaint = word//' takes no value'
            return
         end if
         call take_option(options, trim(of_table(at)%long), word, value, complaint)
         if (allocated(complaint)) return
      end do
      if (options%command == '') then
         complaint = 'a command is expected: '//list_of_commands('or')
         return
      end if
      do at = 1, size(of_table)
         if (.not. given(at) .or. takes_option(options%command, of_table(at))) cycle
         complaint = trim(of_table(at)%long)//' belongs to the command'//trim(merge('s', ' ', &
            index(trim(adjustl(of_table(at)%commands)), ' ') > 0))//' '//list_of_commands('and', of_table(at))
         return
      end do
      call check_words(options, complaint)
   end subroutine read_command_line

   !> The command, or what stands behind it.
   subroutine take_word(options, word, complaint)
      type(options_t), intent(inout) :: options
      character(len=*), intent(in) :: word
      character(len=:), allocatable, intent(inout) :: complaint
      if (options%command == '') then
         options%command = word
         if (find_command(word) == 0) complaint = "unknown command '"//word//"'; expected "//list_of_commands('or')
      else
         options%words = [options%words, name_t(word)]
      end if
   end subroutine take_word

   subroutine take_option(options, name, word, value, complaint)
      type(options_t), intent(inout) :: options
      character(len=*), intent(in) :: name !< in the table
      character(len=*), intent(in) :: word !< as it was written
      character(len=*), intent(in) :: value
      character(len=:), allocatable, intent(inout) :: complaint
      type(setting_t) :: setting
      select case (name)
      case ('--quiet'); options%quiet = .true.
      case ('--verbose'); options%verbose = .true.
      case ('--factor'); options%factor = .true.
      case ('--plot'); options%plot = .true.
      case ('--child'); options%child = .true.
      case ('--output-folder')
         if (value == '') complaint = word//' needs the name of a folder'
         options%folder = value//'/'
      case ('--rung')
         if (value == '') complaint = word//' needs a name'
         options%rung = value
      case ('--set')
         call new_setting(setting, value, complaint)
         options%settings = [options%settings, setting]
      case ('--format'); call take_formats(word, value, options%formats, complaint)
      case ('--refine'); call take_integer(word, value, -most_levels, options%refine, complaint)
      case ('--jobs'); call take_integer(word, value, 1, options%jobs, complaint, most_jobs)
      case ('--from'); call take_integer(word, value, 0, options%from, complaint, huge(0))
      case ('--levels'); call take_integer(word, value, 1, options%levels, complaint)
      case ('--accuracy')
         options%accuracy_given = .true.
         call take_positive(word, value, 'a number above 0, as 1% or 0.01', options%accuracy, complaint)
      case ('--budget'); call take_positive(word, value, 'a number of seconds above 0', options%budget, complaint)
      end select
   end subroutine take_option

   !> What stands behind the command: is it what the command takes?
   subroutine check_words(options, complaint)
      type(options_t), intent(inout) :: options
      character(len=:), allocatable, intent(inout) :: complaint
      integer :: n
      n = size(options%words)
      associate (command => options%command, words => options%words)
         select case (command)
         case ('restart', 'info', 'history')
            if (n == 0) complaint = 'the command '//command//' needs the results of a run'
            if (n > 0) options%results = words(1)%text
            if (n > 2 .and. command == 'restart') complaint = "one input file is expected, found '"//words(2)%text//"' and '" &
               //words(3)%text//"'"
            if (n > 1 .and. command == 'restart') options%input = words(2)%text
            if (n > 1 .and. command == 'info') complaint = "one name is expected, found '"//words(1)%text//"' and '" &
               //words(2)%text//"'"
            if (n > 0 .and. n /= 3 .and. options%plot) complaint = '--plot needs two columns: one along, one upwards; found ' &
               //text_of(n - 1)
         case ('check-law')
            if (n == 0) complaint = 'the command check-law needs the name of a law: of the program, or LIBRARY#LAW'
            if (n > 0) options%input = words(1)%text
         case ('completion')
            if (n /= 1) complaint = 'the command completion needs the name of a shell: bash, zsh or fish'
            if (n == 1) options%input = words(1)%text
         case ('man')
            if (n > 0) complaint = "the command man takes nothing, found '"//words(1)%text//"'"
         case default
            if (n == 0) complaint = 'the command '//command//' needs an input file'
            if (n > 0) options%input = words(1)%text
            if (n > 1 .and. command /= 'run') complaint = "one input file is expected, found '"//words(1)%text//"' and '" &
               //words(2)%text//"'"
         end select
      end associate
      do n = 1, size(options%settings)
         if (allocated(complaint)) return
         if (size(options%settings(n)%values) > 1 .and. options%command /= 'run') complaint = '--set '//options%settings(n)%text &
            //': several values, separated by commas, belong to the command run'
      end do
   end subroutine check_words

   pure function names_of_options() result(names)
      character(len=:), allocatable :: names
      integer :: i
      names = trim(of_table(1)%long)
      do i = 2, size(of_table)
         if (of_table(i)%summary /= '') names = names//', '//trim(of_table(i)%long)
      end do
   end function names_of_options

   !> The like of `suggestion`, for options: nothing where they look like nothing.
   pure function meant(word, name) result(text)
      character(len=*), intent(in) :: word, name
      character(len=:), allocatable :: text
      text = ''
      if (name /= '' .and. len(word) > 2) text = ", did you mean '"//name//"'?"
   end function meant

   !> Words of three letters between commas, each one that finshell mesh knows.
   subroutine take_formats(option, value, formats, complaint)
      character(len=*), intent(in) :: option, value
      character(len=:), allocatable, intent(inout) :: formats, complaint
      character(len=len(value) + 1) :: words
      integer :: i
      logical :: ok
      formats = value
      words = value//','
      ok = value /= '' .and. mod(len(words), 4) == 0
      do i = 1, merge(len(words), 0, ok), 4
         ok = ok .and. any(words(i:i + 3) == ['msh,', 'vtu,', 'inp,'])
      end do
      if (.not. ok) complaint = option//" needs msh, vtu or inp, or several of them with commas between, found '"//value//"'"
   end subroutine take_formats

   subroutine take_integer(option, word, least, value, complaint, most)
      character(len=*), intent(in) :: option, word
      integer, intent(in) :: least
      integer, intent(inout) :: value
      character(len=:), allocatable, intent(inout) :: complaint
      integer, intent(in), optional :: most !< default: most_levels
      character(len=80) :: expected
      integer :: bound, status
      status = 1
      bound = most_levels
      if (present(most)) bound = most
      if (word /= '' .and. verify(word, '+-0123456789') == 0) read (word, *, iostat=status) value
      if (status == 0 .and. value >= least .and. value <= bound) return
      write (expected, '(i0,a,i0)') least, ' to ', bound
      if (bound == huge(bound)) write (expected, '(a,i0)') 'at least ', least
      complaint = option//' needs a whole number, '//trim(expected)//", found '"//word//"'"
   end subroutine take_integer

   !> A positive number, in per cent if it says so.
   subroutine take_positive(option, word, expected, value, complaint)
      character(len=*), intent(in) :: option, word, expected
      real(wp), intent(inout) :: value
      character(len=:), allocatable, intent(inout) :: complaint
      integer :: last, status
      real(wp) :: unit
      last = len_trim(word)
      unit = 1
      if (last > 1 .and. index(expected, '%') > 0) then
         if (word(last:last) == '%') then
            unit = 0.01_wp
            last = last - 1
         end if
      end if
      status = 1
      if (last > 0) then
         if (verify(word(:last), '+-.0123456789eEdD') == 0) read (word(:last), *, iostat=status) value
      end if
      value = unit*value
      if (status == 0 .and. value > 0 .and. value <= huge(value)) return
      complaint = option//' needs '//expected//", found '"//word//"'"
   end subroutine take_positive

   function argument(i) result(text)
      integer, intent(in) :: i
      character(len=:), allocatable :: text
      integer :: length
      call get_command_argument(i, length=length)
      allocate (character(len=length) :: text)
      call get_command_argument(i, text)
   end function argument
end module finshell_options
