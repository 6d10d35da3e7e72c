!> Components of nodes that depend on those of others, and have no equation therefore: motions and forces between the two.
!>
!> A row says what a dependent component is, to first order, as a sum over others, in global axes. Rows of linear equations are
!> constant and come first. Those of joints (finshell_joint) go with the state: `refresh` them before they are used, `settle` sets
!> a state exactly. A row may depend on rows before it.
module finshell_links
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_interpolated_rotation, only: interpolated, n_spins, second_spins, spin_operators
   use finshell_joint, only: joint_t
   use finshell_kinds, only: wp
   use finshell_quaternion, only: quaternion_to_matrix
   use finshell_rotation, only: cross_product, spin
   use finshell_state, only: moved_state, state_t
   implicit none
   private
   public :: links_t, add_rows, forces_at_joints

   type :: links_t
      integer, allocatable :: row(:, :) !< (n_nodal, nodes) of a dependent component, 0: not dependent. Unallocated: no links
      integer, allocatable :: node(:), component(:) !< (rows) what depends
      integer, allocatable :: first(:) !< (rows + 1) entries of a row
      integer, allocatable :: master(:), along(:) !< (entries) node and component
      real(wp), allocatable :: coefficient(:) !< (entries)
      type(joint_t), allocatable :: joints(:)
      integer, allocatable :: joint_row(:) !< (joints) first row of each
      integer :: linear = 0 !< rows of linear equations
      character(len=:), allocatable :: redundant !< which equations say what others say already, for a warning
   contains
      procedure :: any => any_links
      procedure :: depends
      procedure :: refresh
      procedure :: settle
      procedure :: extend
      procedure :: turning_rates
      procedure :: fold
      procedure :: folded
      procedure :: hessian
      procedure :: turn_arms
   end type links_t

