/* What the programs share that call every function of a header under guards (test_*guards.c): no flag raised and no trap tripped,
 * 64 threads of a host at once, a child after a fork; valgrind and the sanitizers see these programs, too (test_sanitizers.py,
 * test_model_installed.py). Each has a table with one entry for each function, which calls it as it is meant and with a mistake;
 * test/structure/test_guards.py compares the tables with the headers.
 *
 *    test_..._guards [ROUNDS of each thread [memory | threads]]     memory: without flags, which valgrind does not have
 *
 * A program defines `_GNU_SOURCE`, struct world, entries, table, and calls `guard`. */
#ifndef GUARDS_H
#define GUARDS_H

#include "check.h"
#include <fenv.h>
#include <pthread.h>
#include <sys/wait.h>

enum { room = 200000, workers = 64 };

typedef struct world world; /* what all calls share and none changes */

/* All that an entry has got, bytes one after the other. */
typedef struct {
   size_t used;
   unsigned char bytes[room];
} results;

static inline void keep(results *r, const void *data, size_t size)
{
   if (r->used + size > room) abort();
   memcpy(r->bytes + r->used, data, size);
   r->used += size;
}

#define KEEP(what) keep(r, &(what), sizeof(what)) /* without padding: whose bytes may be anything */

static inline void keep_text(results *r, const char *text)
{
   keep(r, text, strlen(text) + 1);
}

/* Code and message of a call. */
static inline void keep_status(results *r, int32_t code, const finshell_status *status)
{
   KEEP(code);
   KEEP(status->code);
   KEEP(status->index);
   KEEP(status->failed);
   keep_text(r, status->message);
}

/* ------------------------------------------------------------------ the table, and the guards */

#define ENTRY(name) {"finshell_" #name, name}

typedef struct {
   const char *name;
   void (*call)(const world *, results *);
} entry;

/* The table of a program, and what its entries got at first. */
static const entry *table;
static int entries;
static results *expected;
static int rounds = 20;

/* Whether an entry gets what it got at first. */
static int same(const world *w, int number, results *r)
{
   r->used = 0;
   table[number].call(w, r);
   return r->used == expected[number].used && memcmp(r->bytes, expected[number].bytes, r->used) == 0;
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
static void child(const world *several)
{
   static results r;
   for (int i = 0; i < entries; i++) CHECK(same(several, i, &r));
   CHECK(threads_now() > 1);
   pid_t pid = fork();
   if (pid == 0) {
      int differences = 0;
      alarm(300); /* it would wait for threads that stayed behind */
      for (int i = 0; i < entries; i++)
         if (!same(several, i, &r)) {
            differences++;
            fprintf(report, "%s: other results after a fork\n", table[i].name);
         }
      fflush(report);
      _exit(differences > 0);
   }
   int status = -1;
   CHECK(pid > 0 && waitpid(pid, &status, 0) == pid);
   CHECK(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

/* All guards; w: calls use one thread, several: the same with four. */
static void guard(const entry *list, int number, const world *w, const world *several, int argc, char **argv)
{
   table = list;
   entries = number;
   if (argc > 1) rounds = atoi(argv[1]);
   expected = calloc((size_t)entries, sizeof *expected);
   for (int i = 0; i < entries; i++) table[i].call(w, &expected[i]);
   if (argc < 3) traps(w);
   if (argc < 3 || strcmp(argv[2], "memory") == 0) child(several); /* before there are other threads */
   many_threads(w);
   free(expected);
}
#endif
