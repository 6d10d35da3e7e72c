!> Normals of the surface at the nodes of the elements, as &mesh asks for them: of the generator, fitted, from a file, or none.
module finshell_input_normals
   use finshell_kinds, only: wp
   use finshell_error, only: error_t, text_of
   use finshell_structure, only: structure_t
   use finshell_mesh, only: mesh_t, find_node_set, find_edge_set, edge_set_names
   use finshell_normals, only: exact_normals, facet_normal, fitted_normals, symmetry_planes_t
   use finshell_support, only: support_t, support_symmetry, support_components, axes_cylindrical
   use finshell_namelist, only: group_t, get, get_strings, has, complain_about
   use finshell_input_number_file, only: read_vector_file
   implicit none
   private
   public :: normals_choice_t, read_normals, apply_normals, crease_edges, crease_edges_of

   character(len=*), parameter :: kinds = 'auto, exact, fitted, facet'
   !> Beyond this angle to the facet (its cosine) an element is not shallow: of itself it stays flat.
   real(wp), parameter :: steepest = 0.5_wp
   !> Nearer than this a normal is the facet's (finshell_curved).
   real(wp), parameter :: same = 64*epsilon(1.0_wp)

   !> What the keys of &mesh say.
   type :: normals_choice_t
      character(len=:), allocatable :: kind, file
      character(len=:), allocatable :: crease_sets(:)
      real(wp) :: crease_angle = 40 !< degrees
   end type normals_choice_t

