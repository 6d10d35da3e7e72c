/* finshell: a whole model from other programs, step by step. C99 and C++. The library is libfinshell_driver (shared), which has all
 * that the program finshell has: sections, supports, loads, steps, solvers, results. libfinshell (finshell.h) has elements alone.
 *
 * Conventions of all functions
 *   - Units: any consistent set. Nodes, elements and steps count from 0 here; in the text of an input they count from 1.
 *   - Arrays are contiguous; shapes are those of C, last index fastest. Arrays that a function returns belong to the model: they
 *     stay where they are until it is destroyed, and get new values when the same function is called again.
 *   - Return value: 0 done; > 0 the analysis could not go on from here (the state is that before the call, or that after the last
 *     increment that has converged): go back, or try a smaller size; < 0 the caller's mistake. `status`, which may be NULL, has a
 *     sentence, with file and line where the input is concerned. A call that is refused changes nothing.
 *   - Nothing is printed, nothing ends the program, no signal is caught. No function raises a floating-point flag or trips a
 *     trap of the host's, or changes how many threads its OpenMP has.
 *   - Any number of models at once, and calls from any thread: of several calls in a process one works at a time, with
 *     as many threads as the input asks for (key threads of &job) or as pay.
 *   - After a fork, a child of a process whose models have used several threads computes with one: the threads of OpenMP stay in
 *     the parent.
 *
 * A guide with complete programs, and the Python class: doc/model_api.md.
 */
#ifndef FINSHELL_MODEL_H
#define FINSHELL_MODEL_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FINSHELL_MODEL_ABI 1 /* number in the name of the shared library, libfinshell_driver.so.1 */

/* Return codes; others are those of finshell.h. */
enum {
   FINSHELL_MODEL_OK = 0,
   FINSHELL_MODEL_NOT_CONVERGED = 4,    /* an increment fails, however short */
   FINSHELL_MODEL_SINGULAR_MATRIX = 5,  /* the supports, or a structure that has lost its stiffness */
   FINSHELL_MODEL_INVALID_ARGUMENT = -1, /* NULL, no model, a size or name that is none */
   FINSHELL_MODEL_INPUT_ERROR = -4,      /* the input, or what was asked for, is wrong */
   FINSHELL_MODEL_IO_ERROR = -5,         /* a file cannot be read or written */
   FINSHELL_MODEL_OUT_OF_MEMORY = -6
};

/* What happened. */
typedef struct finshell_model_status {
   int32_t code; /* the return value */
   int32_t reserved;
   char message[1016]; /* a sentence; "" when done */
} finshell_model_status;

/* A model. A pointer to something else is refused with -1, as is one to a destroyed model as long as nothing but malloc has
 * used its memory since. */
typedef struct finshell_model finshell_model;

/* ------------------------------------------------------------------ to begin and to end */

/* Kinds of sets. */
enum { FINSHELL_MODEL_NODES = 0, FINSHELL_MODEL_ELEMENTS = 1, FINSHELL_MODEL_EDGES = 2 };

/* A set of a mesh given as arrays. */
typedef struct finshell_model_set {
   const char *name;
   int32_t kind;           /* FINSHELL_MODEL_NODES, ... */
   int32_t number;         /* of nodes, elements or edges */
   const int32_t *members; /* [number]; of edges [number][2] nodes, in the order of their line */
} finshell_model_set;

/* A mesh as arrays. Set all to zero first ({0}). */
typedef struct finshell_model_mesh {
   uint64_t size; /* sizeof(finshell_model_mesh) */
   int32_t nodes, elements, sets, reserved;
   const double *coordinates;     /* [nodes][3] */
   const int32_t *triangles;      /* [elements][3] */
   const finshell_model_set *set; /* [sets] */
} finshell_model_mesh;

/* Number in the name of the library. Since 0.1. */
int32_t finshell_model_abi(void);

/* Read an input (doc/namelist.md): the file, when `text` is NULL; else the text, with `file` as its name in messages, whose folder
 * is that of other files. With a mesh (else NULL) the text has a group &mesh without file and generator. Nothing is
 * solved, but for the steps whose modes are imperfections. Errors: what is wrong with the input; &accuracy. Since 0.1. */
int32_t finshell_model_create(const char *file, const char *text, const finshell_model_mesh *mesh, finshell_model **model,
                              finshell_model_status *status);

/* Close result files and free the model; NULL is nothing. Errors: a file that cannot be written to its end. Since 0.1. */
int32_t finshell_model_destroy(finshell_model *model, finshell_model_status *status);

/* How much there is of a model. */
typedef struct finshell_model_size {
   int32_t nodes, elements, unknowns, sections, steps, columns; /* columns: of the history */
} finshell_model_size;

/* How many nodes, elements, ... a model has. Since 0.1. */
int32_t finshell_model_sizes(finshell_model *model, finshell_model_size *sizes, finshell_model_status *status);

/* Texts: "title", "name" of the job, "file", "warnings" (a line each), "node_sets", "element_sets", "edge_sets", "columns" of the
 * history, "steps", "fields" (names, a line each). Into buffer[size] (may be NULL), closed by '\0' and cut to fit; `length`
 * (may be NULL) is that of the whole text. Since 0.1. */
int32_t finshell_model_text(finshell_model *model, const char *what, char *buffer, int32_t size, int32_t *length,
                            finshell_model_status *status);

