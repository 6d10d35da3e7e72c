!> C interface: the elements of an assembly, patch by patch, on as many threads as a host wants: gathered from arrays by nodes, and
!> added to arrays by nodes and to the values of a matrix.
!>
!> Patches of one colour share no node, and the order of colours and of the elements in a patch is that of the mesh: sums are the
!> same to the last bit for any number of threads.
module finshell_capi_sweep
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int32_t, c_loc, c_null_ptr, c_ptr, c_size_t
!$ use omp_lib, only: omp_get_max_threads, omp_get_thread_num, omp_in_parallel
   use finshell_batch, only: rotation_increment, rotation_quaternion, rotation_vector
   use finshell_capi_common, only: c_status_t, judge, refuse, refuse_memory
   use finshell_capi_element, only: most_threads
   use finshell_capi_elements, only: c_elements_t, complaint, memcpy
   use finshell_capi_mesh, only: layout_t, patch_size
   use finshell_environment, only: environment_t, hold, release
   use finshell_fork, only: forked
   use finshell_freedoms, only: n_corners, n_nodal, n_shell, uz
   use finshell_scatter, only: add_element_matrix
   use finshell_status, only: status_ok
   implicit none
   private
   public :: job_t, desk_t, sweep, gather, deposit, check_nodes, conclude_nodes

   integer, parameter :: words_passed = 9 !< at most, of an element
   integer, parameter :: members_passed = 5

   !> What a thread has before it: one patch.
   type :: desk_t
      integer :: n = 0 !< elements
      integer :: first = 0 !< slot before the first of them
      integer :: section = 0 !< from 1
      integer :: freedoms = n_shell !< of an element
      type(c_elements_t) :: block !< the patch as any call takes it
      real(c_double) :: x(3, 3, patch_size), u(3, 3, patch_size), rotations(4, 3, patch_size), state(4, 3, patch_size)
      real(c_double) :: toward(n_shell*patch_size)
      real(c_double) :: passed(words_passed*patch_size, members_passed) !< what is by element, a member in a column
      real(c_double) :: energy(patch_size), force(n_shell*patch_size), matrix(n_shell*n_shell*patch_size)
      real(c_double) :: pressure(patch_size)
      integer(c_int32_t) :: codes(patch_size)
   end type desk_t

   !> What is done with each patch, and where it goes.
   type, abstract :: job_t
      type(layout_t), pointer :: layout => null()
      type(c_elements_t) :: given !< by nodes: X, u, rotations, state, toward; by element: the others
      logical :: wants_matrix = .false.
      real(c_double) :: factor = 1
      real(c_double), pointer, contiguous :: nodal(:, :) => null() !< (freedoms of a node, nodes) forces are added
      real(c_double), pointer, contiguous :: values(:) => null() !< matrices are added
      integer(c_int32_t), allocatable :: codes(:) !< (elements)
      real(c_double), allocatable :: part(:) !< (patches) of the sum
   contains
      procedure(compute), deferred :: compute
   end type job_t

   abstract interface
      !> From desk%block to energy, force, matrix and codes of the patch.
      subroutine compute(self, desk)
         import :: desk_t, job_t
         class(job_t), intent(in) :: self
         type(desk_t), intent(inout), target :: desk
      end subroutine compute
   end interface

contains

   !> Is what is by nodes there?
   function check_nodes(place, layout, block, moves, status) result(code)
      character(len=*), intent(in) :: place
      type(layout_t), intent(in) :: layout
      type(c_elements_t), intent(in) :: block
      logical, intent(in) :: moves !< the motion counts
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      code = status_ok
      if (block%n /= layout%elements) then
         code = refuse(status, place, 'elements->n is #, expected the number of elements of the mesh', block%n)
      else if (block%threads < 0) then
         code = refuse(status, place, 'threads is #, expected 0 (as OpenMP chooses) or a positive number', block%threads)
      else if (block%n > 0 .and. .not. c_associated(block%x)) then
         code = refuse(status, place, 'X is NULL')
      else if (block%n > 0 .and. moves) then
         if (.not. c_associated(block%u)) then
            code = refuse(status, place, 'u is NULL')
         else if (.not. all(layout%membrane)) then
            if (block%convention < rotation_vector .or. block%convention > rotation_increment) then
               code = refuse(status, place, 'convention is #, expected 1 (vector), 2 (quaternion) or 3 (increment)', &
                             block%convention)
            else if (.not. c_associated(block%rotations)) then
               code = refuse(status, place, 'rotations is NULL')
            else if (block%convention == rotation_increment .and. .not. c_associated(block%state)) then
               code = refuse(status, place, 'state is NULL, and rotation increments need it')
            end if
         end if
      end if
   end function check_nodes

   !> Do a job for all elements, and say how it went; `total` is the sum over all of them.
   function sweep(place, job, codes, total, status) result(code)
      character(len=*), intent(in) :: place
      class(job_t), intent(inout) :: job
      integer(c_int32_t), intent(out), optional :: codes(*)
      real(c_double), intent(out), optional :: total
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(desk_t), allocatable :: desks(:)
      type(environment_t) :: environment
      integer :: c, me, memory, p, team

      if (present(total)) total = 0
      associate (patches => job%layout%patches)
         team = team_of(job%given%threads, job%layout%elements)
         allocate (desks(team), stat=memory)
         if (memory == 0) allocate (job%codes(job%layout%elements), stat=memory)
         if (memory == 0) allocate (job%part(size(patches%group)), stat=memory)
         if (memory /= 0) then
            code = refuse_memory(status, place)
            return
         end if
         if (team == 1) then
            call hold(environment)
            do p = 1, size(patches%group)
               call do_patch(job, desks(1), p)
            end do
            call release(environment)
         else
            !$omp parallel num_threads(team) default(shared) private(c, environment, me, p)
            me = 1
