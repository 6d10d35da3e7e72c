!> The mesh of an input file with the sets that it names, refined or coarser where that is wanted.
module finshell_input_refinement
   use finshell_back_ends, only: can_work_on_disk
   use finshell_bisection, only: begin_bisection, bisection_t
   use finshell_error, only: error_t, text_of
   use finshell_input_common, only: place_error
   use finshell_input_mesh, only: read_mesh, take_mesh
   use finshell_input_preset, only: preset_t
   use finshell_input_normals, only: apply_normals, crease_edges, normals_choice_t
   use finshell_input_sets, only: read_element_set, read_node_set
   use finshell_input_case, only: find_scales, scales_t
   use finshell_input_support, only: read_supports
   use finshell_kinds, only: wp
   use finshell_memory, only: lack_of_memory
   use finshell_mesh, only: mesh_t, set_t
   use finshell_mesh_check, only: check_mesh
   use finshell_mesh_refinement, only: refine_mesh
   use finshell_namelist, only: complain_about, count_groups, get, group_t, has, namelist_t
   use finshell_structure, only: structure_t
   use finshell_surface, only: surface_none
   implicit none
   private
   public :: read_any_mesh

   integer, parameter :: most_levels = 8
   integer, parameter :: fewest = 8 !< elements that a preset leaves
   real(wp), parameter :: most_nodes = 2.0e8_wp

