/* finshell: a finite-strain triangular shell element for other programs. C99 and C++.
 *
 * Conventions of all functions
 *   - Units: any consistent set. Angles of layers in degrees, all other rotations in radians.
 *   - Arrays are contiguous, owned by the caller, not overlapping; the shapes below are those of C, last index fastest.
 *     An output passed as NULL is not computed; an input may be NULL only where this file says so. With n = 0 nothing is done.
 *   - Return value: 0 done; > 0 recoverable, cut the step and try again; < 0 the caller's mistake. The codes are below.
 *     In a batch, the value is the code of the first element with a negative code or, without one, of the first with a
 *     positive code. A failed element gets zeros; all others are done as if it were not there. When the call as a whole is
 *     refused (a NULL, a negative n, an unknown convention: code -1, index -1) no output is touched.
 *   - `status`, `codes` (the code of each element, int32_t[n]) and every pointer to a structure of results may be NULL.
 *   - Every output is finite, or there is a code. No function raises a floating-point flag or trips a trap of the host's; flags,
 *     traps and rounding are as they were when a function returns.
 *   - Nothing is printed, nothing ends the program, nothing is kept between calls. All functions may be called from any number
 *     of threads at once, also with the same section, as long as nobody destroys it meanwhile.
 *   - Matrices are by rows, matrix[row][column]; the stiffness of finshell_pressure_load alone is by columns (the others are
 *     symmetric, or say "by rows").
 *   - After a fork, a child of a process that has called finshell_evaluate with several threads computes with one: the threads of
 *     OpenMP stay in the parent. Results are the same.
 *   - Results are the same to the last bit for any number of threads and however a mesh is split into batches (on one
 *     processor: see finshell_cpu_level); those of calls of up to three elements differ from them by rounding.
 *
 * Element: three nodes, counter-clockwise about the normal. Each node has a displacement u and a rotation R, which takes
 * directors of the undeformed to those of the deformed shell, in global axes. The 18 entries of force and tangent are ordered
 * u1 t1 u2 t2 u3 t3, three components each; force is the internal force, the derivative of the stored energy; the tangent
 * its second derivative, symmetric. Elements of a section with the option "membrane" have displacements only: 9 entries, u1 u2 u3.
 *
 * A guide with complete programs: doc/c_api.md. "Since" says which version brought a function; none has been removed
 * or changed while FINSHELL_ABI stays the same.
 */
#ifndef FINSHELL_H
#define FINSHELL_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FINSHELL_VERSION "0.1.0" /* of this header */
#define FINSHELL_VERSION_MAJOR 0
#define FINSHELL_VERSION_MINOR 1
#define FINSHELL_VERSION_PATCH 0
/* One number, for comparisons by the preprocessor: #if FINSHELL_VERSION_NUMBER >= 10203 is 1.2.3 or later. */
#define FINSHELL_VERSION_NUMBER (FINSHELL_VERSION_MAJOR * 10000 + FINSHELL_VERSION_MINOR * 100 + FINSHELL_VERSION_PATCH)
#define FINSHELL_ABI 2 /* number in the name of the shared library, libfinshell.so.2 */

/* Stands before every function. Windows: define FINSHELL_STATIC to link the archive, FINSHELL_BUILDING where the DLL is made. */
#ifndef FINSHELL_API
#if defined(_WIN32) && defined(FINSHELL_STATIC)
#define FINSHELL_API
#elif defined(_WIN32) && defined(FINSHELL_BUILDING)
#define FINSHELL_API __declspec(dllexport)
#elif defined(_WIN32)
#define FINSHELL_API __declspec(dllimport)
#elif defined(__GNUC__)
#define FINSHELL_API __attribute__((visibility("default")))
#else
#define FINSHELL_API
#endif
#endif

/* Return codes. */
enum {
   FINSHELL_OK = 0,
   FINSHELL_COLLAPSED_ELEMENT = 1,    /* the current area is zero or not finite */
   FINSHELL_MATERIAL_LIMIT = 2,       /* the law cannot be evaluated at this strain, or results overflow */
   FINSHELL_LARGE_ROTATION = 3,       /* a nodal rotation relative to its element nears pi */
   FINSHELL_NOT_CONVERGED = 4,        /* the wrinkles of a membrane were not found */
   FINSHELL_INVALID_ARGUMENT = -1,    /* NULL, size, name or option; a direction or quaternion of zeros; a normal of zeros, or 90
                                           degrees or more from that of its triangle */
   FINSHELL_DEGENERATE_REFERENCE = -2, /* the reference triangle has no area (height below 1e-10 of its longest side), or is not
                                           between 1e-60 and 1e60 in size */
   FINSHELL_NOT_A_NUMBER = -3,        /* NaN or infinity in the input */
   FINSHELL_OUT_OF_MEMORY = -6
};

/* How rotations are given, and what force and tangent refer to. */
enum {
   /* Total rotation vectors t [n][3][3], R = exp(t), any number of turns. Force and tangent are derivatives with
    * respect to t. For codes that add up rotational unknowns. (Like every vector of three it is singular at |t| = 2 pi.) */
   FINSHELL_ROTATION_VECTOR = 1,
   /* Quaternions q [n][3][4], scalar part first, of any length. Force and tangent refer to spins w: R <- exp(w) R;
    * the tangent is the symmetric second derivative along exp(w) R. Update by finshell_rotation_update. */
   FINSHELL_ROTATION_QUATERNION = 2,
   /* Rotation vectors t [n][3][3] since a state, whose quaternions [n][3][4] are passed as `state`: R = exp(t) R_state. Force
    * and tangent are derivatives with respect to t. For codes that add up unknowns within a step. */
   FINSHELL_ROTATION_INCREMENT = 3
};

