!> A symmetric matrix cut into parts, each factorised by a thread of its own with CHOLMOD, and the Schur complement of what
!> separates them, factorised by LAPACK (substructuring; Smith, Bjorstad & Gropp 1996, ch. 4).
!>
!> Part k has its inner equations first and those of the separator that it touches last:  [A_kk A_kb; A_bk A_bb + D], D the
!> magnitudes of the diagonal. The corner L_bb of its factor L L^T gives L_bb L_bb^T = A_bb + D - A_bk A_kk^-1 A_kb, so the
!> complement is S = A_gg + sum (L_bb L_bb^T - A_bb - D). D keeps the corner positive definite where A is not. If all A_kk are
!> positive definite, A has the inertia of S with as many positive values more as there are inner equations (Haynsworth 1968): this
!> is a solver for matrices that are indefinite because of long waves, too. Where a part is not definite it refuses.
module finshell_parts
   use finshell_blas_threads, only: to_blas, to_openmp
   use finshell_cholmod, only: cholmod_t
   use finshell_direct_solver, only: direct_solver_t, pivots_t, threads_of
   use finshell_dissection, only: dissect, elimination_order, separator, sub_pattern
   use finshell_error, only: error_t, raise
   use finshell_fork, only: forked
   use finshell_kinds, only: dp
   use finshell_lapack, only: dpotrf, dpotrs, dlauum, dsytrf, dsytrs, dtrmv
   use finshell_sparsity, only: sparsity_t
   use finshell_status, only: status_invalid_argument
   implicit none
   private
   public :: parts_t

   integer, parameter :: most_parts = 8

   type :: part_t
      type(cholmod_t) :: solver
      integer :: inner = 0 !< equations
      integer, allocatable :: equation(:) !< in the order of elimination; behind the inner ones those of the separator
      integer, allocatable :: at(:) !< where the latter stand in the separator
      type(sparsity_t) :: own !< pattern
      integer, allocatable :: source(:) !< of its entries, among those of the matrix
      real(dp), allocatable :: corner(:, :) !< L_bb
      real(dp), allocatable :: share(:, :) !< of the complement, its rows and columns in reverse order
      real(dp), allocatable :: x(:, :) !< while a solution is made
      type(pivots_t) :: pivots
      type(error_t), allocatable :: error
   end type part_t

   type, extends(direct_solver_t) :: parts_t
      integer :: wanted = 0 !< parts; to be set before `analyse`; 0: as many as threads, up to eight
      integer, private :: n = 0
      type(part_t), allocatable, private :: part(:)
      integer, allocatable, private :: between(:) !< equations of the separator
      integer, allocatable, private :: source(:) !< of the entries between them, among those of the matrix
      type(sparsity_t), private :: inside !< pattern of these
      real(dp), allocatable, private :: schur(:, :) !< complement, then its factor
      real(dp), allocatable, private :: kept(:, :) !< the complement
      integer, allocatable, private :: pivot(:) !< of dsytrf; not allocated: Cholesky's factor
      logical, private :: ready = .false.
   contains
      procedure :: analyse
      procedure :: factorise
      procedure :: solve
      procedure :: memory
      procedure :: free
      procedure, private :: factorise_schur
      procedure, private :: copy
      generic :: assignment(=) => copy
   end type parts_t

