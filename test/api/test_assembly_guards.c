/* Assemblies of finshell.h under guards (guards.h). */
#define _GNU_SOURCE
#include "guards.h"
#include "check_assembly.h"

enum { squares = 4, most = 6 * 25 }; /* of the mesh in a direction; freedoms of all nodes */

struct world {
   grid g;
   finshell_section *s[KINDS];
   finshell_assembly *a;
   int32_t rows, threads;
   int64_t entries;
};

static const int64_t nothing[32];

static finshell_elements block(const world *w)
{
   finshell_elements b = block_of_grid(w->g, FINSHELL_ROTATION_VECTOR);
   b.threads = w->threads;
   return b;
}

static const finshell_section *const *sections(const world *w)
{
   return (const finshell_section *const *)w->s;
}

/* Zeros to add to, and what has been added. */
static double *zeros(size_t number)
{
   return calloc(number, sizeof(double));
}

static void keep_values(results *r, double *values, size_t number)
{
   keep(r, values, number * sizeof *values);
   free(values);
}

/* ------------------------------------------------------------------ the pattern */

static void assembly_create(const world *w, results *r)
{
   finshell_mesh mesh = mesh_of(w->g, FINSHELL_UPPER);
   finshell_assembly *a = NULL;
   finshell_status status;
   int32_t wrong[3 * 2 * squares * squares], rows = 0;
   int64_t entries = 0;
   keep_status(r, finshell_assembly_create(&mesh, KINDS, sections(w), &a, &status), &status);
   keep_status(r, finshell_assembly_size(a, NULL, &rows, &entries, &status), &status);
   KEEP(rows);
   KEEP(entries);
   finshell_assembly_destroy(a);
   memcpy(wrong, w->g.triangles, sizeof wrong);
   wrong[5] = w->g.nodes;
   mesh.triangles = wrong;
   keep_status(r, finshell_assembly_create(&mesh, KINDS, sections(w), &a, &status), &status);
}

static void assembly_destroy(const world *w, results *r)
{
   finshell_mesh mesh = mesh_of(w->g, FINSHELL_WHOLE);
   finshell_assembly *a = NULL;
   finshell_status status;
   keep_status(r, finshell_assembly_create(&mesh, KINDS, sections(w), &a, &status), &status);
   finshell_assembly_destroy(a);
   finshell_assembly_destroy(NULL);
   finshell_assembly_destroy((finshell_assembly *)nothing);
}

static void assembly_size(const world *w, results *r)
{
   int32_t nodal = 0, rows = 0;
   int64_t entries = 0;
   finshell_status status;
   keep_status(r, finshell_assembly_size(w->a, &nodal, &rows, &entries, &status), &status);
   KEEP(nodal);
   KEEP(rows);
   KEEP(entries);
   keep_status(r, finshell_assembly_size((const finshell_assembly *)nothing, &nodal, &rows, &entries, &status), &status);
}

static void assembly_freedoms(const world *w, results *r)
{
   int32_t freedoms[most];
   finshell_status status;
   keep_status(r, finshell_assembly_freedoms(w->a, freedoms, &status), &status);
   KEEP(freedoms);
   keep_status(r, finshell_assembly_freedoms(NULL, freedoms, &status), &status);
}

static void assembly_pattern(const world *w, results *r)
{
   int32_t *starts = calloc(w->rows + 1, sizeof *starts), *columns = calloc(w->entries, sizeof *columns);
   finshell_status status;
   keep_status(r, finshell_assembly_pattern(w->a, starts, columns, &status), &status);
   keep(r, starts, (w->rows + 1) * sizeof *starts);
   keep(r, columns, w->entries * sizeof *columns);
   keep_status(r, finshell_assembly_pattern(NULL, starts, columns, &status), &status);
   free(starts);
   free(columns);
}

static void assembly_pattern_64(const world *w, results *r)
{
   int64_t *starts = calloc(w->rows + 1, sizeof *starts), *columns = calloc(w->entries, sizeof *columns);
   finshell_status status;
   keep_status(r, finshell_assembly_pattern_64(w->a, starts, columns, &status), &status);
   keep(r, starts, (w->rows + 1) * sizeof *starts);
   keep(r, columns, w->entries * sizeof *columns);
   keep_status(r, finshell_assembly_pattern_64(NULL, starts, columns, &status), &status);
   free(starts);
   free(columns);
}

/* ------------------------------------------------------------------ contributions */

static void assembly_evaluate(const world *w, results *r)
{
   double energy = 0, *force = zeros(most), *values = zeros(w->entries), *u;
   int32_t codes[2 * squares * squares];
   finshell_elements b = block(w);
   finshell_status status;
   keep_status(r, finshell_assembly_evaluate(w->a, KINDS, sections(w), &b, &energy, force, values, codes, &status), &status);
   KEEP(energy);
   keep_values(r, force, most);
   keep_values(r, values, w->entries);
   KEEP(codes);
   /* a node that is nowhere: its elements add nothing */
   u = malloc(3 * w->g.nodes * sizeof *u);
   memcpy(u, w->g.u, 3 * w->g.nodes * sizeof *u);
   u[20] = NAN;
   b.u = u;
   force = zeros(most);
   keep_status(r, finshell_assembly_evaluate(w->a, KINDS, sections(w), &b, &energy, force, NULL, codes, &status), &status);
   keep_values(r, force, most);
   KEEP(codes);
   free(u);
   keep_status(r, finshell_assembly_evaluate(w->a, 2, sections(w), &b, NULL, NULL, NULL, NULL, &status), &status);
}

