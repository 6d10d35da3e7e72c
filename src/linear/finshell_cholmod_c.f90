!> The part of CHOLMOD's C interface that finshell_cholmod uses.
!>
!> `common_t` mirrors the leading part of `cholmod_common` in CHOLMOD 3.0 (SuiteSparse 5.12; the header of CHOLMOD 4 has the
!> same), with room to spare behind it. The defaults that cholmod_start leaves there are verified before use.
module finshell_cholmod_c
   use, intrinsic :: iso_c_binding, only: c_int, c_long, c_size_t, c_double, c_ptr, c_funptr, c_associated
   use finshell_kinds, only: dp
   implicit none
   private
   public :: cholmod_pattern, cholmod_real, cholmod_ok, cholmod_out_of_memory, cholmod_too_large
   public :: solve_a, solve_l, solve_lt, simplicial_or_supernodal, always_supernodal, ordering_given, ordering_natural
   public :: common_t, sparse_t, dense_t, factor_t, layout_is_known
   public :: cholmod_start, cholmod_finish, cholmod_analyze, cholmod_analyze_p, cholmod_factorize, cholmod_solve2
   public :: cholmod_bisect, cholmod_copy_factor, cholmod_change_factor, cholmod_free_factor, cholmod_free_dense

   integer(c_int), parameter :: cholmod_pattern = 0, cholmod_real = 1
   integer(c_int), parameter :: cholmod_ok = 0
   integer(c_int), parameter :: cholmod_out_of_memory = -2, cholmod_too_large = -3
   integer(c_int), parameter :: solve_a = 0, solve_l = 4, solve_lt = 5
   integer(c_int), parameter :: simplicial_or_supernodal = 1, always_supernodal = 2
   integer(c_int), parameter :: ordering_natural = 0, ordering_given = 1

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

      type(c_ptr) function cholmod_analyze_p(a, permutation, columns, count, common) bind(C)
         import :: c_ptr, c_size_t, sparse_t, common_t
         type(sparse_t), intent(in) :: a
         type(c_ptr), value :: permutation, columns
         integer(c_size_t), value :: count
         type(common_t), intent(inout) :: common
      end function cholmod_analyze_p

      integer(c_long) function cholmod_bisect(a, set, set_size, compress, partition, common) bind(C)
         import :: c_int, c_long, c_ptr, c_size_t, sparse_t, common_t
         type(sparse_t), intent(in) :: a
         type(c_ptr), value :: set
         integer(c_size_t), value :: set_size
         integer(c_int), value :: compress
         integer(c_int), intent(out) :: partition(*)
         type(common_t), intent(inout) :: common
      end function cholmod_bisect

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
end module finshell_cholmod_c
