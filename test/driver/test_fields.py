#!/usr/bin/env python3
"""Result fields of a sheet pulled to twice its length: stress, resultants and thickness against the closed form."""
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

INPUT = """&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 3, 2 diagonal = 'cross' /
&material name = 'rubber' law = 'neo_hookean' mu = 3.0 /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'edge_x0' fixed = 'ux', 'rx', 'ry', 'rz' /
&support node_set = 'edge_x1' ux = 2.0 rz = 0.0 /
&support node_set = 'edge_y0' fixed = 'uy' /
&support node_set = 'all' fixed = 'uz', 'rx', 'ry' /
&step load_factor = 1.0 tolerance = 'tight' /
&output fields = 'thickness_stretch', 'membrane_force', 'moment', 'stress', 'rotation', 'reaction' /
"""


BENT = """&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 6, 3 /
&material name = 'steel' law = 'st_venant_kirchhoff' e = 1.0e6 nu = 0.3 /
&section material = 'steel' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_x1' vector = 0.3, 0.1, 0.02 /
&step load_factor = 1.0 tolerance = 'tight' /
&output fields = 'membrane_force', 'moment', 'stress', 'reaction' /
"""


class Fields(unittest.TestCase):
    def solve(self, text):
        """Last step of all fields of the result file."""
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "sheet.nml").write_text(text)
            run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "sheet.nml"], cwd=folder, capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            with h5py.File(Path(folder) / "sheet.vtkhdf") as file:
                n = len(file["VTKHDF/Types"])
                last = {name: np.asarray(data)[-n:] for name, data in file["VTKHDF/CellData"].items()}
                last["reaction"] = np.asarray(file["VTKHDF/PointData/reaction"])[-len(file["VTKHDF/Points"]):]
        return n, last

    def test_uniaxial_stretch(self):
        n, last = self.solve(INPUT)
        stretch = 2.0
        cauchy = 3.0 * (stretch**2 - 1 / stretch)
        for height in ("bottom", "middle", "top"):
            np.testing.assert_allclose(last["stress_" + height], np.tile([cauchy, 0, 0], (n, 1)), atol=1e-6)
        np.testing.assert_allclose(last["thickness_stretch"].ravel(), stretch**-0.5, rtol=1e-7)
        # second Piola-Kirchhoff stress times the reference thickness
        np.testing.assert_allclose(last["membrane_force"], np.tile([0.1 * cauchy / stretch**2, 0, 0], (n, 1)), atol=1e-7)
        np.testing.assert_allclose(last["moment"], 0, atol=1e-7)
        self.assertAlmostEqual(last["reaction"][last["reaction"][:, 0] > 0, 0].sum(), 0.1 * cauchy / stretch, places=6)

    def test_stress_of_a_bent_plate_belongs_to_its_element_and_height(self):
        _, last = self.solve(BENT)
        h, force, moment = 0.1, last["membrane_force"], last["moment"]
        scale = np.abs(6 * moment / h**2).max()
        for height, sign in (("bottom", -1), ("middle", 0), ("top", 1)):
            np.testing.assert_allclose(last["stress_" + height], force / h + sign * 6 * moment / h**2, atol=1e-3 * scale)
        self.assertGreater(np.abs(force / h).max(), 0.01 * scale)


if __name__ == "__main__":
    unittest.main()
