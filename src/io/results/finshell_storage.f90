!> How fields are stored in the result file. Data and their checks only.
module finshell_storage
   use, intrinsic :: iso_fortran_env, only: real32
   use finshell_error, only: error_t, raise, text_of
   use finshell_field, only: field_t
   use finshell_kinds, only: wp
   use finshell_status, only: status_invalid_argument
   implicit none
   private
   public :: storage_t, check_range

   type :: storage_t
      integer :: compress = 1 !< level of zlib, 0 (none) to 9
      !> Fields in single precision. The mesh and histories are in double precision in any case.
      logical :: single = .false.
      !> Of all steps in time of the input, if there are some: then the time of a step of the file is that of its state.
      real(wp) :: duration = 0
   contains
      procedure :: bytes => bytes_of_field
   end type storage_t

contains

   !> Bytes of a number of a field.
   pure integer function bytes_of_field(self) result(bytes)
      class(storage_t), intent(in) :: self
      bytes = merge(4, 8, self%single)
   end function bytes_of_field

   !> Values that single precision cannot hold would become infinite.
   subroutine check_range(fields, bytes, increment, error)
      type(field_t), intent(in) :: fields(:)
      integer, intent(in) :: bytes(:) !< of a number of each field
      integer, intent(in) :: increment
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: largest
      integer :: i
      do i = 1, size(fields)
         if (bytes(i) == 8 .or. allocated(error)) cycle
         largest = maxval(abs(fields(i)%values))
         if (largest > huge(1.0_real32)) call raise(error, status_invalid_argument, 'field '//fields(i)%name//' of increment ' &
            //text_of(increment)//' reaches '//text_of(largest)//', more than single precision holds: precision = ''double'' &
            &is expected')
      end do
   end subroutine check_range
end module finshell_storage
