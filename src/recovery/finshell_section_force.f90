!> What is transmitted through a cut: force and moment that the rest of a structure exerts on a set of its elements, at the nodes
!> of the cut.
!>
!> They are sums of the nodal forces of those elements, the free body's way: no stresses are recovered. As the forces of an element
!> are in balance among themselves, so is the resultant, to rounding, with all that acts on the other nodes of the set:
!> loads, reactions, and in motion inertia.
module finshell_section_force
   use finshell_cut, only: cut_t
   use finshell_discretisation, only: evaluate_gathered, freedoms, gather_elements, gathered_t
   use finshell_equilibrium, only: equilibrium_t
   use finshell_freedoms, only: n_corners, n_nodal, rx, rz, ux, uz
   use finshell_kinds, only: wp, i4
   use finshell_rotation, only: cross_product
   use finshell_growing, only: changed_state
   use finshell_state, only: linear_change_t, small_part, state_t
   implicit none
   private
   public :: section_resultant

contains

   !> Force and moment (global axes) at a state or, to first order, of a linear change of that of the problem.
   function section_resultant(problem, state, cut, change) result(resultant)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(cut_t), intent(in) :: cut
      type(linear_change_t), intent(in), optional :: change
      real(wp) :: resultant(n_nodal)
      real(wp) :: part
      if (.not. present(change)) then
         resultant = at_state(problem, state, state, cut)
         return
      end if
      associate (base => problem%state, motion => change%motion)
         part = small_part(motion, problem%detail)
         if (change%alone) then
            resultant = (at_state(problem, changed_state(base, change, part), base, cut) &
                         - at_state(problem, changed_state(base, change, -part), base, cut))/(2*part)
         else
            ! from one side, as fields are (finshell_recovery)
            resultant = (1 - 1.5_wp/part)*at_state(problem, base, base, cut) &
                        + 2/part*at_state(problem, changed_state(base, change, part), base, cut) &
                        - 0.5_wp/part*at_state(problem, changed_state(base, change, 2*part), base, cut)
         end if
      end associate
   end function section_resultant

   !> Forces of a state with the arms of another one. An element that cannot be evaluated gives nothing: no equilibrium state has
   !> one.
   function at_state(problem, state, place, cut) result(resultant)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state, place
      type(cut_t), intent(in) :: cut
      real(wp) :: resultant(n_nodal)
      type(gathered_t) :: g
      real(wp), allocatable :: force(:, :), nodal(:, :)
      integer(i4), allocatable :: status(:)
      integer, allocatable :: elements(:)
      real(wp) :: centre(3)
      integer :: e, i, k, m, s
      associate (structure => problem%structure, x => problem%structure%mesh%coordinates)
         allocate (nodal(n_nodal, size(x, 2)), source=0.0_wp)
         do s = 1, size(structure%sections)
            elements = pack(cut%elements, structure%element_section(cut%elements) == s)
            if (size(elements) == 0) cycle
            call gather_elements(structure, state, elements, g, problem%equations%held)
            m = freedoms(structure%sections(s))/n_corners
            allocate (force(m*n_corners, size(elements)), status(size(elements)))
            call evaluate_gathered(structure%sections(s), g, status, force=force)
            do e = 1, size(elements)
               do k = 1, n_corners
                  i = structure%mesh%triangles(k, elements(e))
                  nodal(:m, i) = nodal(:m, i) + force(m*(k - 1) + 1:m*k, e)
               end do
            end do
            deallocate (force, status)
         end do
         if (allocated(cut%point)) then
            centre = cut%point
         else
            centre = [(sum(x(k, :) + place%displacement(k, :), mask=cut%member), k=1, 3)]/count(cut%member)
         end if
         resultant = 0
         do i = 1, size(x, 2)
            if (.not. cut%member(i)) cycle
            resultant(ux:uz) = resultant(ux:uz) + nodal(ux:uz, i)
            resultant(rx:rz) = resultant(rx:rz) + nodal(rx:rz, i) &
               + cross_product(x(:, i) + place%displacement(:, i) - centre, nodal(ux:uz, i))
         end do
      end associate
   end function at_state
end module finshell_section_force