contains

   !> The keys of &mesh.
   subroutine read_normals(group, choice, error)
      type(group_t), intent(inout) :: group
      type(normals_choice_t), intent(out) :: choice
      type(error_t), allocatable, intent(inout) :: error
      call get(group, 'normals', choice%kind, error, default='auto', choices=kinds)
      call get(group, 'normal_file', choice%file, error, default='')
      call get(group, 'crease_angle', choice%crease_angle, error, default=choice%crease_angle, above=0.0_wp, maximum=180.0_wp)
      call get_strings(group, 'crease', choice%crease_sets, error)
      if (allocated(error)) return
      if (choice%file /= '' .and. has(group, 'normals')) call complain_about(group, 'normal_file', &
         'either normals or normal_file is expected', error)
   end subroutine read_normals

   !> structure%normal, once mesh and supports are there.
   subroutine apply_normals(group, folder, choice, structure, error)
      type(group_t), intent(in) :: group !< &mesh
      character(len=*), intent(in) :: folder !< prefix of the name of the file
      type(normals_choice_t), intent(in) :: choice
      type(structure_t), intent(inout) :: structure
      type(error_t), allocatable, intent(inout) :: error
      type(symmetry_planes_t) :: planes
      character(len=:), allocatable :: file
      integer, allocatable :: crease(:, :)

      call crease_edges(group, choice, structure%mesh, crease, error)
      if (allocated(error)) return
      if (choice%file /= '') then
         file = choice%file
         if (index(file, '/') /= 1) file = folder//file
         ! a refined mesh has them from the mesh before
         if (.not. allocated(structure%mesh%lineage)) call read_vector_file(group, 'normal_file', file, 'node', &
            size(structure%mesh%coordinates, 2), structure%mesh%normal, error)
         if (.not. allocated(error)) call exact_normals(structure%mesh, structure%normal)
         if (.not. allocated(error)) call check_normals(group, 'normal_file', structure, error)
         return
      end if
      select case (choice%kind)
      case ('facet')
         return
      case ('exact')
         if (.not. allocated(structure%mesh%normal)) then
            call complain_about(group, 'normals', "'exact' needs a generator that knows its curved surface: cylinder, cone, " &
               //'sphere, paraboloid, twisted strip, warped quadrilateral', error)
            return
         end if
         call exact_normals(structure%mesh, structure%normal)
         call check_normals(group, 'normals', structure, error)
      case ('auto')
         if (allocated(structure%mesh%normal) .and. size(crease) == 0) call exact_normals(structure%mesh, structure%normal)
         if (.not. allocated(structure%normal) .and. (has(group, 'file') .or. size(crease) > 0)) call fit()
         if (allocated(structure%normal)) call keep_shallow(structure)
      case ('fitted')
         call fit()
      end select

   contains

      subroutine fit()
         call symmetry_planes(structure%mesh, structure%supports, planes)
         call fitted_normals(structure%mesh, choice%crease_angle, structure%normal, crease, planes)
      end subroutine fit
   end subroutine apply_normals

   !> The edges across which normals differ because their sets are named.
   subroutine crease_edges(group, choice, mesh, crease, error)
      type(group_t), intent(in) :: group !< &mesh
      type(normals_choice_t), intent(in) :: choice
      type(mesh_t), intent(in) :: mesh
      integer, allocatable, intent(out) :: crease(:, :) !< (2, :) pairs of nodes
      type(error_t), allocatable, intent(inout) :: error
      integer :: at, i

      allocate (crease(2, 0))
      do i = 1, size(choice%crease_sets)
         at = find_edge_set(mesh, trim(choice%crease_sets(i)))
         if (at == 0) then
            call complain_about(group, 'crease', "the mesh has no edge set '"//trim(choice%crease_sets(i))//"'; it has: " &
               //edge_set_names(mesh), error)
            return
         end if
      end do
      crease = crease_edges_of(choice, mesh)
   end subroutine crease_edges

   !> The same where all sets are known to be there.
   pure function crease_edges_of(choice, mesh) result(crease)
      type(normals_choice_t), intent(in) :: choice
      type(mesh_t), intent(in) :: mesh
      integer, allocatable :: crease(:, :) !< (2, :) pairs of nodes
      integer :: i
      allocate (crease(2, 0))
      do i = 1, size(choice%crease_sets)
         associate (edges => mesh%edge_sets(find_edge_set(mesh, trim(choice%crease_sets(i))))%edges)
            crease = reshape([crease, edges], [2, size(crease, 2) + size(edges, 2)])
         end associate
      end do
   end function crease_edges_of

   !> Error: a normal that no shallow element can have.
   subroutine check_normals(group, key, structure, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      type(structure_t), intent(in) :: structure
      type(error_t), allocatable, intent(inout) :: error
      integer :: e, k
      do e = 1, size(structure%normal, 3)
         do k = 1, 3
            if (dot_product(facet_normal(structure%mesh, e), structure%normal(:, k, e)) > 0.01_wp) cycle
            call complain_about(group, key, 'the normal at node '//text_of(structure%mesh%triangles(k, e)) &
               //' stands at 90 degrees or more to that of element '//text_of(e)//'; less is expected', error)
            return
         end do
      end do
   end subroutine check_normals

   !> Elements that are not shallow become facets; no normals at all where every element is flat.
   pure subroutine keep_shallow(structure)
      type(structure_t), intent(inout) :: structure
      real(wp) :: facet(3), cosine(3)
      logical :: flat
      integer :: e
      flat = .true.
      do e = 1, size(structure%normal, 3)
         facet = facet_normal(structure%mesh, e)
         cosine = matmul(facet, structure%normal(:, :, e))
         if (any(cosine < steepest)) structure%normal(:, :, e) = spread(facet, 2, 3)
         flat = flat .and. maxval(abs(structure%normal(:, :, e) - spread(facet, 2, 3))) < same
      end do
      if (flat) deallocate (structure%normal)
   end subroutine keep_shallow

   !> Planes of symmetry among the supports: a displacement and the rotations about both axes across it are held at zero, the
   !> rotation about it is not.
   subroutine symmetry_planes(mesh, supports, planes)
      type(mesh_t), intent(in) :: mesh
      type(support_t), intent(in) :: supports(:)
      type(symmetry_planes_t), intent(out) :: planes
      logical, allocatable :: through(:, :)
      real(wp), allocatable :: normal(:, :)
      real(wp) :: n(3)
      integer :: i, count
      allocate (normal(3, size(supports)))
      allocate (through(size(supports), size(mesh%coordinates, 2)), source=.false.)
      count = 0
      do i = 1, size(supports)
         n = plane_of(supports(i))
         if (.not. norm2(n) > 0) cycle
         count = count + 1
         normal(:, count) = n/norm2(n)
         through(count, mesh%node_sets(find_node_set(mesh, supports(i)%node_set))%members) = .true.
      end do
      planes%normal = normal(:, :count)
      planes%through = through(:count, :)
   end subroutine symmetry_planes

   !> Normal of the plane of symmetry that a support is, or zero.
   pure function plane_of(support) result(normal)
      type(support_t), intent(in) :: support
      real(wp) :: normal(3)
      integer :: a, b, c
      normal = 0
      if (support%kind == support_symmetry) normal = support%normal
      if (support%kind /= support_components .or. support%axes_kind == axes_cylindrical) return
      do a = 1, 3
         b = 1 + mod(a, 3)
         c = 1 + mod(a + 1, 3)
         if (support%fixed(a) .and. support%fixed(3 + b) .and. support%fixed(3 + c) .and. .not. support%fixed(3 + a) &
             .and. .not. any(abs(support%value([a, 3 + b, 3 + c])) > 0)) normal = support%axes(:, a)
      end do
   end function plane_of
end module finshell_input_normals
