#!/usr/bin/env python3
"""A run that stops says why and what to do, where the program can see it; the limit load it names is the one that arc-length finds."""
import csv
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path


def run(text):
    """Exit code, message, rows of the history."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "case.nml").write_text(text)
        done = subprocess.run([os.environ["FINSHELL_BIN"], "run", "-q", "case.nml"], cwd=folder, capture_output=True, text=True, check=False, timeout=300)
        rows = [{k: float(v) for k, v in r.items()} for r in csv.DictReader((Path(folder) / "case.history.csv").read_text().splitlines())]
    return done.returncode, done.stderr, rows


def balloon(pressure, step, more=""):
    return f"""&mesh generator = 'sphere' radius = 10.0 colatitudes = 0.0, 90.0 azimuths = 0.0, 90.0 divisions = 6, 6 /
&material name = 'm' law = 'neo_hookean' mu = 1.0 /
&section material = 'm' thickness = 0.01 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'edge_bottom' type = 'symmetry_z' /
&load type = 'pressure' pressure = {pressure} {more} /
&step {step} /
&monitor name = 'volume' quantity = 'volume' /
&output every = 0 fields = 'displacement' /
"""


def sheet(law, ends, step="", sides="'edge_y0' type = 'symmetry_y'"):
    """A square that is pulled."""
    return f"""&mesh generator = 'rectangle' lengths = 1.0, 1.0 divisions = 2, 2 /
&material name = 'm' law = {law} /
&section thickness = 0.1 /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = {sides} /
{ends}&step {step} /
&monitor name = 'l' quantity = 'thickness_stretch' /
&output every = 0 fields = 'displacement' /
"""


class Stops(unittest.TestCase):
    def stopped(self, text, *words):
        code, message, rows = run(text)
        self.assertEqual(code, 1, message)
        self.assertEqual(len(message.strip().splitlines()), 1, message)
        for word in words:
            self.assertIn(word, message)
        self.assertIsNone(re.search(r"\d[+-]\d{3}", message), "an exponent without its E: " + message)
        self.assertNotIn("cut the step", message)
        return message, rows

    def test_load_control_before_a_limit_point(self):
        code, message, rows = run(balloon(0.001, "control = 'arc_length' load_factor = 1.3 locate = .true. maximum_increments = 12"))
        limit = next(r["load_factor"] for r in rows if r["critical_point"] == 11)
        message, rows = self.stopped(balloon(0.001, "load_factor = 2.0"), "the load nears a maximum", "control = 'arc_length'")
        named = float(re.search(r"at about (\S+),", message)[1])
        self.assertAlmostEqual(named, limit, delta=1e-3 * limit)
        self.assertLess(sum(r["iterations"] for r in rows), 400)
        self.stopped(balloon(0.002, "", "constant = .true."), "the load nears a maximum", "constant loads", "follow the load factor")

    def test_a_law_at_the_end_of_its_range(self):
        both = "&support node_set = 'edge_x1' ux = 0.5 fixed = 'uz', 'ry', 'rz' /\n&support node_set = 'edge_y1' uy = 0.5 fixed = 'rx', 'rz' /\n"
        message, rows = self.stopped(sheet("'linear_elastic' e = 1000.0 nu = 0.45", both), "a material law has come to the end of its range",
                                     ": the law linear_elastic ends: its thickness reaches zero", "principal stretches were 1.269")
        self.assertLess(rows[-1]["l"], 0.01)
        one = "&support node_set = 'edge_x1' ux = 3.0 fixed = 'uz', 'ry', 'rz' /\n"
        self.stopped(sheet("'gent' mu = 1.0 jm = 5.0", one), ": the law gent ends: I1 - 3 reaches jm", "principal stretches were 2.69")

    def test_a_shell_too_thin_to_bend(self):
        self.stopped("""&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 32, 1 /
&material name = 'm' law = 'st_venant_kirchhoff' e = 12.0e18 nu = 0.0 /
&section material = 'm' thickness = 1.0e-6 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0, 0.04 /
&step tolerance = 'tight' /
&output every = 0 fields = 'displacement' /
""", "thickness over size is 9.950372E-08", "lost in the rounding")

    def test_a_tube_that_is_pinched_and_bent(self):
        """The tube loses its load to a fold: load control says so before it has spent its time on ever smaller increments."""
        message, rows = self.stopped("""&mesh generator = 'cylinder' radius = 10.0 length = 80.0 angles = 0.0, 360.0 divisions = 20, 20 /
&material name = 'r' law = 'neo_hookean' mu = 0.4 /
&section material = 'r' thickness = 1.0 /
&support node_set = 'edge_y0' type = 'clamped' /
&node_set name = 'top' point = 0.0, 40.0, 10.0 /
&node_set name = 'bottom' point = 0.0, 40.0, -10.0 /
&support node_set = 'top' uz = -7.0 constant = .true. /
&support node_set = 'bottom' uz = 7.0 constant = .true. /
&load type = 'line' edge_set = 'edge_y1' vector = 0.01, 0.0, 0.0 /
&step fallback = .false. /
&output every = 0 fields = 'displacement' /
""", "the load nears a maximum", "control = 'arc_length'")
        self.assertLess(sum(r["iterations"] for r in rows), 400)


if __name__ == "__main__":
    unittest.main()
