/* The whole model from C: read, built from arrays, step by step, forces and displacements of the host, checkpoints, fields, two
 * models in two threads, refusals; under traps for floating-point exceptions where the build allows it. */
#define _GNU_SOURCE
#include "../api/check.h"

#include <fenv.h>
#include <finshell_model.h>
#include <pthread.h>

static finshell_model_status status;

#define HEAD "&job title = 'A strip' name = 'strip' threads = 1 /\n"
#define BODY \
   "&material name = 'm' law = 'linear_elastic' e = 1.0e6 nu = 0.3 density = 1000.0 /\n" \
   "&section material = 'm' thickness = 0.01 /\n" \
   "&support node_set = 'edge_x0' type = 'clamped' /\n" \
   "&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /\n"
#define GENERATED "&mesh generator = 'rectangle' lengths = 1.0, 0.2 divisions = 6, 2 /\n"
#define LOAD "&load type = 'force' node_set = 'edge_x1' vector = 0.0, 0.0, 0.02 /\n"
#define STATIC "&step name = 'bend' tolerance = 'tight' /\n"
#define DYNAMIC "&step name = 'swing' control = 'dynamic' duration = 0.2 /\n"

static finshell_model *model_of(const char *text)
{
   finshell_model *model = NULL;
   check(finshell_model_create("strip.nml", text, NULL, &model, &status) == 0, status.message, __LINE__);
   return model;
}

static void destroy(finshell_model *model)
{
   CHECK(finshell_model_destroy(model, &status) == 0);
}

/* The last value of the last column of the history. */
static double last(finshell_model *model)
{
   int32_t rows = 0, columns = 0;
   const double *values = NULL;
   CHECK(finshell_model_history(model, &rows, &columns, &values, &status) == 0);
   return rows > 0 ? values[rows * columns - 1] : 0;
}

static double run(finshell_model *model, int *increments)
{
   finshell_model_record r;
   *increments = 0;
   do {
      check(finshell_model_advance(model, 0, &r, &status) == 0, status.message, __LINE__);
      *increments += r.reports;
   } while (r.reports > 0 && *increments < 1000);
   CHECK(r.finished == 1 && r.increment >= *increments);
   return last(model);
}

static void content(void)
{
   finshell_model *m = model_of(HEAD GENERATED BODY LOAD STATIC);
   finshell_model_size n;
   finshell_model_record r;
   char text[200];
   int32_t length, number;
   const int32_t *members, *triangles;
   const double *coordinates;
   CHECK(finshell_model_abi() == FINSHELL_MODEL_ABI);
   CHECK(finshell_model_sizes(m, &n, &status) == 0 && n.nodes == 21 && n.elements == 24 && n.steps == 1 && n.columns == 10);
   CHECK(finshell_model_text(m, "title", text, sizeof text, &length, &status) == 0 && !strcmp(text, "A strip") && length == 7);
   CHECK(finshell_model_text(m, "columns", text, sizeof text, NULL, &status) == 0 && strstr(text, "load_factor\n"));
   CHECK(finshell_model_text(m, "title", text, 4, NULL, &status) == 0 && !strcmp(text, "A s"));
   CHECK(finshell_model_text(m, "colour", NULL, 0, NULL, &status) == -4 && strstr(status.message, "there are: title"));
   CHECK(finshell_model_set_members(m, FINSHELL_MODEL_NODES, "edge_x1", &number, &members, &status) == 0 && number == 3);
   CHECK(finshell_model_mesh_arrays(m, &coordinates, &triangles, &status) == 0);
   for (int i = 0; i < number; i++) CHECK_CLOSE(coordinates[3 * members[i]], 1.0, 0);
   for (int i = 0; i < 3 * n.elements; i++) CHECK(triangles[i] >= 0 && triangles[i] < n.nodes);
   CHECK(finshell_model_set_members(m, FINSHELL_MODEL_ELEMENTS, "all", &number, &members, &status) == 0 && number == 24);
   CHECK(finshell_model_set_members(m, FINSHELL_MODEL_NODES, "nobody", &number, &members, &status) == -1
         && strstr(status.message, "'nobody'"));
   CHECK(finshell_model_state(m, &r, &status) == 0 && r.increment == 0 && r.finished == 0 && !strcmp(r.step_name, "bend"));
   destroy(m);
}

