#!/usr/bin/env python3
"""finshell_mpi: on 2 and 4 processes the histories, counts and fields of examples are those of one process; errors end all with one
sentence. Skipped where it is not built (-DFINSHELL_MPI=ON)."""
import csv
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np

PROGRAM = os.environ["FINSHELL_BIN"]
PARALLEL = os.environ.get("FINSHELL_MPI_BIN", "")
EXAMPLES = Path(os.environ["FINSHELL_SOURCE_DIR"]) / "examples"
# shells and membranes, dead loads, pressures, fluids, springs, moved supports, fibres, arc-length, linear steps, buckling
CASES = {"rubber_disk/rubber_disk": 4, "airbag/input": 2, "water_tank/input": 2, "beam_on_foundation/input": 4, "spinning_ring/input": 2,
         "inflated_sphere/mooney_rivlin": 2, "sze31/input": 4, "sze34/input": 2, "hinged_strip/input": 2, "scordelis_lo/input": 4,
         "cook/input": 2, "sze38a/input": 2, "fibre_arc/circumferential": 2}
CLOCK = {"cpu_s", "cpu_time"}
STRIP = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = {}, 1 /
&material name = 'm' law = 'linear_elastic' e = 1000.0 nu = 0.0 density = 2.0 /
&section thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_x1' vector = -2e-3, 0.0, 1e-6 /
&monitor name = 'w' quantity = 'displacement' node_set = 'edge_x1' component = 'z' /
&step load_factor = 0.1 /
&step control = 'linear' load_factor = 0.2 /
"""


def rows_of(folder):
    name = next(folder.glob("*.history.csv"))
    return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(name.read_text().splitlines())]


def fields_of(folder):
    """Name -> all values of the result file that are numbers."""
    found = {}
    for name in folder.glob("*.vtkhdf"):
        with h5py.File(name, "r") as file:
            for group in ("VTKHDF/PointData", "VTKHDF/CellData"):
                for key, values in file.get(group, {}).items():
                    if values.dtype.kind == "f":
                        found[key] = values[()]
    return found


class Processes(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def run_program(self, command, source, name):
        folder = self.folder / name
        shutil.copytree(source.parent, folder)
        run = subprocess.run([*command, "run", "-q", source.name], cwd=folder, capture_output=True, text=True, check=False, timeout=300,
                             env={**os.environ, "OMP_NUM_THREADS": "1"})
        return run, folder

    def start(self, processes):
        options = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1",
                   "OMPI_MCA_hwloc_base_binding_policy": "none", "OMPI_MCA_mpi_yield_when_idle": "1"}
        os.environ.update(options)
        return ["mpirun", "-n", str(processes), PARALLEL]

    def close(self, a, b, what, tolerance=1e-10):
        a, b = np.asarray(a), np.asarray(b)
        self.assertEqual(a.shape, b.shape, what)
        self.assertTrue(np.array_equal(np.isnan(a), np.isnan(b)), what)
        scale = np.nanmax(np.abs(a), initial=0.0)
        self.assertLessEqual(np.nanmax(np.abs(a - b), initial=0.0), tolerance * scale, what)

    def test_examples(self):
        for name, processes in CASES.items():
            with self.subTest(name):
                source = EXAMPLES / f"{name}.nml"
                one, alone = self.run_program([PROGRAM], source, f"{source.parent.name}_1")
                many, together = self.run_program(self.start(processes), source, f"{source.parent.name}_n")
                self.assertEqual((one.returncode, many.returncode), (0, 0), one.stderr + many.stderr)
                a, b = rows_of(alone), rows_of(together)
                self.assertEqual([(r["increment"], r["iterations"], r["negative_pivots"]) for r in a],
                                 [(r["increment"], r["iterations"], r["negative_pivots"]) for r in b])
                for column in set(a[0]) - CLOCK - {"residual", "correction"}:
                    self.close([r[column] for r in a], [r[column] for r in b], column)
                a, b = fields_of(alone), fields_of(together)
                self.assertEqual(a.keys(), b.keys())
                for key, values in a.items():
                    # linear steps find it by a difference over a small part of the motion, with eleven digits
                    self.close(values, b[key], key, 1e-9 if key == "thickness_stretch" else 1e-10)

    def solve_text(self, text, processes, *arguments):
        (self.folder / "in.nml").write_text(text)
        command = [*self.start(processes), "run", "in.nml", *arguments]
        return subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=False, timeout=100)

    def test_linear_steps_and_modes(self):
        text = STRIP.format(16) + "&step control = 'buckling' modes = 2 /\n&step control = 'frequencies' modes = 3 /\n&step load_factor = 0.3 /\n"
        rows = {}
        for processes in (1, 3):
            run = self.solve_text(text, processes)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            rows[processes] = rows_of(self.folder)
        self.assertEqual(len(rows[1]), len(rows[3]))
        for column in ("load_factor", "w"):
            self.close([r[column] for r in rows[1]], [r[column] for r in rows[3]], column)

    def test_steps_with_stages(self):
        """Amplitudes, supports and loads that come and go, imperfections: the same on one process and on three."""
        text = STRIP.format(16).replace("1e-6 /", "1e-2 amplitude = 'a' until_step = 3 /").replace("&step control = 'linear' load_factor = 0.2 /\n", "") + """
