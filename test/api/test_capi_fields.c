/* Element fields by name: the list, fields that other functions know bit by bit, places and layers, refusals, failing elements. */
#define _POSIX_C_SOURCE 200809L
#include "check.h"

static finshell_status status;
enum { most = 20 };

/* Number of components times places, of a section of some layers; 0: no such field. */
static int32_t size_of(const char *name, int32_t layers)
{
   finshell_field_entry f;
   for (int32_t i = 0; i < finshell_field_count(); i++) {
      CHECK(finshell_field_information(i, &f, &status) == 0);
      if (!strcmp(f.name, name))
         return f.number * (f.at == FINSHELL_AT_LAYERS ? layers : f.at == FINSHELL_AT_SURFACES ? 3 : 1);
   }
   return 0;
}

/* A sheet (plane triangle) with two families of fibres below a layer without. */
static finshell_section *tissue(void)
{
   const char *fibre[] = {"c", "k1", "k2", "angle"}, *gel[] = {"mu"};
   const double with[] = {200, 300, 0.5, 30}, without[] = {100};
   finshell_section_builder *builder = begin();
   CHECK(finshell_builder_layer(builder, 0.1, 0, 0, 0, NULL) == 0);
   CHECK(finshell_builder_law(builder, "holzapfel_gasser_ogden", 4, fibre, with, NULL) == 0);
   CHECK(finshell_builder_layer(builder, 0.1, 0, 0, 0, NULL) == 0);
   CHECK(finshell_builder_law(builder, "neo_hookean", 1, gel, without, NULL) == 0);
   return built(builder);
}

static void list(void)
{
   finshell_field_entry f;
   int32_t n = finshell_field_count();
   CHECK(n >= 15);
   for (int32_t i = 0; i < n; i++) {
      CHECK(finshell_field_information(i, &f, NULL) == 0);
      CHECK(strlen(f.name) > 0 && strlen(f.meaning) > 0 && strlen(f.dimension) > 0);
      int commas = 0;
      for (const char *c = f.components; *c; c++) commas += *c == ',';
      CHECK(f.number == commas + 1 && f.at >= 1 && f.at <= 3);
   }
   CHECK(finshell_field_information(n, &f, &status) == FINSHELL_INVALID_ARGUMENT && status.index == -1);
   CHECK(finshell_field_information(-1, &f, NULL) == FINSHELL_INVALID_ARGUMENT);
   CHECK(finshell_field_information(0, NULL, &status) == FINSHELL_INVALID_ARGUMENT && strstr(status.message, "NULL"));
   CHECK(size_of("stress", 1) == 9 && size_of("material_stress", 4) == 12 && size_of("thickness_stretch", 1) == 1);
   CHECK(size_of("colour", 1) == 0);
}

