!> `finshell restart`: where a run left off, and with what input it goes on.
module finshell_resume
   use finshell_checkpoint, only: fingerprint
   use finshell_disk, only: full_name
   use finshell_error, only: error_t, raise, text_of
   use finshell_imperfect, only: apply_given
   use finshell_input, only: input_t, parse_input, read_input
   use finshell_input_difference, only: compare_inputs
   use finshell_kinds, only: wp
   use finshell_options, only: options_t
   use finshell_restart_file, only: read_restart, restart_head_t
   use finshell_status, only: status_input_error
   implicit none
   private
   public :: resume_t, base_of, find_record, resumed_input, new_head

   !> A run that goes on.
   type :: resume_t
      character(len=:), allocatable :: base !< of its files
      type(restart_head_t) :: head
      integer :: increment = 0 !< after which it goes on
      real(wp), allocatable :: numbers(:) !< the record
   end type resume_t

contains

   !> The files of the results that were named, by any of their names, and the record to go on from. Errors: there is none.
   subroutine find_record(options, resume, error)
      type(options_t), intent(in) :: options
      type(resume_t), intent(out) :: resume
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: increments(:)
      resume%base = base_of(options%results)
      call read_restart(resume%base//'.restart', resume%head, increments, error)
      if (allocated(error)) return
      resume%increment = increments(size(increments))
      if (options%from >= 0) resume%increment = options%from
      call read_restart(resume%base//'.restart', resume%head, increments, error, resume%increment, resume%numbers)
   end subroutine find_record

   !> The name of a run, by that of any of its files.
   pure function base_of(file) result(base)
      character(len=*), intent(in) :: file
      character(len=:), allocatable :: base
      character(len=12), parameter :: endings(4) = [character(len=12) :: '.restart', '.vtkhdf', '.xdmf', '.history.csv']
      integer :: i, n
      base = file
      do i = 1, size(endings)
         n = len(file) - len_trim(endings(i))
         if (n < 1) cycle
         if (file(n + 1:) /= trim(endings(i))) cycle
         base = file(:n)
         return
      end do
   end function base_of

   !> The input of the run or the one that was named, whose differences are checked. The options come to name the files to write:
   !> those of the run unless another folder or another input says otherwise.
   subroutine resumed_input(options, resume, input, error)
      type(options_t), intent(inout) :: options
      type(resume_t), intent(in) :: resume
      type(input_t), intent(out) :: input
      type(error_t), allocatable, intent(out) :: error
      integer :: begun, slash

      options%refine = resume%head%refine
      if (allocated(options%input)) then
         call read_input(options%input, input, error, resume%head%refine)
      else
         call parse_input(resume%head%input_text, resume%head%input_file, input, error, resume%head%refine)
      end if
      if (allocated(error)) return
      if (allocated(input%accuracy)) then
         call raise(error, status_input_error, input%file//':'//text_of(input%accuracy%line) &
                    //': &accuracy: a run that goes on keeps its mesh')
         return
      end if
      begun = nint(resume%numbers(1))
      if (allocated(options%input)) call compare_inputs(resume%head%input_text, input%text, input%file, begun, error)
      call apply_given(input, error)
      if (.not. allocated(error) .and. fingerprint(input%structure) /= resume%head%model) call raise(error, status_input_error, &
         input%file//': the mesh, or a file beside the input, is not that of the run of '//resume%base)
      if (allocated(error)) return
      slash = index(resume%base, '/', back=.true.)
      if (.not. allocated(options%input)) input%name = resume%base(slash + 1:)
      if (options%folder == '') options%folder = resume%base(:slash)
   end subroutine resumed_input

   !> What a restart needs to know of a run.
   function new_head(options, input) result(head)
      type(options_t), intent(in) :: options
      type(input_t), intent(in) :: input
      type(restart_head_t) :: head
      head%input_file = full_name(input%file)
      head%input_text = input%text
      head%refine = options%refine
      head%model = fingerprint(input%structure)
   end function new_head
end module finshell_resume
