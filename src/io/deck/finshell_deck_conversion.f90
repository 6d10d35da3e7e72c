!> A deck of Abaqus or CalculiX as a namelist: its mesh is read from the deck itself, all else becomes groups. What cannot be
!> expressed is listed, with its line.
module finshell_deck_conversion
   use finshell_deck, only: data_t, deck_t, read_deck
   use finshell_deck_connector, only: convert_connectors, is_truss_section
   use finshell_deck_equation, only: convert_equation
   use finshell_deck_load, only: convert_boundary, convert_distributed_load, convert_nodal_load
   use finshell_deck_material, only: convert_material, convert_section
   use finshell_deck_mesh, only: mesh_of_deck
   use finshell_deck_writer, only: number_text, quoted, writer_t
   use finshell_error, only: error_t, text_of
   use finshell_kinds, only: i8, wp
   use finshell_text, only: parse_integer
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
      integer :: c, k, last, loaded, step
      logical :: nonlinear

      call writer%begin()
      call read_deck(file_name, deck, error)
      if (.not. allocated(error)) call mesh_of_deck(deck, writer%mesh, error)
      if (allocated(error)) return
      call convert_connectors(deck, writer)
      step = 0
      loaded = 0
      nonlinear = .false.
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
         case ('BOUNDARY')
            if (loaded > 0 .and. step > loaded) call writer%miss(deck, c, 'it counts for all steps')
            call convert_boundary(deck, c, writer)
         case ('EQUATION'); call convert_equation(deck, c, writer)
         case ('CLOAD', 'DLOAD', 'DSLOAD')
            if (loaded > 0 .and. step > loaded) then
               call writer%miss(deck, c, 'loads of a second step; all steps have the loads of the first')
               cycle
            end if
            loaded = step
            if (deck%cards(c)%keyword == 'CLOAD') call convert_nodal_load(deck, c, writer)
            if (deck%cards(c)%keyword /= 'CLOAD') call convert_distributed_load(deck, c, writer)
         case ('STEP')
            step = step + 1
            nonlinear = deck%cards(c)%has('NLGEOM')
            if (nonlinear) nonlinear = deck%cards(c)%value('NLGEOM') /= 'NO' .and. deck%cards(c)%value('NLGEOM') /= 'no'
         case ('STATIC', 'BUCKLE', 'FREQUENCY', 'DYNAMIC'); call convert_step(deck, c, nonlinear, writer)
         case ('NODE', 'ELEMENT', 'SPRING', 'DASHPOT', 'MASS', &
               'NSET', 'ELSET', 'SURFACE', 'PART', 'END PART', 'ASSEMBLY', 'END ASSEMBLY', 'INSTANCE', &
               'END INSTANCE', 'END STEP', 'ORIENTATION')
            continue ! the mesh, or what others refer to
         case ('PREPRINT', 'RESTART', 'OUTPUT', 'NODE OUTPUT', 'ELEMENT OUTPUT', 'ENERGY OUTPUT', 'CONTACT OUTPUT', 'NODE PRINT', &
               'EL PRINT', 'NODE FILE', 'EL FILE', 'ENERGY PRINT', 'MONITOR', 'FILE FORMAT', 'PRINT')
            continue ! output has groups of its own
         case default
            call writer%miss(deck, c, '')
         end select
      end do
      if (writer%steps == '') writer%steps = '&step /'//lf
      namelist = '! From '//file_name//' by finshell convert.'//lf
      not_taken = writer%not_taken
      call comment(not_taken)
      if (writer%title /= '') namelist = namelist//'&job title = '//quoted(writer%title)//' /'//lf
      namelist = namelist//'&mesh file = '//quoted(file_name(index(file_name, '/', back=.true.) + 1:))//' /'//lf//writer%sets &
         //writer%materials//writer%sections//writer%supports//writer%loads//writer%steps

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
   subroutine convert_step(deck, c, nonlinear, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      logical, intent(in) :: nonlinear
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
      select case (deck%cards(c)%keyword)
      case ('BUCKLE', 'FREQUENCY')
         writer%steps = writer%steps//'&step control = '//trim(merge("'buckling'   ", "'frequencies'", &
            deck%cards(c)%keyword == 'BUCKLE'))//' modes = '//text_of(max(1, nint(x(1))))//' /'//lf
      case ('DYNAMIC')
         if (deck%cards(c)%has('EXPLICIT')) then
            writer%steps = writer%steps//"&step control = 'explicit' duration = "//number_text(x(2))//' /'//lf
         else
            writer%steps = writer%steps//"&step control = 'dynamic' duration = "//number_text(x(2))
            if (x(1) > 0) writer%steps = writer%steps//' first_increment = '//number_text(x(1))
            writer%steps = writer%steps//' /'//lf
         end if
      case default
         if (deck%cards(c)%has('RIKS')) then
            writer%steps = writer%steps//"&step control = 'arc_length'"
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
         else if (nonlinear) then
            writer%steps = writer%steps//"&step control = 'load'"
            if (x(1) > 0 .and. x(2) > x(1)) writer%steps = writer%steps//' first_increment = '//number_text(x(1)/x(2))
            if (deck%cards(c)%has('DIRECT')) writer%steps = writer%steps//' automatic = .false.'
            writer%steps = writer%steps//' /'//lf
         else
            writer%steps = writer%steps//"&step control = 'linear' /"//lf
         end if
      end select
   end subroutine convert_step
end module finshell_deck_conversion