contains

   pure logical function any_links(self)
      class(links_t), intent(in) :: self
      any_links = allocated(self%row)
   end function any_links

   pure logical function depends(self, component, node)
      class(links_t), intent(in) :: self
      integer, intent(in) :: component, node
      depends = .false.
      if (allocated(self%row)) depends = self%row(component, node) > 0
   end function depends

   !> Append the rows of joints, with room for their coefficients. A joint may depend on those before it.
   subroutine add_rows(self, joints)
      type(links_t), intent(inout) :: self
      type(joint_t), intent(in) :: joints(:)
      integer :: c, entries, i, j, k, r, rows
      rows = size(self%node)
      entries = size(self%master)
      r = rows
      do j = 1, size(joints)
         associate (each => joints(j))
            rows = rows + merge(n_nodal, uz, each%turns)
            entries = entries + uz*each%masters
            if (each%on_arm) entries = entries + merge(2*uz, uz**2*each%masters, each%masters == 1)
            if (each%turns) entries = entries + merge(uz, uz**2*each%masters, each%masters == 1)
         end associate
      end do
      self%node = [self%node, [(0, i=r + 1, rows)]]
      self%component = [self%component, [(0, i=r + 1, rows)]]
      self%first = [self%first, [(0, i=r + 1, rows)]]
      i = size(self%master)
      self%master = [self%master, [(0, k=i + 1, entries)]]
      self%along = [self%along, [(0, k=i + 1, entries)]]
      self%coefficient = [self%coefficient, [(0.0_wp, k=i + 1, entries)]]
      entries = i
      allocate (self%joint_row(size(joints)))
      self%joints = joints
      do j = 1, size(joints)
         self%joint_row(j) = r + 1
         do c = 1, merge(n_nodal, uz, joints(j)%turns)
            r = r + 1
            self%node(r) = joints(j)%node
            self%component(r) = c
            self%row(c, joints(j)%node) = r
            call add_entries(joints(j))
            self%first(r + 1) = entries + 1
         end do
      end do

   contains

      subroutine add_entries(joint)
         type(joint_t), intent(in) :: joint
         integer :: m, n
         do m = 1, joint%masters
            if (c <= uz) call add_entry(joint%master(m), c)
            if (c <= uz .and. .not. joint%on_arm) cycle
            do n = rx, rz
               ! of a single master: w x a along c has no part of w along c, and the rotation along c is w along c
               if (joint%masters == 1 .and. merge(n - uz == c, n /= c, c <= uz)) cycle
               call add_entry(joint%master(m), n)
            end do
         end do
      end subroutine add_entries

      subroutine add_entry(node, component)
         integer, intent(in) :: node, component
         entries = entries + 1
         self%master(entries) = node
         self%along(entries) = component
      end subroutine add_entry
   end subroutine add_rows

   !> The rows of the joints at a state.
   pure subroutine refresh(self, state)
      class(links_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      real(wp) :: b(3, 3, 3), lever(3, 3)
      integer :: c, e, i, j, k, r
      if (.not. allocated(self%row)) return
      do j = 1, size(self%joints)
         associate (joint => self%joints(j))
            b = operators(joint, state)
            lever = 0
            if (joint%on_arm) lever = -spin(arm_at(joint, state))
            do r = self%joint_row(j), self%joint_row(j) + merge(n_nodal, uz, joint%turns) - 1
               c = self%component(r)
               do e = self%first(r), self%first(r + 1) - 1
                  i = findloc(joint%master(:joint%masters), self%master(e), dim=1)
                  k = self%along(e)
                  if (k <= uz) then
                     self%coefficient(e) = joint%weight(i)
                  else if (c <= uz) then
                     self%coefficient(e) = dot_product(lever(c, :), b(:, k - uz, i))
                  else
                     self%coefficient(e) = b(c - uz, k - uz, i)
                  end if
               end do
            end do
         end associate
      end do
   end subroutine refresh

   !> Put dependent nodes where the others have them.
   pure subroutine settle(self, state)
      class(links_t), intent(in) :: self
      type(state_t), intent(inout) :: state
      real(wp) :: value
      integer :: e, i, j, r
      if (.not. allocated(self%row)) return
      do r = 1, self%linear
         value = 0
         do e = self%first(r), self%first(r + 1) - 1
            value = value + self%coefficient(e)*state%displacement(self%along(e), self%master(e))
         end do
         state%displacement(self%component(r), self%node(r)) = value
      end do
      do j = 1, size(self%joints)
         associate (joint => self%joints(j), u => state%displacement)
            u(:, joint%node) = 0
            do i = 1, joint%masters
               u(:, joint%node) = u(:, joint%node) + joint%weight(i)*u(:, joint%master(i))
            end do
            if (joint%on_arm) u(:, joint%node) = u(:, joint%node) + (arm_at(joint, state) - joint%arm)
            if (joint%turns) state%rotation(:, joint%node) = rotation_of(joint, state)
         end associate
      end do
   end subroutine settle

   !> Dependent components of a motion, from the others.
   pure subroutine extend(self, motion)
      class(links_t), intent(in) :: self
      real(wp), intent(inout) :: motion(:, :) !< (n_nodal, nodes)
      real(wp) :: value
      integer :: e, r
      if (.not. allocated(self%row)) return
      do r = 1, size(self%node)
         value = 0
         do e = self%first(r), self%first(r + 1) - 1
            value = value + self%coefficient(e)*motion(self%along(e), self%master(e))
         end do
         motion(self%component(r), self%node(r)) = value
      end do
   end subroutine extend

   !> Accelerations of dependent components while what they depend on has none: rates of their rows, by differences of the second
   !> order, which leave 1e-10 of them.
   function turning_rates(self, state, velocity) result(rates)
      class(links_t), intent(in) :: self
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: velocity(:, :) !< (n_nodal, nodes)
      real(wp), allocatable :: rates(:, :) !< (n_nodal, nodes)
      real(wp), parameter :: small_turn = 1.0e-5_wp
      real(wp), allocatable :: back(:, :)
      type(links_t) :: near
      type(state_t) :: moved
      real(wp) :: h
      allocate (rates(size(velocity, 1), size(velocity, 2)), source=0.0_wp)
      if (.not. allocated(self%row)) return
      h = maxval(abs(velocity(rx:rz, :)))
      if (.not. h > 0) return
      h = small_turn/h
      near = self
      rates = velocity
      back = velocity
      moved = moved_state(state, velocity, h)
      call near%settle(moved)
      call near%refresh(moved)
      call near%extend(rates)
      moved = moved_state(state, velocity, -h)
      call near%settle(moved)
      call near%refresh(moved)
      call near%extend(back)
      rates = merge((rates - back)/(2*h), 0.0_wp, self%row > 0)
   end function turning_rates

   !> Take forces on dependent components to what they depend on; the work in any motion stays the same.
   pure subroutine fold(self, force)
      class(links_t), intent(in) :: self
      real(wp), intent(inout) :: force(:, :) !< (n_nodal, nodes)
      integer :: e, r
      if (.not. allocated(self%row)) return
      do r = size(self%node), 1, -1
         associate (f => force(self%component(r), self%node(r)))
            do e = self%first(r), self%first(r + 1) - 1
               force(self%along(e), self%master(e)) = force(self%along(e), self%master(e)) + self%coefficient(e)*f
            end do
            f = 0
         end associate
      end do
   end subroutine fold

   pure function folded(self, force) result(all)
      class(links_t), intent(in) :: self
      real(wp), intent(in) :: force(:, :) !< (n_nodal, nodes)
      real(wp), allocatable :: all(:, :)
      all = force
      call self%fold(all)
   end function folded

   !> Stiffness of a joint: second derivatives of the work of forces on the dependent node, along exp(spin) R of the masters.
   !>
   !> With the arm a and a spin w of R, x goes by w x a + w x (w x a)/2: f . of the second gives ((f.w)(a.w) - (f.a)(w.w))/2. What
   !> w itself is to second order, of interpolated rotations, works on the moment about them.
   pure subroutine hessian(self, j, state, force, matrix)
      class(links_t), intent(in) :: self
      integer, intent(in) :: j !< joint
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: force(:) !< (n_nodal) on the dependent node: internal minus external
      real(wp), intent(out) :: matrix(:, :) !< (n_nodal*masters, n_nodal*masters)
      real(wp) :: a(3), m(3), s(3, 3), b(3, n_spins), h(n_spins, n_spins)
      integer :: at(n_spins), i, k
      matrix = 0
      associate (joint => self%joints(j))
         s = 0
         m = 0
         if (joint%on_arm) then
            a = arm_at(joint, state)
            do i = 1, 3
               s(:, i) = 0.5_wp*(force(ux:uz)*a(i) + a*force(i))
               s(i, i) = s(i, i) - dot_product(a, force(ux:uz))
            end do
            m = cross_product(a, force(ux:uz))
         end if
         if (joint%masters == 1) then
            matrix(rx:rz, rx:rz) = s
            return
         end if
         if (.not. joint%on_arm .and. .not. joint%turns) return
         if (joint%turns) m = m + force(rx:rz)
         at = [((n_nodal*(i - 1) + k, k=rx, rz), i=1, 3)]
         b = reshape(operators(joint, state), [3, n_spins])
         h = matmul(transpose(b), matmul(s, b))
         if (any(abs(m) > 0)) h = h + second_spins(joint%weight, state%rotation(:, joint%master), m)
         matrix(at, at) = h
      end associate
   end subroutine hessian

   !> Change of the folded forces because arms turn, on the masters. Forces: internal minus external, folded up to the joint.
   pure subroutine turn_arms(self, state, force, motion, change)
      class(links_t), intent(in) :: self
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: force(:, :) !< (n_nodal, nodes) internal minus external, before folding
      real(wp), intent(in) :: motion(:, :) !< (n_nodal, nodes)
      real(wp), intent(inout) :: change(:, :) !< (n_nodal, nodes)
      real(wp) :: matrix(3*n_nodal, 3*n_nodal), m(3)
      real(wp), allocatable :: at_joints(:, :)
      integer :: i, j, n
      if (.not. allocated(self%row)) return
      at_joints = forces_at_joints(self, force)
      do j = 1, size(self%joints)
         associate (joint => self%joints(j))
            n = n_nodal*joint%masters
            if (.not. any(abs(motion(rx:rz, joint%master(:joint%masters))) > 0)) cycle
            call self%hessian(j, state, at_joints(:, j), matrix(:n, :n))
            associate (nodes => joint%master(:joint%masters))
               change(:, nodes) = change(:, nodes) + reshape(matmul(matrix(:n, :n), reshape(motion(:, nodes), [n])), &
                                                             [n_nodal, joint%masters])
            end associate
            if (joint%masters > 1 .or. .not. joint%on_arm) cycle
            i = joint%master(1)
            m = cross_product(arm_at(joint, state), at_joints(ux:uz, j))
            change(rx:rz, i) = change(rx:rz, i) - 0.5_wp*cross_product(m, motion(rx:rz, i))
         end associate
      end do
   end subroutine turn_arms

   !> (n_nodal, joints) Forces on the dependent node of each joint, with those of the nodes that depend on it.
   pure function forces_at_joints(self, force) result(at)
      type(links_t), intent(in) :: self
      real(wp), intent(in) :: force(:, :)
      real(wp) :: at(n_nodal, size(self%joints))
      real(wp), allocatable :: all(:, :)
      integer :: e, j, r
      all = force
      do j = size(self%joints), 1, -1
         at(:, j) = all(:, self%joints(j)%node)
         do r = self%joint_row(j), self%joint_row(j) + merge(n_nodal, uz, self%joints(j)%turns) - 1
            do e = self%first(r), self%first(r + 1) - 1
               associate (f => all(self%along(e), self%master(e)))
                  f = f + self%coefficient(e)*all(self%component(r), self%node(r))
               end associate
            end do
         end do
      end do
   end function forces_at_joints

   pure function rotation_of(joint, state) result(q)
      type(joint_t), intent(in) :: joint
      type(state_t), intent(in) :: state
      real(wp) :: q(4)
      q = state%rotation(:, joint%master(1))
      if (joint%masters == 3) q = interpolated(joint%weight, state%rotation(:, joint%master))
   end function rotation_of

   pure function arm_at(joint, state) result(a)
      type(joint_t), intent(in) :: joint
      type(state_t), intent(in) :: state
      real(wp) :: a(3)
      a = matmul(quaternion_to_matrix(rotation_of(joint, state)), joint%arm)
   end function arm_at

   !> Spin of R per spin of each master.
   pure function operators(joint, state) result(b)
      type(joint_t), intent(in) :: joint
      type(state_t), intent(in) :: state
      real(wp) :: b(3, 3, 3)
      integer :: i
      b = 0
      if (.not. joint%on_arm .and. .not. joint%turns) return
      if (joint%masters == 3) then
         b = spin_operators(joint%weight, state%rotation(:, joint%master))
      else
         do i = 1, 3
            b(i, i, 1) = 1
         end do
      end if
   end function operators
end module finshell_links
