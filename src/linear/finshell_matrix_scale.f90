!> A scale for every equation of a matrix, so that judgements about it do not depend on units.
!>
!> Entry (i, j) is to be compared with scale(i) scale(j). For a positive definite matrix the root of the diagonal does it.
module finshell_matrix_scale
   use finshell_kinds, only: dp
   use finshell_sparsity, only: sparsity_t
   use finshell_team, only: largest_of, leads
   implicit none
   private
   public :: initial_scale, equilibrate, shifted

contains

   !> Root of the diagonal; where that is zero, root of the largest entry of row and column.
   subroutine initial_scale(pattern, values, scale, empty_equation)
      type(sparsity_t), intent(in) :: pattern
      real(dp), intent(in) :: values(:)
      real(dp), allocatable, intent(out) :: scale(:)
      integer, intent(out) :: empty_equation !< one without any entry, or 0
      real(dp), allocatable :: largest(:), unit(:)

      empty_equation = 0
      scale = sqrt(abs(pattern%diagonal(values)))
      if (.not. any(scale <= 0)) return
      allocate (unit(pattern%n), source=1.0_dp)
      call largest_entries(pattern, values, unit, largest)
      where (scale <= 0) scale = sqrt(largest)
      empty_equation = findloc(scale <= 0, .true., 1)
   end subroutine initial_scale

   !> Change the scale until no scaled entry exceeds one (nothing to do for a definite matrix).
   subroutine equilibrate(pattern, values, scale)
      type(sparsity_t), intent(in) :: pattern
      real(dp), intent(in) :: values(:)
      real(dp), intent(inout) :: scale(:)
      real(dp), allocatable :: largest(:)
      integer :: k
      do k = 1, 10
         call largest_entries(pattern, values, scale, largest)
         if (all(largest <= 2)) exit
         scale = scale*sqrt(largest)
      end do
   end subroutine equilibrate

   !> The values with a little of the scale added to the diagonal.
   function shifted(pattern, values, scale, shift) result(changed)
      type(sparsity_t), intent(in) :: pattern
      real(dp), intent(in) :: values(:), scale(:), shift
      real(dp), allocatable :: changed(:)
      integer :: j, p
      changed = values
      if (.not. leads(pattern%team)) return
      do j = 1, pattern%n
         p = pattern%find(j, j)
         if (p > 0) changed(p) = changed(p) + shift*scale(j)**2
      end do
   end function shifted

   !> Largest scaled entry of row and column of each equation; entries to which several members of a team add count by their parts.
   subroutine largest_entries(pattern, values, scale, largest)
      type(sparsity_t), intent(in) :: pattern
      real(dp), intent(in) :: values(:), scale(:)
      real(dp), allocatable, intent(out) :: largest(:)
      integer :: j, p, r
      real(dp) :: entry
      allocate (largest(pattern%n), source=0.0_dp)
      do j = 1, pattern%n
         do p = pattern%column_pointer(j), pattern%column_pointer(j + 1) - 1
            r = pattern%row(p)
            entry = abs(values(p))/scale(r)/scale(j)
            largest(r) = max(largest(r), entry)
            largest(j) = max(largest(j), entry)
         end do
      end do
      call largest_of(pattern%team, largest)
   end subroutine largest_entries
end module finshell_matrix_scale
