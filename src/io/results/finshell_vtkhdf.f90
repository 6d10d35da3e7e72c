!> The parts of a VTKHDF file (UnstructuredGrid with Steps, version 2.0) that do not change: the mesh, and the lists that
!> say for every step that there is one part, which begins at zero.
module finshell_vtkhdf
   use finshell_error, only: error_t, raise
   use finshell_field, only: check_field, field_t
   use finshell_hdf5, only: hdf5_byte, hdf5_file_t, hdf5_integer, hdf5_real, hdf5_table_t
   use finshell_kinds, only: i8, wp
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: compare_mesh, write_mesh, index_splits

   integer(i8), parameter :: vtk_triangle = 5

   !> The lists of the group Steps that are the same for every step, because there is one mesh of one part.
   character(len=*), parameter, public :: same_lists(5) = [character(len=21) :: 'PartOffsets', 'PointOffsets', 'NumberOfParts', &
      & 'CellOffsets', 'ConnectivityIdOffsets']
   integer(i8), parameter, public :: same_values(5) = [0, 0, 1, 0, 0]
   integer, parameter, public :: same_ranks(5) = [1, 1, 1, 2, 2]
contains

   !> Write the mesh, and make the groups of all that follows.
   subroutine write_mesh(file, coordinates, triangles, error)
      type(hdf5_file_t), intent(inout) :: file
      real(wp), intent(in) :: coordinates(:, :)
      integer, intent(in) :: triangles(:, :)
      type(error_t), allocatable, intent(out) :: error
      type(field_t) :: points
      integer :: i, nodes, elements
      nodes = size(coordinates, 2)
      elements = size(triangles, 2)
      points = field_t('coordinates', 3, coordinates)
      call check_field(points, 3, nodes, 'node', 0, error)
      if (.not. allocated(error)) call file%make_room(65536 + 32_i8*nodes + 64_i8*elements, error)
      if (.not. allocated(error)) call file%make_group('/VTKHDF', error)
      if (.not. allocated(error)) call file%set_text('/VTKHDF', 'Type', 'UnstructuredGrid', error)
      if (.not. allocated(error)) call file%set_integers('/VTKHDF', 'Version', [2_i8, 0_i8], error)
      if (allocated(error)) return
      call put_once('NumberOfPoints', hdf5_integer, [int(nodes, i8)])
      call put_once('NumberOfCells', hdf5_integer, [int(elements, i8)])
      call put_once('NumberOfConnectivityIds', hdf5_integer, [3_i8*elements])
      call put_once('Connectivity', hdf5_integer, int(reshape(triangles, [3*elements]), i8) - 1)
      call put_once('Offsets', hdf5_integer, [(3_i8*i, i=0, elements)])
      call put_once('Types', hdf5_byte, [(vtk_triangle, i=1, elements)])
      if (.not. allocated(error)) call put_points(points%values)
      if (.not. allocated(error)) call file%make_group('/VTKHDF/PointData', error)
      if (.not. allocated(error)) call file%make_group('/VTKHDF/CellData', error)
      if (.not. allocated(error)) call file%make_group('/VTKHDF/FieldData', error)
      if (.not. allocated(error)) call file%make_group('/VTKHDF/Steps', error)
      if (.not. allocated(error)) call file%make_group('/VTKHDF/Steps/PointDataOffsets', error)
      if (.not. allocated(error)) call file%make_group('/VTKHDF/Steps/CellDataOffsets', error)
      if (.not. allocated(error)) call file%make_group('/VTKHDF/Steps/FieldDataOffsets', error)
      if (.not. allocated(error)) call file%set_integers('/VTKHDF/Steps', 'NSteps', [0_i8], error)
   contains
      subroutine put_once(name, kind, values)
         character(len=*), intent(in) :: name
         integer, intent(in) :: kind
         integer(i8), contiguous, intent(in) :: values(:)
         type(hdf5_table_t) :: table
         if (.not. allocated(error)) call table%create(file, '/VTKHDF/'//name, kind, error, rows=size(values))
         if (.not. allocated(error)) call table%put_integers(0_i8, values, error)
         call table%close()
      end subroutine put_once

      subroutine put_points(values)
         real(wp), contiguous, intent(in) :: values(:, :)
         type(hdf5_table_t) :: table
         call table%create(file, '/VTKHDF/Points', hdf5_real, error, components=3, rows=size(values, 2))
         if (.not. allocated(error)) call table%put_reals(0_i8, values, error)
         call table%close()
      end subroutine put_points
   end subroutine write_mesh

   !> Whether the index of a dataset splits at the step after `steps`, be its chunk a step or 128: a node of HDF5's index (a B-tree
   !> of version 1) holds 64 chunks, and a full last node keeps 57.
   pure logical function index_splits(steps)
      integer(i8), intent(in) :: steps
      index_splits = full(steps) .or. (mod(steps, 128_i8) == 0 .and. full(steps/128))
   contains
      pure logical function full(chunks)
         integer(i8), intent(in) :: chunks
         full = chunks >= 64 .and. mod(chunks - 64, 57_i8) == 0
      end function full
   end function index_splits

   !> A file can only be continued with the mesh it was written with.
   subroutine compare_mesh(file, name, coordinates, triangles, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name !< of the file, for messages
      real(wp), intent(in) :: coordinates(:, :)
      integer, intent(in) :: triangles(:, :)
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_table_t) :: points, connectivity
      real(wp), allocatable :: x(:, :)
      integer(i8), allocatable :: corners(:)
      integer(i8) :: nodes, rows
      logical :: same
      same = .false.
      allocate (x(3, size(coordinates, 2)), corners(size(triangles)))
      call points%open(file, '/VTKHDF/Points', hdf5_real, nodes, error, components=3)
      if (.not. allocated(error)) call connectivity%open(file, '/VTKHDF/Connectivity', hdf5_integer, rows, error)
      if (.not. allocated(error) .and. nodes == size(coordinates, 2) .and. rows == size(corners)) then
         call points%get_reals(0_i8, x, error)
         if (.not. allocated(error)) call connectivity%get_integers(0_i8, corners, error)
         if (.not. allocated(error)) same = all(abs(x - coordinates) <= epsilon(x)*abs(x)) &
            & .and. all(corners + 1 == reshape(triangles, [size(triangles)]))
      end if
      call points%close()
      call connectivity%close()
      if (.not. allocated(error) .and. .not. same) call raise(error, status_io_error, name &
         & //': cannot restart: the file holds another mesh')
   end subroutine compare_mesh
end module finshell_vtkhdf
