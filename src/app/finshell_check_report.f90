!> What `check` says of a model beside its size: the mesh and its sets, what the loads come to, what is free to move.
module finshell_check_report
   use, intrinsic :: iso_fortran_env, only: output_unit
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, text_of
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_input, only: input_t
   use finshell_kinds, only: dp, wp
   use finshell_linked_parts, only: check_held
   use finshell_load_resultant, only: resultant_of
   use finshell_mesh_report, only: print_mesh
   use finshell_structure, only: structure_t
   use finshell_team, only: shared
   implicit none
   private
   public :: print_check

contains

   !> Print it. The loads of a team would be those of one member; they are left out.
   subroutine print_check(input, problem)
      type(input_t), intent(in) :: input
      type(equilibrium_t), intent(in) :: problem
      type(error_t), allocatable :: error
      real(wp) :: resultant(n_nodal)
      integer :: i

      call print_mesh(input%structure%mesh)
      call print_own(input%structure)
      do i = 1, merge(0, size(input%structure%loads), shared(problem%team))
         resultant = resultant_of(i, input%structure, problem%equations, problem%state, problem%assembly)
         associate (load => input%structure%loads(i))
            write (output_unit, '(a)') 'Load in line '//text_of(input%load_lines(i))//' ('//trim(load%kind)//', '//load%set &
               //') at a factor of 1: force '//triple(resultant(ux:uz))//', moment about the origin '//triple(resultant(rx:rz))
         end associate
      end do
      call check_held(input%structure, problem%equations, problem%external, error)
      if (allocated(error)) then
         write (output_unit, '(a)') 'Free: '//error%message(:index(error%message//';', ';') - 1)
      else
         write (output_unit, '(a)') 'Rigid-body motions: none is free'
      end if
   end subroutine print_check

   !> What elements have of their own: thickness, offset, growth.
   subroutine print_own(structure)
      type(structure_t), intent(in) :: structure
      integer :: i
      if (allocated(structure%thickness)) write (output_unit, '(a)') 'Thickness of elements '//span_of(structure%thickness)
      if (allocated(structure%offset)) write (output_unit, '(a)') 'Offset of elements '//span_of(structure%offset)
      if (.not. allocated(structure%growths)) return
      do i = 1, size(structure%growths%list)
         associate (growth => structure%growths%list(i))
            write (output_unit, '(a)') trim(merge('Prestretch', 'Growth    ', growth%inverse))//' of &growth number '//text_of(i) &
               //' ('//text_of(size(growth%elements))//' elements) at a factor of 1: along '//span_of(growth%stretch(1, :)) &
               //', across '//span_of(growth%stretch(2, :))
         end associate
      end do
   end subroutine print_own

   !> The least and the largest.
   function span_of(values) result(text)
      real(wp), intent(in) :: values(:)
      character(len=:), allocatable :: text
      text = short(minval(values))
      if (maxval(values) > minval(values)) text = 'from '//text//' to '//short(maxval(values))
   end function span_of

   !> Three components, what is rounding as 0.
   function triple(vector) result(text)
      real(wp), intent(in) :: vector(3)
      character(len=:), allocatable :: text
      real(wp) :: rounded(3)
      rounded = vector
      where (abs(vector) <= 1.0e-12_wp*maxval(abs(vector))) rounded = 0
      text = '('//short(rounded(1))//', '//short(rounded(2))//', '//short(rounded(3))//')'
   end function triple

   !> Six digits.
   function short(x) result(text)
      real(wp), intent(in) :: x
      character(len=:), allocatable :: text
      character(len=24) :: buffer
      write (buffer, '(g14.6)') real(x, dp)
      text = trim(adjustl(buffer))
      if (.not. abs(x) > 0) text = '0'
   end function short
end module finshell_check_report
