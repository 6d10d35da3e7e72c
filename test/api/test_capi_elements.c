/* Elements by the argument block: what is in it counts, blocks of other sizes, normals that make curved elements of facets. */
#define _POSIX_C_SOURCE 200809L
#include "check.h"
#include <stddef.h>

static finshell_status status;

/* The first call failed as a whole, with a message that contains a word. */
static void refused(int32_t code, const char *word, int line)
{
   check(code == FINSHELL_INVALID_ARGUMENT && status.code == code && status.index == -1 && status.failed == 0, word, line);
   if (!strstr(status.message, word)) check(0, status.message, line);
}
#define REFUSED(call, word) refused((call), (word), __LINE__)

/* Results of a batch, evaluated and recovered. */
enum { most = 24 };
typedef struct {
   double energy[most], force[most][18], tangent[most][18][18], stretch[most], membrane[most][3], moment[most][3], stress[most][3][3];
   int32_t codes[most], recovered[most];
} result;

static int32_t by_block(const finshell_section *s, const finshell_elements *b, result *r)
{
   memset(r, 0, sizeof *r);
   int32_t code = finshell_elements_recover(s, b, r->stretch, r->membrane[0], r->moment[0], r->stress[0][0], r->recovered, &status);
   int32_t evaluated = finshell_elements_evaluate(s, b, r->energy, r->force[0], r->tangent[0][0], r->codes, &status);
   CHECK(code == evaluated);
   return evaluated;
}

static int32_t by_arguments(const finshell_section *s, patch p, int convention, result *r)
{
   const double *rotations = convention == FINSHELL_ROTATION_QUATERNION ? p.quaternion : p.vector;
   memset(r, 0, sizeof *r);
   finshell_recover(s, p.n, p.X, p.u, rotations, convention, p.quaternion, p.direction, r->stretch, r->membrane[0], r->moment[0],
                    r->stress[0][0], r->recovered, &status);
   return finshell_evaluate(s, p.n, p.X, p.u, rotations, convention, p.quaternion, p.direction, r->energy, r->force[0],
                            r->tangent[0][0], r->codes, 1, &status);
}

static finshell_section *with_formulation(double formulation)
{
   const char *names[] = {"c10", "c01"}, *options[] = {"formulation"};
   const double values[] = {80, 20};
   finshell_section *s = NULL;
   CHECK(finshell_section_create("mooney_rivlin", 2, names, values, 0.1, 1, options, &formulation, &s, NULL) == 0);
   return s;
}

/* Without normals, with those of the facets, in formulation (P): the bits of the short forms. Other normals count. */
static void short_forms(void)
{
   static result block, short_form;
   patch p = new_patch(most, 3);
   finshell_section *sections[3];
   const int32_t straight[most][3] = {{0}};
   sections[0] = rubber(0.1);
   sections[1] = laminate(0.02);
   sections[2] = with_formulation(2);
   for (int s = 0; s < 3; s++)
      for (int convention = 1; convention <= 3; convention++) {
         CHECK(by_arguments(sections[s], p, convention, &short_form) == 0);
         finshell_elements b = block_of(p, convention, NULL);
         CHECK(by_block(sections[s], &b, &block) == 0 && memcmp(&block, &short_form, sizeof block) == 0);
         b.straight = straight[0];
         b.toward = p.toward; /* these laws have no switch */
         CHECK(by_block(sections[s], &b, &block) == 0 && memcmp(&block, &short_form, sizeof block) == 0);
         b.normals = p.facets;
         CHECK(by_block(sections[s], &b, &block) == 0 && memcmp(&block, &short_form, sizeof block) == 0);
         b.normals = p.normals;
         CHECK(by_block(sections[s], &b, &block) == 0);
         for (int e = 0; e < most; e++)
            for (int i = 0; i < 18; i++) CHECK((block.force[e][i] == short_form.force[e][i]) == (s == 2));
         CHECK((block.moment[0][0] == short_form.moment[0][0]) == (s == 2));
         CHECK((block.stress[0][2][0] == short_form.stress[0][2][0]) == (s == 2));
         static result again;
         b.threads = 2;
         CHECK(by_block(sections[s], &b, &again) == 0 && memcmp(&block, &again, sizeof block) == 0);
      }
   for (int s = 0; s < 3; s++) finshell_section_destroy(sections[s]);
   free_patch(p);
}

