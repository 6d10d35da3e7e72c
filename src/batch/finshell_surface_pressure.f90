!> Pressure on many elements, flat or curved, and the volume behind them: the facets (finshell_pressure) and their caps
!> (finshell_caps) in the unknowns of the element.
module finshell_surface_pressure
   use finshell_caps, only: evaluate_caps
   use finshell_environment, only: environment_t, hold, release
   use finshell_freedoms, only: n_corners, n_membrane, n_nodal, n_shell, ux, uz
   use finshell_kinds, only: wp, i4
   use finshell_pressure, only: enclosed_volume, follower_pressure
   use finshell_status, only: status_collapsed_element, status_invalid_argument, status_not_a_number, status_ok
   implicit none
   private
   public :: pressure_elements

contains

   !> Volume, and nodal forces and stiffness of a pressure on the surface of the nodes of n elements.
   !>
   !> Motion and normals as in evaluate_elements (finshell_batch). `force` is external, u1 t1 u2 t2 u3 t3: forces, and couples where
   !> the element is curved. `stiffness` is its derivative with respect to the unknowns (on the caps and in the symmetric form the
   !> second derivative of p times the volume), to be taken from the tangent of the elements. What is not present is not computed.
   !> An element that fails gets its status and zeros; the others are done.
   subroutine pressure_elements(n, x, u, rotation, convention, status, pressure, symmetric, origin, volume, force, stiffness, &
                                state, normal, held)
      integer, intent(in) :: n, convention
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), rotation(:, :, :)
      integer(i4), intent(out) :: status(n) !< per element, see finshell_status
      real(wp), intent(in), optional :: pressure(n) !< per current area, positive along the normal; `force` and `stiffness` need it
      logical, intent(in), optional :: symmetric !< on the facets the gradient of p times `volume`; default: p A n/3 at each node
      real(wp), intent(in), optional :: origin(3) !< of the volume; default 0, 0, 0
      real(wp), intent(out), optional :: volume(n) !< from the origin to the facet, and of the cap on it
      real(wp), intent(out), optional :: force(n_shell, n)
      real(wp), intent(out), optional :: stiffness(n_shell, n_shell, n) !< d force(i) / d unknown(j)
      real(wp), intent(in), optional :: state(4, 3, n), normal(3, 3, n)
      integer, intent(in), optional :: held(3, n) !< sides, as in evaluate_elements
      type(environment_t) :: environment
      real(wp) :: centre(3), position(3, 3, 1), f(n_membrane, 1), k(n_membrane, n_membrane, 1), column(n_shell), total
      logical :: gradient
      integer :: e, i, j

      call evaluate_caps(n, x, u, rotation, convention, normal, status, volume, force, stiffness, state, held)
      if ((present(force) .or. present(stiffness)) .and. .not. present(pressure)) status = status_invalid_argument
      centre = 0
      if (present(origin)) centre = origin
      gradient = .false.
      if (present(symmetric)) gradient = symmetric
      call hold(environment)
      do e = 1, n
         total = sum(0*centre)
         if (present(pressure)) total = total + 0*pressure(e)
         if (.not. total <= 0 .and. status(e) >= status_ok) status(e) = status_not_a_number
         if (status(e) == status_ok) then
            position(:, :, 1) = x(:, :, e) + u(:, :, e)
            if (present(volume)) then
               volume(e) = enclosed_volume(1, position, centre) + volume(e)
               total = total + 0*volume(e)
            end if
            if (present(stiffness)) then
               call follower_pressure(1, pressure(e:e), position, gradient, centre, f, k)
               if (present(normal)) stiffness(:, :, e) = pressure(e)*stiffness(:, :, e)
               do j = 0, n_corners - 1
                  do i = 0, n_corners - 1
                     associate (part => stiffness(n_nodal*i + ux:n_nodal*i + uz, n_nodal*j + ux:n_nodal*j + uz, e))
                        part = k(uz*i + ux:uz*i + uz, uz*j + ux:uz*j + uz, 1) + part
                     end associate
                  end do
               end do
               column = 0
               do j = 1, n_shell
                  column = column + 0*stiffness(:, j, e)
               end do
               total = total + sum(column)
            else if (present(force)) then
               call follower_pressure(1, pressure(e:e), position, gradient, centre, f)
            end if
            if (present(force)) then
               force(:, e) = pressure(e)*force(:, e)
               do i = 0, n_corners - 1
                  force(n_nodal*i + ux:n_nodal*i + uz, e) = f(uz*i + ux:uz*i + uz, 1) + force(n_nodal*i + ux:n_nodal*i + uz, e)
               end do
               total = total + sum(0*force(:, e))
            end if
            ! an area or a volume that overflows
            if (.not. total <= 0) status(e) = status_collapsed_element
         end if
         if (status(e) == status_ok) cycle
         if (present(volume)) volume(e) = 0
         if (present(force)) force(:, e) = 0
         if (present(stiffness)) stiffness(:, :, e) = 0
      end do
      call release(environment)
   end subroutine pressure_elements
end module finshell_surface_pressure
