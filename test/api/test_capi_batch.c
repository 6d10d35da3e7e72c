/* The same bits for any number of threads and any split of a mesh into calls of four elements and more, and the same results of
 * fewer; many threads of the host at once; the three
 * conventions of rotations describe one energy. */
#define _POSIX_C_SOURCE 200809L
#include "check.h"
#include <pthread.h>

/* Results of a batch. */
typedef struct {
   double *energy, *force, *tangent;
} result;

static result new_result(int32_t n)
{
   result r;
   r.energy = malloc(sizeof(double) * n);
   r.force = malloc(sizeof(double) * 18 * n);
   r.tangent = malloc(sizeof(double) * 324 * n);
   return r;
}

static void free_result(result r)
{
   free(r.energy);
   free(r.force);
   free(r.tangent);
}

static int same(result a, result b, int32_t n)
{
   return memcmp(a.energy, b.energy, sizeof(double) * n) == 0 && memcmp(a.force, b.force, sizeof(double) * 18 * n) == 0
          && memcmp(a.tangent, b.tangent, sizeof(double) * 324 * n) == 0;
}

static int alike(result a, result b, int32_t n)
{
   double most[3] = {0}, off[3] = {0};
   for (int32_t i = 0; i < n; i++) most[0] = fmax(most[0], fabs(a.energy[i])), off[0] = fmax(off[0], fabs(a.energy[i] - b.energy[i]));
   for (int32_t i = 0; i < 18 * n; i++) most[1] = fmax(most[1], fabs(a.force[i])), off[1] = fmax(off[1], fabs(a.force[i] - b.force[i]));
   for (int32_t i = 0; i < 324 * n; i++)
      most[2] = fmax(most[2], fabs(a.tangent[i])), off[2] = fmax(off[2], fabs(a.tangent[i] - b.tangent[i]));
   return off[0] <= 1e-13 * most[0] && off[1] <= 1e-13 * most[1] && off[2] <= 1e-13 * most[2];
}

/* Evaluate in calls of `chunk` elements. */
static int32_t in_chunks(const finshell_section *s, patch p, int convention, int32_t chunk, int32_t threads, result r)
{
   int32_t code = 0;
   int width = convention == FINSHELL_ROTATION_QUATERNION ? 12 : 9;
   const double *rotations = convention == FINSHELL_ROTATION_QUATERNION ? p.quaternion : p.vector;
   for (int32_t first = 0; first < p.n && code == 0; first += chunk) {
      int32_t n = p.n - first < chunk ? p.n - first : chunk;
      code = finshell_evaluate(s, n, p.X + 9 * first, p.u + 9 * first, rotations + width * first, convention,
                               p.quaternion + 12 * first, p.direction + 3 * first, r.energy + first, r.force + 18 * first,
                               r.tangent + 324 * first, NULL, threads, NULL);
   }
   return code;
}

/* What is asked for together or alone is the same. */
static void outputs_alone(const finshell_section *s, patch p, result all)
{
   result r = new_result(p.n);
   CHECK(finshell_evaluate(s, p.n, p.X, p.u, p.vector, 1, NULL, p.direction, r.energy, NULL, NULL, NULL, 1, NULL) == 0);
   CHECK(finshell_evaluate(s, p.n, p.X, p.u, p.vector, 1, NULL, p.direction, NULL, r.force, NULL, NULL, 1, NULL) == 0);
   CHECK(finshell_evaluate(s, p.n, p.X, p.u, p.vector, 1, NULL, p.direction, NULL, NULL, r.tangent, NULL, 1, NULL) == 0);
   for (int32_t e = 0; e < p.n; e++) {
      CHECK_CLOSE(r.energy[e], all.energy[e], 1e-13 * all.energy[e]);
      for (int i = 0; i < 18; i++) CHECK_CLOSE(r.force[18 * e + i], all.force[18 * e + i], 1e-11);
   }
   CHECK(memcmp(r.tangent, all.tangent, sizeof(double) * 324 * p.n) == 0);
   free_result(r);
}

/* All in one call and in calls of `chunk`: the same bits, but for calls of up to three elements. */
static int as_split(result whole, result part, int32_t n, int32_t chunk)
{
   int rest = n % chunk;
   return chunk <= 3 || (rest > 0 && rest <= 3) ? alike(whole, part, n) : same(whole, part, n);
}

