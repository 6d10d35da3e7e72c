/* Three laws of one's own, in C: cc -O3 -fPIC -shared -I/where/finshell.h/is laws.c -o liblaws.so -lm
 *
 *    finshell check-law ./liblaws.so#arruda_boyce
 *    &material name = 'rubber' law = 'arruda_boyce' library = './liblaws.so' mu = 0.3 lock = 5.0 /
 *
 * arruda_boyce   incompressible, in space: the eight-chain model, Arruda & Boyce, J. Mech. Phys. Solids 41 (1993) 389, its series in
 *                five terms: W = mu sum C_k/N^(k-1) (I1^k - 3^k)
 * lee_sacks      incompressible, in space: Lee, Amini, Gorman, Gorman & Sacks, J. Biomech. 47 (2014) 2055, isotropic form of leaflets:
 *                W = c0/2 (I1 - 3) + c1/2 (exp(c2 (I1 - 3)^2) - 1)
 * prony          in the plane: linear viscoelasticity of St. Venant-Kirchhoff's stress in Green-Lagrange strain, one branch
 *                g, tau: S = (1 - g) S0 + h, dh/dt + h/tau = g dS0/dt, by the exact step of a strain that changes linearly
 *                (Simo & Hughes, Computational Inelasticity, section 10.3). Its states: S0 and h.
 */
#include <math.h>

#include "finshell_law.h"

/* ------------------------------------------------------------------ functions of I1 in space
 * I1 - 3 = 2 (E11 + E22 + E33); S = 2 W' (1, 1, 1, 0), tangent 4 W'' of the first three. */
typedef struct { double w, first, second; } response;

static void of_first_invariant(const finshell_points *at, const double *p, const double *e, double *w, double *s, double *d,
                               int32_t *codes, response (*law)(const double *p, double x, int32_t *code))
{
   const int32_t n = at->n;
   for (int32_t i = 0; i < n; i++) {
      const double x = 2*(e[i] + e[n + i] + e[2*n + i]);
      const response r = law(p, x, codes + i);
      w[i] = r.w;
      if (at->level < 1) continue;
      s[i] = s[n + i] = s[2*n + i] = 2*r.first;
      s[3*n + i] = 0;
      if (at->level < 2) continue;
      d[i] = d[n + i] = d[2*n + i] = d[4*n + i] = d[5*n + i] = d[7*n + i] = 4*r.second; /* 11 22 33, 12 13, 23 */
      d[3*n + i] = d[6*n + i] = d[8*n + i] = d[9*n + i] = 0;                             /* 44, 14, 24, 34 */
   }
}

static response eight_chains(const double *p, double x, int32_t *code)
{
   static const double c[5] = {1.0/2, 1.0/20, 11.0/1050, 19.0/7000, 519.0/673750};
   const double mu = p[0], lock2 = p[1]*p[1], i1 = 3 + x;
   double power = 1, scale = mu;
   response r = {0, 0, 0};
   if (!(x < 1e6 && x > -1)) { *code = FINSHELL_MATERIAL_LIMIT; return r; }
   for (int k = 1; k <= 5; k++) {
      /* (I1^k - 3^k)/(I1 - 3) without cancellation: sum of I1^j 3^(k-1-j) */
      double q = 0, a = 1;
      for (int j = 0; j < k; j++) q = q*3 + a, a *= i1;
      r.w += scale*c[k - 1]*q*x;
      r.first += scale*c[k - 1]*k*power;
      if (k > 1) r.second += scale*c[k - 1]*k*(k - 1)*power/i1;
      power *= i1;
      scale /= lock2;
   }
   return r;
}

static void arruda_boyce(const finshell_points *at, const double *p, const double *e, double *w, double *s, double *d,
                         const double *begin, double *end, int32_t *codes)
{
   (void)begin;
   (void)end;
   of_first_invariant(at, p, e, w, s, d, codes, eight_chains);
}

static response leaflet(const double *p, double x, int32_t *code)
{
   const double y = p[2]*x*x;
   response r = {0, 0, 0};
   if (!(y < 500 && x > -1)) { *code = FINSHELL_MATERIAL_LIMIT; return r; }
   const double c = 0.5*p[1]*exp(y);
   r.w = 0.5*p[0]*x + 0.5*p[1]*expm1(y);
   r.first = 0.5*p[0] + c*2*p[2]*x;
   r.second = c*2*p[2]*(1 + 2*y);
   return r;
}

static void lee_sacks(const finshell_points *at, const double *p, const double *e, double *w, double *s, double *d,
                      const double *begin, double *end, int32_t *codes)
{
   (void)begin;
   (void)end;
   of_first_invariant(at, p, e, w, s, d, codes, leaflet);
}

/* ------------------------------------------------------------------ with states
 * S0 = D e; h' = decay h + g factor (S0' - S0), factor = (1 - exp(-dt/tau))/(dt/tau); a step of no time: h' = h + g (S0' - S0). */
