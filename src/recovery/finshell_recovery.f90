!> Recovered results of elements: thickness stretch, resultants and stresses at a state, or of a linear change.
!>
!> What cannot be recovered is missing; it never ends a run. This happens to stresses, where the law ends before the surface of the
!> section but beyond the integration points, which are all that equilibrium asks for.
module finshell_recovery
   use finshell_kinds, only: wp, i4
   use finshell_discretisation, only: gather_elements, gathered_t, recover_gathered
   use finshell_equilibrium, only: equilibrium_t
   use finshell_state, only: state_t, moved_state
   use finshell_status, only: status_ok
   implicit none
   private
   public :: recovery_t, recover, small_part

   !> Results of a list of elements. What is missing is 0.
   type :: recovery_t
      integer, allocatable :: place(:) !< (elements of the mesh) where an element is in the list, 0: it is not
      real(wp), allocatable :: stretch(:), force(:, :), moment(:, :)
      real(wp), allocatable :: stress(:, :, :) !< (component; bottom, middle, top; element), if asked for
      logical, allocatable :: missing(:) !< stretch, force and moment of an element
      logical, allocatable :: missing_stress(:, :) !< (bottom, middle, top; element)
   end type recovery_t

contains

   !> Part of a motion over which differences give derivatives to six digits and more.
   pure real(wp) function small_part(motion, length)
      real(wp), intent(in) :: motion(:, :)
      real(wp), intent(in) :: length !< of an element
      real(wp), parameter :: small_rotation = 1.0e-5_wp
      real(wp) :: largest
      largest = max(maxval(abs(motion(4:6, :))), maxval(abs(motion(1:3, :)))/length)
      small_part = small_rotation
      if (largest > 0) small_part = small_rotation/largest
   end function small_part

   !> Recovered results of some elements at a state, or of the linear change of the problem.
   subroutine recover(problem, state, elements, with_stress, r)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: elements(:)
      logical, intent(in) :: with_stress
      type(recovery_t), intent(out) :: r
      real(wp), parameter :: fibre_part = 1.0e-3_wp !< of a mode: small beside the motion that decides which fibres act
      type(recovery_t) :: near, far
      type(state_t) :: base
      real(wp) :: part

      if (.not. allocated(problem%change)) then
         call recover_at(problem, state, elements, with_stress, r)
         return
      end if
      call recover_at(problem, problem%state, elements, with_stress, r)
      associate (change => problem%change)
         part = small_part(change%motion, problem%detail)
         if (change%alone) then
            ! A mode has no sign: from both sides, with the fibres that counted for it.
            base = problem%state
            if (allocated(change%toward)) then
               base = moved_state(base, change%toward, small_part(change%toward, problem%detail))
               part = fibre_part*part
            end if
            call recover_at(problem, moved_state(base, change%motion, part), elements, with_stress, near)
            call recover_at(problem, moved_state(base, change%motion, -part), elements, with_stress, far)
            call combine([0.0_wp, 0.5_wp/part, -0.5_wp/part])
         else
            ! From one side: where fibres begin to act the other one has another derivative.
            call recover_at(problem, moved_state(problem%state, change%motion, part), elements, with_stress, near)
            call recover_at(problem, moved_state(problem%state, change%motion, 2*part), elements, with_stress, far)
            call combine([1 - 1.5_wp/part, 2/part, -0.5_wp/part])
         end if
      end associate

   contains

      subroutine combine(w)
         real(wp), intent(in) :: w(3)
         r%stretch = w(1)*r%stretch + w(2)*near%stretch + w(3)*far%stretch
         r%force = w(1)*r%force + w(2)*near%force + w(3)*far%force
         r%moment = w(1)*r%moment + w(2)*near%moment + w(3)*far%moment
         r%missing = r%missing .or. near%missing .or. far%missing
         if (.not. with_stress) return
         r%stress = w(1)*r%stress + w(2)*near%stress + w(3)*far%stress
         r%missing_stress = r%missing_stress .or. near%missing_stress .or. far%missing_stress
      end subroutine combine
   end subroutine recover

   !> The same at one state, whatever the sections; in the order of `elements`.
   subroutine recover_at(problem, state, elements, with_stress, r)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: elements(:)
      logical, intent(in) :: with_stress
      type(recovery_t), intent(out) :: r
      type(gathered_t) :: g
      real(wp), allocatable :: l(:), n(:, :), m(:, :), sigma(:, :, :)
      integer, allocatable :: mine(:)
      integer(i4), allocatable :: status(:), stress_status(:, :)
      integer :: i, s

      allocate (r%stretch(size(elements)), r%force(3, size(elements)), r%moment(3, size(elements)), r%missing(size(elements)))
      if (with_stress) allocate (r%stress(3, 3, size(elements)), r%missing_stress(3, size(elements)))
      associate (structure => problem%structure)
         allocate (r%place(size(structure%element_section)), source=0)
         r%place(elements) = [(i, i=1, size(elements))]
         do s = 1, size(structure%sections)
            mine = pack([(i, i=1, size(elements))], structure%element_section(elements) == s)
            if (size(mine) == 0) cycle
            call gather_elements(structure, state, elements(mine), g, problem%equations%held)
            allocate (status(size(mine)), l(size(mine)), n(3, size(mine)), m(3, size(mine)))
            ! not asked for, they stay unallocated, and so count as absent in the call
            if (with_stress) allocate (sigma(3, 3, size(mine)), stress_status(3, size(mine)))
            call recover_gathered(structure%sections(s), g, status, l, n, m, sigma, stress_status)
            r%stretch(mine) = l
            r%force(:, mine) = n
            r%moment(:, mine) = m
            r%missing(mine) = status /= status_ok
            if (with_stress) then
               r%stress(:, :, mine) = sigma
               r%missing_stress(:, mine) = stress_status /= status_ok
               deallocate (sigma, stress_status)
            end if
            deallocate (status, l, n, m)
         end do
      end associate
   end subroutine recover_at
end module finshell_recovery
