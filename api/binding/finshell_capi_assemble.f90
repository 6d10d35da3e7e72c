!> C interface: what elements add to a structure: internal forces and tangent, pressure, the volume behind them, masses. See
!> finshell.h for what the functions promise.
module finshell_capi_assemble
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int32_t, c_loc, c_null_ptr, c_ptr
   use finshell_batch, only: n_growth, rotation_vector
   use finshell_capi_assembly, only: receive_assembly
   use finshell_capi_common, only: c_status_t, refuse
   use finshell_capi_element, only: evaluate_given
   use finshell_capi_elements, only: as_seen_by, c_elements_t, read_block, receive, receive_histories, receive_own, &
      receive_section
   use finshell_capi_mesh, only: layout_t
   use finshell_capi_sweep, only: check_nodes, desk_t, job_t, sweep
   use finshell_freedoms, only: n_membrane, n_shell, shell_displacements
   use finshell_mass, only: mass_elements, mass_membranes
   use finshell_section, only: section_t, states_of
   use finshell_status, only: status_invalid_argument, status_ok, status_out_of_memory
   use finshell_surface_pressure, only: pressure_elements
   implicit none
   private
   public :: aim, by_reference, receive_sections

   type, extends(job_t) :: evaluation_t
      type(c_ptr), pointer :: sections(:) => null()
      integer :: layers = 0, states = 0 !< most of any section: so many of each element has the caller
   contains
      procedure :: compute => compute_elements
   end type evaluation_t

   !> A pressure, or what weighs the volumes.
   type, extends(job_t) :: pressure_t
      real(c_double), pointer, contiguous :: pressure(:) => null() !< (elements); null: 1
      logical :: gradient = .false.
      real(c_double) :: origin(3) = 0
   contains
      procedure :: compute => compute_pressure
   end type pressure_t

   type, extends(job_t) :: mass_t
      type(c_ptr), pointer :: sections(:) => null()
      logical :: lumped = .false.
   contains
      procedure :: compute => compute_masses
   end type mass_t

