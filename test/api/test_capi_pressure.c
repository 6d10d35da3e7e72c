/* Pressure on the elements of a block: on facets the numbers of finshell_pressure_load, on curved ones the derivative of the volume,
 * the volume of a sphere; what is refused, and what fails. */
#define _POSIX_C_SOURCE 200809L
#include "check.h"

static finshell_status status;
static const double origin[3] = {0.3, -0.2, 0.1};
enum { n = 20 };

static void refused(int32_t code, const char *word, int line)
{
   check(code == FINSHELL_INVALID_ARGUMENT && status.code == code && status.index == -1 && status.failed == 0, word, line);
   if (!strstr(status.message, word)) check(0, status.message, line);
}
#define REFUSED(call, word) refused((call), (word), __LINE__)

/* Without normals, with those of the facets, and for facets among curved elements. */
static void facets(void)
{
   patch p = new_patch(n, 3);
   double pressure[n], f[n][9], k[n][9][9], force[n][18], stiffness[n][18][18], volume[n];
   for (int e = 0; e < n; e++) pressure[e] = 3.5 - e;
   for (int form = 0; form < 2; form++)
      for (int convention = 1; convention <= 3; convention++)
         for (int kind = 0; kind < 3; kind++) {
            double *mixed = malloc(sizeof(double) * 9 * n);
            memcpy(mixed, p.normals, sizeof(double) * 9 * n);
            for (int e = 0; e < n; e += 2) memcpy(mixed + 9 * e, p.facets + 9 * e, sizeof(double) * 9);
            finshell_elements b = block_of(p, convention, kind == 0 ? NULL : kind == 1 ? p.facets : mixed);
            CHECK(finshell_pressure_load(n, pressure, p.X, p.u, form, origin, f[0], k[0][0], NULL, NULL) == 0);
            CHECK(finshell_elements_pressure(&b, pressure, form, origin, volume, force[0], stiffness[0][0], NULL, &status) == 0);
            for (int e = 0; e < n; e++)
               for (int i = 0; i < 18; i++) {
                  int at = 3 * (i / 6) + i % 6, flat = kind < 2 || e % 2 == 0;
                  if (i % 6 > 2)
                     CHECK((force[e][i] == 0) == flat);
                  else if (flat)
                     CHECK(force[e][i] == f[e][at]);
                  for (int j = 0; j < 18; j++) {
                     if (!flat) continue;
                     if (i % 6 > 2 || j % 6 > 2)
                        CHECK(stiffness[e][i][j] == 0);
                     else /* by rows here, by columns there */
                        CHECK(stiffness[e][i][j] == k[e][3 * (j / 6) + j % 6][at]);
                  }
               }
            free(mixed);
         }
   free_patch(p);
}

/* Force and stiffness by differences. The symmetric form: the gradient of pressure times volume. */
static void derivatives(void)
{
   static const double step = 1e-5;
   for (int form = 0; form < 2; form++)
      for (int convention = 1; convention <= 3; convention += 2) {
         patch p = new_patch(n, 29);
         double pressure[n], volume[2][n], force[n][18], moved[2][n][18], stiffness[n][18][18], state[12 * n] = {0}, couples = 0;
         finshell_elements b = block_of(p, convention, p.normals);
         const int32_t straight[n][3] = {{0, 0, 0}, {1, 1, 1}, {2, 0, 0}, {1, 2, 0}, {0, 0, 2}, {2, 2, 0}};
         b.straight = straight[0];
         for (int i = 0; i < 3 * n; i++) state[4 * i] = 1, state[4 * i + 1] = 0.02 * (i % 5);
         b.state = state;
         for (int e = 0; e < n; e++) pressure[e] = e - 3.5;
         CHECK(finshell_elements_pressure(&b, pressure, form, origin, NULL, force[0], stiffness[0][0], NULL, &status) == 0);
         for (int j = 0; j < 18; j++) {
            double *moving = j % 6 < 3 ? p.u : p.vector;
            int at = 3 * (j / 6) + j % 3;
            for (int side = 0; side < 2; side++) {
               for (int e = 0; e < n; e++) moving[9 * e + at] += (side ? -2 : 1) * step;
               CHECK(finshell_elements_pressure(&b, pressure, form, origin, volume[side], moved[side][0], NULL, NULL, NULL) == 0);
            }
            for (int e = 0; e < n; e++) {
               moving[9 * e + at] += step;
               if (form == 1) CHECK_CLOSE(pressure[e] * (volume[0][e] - volume[1][e]) / (2 * step), force[e][j], 1e-8);
               for (int i = 0; i < 18; i++) {
                  CHECK_CLOSE((moved[0][e][i] - moved[1][e][i]) / (2 * step), stiffness[e][i][j], 1e-8);
                  if (form == 1) CHECK_CLOSE(stiffness[e][i][j], stiffness[e][j][i], 1e-13);
               }
               if (j % 6 > 2) couples = fmax(couples, fabs(force[e][j]));
            }
         }
         CHECK(couples > 0.01);
         free_patch(p);
      }
}

