!> The group &support of an input file.
module finshell_input_support
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_nodal
   use finshell_error, only: error_t, raise, text_of
   use finshell_factor, only: by_constant_factor
   use finshell_equations, only: equations_t, new_equations
   use finshell_mesh, only: mesh_t
   use finshell_rotation, only: cross_product
   use finshell_support, only: support_t, support_components, support_clamp, support_hinge, support_symmetry
   use finshell_support, only: axes_given, axes_cylindrical
   use finshell_input_case, only: get_scaling, get_span, scales_t
   use finshell_namelist, only: group_t, namelist_t, get, get_strings, has, check_all_used, complain_about
   use finshell_input_common, only: get_sets, get_vector, place_error, kind_node
   implicit none
   private
   public :: read_supports, check_supports

   character(len=*), parameter :: kinds = &
      'clamped, hinged, pinned, symmetry_x, symmetry_y, symmetry_z, symmetry, components'
   character(len=2), parameter :: components(n_nodal) = ['ux', 'uy', 'uz', 'rx', 'ry', 'rz']
   character(len=*), parameter :: component_names = 'ux, uy, uz, rx, ry, rz'

contains

   !> All groups &support.
   subroutine read_supports(namelist, mesh, scales, supports, last, groups, error)
      type(namelist_t), intent(inout) :: namelist
      type(mesh_t), intent(in) :: mesh
      type(scales_t), intent(inout) :: scales
      type(support_t), allocatable, intent(out) :: supports(:)
      integer, allocatable, intent(out) :: last(:) !< of the supports of each group
      integer, allocatable, intent(out) :: groups(:) !< where they are in the namelist
      type(error_t), allocatable, intent(inout) :: error
      integer :: i

      groups = pack([(i, i=1, size(namelist%groups))], [(namelist%groups(i)%name == 'support', i=1, size(namelist%groups))])
      allocate (supports(0), last(size(groups)))
      do i = 1, size(groups)
         call read_support(namelist%groups(groups(i)), mesh, scales, supports, error)
         if (allocated(error)) return
         last(i) = size(supports)
      end do
   end subroutine read_supports

   !> &support: one support for each of its node sets.
   subroutine read_support(group, mesh, scales, supports, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(scales_t), intent(inout) :: scales
      type(support_t), allocatable, intent(inout) :: supports(:)
      type(error_t), allocatable, intent(inout) :: error
      type(support_t) :: support
      type(support_t), allocatable :: grown(:)
      character(len=:), allocatable :: sets(:), kind_name
      integer :: i

      if (allocated(error)) return
      call get_sets(group, kind_node, mesh, sets, error, required=.true.)
      call get(group, 'type', kind_name, error, default='components', choices=kinds)
      call get_span(group, scales, support%span, error)
      if (allocated(error)) return
      select case (kind_name)
      case ('clamped')
         support%kind = support_clamp
      case ('hinged', 'pinned')
         support%kind = support_hinge
      case ('components')
         support%kind = support_components
         call read_components(group, scales, support, error)
         call read_axes(group, support, error)
      case default
         support%kind = support_symmetry
         if (kind_name == 'symmetry') call get_vector(group, 'normal', support%normal, error, nonzero=.true.)
         if (kind_name /= 'symmetry') support%normal = merge(1.0_wp, 0.0_wp, kind_name(10:10) == ['x', 'y', 'z'])
      end select
      call check_all_used(group, error)
      if (allocated(error)) return
      allocate (grown(size(supports) + size(sets)))
      do i = 1, size(supports)
         grown(i) = supports(i)
      end do
      do i = 1, size(sets)
         support%node_set = trim(sets(i))
         grown(size(supports) + i) = support
      end do
      call move_alloc(grown, supports)
   end subroutine read_support

   !> fixed = 'ux', ... holds components at zero; ux = value holds one at a value.
   subroutine read_components(group, scales, support, error)
      type(group_t), intent(inout) :: group
      type(scales_t), intent(inout) :: scales
      type(support_t), intent(inout) :: support
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: fixed(:)
      integer :: i, k

      call get_strings(group, 'fixed', fixed, error, choices=component_names)
      do k = 1, n_nodal
         if (allocated(error)) return
         call get(group, components(k), support%value(k), error, default=0.0_wp)
         support%fixed(k) = has(group, components(k))
         do i = 1, size(fixed)
            if (fixed(i) (1:2) /= components(k)) cycle
            if (has(group, components(k))) call complain_about(group, components(k), &
               'the component is held twice: it has a value and is in fixed', error)
            support%fixed(k) = .true.
         end do
      end do
      call get_scaling(group, scales, support%scaling, error)
      call check_values(group, scales, support, error)
      if (.not. allocated(error) .and. .not. any(support%fixed)) call complain_about(group, '', &
         "nothing is held: give type = 'clamped' or another type, or components (fixed = 'ux', ... or ux = value)", error)
   end subroutine read_components

   !> Values that would jump, or never be reached: a support holds its nodes where it finds them and moves them as its factor does.
   subroutine check_values(group, scales, support, error)
      type(group_t), intent(in) :: group
      type(scales_t), intent(in) :: scales
      type(support_t), intent(in) :: support
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      if (allocated(error) .or. .not. any(abs(support%value) > 0)) return
      if (support%scaling == by_constant_factor .and. support%span%first > 1) then
         call complain_about(group, 'constant', 'a support that comes with a later step holds its nodes where they are, and a ' &
                             //'constant value would never move them', error)
         return
      end if
      do i = 1, size(scales%followers)
         associate (f => scales%followers(i))
            if (f%factor /= support%scaling .or. .not. abs(f%table%value(0.0_wp)) > 0) cycle
            call complain_about(group, 'amplitude', 'the support would jump: the factor of the amplitude at 0 is ' &
                                //text_of(f%table%value(0.0_wp))//', expected is 0', error)
            return
         end associate
      end do
   end subroutine check_values

   !> Axes in which components are held: global, two given vectors, or cylindrical about a line.
   subroutine read_axes(group, support, error)
      type(group_t), intent(inout) :: group
      type(support_t), intent(inout) :: support
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: kind_name
      real(wp) :: first(3), second(3)

      call get(group, 'axes', kind_name, error, default='global', choices='global, given, cylindrical')
      if (allocated(error)) return
      select case (kind_name)
      case ('given')
         support%axes_kind = axes_given
         call get_vector(group, 'axis_1', first, error, nonzero=.true.)
         call get_vector(group, 'axis_2', second, error, nonzero=.true.)
         if (allocated(error)) return
         first = first/norm2(first)
         second = second/norm2(second)
         second = second - dot_product(first, second)*first
         if (norm2(second) < 1.0e-6_wp) then
            call complain_about(group, 'axis_2', 'it must not be parallel to axis_1', error)
            return
         end if
         second = second/norm2(second)
         support%axes(:, 1) = first
         support%axes(:, 2) = second
         support%axes(:, 3) = cross_product(first, second)
      case ('cylindrical')
         support%axes_kind = axes_cylindrical
         call get_vector(group, 'axis', support%axis, error, nonzero=.true.)
         call get_vector(group, 'origin', support%origin, error, default=[0.0_wp, 0.0_wp, 0.0_wp])
      end select
   end subroutine read_axes

   !> Refuse supports that contradict each other; the first one that cannot join those before it is named.
   subroutine check_supports(groups, last, mesh, supports, file, error)
      type(group_t), intent(in) :: groups(:) !< the groups &support in the order of the file
      integer, intent(in) :: last(:) !< number of supports up to each of them
      type(mesh_t), intent(in) :: mesh
      type(support_t), intent(in) :: supports(:)
      character(len=*), intent(in) :: file
      type(error_t), allocatable, intent(inout) :: error
      type(equations_t) :: equations
      type(error_t), allocatable :: refusal, partial
      integer :: i, step

      if (allocated(error)) return
      do step = 1, maxval([1, supports%span%first, pack(supports%span%last, supports%span%last < huge(1)) + 1])
         if (step > 1 .and. .not. any(supports%span%first == step .or. supports%span%last == step - 1)) cycle
         call new_equations(equations, mesh, supports, refusal, step=step)
         if (allocated(refusal)) exit
      end do
      if (.not. allocated(refusal)) return
      do i = 1, size(groups)
         call new_equations(equations, mesh, supports(:last(i)), partial, step=step)
         if (.not. allocated(partial)) cycle
         call place_error(groups(i), '', partial)
         call move_alloc(partial, error)
         return
      end do
      call raise(error, refusal%code, file//': '//refusal%message)
   end subroutine check_supports
end module finshell_input_support
