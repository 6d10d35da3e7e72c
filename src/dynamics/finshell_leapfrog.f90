!> Central differences over nodes: velocities at half increments, displacements and rotations at whole ones.
!>
!> At increment n, with h- and h+ the increments before and after it, a the forces over the masses and c the damping:
!>
!>     v_n = (v_{n-1/2} + a h-/2)/(1 + c h-/2)      v_{n+1/2} = v_n (1 - c h+/2) + a h+/2
!>     u_{n+1} = u_n + h+ v_{n+1/2}                 R_{n+1} = exp(h+ w_{n+1/2}) R_n
!>
!> The mean velocity in the damping keeps the largest stable increment that of the undamped structure. Lumped rotatory inertia is
!> the same about all axes, so spins w obey the same equation in axes fixed in space, and x_{n+1} - x_n is along v_{n+1/2}: momentum
!> and angular momentum are those of the forces to rounding.
!>
!> Supports: no equation, no velocity. Moved ones have their motion beside (`drive`), since it is prescribed.
module finshell_leapfrog
   use finshell_equations, only: equations_t
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_kinds, only: wp
   use finshell_memo, only: memo_t
   use finshell_quaternion, only: quaternion_product, update_quaternion
   use finshell_state, only: state_t
   implicit none
   private
   public :: leapfrog_t, new_leapfrog, sums_t

   type :: leapfrog_t
      real(wp), allocatable :: mass(:, :) !< (n_nodal, nodes)
      real(wp), allocatable :: velocity(:, :) !< (n_nodal, nodes) and spin, half an increment back, but for `drive`
      real(wp), allocatable :: drive(:, :) !< (n_nodal, moved) prescribed, half an increment back
      real(wp) :: before = 0 !< the increment before
      real(wp) :: damping = 0 !< times the masses, 1/time
      !> Where the last increment began: kinetic energy of the velocities before and after it (what the scheme keeps, see
      !> `sums_t`), and work of loads and moved supports.
      real(wp) :: kinetic = 0, work = 0
      real(wp), private :: work_after = 0, damped_after = 0 ! up to its middle
      real(wp), allocatable, private :: inverse(:, :) ! (n_nodal, nodes) of the masses, 0 where held
      integer, allocatable, private :: framed(:) ! nodes with axes of their own and something held
      real(wp), allocatable, private :: free(:, :, :, :) ! (3, 3, displacement or rotation, framed) projections on what is free
      real(wp), allocatable, private :: sums(:, :) ! (n_sums, blocks)
   contains
      procedure :: advance
      procedure :: whole
      procedure :: square_of_jump
      procedure :: driven
      procedure :: without_held
      procedure :: over_root_mass
      procedure :: carry
      procedure, private :: take_reactions
   end type leapfrog_t

   !> Sums over all nodes at a whole increment, since the start.
   type :: sums_t
      real(wp) :: kinetic = 0, work = 0, damped = 0
      !> What equal increments h keep constant is the kinetic energy of v_{n-1/2} and v_{n+1/2}, less than that of v_n by h^2 times
      !> this.
      real(wp) :: ripple = 0
   end type sums_t

   integer, parameter :: at_work_before = 1, at_work_after = 2, at_damping = 3, at_kinetic = 4, at_kept = 5
   integer, parameter :: n_sums = at_kept

   !> Nodes of a block: partial sums are those of blocks, whatever the threads.
   integer, parameter :: block_size = 256

