#!/usr/bin/env python3
"""Result fields and monitors of a sheet pulled to twice its length, of bent strips, laminates and linear steps, against closed forms."""
import csv
import math
import os
import re
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


# a strip bent to a part of a circle; nu = 0
ARC = """&mesh generator = 'rectangle' lengths = 2.0, 0.2 divisions = 20, 1 /
&material name = 'steel' law = 'st_venant_kirchhoff' e = 1.0e6 nu = 0.0 /
&section thickness = 0.02 offset = 0.004 /
&support node_set = 'edge_x0' type = 'clamped' /
&support node_set = 'all' fixed = 'rx', 'rz' /
&load type = 'moment' node_set = 'edge_x1' vector = 0.0, {moment}, 0.0 total = T /
"""

# two layers of fibres and one without, a sheet pulled along x
LAMINATE = """&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 3, 2 diagonal = 'cross' /
&material name = 'tissue' law = 'holzapfel_gasser_ogden' c = 200.0 k1 = 300.0 k2 = 0.5 angle = 30.0 /
&material name = 'gel' law = 'neo_hookean' mu = 100.0 /
&section material = 'tissue', 'gel', 'tissue' thickness = 0.1, 0.2, 0.1 angle = 15.0, 0.0, -15.0 /
&support node_set = 'edge_x0' fixed = 'ux', 'rx', 'ry', 'rz' /
&support node_set = 'edge_x1' ux = 0.4 rz = 0.0 /
&support node_set = 'all' fixed = 'uy', 'uz', 'rx', 'ry', 'rz' /
&step load_factor = 1.0 tolerance = 'tight' /
"""

TENSORS = "'strain', 'curvature', 'principal_stretch', 'principal_direction_1', 'principal_direction_2', 'principal_stress', 'energy_density'"
ALL = TENSORS + ", 'fibre_stretch', 'fibre_direction_1', 'fibre_direction_2', 'material_stress', 'stress', 'reaction_moment'"


