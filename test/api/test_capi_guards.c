/* Messages, laws, elements, fields and rotations of finshell.h under guards (guards.h). Sections: test_section_guards.c;
 * assemblies: test_assembly_guards.c. */
#define _GNU_SOURCE
#include "guards.h"

enum { n = 17, points = 3 * n }; /* elements are computed by eights: three times, for threads */

struct world {
   patch p;
   finshell_section *shell, *sheet;
   int32_t threads;
};

static finshell_elements block(const world *w)
{
   finshell_elements b = with_own(block_of(w->p, FINSHELL_ROTATION_VECTOR, w->p.normals), w->p);
   b.threads = w->threads;
   return b;
}

/* ------------------------------------------------------------------ version, messages, laws */

static void version_text(const world *w, results *r)
{
   (void)w;
   keep_text(r, finshell_version_text());
}

static void version_number(const world *w, results *r)
{
   int32_t value = finshell_version_number();
   (void)w;
   KEEP(value);
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

static void elements_mass(const world *w, results *r)
{
   double consistent[n][18][18], lumped[n][18], wrong[n] = {0};
   int32_t codes[n];
   finshell_elements b = block(w);
   finshell_status status;
   keep_status(r, finshell_elements_mass(w->shell, &b, &consistent[0][0][0], &lumped[0][0], codes, &status), &status);
   KEEP(consistent);
   KEEP(lumped);
   b.thickness = wrong;
   keep_status(r, finshell_elements_mass(w->shell, &b, NULL, &lumped[0][0], codes, &status), &status);
   KEEP(codes);
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

static const entry all[] = {
   ENTRY(version_text), ENTRY(version_number), ENTRY(abi), ENTRY(cpu_level), ENTRY(message),
   ENTRY(material_count), ENTRY(material_name), ENTRY(material_parameter_count), ENTRY(material_parameter),
   ENTRY(elements_evaluate), ENTRY(elements_recover), ENTRY(elements_wrinkles), ENTRY(elements_pressure), ENTRY(elements_mass),
   ENTRY(evaluate), ENTRY(recover), ENTRY(mass_matrix), ENTRY(pressure_load),
   ENTRY(field_count), ENTRY(field_information), ENTRY(recover_field),
   ENTRY(rotation_exp), ENTRY(rotation_log), ENTRY(rotation_compose), ENTRY(rotation_update), ENTRY(rotation_matrix),
   ENTRY(rotation_tangent),
};

int main(int argc, char **argv)
{
   const char *names[] = {"mu"}, *options[] = {"membrane", "wrinkling"};
   const double mu[] = {2}, chosen[] = {1, 1};
   world w = {0}, several;
   silence();
   w.p = new_patch(n, 5);
   w.threads = 1;
   w.shell = rubber(0.1);
   CHECK(finshell_section_create("neo_hookean", 1, names, mu, 0.1, 2, options, chosen, &w.sheet, NULL) == 0);
   several = w;
   several.threads = 4;
   guard(all, sizeof all / sizeof *all, &w, &several, argc, argv);
   finshell_section_destroy(w.shell);
   finshell_section_destroy(w.sheet);
   free_patch(w.p);
   return finish();
}