contains

   !> Start from the velocities of a state.
   subroutine new_leapfrog(self, equations, state, mass, damping)
      type(leapfrog_t), intent(out) :: self
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: mass(:, :), damping
      real(wp) :: axes(3, 3, 2)
      integer :: i, k
      self%mass = mass
      self%damping = damping
      self%velocity = state%velocity
      allocate (self%inverse, mold=mass)
      where (mass > 0)
         self%inverse = 1/mass
      else where
         self%inverse = 0
      end where
      self%framed = pack([(i, i=1, size(mass, 2))], equations%frame > 0)
      where (spread(equations%frame == 0, 1, n_nodal) .and. equations%number == 0)
         self%inverse = 0
         self%velocity = 0
      end where
      allocate (self%free(3, 3, 2, size(self%framed)))
      do i = 1, size(self%framed)
         associate (node => self%framed(i))
            axes = spread(equations%frames(:, :, equations%frame(node)), 3, 2)
            do k = 1, 3
               if (equations%number(k, node) == 0) axes(:, k, 1) = 0
               if (equations%number(uz + k, node) == 0) axes(:, k, 2) = 0
            end do
            self%free(:, :, 1, i) = matmul(axes(:, :, 1), transpose(axes(:, :, 1)))
            self%free(:, :, 2, i) = matmul(axes(:, :, 2), transpose(axes(:, :, 2)))
            self%velocity(:, node) = projected(self%free(:, :, :, i), self%velocity(:, node))
         end associate
      end do
      allocate (self%drive(n_nodal, size(equations%moved)), source=0.0_wp)
      allocate (self%sums(n_sums, (size(mass, 2) + block_size - 1)/block_size))
   end subroutine new_leapfrog

   !> For a run that goes on, from `new_leapfrog` on.
   subroutine carry(self, memo)
      class(leapfrog_t), intent(inout) :: self
      type(memo_t), intent(inout) :: memo
      call memo%carry(self%velocity)
      call memo%carry(self%drive)
      call memo%carry(self%before)
      call memo%carry(self%kinetic)
      call memo%carry(self%work)
      call memo%carry(self%work_after)
      call memo%carry(self%damped_after)
   end subroutine carry

   !> Velocities and spins half an increment back, with what is prescribed.
   pure function driven(self, equations) result(velocity)
      class(leapfrog_t), intent(in) :: self
      type(equations_t), intent(in) :: equations
      real(wp) :: velocity(n_nodal, size(self%velocity, 2))
      velocity = self%velocity
      velocity(:, equations%moved) = velocity(:, equations%moved) + self%drive
   end function driven

   !> Nodal vectors without what supports hold.
   pure function without_held(self, nodal) result(part)
      class(leapfrog_t), intent(in) :: self
      real(wp), intent(in) :: nodal(:, :) !< (n_nodal, nodes)
      real(wp) :: part(size(nodal, 1), size(nodal, 2))
      integer :: i
      part = merge(nodal, 0.0_wp, self%inverse > 0)
      do i = 1, size(self%framed)
         part(:, self%framed(i)) = projected(self%free(:, :, :, i), nodal(:, self%framed(i)))
      end do
   end function without_held

   !> Forces, or vectors of M^1/2 times motions, over the roots of the masses; 0 where held.
   pure function over_root_mass(self, nodal) result(vector)
      class(leapfrog_t), intent(in) :: self
      real(wp), intent(in) :: nodal(:, :) !< (n_nodal, nodes)
      real(wp) :: vector(size(nodal, 1), size(nodal, 2))
      vector = self%without_held(sqrt(self%inverse)*nodal)
   end function over_root_mass

   !> A nodal vector without what is held.
   pure function projected(free, vector) result(part)
      real(wp), intent(in) :: free(3, 3, 2), vector(n_nodal)
      real(wp) :: part(n_nodal)
      part(ux:uz) = matmul(free(:, :, 1), vector(ux:uz))
      part(rx:rz) = matmul(free(:, :, 2), vector(rx:rz))
   end function projected

   !> One increment of length `after` from a whole one to the next.
   subroutine advance(self, equations, state, internal, external, after, drive, turned, threads)
      class(leapfrog_t), intent(inout) :: self
      type(equations_t), intent(in) :: equations
      type(state_t), intent(inout) :: state
      real(wp), intent(inout), contiguous :: internal(:, :) !< (n_nodal, nodes); at nodes with axes reactions are taken out
      real(wp), intent(in), contiguous :: external(:, :)
      real(wp), intent(in) :: after
      real(wp), intent(in) :: drive(:, :) !< (n_nodal, moved) prescribed velocities and spins of the increment
      real(wp), intent(in) :: turned(:, :) !< (4, moved) quaternions at its end where all rotations are prescribed
      integer, intent(in) :: threads
      real(wp) :: rotations(4, size(equations%moved)), driven(n_sums)
      integer :: b, i

      driven = 0
      do i = 1, size(equations%moved)
         rotations(:, i) = state%rotation(:, equations%moved(i))
         driven = driven + sums_of_driven(self, i, equations%moved(i), internal(:, equations%moved(i)), after, drive(:, i))
      end do
      call self%take_reactions(internal, external)
      !$omp parallel do schedule(static) num_threads(threads) default(shared)
      do b = 1, size(self%sums, 2)
         call advance_block(block_size*(b - 1) + 1, min(block_size*b, size(internal, 2)), self%before, after, self%damping, &
                            internal, external, self%mass, self%inverse, self%velocity, state%displacement, state%rotation, &
                            self%sums(:, b))
      end do
      !$omp end parallel do
      do i = 1, size(equations%moved)
         associate (node => equations%moved(i), next => drive(:, i))
            state%displacement(:, node) = state%displacement(:, node) + after*next(ux:uz)
            if (equations%turned(i)) then
               state%rotation(:, node) = turned(:, i)
            else if (any(abs(next(rx:rz)) > 0)) then
               state%rotation(:, node) = update_quaternion(rotations(:, i), after*(self%velocity(rx:rz, node) + next(rx:rz)))
            end if
         end associate
      end do
      driven = driven + sum(self%sums, dim=2)
      self%kinetic = driven(at_kept)
      self%work = self%work_after + driven(at_work_before)
      self%work_after = self%work + driven(at_work_after)
      self%damped_after = self%damped_after + driven(at_damping)*(self%before + after)
      self%drive = drive
      self%before = after
   end subroutine advance

   !> Forces at nodes with axes without what supports take.
   subroutine take_reactions(self, internal, external)
      class(leapfrog_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: internal(:, :)
      real(wp), intent(in), contiguous :: external(:, :)
      integer :: i
      do i = 1, size(self%framed)
         associate (node => self%framed(i))
            internal(:, node) = external(:, node) + projected(self%free(:, :, :, i), internal(:, node) - external(:, node))
         end associate
      end do
   end subroutine take_reactions

   !> What prescribed motion adds to the sums over nodes: work of its supports and loads, kinetic energy, damping.
   pure function sums_of_driven(self, i, node, internal, after, next) result(sums)
      type(leapfrog_t), intent(in) :: self
      integer, intent(in) :: i, node
      real(wp), intent(in) :: internal(n_nodal), after, next(n_nodal)
      real(wp) :: sums(n_sums), force(n_nodal), mean(n_nodal)
      associate (mass => self%mass(:, node), last => self%drive(:, i))
         mean = (after*last + self%before*next)/(self%before + after)
         force = internal + mass*((next - last)/(0.5_wp*(self%before + after)) + self%damping*mean)
         sums(at_work_before) = 0.5_wp*self%before*dot_product(force, last)
         sums(at_work_after) = 0.5_wp*after*dot_product(force, next)
         sums(at_damping) = 0.5_wp*self%damping*sum(mass*mean**2)
         sums(at_kinetic) = 0.5_wp*sum(mass*mean**2)
         sums(at_kept) = 0.5_wp*sum(mass*last*next)
      end associate
   end function sums_of_driven

   !> Twice the kinetic energy of a difference to the prescribed velocities.
   pure real(wp) function square_of_jump(self, equations, drive) result(square)
      class(leapfrog_t), intent(in) :: self
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: drive(:, :) !< (n_nodal, moved)
      integer :: i
      square = 0
      do i = 1, size(drive, 2)
         square = square + sum(self%mass(:, equations%moved(i))*(drive(:, i) - self%drive(:, i))**2)
      end do
   end function square_of_jump

   !> Some nodes, and their sums.
   pure subroutine advance_block(first, last, before, after, damping, internal, external, mass, inverse, velocity, displacement, &
                                 rotation, sums)
      integer, intent(in) :: first, last
      real(wp), intent(in) :: before, after, damping
      real(wp), intent(in), contiguous :: internal(:, :), external(:, :), mass(:, :), inverse(:, :)
      real(wp), intent(inout), contiguous :: velocity(:, :), displacement(:, :), rotation(:, :)
      real(wp), intent(out) :: sums(n_sums)
      real(wp) :: a(n_nodal), v(n_nodal), next(n_nodal), to_whole, from_whole
      integer :: i
      to_whole = 1/(1 + 0.5_wp*damping*before)
      from_whole = 1 - 0.5_wp*damping*after
      sums = 0
      do i = first, last
         a = (external(:, i) - internal(:, i))*inverse(:, i)
         v = (velocity(:, i) + (0.5_wp*before)*a)*to_whole
         next = v*from_whole + (0.5_wp*after)*a
         sums(at_work_before) = sums(at_work_before) + sum(external(:, i)*velocity(:, i))
         sums(at_work_after) = sums(at_work_after) + sum(external(:, i)*next)
         sums(at_kinetic) = sums(at_kinetic) + sum(mass(:, i)*v**2)
         sums(at_kept) = sums(at_kept) + sum(mass(:, i)*velocity(:, i)*next)
         velocity(:, i) = next
         displacement(:, i) = displacement(:, i) + after*next(ux:uz)
         call turn(rotation(:, i), (0.5_wp*after)*next(rx:rz))
      end do
      sums(at_kinetic) = 0.5_wp*sums(at_kinetic)
      sums(at_kept) = 0.5_wp*sums(at_kept)
      sums(at_damping) = damping*sums(at_kinetic)
      sums(at_work_before) = 0.5_wp*before*sums(at_work_before)
      sums(at_work_after) = 0.5_wp*after*sums(at_work_after)
   end subroutine advance_block

   !> exp(2 half) q. Increments turn nodes by little: a series then, and one step of Newton for the length.
   pure subroutine turn(q, half)
      real(wp), intent(inout) :: q(4)
      real(wp), intent(in) :: half(3)
      real(wp), parameter :: small = 0.04_wp ! x**12/12! is below rounding
      real(wp) :: p(4), x
      x = half(1)**2 + half(2)**2 + half(3)**2
      if (.not. x > 0) return
      if (x > small) then
         q = update_quaternion(q, 2*half)
         return
      end if
      p(1) = 1 - x/2*(1 - x/12*(1 - x/30*(1 - x/56*(1 - x/90))))
      p(2:4) = (1 - x/6*(1 - x/20*(1 - x/42*(1 - x/72*(1 - x/110)))))*half
      p = quaternion_product(p, q)
      q = (1.5_wp - 0.5_wp*(p(1)**2 + p(2)**2 + p(3)**2 + p(4)**2))*p
   end subroutine turn

   !> Rates of a state at a whole increment, to be told: nothing is changed for `advance`.
   subroutine whole(self, equations, state, internal, external, drive, sums)
      class(leapfrog_t), intent(in) :: self
      type(equations_t), intent(in) :: equations
      type(state_t), intent(inout) :: state !< velocity and acceleration are set
      real(wp), intent(in), contiguous :: internal(:, :), external(:, :) !< (n_nodal, nodes)
      real(wp), intent(in) :: drive(:, :) !< (n_nodal, moved) prescribed velocities and spins of the next increment
      type(sums_t), intent(out) :: sums
      real(wp) :: a(n_nodal), driven(n_sums), load
      integer :: i
      state%acceleration = external - internal
      do i = 1, size(self%framed)
         associate (node => self%framed(i))
            state%acceleration(:, node) = projected(self%free(:, :, :, i), state%acceleration(:, node))
         end associate
      end do
      driven = 0
      load = 0
      do i = 1, size(self%mass, 2)
         a = state%acceleration(:, i)*self%inverse(:, i)
         state%velocity(:, i) = (self%velocity(:, i) + (0.5_wp*self%before)*a)/(1 + 0.5_wp*self%damping*self%before)
         state%acceleration(:, i) = a - self%damping*state%velocity(:, i)
         sums%ripple = sums%ripple + 0.125_wp*sum(self%mass(:, i)*a**2)
         load = load + 0.5_wp*self%before*dot_product(external(:, i), self%velocity(:, i))
      end do
      sums%kinetic = 0.5_wp*sum(self%mass*state%velocity**2)
      do i = 1, size(equations%moved)
         associate (node => equations%moved(i))
            if (self%before > 0) driven = driven + sums_of_driven(self, i, node, internal(:, node), self%before, drive(:, i))
            state%velocity(:, node) = state%velocity(:, node) + 0.5_wp*(self%drive(:, i) + drive(:, i))
            if (.not. self%before > 0) cycle
            a = (drive(:, i) - self%drive(:, i))/self%before
            state%acceleration(:, node) = state%acceleration(:, node) + a
            sums%ripple = sums%ripple + 0.125_wp*sum(self%mass(:, node)*a**2)
         end associate
      end do
      sums%work = self%work_after + load + driven(at_work_before)
      sums%damped = self%damped_after + self%before*(self%damping*sums%kinetic + driven(at_damping))
      sums%kinetic = sums%kinetic + driven(at_kinetic)
      if (self%before > 0) return
      do i = 1, size(equations%moved)
         sums%kinetic = sums%kinetic + 0.5_wp*sum(self%mass(:, equations%moved(i))*drive(:, i)**2)
      end do
   end subroutine whole
end module finshell_leapfrog
