/* Wrong calls and wrong elements: code, index and message; everything else is done; nothing is printed, nothing ends. */
#define _POSIX_C_SOURCE 200809L
#include "check.h"

static finshell_status status;

/* The last call failed as a whole, and its message contains a word. */
static void refused(int32_t code, const char *word, int line)
{
   check(code == FINSHELL_INVALID_ARGUMENT && status.code == code && status.index == -1 && status.failed == 0, word, line);
   if (!strstr(status.message, word)) check(0, status.message, line);
   memset(&status, 0x55, sizeof status);
}
#define REFUSED(call, word) refused((call), (word), __LINE__)

static void sections(void)
{
   const char *names[] = {"c10", "c01", "c10"}, *wrong[] = {"c10", "c11"}, *none[] = {NULL};
   const char *option[] = {"beta0", "beta0"};
   const double values[] = {80, 20, 30}, bad[] = {NAN, 20}, negative[] = {-80, 0}, many[] = {13}, half[] = {1.5}, zero[] = {0, 0};
   char long_name[5000];
   finshell_section *s = (finshell_section *)&status;
   memset(long_name, 'x', sizeof long_name - 1);
   long_name[sizeof long_name - 1] = 0;
   const char *long_names[] = {long_name};

   REFUSED(finshell_section_create("rubber", 2, names, values, 1, 0, NULL, NULL, &s, &status), "known laws are mooney_rivlin");
   CHECK(s == NULL);
   REFUSED(finshell_section_create(NULL, 2, names, values, 1, 0, NULL, NULL, &s, &status), "NULL");
   REFUSED(finshell_section_create("", 2, names, values, 1, 0, NULL, NULL, &s, &status), "unknown");
   REFUSED(finshell_section_create(long_name, 2, names, values, 1, 0, NULL, NULL, &s, &status), "unknown");
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, NULL, 1, 0, NULL, NULL, &s, &status), "NULL");
   REFUSED(finshell_section_create("mooney_rivlin", 2, NULL, values, 1, 0, NULL, NULL, &s, &status), "NULL");
   REFUSED(finshell_section_create("mooney_rivlin", -1, names, values, 1, 0, NULL, NULL, &s, &status), "parameters is -1");
   REFUSED(finshell_section_create("mooney_rivlin", 1, none, values, 1, 0, NULL, NULL, &s, &status), "parameter ''");
   REFUSED(finshell_section_create("mooney_rivlin", 1, long_names, values, 1, 0, NULL, NULL, &s, &status), "unknown parameter");
   REFUSED(finshell_section_create("mooney_rivlin", 0, NULL, NULL, 1, 0, NULL, NULL, &s, &status), "c10");
   REFUSED(finshell_section_create("mooney_rivlin", 2, wrong, values, 1, 0, NULL, NULL, &s, &status), "'c11'");
   REFUSED(finshell_section_create("mooney_rivlin", 3, names, values, 1, 0, NULL, NULL, &s, &status), "twice");
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, bad, 1, 0, NULL, NULL, &s, &status), "finite");
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, negative, 1, 0, NULL, NULL, &s, &status), "mooney_rivlin");
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, 0, 0, NULL, NULL, &s, &status), "thickness is");
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, NAN, 0, NULL, NULL, &s, &status), "thickness is");
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, 1, 0, NULL, NULL, NULL, &status), "NULL");
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, 1, 1, NULL, values, &s, &status), "option");
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, 1, 2, option, values, &s, &status), "twice");
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, 1, 1, option, zero, &s, &status), "beta0 is");
   option[0] = "thickness_points";
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, 1, 1, option, many, &s, &status), "thickness_points is 13");
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, 1, 1, option, half, &s, &status), "whole number");
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, 1, 1, option, bad, &s, &status), "whole number");
   option[0] = "formulation";
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, 1, 1, option, zero, &s, &status), "formulation is 0");
   option[0] = "offset";
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, 1, 1, option, bad, &s, &status), "offset is");
   option[0] = "density";
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, 1, 1, option, negative, &s, &status), "density is");
   option[0] = "shear";
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, 1, 1, option, zero, &s, &status), "options are formulation");
   option[0] = "thickness_points, density"; /* part of the list of options, but none */
   REFUSED(finshell_section_create("mooney_rivlin", 2, names, values, 1, 1, option, zero, &s, &status), "unknown option");

   CHECK(finshell_section_create("mooney_rivlin", 2, names, values, 1, 0, NULL, NULL, &s, &status) == 0);
   CHECK(s != NULL && status.code == 0 && status.index == -1 && status.message[0] == 0);
   finshell_section_destroy(s);
   finshell_section_destroy(NULL);
}