!$          me = omp_get_thread_num() + 1
            call hold(environment)
            do c = 1, patches%colours
               !$omp do schedule(dynamic)
               do p = patches%first_of_colour(c), patches%first_of_colour(c + 1) - 1
                  call do_patch(job, desks(me), p)
               end do
               !$omp end do
            end do
            call release(environment)
            !$omp end parallel
         end if
      end associate
      call hold(environment)
      if (present(total)) total = sum(job%part)
      call release(environment)
      if (present(codes)) codes(:job%layout%elements) = job%codes
      code = conclude_nodes(place, job, job%codes, status)
   end function sweep

   !> One patch: gathered, computed, added.
   subroutine do_patch(job, desk, p)
      class(job_t), intent(inout) :: job
      type(desk_t), intent(inout), target :: desk
      integer, intent(in) :: p
      integer :: i
      associate (patches => job%layout%patches)
         desk%first = patches%first(p) - 1
         desk%n = patches%first(p + 1) - patches%first(p)
         desk%section = patches%group(p)
         call gather(job%layout, job%given, desk)
         call job%compute(desk)
         job%part(p) = sum(desk%energy(:desk%n))
         do i = 1, desk%n
            job%codes(patches%element(desk%first + i)) = desk%codes(i)
         end do
      end associate
      call deposit(job, desk)
   end subroutine do_patch

   !> As many threads as are asked for: see `threads` in finshell.h.
   integer function team_of(threads, elements)
      integer(c_int32_t), intent(in) :: threads
      integer, intent(in) :: elements
      integer, parameter :: elements_per_thread = 256
      team_of = min(threads, most_threads)
      if (threads == 0) then
         team_of = 1
