!> Linear answers of a structure at an equilibrium state, where one quantity may be held fixed by letting the factor go:
!>
!>     [ K   -f ] [x]   [b]        K: the tangent at the state, f: change of the residual with the factor,
!>     [ c'   d ] [s] = [a]        c, d: derivatives of what is held fixed with respect to the unknowns and the factor
!>
!> The tangent is assembled at the state; the factors are those that the iteration has left, of the state before its last
!> correction. They are as near as that correction is small, so a few corrections of the solution from its residual make up for it
!> (each costs a back substitution). The residual is that of the bordered system, so that near limit points of the factor, where K
!> is nearly singular and the whole is not, the digits that the elimination of K loses come back. Factors that do not bring the
!> corrections down are replaced by those of the present matrix, in a solver of its own: the path finds its own as it left them.
!>
!> The adjoint system is the transposed one. Symmetric matrices share their factors with it, others are factorised once more.
module finshell_linear_response
   use finshell_equations, only: field_displacement, field_pressure
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: wp
   use finshell_ledger, only: entry_t
   use finshell_linear_solver, only: linear_solver_t
   use finshell_status, only: status_singular_matrix
   use finshell_symmetric_part, only: symmetric_part_t
   use finshell_tangent_factors, only: tangent_factors_t
   use finshell_transposed, only: multiply_transposed, transposed_values
   implicit none
   private
   public :: linear_response_t, border_row_t

   !> What is held fixed while the factor is let go.
   type :: border_row_t
      real(wp), allocatable :: f(:) !< (n) change of the residual with the factor
      real(wp), allocatable :: c(:) !< (n)
      real(wp) :: d = 0
   end type border_row_t

   !> What an evaluation at the state leaves in the problem, to be put back.
   type :: kept_t
      type(entry_t) :: entry
      real(wp), allocatable :: residual(:), rate(:), values(:), compliance(:), inflow(:), gradient(:, :), watched(:)
      real(wp), allocatable :: internal_force(:, :), external_force(:, :), bulge_force(:, :)
      real(wp) :: force_level = 0, moment_level = 0, misfit = 0, motion_stiffness = 0, watched_rate = 0
      integer :: assemblies = 0, force_evaluations = 0
   end type kept_t

   type :: linear_response_t
      integer :: solutions = 0, factorisations = 0 !< back substitutions, and factors of its own, since it began to count
      type(kept_t), private :: kept
      type(linear_solver_t), private :: solver(2) !< of the matrix; of the transposed one, where that is another
      type(symmetric_part_t), private :: half
      type(tangent_factors_t), private :: factors(2)
      logical, private :: ready(2) = .false., knows_pattern = .false.
      integer, private :: stage = 0
   contains
      procedure :: begin
      procedure :: solve
      procedure :: finish
   end type linear_response_t

   integer, parameter :: most_corrections = 12
   real(wp), parameter :: enough = 1.0e-11_wp !< next correction over the solution
   real(wp), parameter :: tolerable = 1.0e-9_wp !< last correction, where rounding lets no more
   real(wp), parameter :: contracting = 0.3_wp !< from one correction to the next

contains

   !> The tangent at the state of the problem, and the rate with a factor. Errors: those of the elements.
   subroutine begin(self, problem, scaling, error)
      class(linear_response_t), intent(inout) :: self
      type(equilibrium_t), intent(inout) :: problem
      integer, intent(in) :: scaling !< finshell_factor
      type(error_t), allocatable, intent(out) :: error
      associate (k => self%kept)
         k%entry = problem%entry
         k%residual = problem%residual
         k%rate = problem%rate
         k%values = problem%values
         k%internal_force = problem%internal_force
         k%external_force = problem%external_force
         if (allocated(problem%bulge_force)) k%bulge_force = problem%bulge_force
         if (allocated(problem%compliance)) k%compliance = problem%compliance
         if (allocated(problem%inflow)) k%inflow = problem%inflow
         if (allocated(problem%gradient)) k%gradient = problem%gradient
         if (allocated(problem%watched)) k%watched = problem%watched
         k%force_level = problem%force_level
         k%moment_level = problem%moment_level
         k%misfit = problem%misfit
         k%motion_stiffness = problem%motion_stiffness
         k%watched_rate = problem%watched_rate
         k%assemblies = problem%assemblies
         k%force_evaluations = problem%force_evaluations
      end associate
      self%ready = .false.
      if (self%stage /= problem%stage) self%knows_pattern = .false.
      self%stage = problem%stage
      call problem%evaluate(.true., error, scaling=scaling)
   end subroutine begin

   !> Leave the problem as it was.
   subroutine finish(self, problem)
      class(linear_response_t), intent(inout) :: self
      type(equilibrium_t), intent(inout) :: problem
      associate (k => self%kept)
         problem%entry = k%entry
         call move_alloc(k%residual, problem%residual)
         call move_alloc(k%rate, problem%rate)
         call move_alloc(k%values, problem%values)
         call move_alloc(k%internal_force, problem%internal_force)
         call move_alloc(k%external_force, problem%external_force)
         if (allocated(k%bulge_force)) call move_alloc(k%bulge_force, problem%bulge_force)
         if (allocated(k%compliance)) call move_alloc(k%compliance, problem%compliance)
         if (allocated(k%inflow)) call move_alloc(k%inflow, problem%inflow)
         if (allocated(k%gradient)) call move_alloc(k%gradient, problem%gradient)
         if (allocated(k%watched)) call move_alloc(k%watched, problem%watched)
         problem%force_level = k%force_level
         problem%moment_level = k%moment_level
         problem%misfit = k%misfit
         problem%motion_stiffness = k%motion_stiffness
         problem%watched_rate = k%watched_rate
         problem%assemblies = k%assemblies
         problem%force_evaluations = k%force_evaluations
      end associate
   end subroutine finish

   !> Solve K x = b or, with a row, the bordered system; with `adjoint` the transposed system of the same row. Errors: the matrix,
   !> or the bordered one, is singular or too near.
   subroutine solve(self, problem, b, x, error, row, a, s, adjoint)
      class(linear_response_t), intent(inout) :: self
      type(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: b(:) !< (n)
      real(wp), intent(out) :: x(:) !< (n)
      type(error_t), allocatable, intent(out) :: error
      type(border_row_t), intent(in), optional :: row
      real(wp), intent(in), optional :: a
      real(wp), intent(out), optional :: s
      logical, intent(in), optional :: adjoint
      type(border_row_t) :: border
      real(wp) :: right, factor
      integer :: which
      logical :: ok, transposed

      transposed = .false.
      if (present(adjoint)) transposed = adjoint
      right = 0
      if (present(a)) right = a
      if (present(row)) then
         border = row
         if (transposed) then
            border%f = -row%c
            border%c = -row%f
         end if
      end if
      transposed = transposed .and. .not. problem%external%symmetric
      which = merge(2, 1, transposed)
      ok = .false.
      if (.not. (transposed .or. self%ready(1))) call iterate(0, ok)
      if (.not. ok) then
         if (allocated(error)) deallocate (error)
         call factorise_anew(self, problem, which, error)
         if (.not. allocated(error)) call iterate(which, ok)
         if (.not. (ok .or. allocated(error))) call raise(error, status_singular_matrix, 'the matrix is too near to singular')
      end if
      if (present(s)) s = factor

   contains

      !> Corrections with the factors that the iteration has left (0) or with own ones.
      subroutine iterate(factors, ok)
         integer, intent(in) :: factors
         logical, intent(out) :: ok
         real(wp) :: left(size(b)), dx(size(b)), along(size(b)), product(size(b))
         real(wp) :: gap, ds, before, size_of, pivot
         integer :: k
         ok = .false.
         x = 0
         factor = 0
         left = b
         gap = right
         along = 0
         pivot = 0
         if (present(row)) then
            call by_factors(self, problem, factors, border%f, along, error)
            if (allocated(error)) return
            pivot = dot_product(border%c, along) + border%d
            if (.not. abs(pivot) > 0) return
         end if
         before = huge(1.0_wp)
         do k = 1, most_corrections
            call by_factors(self, problem, factors, left, dx, error)
            if (allocated(error)) return
            if (present(row)) then
               ds = (gap - dot_product(border%c, dx))/pivot
               dx = dx + ds*along
               factor = factor + ds
            end if
            x = x + dx
            size_of = part_of(problem, dx, x, factor*along)
            ! what the next correction would be
            ok = size_of*min(1.0_wp, size_of/before) <= enough
            if (ok .or. .not. size_of <= huge(1.0_wp)) return
            if (size_of > contracting*before) then
               ok = size_of <= tolerable
               return
            end if
            before = size_of
            call times(problem, x, product, transposed)
            left = b - product
            if (.not. present(row)) cycle
            left = left + factor*border%f
            gap = right - dot_product(border%c, x) - border%d*factor
         end do
         ok = before <= tolerable
      end subroutine iterate
   end subroutine solve

   !> The largest share of a correction in the solution, or in the two parts that it may be the difference of, of displacements,
   !> rotations and pressures each.
   pure real(wp) function part_of(problem, dx, x, other) result(part)
      type(equilibrium_t), intent(in) :: problem
      real(wp), intent(in) :: dx(:), x(:), other(:)
      real(wp) :: whole
      integer :: field
      part = 0
      do field = int(field_displacement), int(field_pressure)
         whole = sqrt(sum(x**2, mask=problem%field == field)) &
                 + sqrt(sum(other**2, mask=problem%field == field))
         if (whole > 0) part = max(part, sqrt(sum(dx**2, mask=problem%field == field))/whole)
      end do
   end function part_of

   subroutine by_factors(self, problem, factors, b, x, error)
      class(linear_response_t), intent(inout) :: self
      type(equilibrium_t), intent(inout) :: problem
      integer, intent(in) :: factors
      real(wp), intent(in), contiguous :: b(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: column(size(b), 1)
      self%solutions = self%solutions + 1
      if (factors == 0 .and. .not. allocated(problem%gradient) .and. problem%solver%ready) then
         ! without refinement, which would be that of another matrix
         call problem%solver%backend(reshape(b, [size(b), 1]), column, error)
         if (.not. allocated(error)) x = column(:, 1)
      else if (factors == 0) then
         call problem%solve(b, x, error)
      else
         call self%factors(factors)%solve(self%solver(factors), self%half, b, x, error)
      end if
   end subroutine by_factors

   !> The matrix at the state, bordered by the pressures of chambers (finshell_bordered), times x.
   subroutine times(problem, x, y, transposed)
      type(equilibrium_t), intent(in) :: problem
      real(wp), intent(in) :: x(:)
      real(wp), intent(out), contiguous :: y(:)
      logical, intent(in) :: transposed
      integer :: n
      n = problem%equations%n
      associate (pattern => problem%solver%pattern)
         if (transposed) then
            call multiply_transposed(pattern, problem%values, x(:n), y(:n))
         else
            call pattern%multiply(problem%values, x(:n), y(:n))
         end if
      end associate
      if (.not. (allocated(problem%gradient) .and. size(x) > n)) return
      y(:n) = y(:n) - matmul(problem%gradient, x(n + 1:))
      y(n + 1:) = -matmul(transpose(problem%gradient), x(:n)) - problem%compliance*x(n + 1:)
   end subroutine times

   !> Factors of the matrix at the state, or of the transposed one.
   subroutine factorise_anew(self, problem, which, error)
      class(linear_response_t), intent(inout) :: self
      type(equilibrium_t), intent(inout) :: problem
      integer, intent(in) :: which !< 1: of the matrix itself
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: values(:)
      if (self%ready(which)) return
      if (.not. self%knows_pattern) then
         self%solver(1) = problem%solver
         self%solver(2) = problem%solver
         self%knows_pattern = .true.
      end if
      self%factorisations = self%factorisations + 1
      associate (p => problem)
         values = p%values
         if (which == 2) values = transposed_values(p%solver%pattern, p%values)
         call self%factors(which)%factorise(self%solver(which), self%half, values, p%diagonal_places(), p%weight, &
                                            gradient=p%gradient, compliance=p%compliance, team=p%team, error=error)
      end associate
      self%ready(which) = .not. allocated(error)
      if (allocated(error)) error%message = 'the tangent is singular: '//error%message//' ('//text_of(problem%n)//' unknowns)'
   end subroutine factorise_anew
end module finshell_linear_response