/* Every argument that must not be NULL, and numbers out of range; outputs stay untouched. */
static void arguments(void)
{
   patch p = new_patch(3, 1);
   finshell_section *s = rubber(0.1);
   double energy[3] = {7, 7, 7}, force[3][18], out[3 * 81], origin[3] = {0, 0, NAN};

   REFUSED(finshell_evaluate(NULL, 3, p.X, p.u, p.vector, 1, NULL, NULL, energy, NULL, NULL, NULL, 1, &status), "section is NULL");
   REFUSED(finshell_evaluate(s, -1, p.X, p.u, p.vector, 1, NULL, NULL, energy, NULL, NULL, NULL, 1, &status), "n is -1");
   REFUSED(finshell_evaluate(s, 3, NULL, p.u, p.vector, 1, NULL, NULL, energy, NULL, NULL, NULL, 1, &status), "X is NULL");
   REFUSED(finshell_evaluate(s, 3, p.X, NULL, p.vector, 1, NULL, NULL, energy, NULL, NULL, NULL, 1, &status), "u is NULL");
   REFUSED(finshell_evaluate(s, 3, p.X, p.u, NULL, 1, NULL, NULL, energy, NULL, NULL, NULL, 1, &status), "rotations is NULL");
   REFUSED(finshell_evaluate(s, 3, p.X, p.u, p.vector, 0, NULL, NULL, energy, NULL, NULL, NULL, 1, &status), "convention is 0");
   REFUSED(finshell_evaluate(s, 3, p.X, p.u, p.vector, 4, NULL, NULL, energy, NULL, NULL, NULL, 1, &status), "convention is 4");
   REFUSED(finshell_evaluate(s, 3, p.X, p.u, p.vector, 3, NULL, NULL, energy, NULL, NULL, NULL, 1, &status), "state is NULL");
   REFUSED(finshell_evaluate(s, 3, p.X, p.u, p.vector, 1, NULL, NULL, energy, NULL, NULL, NULL, -1, &status), "threads is -1");
   CHECK(energy[0] == 7 && energy[1] == 7 && energy[2] == 7);
   CHECK(finshell_evaluate(NULL, 3, NULL, NULL, NULL, 9, NULL, NULL, NULL, NULL, NULL, NULL, 1, NULL) == FINSHELL_INVALID_ARGUMENT);
   CHECK(finshell_evaluate(s, 0, NULL, NULL, NULL, 1, NULL, NULL, NULL, NULL, NULL, NULL, 1, &status) == 0);
   CHECK(finshell_evaluate(s, 3, p.X, p.u, p.vector, 1, NULL, NULL, NULL, NULL, NULL, NULL, 1, NULL) == 0);
   CHECK(finshell_evaluate(s, 3, p.X, p.u, p.vector, 1, NULL, NULL, NULL, &force[0][0], NULL, NULL, 1000000000, &status) == 0);

   REFUSED(finshell_recover(NULL, 3, p.X, p.u, p.vector, 1, NULL, NULL, energy, NULL, NULL, NULL, NULL, &status), "section");
   REFUSED(finshell_recover(s, 3, p.X, p.u, p.vector, 3, NULL, NULL, energy, NULL, NULL, NULL, NULL, &status), "state");
   REFUSED(finshell_recover(s, -3, p.X, p.u, p.vector, 1, NULL, NULL, energy, NULL, NULL, NULL, NULL, &status), "n is -3");
   CHECK(finshell_recover(s, 0, NULL, NULL, NULL, 1, NULL, NULL, NULL, NULL, NULL, NULL, NULL, &status) == 0);
   CHECK(finshell_recover(s, 3, p.X, p.u, p.vector, 1, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL) == 0);

   REFUSED(finshell_mass_matrix(NULL, 3, p.X, NULL, out, NULL, &status), "section is NULL");
   REFUSED(finshell_mass_matrix(s, 3, NULL, NULL, out, NULL, &status), "X is NULL");
   REFUSED(finshell_mass_matrix(s, -3, p.X, NULL, out, NULL, &status), "n is -3");
   CHECK(finshell_mass_matrix(s, 3, p.X, NULL, NULL, NULL, NULL) == 0 && finshell_mass_matrix(s, 0, NULL, NULL, NULL, NULL, NULL) == 0);

   REFUSED(finshell_pressure_load(3, NULL, p.X, p.u, 0, NULL, out, NULL, NULL, &status), "NULL");
   REFUSED(finshell_pressure_load(3, energy, NULL, p.u, 0, NULL, out, NULL, NULL, &status), "NULL");
   REFUSED(finshell_pressure_load(3, energy, p.X, NULL, 0, NULL, out, NULL, NULL, &status), "NULL");
   REFUSED(finshell_pressure_load(3, energy, p.X, p.u, 2, NULL, out, NULL, NULL, &status), "form is 2");
   REFUSED(finshell_pressure_load(-3, energy, p.X, p.u, 0, NULL, out, NULL, NULL, &status), "n is -3");
   CHECK(finshell_pressure_load(3, energy, p.X, p.u, 0, NULL, NULL, NULL, NULL, NULL) == 0);
   CHECK(finshell_pressure_load(3, energy, p.X, p.u, 1, origin, out, NULL, NULL, &status) == FINSHELL_NOT_A_NUMBER && out[0] == 0);

   REFUSED(finshell_rotation_exp(1, NULL, out, NULL, &status), "NULL");
   REFUSED(finshell_rotation_exp(1, p.vector, NULL, NULL, &status), "NULL");
   REFUSED(finshell_rotation_log(-1, p.quaternion, out, NULL, &status), "n is -1");
   REFUSED(finshell_rotation_log(1, NULL, out, NULL, &status), "NULL");
   REFUSED(finshell_rotation_compose(1, p.quaternion, NULL, out, NULL, &status), "NULL");
   REFUSED(finshell_rotation_update(1, p.vector, NULL, NULL, &status), "NULL");
   REFUSED(finshell_rotation_matrix(1, p.quaternion, NULL, NULL, &status), "NULL");
   REFUSED(finshell_rotation_tangent(1, NULL, out, NULL, &status), "NULL");
   CHECK(finshell_rotation_exp(0, NULL, NULL, NULL, NULL) == 0);
   free_patch(p);
   finshell_section_destroy(s);
}

