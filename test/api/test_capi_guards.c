/* Every function of finshell.h, under guards: no flag raised and no trap tripped, 64 threads of a host at once, a child after a
 * fork; valgrind and the sanitizers see this program (test_sanitizers.py). The table at the end has one entry for each function;
 * test/structure/test_guards.py compares it with the header. Each entry calls its function as it is meant and with a mistake.
 *
 *    test_capi_guards [ROUNDS of each thread [memory | threads]]     memory: without flags, which valgrind does not have
 */
#define _GNU_SOURCE
#include <fenv.h>
#include <pthread.h>
#include <sys/wait.h>
#include "check.h"

enum { n = 17, points = 3 * n, room = 200000, workers = 64 }; /* elements are computed by eights: three times, for threads */

/* What all calls share and none changes. */
typedef struct {
   patch p;
   finshell_section *shell, *sheet;
   int32_t threads;
} world;

/* All that an entry has got, bytes one after the other. */
typedef struct {
   size_t used;
   unsigned char bytes[room];
} results;

static void keep(results *r, const void *data, size_t size)
{
   if (r->used + size > room) abort();
   memcpy(r->bytes + r->used, data, size);
   r->used += size;
}

#define KEEP(what) keep(r, &(what), sizeof(what))

static void keep_text(results *r, const char *text)
{
   keep(r, text, strlen(text) + 1);
}

/* Code and message of a call. */
static void keep_status(results *r, int32_t code, const finshell_status *status)
{
   KEEP(code);
   KEEP(status->code);
   KEEP(status->index);
   KEEP(status->failed);
   keep_text(r, status->message);
}

static finshell_elements block(const world *w)
{
   finshell_elements b = block_of(w->p, FINSHELL_ROTATION_VECTOR, w->p.normals);
   b.threads = w->threads;
   return b;
}

/* ------------------------------------------------------------------ version, messages, laws */

static void version_text(const world *w, results *r)
{
   (void)w;
   keep_text(r, finshell_version_text());
}

static void abi(const world *w, results *r)
{
   int32_t value = finshell_abi();
   (void)w;
   KEEP(value);
}

static void cpu_level(const world *w, results *r)
{
   int32_t value = finshell_cpu_level();
   (void)w;
   KEEP(value);
}

static void message(const world *w, results *r)
{
   char text[80];
   (void)w;
   for (int32_t code = -7; code < 6; code++) {
      int32_t length = finshell_message(code, text, sizeof text);
      KEEP(length);
      keep_text(r, text);
   }
}

static void material_count(const world *w, results *r)
{
   int32_t value = finshell_material_count();
   (void)w;
   KEEP(value);
}

static void material_name(const world *w, results *r)
{
   char text[40] = "";
   finshell_status status;
   (void)w;
   for (int32_t i = -1; i < 3; i++) keep_status(r, finshell_material_name(i, text, sizeof text, &status), &status);
   keep_text(r, text);
}

static void material_parameter_count(const world *w, results *r)
{
   finshell_status status;
   (void)w;
   keep_status(r, finshell_material_parameter_count("mooney_rivlin", &status), &status);
   keep_status(r, finshell_material_parameter_count("no such law", &status), &status);
}

static void material_parameter(const world *w, results *r)
{
   finshell_parameter parameter;
   finshell_status status;
   (void)w;
   for (int32_t i = 1; i < 3; i++) keep_status(r, finshell_material_parameter("mooney_rivlin", i, &parameter, &status), &status);
   keep_text(r, parameter.name);
}

/* ------------------------------------------------------------------ sections */

static void section_create(const world *w, results *r)
{
   const char *names[] = {"c10", "c01"}, *wrong[] = {"c10", "c02"};
   const double values[] = {80, 20};
   finshell_status status;
   finshell_section *section = NULL;
   (void)w;
   keep_status(r, finshell_section_create("mooney_rivlin", 2, names, values, 0.1, 0, NULL, NULL, &section, &status), &status);
   finshell_section_destroy(section);
   keep_status(r, finshell_section_create("mooney_rivlin", 2, wrong, values, 0.1, 0, NULL, NULL, &section, &status), &status);
}

static void section_create_layered(const world *w, results *r)
{
   const char *names[] = {"mu"};
   const double values[] = {3};
   finshell_layer layer[2];
   finshell_status status;
   finshell_section *section = NULL;
   (void)w;
   memset(layer, 0, sizeof layer);
   for (int i = 0; i < 2; i++) {
      layer[i].material = "neo_hookean";
      layer[i].parameters = 1;
      layer[i].names = names;
      layer[i].values = values;
      layer[i].thickness = 0.1;
   }
   keep_status(r, finshell_section_create_layered(2, layer, 0, NULL, NULL, &section, &status), &status);
   finshell_section_destroy(section);
   layer[1].thickness = NAN;
   keep_status(r, finshell_section_create_layered(2, layer, 0, NULL, NULL, &section, &status), &status);
}

