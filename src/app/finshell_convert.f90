!> The command convert: a deck of Abaqus or CalculiX becomes a namelist beside it.
module finshell_convert
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use finshell_deck_conversion, only: convert_deck
   use finshell_error, only: error_t
   use finshell_options, only: exit_input, exit_ok, options_t
   implicit none
   private
   public :: convert

contains

   !> Write NAME.nml beside NAME.inp, which it refers to; it must not be there yet. What was not taken is printed.
   subroutine convert(options, code)
      type(options_t), intent(in) :: options
      integer, intent(out) :: code
      type(error_t), allocatable :: error
      character(len=:), allocatable :: name, namelist, not_taken
      integer :: status, unit
      character(len=256) :: reason

      code = exit_input
      call convert_deck(options%input, namelist, not_taken, error)
      if (allocated(error)) then
         write (error_unit, '(a)') 'finshell: '//error%message
         return
      end if
      name = options%input(:index(options%input, '.', back=.true.) - 1)//'.nml'
      open (newunit=unit, file=name, status='new', action='write', access='stream', form='formatted', iostat=status, iomsg=reason)
      if (status /= 0) then
         write (error_unit, '(a)') 'finshell: '//name//': it is not written: '//trim(reason)
         return
      end if
      write (unit, '(a)', advance='no', iostat=status, iomsg=reason) namelist
      close (unit)
      if (status /= 0) then
         write (error_unit, '(a)') 'finshell: '//name//': '//trim(reason)
         return
      end if
      if (not_taken /= '') write (output_unit, '(a)') 'NOT TAKEN:', not_taken(:len(not_taken) - 1)
      write (output_unit, '(a)') 'Written: '//name
      code = exit_ok
   end subroutine convert
end module finshell_convert
