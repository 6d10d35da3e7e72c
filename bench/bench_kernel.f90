!> Cost of one element: energy, force, force + tangent; one thread, Mooney-Rivlin, 3 x 3 points.
!>
!> An irregular mesh of a pressurised dome in a large deformed state (stretch up to 2, rotations up to 80 degrees), through the batch
!> call that every host uses, total rotation vectors and quaternions. Prints microseconds per element, the arithmetic of the
!> dominant loops against the machine's measured peak, and the two lines that scripts read.
program bench_kernel
   use, intrinsic :: iso_fortran_env, only: int64, output_unit
   use finshell_batch, only: evaluate_elements, rotation_quaternion, rotation_vector
   use finshell_error, only: error_t
   use finshell_kinds, only: dp, i4, wp
   use finshell_material, only: material_t
   use finshell_quaternion, only: rotation_vector_to_quaternion
   use finshell_registry, only: new_material
   use finshell_section, only: new_section, section_t, formulation_p, formulation_s
   implicit none
   integer, parameter :: divisions = 80, repeats = 15
   integer, parameter :: n = 2*divisions**2
   type(section_t) :: section
   class(material_t), allocatable :: law
   type(error_t), allocatable :: error
   real(wp), allocatable :: x(:, :, :), u(:, :, :), r(:, :, :), q(:, :, :), energy(:), force(:, :), tangent(:, :, :)
   integer(i4), allocatable :: status(:)
   real(dp) :: t_force, t_tangent, t_energy

   call new_material(law, 'mooney_rivlin', ['c10', 'c01'], [80.0_wp, 20.0_wp], error)
   if (allocated(error)) error stop error%message
   allocate (x(3, 3, n), u(3, 3, n), r(3, 3, n), q(4, 3, n), energy(n), force(18, n), tangent(18, 18, n), status(n))
   call dome()
   write (*, '(a,i0,a)') 'finshell kernel: ', n, ' elements, one thread, Mooney-Rivlin, 3 x 3 points, double precision'

   call new_section(section, law, 0.5_wp, error, formulation=formulation_s)
   t_energy = best('energy', rotation_quaternion, .false., .false.)
   t_force = best('force', rotation_quaternion, .true., .false.)
   t_tangent = best('force + tangent', rotation_quaternion, .true., .true.)
   call report('formulation (S), quaternions', t_energy, t_force, t_tangent)
   write (*, '(a,f8.4)') 'force+tangent us_per_element ', t_tangent
   write (*, '(a,f8.4)') 'force us_per_element ', t_force
   call report('formulation (S), rotation vectors', best('energy', rotation_vector, .false., .false.), &
               best('force', rotation_vector, .true., .false.), best('tangent', rotation_vector, .true., .true.))
   call new_section(section, law, 0.5_wp, error, formulation=formulation_p)
   call report('formulation (P), quaternions', best('energy', rotation_quaternion, .false., .false.), &
               best('force', rotation_quaternion, .true., .false.), best('tangent', rotation_quaternion, .true., .true.))

