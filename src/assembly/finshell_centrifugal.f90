!> Centrifugal load of a structure that spins about an axis, seen in the frame that spins with it: the mass of each element,
!> linearly interpolated, times the square of the angular velocity times the distance from the axis, in the deformed state. The
!> factor of the load scales the square. Mass sits on the midsurface of the facets, as with gravity.
!>
!> Potential -(omega^2/2) integral of mass |P (x - c)|^2, P = I - a a'; with the mass matrix m_ij = mass A (1 + delta_ij)/12 the
!> force is omega^2 P sum_j m_ij (x_j - c), its stiffness the constant omega^2 m_ij P.
module finshell_centrifugal
   use finshell_kinds, only: wp
   use finshell_freedoms, only: membrane_at, n_membrane, ux, uz
   use finshell_acting_load, only: acting_load_t, load_item_t, append, positions
   use finshell_equations, only: equations_t
   use finshell_error, only: error_t
   use finshell_load, only: load_t
   use finshell_loaded_set, only: loaded_elements, mass_per_area
   use finshell_rotation, only: cross_product
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: add_centrifugal

   type, extends(acting_load_t) :: centrifugal_t
      real(wp), allocatable :: mass(:) !< (elements) per reference area, times the square of the angular velocity
      real(wp) :: point(3) = 0 !< of the axis
      real(wp) :: across(3, 3) = 0 !< P
   contains
      procedure :: evaluate
      procedure :: energy
      procedure :: keep
   end type centrifugal_t

contains

   !> `point` and `direction` of the load: the axis; its first number: the angular velocity. Errors: no such set, no density.
   subroutine add_centrifugal(load, structure, list, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      type(centrifugal_t) :: self
      integer :: i
      call loaded_elements(load, structure, self%elements, error)
      if (.not. allocated(error)) call mass_per_area(load, structure, self%elements, self%mass, error)
      if (allocated(error)) return
      self%scaling = load%scaling
      self%has_energy = .true.
      self%mass = load%numbers(1)**2*self%mass
      self%point = load%point
      self%across = -spread(load%direction, 2, 3)*spread(load%direction, 1, 3)/dot_product(load%direction, load%direction)
      do i = 1, 3
         self%across(i, i) = self%across(i, i) + 1
      end do
      call append(list, self)
   end subroutine add_centrifugal

   !> See finshell_acting_load.
   subroutine keep(self, kept)
      class(centrifugal_t), intent(inout) :: self
      logical, intent(in) :: kept(:)
      self%mass = pack(self%mass, kept)
      self%elements = pack(self%elements, kept)
   end subroutine keep

   !> Mass times the square of the angular velocity over 12, of one element.
   pure real(wp) function twelfth(self, structure, i)
      class(centrifugal_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: i
      associate (x => structure%mesh%coordinates(:, structure%mesh%triangles(:, self%elements(i))))
         twelfth = self%mass(i)*norm2(cross_product(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1)))/24
      end associate
   end function twelfth

   subroutine evaluate(self, structure, equations, state, force, factor, stiffness)
      class(centrifugal_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      real(wp), allocatable :: x(:, :, :)
      real(wp) :: r(3, 3), m
      integer :: e, i, j
      x = positions(structure, state, self%elements)
      do e = 1, size(self%elements)
         m = twelfth(self, structure, e)
         r = matmul(self%across, x(:, :, e) - spread(self%point, 2, 3))
         force(:, e) = m*reshape(r + spread(sum(r, 2), 2, 3), [n_membrane])
         if (.not. present(stiffness)) cycle
         do j = 1, 3
            do i = 1, 3
               stiffness(membrane_at(i) + ux:membrane_at(i) + uz, membrane_at(j) + ux:membrane_at(j) + uz, e) &
                  = (factor*m*merge(2, 1, i == j))*self%across
            end do
         end do
      end do
      if (equations%n < 0) force = 0
   end subroutine evaluate

   function energy(self, structure, equations, state)
      class(centrifugal_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp) :: energy, r(3, 3)
      real(wp), allocatable :: x(:, :, :)
      integer :: e
      x = positions(structure, state, self%elements)
      energy = 0*equations%n
      do e = 1, size(self%elements)
         r = matmul(self%across, x(:, :, e) - spread(self%point, 2, 3))
         energy = energy - 0.5_wp*twelfth(self, structure, e)*(sum(r**2) + sum(sum(r, 2)**2))
      end do
   end function energy
end module finshell_centrifugal
