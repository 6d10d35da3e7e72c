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
    """A mesh of one section, its state (displacements, quaternions), and its assembly."""

    def __init__(self, section: finshell.Section, nodes: np.ndarray, triangles: np.ndarray, held: np.ndarray,
                 normals: Optional[np.ndarray] = None) -> None:
        self.assembly = finshell.Assembly(triangles, section, held=held)
        self.X, self.normals = nodes, normals
        self.u = np.zeros((len(nodes), 3))
        self.q = np.tile([1.0, 0.0, 0.0, 0.0], (len(nodes), 1))

    def equations(self) -> finshell.Assembled:
        """Internal forces and tangent at the present state."""
        return self.assembly.evaluate(self.X, self.u, self.q, finshell.Rotation.QUATERNION, normals=self.normals)

    def move(self, correction: np.ndarray) -> None:
        """Add displacements, and turn the nodes by the spins of a correction (nodes, 6)."""
        self.u = self.u + correction[:, :3]
        self.q = finshell.update(self.q, correction[:, 3:])


def solve(shell: Shell, load: np.ndarray, tolerance: float = 1e-7) -> List[float]:
    """Newton's iteration for one load (nodes, 6); the relative residuals. The largest spin of a correction is limited to 0.4."""
    residuals = []
    for _ in range(100):
        r = shell.equations()
        residual = shell.assembly.to_rows(load - r.force)
        residuals.append(float(np.linalg.norm(residual) / np.linalg.norm(load)))
        if residuals[-1] < tolerance:
            return residuals
        correction = shell.assembly.to_nodes(splu(r.matrix.tocsc()).solve(residual))
        shell.move(correction * min(1.0, 0.4 / np.abs(correction[:, 3:]).max()))
    raise RuntimeError(f"no convergence: residuals {residuals[-3:]}")


def cantilever(along: int, steps: int = 10) -> Tuple[np.ndarray, List[List[float]]]:
    """Mean displacement of the tip at the full load, and the residuals of all steps."""
    section = finshell.Section("linear_elastic", {"e": YOUNG, "nu": 0.0}, THICKNESS)
    across = max(1, along // 10)
    nodes, triangles = strip(along, across)
    shell = Shell(section, nodes, triangles, np.repeat(nodes[:, 0] == 0, 6).reshape(-1, 6))
    tip = np.flatnonzero(nodes[:, 0] == LENGTH)
    share = np.ones(len(tip))
    share[[0, -1]] = 0.5  # the force is distributed along the edge
    load = np.zeros((len(nodes), 6))
    history = []
    for step in range(1, steps + 1):
        load[tip, 2] = FORCE * step / steps * share / share.sum()
        history.append(solve(shell, load))
    return share @ shell.u[tip] / share.sum(), history


if __name__ == "__main__":
    displacement, log = cantilever(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
    for number, iterations in enumerate(log, 1):
        print(f"step {number}: " + " ".join(f"{r:.1e}" for r in iterations))
    print(f"tip: {-displacement[0]:.4f} along, {displacement[2]:.4f} across (elastica: 3.2893, 6.6999)")
