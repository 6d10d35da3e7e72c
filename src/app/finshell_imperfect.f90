!> Brings imperfections into the reference shape before a run: files and waves at once, modes after the steps that find them.
module finshell_imperfect
   use, intrinsic :: iso_fortran_env, only: output_unit
   use finshell_equilibrium, only: equilibrium_t, new_equilibrium
   use finshell_error, only: error_t, raise, text_of
   use finshell_freedoms, only: ux, uz
   use finshell_hdf5, only: hdf5_file_t, hdf5_integer, hdf5_real, hdf5_table_t
   use finshell_imperfection, only: bend_reference, from_file, from_results, from_step, wave_field
   use finshell_input, only: input_t
   use finshell_input_imperfection, only: modes_end
   use finshell_job, only: follow_step, may_float
   use finshell_kinds, only: dp, i8, wp
   use finshell_observer, only: observer_t, record_t
   use finshell_path, only: path_t
   use finshell_state, only: linear_change_t, state_t
   use finshell_status, only: status_input_error
   use finshell_step, only: is_mode
   implicit none
   private
   public :: apply_given, apply_modes

   !> Keeps the modes of the last step.
   type, extends(observer_t) :: keeper_t
      real(wp), allocatable :: modes(:, :, :) !< (3, nodes, as many as were found)
      real(dp), allocatable :: factors(:) !< load factors or frequencies
   contains
      procedure :: increment
   end type keeper_t

contains

   !> Those that need no solution. Errors: a file that cannot be read, or is one of another mesh.
   subroutine apply_given(input, error)
      type(input_t), intent(inout) :: input
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: field(:, :), total(:, :)
      type(error_t), allocatable :: refusal
      integer :: i, k
      if (allocated(error)) return
      if (.not. any(input%imperfections%kind /= from_step)) return
      total = 0*input%structure%mesh%coordinates
      do i = 1, size(input%imperfections)
         associate (own => input%imperfections(i))
            if (own%kind == from_step) cycle
            do k = 1, size(own%modes)
               select case (own%kind)
               case (from_results); call read_results(own%file, own%modes(k), size(total, 2), field, refusal)
               case (from_file); field = own%field
               case default; call wave_field(input%structure, own%wave_length, own%seed, field, refusal)
               end select
               if (.not. allocated(refusal)) then
                  if (.not. any(abs(field) > 0)) call raise(refusal, status_input_error, 'the field moves nothing')
               end if
               if (allocated(refusal)) then
                  call raise(error, refusal%code, input%file//':'//text_of(own%line)//': &imperfection: '//refusal%message)
                  return
               end if
               if (size(own%amplitudes) > 0) field = own%amplitudes(k)/maxval(norm2(field, dim=1))*field
               total = total + field
            end do
         end associate
      end do
      call bend_reference(input%structure, total)
   end subroutine apply_given

   !> Solve the steps up to the one whose modes are imperfections, on the shape without them; bring them in; the problem is that of
   !> the steps behind, unloaded. Nobody sees those steps but for the line that is printed.
   subroutine apply_modes(input, problem, speaks, error)
      type(input_t), intent(inout), target :: input
      type(equilibrium_t), intent(inout) :: problem
      logical, intent(in) :: speaks
      type(error_t), allocatable, intent(out) :: error
      type(path_t) :: path
      type(keeper_t) :: keeper
      real(wp), allocatable :: total(:, :)
      character(len=:), allocatable :: text
      integer :: i, k, last
      last = modes_end(input%imperfections)
      do i = 1, last
         keeper = keeper_t()
         call follow_step(input%steps, i, problem, path, keeper, error)
         if (allocated(error)) return
      end do
      total = 0*input%structure%mesh%coordinates
      text = ''
      do i = 1, size(input%imperfections)
         associate (own => input%imperfections(i))
            if (own%kind /= from_step) cycle
            do k = 1, size(own%modes)
               if (own%modes(k) > size(keeper%factors)) then
                  call raise(error, status_input_error, input%file//':'//text_of(own%line)//': &imperfection: mode ' &
                     //text_of(own%modes(k))//' is wanted; step '//text_of(last)//' has found '//text_of(size(keeper%factors)))
                  return
               end if
               total = total + own%amplitudes(k)*keeper%modes(:, :, own%modes(k))
               text = text//', '//text_of(own%amplitudes(k))//' of mode '//text_of(own%modes(k))//' (' &
                      //text_of(keeper%factors(own%modes(k)))//')'
            end do
         end associate
      end do
      call bend_reference(input%structure, total)
      if (speaks) write (output_unit, '(a)') 'Imperfection: '//text(3:)//' of step '//text_of(last)
      problem%stage = last + 1
      if (allocated(problem%released)) deallocate (problem%released)
      problem%may_float = may_float(input%structure, input%steps, last + 1)
      call new_equilibrium(problem, input%structure, error)
   end subroutine apply_modes

   !> See finshell_observer.
   subroutine increment(self, state, record, error, change)
      class(keeper_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t), intent(in), optional, target :: change
      real(wp), allocatable :: grown(:, :, :)
      integer :: found
      if (size(state%displacement, 2) == 0) call raise(error, status_input_error, 'there are no nodes')
      if (.not. allocated(self%factors)) allocate (self%factors(0), self%modes(3, size(state%displacement, 2), 0))
      if (.not. present(change) .or. .not. is_mode(record%control)) return
      found = size(self%factors)
      allocate (grown(3, size(state%displacement, 2), found + 1))
      grown(:, :, :found) = self%modes
      grown(:, :, found + 1) = change%motion(ux:uz, :)
      call move_alloc(grown, self%modes)
      self%factors = [self%factors, real(record%load_factor, dp)]
   end subroutine increment

   !> Displacements of an increment in a results file.
   subroutine read_results(name, increment_number, nodes, field, error)
      character(len=*), intent(in) :: name
      integer, intent(in) :: increment_number, nodes
      real(wp), allocatable, intent(out) :: field(:, :) !< (3, nodes)
      type(error_t), allocatable, intent(out) :: error
      type(hdf5_file_t) :: file
      type(hdf5_table_t) :: displacements, increments
      integer(i8) :: rows, steps
      integer(i8), allocatable :: numbers(:)
      type(error_t), allocatable :: late
      integer :: at

      call file%open(name, error)
      if (allocated(error)) return
      at = 0
      call file%get_integer('/VTKHDF/Steps', 'NSteps', steps, error)
      if (.not. allocated(error)) call increments%open(file, '/finshell/history/increment', hdf5_integer, rows, error)
      if (.not. allocated(error)) then
         allocate (numbers(min(steps, rows)))
         call increments%get_integers(0_i8, numbers, error)
         at = findloc(numbers, int(increment_number, i8), dim=1)
         if (at == 0) call raise(error, status_input_error, name//' has no fields of increment '//text_of(increment_number))
      end if
      if (.not. allocated(error)) call displacements%open(file, '/VTKHDF/PointData/displacement', hdf5_real, rows, error, 3)
      if (.not. allocated(error)) then
         if (mod(rows, int(nodes, i8)) /= 0 .or. rows < at*int(nodes, i8)) call raise(error, status_input_error, name &
            //' is of another mesh: this one has '//text_of(nodes)//' nodes')
      end if
      if (.not. allocated(error)) then
         allocate (field(3, nodes))
         call displacements%get_reals((at - 1)*int(nodes, i8), field, error)
      end if
      call increments%close()
      call displacements%close()
      call file%close(late)
   end subroutine read_results
end module finshell_imperfect
