!> Values of the parameters of a law, from pairs of names and values.
module finshell_parameter_values
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: wp
   use finshell_parameter, only: parameter_t, list_of, lower
   use finshell_status, only: status_invalid_argument
   implicit none
   private
   public :: read_values

contains

   !> All values of a law, in the order of its parameters; what is not given has its default. Capitals do not matter.
   subroutine read_values(place, parameters, names, numbers, values, given, error)
      character(len=*), intent(in) :: place !< before a message
      type(parameter_t), intent(in) :: parameters(:)
      character(len=*), intent(in) :: names(:)
      real(wp), intent(in) :: numbers(:)
      real(wp), allocatable, intent(out) :: values(:)
      logical, allocatable, intent(out) :: given(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: message
      integer :: i, j
      allocate (values(size(parameters)), given(size(parameters)))
      values = parameters%default
      given = .false.
      if (size(names) /= size(numbers)) then
         call raise(error, status_invalid_argument, place//text_of(size(names))//' parameter names but '// &
                    text_of(size(numbers))//' values')
         return
      end if
      do i = 1, size(names)
         j = position(parameters, lower(names(i)))
         if (j == 0) then
            message = 'unknown parameter '''//trim(lower(names(i)))//''''
         else if (given(j)) then
            message = 'parameter '''//trim(lower(names(i)))//''' is given twice'
         else if (.not. ieee_is_finite(numbers(i))) then
            message = 'parameter '''//trim(lower(names(i)))//''' is not a finite number'
         end if
         if (allocated(message)) then
            call raise(error, status_invalid_argument, place//message//'; the law takes '//what_of(parameters))
            return
         end if
         values(j) = numbers(i)
         given(j) = .true.
      end do
      do j = 1, size(parameters)
         if (parameters(j)%required .and. .not. given(j)) then
            call raise(error, status_invalid_argument, place//'parameter '''//trim(parameters(j)%name)// &
                       ''' is missing; the law takes '//what_of(parameters))
            return
         end if
      end do
   end subroutine read_values

   pure function what_of(parameters) result(text)
      type(parameter_t), intent(in) :: parameters(:)
      character(len=:), allocatable :: text
      text = list_of(parameters)
      if (size(parameters) == 0) text = 'none'
   end function what_of

   pure function position(parameters, name) result(j)
      type(parameter_t), intent(in) :: parameters(:)
      character(len=*), intent(in) :: name
      integer :: j
      do j = 1, size(parameters)
         if (parameters(j)%name == name) return
      end do
      j = 0
   end function position
end module finshell_parameter_values
