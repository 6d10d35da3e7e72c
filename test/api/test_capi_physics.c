/* What the functions compute: derivatives of the energy, pressure and volume, mass, resultants, layers and offset, rotations. */
#define _POSIX_C_SOURCE 200809L
#include "check.h"

static const double step = 1e-5;

/* Energy of one element at unknowns (u, t) moved by d: spins for quaternions, else additions to the vectors. */
static double moved(const finshell_section *s, patch p, int convention, const double *state, const double d[18], double *force)
{
   double u[9], t[9], q[12], w[9], energy = 0;
   for (int i = 0; i < 3; i++)
      for (int c = 0; c < 3; c++) {
         u[3 * i + c] = p.u[3 * i + c] + d[6 * i + c];
         t[3 * i + c] = p.vector[3 * i + c] + d[6 * i + 3 + c];
         w[3 * i + c] = d[6 * i + 3 + c];
      }
   memcpy(q, p.quaternion, sizeof q);
   CHECK(finshell_rotation_update(3, w, q, NULL, NULL) == 0);
   CHECK(finshell_evaluate(s, 1, p.X, u, convention == FINSHELL_ROTATION_QUATERNION ? q : t, convention, state, p.direction, &energy,
                           force, NULL, NULL, 1, NULL) == 0);
   return energy;
}

/* Force is the derivative of the energy, the tangent that of the force (for spins: of the energy along exp(w) R). */
static void derivatives(const finshell_section *s, int convention)
{
   for (uint32_t seed = 1; seed < 4; seed++) {
      patch p = new_patch(1, seed);
      double state[12], d[18] = {0}, f1[18], f2[18], force[18], tangent[18][18], scale = 0, energy;
      if (convention == FINSHELL_ROTATION_INCREMENT) { /* R = exp(t) state, t = 0.3 of the rotation and something */
         double back[9], inverse[12], exp_t[12];
         for (int i = 0; i < 9; i++) back[i] = 0.3 * p.vector[i] + 0.1 * i;
         CHECK(finshell_rotation_exp(3, back, exp_t, NULL, NULL) == 0);
         for (int i = 0; i < 12; i++) inverse[i] = i % 4 ? -exp_t[i] : exp_t[i];
         CHECK(finshell_rotation_compose(3, inverse, p.quaternion, state, NULL, NULL) == 0);
         memcpy(p.vector, back, sizeof back);
      }
      CHECK(finshell_evaluate(s, 1, p.X, p.u, convention == FINSHELL_ROTATION_QUATERNION ? p.quaternion : p.vector, convention, state,
                              p.direction, &energy, force, &tangent[0][0], NULL, 1, NULL) == 0);
      for (int i = 0; i < 18; i++) scale = fmax(scale, fabs(tangent[i][i]));
      CHECK(energy > 0);
      for (int i = 0; i < 18; i++) {
         d[i] = step;
         double plus = moved(s, p, convention, state, d, f1);
         d[i] = -step;
         double minus = moved(s, p, convention, state, d, f2);
         d[i] = 0;
         CHECK_CLOSE(force[i], (plus - minus) / (2 * step), 1e-7 * scale);
         CHECK_CLOSE(tangent[i][i], (plus - 2 * energy + minus) / (step * step), 1e-3 * scale);
         for (int j = 0; j < 18; j++) {
            CHECK(tangent[i][j] == tangent[j][i]);
            /* the force of spins at the moved rotation is that of other axes: only vectors are compared entry by entry */
            if (convention != FINSHELL_ROTATION_QUATERNION) CHECK_CLOSE(tangent[i][j], (f1[j] - f2[j]) / (2 * step), 1e-6 * scale);
         }
      }
      free_patch(p);
   }
}

/* Both forms of pressure: work equals pressure times the change of volume for the symmetric form; stiffness by differences. */
static void pressure(void)
{
   patch p = new_patch(1, 7);
   const double load[1] = {3.5}, origin[3] = {0.3, -0.2, 0.1};
   for (int form = 0; form < 2; form++) {
      double f[9], f1[9], f2[9], k[9][9], u[9], sum[3] = {0}, area[3], a[3], b[3];
      CHECK(finshell_pressure_load(1, load, p.X, p.u, form, origin, f, &k[0][0], NULL, NULL) == 0);
      for (int j = 0; j < 9; j++) {
         memcpy(u, p.u, sizeof u);
         u[j] += step;
         CHECK(finshell_pressure_load(1, load, p.X, u, form, origin, f1, NULL, NULL, NULL) == 0);
         u[j] -= 2 * step;
         CHECK(finshell_pressure_load(1, load, p.X, u, form, origin, f2, NULL, NULL, NULL) == 0);
         for (int i = 0; i < 9; i++) {
            CHECK_CLOSE(k[j][i], (f1[i] - f2[i]) / (2 * step), 1e-9);
            if (form == 1) CHECK_CLOSE(k[j][i], k[i][j], 1e-14);
         }
      }
      if (form == 1) continue;
      for (int c = 0; c < 3; c++) {
         a[c] = p.X[3 + c] + p.u[3 + c] - p.X[c] - p.u[c];
         b[c] = p.X[6 + c] + p.u[6 + c] - p.X[c] - p.u[c];
         for (int i = 0; i < 3; i++) sum[c] += f[3 * i + c];
      }
      area[0] = 0.5 * (a[1] * b[2] - a[2] * b[1]);
      area[1] = 0.5 * (a[2] * b[0] - a[0] * b[2]);
      area[2] = 0.5 * (a[0] * b[1] - a[1] * b[0]);
      for (int c = 0; c < 3; c++) CHECK_CLOSE(sum[c], load[0] * area[c], 1e-14);
   }
   free_patch(p);
}

