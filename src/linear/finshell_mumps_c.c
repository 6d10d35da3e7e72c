/* MUMPS for finshell_mumps.f90: the C structure of MUMPS changes with every release, so that only its own header knows where things stand. */
#include <dmumps_c.h>
#include <stdint.h>
#include <stdlib.h>

/* A new instance, or null. symmetry: 0 unsymmetric, 1 definite, 2 symmetric. communicator: of Fortran; -987654: MPI_COMM_WORLD, and
 * the only one there is without MPI. */
void *finshell_mumps_open(int symmetry, int communicator)
{
   DMUMPS_STRUC_C *m = calloc(1, sizeof *m);
   if (m == NULL)
      return NULL;
   m->sym = symmetry;
   m->par = 1;
   m->comm_fortran = communicator;
   m->job = -1;
   dmumps_c(m);
   if (m->infog[0] < 0) {
      free(m);
      return NULL;
   }
   return m;
}

/* Analyse (1), factorise (2), solve (3); what came of it is in infog(1). */
void finshell_mumps_call(void *handle, int job)
{
   DMUMPS_STRUC_C *m = handle;
   m->job = job;
   dmumps_c(m);
}

void finshell_mumps_close(void *handle)
{
   finshell_mumps_call(handle, -2);
   free(handle);
}

int *finshell_mumps_icntl(void *handle) { return ((DMUMPS_STRUC_C *)handle)->icntl; }
double *finshell_mumps_cntl(void *handle) { return ((DMUMPS_STRUC_C *)handle)->cntl; }
int *finshell_mumps_infog(void *handle) { return ((DMUMPS_STRUC_C *)handle)->infog; }
double *finshell_mumps_rinfog(void *handle) { return ((DMUMPS_STRUC_C *)handle)->rinfog; }
int *finshell_mumps_sym_perm(void *handle) { return ((DMUMPS_STRUC_C *)handle)->sym_perm; }

/* The whole matrix on the first process. */
void finshell_mumps_matrix(void *handle, int n, int64_t entries, int *rows, int *columns, double *values)
{
   DMUMPS_STRUC_C *m = handle;
   m->n = n;
   m->nnz = entries;
   m->irn = rows;
   m->jcn = columns;
   m->a = values;
}

/* The part of the matrix that this process has; parts add up. */
void finshell_mumps_local_matrix(void *handle, int n, int64_t entries, int *rows, int *columns, double *values)
{
   DMUMPS_STRUC_C *m = handle;
   m->n = n;
   m->nnz_loc = entries;
   m->irn_loc = rows;
   m->jcn_loc = columns;
   m->a_loc = values;
}

/* position(i): when equation i is eliminated, from 1. */
void finshell_mumps_order(void *handle, int *position) { ((DMUMPS_STRUC_C *)handle)->perm_in = position; }

void finshell_mumps_scaling(void *handle, double *rows, double *columns)
{
   DMUMPS_STRUC_C *m = handle;
   m->rowsca = rows;
   m->colsca = columns;
}

/* Right-hand sides on the first process, where solutions take their place. */
void finshell_mumps_rhs(void *handle, double *rhs, int n, int count)
{
   DMUMPS_STRUC_C *m = handle;
   m->rhs = rhs;
   m->nrhs = count;
   m->lrhs = n;
}
