/* Assembly as a host may use it: any number of threads, one layout in many threads, forks, traps; what is refused, and what fails. */
#define _GNU_SOURCE
#include <fenv.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include "check_assembly.h"

static finshell_status status;
static int m = 24; /* squares along a side */

static void refused(int32_t code, const char *word, int line)
{
   check(code == FINSHELL_INVALID_ARGUMENT && status.code == code && status.index == -1 && status.failed == 0, word, line);
   if (!strstr(status.message, word)) check(0, status.message, line);
}
#define REFUSED(call, word) refused((call), (word), __LINE__)

/* All that a host gets in one state, and where it is kept. */
typedef struct {
   double energy, volume, *force, *values;
   size_t forces, entries;
} result;

static result evaluate(const finshell_assembly *a, finshell_section *const s[KINDS], grid g, int threads)
{
   const finshell_section *const *list = (const finshell_section *const *)s;
   finshell_elements b = block_of_grid(g, FINSHELL_ROTATION_VECTOR);
   result r;
   int64_t entries;
   CHECK(finshell_assembly_size(a, NULL, NULL, &entries, NULL) == 0);
   b.threads = threads;
   r.forces = 6 * g.nodes, r.entries = entries;
   r.force = calloc(r.forces, sizeof(double)), r.values = calloc(r.entries, sizeof(double));
   CHECK(finshell_assembly_evaluate(a, KINDS, list, &b, &r.energy, r.force, r.values, NULL, NULL) == 0);
   CHECK(finshell_assembly_pressure(a, &b, g.pressure, 0, NULL, -1, r.force, r.values, NULL, NULL) == 0);
   CHECK(finshell_assembly_volume(a, &b, NULL, NULL, &r.volume, r.force, NULL, NULL) == 0);
   CHECK(finshell_assembly_mass(a, KINDS, list, &b, 2, r.force, r.values, NULL, NULL) == 0);
   return r;
}

static int equal(result a, result b)
{
   return memcmp(&a.energy, &b.energy, sizeof(double)) == 0 && memcmp(&a.volume, &b.volume, sizeof(double)) == 0 &&
          memcmp(a.force, b.force, sizeof(double) * a.forces) == 0 && memcmp(a.values, b.values, sizeof(double) * a.entries) == 0;
}

static void drop(result r)
{
   free(r.force), free(r.values);
}

static finshell_assembly *assembly_of(grid g, int triangle, finshell_section *s[KINDS])
{
   finshell_mesh mesh = mesh_of(g, triangle);
   finshell_assembly *a = NULL;
   kinds(s);
   CHECK(finshell_assembly_create(&mesh, KINDS, (const finshell_section *const *)s, &a, &status) == 0);
   return a;
}

static void threads(int most)
{
   static const int number[] = {2, 3, 8, 0, 64};
   for (int triangle = 0; triangle < 2; triangle++) {
      grid g = new_grid(m, 41);
      finshell_section *s[KINDS];
      finshell_assembly *a = assembly_of(g, triangle, s);
      result first = evaluate(a, s, g, 1);
      for (int i = 0; i < 5; i++) {
         if (number[i] > most) continue;
         result other = evaluate(a, s, g, number[i]);
         CHECK(equal(first, other));
         drop(other);
      }
      drop(first);
      finshell_assembly_destroy(a);
      free_kinds(s);
      free_grid(g);
   }
}

/* Threads of the host with one layout, each with a state of its own. */
typedef struct {
   const finshell_assembly *a;
   finshell_section **s;
   grid g;
   result r;
   int same;
} task;

static void *work(void *argument)
{
   task *t = argument;
   result r = {0};
   finshell_elements b = block_of_grid(t->g, FINSHELL_ROTATION_VECTOR);
   r.forces = t->r.forces, r.entries = t->r.entries;
   r.force = calloc(r.forces, sizeof(double)), r.values = calloc(r.entries, sizeof(double));
   finshell_assembly_evaluate(t->a, KINDS, (const finshell_section *const *)t->s, &b, &r.energy, r.force, r.values, NULL, NULL);
   finshell_assembly_pressure(t->a, &b, t->g.pressure, 0, NULL, -1, r.force, r.values, NULL, NULL);
   finshell_assembly_volume(t->a, &b, NULL, NULL, &r.volume, r.force, NULL, NULL);
   finshell_assembly_mass(t->a, KINDS, (const finshell_section *const *)t->s, &b, 2, r.force, r.values, NULL, NULL);
   t->same = equal(t->r, r);
   drop(r);
   return NULL;
}