/* Of the sides only those that slopes do not bend change the cap: on three of them there is none. */
static void sides(void)
{
   patch p = new_patch(n, 37);
   double pressure[n], free_sides[n], held[n], flat[n];
   int32_t straight[n][3];
   finshell_elements b = block_of(p, FINSHELL_ROTATION_VECTOR, NULL);
   for (int e = 0; e < n; e++) {
      pressure[e] = 1;
      for (int k = 0; k < 3; k++) straight[e][k] = e < 5 ? 1 : e < 10 ? 2 : k == e % 3 ? 2 : 0;
   }
   CHECK(finshell_elements_pressure(&b, pressure, 0, origin, flat, NULL, NULL, NULL, NULL) == 0);
   b.normals = p.normals;
   CHECK(finshell_elements_pressure(&b, pressure, 0, origin, free_sides, NULL, NULL, NULL, NULL) == 0);
   b.straight = straight[0];
   CHECK(finshell_elements_pressure(&b, pressure, 0, origin, held, NULL, NULL, NULL, NULL) == 0);
   for (int e = 0; e < n; e++) {
      CHECK((held[e] == free_sides[e]) == (e < 5));
      CHECK((held[e] == flat[e]) == (e >= 5 && e < 10));
   }
   free_patch(p);
}

/* Outputs one by one, batches and threads: the same bits. */
static void parts(void)
{
   patch p = new_patch(n, 31);
   double pressure[n], volume[2][n], force[2][n][18], stiffness[2][n][18][18];
   finshell_elements b = block_of(p, FINSHELL_ROTATION_VECTOR, p.normals), one = b;
   for (int e = 0; e < n; e++) pressure[e] = 1 + e;
   CHECK(finshell_elements_pressure(&b, pressure, 1, origin, volume[0], force[0][0], stiffness[0][0][0], NULL, NULL) == 0);
   CHECK(finshell_elements_pressure(&b, NULL, 1, origin, volume[1], NULL, NULL, NULL, NULL) == 0);
   CHECK(finshell_elements_pressure(&b, pressure, 1, origin, NULL, force[1][0], NULL, NULL, NULL) == 0);
   CHECK(finshell_elements_pressure(&b, pressure, 1, origin, NULL, NULL, stiffness[1][0][0], NULL, NULL) == 0);
   CHECK(memcmp(volume[0], volume[1], sizeof volume[0]) == 0 && memcmp(force[0], force[1], sizeof force[0]) == 0);
   CHECK(memcmp(stiffness[0], stiffness[1], sizeof stiffness[0]) == 0);
   memset(volume[1], 0, sizeof volume[1]);
   memset(force[1], 0, sizeof force[1]);
   memset(stiffness[1], 0, sizeof stiffness[1]);
   one.n = 1;
   one.threads = 2;
   for (int e = 0; e < n; e++) {
      one.X = p.X + 9 * e, one.u = p.u + 9 * e, one.rotations = p.vector + 9 * e, one.normals = p.normals + 9 * e;
      CHECK(finshell_elements_pressure(&one, pressure + e, 1, origin, volume[1] + e, force[1][e], stiffness[1][e][0], NULL, NULL) == 0);
   }
   CHECK(memcmp(volume[0], volume[1], sizeof volume[0]) == 0 && memcmp(force[0], force[1], sizeof force[0]) == 0);
   CHECK(memcmp(stiffness[0], stiffness[1], sizeof stiffness[0]) == 0);
   free_patch(p);
}

