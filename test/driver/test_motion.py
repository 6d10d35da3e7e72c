#!/usr/bin/env python3
"""Steps in time through the program: columns, times and fields of motions, mixed steps, studies, and runs that go on within them."""
import csv
import os
import re
import shutil
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

SHEET = """&job name = 'm' /
&mesh generator = 'rectangle' lengths = 1.0, 0.2 divisions = 6, 1 /
&material name = 'm' law = 'linear_elastic' e = 1.0e5 nu = 0.3 density = 2.0 /
&section thickness = 0.02 /
&monitor name = 'v' quantity = 'velocity' component = 'z' node_set = 'corner_x1_y1' /
&monitor name = 'p' quantity = 'momentum' component = 'z' /
&monitor name = 'l' quantity = 'angular_momentum' component = 'z' /
&monitor name = 'k' quantity = 'kinetic_energy' /
&monitor name = 't' quantity = 'time' /
"""
HELD = "&support node_set = 'edge_x0' type = 'clamped' /\n"
GRAVITY = "&load type = 'gravity' vector = 0, 0, -1 /\n"
MASS = 2.0 * 0.2 * 0.02
MIXED = SHEET + HELD + GRAVITY + """&step load_factor = 1 /
&step control = 'dynamic' duration = 0.01 load_factor = 0 mass_damping = 20 stiffness_damping = 1e-4 /
&step control = 'dynamic' duration = 0.005 times = 0.005 factors = 2.0 scheme = 'conserving' output_interval = 0.001 /
&step control = 'explicit' duration = 0.005 load_factor = 0 mass_damping = 20 history_rows = 7 /
&step load_factor = 0 /
&step control = 'frequencies' modes = 2 /
&step load_factor = -1 /
&initial_velocity velocity = 0, 0, 1 /
&output fields = 'velocity', 'acceleration', 'spin' /
"""


