#!/usr/bin/env python3
"""The balance of energy in the history: stored energy against the work of loads, cases and supports; order of its error; restart."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np

PROGRAM = os.environ["FINSHELL_BIN"]
STRIP = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 10, 1 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0e6 density = 1000 /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&monitor name = 'u' quantity = 'displacement' component = 'z' node_set = 'corner_x1_y1' /
&monitor name = 'e' quantity = 'energy' /
&output energy = .true. restart = 'every' /
"""
LOAD = "&load type = 'force' node_set = 'corner_x1_y1' vector = 0.0, 0.0, 5.0 /\n"
STEP = "&step first_increment = {} automatic = .false. residual_tolerance = 1e-10 correction_tolerance = 1e-8 /\n"


class Energy(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def rows(self, text, name="a"):
        if text:
            (self.path / "a.nml").write_text(text)
            done = subprocess.run([PROGRAM, "run", "-q", "a.nml"], cwd=self.path, capture_output=True, text=True, timeout=120, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        with (self.path / f"{name}.history.csv").open() as file:
            return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]

    def check(self, rows):
        for row in rows:
            self.assertAlmostEqual(row["stored_energy"] / row["e"], 1, places=12)
            self.assertAlmostEqual(row["energy_residual"], row["stored_energy"] + row["damped"] - row["work"], delta=1e-12 * row["work"])

    def test_dead_load_and_order(self):
        """Work is the trapezoidal sum of load times displacement; what is left of the balance falls with the square of the increments."""
        left = []
        for size in (0.1, 0.05, 0.025):
            rows = self.rows(STRIP + LOAD + STEP.format(size))
            self.check(rows)
            p = 5.0 * np.array([0.0, *(row["load_factor"] for row in rows)])
            u = np.array([0.0, *(row["u"] for row in rows)])
            work = np.cumsum(0.5 * (p[1:] + p[:-1]) * np.diff(u))
            np.testing.assert_allclose([row["work"] for row in rows], work, rtol=1e-12)
            self.assertEqual({row["work_supports"] for row in rows}, {0.0})
            left.append(rows[-1]["energy_residual"] / rows[-1]["work"])
        self.assertLess(abs(left[-1]), 2e-3)
        self.assertAlmostEqual(left[0] / left[1], 4, delta=0.5)
        self.assertAlmostEqual(left[1] / left[2], 4, delta=0.3)

    def test_moved_supports(self):
        text = STRIP + "&support node_set = 'edge_x1' uz = 4.0 /\n" + STEP.format(0.05)
        text += "&monitor name = 'r' quantity = 'reaction' component = 'z' node_set = 'edge_x1' /\n"
        rows = self.rows(text)
        self.check(rows)
        r = np.array([0.0, *(row["r"] for row in rows)])
        u = np.array([0.0, *(row["u"] for row in rows)])
        np.testing.assert_allclose([row["work_supports"] for row in rows], np.cumsum(0.5 * (r[1:] + r[:-1]) * np.diff(u)), rtol=1e-9)
        self.assertEqual(rows[-1]["work"], rows[-1]["work_supports"])
        self.assertLess(abs(rows[-1]["energy_residual"] / rows[-1]["work"]), 2e-3)

    def test_cases_and_steps(self):
        """Each case has its work, since the step began; a follower pressure and a held dead load, too."""
        text = STRIP + LOAD.replace("5.0 /", "5.0 case = 'end' /") + "&load type = 'pressure' pressure = 3.0 /\n"
        text += STEP.format(0.05).replace("&step", "&step case = 'end'") + STEP.format(0.05)
        rows = self.rows(text)
        first = [row for row in rows if row["factor_end"] < 1 or row["load_factor"] == 1 and row is rows[19]]
        self.assertEqual(len(first), 20)
        for row in first:
            self.assertEqual(row["work_end"], row["work"])
        begin, last = rows[19], rows[-1]
        self.assertGreater(abs(last["work_end"]), 0)
        self.assertAlmostEqual(last["work_end"], 5.0 * (last["u"] - begin["u"]), delta=1e-9 * abs(last["work_end"]))
        self.assertNotEqual(last["work"], last["work_end"])
        change = last["e"] - begin["e"]
        self.assertAlmostEqual(last["energy_residual"], change - last["work"], delta=1e-10 * abs(change))
        self.assertLess(abs(last["energy_residual"]), 5e-3 * max(abs(change), abs(last["work_end"])))

    def test_constant_loads_and_stabilisation(self):
        text = STRIP + LOAD.replace("5.0 /", "5.0 constant = .true. /") + "&load type = 'line' edge_set = 'edge_x1' vector = 0, 0, 1 /\n"
        rows = self.rows(text + STEP.format(0.1).replace("&step", "&step stabilise = 1e-3"))
        self.check(rows)
        self.assertGreater(rows[-1]["damped"], 0)

    def test_steps_in_time(self):
        """The columns of motion have the works of static steps; in time the balance is that of the scheme."""
        text = STRIP + LOAD + STEP.format(0.1)
        text += "&step control = 'dynamic' duration = 0.05 load_factor = 0.5 scheme = 'conserving' /\n&step control = 'explicit' duration = 0.001 load_factor = 0.5 /\n"
        rows = self.rows(text)
        static = [row for row in rows if row["time"] == 0]
        self.assertEqual(len(static), 10)
        self.assertGreater(static[-1]["work"], 0)
        self.assertAlmostEqual(static[-1]["energy_residual"], static[-1]["stored_energy"] - static[-1]["work"], delta=1e-12)
        implicit = [row for row in rows if 0 < row["time"] <= 0.05 + 1e-12]
        for row in implicit:
            self.assertLess(abs(row["energy_residual"]), 1e-8 * row["stored_energy"])
        explicit = [row for row in rows if row["time"] > 0.05 + 1e-12]
        self.assertTrue(all(np.isnan(row["work_supports"]) for row in explicit))
        self.assertTrue(all(abs(row["energy_residual"]) < 1e-3 * row["stored_energy"] for row in explicit))

    def test_linear_steps_have_none(self):
        rows = self.rows(STRIP + LOAD + "&step control = 'linear' /\n")
        self.assertTrue(np.isnan(rows[0]["work"]) and np.isnan(rows[0]["energy_residual"]))

    def test_restart(self):
        text = STRIP + LOAD.replace("5.0 /", "5.0 case = 'end' /") + "&load type = 'pressure' pressure = 3.0 /\n"
        text += STEP.format(0.1).replace("&step", "&step case = 'end'") + STEP.format(0.1)
        self.rows(text)
        whole = (self.path / "a.history.csv").read_bytes()
        for at in (4, 10, 15):
            done = subprocess.run([PROGRAM, "restart", "-q", "a", "--from", str(at)], cwd=self.path, capture_output=True, text=True, timeout=300, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual((self.path / "a.history.csv").read_bytes(), whole)

    def test_nothing_else_changes(self):
        ours = self.rows(STRIP + LOAD + STEP.format(0.1))
        plain = self.rows((STRIP + LOAD + STEP.format(0.1)).replace("energy = .true.", ""))
        self.assertEqual([{k: row[k] for k in plain[0]} for row in ours], plain)
        self.assertEqual(set(ours[0]) - set(plain[0]), {"stored_energy", "work", "damped", "work_supports", "energy_residual"})

    def test_names_of_columns(self):
        text = STRIP.replace("name = 'u'", "name = 'work'") + LOAD + STEP.format(0.1)
        (self.path / "a.nml").write_text(text)
        done = subprocess.run([PROGRAM, "check", "a.nml"], cwd=self.path, capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("a.nml:5: &monitor name: the history has a column 'work' of its own", done.stderr)


if __name__ == "__main__":
    unittest.main()
