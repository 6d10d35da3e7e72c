#!/usr/bin/env python3
"""The way of a step: there and back without false critical points; values that are not on it are refused; a load that comes back stops the run."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
STRIP = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 10, 1 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0e6 /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
{load}
{steps}
&monitor name = 'tip' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
&output every = 0 /
"""
LOAD = "&load type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0, 1.0 /"
TIP = "node_set = 'edge_x1' component = 'z'"
PILLOW = """&mesh generator = 'rectangle' lengths = 100, 100 divisions = 8, 8 /
&material name = 'm' law = 'linear_elastic' e = 200 nu = 0.3 /
&section thickness = 0.5 /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&support node_set = 'edge_x1' fixed = 'uz', 'rx', 'ry' /
&support node_set = 'edge_y1' fixed = 'uz', 'rx', 'ry' /
&load type = 'pressure' pressure = 0.01 /
&step control = 'arc_length' /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_x0_y0' /
&output every = 0 /
"""
ROOF = """&mesh generator = 'cylinder' radius = 2540.0 length = 254.0 angles = 0.0, 5.729577951308232 divisions = 8, 8 /
&material name = 'elastic' law = 'linear_elastic' e = 3102.75 nu = 0.3 /
&section material = 'elastic' thickness = 6.35 /
&support node_set = 'edge_a1' fixed = 'ux', 'uy', 'uz', 'rx', 'rz' /
&support node_set = 'edge_a0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'force' node_set = 'corner_a0_y0' vector = 0.0, 0.0, -750.0 /
&step control = 'arc_length' first_increment = 0.02 mixed = .true. /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_a0_y0' /
&output every = 0 /
"""


