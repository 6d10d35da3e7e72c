!> What `accuracy` in the group &job sets together, where the keys themselves are not given.
module finshell_input_preset
   use finshell_error, only: error_t
   use finshell_kinds, only: wp
   use finshell_namelist, only: get, group_t, has
   use finshell_step, only: convergence_t
   implicit none
   private
   public :: preset_t, read_preset

   character(len=*), parameter :: preset_names = 'fast, balanced, reference'

   !> The defaults of `balanced`. Prices: doc/switches.md.
   type :: preset_t
      character(len=9) :: name = 'balanced'
      logical :: given = .false. !< by the key, and not as the default
      integer :: refine = 0 !< of the mesh; negative: where the mesh can be coarser
      integer :: more_points = 0 !< in layers of laws that are not linear, beyond what law and curvature need
      type(convergence_t) :: convergence !< its tolerances
      logical :: single = .false. !< fields of the result file in single precision
      character(len=:), allocatable, private :: what !< has been set, as keys
   contains
      procedure :: note
      procedure :: note_tolerance
      procedure :: summary
   end type preset_t

contains

   !> The key `accuracy`.
   subroutine read_preset(group, preset, error)
      type(group_t), intent(inout) :: group !< &job
      type(preset_t), intent(out) :: preset
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      call get(group, 'accuracy', name, error, default='balanced', choices=preset_names)
      if (allocated(error)) return
      preset%name = name
      preset%given = has(group, 'accuracy')
      select case (preset%name)
      case ('fast')
         preset%refine = -1
         preset%single = .true.
      case ('reference')
         preset%refine = 2
         preset%more_points = 2
         preset%convergence%residual = 1.0e-6_wp
         preset%convergence%correction = 1.0e-6_wp
      end select
   end subroutine read_preset

   !> Keep in mind that the preset has set a key; once for all groups where it has this value.
   subroutine note(self, key, value)
      class(preset_t), intent(inout) :: self
      character(len=*), intent(in) :: key, value
      character(len=:), allocatable :: text
      text = key//' = '//value
      if (.not. allocated(self%what)) self%what = ''
      if (index(self%what//',', ' '//text//',') > 0) return
      if (self%what /= '') self%what = self%what//','
      self%what = self%what//' '//text
   end subroutine note

   !> The same of a tolerance.
   subroutine note_tolerance(self, key, value)
      class(preset_t), intent(inout) :: self
      character(len=*), intent(in) :: key
      real(wp), intent(in) :: value
      character(len=8) :: text
      write (text, '(es8.1)') value
      call self%note(key, trim(adjustl(text)))
   end subroutine note_tolerance

   !> One line: which preset holds, and which keys it has set in this input.
   function summary(self) result(line)
      class(preset_t), intent(in) :: self
      character(len=:), allocatable :: line
      line = 'accuracy = '''//trim(self%name)//''' sets'
      if (allocated(self%what)) then
         line = line//self%what
      else
         line = line//' nothing here: all is given'
      end if
   end function summary
end module finshell_input_preset
