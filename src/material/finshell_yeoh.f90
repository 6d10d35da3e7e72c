!> Yeoh: W = c1 (I1 - 3) + c2 (I1 - 3)^2 + c3 (I1 - 3)^3, incompressible.
module finshell_yeoh
   use finshell_invariant_law, only: invariant_law_t, response_t
   use finshell_kinds, only: wp, strip
   use finshell_material, only: material_t
   use finshell_parameter, only: parameter_t, optional_parameter, required_parameter
   implicit none
   private
   public :: yeoh_t, yeoh_parameters, new_yeoh

   type, extends(invariant_law_t) :: yeoh_t
      real(wp) :: c1 = 0.0_wp, c2 = 0.0_wp, c3 = 0.0_wp
   contains
      procedure :: response
      procedure :: reference_tangent
   end type yeoh_t

contains

   pure function yeoh_parameters() result(parameters)
      type(parameter_t), allocatable :: parameters(:)
      parameters = [required_parameter('c1', 'coefficient of I1 - 3, half the shear modulus (stress)', 80.0_wp), &
                    optional_parameter('c2', 0.0_wp, 'coefficient of (I1 - 3)^2 (stress)', -2.0_wp), &
                    optional_parameter('c3', 0.0_wp, 'coefficient of (I1 - 3)^3 (stress)', 0.5_wp)]
   end function yeoh_parameters

   !> The law from its parameters; `message` is allocated when they make no sense.
   subroutine new_yeoh(values, law, message)
      real(wp), intent(in) :: values(:) !< in the order of `yeoh_parameters`
      class(material_t), allocatable, intent(out) :: law
      character(len=:), allocatable, intent(out) :: message
      type(yeoh_t) :: made
      if (.not. values(1) > 0.0_wp) message = 'c1 must be positive'
      made%c1 = values(1)
      made%c2 = values(2)
      made%c3 = values(3)
      allocate (law, source=made)
   end subroutine new_yeoh

   pure subroutine response(self, x1, x4, r)
      class(yeoh_t), intent(in) :: self
      real(wp), intent(in) :: x1(strip), x4(strip, 2)
      type(response_t), intent(inout) :: r
      integer :: i
      do i = 1, strip
         r%w(i) = x1(i)*(self%c1 + x1(i)*(self%c2 + x1(i)*self%c3))
         r%w1(i) = self%c1 + x1(i)*(2.0_wp*self%c2 + x1(i)*3.0_wp*self%c3)
         r%w11(i) = 2.0_wp*self%c2 + x1(i)*6.0_wp*self%c3
      end do
   end subroutine response

   pure function reference_tangent(self) result(d)
      class(yeoh_t), intent(in) :: self
      real(wp) :: d(6)
      d = self%c1*[8.0_wp, 8.0_wp, 2.0_wp, 4.0_wp, 0.0_wp, 0.0_wp]
   end function reference_tangent
end module finshell_yeoh
