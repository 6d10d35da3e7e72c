!> What another input may say of a run that is to go on: the model and the steps that have begun are those of the run. Tolerances,
!> increments, output and further steps are free.
module finshell_input_difference
   use finshell_error, only: error_t, text_of
   use finshell_namelist, only: complain_about, count_groups, group_t, namelist_t, parse_namelist
   use finshell_namelist_parser, only: entry_t
   implicit none
   private
   public :: compare_inputs

   !> Groups that are free, and keys of &step; all others are those of the run.
   character(len=*), parameter :: free_groups = ', job, monitor, sensitivity, probe, output, accuracy,'
   character(len=*), parameter :: free_of_step = ', tolerance, residual_tolerance, correction_tolerance, maximum_iterations, ' &
      //'mixed, rotation_limit, largest_increment, smallest_increment, maximum_increments, maximum_cuts, growth, ' &
      //'wanted_iterations, extrapolate, tangent_predictor, switch_control, descent, cautious, snap, patience, ' &
      //'output_times, output_interval, time_tolerance, name,'

contains

   !> The first group that differs is an error with its place in the new input.
   subroutine compare_inputs(old_text, new_text, new_file, steps, error)
      character(len=*), intent(in) :: old_text, new_text, new_file
      integer, intent(in) :: steps !< begun by the run
      type(error_t), allocatable, intent(out) :: error
      type(namelist_t) :: old, new
      integer :: k
      call parse_namelist(old_text, 'the input of the run', old, error)
      if (.not. allocated(error)) call parse_namelist(new_text, new_file, new, error)
      if (allocated(error)) return
      if (preset_of(old) /= preset_of(new)) call complain_about(new%groups(1), '', "in &job accuracy = '"//preset_of(new) &
         //"' was found, the run had '"//preset_of(old)//"'", error)
      if (allocated(error)) return
      do k = 1, size(new%groups)
         call compare_groups(old, new, new%groups(k)%name, steps, error)
         if (allocated(error)) return
      end do
      do k = 1, size(old%groups)
         call compare_groups(old, new, old%groups(k)%name, steps, error)
         if (allocated(error)) return
      end do
   end subroutine compare_inputs

   subroutine compare_groups(old, new, name, steps, error)
      type(namelist_t), intent(in) :: old, new
      character(len=*), intent(in) :: name
      integer, intent(in) :: steps
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: refusal = '; a run goes on with the model and the steps that it has begun with'
      integer :: i, before, expected, found
      if (index(free_groups, ', '//name//',') > 0) return
      expected = count_groups(old, name)
      found = count_groups(new, name)
      if (name == 'step') expected = min(expected, steps)
      before = 0
      do i = 1, size(new%groups)
         if (new%groups(i)%name /= name) cycle
         before = before + 1
         if (before > expected .and. name == 'step') exit
         if (before > expected) then
            call complain_about(new%groups(i), '', 'the run had '//text_of(expected)//' such groups'//refusal, error)
         else
            call compare(old%groups(place_of(old, name, before)), new%groups(i), error)
            if (allocated(error)) error%message = error%message//refusal
         end if
         if (allocated(error)) return
      end do
      if (found >= expected) return
      call complain_about(new%groups(1), '', 'found are '//text_of(found)//' groups &'//name//', expected at least ' &
                          //text_of(expected)//refusal, error)
   end subroutine compare_groups

   !> The key accuracy of &job, '' where it is not given.
   pure function preset_of(namelist) result(word)
      type(namelist_t), intent(in) :: namelist
      character(len=:), allocatable :: word
      integer :: i, k
      word = ''
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name /= 'job') cycle
         k = entry_of(namelist%groups(i), 'accuracy')
         if (k == 0) cycle
         if (size(namelist%groups(i)%entries(k)%values) > 0) word = namelist%groups(i)%entries(k)%values(1)%text
      end do
   end function preset_of

   !> Where the group of a name stands that has this number among them.
   pure integer function place_of(namelist, name, number) result(place)
      type(namelist_t), intent(in) :: namelist
      character(len=*), intent(in) :: name
      integer, intent(in) :: number
      integer :: met
      met = 0
      do place = 1, size(namelist%groups)
         if (namelist%groups(place)%name == name) met = met + 1
         if (met == number) return
      end do
   end function place_of

   subroutine compare(old, new, error)
      type(group_t), intent(in) :: old, new
      type(error_t), allocatable, intent(inout) :: error
      integer :: i, k
      do i = 1, size(new%entries)
         if (is_free(new, new%entries(i)%key)) cycle
         k = entry_of(old, new%entries(i)%key)
         if (k == 0) then
            call complain_about(new, new%entries(i)%key, 'the run had no such key', error)
         else if (.not. same(old%entries(k), new%entries(i))) then
            call complain_about(new, new%entries(i)%key, 'found '//values_of(new%entries(i))//', the run had ' &
                                //values_of(old%entries(k)), error)
         end if
         if (allocated(error)) return
      end do
      do i = 1, size(old%entries)
         if (is_free(old, old%entries(i)%key) .or. entry_of(new, old%entries(i)%key) > 0) cycle
         call complain_about(new, '', 'the run had '//old%entries(i)%key//' = '//values_of(old%entries(i)), error)
         return
      end do
   end subroutine compare

   pure logical function is_free(group, key)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      is_free = group%name == 'step' .and. index(free_of_step, ', '//key//',') > 0
   end function is_free

   pure integer function entry_of(group, key) result(k)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      do k = size(group%entries), 1, -1
         if (group%entries(k)%key == key) exit
      end do
   end function entry_of

   pure logical function same(a, b)
      type(entry_t), intent(in) :: a, b
      integer :: i
      same = size(a%values) == size(b%values)
      do i = 1, merge(size(a%values), 0, same)
         same = same .and. a%values(i)%text == b%values(i)%text
      end do
   end function same

   pure function values_of(entry) result(text)
      type(entry_t), intent(in) :: entry
      character(len=:), allocatable :: text
      integer, parameter :: most = 12
      integer :: i
      text = ''
      do i = 1, min(most, size(entry%values))
         if (i > 1) text = text//', '
         text = text//entry%values(i)%text
      end do
      if (size(entry%values) > most) text = text//', ...'
   end function values_of
end module finshell_input_difference
