/* Assembly against the sum of what the elements give one by one, and against differences of it. */
#define _POSIX_C_SOURCE 200809L
#include "check_assembly.h"

static finshell_status status;
static const double origin[3] = {0.3, -0.2, 0.1};
enum { m = 6, nodes = (m + 1) * (m + 1), elements = 2 * m * m };

/* The block of one element. */
typedef struct {
   double X[9], u[9], rotations[12], state[12], toward[18];
} one;

static finshell_elements element_of(grid g, finshell_elements b, int e, one *o)
{
   int c = b.convention == FINSHELL_ROTATION_QUATERNION ? 4 : 3, w = g.sections[e] == SHEET ? 3 : 6;
   for (int k = 0; k < 3; k++) {
      int node = g.triangles[3 * e + k];
      memcpy(o->X + 3 * k, b.X + 3 * node, 3 * sizeof(double));
      memcpy(o->u + 3 * k, b.u + 3 * node, 3 * sizeof(double));
      memcpy(o->rotations + c * k, b.rotations + c * node, c * sizeof(double));
      memcpy(o->state + 4 * k, b.state + 4 * node, 4 * sizeof(double));
      if (b.toward) memcpy(o->toward + w * k, b.toward + 6 * node, w * sizeof(double));
   }
   b.n = 1;
   b.X = o->X, b.u = o->u, b.rotations = o->rotations, b.state = o->state, b.toward = b.toward ? o->toward : NULL;
   b.direction += 3 * e, b.normals = b.normals ? b.normals + 9 * e : NULL, b.straight = b.straight ? b.straight + 3 * e : NULL;
   return b;
}

/* Add an element's force and matrix (by rows) to dense arrays. */
static void add(grid g, const int32_t *row, int rows, int e, int width, const double *f, const double *k, double *force, double *dense)
{
   int n = 3 * width;
   for (int i = 0; i < n; i++) {
      int at = 6 * g.triangles[3 * e + i / width] + i % width;
      force[at] += f[i];
      for (int j = 0; j < n && k; j++) {
         int other = 6 * g.triangles[3 * e + j / width] + j % width;
         if (row[at] >= 0 && row[other] >= 0) dense[(size_t)row[at] * rows + row[other]] += k[n * i + j];
      }
   }
}

static double largest(const double *a, size_t n)
{
   double most = 0;
   for (size_t i = 0; i < n; i++) most = fmax(most, fabs(a[i]));
   return most;
}

static void same(const double *a, const double *b, size_t n, double tolerance, int line)
{
   double scale = largest(b, n), worst = 0;
   for (size_t i = 0; i < n; i++) worst = fmax(worst, fabs(a[i] - b[i]));
   check(scale > 0, "nothing to compare", line);
   check_close(worst / scale, 0, tolerance, "assembled and summed differ", line);
}
#define SAME(a, b, n, tolerance) same((a), (b), (n), (tolerance), __LINE__)

