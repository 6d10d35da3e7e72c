!> The springs and bars of a structure as loads that are always there, and what each of them bears.
module finshell_connectors
   use finshell_acting_load, only: load_item_t, append
   use finshell_axis_spring, only: axis_spring_t, new_axis_spring
   use finshell_cliques, only: cliques_t, joined
   use finshell_connector, only: spring_axes, spring_axis, spring_line, spring_rotation, spring_turn, bar
   use finshell_equations, only: equations_t, scatter
   use finshell_held_motion, only: largest_turn
   use finshell_freedoms, only: n_nodal, ux, uz
   use finshell_joined_load, only: joined_load_t
   use finshell_kinds, only: wp
   use finshell_line_spring, only: line_spring_t, new_line_spring
   use finshell_sparsity, only: sparsity_t
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   use finshell_turn_spring, only: turn_spring_t, new_turn_spring
   implicit none
   private
   public :: add_connectors, expand_blocks, join_cliques, find_places, lead, measure_connector, stand_in_for_lines, tauten_lines, &
      is_limp, add_geometric, largest_turn_with_lines

contains

   !> Append them to a list of loads.
   subroutine add_connectors(structure, equations, list)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(line_spring_t) :: line
      type(axis_spring_t) :: axis
      type(turn_spring_t) :: turn
      integer :: i
      if (.not. allocated(structure%connectors)) return
      do i = 1, size(structure%connectors)
         associate (it => structure%connectors(i))
            select case (it%kind)
            case (spring_axes, spring_axis)
               call new_axis_spring(axis, it, equations)
               call append(list, axis)
            case (spring_line, bar)
               call new_line_spring(line, it, equations)
               call append(list, line)
            case (spring_rotation, spring_turn)
               call new_turn_spring(turn, it, equations)
               call append(list, turn)
            end select
         end associate
      end do
   end subroutine add_connectors

   !> Add the cliques of the blocks of a list of loads.
   subroutine join_cliques(list, cliques)
      type(load_item_t), intent(in) :: list(:)
      type(cliques_t), intent(inout) :: cliques
      integer :: i
      do i = 1, size(list)
         select type (load => list(i)%load)
         class is (joined_load_t)
            cliques = joined(cliques, load%blocks%equations)
         end select
      end do
   end subroutine join_cliques

   !> Expand the blocks of a list of loads anew.
   subroutine expand_blocks(list, equations)
      type(load_item_t), intent(inout) :: list(:)
      type(equations_t), intent(in) :: equations
      integer :: i
      do i = 1, size(list)
         select type (load => list(i)%load)
         class is (joined_load_t)
            call load%blocks%expand(equations)
         end select
      end do
   end subroutine expand_blocks

   !> Find the blocks of a list of loads in the matrix.
   subroutine find_places(list, pattern)
      type(load_item_t), intent(inout) :: list(:)
      type(sparsity_t), intent(in) :: pattern
      integer :: i
      do i = 1, size(list)
         select type (load => list(i)%load)
         class is (joined_load_t)
            if (load%in_matrix) call load%blocks%find_places(pattern)
         end select
      end do
   end subroutine find_places

   !> Whether this member of a team has the blocks in its part of the matrix.
   subroutine lead(list, leads)
      type(load_item_t), intent(inout) :: list(:)
      logical, intent(in) :: leads
      integer :: i
      do i = 1, size(list)
         select type (load => list(i)%load)
         class is (joined_load_t)
            load%in_matrix = leads
         end select
      end do
   end subroutine lead

   !> Take lines that act in tension only as taut, or as they are.
   subroutine tauten_lines(list, taut)
      type(load_item_t), intent(inout) :: list(:)
      logical, intent(in) :: taut
      integer :: i
      do i = 1, size(list)
         select type (load => list(i)%load)
         class is (line_spring_t)
            load%law%tension_only = load%connector%law%tension_only .and. .not. taut
         end select
      end do
   end subroutine tauten_lines

   !> Forces and extensions of the members of a connector: see `measure` of its kind.
   subroutine measure_connector(list, name, structure, state, force, extension)
      type(load_item_t), intent(in) :: list(:)
      character(len=*), intent(in) :: name
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp), allocatable, intent(out) :: force(:), extension(:)
      integer :: b, i
      do i = 1, size(list)
         select type (load => list(i)%load)
         class is (line_spring_t)
            if (load%connector%name /= name) cycle
            call reserve(load%count())
            do b = 1, load%count()
               call load%measure(b, structure, state, force(b), extension(b))
            end do
         class is (axis_spring_t)
            if (load%connector%name /= name) cycle
            call reserve(load%count())
            do b = 1, load%count()
               call load%measure(b, state, force(b), extension(b))
            end do
         class is (turn_spring_t)
            if (load%connector%name /= name) cycle
            call reserve(load%count())
            do b = 1, load%count()
               call load%measure(b, state, force(b), extension(b))
            end do
         end select
      end do

   contains

      subroutine reserve(n)
         integer, intent(in) :: n
         if (allocated(force)) deallocate (force, extension)
         allocate (force(n), extension(n), source=0.0_wp)
      end subroutine reserve
   end subroutine measure_connector

   !> Are there lines at nodes of no element that are free? They have nothing across them at first.
   pure logical function is_limp(structure, equations)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      logical :: loose(size(structure%mesh%coordinates, 2))
      integer :: i
      is_limp = .false.
      if (.not. allocated(structure%connectors)) return
      loose = any(equations%number(ux:uz, :) > 0, dim=1)
      loose(:size(loose) - structure%mesh%loose) = .false.
      do i = 1, size(structure%connectors)
         associate (it => structure%connectors(i))
            if (it%kind /= bar .and. it%kind /= spring_line) cycle
            is_limp = is_limp .or. any(loose(reshape(it%node, [size(it%node)])))
         end associate
      end do
   end function is_limp

   !> Largest turn (radian) of a node in a correction of the unknowns and of a factor, or of a line: the motion of its ends against
   !> each other over its length.
   pure real(wp) function largest_turn_with_lines(list, structure, equations, x, changes) result(angle)
      type(load_item_t), intent(in) :: list(:)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: x(:) !< (n)
      real(wp), intent(in) :: changes(:) !< of the factors that move supports
      real(wp), allocatable :: nodal(:, :)
      real(wp) :: motion(3)
      integer :: b, i
      angle = largest_turn(equations, x, changes)
      if (.not. allocated(structure%connectors)) return
      if (.not. any(structure%connectors%kind == bar .or. structure%connectors%kind == spring_line)) return
      allocate (nodal(n_nodal, size(equations%number, 2)))
      call scatter(equations, x, nodal)
      do i = 1, size(list)
         select type (load => list(i)%load)
         class is (line_spring_t)
            do b = 1, load%count()
               if (.not. load%connector%rest(b) > 0) cycle
               motion = nodal(ux:uz, load%node(1, b))
               if (load%nodes == 2) motion = motion - nodal(ux:uz, load%node(2, b))
               angle = max(angle, norm2(motion)/load%connector%rest(b))
            end do
         end select
      end do
   end function largest_turn_with_lines

   !> Add what a linear motion changes of their stiffness by the forces that it brings, at the geometry of the state: f/l across a
   !> line, -+ spin(moment)/2 between the ends of springs between rotations (finshell_buckling).
   subroutine add_geometric(list, structure, equations, state, motion, values)
      type(load_item_t), intent(in) :: list(:)
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: motion(:, :) !< (n_nodal, nodes)
      real(wp), intent(inout) :: values(:) !< of the matrix
      integer :: i
      do i = 1, size(list)
         select type (load => list(i)%load)
         class is (line_spring_t)
            if (load%in_matrix) call load%add_geometric(structure, state, motion, values)
         class is (turn_spring_t)
            if (load%in_matrix) call load%add_geometric(structure, equations, state, motion, values)
         end select
      end do
   end subroutine add_geometric

   !> Add the stand-in of all lines at nodes of no element: see `stand_in` of line_spring_t.
   subroutine stand_in_for_lines(list, structure, state, part, values)
      type(load_item_t), intent(in) :: list(:)
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: part
      real(wp), intent(inout) :: values(:)
      integer :: i
      do i = 1, size(list)
         select type (load => list(i)%load)
         class is (line_spring_t)
            if (load%in_matrix) call load%stand_in(structure, state, part, values)
         end select
      end do
   end subroutine stand_in_for_lines
end module finshell_connectors
