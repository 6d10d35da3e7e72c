#!/usr/bin/env python3
"""Growth, prestretch and heat through the program, against closed forms."""
import csv
import math
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

REFERENCE = """&material name = 'm' law = 'linear_elastic' e = 1000.0 nu = 0.3 density = 1.0 /
"""
SQUARE = """&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 6, 4 /
&material name = 'r' law = 'neo_hookean' mu = 1.0 density = 1.0 /
&support node_set = 'centre' fixed = 'ux', 'uy', 'uz', 'rx', 'ry', 'rz' /
&monitor name = 'x' quantity = 'displacement' component = 'x' node_set = 'edge_x1' /
&monitor name = 'y' quantity = 'displacement' component = 'y' node_set = 'edge_y1' /
&monitor name = 'energy' quantity = 'energy' /
"""
#: A strip of two layers, cut along its middle lines: growth in the plane bends it to a sphere.
BILAYER = """&mesh generator = 'rectangle' lengths = 1.0, 1.0 divisions = 6, 6 /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&node_set name = 'corner' x = 0.0, 0.0 y = 0.0, 0.0 /
&node_set name = 'far' x = 1.0, 1.0 y = 0.0, 0.0 /
&support node_set = 'corner' fixed = 'uz' /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'far' /
"""
BAR = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 10, 2 /
&section thickness = 0.2 /
&support node_set = 'edge_x0' fixed = 'ux', 'uz', 'rx', 'ry', 'rz' /
&support node_set = 'edge_x1' fixed = 'ux', 'uz', 'rx', 'ry', 'rz' /
&node_set name = 'corner' x = 0.0, 0.0 y = 0.0, 0.0 /
&support node_set = 'corner' fixed = 'uy' /
&monitor name = 'R' quantity = 'reaction' component = 'x' node_set = 'edge_x1' /
""" + REFERENCE


class Growth(unittest.TestCase):
    def run_in(self, folder, text, code=0, command="run"):
        (Path(folder) / "c.nml").write_text(text)
        run = subprocess.run([os.environ["FINSHELL_BIN"], command, "c.nml"], cwd=folder, capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, code, run.stdout + run.stderr)
        if code == 2:
            return run.stderr
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader((Path(folder) / "c.history.csv").read_text().splitlines())]

    def solve(self, text, code=0):
        with tempfile.TemporaryDirectory() as folder:
            return self.run_in(folder, text, code)

    def test_free_growth_stores_nothing(self):
        # exact sizes, whatever the stretches, the section and the angle of its layers
        step = "&step tolerance = 'tight' /\n"
        for section, growth, x, y in (("", "growth = 1.5", 1.5, 1.5), ("", "growth = 1.3, 0.8", 1.3, 0.8), ("", "growth = 1.3, 0.8, 1.1", 1.3, 0.8),
                                      ("angle = 90", "growth = 1.3, 0.8", 0.8, 1.3), ("angle = 90", "growth = 1.3, 0.8 angle = -90", 1.3, 0.8),
                                      ("", "prestretch = 1.25", 0.8, 0.8), ("", "prestretch = 1.25, 1.6", 0.8, 0.625),
                                      ("", "expansion = 1e-3, 2e-3 temperature = 100", 1.1, 1.2), ("type = 'membrane'", "growth = 1.3, 0.8", 1.3, 0.8)):
            with self.subTest(section=section, growth=growth):
                held = "&support node_set = 'all' fixed = 'uz' /\n" if "membrane" in section else ""
                row = self.solve(SQUARE + held + f"&section thickness = 0.05 {section} /\n&growth {growth} /\n" + step)[-1]
                self.assertAlmostEqual(1 + row["x"], x, delta=1e-9)
                self.assertAlmostEqual(1 + 2 * row["y"], y, delta=1e-9)
                self.assertLess(abs(row["energy"]), 1e-12)

    def test_several_growths_multiply(self):
        row = self.solve(SQUARE + "&section thickness = 0.05 /\n&growth growth = 1.2, 1.0 /\n&growth prestretch = 2.0, 1.0 constant = .true. /\n"
                         "&step tolerance = 'tight' /\n")[-1]
        self.assertAlmostEqual(1 + row["x"], 0.6, delta=1e-9)
        self.assertAlmostEqual(row["y"], 0, delta=1e-9)

    def test_sphere_grows(self):
        # an eighth of a sphere keeps its shape
        row = self.solve("&mesh generator = 'sphere' radius = 1.0 colatitudes = 0, 90 azimuths = 0, 90 divisions = 8, 8 /\n"
                         "&material name = 'r' law = 'neo_hookean' mu = 1.0 /\n&section thickness = 0.05 /\n&growth growth = 1.4 /\n"
                         "&support node_set = 'edge_bottom' type = 'symmetry_z' /\n&support node_set = 'edge_a0' type = 'symmetry_y' /\n"
                         "&support node_set = 'edge_a1' type = 'symmetry_x' /\n&monitor name = 'energy' quantity = 'energy' /\n"
                         "&monitor name = 'z' quantity = 'displacement' component = 'z' node_set = 'pole_top' /\n&step tolerance = 'tight' /\n")[-1]
        self.assertAlmostEqual(1 + row["z"], 1.4, delta=1e-6)
        self.assertLess(abs(row["energy"]), 1e-9)

    def test_two_layers_bend(self):
        # Timoshenko 1925; reference/bilayer_growth_curvature
        nu, h, strain = 0.3, 0.01, 1e-6
        for m, n, expected in ((1, 1, 1.5), (1, 0.1, 0.995850622), (0.5, 10, 1.42857143), (0.2, 0.1, 0.156067109), (0.2, 10, 1.45454545)):
            with self.subTest(m=m, n=n):
                t2 = h / (1 + m)
                row = self.solve(BILAYER + f"&material name = 'a' law = 'linear_elastic' e = {n * 1000} nu = {nu} /\n"
                                 f"&material name = 'b' law = 'linear_elastic' e = 1000 nu = {nu} /\n"
                                 f"&section material = 'a', 'b' thickness = {m * t2}, {t2} /\n&growth growth = {1 + strain} layer = 1 /\n"
                                 "&step control = 'linear' /\n")[-1]
                self.assertAlmostEqual(2 * row["w"] * h / strain, expected, delta=2e-6)

    def test_held_bar(self):
        # thermal force E A alpha T of a bar between walls, by a linear step and by others; the energy balance closes
        heat = "&growth expansion = 1e-4 temperature = 50 /\n"
        force = 1000 * 0.2 * 1e-4 * 50
        linear = self.solve(BAR + heat + "&step control = 'linear' /\n")[-1]
        self.assertAlmostEqual(linear["R"] / -force, 1, delta=1e-6)
        rows = self.solve(BAR + heat + "&step tolerance = 'tight' /\n&output energy = .true. /\n")
        self.assertAlmostEqual(rows[-1]["R"] / -force, 1, delta=0.02)
        self.assertAlmostEqual(rows[-1]["stored_energy"], force * 50 * 1e-4 * 10 / 2, delta=0.03 * rows[-1]["stored_energy"])
        self.assertLess(abs(rows[-1]["energy_residual"]), 0.02 * rows[-1]["stored_energy"])
        self.assertEqual(rows[-1]["work_supports"], 0)

    def test_histories(self):
        # cases, amplitudes, steps: forces go by the present growth alone
        def force(growth, steps, name="R"):
            return [row[name] for row in self.solve(BAR + growth + steps)]
        tight = " tolerance = 'tight' first_increment = 1.0"
        full = force("&growth expansion = 1e-4 temperature = 50 /\n", f"&step {tight} /\n")[-1]
        half = force("&growth expansion = 1e-4 temperature = 25 /\n", f"&step {tight} /\n")[-1]
        heat = "&growth expansion = 1e-4 temperature = 50 case = 'heat' /\n&load type = 'traction' vector = 0, 0, 1e-9 /\n"
        rows = self.solve(BAR + heat + f"&step case = 'heat' {tight} /\n&step {tight} /\n&step case = 'heat' load_factor = 0.5 {tight} /\n")
        by_factor = {(row["factor_heat"], row["load_factor"]): row["R"] for row in rows}
        self.assertAlmostEqual(rows[-1]["R"] / half, 1, delta=1e-6)
        self.assertIn((1.0, 1.0), by_factor)
        self.assertAlmostEqual(by_factor[1.0, 1.0] / full, 1, delta=1e-6)
        rows = self.solve(BAR + "&amplitude name = 'up' points = 0, 0, 0.5, 1, 1, 0.5 /\n&growth expansion = 1e-4 temperature = 50 amplitude = 'up' /\n"
                          f"&step {tight} /\n")
        self.assertAlmostEqual(rows[-1]["R"] / half, 1, delta=1e-6)
        self.assertAlmostEqual(next(row["R"] for row in rows if row["load_factor"] == 0.5) / full, 1, delta=1e-6)
        rows = self.solve(BAR + "&growth expansion = 1e-4 temperature = 50 constant = .true. until_step = 1 /\n"
                          "&growth expansion = 1e-4 temperature = 25 constant = .true. from_step = 2 /\n"
                          f"&load type = 'traction' vector = 0, 0, 1e-9 /\n&step {tight} /\n&step load_factor = 0.0 {tight} /\n")
        self.assertAlmostEqual(rows[0]["R"] / full, 1, delta=1e-5)
        self.assertAlmostEqual(rows[-1]["R"] / half, 1, delta=1e-5)

    def test_heated_plate_buckles(self):
        # clamped circular plate: N = 14.682 D/R^2 (Timoshenko and Gere), N = E h alpha T/(1 - nu)
        nu, h, radius = 0.3, 0.02, 1.0
        d = 1000 * h**3 / 12 / (1 - nu**2)
        critical = 14.682 * d / radius**2 * (1 - nu) / (1000 * h)
        text = (f"&mesh generator = 'disk' radius = {radius} rings = 16 core = 6 /\n" + REFERENCE + f"&section thickness = {h} /\n"
                "&support node_set = 'rim' type = 'clamped' /\n&growth expansion = 1e-3 temperature = 0.1 /\n")
        row = self.solve(text + "&step control = 'buckling' modes = 1 /\n")[-1]
        self.assertAlmostEqual(row["load_factor"] * 1e-4 / critical, 1, delta=0.01)

    def test_arc_length(self):
        # a shallow bimetal arch would do; here a heated strip that buckles: arc-length and load control agree behind it
        text = BAR.replace("'rx', 'ry', 'rz'", "'rx', 'rz'") + "&growth expansion = 1e-3 temperature = 2 /\n&node_set name = 'middle' x = 5.0, 5.0 /\n" \
            "&load type = 'traction' vector = 0, 0, 1e-5 constant = .true. /\n&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'middle' /\n"
        load = self.solve(text + "&step tolerance = 'tight' /\n")[-1]
        arc = self.solve(text + "&step control = 'arc_length' tolerance = 'tight' load_levels = 1.0 /\n")[-1]
        self.assertEqual(arc["load_factor"], 1)
        self.assertGreater(load["w"], 0.1)
        self.assertAlmostEqual(arc["w"] / load["w"], 1, delta=1e-6)

    def test_prestretched_drum(self):
        # reference/vibration_prestretched_membrane: f a sqrt(rho/mu) by the stretched mesh, radius lam a
        for lam, expected in ((1.1, 0.25258688), (1.5, 0.365553351)):
            text = (f"&mesh generator = 'disk' radius = {lam} rings = 16 core = 6 /\n&material name = 'r' law = 'neo_hookean' mu = 1.0 density = 1.0 /\n"
                    f"&section thickness = 1e-3 /\n&support node_set = 'rim' type = 'hinged' /\n&growth prestretch = {lam} constant = .true. /\n"
                    "&step load_factor = 0.0 tolerance = 'tight' /\n&step control = 'frequencies' modes = 1 /\n")
            rows = self.solve(text)
            self.assertAlmostEqual(rows[-1]["frequency"] / expected, 1, delta=0.01)

    def test_taper(self):
        # cantilever whose thickness falls from 0.2 to 0.1: deflection by the integral of F (L - x)^2/(E I)
        text = ("&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 64, 2 /\n&material name = 'm' law = 'linear_elastic' e = 1000.0 nu = 0.0 density = 2.0 /\n"
                "&field name = 't' {} /\n&section thickness_field = 't' /\n&support node_set = 'edge_x0' type = 'clamped' /\n"
                "&load type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0, 1e-4 /\n&step control = 'linear' /\n"
                "&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /\n&monitor name = 'R' quantity = 'reaction' component = 'z' node_set = 'edge_x0' /\n")
        slices = 20000
        expected = sum(1e-4 * (10 - x)**2 / (1000 * (0.2 - 0.01 * x)**3 / 12) for x in ((i + 0.5) * 10 / slices for i in range(slices))) * 10 / slices
        over = "over = 'x' points = 0.0, 0.2, 10.0, 0.1"
        self.assertAlmostEqual(self.solve(text.format(over))[-1]["w"] / expected, 1, delta=2e-3)
        # its weight
        row = self.solve(text.format(over).replace("type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0, 1e-4", "type = 'gravity' vector = 0, 0, 1e-3"))[-1]
        self.assertAlmostEqual(row["R"] / (-2.0 * 1.5 * 1e-3), 1, delta=1e-6)


if __name__ == "__main__":
    unittest.main()
