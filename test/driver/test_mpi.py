#!/usr/bin/env python3
"""finshell_mpi: on 2 and 4 processes the histories, counts and fields of examples are those of one process; errors end all with one
sentence. Skipped where it is not built (-DFINSHELL_MPI=ON)."""
import csv
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import h5py
import numpy as np

PROGRAM = os.environ["FINSHELL_BIN"]
PARALLEL = os.environ.get("FINSHELL_MPI_BIN", "")
EXAMPLES = Path(os.environ["FINSHELL_SOURCE_DIR"]) / "examples"
# shells and membranes, dead loads, pressures, chambers, fluids, springs, moved supports, fibres, arc-length, linear steps, buckling
CASES = {"rubber_disk/rubber_disk": 4, "airbag/input": 2, "water_tank/input": 2, "beam_on_foundation/input": 4, "spinning_ring/input": 2,
         "inflated_sphere/mooney_rivlin": 2, "sze31/input": 4, "sze34/input": 2, "hinged_strip/input": 2, "scordelis_lo/input": 4,
         "cook/input": 2, "sze38a/input": 2, "fibre_arc/circumferential": 2, "gas_balloon/vessel": 4}
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

    def test_growth(self):
        text = (STRIP.format(16) + "&growth growth = 1.01 case = 'g' /\n&growth growth = 1.002, 1.0, 1.01 /\n&output energy = .true. /\n"
                "&step control = 'linear' /\n&step load_factor = 0.2 /\n&step case = 'g' load_factor = 0.5 /\n")
        rows = {}
        for processes in (1, 3):
            run = self.solve_text(text, processes)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            rows[processes] = rows_of(self.folder)
        for column in ("load_factor", "w", "stored_energy", "work_g"):
            self.close([r[column] for r in rows[1]], [r[column] for r in rows[3]], column, 1e-9)

    def test_output(self):
        """Section forces, energy, parts of the mesh, probes, and the log of iterations, from the one process that writes."""
        text = STRIP.format(16) + "&element_set name = 'end' x = 4, 99 /\n&output energy = .true. verbose = .true. /\n"
        text += "&output name = 'end' element_set = 'end' fields = 'stress' /\n&probe name = 'mid' from = 0, 0.5, 0 to = 10, 0.5, 0 points = 7 fields = 'stress' /\n"
        text += "".join(f"&monitor name = '{q}_{c}' quantity = '{q}' component = '{c}' element_set = 'end' /\n"
                        for q, c in (("section_force", "x"), ("section_moment", "y")))
        rows, probes, fields, logs = {}, {}, {}, {}
        for processes in (1, 3):
            run = self.solve_text(text, processes)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            rows[processes], fields[processes] = rows_of(self.folder), fields_of(self.folder)
            probes[processes] = np.loadtxt(self.folder / "in.mid.csv", delimiter=",", skiprows=1)
            logs[processes] = (self.folder / "in.iterations.log").read_text().splitlines()
        for column in set(rows[1][0]) - CLOCK - {"residual", "correction", "energy_residual"}:
            self.close([r[column] for r in rows[1]], [r[column] for r in rows[3]], column, 1e-9)
        self.close(probes[1], probes[3], "probe", 1e-9)
        for key, values in fields[1].items():
            self.close(values, fields[3][key], key, 1e-9)
        self.assertEqual([line[:7] for line in logs[1]], [line[:7] for line in logs[3]])

    def test_connectors(self):
        """Springs, bars, masses and follower loads are no elements: one process has them in its part of the matrix."""
        text = STRIP.format(16) + """&node name = 'n' position = 10.0, 0.5, 4.0 /
&point_mass name = 'm' node_set = 'n' mass = 0.1 /
&spring name = 's' type = 'line' node_set = 'n' to = 'corner_x1_y0' stiffness = 0.1 /
&spring name = 'g' type = 'axes' node_set = 'n' stiffness = 0.1 /
&spring name = 't' type = 'rotation' node_set = 'corner_x1_y1' to = 'corner_x1_y0' stiffness = 0.1 /
&load type = 'follower_line' edge_set = 'edge_x1' normal = 2e-5 in_plane = 1e-3 /
&load type = 'gravity' vector = 0, 0, -1e-3 /
&monitor name = 'f' quantity = 'connector_force' connector = 's' /
&step load_factor = 0.4 tolerance = 'tight' /
"""
        rows = {}
        for processes in (1, 3):
            run = self.solve_text(text, processes)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            rows[processes] = rows_of(self.folder)
        for column in ("load_factor", "w", "f"):
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

    def test_what_is_for_one_process(self):
        """Refused before it starts, with a sentence that says what to take; what is no work to share is done once."""
        source = EXAMPLES / "user_laws/laws.c"
        subprocess.run([os.environ.get("CC", "cc"), "-O1", "-fPIC", "-shared", f"-I{EXAMPLES.parent / 'api'}", str(source), "-o", "liblaws.so", "-lm"], cwd=self.folder,
                       check=True)
        for text, arguments, words in (
                (STRIP, ("--set", "section.thickness=0.1,0.2"), "several runs are processes of their own: take finshell, not finshell_mpi"),
                (STRIP.replace("&load", "&node name = 'hub' position = 11.0, 0.5, 0.0 /\n&rigid_body node_set = 'edge_x1' reference = 'hub' /\n&load"), (),
                 "joints (&tie, &equal, &equation, &rigid_body) run on one process only: take finshell instead of finshell_mpi"),
                (STRIP + "&step control = 'dynamic' duration = 1.0 /\n", (), "in.nml:9: &step: steps in time run in one process: take finshell, not finshell_mpi"),
                (STRIP + "&step duration = 1.0 /\n", (), "in.nml:9: &step: steps in time run in one process: take finshell, not finshell_mpi"),
                (STRIP.replace("law = 'linear_elastic' e = 1000.0 nu = 0.0", "library = 'liblaws.so' law = 'prony' e = 1000.0 g = 0.5 tau = 1.0"), (),
                 "in.nml: &material: laws with states run in one process: take finshell, not finshell_mpi"),
                (STRIP.replace("&step control = 'linear' load_factor = 0.2 /", "&accuracy target = 0.1 /"), (),
                 "&accuracy: meshes are refined in one process: take finshell, not finshell_mpi")):
            run = self.solve_text(text.format(8), 2, *arguments)
            self.assertEqual(run.returncode, 2, run.stdout + run.stderr)
            self.assertEqual(run.stderr.count(words), 1, run.stderr)
        self.assertEqual(self.solve_text(STRIP.format(8), 2, "--set", "section.thickness=0.2").returncode, 0)
        for *command, words, code in (("study", "in.nml", "a study runs its meshes as processes of their own: take finshell, not finshell_mpi", 2),
                                      ("restart", "in", "a run goes on in one process: take finshell, not finshell_mpi", 2),
                                      ("info", "in", "It ended so: done", 0), ("mesh", "in.nml", "18 nodes, 16 triangles", 0)):
            run = subprocess.run([*self.start(2), *command], cwd=self.folder, capture_output=True, text=True, check=False, timeout=300)
            self.assertEqual(run.returncode, code, run.stdout + run.stderr)
            self.assertEqual((run.stdout + run.stderr).count(words), 1, run.stdout + run.stderr)

    def test_interrupt(self):
        """The process that speaks is asked to stop: all stop after the same increment, and one process goes on."""
        text = STRIP.format(400).replace("load_factor = 0.1", "load_factor = 0.1 first_increment = 0.0005 automatic = .false.")
        (self.folder / "in.nml").write_text(text)
        run = subprocess.Popen([*self.start(2), "run", "-q", "in.nml"], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                               env={**os.environ, "OMP_NUM_THREADS": "1"})
        history = self.folder / "in.history.csv"
        while run.poll() is None and not (history.exists() and len(history.read_text().splitlines()) > 3):
            time.sleep(0.01)
        os.kill(int((self.folder / "in.lock").read_text()), signal.SIGTERM)
        out, err = run.communicate(timeout=300)
        self.assertEqual(run.returncode, 3, out + err)
        self.assertEqual(err.count("finshell: interrupted: finshell restart in goes on from here"), 1, out + err)
        done = subprocess.run([PROGRAM, "restart", "in", "-q"], cwd=self.folder, capture_output=True, text=True, check=False, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_one_process_fails(self):
        """A process that cannot read its input ends all of them, with its sentence."""
        (self.folder / "in.nml").write_text(STRIP.format(16))
        (self.folder / "empty").mkdir()
        command = self.start(1)
        run = subprocess.run([*command, "run", "in.nml", ":", "-n", "1", "--wdir", str(self.folder / "empty"), PARALLEL, "run", "in.nml"],
                             cwd=self.folder, capture_output=True, text=True, check=False, timeout=300)
        self.assertEqual(run.returncode, 2, run.stdout + run.stderr)
        self.assertEqual(run.stderr.count("finshell: cannot open the file 'in.nml'"), 1, run.stderr)

    def test_help(self):
        run = subprocess.run([*self.start(2), "--version"], capture_output=True, text=True, check=True, timeout=300)
        self.assertEqual(run.stdout.count("finshell"), 1)


if __name__ == "__main__":
    if not PARALLEL or not shutil.which("mpirun"):
        print("finshell_mpi is not built")
        sys.exit(77)
    unittest.main()
