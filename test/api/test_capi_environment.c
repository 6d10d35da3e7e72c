/* A host that stops at floating-point exceptions and looks at their flags: no function disturbs it, neither for valid input nor for
 * what it refuses, on one thread or many. The release library is meant; the debug one traps on purpose. */
#define _GNU_SOURCE
#include <fenv.h>
#include "check.h"

#ifdef FINSHELL_TRAPS
int main(void)
{
   printf("this library traps on purpose\n");
   return 77;
}
#else

static const int traps = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW;
static int calls = 0;

/* After each call: traps as set, flags as raised by us. */
static void undisturbed(const char *what, int number)
{
   calls++;
   int found = fetestexcept(FE_ALL_EXCEPT), enabled = fegetexcept();
   checks++;
   if (found == FE_UNDERFLOW && enabled == traps) return;
   failures++;
   fprintf(report, "%s %d: flags %x, traps %x\n", what, number, (unsigned)found, (unsigned)enabled);
   fedisableexcept(FE_ALL_EXCEPT);
   feclearexcept(FE_ALL_EXCEPT);
   feraiseexcept(FE_UNDERFLOW);
   feenableexcept(traps);
}

/* The test itself computes between `outside` and `inside`. */
static void outside(void)
{
   fedisableexcept(FE_ALL_EXCEPT);
}

static void inside(void)
{
   feclearexcept(FE_ALL_EXCEPT);
   feraiseexcept(FE_UNDERFLOW);
   feenableexcept(traps);
}

static finshell_section *section_of(const char *law, double thickness, int formulation)
{
   const char *names[32], *option[] = {"formulation", "density"};
   char kept[32][32];
   double values[32], options[] = {formulation, 1};
   finshell_section *s = NULL;
   int32_t n = finshell_material_parameter_count(law, NULL), given = 0;
   undisturbed("material_parameter_count", 0);
   for (int32_t j = 0; j < n; j++) {
      finshell_parameter parameter;
      finshell_material_parameter(law, j, &parameter, NULL);
      undisturbed("material_parameter", j);
      if (!parameter.required && parameter.example == parameter.default_value) continue;
      strcpy(kept[given], parameter.name);
      names[given] = kept[given];
      values[given++] = parameter.example;
   }
   CHECK(finshell_section_create(law, given, names, values, thickness, 2, option, options, &s, NULL) == 0);
   undisturbed("section_create", 0);
   finshell_section_create(law, given, names, values, -thickness, 2, option, options, &s, NULL);
   undisturbed("section_create, refused", 0);
   values[0] = INFINITY;
   finshell_section *none = NULL;
   finshell_section_create(law, given, names, values, thickness, 2, option, options, &none, NULL);
   undisturbed("section_create, refused", 1);
   finshell_section_create(law, given, names, values, thickness, 2, option, options, &s, NULL);
   undisturbed("section_create, refused", 2);
   values[0] = 1e300;
   finshell_section_create(law, given, names, values, thickness, 2, option, options, &s, NULL);
   undisturbed("section_create, huge", 0);
   return s;
}

/* What a section says of itself. */
static void asked(const finshell_section *s)
{
   finshell_properties properties = {0};
   finshell_layer layer = {0};
   double k[36], value;
   char name[4];
   properties.size = sizeof properties;
   layer.size = sizeof layer;
   finshell_section_properties(s, &properties, NULL);
   undisturbed("section_properties", 0);
   finshell_section_layer(s, 0, &layer, NULL);
   undisturbed("section_layer", 0);
   finshell_section_parameter(s, 0, 0, name, sizeof name, &value, NULL);
   undisturbed("section_parameter", 0);
   finshell_section_stiffness(s, k, NULL);
   undisturbed("section_stiffness", 0);
   finshell_section_stiffness(NULL, k, NULL);
   undisturbed("section_stiffness", 1);
}

