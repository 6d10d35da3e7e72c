!> An observer that keeps what is reported last.
module bench_error_keeper
   use finshell_error, only: error_t
   use finshell_observer, only: observer_t, record_t
   use finshell_state, only: linear_change_t, state_t
   implicit none
   private
   public :: keeper_t

   type, extends(observer_t) :: keeper_t
      type(state_t) :: state
      type(linear_change_t), allocatable :: change
   contains
      procedure :: increment
   end type keeper_t

contains

   subroutine increment(self, state, record, error, change)
      class(keeper_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t), intent(in), optional, target :: change
      self%state = state
      if (allocated(self%change)) deallocate (self%change)
      if (present(change)) self%change = change
   end subroutine increment
end module bench_error_keeper

!> Estimated against true error of a mesh: for bench/effectivity.py.
!>
!>     bench_error INPUT.nml LEVELS REFERENCE_LEVELS
!>
!> The mesh of the input, refined so many times (negative: coarser), is compared with a much finer one, the reference. The true
!> error is the energy of the difference of the strains, those of the reference smoothed. A line for the mesh: elements,
!> estimated and true relative error in the energy norm, their ratio, that of membrane and of bending parts alone; of the first
!> monitor its value and its true error, and the estimates of that error: signed, and the bound.
program bench_error
   use, intrinsic :: iso_fortran_env, only: error_unit
   use bench_error_keeper, only: keeper_t
   use finshell_equilibrium, only: equilibrium_t, new_equilibrium
   use finshell_error, only: error_t
   use finshell_error_indicator, only: estimate_error, estimate_goal_error, goal_t, indicator_t, monitor_gradient, strain_defects, &
      strains_of, surface_strains_t
   use finshell_input, only: input_t, read_input
   use finshell_kinds, only: wp
   use finshell_linear_step, only: solve_linear
   use finshell_monitoring, only: monitored_values, new_watch, watch_t
   use finshell_normals, only: facet_normal
   use finshell_path, only: path_t
   use finshell_result_fields, only: find_field
   use finshell_step, only: control_linear
   use finshell_strain_batch, only: strain_points
   use finshell_strain_patch, only: turned_strain
   implicit none

   type :: solution_t
      type(input_t) :: input
      type(equilibrium_t) :: problem
      type(keeper_t) :: keeper
      type(surface_strains_t) :: strains
      real(wp) :: energy = 0, monitor = 0
      type(watch_t) :: watch
   end type solution_t

   type(solution_t), target :: mesh, reference
   type(indicator_t) :: indicator
   type(goal_t) :: goal
   type(error_t), allocatable :: error
   real(wp), allocatable :: gradient(:), defect(:, :, :)
   real(wp) :: squares(3), estimated(3), energy
   character(len=300) :: name, argument
   integer :: e, levels(2)

   call get_command_argument(1, name)
   do e = 1, 2
      call get_command_argument(1 + e, argument)
      read (argument, *) levels(e)
   end do
   call solve(trim(name), levels(1), mesh)
   call solve(trim(name), levels(2), reference)
   call estimate_error(mesh%problem, mesh%keeper%state, indicator, mesh%keeper%change)
   call strain_defects(mesh%problem, mesh%strains, defect)
   estimated = 0
   do e = 1, size(defect, 3)
      estimated = estimated + [energies(mesh%strains, e, mesh%strains%area(e)/6, defect(:, 1, e)) &
         + energies(mesh%strains, e, mesh%strains%area(e)/6, defect(:, 2, e)) &
         + energies(mesh%strains, e, mesh%strains%area(e)/6, defect(:, 3, e))]
   end do
   call compare(squares)
   energy = reference%energy
   write (*, '(i9,2es12.4,3f9.3)', advance='no') size(mesh%strains%area), indicator%relative, sqrt(squares(1)/energy), &
      indicator%total/sqrt(squares(1)), sqrt(estimated(2:3)/max(squares(2:3), tiny(1.0_wp)))
   if (mesh%input%monitors(1)%quantity /= find_field('displacement')) then
      write (*, '(a)') '  -'
      stop
   end if
   call monitor_gradient(mesh%problem, mesh%watch%nodes, mesh%watch%component, gradient)
   gradient = mesh%watch%factor*gradient
   call estimate_goal_error(mesh%problem, gradient, goal, error, mesh%keeper%change)
   call check()
   write (*, '(4es13.4)') mesh%monitor, reference%monitor - mesh%monitor, goal%change, goal%bound

