!> What the tests of the membrane share: sections of all laws and a laminate, random states, one-element calls.
module support_membrane
   use, intrinsic :: iso_fortran_env, only: int64
   use finshell_error, only: error_t
   use finshell_kinds, only: wp, i4
   use finshell_membrane_batch, only: evaluate_membranes, recover_membranes
   use finshell_registry, only: material_names
   use finshell_section, only: formulation_s, new_layered_section, ply_t, section_t
   use support_element, only: random_triangle, section_of, uniform, random_state
   implicit none
   private
   public :: sheet_names, sheet_of, one_membrane, state_of, sheet_state

contains

   !> All laws, and 'laminate'.
   function sheet_names() result(names)
      character(len=32), allocatable :: names(:)
      allocate (names(size(material_names()) + 1))
      names(:size(names) - 1) = material_names()
      names(size(names)) = 'laminate'
   end function sheet_names

   !> A sheet of the example parameters of a law, thickness 0.1; the laminate has fibres in several directions.
   subroutine sheet_of(name, wrinkling, section, slack)
      character(len=*), intent(in) :: name
      logical, intent(in) :: wrinkling
      type(section_t), intent(out) :: section
      real(wp), intent(in), optional :: slack
      character(len=*), parameter :: laws(3) = [character(len=22) :: 'holzapfel_gasser_ogden', 'orthotropic', 'neo_hookean']
      type(section_t) :: single
      type(ply_t), allocatable :: plies(:)
      type(error_t), allocatable :: error
      integer :: i, n
      n = merge(3, 1, name == 'laminate')
      allocate (plies(n))
      do i = 1, n
         if (n == 1) then
            call section_of(name, 0.1_wp, formulation_s, single)
            plies(i)%thickness = 0.1_wp
         else
            call section_of(trim(laws(i)), 0.1_wp, formulation_s, single)
            plies(i)%thickness = 0.02_wp*i
            plies(i)%angle = 35.0_wp*i
         end if
         allocate (plies(i)%law, source=single%layers(1)%law)
      end do
      call new_layered_section(section, plies, error, wrinkling=wrinkling, slack=slack)
      if (allocated(error)) error stop 'support_membrane: section refused'
   end subroutine sheet_of

   !> A triangle in space and a homogeneous stretch about (l1, l2), turned; stretches far from 1 are distorted somewhat.
   subroutine sheet_state(seed, l1, l2, x, u)
      integer(int64), intent(inout) :: seed
      real(wp), intent(in) :: l1, l2
      real(wp), intent(out) :: x(3, 3), u(3, 3)
      real(wp) :: theta(3, 3)
      call random_triangle(seed, x)
      call random_state(seed, x, l1, l2, 0.1_wp*abs(l1 - 1), u, theta)
   end subroutine sheet_state

   subroutine one_membrane(section, x, u, energy, force, tangent, status, direction, slack)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: x(3, 3), u(3, 3)
      real(wp), intent(out) :: energy, force(9), tangent(9, 9)
      integer(i4), intent(out) :: status
      real(wp), intent(in), optional :: direction(3)
      real(wp), intent(out), optional :: slack
      real(wp) :: e(1), f(9, 1), k(9, 9, 1), w(1), d(3, 1)
      integer(i4) :: s(1)
      d(:, 1) = [1.0_wp, 0.0_wp, 0.0_wp]
      if (present(direction)) d(:, 1) = direction
      call evaluate_membranes(section, 1, reshape(x, [3, 3, 1]), reshape(u, [3, 3, 1]), s, e, f, k, d, slack_energy=w)
      energy = e(1)
      force = f(:, 1)
      tangent = k(:, :, 1)
      status = s(1)
      if (present(slack)) slack = w(1)
   end subroutine one_membrane

   !> Slack, wrinkled or taut.
   function state_of(section, x, u) result(state)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: x(3, 3), u(3, 3)
      integer :: state
      integer(i4) :: s(1), found(1)
      call recover_membranes(section, 1, reshape(x, [3, 3, 1]), reshape(u, [3, 3, 1]), s, state=found)
      state = found(1)
   end function state_of
end module support_membrane
