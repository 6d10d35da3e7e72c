!> Holzapfel, Sommer, Gasser & Regitnig 2005: W = mu (I1 - 3) + k1/k2 {exp[k2 ((1 - rho) (I1 - 3)^2 + rho <I4 - 1>^2)] - 1}.
!>
!> Incompressible, one family of fibres along material axis 1, in tension only. The shear modulus of the ground substance is 2 mu.
module finshell_holzapfel_2005
   use finshell_elementary, only: exp_remainder
   use finshell_exponential_fibre, only: largest_exponent
   use finshell_invariant_law, only: invariant_law_t, response_t
   use finshell_kinds, only: wp, strip
   use finshell_material, only: material_t
   use finshell_parameter, only: parameter_t, required_parameter
   implicit none
   private
   public :: holzapfel_2005_t, holzapfel_2005_parameters, new_holzapfel_2005

   type, extends(invariant_law_t) :: holzapfel_2005_t
      real(wp) :: mu = 0.0_wp, k1 = 0.0_wp, k2 = 1.0_wp, rho = 0.0_wp
   contains
      procedure :: response
      procedure :: reference_tangent
   end type holzapfel_2005_t

contains

   pure function holzapfel_2005_parameters() result(parameters)
      type(parameter_t), allocatable :: parameters(:)
      parameters = [required_parameter('mu', 'coefficient of I1 - 3, half the shear modulus (stress)', 1.27_wp), &
                    required_parameter('k1', 'scale of the exponential term (stress)', 21.6_wp), &
                    required_parameter('k2', 'exponent', 8.21_wp), &
                    required_parameter('rho', 'share of the fibres in the exponent, 0 to 1', 0.25_wp)]
   end function holzapfel_2005_parameters

   !> The law from its parameters; `message` is allocated when they make no sense.
   subroutine new_holzapfel_2005(values, law, message)
      real(wp), intent(in) :: values(:) !< in the order of `holzapfel_2005_parameters`
      class(material_t), allocatable, intent(out) :: law
      character(len=:), allocatable, intent(out) :: message
      type(holzapfel_2005_t) :: made
      if (.not. values(1) > 0.0_wp) message = 'mu must be positive'
      if (.not. values(2) >= 0.0_wp) message = 'k1 must not be negative'
      if (.not. values(3) > 0.0_wp) message = 'k2 must be positive'
      if (.not. (values(4) >= 0.0_wp .and. values(4) <= 1.0_wp)) message = 'rho must lie between 0 and 1'
      made%fibre = 0.0_wp
      made%fibre(1, :) = 1.0_wp
      made%isotropic = .false.
      made%switched = .true.
      made%families = 1
      made%mu = values(1)
      made%k1 = values(2)
      made%k2 = values(3)
      made%rho = values(4)
      allocate (law, source=made)
   end subroutine new_holzapfel_2005

   pure subroutine response(self, x1, x4, r)
      class(holzapfel_2005_t), intent(in) :: self
      real(wp), intent(in) :: x1(strip), x4(strip, 2)
      type(response_t), intent(inout) :: r
      real(wp) :: q(strip), m(strip), c1, c2, f, g, g1, g4
      integer :: i
      c1 = self%k2*(1.0_wp - self%rho)
      c2 = self%k2*self%rho
      do i = 1, strip
         f = max(x4(i, 1), 0.0_wp)
         q(i) = c1*x1(i)*x1(i) + c2*f*f
         r%valid(i) = q(i) < largest_exponent
         q(i) = merge(q(i), 0.0_wp, r%valid(i))
      end do
      call exp_remainder(strip, q, m)
      do i = 1, strip
         f = max(x4(i, 1), 0.0_wp)
         g = self%k1/self%k2*(1.0_wp + (q(i) + m(i)))
         g1 = 2.0_wp*c1*x1(i)
         g4 = 2.0_wp*c2*f
         r%w(i) = self%mu*x1(i) + self%k1/self%k2*(q(i) + m(i))
         r%w1(i) = self%mu + g*g1
         r%w4(i, 1) = g*g4
         r%w11(i) = g*(g1*g1 + 2.0_wp*c1)
         r%w14(i, 1) = g*g1*g4
         r%w44(i, 1) = g*(g4*g4 + merge(2.0_wp*c2, 0.0_wp, x4(i, 1) > r%threshold(i, 1)))
      end do
   end subroutine response

   !> Of the ground substance: the fibres count as slack.
   pure function reference_tangent(self) result(d)
      class(holzapfel_2005_t), intent(in) :: self
      real(wp) :: d(6)
      d = self%mu*[8.0_wp, 8.0_wp, 2.0_wp, 4.0_wp, 0.0_wp, 0.0_wp]
   end function reference_tangent
end module finshell_holzapfel_2005
