#!/usr/bin/env python3
"""Sheets whose edges are moved while the drilling rotations are left free: a constant stress is exact on any mesh."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

try:
    import h5py
    import numpy as np
except ImportError:
    h5py = None

DATA = Path(os.environ["FINSHELL_SOURCE_DIR"]) / "test" / "data"
RANDOM = """&node_set name = 'x0' x = 0.0 /
&node_set name = 'x1' x = 1.0 /
&node_set name = 'y0' y = 0.0 /
&node_set name = 'y1' y = 1.0 /
&material name = 'm' law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0 /
&section material = 'm' thickness = 0.01 /
&support node_set = 'all' fixed = 'uz', 'rx', 'ry' /
&monitor name = 'F' quantity = 'reaction' component = 'x' node_set = 'x1' /
&monitor name = 'N' quantity = 'membrane_force' component = '11' /
&output fields = 'membrane_force' every = 1 /
"""
GRIP = """&material name = 'm' law = 'linear_elastic' e = 1000 nu = 0.3 /
&section thickness = 0.1 /
&support node_set = 'l' fixed = 'ux', 'uz', 'rx', 'ry', 'rz' /
&support node_set = 'b' fixed = 'uy', 'uz', 'rx', 'ry', 'rz' /
&support node_set = 'r' ux = 1e-4 fixed = 'uz' /
&step tolerance = 'tight' /
&monitor name = 'R' quantity = 'reaction' component = 'x' node_set = 'r' /
&output fields = 'stress', 'membrane_force' /
"""
LOADED = """&material name = 'm' law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0 /
&section thickness = 0.01 /
&support node_set = 'l' fixed = 'ux' /
&support node_set = 'b' fixed = 'uy' /
&support node_set = 'all' fixed = 'uz', 'rx', 'ry' /
&load type = 'line' edge_set = 'r' vector = 3.15, 0, 0 /
&step tolerance = 'tight' /
&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'r' /
&output fields = 'membrane_force' /
"""


class Drilling(unittest.TestCase):
    def solve(self, mesh, text):
        """Last row of the history, and a field of the last increment."""
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "in.nml").write_text(f"&mesh file = '{DATA / mesh}' /\n" + text)
            run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "in.nml"], cwd=folder, capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            row = {k: float(v) for k, v in list(csv.DictReader((Path(folder) / "in.history.csv").read_text().splitlines()))[-1].items()}
            fields = {}
            if h5py:
                with h5py.File(Path(folder) / "in.vtkhdf") as file:
                    steps = file["VTKHDF/Steps"].attrs["NSteps"]
                    fields = {k: np.split(np.asarray(v), steps)[-1] for k, v in file["VTKHDF/CellData"].items()}
        return row, fields

    def even(self, values, message):
        """All elements have the same."""
        np.testing.assert_allclose(values, np.broadcast_to(values.mean(axis=0), values.shape), atol=1e-8 * np.abs(values).max(),
                                   err_msg=message)

    def test_grip(self):
        row, fields = self.solve("grip.msh", GRIP)
        self.assertAlmostEqual(row["R"], 0.0100015, delta=1e-7)
        if fields:
            np.testing.assert_allclose(fields["stress_middle"][:, 0], 0.1, rtol=3e-4)
            self.even(fields["stress_middle"], "grip")

    def test_stretched_to_the_double(self):
        held = "&support node_set = 'x0' fixed = 'ux', 'rz' /\n&support node_set = 'y0' fixed = 'uy' /\n&support node_set = 'x1' ux = 1.0 /\n"
        row, fields = self.solve("drilling_free_random.msh", RANDOM + held + "&step tolerance = 'tight' /\n")
        stretch, c10, c01 = 2.0, 80.0, 20.0
        force = 2 * 0.01 * (c10 + c01 / stretch) * (stretch - stretch**-2)
        self.assertAlmostEqual(row["F"] / force, 1, delta=1e-8)
        if fields:
            self.even(fields["membrane_force"], "uniaxial")

    def test_line_load(self):
        # an edge pulled by a line load, large strain: the load brings the moments that the drilling rotations need. The last
        # increment arrives on an unstable branch from along the tangent (u = 1.00045), and is tried again from the chord.
        row, fields = self.solve("grip.msh", LOADED)
        self.assertAlmostEqual(row["u"], 1, delta=1e-8)
        if fields:
            self.even(fields["membrane_force"], "line load")

    def test_other_states(self):
        # biaxial, and sheared by edges that are moved along themselves; nothing holds the drilling rotations
        for name, held in {
            "biaxial": "&support node_set = 'x0' fixed = 'ux' /\n&support node_set = 'y0' fixed = 'uy' /\n"
                       "&support node_set = 'x1' ux = 0.8 /\n&support node_set = 'y1' uy = 0.4 /\n",
            "clamped ends": "&support node_set = 'x0', 'x1', 'y0', 'y1' fixed = 'uy' /\n&support node_set = 'x0' fixed = 'ux' /\n"
                            "&support node_set = 'x1' ux = 0.8 /\n",
        }.items():
            _, fields = self.solve("drilling_free_random.msh", RANDOM + held + "&step tolerance = 'tight' /\n")
            if fields:
                self.even(fields["membrane_force"], name)


if __name__ == "__main__":
    unittest.main()
