!> Chambers of gas and liquid (finshell_chamber) in a structure. The pressure of each is an unknown beside the displacements; its
!> equation is that the fluid fills the chamber:
!>
!>     residual = V(u) - room(p)        -d/du = -g^T,  -d/dp = -c,  c = -d room/dp
!>
!> The forces on the walls are p g with g = dV/du, so the whole matrix [K -g; -g^T -c] is symmetric. Without the pressure it is
!> K + g g^T/c; a liquid that does not yield has c = 0.
!>
!> The pressure is kept among the factors of the state (finshell_factor), so the walls are loads of a pressure of 1 with a factor of
!> their own.
module finshell_chambers
   use finshell_acting_load, only: load_item_t
   use finshell_chamber, only: can_hold, chamber_t, compliance_at, pressure_in, room_for
   use finshell_enclosed_volume, only: volume_behind
   use finshell_equations, only: equations_t, gather
   use finshell_held_motion, only: motion_at
   use finshell_error, only: error_t, raise, text_of
   use finshell_factor, only: by_case, factor_at, slope_of
   use finshell_field, only: name_t
   use finshell_follower_load, only: append_pressure
   use finshell_kinds, only: wp
   use finshell_mesh, only: element_set_names, find_element_set, mesh_t, twice_area_vector
   use finshell_pressure_region, only: symmetric_origin
   use finshell_state, only: new_state, state_t
   use finshell_status, only: status_input_error, status_not_converged
   use finshell_structure, only: curved_elements, structure_t
   implicit none
   private
   public :: chambers_t, new_chambers

   type :: wall_t
      integer, allocatable :: outward(:), inward(:) !< elements whose normals point out of the chamber, into it
      integer, allocatable :: curved_outward(:), curved_inward(:)
      real(wp) :: origin(3) = 0
      real(wp) :: filled = 0 !< what fills the chamber in the reference state
      real(wp) :: size = 0 !< the volume of a sphere with this wall: what misfits are measured by
   end type wall_t

   type :: chambers_t
      integer :: n = 0
      integer :: before = 0 !< number of the factor (finshell_factor) before the first pressure
      type(chamber_t), allocatable :: fluid(:) !< (n)
      type(wall_t), allocatable :: wall(:) !< (n)
   contains
      procedure :: volumes
      procedure :: amounts
      procedure :: pressures
      procedure :: equilibrium
      procedure :: linearise
      procedure :: follow
      procedure :: move
      procedure :: moved
      procedure :: yields
   end type chambers_t

