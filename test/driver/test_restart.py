#!/usr/bin/env python3
"""Runs that go on where others ended or were killed: the same numbers, bit for bit; what may change, and what is refused."""
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

try:
    import h5py
    import numpy as np
except ImportError:
    print("h5py is not installed")
    sys.exit(77)

PROGRAM = os.environ["FINSHELL_BIN"]
KILLS = int(os.environ.get("FINSHELL_KILLS", "5"))
SHEET = """&job name = 'r' /
&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 8, 1 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0e3 /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'force' node_set = 'edge_x1' vector = 0.0, 0.0, 0.01 total = .true. /
"""
CONSTANT = "&load type = 'traction' vector = 0, 0.001, 0.0001 constant = .true. /\n"
TIP = "node_set = 'edge_x1' component = 'z'"
MONITOR = "&monitor name = 'tip' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /\n"
MIXED = SHEET + CONSTANT + MONITOR + f"""&step load_factor = 1.0 first_increment = 0.2 largest_increment = 0.3 /
&step control = 'linear' load_factor = 1.0 /
&step control = 'displacement' {TIP} displacements = 7.0, 7.5 first_increment = 0.3 /
&step control = 'arc_length' load_factor = 4.0 largest_increment = 0.6 /
&step control = 'buckling' modes = 2 /
&step load_factor = 2.0 first_increment = 0.7 /
"""
ROOF = """&job name = 'r' /
&mesh generator = 'cylinder' radius = 2540.0 length = 254.0 angles = 0.0, 5.72957795 divisions = 6, 6 /
&material name = 'm' law = 'linear_elastic' e = 3102.75 nu = 0.3 /
&section thickness = 6.35 /
&support node_set = 'edge_a1' fixed = 'ux', 'uy', 'uz' /
&support node_set = 'edge_a0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'force' node_set = 'corner_a0_y0' vector = 0, 0, -250 /
""" + "&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_a0_y0' /\n"
SNAPPING = ROOF + "&step control = 'arc_length' node_set = 'corner_a0_y0' component = 'z' displacements = -30.0 locate = .true. /\n"
CHAMBER = """&job name = 'r' /
&mesh generator = 'disk' radius = 7.5 rings = 4 portion = 'quarter' /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0 /
&section thickness = 0.5 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'pressure' pressure = 10.0 /
&step control = 'volume' volumes = 60.0, 150.0 first_increment = 15.0 largest_increment = 15.0 /
&step control = 'volume' volumes = 100.0 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /
"""

CASES = """&job name = 'r' /
&mesh generator = 'disk' radius = 10.0 rings = 6 portion = 'quarter' /
&material name = 'm' law = 'neo_hookean' mu = 1.0 /
&section thickness = 0.2 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&support node_set = 'centre' uz = -1.0 case = 'stamp' /
&load type = 'pressure' pressure = 0.02 case = 'air' /
&load type = 'traction' vector = 0, 0, -0.01 /
&step case = 'air' /
&step case = 'stamp' /
&step /
&step case = 'air' load_factor = 0.5 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /
"""

STAGES = CASES.replace("type = 'hinged' /", "type = 'hinged' until_step = 3 /\n&support node_set = 'rim' fixed = 'uz' from_step = 4 /", 1).replace(
    "uz = -1.0 case = 'stamp' /", "uz = -1.0 case = 'stamp' from_step = 2 /").replace("-0.01 /", "-0.01 amplitude = 'a' /") \
    + "&amplitude name = 'a' points = 0, 0.1, 0.4, 0.2, 0.7, 1, 1, 1 /\n"
TURNED = SHEET + MONITOR + """&support node_set = 'edge_x1' fixed = 'ux', 'uy', 'rx', 'rz' uz = 0.5 ry = 0.3 case = 'more' from_step = 2 until_step = 2 /
&load type = 'traction' vector = 0, 0, -0.001 from_step = 3 /
&step load_factor = 1.0 first_increment = 0.4 /
&step case = 'more' first_increment = 0.3 /
&step load_factor = 1.5 first_increment = 0.2 control = 'arc_length' /
"""

IMPERFECT = ROOF + """&imperfection step = 2 amplitudes = 1.0 /
&imperfection wave_length = 100.0 amplitudes = 0.5 /
&step load_factor = 0.1 /
&step control = 'buckling' modes = 1 /
&step load_factor = 1.0 first_increment = 0.1 largest_increment = 0.1 /
"""

