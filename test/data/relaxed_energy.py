"""Makes relaxed_energy.csv: the least energy of E + Q over all positive semidefinite Q, by brute force.

Independent of the kernel: a grid over Q = L L' (three numbers, no assumption on its rank), the best points refined by
Nelder-Mead (numpy, scipy) until nothing changes. Energies per volume of laws with the example parameters of their documentation;
'laminate' is the mean of orthotropic at 0 and holzapfel_gasser_ogden at 35 degrees. Run: python relaxed_energy.py > relaxed_energy.csv
"""
import itertools
import sys

import numpy as np
from scipy.optimize import minimize

huge = 1e30


def invariants(c):
    det = c[0] * c[1] - c[2] ** 2
    if not (c[0] > 0 and det > 1e-6):
        return None
    return c[0] + c[1] + 1 / det - 3


def neo_hookean(e):
    x = invariants((1 + 2 * e[0], 1 + 2 * e[1], e[2]))
    return huge if x is None else 100 * x


def orthotropic(e):
    e1, e2, nu, g = 3300, 1100, 0.25, 660
    r = 1 / (1 - nu**2 * e2 / e1)
    return 0.5 * (r * e1 * e[0] ** 2 + r * e2 * e[1] ** 2 + 2 * r * nu * e2 * e[0] * e[1] + g * e[2] ** 2)


def exponential_fibre(e):
    x = invariants((1 + 2 * e[0], 1 + 2 * e[1], e[2]))
    if x is None:
        return huge
    return 188 * np.expm1(min(5.07 * x**2 + 2.33 * max(2 * e[0], 0) ** 2, 60))


def holzapfel_2005(e):
    x = invariants((1 + 2 * e[0], 1 + 2 * e[1], e[2]))
    if x is None:
        return huge
    mu, k1, k2, rho = 1.27, 21.6, 8.21, 0.25
    return mu * x + k1 / k2 * np.expm1(min(k2 * ((1 - rho) * x**2 + rho * max(2 * e[0], 0) ** 2), 60))


def holzapfel_gasser_ogden(e):
    x = invariants((1 + 2 * e[0], 1 + 2 * e[1], e[2]))
    if x is None:
        return huge
    c, k1, k2, kappa, angle = 7.64, 996.6, 5.246, 0.1, np.radians(40)
    w = 0.5 * c * x
    for sign in (1, -1):
        f = 2 * (e[0] * np.cos(angle) ** 2 + e[1] * np.sin(angle) ** 2 + sign * e[2] * np.cos(angle) * np.sin(angle))
        w += 0.5 * k1 / k2 * np.expm1(min(k2 * max(kappa * x + (1 - 3 * kappa) * f, 0) ** 2, 60))
    return w


def turned(e, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return (c * c * e[0] + s * s * e[1] + c * s * e[2], s * s * e[0] + c * c * e[1] - c * s * e[2],
            2 * c * s * (e[1] - e[0]) + (c * c - s * s) * e[2])


def laminate(e):
    return 0.5 * (orthotropic(e) + holzapfel_gasser_ogden(turned(e, 35)))


def relaxed(law, e):
    size = np.sqrt(max(np.abs(e)))

    def energy(p):  # of E + L L'
        return law((e[0] + p[0] ** 2, e[1] + p[1] ** 2 + p[2] ** 2, e[2] + 2 * p[0] * p[1]))

    steps = np.linspace(-1.2, 1.2, 13) * size
    grid = sorted(((energy(p), p) for p in itertools.product(steps[6:], steps, steps[6:])))
    best = (energy((0, 0, 0)), np.zeros(3))
    for w, p in grid[:8]:
        found = w
        for _ in range(30):
            r = minimize(energy, p, method='Nelder-Mead', options=dict(xatol=1e-13, fatol=1e-18, maxfev=3000))
            p = r.x
            if found - r.fun <= 1e-13 * abs(r.fun):
                break
            found = r.fun
        if r.fun < best[0]:
            best = (r.fun, r.x)
    return best[0]


def main():
    print('# Relaxed energies by brute force, made by relaxed_energy.py. law, E11, E22, 2 E12 (material axes), energy per volume')
    seed = np.random.default_rng(5)
    for law in (neo_hookean, orthotropic, exponential_fibre, holzapfel_2005, holzapfel_gasser_ogden, laminate):
        for k in range(10):
            size = (0.02, 0.1)[k % 2]
            stretch = np.array([1 + size * seed.uniform(0.3, 1.5), 1 + 2 * size * seed.uniform(-1.5, 0.3)])
            phi = seed.uniform(0, np.pi)
            a, b = (stretch**2 - 1) / 2
            c, s = np.cos(phi), np.sin(phi)
            e = (a * c * c + b * s * s, a * s * s + b * c * c, 2 * (a - b) * c * s)
            print(f'{law.__name__},{e[0]:.17e},{e[1]:.17e},{e[2]:.17e},{relaxed(law, e):.15e}')
            sys.stdout.flush()


main()
