!> Cost of one element: energy, force, force + tangent, through the batch call that every host uses.
!>
!> An irregular mesh of a pressurised dome in a large deformed state (stretch up to 2, rotations up to 80 degrees); one thread,
!> Mooney-Rivlin, 3 x 3 points unless said otherwise. Prints microseconds per element (wall clock), the counted arithmetic against
!> the machine's peak as measured in the same run, and the two lines that scripts read.
!>
!>     bench_kernel                       the figures above
!>     bench_kernel options               what each option costs
!>     bench_kernel count LEVEL ELEMENTS [PER_CALL]  evaluates and prints nothing: the work counted by bench/count_arithmetic.py
!>     bench_kernel points LEVEL ELEMENTS POINTS     the same with a linear law and so many thickness points: bench/switches.py
program bench_kernel
   use, intrinsic :: iso_fortran_env, only: int64, output_unit
   use finshell_batch, only: evaluate_elements, rotation_quaternion, rotation_vector
   use finshell_error, only: error_t
   use finshell_kinds, only: dp, i4, wp
   use finshell_evaluation, only: level_energy, level_force, level_tangent
   use finshell_material, only: material_t
   use finshell_freedoms, only: n_membrane
   use finshell_membrane_batch, only: evaluate_membranes, recover_membranes
   use finshell_quaternion, only: rotation_vector_to_quaternion
   use finshell_registry, only: new_material
   use finshell_section, only: new_section, section_t, formulation_p, formulation_s
   implicit none
   include 'arithmetic.inc'
   integer, parameter :: divisions = 80, repeats = 15
   integer, parameter :: n = 2*divisions**2
   type(section_t) :: section
   class(material_t), allocatable :: law
   type(error_t), allocatable :: error
   real(wp), allocatable :: x(:, :, :), u(:, :, :), r(:, :, :), q(:, :, :), energy(:), force(:, :), tangent(:, :, :)
   real(wp), allocatable :: normal(:, :, :) !< of curved references; else unallocated
   integer(i4), allocatable :: status(:)
   integer :: chunk = 64 !< elements per call, as a host assembles: outputs stay in the cache
   integer :: threads = 1
   character(len=16) :: mode

   allocate (x(3, 3, n), u(3, 3, n), r(3, 3, n), q(4, 3, n), energy(n), force(18, n), tangent(18, 18, n), status(n))
   call dome()
   call use_section()
   call get_command_argument(1, mode)
   select case (mode)
   case ('')
      call headline()
   case ('options')
      call options()
   case ('count')
      if (command_argument_count() > 3) chunk = integer_argument(4)
      call evaluate(integer_argument(3), 0, rotation_quaternion, integer_argument(2))
   case ('points')
      call use_section(law_name='st_venant_kirchhoff', names=['e ', 'nu'], values=[500.0_wp, 0.0_wp], &
                       thickness_points=integer_argument(4))
      call evaluate(integer_argument(3), 0, rotation_quaternion, integer_argument(2))
   case default
      error stop 'bench_kernel: unknown argument '//trim(mode)//', expected none, options, count or points'
   end select

