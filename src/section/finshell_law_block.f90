!> A material law at one point of each element of a block. Laws take `strip` points side by side; where a block has fewer elements,
!> its first point fills the strip.
module finshell_law_block
   use finshell_kinds, only: wp, i4, lanes, strip
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_material, only: material_t
   implicit none
   private
   public :: plane_stress, switched_plane_stress, thickness_stretch

   logical, parameter :: fits = lanes == strip
   integer, parameter :: points = strip*((lanes + strip - 1)/strip)

contains

   !> Procedure of this name in finshell_material.
   pure subroutine plane_stress(law, level, strain, energy, stress, tangent, status)
      class(material_t), intent(in) :: law
      integer, intent(in) :: level
      real(wp), intent(in) :: strain(lanes, 3)
      real(wp), intent(inout) :: energy(lanes), stress(lanes, 3), tangent(lanes, 6)
      integer(i4), intent(inout) :: status(lanes)
      real(wp) :: w(points), s(points, 3), d(points, 6)
      integer(i4) :: found(points)
      if (fits) then
         call law%plane_stress(lanes, level, strain, energy, stress, tangent, status)
      else
         found = filled_status(status)
         call law%plane_stress(points, level, filled_strain(strain), w, s, d, found)
         call take(level, w, s, d, found, energy, stress, tangent, status)
      end if
   end subroutine plane_stress

   !> Procedure of this name in finshell_material.
   pure subroutine switched_plane_stress(law, level, strain, floor, energy, stress, tangent, status, rate, rate_floor)
      class(material_t), intent(in) :: law
      integer, intent(in) :: level
      real(wp), intent(in) :: strain(lanes, 3), floor(lanes)
      real(wp), intent(inout) :: energy(lanes), stress(lanes, 3), tangent(lanes, 6)
      integer(i4), intent(inout) :: status(lanes)
      real(wp), intent(in), optional :: rate(lanes, 3), rate_floor(lanes)
      real(wp) :: w(points), s(points, 3), d(points, 6)
      integer(i4) :: found(points)
      if (fits) then
         call law%switched_plane_stress(lanes, level, strain, floor, energy, stress, tangent, status, rate, rate_floor)
         return
      end if
      found = filled_status(status)
      if (present(rate)) then
         call law%switched_plane_stress(points, level, filled_strain(strain), filled(floor), w, s, d, found, filled_strain(rate), &
                                        filled(rate_floor))
      else
         call law%switched_plane_stress(points, level, filled_strain(strain), filled(floor), w, s, d, found)
      end if
      call take(level, w, s, d, found, energy, stress, tangent, status)
   end subroutine switched_plane_stress

   !> Procedure of this name in finshell_material.
   pure subroutine thickness_stretch(law, level, strain, l, dl, ddl, status)
      class(material_t), intent(in) :: law
      integer, intent(in) :: level
      real(wp), intent(in) :: strain(lanes, 3)
      real(wp), intent(inout) :: l(lanes), dl(lanes, 3), ddl(lanes, 6)
      integer(i4), intent(inout) :: status(lanes)
      real(wp) :: w(points), s(points, 3), d(points, 6)
      integer(i4) :: found(points)
      if (fits) then
         call law%thickness_stretch(lanes, level, strain, l, dl, ddl, status)
      else
         found = filled_status(status)
         call law%thickness_stretch(points, level, filled_strain(strain), w, s, d, found)
         call take(level, w, s, d, found, l, dl, ddl, status)
      end if
   end subroutine thickness_stretch

   !> Values of a strip from those of a block.
   pure function filled(values) result(f)
      real(wp), intent(in) :: values(lanes)
      real(wp) :: f(points)
      f = values(1)
      f(:lanes) = values
   end function filled

   pure function filled_strain(strain) result(f)
      real(wp), intent(in) :: strain(lanes, 3)
      real(wp) :: f(points, 3)
      integer :: i
      do i = 1, 3
         f(:, i) = filled(strain(:, i))
      end do
   end function filled_strain

   pure function filled_status(status) result(f)
      integer(i4), intent(in) :: status(lanes)
      integer(i4) :: f(points)
      f = status(1)
      f(:lanes) = status
   end function filled_status

   !> Results of a block from those of a strip.
   pure subroutine take(level, w, s, d, found, energy, stress, tangent, status)
      integer, intent(in) :: level
      real(wp), intent(in) :: w(points), s(points, 3), d(points, 6)
      integer(i4), intent(in) :: found(points)
      real(wp), intent(inout) :: energy(lanes), stress(lanes, 3), tangent(lanes, 6)
      integer(i4), intent(inout) :: status(lanes)
      energy = w(:lanes)
      if (level >= level_force) stress = s(:lanes, :)
      if (level >= level_tangent) tangent = d(:lanes, :)
      status = found(:lanes)
   end subroutine take
end module finshell_law_block
