!> Sets and surfaces of an Abaqus or CalculiX deck.
!>
!> A surface of element edges (E1, ...) becomes an edge set, one of faces an element set, one of nodes a node set.
module finshell_deck_sets
   use finshell_deck, only: data_t, deck_t
   use finshell_error, only: error_t
   use finshell_kinds, only: i8
   use finshell_mesh, only: add_edge_set, add_element_set, add_node_set, mesh_t
   use finshell_mesh_sorting, only: sorted_order
   use finshell_raw_mesh, only: raw_mesh_t
   use finshell_text, only: lower_case
   implicit none
   private
   public :: deck_sets_t, read_set, read_surface, read_side_loads, side_name, is_plane_type, find_set, add_tag, enter_sets

   !> A set of nodes or elements: numbers of the deck.
   type :: set_t
      character(len=:), allocatable :: name
      logical :: of_nodes = .true.
      integer :: count = 0
      integer(i8), allocatable :: tags(:)
   end type set_t

   type :: deck_sets_t
      type(set_t), allocatable :: sets(:)
      type(set_t), allocatable :: sides(:) !< surfaces of element edges; tags: four times an element's, and its side from 0 on
      integer :: elements = 0
      integer(i8), allocatable :: element_tags(:), element_nodes(:, :) !< (9, :) of surface elements as in the deck; 0: none
      logical, allocatable :: plane(:) !< whether the element is a plane one
   end type deck_sets_t

   integer(i8), parameter :: sides = 4 !< that an element may have