contains

   !> Sections of the kinds that the assembly was made for.
   function receive_sections(place, layout, sections, section, list, status) result(code)
      character(len=*), intent(in) :: place
      type(layout_t), intent(in) :: layout
      integer(c_int32_t), intent(in) :: sections
      type(c_ptr), intent(in), optional, target :: section(*)
      type(c_ptr), pointer, intent(out) :: list(:)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(section_t), pointer :: s
      integer :: k
      code = status_ok
      nullify (list)
      if (sections /= size(layout%membrane)) then
         code = refuse(status, place, 'sections is #, expected as many as finshell_assembly_create had', sections)
      else if (sections > 0 .and. .not. present(section)) then
         code = refuse(status, place, 'section is NULL')
      end if
      if (code /= status_ok .or. sections == 0) return
      list => section(:sections)
      do k = 1, sections
         code = receive_section(place, list(k), s, status)
         if (code /= status_ok) return
         if (s%membrane .eqv. layout%membrane(k)) cycle
         code = refuse(status, place, 'section # (from 0) is of another kind, shell or membrane, than that of '// &
                       'finshell_assembly_create', int(k - 1, c_int32_t))
         return
      end do
   end function receive_sections

   !> Where the job puts what it finds.
   subroutine aim(job, layout, block, factor, force, values)
      class(job_t), intent(inout) :: job
      type(layout_t), pointer, intent(in) :: layout
      type(c_elements_t), intent(in) :: block
      real(c_double), intent(in) :: factor
      type(c_ptr), intent(in) :: force
      type(c_ptr), intent(in), optional :: values
      job%layout => layout
      job%given = block
      job%factor = factor
      if (c_associated(force)) call c_f_pointer(force, job%nodal, [layout%nodal, layout%nodes])
      job%wants_matrix = .false.
      if (present(values)) job%wants_matrix = c_associated(values)
      if (job%wants_matrix) call c_f_pointer(values, job%values, [layout%pattern%start(layout%pattern%n + 1) - 1])
   end subroutine aim

   function evaluate(assembly, sections, section, elements, energy, force, values, codes, status) result(code) &
      bind(c, name='finshell_assembly_evaluate')
      type(c_ptr), value :: assembly, elements, force, values
      integer(c_int32_t), value :: sections
      type(c_ptr), intent(in), optional, target :: section(*)
      real(c_double), intent(out), optional :: energy
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_assembly_evaluate'
      type(layout_t), pointer :: layout
      type(c_elements_t) :: block
      type(evaluation_t) :: job
      type(section_t), pointer :: s
      integer :: i
      code = receive_assembly(place, assembly, layout, status)
      if (code == status_ok) code = receive_sections(place, layout, sections, section, job%sections, status)
      if (code == status_ok) code = read_block(place, elements, block, status)
      if (code == status_ok) code = check_nodes(place, layout, block, .true., status)
      if (code /= status_ok) return
      call aim(job, layout, block, 1.0_c_double, force, values)
      do i = 1, sections
         code = receive_section(place, job%sections(i), s, status)
         job%layers = max(job%layers, size(s%layers))
         job%states = max(job%states, states_of(s))
      end do
      code = receive_histories(place, block, job%states, status)
      if (code == status_ok) code = sweep(place, job, codes, energy, status)
   end function evaluate

   subroutine compute_elements(self, desk)
      class(evaluation_t), intent(in) :: self
      type(desk_t), intent(inout), target :: desk
      integer(c_int32_t) :: code
      real(c_double), allocatable, target :: growth(:, :), begin(:, :), end(:, :)
      type(section_t), pointer :: s
      integer :: memory
      memory = 0
      code = receive_section('', self%sections(desk%section), s)
      call by_layer(self%given%growth, n_growth*self%layers, n_growth*size(s%layers), growth, desk%block%growth)
      call by_layer(self%given%states_begin, self%states, states_of(s), begin, desk%block%states_begin)
      call by_layer(self%given%states_end, self%states, states_of(s), end, desk%block%states_end)
      if (memory /= 0) then
         call nothing(desk, status_out_of_memory)
         return
      end if
      if (self%wants_matrix) then
         code = evaluate_given('', self%sections(desk%section), desk%block, desk%energy, desk%force, desk%matrix, desk%codes)
      else
         code = evaluate_given('', self%sections(desk%section), desk%block, desk%energy, desk%force, codes=desk%codes)
      end if
      ! refused as a whole: no code was written
      if (code < status_ok .and. all(desk%codes(:desk%n) >= status_ok)) call nothing(desk, code)
      if (allocated(end)) call give_back()

   contains

      !> Numbers of the elements of a patch, of which a section may have fewer than the caller has places.
      subroutine by_layer(from, most, wanted, values, to)
         type(c_ptr), intent(in) :: from
         integer, intent(in) :: most, wanted
         real(c_double), allocatable, target, intent(inout) :: values(:, :)
         type(c_ptr), intent(inout) :: to
         real(c_double), pointer, contiguous :: all(:, :)
         integer :: i
         to = c_null_ptr
         if (memory /= 0 .or. wanted == 0 .or. .not. c_associated(from)) return
         call c_f_pointer(from, all, [most, self%layout%elements])
         allocate (values(wanted, desk%n), stat=memory)
         if (memory /= 0) return
         do i = 1, desk%n
            values(:, i) = all(:wanted, self%layout%patches%element(desk%first + i))
         end do
         to = c_loc(values(1, 1))
      end subroutine by_layer

      !> States of elements that have not failed.
      subroutine give_back()
         real(c_double), pointer, contiguous :: all(:, :)
         integer :: i
         call c_f_pointer(self%given%states_end, all, [self%states, self%layout%elements])
         do i = 1, desk%n
            if (desk%codes(i) == status_ok) all(:size(end, 1), self%layout%patches%element(desk%first + i)) = end(:, i)
         end do
      end subroutine give_back
   end subroutine compute_elements

   !> A patch without results.
   subroutine nothing(desk, code)
      type(desk_t), intent(inout) :: desk
      integer(c_int32_t), intent(in) :: code
      desk%energy = 0
      desk%force = 0
      desk%matrix = 0
      desk%codes = code
   end subroutine nothing

   function pressure(assembly, elements, p, form, origin, factor, force, values, codes, status) result(code) &
      bind(c, name='finshell_assembly_pressure')
      type(c_ptr), value :: assembly, elements, p, force, values
      integer(c_int32_t), value :: form
      real(c_double), intent(in), optional :: origin(3)
      real(c_double), value :: factor
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_assembly_pressure'
      type(layout_t), pointer :: layout
      type(c_elements_t) :: block
      type(pressure_t) :: job
      code = receive_assembly(place, assembly, layout, status)
      if (code == status_ok) code = read_block(place, elements, block, status)
      if (code == status_ok) code = check_nodes(place, layout, block, .true., status)
      if (code /= status_ok) return
      if (form /= 0 .and. form /= 1) then
         code = refuse(status, place, 'form is #, expected 0 (follower) or 1 (symmetric)', form)
      else if (.not. c_associated(p) .and. layout%elements > 0) then
         code = refuse(status, place, 'pressure is NULL')
      end if
      if (code /= status_ok) return
      if (c_associated(p)) call c_f_pointer(p, job%pressure, [layout%elements])
      if (present(origin)) job%origin = origin
      job%gradient = form == 1
      call aim(job, layout, block, factor, force, values)
      code = sweep(place, job, codes, status=status)
   end function pressure

   function volume(assembly, elements, side, origin, total, gradient, codes, status) result(code) &
      bind(c, name='finshell_assembly_volume')
      type(c_ptr), value :: assembly, elements, side, gradient
      real(c_double), intent(in), optional :: origin(3)
      real(c_double), intent(out), optional :: total
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_assembly_volume'
      type(layout_t), pointer :: layout
      type(c_elements_t) :: block
      type(pressure_t) :: job
      code = receive_assembly(place, assembly, layout, status)
      if (code == status_ok) code = read_block(place, elements, block, status)
      if (code == status_ok) code = check_nodes(place, layout, block, .true., status)
      if (code /= status_ok) return
      if (c_associated(side)) call c_f_pointer(side, job%pressure, [layout%elements])
      if (present(origin)) job%origin = origin
      job%gradient = .true.
      call aim(job, layout, block, 1.0_c_double, gradient)
      code = sweep(place, job, codes, total, status)
   end function volume

   !> Force is that of the pressure, energy the pressure times the volume.
   subroutine compute_pressure(self, desk)
      class(pressure_t), intent(in) :: self
      type(desk_t), intent(inout), target :: desk
      integer :: i
      do i = 1, desk%n
         desk%pressure(i) = 1
         if (associated(self%pressure)) desk%pressure(i) = self%pressure(self%layout%patches%element(desk%first + i))
      end do
      if (all(abs(desk%pressure(:desk%n)) <= 0)) then
         call nothing(desk, status_ok)
      else if (desk%freedoms == n_shell) then
         call press(desk%force, desk%matrix)
      else
         call press_membranes()
      end if

   contains

      !> The elements of a patch, in all freedoms.
      subroutine press(force, matrix)
         real(c_double), intent(out) :: force(n_shell, desk%n)
         real(c_double), intent(inout) :: matrix(n_shell, n_shell, *)
         real(c_double), pointer, contiguous, dimension(:, :, :) :: x, u, r, state, normal
         real(c_double), pointer, contiguous, dimension(:, :) :: direction, toward
         integer, allocatable :: held(:, :)
         type(c_elements_t) :: block
         integer(c_int32_t) :: code
         integer :: e
         block = desk%block
         code = receive('', block, n_shell, x, u, r, state, direction, normal, toward, held)
         if (code /= status_ok) then
            force = 0
            matrix(:, :, :merge(desk%n, 0, self%wants_matrix)) = 0
            desk%energy = 0
            desk%codes = code
            return
         end if
         if (self%wants_matrix) then
            call pressure_elements(desk%n, x, u, r, block%convention, desk%codes, desk%pressure, self%gradient, self%origin, &
                                   desk%energy, force, matrix, state, normal, held)
            do e = 1, desk%n
               if (self%layout%pattern%symmetric) then
                  matrix(:, :, e) = 0.5_c_double*self%factor*(matrix(:, :, e) + transpose(matrix(:, :, e)))
               else
                  matrix(:, :, e) = self%factor*transpose(matrix(:, :, e)) ! rows are the first index of C
               end if
            end do
         else
            call pressure_elements(desk%n, x, u, r, block%convention, desk%codes, desk%pressure, self%gradient, self%origin, &
                                   desk%energy, force, state=state, normal=normal, held=held)
         end if
         desk%energy(:desk%n) = desk%pressure(:desk%n)*desk%energy(:desk%n)
      end subroutine press

      !> Membranes have neither rotations nor normals.
      subroutine press_membranes()
         real(c_double) :: f(n_shell), k(n_shell, n_shell)
         integer :: e
         desk%rotations = 0
         desk%block%convention = rotation_vector
         desk%block%rotations = c_loc(desk%rotations(1, 1, 1))
         desk%block%normals = c_null_ptr
         desk%block%straight = c_null_ptr
         desk%block%toward = c_null_ptr
         call press(desk%force, desk%matrix)
         do e = 1, desk%n ! the displacements, one element behind the other: what is small moves to the front
            f = desk%force(n_shell*(e - 1) + 1:n_shell*e)
            desk%force(n_membrane*(e - 1) + 1:n_membrane*e) = f(shell_displacements)
            if (.not. self%wants_matrix) cycle
            k = reshape(desk%matrix(n_shell**2*(e - 1) + 1:n_shell**2*e), [n_shell, n_shell])
            desk%matrix(n_membrane**2*(e - 1) + 1:n_membrane**2*e) = &
               reshape(k(shell_displacements, shell_displacements), [n_membrane**2])
         end do
      end subroutine press_membranes
   end subroutine compute_pressure

   function mass(assembly, sections, section, elements, factor, lumped, values, codes, status) result(code) &
      bind(c, name='finshell_assembly_mass')
      type(c_ptr), value :: assembly, elements, lumped, values
      integer(c_int32_t), value :: sections
      type(c_ptr), intent(in), optional, target :: section(*)
      real(c_double), value :: factor
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_assembly_mass'
      type(layout_t), pointer :: layout
      type(c_elements_t) :: block
      type(mass_t) :: job
      code = receive_assembly(place, assembly, layout, status)
      if (code == status_ok) code = receive_sections(place, layout, sections, section, job%sections, status)
      if (code == status_ok) code = read_block(place, elements, block, status)
      if (code == status_ok) code = check_nodes(place, layout, block, .false., status)
      if (code /= status_ok) return
      call aim(job, layout, by_reference(block), factor, lumped, values)
      code = sweep(place, job, codes, status=status)
   end function mass

   !> A block in which the motion does not count.
   pure function by_reference(block) result(seen)
      type(c_elements_t), intent(in) :: block
      type(c_elements_t) :: seen
      seen = block
      seen%convention = rotation_vector
      seen%u = c_null_ptr
      seen%rotations = c_null_ptr
      seen%state = c_null_ptr
      seen%toward = c_null_ptr
   end function by_reference

   subroutine compute_masses(self, desk)
      class(mass_t), intent(in) :: self
      type(desk_t), intent(inout), target :: desk
      type(section_t), pointer :: s
      real(c_double), pointer, contiguous :: thickness(:), offset(:), growth(:, :, :)
      integer(c_int32_t) :: code
      code = receive_section('', self%sections(desk%section), s)
      if (code == status_ok) call receive_own(as_seen_by(s, desk%block), s, thickness, offset, growth)
      desk%energy = 0
      if (code /= status_ok) then
         call nothing(desk, status_invalid_argument)
      else if (s%membrane) then
         if (self%wants_matrix) then
            call mass_membranes(s, desk%n, desk%x, desk%codes, desk%matrix, desk%force, thickness)
         else
            call mass_membranes(s, desk%n, desk%x, desk%codes, lumped=desk%force, thickness=thickness)
         end if
      else if (self%wants_matrix) then
         call mass_elements(s, desk%n, desk%x, desk%codes, desk%matrix, desk%force, thickness=thickness, offset=offset)
      else
         call mass_elements(s, desk%n, desk%x, desk%codes, lumped=desk%force, thickness=thickness, offset=offset)
      end if
      if (self%wants_matrix) desk%matrix = self%factor*desk%matrix
   end subroutine compute_masses
end module finshell_capi_assemble