contains

   subroutine solve(name, finer, s)
      character(len=*), intent(in) :: name
      integer, intent(in) :: finer
      type(solution_t), intent(inout), target :: s
      type(path_t) :: path
      real(wp) :: values(1)
      logical :: missing(1)
      integer :: i
      call read_input(name, s%input, error, finer)
      call check()
      call new_equilibrium(s%problem, s%input%structure, error)
      call check()
      do i = 1, size(s%input%steps)
         if (s%input%steps(i)%control == control_linear) then
            call solve_linear(s%problem, s%input%steps(i), s%keeper, error)
         else
            call path%follow(s%problem, s%input%steps(i), s%keeper, error)
         end if
         call check()
      end do
      call strains_of(s%problem, s%keeper%state, s%strains, s%energy, s%keeper%change)
      call new_watch(s%watch, s%input%monitors(1), s%input%structure%mesh)
      call monitored_values(s%problem, s%keeper%state, [s%watch], values, missing, change=s%keeper%change)
      s%monitor = values(1)
   end subroutine solve

   !> Half the work of stiffness and a strain, times a weight: all, membrane and bending alone.
   pure function energies(strains, e, weight, d) result(work)
      type(surface_strains_t), intent(in) :: strains
      integer, intent(in) :: e
      real(wp), intent(in) :: weight, d(6)
      real(wp) :: work(3)
      associate (k => strains%stiffness(:, :, e))
         work = weight*[dot_product(d, matmul(k, d)), dot_product(d(:3), matmul(k(:3, :3), d(:3))), &
                        dot_product(d(4:), matmul(k(4:, 4:), d(4:)))]
      end associate
   end function energies

   !> Squared errors against the reference: all, membrane and bending alone.
   subroutine compare(squares)
      real(wp), intent(out) :: squares(3)
      real(wp), allocatable :: beyond(:, :, :), normal(:, :), centre(:, :)
      real(wp) :: x(3), u(3), strain(6), own(6)
      integer :: e, f, g, p
      call strain_defects(reference%problem, reference%strains, beyond)
      associate (coarse => mesh%input%structure%mesh, fine => reference%input%structure%mesh)
         allocate (normal(3, size(coarse%triangles, 2)), centre(3, size(coarse%triangles, 2)))
         do e = 1, size(normal, 2)
            normal(:, e) = facet_normal(coarse, e)
            centre(:, e) = sum(coarse%coordinates(:, coarse%triangles(:, e)), 2)/3
         end do
         squares = 0
         !$omp parallel do private(x, u, strain, own, e, g, p) reduction(+: squares) schedule(static)
         do f = 1, size(fine%triangles, 2)
            do g = 1, 3
               x = matmul(fine%coordinates(:, fine%triangles(:, f)), strain_points(:, g))
               call place(coarse%coordinates, coarse%triangles, normal, centre, x, e, u)
               strain = turned_strain(reference%strains%axes(:, :, f), facet_normal(fine, f), mesh%strains%axes(:, :, e), &
                                      normal(:, e), reference%strains%strain(:, g, f) + beyond(:, g, f))
               own = 0
               do p = 1, 3
                  own = own + (2*u(p) - 1/3.0_wp)*mesh%strains%strain(:, p, e)
               end do
               squares = squares + energies(mesh%strains, e, reference%strains%area(f)/6, strain - own)
            end do
         end do
         !$omp end parallel do
      end associate
   end subroutine compare

   !> The element on which a point lies, and its area coordinates there.
   pure subroutine place(coordinates, triangles, normal, centre, x, e, u)
      real(wp), intent(in) :: coordinates(:, :), normal(:, :), centre(:, :), x(3)
      integer, intent(in) :: triangles(:, :)
      integer, intent(out) :: e
      real(wp), intent(out) :: u(3)
      real(wp) :: here(3), best, r(3), a(3), b(3), c(3), off, size2
      integer :: i
      best = huge(1.0_wp)
      e = 1
      u = 1/3.0_wp
      do i = 1, size(triangles, 2)
         a = coordinates(:, triangles(1, i))
         b = coordinates(:, triangles(2, i)) - a
         c = coordinates(:, triangles(3, i)) - a
         size2 = max(sum(b**2), sum(c**2))
         r = x - centre(:, i)
         if (sum(r**2) > 4*size2) cycle
         r = x - a
         here(2) = triple(r, c, normal(:, i))/triple(b, c, normal(:, i))
         here(3) = triple(b, r, normal(:, i))/triple(b, c, normal(:, i))
         here(1) = 1 - here(2) - here(3)
         off = max(0.0_wp, -minval(here)) + abs(dot_product(r, normal(:, i)))/sqrt(size2)
         if (off < best) then
            best = off
            e = i
            u = here
         end if
      end do
   end subroutine place

   pure real(wp) function triple(a, b, c)
      real(wp), intent(in) :: a(3), b(3), c(3)
      triple = (a(2)*b(3) - a(3)*b(2))*c(1) + (a(3)*b(1) - a(1)*b(3))*c(2) + (a(1)*b(2) - a(2)*b(1))*c(3)
   end function triple

   subroutine check()
      if (.not. allocated(error)) return
      write (error_unit, '(a)') error%message
      error stop 1
   end subroutine check
end program bench_error
