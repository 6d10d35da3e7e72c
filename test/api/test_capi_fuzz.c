/* Random arguments: sizes, options, states, missing arrays, numbers that are none. Never a crash; a code and a sentence, or results
 * that are finite; what stands behind an array is left alone. */
#define _POSIX_C_SOURCE 200809L
#include "check.h"
#include <fenv.h>

enum { MOST = 9, GUARD = 4 };
static const double guard = -7.25;
static uint64_t seed = 2026;
static int watched; /* flags work */

static uint32_t draw(uint32_t n) /* 0 .. n - 1 */
{
   seed = seed * 6364136223846793005u + 1442695040888963407u;
   return (uint32_t)(seed >> 33) % n;
}

static double odd_number(void)
{
   static const double odd[] = {0, -0.0, 1, -1, 3, 1e-300, 5e-324, 1e-30, 1e30, 1e160, 1.7e308, -1.7e308, NAN, INFINITY, -INFINITY};
   return odd[draw(sizeof odd / sizeof *odd)];
}

/* Mostly a sensible number near 1. */
static double number(void)
{
   return draw(200) ? draw(2001) * 1e-3 - 1 : odd_number();
}

static double *filled(int n)
{
   double *a = malloc((n + GUARD) * sizeof *a);
   for (int i = 0; i < n; i++) a[i] = number();
   for (int i = n; i < n + GUARD; i++) a[i] = guard;
   return a;
}

/* Whether overflow raises its flag, by which the library notices it: valgrind raises none. */
static int flags_work(void)
{
   volatile double large = 1e300;
   feclearexcept(FE_ALL_EXCEPT);
   large *= large;
   int works = fetestexcept(FE_OVERFLOW) != 0;
   feclearexcept(FE_ALL_EXCEPT);
   return works;
}

/* Outputs: the guard is whole, and what belongs to elements with code 0 is finite. */
static void sound(const double *a, int n, int each, const int32_t *codes, int32_t code)
{
   if (!a) return;
   for (int i = 0; i < GUARD; i++) CHECK(a[n * each + i] == guard);
   if (!watched) return;
   for (int e = 0; e < n; e++) {
      if (code < 0 || codes[e]) continue;
      for (int i = 0; i < each; i++) CHECK(isfinite(a[e * each + i]));
   }
}

static finshell_section *any_section(void)
{
   finshell_section *section = NULL;
   finshell_status status = {0};
   char law[64];
   finshell_parameter parameter;
   const char *names[8], *options[3];
   static const char *known[] = {"membrane", "wrinkling", "slack", "formulation", "arc", "beta0", "offset", "thickness_points", "angle", "nothing"};
   static char text[8][32];
   double values[8], chosen[3];
   int32_t count, parameters;
   finshell_material_name((int32_t)draw(finshell_material_count()), law, sizeof law, NULL);
   parameters = count = finshell_material_parameter_count(law, NULL);
   if (count > 8) count = 8;
   for (int i = 0; i < count; i++) {
      finshell_material_parameter(law, i, &parameter, NULL);
      memcpy(text[i], parameter.name, sizeof text[i]);
      names[i] = text[i];
      values[i] = draw(30) ? parameter.example : odd_number();
   }
   for (int i = 0; i < 3; i++) {
      options[i] = known[draw(sizeof known / sizeof *known)];
      chosen[i] = draw(3) ? draw(3) : number();
   }
   (void)parameters;
   int32_t code = finshell_section_create(law, draw(30) ? count : (int32_t)draw(3) - 1, names, values, draw(30) ? 0.02 : odd_number(), (int32_t)draw(4), options, chosen,
                                          &section, &status);
   CHECK((code == 0) == (section != NULL));
   if (code) CHECK(status.message[0] != 0);
   return section;
}

/* A section of layers, said in any order. */
static finshell_section *any_layers(void)
{
   static const char *laws[] = {"neo_hookean", "yeoh", "nothing"}, *names[] = {"mu", "c1"};
   static const char *known[] = {"membrane", "wrinkling", "slack", "arc", "beta0", "offset", "formulation", "density"};
   finshell_section_builder *builder = NULL;
   finshell_section *section = NULL;
   finshell_status status = {0};
   const double value = 1 + number();
   finshell_builder_begin(&builder, NULL);
   for (uint32_t i = draw(9); i > 0; i--) {
      uint32_t law = draw(30) ? draw(2) : 2;
      if (draw(30)) finshell_builder_layer(builder, draw(30) ? 0.02 : odd_number(), number(), draw(30) ? 0 : (int32_t)draw(15), draw(2), NULL);
      if (draw(30)) finshell_builder_law(builder, laws[law], 1, &names[law % 2], &value, &status);
      if (!draw(4)) finshell_builder_option(builder, known[draw(sizeof known / sizeof *known)], draw(3) ? draw(3) : number(), &status);
   }
   int32_t code = finshell_builder_build(builder, &section, draw(2) ? &status : NULL);
   CHECK((code == 0) == (section != NULL));
   finshell_builder_destroy(builder);
   if (section && draw(10) == 0) finshell_builder_destroy((finshell_section_builder *)section);
   return section;
}

