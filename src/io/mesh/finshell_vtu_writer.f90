!> Meshes as VTU files (VTK's XML, text), for ParaView, PyVista and meshio: triangles, and behind them the edges of all edge sets as
!> lines. A set is an array of 0 and 1: of nodes as point data, of elements (on triangles) or edges (on lines) as cell data.
module finshell_vtu_writer
   use finshell_edges_of_sets, only: edges_of_sets, is_of_nodes
   use finshell_error, only: error_t, text_of
   use finshell_kinds, only: dp
   use finshell_mesh, only: find_edge_set, mesh_t
   use finshell_written_file, only: exact, row, signature, written_file_t
   implicit none
   private
   public :: write_vtu

   integer, parameter :: line_cell = 3, triangle_cell = 5 !< of VTK
   integer, parameter :: numbers_in_line = 20

contains

   !> Errors: the file cannot be written, or a file of this name is there that finshell has not written.
   subroutine write_vtu(name, mesh, error)
      character(len=*), intent(in) :: name
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable, intent(out) :: error
      type(written_file_t) :: file
      integer, allocatable :: edges(:, :)
      logical, allocatable :: of(:, :)
      integer :: i, lines, triangles
      call file%create(name, error)
      if (allocated(error)) return
      call edges_of_sets(mesh, edges, of)
      lines = size(edges, 2)
      triangles = size(mesh%triangles, 2)
      call file%put('<?xml version="1.0"?>')
      call file%put('<!-- '//signature//' -->')
      call file%put('<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">')
      call file%put('<UnstructuredGrid>')
      call file%put('<Piece NumberOfPoints="'//text_of(size(mesh%coordinates, 2))//'" NumberOfCells="' &
                    //text_of(triangles + lines)//'">')
      call file%put('<Points>')
      call file%put('<DataArray type="Float64" Name="Points" NumberOfComponents="3" format="ascii">')
      do i = 1, size(mesh%coordinates, 2)
         call file%put(trim(exact(real(mesh%coordinates(1, i), dp)))//' '//trim(exact(real(mesh%coordinates(2, i), dp)))//' ' &
                       //trim(exact(real(mesh%coordinates(3, i), dp))))
      end do
      call file%put('</DataArray>')
      call file%put('</Points>')
      call file%put('<Cells>')
      call file%put('<DataArray type="Int64" Name="connectivity" format="ascii">')
      do i = 1, triangles
         call file%put(row(mesh%triangles(:, i) - 1))
      end do
      do i = 1, lines
         call file%put(row(edges(:, i) - 1))
      end do
      call file%put('</DataArray>')
      call put_integers('Int64', 'offsets', [(3*i, i=1, triangles), (3*triangles + 2*i, i=1, lines)])
      call put_integers('UInt8', 'types', [(triangle_cell, i=1, triangles), (line_cell, i=1, lines)])
      call file%put('</Cells>')
      call put_sets()
      call file%put('</Piece>')
      call file%put('</UnstructuredGrid>')
      call file%put('</VTKFile>')
      call file%finish(error)

   contains

      !> A set of elements and one of edges may have one name: one array says both.
      subroutine put_sets()
         integer, allocatable :: member(:)
         integer :: k, s
         call file%put('<PointData>')
         do s = 1, size(mesh%node_sets)
            if (.not. is_of_nodes(mesh, s)) cycle
            allocate (member(size(mesh%coordinates, 2)), source=0)
            member(mesh%node_sets(s)%members) = 1
            call put_integers('Int8', mesh%node_sets(s)%name, member)
            deallocate (member)
         end do
         call file%put('</PointData>')
         call file%put('<CellData>')
         do s = 1, size(mesh%element_sets)
            if (mesh%element_sets(s)%name == 'all') cycle
            allocate (member(triangles + lines), source=0)
            member(mesh%element_sets(s)%members) = 1
            k = find_edge_set(mesh, mesh%element_sets(s)%name)
            if (k > 0) member(triangles + 1:) = merge(1, 0, of(k, :))
            call put_integers('Int8', mesh%element_sets(s)%name, member)
            deallocate (member)
         end do
         do k = 1, size(mesh%edge_sets)
            if (any([(mesh%element_sets(s)%name == mesh%edge_sets(k)%name, s=1, size(mesh%element_sets))])) cycle
            call put_integers('Int8', mesh%edge_sets(k)%name, [spread(0, 1, triangles), merge(1, 0, of(k, :))])
         end do
         call file%put('</CellData>')
      end subroutine put_sets

      subroutine put_integers(type, array, numbers)
         character(len=*), intent(in) :: type, array
         integer, intent(in) :: numbers(:)
         integer :: k
         call file%put('<DataArray type="'//type//'" Name="'//escaped(array)//'" format="ascii">')
         do k = 1, size(numbers), numbers_in_line
            call file%put(row(numbers(k:min(k + numbers_in_line - 1, size(numbers)))))
         end do
         call file%put('</DataArray>')
      end subroutine put_integers
   end subroutine write_vtu

   !> A text as XML writes it.
   pure function escaped(text) result(xml)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: xml
      integer :: i
      xml = ''
      do i = 1, len(text)
         select case (text(i:i))
         case ('&'); xml = xml//'&amp;'
         case ('<'); xml = xml//'&lt;'
         case ('>'); xml = xml//'&gt;'
         case ('"'); xml = xml//'&quot;'
         case default; xml = xml//text(i:i)
         end select
      end do
   end function escaped
end module finshell_vtu_writer
