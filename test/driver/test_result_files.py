#!/usr/bin/env python3
"""What becomes of result files when starts fail, runs meet, disks fill and processes are killed; and who can read them meanwhile."""
import os
import re
import resource
import subprocess
import tempfile
import time
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import h5py
import numpy as np
import pyvista

PROGRAM = os.environ["FINSHELL_BIN"]
MODEL = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 8, 1 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0e6 /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0, 20.0 /
&step load_factor = 1.0 first_increment = {} automatic = .false. maximum_increments = 1000000 /
&monitor name = 'tip' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
"""
SHORT, LONG = MODEL.format("0.02"), MODEL.format("2e-6")
NAMES = ["model.history.csv", "model.restart", "model.vtkhdf", "model.xdmf"]


class ResultFiles(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)

    def run_text(self, text, limit=None, name="model.nml", command="run"):
        (self.path / name).write_text(text)
        preexec = (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))) if limit else None
        return subprocess.run([PROGRAM, command, name], cwd=self.path, capture_output=True, text=True, timeout=300, check=False, preexec_fn=preexec)

    def start(self, text):
        """A run in the background, once its files are there."""
        (self.path / "model.nml").write_text(text)
        run = subprocess.Popen([PROGRAM, "run", "-q", "model.nml"], cwd=self.path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(run.kill)
        deadline = time.time() + 300
        while not (self.path / "model.xdmf").exists() and time.time() < deadline and run.poll() is None:
            time.sleep(0.002)
        return run

    def files(self):
        return sorted(p.name for p in self.path.iterdir() if p.suffix != ".nml")

    def contents(self):
        return {name: (self.path / name).read_bytes() for name in NAMES}

    def refuse(self, result, code, *words):
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)
        self.assertEqual(len(result.stderr.strip().splitlines()), 1, result.stderr)

    def steps(self):
        """Number of steps of the result file, all of which must be complete: the tip rises from each to the next."""
        with h5py.File(self.path / "model.vtkhdf") as file:
            steps = int(file["VTKHDF/Steps"].attrs["NSteps"])
            nodes = int(file["VTKHDF/NumberOfPoints"][0])
            rise = file["VTKHDF/PointData/displacement"][: steps * nodes].reshape(steps, nodes, 3)[:, -1, 2]
            self.assertTrue(np.all(np.diff(rise) > 0) and rise[0] == 0)
        return steps

    def test_storage(self):
        text = MODEL.format("0.5").replace("divisions = 8, 1", "divisions = 100, 2")
        found = {}
        for keys, kind, level in (("", "float64", 1), ("compress = 9 precision = 'single'", "float32", 9), ("compress = 0", "float64", None)):
            self.assertEqual(self.run_text(text + f"&output {keys} /\n").returncode, 0)
            with h5py.File(self.path / "model.vtkhdf") as file:
                field = file["VTKHDF/PointData/displacement"]
                self.assertEqual((field.dtype, field.compression_opts), (np.dtype(kind), level))
                self.assertEqual(file["VTKHDF/Points"].dtype, np.float64)
                found[keys] = field[:]
        np.testing.assert_array_equal(found[""], found["compress = 0"])
        np.testing.assert_array_equal(found[""].astype(np.float32), found["compress = 9 precision = 'single'"])
        self.refuse(self.run_text(text + "&output compress = 10 /\n"), 2, "model.nml:8", "compress", "10", "9")
        self.refuse(self.run_text(text + "&output precision = 'half' /\n"), 2, "model.nml:8", "precision", "'half'", "single")

    def test_a_start_that_fails_leaves_earlier_results(self):
        self.assertEqual(self.run_text(SHORT).returncode, 0)
        self.assertEqual(self.files(), NAMES)
        before = self.contents()
        self.refuse(self.run_text(SHORT.replace("thickness = 0.1", "thickness = -0.1")), 2, "model.nml:3")
        for limit in (10, 5000, 40000):
            self.refuse(self.run_text(SHORT, limit), 2, "model~.", "ulimit -f" if limit > 10 else "cannot")
            self.assertEqual(self.files(), NAMES)
        self.assertEqual(self.contents(), before)

    def test_results_that_cannot_be_replaced(self):
        for name in NAMES:
            (self.path / name).mkdir()
            self.refuse(self.run_text(SHORT), 2, name, "cannot be replaced")
            self.assertEqual(self.files(), [name])
            (self.path / name).rmdir()

    def test_file_size_limit_while_the_run_goes_on(self):
        result = self.run_text(LONG, 700_000)
        self.refuse(result, 1, "model.vtkhdf", "ulimit -f")
        self.assertIn("STOPPED EARLY", result.stdout)
        self.assertGreater(self.steps(), 5)
        self.assertEqual(len(list(ElementTree.parse(self.path / "model.xdmf").iter("Time"))), self.steps())
        rows = (self.path / "model.history.csv").read_text().splitlines()
        self.assertEqual({row.count(",") for row in rows}, {10})

    def test_history_or_xdmf_first(self):
        """The history alone grows, up to the limit: rows are complete."""
        self.refuse(self.run_text(LONG + "&output every = 0 /\n", 4096), 1, "model.history.csv", "ulimit -f")
        text = (self.path / "model.history.csv").read_text()
        self.assertTrue(text.endswith("\n"))
        self.assertEqual({row.count(",") for row in text.splitlines()}, {10})
        self.assertGreater(len(text), 3500)

    def test_two_runs_of_one_name(self):
        first = self.start(LONG)
        self.refuse(self.run_text(SHORT), 2, "model.lock", f"process {first.pid}", "another run", "-o")
        self.assertIsNone(first.poll(), "the first run ended before the second one met it")
        self.assertEqual(self.run_text(SHORT, command="check").returncode, 0)
        other = self.run_text("&job name = 'other' /\n" + SHORT)
        self.assertEqual(other.returncode, 0, other.stderr)
        first.kill()
        first.communicate()
        self.assertEqual(self.run_text(SHORT).returncode, 0)
        self.assertEqual(self.steps(), 51)
        self.assertEqual(self.files(), NAMES + [name.replace("model", "other") for name in NAMES])

    def test_read_while_the_run_goes_on(self):
        run = self.start(LONG)
        found, refused, end = [], 0, time.monotonic() + 300
        # on a busy machine the run may stand still meanwhile
        while (len(found) < 30 or found[-1] == found[0]) and refused < 1000 and time.monotonic() < end:
            try:
                found.append(self.steps())
            except (OSError, AssertionError):  # in the middle of an increment; this model takes 0.4 ms for each
                refused += 1
        self.assertGreaterEqual(len(found), 30)
        self.assertGreater(found[-1], found[0])
        # somebody who keeps the file open does not stop the run, and sees the steps he knows unchanged
        file = None
        while file is None and refused < 1000:
            try:
                file = h5py.File(self.path / "model.vtkhdf")
            except OSError:  # in the middle of an increment, as above
                refused += 1
        with file:
            before, deadline = self.length_of_history(), time.time() + 300
            first = file["VTKHDF/PointData/displacement"][:18]
            while self.length_of_history() < before + 5 and time.time() < deadline:
                time.sleep(0.01)
            np.testing.assert_array_equal(file["VTKHDF/PointData/displacement"][:18], first)
            self.assertGreaterEqual(self.length_of_history(), before + 5)
        run.kill()
        run.communicate()
        self.assertGreater(self.steps(), found[-1])

    def test_last_increment_in_pyvista(self):
        """The lines of doc/namelist.md."""
        self.assertEqual(self.run_text(SHORT).returncode, 0)
        text = (Path(os.environ["FINSHELL_SOURCE_DIR"]) / "doc" / "namelist.md").read_text()
        names = {"pv": pyvista}
        exec(re.search(r"```python\n(.*?)```", text, re.S).group(1).replace("disk.vtkhdf", str(self.path / "model.vtkhdf")), names)
        tip = float((self.path / "model.history.csv").read_text().split("\n")[-2].split(",")[4])
        self.assertAlmostEqual(names["grid"].point_data["displacement"][-1, 2] / tip, 1, places=3)
        self.assertEqual(pyvista.read(self.path / "model.vtkhdf").point_data["displacement"][-1, 2], 0)

    def length_of_history(self):
        return len((self.path / "model.history.csv").read_text().splitlines())


if __name__ == "__main__":
    unittest.main()