static void prony(const finshell_points *at, const double *p, const double *e, double *w, double *s, double *d, const double *begin,
                  double *end, int32_t *codes)
{
   const int32_t n = at->n;
   const double nu = p[1], g = p[2], t = at->time_step/p[3];
   const double a = p[0]/(1 - nu*nu), shear = 0.5*a*(1 - nu), decay = exp(-t);
   const double factor = t > 1e-12 ? -expm1(-t)/t : 1, stiff = 1 - g + g*factor;
   for (int32_t i = 0; i < n; i++) {
      const double x = e[i], y = e[n + i], z = e[2*n + i];
      const double s0[3] = {a*(x + nu*y), a*(y + nu*x), shear*z}; /* what the spring alone would bear */
      const double c11 = 1 + 2*x, c22 = 1 + 2*y;
      double total[3];
      if (!(c11 > 0 && c22 > 0 && c11*c22 > z*z)) codes[i] = FINSHELL_MATERIAL_LIMIT;
      for (int k = 0; k < 3; k++) {
         const double h = decay*begin[(3 + k)*n + i] + g*factor*(s0[k] - begin[k*n + i]);
         end[k*n + i] = s0[k];
         end[(3 + k)*n + i] = h;
         total[k] = (1 - g)*s0[k] + h;
      }
      /* what is stored in the two springs: S:e/2 of the one, h:D^-1:h/(2 g) of the other */
      {
         const double h1 = end[3*n + i], h2 = end[4*n + i], h3 = end[5*n + i];
         w[i] = 0.5*(1 - g)*(s0[0]*x + s0[1]*y + s0[2]*z);
         if (g > 0) w[i] += ((h1*h1 + h2*h2 - 2*nu*h1*h2)/p[0] + h3*h3/shear)/(2*g);
      }
      if (at->level < 1) continue;
      for (int k = 0; k < 3; k++) s[k*n + i] = total[k];
      if (at->level < 2) continue;
      d[i] = d[n + i] = stiff*a;
      d[2*n + i] = stiff*shear;
      d[3*n + i] = stiff*nu*a;
      d[4*n + i] = d[5*n + i] = 0;
   }
}

/* Isotropic linear elasticity in plane stress: E33 = -nu/(1 - nu) (E11 + E22), l = sqrt(1 + 2 E33). */
static void thinner(const finshell_points *at, const double *p, const double *e, double *l, double *first, double *second,
                    int32_t *codes)
{
   const int32_t n = at->n;
   const double c = -p[1]/(1 - p[1]);
   for (int32_t i = 0; i < n; i++) {
      const double c33 = 1 + 2*c*(e[i] + e[n + i]);
      if (!(c33 > 0)) codes[i] = FINSHELL_MATERIAL_LIMIT;
      l[i] = c33 > 0 ? sqrt(c33) : 1;
      if (at->level < 1) continue;
      first[i] = first[n + i] = c/l[i];
      first[2*n + i] = 0;
      if (at->level < 2) continue;
      second[i] = second[n + i] = second[3*n + i] = -c*c/(l[i]*l[i]*l[i]);
      second[2*n + i] = second[4*n + i] = second[5*n + i] = 0;
   }
}

/* ------------------------------------------------------------------ what there is: name, meaning, default, example, required */
static const finshell_parameter of_chains[] = {{"mu", "shear modulus (stress), up to the series in 1/lock^2", 0, 0.3, 1, 0},
                                               {"lock", "stretch at which the chains lock", 0, 5, 1, 0}};
static const finshell_parameter of_leaflet[] = {{"c0", "modulus of the matrix (stress)", 0, 10, 1, 0},
                                                {"c1", "modulus of the exponential (stress)", 0, 0.209, 1, 0},
                                                {"c2", "exponent", 0, 9.046, 1, 0}};
static const finshell_parameter of_prony[] = {{"e", "Young's modulus at once (stress)", 0, 1000, 1, 0},
                                              {"nu", "Poisson's ratio", 0.3, 0.3, 0, 0},
                                              {"g", "part of the stiffness that relaxes, 0 to 1", 0, 0.6, 1, 0},
                                              {"tau", "time of relaxation", 0, 2, 1, 0}};

static const finshell_law laws[] = {
   {sizeof(finshell_law), "arruda_boyce", FINSHELL_LAW_INCOMPRESSIBLE, 1, 0, 2, of_chains, arruda_boyce, NULL, NULL},
   {sizeof(finshell_law), "lee_sacks", FINSHELL_LAW_INCOMPRESSIBLE, 1, 0, 3, of_leaflet, lee_sacks, NULL, NULL},
   {sizeof(finshell_law), "prony", FINSHELL_LAW_PLANE, 1, 6, 4, of_prony, prony, thinner, NULL}};

FINSHELL_LAWS(laws)