static void hosts_threads(int number)
{
   grid g = new_grid(6, 2);
   finshell_section *s[KINDS];
   finshell_assembly *a = assembly_of(g, FINSHELL_WHOLE, s);
   task tasks[64];
   pthread_t id[64];
   for (int i = 0; i < number; i++) {
      tasks[i].a = a, tasks[i].s = s, tasks[i].g = new_grid(6, 2 + i), tasks[i].same = 0;
      tasks[i].r = evaluate(a, s, tasks[i].g, 1);
   }
   for (int i = 0; i < number; i++) CHECK(pthread_create(&id[i], NULL, work, &tasks[i]) == 0);
   for (int i = 0; i < number; i++) {
      CHECK(pthread_join(id[i], NULL) == 0 && tasks[i].same);
      drop(tasks[i].r);
      free_grid(tasks[i].g);
   }
   finshell_assembly_destroy(a);
   free_kinds(s);
   free_grid(g);
}

/* The child of a process that has used several threads gets the same, and does not wait for ever. */
static void children(void)
{
   grid g = new_grid(m, 7);
   finshell_section *s[KINDS];
   finshell_assembly *a = assembly_of(g, FINSHELL_UPPER, s);
   result before = evaluate(a, s, g, 4);
   pid_t child = fork();
   if (child == 0) {
      alarm(100);
      result r = evaluate(a, s, g, 4);
      _exit(equal(before, r) ? 0 : 1);
   }
   int outcome = -1;
   CHECK(child > 0 && waitpid(child, &outcome, 0) == child && outcome == 0);
   drop(before);
   finshell_assembly_destroy(a);
   free_kinds(s);
   free_grid(g);
}

/* Without memory an assembly is refused, and nothing ends the program. */
static void memory(void)
{
   grid g = new_grid(m, 7);
   finshell_section *s[KINDS];
   finshell_assembly *a = assembly_of(g, FINSHELL_WHOLE, s);
   finshell_mesh mesh = mesh_of(g, FINSHELL_WHOLE);
   pid_t child = fork();
   if (child == 0) {
      const struct rlimit none = {1 << 20, RLIM_INFINITY};
      finshell_assembly *other;
      setrlimit(RLIMIT_AS, &none);
      mesh.elements = 1 << 20; /* memory is asked for before they are looked at */
      int32_t code = finshell_assembly_create(&mesh, KINDS, (const finshell_section *const *)s, &other, &status);
      _exit(code == FINSHELL_OUT_OF_MEMORY && other == NULL ? 0 : 1);
   }
   int outcome = -1;
   CHECK(child > 0 && waitpid(child, &outcome, 0) == child && outcome == 0);
   finshell_assembly_destroy(a);
   free_kinds(s);
   free_grid(g);
}

#ifndef FINSHELL_TRAPS
static const int traps = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW;

static void undisturbed(int line)
{
   int found = fetestexcept(FE_ALL_EXCEPT), enabled = fegetexcept();
   fedisableexcept(FE_ALL_EXCEPT);
   check(found == FE_UNDERFLOW && enabled == traps, "flags or traps are not as they were", line);
   feclearexcept(FE_ALL_EXCEPT);
   feraiseexcept(FE_UNDERFLOW);
   feenableexcept(traps);
}
#define UNDISTURBED(call) ((void)(call), undisturbed(__LINE__))

