/* Membranes: nine freedoms, no rotations; sheets that wrinkle; what is refused of them. */
#define _POSIX_C_SOURCE 200809L
#include "check.h"

static finshell_status status;

static void refused(int32_t code, const char *word, int line)
{
   check(code == FINSHELL_INVALID_ARGUMENT && status.code == code && status.index == -1 && status.failed == 0, word, line);
   if (!strstr(status.message, word)) check(0, status.message, line);
}
#define REFUSED(call, word) refused((call), (word), __LINE__)

static finshell_section *membrane(const char *law, int32_t n, const char *const *names, const double *values, int wrinkling)
{
   const char *options[] = {"membrane", "density", "wrinkling"};
   const double chosen[] = {1, 2.5, 1};
   finshell_section *s = NULL;
   CHECK(finshell_section_create(law, n, names, values, 0.1, wrinkling ? 3 : 2, options, chosen, &s, &status) == 0);
   return s;
}

static finshell_section *sheet(int wrinkling)
{
   const char *names[] = {"mu"};
   const double mu = 2;
   return membrane("neo_hookean", 1, names, &mu, wrinkling);
}

/* Two layers of different directions. */
static finshell_section *fabric(int wrinkling)
{
   const char *names[] = {"e1", "e2", "nu12", "g12"};
   const double values[] = {33, 11, 0.25, 6.6};
   finshell_section_builder *builder = begin();
   for (int i = 0; i < 2; i++) {
      CHECK(finshell_builder_layer(builder, 0.02 + 0.01 * i, 30 + 70 * i, 0, 0, &status) == 0);
      CHECK(finshell_builder_law(builder, "orthotropic", 4, names, values, &status) == 0);
   }
   CHECK(finshell_builder_option(builder, "membrane", 1, &status) == 0);
   if (wrinkling) {
      CHECK(finshell_builder_option(builder, "wrinkling", 1, &status) == 0);
      CHECK(finshell_builder_option(builder, "slack", 1e-5, &status) == 0);
   }
   return built(builder);
}

enum { most = 24 };
typedef struct {
   double energy[most], force[most][9], tangent[most][9][9], stretch[most], membrane[most][3], moment[most][3], stress[most][3][3];
   double ridge[most][3];
   int32_t codes[most], recovered[most], state[most], found[most];
} result;

static int32_t by_block(const finshell_section *s, const finshell_elements *b, result *r)
{
   memset(r, 0xff, sizeof *r);
   int32_t code = finshell_elements_recover(s, b, r->stretch, r->membrane[0], r->moment[0], r->stress[0][0], r->recovered, &status);
   CHECK(finshell_elements_wrinkles(s, b, r->state, r->ridge[0], r->found, &status) == code);
   CHECK(finshell_elements_evaluate(s, b, r->energy, r->force[0], r->tangent[0][0], r->codes, &status) == code);
   return code;
}

/* Elements of the patch stretched by l1 and l2 along x and y, somewhat distorted, in a plane that is turned. */
static finshell_elements stretched(patch p, double l1, double l2)
{
   const double turn[3] = {0.4, -1.1, 0.7};
   double q[4], r[3][3];
   uint32_t seed = 77;
   finshell_elements b = {0};
   finshell_rotation_exp(1, turn, q, NULL, NULL);
   finshell_rotation_matrix(1, q, r[0], NULL, NULL);
   for (int i = 0; i < 3 * p.n; i++) {
      const double *x = p.X + 3 * i, y[3] = {l1 * x[0] + 0.02 * noise(&seed), l2 * x[1] + 0.02 * noise(&seed), x[2]};
      for (int c = 0; c < 3; c++) p.u[3 * i + c] = r[c][0] * y[0] + r[c][1] * y[1] + r[c][2] * y[2] - x[c];
   }
   b.size = sizeof b;
   b.n = p.n;
   b.threads = 1;
   b.X = p.X;
   b.u = p.u;
   b.direction = p.direction;
   return b;
}

