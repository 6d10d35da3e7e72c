!> What stands in a factor of CHOLMOD.
module finshell_cholmod_factor
   use, intrinsic :: iso_c_binding, only: c_double, c_f_pointer, c_int, c_ptr
   use finshell_cholmod_c, only: factor_t
   use finshell_kinds, only: dp
   implicit none
   private
   public :: corner_of, diagonal_of

contains

   !> The pivots, by equation: squares of the diagonal of L, or D.
   subroutine diagonal_of(current, n, d)
      type(c_ptr), intent(in) :: current
      integer, intent(in) :: n
      real(dp), intent(out) :: d(:) !< (n)
      type(factor_t), pointer :: factor
      integer(c_int), pointer :: perm(:), first(:), rows(:), start(:)
      real(c_double), pointer :: x(:)
      integer :: j, s, height, place

      call c_f_pointer(current, factor)
      call c_f_pointer(factor%perm, perm, [n])
      if (factor%is_super /= 0) then
         call c_f_pointer(factor%super, first, [factor%nsuper + 1])
         call c_f_pointer(factor%pi, rows, [factor%nsuper + 1])
         call c_f_pointer(factor%px, start, [factor%nsuper + 1])
         call c_f_pointer(factor%x, x, [factor%xsize])
         do s = 1, int(factor%nsuper)
            height = rows(s + 1) - rows(s)
            place = start(s) + 1
            do j = first(s) + 1, first(s + 1)
               d(perm(j) + 1) = x(place)**2
               place = place + height + 1
            end do
         end do
      else
         call c_f_pointer(factor%p, start, [n + 1])
         call c_f_pointer(factor%x, x, [factor%nzmax])
         do j = 1, n
            d(perm(j) + 1) = x(start(j) + 1)
         end do
      end if
   end subroutine diagonal_of

   !> The last rows and columns of L.
   subroutine corner_of(current, n, l)
      type(c_ptr), intent(in) :: current !< supernodal, in the order of the equations
      integer, intent(in) :: n
      real(dp), intent(out) :: l(:, :) !< (m, m) lower triangle, zeros above
      type(factor_t), pointer :: factor
      integer(c_int), pointer :: first(:), at(:), start(:), rows(:)
      real(c_double), pointer :: x(:)
      integer :: before, column, height, j, k, s
      call c_f_pointer(current, factor)
      call c_f_pointer(factor%super, first, [factor%nsuper + 1])
      call c_f_pointer(factor%pi, at, [factor%nsuper + 1])
      call c_f_pointer(factor%px, start, [factor%nsuper + 1])
      call c_f_pointer(factor%s, rows, [factor%ssize])
      call c_f_pointer(factor%x, x, [factor%xsize])
      before = n - size(l, 2)
      l = 0
      do s = int(factor%nsuper), 1, -1
         if (first(s + 1) <= before) exit
         height = at(s + 1) - at(s)
         do j = max(first(s), before), first(s + 1) - 1
            column = start(s) + height*(j - first(s))
            do k = j - first(s) + 1, height
               l(rows(at(s) + k) + 1 - before, j + 1 - before) = x(column + k)
            end do
         end do
      end do
   end subroutine corner_of
end module finshell_cholmod_factor
