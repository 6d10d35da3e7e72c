!> Help, manual page and completions, all made of the table of commands.
module finshell_help
   use, intrinsic :: iso_fortran_env, only: output_unit
   use finshell_commands, only: commands, exit_codes, option_t, options, takes_option
   use finshell_error, only: text_of
   use finshell_version, only: version
   implicit none
   private
   public :: print_help, print_manual, print_completion

   character(len=*), parameter :: pages(*) = [character(len=110) :: &
      'OMP_NUM_THREADS, or threads in the group &job, sets the number of threads.', &
      'Ctrl-C once: the run stops after its increment, with everything saved. Twice: at once. SIGTERM likewise.', &
      'The input is described in doc/namelist.md, this program in doc/command_line.md, studies in doc/study.md.']

contains

   subroutine print_help()
      integer, parameter :: column = 30
      integer :: i
      write (output_unit, '(a)') 'finshell '//version//': finite-strain corotational triangular shell', ''
      do i = 1, size(commands)
         call entry('finshell '//trim(commands(i)%name)//' '//commands(i)%arguments, trim(commands(i)%summary))
      end do
      write (output_unit, '(a)') '', 'Options'
      do i = 1, size(options)
         if (options(i)%summary /= '') call entry(names_of(options(i)), belongs_to(options(i))//trim(options(i)%summary))
      end do
      write (output_unit, '(a)') '', 'Exit codes'
      do i = 1, size(exit_codes)
         call entry(text_of(exit_codes(i)%code), trim(exit_codes(i)%summary))
      end do
      write (output_unit, '(a)') ''
      do i = 1, size(pages)
         write (output_unit, '(a)') trim(pages(i))
      end do

   contains

      !> A name and, beside or below it, what it is.
      subroutine entry(name, summary)
         character(len=*), intent(in) :: name, summary
         character(len=column) :: left
         left = '  '//name
         if (len_trim(name) + 4 > column) then
            write (output_unit, '(a)') '  '//trim(name)
            left = ''
         end if
         write (output_unit, '(a)') left//summary
      end subroutine entry
   end subroutine print_help

   !> '-o, --output-folder DIR'
   pure function names_of(option) result(text)
      type(option_t), intent(in) :: option
      character(len=:), allocatable :: text
      text = trim(option%long)
      if (option%short /= '') text = trim(option%short)//', '//text
      if (option%value /= '') text = text//' '//trim(option%value)
   end function names_of

   !> 'run, check: '; nothing for what stands alone or goes with all that compute.
   pure function belongs_to(option) result(text)
      type(option_t), intent(in) :: option
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      if (option%commands == '' .or. index(option%commands, 'restart') > 0 .and. index(option%commands, 'run') > 0) return
      do i = 1, size(commands)
         if (.not. takes_option(commands(i)%name, option)) cycle
         if (text /= '') text = text//', '
         text = text//trim(commands(i)%name)
      end do
      text = text//': '
   end function belongs_to

   !> The manual page, for man.
   subroutine print_manual()
      integer :: i, k
      write (output_unit, '(a)') '.TH FINSHELL 1 "" "finshell '//version//'" "User Commands"', '.SH NAME', &
         'finshell \- finite\-strain corotational triangular shell: thin shells of rubber and tissue', '.SH SYNOPSIS'
      do i = 1, size(commands)
         write (output_unit, '(a)') '.B finshell '//trim(commands(i)%name)
         if (commands(i)%arguments /= '') write (output_unit, '(a)') '.I '//escaped(trim(commands(i)%arguments))
         if (any([(takes_option(commands(i)%name, options(k)), k=1, size(options))])) write (output_unit, '(a)') '.RI [ OPTIONS ]'
         if (i < size(commands)) write (output_unit, '(a)') '.br'
      end do
      write (output_unit, '(a)') '.SH COMMANDS'
      do i = 1, size(commands)
         write (output_unit, '(a)') '.TP', '.B '//trim(commands(i)%name)//' '//escaped(trim(commands(i)%arguments)), &
            escaped(trim(commands(i)%summary))
      end do
      write (output_unit, '(a)') '.SH OPTIONS'
      do i = 1, size(options)
         if (options(i)%summary /= '') write (output_unit, '(a)') '.TP', '.B '//escaped(names_of(options(i))), &
            escaped(belongs_to(options(i))//trim(options(i)%summary))
      end do
      write (output_unit, '(a)') '.SH EXIT STATUS'
      do i = 1, size(exit_codes)
         write (output_unit, '(a)') '.TP', '.B '//text_of(exit_codes(i)%code), escaped(trim(exit_codes(i)%summary))
      end do
      write (output_unit, '(a)') '.SH NOTES'
      do i = 1, size(pages)
         write (output_unit, '(a)') escaped(trim(pages(i))), '.br'
      end do
      write (output_unit, '(a)') '.SH FILES', '.TP', '.I NAME.history.csv', 'a row for each converged increment', '.TP', &
         '.I NAME.vtkhdf, NAME.xdmf', 'the fields, for ParaView and others', '.TP', '.I NAME.restart', &
         'what a run needs to go on'
   end subroutine print_manual

   !> Text for troff: hyphens are minus signs, nothing is a command.
   pure function escaped(text) result(safe)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: safe
      integer :: i
      safe = ''
      do i = 1, len(text)
         select case (text(i:i))
         case ('-'); safe = safe//'\-'
         case ('\'); safe = safe//'\e'
         case ("'"); safe = safe//'\(aq'
         case default; safe = safe//text(i:i)
         end select
      end do
      if (safe /= '') then
         if (safe(1:1) == '.') safe = '\&'//safe
      end if
   end function escaped

   !> What a shell reads to complete command lines. False: it is none that is known.
   logical function print_completion(shell) result(known)
      character(len=*), intent(in) :: shell
      known = .true.
      select case (shell)
      case ('bash'); call print_bash()
      case ('zsh'); call print_zsh()
      case ('fish'); call print_fish()
      case default; known = .false.
      end select
   end function print_completion

   !> Names of all commands, or options of one.
   pure function words(command) result(list)
      character(len=*), intent(in) :: command !< '': all commands
      character(len=:), allocatable :: list
      integer :: i
      list = ''
      do i = 1, merge(size(commands), 0, command == '')
         list = list//' '//trim(commands(i)%name)
      end do
      do i = 1, size(options)
         if (options(i)%summary == '') cycle
         if (options(i)%commands == '' .and. command /= '') cycle
         if (options(i)%commands /= '' .and. .not. takes_option(command, options(i))) cycle
         list = list//' '//trim(options(i)%long)
         if (options(i)%short /= '') list = list//' '//options(i)%short
      end do
      list = list(2:)
   end function words

   !> Endings of the files that a command takes, separated by |.
   pure function endings_of(endings) result(text)
      character(len=*), intent(in) :: endings
      character(len=:), allocatable :: text
      text = trim(endings)
      if (endings == 'results') text = 'vtkhdf|restart|history.csv|nml'
   end function endings_of

   subroutine print_bash()
      integer :: i
      write (output_unit, '(a)') '# bash completion of finshell: finshell completion bash', &
         '_finshell()', '{', '   local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} words= endings= file', &
         '   COMPREPLY=()', '   case $before in', '   -o | --output-folder)', &
         '      mapfile -t COMPREPLY < <(compgen -d -- "$word")', '      return', '      ;;', '   esac', &
         '   case ${COMP_WORDS[1]} in'
      do i = 1, size(commands)
         if (commands(i)%name == 'completion') then
            write (output_unit, '(a)') '   completion) words="bash zsh fish" ;;'
         else
            write (output_unit, '(a)') '   '//trim(commands(i)%name)//') words="'//words_or_nothing(trim(commands(i)%name)) &
               //'" endings="'//endings_of(commands(i)%endings)//'" ;;'
         end if
      end do
      write (output_unit, '(a)') '   esac', '   if [ "$COMP_CWORD" -eq 1 ]; then words="'//words('')//'" endings=; fi', &
         '   mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")', '   [ -n "$endings" ] || return', &
         '   while IFS= read -r file; do', '      if [ -d "$file" ]; then COMPREPLY+=("$file/")', &
         '      elif [[ $file =~ \.($endings)$ ]]; then COMPREPLY+=("$file"); fi', '   done < <(compgen -f -- "$word")', '}', &
         'complete -o filenames -F _finshell finshell'
   end subroutine print_bash

   pure function words_or_nothing(command) result(list)
      character(len=*), intent(in) :: command
      character(len=:), allocatable :: list
      integer :: i
      list = ''
      if (any([(takes_option(command, options(i)), i=1, size(options))])) list = words(command)
   end function words_or_nothing

   subroutine print_zsh()
      integer :: i, k
      write (output_unit, '(a)') '#compdef finshell', '# zsh completion of finshell: finshell completion zsh', '_finshell()', '{', &
         '   local -a commands', '   commands=('
      do i = 1, size(commands)
         write (output_unit, '(a)') "      '"//trim(commands(i)%name)//':'//single(trim(commands(i)%summary))//"'"
      end do
      write (output_unit, '(a)') '   )', '   if (( CURRENT == 2 )); then', '      _describe command commands', '      return', &
         '   fi', '   case $words[2] in'
      do i = 1, size(commands)
         write (output_unit, '(a)') '   '//trim(commands(i)%name)//')', '      _arguments \'
         do k = 1, size(options)
            if (options(k)%summary == '' .or. .not. takes_option(commands(i)%name, options(k))) cycle
            call option(trim(options(k)%long), options(k))
            if (options(k)%short /= '') call option(options(k)%short, options(k))
         end do
         if (commands(i)%name == 'completion') then
            write (output_unit, '(a)') "         '2:shell:(bash zsh fish)'"
         else if (commands(i)%endings == '') then
            write (output_unit, '(a)') "         '2: :'"
         else
            write (output_unit, '(a)') "         '*:file:_files -g ""*.("//endings_of(commands(i)%endings)//")""'"
         end if
         write (output_unit, '(a)') '      ;;'
      end do
      write (output_unit, '(a)') '   esac', '}', &
         'if [ "$funcstack[1]" = _finshell ]; then _finshell "$@"; else compdef _finshell finshell; fi'

   contains

      subroutine option(name, of)
         character(len=*), intent(in) :: name
         type(option_t), intent(in) :: of
         character(len=:), allocatable :: value
         value = ''
         if (of%value /= '') value = ':'//single(trim(of%value))//':'
         if (of%value == 'DIR') value = ':folder:_files -/'
         write (output_unit, '(a)') "         '"//trim(merge('*', ' ', of%long == '--set'))//name//'['//single(trim(of%summary)) &
            //']'//value//"' \"
      end subroutine option
   end subroutine print_zsh

   subroutine print_fish()
      integer :: i, k
      character(len=:), allocatable :: line
      write (output_unit, '(a)') '# fish completion of finshell: finshell completion fish', 'complete -c finshell -f'
      do i = 1, size(commands)
         write (output_unit, '(a)') 'complete -c finshell -n __fish_use_subcommand -a '//trim(commands(i)%name)//" -d '" &
            //single(trim(commands(i)%summary))//"'"
      end do
      do k = 1, size(options)
         if (options(k)%summary == '') cycle
         line = 'complete -c finshell -l '//trim(options(k)%long(3:))
         if (options(k)%short /= '') line = line//' -s '//options(k)%short(2:2)
         if (options(k)%commands /= '') line = line//" -n '__fish_seen_subcommand_from "//trim(adjustl(options(k)%commands))//"'"
         if (options(k)%value == 'DIR') line = line//" -x -a '(__fish_complete_directories)'"
         if (options(k)%value /= '' .and. options(k)%value /= 'DIR') line = line//' -x'
         write (output_unit, '(a)') line//" -d '"//single(trim(options(k)%summary))//"'"
      end do
      do i = 1, size(commands)
         if (commands(i)%endings == '') cycle
         write (output_unit, '(a)') "complete -c finshell -n '__fish_seen_subcommand_from "//trim(commands(i)%name) &
            //"' -F -d file"
      end do
      write (output_unit, '(a)') "complete -c finshell -n '__fish_seen_subcommand_from completion' -a 'bash zsh fish'"
   end subroutine print_fish

   !> Inside single quotes and brackets of a shell.
   pure function single(text) result(safe)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: safe
      integer :: i
      safe = ''
      do i = 1, len(text)
         select case (text(i:i))
         case ("'"); safe = safe//'"' ! the only character that has no place there
         case (':', '[', ']'); safe = safe//' '
         case default; safe = safe//text(i:i)
         end select
      end do
   end function single
end module finshell_help
