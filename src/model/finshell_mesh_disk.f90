!> Meshes of circular disks and their symmetric parts: concentric rings of triangles.
!>
!> In the core the number of edges grows from ring to ring, ring k having k times as many as the first one, so there is no crowd
!> of slender triangles at the centre; outside of the core it stays the same. The longer the rim edges compared with the width of
!> the rings, the better a disk bears being stretched radially to a multiple of its size.
module finshell_mesh_disk
   use finshell_kinds, only: wp, i8
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_input_error
   use finshell_mesh, only: mesh_t, new_mesh, add_node_set, add_edge_set
   use finshell_surface, only: surface_t, surface_flat
   use finshell_mesh_grid, only: require_positive, snap_to_planes
   implicit none
   private
   public :: disk_mesh

   real(wp), parameter :: pi = acos(-1.0_wp)

contains

   !> Disk in the plane z = 0 about the origin, normal +z: whole, half (y >= 0), quarter (x, y >= 0) or eighth (0 <= y <= x).
   !>
   !> A whole disk has sectors*core*(2*rings - core) elements, a quarter of the disk a quarter of that. Sets: centre, rim, and on
   !> the straight edges edge_y0 (y = 0; half, quarter, eighth), edge_x0 (x = 0; quarter), edge_diagonal (x = y; eighth); the ends
   !> of the straight edges on the rim are rim_x (on +x, always), rim_y (on +y; not the eighth, nor where the mesh has no node
   !> there), rim_diagonal (eighth).
   subroutine disk_mesh(mesh, radius, rings, error, portion, sectors, core, grading, diagonal, distortion)
      type(mesh_t), intent(out) :: mesh
      real(wp), intent(in) :: radius
      integer, intent(in) :: rings !< elements from the centre to the rim
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: portion !< 'full', 'half', 'quarter' (default) or 'eighth'
      !> Edges of the first ring around the whole disk: default 8; a multiple of 1, 2, 4, 8 for full, half, quarter, eighth;
      !> rim edges around the whole disk are sectors*core.
      integer, intent(in), optional :: sectors
      integer, intent(in), optional :: core !< rings whose number of edges grows; default: all
      real(wp), intent(in), optional :: grading !< width of the ring at the rim over that at the centre (geometric); default 1
      !> Of the cells outside of the core: 'forward' joins the inner node to the outer one at the larger angle, 'backward' the other
      !> two, 'alternating' (default) changes from cell to cell.
      character(len=*), intent(in), optional :: diagonal
      !> Nodes inside are moved by up to this fraction of the width of a ring and of an edge around, the same way every time.
      real(wp), intent(in), optional :: distortion
      character(len=:), allocatable :: chosen_portion, cut
      real(wp), allocatable :: x(:, :), position(:)
      integer, allocatable :: t(:, :)
      real(wp) :: ratio, r, a
      integer(i8) :: seed
      integer, allocatable :: segments(:), before(:)
      integer :: parts, around, grows, m, k, j, s, elements
      logical :: closed

      chosen_portion = 'quarter'
      if (present(portion)) chosen_portion = portion
      around = 8
      if (present(sectors)) around = sectors
      grows = rings
      if (present(core)) grows = core
      cut = 'alternating'
      if (present(diagonal)) cut = diagonal
      ratio = 1.0_wp
      if (present(grading)) ratio = grading
      select case (chosen_portion)
      case ('full'); parts = 1
      case ('half'); parts = 2
      case ('quarter'); parts = 4
      case ('eighth'); parts = 8
      case default
         call raise(error, status_input_error, "portion = '"//chosen_portion &
            //"' is not known; known are: full, half, quarter, eighth")
         return
      end select
      call require_positive('radius', radius, error)
      call require_positive('grading', ratio, error)
      if (allocated(error)) return
      if (around < 3 .or. mod(around, parts) /= 0) then
         call raise(error, status_input_error, 'sectors = '//text_of(around)//' must be at least 3 and, for a '//chosen_portion &
            //' disk, a multiple of '//text_of(parts))
         return
      end if
      if (cut /= 'forward' .and. cut /= 'backward' .and. cut /= 'alternating') then
         call raise(error, status_input_error, "diagonal = '"//cut//"' is not known for a disk; known are: forward, backward, " &
            //'alternating')
      else if (rings < 1 .or. grows < 1 .or. grows > rings) then
         call raise(error, status_input_error, 'rings = '//text_of(rings)//', core = '//text_of(grows) &
            //': both must be positive, and core at most rings')
      else if (real(around, wp)*grows*rings > 1.0e8_wp) then
         call raise(error, status_input_error, 'rings = '//text_of(rings)//', core = '//text_of(grows)//' give too many elements')
      end if
      if (allocated(error)) return
      m = around/parts
      closed = parts == 1
      segments = [(m*min(k, grows), k=1, rings)]
      allocate (before(rings))
      before(1) = 1
      do k = 2, rings
         before(k) = before(k - 1) + segments(k - 1) + merge(0, 1, closed)
      end do
      allocate (x(3, before(rings) + segments(rings) + merge(0, 1, closed)), t(3, m*grows*(2*rings - grows)))
      x(:, 1) = 0.0_wp
      position = [(ring_position(k, rings, ratio), k=1, rings)]
      seed = 20260701_i8
      do k = 1, rings
         do j = 0, merge(segments(k) - 1, segments(k), closed)
            r = radius*position(k)
            a = 2.0_wp*pi/parts*real(j, wp)/segments(k)
            if (present(distortion)) then
               if (k < rings .and. (closed .or. (j > 0 .and. j < segments(k)))) then
                  r = r + distortion*random()*radius*(position(k + 1) - position(k))
                  a = a + distortion*random()*2.0_wp*pi/(parts*segments(k))
               end if
            end if
            x(:, ring_node(k, j)) = [r*cos(a), r*sin(a), 0.0_wp]
         end do
      end do
      call snap_to_planes(x)
      elements = 0
      do k = 1, grows
         do s = 0, m - 1
            do j = 1, k
               call append(ring_node(k - 1, s*(k - 1) + j - 1), ring_node(k, s*k + j - 1), ring_node(k, s*k + j))
               if (j < k) call append(ring_node(k - 1, s*(k - 1) + j - 1), ring_node(k, s*k + j), ring_node(k - 1, s*(k - 1) + j))
            end do
         end do
      end do
      do k = grows + 1, rings
         do j = 0, segments(k) - 1
            if (cut == 'forward' .or. (cut == 'alternating' .and. mod(k - grows + j, 2) == 1)) then
               call append(ring_node(k - 1, j), ring_node(k, j), ring_node(k, j + 1))
               call append(ring_node(k - 1, j), ring_node(k, j + 1), ring_node(k - 1, j + 1))
            else
               call append(ring_node(k - 1, j), ring_node(k, j), ring_node(k - 1, j + 1))
               call append(ring_node(k, j), ring_node(k, j + 1), ring_node(k - 1, j + 1))
            end if
         end do
      end do
      call new_mesh(mesh, x, t)
      mesh%surface = surface_t(surface_flat, [radius])
      call add_sets()

   contains

      subroutine append(p, q, r)
         integer, intent(in) :: p, q, r
         elements = elements + 1
         t(:, elements) = [p, q, r]
      end subroutine append

      !> Next number in [-1, 1] of the minimal standard generator: the same everywhere.
      real(wp) function random()
         seed = mod(16807_i8*seed, 2147483647_i8)
         random = 2.0_wp*real(seed, wp)/2147483647.0_wp - 1.0_wp
      end function random

      !> Node j (from 0) of ring k; ring 0 is the centre.
      pure integer function ring_node(k, j)
         integer, intent(in) :: k, j
         if (k == 0) then
            ring_node = 1
         else if (closed) then
            ring_node = before(k) + 1 + mod(j, segments(k))
         else
            ring_node = before(k) + 1 + j
         end if
      end function ring_node

      !> End of the arc of a ring; the centre for ring 0.
      pure integer function last_node(k)
         integer, intent(in) :: k
         last_node = 1
         if (k > 0) last_node = ring_node(k, segments(k))
      end function last_node

      subroutine add_sets()
         integer :: i, rim_edges
         rim_edges = segments(rings)
         call add_node_set(mesh, 'centre', [1])
         call add_edge_set(mesh, 'rim', pairs([(ring_node(rings, i), i=0, rim_edges)]))
         call add_node_set(mesh, 'rim_x', [ring_node(rings, 0)])
         if (parts <= 4 .and. mod(rim_edges*parts, 4) == 0) call add_node_set(mesh, 'rim_y', [ring_node(rings, rim_edges*parts/4)])
         select case (parts)
         case (2)
            call add_edge_set(mesh, 'edge_y0', pairs([(last_node(i), i=rings, 1, -1), (ring_node(i, 0), i=0, rings)]))
         case (4)
            call add_edge_set(mesh, 'edge_y0', pairs([(ring_node(i, 0), i=0, rings)]))
            call add_edge_set(mesh, 'edge_x0', pairs([(last_node(i), i=0, rings)]))
         case (8)
            call add_edge_set(mesh, 'edge_y0', pairs([(ring_node(i, 0), i=0, rings)]))
            call add_edge_set(mesh, 'edge_diagonal', pairs([(last_node(i), i=0, rings)]))
            call add_node_set(mesh, 'rim_diagonal', [ring_node(rings, rim_edges)])
         end select
      end subroutine add_sets
   end subroutine disk_mesh

   !> Relative radius of ring k when the widths of the rings form a geometric series whose last term is ratio times the first.
   pure real(wp) function ring_position(k, rings, ratio)
      integer, intent(in) :: k, rings
      real(wp), intent(in) :: ratio
      real(wp) :: growth(rings)
      integer :: i
      growth = [(ratio**(real(i - 1, wp)/max(rings - 1, 1)), i=1, rings)]
      ring_position = sum(growth(:k))/sum(growth)
   end function ring_position

   pure function pairs(nodes) result(edges)
      integer, intent(in) :: nodes(:)
      integer :: edges(2, size(nodes) - 1)
      edges(1, :) = nodes(:size(nodes) - 1)
      edges(2, :) = nodes(2:)
   end function pairs
end module finshell_mesh_disk
