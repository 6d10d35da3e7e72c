!> St Venant-Kirchhoff: isotropic, linear between second Piola-Kirchhoff stress and Green-Lagrange strain.
!>
!> The isotropic case of finshell_orthotropic: E33 = -nu/(1 - nu) (E11 + E22) by plane stress.
module finshell_st_venant_kirchhoff
   use finshell_kinds, only: wp
   use finshell_material, only: material_t
   use finshell_orthotropic, only: linear_t
   use finshell_parameter, only: parameter_t, required_parameter
   implicit none
   private
   public :: st_venant_kirchhoff_parameters, new_st_venant_kirchhoff

contains

   pure function st_venant_kirchhoff_parameters() result(parameters)
      type(parameter_t), allocatable :: parameters(:)
      parameters = [required_parameter('e', 'Young''s modulus (stress)', 1000.0_wp), &
                    required_parameter('nu', 'Poisson''s ratio, -1 < nu < 0.5', 0.3_wp)]
   end function st_venant_kirchhoff_parameters

   !> The law from its parameters; `message` is allocated when they make no sense.
   subroutine new_st_venant_kirchhoff(values, law, message)
      real(wp), intent(in) :: values(:) !< in the order of `st_venant_kirchhoff_parameters`
      class(material_t), allocatable, intent(out) :: law
      character(len=:), allocatable, intent(out) :: message
      type(linear_t) :: linear
      real(wp) :: modulus
      associate (e => values(1), nu => values(2))
         if (.not. e > 0.0_wp) then
            message = 'e must be positive'
         else if (.not. (nu > -1.0_wp .and. nu < 0.5_wp)) then
            message = 'nu must lie between -1 and 0.5 (use neo_hookean or mooney_rivlin for an incompressible material)'
         else
            modulus = e/((1.0_wp - nu)*(1.0_wp + nu))
            linear%d11 = modulus
            linear%d22 = modulus
            linear%d12 = modulus*nu
            linear%d33 = 0.5_wp*e/(1.0_wp + nu)
            linear%k1 = nu/(1.0_wp - nu)
            linear%k2 = linear%k1
         end if
      end associate
      linear%isotropic = .true.
      linear%linear = .true.
      law = linear
   end subroutine new_st_venant_kirchhoff
end module finshell_st_venant_kirchhoff
