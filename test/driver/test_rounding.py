#!/usr/bin/env python3
"""What rounding leaves of the residual does not stop a run: clamps that are moved without load, fine and thin strips, stiff parts.

Every tolerance is met or, where rounding is in the way, the run ends all the same and says so; in any system of units.
"""
import csv
import math
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

COMPONENTS = ("ux", "uy", "uz", "rx", "ry", "rz")
TOLERANCES = ("", "tolerance = 'tight'")
TINY = "residual_tolerance = 1.0e-30 correction_tolerance = 1.0e-30"
ROUNDING = "at the limit of rounding"


def run(text):
    """Exit code, what was printed, rows of the history."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "case.nml").write_text(text)
        done = subprocess.run([os.environ["FINSHELL_BIN"], "run", "case.nml"], cwd=folder, capture_output=True, text=True, check=False, timeout=300)
        history = Path(folder) / "case.history.csv"
        rows = [{k: float(v) for k, v in r.items()} for r in csv.DictReader(history.read_text().splitlines())] if history.exists() else []
    return done.returncode, done.stdout + done.stderr, rows


def held(node_set="edge_x0", more="", **values):
    """A support that holds all six components and moves some of them."""
    fixed = ", ".join(f"'{c}'" for c in COMPONENTS if c not in values)
    moved = " ".join(f"{c} = {v!r}" for c, v in values.items())
    return f"&support node_set = '{node_set}' {f'fixed = {fixed}' if fixed else ''} {moved} {more} /\n"


def strip(supports, step="", *, unit=1.0, thickness=0.05, law="law = 'linear_elastic' nu = 0.3", modulus="e = 2.0e5", more=""):
    """10 by 2 units of length, with monitors of a tip and of the energy."""
    return f"""&mesh generator = 'rectangle' lengths = {10 * unit}, {2 * unit} divisions = 6, 2 /