static void section_destroy(const world *w, results *r)
{
   (void)w, (void)r;
   finshell_section_destroy(NULL); /* and at the end of the entries above */
}

static void section_freedoms(const world *w, results *r)
{
   finshell_status status;
   keep_status(r, finshell_section_freedoms(w->shell, &status), &status);
   keep_status(r, finshell_section_freedoms(w->sheet, &status), &status);
   keep_status(r, finshell_section_freedoms(NULL, &status), &status);
}

/* ------------------------------------------------------------------ elements */

static void elements_evaluate(const world *w, results *r)
{
   double energy[n], force[n][18], tangent[n][18][18];
   int32_t codes[n];
   finshell_elements b = block(w);
   finshell_status status;
   keep_status(r, finshell_elements_evaluate(w->shell, &b, energy, &force[0][0], &tangent[0][0][0], codes, &status), &status);
   KEEP(energy);
   KEEP(force);
   KEEP(tangent);
   KEEP(codes);
   b.convention = 7;
   keep_status(r, finshell_elements_evaluate(w->shell, &b, energy, NULL, NULL, NULL, &status), &status);
}

static void elements_recover(const world *w, results *r)
{
   double stretch[n], membrane[n][3], moment[n][3], stress[n][9];
   int32_t codes[n];
   finshell_elements b = block(w);
   finshell_status status;
   keep_status(r, finshell_elements_recover(w->shell, &b, stretch, &membrane[0][0], &moment[0][0], &stress[0][0], codes,
                                            &status), &status);
   KEEP(stretch);
   KEEP(membrane);
   KEEP(moment);
   KEEP(stress);
   b.u = NULL;
   keep_status(r, finshell_elements_recover(w->shell, &b, stretch, NULL, NULL, NULL, NULL, &status), &status);
}

static void elements_wrinkles(const world *w, results *r)
{
   double ridge[n][3];
   int32_t state[n], codes[n];
   finshell_elements b = block(w);
   finshell_status status;
   keep_status(r, finshell_elements_wrinkles(w->sheet, &b, state, &ridge[0][0], codes, &status), &status);
   KEEP(state);
   KEEP(ridge);
   keep_status(r, finshell_elements_wrinkles(w->shell, &b, state, &ridge[0][0], codes, &status), &status);
}

static void elements_pressure(const world *w, results *r)
{
   double pressure[n] = {1, 2, -3}, volume[n], force[n][18], stiffness[n][18][18];
   int32_t codes[n];
   finshell_elements b = block(w);
   finshell_status status;
   keep_status(r, finshell_elements_pressure(&b, pressure, 0, NULL, volume, &force[0][0], &stiffness[0][0][0], codes,
                                             &status), &status);
   KEEP(volume);
   KEEP(force);
   KEEP(stiffness);
   pressure[1] = INFINITY;
   keep_status(r, finshell_elements_pressure(&b, pressure, 1, NULL, volume, &force[0][0], NULL, codes, &status), &status);
   KEEP(force);
}

static void evaluate(const world *w, results *r)
{
   double energy[n], force[n][18], tangent[n][18][18];
   int32_t codes[n];
   finshell_status status;
   keep_status(r, finshell_evaluate(w->shell, n, w->p.X, w->p.u, w->p.quaternion, FINSHELL_ROTATION_QUATERNION, NULL,
                                    w->p.direction, energy, &force[0][0], &tangent[0][0][0], codes, w->threads, &status), &status);
   KEEP(energy);
   KEEP(force);
   KEEP(tangent);
   keep_status(r, finshell_evaluate(NULL, n, w->p.X, w->p.u, w->p.vector, 1, NULL, NULL, energy, NULL, NULL, NULL, 1,
                                    &status), &status);
}

static void recover(const world *w, results *r)
{
   double stretch[n], membrane[n][3], moment[n][3], stress[n][9];
   int32_t codes[n];
   finshell_status status;
   keep_status(r, finshell_recover(w->shell, n, w->p.X, w->p.u, w->p.vector, 1, NULL, w->p.direction, stretch,
                                   &membrane[0][0], &moment[0][0], &stress[0][0], codes, &status), &status);
   KEEP(stretch);
   KEEP(membrane);
   KEEP(moment);
   KEEP(stress);
   keep_status(r, finshell_recover(w->shell, -1, w->p.X, w->p.u, w->p.vector, 1, NULL, NULL, stretch, NULL, NULL, NULL, NULL,
                                   &status), &status);
}

