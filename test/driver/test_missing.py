#!/usr/bin/env python3
"""What cannot be recovered is a missing value: a strip bent until the law has ended at its surfaces, not at the integration points."""
import csv
import math
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

try:
    import h5py
    import numpy as np
except ImportError:
    print("h5py is not installed")
    sys.exit(77)

# law, and a rotation of the end at which it still holds at the integration points
GENT = {"law": "law = 'gent' mu = 200.0 jm = 0.6", "turn": -2.25}
LAWS = (GENT, {"law": "law = 'st_venant_kirchhoff' e = 1000.0 nu = 0.45", "turn": -2.05})
STRIP = """&mesh generator = 'rectangle' lengths = 2.0, 0.5 divisions = 4, 1 /
&material name = 'm' {law} /
&section material = 'm' thickness = 1.0 /
&support node_set = 'edge_x0' type = 'clamped' /
&support node_set = 'edge_x1' fixed = 'rx', 'rz' ry = {turn} /
&step tolerance = 'tight' /
&monitor name = 'M' quantity = 'reaction_moment' component = 'y' node_set = 'edge_x1' /
&monitor name = 'm11' quantity = 'moment' component = '11' /
&monitor name = 'l' quantity = 'thickness_stretch' node_set = 'edge_x1' /
"""


class Missing(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def solve(self, text):
        """History rows, element fields of the last step, what was printed; the run must be done."""
        (self.folder / "strip.nml").write_text(text)
        run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "strip.nml"], cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        with open(self.folder / "strip.history.csv", encoding="utf-8") as file:
            rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
        with h5py.File(self.folder / "strip.vtkhdf") as file:
            n = len(file["VTKHDF/Types"])
            fields = {name: np.asarray(data)[-n:] for name, data in file["VTKHDF/CellData"].items()}
        return rows, fields, run.stdout

    def test_a_converged_run_is_done(self):
        for law in LAWS:
            rows, fields, printed = self.solve(STRIP.format(**law))
            self.assertEqual(rows[-1]["load_factor"], 1)
            self.assertTrue(all(math.isfinite(value) for row in rows for value in row.values()))
            self.assertEqual(list(fields), ["thickness_stretch"])
            self.assertTrue(np.isfinite(fields["thickness_stretch"]).all())
            self.assertNotIn("Missing", printed)

    def test_missing_stresses_are_nan_and_counted(self):
        fields = "'stress', 'moment', 'membrane_force'"
        for law in LAWS:
            rows, last, printed = self.solve(STRIP.format(**law) + f"&output fields = {fields} every = 1000 /\n")
            self.assertEqual(rows[-1]["load_factor"], 1)
            for name in ("stress_middle", "moment", "membrane_force"):
                self.assertTrue(np.isfinite(last[name]).all())
            gaps = 0
            for name in ("stress_bottom", "stress_top"):
                missing = np.isnan(last[name])
                self.assertTrue((missing.all(axis=1) == missing.any(axis=1)).all())
                gaps += missing.any(axis=1).sum()
                if missing.any():
                    self.assertIn(f"Missing in {name}: {missing.any(axis=1).sum()} values", printed)
                else:
                    self.assertNotIn(name, printed)
            self.assertGreater(gaps, 0)

    def test_readers_take_missing_values(self):
        try:
            from vtkmodules.util.numpy_support import vtk_to_numpy
            from vtkmodules.vtkIOHDF import vtkHDFReader
        except ImportError:
            self.skipTest("vtk is not installed")
        rows, last, _ = self.solve(STRIP.format(**GENT) + "&output fields = 'stress' every = 1000 /\n")
        reader = vtkHDFReader()
        reader.SetFileName(str(self.folder / "strip.vtkhdf"))
        reader.UpdateInformation()
        reader.UpdateTimeStep(rows[-1]["increment"])
        data = reader.GetOutput().GetCellData()
        for name, values in last.items():
            array = data.GetArray(name)
            np.testing.assert_array_equal(vtk_to_numpy(array), values)
            # VTK leaves NaN out of the ranges by which it colours
            if np.isfinite(values).any():
                self.assertEqual(array.GetFiniteRange(0), (np.nanmin(values[:, 0]), np.nanmax(values[:, 0])))
        self.assertTrue(any(np.isnan(values).any() for values in last.values()))

    def test_a_change_about_such_a_state(self):
        # a linear step differentiates what can be recovered, and leaves out the rest
        rows, last, printed = self.solve(STRIP.format(**GENT)
                                         + "&step control = 'linear' load_factor = 1.01 /\n&output fields = 'stress', 'moment' /\n")
        self.assertEqual(rows[-1]["load_factor"], 1.01)
        self.assertTrue(np.isfinite(last["moment"]).all())
        self.assertTrue(np.isfinite(last["stress_middle"]).all())
        self.assertTrue(np.isnan(np.vstack([last["stress_top"], last["stress_bottom"]])).any())
        self.assertIn("Missing in stress_", printed)


if __name__ == "__main__":
    unittest.main()
