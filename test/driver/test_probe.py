#!/usr/bin/env python3
"""Probes: fields along lines, in the reference and in the deformed surface, against the result file and against closed forms."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
import pyvista

PROGRAM = os.environ["FINSHELL_BIN"]
STRIP = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 20, 2 distortion = 0.2 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0e6 density = 1000 /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0, 20.0 /
"""
STEP = "&step first_increment = 0.25 automatic = .false. /\n"
LINE = "&probe name = 'line' from = 0.3, 0.4, 0 to = 9.7, 0.6, 0 points = 11 "


class Probes(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def run_text(self, text, code=0):
        (self.path / "a.nml").write_text(text)
        done = subprocess.run([PROGRAM, "run", "-q", "a.nml"], cwd=self.path, capture_output=True, text=True, timeout=120, check=False)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done

    def rows(self, name="line"):
        with (self.path / f"a.{name}.csv").open() as file:
            rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
        return {i: [row for row in rows if row["increment"] == i] for i in sorted({row["increment"] for row in rows})}

    def grid(self, step):
        reader = pyvista.get_reader(self.path / "a.vtkhdf")
        reader.reader.UpdateInformation()
        reader.reader.SetStep(step)
        return reader.read()

    def test_along_a_line_of_the_reference(self):
        fields = "fields = 'displacement', 'rotation', 'thickness_stretch', 'stress'"
        self.run_text(STRIP + STEP + LINE + fields + " /\n&output " + fields + " /\n")
        rows = self.rows()
        self.assertEqual(list(rows), [0, 1, 2, 3, 4])
        for step, line in enumerate(rows.values()):
            grid = self.grid(step)
            self.assertEqual(len(line), 11)
            points = np.linspace([0.3, 0.4, 0], [9.7, 0.6, 0], 11)
            np.testing.assert_allclose([r["s"] for r in line], np.linspace(0, np.linalg.norm(points[-1] - points[0]), 11), rtol=1e-12)
            for point, row in zip(points, line):
                self.assertLess(row["distance"], 1e-12)
                element = int(row["element"]) - 1
                corners = grid.cells.reshape(-1, 4)[element, 1:]
                weights = np.linalg.lstsq(np.vstack([grid.points[corners].T[:2], np.ones(3)]), [*point[:2], 1], rcond=None)[0]
                self.assertTrue(np.all(weights > -1e-12))
                moved = point + weights @ grid.point_data["displacement"][corners]
                np.testing.assert_allclose([row[k] for k in "xyz"], moved, atol=1e-12)
                for field in ("displacement", "rotation"):
                    np.testing.assert_allclose([row[f"{field}_{k}"] for k in "xyz"], weights @ grid.point_data[field][corners], atol=1e-12)
                self.assertAlmostEqual(row["thickness_stretch"], grid.cell_data["thickness_stretch"][element], places=14)
                for place in ("bottom", "middle", "top"):
                    ours = [row[f"stress_{place}_{k}"] for k in ("11", "22", "12")]
                    np.testing.assert_allclose(ours, grid.cell_data[f"stress_{place}"][element], rtol=1e-13)

    def test_in_the_deformed_surface(self):
        """A sphere blown up: radial lines of the deformed surface meet it where it is; points beside it are projected."""
        text = """&mesh generator = 'sphere' radius = 10.0 colatitudes = 18.0, 90.0 azimuths = 0.0, 90.0 divisions = 12, 12 /
&material name = 'm' law = 'neo_hookean' mu = 1 /
&section material = 'm' thickness = 0.1 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'edge_bottom' type = 'symmetry_z' /
&support node_set = 'edge_top' fixed = 'rx', 'ry', 'rz' /
&load type = 'pressure' pressure = 0.004 /
&step /
&probe name = 'line' from = 13, 0.5, 0.5 to = 9, 9, 0.5 points = 7 deformed = .true. /
"""
        self.run_text(text)
        for step, line in self.rows().items():
            grid = self.grid(int(step))
            x = grid.points + grid.point_data["displacement"]
            surface = pyvista.PolyData(x, grid.cells)
            points = np.linspace([13, 0.5, 0.5], [9, 9, 0.5], 7)
            _, nearest = surface.find_closest_cell(points, return_closest_point=True)
            np.testing.assert_allclose([[r[k] for k in "xyz"] for r in line], nearest, atol=2e-5)
            np.testing.assert_allclose([r["distance"] for r in line], np.linalg.norm(points - nearest, axis=1), atol=2e-5)
            # the nearest point lies in the element that is named; on an edge there are two
            for r, point in zip(line, nearest):
                a, b, c = x[grid.cells.reshape(-1, 4)[int(r["element"]) - 1, 1:]]
                weights = np.linalg.lstsq(np.array([b - a, c - a]).T, point - a, rcond=None)[0]
                self.assertGreater(min(*weights, 1 - sum(weights)), -1e-4)

    def test_when_and_missing(self):
        self.run_text(STRIP + STEP + LINE + "every = 3 fields = 'fibre_stretch' /\n")
        rows = self.rows()
        self.assertEqual(list(rows), [0, 3, 4])
        self.assertTrue(np.isnan(rows[4][0]["fibre_stretch_layer1_1"]))

    def test_time_and_modes(self):
        self.run_text(STRIP + "&step control = 'dynamic' duration = 0.01 /\n" + LINE + "fields = 'velocity' /\n")
        rows = self.rows()
        self.assertAlmostEqual(rows[max(rows)][0]["time"], 0.01, places=12)
        self.assertGreater(rows[max(rows)][-1]["velocity_z"], 0)
        self.run_text(STRIP + "&step control = 'linear' /\n&step control = 'frequencies' modes = 2 /\n" + LINE + "every = 7 /\n")
        rows = self.rows()
        self.assertEqual(list(rows), [0, 1, 2, 3])
        self.assertAlmostEqual(max(abs(r["displacement_z"]) for r in rows[2]), 1, delta=0.1)

    def test_restart(self):
        text = STRIP + STEP + LINE + "fields = 'stress', 'displacement' /\n" + LINE.replace("'line'", "'late'") + "every = 2 deformed = .true. /\n"
        text += "&output restart = 'every' /\n"
        self.run_text(text)
        before = {name: (self.path / f"a.{name}.csv").read_bytes() for name in ("line", "late")}
        for at in ("1", "2"):
            done = subprocess.run([PROGRAM, "restart", "-q", "a", "--from", at], cwd=self.path, capture_output=True, text=True, timeout=300, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual({name: (self.path / f"a.{name}.csv").read_bytes() for name in before}, before)
        (self.path / "b.nml").write_text(text.replace("'stress', 'displacement'", "'strain'") + "&job name = 'a' /\n")
        done = subprocess.run([PROGRAM, "restart", "-q", "a", "b.nml", "--from", "2"], cwd=self.path, capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("a.line.csv: cannot restart: the file has the columns", done.stderr)

    def test_refusals(self):
        begin = STRIP + STEP + "&probe name = 'p' from = 0, 0, 0 "
        for text, words in (
            (begin, "to is required"),
            (begin + "to = 0, 0, 0", "the line has no length"),
            (begin + "to = 1, 0, 0 points = 1", "points"),
            (begin + "to = 1, 0, 0 fields = 'reaction'", "reaction belongs to nodes and has no value between them"),
            (begin + "to = 1, 0, 0 fields = 'volume'", "volume"),
            (begin.replace("'p'", "'history'") + "to = 1, 0, 0", "is the name of another table of the run"),
            (begin + "to = 1, 0, 0 /\n&probe name = 'p' from = 0, 0, 0 to = 0, 1, 0", "there is a probe 'p' already"),
        ):
            with self.subTest(text=text):
                self.assertIn(words, self.run_text(text + " /\n", code=2).stderr)


if __name__ == "__main__":
    unittest.main()
