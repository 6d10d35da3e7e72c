/* What the tests of the C interface share: checks that count, and a curved, stretched, twisted patch of elements. */
#ifndef CHECK_H
#define CHECK_H

#include <finshell.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int checks = 0, failures = 0;
static FILE *report; /* where standard output was before `silence` */
static FILE *caught;

#define CHECK(condition) check((condition) != 0, #condition, __LINE__)
#define CHECK_CLOSE(a, b, tolerance) check_close((a), (b), (tolerance), #a " = " #b, __LINE__)

static inline void check(int holds, const char *text, int line)
{
   checks++;
   if (holds) return;
   failures++;
   fprintf(report, "line %d: %s\n", line, text);
}

static inline void check_close(double a, double b, double tolerance, const char *text, int line)
{
   checks++;
   if (fabs(a - b) <= tolerance) return;
   failures++;
   fprintf(report, "line %d: %s: %.16g, %.16g\n", line, text, a, b);
}

/* What was printed, when something else than `finish` ends the program. */
static int finished = 0;

static inline void show_caught(void)
{
   char text[400] = "";
   if (finished) return;
   fflush(stdout);
   rewind(caught);
   if (fread(text, 1, sizeof text - 1, caught) > 0) fprintf(report, "ended after printing: %s\n", text);
   fflush(report);
}

/* From here on, what anything prints lands in a file. */
static inline void silence(void)
{
   report = fdopen(dup(1), "w");
   caught = tmpfile();
   atexit(show_caught);
   if (!report || !caught || dup2(fileno(caught), 1) < 0 || dup2(fileno(caught), 2) < 0) abort();
}

/* Nothing was printed; number of failures as exit code. */
static inline int finish(void)
{
   char text[200] = "";
   fflush(stdout);
   fflush(stderr);
   rewind(caught);
   size_t printed = fread(text, 1, sizeof text - 1, caught);
   CHECK(printed == 0);
   if (printed) fprintf(report, "printed: %s\n", text);
   fprintf(report, "%d checks, %d failures\n", checks, failures);
   fflush(report);
   finished = 1;
   return failures > 0;
}

/* n elements in a random state: reference triangles near the unit triangle, displacements, rotations not far from those of the
 * element; caller frees. */
typedef struct {
   int32_t n;
   double *X, *u, *vector, *quaternion, *direction; /* [n][3][3], [n][3][3], [n][3][3], [n][3][4], [n][3] */
   double *toward;                                  /* [n][18] displacements and spins */
   double *thickness, *offset, *growth;             /* [n], [n], [n][layers][4] for up to three layers */
   double *normals, *facets; /* [n][3][3] of a curved surface: to some 20 degrees from the facets', of any length; of the facets */
} patch;

static inline double noise(uint32_t *seed)
{
   *seed = *seed * 1664525u + 1013904223u;
   return (double)(*seed >> 8) / 16777216.0 - 0.5;
}

