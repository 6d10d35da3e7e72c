!> The groups &spring, &bar, &cable, &dashpot and &point_mass of an input file.
module finshell_input_connector
   use finshell_connector, only: connector_t, find_connector, spring_axes, spring_axis, spring_line, spring_rotation, spring_turn, &
      bar, dashpot_axes, dashpot_line, dashpot_rotation, point_mass
   use finshell_error, only: error_t, text_of
   use finshell_force_law, only: law_linear, law_logarithmic, law_svk, law_table, natural_length
   use finshell_input_common, only: check_name, get_set, get_vector, kind_edge, kind_node
   use finshell_input_ends, only: get_ends, refined_share
   use finshell_kinds, only: wp
   use finshell_mesh, only: find_edge_set, find_node_set, mesh_t
   use finshell_namelist, only: check_all_used, complain_about, get, group_t, has, namelist_t
   implicit none
   private
   public :: read_connectors, connector_groups

   character(len=*), parameter :: connector_groups = 'spring, bar, cable, dashpot, point_mass'

contains

   !> All of them. Errors: a name twice; what is missing, negative or does not fit together.
   subroutine read_connectors(namelist, mesh, list, error)
      type(namelist_t), intent(inout) :: namelist
      type(mesh_t), intent(in) :: mesh
      type(connector_t), allocatable, intent(out) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      type(connector_t), allocatable :: found(:)
      integer :: i, n
      n = 0
      allocate (found(size(namelist%groups)))
      do i = 1, size(namelist%groups)
         if (allocated(error)) return
         associate (group => namelist%groups(i))
            select case (group%name)
            case ('spring', 'bar', 'cable', 'dashpot', 'point_mass')
               n = n + 1
               call get(group, 'name', found(n)%name, error)
               call check_name(group, 'name', found(n)%name, error)
               if (allocated(error)) return
               if (find_connector(found(:n - 1), found(n)%name) > 0) then
                  call complain_about(group, 'name', "there is a connector '"//found(n)%name//"' already", error)
                  return
               end if
               if (group%name == 'spring') call read_spring(group, mesh, found(n), error)
               if (group%name == 'dashpot') call read_dashpot(group, mesh, found(n), error)
               if (group%name == 'point_mass') call read_point_mass(group, mesh, found(n), error)
               if (group%name == 'bar' .or. group%name == 'cable') call read_bar(group, mesh, found(n), error)
               call check_all_used(group, error)
            end select
         end associate
      end do
      allocate (list(n))
      do i = 1, n
         list(i) = found(i)
      end do
   end subroutine read_connectors

   subroutine read_spring(group, mesh, it, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(connector_t), intent(inout) :: it
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: kind
      call get(group, 'type', kind, error, choices='axes, axis, line, rotation, hinge')
      if (allocated(error)) return
      select case (kind)
      case ('axes'); it%kind = spring_axes
      case ('axis'); it%kind = spring_axis
      case ('line'); it%kind = spring_line
      case ('rotation'); it%kind = spring_rotation
      case default; it%kind = spring_turn
      end select
      call read_ends(group, mesh, it, error)
      select case (kind)
      case ('axes', 'rotation')
         call get_triple(group, 'stiffness', it%vector, error)
         call get_triple(group, 'preload', it%preload, error, 0.0_wp)
      case default
         if (kind /= 'line') then
            call get_vector(group, 'direction', it%direction, error, nonzero=.true.)
            if (.not. allocated(error)) it%direction = it%direction/norm2(it%direction)
         end if
         call read_law(group, it, error)
      end select
      if (kind == 'line') call read_rest(group, mesh, it, error)
   end subroutine read_spring

   !> stiffness and preload, or a table.
   subroutine read_law(group, it, error)
      type(group_t), intent(inout) :: group
      type(connector_t), intent(inout) :: it
      type(error_t), allocatable, intent(inout) :: error
      integer :: n
      call get(group, 'tension_only', it%law%tension_only, error, default=.false.)
      if (allocated(error)) return
      if (.not. has(group, 'extensions')) then
         it%law%kind = law_linear
         call get(group, 'stiffness', it%law%stiffness, error, above=0.0_wp)
         call get(group, 'preload', it%law%preload, error, default=0.0_wp)
         return
      end if
      it%law%kind = law_table
      call get(group, 'extensions', it%law%extension, error, required=.true.)
      call get(group, 'forces', it%law%force, error, required=.true., number=size(it%law%extension))
      if (allocated(error)) return
      n = size(it%law%extension)
      if (n < 2) then
         call complain_about(group, 'extensions', 'a table has two points or more; '//text_of(n)//' was given', error)
      else if (.not. all(it%law%extension(2:) > it%law%extension(:n - 1))) then
         call complain_about(group, 'extensions', 'extensions rise from point to point; these do not', error)
      else if (.not. any(abs(it%law%force) > 0)) then
         call complain_about(group, 'forces', 'all forces of the table are zero', error)
      else if (it%law%tension_only) then
         call complain_about(group, 'tension_only', 'a table says itself where there is no force; leave the key out', error)
      end if
   end subroutine read_law

   !> Unstretched lengths of lines: of springs given, or as they are.
   subroutine read_rest(group, mesh, it, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(connector_t), intent(inout) :: it
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: rest
      if (allocated(error)) return
      call find_lengths(group, mesh, it, error)
      if (allocated(error) .or. .not. has(group, 'rest_length')) return
      call get(group, 'rest_length', rest, error, minimum=0.0_wp)
      it%rest = rest
   end subroutine read_rest

   !> Lengths in the reference state. Error: ends that coincide.
   subroutine find_lengths(group, mesh, it, error)
      type(group_t), intent(in) :: group
      type(mesh_t), intent(in) :: mesh
      type(connector_t), intent(inout) :: it
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      allocate (it%rest(size(it%node, 2)))
      do i = 1, size(it%rest)
         if (size(it%node, 1) == 2) then
            it%rest(i) = norm2(mesh%coordinates(:, it%node(1, i)) - mesh%coordinates(:, it%node(2, i)))
         else
            it%rest(i) = norm2(mesh%coordinates(:, it%node(1, i)) - it%anchor)
         end if
         if (it%rest(i) > 0) cycle
         call complain_about(group, '', 'the ends of the line at node '//text_of(it%node(1, i)) &
            //' coincide, so it has no direction', error)
         return
      end do
   end subroutine find_lengths

   subroutine read_dashpot(group, mesh, it, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(connector_t), intent(inout) :: it
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: kind
      call get(group, 'type', kind, error, choices='axes, line, rotation')
      if (allocated(error)) return
      select case (kind)
      case ('axes'); it%kind = dashpot_axes
      case ('line'); it%kind = dashpot_line
      case default; it%kind = dashpot_rotation
      end select
      call read_ends(group, mesh, it, error)
      if (kind == 'line') then
         call get(group, 'viscosity', it%vector(1), error, above=0.0_wp)
         if (.not. allocated(error)) call find_lengths(group, mesh, it, error)
      else
         call get_triple(group, 'viscosity', it%vector, error)
      end if
   end subroutine read_dashpot

   subroutine read_point_mass(group, mesh, it, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(connector_t), intent(inout) :: it
      type(error_t), allocatable, intent(inout) :: error
      it%kind = point_mass
      call read_ends(group, mesh, it, error)
      call get(group, 'mass', it%mass, error, above=0.0_wp)
      call get(group, 'inertia', it%inertia, error, default=0.0_wp, minimum=0.0_wp)
   end subroutine read_point_mass

   !> Bars and cables: straight lines between pairs of nodes, in pieces, or the edges of a set.
   subroutine read_bar(group, mesh, it, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(connector_t), intent(inout) :: it
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: law, set
      real(wp), allocatable :: lengths(:)
      real(wp) :: area, ratio, tension
      integer, allocatable :: ends(:, :), inner(:)
      integer :: divisions, i, k

      it%kind = bar
      if (has(group, 'edge_set')) then
         call get_set(group, kind_edge, mesh, set, error)
         if (allocated(error)) return
         it%node = mesh%edge_sets(find_edge_set(mesh, set))%edges
      else
         call get_ends(group, mesh, ends, error, ground=.false.)
         call get(group, 'divisions', divisions, error, default=1, minimum=1, maximum=100000)
         if (allocated(error)) return
         if (divisions == 1) then
            it%node = ends
         else
            ! the nodes between were added with the mesh (finshell_input_node), line after line
            inner = mesh%node_sets(find_node_set(mesh, it%name))%members
            allocate (it%node(2, 0))
            do i = 1, size(ends, 2)
               associate (chain => [ends(1, i), inner((divisions - 1)*(i - 1) + 1:(divisions - 1)*i), ends(2, i)])
                  it%node = reshape([it%node, [(chain(k), chain(k + 1), k=1, divisions)]], [2, divisions*i])
               end associate
            end do
         end if
      end if
      call get(group, 'law', law, error, default='st_venant_kirchhoff', choices='st_venant_kirchhoff, logarithmic')
      call get(group, 'tension_only', it%law%tension_only, error, default=group%name == 'cable')
      if (has(group, 'axial_stiffness')) then
         call get(group, 'axial_stiffness', it%law%stiffness, error, above=0.0_wp)
      else
         call get(group, 'young', it%law%stiffness, error, above=0.0_wp)
         call get(group, 'area', area, error, above=0.0_wp)
         if (.not. allocated(error)) it%law%stiffness = area*it%law%stiffness
      end if
      call get(group, 'mass_per_length', it%mass, error, default=0.0_wp, minimum=0.0_wp)
      if (.not. allocated(error)) call find_lengths(group, mesh, it, error)
      if (allocated(error)) return
      it%law%kind = law_svk
      if (law == 'logarithmic') it%law%kind = law_logarithmic
      if (has(group, 'tension') .and. has(group, 'length_ratio')) then
         call complain_about(group, 'length_ratio', 'either tension or length_ratio is expected', error)
      else if (has(group, 'tension')) then
         call get(group, 'tension', tension, error)
         if (allocated(error)) return
         lengths = it%rest
         do i = 1, size(lengths)
            it%rest(i) = natural_length(it%law, lengths(i), tension)
         end do
         if (.not. all(it%rest > 0)) then
            call complain_about(group, 'tension', 'the law has no such force', error)
         else if (tension < 0 .and. it%law%tension_only) then
            call complain_about(group, 'tension', 'it acts in tension only; '//text_of(tension)//' was given', error)
         end if
      else
         call get(group, 'length_ratio', ratio, error, default=1.0_wp, above=0.0_wp)
         if (.not. allocated(error) .and. has(group, 'length_ratio')) it%rest = ratio*it%rest
      end if
   end subroutine read_bar

   !> The ends of a spring, dashpot or mass, and what each member has of the values given.
   subroutine read_ends(group, mesh, it, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(connector_t), intent(inout) :: it
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: set
      logical :: line, total
      line = it%kind == spring_line .or. it%kind == dashpot_line
      if (it%kind == point_mass) then
         call get_set(group, kind_node, mesh, set, error)
         if (allocated(error)) return
         associate (members => mesh%node_sets(find_node_set(mesh, set))%members)
            it%node = reshape(members, [1, size(members)])
         end associate
      else
         call get_ends(group, mesh, it%node, error, ground=.true.)
         if (allocated(error)) return
         if (line .and. size(it%node, 1) == 1) call get_vector(group, 'anchor', it%anchor, error)
      end if
      call get(group, 'total', total, error, default=.false.)
      if (allocated(error)) return
      it%share = refined_share(group, mesh)
      if (total) it%share = 1.0_wp/size(it%node, 2)
   end subroutine read_ends

   !> One number for all three axes, or three. Without `default` not all are zero.
   subroutine get_triple(group, key, vector, error, default)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      real(wp), intent(inout) :: vector(3)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in), optional :: default
      real(wp), allocatable :: values(:)
      if (present(default)) vector = default
      call get(group, key, values, error, required=.not. present(default))
      if (allocated(error)) return
      if (size(values) == 0 .and. present(default)) return
      if (size(values) /= 1 .and. size(values) /= 3) then
         call complain_about(group, key, 'one number is expected, or three; '//text_of(size(values))//' were given', error)
         return
      end if
      vector = values(1)
      if (size(values) == 3) vector = values
      if (present(default)) return
      if (any(vector < 0)) then
         call complain_about(group, key, 'it is not negative; '//text_of(minval(vector))//' was given', error)
      else if (.not. any(vector > 0)) then
         call complain_about(group, key, 'it is zero along all axes', error)
      end if
   end subroutine get_triple
end module finshell_input_connector
