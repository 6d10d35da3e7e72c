!> Internal forces and tangent of a whole mesh, by many threads, with results that do not depend on how many.
!>
!> Built once for a mesh and its equations; then `assemble` for every state, and `add_element_contributions` for whatever
!> else acts through elements. Nodal forces are in GLOBAL axes, also at nodes with axes of their own; the matrix is
!> in the axes of the nodes, as the equations are (finshell_equations turns nodal vectors into equations).
module finshell_assembly
!$ use omp_lib, only: omp_get_max_threads
   use finshell_batch, only: n_resultants
   use finshell_colouring, only: patches_t, new_patches
   use finshell_discretisation, only: evaluate_gathered, freedoms, gather_elements, gather_motion, gathered_t, predict_gathered
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: wp, i4
   use finshell_linked_elements, only: linked_elements_t
   use finshell_node_axes, only: to_node_axes
   use finshell_freedoms, only: n_corners, n_membrane, n_shell, shell_displacements
   use finshell_places, only: find_places, places_t
   use finshell_section, only: section_t
   use finshell_scatter, only: scatter_t, new_scatter, add_element_matrix
   use finshell_sparsity, only: sparsity_t
   use finshell_state, only: state_t
   use finshell_status, only: status_ok, status_invalid_argument
   use finshell_structure, only: structure_t
   use finshell_team, only: add_up_all, add_up_value, agree, shared, team_t
   implicit none
   private
   public :: assembly_t, new_assembly, assemble, predict_stress, add_element_contributions, paying_threads
   public :: link_elements

   !> Elements are kept in the order of their patches: "slot" s holds element `patches%element(s)`. Others are with other members.
   type :: assembly_t
      private
      integer, public :: elements = 0, nodes = 0, entries = 0
      type(patches_t), public :: patches
      logical :: symmetric = .true.
      integer(i4), allocatable :: slot(:) ! (elements of the mesh) where an element is kept; 0: by others
      integer(i4), allocatable :: corner(:, :) ! (3, slots) nodes
      type(scatter_t) :: scatter ! of the slots
      logical, allocatable :: framed(:) ! (slots) a node has axes of its own
      integer(i4), allocatable :: frame(:) ! (nodes) 0: global axes
      real(wp), allocatable :: frames(:, :, :)
      integer, allocatable :: held(:, :) ! (3, elements) sides that supports hold (finshell_batch)
      type(linked_elements_t), public :: linked !< those with dependent nodes
      class(team_t), pointer, public :: team => null()
   contains
      procedure :: places => places_of
   end type assembly_t