/* What a membrane that wrinkles is doing: see finshell_elements_wrinkles. */
enum {
   FINSHELL_SHEET_SLACK = 0,    /* it bears nothing */
   FINSHELL_SHEET_WRINKLED = 1, /* it bears tension along the ridges of its wrinkles only */
   FINSHELL_SHEET_TAUT = 2      /* it bears tension in both directions */
};

/* What happened, kept by the caller; may be passed as NULL. */
typedef struct finshell_status {
   int32_t code;      /* the return value */
   int32_t index;     /* the element (from 0) it belongs to, -1: the call as a whole */
   int32_t failed;    /* number of elements that failed */
   char message[244]; /* a sentence, with the place and what to do; "" when done */
} finshell_status;

/* ------------------------------------------------------------------ version and messages */

/* Version of the library, "0.1.0". Since 0.1. */
FINSHELL_API const char *finshell_version_text(void);

/* FINSHELL_VERSION_NUMBER of the library, 100 for 0.1.0. Since 0.1. */
FINSHELL_API int32_t finshell_version_number(void);

/* FINSHELL_ABI of the library: unequal to that of the header, the two do not fit. Since 0.1. */
FINSHELL_API int32_t finshell_abi(void);

/* The copy of the kernel that was chosen when the library was loaded: 1, 3 or 4 for x86-64, x86-64-v3 (AVX2, FMA), x86-64-v4
 * (AVX-512); 0: the library holds one copy only. The environment variable FINSHELL_CPU_LEVEL (1, 3 or 4), set before the program
 * starts, lowers it. Results of two levels differ by rounding. Since 0.1. */
FINSHELL_API int32_t finshell_cpu_level(void);

/* A sentence for a return code, closed by '\0' and cut to fit into buffer[size] (may be NULL). Returns its whole length.
 * Since 0.1. */
FINSHELL_API int32_t finshell_message(int32_t code, char *buffer, int32_t size);

/* ------------------------------------------------------------------ material laws */

/* A parameter of a law. */
typedef struct finshell_parameter {
   char name[32];
   char meaning[128];
   double default_value; /* when required is 0 */
   double example;       /* a sensible value; the default where it is not part of an example */
   int32_t required;     /* 1 or 0 */
   int32_t padding;
} finshell_parameter;

/* Number of material laws. Since 0.1. */
FINSHELL_API int32_t finshell_material_count(void);

/* Name of law i (from 0) into buffer[size]. Errors: -1 no such law, no buffer. Since 0.1. */
FINSHELL_API int32_t finshell_material_name(int32_t i, char *buffer, int32_t size, finshell_status *status);

/* Number of parameters of a law. Errors: -1 unknown law. Since 0.1. */
FINSHELL_API int32_t finshell_material_parameter_count(const char *material, finshell_status *status);

/* Parameter i (from 0) of a law. Errors: -1 unknown law, no such parameter. Since 0.1. */
FINSHELL_API int32_t finshell_material_parameter(const char *material, int32_t i, finshell_parameter *parameter,
                                                 finshell_status *status);

/* ------------------------------------------------------------------ sections */

/* What elements are made of; immutable once created. A pointer to something else is refused with -1, as is one to a destroyed
 * section as long as nothing but malloc has used its memory since. */
typedef struct finshell_section finshell_section;

/* A section of one layer.
 *   material, names[parameters], values[parameters]: law and its parameters, capitals do not matter; names and values may be
 *   NULL when parameters is 0. thickness > 0 (length).
 *   option_names[options], option_values[options], NULL when options is 0:
 *     "thickness_points"  Gauss points through the thickness, 1 to 12 (linear laws: 2, which is exact; laws with fibres: 5; others: 3)
 *     "formulation"       1: stabilised (S), 2: as published (P) (1)
 *     "beta0"             weight of the higher-order drilling strain, > 0 (default: (thickness/longest side)^2 of each
 *                         element, between 1e-5 and 0.3)
 *     "arc"               1: curvature by the tangents of the arc, 0: of its chord; (S) only (1)
 *     "offset"            height of the middle of the section above the surface of the nodes, along the normal; length (0)
 *     "density"           mass per reference volume, used by finshell_mass_matrix only (0)
 *     "membrane"          1: no stiffness in bending, no rotations, 9 freedoms an element; takes none of "thickness_points",
 *                         "formulation", "beta0", "arc" and "offset" (0)
 *     "wrinkling"         1, of a membrane: it wrinkles or goes slack instead of bearing compression (relaxed energy) (0)
 *     "slack"             with wrinkling: part of its natural stiffness that a membrane keeps against compression, 0 to 1 (1e-6)
 *   *section: the handle, NULL after an error.
 * Errors: -1 unknown law, parameter or option, missing or senseless value (the message names it and lists what there is);
 * -6. Since 0.1. */
FINSHELL_API int32_t finshell_section_create(const char *material, int32_t parameters, const char *const *names,
                                             const double *values, double thickness, int32_t options,
                                             const char *const *option_names, const double *option_values,
                                             finshell_section **section, finshell_status *status);

/* A section of layers is said step by step to a builder, and built:
 *
 *    finshell_section_builder *builder;
 *    finshell_builder_begin(&builder, &status);
 *    finshell_builder_layer(builder, 0.1, 45.0, 0, 0.0, &status);
 *    finshell_builder_law(builder, "orthotropic", 4, names, values, &status);
 *    finshell_builder_option(builder, "offset", 0.05, &status);
 *    code = finshell_builder_build(builder, &section, &status);
 *    finshell_builder_destroy(builder);
 *
 * A call that fails spoils the builder: the calls that follow return the same code and message, so that it is enough to look at
 * those of the last. One thread at a time may use a builder. What is no builder is refused as what is no section is. */
typedef struct finshell_section_builder finshell_section_builder;

/* A builder without layers. *builder: NULL after an error. Errors: -1, -6. Since 0.1. */
FINSHELL_API int32_t finshell_builder_begin(finshell_section_builder **builder, finshell_status *status);

