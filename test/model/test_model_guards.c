/* Every function of finshell_model.h under guards (../api/guards.h). A call alone works at a time: threads of the host wait. */
#define _GNU_SOURCE
#include "../api/guards.h"
#include <finshell_model.h>

struct world {
   const char *text; /* of the input, with the number of threads */
};

#define INPUT(threads) \
   "&job title = 'A strip' name = 'strip' threads = " threads " /\n" \
   "&mesh generator = 'rectangle' lengths = 1.0, 0.2 divisions = 5, 2 /\n" \
   "&material name = 'm' law = 'linear_elastic' e = 1.0e6 nu = 0.3 density = 1000.0 /\n" \
   "&section material = 'm' thickness = 0.01 /\n" \
   "&support node_set = 'edge_x0' type = 'clamped' /\n" \
   "&support node_set = 'edge_x1' fixed = 'uz' /\n" \
   "&load type = 'force' node_set = 'edge_y1' vector = 0.0, 0.0, 0.02 /\n" \
   "&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_y0' /\n" \
   "&step name = 'bend' tolerance = 'tight' /\n" \
   "&step name = 'swing' control = 'dynamic' duration = 0.02 /\n"

/* What is no model. */
static const int64_t nothing[64];

static void keep_model_status(results *r, int32_t code, const finshell_model_status *status)
{
   KEEP(code);
   KEEP(status->code);
   keep_text(r, status->message);
}

static void keep_record(results *r, const finshell_model_record *record)
{
   KEEP(record->increment);
   KEEP(record->step);
   KEEP(record->reports);
   KEEP(record->finished);
   KEEP(record->iterations);
   KEEP(record->load_factor);
   KEEP(record->time);
   KEEP(record->size);
   keep_text(r, record->control);
}

static finshell_model *model_of(const world *w)
{
   finshell_model *m = NULL;
   finshell_model_create("strip.nml", w->text, NULL, &m, NULL);
   return m;
}

/* Displacements of the nodes. */
static void keep_motion(results *r, finshell_model *m)
{
   finshell_model_array a = {0};
   finshell_model_status status;
   keep_model_status(r, finshell_model_field(m, "displacement", 0, &a, &status), &status);
   if (a.values) keep(r, a.values, sizeof *a.values * a.items * a.places * a.components);
}

static void model_abi(const world *w, results *r)
{
   int32_t value = finshell_model_abi();
   (void)w;
   KEEP(value);
}

