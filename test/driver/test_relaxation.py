#!/usr/bin/env python3
"""Static states through motion: control = 'relax', the fallback of load control, and stabilised steps."""
import csv
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

QUARTER = """&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&output fields = 'displacement' every = 0 /
"""

AIRBAG = """! Quarter of one side of a flat square bag, diagonal 1.2 m, 0.6 mm; the rim slides in its plane and turns.
&mesh generator = 'rectangle' lengths = 0.4242640687, 0.4242640687 divisions = {n}, {n} /
&material name = 'm' law = 'st_venant_kirchhoff' e = 588e6 nu = 0.4 /
&section thickness = 0.6e-3 {section} /
&support node_set = 'edge_x1', 'edge_y1' fixed = 'uz' /
&load type = 'pressure' pressure = 5000 /
&step {step} /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_x0_y0' /
""" + QUARTER

PILLOW = """! Quarter of one side of a flat square pillow; the rim slides in its plane.
&mesh generator = 'rectangle' lengths = 100, 100 divisions = {n}, {n} /
&material name = 'm' law = 'linear_elastic' e = 200 nu = 0.3 /
&section thickness = 0.5 /
&support node_set = 'edge_x1', 'edge_y1' fixed = 'uz', 'rx', 'ry' /
&load type = 'pressure' pressure = 0.01 /
&step {step} /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_x0_y0' /
""" + QUARTER

LEAFLET = """! A leaflet of a valve under closing pressure, of a fibre law without stiffness at rest: a cylindrical panel turns inside out.
&mesh generator = 'cylinder' radius = 12 length = 12 angles = -60, 60 divisions = 24, 16 /
&material name = 't' law = 'exponential_fibre' c0 = 0.12 c1 = 15 c2 = 55 /
&section thickness = 0.4 direction_axis = 0, 1, 0 /
&support node_set = 'edge_y0', 'edge_a0', 'edge_a1' type = 'hinged' /
&load type = 'pressure' pressure = -4 /
&step {step} /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'mid_y1' /
&output every = 0 /
"""

# A balloon of two disks that hardly stretch (radius 1), of cloth.
MYLAR = """&mesh generator = 'disk' portion = 'quarter' radius = 1 rings = {n} /
&material name = 'm' law = 'st_venant_kirchhoff' e = 5e9 nu = 0.3 /
&section type = 'membrane' wrinkling = .true. thickness = 1e-4 /
&support node_set = 'rim' fixed = 'uz' /
&load type = 'pressure' pressure = 500 /
&step {step} /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /
""" + QUARTER

ROOF = """! Hinged roof under a force at its centre, which snaps through at 0.74.
&mesh generator = 'cylinder' radius = 2540 length = 254 angles = 0, 5.729577951308232 divisions = 8, 8 /
&material name = 'elastic' law = 'linear_elastic' e = 3102.75 nu = 0.3 /
&section thickness = 12.7 /
&support node_set = 'edge_a1' fixed = 'ux', 'uy', 'uz', 'rx', 'rz' /
&support node_set = 'edge_a0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'force' node_set = 'corner_a0_y0' vector = 0, 0, -750 /
&step {step} /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_a0_y0' factor = -1 /
&output every = 0 /
"""


