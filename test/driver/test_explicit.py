#!/usr/bin/env python3
"""Explicit steps through the program: with static steps before and after them, over the load factor in time, refusals."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

PLATE = """&job name = 'e' /
&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 8, 4 /
&material name = 'm' law = 'neo_hookean' mu = 1000.0 density = 1.0 /
&section thickness = 0.05 /
&support node_set = 'edge_x0' type = 'clamped' /
&support node_set = 'edge_x1' type = 'clamped' /
&load type = 'pressure' pressure = 20.0 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /
&output every = 0 /
"""


class Explicit(unittest.TestCase):
    def run_it(self, text, code=0, command="run", threads="1"):
        """Rows of the history as numbers, what was printed."""
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "e.nml").write_text(text)
            run = subprocess.run([os.environ["FINSHELL_BIN"], command, "e.nml"], cwd=folder, capture_output=True, text=True, check=False,
                                 env=dict(os.environ, OMP_NUM_THREADS=threads))
            printed = run.stdout + run.stderr
            self.assertEqual(run.returncode, code, printed)
            path = Path(folder) / "e.history.csv"
            rows = list(csv.DictReader(path.read_text().splitlines())) if path.exists() else []
        return [{key: float(value) for key, value in row.items()} for row in rows], printed

    def test_rest_release_and_settling(self):
        """An equilibrium stays where it is; without its load it swings to the other side; a static step takes it up again."""
        static = "&step tolerance = 'tight' /\n"
        rows, _ = self.run_it(PLATE + static)
        still = rows[-1]["w"]
        self.assertGreater(still, 0.05)
        rows, _ = self.run_it(PLATE + static + "&step control = 'explicit' duration = 0.2 history_rows = 10 /\n" + static)
        self.assertGreater(len(rows), 10)
        for row in rows[-11:]:
            self.assertAlmostEqual(row["w"], still, delta=1e-6 * still)

        rows, _ = self.run_it(PLATE + static + "&step control = 'explicit' duration = 0.4 load_factor = 0.0 /\n&step load_factor = 1.0 tolerance = 'tight' /\n")
        swing = [row["w"] for row in rows if row["load_factor"] == 0]
        self.assertGreaterEqual(len(swing), 100)
        self.assertLess(min(swing), -0.5 * still)
        self.assertAlmostEqual(rows[-1]["w"], still, delta=1e-5 * still)

    def test_rows_and_factor(self):
        rows, printed = self.run_it(PLATE + "&step control = 'explicit' duration = 0.1 times = 0.04, 0.08 factors = 1.0, 0.5 output_times = 0.01, 0.05 history_rows = 1 /\n")
        self.assertEqual([round(row["load_factor"], 12) for row in rows], [0.25, 1.0, 0.875, 0.5, 0.5])
        self.assertIn("5 increments", printed)
        self.assertEqual(self.run_it(PLATE + "&step control = 'explicit' duration = 0.1 /\n", threads="2")[0],
                         self.run_it(PLATE + "&step control = 'explicit' duration = 0.1 /\n")[0])

    def test_refusals(self):
        for keys, sentence in (("safety = 1.2", "at most"), ("safety = 0.0", "greater than"), ("rotation_scaling = -1.0", "at least"),
                               ("history_rows = 0", "at least"), ("scheme = 'conserving'", "scheme"), ("stiffness_damping = 1.0", "stiffness_damping")):
            _, printed = self.run_it(PLATE + f"&step control = 'explicit' duration = 0.1 {keys} /\n", code=2)
            self.assertIn(sentence, printed)
            self.assertIn("e.nml:10", printed)
        rows, printed = self.run_it(PLATE + "&step control = 'explicit' duration = 1.0 automatic = .false. first_increment = 0.02 /\n", code=1)
        self.assertIn("nstable", printed)
        self.assertLess(len(rows), 30)
        _, printed = self.run_it(PLATE + "&step control = 'explicit' duration = 1.0 maximum_increments = 50 /\n", code=1)
        self.assertIn("not finished after 50 increments", printed)
        _, printed = self.run_it(PLATE.replace(" density = 1.0", "") + "&step control = 'explicit' duration = 1.0 /\n", code=2)
        self.assertIn("density", printed)


if __name__ == "__main__":
    unittest.main()