static const double states[3][2] = {{0.9, 0.8}, {1.3, 0.7}, {1.2, 1.1}}; /* slack, wrinkled, taut */

/* Force and tangent are the derivatives of the energy, by central differences, in every state. */
static void derivatives(void)
{
   enum { n = 9 };
   static const double step = 1e-5;
   finshell_section *sections[] = {sheet(0), sheet(1), fabric(0), fabric(1)};
   for (int s = 0; s < 4; s++)
      for (int k = 0; k < 3; k++) {
         patch p = new_patch(n, 29);
         double energy[2][n], force[n][9], moved[2][n][9], tangent[n][9][9], stiffest = 0;
         int32_t state[n];
         finshell_elements b = stretched(p, states[k][0], states[k][1]);
         CHECK(finshell_elements_wrinkles(sections[s], &b, state, NULL, NULL, &status) == 0);
         for (int e = 0; e < n; e++) CHECK(state[e] == (s % 2 ? k : FINSHELL_SHEET_TAUT));
         CHECK(finshell_elements_evaluate(sections[s], &b, NULL, force[0], tangent[0][0], NULL, &status) == 0);
         for (int i = 0; i < 9 * n; i++) stiffest = fmax(stiffest, fabs(tangent[i / 9][i % 9][i % 9]));
         for (int j = 0; j < 9; j++) {
            for (int side = 0; side < 2; side++) {
               for (int e = 0; e < n; e++) p.u[9 * e + j] += (side ? -2 : 1) * step;
               CHECK(finshell_elements_evaluate(sections[s], &b, energy[side], moved[side][0], NULL, NULL, &status) == 0);
            }
            for (int e = 0; e < n; e++) {
               p.u[9 * e + j] += step;
               CHECK_CLOSE((energy[0][e] - energy[1][e]) / (2 * step), force[e][j], 1e-8 * stiffest);
               for (int i = 0; i < 9; i++) {
                  CHECK_CLOSE((moved[0][e][i] - moved[1][e][i]) / (2 * step), tangent[e][i][j], 1e-7 * stiffest);
                  CHECK(tangent[e][i][j] == tangent[e][j][i]);
               }
            }
         }
         free_patch(p);
      }
   for (int s = 0; s < 4; s++) finshell_section_destroy(sections[s]);
}

/* A strip pulled by l and pushed together across: uniaxial tension of its material, whatever its width. */
static void pulled_strip(void)
{
   const double X[1][3][3] = {{{0, 0, 0}, {2, 0, 0}, {0, 1, 0}}}, l = 1.5, mu = 2, h = 0.1, k = 1e-6 * 10 * h * mu / 3;
   double u[1][3][3] = {{{0}}};
   result r;
   finshell_section *s = sheet(1);
   finshell_elements b = {0};
   b.size = sizeof b;
   b.n = 1;
   b.X = X[0][0];
   b.u = u[0][0];
   for (int width = 0; width < 3; width++) {
      double across = -0.3 * (width + 1), strain = 0.5 * ((1 + across) * (1 + across) - 1);
      u[0][1][0] = 2 * (l - 1);
      u[0][2][1] = across;
      CHECK(by_block(s, &b, &r) == 0);
      CHECK_CLOSE(r.energy[0], h * mu / 2 * (l * l + 2 / l - 3) + k / 2 * strain * strain, 1e-16);
      CHECK_CLOSE(r.force[0][3], h * mu / 2 * (l - 1 / (l * l)), 1e-15);
      CHECK_CLOSE(r.force[0][7], k * strain * (1 + across), 1e-16);
      CHECK_CLOSE(r.stress[0][1][0], mu * (l * l - 1 / l), 1e-14);
      CHECK_CLOSE(r.stress[0][1][1], 0, 1e-15);
      CHECK_CLOSE(r.stretch[0], 1 / sqrt(l), 1e-15);
      CHECK_CLOSE(r.membrane[0][0], h * mu * (1 - 1 / (l * l * l)), 1e-15);
      for (int c = 0; c < 3; c++) CHECK(r.moment[0][c] == 0);
      CHECK(r.state[0] == FINSHELL_SHEET_WRINKLED);
      CHECK_CLOSE(fabs(r.ridge[0][0]), 1, 1e-15);
      CHECK_CLOSE(r.ridge[0][1], 0, 1e-15);
   }
   finshell_section_destroy(s);
}

