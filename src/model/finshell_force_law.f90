!> Force over extension, of springs, bars and cables: a scalar law with its energy and its tangent.
!>
!> A spring goes by its extension e = s - rest: k e + preload, or a table. A bar goes by its stretch l = s/rest, with the
!> stiffness EA: St. Venant-Kirchhoff EA E l, E = (l^2 - 1)/2; logarithmic EA ln(l)/l. A law that acts in tension only has neither
!> force nor stiffness where the force would be negative.
module finshell_force_law
   use finshell_kinds, only: wp
   implicit none
   private
   public :: force_law_t, natural_length
   public :: law_linear, law_table, law_svk, law_logarithmic

   integer, parameter :: law_linear = 1, law_table = 2, law_svk = 3, law_logarithmic = 4

   type :: force_law_t
      integer :: kind = law_linear
      real(wp) :: stiffness = 0 !< force per extension, or EA
      real(wp) :: preload = 0 !< force at no extension
      real(wp), allocatable :: extension(:), force(:) !< table: extensions rise; beyond its ends its last pieces go on
      logical :: tension_only = .false.
   contains
      procedure :: evaluate
      procedure :: by_stretch
      procedure :: stiff_tangent
   end type force_law_t

contains

   !> Does it go by the stretch?
   pure logical function by_stretch(self)
      class(force_law_t), intent(in) :: self
      by_stretch = self%kind == law_svk .or. self%kind == law_logarithmic
   end function by_stretch

   !> Energy, force and its derivative at a length (or displacement, or angle) s.
   pure subroutine evaluate(self, s, rest, energy, force, tangent)
      class(force_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rest
      real(wp), intent(out) :: energy, force, tangent
      real(wp) :: e, stretch
      e = s - rest
      select case (self%kind)
      case (law_svk)
         stretch = s/rest
         e = 0.5_wp*(e/rest)*(stretch + 1)
         energy = 0.5_wp*self%stiffness*rest*e**2
         force = self%stiffness*stretch*e
         tangent = self%stiffness/rest*(e + stretch**2)
      case (law_logarithmic)
         stretch = s/rest
         e = log(stretch)
         energy = 0.5_wp*self%stiffness*rest*e**2
         force = self%stiffness*e/stretch
         tangent = self%stiffness/rest*(1 - e)/stretch**2
      case (law_table)
         call along_table(self, e, energy, force, tangent)
      case default
         energy = (0.5_wp*self%stiffness*e + self%preload)*e
         force = self%stiffness*e + self%preload
         tangent = self%stiffness
      end select
      if (.not. self%tension_only .or. .not. force < 0) return
      energy = 0
      if (self%kind == law_linear) energy = -0.5_wp*self%preload**2/self%stiffness
      force = 0
      tangent = 0
   end subroutine evaluate

   !> Table: the energy is that from the extension 0 on.
   pure subroutine along_table(self, e, energy, force, tangent)
      class(force_law_t), intent(in) :: self
      real(wp), intent(in) :: e
      real(wp), intent(out) :: energy, force, tangent
      integer :: i
      i = piece(e)
      tangent = slope(i)
      force = self%force(i) + tangent*(e - self%extension(i))
      energy = area(e) - area(0.0_wp)

   contains

      !> The piece on which an extension lies.
      pure integer function piece(at)
         real(wp), intent(in) :: at
         piece = max(1, min(size(self%extension) - 1, count(self%extension <= at)))
      end function piece

      pure real(wp) function slope(j)
         integer, intent(in) :: j
         slope = (self%force(j + 1) - self%force(j))/(self%extension(j + 1) - self%extension(j))
      end function slope

      !> Integral of the force from the beginning of the table on.
      pure real(wp) function area(at)
         real(wp), intent(in) :: at
         real(wp) :: d
         integer :: last, j
         last = piece(at)
         area = 0
         do j = 1, last - 1
            area = area + 0.5_wp*(self%force(j) + self%force(j + 1))*(self%extension(j + 1) - self%extension(j))
         end do
         d = at - self%extension(last)
         area = area + (self%force(last) + 0.5_wp*slope(last)*d)*d
      end function area
   end subroutine along_table

   !> Largest stiffness, for what needs some where a cable is slack: how the structure is joined, and first iterations.
   pure real(wp) function stiff_tangent(self, rest)
      class(force_law_t), intent(in) :: self
      real(wp), intent(in) :: rest
      select case (self%kind)
      case (law_svk, law_logarithmic); stiff_tangent = self%stiffness/rest
      case (law_table)
         associate (n => size(self%force))
            stiff_tangent = maxval(abs((self%force(2:) - self%force(:n - 1))/(self%extension(2:) - self%extension(:n - 1))))
         end associate
      case default; stiff_tangent = self%stiffness
      end select
   end function stiff_tangent

   !> The unstretched length of a bar that has a given force at a given length. 0: there is none.
   pure real(wp) function natural_length(law, length, force) result(rest)
      type(force_law_t), intent(in) :: law
      real(wp), intent(in) :: length, force
      real(wp) :: low, high, energy, f, tangent
      type(force_law_t) :: both
      integer :: i
      both = law
      both%tension_only = .false.
      ! by bisection over what is monotone: stretches between those where the laws of bars have their extremes
      low = length/merge(exp(1.0_wp), 100.0_wp, law%kind == law_logarithmic)
      high = length/merge(1.0e-2_wp, 1/sqrt(3.0_wp), law%kind == law_logarithmic)
      rest = 0
      call both%evaluate(length, low, energy, f, tangent)
      if (f < force) return
      call both%evaluate(length, high, energy, f, tangent)
      if (f > force) return
      do i = 1, 200
         rest = 0.5_wp*(low + high)
         call both%evaluate(length, rest, energy, f, tangent)
         if (f > force) low = rest
         if (.not. f > force) high = rest
      end do
   end function natural_length
end module finshell_force_law
