!> C interface: the block of arguments that says what elements a call is about, and what is wrong with it.
!>
!> The block begins with its size. So members can be added at its end: a caller that knows fewer of them leaves them out, a caller
!> that knows more is served as long as it does not use them.
module finshell_capi_elements
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int32_t, c_int64_t, c_int8_t, c_loc, c_null_ptr, &
      c_ptr, c_size_t, c_sizeof
   use finshell_batch, only: n_growth, side_fixed, side_free, side_straight, rotation_increment, rotation_quaternion, &
      rotation_vector
   use finshell_capi_common, only: accept, c_status_t, judge, refuse, refuse_memory
   use finshell_capi_handle, only: section_of
   use finshell_environment, only: environment_t, hold, release
   use finshell_freedoms, only: n_membrane, n_shell
   use finshell_rotation, only: cross_product
   use finshell_law_states, only: law_states_t
   use finshell_section, only: section_t, states_of
   use finshell_status, only: status_invalid_argument, status_ok
   implicit none
   private
   public :: c_elements_t, read_block, receive, receive_own, receive_states, receive_histories, receive_section, conclude, &
      complaint, whole_block, freedoms_of, as_seen_by, memcpy

   !> finshell_elements of the header. What a shorter block does not hold is zero.
   type, bind(c) :: c_elements_t
      integer(c_int64_t) :: size = 0
      integer(c_int32_t) :: n = 0
      integer(c_int32_t) :: convention = 0
      integer(c_int32_t) :: threads = 0
      integer(c_int32_t) :: reserved = 0
      type(c_ptr) :: x = c_null_ptr
      type(c_ptr) :: u = c_null_ptr
      type(c_ptr) :: rotations = c_null_ptr
      type(c_ptr) :: state = c_null_ptr
      type(c_ptr) :: direction = c_null_ptr
      type(c_ptr) :: normals = c_null_ptr
      type(c_ptr) :: toward = c_null_ptr
      type(c_ptr) :: straight = c_null_ptr
      type(c_ptr) :: thickness = c_null_ptr
      type(c_ptr) :: offset = c_null_ptr
      type(c_ptr) :: growth = c_null_ptr
      type(c_ptr) :: states_begin = c_null_ptr
      type(c_ptr) :: states_end = c_null_ptr
      real(c_double) :: time = 0
      real(c_double) :: time_step = 0
   end type c_elements_t

   integer, parameter :: optional_members = 12 !< behind `rotations`, the last that is required
   integer(c_int64_t), parameter :: no_size = 4096 !< whatever is larger was not set

   interface
      subroutine memcpy(to, from, bytes) bind(c)
         import :: c_ptr, c_size_t
         type(c_ptr), value :: to, from
         integer(c_size_t), value :: bytes
      end subroutine memcpy
   end interface

