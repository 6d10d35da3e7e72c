!> The elements of `precision_sample` or `precision_axes` in quadruple precision, from the same doubles: how many digits double
!> precision kept.
!>
!>     precision_reference FILE [all]
!>
!> Of `precision_axes`: a line for each block, with codes, errors, reason and, at the end, the value and the axis.
!>
!> A line for each kind of section, law and parameter set: elements, how many were refused, how many have another code than here,
!> the largest errors of energy, force and tangent (forces and stiffnesses made comparable by the size of the element, relative to
!> the largest).
!> Elements that miss 8 digits are counted by the reason:
!>
!>   input    a change of the coordinates and displacements in their last place does as much (times a few hundred roundings);
!>   tangent  the tangent only, of an element with principal stretches of very different size: components of the material tangent in
!>            the element's axes are rounded, and cancel by up to (l1/l2)^4 on the way to the nodes;
!>   bad      neither. With `all`, each of these is described. Of membranes `exponential_fibre` with wrinkles at strains of 1e-8
!>            alone, which has no stiffness at rest; the others keep 8 digits without exception.
!>
!> Exit code 1 when more than one element of 5000 is bad (needles in strong compression, where a few hundred roundings are not
!> enough; a tangent that cancels in the local strain), when one is bad by more than 1e-5, or when a code differs.
program precision_reference
   use, intrinsic :: ieee_arithmetic, only: ieee_set_flag, ieee_set_halting_mode, ieee_usual
   use, intrinsic :: iso_fortran_env, only: int64
   use finshell_batch, only: evaluate_elements, rotation_quaternion
   use finshell_error, only: error_t
   use finshell_kinds, only: dp, i4, wp
   use finshell_material, only: material_t
   use finshell_freedoms, only: n_membrane, n_shell
   use finshell_membrane_batch, only: evaluate_membranes
   use finshell_registry, only: new_material
   use finshell_section, only: new_section, section_t
   use support_element, only: uniform_array
   implicit none
   integer, parameter :: n = 8, longest = 16
   real(dp), parameter :: tolerance = 1.0e-8_dp, roundings = 256, worst_tangent = 1.0e-5_dp
   character(len=64) :: axis, last_axis
   real(dp) :: place, last_place !< value on the axis
   character(len=32) :: name, last_name
   character(len=16) :: keys(longest)
   real(dp) :: values(longest), last_values(longest), thickness
   character(len=9), parameter :: kinds(0:2) = [character(len=9) :: 'shell', 'membrane', 'wrinkling']
   integer(i4) :: used, formulation, convention, kind, last_kind
   integer(i4) :: last_code !< with which an element of the block was refused
   integer :: m !< freedoms of an element
   integer(int64) :: seed = 2026
   integer :: file, iostat, elements, refused, codes, bad, by_input, by_stretch, total_bad, total_codes, total_evaluated
   real(dp) :: worst(3), worst_bad
   logical :: each
   character(len=200) :: argument

   ! What is out of range has a code, also in builds that stop at floating-point exceptions.
   call ieee_set_halting_mode(ieee_usual, .false.)
   call get_command_argument(2, argument)
   each = argument == 'all'
   call get_command_argument(1, argument)
   open (newunit=file, file=trim(argument), access='stream', form='unformatted', status='old', action='read')
   last_axis = ''
   last_place = 0
   last_code = 0
   last_name = ''
   last_values = 0
   last_kind = 0
   elements = 0
   total_bad = 0
   total_codes = 0
   total_evaluated = 0
   worst_bad = 0
   write (*, '(a)') 'law                        elements refused codes  energy   force    tangent  input tangent bad  '// &
      'kind      parameters'
   do
      read (file, iostat=iostat) axis, place, name, used, keys, values, thickness, formulation, convention, kind
      if (iostat /= 0) exit
      if (name /= last_name .or. kind /= last_kind .or. any(abs(values - last_values) > 0) .or. &
          axis /= last_axis .or. abs(place - last_place) > 0) call close_line()
      m = merge(n_membrane, n_shell, kind > 0)
      call compare()
   end do
   call close_line()
   call ieee_set_flag(ieee_usual, .false.)
   if (total_codes > 0 .or. worst_bad > worst_tangent .or. 5000*total_bad > total_evaluated) stop 1

