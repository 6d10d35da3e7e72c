"""What normals are worth: the pinched hemisphere, linear, on an irregular mesh of flat facets and of curved elements.

Radius 10, thickness 0.04, E = 6.825e7, nu = 0.3, a hole of 18 degrees; one quarter, force 1 outwards and inwards at the two points of
its rim (MacNeal & Harder, Finite Elem. Anal. Des. 1 (1985) 3-20). Converged, the displacement under the force is 0.0935.

    python hemisphere.py [cells along a side]
"""
from __future__ import annotations

import sys
from typing import Tuple

import finshell
import numpy as np
from cantilever import Shell
from scipy.sparse.linalg import splu

RADIUS, THICKNESS, YOUNG, POISSON = 10.0, 0.04, 6.825e7, 0.3


def quarter(cells: int, moved: float = 0.25) -> Tuple[np.ndarray, np.ndarray]:
    """Nodes and triangles, counter-clockwise seen from outside; nodes inside are moved by a share of a cell."""
    i, j = np.meshgrid(np.arange(cells + 1), np.arange(cells + 1), indexing="ij")
    inside = (i % cells > 0) & (j % cells > 0)
    shift = moved * np.random.default_rng(1).uniform(-1, 1, (2, *i.shape)) * inside
    azimuth = np.radians(90 * (i + shift[0]) / cells)
    colatitude = np.radians(90 - 72 * (j + shift[1]) / cells)
    nodes = RADIUS * np.stack([np.sin(colatitude) * np.cos(azimuth), np.sin(colatitude) * np.sin(azimuth), np.cos(colatitude)], -1)
    a = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    b, c, d = a + cells + 1, a + cells + 2, a + 1
    return nodes.reshape(-1, 3), np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])


def deflection(cells: int, curved: bool) -> float:
    """Displacement under the force."""
    nodes, triangles = quarter(cells)
    section = finshell.Section("linear_elastic", {"e": YOUNG, "nu": POISSON}, THICKNESS)
    held = np.zeros((len(nodes), 6), dtype=bool)
    held[np.abs(nodes[:, 1]) < 1e-9] |= [False, True, False, True, False, True]  # planes of symmetry
    held[np.abs(nodes[:, 0]) < 1e-9] |= [True, False, False, False, True, True]
    pulled, pushed = 0, cells * (cells + 1)
    held[pulled, 2] = True
    load = np.zeros((len(nodes), 6))
    load[pulled, 0], load[pushed, 1] = 1.0, -1.0
    # the normals of a sphere about the origin; their length does not matter
    shell = Shell(section, nodes, triangles, held, nodes[triangles] if curved else None)
    u = splu(shell.equations().matrix.tocsc()).solve(shell.assembly.to_rows(load))
    return float(shell.assembly.to_nodes(u)[pulled, 0])


if __name__ == "__main__":
    size = int(sys.argv[1]) if len(sys.argv) > 1 else 8
    print(f"{size} x {size} cells, irregular: {deflection(size, False):.5f} with facets, {deflection(size, True):.5f} with normals "
          "(converged: 0.0935)")