/* A layer more, on top of those that there are: bottom to top along the normal. A layer needs a law: finshell_builder_law follows.
 *   thickness   > 0, length
 *   angle       degrees, from the element's material direction to axis 1 of the law, about the normal
 *   points      Gauss points through the layer, 1 to 12; 0: by the law; of a membrane 0 only
 *   density     mass per reference volume, >= 0, used by finshell_mass_matrix only
 * What is senseless here, finshell_builder_build refuses. Errors: -1 no builder; -6. Since 0.1. */
FINSHELL_API int32_t finshell_builder_layer(finshell_section_builder *builder, double thickness, double angle, int32_t points,
                                            double density, finshell_status *status);

/* The law of the layer that was added last: name and parameters as in finshell_section_create. Errors: -1 unknown law or
 * parameter, missing or senseless value, no layer, a layer that has a law (the message names the layer). Since 0.1. */
FINSHELL_API int32_t finshell_builder_law(finshell_section_builder *builder, const char *material, int32_t parameters,
                                          const char *const *names, const double *values, finshell_status *status);

/* An option of the section: "formulation", "beta0", "arc", "offset", "membrane", "wrinkling" or "slack", as in
 * finshell_section_create. Errors: -1 unknown option, given twice, no whole number where one is expected. Since 0.1. */
FINSHELL_API int32_t finshell_builder_option(finshell_section_builder *builder, const char *name, double value,
                                             finshell_status *status);

/* The section of what was said. The builder stays as it is, and may go on. *section: the handle, NULL after an error.
 * Errors: -1 no layer, a layer without a law, senseless numbers of a layer or options (the message names the layer or option);
 * what an earlier call has reported; -6. Since 0.1. */
FINSHELL_API int32_t finshell_builder_build(finshell_section_builder *builder, finshell_section **section,
                                            finshell_status *status);

/* Frees a builder; its sections stay. NULL is ignored, and so is what is no builder. Since 0.1. */
FINSHELL_API void finshell_builder_destroy(finshell_section_builder *builder);

/* Frees a section; NULL is ignored, and so is what is no section (destroyed before, or never created). Since 0.1. */
FINSHELL_API void finshell_section_destroy(finshell_section *section);

/* Freedoms of an element of a section: 18, of a membrane 9. Errors: -1. Since 0.1. */
FINSHELL_API int32_t finshell_section_freedoms(const finshell_section *section, finshell_status *status);

/* What a section is. Set `size` first, as of a finshell_elements block; the rest is filled, and what the library does not know is 0. */
typedef struct finshell_properties {
   uint64_t size;           /* sizeof(finshell_properties) */
   int32_t layers;          /* number of layers */
   int32_t freedoms;        /* of an element: 18, of a membrane 9 */
   int32_t formulation;     /* 1: (S), 2: (P); 1 of membranes */
   int32_t isotropic;       /* 1: no layer depends on the material direction */
   int32_t membrane;        /* 1 or 0, as the options */
   int32_t wrinkling;
   double thickness;        /* of all layers */
   double offset;           /* height of the middle above the surface of the nodes */
   double areal_mass;       /* integrals of density times 1, z and z^2 through the thickness, z from the surface of the nodes */
   double first_moment;
   double rotatory_inertia;
} finshell_properties;

/* A layer of a section; `size` as in finshell_properties. */
typedef struct finshell_layer {
   uint64_t size;      /* sizeof(finshell_layer) */
   char law[32];       /* name of the law */
   int32_t parameters; /* number of its parameters, see finshell_section_parameter */
   int32_t points;     /* Gauss points through the layer, of flat elements; of membranes 0 */
   double thickness;
   double angle;   /* degrees, from the element's material direction to axis 1 of the law */
   double density; /* mass per reference volume */
   double height;  /* of its middle above the surface of the nodes */
} finshell_layer;

/* What a section is as a whole. Errors: -1; 2 a number overflows. Since 0.1. */
FINSHELL_API int32_t finshell_section_properties(const finshell_section *section, finshell_properties *properties,
                                                 finshell_status *status);

/* Layer i (from 0, bottom to top). Errors: -1 no such layer. Since 0.1. */
FINSHELL_API int32_t finshell_section_layer(const finshell_section *section, int32_t i, finshell_layer *layer,
                                            finshell_status *status);

/* Parameter i (from 0) of the law of a layer (from 0): its name into name[size], and its value, given or the default; both may be
 * NULL. Errors: -1 no such layer or parameter. Since 0.1. */
FINSHELL_API int32_t finshell_section_parameter(const finshell_section *section, int32_t layer, int32_t i, char *name,
                                                int32_t size, double *value, finshell_status *status);

/* Stiffness of the section at rest, about the surface of the nodes, in the element's material axes: (N11, N22, N12, M11, M22, M12)
 * from (E11, E22, 2 E12, K11, K22, 2 K12), as (A, B; B, D) in the theory of laminates.
 *   stiffness [6][6]   symmetric. Fibres that act in tension only are slack. Of membranes B and D are zeros; if they wrinkle, A is
 *                      that of the taut one
 * Errors: -1; 2 a law has no tangent at rest, or a number overflows. Since 0.1. */
FINSHELL_API int32_t finshell_section_stiffness(const finshell_section *section, double *stiffness, finshell_status *status);

/* ------------------------------------------------------------------ laws of your own
 *
 * A law is a function that is asked for many points at once. It says the energy W per reference volume, the second Piola-Kirchhoff
 * stress and its tangent, as functions of Green-Lagrange strain in its own axes 1, 2 (3 is the normal). A guide with complete laws:
 * doc/user_laws.md. What it must keep, and finshell_law_check looks at most of it:
 *   - It depends on its arguments alone, and is called from several threads at once. It keeps nothing, and allocates nothing if
 *     it is to be fast. It does not change the floating-point environment; traps are masked and flags forgotten when it returns.
 *   - A point that it cannot evaluate gets a code, FINSHELL_MATERIAL_LIMIT; the element is refused then, the others are not. What a
 *     number that is not finite belongs to is refused, too. Any strain may come, also one that turns the area inside out, or NaN.
 *   - A point has the same results wherever it stands among the others. */

