!> When is an increment converged? Both of the paper's criteria at once, in norms without units:
!>
!> - residual: Euclidean norm of the out-of-balance forces over all free displacement components, divided by the reference
!>   force; and that of the out-of-balance moments over all free rotation components, divided by the reference moment; the
!>   larger ratio counts. Reference force F = max(|external forces|, |reactions|), Euclidean norms over all nodes, at the
!>   current iterate or as the mean over the converged increments, whichever is larger; reference moment M likewise. As a
!>   structure may be loaded by forces or by moments alone, F >= M / size and M >= F detail, where size is the diagonal of
!>   the structure and detail the mean length of an element side: an out-of-balance moment of F detail is a pair of
!>   forces F at the two ends of a side.
!> - correction: Euclidean norm of the last displacement correction divided by that of the whole displacement increment; and
!>   of the last rotation correction divided by that of the whole rotation increment; the larger ratio counts. The
!>   displacement increment counts for at least (rotation increment) * detail and the rotation increment for at least
!>   (displacement increment) / size, so that a field that hardly moves cannot hold up the other.
!>
!> Multiplying all lengths and forces by constants changes none of these ratios.
!>
!> No iteration brings the residual below what rounding the unknowns leaves of it. Its norms have therefore a floor, that of
!> epsilon |matrix| |unknowns| (forces and moments apart): a residual below it is met, whatever was asked for. Measured on bent
!> strips of 10x1 to 640x1 elements, h/L 1e-2 to 1e-7, the residual comes to rest at 0.07 to 0.2 of the floor.
module finshell_convergence
   use finshell_kinds, only: wp, i1
   use finshell_equations, only: field_pressure, field_rotation
   implicit none
   private
   public :: field_norms, residual_ratio, residual_ratios, correction_ratio

contains

   !> Euclidean norms of the displacement part and of the rotation part of a vector over the equations. Pressures of chambers are
   !> left out: how well the volumes fit is asked beside (finshell_problem).
   pure function field_norms(x, field) result(norms)
      real(wp), intent(in) :: x(:)
      integer(i1), intent(in) :: field(:)
      real(wp) :: norms(2)
      real(wp) :: scale(2), ratio
      integer :: i, k
      scale = 0
      do i = 1, size(x)
         if (field(i) == field_pressure) cycle
         k = merge(2, 1, field(i) == field_rotation)
         scale(k) = max(scale(k), abs(x(i)))
      end do
      norms = 0
      do i = 1, size(x)
         if (field(i) == field_pressure) cycle
         k = merge(2, 1, field(i) == field_rotation)
         if (.not. scale(k) > 0) cycle
         ratio = x(i)/scale(k)
         norms(k) = norms(k) + ratio**2
      end do
      norms = scale*sqrt(norms)
   end function field_norms

   !> Residual over reference: the larger ratio.
   pure function residual_ratio(residual, field, levels, mean_levels, length, detail, least) result(ratio)
      real(wp), intent(in) :: residual(:)
      integer(i1), intent(in) :: field(:)
      real(wp), intent(in) :: levels(2), mean_levels(2), length, detail
      real(wp), intent(in), optional :: least(2)
      real(wp) :: ratio
      ratio = maxval(residual_ratios(residual, field, levels, mean_levels, length, detail, least))
   end function residual_ratio

   !> Of forces, and of moments.
   pure function residual_ratios(residual, field, levels, mean_levels, length, detail, least) result(ratios)
      real(wp), intent(in) :: residual(:)
      integer(i1), intent(in) :: field(:)
      real(wp), intent(in) :: levels(2) !< force and moment level of the current iterate
      real(wp), intent(in) :: mean_levels(2) !< mean levels of the converged increments
      real(wp), intent(in) :: length, detail
      real(wp), intent(in), optional :: least(2) !< the references are at least this
      real(wp) :: ratios(2)
      real(wp) :: reference(2), level(2), norms(2)
      level = max(levels, mean_levels)
      reference(1) = max(level(1), level(2)/length)
      reference(2) = max(level(2), level(1)*detail)
      if (present(least)) reference = max(reference, least)
      norms = field_norms(residual, field)
      ratios = [safe_ratio(norms(1), reference(1)), safe_ratio(norms(2), reference(2))]
   end function residual_ratios

   !> Correction over increment.
   pure function correction_ratio(correction, increment, field, length, detail, least) result(ratio)
      real(wp), intent(in) :: correction(:), increment(:)
      integer(i1), intent(in) :: field(:)
      real(wp), intent(in) :: length, detail
      real(wp), intent(in), optional :: least(2) !< the norms of the increment count for at least this
      real(wp) :: ratio
      real(wp) :: whole(2), reference(2), norms(2)
      whole = field_norms(increment, field)
      if (present(least)) whole = max(whole, least)
      reference(1) = max(whole(1), whole(2)*detail)
      reference(2) = max(whole(2), whole(1)/length)
      norms = field_norms(correction, field)
      ratio = max(safe_ratio(norms(1), reference(1)), safe_ratio(norms(2), reference(2)))
   end function correction_ratio

   pure function safe_ratio(a, b) result(ratio)
      real(wp), intent(in) :: a, b
      real(wp) :: ratio
      if (.not. a > 0 .and. .not. b > 0 .and. a >= 0) then
         ratio = 0
      else if (b > tiny(b) .and. a/sqrt(huge(a)) <= b) then
         ratio = a/b
      else
         ratio = huge(a)
      end if
   end function safe_ratio
end module finshell_convergence