/* Elements, pressures, masses. how: 0 rows from here, 1 rows of the host in any order, 2 its pattern, with more in it. */
static void sums(int convention, int triangle, int how)
{
   grid g = new_grid(m, 5 + convention);
   finshell_section *s[KINDS];
   finshell_assembly *a;
   finshell_mesh mesh = mesh_of(g, triangle);
   finshell_elements b = block_of_grid(g, convention);
   const finshell_section *const *list = (const finshell_section *const *)s;
   int32_t *own = malloc(sizeof(int32_t) * 6 * nodes), *columns = NULL, row[6 * nodes], nodal, rows;
   int64_t *starts = NULL, entries;
   kinds(s);
   b.toward = g.toward;
   if (how) { /* by components, last node first; some numbers are another's */
      for (int i = 0; i < 6 * nodes; i++) own[i] = g.held[i] ? -1 : 7 + (5 - i % 6) * nodes + (nodes - 1 - i / 6);
      mesh.held = NULL, mesh.freedoms = own;
   }
   if (how == 2) { /* everything meets everything */
      int n = mesh.rows = 6 * nodes + 9;
      starts = malloc(sizeof(int64_t) * (n + 1));
      columns = malloc(sizeof(int32_t) * n * n);
      starts[0] = 0;
      for (int i = 0; i < n; i++) {
         starts[i + 1] = starts[i];
         for (int j = triangle ? i : 0; j < n; j++) columns[starts[i + 1]++] = j;
      }
      mesh.starts = starts, mesh.columns = columns;
   }
   CHECK(finshell_assembly_create(&mesh, KINDS, list, &a, &status) == 0);
   if (status.code) fprintf(report, "%s\n", status.message);
   CHECK(finshell_assembly_size(a, &nodal, &rows, &entries, &status) == 0 && nodal == 6);
   CHECK(finshell_assembly_freedoms(a, row, &status) == 0);
   int used = 0;
   for (int i = 0; i < 6 * nodes; i++) {
      CHECK(!g.held[i] || row[i] < 0);
      used += row[i] >= 0;
      if (how) CHECK(row[i] == own[i] || (row[i] == -1 && i % 6 > 2));
   }
   CHECK(how == 2 ? rows == 6 * nodes + 9 : how == 1 ? rows <= 6 * nodes + 7 : rows == used);
   size_t square = (size_t)rows * rows;
   double *values = calloc(entries, sizeof(double)), *dense = calloc(square, sizeof(double));
   double force[6 * nodes] = {0}, sum[6 * nodes] = {0}, energy, total = 0;

   CHECK(finshell_assembly_evaluate(a, KINDS, list, &b, &energy, force, values, NULL, &status) == 0);
   for (int e = 0; e < elements; e++) {
      one o;
      double w, f[18], k[18 * 18];
      finshell_elements single = element_of(g, b, e, &o);
      CHECK(finshell_elements_evaluate(s[g.sections[e]], &single, &w, f, k, NULL, &status) == 0);
      add(g, row, rows, e, g.sections[e] == SHEET ? 3 : 6, f, k, sum, dense);
      total += w;
   }
   double *found = dense_of(a, values, triangle);
   CHECK_CLOSE(energy / total, 1, 1e-13);
   SAME(force, sum, 6 * nodes, 1e-13);
   SAME(found, dense, square, 1e-13);
   free(found);

   for (int form = 0; form < 2; form++) {
      const double factor = form ? -1.5 : 1;
      memset(force, 0, sizeof force), memset(sum, 0, sizeof sum), memset(values, 0, sizeof(double) * entries);
      memset(dense, 0, sizeof(double) * square);
      CHECK(finshell_assembly_pressure(a, &b, g.pressure, form, origin, factor, force, values, NULL, &status) == 0);
      for (int e = 0; e < elements; e++) {
         one o;
         double f[18], k[18][18], shuffled[18], matrix[18 * 18], p = factor * g.pressure[e];
         finshell_elements single = element_of(g, b, e, &o);
         int width = g.sections[e] == SHEET ? 3 : 6, n = 3 * width;
         if (width == 3) single.normals = NULL;
         CHECK(finshell_elements_pressure(&single, &p, form, origin, NULL, f, k[0], NULL, &status) == 0);
         for (int i = 0; i < n; i++) {
            int at = 6 * (i / width) + i % width;
            shuffled[i] = f[at];
            for (int j = 0; j < n; j++) {
               int other = 6 * (j / width) + j % width;
               matrix[n * i + j] = triangle ? (k[at][other] + k[other][at]) / 2 : k[at][other];
            }
         }
         add(g, row, rows, e, width, shuffled, matrix, sum, dense);
      }
      found = dense_of(a, values, triangle);
      SAME(force, sum, 6 * nodes, 1e-13);
      SAME(found, dense, square, 1e-13);
      free(found);
   }

   memset(force, 0, sizeof force), memset(sum, 0, sizeof sum), memset(values, 0, sizeof(double) * entries);
   memset(dense, 0, sizeof(double) * square);
   CHECK(finshell_assembly_mass(a, KINDS, list, &b, 0.25, force, values, NULL, &status) == 0);
   for (int e = 0; e < elements; e++) {
      one o;
      double f[18], k[18 * 18];
      finshell_elements single = element_of(g, b, e, &o);
      CHECK(finshell_mass_matrix(s[g.sections[e]], 1, single.X, k, f, NULL, &status) == 0);
      for (int i = 0; i < 18; i++) f[i] *= 0.25;
      for (int i = 0; i < 18 * 18; i++) k[i] *= 0.25;
      add(g, row, rows, e, g.sections[e] == SHEET ? 3 : 6, f, k, sum, dense);
   }
   found = dense_of(a, values, triangle);
   SAME(force, sum, 6 * nodes, 1e-13);
   SAME(found, dense, square, 1e-13);
   free(found), free(values), free(dense), free(own), free(starts), free(columns);
   finshell_assembly_destroy(a);
   free_kinds(s);
   free_grid(g);
}

