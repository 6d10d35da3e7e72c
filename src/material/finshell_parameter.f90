!> The parameters of a material law: what it takes, for error messages and documentation.
module finshell_parameter
   use finshell_kinds, only: wp
   implicit none
   private
   public :: parameter_t, required_parameter, optional_parameter, list_of, lower

   type :: parameter_t
      character(len=32) :: name = ''
      logical :: required = .true.
      real(wp) :: default = 0.0_wp !< value when not given; meaningless if required
      character(len=128) :: meaning = ''
      real(wp) :: example = 0.0_wp !< a sensible value, for documentation and tests; the default where it is not part of an example
   end type parameter_t

contains

   pure function required_parameter(name, meaning, example) result(parameter)
      character(len=*), intent(in) :: name, meaning
      real(wp), intent(in) :: example
      type(parameter_t) :: parameter
      parameter = parameter_t(name=name, required=.true., default=0.0_wp, meaning=meaning, example=example)
   end function required_parameter

   pure function optional_parameter(name, default, meaning, example) result(parameter)
      character(len=*), intent(in) :: name, meaning
      real(wp), intent(in) :: default, example
      type(parameter_t) :: parameter
      parameter = parameter_t(name=name, required=.false., default=default, meaning=meaning, example=example)
   end function optional_parameter

   !> 'c10, c01 (optional)': the parameters in a sentence.
   pure function list_of(parameters) result(text)
      type(parameter_t), intent(in) :: parameters(:)
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(parameters)
         if (i > 1) text = text//', '
         text = text//trim(parameters(i)%name)
         if (.not. parameters(i)%required) text = text//' (optional)'
      end do
   end function list_of

   !> Small letters, no leading blanks.
   pure function lower(text) result(small)
      character(len=*), intent(in) :: text
      character(len=len(text)) :: small
      integer :: i
      small = adjustl(text)
      do i = 1, len(small)
         if (small(i:i) >= 'A' .and. small(i:i) <= 'Z') small(i:i) = achar(iachar(small(i:i)) + 32)
      end do
   end function lower
end module finshell_parameter
