!> Elements along the axes on which inputs can be extreme, in double precision: what went in and what came out, bit for bit, for
!> `precision_reference` to judge (the file is that of `precision_sample`, each block with the axis and the value on it).
!>
!>     precision_axes FILE
!>
!> One block of eight elements for each value: triangles with sides about 1, h/L 0.02, stretched by 1.1 and 0.95, turned by 1 rad,
!> their nodes turned further by 0.02, incompressible Mooney-Rivlin; but for what the axis changes.
program precision_axes
   use, intrinsic :: iso_fortran_env, only: int64
   use, intrinsic :: ieee_arithmetic, only: ieee_set_flag, ieee_set_halting_mode, ieee_usual
   use finshell_batch, only: evaluate_elements, rotation_quaternion, rotation_vector
   use finshell_error, only: error_t
   use finshell_freedoms, only: n_shell
   use finshell_kinds, only: dp, i4, wp
   use finshell_material, only: material_t
   use finshell_quaternion, only: quaternion_product, quaternion_to_matrix, quaternion_to_rotation_vector, &
      rotation_vector_to_quaternion
   use finshell_registry, only: material_names, material_parameters, new_material, parameter_t
   use finshell_section, only: new_section, section_t
   implicit none
   integer, parameter :: n = 8, longest = 16
   real(wp), parameter :: pi = acos(-1.0_wp)

   type :: scene_t
      character(len=32) :: law = 'mooney_rivlin'
      real(wp), allocatable :: parameters(:)
      real(wp) :: thickness = 0.02_wp, length = 1, amplitude = 1
      real(wp) :: stretch(2) = [1.1_wp, 0.95_wp], shear = 0.05_wp
      real(wp) :: turn = 1, relative = 0.02_wp, offset = 0
      real(wp) :: foot = -1, height = -1 !< of the third corner over the side of length 1; negative: somewhere
      logical :: by_vector = .false., aligned = .false.
   end type scene_t

   integer(int64) :: seed = 20261126
   integer :: file
   character(len=64) :: axis
   character(len=200) :: argument

   ! What is out of range has a code, also in builds that stop at floating-point exceptions.
   call ieee_set_halting_mode(ieee_usual, .false.)
   call get_command_argument(1, argument)
   open (newunit=file, file=trim(argument), access='stream', form='unformatted', status='replace', action='write')
   call geometry()
   call deformation()
   call rotations()
   call units()
   call laws()
   close (file)
   call ieee_set_flag(ieee_usual, .false.)

