!> The command mesh: what the mesh of an input is like, and the mesh as files for others.
module finshell_mesh_report
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use finshell_error, only: error_t, text_of
   use finshell_gmsh_writer, only: write_gmsh
   use finshell_inp_writer, only: write_inp
   use finshell_input, only: input_t, read_input
   use finshell_kinds, only: dp
   use finshell_mesh, only: edge_set_names, element_text, find_edge_set, mesh_area, mesh_t
   use finshell_mesh_quality, only: mesh_quality, quality_t
   use finshell_options, only: exit_input, exit_ok, options_t
   use finshell_vtu_writer, only: write_vtu
   implicit none
   private
   public :: report_mesh, print_mesh

contains

   !> Print size, quality and sets; write NAME.msh or other files to the folder of results. Code 2: the input is wrong, or a file
   !> cannot be written.
   subroutine report_mesh(options, code)
      type(options_t), intent(in) :: options
      integer, intent(out) :: code
      type(input_t) :: input
      type(error_t), allocatable :: error
      character(len=:), allocatable :: ending, file, written
      integer :: i

      code = exit_input
      call read_input(options%input, input, error, options%refine, settings=options%settings)
      written = ''
      do i = 1, len(options%formats), 4 ! three letters and a comma
         if (allocated(error)) exit
         ending = options%formats(i:i + 2)
         file = options%folder//input%name//'.'//ending
         associate (mesh => input%structure%mesh)
            select case (ending)
            case ('msh'); call write_gmsh(file, mesh, error)
            case ('vtu'); call write_vtu(file, mesh, error)
            case ('inp'); call write_inp(file, mesh, error)
            end select
         end associate
         if (i > 1) written = written//', '
         written = written//file
      end do
      if (allocated(error)) then
         write (error_unit, '(a)') 'finshell: '//error%message
         return
      end if
      code = exit_ok
      if (options%quiet) return
      call print_mesh(input%structure%mesh)
      write (output_unit, '(a)') 'Written: '//written
   end subroutine report_mesh

   !> Size, quality and sets of a mesh.
   subroutine print_mesh(mesh)
      type(mesh_t), intent(in) :: mesh
      type(quality_t) :: q
      integer :: i
      q = mesh_quality(mesh)
      write (output_unit, '(a)') text_of(size(mesh%coordinates, 2))//' nodes, '//text_of(size(mesh%triangles, 2)) &
         //' triangles, '//text_of(q%parts)//' connected part'//trim(merge('s', ' ', q%parts > 1))//', area ' &
         //text_of(real(mesh_area(mesh), dp))
      if (allocated(mesh%notes)) then
         if (mesh%notes /= '') write (output_unit, '(a)') 'From the file: '//mesh%notes
      end if
      do i = 1, 3
         write (output_unit, '(a)') achar(iachar('x') + i - 1)//' from '//text_of(real(minval(mesh%coordinates(i, :)), dp)) &
            //' to '//text_of(real(maxval(mesh%coordinates(i, :)), dp))
      end do
      write (output_unit, '(a)') 'Sides from '//text_of(real(q%shortest, dp))//' to '//text_of(real(q%longest, dp)) &
         //'; smallest angle '//text_of(real(q%angle, dp))//' degrees; longest side over height at most ' &
         //text_of(real(q%aspect, dp))//' ('//element_text(mesh, q%worst)//')'
      write (output_unit, '(a)') 'Neighbours meet at up to '//text_of(real(q%kink, dp))//' degrees; '//text_of(q%free) &
         //' free edges; '//text_of(q%junctions)//' edges of more than two triangles'
      write (output_unit, '(a)') 'Node sets:'
      do i = 1, size(mesh%node_sets)
         if (find_edge_set(mesh, mesh%node_sets(i)%name) > 0) cycle
         write (output_unit, '(a)') '  '//mesh%node_sets(i)%name//': '//text_of(size(mesh%node_sets(i)%members))
      end do
      if (edge_set_names(mesh) /= '(none)') write (output_unit, '(a)') 'Edge sets, which are node sets too:'
      do i = 1, size(mesh%edge_sets)
         write (output_unit, '(a)') '  '//mesh%edge_sets(i)%name//': '//text_of(size(mesh%edge_sets(i)%edges, 2))//' edges'
      end do
      write (output_unit, '(a)') 'Element sets:'
      do i = 1, size(mesh%element_sets)
         write (output_unit, '(a)') '  '//mesh%element_sets(i)%name//': '//text_of(size(mesh%element_sets(i)%members))
      end do
   end subroutine print_mesh
end module finshell_mesh_report
