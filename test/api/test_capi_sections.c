/* What a section says of itself: numbers, layers, parameters; its stiffness at rest against the theory of laminates, against the
 * tangent of elements and against differences of their energy. */
#define _POSIX_C_SOURCE 200809L
#include "check.h"

static finshell_status status;

static void refused(int32_t code, const char *word, int line)
{
   check(code == FINSHELL_INVALID_ARGUMENT && status.code == code && status.index == -1 && status.failed == 0, word, line);
   if (!strstr(status.message, word)) check(0, status.message, line);
   memset(&status, 0x55, sizeof status);
}
#define REFUSED(call, word) refused((call), (word), __LINE__)

static finshell_properties properties_of(const finshell_section *s)
{
   finshell_properties p;
   memset(&p, 0xff, sizeof p);
   p.size = sizeof p;
   CHECK(finshell_section_properties(s, &p, &status) == 0 && status.code == 0 && p.size == sizeof p);
   return p;
}

static void shells(void)
{
   finshell_section *s = laminate(0.01); /* 0.02, 0.03, 0.04 of density 1, 2, 3 at 30, 90, 150 degrees */
   finshell_properties p = properties_of(s);
   CHECK(p.layers == 3 && p.freedoms == 18 && p.formulation == 1 && !p.isotropic && !p.membrane && !p.wrinkling);
   CHECK_CLOSE(p.thickness, 0.09, 1e-16);
   CHECK(p.offset == 0.01);
   double bottom = 0.01 - 0.045, mass[3] = {0};
   for (int i = 0; i < 3; i++) {
      finshell_layer l;
      memset(&l, 0xff, sizeof l);
      l.size = sizeof l;
      CHECK(finshell_section_layer(s, i, &l, &status) == 0 && l.size == sizeof l);
      CHECK(strcmp(l.law, "orthotropic") == 0 && l.points == 2 && l.angle == 30 + 60 * i && l.density == 1 + i);
      CHECK(l.thickness == 0.02 + 0.01 * i);
      double top = bottom + l.thickness;
      CHECK_CLOSE(l.height, 0.5 * (bottom + top), 1e-16);
      for (int k = 0; k < 3; k++) mass[k] += l.density * (pow(top, k + 1) - pow(bottom, k + 1)) / (k + 1);
      bottom = top;
      static const char *names[] = {"e1", "e2", "nu12", "g12"};
      static const double values[] = {3300, 1100, 0.25, 660};
      int given = 0;
      for (int j = 0; j < l.parameters; j++) {
         char name[32];
         double value;
         CHECK(finshell_section_parameter(s, i, j, name, sizeof name, &value, &status) == 0);
         for (int k = 0; k < 4; k++)
            if (strcmp(name, names[k]) == 0) given += value == values[k];
      }
      CHECK(given == 4);
   }
   CHECK_CLOSE(p.areal_mass, mass[0], 1e-15);
   CHECK_CLOSE(p.first_moment, mass[1], 1e-17);
   CHECK_CLOSE(p.rotatory_inertia, mass[2], 1e-17);
   finshell_section_destroy(s);
}

