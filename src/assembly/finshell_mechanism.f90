!> Does a structure hang loose? Finds the rigid-body motions that the supports leave free, part by part, and names them.
!>
!> A rigid motion moves a point x by t + r x (x - c) and turns it by r. The held directions of the supported nodes are linear
!> conditions on (t, r); what they leave free is the null space of a small matrix. A rigid motion has the components of
!> a node (finshell_freedoms). Parts that share no node are
!> judged on their own.
module finshell_mechanism
   use finshell_kinds, only: wp, dp
   use finshell_lapack, only: dsyev
   use finshell_freedoms, only: n_membrane, n_nodal, membrane_at, rx, rz, ux, uz
   use finshell_rotation, only: cross_product
   use finshell_status, only: status_singular_matrix, status_input_error
   use finshell_error, only: error_t, raise, text_of
   use finshell_mesh, only: mesh_t
   use finshell_equations, only: equations_t, scatter
   use finshell_ground_springs, only: springs_t
   use finshell_joined_parts, only: add_link_conditions, add_part_links, extent, find_parts, part_link_t
   implicit none
   private
   public :: check_mechanism, name_mode, null_space

   real(wp), parameter :: tolerance = 1.0e-9_wp !< of squared, scaled conditions: below it a motion is free
   integer, parameter :: most_parts = 40 !< that are judged together: larger clusters are left to the factorisation
   character(len=1), parameter :: axis_name(3) = ['x', 'y', 'z']

