#!/usr/bin/env python3
"""Stability of whole models in plain tension, where nothing physical is unstable: no negative pivot may appear.

The bounded part of bench/stability.py; with FINSHELL_LONG set, the long one.
"""
import csv
import math
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

LONG = bool(os.environ.get("FINSHELL_LONG"))
SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])


def solve(text):
    """Rows of the history."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "case.nml").write_text(text + "\n&output every = 0 /\n")
        run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "--quiet", "case.nml"], cwd=folder, capture_output=True, text=True, check=False,
                             timeout=600)
        if run.returncode != 0:
            raise AssertionError(run.stdout + run.stderr)
        return [{k: float(v) for k, v in r.items()} for r in csv.DictReader((Path(folder) / "case.history.csv").read_text().splitlines())]


class Stability(unittest.TestCase):
    def report(self, *words):
        if LONG:
            print(*words)

    def test_rubber_disk_on_ring_meshes(self):
        """Slender kinked triangles at the rim: unstable with the plain von Karman term."""
        end = 40
        for mesh in ("rings = 14 sectors = 8", "rings = 12 sectors = 24", "rings = 20 sectors = 8") if LONG else ("rings = 14 sectors = 8", "rings = 12 sectors = 24"):
            rows = solve(f"""
&mesh generator = 'disk' radius = 7.5 {mesh} /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0 /
&section material = 'rubber' thickness = 0.5 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'pressure' pressure = 1.0 /
&step control = 'displacement' node_set = 'centre' component = 'z' displacements = 10, 20, {end} maximum_increments = 200 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /
""")
            self.report("disk", mesh, "to w =", rows[-1]["w"], "negative pivots", max(r["negative_pivots"] for r in rows))
            self.assertAlmostEqual(rows[-1]["w"], end)
            self.assertEqual(max(r["negative_pivots"] for r in rows), 0, mesh)

    def test_strips_one_element_wide(self):
        for n in (8, 32) if LONG else (16,):
            for diagonal in ("forward", "alternating"):
                rows = solve(f"""
&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = {n}, 1 diagonal = '{diagonal}' /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0 /
&section material = 'rubber' thickness = 0.01 /
&support node_set = 'edge_x0' type = 'clamped' /
&support node_set = 'edge_x1' ux = 2.0 fixed = 'uy', 'uz', 'rx', 'ry', 'rz' /
&step load_factor = 1.0 first_increment = 0.1 largest_increment = 0.1 tolerance = 'tight' /
&monitor name = 'F' quantity = 'reaction' component = 'x' node_set = 'edge_x1' /
""")
                self.report("strip", n, diagonal, "negative pivots", max(r["negative_pivots"] for r in rows))
                self.assertEqual(max(r["negative_pivots"] for r in rows), 0, (n, diagonal))

    def test_thin_sphere(self):
        """h/R = 0.001, Mooney-Rivlin 80/20, to five times its size: pressure p = 2 h/R ds/dl, exact for a membrane."""
        radius, h, c10, c01 = 1.0, 0.001, 80.0, 20.0
        stretches = (1.1, 1.5, 2.0, 3.0, 5.0)
        n = 16 if LONG else 8
        sphere = f"""
&mesh generator = 'sphere' radius = {radius} colatitudes = 0.0, 90.0 azimuths = 0.0, 90.0 divisions = {n}, {n} /
&material name = 'rubber' law = 'mooney_rivlin' c10 = {c10} c01 = {c01} /
&section material = 'rubber' thickness = {h} /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'pole_top' fixed = 'ux', 'uy', 'rx', 'ry', 'rz' /
&support node_set = 'edge_bottom' type = 'symmetry_z' /
&load type = 'pressure' pressure = 1.0 /
&monitor name = 'V' quantity = 'volume' /
"""
        # what the facets enclose counts, not the sphere around them
        start = solve(sphere + "&step load_factor = 1e-9 /")[-1]["V"]
        volumes = [start * s**3 for s in stretches]
        radius = (6 * start / math.pi) ** (1 / 3)
        rows = solve(sphere + f"&step control = 'volume' volumes = {', '.join(map(str, volumes))} maximum_increments = 300 /")
        worst = 0.0
        for s, volume in zip(stretches, volumes):
            row = min(rows, key=lambda r: abs(r["V"] - volume))
            exact = 4 * h / radius * (1 / s - 1 / s ** 7) * (c10 + c01 * s * s)
            self.report(f"sphere {n}x{n}, stretch {s}: pressure {100 * (row['load_factor'] / exact - 1):+.2f} %")
            worst = max(worst, abs(row["load_factor"] / exact - 1))
        self.report("sphere negative pivots", max(r["negative_pivots"] for r in rows))
        self.assertEqual(max(r["negative_pivots"] for r in rows), 0)
        self.assertLess(worst, 0.012)


if __name__ == "__main__":
    unittest.main()
