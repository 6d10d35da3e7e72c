!> Meshes as decks of CalculiX (and, but for the labels of edges, of Abaqus): nodes, elements S3, and all sets. An edge set is a
!> surface of element edges (S3 to S5 in CalculiX are the sides of a triangular shell) and a node set.
module finshell_inp_writer
   use finshell_edges, only: edges_t, find_edge, new_edges
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: dp
   use finshell_mesh, only: mesh_t
   use finshell_status, only: status_io_error
   use finshell_written_file, only: signature, written_file_t
   implicit none
   private
   public :: write_inp

   integer, parameter :: numbers_in_line = 10 !< at most 16 are allowed
   integer, parameter :: longest_name = 80

contains

   !> Errors: the file cannot be written, or a file of this name is there that finshell has not written; the name of a set cannot
   !> stand in a deck.
   subroutine write_inp(name, mesh, error)
      character(len=*), intent(in) :: name
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable, intent(out) :: error
      type(written_file_t) :: file
      integer :: i, s
      call check_names(name, mesh, error)
      if (.not. allocated(error)) call file%create(name, error)
      if (allocated(error)) return
      call file%put('** '//signature)
      call file%put('*NODE, NSET=all')
      do i = 1, size(mesh%coordinates, 2)
         call file%put(text_of(i)//', '//coordinate(1)//', '//coordinate(2)//', '//coordinate(3))
      end do
      call file%put('*ELEMENT, TYPE=S3, ELSET=all')
      do i = 1, size(mesh%triangles, 2)
         call file%put(text_of(i)//', '//text_of(mesh%triangles(1, i))//', '//text_of(mesh%triangles(2, i))//', ' &
                       //text_of(mesh%triangles(3, i)))
      end do
      do s = 1, size(mesh%node_sets)
         if (mesh%node_sets(s)%name /= 'all') call put_set('*NSET, NSET=', mesh%node_sets(s)%name, mesh%node_sets(s)%members)
      end do
      do s = 1, size(mesh%element_sets)
         if (mesh%element_sets(s)%name /= 'all') &
            call put_set('*ELSET, ELSET=', mesh%element_sets(s)%name, mesh%element_sets(s)%members)
      end do
      if (size(mesh%edge_sets) > 0) call put_surfaces()
      call file%finish(error)

   contains

      function coordinate(k) result(text)
         integer, intent(in) :: k
         character(len=:), allocatable :: text
         text = short(real(mesh%coordinates(k, i), dp))
      end function coordinate

      subroutine put_set(keyword, set, members)
         character(len=*), intent(in) :: keyword, set
         integer, intent(in) :: members(:)
         character(len=:), allocatable :: line
         integer :: k, m
         call file%put(keyword//set)
         do k = 1, size(members), numbers_in_line
            line = text_of(members(k))
            do m = k + 1, min(k + numbers_in_line - 1, size(members))
               line = line//', '//text_of(members(m))
            end do
            call file%put(line)
         end do
      end subroutine put_set

      subroutine put_surfaces()
         type(edges_t) :: edges
         integer :: edge, element, i, k, side
         call new_edges(edges, mesh%triangles)
         do k = 1, size(mesh%edge_sets)
            call file%put('*SURFACE, NAME='//mesh%edge_sets(k)%name//', TYPE=ELEMENT')
            do i = 1, size(mesh%edge_sets(k)%edges, 2)
               edge = find_edge(edges, mesh%edge_sets(k)%edges(1, i), mesh%edge_sets(k)%edges(2, i))
               element = edges%elements(1, edge)
               side = findloc(edges%of_side(:, element), edge, dim=1)
               call file%put(text_of(element)//', S'//text_of(side + 2))
            end do
         end do
      end subroutine put_surfaces
   end subroutine write_inp

   !> A number in at most 20 characters, which is what CalculiX reads: all digits from 0.01 on, 14 or 15 of smaller ones.
   pure function short(x) result(text)
      real(dp), intent(in) :: x
      character(len=:), allocatable :: text
      character(len=32) :: buffer, form
      integer :: decade
      if (abs(x) >= 0.01_dp .and. abs(x) < 1.0e15_dp) then
         decade = floor(log10(abs(x)))
         write (form, '(a,i0,a)') '(f0.', 16 - decade, ')'
         write (buffer, form) x
         text = buffer(:verify(trim(buffer), '0', back=.true.))
      else if (abs(x) < tiny(x)) then
         text = '0.'
      else if (abs(x) < 1.0e-99_dp .or. abs(x) > 1.0e99_dp) then
         write (buffer, '(es20.12e3)') x
         text = trim(adjustl(buffer))
      else
         if (x > 0) write (buffer, '(es20.14e2)') x
         if (x < 0) write (buffer, '(es20.13e2)') x
         text = trim(adjustl(buffer))
      end if
   end function short

   !> Names end at a comma or quote; CalculiX drops blanks and takes 80 characters.
   subroutine check_names(file_name, mesh, error)
      character(len=*), intent(in) :: file_name
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable, intent(out) :: error
      integer :: s
      do s = 1, size(mesh%node_sets)
         call check(mesh%node_sets(s)%name)
      end do
      do s = 1, size(mesh%element_sets)
         call check(mesh%element_sets(s)%name)
      end do
   contains
      subroutine check(name)
         character(len=*), intent(in) :: name
         if (allocated(error)) return
         if (name /= '' .and. len(name) <= longest_name .and. scan(name, ', ="*.') == 0) then
            if (verify(name(1:1), '0123456789+-') == 1) return
         end if
         call raise(error, status_io_error, file_name//": the set '"//name//"' cannot be written: names in a deck have 1 to " &
                    //text_of(longest_name)//' characters, begin with no digit, and have no blank, comma, point, quote, = or *; ' &
                    //'msh and vtu take all names')
      end subroutine check
   end subroutine check_names
end module finshell_inp_writer
