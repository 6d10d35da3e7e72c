/* Laws of the caller's: the same formula in the plane, in space and built in gives the same elements; states belong to the caller;
 * a sheet that relaxes, against its closed form; laws that fail, and descriptions that are refused; what the checker finds. */
#define _POSIX_C_SOURCE 200809L
#include "check.h"
#include <pthread.h>
#include "../../examples/user_laws/laws.c"

static finshell_status status;

static void refused(int32_t code, const char *word, int line)
{
   check(code == FINSHELL_INVALID_ARGUMENT && status.code == code, word, line);
   if (!strstr(status.message, word)) check(0, status.message, line);
   memset(&status, 0x55, sizeof status);
}
#define REFUSED(call, word) refused((call), (word), __LINE__)

/* ------------------------------------------------------------------ laws that are built in as well */

/* W = mu/2 (tr C + 1/det C - 3), in the plane */
static void plane_rubber(const finshell_points *at, const double *p, const double *e, double *w, double *s, double *d,
                         const double *begin, double *end, int32_t *codes)
{
   const int32_t n = at->n;
   const double mu = p[0];
   (void)begin, (void)end;
   for (int32_t i = 0; i < n; i++) {
      const double a1 = 1 + 2*e[n + i], a2 = 1 + 2*e[i], a3 = -e[2*n + i], det = a1*a2 - a3*a3;
      const int fine = det > 1e-12 && a1 + a2 > 0 && det < 1e40;
      const double c = 1/(fine ? det : 1), k = 4*mu*c*c*c, g = 2*mu*c*c;
      const double trace = 2*(e[i] + e[n + i]), q = 4*e[i]*e[n + i] - a3*a3;
      codes[i] = fine ? 0 : FINSHELL_MATERIAL_LIMIT;
      w[i] = 0.5*mu*(trace*trace + (trace - 1)*q)*c;
      w[i] = 0.5*mu*(trace - (trace + q)*c);
      s[i] = mu*(1 - c*c*a1);
      s[n + i] = mu*(1 - c*c*a2);
      s[2*n + i] = -mu*c*c*a3;
      d[i] = k*a1*a1;
      d[n + i] = k*a2*a2;
      d[2*n + i] = k*a3*a3 + 0.5*g;
      d[3*n + i] = k*a1*a2 - g;
      d[4*n + i] = k*a1*a3;
      d[5*n + i] = k*a2*a3;
   }
}

/* W = mu/2 (tr C - 3), incompressible, in space */
static void solid_rubber(const finshell_points *at, const double *p, const double *e, double *w, double *s, double *d,
                         const double *begin, double *end, int32_t *codes)
{
   const int32_t n = at->n;
   (void)begin, (void)end, (void)codes;
   for (int32_t i = 0; i < n; i++) {
      w[i] = p[0]*(e[i] + e[n + i] + e[2*n + i]);
      s[i] = s[n + i] = s[2*n + i] = p[0];
      s[3*n + i] = 0;
      for (int k = 0; k < 10; k++) d[k*n + i] = 0;
   }
}