/* A block that ends early lacks what it does not hold; one that ends late must hold zeros there. */
static void sizes(void)
{
   static result all, some;
   struct {
      finshell_elements known;
      const double *later[3];
   } newer;
   patch p = new_patch(most, 5);
   finshell_section *s = laminate(0.02);
   int32_t straight[most][3];
   double energy[most] = {7};
   finshell_elements b = block_of(p, 1, p.normals);
   for (int e = 0; e < most; e++)
      for (int i = 0; i < 3; i++) straight[e][i] = (e + i) % 2;
   b.straight = straight[0];

   CHECK(sizeof b == 8 + 4 * 4 + 13 * sizeof(void *) + 2 * sizeof(double) && offsetof(finshell_elements, X) == 24);
   CHECK(offsetof(finshell_elements, time_step) == sizeof b - sizeof(double));
   for (size_t size = 0; size <= sizeof b; size++) {
      /* of exactly this size: who reads beyond its end is caught by the sanitizers */
      finshell_elements *part = malloc(size < 8 ? 8 : size);
      b.size = size;
      memcpy(part, &b, size < 8 ? 8 : size);
      int32_t code = finshell_elements_evaluate(s, part, energy, some.force[0], NULL, NULL, &status);
      free(part);
      if (size < offsetof(finshell_elements, state) || size % sizeof(void *)) {
         char text[40];
         snprintf(text, sizeof text, "size is %d, expected sizeof", (int)size);
         REFUSED(code, text);
         CHECK(energy[0] == 7);
         continue;
      }
      CHECK(code == 0 && energy[0] > 0 && energy[0] != 7);
      finshell_elements cleared = b;
      memset((char *)&cleared + size, 0, sizeof b - size);
      cleared.size = sizeof b;
      CHECK(finshell_elements_evaluate(s, &cleared, all.energy, all.force[0], NULL, NULL, &status) == 0);
      CHECK(memcmp(all.force, some.force, sizeof all.force) == 0 && memcmp(all.energy, energy, sizeof energy) == 0);
      energy[0] = 7;
   }

   memset(&newer, 0, sizeof newer);
   b.size = sizeof b;
   newer.known = b;
   newer.known.size = sizeof newer;
   CHECK(by_block(s, &b, &all) == 0 && by_block(s, &newer.known, &some) == 0 && memcmp(&all, &some, sizeof all) == 0);
   for (int i = 0; i < 3; i++) {
      newer.later[i] = p.X;
      REFUSED(finshell_elements_evaluate(s, &newer.known, energy, NULL, NULL, NULL, &status), "newer than the library");
      REFUSED(finshell_elements_recover(s, &newer.known, energy, NULL, NULL, NULL, NULL, &status), "newer than the library");
      newer.later[i] = NULL;
   }
   newer.known.size += 4;
   REFUSED(finshell_elements_evaluate(s, &newer.known, energy, NULL, NULL, NULL, &status), "expected sizeof");
   b.size = UINT64_MAX;
   REFUSED(finshell_elements_evaluate(s, &b, energy, NULL, NULL, NULL, &status), "size is not set");
   b.size = (uint64_t)1 << 40;
   REFUSED(finshell_elements_recover(s, &b, energy, NULL, NULL, NULL, NULL, &status), "size is not set");
   CHECK(energy[0] == 7);
   finshell_section_destroy(s);
   free_patch(p);
}

