!> A shell solved by PETSc: SNES does Newton on any number of ranks, MUMPS the linear equations, finshell the elements.
!>
!>     mpiexec -n 2 ./shell_snes cantilever.txt cantilever.out -increments 10 -snes_monitor
!>
!> Unknowns are displacements and total rotation vectors, six a node, so that PETSc may add corrections. Each rank has the
!> elements whose first node it owns, gets the unknowns of their nodes, calls finshell once for all of them, and adds force and
!> tangent into the distributed vector and matrix. The files are described in README.md.
module shell_snes
#include <petsc/finclude/petscsnes.h>
   use petscsnes
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use finshell, only: error_t, evaluate_elements, material_t, new_material, new_section, rotation_vector, section_t, wp
   implicit none
   private
   public :: problem_t, read_problem, distribute, residual, jacobian, write_result

   integer, parameter :: dofs = 6 !< of a node

   type :: problem_t
      integer :: nodes = 0, elements = 0
      real(wp), allocatable :: coordinates(:, :) !< (3, nodes)
      integer, allocatable :: triangles(:, :) !< (3, elements)
      logical, allocatable :: fixed(:, :) !< (6, nodes)
      real(wp), allocatable :: load(:, :) !< (6, nodes), at load factor 1
      type(section_t) :: section
      real(wp) :: factor = 0 !< of the load
      ! the share of this rank
      integer :: first = 0, last = 0 !< nodes whose unknowns it owns
      integer, allocatable :: mine(:) !< elements
      PetscInt, allocatable :: rows(:, :) !< (18, elements): row of each unknown, negative: fixed
      real(wp), allocatable :: x(:, :, :) !< (3, 3, elements)
      real(wp), allocatable :: force(:, :), tangent(:, :, :)
      Vec :: ghosts !< unknowns of the nodes of the elements, 18 an element
      VecScatter :: to_elements
   end type problem_t