/* Defaults of parameters and points; names in small letters; what the options say. */
static void defaults(void)
{
   const char *names[] = {"C", "K1", "k2", "angle"}, *options[] = {"formulation", "density"};
   const double values[] = {100, 200, 0.5, 40}, chosen[] = {2, 7};
   finshell_section *s = NULL;
   CHECK(finshell_section_create("Holzapfel_Gasser_Ogden", 4, names, values, 0.1, 2, options, chosen, &s, &status) == 0);
   finshell_properties p = properties_of(s);
   CHECK(p.layers == 1 && p.formulation == 2 && !p.isotropic && p.offset == 0 && p.thickness == 0.1);
   CHECK_CLOSE(p.areal_mass, 0.7, 1e-15);
   finshell_layer l = {0};
   l.size = sizeof l;
   CHECK(finshell_section_layer(s, 0, &l, NULL) == 0 && strcmp(l.law, "holzapfel_gasser_ogden") == 0 && l.points == 5 && l.density == 7);
   CHECK(l.parameters == finshell_material_parameter_count("holzapfel_gasser_ogden", NULL) && l.parameters > 4);
   for (int i = 0; i < l.parameters; i++) {
      char name[32], shorter[3];
      double value;
      finshell_parameter known;
      CHECK(finshell_material_parameter("holzapfel_gasser_ogden", i, &known, NULL) == 0);
      CHECK(finshell_section_parameter(s, 0, i, name, sizeof name, &value, NULL) == 0 && strcmp(name, known.name) == 0);
      CHECK(value == (strcmp(name, "c") == 0 ? 100 : strcmp(name, "k1") == 0 ? 200 : strcmp(name, "k2") == 0 ? 0.5 : strcmp(name, "angle") == 0 ? 40 : known.default_value));
      CHECK(finshell_section_parameter(s, 0, i, shorter, sizeof shorter, NULL, NULL) == 0 && strncmp(shorter, name, 2) == 0 && strlen(shorter) <= 2);
      CHECK(finshell_section_parameter(s, 0, i, NULL, 0, &value, NULL) == 0);
   }
   finshell_section_destroy(s);

   const char *mu[] = {"mu"}, *of_sheet[] = {"membrane", "wrinkling"};
   const double two = 2, ones[] = {1, 1};
   CHECK(finshell_section_create("neo_hookean", 1, mu, &two, 0.1, 2, of_sheet, ones, &s, &status) == 0);
   p = properties_of(s);
   CHECK(p.freedoms == 9 && p.membrane == 1 && p.wrinkling == 1 && p.isotropic == 1);
   CHECK(finshell_section_layer(s, 0, &l, NULL) == 0 && l.points == 0);
   finshell_section_destroy(s);
}

static void refusals(void)
{
   finshell_section *s = rubber(0.1);
   struct { finshell_properties known; double later[3]; } wide;
   finshell_properties p = {0};
   finshell_layer l = {0};
   double k[36], value = 7;
   char name[8] = "7";
   REFUSED(finshell_section_properties(NULL, &p, &status), "finshell_section_properties: section is NULL");
   REFUSED(finshell_section_properties(s, NULL, &status), "properties is NULL");
   REFUSED(finshell_section_properties(s, &p, &status), "properties->size is 0");
   p.size = sizeof p - 8;
   REFUSED(finshell_section_properties(s, &p, &status), "properties->size is 64");
   p.size = sizeof p + 4;
   REFUSED(finshell_section_properties(s, &p, &status), "properties->size is 76");
   p.size = UINT64_MAX;
   REFUSED(finshell_section_properties(s, &p, &status), "properties->size is not set");
   CHECK(p.thickness == 0);
   memset(&wide, 0x55, sizeof wide); /* of a later header */
   wide.known.size = sizeof wide;
   CHECK(finshell_section_properties(s, &wide.known, &status) == 0 && wide.known.thickness == 0.1 && wide.known.size == sizeof wide);
   CHECK(wide.later[0] == 0 && wide.later[1] == 0 && wide.later[2] == 0);
   l.size = sizeof l;
   REFUSED(finshell_section_layer(NULL, 0, &l, &status), "section is NULL");
   REFUSED(finshell_section_layer(s, 1, &l, &status), "layer is 1, expected 0 to one less");
   REFUSED(finshell_section_layer(s, -1, &l, &status), "layer is -1");
   REFUSED(finshell_section_layer(s, 0, NULL, &status), "layer is NULL");
   l.size = 8;
   REFUSED(finshell_section_layer(s, 0, &l, &status), "layer->size is 8");
   REFUSED(finshell_section_parameter(NULL, 0, 0, name, 8, &value, &status), "section is NULL");
   REFUSED(finshell_section_parameter(s, 2, 0, name, 8, &value, &status), "layer is 2");
   REFUSED(finshell_section_parameter(s, 0, 2, name, 8, &value, &status), "i is 2, expected 0 to one less than the number of parameters");
   REFUSED(finshell_section_parameter(s, 0, -1, name, 8, &value, &status), "i is -1");
   REFUSED(finshell_section_parameter(s, 0, 0, name, 0, &value, &status), "size is 0, and name has room for nothing");
   CHECK(value == 7 && strcmp(name, "7") == 0);
   REFUSED(finshell_section_stiffness(NULL, k, &status), "section is NULL");
   REFUSED(finshell_section_stiffness((finshell_section *)&p, k, &status), "section is no handle");
   REFUSED(finshell_section_stiffness(s, NULL, &status), "stiffness is NULL");
   finshell_section_destroy(s);

   /* numbers that overflow */
   const char *mu[] = {"mu"}, *density[] = {"density"};
   const double one = 1;
   CHECK(finshell_section_create("neo_hookean", 1, mu, &one, 1e150, 1, density, &one, &s, &status) == 0);
   p.size = sizeof p;
   CHECK(finshell_section_properties(s, &p, &status) == FINSHELL_MATERIAL_LIMIT && status.code == 2 && status.index == -1);
   CHECK(strstr(status.message, "finshell_section_properties: ") != NULL && p.thickness == 0);
   k[7] = 7;
   CHECK(finshell_section_stiffness(s, k, &status) == FINSHELL_MATERIAL_LIMIT && k[7] == 0);
   finshell_section_destroy(s);
}

