#!/usr/bin/env python3
"""Frequency steps through the program: plates, beams, rings and stretched membranes against theory, free bodies, loads, refusals."""
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

# NAFEMS Selected Benchmarks for Natural Frequency Analysis, FV13 (closed form) and FV12 (series), Hz
SUPPORTED = (2.377, 5.942, 5.942, 9.507, 11.884, 11.884, 15.449, 15.449)
FREE = (1.622, 2.36, 2.922, 4.19, 4.19, 7.356, 7.356, 7.668)
PLATE = """&job name = 'v' /
&mesh generator = 'rectangle' lengths = 10, 10 divisions = {0}, {0} /
&material name = 'steel' law = 'linear_elastic' e = 200e9 nu = 0.3 density = 8000 /
&section thickness = 0.05 /
"""
HELD = "&support node_set = 'all' fixed = 'ux', 'uy', 'rz' /\n"
EDGES = HELD + """&support node_set = 'edge_x0' fixed = 'uz', 'rx' /
&support node_set = 'edge_x1' fixed = 'uz', 'rx' /
&support node_set = 'edge_y0' fixed = 'uz', 'ry' /
&support node_set = 'edge_y1' fixed = 'uz', 'ry' /
"""
STRIP = """&job name = 'v' /
&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 32, 2 /
&material name = 'm' law = 'linear_elastic' e = 1000.0 nu = 0.0 density = 2.0 /
&section thickness = 0.1 {} /
&support node_set = 'all' fixed = 'uy', 'rx', 'rz' /
"""


