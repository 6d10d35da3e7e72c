!> The command line.
module finshell_options
   use, intrinsic :: iso_fortran_env, only: output_unit
   use finshell_kinds, only: wp
   use finshell_team, only: team_t
   use finshell_version, only: version
   implicit none
   private
   public :: options_t, read_command_line, print_help
   public :: exit_ok, exit_incomplete, exit_input

   integer, parameter :: exit_ok = 0, exit_incomplete = 1, exit_input = 2
   integer, parameter :: most_levels = 10
   character(len=7), parameter :: commands(*) = [character(len=7) :: 'run', 'check', 'study', 'restart', 'convert', 'mesh']

   type :: options_t
      character(len=:), allocatable :: command, input
      character(len=:), allocatable :: results !< restart: of the run that goes on
      integer :: from = -1 !< restart: after this increment; negative: the last one
      character(len=:), allocatable :: folder !< prefix of all output files
      logical :: quiet = .false.
      logical :: verbose = .false. !< run, restart: a log of iterations
      logical :: factor = .false. !< with check: order the equations
      integer :: refine = 0 !< levels of refinement beyond what the input says
      character(len=:), allocatable :: rung !< of a study, with the name of its files; unallocated: an ordinary run
      real(wp) :: accuracy = 0.01_wp !< study: relative error that is wanted
      logical :: accuracy_given = .false.
      real(wp) :: budget = 600 !< study: seconds that it may take
      integer :: levels = 0 !< study: number of meshes; 0: as many as are sensible
      class(team_t), pointer :: team => null() !< processes that share the work; the first one speaks
   end type options_t

contains

   !> Options of the arguments; a complaint where they make no sense.
   subroutine read_command_line(options, complaint)
      type(options_t), intent(out) :: options
      character(len=:), allocatable, intent(out) :: complaint
      character(len=:), allocatable :: of_study, of_run, of_restart, word
      integer :: i

      options%command = ''
      options%folder = ''
      of_study = ''
      of_run = ''
      of_restart = ''
      i = 0
      do while (i < command_argument_count())
         i = i + 1
         word = argument(i)
         select case (word)
         case ('--help', '-h', 'help')
            options%command = 'help'
            return
         case ('--version', '-V', 'version')
            options%command = 'version'
            return
         case ('--quiet', '-q')
            options%quiet = .true.
         case ('--verbose')
            options%verbose = .true.
         case ('--factor')
            options%factor = .true.
         case ('--output-folder', '-o')
            i = i + 1
            options%folder = argument(i)
            if (options%folder == '') complaint = word//' needs the name of a folder'
            if (allocated(complaint)) return
            options%folder = options%folder//'/'
         case ('--refine')
            i = i + 1
            of_run = word
            call take_integer(word, argument(i), -most_levels, options%refine, complaint)
         case ('--from')
            i = i + 1
            of_restart = word
            call take_integer(word, argument(i), 0, options%from, complaint, huge(0))
         case ('--rung')
            i = i + 1
            of_run = word
            options%rung = argument(i)
            if (options%rung == '') complaint = word//' needs a name'
         case ('--accuracy')
            i = i + 1
            of_study = word
            options%accuracy_given = .true.
            call take_positive(word, argument(i), 'a number above 0, as 1% or 0.01', options%accuracy, complaint)
         case ('--budget')
            i = i + 1
            of_study = word
            call take_positive(word, argument(i), 'a number of seconds above 0', options%budget, complaint)
         case ('--levels')
            i = i + 1
            of_study = word
            call take_integer(word, argument(i), 1, options%levels, complaint)
         case default
            if (options%command == '') then
               options%command = word
               if (all(word /= commands)) complaint = "unknown command '"//word &
                  //"'; expected run, check, study, restart, mesh or convert"
            else if (index(word, '-') == 1) then
               complaint = "unknown option '"//word//"'"
            else if (options%command == 'restart' .and. .not. allocated(options%results)) then
               options%results = word
            else if (.not. allocated(options%input)) then
               options%input = word
            else
               complaint = "one input file is expected, found '"//options%input//"' and '"//word//"'"
            end if
         end select
         if (allocated(complaint)) return
      end do
      if (options%command == '') then
         complaint = 'a command is expected: run, check, study, restart, mesh or convert'
      else if (options%command == 'restart' .and. .not. allocated(options%results)) then
         complaint = 'the command restart needs the results of a run'
      else if (options%command == 'restart') then
         if (of_study//of_run /= '' .or. options%factor) &
            complaint = 'the command restart knows the options --from, --verbose, -o and -q'
      else if (of_restart /= '') then
         complaint = of_restart//' belongs to the command restart'
      else if (.not. allocated(options%input)) then
         complaint = 'the command '//options%command//' needs an input file'
      else if (options%verbose .and. options%command /= 'run') then
         complaint = 'the option --verbose belongs to the commands run and restart'
      else if (options%factor .and. options%command /= 'check') then
         complaint = 'the option --factor belongs to the command check'
      else if (options%command /= 'study' .and. of_study /= '') then
         complaint = of_study//' belongs to the command study'
      else if (options%command == 'study' .and. of_run /= '') then
         complaint = of_run//' belongs to the commands run, check and mesh'
      end if
   end subroutine read_command_line

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

   subroutine print_help()
      write (output_unit, '(a)') &
         'finshell '//version//': finite-strain corotational triangular shell', &
         '', &
         '  finshell run INPUT.nml      solve; writes NAME.history.csv, NAME.vtkhdf and NAME.xdmf', &
         '  finshell check INPUT.nml    read the input, build the model, report its size, solve nothing', &
         '  finshell study INPUT.nml    solve on coarser and finer meshes: errors, costs, and which to take', &
         '  finshell mesh INPUT.nml     size, quality and sets of the mesh, and NAME.msh for Gmsh', &
         '  finshell convert DECK.inp   a deck of Abaqus or CalculiX as DECK.nml; says what it does not take', &
         '  finshell restart RESULTS [INPUT.nml]', &
         '                              go on with a run that ended or was killed, from its last increment', &
         '  finshell --version', &
         '  finshell --help', &
         '', &
         'Options', &
         '  -o, --output-folder DIR     write results there (default: the current folder)', &
         '  -q, --quiet                 no progress lines', &
         '  --verbose                   run, restart: a line for each iteration, also in NAME.iterations.log', &
         '  --factor                    check: order the equations too, and say how large the factor of the matrix is', &
         '  --refine N                  run, check: each triangle into four, N times (doc/namelist.md)', &
         '  --from N                    restart: after increment N (restart = ''every'' in &output keeps them)', &
         '  --accuracy 1%               study: the error that is wanted (default 1 %)', &
         '  --budget SECONDS            study: the time that it may take (default 600)', &
         '  --levels N                  study: the number of meshes (default 4)', &
         '', &
         'OMP_NUM_THREADS, or threads in the group &job, sets the number of threads.', &
         'Exit code: 0 done, 1 stopped before the end (results so far are kept), 2 wrong input.', &
         'The input is described in doc/namelist.md, studies in doc/study.md.'
   end subroutine print_help
end module finshell_options
