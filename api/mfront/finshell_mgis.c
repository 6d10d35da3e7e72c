/* Behaviours of MFront as laws of finshell, by the C interface of MGIS (MFrontGenericInterfaceSupport, 2.0 or later):
 *
 *    cc -O2 -fPIC -shared finshell_mgis.c -o libfinshell_mgis.so -lMFrontGenericInterface-c
 *    finshell check-law 'libfinshell_mgis.so#src/libBehaviour.so:NeoHookean' ...
 *
 * The name of a law is LIBRARY:BEHAVIOUR. Finite-strain behaviours, for which MGIS converts to the second Piola-Kirchhoff stress and its
 * derivative by the Green-Lagrange strain; in the hypothesis Tridimensional, which finshell brings to plane stress. The deformation
 * gradient is the right stretch: a behaviour is objective. Material properties are the parameters; external state variables
 * are 0, but for the temperature, 293.15. Internal state variables become states, and with them stretch, stress and stored energy of the
 * beginning. What a behaviour does not store as energy is 0.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <MGIS/Behaviour/Behaviour.h>
#include <MGIS/Behaviour/BehaviourDataView.h>
#include <MGIS/Behaviour/Integrate.h>

#include "finshell_law.h"

enum { MOST = 100, EXTRA = 9 + 6 + 1 /* stretch less 1, stress, energy */ };

typedef struct loaded {
   finshell_law law;
   finshell_parameter parameter[MOST];
   char name[32];
   char *key; /* LIBRARY:BEHAVIOUR */
   mgis_bv_Behaviour *behaviour;
   int32_t internal;
   struct loaded *next;
} loaded;

static loaded *all = NULL; /* finshell asks for laws one at a time */

/* Right stretch less 1 in the order of MGIS (11 22 33 12 21 13 31 23 32), as accurate as the strain. */
static int stretch(double e1, double e2, double e3, double e4, double u[9])
{
   const double c1 = 1 + 2*e1, c2 = 1 + 2*e2, c3 = 1 + 2*e3, det = c1*c2 - e4*e4;
   double j, t;
   memset(u, 0, 9*sizeof *u);
   if (!(det > 0 && c1 > 0 && c3 > 0)) return 0;
   j = sqrt(det);
   t = sqrt(c1 + c2 + 2*j);
   /* U = (C + J)/t, and t = U11 + U22 */
   u[0] = (c1 + j)/t - 1;
   u[1] = (c2 + j)/t - 1;
   u[2] = 2*e3/(1 + sqrt(c3));
   u[3] = u[4] = e4/t;
   return 1;
}

static void evaluate(const finshell_points *at, const double *parameters, const double *e, double *w, double *s, double *d,
                     const double *begin, double *end, int32_t *codes)
{
   static const int row[10] = {0, 1, 2, 3, 0, 0, 0, 1, 1, 2}, column[10] = {0, 1, 2, 3, 1, 2, 3, 2, 3, 3};
   const loaded *law = at->data;
   const int32_t n = at->n, m = law->internal;
   const double root = sqrt(0.5);
   for (int32_t i = 0; i < n; i++) {
      double f0[9] = {0}, f1[9], s0[6] = {0}, s1[6] = {0}, k[100] = {0}, v0[1000] = {0}, v1[1000] = {0}, outside[MOST] = {293.15};
      double energy0 = 0, energy1 = 0, dissipated0 = 0, dissipated1 = 0, density = 0, rdt = 1, sound = 0;
      char message[512] = "";
      mgis_bv_BehaviourDataView view;
      int result = -1;
      w[i] = 0;
      for (int j = 0; j < 4; j++) s[j*n + i] = 0;
      for (int j = 0; j < 10; j++) d[j*n + i] = 0;
      if (m > 0) {
         for (int j = 0; j < m; j++) v0[j] = v1[j] = begin[j*n + i];
         for (int j = 0; j < 9; j++) f0[j] = begin[(m + j)*n + i];
         for (int j = 0; j < 6; j++) s0[j] = s1[j] = begin[(m + 9 + j)*n + i];
         energy0 = energy1 = begin[(m + 15)*n + i];
      }
      if (!stretch(e[i], e[n + i], e[2*n + i], e[3*n + i], f1)) {
         codes[i] = FINSHELL_MATERIAL_LIMIT;
         continue;
      }
      if (m > 0)
         for (int j = 0; j < 9; j++) end[(m + j)*n + i] = f1[j];
      for (int j = 0; j < 3; j++) f0[j] += 1, f1[j] += 1;
      memset(&view, 0, sizeof view);
      k[0] = at->level < 2 ? 0 : 4; /* stress, or the consistent tangent as well */
      view.error_message = message;
      view.dt = at->time_step;
      view.K = k;
      view.rdt = &rdt;
      view.speed_of_sound = &sound;
      view.s0.gradients = f0;
      view.s0.thermodynamic_forces = s0;
      view.s0.mass_density = &density;
      view.s0.material_properties = parameters;
      view.s0.internal_state_variables = v0;
      view.s0.stored_energy = &energy0;
      view.s0.dissipated_energy = &dissipated0;
      view.s0.external_state_variables = outside;
      view.s1.gradients = f1;
      view.s1.thermodynamic_forces = s1;
      view.s1.mass_density = &density;
      view.s1.material_properties = parameters;
      view.s1.internal_state_variables = v1;
      view.s1.stored_energy = &energy1;
      view.s1.dissipated_energy = &dissipated1;
      view.s1.external_state_variables = outside;
      if (mgis_bv_integrate(&result, &view, law->behaviour).exit_status != MGIS_SUCCESS || result < 0) {
         codes[i] = FINSHELL_MATERIAL_LIMIT;
         continue;
      }
      for (int j = 0; j < m; j++) end[j*n + i] = v1[j];
      if (m > 0) {
         for (int j = 0; j < 6; j++) end[(m + 9 + j)*n + i] = s1[j];
         end[(m + 15)*n + i] = energy1;
      }
      w[i] = energy1;
      /* shear of MGIS: sqrt(2) S12, sqrt(2) E12 */
      for (int j = 0; j < 4; j++) s[j*n + i] = (j == 3 ? root : 1)*s1[j];
      if (at->level < 2) continue;
      for (int j = 0; j < 10; j++) {
         const int r = row[j], c = column[j];
         d[j*n + i] = 0.5*(k[6*r + c] + k[6*c + r])*(r == 3 ? root : 1)*(c == 3 ? root : 1);
      }
   }
}

