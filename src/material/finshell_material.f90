!> What every material law offers: the plane-stress-reduced stored energy with its exact derivatives.
!>
!> A law is evaluated at many points in one call; its loops run over the points `i = 1..n`, free of branches where
!> possible, so that they vectorise. Arrays are in the law's own material axes 1, 2 (the section rotates), 3 is the normal.
!> Voigt order: strain e = (E11, E22, 2 E12), stress s = (S11, S22, S12), so that dW = s . de. The tangent d = ds/de and the
!> Hessian of the thickness stretch are symmetric 3x3 matrices stored as (11, 22, 33, 12, 13, 23).
!> Green-Lagrange strain and second Piola-Kirchhoff stress; energy per reference volume.
!>
!> Some laws have switches: fibres that act in tension only. Stress and energy are continuous there, the tangent is not, so at
!> the switch, as all fibres are in the reference state, it has to be said which one is meant (`switched_plane_stress`).
!>
!> Some laws remember: each point has `states` numbers, zero in material that was never strained. A law is asked with those at the
!> beginning of a step of time and says those at its end (`plane_stress_from`); who keeps them, and when the end becomes the next
!> beginning, is not its affair.
module finshell_material
   use finshell_kinds, only: wp, i4
   implicit none
   private
   public :: material_t

   type, abstract :: material_t
      !> True when the response does not depend on the direction of the material axes.
      logical :: isotropic = .true.
      character(len=32) :: name = '' !< as in finshell_registry, which sets it; for messages
      !> True when the law has switches, and so overrides `switched_plane_stress`.
      logical :: switched = .false.
      !> True when the stress is linear in the strain: two Gauss points integrate a layer exactly.
      logical :: linear = .false.
      integer :: states = 0 !< state variables of a point
   contains
      procedure :: plane_stress_from
      procedure :: switched_plane_stress
      procedure :: fibres
      procedure(plane_stress_interface), deferred :: plane_stress
      procedure(thickness_stretch_interface), deferred :: thickness_stretch
      procedure(reference_tangent_interface), deferred :: reference_tangent
   end type material_t

   abstract interface
      !> Energy, stress and tangent with the normal stress condensed out (S33 = 0, S13 = S23 = 0 by symmetry).
      pure subroutine plane_stress_interface(self, n, level, e, w, s, d, status)
         import :: material_t, wp, i4
         class(material_t), intent(in) :: self
         integer, intent(in) :: n !< number of points, a multiple of `strip`
         integer, intent(in) :: level !< finshell_evaluation; level_energy: w; level_force: w and s; level_tangent: w, s and d
         real(wp), intent(in) :: e(n, 3) !< strain
         real(wp), intent(inout) :: w(n) !< stored energy per reference volume
         real(wp), intent(inout) :: s(n, 3) !< stress
         real(wp), intent(inout) :: d(n, 6) !< tangent ds/de
         !> Set to status_material_limit where the law cannot be evaluated (never reset); w, s, d are then finite or NaN.
         integer(i4), intent(inout) :: status(n)
      end subroutine plane_stress_interface

      !> Thickness stretch lambda_Z (paper eq. 25) as a function of the midsurface strain, with its derivatives.
      pure subroutine thickness_stretch_interface(self, n, level, e, l, dl, ddl, status)
         import :: material_t, wp, i4
         class(material_t), intent(in) :: self
         integer, intent(in) :: n, level
         real(wp), intent(in) :: e(n, 3) !< strain of the midsurface
         real(wp), intent(inout) :: l(n) !< thickness stretch
         real(wp), intent(inout) :: dl(n, 3) !< dl/de (level_force)
         real(wp), intent(inout) :: ddl(n, 6) !< d2l/de2 (level_tangent)
         integer(i4), intent(inout) :: status(n)
      end subroutine thickness_stretch_interface

      !> Small-strain plane-stress tangent, (11, 22, 33, 12, 13, 23): the scale of the higher-order drilling stiffness.
      pure function reference_tangent_interface(self) result(d)
         import :: material_t, wp
         class(material_t), intent(in) :: self
         real(wp) :: d(6)
      end function reference_tangent_interface
   end interface

contains

   !> `plane_stress` with a tangent that does not depend on rounding: a switch counts as reached while the strain it looks at is
   !> below `floor`. There the tangent is that without the fibres or, with `rate`, the one-sided one in the direction of this
   !> change of strain: fibres act that it stretches.
   pure subroutine switched_plane_stress(self, n, level, e, floor, w, s, d, status, rate, rate_floor)
      class(material_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(in) :: floor(n) !< strain that rounding alone can make
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp), intent(in), optional :: rate(n, 3) !< change of strain
      real(wp), intent(in), optional :: rate_floor(n) !< what of it rounding alone can make; comes with `rate`
      call self%plane_stress(n, level, e, w, s, d, status)
   end subroutine switched_plane_stress

   !> `plane_stress` at the end of a step of time, for laws with states. (`plane_stress` of such a law is that of a step of no time
   !> from the state zero.)
   pure subroutine plane_stress_from(self, n, level, e, time, step, begin, w, s, d, end, status)
      class(material_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3) !< strain at the end
      real(wp), intent(in) :: time, step !< at the end; since the beginning, >= 0
      real(wp), intent(in) :: begin(n, self%states) !< states
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      real(wp), intent(inout) :: end(n, self%states) !< at any level
      integer(i4), intent(inout) :: status(n)
      end = begin
      call self%plane_stress(n, level, e, w, s, d, status)
   end subroutine plane_stress_from

   !> Families of fibres of the law: none here.
   pure subroutine fibres(self, families, fibre)
      class(material_t), intent(in) :: self
      integer, intent(out) :: families !< 0 to 2
      !> Cosine squared, sine squared and their product of the angle between material axis 1 and the fibres, of each family.
      real(wp), intent(out) :: fibre(3, 2)
      families = 0
      fibre = 0
   end subroutine fibres
end module finshell_material
