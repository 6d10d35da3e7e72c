!> A block of shell elements out of a batch: gathered, evaluated, written to the caller's arrays.
!>
!> Compiled twice where CMake does it (cmake/narrow): for blocks of `lanes` elements, and for single ones.
module finshell_chunk
   use finshell_block, only: check_input, gather, gather_own, separate
   use finshell_element, only: block_t, evaluate_block, stress_t
   use finshell_evaluation, only: level_tangent
   use finshell_freedoms, only: n_shell
   use finshell_kinds, only: wp, i4, lanes
   use finshell_law_states, only: law_states_t
   use finshell_point_states, only: judge_states, new_point_states, point_states_t
   use finshell_own, only: n_growth
   use finshell_section, only: section_t
   use finshell_status, only: status_ok
   implicit none
   private
   public :: evaluate_chunk, n_resultants

   !> Resultants of an element at its three in-plane points: N11, N22, N12, M11, M22, M12 of each point in turn.
   integer, parameter :: n_resultants = 18

contains

   !> Elements first + 1 ... of the batch.
   subroutine evaluate_chunk(section, level, first, n, x, u, rotation, convention, status, energy, force, tangent, direction, &
                             state, resultants, toward, held, normal, thickness, offset, growth, states)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level, first, n, convention
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), rotation(:, :, :)
      integer(i4), intent(inout) :: status(n)
      real(wp), intent(inout), optional :: energy(n), force(n_shell, n), tangent(n_shell, n_shell, n)
      real(wp), intent(in), optional :: direction(3, n), state(4, 3, n), resultants(n_resultants, n), toward(n_shell, n)
      integer, intent(in), optional :: held(3, n)
      real(wp), intent(in), optional :: normal(3, 3, n)
      type(law_states_t), intent(in), optional :: states
      real(wp), intent(in), optional :: thickness(n), offset(n), growth(n_growth, size(section%layers), n)
      type(block_t) :: block
      type(point_states_t) :: remembered
      type(stress_t) :: stress
      real(wp) :: eb(lanes), fb(lanes, n_shell), kb(lanes, n_shell, n_shell)
      integer(i4) :: found(lanes)
      integer :: i, l, used
      logical :: changed

      used = min(lanes, n - first)
      call gather(first, n, x, u, rotation, convention, block, direction, state, held, toward, normal)
      call gather_own(section, first, n, block%own, thickness, offset, growth)
      if (present(resultants)) call gather_stress(first, n, resultants, stress)
      if (present(states)) call new_point_states(states, first, n, remembered)
      if (lanes == 1 .and. present(tangent)) then
         call evaluate(tangent(1, 1, first + 1)) ! and what follows it
      else
         call evaluate(kb)
      end if
      status(first + 1:first + used) = found(1:used)
      if (present(energy)) energy(first + 1:first + used) = eb(1:used)
      if (present(force)) then
         do l = 1, used
            do i = 1, n_shell
               force(i, first + l) = fb(l, i)
            end do
         end do
      end if
      if (lanes > 1 .and. present(tangent)) call separate(used, kb, tangent(:, :, first + 1:first + used))

   contains

      !> Zeros where there is no result. The tangent of a single element has its place already.
      subroutine evaluate(matrix)
         real(wp), intent(inout) :: matrix(lanes, n_shell, n_shell)
         do
            if (present(resultants)) then
               call evaluate_block(section, level, block, eb, fb, matrix, found, stress, remembered)
            else
               call evaluate_block(section, level, block, eb, fb, matrix, found, states=remembered)
            end if
            ! only now: what was gathered one by one can be read in lanes after a while
            call check_input(block, present(direction), found, changed)
            if (.not. changed) exit
         end do
         if (associated(remembered%all%begin)) call judge_states(remembered, found)
         do l = 1, used
            if (found(l) == status_ok) cycle
            eb(l) = 0
            fb(l, :) = 0
            if (level == level_tangent) matrix(l, :, :) = 0
         end do
      end subroutine evaluate
   end subroutine evaluate_chunk

   !> Resultants of the elements first + 1 ..., side by side.
   pure subroutine gather_stress(first, n, resultants, stress)
      integer, intent(in) :: first, n
      real(wp), intent(in) :: resultants(n_resultants, n)
      type(stress_t), intent(out) :: stress
      integer :: e, g, l, v
      do l = 1, lanes
         e = first + merge(l, 1, first + l <= n)
         do g = 1, 3
            do v = 1, 3
               stress%n(lanes*(g - 1) + l, v) = resultants(6*g - 6 + v, e)
               stress%m(lanes*(g - 1) + l, v) = resultants(6*g - 3 + v, e)
            end do
         end do
      end do
   end subroutine gather_stress
end module finshell_chunk
