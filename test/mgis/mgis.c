/* The stand-in for MGIS: see MGIS/Behaviour/Behaviour.h. Behaviours, in the conventions of MFront (shear times sqrt(2)):
 * NeoHookean (mu, lambda): W = mu/2 (tr C - 3 - 2 ln J) + lambda/2 (ln J)^2; no state.
 * Maxwell (mu, lambda, Part, Tau): S = (1 - g) D E + h, dh/dt + h/tau = g D dE/dt; h is an internal state variable. */
#include <math.h>
#include <string.h>
#include "MGIS/Behaviour/Integrate.h"

struct mgis_bv_FiniteStrainBehaviourOptions { int stress, tangent; };
struct mgis_bv_Behaviour { int maxwell; };
static mgis_bv_FiniteStrainBehaviourOptions given;
static mgis_bv_Behaviour kinds[2] = {{0}, {1}};
static const mgis_status fine = {MGIS_SUCCESS, NULL}, wrong = {MGIS_FAILURE, "the library has no such behaviour"};

mgis_status mgis_bv_create_finite_strain_behaviour_options(mgis_bv_FiniteStrainBehaviourOptions **o) { given.stress = given.tangent = 0; *o = &given; return fine; }
mgis_status mgis_bv_finite_strain_behaviour_options_set_stress_measure(mgis_bv_FiniteStrainBehaviourOptions *o, mgis_bv_FiniteStrainBehavourStressMeasure m) { o->stress = m; return fine; }
mgis_status mgis_bv_finite_strain_behaviour_options_set_tangent_operator(mgis_bv_FiniteStrainBehaviourOptions *o, mgis_bv_FiniteStrainBehavourTangentOperator t) { o->tangent = t; return fine; }
mgis_status mgis_bv_free_finite_strain_behaviour_options(mgis_bv_FiniteStrainBehaviourOptions **o) { *o = NULL; return fine; }
mgis_status mgis_bv_load_finite_strain_behaviour(mgis_bv_Behaviour **b, const mgis_bv_FiniteStrainBehaviourOptions *o, const char *library, const char *behaviour, const char *hypothesis)
{
   const int maxwell = strcmp(behaviour, "Maxwell") == 0;
   if (o->stress != MGIS_BV_PK2 || o->tangent != MGIS_BV_DS_DEGL || strcmp(library, "stand-in") != 0 || strcmp(hypothesis, "Tridimensional") != 0
       || !(maxwell || strcmp(behaviour, "NeoHookean") == 0)) return wrong;
   *b = kinds + maxwell;
   return fine;
}
mgis_status mgis_bv_behaviour_get_gradients_size(mgis_size_type *n, const mgis_bv_Behaviour *b) { (void)b; *n = 9; return fine; }
mgis_status mgis_bv_behaviour_get_thermodynamic_forces_size(mgis_size_type *n, const mgis_bv_Behaviour *b) { (void)b; *n = 6; return fine; }
mgis_status mgis_bv_behaviour_get_number_of_material_properties(mgis_size_type *n, const mgis_bv_Behaviour *b) { *n = b->maxwell ? 4 : 2; return fine; }
mgis_status mgis_bv_behaviour_get_material_property_name(const char **name, const mgis_bv_Behaviour *b, mgis_size_type i)
{
   static const char *names[] = {"mu", "lambda", "Part", "Tau"};
   (void)b;
   *name = names[i];
   return fine;
}
mgis_status mgis_bv_behaviour_get_internal_state_variables_size(mgis_size_type *n, const mgis_bv_Behaviour *b) { *n = b->maxwell ? 6 : 0; return fine; }
mgis_status mgis_bv_behaviour_get_number_of_external_state_variables(mgis_size_type *n, const mgis_bv_Behaviour *b) { (void)b; *n = 1; return fine; }
mgis_status mgis_bv_behaviour_get_behaviour_symmetry(mgis_bv_BehaviourSymmetry *s, const mgis_bv_Behaviour *b) { (void)b; *s = MGIS_BV_ISOTROPIC; return fine; }