!$       if (.not. omp_in_parallel()) team_of = min(omp_get_max_threads(), 1 + elements/elements_per_thread, most_threads)
      end if
      if (team_of == 1) return
      if (forked()) team_of = 1
   end function team_of

   !> The block of a patch. A member of finshell_elements that is by element needs its line here, and no more; what is by layer, or
   !> of a length that the section decides, is gathered in finshell_capi_assemble.
   subroutine gather(layout, given, desk)
      type(layout_t), intent(in) :: layout
      type(c_elements_t), intent(in) :: given
      type(desk_t), intent(inout), target :: desk
      integer, parameter :: word = 8
      integer :: c
      logical :: turns
      associate (block => desk%block)
         block = given
         block%n = desk%n
         block%threads = 1
         turns = .not. layout%membrane(desk%section)
         desk%freedoms = n_corners*merge(n_nodal, uz, turns)
         call from_nodes(given%x, 3, desk%x, block%x)
         call from_nodes(given%u, 3, desk%u, block%u)
         c = merge(4, 3, given%convention == rotation_quaternion)
         if (turns) then
            call from_nodes(given%rotations, c, desk%rotations, block%rotations)
            if (given%convention == rotation_increment) call from_nodes(given%state, 4, desk%state, block%state)
         end if
         call motion_of_nodes()
         call by_element(given%direction, 3*word, 1, block%direction)
         call by_element(given%normals, 9*word, 2, block%normals)
         call by_element(given%straight, 3*word/2, 3, block%straight)
         call by_element(given%thickness, word, 4, block%thickness)
         call by_element(given%offset, word, 5, block%offset)
      end associate

   contains

      subroutine from_nodes(from, components, room, to)
         type(c_ptr), intent(in) :: from
         integer, intent(in) :: components !< 3 or 4
         real(c_double), intent(inout), target :: room(components, n_corners, *)
         type(c_ptr), intent(inout) :: to
         real(c_double), pointer, contiguous :: values(:, :)
         integer :: i, j
         if (.not. c_associated(from)) return
         call c_f_pointer(from, values, [components, layout%nodes])
         do i = 1, desk%n
            do j = 1, n_corners
               associate (node => layout%corner(j, desk%first + i))
                  room(:3, j, i) = values(:3, node) ! a length that the compiler knows
                  if (components == 4) room(4, j, i) = values(4, node)
               end associate
            end do
         end do
         to = c_loc(room(1, 1, 1))
      end subroutine from_nodes

      !> Displacements and spins, as many as the elements have.
      subroutine motion_of_nodes()
         real(c_double), pointer, contiguous :: values(:, :)
         integer :: i, j, m
         if (.not. c_associated(given%toward)) return
         call c_f_pointer(given%toward, values, [layout%nodal, layout%nodes])
         m = desk%freedoms/n_corners
         do i = 1, desk%n
            do j = 1, n_corners
               desk%toward(desk%freedoms*(i - 1) + m*(j - 1) + 1:desk%freedoms*(i - 1) + m*j) = &
                  values(:m, layout%corner(j, desk%first + i))
            end do
         end do
         desk%block%toward = c_loc(desk%toward(1))
      end subroutine motion_of_nodes

      subroutine by_element(from, bytes, member, to)
         type(c_ptr), intent(in) :: from
         integer, intent(in) :: bytes, member
         type(c_ptr), intent(inout) :: to
         integer(c_int32_t), pointer, contiguous :: all(:, :), some(:, :)
         integer :: i
         if (.not. c_associated(from)) return
         to = c_loc(desk%passed(1, member))
         call c_f_pointer(from, all, [bytes/4, layout%elements])
         call c_f_pointer(to, some, [bytes/4, desk%n])
         do i = 1, desk%n
            some(:, i) = all(:, layout%patches%element(desk%first + i))
         end do
      end subroutine by_element
   end subroutine gather

   !> Add forces and matrices of a patch. Matrices come with the row as the first index of C.
   subroutine deposit(job, desk)
      class(job_t), intent(inout) :: job
      type(desk_t), intent(in) :: desk
      integer :: i, j, m, n
      n = desk%freedoms
      m = n/n_corners
      if (associated(job%nodal)) then
         do i = 1, desk%n
            do j = 1, n_corners
               associate (nodal => job%nodal(:, job%layout%corner(j, desk%first + i)), &
                          force => desk%force(n*(i - 1) + m*(j - 1) + 1:n*(i - 1) + m*j))
                  nodal(:uz) = nodal(:uz) + job%factor*force(:uz) ! a length that the compiler knows
                  if (m == n_nodal) nodal(uz + 1:n_nodal) = nodal(uz + 1:n_nodal) + job%factor*force(uz + 1:n_nodal)
               end associate
            end do
         end do
      end if
      if (.not. (associated(job%values) .and. job%wants_matrix)) return
      do i = 1, desk%n
         call add_one(desk%matrix(n*n*(i - 1) + 1:n*n*i))
      end do

   contains

      subroutine add_one(k)
         real(c_double), intent(in) :: k(n, n)
         call add_element_matrix(job%layout%scatter, desk%first + i, k, job%values)
      end subroutine add_one
   end subroutine deposit

   !> What a call returns: the code, and what is wrong with the element it belongs to.
   function conclude_nodes(place, job, codes, status) result(code)
      character(len=*), intent(in) :: place
      class(job_t), intent(in) :: job
      integer(c_int32_t), intent(in) :: codes(:)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(desk_t), allocatable, target :: desk
      type(environment_t) :: environment
      integer :: e, memory
      if (all(codes >= status_ok)) then
         code = judge(status, place, int(size(codes), c_int32_t), codes)
         return
      end if
      call hold(environment)
      do e = 1, size(codes)
         if (codes(e) < 0) exit
      end do
      allocate (desk, stat=memory)
      if (memory == 0) then
         desk%n = 1
         desk%first = job%layout%slot(e) - 1
         desk%section = job%layout%section(e)
         call gather(job%layout, job%given, desk)
         code = judge(status, place, int(size(codes), c_int32_t), codes, complaint(desk%block, codes(e:e)))
      else
         code = judge(status, place, int(size(codes), c_int32_t), codes)
      end if
      call release(environment)
   end function conclude_nodes
end module finshell_capi_sweep