contains

   subroutine close_line()
      integer :: i
      if (elements > 0 .and. last_axis /= '') then
         write (*, '(i4,i3,2i4,3es9.1,3i4,es11.2e3,1x,a)') refused, last_code, codes, elements, worst, by_input, by_stretch, bad, &
            last_place, trim(last_axis)
      else if (elements > 0) then
         write (*, '(a24,3i8,3es9.1,3i6,2x,a9,16(1x,g0.5))') last_name, elements, refused, codes, worst, by_input, &
         by_stretch, bad, kinds(last_kind), (last_values(i), i=1, max(1, findloc(abs(last_values) > 0, .true., dim=1, back=.true.)))
      end if
      last_axis = axis
      last_place = place
      last_code = 0
      last_name = name
      last_values = values
      last_kind = kind
      elements = 0
      refused = 0
      codes = 0
      bad = 0
      by_input = 0
      by_stretch = 0
      worst = 0
   end subroutine close_line

   !> One block.
   subroutine compare()
      real(dp), dimension(3, 3, n) :: x, u, theta
      real(dp), dimension(4, 3, n) :: q, state
      real(dp) :: direction(3, n), energy(n), force(m, n), tangent(m, m, n), error(3)
      integer(i4) :: status(n), right(n)
      real(wp) :: w(n), f(m, n), k(m, m, n), size
      real(dp) :: noise(3, n), stretches(2)
      logical :: judged
      type(error_t), allocatable :: failure
      class(material_t), allocatable :: law
      type(section_t) :: section
      integer :: e
      if (kind > 0) then
         read (file) x, u, direction, status, energy, force, tangent
         q = 0
         theta = 0
         state = 0
      else
         read (file) x, u, q, theta, state, direction, status, energy, force, tangent
      end if
      call new_material(law, name, keys(:used), real(values(:used), wp), failure)
      if (allocated(failure)) error stop 'precision_reference: '//failure%message
      call new_section(section, law, real(thickness, wp), failure, formulation=int(formulation), membrane=kind > 0, &
                       wrinkling=kind == 2)
      call evaluate(section, real(x, wp), real(u, wp), q, theta, state, direction, right, w, f, k)
      judged = .false.
      do e = 1, n
         elements = elements + 1
         if (status(e) /= 0) then
            refused = refused + 1
            last_code = status(e)
         end if
         if (status(e) /= right(e) .and. .not. (axis /= '' .and. status(e)*right(e) /= 0)) then
            codes = codes + 1
            total_codes = total_codes + 1
            if (each) write (*, '(a,i0,a,i0)') '   '//trim(name)//', '//trim(kinds(kind))//': code ', status(e), ', here ', right(e)
            cycle
         end if
         if (status(e) /= 0) cycle
         total_evaluated = total_evaluated + 1
         size = real(maxval(norm2(x(:, :, e) - cshift(x(:, :, e), 1, 2), 1)), wp)
         error(1) = real(abs(energy(e) - w(e))/max(abs(w(e)), real(tiny(1.0_dp), wp)), dp)
         call scale(size, f(:, e), k(:, :, e))
         call compare_scaled(size, force(:, e), tangent(:, :, e), f(:, e), k(:, :, e), error)
         worst = max(worst, merge(1.0_dp, error, .not. error <= 1))
         if (.not. all(error <= tolerance)) then
            if (.not. judged) then
               call inherent(section, x, u, q, theta, state, direction, w, f, k, noise)
               judged = .true.
            end if
            if (all(error <= max(tolerance, roundings*noise(:, e)))) then
               by_input = by_input + 1
               cycle
            end if
            stretches = principal_stretches(x(:, :, e), u(:, :, e))
            noise(3, e) = max(noise(3, e), min(epsilon(1.0_dp)*(stretches(1)/stretches(2))**4, worst_tangent)/roundings)
            if (all(error <= max(tolerance, roundings*noise(:, e)))) then
               by_stretch = by_stretch + 1
               cycle
            end if
            bad = bad + 1
            worst_bad = max(worst_bad, merge(maxval(error), 1.0_dp, all(error <= 1)))
            total_bad = total_bad + 1
            if (each) call describe(x(:, :, e), stretches, status(e), right(e), error, error/noise(:, e))
         end if
      end do
   end subroutine compare

   subroutine evaluate(section, x, u, q, theta, state, direction, status, w, f, k)
      type(section_t), intent(in) :: section
      real(wp), dimension(3, 3, n), intent(in) :: x, u
      real(dp), intent(in) :: q(4, 3, n), theta(3, 3, n), state(4, 3, n), direction(3, n)
      integer(i4), intent(out) :: status(n)
      real(wp), intent(out) :: w(n), f(m, n), k(m, m, n)
      if (kind > 0) then
         call evaluate_membranes(section, n, x, u, status, w, f, k, real(direction, wp), threads=1)
      else if (convention == rotation_quaternion) then
         call evaluate_elements(section, n, x, u, real(q, wp), int(convention), status, w, f, k, real(direction, wp), threads=1)
      else
         call evaluate_elements(section, n, x, u, real(theta, wp), int(convention), status, w, f, k, real(direction, wp), &
                                threads=1, state=real(state, wp))
      end if
   end subroutine evaluate

   !> What the results change by when coordinates and displacements change by half their last place: no algorithm can do better
   !> on inputs that were rounded.
   subroutine inherent(section, x, u, q, theta, state, direction, w, f, k, noise)
      type(section_t), intent(in) :: section
      real(dp), dimension(3, 3, n), intent(in) :: x, u, theta
      real(dp), intent(in) :: q(4, 3, n), state(4, 3, n), direction(3, n)
      real(wp), intent(in) :: w(n), f(m, n), k(m, m, n)
      real(dp), intent(out) :: noise(3, n)
      real(wp) :: wn(n), fn(m, n), kn(m, m, n), xn(3, 3, n), un(3, 3, n)
      integer(i4) :: status(n)
      integer :: e, trial
      noise = 0
      do trial = 1, 6
         xn = x
         un = u
         call shake(xn)
         call shake(un)
         call evaluate(section, xn, un, q, theta, state, direction, status, wn, fn, kn)
         do e = 1, n
            if (status(e) /= 0 .or. .not. abs(w(e)) > 0) cycle
            noise(1, e) = max(noise(1, e), real(abs((wn(e) - w(e))/w(e)), dp))
            noise(2, e) = max(noise(2, e), real(maxval(abs(fn(:, e) - f(:, e)))/maxval(abs(f(:, e))), dp))
            noise(3, e) = max(noise(3, e), real(maxval(abs(kn(:, :, e) - k(:, :, e)))/maxval(abs(k(:, :, e))), dp))
         end do
      end do
   end subroutine inherent

   subroutine shake(a)
      real(wp), intent(inout) :: a(3, 3, n)
      real(wp) :: r(3, 3)
      integer :: e
      do e = 1, n
         call uniform_array(seed, r)
         a(:, :, e) = a(:, :, e)*(1 + r*epsilon(1.0_dp)/2)
      end do
   end subroutine shake

   subroutine compare_scaled(size, force, tangent, f, k, error)
      real(wp), intent(in) :: size, f(m), k(m, m)
      real(dp), intent(in) :: force(m), tangent(m, m)
      real(dp), intent(inout) :: error(3)
      real(wp) :: a(m), b(m, m)
      a = force
      b = tangent
      call scale(size, a, b)
      error(2) = real(maxval(abs(a - f))/maxval(abs(f)), dp)
      error(3) = real(maxval(abs(b - k))/maxval(abs(k)), dp)
   end subroutine compare_scaled

   !> Forces times the size of the element, to stand beside moments.
   subroutine scale(size, f, k)
      real(wp), intent(in) :: size
      real(wp), intent(inout) :: f(m), k(m, m)
      logical, parameter :: is_force(18) = [.true., .true., .true., .false., .false., .false., &
                                            .true., .true., .true., .false., .false., .false., &
                                            .true., .true., .true., .false., .false., .false.]
      integer :: i
      do i = 1, m
         if (.not. (kind > 0 .or. is_force(i))) cycle
         f(i) = f(i)*size
         k(:, i) = k(:, i)*size
         k(i, :) = k(i, :)*size
      end do
   end subroutine scale

   !> Principal stretches of the triangle, the larger first.
   function principal_stretches(x, u) result(l)
      real(dp), intent(in) :: x(3, 3), u(3, 3)
      real(dp) :: l(2)
      real(wp) :: a(3, 2), b(3, 2), g(2, 2), h(2, 2), trace, det
      integer :: i
      do i = 1, 2
         a(:, i) = real(x(:, i + 1), wp) - x(:, 1)
         b(:, i) = a(:, i) + u(:, i + 1) - u(:, 1)
      end do
      g = matmul(transpose(a), a)
      h = matmul(transpose(b), b)
      det = g(1, 1)*g(2, 2) - g(1, 2)**2
      trace = (g(2, 2)*h(1, 1) + g(1, 1)*h(2, 2) - 2*g(1, 2)*h(1, 2))/det
      det = (h(1, 1)*h(2, 2) - h(1, 2)**2)/det
      trace = 0.5_wp*(trace + sqrt(max(0.0_wp, trace**2 - 4*det)))
      l = real(sqrt([trace, det/trace]), dp)
   end function principal_stretches

   subroutine describe(x, stretches, status, right, error, share)
      real(dp), intent(in) :: x(3, 3), stretches(2), error(3)
      integer(i4), intent(in) :: status, right
      real(dp), intent(in) :: share(3)
      real(wp) :: side(3)
      side = norm2(real(x - cshift(x, 1, 2), wp), 1)
      write (*, '(a,a20,2i3,a,3es8.1,a,3es8.1)') '   ', name, status, right, ' errors', error, ' times rounding of the input', share
      write (*, '(a,2i2,a,es8.1,a,2es9.2,a,es8.1,a,16es9.1)') '      formulation, convention', formulation, convention, &
         ' h', thickness, ' stretches', stretches, ' shortest over longest side', real(minval(side)/maxval(side), dp), &
         ' parameters', values(:used)
   end subroutine describe
end program precision_reference
