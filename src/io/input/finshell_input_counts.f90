!> How often groups stand in an input.
module finshell_input_counts
   use finshell_error, only: error_t, raise, text_of
   use finshell_namelist, only: complain_about, count_groups, namelist_t
   use finshell_status, only: status_input_error
   implicit none
   private
   public :: check_counts

contains

   !> Some groups are needed, some must not be repeated.
   subroutine check_counts(namelist, error)
      type(namelist_t), intent(in) :: namelist
      type(error_t), allocatable, intent(inout) :: error
      character(len=8), parameter :: needed(4) = [character(len=8) :: 'mesh', 'material', 'section', 'step']
      character(len=8), parameter :: single(3) = [character(len=8) :: 'job', 'mesh', 'accuracy']
      integer :: i, k, first

      if (allocated(error)) return
      do k = 1, size(needed)
         if (count_groups(namelist, trim(needed(k))) > 0) cycle
         call raise(error, status_input_error, namelist%file//': the group &'//trim(needed(k))//' is missing')
         return
      end do
      do k = 1, size(single)
         first = 0
         do i = 1, size(namelist%groups)
            if (namelist%groups(i)%name /= single(k)) cycle
            if (first > 0) then
               call complain_about(namelist%groups(i), '', 'there can be only one such group, and there is one in line ' &
                  //text_of(namelist%groups(first)%line), error)
               return
            end if
            first = i
         end do
      end do
   end subroutine check_counts
end module finshell_input_counts