contains

   !> See finshell_direct_solver. An order that is given is not used.
   subroutine analyse(self, pattern, order, error)
      class(parts_t), intent(inout) :: self
      type(sparsity_t), intent(in) :: pattern
      integer, allocatable, intent(inout) :: order(:)
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: part_of(:), place(:)
      integer :: i, k, parts

      call self%free()
      if (.not. pattern%symmetric) then
         call raise(error, status_invalid_argument, 'parts are for symmetric matrices')
         return
      end if
      self%n = pattern%n
      self%definite_only = .true.
      self%tries_all = .true.
      parts = self%wanted
      if (parts == 0) parts = min(most_parts, max(2, threads_of(self%options)))
      call dissect(pattern, parts, part_of, error)
      if (allocated(error)) return
      self%between = pack([(i, i=1, self%n)], part_of == separator)
      call sub_pattern(pattern, self%between, self%inside, self%source)
      allocate (self%schur(size(self%between), size(self%between)))
      allocate (place(self%n), source=0)
      place(self%between) = [(i, i=1, size(self%between))]
      parts = maxval(part_of)
      allocate (self%part(parts))
      call to_openmp()
      !$omp parallel do schedule(dynamic, 1) num_threads(members(parts)) default(shared)
      do k = 1, parts
         call analyse_part(self%part(k), pattern, part_of, k, place)
      end do
      !$omp end parallel do
      call first_error(self, error)
      if (allocated(error)) return
      if (allocated(order)) return
      allocate (order(0))
      do k = 1, parts
         order = [order, self%part(k)%equation(:self%part(k)%inner)]
      end do
      order = [order, self%between]
   end subroutine analyse

   !> Threads for so many parts; one in the child of a process that had several.
   integer function members(parts)
      integer, intent(in) :: parts
      members = parts
      if (forked()) members = 1
   end function members

   subroutine analyse_part(part, pattern, part_of, k, place)
      type(part_t), intent(inout) :: part
      type(sparsity_t), intent(in) :: pattern
      integer, intent(in) :: part_of(:), k
      integer, intent(in) :: place(:) !< (n) in the separator
      type(sparsity_t) :: own
      integer, allocatable :: inner(:), order(:), touched(:)
      logical :: touches(pattern%n)
      integer :: i, j, p

      inner = pack([(i, i=1, pattern%n)], part_of == k)
      touches = .false.
      do j = 1, pattern%n
         do p = pattern%column_pointer(j), pattern%column_pointer(j + 1) - 1
            i = pattern%row(p)
            if (part_of(i) == k .and. part_of(j) == separator) touches(j) = .true.
            if (part_of(j) == k .and. part_of(i) == separator) touches(i) = .true.
         end do
      end do
      touched = pack([(i, i=1, pattern%n)], touches)
      call sub_pattern(pattern, inner, own)
      call elimination_order(own, order, part%error)
      if (allocated(part%error)) return
      part%inner = size(inner)
      part%equation = [inner(order), touched]
      part%at = place(touched)
      call sub_pattern(pattern, part%equation, own, part%source)
      part%own = own
      part%solver%as_it_stands = .true.
      call part%solver%analyse(own, order, part%error)
      allocate (part%corner(size(touched), size(touched)), part%share(size(touched), size(touched)))
   end subroutine analyse_part

   !> See finshell_direct_solver.
   subroutine factorise(self, values, scale, definite, pivots, error)
      class(parts_t), intent(inout) :: self
      real(dp), intent(in), target, contiguous :: values(:)
      real(dp), intent(in) :: scale(:)
      logical, intent(in) :: definite
      type(pivots_t), intent(out) :: pivots
      type(error_t), allocatable, intent(out) :: error
      integer :: i, j, k, m, p

      self%ready = .false.
      self%schur = 0
      do j = 1, self%inside%n
         do p = self%inside%column_pointer(j), self%inside%column_pointer(j + 1) - 1
            self%schur(self%inside%row(p), j) = values(self%source(p))
         end do
      end do
      call to_openmp()
      !$omp parallel do schedule(dynamic, 1) num_threads(members(size(self%part))) default(shared)
      do k = 1, size(self%part)
         call factorise_part(self%part(k), values, scale)
      end do
      !$omp end parallel do
      call first_error(self, error)
      if (allocated(error)) return
      if (.not. all(self%part%pivots%ok)) then
         do k = 1, size(self%part)
            call self%part(k)%solver%release()
         end do
         return
      end if
      do k = 1, size(self%part)
         associate (part => self%part(k))
            m = size(part%at)
            do j = 1, m
               do i = j, m ! both ascend
                  self%schur(part%at(i), part%at(j)) = self%schur(part%at(i), part%at(j)) + part%share(m + 1 - i, m + 1 - j)
               end do
            end do
         end associate
      end do
      pivots%smallest = minval(self%part%pivots%smallest)
      pivots%negative = 0
      if (size(self%between) > 0) call self%factorise_schur(scale(self%between), definite, pivots)
      if (pivots%negative < 0) return
      pivots%determinant_sign = 1 - 2*mod(pivots%negative, 2)
      pivots%ok = .true.
      self%ready = .true.
   end subroutine factorise

   !> Factor of a part, and what it adds to the complement.
   subroutine factorise_part(part, values, scale)
      type(part_t), intent(inout) :: part
      real(dp), intent(in) :: values(:), scale(:) !< of the whole matrix
      real(dp), allocatable :: own(:), d(:)
      integer :: i, info, j, m, p

      own = values(part%source)
      do j = part%inner + 1, part%own%n
         p = part%own%column_pointer(j) ! the diagonal is the first of its column
         own(p) = own(p) + abs(own(p))
      end do
      call part%solver%factorise(own, scale(part%equation), .true., part%pivots, part%error)
      if (allocated(part%error) .or. .not. part%pivots%ok) return
      allocate (d(part%own%n))
      call part%solver%pivots_of(d)
      part%pivots%smallest = minval(d(:part%inner)/scale(part%equation(:part%inner))**2)
      m = size(part%at)
      if (m == 0) return
      call part%solver%corner(part%corner)
      ! L L^T, for which LAPACK has U U^T: both ways round
      part%share = part%corner(m:1:-1, m:1:-1)
      call dlauum('U', m, part%share, m, info)
      do j = 1, m
         do p = part%own%column_pointer(part%inner + j), part%own%column_pointer(part%inner + j + 1) - 1
            i = part%own%row(p) - part%inner
            part%share(m + 1 - i, m + 1 - j) = part%share(m + 1 - i, m + 1 - j) - own(p)
         end do
      end do
   end subroutine factorise_part

   !> Cholesky's factor of the complement if it is definite, else L D L^T with Bunch and Kaufman's pivots, which tell the inertia.
   subroutine factorise_schur(self, scale, definite, pivots)
      class(parts_t), intent(inout) :: self
      real(dp), intent(in) :: scale(:)
      logical, intent(in) :: definite
      type(pivots_t), intent(inout) :: pivots !< negative: -1 where the complement is singular
      real(dp), allocatable :: work(:)
      integer :: i, info, m

      m = size(self%schur, 1)
      if (allocated(self%pivot)) deallocate (self%pivot)
      call to_blas(self%options%threads)
      info = 1
      if (definite) then
         self%kept = self%schur
         call dpotrf('L', m, self%schur, m, info)
         if (info /= 0) self%schur = self%kept
      end if
      if (info == 0) then
         pivots%smallest = min(pivots%smallest, minval([(self%schur(i, i)**2/scale(i)**2, i=1, m)]))
      else
         allocate (self%pivot(m), work(64*m))
         call dsytrf('L', m, self%schur, m, self%pivot, work, size(work), info)
         if (info /= 0) then
            pivots%negative = -1
         else
            call count_signs(self%schur, self%pivot, scale, pivots)
         end if
      end if
      call to_openmp()
   end subroutine factorise_schur

   !> Signs of the pivots of one and two rows of dsytrf. Of two rows one is negative: they are taken where their determinant is.
   pure subroutine count_signs(s, pivot, scale, pivots)
      real(dp), intent(in) :: s(:, :), scale(:)
      integer, intent(in) :: pivot(:)
      type(pivots_t), intent(inout) :: pivots
      integer :: i
      real(dp) :: d(2), mean, off
      i = 1
      do while (i <= size(pivot))
         if (pivot(i) > 0) then
            d = s(i, i)
         else
            mean = 0.5_dp*(s(i, i) + s(i + 1, i + 1))
            off = hypot(0.5_dp*(s(i, i) - s(i + 1, i + 1)), s(i + 1, i))
            d = [mean + off, mean - off]
         end if
         if (pivot(i) > 0) d(2) = abs(d(2))
         pivots%negative = pivots%negative + count(d < 0)
         pivots%smallest = min(pivots%smallest, minval(abs(d))/scale(i)**2)
         i = i + merge(1, 2, pivot(i) > 0)
      end do
   end subroutine count_signs

   !> See finshell_direct_solver.
   subroutine solve(self, b, x, error)
      class(parts_t), intent(inout) :: self
      real(dp), intent(in), target, contiguous :: b(:, :)
      real(dp), intent(inout), target, contiguous :: x(:, :)
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: g(:, :)
      integer :: info, k, m

      if (.not. self%ready) then
         call raise(error, status_invalid_argument, 'solution asked for before a successful factorisation')
         return
      end if
      m = size(self%between)
      g = b(self%between, :)
      !$omp parallel do schedule(dynamic, 1) num_threads(members(size(self%part))) default(shared)
      do k = 1, size(self%part)
         call forward(self%part(k), b)
      end do
      !$omp end parallel do
      do k = 1, size(self%part)
         associate (part => self%part(k))
            g(part%at, :) = g(part%at, :) + part%x(part%inner + 1:, :)
         end associate
      end do
      if (m > 0 .and. .not. allocated(self%pivot)) call dpotrs('L', m, size(g, 2), self%schur, m, g, m, info)
      if (m > 0 .and. allocated(self%pivot)) call dsytrs('L', m, size(g, 2), self%schur, m, self%pivot, g, m, info)
      x(self%between, :) = g
      !$omp parallel do schedule(dynamic, 1) num_threads(members(size(self%part))) default(shared)
      do k = 1, size(self%part)
         call backward(self%part(k), g, x)
      end do
      !$omp end parallel do
      call first_error(self, error)
   end subroutine solve

   !> x: L^-1 b of the inner equations, and what they add to the right hand side of the complement, -A_bk A_kk^-1 b.
   subroutine forward(part, b)
      type(part_t), intent(inout) :: part
      real(dp), intent(in) :: b(:, :)
      real(dp), allocatable :: y(:, :)
      integer :: j, m
      m = size(part%at)
      allocate (y(part%own%n, size(b, 2)), source=0.0_dp)
      y(:part%inner, :) = b(part%equation(:part%inner), :)
      if (allocated(part%x)) deallocate (part%x)
      allocate (part%x(part%own%n, size(b, 2)))
      call part%solver%solve_lower(y, part%x, part%error)
      do j = 1, merge(size(b, 2), 0, m > 0)
         call dtrmv('L', 'N', 'N', m, part%corner, m, part%x(part%inner + 1:, j), 1)
      end do
   end subroutine forward

   !> The inner equations, those of the separator being known: L^T x = [y; L_bb^T x_b].
   subroutine backward(part, g, x)
      type(part_t), intent(inout) :: part
      real(dp), intent(in) :: g(:, :)
      real(dp), intent(inout) :: x(:, :)
      real(dp), allocatable :: y(:, :)
      integer :: j, m
      if (allocated(part%error)) return
      m = size(part%at)
      part%x(part%inner + 1:, :) = g(part%at, :)
      do j = 1, merge(size(g, 2), 0, m > 0)
         call dtrmv('L', 'T', 'N', m, part%corner, m, part%x(part%inner + 1:, j), 1)
      end do
      y = part%x
      call part%solver%solve_upper(y, part%x, part%error)
      x(part%equation(:part%inner), :) = part%x(:part%inner, :)
   end subroutine backward

   !> See finshell_direct_solver.
   real(dp) function memory(self)
      class(parts_t), intent(in) :: self
      integer :: k
      memory = 16*real(size(self%between), dp)**2
      do k = 1, size(self%part)
         memory = memory + self%part(k)%solver%memory() + 16*real(size(self%part(k)%at), dp)**2
      end do
   end function memory

   subroutine free(self)
      class(parts_t), intent(inout) :: self
      if (allocated(self%part)) deallocate (self%part)
      if (allocated(self%between)) deallocate (self%between)
      if (allocated(self%schur)) deallocate (self%schur)
      if (allocated(self%kept)) deallocate (self%kept)
      if (allocated(self%pivot)) deallocate (self%pivot)
      self%ready = .false.
   end subroutine free

   subroutine copy(self, other)
      class(parts_t), intent(inout) :: self
      class(parts_t), intent(in) :: other
      call self%free()
      self%options = other%options
      self%wanted = other%wanted
   end subroutine copy

   !> Of the parts.
   subroutine first_error(self, error)
      class(parts_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer :: k
      do k = 1, size(self%part)
         if (.not. allocated(self%part(k)%error)) cycle
         if (.not. allocated(error)) error = self%part(k)%error
         deallocate (self%part(k)%error)
      end do
   end subroutine first_error
end module finshell_parts
