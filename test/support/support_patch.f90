!> Distorted patches of elements, dense assembly and a dense solve: enough of a program for patch tests.
module support_patch
   use, intrinsic :: iso_fortran_env, only: int64
   use finshell_batch, only: evaluate_elements, rotation_quaternion
   use finshell_kinds, only: wp, i4
   use finshell_section, only: section_t
   use support_element, only: uniform
   implicit none
   private
   public :: patch_t, new_patch, assemble, solve, element_state

   type :: patch_t
      integer :: nodes = 0, elements = 0
      real(wp), allocatable :: x(:, :) !< (3, nodes)
      integer, allocatable :: triangles(:, :)
      logical, allocatable :: inside(:) !< not on the boundary
   end type patch_t

contains

   !> Rectangle a x b of n x m cells cut into triangles by either diagonal, interior nodes moved by up to `shift` of a cell.
   subroutine new_patch(patch, n, m, a, b, shift, seed)
      type(patch_t), intent(out) :: patch
      integer, intent(in) :: n, m
      real(wp), intent(in) :: a, b, shift
      integer(int64), intent(inout) :: seed
      integer :: i, j, k, e, c(4)
      logical :: other
      patch%nodes = (n + 1)*(m + 1)
      patch%elements = 2*n*m
      allocate (patch%x(3, patch%nodes), patch%triangles(3, patch%elements), patch%inside(patch%nodes))
      do j = 0, m
         do i = 0, n
            k = 1 + i + (n + 1)*j
            patch%inside(k) = i > 0 .and. i < n .and. j > 0 .and. j < m
            patch%x(:, k) = [a*i/n, b*j/m, 0.0_wp]
            if (.not. patch%inside(k)) cycle
            patch%x(1, k) = patch%x(1, k) + shift*a/n*uniform(seed)
            patch%x(2, k) = patch%x(2, k) + shift*b/m*uniform(seed)
         end do
      end do
      e = 0
      do j = 1, m
         do i = 1, n
            k = i + (n + 1)*(j - 1)
            c = [k, k + 1, k + n + 2, k + n + 1]
            other = shift > 0 .and. mod(i*j, 2) == 0
            if (other) c = cshift(c, 1)
            patch%triangles(:, e + 1) = c([1, 2, 3])
            patch%triangles(:, e + 2) = c([3, 4, 1])
            e = e + 2
         end do
      end do
   end subroutine new_patch

   !> Nodal values gathered for the kernel.
   subroutine element_state(patch, u, q, xe, ue, qe)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: u(:, :), q(:, :)
      real(wp), intent(out) :: xe(:, :, :), ue(:, :, :), qe(:, :, :)
      integer :: e, i
      do e = 1, patch%elements
         do i = 1, 3
            xe(:, i, e) = patch%x(:, patch%triangles(i, e))
            ue(:, i, e) = u(:, patch%triangles(i, e))
            qe(:, i, e) = q(:, patch%triangles(i, e))
         end do
      end do
   end subroutine element_state

   !> Internal forces (6 per node) and their tangent for spins.
   subroutine assemble(section, patch, u, q, force, tangent, worst, held)
      type(section_t), intent(in) :: section
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: u(:, :), q(:, :)
      real(wp), intent(out) :: force(:), tangent(:, :)
      integer(i4), intent(out) :: worst !< a status that is not 0, if there is one
      integer, intent(in), optional :: held(:, :) !< (3, elements) sides that supports hold (finshell_batch)
      real(wp) :: xe(3, 3, patch%elements), ue(3, 3, patch%elements), qe(4, 3, patch%elements)
      real(wp), allocatable :: f(:, :), k(:, :, :)
      integer(i4) :: status(patch%elements)
      integer :: dofs(18), e, i
      allocate (f(18, patch%elements), k(18, 18, patch%elements))
      call element_state(patch, u, q, xe, ue, qe)
      call evaluate_elements(section, patch%elements, xe, ue, qe, rotation_quaternion, status, force=f, tangent=k, &
                             held=held)
      worst = maxval(abs(status))
      force = 0
      tangent = 0
      do e = 1, patch%elements
         do i = 1, 18
            dofs(i) = 6*(patch%triangles((i + 5)/6, e) - 1) + 1 + mod(i - 1, 6)
         end do
         force(dofs) = force(dofs) + f(:, e)
         tangent(dofs, dofs) = tangent(dofs, dofs) + k(:, :, e)
      end do
   end subroutine assemble

   !> x with a x = b, Gaussian elimination with row pivoting.
   function solve(matrix, b) result(x)
      real(wp), intent(in) :: matrix(:, :), b(:)
      real(wp) :: x(size(b)), a(size(b), size(b) + 1), row(size(b) + 1)
      integer :: i, j, n
      n = size(b)
      a(:, :n) = matrix
      a(:, n + 1) = b
      do j = 1, n
         i = j - 1 + maxloc(abs(a(j:, j)), 1)
         row = a(i, :)
         a(i, :) = a(j, :)
         a(j, :) = row
         do i = j + 1, n
            a(i, j:) = a(i, j:) - (a(i, j)/a(j, j))*a(j, j:)
         end do
      end do
      do i = n, 1, -1
         x(i) = (a(i, n + 1) - dot_product(a(i, i + 1:n), x(i + 1:)))/a(i, i)
      end do
   end function solve
end module support_patch