class Way(unittest.TestCase):
    def run_text(self, text, command="run"):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "in.nml").write_text(text)
            run = subprocess.run([PROGRAM, command, "in.nml"], cwd=folder, capture_output=True, text=True, timeout=300, check=False)
            history = Path(folder) / "in.history.csv"
            rows = [{k: float(v) for k, v in r.items()} for r in csv.DictReader(history.read_text().splitlines())] if history.exists() else []
        return run, rows

    def solve(self, steps, load=LOAD, code=0):
        run, rows = self.run_text(STRIP.format(load=load, steps=steps))
        self.assertEqual(run.returncode, code, run.stdout + run.stderr)
        return rows

    def test_there_and_back(self):
        """No limit point where the user turns round, whatever the controls."""
        for steps in ("&step load_factor = 1.0 /\n&step load_factor = 0.0 /",
                      "&step load_factor = 1.0 /\n&step load_factor = -1.0 /\n&step load_factor = 0.5 /",
                      "&step control = 'arc_length' load_factor = 1.0 /\n&step control = 'arc_length' load_factor = 0.0 /",
                      f"&step control = 'displacement' {TIP} displacements = 2 /\n&step control = 'displacement' {TIP} displacements = -1 /",
                      f"&step control = 'displacement' {TIP} displacements = 2 /\n&step load_factor = 0.0 /",
                      "&step load_factor = 1.0 /\n&step control = 'arc_length' load_factor = 0.2 /\n&step load_factor = 2.0 /"):
            with self.subTest(steps):
                self.assertEqual([r["critical_point"] for r in self.solve(steps) if r["critical_point"] > 0], [])

    def test_moved_support_and_constant_load_there_and_back(self):
        moved = "&support node_set = 'edge_x1' uz = 2.0 /"
        back = "&step load_factor = 1.0 /\n&step load_factor = -0.5 /"
        for load in (moved, LOAD + "\n&load type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0, 0.5 constant = .true. /"):
            for steps in (back, "&step load_factor = -1.0 /\n&step load_factor = 0.5 /"):
                with self.subTest(load=load, steps=steps):
                    rows = self.solve(steps, load)
                    self.assertEqual([r["critical_point"] for r in rows if r["critical_point"] > 0], [])

    def refuse(self, steps, *words):
        for command in ("run", "check"):
            run, rows = self.run_text(STRIP.format(load=LOAD, steps=steps), command)
            self.assertEqual((run.returncode, rows), (2, []), run.stdout + run.stderr)
            for word in words:
                self.assertIn(word, run.stderr)

    def test_values_off_the_way(self):
        self.refuse("&step load_levels = 0.5, 2.0 load_factor = 1.0 /", "in.nml:6: &step load_levels", "2.000000E+00", "come back")
        self.refuse("&step load_levels = 0.5, 2.0 /", "in.nml:6: &step load_levels")
        self.refuse("&step load_levels = 0.5, 0.2 load_factor = 1.0 /", "in.nml:6: &step load_levels")
        self.refuse("&step load_levels = -0.5, 0.5 load_factor = 1.0 /", "in.nml:6: &step load_levels")
        self.refuse("&step load_levels = -0.5 load_factor = 1.0 /", "in.nml:6: &step load_levels")
        self.refuse("&step load_factor = 1.0 /\n&step load_levels = 1.5 load_factor = 0.0 /", "in.nml:7: &step load_levels")
        self.refuse(f"&step control = 'displacement' {TIP} displacements = 1 /\n&step load_levels = 3, 1 load_factor = 2 /", "in.nml:7: &step load_levels")
        self.refuse("&step control = 'arc_length' load_levels = 0.5, 2.0 /", "in.nml:6: &step load_levels")
        self.refuse("&step control = 'arc_length' load_levels = 0.5, 0.5 /", "in.nml:6: &step load_levels", "twice")
        self.refuse(f"&step control = 'displacement' {TIP} displacements = 1, 3, 2 /", "in.nml:6: &step displacements", "2.000000E+00", "another step")
        self.refuse(f"&step control = 'displacement' {TIP} displacements = -1, 1 /", "in.nml:6: &step displacements")
        self.refuse(f"&step control = 'arc_length' {TIP} displacements = 1, 1 /", "in.nml:6: &step displacements", "twice")
        self.refuse("&step control = 'volume' volumes = 3.0, 2.0, 4.0 /", "in.nml:6: &step volumes")

    def test_off_the_way_known_in_the_run_only(self):
        for values, found in (("9, 5", "5"), ("0.5, 5", "5"), ("5, 6, 5.5", "")):
            run, _ = self.run_text(STRIP.format(load=LOAD, steps=f"&step /\n&step control = 'displacement' {TIP} displacements = {values} /"))
            self.assertEqual(run.returncode, 1 if found else 2, run.stderr)
            self.assertIn(f"step 'step 2': displacement {found}.000000E+00 does not lie on the way" if found else "in.nml:7: &step displacements", run.stderr)

    def test_values_on_the_way(self):
        for steps, last in (("&step load_levels = 0.0, 0.5, 1.0 /", 1.0), ("&step load_levels = -0.2, -0.5 load_factor = -0.6 /", -0.6),
                            ("&step /\n&step load_levels = 0.7, 0.2 load_factor = -0.1 /", -0.1), ("&step load_levels = 0.5, 1.0 /\n&step /", 1.0),
                            (f"&step control = 'displacement' {TIP} displacements = 1, 2 /\n&step load_levels = 0.5, 0.2 load_factor = 0 /", 0.0)):
            with self.subTest(steps):
                self.assertEqual(self.solve(steps)[-1]["load_factor"], last)

    def test_load_that_comes_back(self):
        """The pillow's path buckles and returns; the run does not go on with suction."""
        run, rows = self.run_text(PILLOW)
        self.assertEqual(run.returncode, 1, run.stdout)
        self.assertIn("come back through zero on its way to 1.0", run.stderr)
        self.assertEqual([r["load_factor"] < 0 for r in rows][-2:], [False, True])

    def test_snap_through_below_zero(self):
        """A roof that snaps through below zero and up again is on its way."""
        run, rows = self.run_text(ROOF)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        self.assertLess(min(r["load_factor"] for r in rows), -0.1)
        self.assertEqual(rows[-1]["load_factor"], 1.0)


if __name__ == "__main__":
    unittest.main()