static void refusals(void)
{
   patch p = new_patch(3, 7);
   finshell_section *s = rubber(0.1);
   finshell_elements b = block_of(p, 1, NULL), c;
   double energy[3] = {7, 7, 7};
   REFUSED(finshell_elements_evaluate(s, NULL, energy, NULL, NULL, NULL, &status), "elements is NULL");
   REFUSED(finshell_elements_recover(s, NULL, energy, NULL, NULL, NULL, NULL, &status), "elements is NULL");
   REFUSED(finshell_elements_evaluate(NULL, &b, energy, NULL, NULL, NULL, &status), "section is NULL");
   REFUSED(finshell_elements_recover((finshell_section *)&b, &b, energy, NULL, NULL, NULL, NULL, &status), "section is no handle");
#define WITH(member, value, word) \
   c = b, c.member = value; \
   REFUSED(finshell_elements_evaluate(s, &c, energy, NULL, NULL, NULL, &status), word); \
   REFUSED(finshell_elements_recover(s, &c, energy, NULL, NULL, NULL, NULL, &status), word)
   WITH(n, -1, "n is -1");
   WITH(convention, 0, "convention is 0");
   WITH(threads, -1, "threads is -1");
   WITH(reserved, 1, "reserved is 1");
   WITH(X, NULL, "X is NULL");
   WITH(u, NULL, "u is NULL");
   WITH(rotations, NULL, "rotations is NULL");
   b.convention = 3;
   WITH(state, NULL, "state is NULL");
   CHECK(energy[0] == 7 && energy[1] == 7 && energy[2] == 7);
   memset(&c, 0, sizeof c);
   c.size = sizeof c;
   c.convention = 1;
   CHECK(finshell_elements_evaluate(s, &c, NULL, NULL, NULL, NULL, &status) == 0);
   CHECK(finshell_elements_evaluate(s, &b, NULL, NULL, NULL, NULL, NULL) == 0);
   finshell_section_destroy(s);
   free_patch(p);
}

/* Normals that cannot be: a code, a message, zeros; all other elements have the bits they have without. */
static void bad_normals(void)
{
   static result clean, found;
   static const struct {
      double normal[3]; /* in terms of the facet's and of two sides */
      int32_t code;
      const char *word;
   } bad[] = {{{0, 0, 0}, -1, "the normal at node 1 (from 0) is zero"},
              {{-1, 0, 0}, -1, "the normal at node 1 (from 0) is 180.0 degrees from that of the triangle, expected less than 90"},
              {{-0.2, 1, 0}, -1, "degrees from that of the triangle"},
              {{-0.2e200, 1e200, 0}, -1, "degrees from that of the triangle"},
              {{NAN, 1, 0}, -3, "NaN or infinity"},
              {{1, INFINITY, 0}, -3, "NaN or infinity"}};
   finshell_section *s = laminate(0.01);
   for (int convention = 1; convention <= 3; convention++)
      for (int victim = 0; victim < most; victim += 5)
         for (unsigned i = 0; i < sizeof bad / sizeof *bad; i++) {
            patch p = new_patch(most, 13);
            double *m = p.normals + 9 * victim + 3;
            const double *x = p.X + 9 * victim, *f = p.facets + 9 * victim;
            finshell_elements b = block_of(p, convention, p.normals);
            CHECK(by_block(s, &b, &clean) == 0);
            for (int c = 0; c < 3; c++) {
               m[c] = bad[i].normal[0] * f[c];
               if (bad[i].normal[1] != 0) m[c] += bad[i].normal[1] * (x[3 + c] - x[c]);
            }
            CHECK(by_block(s, &b, &found) == bad[i].code && status.index == victim && status.failed == 1);
            CHECK(strstr(status.message, bad[i].word) != NULL);
            if (!strstr(status.message, bad[i].word)) fprintf(report, "%s\n", status.message);
            for (int e = 0; e < most; e++) {
               CHECK(found.codes[e] == (e == victim ? bad[i].code : 0) && found.recovered[e] == found.codes[e]);
               if (e == victim) {
                  CHECK(found.energy[e] == 0 && found.stretch[e] == 0 && found.tangent[e][3][3] == 0 && found.stress[e][2][1] == 0);
               } else {
                  CHECK(found.energy[e] == clean.energy[e] && found.stretch[e] == clean.stretch[e]);
                  CHECK(memcmp(found.force[e], clean.force[e], sizeof found.force[e]) == 0);
                  CHECK(memcmp(found.tangent[e], clean.tangent[e], sizeof found.tangent[e]) == 0);
               }
            }
            free_patch(p);
         }
   finshell_section_destroy(s);
}

