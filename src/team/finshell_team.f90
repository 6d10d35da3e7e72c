!> Processes that share the work on one problem. All of them run the same program on the same vectors; each evaluates elements of
!> its own and holds its own part of the matrix. What is added up over them is the same on all to the last bit, so that all take
!> the same decisions.
!>
!> One process alone has no team: a null pointer, with which everything here does nothing. The team of MPI processes is in mpi/.
module finshell_team
   use finshell_error, only: error_t
   use finshell_kinds, only: dp, i4
   implicit none
   private
   public :: team_t, add_up, add_up_all, add_up_value, largest_of, from_first, shared, agree, leads, own_elements

   type, abstract :: team_t
      integer :: rank = 0 !< of this process, from 0; the first one reads the matrix's solution, writes and prints
      integer :: members = 1
      integer :: communicator = 0 !< as solver libraries take it
   contains
      procedure(reduce_interface), deferred :: sum
      procedure(reduce_interface), deferred :: largest
      procedure(send_interface), deferred :: send
      procedure(send_error_interface), deferred :: send_error
      procedure(divide_interface), deferred :: divide
   end type team_t

   abstract interface
      !> Sum, or largest value, over all members; every member receives the same bits.
      subroutine reduce_interface(self, x)
         import :: team_t, dp
         class(team_t), intent(in) :: self
         real(dp), intent(inout), contiguous :: x(:)
      end subroutine reduce_interface

      !> All receive what the first member has.
      subroutine send_interface(self, x)
         import :: team_t, dp
         class(team_t), intent(in) :: self
         real(dp), intent(inout), contiguous :: x(:)
      end subroutine send_interface

      !> All receive the error of one member.
      subroutine send_error_interface(self, from, error)
         import :: team_t, error_t
         class(team_t), intent(in) :: self
         integer, intent(in) :: from !< rank of that member
         type(error_t), allocatable, intent(inout) :: error
      end subroutine send_error_interface

      !> Divide elements into as many connected parts of equal size as there are members, with short boundaries.
      subroutine divide_interface(self, triangles, nodes, part)
         import :: team_t, i4
         class(team_t), intent(in) :: self
         integer, intent(in) :: triangles(:, :) !< (3, elements)
         integer, intent(in) :: nodes
         integer(i4), allocatable, intent(out) :: part(:) !< (elements) rank of the member
      end subroutine divide_interface
   end interface

contains

   !> Is there more than this process?
   pure logical function shared(team)
      class(team_t), pointer, intent(in) :: team
      shared = associated(team)
   end function shared

   !> Is this the process that speaks for all?
   pure logical function leads(team)
      class(team_t), pointer, intent(in) :: team
      leads = .true.
      if (associated(team)) leads = team%rank == 0
   end function leads

   subroutine add_up(team, x)
      class(team_t), pointer, intent(in) :: team
      real(dp), intent(inout), contiguous :: x(:)
      if (associated(team)) call team%sum(x)
   end subroutine add_up

   subroutine add_up_all(team, x)
      class(team_t), pointer, intent(in) :: team
      real(dp), intent(inout), contiguous, target :: x(:, :)
      real(dp), pointer, contiguous :: flat(:)
      if (.not. associated(team)) return
      flat(1:size(x)) => x
      call team%sum(flat)
   end subroutine add_up_all

   subroutine add_up_value(team, x)
      class(team_t), pointer, intent(in) :: team
      real(dp), intent(inout) :: x
      real(dp) :: one(1)
      if (.not. associated(team)) return
      one = x
      call team%sum(one)
      x = one(1)
   end subroutine add_up_value

   subroutine largest_of(team, x)
      class(team_t), pointer, intent(in) :: team
      real(dp), intent(inout), contiguous :: x(:)
      if (associated(team)) call team%largest(x)
   end subroutine largest_of

   subroutine from_first(team, x)
      class(team_t), pointer, intent(in) :: team
      real(dp), intent(inout), contiguous :: x(:)
      if (associated(team)) call team%send(x)
   end subroutine from_first

   !> Where one member has failed all have, with the sentence of the one for which `priority` is lowest, then rank.
   subroutine agree(team, error, priority)
      class(team_t), pointer, intent(in) :: team
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: priority
      real(dp) :: first(1), mine
      if (.not. associated(team)) return
      mine = huge(mine)
      if (allocated(error)) then
         mine = team%rank
         if (present(priority)) mine = mine + real(team%members, dp)*priority
      end if
      first = -mine
      call team%largest(first)
      if (-first(1) >= huge(mine)) return
      call team%send_error(nint(mod(-first(1), real(team%members, dp))), error)
   end subroutine agree

   !> The elements of this member, ascending; all of them without a team.
   subroutine own_elements(team, triangles, nodes, list)
      class(team_t), pointer, intent(in) :: team
      integer, intent(in) :: triangles(:, :) !< (3, elements)
      integer, intent(in) :: nodes
      integer, allocatable, intent(out) :: list(:)
      integer(i4), allocatable :: part(:)
      integer :: i
      list = [(i, i=1, size(triangles, 2))]
      if (.not. associated(team)) return
      call team%divide(triangles, nodes, part)
      list = pack(list, part == team%rank)
   end subroutine own_elements
end module finshell_team
