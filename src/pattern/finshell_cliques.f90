!> Groups of equations that meet in a matrix beside those of the elements: of joints, of springs and bars between nodes.
module finshell_cliques
   use finshell_kinds, only: i4
   implicit none
   private
   public :: cliques_t, cliques_at, joined

   !> Clique c has the equations equation(first(c)) .. equation(first(c + 1) - 1), each once.
   type :: cliques_t
      integer(i4), allocatable :: first(:) !< (cliques + 1)
      integer(i4), allocatable :: equation(:)
   end type cliques_t

contains

   !> The cliques that each equation belongs to: clique(first(e)) .. clique(first(e + 1) - 1) for equation e.
   pure subroutine cliques_at(self, n, first, clique)
      type(cliques_t), intent(in) :: self
      integer, intent(in) :: n !< number of equations
      integer(i4), allocatable, intent(out) :: first(:) !< (n + 1)
      integer(i4), allocatable, intent(out) :: clique(:)
      integer(i4), allocatable :: fill(:)
      integer :: c, e, k
      allocate (first(n + 1), fill(n), clique(size(self%equation)))
      fill = 0_i4
      do k = 1, size(self%equation)
         fill(self%equation(k)) = fill(self%equation(k)) + 1_i4
      end do
      first(1) = 1
      do e = 1, n
         first(e + 1) = first(e) + fill(e)
      end do
      fill = first(:n)
      do c = 1, size(self%first) - 1
         do k = self%first(c), self%first(c + 1) - 1
            e = self%equation(k)
            clique(fill(e)) = int(c, i4)
            fill(e) = fill(e) + 1_i4
         end do
      end do
   end subroutine cliques_at

   !> The cliques of both.
   pure function joined(a, b) result(both)
      type(cliques_t), intent(in) :: a, b
      type(cliques_t) :: both
      both%equation = [a%equation, b%equation]
      both%first = [a%first, b%first(2:) + a%first(size(a%first)) - 1_i4]
   end function joined
end module finshell_cliques
