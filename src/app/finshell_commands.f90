!> The commands of the program, their options and its exit codes: one table, from which the command line is read and the help, the
!> completions of shells and the manual page are made.
module finshell_commands
   implicit none
   private
   public :: command_t, option_t, exit_code_t, commands, options, exit_codes
   public :: find_command, find_option, takes_option, list_of_commands
   public :: exit_ok, exit_incomplete, exit_input, exit_interrupted

   integer, parameter :: exit_ok = 0, exit_incomplete = 1, exit_input = 2, exit_interrupted = 3

   type :: command_t
      character(len=10) :: name
      character(len=24) :: arguments
      character(len=8) :: endings !< of the files it takes, for completion: 'nml', 'inp'; '' takes none
      character(len=110) :: summary
   end type command_t

   type :: option_t
      character(len=15) :: long
      character(len=2) :: short
      character(len=20) :: value !< what follows it; '': nothing does
      character(len=40) :: commands !< those that take it, ' run check '; '': it stands alone
      character(len=120) :: summary
   end type option_t

   type :: exit_code_t
      integer :: code
      character(len=130) :: summary
   end type exit_code_t

   type(command_t), parameter :: commands(*) = [ &
      command_t('run', 'INPUT.nml ...', 'nml', 'solve; writes NAME.history.csv, NAME.vtkhdf and NAME.xdmf'), &
      command_t('check', 'INPUT.nml', 'nml', &
                'read the input, build the model, report mesh, loads, memory and time; solve nothing'), &
      command_t('study', 'INPUT.nml', 'nml', 'solve on coarser and finer meshes: errors, costs, and which to take'), &
      command_t('mesh', 'INPUT.nml', 'nml', &
                'size, quality and sets of the mesh, and the mesh as NAME.msh for Gmsh, or as --format says'), &
      command_t('check-law', 'LAW [NAME=VALUE ...]', '', &
                'look at a material law, also one of a shared library (LIBRARY#LAW): derivatives, symmetry, limits'), &
      command_t('convert', 'DECK.inp', 'inp', &
                'a deck of Abaqus or CalculiX as DECK.nml; says what it does not take'), &
      command_t('restart', 'RESULTS [INPUT.nml]', 'results', &
                'go on with a run that ended or was killed, from its last increment'), &
      command_t('info', 'RESULTS', 'results', 'what run the results are of, what is in them, how it ended'), &
      command_t('history', 'RESULTS [COLUMN ...]', 'results', 'print columns of the history, or plot them'), &
      command_t('completion', 'SHELL', '', 'print the completion for bash, zsh or fish'), &
      command_t('man', '', '', 'print the manual page (finshell man | man -l -)')]

   type(option_t), parameter :: options(*) = [ &
      option_t('--output-folder', '-o', 'DIR', ' run check study mesh restart ', &
               'write results there (default: the current folder)'), &
      option_t('--quiet', '-q', '', ' run check study mesh restart ', 'no progress lines'), &
      option_t('--verbose', '', '', ' run restart ', 'a line for each iteration, also in NAME.iterations.log'), &
      option_t('--set', '', 'GROUP.KEY=VALUE', ' run check mesh study ', &
               'another value in the input; several for run, separated by commas, are a run each'), &
      option_t('--jobs', '-j', 'N', ' run ', 'runs side by side (default: as many as there are processors)'), &
      option_t('--refine', '', 'N', ' run check mesh ', 'each triangle into four, N times (doc/namelist.md)'), &
      option_t('--format', '', 'msh,vtu,inp', ' mesh ', &
               'write the mesh for Gmsh (msh, default), ParaView (vtu), CalculiX (inp); several with commas'), &
      option_t('--factor', '', '', ' check ', &
               'order the equations too, and say how large the factor of the matrix is'), &
      option_t('--from', '', 'N', ' restart ', &
               'go on after increment N (restart = ''every'' in &output keeps them)'), &
      option_t('--accuracy', '', '1%', ' study ', 'the error that is wanted (default 1 %)'), &
      option_t('--budget', '', 'SECONDS', ' study ', 'the time that it may take (default 600)'), &
      option_t('--levels', '', 'N', ' study ', 'the number of meshes (default 4)'), &
      option_t('--plot', '', '', ' history ', 'the columns as a plot: the first along, the second upwards'), &
      option_t('--help', '-h', '', '', 'print this'), &
      option_t('--version', '-V', '', '', 'print the version'), &
      option_t('--child', '', '', ' run ', ''), & ! of a run among several, of a study: in no help
      option_t('--rung', '', 'NAME', ' run ', '')]

   type(exit_code_t), parameter :: exit_codes(*) = [ &
      exit_code_t(exit_ok, 'done'), &
      exit_code_t(exit_incomplete, 'stopped before the end, and says why; the results so far are kept'), &
      exit_code_t(exit_input, &
                  'a wrong command line or input, or files that cannot be read or written: nothing was solved'), &
      exit_code_t(exit_interrupted, &
                  'interrupted (Ctrl-C, SIGTERM) and stopped after its increment: finshell restart goes on')]

contains

   !> Place of a command in the table; 0: it is none.
   pure integer function find_command(word) result(i)
      character(len=*), intent(in) :: word
      i = findloc(commands%name == word, .true., dim=1)
   end function find_command

   !> Place of an option in the table, by any of its names; 0: it is none.
   pure integer function find_option(word) result(i)
      character(len=*), intent(in) :: word
      i = 0
      if (word /= '') i = findloc(options%long == word .or. options%short == word, .true., dim=1)
   end function find_option

   pure logical function takes_option(command, option)
      character(len=*), intent(in) :: command
      type(option_t), intent(in) :: option
      takes_option = index(option%commands, ' '//trim(command)//' ') > 0
   end function takes_option

   !> 'run, check and mesh': all commands, or those that take an option.
   pure function list_of_commands(last, option) result(text)
      character(len=*), intent(in) :: last !< word before the last one
      type(option_t), intent(in), optional :: option
      character(len=:), allocatable :: text
      integer :: i, left
      logical :: listed(size(commands))
      listed = .true.
      if (present(option)) listed = [(takes_option(commands(i)%name, option), i=1, size(commands))]
      left = count(listed)
      text = ''
      do i = 1, size(commands)
         if (.not. listed(i)) cycle
         text = text//trim(commands(i)%name)
         left = left - 1
         if (left > 1) text = text//', '
         if (left == 1) text = text//' '//last//' '
      end do
   end function list_of_commands
end module finshell_commands
