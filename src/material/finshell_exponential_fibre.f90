!> The paper's law for a heart valve leaflet, eq. (41): W = c0 {exp[c1 (I1 - 3)^2 + c2 <I4 - 1>^2] - 1}, incompressible.
!>
!> Fibres along material axis 1, in tension only. The law has no stiffness at all in the reference state: isotropic
!> stress starts with the cube of the strain. The tangent jumps by 8 c0 c2 where fibres begin to be stretched; at I4 = 1
!> they count as slack unless a direction says otherwise (finshell_material).
module finshell_exponential_fibre
   use finshell_elementary, only: exp_remainder
   use finshell_invariant_law, only: invariant_law_t, response_t
   use finshell_kinds, only: wp, strip
   use finshell_material, only: material_t
   use finshell_parameter, only: parameter_t, optional_parameter, required_parameter
   implicit none
   private
   public :: exponential_fibre_t, exponential_fibre_parameters, new_exponential_fibre, largest_exponent

   type, extends(invariant_law_t) :: exponential_fibre_t
      real(wp) :: c0 = 0.0_wp, c1 = 0.0_wp, c2 = 0.0_wp
      real(wp) :: e_reference = 0.0_wp
   contains
      procedure :: response
      procedure :: reference_tangent
   end type exponential_fibre_t

   !> Beyond this exponent an exponential law is left and the step is cut; e^50 = 5e21.
   real(wp), parameter :: largest_exponent = 50.0_wp

contains

   pure function exponential_fibre_parameters() result(parameters)
      type(parameter_t), allocatable :: parameters(:)
      parameters = [required_parameter('c0', 'scale (stress)', 188.0_wp), &
                    required_parameter('c1', 'exponent of the matrix, factor of (I1 - 3)^2', 5.07_wp), &
                    required_parameter('c2', 'exponent of the fibres, factor of (I4 - 1)^2', 2.33_wp), &
                    optional_parameter('e_reference', 0.0_wp, &
                                       'Young''s modulus for drilling (stress); 0 means 0.3 c0 c1, the secant at 10 %', 0.0_wp)]
   end function exponential_fibre_parameters

   !> The law from its parameters; `message` is allocated when they make no sense.
   subroutine new_exponential_fibre(values, law, message)
      real(wp), intent(in) :: values(:) !< in the order of `exponential_fibre_parameters`
      class(material_t), allocatable, intent(out) :: law
      character(len=:), allocatable, intent(out) :: message
      type(exponential_fibre_t) :: made
      if (.not. values(1) > 0.0_wp) message = 'c0 must be positive'
      if (.not. values(2) > 0.0_wp) message = 'c1 must be positive'
      if (.not. values(3) >= 0.0_wp) message = 'c2 must not be negative'
      if (.not. values(4) >= 0.0_wp) message = 'e_reference must not be negative'
      made%fibre = 0.0_wp
      made%fibre(1, :) = 1.0_wp
      made%isotropic = .false.
      made%switched = .true.
      made%families = 1
      made%c0 = values(1)
      made%c1 = values(2)
      made%c2 = values(3)
      made%e_reference = values(4)
      allocate (law, source=made)
   end subroutine new_exponential_fibre

   pure subroutine response(self, x1, x4, r)
      class(exponential_fibre_t), intent(in) :: self
      real(wp), intent(in) :: x1(strip), x4(strip, 2)
      type(response_t), intent(inout) :: r
      real(wp) :: q(strip), m(strip), f, g, g1, g4
      integer :: i
      do i = 1, strip
         f = max(x4(i, 1), 0.0_wp)
         q(i) = self%c1*x1(i)*x1(i) + self%c2*f*f
         r%valid(i) = q(i) < largest_exponent
         q(i) = merge(q(i), 0.0_wp, r%valid(i))
      end do
      call exp_remainder(strip, q, m)
      do i = 1, strip
         f = max(x4(i, 1), 0.0_wp)
         g = self%c0*(1.0_wp + (q(i) + m(i)))
         g1 = 2.0_wp*self%c1*x1(i)
         g4 = 2.0_wp*self%c2*f
         r%w(i) = self%c0*(q(i) + m(i))
         r%w1(i) = g*g1
         r%w4(i, 1) = g*g4
         r%w11(i) = g*(g1*g1 + 2.0_wp*self%c1)
         r%w14(i, 1) = g*g1*g4
         r%w44(i, 1) = g*(g4*g4 + merge(2.0_wp*self%c2, 0.0_wp, x4(i, 1) > r%threshold(i, 1)))
      end do
   end subroutine response

   !> There is none: an isotropic incompressible one of the prescribed modulus stands in for it.
   pure function reference_tangent(self) result(d)
      class(exponential_fibre_t), intent(in) :: self
      real(wp) :: d(6)
      real(wp) :: e
      e = merge(self%e_reference, 0.3_wp*self%c0*self%c1, self%e_reference > 0.0_wp)
      d = e/3.0_wp*[4.0_wp, 4.0_wp, 1.0_wp, 2.0_wp, 0.0_wp, 0.0_wp]
   end function reference_tangent
end module finshell_exponential_fibre
