#!/usr/bin/env python3
"""`make accuracy` for one problem: errors fall on finer meshes, presets are told apart; comparison at equal error; the stored tables are whole."""
import math
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(os.environ["FINSHELL_SOURCE_DIR"])
sys.path.insert(0, str(ROOT / "bench"))
sys.dont_write_bytecode = True
import accuracy_page as page  # noqa: E402
import accuracy_peers as peers  # noqa: E402
import accuracy_run as points  # noqa: E402
import benchmark_run as run  # noqa: E402
from accuracy_problems import LEVELS, PROBLEMS  # noqa: E402


class Command(unittest.TestCase):
    def test_one_problem(self):
        with tempfile.TemporaryDirectory() as folder:
            store = Path(folder) / "points.csv"
            done = subprocess.run([sys.executable, ROOT / "bench" / "accuracy.py", "--only", "scordelis", "--limit", "3", "--store", store], capture_output=True, text=True,
                                  check=False, timeout=120)
            kept = points.read_points(store)
        self.assertEqual(done.returncode, 0, done.stderr)
        for words in ("## At equal error", "| scordelis | ", "## The aims of the presets", "## What to choose when"):
            self.assertIn(words, done.stdout)
        self.assertEqual(set(kept["scordelis"]), set(points.PRESETS))
        # fast: one mesh coarser; reference: two meshes finer
        fast, balanced, reference = ({p.mesh: p.error for p in kept["scordelis"][preset]} for preset in points.PRESETS)
        self.assertAlmostEqual(fast["16x16"], balanced["8x8"], places=6)
        self.assertLess(reference["16x16"], 0.1)

    def test_a_word_that_is_not_known(self):
        for option in ("--only", "--presets"):
            done = subprocess.run([sys.executable, ROOT / "bench" / "accuracy.py", option, "nonsense"], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 1)
            self.assertIn("nonsense is not known; there are", done.stderr)

    def test_errors_fall(self):
        problem = next(p for p in PROBLEMS if p.name == "hemisphere")
        line = points.ladder(problem, "balanced", points.references()["hemisphere"], limit=math.inf, meshes=problem.meshes[:3])
        self.assertEqual([p.failed for p in line], ["", "", ""])
        self.assertGreater(line[0].error, line[1].error)
        self.assertGreater(line[1].error, line[2].error)
        self.assertLess(line[2].error, 1.0)


class Comparison(unittest.TestCase):
    ours = [points.Point("a", 0.1, 1.0), points.Point("b", 1.0, 0.01), points.Point("worse", 2.0, 0.5), points.Point("stopped", 3.0)]
    lines = [ours[:2], ours[2:]]
    rivals = {"kratos_thin": [points.Point("a", 1.0, 2.0), points.Point("b", 100.0, 0.1)], "ngs_2": [points.Point("a", 50.0, 3.0)]}

    def test_frontier(self):
        first, second, *last = self.ours
        self.assertEqual(points.frontier([[first, second], last]), [(0.1, 1.0), (1.0, 0.01)])

    def test_an_error_that_grows_again_was_luck(self):
        self.assertEqual(points.frontier([[points.Point("lucky", 0.1, 0.001), points.Point("finer", 1.0, 0.3), points.Point("finest", 9.0, 0.1)]]), [(0.1, 0.3), (9.0, 0.1)])

    def test_interpolation_in_logarithms(self):
        self.assertAlmostEqual(points.cpu_at(self.lines, 0.1), 10 ** -0.5)
        self.assertEqual(points.cpu_at(self.lines, 5.0), 0.1)
        self.assertIsNone(points.cpu_at(self.lines, 0.001))

    def test_equal_error(self):
        self.assertEqual(points.common_error(self.lines, self.rivals, 0.0), 0.1)
        self.assertEqual(points.common_error(self.lines, self.rivals, 0.2), 0.2)
        self.assertIsNone(points.common_error(self.lines, {"kratos_thin": [points.Point("a", 1.0)]}, 0.0))
        mine, name, cost = points.compare(self.lines, self.rivals, 0.1)
        self.assertEqual((name, round(cost, 9)), ("kratos_thin", 100.0))
        self.assertAlmostEqual(mine, 10 ** -0.5)


class Tables(unittest.TestCase):
    def test_every_problem_has_references(self):
        exact = points.references()
        self.assertEqual(set(exact), {p.name for p in PROBLEMS})
        for problem in PROBLEMS:
            self.assertTrue((run.EXAMPLES / problem.file).exists())
            if problem.kind == "levels":
                self.assertEqual(set(exact[problem.name]), set(LEVELS[problem.name]))
            for r in exact[problem.name].values():
                self.assertTrue(r.source)
                self.assertLessEqual(r.uncertain, 0.06)

    def test_peers(self):
        rows = run.table(points.PEERS)
        exact = points.references()
        self.assertTrue(rows)
        for row in rows:
            self.assertEqual(set(row), set(peers.COLUMNS))
            self.assertIn(row["problem"], exact)
            self.assertIn(row["peer"], page.NAMES)
            self.assertIn(row["peer"], peers.PEERS)
            self.assertGreaterEqual(float(row["cpu_s"]), 0.0)
            self.assertRegex(row["date"], r"^20\d\d-\d\d-\d\d$")
            self.assertTrue(row["version"] and row["machine"])
            if not row["failed"]:
                self.assertEqual({pair.split("=")[0] for pair in row["values"].split()}, set(exact[row["problem"]]))
        self.assertEqual({row["problem"] for row in rows}, set(peers.LADDERS))

    def test_values_of_peers_come_near(self):
        """The finest run of each peer that is there for the problem: same problem, same units."""
        for problem, rivals in points.peers(points.references()).items():
            self.assertTrue(any(p.error is not None and p.error < 5.0 for line in rivals.values() for p in line), problem)


class Geometry(unittest.TestCase):
    def test_grids_of_peers_are_those_of_the_examples(self):
        """Total loads as in the inputs, and supports on all edges that have some."""
        try:
            import numpy  # noqa: F401
        except ImportError:
            self.skipTest("no numpy")
        sys.path.insert(0, str(ROOT / "bench" / "peers"))
        from cases import PROBLEMS as grids, Grid
        total = {"cantilever": 4.0, "slit": 3.2, "line_load": -8.5, "cook": 1.0}
        for name, force in total.items():
            dof = grids[name].line[1]
            for quadratic in (False, True):
                self.assertAlmostEqual(sum(f[dof] for f in Grid(name, 8, quadratic=quadratic).load.values()), force, places=2)
        area = 25 * 25 * 2 * 3.14159265 / 9
        for quadratic, quadrilaterals in ((False, False), (True, False), (True, True)):
            grid = Grid("scordelis", 16, quadratic, quadrilaterals)
            self.assertAlmostEqual(sum(f[2] for f in grid.load.values()) / (-90 * area), 1.0, places=2)


if __name__ == "__main__":
    unittest.main()