/* The gradient of the volume, and the force of a line load, by differences in every unknown; the tangent of everything, too. */
static void differences(int convention)
{
   static const double step = 1e-5;
   grid g = new_grid(3, 11);
   finshell_section *s[KINDS];
   finshell_assembly *a;
   finshell_mesh mesh = mesh_of(g, FINSHELL_WHOLE);
   finshell_elements b = block_of_grid(g, convention);
   const finshell_section *const *list = (const finshell_section *const *)s;
   const int32_t element[] = {0, 3, 3, 17, 5}, side[] = {0, 1, 2, 0, 1};
   const double load[5][3] = {{1, 2, 3}, {-2, 1, 0.5}, {0.3, 0.2, -4}, {1, 1, 1}, {3, -1, 2}};
   enum { n = 16 };
   int32_t row[6 * n], rows;
   int64_t entries;
   double volume[2], gradient[6 * n] = {0}, force[6 * n] = {0}, moved[2][6 * n];
   kinds(s);
   mesh.held = NULL;
   CHECK(finshell_assembly_create(&mesh, KINDS, list, &a, &status) == 0);
   CHECK(finshell_assembly_size(a, NULL, &rows, &entries, NULL) == 0 && finshell_assembly_freedoms(a, row, NULL) == 0);
   double *values = calloc(entries, sizeof(double));
   CHECK(finshell_assembly_volume(a, &b, g.pressure, origin, NULL, gradient, NULL, &status) == 0);
   CHECK(finshell_assembly_line_load(a, &b, 5, element, side, load[0], 1.5, force, values, NULL, &status) == 0);
   CHECK(finshell_assembly_pressure(a, &b, g.pressure, 0, origin, 2, force, values, NULL, &status) == 0);
   CHECK(finshell_assembly_evaluate(a, KINDS, list, &b, NULL, force, values, NULL, &status) == 0);
   double *dense = dense_of(a, values, 0), couples = 0;
   for (int i = 0; i < 6 * n; i++) {
      double *at = i % 6 < 3 ? g.u + 3 * (i / 6) + i % 6 : g.vector + 3 * (i / 6) + i % 3;
      if (row[i] < 0) continue;
      for (int k = 0; k < 2; k++) {
         *at += k ? -2 * step : step;
         memset(moved[k], 0, sizeof moved[k]);
         CHECK(finshell_assembly_volume(a, &b, g.pressure, origin, &volume[k], NULL, NULL, &status) == 0);
         CHECK(finshell_assembly_line_load(a, &b, 5, element, side, load[0], 1.5, moved[k], NULL, NULL, &status) == 0);
         CHECK(finshell_assembly_pressure(a, &b, g.pressure, 0, origin, 2, moved[k], NULL, NULL, &status) == 0);
         CHECK(finshell_assembly_evaluate(a, KINDS, list, &b, NULL, moved[k], NULL, NULL, &status) == 0);
      }
      *at += step;
      CHECK_CLOSE((volume[0] - volume[1]) / (2 * step), gradient[i], 1e-8);
      for (int j = 0; j < 6 * n; j++)
         if (row[j] >= 0)
            CHECK_CLOSE((moved[0][j] - moved[1][j]) / (2 * step), dense[(size_t)row[j] * rows + row[i]], 2e-6);
      if (i % 6 > 2) couples = fmax(couples, fabs(gradient[i]));
   }
   CHECK(couples > 1e-3);
   free(dense), free(values);
   finshell_assembly_destroy(a);
   free_kinds(s);
   free_grid(g);
}