static void mass_matrix(const world *w, results *r)
{
   const double flat[9] = {0};
   double consistent[n][18][18], lumped[n][18];
   int32_t codes[n];
   finshell_status status;
   keep_status(r, finshell_mass_matrix(w->shell, n, w->p.X, &consistent[0][0][0], &lumped[0][0], codes, &status), &status);
   KEEP(consistent);
   KEEP(lumped);
   keep_status(r, finshell_mass_matrix(w->shell, 1, flat, NULL, &lumped[0][0], codes, &status), &status);
}

static void pressure_load(const world *w, results *r)
{
   const double pressure[n] = {1, 2, -3};
   double force[n][9], stiffness[n][9][9];
   int32_t codes[n];
   finshell_status status;
   keep_status(r, finshell_pressure_load(n, pressure, w->p.X, w->p.u, 1, NULL, &force[0][0], &stiffness[0][0][0],
                                         codes, &status), &status);
   KEEP(force);
   KEEP(stiffness);
   keep_status(r, finshell_pressure_load(n, pressure, w->p.X, w->p.u, 9, NULL, &force[0][0], NULL, codes, &status), &status);
}

/* ------------------------------------------------------------------ fields and rotations */

static void field_count(const world *w, results *r)
{
   int32_t value = finshell_field_count();
   (void)w;
   KEEP(value);
}

static void field_information(const world *w, results *r)
{
   finshell_field_entry field;
   finshell_status status;
   (void)w;
   keep_status(r, finshell_field_information(0, &field, &status), &status);
   keep_text(r, field.name);
   keep_status(r, finshell_field_information(-1, &field, &status), &status);
}

static void recover_field(const world *w, results *r)
{
   double values[n][3][2];
   finshell_elements b = block(w);
   finshell_status status;
   keep_status(r, finshell_recover_field(w->shell, &b, "principal_stress", &values[0][0][0], NULL, &status), &status);
   KEEP(values);
   keep_status(r, finshell_recover_field(w->shell, &b, "no such field", &values[0][0][0], NULL, &status), &status);
}

static void rotation_exp(const world *w, results *r)
{
   const double wrong[3] = {0, NAN, 1e300};
   double q[points][4];
   finshell_status status;
   keep_status(r, finshell_rotation_exp(points, w->p.vector, &q[0][0], NULL, &status), &status);
   KEEP(q);
   keep_status(r, finshell_rotation_exp(1, wrong, &q[0][0], NULL, &status), &status);
}

static void rotation_log(const world *w, results *r)
{
   const double wrong[4] = {0};
   double v[points][3];
   finshell_status status;
   keep_status(r, finshell_rotation_log(points, w->p.quaternion, &v[0][0], NULL, &status), &status);
   KEEP(v);
   keep_status(r, finshell_rotation_log(1, wrong, &v[0][0], NULL, &status), &status);
}

static void rotation_compose(const world *w, results *r)
{
   double q[points][4];
   finshell_status status;
   keep_status(r, finshell_rotation_compose(points, w->p.quaternion, w->p.quaternion, &q[0][0], NULL, &status), &status);
   KEEP(q);
   keep_status(r, finshell_rotation_compose(points, NULL, w->p.quaternion, &q[0][0], NULL, &status), &status);
}

static void rotation_update(const world *w, results *r)
{
   const double wrong[3] = {INFINITY, 0, 0};
   double q[points][4];
   finshell_status status;
   memcpy(q, w->p.quaternion, sizeof q);
   keep_status(r, finshell_rotation_update(points, w->p.vector, &q[0][0], NULL, &status), &status);
   keep_status(r, finshell_rotation_update(1, wrong, &q[0][0], NULL, &status), &status);
   KEEP(q);
}

static void rotation_matrix(const world *w, results *r)
{
   double m[points][3][3];
   finshell_status status;
   keep_status(r, finshell_rotation_matrix(points, w->p.quaternion, &m[0][0][0], NULL, &status), &status);
   KEEP(m);
   keep_status(r, finshell_rotation_matrix(-3, w->p.quaternion, &m[0][0][0], NULL, &status), &status);
}

static void rotation_tangent(const world *w, results *r)
{
   double t[points][3][3];
   finshell_status status;
   keep_status(r, finshell_rotation_tangent(points, w->p.vector, &t[0][0][0], NULL, &status), &status);
   KEEP(t);
   keep_status(r, finshell_rotation_tangent(points, w->p.vector, NULL, NULL, &status), &status);
}

/* ------------------------------------------------------------------ the table, and the guards */

#define ENTRY(name) {"finshell_" #name, name}