/* What a law is a function of. Components in this order; a symmetric tangent has its diagonal first, then the rows above it. */
enum {
   FINSHELL_LAW_PLANE = 1,         /* plane stress: E11, E22, 2 E12; tangent 11, 22, 33, 12, 13, 23 of these three */
   FINSHELL_LAW_SOLID = 2,         /* in space: E11, E22, E33, 2 E12; tangent 11, 22, 33, 44, 12, 13, 14, 23, 24, 34 of these four.
                                      The library finds E33 so that S33 = 0 (by a local Newton iteration) and condenses. The plane
                                      has to be one of symmetry of the material. */
   FINSHELL_LAW_INCOMPRESSIBLE = 3 /* as before, and E33 follows from det C = 1 */
};

/* What a law is asked. */
typedef struct finshell_points {
   int32_t n;        /* points, a multiple of 8 */
   int32_t level;    /* 0: energy; 1: stress, too; 2: tangent, too. What is not asked for may be set or not. */
   double time;      /* at the end of the step; 0 unless the caller says it */
   double time_step; /* since its beginning; 0: at once */
   void *data;       /* of finshell_law */
} finshell_points;

/* A law. Arrays [component][n], so that loops over the points run along memory:
 *   parameters [parameters]               their values, in the order of the law
 *   strain [3 or 4][n]
 *   energy [n]; stress [3 or 4][n]; tangent [6 or 10][n]
 *   begin, end [states][n]                states; `end` is to be set at any level
 *   codes [n]                             0 on entry */
typedef void (*finshell_law_function)(const finshell_points *points, const double *parameters, const double *strain, double *energy,
                                      double *stress, double *tangent, const double *begin, double *end, int32_t *codes);

/* The thickness stretch of a law in the plane: stretch [n], its derivatives with respect to the strain, first [3][n] and second
 * [6][n]. Of laws with states it is that of a step of no time from the state zero. */
typedef void (*finshell_stretch_function)(const finshell_points *points, const double *parameters, const double *strain, double *stretch,
                                          double *first, double *second, int32_t *codes);

/* A law, said by the caller or by a shared library. Set all to zero first ({0}), then size. Sections copy what they need, but not
 * what `data` points to; name and parameters are not looked at after the call. */
typedef struct finshell_law {
   uint64_t size;                           /* sizeof(finshell_law) */
   const char *name;                        /* at most 31 characters; stands in messages */
   int32_t kind;                            /* FINSHELL_LAW_... */
   int32_t isotropic;                       /* 1: it does not depend on the direction of axes 1 and 2; saves time */
   int32_t states;                          /* state variables of a point, 0 to 1000: zero where nothing has been yet */
   int32_t parameters;                      /* number of parameters */
   const finshell_parameter *parameter;     /* [parameters], NULL when there are none */
   finshell_law_function evaluate;
   finshell_stretch_function stretch;       /* of laws in the plane; NULL: incompressible. Of others NULL */
   void *data;                              /* handed through to the functions */
} finshell_law;

/* The law of the layer that was added last is one of the caller's; its parameters as in finshell_builder_law. What `data` points to
 * has to stay as long as sections of the builder are used. Errors: -1 no builder, no layer, or what is wrong with the law, which
 * has to be there at rest: without a code, with a stiffness. Since 0.1. */
FINSHELL_API int32_t finshell_builder_own_law(finshell_section_builder *builder, const finshell_law *law, int32_t parameters,
                                              const char *const *names, const double *values, finshell_status *status);

/* State variables of an element of a section: how many numbers of `states_begin` and `states_end` (finshell_elements) belong to
 * each element; 0: its laws have none. Layer by layer, bottom to top; of a layer its three in-plane points in turn; of these the
 * points through the thickness, bottom to top; of these the variables of the law. Errors: -1. Since 0.1. */
FINSHELL_API int32_t finshell_section_states(const finshell_section *section, finshell_status *status);

/* Where the states of a layer (from 0) stand: variable v at point p of in-plane point g is number
 * first + (g points + p) variables + v of the element. Each may be NULL. Errors: -1 no section, no such layer. Since 0.1. */
FINSHELL_API int32_t finshell_section_layer_states(const finshell_section *section, int32_t layer, int32_t *first, int32_t *points,
                                                   int32_t *variables, finshell_status *status);

/* One thing that finshell_law_check looked at. */
typedef struct finshell_law_finding {
   char name[24];
   char meaning[112];
   double found; /* of stresses in parts of the stiffness at rest; may be NaN */
   double allowed;
   int32_t passed; /* 1 or 0 */
   int32_t padding;
} finshell_law_finding;

#define FINSHELL_LAW_FINDINGS 12

/* Look at a law from outside: derivatives against differences, symmetry, rotation, small strains, levels, refusal of the impossible.
 *   law                             the law; NULL: `material` says which
 *   material                        name of a law of the library's, or "plugin:LIBRARY#NAME"; not looked at when there is a law
 *   parameters, names, values       as in finshell_section_create
 *   finding [FINSHELL_LAW_FINDINGS] what was found
 * `failed` of the status is the number of findings that did not pass. Returns 0 when all did, else 2. Errors: -1. Since 0.1. */
FINSHELL_API int32_t finshell_law_check(const finshell_law *law, const char *material, int32_t parameters, const char *const *names,
                                        const double *values, finshell_law_finding *finding, finshell_status *status);

/* ------------------------------------------------------------------ elements */

