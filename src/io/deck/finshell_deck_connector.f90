!> Springs, dashpots, masses and trusses of a deck as connectors: SPRINGA, SPRING1, SPRING2, DASHPOTA, MASS, T3D2. Nodes without
!> a shell become groups &node.
module finshell_deck_connector
   use finshell_deck, only: data_t, deck_t
   use finshell_deck_writer, only: number_text, quoted, vector_text, writer_t
   use finshell_kinds, only: i8, wp
   use finshell_text, only: lower_case
   implicit none
   private
   public :: convert_connectors, is_truss_section, add_node

   character, parameter :: lf = achar(10)

contains

   !> All of them. To be called before what refers to their nodes.
   subroutine convert_connectors(deck, writer)
      type(deck_t), intent(in) :: deck
      type(writer_t), intent(inout) :: writer
      integer :: c, p
      do c = 1, size(deck%cards)
         if (deck%cards(c)%keyword /= 'ELEMENT') cycle
         if (property_of(lower_case(deck%cards(c)%value('TYPE'))) == '') cycle
         p = find_property(deck, c)
         if (p == 0) then
            call writer%miss(deck, c, 'there is no *'//property_of(lower_case(deck%cards(c)%value('TYPE'))) &
               //' with the ELSET of these elements')
         else
            call convert_elements(deck, c, p, writer)
         end if
      end do
   end subroutine convert_connectors

   !> The card that gives elements of a type what they need; '': they are no connectors.
   pure function property_of(type_name) result(keyword)
      character(len=*), intent(in) :: type_name
      character(len=:), allocatable :: keyword
      select case (type_name)
      case ('springa', 'spring1', 'spring2'); keyword = 'SPRING'
      case ('dashpota'); keyword = 'DASHPOT'
      case ('mass'); keyword = 'MASS'
      case ('t3d2'); keyword = 'SOLID SECTION'
      case default; keyword = ''
      end select
   end function property_of

   !> The number of that card for the elements of card c; 0: there is none.
   integer function find_property(deck, c) result(p)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      character(len=:), allocatable :: keyword, set
      keyword = property_of(lower_case(deck%cards(c)%value('TYPE')))
      set = lower_case(deck%cards(c)%value('ELSET'))
      do p = size(deck%cards), 1, -1
         if (deck%cards(p)%keyword == keyword .and. set /= '' .and. lower_case(deck%cards(p)%value('ELSET')) == set) return
      end do
   end function find_property

   !> Does a *SOLID SECTION belong to trusses?
   logical function is_truss_section(deck, p)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: p
      integer :: c
      is_truss_section = .false.
      do c = 1, size(deck%cards)
         if (deck%cards(c)%keyword /= 'ELEMENT') cycle
         if (lower_case(deck%cards(c)%value('TYPE')) /= 't3d2') cycle
         if (lower_case(deck%cards(c)%value('ELSET')) == lower_case(deck%cards(p)%value('ELSET'))) is_truss_section = .true.
      end do
   end function is_truss_section

   subroutine convert_elements(deck, c, p, writer)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c, p
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      character(len=:), allocatable :: ends, kind, values, tag
      real(wp) :: x(8, 2), young, density
      integer :: i, rows, k
      integer(i8) :: unused
      logical :: ok

      kind = lower_case(deck%cards(c)%value('TYPE'))
      if (deck%cards(p)%has('NONLINEAR')) then
         call writer%miss(deck, p, 'NONLINEAR')
         return
      end if
      x = 0
      rows = 0
      call deck%start(p, line)
      do while (deck%next(line) .and. rows < 2)
         rows = rows + 1
         do i = 1, min(size(x, 1), line%fields)
            call line%number(i, x(i, rows), ok)
         end do
      end do
      if (rows == 2) k = 2
      if (rows < 2) k = 1
      values = number_text(x(1, k))
      select case (kind)
      case ('mass'); values = '&point_mass mass = '//values
      case ('springa'); values = "&spring type = 'line' stiffness = "//values
      case ('dashpota'); values = "&dashpot type = 'line' viscosity = "//values
      case ('spring1', 'spring2')
         i = nint(x(1, 1))
         if (rows < 2 .or. i < 1 .or. i > 6 .or. (kind == 'spring2' .and. nint(x(2, 1)) /= i)) then
            call writer%miss(deck, p, 'one degree of freedom, 1 to 6, the same at both ends, and a stiffness are expected')
            return
         end if
         values = "&spring type = 'axis' direction = "//unit(i)//' stiffness = '//values
         if (i > 3) values = "&spring type = 'hinge' direction = "//unit(i - 3)//' stiffness = '//number_text(x(1, k))
      case default
         call find_material(deck, lower_case(deck%cards(p)%value('MATERIAL')), young, density)
         if (.not. (young > 0 .and. x(1, k) > 0)) then
            call writer%miss(deck, p, 'an area and a material with *ELASTIC are expected')
            return
         end if
         values = '&bar young = '//number_text(young)//' area = '//values
         if (density > 0) values = values//' mass_per_length = '//number_text(density*x(1, k))
      end select
      call deck%start(c, line)
      do while (deck%next(line))
         tag = line%field(1)%text
         call line%whole(1, unused, ok)
         ends = ''
         if (ok .and. line%fields == merge(2, 3, kind == 'mass' .or. kind == 'spring1')) then
            call add_node(deck, line%field(2)%text, writer)
            ends = " name = 'element_"//tag//"' node_set = "//quoted(writer%node_set(line%field(2)%text))
            if (line%fields == 3) then
               call add_node(deck, line%field(3)%text, writer)
               ends = ends//' to = '//quoted(writer%node_set(line%field(3)%text))
            end if
         end if
         if (ends == '' .or. index(ends, "''") > 0) then
            call writer%miss(deck, c, 'an element number and its nodes are expected', line%line)
         else
            writer%loads = writer%loads//values//ends//' /'//lf
         end if
      end do
   end subroutine convert_elements

   !> A direction of the global axes.
   pure function unit(i) result(text)
      integer, intent(in) :: i
      character(len=:), allocatable :: text
      real(wp) :: d(3)
      d = 0
      d(i) = 1
      text = vector_text(d)
   end function unit

   !> Young's modulus and density of a material; 0: there is none.
   subroutine find_material(deck, name, young, density)
      type(deck_t), intent(in) :: deck
      character(len=*), intent(in) :: name
      real(wp), intent(out) :: young, density
      type(data_t) :: line
      logical :: inside, ok
      integer :: c
      young = 0
      density = 0
      inside = .false.
      do c = 1, size(deck%cards)
         if (deck%cards(c)%keyword == 'MATERIAL') inside = lower_case(deck%cards(c)%value('NAME')) == name
         if (.not. inside .or. (deck%cards(c)%keyword /= 'ELASTIC' .and. deck%cards(c)%keyword /= 'DENSITY')) cycle
         call deck%start(c, line)
         if (.not. deck%next(line)) cycle
         if (deck%cards(c)%keyword == 'ELASTIC') call line%number(1, young, ok)
         if (deck%cards(c)%keyword == 'DENSITY') call line%number(1, density, ok)
      end do
   end subroutine find_material

   !> A node of no shell becomes a group &node, once.
   subroutine add_node(deck, field, writer)
      type(deck_t), intent(in) :: deck
      character(len=*), intent(in) :: field
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      real(wp) :: x(3)
      integer :: c, k
      logical :: ok
      if (writer%node_set(field) /= '') return
      do c = 1, size(deck%cards)
         if (deck%cards(c)%keyword /= 'NODE') cycle
         call deck%start(c, line)
         do while (deck%next(line))
            if (line%field(1)%text /= field) cycle
            do k = 1, 3
               call line%number(k + 1, x(k), ok)
            end do
            writer%sets = writer%sets//"&node name = 'node_"//field//"' position = "//vector_text(x)//' /'//lf
            return
         end do
      end do
   end subroutine add_node
end module finshell_deck_connector
