!> What a conversion collects: groups of a namelist, and what was not taken.
module finshell_deck_writer
   use finshell_deck, only: deck_t
   use finshell_error, only: text_of
   use finshell_kinds, only: wp, dp
   use finshell_mesh, only: find_edge_set, find_element_set, find_node_set, mesh_t
   use finshell_mesh_sorting, only: position_in_sorted
   use finshell_kinds, only: i8
   use finshell_text, only: lower_case, parse_integer
   implicit none
   private
   public :: writer_t, alias_t, body_t, quoted, number_text, vector_text

   !> A word of the deck for nodes beside the mesh, or for the rotations of a node.
   type :: alias_t
      character(len=:), allocatable :: word !< in small letters
      character(len=:), allocatable :: set !< node set of the namelist
      integer :: shift = 0 !< of degrees of freedom: 3 where its displacements stand for rotations
   end type alias_t

   !> Nodes of the mesh that depend on others, and the node set of their reference node; '': they go with other nodes of the mesh.
   type :: body_t
      integer, allocatable :: members(:)
      character(len=:), allocatable :: reference
   end type body_t

   !> A material that expands by heat.
   type :: expansion_t
      character(len=:), allocatable :: material, coefficients
   end type expansion_t

   !> What a section is made of: a material in all layers, or in one.
   type :: ply_t
      character(len=:), allocatable :: set, material
      integer :: layer = 0 !< 0: all
   end type ply_t

   type :: writer_t
      type(mesh_t) :: mesh
      character(len=:), allocatable :: title
      character(len=:), allocatable :: sets, materials, sections, joints, supports, amplitudes, loads, steps
      type(alias_t), allocatable :: aliases(:)
      type(body_t), allocatable :: bodies(:)
      type(expansion_t), allocatable :: expansions(:)
      type(ply_t), allocatable :: plies(:)
      character(len=:), allocatable :: not_taken !< a line each
      integer :: listed = 0 !< sets made of lists
   contains
      procedure :: begin
      procedure :: add_expansion
      procedure :: add_ply
      procedure :: miss
      procedure :: node_set
      procedure :: element_set
      procedure :: edge_set
      procedure :: list_set
      procedure :: members_of
      procedure :: shift_of
   end type writer_t

   character, parameter :: lf = achar(10)

