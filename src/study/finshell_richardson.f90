!> Errors of a value that was computed on meshes of halved size, by Richardson's extrapolation with the order that is observed.
!>
!> On three meshes that follow value = limit + C 2**(-order level) the three unknowns come from the three values; the last three
!> count. Where they do not come monotonically nearer there is no order, and no more is said than how the values differ.
module finshell_richardson
   use finshell_kinds, only: wp
   implicit none
   private
   public :: estimate_t, estimate_errors

   type :: estimate_t
      !> The last three values behave: `order` and `limit` are those of their law. Otherwise limit is the last value.
      logical :: asymptotic = .false.
      logical :: settled = .false. !< no difference but rounding
      real(wp) :: order = 0 !< observed; 0: not known
      real(wp) :: limit = 0
      real(wp), allocatable :: error(:) !< of each value, absolute; -1: nothing is known
   end type estimate_t

   !> Below half an order there is no telling where the values end.
   real(wp), parameter :: lowest_order = 0.5_wp
   !> That of the elements. A higher one seen on three meshes is chance and would promise too much; a much higher one means that a
   !> difference is small because values pass by each other.
   real(wp), parameter :: usual_order = 2, most_plausible = 3
   real(wp), parameter :: rounding = 1.0e-10_wp !< of the largest value

contains

   !> Values on meshes of the sizes 2**(-level), levels ascending. An error is never smaller than `noise`.
   pure function estimate_errors(levels, values, noise) result(estimate)
      integer, intent(in) :: levels(:)
      real(wp), intent(in) :: values(:)
      real(wp), intent(in), optional :: noise !< absolute error of a value that has nothing to do with the mesh
      type(estimate_t) :: estimate
      real(wp) :: last
      integer :: n

      n = size(values)
      allocate (estimate%error(n), source=-1.0_wp)
      if (n == 0) return
      estimate%limit = values(n)
      if (n == 1) return
      associate (d => values(n) - values(n - 1), gap => levels(n) - levels(n - 1))
         if (maxval(values) - minval(values) <= rounding*maxval(abs(values))) then
            estimate%settled = .true.
            estimate%asymptotic = .true.
            estimate%error = 0
         else
            if (n > 2) estimate%order = observed_order(levels(n - 2:), values(n - 2:))
            estimate%asymptotic = estimate%order >= lowest_order .and. estimate%order <= most_plausible
            if (estimate%asymptotic) then
               estimate%limit = values(n) + left_behind(d, gap, min(estimate%order, usual_order))
               estimate%error = abs(values - estimate%limit)
            else
               last = remainder(levels, values, estimate%order)
               if (estimate%order > 0) then ! all on one side
                  estimate%error = abs(values - values(n)) + last
               else
                  estimate%error = max(abs(values - values(n)), last)
               end if
            end if
         end if
      end associate
      if (present(noise)) estimate%error = max(estimate%error, noise)
   end function estimate_errors

   !> What lies behind the last value after a difference d to the one before, if differences shrink with an order.
   pure real(wp) function left_behind(d, gap, order)
      real(wp), intent(in) :: d, order
      integer, intent(in) :: gap !< levels between the two values
      left_behind = d/(2**(order*gap) - 1)
   end function left_behind

   !> Error of the last value where there is no law: what second order leaves of the last two differences, as one alone may be small
   !> by chance; but where they are slow, or go to and fro, no less than what they show.
   pure real(wp) function remainder(levels, values, order)
      integer, intent(in) :: levels(:)
      real(wp), intent(in) :: values(:), order
      integer :: k, n
      n = size(values)
      remainder = 0
      do k = max(1, n - 2), n - 1
         associate (d => abs(values(k + 1) - values(k)), gap => levels(k + 1) - levels(k), since => levels(n) - levels(k + 1))
            remainder = max(remainder, left_behind(d, gap, usual_order)*0.25_wp**since)
         end associate
      end do
      if (order > most_plausible) return
      associate (d => abs(values(n) - values(n - 1)), gap => levels(n) - levels(n - 1))
         if (order > 0) remainder = max(remainder, left_behind(d, gap, lowest_order))
         remainder = max(remainder, d)
      end associate
   end function remainder

   !> Order of three values, 0 where they do not come monotonically nearer.
   pure real(wp) function observed_order(levels, values) result(order)
      integer, intent(in) :: levels(3)
      real(wp), intent(in) :: values(3)
      real(wp) :: ratio, low, high
      integer :: i
      order = 0
      if (.not. abs(values(3) - values(2)) > 0) return
      ratio = (values(2) - values(1))/(values(3) - values(2))
      if (.not. ratio > quotient(0.01_wp)) return
      low = 0.01_wp
      high = 20
      do i = 1, 60
         order = 0.5_wp*(low + high)
         if (quotient(order) < ratio) then
            low = order
         else
            high = order
         end if
      end do

   contains

      !> Of the differences, for an order.
      pure real(wp) function quotient(p)
         real(wp), intent(in) :: p
         associate (l => levels - levels(1))
            quotient = (1 - 2**(-p*l(2)))/(2**(-p*l(2)) - 2**(-p*l(3)))
         end associate
      end function quotient
   end function observed_order
end module finshell_richardson
