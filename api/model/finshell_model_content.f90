!> C interface of models: creation, sizes, texts, mesh. See finshell_model.h for what the functions promise.
module finshell_model_content
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_int32_t, c_int64_t, c_loc, c_null_ptr, &
      c_ptr
   use finshell_c_text, only: store_text, text_from
   use finshell_error, only: error_t, raise
   use finshell_mesh, only: add_edge_set, add_element_set, add_node_set, find_element_set, find_node_set, mesh_t, new_mesh
   use finshell_model_handle, only: free_model, model_t, new_model
   use finshell_model_status, only: done, enter, model_status_t, refuse, report
   use finshell_session_files, only: close_files
   use finshell_session_texts, only: text_about
   use finshell_status, only: status_invalid_argument, status_out_of_memory
   use finshell_visit, only: visit_t
   implicit none
   private
   public :: c_set_t, c_mesh_t, c_size_t_of_model, abi, create, destroy, sizes, text, mesh_arrays, set_members

   integer(c_int32_t), parameter :: abi_number = 1

   !> finshell_model_set, finshell_model_mesh and finshell_model_size of the header.
   type, bind(c) :: c_set_t
      type(c_ptr) :: name
      integer(c_int32_t) :: kind, number
      type(c_ptr) :: members
   end type c_set_t

   type, bind(c) :: c_mesh_t
      integer(c_int64_t) :: size
      integer(c_int32_t) :: nodes, elements, sets, reserved
      type(c_ptr) :: coordinates, triangles, set
   end type c_mesh_t

   type, bind(c) :: c_size_t_of_model
      integer(c_int32_t) :: nodes, elements, unknowns, sections, steps, columns
   end type c_size_t_of_model

contains

   function abi() result(number) bind(c, name='finshell_model_abi')
      integer(c_int32_t) :: number
      number = abi_number
   end function abi

   function create(file, content, mesh, handle, status) result(code) bind(c, name='finshell_model_create')
      type(c_ptr), value :: file, content, mesh
      type(c_ptr), intent(out), optional :: handle
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
!$omp critical (finshell_models)
      call visit%begin()
      call visit%work_with(1)
      code = begin_model(file, content, mesh, handle, status)
      call visit%leave()