contains

   !> Raise an error that names the free rigid-body motions, if there are any.
   subroutine check_mechanism(mesh, equations, error, springs, links)
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      type(error_t), allocatable, intent(out) :: error
      type(springs_t), intent(in), optional :: springs !< to the ground, which hold as supports do
      type(part_link_t), intent(in), optional :: links(:) !< springs and bars between nodes
      integer, allocatable :: part(:), cluster(:), members(:)
      integer :: e, parts, p
      logical :: sprung
      real(wp) :: centre(3), size_of_part, own(n_nodal, n_nodal), stiffest
      real(wp), allocatable :: conditions(:, :)
      character(len=:), allocatable :: names

      stiffest = 0
      if (present(springs)) stiffest = max(maxval(abs(springs%stiffness)), tiny(1.0_wp))
      call find_parts(mesh, equations, part, parts, cluster, links)
      if (any(part == 0)) then
         p = findloc(part, 0, 1)
         if (any(equations%number(:, p) > 0)) then
            call raise(error, status_input_error, 'node '//text_of(p)//' belongs to no element, so its displacements and ' &
               //'rotations are free; remove it or hold it')
            return
         end if
      end if
      do p = 1, parts
         if (cluster(p) /= p) cycle
         members = pack([(e, e=1, parts)], cluster(1:) == p)
         if (size(members) > most_parts) cycle
         call extent(mesh, cluster(part), p, centre, size_of_part)
         allocate (conditions(n_nodal*size(members), n_nodal*size(members)), source=0.0_wp)
         do e = 1, size(members)
            call conditions_of_part(mesh, equations, part, members(e), centre, size_of_part, own)
            if (present(springs)) call add_all_springs(members(e))
            conditions(n_nodal*(e - 1) + 1:n_nodal*e, n_nodal*(e - 1) + 1:n_nodal*e) = own
         end do
         call add_link_conditions(mesh, equations, part, members, centre, size_of_part, conditions)
         sprung = .false.
         if (present(links)) call add_part_links(mesh, links, part, members, centre, size_of_part, conditions, sprung)
         if (size(members) > 1) then
            call free_part_of(conditions, own, e)
         else
            own = conditions
            e = 1
         end if
         deallocate (conditions)
         call name_free_motions(own, centre, size_of_part, names)
         if (names == '') cycle
         e = findloc(part, members(e), 1)
         if (e > size(part) - mesh%loose) then
            names = names//' (of node '//text_of(e)//', which belongs to no element)'
         else if (parts > 1) then
            names = names//' (of the part with node '//text_of(e)//')'
         end if
         if (.not. (sprung .or. equations%links%any())) then
            names = 'the supports leave a rigid-body motion free: '//names//'; add supports that prevent it'
         else
            names = 'the supports'//trim(merge(', springs and bars', '                  ', sprung)) &
                    //trim(merge(' and joints', '           ', equations%links%any()))//' leave a rigid-body motion free: ' &
                    //names//'; add supports'//trim(merge(' or springs', '           ', sprung))//' that prevent it'
         end if
         call raise(error, status_singular_matrix, names)
         return
      end do

   contains

      subroutine add_all_springs(at)
         integer, intent(in) :: at
         integer :: i
         do i = 1, size(springs%elements)
            associate (nodes => mesh%triangles(:, springs%elements(i)))
               if (part(nodes(1)) == at) call add_springs(mesh%coordinates(:, nodes), springs%stiffness(:, :, i)/stiffest, &
                                                          centre, size_of_part, own)
            end associate
         end do
      end subroutine add_all_springs
   end subroutine check_mechanism

   !> Sum of the squared conditions on (t, size * r) from all supported nodes of a part.
   pure subroutine conditions_of_part(mesh, equations, part, p, centre, size_of_part, conditions)
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: part(:), p
      real(wp), intent(in) :: centre(3), size_of_part
      real(wp), intent(out) :: conditions(n_nodal, n_nodal)
      real(wp) :: row(n_nodal), arm(3)
      integer :: i, j, k, node
      conditions = 0
      do i = 1, size(equations%supported)
         node = equations%supported(i)%node
         if (part(node) /= p) cycle
         arm = (mesh%coordinates(:, node) - centre)/size_of_part
         do k = 1, equations%supported(i)%displacements
            row(ux:uz) = equations%supported(i)%displacement_axes(:, k)
            row(rx:rz) = cross_product(arm, row(ux:uz))
            conditions = conditions + spread(row, 2, n_nodal)*spread(row, 1, n_nodal)
         end do
         do k = 1, equations%supported(i)%rotations
            row(ux:uz) = 0
            row(rx:rz) = equations%supported(i)%rotation_axes(:, k)
            do j = rx, rz
               conditions(rx:rz, j) = conditions(rx:rz, j) + row(rx:rz)*row(j)
            end do
         end do
      end do
   end subroutine conditions_of_part

   !> What the motions that are left free to several parts are of the part that they move most: as conditions on that part alone.
   subroutine free_part_of(conditions, own, most)
      real(wp), intent(in) :: conditions(:, :)
      real(wp), intent(out) :: own(n_nodal, n_nodal)
      integer, intent(out) :: most !< that part
      real(wp) :: free(size(conditions, 1), size(conditions, 1)), values(n_nodal), vectors(n_nodal, n_nodal)
      real(wp), allocatable :: moves(:)
      integer :: count, k
      call null_space(conditions, free, count)
      moves = [(sum(free(n_nodal*(k - 1) + 1:n_nodal*k, :count)**2), k=1, size(conditions, 1)/n_nodal)]
      most = maxloc(moves, 1)
      associate (mine => free(n_nodal*(most - 1) + 1:n_nodal*most, :count))
         call eigen(matmul(mine, transpose(mine)), values, vectors)
      end associate
      own = 0
      do k = 1, n_nodal
         if (values(k) <= sqrt(tolerance)) own = own + spread(vectors(:, k), 2, n_nodal)*spread(vectors(:, k), 1, n_nodal)
      end do
   end subroutine free_part_of

   !> Work of the springs of an element on (t, size * r).
   pure subroutine add_springs(x, stiffness, centre, size_of_part, conditions)
      real(wp), intent(in) :: x(3, 3), stiffness(n_membrane, n_membrane), centre(3), size_of_part
      real(wp), intent(inout) :: conditions(n_nodal, n_nodal)
      real(wp) :: rigid(n_membrane, n_nodal), unit(3)
      integer :: i, k
      do k = 1, 3
         unit = 0
         unit(k) = 1
         do i = 1, 3
            rigid(membrane_at(i) + ux:membrane_at(i) + uz, k) = unit
            rigid(membrane_at(i) + ux:membrane_at(i) + uz, uz + k) = cross_product(unit, (x(:, i) - centre)/size_of_part)
         end do
      end do
      conditions = conditions + matmul(transpose(rigid), matmul(stiffness, rigid))
   end subroutine add_springs

   !> Name the null space of the conditions; '' when there is none.
   subroutine name_free_motions(conditions, centre, size_of_part, names)
      real(wp), intent(in) :: conditions(n_nodal, n_nodal), centre(3), size_of_part
      character(len=:), allocatable, intent(out) :: names
      real(wp) :: free(n_nodal, n_nodal), motion(n_nodal), span(3, n_nodal), weight(n_nodal)
      real(wp) :: free_translation(3, 3), axes(3, 3), point(3)
      integer :: count, translations, turns, k, j

      call null_space(conditions, free, count)
      names = ''
      if (count == 0) return
      if (count == n_nodal) then
         names = 'all six, nothing is held'
         return
      end if
      call null_space(conditions(ux:uz, ux:uz), free_translation, translations)
      call nice_basis(free_translation(:, :translations), axes, turns)
      do k = 1, translations
         call append(names, 'translation along '//direction_text(axes(:, k)))
      end do

      ! Rotations: a motion with r along each direction of the span of the rotation parts, least in the other parts.
      span = 0
      do j = 1, count
         span(:, j) = free(rx:rz, j)
      end do
      call nice_basis(span(:, :count), axes, turns)
      do k = 1, turns
         weight = 0
         weight(:count) = matmul(axes(:, k), span(:, :count))
         call solve_span(span(:, :count), axes(:, k), weight(:count))
         motion = matmul(free(:, :count), weight(:count))
         do j = 1, translations
            motion(ux:uz) = motion(ux:uz) - dot_product(free_translation(:, j), motion(ux:uz))*free_translation(:, j)
         end do
         point = centre + size_of_part*cross_product(motion(rx:rz), motion(ux:uz))
         call append(names, 'rotation about '//axis_text(axes(:, k))//' through '//point_text(point, size_of_part))
      end do
   end subroutine name_free_motions

   !> Least weights with span * weight = wanted (wanted lies in the span).
   pure subroutine solve_span(span, wanted, weight)
      real(wp), intent(in) :: span(:, :), wanted(3)
      real(wp), intent(out) :: weight(:)
      real(wp) :: gram(3, 3), values(3), vectors(3, 3), y(3)
      integer :: k
      gram = matmul(span, transpose(span))
      call eigen(gram, values, vectors)
      y = 0
      do k = 1, 3
         if (values(k) > tolerance) y = y + dot_product(vectors(:, k), wanted)/values(k)*vectors(:, k)
      end do
      weight = matmul(y, span)
   end subroutine solve_span

   !> Orthonormal basis of the span of some vectors, global axes first.
   pure subroutine nice_basis(vectors, basis, count)
      real(wp), intent(in) :: vectors(:, :)
      real(wp), intent(out) :: basis(3, 3)
      integer, intent(out) :: count
      real(wp) :: gram(3, 3), values(3), directions(3, 3), candidate(3), rest(3)
      integer :: k, rank
      gram = matmul(vectors, transpose(vectors))
      call eigen(gram, values, directions)
      basis = 0
      count = 0
      rank = 0
      do k = 1, 3
         if (values(k) > sqrt(tolerance)) rank = rank + 1
      end do
      do k = 1, 3
         if (count == rank) return
         candidate = 0
         candidate(k) = 1
         if (norm2(candidate - project(candidate)) > 1.0e-4_wp) cycle
         count = count + 1
         basis(:, count) = candidate
      end do
      do k = 1, 3
         if (count == rank) return
         if (values(k) <= sqrt(tolerance)) cycle
         rest = directions(:, k) - matmul(basis, matmul(directions(:, k), basis))
         if (norm2(rest) < 1.0e-3_wp) cycle
         count = count + 1
         basis(:, count) = rest/norm2(rest)
      end do

   contains

      pure function project(v) result(inside)
         real(wp), intent(in) :: v(3)
         real(wp) :: inside(3)
         integer :: j
         inside = 0
         do j = 1, 3
            if (values(j) > sqrt(tolerance)) inside = inside + dot_product(directions(:, j), v)*directions(:, j)
         end do
      end function project
   end subroutine nice_basis

   !> Orthonormal basis of the null space of a symmetric positive semidefinite matrix.
   pure subroutine null_space(matrix, basis, count)
      real(wp), intent(in) :: matrix(:, :)
      real(wp), intent(out) :: basis(:, :)
      integer, intent(out) :: count
      real(wp) :: values(size(matrix, 1)), vectors(size(matrix, 1), size(matrix, 1))
      integer :: k
      call eigen(matrix, values, vectors)
      count = 0
      basis = 0
      do k = 1, size(values)
         if (values(k) > tolerance*max(1.0_wp, maxval(values))) cycle
         count = count + 1
         basis(:, count) = vectors(:, k)
      end do
   end subroutine null_space

   !> Eigenvalues, ascending, and eigenvectors of a symmetric matrix.
   pure subroutine eigen(matrix, values, vectors)
      real(wp), intent(in) :: matrix(:, :)
      real(wp), intent(out) :: values(:), vectors(:, :)
      real(dp) :: a(size(values), size(values)), w(size(values)), work(3*size(values))
      integer :: info
      a = matrix
      call dsyev('V', 'U', size(w), a, size(w), w, work, size(work), info)
      values = w
      vectors = a
   end subroutine eigen

   !> Where a null vector of the tangent moves most, in words.
   function name_mode(mesh, equations, null_vector) result(text)
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: null_vector(:) !< over the equations
      character(len=:), allocatable :: text
      real(wp), allocatable :: nodal(:, :)
      real(wp) :: moves, turns
      integer :: node

      allocate (nodal(n_nodal, size(mesh%coordinates, 2)))
      call scatter(equations, null_vector, nodal)
      moves = maxval(norm2(nodal(ux:uz, :), 1))
      turns = maxval(norm2(nodal(rx:rz, :), 1))
      text = 'the tangent is singular: the structure can move without force, most at node '
      if (moves > 1.0e-6_wp*turns) then
         node = maxloc(norm2(nodal(ux:uz, :), 1), 1)
         text = text//text_of(node)//' along '//direction_text(nodal(ux:uz, node)/norm2(nodal(ux:uz, node)))
      else
         node = maxloc(norm2(nodal(rx:rz, :), 1), 1)
         text = text//text_of(node)//', which turns about '//axis_text(nodal(rx:rz, node)/norm2(nodal(rx:rz, node)))
      end if
      text = text//'; a support is missing there, or a part of it has lost its stiffness'
   end function name_mode

   subroutine append(names, name)
      character(len=:), allocatable, intent(inout) :: names
      character(len=*), intent(in) :: name
      if (names /= '') names = names//', '
      names = names//name
   end subroutine append

   function direction_text(d) result(text)
      real(wp), intent(in) :: d(3)
      character(len=:), allocatable :: text
      integer :: k
      k = maxloc(abs(d), 1)
      if (abs(d(k)) > 1 - 1.0e-6_wp) then
         text = axis_name(k)
      else
         text = vector_text(d)
      end if
   end function direction_text

   function axis_text(d) result(text)
      real(wp), intent(in) :: d(3)
      character(len=:), allocatable :: text
      text = direction_text(d)
      if (len(text) == 1) then
         text = 'the '//text//' axis'
      else
         text = 'the direction '//text
      end if
   end function axis_text

   function point_text(point, length) result(text)
      real(wp), intent(in) :: point(3), length
      character(len=:), allocatable :: text
      real(wp) :: rounded(3)
      rounded = point
      where (abs(rounded) < 1.0e-7_wp*length) rounded = 0
      text = vector_text(rounded)
   end function point_text

   function vector_text(v) result(text)
      real(wp), intent(in) :: v(3)
      character(len=:), allocatable :: text
      character(len=16) :: number
      integer :: k
      text = '('
      do k = 1, 3
         write (number, '(g0.4)') real(v(k), dp)
         if (.not. abs(v(k)) > 0) number = '0'
         text = text//trim(number)
         if (k < 3) text = text//', '
      end do
      text = text//')'
   end function vector_text
end module finshell_mechanism
