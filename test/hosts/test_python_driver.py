#!/usr/bin/env python3
"""Cantilever, pinched hemisphere and balloon through the Python package and scipy.sparse, against the driver on the same mesh, to 1e-6."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
sys.path[:0] = [str(SOURCE / "api" / "python"), str(SOURCE / "api" / "python" / "examples")]
try:
    import h5py
    import numpy as np
    import scipy.sparse.linalg
except ImportError as missing:
    print(missing)
    sys.exit(77)
import cantilever
import finshell

CANTILEVER = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 16, 1 /
&material name = 'm' law = 'st_venant_kirchhoff' e = 1.2e6 nu = 0.0 /
&section material = 'm' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'force' node_set = 'edge_x1' vector = 0.0, 0.0, 2.0 /
&step load_factor = 1.0 tolerance = 'tight' mixed = .true. /
"""
HEMISPHERE = """&mesh generator = 'sphere' radius = 10.0 colatitudes = 18.0, 90.0 azimuths = 0.0, 90.0 divisions = 8, 8 normals = '{normals}' /
&material name = 'm' law = 'st_venant_kirchhoff' e = 6.825e7 nu = 0.3 /
&section material = 'm' thickness = 0.04 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'corner_a0_bottom' fixed = 'uz' /
&load type = 'force' node_set = 'corner_a0_bottom' vector = 200.0, 0.0, 0.0 /
&load type = 'force' node_set = 'corner_a1_bottom' vector = 0.0, -200.0, 0.0 /
&step load_factor = 1.0 tolerance = 'tight' mixed = .true. /
"""
BALLOON = """&mesh generator = 'sphere' radius = 10.0 colatitudes = 18.0, 90.0 azimuths = 0.0, 90.0 divisions = 4, 4 normals = '{normals}' /
&material name = 'm' law = 'neo_hookean' mu = 1.0e6 /
&section material = 'm' thickness = 0.4 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'edge_bottom' fixed = 'uz' /
&load type = 'pressure' pressure = 3.0e4 /
&step load_factor = 1.0 tolerance = 'tight' /
"""


def driver(text):
    """Nodes, triangles and final displacements of a run of the driver."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "model.nml").write_text(text)
        subprocess.run([os.environ["FINSHELL_BIN"], "run", "--quiet", "model.nml"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        with h5py.File(Path(folder) / "model.vtkhdf") as file:
            nodes = np.asarray(file["VTKHDF/Points"])
            triangles = np.asarray(file["VTKHDF/Connectivity"]).reshape(-1, 3)
            return nodes, triangles, np.asarray(file["VTKHDF/PointData/displacement"])[-len(nodes):]


class SameAsDriver(unittest.TestCase):
    def compare(self, text, section, fixed, load, steps, curved=False):
        nodes, triangles, expected = driver(text)
        held = np.zeros((len(nodes), 6), dtype=bool)
        force = np.zeros((len(nodes), 6))
        fixed(nodes, held)
        load(nodes, force)
        # a sphere about the origin: positions are normals
        shell = cantilever.Shell(section, nodes, triangles, held, nodes[triangles] if curved else None)
        for step in range(1, steps + 1):
            residuals = cantilever.solve(shell, force * step / steps, tolerance=1e-8)
        self.assertLess(np.abs(shell.u - expected).max(), 1e-6 * np.abs(expected).max())
        # quadratic at the end, down to rounding
        self.assertLess(residuals[-1], max(1e3 * residuals[-2] ** 2, 1e-8))

    def test_cantilever(self):
        def fixed(x, held):
            held[x[:, 0] == 0] = True

        def load(x, force):
            force[x[:, 0] == x[:, 0].max(), 2] = 2.0

        self.compare(CANTILEVER, finshell.Section("st_venant_kirchhoff", {"e": 1.2e6, "nu": 0.0}, 0.1), fixed, load, 10)

    def test_hemisphere(self):
        def corner(x, axis):
            return np.argmin(np.linalg.norm(x - 10.0 * np.eye(3)[axis], axis=1))

        def fixed(x, held):
            for axis in (0, 1):
                plane = np.abs(x[:, axis]) < 1e-9
                held[np.ix_(plane, [axis] + [3 + k for k in range(3) if k != axis])] = True
            held[corner(x, 0), 2] = True

        def load(x, force):
            force[corner(x, 0), 0] = 200.0
            force[corner(x, 1), 1] = -200.0

        section = finshell.Section("st_venant_kirchhoff", {"e": 6.825e7, "nu": 0.3}, 0.04)
        for normals in ("facet", "exact"):
            with self.subTest(normals=normals):
                self.compare(HEMISPHERE.format(normals=normals), section, fixed, load, 10, curved=normals == "exact")

    def test_balloon(self):
        """Pressure on the curved surface; the drilling rotations of the rim are free, so its sides are straight."""
        section = finshell.Section("neo_hookean", {"mu": 1e6}, 0.4)
        for normals in ("facet", "exact"):
            nodes, triangles, expected = driver(BALLOON.format(normals=normals))
            held = np.zeros((len(nodes), 6), dtype=bool)
            on = np.abs(nodes) < 1e-9
            held[np.ix_(on[:, 1], [1, 3, 5])] = held[np.ix_(on[:, 0], [0, 4, 5])] = held[on[:, 2], 2] = True
            shell = cantilever.Shell(section, nodes, triangles, held, nodes[triangles] if normals == "exact" else None)
            straight = on[triangles, 2] & on[np.roll(triangles, -1, axis=1), 2]
            for pressure in (1e4, 2e4, 3e4):
                for _ in range(12):
                    motion = shell.X, shell.u, shell.q, finshell.Rotation.QUATERNION
                    out = shell.assembly.evaluate(*motion, normals=shell.normals, straight=straight)
                    shell.assembly.pressure(pressure, *motion, normals=shell.normals, factor=-1.0, into=out)
                    correction = shell.assembly.to_nodes(scipy.sparse.linalg.spsolve(out.matrix.tocsc(), -shell.assembly.to_rows(out.force)))
                    shell.move(correction)
                    if np.abs(correction).max() < 1e-10:
                        break
                self.assertLess(np.abs(correction).max(), 1e-10)
            self.assertLess(np.abs(shell.u - expected).max(), 1e-6 * np.abs(expected).max(), msg=normals)


if __name__ == "__main__":
    unittest.main()