/* All conventions and normals: what finshell_elements_recover and finshell_elements_evaluate return. */
static void known_fields(void)
{
   static double stretch[most], force[most][3], moment[most][3], stress[most][3][3], energy[most], found[most][3][3], layers[most][3][3];
   patch p = new_patch(most, 5);
   finshell_section *s = laminate(0.02);
   for (int convention = 1; convention <= 3; convention++)
      for (int curved = 0; curved < 2; curved++) {
         finshell_elements b = block_of(p, convention, curved ? p.normals : NULL);
         int32_t codes[most];
         CHECK(finshell_elements_recover(s, &b, stretch, force[0], moment[0], stress[0][0], NULL, NULL) == 0);
         CHECK(finshell_elements_evaluate(s, &b, energy, NULL, NULL, NULL, NULL) == 0);
         memset(codes, 1, sizeof codes);
         CHECK(finshell_recover_field(s, &b, "thickness_stretch", found[0][0], codes, &status) == 0 && !memcmp(found, stretch, sizeof stretch));
         for (int e = 0; e < most; e++) CHECK(codes[e] == 0);
         CHECK(status.code == 0 && status.index == -1);
         CHECK(finshell_recover_field(s, &b, "membrane_force", found[0][0], NULL, NULL) == 0 && !memcmp(found, force, sizeof force));
         CHECK(finshell_recover_field(s, &b, "moment", found[0][0], NULL, NULL) == 0 && !memcmp(found, moment, sizeof moment));
         CHECK(finshell_recover_field(s, &b, "stress", found[0][0], NULL, NULL) == 0 && !memcmp(found, stress, sizeof stress));
         CHECK(finshell_recover_field(s, &b, "material_stress", layers[0][0], NULL, NULL) == 0 && layers[most - 1][2][0] != 0);
         double densities[most];
         CHECK(finshell_recover_field(s, &b, "energy_density", densities, NULL, NULL) == 0);
         for (int e = 0; e < most && !curved; e++) {
            const double *x = p.X + 9 * e;
            double n[3], area = 0;
            for (int c = 0; c < 3; c++) {
               int i = (c + 1) % 3, j = (c + 2) % 3;
               n[c] = (x[3 + i] - x[i]) * (x[6 + j] - x[j]) - (x[3 + j] - x[j]) * (x[6 + i] - x[i]);
               area += n[c] * n[c] / 4;
            }
            CHECK_CLOSE(densities[e] * sqrt(area) * 0.09, energy[e], 1e-11 * energy[e]);
         }
         /* principal values are those of the tensor, directions of length 1 */
         double principal[most][3][2], direction[most][3][3], other[most][3][3];
         CHECK(finshell_recover_field(s, &b, "principal_stress", principal[0][0], NULL, NULL) == 0);
         CHECK(finshell_recover_field(s, &b, "principal_direction_1", direction[0][0], NULL, NULL) == 0);
         CHECK(finshell_recover_field(s, &b, "principal_direction_2", other[0][0], NULL, NULL) == 0);
         for (int e = 0; e < most; e++)
            for (int h = 0; h < 3; h++) {
               const double *t = stress[e][h], *a = direction[e][h], *c = other[e][h];
               double size = fabs(t[0]) + fabs(t[1]) + fabs(t[2]);
               CHECK(principal[e][h][0] >= principal[e][h][1]);
               CHECK_CLOSE(principal[e][h][0] + principal[e][h][1], t[0] + t[1], 1e-13 * size);
               CHECK_CLOSE(principal[e][h][0] * principal[e][h][1], t[0] * t[1] - t[2] * t[2], 1e-12 * size * size);
               CHECK_CLOSE(a[0] * a[0] + a[1] * a[1] + a[2] * a[2], 1, 1e-14);
               CHECK_CLOSE(a[0] * c[0] + a[1] * c[1] + a[2] * c[2], 0, 1e-14);
            }
      }
   finshell_section_destroy(s);
   free_patch(p);
}

