!> The scalar equation that closes an increment: load factor, displacement, volume or length of the increment is prescribed.
!>
!> With the correction split as x = eta x_r + change x_t, where K x_r = residual and K x_t = rate, one factorisation serves all
!> all; each gives the change of the factor. Load control needs the sum only, so a single solve.
module finshell_control
   use finshell_kinds, only: wp, i1
   use finshell_equations, only: field_displacement
   use finshell_factor, only: by_load_factor
   use finshell_step, only: control_load, control_displacement, control_arc_length, control_volume
   implicit none
   private
   public :: constraint_t, factor_change, arc_norm, arc_product, control_vector

   !> Besides the controls of a step: the part of the increment along a vector is prescribed (start of a branch).
   integer, parameter :: control_vector = 21

   type :: constraint_t
      integer :: control = control_load
      integer :: scaling = by_load_factor !< the factor that changes (finshell_factor)
      real(wp) :: target = 0 !< load factor, monitored displacement or volume, length of the increment, or its part along a vector
      real(wp) :: load_weight = 0 !< arc-length: length**2 = |displacements|**2 + load_weight * (change of factor)**2
      !> Arc-length without a predictor: the increment before, whose direction the first correction keeps.
      real(wp), allocatable :: previous(:)
      real(wp) :: previous_change = 0
      real(wp), allocatable :: vector(:) !< control_vector; over the displacements
      real(wp) :: sense = 1 !< of the factor, when there is no increment before
   end type constraint_t

contains

   !> Change of the factor that satisfies the constraint after the correction. `eta` < 1 shortens x_r where the arc-length has no
   !> real solution; `ok` is false where nothing helps.
   pure subroutine factor_change(self, field, x_r, x_t, increment, increment_change, factor, monitored, watched, watched_rate, &
                                 change, eta, ok)
      type(constraint_t), intent(in) :: self
      integer(i1), intent(in) :: field(:)
      real(wp), intent(in) :: x_r(:), x_t(:)
      real(wp), intent(in) :: increment(:), increment_change !< of the unknowns and of the factor, since the last converged state
      real(wp), intent(in) :: factor !< at the iterate
      real(wp), intent(in) :: monitored !< monitored quantity at the iterate
      real(wp), intent(in) :: watched(:), watched_rate !< its derivatives; size 0 when there is none
      real(wp), intent(out) :: change, eta
      logical, intent(out) :: ok
      real(wp) :: slope, norm

      eta = 1
      ok = .true.
      select case (self%control)
      case (control_displacement, control_volume)
         slope = dot_product(watched, x_t) + watched_rate
         ok = abs(slope) > 0
         change = 0
         if (ok) change = (self%target - monitored - dot_product(watched, x_r))/slope
      case (control_vector)
         norm = arc_product(self%vector, self%vector, field)
         slope = arc_product(self%vector, x_t, field)
         ok = abs(slope) > 0
         change = 0
         if (ok) change = (self%target*norm - arc_product(self%vector, increment + x_r, field))/slope
      case (control_arc_length)
         call arc_change(self, field, x_r, x_t, increment, increment_change, change, eta, ok)
      case default
         change = self%target - factor
      end select
   end subroutine factor_change

   !> Arc-length (Crisfield; root by Ritto-Correa and Camotim 2008, which is the root with the larger b0 * change; partial
   !> correction where the roots are complex; predictor sign by the increment before, Feng 1995).
   pure subroutine arc_change(self, field, x_r, x_t, increment, increment_change, change, eta, ok)
      type(constraint_t), intent(in) :: self
      integer(i1), intent(in) :: field(:)
      real(wp), intent(in) :: x_r(:), x_t(:), increment(:), increment_change
      real(wp), intent(out) :: change, eta
      logical, intent(out) :: ok
      real(wp) :: a0, b0, b1, c0, c1, c2, s, direction, a, b, c, discriminant, root, first, second

      eta = 1
      change = 0
      s = self%target
      a0 = arc_product(x_t, x_t, field) + self%load_weight
      ok = a0 > 0
      if (.not. ok) return
      if (.not. arc_product(increment, increment, field) + self%load_weight*increment_change**2 > 0) then
         direction = self%sense
         if (allocated(self%previous)) &
            direction = arc_product(self%previous, x_t, field) + self%load_weight*self%previous_change
         change = sign(s/sqrt(a0), direction)
         return
      end if
      b0 = 2*(arc_product(increment, x_t, field) + self%load_weight*increment_change)
      b1 = 2*arc_product(x_r, x_t, field)
      c0 = arc_product(increment, increment, field) + self%load_weight*increment_change**2 - s**2
      c1 = 2*arc_product(increment, x_r, field)
      c2 = arc_product(x_r, x_r, field)
      discriminant = (b0 + b1)**2 - 4*a0*(c0 + c1 + c2)
      if (discriminant < 0) then
         a = b1**2 - 4*a0*c2
         b = 2*b0*b1 - 4*a0*c1
         c = b0**2 - 4*a0*c0
         root = b**2 - 4*a*c
         ok = root >= 0 .and. abs(a) > 0
         if (.not. ok) return
         eta = max((-b + sqrt(root))/(2*a), (-b - sqrt(root))/(2*a))
         ok = eta > 0.05_wp .and. eta <= 1
         if (.not. ok) return
         change = -(b0 + eta*b1)/(2*a0)
         return
      end if
      root = sqrt(discriminant)
      first = (-(b0 + b1) + root)/(2*a0)
      second = (-(b0 + b1) - root)/(2*a0)
      change = first
      if (b0*second > b0*first) change = second
   end subroutine arc_change

   !> Scalar product over the displacement components: the length of an increment leaves rotations out.
   pure function arc_product(a, b, field) result(product)
      real(wp), intent(in) :: a(:), b(:)
      integer(i1), intent(in) :: field(:)
      real(wp) :: product
      integer :: i
      product = 0
      do i = 1, size(a)
         if (field(i) == field_displacement) product = product + a(i)*b(i)
      end do
   end function arc_product

   pure function arc_norm(x, field, factor_change, load_weight) result(length)
      real(wp), intent(in) :: x(:)
      integer(i1), intent(in) :: field(:)
      real(wp), intent(in) :: factor_change, load_weight
      real(wp) :: length
      length = sqrt(arc_product(x, x, field) + load_weight*factor_change**2)
   end function arc_norm
end module finshell_control
