#!/usr/bin/env python3
"""&sensitivity: derivatives against differences of whole runs (fourth order), against the closed form of the inflated sphere, adjoint
against forward solutions, restart, what it must not change, and what is refused."""
import csv
import importlib.util
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

PROGRAM = os.environ["FINSHELL_BIN"]
SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}
EXACT = "residual_tolerance = 1e-11 correction_tolerance = 1e-9"

SPHERE = """&mesh generator = 'sphere' radius = 10.0 colatitudes = 0.0, 90.0 azimuths = 0.0, 90.0 divisions = 4, 4 /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0 density = 0.5 /
&section thickness = 0.3 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'edge_bottom' type = 'symmetry_z' /
&load type = 'pressure' pressure = 0.03 /
&load type = 'gravity' vector = 0.0, 0.0, -0.3 constant = .true. /
&monitor name = 'volume' quantity = 'volume' /
&monitor name = 'pole' quantity = 'displacement' component = 'z' node_set = 'pole_top' /
&monitor name = 'energy' quantity = 'energy' /
&monitor name = 'thin' quantity = 'thickness_stretch' reduce = 'min' /
&monitor name = 'base' quantity = 'reaction' component = 'z' node_set = 'edge_bottom' /
"""
FACETS = SPHERE.replace("divisions", "normals = 'facet' divisions")
LOAD = f"&step load_factor = 60.0 first_increment = 20.0 automatic = .false. {EXACT} /\n"
VOLUME = f"&step control = 'volume' volumes = 700.0, 1000.0 first_increment = 150.0 {EXACT} /\n"
STRIP = f"""&mesh generator = 'rectangle' lengths = 4.0, 1.0 divisions = 8, 2 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0e4 density = 1.0 /
&section thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&monitor name = 'tip' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
&monitor name = 'strain' quantity = 'strain' component = '11' height = 'top' /
&step {EXACT} /
"""
# a free edge: the matrix is not symmetric, nor is the adjoint system that of the state
FREE_EDGE = STRIP + "&load type = 'pressure' pressure = 2.0 /\n&load type = 'gravity' vector = 0.0, 1.0, -3.0 constant = .true. /\n"
MOVED = STRIP + "&support node_set = 'edge_x1' ux = 0.5 uy = 0.0 uz = 0.3 rx = 0.4 ry = 0.2 rz = 0.1 /\n" \
    "&monitor name = 'pull' quantity = 'reaction' component = 'x' node_set = 'edge_x1' /\n"
ARC = STRIP.replace("&step", "&step control = 'arc_length'") + "&load type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0, 10.0 /\n"
JOINED = STRIP.replace("edge_x1", "hub") + "&node name = 'hub' position = 4.5, 0.5, 0.2 /\n" \
    "&rigid_body node_set = 'edge_x1' reference = 'hub' /\n&load type = 'force' node_set = 'hub' vector = 0.0, 0.0, 10.0 /\n"
BALLOON = f"""&mesh generator = 'sphere' radius = 0.1 colatitudes = 0.0, 90.0 azimuths = 0.0, 90.0 divisions = 4, 4 /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 1.76e5 c01 = 1.6e4 /
&section thickness = 3.0e-4 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'edge_bottom' type = 'symmetry_z' /
&chamber name = 'air' fluid = 'gas' ambient = 101325.0 inflow = 1.0e-3 /
&step {EXACT} /
&monitor name = 'pole' quantity = 'displacement' component = 'z' node_set = 'pole_top' /
"""
AIRBAG = f"""&mesh generator = 'rectangle' lengths = 0.424264068712, 0.424264068712 divisions = 5, 5 /
&material name = 'fabric' law = 'st_venant_kirchhoff' e = 588e6 nu = 0.4 /
&section type = 'membrane' wrinkling = .true. thickness = 0.6e-3 /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&support node_set = 'edge_x1', 'edge_y1' fixed = 'uz' /
&load type = 'pressure' pressure = 5000.0 /
&step {EXACT} /
&monitor name = 'pole' quantity = 'displacement' component = 'z' node_set = 'corner_x0_y0' /
"""
# elements with a thickness of their own, and a sheet that was stretched and grows: what stores energy where nothing moves
TAPER = STRIP.replace("&section", "&field name = 't' over = 'x' points = 0.0, 0.15, 4.0, 0.05 /\n&section").replace(
    "thickness = 0.1", "thickness = 0.1, 0.2 thickness_field = 't' offset = 0.02") \
    + "&load type = 'gravity' vector = 0.0, 0.5, 20.0 /\n&monitor name = 'energy' quantity = 'energy' /\n"
