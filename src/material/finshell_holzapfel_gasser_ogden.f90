!> Gasser, Ogden & Holzapfel 2006: two families of dispersed fibres at +-angle to material axis 1, incompressible.
!>
!> W = c/2 (I1 - 3) + k1/(2 k2) sum_f {exp[k2 <E_f>^2] - 1}, E_f = kappa (I1 - 3) + (1 - 3 kappa) (I4_f - 1); kappa = 0 gives
!> Holzapfel, Gasser & Ogden 2000, kappa = 1/3 an isotropic law. A family acts only while E_f > 0.
module finshell_holzapfel_gasser_ogden
   use finshell_elementary, only: exp_remainder
   use finshell_exponential_fibre, only: largest_exponent
   use finshell_invariant_law, only: invariant_law_t, response_t
   use finshell_kinds, only: wp, strip
   use finshell_material, only: material_t
   use finshell_parameter, only: parameter_t, optional_parameter, required_parameter
   implicit none
   private
   public :: holzapfel_gasser_ogden_t, holzapfel_gasser_ogden_parameters, new_holzapfel_gasser_ogden

   type, extends(invariant_law_t) :: holzapfel_gasser_ogden_t
      real(wp) :: c = 0.0_wp, k1 = 0.0_wp, k2 = 1.0_wp
   contains
      procedure :: response
      procedure :: reference_tangent
   end type holzapfel_gasser_ogden_t

contains

   pure function holzapfel_gasser_ogden_parameters() result(parameters)
      type(parameter_t), allocatable :: parameters(:)
      parameters = [required_parameter('c', 'shear modulus of the ground substance (stress)', 7.64_wp), &
                    required_parameter('k1', 'scale of the fibre term (stress)', 996.6_wp), &
                    required_parameter('k2', 'exponent', 5.246_wp), &
                    optional_parameter('kappa', 0.0_wp, 'dispersion, 0 (aligned) to 1/3 (isotropic)', 0.1_wp), &
                    required_parameter('angle', 'of the two families to material axis 1 (degrees)', 40.0_wp)]
   end function holzapfel_gasser_ogden_parameters

   !> The law from its parameters; `message` is allocated when they make no sense.
   subroutine new_holzapfel_gasser_ogden(values, law, message)
      real(wp), intent(in) :: values(:) !< in the order of `holzapfel_gasser_ogden_parameters`
      class(material_t), allocatable, intent(out) :: law
      character(len=:), allocatable, intent(out) :: message
      type(holzapfel_gasser_ogden_t) :: made
      real(wp) :: angle
      if (.not. values(1) > 0.0_wp) message = 'c must be positive'
      if (.not. values(2) >= 0.0_wp) message = 'k1 must not be negative'
      if (.not. values(3) > 0.0_wp) message = 'k2 must be positive'
      if (.not. (values(4) >= 0.0_wp .and. 3.0_wp*values(4) <= 1.0_wp)) message = 'kappa must lie between 0 and 1/3'
      if (.not. abs(values(5)) <= 90.0_wp) message = 'angle must lie between -90 and 90 degrees'
      angle = values(5)*(atan(1.0_wp)/45.0_wp)
      made%fibre(1, :) = cos(angle)**2
      made%fibre(2, :) = sin(angle)**2
      made%fibre(3, :) = cos(angle)*sin(angle)*[1.0_wp, -1.0_wp]
      made%isotropic = .false.
      made%switched = .true.
      made%families = 2
      made%c = values(1)
      made%k1 = values(2)
      made%k2 = values(3)
      made%kappa = values(4)
      allocate (law, source=made)
   end subroutine new_holzapfel_gasser_ogden

   pure subroutine response(self, x1, x4, r)
      class(holzapfel_gasser_ogden_t), intent(in) :: self
      real(wp), intent(in) :: x1(strip), x4(strip, 2)
      type(response_t), intent(inout) :: r
      real(wp) :: x(strip), f(strip), q(strip), m(strip), a, g, h
      integer :: i, j
      a = 1.0_wp - 3.0_wp*self%kappa
      do i = 1, strip
         r%w(i) = 0.5_wp*self%c*x1(i)
         r%w1(i) = 0.5_wp*self%c
      end do
      do j = 1, 2
         do i = 1, strip
            x(i) = self%kappa*x1(i) + a*x4(i, j)
            f(i) = max(x(i), 0.0_wp)
            q(i) = self%k2*f(i)*f(i)
            r%valid(i) = r%valid(i) .and. q(i) < largest_exponent
            q(i) = min(q(i), largest_exponent)
         end do
         call exp_remainder(strip, q, m)
         do i = 1, strip
            g = self%k1*(1.0_wp + (q(i) + m(i)))
            h = merge(g*(1.0_wp + 2.0_wp*q(i)), 0.0_wp, x(i) > r%threshold(i, j))
            r%w(i) = r%w(i) + 0.5_wp*self%k1/self%k2*(q(i) + m(i))
            r%w1(i) = r%w1(i) + self%kappa*g*f(i)
            r%w4(i, j) = a*g*f(i)
            r%w11(i) = r%w11(i) + self%kappa*self%kappa*h
            r%w14(i, j) = self%kappa*a*h
            r%w44(i, j) = a*a*h
         end do
      end do
   end subroutine response

   !> Of the ground substance: the fibres count as slack.
   pure function reference_tangent(self) result(d)
      class(holzapfel_gasser_ogden_t), intent(in) :: self
      real(wp) :: d(6)
      d = self%c*[4.0_wp, 4.0_wp, 1.0_wp, 2.0_wp, 0.0_wp, 0.0_wp]
   end function reference_tangent
end module finshell_holzapfel_gasser_ogden