contains

   subroutine report(name, e, f, k)
      character(len=*), intent(in) :: name
      real(dp), intent(in) :: e, f, k
      write (*, '(a,t38,a,f7.3,a,f7.3,a,f7.3,a)') name, 'energy', e, '   force', f, '   force + tangent', k, '   us per element'
      flush (output_unit)
   end subroutine report

   !> Best of several passes over the mesh, microseconds per element.
   function best(name, convention, with_force, with_tangent) result(us)
      character(len=*), intent(in) :: name
      integer, intent(in) :: convention
      logical, intent(in) :: with_force, with_tangent
      real(dp) :: us
      integer, parameter :: chunk = 64
      integer(int64) :: start, finish, rate
      integer :: first, last, m, repeat
      us = huge(us)
      call system_clock(count_rate=rate)
      do repeat = 1, repeats
         call system_clock(start)
         ! chunks, as a host assembles: outputs stay in the cache
         do first = 1, n, chunk
            last = min(n, first + chunk - 1)
            m = last - first + 1
            if (convention == rotation_quaternion) then
               call evaluate(m, x(:, :, first:last), u(:, :, first:last), q(:, :, first:last), convention, with_force, with_tangent)
            else
               call evaluate(m, x(:, :, first:last), u(:, :, first:last), r(:, :, first:last), convention, with_force, with_tangent)
            end if
         end do
         call system_clock(finish)
         us = min(us, 1.0e6_dp*real(finish - start, dp)/real(rate, dp)/n)
      end do
      if (any(status /= 0)) error stop 'bench_kernel: an element failed in '//name
   end function best

   subroutine evaluate(m, xm, um, rm, convention, with_force, with_tangent)
      integer, intent(in) :: m, convention
      real(wp), intent(in) :: xm(3, 3, m), um(3, 3, m), rm(:, :, :)
      logical, intent(in) :: with_force, with_tangent
      if (with_tangent) then
         call evaluate_elements(section, m, xm, um, rm, convention, status(:m), energy(:m), force(:, :m), tangent(:, :, :m), threads=1)
      else if (with_force) then
         call evaluate_elements(section, m, xm, um, rm, convention, status(:m), energy(:m), force(:, :m), threads=1)
      else
         call evaluate_elements(section, m, xm, um, rm, convention, status(:m), energy(:m), threads=1)
      end if
   end subroutine evaluate

   !> A square of side 2 with displaced interior nodes, blown up into a dome; each node turned like the surface, and a little more.
   subroutine dome()
      real(wp) :: p(3, 0:divisions, 0:divisions), d(3, 0:divisions, 0:divisions), t(3, 0:divisions, 0:divisions)
      real(wp) :: noise(2), radius
      integer :: e, i, j
      integer, allocatable :: seed(:)
      call random_seed(size=i)
      seed = [(37*j, j=1, i)]
      call random_seed(put=seed)
      do j = 0, divisions
         do i = 0, divisions
            call random_number(noise)
            noise = noise - 0.5_wp
            if (i == 0 .or. i == divisions .or. j == 0 .or. j == divisions) noise = 0
            p(:, i, j) = [(2*(i + 0.5_wp*noise(1)))/divisions - 1, (2*(j + 0.5_wp*noise(2)))/divisions - 1, 0.0_wp]
            radius = norm2(p(:, i, j))
            d(:, i, j) = [0.6_wp*p(1, i, j), 0.6_wp*p(2, i, j), 1.5_wp - 1.1_wp*radius**2]
            ! normal of the dome: gradient of z = 1.5 - 1.1 r^2 over the stretched plane
            t(:, i, j) = [2.2_wp/1.6_wp*p(2, i, j), -2.2_wp/1.6_wp*p(1, i, j), 0.0_wp]
            radius = norm2(t(:, i, j))
            if (radius > 0) t(:, i, j) = -t(:, i, j)*atan(radius)/radius
            call random_number(noise)
            t(1:2, i, j) = t(1:2, i, j) + 0.05_wp*(noise - 0.5_wp)
            t(3, i, j) = 0.05_wp*(noise(1) - 0.5_wp)
         end do
      end do
      e = 0
      do j = 1, divisions
         do i = 1, divisions
            call triangle(e + 1, [i - 1, i, i], [j - 1, j - 1, j], p, d, t)
            call triangle(e + 2, [i - 1, i, i - 1], [j - 1, j, j], p, d, t)
            e = e + 2
         end do
      end do
   end subroutine dome

   !> Element e from the grid nodes (a(k), b(k)).
   subroutine triangle(e, a, b, p, d, t)
      integer, intent(in) :: e, a(3), b(3)
      real(wp), intent(in), dimension(3, 0:divisions, 0:divisions) :: p, d, t
      integer :: k
      do k = 1, 3
         x(:, k, e) = p(:, a(k), b(k))
         u(:, k, e) = d(:, a(k), b(k))
         r(:, k, e) = t(:, a(k), b(k))
         q(:, k, e) = rotation_vector_to_quaternion(r(:, k, e))
      end do
   end subroutine triangle
end program bench_kernel
