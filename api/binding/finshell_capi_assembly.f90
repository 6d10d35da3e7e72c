!> C interface: the handle of an assembly, what it is made of and what can be read from it. See finshell.h for what the functions
!> promise.
module finshell_capi_assembly
   use, intrinsic :: iso_c_binding, only: c_associated, c_f_pointer, c_int32_t, c_int64_t, c_intptr_t, c_loc, c_null_ptr, c_ptr
   use finshell_capi_common, only: accept, c_status_t, refuse, refuse_memory
   use finshell_capi_mesh, only: c_mesh_t, lay_out, layout_t, read_mesh
   use finshell_environment, only: environment_t, hold, release
   use finshell_freedoms, only: n_nodal, uz
   use finshell_status, only: status_ok
   implicit none
   private
   public :: receive_assembly

   !> 'SHELLMAT' in ASCII, the first thing a handle points to. Freed memory has another number there: ours is wiped before.
   integer(c_int64_t), parameter :: magic = int(z'5348454C4C4D4154', c_int64_t)

   type :: handle_t
      integer(c_int64_t) :: mark = magic
      type(layout_t) :: layout
   end type handle_t

contains

   !> The layout behind a handle.
   function receive_assembly(place, assembly, layout, status) result(code)
      character(len=*), intent(in) :: place
      type(c_ptr), intent(in) :: assembly
      type(layout_t), pointer, intent(out) :: layout
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(handle_t), pointer :: handle
      nullify (layout)
      if (.not. c_associated(assembly)) then
         code = refuse(status, place, 'assembly is NULL')
      else if (.not. is_handle(assembly)) then
         code = refuse(status, place, 'assembly is no handle: it was destroyed, or finshell_assembly_create did not make it')
      else
         call c_f_pointer(assembly, handle)
         layout => handle%layout
         code = accept(status)
      end if
   end function receive_assembly

   logical function is_handle(pointer)
      type(c_ptr), intent(in) :: pointer
      integer(c_int64_t), pointer :: mark
      is_handle = .false.
      ! no program has memory in its first page
      if (transfer(pointer, 0_c_intptr_t) >= 0 .and. transfer(pointer, 0_c_intptr_t) < 4096) return
      call c_f_pointer(pointer, mark)
      is_handle = mark == magic
   end function is_handle

   function create(mesh, sections, section, assembly, status) result(code) bind(c, name='finshell_assembly_create')
      type(c_ptr), value :: mesh
      integer(c_int32_t), value :: sections
      type(c_ptr), intent(in), optional, target :: section(*)
      type(c_ptr), intent(out), optional :: assembly
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_assembly_create'
      type(c_mesh_t) :: given
      type(handle_t), pointer :: handle
      type(environment_t) :: environment
      integer :: memory

      if (present(assembly)) assembly = c_null_ptr
      code = read_mesh(place, mesh, given, status)
      if (code /= status_ok) return
      if (.not. present(assembly)) then
         code = refuse(status, place, 'assembly is NULL')
      else if (given%nodes < 0) then
         code = refuse(status, place, 'mesh->nodes is #, expected a number >= 0', given%nodes)
      else if (given%elements < 0) then
         code = refuse(status, place, 'mesh->elements is #, expected a number >= 0', given%elements)
      else if (given%nodal /= 0 .and. given%nodal /= uz .and. given%nodal /= n_nodal) then
         code = refuse(status, place, 'mesh->nodal is #, expected 6, 3 (membranes alone) or 0 (as the sections need)', given%nodal)
      else if (given%triangle /= 0 .and. given%triangle /= 1) then
         code = refuse(status, place, 'mesh->triangle is #, expected 0 (the whole matrix) or 1 (its upper triangle)', &
                       given%triangle)
      else if (given%reserved /= 0) then
         code = refuse(status, place, 'mesh->reserved is #, expected 0', given%reserved)
      else if (given%rows /= 0 .and. .not. c_associated(given%freedoms)) then
         code = refuse(status, place, 'mesh->rows is #, expected 0 where mesh->freedoms is NULL', given%rows)
      else if (given%elements > 0 .and. .not. c_associated(given%triangles)) then
         code = refuse(status, place, 'mesh->triangles is NULL')
      else if (c_associated(given%starts) .neqv. c_associated(given%columns)) then
         code = refuse(status, place, 'mesh->starts and mesh->columns go together, and one is NULL')
      else if (c_associated(given%starts) .and. .not. c_associated(given%freedoms)) then
         code = refuse(status, place, 'a pattern of your own (mesh->starts) needs mesh->freedoms, the rows that are meant')
      else if (sections < 0 .or. (sections == 0 .and. given%elements > 0)) then
         code = refuse(status, place, 'sections is #, expected the number of sections that the elements have', sections)
      else if (sections > 0 .and. .not. present(section)) then
         code = refuse(status, place, 'section is NULL')
      end if
      if (code /= status_ok) return
      allocate (handle, stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      call hold(environment)
      if (sections > 0) then
         code = lay_out(place, given, sections, section, handle%layout, status)
      else
         code = lay_out(place, given, sections, [c_ptr ::], handle%layout, status)
      end if
      call release(environment)
      if (code == status_ok) then
         assembly = c_loc(handle)
         code = accept(status)
      else
         deallocate (handle)
      end if
   end function create

   subroutine destroy(assembly) bind(c, name='finshell_assembly_destroy')
      type(c_ptr), value :: assembly
      type(handle_t), pointer :: handle
      integer(c_int64_t), pointer, volatile :: mark ! or else the compiler drops what is written before memory is freed
      if (.not. is_handle(assembly)) return
      call c_f_pointer(assembly, mark)
      mark = 0
      call c_f_pointer(assembly, handle)
      deallocate (handle)
   end subroutine destroy

   function extent(assembly, nodal, rows, entries, status) result(code) bind(c, name='finshell_assembly_size')
      type(c_ptr), value :: assembly
      integer(c_int32_t), intent(out), optional :: nodal, rows
      integer(c_int64_t), intent(out), optional :: entries
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(layout_t), pointer :: layout
      code = receive_assembly('finshell_assembly_size', assembly, layout, status)
      if (code /= status_ok) return
      if (present(nodal)) nodal = layout%nodal
      if (present(rows)) rows = layout%pattern%n
      if (present(entries)) entries = layout%pattern%start(layout%pattern%n + 1) - 1
   end function extent

   function freedoms(assembly, number, status) result(code) bind(c, name='finshell_assembly_freedoms')
      type(c_ptr), value :: assembly
      integer(c_int32_t), intent(out), optional :: number(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_assembly_freedoms'
      type(layout_t), pointer :: layout
      integer :: node
      code = receive_assembly(place, assembly, layout, status)
      if (code /= status_ok) return
      if (.not. present(number)) then
         code = refuse(status, place, 'freedoms is NULL')
         return
      end if
      do node = 1, layout%nodes
         number(layout%nodal*(node - 1) + 1:layout%nodal*node) = layout%equation(:layout%nodal, node) - 1
      end do
   end function freedoms

   function pattern_32(assembly, starts, columns, status) result(code) bind(c, name='finshell_assembly_pattern')
      type(c_ptr), value :: assembly
      integer(c_int32_t), intent(out), optional :: starts(*), columns(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_assembly_pattern'
      type(layout_t), pointer :: layout
      integer(c_int64_t) :: p
      code = receive_assembly(place, assembly, layout, status)
      if (code /= status_ok) return
      associate (pattern => layout%pattern)
         if (pattern%start(pattern%n + 1) - 1 > huge(1_c_int32_t)) then
            code = refuse(status, place, 'the matrix has more than 2147483647 entries: take finshell_assembly_pattern_64')
            return
         end if
         if (present(starts)) starts(:pattern%n + 1) = int(pattern%start - 1, c_int32_t)
         if (.not. present(columns)) return
         do p = 1, size(pattern%row, kind=c_int64_t)
            columns(p) = pattern%row(p) - 1
         end do
      end associate
   end function pattern_32

   function pattern_64(assembly, starts, columns, status) result(code) bind(c, name='finshell_assembly_pattern_64')
      type(c_ptr), value :: assembly
      integer(c_int64_t), intent(out), optional :: starts(*), columns(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(layout_t), pointer :: layout
      integer(c_int64_t) :: p
      code = receive_assembly('finshell_assembly_pattern_64', assembly, layout, status)
      if (code /= status_ok) return
      associate (pattern => layout%pattern)
         if (present(starts)) starts(:pattern%n + 1) = pattern%start - 1
         if (.not. present(columns)) return
         do p = 1, size(pattern%row, kind=c_int64_t)
            columns(p) = pattern%row(p) - 1
         end do
      end associate
   end function pattern_64
end module finshell_capi_assembly
