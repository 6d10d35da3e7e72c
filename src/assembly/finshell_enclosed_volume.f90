!> The volume between a surface and an origin.
module finshell_enclosed_volume
   use finshell_acting_load, only: positions
   use finshell_cap_terms, only: caps_at
   use finshell_kinds, only: wp
   use finshell_pressure, only: enclosed_volume
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: volume_behind

contains

   !> Volume between elements and an origin, with the caps of those that are curved.
   function volume_behind(structure, elements, curved, origin, state, held) result(volume)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: elements(:), curved(:)
      real(wp), intent(in) :: origin(3)
      type(state_t), intent(in) :: state
      integer, intent(in), optional :: held(:, :) !< (3, elements of the structure)
      real(wp) :: volume
      real(wp), allocatable :: caps(:)
      volume = enclosed_volume(size(elements), positions(structure, state, elements), origin)
      if (size(curved) == 0) return
      allocate (caps(size(curved)))
      call caps_at(structure, curved, state, volume=caps, held=held)
      volume = volume + sum(caps)
   end function volume_behind
end module finshell_enclosed_volume
