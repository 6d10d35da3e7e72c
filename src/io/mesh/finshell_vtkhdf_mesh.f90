!> The mesh of a result file of finshell (VTKHDF), as it was or as it was deformed in an increment, with the sets of the file.
module finshell_vtkhdf_mesh
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use finshell_error, only: error_t, raise, text_of
   use finshell_hdf5, only: hdf5_byte, hdf5_file_t, hdf5_integer, hdf5_real, hdf5_table_t
   use finshell_kinds, only: dp, i8, wp
   use finshell_mesh, only: mesh_t, new_mesh
   use finshell_status, only: status_input_error
   use finshell_stored_sets, only: read_sets
   implicit none
   private
   public :: read_cell_data, read_vtkhdf, shape_t

   !> Which shape of the mesh is wanted.
   type :: shape_t
      logical :: deformed = .false.
      integer :: increment = -1 !< with `deformed`; negative: the last one of the file
   end type shape_t

   integer(i8), parameter :: triangle = 5 !< of VTK
   integer(i8), parameter :: format_version = 2 !< of VTKHDF

contains

   !> Read a file. Nodes of no triangle are dropped. The mesh is not yet checked (check_mesh). Errors: no HDF5 file; none of
   !> finshell; another version of the format; no such increment; no displacements; numbers that are not finite; a damaged file.
   subroutine read_vtkhdf(name, wanted, mesh, error)
      character(len=*), intent(in) :: name
      type(shape_t), intent(in) :: wanted
      type(mesh_t), intent(out) :: mesh
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_file_t) :: file
      type(error_t), allocatable :: ignored
      call file%open(name, error)
      if (allocated(error)) then
         call raise(error, status_input_error, error%message//'; expected is a result file of finshell')
         return
      end if
      call check_kind(file, name, error)
      if (.not. allocated(error)) call read_content(file, name, wanted, mesh, error)
      if (allocated(error)) error%code = status_input_error
      call file%close(ignored)
   end subroutine read_vtkhdf

   !> Is it a file of ours?
   subroutine check_kind(file, name, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: by
      integer(i8) :: version(2)
      call file%get_text('/finshell', 'version', by, error)
      if (allocated(error)) then
         call raise(error, status_input_error, name//': finshell has not written this file; expected is NAME.vtkhdf of a run')
         return
      end if
      call file%get_integers('/VTKHDF', 'Version', version, error)
      if (allocated(error)) return
      if (version(1) /= format_version) call raise(error, status_input_error, name//': VTKHDF of version '//text_of(version(1)) &
         //'.'//text_of(version(2))//' (finshell '//by//'); expected is version '//text_of(format_version))
   end subroutine check_kind

   subroutine read_content(file, name, wanted, mesh, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(shape_t), intent(in) :: wanted
      type(mesh_t), intent(out) :: mesh
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_table_t) :: table
      real(dp), allocatable :: x(:, :), u(:, :)
      integer(i8), allocatable :: corners(:)
      integer(i8) :: nodes, rows, step
      integer :: i, k
      integer, allocatable :: number(:)
      logical, allocatable :: used(:)

      call table%open(file, '/VTKHDF/Points', hdf5_real, nodes, error, components=3)
      if (.not. allocated(error)) then
         allocate (x(3, nodes))
         call table%get_reals(0_i8, x, error)
      end if
      call table%close()
      if (.not. allocated(error)) call table%open(file, '/VTKHDF/Connectivity', hdf5_integer, rows, error)
      if (.not. allocated(error)) then
         allocate (corners(rows))
         call table%get_integers(0_i8, corners, error)
      end if
      call table%close()
      if (.not. allocated(error)) call check_triangles(file, name, corners, nodes, error)
      if (.not. allocated(error) .and. wanted%deformed) then
         call find_step(file, name, wanted%increment, step, error)
         if (.not. allocated(error)) call table%open(file, '/VTKHDF/PointData/displacement', hdf5_real, rows, error, components=3)
         if (.not. allocated(error)) then
            allocate (u(3, nodes))
            if (rows >= (step + 1)*nodes) then
               call table%get_reals(step*nodes, u, error)
            else
               call raise(error, status_input_error, name//': the displacements of the file are damaged')
            end if
         end if
         call table%close()
         if (.not. allocated(error)) x = x + u
      end if
      if (allocated(error)) return
      do i = 1, size(x, 2)
         if (all(ieee_is_finite(x(:, i)))) cycle
         call raise(error, status_input_error, name//': node '//text_of(i)//' is at a place that is no number; expected are ' &
            //'finite coordinates'//trim(merge(' and displacements', '                  ', wanted%deformed)))
         return
      end do
      allocate (used(nodes), source=.false.)
      used(corners + 1) = .true.
      allocate (number(nodes), source=0)
      k = 0
      do i = 1, size(number)
         if (.not. used(i)) cycle
         k = k + 1
         number(i) = k
      end do
      call new_mesh(mesh, real(x(:, pack([(i, i=1, size(used))], used)), wp), reshape(number(corners + 1), [3, size(corners)/3]))
      call read_sets(file, name, number, mesh, error)
      mesh%results = name
   end subroutine read_content

   !> Cell data of a file at one of its increments. Errors: those of a file that is none of ours; no such data or increment; too
   !> many components; numbers that are not finite.
   subroutine read_cell_data(name, array, increment, most, values, error)
      character(len=*), intent(in) :: name, array
      integer, intent(in) :: increment !< negative: the last
      integer, intent(in) :: most !< components
      real(wp), allocatable, intent(out) :: values(:, :) !< (components, elements)
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_file_t) :: file
      type(hdf5_table_t) :: table
      type(error_t), allocatable :: ignored
      real(dp), allocatable :: read(:, :)
      integer(i8) :: elements, rows, step
      integer :: n
      call file%open(name, error)
      if (.not. allocated(error)) call check_kind(file, name, error)
      if (.not. allocated(error)) call find_step(file, name, increment, step, error)
      if (.not. allocated(error)) call table%open(file, '/VTKHDF/Types', hdf5_byte, elements, error)
      call table%close()
      if (.not. allocated(error)) then
         do n = 1, most
            if (allocated(error)) deallocate (error)
            call table%open(file, '/VTKHDF/CellData/'//array, hdf5_real, rows, error, components=n)
            if (.not. allocated(error)) exit
            call table%close()
         end do
         if (allocated(error)) then
            call raise(error, status_input_error, name//": there is no cell data '"//array//"' of one to "//text_of(most) &
                       //' numbers in the file')
         else if (rows < (step + 1)*elements) then
            call raise(error, status_input_error, name//": the cell data '"//array//"' of the file is damaged")
         else
            allocate (read(n, elements))
            call table%get_reals(step*elements, read, error)
         end if
         call table%close()
      end if
      call file%close(ignored)
      if (allocated(error)) return
      values = read
      if (.not. all(ieee_is_finite(values))) call raise(error, status_input_error, name//": the cell data '"//array &
         //"' has numbers that are not finite")
   end subroutine read_cell_data

   !> Are there triangles, and all their nodes?
   subroutine check_triangles(file, name, corners, nodes, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name
      integer(i8), intent(in) :: corners(:), nodes
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_table_t) :: table
      integer(i8), allocatable :: types(:)
      integer(i8) :: rows
      call table%open(file, '/VTKHDF/Types', hdf5_byte, rows, error)
      if (.not. allocated(error)) then
         allocate (types(rows))
         call table%get_integers(0_i8, types, error)
      end if
      call table%close()
      if (allocated(error)) return
      if (any(types /= triangle) .or. size(corners) /= 3*rows .or. rows == 0) then
         call raise(error, status_input_error, name//': expected are triangles (cells of type 5) and no others')
      else if (any(corners < 0) .or. any(corners >= nodes)) then
         call raise(error, status_input_error, name//': a triangle has a node that the file does not have; it has ' &
            //text_of(nodes)//' nodes')
      end if
   end subroutine check_triangles

   !> The step of the file that is an increment.
   subroutine find_step(file, name, increment, step, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name
      integer, intent(in) :: increment !< negative: the last
      integer(i8), intent(out) :: step !< from 0 on
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_table_t) :: table
      integer(i8), allocatable :: increments(:)
      integer(i8) :: rows, steps
      step = -1
      call file%get_integer('/VTKHDF/Steps', 'NSteps', steps, error)
      if (.not. allocated(error)) call table%open(file, '/finshell/history/increment', hdf5_integer, rows, error)
      if (.not. allocated(error)) then
         allocate (increments(max(0_i8, min(steps, rows))))
         call table%get_integers(0_i8, increments, error)
      end if
      call table%close()
      if (allocated(error)) return
      step = size(increments) - 1
      if (increment >= 0) step = findloc(increments, int(increment, i8), dim=1, back=.true.) - 1
      if (step >= 0) return
      if (size(increments) == 0) then
         call raise(error, status_input_error, name//': there is no increment in the file')
      else
         call raise(error, status_input_error, name//': increment '//text_of(increment)//' is not in the file; expected is one &
            &of '//list_of(increments))
      end if
   end subroutine find_step

   function list_of(increments) result(text)
      integer(i8), intent(in) :: increments(:)
      character(len=:), allocatable :: text
      integer, parameter :: most = 20
      integer :: i
      text = text_of(increments(1))
      do i = 2, min(size(increments), most)
         text = text//', '//text_of(increments(i))
      end do
      if (size(increments) > most) text = text//', ... '//text_of(increments(size(increments)))
   end function list_of
end module finshell_vtkhdf_mesh
