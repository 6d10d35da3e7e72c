!> The matrices of a problem with symmetric storage, for eigenproblems. Pressures whose edge slides in planes have a symmetric
!> stiffness, though not element by element, so the problem keeps both triangles.
module finshell_symmetric_matrix
   use finshell_kinds, only: dp
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise
   use finshell_sparsity, only: sparsity_t, new_sparsity
   use finshell_status, only: status_invalid_argument
   use finshell_team, only: shared
   implicit none
   private
   public :: symmetric_pattern, make_symmetric

contains

   !> The pattern of the symmetric storage. Errors: an unsymmetric problem shared by processes.
   subroutine symmetric_pattern(problem, what, pattern, error)
      type(equilibrium_t), intent(in) :: problem
      character(len=*), intent(in) :: what !< is asked for, for the message
      type(sparsity_t), intent(out) :: pattern
      type(error_t), allocatable, intent(out) :: error
      call new_sparsity(pattern, problem%structure%mesh%triangles(:, problem%own_elements), problem%equations%number, .true., &
                        error, problem%team, problem%external%cliques())
      if (allocated(error) .or. problem%external%symmetric .or. .not. shared(problem%team)) return
      call raise(error, status_invalid_argument, what//' under pressures whose edges slide in planes runs on one process ' &
         //'only: take finshell instead of finshell_mpi')
   end subroutine symmetric_pattern

   !> Values in the pattern of the problem become values in the symmetric pattern.
   subroutine make_symmetric(problem, pattern, values, difference, error)
      type(equilibrium_t), intent(in) :: problem
      type(sparsity_t), intent(in) :: pattern !< by `symmetric_pattern`
      real(dp), allocatable, intent(inout) :: values(:)
      real(dp), intent(out) :: difference !< largest one between two entries that should be the same
      type(error_t), allocatable, intent(out) :: error
      type(sparsity_t) :: full
      real(dp), allocatable :: half(:)
      integer :: i, j, p, lower, upper

      difference = 0
      if (problem%external%symmetric) return
      call new_sparsity(full, problem%structure%mesh%triangles(:, problem%own_elements), problem%equations%number, .false., error, &
                        cliques=problem%external%cliques())
      if (allocated(error)) return
      allocate (half(pattern%entries()))
      do j = 1, pattern%n
         do p = pattern%column_pointer(j), pattern%column_pointer(j + 1) - 1
            i = pattern%row(p)
            lower = full%find(i, j)
            upper = full%find(j, i)
            half(p) = 0.5_dp*(values(lower) + values(upper))
            difference = max(difference, abs(values(lower) - values(upper)))
         end do
      end do
      call move_alloc(half, values)
   end subroutine make_symmetric
end module finshell_symmetric_matrix
