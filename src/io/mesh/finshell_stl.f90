!> Meshes from STL files, text or binary: triangles without common nodes, which are welded where their corners meet.
!>
!> Each solid of a text file that has a name becomes an element set.
module finshell_stl
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: i8, wp
   use finshell_mesh, only: add_element_set, mesh_t, new_mesh
   use finshell_status, only: status_input_error
   use finshell_text, only: read_whole_file
   use finshell_weld, only: weld
   use finshell_word_scanner, only: word_scanner_t
   use, intrinsic :: iso_fortran_env, only: int32, real32
   implicit none
   private
   public :: read_stl, parse_stl

   integer, parameter :: header = 84, record = 50 !< bytes of a binary file

   !> Triangles first..last are a solid.
   type :: solid_t
      character(len=:), allocatable :: name
      integer :: first = 1, last = 0
   end type solid_t

contains

   !> Read a file. The mesh is not yet checked (check_mesh).
   subroutine read_stl(file_name, mesh, error)
      character(len=*), intent(in) :: file_name
      type(mesh_t), intent(out) :: mesh
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: bytes
      call read_whole_file(file_name, bytes, error)
      if (.not. allocated(error)) call parse_stl(bytes, file_name, mesh, error)
   end subroutine read_stl

   !> Turn the bytes of a file into a mesh; file is the name used in messages.
   subroutine parse_stl(bytes, file, mesh, error)
      character(len=*), intent(in) :: bytes, file
      type(mesh_t), intent(out) :: mesh
      type(error_t), allocatable, intent(out) :: error
      type(solid_t), allocatable :: solids(:)
      real(wp), allocatable :: corners(:, :)
      integer, allocatable :: number(:), triangles(:, :), kept(:)
      integer :: i, nodes
      logical, allocatable :: flat(:)

      allocate (solids(0))
      if (is_binary(bytes)) then
         call read_binary(bytes, corners)
      else
         call read_text(bytes, file, corners, solids, error)
      end if
      if (allocated(error)) return
      if (size(corners) == 0) then
         call raise(error, status_input_error, file//': the file has no triangles')
         return
      end if
      if (.not. all(ieee_is_finite(corners))) then
         i = findloc(all(ieee_is_finite(corners), dim=1), .false., dim=1)
         call raise(error, status_input_error, file//': triangle '//text_of((i + 2)/3)//': a coordinate is not finite')
         return
      end if
      call weld(corners, number, nodes)
      triangles = reshape(number, [3, size(number)/3])
      ! Slivers whose corners meet vanish.
      flat = triangles(1, :) == triangles(2, :) .or. triangles(2, :) == triangles(3, :) .or. triangles(3, :) == triangles(1, :)
      kept = pack([(i, i=1, size(flat))],.not. flat)
      if (size(kept) == 0) then
         call raise(error, status_input_error, file//': all triangles have two corners at one place')
         return
      end if
      call build(mesh, corners, number, triangles(:, kept))
      mesh%notes = text_of(size(number))//' corners were welded to '//text_of(nodes)//' nodes'
      if (any(flat)) mesh%notes = mesh%notes//'; '//text_of(count(flat))//' triangles without area were left out'
      number = 0*number
      number(kept) = [(i, i=1, size(kept))]
      do i = 1, size(solids)
         if (solids(i)%name == '' .or. solids(i)%name == 'all') cycle
         kept = pack(number(solids(i)%first:solids(i)%last), number(solids(i)%first:solids(i)%last) > 0)
         if (size(kept) > 0) call add_element_set(mesh, solids(i)%name, kept)
      end do
   end subroutine parse_stl

   !> Nodes that are used, in the order of their first corner.
   subroutine build(mesh, corners, number, triangles)
      type(mesh_t), intent(out) :: mesh
      real(wp), intent(in) :: corners(:, :)
      integer, intent(in) :: number(:)
      integer, intent(in) :: triangles(:, :)
      real(wp), allocatable :: coordinates(:, :)
      integer, allocatable :: at(:), renumbered(:, :)
      integer :: e, i, k, n
      allocate (at(maxval(number)), source=0)
      allocate (coordinates(3, size(at)), renumbered(3, size(triangles, 2)))
      do i = size(number), 1, -1
         coordinates(:, number(i)) = corners(:, i)
      end do
      n = 0
      do e = 1, size(triangles, 2)
         do k = 1, 3
            if (at(triangles(k, e)) == 0) then
               n = n + 1
               at(triangles(k, e)) = n
            end if
            renumbered(k, e) = at(triangles(k, e))
         end do
      end do
      coordinates(:, pack(at, at > 0)) = coordinates(:, pack([(i, i=1, size(at))], at > 0))
      call new_mesh(mesh, coordinates(:, :n), renumbered)
   end subroutine build

   !> A binary file is as long as its number of triangles says; some begin with `solid` all the same.
   pure logical function is_binary(bytes)
      character(len=*), intent(in) :: bytes
      is_binary = .false.
      if (len(bytes) >= header) is_binary = header + record*int(transfer(bytes(header - 3:header), 1_int32), i8) == len(bytes, i8)
   end function is_binary

   subroutine read_binary(bytes, corners)
      character(len=*), intent(in) :: bytes
      real(wp), allocatable, intent(out) :: corners(:, :)
      real(real32) :: numbers(12)
      integer :: at, e, n
      n = (len(bytes) - header)/record
      allocate (corners(3, 3*n))
      do e = 1, n
         at = header + record*(e - 1)
         numbers = transfer(bytes(at + 1:at + 48), numbers)
         corners(:, 3*e - 2:3*e) = reshape(real(numbers(4:), wp), [3, 3])
      end do
   end subroutine read_binary

   subroutine read_text(bytes, file, corners, solids, error)
      character(len=*), intent(in) :: bytes, file
      real(wp), allocatable, intent(out) :: corners(:, :)
      type(solid_t), allocatable, intent(inout) :: solids(:)
      type(error_t), allocatable, intent(inout) :: error
      type(word_scanner_t) :: scanner
      real(wp), allocatable :: grown(:, :)
      character(len=:), allocatable :: word, rest
      integer :: k, n

      scanner%file = file
      scanner%text = bytes
      n = 0
      allocate (corners(3, 3072))
      if (scanner%at_end()) then
         call scanner%complain('the file is empty', error)
         return
      end if
      do while (.not. scanner%at_end())
         call scanner%expect('solid', error)
         call scanner%take_line(rest)
         if (allocated(error)) return
         solids = [solids, solid_t(trim(adjustl(rest)), n/3 + 1, 0)]
         do
            call scanner%take(word, error)
            if (allocated(error)) return
            if (word == 'endsolid') exit
            if (word /= 'facet') then
               call scanner%complain("found '"//word(:min(len(word), 30))//"' where facet or endsolid is expected", error)
               return
            end if
            call scanner%take_line(rest) ! the normal, which the corners give too
            call scanner%expect('outer', error)
            call scanner%expect('loop', error)
            if (n + 3 > size(corners, 2)) then
               allocate (grown(3, 2*size(corners, 2)))
               grown(:, :n) = corners(:, :n)
               call move_alloc(grown, corners)
            end if
            do k = 1, 3
               call scanner%expect('vertex', error)
               n = n + 1
               call scanner%take_reals(corners(:, n), error)
            end do
            call scanner%expect('endloop', error)
            call scanner%expect('endfacet', error)
            if (allocated(error)) return
         end do
         call scanner%take_line(rest)
         solids(size(solids))%last = n/3
      end do
      corners = corners(:, :n)
   end subroutine read_text
end module finshell_stl
