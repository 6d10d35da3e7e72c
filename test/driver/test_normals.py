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
RING = f"""&mesh generator = 'cylinder' radius = 1 length = {math.pi / 2 / N:.12f} angles = 0, 90 divisions = {N}, 1 KEYS /
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
        run = subprocess.run([PROGRAM, "run", "-q", "in.nml"], cwd=self.folder, capture_output=True, text=True, check=False, timeout=60)
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
        self.assertEqual(self.ring(""), facet)
        for keys in ("normals = 'exact'", "normals = 'auto'"):
            self.assertAlmostEqual(self.ring(keys), 1, delta=0.006, msg=keys)
        # the supports are no planes of symmetry, as what they hold slides along the surface
        self.assertAlmostEqual(self.ring("normals = 'fitted'"), 1, delta=0.02)
        self.assertGreater(abs(facet - 1), 0.01)

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

    def test_refused(self):
        plate = "&mesh generator = 'rectangle' lengths = 1, 1 divisions = 2, 2 normals = 'exact' /\n&step /\n" + REST
        self.assertIn("'exact' needs a generator", self.run_text(plate, 2))
        (self.folder / "normals.txt").write_text("0 0 1\n")
        self.assertIn("normals.txt", self.run_text(RING.replace("KEYS", "normal_file = 'normals.txt'"), 2))
        self.assertIn("either normals or normal_file", self.run_text(RING.replace("KEYS", "normals = 'exact' normal_file = 'normals.txt'"), 2))


if __name__ == "__main__":
    unittest.main()
