!> C interface: dead loads on a structure: tractions, gravity, line loads. See finshell.h for what the functions promise.
module finshell_capi_loads
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int32_t, c_ptr
   use finshell_batch, only: rotation_increment, rotation_quaternion, rotation_vector
   use finshell_capi_assemble, only: aim, by_reference, receive_sections
   use finshell_capi_assembly, only: receive_assembly
   use finshell_capi_common, only: c_status_t, judge, refuse, refuse_memory
   use finshell_capi_elements, only: c_elements_t, read_block, receive_own, receive_section, whole_block
   use finshell_capi_mesh, only: layout_t
   use finshell_capi_sweep, only: check_nodes, desk_t, job_t, sweep
   use finshell_environment, only: environment_t, hold, release
   use finshell_freedoms, only: n_corners, n_shell, shell_at, uz
   use finshell_line_batch, only: line_loads
   use finshell_own, only: own_inertia
   use finshell_rotation, only: cross_product
   use finshell_scatter, only: add_element_matrix
   use finshell_section, only: section_t
   use finshell_status, only: status_not_a_number, status_ok
   use finshell_triangle, only: judge_triangles
   implicit none
   private

   !> A force per reference area, a third of which goes to each node.
   type, extends(job_t) :: area_load_t
      real(c_double), pointer, contiguous :: traction(:, :) => null() !< (3, elements)
      type(c_ptr), pointer :: sections(:) => null() !< instead: of these the mass per area
      real(c_double) :: acceleration(3) = 0
   contains
      procedure :: compute => compute_area
   end type area_load_t