contains

   !> Size of the block that this library knows.
   integer(c_int64_t) function whole_block()
      type(c_elements_t) :: block
      whole_block = c_sizeof(block)
   end function whole_block

   !> A block of whatever size, as far as this library knows it.
   function read_block(place, pointer, block, status) result(code)
      character(len=*), intent(in) :: place
      type(c_ptr), intent(in) :: pointer
      type(c_elements_t), intent(out), target :: block
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      integer(c_int64_t), pointer :: given
      integer(c_int8_t), pointer :: bytes(:)
      integer(c_int64_t) :: known, member

      code = status_invalid_argument
      if (.not. c_associated(pointer)) then
         code = refuse(status, place, 'elements is NULL')
         return
      end if
      call c_f_pointer(pointer, given)
      known = c_sizeof(block)
      member = c_sizeof(pointer)
      if (given < 0 .or. given > no_size) then
         code = refuse(status, place, 'elements->size is not set, expected sizeof(finshell_elements)')
      else if (given < known - optional_members*member .or. modulo(given, member) /= 0) then
         code = refuse(status, place, 'elements->size is #, expected sizeof(finshell_elements)', int(given, c_int32_t))
      else
         call c_f_pointer(pointer, bytes, [given])
         if (any(bytes(known + 1:) /= 0)) then
            code = refuse(status, place, 'elements->size is #, with members in use that this library does not know: finshell.h '// &
                          'is newer than the library', int(given, c_int32_t))
         else
            call memcpy(c_loc(block), pointer, int(min(given, known), c_size_t))
            code = status_ok
         end if
      end if
   end function read_block

   !> The section behind a handle.
   function receive_section(place, section, s, status) result(code)
      character(len=*), intent(in) :: place
      type(c_ptr), intent(in) :: section
      type(section_t), pointer, intent(out) :: s
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      code = status_ok
      s => section_of(section)
      if (.not. c_associated(section)) then
         code = refuse(status, place, 'section is NULL')
      else if (.not. associated(s)) then
         code = refuse(status, place, 'section is no handle: it was destroyed, or finshell_section_create did not make it')
      end if
   end function receive_section

   !> Freedoms of an element of a section.
   pure integer function freedoms_of(section)
      type(section_t), intent(in) :: section
      freedoms_of = merge(n_membrane, n_shell, section%membrane)
   end function freedoms_of

   !> A block as far as a section looks at it: membranes have neither rotations nor normals nor sides that bend.
   pure function as_seen_by(section, block) result(seen)
      type(section_t), intent(in) :: section
      type(c_elements_t), intent(in) :: block
      type(c_elements_t) :: seen
      seen = block
      if (.not. section%membrane) return
      seen%convention = rotation_vector
      seen%rotations = c_null_ptr
      seen%state = c_null_ptr
      seen%normals = c_null_ptr
      seen%straight = c_null_ptr
      seen%offset = c_null_ptr
   end function as_seen_by

   !> Check a block and point to what it holds; with n = 0 only the numbers. Sets `status` to done.
   !>
   !> What the block does not hold is not associated, and counts as absent in a call. (Not so, for gfortran 12, the components of a
   !> structure.)
   function receive(place, block, freedoms, x, u, rotations, state, direction, normal, toward, held, status) result(code)
      character(len=*), intent(in) :: place
      type(c_elements_t), intent(in) :: block
      integer, intent(in) :: freedoms !< of an element; elements of `n_shell` need rotations
      real(c_double), pointer, contiguous, dimension(:, :, :), intent(out) :: x, u, rotations, state, normal
      real(c_double), pointer, contiguous, dimension(:, :), intent(out) :: direction, toward
      integer, allocatable, intent(out) :: held(:, :)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      integer(c_int32_t), pointer :: sides(:, :)
      integer :: memory, c

      code = status_ok
      nullify (x, u, rotations, state, direction, normal, toward)
      if (block%n < 0) then
         code = refuse(status, place, 'n is #, expected a number of elements >= 0', block%n)
      else if (block%convention < rotation_vector .or. block%convention > rotation_increment) then
         code = refuse(status, place, 'convention is #, expected 1 (vector), 2 (quaternion) or 3 (increment)', block%convention)
      else if (block%threads < 0) then
         code = refuse(status, place, 'threads is #, expected 0 (as OpenMP chooses) or a positive number', block%threads)
      else if (block%reserved /= 0) then
         code = refuse(status, place, 'elements->reserved is #, expected 0', block%reserved)
      else if (block%n > 0) then
         if (.not. c_associated(block%x)) then
            code = refuse(status, place, 'X is NULL')
         else if (.not. c_associated(block%u)) then
            code = refuse(status, place, 'u is NULL')
         else if (freedoms == n_shell .and. .not. c_associated(block%rotations)) then
            code = refuse(status, place, 'rotations is NULL')
         else if (block%convention == rotation_increment .and. .not. c_associated(block%state)) then
            code = refuse(status, place, 'state is NULL, and rotation increments need it')
         end if
      end if
      if (code /= status_ok) return
      code = accept(status)
      if (block%n == 0) return
      c = merge(4, 3, block%convention == rotation_quaternion)
      call c_f_pointer(block%x, x, [3, 3, block%n])
      call c_f_pointer(block%u, u, [3, 3, block%n])
      if (c_associated(block%rotations)) call c_f_pointer(block%rotations, rotations, [c, 3, block%n])
      if (c_associated(block%state)) call c_f_pointer(block%state, state, [4, 3, block%n])
      if (c_associated(block%direction)) call c_f_pointer(block%direction, direction, [3, block%n])
      if (c_associated(block%normals)) call c_f_pointer(block%normals, normal, [3, 3, block%n])
      if (c_associated(block%toward)) call c_f_pointer(block%toward, toward, [freedoms, block%n])
      if (.not. c_associated(block%straight)) return
      call c_f_pointer(block%straight, sides, [3, block%n])
      allocate (held(3, block%n), stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      held = merge(side_fixed, merge(side_straight, side_free, sides /= 0), sides == side_fixed)
   end function receive

   !> The states of the laws of a section, null where they have none. Sets `status` to done.
   function receive_states(place, section, block, states, status) result(code)
      character(len=*), intent(in) :: place
      type(section_t), intent(in) :: section
      type(c_elements_t), intent(in) :: block
      type(law_states_t), intent(out) :: states
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      integer :: number
      number = states_of(section)
      code = receive_histories(place, block, number, status)
      if (code /= status_ok .or. number == 0 .or. block%n == 0) return
      states%time = block%time
      states%step = block%time_step
      call c_f_pointer(block%states_begin, states%begin, [number, int(block%n)])
      if (c_associated(block%states_end)) call c_f_pointer(block%states_end, states%end, [number, int(block%n)])
   end function receive_states

   !> Whether a block holds the states that elements have, so many each.
   function receive_histories(place, block, number, status) result(code)
      character(len=*), intent(in) :: place
      type(c_elements_t), intent(in) :: block
      integer, intent(in) :: number
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      code = accept(status)
      if (number == 0 .or. block%n == 0) return
      if (.not. c_associated(block%states_begin)) then
         code = refuse(status, place, 'states_begin is NULL, and the laws of the section have # state variables an element', number)
      else if (c_associated(block%states_begin, block%states_end)) then
         code = refuse(status, place, 'states_end is states_begin, expected another array')
      else if (.not. (block%time_step >= 0 .and. block%time_step <= huge(1.0_c_double))) then
         code = refuse(status, place, 'time_step is no number >= 0')
      else if (.not. abs(block%time) <= huge(1.0_c_double)) then
         code = refuse(status, place, 'time is no finite number')
      end if
   end function receive_histories

   !> Point to what elements have of their own in a block that `receive` has found sound; what it does not hold is not associated.
   subroutine receive_own(block, section, thickness, offset, growth)
      type(c_elements_t), intent(in) :: block
      type(section_t), intent(in) :: section
      real(c_double), pointer, contiguous, intent(out) :: thickness(:), offset(:), growth(:, :, :)
      nullify (thickness, offset, growth)
      if (block%n == 0) return
      if (c_associated(block%thickness)) call c_f_pointer(block%thickness, thickness, [block%n])
      if (c_associated(block%offset)) call c_f_pointer(block%offset, offset, [block%n])
      if (c_associated(block%growth)) call c_f_pointer(block%growth, growth, [n_growth, size(section%layers), block%n])
   end subroutine receive_own

   !> What a call about a block returns.
   function conclude(place, block, codes, status) result(code)
      character(len=*), intent(in) :: place
      type(c_elements_t), intent(in) :: block
      integer(c_int32_t), intent(in) :: codes(:)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      if (all(codes >= status_ok)) then
         code = judge(status, place, block%n, codes)
      else
         call hold(environment)
         code = judge(status, place, block%n, codes, complaint(block, codes))
         call release(environment)
      end if
   end function conclude

   !> Why the first element with a negative code has status_invalid_argument; blank when it has not.
   function complaint(block, codes) result(text)
      type(c_elements_t), intent(in) :: block
      integer(c_int32_t), intent(in) :: codes(:)
      character(len=96) :: text
      real(c_double), pointer, dimension(:, :, :) :: x, quaternion, normal
      real(c_double), pointer :: thickness(:)
      real(c_double) :: n(3), facet(3)
      integer :: e, k
      character(len=1) :: node
      text = ''
      do e = 1, size(codes)
         if (codes(e) < 0) exit
      end do
      if (e > size(codes)) return
      if (codes(e) /= status_invalid_argument) return
      text = 'the direction is zero'
      if (c_associated(block%normals)) text = 'the direction is zero, or a normal is 90 degrees from that of the triangle'
      if (c_associated(block%growth)) text = 'the direction is zero, or a layer has grown to no size'
      if (c_associated(block%thickness)) then
         call c_f_pointer(block%thickness, thickness, [e])
         if (.not. thickness(e) > 0) then
            write (text, '(a,es12.4,a)') 'its thickness is', thickness(e), ', expected a positive number'
            return
         end if
      end if
      nullify (quaternion, normal)
      if (block%convention == rotation_quaternion) call c_f_pointer(block%rotations, quaternion, [4, 3, e])
      if (block%convention == rotation_increment) call c_f_pointer(block%state, quaternion, [4, 3, e])
      if (c_associated(block%normals)) then
         call c_f_pointer(block%normals, normal, [3, 3, e])
         call c_f_pointer(block%x, x, [3, 3, e])
         facet = unit(cross_product(unit(x(:, 2, e) - x(:, 1, e)), unit(x(:, 3, e) - x(:, 1, e))))
      end if
      do k = 3, 1, -1
         write (node, '(i1)') k - 1
         if (associated(quaternion)) then
            if (all(abs(quaternion(:, k, e)) <= 0)) text = 'the quaternion of node '//node//' (from 0) is zero'
         end if
         if (.not. associated(normal)) cycle
         n = normal(:, k, e)
         if (all(abs(n) <= 0)) then
            text = 'the normal at node '//node//' (from 0) is zero'
         else if (.not. dot_product(unit(n), facet) > 0) then
            write (text, '(3a,f0.1,a)') 'the normal at node ', node, ' (from 0) is ', &
               atan2(norm2(cross_product(facet, unit(n))), dot_product(facet, unit(n)))*180/acos(-1.0_c_double), &
               ' degrees from that of the triangle, expected less than 90'
         end if
      end do
   end function complaint

   !> Of length 1; a vector of any length that is not zero.
   pure function unit(v) result(w)
      real(c_double), intent(in) :: v(3)
      real(c_double) :: w(3)
      w = scale(v, -exponent(maxval(abs(v))))
      w = w/norm2(w)
   end function unit
end module finshell_capi_elements
