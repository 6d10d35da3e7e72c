!> Follower pressure: on the facets, and on the caps of elements with a curved reference.
module finshell_follower_load
   use finshell_kinds, only: wp
   use finshell_acting_load, only: acting_load_t, load_item_t, append, find_positions, with_rotations
   use finshell_assembly, only: paying_threads
   use finshell_cap_terms, only: caps_at
   use finshell_equations, only: equations_t
   use finshell_error, only: error_t, raise
   use finshell_load, only: load_t, pressure_symmetric, pressure_unsymmetric
   use finshell_loaded_set, only: loaded_elements
   use finshell_pressure, only: follower_pressure
   use finshell_pressure_region, only: symmetric_origin
   use finshell_state, only: state_t
   use finshell_status, only: status_input_error
   use finshell_structure, only: structure_t, curved_elements
   implicit none
   private
   public :: add_pressure_load, append_pressure, pressed_region_t

   !> The surface that a pressure acts on.
   type :: pressed_region_t
      integer, allocatable :: elements(:)
      integer, allocatable :: curved(:) !< those of them with a curved reference: the pressure acts on their caps, too
      integer :: scaling = 1 !< see finshell_factor
      real(wp) :: origin(3) = 0 !< of the enclosed volume
   end type pressed_region_t

   !> Always in the follower form: it is the pressure at held nodes too, so reactions are right. Where the symmetric form is
   !> exact (finshell_pressure_region), the stiffness of the follower form becomes symmetric when it is assembled.
   type, extends(acting_load_t) :: facet_pressure_t
      real(wp) :: pressure = 0
   contains
      procedure :: evaluate => evaluate_facets
   end type facet_pressure_t

   type, extends(acting_load_t) :: cap_pressure_t
      real(wp) :: pressure = 0
   contains
      procedure :: evaluate => evaluate_caps
      procedure :: energy => energy_of_caps
   end type cap_pressure_t

   integer, parameter :: together = 128 !< elements: their positions stay in the cache

contains

   !> Errors: no such set; a symmetric stiffness is asked for where it is not exact.
   subroutine add_pressure_load(load, structure, equations, list, region, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(pressed_region_t), intent(out) :: region
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: origin(3)
      logical :: valid

      call loaded_elements(load, structure, region%elements, error)
      if (allocated(error)) return
      region%curved = curved_elements(structure, region%elements)
      region%scaling = load%scaling
      call symmetric_origin(structure%mesh, equations, region%elements, valid, origin)
      if (valid) region%origin = origin
      if (load%stiffness == pressure_symmetric .and. .not. valid) then
         call raise(error, status_input_error, "load: the pressure on '"//load%set//"' has no symmetric " &
            //'stiffness: part of the boundary of the set is neither fixed nor in a plane of symmetry; ' &
            //'use automatic or unsymmetric')
         return
      end if
      call append_pressure(list, structure, region%elements, load%pressure, load%scaling, &
                           valid .and. load%stiffness /= pressure_unsymmetric)
   end subroutine add_pressure_load

   !> A pressure on elements, as one load or two.
   subroutine append_pressure(list, structure, elements, pressure, scaling, symmetric)
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: elements(:)
      real(wp), intent(in) :: pressure
      integer, intent(in) :: scaling !< see finshell_factor
      logical, intent(in) :: symmetric !< the stiffness is, when assembled
      type(facet_pressure_t) :: facets
      type(cap_pressure_t) :: caps
      if (size(elements) == 0) return
      facets%elements = elements
      facets%scaling = scaling
      facets%symmetric = symmetric
      facets%pressure = pressure
      call append(list, facets)
      caps%elements = curved_elements(structure, elements)
      if (size(caps%elements) == 0) return
      caps%rows = with_rotations
      caps%has_energy = .true.
      caps%scaling = scaling
      caps%pressure = pressure
      call append(list, caps)
   end subroutine append_pressure

   subroutine evaluate_facets(self, structure, equations, state, force, factor, stiffness)
      class(facet_pressure_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      real(wp), parameter :: nowhere(3) = 0
      real(wp) :: p(together), x(3, 3, together)
      integer :: first, last, n
      p = self%pressure
      !$omp parallel do schedule(static) num_threads(paying_threads(size(self%elements))) default(shared) private(last, n, x)
      do first = 1, size(self%elements), together
         last = min(size(self%elements), first + together - 1)
         n = last - first + 1
         call find_positions(structure, state, self%elements(first:last), x(:, :, :n))
         if (present(stiffness)) then
            call follower_pressure(n, p, x, .false., nowhere, force(:, first:last), stiffness(:, :, first:last))
         else
            call follower_pressure(n, p, x, .false., nowhere, force(:, first:last))
         end if
      end do
      !$omp end parallel do
      if (present(stiffness)) stiffness = factor*stiffness
      if (equations%n < 0) force = 0
   end subroutine evaluate_facets

   subroutine evaluate_caps(self, structure, equations, state, force, factor, stiffness)
      class(cap_pressure_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      call caps_at(structure, self%elements, state, force=force, stiffness=stiffness, held=equations%held)
      force = self%pressure*force
      if (present(stiffness)) stiffness = (factor*self%pressure)*stiffness
   end subroutine evaluate_caps

   function energy_of_caps(self, structure, equations, state) result(energy)
      class(cap_pressure_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp) :: energy
      real(wp), allocatable :: volume(:)
      allocate (volume(size(self%elements)))
      call caps_at(structure, self%elements, state, volume=volume, held=equations%held)
      energy = -self%pressure*sum(volume)
   end function energy_of_caps
end module finshell_follower_load
