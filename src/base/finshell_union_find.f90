!> Which of many things are joined: a union-find forest. Roots have the lowest numbers of their things.
module finshell_union_find
   implicit none
   private
   public :: new_forest, root_of, join

contains

   !> Things 1 to n, none joined.
   pure function new_forest(n) result(root)
      integer, intent(in) :: n
      integer, allocatable :: root(:)
      integer :: i
      root = [(i, i=1, n)]
   end function new_forest

   pure integer function root_of(root, thing)
      integer, intent(in) :: root(:), thing
      root_of = thing
      do while (root(root_of) /= root_of)
         root_of = root(root_of)
      end do
   end function root_of

   !> Join two things with all that they are joined to.
   pure subroutine join(root, a, b)
      integer, intent(inout) :: root(:)
      integer, intent(in) :: a, b
      integer :: p, q
      call climb(root, a, p)
      call climb(root, b, q)
      root(max(p, q)) = min(p, q)
   end subroutine join

   !> The root, and shorter ways to it.
   pure subroutine climb(root, from, top)
      integer, intent(inout) :: root(:)
      integer, intent(in) :: from
      integer, intent(out) :: top
      top = from
      do while (root(top) /= top)
         root(top) = root(root(top))
         top = root(top)
      end do
   end subroutine climb
end module finshell_union_find
