!> The ends of connectors in an input file: nodes of a set, each with a partner, or alone.
module finshell_input_ends
   use finshell_error, only: error_t, text_of
   use finshell_input_common, only: get_set, kind_node
   use finshell_kinds, only: wp
   use finshell_mesh, only: find_node_set, mesh_t, node_set_names
   use finshell_namelist, only: complain_about, get, group_t, has
   implicit none
   private
   public :: get_ends, refined_share

contains

   !> The keys node_set and to: (2, :) pairs; or without `to` (1, :) nodes. Where one of the sets is a node it goes with each node
   !> of the other; else each node goes with the nearest of `to` that has no partner yet. Errors: no such sets; of other
   !> sizes; a node that would be its own partner.
   subroutine get_ends(group, mesh, ends, error, ground)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      integer, allocatable, intent(out) :: ends(:, :)
      type(error_t), allocatable, intent(inout) :: error
      logical, intent(in) :: ground !< `to` may be left out
      character(len=:), allocatable :: set, other
      integer :: i

      call get_set(group, kind_node, mesh, set, error)
      if (allocated(error)) return
      associate (first => mesh%node_sets(find_node_set(mesh, set))%members)
         if (ground .and. .not. has(group, 'to')) then
            ends = reshape(first, [1, size(first)])
            return
         end if
         call get(group, 'to', other, error)
         if (allocated(error)) return
         i = find_node_set(mesh, other)
         if (i == 0) then
            call complain_about(group, 'to', "there is no node set '"//other//"'; the mesh has: "//node_set_names(mesh), error)
            return
         end if
         associate (second => mesh%node_sets(i)%members)
            if (size(second) == 1) then
               ends = reshape([(first(i), second(1), i=1, size(first))], [2, size(first)])
            else if (size(first) == 1) then
               ends = reshape([(first(1), second(i), i=1, size(second))], [2, size(second)])
            else if (size(second) == size(first)) then
               call pair(first, second)
            else
               call complain_about(group, 'to', "one node is expected, or as many as '"//set//"' has, "//text_of(size(first)) &
                  //"; '"//other//"' has "//text_of(size(second)), error)
               return
            end if
         end associate
      end associate
      i = findloc(ends(1, :) == ends(2, :), .true., dim=1)
      if (i > 0) call complain_about(group, 'to', 'node '//text_of(ends(1, i))//' would be joined to itself', error)

   contains

      subroutine pair(one, two)
         integer, intent(in) :: one(:), two(:)
         logical :: taken(size(two))
         real(wp) :: distance(size(two))
         integer :: j, k
         taken = .false.
         allocate (ends(2, size(one)))
         do k = 1, size(one)
            distance = [(norm2(mesh%coordinates(:, two(j)) - mesh%coordinates(:, one(k))), j=1, size(two))]
            j = minloc(distance, dim=1, mask=.not. taken)
            taken(j) = .true.
            ends(:, k) = [one(k), two(j)]
         end do
      end subroutine pair
   end subroutine get_ends

   !> What a node of the set of a group bears of what one bore before refinement: the sum stays.
   real(wp) function refined_share(group, mesh) result(share)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable :: unused
      character(len=:), allocatable :: set
      integer :: i
      share = 1
      if (.not. allocated(mesh%former_node_sets)) return
      call get(group, 'node_set', set, unused)
      do i = 1, size(mesh%former_node_sets)
         if (mesh%former_node_sets(i)%name == set) share = real(size(mesh%former_node_sets(i)%members), wp) &
            /size(mesh%node_sets(find_node_set(mesh, set))%members)
      end do
   end function refined_share
end module finshell_input_ends