GROWING = STRIP.replace("thickness = 0.1", "thickness = 0.04, 0.06") + "&growth growth = 1.05 layer = 1 /\n&growth prestretch = 1.1, 1.0 constant = .true. /\n" \
    "&load type = 'gravity' vector = 0.0, 0.5, 3.0 constant = .true. /\n&monitor name = 'energy' quantity = 'energy' /\n"
# input, monitors, parameters: value and what a run sets
WHOLE_RUNS = {
    "load": (SPHERE + LOAD, ("volume", "pole", "energy", "thin", "base"),
             {"material.c10": (80.0, ""), "section.thickness": (0.3, ""), "load[1].pressure": (0.03, ""), "mesh.radius": (10.0, "")}),
    "volume": (SPHERE + VOLUME, ("load_factor", "energy", "base"), {"material.c01": (20.0, ""), "section.thickness": (0.3, ""), "mesh.radius": (10.0, "")}),
    "free edge": (FREE_EDGE, ("tip", "strain"), {"section.thickness": (0.1, ""), "material.density": (1.0, ""),
                                                 "load[2].vector(3)": (-3.0, "load[2].vector=0 1 {}")}),
    "moved": (MOVED, ("pull",), {"material.mu": (1e4, ""), "support[2].uz": (0.3, ""), "support[2].ry": (0.2, "")}),
    "arc-length": (ARC, ("tip",), {"material.mu": (1e4, ""), "section.thickness": (0.1, "")}),
    "joints": (JOINED, ("tip",), {"material.mu": (1e4, ""), "section.thickness": (0.1, ""), "node.position(1)": (4.5, "node.position={} 0.5 0.2")}),
    "chamber": (BALLOON, ("pole",), {"section.thickness": (3e-4, ""), "chamber.ambient": (101325.0, ""), "mesh.radius": (0.1, "")}),
    "taper": (TAPER, ("tip", "energy"), {"material.mu": (1e4, ""), "section.offset": (0.02, ""),
                                         "field.points(2)": (0.15, "field.points=0 {} 4 0.05")}),
    "growth": (GROWING, ("tip", "energy", "strain"), {"section.thickness(1)": (0.04, "section.thickness={} 0.06"),
                                                      "growth[2].prestretch(1)": (1.1, "growth[2].prestretch={} 1")}),
    "wrinkles": (AIRBAG, ("pole",), {"material.nu": (0.4, ""), "load.pressure": (5000.0, "")}),
}


def wanted(monitors, parameters, more=""):
    return "".join(f"&sensitivity monitor = '{m}' parameter = '{p}' name = 's_{m}_{i}' {more} /\n"
                   for m in monitors for i, p in enumerate(parameters))


class Runs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def solve(self, text, *settings, name="a", command="run"):
        if text:
            (self.path / f"{name}.nml").write_text(text)
        what = [f"{name}.nml"] if command == "run" else [name]
        return subprocess.run([PROGRAM, command, "-q", *what, *[word for s in settings for word in ("--set", s)]], cwd=self.path,
                              capture_output=True, text=True, env=ENVIRONMENT, timeout=300, check=False)

    def rows(self, text, *settings, name="a"):
        done = self.solve(text, *settings, name=name)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        with (self.path / f"{name}.history.csv").open() as file:
            return [{k: float(v or "nan") for k, v in row.items()} for row in csv.DictReader(file)]