/* One element after another of a batch is spoiled; the others have the bits they have in a clean batch. */
static void spoiled(int32_t n, int32_t victim, int32_t expected, const char *how, int convention)
{
   patch p = new_patch(n, 5);
   finshell_section *s = laminate(0.01);
   double *energy = malloc(sizeof(double) * n), *force = malloc(sizeof(double) * 18 * n), *tangent = malloc(sizeof(double) * 324 * n);
   double *e2 = malloc(sizeof(double) * n), *f2 = malloc(sizeof(double) * 18 * n), *k2 = malloc(sizeof(double) * 324 * n);
   int32_t *codes = malloc(sizeof(int32_t) * n);
   double *rotations = convention == FINSHELL_ROTATION_QUATERNION ? p.quaternion : p.vector;
   double *x = p.X + 9 * victim, *u = p.u + 9 * victim, *d = p.direction + 3 * victim, *q = p.quaternion + 12 * victim;

   CHECK(finshell_evaluate(s, n, p.X, p.u, rotations, convention, p.quaternion, p.direction, e2, f2, k2, codes, 1, &status) == 0);
   if (strcmp(how, "nan") == 0) u[4] = NAN;
   if (strcmp(how, "infinite") == 0) x[0] = -INFINITY;
   if (strcmp(how, "nan direction") == 0) d[2] = NAN;
   if (strcmp(how, "no direction") == 0) d[0] = d[1] = d[2] = 0;
   if (strcmp(how, "no quaternion") == 0) q[4] = q[5] = q[6] = q[7] = 0;
   if (strcmp(how, "collinear") == 0) for (int c = 0; c < 3; c++) x[6 + c] = 2 * x[3 + c] - x[c];
   if (strcmp(how, "collapsed") == 0) for (int c = 0; c < 3; c++) u[6 + c] = x[3 + c] + u[3 + c] - x[6 + c];
   for (int threads = 1; threads <= 2; threads++) {
      int32_t code = finshell_evaluate(s, n, p.X, p.u, rotations, convention, p.quaternion, p.direction, energy, force, tangent,
                                       codes, threads, &status);
      CHECK(code == expected && status.code == expected && status.index == victim && status.failed == 1);
      if (code != expected) fprintf(report, "%s: code %d, expected %d\n", how, (int)code, (int)expected);
      CHECK(strstr(status.message, "finshell_evaluate: element ") != NULL);
      for (int32_t e = 0; e < n; e++) {
         CHECK(codes[e] == (e == victim ? expected : 0));
         if (e == victim) {
            CHECK(energy[e] == 0);
            for (int i = 0; i < 18; i++) CHECK(force[18 * e + i] == 0);
            for (int i = 0; i < 324; i++) CHECK(tangent[324 * e + i] == 0);
         } else {
            CHECK(energy[e] == e2[e] && memcmp(force + 18 * e, f2 + 18 * e, sizeof(double) * 18) == 0
                  && memcmp(tangent + 324 * e, k2 + 324 * e, sizeof(double) * 324) == 0);
         }
      }
   }
   CHECK(finshell_recover(s, n, p.X, p.u, rotations, convention, p.quaternion, p.direction, energy, NULL, NULL, NULL, codes, &status)
         == expected && status.index == victim && energy[victim] == 0);
   CHECK(energy[(victim + 1) % n] > 0);
   finshell_section_destroy(s);
   free_patch(p);
   free(energy), free(force), free(tangent), free(e2), free(f2), free(k2), free(codes);
}

