#!/usr/bin/env python3
"""The log of iterations: what it says is what the history counts, and nothing changes because of it."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
STRIP = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 12, 2 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0e6 density = 1000 /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0, 20.0 /
&monitor name = 'tip' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
"""
STEP = "&step load_factor = 1.0 tolerance = 'tight' /\n"


class Verbose(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def run_text(self, text, *options, code=0):
        (self.path / "a.nml").write_text(text)
        done = subprocess.run([PROGRAM, "run", *options, "a.nml"], cwd=self.path, capture_output=True, text=True, timeout=120, check=False)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout

    def history(self):
        with (self.path / "a.history.csv").open() as file:
            return list(csv.DictReader(file))

    def blocks(self):
        """The heading of each attempt, and its iterations."""
        found = []
        for line in (self.path / "a.iterations.log").read_text().splitlines():
            if line.startswith("Increment"):
                found.append((line, []))
            elif line.split()[0].isdigit():
                found[-1][1].append(line.split())
        return found

    def test_lines_fit_the_history(self):
        shown = self.run_text(STRIP + STEP + "&output verbose = .true. /\n")
        log = (self.path / "a.iterations.log").read_text()
        for line in log.splitlines():
            self.assertIn(line, shown)
        rows, blocks = self.history(), self.blocks()
        self.assertEqual(len(rows), len(blocks))
        for row, (heading, lines) in zip(rows, blocks):
            self.assertIn(f"Increment {row['increment']} of step 'step 1': load control, size ", heading)
            self.assertEqual([int(line[0]) for line in lines], list(range(int(row["iterations"]) + 1)))
            method, forces, moments, correction, rotation, part, pivots, factor = lines[-1][1:]
            self.assertIn(method, ("Newton", "mixed"))
            self.assertAlmostEqual(max(float(forces), float(moments)) / float(row["residual"]), 1, places=3)
            self.assertAlmostEqual(float(correction) / float(row["correction"]), 1, places=3)
            self.assertEqual((float(part), pivots), (1, row["negative_pivots"]))
            self.assertLess(float(rotation), float(lines[1][5]))
            self.assertAlmostEqual(float(factor), float(row["load_factor"]), places=6)

    def test_rotation_limit_and_failure(self):
        text = STRIP + "&step first_increment = 1 maximum_iterations = 4 rotation_limit = 0.05 maximum_cuts = 1 descent = .false. fallback = .false. /\n"
        self.run_text(text, "-q", "--verbose", code=1)
        lines = self.blocks()[0][1]
        self.assertAlmostEqual(float(lines[1][5]) * float(lines[1][6]), 0.05, places=4)
        self.assertIn("failed: no convergence in 4 iterations", (self.path / "a.iterations.log").read_text())
        self.assertGreater(len(self.blocks()), 1)

    def test_nothing_changes(self):
        self.run_text(STRIP + STEP)
        plain = (self.path / "a.history.csv").read_bytes()
        self.assertFalse((self.path / "a.iterations.log").exists())
        self.assertNotIn("it  method", self.run_text(STRIP + STEP, "-q", "--verbose"))
        self.assertEqual((self.path / "a.history.csv").read_bytes(), plain)
        self.assertTrue(self.blocks())

    def test_steps_in_time_and_descents(self):
        self.run_text(STRIP + "&step control = 'dynamic' duration = 0.01 /\n", "-q", "--verbose")
        self.assertEqual(len(self.blocks()), len(self.history()))
        self.assertIn("Increment in time of", self.blocks()[0][0])
        self.run_text(STRIP + "&step control = 'relax' load_levels = 0.5 /\n", "-q", "--verbose")
        methods = {line[1] for _, lines in self.blocks() for line in lines}
        self.assertIn("relaxation", methods)
        sheet = """&mesh generator = 'disk' radius = 1 rings = 5 /
&material name = 'm' law = 'neo_hookean' mu = 1 /
&section material = 'm' thickness = 0.001 type = 'membrane' /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'pressure' pressure = 1e-4 /
&step fallback = .false. /
"""
        self.run_text(sheet, "-q", "--verbose")
        methods = {line[1].strip(",") for _, lines in self.blocks() for line in lines}
        self.assertTrue(methods <= {"Newton", "mixed", "descent", "leaning"}, methods)

    def test_restart_goes_on_with_the_log(self):
        self.run_text(STRIP + STEP.replace("load_factor = 1.0", "load_factor = 1.0 maximum_increments = 2"), "-q", "--verbose", code=1)
        before = (self.path / "a.iterations.log").read_text()
        (self.path / "b.nml").write_text(STRIP + STEP + "&job name = 'a' /\n")
        done = subprocess.run([PROGRAM, "restart", "-q", "--verbose", "a", "b.nml"], cwd=self.path, capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        after = (self.path / "a.iterations.log").read_text()
        self.assertTrue(after.startswith(before))
        self.assertGreater(len(after), len(before))

    def test_a_log_that_cannot_be_written(self):
        (self.path / "a.iterations.log").mkdir()
        (self.path / "a.nml").write_text(STRIP + STEP)
        done = subprocess.run([PROGRAM, "run", "--verbose", "a.nml"], cwd=self.path, capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("a.iterations.log: cannot write the log of iterations", done.stderr)
        self.assertEqual(sorted(p.name for p in self.path.iterdir()), ["a.iterations.log", "a.nml"])

    def test_where_it_belongs(self):
        (self.path / "a.nml").write_text(STRIP + STEP)
        for command in ("check", "study"):
            done = subprocess.run([PROGRAM, command, "--verbose", "a.nml"], cwd=self.path, capture_output=True, text=True, timeout=300, check=False)
            self.assertEqual(done.returncode, 2)
            self.assertIn("--verbose belongs to the commands run and restart", done.stderr)


if __name__ == "__main__":
    unittest.main()