class Differences(Runs):
    def test_whole_runs(self):
        for case, (text, monitors, parameters) in WHOLE_RUNS.items():
            found = self.rows(text + wanted(monitors, parameters))[-1]
            for i, (parameter, (value, form)) in enumerate(parameters.items()):
                step = 1e-3 * abs(value)
                last = [self.rows(text, (form or parameter + "={}").format(repr(value + k * step)))[-1] for k in (-2, -1, 1, 2)]
                for m in monitors:
                    expected = np.dot([1, -8, 8, -1], [row[m] for row in last]) / (12 * step)
                    with self.subTest(case, parameter=parameter, monitor=m):
                        self.assertLess(abs(found[f"s_{m}_{i}"] / expected - 1), 1e-6)

    def test_rows_between(self):
        """Derivatives stand at every increment, not at the last alone."""
        rows = [row for row in self.rows(SPHERE + LOAD + wanted(("volume",), ("material.c10",))) if row["load_factor"] > 0]
        self.assertEqual(len(rows), 3)
        self.assertTrue(all(row["s_volume_0"] < 0 for row in rows))
        half = self.rows(SPHERE + LOAD.replace("60.0", "40.0"), "material.c10=80.01")[-1]["volume"]
        other = self.rows(SPHERE + LOAD.replace("60.0", "40.0"), "material.c10=79.99")[-1]["volume"]
        self.assertAlmostEqual(rows[1]["s_volume_0"] / ((half - other) / 0.02), 1, places=5)

    def test_fixed(self):
        """Held fixed: a monitor, under load control. dq/dp at fixed c is that at fixed load less what the load makes up for."""
        free = self.rows(SPHERE + LOAD + wanted(("volume", "pole", "energy"), ("material.c10",)))[-1]
        turned = self.rows(SPHERE + LOAD + wanted(("load_factor", "pole", "volume"), ("material.c10",), "fixed = 'energy'"))[-1]
        near = [self.rows(SPHERE + LOAD.replace("= 60.0 f", f"= {60.0 + k!r} f"))[-1] for k in (-1e-2, 1e-2)]
        slope = {m: (near[1][m] - near[0][m]) / 2e-2 for m in ("volume", "pole", "energy")}
        change = -free["s_energy_0"] / slope["energy"]
        self.assertAlmostEqual(turned["s_load_factor_0"] / change, 1, places=6)
        for m in ("volume", "pole"):
            self.assertAlmostEqual(turned[f"s_{m}_0"] / (free[f"s_{m}_0"] + change * slope[m]), 1, places=4)

    def test_fixed_energy_of_growth(self):
        """Growth changes the stored energy by the load factor itself, not by what moves alone."""
        free = self.rows(GROWING + wanted(("energy",), ("material.mu",)))[-1]["s_energy_0"]
        found = self.rows(GROWING + wanted(("load_factor",), ("material.mu",), "fixed = 'energy'"))[-1]["s_load_factor_0"]
        near = [self.rows(GROWING, f"step.load_factor={x}")[-1]["energy"] for x in (0.999, 1.001)]
        self.assertAlmostEqual(found / (-free / ((near[1] - near[0]) / 2e-3)), 1, places=6)

    def test_equal_layers(self):
        """Two layers that meet at the surface of the nodes: a thinner first one, as the least step of a run has it on that side alone."""
        text = GROWING.replace("0.04, 0.06", "0.05, 0.05")
        found = self.rows(text + wanted(("tip",), ("section.thickness(1)",)))[-1]["s_tip_0"]
        tips = [self.rows(text, f"section.thickness={0.05 - k * 5e-5!r} 0.05")[-1]["tip"] for k in range(5)]
        self.assertAlmostEqual(found / (np.dot([25, -48, 36, -16, 3], tips) / 12 / 5e-5), 1, places=7)


