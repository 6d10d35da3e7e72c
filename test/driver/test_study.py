#!/usr/bin/env python3
"""`finshell study`: errors and costs of an input on coarser and finer meshes, advice; a rung that fails, a budget that ends, wrong options."""
import csv
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
DATA = Path(os.environ["FINSHELL_SOURCE_DIR"]) / "test" / "data"
ROOF = """&mesh generator = 'cylinder' radius = 25.0 length = 25.0 angles = 0.0, 40.0 divisions = 4, 4 /
&material name = 'm' law = 'st_venant_kirchhoff' e = 4.32e8 nu = 0.0 /
&section thickness = 0.25 /
&support node_set = 'edge_y0' fixed = 'ux', 'uz' /
&support node_set = 'edge_y1' type = 'symmetry_y' /
&support node_set = 'edge_a0' type = 'symmetry_x' /
&load type = 'traction' vector = 0.0, 0.0, -90.0 /
&step control = 'linear' /
"""
MONITOR = "&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_a1_y1' /\n"


class Study(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def run_text(self, text, *options, command="study", code=0):
        (self.folder / "model.nml").write_text(text)
        result = subprocess.run([PROGRAM, command, "model.nml", *options], cwd=self.folder, capture_output=True, text=True, timeout=120, check=False)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        self.assertNotIn("Backtrace", result.stderr)
        return result

    def rows(self, name="model.study.csv"):
        return list(csv.DictReader((self.folder / name).read_text().splitlines()))

    def test_roof(self):
        """Order two, the limit that is known, an error that is that to the limit, and the cheapest mesh that meets what is asked."""
        out = self.run_text(ROOF + MONITOR).stdout
        rows = self.rows()
        self.assertEqual([row["level"] for row in rows], ["-1", "0", "1", "2"])
        self.assertEqual([row["elements"] for row in rows], ["8", "32", "128", "512"])
        self.assertAlmostEqual(float(rows[0]["order"]), 2.0, delta=0.35)
        self.assertAlmostEqual(float(rows[0]["limit"]), -0.3006, delta=0.0006)
        for row in rows:
            self.assertAlmostEqual(float(row["relative_error"]), abs(float(row["value"]) / float(row["limit"]) - 1), delta=1e-12)
            self.assertGreater(float(row["cpu_s"]), 0)
        self.assertEqual(rows[0]["predicted_cpu_s"], "")
        self.assertGreater(float(rows[3]["predicted_cpu_s"]), 0)
        advised = int(re.search(r"For 1 % take level (-?\d)", out).group(1))
        good = [int(row["level"]) for row in rows if float(row["relative_error"]) <= 0.01]
        self.assertIn(advised, good)
        self.assertIn("CPU time, seconds", out)
        # what a rung gives is what a run gives
        self.run_text(ROOF + MONITOR, "--refine", "1", "-q", command="run")
        self.assertEqual(float(self.rows("model.history.csv")[-1]["w"]), float(rows[2]["value"]))
        # a coarse wish is met sooner, a fine one goes on
        self.run_text(ROOF + MONITOR, "--accuracy", "10%")
        self.assertIn("not run", [row["state"] for row in self.rows()])
        out = self.run_text(ROOF + MONITOR, "--accuracy", "0.0003").stdout
        self.assertGreater(len(self.rows()), 4)
        self.assertIn("For 0.03 % take level", out)

    def test_picture(self):
        self.run_text(ROOF + MONITOR, "--levels", "3", "-q")
        text = (self.folder / "model.study.py").read_text()
        compile(text, "model.study.py", "exec")
        if subprocess.run([sys.executable, "-c", "import matplotlib"], capture_output=True, check=False).returncode == 0:
            subprocess.run([sys.executable, "model.study.py"], cwd=self.folder, check=True, timeout=120)
            self.assertTrue((self.folder / "model.study.png").exists())

    def test_without_monitors(self):
        """The largest displacement is watched."""
        out = self.run_text(ROOF, "--levels", "3", "-q").stdout
        self.assertIn("Monitor smallest_uz: ", out)
        self.assertEqual({row["monitor"] for row in self.rows()}, {"smallest_uz"})
        self.assertAlmostEqual(float(self.rows()[-1]["value"]), -0.3, delta=0.01)

    def test_load_factor_as_answer(self):
        """Where a displacement is prescribed the load factor is what comes out; a monitor that is the same everywhere has no error."""
        text = ROOF.replace("'linear'", "'displacement' node_set = 'corner_a1_y1' component = 'z' displacements = -0.1")
        out = self.run_text(text + MONITOR, "--levels", "3").stdout
        self.assertIn("Monitor load_factor: limit", out)
        self.assertIn("Monitor w: the same on every mesh", out)

    def test_buckling(self):
        """The critical load of a square plate, hinged all around: 4 pi**2 D/b."""
        text = """&mesh generator = 'rectangle' lengths = 1.0, 1.0 divisions = 4, 4 /
&material name = 'm' law = 'st_venant_kirchhoff' e = 1e9 nu = 0.3 /
&section thickness = 0.01 /
&support node_set = 'edge_x0' fixed = 'ux', 'uz' /
&support node_set = 'edge_x1', 'edge_y0', 'edge_y1' fixed = 'uz' /
&support node_set = 'corner_x0_y0' fixed = 'uy' /
&load type = 'line' edge_set = 'edge_x1' vector = -1000.0, 0.0, 0.0 /
&step control = 'buckling' modes = 2 /
"""
        self.run_text(text, "-q")
        rows = self.rows()
        self.assertEqual({row["monitor"] for row in rows}, {"load_factor"})
        self.assertAlmostEqual(float(rows[0]["limit"]), 4 * 3.14159265359**2 * 1e3 / (12 * 0.91) / 1000, delta=0.002)

    def test_file(self):
        """The roof as a coarse irregular mesh of a file comes to the limit of the generator's."""
        shutil.copy(DATA / "roof.msh", self.folder)
        text = ROOF.replace(ROOF.splitlines()[0], "&mesh file = 'roof.msh' /").replace("'edge_", "'") + MONITOR.replace("corner_a1_y1", "A")
        self.run_text(text)
        rows = self.rows()
        self.assertEqual([row["elements"] for row in rows], ["62", "248", "992", "3968"])
        self.assertEqual(rows[0]["asymptotic"], "yes")
        self.assertAlmostEqual(float(rows[0]["limit"]) / -0.30057, 1.0, delta=1e-3)

    def test_a_failing_rung(self):
        """One mesh cannot be solved; the others are, and the study says which and why."""
        text = ROOF.replace("divisions = 4, 4", "divisions = 2, 2")
        text = text.replace("'linear'", "'load' maximum_increments = 1 first_increment = 0.02 largest_increment = 0.02") + MONITOR
        out = self.run_text(text, "--levels", "2", code=1).stdout
        self.assertEqual(out.count("FAILED: "), 4, out)
        self.assertIn("No advice", out)
        (self.folder / "model.study" / "level_0.history.csv").unlink()
        (self.folder / "model.study" / "level_0.history.csv").mkdir()
        out = self.run_text(ROOF + MONITOR, "--levels", "4").stdout
        self.assertEqual([row["state"] for row in self.rows()], ["done", "failed", "done", "done"])
        self.assertIn("level 0: FAILED: model.study/level_0.history.csv: cannot be replaced", out)
        self.assertIn("For 1 % take level", out)

    def test_budget(self):
        """What would not fit is not started; what does not end in time is stopped."""
        budget, begun = 5, time.monotonic()
        out = self.run_text(ROOF + MONITOR, "--levels", "10", "--budget", str(budget)).stdout
        used = time.monotonic() - begun
        self.assertLess(used, 15 * budget)
        self.assertTrue("of the budget are left" in out or "stopped at the end of the budget" in out, out)
        self.assertIn("For 1 % take level", out)

    def test_wrong_options(self):
        for options, words in ((("--accuracy", "0"), "--accuracy needs a number above 0, as 1% or 0.01, found '0'"),
                               (("--accuracy", "x%"), "found 'x%'"), (("--budget", "-1"), "--budget needs a number of seconds above 0, found '-1'"),
                               (("--budget",), "found ''"), (("--levels", "0"), "--levels needs a whole number, 1 to 10, found '0'"),
                               (("--levels", "2.5"), "found '2.5'"), (("--refine", "1"), "--refine belongs to the commands run, check and mesh"),
                               (("--level", "2"), "unknown option '--level'")):
            self.assertIn(words, self.run_text(ROOF, *options, code=2).stderr)
        self.assertIn("--budget belongs to the command study", self.run_text(ROOF, "--budget", "1", command="run", code=2).stderr)
        self.assertIn("unknown group &stop", self.run_text(ROOF.replace("&step", "&stop"), code=2).stderr)
        self.assertFalse((self.folder / "model.study").exists())


if __name__ == "__main__":
    unittest.main()
