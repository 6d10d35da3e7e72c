!> What a factorisation will cost, from the number of unknowns, without ordering them.
module finshell_effort
   use, intrinsic :: iso_fortran_env, only: int64
   use finshell_kinds, only: dp
   use finshell_lapack, only: dpotrf
   implicit none
   private
   public :: factorisation_seconds

contains

   !> Seconds of CPU time for the matrix of a shell on this machine: a dense factorisation says how fast it is. The formula is of
   !> shells with 10^4 to 3 10^5 unknowns and one thread, definite matrices; indefinite ones need up to twice as much.
   real(dp) function factorisation_seconds(unknowns) result(seconds)
      integer, intent(in) :: unknowns
      real(dp), parameter :: reference = 4.4e10_dp !< operations a second where the formula was measured
      seconds = unknowns*(0.65e-6_dp + 7.8e-9_dp*sqrt(real(unknowns, dp)))*reference/dense_speed()
   end function factorisation_seconds

   !> Operations a second of a dense factorisation: the best of a few.
   real(dp) function dense_speed() result(speed)
      integer, parameter :: n = 256, most = 5
      real(dp), allocatable :: a(:, :)
      real(dp) :: begun, ended
      integer :: i, info, k
      speed = 0
      allocate (a(n, n))
      do k = 1, most
         a = 1
         do i = 1, n
            a(i, i) = 2*n
         end do
         begun = clock()
         call dpotrf('L', n, a, n, info)
         ended = clock()
         speed = max(speed, real(n, dp)**3/3/max(ended - begun, 1e-6_dp))
      end do
   end function dense_speed

   real(dp) function clock()
      integer(int64) :: count, rate
      call system_clock(count, rate)
      clock = real(count, dp)/real(rate, dp)
   end function clock
end module finshell_effort
