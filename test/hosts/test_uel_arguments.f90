!> The UEL as its host calls it: recorded arguments of three increments, every LFLAGS(3), failures, threads; against the library.
program test_uel_arguments
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: real64
   use finshell, only: evaluate_elements, error_t, follower_pressure, formulation_p, mass_elements, material_names, &
      material_parameters, material_t, new_material, new_section, pressure_elements, quaternion_product, rotation_increment, &
      rotation_quaternion, rotation_vector, rotation_vector_to_quaternion, section_t, tangent_operator
   use finshell_uel, only: last_message, law_count
   implicit none
   integer, parameter :: dp = real64
   real(dp), parameter :: far = 1e36_dp !< PNEWDT as the host sets it before a call
   real(dp), parameter :: x(3, 3) = reshape([3.774793053102844_dp, 2.5222360764617653_dp, 8.910065241883678_dp, &
                                             2.185080122244105_dp, 2.185080122244105_dp, 9.510565162951535_dp, &
                                             2.5693824148327584_dp, 1.716806439999553_dp, 9.510565162951535_dp], [3, 3])
   real(dp), parameter :: young = 6.825e7_dp, poisson = 0.3_dp, thickness = 0.04_dp
   real(dp), parameter :: no_direction(3) = 0

   !> What a call gives back.
   type :: answer_t
      real(dp) :: rhs(18, 2) = 0, amatrx(18, 18) = 0, energy(8) = 0, svars(12) = 0, pnewdt = far
   end type answer_t

   class(material_t), allocatable :: law
   type(section_t) :: section
   type(error_t), allocatable :: error
   integer :: failures = 0

   call new_material(law, 'st_venant_kirchhoff', ['e ', 'nu'], [young, poisson], error)
   call new_section(section, law, thickness, error, density=7.0_dp)
   call recorded(rotations=1)
   call recorded(rotations=2)
   call recorded(rotations=3)
   call flags(rotations=1)
   call flags(rotations=2)
   call flags(rotations=3)
   call pressure()
   call pressure_with_normals(rotations=1)
   call pressure_with_normals(rotations=2)
   call pressure_with_normals(rotations=3)
   call options()
   call coordinates()
   call normals(rotations=1)
   call normals(rotations=2)
   call normals(rotations=3)
   call laws()
   call recoverable()
   call mistakes()
   call threads()
   if (failures > 0) error stop 1