contains

   !> Prepare the assembly. Errors: status_invalid_argument when array sizes do not fit each other.
   subroutine new_assembly(self, pattern, triangles, element_section, eq, error, frame, frames, held, &
                           membranes, own)
      type(assembly_t), intent(out) :: self
      type(sparsity_t), intent(in) :: pattern !< of the same equations and, of the triangles, those of this member
      integer, intent(in) :: triangles(:, :) !< (3, elements)
      integer, intent(in) :: element_section(:) !< (elements) index into the list of sections
      integer, intent(in) :: eq(:, :) !< (n_nodal, nodes) equation numbers, 0 = constrained
      type(error_t), allocatable, intent(out) :: error
      integer, optional, intent(in) :: frame(:) !< (nodes) axes of each node: index into frames, 0 = global
      real(wp), optional, intent(in) :: frames(:, :, :) !< (3, 3, :) orthonormal columns: the axes
      integer, optional, intent(in) :: held(:, :) !< (3, elements) sides that supports hold (finshell_batch)
      logical, optional, intent(in) :: membranes(:) !< (own elements) those that have displacements only
      integer, optional, intent(in) :: own(:) !< elements of this member of the team; default: all
      integer, allocatable :: list(:), order(:)
      logical, allocatable :: kinds(:)
      integer :: s, e

      self%team => pattern%team
      self%elements = size(triangles, 2)
      self%nodes = size(eq, 2)
      self%entries = pattern%entries()
      self%symmetric = pattern%symmetric
      if (size(element_section) /= self%elements) then
         call raise(error, status_invalid_argument, 'a section index is needed for each of '//text_of(self%elements)//' elements')
      else if (any(element_section < 1)) then
         call raise(error, status_invalid_argument, 'element '//text_of(findloc(element_section < 1, .true., 1))// &
                    ' has no section')
      else if (present(frame) .neqv. present(frames)) then
         call raise(error, status_invalid_argument, 'node axes need both their list and the index of each node')
      else if (present(frame)) then
         if (size(frame) /= self%nodes .or. any(frame < 0) .or. any(frame > size(frames, 3))) then
            call raise(error, status_invalid_argument, 'a node refers to axes that are not given')
         end if
      end if
      if (allocated(error)) return

      list = [(e, e=1, self%elements)]
      if (present(own)) list = own
      allocate (self%slot(self%elements), source=0_i4)
      self%elements = size(list)
      call new_patches(self%patches, triangles(:, list), self%nodes, element_section(list), patch_size(self%elements))
      order = self%patches%element
      self%patches%element = int(list(order), i4)
      allocate (self%corner(3, self%elements))
      allocate (self%framed(self%elements))
      allocate (self%frame(self%nodes), source=0_i4)
      if (present(frame)) then
         self%frame = int(frame, i4)
         self%frames = frames
      end if
      do s = 1, self%elements
         e = self%patches%element(s)
         self%slot(e) = int(s, i4)
         self%corner(:, s) = int(triangles(:, e), i4)
         self%framed(s) = any(self%frame(triangles(:, e)) > 0)
      end do
      if (present(held)) self%held = held
      kinds = [(.false., e=1, self%elements)]
      if (present(membranes)) kinds = membranes(order)
      call new_scatter(self%scatter, pattern%pattern_t, triangles(:, self%patches%element), eq, kinds)
   end subroutine new_assembly

   !> Let elements with dependent nodes add their matrices through blocks, numbered as in the list.
   pure subroutine link_elements(self, elements)
      type(assembly_t), intent(inout) :: self
      integer, intent(in) :: elements(:) !< of the mesh
      integer :: b
      if (allocated(self%linked%block)) deallocate (self%linked%block)
      if (size(elements) == 0) return
      allocate (self%linked%block(self%elements), source=0)
      do b = 1, size(elements)
         self%linked%block(self%slot(elements(b))) = b
      end do
   end subroutine link_elements

   !> Elements in a patch: a function of the mesh alone, or else results would depend on the machine.
   pure integer function patch_size(elements)
      integer, intent(in) :: elements
      patch_size = 32
      if (elements < 16000) patch_size = 16
      if (elements < 2000) patch_size = 8
   end function patch_size

   !> As many threads as OpenMP would take, but no more than pay: waiting threads burn CPU time.
   integer function paying_threads(elements)
      integer, intent(in) :: elements
      integer, parameter :: elements_per_thread = 2000
      paying_threads = 1
      !$ paying_threads = min(omp_get_max_threads(), 1 + elements/elements_per_thread)
   end function paying_threads

   !> Evaluate all elements and add them up. Without `values` only forces are evaluated, which is cheaper.
   subroutine assemble(self, structure, state, internal_force, status, bad_element, values, energy, threads, resultants, toward, &
                       sections, remembered)
      type(assembly_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: internal_force(:, :) !< (n_nodal, nodes) all components, so reactions too; global axes
      integer(i4), intent(out) :: status !< of the bad element with the lowest number, or status_ok
      integer, intent(out) :: bad_element !< its number, or 0; all other results are then useless
      real(wp), optional, intent(out), contiguous :: values(:) !< (entries of the pattern) tangent
      real(wp), optional, intent(out) :: energy !< strain energy
      integer, optional, intent(in) :: threads !< default: `paying_threads`
      !> (n_resultants, slots) from `predict_stress`: for the geometric part of the tangent; unallocated counts as absent.
      real(wp), optional, intent(in) :: resultants(:, :)
      real(wp), optional, intent(in) :: toward(:, :) !< (n_nodal, nodes) see `evaluate_elements`; global axes; with `values`
      type(section_t), optional, intent(in) :: sections(:) !< instead of those of the structure
      !> (numbers, elements) What laws with states remember at the end (finshell_past); unallocated counts as absent.
      real(wp), optional, intent(inout) :: remembered(:, :)
      real(wp), allocatable :: patch_energy(:), kept(:, :, :)
      real(wp), allocatable :: f(:, :), k(:, :, :), w(:), stress(:, :), d(:, :)
      type(gathered_t) :: g
      integer(i4), allocatable :: element_status(:)
      type(error_t), allocatable :: trouble
      integer :: p, c, i, j, m, s, n, most, team

      status = status_ok
      bad_element = 0
      most = 0
      if (self%elements > 0) most = maxval(self%patches%first(2:) - self%patches%first(:size(self%patches%first) - 1))
      allocate (patch_energy(size(self%patches%group)))
      team = paying_threads(self%elements)
      if (present(threads)) team = max(1, threads)
      if (present(values)) call self%linked%room(kept)

      !$omp parallel num_threads(team) default(shared) &
      !$omp private(g, f, k, w, stress, d, element_status, p, c, i, j, m, s, n)
      allocate (f(0, most), element_status(most))
      ! What is not asked for stays unallocated, and so counts as absent in the call below.
      if (present(energy)) allocate (w(most))
      if (present(resultants) .and. present(values)) allocate (stress(n_resultants, most))
      if (present(values)) then
         !$omp do schedule(static)
         do i = 1, size(values)
            values(i) = 0
         end do
         !$omp end do nowait
      end if
      !$omp do schedule(static)
      do i = 1, self%nodes
         internal_force(:, i) = 0
      end do
      !$omp end do
      do c = 1, self%patches%colours
         !$omp do schedule(dynamic)
         do p = self%patches%first_of_colour(c), self%patches%first_of_colour(c + 1) - 1
            s = self%patches%first(p) - 1
            n = self%patches%first(p + 1) - self%patches%first(p)
            m = freedoms(structure%sections(self%patches%group(p)))
            if (size(f, 1) /= m) then
               deallocate (f)
               allocate (f(m, most))
               if (allocated(k)) deallocate (k)
               if (present(values)) allocate (k(m, m, most))
               if (allocated(d)) deallocate (d)
               if (present(toward) .and. present(values)) allocate (d(m, most))
            end if
            m = m/n_corners
            associate (mine => self%patches%element(s + 1:s + n))
               call gather_elements(structure, state, mine, g, self%held)
               if (allocated(d)) call gather_motion(structure, toward, mine, d)
               if (allocated(stress)) stress(:, :n) = resultants(:, s + 1:s + n)
            end associate
            if (present(sections)) then
               call evaluate_gathered(sections(self%patches%group(p)), g, element_status, w, f, k, stress, d, threads=1)
            else
               call evaluate_gathered(structure%sections(self%patches%group(p)), g, element_status, w, f, k, stress, d, threads=1)
            end if
            if (any(element_status(:n) /= status_ok)) then
               !$omp critical (finshell_bad_element)
               do i = 1, n
                  if (element_status(i) == status_ok) cycle
                  if (bad_element > 0 .and. bad_element < self%patches%element(s + i)) cycle
                  bad_element = self%patches%element(s + i)
                  status = element_status(i)
               end do
               !$omp end critical (finshell_bad_element)
               cycle
            end if
            if (allocated(w)) patch_energy(p) = sum(w(:n))
            if (present(remembered) .and. allocated(g%end)) then
               do i = 1, n
                  remembered(:size(g%end, 1), self%patches%element(s + i)) = g%end(:, i)
               end do
            end if
            do i = 1, n
               do j = 1, n_corners
                  internal_force(:m, self%corner(j, s + i)) = internal_force(:m, self%corner(j, s + i)) + f(m*(j - 1) + 1:m*j, i)
               end do
               if (.not. allocated(k)) cycle
               if (self%linked%has(s + i)) then
                  call self%linked%keep(s + i, k(:, :, i), kept)
                  cycle
               end if
               if (self%framed(s + i)) call to_node_axes(self%frame(self%corner(:, s + i)), self%frames, k(:, :, i))
               call add_element_matrix(self%scatter, s + i, k(:, :, i), values)
            end do
         end do
         !$omp end do
      end do
      !$omp end parallel
      if (present(values)) call self%linked%add_kept(kept, values)
      if (present(energy)) then
         energy = 0
         if (bad_element == 0) energy = sum(patch_energy)
      end if
      if (.not. shared(self%team)) return
      ! The bad element with the lowest number counts, whoever has it.
      if (bad_element > 0) call raise(trouble, status, text_of(bad_element))
      call agree(self%team, trouble, bad_element)
      if (allocated(trouble)) then
         status = trouble%code
         read (trouble%message, *) bad_element
         return
      end if
      call add_up_all(self%team, internal_force)
      if (present(energy)) call add_up_value(self%team, energy)
   end subroutine assemble

   !> Resultants of all elements, linearised at this state for nodal displacements and spins (mixed-integration-point Newton).
   subroutine predict_stress(self, structure, state, increment, resultants, threads, toward)
      type(assembly_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: increment(:, :) !< (n_nodal, nodes) displacements and spins, global axes
      real(wp), intent(out) :: resultants(:, :) !< (n_resultants, slots): in the order of the assembly
      integer, optional, intent(in) :: threads !< default: `paying_threads`
      real(wp), optional, intent(in) :: toward(:, :) !< as for `assemble`
      real(wp), allocatable :: d(:, :), t(:, :)
      type(gathered_t) :: g
      integer(i4), allocatable :: element_status(:)
      integer :: n, p, s, team

      team = paying_threads(self%elements)
      if (present(threads)) team = max(1, threads)
      !$omp parallel do schedule(dynamic) num_threads(team) default(shared) private(g, d, t, element_status, n, s)
      do p = 1, size(self%patches%group)
         s = self%patches%first(p) - 1
         n = self%patches%first(p + 1) - self%patches%first(p)
         allocate (d(freedoms(structure%sections(self%patches%group(p))), n), element_status(n))
         if (present(toward)) allocate (t(size(d, 1), n)) ! unallocated: absent in the call below
         associate (mine => self%patches%element(s + 1:s + n))
            call gather_elements(structure, state, mine, g, self%held)
            call gather_motion(structure, increment, mine, d)
            if (allocated(t)) call gather_motion(structure, toward, mine, t)
         end associate
         call predict_gathered(structure%sections(self%patches%group(p)), g, d, resultants(:, s + 1:s + n), element_status, t)
         deallocate (d, element_status)
         if (allocated(t)) deallocate (t)
      end do
      !$omp end parallel do
   end subroutine predict_stress

   !> Where the elements of a list are, for `add_element_contributions`.
   pure function places_of(self, elements) result(places)
      class(assembly_t), intent(in) :: self
      integer, intent(in) :: elements(:) !< element numbers, which may stand here several times
      type(places_t) :: places
      places = find_places(self%slot, self%elements, elements)
   end function places_of

   !> Add forces that act through elements to the external forces, and take their stiffness from the tangent.
   !>
   !> Contributions come by a list of elements, which may name an element several times. Rows of force and stiffness are
   !> the displacements of the nodes, or all freedoms of a shell, in global axes. A symmetric pattern takes the
   !> symmetric part of the stiffness. The order of summation is that of the list within each patch, whatever the threads.
   subroutine add_element_contributions(self, elements, force, external_force, stiffness, values, threads, places, factor)
      type(assembly_t), intent(in) :: self
      integer, intent(in) :: elements(:) !< element numbers; a member of a team takes its own
      real(wp), intent(in), contiguous :: force(:, :) !< (n_membrane or n_shell, size(elements)) external force on the nodes
      real(wp), intent(inout), contiguous :: external_force(:, :) !< (n_nodal, nodes) force is added; global axes
      real(wp), optional, intent(in) :: stiffness(:, :, :) !< (rows of force, rows of force, size(elements)) d force / d unknowns
      real(wp), optional, intent(inout), contiguous :: values(:) !< stiffness is subtracted
      integer, optional, intent(in) :: threads !< default: `paying_threads`
      type(places_t), optional, intent(in) :: places !< of the elements, if they are known
      real(wp), optional, intent(in) :: factor !< of the force; default 1
      real(wp), allocatable :: part(:, :)
      if (shared(self%team)) then
         allocate (part(size(external_force, 1), size(external_force, 2)), source=0.0_wp)
         call add_own_contributions(self, elements, force, part, stiffness, values, threads, places, factor)
         call add_up_all(self%team, part)
         external_force = external_force + part
      else
         call add_own_contributions(self, elements, force, external_force, stiffness, values, threads, places, factor)
      end if
   end subroutine add_element_contributions

   subroutine add_own_contributions(self, elements, force, external_force, stiffness, values, threads, places, factor)
      type(assembly_t), intent(in) :: self
      integer, intent(in) :: elements(:)
      real(wp), intent(in), contiguous :: force(:, :)
      real(wp), intent(inout), contiguous :: external_force(:, :)
      real(wp), optional, intent(in) :: stiffness(:, :, :)
      real(wp), optional, intent(inout), contiguous :: values(:)
      integer, optional, intent(in) :: threads
      type(places_t), optional, intent(in), target :: places
      real(wp), optional, intent(in) :: factor
      type(places_t), target :: found
      type(places_t), pointer :: at
      real(wp) :: k(n_shell, n_shell), times
      integer :: local(n_shell)
      integer :: c, i, j, l, p, s, team, m

      team = paying_threads(self%elements)
      if (present(threads)) team = max(1, threads)
      times = 1
      if (present(factor)) times = factor
      local = [(i, i=1, n_shell)]
      if (size(force, 1) == n_membrane) local(:n_membrane) = shell_displacements
      m = size(force, 1)/n_corners
      if (present(places)) then
         at => places
      else
         found = self%places(elements)
         at => found
      end if

      !$omp parallel num_threads(team) default(shared) private(c, i, j, l, p, s, k)
      do c = 1, self%patches%colours
         !$omp do schedule(dynamic)
         do p = self%patches%first_of_colour(c), self%patches%first_of_colour(c + 1) - 1
            do s = self%patches%first(p), self%patches%first(p + 1) - 1
               do l = at%first(s), at%first(s + 1) - 1
                  i = at%order(l)
                  do j = 1, n_corners
                     associate (nodal => external_force(:m, self%corner(j, s)))
                        nodal = nodal + times*force(m*(j - 1) + 1:m*j, i)
                     end associate
                  end do
                  if (.not. (present(stiffness) .and. present(values))) cycle
                  if (self%linked%has(s)) cycle
                  k = 0
                  associate (rows => local(:size(force, 1)))
                     if (self%symmetric) then
                        k(rows, rows) = -0.5_wp*(stiffness(:, :, i) + transpose(stiffness(:, :, i)))
                     else
                        k(rows, rows) = -stiffness(:, :, i)
                     end if
                  end associate
                  if (self%framed(s)) call to_node_axes(self%frame(self%corner(:, s)), self%frames, k)
                  call add_element_matrix(self%scatter, s, k, values)
               end do
            end do
         end do
         !$omp end do
      end do
      !$omp end parallel
      if (present(stiffness) .and. present(values)) call self%linked%add_loads(at, stiffness, values)
   end subroutine add_own_contributions
end module finshell_assembly
