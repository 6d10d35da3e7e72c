!> The group &mesh of an input file.
module finshell_input_mesh
   use finshell_kinds, only: wp
   use finshell_error, only: error_t, text_of
   use finshell_mesh, only: mesh_t
   use finshell_mesh_check, only: check_mesh
   use finshell_mesh_grid, only: diagonal_names
   use finshell_mesh_disk, only: disk_mesh
   use finshell_mesh_rectangle, only: rectangle_mesh, quadrilateral_mesh
   use finshell_mesh_cylinder, only: cylinder_mesh, cone_mesh
   use finshell_mesh_paraboloid, only: paraboloid_mesh
   use finshell_mesh_sphere, only: sphere_mesh
   use finshell_mesh_annulus, only: annulus_mesh
   use finshell_mesh_hole, only: hole_mesh
   use finshell_mesh_strip, only: strip_mesh
   use finshell_automatic_sets, only: add_automatic_sets
   use finshell_mesh_file, only: file_ending, read_mesh_file, shape_t
   use finshell_orientation, only: orient_triangles
   use finshell_back_ends, only: can_work_on_disk
   use finshell_memory, only: lack_of_memory
   use finshell_namelist, only: group_t, get, has, check_all_used, complain_about
   use finshell_input_normals, only: normals_choice_t, read_normals
   use finshell_input_common, only: place_error
   implicit none
   private
   public :: read_mesh, take_mesh

   character(len=*), parameter :: generators = &
      'disk, rectangle, quadrilateral, paraboloid, cylinder, cone, sphere, annulus, strip, hole'

   !> What is done to any mesh.
   type :: finish_t
      real(wp) :: scale = 1
      logical :: flip = .false., orient = .false.
      real(wp), allocatable :: toward(:)
   end type finish_t

