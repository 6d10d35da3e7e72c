!> The one place that lists the material laws. A new law is one file, one `use` and one line in each `select case` here.
module finshell_registry
   use finshell_compressible_neo_hookean, only: compressible_neo_hookean_parameters, new_compressible_neo_hookean
   use finshell_error, only: error_t, raise, text_of
   use finshell_exponential_fibre, only: exponential_fibre_parameters, new_exponential_fibre
   use finshell_gent, only: gent_parameters, new_gent
   use finshell_holzapfel_2005, only: holzapfel_2005_parameters, new_holzapfel_2005
   use finshell_holzapfel_gasser_ogden, only: holzapfel_gasser_ogden_parameters, new_holzapfel_gasser_ogden
   use finshell_kinds, only: wp, dp
   use finshell_material, only: material_t
   use finshell_mooney_rivlin, only: mooney_rivlin_parameters, new_mooney_rivlin
   use finshell_neo_hookean, only: neo_hookean_parameters, new_neo_hookean
   use finshell_ogden, only: ogden_parameters, new_ogden
   use finshell_orthotropic, only: orthotropic_parameters, new_orthotropic
   use finshell_outside_law, only: description_t, new_outside_law
   use finshell_parameter, only: parameter_t, lower
   use finshell_parameter_values, only: read_values
   use finshell_plugin, only: is_plugin, load_plugin
   use finshell_st_venant_kirchhoff, only: st_venant_kirchhoff_parameters, new_st_venant_kirchhoff
   use finshell_status, only: status_invalid_argument
   use finshell_yeoh, only: yeoh_parameters, new_yeoh
   implicit none
   private
   public :: new_material, new_described_material, material_names, material_parameters, parameter_t

   integer, parameter :: name_length = 32
   character(len=name_length), parameter :: names(*) = [character(len=name_length) :: &
                                                        'mooney_rivlin', 'neo_hookean', 'yeoh', 'gent', 'ogden', &
                                                        'exponential_fibre', 'holzapfel_2005', 'holzapfel_gasser_ogden', &
                                                        'compressible_neo_hookean', 'st_venant_kirchhoff', &
                                                        'linear_elastic', 'orthotropic']

contains

   !> Names of all laws.
   pure function material_names() result(list)
      character(len=name_length) :: list(size(names))
      list = names
   end function material_names

   !> Parameters of a law, empty for an unknown one (and for a law of a library that has none).
   function material_parameters(name) result(parameters)
      character(len=*), intent(in) :: name
      type(parameter_t), allocatable :: parameters(:)
      type(description_t) :: description
      type(error_t), allocatable :: error
      if (is_plugin(name)) then
         call load_plugin(name, description, error)
         if (allocated(error)) allocate (description%parameters(0))
         parameters = description%parameters
         return
      end if
      select case (lower(name))
      case ('mooney_rivlin'); parameters = mooney_rivlin_parameters()
      case ('neo_hookean'); parameters = neo_hookean_parameters()
      case ('compressible_neo_hookean'); parameters = compressible_neo_hookean_parameters()
      case ('st_venant_kirchhoff', 'linear_elastic'); parameters = st_venant_kirchhoff_parameters()
      case ('yeoh'); parameters = yeoh_parameters()
      case ('gent'); parameters = gent_parameters()
      case ('ogden'); parameters = ogden_parameters()
      case ('exponential_fibre'); parameters = exponential_fibre_parameters()
      case ('holzapfel_2005'); parameters = holzapfel_2005_parameters()
      case ('holzapfel_gasser_ogden'); parameters = holzapfel_gasser_ogden_parameters()
      case ('orthotropic'); parameters = orthotropic_parameters()
      case default; allocate (parameters(0))
      end select
   end function material_parameters

   !> Build the law from its parameters in the order of `material_parameters`.
   subroutine construct(name, values, law, message)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values(:)
      class(material_t), allocatable, intent(out) :: law
      character(len=:), allocatable, intent(out) :: message
      select case (name)
      case ('mooney_rivlin'); call new_mooney_rivlin(values, law, message)
      case ('neo_hookean'); call new_neo_hookean(values, law, message)
      case ('compressible_neo_hookean'); call new_compressible_neo_hookean(values, law, message)
      case ('st_venant_kirchhoff', 'linear_elastic'); call new_st_venant_kirchhoff(values, law, message)
      case ('yeoh'); call new_yeoh(values, law, message)
      case ('gent'); call new_gent(values, law, message)
      case ('ogden'); call new_ogden(values, law, message)
      case ('exponential_fibre'); call new_exponential_fibre(values, law, message)
      case ('holzapfel_2005'); call new_holzapfel_2005(values, law, message)
      case ('holzapfel_gasser_ogden'); call new_holzapfel_gasser_ogden(values, law, message)
      case ('orthotropic'); call new_orthotropic(values, law, message)
      end select
   end subroutine construct

   !> A material law by name, from named parameters. Capitals do not matter. 'plugin:LIBRARY' or 'plugin:LIBRARY#NAME' is a law of a
   !> shared library (finshell_plugin).
   !>
   !> Errors (status_invalid_argument): unknown law; unknown, repeated, missing or senseless parameter. The message lists
   !> what there is.
   subroutine new_material(law, name, parameter_names, parameter_values, error)
      class(material_t), allocatable, intent(out) :: law
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: parameter_names(:)
      real(wp), intent(in) :: parameter_values(:) !< as many as names
      type(error_t), allocatable, intent(out) :: error
      type(description_t) :: description
      type(parameter_t), allocatable :: parameters(:)
      real(wp), allocatable :: values(:)
      logical, allocatable :: given(:)
      character(len=:), allocatable :: message, place
      integer :: j
      if (is_plugin(name)) then
         call load_plugin(name, description, error)
         if (.not. allocated(error)) call new_described_material(law, description, parameter_names, parameter_values, error)
         return
      end if
      parameters = material_parameters(name)
      place = 'material law '''//trim(lower(name))//''': '
      if (size(parameters) == 0) then
         call raise(error, status_invalid_argument, 'unknown '//place//'known laws are '//known_laws())
         return
      end if
      call read_values(place, parameters, parameter_names, parameter_values, values, given, error)
      if (allocated(error)) return
      call construct(lower(name), values, law, message)
      if (allocated(message)) then
         message = place//message//'; found'
         do j = 1, size(parameters)
            if (given(j)) message = message//' '//trim(parameters(j)%name)//' = '//text_of(real(values(j), dp))
         end do
         if (.not. any(given)) message = message//' no parameter'
         call raise(error, status_invalid_argument, message)
         deallocate (law)
         return
      end if
      law%name = lower(name)
   end subroutine new_material

   !> A law of somebody else's (finshell_outside_law), from named parameters, with the same errors.
   subroutine new_described_material(law, description, parameter_names, parameter_values, error)
      class(material_t), allocatable, intent(out) :: law
      type(description_t), intent(in) :: description
      character(len=*), intent(in) :: parameter_names(:)
      real(wp), intent(in) :: parameter_values(:)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: values(:)
      logical, allocatable :: given(:)
      call read_values('material law '''//description%name//''': ', description%parameters, parameter_names, parameter_values, &
                       values, given, error)
      if (.not. allocated(error)) call new_outside_law(law, description, values, error)
   end subroutine new_described_material

   pure function known_laws() result(text)
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(names)
         if (i > 1) text = text//', '
         text = text//trim(names(i))
      end do
   end function known_laws
end module finshell_registry