static void model_create(const world *w, results *r)
{
   static const char sheet[] = "&mesh /\n&material name = 'm' law = 'neo_hookean' mu = 1.0 /\n"
      "&section material = 'm' thickness = 0.1 /\n&support node_set = 'held' type = 'clamped' /\n&step /\n";
   static const double x[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
   static const int32_t t[] = {0, 1, 2, 0, 2, 3}, held[] = {3, 0}, far[] = {4};
   finshell_model_set set = {"held", FINSHELL_MODEL_NODES, 2, held};
   finshell_model_mesh mesh = {sizeof mesh, 4, 2, 1, 0, x, t, &set};
   finshell_model *m = NULL;
   finshell_model_status status;
   keep_model_status(r, finshell_model_create("strip.nml", w->text, NULL, &m, &status), &status);
   finshell_model_destroy(m, NULL);
   keep_model_status(r, finshell_model_create("sheet", sheet, &mesh, &m, &status), &status);
   finshell_model_destroy(m, NULL);
   set.number = 1;
   set.members = far;
   keep_model_status(r, finshell_model_create("sheet", "&mesh /\n", &mesh, &m, &status), &status);
   keep_model_status(r, finshell_model_create("strip.nml", "&material nme = 'm' /\n", NULL, &m, &status), &status);
   keep_model_status(r, finshell_model_create("no_such_file.nml", NULL, NULL, &m, &status), &status);
}

static void model_destroy(const world *w, results *r)
{
   finshell_model_status status;
   keep_model_status(r, finshell_model_destroy(model_of(w), &status), &status);
   keep_model_status(r, finshell_model_destroy(NULL, &status), &status);
   keep_model_status(r, finshell_model_destroy((finshell_model *)nothing, &status), &status);
}

static void model_sizes(const world *w, results *r)
{
   finshell_model *m = model_of(w);
   finshell_model_size sizes;
   finshell_model_status status;
   keep_model_status(r, finshell_model_sizes(m, &sizes, &status), &status);
   KEEP(sizes);
   keep_model_status(r, finshell_model_sizes(m, NULL, &status), &status);
   finshell_model_destroy(m, NULL);
}

static void model_text(const world *w, results *r)
{
   static const char *const what[] = {"title", "columns", "fields", "node_sets", "colour"};
   finshell_model *m = model_of(w);
   finshell_model_status status;
   for (int i = 0; i < 5; i++) {
      char text[40] = "";
      int32_t length = -1;
      keep_model_status(r, finshell_model_text(m, what[i], text, sizeof text, &length, &status), &status);
      keep_text(r, text);
      KEEP(length);
   }
   finshell_model_destroy(m, NULL);
}

static void model_mesh_arrays(const world *w, results *r)
{
   finshell_model *m = model_of(w);
   const double *coordinates = NULL;
   const int32_t *triangles = NULL;
   finshell_model_status status;
   keep_model_status(r, finshell_model_mesh_arrays(m, &coordinates, &triangles, &status), &status);
   keep(r, coordinates, 18 * 3 * sizeof *coordinates);
   keep(r, triangles, 20 * 3 * sizeof *triangles);
   finshell_model_destroy(m, NULL);
   keep_model_status(r, finshell_model_mesh_arrays(NULL, &coordinates, &triangles, &status), &status);
}

static void model_set_members(const world *w, results *r)
{
   finshell_model *m = model_of(w);
   const int32_t *members = NULL;
   int32_t number = 0;
   finshell_model_status status;
   keep_model_status(r, finshell_model_set_members(m, FINSHELL_MODEL_NODES, "edge_x1", &number, &members, &status), &status);
   keep(r, members, number * sizeof *members);
   keep_model_status(r, finshell_model_set_members(m, FINSHELL_MODEL_EDGES, "edge_x1", &number, &members, &status), &status);
   keep_model_status(r, finshell_model_set_members(m, FINSHELL_MODEL_NODES, "nobody", &number, &members, &status), &status);
   finshell_model_destroy(m, NULL);
}

static void model_state(const world *w, results *r)
{
   finshell_model *m = model_of(w);
   finshell_model_record record;
   finshell_model_status status;
   keep_model_status(r, finshell_model_state(m, &record, &status), &status);
   keep_record(r, &record);
   finshell_model_destroy(m, NULL);
   keep_model_status(r, finshell_model_state((finshell_model *)nothing, &record, &status), &status);
}

static void model_advance(const world *w, results *r)
{
   finshell_model *m = model_of(w);
   finshell_model_record record;
   finshell_model_status status;
   keep_model_status(r, finshell_model_advance(m, NAN, &record, &status), &status);
   do { /* as far as into the motion */
      keep_model_status(r, finshell_model_advance(m, 0, &record, &status), &status);
      keep_record(r, &record);
   } while (status.code == 0 && record.reports > 0 && record.step == 0);
   keep_motion(r, m);
   finshell_model_destroy(m, NULL);
}

static void model_set_force(const world *w, results *r)
{
   static const double force[] = {0, 0, 0.01}, wrong[] = {0, INFINITY, 0};
   finshell_model *m = model_of(w);
   finshell_model_status status;
   keep_model_status(r, finshell_model_set_force(m, "edge_y0", 1, force, &status), &status);
   keep_model_status(r, finshell_model_set_force(m, "edge_y0", 1, wrong, &status), &status);
   keep_model_status(r, finshell_model_set_force(m, "nobody", 1, force, &status), &status);
   finshell_model_settle(m, NULL, NULL);
   keep_motion(r, m);
   finshell_model_destroy(m, NULL);
}

static void model_set_displacement(const world *w, results *r)
{
   static const double up[] = {0.01}, wrong[] = {NAN};
   finshell_model *m = model_of(w);
   finshell_model_status status;
   keep_model_status(r, finshell_model_set_displacement(m, "edge_x1", 2, 1, up, &status), &status);
   keep_model_status(r, finshell_model_set_displacement(m, "edge_x1", 1, 1, up, &status), &status);
   keep_model_status(r, finshell_model_set_displacement(m, "edge_x1", 2, 1, wrong, &status), &status);
   finshell_model_settle(m, NULL, NULL);
   keep_motion(r, m);
   finshell_model_destroy(m, NULL);
}

static void model_settle(const world *w, results *r)
{
   static const double force[] = {0, 0, 0.01};
   finshell_model *m = model_of(w);
   finshell_model_record record;
   finshell_model_status status;
   finshell_model_set_force(m, "edge_y0", 1, force, NULL);
   keep_model_status(r, finshell_model_settle(m, &record, &status), &status);
   keep_record(r, &record);
   keep_model_status(r, finshell_model_settle(m, &record, &status), &status); /* nothing is pending */
   keep_record(r, &record);
   finshell_model_destroy(m, NULL);
   keep_model_status(r, finshell_model_settle(NULL, &record, &status), &status);
}

static void model_checkpoint(const world *w, results *r)
{
   finshell_model *m = model_of(w);
   finshell_model_status status;
   for (int32_t slot = -1; slot < 9; slot++) keep_model_status(r, finshell_model_checkpoint(m, slot, &status), &status);
   finshell_model_destroy(m, NULL);
}

static void model_restore(const world *w, results *r)
{
   finshell_model *m = model_of(w);
   finshell_model_status status;
   keep_model_status(r, finshell_model_restore(m, 3, &status), &status); /* nothing was kept there */
   for (int i = 0; i < 2; i++) {
      if (i == 0) finshell_model_checkpoint(m, 3, NULL);
      if (i == 1) keep_model_status(r, finshell_model_restore(m, 3, &status), &status);
      finshell_model_advance(m, 0.1, NULL, NULL);
      keep_motion(r, m);
   }
   finshell_model_destroy(m, NULL);
}

static void model_field(const world *w, results *r)
{
   static const char *const name[] = {"membrane_force", "energy", "section_force", "colour"};
   finshell_model *m = model_of(w);
   finshell_model_array a = {0};
   finshell_model_status status;
   finshell_model_advance(m, 0.1, NULL, NULL);
   for (int i = 0; i < 4; i++) keep_model_status(r, finshell_model_field(m, name[i], 0, &a, &status), &status);
   KEEP(a.values[0]);
   keep_model_status(r, finshell_model_field(m, "displacement", 3, &a, &status), &status);
   finshell_model_destroy(m, NULL);
}

static void model_history(const world *w, results *r)
{
   finshell_model *m = model_of(w);
   const double *values = NULL;
   int32_t rows = 0, columns = 0;
   finshell_model_status status;
   finshell_model_advance(m, 0.1, NULL, NULL);
   keep_model_status(r, finshell_model_history(m, &rows, &columns, &values, &status), &status);
   KEEP(rows);
   if (values) KEEP(values[rows * columns - 1]);
   finshell_model_destroy(m, NULL);
   keep_model_status(r, finshell_model_history((finshell_model *)nothing, &rows, &columns, &values, &status), &status);
}

/* In a folder of its own, which goes. */
static void model_write(const world *w, results *r)
{
   static const char *const ending[] = {".vtkhdf", ".xdmf", ".history.csv"};
   char folder[] = "/tmp/finshell_guards_XXXXXX", name[80], file[120];
   finshell_model *m = model_of(w);
   finshell_model_status status;
   int32_t code;
   if (!mkdtemp(folder)) abort();
   snprintf(name, sizeof name, "%s/strip", folder);
   for (int i = 0; i < 2; i++) {
      keep_model_status(r, finshell_model_write(m, name, &status), &status);
      finshell_model_advance(m, 0.1, NULL, NULL);
   }
   code = finshell_model_write(m, "/no/such/folder/strip", &status); /* a model has one set of files; the message names it */
   KEEP(code);
   keep_model_status(r, finshell_model_destroy(m, &status), &status);
   for (int i = 0; i < 3; i++) {
      snprintf(file, sizeof file, "%s%s", name, ending[i]);
      code = remove(file);
      KEEP(code);
   }
   code = rmdir(folder);
   KEEP(code);
   m = model_of(w);
   keep_model_status(r, finshell_model_write(m, "/no/such/folder/strip", &status), &status);
   finshell_model_destroy(m, NULL);
}

static const entry all[] = {
   ENTRY(model_abi), ENTRY(model_create), ENTRY(model_destroy), ENTRY(model_sizes), ENTRY(model_text), ENTRY(model_mesh_arrays),
   ENTRY(model_set_members), ENTRY(model_state), ENTRY(model_advance), ENTRY(model_set_force), ENTRY(model_set_displacement),
   ENTRY(model_settle), ENTRY(model_checkpoint), ENTRY(model_restore), ENTRY(model_field), ENTRY(model_history), ENTRY(model_write),
};

int main(int argc, char **argv)
{
   const world w = {INPUT("1")}, several = {INPUT("4")};
   silence();
   rounds = 1; /* models are made in turn */
   guard(all, sizeof all / sizeof *all, &w, &several, argc, argv);
   return finish();
}
