!> What assembly costs beside its elements: internal forces and tangent of a sheet, one thread, Mooney-Rivlin, quaternions.
!>
!> Elements alone (finshell_elements_evaluate, gathered before), then with finshell_assembly_evaluate, whole and upper triangle, and
!> by triplets: what a host does by itself, with sorting as scipy and Eigen do it, by rows. Ways take turns, round after round; the
!> least of all rounds counts.
!>
!>     bench_assembly [CELLS] [membrane] [whole | upper | triplets] [check]
!>
!> CELLS along a side, default 100. whole, upper, triplets: only this way beside the elements, to count instructions with callgrind.
!> check: fails where the whole matrix costs more than 0.5 times the elements.
program bench_assembly
   use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int32_t, c_int64_t, c_loc, c_null_char, c_null_ptr, c_ptr, c_sizeof
   use, intrinsic :: iso_fortran_env, only: int64
   use finshell_capi_elements, only: c_elements_t
   use finshell_capi_mesh, only: c_mesh_t
   use finshell_kinds, only: dp
   implicit none

   interface
      function section_create(material, parameters, names, values, thickness, options, option_names, option_values, section, &
                              status) result(code) bind(c, name='finshell_section_create')
         import :: c_char, c_double, c_int32_t, c_ptr
         character(kind=c_char), intent(in) :: material(*)
         integer(c_int32_t), value :: parameters, options
         type(c_ptr), intent(in) :: names(*), option_names(*)
         real(c_double), intent(in) :: values(*), option_values(*)
         real(c_double), value :: thickness
         type(c_ptr), intent(out) :: section
         type(c_ptr), value :: status
         integer(c_int32_t) :: code
      end function section_create

      function elements_evaluate(section, elements, energy, force, tangent, codes, status) result(code) &
         bind(c, name='finshell_elements_evaluate')
         import :: c_double, c_elements_t, c_int32_t, c_ptr
         type(c_ptr), value :: section, energy, codes, status
         type(c_elements_t), intent(in) :: elements
         real(c_double), intent(inout) :: force(*), tangent(*)
         integer(c_int32_t) :: code
      end function elements_evaluate

      function assembly_create(mesh, sections, section, assembly, status) result(code) bind(c, name='finshell_assembly_create')
         import :: c_int32_t, c_mesh_t, c_ptr
         type(c_mesh_t), intent(in) :: mesh
         integer(c_int32_t), value :: sections
         type(c_ptr), intent(in) :: section(*)
         type(c_ptr), intent(out) :: assembly
         type(c_ptr), value :: status
         integer(c_int32_t) :: code
      end function assembly_create

      function assembly_size(assembly, nodal, rows, entries, status) result(code) bind(c, name='finshell_assembly_size')
         import :: c_int32_t, c_int64_t, c_ptr
         type(c_ptr), value :: assembly, status
         integer(c_int32_t), intent(out) :: nodal, rows
         integer(c_int64_t), intent(out) :: entries
         integer(c_int32_t) :: code
      end function assembly_size

      function assembly_evaluate(assembly, sections, section, elements, energy, force, values, codes, status) result(code) &
         bind(c, name='finshell_assembly_evaluate')
         import :: c_double, c_elements_t, c_int32_t, c_ptr
         type(c_ptr), value :: assembly, energy, codes, status
         integer(c_int32_t), value :: sections
         type(c_ptr), intent(in) :: section(*)
         type(c_elements_t), intent(in) :: elements
         real(c_double), intent(inout) :: force(*), values(*)
         integer(c_int32_t) :: code
      end function assembly_evaluate
   end interface

   integer, parameter :: patch = 64 !< elements a call, when alone
   integer, parameter :: ways = 4
   character(len=*), parameter :: way_names(ways) = [character(len=24) :: 'elements', 'assembly, whole', &
                                                     'assembly, upper triangle', 'triplets']
   character(kind=c_char, len=10), target :: names(2) = ['c10'//c_null_char, 'c01'//c_null_char]
   character(kind=c_char, len=10), target :: option(1) = ['membrane'//c_null_char]
   integer(c_int32_t), allocatable, target :: triangles(:, :)
   real(c_double), allocatable, target :: x(:, :), u(:, :), q(:, :), xe(:, :, :), ue(:, :, :), qe(:, :, :)
   real(c_double), allocatable :: force(:), tangent(:), values(:), times(:)
   type(c_ptr) :: section(1), assembly(0:1)
   type(c_elements_t) :: by_nodes
   integer(c_int64_t) :: entries(0:1)
   integer :: cells, elements, freedoms, i, nodes, r, rounds, way, at
   character(len=16) :: word
   logical :: membrane, checked, taken(ways)

   cells = 100
   membrane = .false.
   checked = .false.
   taken = .true.
   do i = 1, command_argument_count()
      call get_command_argument(i, word)
      if (word == 'membrane') membrane = .true.
      if (word == 'check') checked = .true.
      if (word == 'whole') taken(2:) = [.true., .false., .false.]
      if (word == 'upper') taken(2:) = [.false., .true., .false.]
      if (word == 'triplets') taken(2:) = [.false., .false., .true.]
      if (verify(trim(word), '0123456789') == 0) read (word, *) cells
   end do
   freedoms = merge(9, 18, membrane)
   call set_up()
   rounds = max(3, 200000/elements)
   allocate (times(ways), source=huge(1.0_dp))
   do r = 1, rounds
      do way = 1, ways
         at = 1 + mod(way + r, ways)
         if (.not. taken(at) .or. (at == ways .and. r > 3)) cycle ! triplets are slow
         times(at) = min(times(at), elapsed(at))
      end do
   end do
   write (*, '(a,i0,a)') 'force + tangent, one thread, ', elements, ' elements; microseconds per element'
   write (*, '(a)') '                                all   beside elements   in parts of these'
   do way = 1, ways
      if (taken(way)) write (*, '(a,f12.4,f18.4,f20.3)') way_names(way), times(way)/elements, (times(way) - times(1))/elements, &
         (times(way) - times(1))/times(1)
   end do
   if (checked .and. times(2) > 1.5_dp*times(1)) error stop 'bench_assembly: more than 0.5 times the elements'

contains

   subroutine set_up()
      type(c_mesh_t) :: mesh
      integer :: a, e, k, upper
      integer(c_int32_t) :: code, nodal, rows
      nodes = (cells + 1)**2
      elements = 2*cells**2
      allocate (triangles(3, elements), x(3, nodes), u(3, nodes), q(4, nodes))
      allocate (xe(3, 3, elements), ue(3, 3, elements), qe(4, 3, elements))
      do i = 1, nodes
         x(:, i) = [real(mod(i - 1, cells + 1), dp), real((i - 1)/(cells + 1), dp), 0.1_dp*sin(real(i, dp))]
         u(:, i) = [0.1_dp*x(1, i), 0.05_dp*x(2, i), 0.05_dp*cos(real(i, dp))]
         q(:, i) = [1.0_dp, 0.02_dp*sin(2.0_dp*i), 0.02_dp*cos(3.0_dp*i), 0.01_dp]
      end do
      do e = 1, elements
         a = (e - 1)/2 + (e - 1)/(2*cells)
         if (modulo(e, 2) == 1) triangles(:, e) = [a, a + 1, a + cells + 2]
         if (modulo(e, 2) == 0) triangles(:, e) = [a, a + cells + 2, a + cells + 1]
         do k = 1, 3
            xe(:, k, e) = x(:, triangles(k, e) + 1)
            ue(:, k, e) = u(:, triangles(k, e) + 1)
            qe(:, k, e) = q(:, triangles(k, e) + 1)
         end do
      end do
      code = section_create('mooney_rivlin'//c_null_char, 2, [c_loc(names(1)), c_loc(names(2))], [80.0_dp, 20.0_dp], 0.1_dp, &
                            merge(1, 0, membrane), [c_loc(option(1))], [1.0_dp], section(1), c_null_ptr)
      if (code /= 0) error stop 'bench_assembly: no section'
      mesh%size = c_sizeof(mesh)
      mesh%nodes = nodes
      mesh%elements = elements
      mesh%triangles = c_loc(triangles)
      do upper = 0, 1
         mesh%triangle = upper
         code = assembly_create(mesh, 1, section, assembly(upper), c_null_ptr)
         if (code == 0) code = assembly_size(assembly(upper), nodal, rows, entries(upper), c_null_ptr)
         if (code /= 0) error stop 'bench_assembly: no assembly'
      end do
      by_nodes%size = c_sizeof(by_nodes)
      by_nodes%n = elements
      by_nodes%convention = 2
      by_nodes%threads = 1
      by_nodes%x = c_loc(x)
      by_nodes%u = c_loc(u)
      by_nodes%rotations = c_loc(q)
      allocate (force(6*nodes), values(entries(0)), tangent(freedoms**2*max(patch, elements)))
   end subroutine set_up

   !> Microseconds for all elements.
   real(dp) function elapsed(way)
      integer, intent(in) :: way
      integer(int64) :: start, finish, rate
      integer(c_int32_t) :: code
      type(c_elements_t) :: some
      real(c_double) :: f(freedoms*patch)
      integer :: first
      code = 0
      force = 0
      values = 0
      call system_clock(start, rate)
      select case (way)
      case (1)
         some = by_nodes
         do first = 1, elements, patch
            some%n = min(patch, elements - first + 1)
            some%x = c_loc(xe(1, 1, first))
            some%u = c_loc(ue(1, 1, first))
            some%rotations = c_loc(qe(1, 1, first))
            code = max(code, elements_evaluate(section(1), some, c_null_ptr, f, tangent, c_null_ptr, c_null_ptr))
         end do
      case (2, 3)
         code = assembly_evaluate(assembly(way - 2), 1, section, by_nodes, c_null_ptr, force, values, c_null_ptr, c_null_ptr)
      case default
         call triplets(code)
      end select
      call system_clock(finish)
      if (code /= 0) error stop 'bench_assembly: an element failed'
      elapsed = 1.0e6_dp*(finish - start)/rate
   end function elapsed

   !> All element matrices as row, column, value; sorted by columns, then by rows (two counting sorts); equal places added up.
   subroutine triplets(code)
      integer(c_int32_t), intent(inout) :: code
      integer, allocatable :: row(:), column(:), order(:), by_row(:), first(:)
      integer :: a, b, dofs(freedoms), e, k, m, n, t
      real(c_double), allocatable :: f(:)
      type(c_elements_t) :: all
      m = freedoms/3
      n = freedoms**2*elements
      allocate (row(n), column(n), order(n), by_row(n), first(0:m*nodes), f(freedoms*elements))
      all = by_nodes
      all%x = c_loc(xe)
      all%u = c_loc(ue)
      all%rotations = c_loc(qe)
      code = max(code, elements_evaluate(section(1), all, c_null_ptr, f, tangent, c_null_ptr, c_null_ptr))
      t = 0
      do e = 1, elements
         do k = 1, 3
            dofs(m*(k - 1) + 1:m*k) = [(m*triangles(k, e) + a, a=0, m - 1)]
         end do
         do b = 1, freedoms
            do a = 1, freedoms
               t = t + 1
               row(t) = dofs(a)
               column(t) = dofs(b)
            end do
         end do
         force(dofs + 1) = force(dofs + 1) + f(freedoms*(e - 1) + 1:freedoms*e)
      end do
      call sort(column, [(t, t=1, n)], order, first)
      call sort(row, order, by_row, first)
      k = 0
      do t = 1, n
         if (t == 1) then
            k = 1
         else if (row(by_row(t)) /= row(by_row(t - 1)) .or. column(by_row(t)) /= column(by_row(t - 1))) then
            k = k + 1
         end if
         values(k) = values(k) + tangent(by_row(t))
      end do
      if (k /= entries(0)) error stop 'bench_assembly: the patterns differ'
   end subroutine triplets

   subroutine sort(key, from, to, first)
      integer, intent(in) :: key(:), from(:)
      integer, intent(out) :: to(:), first(0:)
      integer :: t
      first = 0
      do t = 1, size(from)
         first(key(t) + 1) = first(key(t) + 1) + 1
      end do
      do t = 1, size(first) - 1
         first(t) = first(t) + first(t - 1)
      end do
      do t = 1, size(from)
         first(key(from(t))) = first(key(from(t))) + 1
         to(first(key(from(t)))) = from(t)
      end do
   end subroutine sort
end program bench_assembly
