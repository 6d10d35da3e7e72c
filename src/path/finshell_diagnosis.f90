!> Why a run stops: the sentence that names the cause and a cure, from the facts that the failed attempts left.
!>
!> Causes are tried in the order of how sure they are. All texts of this kind stand here; what an element or a factorisation said
!> itself comes in as the reason of the last attempt.
module finshell_diagnosis
   use finshell_error, only: text_of
   use finshell_kinds, only: wp, dp, i4
   use finshell_status, only: status_collapsed_element, status_material_limit, status_large_rotation, status_not_converged
   use finshell_problem, only: problem_t
   use finshell_step, only: step_t, control_load, control_name
   implicit none
   private
   public :: failure_t, failure_text, diagnosis, crawls_to_limit, where_text

   !> What is known of an increment that failed after all its attempts.
   type :: failure_t
      integer(i4) :: code = 0 !< of the last attempt (finshell_status)
      integer :: control = 0 !< of the step
      integer :: increment = 0 !< converged increments before
      integer :: pivots = -1 !< negative pivots of the last equilibrium state; -1: not known
      integer :: tried_pivots = -1 !< most of the first tangents of the attempts
      real(wp) :: factor = 0 !< at the last equilibrium state
      real(wp) :: way = huge(1.0_wp) !< change of the factor to a limit point that the path points to; huge: to none
      real(wp) :: size = 0 !< of the first attempt
      real(wp) :: slenderness = huge(1.0_wp) !< least thickness over the size of the structure
      logical :: soft = .false. !< a law, or a membrane, has no stiffness in its reference state
      logical :: crumples = .false. !< there are membranes that bear compression
      logical :: constant = .false. !< constant loads and supports come in
      real(wp) :: laboured = 0 !< increments that failed at first, the last ones counting most
      integer :: attempts = 0
      logical :: too_many = .false. !< attempts; else the next one would be too small
      integer :: last_control = 0 !< of the last attempt
      real(wp) :: last_size = 0
      character(len=:), allocatable :: reason !< why the last attempt failed
   contains
      procedure :: note
   end type failure_t

   !> A limit point is near when it is not farther than this many times the increment that failed.
   real(wp), parameter :: near = 2
   !> Increments smaller than this part of the largest that go on failing before a limit point, most of them for some time, are not
   !> worth their iterations.
   real(wp), parameter :: crawl = 1.0e-3_wp
   real(wp), parameter :: long_enough = 2
   !> Below this slenderness the stiffness in bending is lost in the rounding of that in the surface.
   real(wp), parameter :: lost_slenderness = 3.0e-6_wp

