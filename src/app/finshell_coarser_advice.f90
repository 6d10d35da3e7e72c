!> What to say after a run whose end would have been found for less from a coarser mesh (&accuracy coarser).
module finshell_coarser_advice
   use finshell_bisection, only: bisection_t
   use finshell_error, only: error_t, text_of
   use finshell_input, only: input_t, read_input
   use finshell_options, only: options_t
   use finshell_setting, only: new_setting, setting_t
   use finshell_step, only: is_in_time, leaves_state
   implicit none
   private
   public :: coarser_advice

   integer, parameter :: levels = 2 !< what the advice is to take
   integer, parameter :: least_unknowns = 20000 !< below, nobody waits
   integer, parameter :: least_iterations = 15 !< of which two or three are left, and those of the coarse mesh

contains

   !> '' where it would not pay, or the input does not allow it.
   function coarser_advice(options, input, unknowns, iterations) result(text)
      type(options_t), intent(in) :: options
      type(input_t), intent(in) :: input !< that has been run
      integer, intent(in) :: unknowns, iterations
      character(len=:), allocatable :: text
      character(len=:), allocatable :: complaint
      type(input_t) :: coarse
      type(bisection_t) :: bisection
      type(setting_t) :: setting
      type(error_t), allocatable :: error
      text = ''
      if (allocated(input%accuracy) .or. allocated(options%rung) .or. .not. allocated(options%input)) return
      if (associated(options%team) .or. options%command /= 'run') return
      if (unknowns < least_unknowns .or. iterations < least_iterations) return
      if (any(is_in_time(input%steps%control) .or. leaves_state(input%steps%control))) return
      call new_setting(setting, 'accuracy.coarser='//text_of(levels), complaint)
      call read_input(options%input, coarse, error, options%refine, bisection, [options%settings, setting])
      if (allocated(error)) return
      text = 'The way was long: --set '//setting%text//' finds it on a coarser mesh, its end and what is asked for on it on one ' &
             //'as fine as this, mostly for a quarter of the time or less (doc/adaptive.md).'
   end function coarser_advice
end module finshell_coarser_advice
