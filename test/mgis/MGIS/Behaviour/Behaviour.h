/* A stand-in for MGIS where it is not installed: of its C interface what api/mfront/finshell_mgis.c calls, with the same names and
 * layouts. The library behind it (mgis.c) has a few behaviours of its own. */
#ifndef STAND_IN_MGIS_BEHAVIOUR_H
#define STAND_IN_MGIS_BEHAVIOUR_H
#include <stddef.h>
typedef double mgis_real;
typedef size_t mgis_size_type;
typedef enum { MGIS_SUCCESS = 0, MGIS_FAILURE = 1 } mgis_exit_flag;
typedef struct { mgis_exit_flag exit_status; const char *msg; } mgis_status;
typedef struct mgis_bv_FiniteStrainBehaviourOptions mgis_bv_FiniteStrainBehaviourOptions;
typedef struct mgis_bv_Behaviour mgis_bv_Behaviour;
typedef enum { MGIS_BV_ISOTROPIC = 0, MGIS_BV_ORTHOTROPIC = 1 } mgis_bv_BehaviourSymmetry;
typedef enum { MGIS_BV_CAUCHY = 0, MGIS_BV_PK2 = 1, MGIS_BV_PK1 = 2 } mgis_bv_FiniteStrainBehavourStressMeasure;
typedef enum { MGIS_BV_DSIG_DF = 0, MGIS_BV_DS_DEGL = 1, MGIS_BV_DPK1_DF = 2 } mgis_bv_FiniteStrainBehavourTangentOperator;
mgis_status mgis_bv_create_finite_strain_behaviour_options(mgis_bv_FiniteStrainBehaviourOptions **);
mgis_status mgis_bv_finite_strain_behaviour_options_set_stress_measure(mgis_bv_FiniteStrainBehaviourOptions *,
                                                                       mgis_bv_FiniteStrainBehavourStressMeasure);
mgis_status mgis_bv_finite_strain_behaviour_options_set_tangent_operator(mgis_bv_FiniteStrainBehaviourOptions *,
                                                                         mgis_bv_FiniteStrainBehavourTangentOperator);
mgis_status mgis_bv_free_finite_strain_behaviour_options(mgis_bv_FiniteStrainBehaviourOptions **);
mgis_status mgis_bv_load_finite_strain_behaviour(mgis_bv_Behaviour **, const mgis_bv_FiniteStrainBehaviourOptions *, const char *,
                                                 const char *, const char *);
mgis_status mgis_bv_behaviour_get_gradients_size(mgis_size_type *, const mgis_bv_Behaviour *);
mgis_status mgis_bv_behaviour_get_thermodynamic_forces_size(mgis_size_type *, const mgis_bv_Behaviour *);
mgis_status mgis_bv_behaviour_get_number_of_material_properties(mgis_size_type *, const mgis_bv_Behaviour *);
mgis_status mgis_bv_behaviour_get_material_property_name(const char **, const mgis_bv_Behaviour *, mgis_size_type);
mgis_status mgis_bv_behaviour_get_internal_state_variables_size(mgis_size_type *, const mgis_bv_Behaviour *);
mgis_status mgis_bv_behaviour_get_number_of_external_state_variables(mgis_size_type *, const mgis_bv_Behaviour *);
mgis_status mgis_bv_behaviour_get_behaviour_symmetry(mgis_bv_BehaviourSymmetry *, const mgis_bv_Behaviour *);
#endif