/* What a call is about: n elements of one section, their motion, and what is known of them. Set all to zero first ({0}), then
 * `size`:
 *
 *    finshell_elements elements = {0};
 *    elements.size = sizeof elements;
 *
 * Later versions add members at the end. A block of an earlier header (smaller) is taken as it is, what it does not hold being 0;
 * of a later one (larger), what this library does not know must be 0. */
typedef struct finshell_elements {
   uint64_t size;           /* sizeof(finshell_elements) */
   int32_t n;               /* number of elements */
   int32_t convention;      /* FINSHELL_ROTATION_... */
   int32_t threads;         /* > 0: so many (at most 256); 0: as OpenMP chooses, but no more than one for each 256 elements, and 1
                               inside a parallel region. Another number than 1 uses OpenMP's threads, whose stay after the call is
                               OpenMP's affair. finshell_elements_recover takes one. */
   int32_t reserved;        /* 0 */
   const double *X;         /* [n][3][3] reference coordinates (element, node, component) */
   const double *u;         /* [n][3][3] displacements */
   const double *rotations; /* [n][3][3] or [n][3][4], as `convention` says. Of membranes `convention`, `rotations`, `state`, `normals`
                               and `straight` are not looked at and may be NULL or 0. */
   /* From here on each may be NULL. */
   const double *state;     /* [n][3][4] needed for FINSHELL_ROTATION_INCREMENT, else not looked at */
   const double *direction; /* [n][3] material direction 1, global, any length, projected on the element; NULL: global x (z where x
                               is normal to the element). Isotropic laws look at it in recovery only. */
   const double *normals;   /* [n][3][3] normals of the surface at the nodes of each element, global, any length, less than 90
                               degrees from that of the triangle: the reference is the curved element that they describe. NULL:
                               flat facets, and so are elements whose three normals are that of the triangle. No effect in
                               formulation (P). Where a surface has a crease, each side has normals of its own. */
   const double *toward;    /* [n][18] for a tangent at a switch of a law, as fibres in tension only have it where they are just
                               unstretched: displacements and spins of the nodes in whose direction it is taken; of membranes [n][9].
                               NULL: fibres at the switch are slack. */
   const int32_t *straight; /* [n][3] of each side (nodes 0-1, 1-2, 2-0): 0 free; 1 not bent by drilling rotations, because its
                               displacement along its normal in the plane of the element is prescribed; 2 nor by slopes, because
                               that along the normal of the element is prescribed, too. NULL: all free. */
   /* What elements have of their own instead of the section's, so that one section serves all; NULL: nothing. */
   const double *thickness; /* [n] of the whole section, > 0, length; its layers keep their shares */
   const double *offset;    /* [n] height of the middle of the section above the surface of the nodes, length; of membranes not looked
                               at */
   const double *growth;    /* [n][layers][4] how each layer has grown since the reference, or shrunk: Green-Lagrange strain of its
                               stress-free state, E11, E22, 2 E12 along the material direction of the element, and growth of its
                               thickness, current over reference, less 1. With a stretch g all round, 0.5 (g g - 1), the same, 0, g - 1;
                               of a sheet that has been stretched by g before it was built in, g being replaced by 1/g. Law, strains and
                               stretches count from there, thickness stretch and resultants from the reference. All layers of a membrane
                               grow the same. */
   /* Of sections whose laws have states, else not looked at. Both belong to the caller: nothing is kept between calls, so that an
      iteration can be repeated, and the end becomes the next beginning when the caller says so. */
   const double *states_begin; /* [n][finshell_section_states] at the beginning of the step; needed then */
   double *states_end;         /* the same at its end, by finshell_elements_evaluate; NULL: not wanted. Not states_begin */
   double time;                /* at the end of the step */
   double time_step;           /* since its beginning, >= 0 */
} finshell_elements;

/* Energy, force and tangent of n elements of one section.
 *   energy [n]             stored energy; of membranes that wrinkle the relaxed one, with what is left of it against compression
 *   force [n][18]          internal force; of membranes [n][9]
 *   tangent [n][18][18]    symmetric, both triangles; of membranes [n][9][9]
 *   codes [n]              per element
 * Elements are computed eight at a time: a call for one element costs what a call for eight does.
 * Errors: all codes. Since 0.1. */
FINSHELL_API int32_t finshell_elements_evaluate(const finshell_section *section, const finshell_elements *elements,
                                                double *energy, double *force, double *tangent, int32_t *codes,
                                                finshell_status *status);

/* Thickness stretch, resultants and stresses of n elements. Components 11, 22, 12 refer to the material direction, projected on
 * the element and carried along by its rotation; isotropic laws as well.
 *   stretch [n]                 current over reference thickness, of the surface of the nodes; that of the facet, with normals too
 *   membrane_force [n][3]       per reference length, conjugate to the Green-Lagrange strain of the surface of the nodes
 *   moment [n][3]               per reference length, about the surface of the nodes, conjugate to the curvature; of membranes zeros
 *   stress [n][3][3]            Cauchy stress (element; bottom, middle, top of the section; component); evaluated only if asked for:
 *                               a law may end at the surfaces (code 2) and not at the points that evaluation looks at
 *   codes [n]
 * Of membranes that wrinkle stretch and stresses are those of the material, which is wider than its facet; what is left against
 * compression is left out. Errors: all codes. Since 0.1. */
FINSHELL_API int32_t finshell_elements_recover(const finshell_section *section, const finshell_elements *elements,
                                               double *stretch, double *membrane_force, double *moment, double *stress,
                                               int32_t *codes, finshell_status *status);

/* Which of n membranes are slack, wrinkled or taut, and where the wrinkles run. A section of a shell is refused.
 *   state [n]      FINSHELL_SHEET_...; taut unless the section has "wrinkling"
 *   ridge [n][3]   unit vector along the ridges, global, in the deformed state (either of the two); zeros unless wrinkled
 *   codes [n]
 * Errors: all codes. Since 0.1. */
