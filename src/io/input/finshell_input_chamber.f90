!> The group &chamber of an input file.
module finshell_input_chamber
   use finshell_chamber, only: chamber_t
   use finshell_error, only: error_t
   use finshell_input_case, only: get_scaling, scales_t
   use finshell_field, only: name_t
   use finshell_input_common, only: check_name
   use finshell_mesh, only: element_set_names, find_element_set
   use finshell_namelist, only: check_all_used, complain_about, get, get_strings, group_t, has
   use finshell_namelist_values, only: suggestion
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: read_chamber, is_chamber_column

contains

   !> &chamber: append one chamber to the structure.
   subroutine read_chamber(group, structure, scales, error)
      type(group_t), intent(inout) :: group
      type(structure_t), intent(inout) :: structure
      type(scales_t), intent(inout) :: scales
      type(error_t), allocatable, intent(inout) :: error
      type(chamber_t) :: chamber
      character(len=:), allocatable :: fluid
      integer :: i

      if (allocated(error)) return
      call get(group, 'name', chamber%name, error)
      if (.not. allocated(error)) call check_name(group, 'name', chamber%name, error)
      call get(group, 'fluid', fluid, error, choices='gas, liquid')
      if (allocated(error)) return
      do i = 1, size(structure%chambers)
         if (structure%chambers(i)%name /= chamber%name) cycle
         call complain_about(group, 'name', "there is a chamber '"//chamber%name//"' already", error)
         return
      end do
      call read_walls(group, 'outward', structure, chamber%outward, error)
      call read_walls(group, 'inward', structure, chamber%inward, error)
      if (allocated(error)) return
      if (size(chamber%outward) + size(chamber%inward) == 0) chamber%outward = [name_t('all')]
      chamber%gas = fluid == 'gas'
      if (chamber%gas) then
         call get(group, 'ambient', chamber%ambient, error, above=0.0d0)
         call get(group, 'exponent', chamber%exponent, error, default=1.0d0, above=0.0d0)
      else if (has(group, 'bulk_modulus')) then
         call get(group, 'bulk_modulus', chamber%bulk_modulus, error, above=0.0d0)
      end if
      call get(group, 'rigid_volume', chamber%rigid, error, default=0.0d0, minimum=0.0d0)
      call get(group, 'inflow', chamber%inflow, error, default=0.0d0)
      call get_scaling(group, scales, chamber%scaling, error)
      call check_all_used(group, error)
      if (.not. allocated(error)) structure%chambers = [structure%chambers, chamber]
   end subroutine read_chamber

   !> Is this the name of one of the columns of chambers?
   pure logical function is_chamber_column(name, chambers) result(yes)
      character(len=*), intent(in) :: name
      type(chamber_t), intent(in) :: chambers(:)
      integer :: i
      yes = .false.
      do i = 1, size(chambers)
         yes = yes .or. name == 'pressure_'//chambers(i)%name .or. name == 'volume_'//chambers(i)%name &
               .or. name == 'amount_'//chambers(i)%name
      end do
   end function is_chamber_column

   !> Names of element sets; none when the key is absent.
   subroutine read_walls(group, key, structure, sets, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      type(structure_t), intent(in) :: structure
      type(name_t), allocatable, intent(out) :: sets(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: names(:), known
      integer :: at, i
      allocate (sets(0))
      call get_strings(group, key, names, error, required=.false.)
      do i = 1, size(names)
         if (allocated(error)) return
         at = find_element_set(structure%mesh, trim(names(i)))
         if (at == 0) then
            known = element_set_names(structure%mesh)
            call complain_about(group, key, "there is no element set '"//trim(names(i))//"'"//suggestion(trim(names(i)), known) &
               //'; the mesh has: '//known, error)
         else if (size(structure%mesh%element_sets(at)%members) == 0) then
            call complain_about(group, key, "the element set '"//trim(names(i))//"' is empty", error)
         end if
         sets = [sets, name_t(trim(names(i)))]
      end do
   end subroutine read_walls
end module finshell_input_chamber