/* The mesh: coordinates [nodes][3], triangles [elements][3]; either may be NULL. Since 0.1. */
int32_t finshell_model_mesh_arrays(finshell_model *model, const double **coordinates, const int32_t **triangles,
                                   finshell_model_status *status);

/* Members [number] of a set of nodes or elements, ascending. Errors: no such set. Since 0.1. */
int32_t finshell_model_set_members(finshell_model *model, int32_t kind, const char *name, int32_t *number, const int32_t **members,
                                   finshell_model_status *status);

/* ------------------------------------------------------------------ step by step */

/* Where the model stands. */
typedef struct finshell_model_record {
   int32_t increment;       /* converged increments so far */
   int32_t step;            /* of the last one, from 0 */
   int32_t reports;         /* increments, linear solutions or modes found by this call; 0: there was nothing left to do */
   int32_t finished;        /* 1: all steps are done */
   int32_t iterations;      /* of the last increment */
   int32_t cuts;            /* failed attempts before it */
   int32_t negative_pivots; /* -1: not known; > 0: unstable under dead loads */
   int32_t critical_point;  /* a limit point (1), bifurcation point (2) or both (3) was passed */
   int32_t snap;            /* 1: it leads to another state than the path does */
   int32_t rounding;        /* 1: rounding kept it from its tolerance */
   double load_factor;
   double time; /* spent in steps in time */
   double size; /* of the last increment, in the measure of its control */
   double proposed; /* that of the next one, likewise; 0: not known, as its step has not begun */
   double residual, correction; /* relative, at convergence */
   char step_name[32], control[32];
} finshell_model_record;

/* Where the model stands; `reports` is that of the last call that moved it. Since 0.1. */
int32_t finshell_model_state(finshell_model *model, finshell_model_record *record, finshell_model_status *status);

/* The next increment: of the step under way or of the one behind it. Steps with control = 'linear', 'buckling' and 'frequencies',
 * which leave the state as it is, are done as a whole.
 *
 * size: 0, as the step proposes, or that of the increment in the measure of its control (load factor, arc length, displacement,
 * volume, time). It is cut where it fails. In steps with control = 'dynamic' the model arrives after exactly that time (or at the end
 * of the step), in as many increments as accuracy asks for. `record` may be NULL. Since 0.1. */
int32_t finshell_model_advance(finshell_model *model, double size, finshell_model_record *record, finshell_model_status *status);

/* Forces that the host wants to act on the nodes of a set, values [number][3], number: that of the nodes, or 1 for the same at
 * each. They act beside the loads of the input and replace what was set at these nodes before.
 * In a step with control = 'load' they come in before the next increment, at the load factor that there is, in as many
 * increments as that takes. In a step with control = 'dynamic' they grow (or fall) along a straight line to these values in the
 * course of the next call of finshell_model_advance. Other steps go on with the forces they have begun with. Since 0.1. */
int32_t finshell_model_set_force(finshell_model *model, const char *node_set, int32_t number, const double *values,
                                 finshell_model_status *status);

/* Displacements that the host wants component 0, 1 or 2 of the nodes of a set to have, values [number], number as before. A support
 * of the input holds that component, in global axes. They come in as forces do. Since 0.1. */
int32_t finshell_model_set_displacement(finshell_model *model, const char *node_set, int32_t component, int32_t number,
                                        const double *values, finshell_model_status *status);

/* Let forces and displacements that were set come in now, at rest. Since 0.1. */
int32_t finshell_model_settle(finshell_model *model, finshell_model_record *record, finshell_model_status *status);

/* Keep all that there is in slot 0 to 7, in memory; what was kept in that slot before is lost. Since 0.1. */
int32_t finshell_model_checkpoint(finshell_model *model, int32_t slot, finshell_model_status *status);

/* Go back to what a slot keeps, as often as one likes. Result files are not taken back. Errors: nothing was kept there.
 * Since 0.1. */
int32_t finshell_model_restore(finshell_model *model, int32_t slot, finshell_model_status *status);

/* ------------------------------------------------------------------ results */

/* A field as an array, [items][places][components]. */
typedef struct finshell_model_array {
   const double *values;
   int32_t items;      /* nodes, elements or 1 */
   int32_t places;     /* 1; 3: bottom, middle, top; or one for each layer */
   int32_t components; /* 1, 2, 3 or 6 */
   int32_t on;         /* 1 nodes, 2 elements, 3 the whole structure */
} finshell_model_array;

/* A field of the table (doc/namelist.md) of the present state, by name. With mode > 0 that of the linear solution or mode of this number
 * that the last call has found. What is missing is a NaN. Since 0.1. */
int32_t finshell_model_field(finshell_model *model, const char *name, int32_t mode, finshell_model_array *array,
                             finshell_model_status *status);

/* The history so far: rows [rows][columns], one for each report; the columns are listed by finshell_model_text. Unlike other arrays
 * it may move when the model advances. Since 0.1. */
int32_t finshell_model_history(finshell_model *model, int32_t *rows, int32_t *columns, const double **values,
                               finshell_model_status *status);

/* Write the present state to NAME.vtkhdf, NAME.xdmf and NAME.history.csv (name with folder, without ending), with the fields that &output
 * asks for. The first call creates the files; readers may look at them at any time. Since 0.1. */
int32_t finshell_model_write(finshell_model *model, const char *name, finshell_model_status *status);

#ifdef __cplusplus
}
#endif

#endif
