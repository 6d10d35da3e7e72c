!> The freedoms of nodes and elements: which are which, and how many. No other file counts them.
!>
!> A node has displacements, then rotations (spins), along and about x, y and z of its axes. An element has those of its nodes, one
!> node after the other: u1 t1 u2 t2 u3 t3 of shells, u1 u2 u3 of membranes, whose nodes have displacements only.
module finshell_freedoms
   implicit none
   private
   public :: ux, uz, rx, rz, n_corners, n_nodal, n_shell, n_membrane, shell_at, membrane_at, shell_displacements

   !> First and last displacement and rotation: v(ux:uz) and v(rx:rz) of a nodal vector v(n_nodal).
   integer, parameter :: ux = 1, uy = 2, uz = 3, rx = 4, rz = 6
   integer, parameter :: n_nodal = rz
   integer, parameter :: n_corners = 3 !< nodes of an element
   integer, parameter :: n_shell = n_corners*n_nodal, n_membrane = n_corners*uz !< freedoms of an element
   !> How many freedoms of an element stand before those of a corner.
   integer, parameter :: shell_at(n_corners) = [0, n_nodal, 2*n_nodal], membrane_at(n_corners) = [0, uz, 2*uz]
   !> The displacements among the freedoms of a shell element.
   integer, parameter :: shell_displacements(n_membrane) = [shell_at(1) + [ux, uy, uz], shell_at(2) + [ux, uy, uz], &
                                                            shell_at(3) + [ux, uy, uz]]
end module finshell_freedoms
