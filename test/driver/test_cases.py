#!/usr/bin/env python3
"""Cases of loads and supports: each step changes one, in any order; what stays stays. Elastic states do not depend on the way."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

DISK = """&mesh generator = 'disk' radius = 10.0 rings = 12 core = 6 portion = 'quarter' /
&material name = 'r' law = 'neo_hookean' mu = 1.0 /
&section thickness = 0.2 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&element_set name = 'pad' x = 0.0, 3.0 y = 0.0, 3.0 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /
&monitor name = 'Rz' quantity = 'reaction' component = 'z' node_set = 'rim' /
&load type = 'pressure' pressure = 0.03 {0} /
&load type = 'traction' vector = 0, 0, -0.03 element_set = 'pad' {1} /
"""
STRIP = """&mesh generator = 'rectangle' lengths = 10, 1 divisions = 20, 2 /
&material name = 'r' law = 'linear_elastic' e = 1000.0 nu = 0.3 /
&section thickness = 0.2 /
&support node_set = 'edge_x0' type = 'clamped' /
&support node_set = 'edge_x1' ux = {0} uz = 0 {1} /
&support node_set = 'edge_x1' fixed = 'uy', 'rx', 'ry', 'rz' /
&load type = 'pressure' pressure = 0.005 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /
&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'edge_x1' /
&monitor name = 'R' quantity = 'reaction' component = 'x' node_set = 'edge_x1' /
"""


class Cases(unittest.TestCase):
    def solve(self, text, code=0):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "c.nml").write_text(text)
            run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "c.nml"], cwd=folder, capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, code, run.stdout + run.stderr)
            if code == 2:
                return run.stderr
            return [{k: float(v) for k, v in row.items()} for row in csv.DictReader((Path(folder) / "c.history.csv").read_text().splitlines())]

    def test_inflate_press_release_deflate(self):
        rows = self.solve(DISK.format("case = 'air'", "") + """&step case = 'air' tolerance = 'tight' /
&step tolerance = 'tight' /
&step load_factor = 0.0 tolerance = 'tight' /
&step case = 'air' load_factor = 0.1 tolerance = 'tight' /
""")
        inflated = next(row for row in rows if row["factor_air"] == 1)
        pressed = min((row for row in rows if row["factor_air"] == 1), key=lambda row: row["w"])
        released = [row for row in rows if row["factor_air"] == 1][-1]
        self.assertEqual((pressed["load_factor"], released["load_factor"], rows[-1]["factor_air"]), (1, 0, 0.1))
        together = self.solve(DISK.format("", "") + "&step tolerance = 'tight' /\n")[-1]
        alone = self.solve(DISK.format("", "case = 'pad'") + "&step load_factor = 0.1 tolerance = 'tight' /\n")[-1]
        for state, same in ((pressed, together), (released, inflated), (rows[-1], alone)):
            for name in ("w", "Rz"):
                self.assertAlmostEqual(state[name] / same[name], 1, delta=1e-7)
        # a constant load is a third thing
        third = self.solve(DISK.format("constant = .true.", "case = 'pad'") + "&step load_factor = 0.0 /\n&step case = 'pad' tolerance = 'tight' /\n")
        self.assertAlmostEqual(third[-1]["w"] / together["w"], 1, delta=1e-7)

    def test_controls(self):
        """The case of a step counts for arc-length, displacement and volume control, linear and buckling steps."""
        disk = DISK.format("case = 'air'", "")
        reference = self.solve(disk + "&step case = 'air' tolerance = 'tight' /\n&step tolerance = 'tight' /\n")[-1]
        for control in (f"control = 'displacement' node_set = 'centre' component = 'z' displacements = {reference['w']:.15g}",
                        f"control = 'arc_length' first_increment = 0.1 node_set = 'centre' component = 'z' displacements = {reference['w']:.15g}"):
            row = self.solve(disk + f"&step case = 'air' tolerance = 'tight' /\n&step {control} tolerance = 'tight' /\n")[-1]
            self.assertAlmostEqual(row["load_factor"], 1, delta=1e-6, msg=control)
        linear = self.solve(disk + "&step load_factor = 0 case = 'air' control = 'linear' /\n&step control = 'linear' case = 'air' load_factor = 2 /\n")
        alone = self.solve(DISK.format("", "case = 'pad'") + "&step control = 'linear' load_factor = 2 /\n")
        self.assertAlmostEqual(linear[-1]["Rz"] / alone[-1]["Rz"], 1, delta=1e-12)
        volume = self.solve(disk + "&step control = 'volume' case = 'air' volumes = 300.0 tolerance = 'tight' /\n&step tolerance = 'tight' /\n")
        self.assertGreater(volume[-1]["factor_air"], 0.1)
        plate = STRIP.format("-0.01", "case = 'clamp'")
        modes = self.solve(plate.replace("&load type = 'pressure' pressure = 0.005 /\n", "") + "&step control = 'buckling' case = 'clamp' modes = 1 /\n")
        # clamped at both ends, Euler: N = 4 pi^2 E I/L^2, E A u/L = N
        self.assertAlmostEqual(modes[0]["load_factor"] * 0.01, 4 * 3.14159265**2 * 0.2**2 / 12 / 10, delta=0.02 * 0.0132)

    def test_clamp_that_moves(self):
        rows = self.solve(STRIP.format("0.05", "case = 'clamp'") + """&step tolerance = 'tight' /
&step case = 'clamp' tolerance = 'tight' /
""")
        self.assertTrue(all(abs(row["u"] - 0.05 * row["factor_clamp"]) < 1e-12 for row in rows))
        together = self.solve(STRIP.format("0.05", "") + "&step tolerance = 'tight' /\n")[-1]
        self.assertEqual((rows[-1]["load_factor"], rows[-1]["factor_clamp"]), (1, 1))
        for name in ("w", "R"):
            self.assertAlmostEqual(rows[-1][name] / together[name], 1, delta=1e-6)

    def test_refusals(self):
        for steps, load, message in (("&step case = 'gas' /\n", "case = 'air'", "c.nml:12: &step case: no load, support, growth or chamber has the case 'gas'; there are: air"),
                                     ("&step case = 'air' /\n", "", "there are: (none)"),
                                     ("&step /\n", "case = 'air' constant = .true.", "c.nml:10: &load case: what is constant has no case"),
                                     ("&step /\n", "case = ''", "the name is empty"),
                                     ("&step case = 'air' control = 'arc_length' /\n&step case = 'pad' control = 'arc_length' /\n&accuracy target = 0.1 /\n",
                                      "case = 'air'", "no load, support, growth or chamber has the case 'pad'"),
                                     ("&step case = 'air' /\n&accuracy target = 0.1 /\n", "case = 'air'", "cannot go on from mesh to mesh"),
                                     ("&step case = 'air' load_levels = 0.5, 0.2 /\n", "case = 'air'", "a step goes one way")):
            with self.subTest(message):
                self.assertIn(message, self.solve(DISK.format(load, "") + steps, code=2))


if __name__ == "__main__":
    unittest.main()
