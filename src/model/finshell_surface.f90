!> The surface that a generator meshes: the middle between two of its points, and its normal there.
module finshell_surface
   use finshell_kinds, only: wp
   use finshell_rotation, only: cross_product
   implicit none
   private
   public :: surface_t, surface_middle, surface_normal
   public :: surface_none, surface_flat, surface_cone, surface_sphere, surface_paraboloid, surface_strip, surface_bilinear

   !> Not known; flat, with circles about the z axis as boundaries; a cone about y; a sphere about the origin; a paraboloid over
   !> x, y; a twisted strip along x; a bilinear patch.
   integer, parameter :: surface_none = 0, surface_flat = 1, surface_cone = 2, surface_sphere = 3, surface_paraboloid = 4, &
                         surface_strip = 5, surface_bilinear = 6

   type :: surface_t
      integer :: kind = surface_none
      !> flat: radii of the circles, unallocated: none; cone: d radius/dy; paraboloid: curvatures k1, k2, k12; strip: turn over
      !> length; bilinear: the corners, counterclockwise
      real(wp), allocatable :: numbers(:)
      real(wp) :: scale = 1 !< coordinates are those of the numbers times this
   end type surface_t

   real(wp), parameter :: near = 1.0e-9_wp !< relative, of lengths that are the same
   integer, parameter :: most_iterations = 20

contains

   !> The point of the surface in the middle between two of it, by the parameters of its generator. Points of a boundary stay on it.
   pure function surface_middle(self, ends, boundary) result(x)
      type(surface_t), intent(in) :: self
      real(wp), intent(in) :: ends(3, 2)
      logical, intent(in) :: boundary !< the line between them is part of the boundary
      real(wp) :: x(3), a(3, 2), angle, across(2), st(2)
      integer :: k
      a = ends/self%scale
      x = 0.5_wp*(a(:, 1) + a(:, 2))
      select case (self%kind)
      case (surface_flat)
         if (boundary .and. allocated(self%numbers)) then
            do k = 1, size(self%numbers)
               associate (r => self%numbers(k))
                  if (all(abs(norm2(a(:2, :), dim=1) - r) < near*r)) x(:2) = r*x(:2)/norm2(x(:2))
               end associate
            end do
         end if
      case (surface_cone)
         across = a([1, 3], 1)/norm2(a([1, 3], 1)) + a([1, 3], 2)/norm2(a([1, 3], 2))
         x([1, 3]) = across/norm2(across)*0.5_wp*sum(norm2(a([1, 3], :), dim=1))
      case (surface_sphere)
         associate (r => norm2(a(:, 1)))
            if (boundary .and. abs(a(3, 1) - a(3, 2)) < near*r .and. norm2(x(:2)) > near*r) then
               x(:2) = x(:2)*norm2(a(:2, 1))/norm2(x(:2))
            else
               x = r*x/norm2(x)
            end if
         end associate
      case (surface_paraboloid)
         x(3) = 0.5_wp*(self%numbers(1)*x(1)**2 + self%numbers(2)*x(2)**2) + self%numbers(3)*x(1)*x(2)
      case (surface_strip)
         do k = 1, 2
            angle = self%numbers(1)*a(1, k)
            across(k) = a(2, k)*cos(angle) + a(3, k)*sin(angle)
         end do
         angle = self%numbers(1)*x(1)
         x(2:) = 0.5_wp*sum(across)*[cos(angle), sin(angle)]
      case (surface_bilinear)
         st = 0.5_wp*(parameters_of(self, a(:, 1)) + parameters_of(self, a(:, 2)))
         x = bilinear(self, st)
      end select
      x = self%scale*x
   end function surface_middle

   !> A normal of the surface at one of its points, of any length, to the side of that of the generator's mesh; zero of flat ones.
   pure function surface_normal(self, x) result(n)
      type(surface_t), intent(in) :: self
      real(wp), intent(in) :: x(3)
      real(wp) :: n(3), a(3), d(3, 2), angle
      a = x/self%scale
      n = 0
      select case (self%kind)
      case (surface_cone); n = [a(1), -norm2(a([1, 3]))*self%numbers(1), a(3)]
      case (surface_sphere); n = a
      case (surface_paraboloid)
         associate (k => self%numbers)
            n = [-k(1)*a(1) - k(3)*a(2), -k(2)*a(2) - k(3)*a(1), 1.0_wp]
         end associate
      case (surface_strip)
         angle = self%numbers(1)*a(1)
         n = [-self%numbers(1)*(a(2)*cos(angle) + a(3)*sin(angle)), -sin(angle), cos(angle)]
      case (surface_bilinear)
         d = bilinear_tangents(self, parameters_of(self, a))
         n = cross_product(d(:, 1), d(:, 2))
      end select
   end function surface_normal

   pure function bilinear(self, st) result(x)
      type(surface_t), intent(in) :: self
      real(wp), intent(in) :: st(2)
      real(wp) :: x(3), c(3, 4)
      c = reshape(self%numbers, [3, 4])
      associate (s => st(1), t => st(2))
         x = (1 - s)*(1 - t)*c(:, 1) + s*(1 - t)*c(:, 2) + s*t*c(:, 3) + (1 - s)*t*c(:, 4)
      end associate
   end function bilinear

   pure function bilinear_tangents(self, st) result(d)
      type(surface_t), intent(in) :: self
      real(wp), intent(in) :: st(2)
      real(wp) :: d(3, 2), c(3, 4)
      c = reshape(self%numbers, [3, 4])
      associate (s => st(1), t => st(2))
         d(:, 1) = (1 - t)*(c(:, 2) - c(:, 1)) + t*(c(:, 3) - c(:, 4))
         d(:, 2) = (1 - s)*(c(:, 4) - c(:, 1)) + s*(c(:, 3) - c(:, 2))
      end associate
   end function bilinear_tangents

   !> Parameters of a point of the bilinear patch (Gauss-Newton: it lies on the patch).
   pure function parameters_of(self, x) result(st)
      type(surface_t), intent(in) :: self
      real(wp), intent(in) :: x(3)
      real(wp) :: st(2), d(3, 2), g(2), a(2, 2), step(2)
      integer :: i
      st = 0.5_wp
      do i = 1, most_iterations
         d = bilinear_tangents(self, st)
         a = matmul(transpose(d), d)
         g = matmul(x - bilinear(self, st), d)
         step = [a(2, 2)*g(1) - a(1, 2)*g(2), a(1, 1)*g(2) - a(2, 1)*g(1)]/(a(1, 1)*a(2, 2) - a(1, 2)*a(2, 1))
         st = st + step
         if (norm2(step) < 4*epsilon(1.0_wp)) exit
      end do
      ! a side is s or t = 0 or 1 but for rounding
      where (abs(st) < 1.0e-13_wp) st = 0
      where (abs(st - 1) < 1.0e-13_wp) st = 1
   end function parameters_of
end module finshell_surface