contains

   !> Calls in the order of the record; svars as a host keeps them: those of the last call become the start of the next increment.
   !> They are compared with quaternions that are followed here.
   subroutine recorded(rotations)
      integer, intent(in) :: rotations
      type(answer_t) :: answer, moved
      real(dp) :: u(18), du(18), start(12), state(4, 3), next(4, 3), w, f(18), k(18, 18), step, allowed, numerical(18, 18)
      integer :: file, number, call_number, increment, before, wanted, j
      before = 1
      start = 0 ! no rotation, until the first increment has ended
      state = 0
      state(1, :) = 1
      next = state
      open (newunit=file, file='hosts/uel_arguments.txt', status='old', action='read')
      read (file, *) number
      do call_number = 1, number
         read (file, *) increment, wanted
         read (file, *) u, du
         if (increment > before) then
            start = answer%svars
            state = next
         end if
         before = increment
         answer%svars = start
         call call_uel(answer, properties(rotations), wanted, u, du)
         do j = 1, 3
            next(:, j) = quaternion_product(rotation_vector_to_quaternion(du(6*j - 2:6*j)), state(:, j))
         end do
         if (rotations == 3) then
            call expect(maxval(abs(reshape(answer%svars, [4, 3]) - next)) < 1e-14_dp, 'SVARS are not the rotations', rotations, &
                        call_number)
         end if
         call library(rotations, u, du, state, w, f, k)
         allowed = 0
         if (rotations == 3) allowed = 1e-12_dp*maxval(abs(k)) ! rounding of the state
         call expect(maxval(abs(answer%rhs(:, 1) + f)) <= allowed, 'RHS is not minus the internal force', rotations, call_number)
         call expect(all(abs(answer%rhs(:, 2)) <= 0), 'RHS(:, 2) is not zero without loads', rotations, call_number)
         call expect(maxval(abs(answer%amatrx - k)) <= allowed, 'AMATRX is not the tangent', rotations, call_number)
         call expect(abs(answer%energy(2) - w) <= 1e-9_dp*w, 'ENERGY(2) is not the stored energy', rotations, call_number)
         call expect(abs(answer%pnewdt - far) <= 0, 'PNEWDT was changed', rotations, call_number)
         ! AMATRX = - d RHS / d U, by central differences; with compounded rotations RHS follows spins
         if (rotations == 2) cycle
         step = 1e-5_dp
         do j = 1, 18
            moved%svars = start
            call call_uel(moved, properties(rotations), 5, u + step*unit(j), du + step*unit(j))
            numerical(:, j) = -moved%rhs(:, 1)
            moved%svars = start
            call call_uel(moved, properties(rotations), 5, u - step*unit(j), du - step*unit(j))
            numerical(:, j) = (numerical(:, j) + moved%rhs(:, 1))/(2*step)
         end do
         call expect(maxval(abs(numerical - k)) < 1e-6_dp*maxval(abs(k)), 'AMATRX is not the derivative of RHS', rotations, &
                     call_number)
      end do
      close (file)
      call expect(number > 20 .and. increment == 3, 'the record is short', rotations, number)
   end subroutine recorded

   !> Every value of LFLAGS(3), and of the other flags that matter.
   subroutine flags(rotations)
      integer, intent(in) :: rotations
      type(answer_t) :: both, answer
      real(dp) :: u(18), du(18), t(18, 18), m(18, 18, 1)
      integer :: status(1), i
      call sample(u)
      du = 0.25_dp*u
      call call_uel(both, properties(rotations), 1, u, du)
      call call_uel(answer, properties(rotations), 2, u, du)
      call expect(all(abs(answer%amatrx - both%amatrx) <= 0), 'stiffness alone is another one', rotations, 2)
      call expect(all(abs(answer%rhs) <= 0), 'stiffness alone comes with a force', rotations, 2)
      answer = answer_t()
      call call_uel(answer, properties(rotations), 5, u, du)
      call expect(all(abs(answer%rhs - both%rhs) <= 0), 'residual alone is another one', rotations, 5)
      call expect(all(abs(answer%amatrx) <= 0), 'residual alone comes with a matrix', rotations, 5)
      call expect(abs(answer%energy(2) - both%energy(2)) <= 0, 'residual alone has another energy', rotations, 5)
      call call_uel(answer, properties(rotations), 3, u, du)
      call expect(all(abs(answer%amatrx) <= 0) .and. all(abs(answer%rhs) <= 0), 'there is damping', rotations, 3)
      call call_uel(answer, properties(rotations), 100, u, du)
      call expect(all(abs(answer%amatrx) <= 0) .and. all(abs(answer%rhs) <= 0), 'output changes something', rotations, 100)
      ! mass: T' M T with rotation vectors
      call mass_elements(section, 1, reshape(x, [3, 3, 1]), status, consistent=m)
      t = 0
      do i = 1, 18
         t(i, i) = 1
      end do
      do i = 4, 16, 6
         if (rotations == 1) t(i:i + 2, i:i + 2) = tangent_operator(u(i:i + 2))
         if (rotations == 3) t(i:i + 2, i:i + 2) = tangent_operator(du(i:i + 2))
      end do
      m(:, :, 1) = matmul(transpose(t), matmul(m(:, :, 1), t))
      call call_uel(answer, properties(rotations), 4, u, du)
      call expect(maxval(abs(answer%amatrx - m(:, :, 1))) < 1e-13_dp*maxval(abs(m)), 'not the mass matrix', rotations, 4)
      call expect(maxval(abs(m)) > 0 .and. all(abs(answer%rhs) <= 0), 'mass comes with a force', rotations, 4)
      answer = answer_t()
      call call_uel(answer, properties(rotations), 4, u, du, procedure=41)
      call expect(maxval(abs(answer%amatrx - m(:, :, 1))) < 1e-13_dp*maxval(abs(m)), 'not the mass for frequencies', rotations, 4)
      answer = answer_t()
      call call_uel(answer, properties(rotations), 6, u, du)
      call expect(maxval(abs(answer%amatrx - m(:, :, 1))) < 1e-13_dp*maxval(abs(m)), 'not the mass matrix', rotations, 6)
      call expect(all(abs(answer%rhs - both%rhs) <= 0), 'not the residual that belongs to the mass', rotations, 6)
      ! a perturbation begins from equilibrium, and leaves the state as it is
      answer = answer_t()
      call call_uel(answer, properties(rotations), 1, u, 0*du, perturbation=1)
      call expect(all(abs(answer%rhs) <= 0), 'a perturbation step begins with a force', rotations, 1)
      call expect(all(abs(answer%svars) <= 0), 'a perturbation step changes the state', rotations, 1)
      call expect(maxval(abs(answer%amatrx)) > 0, 'a perturbation step has no stiffness', rotations, 1)
      ! small-displacement steps are computed like all others
      answer = answer_t()
      call call_uel(answer, properties(rotations), 1, u, du, large=0)
      call expect(all(abs(answer%rhs - both%rhs) <= 0), 'LFLAGS(2) changes the force', rotations, 1)
      ! direct integration is refused, loudly
      answer = answer_t()
      call call_uel(answer, properties(rotations), 1, u, du, procedure=11)
      call expect(all(answer%rhs(:, 1) /= answer%rhs(:, 1)), 'dynamics passes', rotations, 11)
   end subroutine flags

   !> Load type U1.
   subroutine pressure()
      type(answer_t) :: without, with, moved
      real(dp) :: u(18), f(9, 1), numerical(18, 18), load(18)
      real(dp), parameter :: step = 1e-5_dp
      integer :: i, j
      call sample(u)
      call call_uel(without, properties(1), 1, u, u)
      call call_uel(with, properties(1), 1, u, u, load=[1.0_dp, 4.0e4_dp, 1.0e3_dp])
      call follower_pressure(1, [4.0e4_dp], reshape(x, [3, 3, 1]) + nodal(u, 1), .false., no_direction, f)
      load = 0
      do i = 1, 3
         load(6*i - 5:6*i - 3) = f(3*i - 2:3*i, 1)
      end do
      call expect(maxval(abs(with%rhs(:, 1) - without%rhs(:, 1) - load)) < 1e-12_dp*maxval(abs(load)), 'not the pressure', 1, 1)
      call expect(maxval(abs(with%rhs(:, 2) - load/40)) < 1e-12_dp*maxval(abs(load)), 'not the increment of pressure', 1, 1)
      do j = 1, 18
         call call_uel(moved, properties(1), 5, u + step*unit(j), u, load=[1.0_dp, 4.0e4_dp, 1.0e3_dp])
         numerical(:, j) = -moved%rhs(:, 1)
         call call_uel(moved, properties(1), 5, u - step*unit(j), u, load=[1.0_dp, 4.0e4_dp, 1.0e3_dp])
         numerical(:, j) = (numerical(:, j) + moved%rhs(:, 1))/(2*step)
      end do
      ! the derivative of the pressure alone, which is small beside the stiffness
      numerical = numerical - without%amatrx
      call expect(maxval(abs(numerical - (with%amatrx - without%amatrx))) < 1e-6_dp*maxval(abs(without%amatrx)), &
                  'the stiffness of the pressure is not its derivative', 1, 1)
      call expect(maxval(abs(with%amatrx - without%amatrx)) > 0, 'pressure has no stiffness', 1, 1)
      call call_uel(with, properties(1), 1, u, u, load=[2.0_dp, 4.0e4_dp, 1.0e3_dp])
      call expect(all(with%rhs(:, 1) /= with%rhs(:, 1)), 'an unknown load type passes', 1, 2)
   end subroutine pressure

   !> Load type U1 on a curved element: forces, couples and stiffness of the library, in the unknowns of the treatment of rotations;
   !> without normals where the formulation has none.
   subroutine pressure_with_normals(rotations)
      integer, intent(in) :: rotations
      type(answer_t) :: without, with, moved
      real(dp), parameter :: p(1) = 4.0e6_dp, step = 1e-5_dp
      real(dp), allocatable :: props(:)
      real(dp) :: u(18), du(18), normal(3, 3), identity(4, 3, 1), q(4, 3, 1), f(18, 1), k(18, 18, 1), numerical(18, 18)
      integer :: status(1), i, j
      call sample(u)
      du = merge(0.25_dp, 1.0_dp, rotations == 3)*u
      normal = sphere_normals()
      identity = spread(spread([1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp], 2, 3), 3, 1)
      do i = 1, 3
         q(:, i, 1) = rotation_vector_to_quaternion(u(6*i - 2:6*i))
      end do
      associate (xs => reshape(x, [3, 3, 1]), us => nodal(u, 1), normals => reshape(normal, [3, 3, 1]))
         select case (rotations)
         case (1)
            call pressure_elements(1, xs, us, nodal(u, 4), rotation_vector, status, p, force=f, stiffness=k, normal=normals)
         case (2)
            call pressure_elements(1, xs, us, q, rotation_quaternion, status, p, force=f, stiffness=k, normal=normals)
         case default
            call pressure_elements(1, xs, us, nodal(du, 4), rotation_increment, status, p, force=f, stiffness=k, state=identity, &
                                   normal=normals)
         end select
      end associate
      call expect(status(1) == 0 .and. maxval(abs(f(4:6, 1))) > 1e-3_dp*maxval(abs(f)), 'no couples to compare with', rotations, 0)
      call call_uel(without, properties(rotations), 1, u, du, mcrd=6, normal=normal)
      call call_uel(with, properties(rotations), 1, u, du, load=[1.0_dp, p(1), 0.025_dp*p(1)], mcrd=6, normal=normal)
      call expect(maxval(abs(with%rhs(:, 1) - without%rhs(:, 1) - f(:, 1))) < 1e-12_dp*maxval(abs(without%rhs)), &
                  'not the pressure with normals', rotations, 1)
      call expect(maxval(abs(with%rhs(:, 2) - f(:, 1)/40)) < 1e-12_dp*maxval(abs(f)), 'not the increment with normals', rotations, &
                  1)
      call expect(maxval(abs(without%amatrx - with%amatrx - k(:, :, 1))) < 1e-12_dp*maxval(abs(without%amatrx)), &
                  'not the stiffness of the pressure with normals', rotations, 1)
      if (rotations /= 2) then
         do j = 1, 18
            call call_uel(moved, properties(rotations), 5, u + step*unit(j), du + step*unit(j), load=[1.0_dp, p, 0.0_dp], &
                          mcrd=6, normal=normal)
            numerical(:, j) = -moved%rhs(:, 1)
            moved%svars = 0
            call call_uel(moved, properties(rotations), 5, u - step*unit(j), du - step*unit(j), load=[1.0_dp, p, 0.0_dp], &
                          mcrd=6, normal=normal)
            numerical(:, j) = (numerical(:, j) + moved%rhs(:, 1))/(2*step)
            moved%svars = 0
         end do
         call expect(maxval(abs(numerical - with%amatrx)) < 1e-6_dp*maxval(abs(with%amatrx)), &
                     'AMATRX with pressure and normals is not the derivative', rotations, 1)
      end if
      props = properties(rotations)
      props(4) = 2
      without%svars = 0
      call call_uel(without, props, 1, u, du, load=[1.0_dp, p(1), 0.0_dp])
      with%svars = 0
      call call_uel(with, props, 1, u, du, load=[1.0_dp, p(1), 0.0_dp], mcrd=6, normal=normal)
      call expect(all(abs(with%rhs - without%rhs) <= 0), 'normals count in formulation (P)', rotations, 2)
      call expect(all(abs(with%amatrx - without%amatrx) <= 0), 'normals count in formulation (P)', rotations, 3)
   end subroutine pressure_with_normals

   !> Points, formulation, beta0, offset reach the section; equal properties give the same bits, others another answer.
   subroutine options()
      type(answer_t) :: answer
      type(section_t) :: other
      real(dp), allocatable :: props(:)
      real(dp) :: u(18), f(18, 1), k(18, 18, 1), turn(3, 3, 1)
      integer :: status(1)
      call sample(u)
      props = properties(1)
      props(3:7) = [5.0_dp, 2.0_dp, 0.05_dp, 0.0_dp, 0.01_dp]
      call new_section(other, law, thickness, error, formulation_p, 0.05_dp, 5, offset=0.01_dp)
      turn = nodal(u, 4)
      call evaluate_elements(other, 1, reshape(x, [3, 3, 1]), nodal(u, 1), turn, rotation_vector, status, force=f, tangent=k)
      call call_uel(answer, props, 1, u, u)
      call expect(all(abs(answer%rhs(:, 1) + f(:, 1)) <= 0), 'the options do not reach the section', 1, 1)
      call expect(all(abs(answer%amatrx - k(:, :, 1)) <= 0), 'the options do not reach the section', 1, 2)
      call call_uel(answer, properties(1), 1, u, u)
      call expect(maxval(abs(answer%rhs(:, 1) + f(:, 1))) > 0, 'the options make no difference', 1, 3)
      ! an orthotropic law, with and without direction
      props = [9.0_dp, thickness, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 4.0_dp, 4e7_dp, 2e7_dp, &
               0.3_dp, 1e7_dp]
      call new_material(law, 'orthotropic', ['e1  ', 'e2  ', 'nu12', 'g12 '], [4e7_dp, 2e7_dp, 0.3_dp, 1e7_dp], error)
      call new_section(other, law, thickness, error)
      call evaluate_elements(other, 1, reshape(x, [3, 3, 1]), nodal(u, 1), turn, rotation_vector, status, force=f, &
                             direction=reshape([0.0_dp, 1.0_dp, 0.0_dp], [3, 1]))
      call call_uel(answer, props, 1, u, u)
      call expect(all(abs(answer%rhs(:, 1) + f(:, 1)) <= 0), 'the direction does not reach the element', 1, 4)
      props(9:11) = 0
      call evaluate_elements(other, 1, reshape(x, [3, 3, 1]), nodal(u, 1), turn, rotation_vector, status, force=f)
      call call_uel(answer, props, 1, u, u)
      call expect(all(abs(answer%rhs(:, 1) + f(:, 1)) <= 0), 'without direction it is not the default one', 1, 5)
   end subroutine options

   !> Coordinates behind the properties, for hosts that have none.
   subroutine coordinates()
      type(answer_t) :: given, behind
      real(dp) :: u(18)
      call sample(u)
      call call_uel(given, properties(1), 1, u, u)
      call call_uel(behind, [properties(1), reshape(x, [9])], 1, u, u, mcrd=2)
      call expect(all(abs(given%rhs - behind%rhs) <= 0), 'coordinates behind the properties give another force', 1, 1)
      call call_uel(behind, properties(1), 1, u, u, mcrd=2)
      call expect(all(behind%rhs(:, 1) /= behind%rhs(:, 1)), 'two coordinates pass', 1, 2)
   end subroutine coordinates

   !> Normals behind the nodal coordinates, or behind the properties: those of the library, of any length and side; at a node
   !> without one that of the triangle, at nodes without any a flat element.
   subroutine normals(rotations)
      integer, intent(in) :: rotations
      type(answer_t) :: flat, answer, moved
      real(dp) :: u(18), du(18), state(4, 3), normal(3, 3), given(3, 3), w, f(18), k(18, 18), numerical(18, 18), own(3)
      real(dp), parameter :: step = 1e-5_dp
      character(len=200) :: text
      integer :: code, element, i, j
      call sample(u)
      du = merge(0.25_dp, 1.0_dp, rotations == 3)*u
      state = 0
      state(1, :) = 1
      own = triangle_normal()
      normal = sphere_normals()
      call call_uel(flat, properties(rotations), 1, u, du)
      do i = 1, 5
         given = normal
         select case (i)
         case (2); given = -7*normal
         case (3); given(:, 2) = 0
         case (4); given = 0
         case (5); given = spread(own, 2, 3)
         end select
         if (i == 3) then
            call library(rotations, u, du, state, w, f, k, reshape([normal(:, 1), own, normal(:, 3)], [3, 3]))
         else
            call library(rotations, u, du, state, w, f, k, normal)
         end if
         do j = 1, 2
            answer = answer_t()
            if (j == 1) then
               call call_uel(answer, properties(rotations), 1, u, du, mcrd=6, normal=given)
            else
               call call_uel(answer, [properties(rotations), reshape(x, [9]), reshape(given, [9])], 1, u, du, mcrd=2)
            end if
            if (i <= 3) then
               call expect(maxval(abs(answer%rhs(:, 1) + f)) <= 1e-13_dp*maxval(abs(f)), 'not the force with normals', rotations, i)
               call expect(maxval(abs(answer%amatrx - k)) <= 1e-13_dp*maxval(abs(k)), 'not the tangent with normals', rotations, i)
               call expect(maxval(abs(answer%rhs - flat%rhs)) > 1e-3_dp*maxval(abs(f)), 'normals do not count', rotations, i)
            else
               call expect(all(abs(answer%rhs - flat%rhs) <= 0), 'no normals, and another force', rotations, i)
               call expect(all(abs(answer%amatrx - flat%amatrx) <= 0), 'no normals, and another tangent', rotations, i)
            end if
         end do
      end do
      if (rotations /= 2) then
         call library(rotations, u, du, state, w, f, k, normal)
         do j = 1, 18
            call call_uel(moved, properties(rotations), 5, u + step*unit(j), du + step*unit(j), mcrd=6, normal=normal)
            numerical(:, j) = -moved%rhs(:, 1)
            moved%svars = 0
            call call_uel(moved, properties(rotations), 5, u - step*unit(j), du - step*unit(j), mcrd=6, normal=normal)
            numerical(:, j) = (numerical(:, j) + moved%rhs(:, 1))/(2*step)
            moved%svars = 0
         end do
         call expect(maxval(abs(numerical - k)) < 1e-6_dp*maxval(abs(k)), 'AMATRX with normals is not the derivative', rotations, 1)
      end if
      given = normal
      given(1, 3) = ieee_value(given(1, 3), ieee_quiet_nan)
      answer = answer_t()
      call call_uel(answer, properties(rotations), 1, u, du, mcrd=6, normal=given)
      call expect(all(answer%rhs(:, 1) /= answer%rhs(:, 1)), 'a normal that is none passes', rotations, 1)
      call last_message(code, element, text)
      call expect(code == -3 .and. index(text, 'NaN') > 0, trim(text), rotations, 2)
   end subroutine normals

   !> Every law of the library has a number, and takes its parameters in the order that README.md says.
   subroutine laws()
      type(answer_t) :: answer
      real(dp) :: u(18)
      real(dp), allocatable :: values(:)
      integer :: i
      call sample(u)
      u = 0.01_dp*u
      do i = 1, law_count
         select case (i)
         case (1, 7); values = [1e6_dp, 0.3_dp]
         case (2); values = [1e6_dp]
         case (3, 8); values = [1e6_dp, 1e5_dp]
         case (4); values = [1e6_dp, 1e5_dp, 1e4_dp]
         case (5); values = [1e6_dp, 50.0_dp]
         case (6); values = [1e6_dp, 2.0_dp, 1e5_dp, 4.0_dp, -1e5_dp, -2.0_dp]
         case (9); values = [1e6_dp, 2e6_dp, 0.2_dp, 5e5_dp, 0.1_dp, 0.3_dp]
         case (10); values = [1e6_dp, 2.0_dp, 3.0_dp, 1e6_dp]
         case (11); values = [1e6_dp, 1e5_dp, 2.0_dp, 0.5_dp]
         case default; values = [1e6_dp, 1e5_dp, 2.0_dp, 0.1_dp, 30.0_dp]
         end select
         call call_uel(answer, [real(dp) :: i, 0.1_dp, 0, 0, 0, 0, 0, 1, 1, 0, 0, size(values), values], 1, u, u)
         call expect(maxval(abs(answer%rhs)) > 0 .and. maxval(abs(answer%rhs)) < huge(1.0_dp), 'a law does not work', 1, i)
      end do
      ! 12 numbers stand for 11 laws, one of them with two sets of parameters; linear_elastic is another name of the first
      call expect(size(material_names()) == law_count, 'the library has a law without a number', 1, size(material_names()))
      do i = 1, size(material_names())
         associate (names => material_names())
            call expect(size(material_parameters(trim(names(i)))) <= 12, 'a law has more than 12 parameters', 1, i)
         end associate
      end do
   end subroutine laws

   !> A collapsed element asks for a smaller increment and gives zeros.
   subroutine recoverable()
      type(answer_t) :: answer
      real(dp) :: u(18)
      character(len=200) :: text
      integer :: code, element
      u = 0
      u(13:15) = 0.5_dp*(x(:, 1) + x(:, 2)) - x(:, 3)
      call call_uel(answer, properties(1), 1, u, u)
      call expect(abs(answer%pnewdt - 0.25_dp) <= 0, 'PNEWDT of a collapsed element is not 0.25', 1, 1)
      call expect(all(abs(answer%rhs) <= 0) .and. all(abs(answer%amatrx) <= 0), 'a collapsed element has a force', 1, 1)
      call last_message(code, element, text)
      call expect(code > 0 .and. element == 64 .and. len_trim(text) > 0, 'no message about the collapsed element', 1, 1)
      ! an element before it may have asked for less already
      answer%pnewdt = 0.1_dp
      call call_uel(answer, properties(1), 1, u, u, keep_pnewdt=.true.)
      call expect(abs(answer%pnewdt - 0.1_dp) <= 0, 'PNEWDT was raised', 1, 2)
      ! a host that does not read PNEWDT sets it to zero: it shall not take zeros for forces
      answer%pnewdt = 0
      call call_uel(answer, properties(1), 1, u, u, keep_pnewdt=.true.)
      call expect(all(answer%rhs(:, 1) /= answer%rhs(:, 1)), 'a failure looks like an element without force', 1, 3)
   end subroutine recoverable

   !> Wrong input gives NaN, a small PNEWDT, and a message that says what is wrong.
   subroutine mistakes()
      type(answer_t) :: answer
      real(dp), allocatable :: props(:)
      real(dp) :: u(18)
      character(len=200) :: text
      integer :: code, element, i
      do i = 1, 9
         call sample(u)
         props = properties(1)
         select case (i)
         case (1); props(1) = 99
         case (2); props(2) = -1
         case (3); props(12) = 40
         case (4); props = props(:10)
         case (5); props(8) = 7
         case (6); props = [props, 1.0_dp]
         case (7); props(14) = 0.7_dp
         case (8); u(3) = answer%rhs(1, 1) ! NaN, from the case before
         case (9); props(3) = 99
         end select
         answer = answer_t()
         call call_uel(answer, props, 1, u, u)
         call expect(all(answer%rhs(:, 1) /= answer%rhs(:, 1)), 'wrong input passes', 1, i)
         call expect(abs(answer%pnewdt - 0.25_dp) <= 0, 'wrong input leaves PNEWDT as it is', 1, i)
         call last_message(code, element, text)
         call expect(code < 0 .and. element == 64 .and. len_trim(text) > 20, 'wrong input without message', 1, i)
         if (i == 1) call expect(index(text, 'FINSHELL_LAWS') > 0, trim(text), 1, i)
         if (i == 7) answer%rhs(1, 1) = answer%rhs(2, 1)
      end do
   end subroutine mistakes

   !> Many threads, each with its own new sections and a common one, get the bits of one thread.
   subroutine threads()
      integer, parameter :: n = 1000
      type(answer_t), allocatable :: one(:), many(:)
      type(answer_t) :: common, answer
      real(dp), allocatable :: props(:)
      real(dp) :: u(18)
      integer :: i, wrong
      call sample(u)
      wrong = 0
      allocate (one(n), many(n))
      call call_uel(common, properties(1), 1, u, u)