contains

   !> The law that the axes without a law of their own take.
   function plain() result(scene)
      type(scene_t) :: scene
      scene%parameters = [80.0_wp, 20.0_wp]
   end function plain

   subroutine geometry()
      type(scene_t) :: scene
      integer :: k
      do k = 0, 12
         scene = plain()
         scene%thickness = 10.0_wp**(-k)
         call block_at('thickness over size', scene%thickness, scene)
      end do
      do k = 1, 13
         scene = plain()
         scene%foot = 0
         call flatten(scene, k)
         call block_at('width of a needle over its length', scene%height, scene)
      end do
      do k = 1, 13
         scene = plain()
         scene%foot = 0.4_wp
         call flatten(scene, k)
         call block_at('height of a flat triangle over its base', scene%height, scene)
      end do
      do k = 3, 18, 3
         scene = plain()
         scene%offset = 10.0_wp**k
         call block_at('distance from the origin over size', scene%offset, scene)
      end do
   end subroutine geometry

   !> A height of 2e-k; the thickness and the bending go with it.
   subroutine flatten(scene, k)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: k
      scene%height = 2*10.0_wp**(-k)
      scene%thickness = scene%thickness*scene%height
      scene%relative = scene%relative*scene%height
   end subroutine flatten

   subroutine deformation()
      real(wp), parameter :: stretches(*) = [1e-4_wp, 1e-3_wp, 1e-2_wp, 0.05_wp, 0.2_wp, 0.5_wp, 1.0_wp, 2.0_wp, 5.0_wp, &
                                             10.0_wp, 100.0_wp, 1e4_wp]
      integer, parameter :: powers(*) = [-200, -150, -100, -50, -20, -12, -8, -4, 0] !< of the amplitude
      type(scene_t) :: scene
      integer :: k
      do k = 1, size(stretches)
         scene = plain()
         scene%stretch = [stretches(k), 1/sqrt(stretches(k))]
         call block_at('uniaxial stretch', stretches(k), scene)
      end do
      do k = 1, size(stretches)
         scene = plain()
         scene%stretch = stretches(k)
         call block_at('equibiaxial stretch', stretches(k), scene)
      end do
      do k = -2, 4
         scene = plain()
         scene%shear = 10.0_wp**k
         call block_at('shear', scene%shear, scene)
      end do
      do k = 1, 15, 2
         scene = plain()
         scene%foot = 0.3_wp
         scene%height = 0.8_wp
         scene%aligned = .true.
         scene%stretch = [1.0_wp, 10.0_wp**(-k)]
         scene%shear = 0
         call block_at('area now over before, a node nears a side', scene%stretch(2), scene)
      end do
      do k = 1, size(powers)
         scene = plain()
         scene%turn = 0
         scene%amplitude = 10.0_wp**powers(k)
         call block_at('amplitude of displacements and rotations', scene%amplitude, scene)
      end do
   end subroutine deformation

   subroutine rotations()
      real(wp), parameter :: turns(*) = [1e-12_wp, 1e-6_wp, 1.0_wp, 10.0_wp, 100.0_wp, 1e4_wp, 1e8_wp]
      real(wp), parameter :: relatives(*) = [1e-12_wp, 1e-6_wp, 1e-2_wp, 0.5_wp, 1.0_wp, 2.0_wp, 2.8_wp, 3.0_wp, 3.1_wp]
      real(wp), parameter :: beside(*) = [-1e-3_wp, -1e-9_wp, -1e-15_wp, 0.0_wp, 1e-15_wp, 1e-9_wp, 1e-3_wp]
      type(scene_t) :: scene
      integer :: k
      do k = 1, size(turns)
         scene = plain()
         scene%turn = turns(k)
         call block_at('common rotation (rad)', turns(k), scene)
         if (turns(k) > 700) cycle
         scene%by_vector = .true.
         call block_at('common rotation (rad), as vectors', turns(k), scene)
      end do
      do k = 1, size(beside)
         scene = plain()
         scene%turn = pi + beside(k)
         scene%relative = 0
         scene%by_vector = .true.
         call block_at('common rotation next to pi (rad), as vectors', beside(k), scene)
         scene%turn = 2*pi + beside(k)
         call block_at('common rotation next to 2 pi (rad), as vectors', beside(k), scene)
      end do
      do k = 1, size(relatives)
         scene = plain()
         scene%relative = relatives(k)
         call block_at('rotation of nodes in their element (rad)', relatives(k), scene)
      end do
   end subroutine rotations

   subroutine units()
      integer, parameter :: exponents(*) = [-300, -200, -100, -61, -59, -30, -12, -6, 0, 6, 12, 30, 59, 61, 100, 200, 300]
      type(scene_t) :: scene
      integer :: k
      do k = 1, size(exponents)
         scene = plain()
         scene%length = 10.0_wp**exponents(k)
         call block_at('unit of length', scene%length, scene)
      end do
      do k = 1, size(exponents)
         scene = plain()
         scene%parameters = [80.0_wp, 20.0_wp]/10.0_wp**2*10.0_wp**exponents(k)
         call block_at('unit of stress', 10.0_wp**exponents(k), scene)
         scene%law = 'compressible_neo_hookean'
         scene%parameters = [10.0_wp**exponents(k), 0.4_wp, 0.0_wp, 0.0_wp]
         call block_at('unit of stress, compressible neo-Hookean', 10.0_wp**exponents(k), scene)
      end do
   end subroutine units

   subroutine laws()
      real(wp), parameter :: stretches(*) = [0.05_wp, 0.1_wp, 0.3_wp, 0.7_wp, 1.0_wp, 1.5_wp, 3.0_wp, 5.0_wp, 10.0_wp]
      real(wp), parameter :: alphas(*) = [1e-3_wp, 2.0_wp, 10.0_wp, 26.0_wp, 50.0_wp, 100.0_wp, 200.0_wp, 500.0_wp, &
                                          -10.0_wp, -100.0_wp]
      real(wp), parameter :: gaps(*) = [0.5_wp, 0.1_wp, 1e-2_wp, 1e-3_wp, 2e-4_wp, 1e-5_wp, 0.0_wp, -0.1_wp]
      real(wp), parameter :: exponents(*) = [0.01_wp, 1.0_wp, 10.0_wp, 20.0_wp, 30.0_wp, 50.0_wp, 100.0_wp]
      type(scene_t) :: scene
      type(parameter_t), allocatable :: parameters(:)
      character(len=32), allocatable :: names(:)
      real(wp) :: l
      integer :: i, k
      names = material_names()
      do i = 1, size(names)
         parameters = material_parameters(names(i))
         do k = 1, size(stretches)
            scene = plain()
            scene%law = names(i)
            scene%parameters = parameters%example
            scene%stretch = [stretches(k), 1/sqrt(stretches(k))]
            call block_at('uniaxial stretch, '//names(i), stretches(k), scene)
         end do
      end do
      do k = 0, 10
         scene = plain()
         scene%law = 'compressible_neo_hookean'
         scene%parameters = [0.0_wp, 0.0_wp, 1.0_wp, 10.0_wp**k]
         call block_at('lambda over mu, compressible neo-Hookean', 10.0_wp**k, scene)
      end do
      do k = 1, size(alphas)
         scene = plain()
         scene%law = 'ogden'
         scene%parameters = [2/alphas(k), alphas(k)]
         scene%stretch = [2.0_wp, 0.8_wp]
         call block_at('exponent of Ogden''s law at stretches 2 and 0.8', alphas(k), scene)
      end do
      do k = 1, size(gaps)
         scene = plain()
         scene%law = 'gent'
         scene%parameters = [1.0_wp, 10.0_wp]
         l = uniaxial(3 + 10*(1 - gaps(k)))
         scene%stretch = [l, 1/sqrt(l)]
         scene%shear = 0
         scene%relative = 0
         scene%thickness = 1e-3_wp
         call block_at('distance from the lock of Gent''s law, 1 - (I1 - 3)/jm', gaps(k), scene)
      end do
      do k = 1, size(exponents)
         scene = plain()
         scene%law = 'holzapfel_gasser_ogden'
         ! both families along direction 1, stretched by 1.2: exponent k2 (I4 - 1)**2
         scene%parameters = [1.0_wp, 1.0_wp, exponents(k)/0.44_wp**2, 0.0_wp, 0.0_wp]
         scene%stretch = [1.2_wp, 0.9_wp]
         scene%shear = 0
         scene%relative = 0
         scene%aligned = .true.
         scene%turn = 0
         scene%thickness = 1e-3_wp
         call block_at('exponent of the fibres of Holzapfel''s law', exponents(k), scene)
      end do
   end subroutine laws

   !> Stretch at which the first invariant in uniaxial tension has this value.
   pure real(wp) function uniaxial(invariant) result(l)
      real(wp), intent(in) :: invariant
      integer :: i
      l = sqrt(invariant)
      do i = 1, 60
         l = l - (l**2 + 2/l - invariant)/(2*l - 2/l**2)
      end do
   end function uniaxial

   subroutine block_at(name, value, scene)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value
      type(scene_t), intent(in) :: scene
      character(len=16) :: keys(longest)
      real(wp) :: all_values(longest), h
      real(wp), dimension(3, 3, n) :: x, u, theta
      real(wp), dimension(4, 3, n) :: q
      real(wp) :: direction(3, n), energy(n), force(n_shell, n), tangent(n_shell, n_shell, n)
      type(parameter_t), allocatable :: parameters(:)
      type(error_t), allocatable :: error
      class(material_t), allocatable :: law
      type(section_t) :: section
      integer(i4) :: status(n), used
      integer :: e
      axis = name
      parameters = material_parameters(scene%law)
      used = size(scene%parameters)
      keys = ''
      keys(:used) = parameters(:used)%name
      all_values = 0
      all_values(:used) = scene%parameters
      h = scene%thickness*scene%length
      call new_material(law, scene%law, keys(:used), scene%parameters, error)
      if (.not. allocated(error)) call new_section(section, law, h, error)
      if (allocated(error)) error stop 'precision_axes: '//error%message
      do e = 1, n
         call element(scene, x(:, :, e), u(:, :, e), q(:, :, e), theta(:, :, e))
         direction(:, e) = [uniform(), uniform(), uniform()]
         if (scene%aligned) direction(:, e) = [1, 0, 0]
      end do
      if (scene%by_vector) then
         call evaluate_elements(section, n, x, u, theta, rotation_vector, status, energy, force, tangent, direction, threads=1)
      else
         call evaluate_elements(section, n, x, u, q, rotation_quaternion, status, energy, force, tangent, direction, threads=1)
      end if
      write (file) axis, value, scene%law, used, keys, all_values, h, 1_i4, &
         int(merge(rotation_vector, rotation_quaternion, scene%by_vector), i4), 0_i4
      write (file) x, u, q, theta, q, direction, status, energy, force, tangent
   end subroutine block_at

   subroutine element(scene, x, u, q, theta)
      type(scene_t), intent(in) :: scene
      real(wp), intent(out) :: x(3, 3), u(3, 3), q(4, 3), theta(3, 3)
      real(wp) :: plane(2, 3), f(2, 2), turn(2, 2), p(3, 3), rigid(4), place(4), relative(3), vector(3), a
      integer :: i
      plane = 0
      plane(1, 2) = 1
      plane(1, 3) = 0.5_wp + 0.3_wp*uniform()
      plane(2, 3) = 0.8_wp + 0.2_wp*uniform()
      if (scene%foot >= 0) plane(1, 3) = scene%foot
      if (scene%height >= 0) plane(2, 3) = scene%height
      a = pi*uniform()
      if (scene%aligned) a = 0
      turn(:, 1) = [cos(a), sin(a)]
      turn(:, 2) = [-sin(a), cos(a)]
      f(:, 1) = [scene%stretch(1), 0.0_wp]
      f(:, 2) = [scene%shear*scene%stretch(1), scene%stretch(2)]
      f = matmul(turn, matmul(f, transpose(turn)))
      place = rotation_vector_to_quaternion(2*[uniform(), uniform(), uniform()])
      if (scene%aligned) place = [1, 0, 0, 0]
      x(1:2, :) = plane
      x(3, :) = 0
      x = matmul(quaternion_to_matrix(place), x)
      vector = scene%turn*unit([uniform(), uniform(), uniform()])
      rigid = rotation_vector_to_quaternion(vector)
      p(1:2, :) = matmul(f, plane)
      p(3, :) = 0
      p = matmul(quaternion_to_matrix(quaternion_product(rigid, place)), p)
      u = scene%amplitude*scene%length*(p - x)
      x = scene%length*(x + scene%offset)
      do i = 1, 3
         relative = scene%relative*scene%amplitude*unit([uniform(), uniform(), uniform()])
         q(:, i) = quaternion_product(rotation_vector_to_quaternion(relative), rigid)
         theta(:, i) = quaternion_to_rotation_vector(q(:, i))
         if (.not. abs(scene%relative) > 0) then
            theta(:, i) = vector
         else if (scene%turn > pi) then
            ! the same rotation by a vector of about the length of the common one
            theta(:, i) = theta(:, i)*(1 + 2*pi*nint((scene%turn - norm2(theta(:, i)))/(2*pi))/norm2(theta(:, i)))
         end if
      end do
   end subroutine element

   pure function unit(v) result(w)
      real(wp), intent(in) :: v(3)
      real(wp) :: w(3)
      w = v/norm2(v)
   end function unit

   !> Next number in [-1, 1] (Park & Miller 1988).
   impure real(wp) function uniform()
      seed = mod(16807_int64*seed, 2147483647_int64)
      uniform = 2*real(seed, dp)/2147483647.0_dp - 1
   end function uniform
end program precision_axes