static void splits_and_threads(int32_t n)
{
   static const int32_t threads[] = {1, 2, 8, 0}, chunks[] = {1, 2, 3, 7, 8, 9, 64, 1000};
   patch p = new_patch(n, 11);
   finshell_section *sections[2];
   result whole = new_result(n), part = new_result(n);
   sections[0] = rubber(0.1);
   sections[1] = laminate(0.02);
   for (int s = 0; s < 2; s++)
      for (int convention = 1; convention <= 3; convention++) {
         patch q = p;
         if (convention == FINSHELL_ROTATION_INCREMENT) { /* the same motion as increments over half of it */
            q.vector = malloc(sizeof(double) * 9 * n);
            q.quaternion = malloc(sizeof(double) * 12 * n);
            for (int32_t i = 0; i < 9 * n; i++) q.vector[i] = 0.5 * p.vector[i];
            CHECK(finshell_rotation_exp(3 * n, q.vector, q.quaternion, NULL, NULL) == 0);
         }
         CHECK(in_chunks(sections[s], q, convention, n, 1, whole) == 0);
         if (convention == 1) outputs_alone(sections[s], q, whole);
         for (unsigned t = 0; t < sizeof threads / sizeof *threads; t++)
            for (unsigned c = 0; c < sizeof chunks / sizeof *chunks; c++) {
               memset(part.tangent, 0, sizeof(double) * 324 * n);
               CHECK(in_chunks(sections[s], q, convention, chunks[c], threads[t], part) == 0);
               CHECK(as_split(whole, part, n, chunks[c]));
            }
         if (convention == FINSHELL_ROTATION_INCREMENT) {
            free(q.vector);
            free(q.quaternion);
         }
      }
   for (int s = 0; s < 2; s++) finshell_section_destroy(sections[s]);
   free_patch(p);
   free_result(whole);
   free_result(part);
}

/* One motion in three conventions: one energy; forces related by T; with increments from the identity, vectors to the bit. */
static void conventions(void)
{
   enum { n = 11 };
   patch p = new_patch(n, 23);
   finshell_section *s = laminate(-0.01);
   result vector = new_result(n), quaternion = new_result(n), increment = new_result(n);
   double state[n][3][4] = {{{0}}}, t[n][3][3];
   for (int e = 0; e < n; e++)
      for (int i = 0; i < 3; i++) state[e][i][0] = 1;
   CHECK(in_chunks(s, p, 1, n, 1, vector) == 0 && in_chunks(s, p, 2, n, 1, quaternion) == 0);
   CHECK(finshell_evaluate(s, n, p.X, p.u, p.vector, 3, &state[0][0][0], p.direction, increment.energy, increment.force,
                           increment.tangent, NULL, 1, NULL) == 0);
   for (int e = 0; e < n; e++) {
      CHECK_CLOSE(vector.energy[e], quaternion.energy[e], 1e-12 * vector.energy[e]);
      CHECK_CLOSE(vector.energy[e], increment.energy[e], 1e-13 * vector.energy[e]);
      for (int i = 0; i < 18; i++) CHECK_CLOSE(vector.force[18 * e + i], increment.force[18 * e + i], 1e-11);
      for (int i = 0; i < 324; i++) CHECK_CLOSE(vector.tangent[324 * e + i], increment.tangent[324 * e + i], 1e-10);
      for (int i = 0; i < 3; i++) {
         CHECK(finshell_rotation_tangent(1, p.vector + 9 * e + 3 * i, &t[e][0][0], NULL, NULL) == 0);
         for (int c = 0; c < 3; c++) {
            double m = 0;
            for (int r = 0; r < 3; r++) m += t[e][r][c] * quaternion.force[18 * e + 6 * i + 3 + r];
            CHECK_CLOSE(m, vector.force[18 * e + 6 * i + 3 + c], 1e-10);
            CHECK_CLOSE(quaternion.force[18 * e + 6 * i + c], vector.force[18 * e + 6 * i + c], 1e-10);
         }
      }
   }
   /* no increment: spins, up to the symmetric tangent, which is theirs as well */
   memset(t, 0, sizeof t);
   CHECK(finshell_evaluate(s, n, p.X, p.u, &t[0][0][0], 3, p.quaternion, p.direction, increment.energy, increment.force,
                           increment.tangent, NULL, 1, NULL) == 0);
   for (int i = 0; i < 18 * n; i++) CHECK_CLOSE(increment.force[i], quaternion.force[i], 1e-10);
   for (int i = 0; i < 324 * n; i++) CHECK_CLOSE(increment.tangent[i], quaternion.tangent[i], 1e-9);
   finshell_section_destroy(s);
   free_patch(p);
   free_result(vector), free_result(quaternion), free_result(increment);
}