/* Bars of a plane stress law, turned, in layers: Q-bar of the theory of laminates (Jones, Mechanics of Composite Materials), whose
 * K12 is half of the third curvature. */
static void theory(void)
{
   const double e1 = 3300, e2 = 1100, nu12 = 0.25, g = 660, nu21 = nu12 * e2 / e1;
   const double q11 = e1 / (1 - nu12 * nu21), q22 = e2 / (1 - nu12 * nu21), q12 = nu12 * q22;
   double expected[6][6] = {{0}}, k[6][6], bottom = 0.017 - 0.045;
   for (int l = 0; l < 3; l++) {
      double a = (30 + 60 * l) * acos(-1.0) / 180, c = cos(a), s = sin(a), top = bottom + 0.02 + 0.01 * l, q[3][3];
      q[0][0] = q11 * c * c * c * c + 2 * (q12 + 2 * g) * s * s * c * c + q22 * s * s * s * s;
      q[1][1] = q11 * s * s * s * s + 2 * (q12 + 2 * g) * s * s * c * c + q22 * c * c * c * c;
      q[0][1] = q[1][0] = (q11 + q22 - 4 * g) * s * s * c * c + q12 * (s * s * s * s + c * c * c * c);
      q[2][2] = (q11 + q22 - 2 * q12 - 2 * g) * s * s * c * c + g * (s * s * s * s + c * c * c * c);
      q[0][2] = q[2][0] = (q11 - q12 - 2 * g) * s * c * c * c + (q12 - q22 + 2 * g) * s * s * s * c;
      q[1][2] = q[2][1] = (q11 - q12 - 2 * g) * s * s * s * c + (q12 - q22 + 2 * g) * s * c * c * c;
      for (int i = 0; i < 6; i++)
         for (int j = 0; j < 6; j++) {
            int power = 1 + i / 3 + j / 3;
            expected[i][j] += q[i % 3][j % 3] * (pow(top, power) - pow(bottom, power)) / power;
         }
      bottom = top;
   }
   finshell_section *section = laminate(0.017);
   CHECK(finshell_section_stiffness(section, k[0], &status) == 0 && status.code == 0);
   for (int i = 0; i < 6; i++)
      for (int j = 0; j < 6; j++) {
         CHECK_CLOSE(k[i][j], expected[i][j], 1e-13 * 3300 * pow(0.09, 1 + i / 3 + j / 3));
         CHECK(k[i][j] == k[j][i]);
      }
   finshell_section_destroy(section);

   /* incompressible, of small-strain shear modulus mu: E = 3 mu, nu = 1/2 */
   section = rubber(0.2);
   const double plate = 600 * 0.2 / 0.75, bend = plate * 0.04 / 12;
   CHECK(finshell_section_stiffness(section, k[0], &status) == 0);
   CHECK_CLOSE(k[0][0], plate, 1e-12 * plate);
   CHECK_CLOSE(k[0][1], 0.5 * plate, 1e-12 * plate);
   CHECK_CLOSE(k[2][2], 200 * 0.2, 1e-12 * plate);
   CHECK_CLOSE(k[3][3], bend, 1e-12 * bend);
   CHECK_CLOSE(k[5][5], 0.25 * bend, 1e-12 * bend);
   CHECK_CLOSE(k[0][3], 0, 1e-15 * plate);
   finshell_section_destroy(section);
}

