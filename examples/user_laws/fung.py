#!/usr/bin/env python3
"""A law in Python: Fung's exponential, W = c/2 (exp(Q) - 1), Q = a1 E11^2 + a2 E22^2 + 2 a12 E11 E22 + a6 (2 E12)^2 (Fung, Fronek & Patitucci,
Am. J. Physiol. 237 (1979) H620), incompressible. A square is stretched along x and along y: the stiffer way is the axis 1."""
import numpy as np

import finshell


def fung(points, parameters, strain, begin):
    c, a1, a2, a12, a6 = parameters
    x, y, z = strain
    q = a1 * x**2 + a2 * y**2 + 2 * a12 * x * y + a6 * z**2
    g = np.array([a1 * x + a12 * y, a2 * y + a12 * x, a6 * z])  # half the gradient of Q
    scale = c * np.exp(q)
    # an area that is gone, and an exponent that is out of reach, have no energy: NaN refuses the point
    fine = (q < 500) & ((1 + 2 * x) * (1 + 2 * y) > z**2) & (x > -0.5)
    energy = np.where(fine, 0.5 * c * np.expm1(q), np.nan)
    h = np.array([a1, a2, a6, a12, 0, 0])[:, None]
    tangent = scale * (h + 2 * np.array([g[0]**2, g[1]**2, g[2]**2, g[0] * g[1], g[0] * g[2], g[1] * g[2]]))
    return energy, scale * g, tangent


ARTERY = {"c": 26.95, "a1": 0.9925, "a2": 0.4180, "a12": 0.0749, "a6": 0.3}
law = finshell.Law("fung", fung, parameters={name: None for name in ARTERY})

if __name__ == "__main__":
    for finding in finshell.check_law(law, ARTERY):
        print("ok  " if finding.passed else "FAIL", f"{finding.name:14} {finding.found:9.1e}  {finding.meaning}")
    section = finshell.Section(law, ARTERY, thickness=0.1)
    square = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], dtype=float)
    for axis in (0, 1):
        u = np.zeros_like(square)
        u[:, :, axis] = 0.5 * square[:, :, axis]
        force = section.recover(square, u, np.zeros_like(square)).membrane_force[0]
        print(f"stretched by 1.5 along {'xy'[axis]}: membrane force {force[axis]:.6f}")