/* What is not looked at may be anything; the short forms, other batches and more threads have the same bits; an element alone in its
 * call has the same results. */
static void not_looked_at(void)
{
   static result clean, found;
   static double nonsense[18 * most];
   static const int32_t sides[3 * most] = {9, -7, 1, 2};
   finshell_section *sections[] = {sheet(0), sheet(1), fabric(0), fabric(1)};
   for (int i = 0; i < 18 * most; i++) nonsense[i] = i % 2 ? NAN : 0;
   for (int s = 0; s < 4; s++)
      for (int k = 0; k < 3; k++) {
         patch p = new_patch(most, 3);
         finshell_elements b = stretched(p, states[k][0], states[k][1]), c = b;
         CHECK(by_block(sections[s], &b, &clean) == 0);
         c.rotations = c.state = c.normals = nonsense;
         c.straight = sides;
         for (c.convention = -1; c.convention <= 3; c.convention++)
            CHECK(by_block(sections[s], &c, &found) == 0 && memcmp(&clean, &found, sizeof clean) == 0);
         c = b;
         for (c.threads = 0; c.threads <= 2; c.threads++)
            CHECK(by_block(sections[s], &c, &found) == 0 && memcmp(&clean, &found, sizeof clean) == 0);
         for (int e = 0; e < most; e++) {
            double energy, force[9], tangent[9][9], stretch, moment[3], stress[3][3];
            CHECK(finshell_evaluate(sections[s], 1, p.X + 9 * e, p.u + 9 * e, NULL, 0, NULL, p.direction + 3 * e, &energy, force,
                                    tangent[0], NULL, 1, &status) == 0);
            double most_of_tangent = 0;
            for (int i = 0; i < 81; i++) most_of_tangent = fmax(most_of_tangent, fabs(clean.tangent[e][i / 9][i % 9]));
            CHECK_CLOSE(energy, clean.energy[e], 1e-12 * clean.energy[e]);
            for (int i = 0; i < 9; i++) CHECK_CLOSE(force[i], clean.force[e][i], 1e-13 * most_of_tangent);
            for (int i = 0; i < 81; i++) CHECK_CLOSE(tangent[i / 9][i % 9], clean.tangent[e][i / 9][i % 9], 1e-11 * most_of_tangent);
            CHECK(finshell_recover(sections[s], 1, p.X + 9 * e, p.u + 9 * e, NULL, 0, NULL, p.direction + 3 * e, &stretch, NULL,
                                   moment, stress[0], NULL, &status) == 0);
            CHECK(stretch == clean.stretch[e] && moment[0] == 0 && memcmp(stress, clean.stress[e], sizeof stress) == 0);
         }
         free_patch(p);
      }
   for (int s = 0; s < 4; s++) finshell_section_destroy(sections[s]);
}

/* Beyond its nine or 81 numbers an element writes nothing. */
static void extent(void)
{
   double force[2 * 9 + 1], tangent[2 * 81 + 1], consistent[2 * 81 + 1], lumped[2 * 9 + 1];
   patch p = new_patch(2, 3);
   finshell_section *s = sheet(1);
   finshell_elements b = stretched(p, 1.2, 0.8);
   force[18] = lumped[18] = tangent[162] = consistent[162] = 7;
   CHECK(finshell_elements_evaluate(s, &b, NULL, force, tangent, NULL, &status) == 0);
   CHECK(finshell_mass_matrix(s, 2, p.X, consistent, lumped, NULL, &status) == 0);
   CHECK(force[18] == 7 && tangent[162] == 7 && consistent[162] == 7 && lumped[18] == 7);
   finshell_section_destroy(s);
   free_patch(p);
}