contains

   !> Nodes, triangles, supports and loads; every rank reads them all.
   subroutine read_problem(name, problem)
      character(len=*), intent(in) :: name
      type(problem_t), intent(out) :: problem
      class(material_t), allocatable :: law
      type(error_t), allocatable :: error
      real(wp) :: young, poisson, thickness, value
      integer :: file, supports, loads, node, dof, i
      open (newunit=file, file=name, status='old', action='read')
      read (file, *) problem%nodes, problem%elements, supports, loads
      read (file, *) young, poisson, thickness
      allocate (problem%coordinates(3, problem%nodes), problem%triangles(3, problem%elements))
      allocate (problem%fixed(dofs, problem%nodes), source=.false.)
      allocate (problem%load(dofs, problem%nodes), source=0.0_wp)
      read (file, *) problem%coordinates
      read (file, *) problem%triangles
      do i = 1, supports
         read (file, *) node, dof
         problem%fixed(dof, node) = .true.
      end do
      do i = 1, loads
         read (file, *) node, dof, value
         problem%load(dof, node) = problem%load(dof, node) + value
      end do
      close (file)
      call new_material(law, 'st_venant_kirchhoff', ['e ', 'nu'], [young, poisson], error)
      if (.not. allocated(error)) call new_section(problem%section, law, thickness, error)
      if (allocated(error)) error stop error%message
   end subroutine read_problem

   !> Elements of this rank, and where their unknowns are; `unknowns` says how these are spread over the ranks.
   subroutine distribute(problem, unknowns)
      type(problem_t), intent(inout) :: problem
      Vec, intent(in) :: unknowns
      PetscErrorCode :: ierr
      PetscInt :: from, to, count
      PetscInt, allocatable :: wanted(:)
      IS :: index
      integer :: e, i, d, node
      PetscCallA(VecGetOwnershipRange(unknowns, from, to, ierr))
      problem%first = from/dofs + 1
      problem%last = to/dofs
      problem%mine = pack([(e, e=1, problem%elements)], problem%triangles(1, :) >= problem%first .and. &
                          problem%triangles(1, :) <= problem%last)
      count = size(problem%mine)
      allocate (problem%rows(3*dofs, count), problem%x(3, 3, count), problem%force(18, count), problem%tangent(18, 18, count))
      allocate (wanted(3*dofs*count))
      do e = 1, count
         do i = 1, 3
            node = problem%triangles(i, problem%mine(e))
            problem%x(:, i, e) = problem%coordinates(:, node)
            do d = 1, dofs
               wanted(18*(e - 1) + dofs*(i - 1) + d) = dofs*(node - 1) + d - 1
               problem%rows(dofs*(i - 1) + d, e) = merge(-1, dofs*(node - 1) + d - 1, problem%fixed(d, node))
            end do
         end do
      end do
      PetscCallA(VecCreateSeq(PETSC_COMM_SELF, 18*count, problem%ghosts, ierr))
      PetscCallA(ISCreateGeneral(PETSC_COMM_SELF, 18*count, wanted, PETSC_COPY_VALUES, index, ierr))
      PetscCallA(VecScatterCreate(unknowns, index, problem%ghosts, PETSC_NULL_IS, problem%to_elements, ierr))
      PetscCallA(ISDestroy(index, ierr))
   end subroutine distribute

   !> Force, and with_tangent tangent, of the elements of this rank. False when one of them cannot be computed.
   logical function evaluated(problem, unknowns, with_tangent)
      type(problem_t), intent(inout) :: problem
      Vec, intent(in) :: unknowns
      logical, intent(in) :: with_tangent
      PetscErrorCode :: ierr
      PetscScalar, pointer :: values(:)
      real(wp), allocatable :: a(:, :, :, :)
      integer, allocatable :: status(:)
      integer :: n
      n = size(problem%mine)
      PetscCallA(VecScatterBegin(problem%to_elements, unknowns, problem%ghosts, INSERT_VALUES, SCATTER_FORWARD, ierr))
      PetscCallA(VecScatterEnd(problem%to_elements, unknowns, problem%ghosts, INSERT_VALUES, SCATTER_FORWARD, ierr))
      PetscCallA(VecGetArrayReadF90(problem%ghosts, values, ierr))
      a = reshape(values, [3, 2, 3, n])
      PetscCallA(VecRestoreArrayReadF90(problem%ghosts, values, ierr))
      allocate (status(n))
      if (with_tangent) then
         call evaluate_elements(problem%section, n, problem%x, a(:, 1, :, :), a(:, 2, :, :), rotation_vector, status, &
                                force=problem%force, tangent=problem%tangent)
      else
         call evaluate_elements(problem%section, n, problem%x, a(:, 1, :, :), a(:, 2, :, :), rotation_vector, status, &
                                force=problem%force)
      end if
      evaluated = all(status == 0)
   end function evaluated

   !> Internal minus external force: SNES calls this.
   subroutine residual(snes, unknowns, r, problem, ierr)
      SNES :: snes
      Vec :: unknowns, r
      type(problem_t), intent(inout) :: problem
      PetscErrorCode :: ierr
      PetscInt :: row, rows(dofs)
      integer :: e, d, node
      if (.not. evaluated(problem, unknowns, .false.)) then
         ! NaN makes the norm NaN on all ranks; SNES then asks who reported the error
         problem%force = ieee_value(1.0_wp, ieee_quiet_nan)
         PetscCall(SNESSetFunctionDomainError(snes, ierr))
      end if
      PetscCall(VecZeroEntries(r, ierr))
      do e = 1, size(problem%mine)
         PetscCall(VecSetValues(r, 18, problem%rows(:, e), problem%force(:, e), ADD_VALUES, ierr))
      end do
      do node = problem%first, problem%last
         do d = 1, dofs
            row = dofs*(node - 1) + d - 1
            rows(d) = merge(-1, row, problem%fixed(d, node))
         end do
         PetscCall(VecSetValues(r, dofs, rows, -problem%factor*problem%load(:, node), ADD_VALUES, ierr))
      end do
      PetscCall(VecAssemblyBegin(r, ierr))
      PetscCall(VecAssemblyEnd(r, ierr))
   end subroutine residual

   !> Tangent, with ones for the fixed unknowns: SNES calls this.
   subroutine jacobian(snes, unknowns, matrix, preconditioner, problem, ierr)
      SNES :: snes
      Vec :: unknowns
      Mat :: matrix, preconditioner
      type(problem_t), intent(inout) :: problem
      PetscErrorCode :: ierr
      PetscInt :: row
      PetscScalar :: one
      integer :: e, d, node
      one = 1
      if (.not. evaluated(problem, unknowns, .true.)) then
         PetscCall(SNESSetJacobianDomainError(snes, ierr))
      end if
      PetscCall(MatZeroEntries(preconditioner, ierr))
      do e = 1, size(problem%mine)
         ! the tangent is symmetric: its columns are the rows that PETSc expects
         associate (rows => problem%rows(:, e))
            PetscCall(MatSetValues(preconditioner, 18, rows, 18, rows, problem%tangent(:, :, e), ADD_VALUES, ierr))
         end associate
      end do
      do node = problem%first, problem%last
         do d = 1, dofs
            if (.not. problem%fixed(d, node)) cycle
            row = dofs*(node - 1) + d - 1
            PetscCall(MatSetValue(preconditioner, row, row, one, ADD_VALUES, ierr))
         end do
      end do
      PetscCall(MatAssemblyBegin(preconditioner, MAT_FINAL_ASSEMBLY, ierr))
      PetscCall(MatAssemblyEnd(preconditioner, MAT_FINAL_ASSEMBLY, ierr))
   end subroutine jacobian

   !> All unknowns, a line a node, written by rank 0.
   subroutine write_result(name, problem, unknowns)
      character(len=*), intent(in) :: name
      type(problem_t), intent(in) :: problem
      Vec, intent(in) :: unknowns
      PetscErrorCode :: ierr
      PetscScalar, pointer :: values(:)
      VecScatter :: scatter
      Vec :: all_of_them
      integer :: file, i
      PetscCallA(VecScatterCreateToZero(unknowns, scatter, all_of_them, ierr))
      PetscCallA(VecScatterBegin(scatter, unknowns, all_of_them, INSERT_VALUES, SCATTER_FORWARD, ierr))
      PetscCallA(VecScatterEnd(scatter, unknowns, all_of_them, INSERT_VALUES, SCATTER_FORWARD, ierr))
      PetscCallA(VecGetArrayReadF90(all_of_them, values, ierr))
      if (size(values) > 0) then
         open (newunit=file, file=name, status='replace', action='write')
         do i = 1, problem%nodes
            write (file, '(6es25.16)') values(dofs*i - 5:dofs*i)
         end do
         close (file)
      end if
      PetscCallA(VecRestoreArrayReadF90(all_of_them, values, ierr))
      PetscCallA(VecScatterDestroy(scatter, ierr))
      PetscCallA(VecDestroy(all_of_them, ierr))
   end subroutine write_result