/* The other things that are wrong with one element are named, too. */
static void other_complaints(void)
{
   for (int convention = 2; convention <= 3; convention++) {
      patch p = new_patch(9, 17);
      finshell_section *s = laminate(0.01);
      finshell_elements b = block_of(p, convention, NULL);
      for (int c = 0; c < 3; c++) p.direction[3 * 7 + c] = 0;
      CHECK(finshell_elements_evaluate(s, &b, NULL, NULL, NULL, NULL, &status) == -1);
      CHECK(strcmp(status.message, "finshell_elements_evaluate: element 7 (from 0): the direction is zero") == 0);
      for (int c = 0; c < 4; c++) p.quaternion[12 * 5 + 8 + c] = 0;
      CHECK(finshell_elements_evaluate(s, &b, NULL, NULL, NULL, NULL, &status) == -1 && status.index == 5 && status.failed == 2);
      CHECK(strstr(status.message, "element 5 (from 0): the quaternion of node 2 (from 0) is zero") != NULL);
      p.X[9 * 3] = NAN; /* the first mistake counts */
      CHECK(finshell_elements_evaluate(s, &b, NULL, NULL, NULL, NULL, &status) == -3 && status.index == 3);
      finshell_section_destroy(s);
      free_patch(p);
   }
}

/* Force and tangent of curved elements with straight sides are the derivatives of the energy, by central differences. */
static void derivatives(void)
{
   enum { n = 9 };
   static const double step = 1e-5;
   const int32_t straight[n][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
   finshell_section *sections[2];
   sections[0] = rubber(0.1);
   sections[1] = laminate(0.02);
   for (int s = 0; s < 2; s++)
      for (int convention = 1; convention <= 3; convention += 2) {
         patch p = new_patch(n, 29);
         double energy[2][n], force[n][18], moved[2][n][18], tangent[n][18][18], stiffest = 0, state[12 * n] = {0};
         finshell_elements b = block_of(p, convention, p.normals);
         b.straight = straight[0];
         if (convention == FINSHELL_ROTATION_INCREMENT) { /* total vectors as increments from a turned state */
            for (int i = 0; i < 3 * n; i++) state[4 * i] = 1, state[4 * i + 1] = 0.02 * (i % 5);
            b.state = state;
         }
         CHECK(finshell_elements_evaluate(sections[s], &b, energy[0], force[0], tangent[0][0], NULL, &status) == 0);
         for (int i = 0; i < 18 * n; i++) stiffest = fmax(stiffest, fabs(tangent[i / 18][i % 18][i % 18]));
         for (int j = 0; j < 18; j++) {
            double *moving = j % 6 < 3 ? p.u : p.vector;
            int at = 3 * (j / 6) + j % 3;
            for (int side = 0; side < 2; side++) {
               for (int e = 0; e < n; e++) moving[9 * e + at] += (side ? -2 : 1) * step;
               CHECK(finshell_elements_evaluate(sections[s], &b, energy[side], moved[side][0], NULL, NULL, &status) == 0);
            }
            for (int e = 0; e < n; e++) {
               moving[9 * e + at] += step;
               CHECK_CLOSE((energy[0][e] - energy[1][e]) / (2 * step), force[e][j], 1e-8 * stiffest);
               for (int i = 0; i < 18; i++)
                  CHECK_CLOSE((moved[0][e][i] - moved[1][e][i]) / (2 * step), tangent[e][i][j], 1e-7 * stiffest);
            }
         }
         free_patch(p);
      }
   for (int s = 0; s < 2; s++) finshell_section_destroy(sections[s]);
}

/* At rest, and turned as a whole, a curved element has no energy; the length of normals does not matter. */
static void rest(void)
{
   enum { n = 9 };
   patch p = new_patch(n, 31);
   finshell_section *s = rubber(0.1);
   finshell_elements b = block_of(p, FINSHELL_ROTATION_VECTOR, p.normals);
   double energy[n], force[n][18], tangent[n][18][18], again[n][18], q[4], r[3][3];
   const double turn[3] = {0.4, -1.1, 0.7};
   finshell_rotation_exp(1, turn, q, NULL, NULL);
   finshell_rotation_matrix(1, q, r[0], NULL, NULL);
   for (int motion = 0; motion < 2; motion++) {
      for (int i = 0; i < 3 * n; i++)
         for (int c = 0; c < 3; c++) {
            const double *x = p.X + 3 * i;
            p.vector[3 * i + c] = motion ? turn[c] : 0;
            p.u[3 * i + c] = motion ? r[c][0] * x[0] + r[c][1] * x[1] + r[c][2] * x[2] - x[c] + 0.3 * c : 0;
         }
      CHECK(finshell_elements_evaluate(s, &b, energy, force[0], tangent[0][0], NULL, &status) == 0);
      for (int e = 0; e < n; e++) {
         CHECK(fabs(energy[e]) < 1e-13);
         for (int i = 0; i < 18; i++) CHECK(fabs(force[e][i]) < 1e-12 * tangent[e][0][0]);
      }
   }
   for (int i = 0; i < 9 * n; i++) p.u[i] += 0.01 * sin(i), p.normals[i] *= 1;
   CHECK(finshell_elements_evaluate(s, &b, NULL, force[0], NULL, NULL, &status) == 0);
   for (int i = 0; i < 9 * n; i++) p.normals[i] *= i / 3 % 2 ? 1e-70 : 64;
   CHECK(finshell_elements_evaluate(s, &b, NULL, again[0], NULL, NULL, &status) == 0);
   for (int i = 0; i < 18 * n; i++) CHECK_CLOSE(force[i / 18][i % 18], again[i / 18][i % 18], 1e-10);
   finshell_section_destroy(s);
   free_patch(p);
}

/* Fibres in tension only, just unstretched: they stiffen the tangent where the motion stretches them. */
static void switches(void)
{
   const char *names[] = {"mu", "k1", "k2", "rho"};
   const double values[] = {1, 10, 1, 0.1}, X[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, zero[9] = {0};
   double toward[18] = {0}, k[3][18][18];
   finshell_section *s = NULL;
   finshell_elements b = {0};
   CHECK(finshell_section_create("holzapfel_2005", 4, names, values, 0.1, 0, NULL, NULL, &s, &status) == 0);
   b.size = sizeof b;
   b.n = b.convention = b.threads = 1;
   b.X = X;
   b.u = b.rotations = zero;
   CHECK(finshell_elements_evaluate(s, &b, NULL, NULL, k[0][0], NULL, &status) == 0);
   b.toward = toward;
   toward[6] = 0.01; /* node 1 along the fibre */
   CHECK(finshell_elements_evaluate(s, &b, NULL, NULL, k[1][0], NULL, &status) == 0);
   toward[6] = -0.01;
   CHECK(finshell_elements_evaluate(s, &b, NULL, NULL, k[2][0], NULL, &status) == 0);
   CHECK(k[1][6][6] > 1.5 * k[0][6][6]);
   CHECK_CLOSE(k[2][6][6], k[0][6][6], 1e-12);
   toward[11] = NAN;
   CHECK(finshell_elements_evaluate(s, &b, NULL, NULL, k[2][0], NULL, &status) == FINSHELL_NOT_A_NUMBER && k[2][6][6] == 0);
   finshell_section_destroy(s);
}

/* A line of numbers behind a key. */
static void numbers(FILE *f, const char *key, int n, double *values)
{
   char word[16] = "";
   CHECK(fscanf(f, "%15s", word) == 1 && strcmp(word, key) == 0);
   for (int i = 0; i < n; i++) CHECK(fscanf(f, "%lf", values + i) == 1);
}

/* Curved elements of an independent implementation. */
static void golden(void)
{
   char line[400];
   int cases = 0;
   FILE *f = fopen("data/element_golden_curved.txt", "r");
   CHECK(f != NULL);
   while (f && fgets(line, sizeof line, f)) {
      const char *mooney[] = {"c10", "c01"}, *young[] = {"e", "nu"}, *options[] = {"beta0", "thickness_points"};
      const double rubbery[] = {80, 20}, stiff[] = {1000, 0.3}, chosen[] = {0.01, 2};
      double X[9], m[9], u[9], q[12], energy, force[18], triangle[171], w, g[18], k[18][18], largest = 0, stiffest = 0;
      if (strncmp(line, "case ", 5) != 0) continue;
      int rubber_case = strstr(line, "mooney_rivlin c10=80 c01=20; formulation: S; arc: 1; beta0: 0.01;") != NULL;
      CHECK(rubber_case || strstr(line, "st_venant_kirchhoff E=1000 nu=0.3; formulation: S; arc: 1; beta0: 0.01;") != NULL);
      numbers(f, "X", 9, X);
      numbers(f, "m", 9, m);
      numbers(f, "u", 9, u);
      numbers(f, "q", 12, q);
      numbers(f, "energy", 1, &energy);
      numbers(f, "force", 18, force);
      numbers(f, "tangent", 171, triangle);
      finshell_section *s = NULL;
      CHECK(finshell_section_create(rubber_case ? "mooney_rivlin" : "st_venant_kirchhoff", 2, rubber_case ? mooney : young,
                                    rubber_case ? rubbery : stiff, 0.1, 2, options, chosen, &s, &status) == 0);
      finshell_elements b = {0};
      b.size = sizeof b;
      b.n = b.threads = 1;
      b.convention = FINSHELL_ROTATION_QUATERNION;
      b.X = X;
      b.u = u;
      b.rotations = q;
      b.normals = m;
      CHECK(finshell_elements_evaluate(s, &b, &w, g, k[0], NULL, &status) == 0);
      finshell_section_destroy(s);
      for (int i = 0; i < 18; i++) largest = fmax(largest, fabs(force[i]));
      for (int i = 0; i < 171; i++) stiffest = fmax(stiffest, fabs(triangle[i]));
      CHECK_CLOSE(w, energy, 2e-12 * fabs(energy));
      for (int i = 0; i < 18; i++) {
         CHECK_CLOSE(g[i], force[i], 2e-12 * largest);
         for (int j = 0; j <= i; j++) CHECK_CLOSE(k[i][j], triangle[i * (i + 1) / 2 + j], 2e-12 * stiffest);
      }
      cases++;
   }
   if (f) fclose(f);
   CHECK(cases == 16);
}

/* Thickness, offset and growth of the elements' own: other sections, another reference; and what is wrong with them. */
static void own(void)
{
   enum { n = 9 };
   static result all, one;
   patch p = new_patch(n, 37);
   finshell_section *s = rubber(0.1);
   double thickness[n], offset[n], growth[n][4], mass[n][18][18], lumped[n][18], mass_of_one[18][18], g = 1.1, energy[n];
   for (int e = 0; e < n; e++) {
      thickness[e] = 0.05 + 0.02 * e;
      offset[e] = 0.01 * (e - 3);
      growth[e][0] = growth[e][1] = (g * g - 1) / 2;
      growth[e][2] = 0;
      growth[e][3] = g - 1;
   }
   finshell_elements b = block_of(p, FINSHELL_ROTATION_VECTOR, p.normals);
   b.thickness = thickness;
   b.offset = offset;
   CHECK(by_block(s, &b, &all) == 0);
   CHECK(finshell_elements_mass(s, &b, mass[0][0], lumped[0], NULL, &status) == 0);
   for (int e = 0; e < n; e++) {
      const char *names[] = {"c10", "c01"}, *options[] = {"density", "offset"};
      const double values[] = {80, 20}, option_values[] = {2.5, offset[e]};
      finshell_section *other = NULL;
      finshell_elements alone = b;
      CHECK(finshell_section_create("mooney_rivlin", 2, names, values, thickness[e], 2, options, option_values, &other, NULL) == 0);
      alone.n = 1;
      alone.X += 9 * e;
      alone.u += 9 * e;
      alone.rotations += 9 * e;
      alone.normals += 9 * e;
      if (alone.direction) alone.direction += 3 * e;
      alone.thickness = alone.offset = NULL;
      CHECK(by_block(other, &alone, &one) == 0);
      CHECK_CLOSE(all.energy[e], one.energy[0], 1e-10 * one.energy[0]);
      for (int i = 0; i < 18; i++) CHECK_CLOSE(all.force[e][i], one.force[0][i], 1e-9);
      for (int i = 0; i < 9; i++) CHECK_CLOSE(all.stress[e][i / 3][i % 3], one.stress[0][i / 3][i % 3], 1e-8);
      CHECK(finshell_mass_matrix(other, 1, alone.X, mass_of_one[0], NULL, NULL, &status) == 0);
      for (int i = 0; i < 324; i++) CHECK_CLOSE(mass[e][i / 18][i % 18], mass_of_one[i / 18][i % 18], 1e-14);
      finshell_section_destroy(other);
   }
   /* grown all round and moved there: at rest; a field and wrinkles know of it, too */
   for (int i = 0; i < 9 * n; i++) p.u[i] = (g - 1) * p.X[i], p.vector[i] = 0;
   b.growth = growth[0];
   CHECK(by_block(s, &b, &all) == 0);
   for (int i = 0; i < 18 * n; i++) CHECK(fabs(all.force[i / 18][i % 18]) < 1e-12);
   for (int e = 0; e < n; e++) CHECK_CLOSE(all.stretch[e], g, 1e-13);
   double strain[n][3][3];
   CHECK(finshell_recover_field(s, &b, "strain", strain[0][0], NULL, &status) == 0);
   for (int i = 0; i < 9 * n; i++) CHECK(fabs(strain[i / 9][i % 9 / 3][i % 3]) < 1e-12);
   const char *names[] = {"mu"}, *options[] = {"membrane", "wrinkling"};
   const double mu[] = {80}, on[] = {1, 1};
   finshell_section *sheet = NULL;
   int32_t sheets[n];
   CHECK(finshell_section_create("neo_hookean", 1, names, mu, 0.1, 2, options, on, &sheet, NULL) == 0);
   CHECK(finshell_elements_wrinkles(sheet, &b, sheets, NULL, NULL, &status) == 0);
   for (int i = 0; i < 9 * n; i++) p.u[i] = 0.9 * (g - 1) * p.X[i];
   CHECK(finshell_elements_wrinkles(sheet, &b, sheets, NULL, NULL, &status) == 0);
   for (int e = 0; e < n; e++) CHECK(sheets[e] == FINSHELL_SHEET_SLACK);
   for (int i = 0; i < 9 * n; i++) p.u[i] = 1.1 * (g - 1) * p.X[i];
   CHECK(finshell_elements_wrinkles(sheet, &b, sheets, NULL, NULL, &status) == 0);
   for (int e = 0; e < n; e++) CHECK(sheets[e] == FINSHELL_SHEET_TAUT);
   /* mistakes, one by one */
   thickness[4] = 0;
   CHECK(finshell_elements_evaluate(s, &b, energy, NULL, NULL, NULL, &status) == -1 && status.index == 4 && status.failed == 1);
   CHECK(strstr(status.message, "its thickness is") && strstr(status.message, "expected a positive number") && energy[4] == 0);
   CHECK(finshell_elements_mass(s, &b, NULL, lumped[0], NULL, &status) == -1 && status.index == 4 && lumped[4][0] == 0);
   thickness[4] = NAN;
   CHECK(finshell_elements_evaluate(s, &b, energy, NULL, NULL, NULL, &status) == -3 && status.index == 4);
   thickness[4] = 0.1;
   growth[2][3] = -1;
   CHECK(finshell_elements_evaluate(s, &b, energy, NULL, NULL, NULL, &status) == -1 && status.index == 2);
   CHECK(strstr(status.message, "has grown to no size"));
   CHECK(finshell_elements_recover(s, &b, energy, NULL, NULL, NULL, NULL, &status) == -1 && status.index == 2 && energy[2] == 0);
   CHECK(finshell_elements_evaluate(sheet, &b, energy, NULL, NULL, NULL, &status) == -1 && status.index == 2);
   finshell_section_destroy(sheet);
   finshell_section_destroy(s);
   free_patch(p);
}

int main(void)
{
   silence();
   short_forms();
   sizes();
   refusals();
   bad_normals();
   other_complaints();
   derivatives();
   rest();
   switches();
   own();
   golden();
   return finish();
}