static void refusals(void)
{
   patch p = new_patch(3, 7);
   finshell_elements b = block_of(p, 1, p.normals), c;
   double pressure[3] = {1, 2, 3}, out[3][18] = {{7}}, volume[3] = {7};
   REFUSED(finshell_elements_pressure(NULL, pressure, 0, NULL, NULL, out[0], NULL, NULL, &status), "elements is NULL");
   REFUSED(finshell_elements_pressure(&b, NULL, 0, NULL, volume, out[0], NULL, NULL, &status), "pressure is NULL");
   REFUSED(finshell_elements_pressure(&b, pressure, 2, NULL, volume, out[0], NULL, NULL, &status), "form is 2");
   c = b, c.rotations = NULL;
   REFUSED(finshell_elements_pressure(&c, pressure, 0, NULL, volume, out[0], NULL, NULL, &status), "rotations is NULL");
   c = b, c.size = 3;
   REFUSED(finshell_elements_pressure(&c, pressure, 0, NULL, volume, out[0], NULL, NULL, &status), "size is 3");
   CHECK(strstr(status.message, "finshell_elements_pressure: ") == status.message && out[0][0] == 7 && volume[0] == 7);
   CHECK(finshell_elements_pressure(&b, pressure, 0, NULL, NULL, NULL, NULL, NULL, NULL) == 0);
   b.n = 0;
   CHECK(finshell_elements_pressure(&b, NULL, 0, NULL, volume, out[0], NULL, NULL, &status) == 0 && out[0][0] == 7);
   free_patch(p);
}

/* An element that fails has a code and zeros, the others the bits they have beside a sound one. */
static void failures_of_one(void)
{
   double pressure[n], volume[2][n], force[2][n][18], stiffness[2][n][18][18];
   for (int e = 0; e < n; e++) pressure[e] = 1 + e;
   for (int kind = 0; kind < 8; kind++) {
      static const int32_t expected[] = {-3, -3, -1, -2, 1, 3, 1, 0};
      patch p = new_patch(n, 13);
      finshell_elements b = block_of(p, FINSHELL_ROTATION_VECTOR, p.normals);
      int32_t codes[n];
      const int victim = 11;
      double *x = p.X + 9 * victim, *u = p.u + 9 * victim, kept = pressure[victim];
      memcpy(p.normals + 9 * 3, p.facets + 9 * 3, sizeof(double) * 9);
      memcpy(p.normals + 9 * 12, p.facets + 9 * 12, sizeof(double) * 9);
      CHECK(finshell_elements_pressure(&b, pressure, 0, NULL, volume[0], force[0][0], stiffness[0][0][0], NULL, NULL) == 0);
      for (int c = 0; c < 3; c++) {
         if (kind == 2) p.normals[9 * victim + 3 + c] = 0;
         if (kind == 3) x[6 + c] = x[c];
         if (kind == 4) u[6 + c] = u[c] + x[c] - x[6 + c];
         if (kind == 5) { /* half a turn about the normal, of one node */
            const double *f = p.facets + 9 * victim;
            p.vector[9 * victim + c] = acos(-1.0) * f[c] / sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
            for (int i = 0; i < 3; i++) u[3 * i + c] = 0;
         }
         if (kind == 6) for (int i = 0; i < 3; i++) x[3 * i + c] *= 1e59, u[3 * i + c] *= 1e170;
         /* without area, on a facet beside curved elements: nothing fails */
         if (kind == 7) p.u[9 * 12 + 6 + c] = p.u[9 * 12 + c] + p.X[9 * 12 + c] - p.X[9 * 12 + 6 + c];
      }
      if (kind == 0) pressure[victim] = NAN;
      if (kind == 1) p.vector[9 * victim] = INFINITY;
      int32_t code = finshell_elements_pressure(&b, pressure, 0, NULL, volume[1], force[1][0], stiffness[1][0][0], codes, &status);
      CHECK(code == expected[kind] && codes[victim] == expected[kind]);
      if (code != expected[kind]) fprintf(report, "kind %d: code %d, %s\n", kind, (int)code, status.message);
      if (kind == 2) CHECK(strstr(status.message, "finshell_elements_pressure: element 11 (from 0): the normal at node 1 (from 0) is zero"));
      for (int e = 0; e < n; e++) {
         if (e == victim && code != 0) {
            CHECK(volume[1][e] == 0);
            for (int i = 0; i < 18; i++) CHECK(force[1][e][i] == 0 && stiffness[1][e][i][i] == 0);
         } else if (kind < 7 || e != 12) {
            CHECK(volume[0][e] == volume[1][e] && memcmp(force[0][e], force[1][e], sizeof force[0][e]) == 0);
            CHECK(memcmp(stiffness[0][e], stiffness[1][e], sizeof stiffness[0][e]) == 0);
         }
      }
      pressure[victim] = kept;
      free_patch(p);
   }
}

