!> Smooth strains out of those of the elements: linear in space over the surroundings of each element, by least squares.
!>
!> Superconvergent patch recovery (Zienkiewicz & Zhu 1992) about elements instead of nodes: the mean strains, taken at the
!> centroids, of the element and of all that share a node with it. The plane of a neighbour is turned into that of the element, so
!> that tensors of curved surfaces are compared in one frame. Creases, changes of the section, and edges where other than two
!> elements meet are not crossed; at boundaries the surroundings grow until they determine a fit.
module finshell_strain_patch
   use finshell_kinds, only: wp
   use finshell_mesh, only: twice_area_vector
   use finshell_normals, only: facet_normal, smooth_neighbours
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: surroundings_t, new_surroundings, smooth_strain, turned_strain, n_strains

   integer, parameter :: n_strains = 6 !< membrane strain and curvature: 11, 22, 2 12 each

   type :: surroundings_t
      integer, allocatable :: neighbour(:, :) !< (3, elements) across the side from node k to k + 1; 0: not smooth there
      real(wp), allocatable :: normal(:, :) !< (3, elements) of the facets
      real(wp), allocatable :: centre(:, :) !< (3, elements)
      real(wp), allocatable :: area(:)
   end type surroundings_t

   real(wp), parameter :: degree = acos(-1.0_wp)/180
   real(wp), parameter :: crease_angle = 40*degree !< as that of fitted normals by default
   real(wp), parameter :: one_normal = 1*degree !< normals of a curved surface that differ by more make a crease
   integer, parameter :: most = 60 !< elements of a patch
   integer, parameter :: enough = 8 !< for three coefficients, well
   !> Directions in which the elements of a patch hardly differ are left out of its fit: variance over that of the other.
   real(wp), parameter :: thin = 1.0e-3_wp