/* Layers of all kinds of numbers, and sections of them if they make sense. */
static void builders(void)
{
   static const double odd[] = {0.1, 1e150, 1e300, 1e-300, 5e-324, 0, -1, NAN, INFINITY};
   const char *names[] = {"mu"}, *options[] = {"offset", "beta0", "formulation", "slack", "nothing"};
   for (unsigned i = 0; i < sizeof odd / sizeof *odd; i++)
      for (unsigned j = 0; j < 4; j++)
         for (unsigned o = 0; o < 5; o++) {
            finshell_section_builder *b = NULL;
            finshell_section *s = NULL;
            finshell_builder_begin(&b, NULL);
            undisturbed("builder_begin", 0);
            for (int layer = 0; layer < 2; layer++) {
               finshell_builder_layer(b, j == 0 ? odd[i] : 0.1, j == 1 ? odd[i] : 30, 0, j == 2 ? odd[i] : 1, NULL);
               undisturbed("builder_layer", (int)i);
               finshell_builder_law(b, "neo_hookean", 1, names, j == 3 ? &odd[i] : odd, NULL);
               undisturbed("builder_law", (int)i);
            }
            finshell_builder_option(b, options[o], odd[(i + j) % 9], NULL);
            undisturbed("builder_option", (int)o);
            finshell_builder_build(b, &s, NULL);
            undisturbed("builder_build", (int)i);
            finshell_builder_destroy(b);
            undisturbed("builder_destroy", 0);
            asked(s);
            finshell_section_destroy(s);
         }
}


/* All functions on a patch; what comes out is finite, whatever went in. */
static void all(const finshell_section *s, patch p, const char *what)
{
   int32_t n = p.n;
   double *energy = malloc(sizeof(double) * n), *force = malloc(sizeof(double) * 18 * n), *k = malloc(sizeof(double) * 324 * n);
   double *stress = malloc(sizeof(double) * 9 * n), *pressure = malloc(sizeof(double) * n), total = 0;
   finshell_status status;
   for (int convention = 1; convention <= 3; convention++) {
      const double *r = convention == FINSHELL_ROTATION_QUATERNION ? p.quaternion : p.vector;
      for (int threads = 1; threads <= 4; threads += 3) {
         finshell_evaluate(s, n, p.X, p.u, r, convention, p.quaternion, p.direction, energy, force, k, NULL, threads, NULL);
         undisturbed(what, convention);
         finshell_evaluate(s, n, p.X, p.u, r, convention, p.quaternion, p.direction, energy, force, NULL, NULL, threads, NULL);
         undisturbed(what, 10 + convention);
         finshell_evaluate(s, n, p.X, p.u, r, convention, p.quaternion, NULL, energy, NULL, NULL, NULL, threads, NULL);
         undisturbed(what, 20 + convention);
      }
      finshell_recover(s, n, p.X, p.u, r, convention, p.quaternion, p.direction, pressure, force, force, stress, NULL, NULL);
      undisturbed(what, 30 + convention);
      outside();
      for (int i = 0; i < 324 * n; i++) total += 0 * k[i];
      finshell_elements b = block_of(p, convention, p.normals);
      inside();
      for (b.threads = 1; b.threads <= 4; b.threads += 3) {
         b.toward = p.toward;
         finshell_elements_evaluate(s, &b, energy, force, k, NULL, &status);
         undisturbed(what, 50 + convention);
         finshell_elements_recover(s, &b, pressure, force, force, stress, NULL, &status);
         undisturbed(what, 60 + convention);
      }
      outside();
      for (int i = 0; i < 324 * n; i++) total += 0 * k[i];
      inside();
      for (int form = 0; form < 2; form++) {
         finshell_elements_pressure(&b, form ? energy : p.X, form, p.u, stress, force, k, NULL, &status);
         undisturbed(what, 70 + convention);
      }
      outside();
      for (int i = 0; i < 324 * n; i++) total += 0 * k[i];
      for (int i = 0; i < n; i++) total += 0 * energy[i] + 0 * pressure[i];
      for (int i = 0; i < 9 * n; i++) total += 0 * stress[i];
      for (int i = 0; i < 3 * n; i++) total += 0 * force[i];
      CHECK(total == 0);
      if (!(total == 0)) fprintf(report, "%s: an output is not finite\n", what);
      inside();
   }
   for (int form = 0; form < 2; form++) {
      finshell_pressure_load(n, energy, p.X, p.u, form, NULL, force, k, NULL, NULL);
      undisturbed(what, 40);
      finshell_pressure_load(n, p.X, p.X, p.u, form, NULL, force, k, NULL, NULL);
      undisturbed(what, 41);
   }
   finshell_mass_matrix(s, n, p.X, k, force, NULL, NULL);
   undisturbed(what, 42);
   finshell_rotation_exp(3 * n, p.vector, k, NULL, NULL);
   undisturbed(what, 43);
   finshell_rotation_log(3 * n, p.quaternion, k, NULL, NULL);
   undisturbed(what, 44);
   finshell_rotation_compose(3 * n, p.quaternion, p.quaternion, k, NULL, NULL);
   undisturbed(what, 45);
   finshell_rotation_update(3 * n, p.vector, k, NULL, NULL);
   undisturbed(what, 46);
   finshell_rotation_matrix(3 * n, p.quaternion, k, NULL, NULL);
   undisturbed(what, 47);
   finshell_rotation_tangent(3 * n, p.vector, k, NULL, NULL);
   undisturbed(what, 48);
   free(energy), free(force), free(k), free(stress), free(pressure);
}