/* Every function, with sound elements and with some that are not, leaves flags and traps alone. */
static void environment(void)
{
   for (int damage = 0; damage < 4; damage++)
      for (int number = 1; number <= 2; number++) {
         grid g = new_grid(8, 5);
         finshell_section *s[KINDS];
         finshell_assembly *a, *other = NULL;
         finshell_mesh mesh = mesh_of(g, FINSHELL_WHOLE);
         finshell_elements b = block_of_grid(g, FINSHELL_ROTATION_VECTOR);
         const finshell_section *const *list = (const finshell_section *const *)s;
         const int32_t element[] = {0, 50}, side[] = {0, 1};
         double load[2][3] = {{1, 2, 3}, {1, 1, 1}}, energy = 0, volume = 0, gravity[3] = {0, 0, 1};
         a = assembly_of(g, FINSHELL_WHOLE, s);
         result r = evaluate(a, s, g, 1);
         b.threads = number;
         if (damage == 1) g.u[40] = NAN, g.X[3] = INFINITY;
         if (damage == 2) memcpy(g.X + 3, g.X, 3 * sizeof(double)), g.u[60] = 1e300;
         if (damage == 3) g.pressure[7] = 1e308, load[1][1] = NAN, gravity[2] = 1e308, g.traction[4] = INFINITY, g.normals[5] = -3;
         feclearexcept(FE_ALL_EXCEPT);
         feraiseexcept(FE_UNDERFLOW);
         feenableexcept(traps);
         UNDISTURBED(finshell_assembly_create(&mesh, KINDS, list, &other, &status));
         UNDISTURBED(finshell_assembly_evaluate(a, KINDS, list, &b, &energy, r.force, r.values, NULL, &status));
         UNDISTURBED(finshell_assembly_pressure(a, &b, g.pressure, 0, NULL, 1, r.force, r.values, NULL, &status));
         UNDISTURBED(finshell_assembly_volume(a, &b, g.pressure, NULL, &volume, r.force, NULL, &status));
         UNDISTURBED(finshell_assembly_mass(a, KINDS, list, &b, 1, r.force, r.values, NULL, &status));
         UNDISTURBED(finshell_assembly_traction(a, g.X, g.traction, 1, r.force, NULL, &status));
         UNDISTURBED(finshell_assembly_gravity(a, KINDS, list, &b, gravity, 1, r.force, NULL, &status));
         UNDISTURBED(finshell_assembly_line_load(a, &b, 2, element, side, load[0], 1, r.force, r.values, NULL, &status));
         UNDISTURBED(finshell_assembly_destroy(other));
         fedisableexcept(FE_ALL_EXCEPT);
         if (damage < 3) CHECK(isfinite(energy) && isfinite(volume));
         if (damage < 3)
            for (size_t i = 0; i < r.forces; i++) CHECK(isfinite(r.force[i]));
         drop(r);
         finshell_assembly_destroy(a);
         free_kinds(s);
         free_grid(g);
      }
}
#endif

/* A failed element adds nothing, has its code, and is named. */
static void failures_of_elements(void)
{
   grid g = new_grid(6, 3);
   finshell_section *s[KINDS];
   finshell_assembly *a = assembly_of(g, FINSHELL_WHOLE, s);
   const finshell_section *const *list = (const finshell_section *const *)s;
   finshell_elements b = block_of_grid(g, FINSHELL_ROTATION_VECTOR);
   int32_t codes[72], failed = 0;
   double force[6 * 49] = {0}, energy;
   memset(g.normals, 0, sizeof(double) * 3); /* of element 0 */
   CHECK(finshell_assembly_evaluate(a, KINDS, list, &b, &energy, force, NULL, codes, &status) == FINSHELL_INVALID_ARGUMENT);
   CHECK(status.index == 0 && status.failed == 1 && strstr(status.message, "element 0 (from 0): the normal at node 0"));
   CHECK(codes[0] == FINSHELL_INVALID_ARGUMENT && codes[1] == 0 && isfinite(energy) && force[6 * 20] != 0);
   b.normals = NULL;
   g.u[3 * 10] = NAN;
   CHECK(finshell_assembly_evaluate(a, KINDS, list, &b, &energy, force, NULL, codes, &status) == FINSHELL_NOT_A_NUMBER);
   for (int e = 0; e < 72; e++) {
      int touched = 0;
      for (int k = 0; k < 3; k++) touched |= g.triangles[3 * e + k] == 10;
      CHECK((codes[e] == FINSHELL_NOT_A_NUMBER) == touched && (codes[e] == 0) == !touched);
      failed += touched;
   }
   CHECK(status.failed == failed && failed > 0 && isfinite(energy));
   g.u[3 * 10] = 0;
   const int32_t element[] = {1, 2}, side[] = {0, 1};
   const double load[2][3] = {{1, 0, 0}, {0, NAN, 0}};
   CHECK(finshell_assembly_line_load(a, &b, 2, element, side, load[0], 1, force, NULL, codes, &status) == FINSHELL_NOT_A_NUMBER);
   CHECK(status.index == 1 && strstr(status.message, "load 1 (from 0)") && codes[0] == 0);
   memcpy(g.X + 3 * g.triangles[1], g.X + 3 * g.triangles[0], 3 * sizeof(double));
   CHECK(finshell_assembly_mass(a, KINDS, list, &b, 1, force, NULL, codes, &status) == FINSHELL_DEGENERATE_REFERENCE);
   CHECK(finshell_assembly_traction(a, g.X, g.traction, 1, force, codes, &status) == FINSHELL_DEGENERATE_REFERENCE);
   CHECK(codes[0] == FINSHELL_DEGENERATE_REFERENCE);
   for (int i = 0; i < 6 * 49; i++) CHECK(isfinite(force[i]));
   finshell_assembly_destroy(a);
   free_kinds(s);
   free_grid(g);
}

