!> Incompressible neo-Hookean: W = mu/2 (I1 - 3), which is Mooney-Rivlin with c10 = mu/2 and c01 = 0.
module finshell_neo_hookean
   use finshell_kinds, only: wp
   use finshell_material, only: material_t
   use finshell_mooney_rivlin, only: new_mooney_rivlin
   use finshell_parameter, only: parameter_t, required_parameter
   implicit none
   private
   public :: neo_hookean_parameters, new_neo_hookean

contains

   pure function neo_hookean_parameters() result(parameters)
      type(parameter_t), allocatable :: parameters(:)
      parameters = [required_parameter('mu', 'shear modulus (stress)', 200.0_wp)]
   end function neo_hookean_parameters

   !> The law from its parameters; `message` is allocated when they make no sense.
   subroutine new_neo_hookean(values, law, message)
      real(wp), intent(in) :: values(:)
      class(material_t), allocatable, intent(out) :: law
      character(len=:), allocatable, intent(out) :: message
      call new_mooney_rivlin([0.5_wp*values(1), 0.0_wp], law, message)
      if (allocated(message)) message = 'mu must be positive'
   end subroutine new_neo_hookean
end module finshell_neo_hookean
