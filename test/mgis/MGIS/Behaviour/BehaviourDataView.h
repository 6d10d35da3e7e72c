/* See Behaviour.h. */
#ifndef STAND_IN_MGIS_DATA_VIEW_H
#define STAND_IN_MGIS_DATA_VIEW_H
#include "MGIS/Behaviour/Behaviour.h"
typedef struct {
   const mgis_real *gradients;
   mgis_real *thermodynamic_forces;
   const mgis_real *mass_density, *material_properties;
   mgis_real *internal_state_variables, *stored_energy, *dissipated_energy;
   const mgis_real *external_state_variables;
} mgis_bv_StateView;
typedef struct {
   const mgis_real *gradients, *thermodynamic_forces, *mass_density, *material_properties, *internal_state_variables, *stored_energy,
      *dissipated_energy, *external_state_variables;
} mgis_bv_InitialStateView;
typedef struct {
   char *error_message;
   mgis_real dt, *K, *rdt, *speed_of_sound;
   mgis_bv_InitialStateView s0;
   mgis_bv_StateView s1;
} mgis_bv_BehaviourDataView;
#endif
