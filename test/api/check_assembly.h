/* A mesh for the tests of assemblies: a bumpy sheet of shells, with membranes in a corner of it, in a random state. */
#ifndef CHECK_ASSEMBLY_H
#define CHECK_ASSEMBLY_H

#include "check.h"

enum { SHELL = 0, LAMINATE = 1, SHEET = 2, KINDS = 3 };

typedef struct {
   int32_t nodes, elements;
   int32_t *triangles, *sections, *held;                     /* [elements][3], [elements], [nodes][6] */
   double *X, *u, *vector, *quaternion, *state, *toward;     /* by nodes */
   double *direction, *normals, *pressure, *traction;        /* by elements */
   double *thickness, *offset, *growth;                      /* [elements], [elements], [elements][3][4] */
   int32_t *straight;
} grid;

static inline finshell_section *membrane_of(double density)
{
   const char *names[] = {"mu"}, *options[] = {"membrane", "density"};
   const double mu[] = {20}, chosen[] = {1, density};
   finshell_section *section = NULL;
   CHECK(finshell_section_create("neo_hookean", 1, names, mu, 0.1, 2, options, chosen, &section, NULL) == 0);
   return section;
}

/* m by m squares of two triangles; with mixed sections, the last third of the rows being membranes. */
static inline grid new_grid(int32_t m, uint32_t seed)
{
   grid g;
   int32_t e = 0;
   g.nodes = (m + 1) * (m + 1), g.elements = 2 * m * m;
   g.triangles = malloc(sizeof(int32_t) * 3 * g.elements);
   g.sections = malloc(sizeof(int32_t) * g.elements);
   g.held = calloc(6 * g.nodes, sizeof(int32_t));
   g.straight = malloc(sizeof(int32_t) * 3 * g.elements);
   double **by_node[] = {&g.X, &g.u, &g.vector, &g.quaternion, &g.state, &g.toward};
   for (int i = 0; i < 6; i++) *by_node[i] = malloc(sizeof(double) * 6 * g.nodes);
   double **by_element[] = {&g.direction, &g.normals, &g.pressure, &g.traction, &g.thickness, &g.offset, &g.growth};
   for (int i = 0; i < 7; i++) *by_element[i] = malloc(sizeof(double) * 12 * g.elements);
   for (int32_t i = 0; i < g.nodes; i++) {
      double x = i % (m + 1), y = i / (m + 1);
      g.X[3 * i] = x + 0.3 * noise(&seed), g.X[3 * i + 1] = y + 0.3 * noise(&seed), g.X[3 * i + 2] = 0.3 * noise(&seed);
      g.u[3 * i] = 0.2 * x, g.u[3 * i + 1] = 0.1 * y, g.u[3 * i + 2] = 0.1 * noise(&seed);
      for (int c = 0; c < 3; c++) g.vector[3 * i + c] = 0.2 * noise(&seed);
      for (int c = 0; c < 4; c++) g.state[4 * i + c] = (c == 0) + 0.1 * noise(&seed);
      for (int c = 0; c < 6; c++) g.toward[6 * i + c] = 0.01 * noise(&seed);
      for (int c = 0; c < 6; c++) g.held[6 * i + c] = i % 7 == 3 || (i % 5 == 2 && c % 3 == 1);
   }
   finshell_rotation_exp(g.nodes, g.vector, g.quaternion, NULL, NULL);
   for (int32_t j = 0; j < m; j++)
      for (int32_t i = 0; i < m; i++)
         for (int t = 0; t < 2; t++, e++) {
            int32_t a = j * (m + 1) + i, corners[2][3] = {{a, a + 1, a + m + 2}, {a + m + 2, a + m + 1, a}};
            memcpy(g.triangles + 3 * e, corners[t], sizeof corners[t]);
            g.sections[e] = j >= m - m / 3 ? SHEET : (i + j) % 2 ? LAMINATE : SHELL;
            for (int k = 0; k < 3; k++) {
               g.direction[3 * e + k] = 1 + noise(&seed), g.traction[3 * e + k] = noise(&seed);
               g.straight[3 * e + k] = (e + k) % 11 == 0 ? 1 : (e + k) % 13 == 0 ? 2 : 0;
               for (int c = 0; c < 3; c++) g.normals[9 * e + 3 * k + c] = (c == 2) + 0.2 * noise(&seed);
            }
            g.pressure[e] = e % 3 ? 1 + noise(&seed) : 0;
            g.thickness[e] = 0.1 + 0.05 * noise(&seed), g.offset[e] = 0.05 * noise(&seed);
            for (int k = 0; k < 12; k++) g.growth[12 * e + k] = 0.05 * noise(&seed);
         }
   return g;
}

static inline void free_grid(grid g)
{
   void *all[] = {g.triangles, g.sections, g.held, g.straight, g.X, g.u, g.vector, g.quaternion, g.state, g.toward, g.direction,
                  g.normals, g.pressure, g.traction, g.thickness, g.offset, g.growth};
   for (size_t i = 0; i < sizeof all / sizeof *all; i++) free(all[i]);
}

/* The block by nodes. */
static inline finshell_elements block_of_grid(grid g, int convention)
{
   finshell_elements b = {0};
   b.size = sizeof b;
   b.n = g.elements, b.convention = convention, b.threads = 1;
   b.X = g.X, b.u = g.u, b.rotations = convention == FINSHELL_ROTATION_QUATERNION ? g.quaternion : g.vector, b.state = g.state;
   b.direction = g.direction, b.normals = g.normals, b.straight = g.straight;
   b.thickness = g.thickness, b.offset = g.offset, b.growth = g.growth;
   return b;
}

static inline finshell_mesh mesh_of(grid g, int triangle)
{
   finshell_mesh m = {0};
   m.size = sizeof m;
   m.nodes = g.nodes, m.elements = g.elements, m.triangle = triangle;
   m.triangles = g.triangles, m.sections = g.sections, m.held = g.held;
   return m;
}

/* The three sections. */
static inline void kinds(finshell_section *s[KINDS])
{
   s[SHELL] = rubber(0.1), s[LAMINATE] = laminate(0.02), s[SHEET] = membrane_of(3);
}

static inline void free_kinds(finshell_section *s[KINDS])
{
   for (int k = 0; k < KINDS; k++) finshell_section_destroy(s[k]);
}

/* Values of a matrix as a dense one, rows*rows; of an upper triangle both. */
static inline double *dense_of(const finshell_assembly *a, const double *values, int upper)
{
   int32_t rows;
   int64_t entries;
   CHECK(finshell_assembly_size(a, NULL, &rows, &entries, NULL) == 0);
   int32_t *starts = malloc(sizeof(int32_t) * (rows + 1)), *columns = malloc(sizeof(int32_t) * (entries + 1));
   double *dense = calloc((size_t)rows * rows + 1, sizeof(double));
   CHECK(finshell_assembly_pattern(a, starts, columns, NULL) == 0);
   for (int32_t i = 0; i < rows; i++)
      for (int32_t p = starts[i]; p < starts[i + 1]; p++) {
         CHECK(columns[p] >= (upper ? i : 0) && columns[p] < rows && (p == starts[i] || columns[p] > columns[p - 1]));
         dense[(size_t)i * rows + columns[p]] = values[p];
         if (upper) dense[(size_t)columns[p] * rows + i] = values[p];
      }
   CHECK(starts[0] == 0 && starts[rows] == entries);
   free(starts), free(columns);
   return dense;
}
#endif
