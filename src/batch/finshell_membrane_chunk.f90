!> A block of membrane elements out of a batch: gathered, its input checked, evaluated, written to the caller's arrays. What
!> finshell_chunk and finshell_block are to the shell.
module finshell_membrane_chunk
   use finshell_block, only: check_length, gather_own
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_freedoms, only: n_membrane
   use finshell_kinds, only: wp, i4, lanes
   use finshell_membrane, only: evaluate_membrane, membrane_t
   use finshell_own, only: check_own, n_growth
   use finshell_section, only: section_t
   use finshell_status, only: status_not_a_number, status_ok
   implicit none
   private
   public :: evaluate_membrane_chunk, gather_membranes, check_membranes

contains

   !> Elements first + 1 ... of the batch.
   subroutine evaluate_membrane_chunk(section, level, first, n, x, u, status, energy, force, tangent, direction, toward, &
                                      slack_energy, thickness, growth)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level, first, n
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n)
      integer(i4), intent(inout) :: status(n)
      real(wp), intent(inout), optional :: energy(n), force(n_membrane, n), tangent(n_membrane, n_membrane, n), slack_energy(n)
      real(wp), intent(in), optional :: direction(3, n), toward(n_membrane, n)
      real(wp), intent(in), optional :: thickness(n), growth(n_growth, size(section%layers), n)
      type(membrane_t) :: block
      real(wp) :: eb(lanes), fb(lanes, n_membrane), kb(lanes, n_membrane, n_membrane), sb(lanes)
      integer(i4) :: found(lanes)
      integer :: i, l, used
      logical :: changed

      used = min(lanes, n - first)
      call gather_membranes(first, n, x, u, block, direction, toward)
      call gather_own(section, first, n, block%own, thickness, growth=growth)
      do
         call evaluate_membrane(section, level, block, eb, fb, kb, found, sb)
         ! only now: what was gathered one by one can be read in lanes after a while
         call check_membranes(block, present(direction), found, changed)
         if (.not. changed) exit
      end do
      status(first + 1:first + used) = found(1:used)
      do l = 1, used
         if (found(l) == status_ok) cycle
         eb(l) = 0
         sb(l) = 0
         if (level >= level_force) fb(l, :) = 0
         if (level >= level_tangent) kb(l, :, :) = 0
      end do
      if (present(energy)) energy(first + 1:first + used) = eb(1:used)
      if (present(slack_energy)) slack_energy(first + 1:first + used) = sb(1:used)
      if (present(force)) then
         do l = 1, used
            do i = 1, n_membrane
               force(i, first + l) = fb(l, i)
            end do
         end do
      end if
      if (present(tangent)) call separate(used, kb, tangent(:, :, first + 1:first + used))
   end subroutine evaluate_membrane_chunk

   !> Elements first + 1 ... of the batch, side by side; missing ones at the end repeat the first of the block.
   pure subroutine gather_membranes(first, n, x, u, block, direction, toward)
      integer, intent(in) :: first, n
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n)
      type(membrane_t), intent(out) :: block
      real(wp), intent(in), optional :: direction(3, n), toward(n_membrane, n)
      integer :: c, e, j, l
      block%has_toward = present(toward)
      do l = 1, lanes
         e = first + merge(l, 1, first + l <= n)
         do j = 1, 3
            do c = 1, 3
               block%x(l, c, j) = x(c, j, e)
               block%u(l, c, j) = u(c, j, e)
            end do
         end do
         block%direction(l, :) = [1.0_wp, 0.0_wp, 0.0_wp]
         if (present(direction)) block%direction(l, :) = direction(:, e)
         if (present(toward)) block%toward(l, :) = toward(:, e)
      end do
   end subroutine gather_membranes

   !> Tangents of a block, upper triangles side by side, as full matrices one after the other. As in finshell_block: the compiler
   !> makes shuffles of it where it knows the sizes.
   pure subroutine separate(used, block, elements)
      integer, intent(in) :: used
      real(wp), intent(inout) :: block(lanes, n_membrane, n_membrane) !< the lower triangles are filled
      real(wp), intent(inout) :: elements(n_membrane, n_membrane, used)
      integer :: i, j, l
      do j = 1, n_membrane
         do i = 1, j - 1
            block(:, j, i) = block(:, i, j)
         end do
      end do
      do l = 1, used
         do j = 1, n_membrane
            do i = 1, n_membrane
               elements(i, j, l) = block(l, i, j)
            end do
         end do
      end do
   end subroutine separate

   !> NaN and infinity in the input; directions of an absurd length are brought back to a usual one.
   pure subroutine check_membranes(block, has_direction, status, changed)
      type(membrane_t), intent(inout) :: block
      logical, intent(in) :: has_direction
      integer(i4), intent(inout) :: status(lanes)
      logical, intent(out) :: changed !< a length was: results do not belong to the block
      real(wp) :: total(lanes)
      integer(i4) :: ignored(lanes)
      integer :: c, j
      if (block%own%sized .or. block%own%grown) call check_own(block%own, .true., status)
      total = 0
      do j = 1, 3
         do c = 1, 3
            total = total + 0*block%x(:, c, j) + 0*block%u(:, c, j)
         end do
         if (has_direction) total = total + 0*block%direction(:, j)
      end do
      changed = .false.
      ignored = status_ok ! a direction of zeros is an error only where it is needed
      if (has_direction) call check_length(3, block%direction, ignored, changed)
      where (.not. total <= 0) status = status_not_a_number
   end subroutine check_membranes
end module finshell_membrane_chunk