end module shell_snes

program main
#include <petsc/finclude/petscsnes.h>
   use petscsnes
   use shell_snes, only: distribute, jacobian, problem_t, read_problem, residual, write_result
   implicit none
   type(problem_t) :: problem
   SNES :: snes
   KSP :: ksp
   PC :: pc
   SNESLineSearch :: search
   SNESConvergedReason :: reason
   Mat :: matrix
   Vec :: unknowns, r
   PetscErrorCode :: ierr
   PetscInt :: increments, i, iterations, total, from, to
   PetscMPIInt :: rank, ranks
   PetscBool :: found
   character(len=200) :: text

   PetscCallA(PetscInitialize(PETSC_NULL_CHARACTER, ierr))
   PetscCallMPIA(MPI_Comm_rank(PETSC_COMM_WORLD, rank, ierr))
   PetscCallMPIA(MPI_Comm_size(PETSC_COMM_WORLD, ranks, ierr))
   if (command_argument_count() < 2) error stop 'usage: shell_snes INPUT OUTPUT [-increments N] [options of PETSc]'
   call get_command_argument(1, text)
   call read_problem(trim(text), problem)
   increments = 10
   PetscCallA(PetscOptionsGetInt(PETSC_NULL_OPTIONS, PETSC_NULL_CHARACTER, '-increments', increments, found, ierr))

   ! whole nodes to each rank
   PetscCallA(VecCreate(PETSC_COMM_WORLD, unknowns, ierr))
   PetscCallA(VecSetBlockSize(unknowns, 6, ierr))
   PetscCallA(VecSetSizes(unknowns, PETSC_DECIDE, 6*problem%nodes, ierr))
   PetscCallA(VecSetFromOptions(unknowns, ierr))
   PetscCallA(VecDuplicate(unknowns, r, ierr))
   PetscCallA(VecSetOption(r, VEC_IGNORE_NEGATIVE_INDICES, PETSC_TRUE, ierr))
   call distribute(problem, unknowns)

   PetscCallA(VecGetOwnershipRange(unknowns, from, to, ierr))
   PetscCallA(MatCreate(PETSC_COMM_WORLD, matrix, ierr))
   PetscCallA(MatSetSizes(matrix, to - from, to - from, 6*problem%nodes, 6*problem%nodes, ierr))
   PetscCallA(MatSetBlockSize(matrix, 6, ierr))
   PetscCallA(MatSetType(matrix, MATAIJ, ierr))
   ! room for ten neighbours of a node
   PetscCallA(MatSeqAIJSetPreallocation(matrix, 66, PETSC_NULL_INTEGER, ierr))
   PetscCallA(MatMPIAIJSetPreallocation(matrix, 66, PETSC_NULL_INTEGER, 66, PETSC_NULL_INTEGER, ierr))
   PetscCallA(MatSetOption(matrix, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE, ierr))

   ! Newton with full steps, MUMPS below; options on the command line go before
   PetscCallA(SNESCreate(PETSC_COMM_WORLD, snes, ierr))
   PetscCallA(SNESSetFunction(snes, r, residual, problem, ierr))
   PetscCallA(SNESSetJacobian(snes, matrix, matrix, jacobian, problem, ierr))
   PetscCallA(SNESGetLineSearch(snes, search, ierr))
   PetscCallA(SNESLineSearchSetType(search, SNESLINESEARCHBASIC, ierr))
   PetscCallA(SNESSetTolerances(snes, 1d-50, 1d-8, 1d-12, 50, 10000, ierr))
   PetscCallA(SNESSetDivergenceTolerance(snes, -1d0, ierr))
   PetscCallA(SNESGetKSP(snes, ksp, ierr))
   PetscCallA(KSPSetType(ksp, KSPPREONLY, ierr))
   PetscCallA(KSPGetPC(ksp, pc, ierr))
   PetscCallA(PCSetType(pc, PCLU, ierr))
   PetscCallA(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS, ierr))
   PetscCallA(SNESSetFromOptions(snes, ierr))

   PetscCallA(VecSet(unknowns, 0d0, ierr))
   total = 0
   do i = 1, increments
      problem%factor = real(i, kind(problem%factor))/increments
      PetscCallA(SNESSolve(snes, PETSC_NULL_VEC, unknowns, ierr))
      PetscCallA(SNESGetConvergedReason(snes, reason, ierr))
      PetscCallA(SNESGetIterationNumber(snes, iterations, ierr))
      total = total + iterations
      if (rank == 0) print '(a, f0.4, a, i0, a)', 'load factor ', problem%factor, ': ', iterations, ' iterations'
      if (reason < 0) error stop 'no convergence: take more increments (-increments)'
   end do
   if (rank == 0) print '(i0, a, i0, a, i0, a)', total, ' iterations in ', increments, ' increments on ', ranks, ' ranks'
   call get_command_argument(2, text)
   call write_result(trim(text), problem, unknowns)

   PetscCallA(SNESDestroy(snes, ierr))
   PetscCallA(MatDestroy(matrix, ierr))
   PetscCallA(VecDestroy(unknowns, ierr))
   PetscCallA(VecDestroy(r, ierr))
   PetscCallA(VecDestroy(problem%ghosts, ierr))
   PetscCallA(VecScatterDestroy(problem%to_elements, ierr))
   PetscCallA(PetscFinalize(ierr))
end program main
