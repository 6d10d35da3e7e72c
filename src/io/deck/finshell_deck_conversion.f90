!> A deck of Abaqus or CalculiX as a namelist: its mesh is read from the deck itself, all else becomes groups. What cannot be
!> expressed is listed, with its line.
module finshell_deck_conversion
   use finshell_deck, only: data_t, deck_t, read_deck
   use finshell_deck_acting, only: write_history
   use finshell_deck_connector, only: convert_connectors, is_truss_section
   use finshell_deck_equation, only: convert_equation
   use finshell_deck_history, only: history_t
   use finshell_deck_joint, only: convert_joints
   use finshell_deck_load, only: convert_boundary, convert_distributed_load, convert_nodal_load
   use finshell_deck_material, only: convert_material, convert_section
   use finshell_deck_mesh, only: mesh_of_deck
   use finshell_deck_plane, only: hold_plane_elements
   use finshell_deck_schedule, only: clock, linear, perturbation, read_schedule, schedule_t, static
   use finshell_deck_writer, only: number_text, quoted, writer_t
   use finshell_deck_temperature, only: convert_temperature
   use finshell_error, only: error_t, text_of
   use finshell_kinds, only: i8, wp
   use finshell_text, only: lower_case, parse_integer
   implicit none
   private
   public :: convert_deck

   character, parameter :: lf = achar(10)

