!> The one door to the kernel: many elements in one call, on as many threads as allowed.
!>
!> Assembly, C interface and tests all come through here. Elements are gathered into blocks of `lanes`, evaluated side by side
!> and scattered back; every element is computed by the same operations wherever it stands, so results do not depend on the
!> number of threads nor on how a mesh is split into calls.
module finshell_batch
   use finshell_kinds, only: wp, i4, lanes
   use finshell_element, only: evaluate_block, rotation_vector, rotation_quaternion
   use finshell_material, only: level_energy, level_force, level_tangent
   use finshell_section, only: section_t
   use finshell_status, only: status_ok, status_invalid_argument, status_not_a_number
!$ use omp_lib, only: omp_get_max_threads, omp_in_parallel
   implicit none
   private
   public :: evaluate_elements, rotation_vector, rotation_quaternion

contains

   !> Energy, nodal force and tangent of n elements.
   !>
   !> Force is the derivative of the stored energy with respect to u1 t1 u2 t2 u3 t3 (displacement and rotation of each node),
   !> the tangent its second derivative, symmetric, both triangles filled. What is not present is not computed.
   !> An element that fails gets its status and zeros; the others are done.
   subroutine evaluate_elements(section, n, x, u, rotation, convention, status, energy, force, tangent, direction, threads)
      type(section_t), intent(in) :: section
      integer, intent(in) :: n !< number of elements
      real(wp), intent(in) :: x(3, 3, n) !< reference coordinates (component, node, element)
      real(wp), intent(in) :: u(3, 3, n) !< displacements
      !> Nodal rotations, (4, 3, n) quaternions or (3, 3, n) rotation vectors as `convention` says.
      real(wp), intent(in) :: rotation(:, :, :)
      integer, intent(in) :: convention !< rotation_quaternion or rotation_vector
      integer(i4), intent(out) :: status(n) !< per element, see finshell_status
      real(wp), intent(out), optional :: energy(n), force(18, n), tangent(18, 18, n)
      real(wp), intent(in), optional :: direction(3, n) !< material direction 1, projected on the element; default global x
      integer, intent(in), optional :: threads !< default: OpenMP's, or 1 inside a parallel region
      integer :: b, blocks, level, team

      if (size(rotation, 1) /= merge(4, 3, convention == rotation_quaternion) .or. size(rotation, 2) /= 3 &
          .or. size(rotation, 3) < n .or. convention < rotation_vector .or. convention > rotation_quaternion) then
         status = status_invalid_argument
         return
      end if
      level = level_energy
      if (present(force)) level = level_force
      if (present(tangent)) level = level_tangent
      blocks = (n + lanes - 1)/lanes
      team = 1
!$    if (.not. omp_in_parallel()) team = omp_get_max_threads()
      if (present(threads)) team = max(1, threads)
      if (team == 1 .or. blocks == 1) then
         do b = 1, blocks
            call evaluate_chunk(section, level, b, n, x, u, rotation, convention, status, energy, force, tangent, direction)
         end do
      else
!$omp parallel do schedule(static) num_threads(team)
         do b = 1, blocks
            call evaluate_chunk(section, level, b, n, x, u, rotation, convention, status, energy, force, tangent, direction)
         end do
!$omp end parallel do
      end if
   end subroutine evaluate_elements

   !> Elements (b - 1)*lanes + 1 ... of the batch; missing ones of the last block repeat its first.
   subroutine evaluate_chunk(section, level, b, n, x, u, rotation, convention, status, energy, force, tangent, direction)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level, b, n, convention
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), rotation(:, :, :)
      integer(i4), intent(inout) :: status(n)
      real(wp), intent(inout), optional :: energy(n), force(18, n), tangent(18, 18, n)
      real(wp), intent(in), optional :: direction(3, n)
      real(wp) :: xb(lanes, 3, 3), ub(lanes, 3, 3), rb(lanes, 4, 3), db(lanes, 3)
      real(wp) :: eb(lanes), fb(lanes, 18), kb(lanes, 18, 18)
      integer(i4) :: sb(lanes)
      logical :: finite
      integer :: c, e, first, i, j, l, used

      first = (b - 1)*lanes
      used = min(lanes, n - first)
      rb = 0
      do l = 1, lanes
         e = first + merge(l, 1, l <= used)
         do j = 1, 3
            do c = 1, 3
               xb(l, c, j) = x(c, j, e)
               ub(l, c, j) = u(c, j, e)
               rb(l, c, j) = rotation(c, j, e)
            end do
            if (convention == rotation_quaternion) rb(l, 4, j) = rotation(4, j, e)
         end do
         db(l, :) = [1.0_wp, 0.0_wp, 0.0_wp]
         if (present(direction)) db(l, :) = direction(:, e)
      end do
      call evaluate_block(section, level, xb, ub, rb, convention, db, eb, fb, kb, sb)

      do l = 1, used
         e = first + l
         ! a sum over the input finds NaN and infinity in one test
         finite = abs(sum(xb(l, :, :)) + sum(ub(l, :, :)) + sum(rb(l, :, :)) + sum(db(l, :))) <= huge(1.0_wp)
         if (.not. finite) sb(l) = status_not_a_number
         status(e) = sb(l)
      end do
      if (present(energy)) energy(first + 1:first + used) = eb(1:used)
      if (present(force)) then
         do l = 1, used
            do i = 1, 18
               force(i, first + l) = fb(l, i)
            end do
         end do
      end if
      if (present(tangent)) then
         do j = 1, 18
            do i = 1, j
               do l = 1, used
                  tangent(i, j, first + l) = kb(l, i, j)
                  tangent(j, i, first + l) = kb(l, i, j)
               end do
            end do
         end do
      end if
      do l = 1, used
         if (sb(l) == status_ok) cycle
         e = first + l
         if (present(energy)) energy(e) = 0
         if (present(force)) force(:, e) = 0
         if (present(tangent)) tangent(:, :, e) = 0
      end do
   end subroutine evaluate_chunk
end module finshell_batch