/* What it says of itself is finite, or there is a code. */
static void ask(const finshell_section *section)
{
   finshell_properties p = {0};
   finshell_layer l = {0};
   double stiffness[36], value = 0;
   p.size = draw(20) ? sizeof p : draw(200);
   l.size = draw(20) ? sizeof l : draw(200);
   if (p.size > sizeof p || l.size > sizeof l) return;
   if (finshell_section_properties(section, &p, NULL) == 0)
      CHECK(isfinite(p.thickness) && isfinite(p.offset) && isfinite(p.areal_mass) && isfinite(p.first_moment) && isfinite(p.rotatory_inertia));
   if (finshell_section_layer(section, (int32_t)draw(4) - 1, &l, NULL) == 0)
      CHECK(isfinite(l.thickness) && isfinite(l.angle) && isfinite(l.density) && isfinite(l.height));
   finshell_section_parameter(section, (int32_t)draw(3) - 1, (int32_t)draw(8) - 1, NULL, 0, &value, NULL);
   CHECK(isfinite(value));
   if (finshell_section_stiffness(section, stiffness, NULL) >= 0 && section)
      for (int i = 0; i < 36; i++) CHECK(isfinite(stiffness[i]));
}

static double *maybe(double *a)
{
   if (draw(12)) return a;
   free(a);
   return NULL;
}

static void one_call(void)
{
   finshell_section *section = draw(4) ? any_section() : any_layers();
   ask(section);
   finshell_status status = {0};
   int32_t n = draw(20) ? (int32_t)draw(MOST) : -(int32_t)draw(3), m = n > 0 ? n : 0, code, codes[MOST] = {0};
   int freedoms = section ? finshell_section_freedoms(section, NULL) : 18;
   int32_t convention = draw(20) ? (int32_t)draw(4) : (int32_t)draw(100) - 50;
   double *X = maybe(filled(9 * MOST)), *u = maybe(filled(9 * MOST)), *rotations = maybe(filled(12 * MOST)), *state = draw(2) ? filled(12 * MOST) : NULL;
   double *direction = draw(2) ? filled(3 * MOST) : NULL, *normals = draw(2) ? filled(9 * MOST) : NULL;
   double *energy = maybe(filled(m)), *force = maybe(filled(freedoms * m)), *tangent = maybe(filled(freedoms * freedoms * m));
   struct { finshell_elements elements; char later[200]; } room = {{0}, {0}}; /* of a later header, what it would know being 0 */
   room.elements.size = draw(20) ? sizeof room.elements : draw(200);
   room.elements.n = n;
   room.elements.X = X;
   room.elements.u = u;
   room.elements.rotations = rotations;
   room.elements.convention = convention;
   room.elements.state = state;
   room.elements.direction = direction;
   room.elements.normals = normals;
   room.elements.threads = draw(20) ? 1 : (int32_t)draw(5) - 2;
   code = finshell_elements_evaluate(section, &room.elements, energy, force, tangent, codes, &status);
   if (code < 0) CHECK(status.message[0] != 0);
   sound(energy, m, 1, codes, code);
   sound(force, m, freedoms, codes, code);
   sound(tangent, m, freedoms * freedoms, codes, code);

   double *stretch = maybe(filled(m)), *membrane_force = maybe(filled(3 * m)), *moment = maybe(filled(3 * m));
   code = finshell_elements_recover(section, &room.elements, stretch, membrane_force, moment, NULL, codes, &status);
   sound(stretch, m, 1, codes, code);
   sound(membrane_force, m, 3, codes, code);
   sound(moment, m, 3, codes, code);

   double *pressure = maybe(filled(MOST)), *origin = draw(2) ? filled(3) : NULL;
   double *load = maybe(filled(18 * m)), *stiffness = maybe(filled(324 * m)), *volume = maybe(filled(m));
   code = finshell_elements_pressure(&room.elements, pressure, draw(20) ? (int32_t)draw(2) : (int32_t)draw(9) - 4, origin, volume, load, stiffness, codes, &status);
   sound(volume, m, 1, codes, code);
   sound(load, m, 18, codes, code);
   sound(stiffness, m, 324, codes, code);

   double *quaternion = filled(4 * m), *matrix = filled(9 * m);
   code = finshell_rotation_exp(n, rotations, quaternion, codes, &status);
   sound(quaternion, m, 4, codes, code);
   code = finshell_rotation_tangent(n, rotations, matrix, codes, &status);
   sound(matrix, m, 9, codes, code);
   code = finshell_rotation_matrix(n, rotations, matrix, codes, &status);
   sound(matrix, m, 9, codes, code);

   double *all[] = {X, u, rotations, state, direction, normals, energy, force, tangent, stretch, membrane_force, moment, pressure, origin, load, stiffness, volume,
                    quaternion, matrix};
   for (size_t i = 0; i < sizeof all / sizeof *all; i++) free(all[i]);
   finshell_section_destroy(section);
}

int main(int arguments, char **argument)
{
   int calls = arguments > 1 ? atoi(argument[1]) : 3000;
   silence();
   watched = flags_work();
   for (int i = 0; i < calls; i++) one_call();
   return finish();
}