static void elements(void)
{
   for (int32_t victim = 0; victim < 19; victim += 6) {
      for (int convention = 1; convention <= 3; convention++) {
         spoiled(19, victim, FINSHELL_NOT_A_NUMBER, "nan", convention);
         spoiled(19, victim, FINSHELL_NOT_A_NUMBER, "infinite", convention);
         spoiled(19, victim, FINSHELL_NOT_A_NUMBER, "nan direction", convention);
         spoiled(19, victim, FINSHELL_INVALID_ARGUMENT, "no direction", convention);
         spoiled(19, victim, FINSHELL_DEGENERATE_REFERENCE, "collinear", convention);
         spoiled(19, victim, FINSHELL_COLLAPSED_ELEMENT, "collapsed", convention);
      }
      spoiled(19, victim, FINSHELL_INVALID_ARGUMENT, "no quaternion", FINSHELL_ROTATION_QUATERNION);
      spoiled(19, victim, FINSHELL_INVALID_ARGUMENT, "no quaternion", FINSHELL_ROTATION_INCREMENT);
   }
}

/* Two elements fail: the mistake counts more than the recoverable one. */
static void which_code(void)
{
   patch p = new_patch(9, 3);
   finshell_section *s = rubber(0.1);
   int32_t codes[9];
   for (int c = 0; c < 3; c++) p.u[9 * 2 + 6 + c] = p.X[9 * 2 + 3 + c] + p.u[9 * 2 + 3 + c] - p.X[9 * 2 + 6 + c];
   CHECK(finshell_evaluate(s, 9, p.X, p.u, p.vector, 1, NULL, NULL, NULL, NULL, NULL, codes, 1, &status) == 1 && status.index == 2);
   p.u[9 * 8] = NAN;
   p.u[9 * 7] = NAN;
   CHECK(finshell_evaluate(s, 9, p.X, p.u, p.vector, 1, NULL, NULL, NULL, NULL, NULL, codes, 1, &status) == FINSHELL_NOT_A_NUMBER);
   CHECK(status.index == 7 && status.failed == 3 && codes[2] == 1 && codes[7] == -3 && codes[8] == -3 && codes[0] == 0);
   CHECK(strcmp(status.message, "finshell_evaluate: element 7 (from 0): the input contains NaN or infinity") == 0);
   free_patch(p);
   finshell_section_destroy(s);
}

