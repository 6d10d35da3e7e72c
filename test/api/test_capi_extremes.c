/* Units, numberings, lengths that do not matter: the same answer, or the same code, everywhere. */
#define _POSIX_C_SOURCE 200809L
#include "check.h"

static finshell_section *rubber_of(const char *law, double modulus, double thickness)
{
   const char *mooney[] = {"c10", "c01"}, *young[] = {"e", "nu"};
   const double two[] = {0.8 * modulus, 0.2 * modulus}, e[] = {modulus, 0.3};
   finshell_section *s = NULL;
   int compressible = strcmp(law, "mooney_rivlin") != 0;
   CHECK(finshell_section_create(law, 2, compressible ? young : mooney, compressible ? e : two, thickness, 0, NULL, NULL, &s, NULL) == 0);
   return s;
}

static int finite(const double *a, int n)
{
   double total = 0;
   for (int i = 0; i < n; i++) total += 0 * a[i];
   return total == 0;
}

/* Units of length and of stress: the code, and the largest relative error of the results brought back. */
static int32_t in_units(const char *law, double length, double modulus, double *error)
{
   patch p = new_patch(1, 11);
   double f[2][18], k[2][324], e[2], largest = 0, stiffest = 0;
   int32_t code = 0;
   *error = 0;
   for (int run = 0; run < 2; run++) {
      finshell_section *s = rubber_of(law, run ? modulus : 1, run ? 0.05 * length : 0.05);
      for (int i = 0; run && i < 9; i++) p.X[i] *= length, p.u[i] *= length;
      code = finshell_evaluate(s, 1, p.X, p.u, p.vector, 1, NULL, NULL, &e[run], f[run], k[run], NULL, 1, NULL);
      CHECK(finite(&e[run], 1) && finite(f[run], 18) && finite(k[run], 324));
      finshell_section_destroy(s);
   }
   free_patch(p);
   if (code) return code;
   for (int i = 0; i < 18; i++) largest = fmax(largest, fabs(f[0][i]));
   for (int i = 0; i < 324; i++) stiffest = fmax(stiffest, fabs(k[0][i]));
   for (int i = 0; i < 18; i++) {
      double force = f[1][i] / modulus / length / length;
      if (i % 6 > 2) force /= length;
      *error = fmax(*error, fabs(force - f[0][i]) / largest);
      for (int j = 0; j < 18; j++) {
         double stiffness = k[1][18 * i + j] / modulus / length;
         if (i % 6 > 2) stiffness /= length;
         if (j % 6 > 2) stiffness /= length;
         *error = fmax(*error, fabs(stiffness - k[0][18 * i + j]) / stiffest);
      }
   }
   return code;
}

static void units(void)
{
   const char *laws[] = {"mooney_rivlin", "compressible_neo_hookean", "st_venant_kirchhoff"};
   double error;
   for (int l = 0; l < 3; l++) {
      for (int power = -300; power <= 300; power += 4) {
         int32_t code = in_units(laws[l], pow(10, power), 1, &error);
         if (abs(power) != 60) CHECK(code == (abs(power) < 60 ? 0 : FINSHELL_DEGENERATE_REFERENCE));
         CHECK(error < 1e-12);
         code = in_units(laws[l], 1, pow(10, power), &error);
         CHECK(code == 0 && error < 1e-12);
         code = in_units(laws[l], pow(10, 50), pow(10, power), &error);
         CHECK(code == FINSHELL_MATERIAL_LIMIT || (code == 0 && error < 1e-8));
         CHECK(code == 0 || power > 50); /* times lengths to the fifth on the way */
      }
   }
}

