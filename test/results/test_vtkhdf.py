#!/usr/bin/env python3
"""Result files as other programs see them: HDF5 (h5py), VTKHDF and XDMF (vtk), PyVista, CSV.

Usage: test_vtkhdf.py [WRITE_RESULTS]
The program test/results/write_results.f90; by default FINSHELL_BINARY_DIR/test/bin/write_results of the environment.

Writes known values, then checks steps, points, cells and every field with each reader; a killed run must leave a
readable file that a second run continues; what cannot be written must end in a message that names the file.
"""
import csv
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import h5py
import numpy as np
import pyvista
import vtk
from vtk.util.numpy_support import vtk_to_numpy

WRITER = None
CELLS = 16  # the fields are large enough to be compressed
NODES = (CELLS + 1) ** 2
ELEMENTS = 2 * CELLS**2


def coordinates():
    x = np.zeros((NODES, 3))
    x[:, 0] = np.tile(np.arange(CELLS + 1), CELLS + 1) / CELLS
    x[:, 1] = np.repeat(np.arange(CELLS + 1), CELLS + 1) / CELLS
    return x


def expected(step):
    """The fields that write_results writes at a step: point fields, cell fields."""
    x = coordinates()
    u = step * np.column_stack([x[:, 0], x[:, 1], 1 + x[:, 0] * x[:, 1]])
    elements = np.arange(1, ELEMENTS + 1)
    points = {"displacement": u, "rotation": 2 * u, "temperature": np.arange(1, NODES + 1) + 1000.0 * step}
    force = np.column_stack([np.full(ELEMENTS, float(step)), elements, np.full(ELEMENTS, -1.0)])
    return points, {"thickness_stretch": elements + 0.5 * step, "membrane_force": force}


def write(file, steps, mode="close", cells=CELLS, storage=(), **options):
    return subprocess.run([WRITER, file, str(cells), str(steps), mode, *storage], capture_output=True, text=True, **options)