FINSHELL_API int32_t finshell_elements_wrinkles(const finshell_section *section, const finshell_elements *elements,
                                                int32_t *state, double *ridge, int32_t *codes, finshell_status *status);

/* Pressure on the elements of a block, flat or curved, and the volume behind them. With normals it acts on the curved surface: beside
 * the forces on the facets it has forces and couples, those of the work on the caps between facets and surface. (With formulation
 * (P), which does not look at normals, leave them out.)
 *   pressure [n]            per current area, positive along the current normal; NULL where force and stiffness are
 *   form, origin [3]        of the facets, as in finshell_pressure_load; the caps have one form, which is symmetric
 *   volume [n]              of the cone from `origin` to the facet, and of the cap on it: the sum over a closed surface, or one whose
 *                           edges stay in planes through the origin, is the enclosed volume. In form 1 force is pressure times its
 *                           derivative.
 *   force [n][18]           external force: adds to the loads. Without normals, the numbers of finshell_pressure_load and no moments
 *   stiffness [n][18][18]   d force / d (u, rotations), in the unknowns of `convention`, by rows:
 *                           stiffness[e][i][j] = d force[i] / d unknown[j]; unsymmetric in form 0. The tangent of the structure is the
 *                           elements' tangent minus this.
 *   codes [n]
 * `threads`, `direction` and `toward` do not matter, of `straight` only 2. Over a free edge the side counts as straight.
 * Pressure on membranes, in their 9 freedoms: finshell_pressure_load; the volume behind them: from here, rotations being zeros.
 * Errors: all codes but 2 and 4. Since 0.1. */
FINSHELL_API int32_t finshell_elements_pressure(const finshell_elements *elements, const double *pressure, int32_t form,
                                                const double *origin, double *volume, double *force, double *stiffness,
                                                int32_t *codes, finshell_status *status);

/* Short form of finshell_elements_evaluate, for flat facets: the arguments are the members of the block, what is not among them
 * is NULL. Errors: all codes. Since 0.1. */
FINSHELL_API int32_t finshell_evaluate(const finshell_section *section, int32_t n, const double *X, const double *u,
                                       const double *rotations, int32_t convention, const double *state, const double *direction,
                                       double *energy, double *force, double *tangent, int32_t *codes, int32_t threads,
                                       finshell_status *status);

/* Short form of finshell_elements_recover, for flat facets. Errors: all codes. Since 0.1. */
FINSHELL_API int32_t finshell_recover(const finshell_section *section, int32_t n, const double *X, const double *u,
                                      const double *rotations, int32_t convention, const double *state, const double *direction,
                                      double *stretch, double *membrane_force, double *moment, double *stress, int32_t *codes,
                                      finshell_status *status);

/* Mass matrices of n elements, from the densities of the section, with rotational inertia (of the drilling rotation, too).
 *   X [n][3][3]              reference coordinates
 *   consistent [n][18][18]   symmetric; linear interpolation
 *   lumped [n][18]           diagonal, a third of the element at each node
 * Of membranes [n][9][9] and [n][9], and what follows is about shells.
 * Rates are those of displacements and spins (w = T(t) dt/dt for rotation vectors, see finshell_rotation_tangent). Without
 * offset and with layers symmetric about the surface of the nodes the matrices hold in any motion; else the coupling of
 * displacement and spin is that of the reference normal (consistent), or left out (lumped).
 * Errors: -1, -2, -3, -6. Since 0.1. */
FINSHELL_API int32_t finshell_mass_matrix(const finshell_section *section, int32_t n, const double *X, double *consistent,
                                          double *lumped, int32_t *codes, finshell_status *status);

/* The same for the elements of a block, of which X, thickness and offset count: what has grown keeps its mass.
 * Errors: -1, -2, -3, -6. Since 0.1. */
FINSHELL_API int32_t finshell_elements_mass(const finshell_section *section, const finshell_elements *elements, double *consistent,
                               double *lumped, int32_t *codes, finshell_status *status);

/* Follower pressure on n flat triangles, in displacements only: that of membranes. On curved elements: finshell_elements_pressure.
 *   pressure [n]           per current area, positive along the current normal
 *   X, u [n][3][3]         reference coordinates, displacements
 *   form                   0: follower, p A n / 3 at each node; stiffness unsymmetric on an element.
 *                          1: gradient of p times the volume below the triangles, seen from `origin`; stiffness symmetric. Both
 *                          agree at nodes whose elements surround them; they differ on the rim of the loaded surface.
 *   origin [3]             for form 1; NULL: the origin of coordinates
 *   force [n][9]           external force at the nodes in turn (no moments): adds to the loads
 *   stiffness [n][9][9]    d force / d u, by columns: stiffness[e][j][i] = d force[i] / d u[j]. The tangent of the structure
 *                          is the elements' tangent minus this.
 *   codes [n]
 * Errors: -1, -3, -6. Since 0.1. */
FINSHELL_API int32_t finshell_pressure_load(int32_t n, const double *pressure, const double *X, const double *u, int32_t form,
                                            const double *origin, double *force, double *stiffness, int32_t *codes,
                                            finshell_status *status);

/* ------------------------------------------------------------------ assembly
 * From the elements to the structure. A host makes an assembly of its mesh once and reads the pattern of its matrix, compressed rows;
 * then each call adds the contributions of all elements to arrays by nodes and to the values of the matrix, in threads and, whatever
 * their number, to the same last bit.
 *
 * Arrays of the motion are by nodes: of the block finshell_elements, X, u [nodes][3], rotations [nodes][3] or [nodes][4], state
 * [nodes][4] and toward [nodes][nodal]; n is the number of elements of the mesh, and all other members are by element, as ever; growth
 * and states have as many places for each element as the section with most of them asks for.
 *
 * Every call ADDS to force [nodes][nodal] and values [entries] (set them to zero first, or let contributions add up), `factor`
 * times what it says. Forces are those of all nodes, held or not: at held ones they are reactions. NULL: not computed. A failed
 * element adds nothing. Of the values, entries of rows and columns that are held do not exist. An upper triangle takes the
 * symmetric part of a matrix that is not symmetric. Sums may overflow: that is looked at in elements only. */