class Sphere(Runs):
    TEXT = """&mesh generator = 'sphere' radius = 10.0 colatitudes = 0.0, 90.0 azimuths = 0.0, 90.0 divisions = {0}, {0} /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0 /
&section type = 'membrane' thickness = 0.01 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'edge_bottom' type = 'symmetry_z' /
&load type = 'pressure' pressure = 0.001 /
&step control = 'volume' volumes = {1!r} first_increment = 150.0 tolerance = 'tight' /
"""

    def test_closed_form(self):
        """p = 4 h (1/r - R^6/r^7) (c10 + c01 r^2/R^2) of a membrane: its derivatives at fixed r, with errors that fall like those of
        the facets, with the square of their size."""
        radius, h, c10, c01, r = 10.0, 0.01, 80.0, 20.0, 14.0
        a, b = 1 / r - radius**6 / r**7, c10 + c01 * r**2 / radius**2
        exact = np.array([4 * h * a, 4 * h * a * r**2 / radius**2, 4 * a * b,
                          4 * h * (-6 * radius**5 / r**7 * b - 2 * a * c01 * r**2 / radius**3)])
        parameters = ("material.c10", "material.c01", "section.thickness", "mesh.radius")
        errors = []
        for cells in (6, 12):
            row = self.rows(self.TEXT.format(cells, np.pi / 6 * r**3) + wanted(("load_factor",), parameters))[-1]
            errors.append([1e-3 * row[f"s_load_factor_{i}"] / e - 1 for i, e in enumerate(exact)])
        ratio = np.array(errors[0]) / np.array(errors[1])
        self.assertLess(np.abs(errors[1]).max(), 0.01, errors)
        self.assertTrue(np.all((ratio > 3.7) & (ratio < 4.3)), ratio)

    def test_limit_point(self):
        """Across the pressure maximum the derivatives at fixed volume are smooth; those at fixed pressure change their sign."""
        volumes = ", ".join(f"{np.pi / 6 * (10 * x)**3:.6f}" for x in (1.3, 1.45, 1.5, 1.55, 1.7))
        text = self.TEXT.format(6, 0.0).replace("volumes = 0.0", f"volumes = {volumes}").replace("c01 = 20.0", "c01 = 4.0") \
            + "&monitor name = 'volume' quantity = 'volume' /\n"
        rows = self.rows(text + wanted(("load_factor",), ("material.c10",)) + wanted(("volume",), ("material.c10",), "fixed = 'load_factor'"))
        smooth = [row["s_load_factor_0"] for row in rows]
        self.assertTrue(all(x > 0 for x in smooth))
        self.assertLess(rows[0]["s_volume_0"], 0)
        self.assertGreater(rows[-1]["s_volume_0"], 0)


@unittest.skipUnless(importlib.util.find_spec("h5py"), "h5py is not installed")
class Fields(Runs):
    def fields(self, *names):
        import h5py
        with h5py.File(self.path / "a.vtkhdf") as file:
            root = file["VTKHDF"]
            nodes, elements = int(root["NumberOfPoints"][-1]), int(root["NumberOfCells"][-1])
            return [root["Points"][:][-nodes:]] + [root["CellData"][n][-elements:] if n in root["CellData"] else root["PointData"][n][-nodes:]
                                                   for n in names]

    def test_sums(self):
        """All elements thicker alike: the section thicker. All nodes further out alike: a larger sphere. Both sides by different ways,
        adjoint and forward."""
        for case, text, monitors, more in (("load", FACETS + LOAD, ("volume", "pole", "energy"), ""), ("volume", FACETS + VOLUME, ("load_factor", "energy"), ""),
                                           ("fixed", FACETS + LOAD, ("load_factor", "pole"), "fixed = 'energy'")):
            all_of = ("section.thickness", "mesh.radius", "element_thickness", "node_position")
            row = self.rows(text + wanted(monitors, all_of, more))[-1]
            for m in monitors:
                points, of_element, of_node = self.fields(f"s_{m}_2", f"s_{m}_3")
                with self.subTest(case, monitor=m):
                    self.assertAlmostEqual(of_element.sum() / row[f"s_{m}_0"], 1, places=8)
                    self.assertAlmostEqual((points * of_node).sum() / 10 / row[f"s_{m}_1"], 1, places=7)

    def test_unsymmetric(self):
        """The adjoint system of a free edge under pressure is the transposed one."""
        row = self.rows(FREE_EDGE + wanted(("tip",), ("section.thickness", "element_thickness")))[-1]
        self.assertAlmostEqual(self.fields("s_tip_1")[1].sum() / row["s_tip_0"], 1, places=8)

    def test_one_element(self):
        """An element of its own section, varied by whole runs."""
        text = FREE_EDGE.replace("&section thickness = 0.1", "&element_set name = 'one' elements = 7 /\n&element_set name = 'others' elements = "
                                 + ", ".join(str(i) for i in range(1, 33) if i != 7)
                                 + " /\n&section thickness = 0.1 element_set = 'others' /\n&section thickness = 0.1 element_set = 'one'")
        self.rows(text + wanted(("tip",), ("element_thickness",)))
        field = self.fields("s_tip_0")[1]
        tips = [self.rows(text, f"section[2].thickness={x!r}")[-1]["tip"] for x in (0.0999, 0.1001)]
        self.assertAlmostEqual(field[6] / ((tips[1] - tips[0]) / 2e-4), 1, places=5)


    def test_growth(self):
        """The pieces have grown as the structure has: both layers thicker alike, all nodes farther along x, by whole runs."""
        self.rows(GROWING + wanted(("tip", "energy"), ("element_thickness", "node_position")))
        x, *found = self.fields(*[f"s_{m}_{i}" for m in ("tip", "energy") for i in (0, 1)])
        for case, sums, setting in (("thickness", [f.sum() * 0.1 for f in found[::2]], lambda a: f"section.thickness={0.04 * a!r} {0.06 * a!r}"),
                                    ("position", [(f * x)[:, 0].sum() for f in found[1::2]], lambda a: f"mesh.lengths={4 * a!r} 1")):
            rows = [self.rows(GROWING, setting(1 + k * 1e-3))[-1] for k in (-2, -1, 1, 2)]
            for m, value in zip(("tip", "energy"), sums):
                with self.subTest(case, monitor=m):
                    self.assertAlmostEqual(value / (np.dot([1, -8, 8, -1], [row[m] for row in rows]) / 12e-3), 1, places=5)

    def test_thickness_of_one_element(self):
        """Elements with a thickness of their own: one of them, varied by whole runs."""
        text = TAPER.replace("over = 'x' points = 0.0, 0.15, 4.0, 0.05", "file = 't.txt'")
        values = [0.1 + 0.05 * (7 * i % 11) / 11 for i in range(32)]

        def rows(change=0.0, more=""):
            (self.path / "t.txt").write_text("".join(f"{v + change * (i == 13)!r}\n" for i, v in enumerate(values)))
            return self.rows(text + more)[-1]
        rows(0.0, wanted(("tip", "energy"), ("element_thickness",)))
        found = self.fields("s_tip_0", "s_energy_0")[1:]
        near = [rows(k * 1e-4) for k in (-2, -1, 1, 2)]
        for m, field in zip(("tip", "energy"), found):
            self.assertAlmostEqual(field[13] / (np.dot([1, -8, 8, -1], [row[m] for row in near]) / 12e-4), 1, places=7)


