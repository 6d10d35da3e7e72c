!> A line along which results are wanted. Data only.
module finshell_probe
   use finshell_kinds, only: wp
   implicit none
   private
   public :: probe_t, points_of

   type :: probe_t
      character(len=:), allocatable :: name !< of the file, behind that of the job
      real(wp) :: from(3) = 0, to(3) = 0
      integer :: points = 51 !< evenly spaced, with both ends
      integer, allocatable :: wanted(:) !< numbers of fields on nodes and elements (finshell_result_fields)
      logical :: deformed = .false. !< the line meets the deformed surface, at each increment another part of it
      integer :: every = 1 !< increments from one set of rows to the next
   end type probe_t

contains

   !> The points of the line, (3, points).
   pure function points_of(probe) result(points)
      type(probe_t), intent(in) :: probe
      real(wp), allocatable :: points(:, :)
      integer :: k
      allocate (points(3, probe%points))
      do k = 1, probe%points
         points(:, k) = probe%from + (probe%to - probe%from)*(real(k - 1, wp)/(probe%points - 1))
      end do
   end function points_of
end module finshell_probe