class Fields(unittest.TestCase):
    def table(self, text):
        """Last row of the history, and what was printed."""
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "sheet.nml").write_text(text)
            run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "sheet.nml"], cwd=folder, capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            with open(Path(folder) / "sheet.history.csv", encoding="utf-8") as file:
                rows = list(csv.DictReader(file))
        return {key: float(value) for key, value in rows[-1].items()}, run.stdout

    def solve(self, text):
        """Last step of all fields of the result file."""
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "sheet.nml").write_text(text)
            run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "sheet.nml"], cwd=folder, capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            with h5py.File(Path(folder) / "sheet.vtkhdf") as file:
                n = len(file["VTKHDF/Types"])
                last = {name: np.asarray(data)[-n:] for name, data in file["VTKHDF/CellData"].items()}
                if "reaction" in file["VTKHDF/PointData"]:
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

    def test_new_fields_of_a_uniaxial_stretch(self):
        n, last = self.solve(INPUT.replace("'stress',", ALL + ","))
        stretch, cauchy = 2.0, 3.0 * (2.0**2 - 0.5)
        for height in ("bottom", "middle", "top"):
            np.testing.assert_allclose(last["strain_" + height], np.tile([1.5, 0.5 * (1 / stretch - 1), 0], (n, 1)), atol=1e-6)
            np.testing.assert_allclose(last["principal_stretch_" + height], np.tile([stretch, stretch**-0.5], (n, 1)), atol=1e-6)
            np.testing.assert_allclose(last["principal_stress_" + height], np.tile([cauchy, 0], (n, 1)), atol=1e-6)
            np.testing.assert_allclose(last["principal_direction_1_" + height], np.tile([1, 0, 0], (n, 1)), atol=1e-6)
            np.testing.assert_allclose(last["principal_direction_2_" + height], np.tile([0, 1, 0], (n, 1)), atol=1e-6)
        np.testing.assert_allclose(last["curvature"], 0, atol=1e-6)
        np.testing.assert_allclose(last["material_stress_layer1"], last["stress_middle"], atol=1e-9)
        np.testing.assert_allclose(last["energy_density"].ravel(), 1.5 * (stretch**2 + 2 / stretch - 3), rtol=1e-6)
        # a law without fibres
        self.assertTrue(np.isnan(last["fibre_stretch_layer1"]).all() and np.isnan(last["fibre_direction_1_layer1"]).all())

    def test_nothing_more_is_written_than_asked_for(self):
        _, last = self.solve(INPUT.replace("'thickness_stretch', 'membrane_force', 'moment', 'stress', 'rotation',", "'principal_stress',"))
        self.assertEqual(set(last) - {"reaction"}, {f"principal_stress_{height}" for height in ("bottom", "middle", "top")})

    def test_curvature_and_strains_of_an_arc(self):
        # E I per width, about the surface of the nodes the moment of the membrane force is nothing, so the strain vanishes in the middle
        curvature, h = 1.1, 0.02
        moment = 1.0e6 * h**3 / 12 * 0.2 * curvature
        text = ARC.format(moment=-moment) + "&output fields = " + TENSORS + ", 'stress' /\n&monitor name = 'energy' quantity = 'energy' /\n"
        n, linear = self.solve(text + "&step control = 'linear' /\n")
        np.testing.assert_allclose(linear["curvature"], np.tile([-curvature, 0, 0], (n, 1)), atol=1e-5 * curvature)
        for height, z in (("bottom", -h / 2), ("middle", 0), ("top", h / 2)):
            np.testing.assert_allclose(linear["strain_" + height], np.tile([-z * curvature, 0, 0], (n, 1)), atol=1e-5 * h * curvature)
            # principal values of what U is to first order
            np.testing.assert_allclose(linear["principal_stretch_" + height],
                                       np.tile([1 + max(-z, 0) * curvature, 1 + min(-z, 0) * curvature], (n, 1)), atol=1e-5 * h * curvature)
            np.testing.assert_allclose(linear["principal_stress_" + height], np.tile([1.0e6 * max(-z, 0) * curvature, 1.0e6 * min(-z, 0) * curvature],
                                                                                     (n, 1)), atol=10 * h * curvature)
        for height, along, across in (("bottom", 0, 1), ("top", 1, 0)):
            np.testing.assert_allclose(np.abs(linear["principal_direction_1_" + height][:, [along, across]]), np.tile([1, 0], (n, 1)), atol=1e-4)
        density = 1.0e6 * h**2 / 12 * curvature**2 / 2
        np.testing.assert_allclose(linear["energy_density"].ravel(), density, rtol=1e-4)
        n, last = self.solve(text + "&step tolerance = 'tight' /\n")
        # second Piola-Kirchhoff stress in the middle bends more than the ends of the interval tell: to first order in the strain
        np.testing.assert_allclose(last["curvature"], np.tile([-curvature, 0, 0], (n, 1)), atol=0.02 * curvature)
        np.testing.assert_allclose(last["energy_density"].ravel(), density, rtol=0.02)
        # directions lie in the deformed strip: the tangent of the arc
        x = (np.arange(20) + 0.5) * 0.1
        for direction in last["principal_direction_1_bottom"]:
            angle = math.atan2(abs(direction[2]), direction[0])
            self.assertLess(np.abs(angle - curvature * x).min(), 0.06)
            self.assertAlmostEqual(np.linalg.norm(direction), 1, places=12)
        self.assertGreater(np.abs(last["principal_direction_1_bottom"][:, 2]).max(), 0.9)

    def test_fields_of_a_mode(self):
        # of the change alone; a mode has no sign, nor has a principal value of it one
        n, mode = self.solve(ARC.format(moment=0).split("&load")[0] + "&load type = 'line' edge_set = 'edge_x1' vector = -1.0, 0.0, 0.0 /\n"
                             "&step control = 'buckling' modes = 1 /\n&output fields = " + TENSORS + ", 'stress' /\n")
        self.assertGreater(np.abs(mode["strain_top"][:, 0]).max(), 1e-4)
        for height in ("bottom", "middle", "top"):
            for tensor, principal in ((mode["strain_" + height], mode["principal_stretch_" + height]),
                                      (mode["stress_" + height], mode["principal_stress_" + height])):
                matrices = tensor[:, [0, 2, 2, 1]].reshape(n, 2, 2)
                np.testing.assert_allclose(principal, np.linalg.eigvalsh(matrices)[:, ::-1], atol=1e-5 * np.abs(tensor).max() + 1e-9)
        np.testing.assert_allclose(np.abs(mode["curvature"][:, 0] * 0.01), np.abs(mode["strain_top"][:, 0] - mode["strain_middle"][:, 0]), atol=1e-9)
        for axis in ("1", "2"):
            np.testing.assert_allclose(np.linalg.norm(mode[f"principal_direction_{axis}_top"], axis=1), 1, rtol=1e-12)
        # half of stress times strain through the thickness
        bent = 1.0e6 * (mode["curvature"][:, 0] * 0.02)**2 / 24
        np.testing.assert_allclose(mode["energy_density"].ravel(), bent, rtol=0.02, atol=0.02 * bent.max())

    def test_energy_density_adds_up_to_the_energy(self):
        for text in (BENT.split("&output")[0], ARC.format(moment=-0.1) + "&step /\n", ARC.format(moment=-0.1) + "&step control = 'linear' /\n",
                     BENT.split("&output")[0] + "&step control = 'linear' load_factor = 1.5 /\n"):
            area, thickness = (2.0, 0.1) if "6, 3" in text else (0.4, 0.02)
            text += "&monitor name = 'energy' quantity = 'energy' /\n&monitor name = 'mean' quantity = 'energy_density' /\n"
            row, _ = self.table(text)
            _, last = self.solve(text + "&output fields = 'energy_density' /\n")
            self.assertGreater(row["energy"], 0)
            # all elements of a regular mesh have one area
            self.assertAlmostEqual(last["energy_density"].mean() * area * thickness / row["energy"], 1, delta=1e-4 if "linear" in text else 1e-12)
            self.assertAlmostEqual(row["mean"] / last["energy_density"].mean(), 1, delta=1e-12)

    def test_energy_density_of_curved_elements(self):
        # reference volume of the curved surface: a part of a cylinder whose elements are all alike; that of facets is 0.16 % less
        row, _ = self.table("""&mesh generator = 'cylinder' radius = 1.0 length = 1.0 angles = 0.0, 90.0 divisions = 8, 4 /
&material name = 'm' law = 'neo_hookean' mu = 1.0e3 /
&section thickness = 0.05 /
&support node_set = 'edge_y0' type = 'clamped' /
&support node_set = 'edge_a0' type = 'symmetry_x' /
&support node_set = 'edge_a1' type = 'symmetry_z' /
&load type = 'pressure' pressure = 5.0 /
&step tolerance = 'tight' /
&monitor name = 'energy' quantity = 'energy' /
&monitor name = 'mean' quantity = 'energy_density' /
&output every = 0 /
""")
        self.assertAlmostEqual(row["mean"] * 0.5 * math.pi * 0.05 / row["energy"], 1, delta=1e-5)

    def test_layers_and_their_fibres(self):
        n, last = self.solve(LAMINATE + "&output fields = " + ALL + " /\n")
        for layer, turn in ((1, 15), (3, -15)):
            for family, angle in enumerate((turn + 30, turn - 30)):
                a = np.array([1.2 * math.cos(math.radians(angle)), math.sin(math.radians(angle)), 0])
                length = np.linalg.norm(a)
                np.testing.assert_allclose(last[f"fibre_stretch_layer{layer}"][:, family], length, rtol=1e-9)
                np.testing.assert_allclose(last[f"fibre_direction_{family + 1}_layer{layer}"], np.tile(a / length, (n, 1)), atol=1e-9)
        self.assertTrue(np.isnan(last["fibre_stretch_layer2"]).all())
        # incompressible sheet of constant width: the gel bears mu (l^2 - 1/l^2), mu (1 - 1/l^2)
        np.testing.assert_allclose(last["material_stress_layer2"], np.tile([100 * (1.44 - 1 / 1.44), 100 * (1 - 1 / 1.44), 0], (n, 1)), atol=1e-6)
        self.assertGreater(np.abs(last["material_stress_layer1"][:, 2]).min(), 1)
        np.testing.assert_allclose(last["material_stress_layer1"][:, :2], last["material_stress_layer3"][:, :2], rtol=1e-8)
        np.testing.assert_allclose(last["material_stress_layer1"][:, 2], -last["material_stress_layer3"][:, 2], rtol=1e-8)

    def test_monitors_of_any_field(self):
        monitors = {"low": "quantity = 'strain' component = '11' height = 'bottom' reduce = 'min'",
                    "high": "quantity = 'strain' component = '11' height = 'bottom' reduce = 'max'",
                    "mean": "quantity = 'strain' component = '11' height = 'bottom'", "top": "quantity = 'principal_stress' component = '2' height = 'top'",
                    "middle": "quantity = 'stress' component = '11'", "direction": "quantity = 'principal_direction_1' component = 'x' height = 'top'",
                    "tip": "quantity = 'displacement' component = 'y' node_set = 'edge_x1' reduce = 'max'",
                    "held": "quantity = 'reaction' component = 'x' node_set = 'edge_x0' reduce = 'min'",
                    "total": "quantity = 'reaction' component = 'x' node_set = 'edge_x0'"}
        text = BENT.split("&output")[0] + "".join(f"&monitor name = '{name}' {keys} /\n" for name, keys in monitors.items())
        row, _ = self.table(text + "&output every = 0 /\n")
        _, last = self.solve(text + "&output fields = 'strain', 'principal_stress', 'stress', 'principal_direction_1', 'reaction' /\n")
        e = last["strain_bottom"][:, 0]
        np.testing.assert_allclose([row["low"], row["high"], row["mean"]], [e.min(), e.max(), e.mean()], rtol=1e-12)
        self.assertLess(row["low"], row["mean"])
        self.assertAlmostEqual(row["top"] / last["principal_stress_top"][:, 1].mean(), 1, delta=1e-12)
        self.assertAlmostEqual(row["middle"] / last["stress_middle"][:, 0].mean(), 1, delta=1e-12)
        self.assertAlmostEqual(row["direction"] / last["principal_direction_1_top"][:, 0].mean(), 1, delta=1e-12)
        self.assertGreater(row["tip"], 0)
        self.assertLess(row["held"], 0)
        self.assertAlmostEqual(row["total"], -0.3, places=6)

    def test_monitors_of_layers(self):
        text = LAMINATE + "".join(f"&monitor name = 'f{layer}' quantity = 'fibre_stretch' component = '1' layer = {layer} /\n" for layer in (1, 2, 3))
        row, printed = self.table(text)
        for layer, angle in ((1, 45), (3, 15)):
            self.assertAlmostEqual(row[f"f{layer}"], math.hypot(1.2 * math.cos(math.radians(angle)), math.sin(math.radians(angle))), places=9)
        self.assertTrue(math.isnan(row["f2"]))
        self.assertRegex(printed, r"Missing in f2: \d+ values")

    def test_estimated_error(self):
        monitors = "&monitor name = 'relative' quantity = 'relative_error' /\n&monitor name = 'energy' quantity = 'energy' /\n" \
            "&monitor name = 'part' quantity = 'error' node_set = 'corner_x0_y0' reduce = 'sum' /\n"
        for step in ("&step load_factor = 1.0 tolerance = 'tight' /\n", "&step control = 'linear' /\n"):
            text = BENT.split("&step")[0] + step
            row, printed = self.table(text + monitors)
            _, last = self.solve(text + "&output fields = 'error' /\n")
            squares = (last["error"]**2).sum()
            self.assertGreater(last["error"].min(), 0)
            self.assertAlmostEqual(row["relative"] / math.sqrt(squares / (squares + row["energy"])), 1, delta=1e-4)
            self.assertTrue(0.01 < row["relative"] < 0.5)
            # an element or two at the corner
            self.assertIn(True, [abs(row["part"] - sum(last["error"][:k])) < 1e-9 * row["part"] for k in (1, 2)])
            said = float(re.search(r"Estimated relative error in energy norm: (\S+) %", printed).group(1))
            self.assertAlmostEqual(said / (100 * row["relative"]), 1, delta=0.01)
        # of paths it is always said, of linear steps if it is asked for
        self.assertIn("Estimated relative error", self.table(BENT)[1])
        self.assertNotIn("Estimated relative error", self.table(BENT.split("&step")[0] + "&step control = 'linear' /\n")[1])

    def test_readers_take_all_fields(self):
        try:
            from vtkmodules.util.numpy_support import vtk_to_numpy
            from vtkmodules.vtkIOHDF import vtkHDFReader
        except ImportError:
            self.skipTest("vtk is not installed")
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "sheet.nml").write_text(LAMINATE + "&output fields = " + ALL + " /\n")
            subprocess.run([os.environ["FINSHELL_BIN"], "run", "sheet.nml"], cwd=folder, capture_output=True, check=True)
            reader = vtkHDFReader()
            reader.SetFileName(str(Path(folder) / "sheet.vtkhdf"))
            reader.UpdateInformation()
            with h5py.File(Path(folder) / "sheet.vtkhdf") as file:
                reader.UpdateTimeStep(file["VTKHDF/Steps/Values"][-1])
                data = reader.GetOutput().GetCellData()
                cells = file["VTKHDF/CellData"]
                self.assertEqual(len(cells), 3 * 6 + 2 + 4 * 3)
                for name, values in cells.items():
                    self.assertEqual(data.GetArray(name).GetNumberOfComponents(), 1 if values.ndim == 1 else values.shape[1])
                    np.testing.assert_array_equal(vtk_to_numpy(data.GetArray(name)), np.asarray(values)[-data.GetArray(name).GetNumberOfTuples():])
            xdmf = (Path(folder) / "sheet.xdmf").read_text()
            self.assertTrue(all(re.search(rf'Name="{name}"', xdmf) for name in ("principal_direction_1_top", "fibre_stretch_layer3")))


if __name__ == "__main__":
    unittest.main()