class Motion(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)

    def run_program(self, *arguments, code=0):
        run = subprocess.run([os.environ["FINSHELL_BIN"], *arguments], cwd=self.path, capture_output=True, text=True, check=False, timeout=300,
                             env={**os.environ, "OMP_NUM_THREADS": "1"})
        self.assertEqual(run.returncode, code, run.stdout + run.stderr)
        return run.stdout + run.stderr

    def solve(self, text):
        """Rows of the history as numbers, and what was printed."""
        (self.path / "m.nml").write_text(text)
        printed = self.run_program("run", "m.nml")
        return self.rows(), printed

    def rows(self, folder=""):
        lines = (self.path / folder / "m.history.csv").read_text().splitlines()
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(lines)]

    def test_a_thrown_and_turning_sheet(self):
        """Free flight: momentum and angular momentum stay, and the monitors are the columns."""
        for control in ("dynamic' scheme = 'conserving", "explicit"):
            text = SHEET + f"&step control = '{control}' duration = 0.05 /\n" + "&initial_velocity velocity = 0, 0, 3 /\n" \
                + "&initial_velocity spin = 0, 0, 2 origin = 0.5, 0.1, 0 /\n"
            rows, printed = self.solve(text)
            self.assertIn("time 5.000000E-02", printed)
            inertia = MASS * (1.0 + 0.04) / 12  # of the continuum; lumped masses have more
            for row in rows:
                self.assertAlmostEqual(row["momentum_z"], 3 * MASS, delta=1e-9)
                self.assertAlmostEqual(row["momentum_x"], 0, delta=1e-9)
                self.assertAlmostEqual(row["angular_momentum_z"], rows[0]["angular_momentum_z"], delta=1e-8)
                self.assertEqual([row[key] for key in ("p", "l", "k", "t")],
                                 [row[key] for key in ("momentum_z", "angular_momentum_z", "kinetic_energy", "time")])
                # the sheet stretches a little as it turns
                self.assertAlmostEqual(row["kinetic_energy"] + row["stored_energy"],
                                       rows[0]["kinetic_energy"] + rows[0]["stored_energy"], delta=2e-4 * row["kinetic_energy"])
            self.assertGreater(rows[0]["angular_momentum_z"], 2 * inertia)
            self.assertLess(rows[0]["angular_momentum_z"], 2 * inertia * 1.3)
            self.assertAlmostEqual(rows[-1]["time"], 0.05, delta=1e-15)

    def test_mixed_steps(self):
        rows, printed = self.solve(MIXED)
        self.assertEqual(len(re.findall("negative pivots +CPU", printed)), 1)
        self.assertRegex(printed, r"load factor +time +v +p")
        times = [row["time"] for row in rows]
        self.assertEqual(times, sorted(times))
        self.assertAlmostEqual(times[-1], 0.02, delta=1e-12)
        at_rest = [row for row in rows if row["time"] == 0 or row["time"] == times[-1]]
        self.assertTrue(all(row["stored_energy"] >= 0 for row in rows))
        self.assertEqual({row["kinetic_energy"] for row in at_rest if row["v"] == 0}, {0.0})
        self.assertGreater(max(row["kinetic_energy"] for row in rows), 1e-4)
        # the static answers before and after the motion are those without it
        self.assertAlmostEqual(rows[3]["stored_energy"], rows[-1]["stored_energy"], delta=2e-2 * rows[3]["stored_energy"])
        # moving: what is stored and kinetic is what was there and came in
        fall = [row for row in rows if 0 < row["time"] <= 0.01 and row["kinetic_energy"] > 0]
        total = [row["kinetic_energy"] + row["stored_energy"] + row["damped"] - row["work"] for row in fall]
        self.assertAlmostEqual(max(total), min(total), delta=0.02 * max(total))
        with h5py.File(self.path / "m.vtkhdf") as file:
            steps = file["VTKHDF/Steps"].attrs["NSteps"]
            values, exact = file["VTKHDF/Steps/Values"][:], file["VTKHDF/FieldData/time"][:]
            increments = file["finshell/history/increment"][:]
            velocity = np.split(file["VTKHDF/PointData/velocity"][:], steps)
            acceleration = np.split(file["VTKHDF/PointData/acceleration"][:], steps)
        self.assertTrue(np.all(np.diff(values) > 0))
        self.assertLess(np.max(np.abs(values - exact)), 0.02 * 1e-9 * 20)
        by_increment = {int(row["increment"]): row for row in rows}
        for k, v, a in zip(increments[1:], velocity[1:], acceleration[1:]):
            self.assertEqual(v[:, 2].max() == 0 and a.max() == 0, by_increment[int(k)]["kinetic_energy"] == 0)
        conserving = sorted(t for t in exact if 0.0105 < t < 0.0151)
        np.testing.assert_allclose(conserving, [0.011, 0.012, 0.013, 0.014, 0.015], atol=1e-12)

    def test_goes_on_within_a_motion(self):
        """From any increment that was kept: the same rows and fields, bit for bit."""
        output = "&output fields = 'velocity', 'acceleration', 'spin' "
        text = MIXED.replace(output, output + "restart = 'every' ")
        self.assertNotEqual(text, MIXED)
        (self.path / "whole").mkdir()
        (self.path / "m.nml").write_text(text)
        self.run_program("run", "m.nml", "-o", "whole", "-q")
        whole = (self.path / "whole/m.history.csv").read_text()
        refusal = self.run_program("restart", "whole/m", "--from", "100000", code=2)
        self.assertIn("expected is one of 0, 1, 2, 3, 4, 5", refusal)
        kept, times = 0, set()
        rows = self.rows("whole")
        for row in rows[:: max(1, len(rows) // 40)] + rows[-20:]:
            shutil.rmtree(self.path / "again", ignore_errors=True)
            shutil.copytree(self.path / "whole", self.path / "again")
            run = subprocess.run([os.environ["FINSHELL_BIN"], "restart", "again/m", "--from", str(int(row["increment"])), "-q"], cwd=self.path,
                                 capture_output=True, text=True, check=False, env={**os.environ, "OMP_NUM_THREADS": "1"})
            if "cannot restart from increment" in run.stderr:
                continue
            self.assertEqual(run.returncode, 0, run.stderr)
            kept += 1
            times.add(row["time"])
            self.assertEqual((self.path / "again/m.history.csv").read_text(), whole, row["increment"])
            with h5py.File(self.path / "again/m.vtkhdf") as found, h5py.File(self.path / "whole/m.vtkhdf") as expected:
                for name in ("VTKHDF/Steps/Values", "VTKHDF/FieldData/time", "VTKHDF/PointData/velocity", "VTKHDF/PointData/spin",
                             "VTKHDF/PointData/acceleration", "VTKHDF/PointData/displacement"):
                    np.testing.assert_array_equal(found[name][:], expected[name][:])
        self.assertGreater(kept, 20)
        self.assertGreater(len([t for t in times if 0 < t < 0.01]), 3)
        self.assertGreater(len([t for t in times if 0.01 < t < 0.015]), 0)
        self.assertGreater(len([t for t in times if 0.015 < t < 0.02]), 3)

    def test_a_study_of_a_motion(self):
        (self.path / "m.nml").write_text(SHEET.replace("'m' /", "'m' /", 1).replace("divisions = 6, 1", "divisions = 4, 2") + HELD + GRAVITY
                                         + "&step control = 'explicit' duration = 0.02 load_factor = 1 /\n")
        printed = self.run_program("study", "m.nml", "--levels", "3")
        self.assertIn("level 1", printed)
        last = (self.path / "m.study.csv").read_text()
        self.assertIn("v", last.splitlines()[0])

    def test_amplitude_in_mixed_iterations(self):
        # what follows the time is that of the end of the increment, however the iteration goes
        rows, _ = self.solve(SHEET + HELD + """&amplitude name = 'a' over = 'time' points = 0.0, 0.0, 0.1, 1.0, 0.3, -1.0 /
&support node_set = 'edge_x1' uy = 0.01 amplitude = 'a' /
&monitor name = 'u' quantity = 'displacement' component = 'y' node_set = 'edge_x1' /
&step control = 'dynamic' duration = 0.4 automatic = .false. first_increment = 0.02 mixed = .true. /
""")
        self.assertEqual(len(rows), 20)
        for row in rows:
            self.assertAlmostEqual(row["u"], 0.01 * np.interp(row["time"], [0.0, 0.1, 0.3], [0.0, 1.0, -1.0]), delta=1e-12)


if __name__ == "__main__":
    unittest.main()
