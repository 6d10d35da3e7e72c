!> Gent: W = -(mu jm/2) ln(1 - (I1 - 3)/jm), incompressible; the chains lock at I1 - 3 = jm.
module finshell_gent
   use finshell_elementary, only: log_remainder
   use finshell_invariant_law, only: invariant_law_t, response_t
   use finshell_kinds, only: wp, strip
   use finshell_material, only: material_t
   use finshell_parameter, only: parameter_t, required_parameter
   implicit none
   private
   public :: gent_t, gent_parameters, new_gent

   type, extends(invariant_law_t) :: gent_t
      real(wp) :: mu = 0.0_wp, jm = 1.0_wp
   contains
      procedure :: response
      procedure :: reference_tangent
   end type gent_t

   !> The law is left, and the step cut, when this fraction of jm remains: the stiffness has grown by the square of its inverse.
   real(wp), parameter :: margin = 1.0e-4_wp

contains

   pure function gent_parameters() result(parameters)
      type(parameter_t), allocatable :: parameters(:)
      parameters = [required_parameter('mu', 'shear modulus (stress)', 200.0_wp), &
                    required_parameter('jm', 'value of I1 - 3 at which the material locks', 30.0_wp)]
   end function gent_parameters

   !> The law from its parameters; `message` is allocated when they make no sense.
   subroutine new_gent(values, law, message)
      real(wp), intent(in) :: values(:) !< in the order of `gent_parameters`
      class(material_t), allocatable, intent(out) :: law
      character(len=:), allocatable, intent(out) :: message
      type(gent_t) :: made
      if (.not. values(1) > 0.0_wp) message = 'mu must be positive'
      if (.not. values(2) > 0.0_wp) message = 'jm must be positive'
      made%mu = values(1)
      made%jm = values(2)
      allocate (law, source=made)
   end subroutine new_gent

   pure subroutine response(self, x1, x4, r)
      class(gent_t), intent(in) :: self
      real(wp), intent(in) :: x1(strip), x4(strip, 2)
      type(response_t), intent(inout) :: r
      real(wp) :: z(strip), m(strip), g
      integer :: i
      do i = 1, strip
         r%valid(i) = x1(i) < (1.0_wp - margin)*self%jm
         z(i) = merge(-x1(i)/self%jm, 0.0_wp, r%valid(i))
      end do
      call log_remainder(strip, z, m)
      do i = 1, strip
         g = 1.0_wp/(1.0_wp + z(i))
         r%w(i) = 0.5_wp*self%mu*self%jm*(m(i) - z(i))
         r%w1(i) = 0.5_wp*self%mu*g
         r%w11(i) = 0.5_wp*self%mu*g*g/self%jm
      end do
   end subroutine response

   pure function reference_tangent(self) result(d)
      class(gent_t), intent(in) :: self
      real(wp) :: d(6)
      d = self%mu*[4.0_wp, 4.0_wp, 1.0_wp, 2.0_wp, 0.0_wp, 0.0_wp]
   end function reference_tangent
end module finshell_gent