class Relaxation(unittest.TestCase):
    def solve(self, text, code=0):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "in.nml").write_text(text)
            run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "in.nml"], cwd=folder, capture_output=True, text=True, check=False,
                                 timeout=200, env=dict(os.environ, OMP_NUM_THREADS="1"))
            self.assertEqual(run.returncode, code, text + run.stdout + run.stderr)
            self.said = run.stdout + run.stderr
            history = Path(folder) / "in.history.csv"
            if not history.exists():
                return []
            return [{k: float(v) for k, v in r.items()} for r in csv.DictReader(history.read_text().splitlines())]

    def relaxed(self, text, levels=1):
        """One row a level, each found by relaxation, the last at full load, in equilibrium and stable as far as pivots are known."""
        rows = self.solve(text)
        self.assertEqual([r["found_by"] for r in rows], [2.0] * levels)
        self.assertEqual(rows[-1]["load_factor"], 1)
        self.assertLessEqual(rows[-1]["negative_pivots"], 0)
        self.assertLess(rows[-1]["residual"], 5e-3)
        self.assertLess(rows[-1]["correction"], 1e-2)
        return rows[-1]["w"]

    def test_airbag(self):
        # With a membrane that wrinkles without stiffness 0.2165; a shell has the wrinkles that its mesh can show.
        for n, delta in ((8, 0.08), (16, 0.06), (24, 0.06)):
            w = self.relaxed(AIRBAG.format(n=n, section="", step="control = 'relax'"))
            self.assertAlmostEqual(w / 0.2165, 1, delta=delta, msg=str(n))
        w = self.relaxed(AIRBAG.format(n=16, section="type = 'membrane' wrinkling = .true.", step="control = 'relax'"))
        self.assertAlmostEqual(w / 0.2165, 1, delta=0.02)

    def test_pillow(self):
        for n, delta in ((10, 0.06), (20, 0.02), (30, 0.02)):
            self.assertAlmostEqual(self.relaxed(PILLOW.format(n=n, step="control = 'relax'")) / 47.3, 1, delta=delta, msg=str(n))

    def test_levels(self):
        self.assertAlmostEqual(self.relaxed(PILLOW.format(n=10, step="control = 'relax' load_levels = 0.1, 0.4"), levels=3), 46, delta=0.7)

    def test_leaflet(self):
        w = self.relaxed(LEAFLET.format(step="control = 'relax'"))
        self.assertAlmostEqual(w, self.solve(LEAFLET.format(step=""))[-1]["w"], delta=0.02)

    def test_sheared_sheet(self):
        """A square sheet, sheared and a little stretched: as it becomes thinner its energy over the thickness falls to that of the tension field,
        its wrinkles run along the tension and become shorter (as the root of the thickness)."""
        model = """&job name = 'in' /
&mesh generator = 'rectangle' lengths = 1, 1 divisions = 24, 24 diagonal = 'alternating' /
&material name = 'm' law = 'linear_elastic' e = 1000.0 nu = 0.3 /
&section thickness = {0} {1} /
&support node_set = 'edge_y0' type = 'clamped' /
&support node_set = 'edge_y1' ux = 0.01 uy = 0.001 fixed = 'uz' {2} /
&load type = 'traction' vector = 0, 0, {3} constant = .true. /
&step control = 'relax' /
&monitor name = 'E' quantity = 'energy' /
"""
        energies, directions, changes = [], [], []
        for h, kind in ((1e-3, "type = 'membrane' wrinkling = .true."), (3e-3, ""), (1.5e-3, "")):
            text = model.format(h, kind, "" if kind else ", 'rx', 'ry', 'rz'", 1e-4 * h)
            with tempfile.TemporaryDirectory() as folder:
                (Path(folder) / "in.nml").write_text(text)
                subprocess.run([os.environ["FINSHELL_BIN"], "run", "-q", "in.nml"], cwd=folder, check=True, capture_output=True, timeout=200)
                rows = list(csv.DictReader((Path(folder) / "in.history.csv").read_text().splitlines()))
                with h5py.File(Path(folder) / "in.vtkhdf") as file:
                    x = file["VTKHDF/Points"][:625]
                    u = file["VTKHDF/PointData/displacement"][-625:]
            energies.append(float(rows[-1]["E"]) / h)
            grid = np.zeros((25, 25, 3))
            grid[np.rint(24 * x[:, 0]).astype(int), np.rint(24 * x[:, 1]).astype(int)] = u
            along = np.stack(np.gradient(grid, 1 / 24, axis=(0, 1)))[:, 6:-6, 6:-6]
            if kind:
                strain = along.mean((1, 2))[:, :2]
                direction = np.linalg.eigh(strain + strain.T + strain @ strain.T)[1][:, 1]
            else:
                direction = np.linalg.eigh(np.einsum("aij,bij->ab", along[..., 2], along[..., 2]))[1][:, 0]
                across = np.array([grid[i, 24 - i, 2] for i in range(2, 23)])
                changes.append(np.sum(np.diff(np.sign(across)) != 0))
            directions.append(np.degrees(np.arctan2(direction[1], direction[0])) % 180)
        excess = [e / energies[0] - 1 for e in energies[1:]]
        self.assertLess(excess[0], 0.25)
        self.assertGreater(excess[1], 0)
        self.assertLess(excess[1], 0.75 * excess[0])
        for direction in directions[1:]:
            self.assertAlmostEqual(direction, directions[0], delta=4)
        self.assertGreater(changes[1], changes[0])

    def test_fallback(self):
        # Without stretch the height is 0.4569, with it a little more (Eh = 5e5, tension near the pole 250).
        text = MYLAR.format(n=16, step="maximum_cuts = 0 {}")
        self.solve(text.format("fallback = .false."), code=1)
        self.assertNotIn("relaxation", self.said)
        self.solve(text.format("snap = 'refuse'"), code=1)
        rows = self.solve(text.format(""))
        self.assertEqual([r["found_by"] for r in rows], [2.0])
        self.assertAlmostEqual(rows[-1]["w"] / 0.4569, 1, delta=0.02)
        self.assertIn("found by dynamic relaxation in ", self.said)
        self.assertIn("1 increments were found by dynamic relaxation", self.said)

    def test_snap(self):
        """Behind the limit point the state on the far branch, as arc-length finds it."""
        far = self.solve(ROOF.format(step="control = 'arc_length' load_levels = 1 node_set = 'corner_a0_y0' component = 'z' displacements = -29.4"))
        at = next(r["w"] for r in far if r["load_factor"] == 1)
        w = self.relaxed(ROOF.format(step="control = 'relax'"))
        self.assertAlmostEqual(w, at, delta=0.02)
        self.assertAlmostEqual(w, self.solve(ROOF.format(step=""))[-1]["w"], delta=0.01)

    def test_stabilised(self):
        plain = self.solve(ROOF.format(step=""))
        for switch in (".true.", "1e-2"):
            rows = self.solve(ROOF.format(step=f"stabilise = {switch}"))
            self.assertAlmostEqual(rows[-1]["w"], plain[-1]["w"], delta=0.01)
            self.assertGreater(rows[-1]["stabilisation"], 0)
            self.assertLess(rows[-1]["stabilisation"], 0.05)
            self.assertIn("Stabilisation took", self.said)
        self.assertEqual(max(r["stabilisation"] for r in plain), 0)

    def test_end_is_free_of_damping(self):
        """On a smooth path the end of a stabilised step is that of another one, to the tolerance."""
        step = "tolerance = 'tight' load_factor = 0.5"
        plain = self.solve(ROOF.format(step=step))[-1]["w"]
        self.assertAlmostEqual(self.solve(ROOF.format(step=step + " stabilise = 0.05"))[-1]["w"] / plain, 1, delta=1e-6)

    def test_refused(self):
        for step, said in (("control = 'arc_length' stabilise = .true.", "only steps with control = 'load' can be stabilised"),
                           ("control = 'relax' fallback = .true.", "has nothing to fall back on"),
                           ("stabilise = -1", "stabilise"), ("stabilise = 'much'", "stabilise")):
            self.solve(PILLOW.format(n=4, step=step), code=2)
            self.assertIn(said, self.said)


if __name__ == "__main__":
    unittest.main()
