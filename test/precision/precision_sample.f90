!> Random elements, in double precision: what went in and what came out, bit for bit, for `precision_reference` to judge.
!>
!>     precision_sample FILE BLOCKS SEED
!>
!> BLOCKS blocks of eight elements for each law of the registry (and for parameters at the edge of what laws are used for), each
!> block with a thickness, formulation and convention of its own. Shapes down to angles of 1e-3 rad, h/L 1e-6 to 1, principal
!> stretches 1/50 to 50 (1/1.3 to 1.3 for one element of three), rigid rotations of many turns, nodal rotations up to 2.5 rad.
!> First shells, then membranes, then membranes that wrinkle; of these, one element of four has strains of 1e-8 and no rotation.
program precision_sample
   use, intrinsic :: iso_fortran_env, only: int64
   use finshell_batch, only: evaluate_elements, rotation_increment, rotation_quaternion, rotation_vector
   use finshell_error, only: error_t
   use finshell_kinds, only: dp, i4, wp
   use finshell_material, only: material_t
   use finshell_freedoms, only: n_membrane, n_shell
   use finshell_membrane_batch, only: evaluate_membranes
   use finshell_quaternion, only: quaternion_product, quaternion_to_matrix, quaternion_to_rotation_vector, &
      rotation_vector_to_quaternion
   use finshell_registry, only: material_names, material_parameters, new_material, parameter_t
   use finshell_section, only: new_section, section_t
   implicit none
   integer, parameter :: n = 8, longest = 16
   integer(int64) :: seed
   integer, parameter :: shell = 0, wrinkling = 2
   integer(i4) :: kind
   integer :: blocks, file
   character(len=32), allocatable :: names(:)
   character(len=200) :: argument

   call get_command_argument(2, argument)
   read (argument, *) blocks
   call get_command_argument(3, argument)
   read (argument, *) seed
   call get_command_argument(1, argument)
   open (newunit=file, file=trim(argument), access='stream', form='unformatted', status='replace', action='write')
   names = material_names()
   do kind = shell, wrinkling
      call all_laws()
   end do
   close (file)

