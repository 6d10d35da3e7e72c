!> Plane elements of a deck: held in their plane, loaded on their sides.
module finshell_deck_plane
   use finshell_deck, only: data_t, deck_t
   use finshell_deck_sets, only: is_plane_type
   use finshell_deck_writer, only: quoted, writer_t
   use finshell_kinds, only: i8, wp
   use finshell_mesh_sorting, only: position_in_sorted, sorted_order
   use finshell_text, only: lower_case
   implicit none
   private
   public :: hold_plane_elements, side_thickness

   character, parameter :: lf = achar(10)

contains

   !> A support out of the plane for the nodes that only plane elements have.
   subroutine hold_plane_elements(deck, writer)
      type(deck_t), intent(in) :: deck
      type(writer_t), intent(inout) :: writer
      type(data_t) :: line
      integer(i8), allocatable :: tags(:)
      integer(i8) :: tag
      logical, allocatable :: flat(:), inside(:)
      integer :: c, e, i, n
      logical :: ok
      character(len=:), allocatable :: set

      n = 0
      allocate (tags(size(writer%mesh%element_tags)))
      do c = 1, size(deck%cards)
         if (deck%cards(c)%keyword /= 'ELEMENT') cycle
         if (.not. is_plane_type(deck%cards(c)%value('TYPE'))) cycle
         if (index(lower_case(deck%cards(c)%value('TYPE')), 'cpe') == 1) &
            call writer%miss(deck, c, 'plane strain: it is taken as plane stress')
         call deck%start(c, line)
         do while (deck%next(line))
            call line%whole(1, tag, ok)
            if (.not. ok .or. n == size(tags)) cycle
            n = n + 1
            tags(n) = tag
         end do
      end do
      if (n == 0) return
      tags = tags(:n)
      tags = tags(sorted_order(tags))
      associate (mesh => writer%mesh)
         flat = [(position_in_sorted(tags, mesh%element_tags(e)) > 0, e=1, size(mesh%element_tags))]
         set = 'all'
         allocate (inside(size(mesh%coordinates, 2)), source=.false.)
         do e = 1, size(flat)
            if (flat(e)) inside(mesh%triangles(:, e)) = .true.
         end do
         do e = 1, size(flat)
            if (.not. flat(e)) inside(mesh%triangles(:, e)) = .false.
         end do
         ! a node that depends on another is held by that one
         do i = 1, size(writer%bodies)
            associate (body => writer%bodies(i))
               if (body%reference /= '' .and. any(inside(pack(body%members, body%members > 0)))) &
                  writer%supports = writer%supports//'&support node_set = '//quoted(body%reference)//" fixed = 'uz' 'rx' 'ry' /"//lf
               inside(pack(body%members, body%members > 0)) = .false.
            end associate
         end do
         if (.not. all(inside)) then
            if (.not. any(inside)) return
            set = writer%list_set('node_set', pack([(i, i=1, size(inside))], inside))
         end if
      end associate
      writer%supports = writer%supports//'&support node_set = '//quoted(set)//" fixed = 'uz' 'rx' 'ry' /"//lf
   end subroutine hold_plane_elements

   !> The thickness of the plane elements of a set, or of all; 0: there is none, or there are several.
   real(wp) function side_thickness(deck, writer, set, of_all)
      type(deck_t), intent(in) :: deck
      type(writer_t), intent(inout) :: writer
      character(len=*), intent(in) :: set
      logical, intent(in) :: of_all
      type(data_t) :: line
      integer, allocatable :: members(:), mine(:)
      logical, allocatable :: inside(:)
      character(len=:), allocatable :: name
      real(wp) :: thickness
      integer :: c
      logical :: ok

      side_thickness = 0
      members = writer%members_of('element_set', set)
      allocate (inside(size(writer%mesh%element_tags)))
      do c = 1, size(deck%cards)
         if (deck%cards(c)%keyword /= 'SOLID SECTION') cycle
         name = writer%element_set(deck%cards(c)%value('ELSET'))
         if (name == '') cycle
         mine = writer%members_of('element_set', name)
         if (.not. of_all) then
            inside = .false.
            inside(members) = .true.
            if (.not. any(inside(mine))) cycle
         end if
         call deck%start(c, line)
         thickness = 1
         if (deck%next(line)) call line%number(1, thickness, ok)
         if (side_thickness > 0 .and. abs(thickness - side_thickness) > 0) then
            side_thickness = 0
            return
         end if
         side_thickness = thickness
      end do
   end function side_thickness
end module finshell_deck_plane