&node_set name = 'origin' point = 0.0, 0.0, 0.0 tolerance = {1e-3 * unit} /
&material name = 'm' {law} {modulus} /
&section thickness = {thickness * unit} /
{supports}&step {step} /
{more}&monitor name = 'x' quantity = 'displacement' component = 'x' node_set = 'corner_x1_y1' /
&monitor name = 'y' quantity = 'displacement' component = 'y' node_set = 'corner_x1_y1' /
&monitor name = 'z' quantity = 'displacement' component = 'z' node_set = 'corner_x1_y1' /
&monitor name = 'energy' quantity = 'energy' /
&output every = 0 fields = 'displacement' /
"""


def turned(vector, point):
    """Displacement of a point that a rotation vector turns about the origin."""
    angle = math.sqrt(sum(v * v for v in vector))
    if angle == 0:
        return [0.0, 0.0, 0.0]
    n = [v / angle for v in vector]
    dot = sum(a * b for a, b in zip(n, point))
    cross = [n[(k + 1) % 3] * point[(k + 2) % 3] - n[(k + 2) % 3] * point[(k + 1) % 3] for k in range(3)]
    return [(math.cos(angle) - 1) * p + math.sin(angle) * c + (1 - math.cos(angle)) * dot * a for p, c, a in zip(point, cross, n)]


class RigidMotion(unittest.TestCase):
    """A clamp is moved and nothing is loaded: every node follows, and no energy is stored."""

    def check(self, text, motion, unit=1.0, modulus=2e5, accuracy=1e-9):
        code, printed, rows = run(text)
        self.assertEqual(code, 0, printed)
        for name, expected in zip("xyz", motion):
            self.assertAlmostEqual(rows[-1][name] / unit, expected, delta=accuracy * max(10.0, max(map(abs, motion))), msg=printed)
        # As much as strains of 1e-12 would store; far beyond the size of the strip the displacements themselves are rounded.
        strain = 1e-12 * max(1.0, max(map(abs, motion)) / 10)
        self.assertLess(rows[-1]["energy"], modulus * unit**3 * strain**2)
        return printed

    def test_translations(self):
        for step in (*TOLERANCES, "tolerance = 'tight' first_increment = 1.0"):
            for motion in ((1.0, 0.0, 0.0), (1.0, -2.3, 0.7), (1e6, -2e6, 1e5), (0.0, 0.0, 1e12), (1e-12, 0.0, 0.0), (0.0, 1e-200, 0.0)):
                with self.subTest(step=step, motion=motion):
                    self.check(strip(held(**dict(zip(COMPONENTS, motion))), step), motion)

    def test_rotations_about_the_clamped_edge(self):
        for step in (*TOLERANCES, TINY):
            for angle in (0.5, 3.0, -9.0):
                with self.subTest(step=step, angle=angle):
                    printed = self.check(strip(held(ry=angle), step), turned((0, angle, 0), (10, 2, 0)))
                    self.assertIn(ROUNDING, printed)

    def test_two_turns_arrive_where_they_began(self):
        self.check(strip(held(ry=4 * math.pi)), (0, 0, 0))

    def test_rotations_about_any_axis_with_a_translation(self):
        for step in TOLERANCES:
            for vector in ((1.0, 2.0, -3.0), (-0.3, 0.2, 1.4)):
                with self.subTest(step=step, vector=vector):
                    values = dict(zip(COMPONENTS, (3.0, 0.0, -4.0, *vector)))
                    motion = [a + b for a, b in zip(turned(vector, (10, 2, 0)), (3, 0, -4))]
                    self.check(strip(held("origin", **values), step), motion)

    def test_axes_of_their_own(self):
        given = "axes = 'given' axis_1 = 0.6, 0.8, 0.0 axis_2 = -0.8, 0.6, 0.0"
        self.check(strip(held("origin", given, ry=1.7)), turned((-0.8 * 1.7, 0.6 * 1.7, 0), (10, 2, 0)))
        self.check(strip(held("corner_x0_y1", "axes = 'cylindrical' origin = 0.0, 0.0, 0.0 axis = 0.0, 0.0, 1.0", rz=1.7)),
                   turned((0, 0, 1.7), (10, 0, 0)))

    def test_constant_supports_and_then_nothing_at_all(self):
        for step in TOLERANCES:
            with self.subTest(step=step):
                self.check(strip(held(more="constant = .true.", ry=1.5), step), turned((0, 1.5, 0), (10, 2, 0)))
                self.check(strip(held(more="constant = .true.", uz=1.5), step), (0, 0, 1.5))

    def test_loads_of_nothing(self):
        for load in ("vector = 0.0, 0.0, 0.0", "vector = 0.0, 0.0, 0.0 constant = .true.", "vector = 0.0, 0.0, 1.0e-18"):
            with self.subTest(load=load):
                self.check(strip(held(ry=1.5), "tolerance = 'tight'", more=f"&load type = 'line' edge_set = 'edge_x1' {load} /\n"),
                           turned((0, 1.5, 0), (10, 2, 0)))

    def test_there_and_back(self):
        text = strip(held(ry=1.0), "tolerance = 'tight' /\n&step load_factor = 3.0 tolerance = 'tight' /\n&step load_factor = 0.0 tolerance = 'tight'")
        self.check(text, (0, 0, 0))

    def test_any_control_and_iteration(self):
        for step in ("control = 'arc_length'", "mixed = .true.", "extrapolate = .false.", "cautious = .true.", "locate = .true."):
            with self.subTest(step=step):
                self.check(strip(held(ry=2.0), step), turned((0, 2.0, 0), (10, 2, 0)))

    def test_any_units(self):
        for unit in (1e-58, 1e-12, 1e12, 1e58):
            for step in TOLERANCES:
                with self.subTest(unit=unit, step=step):
                    self.check(strip(held(ry=2.0, uz=3 * unit), step, unit=unit), [a + b for a, b in zip(turned((0, 2, 0), (10, 2, 0)), (0, 0, 3))], unit)
        for modulus in (1e-290, 1e-12, 1e12, 1e290):
            with self.subTest(modulus=modulus):
                self.check(strip(held(ry=2.0), "tolerance = 'tight'", modulus=f"e = {modulus}"), turned((0, 2, 0), (10, 2, 0)), modulus=modulus)

    def test_any_law(self):
        for law in ("'neo_hookean' mu = 1e6", "'mooney_rivlin' c10 = 8e4 c01 = 2e4", "'gent' mu = 1e6 jm = 30.0", "'compressible_neo_hookean' e = 1e6 nu = 0.4"):
            with self.subTest(law=law):
                self.check(strip(held(ry=2.0), "tolerance = 'tight'", law=f"law = {law}", modulus=""), turned((0, 2, 0), (10, 2, 0)), modulus=3e6)

    def test_thin(self):
        for thickness in (1e-2, 1e-3, 1e-4, 1e-5):
            with self.subTest(thickness=thickness):
                self.check(strip(held(ry=2.0), "tolerance = 'tight'", thickness=thickness), turned((0, 2, 0), (10, 2, 0)))


def cantilever(divisions, thickness=0.1, load=1e-3, step="tolerance = 'tight'"):
    """Length 10, width 1, bending stiffness 1; a line load at the tip."""
    return f"""&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = {divisions} /