static const struct {
   const char *name;
   void (*call)(const world *, results *);
} table[] = {
   ENTRY(version_text), ENTRY(abi), ENTRY(cpu_level), ENTRY(message),
   ENTRY(material_count), ENTRY(material_name), ENTRY(material_parameter_count), ENTRY(material_parameter),
   ENTRY(section_create), ENTRY(section_create_layered), ENTRY(section_destroy), ENTRY(section_freedoms),
   ENTRY(elements_evaluate), ENTRY(elements_recover), ENTRY(elements_wrinkles), ENTRY(elements_pressure),
   ENTRY(evaluate), ENTRY(recover), ENTRY(mass_matrix), ENTRY(pressure_load),
   ENTRY(field_count), ENTRY(field_information), ENTRY(recover_field),
   ENTRY(rotation_exp), ENTRY(rotation_log), ENTRY(rotation_compose), ENTRY(rotation_update), ENTRY(rotation_matrix),
   ENTRY(rotation_tangent),
};

enum { entries = sizeof table / sizeof *table };

static results expected[entries];
static int rounds = 20;

/* Whether an entry gets what it got at first. */
static int same(const world *w, int entry, results *r)
{
   r->used = 0;
   table[entry].call(w, r);
   return r->used == expected[entry].used && memcmp(r->bytes, expected[entry].bytes, r->used) == 0;
}

/* The host traps exceptions and has a flag of its own raised. In the debug library, which traps on purpose, only results count. */
static void traps(const world *w)
{
   static results r;
   for (int i = 0; i < entries; i++) {
#ifndef FINSHELL_TRAPS
      const int mine = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW;
      feclearexcept(FE_ALL_EXCEPT);
      feraiseexcept(FE_UNDERFLOW);
      feenableexcept(mine);
      int alike = same(w, i, &r), flags = fetestexcept(FE_ALL_EXCEPT), enabled = fegetexcept();
      fedisableexcept(FE_ALL_EXCEPT);
      feclearexcept(FE_ALL_EXCEPT);
      CHECK(flags == FE_UNDERFLOW && enabled == mine);
      if (flags != FE_UNDERFLOW || enabled != mine)
         fprintf(report, "%s: flags %x, traps %x\n", table[i].name, (unsigned)flags, (unsigned)enabled);
#else
      int alike = same(w, i, &r);
#endif
      CHECK(alike);
      if (!alike) fprintf(report, "%s: other results the second time\n", table[i].name);
   }
}

typedef struct {
   const world *w;
   int number, differences;
} job;

/* A thread of the host: all entries, each thread beginning with another one. */
static void *work(void *argument)
{
   job *j = argument;
   results *r = malloc(sizeof *r);
   for (int k = 0; k < rounds * entries; k++) j->differences += !same(j->w, (j->number + k) % entries, r);
   free(r);
   return NULL;
}

static void many_threads(const world *w)
{
   pthread_t thread[workers];
   job jobs[workers];
   for (int i = 0; i < workers; i++) {
      jobs[i].w = w;
      jobs[i].number = i;
      jobs[i].differences = 0;
      CHECK(pthread_create(&thread[i], NULL, work, &jobs[i]) == 0);
   }
   for (int i = 0; i < workers; i++) {
      CHECK(pthread_join(thread[i], NULL) == 0);
      CHECK(jobs[i].differences == 0);
   }
}

/* Of this process. */
static int threads_now(void)
{
   char line[200];
   int found = 0;
   FILE *f = fopen("/proc/self/status", "r");
   while (f && fgets(line, sizeof line, f))
      if (sscanf(line, "Threads: %d", &found) == 1) break;
   if (f) fclose(f);
   return found;
}

/* A child of a process whose calls have used several threads; it asks for several threads, too. */
static void child(world w)
{
   static results r;
   w.threads = 4;
   for (int i = 0; i < entries; i++) CHECK(same(&w, i, &r));
   CHECK(threads_now() > 1);
   pid_t pid = fork();
   if (pid == 0) {
      int differences = 0;
      alarm(300); /* it would wait for threads that stayed behind */
      for (int i = 0; i < entries; i++) differences += !same(&w, i, &r);
      _exit(differences > 0);
   }
   int status = -1;
   CHECK(pid > 0 && waitpid(pid, &status, 0) == pid);
   CHECK(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

int main(int argc, char **argv)
{
   const char *names[] = {"mu"}, *options[] = {"membrane", "wrinkling"};
   const double mu[] = {2}, chosen[] = {1, 1};
   world w = {0};
   if (argc > 1) rounds = atoi(argv[1]);
   silence();
   w.p = new_patch(n, 5);
   w.threads = 1;
   w.shell = rubber(0.1);
   CHECK(finshell_section_create("neo_hookean", 1, names, mu, 0.1, 2, options, chosen, &w.sheet, NULL) == 0);
   for (int i = 0; i < entries; i++) table[i].call(&w, &expected[i]);
   if (argc < 3) traps(&w);
   if (argc < 3 || strcmp(argv[2], "memory") == 0) child(w); /* before there are other threads */
   many_threads(&w);
   finshell_section_destroy(w.shell);
   finshell_section_destroy(w.sheet);
   free_patch(w.p);
   return finish();
}
