!> The groups &tie, &rigid_body, &equal and &equation of an input file.
module finshell_input_joint
   use finshell_component, only: expand_component, most_unknowns
   use finshell_equations, only: equations_t, new_equations
   use finshell_error, only: error_t, raise, text_of
   use finshell_factor, only: number_of_factors
   use finshell_freedoms, only: uz
   use finshell_input_common, only: get_set, get_sets, kind_node
   use finshell_input_tie, only: read_tie
   use finshell_joint, only: joint_t, joints_t, linear_equation_t, origin_t
   use finshell_kinds, only: wp
   use finshell_link_builder, only: component_names
   use finshell_mesh, only: find_node_set, mesh_size, mesh_t, node_text
   use finshell_namelist, only: check_all_used, complain_about, count_groups, get, get_strings, group_t, namelist_t
   use finshell_partner, only: shifted_partner
   use finshell_status, only: status_input_error
   use finshell_structure, only: structure_t, turning_nodes
   implicit none
   private
   public :: read_joints, check_joints, is_joint

   character(len=*), parameter :: displacements = 'ux, uy, uz'
   real(wp), parameter :: alike = 1.0e-6_wp !< of the size of the mesh: sets that are paired differ by less

contains

   elemental logical function is_joint(name)
      character(len=*), intent(in) :: name
      is_joint = name == 'tie' .or. name == 'rigid_body' .or. name == 'equal' .or. name == 'equation'
   end function is_joint

   !> All groups that join nodes. Nodes may be moved onto the surface that they are tied to.
   subroutine read_joints(namelist, structure, error)
      type(namelist_t), intent(inout) :: namelist
      type(structure_t), intent(inout) :: structure !< with its sections
      type(error_t), allocatable, intent(inout) :: error
      type(joints_t) :: joints
      logical, allocatable :: turns(:)
      integer :: i
      if (allocated(error)) return
      if (.not. any([(is_joint(namelist%groups(i)%name), i=1, size(namelist%groups))])) return
      allocate (joints%list(0), joints%equations(0), joints%origins(0))
      turns = turning_nodes(structure)
      do i = 1, size(namelist%groups)
         associate (group => namelist%groups(i))
            if (.not. is_joint(group%name)) cycle
            if (count_groups(namelist, 'accuracy') > 0) then
               call complain_about(group, '', 'joints are between nodes of one mesh, and &accuracy changes it from run to run; ' &
                  //'take &accuracy out and refine in &mesh', error)
               return
            end if
            call append_origin(joints%origins, group%file//':'//text_of(group%line)//': &'//group%name)
            select case (group%name)
            case ('tie'); call read_tie(group, structure%mesh, structure%sections%thickness, turns, joints, error)
            case ('rigid_body'); call read_rigid_body(group, structure%mesh, turns, joints, error)
            case ('equal'); call read_equal(group, structure%mesh, joints, error)
            case ('equation'); call read_equation(group, structure%mesh, joints, error)
            end select
            call check_all_used(group, error)
            if (allocated(error)) return
         end associate
      end do
      structure%joints = joints
   end subroutine read_joints

   !> Refuse joints that cannot be: with each other, or with the supports.
   subroutine check_joints(structure, file, error)
      type(structure_t), intent(in) :: structure
      character(len=*), intent(in) :: file
      type(error_t), allocatable, intent(inout) :: error
      type(equations_t) :: equations
      type(error_t), allocatable :: refusal
      integer :: equation(most_unknowns), n, r
      real(wp) :: coefficient(most_unknowns)
      if (allocated(error) .or. .not. allocated(structure%joints)) return
      call new_equations(equations, structure%mesh, structure%supports, refusal, turning_nodes(structure), &
                         number_of_factors(structure%cases), joints=structure%joints)
      if (allocated(refusal)) then
         if (index(refusal%message, file//':') /= 1) refusal%message = file//': '//refusal%message
         call raise(error, refusal%code, refusal%message)
         return
      end if
      if (.not. equations%links%any()) return
      do r = 1, size(equations%links%node)
         call expand_component(equations, equations%links%node(r), equations%links%component(r), equation, coefficient, n)
         if (n <= most_unknowns) cycle
         call raise(error, status_input_error, file//': '//node_text(structure%mesh, equations%links%node(r))//' depends on ' &
            //text_of(n)//' components of others by way of &equation, &tie and &rigid_body; at most '//text_of(most_unknowns) &
            //' are expected')
         return
      end do
   end subroutine check_joints

   !> &rigid_body: nodes that go with a reference node.
   subroutine read_rigid_body(group, mesh, turns, joints, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      logical, intent(in) :: turns(:)
      type(joints_t), intent(inout) :: joints
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: sets(:), reference
      type(joint_t), allocatable :: list(:)
      integer, allocatable :: members(:)
      integer :: i, k, n, at
      logical :: rotations
      call get_sets(group, kind_node, mesh, sets, error, required=.true.)
      call get(group, 'reference', reference, error)
      call get(group, 'rotations', rotations, error, default=.true.)
      if (allocated(error)) return
      at = one_node(group, 'reference', mesh, reference, error)
      if (allocated(error)) return
      do i = 1, size(sets)
         members = mesh%node_sets(find_node_set(mesh, trim(sets(i))))%members
         members = pack(members, members /= at)
         if (i > 1) members = pack(members, [(.not. any(members(k) == list%node), k=1, size(members))])
         n = 0
         if (i > 1) n = size(list)
         if (i == 1) allocate (list(0))
         list = [list, [(joint_t(node=members(k), origin=size(joints%origins)), k=1, size(members))]]
      end do
      if (size(list) == 0) then
         call complain_about(group, 'node_set', 'it has no node beside the reference node', error)
         return
      end if
      do i = 1, size(list)
         list(i)%master(1) = at
         list(i)%arm = mesh%coordinates(:, list(i)%node) - mesh%coordinates(:, at)
         list(i)%on_arm = norm2(list(i)%arm) > 0
         list(i)%turns = rotations .and. turns(list(i)%node)
      end do
      joints%list = [joints%list, list]
   end subroutine read_rigid_body

   !> &equal: displacement components that are the same at all nodes of a set.
   subroutine read_equal(group, mesh, joints, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(joints_t), intent(inout) :: joints
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name, words(:)
      type(linear_equation_t), allocatable :: equations(:)
      integer :: c, i, k, n
      call get_set(group, kind_node, mesh, name, error)
      call get_strings(group, 'components', words, error, required=.true., choices=displacements)
      if (allocated(error)) return
      associate (members => mesh%node_sets(find_node_set(mesh, name))%members)
         if (size(members) < 2) then
            call complain_about(group, 'node_set', "'"//name//"' has one node; two or more are expected", error)
            return
         end if
         allocate (equations(size(words)*(size(members) - 1)))
         n = 0
         do k = 1, size(words)
            c = component(words(k))
            do i = 2, size(members)
               n = n + 1
               equations(n) = linear_equation_t([members(i), members(1)], [c, c], [1.0_wp, -1.0_wp], size(joints%origins))
            end do
         end do
      end associate
      call append_equations(joints%equations, equations)
   end subroutine read_equal

   !> &equation: a sum of displacement components that is zero, for single nodes or for all nodes of sets that are alike.
   subroutine read_equation(group, mesh, joints, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(joints_t), intent(inout) :: joints
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: sets(:), words(:)
      real(wp), allocatable :: coefficients(:), distance(:)
      type(linear_equation_t), allocatable :: equations(:)
      integer, allocatable :: nodes(:, :), partner(:)
      integer :: i, k, leading, many, n

      call get_sets(group, kind_node, mesh, sets, error, required=.true.)
      call get_strings(group, 'components', words, error, required=.true., choices=displacements)
      if (allocated(error)) return
      n = size(sets)
      call get(group, 'coefficients', coefficients, error, required=.true., number=n)
      if (allocated(error)) return
      if (size(words) /= n) then
         call complain_about(group, 'components', text_of(size(words))//' components were found for '//text_of(n) &
            //' node sets; one for each is expected', error)
         return
      end if
      if (n < 2 .or. any(.not. abs(coefficients) > 0)) then
         call complain_about(group, merge('coefficients', 'node_set    ', n > 1), &
                             'two or more terms are expected, with coefficients other than zero', error)
         return
      end if
      many = 1
      leading = 0
      do k = 1, n
         associate (size_of_set => size(members_of(k)))
            if (size_of_set == 1) cycle
            if (leading == 0) then
               leading = k
               many = size_of_set
            else if (size_of_set /= many) then
               call complain_about(group, 'node_set', "'"//trim(sets(k))//"' has "//text_of(size_of_set)//" nodes and '" &
                  //trim(sets(leading))//"' "//text_of(many)//'; sets of one node, or of equally many are expected', error)
               return
            end if
         end associate
      end do
      allocate (nodes(n, many), partner(many), distance(many))
      do k = 1, n
         associate (members => members_of(k))
            if (size(members) == 1) then
               nodes(k, :) = members(1)
            else
               call shifted_partner(mesh, members_of(leading), members, partner, distance)
               i = findloc(distance > alike*mesh_size(mesh), .true., dim=1)
               if (i > 0) then
                  call complain_about(group, 'node_set', "the nodes of '"//trim(sets(k))//"' do not lie as those of '" &
                     //trim(sets(leading))//"' do: shifted by the distance of their centres, " &
                     //node_text(mesh, partner(i))//' is '//text_of(real(distance(i), kind(1.0d0)))//' away', error)
                  return
               end if
               nodes(k, :) = partner
            end if
         end associate
      end do
      allocate (equations(many))
      do i = 1, many
         equations(i) = linear_equation_t(nodes(:, i), [(component(words(k)), k=1, n)], coefficients, size(joints%origins))
      end do
      call append_equations(joints%equations, equations)

   contains

      function members_of(set) result(members)
         integer, intent(in) :: set
         integer, allocatable :: members(:)
         members = mesh%node_sets(find_node_set(mesh, trim(sets(set))))%members
      end function members_of
   end subroutine read_equation

   !> The node of a set that has one only.
   integer function one_node(group, key, mesh, name, error) result(node)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key, name
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      node = 0
      i = find_node_set(mesh, name)
      if (i == 0) then
         call complain_about(group, key, "there is no node set or &node '"//name//"'", error)
      else if (size(mesh%node_sets(i)%members) /= 1) then
         call complain_about(group, key, "'"//name//"' has "//text_of(size(mesh%node_sets(i)%members)) &
            //' nodes; the name of a &node or of a node set with one node is expected', error)
      else
         node = mesh%node_sets(i)%members(1)
      end if
   end function one_node

   pure integer function component(word)
      character(len=*), intent(in) :: word
      component = findloc(component_names(:uz), word(:2), dim=1)
   end function component

   subroutine append_origin(list, text)
      type(origin_t), allocatable, intent(inout) :: list(:)
      character(len=*), intent(in) :: text
      type(origin_t), allocatable :: grown(:)
      integer :: i
      allocate (grown(size(list) + 1))
      do i = 1, size(list)
         grown(i) = list(i)
      end do
      grown(size(grown))%text = text
      call move_alloc(grown, list)
   end subroutine append_origin

   subroutine append_equations(list, more)
      type(linear_equation_t), allocatable, intent(inout) :: list(:)
      type(linear_equation_t), intent(in) :: more(:)
      type(linear_equation_t), allocatable :: grown(:)
      integer :: i
      allocate (grown(size(list) + size(more)))
      do i = 1, size(list)
         grown(i) = list(i)
      end do
      do i = 1, size(more)
         grown(size(list) + i) = more(i)
      end do
      call move_alloc(grown, list)
   end subroutine append_equations
end module finshell_input_joint