static void assembly_pressure(const world *w, results *r)
{
   double *force = zeros(most), *values = zeros(w->entries);
   finshell_elements b = block(w);
   finshell_status status;
   keep_status(r, finshell_assembly_pressure(w->a, &b, w->g.pressure, 1, NULL, -1, force, values, NULL, &status), &status);
   keep_values(r, values, w->entries);
   keep_status(r, finshell_assembly_pressure(w->a, &b, w->g.pressure, 5, NULL, -1, force, NULL, NULL, &status), &status);
   keep_status(r, finshell_assembly_pressure(w->a, &b, NULL, 0, NULL, -1, force, NULL, NULL, &status), &status);
   keep_values(r, force, most);
}

static void assembly_volume(const world *w, results *r)
{
   const double far[] = {0, INFINITY, 0};
   double volume = 0, *gradient = zeros(most);
   finshell_elements b = block(w);
   finshell_status status;
   keep_status(r, finshell_assembly_volume(w->a, &b, NULL, NULL, &volume, gradient, NULL, &status), &status);
   KEEP(volume);
   keep_status(r, finshell_assembly_volume(w->a, &b, w->g.pressure, far, &volume, gradient, NULL, &status), &status);
   keep_values(r, gradient, most);
}

static void assembly_mass(const world *w, results *r)
{
   double *lumped = zeros(most), *values = zeros(w->entries);
   finshell_elements b = block(w);
   finshell_status status;
   keep_status(r, finshell_assembly_mass(w->a, KINDS, sections(w), &b, 2, lumped, values, NULL, &status), &status);
   keep_values(r, values, w->entries);
   b.X = NULL;
   keep_status(r, finshell_assembly_mass(w->a, KINDS, sections(w), &b, 2, lumped, NULL, NULL, &status), &status);
   keep_values(r, lumped, most);
}

static void assembly_traction(const world *w, results *r)
{
   double *force = zeros(most), *flat = zeros(3 * w->g.nodes);
   finshell_status status;
   keep_status(r, finshell_assembly_traction(w->a, w->g.X, w->g.traction, 0.5, force, NULL, &status), &status);
   keep_status(r, finshell_assembly_traction(w->a, flat, w->g.traction, 0.5, force, NULL, &status), &status);
   keep_values(r, force, most);
   free(flat);
}

static void assembly_gravity(const world *w, results *r)
{
   const double down[] = {0, 0, -9.81}, wrong[] = {NAN, 0, 0};
   double *force = zeros(most);
   finshell_elements b = block(w);
   finshell_status status;
   keep_status(r, finshell_assembly_gravity(w->a, KINDS, sections(w), &b, down, 1, force, NULL, &status), &status);
   keep_status(r, finshell_assembly_gravity(w->a, KINDS, sections(w), &b, wrong, 1, force, NULL, &status), &status);
   keep_values(r, force, most);
}

static void assembly_line_load(const world *w, results *r)
{
   const int32_t element[] = {0, 3, 7}, side[] = {0, 1, 2}, wrong[] = {0, 5, 2};
   const double load[3][3] = {{0, 1, 2}, {1, 0, -1}, {0.5, 0.5, 0}};
   double *force = zeros(most), *values = zeros(w->entries);
   int32_t codes[3];
   finshell_elements b = block(w);
   finshell_status status;
   keep_status(r, finshell_assembly_line_load(w->a, &b, 3, element, side, &load[0][0], -1, force, values, codes, &status), &status);
   keep_values(r, values, w->entries);
   KEEP(codes);
   keep_status(r, finshell_assembly_line_load(w->a, &b, 3, element, wrong, &load[0][0], -1, force, NULL, codes, &status), &status);
   keep_values(r, force, most);
}

static const entry all[] = {
   ENTRY(assembly_create), ENTRY(assembly_destroy), ENTRY(assembly_size), ENTRY(assembly_freedoms), ENTRY(assembly_pattern),
   ENTRY(assembly_pattern_64), ENTRY(assembly_evaluate), ENTRY(assembly_pressure), ENTRY(assembly_volume), ENTRY(assembly_mass),
   ENTRY(assembly_traction), ENTRY(assembly_gravity), ENTRY(assembly_line_load),
};

int main(int argc, char **argv)
{
   world w = {0}, several;
   silence();
   w.g = new_grid(squares, 3);
   kinds(w.s);
   w.threads = 1;
   finshell_mesh mesh = mesh_of(w.g, FINSHELL_WHOLE);
   CHECK(finshell_assembly_create(&mesh, KINDS, sections(&w), &w.a, NULL) == 0);
   CHECK(finshell_assembly_size(w.a, NULL, &w.rows, &w.entries, NULL) == 0);
   CHECK(6 * w.g.nodes == most);
   several = w;
   several.threads = 4;
   guard(all, sizeof all / sizeof *all, &w, &several, argc, argv);
   finshell_assembly_destroy(w.a);
   free_kinds(w.s);
   free_grid(w.g);
   return finish();
}
