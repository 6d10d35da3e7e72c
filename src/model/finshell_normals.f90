!> Normals of the surface that a mesh approximates, at the three nodes of every element: what makes curved elements of facets.
!>
!> Where a generator knows its surface, `exact_normals` hands its nodal normals to the elements. For other meshes
!> `fitted_normals` lays a quadric w = a x + b y + c x^2 + d x y + e y^2 through each node and its neighbours by weighted least
!> squares (weight 1/r^2) and takes its normal. Averages of facet normals are one-sided at free edges (5 degrees wrong where
!> the fit is 0.3). Creases part the elements of a node into groups, each with a normal of its own; planes of symmetry complete
!> the neighbours by their images.
module finshell_normals
   use finshell_kinds, only: wp, dp, i8
   use finshell_rotation, only: cross_product
   use finshell_mesh, only: mesh_t, twice_area_vector
   use finshell_mesh_sorting, only: sorted_order
   implicit none
   private
   public :: exact_normals, facet_normal, fitted_normals, symmetry_planes_t, add_turns, smooth_neighbours

   !> Planes of symmetry of the model, through given nodes.
   type :: symmetry_planes_t
      real(wp), allocatable :: normal(:, :) !< (3, planes) unit normals
      logical, allocatable :: through(:, :) !< (planes, nodes)
   end type symmetry_planes_t

   integer, parameter :: most_neighbours = 200 !< of a node, images included
   integer, parameter :: enough = 6 !< neighbours that determine a quadric; with fewer, their neighbours come in
   real(wp), parameter :: degree = acos(-1.0_wp)/180
   !> Singular values below this share of the largest do not count: on strips one element wide x y and y^2 cannot be told apart.
   real(dp), parameter :: rank_tolerance = 0.02_dp
   !> A fit that leads further than this from the average of the facets is no normal of the surface.
   real(wp), parameter :: most_correction = 30*degree

   interface
      !> LAPACK: minimum-norm least squares by a rank-revealing orthogonal factorisation.
      subroutine dgelsy(m, n, nrhs, a, lda, b, ldb, jpvt, rcond, rank, work, lwork, info)
         import :: dp
         integer, intent(in) :: m, n, nrhs, lda, ldb, lwork
         real(dp), intent(inout) :: a(lda, *), b(ldb, *)
         integer, intent(inout) :: jpvt(*)
         real(dp), intent(in) :: rcond
         integer, intent(out) :: rank, info
         real(dp), intent(out) :: work(*)
      end subroutine dgelsy
   end interface

