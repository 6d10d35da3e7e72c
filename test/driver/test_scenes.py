#!/usr/bin/env python3
"""Real uses among the examples, as they stand in examples/: a bending actuator, a stiffened panel, a valve leaflet, against numbers from outside."""
import csv
import os
import subprocess
import sys
import tempfile
import unittest
from math import cos, pi, sin
from pathlib import Path

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
EXAMPLES = SOURCE / "examples"
sys.path.insert(0, str(SOURCE / "bench"))
import scene_meshes  # noqa: E402


def table(text):
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def arc(pressure, radius=6.0, wall=0.6, mu=0.1, strip=300 / (1 - 0.3**2), at=30.0):
    """Point of the strip at a distance from the middle: (v, w) of a tube whose sections stay plane and round (README of the example)."""
    def unbalanced(e, k):
        force = moment = 0.0
        n = 1600
        for i in range(n):   # midpoints: the half section, the strip on its last sixteenth
            phi = pi * (i + 0.5) / n
            stretch = 1 + e + k * radius * cos(phi)
            p = mu * wall * (stretch - stretch**-3) + (strip * (stretch - 1) if i >= 15 * n // 16 else 0.0)
            force += 2 * p * radius * pi / n
            moment += 2 * p * cos(phi) * radius**2 * pi / n
        return force - pressure * pi * radius**2, moment
    e, k = pressure, pressure / 10
    for _ in range(30):
        f, g = unbalanced(e, k)
        (fe, ge), (fk, gk) = ([(b - a) / 1e-7 for a, b in zip((f, g), unbalanced(*x))] for x in ((e + 1e-7, k), (e, k + 1e-7)))
        d = fe * gk - fk * ge
        e, k = e - (f * gk - g * fk) / d, k - (fe * g - ge * f) / d
    bottom = 1 + e - k * radius
    k /= bottom
    s = at * bottom
    return sin(k * s) / k - at, -(1 - cos(k * s)) / k


class Scenes(unittest.TestCase):
    def solve(self, folder, text=None, files=()):
        with tempfile.TemporaryDirectory() as work:
            for name, content in dict(files).items():
                (Path(work) / name).write_text(content)
            source = EXAMPLES / folder / "input.nml"
            if text is not None:
                source = Path(work) / "input.nml"
                source.write_text(text)
            run = subprocess.run([os.environ["FINSHELL_BIN"], "run", str(source)], cwd=work, capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            return [{k: float(v) for k, v in row.items()} for row in table((Path(work) / f"{folder}.history.csv").read_text())]

    def test_files_are_what_the_builder_writes(self):
        for name, n in scene_meshes.FILES.items():
            text, files = scene_meshes.BUILDERS[name](n)
            for file, content in {"input.nml": text, **files}.items():
                self.assertEqual((EXAMPLES / name / file).read_text(), content, f"examples/{name}/{file}: python3 bench/scene_meshes.py")

    def test_bending_actuator(self):
        rows = {row["load_factor"]: row for row in self.solve("bending_actuator")}
        for expected in table((EXAMPLES / "bending_actuator/reference.csv").read_text()):
            p, v, w = (float(expected[key]) for key in ("pressure", "v", "w"))
            self.assertAlmostEqual(arc(p)[0], v, delta=1e-4)
            self.assertAlmostEqual(arc(p)[1], w, delta=1e-4)
            self.assertAlmostEqual(rows[p / 0.02]["w"] / w, 1, delta=0.011)
            self.assertAlmostEqual(rows[p / 0.02]["v"], v, delta=0.012 * abs(w))

    def test_stiffened_panel(self):
        rows = self.solve("stiffened_panel")
        for row, expected in zip((rows[0], rows[-1]), table((EXAMPLES / "stiffened_panel/reference.csv").read_text())):
            for name in ("w_edge", "w_root", "w_tip"):
                self.assertAlmostEqual(row[name] / float(expected[name]), 1, delta=0.011, msg=f"{name}, {expected['step']}")

    def test_valve_leaflet(self):
        text = (EXAMPLES / "valve_leaflet/input.nml").read_text().replace("divisions = 24, 16", "divisions = 12, 8")
        loaded = self.solve("valve_leaflet", text)[-1]
        relaxed = self.solve("valve_leaflet", text.replace("&step", "&step control = 'relax'"))[-1]
        self.assertEqual((loaded["load_factor"], relaxed["load_factor"]), (1, 1))
        self.assertAlmostEqual(loaded["w"], -12.007, delta=0.01)
        self.assertAlmostEqual(relaxed["w"], loaded["w"], delta=0.005)


if __name__ == "__main__":
    unittest.main()
