!DIR$ FREEFORM
!> finshell as a user element of Abaqus/Standard, and of every host that calls a routine with the signature of its UEL.
!>
!> It calls the C interface of libfinshell, so that compiler and host need not be those of the library. Three nodes, degrees
!> of freedom 1 to 6 at each. README.md beside this file says how to compile it and which numbers PROPS takes:
!>
!>     1 law   2 thickness   3 points   4 formulation   5 beta0   6 density   7 offset   8 rotations   9-11 direction
!>     12 m, number of parameters   13 ... 12 + m parameters of the law   then, if the host has no COORDS, 9 coordinates, and
!>     behind these, if the element is curved, 9 components of the normals at its nodes (or COORDS(4:6))
!>
!> Nothing is printed and nothing stops. Sections are built once for each set of properties, under a lock, and kept.
include '../finshell_c.f90'

module finshell_uel
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_int, c_int32_t, c_int64_t, c_loc, c_null_char, &
      c_null_ptr, c_ptr
   use finshell_c, only: finshell_material_parameter, finshell_parameter, finshell_section_create, status_t => finshell_status
   implicit none
   private
   public :: section_for, last_message, keep_message, law_count, law_plugin
   public :: not_a_number, convention_of, complete_normals
   public :: first_parameter, rotations_added, rotations_compounded, rotations_incremental

   integer, parameter :: first_parameter = 13 !< of the law, in PROPS
   !> PROPS(8): what the host does with degrees of freedom 4 to 6.
   integer, parameter :: rotations_added = 1 !< adds corrections: U is a rotation vector, force and tangent its derivatives
   integer, parameter :: rotations_compounded = 2 !< corrections are spins: U is the rotation vector of exp(correction) R
   integer, parameter :: rotations_incremental = 3 !< adds: DU is the rotation since the start of the increment, R in SVARS

   integer, parameter :: law_count = 12
   integer, parameter :: law_plugin = 99 !< that of the library which the environment variable FINSHELL_LAWS names
   integer, parameter :: largest = 12 !< number of parameters of any law
   integer, parameter :: key_length = 8 + largest

   !> A section that was built, with what it was built from.
   type :: kept_t
      integer(c_int64_t) :: key(key_length) = 0 !< bit by bit: NaN is a mistake that the library shall name
      type(c_ptr) :: section = c_null_ptr
   end type kept_t

   type(kept_t), allocatable, target :: kept(:)
   integer :: kept_number = 0
   character(len=256) :: message = ''
   integer :: message_code = 0, message_element = 0
   ! A pthread_mutex_t: not more than 64 bytes, and all zero when unlocked.
   integer(c_int64_t) :: mutex(8) = 0

   interface
      integer(c_int) function pthread_mutex_lock(lock) bind(c)
         import :: c_int, c_int64_t
         integer(c_int64_t), intent(inout) :: lock(*)
      end function pthread_mutex_lock

      integer(c_int) function pthread_mutex_unlock(lock) bind(c)
         import :: c_int, c_int64_t
         integer(c_int64_t), intent(inout) :: lock(*)
      end function pthread_mutex_unlock
   end interface

