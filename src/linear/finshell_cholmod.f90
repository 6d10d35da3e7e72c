!> CHOLMOD: supernodal L L^T of a positive definite matrix, simplicial L D L^T of any other, one symbolic analysis for both.
!>
!> `common_t` mirrors the leading part of `cholmod_common` in CHOLMOD 3.0 (SuiteSparse 5.12; the header of CHOLMOD 4 has the
!> same), with room to spare behind it. The defaults that cholmod_start leaves there are verified before use.
module finshell_cholmod
   use, intrinsic :: iso_c_binding, only: c_int, c_long, c_size_t, c_double, c_ptr, c_funptr, c_null_ptr, c_associated, &
                                          c_f_pointer, c_loc
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: dp, i4
   use finshell_status, only: status_invalid_argument, status_out_of_memory
   implicit none
   private
   public :: cholmod_t

   integer(c_int), parameter :: cholmod_pattern = 0, cholmod_real = 1
   integer(c_int), parameter :: cholmod_ok = 0
   integer(c_int), parameter :: cholmod_out_of_memory = -2, cholmod_too_large = -3
   integer(c_int), parameter :: solve_a = 0, simplicial_or_supernodal = 1

   type, bind(C) :: method_t
      real(c_double) :: lnz, fl, prune_dense, prune_dense2, nd_oksep, other_1(4)
      integer(c_size_t) :: nd_small, other_2(4)
      integer(c_int) :: aggressive, order_for_lu, nd_compress, nd_camd, nd_components, ordering
      integer(c_size_t) :: other_3(4)
   end type method_t

   type, bind(C) :: common_t
      real(c_double) :: dbound, grow0, grow1
      integer(c_size_t) :: grow2, maxrank
      real(c_double) :: supernodal_switch
      integer(c_int) :: supernodal, final_asis, final_super, final_ll, final_pack, final_monotonic, final_resymbol
      real(c_double) :: zrelax(3)
      integer(c_size_t) :: nrelax(3)
      integer(c_int) :: prefer_zomplex, prefer_upper, quick_return_if_not_posdef, prefer_binary, print, precise, try_catch
      type(c_funptr) :: error_handler
      integer(c_int) :: nmethods, current, selected
      type(method_t) :: method(10)
      integer(c_int) :: postorder, default_nesdis
      real(c_double) :: metis_memory, metis_dswitch
      integer(c_size_t) :: metis_nswitch, nrow
      integer(c_long) :: mark
      integer(c_size_t) :: iworksize, xworksize
      type(c_ptr) :: flag, head, xwork, iwork
      integer(c_int) :: itype, dtype, no_workspace_reallocate, status
      real(c_double) :: fl, lnz, anz, modfl
      ! Statistics and GPU data, different in every release and of no concern here: about 0.8 KiB so far.
      integer(c_size_t) :: rest(1024)
   end type common_t

   type, bind(C) :: sparse_t
      integer(c_size_t) :: nrow, ncol, nzmax
      type(c_ptr) :: p, i, nz, x, z
      integer(c_int) :: stype, itype, xtype, dtype, sorted, packed
   end type sparse_t

   type, bind(C) :: dense_t
      integer(c_size_t) :: nrow, ncol, nzmax, d
      type(c_ptr) :: x, z
      integer(c_int) :: xtype, dtype
   end type dense_t

   type, bind(C) :: factor_t
      integer(c_size_t) :: n, minor
      type(c_ptr) :: perm, colcount, iperm
      integer(c_size_t) :: nzmax
      type(c_ptr) :: p, i, x, z, nz, next, prev
      integer(c_size_t) :: nsuper, ssize, xsize, maxcsize, maxesize
      type(c_ptr) :: super, pi, px, s
      integer(c_int) :: ordering, is_ll, is_super, is_monotonic, itype, xtype, dtype, use_gpu
   end type factor_t

   !> One analysed matrix. A copy by assignment is empty: factors are not shared and must be made anew.
   type :: cholmod_t
      private
      integer :: n = 0
      type(common_t), pointer :: common => null()
      integer(c_int), pointer :: column_pointer(:) => null(), row(:) => null() ! from 0
      type(c_ptr) :: definite = c_null_ptr, indefinite = c_null_ptr ! supernodal L L^T, simplicial L D L^T
      type(c_ptr) :: current = c_null_ptr ! whichever was made last
      type(c_ptr) :: x = c_null_ptr, y = c_null_ptr, e = c_null_ptr ! kept between solutions
   contains
      procedure :: analysed
      procedure :: analyse
      procedure :: supernodal
      procedure :: factorise
      procedure :: pivots
      procedure :: solve
      procedure :: free
      procedure, private :: copy
      generic :: assignment(=) => copy
      final :: finalise
   end type cholmod_t

   interface
      integer(c_int) function cholmod_start(common) bind(C)
         import :: c_int, common_t
         type(common_t), intent(inout) :: common
      end function cholmod_start

      integer(c_int) function cholmod_finish(common) bind(C)
         import :: c_int, common_t
         type(common_t), intent(inout) :: common
      end function cholmod_finish

      type(c_ptr) function cholmod_analyze(a, common) bind(C)
         import :: c_ptr, sparse_t, common_t
         type(sparse_t), intent(in) :: a
         type(common_t), intent(inout) :: common
      end function cholmod_analyze

      integer(c_int) function cholmod_factorize(a, l, common) bind(C)
         import :: c_int, c_ptr, sparse_t, common_t
         type(sparse_t), intent(in) :: a
         type(c_ptr), value :: l
         type(common_t), intent(inout) :: common
      end function cholmod_factorize

      integer(c_int) function cholmod_solve2(sys, l, b, b_set, x, x_set, y, e, common) bind(C)
         import :: c_int, c_ptr, dense_t, common_t
         integer(c_int), value :: sys
         type(c_ptr), value :: l, b_set, x_set
         type(dense_t), intent(in) :: b
         type(c_ptr), intent(inout) :: x, y, e
         type(common_t), intent(inout) :: common
      end function cholmod_solve2

      type(c_ptr) function cholmod_copy_factor(l, common) bind(C)
         import :: c_ptr, common_t
         type(c_ptr), value :: l
         type(common_t), intent(inout) :: common
      end function cholmod_copy_factor

      integer(c_int) function cholmod_change_factor(to_xtype, to_ll, to_super, to_packed, to_monotonic, l, common) bind(C)
         import :: c_int, c_ptr, common_t
         integer(c_int), value :: to_xtype, to_ll, to_super, to_packed, to_monotonic
         type(c_ptr), value :: l
         type(common_t), intent(inout) :: common
      end function cholmod_change_factor

      integer(c_int) function cholmod_free_factor(l, common) bind(C)
         import :: c_int, c_ptr, common_t
         type(c_ptr), intent(inout) :: l
         type(common_t), intent(inout) :: common
      end function cholmod_free_factor

      integer(c_int) function cholmod_free_dense(x, common) bind(C)
         import :: c_int, c_ptr, common_t
         type(c_ptr), intent(inout) :: x
         type(common_t), intent(inout) :: common
      end function cholmod_free_dense
   end interface