contains

   !> The last attempt, and why it has failed.
   pure subroutine note(self, code, control, size, reason)
      class(failure_t), intent(inout) :: self
      integer(i4), intent(in) :: code
      integer, intent(in) :: control
      real(wp), intent(in) :: size
      character(len=*), intent(in) :: reason
      self%code = code
      self%last_control = control
      self%last_size = size
      self%reason = reason
   end subroutine note

   !> Is the limit point so near that an increment of this size fails because of it?
   pure function nears_limit(way, size) result(yes)
      real(wp), intent(in) :: way, size
      logical :: yes
      yes = abs(way) < huge(way) .and. way*size > -abs(size)**2 .and. abs(way) <= near*abs(size)
   end function nears_limit

   !> Has load control come so near to a limit point that it only crawls?
   pure function crawls_to_limit(facts, size, largest) result(yes)
      type(failure_t), intent(in) :: facts
      real(wp), intent(in) :: size, largest !< magnitudes of the next increment and of the largest
      logical :: yes
      yes = facts%control == control_load .and. facts%laboured >= long_enough .and. size < crawl*largest
      if (yes) yes = nears_limit(facts%way, facts%size)
   end function crawls_to_limit

   !> The sentence: cause and cure where they are known, and what happened to the last attempt.
   pure function failure_text(facts) result(text)
      type(failure_t), intent(in) :: facts
      character(len=:), allocatable :: text
      text = diagnosis(facts)
      if (text /= '') text = text//'. In detail: '
      text = text//'the next increment failed '
      if (facts%too_many) then
         text = text//'too often'
      else
         text = text//'and would be too small'
      end if
      text = text//' ('//text_of(facts%attempts)//' attempts, the last of size '//text_of(real(facts%last_size, dp))//' in ' &
         //control_name(facts%last_control)//'): '//facts%reason
   end function failure_text

   !> Where a step has stopped.
   function where_text(step, problem) result(text)
      type(step_t), intent(in) :: step
      class(problem_t), intent(in) :: problem
      character(len=:), allocatable :: text
      text = 'step'
      if (allocated(step%name)) text = "step '"//step%name//"'"
      text = text//': stopped at load factor '//text_of(real(problem%state%load_factor, dp))//' (increment ' &
         //text_of(problem%state%increment)//')'
   end function where_text

   !> Cause and cure; empty where the facts name none.
   pure function diagnosis(facts) result(text)
      type(failure_t), intent(in) :: facts
      character(len=:), allocatable :: text

      text = ''
      if (facts%code == status_material_limit) then
         text = 'a material law has come to the end of its range'
      else if (facts%code == status_large_rotation) then
         text = 'an element is distorted beyond what it can describe: refine there; a thin sheet with a free rim folds in ' &
            //'many ways, and may take another with mixed = .true., a larger first_increment or more thickness'
      else if (facts%code == status_collapsed_element) then
         text = 'an element is distorted beyond what it can describe'
      else if (facts%control == control_load .and. nears_limit(facts%way, facts%size)) then
         text = 'the load nears a maximum, at about '//text_of(real(facts%factor + facts%way, dp))//', which load control cannot ' &
            //'pass: '
         if (facts%constant) then
            text = text//'constant loads and supports come in before the first step; let them follow the load factor ' &
               //"instead, under control = 'arc_length', 'displacement' or 'volume'"
         else
            text = text//"take control = 'arc_length', or prescribe a displacement or a volume"
         end if
         if (facts%pivots > 0) text = text//'; and '//buckling(facts)
      else if (facts%slenderness < lost_slenderness) then
         text = 'thickness over size is '//text_of(real(facts%slenderness, dp))//': the stiffness in bending is all but ' &
            //"lost in the rounding of that in the surface; take tolerance = 'tight' with mixed = .true., a thicker shell " &
            //'or a smaller part of it'
      else if (facts%crumples .and. (facts%code == status_not_converged .or. max(facts%pivots, facts%tried_pivots) > 0)) then
         text = 'membranes bear compression here, and under it they fold from element to element, with no end: let them wrinkle ' &
            //"(wrinkling = .true. in &section); if they are taut everywhere, take control = 'arc_length' or 'volume'"
      else if (max(facts%pivots, facts%tried_pivots) > 0) then
         text = buckling(facts)
      else if (facts%increment == 0 .and. facts%soft) then
         text = 'a law, or a membrane, has no stiffness before it is stretched: begin with a small load that stretches it ' &
            //'(constant = .true.), or a smaller first_increment'
      else if (facts%code == status_not_converged) then
         text = "nothing that is known here says why: try mixed = .true. (thin shells in bending), control = 'arc_length', " &
            //'or a smaller first_increment'
      end if
   end function diagnosis

   pure function buckling(facts) result(text)
      type(failure_t), intent(in) :: facts
      character(len=:), allocatable :: text
      integer :: n
      n = max(facts%pivots, facts%tried_pivots)
      text = 'the tangent has '//text_of(n)//trim(merge(' negative pivot ', ' negative pivots', n == 1)) &
         //': the structure buckles or, as a thin sheet under compression, wrinkles; take ' &
         //"cautious = .true., control = 'arc_length', a small disturbing load or more thickness"
   end function buckling
end module finshell_diagnosis
