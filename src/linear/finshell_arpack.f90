!> ARPACK: eigenvalues of a symmetric pencil by Lanczos with implicit restarts (Lehoucq, Sorensen & Yang, ARPACK Users' Guide).
module finshell_arpack
   use finshell_kinds, only: dp
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_invalid_argument
   implicit none
   private
   public :: pencil_t, lanczos

   !> K x = lambda A x, both symmetric. K is positive definite, or A is semidefinite and K - shift A not singular.
   type, abstract :: pencil_t
      logical :: of_masses = .false. !< the latter: lengths are measured by A, and the shift may be 0
   contains
      procedure(apply_interface), deferred :: apply
      procedure(metric_interface), deferred :: metric
   end type pencil_t

   abstract interface
      !> y = K^-1 A x without shift, y = (K - shift A)^-1 K x with one; kx = K x is at hand. Of masses, y = (K - shift A)^-1 kx and
      !> kx = A x. An error ends the iteration.
      subroutine apply_interface(self, x, kx, y, error)
         import :: pencil_t, dp, error_t
         class(pencil_t), intent(inout) :: self
         real(dp), intent(in), contiguous :: x(:), kx(:)
         real(dp), intent(inout), contiguous :: y(:)
         type(error_t), allocatable, intent(inout) :: error
      end subroutine apply_interface

      !> y = K x; of masses, y = A x.
      subroutine metric_interface(self, x, y)
         import :: pencil_t, dp
         class(pencil_t), intent(in) :: self
         real(dp), intent(in), contiguous :: x(:)
         real(dp), intent(inout), contiguous :: y(:)
      end subroutine metric_interface
   end interface

   interface
      subroutine dsaupd(ido, bmat, n, which, nev, tol, resid, ncv, v, ldv, iparam, ipntr, workd, workl, lworkl, info)
         import :: dp
         integer, intent(inout) :: ido
         character(len=1), intent(in) :: bmat
         integer, intent(in) :: n, nev, ncv, ldv, lworkl
         character(len=2), intent(in) :: which
         real(dp), intent(inout) :: tol, resid(n), v(ldv, ncv), workd(3*n), workl(lworkl)
         integer, intent(inout) :: iparam(11), ipntr(11), info
      end subroutine dsaupd

      subroutine dseupd(rvec, howmny, select, d, z, ldz, sigma, bmat, n, which, nev, tol, resid, ncv, v, ldv, iparam, ipntr, &
                        workd, workl, lworkl, info)
         import :: dp
         logical, intent(in) :: rvec
         character(len=1), intent(in) :: howmny, bmat
         integer, intent(in) :: ldz, n, ncv, ldv, lworkl
         integer, intent(inout) :: nev
         logical, intent(inout) :: select(ncv)
         real(dp), intent(inout) :: d(nev), z(ldz, nev), tol, resid(n), v(ldv, ncv), workd(3*n), workl(lworkl)
         real(dp), intent(in) :: sigma
         character(len=2), intent(in) :: which
         integer, intent(inout) :: iparam(11), ipntr(11), info
      end subroutine dseupd
   end interface

contains

   !> Eigenvalues lambda: without shift the lowest positive ones (after them negative ones, from minus infinity), with a shift those
   !> next to it. Those that have converged are given, in any order, with vectors of unit length in K; of masses, in A.
   !> Errors: what `apply` raised; wrong sizes.
   subroutine lanczos(pencil, n, wanted, shift, values, vectors, least, error)
      class(pencil_t), intent(inout) :: pencil
      integer, intent(in) :: n !< unknowns
      integer, intent(in) :: wanted !< number of eigenvalues, less than n
      real(dp), intent(in) :: shift !< 0: none
      real(dp), allocatable, intent(out) :: values(:)
      real(dp), allocatable, intent(out) :: vectors(:, :) !< (n, size(values))
      real(dp), intent(out) :: least !< without shift: the smallest magnitude of an eigenvalue that was seen
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: most_restarts = 300, maximum_iterations_reached = 1, no_shifts = 3
      integer, parameter :: inverse = 3, buckling = 4 ! the modes of ARPACK
      real(dp), allocatable :: v(:, :), work(:), small(:), residual(:), d(:), z(:, :), kx(:), y(:)
      logical, allocatable :: chosen(:)
      logical :: beside
      character(len=2) :: part
      real(dp) :: tolerance
      integer :: parameters(11), at(11), ido, info, found, basis, i, seed

      least = 0
      basis = min(n, max(2*wanted + 10, 20))
      if (wanted < 1 .or. wanted >= basis) then
         call raise(error, status_invalid_argument, text_of(wanted)//' eigenvalues were asked for of '//text_of(n)//' unknowns')
         return
      end if
      beside = abs(shift) > 0 .or. pencil%of_masses
      part = merge('LM', 'LA', beside)
      tolerance = 1e-9_dp
      allocate (v(n, basis), work(3*n), small(basis*(basis + 8)), residual(n), chosen(basis), kx(n), y(n))
      parameters = 0
      parameters(1) = 1 ! exact shifts
      parameters(3) = most_restarts
      parameters(7) = merge(buckling, inverse, beside .and. .not. pencil%of_masses)
      at = 0
      ido = 0
      info = 1 ! the first vector is given: numbers without pattern, the same ones every time
      seed = 4711
      do i = 1, n
         seed = mod(1103*seed + 12721, 65536)
         residual(i) = real(seed, dp)/32768 - 1
      end do
      do
         call dsaupd(ido, 'G', n, part, wanted, tolerance, residual, basis, v, n, parameters, at, work, small, size(small), info)
         select case (ido)
         case (-1)
            call pencil%metric(work(at(1):at(1) + n - 1), kx)
            call pencil%apply(work(at(1):at(1) + n - 1), kx, y, error)
            work(at(2):at(2) + n - 1) = y
         case (1)
            kx = work(at(3):at(3) + n - 1)
            call pencil%apply(work(at(1):at(1) + n - 1), kx, y, error)
            work(at(2):at(2) + n - 1) = y
         case (2)
            call pencil%metric(work(at(1):at(1) + n - 1), y)
            work(at(2):at(2) + n - 1) = y
         case default
            exit
         end select
         if (allocated(error)) return
      end do
      if (info < 0) then
         call raise(error, status_invalid_argument, 'ARPACK failed with status '//text_of(info))
         return
      end if
      found = parameters(5)
      if (.not. beside) least = 1/maxval(abs(small(at(6):at(6) + basis - 1)))
      if (found == 0 .or. (info /= 0 .and. info /= maximum_iterations_reached .and. info /= no_shifts)) then
         allocate (values(0), vectors(n, 0))
         return
      end if
      allocate (d(wanted), z(n, wanted))
      found = wanted
      call dseupd(.true., 'A', chosen, d, z, n, shift, 'G', n, part, found, tolerance, residual, basis, v, n, parameters, at, &
                  work, small, size(small), info)
      if (info /= 0) then
         call raise(error, status_invalid_argument, 'ARPACK failed with status '//text_of(info)//' at the end')
         return
      end if
      found = min(wanted, parameters(5))
      values = d(:found)
      vectors = z(:, :found)
   end subroutine lanczos
end module finshell_arpack
