!> Springs, bars and cables along the line between two nodes, or from a node to a fixed point.
!>
!> With the length l and the direction n from the second end to the first, energy W(l) and force f = W': -f n on the first end,
!> f n on the second, stiffness f' n n' + (f/l)(I - n n').
module finshell_line_spring
   use finshell_connector, only: connector_t
   use finshell_equations, only: equations_t
   use finshell_factor, only: unscaled
   use finshell_force_law, only: force_law_t
   use finshell_freedoms, only: uz
   use finshell_joined_load, only: joined_load_t
   use finshell_kinds, only: wp
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: line_spring_t, new_line_spring, line_stiffness

   real(wp), parameter :: tension = 0.05_wp !< strain of the stand-in

   type, extends(joined_load_t) :: line_spring_t
      type(connector_t) :: connector
      type(force_law_t) :: law !< that of the connector, or taut
   contains
      procedure :: evaluate
      procedure :: energy
      procedure :: measure
      procedure :: length
      procedure :: stand_in
      procedure :: add_geometric
   end type line_spring_t

contains

   subroutine new_line_spring(self, connector, equations)
      type(line_spring_t), intent(out) :: self
      type(connector_t), intent(in) :: connector
      type(equations_t), intent(in) :: equations
      self%connector = connector
      self%law = connector%law
      self%scaling = unscaled
      self%has_energy = .true.
      call self%join(equations, connector%node, .false.)
   end subroutine new_line_spring

   !> Length and direction of one of them.
   pure subroutine length(self, b, structure, state, l, n)
      class(line_spring_t), intent(in) :: self
      integer, intent(in) :: b
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: l, n(3)
      if (self%nodes == 2) then
         n = self%position(1, b, structure, state) - self%position(2, b, structure, state)
      else
         n = self%position(1, b, structure, state) - self%connector%anchor
      end if
      ! ends that meet have no direction between them
      l = max(norm2(n), tiny(1.0_wp))
      n = n/l
   end subroutine length

   !> Force and extension (of a bar: strain, l/rest - 1) of one of them.
   pure subroutine measure(self, b, structure, state, force, extension)
      class(line_spring_t), intent(in) :: self
      integer, intent(in) :: b
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: force, extension
      real(wp) :: l, n(3), w, tangent
      call self%length(b, structure, state, l, n)
      call self%law%evaluate(l, self%connector%rest(b), w, force, tangent)
      force = self%connector%share*force
      extension = l - self%connector%rest(b)
      if (self%law%by_stretch()) extension = extension/self%connector%rest(b)
   end subroutine measure

   !> Matrix of the ends for a tangent along the line and one across it.
   pure function line_stiffness(n, along, across, ends) result(k)
      real(wp), intent(in) :: n(3), along, across
      integer, intent(in) :: ends
      real(wp) :: k(uz*ends, uz*ends)
      real(wp) :: one(3, 3)
      integer :: i
      one = (along - across)*spread(n, 2, 3)*spread(n, 1, 3)
      do i = 1, 3
         one(i, i) = one(i, i) + across
      end do
      k(:uz, :uz) = one
      if (ends == 1) return
      k(:uz, uz + 1:) = -one
      k(uz + 1:, :uz) = -one
      k(uz + 1:, uz + 1:) = one
   end function line_stiffness

   subroutine evaluate(self, structure, equations, state, force, factor, stiffness)
      class(line_spring_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      real(wp) :: l, n(3), w, f, tangent
      integer :: b
      do b = 1, self%count()
         call self%length(b, structure, state, l, n)
         call self%law%evaluate(l, self%connector%rest(b), w, f, tangent)
         f = self%connector%share*f
         force(:uz, b) = -f*n
         if (self%nodes == 2) force(uz + 1:, b) = f*n
         if (present(stiffness)) stiffness(:, :, b) = &
            -factor*line_stiffness(n, self%connector%share*tangent, f/l, self%nodes)
      end do
      if (equations%n < 0) force = 0
   end subroutine evaluate

   function energy(self, structure, equations, state)
      class(line_spring_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp) :: energy, l, n(3), w, f, tangent
      integer :: b
      energy = 0*equations%n
      do b = 1, self%count()
         call self%length(b, structure, state, l, n)
         call self%law%evaluate(l, self%connector%rest(b), w, f, tangent)
         energy = energy + self%connector%share*w
      end do
   end function energy

   !> See finshell_connectors.
   pure subroutine add_geometric(self, structure, state, motion, values)
      class(line_spring_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: motion(:, :)
      real(wp), intent(inout) :: values(:)
      real(wp) :: l, n(3), w, f, tangent, along(3)
      integer :: b
      do b = 1, self%count()
         call self%length(b, structure, state, l, n)
         call self%law%evaluate(l, self%connector%rest(b), w, f, tangent)
         along = motion(:uz, self%node(1, b))
         if (self%nodes == 2) along = along - motion(:uz, self%node(2, b))
         f = self%connector%share*tangent*dot_product(n, along)
         call self%blocks%add(b, line_stiffness(n, 0.0_wp, f/l, self%nodes), values)
      end do
   end subroutine add_geometric

   !> Add a part of a matrix with their largest stiffness along the lines, and what a little tension gives across: for what has
   !> neither at first (finshell_ground).
   pure subroutine stand_in(self, structure, state, part, values)
      class(line_spring_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: part
      real(wp), intent(inout) :: values(:)
      real(wp) :: l, n(3), k
      integer :: b
      do b = 1, self%count()
         call self%length(b, structure, state, l, n)
         k = self%connector%share*self%law%stiff_tangent(self%connector%rest(b))
         call self%blocks%add(b, line_stiffness(n, part*k, part*tension*k, self%nodes), values)
      end do
   end subroutine stand_in
end module finshell_line_spring