/* Masses are those of the displacements of a shell. */
static void masses(void)
{
   enum { n = 9 };
   static double of_shell[n][18][18], diagonal[n][18], m[n][9][9], lumped[n][9];
   int32_t codes[n];
   patch p = new_patch(n, 5);
   finshell_section *shell = rubber(0.1), *s = sheet(0);
   CHECK(finshell_mass_matrix(shell, n, p.X, of_shell[0][0], diagonal[0], NULL, &status) == 0);
   CHECK(finshell_mass_matrix(s, n, p.X, m[0][0], lumped[0], NULL, &status) == 0);
   for (int e = 0; e < n; e++)
      for (int i = 0; i < 9; i++) {
         CHECK(lumped[e][i] == diagonal[e][i / 3 * 6 + i % 3] && lumped[e][i] > 0);
         for (int j = 0; j < 9; j++) CHECK(m[e][i][j] == of_shell[e][i / 3 * 6 + i % 3][j / 3 * 6 + j % 3]);
      }
   for (int c = 0; c < 3; c++) p.X[9 * 4 + 3 + c] = p.X[9 * 4 + c];
   CHECK(finshell_mass_matrix(s, n, p.X, m[0][0], lumped[0], codes, &status) == FINSHELL_DEGENERATE_REFERENCE);
   CHECK(status.index == 4 && codes[4] == -2 && codes[5] == 0 && m[4][0][0] == 0 && lumped[4][3] == 0 && m[5][0][0] > 0);
   finshell_section_destroy(shell);
   finshell_section_destroy(s);
   free_patch(p);
}

/* Fibres that are just unstretched, as they are in the reference state, bear where `toward` stretches them. */
static void switches(void)
{
   const char *names[] = {"c", "k1", "k2", "angle"};
   const double values[] = {1, 10, 1, 0};
   patch p = new_patch(1, 3);
   double slack[9][9], bearing[9][9], toward[9], along = 0;
   finshell_section *s = membrane("holzapfel_gasser_ogden", 4, names, values, 0);
   finshell_elements b = stretched(p, 1, 1);
   memset(p.u, 0, 9 * sizeof(double));
   for (int i = 0; i < 9; i++) toward[i] = p.X[i];
   CHECK(finshell_elements_evaluate(s, &b, NULL, NULL, slack[0], NULL, &status) == 0);
   b.toward = toward;
   CHECK(finshell_elements_evaluate(s, &b, NULL, NULL, bearing[0], NULL, &status) == 0);
   for (int i = 0; i < 9; i++)
      for (int j = 0; j < 9; j++) along += toward[i] * (bearing[i][j] - slack[i][j]) * toward[j];
   CHECK(along > 0.1);
   finshell_section_destroy(s);
   free_patch(p);
}

