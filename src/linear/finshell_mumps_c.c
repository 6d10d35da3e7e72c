/* MUMPS for finshell_mumps.f90: the C structures of MUMPS change with every release, so that only its own headers know where things stand.
 * Two precisions, one handle: what has numbers passes through here as addresses of double or float. */
#define _POSIX_C_SOURCE 200112L
#include <dmumps_c.h>
#include <smumps_c.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
   int single;
   DMUMPS_STRUC_C d;
   SMUMPS_STRUC_C s;
} solver;

/* Do it with the structure of the precision; `m` is its name, `real` its kind of number. */
#define EITHER(handle, statement) \
   do { \
      if (((solver *)(handle))->single) { \
         SMUMPS_STRUC_C *m = &((solver *)(handle))->s; \
         typedef float real; \
         (void)sizeof(real); \
         statement \
      } else { \
         DMUMPS_STRUC_C *m = &((solver *)(handle))->d; \
         typedef double real; \
         (void)sizeof(real); \
         statement \
      } \
   } while (0)

/* Analyse (1), factorise (2), solve (3); what came of it is in infog(1). */
void finshell_mumps_call(void *handle, int job)
{
   solver *both = handle;
   if (both->single) {
      both->s.job = job;
      smumps_c(&both->s);
   } else {
      both->d.job = job;
      dmumps_c(&both->d);
   }
}

int *finshell_mumps_infog(void *handle) { EITHER(handle, return m->infog;); }
int *finshell_mumps_icntl(void *handle) { EITHER(handle, return m->icntl;); }
int *finshell_mumps_sym_perm(void *handle) { EITHER(handle, return m->sym_perm;); }
double finshell_mumps_rinfog(void *handle, int i) { EITHER(handle, return m->rinfog[i - 1];); }
void finshell_mumps_cntl(void *handle, int i, double value) { EITHER(handle, m->cntl[i - 1] = (real)value;); }

/* A new instance, or null. symmetry: 0 unsymmetric, 1 definite, 2 symmetric. communicator: of Fortran; -987654: MPI_COMM_WORLD, and
 * the only one there is without MPI. */
void *finshell_mumps_open(int single, int symmetry, int communicator)
{
   solver *both = calloc(1, sizeof *both);
   if (both == NULL)
      return NULL;
   setenv("SCOTCH_PTHREAD_NUMBER", "1", 0); /* its ordering takes as many threads as there are processors, and is not reproducible with them */
   both->single = single;
   EITHER(both, m->sym = symmetry; m->par = 1; m->comm_fortran = communicator;);
   finshell_mumps_call(both, -1);
   if (finshell_mumps_infog(both)[0] < 0) {
      free(both);
      return NULL;
   }
   const char *folder = getenv("TMPDIR");
   if (folder != NULL)
      EITHER(both, strncpy(m->ooc_tmpdir, folder, sizeof m->ooc_tmpdir - 1););
   return both;
}

void finshell_mumps_close(void *handle)
{
   finshell_mumps_call(handle, -2);
   free(handle);
}

/* The whole matrix on the first process. */
void finshell_mumps_matrix(void *handle, int n, int64_t entries, int *rows, int *columns, void *values)
{
   EITHER(handle, m->n = n; m->nnz = entries; m->irn = rows; m->jcn = columns; m->a = (real *)values;);
}

/* The part of the matrix that this process has; parts add up. */
void finshell_mumps_local_matrix(void *handle, int n, int64_t entries, int *rows, int *columns, void *values)
{
   EITHER(handle, m->n = n; m->nnz_loc = entries; m->irn_loc = rows; m->jcn_loc = columns; m->a_loc = (real *)values;);
}

/* position(i): when equation i is eliminated, from 1. */
void finshell_mumps_order(void *handle, int *position) { EITHER(handle, m->perm_in = position;); }

void finshell_mumps_scaling(void *handle, void *rows, void *columns)
{
   EITHER(handle, m->rowsca = (real *)rows; m->colsca = (real *)columns;);
}

/* Right-hand sides on the first process, where solutions take their place. */
void finshell_mumps_rhs(void *handle, void *rhs, int n, int count)
{
   EITHER(handle, m->rhs = (real *)rhs; m->nrhs = count; m->lrhs = n;);
}
