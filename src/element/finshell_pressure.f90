!> Follower pressure on the deformed midsurface and its load stiffness.
!>
!> Positive pressure pushes along the current normal (counter-clockwise nodes). Linear interpolation on the flat triangle.
!> Follower form: f_i = p/6 (x2 - x1) x (x3 - x1). Symmetric form: the gradient of p times the enclosed volume
!> 1/6 (x1 - o).((x2 - o) x (x3 - o)); assembled, both forms agree at every node whose elements surround it, and differ on a free
!> boundary only. Stiffness: d(force)/d(position), so the tangent of the structure is reduced by it.
module finshell_pressure
   use finshell_freedoms, only: n_membrane
   use finshell_kinds, only: wp
   use finshell_rotation, only: cross_product, spin
   implicit none
   private
   public :: follower_pressure, enclosed_volume

contains

   !> Nodal forces of a uniform pressure on each of n triangles.
   pure subroutine follower_pressure(n, p, x, symmetric, origin, force, stiffness)
      integer, intent(in) :: n
      real(wp), intent(in) :: p(n) !< pressure per current area
      real(wp), intent(in) :: x(3, 3, n) !< current positions (component, node, element)
      logical, intent(in) :: symmetric !< gradient of the volume instead of the follower form
      real(wp), intent(in) :: origin(3) !< of the volume, used by the symmetric form
      real(wp), intent(out) :: force(n_membrane, n) !< nodes in turn, three components each
      real(wp), intent(out), optional :: stiffness(n_membrane, n_membrane, n)
      real(wp) :: a(3, 3), b(3), c(3), f(3), s(3, 3), t(3, 3)
      integer :: e, i, j, k
      do e = 1, n
         if (symmetric) then
            do i = 1, 3
               a(:, i) = x(:, i, e) - origin
            end do
            do i = 1, 3
               j = 1 + mod(i, 3)
               k = 1 + mod(i + 1, 3)
               f = (p(e)/6)*cross_product(a(:, j), a(:, k))
               force(3*i - 2:3*i, e) = f
               if (.not. present(stiffness)) cycle
               stiffness(3*i - 2:3*i, 3*i - 2:3*i, e) = 0
               s = (p(e)/6)*spin(a(:, k))
               stiffness(3*i - 2:3*i, 3*j - 2:3*j, e) = -s
               s = (p(e)/6)*spin(a(:, j))
               stiffness(3*i - 2:3*i, 3*k - 2:3*k, e) = s
            end do
         else
            b = x(:, 2, e) - x(:, 1, e)
            c = x(:, 3, e) - x(:, 1, e)
            f = (p(e)/6)*cross_product(b, c)
            do i = 1, 3
               force(3*i - 2:3*i, e) = f
            end do
            if (.not. present(stiffness)) cycle
            s = (p(e)/6)*spin(c)
            t = (p(e)/6)*spin(b)
            do i = 1, 3
               stiffness(3*i - 2:3*i, 4:6, e) = -s
               stiffness(3*i - 2:3*i, 1:3, e) = s - t
               stiffness(3*i - 2:3*i, 7:9, e) = t
            end do
         end if
      end do
   end subroutine follower_pressure

   !> Volume of the cone from the origin to n triangles: the enclosed volume of a closed surface.
   pure function enclosed_volume(n, x, origin) result(volume)
      integer, intent(in) :: n
      real(wp), intent(in) :: x(3, 3, n), origin(3)
      real(wp) :: volume
      integer :: e
      volume = 0
      do e = 1, n
         volume = volume + dot_product(x(:, 1, e) - origin, cross_product(x(:, 2, e) - origin, x(:, 3, e) - origin))/6
      end do
   end function enclosed_volume
end module finshell_pressure