/* What is wrong with one element gets a code and zeros; the others have the bits they have without. */
static void failures_of_elements(void)
{
   static result clean, found;
   for (int kind = 0; kind < 4; kind++) {
      static const int32_t expected[] = {-3, -2, 1, -1};
      finshell_section *s = fabric(kind != 2); /* a sheet that wrinkles is slack in a point */
      patch p = new_patch(most, 13);
      finshell_elements b = stretched(p, 1.3, 0.7);
      CHECK(by_block(s, &b, &clean) == 0);
      double *x = p.X + 9 * 5, *u = p.u + 9 * 5;
      for (int c = 0; c < 3; c++) {
         if (kind == 0) u[c] = INFINITY;
         if (kind == 1) x[6 + c] = 0.5 * (x[c] + x[3 + c]);
         if (kind == 2) u[3 + c] = u[c] + x[c] - x[3 + c], u[6 + c] = u[c] + x[c] - x[6 + c];
         if (kind == 3) p.direction[15 + c] = 0;
      }
      b.convention = FINSHELL_ROTATION_QUATERNION; /* whose complaints look at quaternions */
      int32_t code = by_block(s, &b, &found);
      CHECK(code == expected[kind] && status.index == 5 && status.failed == 1);
      if (kind == 3) CHECK(strcmp(status.message, "finshell_elements_evaluate: element 5 (from 0): the direction is zero") == 0);
      for (int e = 0; e < most; e++) {
         if (e == 5) {
            CHECK(found.codes[e] == code && found.recovered[e] == code && found.found[e] == code);
            CHECK(found.energy[e] == 0 && found.force[e][8] == 0 && found.tangent[e][8][8] == 0 && found.stretch[e] == 0);
            CHECK(found.state[e] == 0 && found.ridge[e][0] == 0 && found.stress[e][2][2] == 0 && found.moment[e][2] == 0);
         } else {
            CHECK(found.codes[e] == 0 && found.energy[e] == clean.energy[e] && found.ridge[e][1] == clean.ridge[e][1]);
            CHECK(memcmp(found.tangent[e], clean.tangent[e], sizeof found.tangent[e]) == 0);
         }
      }
      finshell_section_destroy(s);
      free_patch(p);
   }
}

static int32_t with_options(int32_t n, const char *first, double a, const char *second, double b)
{
   const char *names[] = {"mu"}, *options[] = {first, second};
   const double mu = 2, values[] = {a, b};
   finshell_section *s = NULL;
   if (strcmp(second, "thickness_points")) { /* both ways say the same */
      char text[sizeof status.message];
      finshell_section_builder *builder = begin();
      finshell_builder_layer(builder, 0.1, 0, 0, 0, NULL);
      finshell_builder_law(builder, "neo_hookean", 1, names, &mu, NULL);
      for (int i = 0; i < n; i++) finshell_builder_option(builder, options[i], values[i], NULL);
      CHECK(finshell_builder_build(builder, &s, &status) <= 0);
      finshell_builder_destroy(builder);
      finshell_section_destroy(s);
      snprintf(text, sizeof text, "%s", strchr(status.message, ':') ? strchr(status.message, ':') : "");
      int32_t code = finshell_section_create("neo_hookean", 1, names, &mu, 0.1, n, options, values, &s, &status);
      CHECK(strncmp(text, code ? strchr(status.message, ':') : "", strlen(text)) == 0);
      finshell_section_destroy(s);
      return code;
   }
   int32_t code = finshell_section_create("neo_hookean", 1, names, &mu, 0.1, n, options, values, &s, &status);
   finshell_section_destroy(s);
   return code;
}