/* Displacements and rotations of the nodes of a flat element at strain or curvature c = 0 ... 5 of size a: w is quadratic. */
static void mode(int c, double a, const double X[9], double u[9], double t[9])
{
   static const double e[6][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 0.5}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0.5}};
   for (int i = 0; i < 3; i++) {
      const double x = X[3 * i], y = X[3 * i + 1], p = a * (e[c][0] * x + e[c][2] * y), q = a * (e[c][2] * x + e[c][1] * y);
      if (c < 3) {
         u[3 * i] += p;
         u[3 * i + 1] += q;
      } else {
         u[3 * i + 2] -= 0.5 * (p * x + q * y);
         t[3 * i] -= q;
         t[3 * i + 1] += p;
      }
   }
}

static double energy_of(const finshell_section *s, const double X[9], const double u[9], const double t[9])
{
   double w = NAN;
   CHECK(finshell_evaluate(s, 1, X, u, t, FINSHELL_ROTATION_VECTOR, NULL, NULL, &w, NULL, NULL, NULL, 1, NULL) == 0);
   return w;
}

/* Elements in states of constant strain and curvature store what the matrix says. */
static void elements(const finshell_section *s)
{
   const double X[9] = {0.1, -0.2, 0, 1.3, 0.1, 0, 0.3, 0.9, 0}, area = 0.5 * (1.2 * 1.1 - 0.3 * 0.2);
   const int freedoms = finshell_section_freedoms(s, NULL), modes = freedoms == 18 ? 6 : 3;
   double k[6][6], tangent[18 * 18], zero[9] = {0}, v[6][18] = {{0}}, h = 1e-4;
   CHECK(finshell_section_stiffness(s, k[0], NULL) == 0);
   CHECK(finshell_evaluate(s, 1, X, zero, zero, FINSHELL_ROTATION_VECTOR, NULL, NULL, NULL, NULL, tangent, NULL, 1, NULL) == 0);
   for (int c = 0; c < modes; c++) {
      double u[9] = {0}, t[9] = {0};
      mode(c, 1, X, u, t);
      for (int i = 0; i < 9; i++) {
         if (freedoms == 9) v[c][i] = u[i];
         else v[c][6 * (i / 3) + i % 3] = u[i], v[c][6 * (i / 3) + 3 + i % 3] = t[i];
      }
   }
   for (int a = 0; a < 6; a++)
      for (int b = 0; b < 6; b++) {
         const double scale = sqrt(k[a][a] * k[b][b]);
         if (a >= modes || b >= modes) {
            CHECK(k[a][b] == 0);
            continue;
         }
         double sum = 0, difference = 0;
         for (int i = 0; i < freedoms; i++)
            for (int j = 0; j < freedoms; j++) sum += v[a][i] * tangent[freedoms * i + j] * v[b][j];
         CHECK_CLOSE(sum, area * k[a][b], 1e-11 * area * scale);
         for (int i = 0; i < 4; i++) { /* d2W / da db */
            double u[9] = {0}, t[9] = {0};
            mode(a, i & 1 ? h : -h, X, u, t);
            mode(b, i & 2 ? h : -h, X, u, t);
            difference += (i == 0 || i == 3 ? 1 : -1) * energy_of(s, X, u, t) / (4 * h * h);
         }
         CHECK_CLOSE(difference, area * k[a][b], 2e-5 * area * scale);
      }
}