/* Threads of the host, each with a section of its own or a shared one, each with its own batch. */
enum { workers = 8, rounds = 20 };
typedef struct {
   int number, differences;
   const finshell_section *shared;
} job;

static finshell_section *own_section(int number)
{
   return number % 2 ? laminate(0.001 * number) : rubber(0.05 + 0.01 * number);
}

/* Functions that make texts. */
static int texts(patch p, const finshell_section *s)
{
   char text[64];
   finshell_status status;
   finshell_parameter parameter;
   const double nothing[9] = {0};
   return finshell_evaluate(s, 1, nothing, p.u, p.vector, 1, NULL, NULL, NULL, NULL, NULL, NULL, 1, &status) != -2
          || !strstr(status.message, "element 0 (from 0): a reference triangle has no area")
          || finshell_evaluate(s, -7, p.X, p.u, p.vector, 1, NULL, NULL, NULL, NULL, NULL, NULL, 1, &status) != -1
          || !strstr(status.message, "n is -7, expected")
          || finshell_message(3, text, sizeof text) < 20 || strncmp(text, "a nodal rotation", 16) != 0
          || finshell_material_name(0, text, sizeof text, &status) || strcmp(text, "mooney_rivlin") != 0
          || finshell_material_parameter_count("mooney_rivlin", &status) != 2
          || finshell_material_parameter("mooney_rivlin", 1, &parameter, &status) || strcmp(parameter.name, "c01") != 0;
}

static void *work(void *argument)
{
   job *j = argument;
   patch p = new_patch(38, 100 + (uint32_t)j->number);
   result first = new_result(p.n), again = new_result(p.n);
   finshell_section *own = NULL;
   const char *names[] = {"c10", "c01"}, *wrong[] = {"c10", "c02"};
   double values[] = {80 + j->number, 20};
   finshell_status status;
   if (finshell_section_create("mooney_rivlin", 2, names, values, 0.1, 0, NULL, NULL, &own, &status)) j->differences++;
   for (int i = 0; i < rounds; i++) {
      finshell_section *none = NULL;
      const finshell_section *s = i % 2 ? own : j->shared;
      int convention = 1 + i / 2 % 2;
      if (in_chunks(s, p, convention, p.n, 1, first) || in_chunks(s, p, convention, 2 + 2 * i, 1, again)
          || !as_split(first, again, p.n, 2 + 2 * i))
         j->differences++;
      if (finshell_section_create("mooney_rivlin", 2, wrong, values, 0.1, 0, NULL, NULL, &none, &status) != -1
          || !strstr(status.message, "'c02'") || none)
         j->differences++;
      if (texts(p, j->shared)) j->differences++;
   }
   free_patch(p);
   free_result(first), free_result(again);
   finshell_section_destroy(own);
   return NULL;
}

static void host_threads(void)
{
   pthread_t thread[workers];
   job jobs[workers];
   finshell_section *shared = own_section(1);
   for (int i = 0; i < workers; i++) {
      jobs[i].number = i;
      jobs[i].differences = 0;
      jobs[i].shared = shared;
      CHECK(pthread_create(&thread[i], NULL, work, &jobs[i]) == 0);
   }
   for (int i = 0; i < workers; i++) {
      CHECK(pthread_join(thread[i], NULL) == 0);
      CHECK(jobs[i].differences == 0);
   }
   finshell_section_destroy(shared);
}

int main(int argc, char **argv)
{
   int32_t n = argc > 1 ? atoi(argv[1]) : 203;
   silence();
   splits_and_threads(n);
   conventions();
   host_threads();
   return finish();
}
