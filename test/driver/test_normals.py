#!/usr/bin/env python3
"""`normals` of &mesh: curved elements from the generator's normals, from fitted ones or from a file; flat models do not notice."""
import csv
import math
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
N = 5
REST = """&material name = 'm' law = 'linear_elastic' e = 1000 nu = 0 /
&section thickness = 0.01 /
&output every = 0 /
"""
RING = f"""&mesh generator = 'cylinder' radius = 1 length = {math.pi / 2 / N:.12f} angles = 0, 90 divisions = {N}, 1 diagonal = 'alternating' KEYS /
&support node_set = 'all' fixed = 'uy', 'rx', 'rz' /
&support node_set = 'edge_a0' type = 'symmetry_z' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&load type = 'force' node_set = 'edge_a1' vector = 0, 0, -1 /
&step control = 'linear' /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_a1' /
""" + REST


class Normals(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def run_text(self, text, code=0):
        (self.folder / "in.nml").write_text(text)
        run = subprocess.run([PROGRAM, "run", "-q", "in.nml"], cwd=self.folder, capture_output=True, text=True, check=False, timeout=300)
        self.assertEqual(run.returncode, code, run.stdout + run.stderr)
        if code:
            return run.stderr
        return [{k: float(v) for k, v in r.items()} for r in csv.DictReader((self.folder / "in.history.csv").read_text().splitlines())]

    def ring(self, keys):
        """Deflection of the pinched quarter ring, N elements, over that of beam theory."""
        inertia = 1000 * 0.01**3 / 12 * math.pi / 2 / N
        return -self.run_text(RING.replace("KEYS", keys))[-1]["w"] / (0.5 * (math.pi / 4 - 2 / math.pi) * 4 / inertia)

    def test_pinched_ring(self):
        facet = self.ring("normals = 'facet'")
        for keys in ("", "normals = 'exact'", "normals = 'auto'"):
            self.assertAlmostEqual(self.ring(keys), 1, delta=0.006, msg=keys)
        # the supports are no planes of symmetry, as what they hold slides along the surface
        self.assertAlmostEqual(self.ring("normals = 'fitted'"), 1, delta=0.02)
        self.assertGreater(abs(facet - 1), 0.01)

    def test_ring_under_pressure(self):
        """Pressure acts on the curved surface: p R / E h, against which only bending holds what is not in balance; buckling at 3 E I / R**3."""
        text = """&mesh generator = 'cylinder' radius = 1 length = 0.1570796 angles = 0, 90 divisions = 10, 1 diagonal = 'DIAGONAL' KEYS /
&support node_set = 'edge_a0' type = 'symmetry_x' /
&support node_set = 'edge_a1' type = 'symmetry_z' /
&support node_set = 'edge_y0', 'edge_y1' fixed = 'uy' /
&load type = 'pressure' pressure = -1e-6 /
&step control = 'CONTROL' /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_a0' /
""" + REST
        for diagonal, keys, least, most in (("forward", "", 0, 0.01), ("alternating", "", 0, 0.03), ("forward", "normals = 'facet'", 0.5, 2)):
            model = text.replace("DIAGONAL", diagonal).replace("KEYS", keys)
            error = self.run_text(model.replace("CONTROL", "linear"))[-1]["w"] / (-1e-6 / 1000 / 0.01) - 1
            self.assertLess(least, abs(error), (diagonal, keys))
            self.assertLess(abs(error), most, (diagonal, keys))
            factor = self.run_text(model.replace("CONTROL", "buckling"))[0]["load_factor"]
            self.assertAlmostEqual(factor * 1e-6 / (1000 * 0.01**3 / 12) / 3, 1, delta=0.003 if not keys else 0.005)

    def test_inflated_sphere(self):
        """Stretch by the volume under the curved surface, pressure from the maximum at 1.38 to three times the radius."""
        stretches = (1.05, 1.38, 2, 3)
        volumes = ", ".join(f"{math.pi / 6 * s**3:.12f}" for s in stretches)
        rows = self.run_text(f"""&mesh generator = 'sphere' radius = 1 colatitudes = 0, 90 azimuths = 0, 90 divisions = 8, 8 /
&material name = 'm' law = 'neo_hookean' mu = 1 /
&section thickness = 0.001 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'edge_bottom' type = 'symmetry_z' /
&load type = 'pressure' pressure = 0.002 /
&step control = 'volume' volumes = {volumes} /
&monitor name = 'v' quantity = 'volume' /
&monitor name = 'pole' quantity = 'displacement' component = 'z' node_set = 'pole_top' /
&output every = 0 /
""")
        for s in stretches:
            row = min(rows, key=lambda r: abs(r["v"] - math.pi / 6 * s**3))
            self.assertAlmostEqual(row["load_factor"] / ((s**2 - s**-4) / s**3), 1, delta=0.0005, msg=s)
            self.assertAlmostEqual((1 + row["pole"]) / s, 1, delta=0.002, msg=s)

    def test_file(self):
        # the order of the nodes is that of the generator: along first
        angles = [math.radians(90 * i / N) for i in range(N + 1) for _ in range(2)]
        # of any length and sign
        (self.folder / "normals.txt").write_text("# normals\n" + "".join(f"{-3 * math.sin(a)} 0 {-3 * math.cos(a)}\n" for a in angles))
        self.assertAlmostEqual(self.ring("normal_file = 'normals.txt'"), self.ring("normals = 'exact'"), places=10)

    def test_flat_is_flat_to_the_bit(self):
        plate = """&mesh generator = 'rectangle' lengths = 2, 1 divisions = 6, 3 distortion = 0.2 KEYS /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'force' node_set = 'edge_x1' vector = 0, 1e-4, 1e-4 total = .true. /
&step /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
""" + REST
        self.assertEqual(self.run_text(plate.replace("KEYS", "")), self.run_text(plate.replace("KEYS", "normals = 'fitted'")))

    def test_a_curved_shell_rests(self):
        # strains are differences from those of the facet: what rounding leaves of them is no reason to stop
        panel = """&mesh generator = 'cylinder' radius = 10 length = 8 angles = 20, 90 divisions = 4, 4 normals = 'exact' /
&support node_set = 'edge_a0', 'edge_a1', 'edge_y0', 'edge_y1' type = 'clamped' /
&load type = 'moment' node_set = 'edge_a0' vector = 0, 1, 0 constant = .true. /
&load type = 'pressure' pressure = 1e-4 /
&step tolerance = 'tight' /
""" + REST
        self.assertEqual(self.run_text(panel)[-1]["load_factor"], 1)

    def test_coarse(self):
        # a half circle of two facets: its normals stand at 90 degrees to them
        half = """&mesh generator = 'cylinder' radius = 1 length = 1 angles = 0, 180 divisions = 1, 1 KEYS /
&support node_set = 'edge_a0' type = 'clamped' /
&load type = 'force' node_set = 'edge_a1' vector = 0, 0, -1e-6 /
&step /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_a1' /
""" + REST
        self.assertEqual(self.run_text(half.replace("KEYS", "")), self.run_text(half.replace("KEYS", "normals = 'facet'")))
        self.assertIn("in.nml:1: &mesh normals: the normal at node", self.run_text(half.replace("KEYS", "normals = 'exact'"), 2))

    def test_refused(self):
        plate = "&mesh generator = 'rectangle' lengths = 1, 1 divisions = 2, 2 normals = 'exact' /\n&step /\n" + REST
        self.assertIn("'exact' needs a generator", self.run_text(plate, 2))
        (self.folder / "normals.txt").write_text("0 0 1\n")
        self.assertIn("normals.txt", self.run_text(RING.replace("KEYS", "normal_file = 'normals.txt'"), 2))
        self.assertIn("either normals or normal_file", self.run_text(RING.replace("KEYS", "normals = 'exact' normal_file = 'normals.txt'"), 2))


if __name__ == "__main__":
    unittest.main()