contains

   !> Errors: those of the deck and of its mesh.
   subroutine convert_deck(file_name, namelist, not_taken, error)
      character(len=*), intent(in) :: file_name
      character(len=:), allocatable, intent(out) :: namelist
      character(len=:), allocatable, intent(out) :: not_taken !< a line each, ''
      type(error_t), allocatable, intent(out) :: error
      type(deck_t) :: deck
      type(writer_t) :: writer
      type(data_t) :: line
      type(history_t) :: history
      type(schedule_t) :: schedule
      integer :: c, k, last

      call writer%begin()
      call read_deck(file_name, deck, error)
      if (.not. allocated(error)) call mesh_of_deck(deck, writer%mesh, error)
      if (allocated(error)) return
      call convert_connectors(deck, writer)
      call convert_joints(deck, writer)
      call hold_plane_elements(deck, writer)
      call read_schedule(deck, schedule)
      call history%begin(schedule)
      c = 0
      do while (c < size(deck%cards))
         c = c + 1
         select case (deck%cards(c)%keyword)
         case ('HEADING')
            call deck%start(c, line)
            if (deck%next(line)) then
               writer%title = line%field(1)%text
               do k = 2, line%fields
                  writer%title = writer%title//', '//line%field(k)%text
               end do
            end if
         case ('MATERIAL')
            call convert_material(deck, c, last, writer)
            c = last
         case ('SHELL SECTION', 'MEMBRANE SECTION', 'SOLID SECTION')
            if (.not. is_truss_section(deck, c)) call convert_section(deck, c, writer)
         case ('EQUATION'); call convert_equation(deck, c, writer)
         case ('BOUNDARY'); call convert_boundary(deck, c, writer, history)
         case ('CLOAD'); call convert_nodal_load(deck, c, writer, history)
         case ('DLOAD', 'DSLOAD'); call convert_distributed_load(deck, c, writer, history)
         case ('TEMPERATURE'); call convert_temperature(deck, c, writer, history)
         case ('INITIAL CONDITIONS')
            if (lower_case(deck%cards(c)%value('TYPE')) /= 'temperature') call writer%miss(deck, c, '')
         case ('STEP')
            call history%end_step()
            history%step = history%step + 1
         case ('STATIC', 'BUCKLE', 'FREQUENCY', 'DYNAMIC')
            if (history%step > 0) call convert_step(deck, c, schedule, history%step, writer)
         case ('NODE', 'ELEMENT', 'SPRING', 'DASHPOT', 'MASS', &
               'NSET', 'ELSET', 'SURFACE', 'PART', 'END PART', 'ASSEMBLY', 'END ASSEMBLY', 'INSTANCE', &
               'END INSTANCE', 'END STEP', 'ORIENTATION', 'AMPLITUDE', 'TIE', 'RIGID BODY', 'COUPLING', 'KINEMATIC', &
               'KINEMATIC COUPLING', 'MPC')
            continue ! the mesh, or what others refer to
         case ('PREPRINT', 'RESTART', 'OUTPUT', 'NODE OUTPUT', 'ELEMENT OUTPUT', 'ENERGY OUTPUT', 'CONTACT OUTPUT', 'NODE PRINT', &
               'EL PRINT', 'NODE FILE', 'EL FILE', 'ENERGY PRINT', 'MONITOR', 'FILE FORMAT', 'PRINT')
            continue ! output has groups of its own
         case default
            call writer%miss(deck, c, '')
         end select
      end do
      call history%end_step()
      call write_history(history, writer)
      if (writer%steps == '') writer%steps = '&step /'//lf
      namelist = '! From '//file_name//' by finshell convert.'//lf
      not_taken = writer%not_taken
      call comment(not_taken)
      if (writer%title /= '') namelist = namelist//'&job title = '//quoted(writer%title)//' /'//lf
      namelist = namelist//'&mesh file = '//quoted(file_name(index(file_name, '/', back=.true.) + 1:))//' /'//lf//writer%sets &
         //writer%materials//writer%sections//writer%joints//writer%supports//writer%amplitudes//writer%loads//writer%steps

   contains

      !> What was not taken, as comments.
      subroutine comment(text)
         character(len=*), intent(in) :: text
         integer :: begin, length
         begin = 1
         do while (begin <= len(text))
            length = index(text(begin:), lf)
            if (begin == 1) namelist = namelist//'! NOT TAKEN:'//lf
            namelist = namelist//'!   '//text(begin:begin + length - 1)
            begin = begin + length
         end do
      end subroutine comment
   end subroutine convert_deck

   !> *STATIC, *BUCKLE, *FREQUENCY, *DYNAMIC.
   subroutine convert_step(deck, c, schedule, k_step, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(schedule_t), intent(in) :: schedule
      integer, intent(in) :: k_step
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      character(len=:), allocatable :: set
      real(wp) :: x(8)
      integer(i8) :: component
      integer :: k
      logical :: ok

      x = 0
      call deck%start(c, line)
      if (deck%next(line)) then
         do k = 1, min(size(x), line%fields)
            call line%number(k, x(k), ok)
         end do
      else
         line%fields = 0
      end if
      associate (step => schedule%steps(k_step))
         select case (deck%cards(c)%keyword)
         case ('BUCKLE', 'FREQUENCY')
            writer%steps = writer%steps//'&step control = '//trim(merge("'buckling'   ", "'frequencies'", &
            deck%cards(c)%keyword == 'BUCKLE'))//' modes = '//text_of(max(1, nint(x(1))))//' /'//lf
         case ('DYNAMIC')
            if (deck%cards(c)%has('EXPLICIT')) then
               writer%steps = writer%steps//"&step control = 'explicit' duration = "//number_text(x(2))
            else
               writer%steps = writer%steps//"&step control = 'dynamic' duration = "//number_text(x(2))
               if (x(1) > 0) writer%steps = writer%steps//' first_increment = '//number_text(x(1))
               if (deck%cards(c)%has('DIRECT')) writer%steps = writer%steps//' automatic = .false.'
            end if
            if (schedule%way == clock) writer%steps = writer%steps//' times = '//number_text(x(2))//' factors = ' &
            //number_text(step%last)
            writer%steps = writer%steps//' /'//lf
         case default
            if (deck%cards(c)%has('RIKS')) then
               writer%steps = writer%steps//"&step control = 'arc_length'"
               if (schedule%way == clock) writer%steps = writer%steps//" case = 'step_"//text_of(step%number)//"'"
               if (x(1) > 0 .and. x(2) > 0) writer%steps = writer%steps//' first_increment = '//number_text(min(1.0_wp, x(1)/x(2)))
               if (x(5) > 0) writer%steps = writer%steps//' load_factor = '//number_text(x(5))
               if (line%fields >= 8) then
                  set = writer%node_set(line%field(6)%text)
                  call parse_integer(line%field(7)%text, component, ok)
                  if (set /= '' .and. ok .and. component >= 1 .and. component <= 3) writer%steps = writer%steps//' node_set = ' &
                  //quoted(set)//' component = '//quoted('xyz' (int(component):int(component)))//' displacements = ' &
                  //number_text(x(8))
               end if
               writer%steps = writer%steps//' /'//lf
            else if (step%kind == perturbation) then
               writer%steps = writer%steps//"&step control = 'linear'"
               if (schedule%way == clock) writer%steps = writer%steps//' load_factor = '//number_text(step%last + 1)
               writer%steps = writer%steps//' /'//lf
            else if (step%kind == static .or. schedule%way == clock) then
               if (step%kind == linear) call writer%miss(deck, c, 'a linear step among others: it has large displacements')
               writer%steps = writer%steps//"&step control = 'load'"
               if (schedule%way == clock) writer%steps = writer%steps//' load_factor = '//number_text(step%last)
               if (x(1) > 0 .and. x(2) > x(1)) writer%steps = writer%steps//' first_increment = '//number_text(x(1)/x(2))
               if (deck%cards(c)%has('DIRECT')) writer%steps = writer%steps//' automatic = .false.'
               writer%steps = writer%steps//' /'//lf
            else
               writer%steps = writer%steps//"&step control = 'linear' /"//lf
            end if
         end select
      end associate
   end subroutine convert_step
end module finshell_deck_conversion
