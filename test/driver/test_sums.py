#!/usr/bin/env python3
"""Resultants: section forces through cuts, reactions about a point; by equilibrium, whatever the mesh, the cut and the state."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np

PROGRAM = os.environ["FINSHELL_BIN"]
STRIP = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 20, 2 distortion = 0.2 /
&element_set name = 'outer' x = 4.3, 99 /
&element_set name = 'skew' plane_point = 5, 0.5, 0 plane_normal = 1, 0.7, 0 /
&node_set name = 'rest' x = -1, 4.2 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0e6 /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
"""
LOAD = "&load type = 'force' node_set = 'corner_x1_y1' vector = 3.0, 5.0, 40.0 /\n"
STEP = "&step load_levels = 0.5 residual_tolerance = 1e-11 correction_tolerance = 1e-9 /\n"
PLACE = "&monitor name = 'u{k}' quantity = 'displacement' component = '{k}' node_set = 'corner_x1_y1' /\n"


def sums(quantity, name, rest):
    return "".join(f"&monitor name = '{name}{k}' quantity = '{quantity}' component = '{k}' {rest} /\n" for k in "xyz")


def cut(name, rest):
    return sums("section_force", name + "f", rest) + sums("section_moment", name + "m", rest + " point = 1, 2, 3")


class Sums(unittest.TestCase):
    def rows(self, text):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder)
            (path / "a.nml").write_text(text)
            done = subprocess.run([PROGRAM, "run", "-q", "a.nml"], cwd=path, capture_output=True, text=True, timeout=120, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            with (path / "a.history.csv").open() as file:
                return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]

    def refuse(self, text, *words):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "a.nml").write_text(text)
            done = subprocess.run([PROGRAM, "check", "a.nml"], cwd=folder, capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual(done.returncode, 2, done.stdout)
        for word in words:
            self.assertIn(word, done.stderr)

    @staticmethod
    def vector(row, name):
        return np.array([row[name + k] for k in "xyz"])

    def test_cut_is_in_balance_with_the_load(self):
        """Large rotations: force and moment through cuts, straight and skew, and at the support, are those of the load."""
        text = STRIP + LOAD + STEP + "".join(PLACE.format(k=k) for k in "xyz")
        text += cut("a", "element_set = 'outer'") + cut("b", "element_set = 'skew'")
        text += sums("reaction", "rf", "node_set = 'edge_x0'") + sums("reaction_moment", "rm", "node_set = 'edge_x0' point = 1, 2, 3")
        rows = self.rows(text)
        self.assertGreater(len(rows), 2)
        self.assertGreater(rows[-1]["uz"], 4)
        for row in rows:
            load = row["load_factor"] * np.array([3.0, 5.0, 40.0])
            moment = np.cross(np.array([10.0, 1.0, 0.0]) + self.vector(row, "u") - [1, 2, 3], load)
            for name in "abr":
                np.testing.assert_allclose(self.vector(row, name + "f"), -load, rtol=0, atol=1e-10 * np.linalg.norm(load))
                np.testing.assert_allclose(self.vector(row, name + "m"), -moment, rtol=0, atol=1e-9 * np.linalg.norm(moment))

    def test_nodes_of_the_cut(self):
        """All elements, cut at the support: what holds it. The other side of a cut feels the opposite."""
        text = STRIP + LOAD + STEP + "&element_set name = 'inner' x = -1, 4.3 /\n"
        text += cut("a", "element_set = 'all' node_set = 'edge_x0'") + sums("reaction", "r", "node_set = 'edge_x0'")
        text += cut("b", "element_set = 'inner'") + cut("c", "element_set = 'outer'")
        row = self.rows(text)[-1]
        np.testing.assert_allclose(self.vector(row, "af"), self.vector(row, "r"), atol=1e-10 * 40)
        for kind in "fm":
            one, other = self.vector(row, "b" + kind), self.vector(row, "c" + kind)
            np.testing.assert_allclose(one, -other, atol=1e-8 * np.linalg.norm(one))

    def test_moment_about_the_middle_of_the_cut(self):
        """Without a point: a plate pulled in its plane at the middle of its edge has none."""
        text = STRIP.replace("distortion = 0.2", "") + "&load type = 'line' edge_set = 'edge_x1' vector = 1000, 0, 0 /\n" + STEP
        text += sums("section_force", "f", "element_set = 'outer'") + sums("section_moment", "m", "element_set = 'outer'")
        row = self.rows(text)[-1]
        np.testing.assert_allclose(self.vector(row, "f"), [-1000, 0, 0], atol=1e-6)
        np.testing.assert_allclose(self.vector(row, "m")[:2], 0, atol=1e-6)

    def test_membranes(self):
        """A membrane has no moments of its own; its forces have."""
        text = STRIP.replace("thickness = 0.1 /", "thickness = 0.1 type = 'membrane' /").replace("distortion = 0.2", "")
        text = text.replace("type = 'clamped'", "type = 'hinged'") + "&support node_set = 'all' fixed = 'uz' /\n"
        text += "&load type = 'line' edge_set = 'edge_x1' vector = 1000, 0, 0 /\n" + STEP + cut("a", "element_set = 'skew'")
        row = self.rows(text)[-1]
        np.testing.assert_allclose(self.vector(row, "af"), [-1000, 0, 0], atol=1e-6)

    def test_linear_and_modes(self):
        """To first order: a linear step is in balance in the reference; a mode alone has what it changes."""
        text = STRIP + LOAD + "&step control = 'linear' load_factor = 2 /\n" + cut("a", "element_set = 'outer'")
        row = self.rows(text)[-1]
        load = np.array([6.0, 10.0, 80.0])
        np.testing.assert_allclose(self.vector(row, "af"), -load, atol=1e-5 * np.linalg.norm(load))
        moment = np.cross([9.0, -1.0, -3.0], load)
        np.testing.assert_allclose(self.vector(row, "am"), -moment, atol=1e-5 * np.linalg.norm(moment))

    def test_refusals(self):
        begin = STRIP + LOAD + STEP + "&monitor name = 'a' quantity = 'section_force' component = 'x' "
        self.refuse(begin + "/\n", "element_set")
        self.refuse(begin + "element_set = 'all' /\n", "no other elements touch those of the set 'all'")
        self.refuse(begin + "element_set = 'outer' node_set = 'edge_x0' /\n", "no node of the set 'edge_x0' is one of the element set 'outer'")
        self.refuse(begin + "element_set = 'outer' point = 0, 0, 0 /\n", "unknown key point")
        self.refuse(begin + "element_set = 'outer' reduce = 'max' /\n", "unknown key reduce")
        self.refuse(begin.replace("section_force", "reaction_moment") + "node_set = 'all' point = 0, 0 /\n", "point", "3")
        self.refuse(begin.replace("section_force", "reaction_moment") + "node_set = 'all' point = 0, 0, 0 reduce = 'max' /\n", "unknown key reduce")
        self.refuse(STRIP.replace("plane_normal = 1, 0.7, 0", "plane_normal = 0, 0, 0") + LOAD + STEP, "plane_normal", "no direction")
        self.refuse(STRIP.replace("plane_normal = 1, 0.7, 0", "") + LOAD + STEP, "plane_normal")


if __name__ == "__main__":
    unittest.main()
