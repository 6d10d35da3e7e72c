#!/usr/bin/env python3
"""Result files of parts of the mesh and of some increments: the same values as in the whole, and nothing else; also after a restart."""
import csv
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np
import pyvista

PROGRAM = os.environ["FINSHELL_BIN"]
MODEL = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 20, 2 /
&element_set name = 'outer' x = 7.1, 99 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0e6 density = 1000 /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0, 20.0 /
&monitor name = 'tip' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
"""
STEP = "&step load_factor = 1.0 first_increment = 0.1 automatic = .false. load_levels = 0.55 /\n"


class Output(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def call(self, *arguments, code=0):
        done = subprocess.run([PROGRAM, *arguments], cwd=self.path, capture_output=True, text=True, timeout=120, check=False)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done

    def run_text(self, text, code=0):
        (self.path / "a.nml").write_text(text)
        return self.call("run", "-q", "a.nml", code=code)

    def increments(self, name):
        with h5py.File(self.path / f"{name}.vtkhdf") as file:
            self.assertEqual(file["VTKHDF/Steps"].attrs["NSteps"], len(file["VTKHDF/Steps/Values"]))
            return list(file["finshell/history/increment"][:])

    def history(self):
        with (self.path / "a.history.csv").open() as file:
            return list(csv.DictReader(file))

    @staticmethod
    def grid(path, step):
        reader = pyvista.get_reader(path)
        reader.reader.UpdateInformation()
        reader.reader.SetStep(step)
        return reader.read()

    def check_part(self, name, rule, fields):
        """Each step of a part holds what the whole has there, in an order that its numbers tell."""
        steps = self.increments("a")
        for i, increment in enumerate(self.increments(name)):
            whole = self.grid(self.path / "a.vtkhdf", steps.index(increment))
            part = self.grid(self.path / f"{name}.vtkhdf", i)
            nodes = part.point_data["node_number"].astype(int) - 1
            elements = part.cell_data["element_number"].astype(int) - 1
            self.assertTrue(np.all(np.diff(nodes) > 0))
            np.testing.assert_array_equal(part.points, whole.points[nodes])
            corners = whole.cells.reshape(-1, 4)[:, 1:]
            np.testing.assert_array_equal(nodes[part.cells.reshape(-1, 4)[:, 1:]], corners[elements])
            np.testing.assert_array_equal(np.sort(elements), np.flatnonzero(rule(whole.points[corners])))
            np.testing.assert_array_equal(np.unique(corners[elements]), nodes)
            self.assertEqual(set(part.point_data) | set(part.cell_data), {"displacement", *fields, "node_number", "element_number"})
            for field in part.point_data:
                if field != "node_number":
                    np.testing.assert_array_equal(part.point_data[field], whole.point_data[field][nodes])
            for field in part.cell_data:
                if field != "element_number":
                    np.testing.assert_array_equal(part.cell_data[field], whole.cell_data[field][elements])

    def test_parts_of_the_mesh(self):
        text = MODEL + STEP + "&output fields = 'rotation', 'stress', 'error', 'thickness_stretch' /\n"
        text += "&output name = 'end' element_set = 'outer' fields = 'rotation', 'stress', 'error' every = 3 /\n"
        text += "&output name = 'clamp' node_set = 'edge_x0' fields = 'thickness_stretch' /\n"
        self.run_text(text)
        self.assertEqual(sorted(p.name for p in self.path.glob("a.*.vtkhdf")), ["a.clamp.vtkhdf", "a.end.vtkhdf"])
        self.assertEqual(sorted(p.name for p in self.path.glob("*.xdmf")), ["a.clamp.xdmf", "a.end.xdmf", "a.xdmf"])
        stresses = [f"stress_{place}" for place in ("bottom", "middle", "top")]
        self.check_part("a.end", lambda x: x.mean(axis=1)[:, 0] > 7.1, ["rotation", "error", *stresses])
        self.check_part("a.clamp", lambda x: np.any(x[:, :, 0] < 1e-9, axis=1), ["thickness_stretch"])
        self.assertLess((self.path / "a.clamp.vtkhdf").stat().st_size, (self.path / "a.vtkhdf").stat().st_size)

    def test_parts_without_the_whole(self):
        self.run_text(MODEL + STEP + "&output every = 0 /\n&output name = 'end' element_set = 'outer' /\n")
        self.assertFalse((self.path / "a.vtkhdf").exists())
        self.assertEqual(len(self.increments("a.end")), len(self.history()) + 1)

    def test_when(self):
        """By count; at load levels of the step; where load factors are reached or passed; the last. The history has all."""
        text = MODEL + STEP + "&output every = 4 /\n&output name = 'levels' load_levels = 0.25, 0.55, 1.0, 3.0 /\n"
        text += "&output name = 'both' load_levels = 0.25 every = 5 /\n&output name = 'last' last = .true. /\n"
        self.run_text(text)
        factors = [0.0] + [float(row["load_factor"]) for row in self.history()]
        last = len(factors) - 1
        at = min(i for i, f in enumerate(factors) if abs(f - 0.55) < 1e-12)
        first = next(i for i, f in enumerate(factors) if f > 0.25)
        self.assertEqual(self.increments("a"), sorted({0, 4, 8, at, last}))
        self.assertEqual(self.increments("a.levels"), [0, first, at, last])
        self.assertEqual(self.increments("a.both"), sorted({0, first, 5, 10, last}) if last >= 10 else sorted({0, first, 5, last}))
        self.assertEqual(self.increments("a.last"), [0, last])

    def test_load_levels_on_the_way_back(self):
        self.run_text(MODEL + STEP + STEP.replace("1.0", "0.0", 1) + "&output load_levels = 0.22 /\n")
        rows = self.history()
        factors = [0.0] + [float(row["load_factor"]) for row in rows]
        passed = [i for i in range(1, len(factors)) if (factors[i - 1] - 0.22) * (factors[i] - 0.22) <= 0]
        self.assertEqual(len(passed), 2)
        self.assertEqual(self.increments("a"), [0, *passed, len(rows)])

    def test_times(self):
        self.run_text(MODEL + "&step control = 'dynamic' duration = 0.1 /\n&output times = 0.03, 0.05 /\n&output name = 'all' /\n")
        times = [0.0] + [float(row["time"]) for row in self.history()]
        expected = [0, *(next(i for i, t in enumerate(times) if t >= wanted) for wanted in (0.03, 0.05)), len(times) - 1]
        self.assertEqual(self.increments("a"), expected)
        self.assertEqual(self.increments("a.all"), list(range(len(times))))

    def test_modes_and_linear_steps_are_written(self):
        self.run_text(MODEL + "&step control = 'linear' /\n&step control = 'frequencies' modes = 2 /\n&output last = .true. /\n")
        self.assertEqual(self.increments("a"), [0, 1, 2, 3])

    def test_restart(self):
        """A run that goes on gives the files of one that was not interrupted, whatever they hold."""
        outputs = "&output restart = 'every' /\n&output name = 'end' element_set = 'outer' fields = 'stress' load_levels = 0.25, 0.35, 0.75 /\n"
        outputs += "&output name = 'few' every = 3 /\n&output name = 'last' last = .true. node_set = 'edge_x1' /\n"
        self.run_text(MODEL + STEP + outputs)
        names = ["a", "a.end", "a.few", "a.last"]
        whole = {name: self.contents(name) for name in names}
        steps = {name: self.increments(name) for name in names}
        for at in (2, 3, 6):
            self.run_text(MODEL + STEP + outputs)
            self.call("restart", "-q", "a", "--from", str(at))
            for name in names:
                ours = self.contents(name)
                last = steps[name][-1]
                # where the run began anew stands what it was then: the last increment of the run is not yet known
                self.assertEqual([i for i in self.increments(name) if i != at or i in steps[name]], steps[name])
                self.assertEqual(ours[last], whole[name][last])
                for increment in steps[name]:
                    self.assertEqual(ours[increment], whole[name][increment])

    def test_restart_elsewhere_and_further_parts(self):
        self.run_text(MODEL + STEP)
        (self.path / "b.nml").write_text(MODEL + STEP + "&step load_factor = 2 /\n&output name = 'end' element_set = 'outer' /\n&job name = 'a' /\n")
        before = self.increments("a")
        self.call("restart", "-q", "a", "b.nml")
        self.assertEqual(self.increments("a")[: len(before)], before)
        self.assertEqual(self.increments("a.end"), list(range(before[-1], len(self.history()) + 1)))

    def contents(self, name):
        with h5py.File(self.path / f"{name}.vtkhdf") as file:
            found = {}
            nodes, cells = int(file["VTKHDF/NumberOfPoints"][0]), int(file["VTKHDF/NumberOfCells"][0])
            for i, increment in enumerate(self.increments(name)):
                found[increment] = b"".join(file[f"VTKHDF/PointData/{f}"][i * nodes : (i + 1) * nodes].tobytes() for f in file["VTKHDF/PointData"])
                found[increment] += b"".join(file[f"VTKHDF/CellData/{f}"][i * cells : (i + 1) * cells].tobytes() for f in file["VTKHDF/CellData"])
            return found

    def test_a_start_that_fails_leaves_all_files(self):
        text = MODEL + STEP + "&output name = 'end' element_set = 'outer' /\n"
        self.run_text(text)
        before = {p.name: p.read_bytes() for p in self.path.glob("a.*")}
        (self.path / "a.end.xdmf").unlink()
        (self.path / "a.end.xdmf").mkdir()
        self.assertIn("a.end.xdmf", self.run_text(text, code=2).stderr)
        shutil.rmtree(self.path / "a.end.xdmf")
        del before["a.end.xdmf"]
        self.assertEqual({p.name: p.read_bytes() for p in self.path.glob("a.*")}, before)

    def test_single_precision(self):
        self.run_text(MODEL + STEP + "&output name = 'end' element_set = 'outer' precision = 'single' compress = 9 /\n")
        with h5py.File(self.path / "a.end.vtkhdf") as part, h5py.File(self.path / "a.vtkhdf") as whole:
            self.assertEqual(part["VTKHDF/PointData/displacement"].dtype, np.float32)
            self.assertEqual(whole["VTKHDF/PointData/displacement"].dtype, np.float64)

    def test_refusals(self):
        begin = MODEL + STEP + "&output "
        for keys, words in (
            ("element_set = 'outer' node_set = 'all'", "either node_set or element_set is expected"),
            ("element_set = 'nowhere'", "nowhere"),
            ("last = .true. every = 2", "either last or every is expected"),
            ("last = .true. load_levels = 2", "either last or load_levels is expected"),
            ("times = 1.0", "there is no step in time"),
            ("name = 'x' every = 0", "a result file without increments"),
            ("name = 'x/y'", "is no name"),
            ("name = 'x' restart = 'every'", "unknown key restart"),
            ("name = 'x' verbose = .true.", "unknown key verbose"),
            ("/\n&output every = 3", "there is a group without a name already"),
            ("name = 'x' /\n&output name = 'x'", "there is an output 'x' already"),
        ):
            with self.subTest(keys=keys):
                done = self.run_text(begin + keys + " /\n", code=2)
                self.assertIn(words, done.stderr)
                self.assertIn("a.nml:", done.stderr)


if __name__ == "__main__":
    unittest.main()