/* Kinetic energy of a rigid motion with velocity v at the origin and angular velocity w. */
static double kinetic(double m[18][18], const double *X, const double v[3], const double w[3])
{
   double rate[18], energy = 0;
   for (int i = 0; i < 3; i++) {
      const double *x = X + 3 * i;
      rate[6 * i] = v[0] + w[1] * x[2] - w[2] * x[1];
      rate[6 * i + 1] = v[1] + w[2] * x[0] - w[0] * x[2];
      rate[6 * i + 2] = v[2] + w[0] * x[1] - w[1] * x[0];
      for (int c = 0; c < 3; c++) rate[6 * i + 3 + c] = w[c];
   }
   for (int i = 0; i < 18; i++)
      for (int j = 0; j < 18; j++) energy += 0.5 * rate[i] * m[i][j] * rate[j];
   return energy;
}

static void mass(void)
{
   /* a right triangle of sides 3 and 4 in the plane z = 2 */
   const double X[9] = {0, 0, 2, 3, 0, 2, 0, 4, 2}, area = 6, still[3] = {0};
   double m[18][18], lumped[18], v[3] = {1, -2, 0.5}, w[3] = {0.4, 0, 0};
   finshell_section *s = rubber(0.5);
   CHECK(finshell_mass_matrix(s, 1, X, &m[0][0], lumped, NULL, NULL) == 0);
   double i0 = 2.5 * 0.5, i2 = 2.5 * 0.5 * 0.5 * 0.5 / 12;
   CHECK_CLOSE(kinetic(m, X, v, still), 0.5 * i0 * area * (1 + 4 + 0.25), 1e-13);
   /* about x: y^2 + z^2 over the area, and the inertia of the thickness, about z: of the triangle */
   CHECK_CLOSE(kinetic(m, X, still, w), 0.5 * 0.16 * (i0 * (3 * 4 * 4 * 4 / 12.0 + 4 * area) + i2 * area), 1e-13);
   w[0] = 0, w[2] = 0.4;
   CHECK_CLOSE(kinetic(m, X, still, w), 0.5 * 0.16 * (i0 * (3 * 4 * 4 * 4 + 4 * 3 * 3 * 3) / 12.0 + i2 * area), 1e-13);
   for (int i = 0; i < 18; i++) CHECK_CLOSE(lumped[i], area / 3 * (i % 6 < 3 ? i0 : i2), 1e-14);
   finshell_section_destroy(s);

   /* layers with offset: a rigid solid plate, whatever the surface its nodes lie on; angular velocity in the plane */
   s = laminate(0.7);
   const double h[3] = {0.02, 0.03, 0.04}, rho[3] = {1, 2, 3};
   double z = 2 + 0.7 - 0.045, expected = 0, total = 0;
   for (int i = 0; i < 3; i++) { /* integral of rho (y^2 + z^2) over the solid */
      expected += rho[i] * (h[i] * 3 * 4 * 4 * 4 / 12.0 + area * (pow(z + h[i], 3) - pow(z, 3)) / 3);
      total += rho[i] * h[i] * area;
      z += h[i];
   }
   w[0] = 0.4, w[2] = 0;
   CHECK(finshell_mass_matrix(s, 1, X, &m[0][0], NULL, NULL, NULL) == 0);
   CHECK_CLOSE(kinetic(m, X, still, w), 0.5 * 0.16 * expected, 1e-12);
   CHECK_CLOSE(kinetic(m, X, v, still), 0.5 * 5.25 * total, 1e-13);
   for (int i = 0; i < 18; i++)
      for (int j = 0; j < 18; j++) CHECK(m[i][j] == m[j][i]);
   finshell_section_destroy(s);
}

