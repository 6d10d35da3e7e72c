!> C interface: the mesh that a host assembles over, checked, and what is found once for it: patches of elements, the pattern, the
!> places of elements in it.
module finshell_capi_mesh
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int32_t, c_int64_t, c_int8_t, c_loc, c_null_ptr, &
      c_ptr, c_size_t, c_sizeof
   use finshell_capi_common, only: c_status_t, refuse, refuse_memory
   use finshell_capi_elements, only: memcpy, receive_section
   use finshell_colouring, only: new_patches, patches_t
   use finshell_freedoms, only: n_corners, n_nodal, n_shell, uz
   use finshell_kinds, only: i4, i8
   use finshell_pattern, only: new_pattern, pattern_t
   use finshell_scatter, only: new_scatter, scatter_t
   use finshell_section, only: section_t
   use finshell_status, only: status_ok
   implicit none
   private
   public :: c_mesh_t, layout_t, read_mesh, lay_out, patch_size

   !> finshell_mesh of the header. What a shorter block does not hold is zero.
   type, bind(c) :: c_mesh_t
      integer(c_int64_t) :: size = 0
      integer(c_int32_t) :: nodes = 0
      integer(c_int32_t) :: elements = 0
      integer(c_int32_t) :: nodal = 0
      integer(c_int32_t) :: triangle = 0
      integer(c_int32_t) :: rows = 0
      integer(c_int32_t) :: reserved = 0
      type(c_ptr) :: triangles = c_null_ptr
      type(c_ptr) :: sections = c_null_ptr
      type(c_ptr) :: held = c_null_ptr
      type(c_ptr) :: freedoms = c_null_ptr
      type(c_ptr) :: starts = c_null_ptr
      type(c_ptr) :: columns = c_null_ptr
   end type c_mesh_t

   integer, parameter :: optional_members = 5 !< pointers behind `triangles`
   integer(c_int64_t), parameter :: no_size = 4096 !< whatever is larger was not set
   integer, parameter :: patch_size = 32 !< elements in a patch: what a thread has in hand at a time

   !> Elements are kept in the order of their patches: slot s holds element patches%element(s). A group is a section.
   type :: layout_t
      integer :: nodes = 0, elements = 0
      integer :: nodal = n_nodal !< freedoms of a node in the arrays of the host
      type(patches_t) :: patches
      integer(i4), allocatable :: corner(:, :) !< (3, slots) nodes, from 1
      integer(i4), allocatable :: slot(:) !< (elements) where each is kept
      integer(i4), allocatable :: section(:) !< (elements) from 1
      logical, allocatable :: membrane(:) !< (sections) of which kind each is
      integer(i4), allocatable :: equation(:, :) !< (n_nodal, nodes) from 1; 0: held, or not there
      type(pattern_t) :: pattern
      type(scatter_t) :: scatter
   end type layout_t

