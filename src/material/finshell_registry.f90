!> The one place that lists the material laws. A new law is one file, one `use` and one line in each `select case` here.
module finshell_registry
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
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
   use finshell_parameter, only: parameter_t, list_of, lower
   use finshell_st_venant_kirchhoff, only: st_venant_kirchhoff_parameters, new_st_venant_kirchhoff
   use finshell_status, only: status_invalid_argument
   use finshell_yeoh, only: yeoh_parameters, new_yeoh
   implicit none
   private
   public :: new_material, material_names, material_parameters, parameter_t

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

   !> Parameters of a law, empty for an unknown one.
   pure function material_parameters(name) result(parameters)
      character(len=*), intent(in) :: name
      type(parameter_t), allocatable :: parameters(:)
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

   !> A material law by name, from named parameters. Capitals do not matter.
   !>
   !> Errors (status_invalid_argument): unknown law; unknown, repeated, missing or senseless parameter. The message lists
   !> what there is.
   subroutine new_material(law, name, parameter_names, parameter_values, error)
      class(material_t), allocatable, intent(out) :: law
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: parameter_names(:)
      real(wp), intent(in) :: parameter_values(:) !< as many as names
      type(error_t), allocatable, intent(out) :: error
      type(parameter_t), allocatable :: parameters(:)
      real(wp), allocatable :: values(:)
      logical, allocatable :: given(:)
      character(len=:), allocatable :: message, place
      integer :: i, j
      parameters = material_parameters(name)
      place = 'material law '''//trim(lower(name))//''': '
      if (size(parameters) == 0) then
         call raise(error, status_invalid_argument, 'unknown '//place//'known laws are '//known_laws())
         return
      end if
      if (size(parameter_names) /= size(parameter_values)) then
         call raise(error, status_invalid_argument, place//text_of(size(parameter_names))//' parameter names but '// &
                    text_of(size(parameter_values))//' values')
         return
      end if
      allocate (values(size(parameters)))
      values = parameters%default
      allocate (given(size(parameters)), source=.false.)
      do i = 1, size(parameter_names)
         j = position(parameters, lower(parameter_names(i)))
         if (j == 0) then
            message = 'unknown parameter '''//trim(lower(parameter_names(i)))//''''
         else if (given(j)) then
            message = 'parameter '''//trim(lower(parameter_names(i)))//''' is given twice'
         else if (.not. ieee_is_finite(parameter_values(i))) then
            message = 'parameter '''//trim(lower(parameter_names(i)))//''' is not a finite number'
         end if
         if (allocated(message)) then
            call raise(error, status_invalid_argument, place//message//'; the law takes '//list_of(parameters))
            return
         end if
         values(j) = parameter_values(i)
         given(j) = .true.
      end do
      do j = 1, size(parameters)
         if (parameters(j)%required .and. .not. given(j)) then
            call raise(error, status_invalid_argument, place//'parameter '''//trim(parameters(j)%name)// &
                       ''' is missing; the law takes '//list_of(parameters))
            return
         end if
      end do
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

   pure function position(parameters, name) result(j)
      type(parameter_t), intent(in) :: parameters(:)
      character(len=*), intent(in) :: name
      integer :: j
      do j = 1, size(parameters)
         if (parameters(j)%name == name) return
      end do
      j = 0
   end function position

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