/* Forces of the host are those of the input. */
static void forces(void)
{
   int increments;
   const double force[] = {0, 0, 0.02}, none[] = {0, 0, 0};
   finshell_model_record r;
   finshell_model *m = model_of(HEAD GENERATED BODY LOAD STATIC);
   double w = run(m, &increments), half;
   CHECK(increments > 1 && w > 0.3);
   destroy(m);
   m = model_of(HEAD GENERATED BODY STATIC);
   CHECK(finshell_model_set_force(m, "edge_x1", 1, force, &status) == 0);
   CHECK(finshell_model_settle(m, &r, &status) == 0 && r.reports > 0);
   CHECK_CLOSE(last(m), w, 1e-9);
   CHECK(finshell_model_settle(m, &r, &status) == 0 && r.reports == 0);
   CHECK(finshell_model_set_force(m, "edge_x1", 1, none, &status) == 0 && finshell_model_settle(m, NULL, &status) == 0);
   CHECK_CLOSE(last(m), 0, 1e-9);
   destroy(m);
   /* the same way by given sizes */
   m = model_of(HEAD GENERATED BODY LOAD STATIC);
   CHECK(finshell_model_advance(m, 0.5, &r, &status) == 0);
   CHECK_CLOSE(r.load_factor, 0.5, 0);
   half = last(m);
   CHECK(finshell_model_advance(m, 0.25, &r, &status) == 0);
   CHECK_CLOSE(r.load_factor, 0.75, 1e-15);
   CHECK(half < last(m) && last(m) < w);
   run(m, &increments);
   CHECK_CLOSE(last(m), w, 1e-9);
   destroy(m);
}

static void displacements(void)
{
   const double up = 0.3, crooked[] = {0.3, 0.31, 0.32};
   finshell_model_record r;
   finshell_model_array a;
   const int32_t *members;
   finshell_model *m = model_of(HEAD GENERATED BODY "&support node_set = 'edge_x1' fixed = 'uz' /\n" STATIC);
   CHECK(finshell_model_set_displacement(m, "edge_x1", 2, 1, &up, &status) == 0);
   CHECK(finshell_model_settle(m, &r, &status) == 0 && r.reports > 0);
   CHECK_CLOSE(last(m), 0.3, 1e-15);
   CHECK(finshell_model_set_displacement(m, "edge_x1", 2, 3, crooked, &status) == 0);
   CHECK(finshell_model_settle(m, &r, &status) == 0);
   CHECK(finshell_model_set_members(m, 0, "edge_x1", NULL, &members, &status) == 0);
   CHECK(finshell_model_field(m, "displacement", 0, &a, &status) == 0 && a.items == 21 && a.components == 3 && a.places == 1);
   for (int i = 0; i < 3; i++) CHECK_CLOSE(a.values[3 * members[i] + 2], crooked[i], 1e-15);
   CHECK(finshell_model_set_displacement(m, "edge_x1", 1, 1, &up, &status) == -4 && strstr(status.message, "no &support"));
   CHECK(finshell_model_set_displacement(m, "edge_x1", 3, 1, &up, &status) == -4 && strstr(status.message, "expected 0, 1 or 2 for x, y or z"));
   CHECK(finshell_model_set_displacement(m, "edge_x1", 2, 2, crooked, &status) == -4 && strstr(status.message, "3 nodes; expected as many, or one for all"));
   CHECK(finshell_model_settle(m, &r, &status) == 0 && r.reports == 0);
   destroy(m);
}

