!> Springs along fixed axes between two nodes, or from a node to the ground: they go by the relative displacement u of their ends,
!> not by where these are. Linear along x, y, z, or any law along one direction d, by u.d.
module finshell_axis_spring
   use finshell_connector, only: connector_t, spring_axes
   use finshell_equations, only: equations_t
   use finshell_factor, only: unscaled
   use finshell_freedoms, only: uz
   use finshell_joined_load, only: joined_load_t
   use finshell_kinds, only: wp
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: axis_spring_t, new_axis_spring

   type, extends(joined_load_t) :: axis_spring_t
      type(connector_t) :: connector
   contains
      procedure :: evaluate
      procedure :: energy
      procedure :: measure
      procedure, private :: one
   end type axis_spring_t

contains

   subroutine new_axis_spring(self, connector, equations)
      type(axis_spring_t), intent(out) :: self
      type(connector_t), intent(in) :: connector
      type(equations_t), intent(in) :: equations
      self%connector = connector
      self%scaling = unscaled
      self%has_energy = .true.
      call self%join(equations, connector%node, .false.)
   end subroutine new_axis_spring

   !> Energy, force that pulls the first end back, and its derivative, for the relative displacement u of one of them.
   pure subroutine one(self, b, state, u, energy, force, stiffness)
      class(axis_spring_t), intent(in) :: self
      integer, intent(in) :: b
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: u(3), energy, force(3), stiffness(3, 3)
      real(wp) :: f, tangent
      integer :: i
      u = state%displacement(:, self%node(1, b))
      if (self%nodes == 2) u = u - state%displacement(:, self%node(2, b))
      associate (c => self%connector)
         if (c%kind == spring_axes) then
            energy = sum((0.5_wp*c%vector*u + c%preload)*u)
            force = c%vector*u + c%preload
            stiffness = 0
            do i = 1, 3
               stiffness(i, i) = c%vector(i)
            end do
         else
            call c%law%evaluate(dot_product(u, c%direction), 0.0_wp, energy, f, tangent)
            force = f*c%direction
            stiffness = tangent*spread(c%direction, 2, 3)*spread(c%direction, 1, 3)
         end if
         energy = c%share*energy
         force = c%share*force
         stiffness = c%share*stiffness
      end associate
   end subroutine one

   !> Force and extension of one of them: along its direction, or the lengths of the vectors.
   pure subroutine measure(self, b, state, force, extension)
      class(axis_spring_t), intent(in) :: self
      integer, intent(in) :: b
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: force, extension
      real(wp) :: u(3), w, f(3), k(3, 3)
      call self%one(b, state, u, w, f, k)
      if (self%connector%kind == spring_axes) then
         force = norm2(f)
         extension = norm2(u)
      else
         force = dot_product(f, self%connector%direction)
         extension = dot_product(u, self%connector%direction)
      end if
   end subroutine measure

   subroutine evaluate(self, structure, equations, state, force, factor, stiffness)
      class(axis_spring_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      real(wp) :: u(3), w, f(3), k(3, 3)
      integer :: b, i, j
      do b = 1, self%count()
         call self%one(b, state, u, w, f, k)
         do j = 0, self%nodes - 1
            force(uz*j + 1:uz*j + uz, b) = merge(-f, f, j == 0)
            if (.not. present(stiffness)) cycle
            do i = 0, self%nodes - 1
               stiffness(uz*i + 1:uz*i + uz, uz*j + 1:uz*j + uz, b) = merge(-factor, factor, i == j)*k
            end do
         end do
      end do
      if (equations%n < 0 .or. size(structure%sections) < 0) force = 0
   end subroutine evaluate

   function energy(self, structure, equations, state)
      class(axis_spring_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp) :: energy, u(3), w, f(3), k(3, 3)
      integer :: b
      energy = 0*equations%n*size(structure%sections)
      do b = 1, self%count()
         call self%one(b, state, u, w, f, k)
         energy = energy + w
      end do
   end function energy
end module finshell_axis_spring