contains

   !> Angles (of any component) between normals and facets, where they are larger than nodal rotations: strains are differences from
   !> theirs.
   pure subroutine add_turns(mesh, normal, rotation)
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(in) :: normal(:, :, :) !< (3, 3, elements)
      real(wp), intent(inout) :: rotation(:, :) !< (3, nodes)
      integer :: e, k
      real(wp) :: angle
      do e = 1, size(mesh%triangles, 2)
         do k = 1, 3
            associate (node => mesh%triangles(k, e))
               angle = norm2(normal(:, k, e)/norm2(normal(:, k, e)) - facet_normal(mesh, e))
               rotation(:, node) = sign(max(abs(rotation(:, node)), angle), rotation(:, node))
            end associate
         end do
      end do
   end subroutine add_turns

   !> Nodal normals (3, nodes) of the generator, turned to the side of each facet's own.
   pure subroutine exact_normals(mesh, normal)
      type(mesh_t), intent(in) :: mesh !< its normal is allocated
      real(wp), allocatable, intent(out) :: normal(:, :, :) !< (3, 3, elements): component, node, element
      real(wp) :: sense
      integer :: e, k
      allocate (normal(3, 3, size(mesh%triangles, 2)))
      do e = 1, size(mesh%triangles, 2)
         do k = 1, 3
            normal(:, k, e) = mesh%normal(:, mesh%triangles(k, e))
         end do
         sense = sign(1.0_wp, dot_product(sum(normal(:, :, e), dim=2), facet_normal(mesh, e)))
         do k = 1, 3
            normal(:, k, e) = normal(:, k, e)*(sense/norm2(normal(:, k, e)))
         end do
      end do
   end subroutine exact_normals

   pure function facet_normal(mesh, e) result(n)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: e
      real(wp) :: n(3)
      n = twice_area_vector(mesh, e)
      n = n/norm2(n)
   end function facet_normal

   !> Fitted normals. Where facets meet at more than `crease_angle` degrees, at the edges in `crease`, and where more or fewer than
   !> two elements meet, each side keeps a normal of its own. Flat surroundings give the facet's normal.
   subroutine fitted_normals(mesh, crease_angle, normal, crease, planes)
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(in) :: crease_angle
      real(wp), allocatable, intent(out) :: normal(:, :, :) !< (3, 3, elements): component, node, element
      integer, intent(in), optional :: crease(:, :) !< (2, edges) pairs of nodes
      type(symmetry_planes_t), intent(in), optional :: planes
      real(wp), allocatable :: facet(:, :)
      type(symmetry_planes_t), allocatable :: across !< unallocated counts as absent in the call
      integer, allocatable :: neighbour(:, :), first(:), star(:)
      integer :: e, node

      allocate (facet(3, size(mesh%triangles, 2)), normal(3, 3, size(mesh%triangles, 2)))
      do e = 1, size(facet, 2)
         facet(:, e) = facet_normal(mesh, e)
      end do
      call smooth_neighbours(mesh%triangles, facet, cos(crease_angle*degree), neighbour, crease)
      call elements_of_nodes(mesh%triangles, size(mesh%coordinates, 2), first, star)
      if (present(planes)) across = planes
      !$omp parallel do schedule(dynamic, 64)
      do node = 1, size(mesh%coordinates, 2)
         associate (own => star(first(node):first(node + 1) - 1))
            ! a plane along the surface is one to slide on
            if (allocated(across)) across%through(:, node) = across%through(:, node) &
               .and. abs(matmul(sum(facet(:, own), 2), across%normal)) < 0.5_wp*size(own)
            call fit_node(mesh, facet, neighbour, node, own, normal, across)
         end associate
      end do
      !$omp end parallel do
   end subroutine fitted_normals

   !> Element across each side, 0 where the surface ends or has a crease.
   pure subroutine smooth_neighbours(triangles, facet, cosine, neighbour, crease)
      integer, intent(in) :: triangles(:, :)
      real(wp), intent(in) :: facet(:, :), cosine
      integer, allocatable, intent(out) :: neighbour(:, :) !< (3, elements)
      integer, intent(in), optional :: crease(:, :)
      integer(i8), allocatable :: ends(:) !< of every side, the two nodes as one number
      integer, allocatable :: order(:)
      integer :: c, e, first, i, k, last, n, sides

      n = size(triangles, 2)
      c = 0
      if (present(crease)) c = size(crease, 2)
      sides = 3*n
      allocate (neighbour(3, n), source=0)
      allocate (ends(sides + c))
      do e = 1, n
         do k = 1, 3
            ends(3*(e - 1) + k) = pair(triangles(k, e), triangles(1 + mod(k, 3), e))
         end do
      end do
      do i = 1, c
         ends(sides + i) = pair(crease(1, i), crease(2, i))
      end do
      order = sorted_order(ends)
      first = 1
      do while (first <= size(order))
         last = first
         do while (last < size(order))
            if (ends(order(last + 1)) /= ends(order(first))) exit
            last = last + 1
         end do
         ! two sides and no crease among them
         if (last == first + 1 .and. maxval(order(first:last)) <= sides) then
            i = order(first)
            k = order(last)
            if (dot_product(facet(:, (i + 2)/3), facet(:, (k + 2)/3)) > cosine) then
               neighbour(mod(i - 1, 3) + 1, (i + 2)/3) = (k + 2)/3
               neighbour(mod(k - 1, 3) + 1, (k + 2)/3) = (i + 2)/3
            end if
         end if
         first = last + 1
      end do
   end subroutine smooth_neighbours

   pure integer(i8) function pair(i, j)
      integer, intent(in) :: i, j
      pair = ishft(int(min(i, j), i8), 31) + max(i, j)
   end function pair

   !> Elements at each node, one list after the other.
   pure subroutine elements_of_nodes(triangles, nodes, first, star)
      integer, intent(in) :: triangles(:, :), nodes
      integer, allocatable, intent(out) :: first(:), star(:)
      integer, allocatable :: at(:)
      integer :: e, k
      allocate (first(nodes + 1), source=0)
      do e = 1, size(triangles, 2)
         do k = 1, 3
            first(triangles(k, e) + 1) = first(triangles(k, e) + 1) + 1
         end do
      end do
      first(1) = 1
      do k = 1, nodes
         first(k + 1) = first(k + 1) + first(k)
      end do
      at = first
      allocate (star(3*size(triangles, 2)))
      do e = 1, size(triangles, 2)
         do k = 1, 3
            star(at(triangles(k, e))) = e
            at(triangles(k, e)) = at(triangles(k, e)) + 1
         end do
      end do
   end subroutine elements_of_nodes

   !> The elements of a node, group by group: those that smooth edges join.
   subroutine fit_node(mesh, facet, neighbour, node, star, normal, planes)
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(in) :: facet(:, :)
      integer, intent(in) :: neighbour(:, :), node, star(:)
      real(wp), intent(inout) :: normal(:, :, :)
      type(symmetry_planes_t), intent(in), optional :: planes
      logical :: done(size(star)), mine(size(star))
      real(wp) :: n(3)
      integer :: i, k

      done = .false.
      do i = 1, size(star)
         if (done(i)) cycle
         mine = joined(neighbour, star, i)
         n = group_normal(mesh, facet, neighbour, node, pack(star, mine), planes)
         do k = 1, size(star)
            if (mine(k)) normal(:, findloc(mesh%triangles(:, star(k)), node, dim=1), star(k)) = n
         end do
         done = done .or. mine
      end do
   end subroutine fit_node

   !> Which elements of a star smooth edges join to one of them.
   pure function joined(neighbour, star, start) result(mine)
      integer, intent(in) :: neighbour(:, :), star(:), start
      logical :: mine(size(star))
      logical :: grown
      integer :: i, k
      mine = .false.
      mine(start) = .true.
      grown = .true.
      do while (grown)
         grown = .false.
         do i = 1, size(star)
            if (mine(i)) cycle
            do k = 1, 3
               if (.not. any(pack(star, mine) == neighbour(k, star(i)))) cycle
               mine(i) = .true.
               grown = .true.
            end do
         end do
      end do
   end function joined

   !> Normal at a node of the surface that a group of its elements belongs to.
   function group_normal(mesh, facet, neighbour, node, group, planes) result(n)
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(in) :: facet(:, :)
      integer, intent(in) :: neighbour(:, :), node, group(:)
      type(symmetry_planes_t), intent(in), optional :: planes
      real(wp) :: n(3)
      real(wp) :: cloud(3, most_neighbours), average(3)
      integer, allocatable :: elements(:)
      integer :: ring, points

      average = onto_planes(average_normal(mesh, facet, node, group), node, planes)
      n = average
      ! flat to rounding, and further out too (a strip of cells along a straight edge is flat on any cylinder): to the last bit
      elements = with_neighbours(neighbour, with_neighbours(neighbour, group))
      if (all(norm2(facet(:, elements) - spread(facet(:, group(1)), 2, size(elements)), dim=1) < 1.0e-12_wp)) then
         n = facet(:, group(1))
         return
      end if
      elements = group
      do ring = 1, 3
         call gather_cloud(mesh, elements, node, cloud, points, planes)
         if (points >= enough .or. ring == 3) exit
         elements = with_neighbours(neighbour, elements)
      end do
      call fit(cloud(:, :points), n)
      n = onto_planes(n, node, planes)
      if (.not. dot_product(n, average) > cos(most_correction)) n = average
   end function group_normal

   !> Facet normals weighted by the area over the squares of the two sides at the node (Max 1999): exact on a sphere.
   pure function average_normal(mesh, facet, node, group) result(n)
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(in) :: facet(:, :)
      integer, intent(in) :: node, group(:)
      real(wp) :: n(3), a(3), b(3)
      integer :: i, k
      n = 0
      do i = 1, size(group)
         k = findloc(mesh%triangles(:, group(i)), node, dim=1)
         a = mesh%coordinates(:, mesh%triangles(1 + mod(k, 3), group(i))) - mesh%coordinates(:, node)
         b = mesh%coordinates(:, mesh%triangles(1 + mod(k + 1, 3), group(i))) - mesh%coordinates(:, node)
         n = n + norm2(cross_product(a, b))/(dot_product(a, a)*dot_product(b, b))*facet(:, group(i))
      end do
      n = n/norm2(n)
   end function average_normal

   !> The normal without its parts along the normals of the planes of symmetry through the node.
   pure function onto_planes(n, node, planes) result(m)
      real(wp), intent(in) :: n(3)
      integer, intent(in) :: node
      type(symmetry_planes_t), intent(in), optional :: planes
      real(wp) :: m(3)
      integer :: p
      m = n
      if (present(planes)) then
         do p = 1, size(planes%normal, 2)
            if (planes%through(p, node)) m = m - dot_product(m, planes%normal(:, p))*planes%normal(:, p)
         end do
      end if
      if (norm2(m) > 0.1_wp) then
         m = m/norm2(m)
      else
         m = n
      end if
   end function onto_planes

   !> Positions relative to a node of the other nodes of some elements, and their images.
   subroutine gather_cloud(mesh, elements, node, cloud, points, planes)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: elements(:), node
      real(wp), intent(out) :: cloud(3, most_neighbours)
      integer, intent(out) :: points
      type(symmetry_planes_t), intent(in), optional :: planes
      integer :: found(most_neighbours), i, k, n, p, real_points
      n = 0
      points = 0
      do i = 1, size(elements)
         do k = 1, 3
            associate (other => mesh%triangles(k, elements(i)))
               if (other == node .or. any(found(:n) == other) .or. n == most_neighbours) cycle
               n = n + 1
               found(n) = other
               cloud(:, n) = mesh%coordinates(:, other) - mesh%coordinates(:, node)
            end associate
         end do
      end do
      points = n
      if (.not. present(planes)) return
      do p = 1, size(planes%normal, 2)
         if (.not. planes%through(p, node)) cycle
         real_points = points
         do i = 1, real_points
            associate (height => dot_product(cloud(:, i), planes%normal(:, p)))
               if (abs(height) < 1.0e-9_wp*norm2(cloud(:, i)) .or. points == most_neighbours) cycle
               points = points + 1
               cloud(:, points) = cloud(:, i) - 2*height*planes%normal(:, p)
            end associate
         end do
      end do
   end subroutine gather_cloud

   pure function with_neighbours(neighbour, elements) result(more)
      integer, intent(in) :: neighbour(:, :), elements(:)
      integer, allocatable :: more(:)
      integer :: i, k
      more = elements
      do i = 1, size(elements)
         do k = 1, 3
            if (neighbour(k, elements(i)) == 0) cycle
            if (.not. any(more == neighbour(k, elements(i)))) more = [more, neighbour(k, elements(i))]
         end do
      end do
   end function with_neighbours

   !> Turn n into the normal of the fitted quadric; a few rounds, as x, y and w are measured from n.
   subroutine fit(cloud, n)
      real(wp), intent(in) :: cloud(:, :) !< (3, points)
      real(wp), intent(inout) :: n(3)
      real(dp) :: a(size(cloud, 2), 5), b(max(5, size(cloud, 2)), 1), work(200 + 8*size(cloud, 2)), length
      real(wp) :: axis(3, 2), turned(3)
      integer :: i, info, pivot(5), rank, round

      length = maxval(norm2(cloud, dim=1))
      do round = 1, 5
         axis(:, 1) = 0
         axis(minloc(abs(n), dim=1), 1) = 1
         axis(:, 1) = cross_product(n, axis(:, 1))
         axis(:, 1) = axis(:, 1)/norm2(axis(:, 1))
         axis(:, 2) = cross_product(n, axis(:, 1))
         do i = 1, size(cloud, 2)
            associate (x => dot_product(cloud(:, i), axis(:, 1))/length, y => dot_product(cloud(:, i), axis(:, 2))/length, &
                       w => dot_product(cloud(:, i), n)/length, weight => length**2/dot_product(cloud(:, i), cloud(:, i)))
               a(i, :) = weight*[x, y, x*x, x*y, y*y]
               b(i, 1) = weight*w
            end associate
         end do
         pivot = 0
         call dgelsy(size(cloud, 2), 5, 1, a, size(a, 1), b, size(b, 1), pivot, rank_tolerance, rank, work, size(work), info)
         if (info /= 0) return
         turned = n - b(1, 1)*axis(:, 1) - b(2, 1)*axis(:, 2)
         turned = turned/norm2(turned)
         if (norm2(turned - n) < 1.0e-10_wp) exit
         n = turned
      end do
      n = turned
   end subroutine fit
end module finshell_normals
