!> What elements have of their own within a section: thickness, offset, and growth, the change of their stress-free state.
module finshell_own
   use finshell_kinds, only: wp, i4, lanes, points_per_block
   use finshell_section, only: section_t
   use finshell_status, only: status_invalid_argument, status_not_a_number
   implicit none
   private
   public :: own_t, n_growth, check_own, own_inertia, actual_height, at_points

   !> Numbers that say how a layer has grown: Green-Lagrange strain of its stress-free state, 11, 22, 2 12 along the material
   !> direction of the element, and growth of its thickness, less 1.
   integer, parameter :: n_growth = 4

   !> Of a block of elements.
   type :: own_t
      logical :: sized = .false. !< a thickness or an offset; else the next two are not set
      real(wp) :: ratio(lanes) !< thickness over that of the section; layers share it
      real(wp) :: shift(lanes) !< what is at height z in the section is at ratio z + shift above the surface of the nodes
      logical :: grown = .false. !< else the next is not allocated
      real(wp), allocatable :: growth(:, :, :) !< (lanes, n_growth, layers)
   end type own_t

contains

   !> What is wrong with them: not finite; a thickness or a stress-free state that is not positive; growth of a membrane that
   !> differs from layer to layer (it has one stress-free state).
   pure subroutine check_own(own, membrane, status)
      type(own_t), intent(in) :: own
      logical, intent(in) :: membrane
      integer(i4), intent(inout) :: status(lanes)
      real(wp) :: g(n_growth)
      integer :: l, layer
      do l = 1, lanes
         if (own%sized) then
            if (.not. 0*own%ratio(l) + 0*own%shift(l) <= 0) then
               status(l) = status_not_a_number
            else if (.not. own%ratio(l) > 0) then
               status(l) = status_invalid_argument
            end if
         end if
         if (.not. own%grown) cycle
         do layer = 1, size(own%growth, 3)
            g = own%growth(l, :, layer)
            if (.not. sum(0*g) <= 0) then
               status(l) = status_not_a_number
            else if (.not. (1 + 2*g(1) > 0 .and. (1 + 2*g(1))*(1 + 2*g(2)) > g(3)**2 .and. 1 + g(4) > 0)) then
               status(l) = status_invalid_argument
            else if (membrane .and. any(abs(g - own%growth(l, :, 1)) > 0)) then
               status(l) = status_invalid_argument
            end if
         end do
      end do
   end subroutine check_own

   !> Integrals of density times 1, z, z^2 through the thickness of an element, z from the surface of the nodes.
   pure function own_inertia(section, thickness, offset) result(inertia)
      type(section_t), intent(in) :: section
      real(wp), intent(in), optional :: thickness, offset !< default: the section's
      real(wp) :: inertia(3)
      real(wp) :: ratio, shift
      ratio = 1
      if (present(thickness)) ratio = thickness/section%thickness
      shift = section%offset
      if (present(offset)) shift = offset
      shift = shift - ratio*section%offset
      associate (i => section%inertia)
         inertia(1) = ratio*i(1)
         inertia(2) = ratio*(ratio*i(2) + shift*i(1))
         inertia(3) = ratio*(ratio*(ratio*i(3) + 2*shift*i(2)) + shift**2*i(1))
      end associate
   end function own_inertia

   !> Heights above the surface of the nodes of what is at a height in the section.
   pure function actual_height(own, height) result(actual)
      type(own_t), intent(in) :: own
      real(wp), intent(in) :: height
      real(wp) :: actual(lanes)
      actual = height
      if (own%sized) actual = own%ratio*height + own%shift
   end function actual_height

   !> Values of elements at the points of a block.
   pure function at_points(values) result(points)
      real(wp), intent(in) :: values(lanes)
      real(wp) :: points(points_per_block)
      points = values(1)
      points(1:lanes) = values
      points(lanes + 1:2*lanes) = values
      points(2*lanes + 1:3*lanes) = values
   end function at_points
end module finshell_own
