!> From joints to links: which components depend on which. Linear equations are solved for one component each, by elimination with
!> the largest coefficient as pivot; joints are put in an order in which each depends on those before it. What cannot be is refused
!> by name.
module finshell_link_builder
   use finshell_error, only: error_t, raise
   use finshell_freedoms, only: n_nodal, uz
   use finshell_joint, only: joint_t, joints_t, linear_equation_t
   use finshell_kinds, only: wp
   use finshell_links, only: add_rows, links_t
   use finshell_mesh, only: mesh_t, node_text
   use finshell_status, only: status_input_error
   implicit none
   private
   public :: new_links, component_names

   character(len=2), parameter :: component_names(n_nodal) = ['ux', 'uy', 'uz', 'rx', 'ry', 'rz']
   real(wp), parameter :: negligible = 1.0e-10_wp !< coefficient against the largest of an equation, and a sum against its terms

   !> u(component, node) = sum of coefficient*u(of, master)
   type :: solved_t
      integer :: node = 0, component = 0
      integer, allocatable :: master(:), of(:)
      real(wp), allocatable :: coefficient(:)
   end type solved_t

contains

   !> Build the links and take the numbers of dependent components away. Errors: components that depend twice or are held, joints in
   !> a circle, equations that contradict supports.
   subroutine new_links(self, joints, mesh, number, frame, moved, motion, error)
      type(links_t), intent(out) :: self
      type(joints_t), intent(in) :: joints
      type(mesh_t), intent(in) :: mesh
      integer, intent(inout) :: number(:, :) !< (n_nodal, nodes) 0: held, or none
      integer, intent(in) :: frame(:) !< (nodes) index of axes of its own, 0: global
      integer, intent(in) :: moved(:) !< nodes whose held components are moved
      real(wp), intent(in) :: motion(:, :, :) !< (n_nodal, moved, factors)
      type(error_t), allocatable, intent(inout) :: error
      type(joint_t), allocatable :: ordered(:)
      integer, allocatable :: joint_of(:)
      integer :: r

      if (size(joints%list) + size(joints%equations) == 0) return
      call check_joints(joints, mesh, number, joint_of, error)
      if (.not. allocated(error)) call order_joints(joints, mesh, joint_of, ordered, error)
      if (allocated(error)) return
      allocate (self%row(n_nodal, size(mesh%coordinates, 2)), source=0)
      allocate (self%node(0), self%component(0), self%master(0), self%along(0), self%coefficient(0))
      self%first = [1]
      self%redundant = ''
      call eliminate(self, joints, mesh, number, frame, joint_of, moved, motion, error)
      if (allocated(error)) return
      self%linear = size(self%node)
      call add_rows(self, ordered)
      do r = 1, size(self%node)
         number(self%component(r), self%node(r)) = 0
      end do
   end subroutine new_links

   subroutine check_joints(joints, mesh, number, joint_of, error)
      type(joints_t), intent(in) :: joints
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: number(:, :)
      integer, allocatable, intent(out) :: joint_of(:) !< (nodes) joint by which a node depends, 0: none
      type(error_t), allocatable, intent(inout) :: error
      integer :: c, j
      allocate (joint_of(size(number, 2)), source=0)
      do j = 1, size(joints%list)
         associate (joint => joints%list(j))
            if (joint_of(joint%node) > 0) then
               call raise(error, status_input_error, joints%origins(joint%origin)%text//': '//node_text(mesh, joint%node) &
                  //' depends on others already, by '//joints%origins(joints%list(joint_of(joint%node))%origin)%text &
                  //'; take it out of one of the two')
               return
            end if
            joint_of(joint%node) = j
            do c = 1, merge(n_nodal, uz, joint%turns)
               if (number(c, joint%node) > 0) cycle
               call raise(error, status_input_error, joints%origins(joint%origin)%text//': '//node_text(mesh, joint%node) &
                  //' depends on '//node_text(mesh, joint%master(1))//', and a support holds it, too ('//component_names(c) &
                  //' and maybe more); hold '//node_text(mesh, joint%master(1))//' instead, or take it out of the set')
               return
            end do
         end associate
      end do
   end subroutine check_joints

   !> Masters before those that depend on them.
   subroutine order_joints(joints, mesh, joint_of, ordered, error)
      type(joints_t), intent(in) :: joints
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: joint_of(:)
      type(joint_t), allocatable, intent(out) :: ordered(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: mark(size(joints%list)), found, j
      mark = 0
      found = 0
      allocate (ordered(size(joints%list)))
      do j = 1, size(joints%list)
         call visit(j)
         if (allocated(error)) return
      end do

   contains

      recursive subroutine visit(j)
         integer, intent(in) :: j
         integer :: i, before
         if (mark(j) == 2) return
         associate (joint => joints%list(j))
            if (mark(j) == 1) then
               if (.not. allocated(error)) call raise(error, status_input_error, joints%origins(joint%origin)%text//': ' &
                  //node_text(mesh, joint%node)//' depends on itself, by way of '//node_text(mesh, joint%master(1)) &
                  //'; let one side be the one that depends everywhere')
               return
            end if
            mark(j) = 1
            do i = 1, joint%masters
               before = joint_of(joint%master(i))
               if (before > 0) call visit(before)
               if (allocated(error)) return
            end do
            mark(j) = 2
            found = found + 1
            ordered(found) = joint
         end associate
      end subroutine visit
   end subroutine order_joints

   !> Solve the linear equations, each for one component. The last one solved depends on none of the others, so it comes first.
   subroutine eliminate(self, joints, mesh, number, frame, joint_of, moved, motion, error)
      type(links_t), intent(inout) :: self
      type(joints_t), intent(in) :: joints
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: number(:, :), frame(:), joint_of(:), moved(:)
      real(wp), intent(in) :: motion(:, :, :)
      type(error_t), allocatable, intent(inout) :: error
      type(solved_t), allocatable :: solved(:)
      type(linear_equation_t) :: equation
      integer, allocatable :: pivot_of(:, :)
      logical, allocatable :: others(:)
      integer :: at, e, found, i, last, moved_of(size(number, 2))
      real(wp) :: scale

      moved_of = 0
      moved_of(moved) = [(i, i=1, size(moved))]
      allocate (solved(size(joints%equations)), pivot_of(uz, size(number, 2)))
      pivot_of = 0
      found = 0
      last = 0
      do e = 1, size(joints%equations)
         equation = joints%equations(e)
         call check_terms(equation)
         if (allocated(error)) return
         scale = maxval(abs(equation%coefficient))
         call substitute(equation)
         equation%coefficient = merge(equation%coefficient, 0.0_wp, abs(equation%coefficient) > negligible*scale)
         at = pivot(equation)
         if (at == 0) then
            if (contradicts(equation)) then
               call raise(error, status_input_error, joints%origins(equation%origin)%text//': it contradicts the supports: all ' &
                  //'that it leaves free is '//what_moves(equation)//', which a support moves')
               return
            end if
            if (last /= equation%origin) self%redundant = self%redundant//joints%origins(equation%origin)%text &
               //': it says what supports or other equations say already, at '//node_text(mesh, joints%equations(e)%node(1)) &
               //'; there it is left out'//new_line('a')
            last = equation%origin
            cycle
         end if
         found = found + 1
         solved(found)%node = equation%node(at)
         solved(found)%component = equation%component(at)
         pivot_of(equation%component(at), equation%node(at)) = found
         others = abs(equation%coefficient) > 0
         others(at) = .false.
         solved(found)%master = pack(equation%node, others)
         solved(found)%of = pack(equation%component, others)
         solved(found)%coefficient = -pack(equation%coefficient, others)/equation%coefficient(at)
      end do
      do i = found, 1, -1
         self%node = [self%node, solved(i)%node]
         self%component = [self%component, solved(i)%component]
         self%master = [self%master, solved(i)%master]
         self%along = [self%along, solved(i)%of]
         self%coefficient = [self%coefficient, solved(i)%coefficient]
         self%first = [self%first, size(self%master) + 1]
         self%row(solved(i)%component, solved(i)%node) = size(self%node)
      end do

   contains

      subroutine check_terms(equation)
         type(linear_equation_t), intent(in) :: equation
         integer :: k
         do k = 1, size(equation%node)
            associate (node => equation%node(k), origin => joints%origins(equation%origin)%text)
               if (joint_of(node) > 0) then
                  call raise(error, status_input_error, origin//': '//node_text(mesh, node)//' depends on others by ' &
                     //joints%origins(joints%list(joint_of(node))%origin)%text//'; name what it depends on, '//node_text(mesh, &
                     joints%list(joint_of(node))%master(1))//', instead')
               else if (frame(node) > 0) then
                  call raise(error, status_input_error, origin//': '//node_text(mesh, node)//' is held in axes of its own, and ' &
                     //'equations are between global components')
               end if
            end associate
            if (allocated(error)) return
         end do
      end subroutine check_terms

      !> Put in what is solved already, until nothing of it is left.
      subroutine substitute(equation)
         type(linear_equation_t), intent(inout) :: equation
         integer :: k, t, place
         real(wp) :: a
         k = 1
         do while (k <= size(equation%node))
            associate (p => pivot_of(equation%component(k), equation%node(k)))
               a = equation%coefficient(k)
               if (p > 0 .and. abs(a) > 0) then
                  equation%coefficient(k) = 0
                  do t = 1, size(solved(p)%master)
                     place = term(equation, solved(p)%master(t), solved(p)%of(t))
                     equation%coefficient(place) = equation%coefficient(place) + a*solved(p)%coefficient(t)
                  end do
                  k = 0 ! what was put in may be solved, too
               end if
            end associate
            k = k + 1
         end do
      end subroutine substitute

      !> Where a component stands in an equation; it is appended where it does not.
      integer function term(equation, node, component)
         type(linear_equation_t), intent(inout) :: equation
         integer, intent(in) :: node, component
         do term = 1, size(equation%node)
            if (equation%node(term) == node .and. equation%component(term) == component) return
         end do
         equation%node = [equation%node, node]
         equation%component = [equation%component, component]
         equation%coefficient = [equation%coefficient, 0.0_wp]
      end function term

      !> The free term with the largest coefficient; 0: there is none.
      integer function pivot(equation)
         type(linear_equation_t), intent(in) :: equation
         real(wp) :: largest
         integer :: k
         pivot = 0
         largest = 0
         do k = 1, size(equation%node)
            if (number(equation%component(k), equation%node(k)) == 0) cycle
            if (abs(equation%coefficient(k)) <= largest*(1 + negligible)) cycle
            pivot = k
            largest = abs(equation%coefficient(k))
         end do
      end function pivot

      !> Do moved supports violate an equation in which nothing is free?
      logical function contradicts(equation)
         type(linear_equation_t), intent(in) :: equation
         real(wp) :: total, size_of_terms, value
         integer :: f, k
         contradicts = .false.
         do f = 1, size(motion, 3)
            total = 0
            size_of_terms = 0
            do k = 1, size(equation%node)
               if (moved_of(equation%node(k)) == 0) cycle
               value = equation%coefficient(k)*motion(equation%component(k), moved_of(equation%node(k)), f)
               total = total + value
               size_of_terms = size_of_terms + abs(value)
            end do
            contradicts = contradicts .or. abs(total) > negligible*size_of_terms
         end do
      end function contradicts

      function what_moves(equation) result(text)
         type(linear_equation_t), intent(in) :: equation
         character(len=:), allocatable :: text
         integer :: k
         text = ''
         do k = 1, size(equation%node)
            if (.not. abs(equation%coefficient(k)) > 0 .or. moved_of(equation%node(k)) == 0) cycle
            if (.not. any(abs(motion(equation%component(k), moved_of(equation%node(k)), :)) > 0)) cycle
            if (text /= '') text = text//', '
            text = text//component_names(equation%component(k))//' of '//node_text(mesh, equation%node(k))
         end do
      end function what_moves
   end subroutine eliminate
end module finshell_link_builder