class Path_(Runs):
    def test_changes_nothing(self):
        """The states of a run are the same to the last bit with derivatives and without."""
        for text in (SPHERE + VOLUME.replace(EXACT, ""), FREE_EDGE.replace(EXACT, ""), BALLOON.replace(EXACT, "")):
            plain = self.rows(text)
            with_them = self.rows(text + wanted((("pole" if "'pole'" in text else "tip"),), ("section.thickness", "element_thickness")))
            self.assertEqual([{k: row[k] for k in plain[0]} for row in with_them], plain)

    def test_restart(self):
        """A run that goes on has the same derivatives."""
        text = SPHERE + LOAD + "&output restart = 'every' /\n" + wanted(("pole",), ("material.c10", "element_thickness"))
        whole = self.rows(text)
        done = subprocess.run([PROGRAM, "restart", "-q", "a", "--from", "1"], cwd=self.path, capture_output=True, text=True, env=ENVIRONMENT, timeout=300, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        with (self.path / "a.history.csv").open() as file:
            self.assertEqual([float(row["s_pole_0"]) for row in csv.DictReader(file)], [row["s_pole_0"] for row in whole])


@unittest.skipUnless(importlib.util.find_spec("scipy"), "scipy is not installed")
class Fit(unittest.TestCase):
    def test_fit(self):
        """api/python/examples/inflation_fit.py: the exact curve gives c10 and c01 back to the error of the mesh, a curve of the program
        itself exactly, each in 20 runs at most."""
        sys.path.insert(0, str(SOURCE / "api" / "python" / "examples"))
        import inflation_fit
        inflation_fit.PROGRAM = PROGRAM
        at = np.array([1.1, 1.3, 1.6, 2.0, 2.5])
        model = inflation_fit.Balloon(at, 6)
        found = inflation_fit.fit(model, inflation_fit.exact(at))
        self.assertLessEqual(model.runs, 20)
        self.assertLess(max(abs(found[0] / 80 - 1), abs(found[1] / 20 - 1)), 1e-3)
        model = inflation_fit.Balloon(at, 4)
        measured = model.curve(np.array([60.0, 12.0]))[:, 0]
        model.runs = 0
        found = inflation_fit.fit(model, measured)
        self.assertLessEqual(model.runs, 20)
        self.assertLess(max(abs(found[0] / 60 - 1), abs(found[1] / 12 - 1)), 1e-6)


C10 = "parameter = 'material.c10'"
REFUSED = [  # text of the input, the group, words of the answer
    (SPHERE + LOAD, f"monitor = 'pol' {C10}", "there is no monitor 'pol'; expected one of: load_factor, volume, pole"),
    (SPHERE + LOAD, f"monitor = 'load_factor' {C10}", "the load factor is what is held fixed; say what is instead"),
    (SPHERE + LOAD, f"monitor = 'pole' {C10} fixed = 'pole'", "is held fixed, its derivative is 0"),
    (SPHERE + LOAD, f"monitor = 'pole' {C10} fixed = 'thin'", "cannot be held fixed; these quantities can: displacement"),
    (SPHERE + LOAD, f"monitor = 'pole' {C10} name = 'pole'", "there is a monitor 'pole' already"),
    (SPHERE + LOAD, f"monitor = 'pole' {C10} /\n&sensitivity monitor = 'pole' {C10}", "there is a sensitivity 'd_pole_d_material.c10' already"),
    (SPHERE + LOAD, "monitor = 'thin' parameter = 'element_thickness'", "has no derivative for each element or node; these quantities have"),
    (SPHERE + LOAD, "monitor = 'pole' parameter = 'thickness'", "found 'thickness', expected a number of the input"),
    (SPHERE + LOAD, "monitor = 'pole' parameter = 'chamber.inflow'", "has no group &chamber; its groups: mesh"),
    (SPHERE + LOAD, "monitor = 'pole' parameter = 'section.offset'", "&section has no 'offset'; what is to be varied has to be given"),
    (SPHERE + LOAD, "monitor = 'pole' parameter = 'load[2].vector'", "say which of its numbers, as 'load[2].vector(1)'"),
    (SPHERE + LOAD, "monitor = 'pole' parameter = 'material.law'", "'material.law' is no number"),
    (SPHERE + LOAD, "monitor = 'pole' parameter = 'load[2].vector(1)'", "is 0; say of what magnitude it may be: scale = ..."),
    (SPHERE + LOAD, "monitor = 'pole' parameter = 'mesh.divisions(1)'", "with mesh.divisions(1) = "),
    (FREE_EDGE + "&node_set name = 'far' plane_point = 2.0, 0.0, 0.0 plane_normal = 1.0, 0.0, 0.0 /\n&support node_set = 'far' fixed = 'uy' /\n",
     "monitor = 'tip' parameter = 'node_set.plane_point(1)'", "node_set.plane_point(1) cannot be varied: it changes what is held"),
    (SPHERE + LOAD + "&output energy = .true. /\n", "monitor = 'pole' parameter = 'material.c01' scale = -1.0", "scale"),
    (STRIP.replace("clamped' /", "clamped' /\n&load type = 'gravity' vector = 0.0, 0.0, 1.0 /").replace(
        f"&step {EXACT}", "&step control = 'linear'"), "monitor = 'tip' parameter = 'material.mu'", "derivatives are those of static states"),
    (SPHERE + LOAD.replace("&step", "&step stabilise = 1e-4"), f"monitor = 'pole' {C10}", "depend on the way they were reached"),
    (SPHERE + LOAD, "monitor = 'pole' parameter = 'node_position'", "normals of a curved reference hang on more nodes than those of an element"),
    (JOINED, "monitor = 'tip' parameter = 'node_position'", "node_position is not known with joints"),
    (ARC, "monitor = 'tip' parameter = 'node_position'", "node_position is not known with loads along edges"),
    (BALLOON.replace("divisions", "normals = 'facet' divisions"), "monitor = 'pole' parameter = 'node_position'", "node_position is not known with chambers"),
]


class Refused(Runs):
    def test_refused(self):
        for text, group, words in REFUSED:
            with self.subTest(words):
                done = self.solve(text + f"&sensitivity {group} /\n")
                self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
                self.assertIn(words, done.stderr)
                self.assertIn("a.nml:", done.stderr)
                self.assertEqual(list(self.path.glob("*.csv")), [])


if __name__ == "__main__":
    unittest.main()