/* A needle, node 3 at a distance `width` from node 2 across or along the side: the code is that of every numbering. */
static void numberings(void)
{
   finshell_section *s = rubber_of("mooney_rivlin", 100, 0.01);
   for (double width = 1e-4; width > 1e-20; width /= 3) {
      for (int cap = 0; cap < 3; cap++) {
         int32_t first = 99, expected = width < 0.5e-10 ? FINSHELL_DEGENERATE_REFERENCE : 0;
         double corner[3][2] = {{0, 0}, {1, 0}, {1, width}};
         if (cap == 1) corner[2][0] = 0.4;
         if (cap == 2) corner[2][0] = 1 + width;
         for (int shift = 0; shift < 3; shift++) {
            double X[9], u[9], t[9] = {0}, m[324], zero = 0;
            for (int i = 0; i < 3; i++) {
               const double *c = corner[(i + shift) % 3];
               X[3 * i] = 0.6 * c[0] - 0.8 * c[1];
               X[3 * i + 1] = 0.8 * c[0] + 0.6 * c[1];
               X[3 * i + 2] = 0;
               for (int j = 0; j < 3; j++) u[3 * i + j] = 0.1 * X[3 * i + j];
            }
            int32_t code = finshell_evaluate(s, 1, X, u, t, 1, NULL, NULL, &zero, NULL, NULL, NULL, 1, NULL);
            if (first == 99) first = code;
            CHECK(code == first && finshell_mass_matrix(s, 1, X, m, NULL, NULL, NULL) == code);
            if (width > 3e-10 || width < 0.3e-10) CHECK(code == expected);
         }
      }
   }
   finshell_section_destroy(s);
}

/* Node 3 pressed onto the opposite side: evaluated to 8 digits or refused, and never evaluated again once it was refused. */
static void flattened(void)
{
   const char *laws[] = {"mooney_rivlin", "compressible_neo_hookean", "st_venant_kirchhoff"};
   for (int l = 0; l < 3; l++) {
      finshell_section *s = rubber_of(laws[l], 100, 0.001);
      int refused = 0;
      for (double height = 1; height > 1e-18; height /= 2) {
         double X[9] = {0.1, 0.2, 0.3, 1.1, 0.5, 0.2, 0.5, 1.2, 0.4}, u[9] = {0}, t[9] = {0}, e, f[18], a[2];
         /* in terms of the foot of the height */
         double side[3], up[3], along = 0, length2 = 0;
         for (int c = 0; c < 3; c++) side[c] = X[3 + c] - X[c], length2 += side[c] * side[c];
         for (int c = 0; c < 3; c++) along += (X[6 + c] - X[c]) * side[c] / length2;
         for (int c = 0; c < 3; c++) up[c] = X[6 + c] - X[c] - along * side[c];
         for (int c = 0; c < 3; c++) u[6 + c] = (height - 1) * up[c];
         int32_t code = finshell_evaluate(s, 1, X, u, t, 1, NULL, NULL, &e, f, NULL, NULL, 1, NULL);
         CHECK(code >= 0 && finite(f, 18));
         if (refused) CHECK(code > 0);
         if (code > 0) refused = 1;
         if (height > 0.01 && l != 2) CHECK(code == 0);
         if (height < 1e-9) CHECK(code > 0);
         /* the force on the node points along the height */
         a[0] = f[12] * side[0] + f[13] * side[1] + f[14] * side[2];
         a[1] = f[12] * up[0] + f[13] * up[1] + f[14] * up[2];
         if (code == 0 && height < 0.9 && l != 2) CHECK(a[1] < 0);
      }
      CHECK(refused);
      finshell_section_destroy(s);
   }
}

