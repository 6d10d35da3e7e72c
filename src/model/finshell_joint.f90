!> Joints as the input states them, resolved to nodes: which node goes with which, and linear equations between displacements.
module finshell_joint
   use finshell_kinds, only: wp
   implicit none
   private
   public :: joint_t, linear_equation_t, joints_t, origin_t

   !> A node that goes with others: x = sum(weight x_i) + R a, and with `turns` its rotation is R. R is the rotation of the one
   !> master, or that interpolated between three (finshell_interpolated_rotation).
   type :: joint_t
      integer :: node = 0 !< the one that depends
      integer :: masters = 1 !< 1 or 3
      integer :: master(3) = 0
      real(wp) :: weight(3) = [1, 0, 0] !< of the masters; their sum is 1
      real(wp) :: arm(3) = 0 !< a, in the reference state
      logical :: on_arm = .false. !< R counts: the arm has a length
      logical :: turns = .false. !< the rotation depends, too
      integer :: origin = 0 !< index into joints_t%origins
   end type joint_t

   !> sum of coefficient*u(component, node) = 0, in global axes.
   type :: linear_equation_t
      integer, allocatable :: node(:), component(:)
      real(wp), allocatable :: coefficient(:)
      integer :: origin = 0
   end type linear_equation_t

   !> Where a joint is stated, for messages: 'plate.nml:12: &tie'.
   type :: origin_t
      character(len=:), allocatable :: text
   end type origin_t

   type :: joints_t
      type(joint_t), allocatable :: list(:)
      type(linear_equation_t), allocatable :: equations(:)
      type(origin_t), allocatable :: origins(:)
   end type joints_t
end module finshell_joint
