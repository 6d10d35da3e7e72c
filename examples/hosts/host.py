"""A host in Python: meshes, supports and Newton's method are its own, finshell.Assembly does the rest, scipy solves.

    python host.py hemisphere | disk
"""
import sys

import finshell
import numpy as np
from scipy.sparse.linalg import splu

Q = finshell.Rotation.QUATERNION


def solve(a, X, u, q, load, **elements):
    """Equilibrium near displacements u and rotations q (nodes, 3 and 4); load(r, u, q) takes the loads from the residual r."""
    for _ in range(60):
        r = a.evaluate(X, u, q, Q, threads=0, **elements)
        load(r, u, q)
        d = a.to_nodes(splu(r.matrix.tocsc()).solve(-a.to_rows(r.force)))
        d *= min(1.0, 0.4 / np.abs(d[:, 3:]).max())  # no node turns by more at once
        u, q = u + d[:, :3], finshell.update(q, d[:, 3:])
        if np.abs(d[:, :3]).max() < 1e-11 * np.abs(u).max():
            return u, q
    raise finshell.Recoverable(4, "no convergence")


def hemisphere(n=16):
    """A quarter of a hemisphere with a hole of 18 degrees, pulled and pushed by 200 at its rim: Sze, Liu & Lo 2004, 3.4."""
    i, j = np.divmod(np.arange((n + 1) ** 2), n + 1)
    azimuth, colatitude = np.radians(90 * i / n), np.radians(90 - 72 * j / n)
    X = 10 * np.stack([np.sin(colatitude) * np.cos(azimuth), np.sin(colatitude) * np.sin(azimuth), np.cos(colatitude)], 1)
    at = np.flatnonzero((i < n) & (j < n))
    triangles = np.concatenate([np.stack([at, at + n + 1, at + n + 2], 1), np.stack([at, at + n + 2, at + 1], 1)])
    held = np.zeros((len(X), 6), bool)
    held[i == 0] |= np.array([0, 1, 0, 1, 0, 1], bool)  # planes of symmetry
    held[i == n] |= np.array([1, 0, 0, 0, 1, 1], bool)
    pulled, pushed = 0, n * (n + 1)
    held[pulled, 2] = True
    section = finshell.Section("linear_elastic", {"e": 6.825e7, "nu": 0.3}, 0.04)
    a = finshell.Assembly(triangles, section, held=held)
    u, q = 0 * X, np.tile([1.0, 0, 0, 0], (len(X), 1))
    for force in np.linspace(0, 200, 11)[1:]:
        def load(r, u, q, force=force):
            r.force[pulled, 0] -= force
            r.force[pushed, 1] += force
        u, q = solve(a, X, u, q, load, normals=X[triangles])
    return {"pulled": u[pulled, 0], "pushed": -u[pushed, 1]}


def disk(rings=12):
    """A quarter of a rubber disk with a hinged rim under a follower pressure of 17: Caselli & Bisegna, 3.1."""
    k = np.concatenate([np.full(2 * ring + 1, ring) for ring in range(rings + 1)])  # ring and number round it of each node
    j = np.concatenate([np.arange(2 * ring + 1) for ring in range(rings + 1)])
    angle = np.pi / 2 * j / np.maximum(2 * k, 1)
    X = 7.5 / rings * np.stack([k * np.cos(angle), k * np.sin(angle), 0 * angle], 1)
    triangles = []
    for ring in range(1, rings + 1):
        for s in range(2):
            inner, outer = (ring - 1) ** 2 + s * (ring - 1), ring ** 2 + s * ring
            triangles += [[inner + c, outer + c, outer + c + 1] for c in range(ring)]
            triangles += [[inner + c, outer + c + 1, inner + c + 1] for c in range(ring - 1)]
    triangles = np.array(triangles)
    rim, held = k == rings, np.zeros((len(X), 6), bool)
    held[rim, :3] = True
    held[(j == 0) | (k == 0)] |= np.array([0, 1, 0, 1, 0, 1], bool)
    held[(j == 2 * k) | (k == 0)] |= np.array([1, 0, 0, 0, 1, 1], bool)
    straight = 2 * (rim[triangles] & rim[np.roll(triangles, -1, 1)])  # the sides on the rim do not move
    a = finshell.Assembly(triangles, finshell.Section("mooney_rivlin", {"c10": 80.0, "c01": 20.0}, 0.5), held=held)
    u, q = 0 * X, np.tile([1.0, 0, 0, 0], (len(X), 1))
    for p in np.linspace(0, 17, 5)[1:]:
        u, q = solve(a, X, u, q, lambda r, u, q: a.pressure(p, X, u, q, Q, straight=straight, factor=-1, into=r), straight=straight)
    return {"centre": u[0, 2], "volume": a.volume(X, u, q, Q, straight=straight)[0]}


if __name__ == "__main__":
    for name, value in {"hemisphere": hemisphere, "disk": disk}[sys.argv[1]]().items():
        print(name, f"{value:.15e}")
