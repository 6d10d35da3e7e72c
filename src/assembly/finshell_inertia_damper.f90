!> Damping by the stiffness of the material: f = beta K v with the material part K of the tangent in one state, turned with
!> each element. Turned so it does not resist a rigid motion, however large: in the state itself K times a rigid motion is zero.
!> Being constant otherwise, it never gives energy.
module finshell_inertia_damper
   use finshell_assembly, only: assembly_t, add_element_contributions
   use finshell_batch, only: n_resultants
   use finshell_discretisation, only: evaluate_gathered, freedoms, gather_elements, gather_motion, gathered_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_facet_axes, only: facet_axes
   use finshell_freedoms, only: n_corners, uz
   use finshell_kinds, only: wp, i4
   use finshell_state, only: state_t
   use finshell_status, only: status_ok, status_text
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: damper_t, new_damper

   !> Elements of one section.
   type :: damped_t
      integer, allocatable :: elements(:)
      real(wp), allocatable :: stiffness(:, :, :) !< (freedoms, freedoms, elements) in the axes of the facets
   end type damped_t

   type :: damper_t
      type(damped_t), allocatable :: list(:)
      real(wp) :: time = 0 !< beta
   contains
      procedure :: add
   end type damper_t

contains

   !> Errors: an element that cannot be evaluated at the state.
   subroutine new_damper(self, structure, state, own, held, time, error)
      type(damper_t), intent(out) :: self
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      integer, intent(in) :: own(:) !< elements of this member of a team
      integer, intent(in), allocatable :: held(:, :) !< see finshell_held_side; unallocated: none
      real(wp), intent(in) :: time
      type(error_t), allocatable, intent(out) :: error
      type(gathered_t) :: g
      real(wp), allocatable :: f(:, :), stress(:, :)
      integer(i4), allocatable :: status(:)
      integer :: bad, e, k, m, n

      self%time = time
      allocate (self%list(size(structure%sections)))
      do k = 1, size(structure%sections)
         self%list(k)%elements = pack(own, structure%element_section(own) == k)
         m = freedoms(structure%sections(k))
         n = size(self%list(k)%elements)
         allocate (self%list(k)%stiffness(m, m, n), f(m, n), status(n))
         allocate (stress(n_resultants, n), source=0.0_wp)
         associate (elements => self%list(k)%elements, stiffness => self%list(k)%stiffness)
            call gather_elements(structure, state, elements, g, held)
            call evaluate_gathered(structure%sections(k), g, status, force=f, tangent=stiffness, resultants=stress)
            bad = findloc(status == status_ok, .false., 1)
            if (bad > 0) then
               call raise(error, status(bad), 'damping: element '//text_of(elements(bad))//': '//status_text(status(bad)))
               return
            end if
            do e = 1, n
               if (structure%sections(k)%membrane) call take_tension(g%x(:, :, e) + g%u(:, :, e), f(:, e), stiffness(:, :, e))
               call turn_matrix(transpose(facet_axes(g%x(:, :, e) + g%u(:, :, e))), stiffness(:, :, e))
            end do
         end associate
         deallocate (f, status, stress)
      end do
   end subroutine new_damper

   !> Take damping forces for nodal velocities from the external forces; with values, rate times the matrix is added to them.
   subroutine add(self, structure, assembly, state, velocity, external_force, rate, values)
      class(damper_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(assembly_t), intent(in) :: assembly
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: velocity(:, :) !< (n_nodal, nodes)
      real(wp), intent(inout) :: external_force(:, :) !< (n_nodal, nodes)
      real(wp), intent(in) :: rate !< of the velocity with the displacement
      real(wp), intent(inout), optional :: values(:)
      real(wp), allocatable :: force(:, :), stiffness(:, :, :)
      real(wp) :: axes(3, 3), x(3, n_corners)
      integer :: e, i, k

      if (.not. allocated(self%list)) return
      do k = 1, size(self%list)
         associate (elements => self%list(k)%elements, matrix => self%list(k)%stiffness)
            if (size(elements) == 0) cycle
            allocate (force(size(matrix, 1), size(elements)))
            call gather_motion(structure, velocity, elements, force)
            if (present(values)) stiffness = matrix
            do e = 1, size(elements)
               do i = 1, n_corners
                  associate (node => structure%mesh%triangles(i, elements(e)))
                     x(:, i) = structure%mesh%coordinates(:, node) + state%displacement(:, node)
                  end associate
               end do
               axes = facet_axes(x)
               call turn_vectors(transpose(axes), force(:, e))
               force(:, e) = matmul(matrix(:, :, e), -self%time*force(:, e))
               call turn_vectors(axes, force(:, e))
               if (present(values)) call turn_matrix(axes, stiffness(:, :, e))
            end do
            if (present(values)) then
               stiffness = -self%time*rate*stiffness
               call add_element_contributions(assembly, elements, force, external_force, stiffness, values)
               deallocate (stiffness)
            else
               call add_element_contributions(assembly, elements, force, external_force)
            end if
            deallocate (force)
         end associate
      end do
   end subroutine add

   pure subroutine turn_vectors(rotation, v)
      real(wp), intent(in) :: rotation(3, 3)
      real(wp), intent(inout) :: v(:)
      integer :: i
      do i = 0, size(v) - uz, uz
         v(i + 1:i + uz) = matmul(rotation, v(i + 1:i + uz))
      end do
   end subroutine turn_vectors

   pure subroutine turn_matrix(rotation, k)
      real(wp), intent(in) :: rotation(3, 3)
      real(wp), intent(inout) :: k(:, :)
      integer :: i
      do i = 0, size(k, 1) - uz, uz
         k(i + 1:i + uz, :) = matmul(rotation, k(i + 1:i + uz, :))
         k(:, i + 1:i + uz) = matmul(k(:, i + 1:i + uz), transpose(rotation))
      end do
   end subroutine turn_matrix

   !> Take the geometric part from the tangent of a membrane: g I between two nodes, with forces f_i = sum_j g_ij (x_j - x_i) on
   !> them, which the forces give.
   pure subroutine take_tension(x, force, k)
      real(wp), intent(in) :: x(3, n_corners) !< present coordinates
      real(wp), intent(in) :: force(:) !< (n_membrane) internal forces
      real(wp), intent(inout) :: k(:, :) !< (n_membrane, n_membrane)
      real(wp) :: a(3), b(3), f(3), g(n_corners, n_corners), determinant
      integer :: c, i, j, l

      g = 0
      do i = 1, n_corners
         j = mod(i, n_corners) + 1
         l = mod(j, n_corners) + 1
         a = x(:, j) - x(:, i)
         b = x(:, l) - x(:, i)
         f = force(uz*(i - 1) + 1:uz*i)
         determinant = dot_product(a, a)*dot_product(b, b) - dot_product(a, b)**2
         g(i, j) = (dot_product(f, a)*dot_product(b, b) - dot_product(f, b)*dot_product(a, b))/determinant
         g(i, l) = (dot_product(f, b)*dot_product(a, a) - dot_product(f, a)*dot_product(a, b))/determinant
         g(i, i) = -g(i, j) - g(i, l)
      end do
      do c = 1, uz
         do j = 1, n_corners
            do i = 1, n_corners
               k(uz*(i - 1) + c, uz*(j - 1) + c) = k(uz*(i - 1) + c, uz*(j - 1) + c) - g(i, j)
            end do
         end do
      end do
   end subroutine take_tension
end module finshell_inertia_damper