/* Sections of layers: three equal layers are one; an offset plate bends about the nodes; coupling has the right sign. */
static void layers(void)
{
   const char *names[] = {"e", "nu"}, *option[] = {"offset"};
   const double values[] = {1200, 0.25}, X[9] = {0, 0, 0, 2, 0, 0, 0, 2, 0}, offset[] = {0.25};
   double u[9] = {0}, t[9] = {0}, q[12], energy[3], n[3], m[3], stress[9], stretch;
   finshell_section *one, *three, *shifted;
   finshell_section_builder *builder = begin();
   patch p = new_patch(5, 9);
   double e1[5], e3[5];

   for (int i = 0; i < 3; i++) {
      CHECK(finshell_builder_layer(builder, 0.1, 17 * i, 0, 0, NULL) == 0);
      CHECK(finshell_builder_law(builder, "linear_elastic", 2, names, values, NULL) == 0);
   }
   CHECK(finshell_section_create("linear_elastic", 2, names, values, 0.3, 0, NULL, NULL, &one, NULL) == 0);
   three = built(builder);
   CHECK(finshell_section_create("linear_elastic", 2, names, values, 0.3, 1, option, offset, &shifted, NULL) == 0);
   CHECK(finshell_evaluate(one, 5, p.X, p.u, p.vector, 1, NULL, NULL, e1, NULL, NULL, NULL, 1, NULL) == 0);
   CHECK(finshell_evaluate(three, 5, p.X, p.u, p.vector, 1, NULL, NULL, e3, NULL, NULL, NULL, 1, NULL) == 0);
   for (int i = 0; i < 5; i++) CHECK_CLOSE(e1[i], e3[i], 1e-12 * e1[i]);

   /* stretch of the plane by 1e-6: N = E' h e, and about the nodes M = N times the offset; stress the same everywhere */
   for (int i = 0; i < 3; i++) u[3 * i] = 1e-6 * X[3 * i];
   CHECK(finshell_rotation_exp(3, t, q, NULL, NULL) == 0);
   double plane = 1200 / (1 - 0.0625);
   CHECK(finshell_recover(shifted, 1, X, u, q, 2, NULL, NULL, &stretch, n, m, stress, NULL, NULL) == 0);
   CHECK_CLOSE(n[0], plane * 0.3 * 1e-6, 1e-5 * plane * 1e-6);
   CHECK_CLOSE(n[1], 0.25 * n[0], 1e-9 * plane * 1e-6 + 1e-6 * n[0]);
   CHECK_CLOSE(m[0], 0.25 * n[0], 1e-10 * plane * 1e-6);
   CHECK_CLOSE(stretch, 1 - 0.25 / 0.75 * 1e-6, 1e-11);
   for (int i = 0; i < 3; i++) CHECK_CLOSE(stress[3 * i], plane * 1e-6, 1e-5 * plane * 1e-6);
   CHECK(finshell_recover(one, 1, X, u, q, 2, NULL, NULL, NULL, NULL, m, NULL, NULL, NULL) == 0);
   CHECK_CLOSE(m[0], 0, 1e-12 * plane * 1e-6);

   /* curvature: with nodes 0.25 below the middle, the fibres through the middle shorten or lengthen; the layer at the nodes does not */
   memset(u, 0, sizeof u);
   for (int i = 0; i < 3; i++) { /* cylinder of curvature 1e-4 about y: w = -k x^2/2, rotation of the director dw/dx */
      u[3 * i + 2] = -0.5e-4 * X[3 * i] * X[3 * i];
      t[3 * i + 1] = 1e-4 * X[3 * i];
   }
   CHECK(finshell_rotation_exp(3, t, q, NULL, NULL) == 0);
   CHECK(finshell_evaluate(one, 1, X, u, q, 2, NULL, NULL, &energy[0], NULL, NULL, NULL, 1, NULL) == 0);
   CHECK(finshell_evaluate(shifted, 1, X, u, q, 2, NULL, NULL, &energy[1], NULL, NULL, NULL, 1, NULL) == 0);
   double inertia = 0.3 * 0.3 * 0.3 / 12;
   CHECK_CLOSE(energy[0], 0.5 * plane * inertia * 1e-8 * 2, 2e-3 * energy[0]);
   CHECK_CLOSE(energy[1], 0.5 * plane * (inertia + 0.3 * 0.25 * 0.25) * 1e-8 * 2, 2e-3 * energy[1]);
   CHECK(finshell_recover(shifted, 1, X, u, q, 2, NULL, NULL, NULL, n, m, stress, NULL, NULL) == 0);
   /* director turns towards +x with x: fibres above the nodes lengthen */
   CHECK_CLOSE(n[0], plane * 0.3 * 0.25 * 1e-4, 2e-3 * n[0]);
   CHECK_CLOSE(stress[0], plane * 0.10 * 1e-4, 2e-3 * stress[0]);
   CHECK_CLOSE(stress[6], plane * 0.40 * 1e-4, 2e-3 * stress[6]);
   finshell_section_destroy(one);
   finshell_section_destroy(three);
   finshell_section_destroy(shifted);
   free_patch(p);
}