/* W = mu/2 (tr C - 3 - 2 ln J) + lambda/2 (ln J)^2, in space: S = mu (I - C^-1) + lambda ln J C^-1 */
static void foam(const finshell_points *at, const double *p, const double *e, double *w, double *s, double *d, const double *begin,
                 double *end, int32_t *codes)
{
   static const int row[10] = {0, 1, 2, 3, 0, 0, 0, 1, 1, 2}, column[10] = {0, 1, 2, 3, 1, 2, 3, 2, 3, 3};
   const int32_t n = at->n;
   const double mu = p[0], lambda = p[1];
   (void)begin, (void)end;
   for (int32_t i = 0; i < n; i++) {
      const double c1 = 1 + 2*e[i], c2 = 1 + 2*e[n + i], c3 = 1 + 2*e[2*n + i], c4 = e[3*n + i], det = c1*c2 - c4*c4;
      if (!(det > 0 && c1 > 0 && c3 > 0)) {
         codes[i] = FINSHELL_MATERIAL_LIMIT;
         continue;
      }
      {
         const double inverse[4] = {c2/det, c1/det, 1/c3, -c4/det}, j = 0.5*log(det*c3), m = mu - lambda*j;
         w[i] = mu*(e[i] + e[n + i] + e[2*n + i]) - mu*j + 0.5*lambda*j*j;
         for (int k = 0; k < 4; k++) s[k*n + i] = (k < 3)*mu - m*inverse[k];
         for (int k = 0; k < 10; k++) {
            const int r = row[k], c = column[k];
            /* C^-1 (.) C^-1 in these components */
            double product = inverse[r]*inverse[c];
            if (r < 2 && c < 2 && r != c) product = inverse[3]*inverse[3];
            if (r < 2 && c == 3) product = inverse[r]*inverse[3];
            if (r == 3 && c == 3) product = 0.5*(inverse[0]*inverse[1] + inverse[3]*inverse[3]);
            if ((r == 2) != (c == 2)) product = 0;
            d[k*n + i] = lambda*inverse[r]*inverse[c] + 2*m*product;
         }
      }
   }
}

/* ------------------------------------------------------------------ laws that fail */
static void says_nan(const finshell_points *at, const double *p, const double *e, double *w, double *s, double *d,
                     const double *begin, double *end, int32_t *codes)
{
   plane_rubber(at, p, e, w, s, d, begin, end, codes);
   for (int32_t i = 0; i < at->n; i++)
      if (e[i] > 0.1) d[i] = NAN;
}

static void wrong_tangent(const finshell_points *at, const double *p, const double *e, double *w, double *s, double *d,
                          const double *begin, double *end, int32_t *codes)
{
   plane_rubber(at, p, e, w, s, d, begin, end, codes);
   for (int32_t i = 0; i < at->n; i++) d[3*at->n + i] *= 1 + 10*e[i]*e[i];
}

static void never(const finshell_points *at, const double *p, const double *e, double *w, double *s, double *d, const double *begin,
                  double *end, int32_t *codes)
{
   plane_rubber(at, p, e, w, s, d, begin, end, codes);
   for (int32_t i = 0; i < at->n; i++) codes[i] = 7;
}

static void nothing(const finshell_points *at, const double *p, const double *e, double *w, double *s, double *d,
                    const double *begin, double *end, int32_t *codes)
{
   (void)p, (void)e, (void)begin, (void)end, (void)codes;
   memset(w, 0, sizeof *w*at->n);
   memset(s, 0, 3*sizeof *s*at->n);
   memset(d, 0, 6*sizeof *d*at->n);
}

static const finshell_parameter mu[] = {{"mu", "shear modulus", 0, 100, 1, 0}};
static const finshell_parameter mu_lambda[] = {{"mu", "", 0, 100, 1, 0}, {"lambda", "", 0, 150, 1, 0}};

static finshell_law law_of(finshell_law_function evaluate, int32_t kind, int32_t parameters, const finshell_parameter *parameter)
{
   finshell_law law = {0};
   law.size = sizeof law;
   law.name = "mine";
   law.kind = kind;
   law.isotropic = 1;
   law.parameters = parameters;
   law.parameter = parameter;
   law.evaluate = evaluate;
   return law;
}

/* One layer of it. */
static finshell_section *sheet_of(const finshell_law *law, const double *values)
{
   const char *names[20];
   finshell_section_builder *b = begin();
   finshell_section *section = NULL;
   for (int32_t i = 0; i < law->parameters; i++) names[i] = law->parameter[i].name;
   finshell_builder_layer(b, 0.1, 20, 0, 0, NULL);
   finshell_builder_own_law(b, law, law->parameters, names, values, &status);
   finshell_builder_build(b, &section, &status);
   finshell_builder_destroy(b);
   return section;
}

enum { N = 13 };
static double energy[2][N], force[2][N][18], tangent[2][N][18][18];

