!> Cases: loads and supports that are scaled together, by a factor that one step changes while the others stay.
module finshell_input_case
   use finshell_error, only: error_t
   use finshell_factor, only: by_case, by_constant_factor, by_load_factor
   use finshell_field, only: name_t
   use finshell_namelist, only: complain_about, get, group_t, has, namelist_t
   implicit none
   private
   public :: name_t, find_cases, get_scaling, get_case

contains

   !> The names that loads, supports and chambers give, in their order.
   subroutine find_cases(namelist, cases, error)
      type(namelist_t), intent(inout) :: namelist
      type(name_t), allocatable, intent(out) :: cases(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      integer :: i
      allocate (cases(0))
      do i = 1, size(namelist%groups)
         if (all(namelist%groups(i)%name /= [character(len=7) :: 'load', 'support', 'chamber'])) cycle
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

   !> What scales a load or a support, by the keys `constant` and `case`.
   subroutine get_scaling(group, cases, scaling, error)
      type(group_t), intent(inout) :: group
      type(name_t), intent(in) :: cases(:)
      integer, intent(out) :: scaling !< finshell_factor
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      logical :: constant
      scaling = by_load_factor
      call get(group, 'constant', constant, error, default=.false.)
      call get(group, 'case', name, error, default='')
      if (allocated(error)) return
      if (constant) scaling = by_constant_factor
      if (name /= '') scaling = by_case + number_of(cases, name)
      if (constant .and. name /= '') call complain_about(group, 'case', 'what is constant has no case', error)
   end subroutine get_scaling

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
      call complain_about(group, 'case', "no load, support or chamber has the case '"//name//"'; there are: "//known(3:), error)
   end subroutine get_case
end module finshell_input_case