static void refusals(void)
{
   grid g = new_grid(4, 3);
   finshell_section *s[KINDS], *swapped[KINDS];
   finshell_assembly *a, *b = (finshell_assembly *)1;
   finshell_mesh mesh = mesh_of(g, FINSHELL_WHOLE), c;
   const finshell_section *const *list = (const finshell_section *const *)s;
   const int32_t one[] = {0}, large[] = {32}, three[] = {3}, freedoms[150] = {0};
   const int64_t starts[400] = {0};
   const double load[3] = {1, 1, 1};
   double force[150];
   a = assembly_of(g, FINSHELL_WHOLE, s);
   finshell_elements e = block_of_grid(g, FINSHELL_ROTATION_VECTOR), f;
   int32_t corner;
#define CREATE(word) REFUSED(finshell_assembly_create(&c, KINDS, list, &b, &status), word), CHECK(b == NULL)
   REFUSED(finshell_assembly_create(NULL, KINDS, list, &b, &status), "mesh is NULL");
   REFUSED(finshell_assembly_create(&mesh, KINDS, list, NULL, &status), "assembly is NULL");
   REFUSED(finshell_assembly_create(&mesh, 0, list, &b, &status), "sections is 0");
   REFUSED(finshell_assembly_create(&mesh, KINDS, NULL, &b, &status), "section is NULL");
   c = mesh, c.size = 0, CREATE("mesh->size is 0");
   c = mesh, c.size = 1u << 20, CREATE("mesh->size is not set");
   c = mesh, c.nodes = -1, CREATE("mesh->nodes is -1");
   c = mesh, c.elements = -4, CREATE("mesh->elements is -4");
   c = mesh, c.nodal = 5, CREATE("mesh->nodal is 5");
   c = mesh, c.nodal = 3, CREATE("mesh->nodal is 3");
   c = mesh, c.triangle = 2, CREATE("mesh->triangle is 2");
   c = mesh, c.reserved = 1, CREATE("mesh->reserved is 1");
   c = mesh, c.rows = 9, CREATE("mesh->rows is 9, expected 0");
   c = mesh, c.triangles = NULL, CREATE("mesh->triangles is NULL");
   c = mesh, c.starts = starts, CREATE("go together");
   c = mesh, c.starts = starts, c.columns = one, CREATE("needs mesh->freedoms");
   c = mesh, c.nodes = 20, CREATE("names a node that is not in");
   corner = g.triangles[16], g.triangles[16] = g.triangles[15], c = mesh, CREATE("element 5 names a node twice");
   g.triangles[16] = -1, CREATE("element 5 names a node that is not in");
   g.triangles[16] = corner, g.sections[9] = 3, CREATE("element 9 has a section that is not in");
   g.sections[9] = 0, c.freedoms = freedoms, CREATE("two freedoms with the same number");
   {
      int32_t own[150];
      for (int i = 0; i < 150; i++) own[i] = i;
      c.freedoms = own, c.rows = 100, CREATE("mesh->rows is 100");
      own[77] = -2, c.rows = 0, CREATE("node 12 has a number below -1");
      own[77] = 77, c.starts = starts, c.columns = one, CREATE("lacks entries of element");
   }
   REFUSED(finshell_assembly_size((finshell_assembly *)s[0], NULL, NULL, NULL, &status), "assembly is no handle");
   REFUSED(finshell_assembly_size(NULL, NULL, NULL, NULL, &status), "assembly is NULL");
   REFUSED(finshell_assembly_freedoms(a, NULL, &status), "freedoms is NULL");
   REFUSED(finshell_assembly_pattern(NULL, NULL, NULL, &status), "assembly is NULL");
   REFUSED(finshell_assembly_pattern_64(NULL, NULL, NULL, &status), "assembly is NULL");
   REFUSED(finshell_assembly_evaluate(a, 2, list, &e, NULL, force, NULL, NULL, &status), "sections is 2");
   REFUSED(finshell_assembly_evaluate(a, KINDS, NULL, &e, NULL, force, NULL, NULL, &status), "section is NULL");
   memcpy(swapped, s, sizeof swapped), swapped[1] = s[2];
   REFUSED(finshell_assembly_evaluate(a, KINDS, (const finshell_section *const *)swapped, &e, NULL, force, NULL, NULL, &status),
           "section 1 (from 0) is of another kind");
   swapped[1] = NULL;
   REFUSED(finshell_assembly_mass(a, KINDS, (const finshell_section *const *)swapped, &e, 1, force, NULL, NULL, &status),
           "section is NULL");
   REFUSED(finshell_assembly_evaluate(a, KINDS, list, NULL, NULL, force, NULL, NULL, &status), "elements is NULL");
#define EVALUATE(word) REFUSED(finshell_assembly_evaluate(a, KINDS, list, &f, NULL, force, NULL, NULL, &status), word)
   f = e, f.n = 5, EVALUATE("elements->n is 5");
   f = e, f.threads = -1, EVALUATE("threads is -1");
   f = e, f.X = NULL, EVALUATE("X is NULL");
   f = e, f.u = NULL, EVALUATE("u is NULL");
   f = e, f.rotations = NULL, EVALUATE("rotations is NULL");
   f = e, f.convention = 4, EVALUATE("convention is 4");
   f = e, f.convention = FINSHELL_ROTATION_INCREMENT, f.state = NULL, EVALUATE("state is NULL");
   f = e, f.size = 8, EVALUATE("elements->size is 8");
   REFUSED(finshell_assembly_pressure(a, &e, NULL, 0, NULL, 1, force, NULL, NULL, &status), "pressure is NULL");
   REFUSED(finshell_assembly_pressure(a, &e, g.pressure, 2, NULL, 1, force, NULL, NULL, &status), "form is 2");
   REFUSED(finshell_assembly_volume(a, NULL, NULL, NULL, NULL, force, NULL, &status), "elements is NULL");
   REFUSED(finshell_assembly_mass(a, KINDS, list, NULL, 1, force, NULL, NULL, &status), "elements is NULL");
   f = e, f.X = NULL;
   REFUSED(finshell_assembly_mass(a, KINDS, list, &f, 1, force, NULL, NULL, &status), "X is NULL");
   REFUSED(finshell_assembly_traction(a, g.X, NULL, 1, force, NULL, &status), "traction is NULL");
   REFUSED(finshell_assembly_traction(a, g.X, g.traction, 1, NULL, NULL, &status), "force is NULL");
   REFUSED(finshell_assembly_gravity(a, KINDS, list, &e, NULL, 1, force, NULL, &status), "acceleration is NULL");
   REFUSED(finshell_assembly_line_load(a, &e, -1, one, one, load, 1, force, NULL, NULL, &status), "n is -1");
   REFUSED(finshell_assembly_line_load(a, &e, 1, NULL, one, load, 1, force, NULL, NULL, &status), "element, side or load");
   REFUSED(finshell_assembly_line_load(a, &e, 1, large, one, load, 1, force, NULL, NULL, &status), "on an element that is not in");
   REFUSED(finshell_assembly_line_load(a, &e, 1, one, three, load, 1, force, NULL, NULL, &status), "on a side that is not 0, 1 or 2");
   finshell_assembly_destroy(a);
   finshell_assembly_destroy(NULL);
   /* nothing at all */
   c = mesh, c.nodes = 0, c.elements = 0;
   CHECK(finshell_assembly_create(&c, 0, NULL, &a, &status) == 0);
   int64_t entries = 7;
   CHECK(finshell_assembly_size(a, NULL, NULL, &entries, &status) == 0 && entries == 0);
   f = e, f.n = 0;
   CHECK(finshell_assembly_evaluate(a, 0, NULL, &f, NULL, NULL, NULL, NULL, &status) == 0);
   finshell_assembly_destroy(a);
   free_kinds(s);
   free_grid(g);
}

/* Argument: squares along a side; 0: the threads of a host alone (for the thread sanitizer, which does not know OpenMP). */
int main(int argc, char **argv)
{
   silence();
   if (argc > 1) m = atoi(argv[1]);
   hosts_threads(m ? 64 : 8);
   if (m == 0) return finish();
   threads(m > 20 ? 64 : 3);
   refusals();
   failures_of_elements();
#ifndef FINSHELL_TRAPS
   if (m > 20) environment(); /* valgrind knows no traps */
#endif
   if (m > 20) memory();
   children();
   return finish();
}
