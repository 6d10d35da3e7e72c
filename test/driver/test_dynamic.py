#!/usr/bin/env python3
"""Implicit steps in time through the program: what check refuses and where, steps one after the other, the example of the cap."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
PLATE = """&job name = 'd' /
&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 4, 2 /
&material name = 'm' law = 'linear_elastic' e = 1e6 nu = 0.3 {} /
&section thickness = 0.1 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
&monitor name = 'R' quantity = 'reaction' component = 'z' node_set = 'edge_x0' /
&output every = 0 /
"""
CLAMPED = "&support node_set = 'edge_x0' type = 'clamped' /\n&load type = 'force' node_set = 'corner_x1_y1' vector = 0, 0, 5 /\n"
MOVED = "&support node_set = 'edge_x0' fixed = 'ux', 'uy', 'rx', 'ry', 'rz' uz = 0.5 {} /\n"


class Dynamic(unittest.TestCase):
    def solve(self, text, code=0, command="run"):
        """Rows of the history, and what was printed."""
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "d.nml").write_text(text)
            run = subprocess.run([os.environ["FINSHELL_BIN"], command, "d.nml"], cwd=folder, capture_output=True, text=True, check=False)
            printed = run.stdout + run.stderr
            self.assertEqual(run.returncode, code, printed)
            found = list(Path(folder).glob("*.history.csv"))
            rows = list(csv.DictReader(found[0].read_text().splitlines())) if found else []
        return [{key: float(value) for key, value in row.items()} for row in rows], printed

    def test_what_check_refuses(self):
        moves = MOVED.format("") + "&step control = 'dynamic' duration = 1.0 {} /\n"
        for text, complaint in (
                (PLATE.format("") + CLAMPED + "&step control = 'dynamic' duration = 1.0 /", "d.nml:10: &step: dynamic: section 1 has no mass: its material needs a density > 0"),
                (PLATE.format("density = 1") + moves.format(""), "d.nml:9: &step: dynamic: supports move with the load factor, which jumps from 0"),
                (PLATE.format("density = 1") + moves.format("times = 0.0, 1.0 factors = 0.5, 1.0"), "d.nml:9: &step: dynamic: supports move with the load factor"),
                (PLATE.format("density = 1") + MOVED.format("constant = .true.") + "&step control = 'dynamic' duration = 1.0 /", "d.nml:9: &step: dynamic: constant supports would jump"),
                (PLATE.format("density = 1") + CLAMPED + "&step control = 'dynamic' /", "d.nml:10: &step"),
                (PLATE.format("density = 1") + CLAMPED + "&step control = 'dynamic' duration = 1.0 rho_infinity = 1.5 /", "rho_infinity = 1.5"),
                (PLATE.format("density = 1") + CLAMPED + "&step control = 'dynamic' duration = 1.0 scheme = 'newmark' /", "generalised_alpha, conserving")):
            with self.subTest(complaint=complaint):
                _, printed = self.solve(text, code=2, command="check")
                self.assertIn(complaint, printed)
        self.solve(PLATE.format("density = 1") + moves.format("times = 1.0 factors = 1.0"), command="check")

    def test_steps_one_after_the_other(self):
        text = PLATE.format("density = 1") + CLAMPED
        static = self.solve(text + "&step tolerance = 'tight' /")[0][-1]
        # bend, let go, hold again: the last step begins at rest and ends where the first did
        rows, printed = self.solve(text + "&step tolerance = 'tight' /\n&step control = 'dynamic' duration = 0.2 load_factor = 0.0 /\n"
                                   "&step control = 'dynamic' duration = 0.2 load_factor = 0.0 scheme = 'conserving' /\n&step tolerance = 'tight' /")
        self.assertIn("Done: load factor 1.0", printed)
        self.assertAlmostEqual(rows[-1]["w"], static["w"], delta=1e-6 * abs(static["w"]))
        self.assertAlmostEqual(rows[-1]["R"], -5.0, delta=1e-6)
        free = [r["w"] for r in rows if r["load_factor"] == 0.0]
        self.assertLess(min(free), -0.9 * static["w"])
        self.assertGreater(max(free), 0.9 * static["w"])

    def test_free_flight(self):
        # thrown by nothing but gravity, without supports: z = -g t^2/2, whatever the increments
        rows, _ = self.solve(PLATE.format("density = 1") + "&load type = 'gravity' vector = 0, 0, -10 /\n&step control = 'dynamic' duration = 2.0 /")
        self.assertAlmostEqual(rows[-1]["w"], -20.0, delta=1e-9)
        self.assertLess(len(rows), 110)

    def test_reactions_carry_the_inertia(self):
        # a stiff plate on an edge that accelerates: 3 s^2 - 2 s^3 has the second derivative 6 at its beginning; m = 0.2
        rows, _ = self.solve(PLATE.format("density = 1").replace("1e6", "1e8") + MOVED.format("")
                             + "&step control = 'dynamic' duration = 0.5 times = 1.0 factors = 1.0 smooth = .true. /")
        mean = sum(r["R"] for r in rows[len(rows) // 2:]) / (len(rows) - len(rows) // 2)
        self.assertGreater(mean, 0.0)
        self.assertLess(mean, 0.2 * 0.5 * 6)

    def test_example(self):
        rows, _ = self.solve((SOURCE / "examples/spherical_cap_dynamic/input.nml").read_text())
        w = [r["w"] for r in rows]
        self.assertAlmostEqual(min(w), -0.0927, delta=0.001)
        self.assertAlmostEqual(w[-1], -0.0910, delta=0.0015)
        self.assertLess(len(rows), 170)
        self.assertLess(sum(r["iterations"] for r in rows), 300)


    def test_motion_from_static_rest(self):
        """What a static step leaves out of balance is not resolved until the load comes: increments do not shrink to nothing."""
        model = """&job name = 'd' /
&mesh generator = 'rectangle' lengths = 1.0, 0.5 divisions = 6, 3 /
&material name = 'm' law = 'linear_elastic' e = 1e7 nu = 0.3 density = 1000.0 /
&section thickness = 0.02 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'gravity' vector = 0, 0, -9.81 /
&load type = 'pressure' pressure = 100.0 case = 'gust' /
&step /
&step control = 'dynamic' case = 'gust' duration = 0.2 times = 0.05, 0.1, 0.2 factors = 1, 0, 0 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
"""
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "d.nml").write_text(model)
            run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "d.nml"], cwd=folder, capture_output=True, text=True, check=False, timeout=100)
            self.assertEqual(run.returncode, 0, run.stderr)
            rows = list(csv.DictReader((Path(folder) / "d.history.csv").read_text().splitlines()))
        moving = [row for row in rows if float(row["time"]) > 0]
        self.assertLess(len(moving), 200)
        self.assertAlmostEqual(float(moving[-1]["time"]), 0.2, delta=1e-12)
        self.assertGreater(max(float(row["kinetic_energy"]) for row in moving), 1e-3)


if __name__ == "__main__":
    unittest.main()
