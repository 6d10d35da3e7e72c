!> What a dead line load on a side does beside pushing its two nodes: its work on the bulge of the side.
!>
!> The side from node i to node j bulges by the mean (alpha_b/12) b (d x n), where d is the deformed side, n the deformed normal and
!> b = n . (t_i x t_j) the difference of the drilling rotations, t being the reference direction of the side turned with each node.
!> So a load q per reference length L has the potential -k (q x d).n b with k = alpha_b L/12, and nodal forces and moments: in a
!> constant stress a pair of moments about the normal, which the drilling freedoms of the element need (finshell_drilling). They
!> have no resultant force, and neighbouring sides of a straight edge cancel each other at the node between them.
module finshell_line_load
   use finshell_freedoms, only: n_nodal, n_shell, uz
   use finshell_kinds, only: wp
   use finshell_reference, only: alpha_b
   use finshell_rotation, only: cross_product
   implicit none
   private
   public :: bulge_load

contains

   !> Nodal forces and moments (of both ends of the side, then of the third node), and their symmetric stiffness for displacements
   !> and spins: derivative of the force along exp(spin) R, without the part that belongs to the turning of the moments themselves.
   pure subroutine bulge_load(length, q, x, t, force, stiffness)
      real(wp), intent(in) :: length !< of the side, reference
      real(wp), intent(in) :: q(3) !< force per reference length
      real(wp), intent(in) :: x(3, 3) !< deformed positions: ends of the side, counter-clockwise, and the third node
      real(wp), intent(in) :: t(3, 2) !< unit reference direction of the side turned with each end
      real(wp), intent(out) :: force(n_shell)
      real(wp), intent(out), optional :: stiffness(n_shell, n_shell)
      real(wp), dimension(3) :: d, e, h, b, a, n, ph, pb, pa, g, fd, fe
      real(wp), dimension(3) :: dd, de, dh, db, da, dn, dph, dpb, dpa, dg, dfd, dfe, mi, mj
      real(wp) :: k, la, hn, bn, dla, dhn, dbn, dt(3, 2), unit(3)
      integer, parameter :: last = 2*n_nodal + uz ! the third node has no moment
      integer :: i, node

      k = -alpha_b/12*length
      d = x(:, 2) - x(:, 1)
      e = x(:, 3) - x(:, 1)
      h = cross_product(q, d)
      b = cross_product(t(:, 1), t(:, 2))
      a = cross_product(d, e)
      la = norm2(a)
      n = a/la
      hn = dot_product(h, n)
      bn = dot_product(b, n)
      ! derivatives of the potential k (h.n)(b.n) with respect to h, b and a
      ph = k*bn*n
      pb = k*hn*n
      g = bn*h + hn*b - 2*hn*bn*n
      pa = k*g/la
      fd = cross_product(ph, q) + cross_product(e, pa)
      fe = cross_product(pa, d)
      mi = cross_product(t(:, 1), cross_product(t(:, 2), pb))
      mj = cross_product(t(:, 2), cross_product(pb, t(:, 1)))
      force = -[-fd - fe, mi, fd, mj, fe, 0*fe]
      if (.not. present(stiffness)) return

      ! the change of all that along each displacement and spin
      stiffness = 0
      do i = 1, last
         node = (i - 1)/n_nodal + 1
         unit = 0
         unit(1 + mod(i - 1, uz)) = 1
         dd = 0
         de = 0
         dt = 0
         select case ((i - 1)/uz)
         case (0)
            dd = -unit
            de = -unit
         case (2)
            dd = unit
         case (4)
            de = unit
         case default
            dt(:, node) = cross_product(unit, t(:, node))
         end select
         dh = cross_product(q, dd)
         db = cross_product(dt(:, 1), t(:, 2)) + cross_product(t(:, 1), dt(:, 2))
         da = cross_product(dd, e) + cross_product(d, de)
         dla = dot_product(n, da)
         dn = (da - n*dla)/la
         dhn = dot_product(dh, n) + dot_product(h, dn)
         dbn = dot_product(db, n) + dot_product(b, dn)
         dph = k*(dbn*n + bn*dn)
         dpb = k*(dhn*n + hn*dn)
         dg = dbn*h + bn*dh + dhn*b + hn*db - 2*(dhn*bn + hn*dbn)*n - 2*hn*bn*dn
         dpa = (k*dg - pa*dla)/la
         dfd = cross_product(dph, q) + cross_product(de, pa) + cross_product(e, dpa)
         dfe = cross_product(dpa, d) + cross_product(pa, dd)
         mi = cross_product(dt(:, 1), cross_product(t(:, 2), pb)) &
            + cross_product(t(:, 1), cross_product(dt(:, 2), pb) + cross_product(t(:, 2), dpb))
         mj = cross_product(dt(:, 2), cross_product(pb, t(:, 1))) &
            + cross_product(t(:, 2), cross_product(dpb, t(:, 1)) + cross_product(pb, dt(:, 1)))
         stiffness(:last, i) = -[-dfd - dfe, mi, dfd, mj, dfe]
      end do
      stiffness = 0.5_wp*(stiffness + transpose(stiffness))
   end subroutine bulge_load
end module finshell_line_load
