!> A block of `lanes` elements side by side: gathered, its input and its results checked, its matrices written one by one.
module finshell_block
   use finshell_element, only: block_t, rotation_vector, rotation_increment, rotation_quaternion
   use finshell_freedoms, only: n_shell
   use finshell_kinds, only: wp, i4, lanes
   use finshell_own, only: check_own, n_growth, own_t
   use finshell_reference, only: side_free, side_fixed
   use finshell_section, only: section_t
   use finshell_status, only: status_invalid_argument, status_large_rotation, status_material_limit, status_not_a_number, &
      status_ok
   implicit none
   private
   public :: bad_shape, gather, gather_own, separate, check_input, check_length, check_results, vanishing

   !> Quaternions and directions between the inverse of this and this are taken as they are; rotation vectors up to this.
   real(wp), parameter :: usual_length = 1.0e60_wp

contains

   !> Rotations must be (4, 3, >= n) quaternions or (3, 3, >= n) vectors; increments need a state.
   pure logical function bad_shape(rotation, convention, n, has_state)
      real(wp), intent(in) :: rotation(:, :, :)
      integer, intent(in) :: convention, n
      logical, intent(in) :: has_state
      bad_shape = size(rotation, 1) /= merge(4, 3, convention == rotation_quaternion) .or. size(rotation, 2) /= 3 &
                  .or. size(rotation, 3) < n .or. convention < rotation_vector .or. convention > rotation_increment &
                  .or. (convention == rotation_increment .and. .not. has_state)
   end function bad_shape

   !> Elements first + 1 ... of the batch, side by side; missing ones at the end repeat the first of the block.
   pure subroutine gather(first, n, x, u, rotation, convention, block, direction, state, held, toward, normal)
      integer, intent(in) :: first, n, convention
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), rotation(:, :, :)
      type(block_t), intent(out) :: block
      real(wp), intent(in), optional :: direction(3, n), state(4, 3, n), toward(n_shell, n)
      integer, intent(in), optional :: held(3, n)
      real(wp), intent(in), optional :: normal(3, 3, n)
      integer :: c, e, j, l
      block%convention = convention
      block%has_toward = present(toward)
      block%has_normals = present(normal)
      block%bulge = 1
      block%bow = 0.125_wp
      do l = 1, lanes
         e = first + merge(l, 1, first + l <= n)
         do j = 1, 3
            do c = 1, 3
               block%x(l, c, j) = x(c, j, e)
               block%u(l, c, j) = u(c, j, e)
               block%rotation(l, c, j) = rotation(c, j, e)
            end do
            block%rotation(l, 4, j) = 0
            if (convention == rotation_quaternion) block%rotation(l, 4, j) = rotation(4, j, e)
         end do
         block%direction(l, :) = [1.0_wp, 0.0_wp, 0.0_wp]
         if (present(direction)) block%direction(l, :) = direction(:, e)
         if (convention == rotation_increment) block%state(l, :, :) = state(:, :, e)
         if (present(held)) then
            block%bulge(l, :) = merge(1.0_wp, 0.0_wp, held(:, e) == side_free)
            block%bow(l, :) = merge(0.0_wp, 0.125_wp, held(:, e) == side_fixed)
         end if
         if (present(toward)) block%toward(l, :) = toward(:, e)
         if (present(normal)) block%normal(l, :, :) = normal(:, :, e)
      end do
   end subroutine gather

   !> What elements first + 1 ... of the batch have of their own, side by side; missing ones at the end repeat the first.
   pure subroutine gather_own(section, first, n, own, thickness, offset, growth)
      type(section_t), intent(in) :: section
      integer, intent(in) :: first, n
      type(own_t), intent(inout) :: own
      real(wp), intent(in), optional :: thickness(n) !< of the whole section, length
      real(wp), intent(in), optional :: offset(n) !< of the middle of the section above the surface of the nodes, length
      real(wp), intent(in), optional :: growth(n_growth, size(section%layers), n)
      integer :: e, l, layer
      own%sized = present(thickness) .or. present(offset)
      own%grown = present(growth)
      if (own%grown) allocate (own%growth(lanes, n_growth, size(section%layers)))
      if (.not. (own%sized .or. own%grown)) return
      do l = 1, lanes
         e = first + merge(l, 1, first + l <= n)
         if (own%sized) then
            own%ratio(l) = 1
            if (present(thickness)) own%ratio(l) = thickness(e)/section%thickness
            own%shift(l) = section%offset
            if (present(offset)) own%shift(l) = offset(e)
            own%shift(l) = own%shift(l) - own%ratio(l)*section%offset
         end if
         if (.not. own%grown) cycle
         do layer = 1, size(section%layers)
            own%growth(l, :, layer) = growth(:, layer, e)
         end do
      end do
   end subroutine gather_own

   !> NaN and infinity in the input; quaternions and directions of an absurd length are brought back to a usual one.
   pure subroutine check_input(block, has_direction, status, changed)
      type(block_t), intent(inout) :: block
      logical, intent(in) :: has_direction
      integer(i4), intent(inout) :: status(lanes)
      logical, intent(out) :: changed !< a length was: results do not belong to the block
      real(wp), dimension(lanes) :: tx, tu, tr, square, least, most
      integer(i4) :: ignored(lanes)
      integer :: c, j
      if (block%own%sized .or. block%own%grown) call check_own(block%own, .false., status)
      tx = 0
      tu = 0
      do j = 1, 3
         do c = 1, 3
            tx = tx + 0*block%x(:, c, j)
            tu = tu + 0*block%u(:, c, j)
         end do
      end do
      ! squares between these limits: the rotations are finite and of a usual size (a vector may be zero)
      most = 0
      least = usual_length
      do j = 1, 3
         square = block%rotation(:, 1, j)**2 + block%rotation(:, 2, j)**2 + block%rotation(:, 3, j)**2 + block%rotation(:, 4, j)**2
         most = most + square
         if (block%convention == rotation_quaternion) least = min(least, square)
      end do
      if (block%convention == rotation_increment) then
         do j = 1, 3
            square = block%state(:, 1, j)**2 + block%state(:, 2, j)**2 + block%state(:, 3, j)**2 + block%state(:, 4, j)**2
            most = most + square
            least = min(least, square)
         end do
      end if
      if (has_direction) then
         square = block%direction(:, 1)**2 + block%direction(:, 2)**2 + block%direction(:, 3)**2
         most = most + square
         least = min(least, square)
      end if
      if (block%has_normals) then
         do j = 1, 3
            square = block%normal(:, 1, j)**2 + block%normal(:, 2, j)**2 + block%normal(:, 3, j)**2
            most = most + square
            least = min(least, square)
         end do
      end if
      if (block%has_toward) then
         do c = 1, n_shell
            most = most + block%toward(:, c)**2
         end do
      end if
      changed = .false.
      if (all((tx + tu <= 0) .and. most < usual_length .and. least > 1/usual_length)) return

      tr = 0
      do j = 1, 3
         do c = 1, 4
            tr = tr + 0*block%rotation(:, c, j)
            if (block%convention == rotation_increment) tr = tr + 0*block%state(:, c, j)
         end do
         tr = tr + 0*block%direction(:, j)
         if (block%convention == rotation_quaternion) then
            call check_length(4, block%rotation(:, :, j), status, changed)
         else
            ! of a longer vector nothing is left of the angle
            where (.not. maxval(abs(block%rotation(:, 1:3, j)), 2) < usual_length) status = status_large_rotation
         end if
         if (block%convention == rotation_increment) call check_length(4, block%state(:, :, j), status, changed)
         if (block%has_normals) then
            tr = tr + 0*(block%normal(:, 1, j) + block%normal(:, 2, j) + block%normal(:, 3, j))
            call check_length(3, block%normal(:, :, j), status, changed)
         end if
      end do
      if (block%has_toward) then
         do c = 1, n_shell
            tr = tr + 0*block%toward(:, c)
         end do
      end if
      ignored = status_ok ! a direction of zeros is an error only where it is needed
      call check_length(3, block%direction, ignored, changed)
      where (.not. tx + tu + tr <= 0) status = status_not_a_number
   end subroutine check_input

   !> Vectors of which the length does not matter: zero is an error, squares are to neither overflow nor vanish.
   pure subroutine check_length(n, v, status, changed)
      integer, intent(in) :: n
      real(wp), intent(inout) :: v(lanes, n)
      integer(i4), intent(inout) :: status(lanes)
      logical, intent(inout) :: changed
      real(wp) :: length(lanes)
      integer :: c, l
      length = abs(v(:, 1))
      do c = 2, n
         length = max(length, abs(v(:, c)))
      end do
      if (all(length > 1/usual_length .and. length < usual_length)) return
      do l = 1, lanes
         if (.not. length(l) > 0) then
            status(l) = status_invalid_argument
         else if (.not. (length(l) > 1/usual_length .and. length(l) < usual_length)) then
            if (.not. length(l) <= huge(1.0_wp)) cycle
            v(l, :) = scale(v(l, :), -exponent(length(l)))
            changed = .true.
         end if
      end do
   end subroutine check_length

   !> Results that are not finite, of moduli or a strain so large that products overflow: the elements get a status and zeros.
   pure subroutine check_results(n, freedoms, status, energy, force, tangent)
      integer, intent(in) :: n, freedoms !< of an element
      integer(i4), intent(inout) :: status(n)
      real(wp), intent(inout), optional :: energy(n), force(freedoms, n), tangent(freedoms, freedoms, n)
      real(wp) :: total
      integer :: e
      do e = 1, n
         if (status(e) /= status_ok) cycle
         total = 0
         if (present(energy)) total = total + 0*energy(e)
         if (present(force)) total = total + sum(0*force(:, e))
         if (present(tangent)) total = total + sum(0*tangent(:, :, e))
         if (total <= 0) cycle
         status(e) = status_material_limit
         if (present(energy)) energy(e) = 0
         if (present(force)) force(:, e) = 0
         if (present(tangent)) tangent(:, :, e) = 0
      end do
   end subroutine check_results

   !> Zero for each lane of which all values are finite, else NaN.
   pure function vanishing(values) result(total)
      real(wp), intent(in) :: values(:) !< lane by lane, again and again
      real(wp) :: total(lanes)
      integer :: i
      total = 0
      do i = 0, size(values) - lanes, lanes
         total = total + 0*values(i + 1:i + lanes)
      end do
   end function vanishing

   !> Tangents of a block, side by side, one after the other.
   pure subroutine separate(used, block, elements)
      integer, intent(in) :: used
      real(wp), intent(in) :: block(lanes, n_shell, n_shell)
      real(wp), intent(inout) :: elements(n_shell, n_shell, used)
      integer :: l
      if (used == lanes) then
         call transpose_block(block, elements)
      else
         do l = 1, used
            elements(:, :, l) = block(l, :, :)
         end do
      end if
   end subroutine separate

   !> All matrices of a full block. Written out lane by lane, the compiler makes shuffles of it instead of single loads and stores.
   pure subroutine transpose_block(block, elements)
      real(wp), intent(in) :: block(lanes, 324)
      real(wp), intent(inout) :: elements(324, lanes)
      integer, parameter :: lane(8) = min([1, 2, 3, 4, 5, 6, 7, 8], lanes)
      integer :: i
      do i = 1, 324
         elements(i, lane(1)) = block(lane(1), i)
         elements(i, lane(2)) = block(lane(2), i)
         elements(i, lane(3)) = block(lane(3), i)
         elements(i, lane(4)) = block(lane(4), i)
         elements(i, lane(5)) = block(lane(5), i)
         elements(i, lane(6)) = block(lane(6), i)
         elements(i, lane(7)) = block(lane(7), i)
         elements(i, lane(8)) = block(lane(8), i)
      end do
   end subroutine transpose_block
end module finshell_block
