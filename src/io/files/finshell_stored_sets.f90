!> Sets of a mesh in a result file: the group /finshell/sets, which readers of VTKHDF pass over.
!>
!> Of each kind (nodes, elements, edges) a list of names, one of sizes, and the members of one set after the other, from 0 on as
!> everywhere in the file; of an edge its two nodes. The sets 'all' are not written.
module finshell_stored_sets
   use finshell_error, only: error_t, raise
   use finshell_hdf5, only: hdf5_file_t, hdf5_integer, hdf5_line, hdf5_table_t
   use finshell_kinds, only: i8
   use finshell_mesh, only: add_edge_set, add_element_set, add_node_set, find_edge_set, mesh_t, set_t
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: write_sets, read_sets

   character(len=*), parameter :: group = '/finshell/sets'

contains

   !> Write the sets of a mesh. The group /finshell must be there.
   subroutine write_sets(file, mesh, error)
      type(hdf5_file_t), intent(inout) :: file
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable, intent(out) :: error
      integer(i8) :: members
      integer :: s
      type(set_t), allocatable :: edges(:)
      allocate (edges(size(mesh%edge_sets)))
      do s = 1, size(edges)
         edges(s)%name = mesh%edge_sets(s)%name
         edges(s)%members = reshape(mesh%edge_sets(s)%edges, [size(mesh%edge_sets(s)%edges)])
      end do
      members = sum([(size(mesh%node_sets(s)%members, kind=i8), s=1, size(mesh%node_sets))]) &
         + sum([(size(mesh%element_sets(s)%members, kind=i8), s=1, size(mesh%element_sets))]) &
         + sum([(size(edges(s)%members, kind=i8), s=1, size(edges))])
      call file%make_room(65536 + 8*members + 512_i8*(size(mesh%node_sets) + size(mesh%element_sets) + size(edges)), error)
      if (.not. allocated(error)) call file%make_group(group, error)
      if (.not. allocated(error)) call put(file, 'edge', edges, error)
      if (.not. allocated(error)) call put(file, 'node', pack(mesh%node_sets, &
         [(find_edge_set(mesh, mesh%node_sets(s)%name) == 0, s=1, size(mesh%node_sets))]), error)
      if (.not. allocated(error)) call put(file, 'element', mesh%element_sets, error)
   end subroutine write_sets

   !> The sets of one kind.
   subroutine put(file, kind, sets, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: kind
      type(set_t), intent(in) :: sets(:)
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_table_t) :: names, sizes, members, grows
      integer(i8) :: n, total
      integer :: s
      total = sum([(size(sets(s)%members, kind=i8), s=1, size(sets))])
      call names%create(file, group//'/'//kind//'_names', hdf5_line, error)
      if (.not. allocated(error)) call sizes%create(file, group//'/'//kind//'_sizes', hdf5_integer, error)
      if (.not. allocated(error)) call grows%create(file, group//'/'//kind//'_grows', hdf5_integer, error)
      if (.not. allocated(error)) call members%create(file, group//'/'//kind//'_members', hdf5_integer, error, &
         rows=int(max(1_i8, min(total, 2_i8**20))))
      n = 0
      total = 0
      do s = 1, size(sets)
         if (sets(s)%name == 'all') cycle
         if (.not. allocated(error)) call names%put_line(n, sets(s)%name, error)
         if (.not. allocated(error)) call sizes%put_integers(n, [size(sets(s)%members, kind=i8)], error)
         if (.not. allocated(error)) call grows%put_integers(n, [merge(1_i8, 0_i8, sets(s)%grows)], error)
         if (.not. allocated(error)) call members%put_integers(total, int(sets(s)%members, i8) - 1, error)
         n = n + 1
         total = total + size(sets(s)%members)
      end do
      call names%close()
      call sizes%close()
      call grows%close()
      call members%close()
   end subroutine put

   !> Add the sets of a file to a mesh. Files of earlier versions have none. `number`: of each node of the file in the mesh, 0: it
   !> is not there. Error: a damaged file.
   subroutine read_sets(file, name, number, mesh, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name !< of the file, for messages
      integer, intent(in) :: number(:)
      type(mesh_t), intent(inout) :: mesh
      type(error_t), allocatable, intent(out) :: error
      type(set_t), allocatable :: sets(:)
      integer, allocatable :: members(:)
      integer :: s
      mesh%empty_sets = ''
      if (file%members(group) == '') return
      call take(file, name, 'node', size(number), sets, error)
      do s = 1, merge(0, size(sets), allocated(error))
         members = number(sets(s)%members)
         members = pack(members, members > 0)
         if (size(members) > 0) call add_node_set(mesh, sets(s)%name, members, sets(s)%grows)
         if (size(members) == 0) mesh%empty_sets = mesh%empty_sets//'"'//sets(s)%name//'"'
      end do
      if (.not. allocated(error)) call take(file, name, 'edge', size(number), sets, error)
      do s = 1, merge(0, size(sets), allocated(error))
         members = number(sets(s)%members)
         if (mod(size(members), 2) == 0 .and. all(members > 0)) then
            call add_edge_set(mesh, sets(s)%name, reshape(members, [2, size(members)/2]))
         else
            call damaged(name, 'edge', error)
            return
         end if
      end do
      if (.not. allocated(error)) call take(file, name, 'element', size(mesh%triangles, 2), sets, error)
      do s = 1, merge(0, size(sets), allocated(error))
         call add_element_set(mesh, sets(s)%name, sets(s)%members)
      end do
   end subroutine read_sets

   !> The sets of one kind, with members from 1 on.
   subroutine take(file, name, kind, most, sets, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name, kind
      integer, intent(in) :: most !< the largest number
      type(set_t), allocatable, intent(out) :: sets(:)
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_table_t) :: names, sizes, members, grows
      integer(i8), allocatable :: size_of(:), grow(:), all_members(:)
      integer(i8) :: n(4), first
      integer :: s
      n = 0
      allocate (sets(0))
      call names%open(file, group//'/'//kind//'_names', hdf5_line, n(1), error)
      if (.not. allocated(error)) call sizes%open(file, group//'/'//kind//'_sizes', hdf5_integer, n(2), error)
      if (.not. allocated(error)) call grows%open(file, group//'/'//kind//'_grows', hdf5_integer, n(3), error)
      if (.not. allocated(error)) call members%open(file, group//'/'//kind//'_members', hdf5_integer, n(4), error)
      if (.not. allocated(error)) then
         allocate (size_of(n(2)), grow(n(3)), all_members(n(4)))
         call sizes%get_integers(0_i8, size_of, error)
         if (.not. allocated(error)) call grows%get_integers(0_i8, grow, error)
         if (.not. allocated(error)) call members%get_integers(0_i8, all_members, error)
      end if
      if (.not. allocated(error)) then
         if (any(n(1:3) /= n(1)) .or. any(size_of < 0) .or. any(size_of > n(4)) .or. any(all_members < 0) &
             .or. any(all_members >= most)) then
            call damaged(name, kind, error)
         else if (sum(size_of) /= n(4)) then
            call damaged(name, kind, error)
         end if
      end if
      if (.not. allocated(error)) then
         deallocate (sets)
         allocate (sets(n(1)))
         first = 0
         do s = 1, size(sets)
            if (.not. allocated(error)) call names%get_line(int(s - 1, i8), sets(s)%name, error)
            sets(s)%members = int(all_members(first + 1:first + size_of(s))) + 1
            sets(s)%grows = grow(s) > 0
            first = first + size_of(s)
         end do
      end if
      call names%close()
      call sizes%close()
      call grows%close()
      call members%close()
   end subroutine take

   subroutine damaged(name, kind, error)
      character(len=*), intent(in) :: name, kind
      type(error_t), allocatable, intent(inout) :: error
      call raise(error, status_io_error, name//': the '//kind//' sets of the file are damaged')
   end subroutine damaged
end module finshell_stored_sets
