!> What scales loads and supports: the factor of their case, which one step changes while those of others stay, or an amplitude over
!> it or over time.
module finshell_input_case
   use finshell_error, only: error_t, text_of
   use finshell_factor, only: by_case, by_constant_factor, by_load_factor
   use finshell_field, only: name_t
   use finshell_input_amplitude, only: amplitude_t, get_amplitude, read_amplitudes
   use finshell_namelist, only: complain_about, count_groups, get, group_t, has, namelist_t
   use finshell_span, only: span_t
   use finshell_table, only: by_time, follower_t
   implicit none
   private
   public :: name_t, scales_t, find_scales, get_scaling, get_span, get_case

   type :: scales_t
      type(name_t), allocatable :: cases(:)
      type(amplitude_t), allocatable :: amplitudes(:)
      type(follower_t), allocatable :: followers(:) !< as they are asked for: an amplitude over the factor of a case, or over time
      type(name_t), allocatable :: names(:) !< of the followers
      integer :: steps = 0 !< how many the input has
   end type scales_t

contains

   !> Cases and amplitudes; followers are found by `get_scaling`.
   subroutine find_scales(namelist, scales, error)
      type(namelist_t), intent(inout) :: namelist
      type(scales_t), intent(out) :: scales
      type(error_t), allocatable, intent(inout) :: error
      allocate (scales%followers(0), scales%names(0))
      call read_amplitudes(namelist, scales%amplitudes, error)
      call find_cases(namelist, scales%cases, error)
      scales%steps = count_groups(namelist, 'step')
   end subroutine find_scales

   !> The steps in which a load or a support is there.
   subroutine get_span(group, scales, span, error)
      type(group_t), intent(inout) :: group
      type(scales_t), intent(in) :: scales
      type(span_t), intent(out) :: span
      type(error_t), allocatable, intent(inout) :: error
      call get(group, 'from_step', span%first, error, default=1, minimum=1, maximum=scales%steps)
      call get(group, 'until_step', span%last, error, default=huge(1), minimum=1, maximum=huge(1))
      if (allocated(error) .or. .not. has(group, 'until_step')) return
      if (span%last > scales%steps) then
         call complain_about(group, 'until_step', 'the input has '//text_of(scales%steps)//' steps; '//text_of(span%last) &
                             //' was found', error)
      else if (span%last < span%first) then
         call complain_about(group, 'until_step', 'step '//text_of(span%last)//' is before from_step = ' &
                             //text_of(span%first), error)
      end if
   end subroutine get_span

   !> The names that loads, supports, growths and chambers give, in their order.
   subroutine find_cases(namelist, cases, error)
      type(namelist_t), intent(inout) :: namelist
      type(name_t), allocatable, intent(out) :: cases(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      integer :: i
      allocate (cases(0))
      do i = 1, size(namelist%groups)
         if (all(namelist%groups(i)%name /= [character(len=7) :: 'load', 'support', 'chamber', 'growth'])) cycle
         if (.not. has(namelist%groups(i), 'case')) cycle
         call get(namelist%groups(i), 'case', name, error)
         if (.not. allocated(error) .and. name == '') call complain_about(namelist%groups(i), 'case', 'the name is empty', error)
         if (allocated(error)) return
         if (number_of(cases, name) == 0) cases = [cases, name_t(name)]
      end do
   end subroutine find_cases

   !> The number of a name, 0: there is none.
   pure integer function number_of(cases, name)
      type(name_t), intent(in) :: cases(:)
      character(len=*), intent(in) :: name
      do number_of = size(cases), 1, -1
         if (cases(number_of)%text == name) return
      end do
      number_of = 0
   end function number_of

   !> What scales a load or a support, by the keys `constant`, `case` and `amplitude`.
   subroutine get_scaling(group, scales, scaling, error)
      type(group_t), intent(inout) :: group
      type(scales_t), intent(inout) :: scales
      integer, intent(out) :: scaling !< finshell_factor
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      logical :: constant
      integer :: at
      scaling = by_load_factor
      call get(group, 'constant', constant, error, default=.false.)
      call get(group, 'case', name, error, default='')
      call get_amplitude(group, scales%amplitudes, at, error)
      if (allocated(error)) return
      if (constant) scaling = by_constant_factor
      if (name /= '') scaling = by_case + number_of(scales%cases, name)
      if (constant .and. name /= '') then
         call complain_about(group, 'case', 'what is constant has no case', error)
      else if (constant .and. at > 0) then
         call complain_about(group, 'amplitude', 'what is constant has no amplitude', error)
      else if (at > 0) then
         if (scales%amplitudes(at)%over_time .and. name /= '') then
            call complain_about(group, 'case', "what follows the time has no case ('"//scales%amplitudes(at)%name &
                                //"' is over time)", error)
            return
         end if
         call follow(scales, at, name, scaling)
      end if
   end subroutine get_scaling

   !> The factor that follows an amplitude over the factor of a case, or over time: that of an earlier group, or a new one.
   subroutine follow(scales, at, case, scaling)
      type(scales_t), intent(inout) :: scales
      integer, intent(in) :: at !< which amplitude
      character(len=*), intent(in) :: case !< its name, or ''
      integer, intent(inout) :: scaling !< of the case; of the follower
      character(len=:), allocatable :: name
      type(follower_t) :: new
      integer :: i
      name = scales%amplitudes(at)%name
      if (case /= '') name = case//'.'//name
      do i = 1, size(scales%names)
         if (scales%names(i)%text /= name) cycle
         scaling = scales%followers(i)%factor
         return
      end do
      new = follower_t(factor=by_case + size(scales%cases) + size(scales%followers) + 1, parent=scaling, &
                       table=scales%amplitudes(at)%table)
      if (scales%amplitudes(at)%over_time) new%parent = by_time
      scales%followers = [scales%followers, new]
      scales%names = [scales%names, name_t(name)]
      scaling = new%factor
   end subroutine follow

   !> The case that a step changes: 1 without a name.
   subroutine get_case(group, cases, case, error)
      type(group_t), intent(inout) :: group
      type(name_t), intent(in) :: cases(:)
      integer, intent(out) :: case
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: known, name
      integer :: i
      call get(group, 'case', name, error, default='')
      case = 1
      if (allocated(error) .or. name == '') return
      case = 1 + number_of(cases, name)
      if (case > 1) return
      known = ''
      do i = 1, size(cases)
         known = known//', '//cases(i)%text
      end do
      if (known == '') known = ', (none)'
      call complain_about(group, 'case', "no load, support, growth or chamber has the case '"//name//"'; there are: " &
                          //known(3:), error)
   end subroutine get_case
end module finshell_input_case