/* What of the matrix is stored. By columns instead of rows, the upper triangle is the lower one. */
enum {
   FINSHELL_WHOLE = 0,
   FINSHELL_UPPER = 1
};

/* The mesh of an assembly. Set all to zero first ({0}), then `size`, as with finshell_elements. */
typedef struct finshell_mesh {
   uint64_t size;     /* sizeof(finshell_mesh) */
   int32_t nodes;     /* number of nodes */
   int32_t elements;  /* number of elements */
   int32_t nodal;     /* freedoms of a node in all arrays: 6, u and t; 3, u alone, where all sections are membranes; 0: as few as
                         the sections need */
   int32_t triangle;  /* FINSHELL_WHOLE or FINSHELL_UPPER */
   int32_t rows;      /* of the matrix, with `freedoms`; 0: one more than the largest of these */
   int32_t reserved;  /* 0 */
   const int32_t *triangles; /* [elements][3] nodes of each element, from 0 */
   /* From here on each may be NULL. */
   const int32_t *sections; /* [elements] which section, from 0; NULL: the first */
   const int32_t *held;     /* [nodes][nodal] not 0: the freedom is held, and has no row; NULL: none */
   const int32_t *freedoms; /* [nodes][nodal] the row of each freedom in your matrix, from 0; -1: none. NULL: rows are numbered here,
                               node by node, without what is held, and without freedoms that no element has (rotations of nodes of
                               membranes) */
   const int64_t *starts;   /* [rows + 1], with `columns` and `freedoms`: the pattern of a matrix of yours that has room for others, */
   const int32_t *columns;  /* too; compressed rows from 0, columns rising in each. NULL: the pattern is made here */
} finshell_mesh;

/* The layout of an assembly; immutable once created: any number of threads may use one at once. */
typedef struct finshell_assembly finshell_assembly;

/* Make an assembly.
 *   section [sections]   of the elements. Looked at for their kind, shell or membrane, and not kept: later calls may have others of the
 *                        same kinds.
 * Memory: some 400 bytes an element, and the pattern. Errors: -1, -6. Since 0.1. */
FINSHELL_API int32_t finshell_assembly_create(const finshell_mesh *mesh, int32_t sections, const finshell_section *const *section,
                                 finshell_assembly **assembly, finshell_status *status);

/* Frees an assembly; NULL is ignored, and so is what is none. Since 0.1. */
FINSHELL_API void finshell_assembly_destroy(finshell_assembly *assembly);

/* Freedoms of a node, rows and stored entries of the matrix. Errors: -1. Since 0.1. */
FINSHELL_API int32_t finshell_assembly_size(const finshell_assembly *assembly, int32_t *nodal, int32_t *rows, int64_t *entries,
                               finshell_status *status);

/* freedoms [nodes][nodal]: the row of each freedom, -1: it has none. Errors: -1. Since 0.1. */
FINSHELL_API int32_t finshell_assembly_freedoms(const finshell_assembly *assembly, int32_t *freedoms, finshell_status *status);

/* The pattern, compressed rows from 0: row i has the entries starts[i] ... starts[i + 1] - 1, their columns rising.
 *   starts [rows + 1], columns [entries]
 * Errors: -1, also where a matrix has more than 2147483647 entries. Since 0.1. */
FINSHELL_API int32_t finshell_assembly_pattern(const finshell_assembly *assembly, int32_t *starts, int32_t *columns, finshell_status *status);

/* The same in 64 bits. Errors: -1. Since 0.1. */
FINSHELL_API int32_t finshell_assembly_pattern_64(const finshell_assembly *assembly, int64_t *starts, int64_t *columns,
                                     finshell_status *status);

/* Internal forces and tangent.
 *   section [sections]   as many, and of the same kinds, as finshell_assembly_create had
 *   energy [1]           stored energy of all elements
 *   force, values        internal forces and their derivative are added
 *   codes [elements]
 * Errors: all codes. Since 0.1. */
FINSHELL_API int32_t finshell_assembly_evaluate(const finshell_assembly *assembly, int32_t sections, const finshell_section *const *section,
                                   const finshell_elements *elements, double *energy, double *force, double *values,
                                   int32_t *codes, finshell_status *status);

/* Pressure on flat and curved elements, as finshell_elements_pressure has it: factor times the external force is added to force, factor
 * times its derivative to values. With factor -1 both belong to residual and tangent.
 *   pressure [elements]   0 where there is none
 * Errors: all codes but 2 and 4. Since 0.1. */
FINSHELL_API int32_t finshell_assembly_pressure(const finshell_assembly *assembly, const finshell_elements *elements, const double *pressure,
                                   int32_t form, const double *origin, double factor, double *force, double *values,
                                   int32_t *codes, finshell_status *status);

/* Volume behind the elements, and its derivative with respect to the freedoms (the force of a pressure of 1 in form 1).
 *   side [elements]            counts each element so many times: 1, -1 where its normal points inwards, 0 where it does not belong to
 *                              the chamber; NULL: 1
 *   volume [1]                 seen from `origin`; of a closed surface the enclosed one
 *   gradient [nodes][nodal]    is added
 * Errors: all codes but 2 and 4. Since 0.1. */
FINSHELL_API int32_t finshell_assembly_volume(const finshell_assembly *assembly, const finshell_elements *elements, const double *side,
                                 const double *origin, double *volume, double *gradient, int32_t *codes, finshell_status *status);

