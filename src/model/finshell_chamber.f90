!> Chambers as the input states them: a closed surface, and what fills it. Data, and the law of the fluid.
!>
!> With the gauge pressure p, the volume V that the walls enclose, the volume `rigid` of pipes and vessels beside it, and the
!> amount N, measured by the volume that it takes at p = 0:
!>
!>     gas      (p + ambient) (V + rigid)^exponent = ambient N^exponent
!>     liquid   V + rigid = N exp(-p/bulk_modulus);   V + rigid = N where it does not yield
!>
!> N is what fills the chamber in the reference state, and `inflow` times its factor.
module finshell_chamber
   use finshell_kinds, only: wp
   use finshell_factor, only: by_load_factor
   use finshell_field, only: name_t
   implicit none
   private
   public :: chamber_t, can_hold, room_for, compliance_at, pressure_in

   type :: chamber_t
      character(len=:), allocatable :: name
      type(name_t), allocatable :: outward(:), inward(:) !< element sets whose normals point out of the chamber, and into it
      logical :: gas = .true.
      real(wp) :: ambient = 0 !< of a gas: the pressure outside, > 0
      real(wp) :: exponent = 1 !< of a gas: 1 at constant temperature, the ratio of the specific heats without exchange of heat
      real(wp) :: bulk_modulus = 0 !< of a liquid; 0: it does not yield
      real(wp) :: rigid = 0 !< volume beside that between the walls
      real(wp) :: inflow = 0 !< volume, at ambient pressure, for a factor of 1
      integer :: scaling = by_load_factor !< of the inflow, see finshell_factor
   end type chamber_t

contains

   !> Does the law give a pressure for every volume?
   elemental logical function can_hold(self)
      type(chamber_t), intent(in) :: self
      can_hold = self%gas .or. self%bulk_modulus > 0
   end function can_hold

   !> The volume between the walls that an amount takes under a pressure.
   elemental real(wp) function room_for(self, amount, pressure) result(volume)
      type(chamber_t), intent(in) :: self
      real(wp), intent(in) :: amount, pressure
      volume = amount
      if (self%gas) then
         volume = amount*(self%ambient/(self%ambient + pressure))**(1/self%exponent)
      else if (self%bulk_modulus > 0) then
         volume = amount*exp(-pressure/self%bulk_modulus)
      end if
      volume = volume - self%rigid
   end function room_for

   !> Minus its derivative with respect to the pressure.
   elemental real(wp) function compliance_at(self, amount, pressure) result(compliance)
      type(chamber_t), intent(in) :: self
      real(wp), intent(in) :: amount, pressure
      compliance = 0
      if (self%gas) then
         compliance = (room_for(self, amount, pressure) + self%rigid)/(self%exponent*(self%ambient + pressure))
      else if (self%bulk_modulus > 0) then
         compliance = (room_for(self, amount, pressure) + self%rigid)/self%bulk_modulus
      end if
   end function compliance_at

   !> The pressure of an amount in a volume between the walls; both it and the whole volume are positive, the fluid yields.
   elemental real(wp) function pressure_in(self, amount, volume) result(pressure)
      type(chamber_t), intent(in) :: self
      real(wp), intent(in) :: amount, volume
      if (self%gas) then
         pressure = self%ambient*((amount/(volume + self%rigid))**self%exponent - 1)
      else
         pressure = self%bulk_modulus*log(amount/(volume + self%rigid))
      end if
   end function pressure_in
end module finshell_chamber