/* The angle of a layer: 90 degrees swap the axes of an orthotropic law. */
static void angle(void)
{
   const char *names[] = {"e1", "e2", "nu12", "g12"};
   const double values[] = {3300, 1100, 0.25, 660}, X[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, y[3] = {0, 1, 0};
   double n[3][3], u[9] = {0}, q[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
   finshell_section *s;
   u[3] = 1e-7; /* stretch along x only */
   for (int turned = 0; turned < 2; turned++) {
      finshell_section_builder *builder = begin();
      CHECK(finshell_builder_layer(builder, 1, 90 * turned, 0, 0, NULL) == 0);
      CHECK(finshell_builder_law(builder, "orthotropic", 4, names, values, NULL) == 0);
      s = built(builder);
      CHECK(finshell_recover(s, 1, X, u, q, 2, NULL, NULL, NULL, n[turned], NULL, NULL, NULL, NULL) == 0);
      if (!turned) CHECK(finshell_recover(s, 1, X, u, q, 2, NULL, y, NULL, n[2], NULL, NULL, NULL, NULL) == 0);
      finshell_section_destroy(s);
   }
   double d = 1 - 0.25 * 0.25 * 1100 / 3300; /* 1 - nu12 nu21 */
   CHECK_CLOSE(n[0][0], 3300 / d * 1e-7, 1e-9);
   CHECK_CLOSE(n[1][0], 1100 / d * 1e-7, 1e-9);
   CHECK_CLOSE(n[2][1], 1100 / d * 1e-7, 1e-9); /* in axes of the direction y: component 22 is along -x */
   CHECK_CLOSE(n[0][1], 0.25 * 1100 / d * 1e-7, 1e-10);
}

static void rotations(void)
{
   const double quarter = 2 * atan(1.0), x[3] = {quarter, 0, 0}, z[3] = {0, 0, quarter}, far[3] = {0, 7, 0}, theta[3] = {0.3, -1.2, 0.9};
   double qx[4], qz[4], q[4], r[3][3], v[3], t[3][3], moved_vector[3], q1[4], spin[3];
   CHECK(finshell_rotation_exp(1, x, qx, NULL, NULL) == 0 && finshell_rotation_exp(1, z, qz, NULL, NULL) == 0);
   CHECK_CLOSE(qx[0], sqrt(0.5), 1e-15);
   CHECK_CLOSE(qx[1], sqrt(0.5), 1e-15);
   CHECK(finshell_rotation_compose(1, qz, qx, q, NULL, NULL) == 0 && finshell_rotation_matrix(1, q, &r[0][0], NULL, NULL) == 0);
   /* first about x: y to z; then about z: x to y. So x to y, y to z, z to x. */
   CHECK_CLOSE(r[1][0], 1, 1e-15);
   CHECK_CLOSE(r[2][1], 1, 1e-15);
   CHECK_CLOSE(r[0][2], 1, 1e-15);
   memcpy(q1, qx, sizeof q1);
   CHECK(finshell_rotation_update(1, z, q1, NULL, NULL) == 0);
   for (int i = 0; i < 4; i++) CHECK_CLOSE(q1[i], q[i], 1e-15);
   CHECK(finshell_rotation_exp(1, far, q, NULL, NULL) == 0 && finshell_rotation_log(1, q, v, NULL, NULL) == 0);
   CHECK_CLOSE(v[1], 7 - 8 * atan(1.0) * 1, 1e-14);
   /* T: the spin from exp(theta) to exp(theta + d) is T d */
   CHECK(finshell_rotation_tangent(1, theta, &t[0][0], NULL, NULL) == 0 && finshell_rotation_exp(1, theta, q, NULL, NULL) == 0);
   for (int j = 0; j < 3; j++) {
      memcpy(moved_vector, theta, sizeof theta);
      moved_vector[j] += 1e-7;
      CHECK(finshell_rotation_exp(1, moved_vector, q1, NULL, NULL) == 0);
      double inverse[4] = {q[0], -q[1], -q[2], -q[3]};
      CHECK(finshell_rotation_compose(1, q1, inverse, qx, NULL, NULL) == 0 && finshell_rotation_log(1, qx, spin, NULL, NULL) == 0);
      for (int i = 0; i < 3; i++) CHECK_CLOSE(t[i][j], spin[i] / 1e-7, 1e-6);
   }
}

int main(void)
{
   finshell_section *s;
   silence();
   s = rubber(0.2);
   for (int convention = 1; convention <= 3; convention++) derivatives(s, convention);
   finshell_section_destroy(s);
   s = laminate(0.03);
   for (int convention = 1; convention <= 3; convention++) derivatives(s, convention);
   finshell_section_destroy(s);
   pressure();
   mass();
   layers();
   angle();
   rotations();
   return finish();
}