contains

   !> The block of a mesh, of whatever size, as far as this library knows it.
   function read_mesh(place, pointer, mesh, status) result(code)
      character(len=*), intent(in) :: place
      type(c_ptr), intent(in) :: pointer
      type(c_mesh_t), intent(out), target :: mesh
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      integer(c_int64_t), pointer :: given
      integer(c_int8_t), pointer :: bytes(:)
      integer(c_int64_t) :: known, member

      if (.not. c_associated(pointer)) then
         code = refuse(status, place, 'mesh is NULL')
         return
      end if
      call c_f_pointer(pointer, given)
      known = c_sizeof(mesh)
      member = c_sizeof(pointer)
      if (given < 0 .or. given > no_size) then
         code = refuse(status, place, 'mesh->size is not set, expected sizeof(finshell_mesh)')
      else if (given < known - optional_members*member .or. modulo(given, member) /= 0) then
         code = refuse(status, place, 'mesh->size is #, expected sizeof(finshell_mesh)', int(given, c_int32_t))
      else
         call c_f_pointer(pointer, bytes, [given])
         if (any(bytes(known + 1:) /= 0)) then
            code = refuse(status, place, 'mesh->size is #, with members in use that this library does not know: finshell.h '// &
                          'is newer than the library', int(given, c_int32_t))
         else
            call memcpy(c_loc(mesh), pointer, int(min(given, known), c_size_t))
            code = status_ok
         end if
      end if
   end function read_mesh

   !> Check a mesh and find what is found once for it.
   function lay_out(place, mesh, sections, list, layout, status) result(code)
      character(len=*), intent(in) :: place
      type(c_mesh_t), intent(in) :: mesh
      integer(c_int32_t), intent(in) :: sections
      type(c_ptr), intent(in) :: list(sections) !< sections of the host, looked at for their kind
      type(layout_t), intent(inout) :: layout
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      integer(c_int32_t), pointer :: triangles(:, :), section(:)
      integer, allocatable :: corners(:, :), group(:), eq(:, :)
      logical, allocatable :: kinds(:)
      real(c_double), allocatable :: trial(:)
      integer(c_int64_t), pointer :: starts(:)
      integer(c_int32_t), pointer :: columns(:)
      type(section_t), pointer :: s
      integer :: e, equations, k, memory, missing

      layout%nodes = mesh%nodes
      layout%elements = mesh%elements
      allocate (layout%membrane(sections), stat=memory)
      if (memory == 0) allocate (trial(words(mesh)), stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      deallocate (trial)
      do k = 1, sections
         code = receive_section(place, list(k), s, status)
         if (code /= status_ok) return
         layout%membrane(k) = s%membrane
      end do
      layout%nodal = mesh%nodal
      if (mesh%nodal == 0) layout%nodal = merge(uz, n_nodal, sections > 0 .and. all(layout%membrane))
      if (layout%nodal == uz .and. .not. all(layout%membrane)) then
         code = refuse(status, place, 'mesh->nodal is 3, and a section is that of a shell, whose nodes have 6 freedoms')
         return
      end if

      allocate (corners(n_corners, mesh%elements), group(mesh%elements), kinds(mesh%elements))
      allocate (eq(n_nodal, mesh%nodes))
      if (mesh%elements > 0) then
         call c_f_pointer(mesh%triangles, triangles, [n_corners, mesh%elements])
         do e = 1, mesh%elements
            corners(:, e) = triangles(:, e) + 1
         end do
         group = 1
         if (c_associated(mesh%sections)) then
            call c_f_pointer(mesh%sections, section, [mesh%elements])
            group = section + 1
         end if
      end if
      code = bad_elements(place, corners, group, mesh%nodes, sections, status)
      if (code /= status_ok) return
      code = number_freedoms(place, mesh, layout, corners, group, eq, equations, status)
      if (code /= status_ok) return

      call new_patches(layout%patches, corners, mesh%nodes, group, patch_size)
      allocate (layout%corner(n_corners, mesh%elements), layout%slot(mesh%elements), layout%equation(n_nodal, mesh%nodes))
      do e = 1, mesh%elements
         layout%corner(:, e) = int(corners(:, layout%patches%element(e)), i4)
         layout%slot(layout%patches%element(e)) = int(e, i4)
         kinds(e) = layout%membrane(group(layout%patches%element(e)))
      end do
      layout%equation = int(eq, i4)
      layout%section = int(group, i4)
      if (c_associated(mesh%starts)) then
         call c_f_pointer(mesh%starts, starts, [equations + 1])
         if (starts(equations + 1) > 0) then
            call c_f_pointer(mesh%columns, columns, [starts(equations + 1)])
         else
            allocate (columns(0))
         end if
         code = take_pattern(place, mesh, equations, starts, columns, layout%pattern, status)
         if (starts(equations + 1) <= 0) deallocate (columns)
         if (code /= status_ok) return
      else
         call new_pattern(layout%pattern, equations, corners, eq, mesh%triangle == 1)
      end if
      do e = 1, mesh%elements
         corners(:, e) = layout%corner(:, e)
      end do
      call new_scatter(layout%scatter, layout%pattern, corners, eq, kinds, missing)
      if (missing > 0) code = refuse(status, place, 'the pattern of mesh->starts and mesh->columns lacks entries of element #', &
                                     layout%patches%element(missing) - 1)
   end function lay_out

   !> What is wrong with the elements.
   function bad_elements(place, corners, group, nodes, sections, status) result(code)
      character(len=*), intent(in) :: place
      integer, intent(in) :: corners(:, :), group(:), nodes, sections
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      integer :: e
      code = status_ok
      do e = 1, size(group)
         if (any(corners(:, e) < 1 .or. corners(:, e) > nodes)) then
            code = refuse(status, place, 'mesh->triangles: element # names a node that is not in 0 .. nodes - 1', e - 1)
         else if (corners(1, e) == corners(2, e) .or. corners(2, e) == corners(3, e) .or. corners(3, e) == corners(1, e)) then
            code = refuse(status, place, 'mesh->triangles: element # names a node twice', e - 1)
         else if (group(e) < 1 .or. group(e) > sections) then
            code = refuse(status, place, 'mesh->sections: element # has a section that is not in 0 .. sections - 1', e - 1)
         end if
         if (code /= status_ok) return
      end do
   end function bad_elements

   !> Equations of the freedoms: those of the host, or in turn over the nodes, without what is held and what no element has.
   function number_freedoms(place, mesh, layout, corners, group, eq, equations, status) result(code)
      character(len=*), intent(in) :: place
      type(c_mesh_t), intent(in) :: mesh
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: corners(:, :), group(:)
      integer, intent(out) :: eq(:, :), equations
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      integer(c_int32_t), pointer :: given(:, :)
      integer :: e, i, j, node

      code = status_ok
      eq = 0
      equations = 0
      if (mesh%nodes == 0) return
      do e = 1, size(group)
         do j = 1, n_corners
            eq(:merge(uz, n_nodal, layout%membrane(group(e))), corners(j, e)) = 1
         end do
      end do
      if (c_associated(mesh%held)) then
         call c_f_pointer(mesh%held, given, [layout%nodal, mesh%nodes])
         where (given /= 0) eq(:layout%nodal, :) = 0
      end if
      if (.not. c_associated(mesh%freedoms)) then
         do node = 1, mesh%nodes
            do i = 1, n_nodal
               if (eq(i, node) == 0) cycle
               equations = equations + 1
               eq(i, node) = equations
            end do
         end do
         return
      end if
      call c_f_pointer(mesh%freedoms, given, [layout%nodal, mesh%nodes])
      do node = 1, mesh%nodes
         if (any(given(:, node) < -1 .or. given(:, node) == huge(1))) then
            code = refuse(status, place, 'mesh->freedoms: node # has a number below -1, or too large a one', node - 1)
            return
         end if
         ! of freedoms that no element has, the number is the host's affair, and the matrix is as large as it says
         equations = max(equations, maxval(given(:, node)) + 1)
         eq(:layout%nodal, node) = merge(given(:, node) + 1, 0, eq(:layout%nodal, node) == 1)
      end do
      if (mesh%rows /= 0) then
         if (mesh%rows < equations) then
            code = refuse(status, place, 'mesh->rows is #, and mesh->freedoms has larger numbers', mesh%rows)
            return
         end if
         equations = mesh%rows
      end if
      do e = 1, size(group)
         if (all_different(reshape(eq(:, corners(:, e)), [n_shell]))) cycle
         code = refuse(status, place, 'mesh->freedoms: element # has two freedoms with the same number', e - 1)
         return
      end do
   end function number_freedoms

   !> Are the numbers that are not 0 different?
   pure logical function all_different(number)
      integer, intent(in) :: number(:)
      integer :: i
      all_different = .true.
      do i = 2, size(number)
         if (number(i) > 0) all_different = all_different .and. .not. any(number(:i - 1) == number(i))
      end do
   end function all_different

   !> The pattern of a matrix of the host's, which has room for others, too.
   function take_pattern(place, mesh, n, starts, columns, pattern, status) result(code)
      character(len=*), intent(in) :: place
      type(c_mesh_t), intent(in) :: mesh
      integer, intent(in) :: n
      integer(c_int64_t), intent(in) :: starts(:)
      integer(c_int32_t), intent(in) :: columns(:)
      type(pattern_t), intent(out) :: pattern
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      integer(i8) :: p
      integer :: memory, r

      code = status_ok
      do r = 1, n
         if (starts(1) /= 0 .or. starts(r + 1) < starts(r)) then
            code = refuse(status, place, 'mesh->starts must begin with 0 and not fall, which it does behind row #', r - 1)
            return
         end if
         do p = starts(r) + 1, starts(r + 1)
            if (columns(p) < 0 .or. columns(p) >= n) code = -1
            if (p > starts(r) + 1) then
               if (columns(p) <= columns(p - 1)) code = -1
            end if
            if (mesh%triangle == 1 .and. columns(p) < r - 1) code = -1
            if (code == status_ok) cycle
            code = refuse(status, place, 'mesh->columns must rise within each row and be in 0 .. rows - 1 (of a triangle, from '// &
                          'the diagonal on), which they are not in row #', r - 1)
            return
         end do
      end do
      pattern%n = n
      pattern%symmetric = mesh%triangle == 1
      allocate (pattern%start(n + 1), stat=memory)
      if (memory == 0) allocate (pattern%row(size(columns, kind=i8)), stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      pattern%start = starts + 1
      pattern%row = columns + 1_i4
   end function take_pattern

   !> Memory that a layout needs at most while it is made, in words of 8 bytes. It is tried for, so that none runs out on the way.
   pure integer(i8) function words(mesh)
      type(c_mesh_t), intent(in) :: mesh
      integer(i8), parameter :: of_node = 60, of_element = 420
      words = 10000 + of_node*mesh%nodes + of_element*mesh%elements
   end function words
end module finshell_capi_mesh