contains

   !> Which elements belong together.
   pure subroutine new_surroundings(s, structure)
      type(surroundings_t), intent(out) :: s
      type(structure_t), intent(in) :: structure
      real(wp) :: cosine
      integer :: e, k, n, other

      associate (mesh => structure%mesh)
         n = size(mesh%triangles, 2)
         allocate (s%normal(3, n), s%centre(3, n), s%area(n))
         do e = 1, n
            s%normal(:, e) = facet_normal(mesh, e)
            s%centre(:, e) = sum(mesh%coordinates(:, mesh%triangles(:, e)), 2)/3
            s%area(e) = 0.5_wp*norm2(twice_area_vector(mesh, e))
         end do
         ! a surface with one normal at every node has no creases
         cosine = cos(crease_angle)
         if (allocated(mesh%normal) .or. allocated(structure%normal)) cosine = -2
         call smooth_neighbours(mesh%triangles, s%normal, cosine, s%neighbour)
         do e = 1, n
            do k = 1, 3
               other = s%neighbour(k, e)
               if (other == 0) cycle
               if (structure%element_section(other) /= structure%element_section(e)) s%neighbour(k, e) = 0
               if (.not. one_surface(structure, e, k, other)) s%neighbour(k, e) = 0
            end do
         end do
      end associate
   end subroutine new_surroundings

   !> Are two elements at side k of the first on one side of one surface: oriented alike, with the same normals at both nodes?
   pure logical function one_surface(structure, e, k, other)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: e, k, other
      integer :: a, b, i
      associate (t => structure%mesh%triangles)
         a = findloc(t(:, other), t(k, e), dim=1)
         b = findloc(t(:, other), t(1 + mod(k, 3), e), dim=1)
         one_surface = a == 1 + mod(b, 3)
         if (.not. allocated(structure%normal)) return
         do i = 1, 2
            associate (m => structure%normal(:, merge(k, 1 + mod(k, 3), i == 1), e), &
                       o => structure%normal(:, merge(a, b, i == 1), other))
               one_surface = one_surface .and. dot_product(m, o) > cos(one_normal)*norm2(m)*norm2(o)
            end associate
         end do
      end associate
   end function one_surface

   !> Strains of an element out of those of its surroundings, at three points of it.
   pure subroutine smooth_strain(s, triangles, axes, strain, found, e, points, smooth)
      type(surroundings_t), intent(in) :: s
      integer, intent(in) :: triangles(:, :) !< (3, elements)
      real(wp), intent(in) :: axes(:, :, :) !< (3, 2, elements) of the strains
      real(wp), intent(in) :: strain(:, :) !< (n_strains, elements) at the centroid
      logical, intent(in) :: found(:) !< (elements) that have strains
      integer, intent(in) :: e
      real(wp), intent(in) :: points(3, 3) !< relative to the centroid, global (component, point)
      real(wp), intent(out) :: smooth(n_strains, 3) !< (component, point)
      real(wp) :: at(2, most), value(n_strains, most), weight(most), mean(n_strains), middle(2), moment(3)
      real(wp) :: slope(n_strains, 2), right(n_strains, 2)
      real(wp) :: x(2), inverse(3), reach
      integer :: list(most), i, m, n

      call gather_patch(s, triangles, e, list, n)
      m = 0
      do i = 1, n
         associate (j => list(i))
            if (.not. found(j)) cycle
            m = m + 1
            weight(m) = s%area(j)
            call bring(s, axes, strain(:, j), e, j, at(:, m), value(:, m))
         end associate
      end do
      ! In lengths of the element and parts of the patch: moments are of the fourth order in the unit of length.
      reach = sqrt(s%area(e))
      at(:, :m) = at(:, :m)/reach
      weight(:m) = weight(:m)/sum(weight(:m))
      mean = matmul(value(:, :m), weight(:m))
      middle = matmul(at(:, :m), weight(:m))
      moment = 0
      right = 0
      do i = 1, m
         x = at(:, i) - middle
         moment = moment + weight(i)*[x(1)**2, x(2)**2, x(1)*x(2)]
         right(:, 1) = right(:, 1) + weight(i)*x(1)*(value(:, i) - mean)
         right(:, 2) = right(:, 2) + weight(i)*x(2)*(value(:, i) - mean)
      end do
      inverse = pseudo_inverse(moment)
      slope(:, 1) = right(:, 1)*inverse(1) + right(:, 2)*inverse(3)
      slope(:, 2) = right(:, 1)*inverse(3) + right(:, 2)*inverse(2)
      do i = 1, 3
         x = matmul(points(:, i), axes(:, :, e))/reach - middle
         smooth(:, i) = mean + slope(:, 1)*x(1) + slope(:, 2)*x(2)
      end do
   end subroutine smooth_strain

   !> The element itself first, then those around it that smooth sides join.
   pure subroutine gather_patch(s, triangles, e, list, n)
      type(surroundings_t), intent(in) :: s
      integer, intent(in) :: triangles(:, :), e
      integer, intent(out) :: list(most), n
      integer :: i, k, other, before
      list(1) = e
      n = 1
      i = 0
      do while (i < n)
         i = i + 1
         do k = 1, 3
            other = s%neighbour(k, list(i))
            if (other == 0) cycle
            if (.not. touching(triangles(:, other), triangles(:, e))) cycle
            call add(list, n, other)
         end do
      end do
      do while (n < enough)
         before = n
         do i = 1, before
            do k = 1, 3
               if (s%neighbour(k, list(i)) > 0) call add(list, n, s%neighbour(k, list(i)))
            end do
         end do
         if (n == before) return
      end do
   end subroutine gather_patch

   pure subroutine add(list, n, element)
      integer, intent(inout) :: list(most), n
      integer, intent(in) :: element
      if (n == most .or. any(list(:n) == element)) return
      n = n + 1
      list(n) = element
   end subroutine add

   pure logical function touching(a, b)
      integer, intent(in) :: a(3), b(3)
      touching = any(a == b(1)) .or. any(a == b(2)) .or. any(a == b(3))
   end function touching

   !> The strains of element `j` and the place of its centroid, in the axes of element `e`. The way between them is as long as it is
   !> in space.
   pure subroutine bring(s, axes, strain, e, j, at, value)
      type(surroundings_t), intent(in) :: s
      real(wp), intent(in) :: axes(:, :, :), strain(n_strains)
      integer, intent(in) :: e, j
      real(wp), intent(out) :: at(2), value(n_strains)
      real(wp) :: way(3)
      way = s%centre(:, j) - s%centre(:, e)
      at = matmul(way, axes(:, :, e))
      if (any(abs(at) > 0)) at = at*(norm2(way)/norm2(at))
      value = turned_strain(axes(:, :, j), s%normal(:, j), axes(:, :, e), s%normal(:, e), strain)
   end subroutine bring

   !> Strains in the axes of another plane, into which their own is turned by the smallest rotation.
   pure function turned_strain(own, own_normal, axes, normal, strain) result(value)
      real(wp), intent(in) :: own(3, 2), axes(3, 2) !< (component, axis) unit vectors
      real(wp), intent(in) :: own_normal(3), normal(3)
      real(wp), intent(in) :: strain(n_strains) !< membrane strain and curvature: 11, 22, 2 12 each
      real(wp) :: value(n_strains)
      real(wp) :: a(2), c2, s2, cs, c
      integer :: k
      ! the first axis of its own after the rotation
      c = dot_product(own_normal, normal)
      a = matmul(own(:, 1), axes)
      if (c > -0.99_wp) a = a - dot_product(own(:, 1), normal)/(1 + c)*matmul(own_normal, axes)
      a = a/max(norm2(a), tiny(1.0_wp))
      c2 = a(1)**2
      s2 = a(2)**2
      cs = a(1)*a(2)
      do k = 0, 3, 3
         associate (x => strain(k + 1:k + 3))
            value(k + 1) = c2*x(1) + s2*x(2) - cs*x(3)
            value(k + 2) = s2*x(1) + c2*x(2) + cs*x(3)
            value(k + 3) = 2*cs*(x(1) - x(2)) + (c2 - s2)*x(3)
         end associate
      end do
   end function turned_strain

   !> Of a symmetric 2 x 2 matrix (11, 22, 12), without directions in which there is nothing.
   pure function pseudo_inverse(m) result(inverse)
      real(wp), intent(in) :: m(3)
      real(wp) :: inverse(3)
      real(wp) :: centre, radius, large, small, d(2)
      inverse = 0
      centre = 0.5_wp*(m(1) + m(2))
      radius = hypot(0.5_wp*(m(1) - m(2)), m(3))
      large = centre + radius
      small = (m(1)*m(2) - m(3)**2)/max(large, tiny(1.0_wp))
      if (.not. large > 0) return
      if (small > thin*large) then
         inverse = [m(2), m(1), -m(3)]/(large*small)
         return
      end if
      ! direction of the large eigenvalue
      d = [0.5_wp*(m(1) - m(2)) + radius, m(3)]
      if (m(1) < m(2)) d = [m(3), 0.5_wp*(m(2) - m(1)) + radius]
      if (norm2(d) > 0) d = d/norm2(d)
      inverse = [d(1)**2, d(2)**2, d(1)*d(2)]/large
   end function pseudo_inverse
end module finshell_strain_patch