contains

   !> &mesh: a generator with its parameters, or a file. The mesh is checked.
   subroutine read_mesh(group, folder, mesh, normals, levels, tied, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: folder !< where relative file names begin: '' or with / at the end
      type(mesh_t), intent(out) :: mesh
      type(normals_choice_t), intent(out) :: normals !< for apply_normals
      logical, intent(in) :: tied !< joints are there for nodes of a file that share a place
      integer, intent(in) :: levels !< generators: divisions are multiplied by 2**levels, which may be a fraction
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: generator, file
      type(finish_t) :: finish

      if (allocated(error)) return
      if (has(group, 'file') .eqv. has(group, 'generator')) then
         call complain_about(group, '', 'either file or generator is expected; generators: '//generators, error)
         return
      end if
      call read_finish(group, finish, error)
      call read_normals(group, normals, error)
      if (has(group, 'file')) then
         call get(group, 'file', file, error)
         call read_file(group, folder, file, tied, mesh, error)
      else
         call get(group, 'generator', generator, error, choices=generators)
         if (.not. allocated(error)) call generate(group, generator, levels, mesh, error)
      end if
      if (allocated(error)) return
      call finish_mesh(mesh, finish, error)
      if (allocated(file) .and. .not. allocated(error)) call add_automatic_sets(mesh, normals%crease_angle)
      if (allocated(error) .and. allocated(file)) error%message = file//': '//error%message
      call place_error(group, '', error)
   end subroutine read_mesh

   !> The same with a mesh that whoever reads the input gives beside it.
   subroutine take_mesh(group, given, mesh, normals, tied, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: given
      type(mesh_t), intent(out) :: mesh
      type(normals_choice_t), intent(out) :: normals !< for apply_normals
      logical, intent(in) :: tied !< see `read_mesh`
      type(error_t), allocatable, intent(inout) :: error
      type(finish_t) :: finish
      integer :: refine
      if (has(group, 'file') .or. has(group, 'generator')) call complain_about(group, '', 'the mesh is given as arrays; neither &
         &file nor generator is expected beside them', error)
      if (allocated(error)) return
      call get(group, 'refine', refine, error, default=0, minimum=0, maximum=0)
      call read_finish(group, finish, error)
      call read_normals(group, normals, error)
      mesh = given
      call get(group, 'coincident_nodes', mesh%coincident_nodes_allowed, error, default=tied)
      call check_all_used(group, error)
      if (allocated(error)) return
      call finish_mesh(mesh, finish, error)
      if (.not. allocated(error)) call add_automatic_sets(mesh, normals%crease_angle)
      call place_error(group, '', error)
   end subroutine take_mesh

   subroutine read_finish(group, finish, error)
      type(group_t), intent(inout) :: group
      type(finish_t), intent(out) :: finish
      type(error_t), allocatable, intent(inout) :: error
      call get(group, 'scale', finish%scale, error, default=1.0_wp, above=0.0_wp)
      call get(group, 'flip', finish%flip, error, default=.false.)
      call get(group, 'orient', finish%orient, error, default=has(group, 'orient_toward'))
      if (has(group, 'orient_toward')) call get(group, 'orient_toward', finish%toward, error, number=3)
   end subroutine read_finish

   subroutine finish_mesh(mesh, finish, error)
      type(mesh_t), intent(inout) :: mesh
      type(finish_t), intent(in) :: finish
      type(error_t), allocatable, intent(inout) :: error
      integer :: turned
      mesh%coordinates = finish%scale*mesh%coordinates
      mesh%surface%scale = finish%scale
      if (finish%orient) call orient_triangles(mesh, turned, error, finish%toward)
      if (finish%flip) mesh%triangles = mesh%triangles([1, 3, 2], :)
      if (.not. allocated(error)) call check_mesh(mesh, error)
   end subroutine finish_mesh

   subroutine read_file(group, folder, file, tied, mesh, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: folder, file
      logical, intent(in) :: tied
      type(mesh_t), intent(out) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      logical :: coincident
      type(shape_t) :: shape

      if (file_ending(file) == 'vtkhdf') then
         if (has(group, 'increment')) call get(group, 'increment', shape%increment, error, minimum=0)
         call get(group, 'deformed', shape%deformed, error, default=has(group, 'increment'))
         if (has(group, 'increment') .and. .not. shape%deformed .and. .not. allocated(error)) &
            call complain_about(group, 'increment', 'the undeformed shape belongs to no increment: deformed = .true. is &
            &expected', error)
      else if (has(group, 'increment') .or. has(group, 'deformed')) then
         call complain_about(group, trim(merge('increment', 'deformed ', has(group, 'increment'))), 'only a result file of &
            &finshell (.vtkhdf) has increments, found file = '''//file//'''', error)
      end if
      call get(group, 'coincident_nodes', coincident, error, default=tied)
      call check_all_used(group, error)
      if (allocated(error)) return
      if (file == '') then
         call complain_about(group, 'file', 'the file name is empty', error)
      else if (file(1:1) == '/') then
         call read_mesh_file(file, mesh, error, shape)
      else
         call read_mesh_file(folder//file, mesh, error, shape)
      end if
      call place_error(group, 'file', error)
      if (.not. allocated(error)) call check_memory(group, real(size(mesh%coordinates, 2), wp), error)
      mesh%coincident_nodes_allowed = coincident
   end subroutine read_file

   !> Refuse so many nodes if they will not fit into memory.
   subroutine check_memory(group, nodes, error)
      type(group_t), intent(in) :: group
      real(wp), intent(in) :: nodes
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: reason
      if (allocated(error)) return
      reason = lack_of_memory(nodes, can_work_on_disk())
      if (reason /= '') call complain_about(group, '', reason, error)
   end subroutine check_memory

   subroutine generate(group, generator, levels, mesh, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: generator
      integer, intent(in) :: levels
      type(mesh_t), intent(out) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: diagonal
      real(wp) :: distortion
      type(error_t), allocatable :: refusal

      call get(group, 'distortion', distortion, error, default=0.0_wp, minimum=0.0_wp)
      if (generator /= 'disk') call get(group, 'diagonal', diagonal, error, default=usual_diagonal(generator), &
                                     choices=diagonal_names)
      select case (generator)
      case ('disk'); call generate_disk()
      case ('rectangle', 'quadrilateral'); call generate_quadrilateral()
      case ('paraboloid'); call generate_paraboloid()
      case ('cylinder', 'cone'); call generate_cylinder()
      case ('sphere'); call generate_sphere()
      case ('annulus'); call generate_annulus()
      case ('strip'); call generate_strip()
      case ('hole'); call generate_hole()
      end select
      if (.not. allocated(refusal)) return
      call place_error(group, '', refusal)
      call move_alloc(refusal, error)

   contains

      subroutine generate_disk()
         character(len=:), allocatable :: portion
         real(wp) :: radius, grading
         integer :: rings, sectors, core
         rings = 0
         call get(group, 'radius', radius, error, above=0.0_wp)
         call get(group, 'rings', rings, error, minimum=1)
         call get(group, 'portion', portion, error, default='quarter', choices='full, half, quarter, eighth')
         call get(group, 'sectors', sectors, error, default=8, minimum=3)
         call get(group, 'core', core, error, default=rings, minimum=1)
         call get(group, 'grading', grading, error, default=1.0_wp, above=0.0_wp)
         call get(group, 'diagonal', diagonal, error, default='alternating', choices='forward, backward, alternating')
         call check_all_used(group, error)
         call scale_cells('rings', rings)
         call scale_cells('core', core)
         if (allocated(error)) return
         call check_memory(group, sectors*real(core, wp)*(rings - 0.5_wp*core)/merge(2, merge(4, merge(8, 1, portion == 'eighth'), &
            portion == 'quarter'), portion == 'half'), error)
         if (.not. allocated(error)) call disk_mesh(mesh, radius, rings, refusal, portion, sectors, core, grading, diagonal, &
            distortion)
      end subroutine generate_disk

      subroutine generate_quadrilateral()
         real(wp), allocatable :: lengths(:), corners(:)
         integer, allocatable :: divisions(:)
         if (generator == 'rectangle') call get(group, 'lengths', lengths, error, required=.true., number=2, above=0.0_wp)
         if (generator == 'quadrilateral') call get(group, 'corners', corners, error, required=.true., number=12)
         call get(group, 'divisions', divisions, error, required=.true., number=2, minimum=1)
         call check_all_used(group, error)
         call check_cells(divisions)
         if (allocated(error)) return
         if (generator == 'rectangle') then
            call rectangle_mesh(mesh, lengths, divisions, refusal, diagonal, distortion)
         else
            call quadrilateral_mesh(mesh, reshape(corners, [3, 4]), divisions, refusal, diagonal, distortion)
         end if
      end subroutine generate_quadrilateral

      subroutine generate_paraboloid()
         real(wp), allocatable :: lengths(:), curvatures(:)
         integer, allocatable :: divisions(:)
         call get(group, 'lengths', lengths, error, required=.true., number=2, above=0.0_wp)
         call get(group, 'curvatures', curvatures, error, required=.true., number=3)
         call get(group, 'divisions', divisions, error, required=.true., number=2, minimum=1)
         call check_all_used(group, error)
         call check_cells(divisions)
         if (.not. allocated(error)) call paraboloid_mesh(mesh, lengths, curvatures, divisions, refusal, diagonal, distortion)
      end subroutine generate_paraboloid

      subroutine generate_cylinder()
         real(wp) :: radius, length
         real(wp), allocatable :: radii(:), angles(:)
         integer, allocatable :: divisions(:)
         if (generator == 'cylinder') call get(group, 'radius', radius, error, above=0.0_wp)
         if (generator == 'cone') call get(group, 'radii', radii, error, required=.true., number=2, above=0.0_wp)
         call get(group, 'length', length, error, above=0.0_wp)
         call get(group, 'angles', angles, error, required=.true., number=2)
         call get(group, 'divisions', divisions, error, required=.true., number=2, minimum=1)
         call check_all_used(group, error)
         call check_cells(divisions)
         if (allocated(error)) return
         if (generator == 'cone') then
            call cone_mesh(mesh, radii, length, angles, divisions, refusal, diagonal, distortion)
         else
            call cylinder_mesh(mesh, radius, length, angles, divisions, refusal, diagonal, distortion)
         end if
      end subroutine generate_cylinder

      subroutine generate_sphere()
         real(wp) :: radius
         real(wp), allocatable :: colatitudes(:), azimuths(:)
         integer, allocatable :: divisions(:)
         call get(group, 'radius', radius, error, above=0.0_wp)
         call get(group, 'colatitudes', colatitudes, error, required=.true., number=2, minimum=0.0_wp, maximum=180.0_wp)
         call get(group, 'azimuths', azimuths, error, required=.true., number=2)
         call get(group, 'divisions', divisions, error, required=.true., number=2, minimum=1)
         call check_all_used(group, error)
         call check_cells(divisions)
         if (.not. allocated(error)) call sphere_mesh(mesh, radius, colatitudes, azimuths, divisions, refusal, diagonal, &
            distortion)
      end subroutine generate_sphere

      subroutine generate_annulus()
         real(wp), allocatable :: radii(:), angles(:)
         integer, allocatable :: divisions(:)
         logical :: slit
         call get(group, 'radii', radii, error, required=.true., number=2, above=0.0_wp)
         call get(group, 'angles', angles, error, required=.true., number=2)
         call get(group, 'divisions', divisions, error, required=.true., number=2, minimum=1)
         call get(group, 'slit', slit, error, default=.true.)
         call check_all_used(group, error)
         call check_cells(divisions)
         if (.not. allocated(error)) call annulus_mesh(mesh, radii, angles, divisions, refusal, diagonal, slit, &
            distortion)
      end subroutine generate_annulus

      subroutine generate_strip()
         real(wp) :: length, width, twist
         integer, allocatable :: divisions(:)
         call get(group, 'length', length, error, above=0.0_wp)
         call get(group, 'width', width, error, above=0.0_wp)
         call get(group, 'twist', twist, error, default=0.0_wp)
         call get(group, 'divisions', divisions, error, required=.true., number=2, minimum=1)
         call check_all_used(group, error)
         call check_cells(divisions)
         if (.not. allocated(error)) call strip_mesh(mesh, length, width, twist, divisions, refusal, diagonal, &
            distortion)
      end subroutine generate_strip

      subroutine generate_hole()
         real(wp) :: radius
         real(wp), allocatable :: grading, lengths(:)
         integer, allocatable :: divisions(:)
         call get(group, 'lengths', lengths, error, required=.true., number=2, above=0.0_wp)
         call get(group, 'radius', radius, error, above=0.0_wp)
         if (has(group, 'grading')) then
            allocate (grading)
            call get(group, 'grading', grading, error, above=0.0_wp)
         end if
         call get(group, 'divisions', divisions, error, required=.true., number=2, minimum=1)
         call check_all_used(group, error)
         call check_cells(divisions)
         if (.not. allocated(error)) call hole_mesh(mesh, lengths, radius, divisions, refusal, diagonal, distortion, &
            grading)
      end subroutine generate_hole

      subroutine check_cells(divisions)
         integer, allocatable, intent(inout) :: divisions(:)
         if (allocated(error)) return
         call scale_cells('divisions', divisions(1))
         call scale_cells('divisions', divisions(2))
         if (allocated(error)) return
         call check_memory(group, (1.0_wp + divisions(1))*(1.0_wp + divisions(2))*merge(2, 1, diagonal == 'cross'), error)
      end subroutine check_cells

      !> A number of cells of the refined, or of the coarser, mesh.
      subroutine scale_cells(key, cells)
         character(len=*), intent(in) :: key
         integer, intent(inout) :: cells
         if (allocated(error)) return
         if (levels < 0 .and. mod(cells, 2**max(0, -levels)) /= 0) then
            call complain_about(group, key, 'a mesh coarser by '//text_of(-levels)//' levels needs multiples of ' &
               //text_of(2**(-levels))//', found '//text_of(cells), error)
         else if (real(cells, wp)*2.0_wp**levels > 1.0e8_wp) then
            call complain_about(group, key, text_of(cells)//' cells refined '//text_of(levels)//' times are too many', error)
         else
            cells = nint(cells*2.0_wp**levels)
         end if
      end subroutine scale_cells
   end subroutine generate

   !> Alternating, without a preferred direction; on curved surfaces one way, which is more accurate there (doc/benchmarks.md).
   pure function usual_diagonal(generator) result(name)
      character(len=*), intent(in) :: generator
      character(len=:), allocatable :: name
      select case (generator)
      case ('cylinder', 'cone', 'sphere', 'paraboloid'); name = 'forward'
      case default; name = 'alternating'
      end select
   end function usual_diagonal
end module finshell_input_mesh