contains

   !> True between analyse and free.
   pure logical function analysed(self)
      class(cholmod_t), intent(in) :: self
      analysed = associated(self%common)
   end function analysed

   !> Order the equations and find the pattern of the factor.
   subroutine analyse(self, n, column_pointer, row, error)
      class(cholmod_t), intent(inout) :: self
      integer, intent(in) :: n !< equations, at least 1
      integer(i4), intent(in) :: column_pointer(:), row(:) !< lower triangle, numbered from 1
      type(error_t), allocatable, intent(out) :: error
      type(sparse_t) :: a

      call self%free()
      self%n = n
      allocate (self%common)
      allocate (self%column_pointer, source=int(column_pointer - 1, c_int))
      allocate (self%row, source=int(row - 1, c_int))
      if (cholmod_start(self%common) == 0 .or. .not. layout_is_known(self%common)) then
         call raise(error, status_invalid_argument, 'this release of CHOLMOD is not known; SuiteSparse 5.12 is')
         deallocate (self%common)
         return
      end if
      self%common%print = 0
      self%common%try_catch = 1
      self%common%quick_return_if_not_posdef = 1
      self%common%final_ll = 0
      self%common%supernodal = simplicial_or_supernodal

      a = sparse_matrix(self, c_null_ptr)
      self%definite = cholmod_analyze(a, self%common)
      if (.not. c_associated(self%definite)) then
         call report(self%common%status, n, error)
         return
      end if
      if (.not. self%supernodal()) then
         self%indefinite = self%definite
         self%definite = c_null_ptr
      end if
   end subroutine analyse

   !> True when the matrix is large enough for the supernodal method; small ones always take L D L^T.
   logical function supernodal(self)
      class(cholmod_t), intent(in) :: self
      type(factor_t), pointer :: factor
      supernodal = .false.
      if (.not. c_associated(self%definite)) return
      call c_f_pointer(self%definite, factor)
      supernodal = factor%is_super /= 0
   end function supernodal

   !> Factorise; `ok` is false, without error, when a pivot was not positive (definite) or zero (indefinite).
   subroutine factorise(self, values, definite, ok, error)
      class(cholmod_t), intent(inout) :: self
      real(dp), intent(in), target, contiguous :: values(:)
      logical, intent(in) :: definite !< supernodal L L^T; otherwise simplicial L D L^T
      logical, intent(out) :: ok
      type(error_t), allocatable, intent(out) :: error
      type(sparse_t) :: a
      type(factor_t), pointer :: factor
      integer(c_int) :: done

      ok = .false.
      self%current = c_null_ptr
      if (definite .and. .not. c_associated(self%definite)) return
      if (.not. definite .and. .not. c_associated(self%indefinite)) then
         ! The same ordering without supernodes: convert a copy back to a plain symbolic factor.
         self%indefinite = cholmod_copy_factor(self%definite, self%common)
         done = 0
         if (c_associated(self%indefinite)) done = cholmod_change_factor(cholmod_pattern, 0, 0, 1, 1, self%indefinite, self%common)
         if (done == 0) then
            call report(self%common%status, self%n, error)
            return
         end if
      end if
      self%current = merge_pointer(self%definite, self%indefinite, definite)
      a = sparse_matrix(self, c_loc(values))
      done = cholmod_factorize(a, self%current, self%common)
      if (done == 0 .or. self%common%status < cholmod_ok) then
         call report(self%common%status, self%n, error)
         self%current = c_null_ptr
         return
      end if
      call c_f_pointer(self%current, factor)
      ok = factor%minor == factor%n
      if (.not. ok) self%current = c_null_ptr
   end subroutine factorise

   !> The pivots of the last factorisation, by equation: squares of the diagonal of L, or D.
   subroutine pivots(self, d)
      class(cholmod_t), intent(in) :: self
      real(dp), intent(out) :: d(:) !< (n)
      type(factor_t), pointer :: factor
      integer(c_int), pointer :: perm(:), first(:), rows(:), start(:)
      real(c_double), pointer :: x(:)
      integer :: j, s, height, place

      call c_f_pointer(self%current, factor)
      call c_f_pointer(factor%perm, perm, [self%n])
      if (factor%is_super /= 0) then
         call c_f_pointer(factor%super, first, [factor%nsuper + 1])
         call c_f_pointer(factor%pi, rows, [factor%nsuper + 1])
         call c_f_pointer(factor%px, start, [factor%nsuper + 1])
         call c_f_pointer(factor%x, x, [factor%xsize])
         do s = 1, int(factor%nsuper)
            height = rows(s + 1) - rows(s)
            place = start(s) + 1
            do j = first(s) + 1, first(s + 1)
               d(perm(j) + 1) = x(place)**2
               place = place + height + 1
            end do
         end do
      else
         call c_f_pointer(factor%p, start, [self%n + 1])
         call c_f_pointer(factor%x, x, [factor%nzmax])
         do j = 1, self%n
            d(perm(j) + 1) = x(start(j) + 1)
         end do
      end if
   end subroutine pivots

   !> Solve with the last factorisation.
   subroutine solve(self, b, x, error)
      class(cholmod_t), intent(inout) :: self
      real(dp), intent(in), target, contiguous :: b(:, :) !< (n, right-hand sides)
      real(dp), intent(inout) :: x(:, :)
      type(error_t), allocatable, intent(out) :: error
      type(dense_t) :: rhs
      type(dense_t), pointer :: solution
      real(c_double), pointer :: values(:, :)
      integer(c_int) :: done

      if (.not. c_associated(self%current)) then
         call raise(error, status_invalid_argument, 'solution asked for before a successful factorisation')
         return
      end if
      rhs%nrow = self%n
      rhs%ncol = size(b, 2)
      rhs%nzmax = size(b)
      rhs%d = self%n
      rhs%x = c_loc(b)
      rhs%z = c_null_ptr
      rhs%xtype = cholmod_real
      rhs%dtype = 0
      done = cholmod_solve2(solve_a, self%current, rhs, c_null_ptr, self%x, c_null_ptr, self%y, self%e, self%common)
      if (done == 0) then
         call report(self%common%status, self%n, error)
         return
      end if
      call c_f_pointer(self%x, solution)
      call c_f_pointer(solution%x, values, [self%n, size(b, 2)])
      x(:self%n, :) = values
   end subroutine solve

   !> Give everything back. Harmless when there is nothing.
   subroutine free(self)
      class(cholmod_t), intent(inout) :: self
      integer(c_int) :: done
      if (associated(self%common)) then
         if (c_associated(self%definite)) done = cholmod_free_factor(self%definite, self%common)
         if (c_associated(self%indefinite)) done = cholmod_free_factor(self%indefinite, self%common)
         if (c_associated(self%x)) done = cholmod_free_dense(self%x, self%common)
         if (c_associated(self%y)) done = cholmod_free_dense(self%y, self%common)
         if (c_associated(self%e)) done = cholmod_free_dense(self%e, self%common)
         done = cholmod_finish(self%common)
         deallocate (self%common)
      end if
      if (associated(self%column_pointer)) deallocate (self%column_pointer)
      if (associated(self%row)) deallocate (self%row)
      self%current = c_null_ptr
      self%n = 0
   end subroutine free

   subroutine copy(self, other)
      class(cholmod_t), intent(inout) :: self
      class(cholmod_t), intent(in) :: other
      ! Only the copy is emptied; a self-assignment must keep its factors.
      if (associated(self%common, other%common)) return
      call self%free()
   end subroutine copy

   subroutine finalise(self)
      type(cholmod_t), intent(inout) :: self
      call self%free()
   end subroutine finalise

   !> What cholmod_start is documented to leave in the fields used here.
   pure logical function layout_is_known(common)
      type(common_t), intent(in) :: common
      layout_is_known = abs(common%grow0 - 1.2_dp) < 1e-12_dp .and. abs(common%grow1 - 1.2_dp) < 1e-12_dp .and. &
                        common%grow2 == 5 .and. common%maxrank == 8 .and. abs(common%supernodal_switch - 40) < 1e-12_dp .and. &
                        common%supernodal == 1 .and. common%final_asis == 1 .and. common%final_ll == 0 .and. &
                        all(common%nrelax == [4, 16, 48]) .and. common%quick_return_if_not_posdef == 0 .and. &
                        common%print == 3 .and. common%try_catch == 0 .and. common%nmethods == 0 .and. &
                        common%method(2)%ordering == 2 .and. common%postorder == 1 .and. &
                        .not. c_associated(common%iwork) .and. common%itype == 0 .and. common%status == cholmod_ok
   end function layout_is_known

   pure function merge_pointer(a, b, condition) result(p)
      type(c_ptr), intent(in) :: a, b
      logical, intent(in) :: condition
      type(c_ptr) :: p
      if (condition) then
         p = a
      else
         p = b
      end if
   end function merge_pointer

   !> The matrix as CHOLMOD sees it: no copy.
   function sparse_matrix(self, values) result(a)
      class(cholmod_t), intent(in) :: self
      type(c_ptr), intent(in) :: values !< null for the pattern alone
      type(sparse_t) :: a
      a%nrow = self%n
      a%ncol = self%n
      a%nzmax = size(self%row)
      a%p = c_loc(self%column_pointer)
      a%i = c_loc(self%row)
      a%nz = c_null_ptr
      a%x = values
      a%z = c_null_ptr
      a%stype = -1
      a%itype = 0
      a%xtype = merge(cholmod_real, cholmod_pattern, c_associated(values))
      a%dtype = 0
      a%sorted = 1
      a%packed = 1
   end function sparse_matrix

   subroutine report(status, n, error)
      integer(c_int), intent(in) :: status
      integer, intent(in) :: n
      type(error_t), allocatable, intent(inout) :: error
      select case (status)
      case (cholmod_out_of_memory)
         call raise(error, status_out_of_memory, 'not enough memory to factorise '//text_of(n)//' equations')
      case (cholmod_too_large)
         call raise(error, status_out_of_memory, 'the factor of '//text_of(n)//' equations is too large for 32-bit indices')
      case default
         call raise(error, status_invalid_argument, 'CHOLMOD failed with status '//text_of(int(status)))
      end select
   end subroutine report
end module finshell_cholmod
