!> A load: forces on the nodes of elements, and their derivative. A kind extends `acting_load_t` and says `evaluate`, and `energy`
!> where it has one; adding it to the equations and its change with a motion are the same for all that act through elements
!> (those between nodes that share none: finshell_joined_load).
!>
!> Loads that depend on displacements only have the displacements of the nodes as rows. Those that depend on rotations, too, have
!> all freedoms, and moments.
!> Their stiffness is that along exp(spin) R: the part that belongs to the turning of the moments themselves, -spin(m)/2, is left
!> out.
module finshell_acting_load
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_corners, n_membrane, n_nodal, n_shell, rx, rz
   use finshell_assembly, only: assembly_t, add_element_contributions
   use finshell_equations, only: equations_t
   use finshell_factor, only: by_load_factor, factor_at
   use finshell_places, only: places_t
   use finshell_rotation, only: cross_product
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: acting_load_t, load_item_t, append, positions, find_positions, on_nothing, displacements_only, with_rotations

   !> What a load depends on: as many rows of an element.
   integer, parameter :: on_nothing = 0, displacements_only = n_membrane, with_rotations = n_shell

   type, abstract :: acting_load_t
      integer, allocatable :: elements(:) !< through which it acts; one may stand here several times
      integer :: rows = displacements_only
      real(wp), allocatable :: nodal(:, :) !< (n_nodal, nodes) forces that depend on nothing, beside those; unallocated: none
      integer :: scaling = by_load_factor !< see finshell_factor
      logical :: symmetric = .true. !< the stiffness is symmetric when assembled, for what supports leave free
      logical :: has_energy = .false. !< `energy` is the potential of all its forces
      type(places_t), private :: places !< of its elements, once `place` was called
   contains
      procedure(evaluate_interface), deferred :: evaluate
      procedure :: energy => no_energy
      procedure :: keep
      procedure :: add
      procedure :: add_force
      procedure :: place
      procedure :: add_change
   end type acting_load_t

   type :: load_item_t
      class(acting_load_t), allocatable :: load
   end type load_item_t

   abstract interface
      !> Forces for a factor of 1, and their derivative for a factor. An element that has failed gives 0: it reports that itself.
      subroutine evaluate_interface(self, structure, equations, state, force, factor, stiffness)
         import :: acting_load_t, structure_t, equations_t, state_t, wp
         class(acting_load_t), intent(in) :: self
         type(structure_t), intent(in) :: structure
         type(equations_t), intent(in) :: equations
         type(state_t), intent(in) :: state
         real(wp), intent(out), contiguous :: force(:, :) !< (rows, elements) node by node
         real(wp), intent(in), optional :: factor !< of the stiffness
         real(wp), intent(out), optional, contiguous :: stiffness(:, :, :) !< (rows, rows, elements)
      end subroutine evaluate_interface
   end interface

