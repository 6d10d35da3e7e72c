!> Growth as the input states it: layers of elements whose stress-free state is another one than the mesh shows. Data, and the
!> stress-free state that all growths together give to an element.
!>
!> A growth has stretches g1, g2 along and across the material direction of a layer, and g3 of its thickness. They rise in
!> proportion to a factor f (finshell_factor), 1 + f (g - 1); a prestretch p is its inverse, 1/(1 + f (p - 1)). Where several act
!> on a layer their logarithms are added up, ln U = sum ln U_i: where they have the same axes the stretches multiply.
module finshell_stress_free
   use finshell_batch, only: n_growth
   use finshell_factor, only: by_load_factor, factor_at, present_place
   use finshell_kinds, only: wp
   use finshell_section, only: layer_t
   use finshell_span, only: span_t
   use finshell_state, only: state_t
   implicit none
   private
   public :: growth_t, growths_t, new_growths, stress_free, scaled_factors, largest_rate

   type :: growth_t
      integer :: scaling = by_load_factor !< see finshell_factor
      type(span_t) :: span !< steps in which it is there
      integer, allocatable :: elements(:)
      integer, allocatable :: layers(:) !< from the bottom; none: all
      !> (3, 1 or elements) along, across, through the thickness, for a factor of 1. The third one 0: the volume is kept.
      real(wp), allocatable :: stretch(:, :)
      logical :: inverse = .false. !< a prestretch
      real(wp) :: cosine = 1, sine = 0 !< of the angle from axis 1 of the layer
   end type growth_t

   type :: growths_t
      type(growth_t), allocatable :: list(:)
      integer, allocatable :: elements(:) !< that one of them acts on
      integer, allocatable, private :: place(:, :) !< (growths, elements of the mesh) among the elements of each; 0: not there
   end type growths_t

contains

   !> Growths of a mesh with so many elements.
   pure subroutine new_growths(self, list, elements)
      type(growths_t), intent(out) :: self
      type(growth_t), intent(in) :: list(:)
      integer, intent(in) :: elements
      integer :: e, i
      self%list = list
      allocate (self%place(size(list), elements), source=0)
      do i = 1, size(list)
         self%place(i, list(i)%elements) = [(e, e=1, size(list(i)%elements))]
      end do
      self%elements = pack([(e, e=1, elements)], any(self%place > 0, dim=1))
   end subroutine new_growths

   !> (factors) Which of the first so many factors scale one that is there.
   pure function scaled_factors(self, state, factors) result(scaled)
      type(growths_t), intent(in) :: self
      type(state_t), intent(in) :: state
      integer, intent(in) :: factors
      logical :: scaled(factors)
      integer :: i
      scaled = .false.
      do i = 1, size(self%list)
         if (self%list(i)%span%covers(state%stage)) scaled(present_place(state, self%list(i)%scaling)) = .true.
      end do
   end function scaled_factors

   !> The stress-free state of the layers of an element: components 11, 22, 2*12 of its Green-Lagrange strain along the material
   !> direction of the element, and the stretch of the thickness less 1. A stretch that is not positive makes a strain of -1/2,
   !> which no element takes.
   pure function stress_free(self, layers, state, element) result(growth)
      type(growths_t), intent(in) :: self
      type(layer_t), intent(in) :: layers(:) !< of the section
      type(state_t), intent(in) :: state
      integer, intent(in) :: element
      real(wp) :: growth(n_growth, size(layers))
      real(wp) :: logarithm(3, size(layers)), thickness(size(layers)), g(3), a, b, c, s
      logical :: gone
      integer :: at, i, l
      logarithm = 0
      thickness = 1
      gone = .false.
      do i = 1, size(self%list)
         at = self%place(i, element)
         if (at == 0) cycle
         associate (one => self%list(i))
            if (.not. one%span%covers(state%stage)) cycle
            g = stretches(one, min(at, size(one%stretch, 2)), factor_of(state, present_place(state, one%scaling)))
            if (.not. all(g > 0)) then
               gone = .true.
               cycle
            end if
            a = log(g(1))
            b = log(g(2))
            do l = 1, size(layers)
               if (size(one%layers) > 0 .and. .not. any(one%layers == l)) cycle
               c = layers(l)%cosine*one%cosine - layers(l)%sine*one%sine
               s = layers(l)%sine*one%cosine + layers(l)%cosine*one%sine
               logarithm(:, l) = logarithm(:, l) + [c**2*a + s**2*b, s**2*a + c**2*b, c*s*(a - b)]
               thickness(l) = thickness(l)*g(3)
            end do
         end associate
      end do
      do l = 1, size(layers)
         growth(:3, l) = strain_of(logarithm(:, l))
         growth(4, l) = thickness(l) - 1
      end do
      if (gone) growth(:2, :) = -0.5_wp
   end function stress_free

   !> Stretches for a factor; zeros where they would not be positive.
   pure function stretches(self, at, factor) result(g)
      type(growth_t), intent(in) :: self
      integer, intent(in) :: at !< which of the elements
      real(wp), intent(in) :: factor
      real(wp) :: g(3)
      logical :: keeps_volume
      keeps_volume = .not. self%stretch(3, at) > 0
      g = 1 + factor*(self%stretch(:, at) - 1)
      if (keeps_volume) g(3) = 1
      if (.not. all(g > 0)) then
         g = 0
         return
      end if
      if (self%inverse) g = 1/g
      if (keeps_volume) g(3) = 1/(g(1)*g(2))
   end function stretches

   !> The factor that growth goes by.
   pure real(wp) function factor_of(state, scaling)
      type(state_t), intent(in) :: state
      integer, intent(in) :: scaling
      if (allocated(state%growing)) then
         factor_of = state%growing(scaling)
      else
         factor_of = factor_at(state, scaling)
      end if
   end function factor_of

   !> Green-Lagrange strain of the stretch exp(H): (exp(2 H) - 1)/2.
   pure function strain_of(h) result(e)
      real(wp), intent(in) :: h(3) !< components 11, 22, 12
      real(wp) :: e(3) !< 11, 22, 2*12
      real(wp) :: grown, half, part, mean
      grown = exp(h(1) + h(2))
      half = hypot(h(1) - h(2), 2*h(3))
      part = 1
      if (half > epsilon(half)) part = sinh(half)/half
      mean = grown*cosh(half) - 1
      e(1) = (mean + grown*part*(h(1) - h(2)))/2
      e(2) = (mean - grown*part*(h(1) - h(2)))/2
      e(3) = 2*grown*part*h(3)
   end function strain_of

   !> How fast the largest stretch changes when the factors change by so much.
   pure real(wp) function largest_rate(self, state, change)
      type(growths_t), intent(in) :: self
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: change(:) !< (factors)
      integer :: i
      largest_rate = 0
      do i = 1, size(self%list)
         associate (one => self%list(i))
            if (one%span%covers(state%stage)) largest_rate = max(largest_rate, &
               abs(change(present_place(state, one%scaling)))*maxval(abs(one%stretch - 1), mask=one%stretch > 0))
         end associate
      end do
   end function largest_rate
end module finshell_stress_free