static void refusals(void)
{
   static const char *of_shells[] = {"thickness_points", "formulation", "beta0", "arc", "offset"};
   double energy[2] = {7, 7}, ridge[3] = {7, 7, 7};
   int32_t state[1] = {7};
   for (unsigned i = 0; i < sizeof of_shells / sizeof *of_shells; i++) {
      char text[80];
      snprintf(text, sizeof text, "a membrane has no option '%s': it does not bend", of_shells[i]);
      REFUSED(with_options(2, "membrane", 1, of_shells[i], 1), text);
      CHECK(with_options(2, "membrane", 0, of_shells[i], 1) == 0);
   }
   REFUSED(with_options(1, "wrinkling", 1, "", 0), "only a membrane has the option 'wrinkling': give membrane = 1, too");
   REFUSED(with_options(2, "slack", 1e-5, "membrane", 0), "only a membrane has the option 'slack': give membrane = 1, too");
   REFUSED(with_options(2, "membrane", 1, "slack", 1.5), "slack is 1.500000E+00, expected a number from 0 to 1");
   REFUSED(with_options(2, "membrane", 1, "slack", -1e-9), "expected a number from 0 to 1");
   REFUSED(with_options(2, "membrane", 1, "slack", NAN), "expected a number from 0 to 1");
   REFUSED(with_options(2, "membrane", 1, "wrinkling", 2), "wrinkling is 2, expected 0 or 1");
   REFUSED(with_options(1, "membrane", -1, "", 0), "membrane is -1, expected 0 or 1");
   REFUSED(with_options(1, "membrane", 0.5, "", 0), "membrane is 5.000000E-01, expected a small whole number");
   REFUSED(with_options(2, "membrane", 1, "membrane", 1), "option 'membrane' is given twice");
   REFUSED(with_options(1, "membran", 1, "", 0), "options are formulation, beta0, arc, offset, membrane, wrinkling, slack");
   CHECK(with_options(2, "wrinkling", 1, "membrane", 1) == 0);
   CHECK(with_options(2, "membrane", 1, "slack", 0) == 0);

   const char *names[] = {"mu"};
   const double mu = 2;
   finshell_section *s = NULL;
   finshell_section_builder *builder = begin();
   CHECK(finshell_builder_layer(builder, 0.1, 0, 3, 0, NULL) == 0 && finshell_builder_law(builder, "neo_hookean", 1, names, &mu, NULL) == 0);
   CHECK(finshell_builder_option(builder, "membrane", 1, NULL) == 0);
   REFUSED(finshell_builder_build(builder, &s, &status), "layer 1: points is 3, and a membrane has none");
   finshell_builder_destroy(builder);

   patch p = new_patch(1, 3);
   finshell_section *shell = rubber(0.1);
   s = sheet(1);
   finshell_elements b = stretched(p, 1.2, 0.8), c;
   CHECK(finshell_section_freedoms(shell, &status) == 18 && status.code == 0 && finshell_section_freedoms(s, NULL) == 9);
   REFUSED(finshell_section_freedoms(NULL, &status), "section is NULL");
   REFUSED(finshell_section_freedoms((finshell_section *)&b, &status), "section is no handle");
   b.convention = 1;
   REFUSED(finshell_elements_wrinkles(shell, &b, state, ridge, NULL, &status), "the section is that of a shell");
   REFUSED(finshell_elements_wrinkles(NULL, &b, state, ridge, NULL, &status), "section is NULL");
   REFUSED(finshell_elements_wrinkles(s, NULL, state, ridge, NULL, &status), "elements is NULL");
   REFUSED(finshell_elements_evaluate(shell, &b, energy, NULL, NULL, NULL, &status), "rotations is NULL");
   REFUSED(finshell_elements_pressure(&b, energy, 0, NULL, energy, NULL, NULL, NULL, &status), "rotations is NULL");
#define WITH(member, value, word) \
   c = b, c.member = value; \
   REFUSED(finshell_elements_evaluate(s, &c, energy, NULL, NULL, NULL, &status), word); \
   REFUSED(finshell_elements_recover(s, &c, energy, NULL, NULL, NULL, NULL, &status), word); \
   REFUSED(finshell_elements_wrinkles(s, &c, state, ridge, NULL, &status), word)
   WITH(n, -1, "n is -1");
   WITH(threads, -1, "threads is -1");
   WITH(reserved, 1, "reserved is 1");
   WITH(X, NULL, "X is NULL");
   WITH(u, NULL, "u is NULL");
   CHECK(energy[0] == 7 && state[0] == 7 && ridge[2] == 7);
   b.n = 0;
   CHECK(finshell_elements_wrinkles(s, &b, NULL, NULL, NULL, NULL) == 0);
   finshell_section_destroy(s);
   finshell_section_destroy(shell);
   free_patch(p);
}

int main(void)
{
   silence();
   derivatives();
   pulled_strip();
   not_looked_at();
   extent();
   masses();
   switches();
   failures_of_elements();
   refusals();
   return finish();
}
