#!/usr/bin/env python3
"""Reactions of pressurised shells as a user reads them: pressure times projected area."""
import csv
import math
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
DISK = SOURCE / "examples" / "rubber_disk" / "rubber_disk.nml"
PLATE = """&mesh generator = 'disk' radius = 10.0 rings = 12 core = 6 portion = 'quarter' /
&material name = 'r' law = 'neo_hookean' mu = 1.0 /
&section material = 'r' thickness = 0.2 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'pressure' pressure = 0.02 /
&monitor name = 'Rz' quantity = 'reaction' component = 'z' node_set = 'rim' /
&output every = 0 /
"""
SPHERE = """&mesh generator = 'sphere' radius = 10.0 colatitudes = 0, 90 azimuths = 0, 90 divisions = 24, 24 /
&material name = 'r' law = 'neo_hookean' mu = 1.0 /
&section material = 'r' thickness = 0.1 direction_axis = 0, 0, 1 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'edge_bottom' type = 'symmetry_z' /
&load type = 'pressure' pressure = 1.0 /
&step control = 'volume' volumes = 1400.0 tolerance = 'tight' /
&monitor name = 'Rz' quantity = 'reaction' component = 'z' node_set = 'edge_bottom' /
&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'corner_a0_bottom' /
&output every = 0 /
"""


def quarter_circle(radius, sides):
    """Area of the polygon that a quarter of a circle is made of."""
    return 0.5 * radius**2 * sides * math.sin(math.pi / 2 / sides)


class Reactions(unittest.TestCase):
    def solve(self, text):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "in.nml").write_text(text)
            subprocess.run([os.environ["FINSHELL_BIN"], "run", "in.nml"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
            name = next(Path(folder).glob("*.history.csv"))
            return [{k: float(v) for k, v in r.items()} for r in csv.DictReader(name.read_text().splitlines())]

    def test_rim_of_an_inflated_plate(self):
        for control in ("", "control = 'arc_length'", "control = 'linear'", "control = 'linear' load_factor = 0.5"):
            row = self.solve(PLATE + f"&step {control} /\n".replace(" /", " tolerance = 'tight' /" if "linear" not in control else " /"))[-1]
            self.assertAlmostEqual(row["Rz"] / row["load_factor"] / (-0.02 * quarter_circle(10, 12)), 1, delta=1e-8, msg=control)
        self.assertAlmostEqual(0.02 * quarter_circle(10, 12), 1.56631, delta=5e-6)

    def test_rim_of_the_rubber_disk(self):
        text = DISK.read_text() + "&monitor name = 'Rz' quantity = 'reaction' component = 'z' node_set = 'rim' /\n"
        row = self.solve(text)[-1]
        self.assertAlmostEqual(row["Rz"], -3092.5, delta=0.005 * 3092.5)

    def test_equator_of_a_balloon(self):
        row = self.solve(SPHERE)[-1]
        area = quarter_circle(10 + row["u"], 24)
        self.assertAlmostEqual(row["Rz"] / (-row["load_factor"] * area), 1, delta=1e-3)


if __name__ == "__main__":
    unittest.main()