/* Masses, as finshell_elements_mass has them; of the block X, thickness, offset and `threads` count.
 *   lumped [nodes][nodal]   factor times the diagonal of the lumped matrix is added
 *   values                  factor times the consistent matrix is added
 * Errors: -1, -2, -3, -6. Since 0.1. */
FINSHELL_API int32_t finshell_assembly_mass(const finshell_assembly *assembly, int32_t sections, const finshell_section *const *section,
                               const finshell_elements *elements, double factor, double *lumped, double *values, int32_t *codes,
                               finshell_status *status);

/* Dead tractions: a third of the load of each (flat) element to each of its nodes.
 *   traction [elements][3]   force per reference area, global axes
 * Errors: -1, -2, -3, -6. Since 0.1. */
FINSHELL_API int32_t finshell_assembly_traction(const finshell_assembly *assembly, const double *X, const double *traction, double factor,
                                   double *force, int32_t *codes, finshell_status *status);

/* Weight: the areal mass of the sections, or of the thickness of the elements' own, times acceleration [3]; of the block X,
 * thickness and `threads` count. Errors: -1, -2, -3, -6. Since 0.1. */
FINSHELL_API int32_t finshell_assembly_gravity(const finshell_assembly *assembly, int32_t sections, const finshell_section *const *section,
                                  const finshell_elements *elements, const double *acceleration, double factor, double *force,
                                  int32_t *codes, finshell_status *status);

/* Dead line loads on n sides of elements: half to each end and, since drilling rotations bend the side, couples with a stiffness (not at
 * sides that elements->straight names, nor of membranes). Where two elements share a loaded edge, give each its share.
 *   element [n], side [n]   side 0, 1, 2: nodes 0-1, 1-2, 2-0 of the element
 *   load [n][3]             force per reference length, global axes
 *   codes [n]               of the loads; status->index is the load, too
 * Errors: all codes but 2 and 4. Since 0.1. */
FINSHELL_API int32_t finshell_assembly_line_load(const finshell_assembly *assembly, const finshell_elements *elements, int32_t n,
                                    const int32_t *element, const int32_t *side, const double *load, double factor,
                                    double *force, double *values, int32_t *codes, finshell_status *status);

/* ------------------------------------------------------------------ element fields by name */

/* Where an element has values of a field. */
enum {
   FINSHELL_AT_ELEMENT = 1,  /* one value */
   FINSHELL_AT_SURFACES = 2, /* three: bottom, middle, top of the section */
   FINSHELL_AT_LAYERS = 3    /* one in the middle of each layer, bottom to top */
};

/* A field of the table. Components 11, 22, 12 are those of a tensor along the material direction, projected on the element and
 * carried along by its rotation; x, y, z are global, of unit vectors in the deformed configuration. */
typedef struct finshell_field_entry {
   char name[32];
   char components[32]; /* "11, 22, 12", "1, 2", "x, y, z"; "" for a scalar */
   char dimension[32];  /* "stress", "1/length", ...; "-" for a number */
   char meaning[128];
   int32_t number;      /* of components */
   int32_t at;          /* FINSHELL_AT_... */
} finshell_field_entry;

/* Number of element fields. Since 0.1. */
FINSHELL_API int32_t finshell_field_count(void);

/* Field i (from 0). Errors: -1 no such field. Since 0.1. */
FINSHELL_API int32_t finshell_field_information(int32_t i, finshell_field_entry *field, finshell_status *status);

/* One field of n elements of one section; only what it needs is evaluated.
 *   name                            of the field, as in finshell_field_entry
 *   values [n][places][components]  places: 1, 3 or the number of layers, as `at` says. 0 where there is no value to be expected:
 *                                   along the fibres of a layer that has none
 *   codes [n]
 * Errors: all codes; -1 unknown field. Since 0.1. */
FINSHELL_API int32_t finshell_recover_field(const finshell_section *section, const finshell_elements *elements, const char *name,
                                            double *values, int32_t *codes, finshell_status *status);

/* ------------------------------------------------------------------ rotations
 * n at a time. Quaternions [n][4], scalar part first; inputs of any length, outputs of length 1. Errors: -1 NULL, a
 * quaternion of zeros, or a vector beyond 1e60; -3; -6. All since 0.1. */

/* quaternion = exp(vector), vector [n][3]. */
FINSHELL_API int32_t finshell_rotation_exp(int32_t n, const double *vector, double *quaternion, int32_t *codes,
                                           finshell_status *status);

/* vector [n][3] = log(quaternion), |vector| <= pi. */
FINSHELL_API int32_t finshell_rotation_log(int32_t n, const double *quaternion, double *vector, int32_t *codes,
                                           finshell_status *status);

/* c = a b: first the rotation b, then a. c may be a or b. */
FINSHELL_API int32_t finshell_rotation_compose(int32_t n, const double *a, const double *b, double *c, int32_t *codes,
                                               finshell_status *status);

/* quaternion <- exp(spin) quaternion, in place; spin [n][3]. One that fails stays as it was. */
FINSHELL_API int32_t finshell_rotation_update(int32_t n, const double *spin, double *quaternion, int32_t *codes,
                                              finshell_status *status);

/* matrix [n][3][3], by rows: matrix[e][i][j] = R_ij. */
FINSHELL_API int32_t finshell_rotation_matrix(int32_t n, const double *quaternion, double *matrix, int32_t *codes,
                                              finshell_status *status);

/* T(vector) [n][3][3], by rows: spin = T d vector. Moments conjugate to the vector are T' times those conjugate to the spin. */
FINSHELL_API int32_t finshell_rotation_tangent(int32_t n, const double *vector, double *tangent, int32_t *codes,
                                               finshell_status *status);

#ifdef __cplusplus
}
#endif
#endif
