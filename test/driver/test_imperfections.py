#!/usr/bin/env python3
"""Initial imperfections: Koiter's cylinder; modes of a step, of results, of a file, waves; what they do to normals; refusals."""
import csv
import math
import os
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

EXAMPLE = Path(os.environ["FINSHELL_SOURCE_DIR"]) / "examples/axial_cylinder"
PANEL = """&job name = 'p' /
&mesh generator = 'cylinder' radius = {radius} length = 8.0 angles = -30.0, 30.0 divisions = 8, 8 diagonal = 'cross' /
&material name = 'm' law = 'linear_elastic' e = 1.0e4 nu = 0.3 density = 1.0 /
&section thickness = 0.1 /
&support node_set = 'edge_y0' type = 'clamped' /
"""
PUSH = "&load type = 'line' edge_set = 'edge_y1' vector = 0.0, -0.05, 0.0 /\n"
TIP = "&monitor name = 'v' quantity = 'displacement' component = 'y' node_set = 'edge_y1' /\n"
MODE = "&step control = 'buckling' modes = 2 /\n"
STATIC = "&step load_factor = 1.0 tolerance = 'tight' /\n"


def donnell(mu, terms=6, radius=100.0, t=1.0, nu=0.3):
    """Load over the classical one at which the axisymmetric path of a cylinder with the imperfection mu t cos(p x) branches, by Donnell's
    equations: w = sum_j C_j cos((2j+1) a x) cos(a y), a = p/2, stress function alike, Galerkin."""
    c = math.sqrt(3 * (1 - nu**2))
    p = math.sqrt(2 * c / (radius * t))
    a = p / 2
    k = (2 * np.arange(terms + 2) + 1) * a
    coupling = np.zeros((terms + 2, terms))  # cos(p x) cos(k_j x)
    for j in range(terms):
        for q in (2 * j + 3, abs(2 * j - 1)):
            coupling[(q - 1) // 2, j] += 0.5
    own = np.eye(terms + 2, terms)

    def lowest(load):
        b = mu * t / (1 - load)  # imperfection and prebuckling
        strain = own * k[:, None]**2 / radius - p**2 * b * a**2 * coupling
        s = np.diag(t**3 / (12 * (1 - nu**2)) * (k[:terms]**2 + a**2)**2 - load * t**2 / (radius * c) * k[:terms]**2)
        s += t * strain.T @ np.diag((k**2 + a**2)**-2.0) @ strain - t * load * b / radius * a**2 * coupling[:terms]
        return np.linalg.eigvalsh(s)[0]
    low, high = 0.0, 0.999
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if lowest(middle) > 0 else (low, middle)
    return low


class Imperfections(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def solve(self, text, code=0, name="p"):
        (self.path / f"{name}.nml").write_text(text)
        run = subprocess.run([os.environ["FINSHELL_BIN"], "run", f"{name}.nml"], cwd=self.path, capture_output=True, text=True, check=False,
                             env={**os.environ, "OMP_NUM_THREADS": "1"})
        self.assertEqual(run.returncode, code, run.stdout + run.stderr)
        if code == 2:
            return run.stderr
        found = sorted(self.path.glob("*.history.csv"), key=lambda p: p.stat().st_mtime)[-1]
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(found.read_text().splitlines())]

    def points(self, name="p"):
        with h5py.File(self.path / f"{name}.vtkhdf") as file:
            return file["VTKHDF/Points"][:], file["VTKHDF/PointData/displacement"][:]

    def test_koiter(self):
        for name, mu, delta in (("tenth", 0.1, 0.008), ("half", 0.5, 0.018)):
            rows = self.solve((EXAMPLE / f"{name}.nml").read_text())
            found = next(row["N"] for row in rows if row["critical_point"] > 0)
            self.assertAlmostEqual(found / donnell(mu), 1, delta=delta)
            x = 1.5 * math.sqrt(3 * 0.91) * mu
            leading = (2 + x - math.sqrt((2 + x)**2 - 4)) / 2  # (1 - load)**2 = x load
            self.assertAlmostEqual(leading, {0.1: 0.611, 0.5: 0.346}[mu], delta=5e-4)
            self.assertAlmostEqual(found / leading, 1, delta=0.08)

    def test_sources_agree(self):
        """A mode of the same input, of results, of a file: the same path."""
        text = PANEL.format(radius=10) + PUSH + TIP
        own = self.solve(text + "&imperfection step = 1 modes = 2, 1 amplitudes = 0.02, 0.03 /\n" + MODE + STATIC)
        perfect = self.solve(text + STATIC)
        self.assertGreater(abs(own[-1]["v"] / perfect[-1]["v"] - 1), 1e-7)
        self.solve(text.replace("'p'", "'modes'") + MODE, name="modes")
        results = self.solve(text + "&imperfection results = 'modes.vtkhdf' increments = 2, 1 amplitudes = 0.2, 0.3 times_thickness = .true. /\n" + STATIC)
        self.assertAlmostEqual(results[-1]["v"] / own[-1]["v"], 1, delta=1e-9)
        points, modes = self.points("modes")
        modes = modes.reshape(-1, len(points), 3)[-2:]
        np.savetxt(self.path / "field.csv", 0.02 * modes[1] + 0.03 * modes[0], delimiter=",", fmt="%.17g")
        given = self.solve(text + "&imperfection file = 'field.csv' /\n" + STATIC)
        self.assertAlmostEqual(given[-1]["v"] / own[-1]["v"], 1, delta=1e-9)
        np.testing.assert_allclose(self.points()[0] - points, 0.02 * modes[1] + 0.03 * modes[0], atol=1e-12)

    def test_normals_go_along(self):
        """A panel blown up to another radius, and one turned as a whole, are those that the generator makes."""
        step = "&step control = 'frequencies' modes = 3 /\n"
        text = PANEL.format(radius=10)
        self.solve(text + step)
        points = self.points()[0]
        plain = [row["load_factor"] for row in self.solve(PANEL.format(radius=10.5) + step)]
        np.savetxt(self.path / "grown.txt", points * [0.05, 0, 0.05], fmt="%.17g")
        grown = [row["load_factor"] for row in self.solve(text + "&imperfection file = 'grown.txt' /\n" + step)]
        np.testing.assert_allclose(grown, plain, rtol=5e-4)  # at free edges the facets say less
        plain = [row["load_factor"] for row in self.solve(text + step)]
        c, s = math.cos(0.7), math.sin(0.7)
        turned = points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
        np.savetxt(self.path / "turned.txt", turned - points, fmt="%.17g")
        found = [row["load_factor"] for row in self.solve(text + "&imperfection file = 'turned.txt' /\n" + step)]
        np.testing.assert_allclose(found, plain, rtol=1e-8)

    def test_waves(self):
        text = PANEL.format(radius=10) + PUSH + TIP
        self.solve(text + STATIC)
        perfect = self.points()[0]
        waves = "&imperfection wave_length = 4.0 seed = {} amplitudes = 0.05 /\n"
        found = []
        for seed in (1, 1, 2):
            self.solve(text + waves.format(seed) + STATIC)
            found.append(self.points()[0] - perfect)
        np.testing.assert_array_equal(found[0], found[1])
        self.assertGreater(np.abs(found[0] - found[2]).max(), 0.01)
        self.assertAlmostEqual(np.linalg.norm(found[0], axis=1).max(), 0.05, delta=1e-12)
        self.assertEqual(np.abs(found[0][perfect[:, 1] == 0]).max(), 0)  # what is held stays
        radial = perfect * [0.1, 0, 0.1]
        free = perfect[:, 1] > 0
        inside = np.abs(np.arctan2(perfect[:, 0], perfect[:, 2])) < 0.4
        self.assertLess(np.abs(np.cross(found[0], radial))[free & inside].max(), 0.05 * 0.05)
        # the same field on a finer mesh, but for its scale
        self.solve(text.replace("8, 8", "16, 16") + STATIC)
        fine = self.points()[0]
        self.solve(text.replace("8, 8", "16, 16") + waves.format(1) + STATIC)
        finer = self.points()[0] - fine
        pairs = [(i, j) for i, x in enumerate(perfect) for j in np.flatnonzero(np.abs(fine - x).max(axis=1) < 1e-9) if free[i] and inside[i]]
        a, b = (np.array([field[p[k]] for p in pairs]).ravel() for k, field in ((0, found[0]), (1, finer)))
        self.assertGreater(len(pairs), 50)
        self.assertGreater(a @ b / (np.linalg.norm(a) * np.linalg.norm(b)), 0.999)

    def refusal(self, text, *words):
        message = self.solve(text, code=2)
        for word in ("p.nml:6", "&imperfection", *words):
            self.assertIn(word, message)

    def test_refusals(self):
        start = PANEL.format(radius=10).replace("&job name = 'p' /\n", "") + "{}" + PUSH
        steps = MODE + STATIC
        for group, words, tail in (
                ("amplitudes = 1.0", ["expected is one of step"], steps),
                ("step = 1 file = 'x' amplitudes = 1.0", ["expected is one of step"], steps),
                ("step = 3 amplitudes = 1.0", ["2 steps; 3"], steps),
                ("step = 2 amplitudes = 1.0", ["has no modes"], steps),
                ("step = 2 amplitudes = 1.0", ["no step follows"], STATIC + MODE),
                ("step = 1 modes = 3 amplitudes = 1.0", ["2 modes; 3"], steps),
                ("step = 1 modes = 1, 2 amplitudes = 1.0", ["1 were found", "each of 2"], steps),
                ("file = 'nothing.txt'", ["nothing.txt"], steps),
                ("results = 'nothing.vtkhdf' increments = 1 amplitudes = 1.0", ["nothing.vtkhdf"], steps),
                ("wave_length = -1.0 amplitudes = 1.0", ["wave_length"], steps)):
            with self.subTest(group=group):
                text = "&job name = 'p' /\n" + start.format(f"&imperfection {group} /\n") + tail
                self.refusal(text, *words)
        (self.path / "still.txt").write_text(145 * "0 0 0\n")
        self.refusal("&job name = 'p' /\n" + start.format("&imperfection file = 'still.txt' /\n") + steps, "the field moves nothing")
        self.refusal("&job name = 'p' /\n" + start.format("&imperfection step = 1 modes = 40 amplitudes = 1.0 /\n").replace("8, 8", "2, 1")
                     + steps.replace("modes = 2", "modes = 40"), "mode 40 is wanted; step 1 has found ")
        (self.path / "short.txt").write_text("0 0 1\n")
        text = "&job name = 'p' /\n" + start.format("&imperfection file = 'short.txt' /\n") + steps
        self.refusal(text, "short.txt has 3 numbers")
        self.solve(text.replace("&imperfection file = 'short.txt' /\n", ""))
        self.refusal(text.replace("file = 'short.txt'", "results = 'p.vtkhdf' increments = 99 amplitudes = 1.0"), "has no fields of increment")
        self.refusal(text.replace("file = 'short.txt'", "results = 'p.vtkhdf' increments = 1 amplitudes = 1.0").replace("8, 8", "4, 4"), "another mesh")
        self.refusal(text.replace("file = 'short.txt'", "wave_length = 1.0 amplitudes = 1.0") + "&accuracy target = 0.1 /\n", "&accuracy")


if __name__ == "__main__":
    unittest.main()