/* Both sections say the same of a patch, in parts of the greatest number. */
static void agree(finshell_section *mine, finshell_section *theirs, double tolerance, int line)
{
   patch p = new_patch(N, 5);
   finshell_elements b = block_of(p, FINSHELL_ROTATION_QUATERNION, p.normals);
   finshell_section *both[2];
   double most[3] = {0, 0, 0}, off[3] = {0, 0, 0};
   both[0] = mine;
   both[1] = theirs;
   check(mine != NULL && theirs != NULL, "sections", line);
   for (int k = 0; k < 2; k++)
      check(finshell_elements_evaluate(both[k], &b, energy[k], &force[k][0][0], &tangent[k][0][0][0], NULL, &status) == 0,
            status.message, line);
   for (int e = 0; e < N; e++) {
      off[0] = fmax(off[0], fabs(energy[0][e] - energy[1][e]));
      most[0] = fmax(most[0], fabs(energy[1][e]));
      for (int i = 0; i < 18; i++) {
         off[1] = fmax(off[1], fabs(force[0][e][i] - force[1][e][i]));
         most[1] = fmax(most[1], fabs(force[1][e][i]));
         for (int j = 0; j < 18; j++) {
            off[2] = fmax(off[2], fabs(tangent[0][e][i][j] - tangent[1][e][i][j]));
            most[2] = fmax(most[2], fabs(tangent[1][e][i][j]));
         }
      }
   }
   for (int k = 0; k < 3; k++) check_close(off[k]/most[k], 0, tolerance, "both the same", line);
   finshell_section_destroy(mine);
   finshell_section_destroy(theirs);
   free_patch(p);
}

static void same_formula(void)
{
   const char *names[] = {"mu", "lambda"};
   const double values[] = {100, 150};
   finshell_law law = law_of(plane_rubber, FINSHELL_LAW_PLANE, 1, mu);
   finshell_section *theirs = NULL;
   CHECK(finshell_section_create("neo_hookean", 1, names, values, 0.1, 0, NULL, NULL, &theirs, NULL) == 0);
   agree(sheet_of(&law, values), theirs, 1e-12, __LINE__);
   law = law_of(solid_rubber, FINSHELL_LAW_INCOMPRESSIBLE, 1, mu);
   CHECK(finshell_section_create("neo_hookean", 1, names, values, 0.1, 0, NULL, NULL, &theirs, NULL) == 0);
   agree(sheet_of(&law, values), theirs, 1e-12, __LINE__);
   law = law_of(foam, FINSHELL_LAW_SOLID, 2, mu_lambda);
   CHECK(finshell_section_create("compressible_neo_hookean", 2, names, values, 0.1, 0, NULL, NULL, &theirs, NULL) == 0);
   agree(sheet_of(&law, values), theirs, 1e-9, __LINE__); /* the tangent has differences of the thickness stretch */
   law.isotropic = 0;
   CHECK(finshell_section_create("compressible_neo_hookean", 2, names, values, 0.1, 0, NULL, NULL, &theirs, NULL) == 0);
   agree(sheet_of(&law, values), theirs, 1e-9, __LINE__);
}

/* ------------------------------------------------------------------ states */