contains

   !> Groups &mesh, &node_set and &element_set. The key `refine`, or what the preset has instead, and `levels` add up.
   !>
   !> Generators make a finer or coarser mesh of their own surface. Meshes of files, and those whose nodes or elements the input
   !> knows by number, are cut triangle by triangle, on a smooth surface through their nodes unless `normals` is 'facet'.
   !> A bisection that has not begun begins with this mesh; the mesh of one that has is taken as it is.
   subroutine read_any_mesh(namelist, folder, mesh, normals, preset, error, levels, bisection, given)
      type(namelist_t), intent(inout) :: namelist
      character(len=*), intent(in) :: folder !< prefix of file names
      type(mesh_t), intent(out) :: mesh
      type(normals_choice_t), intent(out) :: normals !< for apply_normals
      type(preset_t), intent(inout) :: preset !< its `refine` becomes 0 where it is not taken
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: levels
      type(bisection_t), intent(inout), optional :: bisection
      type(mesh_t), intent(in), optional :: given !< by whoever reads the input; it stays as it is
      integer :: at, refine
      if (allocated(error)) return
      do at = 1, size(namelist%groups)
         if (namelist%groups(at)%name == 'mesh') exit
      end do
      if (present(given)) then
         preset%refine = 0
         call take_mesh(namelist%groups(at), given, mesh, normals, is_tied(namelist), error)
         if (.not. allocated(error)) call read_sets(namelist, mesh, error)
         return
      end if
      call get(namelist%groups(at), 'refine', refine, error, default=0, minimum=-most_levels, maximum=most_levels)
      if (allocated(error)) return
      if (has(namelist%groups(at), 'refine')) preset%refine = 0
      ! triangles that were read cannot be joined
      if (preset%refine < 0 .and. knows_numbers(namelist, namelist%groups(at))) preset%refine = 0
      refine = refine + preset%refine
      if (present(levels)) refine = refine + levels
      call read_refined(namelist, namelist%groups(at), folder, refine, mesh, normals, error, bisection)
      if (preset%refine /= 0) call preset%note('refine', text_of(preset%refine))
      if (.not. allocated(error)) then
         if (preset%refine < 0 .and. size(mesh%triangles, 2) < fewest) &
            call complain_about(namelist%groups(at), '', 'the coarser mesh has too few elements', error)
      else if (preset%refine > 0) then
         error%message = error%message//' ('//preset%summary()//'; refine = 0 in &mesh leaves the mesh as it is)'
      end if
   end subroutine read_any_mesh

   !> The mesh with its sets, at a level of refinement.
   subroutine read_refined(namelist, group, folder, refine, mesh, normals, error, bisection)
      type(namelist_t), intent(inout) :: namelist
      type(group_t), intent(inout) :: group !< &mesh
      character(len=*), intent(in) :: folder
      integer, intent(in) :: refine
      type(mesh_t), intent(out) :: mesh
      type(normals_choice_t), intent(out) :: normals
      type(error_t), allocatable, intent(inout) :: error
      type(bisection_t), intent(inout), optional :: bisection
      type(set_t), allocatable :: former(:)
      type(mesh_t) :: bare, own
      call read_mesh(group, folder, mesh, normals, 0, is_tied(namelist), error)
      if (allocated(error)) return
      if (present(bisection)) then
         if (allocated(bisection%side)) then
            mesh = bisection%mesh
            mesh%former_node_sets = bisection%former_node_sets
            call read_sets(namelist, mesh, error)
            return
         end if
      end if
      if (refine /= 0 .or. present(bisection)) bare = mesh
      own = bare
      call read_sets(namelist, mesh, error)
      if (refine == 0) then
         if (.not. allocated(error)) call begin(mesh%node_sets)
         return
      end if
      if (knows_numbers(namelist, group)) then
         call cut_triangles(namelist, group, folder, normals, refine, bare, mesh, own, error)
         if (.not. allocated(error)) call begin(mesh%former_node_sets)
      else
         ! a set may exist in the refined mesh only, as the middle of an odd number of cells
         if (allocated(error)) deallocate (error)
         call move_alloc(mesh%node_sets, former)
         call read_mesh(group, folder, mesh, normals, refine, is_tied(namelist), error)
         own = mesh
         bare = mesh
         if (.not. allocated(error)) call read_sets(namelist, mesh, error)
         call move_alloc(former, mesh%former_node_sets)
         if (.not. allocated(error)) call begin(mesh%former_node_sets)
      end if

   contains

      subroutine begin(before)
         type(set_t), intent(in) :: before(:)
         if (.not. present(bisection)) return
         bisection%base = bare
         ! normals of a file are those of another surface
         if (normals%file /= '') bisection%base%surface%kind = surface_none
         own%surface = bisection%base%surface
         if (allocated(own%lineage)) own%surface%kind = surface_none
         bisection%points = size(bare%node_sets)
         bisection%former_node_sets = before
         call begin_bisection(bisection, own)
      end subroutine begin
   end subroutine read_refined

   pure logical function is_tied(namelist)
      type(namelist_t), intent(in) :: namelist
      is_tied = count_groups(namelist, 'tie') + count_groups(namelist, 'equal') + count_groups(namelist, 'equation') &
                + count_groups(namelist, 'rigid_body') > 0
   end function is_tied

   subroutine read_sets(namelist, mesh, error)
      type(namelist_t), intent(inout) :: namelist
      type(mesh_t), intent(inout) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      do i = 1, size(namelist%groups)
         select case (namelist%groups(i)%name)
         case ('node_set'); call read_node_set(namelist%groups(i), mesh, error)
         case ('element_set'); call read_element_set(namelist%groups(i), mesh, error)
         end select
         if (allocated(error)) return
      end do
   end subroutine read_sets

   !> Does the input speak of nodes or elements by their number in the mesh, itself or in files?
   pure logical function knows_numbers(namelist, mesh) result(yes)
      type(namelist_t), intent(in) :: namelist
      type(group_t), intent(in) :: mesh
      integer :: i
      yes = has(mesh, 'file') .or. has(mesh, 'normal_file')
      do i = 1, size(namelist%groups)
         select case (namelist%groups(i)%name)
         case ('node_set'); yes = yes .or. has(namelist%groups(i), 'nodes')
         case ('element_set'); yes = yes .or. has(namelist%groups(i), 'elements')
         case ('section'); yes = yes .or. has(namelist%groups(i), 'direction_file')
         end select
      end do
   end function knows_numbers

   !> Refine a mesh triangle by triangle, then name its sets again.
   subroutine cut_triangles(namelist, group, folder, normals, levels, bare, mesh, own, error)
      type(namelist_t), intent(inout) :: namelist
      type(group_t), intent(in) :: group !< &mesh
      character(len=*), intent(in) :: folder
      type(normals_choice_t), intent(in) :: normals
      integer, intent(in) :: levels
      type(mesh_t), intent(inout) :: bare !< with the sets that it has of itself
      type(mesh_t), intent(inout) :: mesh !< the same with those that the input names
      type(mesh_t), intent(inout) :: own !< refined, with the sets that it has of itself
      type(error_t), allocatable, intent(inout) :: error
      type(structure_t) :: before
      type(scales_t) :: scales
      integer, allocatable :: crease(:, :), last(:), groups(:)

      if (.not. allocated(error)) call check_levels(group, levels, size(bare%coordinates, 2), error)
      if (allocated(error)) return
      before%mesh = mesh
      call find_scales(namelist, scales, error)
      call read_supports(namelist, mesh, scales, before%supports, last, groups, error)
      if (.not. allocated(error)) call apply_normals(group, folder, normals, before, error)
      if (.not. allocated(error)) call crease_edges(group, normals, mesh, crease, error)
      if (allocated(error)) return
      if (allocated(before%mesh%normal)) bare%normal = before%mesh%normal ! of a file
      if (normals%kind == 'facet') then
         call refine_mesh(bare, levels, mesh, points=size(bare%node_sets))
      else
         call refine_mesh(bare, levels, mesh, normals%crease_angle, before%normal, crease, points=size(bare%node_sets))
      end if
      call check_mesh(mesh, error)
      if (allocated(error)) error%message = 'refined '//text_of(levels)//' times: '//error%message
      call place_error(group, '', error)
      if (allocated(error)) return
      own = mesh
      call read_sets(namelist, mesh, error)
      mesh%former_node_sets = before%mesh%node_sets
   end subroutine cut_triangles

   subroutine check_levels(group, levels, nodes, error)
      type(group_t), intent(in) :: group
      integer, intent(in) :: levels, nodes
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: reason
      if (levels < 0) then
         reason = 'a mesh of a file, or one whose nodes or elements the input knows by number, cannot become coarser'
      else if (nodes*4.0_wp**levels > most_nodes) then
         reason = text_of(nodes)//' nodes refined '//text_of(levels)//' times are too many'
      else
         reason = lack_of_memory(nodes*4.0_wp**levels, can_work_on_disk())
      end if
      if (reason /= '') call complain_about(group, 'refine', reason, error)
   end subroutine check_levels
end module finshell_input_refinement