!$omp end critical (finshell_models)
   end function create

   function begin_model(file, content, mesh, handle, status) result(code)
      type(c_ptr), intent(in) :: file, content, mesh
      type(c_ptr), intent(out), optional :: handle
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_model_create'
      type(error_t), allocatable :: error
      type(model_t), pointer :: model
      type(mesh_t), allocatable :: given

      if (present(handle)) handle = c_null_ptr
      if (.not. (c_associated(file) .and. present(handle))) then
         code = refuse(status, place, 'file or model is NULL')
         return
      end if
      if (c_associated(mesh) .and. .not. c_associated(content)) then
         code = refuse(status, place, 'a mesh goes with a text, which is NULL')
         return
      end if
      if (c_associated(mesh)) call read_arrays(mesh, given, error)
      if (allocated(error)) then
         code = report(status, place, error)
         return
      end if
      model => new_model()
      if (.not. associated(model)) then
         call raise(error, status_out_of_memory, 'out of memory')
      else if (c_associated(content)) then
         call model%session%begin(text_from(file), error, text_from(content), given)
      else
         call model%session%begin(text_from(file), error)
      end if
      code = report(status, place, error)
      if (.not. allocated(error)) handle = c_loc(model)
      if (allocated(error) .and. associated(model)) call free_model(c_loc(model))
   end function begin_model

   !> A mesh from arrays. Errors: NULL, a size or number that is none; what else may be wrong is found when the input is read.
   subroutine read_arrays(pointer, mesh, error)
      type(c_ptr), intent(in) :: pointer
      type(mesh_t), allocatable, intent(out) :: mesh
      type(error_t), allocatable, intent(out) :: error
      type(c_mesh_t), pointer :: given
      type(c_set_t), pointer :: set(:)
      real(c_double), pointer :: coordinates(:, :)
      integer(c_int32_t), pointer :: triangles(:, :), members(:)
      integer :: i
      call c_f_pointer(pointer, given)
      if (given%size < storage_size(given)/8) then
         call raise(error, status_invalid_argument, 'size of the mesh is not sizeof(finshell_model_mesh)')
      else if (given%nodes < 1 .or. given%elements < 1 .or. given%sets < 0) then
         call raise(error, status_invalid_argument, 'the mesh has no nodes, no elements, or a negative number of sets')
      else if (.not. (c_associated(given%coordinates) .and. c_associated(given%triangles)) &
               .or. (given%sets > 0 .and. .not. c_associated(given%set))) then
         call raise(error, status_invalid_argument, 'an array of the mesh is NULL')
      end if
      if (allocated(error)) return
      call c_f_pointer(given%coordinates, coordinates, [3, int(given%nodes)])
      call c_f_pointer(given%triangles, triangles, [3, int(given%elements)])
      allocate (mesh)
      call new_mesh(mesh, coordinates, triangles + 1)
      if (given%sets == 0) return
      call c_f_pointer(given%set, set, [int(given%sets)])
      do i = 1, size(set)
         if (.not. c_associated(set(i)%name) .or. set(i)%number < 0 .or. set(i)%kind < 0 .or. set(i)%kind > 2 &
             .or. .not. c_associated(set(i)%members)) then
            call raise(error, status_invalid_argument, 'a set of the mesh has no name, no members or an unknown kind')
            return
         end if
         call c_f_pointer(set(i)%members, members, [int(set(i)%number)*merge(2, 1, set(i)%kind == 2)])
         if (any(members < 0 .or. members >= merge(given%elements, given%nodes, set(i)%kind == 1))) then
            call raise(error, status_invalid_argument, "the set '"//text_from(set(i)%name)//"' of the mesh has a member that " &
                       //'there is not; they count from 0')
            return
         end if
         select case (set(i)%kind)
         case (0); call add_node_set(mesh, text_from(set(i)%name), members + 1)
         case (1); call add_element_set(mesh, text_from(set(i)%name), members + 1)
         case (2); call add_edge_set(mesh, text_from(set(i)%name), reshape(members + 1, [2, size(members)/2]))
         end select
      end do
   end subroutine read_arrays

   function destroy(handle, status) result(code) bind(c, name='finshell_model_destroy')
      type(c_ptr), value :: handle
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
      type(error_t), allocatable :: error
      if (.not. c_associated(handle)) then
         code = done(status)
         return
      end if
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_destroy', model, code, status)
      if (code == 0) then
         call close_files(model%session, error)
         code = report(status, 'finshell_model_destroy', error)
         call free_model(handle)
      end if
      call visit%leave()
!$omp end critical (finshell_models)
   end function destroy

   function sizes(handle, numbers, status) result(code) bind(c, name='finshell_model_sizes')
      type(c_ptr), value :: handle
      type(c_size_t_of_model), intent(out), optional :: numbers
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_sizes', model, code, status)
      if (code == 0) code = count_all(model, numbers, status)
      call visit%leave()
!$omp end critical (finshell_models)
   end function sizes

   function text(handle, what, buffer, size, length, status) result(code) bind(c, name='finshell_model_text')
      type(c_ptr), value :: handle, what, buffer
      integer(c_int32_t), value :: size
      integer(c_int32_t), intent(out), optional :: length
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_text', model, code, status)
      if (code == 0) code = give_text(model, what, buffer, size, length, status)
      call visit%leave()
!$omp end critical (finshell_models)
   end function text

   function mesh_arrays(handle, coordinates, triangles, status) result(code) bind(c, name='finshell_model_mesh_arrays')
      type(c_ptr), value :: handle
      type(c_ptr), intent(out), optional :: coordinates, triangles
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_mesh_arrays', model, code, status)
      if (code == 0) code = show_mesh(model, coordinates, triangles)
      call visit%leave()
!$omp end critical (finshell_models)
   end function mesh_arrays

   function set_members(handle, kind, name, number, members, status) result(code) bind(c, name='finshell_model_set_members')
      type(c_ptr), value :: handle, name
      integer(c_int32_t), value :: kind
      integer(c_int32_t), intent(out), optional :: number
      type(c_ptr), intent(out), optional :: members
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_set_members', model, code, status)
      if (code == 0) code = show_set(model, kind, name, number, members, status)
      call visit%leave()
!$omp end critical (finshell_models)
   end function set_members

   function count_all(model, numbers, status) result(code)
      type(model_t), intent(in) :: model
      type(c_size_t_of_model), intent(out), optional :: numbers
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      if (.not. present(numbers)) then
         code = refuse(status, 'finshell_model_sizes', 'sizes is NULL')
         return
      end if
      code = 0
      associate (s => model%session, structure => model%session%input%structure)
         numbers%nodes = size(structure%mesh%coordinates, 2, kind=c_int32_t)
         numbers%elements = size(structure%mesh%triangles, 2, kind=c_int32_t)
         numbers%unknowns = int(s%problem%n, c_int32_t)
         numbers%sections = size(structure%sections, kind=c_int32_t)
         numbers%steps = size(s%input%steps, kind=c_int32_t)
         numbers%columns = size(s%bell%rows, 1, kind=c_int32_t)
      end associate
   end function count_all

   function give_text(model, what, buffer, length_of_buffer, length, status) result(code)
      type(model_t), intent(in) :: model
      type(c_ptr), intent(in) :: what, buffer
      integer(c_int32_t), intent(in) :: length_of_buffer
      integer(c_int32_t), intent(out), optional :: length
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_model_text'
      character(len=:), allocatable :: answer
      character(kind=c_char), pointer :: characters(:)
      type(error_t), allocatable :: error
      if (.not. c_associated(what)) then
         code = refuse(status, place, 'what is NULL')
         return
      end if
      call text_about(model%session, text_from(what), answer, error)
      code = report(status, place, error)
      if (allocated(error)) return
      if (present(length)) length = len(answer, kind=c_int32_t)
      if (.not. c_associated(buffer) .or. length_of_buffer < 1) return
      call c_f_pointer(buffer, characters, [int(length_of_buffer)])
      call store_text(answer, size(characters), characters)
   end function give_text

   function show_mesh(model, coordinates, triangles) result(code)
      type(model_t), intent(inout), target :: model
      type(c_ptr), intent(out), optional :: coordinates, triangles
      integer(c_int32_t) :: code
      code = 0
      if (.not. allocated(model%triangles)) model%triangles = int(model%session%input%structure%mesh%triangles - 1, c_int32_t)
      if (present(coordinates)) coordinates = c_loc(model%session%input%structure%mesh%coordinates)
      if (present(triangles)) triangles = c_loc(model%triangles)
   end function show_mesh

   function show_set(model, kind, name, number, members, status) result(code)
      type(model_t), intent(inout), target :: model
      integer(c_int32_t), intent(in) :: kind
      type(c_ptr), intent(in) :: name
      integer(c_int32_t), intent(out), optional :: number
      type(c_ptr), intent(out), optional :: members
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_model_set_members'
      integer :: found
      if (.not. c_associated(name) .or. kind < 0 .or. kind > 1) then
         code = refuse(status, place, 'name is NULL, or kind neither nodes nor elements')
         return
      end if
      found = 0
      associate (mesh => model%session%input%structure%mesh)
         if (.not. allocated(model%node_sets)) allocate (model%node_sets(size(mesh%node_sets)))
         if (.not. allocated(model%element_sets)) allocate (model%element_sets(size(mesh%element_sets)))
         if (kind == 0) then
            found = find_node_set(mesh, text_from(name))
            if (found > 0) call show(mesh%node_sets(found)%members, model%node_sets(found)%members, number, members)
         else
            found = find_element_set(mesh, text_from(name))
            if (found > 0) call show(mesh%element_sets(found)%members, model%element_sets(found)%members, number, members)
         end if
      end associate
      code = done(status)
      if (found == 0) code = refuse(status, place, "the mesh has no such set: '"//text_from(name)//"'")
   end function show_set

   !> Numbers from 0, which stay where they are.
   subroutine show(list, kept, number, members)
      integer, intent(in) :: list(:)
      integer(c_int32_t), allocatable, target, intent(inout) :: kept(:)
      integer(c_int32_t), intent(out), optional :: number
      type(c_ptr), intent(out), optional :: members
      if (.not. allocated(kept)) kept = int(list - 1, c_int32_t)
      if (present(number)) number = size(kept, kind=c_int32_t)
      if (present(members)) members = c_loc(kept)
   end subroutine show
end module finshell_model_content