contains

   subroutine headline()
      real(dp) :: us(3), peak
      integer :: level
      integer, parameter :: flop(3) = [flop_energy, flop_force, flop_tangent]
      character(len=*), parameter :: names(3) = [character(len=15) :: 'energy', 'force', 'force + tangent']
      write (*, '(a,i0,a)') 'finshell kernel: ', n, ' elements, one thread, Mooney-Rivlin, 3 x 3 points, double precision'
      us = costs(rotation_quaternion)
      call report('formulation (S), quaternions', us)
      write (*, '(a,f8.4)') 'force+tangent us_per_element ', us(3)
      write (*, '(a,f8.4)') 'force us_per_element ', us(2)
      peak = peak_rate()
      write (*, '(a,f6.1,a)') 'peak of this core, measured with multiply-adds: ', peak, ' GFlop/s'
      do level = 1, 3
         write (*, '(2a,i6,a,f6.2,a,f5.1,a)') names(level), ' arithmetic:', flop(level), &
            ' flop per element (counted by bench/count_arithmetic.py),', 1.0e-3_dp*flop(level)/us(level), ' GFlop/s, ', &
            0.1_dp*flop(level)/us(level)/peak, ' % of peak'
      end do
      call report('formulation (S), rotation vectors', costs(rotation_vector))
      call use_section(formulation=formulation_p)
      call report('formulation (P), quaternions', costs(rotation_quaternion))
      call membranes(us(3))
   end subroutine headline

   !> The membrane on the same mesh; sheets that wrinkle as well on one that is narrowed.
   subroutine membranes(shell)
      real(dp), intent(in) :: shell !< force and tangent of the shell
      real(dp) :: us(3)
      character(len=60) :: name
      integer(i4) :: state(n)
      call use_section()
      us = membrane_costs()
      call report('membrane', us)
      write (*, '(a,f6.3)') 'membrane force+tangent part_of_shell ', us(3)/shell
      call use_section(wrinkling=.true.)
      call report('membrane, wrinkling, taut', membrane_costs())
      u(2, :, :) = u(2, :, :) - 1.3_wp*x(2, :, :)
      call recover_membranes(section, n, x, u, status, state=state)
      write (name, '(a,i0,a)') 'membrane, wrinkling, ', nint(100.0*count(state == 1)/n), ' % wrinkled'
      us = membrane_costs()
      call report(trim(name), us)
      write (*, '(a,f6.3)') 'wrinkled force+tangent part_of_shell ', us(3)/shell
      call use_section(law_name='orthotropic', names=['e1  ', 'e2  ', 'nu12', 'g12 '], &
                       values=[3300.0_wp, 1100.0_wp, 0.0_wp, 660.0_wp], wrinkling=.true.)
      call recover_membranes(section, n, x, u, status, state=state)
      write (name, '(a,i0,a)') 'membrane, orthotropic, ', nint(100.0*count(state == 1)/n), ' % wrinkled'
      call report(trim(name), membrane_costs())
      u(2, :, :) = u(2, :, :) + 1.3_wp*x(2, :, :)
   end subroutine membranes

   !> As `costs`, of membranes.
   function membrane_costs() result(us)
      real(dp) :: us(3)
      real(dp) :: part(n/1600)
      real(wp), save :: f(n_membrane, n), k(n_membrane, n_membrane, n)
      integer(int64) :: start, finish, rate
      integer :: first, last, level, p, repeat
      call system_clock(count_rate=rate)
      do level = level_energy, level_tangent
         part = huge(part)
         do repeat = 1, repeats
            do p = 1, size(part)
               call system_clock(start)
               do first = 1600*(p - 1) + 1, 1600*p, chunk
                  last = min(1600*p, first + chunk - 1)
                  associate (m => last - first + 1, a => x(:, :, first:last), b => u(:, :, first:last))
                     select case (level)
                     case (level_tangent)
                        call evaluate_membranes(section, m, a, b, status(:m), energy(:m), f(:, :m), k(:, :, :m), threads=1)
                     case (level_force)
                        call evaluate_membranes(section, m, a, b, status(:m), energy(:m), f(:, :m), threads=1)
                     case default
                        call evaluate_membranes(section, m, a, b, status(:m), energy(:m), threads=1)
                     end select
                  end associate
               end do
               call system_clock(finish)
               part(p) = min(part(p), real(finish - start, dp)/real(rate, dp))
            end do
         end do
         us(level - level_energy + 1) = 1.0e6_dp*sum(part)/n
         if (any(status /= 0)) error stop 'bench_kernel: a membrane element failed'
      end do
   end function membrane_costs

   subroutine options()
      integer, parameter :: points(4) = [1, 2, 3, 5], sizes(6) = [1, 2, 3, 8, 64, 1000]
      integer :: i
      character(len=40) :: name
      call report('as shipped', costs(rotation_quaternion))
      call report('rotation vectors', costs(rotation_vector))
      call use_section(formulation=formulation_p)
      call report('formulation (P)', costs(rotation_quaternion))
      call use_section()
      allocate (normal(3, 3, n))
      normal(1:2, :, :) = x(1:2, :, :)/200 ! of a sphere of a hundred times the size
      normal(3, :, :) = 1
      call report('curved reference', costs(rotation_quaternion))
      deallocate (normal)
      do i = 1, size(points)
         call use_section(thickness_points=points(i))
         write (name, '(a,i0)') 'thickness points: ', points(i)
         call report(trim(name), costs(rotation_quaternion))
      end do
      call use_section(law_name='neo_hookean', names=['mu'], values=[200.0_wp])
      call report('neo-Hookean, incompressible', costs(rotation_quaternion))
      call use_section(law_name='compressible_neo_hookean', names=['e ', 'nu'], &
                       values=[500.0_wp, 0.3_wp])
      call report('compressible neo-Hookean', costs(rotation_quaternion))
      ! no lateral contraction: the law has no thickness left at the stretches of the dome
      call use_section(law_name='st_venant_kirchhoff', names=['e ', 'nu'], values=[500.0_wp, 0.0_wp])
      call report('St Venant-Kirchhoff', costs(rotation_quaternion))
      call use_section()
      do i = 1, size(sizes)
         chunk = sizes(i)
         write (name, '(a,i0)') 'elements per call: ', chunk
         call report(trim(name), costs(rotation_quaternion))
      end do
      chunk = 1600
      do i = 1, 2
         threads = i
         write (name, '(2(a,i0))') 'elements per call: ', chunk, ', threads: ', threads
         call report(trim(name), costs(rotation_quaternion))
      end do
   end subroutine options

   !> Mooney-Rivlin, (S) and 3 points unless told otherwise.
   subroutine use_section(law_name, names, values, formulation, thickness_points, wrinkling)
      character(len=*), intent(in), optional :: law_name, names(:)
      real(wp), intent(in), optional :: values(:)
      integer, intent(in), optional :: formulation, thickness_points
      logical, intent(in), optional :: wrinkling
      if (present(law_name)) then
         call new_material(law, law_name, names, values, error)
      else
         call new_material(law, 'mooney_rivlin', ['c10', 'c01'], [80.0_wp, 20.0_wp], error)
      end if
      if (.not. allocated(error)) call new_section(section, law, 0.5_wp, error, formulation=formulation, &
                                                   thickness_points=thickness_points, wrinkling=wrinkling)
      if (allocated(error)) error stop error%message
   end subroutine use_section

   subroutine report(name, us)
      character(len=*), intent(in) :: name
      real(dp), intent(in) :: us(3)
      write (*, '(a,t38,a,f7.3,a,f7.3,a,f7.3,a)') name, 'energy', us(1), '   force', us(2), '   force + tangent', us(3), &
         '   us per element'
      flush (output_unit)
   end subroutine report

   !> Microseconds per element for energy, force, force + tangent.
   !>
   !> The mesh is timed part by part, each part at its best of several passes: a part is shorter than the time slice of a busy
   !> machine.
   function costs(convention) result(us)
      integer, intent(in) :: convention
      real(dp) :: us(3)
      real(dp) :: part(n/1600)
      integer(int64) :: start, finish, rate
      integer :: level, p, repeat
      call system_clock(count_rate=rate)
      do level = level_energy, level_tangent
         part = huge(part)
         do repeat = 1, repeats
            do p = 1, size(part)
               call system_clock(start)
               call evaluate(1600, 1600*(p - 1), convention, level)
               call system_clock(finish)
               part(p) = min(part(p), real(finish - start, dp)/real(rate, dp))
            end do
         end do
         us(level - level_energy + 1) = 1.0e6_dp*sum(part)/n
         if (any(status /= 0)) error stop 'bench_kernel: an element failed'
      end do
   end function costs

   !> Elements offset + 1 ... offset + m, `chunk` of them in a call.
   subroutine evaluate(m, offset, convention, level)
      integer, intent(in) :: m, offset, convention, level
      integer :: first, last
      do first = offset + 1, offset + m, chunk
         last = min(offset + m, first + chunk - 1)
         if (allocated(normal)) then
            call evaluate_call(last - first + 1, x(:, :, first:last), u(:, :, first:last), q(:, :, first:last), convention, level, &
                               normal(:, :, first:last))
         else if (convention == rotation_quaternion) then
            call evaluate_call(last - first + 1, x(:, :, first:last), u(:, :, first:last), q(:, :, first:last), convention, level)
         else
            call evaluate_call(last - first + 1, x(:, :, first:last), u(:, :, first:last), r(:, :, first:last), convention, level)
         end if
      end do
   end subroutine evaluate

   subroutine evaluate_call(m, xm, um, rm, convention, level, nm)
      integer, intent(in) :: m, convention, level
      real(wp), intent(in) :: xm(3, 3, m), um(3, 3, m), rm(:, :, :)
      real(wp), intent(in), optional :: nm(3, 3, m)
      select case (level)
      case (level_tangent)
         call evaluate_elements(section, m, xm, um, rm, convention, status(:m), energy(:m), force(:, :m), tangent(:, :, :m), &
                                threads=threads, normal=nm)
      case (level_force)
         call evaluate_elements(section, m, xm, um, rm, convention, status(:m), energy(:m), force(:, :m), threads=threads, &
                                normal=nm)
      case default
         call evaluate_elements(section, m, xm, um, rm, convention, status(:m), energy(:m), threads=threads, normal=nm)
      end select
   end subroutine evaluate_call

   !> GFlop/s of one core on multiply-adds alone: chains of 8, short enough for the processor to see several at once.
   function peak_rate() result(rate)
      real(dp) :: rate
      integer, parameter :: m = 512, passes = 1000
      real(dp) :: a(m), b, c, t, best
      integer(int64) :: start, finish, ticks
      integer :: i, pass, repeat
      a = [(1.0_dp/i, i=1, m)]
      b = 1 - 1.0e-3_dp*energy(1)/(1 + abs(energy(1))) ! unknown to the compiler
      c = 1.0e-3_dp
      best = huge(best)
      call system_clock(count_rate=ticks)
      do repeat = 1, 100
         call system_clock(start)
         do pass = 1, passes
            do i = 1, m
               t = a(i)
               a(i) = (((((((t*b + c)*b + c)*b + c)*b + c)*b + c)*b + c)*b + c)*b + c
            end do
         end do
         call system_clock(finish)
         best = min(best, real(finish - start, dp)/real(ticks, dp))
      end do
      if (.not. all(a > 0)) error stop 'bench_kernel: multiply-adds went astray'
      rate = 1.0e-9_dp*16*m*passes/best
   end function peak_rate

   integer function integer_argument(i)
      integer, intent(in) :: i
      character(len=16) :: text
      integer :: iostat
      call get_command_argument(i, text)
      read (text, *, iostat=iostat) integer_argument
      if (iostat /= 0) error stop 'bench_kernel: expected an integer, found '//trim(text)
   end function integer_argument

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