&amplitude name = 'a' points = 0, 0, 0.04, 0.2, 0.3, 0.1 /
&support node_set = 'edge_x1' fixed = 'uy' uz = 0.1 from_step = 2 until_step = 2 /
&imperfection step = 1 amplitudes = 0.02 /
&imperfection wave_length = 3.0 amplitudes = 0.01 /
&step load_factor = 0.2 tolerance = 'tight' /
&step control = 'arc_length' load_factor = 0.3 tolerance = 'tight' /
&step tolerance = 'tight' load_factor = 0.3 /
"""
        text = text.replace("&step load_factor = 0.1 /", "&step control = 'buckling' modes = 1 /")
        rows = {}
        for processes in (1, 3):
            run = self.solve_text(text, processes)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            rows[processes] = rows_of(self.folder)
        self.assertEqual(len(rows[1]), len(rows[3]))
        for column in ("load_factor", "w", "factor_a"):
            self.close([r[column] for r in rows[1]], [r[column] for r in rows[3]], column, 1e-8)

    def test_more_processes_than_elements(self):
        run = self.solve_text(STRIP.format(1), 4)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)

    def test_errors_are_said_once(self):
        bad = self.solve_text(STRIP.replace("'rectangle'", "'sponge'").format(2), 2)
        self.assertEqual(bad.returncode, 2)
        self.assertEqual(bad.stderr.count("sponge"), 1, bad.stderr)
        text = (EXAMPLES / "sze31/input.nml").read_text()
        lost = self.solve_text(text, 2, "-o", "no/such/folder")
        self.assertEqual(lost.returncode, 2)
        self.assertEqual(lost.stderr.count("finshell: no/such/folder"), 1, lost.stderr)

    def test_one_process_fails(self):
        """A process that cannot read its input ends all of them, with its sentence."""
        (self.folder / "in.nml").write_text(STRIP.format(16))
        (self.folder / "empty").mkdir()
        command = self.start(1)
        run = subprocess.run([*command, "run", "in.nml", ":", "-n", "1", "--wdir", str(self.folder / "empty"), PARALLEL, "run", "in.nml"],
                             cwd=self.folder, capture_output=True, text=True, check=False, timeout=60)
        self.assertEqual(run.returncode, 2, run.stdout + run.stderr)
        self.assertEqual(run.stderr.count("finshell: cannot open the file 'in.nml'"), 1, run.stderr)

    def test_help(self):
        run = subprocess.run([*self.start(2), "--version"], capture_output=True, text=True, check=True, timeout=60)
        self.assertEqual(run.stdout.count("finshell"), 1)


if __name__ == "__main__":
    if not PARALLEL or not shutil.which("mpirun"):
        print("finshell_mpi is not built")
        sys.exit(77)
    unittest.main()
