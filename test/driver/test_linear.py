#!/usr/bin/env python3
"""Linear and buckling steps through the program: stresses of a bent strip, modes as steps of the result file, exit codes."""
import csv
import math
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

try:
    import h5py
    import numpy as np
except ImportError:
    print("h5py is not installed")
    sys.exit(77)

STRIP = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 16, 1 /
&material name = 'm' law = 'linear_elastic' e = 1000.0 nu = 0.0 /
&section thickness = 0.1 /
&monitor name = 'w' quantity = 'displacement' node_set = 'edge_x1' component = 'z' /
&monitor name = 'm' quantity = 'reaction_moment' node_set = 'edge_x0' component = 'y' /
&monitor name = 'energy' quantity = 'energy' /
&output fields = 'stress', 'moment', 'rotation', 'reaction' every = 7 /
"""
CLAMPED = "&support node_set = 'edge_x0' type = 'clamped' /\n"


class Linear(unittest.TestCase):
    def solve(self, text, code=0, start=STRIP):
        """History rows, fields by name (one array per step), what was printed."""
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "strip.nml").write_text(start + text)
            run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "strip.nml"], cwd=folder, capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, code, run.stdout + run.stderr)
            with open(Path(folder) / "strip.history.csv", encoding="utf-8") as file:
                rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
            with h5py.File(Path(folder) / "strip.vtkhdf") as file:
                steps = file["VTKHDF/Steps"].attrs["NSteps"]
                fields = {name: np.split(np.asarray(data), steps) for kind in ("PointData", "CellData")
                          for name, data in file["VTKHDF/" + kind].items() if len(data) % steps == 0}
        return rows, fields, run.stdout + run.stderr

    def test_bent_strip(self):
        # free ends bent by moments: curvature M/(E I) everywhere, however large; ten full turns here
        moment = 0.2 * math.pi * 10 * 1000 * 0.1**3 / 12
        rows, fields, printed = self.solve(CLAMPED + "&support node_set = 'all' fixed = 'rx', 'rz' /\n"
            f"&load type = 'moment' node_set = 'edge_x1' vector = 0.0, {-moment}, 0.0 total = T /\n"
            "&step control = 'linear' /\n&step control = 'linear' load_factor = -0.5 /\n")
        self.assertEqual([row["load_factor"] for row in rows], [1.0, -0.5])
        self.assertAlmostEqual(rows[0]["w"], 0.2 * math.pi * 10 * 10**2 / 2, delta=1e-6)
        self.assertAlmostEqual(rows[0]["m"], moment, delta=1e-9)
        self.assertAlmostEqual(rows[0]["energy"], moment * 20 * math.pi / 2, delta=1e-8)
        for key in ("w", "m"):
            self.assertAlmostEqual(rows[1][key], -0.5 * rows[0][key], delta=1e-8 * abs(rows[0][key]))
        self.assertEqual(len(fields["stress_top"]), 3)
        sigma = 6 * moment / 0.1**2
        np.testing.assert_allclose(fields["stress_top"][1][:, 0], -sigma, rtol=1e-6)
        np.testing.assert_allclose(fields["stress_bottom"][1][:, 0], sigma, rtol=1e-6)
        np.testing.assert_allclose(fields["stress_bottom"][2][:, 0], -0.5 * sigma, rtol=1e-6)
        self.assertAlmostEqual(np.abs(fields["rotation"][1]).max(), 20 * math.pi, delta=1e-8)
        self.assertIn("2 linear solutions", printed)

    def test_modes(self):
        euler = math.pi**2 * 1000 * 0.1**3 / 12 / 10**2 / 4
        load = f"&load type = 'line' edge_set = 'edge_x1' vector = {-euler}, 0.0, 0.0 /\n"
        rows, fields, _ = self.solve(CLAMPED + load + "&step load_factor = 0.1 /\n&step control = 'buckling' modes = 2 /\n"
                                     "&step load_factor = 0.2 /\n")
        modes = [i for i, row in enumerate(rows) if row["load_factor"] > 0.5]
        self.assertEqual(len(modes), 2)
        self.assertEqual([row["increment"] for row in rows], list(range(1, len(rows) + 1)))
        self.assertAlmostEqual(rows[modes[0]]["load_factor"], 1, delta=5e-3)
        self.assertAlmostEqual(rows[modes[1]]["load_factor"], 9, delta=0.1)
        self.assertAlmostEqual(rows[modes[0]]["w"], 1, delta=1e-3)
        self.assertEqual(rows[-1]["load_factor"], 0.2)
        # every mode is in the result file, whatever `every` says; a quarter of a cosine: M = E I (pi/2L)**2 cos at the clamp
        shape = [i for i, u in enumerate(fields["displacement"]) if abs(np.abs(u[:, 2]).max() - 1) < 1e-3]
        self.assertEqual(len(shape), 2)
        moment = 1000 * 0.1**3 / 12 * (math.pi / 20)**2
        self.assertAlmostEqual(np.abs(fields["moment"][shape[0]][:, 0]).max(), moment, delta=0.02 * moment)

    def test_fibres_in_tension(self):
        # a clamped strip pulled, pushed and bent: the fibres that are stretched act, in forces and in recovered fields
        fibres = STRIP.replace("law = 'linear_elastic' e = 1000.0 nu = 0.0",
                               "law = 'holzapfel_gasser_ogden' c = 10.0 k1 = 1000.0 k2 = 1.0 angle = 0.0")
        hold = ("&support node_set = 'edge_x0' fixed = 'ux', 'rz' /\n&support node_set = 'edge_y0' fixed = 'uy' /\n"
                "&support node_set = 'all' fixed = 'uz', 'rx', 'ry' /\n&support node_set = 'edge_x1' fixed = 'rz' ux = 1e-5 /\n")
        rows, fields, printed = self.solve(hold + "&step control = 'linear' load_factor = -1 /\n&step control = 'linear' /\n", start=fibres)
        for step, modulus in ((1, -30), (2, 8030)):
            np.testing.assert_allclose(fields["stress_top"][step][:, 0], modulus * 1e-6, rtol=1e-6)
            self.assertAlmostEqual(rows[step - 1]["energy"], abs(modulus) * 1e-12 / 2, delta=1e-6 * abs(modulus) * 1e-12)
        self.assertIn("fibres act where the linear solution stretches them: found in 2 solutions", printed)
        self.assertIn("1 linear or buckling steps in which fibres act where", printed)
        # a mode bends the fibres that a constant tension has stretched, on both sides
        load = ("&load type = 'line' edge_set = 'edge_x1' vector = -1e-3, 0.0, 0.0 /\n"
                "&load type = 'line' edge_set = 'edge_x1' vector = 1e-6, 0.0, 0.0 constant = T /\n"
                "&support node_set = 'all' fixed = 'uy', 'rx', 'rz' /\n&step control = 'buckling' modes = 1 /\n")
        rows, fields, printed = self.solve(CLAMPED + load, start=fibres)
        stiffness = 8040 * 0.1**3 / 12
        self.assertAlmostEqual(rows[0]["load_factor"] * 1e-3, stiffness * (math.pi / 20)**2, delta=0.01 * stiffness * (math.pi / 20)**2)
        moment = stiffness * (math.pi / 20)**2
        self.assertAlmostEqual(np.abs(fields["moment"][1][:, 0]).max(), moment, delta=0.02 * moment)


if __name__ == "__main__":
    unittest.main()
