!> Keeps account of values that could not be recovered, for the summary of a run.
module finshell_gaps
   implicit none
   private
   public :: gap_t, count_gaps

   !> How many values of a monitor or field are missing.
   type :: gap_t
      character(len=:), allocatable :: name
      integer :: values = 0
   end type gap_t

contains

   !> Add those of one monitor or field.
   pure subroutine count_gaps(gaps, name, missing)
      type(gap_t), allocatable, intent(inout) :: gaps(:)
      character(len=*), intent(in) :: name
      logical, intent(in) :: missing(:)
      integer :: i
      if (.not. any(missing)) return
      do i = 1, size(gaps)
         if (gaps(i)%name == name) exit
      end do
      if (i > size(gaps)) gaps = [gaps, gap_t(name)]
      gaps(i)%values = gaps(i)%values + count(missing)
   end subroutine count_gaps
end module finshell_gaps