static const char *load(loaded *law, const char *library, const char *behaviour)
{
   mgis_bv_FiniteStrainBehaviourOptions *options = NULL;
   mgis_bv_BehaviourSymmetry symmetry;
   mgis_size_type forces = 0, gradients = 0, properties = 0, internal = 0, outside = 0;
   mgis_status status = mgis_bv_create_finite_strain_behaviour_options(&options);
   if (status.exit_status == MGIS_SUCCESS)
      status = mgis_bv_finite_strain_behaviour_options_set_stress_measure(options, MGIS_BV_PK2);
   if (status.exit_status == MGIS_SUCCESS)
      status = mgis_bv_finite_strain_behaviour_options_set_tangent_operator(options, MGIS_BV_DS_DEGL);
   if (status.exit_status == MGIS_SUCCESS)
      status = mgis_bv_load_finite_strain_behaviour(&law->behaviour, options, library, behaviour, "Tridimensional");
   mgis_bv_free_finite_strain_behaviour_options(&options);
   if (status.exit_status != MGIS_SUCCESS) return status.msg ? status.msg : "MGIS does not load it";
   if (mgis_bv_behaviour_get_gradients_size(&gradients, law->behaviour).exit_status != MGIS_SUCCESS
       || mgis_bv_behaviour_get_thermodynamic_forces_size(&forces, law->behaviour).exit_status != MGIS_SUCCESS
       || mgis_bv_behaviour_get_number_of_material_properties(&properties, law->behaviour).exit_status != MGIS_SUCCESS
       || mgis_bv_behaviour_get_internal_state_variables_size(&internal, law->behaviour).exit_status != MGIS_SUCCESS
       || mgis_bv_behaviour_get_number_of_external_state_variables(&outside, law->behaviour).exit_status != MGIS_SUCCESS
       || mgis_bv_behaviour_get_behaviour_symmetry(&symmetry, law->behaviour).exit_status != MGIS_SUCCESS)
      return "MGIS does not say what the behaviour is";
   if (gradients != 9 || forces != 6) return "it is no behaviour of finite strains: it has other gradients or forces";
   if (properties > MOST || outside > MOST || internal > 1000 - EXTRA) return "it has too many properties or state variables";
   for (mgis_size_type i = 0; i < properties; i++) {
      const char *name = NULL;
      if (mgis_bv_behaviour_get_material_property_name(&name, law->behaviour, i).exit_status != MGIS_SUCCESS || !name)
         return "MGIS does not name a property";
      snprintf(law->parameter[i].name, sizeof law->parameter[i].name, "%s", name);
      snprintf(law->parameter[i].meaning, sizeof law->parameter[i].meaning, "material property of %s", behaviour);
      law->parameter[i].required = 1;
   }
   snprintf(law->name, sizeof law->name, "%.31s", behaviour);
   law->internal = (int32_t)internal;
   law->law.size = sizeof law->law;
   law->law.name = law->name;
   law->law.kind = FINSHELL_LAW_SOLID;
   law->law.isotropic = symmetry == MGIS_BV_ISOTROPIC;
   law->law.states = internal > 0 ? (int32_t)internal + EXTRA : 0;
   law->law.parameters = (int32_t)properties;
   law->law.parameter = properties > 0 ? law->parameter : NULL;
   law->law.evaluate = evaluate;
   law->law.data = law;
   return NULL;
}

FINSHELL_LAW_EXPORT const finshell_law *finshell_law_1(const char *name, char *message, int32_t size);

FINSHELL_LAW_EXPORT const finshell_law *finshell_law_1(const char *name, char *message, int32_t size)
{
   const char *colon = strrchr(name, ':'), *complaint;
   loaded *law;
   for (law = all; law; law = law->next)
      if (strcmp(law->key, name) == 0) return &law->law;
   if (!colon || colon == name || !colon[1]) {
      snprintf(message, (size_t)size, "'%s' names no behaviour, expected LIBRARY:BEHAVIOUR", name);
      return NULL;
   }
   law = calloc(1, sizeof *law);
   if (law) law->key = malloc(2*strlen(name) + 2);
   if (!law || !law->key) {
      free(law);
      snprintf(message, (size_t)size, "out of memory");
      return NULL;
   }
   strcpy(law->key, name);
   {
      char *library = law->key + strlen(name) + 1; /* behind the key, of which it is the beginning */
      memcpy(library, name, (size_t)(colon - name));
      library[colon - name] = '\0';
      complaint = load(law, library, colon + 1);
   }
   if (complaint) {
      snprintf(message, (size_t)size, "behaviour '%s': %s", name, complaint);
      free(law->key);
      free(law);
      return NULL;
   }
   law->next = all;
   all = law;
   return &law->law;
}