static inline patch new_patch(int32_t n, uint32_t seed)
{
   static const double corner[3][2] = {{0, 0}, {1, 0}, {0, 1}};
   patch p;
   p.n = n;
   p.X = malloc(sizeof(double) * 9 * n);
   p.u = malloc(sizeof(double) * 9 * n);
   p.vector = malloc(sizeof(double) * 9 * n);
   p.quaternion = malloc(sizeof(double) * 12 * n);
   p.direction = malloc(sizeof(double) * 3 * n);
   p.toward = malloc(sizeof(double) * 18 * n);
   p.normals = malloc(sizeof(double) * 9 * n);
   p.facets = malloc(sizeof(double) * 9 * n);
   p.thickness = malloc(sizeof(double) * n);
   p.offset = malloc(sizeof(double) * n);
   p.growth = malloc(sizeof(double) * 12 * n);
   for (int32_t e = 0; e < n; e++) {
      double t[3], q[4], r[3][3];
      for (int c = 0; c < 3; c++) t[c] = 3 * noise(&seed);
      finshell_rotation_exp(1, t, q, NULL, NULL);
      finshell_rotation_matrix(1, q, &r[0][0], NULL, NULL);
      for (int i = 0; i < 3; i++) {
         double x[3], y[3];
         x[0] = corner[i][0] + 0.2 * noise(&seed);
         x[1] = corner[i][1] + 0.2 * noise(&seed);
         x[2] = 0.2 * noise(&seed);
         y[0] = 1.2 * x[0] + 0.1 * x[1] + 0.05 * noise(&seed);
         y[1] = 0.9 * x[1] + 0.05 * noise(&seed);
         y[2] = x[2] + 0.05 * noise(&seed);
         for (int c = 0; c < 3; c++) {
            p.X[9 * e + 3 * i + c] = x[c];
            p.u[9 * e + 3 * i + c] = r[c][0] * y[0] + r[c][1] * y[1] + r[c][2] * y[2] - x[c];
            p.vector[9 * e + 3 * i + c] = t[c] + 0.1 * noise(&seed);
         }
      }
      for (int c = 0; c < 3; c++) p.direction[3 * e + c] = 1 + noise(&seed);
      const double *x = p.X + 9 * e;
      uint32_t other = seed;
      for (int i = 0; i < 18; i++) p.toward[18 * e + i] = 0.01 * noise(&other);
      for (int c = 0; c < 3; c++) {
         int a = (c + 1) % 3, b = (c + 2) % 3;
         double normal = (x[3 + a] - x[a]) * (x[6 + b] - x[b]) - (x[3 + b] - x[b]) * (x[6 + a] - x[a]);
         for (int i = 0; i < 3; i++) {
            p.facets[9 * e + 3 * i + c] = (i + 1) * normal;
            p.normals[9 * e + 3 * i + c] = (i + 1) * (normal + 0.4 * noise(&other));
         }
      }
      p.thickness[e] = 0.1 + 0.05 * noise(&other);
      p.offset[e] = 0.05 * noise(&other);
      for (int i = 0; i < 12; i++) p.growth[12 * e + i] = 0.05 * noise(&other);
   }
   finshell_rotation_exp(3 * n, p.vector, p.quaternion, NULL, NULL);
   return p;
}

static inline void free_patch(patch p)
{
   free(p.X);
   free(p.u);
   free(p.vector);
   free(p.quaternion);
   free(p.direction);
   free(p.toward);
   free(p.normals);
   free(p.facets);
   free(p.thickness);
   free(p.offset);
   free(p.growth);
}

/* The patch as the block of a call. */
static inline finshell_elements block_of(patch p, int convention, const double *normals)
{
   finshell_elements b = {0};
   b.size = sizeof b;
   b.n = p.n;
   b.convention = convention;
   b.threads = 1;
   b.X = p.X;
   b.u = p.u;
   b.rotations = convention == FINSHELL_ROTATION_QUATERNION ? p.quaternion : p.vector;
   b.state = p.quaternion;
   b.direction = p.direction;
   b.normals = normals;
   return b;
}

/* A block in which the elements have thickness, offset and growth of their own. */
static inline finshell_elements with_own(finshell_elements b, patch p)
{
   b.thickness = p.thickness;
   b.offset = p.offset;
   b.growth = p.growth;
   return b;
}

/* A Mooney-Rivlin section, and an anisotropic one of three layers. */
static inline finshell_section *rubber(double thickness)
{
   const char *names[] = {"c10", "c01"}, *options[] = {"density"};
   const double values[] = {80, 20}, density[] = {2.5};
   finshell_section *section = NULL;
   CHECK(finshell_section_create("mooney_rivlin", 2, names, values, thickness, 1, options, density, &section, NULL) == 0);
   return section;
}

static inline finshell_section_builder *begin(void)
{
   finshell_section_builder *builder = NULL;
   CHECK(finshell_builder_begin(&builder, NULL) == 0 && builder != NULL);
   return builder;
}

/* The section of a builder, which goes. */
static inline finshell_section *built(finshell_section_builder *builder)
{
   finshell_section *section = NULL;
   CHECK(finshell_builder_build(builder, &section, NULL) == 0 && section != NULL);
   finshell_builder_destroy(builder);
   return section;
}

static inline finshell_section *laminate(double offset)
{
   const char *names[] = {"e1", "e2", "nu12", "g12"};
   const double values[] = {3300, 1100, 0.25, 660};
   finshell_section_builder *builder = begin();
   for (int i = 0; i < 3; i++) {
      CHECK(finshell_builder_layer(builder, 0.02 + 0.01 * i, 30 + 60 * i, 2, 1 + i, NULL) == 0);
      CHECK(finshell_builder_law(builder, "orthotropic", 4, names, values, NULL) == 0);
   }
   CHECK(finshell_builder_option(builder, "offset", offset, NULL) == 0);
   return built(builder);
}
#endif