/* In motion: back to a checkpoint and the same again, bit for bit; times are met. */
static void motion(void)
{
   double force[] = {0, 0, 0}, first, velocity[63];
   finshell_model_record r;
   finshell_model_array a, b;
   finshell_model *m = model_of(HEAD GENERATED BODY DYNAMIC);
   for (int i = 1; i <= 7; i++) {
      force[2] = 0.01 * i;
      CHECK(finshell_model_checkpoint(m, i % 8, &status) == 0);
      CHECK(finshell_model_set_force(m, "edge_x1", 1, force, &status) == 0);
      check(finshell_model_advance(m, 0.03, &r, &status) == 0, status.message, __LINE__);
      first = last(m);
      CHECK_CLOSE(r.time, i < 7 ? 0.03 * i : 0.2, 1e-12);
      CHECK(finshell_model_field(m, "velocity", 0, &a, &status) == 0 && a.items == 21);
      memcpy(velocity, a.values, sizeof velocity);
      CHECK(finshell_model_restore(m, i % 8, &status) == 0);
      CHECK(finshell_model_set_force(m, "edge_x1", 1, force, &status) == 0);
      CHECK(finshell_model_advance(m, 0.03, &r, &status) == 0);
      CHECK(last(m) == first);
      CHECK(finshell_model_field(m, "velocity", 0, &b, &status) == 0 && b.values == a.values);
      CHECK(!memcmp(velocity, b.values, sizeof velocity));
   }
   CHECK(finshell_model_settle(m, NULL, &status) == 0); /* nothing is pending */
   force[2] = 0;
   CHECK(finshell_model_set_force(m, "edge_x1", 1, force, &status) == 0);
   CHECK(finshell_model_settle(m, NULL, &status) == -4 && strstr(status.message, "in motion"));
   CHECK(finshell_model_advance(m, 0, &r, &status) == 0 && r.reports == 0 && r.finished == 1);
   destroy(m);
}

