!> The groups &probe of an input file: lines along which results are wanted.
module finshell_input_probe
   use finshell_error, only: error_t
   use finshell_input_common, only: check_name, get_vector
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t, mesh_size
   use finshell_namelist, only: check_all_used, complain_about, count_groups, get, get_strings, group_t, namelist_t
   use finshell_probe, only: probe_t
   use finshell_result_fields, only: field_names, result_field_t, result_fields
   implicit none
   private
   public :: probe_t, read_probes

contains

   subroutine read_probes(namelist, mesh, probes, error)
      type(namelist_t), intent(inout) :: namelist
      type(mesh_t), intent(in) :: mesh
      type(probe_t), allocatable, intent(out) :: probes(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: i, k, n
      allocate (probes(count_groups(namelist, 'probe')))
      n = 0
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name /= 'probe' .or. allocated(error)) cycle
         n = n + 1
         call read_probe(namelist%groups(i), mesh, probes(n), error)
         do k = 1, n - 1
            if (allocated(error)) return
            if (probes(k)%name == probes(n)%name) call complain_about(namelist%groups(i), 'name', "there is a probe '" &
                                                                      //probes(n)%name//"' already", error)
         end do
      end do
   end subroutine read_probes

   subroutine read_probe(group, mesh, probe, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(probe_t), intent(out) :: probe
      type(error_t), allocatable, intent(inout) :: error
      type(result_field_t), allocatable :: table(:)
      character(len=:), allocatable :: fields(:), field_list
      integer :: i
      call get(group, 'name', probe%name, error)
      call check_name(group, 'name', probe%name, error)
      if (allocated(error)) return
      if (any(probe%name == [character(len=7) :: 'history', 'modes'])) then
         call complain_about(group, 'name', "'"//probe%name//"' is the name of another table of the run", error)
         return
      end if
      call get_vector(group, 'from', probe%from, error)
      call get_vector(group, 'to', probe%to, error)
      if (allocated(error)) return
      if (.not. norm2(probe%to - probe%from) > 1.0e-12_wp*mesh_size(mesh)) then
         call complain_about(group, 'to', 'the line has no length', error)
         return
      end if
      call get(group, 'points', probe%points, error, default=probe%points, minimum=2, maximum=1000000)
      call get(group, 'deformed', probe%deformed, error, default=.false.)
      call get(group, 'every', probe%every, error, default=1, minimum=1)
      field_list = field_names(only_items=.true.)
      call get_strings(group, 'fields', fields, error, choices=field_list)
      call check_all_used(group, error)
      if (allocated(error)) return
      table = result_fields()
      if (size(fields) == 0) fields = [character(len=12) :: 'displacement']
      probe%wanted = pack([(i, i=1, size(table))], [(any(fields == table(i)%name), i=1, size(table))])
      do i = 1, size(probe%wanted)
         if (table(probe%wanted(i))%adds_up .and. .not. allocated(error)) call complain_about(group, 'fields', &
            trim(table(probe%wanted(i))%name)//' belongs to nodes and has no value between them', error)
      end do
   end subroutine read_probe
end module finshell_input_probe
