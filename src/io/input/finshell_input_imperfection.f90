!> The groups &imperfection of an input file.
module finshell_input_imperfection
   use finshell_error, only: error_t, text_of
   use finshell_imperfection, only: from_file, from_results, from_step, imperfection_t, random_waves
   use finshell_input_number_file, only: read_vector_file
   use finshell_kinds, only: wp
   use finshell_namelist, only: check_all_used, complain_about, count_groups, get, group_t, has, namelist_t
   use finshell_step, only: is_in_time, is_mode, step_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: read_imperfections, modes_end

contains

   subroutine read_imperfections(namelist, folder, structure, steps, imperfections, error)
      type(namelist_t), intent(inout) :: namelist
      character(len=*), intent(in) :: folder !< of the input
      type(structure_t), intent(in) :: structure
      type(step_t), intent(in) :: steps(:)
      type(imperfection_t), allocatable, intent(out) :: imperfections(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: i, n
      allocate (imperfections(count_groups(namelist, 'imperfection')))
      n = 0
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name /= 'imperfection' .or. allocated(error)) cycle
         n = n + 1
         call read_imperfection(namelist%groups(i), folder, structure, steps, imperfections(n), error)
         if (allocated(error)) return
         if (count_groups(namelist, 'accuracy') > 0) call complain_about(namelist%groups(i), '', &
            'with &accuracy the mesh changes, an imperfection would not; refine the mesh by itself', error)
         if (modes_end(imperfections(:n)) > minval(pack(imperfections(:n)%step, imperfections(:n)%kind == from_step))) &
            call complain_about(namelist%groups(i), 'step', 'all modes of imperfections are those of one step', error)
      end do
   end subroutine read_imperfections

   !> The step whose modes are imperfections of those behind it, 0: none.
   pure integer function modes_end(imperfections) result(step)
      type(imperfection_t), intent(in) :: imperfections(:)
      step = maxval([0, pack(imperfections%step, imperfections%kind == from_step)])
   end function modes_end

   subroutine read_imperfection(group, folder, structure, steps, imperfection, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: folder
      type(structure_t), intent(in) :: structure
      type(step_t), intent(in) :: steps(:)
      type(imperfection_t), intent(out) :: imperfection
      type(error_t), allocatable, intent(inout) :: error
      character(len=11), parameter :: sources(4) = [character(len=11) :: 'step', 'results', 'file', 'wave_length']
      logical :: multiples
      integer :: i

      imperfection%line = group%line
      if (count([(has(group, trim(sources(i))), i=1, size(sources))]) /= 1) then
         call complain_about(group, '', 'expected is one of step (its modes), results, file and wave_length', error)
         return
      end if
      imperfection%kind = findloc([(has(group, trim(sources(i))), i=1, size(sources))], .true., dim=1)
      call get(group, 'amplitudes', imperfection%amplitudes, error, required=imperfection%kind /= from_file)
      call get(group, 'times_thickness', multiples, error, default=.false.)
      select case (imperfection%kind)
      case (from_step)
         call get(group, 'step', imperfection%step, error, minimum=1)
         call get(group, 'modes', imperfection%modes, error, required=.false., minimum=1)
         if (allocated(error)) return
         if (size(imperfection%modes) == 0) imperfection%modes = [(i, i=1, size(imperfection%amplitudes))]
         call check_step(group, steps, imperfection, error)
      case (from_results)
         call get(group, 'results', imperfection%file, error)
         call get(group, 'increments', imperfection%modes, error, minimum=1)
         if (.not. allocated(error)) imperfection%file = in_folder(imperfection%file)
      case (from_file)
         call get(group, 'file', imperfection%file, error)
         if (allocated(error)) return
         call read_vector_file(group, 'file', in_folder(imperfection%file), 'node', size(structure%mesh%coordinates, 2), &
                               imperfection%field, error)
      case (random_waves)
         call get(group, 'wave_length', imperfection%wave_length, error, above=0.0_wp)
         call get(group, 'seed', imperfection%seed, error, default=imperfection%seed, minimum=0)
      end select
      call check_all_used(group, error)
      if (allocated(error)) return
      if (.not. allocated(imperfection%modes)) imperfection%modes = [1]
      if (size(imperfection%amplitudes) /= size(imperfection%modes) .and. size(imperfection%amplitudes) > 0) then
         call complain_about(group, 'amplitudes', text_of(size(imperfection%amplitudes))//' were found, expected is one for ' &
                             //'each of '//text_of(size(imperfection%modes))//' fields', error)
         return
      end if
      if (multiples) call take_thickness(group, structure, imperfection, error)

   contains

      function in_folder(file) result(path)
         character(len=*), intent(in) :: file
         character(len=:), allocatable :: path
         path = file
         if (file(1:min(1, len(file))) /= '/') path = folder//file
      end function in_folder
   end subroutine read_imperfection

   !> Modes are those of a buckling or frequency step that is not the last, before which nothing moves in time.
   subroutine check_step(group, steps, imperfection, error)
      type(group_t), intent(in) :: group
      type(step_t), intent(in) :: steps(:)
      type(imperfection_t), intent(in) :: imperfection
      type(error_t), allocatable, intent(inout) :: error
      associate (i => imperfection%step)
         if (i > size(steps)) then
            call complain_about(group, 'step', 'the input has '//text_of(size(steps))//' steps; '//text_of(i)//' was found', error)
         else if (.not. is_mode(steps(i)%control)) then
            call complain_about(group, 'step', "step "//text_of(i)//" has no modes; expected is one with control = 'buckling' or " &
                                //"'frequencies'", error)
         else if (i == size(steps)) then
            call complain_about(group, 'step', 'no step follows that would have the imperfection', error)
         else if (any(is_in_time(steps(:i)%control))) then
            call complain_about(group, 'step', 'before the modes there is a step in time; take results of another run', error)
         else if (maxval(imperfection%modes) > steps(i)%modes) then
            call complain_about(group, 'modes', 'step '//text_of(i)//' looks for '//text_of(steps(i)%modes)//' modes; ' &
                                //text_of(maxval(imperfection%modes))//' was found', error)
         end if
      end associate
   end subroutine check_step

   !> Amplitudes are multiples of the thickness.
   subroutine take_thickness(group, structure, imperfection, error)
      type(group_t), intent(in) :: group
      type(structure_t), intent(in) :: structure
      type(imperfection_t), intent(inout) :: imperfection
      type(error_t), allocatable, intent(inout) :: error
      real(wp), parameter :: rounding = 1.0e-9_wp
      associate (t => structure%sections%thickness)
         if (allocated(structure%thickness)) then
            call complain_about(group, 'times_thickness', 'the thickness is a field (thickness_field); give lengths', error)
         else if (maxval(t) - minval(t) > rounding*maxval(t)) then
            call complain_about(group, 'times_thickness', &
            'sections have thicknesses from '//text_of(minval(t))//' to '//text_of(maxval(t))//'; give lengths', error)
         end if
         imperfection%amplitudes = imperfection%amplitudes*maxval(t)
      end associate
   end subroutine take_thickness
end module finshell_input_imperfection