/* Nothing is written beyond the places of the section; a layer without fibres has zeros and no code. */
static void layers_of_fibres(void)
{
   const double X[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, u[9] = {0, 0, 0, 0.2, 0, 0, 0, 0, 0}, t[9] = {0};
   double values[1][2][3], scalar[2];
   finshell_section *s = tissue();
   finshell_elements b = {0};
   int32_t code = 7;
   b.size = sizeof b;
   b.n = 1;
   b.convention = FINSHELL_ROTATION_VECTOR;
   b.X = X;
   b.u = u;
   b.rotations = t;
   double length = sqrt(1.2 * 1.2 * 0.75 + 0.25);
   values[0][1][1] = -3;
   CHECK(finshell_recover_field(s, &b, "fibre_stretch", values[0][0], &code, &status) == 0 && code == 0);
   CHECK_CLOSE(values[0][0][0], length, 1e-14);
   CHECK_CLOSE(values[0][0][1], length, 1e-14);
   CHECK(values[0][0][2] == 0 && values[0][1][0] == 0 && values[0][1][1] == -3); /* [2][2] */
   CHECK(finshell_recover_field(s, &b, "fibre_direction_1", values[0][0], &code, &status) == 0 && code == 0);
   CHECK_CLOSE(values[0][0][0], 1.2 * sqrt(0.75) / length, 1e-14);
   CHECK_CLOSE(values[0][0][1], 0.5 / length, 1e-14);
   CHECK(values[0][0][2] == 0 && values[0][1][0] == 0 && values[0][1][1] == 0 && values[0][1][2] == 0);
   scalar[1] = -3;
   CHECK(finshell_recover_field(s, &b, "thickness_stretch", scalar, NULL, NULL) == 0 && scalar[1] == -3);
   CHECK(finshell_recover_field(s, &b, "thickness_stretch", NULL, &code, NULL) == 0);
   finshell_section_destroy(s);
   /* no layer with fibres */
   s = rubber(0.1);
   CHECK(finshell_recover_field(s, &b, "fibre_stretch", scalar, &code, &status) == 0 && code == 0 && scalar[0] == 0 && scalar[1] == 0);
   finshell_section_destroy(s);
}

static void failures_of_calls(void)
{
   patch p = new_patch(3, 9);
   finshell_section *s = rubber(0.1);
   finshell_elements b = block_of(p, FINSHELL_ROTATION_VECTOR, NULL);
   double v[3][3][3], before;
   int32_t codes[3];
   before = v[0][0][0] = 17;
   CHECK(finshell_recover_field(s, &b, "strains", v[0][0], codes, &status) == FINSHELL_INVALID_ARGUMENT && status.index == -1);
   CHECK(strstr(status.message, "finshell_recover_field: unknown field 'strains'") && v[0][0][0] == before);
   CHECK(finshell_recover_field(s, &b, "", v[0][0], codes, NULL) == FINSHELL_INVALID_ARGUMENT);
   CHECK(finshell_recover_field(s, &b, NULL, v[0][0], codes, &status) == FINSHELL_INVALID_ARGUMENT && strstr(status.message, "name is NULL"));
   CHECK(finshell_recover_field(NULL, &b, "strain", v[0][0], codes, &status) == FINSHELL_INVALID_ARGUMENT && strstr(status.message, "section"));
   CHECK(finshell_recover_field(s, NULL, "strain", v[0][0], codes, &status) == FINSHELL_INVALID_ARGUMENT);
   b.n = -1;
   CHECK(finshell_recover_field(s, &b, "strain", v[0][0], codes, &status) == FINSHELL_INVALID_ARGUMENT);
   b.n = 0;
   CHECK(finshell_recover_field(s, &b, "strain", v[0][0], codes, &status) == 0 && v[0][0][0] == before);
   b.n = 3;
   /* one element of three fails; the others are done */
   double good[3][3][3];
   CHECK(finshell_recover_field(s, &b, "strain", good[0][0], codes, &status) == 0);
   p.u[9] = NAN;
   CHECK(finshell_recover_field(s, &b, "strain", v[0][0], codes, &status) == FINSHELL_NOT_A_NUMBER);
   CHECK(status.index == 1 && status.failed == 1 && codes[0] == 0 && codes[1] == FINSHELL_NOT_A_NUMBER && codes[2] == 0);
   CHECK(!memcmp(v[0], good[0], sizeof v[0]) && !memcmp(v[2], good[2], sizeof v[2]));
   for (int h = 0; h < 3; h++)
      for (int i = 0; i < 3; i++) CHECK(v[1][h][i] == 0);
   finshell_section_destroy(s);
   free_patch(p);
}

/* A law that ends at the surfaces only: code 2 and zeros for what looks there. */
static void end_of_a_law(void)
{
   const char *names[] = {"mu", "jm"}, *options[] = {"thickness_points"};
   const double values[] = {200, 0.6}, one = 1;
   const double X[9] = {0, 0, 0, 0.5, 0, 0, 0, 0.5, 0}, u[9] = {0}, t[9] = {0, 0, 0, 0, -0.4, 0, 0, 0, 0};
   double v[9];
   int32_t code;
   finshell_section *s = NULL;
   finshell_elements b = {0};
   CHECK(finshell_section_create("gent", 2, names, values, 1, 1, options, &one, &s, NULL) == 0);
   b.size = sizeof b;
   b.n = 1;
   b.convention = FINSHELL_ROTATION_VECTOR;
   b.X = X;
   b.u = u;
   b.rotations = t;
   CHECK(finshell_recover_field(s, &b, "strain", v, &code, &status) == 0 && code == 0 && v[0] != 0);
   CHECK(finshell_recover_field(s, &b, "principal_stress", v, &code, &status) == FINSHELL_MATERIAL_LIMIT && code == FINSHELL_MATERIAL_LIMIT);
   for (int i = 0; i < 6; i++) CHECK(v[i] == 0);
   CHECK(finshell_recover_field(s, &b, "material_stress", v, &code, &status) == 0);
   finshell_section_destroy(s);
}

int main(void)
{
   silence();
   list();
   known_fields();
   layers_of_fibres();
   failures_of_calls();
   end_of_a_law();
   return finish();
}