class Frequencies(unittest.TestCase):
    def solve(self, text, code=0, command=("run",)):
        """Rows of NAME.modes.csv, of the history, fields of the result file by name, what was printed."""
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "v.nml").write_text(text)
            run = subprocess.run([os.environ["FINSHELL_BIN"], *command, "v.nml"], cwd=folder, capture_output=True, text=True, check=False)
            printed = run.stdout + run.stderr
            self.assertEqual(run.returncode, code, printed)
            rows = []
            for name in ("v.modes.csv", "v.history.csv"):
                path = Path(folder) / name
                lines = csv.DictReader(path.read_text().splitlines()) if path.exists() else ()
                rows.append([{key: float(value) for key, value in row.items()} for row in lines])
            fields = {}
            if (Path(folder) / "v.vtkhdf").exists():
                with h5py.File(Path(folder) / "v.vtkhdf") as file:
                    steps = file["VTKHDF/Steps"].attrs["NSteps"]
                    fields = {name: np.split(np.asarray(data), steps) for name, data in file["VTKHDF/PointData"].items()}
        return rows[0], rows[1], fields, printed

    def agree(self, modes, reference, tolerance):
        self.assertEqual(len(modes), len(reference))
        for mode, value in zip(modes, reference):
            self.assertAlmostEqual(mode["frequency"] / value, 1, delta=tolerance)

    def test_supported_plate(self):
        modes, history, fields, printed = self.solve(PLATE.format(16) + EDGES + "&step control = 'frequencies' modes = 8 /\n")
        self.agree(modes, SUPPORTED, 0.0075)
        self.assertEqual([row["load_factor"] for row in history], [mode["frequency"] for mode in modes])
        for field in fields["displacement"][1:]:
            self.assertAlmostEqual(float(np.max(np.linalg.norm(field, axis=1))), 1, delta=1e-12)
        self.assertAlmostEqual(modes[0]["mass"], 40000, delta=1e-6)
        self.assertAlmostEqual(modes[0]["generalised_mass"], 10000, delta=200)  # a quarter of the mass
        self.assertAlmostEqual(modes[0]["effective_mass_z"], 40000 * 64 / math.pi**4, delta=300)
        self.assertIn("effective mass along x, y, z", printed)

    def test_free_plate(self):
        # three rigid motions in the held plane, six of a body without any support
        for supports, rigid in ((HELD, 3), ("", 6)):
            modes = self.solve(PLATE.format(16) + supports + f"&step control = 'frequencies' modes = {rigid + 8} /\n")[0]
            for mode in modes[:rigid]:
                self.assertLess(abs(mode["frequency"]), 1e-6 * FREE[0])
            self.agree(modes[rigid:], FREE, 0.0015)
        for name in ("x", "y", "z"):  # the rigid motions carry all of the mass
            self.assertAlmostEqual(sum(mode["effective_mass_" + name] for mode in modes[:6]) / 40000, 1, delta=1e-6)

    def test_masses(self):
        # from below, from above; the deflection between the nodes counts
        errors = {}
        for mass in ("consistent", "lumped", "higher_order"):
            modes = self.solve(PLATE.format(8) + EDGES + f"&step control = 'frequencies' modes = 4 mass = '{mass}' /\n")[0]
            errors[mass] = modes[3]["frequency"] / SUPPORTED[3] - 1
        self.assertGreater(errors["consistent"], 0.05)
        self.assertLess(errors["lumped"], 0)
        self.assertLess(abs(errors["higher_order"]), 0.025)

    def test_rotatory_inertia(self):
        # a supported plate with it: omega^2 = D k^4/(m + I k^2), which is 0.8 % at h k = 0.31
        wave = 2 * (math.pi / 10)**2
        plate = PLATE.format(16).replace("thickness = 0.05", "thickness = 0.7")
        stiffness = 200e9 * 0.7**3 / 12 / (1 - 0.09)
        mass = 8000 * 0.7
        for switch, inertia in (("T", mass * 0.7**2 / 12), ("F", 0)):
            modes = self.solve(plate + EDGES + f"&step control = 'frequencies' modes = 1 rotatory_inertia = {switch} /\n")[0]
            theory = math.sqrt(stiffness * wave**2 / (mass + inertia * wave)) / 2 / math.pi
            self.assertAlmostEqual(modes[0]["frequency"] / theory, 1, delta=0.0025)

    def test_column_under_load(self):
        # f^2 falls linearly with the load and is zero at Euler's; beyond it the straight column is unstable
        ends = "&support node_set = 'edge_x0' fixed = 'ux', 'uz' /\n&support node_set = 'edge_x1' fixed = 'uz' /\n"
        euler = math.pi**2 * 1000 * 0.1**3 / 12 / 100
        load = f"&load type = 'line' edge_set = 'edge_x1' vector = {-euler}, 0, 0 /\n"
        bare = math.sqrt(1000 * 0.1**3 / 12 / (2 * 0.1)) * (math.pi / 10)**2 / 2 / math.pi
        step = "&step load_factor = {} tolerance = 'tight' /\n&step control = 'frequencies' modes = 2 /\n"
        modes = self.solve(STRIP.format("") + ends + load + step.format(0.5) + step.format(0.9) + step.format(1.2))[0]
        self.assertEqual(len(modes), 6)
        for part, mode in ((0.5, modes[0]), (0.9, modes[2]), (1.2, modes[4])):
            square = mode["frequency"] * abs(mode["frequency"])
            self.assertAlmostEqual(square / bare**2, 1 - part, delta=0.004)

    def test_cantilever(self):
        # roots of cosh x cos x = -1
        modes = self.solve(STRIP.format("") + "&support node_set = 'edge_x0' type = 'clamped' /\n"
                           "&step control = 'frequencies' modes = 3 /\n")[0]
        unit = math.sqrt(1000 * 0.1**3 / 12 / (2 * 0.1)) / 100 / 2 / math.pi
        self.agree(modes, [unit * root**2 for root in (1.875104, 4.694091, 7.854757)], 0.002)

    def test_offset(self):
        # a free strip whose nodes lie on its bottom vibrates as any other; of 64 elements the difference is a quarter of this
        straight = self.solve(STRIP.format("") + "&step control = 'frequencies' modes = 7 /\n")[0]
        lifted = self.solve(STRIP.format("offset = 0.05") + "&step control = 'frequencies' modes = 7 /\n")[0]
        for one, other in zip(straight[:6], lifted):
            self.assertAlmostEqual(one["frequency"], other["frequency"], delta=6e-3 * one["frequency"] + 1e-9)

    def test_stretched_membrane(self):
        # f a sqrt(rho/mu) = alpha sqrt(1 - lambda^-6)/(2 pi), whatever is stretched further
        for kind, tolerance in (("type = 'membrane'", 0.004), ("", 0.003)):
            for stretch in (1.1, 3.0):
                text = f"""&job name = 'v' /
&mesh generator = 'disk' radius = 1 rings = 16 core = 5 portion = 'full' /
&material name = 'rubber' law = 'neo_hookean' mu = 1 density = 1 /
&section thickness = 1e-3 {kind} /
&support node_set = 'rim' ux = {stretch - 1} uy = 0 uz = 0 axes = 'cylindrical' axis = 0, 0, 1 /
&step tolerance = 'tight' /
&step control = 'frequencies' modes = 1 near = {{}} /
"""
                for alpha in (2.40482556, 3.83170597):
                    theory = alpha * math.sqrt(1 - stretch**-6) / 2 / math.pi
                    modes = self.solve(text.format(theory))[0]
                    self.assertAlmostEqual(modes[0]["frequency"] / theory, 1, delta=tolerance)

    def test_free_ring(self):
        # in its plane: n (n^2 - 1)/sqrt(n^2 + 1) sqrt(E I/(m R^4)), twice each
        text = """&job name = 'v' /
&mesh generator = 'cylinder' radius = 1.0 length = 0.1 angles = 0, 360 divisions = 64, 1 /
&material name = 'm' law = 'linear_elastic' e = 1e6 nu = 0.0 density = 1.0 /
&section thickness = 0.01 /
&support node_set = 'all' fixed = 'uy', 'rx', 'rz' /
&step control = 'frequencies' modes = 7 /
"""
        modes = self.solve(text)[0]
        unit = math.sqrt(1e6 * 0.01**2 / 12) / 2 / math.pi
        for mode in modes[:3]:
            self.assertLess(abs(mode["frequency"]), 1e-6 * unit)
        self.agree(modes[3:], [n * (n**2 - 1) / math.sqrt(n**2 + 1) * unit for n in (2, 2, 3, 3)], 0.004)

    def test_free_sphere(self):
        # spheroidal modes of two nodal circles, five at one frequency; membrane theory (Baker 1961, eq. 33; Lamb 1882)
        text = """&job name = 'v' /
&mesh generator = 'sphere' radius = 2.0 colatitudes = 0, 180 azimuths = 0, 360 divisions = 40, 20 /
&material name = 'm' law = 'linear_elastic' e = 9.0 nu = 0.3 density = 4.0 /
&section thickness = 0.01 /
&step control = 'frequencies' modes = 11 /
"""
        modes = self.solve(text)[0]
        unit = math.sqrt(9 / 4 / (1 - 0.3**2)) / 2 / 2 / math.pi
        first = math.sqrt((7.9 - math.sqrt(7.9**2 - 4 * 4 * (1 - 0.3**2))) / 2)
        for mode in modes[:6]:
            self.assertLess(abs(mode["frequency"]), 1e-6 * unit)
        self.agree(modes[6:], [unit * first] * 5, 0.004)

    def test_study(self):
        printed = self.solve(PLATE.format(8) + EDGES + "&step control = 'frequencies' modes = 1 /\n", command=("study", "-q"))[3]
        self.assertIn("Monitor frequency: limit 2.37", printed)

    def test_refusals(self):
        steps = "&step control = 'frequencies' {} /\n"
        for text, code, expected in (
                (PLATE.format(4).replace("density = 8000", "") + EDGES + steps.format(""), 2, "v.nml:10: &step: frequencies: section 1 has no mass"),
                (PLATE.format(4) + EDGES + steps.format("mass = 'all'"), 2, "higher_order, consistent, lumped"),
                (PLATE.format(4) + EDGES + steps.format("near = -2"), 2, "near"),
                (PLATE.format(4) + EDGES + steps.format("load_factor = 2"), 2, "load_factor"),
                (PLATE.format(4) + HELD + steps.format("") + "&step control = 'linear' /\n", 2, "rigid-body motion"),
                (PLATE.format(4) + EDGES + "&load type = 'pressure' pressure = 1 constant = T /\n" + steps.format(""), 2,
                 "the constant loads do not act yet")):
            self.assertIn(expected, self.solve(text, code)[3])


if __name__ == "__main__":
    unittest.main()