/* A unit triangle in the plane, stretched by `a` along x. */
static finshell_elements stretched(double *X, double *u, double *rotations, double a)
{
   static const double corner[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
   finshell_elements b = {0};
   memset(rotations, 0, 9*sizeof *rotations);
   for (int i = 0; i < 9; i++) {
      X[i] = corner[i];
      u[i] = i % 3 == 0 ? (a - 1)*corner[i] : 0;
   }
   b.size = sizeof b;
   b.n = 1;
   b.convention = FINSHELL_ROTATION_VECTOR;
   b.threads = 1;
   b.X = X;
   b.u = u;
   b.rotations = rotations;
   return b;
}

/* Stretched at once and held, then in 40 steps of different lengths: N(t)/N(0) = 1 - g + g exp(-t/tau) exactly, whatever the steps. */
static void relaxation(void)
{
   const double values[] = {1000, 0.3, 0.6, 2}, a = 1.2;
   double X[9], u[9], r[9], begin_of[200], end_of[200], membrane[3], stress[9], first[3] = {0, 0, 0}, surface = 0, held[18], t = 0;
   finshell_section *s = sheet_of(&laws[2], values);
   finshell_elements b = stretched(X, u, r, a);
   int32_t place, points, variables;
   const double e11 = 0.5*(a*a - 1), e1 = 1000/(1 - 0.09)*e11;
   CHECK(s != NULL && finshell_section_states(s, &status) == 3*3*6 && status.code == 0);
   CHECK(finshell_section_layer_states(s, 0, &place, &points, &variables, &status) == 0);
   CHECK(place == 0 && points == 3 && variables == 6);
   REFUSED(finshell_section_layer_states(s, 1, NULL, NULL, NULL, &status), "layer is 1, expected 0 to one less");
   memset(begin_of, 0, sizeof begin_of);
   memset(end_of, 0x55, sizeof end_of);
   REFUSED(finshell_elements_evaluate(s, &b, NULL, NULL, NULL, NULL, &status), "states_begin is NULL, and the laws of the section have 54");
   b.states_begin = begin_of;
   b.states_end = begin_of;
   REFUSED(finshell_elements_evaluate(s, &b, NULL, NULL, NULL, NULL, &status), "states_end is states_begin");
   b.states_end = end_of;
   b.time_step = -1;
   REFUSED(finshell_elements_evaluate(s, &b, NULL, NULL, NULL, NULL, &status), "time_step is no number >= 0");
   b.time_step = 0;
   b.time = INFINITY;
   REFUSED(finshell_elements_evaluate(s, &b, NULL, NULL, NULL, NULL, &status), "time is no finite number");
   b.time = 0;
   for (int step = 0; step <= 40; step++) {
      const double left = 0.4 + 0.6*exp(-t/2);
      CHECK(finshell_elements_recover(s, &b, NULL, membrane, NULL, stress, NULL, &status) == 0);
      CHECK(finshell_elements_evaluate(s, &b, NULL, held, NULL, NULL, &status) == 0);
      if (step == 0) {
         memcpy(first, membrane, sizeof first);
         surface = stress[6]; /* 11 on top */
         CHECK_CLOSE(membrane[0], 0.1*e1, 1e-12*e1);
         CHECK_CLOSE(membrane[1], 0.1*0.3*e1, 1e-12*e1);
      }
      CHECK_CLOSE(membrane[0]/first[0], left, 1e-12);
      CHECK_CLOSE(membrane[1]/first[1], left, 1e-12);
      CHECK_CLOSE(stress[6]/surface, left, 1e-12);
      CHECK_CLOSE(held[6]/(0.5*a*first[0]), left, 1e-12); /* node 2, along x */
      /* asked again, nothing has moved; accepted, it has */
      if (step == 20) {
         double again[18], other[200];
         b.states_end = other;
         CHECK(finshell_elements_evaluate(s, &b, NULL, again, NULL, NULL, &status) == 0);
         CHECK(memcmp(again, held, sizeof held) == 0 && memcmp(other, end_of, 54*sizeof *other) == 0);
         b.states_end = end_of;
      }
      memcpy(begin_of, end_of, sizeof begin_of);
      b.time_step = 0.02*(1 + step % 7);
      t += b.time_step;
      b.time = t;
   }
   /* an element that fails keeps its states; NaN among them is told */
   u[3] = -1.5;
   begin_of[3] = 0.25;
   CHECK(finshell_elements_evaluate(s, &b, NULL, held, NULL, NULL, &status) > 0);
   CHECK(memcmp(begin_of, end_of, 54*sizeof *begin_of) == 0);
   u[3] = 0.2;
   begin_of[3] = NAN;
   CHECK(finshell_elements_evaluate(s, &b, NULL, held, NULL, NULL, &status) == FINSHELL_NOT_A_NUMBER && held[6] == 0);
   finshell_section_destroy(s);
}

/* Bending: with the same states at the surface as between the points, stresses there relax the same. */
static void bent(void)
{
   const double values[] = {1000, 0.3, 0.6, 2};
   double X[9], u[9], r[9], begin_of[200], end_of[200], stress[9], first[9], moment[2][3];
   finshell_section *s = sheet_of(&laws[2], values);
   finshell_elements b = stretched(X, u, r, 1);
   memset(begin_of, 0, sizeof begin_of);
   r[4] = 0.1; /* node 2 about y */
   b.states_begin = begin_of;
   b.states_end = end_of;
   CHECK(finshell_elements_recover(s, &b, NULL, NULL, moment[0], first, NULL, &status) == 0);
   CHECK(finshell_elements_evaluate(s, &b, NULL, NULL, tangent[0][0][0], NULL, &status) == 0);
   b.states_begin = end_of;
   b.states_end = NULL;
   b.time_step = 3;
   CHECK(finshell_elements_recover(s, &b, NULL, NULL, moment[1], stress, NULL, &status) == 0);
   CHECK(fabs(moment[0][0]) > 1e-3);
   CHECK_CLOSE(moment[1][0]/moment[0][0], 0.4 + 0.6*exp(-1.5), 1e-10);
   CHECK_CLOSE(stress[0]/first[0], 0.4 + 0.6*exp(-1.5), 1e-4);
   CHECK_CLOSE(stress[6]/first[6], 0.4 + 0.6*exp(-1.5), 1e-4);
   finshell_section_destroy(s);
}

/* The tangent with states: the derivative of the force at the end of a step. In many threads at once. */
static void *tangent_of_a_step(void *section)
{
   enum { n = 11 };
   finshell_section *s = section;
   patch p = new_patch(n, 8);
   finshell_elements b = block_of(p, FINSHELL_ROTATION_VECTOR, NULL);
   static const double h = 1e-6;
   double (*f)[18] = malloc(3*n*sizeof *f), (*k)[18][18] = malloc(n*sizeof *k), *states = calloc(2*n*54, sizeof *states), off = 0;
   finshell_status mine;
   b.states_begin = states;
   b.states_end = states + n*54;
   b.time_step = 0.5;
   int fine = finshell_elements_evaluate(s, &b, NULL, &f[0][0], NULL, NULL, &mine) == 0;
   for (int i = 0; i < 9*n; i++) p.u[i] += 0.01*((i*7) % 5 - 2);
   b.states_begin = states + n*54;
   b.states_end = NULL;
   fine = fine && finshell_elements_evaluate(s, &b, NULL, &f[0][0], &k[0][0][0], NULL, &mine) == 0;
   for (int j = 0; fine && j < 18; j++) {
      double *x = (j/3) % 2 ? p.vector : p.u;
      for (int side = 0; side < 2; side++) {
         for (int e = 0; e < n; e++) x[9*e + 3*(j/6) + j % 3] += side ? -2*h : h;
         fine = fine && finshell_elements_evaluate(s, &b, NULL, &f[(1 + side)*n][0], NULL, NULL, &mine) == 0;
      }
      for (int e = 0; e < n; e++) {
         x[9*e + 3*(j/6) + j % 3] += h;
         for (int i = 0; i < 18; i++) off = fmax(off, fabs((f[n + e][i] - f[2*n + e][i])/(2*h) - k[e][i][j]));
      }
   }
   free(f);
   free(k);
   free(states);
   free_patch(p);
   return fine && off < 1e-4 ? section : NULL;
}

static void threads(void)
{
   const double values[] = {1000, 0.3, 0.6, 2};
   finshell_section *s = sheet_of(&laws[2], values);
   pthread_t thread[8];
   void *fine;
   for (int i = 0; i < 8; i++) CHECK(pthread_create(thread + i, NULL, tangent_of_a_step, s) == 0);
   for (int i = 0; i < 8; i++) CHECK(pthread_join(thread[i], &fine) == 0 && fine == s);
   finshell_section_destroy(s);
}

/* ------------------------------------------------------------------ what is refused */
static void failing(void)
{
   const double values[] = {100};
   double X[18], u[18], r[18], f[2][18];
   int32_t codes[2];
   finshell_law law = law_of(says_nan, FINSHELL_LAW_PLANE, 1, mu);
   finshell_section *s = sheet_of(&law, values);
   finshell_elements b = stretched(X, u, r, 1.02);
   stretched(X + 9, u + 9, r + 9, 1.2);
   b.n = 2;
   CHECK(finshell_elements_evaluate(s, &b, NULL, &f[0][0], &tangent[0][0][0][0], codes, &status) == FINSHELL_MATERIAL_LIMIT);
   CHECK(codes[0] == 0 && codes[1] == FINSHELL_MATERIAL_LIMIT && status.index == 1 && f[0][6] > 0 && f[1][6] == 0);
   finshell_section_destroy(s);
}

static void refuses(finshell_law law, const double *values, const char *word, int line)
{
   finshell_section *s = sheet_of(&law, values);
   check(s == NULL, "no section", line);
   refused(status.code, word, line);
}
#define REFUSES(law, word) refuses((law), values, (word), __LINE__)

static void descriptions(void)
{
   const double values[] = {100, 150};
   static const finshell_parameter twice[] = {{"mu", "", 0, 1, 1, 0}, {"MU", "", 0, 1, 1, 0}}, unnamed[] = {{"", "", 0, 1, 1, 0}};
   const finshell_law good = law_of(plane_rubber, FINSHELL_LAW_PLANE, 1, mu);
   finshell_law law = good;
   finshell_section_builder *b = begin();
   const char *other[] = {"nu"};
   law.size = 0;
   REFUSES(law, "law->size is not set");
   law.size = sizeof law + 8;
   REFUSES(law, "with members that this library does not know");
   law = good;
   law.name = "";
   REFUSES(law, "the name of a law has 0 characters, expected 1 to 31");
   law.name = "a name that is by far too long to be one";
   REFUSES(law, "characters, expected 1 to 31");
   law = good;
   law.kind = 4;
   REFUSES(law, "law 'mine': kind is 4, expected 1 (plane), 2 (solid) or 3 (incompressible)");
   law = good;
   law.states = 1001;
   REFUSES(law, "states is 1001, expected 0 to 1000");
   law = good;
   law.parameters = -1;
   law.parameter = NULL;
   REFUSES(law, "parameters is -1");
   law = good;
   law.evaluate = NULL;
   REFUSES(law, "evaluate is NULL");
   law = law_of(foam, FINSHELL_LAW_SOLID, 2, mu_lambda);
   law.stretch = thinner;
   REFUSES(law, "stretch is for laws in the plane only");
   REFUSES(law_of(plane_rubber, FINSHELL_LAW_PLANE, 2, twice), "parameter 'mu' is there twice");
   REFUSES(law_of(plane_rubber, FINSHELL_LAW_PLANE, 1, unnamed), "parameter 0 (from 0) has no name");
   REFUSES(law_of(never, FINSHELL_LAW_PLANE, 1, mu), "material law 'mine': it cannot be evaluated at rest, where strains are 0: it returns a code, or a number that is not finite");
   REFUSES(law_of(nothing, FINSHELL_LAW_PLANE, 1, mu), "its tangent at rest is not positive definite");
   REFUSED(finshell_builder_own_law(NULL, &good, 1, other, values, &status), "builder is NULL");
   finshell_builder_layer(b, 1, 0, 0, 0, NULL);
   REFUSED(finshell_builder_own_law(b, &good, 1, other, values, &status), "layer 1: material law 'mine': unknown parameter 'nu'; the law takes mu");
   finshell_builder_destroy(b);
   b = begin();
   finshell_builder_layer(b, 1, 0, 0, 0, NULL);
   REFUSED(finshell_builder_own_law(b, NULL, 0, NULL, NULL, &status), "law is NULL");
   finshell_builder_destroy(b);
   law = good;
   law.parameter = NULL;
   REFUSED(finshell_law_check(&law, NULL, 0, NULL, NULL, NULL, &status), "parameter is NULL, expected an array of 1");
   REFUSED(finshell_law_check(NULL, NULL, 0, NULL, NULL, NULL, &status), "law and material are NULL");
   REFUSED(finshell_law_check(NULL, "plugin:", 0, NULL, NULL, NULL, &status), "names no library");
   REFUSED(finshell_law_check(NULL, "plugin:/nowhere.so#x", 0, NULL, NULL, NULL, &status), "library of laws '/nowhere.so': it cannot be loaded");
   REFUSED(finshell_law_check(NULL, "plugin:libm.so.6", 0, NULL, NULL, NULL, &status), "it has no function finshell_law_1");
   /* a membrane keeps no states */
   {
      const char *names[] = {"e", "g", "tau"};
      const double numbers[] = {1000, 0.6, 2};
      finshell_section *s = NULL;
      b = begin();
      finshell_builder_layer(b, 1, 0, 0, 0, NULL);
      finshell_builder_own_law(b, &laws[2], 3, names, numbers, NULL);
      finshell_builder_option(b, "membrane", 1, NULL);
      REFUSED(finshell_builder_build(b, &s, &status), "a membrane takes no law with states, as 'prony' is");
      finshell_builder_destroy(b);
   }
}

/* ------------------------------------------------------------------ the checker */
static void checked(void)
{
   finshell_law_finding f[FINSHELL_LAW_FINDINGS];
   const char *names[] = {"mu", "lambda"};
   const double values[] = {100, 150};
   finshell_law law = law_of(wrong_tangent, FINSHELL_LAW_PLANE, 1, mu);
   CHECK(finshell_law_check(&law, NULL, 1, names, values, f, &status) == FINSHELL_MATERIAL_LIMIT);
   CHECK(status.failed == 1 && strstr(status.message, "tangent against the derivative of the stress") != NULL);
   for (int i = 0; i < FINSHELL_LAW_FINDINGS; i++) CHECK(f[i].passed == (strcmp(f[i].name, "tangent") != 0));
   law = law_of(says_nan, FINSHELL_LAW_PLANE, 1, mu);
   CHECK(finshell_law_check(&law, NULL, 1, names, values, f, &status) == FINSHELL_MATERIAL_LIMIT && status.failed == 1);
   for (int i = 0; i < FINSHELL_LAW_FINDINGS; i++) CHECK(f[i].passed == (strcmp(f[i].name, "levels") != 0)); /* no tangent, but a stress */
   law = law_of(plane_rubber, FINSHELL_LAW_PLANE, 1, mu);
   CHECK(finshell_law_check(&law, NULL, 1, names, values, f, &status) == 0 && status.code == 0 && status.failed == 0);
   law = law_of(foam, FINSHELL_LAW_SOLID, 2, mu_lambda);
   CHECK(finshell_law_check(&law, NULL, 2, names, values, f, &status) == 0);
   for (int i = 0; i < 3; i++) {
      const char *list[4];
      double numbers[4];
      for (int32_t k = 0; k < laws[i].parameters; k++) {
         list[k] = laws[i].parameter[k].name;
         numbers[k] = laws[i].parameter[k].example;
      }
      CHECK(finshell_law_check(laws + i, NULL, laws[i].parameters, list, numbers, f, &status) == 0);
      if (status.code) check(0, status.message, __LINE__);
   }
   CHECK(finshell_law_check(NULL, "compressible_neo_hookean", 2, names, values, f, NULL) == 0);
}

int main(void)
{
   silence();
   same_formula();
   relaxation();
   bent();
   threads();
   failing();
   descriptions();
   checked();
   return finish();
}