class Results(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.file = str(Path(self.folder.name, "square.vtkhdf"))

    def written(self, steps, mode="close", storage=(), last=None):
        if last is not None:
            storage = (*(storage or ("1", "double")), str(last))
        run = write(self.file, steps, mode, storage=storage)
        self.assertEqual(run.stderr, "")
        self.assertEqual(run.returncode, -signal.SIGKILL if mode == "kill" else 0)

    def check_grid(self, grid, step):
        """A vtkUnstructuredGrid holds the mesh, all fields and nothing else."""
        np.testing.assert_array_equal(vtk_to_numpy(grid.GetPoints().GetData()), coordinates())
        self.assertEqual(grid.GetNumberOfCells(), ELEMENTS)
        self.assertEqual({grid.GetCellType(i) for i in range(ELEMENTS)}, {vtk.VTK_TRIANGLE})
        corners = [[grid.GetCell(i).GetPointId(j) for j in range(3)] for i in (0, 1)]
        self.assertEqual(corners, [[0, 1, CELLS + 2], [0, CELLS + 2, CELLS + 1]])
        for data, fields in zip((grid.GetPointData(), grid.GetCellData()), expected(step)):
            self.assertEqual({data.GetArrayName(i) for i in range(data.GetNumberOfArrays())}, set(fields))
            for name, values in fields.items():
                np.testing.assert_array_equal(vtk_to_numpy(data.GetArray(name)), values, err_msg=f"{name} at step {step}")

    def check_vtkhdf(self, steps):
        reader = vtk.vtkHDFReader()
        reader.SetFileName(self.file)
        reader.UpdateInformation()
        self.assertEqual(reader.GetNumberOfSteps(), steps)
        for step in range(steps):
            reader.UpdateTimeStep(float(step))
            grid = reader.GetOutput()
            self.check_grid(grid, step)
            factor = vtk_to_numpy(grid.GetFieldData().GetArray("load_factor"))
            np.testing.assert_array_equal(factor, [np.sin(0.3 * step)])

    def check_xdmf(self, steps):
        reader = vtk.vtkXdmfReader()
        reader.SetFileName(self.file.replace(".vtkhdf", ".xdmf"))
        reader.UpdateInformation()
        times = reader.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
        self.assertEqual(list(times or ()), [float(i) for i in range(steps)])
        for step in range(steps):
            reader.UpdateTimeStep(float(step))
            grid = reader.GetOutputDataObject(0)
            while hasattr(grid, "GetBlock"):
                grid = grid.GetBlock(0)
            self.check_grid(grid, step)

    def check_own_group(self, steps, restarted_at=None):
        with h5py.File(self.file) as file:
            self.assertEqual(file["VTKHDF"].attrs["Type"], b"UnstructuredGrid")
            self.assertEqual(file["VTKHDF"].attrs.get_id("Type").get_type().get_size(), len("UnstructuredGrid"))
            self.assertEqual(file["VTKHDF/Types"].dtype, np.uint8)
            own = file["finshell"]
            self.assertEqual(own["input"][()].decode("utf-8").rstrip(" "), '&job name = "square" /\n! größer\n')
            self.assertEqual(own.attrs["version"], b"0.0.0")
            history = own["history"]
            np.testing.assert_array_equal(history["increment"], range(steps))
            np.testing.assert_array_equal(history["iterations"], np.arange(3, 3 + steps))
            np.testing.assert_array_equal(history["negative_pivots"], np.zeros(steps))
            np.testing.assert_array_equal(history["load_factor"], np.sin(0.3 * np.arange(steps)))
            np.testing.assert_array_equal(history["w"], 0.1 * np.arange(steps))
            np.testing.assert_array_equal(history['p, in "psi"'], 1 / (1.0 + np.arange(steps)))
            self.assertEqual([line.decode().rstrip() for line in own["log"][:]], ["increment converged"] * steps)

    def check_history(self, steps):
        with open(self.file + ".history.csv", newline="") as file:
            rows = list(csv.reader(file))
        self.assertEqual(rows[0], ["increment", "load_factor", "iterations", "negative_pivots", "w", 'p, in "psi"', "critical_point", "residual", "correction", "snap", "found_by", "stabilisation"])
        found = np.array(rows[1:], dtype=float)
        i = np.arange(steps)
        np.testing.assert_array_equal(found, np.column_stack([i, np.sin(0.3 * i), 3 + i, 0 * i, 0.1 * i, 1 / (1.0 + i), 0 * i, 0 * i, 0 * i, 0 * i, 0 * i, 0 * i]))

    def check_all(self, steps):
        self.check_vtkhdf(steps)
        self.check_xdmf(steps)
        self.check_own_group(steps)
        self.check_history(steps)

    def check_pieces(self, file, steps):
        for dataset in (*file["VTKHDF/PointData"].values(), *file["VTKHDF/CellData"].values()):
            self.assertEqual(dataset.chunks[0], dataset.shape[0] // steps, f"{dataset.name}: a step is one chunk")

    def test_all_readers(self):
        self.written(4)
        self.check_all(4)

    def test_storage(self):
        """What is compressed or in single precision (which holds all values here) is read as ever; restarts change storage."""
        sizes = {}
        for storage in (("0", "double"), ("1", "double"), ("9", "double"), ("0", "single"), ("1", "single")):
            with self.subTest(storage=storage):
                self.written(4, "kill", storage)
                self.check_all(4)
                sizes[storage] = os.path.getsize(self.file)
                with h5py.File(self.file) as file:
                    for dataset in (*file["VTKHDF/PointData"].values(), *file["VTKHDF/CellData"].values()):
                        self.assertEqual(dataset.dtype, np.float32 if "single" in storage else np.float64, dataset.name)
                        self.assertEqual(dataset.compression_opts or 0, int(storage[0]), dataset.name)
                    self.check_pieces(file, 4)
                    for path in ("VTKHDF/Points", "finshell/history/load_factor", "finshell/history/w"):
                        self.assertEqual(file[path].dtype, np.float64)
                self.written(1, "restart", ("1", "single"), last=3)
                self.check_all(5)
        self.assertLess(sizes["1", "double"], 0.7 * sizes["0", "double"])
        self.assertLess(sizes["0", "single"], 0.9 * sizes["0", "double"])
        self.assertLess(sizes["1", "single"], 0.8 * sizes["0", "single"])

    def test_many_triangles(self):
        """A million triangles: a step is one piece of the file, whatever its size, so that opening it takes a few times what reading its numbers does (CPU time)."""
        run = write(self.file, 2, cells=707)
        self.assertEqual((run.returncode, run.stderr), (0, ""))
        start = time.process_time()
        reader = vtk.vtkHDFReader()
        reader.SetFileName(self.file)
        reader.UpdateInformation()
        reader.UpdateTimeStep(1.0)
        opening = time.process_time() - start
        force = vtk_to_numpy(reader.GetOutput().GetCellData().GetArray("membrane_force"))
        np.testing.assert_array_equal(force[:, 1], np.arange(1, 2 * 707**2 + 1))
        with h5py.File(self.file) as file:
            self.check_pieces(file, 2)
            start = time.process_time()
            for dataset in (*file["VTKHDF/PointData"].values(), *file["VTKHDF/CellData"].values()):
                dataset[: dataset.shape[0] // 2]
            reading = time.process_time() - start
        self.assertLess(opening, 10 * reading)
        self.assertLess(os.path.getsize(self.file), 60e6, "197 MB without compression")

    def test_what_single_precision_cannot_hold(self):
        self.assert_refused(write(self.file, 1, storage=("1", "large")), "rotation", "3.5", "precision = 'double' is expected")
        self.written(2)
        self.check_all(2)

    def test_pyvista(self):
        self.written(3)
        grid = pyvista.read(self.file)
        self.assertIsInstance(grid, pyvista.UnstructuredGrid)
        np.testing.assert_array_equal(grid.points, coordinates())
        self.assertIn("displacement", grid.point_data)
        warped = grid.warp_by_vector("displacement")
        np.testing.assert_array_equal(warped.points, coordinates() + grid.point_data["displacement"])

    def test_a_file_is_replaced(self):
        self.written(5)
        self.written(2)
        self.check_all(2)

    def test_every_xdmf_reference_exists(self):
        self.written(3)
        tree = ElementTree.parse(self.file.replace(".vtkhdf", ".xdmf"))
        items = [item for item in tree.iter("DataItem") if item.get("Format") == "HDF"]
        self.assertEqual(len(items), 3 * (2 + 5))
        for item in items:
            name, path = item.text.split(":")
            self.assertEqual(name, "square.vtkhdf")
            with h5py.File(Path(self.folder.name, name)) as file:
                shape = [int(n) for n in item.get("Dimensions").split()]
                self.assertLessEqual(np.prod(shape), file[path].size, path)

    def test_a_killed_run_is_readable(self):
        self.written(3, "kill")
        self.check_all(3)

    def test_a_killed_run_is_continued(self):
        self.written(3, "kill")
        self.written(2, "restart", last=2)
        self.check_all(5)
        self.written(1, "restart", last=1)  # further back
        self.check_vtkhdf(3)
        self.check_history(3)

    def test_killed_at_any_moment(self):
        """Killed from outside at random moments: whatever is left can be read, and continued."""
        random.seed(1)
        steps_found = []
        for _ in range(20):
            for name in Path(self.folder.name).iterdir():
                name.unlink()
            run = subprocess.Popen([WRITER, self.file, str(CELLS), "60"], stderr=subprocess.PIPE)
            while not (Path(self.file + ".history.csv").exists() or run.poll() is not None):
                time.sleep(0.001)
            time.sleep(random.uniform(0.002, 0.03))
            run.kill()
            run.communicate()
            with h5py.File(self.file) as file:
                steps = int(file["VTKHDF/Steps"].attrs["NSteps"])
                values = file["VTKHDF/PointData/temperature"][: steps * NODES].reshape(steps, NODES)
                np.testing.assert_array_equal(values, np.array([expected(k)[0]["temperature"] for k in range(steps)]).reshape(values.shape))
            steps_found.append(steps)
            if steps > 0:
                self.written(1, "restart", last=steps - 1)
                with h5py.File(self.file) as file:
                    self.assertEqual(file["VTKHDF/Steps"].attrs["NSteps"], steps + 1)
                with open(self.file + ".history.csv") as file:
                    self.assertEqual([int(row.split(",")[0]) for row in file.readlines()[1:]][-1], steps)
        self.assertGreater(max(steps_found), 1, "no run was killed while it was writing")

    def test_killed_while_an_index_splits(self):
        """HDF5 splits the index of a dataset at step 65 in several writes: killed at each of them, no step is lost."""
        shim = str(Path(self.folder.name, "kill_at.so"))
        subprocess.run([os.environ.get("FINSHELL_CC", "cc"), "-shared", "-fPIC", "-o", shim, Path(__file__).with_name("kill_at.c"), "-ldl"], check=True)

        def run(kill_at):
            return write(self.file, 65, env={**os.environ, "LD_PRELOAD": shim, "KILL_AT": str(kill_at)})

        writes = int(run(0).stderr.strip())
        self.assertGreater(writes, 65 * 30)
        for kill_at in range(writes - 46, writes + 1, 2):
            self.assertEqual(run(kill_at).returncode, -signal.SIGKILL)
            with h5py.File(self.file) as file:
                steps = int(file["VTKHDF/Steps"].attrs["NSteps"])
                self.assertIn(steps, (64, 65))
                for group, items in (("PointData", NODES), ("CellData", ELEMENTS)):
                    for values in file["VTKHDF"][group].values():
                        self.assertEqual(len(values[: steps * items]), steps * items)
                values = file["VTKHDF/PointData/temperature"][: steps * NODES].reshape(steps, NODES)
                np.testing.assert_array_equal(values, [expected(k)[0]["temperature"] for k in range(steps)])

    def assert_refused(self, run, *texts):
        self.assertEqual(run.returncode, 3, run.stderr)
        for text in texts:
            self.assertIn(text, run.stderr)
        self.assertEqual(len(run.stderr.strip().splitlines()), 1, "one sentence, and nothing printed by HDF5: " + run.stderr)

    def test_no_such_folder(self):
        file = str(Path(self.folder.name, "missing", "square.vtkhdf"))
        self.assert_refused(write(file, 1), file, "cannot create", "No such file or directory")

    def test_file_not_writable(self):
        folder = Path(self.folder.name, "square.vtkhdf")
        folder.mkdir()
        self.assert_refused(write(str(folder), 1), str(folder), "cannot create", "directory")

    @unittest.skipIf(os.geteuid() == 0, "root may write everywhere")
    def test_read_only_file(self):
        Path(self.file).touch()
        os.chmod(self.file, 0o444)
        self.assert_refused(write(self.file, 1), self.file, "Permission denied")

    def test_disk_full(self):
        """A limit on the size of a file acts like a full disk."""

        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))

        run = write(self.file, 1000, preexec_fn=limit)
        self.assert_refused(run, self.file, "cannot write", "ulimit -f")
        with h5py.File(self.file) as file:
            self.assertIn("VTKHDF", file)

    def test_restart_needs_a_result_file(self):
        Path(self.file).write_text("not a result file")
        self.assert_refused(write(self.file, 1, "restart"), self.file, "not an HDF5 file")

    def test_restart_needs_the_same_mesh(self):
        self.written(2)
        self.assert_refused(write(self.file, 1, "restart", cells=CELLS + 1), self.file, "another mesh")


if __name__ == "__main__":
    if len(sys.argv) > 1 and not sys.argv[1].startswith(("-", "Results")):
        WRITER = os.path.abspath(sys.argv.pop(1))
    else:
        WRITER = os.path.join(os.environ.get("FINSHELL_BINARY_DIR", "build"), "test", "bin", "write_results")
    if not os.access(WRITER, os.X_OK):
        sys.exit(f"{WRITER}: no such program\n\n{__doc__}")
    unittest.main()