/* A ball of radius 2 about (1, 2, 3), of a cube's faces with equal angles, seen from elsewhere. */
static void sphere(void)
{
   enum { most = 6 * 2 * 16 * 16 };
   static double X[most][3][3], normals[most][3][3], zero[most][3][3], volume[most], pressure[most], force[most][18];
   const double exact = 4 * acos(-1.0) / 3 * 8, centre[3] = {1, 2, 3}, elsewhere[3] = {-4, 0.5, 7};
   double error[3], facet[3];
   for (int level = 0; level < 3; level++) {
      int cells = 4 << level, e = 0;
      for (int axis = 0; axis < 3; axis++)
         for (int side = -1; side < 2; side += 2)
            for (int i = 0; i < cells; i++)
               for (int j = 0; j < cells; j++)
                  for (int half = 0; half < 2; half++, e++)
                     for (int k = 0; k < 3; k++) {
                        static const int corner[2][3][2] = {{{0, 0}, {1, 0}, {1, 1}}, {{0, 0}, {1, 1}, {0, 1}}};
                        const int *at = corner[half][side > 0 ? k : 2 - k];
                        double d[3], length = 0;
                        d[axis] = side;
                        d[(axis + 1) % 3] = tan(acos(-1.0) / 4 * (2.0 * (i + at[0]) / cells - 1));
                        d[(axis + 2) % 3] = tan(acos(-1.0) / 4 * (2.0 * (j + at[1]) / cells - 1));
                        for (int c = 0; c < 3; c++) length += d[c] * d[c];
                        for (int c = 0; c < 3; c++) {
                           normals[e][k][c] = d[c];
                           X[e][k][c] = centre[c] + 2 * d[c] / sqrt(length);
                        }
                     }
      finshell_elements b = {0};
      b.size = sizeof b;
      b.n = e;
      b.convention = b.threads = 1;
      b.X = X[0][0];
      b.u = b.rotations = zero[0][0];
      for (int with = 0; with < 2; with++) {
         double sum = 0;
         b.normals = with ? normals[0][0] : NULL;
         CHECK(finshell_elements_pressure(&b, NULL, 0, elsewhere, volume, NULL, NULL, NULL, &status) == 0);
         for (int i = 0; i < e; i++) sum += volume[i];
         (with ? error : facet)[level] = sum / exact - 1;
      }
      /* in equilibrium with itself: forces and moments vanish */
      double resultant[3] = {0}, moment[3] = {0};
      for (int i = 0; i < e; i++) pressure[i] = 1;
      CHECK(finshell_elements_pressure(&b, pressure, 0, NULL, NULL, force[0], NULL, NULL, &status) == 0);
      for (int i = 0; i < e; i++)
         for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++) {
               const double *x = X[i][k], *f = force[i] + 6 * k;
               resultant[c] += f[c];
               moment[c] += f[3 + c] + x[(c + 1) % 3] * f[(c + 2) % 3] - x[(c + 2) % 3] * f[(c + 1) % 3];
            }
      for (int c = 0; c < 3; c++) {
         CHECK_CLOSE(resultant[c], 0, 1e-12);
         CHECK_CLOSE(moment[c], 0, 1e-12);
      }
   }
   CHECK(fabs(error[2]) < 2e-5 && fabs(facet[2]) > 3e-3);
   CHECK(error[0] / error[1] > 14 && error[1] / error[2] > 14);
   fprintf(report, "sphere: volume %+.2e %+.2e %+.2e, of the facets %+.2e %+.2e %+.2e\n", error[0], error[1], error[2], facet[0], facet[1],
           facet[2]);
}

int main(void)
{
   silence();
   facets();
   derivatives();
   sides();
   parts();
   refusals();
   failures_of_one();
   sphere();
   return finish();
}
