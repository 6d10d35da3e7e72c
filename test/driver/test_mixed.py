#!/usr/bin/env python3
"""Mixed Newton reaches the same states as plain Newton, in few iterations, also over many increments with extrapolation."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

HEMISPHERE = """&mesh generator = 'sphere' radius = 10.0 colatitudes = 18.0, 90.0 azimuths = 0.0, 90.0 divisions = 8, 8 /
&material name = 'm' law = 'st_venant_kirchhoff' e = 6.825e7 nu = 0.3 /
&section material = 'm' thickness = 0.04 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'corner_a0_bottom' fixed = 'uz' /
&load type = 'force' node_set = 'corner_a0_bottom' vector = 200.0, 0.0, 0.0 /
&load type = 'force' node_set = 'corner_a1_bottom' vector = 0.0, -200.0, 0.0 /
&step load_factor = 1.0 tolerance = 'tight' {step} /
&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'corner_a0_bottom' /
&output every = 0 /
"""
DISK = """&mesh generator = 'disk' portion = 'quarter' radius = 7.5 rings = 19 core = 6 /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0 /
&section material = 'rubber' thickness = 0.5 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'pressure' pressure = 70.0 /
&step {step} /
&monitor name = 'u' quantity = 'displacement' component = 'z' node_set = 'centre' /
&output every = 0 /
"""


class Mixed(unittest.TestCase):
    def solve(self, step, text=HEMISPHERE):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "hemi.nml").write_text(text.format(step=step))
            run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "-q", "hemi.nml"], cwd=folder, capture_output=True, text=True, check=False,
                                 env=dict(os.environ, OMP_NUM_THREADS="1"))
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            rows = [{k: float(v) for k, v in r.items()} for r in csv.DictReader((Path(folder) / "hemi.history.csv").read_text().splitlines())]
        return rows, sum(r["iterations"] for r in rows)

    def test_many_increments(self):
        plain, plain_iterations = self.solve("mixed = .false.")
        for extrapolate in (".true.", ".false."):
            mixed, iterations = self.solve(f"mixed = .true. extrapolate = {extrapolate}")
            self.assertAlmostEqual(mixed[-1]["u"], plain[-1]["u"], delta=1e-7 * plain[-1]["u"])
            self.assertEqual(max(r["negative_pivots"] for r in mixed), 0)
            self.assertLess(iterations, 0.7 * plain_iterations)

    def test_chosen_where_it_pays(self):
        plain, plain_iterations = self.solve("mixed = .false.")
        chosen, iterations = self.solve("tangent_predictor = .false.")
        self.assertAlmostEqual(chosen[-1]["u"], plain[-1]["u"], delta=1e-7 * plain[-1]["u"])
        self.assertLess(iterations, 0.5 * plain_iterations)
        along, fewer = self.solve("")
        self.assertAlmostEqual(along[-1]["u"], plain[-1]["u"], delta=1e-7 * plain[-1]["u"])
        self.assertLess(fewer, 0.9 * iterations)

    def test_not_chosen_where_it_does_not_pay(self):
        # The rubber disk from rest, with 19 rings: plain Newton's own counts. Mixed throughout takes more.
        plain, chosen, always = (self.solve(step, DISK)[1] for step in ("mixed = .false.", "", "mixed = .true."))
        self.assertEqual(chosen, plain)
        self.assertLess(chosen, always)

    def test_counts_do_not_grow_with_refinement(self):
        # Arc-length, 38 and 71 rings: plain Newton and the parabola through states take 25 and 58 iterations.
        for rings, core, most, deflection in ((38, 12, 22, 34.571), (71, 22, 28, 34.672)):
            text = DISK.replace("rings = 19 core = 6", f"rings = {rings} core = {core}")
            w, iterations = self.solve("control = 'arc_length' tangent_predictor = .true.", text)
            self.assertLessEqual(iterations, most)
            self.assertAlmostEqual(w[-1]["u"], deflection, delta=0.01)

    def test_soft_start(self):
        # Load control, 116 rings: plain Newton from rest meets negative pivots at its second iteration, a descent takes some sixty.
        text = DISK.replace("rings = 19 core = 6", "rings = 116 core = 36")
        rows, iterations = self.solve("", text)
        self.assertAlmostEqual(rows[-1]["u"], 34.69, delta=0.02)
        self.assertLessEqual(iterations, 40)
        self.assertEqual(max(r["snap"] for r in rows), 0)

    def test_chords_where_increments_fail(self):
        # A roof under load control, near its limit point: two increments that are cut in a row end the predictor along the tangent, with
        # which the path would stop at 0.36.
        text = (Path(os.environ["FINSHELL_SOURCE_DIR"]) / "examples/sze38b/input.nml").read_text()
        begin = text.index("&step")
        text = text[:begin] + "&step {step} /\n" + text[text.index("/", begin) + 1:]
        rows, _ = self.solve("", text.replace("name = 'sze38b'", "name = 'hemi'"))
        self.assertEqual(rows[-1]["load_factor"], 1)
        self.assertAlmostEqual(rows[-1]["W_C"], 33.326, delta=0.005)

    def test_one_increment(self):
        mixed, iterations = self.solve("mixed = .true. first_increment = 1.0")
        self.assertEqual(len(mixed), 1)
        self.assertLessEqual(iterations, 15)


if __name__ == "__main__":
    unittest.main()
