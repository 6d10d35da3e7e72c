#!/usr/bin/env python3
"""`accuracy` in &job: what each preset sets, that what is given wins, that errors say so; thickness points that are left out."""
import csv
import math
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
STRIP = """&job {job} /
&mesh generator = 'cylinder' radius = 10.0 length = 4.0 angles = 0.0, 40.0 divisions = {cells} {mesh} /
&material name = 'm' law = '{law}' {parameters} /
&section thickness = {thickness} {section} /
&support node_set = 'edge_a0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_a1' vector = 0.0, 0.0, {force} /
&step {step} /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_a1' /
{more}
"""
LINEAR = {"law": "linear_elastic", "parameters": "e = 1e4 nu = 0.3"}
RUBBER = {"law": "neo_hookean", "parameters": "mu = 3e3"}


class Accuracy(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def run_text(self, command="check", code=0, text=STRIP, options=(), **keys):
        keys = {"job": "", "cells": "8, 4", "mesh": "", "thickness": "0.1", "section": "", "force": "0.02", "step": "load_factor = 1", "more": "", **LINEAR, **keys}
        (self.folder / "in.nml").write_text(text.format(**keys))
        result = subprocess.run([PROGRAM, command, "in.nml", *options], cwd=self.folder, capture_output=True, text=True, timeout=120, check=False,
                                env={**os.environ, "OMP_NUM_THREADS": "1"})
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result.stdout + result.stderr

    def said(self, **keys):
        """(elements, line of the preset without its beginning)."""
        out = self.run_text(**keys)
        name = re.search(r"accuracy = '(\w+)'", keys.get("job", ""))
        line = re.search(r"^accuracy = '(\w+)' sets (.*)$", out, re.M)
        if not name:    # without the key no line
            self.assertIsNone(line)
            return int(re.search(r"(\d+) elements", out)[1]), None
        self.assertEqual(line[1], name[1].lower())
        return int(re.search(r"(\d+) elements", out)[1]), line[2]

    def test_what_each_sets(self):
        paper, tight = ("residual_tolerance = 5.0E-03, correction_tolerance = 1.0E-02", "residual_tolerance = 1.0E-06, correction_tolerance = 1.0E-06")
        self.assertEqual(self.said(), (64, None))
        self.assertEqual(self.said(job="accuracy = 'balanced'"), (64, f"thickness_points = 2, {paper}"))
        self.assertEqual(self.said(job="accuracy = 'FAST'"), (16, f"refine = -1, thickness_points = 2, {paper}, precision = 'single'"))
        self.assertEqual(self.said(job="accuracy = 'reference'"), (1024, f"refine = 2, thickness_points = 2, {tight}"))
        self.assertEqual(self.said(job="accuracy = 'reference'", **RUBBER), (1024, f"refine = 2, thickness_points = 5, {tight}"))

    def test_what_is_given_wins(self):
        all_given = {"mesh": "refine = 1", "section": "thickness_points = 4", "step": "residual_tolerance = 1e-3 correction_tolerance = 1e-3"}
        for name in ("fast", "balanced", "reference"):
            job = f"accuracy = '{name}'"
            elements, line = self.said(job=job, **all_given, more="&output precision = 'double' /")
            self.assertEqual((elements, line), (256, "nothing here: all is given"))
            for step in ("tolerance = 'tight'", "control = 'linear'"):
                self.assertNotIn("tolerance", self.said(job=job, step=step)[1])
            line = self.said(job=job, step="residual_tolerance = 1e-3")[1]
            self.assertNotIn("residual", line)
            self.assertIn("correction_tolerance", line)
        self.assertEqual(self.said(job="accuracy = 'fast'", mesh="refine = 0")[0], 64)
        self.assertNotIn("precision", self.said(job="accuracy = 'fast'", more="&output every = 0 /")[1])

    def test_what_is_given_acts(self):
        """The tolerances of the preset are those of the run: the history says what was reached."""
        reached = {}
        for name in ("balanced", "reference"):
            self.run_text("run", job=f"accuracy = '{name}' name = '{name}'", mesh="refine = 0", force="-0.4")
            rows = list(csv.DictReader((self.folder / f"{name}.history.csv").read_text().splitlines()))
            reached[name] = max(float(r["residual"]) for r in rows)
        self.assertLess(reached["reference"], 1e-6)
        self.assertGreater(reached["balanced"], 1e-6)
        for name, size in (("fast", 4), ("balanced", 8)):
            self.run_text("run", job=f"accuracy = '{name}' name = '{name}'", mesh="refine = 1", more="&output compress = 0 /")
            reached[name] = (self.folder / f"{name}.xdmf").read_text()
            self.assertIn(f'Precision="{size}"', reached[name])

    def test_coarser_where_it_can_be(self):
        """Odd numbers of cells, sets that would go, meshes of files, too few elements: fast takes the mesh as it is."""
        fast = {"job": "accuracy = 'fast'"}
        for keys in ({"cells": "8, 3"}, {"cells": "2, 2"}, {"cells": "6, 4", "more": "&monitor name = 'c' quantity = 'rotation' component = 'x' node_set = 'mid_y0' /"},
                     {"more": "&node_set name = 'n' nodes = 3 /"}):
            elements, line = self.said(**fast, **keys)
            a, b = (int(n) for n in keys.get("cells", "8, 4").split(","))
            self.assertEqual(elements, 2 * a * b, keys)
            self.assertNotIn("refine", line)
        # an error that the mesh has nothing to do with is told as ever
        self.assertIn("in.nml:4: &section thickness", self.run_text(code=2, **fast, thickness="-1"))

    def test_levels_come_on_top(self):
        """A study of a fast input: its level 0 is what the input runs with, and no two levels are the same mesh."""
        for cells, first in (("8, 4", 16), ("8, 3", 48)):
            out = [self.said(job="accuracy = 'fast'", cells=cells, options=("--refine", str(level)))[0] for level in (0, 1, 2)]
            self.assertEqual(out, [first, 4 * first, 16 * first])
        self.assertEqual(self.said(job="accuracy = 'fast'", cells="4, 4", options=("--refine", "1"))[0], 32)

    def test_errors_name_the_preset(self):
        text = self.run_text(code=2, job="accuracy = 'reference'", cells="200000, 200000")
        self.assertIn("accuracy = 'reference' sets refine = 2; refine = 0 in &mesh leaves the mesh as it is", text)
        text = self.run_text(code=2, job="accuracy = 'quick'")
        self.assertIn("in.nml:1: &job accuracy = 'quick': expected", text)
        self.assertIn("balanced", text)

    def test_points_that_are_left_out(self):
        """By law and thickness over radius (here 10): a layer each."""
        def said(**keys):
            return self.said(job="accuracy = 'balanced'", **keys)

        for thickness, points in (("0.7", 3), ("0.8", 4), ("1.6", 5), ("2.3", 6), ("3.1", 7)):
            self.assertIn(f"thickness_points = {points},", said(**RUBBER, thickness=thickness)[1])
        self.assertIn("thickness_points = 3,", said(**RUBBER, thickness="3.1", mesh="normals = 'facet'")[1])
        self.assertIn("thickness_points = 2,", said(thickness="3.1")[1])
        self.assertIn("thickness_points = 3, thickness_points = 4,", said(**RUBBER, thickness="0.7, 0.8")[1])
        self.assertIn("thickness_points = 5,", said(law="holzapfel_gasser_ogden", parameters="c = 1e3 k1 = 1e3 k2 = 1 angle = 30")[1])
        self.assertNotIn("thickness_points", said(**RUBBER, section="type = 'membrane'", more="")[1])

    def test_fewer_points_same_answer(self):
        """Linear laws: two points give what three do. Rubber: those that are chosen give what twelve do."""
        def answer(**keys):
            self.run_text("run", step="load_factor = 1 tolerance = 'tight'", more="&output every = 0 /", **keys)
            return float(list(csv.DictReader((self.folder / "in.history.csv").read_text().splitlines()))[-1]["w"])
        for keys, tolerance in (({"force": "-0.1"}, 1e-9), ({**RUBBER, "thickness": "0.8", "force": "-30"}, 1e-4)):
            given, left_out = answer(section="thickness_points = 12", **keys), answer(**keys)
            self.assertGreater(abs(given), 0.3)
            self.assertTrue(math.isclose(left_out, given, rel_tol=tolerance), (left_out, given))


if __name__ == "__main__":
    unittest.main()
