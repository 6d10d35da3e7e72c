!> The team of all MPI processes; parts of a mesh by METIS.
module finshell_mpi_team
   use, intrinsic :: iso_c_binding, only: c_int, c_float, c_ptr, c_null_ptr
   use, intrinsic :: iso_fortran_env, only: error_unit
   use finshell_error, only: error_t, raise
   use finshell_kinds, only: dp, i4, i8
   use finshell_team, only: team_t
   use mpi_f08, only: mpi_abort, mpi_allreduce, mpi_bcast, mpi_character, mpi_comm_rank, mpi_comm_size, mpi_comm_world, &
      mpi_double_precision, mpi_finalize, mpi_ibarrier, mpi_init_thread, mpi_in_place, mpi_integer, mpi_max, mpi_request, &
      mpi_status_ignore, mpi_sum, mpi_test, mpi_thread_funneled, mpi_wtime, mpi_reduce
   implicit none
   private
   public :: mpi_team_t, start_team, end_team

   type, extends(team_t) :: mpi_team_t
   contains
      procedure :: sum => mpi_team_sum
      procedure :: largest
      procedure :: send
      procedure :: send_error
      procedure :: divide
   end type mpi_team_t

   interface
      !> METIS 5, with integers of 32 bits.
      integer(c_int) function metis_part_mesh_dual(ne, nn, eptr, eind, vwgt, vsize, ncommon, nparts, tpwgts, options, objval, &
                                                   epart, npart) bind(c, name='METIS_PartMeshDual')
         import :: c_int, c_ptr
         integer(c_int), intent(in) :: ne, nn, ncommon, nparts
         integer(c_int), intent(in) :: eptr(*), eind(*)
         type(c_ptr), value :: vwgt, vsize, tpwgts, options
         integer(c_int), intent(out) :: objval, epart(*), npart(*)
      end function metis_part_mesh_dual
   end interface

contains

   subroutine start_team(team)
      type(mpi_team_t), intent(out) :: team
      integer :: provided
      call mpi_init_thread(mpi_thread_funneled, provided)
      call mpi_comm_rank(mpi_comm_world, team%rank)
      call mpi_comm_size(mpi_comm_world, team%members)
      team%communicator = mpi_comm_world%mpi_val
   end subroutine start_team

   !> Leave MPI. A member that failed alone finds the others elsewhere: it waits for them a little, then ends them.
   subroutine end_team(team, code)
      type(mpi_team_t), intent(in) :: team
      integer, intent(in) :: code !< exit code
      real(dp), parameter :: patience = 5 !< seconds
      type(mpi_request) :: request
      real(dp) :: start
      logical :: all_here
      call mpi_ibarrier(mpi_comm_world, request)
      start = mpi_wtime()
      all_here = .false.
      do while (.not. all_here)
         call mpi_test(request, all_here, mpi_status_ignore)
         if (code == 0 .or. mpi_wtime() - start < patience) cycle
         if (.not. all_here) then
            if (team%rank > 0) write (error_unit, '(a,i0,a)') 'finshell: process ', team%rank, ' has failed alone'
            call mpi_abort(mpi_comm_world, code)
         end if
      end do
      call mpi_finalize()
   end subroutine end_team

   !> Added up by one member and sent: the order of the sum could otherwise depend on who asks.
   subroutine mpi_team_sum(self, x)
      class(mpi_team_t), intent(in) :: self
      real(dp), intent(inout), contiguous :: x(:)
      real(dp) :: unused(1)
      if (self%rank == 0) then
         call mpi_reduce(mpi_in_place, x, size(x), mpi_double_precision, mpi_sum, 0, mpi_comm_world)
      else
         call mpi_reduce(x, unused, size(x), mpi_double_precision, mpi_sum, 0, mpi_comm_world)
      end if
      call self%send(x)
   end subroutine mpi_team_sum

   subroutine largest(self, x)
      class(mpi_team_t), intent(in) :: self
      real(dp), intent(inout), contiguous :: x(:)
      if (self%members > 1) call mpi_allreduce(mpi_in_place, x, size(x), mpi_double_precision, mpi_max, mpi_comm_world)
   end subroutine largest

   subroutine send(self, x)
      class(mpi_team_t), intent(in) :: self
      real(dp), intent(inout), contiguous :: x(:)
      if (self%members > 1) call mpi_bcast(x, size(x), mpi_double_precision, 0, mpi_comm_world)
   end subroutine send

   subroutine send_error(self, from, error)
      class(mpi_team_t), intent(in) :: self
      integer, intent(in) :: from
      type(error_t), allocatable, intent(inout) :: error
      integer :: head(2)
      character(len=:), allocatable :: message
      head = 0
      if (self%rank == from .and. allocated(error)) head = [int(error%code), len(error%message)]
      call mpi_bcast(head, 2, mpi_integer, from, mpi_comm_world)
      allocate (character(len=head(2)) :: message)
      if (self%rank == from .and. allocated(error)) message = error%message
      call mpi_bcast(message, head(2), mpi_character, from, mpi_comm_world)
      call raise(error, int(head(1), i4), message)
   end subroutine send_error

   subroutine divide(self, triangles, nodes, part)
      class(mpi_team_t), intent(in) :: self
      integer, intent(in) :: triangles(:, :), nodes
      integer(i4), allocatable, intent(out) :: part(:)
      integer(c_int), parameter :: metis_ok = 1
      integer(c_int), allocatable :: first(:), corner(:), part_of_node(:)
      integer(c_int) :: elements, cut
      integer :: i
      allocate (part(size(triangles, 2)), source=0_i4)
      if (self%members == 1) return
      if (self%rank == 0) then
         elements = size(triangles, 2)
         first = [(int(3*i, c_int), i=0, elements)]
         corner = [int(triangles, c_int) - 1_c_int]
         allocate (part_of_node(nodes))
         if (metis_part_mesh_dual(elements, int(nodes, c_int), first, corner, c_null_ptr, c_null_ptr, 2_c_int, &
                                  int(self%members, c_int), c_null_ptr, c_null_ptr, cut, part, part_of_node) /= metis_ok) &
            part = [(int(int(i, i8)*self%members/elements, i4), i=0, elements - 1)]
      end if
      call mpi_bcast(part, size(part), mpi_integer, 0, mpi_comm_world)
   end subroutine divide
end module finshell_mpi_team