contains

   !> The section that these properties describe, from the shelf or new. Any number of threads may ask at once.
   subroutine section_for(props, section, status)
      real(c_double), intent(in) :: props(:) !< PROPS, complete
      type(c_ptr), intent(out) :: section !< c_null_ptr after an error
      type(status_t), intent(out) :: status
      type(kept_t), allocatable :: more(:)
      real(c_double) :: key(key_length)
      integer(c_int64_t) :: bits(key_length)
      integer :: i, m, ignored

      section = c_null_ptr
      m = nint(props(12))
      key = 0
      key(:7) = props(:7)
      key(8) = m
      key(9:8 + m) = props(first_parameter:first_parameter + m - 1)
      bits = transfer(key, bits)
      ignored = pthread_mutex_lock(mutex)
      do i = 1, kept_number
         if (any(bits /= kept(i)%key)) cycle
         section = kept(i)%section
         exit
      end do
      status%code = 0
      if (.not. c_associated(section)) then
         call build(key, section, status)
         if (c_associated(section)) then
            if (.not. allocated(kept)) allocate (kept(8))
            if (kept_number == size(kept)) then
               allocate (more(2*kept_number))
               more(:kept_number) = kept
               call move_alloc(more, kept)
            end if
            kept_number = kept_number + 1
            kept(kept_number)%key = bits
            kept(kept_number)%section = section
         end if
      end if
      ignored = pthread_mutex_unlock(mutex)
   end subroutine section_for

   subroutine build(key, section, status)
      real(c_double), intent(in) :: key(key_length)
      type(c_ptr), intent(out) :: section
      type(status_t), intent(out) :: status
      character(kind=c_char, len=17), target :: options(5)
      character(kind=c_char, len=32), target :: names(largest)
      character(len=24) :: law
      character(len=11) :: parameters(largest)
      type(finshell_parameter) :: information
      type(c_ptr) :: option_names(5), parameter_names(largest)
      real(c_double) :: values(5)
      integer(c_int32_t) :: code
      integer :: i, m, n

      call law_of(nint(key(1)), law, parameters)
      m = nint(key(8))
      do i = 1, m
         names(i) = trim(parameters(i))//c_null_char
         if (nint(key(1)) == law_plugin) then
            ! too many: the library shall say so, to which a name that is unknown is given
            names(i) = 'more'//c_null_char
            if (finshell_material_parameter(trim(law)//c_null_char, i - 1, information) == 0) &
               names(i) = transfer(information%name, names(i))
         end if
         parameter_names(i) = c_loc(names(i))
      end do
      n = 0
      ! zero stands for the default
      call choose('thickness_points', key(3))
      call choose('formulation', key(4))
      call choose('beta0', key(5))
      call choose('density', key(6))
      call choose('offset', key(7))
      code = finshell_section_create(trim(law)//c_null_char, m, parameter_names, key(9), key(2), n, option_names, values, &
                                     section, status)

   contains

      subroutine choose(name, value)
         character(len=*), intent(in) :: name
         real(c_double), intent(in) :: value
         if (abs(value) <= 0) return
         n = n + 1
         options(n) = name//c_null_char
         option_names(n) = c_loc(options(n))
         values(n) = value
      end subroutine choose
   end subroutine build

   !> Name and parameters of the law with a number. The numbers are for input files and never change.
   pure subroutine law_of(number, law, parameters)
      integer, intent(in) :: number
      character(len=24), intent(out) :: law !< blank for an unknown number
      character(len=11), intent(out) :: parameters(largest)
      law = ''
      parameters = ''
      select case (number)
      case (1)
         law = 'st_venant_kirchhoff'
         parameters(:2) = [character(len=11) :: 'e', 'nu']
      case (2)
         law = 'neo_hookean'
         parameters(:1) = [character(len=11) :: 'mu']
      case (3)
         law = 'mooney_rivlin'
         parameters(:2) = [character(len=11) :: 'c10', 'c01']
      case (4)
         law = 'yeoh'
         parameters(:3) = [character(len=11) :: 'c1', 'c2', 'c3']
      case (5)
         law = 'gent'
         parameters(:2) = [character(len=11) :: 'mu', 'jm']
      case (6)
         law = 'ogden'
         parameters = [character(len=11) :: 'mu1', 'alpha1', 'mu2', 'alpha2', 'mu3', 'alpha3', 'mu4', 'alpha4', 'mu5', 'alpha5', &
                       'mu6', 'alpha6']
      case (7)
         law = 'compressible_neo_hookean'
         parameters(:2) = [character(len=11) :: 'e', 'nu']
      case (8)
         law = 'compressible_neo_hookean'
         parameters(:2) = [character(len=11) :: 'mu', 'lambda']
      case (9)
         law = 'orthotropic'
         parameters(:6) = [character(len=11) :: 'e1', 'e2', 'nu12', 'g12', 'nu13', 'nu23']
      case (10)
         law = 'exponential_fibre'
         parameters(:4) = [character(len=11) :: 'c0', 'c1', 'c2', 'e_reference']
      case (11)
         law = 'holzapfel_2005'
         parameters(:4) = [character(len=11) :: 'mu', 'k1', 'k2', 'rho']
      case (law_plugin)
         law = 'plugin'
      case (law_count)
         law = 'holzapfel_gasser_ogden'
         parameters(:5) = [character(len=11) :: 'c', 'k1', 'k2', 'kappa', 'angle']
      end select
   end subroutine law_of

   !> FINSHELL_ROTATION_... for PROPS(8); 0 for an unknown one.
   pure integer function convention_of(rotations)
      integer, intent(in) :: rotations
      convention_of = 0
      if (rotations == 0) convention_of = 1
      if (rotations >= rotations_added .and. rotations <= rotations_incremental) convention_of = rotations
   end function convention_of

   !> Normals on the side of the triangle's own, which is also the one of a node without (0, 0, 0).
   pure subroutine complete_normals(x, normal)
      real(c_double), intent(in) :: x(3, 3)
      real(c_double), intent(inout) :: normal(3, 3)
      real(c_double) :: own(3)
      integer :: k
      associate (a => x(:, 2) - x(:, 1), b => x(:, 3) - x(:, 1))
         own = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
      end associate
      do k = 1, 3
         if (all(abs(normal(:, k)) <= 0)) normal(:, k) = own
         if (dot_product(normal(:, k), own) < 0) normal(:, k) = -normal(:, k)
      end do
   end subroutine complete_normals

   !> What went wrong last, in whatever thread: for a host's own routine (UEXTERNALDB, say) to print.
   subroutine last_message(code, element, text)
      integer, intent(out) :: code !< as in finshell.h, 0: nothing yet
      integer, intent(out) :: element !< JELEM
      ! allow(C072)
      character(len=*), intent(out) :: text
      integer :: ignored
      ignored = pthread_mutex_lock(mutex)
      code = message_code
      element = message_element
      text = message
      ignored = pthread_mutex_unlock(mutex)
   end subroutine last_message

   subroutine keep_message(code, element, text)
      integer, intent(in) :: code, element
      character(len=*), intent(in) :: text
      integer :: ignored
      ignored = pthread_mutex_lock(mutex)
      message_code = code
      message_element = element
      message = text
      ignored = pthread_mutex_unlock(mutex)
   end subroutine keep_message

   real(c_double) function not_a_number()
      not_a_number = ieee_value(0.0_c_double, ieee_quiet_nan)
   end function not_a_number
end module finshell_uel

!> The routine that the host calls. Arguments as in the manual of Abaqus, section UEL.
! allow(C092)
subroutine uel(rhs, amatrx, svars, energy, ndofel, nrhs, nsvars, props, nprops, coords, mcrd, nnode, u, du, v, a, jtype, time, &
               dtime, kstep, kinc, jelem, params, ndload, jdltyp, adlmag, predef, npredf, lflags, mlvarx, ddlmag, mdload, &
               pnewdt, jprops, njprop, period)
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_int32_t, c_loc, c_null_char, c_ptr, c_sizeof
   use finshell_c, only: finshell_elements, finshell_elements_evaluate, finshell_elements_pressure, finshell_mass_matrix, &
      finshell_rotation_compose, finshell_rotation_exp, finshell_rotation_tangent, finshell_status
   use finshell_uel, only: complete_normals, convention_of, first_parameter, keep_message, law_count, law_plugin, not_a_number, &
      rotations_compounded, rotations_incremental, section_for
   implicit none
   integer, intent(in) :: ndofel, nrhs, nsvars, nprops, mcrd, nnode, jtype, kstep, kinc, jelem, ndload, npredf, mlvarx, mdload, &
      njprop
   real(c_double), intent(inout) :: rhs(mlvarx, *), amatrx(ndofel, ndofel), svars(*), energy(8), pnewdt
   real(c_double), intent(in) :: props(nprops), coords(mcrd, nnode), u(ndofel), du(mlvarx, *), v(ndofel), a(ndofel), time(2), &
      dtime, params(*), adlmag(mdload, *), predef(2, npredf, nnode), ddlmag(mdload, *), period
   integer, intent(in) :: jdltyp(mdload, *), lflags(*), jprops(*)

   ! LFLAGS(3): what is wanted.
   integer, parameter :: want_both = 1, want_stiffness = 2, want_damping = 3, want_mass = 4, want_residual = 5, &
                         want_mass_and_residual = 6, want_output = 100
   ! LFLAGS(1): procedures with inertia forces, direct and with sub-increments of temperature.
   integer, parameter :: dynamic_fixed = 11, dynamic_automatic = 12
   integer, parameter :: pressure_load = 1 ! JDLTYP: load type U1
   integer, parameter :: published = 2 ! PROPS(4): formulation (P), which has no normals
   real(c_double), parameter :: cut = 0.25_c_double ! of the increment, after a recoverable failure
   integer(c_int32_t), parameter :: one = 1, wrong = -1

   type(c_ptr) :: section
   type(finshell_status) :: status
   type(finshell_elements) :: element
   real(c_double), target :: x(3, 3), displacement(3, 3), rotation(3, 3), quaternion(4, 3), state(4, 3), axis(3), normal(3, 3)
   real(c_double) :: next(4, 3), force(18), w(1), load(18)
   integer :: wanted, rotations, behind, i
   integer(c_int32_t) :: code
   logical :: perturbation, with_residual, with_matrix

   wanted = lflags(3)
   perturbation = lflags(4) == 1
   with_residual = wanted == want_both .or. wanted == want_residual .or. wanted == want_mass_and_residual
   with_matrix = wanted == want_both .or. wanted == want_stiffness
   rhs(:ndofel, :nrhs) = 0
   if (.not. with_matrix) amatrx = 0
   if (wanted == want_damping .or. wanted == want_output) return

   ! ------------------------------------------------------------------ what the input file says
   if (ndofel /= 18 .or. nnode /= 3) then
      call refuse('three nodes with degrees of freedom 1 to 6 are expected')
   else if (nprops < first_parameter) then
      call refuse('at least 13 properties are expected: 12 for the section, then the parameters of the law')
   else if (.not. (props(12) >= 1 .and. props(12) <= 12)) then
      call refuse('PROPS(12), the number of parameters, is expected to be 1 to 12')
   else if (.not. (props(1) >= 1 .and. props(1) <= law_count .or. nint(props(1)) == law_plugin)) then
      call refuse('PROPS(1), the number of the law, is not known')
   else if (.not. (props(8) >= 0 .and. props(8) <= rotations_incremental)) then
      call refuse('PROPS(8), the treatment of rotations, is expected to be 1, 2 or 3')
   else if (all(nprops - (first_parameter - 1 + nint(props(12))) /= [0, 9, 18])) then
      call refuse('the number of properties is expected to be 12 + PROPS(12), or 9 more with the coordinates of the nodes, '// &
                  'or 18 more with coordinates and normals')
   else if (nprops == first_parameter - 1 + nint(props(12)) .and. mcrd < 3) then
      call refuse('the host gives no third coordinate: write the nine coordinates of the nodes behind the other properties')
   else if (nint(props(8)) == rotations_incremental .and. nsvars < 12) then
      call refuse('PROPS(8) = 3 needs 12 state variables (VARIABLES=12)')
   else if (wanted < want_both .or. wanted > want_mass_and_residual) then
      call refuse('LFLAGS(3) is not known')
   else if ((lflags(1) == dynamic_fixed .or. lflags(1) == dynamic_automatic) .and. wanted /= want_mass) then
      call refuse('direct-integration dynamics is not covered')
   else
      code = 0
   end if
   if (code /= 0) return
   do i = 1, ndload
      if (jdltyp(i, 1) == pressure_load) cycle
      call refuse('the only distributed load is U1, a follower pressure along the normal')
      return
   end do
   call section_for(props, section, status)
   if (.not. c_associated(section)) then
      code = status%code
      call give_up()
      return
   end if

   ! ------------------------------------------------------------------ geometry and rotations
   behind = first_parameter + nint(props(12)) ! of the properties, where coordinates begin
   normal = 0
   if (nprops > behind) then
      x = reshape(props(behind:), [3, 3])
      if (nprops > behind + 9) normal = reshape(props(behind + 9:), [3, 3])
   else
      x = coords(:3, :3)
      if (mcrd >= 6) normal = coords(4:6, :3)
   end if
   do i = 1, 3
      displacement(:, i) = u(6*i - 5:6*i - 3)
      rotation(:, i) = u(6*i - 2:6*i)
   end do
   axis = props(9:11)
   element%size = c_sizeof(element)
   element%n = 1
   element%threads = 1
   element%x = c_loc(x)
   element%u = c_loc(displacement)
   element%rotations = c_loc(rotation)
   if (any(abs(axis) > 0)) element%direction = c_loc(axis)
   if (.not. all(abs(normal) <= 0) .and. nint(props(4)) /= published) then
      call complete_normals(x, normal)
      element%normals = c_loc(normal)
   end if
   rotations = convention_of(nint(props(8)))
   element%convention = rotations
   select case (rotations)
   case (rotations_compounded)
      code = finshell_rotation_exp(3, rotation, quaternion, status=status)
      element%rotations = c_loc(quaternion)
   case (rotations_incremental)
      element%state = c_loc(state)
      ! in a perturbation step DU is the perturbation, and the base state is the state
      do i = 1, 3
         rotation(:, i) = 0
         if (.not. perturbation) rotation(:, i) = du(6*i - 2:6*i, 1)
         state(:, i) = svars(4*i - 3:4*i)
         if (all(abs(state(:, i)) <= 0)) state(:, i) = [1.0_c_double, 0.0_c_double, 0.0_c_double, 0.0_c_double]
      end do
      code = finshell_rotation_exp(3, rotation, quaternion, status=status)
      if (code == 0) code = finshell_rotation_compose(3, quaternion, state, next, status=status)
   end select
   if (code /= 0) then
      call give_up()
      return
   end if

   ! ------------------------------------------------------------------ mass
   if (wanted == want_mass .or. wanted == want_mass_and_residual) then
      code = finshell_mass_matrix(section, one, x, amatrx, status=status)
      if (code == 0 .and. rotations /= rotations_compounded) call rates_of_vectors()
      if (code /= 0) then
         call give_up()
         return
      end if
   end if
   if (wanted == want_mass) return

   ! ------------------------------------------------------------------ force and stiffness
   if (with_matrix) then
      code = finshell_elements_evaluate(section, element, w, force, amatrx, status=status)
   else
      code = finshell_elements_evaluate(section, element, w, force, status=status)
   end if
   if (code /= 0) then
      call give_up()
      return
   end if
   energy = 0
   energy(2) = w(1)
   if (rotations == rotations_incremental .and. .not. perturbation) svars(:12) = reshape(next, [12])
   ! the forces of the base state are in equilibrium: a perturbation begins from zero
   if (with_residual .and. .not. perturbation) rhs(:18, 1) = -force
   do i = 1, ndload
      call add_pressure(adlmag(i, 1), load, with_matrix)
      if (code /= 0) then
         call give_up()
         return
      end if
      if (with_residual) rhs(:18, 1) = rhs(:18, 1) + load
      if (nrhs < 2 .or. perturbation) cycle
      call add_pressure(ddlmag(i, 1), load, .false.)
      rhs(:18, 2) = rhs(:18, 2) + load
   end do

contains

   !> Follower pressure on the surface that the element has: its force and, subtracted from the tangent, its stiffness.
   subroutine add_pressure(pressure, nodal, with_stiffness)
      real(c_double), intent(in) :: pressure
      real(c_double), intent(out) :: nodal(18)
      logical, intent(in) :: with_stiffness
      real(c_double) :: k(18, 18)
      nodal = 0
      if (with_stiffness) then
         code = finshell_elements_pressure(element, [pressure], 0_c_int32_t, force=nodal, stiffness=k, status=status)
         if (code == 0) amatrx = amatrx - transpose(k) ! by rows, as C writes it
      else
         code = finshell_elements_pressure(element, [pressure], 0_c_int32_t, force=nodal, status=status)
      end if
   end subroutine add_pressure

   !> The mass matrix refers to spins; with rotation vectors they are T times the rates.
   subroutine rates_of_vectors()
      real(c_double) :: t(3, 3, 3)
      integer :: n, p
      ! by rows, as C writes it: the transposed matrices in Fortran
      code = finshell_rotation_tangent(3, rotation, t, status=status)
      if (code /= 0) return
      do n = 1, 3
         p = 6*n - 2
         amatrx(:, p:p + 2) = matmul(amatrx(:, p:p + 2), transpose(t(:, :, n)))
         amatrx(p:p + 2, :) = matmul(t(:, :, n), amatrx(p:p + 2, :))
      end do
   end subroutine rates_of_vectors

   subroutine refuse(text)
      character(len=*), intent(in) :: text
      code = wrong
      call keep_message(wrong, jelem, text)
      call fail()
   end subroutine refuse

   !> As the library says in `status`.
   subroutine give_up()
      character(len=244) :: text
      integer :: c
      text = ''
      do c = 1, size(status%message)
         if (status%message(c) == c_null_char) exit
         text(c:c) = status%message(c)
      end do
      call keep_message(code, jelem, text)
      call fail()
   end subroutine give_up

   !> Ask for a smaller increment. A mistake, and a failure under a host that does not look at PNEWDT (which then comes as 0),
   !> must not pass for an element without force.
   subroutine fail()
      logical :: heard
      heard = pnewdt > 0
      pnewdt = min(pnewdt, cut)
      rhs(:ndofel, :nrhs) = 0
      amatrx = 0
      if (code < 0 .or. .not. heard) rhs(:ndofel, 1) = not_a_number()
   end subroutine fail
end subroutine uel
