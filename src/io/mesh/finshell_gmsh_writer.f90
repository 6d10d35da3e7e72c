!> Meshes as Gmsh files, MSH 4.1 in text: triangles, and all sets as physical groups.
!>
!> A group of Gmsh belongs to whole entities: triangles of the same sets make a surface, edges of the same sets a curve. Node sets
!> that are no edge sets become points.
module finshell_gmsh_writer
   use finshell_edges_of_sets, only: edges_of_sets, is_of_nodes
   use finshell_error, only: error_t, text_of
   use finshell_kinds, only: dp
   use finshell_mesh, only: mesh_t
   use finshell_written_file, only: exact, row, signature, written_file_t
   implicit none
   private
   public :: write_gmsh

   !> Things of one dimension, sorted by the sets that they are in.
   type :: classes_t
      integer, allocatable :: class(:) !< of each thing
      logical, allocatable :: member(:, :) !< (sets, classes)
   end type classes_t

contains

   !> Errors: the file cannot be written, or a file of this name is there that finshell has not written.
   subroutine write_gmsh(name, mesh, error)
      character(len=*), intent(in) :: name
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable, intent(out) :: error
      type(classes_t) :: class(0:2)
      integer, allocatable :: edges(:, :), points(:)
      type(written_file_t) :: file

      call file%create(name, error)
      if (allocated(error)) return
      call classify_surfaces(mesh, class(2))
      call classify_curves(mesh, edges, class(1))
      call classify_points(mesh, points, class(0))
      call file%put('$Comments')
      call file%put(signature)
      call file%put('$EndComments')
      call file%put('$MeshFormat')
      call file%put('4.1 0 8')
      call file%put('$EndMeshFormat')
      call write_names(file, mesh)
      call write_entities(file, mesh, class)
      call write_nodes(file, mesh)
      call write_elements(file, mesh, class, edges, points)
      call file%finish(error)
   end subroutine write_gmsh

   subroutine classify_surfaces(mesh, class)
      type(mesh_t), intent(in) :: mesh
      type(classes_t), intent(out) :: class
      logical, allocatable :: of(:, :)
      integer :: s
      allocate (of(size(mesh%element_sets), size(mesh%triangles, 2)), source=.false.)
      do s = 1, size(mesh%element_sets)
         of(s, mesh%element_sets(s)%members) = mesh%element_sets(s)%name /= 'all'
      end do
      call classify(of, class)
   end subroutine classify_surfaces

   subroutine classify_curves(mesh, edges, class)
      type(mesh_t), intent(in) :: mesh
      integer, allocatable, intent(out) :: edges(:, :)
      type(classes_t), intent(out) :: class
      logical, allocatable :: of(:, :)
      call edges_of_sets(mesh, edges, of)
      call classify(of, class)
   end subroutine classify_curves

   subroutine classify_points(mesh, points, class)
      type(mesh_t), intent(in) :: mesh
      integer, allocatable, intent(out) :: points(:)
      type(classes_t), intent(out) :: class
      logical, allocatable :: of(:, :)
      integer :: i, s
      allocate (of(size(mesh%node_sets), size(mesh%coordinates, 2)), source=.false.)
      do s = 1, size(mesh%node_sets)
         if (is_of_nodes(mesh, s)) of(s, mesh%node_sets(s)%members) = .true.
      end do
      points = pack([(i, i=1, size(of, 2))], any(of, dim=1))
      call classify(of(:, points), class)
   end subroutine classify_points

   !> Number the combinations of sets.
   subroutine classify(of, class)
      logical, intent(in) :: of(:, :) !< (sets, things)
      type(classes_t), intent(out) :: class
      integer :: c, i, n
      allocate (class%class(size(of, 2)), class%member(size(of, 1), 0))
      do i = 1, size(of, 2)
         n = size(class%member, 2)
         do c = n, 1, -1
            if (all(class%member(:, c) .eqv. of(:, i))) exit
         end do
         if (c == 0) then
            class%member = reshape([class%member, of(:, i)], [size(of, 1), n + 1])
            c = n + 1
         end if
         class%class(i) = c
      end do
   end subroutine classify

   subroutine write_names(file, mesh)
      type(written_file_t), intent(inout) :: file
      type(mesh_t), intent(in) :: mesh
      integer :: s
      call file%put('$PhysicalNames')
      call file%put(text_of(count([(is_of_nodes(mesh, s), s=1, size(mesh%node_sets))]) + size(mesh%edge_sets) &
                            + count([(mesh%element_sets(s)%name /= 'all', s=1, size(mesh%element_sets))])))
      do s = 1, size(mesh%node_sets)
         if (is_of_nodes(mesh, s)) call file%put('0 '//text_of(s)//' "'//mesh%node_sets(s)%name//'"')
      end do
      do s = 1, size(mesh%edge_sets)
         call file%put('1 '//text_of(s)//' "'//mesh%edge_sets(s)%name//'"')
      end do
      do s = 1, size(mesh%element_sets)
         if (mesh%element_sets(s)%name /= 'all') call file%put('2 '//text_of(s)//' "'//mesh%element_sets(s)%name//'"')
      end do
      call file%put('$EndPhysicalNames')
   end subroutine write_names

   subroutine write_entities(file, mesh, class)
      type(written_file_t), intent(inout) :: file
      type(mesh_t), intent(in) :: mesh
      type(classes_t), intent(in) :: class(0:2)
      character(len=:), allocatable :: box, line
      integer :: c, d, s
      box = ''
      do s = 1, 2
         do c = 1, 3
            if (s == 1) box = box//' '//exact(minval(real(mesh%coordinates(c, :), dp)))
            if (s == 2) box = box//' '//exact(maxval(real(mesh%coordinates(c, :), dp)))
         end do
      end do
      call file%put('$Entities')
      line = ''
      do d = 0, 2
         line = line//text_of(size(class(d)%member, 2))//' '
      end do
      call file%put(line//'0')
      do d = 0, 2
         do c = 1, size(class(d)%member, 2)
            line = text_of(c)
            if (d == 0) line = line//' 0 0 0'
            if (d > 0) line = line//box
            line = line//' '//text_of(count(class(d)%member(:, c)))
            do s = 1, size(class(d)%member, 1)
               if (class(d)%member(s, c)) line = line//' '//text_of(s)
            end do
            if (d > 0) line = line//' 0'
            call file%put(line)
         end do
      end do
      call file%put('$EndEntities')
   end subroutine write_entities

   subroutine write_nodes(file, mesh)
      type(written_file_t), intent(inout) :: file
      type(mesh_t), intent(in) :: mesh
      integer :: i
      associate (n => size(mesh%coordinates, 2))
         call file%put('$Nodes')
         call file%put('1 '//text_of(n)//' 1 '//text_of(n))
         call file%put('2 1 0 '//text_of(n))
         do i = 1, n
            call file%put(text_of(i))
         end do
         do i = 1, n
            call file%put(exact(real(mesh%coordinates(1, i), dp))//' '//exact(real(mesh%coordinates(2, i), dp))//' ' &
                          //exact(real(mesh%coordinates(3, i), dp)))
         end do
      end associate
      call file%put('$EndNodes')
   end subroutine write_nodes

   !> Block by block: those of one entity.
   subroutine write_elements(file, mesh, class, edges, points)
      type(written_file_t), intent(inout) :: file
      type(mesh_t), intent(in) :: mesh
      type(classes_t), intent(in) :: class(0:2)
      integer, intent(in) :: edges(:, :), points(:)
      integer, parameter :: kind(0:2) = [15, 1, 2]
      integer :: all_of_them, blocks, c, d, i, n
      all_of_them = sum([(size(class(d)%class), d=0, 2)])
      blocks = sum([(size(class(d)%member, 2), d=0, 2)])
      call file%put('$Elements')
      call file%put(text_of(blocks)//' '//text_of(all_of_them)//' 1 '//text_of(all_of_them))
      n = 0
      do d = 0, 2
         do c = 1, size(class(d)%member, 2)
            call file%put(text_of(d)//' '//text_of(c)//' '//text_of(kind(d))//' '//text_of(count(class(d)%class == c)))
            do i = 1, size(class(d)%class)
               if (class(d)%class(i) /= c) cycle
               n = n + 1
               select case (d)
               case (0); call file%put(row([n, points(i)]))
               case (1); call file%put(row([n, edges(:, i)]))
               case (2); call file%put(row([n, mesh%triangles(:, i)]))
               end select
            end do
         end do
      end do
      call file%put('$EndElements')
   end subroutine write_elements
end module finshell_gmsh_writer