/* A patch of which every third element is spoiled. */
static patch spoiled_patch(int32_t n, uint32_t seed, int how)
{
   outside();
   patch p = new_patch(n, seed);
   static const double odd[] = {NAN, INFINITY, -INFINITY, 1e308, 1e200, 1e100, 1e60, 1e-60, 1e-200, 5e-324, 0};
   for (int32_t e = 0; e < n; e += 3) {
      double *x = p.X + 9 * e, *u = p.u + 9 * e, *t = p.vector + 9 * e, *q = p.quaternion + 12 * e, *d = p.direction + 3 * e;
      double value = odd[(e / 3) % 11];
      for (int c = 0; c < 3; c++) {
         switch (how) {
         case 0: x[3 + c] = x[c]; break;                       /* coincident nodes */
         case 1: x[6 + c] = 2 * x[3 + c] - x[c]; break;        /* collinear nodes */
         case 2: u[3 + c] = x[c] + u[c] - x[3 + c]; break;     /* nodes that meet */
         case 3: u[c] = -x[c]; u[3 + c] = -x[3 + c]; u[6 + c] = -x[6 + c]; break;
         case 4: x[c] = value; break;
         case 5: u[c] = value; break;
         case 6: t[c] = value; q[c] = value; break;
         case 7: for (int i = 0; i < 9; i += 3) x[i + c] *= value, u[i + c] *= value; break; /* another unit of length */
         case 8: for (int i = 0; i < 4; i++) q[4 * c + i] *= value; break;
         case 9: d[c] *= value; break;
         case 14: for (int i = 0; i < 9; i += 3) p.normals[9 * e + i + c] *= value; break;
         case 15: p.toward[18 * e + 5 * c] = value; break;
         case 16: p.normals[9 * e + 6 + c] *= -1; break; /* away from the triangle's */
         case 10: u[3 + c] = 50 * (x[3 + c] - x[c]); u[6 + c] = -0.98 * (x[6 + c] - x[c]); break;
         case 11: for (int i = 0; i < 9; i += 3) u[i + c] = 3 * (e + 1) * noise(&seed); break;
         case 12: t[c] = 7 * noise(&seed); q[c + 1] = 4 * noise(&seed); break;
         default: break;
         }
      }
   }
   inside();
   return p;
}

int main(void)
{
   char law[40], what[80];
   silence();
   inside();
   for (int32_t i = 0; i < finshell_material_count(); i++) {
      finshell_material_name(i, law, sizeof law, NULL);
      undisturbed("material_name", i);
      for (int formulation = 1; formulation <= 2; formulation++) {
         finshell_section *s = section_of(law, i % 2 ? 0.01 : 0.3, formulation);
         for (int how = 0; how < 17; how++) {
            snprintf(what, sizeof what, "%s, formulation %d, spoiled %d:", law, formulation, how);
            patch p = spoiled_patch(how == 5 ? 1001 : 35, 7 + how, how);
            all(s, p, what);
            free_patch(p);
         }
         asked(s);
         finshell_section_destroy(s);
      }
   }
   builders();
   finshell_message(1, law, sizeof law);
   undisturbed("message", 0);
   outside();
   CHECK(calls > 5000);
   return finish();
}
#endif