/* Resultants: of tractions and weight; a line load has its force, and none from the couples. */
static void resultants(void)
{
   grid g = new_grid(m, 3);
   finshell_section *s[KINDS];
   finshell_assembly *a;
   finshell_mesh mesh = mesh_of(g, FINSHELL_UPPER);
   finshell_elements b = block_of_grid(g, FINSHELL_ROTATION_QUATERNION);
   const finshell_section *const *list = (const finshell_section *const *)s;
   const double gravity[3] = {0.5, 1, -10}, load[3] = {1, 2, 3}, areal[KINDS] = {0.25, 0.02 * 1 + 0.03 * 2 + 0.04 * 3, 0.3};
   const int32_t element[1] = {2}, side[1] = {2};
   double pull[6 * nodes] = {0}, weight[6 * nodes] = {0}, line[6 * nodes] = {0}, expected[3][3] = {{0}}, sum[3][3] = {{0}};
   kinds(s);
   CHECK(finshell_assembly_create(&mesh, KINDS, list, &a, &status) == 0);
   CHECK(finshell_assembly_traction(a, g.X, g.traction, 2, pull, NULL, &status) == 0);
   CHECK(finshell_assembly_gravity(a, KINDS, list, &b, gravity, 3, weight, NULL, &status) == 0);
   CHECK(finshell_assembly_line_load(a, &b, 1, element, side, load, 1, line, NULL, NULL, &status) == 0);
   for (int e = 0; e < elements; e++) {
      const double *x = g.X + 3 * g.triangles[3 * e], *y = g.X + 3 * g.triangles[3 * e + 1], *z = g.X + 3 * g.triangles[3 * e + 2];
      double cross[3], area;
      for (int c = 0; c < 3; c++) {
         int i = (c + 1) % 3, j = (c + 2) % 3;
         cross[c] = (y[i] - x[i]) * (z[j] - x[j]) - (y[j] - x[j]) * (z[i] - x[i]);
      }
      area = sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]) / 2;
      for (int c = 0; c < 3; c++) {
         expected[0][c] += 2 * area * g.traction[3 * e + c];
         expected[1][c] += 3 * area * areal[g.sections[e]] * gravity[c];
         if (e == 2) expected[2][c] = load[c] * sqrt(pow(z[0] - x[0], 2) + pow(z[1] - x[1], 2) + pow(z[2] - x[2], 2));
      }
   }
   double couple = 0;
   for (int i = 0; i < 6 * nodes; i++) {
      if (i % 6 > 2) couple = fmax(couple, fabs(line[i]));
      if (i % 6 > 2) CHECK(pull[i] == 0 && weight[i] == 0);
      if (i % 6 < 3) sum[0][i % 6] += pull[i], sum[1][i % 6] += weight[i], sum[2][i % 6] += line[i];
   }
   for (int k = 0; k < 3; k++)
      for (int c = 0; c < 3; c++) CHECK_CLOSE(sum[k][c], expected[k][c], 1e-11);
   CHECK(couple > 1e-3);
   finshell_assembly_destroy(a);
   free_kinds(s);
   free_grid(g);
}

/* Membranes alone have three freedoms a node; with nodal = 6 the rotations have no rows. Both give the same. */
static void membranes(void)
{
   grid g = new_grid(m, 9);
   finshell_section *s = membrane_of(1);
   finshell_mesh mesh = mesh_of(g, FINSHELL_WHOLE);
   finshell_elements b = block_of_grid(g, 0);
   const finshell_section *const list[] = {s};
   double *values[2], force[2][6 * nodes] = {{0}}, energy[2], volume[2];
   int64_t entries[2];
   mesh.sections = NULL, mesh.held = NULL;
   b.rotations = NULL, b.state = NULL;
   for (int k = 0; k < 2; k++) {
      finshell_assembly *a;
      int32_t nodal, rows;
      mesh.nodal = k ? 6 : 0;
      CHECK(finshell_assembly_create(&mesh, 1, list, &a, &status) == 0);
      CHECK(finshell_assembly_size(a, &nodal, &rows, &entries[k], &status) == 0 && nodal == (k ? 6 : 3) && rows == 3 * nodes);
      values[k] = calloc(entries[k], sizeof(double));
      CHECK(finshell_assembly_evaluate(a, 1, list, &b, &energy[k], force[k], values[k], NULL, &status) == 0);
      CHECK(finshell_assembly_pressure(a, &b, g.pressure, 1, origin, -1, force[k], values[k], NULL, &status) == 0);
      CHECK(finshell_assembly_mass(a, 1, list, &b, 1, force[k], values[k], NULL, &status) == 0);
      CHECK(finshell_assembly_volume(a, &b, NULL, origin, &volume[k], NULL, NULL, &status) == 0);
      finshell_assembly_destroy(a);
   }
   CHECK(entries[0] == entries[1] && memcmp(values[0], values[1], sizeof(double) * entries[0]) == 0);
   CHECK(energy[0] == energy[1] && volume[0] == volume[1] && fabs(volume[0]) > 0);
   for (int i = 0; i < 3 * nodes; i++) CHECK(force[0][i] == force[1][6 * (i / 3) + i % 3]);
   free(values[0]), free(values[1]);
   finshell_section_destroy(s);
   free_grid(g);
}

int main(void)
{
   silence();
   for (int triangle = 0; triangle < 2; triangle++)
      for (int how = 0; how < 3; how++)
         for (int convention = 1; convention <= (how ? 1 : 3); convention++) sums(convention, triangle, how);
   differences(FINSHELL_ROTATION_VECTOR);
   differences(FINSHELL_ROTATION_INCREMENT);
   resultants();
   membranes();
   return finish();
}
