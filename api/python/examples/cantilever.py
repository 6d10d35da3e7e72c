"""A cantilever bent by an end shear force, into large rotations: finshell for the elements, scipy.sparse for the rest.

Length 10, width 1, thickness 0.1, E = 1.2e6, nu = 0, force 4 (Sze, Liu & Lo, Finite Elem. Anal. Des. 40 (2004) 1551-1569). The
exact solution of the elastica is a tip displacement of 3.2893 along the beam and 6.6999 across it.

    python cantilever.py [elements along the length]
"""
from __future__ import annotations

import sys
from typing import List, Optional, Tuple

import finshell
import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

LENGTH, WIDTH, THICKNESS, YOUNG, FORCE = 10.0, 1.0, 0.1, 1.2e6, 4.0


def strip(along: int, across: int) -> Tuple[np.ndarray, np.ndarray]:
    """Nodes (n, 3) and triangles (m, 3) of the strip, the diagonals alternating."""
    x, y = np.meshgrid(np.linspace(0, LENGTH, along + 1), np.linspace(0, WIDTH, across + 1), indexing="ij")
    nodes = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    triangles = []
    for i in range(along):
        for j in range(across):
            a = i * (across + 1) + j
            b, c, d = a + across + 1, a + across + 2, a + 1
            triangles += [[a, b, c], [a, c, d]] if (i + j) % 2 else [[a, b, d], [b, c, d]]
    return nodes, np.array(triangles)


class Shell:
    """A mesh of one section, its state (displacements, quaternions), and its equations: six per node."""

    def __init__(self, section: finshell.Section, nodes: np.ndarray, triangles: np.ndarray,
                 normals: Optional[np.ndarray] = None) -> None:
        self.section, self.triangles, self.X, self.normals = section, triangles, nodes[triangles], normals
        self.u = np.zeros((len(nodes), 3))
        self.q = np.tile([1.0, 0.0, 0.0, 0.0], (len(nodes), 1))
        self.dofs = (6 * triangles[:, :, None] + np.arange(6)).reshape(-1, 18)
        self.rows = np.repeat(self.dofs, 18, axis=1).ravel()
        self.columns = np.tile(self.dofs, (1, 18)).ravel()

    def equations(self) -> Tuple[np.ndarray, sparse.csc_matrix]:
        """Internal force and tangent at the present state."""
        r = self.section.evaluate(self.X, self.u[self.triangles], self.q[self.triangles], finshell.Rotation.QUATERNION,
                                  normals=self.normals)
        n = 6 * len(self.u)
        force = np.bincount(self.dofs.ravel(), r.force.ravel(), n)
        return force, sparse.coo_matrix((r.tangent.ravel(), (self.rows, self.columns)), (n, n)).tocsc()

    def move(self, correction: np.ndarray) -> None:
        """Add displacements, and turn the nodes by the spins of a correction (nodes, 6)."""
        self.u = self.u + correction[:, :3]
        self.q = finshell.update(self.q, correction[:, 3:])


def solve(shell: Shell, load: np.ndarray, free: np.ndarray, tolerance: float = 1e-7) -> List[float]:
    """Newton's iteration for one load; the relative residuals. The largest spin of a correction is limited to 0.4."""
    residuals = []
    for _ in range(100):
        force, tangent = shell.equations()
        residual = (load - force)[free]
        residuals.append(float(np.linalg.norm(residual) / np.linalg.norm(load)))
        if residuals[-1] < tolerance:
            return residuals
        correction = np.zeros(load.size)
        correction[free] = splu(tangent[free][:, free]).solve(residual)
        correction = correction.reshape(-1, 6)
        spin = np.abs(correction[:, 3:]).max()
        shell.move(correction * min(1.0, 0.4 / spin))
    raise RuntimeError(f"no convergence: residuals {residuals[-3:]}")


def cantilever(along: int, steps: int = 10) -> Tuple[np.ndarray, List[List[float]]]:
    """Mean displacement of the tip at the full load, and the residuals of all steps."""
    section = finshell.Section("linear_elastic", {"e": YOUNG, "nu": 0.0}, THICKNESS)
    across = max(1, along // 10)
    nodes, triangles = strip(along, across)
    shell = Shell(section, nodes, triangles)
    free = np.flatnonzero(np.repeat(nodes[:, 0] > 0, 6))
    tip = np.flatnonzero(nodes[:, 0] == LENGTH)
    share = np.ones(len(tip))
    share[[0, -1]] = 0.5  # the force is distributed along the edge
    load = np.zeros((len(nodes), 6))
    history = []
    for step in range(1, steps + 1):
        load[tip, 2] = FORCE * step / steps * share / share.sum()
        history.append(solve(shell, load.ravel(), free))
    return share @ shell.u[tip] / share.sum(), history


if __name__ == "__main__":
    displacement, log = cantilever(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
    for number, iterations in enumerate(log, 1):
        print(f"step {number}: " + " ".join(f"{r:.1e}" for r in iterations))
    print(f"tip: {-displacement[0]:.4f} along, {displacement[2]:.4f} across (elastica: 3.2893, 6.6999)")