# supports that move over time, come and go between motions; an amplitude over time
MOTION = SHEET.replace("mu = 1.0e3", "mu = 1.0e6 density = 1000.0") + MONITOR + """&support node_set = 'edge_x1' fixed = 'ux', 'uy' uz = 0.2 until_step = 1 /
&support node_set = 'edge_x1' fixed = 'ux', 'uy', 'rx', 'rz' uz = 0.3 ry = 0.4 amplitude = 't' from_step = 3 /
&load type = 'traction' vector = 0, 0, -1.0 amplitude = 't' /
&amplitude name = 't' over = 'time' points = 0, 0, 0.03, 0.0, 0.05, 1 smooth = .true. /
&step control = 'dynamic' duration = 0.02 times = 0.01 factors = 1 smooth = .true. first_increment = 0.002 automatic = .false. /
&step load_factor = 0.5 /
&step control = '{}' duration = 0.03 times = 0.01 factors = 0.5 {} /
"""

#: Growth: by layers, over a table, as a case of its own that comes with a step, constant until another one; the factor of arc-length.
GROWN = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 12, 2 /
&material name = 'r' law = 'neo_hookean' mu = 1.0 density = 1.0 /
&field name = 't' over = 'x' points = 0, 0.1, 10, 0.05 /
&section thickness = 0.1, 0.1 thickness_field = 't' /
&support node_set = 'edge_x0' type = 'clamped' /
&amplitude name = 'a' points = 0.0, 0.0,  0.4, 0.5,  1.0, 1.0 /
&growth growth = 1.005, 1.0 layer = 1 amplitude = 'a' /
&growth prestretch = 1.02, 1.0 case = 'p' from_step = 2 /
&growth expansion = 1e-3 temperature = 20 constant = .true. until_step = 2 /
&step first_increment = 0.2 /
&step case = 'p' first_increment = 0.25 /
&step control = 'arc_length' load_factor = 0.3 /
"""


class Restart(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)

    def run_program(self, *arguments, code=0):
        run = subprocess.run([PROGRAM, *arguments], cwd=self.path, capture_output=True, text=True, check=False, timeout=300,
                             env={**os.environ, "OMP_NUM_THREADS": "1"})
        self.assertEqual(run.returncode, code, run.stdout + run.stderr)
        return run.stdout + run.stderr

    def solve(self, text, folder, *arguments, code=0):
        """Run an input, results in a folder."""
        (self.path / folder).mkdir(exist_ok=True)
        (self.path / "r.nml").write_text(text)
        return self.run_program("run", "r.nml", "-o", folder, *arguments, code=code)

    def history(self, folder, name="r"):
        return (self.path / folder / f"{name}.history.csv").read_text()

    def fields(self, folder, name="r"):
        """Increments and displacements of the result file."""
        with h5py.File(self.path / folder / f"{name}.vtkhdf") as file:
            steps = int(file["VTKHDF/Steps"].attrs["NSteps"])
            return (list(file["finshell/history/increment"][:steps]), file["VTKHDF/Steps/Values"][:steps],
                    np.split(file["VTKHDF/PointData/displacement"][:], steps))

    def check_same(self, folder, other, name="r"):
        self.assertEqual(self.history(folder, name), self.history(other))
        for found, expected in zip(self.fields(folder, name), self.fields(other)):
            np.testing.assert_array_equal(found, expected)

    def test_every_increment(self):
        for text in (MIXED, SNAPPING, CHAMBER, CASES, STAGES, TURNED, GROWN, IMPERFECT, MOTION.format('dynamic', 'first_increment = 0.003 automatic = .false.'), MOTION.format('explicit', 'history_rows = 6')):
            with self.subTest(text=text):
                output = "&output restart = 'every' /\n"
                self.solve(text + output, "whole", "-q")
                rows = self.history("whole").splitlines()[1:]
                self.assertGreater(len(rows), 8)
                increments = [int(row.split(",")[0]) for row in rows]
                kept = 0
                for last in [0 if text != IMPERFECT else increments[0], *increments]:
                    shutil.rmtree(self.path / "again", ignore_errors=True)
                    shutil.copytree(self.path / "whole", self.path / "again")
                    if 0 < last < len(rows) and (text == MIXED or "duration" in text):
                        run = subprocess.run([PROGRAM, "restart", "again/r.vtkhdf", "--from", str(last), "-q"], cwd=self.path,
                                             capture_output=True, text=True, check=False, env={**os.environ, "OMP_NUM_THREADS": "1"})
                        if "cannot restart from increment" in run.stderr:  # in the middle of modes, at rest after a motion
                            continue
                        self.assertEqual(run.returncode, 0, run.stderr)
                    else:
                        self.run_program("restart", "again/r.vtkhdf", "--from", str(last), "-q")
                    kept += 1
                    self.check_same("again", "whole")
                self.assertGreaterEqual(kept, len(rows))
                shutil.rmtree(self.path / "whole")

    def test_killed_at_any_moment(self):
        """Killed KILLS times at random moments, and gone on each time."""
        random.seed(int(os.environ.get("FINSHELL_SEED", "3")))
        text = CHAMBER.replace("rings = 4", "rings = 10").replace("= 15.0", "= 2.0")
        for keep in ("every", "last"):
            output = f"&output restart = '{keep}' /\n"
            began = time.time()
            self.solve(text + output, "whole", "-q")
            duration = time.time() - began
            shutil.rmtree(self.path / "again", ignore_errors=True)
            (self.path / "again").mkdir()
            killed = 0
            for _ in range(20 * KILLS):
                if killed == KILLS:
                    break
                command = ["restart", "again/r"] if (self.path / "again/r.restart").exists() else ["run", "r.nml", "-o", "again"]
                run = subprocess.Popen([PROGRAM, *command, "-q"], cwd=self.path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                       env={**os.environ, "OMP_NUM_THREADS": "1"})
                try:
                    run.communicate(timeout=random.uniform(0.02, 1.2) * duration / (1 + 0.2 * KILLS * (keep == "every")))
                except subprocess.TimeoutExpired:
                    run.kill()
                    run.communicate()
                    killed += 1
                    continue
                self.assertEqual(run.returncode, 0)
                self.check_same("again", "whole")
                shutil.rmtree(self.path / "again")
                (self.path / "again").mkdir()
            self.assertEqual(killed, KILLS)
            command = ["restart", "again/r"] if (self.path / "again/r.restart").exists() else ["run", "r.nml", "-o", "again"]
            self.run_program(*command, "-q")
            self.check_same("again", "whole")
            self.assertEqual(sorted(p.name for p in (self.path / "again").iterdir()), ["r.history.csv", "r.restart", "r.vtkhdf", "r.xdmf"])
            shutil.rmtree(self.path / "whole")

    def test_further_steps(self):
        first, second = MIXED.split("&step control = 'buckling'")
        self.solve(MIXED, "whole", "-q")
        self.solve(first, "again", "-q")
        (self.path / "more.nml").write_text("! more\n" + first + "&step control = 'buckling'" + second)
        printed = self.run_program("restart", "again/r.history.csv", "more.nml")
        self.assertIn("Goes on after increment", printed)
        self.assertEqual(self.history("again"), self.history("whole"))
        # a run that has ended has nothing left to do
        self.run_program("restart", "again/r", "-q")
        self.assertEqual(self.history("again"), self.history("whole"))

    def test_an_early_stop_goes_on_with_other_settings(self):
        text = SHEET + MONITOR + "&step load_factor = 3.0 first_increment = 0.1 largest_increment = 0.1 maximum_increments = {} /\n"
        self.solve(text.format(7), "whole", "-q", code=1)
        self.solve(text.format(100), "again", "-q")
        (self.path / "other.nml").write_text(text.format(100))
        self.run_program("restart", "whole/r", "other.nml", "-q")
        self.check_same("whole", "again")

    def test_other_files(self):
        """Another folder or another name: new files that begin where the run goes on; the old ones stay."""
        self.solve(MIXED + "&output restart = 'every' /\n", "whole", "-q")
        before = {p.name: p.read_bytes() for p in (self.path / "whole").iterdir()}
        (self.path / "new").mkdir()
        self.run_program("restart", "whole/r", "--from", "3", "-o", "new", "-q")
        rows = self.history("whole").splitlines()
        self.assertEqual(self.history("new").splitlines(), [rows[0], *rows[4:]])
        self.assertEqual(self.fields("new")[0], [3, *range(4, len(rows))])
        np.testing.assert_array_equal(self.fields("new")[2][0], self.fields("whole")[2][3])
        (self.path / "named.nml").write_text(MIXED.replace("name = 'r'", "name = 'branch'") + "&monitor name = 'e' quantity = 'energy' /\n")
        self.run_program("restart", "whole/r", "named.nml", "--from", "3", "-q")
        self.assertEqual(len(self.history("whole", "branch").splitlines()), len(rows) - 3)
        self.assertEqual(before, {name: (self.path / "whole" / name).read_bytes() for name in before})

    def test_the_input_is_found_from_elsewhere(self):
        """Files that the input names are relative to it, wherever the run goes on; a mesh that has changed is refused."""
        data = Path(os.environ["FINSHELL_SOURCE_DIR"]) / "test" / "data"
        (self.path / "model").mkdir()
        shutil.copy(data / "plate.msh", self.path / "model")
        text = re.sub("&mesh.*/\n", "&mesh file = 'plate.msh' /\n", SHEET).replace("edge_x0", "left").replace("edge_x1", "right")
        names = re.findall(r'"(\w+)"', (data / "plate.msh").read_text())
        text = text.replace("'left'", f"'{names[0]}'").replace("'right'", f"'{names[1]}'")
        (self.path / "model/r.nml").write_text(text + "&step load_factor = 0.001 /\n")
        self.run_program("run", "model/r.nml", "-o", "model", "-q")
        (self.path / "far").mkdir()
        run = subprocess.run([PROGRAM, "restart", "../model/r"], cwd=self.path / "far", capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        mesh = (self.path / "model/plate.msh").read_text()
        moved = re.sub(r"(\$Nodes.*?)(\d+\.\d+)", lambda m: m.group(1) + str(float(m.group(2)) + 1e-6), mesh, count=1, flags=re.S)
        self.assertNotEqual(mesh, moved)
        (self.path / "model/plate.msh").write_text(moved)
        self.assertIn("the mesh, or a file beside the input, is not that of the run", self.run_program("restart", "model/r", code=2))

    def test_refusals(self):
        self.solve(MIXED, "whole", "-q")
        before = {p.name: p.read_bytes() for p in (self.path / "whole").iterdir()}

        def refuse(words, *arguments):
            printed = self.run_program("restart", *arguments, code=2)
            for word in words:
                self.assertIn(word, printed)

        def refuse_change(old, new, *words):
            self.assertIn(old, MIXED)
            (self.path / "other.nml").write_text(MIXED.replace(old, new, 1))
            refuse(words, "whole/r", "other.nml")
        refuse_change("divisions = 8", "divisions = 9", "other.nml:2: &mesh divisions", "found 9, 1, the run had 8, 1")
        refuse_change("mu = 1.0e3", "mu = 1.1e3", "other.nml:3: &material mu", "found 1.1e3, the run had 1.0e3")
        refuse_change("thickness = 0.1", "thickness = 0.2", "&section thickness")
        refuse_change("type = 'clamped'", "type = 'hinged'", "&support type", "found hinged, the run had clamped")
        refuse_change("0.0, 0.0, 0.01 total", "0.0, 0.1, 0.01 total", "&load vector")
        refuse_change(" total = .true.", "", "&load", "the run had total = .true.")
        refuse_change(CONSTANT, "", "found are 1 groups &load, expected at least 2")
        refuse_change(CONSTANT, 2 * CONSTANT, "&load", "the run had 2 such groups")
        refuse_change("load_factor = 4.0", "load_factor = 5.0", "&step load_factor", "found 5.0, the run had 4.0")
        refuse_change("&job", "&job accuracy = 'fast'", "accuracy = 'fast' was found, the run had ''")
        refuse_change("name = 'tip'", "name = 'top'", "the history file has the columns", "expected")
        refuse_change(MONITOR, MONITOR + "&accuracy target = 0.1 /\n", "&accuracy")
        refuse(["whole/q.restart: cannot restart"], "whole/q")
        refuse(["cannot restart from increment 2: expected is one of", "restart = 'every'"], "whole/r", "--from", "2")
        refuse(["--from needs a whole number, at least 0, found '-1'"], "whole/r", "--from", "-1")
        refuse(["needs the results of a run"])
        refuse(["--refine belongs to the commands run, check and mesh"], "whole/r", "--refine", "1")
        self.assertIn("belongs to the command restart", self.run_program("run", "r.nml", "--from", "1", code=2))
        self.assertEqual(before, {p.name: p.read_bytes() for p in (self.path / "whole").iterdir() if p.name != "r.lock"})
        record = before["r.restart"]
        for damaged, words in ((record[: len(record) // 2], "the file is damaged"), (b"", "has not written this file"),
                               (b"x" + record[1:], "has not written this file"), (record[:100] + b"\x00" * 200, "cannot restart")):
            (self.path / "whole/r.restart").write_bytes(damaged)
            refuse(["whole/r.restart: cannot restart", words], "whole/r")
        (self.path / "whole/r.restart").write_bytes(record)
        (self.path / "whole/r.history.csv").write_text("\n".join(self.history("whole").splitlines()[:4]) + "\n")
        refuse(["the history ends with increment 3"], "whole/r")

    def test_nothing_is_kept_where_it_is_not_wanted(self):
        self.solve(MIXED, "whole", "-q")
        self.assertTrue((self.path / "whole/r.restart").exists())
        self.solve(MIXED + "&output restart = 'none' /\n", "whole", "-q")
        self.assertFalse((self.path / "whole/r.restart").exists(), "one of an earlier run")


if __name__ == "__main__":
    unittest.main()
