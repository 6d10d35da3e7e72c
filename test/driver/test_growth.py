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
                held = "&support node_set = 'all' fixed = 'uz' /\n&support node_set = 'mid_x1' fixed = 'uy' /\n" if "membrane" in section else ""
                row = self.solve(SQUARE + held + f"&section thickness = 0.05 {section} /\n&growth {growth} /\n" + step)[-1]
                self.assertAlmostEqual(1 + row["x"], x, delta=1e-9)
                self.assertAlmostEqual(1 + 2 * row["y"], y, delta=1e-9)
                self.assertLess(abs(row["energy"]), 1e-12)

    def test_several_growths_multiply(self):
        row = self.solve(SQUARE + "&section thickness = 0.05 /\n&growth growth = 1.2, 1.0 /\n&growth prestretch = 1.5, 1.0 constant = .true. /\n"
                         "&step tolerance = 'tight' /\n")[-1]
        self.assertAlmostEqual(1 + row["x"], 0.8, delta=1e-9)
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
        text = (f"&mesh generator = 'disk' radius = {radius} rings = 16 core = 6 portion = 'full' /\n" + REFERENCE + f"&section thickness = {h} /\n"
                "&support node_set = 'rim' type = 'clamped' /\n&growth expansion = 1e-3 temperature = 0.1 /\n")
        row = self.solve(text + "&step control = 'buckling' modes = 1 /\n")[-1]
        self.assertAlmostEqual(row["load_factor"] * 1e-4 / critical, 1, delta=0.01)

    def test_arc_length(self):
        # a shallow bimetal arch would do; here a heated strip that buckles: arc-length and load control agree behind it
        text = BAR.replace("'rx', 'ry', 'rz'", "'rx', 'rz'") + "&growth expansion = 1e-3 temperature = 2 /\n&node_set name = 'middle' x = 5.0, 5.0 /\n" \
            "&load type = 'traction' vector = 0, 0, 1e-3 constant = .true. /\n&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'middle' /\n"
        load = self.solve(text + "&step tolerance = 'tight' /\n")[-1]
        arc = self.solve(text + "&step control = 'arc_length' tolerance = 'tight' load_levels = 1.0 /\n")[-1]
        self.assertEqual(arc["load_factor"], 1)
        self.assertGreater(load["w"], 0.1)
        self.assertAlmostEqual(arc["w"] / load["w"], 1, delta=1e-6)
        # a free sheet stores nothing: its balance of energy has nothing to say, and no increment counts as a snap
        rows = self.solve(SQUARE + "&section thickness = 0.05 /\n&growth growth = 0.8 /\n&step control = 'arc_length' load_factor = 1.0 /\n")
        self.assertLessEqual(len(rows), 5)
        self.assertEqual({row["snap"] for row in rows}, {0.0})

    def test_prestretched_drum(self):
        # reference/vibration_prestretched_membrane: f a sqrt(rho/mu) by the stretched mesh, radius lam a
        for lam, expected in ((1.1, 0.25258688), (1.5, 0.365553351)):
            text = (f"&mesh generator = 'disk' radius = {lam} rings = 16 core = 6 portion = 'full' /\n&material name = 'r' law = 'neo_hookean' mu = 1.0 density = 1.0 /\n"
                    f"&section thickness = 1e-3 /\n&support node_set = 'rim' type = 'hinged' /\n&growth prestretch = {lam} constant = .true. /\n"
                    "&step load_factor = 0.0 tolerance = 'tight' /\n&step control = 'frequencies' modes = 1 /\n")
            rows = self.solve(text)
            self.assertAlmostEqual(rows[-1]["load_factor"] / expected, 1, delta=0.01)

    def test_rolling_strip(self):
        # examples/rolling_strip: a ring, by its closed form
        folder = Path(os.environ["FINSHELL_SOURCE_DIR"]) / "examples/rolling_strip"
        rows = self.solve((folder / "input.nml").read_text().replace("name = 'rolling_strip'", "name = 'c'"))
        lines = [line for line in (folder / "reference.csv").read_text().splitlines() if not line.startswith("#")]
        for expected in csv.DictReader(lines):
            row = next(row for row in rows if abs(row["load_factor"] - float(expected["load_factor"])) < 1e-12)
            for name in ("u", "w"):
                self.assertAlmostEqual(row[name], float(expected[name]), delta=1e-5)

    def test_in_time(self):
        # a free strip grows slowly: it arrives at its size, nearly at rest, and the balance of energy closes
        text = (SQUARE + "&section thickness = 0.1 /\n&growth growth = 1.2 amplitude = 't' /\n&amplitude name = 't' over = 'time' points = 0, 0, 20, 1 smooth = .true. /\n"
                "&step control = 'dynamic' duration = 24 first_increment = {} automatic = .false. scheme = 'conserving' tolerance = 'tight' /\n")
        rest = {}
        for h in (0.4, 0.2):
            rows = self.solve(text.format(h))
            self.assertAlmostEqual(1 + rows[-1]["x"], 1.2, delta=5e-3)
            rest[h] = max(abs(row["kinetic_energy"] + row["energy"] - row["work"] + row["damped"]) for row in rows) / max(row["kinetic_energy"] for row in rows)
        self.assertLess(rest[0.2], 1e-6)
        held = BAR.replace("law = 'linear_elastic' e = 1000.0 nu = 0.3", "law = 'neo_hookean' mu = 100.0")
        rows = self.solve(held + "&growth growth = 0.9, 1.0, 1.0 amplitude = 't' /\n&amplitude name = 't' over = 'time' points = 0, 0, 10, 1 smooth = .true. /\n"
                          "&step control = 'dynamic' duration = 10 first_increment = 0.1 automatic = .false. tolerance = 'tight' /\n")
        self.assertGreater(rows[-1]["stored_energy"], 1)
        self.assertAlmostEqual(rows[-1]["work"] / (rows[-1]["stored_energy"] + rows[-1]["kinetic_energy"] + rows[-1]["damped"]), 1, delta=1e-3)

    def test_incompatible_disk(self):
        # plane stress of a disk whose rim grows: a ring within a disk, Lame's equations; the plane cannot be left
        e, nu, a, b, eps = 1000.0, 0.3, 0.5, 1.0, 1e-4
        text = ("&mesh generator = 'disk' radius = 1.0 rings = 40 core = 6 portion = 'quarter' /\n" + REFERENCE + "&section thickness = 0.01 /\n"
                "&support node_set = 'all' fixed = 'uz', 'rx', 'ry', 'rz' /\n&support node_set = 'edge_x0' type = 'symmetry_x' /\n&support node_set = 'edge_y0' type = 'symmetry_y' /\n"
                f"&field name = 'g' over = 'radius' points = {a - 1e-6}, 1.0, {a + 1e-6}, {1 + eps} /\n&growth growth_field = 'g' /\n&step control = 'linear' /\n"
                "&node_set name = 'tip' x = 1.0, 1.0 /\n&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'tip' /\n")
        # interface pressure p: the misfit eps a is shared by disk and ring; outside the ring moves by eps b - what p takes
        p = eps * e / ((1 - nu) + ((a**2 + b**2) / (b**2 - a**2) + nu))
        expected = eps * b - p * 2 * a**2 * b / (e * (b**2 - a**2))
        self.assertAlmostEqual(self.solve(text)[-1]["u"] / expected, 1, delta=0.01)

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

    def test_fields_of_files(self):
        # a taper by elements, by nodes, by node sets, by sets and by the results of another run: the same weight
        mesh = "&mesh generator = 'rectangle' lengths = 4.0, 1.0 divisions = 4, 2 /\n"
        rest = (REFERENCE + "&support node_set = 'edge_x0' type = 'clamped' /\n&load type = 'gravity' vector = 0, 0, 1 /\n"
                "&monitor name = 'R' quantity = 'reaction' component = 'z' node_set = 'edge_x0' /\n&step control = 'linear' /\n")
        over = "&field name = 't' over = 'x' points = 0, 0.1, 4, 0.3 /\n"
        section = "&section thickness_field = 't' /\n"
        with tempfile.TemporaryDirectory() as folder:
            weight = self.run_in(folder, mesh + over + section + rest + "&output fields = 'thickness_stretch' /\n")[-1]["R"]
            self.assertAlmostEqual(weight, -0.8, delta=1e-9)
            (Path(folder) / "c.vtkhdf").rename(Path(folder) / "before.vtkhdf")
            nodes = sum((["%g # x = %d" % (0.1 + 0.05 * x, x)] for y in range(3) for x in range(5)), [])
            (Path(folder) / "nodes.txt").write_text("\n".join(nodes) + "\n")
            (Path(folder) / "elements.txt").write_text("0.2\n" * 8 + "\n0.2\n0.2, # and more\n" + "0.2\n" * 6)
            by_sets = "".join(f"&node_set name = 'x{x}' x = {x}.0, {x}.0 /\n&field name = 't' node_set = 'x{x}' value = {0.1 + 0.05 * x} /\n" for x in range(5))
            for field in ("&field name = 't' file = 'nodes.txt' /\n", "&field name = 't' file = 'elements.txt' /\n", by_sets,
                          "&field name = 't' value = 0.2 /\n", "&field name = 't' node_set = 'all' value = 0.2 /\n",
                          "&field name = 't' node_set = 'edge_x0' value = 0.2 otherwise = 0.2 /\n"):
                with self.subTest(field=field):
                    self.assertAlmostEqual(self.run_in(folder, mesh + field + section + rest)[-1]["R"], weight, delta=1e-9)
            # the thickness stretch at rest is 1
            row = self.run_in(folder, mesh + "&field name = 't' file = 'before.vtkhdf' array = 'thickness_stretch' increment = 1 /\n" + section + rest)[-1]
            self.assertAlmostEqual(row["R"], -4, delta=1e-5)
            for more, words in (("array = 'thicknes'", "there is no cell data 'thicknes' of one to 3 numbers in the file"),
                                ("array = 'thickness_stretch' increment = 7", "increment 7 is not in the file")):
                self.assertIn(words, self.run_in(folder, mesh + f"&field name = 't' file = 'before.vtkhdf' {more} /\n" + section + rest, 2))
            # a refined mesh has the field of the mesh before
            (Path(folder) / "mesh.vtkhdf").write_bytes((Path(folder) / "before.vtkhdf").read_bytes())
            finer = "&mesh file = 'mesh.vtkhdf' refine = 1 /\n"
            for field in ("&field name = 't' file = 'nodes.txt' /\n", "&field name = 't' file = 'elements.txt' /\n"):
                self.assertAlmostEqual(self.run_in(folder, finer + field + section + rest)[-1]["R"], weight, delta=1e-9)
            # layers keep their proportions; the nodes stay on the bottom
            row = self.run_in(folder, mesh + over + "&section thickness = 1.0, 3.0 thickness_field = 't' offset_ratio = 0.5 /\n" + rest)[-1]
            self.assertAlmostEqual(row["R"], weight, delta=1e-9)
            row = self.run_in(folder, mesh + over + "&field name = 'o' value = 0.1 /\n&section thickness_field = 't' offset_field = 'o' /\n" + rest)[-1]
            self.assertAlmostEqual(row["R"], weight, delta=1e-9)

    def test_malformed(self):
        good = SQUARE + "&section thickness = 0.1 /\n&step load_factor = 1.0 /\n"
        field, growth = "&field name = 't' value = 0.1 /\n", "&growth growth = 1.1 /\n"
        sets = "&element_set name = 'left' x = 0.0, 1.0 /\n"
        with tempfile.TemporaryDirectory() as folder:
            for name, text in (("empty", "# nothing\n"), ("word", "1.0\n2.0x\n"), ("short", "1\n2\n"), ("ragged", "1 2\n1\n"), ("wide", "1 2 3 4\n")):
                (Path(folder) / f"{name}.txt").write_text(text)
            cases = [
                (field.replace("value = 0.1", ""), "one of value, over and file is expected; 0 were found"),
                (field.replace("/", "file = 'x' /"), "one of value, over and file is expected; 2 were found"),
                (sets + field.replace("/", "node_set = 'centre' element_set = 'left' /"), "a node set has a value, and no element set beside it"),
                (field.replace("/", "otherwise = 1.0 /"), "&field otherwise: it belongs to node_set, which is missing"),
                (field + field.replace("0.1", "0.1 0.2"), "2 numbers for each element, but the groups of this name before it have 1"),
                (field.replace("0.1", "4*0.1"), "&field value: 4 numbers were found; expected one to three"),
                (field.replace("value = 0.1", "over = 'x' points = 0, 1, 2"), "3 numbers were found; expected two points or more, each a length, and a value"),
                (field.replace("value = 0.1", "over = 'x' points = 0, 1, 0, 2"), "the lengths of the points have to rise"),
                (field.replace("value = 0.1", "file = 'none.txt'"), "none.txt"),
                (field.replace("value = 0.1", "file = 'empty.txt'"), "empty.txt has no numbers"),
                (field.replace("value = 0.1", "file = 'word.txt'"), "word.txt:2: '2.0x' is no number"),
                (field.replace("value = 0.1", "file = 'ragged.txt'"), "ragged.txt:2: 1 numbers were found; expected 2 as in the lines before"),
                (field.replace("value = 0.1", "file = 'wide.txt'"), "wide.txt:1: there are more than 3 numbers in this line"),
                (field.replace("value = 0.1", "file = 'short.txt'"),
                 "short.txt has 2 lines of numbers; expected one for each of the 48 elements or of the 35 nodes of the mesh"),
                (field.replace("value = 0.1", "file = 'short.txt' array = 'thickness'"), "short.txt"),
                ("&growth /\n", "one of growth, growth_field, prestretch, prestretch_field and expansion is expected; 0 were found"),
                ("&growth growth = 1.1 prestretch = 1.1 /\n", "prestretch_field and expansion is expected; 2 were found"),
                (growth.replace("1.1", "4*1.1"), "&growth growth: 4 numbers were found; expected one to three"),
                (growth.replace("1.1", "-0.5"), "the stretch of element 1 is -5.000000E-01; expected is a positive number, 1 where nothing grows"),
                ("&growth expansion = -0.1 temperature = 20 /\n", "the stretch of element 1 is -1.0"),
                ("&growth expansion = 0.1 /\n", "temperature"),
                (growth.replace("/", "layer = 2 /"), "layer 2 was found; the section of element 1 has 1"),
                ("&growth growth_field = 'g' /\n", "there is no &field 'g'; there are: (none)"),
                (field + "&growth growth_field = 'tt' /\n", "there is no &field 'tt'"),
                (sets + field.replace("/", "element_set = 'left' /") + "&growth growth_field = 't' /\n", "the field 't' does not cover element"),
                (field.replace("0.1", "0.1 0.1") + "&growth expansion = 0.1 temperature_field = 't' /\n", "the field 't' has 2 numbers for each element; expected one"),
                (growth.replace("/", "constant = .true. case = 'a' /"), "what is constant has no case"),
                (growth + "&accuracy /\n&growth growth = 1.1 until_step = 1 /\n", "growth comes or goes between steps, which cannot go on from mesh to mesh"),
                (growth.replace("/", "until_step = 2 /"), "the input has 1 steps; 2 was found"),
            ]
            for text, words in cases:
                with self.subTest(text=text):
                    self.assertIn(words, self.run_in(folder, good + text, 2, "check"))
            for section, words in (("thickness_field = 't'", "&section thickness_field: element 1 gets the thickness -1.000000E-01; expected is a positive number"),
                                   ("thickness = 0.1 offset = 0.1 offset_ratio = 0.5", "at most one of offset, offset_ratio and offset_field is expected"),
                                   ("type = 'membrane' thickness = 0.1 offset_ratio = 0.5", "a section of type 'membrane' has none")):
                text = good.replace("&section thickness = 0.1", "&section " + section) + field.replace("0.1", "-0.1")
                self.assertIn(words, self.run_in(folder, text, 2, "check"))
            both = good.replace("thickness = 0.1", "type = 'membrane' thickness = 0.1, 0.1")
            self.assertIn("the layers of the membrane of element 1 would grow apart", self.run_in(folder, both + growth.replace("/", "layer = 1 /"), 2, "check"))
            (Path(folder) / "twelve.txt").write_text("0.1\n" * 12)
            same = good.replace("divisions = 6, 4", "divisions = 2, 3").replace("&support node_set = 'centre'", "&support node_set = 'edge_x0'") + field.replace("value = 0.1", "file = 'twelve.txt'")
            self.assertIn("the mesh has as many nodes as elements; at = 'elements' or 'nodes' is expected", self.run_in(folder, same, 2, "check"))
            self.run_in(folder, same.replace("'twelve.txt'", "'twelve.txt' at = 'elements'"))
            explicit = good.replace("load_factor = 1.0", "control = 'explicit' duration = 1.0")
            self.assertIn("explicit steps do not know growth that changes with them (&growth number 1); control = 'dynamic' does",
                          self.run_in(folder, explicit + growth, 2, "check"))
            thick = good.replace("thickness = 0.1", "thickness_field = 't'") + field + "&imperfection wave_length = 1.0 amplitudes = 0.1 times_thickness = .true. /\n"
            self.assertIn("the thickness is a field (thickness_field); give lengths", self.run_in(folder, thick, 2, "check"))


if __name__ == "__main__":
    unittest.main()