contains

   !> *NSET, *ELSET: numbers, ranges (GENERATE), or names of sets.
   subroutine read_set(deck, c, kind, content, error)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      character(len=*), intent(in) :: kind
      type(deck_sets_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      type(data_t) :: line
      integer(i8) :: last, step, tag
      integer :: i, other, set
      logical :: ok(3)

      if (deck%cards(c)%value(kind) == '') then
         call deck%complain(c, kind//' = name is expected', error)
         return
      end if
      call find_set(content, deck%cards(c)%value(kind), kind == 'NSET', set)
      call deck%start(c, line)
      do while (deck%next(line))
         if (deck%cards(c)%has('GENERATE')) then
            step = 1
            ok(3) = .true.
            call line%whole(1, tag, ok(1))
            call line%whole(2, last, ok(2))
            if (line%fields > 2) call line%whole(3, step, ok(3))
            if (.not. all(ok) .or. step < 1 .or. (last - tag)/max(step, 1_i8) > huge(1)) then
               call deck%complain(c, 'first, last and step of a range are expected', error, line%line)
               return
            end if
            do while (tag <= last)
               call add_tag(content%sets(set), tag)
               tag = tag + step
            end do
         else
            do i = 1, line%fields
               call line%whole(i, tag, ok(1))
               if (ok(1)) then
                  call add_tag(content%sets(set), tag)
               else if (line%field(i)%text /= '') then
                  other = position_of(content, without_instance(line%field(i)%text), kind == 'NSET')
                  if (other == 0) then
                     call deck%complain(c, no_set(line%field(i)%text), error, line%line)
                     return
                  end if
                  call add_tags(content%sets(set), content%sets(other))
               end if
            end do
         end if
      end do
   end subroutine read_set

   !> *SURFACE of nodes, element faces or element edges.
   subroutine read_surface(deck, c, content, error)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(deck_sets_t), intent(inout) :: content
      type(error_t), allocatable, intent(inout) :: error
      type(data_t) :: line
      character(len=:), allocatable :: face, name
      integer(i8) :: tag
      integer :: i, other, set, side
      logical :: nodes, ok

      name = deck%cards(c)%value('NAME')
      if (name == '') then
         call deck%complain(c, 'NAME = name is expected', error)
         return
      end if
      nodes = lower_case(deck%cards(c)%value('TYPE')) == 'node'
      call deck%start(c, line)
      do while (deck%next(line))
         face = ''
         if (line%fields > 1) face = lower_case(line%field(2)%text)
         call line%whole(1, tag, ok)
         other = 0
         if (.not. ok) other = position_of(content, without_instance(line%field(1)%text), nodes)
         side = 0
         if (len(face) == 2 .and. .not. nodes) then
            if (other > 0) tag = first_tag(content%sets(other))
            if (face(1:1) == 'e') side = index('1234', face(2:2))
            ! of a plane element S1 is a side; of a shell S1 and S2 are its faces, S3 a side
            if (face(1:1) == 's') side = index(merge('1234', '3456', of_plane(content, tag)), face(2:2))
         end if
         if (.not. ok .and. other == 0) then
            call deck%complain(c, no_set(line%field(1)%text), error, line%line)
            return
         end if
         if (side > 0) then
            call find_surface(content, name, set)
            if (ok) call add_tag(content%sides(set), sides*tag + side - 1)
            if (.not. ok) then
               do i = 1, content%sets(other)%count
                  call add_tag(content%sides(set), sides*content%sets(other)%tags(i) + side - 1)
               end do
            end if
         else
            call find_set(content, name, nodes, set)
            if (ok) call add_tag(content%sets(set), tag)
            if (.not. ok) call add_tags(content%sets(set), content%sets(other))
         end if
      end do
   end subroutine read_surface

   !> Surfaces of the sides that *DLOAD names by P1 to P4 or EDNOR1 to EDNOR4, under the name `side_name`.
   subroutine read_side_loads(deck, c, content)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: c
      type(deck_sets_t), intent(inout) :: content
      type(data_t) :: line
      character(len=:), allocatable :: label, name
      integer(i8) :: tag
      integer :: i, other, set, side
      logical :: ok
      call deck%start(c, line)
      do while (deck%next(line))
         if (line%fields < 2) cycle
         label = lower_case(line%field(2)%text)
         side = 0
         if (len(label) > 1) side = index('1234', label(len(label):))
         if (side == 0) cycle
         if (label(:len(label) - 1) /= 'p' .and. label(:len(label) - 1) /= 'ednor') cycle
         name = side_name(line%field(1)%text, label)
         if (any([(content%sides(i)%name == name, i=1, size(content%sides))])) cycle
         call line%whole(1, tag, ok)
         other = 0
         if (.not. ok) other = position_of(content, without_instance(line%field(1)%text), .false.)
         if (.not. ok .and. other == 0) cycle
         call find_surface(content, name, set)
         if (ok) call add_tag(content%sides(set), sides*tag + side - 1)
         if (.not. ok) then
            do i = 1, content%sets(other)%count
               call add_tag(content%sides(set), sides*content%sets(other)%tags(i) + side - 1)
            end do
         end if
      end do
   end subroutine read_side_loads

   !> The name of the edge set of a side, by the words of a line of *DLOAD.
   pure function side_name(set, label) result(name)
      character(len=*), intent(in) :: set, label
      character(len=:), allocatable :: name
      name = lower_case(set)//'_side_'//label(max(1, len(label)):)
   end function side_name

   !> Whether a type of elements is plane.
   pure logical function is_plane_type(name)
      character(len=*), intent(in) :: name
      is_plane_type = index(lower_case(name), 'cps') == 1 .or. index(lower_case(name), 'cpe') == 1
   end function is_plane_type

   pure logical function of_plane(content, tag)
      type(deck_sets_t), intent(in) :: content
      integer(i8), intent(in) :: tag
      integer :: i
      i = findloc(content%element_tags(:content%elements), tag, dim=1)
      of_plane = .false.
      if (i > 0) of_plane = content%plane(i)
   end function of_plane

   pure integer(i8) function first_tag(set)
      type(set_t), intent(in) :: set
      first_tag = 0
      if (set%count > 0) first_tag = set%tags(1)
   end function first_tag

   pure function no_set(found) result(text)
      character(len=*), intent(in) :: found
      character(len=:), allocatable :: text
      text = "found '"//found//"' where a number or the name of a set defined before is expected"
   end function no_set

   pure function without_instance(word) result(name)
      character(len=*), intent(in) :: word
      character(len=:), allocatable :: name
      name = word(index(word, '.', back=.true.) + 1:)
   end function without_instance

   !> The position of a set, 0: there is none. Names do not tell capitals.
   pure integer function position_of(content, name, of_nodes) result(position)
      type(deck_sets_t), intent(in) :: content
      character(len=*), intent(in) :: name
      logical, intent(in) :: of_nodes
      do position = size(content%sets), 1, -1
         if (content%sets(position)%of_nodes .neqv. of_nodes) cycle
         if (lower_case(content%sets(position)%name) == lower_case(name)) return
      end do
      position = 0
   end function position_of

   !> The position of a set, which is made if it is not there.
   subroutine find_set(content, name, of_nodes, position)
      type(deck_sets_t), intent(inout) :: content
      character(len=*), intent(in) :: name
      logical, intent(in) :: of_nodes
      integer, intent(out) :: position
      position = position_of(content, name, of_nodes)
      if (position > 0) return
      content%sets = [content%sets, set_t(name, of_nodes)]
      position = size(content%sets)
   end subroutine find_set

   !> The position of a surface of element edges, which is made if it is not there.
   subroutine find_surface(content, name, position)
      type(deck_sets_t), intent(inout) :: content
      character(len=*), intent(in) :: name
      integer, intent(out) :: position
      do position = size(content%sides), 1, -1
         if (content%sides(position)%name == name) return
      end do
      content%sides = [content%sides, set_t(name, .false.)]
      position = size(content%sides)
   end subroutine find_surface

   pure subroutine add_tag(set, tag)
      type(set_t), intent(inout) :: set
      integer(i8), intent(in) :: tag
      integer(i8), allocatable :: grown(:)
      if (.not. allocated(set%tags)) allocate (set%tags(16))
      if (set%count == size(set%tags)) then
         allocate (grown(2*set%count))
         grown(:set%count) = set%tags
         call move_alloc(grown, set%tags)
      end if
      set%count = set%count + 1
      set%tags(set%count) = tag
   end subroutine add_tag

   pure subroutine add_tags(set, other)
      type(set_t), intent(inout) :: set
      type(set_t), intent(in) :: other
      integer :: i
      do i = 1, other%count
         call add_tag(set, other%tags(i))
      end do
   end subroutine add_tags

   !> Sets and surfaces, by numbers of the mesh.
   subroutine enter_sets(content, raw, mesh)
      type(deck_sets_t), intent(in) :: content
      type(raw_mesh_t), intent(in) :: raw
      type(mesh_t), intent(inout) :: mesh
      integer, allocatable :: order(:), members(:)
      integer(i8), allocatable :: tags(:)
      integer :: at, i, k, n

      mesh%empty_sets = ''
      associate (list => raw%elements(2))
         order = sorted_order(list%tags(:list%count))
         tags = list%tags(order)
      end associate
      do i = 1, size(content%sets)
         associate (set => content%sets(i))
            if (set%name == 'all') cycle
            allocate (members(0))
            if (set%of_nodes) then
               members = [(raw%number_of(set%tags(k)), k=1, set%count)]
               members = pack(members, members > 0)
               if (size(members) > 0) call add_node_set(mesh, set%name, members, grows=.true.)
            else
               n = 0
               deallocate (members)
               allocate (members(size(tags)))
               do k = 1, set%count
                  at = first_of(tags, set%tags(k))
                  do while (at > 0 .and. at <= size(tags))
                     if (tags(at) /= set%tags(k) .or. n == size(members)) exit
                     n = n + 1
                     members(n) = order(at)
                     at = at + 1
                  end do
               end do
               members = members(:n)
               if (n > 0) call add_element_set(mesh, set%name, members)
            end if
            if (size(members) == 0) mesh%empty_sets = mesh%empty_sets//'"'//set%name//'"'
            deallocate (members)
         end associate
      end do
      call enter_sides(content, raw, mesh)
   end subroutine enter_sets

   !> Surfaces of element edges. A side of second order is two edges.
   subroutine enter_sides(content, raw, mesh)
      type(deck_sets_t), intent(in) :: content
      type(raw_mesh_t), intent(in) :: raw
      type(mesh_t), intent(inout) :: mesh
      integer, allocatable :: edges(:, :), order(:)
      integer(i8), allocatable :: tags(:)
      integer :: a, b, corners, e, i, k, m, n, side
      order = sorted_order(content%element_tags(:content%elements))
      tags = content%element_tags(order)
      do i = 1, size(content%sides)
         associate (surface => content%sides(i))
            n = 0
            allocate (edges(2, 2*surface%count))
            do k = 1, surface%count
               e = first_of(tags, surface%tags(k)/sides)
               if (e == 0) cycle
               side = int(mod(surface%tags(k), sides)) + 1
               associate (nodes => content%element_nodes(:, order(e)))
                  corners = merge(4, 3, count(nodes > 0) == 4 .or. count(nodes > 0) >= 8)
                  if (side > corners) cycle
                  a = raw%number_of(nodes(side))
                  b = raw%number_of(nodes(1 + mod(side, corners)))
                  m = 0
                  if (count(nodes > 0) >= 6) m = raw%number_of(nodes(corners + side))
               end associate
               if (m > 0) then
                  edges(:, n + 1) = [a, m]
                  edges(:, n + 2) = [m, b]
                  n = n + 2
               else
                  n = n + 1
                  edges(:, n) = [a, b]
               end if
            end do
            if (n > 0) call add_edge_set(mesh, surface%name, edges(:, :n))
            deallocate (edges)
         end associate
      end do
   end subroutine enter_sides

   !> The first position of a value in an ascending list that may have it several times; 0: it is not there.
   pure integer function first_of(list, value)
      integer(i8), intent(in) :: list(:), value
      integer :: low, high, middle
      low = 1
      high = size(list) + 1
      do while (low < high)
         middle = low + (high - low)/2
         if (list(middle) < value) low = middle + 1
         if (list(middle) >= value) high = middle
      end do
      first_of = 0
      if (low > size(list)) return
      if (list(low) == value) first_of = low
   end function first_of
end module finshell_deck_sets