/* Lengths that do not matter: quaternions, states, directions. */
static void lengths(void)
{
   static const double factor[] = {1e-320, 1e-300, 1e-200, 1e-160, 1e-61, 1e-59, 3, 1e59, 1e61, 1e160, 1e200, 1e300, 1e307};
   finshell_section *s = laminate(0.01);
   patch p = new_patch(9, 21), r = new_patch(9, 21);
   double e[9], f[2][18 * 9], m[2][9], q[2][4], v[3];
   for (int i = 0; i < 13; i++) {
      double tolerance = factor[i] < 1e-310 ? 1e-2 : 1e-12; /* a denormal number has few digits */
      for (int convention = 2; convention <= 3; convention++) {
         for (int j = 0; j < 12; j++) r.quaternion[j] = factor[i] * p.quaternion[j];
         for (int j = 0; j < 3; j++) r.direction[j] = factor[i] * p.direction[j];
         CHECK(finshell_evaluate(s, 9, p.X, p.u, convention == 2 ? p.quaternion : p.vector, convention, p.quaternion, p.direction, e, f[0],
                                 NULL, NULL, 1, NULL) == 0);
         CHECK(finshell_evaluate(s, 9, p.X, p.u, convention == 2 ? r.quaternion : p.vector, convention, r.quaternion, r.direction, e, f[1],
                                 NULL, NULL, 1, NULL) == 0);
         for (int j = 0; j < 18; j++) CHECK(fabs(f[1][j] - f[0][j]) < tolerance * (fabs(f[0][j]) + 10));
         CHECK(memcmp(f[0] + 18, f[1] + 18, sizeof(double) * 18 * 8) == 0);
      }
      for (int run = 0; run < 2; run++) {
         double *a = run ? r.quaternion : p.quaternion;
         CHECK(finshell_rotation_matrix(1, a, m[run], NULL, NULL) == 0);
         CHECK(finshell_rotation_compose(1, a, a + 4, q[run], NULL, NULL) == 0);
         CHECK(fabs(q[run][0] * q[run][0] + q[run][1] * q[run][1] + q[run][2] * q[run][2] + q[run][3] * q[run][3] - 1) < 1e-14);
      }
      for (int j = 0; j < 9; j++) CHECK(fabs(m[1][j] - m[0][j]) < tolerance);
      for (int j = 0; j < 4; j++) CHECK(fabs(q[1][j] - q[0][j]) < tolerance);
      CHECK(finshell_rotation_log(1, r.quaternion, v, NULL, NULL) == 0 && finite(v, 3));
      /* vectors */
      for (int j = 0; j < 3; j++) v[j] = factor[i] * (j + 1);
      int32_t expected = factor[i] < 1e60 ? 0 : FINSHELL_INVALID_ARGUMENT;
      CHECK(finshell_rotation_exp(1, v, q[0], NULL, NULL) == expected && finite(q[0], 4));
      CHECK(finshell_rotation_tangent(1, v, m[0], NULL, NULL) == expected && finite(m[0], 9));
      for (int j = 0; j < 3; j++) p.vector[j] = v[j];
      int32_t code = finshell_evaluate(s, 1, p.X, p.u, p.vector, 1, NULL, NULL, e, f[0], NULL, NULL, 1, NULL);
      CHECK(factor[i] < 1e60 || code == FINSHELL_LARGE_ROTATION);
      memcpy(p.vector, r.vector, sizeof(double) * 9);
   }
   free_patch(p);
   free_patch(r);
   finshell_section_destroy(s);
}

/* The result in the place of an operand. */
static void in_place(void)
{
   double a[2][4] = {{0.5, 0.5, -0.5, 0.5}, {0.8, 0, 0.6, 0}}, b[2][4] = {{0.6, 0.8, 0, 0}, {1, 2, 3, 4}}, c[2][4], d[2][4];
   CHECK(finshell_rotation_compose(2, a[0], b[0], c[0], NULL, NULL) == 0);
   memcpy(d, a, sizeof d);
   CHECK(finshell_rotation_compose(2, d[0], b[0], d[0], NULL, NULL) == 0 && memcmp(c, d, sizeof d) == 0);
   memcpy(d, b, sizeof d);
   CHECK(finshell_rotation_compose(2, a[0], d[0], d[0], NULL, NULL) == 0 && memcmp(c, d, sizeof d) == 0);
}

/* Loads and masses that overflow. */
static void overflow(void)
{
   const char *option[] = {"density"}, *names[] = {"mu"};
   const double values[] = {1};
   for (int power = 0; power <= 300; power += 20) {
      double X[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, u[9] = {0}, size = pow(10, power), f[9], k[81], m[324], l[18], density = 1e200;
      finshell_section *s = NULL;
      for (int i = 0; i < 9; i++) X[i] *= size;
      int32_t code = finshell_pressure_load(1, &size, X, u, power % 40 == 0, NULL, f, k, NULL, NULL);
      CHECK(code == (power <= 100 ? 0 : FINSHELL_COLLAPSED_ELEMENT) && finite(f, 9) && finite(k, 81));
      CHECK(finshell_section_create("neo_hookean", 1, names, values, 1, 1, option, &density, &s, NULL) == 0);
      code = finshell_mass_matrix(s, 1, X, m, l, NULL, NULL);
      CHECK((code == 0) == (power <= 40) && finite(m, 324) && finite(l, 18));
      finshell_section_destroy(s);
   }
}

int main(void)
{
   silence();
   units();
   numberings();
   flattened();
   lengths();
   in_place();
   overflow();
   return finish();
}