static const int place[9][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 0}, {0, 2}, {2, 0}, {1, 2}, {2, 1}};
static const int pair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

static void right_cauchy_green(const double *gradients, double c[3][3])
{
   double f[3][3];
   for (int k = 0; k < 9; k++) f[place[k][0]][place[k][1]] = gradients[k];
   for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) c[i][j] = f[0][i]*f[0][j] + f[1][i]*f[1][j] + f[2][i]*f[2][j];
}

static void linear(const double *p, const double *gradients, double s[6])
{
   double c[3][3], trace;
   right_cauchy_green(gradients, c);
   trace = 0.5*(c[0][0] + c[1][1] + c[2][2] - 3);
   for (int k = 0; k < 6; k++)
      s[k] = (k < 3)*p[1]*trace + 2*p[0]*(k < 3 ? 0.5*(c[k][k] - 1) : sqrt(2)*0.5*c[pair[k][0]][pair[k][1]]);
}

mgis_status mgis_bv_integrate(int *result, mgis_bv_BehaviourDataView *d, const mgis_bv_Behaviour *b)
{
   const double *p = d->s1.material_properties;
   const int tangent = d->K[0] > 3;
   double c[3][3], inverse[3][3], det;
   *result = 1;
   if (fabs(d->s1.external_state_variables[0] - 293.15) > 0) return wrong;
   if (b->maxwell) {
      const double t = d->dt/p[3], factor = t > 1e-12 ? -expm1(-t)/t : 1;
      double s0[6], s1[6];
      linear(p, d->s0.gradients, s0);
      linear(p, d->s1.gradients, s1);
      for (int k = 0; k < 6; k++) {
         const double h = exp(-t)*d->s0.internal_state_variables[k] + p[2]*factor*(s1[k] - s0[k]);
         d->s1.internal_state_variables[k] = h;
         d->s1.thermodynamic_forces[k] = (1 - p[2])*s1[k] + h;
      }
      *d->s1.stored_energy = 0;
      for (int i = 0; tangent && i < 36; i++)
         d->K[i] = (1 - p[2] + p[2]*factor)*((i/6 < 3 && i % 6 < 3)*p[1] + (i/6 == i % 6)*2*p[0]);
      return fine;
   }
   right_cauchy_green(d->s1.gradients, c);
   for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) {
         const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
         inverse[j][i] = c[i1][j1]*c[i2][j2] - c[i1][j2]*c[i2][j1];
      }
   det = c[0][0]*inverse[0][0] + c[0][1]*inverse[1][0] + c[0][2]*inverse[2][0];
   if (!(det > 0)) {
      *result = -1;
      return fine;
   }
   {
      const double j = 0.5*log(det), m = p[0] - p[1]*j;
      for (int i = 0; i < 9; i++) inverse[i/3][i % 3] /= det;
      *d->s1.stored_energy = 0.5*p[0]*(c[0][0] + c[1][1] + c[2][2] - 3) - p[0]*j + 0.5*p[1]*j*j;
      for (int k = 0; k < 6; k++)
         d->s1.thermodynamic_forces[k] = (k < 3 ? 1 : sqrt(2))*((k < 3)*p[0] - m*inverse[pair[k][0]][pair[k][1]]);
      for (int i = 0; tangent && i < 36; i++) {
         const int *r = pair[i/6], *q = pair[i % 6];
         d->K[i] = (i/6 < 3 ? 1 : sqrt(2))*(i % 6 < 3 ? 1 : sqrt(2))
                   *(p[1]*inverse[r[0]][r[1]]*inverse[q[0]][q[1]]
                     + m*(inverse[r[0]][q[0]]*inverse[r[1]][q[1]] + inverse[r[0]][q[1]]*inverse[r[1]][q[0]]));
      }
   }
   return fine;
}