contains

   subroutine all_laws()
      integer :: i
      do i = 1, size(names)
         call examples(names(i))
      end do
      call sample('mooney_rivlin', [1.0_wp, 0.0_wp])
      call sample('mooney_rivlin', [1.5_wp, -0.5_wp])
      call sample('compressible_neo_hookean', [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
      call sample('compressible_neo_hookean', [1.0_wp, 0.49999_wp, 0.0_wp, 0.0_wp])
      call sample('compressible_neo_hookean', [0.0_wp, 0.0_wp, 1.0e-3_wp, 1.0e7_wp])
      call sample('st_venant_kirchhoff', [1.0_wp, 0.0_wp])
      call sample('st_venant_kirchhoff', [1.0_wp, -0.9_wp])
      call sample('gent', [1.0_wp, 5000.0_wp])
      call sample('yeoh', [1.0_wp, 0.0_wp, 1.0_wp])
      call sample('ogden', [1.0_wp/13, 26.0_wp])
      call sample('ogden', [0.01_wp, 100.0_wp])
      call sample('ogden', [-0.05_wp, -50.0_wp])
      call sample('ogden', [1.0_wp, 1.0e-3_wp])
      call sample('ogden', [0.2_wp, 9.0_wp, -0.2_wp, -9.0_wp, 1.0_wp, 0.5_wp, 0.01_wp, 15.0_wp])
      call sample('holzapfel_gasser_ogden', [1.0_wp, 10.0_wp, 0.001_wp, 0.0_wp, 30.0_wp])
      call sample('holzapfel_gasser_ogden', [1.0_wp, 10.0_wp, 0.01_wp, 1.0_wp/3, 0.0_wp])
      call sample('holzapfel_2005', [1.0_wp, 10.0_wp, 1.0e-5_wp, 1.0_wp])
      call sample('exponential_fibre', [1.0_wp, 1.0e-6_wp, 1.0e-6_wp])
   end subroutine all_laws

   !> The example parameters of the registry.
   subroutine examples(name)
      character(len=*), intent(in) :: name
      type(parameter_t), allocatable :: parameters(:)
      parameters = material_parameters(name)
      call sample(name, parameters%example)
   end subroutine examples

   !> Blocks of elements of one law.
   subroutine sample(name, values)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values(:)
      character(len=16) :: keys(longest)
      character(len=32) :: law_name
      real(wp) :: all_values(longest), thickness
      type(parameter_t), allocatable :: parameters(:)
      type(error_t), allocatable :: error
      class(material_t), allocatable :: law
      type(section_t) :: section
      integer(i4) :: used, formulation, convention
      integer :: b
      parameters = material_parameters(name)
      used = size(values)
      keys = ''
      keys(:used) = parameters(:used)%name
      all_values = 0
      all_values(:used) = values
      law_name = name
      call new_material(law, name, keys(:used), values, error)
      if (allocated(error)) error stop 'precision_sample: '//error%message
      do b = 1, blocks
         thickness = 10.0_wp**(-3 + 3*uniform())
         formulation = merge(1, 2, uniform() > -0.5_wp)
         convention = 1 + int(1.5_wp*(1 + uniform()))
         convention = min(convention, 3_i4)
         call new_section(section, law, thickness, error, formulation=int(formulation), membrane=kind > shell, &
                          wrinkling=kind == wrinkling)
         if (allocated(error)) error stop 'precision_sample: section'
         write (file) law_name, used, keys, all_values, thickness, formulation, convention, kind
         if (section%membrane) then
            call block_of_membranes(section)
         else
            call block_of_elements(section, convention)
         end if
      end do
   end subroutine sample

   subroutine block_of_elements(section, convention)
      type(section_t), intent(in) :: section
      integer(i4), intent(in) :: convention
      real(wp), dimension(3, 3, n) :: x, u, theta
      real(wp), dimension(4, 3, n) :: q, state
      real(wp) :: direction(3, n), energy(n), force(n_shell, n), tangent(n_shell, n_shell, n)
      integer(i4) :: status(n)
      integer :: e
      do e = 1, n
         call element(x(:, :, e), u(:, :, e), q(:, :, e), theta(:, :, e), state(:, :, e), convention)
         direction(:, e) = [uniform(), uniform(), uniform()]
      end do
      if (convention == rotation_quaternion) then
         call evaluate_elements(section, n, x, u, q, convention, status, energy, force, tangent, direction, threads=1)
      else
         call evaluate_elements(section, n, x, u, theta, convention, status, energy, force, tangent, direction, threads=1, &
                                state=state)
      end if
      write (file) x, u, q, theta, state, direction, status, energy, force, tangent
   end subroutine block_of_elements

   subroutine block_of_membranes(section)
      type(section_t), intent(in) :: section
      real(wp), dimension(3, 3, n) :: x, u
      real(wp) :: theta(3, 3), q(4, 3), state(4, 3), direction(3, n), energy(n), force(n_membrane, n)
      real(wp) :: tangent(n_membrane, n_membrane, n), gradient(3, 3)
      integer(i4) :: status(n)
      integer :: e, i
      do e = 1, n
         call element(x(:, :, e), u(:, :, e), q, theta, state, rotation_vector)
         if (modulo(e, 4) == 0) then
            do i = 1, 3
               gradient(:, i) = 1.0e-8_wp*[uniform(), uniform(), uniform()]
            end do
            u(:, :, e) = matmul(gradient, x(:, :, e))
         end if
         direction(:, e) = [uniform(), uniform(), uniform()]
      end do
      call evaluate_membranes(section, n, x, u, status, energy, force, tangent, direction, threads=1)
      write (file) x, u, direction, status, energy, force, tangent
   end subroutine block_of_membranes

   !> A triangle with sides about 1, stretched in its plane, turned, its nodes turned further.
   subroutine element(x, u, q, theta, state, convention)
      real(wp), intent(out) :: x(3, 3), u(3, 3), q(4, 3), theta(3, 3), state(4, 3)
      integer(i4), intent(in) :: convention
      real(wp) :: plane(2, 3), stretched(2, 3), turn(2, 2), l(2), p(3, 3), rigid(4), place(4), relative(3), angle(2)
      integer :: i, first
      ! two angles, then the corner opposite to the side of length 1
      angle = 0.3_wp*10.0_wp**(-1.25_wp + 1.25_wp*[uniform(), uniform()])
      if (uniform() > 0) angle(1) = 3.1_wp - angle(1) - angle(2)
      plane = 0
      plane(1, 2) = 1
      plane(:, 3) = sin(angle(2))/sin(angle(1) + angle(2))*[cos(angle(1)), sin(angle(1))]
      first = 1 + int(1.4999_wp*(1 + uniform()))
      plane = cshift(plane, first, 2)
      call planar_turn(3*uniform(), turn)
      ! exponential laws end long before 50
      l = merge(50.0_wp, 1.3_wp, uniform() > -0.4_wp)**[uniform(), uniform()]
      stretched = matmul(transpose(turn), plane)
      stretched(1, :) = l(1)*stretched(1, :)
      stretched(2, :) = l(2)*stretched(2, :)
      stretched = matmul(turn, stretched)
      place = rotation_vector_to_quaternion(2*[uniform(), uniform(), uniform()])
      x(1:2, :) = plane
      x(3, :) = 0
      x = matmul(quaternion_to_matrix(place), x)
      rigid = rotation_vector_to_quaternion(10.0_wp**(1 + 2*uniform())*[uniform(), uniform(), uniform()])
      p(1:2, :) = stretched
      p(3, :) = 0
      p = matmul(quaternion_to_matrix(quaternion_product(rigid, place)), p)
      u = p - x
      do i = 1, 3
         relative = [uniform(), uniform(), uniform()]
         relative = 2.5_wp*10.0_wp**(-3.5_wp + 3.5_wp*uniform())*relative/max(1.0_wp, norm2(relative))
         q(:, i) = quaternion_product(rotation_vector_to_quaternion(relative), rigid)
         if (convention == rotation_increment) then
            ! the state takes its share
            theta(:, i) = 0.5_wp*relative
            state(:, i) = 3*quaternion_product(rotation_vector_to_quaternion(theta(:, i)), rigid)
         else
            theta(:, i) = quaternion_to_rotation_vector(q(:, i))
            state(:, i) = q(:, i)
         end if
      end do
      if (convention == rotation_vector .and. uniform() > 0.5_wp) theta = theta*(1 + 8*atan(1.0_wp)/spread(norms(theta), 1, 3))
   end subroutine element

   pure function norms(v) result(l)
      real(wp), intent(in) :: v(3, 3)
      real(wp) :: l(3)
      integer :: i
      do i = 1, 3
         l(i) = norm2(v(:, i))
      end do
   end function norms

   pure subroutine planar_turn(a, t)
      real(wp), intent(in) :: a
      real(wp), intent(out) :: t(2, 2)
      t(:, 1) = [cos(a), sin(a)]
      t(:, 2) = [-sin(a), cos(a)]
   end subroutine planar_turn

   !> Next number in [-1, 1] (Park & Miller 1988).
   impure real(wp) function uniform()
      seed = mod(16807_int64*seed, 2147483647_int64)
      uniform = 2*real(seed, dp)/2147483647.0_dp - 1
   end function uniform
end program precision_sample
