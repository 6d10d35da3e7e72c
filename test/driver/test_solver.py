#!/usr/bin/env python3
"""Solvers and their options: the same results with all of them, sentences where one is lacking; threads are as many as were asked for;
what `check` estimates."""
import csv
import os
import re
import resource
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
DOME = """&mesh generator = 'paraboloid' lengths = 2.0, 2.0 curvatures = -0.2, -0.2, 0.0 divisions = {n}, {n} /
&material name = 'elastic' law = 'linear_elastic' e = 1.0e6 nu = 0.3 /
&section material = 'elastic' thickness = 0.01 /
&support node_set = 'edge_x0' type = 'hinged' /
&support node_set = 'edge_x1' type = 'hinged' /
&support node_set = 'edge_y0' type = 'hinged' /
&support node_set = 'edge_y1' type = 'hinged' /
&load type = 'pressure' pressure = -40.0 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /
"""
ROOF = """&mesh generator = 'cylinder' radius = 2540.0 length = 254.0 angles = 0.0, 5.729577951308232 divisions = 16, 16 /
&material name = 'elastic' law = 'linear_elastic' e = 3102.75 nu = 0.3 /
&section material = 'elastic' thickness = 6.35 /
&support node_set = 'edge_a1' fixed = 'ux', 'uy', 'uz', 'rx', 'rz' /
&support node_set = 'edge_a0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'force' node_set = 'corner_a0_y0' vector = 0.0, 0.0, -750.0 /
&step control = 'arc_length' first_increment = 0.02 node_set = 'corner_a0_y0' component = 'z' displacements = -38.45 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_a0_y0' factor = -1.0 /
"""
ARCS = "&step control = 'arc_length' load_levels = 0.5 load_factor = 1.0 /\n"


class Solver(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def start(self, text, *words, environment=None):
        (Path(self.folder.name) / "model.nml").write_text(text)
        return subprocess.Popen([PROGRAM, *words, "model.nml"], cwd=self.folder.name, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                env={**os.environ, **(environment or {})})

    def run_text(self, text, *words, environment=None):
        process = self.start(text, *words, environment=environment)
        out, err = process.communicate(timeout=100)
        return process.returncode, out, err

    def history(self, keys):
        """Rows of the history, or None where the build lacks the solver, which it says."""
        code, out, err = self.run_text(f"&job {keys} name = 'model' threads = 1 /\n" + ROOF, "run", "-q")
        if "was built without" in err:
            self.assertRegex(err, r"^finshell: model.nml:1: &job: this finshell was built without (MUMPS|SuiteSparse)")
            self.assertEqual(code, 2)
            return None
        self.assertEqual((code, err), (0, ""), keys)
        self.assertEqual("kept on disk" in out, "out_of_core" in keys)
        with (Path(self.folder.name) / "model.history.csv").open() as file:
            return list(csv.DictReader(file))

    def test_same_results(self):
        """A roof that snaps through, by arc-length: limit points and negative pivots on the way."""
        expected = self.history("solver = 'auto'")
        self.assertTrue(any(int(row["negative_pivots"]) > 0 for row in expected))
        for keys in ("solver = 'suitesparse'", "solver = 'mumps'", "solver = 'iterative'", "low_rank = 1e-6", "low_rank = 1e-3", "out_of_core = .true.",
                     "out_of_core = .true. low_rank = 1e-9"):
            found = self.history(keys)
            if found is None:
                continue
            self.assertEqual(len(expected), len(found), keys)
            for a, b in zip(expected, found):
                for name in ("negative_pivots", "iterations", "critical_point"):
                    self.assertEqual(a[name], b[name], (keys, name))
                for name in ("load_factor", "w"):
                    self.assertAlmostEqual(float(a[name]), float(b[name]), delta=1e-7 * max(1e-3, abs(float(a[name]))), msg=keys)

    def test_refused(self):
        for keys, words in (("solver = 'pardiso'", "auto, iterative, mumps, suitesparse"), ("low_rank = 0.1", "low_rank"), ("low_rank = -1.0", "low_rank"),
                            ("solver = 'suitesparse' low_rank = 1e-9", "low_rank is for MUMPS|without SuiteSparse"),
                            ("solver = 'suitesparse' out_of_core = T", "out_of_core is for MUMPS|without SuiteSparse")):
            code, _, err = self.run_text(f"&job {keys} /\n" + DOME.format(n=4) + ARCS, "run", "-q")
            self.assertEqual(code, 2, keys)
            self.assertRegex(err, r"^finshell: model.nml:1: &job")
            self.assertRegex(err, words)
            self.assertEqual(len(err.splitlines()), 1)

    def test_no_room_on_disk(self):
        code, _, err = self.run_text("&job out_of_core = T /\n" + DOME.format(n=4) + ARCS, "run", "-q", environment={"TMPDIR": "/nowhere"})
        self.assertEqual(code, 2 if "without" in err else 1, err)
        self.assertRegex(err, "was built without MUMPS|cannot be kept on disk; TMPDIR names the folder")

    def test_threads(self):
        """As many as were asked for, and not one more, through assembly, ordering and factorisations. OpenBLAS begins with more."""
        for threads, solver in ((1, "auto"), (2, "auto"), (3, "auto"), (1, "mumps"), (2, "mumps"), (2, "iterative")):
            text = f"&job threads = {threads} solver = '{solver}' /\n" + DOME.format(n=70) + "&step control = 'linear' /\n"
            process = self.start(text, "run", "-q", environment={"OMP_NUM_THREADS": "4", "OPENBLAS_NUM_THREADS": "4"})
            counts = []
            while process.poll() is None:
                try:
                    counts.append(len(os.listdir(f"/proc/{process.pid}/task")))
                except FileNotFoundError:
                    break
                time.sleep(0.002)
            _, err = process.communicate(timeout=100)
            if "was built without" in err:
                continue
            self.assertEqual((process.returncode, err), (0, ""))
            self.assertGreater(len(counts), 50)
            most = max(counts[len(counts)//5:])
            self.assertEqual(most, threads, (threads, solver, counts))

    @unittest.skipIf("ASAN_OPTIONS" in os.environ, "the sanitizer has memory of its own")
    def test_estimates(self):
        """Memory is estimated within a factor of two; nothing is ordered unless asked for."""
        for n in (40, 80):
            text = "&job threads = 1 /\n" + DOME.format(n=n) + "&step control = 'linear' /\n"
            code, out, _ = self.run_text(text, "check")
            self.assertEqual(code, 0)
            self.assertNotIn("Ordered", out)
            estimate = 1e9 * float(re.search(r"Estimate: (\S+) GB of memory, \S+ s of CPU time for a factorisation", out).group(1))
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
            code, _, err = self.run_text(text, "run", "-q")
            self.assertEqual((code, err), (0, ""))
            used = 1e3 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
            if used > 1e3 * before:
                self.assertLess(used, 2 * estimate)
                self.assertGreater(used, estimate / 2)
            code, out, _ = self.run_text(text, "check", "--factor")
            self.assertEqual(code, 0)
            self.assertRegex(out, r"Ordered in \S+ s of CPU time: the factor takes \S+ GB")
        code, _, err = self.run_text(text, "run", "--factor")
        self.assertEqual(code, 2)
        self.assertIn("--factor belongs to the command check", err)


if __name__ == "__main__":
    unittest.main()