static void rotations(void)
{
   double q[3][4] = {{2, 0, 0, 0}, {0, 0, 0, 0}, {1, NAN, 0, 0}}, v[3][3], w[2][3] = {{1, 2, INFINITY}, {0, 0, 1}}, m[3][9], kept[4];
   int32_t codes[3];
   CHECK(finshell_rotation_log(3, &q[0][0], &v[0][0], codes, &status) == FINSHELL_INVALID_ARGUMENT && status.index == 1);
   CHECK(codes[0] == 0 && codes[1] == -1 && codes[2] == -3 && v[0][0] == 0 && v[2][1] == 0);
   CHECK(finshell_rotation_matrix(3, &q[0][0], &m[0][0], codes, &status) == -1 && status.failed == 2 && m[0][4] == 1);
   CHECK(finshell_rotation_exp(2, &w[0][0], &q[1][0], codes, &status) == -3 && codes[1] == 0 && fabs(q[2][3] - sin(0.5)) < 1e-15);
   memcpy(kept, q[0], sizeof kept);
   CHECK(finshell_rotation_update(1, &w[0][0], &q[0][0], codes, NULL) == -3 && memcmp(kept, q[0], sizeof kept) == 0);
   CHECK(finshell_rotation_compose(2, &q[0][0], &q[1][0], &m[0][0], codes, NULL) == -1 && codes[0] == -1 && codes[1] == -1);
   CHECK(finshell_rotation_tangent(2, &w[0][0], &m[0][0], codes, &status) == -3 && codes[1] == 0 && status.index == 0);
}

static void information(void)
{
   char text[12], whole[256];
   finshell_parameter parameter;
   CHECK(strcmp(finshell_version_text(), FINSHELL_VERSION) == 0);
   CHECK(finshell_abi() == FINSHELL_ABI);
   for (int32_t code = -7; code <= 6; code++) {
      int32_t length = finshell_message(code, text, sizeof text);
      CHECK(length > 3 && length == finshell_message(code, whole, sizeof whole) && length == finshell_message(code, NULL, 5));
      CHECK(strlen(whole) == (size_t)length);
      CHECK(strlen(text) == (length < 11 ? (size_t)length : 11) && strncmp(text, whole, strlen(text)) == 0);
   }
   text[0] = 'x';
   CHECK(finshell_message(0, text, 0) == 4 && text[0] == 'x');
   CHECK(finshell_message(0, text, 1) == 4 && text[0] == 0);
   REFUSED(finshell_material_name(finshell_material_count(), text, sizeof text, &status), "i is");
   REFUSED(finshell_material_name(-1, text, sizeof text, &status), "i is -1");
   REFUSED(finshell_material_name(0, NULL, 5, &status), "buffer");
   REFUSED(finshell_material_name(0, text, 0, &status), "buffer");
   REFUSED(finshell_material_parameter_count("cheese", &status), "cheese");
   REFUSED(finshell_material_parameter_count(NULL, &status), "unknown");
   REFUSED(finshell_material_parameter(NULL, 0, &parameter, &status), "unknown");
   REFUSED(finshell_material_parameter("gent", 99, &parameter, &status), "i is 99");
   REFUSED(finshell_material_parameter("gent", 0, NULL, &status), "NULL");
   CHECK(finshell_material_count() >= 10);
   for (int32_t i = 0; i < finshell_material_count(); i++) {
      const char *names[32];
      char kept[32][32];
      double values[32];
      finshell_section *s = NULL;
      CHECK(finshell_material_name(i, whole, sizeof whole, &status) == 0 && strlen(whole) > 2);
      int32_t n = finshell_material_parameter_count(whole, &status), given = 0;
      CHECK(n > 0 && n < 32);
      for (int32_t j = 0; j < n; j++) {
         CHECK(finshell_material_parameter(whole, j, &parameter, &status) == 0);
         CHECK(strlen(parameter.name) > 0 && strlen(parameter.meaning) > 3 && (parameter.required == 0 || parameter.required == 1));
         if (!parameter.required && parameter.example == parameter.default_value) continue;
         strcpy(kept[given], parameter.name);
         names[given] = kept[given];
         values[given++] = parameter.example;
      }
      CHECK(finshell_section_create(whole, given, names, values, 0.1, 0, NULL, NULL, &s, &status) == 0);
      if (!s) fprintf(report, "%s\n", status.message);
      finshell_section_destroy(s);
   }
}

int main(void)
{
   silence();
   sections();
   arguments();
   elements();
   which_code();
   rotations();
   information();
   return finish();
}
