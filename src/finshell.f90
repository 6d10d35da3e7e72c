!> finshell as a Fortran library: `use finshell` and link libfinshell.
!>
!> A user element in six lines:
!>
!>     class(material_t), allocatable :: law
!>     type(section_t) :: section
!>     type(error_t), allocatable :: error
!>     call new_material(law, 'mooney_rivlin', ['c10', 'c01'], [80.0_wp, 20.0_wp], error)
!>     call new_section(section, law, thickness=0.5_wp, error=error)
!>     call evaluate_elements(section, n, x, u, rotation, rotation_vector, status, force=f, tangent=k)
!>
!> x, u: (3, 3, n) reference coordinates and displacements of the three nodes of each element; rotation: (3, 3, n) total
!> rotation vectors, or (4, 3, n) quaternions with `rotation_quaternion`. f (18, n) is the internal force, conjugate to
!> u1 t1 u2 t2 u3 t3, k (18, 18, n) its exact symmetric tangent. status(e) > 0: cut the step; < 0: wrong input. Any consistent
!> units. An error is allocated exactly when a call failed; error%message says what to do.
!>
!> A membrane (new_section with membrane=.true., and wrinkling=.true. where it is not to bear compression) has no rotations:
!>
!>     call evaluate_membranes(section, n, x, u, status, force=f, tangent=k)   ! f (9, n), k (9, 9, n)
module finshell
   use finshell_batch, only: evaluate_elements, recover_elements, rotation_increment, rotation_quaternion, rotation_vector
   use finshell_error, only: error_t
   use finshell_field_batch, only: element_field_t, element_fields, field_places, field_value, find_element_field, &
      n_element_fields, recover_fields
   use finshell_freedoms, only: n_membrane, n_shell
   use finshell_kinds, only: i4, wp
   use finshell_laminate, only: stiffness_at_rest
   use finshell_law_states, only: law_states_t
   use finshell_mass, only: mass_elements, mass_membranes
   use finshell_material, only: material_t
   use finshell_membrane_batch, only: evaluate_membranes, recover_membranes, state_slack, state_taut, state_wrinkled
   use finshell_pressure, only: enclosed_volume, follower_pressure
   use finshell_quaternion, only: matrix_to_quaternion, quaternion_conjugate, quaternion_normalise, quaternion_product, &
      quaternion_to_matrix, quaternion_to_rotation_vector, rotation_vector_to_quaternion, update_quaternion
   use finshell_registry, only: material_names, material_parameters, new_material
   use finshell_rotation, only: complement_rotation, exp_rotation, inverse_tangent_operator, log_rotation, tangent_operator
   use finshell_section, only: formulation_p, formulation_s, new_layered_section, new_section, ply_t, section_t, states_of
   use finshell_status, only: status_ok, status_text
   use finshell_surface_pressure, only: pressure_elements
   use finshell_version, only: version
   implicit none
   public
end module finshell