contains

   !> Find the walls, and list their loads. Errors: no such set; a surface that does not enclose a volume; one that is inside out.
   subroutine new_chambers(self, structure, equations, list, error)
      type(chambers_t), intent(out) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      type(state_t) :: reference
      real(wp), allocatable :: volume(:)
      integer, allocatable :: elements(:)
      logical :: closed
      integer :: c, i

      self%before = by_case + structure%cases
      if (.not. allocated(structure%chambers)) return
      self%n = size(structure%chambers)
      self%fluid = structure%chambers
      allocate (self%wall(self%n))
      do c = 1, self%n
         associate (wall => self%wall(c), fluid => self%fluid(c))
            call members(structure%mesh, fluid%name, fluid%outward, wall%outward, error)
            call members(structure%mesh, fluid%name, fluid%inward, wall%inward, error)
            if (allocated(error)) return
            wall%curved_outward = curved_elements(structure, wall%outward)
            wall%curved_inward = curved_elements(structure, wall%inward)
            elements = [wall%outward, wall%inward]
            call symmetric_origin(structure%mesh, equations, elements, closed, wall%origin, &
                                  [(i > size(wall%outward), i=1, size(elements))])
            if (.not. closed) then
               call raise(error, status_input_error, "chamber '"//fluid%name//"': the elements do not enclose a volume: part of " &
                  //'their boundary is neither fixed nor in a plane of symmetry')
               return
            end if
            wall%size = sphere_of(sum([(0.5_wp*norm2(twice_area_vector(structure%mesh, elements(i))), i=1, size(elements))]))
            call append_pressure(list, structure, wall%outward, 1.0_wp, self%before + c, .true.)
            call append_pressure(list, structure, wall%inward, -1.0_wp, self%before + c, .true.)
         end associate
      end do
      call new_state(reference, size(structure%mesh%coordinates, 2))
      volume = self%volumes(structure, equations, reference)
      do c = 1, self%n
         associate (wall => self%wall(c), fluid => self%fluid(c))
            if (volume(c) < -1.0e-9_wp*wall%size) then
               call raise(error, status_input_error, "chamber '"//fluid%name//"': its volume in the reference state is " &
                  //text_of(volume(c))//': the normals of the elements point into it; give the set as `inward`')
               return
            end if
            ! of a flat bag the rounding of its volume is no fluid
            wall%filled = volume(c) + fluid%rigid
            if (wall%filled < 1.0e-12_wp*wall%size) wall%filled = 0
            if (wall%filled > 0 .or. .not. can_hold(fluid)) cycle
            call raise(error, status_input_error, "chamber '"//fluid%name//"': it is flat and empty, so that its pressure is not " &
               //'defined; a rigid_volume is expected, as of the pipe that fills it')
            return
         end associate
      end do
   end subroutine new_chambers

   !> Volume of the sphere with this surface.
   pure real(wp) function sphere_of(area) result(volume)
      real(wp), intent(in) :: area
      volume = sqrt(area**3/(36*acos(-1.0_wp)))
   end function sphere_of

   !> Elements of sets, each once.
   subroutine members(mesh, name, sets, elements, error)
      type(mesh_t), intent(in) :: mesh
      character(len=*), intent(in) :: name !< of the chamber
      type(name_t), intent(in), allocatable :: sets(:)
      integer, allocatable, intent(out) :: elements(:)
      type(error_t), allocatable, intent(inout) :: error
      logical, allocatable :: member(:)
      integer :: at, i
      allocate (member(size(mesh%triangles, 2)), source=.false.)
      if (allocated(sets)) then
         do i = 1, size(sets)
            at = find_element_set(mesh, sets(i)%text)
            if (at == 0) then
               if (.not. allocated(error)) call raise(error, status_input_error, "chamber '"//name &
                  //"': the mesh has no element set '"//sets(i)%text//"'; it has: "//element_set_names(mesh))
            else
               member(mesh%element_sets(at)%members) = .true.
            end if
         end do
      end if
      elements = pack([(i, i=1, size(member))], member)
   end subroutine members

   !> Volumes between the walls, (n).
   function volumes(self, structure, equations, state)
      class(chambers_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp) :: volumes(self%n)
      integer :: c
      do c = 1, self%n
         associate (wall => self%wall(c))
            volumes(c) = volume_behind(structure, wall%outward, wall%curved_outward, wall%origin, state, equations%held)
            if (size(wall%inward) > 0) volumes(c) = volumes(c) &
               - volume_behind(structure, wall%inward, wall%curved_inward, wall%origin, state, equations%held)
         end associate
      end do
   end function volumes

   !> Amounts of the fluids, (n), by the volumes that they take at a pressure of 0.
   pure function amounts(self, state)
      class(chambers_t), intent(in) :: self
      type(state_t), intent(in) :: state
      real(wp) :: amounts(self%n)
      integer :: c
      amounts = [(self%wall(c)%filled + factor_at(state, self%fluid(c)%scaling)*self%fluid(c)%inflow, c=1, self%n)]
   end function amounts

   !> Pressures, (n), over the one outside.
   pure function pressures(self, state)
      class(chambers_t), intent(in) :: self
      type(state_t), intent(in) :: state
      real(wp) :: pressures(self%n)
      integer :: c
      pressures = [(factor_at(state, self%before + c), c=1, self%n)]
   end function pressures

   !> Do all fluids have a pressure for every volume?
   pure logical function yields(self)
      class(chambers_t), intent(in) :: self
      yields = .true.
      if (self%n > 0) yields = all(can_hold(self%fluid))
   end function yields

   !> How far the fluids are from filling their chambers. Error (recoverable): more has been taken out than there was.
   subroutine equilibrium(self, structure, equations, state, residual, misfit, error)
      class(chambers_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: residual(:) !< (n) volume between the walls less that of the fluid
      real(wp), intent(out) :: misfit !< the largest one, relative
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: amount(:), volume(:)
      integer :: c
      misfit = 0
      if (self%n == 0) return
      amount = self%amounts(state)
      do c = 1, self%n
         if (amount(c) >= 0) cycle
         residual = 0
         call raise_empty(self%fluid(c)%name, error)
         return
      end do
      volume = self%volumes(structure, equations, state)
      residual = volume - room_for(self%fluid, amount, self%pressures(state))
      misfit = maxval(abs(residual)/(self%wall%size + abs(volume)))
   end subroutine equilibrium

   subroutine raise_empty(name, error)
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(inout) :: error
      if (.not. allocated(error)) call raise(error, status_not_converged, "chamber '"//name &
         //"': more would be taken out than there is in it")
   end subroutine raise_empty

   !> The derivatives of these equations.
   pure subroutine linearise(self, equations, state, active, unit_force, gradient, compliance, inflow, rate)
      class(chambers_t), intent(in) :: self
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      integer, intent(in) :: active !< factor that changes
      real(wp), intent(in) :: unit_force(:, :, :) !< (n_nodal, nodes, factors) forces of all loads for factors of 1
      real(wp), allocatable, intent(inout) :: gradient(:, :) !< (equations, n) of the volumes; unallocated where there are none
      real(wp), allocatable, intent(inout) :: compliance(:) !< (n)
      real(wp), allocatable, intent(inout) :: inflow(:) !< (n) growth of the fluids with the factor, at their pressures
      real(wp), intent(inout) :: rate(:) !< (n) derivatives of the residuals with respect to the factor
      real(wp) :: pressure(self%n), amount(self%n)
      real(wp), allocatable :: folded(:, :)
      integer :: c, i
      if (self%n == 0) return
      if (.not. allocated(gradient)) allocate (gradient(equations%n, self%n), compliance(self%n), inflow(self%n))
      pressure = self%pressures(state)
      amount = self%amounts(state)
      do c = 1, self%n
         associate (fluid => self%fluid(c), force => unit_force(:, :, self%before + c))
            compliance(c) = compliance_at(fluid, amount(c), pressure(c))
            inflow(c) = slope_of(state, active, fluid%scaling)*(room_for(fluid, fluid%inflow, pressure(c)) + fluid%rigid)
            call gather(equations, force, gradient(:, c))
            rate(c) = -inflow(c)
            if (size(equations%moved) > 0) folded = equations%links%folded(force)
            do i = 1, size(equations%moved)
               rate(c) = rate(c) + dot_product(folded(:, equations%moved(i)), motion_at(equations, i, active, state))
            end do
         end associate
      end do
   end subroutine linearise

   !> Set the pressures of fluids that yield by their volumes. Error (recoverable): a chamber that is empty or inside out.
   subroutine follow(self, structure, equations, state, error)
      class(chambers_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(inout) :: state
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: amount(:), volume(:)
      integer :: c
      amount = self%amounts(state)
      volume = self%volumes(structure, equations, state)
      do c = 1, self%n
         if (.not. can_hold(self%fluid(c))) cycle
         if (volume(c) + self%fluid(c)%rigid > 0 .and. amount(c) > 0) then
            state%case_factor(self%before - by_case + c) = pressure_in(self%fluid(c), amount(c), volume(c))
         else if (amount(c) <= 0) then
            call raise_empty(self%fluid(c)%name, error)
         else if (.not. allocated(error)) then
            call raise(error, status_not_converged, "chamber '"//self%fluid(c)%name//"': there is no room left in it")
         end if
      end do
   end subroutine follow

   !> Add corrections to the pressures.
   pure subroutine move(self, state, step, linear)
      class(chambers_t), intent(in) :: self
      type(state_t), intent(inout) :: state
      real(wp), intent(in) :: step(:) !< (n)
      logical, intent(in), optional :: linear !< whatever the fluid
      if (self%n == 0) return
      associate (first => self%before - by_case + 1)
         if (present(linear)) then
            state%case_factor(first:) = state%case_factor(first:) + step
         else
            state%case_factor(first:) = pressure_after(self%fluid, state%case_factor(first:), step)
         end if
      end associate
   end subroutine move

   !> The corrections that lead from the pressures of one state to those of another.
   pure function moved(self, from, to) result(step)
      class(chambers_t), intent(in) :: self
      type(state_t), intent(in) :: from, to
      real(wp) :: step(self%n)
      if (self%n > 0) step = pressure_step(self%fluid, self%pressures(from), self%pressures(to))
   end function moved

   !> The pressure after a correction: a gas keeps an absolute pressure above zero, its volume falling at most by what it is.
   elemental real(wp) function pressure_after(fluid, pressure, step) result(after)
      type(chamber_t), intent(in) :: fluid
      real(wp), intent(in) :: pressure, step
      real(wp) :: absolute
      after = pressure + step
      if (.not. fluid%gas .or. step >= 0) return
      absolute = fluid%ambient + pressure
      after = pressure + step*(absolute/(absolute - step))
   end function pressure_after

   !> The correction that leads from one pressure to another.
   elemental real(wp) function pressure_step(fluid, from, to) result(step)
      type(chamber_t), intent(in) :: fluid
      real(wp), intent(in) :: from, to
      step = to - from
      if (.not. fluid%gas .or. step >= 0) return
      step = step*((fluid%ambient + from)/(fluid%ambient + to))
   end function pressure_step
end module finshell_chambers