contains

   function traction(assembly, x, per_area, factor, force, codes, status) result(code) bind(c, name='finshell_assembly_traction')
      type(c_ptr), value :: assembly, x, per_area, force
      real(c_double), value :: factor
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_assembly_traction'
      type(layout_t), pointer :: layout
      type(c_elements_t) :: block
      type(area_load_t) :: job
      code = receive_assembly(place, assembly, layout, status)
      if (code /= status_ok) return
      if (layout%elements > 0 .and. .not. c_associated(per_area)) then
         code = refuse(status, place, 'traction is NULL')
         return
      end if
      if (c_associated(per_area)) call c_f_pointer(per_area, job%traction, [uz, layout%elements])
      block = c_elements_t(whole_block(), int(layout%elements, c_int32_t), rotation_vector, 1, 0, x)
      code = push(place, job, layout, block, factor, force, codes, status)
   end function traction

   function gravity(assembly, sections, section, elements, acceleration, factor, force, codes, status) result(code) &
      bind(c, name='finshell_assembly_gravity')
      type(c_ptr), value :: assembly, elements, force
      integer(c_int32_t), value :: sections
      type(c_ptr), intent(in), optional, target :: section(*)
      real(c_double), intent(in), optional :: acceleration(3)
      real(c_double), value :: factor
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_assembly_gravity'
      type(layout_t), pointer :: layout
      type(c_elements_t) :: block
      type(area_load_t) :: job
      code = receive_assembly(place, assembly, layout, status)
      if (code == status_ok) code = receive_sections(place, layout, sections, section, job%sections, status)
      if (code == status_ok) code = read_block(place, elements, block, status)
      if (code /= status_ok) return
      if (.not. present(acceleration)) then
         code = refuse(status, place, 'acceleration is NULL')
         return
      end if
      job%acceleration = acceleration
      code = push(place, job, layout, by_reference(block), factor, force, codes, status)
   end function gravity

   function push(place, job, layout, block, factor, force, codes, status) result(code)
      character(len=*), intent(in) :: place
      class(area_load_t), intent(inout) :: job
      type(layout_t), pointer, intent(in) :: layout
      type(c_elements_t), intent(in) :: block
      type(c_ptr), intent(in) :: force
      real(c_double), intent(in) :: factor
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      code = check_nodes(place, layout, block, .false., status)
      if (code == status_ok .and. .not. c_associated(force)) code = refuse(status, place, 'force is NULL')
      if (code /= status_ok) return
      call aim(job, layout, block, factor, force)
      code = sweep(place, job, codes, status=status)
   end function push

   subroutine compute_area(self, desk)
      class(area_load_t), intent(in) :: self
      type(desk_t), intent(inout), target :: desk
      type(section_t), pointer :: s
      real(c_double) :: a(3), b(3), per_area(3), area, inertia(3)
      real(c_double), pointer, contiguous :: thickness(:), offset(:), growth(:, :, :)
      integer(c_int32_t) :: code
      integer :: i, j, m
      m = desk%freedoms/n_corners
      desk%energy = 0
      desk%force = 0
      per_area = 0
      if (associated(self%sections)) then
         code = receive_section('', self%sections(desk%section), s)
         if (code == status_ok) call receive_own(desk%block, s, thickness, offset, growth)
      end if
      do i = 1, desk%n
         if (associated(self%sections) .and. code == status_ok) then
            inertia = s%inertia
            if (associated(thickness)) inertia = own_inertia(s, thickness(i))
            per_area = inertia(1)*self%acceleration
         end if
         if (associated(self%traction)) per_area = self%traction(:, self%layout%patches%element(desk%first + i))
         a = desk%x(:, 2, i) - desk%x(:, 1, i)
         b = desk%x(:, 3, i) - desk%x(:, 1, i)
         area = norm2(cross_product(a, b))/2
         desk%codes(i) = status_ok
         if (.not. sum(0*desk%x(:, :, i)) + sum(0*per_area) <= 0) then
            desk%codes(i) = status_not_a_number
         else
            call judge_triangles(1, [2*area], [max(sum(a*a), sum(b*b), sum((b - a)**2))], desk%codes(i:i))
         end if
         if (desk%codes(i) /= status_ok) cycle
         do j = 0, n_corners - 1
            desk%force(desk%freedoms*(i - 1) + m*j + 1:desk%freedoms*(i - 1) + m*j + uz) = area/3*per_area
         end do
      end do
   end subroutine compute_area

   function line_load(assembly, elements, n, element, side, load, factor, force, values, codes, status) result(code) &
      bind(c, name='finshell_assembly_line_load')
      type(c_ptr), value :: assembly, elements, force, values
      integer(c_int32_t), value :: n
      integer(c_int32_t), intent(in), optional :: element(*), side(*)
      real(c_double), intent(in), optional :: load(3, *)
      real(c_double), value :: factor
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_assembly_line_load'
      type(layout_t), pointer :: layout
      type(c_elements_t) :: block
      type(area_load_t) :: target_of
      integer(c_int32_t), allocatable :: found(:)
      type(environment_t) :: environment
      integer :: i, memory
      code = receive_assembly(place, assembly, layout, status)
      if (code == status_ok) code = read_block(place, elements, block, status)
      if (code == status_ok) code = check_nodes(place, layout, block, .true., status)
      if (code /= status_ok) return
      if (n < 0) then
         code = refuse(status, place, 'n is #, expected a number of sides >= 0', n)
      else if (n > 0 .and. .not. (present(element) .and. present(side) .and. present(load))) then
         code = refuse(status, place, 'element, side or load is NULL')
      end if
      if (code /= status_ok .or. n == 0) return
      do i = 1, n
         if (element(i) < 0 .or. element(i) >= layout%elements) then
            code = refuse(status, place, 'load # (from 0) is on an element that is not in 0 .. elements - 1', int(i - 1, c_int32_t))
         else if (side(i) < 0 .or. side(i) >= n_corners) then
            code = refuse(status, place, 'load # (from 0) is on a side that is not 0, 1 or 2', int(i - 1, c_int32_t))
         end if
         if (code /= status_ok) return
      end do
      allocate (found(n), stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      call aim(target_of, layout, block, factor, force, values)
      call hold(environment)
      do i = 1, n
         call one_side(target_of, element(i) + 1, side(i) + 1, load(:, i), found(i))
      end do
      call release(environment)
      if (present(codes)) codes(:n) = found
      code = judge(status, place, n, found, noun='load')
   end function line_load

   !> One side: computed and added.
   subroutine one_side(job, e, side, load, found)
      class(job_t), intent(inout) :: job
      integer, intent(in) :: e, side
      real(c_double), intent(in) :: load(3)
      integer(c_int32_t), intent(out) :: found
      real(c_double), pointer, contiguous, dimension(:, :) :: x, u, r, s
      integer(c_int32_t), pointer, contiguous :: straight(:, :)
      real(c_double) :: at(3, 3, 1), moved(3, 3, 1), state(4, 3, 1), f(n_shell, 1), k(n_shell, n_shell, 1)
      real(c_double) :: turned(4, 3, 1)
      integer(c_int32_t) :: code(1)
      logical :: membrane, bulges
      integer :: c, convention, i, m, slot
      associate (layout => job%layout, given => job%given)
         slot = layout%slot(e)
         membrane = layout%membrane(layout%section(e))
         convention = merge(rotation_vector, int(given%convention), membrane)
         c = merge(4, 3, convention == rotation_quaternion)
         turned = 0
         state = 0
         call c_f_pointer(given%x, x, [uz, layout%nodes])
         call c_f_pointer(given%u, u, [uz, layout%nodes])
         do i = 1, n_corners
            at(:, i, 1) = x(:, layout%corner(i, slot))
            moved(:, i, 1) = u(:, layout%corner(i, slot))
         end do
         bulges = .not. membrane
         if (bulges) then
            call c_f_pointer(given%rotations, r, [c, layout%nodes])
            if (convention == rotation_increment) call c_f_pointer(given%state, s, [4, layout%nodes])
            do i = 1, n_corners
               turned(:c, i, 1) = r(:, layout%corner(i, slot))
               if (convention == rotation_increment) state(:, i, 1) = s(:, layout%corner(i, slot))
            end do
            if (c_associated(given%straight)) then
               call c_f_pointer(given%straight, straight, [n_corners, layout%elements])
               bulges = straight(side, e) == 0
            end if
         end if
         if (job%wants_matrix) then
            call line_loads(1, [side], reshape(load, [3, 1]), [bulges], at, moved, turned(:c, :, :), convention, code, f, k, state)
         else
            call line_loads(1, [side], reshape(load, [3, 1]), [bulges], at, moved, turned(:c, :, :), convention, code, f, &
                            state=state)
         end if
         found = code(1)
         m = merge(uz, n_shell/n_corners, membrane)
         if (associated(job%nodal)) then
            do i = 1, n_corners
               associate (node => job%nodal(:m, layout%corner(i, slot)))
                  node = node + job%factor*f(shell_at(i) + 1:shell_at(i) + m, 1)
               end associate
            end do
         end if
         if (.not. (job%wants_matrix .and. bulges)) return
         if (layout%pattern%symmetric) k(:, :, 1) = 0.5_c_double*(k(:, :, 1) + transpose(k(:, :, 1)))
         k(:, :, 1) = job%factor*transpose(k(:, :, 1)) ! rows are the first index of C
         call add_element_matrix(layout%scatter, slot, k(:, :, 1), job%values)
      end associate
   end subroutine one_side
end module finshell_capi_loads