contains

   !> Forces for a factor of 1 to unit_force; with values, the stiffness at the present factor to the matrix.
   subroutine add(self, structure, equations, state, assembly, unit_force, values)
      class(acting_load_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      type(assembly_t), intent(in) :: assembly
      real(wp), intent(inout) :: unit_force(:, :, :) !< (n_nodal, nodes, factors)
      real(wp), intent(inout), optional :: values(:) !< of the matrix
      real(wp), allocatable :: force(:, :), stiffness(:, :, :)
      real(wp) :: factor
      if (allocated(self%nodal)) unit_force(:, :, self%scaling) = unit_force(:, :, self%scaling) + self%nodal
      if (self%rows == on_nothing) return ! all members of a team go on, also those without an element
      allocate (force(self%rows, size(self%elements)))
      factor = factor_at(state, self%scaling)
      if (present(values) .and. abs(factor) > 0) then
         allocate (stiffness(self%rows, self%rows, size(self%elements)))
         call self%evaluate(structure, equations, state, force, factor, stiffness)
         call add_element_contributions(assembly, self%elements, force, unit_force(:, :, self%scaling), stiffness, values)
      else
         call self%evaluate(structure, equations, state, force)
         call add_element_contributions(assembly, self%elements, force, unit_force(:, :, self%scaling))
      end if
   end subroutine add

   !> Forces at the present factor.
   subroutine add_force(self, structure, equations, state, assembly, total)
      class(acting_load_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      type(assembly_t), intent(in) :: assembly
      real(wp), intent(inout), contiguous :: total(:, :) !< (n_nodal, nodes) is added to
      real(wp), allocatable :: force(:, :)
      real(wp) :: factor
      factor = factor_at(state, self%scaling)
      if (.not. abs(factor) > 0) return
      if (allocated(self%nodal)) total = total + factor*self%nodal
      if (self%rows == on_nothing) return
      allocate (force(self%rows, size(self%elements)))
      call self%evaluate(structure, equations, state, force)
      if (allocated(self%places%first)) then
         call add_element_contributions(assembly, self%elements, force, total, places=self%places, factor=factor)
      else
         call add_element_contributions(assembly, self%elements, force, total, factor=factor)
      end if
   end subroutine add_force

   !> Find its elements in the assembly, before it is evaluated many times.
   subroutine place(self, assembly)
      class(acting_load_t), intent(inout) :: self
      type(assembly_t), intent(in) :: assembly
      if (self%rows /= on_nothing) self%places = assembly%places(self%elements)
   end subroutine place

   !> Change of the forces with a motion of the nodes, at the present factor.
   subroutine add_change(self, structure, equations, state, motion, change)
      class(acting_load_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: motion(:, :) !< (n_nodal, nodes) displacements and spins
      real(wp), intent(inout) :: change(:, :) !< (n_nodal, nodes) is added to
      real(wp), allocatable :: force(:, :), stiffness(:, :, :)
      real(wp) :: f(n_nodal, n_corners), moments(n_nodal, n_corners), factor
      integer :: i, k, per_node
      factor = factor_at(state, self%scaling)
      if (.not. abs(factor) > 0 .or. size(self%elements) == 0) return
      per_node = self%rows/n_corners
      allocate (force(self%rows, size(self%elements)), stiffness(self%rows, self%rows, size(self%elements)))
      call self%evaluate(structure, equations, state, force, factor, stiffness)
      do i = 1, size(self%elements)
         associate (nodes => structure%mesh%triangles(:, self%elements(i)))
            if (.not. any(abs(motion(:per_node, nodes)) > 0)) cycle
            f = 0
            f(:per_node, :) = reshape(matmul(stiffness(:, :, i), reshape(motion(:per_node, nodes), [self%rows])), &
                                      [per_node, n_corners])
            moments = 0
            moments(:per_node, :) = factor*reshape(force(:, i), [per_node, n_corners])
            do k = 1, n_corners
               f(rx:rz, k) = f(rx:rz, k) - 0.5_wp*cross_product(moments(rx:rz, k), motion(rx:rz, nodes(k)))
               change(:, nodes(k)) = change(:, nodes(k)) + f(:, k)
            end do
         end associate
      end do
   end subroutine add_change

   !> Act through some of the elements only. To be replaced by loads with more arrays over them.
   subroutine keep(self, kept)
      class(acting_load_t), intent(inout) :: self
      logical, intent(in) :: kept(:) !< (size(elements))
      self%elements = pack(self%elements, kept)
   end subroutine keep

   !> Potential for a factor of 1.
   function no_energy(self, structure, equations, state) result(energy)
      class(acting_load_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp) :: energy
      energy = 0*state%load_factor*size(self%elements)*size(structure%sections)*equations%n
   end function no_energy

   subroutine append(list, load)
      type(load_item_t), allocatable, intent(inout) :: list(:)
      class(acting_load_t), intent(in) :: load
      type(load_item_t), allocatable :: grown(:)
      integer :: i
      allocate (grown(size(list) + 1))
      do i = 1, size(list)
         call move_alloc(list(i)%load, grown(i)%load)
      end do
      allocate (grown(size(grown))%load, source=load)
      call move_alloc(grown, list)
   end subroutine append

   !> Current positions of the nodes of some elements, (3, 3, elements).
   pure function positions(structure, state, elements) result(x)
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      integer, intent(in) :: elements(:)
      real(wp), allocatable :: x(:, :, :)
      allocate (x(3, 3, size(elements)))
      call find_positions(structure, state, elements, x)
   end function positions

   !> The same where memory is there already.
   pure subroutine find_positions(structure, state, elements, x)
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      integer, intent(in) :: elements(:)
      real(wp), intent(out), contiguous :: x(:, :, :) !< (3, 3, elements)
      integer :: c, i, k, node
      associate (triangles => structure%mesh%triangles, reference => structure%mesh%coordinates, u => state%displacement)
         do i = 1, size(elements)
            do k = 1, 3
               node = triangles(k, elements(i))
               do c = 1, 3
                  x(c, k, i) = reference(c, node) + u(c, node)
               end do
            end do
         end do
      end associate
   end subroutine find_positions
end module finshell_acting_load