static void sheet(const char *law, int32_t n, const char *const *names, const double *values, int wrinkling)
{
   const char *options[] = {"membrane", "wrinkling"};
   const double ones[] = {1, 1};
   double k[6][6], natural[6][6];
   finshell_section *s = NULL;
   CHECK(finshell_section_create(law, n, names, values, 0.1, 1 + wrinkling, options, ones, &s, &status) == 0);
   if (!wrinkling) {
      elements(s);
   } else { /* as without */
      finshell_section *taut = NULL;
      CHECK(finshell_section_create(law, n, names, values, 0.1, 1, options, ones, &taut, &status) == 0);
      CHECK(finshell_section_stiffness(taut, natural[0], NULL) == 0 && finshell_section_stiffness(s, k[0], NULL) == 0);
      CHECK(memcmp(k, natural, sizeof k) == 0);
      finshell_section_destroy(taut);
   }
   finshell_section_destroy(s);
}

static void against_elements(void)
{
   const char *e_nu[] = {"e", "nu"}, *orthotropic[] = {"e1", "e2", "nu12", "g12"};
   const double steel[] = {210, 0.3}, wood[] = {33, 11, 0.25, 6.6}, mu = 2;
   finshell_section *s = rubber(0.1);
   elements(s);
   finshell_section_destroy(s);
   s = laminate(0.02);
   elements(s);
   finshell_section_destroy(s);
   finshell_section_builder *b = begin(); /* a stiff layer of one point below a soft one */
   CHECK(finshell_builder_layer(b, 0.05, 0, 1, 0, NULL) == 0 && finshell_builder_law(b, "linear_elastic", 2, e_nu, steel, NULL) == 0);
   CHECK(finshell_builder_layer(b, 0.2, 0, 0, 0, NULL) == 0 && finshell_builder_law(b, "neo_hookean", 1, (const char *[]){"mu"}, &mu, NULL) == 0);
   s = built(b);
   elements(s);
   finshell_section_destroy(s);
   for (int wrinkling = 0; wrinkling < 2; wrinkling++) {
      sheet("orthotropic", 4, orthotropic, wood, wrinkling);
      sheet("neo_hookean", 1, (const char *[]){"mu"}, &mu, wrinkling);
   }
}

/* Fibres are slack at rest: the matrix is that of what is between them. */
static void fibres(void)
{
   const char *names[] = {"c", "k1", "k2", "angle"};
   const double values[] = {100, 200, 0.5, 40}, mu = 100;
   double with[36], without[36];
   finshell_section *s = NULL, *gel = NULL;
   CHECK(finshell_section_create("holzapfel_gasser_ogden", 4, names, values, 0.1, 0, NULL, NULL, &s, NULL) == 0);
   CHECK(finshell_section_create("neo_hookean", 1, (const char *[]){"mu"}, &mu, 0.1, 0, NULL, NULL, &gel, NULL) == 0);
   CHECK(finshell_section_stiffness(s, with, NULL) == 0 && finshell_section_stiffness(gel, without, NULL) == 0);
   for (int i = 0; i < 36; i++) CHECK_CLOSE(with[i], without[i], 1e-12 * without[0]);
   finshell_section_destroy(s);
   finshell_section_destroy(gel);
}

int main(void)
{
   silence();
   shells();
   defaults();
   refusals();
   theory();
   against_elements();
   fibres();
   return finish();
}
