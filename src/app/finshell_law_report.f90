!> The command check-law: what is found about a material law, a line each.
module finshell_law_report
   use, intrinsic :: ieee_exceptions, only: ieee_set_halting_mode, ieee_usual
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use finshell_error, only: error_t
   use finshell_kinds, only: wp
   use finshell_law_findings, only: check_law, finding_t, n_findings
   use finshell_material, only: material_t
   use finshell_options, only: exit_incomplete, exit_input, exit_ok, options_t
   use finshell_plugin, only: is_plugin, plugin_name
   use finshell_registry, only: material_names, material_parameters, new_material, parameter_t
   implicit none
   private
   public :: report_law

   integer, parameter :: name_length = 32

contains

   !> Check the law that was named, with the values that were given; without any with those of its own example.
   subroutine report_law(options, code)
      type(options_t), intent(in) :: options
      integer, intent(out) :: code
      class(material_t), allocatable :: law
      type(finding_t) :: list(n_findings)
      type(error_t), allocatable :: error
      character(len=name_length), allocatable :: names(:)
      real(wp), allocatable :: values(:)
      character(len=:), allocatable :: name, complaint
      integer :: i

      call ieee_set_halting_mode(ieee_usual, .false.) ! as in the preset debug: numbers that are none are to be found
      code = exit_input
      name = options%input
      if (.not. (is_plugin(name) .or. any(material_names() == name)) .and. scan(name, './#') > 0) then
         ! a name without a folder is looked for in those of the system only
         if (scan(name, '/') == 0) name = './'//name
         name = plugin_name(name, '')
      end if
      call read_pairs(options, names, values, complaint)
      if (.not. allocated(complaint)) then
         if (size(names) == 0) call examples(material_parameters(name), names, values)
         call new_material(law, name, names, values, error)
         if (allocated(error)) complaint = error%message
      end if
      if (allocated(complaint)) then
         write (error_unit, '(a)') 'finshell: '//complaint
         return
      end if
      write (output_unit, '(a)', advance='no') 'Law '//trim(law%name)//' with'
      do i = 1, size(names)
         write (output_unit, '(1x,a,g0.6)', advance='no') trim(names(i))//' = ', values(i)
      end do
      if (size(names) == 0) write (output_unit, '(a)', advance='no') ' no parameters'
      write (output_unit, '(a)') ''
      if (law%states > 0) write (output_unit, '(a,i0,a)') 'It remembers ', law%states, &
         ' numbers at each point; it is looked at in a step of no time from zeros.'
      call check_law(law, list)
      do i = 1, n_findings
         write (output_unit, '(2x,a,2x,a14,es10.1,a,es8.1,3x,a)') merge('ok  ', 'FAIL', list(i)%passed), list(i)%name, &
            list(i)%found, ' of', list(i)%allowed, trim(list(i)%meaning)
      end do
      code = merge(exit_ok, exit_incomplete, all(list%passed))
   end subroutine report_law

   !> NAME=VALUE behind the law.
   subroutine read_pairs(options, names, values, complaint)
      type(options_t), intent(in) :: options
      character(len=name_length), allocatable, intent(out) :: names(:)
      real(wp), allocatable, intent(out) :: values(:)
      character(len=:), allocatable, intent(out) :: complaint
      integer :: equals, i, n, status
      n = size(options%words) - 1
      allocate (names(n), values(n))
      do i = 1, n
         associate (word => options%words(i + 1)%text)
            equals = index(word, '=')
            status = 1
            if (equals > 1 .and. verify(word(equals + 1:), '+-0123456789.eEdD') == 0) &
               read (word(equals + 1:), *, iostat=status) values(i)
            if (status /= 0) then
               complaint = "a parameter is expected as NAME=VALUE, found '"//word//"'"
               return
            end if
            names(i) = word(:equals - 1)
         end associate
      end do
   end subroutine read_pairs

   !> The parameters of an example.
   subroutine examples(parameters, names, values)
      type(parameter_t), intent(in) :: parameters(:)
      character(len=name_length), allocatable, intent(inout) :: names(:)
      real(wp), allocatable, intent(inout) :: values(:)
      logical, allocatable :: used(:)
      used = parameters%required .or. abs(parameters%example - parameters%default) > 0
      names = pack(parameters%name, used)
      values = pack(parameters%example, used)
   end subroutine examples
end module finshell_law_report