/* A mesh as arrays, two triangles, and its sets. */
static void arrays(void)
{
   static const char text[] = "&mesh /\n&material name = 'm' law = 'neo_hookean' mu = 1.0 /\n&section material = 'm' thickness = 0.1 /\n"
      "&support node_set = 'held' type = 'clamped' /\n&load type = 'pressure' pressure = 0.001 element_set = 'one' /\n&step /\n";
   double x[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
   int32_t t[] = {0, 1, 2, 0, 2, 3}, held[] = {3, 0}, one[] = {1}, far[] = {4};
   finshell_model_set sets[] = {{"held", FINSHELL_MODEL_NODES, 2, held}, {"one", FINSHELL_MODEL_ELEMENTS, 1, one},
                                {"side", FINSHELL_MODEL_EDGES, 1, held}};
   finshell_model_mesh mesh = {sizeof mesh, 4, 2, 3, 0, x, t, sets};
   finshell_model *m = NULL;
   int increments;
   const int32_t *members;
   CHECK(finshell_model_create("sheet", text, &mesh, &m, &status) == 0);
   CHECK(finshell_model_set_members(m, 0, "held", NULL, &members, &status) == 0 && members[0] == 0 && members[1] == 3);
   CHECK(finshell_model_set_members(m, 0, "side", NULL, &members, &status) == 0 && members[0] == 0 && members[1] == 3);
   run(m, &increments);
   destroy(m);
   CHECK(finshell_model_create("sheet", GENERATED BODY STATIC, &mesh, &m, &status) == -4 && strstr(status.message, "sheet:1: &mesh")
         && strstr(status.message, "neither file nor generator is expected"));
   sets[1].members = far;
   CHECK(finshell_model_create("sheet", text, &mesh, &m, &status) == -1 && strstr(status.message, "'one'"));
   sets[1].members = one;
   sets[1].name = NULL;
   CHECK(finshell_model_create("sheet", text, &mesh, &m, &status) == -1 && strstr(status.message, "no name"));
   sets[1].name = "one";
   t[0] = 7;
   CHECK(finshell_model_create("sheet", text, &mesh, &m, &status) < 0 && strstr(status.message, "sheet:1: &mesh"));
   t[0] = 0;
   x[0] = NAN;
   CHECK(finshell_model_create("sheet", text, &mesh, &m, &status) < 0 && strstr(status.message, "a coordinate of node 1 is NaN or infinite"));
   mesh.size = 8;
   CHECK(finshell_model_create("sheet", text, &mesh, &m, &status) == -1 && strstr(status.message, "sizeof"));
   mesh.size = sizeof mesh;
   mesh.elements = 0;
   CHECK(finshell_model_create("sheet", text, &mesh, &m, &status) == -1 && strstr(status.message, "no elements"));
   mesh.elements = 2;
   mesh.triangles = NULL;
   CHECK(finshell_model_create("sheet", text, &mesh, &m, &status) == -1 && strstr(status.message, "NULL"));
   CHECK(finshell_model_create("sheet", NULL, &mesh, &m, &status) == -1 && strstr(status.message, "goes with a text"));
   CHECK(m == NULL);
}

static void fields(void)
{
   finshell_model *m = model_of(HEAD GENERATED BODY LOAD STATIC
                                "&step name = 'modes' control = 'frequencies' modes = 2 /\n");
   finshell_model_array a;
   finshell_model_record r;
   int increments;
   while (finshell_model_advance(m, 0, &r, &status) == 0 && strcmp(r.control, "frequencies")) CHECK(r.reports > 0);
   CHECK(r.reports == 2);
   CHECK(finshell_model_field(m, "displacement", 2, &a, &status) == 0 && a.items == 21 && a.on == 1);
   CHECK(finshell_model_field(m, "displacement", 3, &a, &status) == -4 && strstr(status.message, "no linear solution or mode of this number"));
   CHECK(finshell_model_field(m, "membrane_force", 0, &a, &status) == 0 && a.items == 24 && a.on == 2 && isfinite(a.values[0]));
   CHECK(finshell_model_field(m, "energy", 0, &a, &status) == 0 && a.items == 1 && a.values[0] > 0);
   CHECK(finshell_model_field(m, "momentum", 0, &a, &status) == 0 && a.components == 3);
   CHECK(finshell_model_field(m, "section_force", 0, &a, &status) == -4 && strstr(status.message, "&monitor"));
   CHECK(finshell_model_field(m, "colour", 0, &a, &status) == -4 && strstr(status.message, "there are: displacement"));
   run(m, &increments);
   destroy(m);
}

/* What is wrong is told by codes and sentences; the model is as before. */
static void refusals(int watched)
{
   finshell_model *m = NULL, *other;
   finshell_model_record r;
   const double force[] = {0, 0, 1}, bad[] = {0, NAN, 0};
   int64_t nothing[4] = {0};
   CHECK(finshell_model_create("no_such.nml", NULL, NULL, &m, &status) < 0 && strstr(status.message, "no_such.nml"));
   CHECK(finshell_model_create("strip.nml", HEAD GENERATED "&material nme = 'm' /\n", NULL, &m, &status) == -4);
   CHECK(strstr(status.message, "strip.nml") && status.code == -4);
   CHECK(finshell_model_create("strip.nml", HEAD GENERATED BODY STATIC "&colour /\n", NULL, &m, NULL) == -4);
   CHECK(finshell_model_create("strip.nml", HEAD GENERATED BODY "&load type = 'pressure' pressure = 1.0 /\n" STATIC "&accuracy target = 0.1 /\n", NULL, &m, &status) == -4);
   CHECK(strstr(status.message, "&accuracy: a model that is taken step by step keeps its mesh"));
   CHECK(finshell_model_create(NULL, NULL, NULL, &m, &status) == -1 && finshell_model_create("x", "", NULL, NULL, &status) == -1);
   CHECK(m == NULL);
   CHECK(finshell_model_advance(NULL, 0, NULL, &status) == -1 && strstr(status.message, "NULL"));
   CHECK(finshell_model_advance((finshell_model *)nothing, 0, NULL, &status) == -1 && strstr(status.message, "no model"));
   CHECK(finshell_model_destroy((finshell_model *)nothing, &status) == -1 && finshell_model_destroy(NULL, &status) == 0);

   m = model_of(HEAD GENERATED BODY LOAD STATIC);
   other = m;
   CHECK(finshell_model_advance(m, -1, &r, &status) == -4 && strstr(status.message, "the size of an increment is"));
   CHECK(finshell_model_advance(m, NAN, &r, &status) == -4 && r.increment == 0);
   CHECK(finshell_model_set_force(m, "nobody", 1, force, &status) == -4 && strstr(status.message, "the mesh has no node set 'nobody'"));
   CHECK(finshell_model_set_force(m, "edge_x1", 1, bad, &status) == -4 && strstr(status.message, "is NaN or infinite"));
   CHECK(finshell_model_set_force(m, "edge_x1", 0, force, &status) == -1);
   CHECK(finshell_model_set_displacement(m, NULL, 0, 1, force, &status) == -1);
   CHECK(finshell_model_restore(m, 0, &status) == -4 && strstr(status.message, "no checkpoint"));
   CHECK(finshell_model_checkpoint(m, 8, &status) == -1 && strstr(status.message, "0 to 7"));
   CHECK(finshell_model_sizes(m, NULL, &status) == -1 && finshell_model_field(m, NULL, 0, NULL, &status) == -1);
   CHECK(finshell_model_text(m, NULL, NULL, 0, NULL, &status) == -1 && finshell_model_write(m, NULL, &status) == -1);
   CHECK(finshell_model_set_members(m, 2, "edge_x1", NULL, NULL, &status) == -1);
   destroy(m);
   if (!watched) CHECK(finshell_model_advance(other, 0, NULL, &status) != 0); /* reads freed memory, as the header says */

   /* a host that changes its mind where it cannot */
   m = model_of(HEAD GENERATED BODY LOAD "&step name = 'arc' control = 'arc_length' largest_increment = 0.3 /\n");
   CHECK(finshell_model_advance(m, 0, &r, &status) == 0);
   CHECK(finshell_model_set_force(m, "edge_x1", 1, force, &status) == 0);
   CHECK(finshell_model_advance(m, 0, &r, &status) == -4 && strstr(status.message, "step 'arc'"));
   destroy(m);

   /* joints move nodes by others */
   m = model_of(HEAD GENERATED BODY "&support node_set = 'edge_x1' fixed = 'uz' /\n&equal node_set = 'edge_y1' components = 'uy' /\n" STATIC);
   CHECK(finshell_model_set_displacement(m, "edge_x1", 2, 1, force + 2, &status) == -4);
   CHECK(strstr(status.message, "a host cannot prescribe displacements where there are joints"));
   destroy(m);

   /* energy is kept of what the host does not move only */
   m = model_of(HEAD GENERATED BODY "&support node_set = 'edge_x1' fixed = 'uz' /\n"
                "&step control = 'dynamic' duration = 0.1 scheme = 'conserving' /\n");
   CHECK(finshell_model_set_displacement(m, "edge_x1", 2, 1, force + 2, &status) == 0);
   CHECK(finshell_model_advance(m, 0.01, &r, &status) == -4 && strstr(status.message, "generalised_alpha"));
   destroy(m);

   /* an increment that fails: the state before it is left, and the way on with a smaller size is open */
   m = model_of(HEAD GENERATED BODY LOAD "&step maximum_iterations = 3 maximum_cuts = 0 descent = .false. fallback = .false. /\n");
   CHECK(finshell_model_advance(m, 1, &r, &status) > 0 && strlen(status.message) > 20 && r.increment == 0);
   CHECK(finshell_model_advance(m, 1e-4, &r, &status) == 0 && r.increment == 1);
   destroy(m);
}

static void *many(void *result)
{
   for (int i = 0; i < 3; i++) {
      finshell_model *one = NULL, *two = NULL;
      finshell_model_status own;
      finshell_model_record r, s;
      const double *values;
      int32_t rows, columns;
      if (finshell_model_create("a", HEAD GENERATED BODY LOAD STATIC, NULL, &one, &own)) return NULL;
      if (finshell_model_create("b", HEAD GENERATED BODY LOAD STATIC, NULL, &two, &own)) return NULL;
      do {
         if (finshell_model_advance(one, 0, &r, &own)) return NULL;
         if (finshell_model_advance(two, 0, &s, &own)) return NULL;
      } while (r.reports && s.reports);
      if (finshell_model_history(two, &rows, &columns, &values, &own)) return NULL;
      *(double *)result = values[rows * columns - 1];
      finshell_model_destroy(one, NULL);
      finshell_model_destroy(two, NULL);
   }
   return result;
}

/* Without the threads, for valgrind: test_model_calls alone */
static void together(void)
{
   enum { threads = 8 };
   pthread_t thread[threads];
   double w[threads] = {0};
   void *result;
   for (int i = 0; i < threads; i++) CHECK(pthread_create(&thread[i], NULL, many, &w[i]) == 0);
   for (int i = 0; i < threads; i++) {
      CHECK(pthread_join(thread[i], &result) == 0 && result == &w[i]);
      CHECK(w[i] == w[0] && w[i] > 0.3);
   }
}

int main(int argc, char **argv)
{
   silence();
#ifndef FINSHELL_TRAPS
   feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW);
   fesetround(FE_TONEAREST);
#endif
   content();
   forces();
   displacements();
   motion();
   fields();
#ifndef FINSHELL_TRAPS
   CHECK(fetestexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW) == 0);
   CHECK(argc > 1 || fegetexcept() == (FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW)); /* valgrind has no traps */
   fedisableexcept(FE_ALL_EXCEPT);
#endif
   arrays();
   refusals(argc > 1);
   if (argc < 2 || strcmp(argv[1], "alone")) together();
   return finish();
}