contains

   subroutine begin(self)
      class(writer_t), intent(inout) :: self
      self%title = ''
      self%sets = ''
      self%materials = ''
      self%sections = ''
      self%joints = ''
      self%supports = ''
      self%amplitudes = ''
      allocate (self%aliases(0), self%bodies(0), self%expansions(0), self%plies(0))
      self%loads = ''
      self%steps = ''
      self%not_taken = ''
   end subroutine begin

   subroutine add_expansion(self, material, coefficients)
      class(writer_t), intent(inout) :: self
      character(len=*), intent(in) :: material, coefficients
      type(expansion_t) :: new
      new%material = material
      new%coefficients = coefficients
      self%expansions = [self%expansions, new]
   end subroutine add_expansion

   subroutine add_ply(self, set, material, layer)
      class(writer_t), intent(inout) :: self
      character(len=*), intent(in) :: set, material
      integer, intent(in) :: layer !< 0: all
      type(ply_t) :: new
      new%set = set
      new%material = material
      new%layer = layer
      self%plies = [self%plies, new]
   end subroutine add_ply

   !> Something of a card cannot be expressed, or is not known.
   subroutine miss(self, deck, card, what, line)
      class(writer_t), intent(inout) :: self
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: card
      character(len=*), intent(in) :: what !< '': the whole card
      integer, intent(in), optional :: line
      integer :: at
      at = deck%cards(card)%line
      if (present(line)) at = line
      self%not_taken = self%not_taken//deck%sources(deck%cards(card)%source)%file//':'//text_of(at)//': *' &
         //deck%cards(card)%keyword
      if (what /= '') self%not_taken = self%not_taken//': '//what
      self%not_taken = self%not_taken//lf
   end subroutine miss

   !> The node set that a field of the deck names, by its name in the mesh; a node alone gets a set of its own. '': there is none.
   function node_set(self, field) result(name)
      class(writer_t), intent(inout) :: self
      character(len=*), intent(in) :: field
      character(len=:), allocatable :: name
      integer(i8) :: tag
      integer :: i
      logical :: ok
      name = ''
      do i = 1, size(self%aliases)
         if (self%aliases(i)%word /= lower_case(field)) cycle
         name = self%aliases(i)%set
         return
      end do
      call parse_integer(field, tag, ok)
      if (ok) then
         i = position_in_sorted(self%mesh%node_tags, tag)
         name = 'node_'//field
         if (index(self%sets, "&node name = '"//name//"'") > 0) return
         if (i == 0) name = ''
         if (i == 0) return
         if (find_node_set(self%mesh, name) == 0 .and. index(self%sets, "'"//name//"'") == 0) self%sets = self%sets &
            //"&node_set name = '"//name//"' nodes = "//text_of(i)//' /'//lf
         return
      end if
      do i = 1, size(self%mesh%node_sets)
         if (same(self%mesh%node_sets(i)%name, field)) name = self%mesh%node_sets(i)%name
      end do
   end function node_set

   !> The element set that a field of the deck names. '': there is none in the mesh.
   function element_set(self, field) result(name)
      class(writer_t), intent(inout) :: self
      character(len=*), intent(in) :: field
      character(len=:), allocatable :: name
      character(len=:), allocatable :: list
      integer(i8) :: tag
      integer :: i
      logical :: ok
      name = ''
      call parse_integer(field, tag, ok)
      if (ok) then
         list = ''
         do i = 1, size(self%mesh%element_tags)
            if (self%mesh%element_tags(i) == tag) list = list//' '//text_of(i)
         end do
         if (list == '') return
         name = 'element_'//field
         if (find_element_set(self%mesh, name) == 0 .and. index(self%sets, "'"//name//"'") == 0) self%sets = self%sets &
            //"&element_set name = '"//name//"' elements ="//list//' /'//lf
         return
      end if
      do i = 1, size(self%mesh%element_sets)
         if (same(self%mesh%element_sets(i)%name, field)) name = self%mesh%element_sets(i)%name
      end do
   end function element_set

   !> The edge set that a field of the deck names. '': there is none in the mesh.
   pure function edge_set(self, field) result(name)
      class(writer_t), intent(in) :: self
      character(len=*), intent(in) :: field
      character(len=:), allocatable :: name
      integer :: i
      name = ''
      do i = 1, size(self%mesh%edge_sets)
         if (same(self%mesh%edge_sets(i)%name, field)) name = self%mesh%edge_sets(i)%name
      end do
   end function edge_set

   !> By how much degrees of freedom of a node are to be shifted: its displacements may stand for the rotations of another.
   pure integer function shift_of(self, field)
      class(writer_t), intent(in) :: self
      character(len=*), intent(in) :: field
      integer :: i
      shift_of = 0
      do i = 1, size(self%aliases)
         if (self%aliases(i)%word == lower_case(field)) shift_of = self%aliases(i)%shift
      end do
   end function shift_of

   !> A new set of these nodes or elements.
   function list_set(self, key, members) result(name)
      class(writer_t), intent(inout) :: self
      character(len=*), intent(in) :: key !< 'node_set' or 'element_set'
      integer, intent(in) :: members(:)
      character(len=:), allocatable :: name, list
      integer :: i
      list = ''
      do i = 1, size(members)
         if (mod(i, 16) == 1 .and. i > 1) list = list//lf//'  '
         list = list//' '//text_of(members(i))
      end do
      if (key == 'node_set') list = ' nodes ='//list//' /'//lf
      if (key /= 'node_set') list = ' elements ='//list//' /'//lf
      i = index(self%sets, list)
      if (i > 0) then
         ! that list has a name
         name = self%sets(:i - 2)
         name = name(index(name, "'", back=.true.) + 1:)
         return
      end if
      do
         self%listed = self%listed + 1
         name = 'part_'//text_of(self%listed)
         if (find_node_set(self%mesh, name) == 0 .and. find_element_set(self%mesh, name) == 0) exit
      end do
      self%sets = self%sets//'&'//key//" name = '"//name//"'"//list
   end function list_set

   !> The members of a set of the mesh, or of one that `node_set` or `element_set` has made, ascending.
   function members_of(self, key, name) result(members)
      class(writer_t), intent(in) :: self
      character(len=*), intent(in) :: key, name
      integer, allocatable :: members(:)
      integer(i8) :: tag
      integer :: i
      logical :: ok
      members = [integer ::]
      if (key == 'node_set') then
         i = find_node_set(self%mesh, name)
         if (i > 0) members = self%mesh%node_sets(i)%members
         if (i > 0) return
         call parse_integer(name(index(name, '_', back=.true.) + 1:), tag, ok)
         if (.not. ok) return
         i = position_in_sorted(self%mesh%node_tags, tag)
         if (i == 0) i = -int(tag) ! beside the mesh
         members = [i]
      else if (key == 'edge_set') then
         members = [find_edge_set(self%mesh, name)]
      else
         i = find_element_set(self%mesh, name)
         if (i > 0) members = self%mesh%element_sets(i)%members
         if (i > 0) return
         if (name == 'all') members = [(i, i=1, size(self%mesh%element_tags))]
         call parse_integer(name(index(name, '_', back=.true.) + 1:), tag, ok)
         if (ok) members = pack([(i, i=1, size(self%mesh%element_tags))], self%mesh%element_tags == tag)
      end if
   end function members_of

   !> Whether a field of the deck, perhaps with its instance, names a set. Decks do not tell capitals.
   pure logical function same(name, field)
      character(len=*), intent(in) :: name, field
      same = lower_case(name) == lower_case(field(index(field, '.', back=.true.) + 1:))
   end function same

   !> A string of a namelist.
   pure function quoted(text) result(word)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: word
      integer :: i
      word = "'"
      do i = 1, len(text)
         word = word//text(i:i)
         if (text(i:i) == "'") word = word//"'"
      end do
      word = word//"'"
   end function quoted

   !> A number that reads back as the same.
   pure function number_text(x) result(text)
      real(wp), intent(in) :: x
      character(len=:), allocatable :: text
      character(len=40) :: buffer
      integer :: digits
      real(dp) :: back
      do digits = 1, 17
         write (buffer, '(es40.'//text_of(digits)//')') real(x, dp)
         read (buffer, *) back
         if (abs(back - real(x, dp)) <= 0) exit
      end do
      if (abs(x) > 1.0e-3_wp .and. abs(x) < 1.0e6_wp .or. .not. abs(x) > 0) write (buffer, '(f0.'//text_of(digits + 3)//')') x
      text = trim(adjustl(buffer))
      if (index(text, 'E') > 0) return
      digits = verify(text, '0', back=.true.)
      text = text(:max(digits, index(text, '.') + 1))
   end function number_text

   pure function vector_text(x) result(text)
      real(wp), intent(in) :: x(3)
      character(len=:), allocatable :: text
      text = number_text(x(1))//', '//number_text(x(2))//', '//number_text(x(3))
   end function vector_text
end module finshell_deck_writer
