!> Meshes from files of any kind that is known, by the end of their names: .msh Gmsh, .stl, .inp Abaqus and CalculiX, .vtkhdf
!> results of finshell.
module finshell_mesh_file
   use finshell_error, only: error_t, raise
   use finshell_deck_mesh, only: read_deck_mesh
   use finshell_gmsh, only: read_gmsh
   use finshell_mesh, only: mesh_t
   use finshell_status, only: status_input_error
   use finshell_stl, only: read_stl
   use finshell_text, only: lower_case
   use finshell_vtkhdf_mesh, only: read_vtkhdf, shape_t
   implicit none
   private
   public :: read_mesh_file, file_ending, shape_t

contains

   !> Read a file. The mesh is not yet checked (check_mesh).
   subroutine read_mesh_file(file_name, mesh, error, shape)
      character(len=*), intent(in) :: file_name
      type(mesh_t), intent(out) :: mesh
      type(error_t), allocatable, intent(out) :: error
      type(shape_t), intent(in), optional :: shape !< of a result file; default: the reference
      type(shape_t) :: wanted
      if (present(shape)) wanted = shape
      select case (file_ending(file_name))
      case ('stl'); call read_stl(file_name, mesh, error)
      case ('inp'); call read_deck_mesh(file_name, mesh, error)
      case ('vtkhdf'); call read_vtkhdf(file_name, wanted, mesh, error)
      case ('vtu', 'vtp', 'vtk', 'obj', 'ply', 'off', 'bdf', 'nas', 'med', 'cdb', 'exo')
         call raise(error, status_input_error, file_name//': files of this kind are not read; make a Gmsh file of it: ' &
            //'finshell-mesh '//file_name//' '//file_name(:index(file_name, '.', back=.true.))//'msh ' &
            //'(make tools, or pip install meshio and the Python package finshell)')
      case default; call read_gmsh(file_name, mesh, error)
      end select
   end subroutine read_mesh_file

   !> What stands behind the last point of a name, in small letters.
   pure function file_ending(file_name) result(ending)
      character(len=*), intent(in) :: file_name
      character(len=:), allocatable :: ending
      ending = lower_case(file_name(index(file_name, '.', back=.true.) + 1:))
   end function file_ending
end module finshell_mesh_file