!$omp parallel do private(props, answer) reduction(+:wrong) schedule(static, 1) num_threads(8)
      do i = 1, n
         props = properties(1)
         props(2) = 0.01_dp + 0.0001_dp*i
         call call_uel(many(i), props, 1, u, u)
         call call_uel(answer, properties(1), 1, u, u)
         if (any(abs(answer%rhs - common%rhs) > 0) .or. any(abs(answer%amatrx - common%amatrx) > 0)) wrong = wrong + 1
      end do
!$omp end parallel do
      call expect(wrong == 0, 'threads change the answer', 1, wrong)
      do i = n, 1, -1
         props = properties(1)
         props(2) = 0.01_dp + 0.0001_dp*i
         call call_uel(one(i), props, 1, u, u)
         call expect(all(abs(one(i)%rhs - many(i)%rhs) <= 0) .and. all(abs(one(i)%amatrx - many(i)%amatrx) <= 0), &
                     'another thread, another answer', 1, i)
      end do
   end subroutine threads

   !> uel_ as the host calls it: an external procedure, addresses and no interface. NDLOAD = 0 unless `load` (type, value,
   !> increment).
   subroutine call_uel(answer, props, wanted, u, du, procedure, large, perturbation, mcrd, load, keep_pnewdt, normal)
      type(answer_t), intent(inout) :: answer
      real(dp), intent(in) :: props(:), u(18), du(18)
      integer, intent(in) :: wanted
      integer, intent(in), optional :: procedure, large, perturbation, mcrd
      real(dp), intent(in), optional :: load(3)
      logical, intent(in), optional :: keep_pnewdt
      real(dp), intent(in), optional :: normal(3, 3) !< with mcrd = 6
      ! allow(C091)
      external :: uel
      real(dp) :: increments(18, 2), none(18), time(2), adlmag(1, 1), ddlmag(1, 1)
      real(dp), allocatable :: coords(:, :)
      integer :: lflags(5), jdltyp(1, 1), loads, dimension
      lflags = [1, 1, wanted, 0, 0]
      if (present(procedure)) lflags(1) = procedure
      if (present(large)) lflags(2) = large
      if (present(perturbation)) lflags(4) = perturbation
      dimension = 3
      if (present(mcrd)) dimension = mcrd
      increments = 0
      increments(:, 1) = du
      none = 0
      time = [0.5_dp, 0.5_dp]
      allocate (coords(dimension, 3))
      coords(:min(3, dimension), :) = x(:min(3, dimension), :)
      if (present(normal)) coords(4:6, :) = normal
      loads = 0
      jdltyp = 0
      adlmag = 0
      ddlmag = 0
      if (present(load)) then
         loads = 1
         jdltyp = nint(load(1))
         adlmag = load(2)
         ddlmag = load(3)
      end if
      if (.not. present(keep_pnewdt)) answer%pnewdt = far
      call uel(answer%rhs, answer%amatrx, answer%svars, answer%energy, 18, 2, 12, props, size(props), coords, dimension, 3, u, &
               increments, none, none, 1, time, 0.1_dp, 1, 1, 64, none, loads, jdltyp, adlmag, none, 0, lflags, 18, ddlmag, loads, &
               answer%pnewdt, [0], 0, 1.0_dp)
   end subroutine call_uel

   pure function properties(rotations) result(p)
      integer, intent(in) :: rotations
      real(dp) :: p(14)
      p = [1.0_dp, thickness, 0.0_dp, 0.0_dp, 0.0_dp, 7.0_dp, 0.0_dp, real(rotations, dp), no_direction, 2.0_dp, young, poisson]
   end function properties

   !> What the library says, in the words of one of the three treatments of rotations.
   subroutine library(rotations, u, du, state, w, f, k, normal)
      integer, intent(in) :: rotations
      real(dp), intent(in) :: u(18), du(18), state(4, 3)
      real(dp), intent(out) :: w, f(18), k(18, 18)
      real(dp), intent(in), optional :: normal(3, 3)
      real(dp), allocatable :: normals(:, :, :) ! unallocated: absent
      real(dp) :: q(4, 3, 1), energy(1), force(18, 1), tangent(18, 18, 1)
      integer :: status(1), i
      if (present(normal)) normals = reshape(normal, [3, 3, 1])
      select case (rotations)
      case (1)
         call evaluate_elements(section, 1, reshape(x, [3, 3, 1]), nodal(u, 1), nodal(u, 4), rotation_vector, status, energy, &
                                force, tangent, normal=normals)
      case (2)
         do i = 1, 3
            q(:, i, 1) = rotation_vector_to_quaternion(u(6*i - 2:6*i))
         end do
         call evaluate_elements(section, 1, reshape(x, [3, 3, 1]), nodal(u, 1), q, rotation_quaternion, status, energy, force, &
                                tangent, normal=normals)
      case default
         call evaluate_elements(section, 1, reshape(x, [3, 3, 1]), nodal(u, 1), nodal(du, 4), rotation_increment, status, energy, &
                                force, tangent, state=reshape(state, [4, 3, 1]), normal=normals)
      end select
      w = energy(1)
      f = force(:, 1)
      k = tangent(:, :, 1)
   end subroutine library

   !> Three of the six unknowns of each node, from the given one on.
   pure function nodal(u, first) result(v)
      real(dp), intent(in) :: u(18)
      integer, intent(in) :: first
      real(dp) :: v(3, 3, 1)
      integer :: i
      do i = 1, 3
         v(:, i, 1) = u(6*i - 6 + first:6*i - 4 + first)
      end do
   end function nodal

   pure function triangle_normal() result(n)
      real(dp) :: n(3)
      n = [(x(2, 2) - x(2, 1))*(x(3, 3) - x(3, 1)) - (x(3, 2) - x(3, 1))*(x(2, 3) - x(2, 1)), &
           (x(3, 2) - x(3, 1))*(x(1, 3) - x(1, 1)) - (x(1, 2) - x(1, 1))*(x(3, 3) - x(3, 1)), &
           (x(1, 2) - x(1, 1))*(x(2, 3) - x(2, 1)) - (x(2, 2) - x(2, 1))*(x(1, 3) - x(1, 1))]
   end function triangle_normal

   !> On the side of the triangle's normal.
   pure function sphere_normals() result(normal)
      real(dp) :: normal(3, 3)
      normal = sign(1.0_dp, dot_product(triangle_normal(), x(:, 1)))*x
   end function sphere_normals

   !> A large rigid turn of about 2.5 with a strain of some per cent.
   subroutine sample(u)
      real(dp), intent(out) :: u(18)
      real(dp), parameter :: axis(3) = [1.2_dp, -0.7_dp, 2.1_dp]
      real(dp) :: k(3, 3), r(3, 3), angle
      integer :: i
      angle = norm2(axis)
      k = reshape([0.0_dp, axis(3), -axis(2), -axis(3), 0.0_dp, axis(1), axis(2), -axis(1), 0.0_dp], [3, 3])/angle
      r = sin(angle)*k + (1 - cos(angle))*matmul(k, k)
      do i = 1, 3
         u(6*i - 5:6*i - 3) = matmul(r, x(:, i)) + 0.02_dp*[sin(3.0_dp*i), cos(5.0_dp*i), sin(7.0_dp*i)]
         u(6*i - 2:6*i) = axis + 0.05_dp*[cos(2.0_dp*i), sin(4.0_dp*i), cos(6.0_dp*i)]
      end do
   end subroutine sample

   pure function unit(j) result(v)
      integer, intent(in) :: j
      real(dp) :: v(18)
      v = 0
      v(j) = 1
   end function unit

   subroutine expect(true, text, rotations, number)
      logical, intent(in) :: true
      character(len=*), intent(in) :: text
      integer, intent(in) :: rotations, number
      if (true) return
      failures = failures + 1
      print '(a, a, i0, a, i0)', text, '; PROPS(8) = ', rotations, ', number ', number
   end subroutine expect
end program test_uel_arguments
