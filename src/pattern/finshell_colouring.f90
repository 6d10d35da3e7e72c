!> Patches of neighbouring elements, coloured so that patches of one colour share no node.
!>
!> Threads may then add the patches of a colour in any order: every sum receives its terms in an order that depends on the
!> mesh alone. Patches rather than single elements keep memory traffic low and fill the blocks of the element evaluation.
module finshell_colouring
   use finshell_kinds, only: i4
   implicit none
   private
   public :: patches_t, new_patches

   type :: patches_t
      integer :: colours = 0
      integer(i4), allocatable :: element(:) !< element numbers, patch by patch
      integer(i4), allocatable :: first(:) !< (patches + 1) offset of each patch in `element`
      integer(i4), allocatable :: group(:) !< (patches) all elements of a patch belong to one group
      integer(i4), allocatable :: first_of_colour(:) !< (colours + 1) offset of each colour among the patches
   end type patches_t

   !> Compressed lists.
   type :: lists_t
      integer(i4), allocatable :: first(:), item(:)
   end type lists_t

contains

   !> Divide the elements into patches and colour these. Patches are as large as asked for, but for the last of each group.
   subroutine new_patches(self, triangles, nodes, group, patch_size)
      type(patches_t), intent(out) :: self
      integer, intent(in) :: triangles(:, :) !< (3, elements)
      integer, intent(in) :: nodes
      integer, intent(in) :: group(:) !< (elements) from 1
      integer, intent(in) :: patch_size !< elements in a patch
      type(lists_t) :: at_node
      integer(i4), allocatable :: colour(:)

      call elements_at_nodes(triangles, nodes, at_node)
      call grow_patches(self, triangles, at_node, group, patch_size)
      call colour_patches(self, triangles, nodes, colour)
      call sort_by_colour(self, colour)
   end subroutine new_patches

   !> Grow patches by breadth-first search, each from where the previous ones left off.
   subroutine grow_patches(self, triangles, at_node, group, patch_size)
      type(patches_t), intent(inout) :: self
      integer, intent(in) :: triangles(:, :), group(:), patch_size
      type(lists_t), intent(in) :: at_node
      type(lists_t) :: in_group
      integer(i4), allocatable :: queue(:), left(:), cursor(:), reached(:), scanned(:)
      logical, allocatable :: taken(:)
      integer :: elements, patches, done, head, tail, left_head, left_tail, seed, e, g, k, l, node, other, n

      elements = size(triangles, 2)
      call group_lists(group, in_group)
      ! Every patch of a group but the last is full.
      n = elements/patch_size + size(in_group%first)
      allocate (self%element(elements), self%first(n + 1), self%group(n))
      allocate (queue(elements), left(elements), reached(elements), scanned(size(at_node%first) - 1), source=0_i4)
      allocate (taken(elements), source=.false.)
      cursor = in_group%first
      patches = 0
      done = 0
      left_head = 1
      left_tail = 0
      self%first(1) = 1
      do while (done < elements)
         seed = next_left(0)
         do g = 1, size(in_group%first) - 1
            if (seed > 0) exit
            seed = next_in_group(g)
         end do
         patches = patches + 1
         g = group(seed)
         self%group(patches) = int(g, i4)
         head = 1
         tail = 0
         n = 0
         do while (n < patch_size .and. seed > 0)
            tail = tail + 1
            queue(tail) = int(seed, i4)
            reached(seed) = int(patches, i4)
            do while (n < patch_size .and. head <= tail)
               e = queue(head)
               head = head + 1
               taken(e) = .true.
               done = done + 1
               n = n + 1
               self%element(done) = int(e, i4)
               do k = 1, 3
                  node = triangles(k, e)
                  if (scanned(node) == patches) cycle
                  scanned(node) = int(patches, i4)
                  do l = at_node%first(node), at_node%first(node + 1) - 1
                     other = at_node%item(l)
                     if (taken(other) .or. group(other) /= g .or. reached(other) == patches) cycle
                     if (tail == elements) exit
                     reached(other) = int(patches, i4)
                     tail = tail + 1
                     queue(tail) = int(other, i4)
                  end do
               end do
            end do
            if (n == patch_size) exit
            ! The neighbourhood is used up: go on where something was left, or anywhere in the group.
            seed = next_left(g)
            if (seed == 0) seed = next_in_group(g)
            head = 1
            tail = 0
         end do
         call remember(queue(head:tail))
         self%first(patches + 1) = int(done + 1, i4)
      end do
      self%first = self%first(:patches + 1)
      self%group = self%group(:patches)

   contains

      !> The next element left over at the edge of a patch, 0: none (or of another group than the one wanted).
      integer function next_left(wanted)
         integer, intent(in) :: wanted
         next_left = 0
         do while (left_head <= left_tail)
            if (.not. taken(left(left_head))) then
               if (wanted == 0 .or. group(left(left_head)) == wanted) next_left = left(left_head)
               return
            end if
            left_head = left_head + 1
         end do
      end function next_left

      !> The next element of a group that is not taken, 0: none.
      integer function next_in_group(g)
         integer, intent(in) :: g
         next_in_group = 0
         do while (cursor(g) < in_group%first(g + 1))
            if (.not. taken(in_group%item(cursor(g)))) then
               next_in_group = in_group%item(cursor(g))
               return
            end if
            cursor(g) = cursor(g) + 1_i4
         end do
      end function next_in_group

      !> Keep what a patch reached and did not take. An element is kept once: `left` then never overflows.
      subroutine remember(candidates)
         integer(i4), intent(in) :: candidates(:)
         integer :: i
         do i = 1, size(candidates)
            if (left_tail == elements) return
            left_tail = left_tail + 1
            left(left_tail) = candidates(i)
         end do
      end subroutine remember
   end subroutine grow_patches

   !> Greedy colouring; among the colours that are free the one with the fewest elements.
   subroutine colour_patches(self, triangles, nodes, colour)
      type(patches_t), intent(inout) :: self
      integer, intent(in) :: triangles(:, :), nodes
      integer(i4), allocatable, intent(out) :: colour(:)
      type(lists_t) :: patch_at_node
      integer(i4), allocatable :: forbidden(:), load(:)
      integer :: p, i, k, l, node, c, best

      call patches_at_nodes(self, triangles, nodes, patch_at_node)
      allocate (colour(size(self%group)), source=0_i4)
      allocate (forbidden(size(self%group)), load(size(self%group)), source=0_i4)
      self%colours = 0
      do p = 1, size(self%group)
         do i = self%first(p), self%first(p + 1) - 1
            do k = 1, 3
               node = triangles(k, self%element(i))
               do l = patch_at_node%first(node), patch_at_node%first(node + 1) - 1
                  c = colour(patch_at_node%item(l))
                  if (c > 0) forbidden(c) = int(p, i4)
               end do
            end do
         end do
         best = 0
         do c = 1, self%colours
            if (forbidden(c) == p) cycle
            if (best == 0) best = c
            if (load(c) < load(best)) best = c
         end do
         if (best == 0) then
            self%colours = self%colours + 1
            best = self%colours
         end if
         colour(p) = int(best, i4)
         load(best) = load(best) + self%first(p + 1) - self%first(p)
      end do
   end subroutine colour_patches

   !> Put the patches of each colour side by side.
   subroutine sort_by_colour(self, colour)
      type(patches_t), intent(inout) :: self
      integer(i4), intent(in) :: colour(:)
      type(patches_t) :: old
      type(lists_t) :: of_colour
      integer :: i, p, n

      old = self
      call group_lists(int(colour), of_colour)
      self%first_of_colour = of_colour%first
      self%first(1) = 1
      do i = 1, size(colour)
         p = of_colour%item(i)
         n = old%first(p + 1) - old%first(p)
         self%group(i) = old%group(p)
         self%first(i + 1) = self%first(i) + int(n, i4)
         self%element(self%first(i):self%first(i + 1) - 1) = old%element(old%first(p):old%first(p + 1) - 1)
      end do
   end subroutine sort_by_colour

   subroutine elements_at_nodes(triangles, nodes, lists)
      integer, intent(in) :: triangles(:, :), nodes
      type(lists_t), intent(out) :: lists
      integer(i4), allocatable :: fill(:)
      integer :: e, k, node
      allocate (lists%first(nodes + 1), lists%item(size(triangles)))
      lists%first = 0
      do e = 1, size(triangles, 2)
         do k = 1, 3
            lists%first(triangles(k, e) + 1) = lists%first(triangles(k, e) + 1) + 1_i4
         end do
      end do
      call accumulate(lists%first)
      fill = lists%first
      do e = 1, size(triangles, 2)
         do k = 1, 3
            node = triangles(k, e)
            lists%item(fill(node)) = int(e, i4)
            fill(node) = fill(node) + 1_i4
         end do
      end do
   end subroutine elements_at_nodes

   !> Patches that touch each node, each once.
   subroutine patches_at_nodes(self, triangles, nodes, lists)
      type(patches_t), intent(in) :: self
      integer, intent(in) :: triangles(:, :), nodes
      type(lists_t), intent(out) :: lists
      integer(i4), allocatable :: last(:), fill(:)
      integer :: pass, p, i, k, node

      allocate (lists%first(nodes + 1), source=0_i4)
      allocate (last(nodes), fill(nodes + 1))
      do pass = 1, 2
         last = 0
         do p = 1, size(self%group)
            do i = self%first(p), self%first(p + 1) - 1
               do k = 1, 3
                  node = triangles(k, self%element(i))
                  if (last(node) == p) cycle
                  last(node) = int(p, i4)
                  if (pass == 1) then
                     lists%first(node + 1) = lists%first(node + 1) + 1_i4
                  else
                     lists%item(fill(node)) = int(p, i4)
                     fill(node) = fill(node) + 1_i4
                  end if
               end do
            end do
         end do
         if (pass == 2) exit
         call accumulate(lists%first)
         fill = lists%first
         allocate (lists%item(lists%first(nodes + 1) - 1))
      end do
   end subroutine patches_at_nodes

   !> Members of each group, ascending.
   subroutine group_lists(group, lists)
      integer, intent(in) :: group(:)
      type(lists_t), intent(out) :: lists
      integer(i4), allocatable :: fill(:)
      integer :: e, groups
      groups = 0
      if (size(group) > 0) groups = maxval(group)
      allocate (lists%first(groups + 1), source=0_i4)
      allocate (lists%item(size(group)))
      do e = 1, size(group)
         lists%first(group(e) + 1) = lists%first(group(e) + 1) + 1_i4
      end do
      call accumulate(lists%first)
      fill = lists%first
      do e = 1, size(group)
         lists%item(fill(group(e))) = int(e, i4)
         fill(group(e)) = fill(group(e)) + 1_i4
      end do
   end subroutine group_lists

   !> Counts, one place late, to offsets from 1.
   pure subroutine accumulate(first)
      integer(i4), intent(inout) :: first(:)
      integer :: i
      first(1) = 1
      do i = 2, size(first)
         first(i) = first(i) + first(i - 1)
      end do
   end subroutine accumulate
end module finshell_colouring