&material name = 'm' law = 'st_venant_kirchhoff' e = {12 / thickness**3!r} nu = 0.0 /
&section material = 'm' thickness = {thickness!r} /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0, {load!r} /
&step {step} /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
&output every = 0 fields = 'displacement' /
"""


CONTRAST = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 20, 2 /
&element_set name = 'A' x = 0.0, 5.0 /
&element_set name = 'B' x = 5.0, 10.0 /
&material name = 'a' law = 'st_venant_kirchhoff' e = 12000.0 nu = 0.0 /
&material name = 'b' law = 'st_venant_kirchhoff' e = {stiff} nu = 0.0 /
&section material = 'a' element_set = 'A' thickness = 0.1 /
&section material = 'b' element_set = 'B' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0, 1.0e-4 /
&step tolerance = 'tight' /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
&output every = 0 fields = 'displacement' /
"""


class Bending(unittest.TestCase):
    def done(self, text, w, accuracy):
        code, printed, rows = run(text)
        self.assertEqual(code, 0, printed)
        self.assertAlmostEqual(rows[-1]["w"], w, delta=accuracy * w)
        self.assertEqual(min(r["negative_pivots"] for r in rows), 0)
        return printed, rows

    def test_fine_strips_under_a_small_load(self):
        for divisions in ("160, 16", "640, 1", "8, 32"):
            with self.subTest(divisions=divisions):
                printed, rows = self.done(cantilever(divisions), 1 / 3, 4e-3)
                self.assertIn(ROUNDING, printed)
                worst = max(r["residual"] for r in rows)
                self.assertGreater(worst, 1e-8)
                self.assertLess(worst, 1e-5)
                self.assertLess(max(r["correction"] for r in rows), 1e-8)
                self.assertIn(f"Worst accuracy of an increment: residual {worst:.6E}", printed)

    def test_a_tolerance_that_can_be_met_is_met(self):
        printed, rows = self.done(cantilever("20, 2", load=4e-2), 6.7009, 1e-3)
        self.assertNotIn(ROUNDING, printed)
        self.assertLess(max(r["residual"] for r in rows), 1e-8)

    def test_thin_strips_bend_alike(self):
        for thickness in (1e-2, 1e-3, 1e-4, 1e-5):
            with self.subTest(thickness=thickness):
                self.done(cantilever("32, 1", thickness, 4e-2), 6.7015, 1e-3)

    def test_no_tolerance_is_out_of_reach(self):
        for residual, correction in ((1e-30, 1e-8), (1e-3, 1e-30), (1e-14, 1e-14), (1e-300, 1e-300)):
            with self.subTest(residual=residual, correction=correction):
                step = f"residual_tolerance = {residual} correction_tolerance = {correction}"
                self.done(cantilever("20, 2", load=4e-2, step=step), 6.7009, 1e-3)

    def test_stiff_tips(self):
        for stiff in ("1.2e8", "1.2e10"):
            with self.subTest(stiff=stiff):
                self.done(CONTRAST.format(stiff=stiff), 1e-4 * 875 / 3, 1e-3)


if __name__ == "__main__":
    unittest.main()
