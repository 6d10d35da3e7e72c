!> Return codes shared by kernel, C interface and driver.
!>
!> 0: done. > 0: recoverable, cut the step and try again. < 0: the caller's mistake.
module finshell_status
   use finshell_kinds, only: i4
   implicit none
   private
   public :: status_text

   integer(i4), parameter, public :: status_ok = 0
   integer(i4), parameter, public :: status_collapsed_element = 1 !< current area (or J) is zero or not finite
   integer(i4), parameter, public :: status_material_limit = 2 !< a law cannot be evaluated at this strain
   integer(i4), parameter, public :: status_large_rotation = 3 !< a nodal rotation relative to its element nears pi
   integer(i4), parameter, public :: status_not_converged = 4 !< an iteration did not reach its tolerance
   integer(i4), parameter, public :: status_singular_matrix = 5 !< a factorisation met a zero pivot
   integer(i4), parameter, public :: status_no_value = 6 !< a field has no value there, as along the fibres of a layer without
   integer(i4), parameter, public :: status_invalid_argument = -1 !< wrong size, option or missing array
   integer(i4), parameter, public :: status_degenerate_reference = -2 !< reference triangle has no area, or is beyond 1e-60 to 1e60
   integer(i4), parameter, public :: status_not_a_number = -3 !< NaN or infinity in the input
   integer(i4), parameter, public :: status_input_error = -4 !< an input file is wrong
   integer(i4), parameter, public :: status_io_error = -5 !< a file cannot be read or written
   integer(i4), parameter, public :: status_out_of_memory = -6

contains

   !> One sentence for a return code.
   pure function status_text(code) result(text)
      integer(i4), intent(in) :: code
      character(len=:), allocatable :: text
      select case (code)
      case (status_ok); text = 'done'
      case (status_collapsed_element); text = 'an element has collapsed: its current area is zero or not finite; cut the step'
      case (status_material_limit); text = 'the material law cannot be evaluated at this strain; cut the step'
      case (status_large_rotation); text = 'a nodal rotation relative to its element nears pi; cut the step or refine'
      case (status_not_converged); text = 'an iteration did not converge; cut the step'
      case (status_singular_matrix); text = 'the tangent matrix is singular; check the supports'
      case (status_no_value); text = 'the field has no value there'
      case (status_invalid_argument); text = 'an argument has a wrong size or value, or a required array is missing'
      case (status_degenerate_reference)
         text = 'a reference triangle has no area (coincident or collinear nodes) or a size beyond 1e-60 to 1e60'
      case (status_not_a_number); text = 'the input contains NaN or infinity'
      case (status_input_error); text = 'the input file is wrong'
      case (status_io_error); text = 'a file cannot be read or written'
      case (status_out_of_memory); text = 'out of memory'
      case default; text = 'unknown status code'
      end select
   end function status_text
end module finshell_status
