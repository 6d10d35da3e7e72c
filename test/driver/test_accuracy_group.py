#!/usr/bin/env python3
"""&accuracy: meshes refined until the estimate meets the target: linear and nonlinear jobs, controls, files, limits, what is refused."""
import csv
import math
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

import h5py

PROGRAM = os.environ["FINSHELL_BIN"]
ROOF = """&mesh generator = 'cylinder' radius = 25.0 length = 25.0 angles = 0.0, 40.0 divisions = 4, 4 /
&material name = 'm' law = 'linear_elastic' e = 4.32e8 nu = 0.0 /
&section thickness = 0.25 /
&support node_set = 'edge_a0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&support node_set = 'edge_y1' fixed = 'ux', 'uz' /
&load type = 'traction' vector = 0.0, 0.0, -90.0 /
&step control = 'linear' /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_a1_y0' /
"""
DISK = """&mesh generator = 'disk' radius = 7.5 rings = 4 core = 2 /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0 /
&section thickness = 0.5 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'pressure' pressure = 40.0 /
{step}
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /
"""
HOLE = """&mesh generator = 'hole' lengths = 30, 20 radius = 1 divisions = 8, 6 /
&material name = 'elastic' law = 'linear_elastic' e = 1e3 nu = 0.3 /
&section thickness = 1 direction = 1, 0, 0 /
&support node_set = 'all' fixed = 'uz', 'rx', 'ry' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'line' edge_set = 'edge_x1' vector = 1.0, 0, 0 /
&step control = 'linear' /
&monitor name = 'peak' quantity = 'membrane_force' component = '11' node_set = 'corner_hole_x0' /
&monitor name = 'pull' quantity = 'reaction' component = 'x' node_set = 'edge_x0' /
"""
PLATE = """&mesh generator = 'rectangle' lengths = 2, 1 divisions = 32, 16 diagonal = 'forward' /
&material name = 'm' law = 'linear_elastic' e = 1e5 nu = 0.3 /
&section thickness = 0.02 /
&support node_set = 'edge_x0' type = 'clamped' /
&step tolerance = 'tight' /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_x1_y1' /
"""
ROOT = Path(__file__).resolve().parents[2]


class Accuracy(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def run_text(self, text, *options, command="run", code=0):
        (self.folder / "model.nml").write_text(text)
        result = subprocess.run([PROGRAM, command, "model.nml", *options], cwd=self.folder, capture_output=True, text=True, timeout=120, check=False)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        self.assertNotIn("Backtrace", result.stderr)
        return result

    def rows(self, name="meshes"):
        return list(csv.DictReader((self.folder / f"model.{name}.csv").read_text().splitlines()))

    def test_roof(self):
        """A linear job: the target is met, by the answer too; history, table and result file are of the meshes that they name."""
        out = self.run_text(ROOF + "&accuracy target = 0.01 monitor = 'w' /\n").stdout
        meshes, history = self.rows(), self.rows("history")
        self.assertIn("meets the target", out)
        self.assertLessEqual(float(meshes[-1]["estimate"]), 0.01)
        self.assertGreater(float(meshes[-2]["estimate"]), 0.01)
        self.assertAlmostEqual(float(history[-1]["w"]), -0.3006, delta=0.003)
        self.assertEqual([row["mesh"] for row in meshes], [str(int(float(row["mesh"]))) for row in history])
        self.assertEqual([float(row["w"]) for row in meshes], [float(row["w"]) for row in history])
        self.assertEqual(out.count("estimated error"), len(meshes))
        self.assertLess(int(meshes[-1]["elements"]), 700)
        with h5py.File(self.folder / "model.vtkhdf") as file:
            self.assertEqual(file["VTKHDF/NumberOfCells"][-1], int(meshes[-1]["elements"]))

    def test_energy_norm(self):
        """Without a monitor: the estimates fall, and are what a monitor says of the same mesh."""
        self.run_text(ROOF + "&accuracy target = 0.1 /\n")
        meshes = self.rows()
        self.assertGreater(len(meshes), 1)
        self.assertLessEqual(float(meshes[-1]["estimate"]), 0.1)
        self.run_text(ROOF + "&monitor name = 'e' quantity = 'relative_error' /\n")
        self.assertAlmostEqual(float(self.rows("history")[-1]["e"]), float(meshes[0]["estimate"]), delta=1e-9)

    def test_state_is_carried_over(self):
        """Under load, displacement and arc-length control: a few iterations a mesh, and the state that a fine mesh reaches from rest."""
        ends = {}
        for control, step in (("load", "&step /"), ("arc", "&step control = 'arc_length' /"),
                              ("displacement", "&step control = 'displacement' node_set = 'centre' component = 'z' displacements = 11.0 /")):
            self.run_text(DISK.format(step=step) + "&accuracy target = 0.003 monitor = 'w' /\n", "-q")
            history, meshes = self.rows("history"), self.rows()
            self.assertGreater(len(meshes), 2, control)
            later = [row for row in history if float(row["mesh"]) > 1]
            self.assertEqual(len(later), len(meshes) - 1, control)
            for row in later:
                self.assertLessEqual(int(row["iterations"]), 5, control)
                self.assertLess(float(row["residual"]), 5e-3)
            ends[control] = history[-1]
        self.assertAlmostEqual(float(ends["displacement"]["w"]), 11.0, delta=1e-8)
        self.assertAlmostEqual(float(ends["load"]["load_factor"]), 1.0, delta=1e-12)
        self.assertAlmostEqual(float(ends["arc"]["w"]) / float(ends["load"]["w"]), 1, delta=1e-3)
        self.run_text(DISK.format(step="&step /"), "-q", "--refine", "3")
        fine = float(self.rows("history")[-1]["w"])
        self.assertAlmostEqual(float(ends["load"]["w"]) / fine, 1, delta=0.03)

    def test_way_on_a_coarser_mesh(self):
        """`coarser`: few iterations on a mesh as fine as that of the input, to the state that the way there leads to: the same where the mesh is."""
        disk = DISK.replace("rings = 4 core = 2", "rings = 16 core = 8")
        bent = PLATE + "&load type = 'force' node_set = 'corner_x1_y0' vector = 0, 0, 1.5 /\n"
        file = bent.replace("divisions = 32, 16", "divisions = 8, 4 refine = 2") + "&node_set name = 'numbered' nodes = 1, 3 /\n"
        for name, text in (("load", disk.format(step="&step tolerance = 'tight' /")), ("plate", bent), ("cut", file), ("slender", bent.replace("32, 16", "16, 64")),
                           ("arc", disk.format(step="&step control = 'arc_length' tolerance = 'tight' /")),
                           ("displacement", disk.format(step="&step control = 'displacement' node_set = 'centre' component = 'z' displacements = 9 tolerance = 'tight' /")),
                           ("volume", disk.format(step="&step control = 'volume' volumes = 500 tolerance = 'tight' /")),
                           ("two steps", disk.format(step="&step load_factor = 0.2 /\n&step tolerance = 'tight' /"))):
            self.run_text(text, "-q")
            direct = self.rows("history")[-1]
            elements = re.search(r"(\d+) elements", self.run_text(text, command="check").stdout)[1]
            out = self.run_text(text, "--set", "accuracy.coarser=2").stdout
            self.assertIn("as fine as that of the input", out, name)
            self.assertIn("Estimated relative error", out, name)
            history, meshes = self.rows("history"), self.rows()
            self.assertEqual([row["estimate"] for row in meshes], ["", "", ""], name)
            self.assertEqual(meshes[-1]["elements"], elements, name)
            self.assertEqual([int(row["elements"]) * 4 for row in meshes[:-1]], [int(row["elements"]) for row in meshes[1:]], name)
            self.assertLessEqual(int(history[-1]["iterations"]), 5, name)  # tight tolerances
            close = 2e-7 if "&mesh generator = 'rectangle'" in text else 2e-4
            for column in ("w", "load_factor"):
                self.assertAlmostEqual(float(history[-1][column]) / float(direct[column]), 1, delta=close, msg=name)
            self.assertIn(f"{elements} elements", self.run_text(text + "&accuracy coarser = 2 /\n", command="check").stdout)

    def test_levels_on_the_way(self):
        """What the last step asks for on its way is found on each mesh, as the way on the mesh itself finds it."""
        plate = PLATE.replace("&step tolerance = 'tight' /", "{step}") + "&load type = 'force' node_set = 'corner_x1_y0' vector = 0, 0, 1.5 /\n"
        disk = DISK.replace("rings = 4 core = 2", "rings = 12")
        at_corner = "&step control = 'displacement' node_set = 'corner_x1_y0' component = 'z' displacements = 0.2, 0.4, 0.5 tolerance = 'tight' /"
        for text, step, column, values, close in ((plate, "&step load_factor = 0.1 /\n&step load_levels = 0.3, 0.6 tolerance = 'tight' /", "load_factor", (0.3, 0.6, 1), 2e-7),
                                                  (plate, at_corner, "corner", (0.2, 0.4, 0.5), 2e-7),
                                                  (disk, "&step control = 'volume' volumes = 200, 500 tolerance = 'tight' /", "volume", (200, 500), 1e-3)):
            text = text.replace("{step}", step) + ("&monitor name = 'corner' quantity = 'displacement' component = 'z' node_set = 'corner_x1_y0' /\n" if text is plate else
                                                   "&monitor name = 'volume' quantity = 'volume' /\n")
            self.run_text(text, "-q")
            direct = self.rows("history")
            self.run_text(text, "-q", "--set", "accuracy.coarser=1")
            found = [row for row in self.rows("history") if float(row["mesh"]) == 2]
            self.assertEqual(len(found), len(values), step)
            self.assertEqual([int(row["increment"]) for row in found], list(range(int(found[0]["increment"]), int(found[0]["increment"]) + len(found))))
            for row, value in zip(found, values):
                self.assertAlmostEqual(float(row[column]) / value, 1, delta=1e-7, msg=step)
                same = min(direct, key=lambda other, row=row: abs(float(other[column]) - float(row[column])))
                for name in ("w", "load_factor"):
                    self.assertAlmostEqual(float(row[name]) / float(same[name]), 1, delta=close, msg=step)

    def test_way_on_a_coarser_mesh_then_refined(self):
        """With a target the mesh of the input is the first that is judged."""
        self.run_text(DISK.format(step="&step /") + "&accuracy coarser = 1 target = 0.02 monitor = 'w' /\n")
        meshes = self.rows()
        self.assertEqual(meshes[0]["estimate"], "")
        self.assertGreater(float(meshes[1]["estimate"]), 0.02)
        self.assertLessEqual(float(meshes[-1]["estimate"]), 0.02)

    def test_rubber_stretched_far(self):
        """The rubber disk to 70 psi from 24 elements on: the carried-over state leads on, on every mesh."""
        text = (ROOT / "examples/rubber_disk/rubber_disk.nml").read_text().replace("rings = 19", "rings = 4").replace("core = 6", "core = 2")
        out = self.run_text(text + "&accuracy target = 0.001 monitor = 'w' /\n").stdout
        self.assertIn("meets the target", out)
        self.assertNotIn("run anew", out)

    def test_stable_again(self):
        """An air bag whose carried state leads to an unstable one: a descent finds a stable one near by."""
        out = self.run_text((ROOT / "examples/airbag/input.nml").read_text().replace("20, 20", "40, 40") + "&accuracy coarser = 1 /\n").stdout
        last = list(csv.DictReader((self.folder / "airbag.history.csv").read_text().splitlines()))[-1]
        self.assertEqual(last["negative_pivots"], "0", out)
        self.assertAlmostEqual(float(last["w"]), 0.2173, delta=0.002)

    def test_advice(self):
        """After a long way on a large mesh that can be coarsened, and only then."""
        text = (ROOT / "examples/sze34/input.nml").read_text().replace("first_increment = 1.0 mixed = .true.", "")
        large = text.replace("16, 16", "60, 60")
        self.assertIn("--set accuracy.coarser=2", self.run_text(large).stdout)
        for same in (large.replace("60, 60", "58, 58"), text, large + "&accuracy coarser = 2 /\n", large.replace("&step", "&step load_factor = 0.01")):
            self.assertNotIn("accuracy.coarser=2 finds", self.run_text(same).stdout)
        self.assertNotIn("coarser", self.run_text(large, "-q").stdout)

    def test_moved_supports(self):
        """A strip rolled up by turning its end: new nodes of the edge turn as it does, and the end comes to lie on the circle."""
        self.run_text("""&mesh generator = 'rectangle' lengths = 10, 1 divisions = 8, 1 /
&material name = 'm' law = 'linear_elastic' e = 1e6 nu = 0 /
&section thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&support node_set = 'edge_x1' rx = 0 ry = -3.0 rz = 0 /
&step /
&monitor name = 'turn' quantity = 'rotation' component = 'y' node_set = 'edge_x1' reduce = 'max' /
&monitor name = 'x' quantity = 'displacement' component = 'x' node_set = 'edge_x1' /
&monitor name = 'z' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
&accuracy target = 1e-6 most_meshes = 4 /
""")
        rows = [row for row in self.rows("history") if float(row["mesh"]) > 1]
        self.assertEqual(len(rows), 3)
        for row in rows:
            self.assertAlmostEqual(float(row["turn"]), -3.0, delta=1e-12)
        self.assertAlmostEqual(float(rows[-1]["x"]), 10 * math.sin(3) / 3 - 10, delta=0.02)
        self.assertAlmostEqual(float(rows[-1]["z"]), 10 * (1 - math.cos(3)) / 3, delta=0.02)

    def test_membranes(self):
        """Nodes without rotations, sheets that wrinkle: the blown-up disk on refined meshes and on a fine one."""
        text = """&mesh generator = 'disk' radius = 1 rings = 4 /
&material name = 'm' law = 'neo_hookean' mu = 1.0e3 /
&section thickness = 0.01 type = 'membrane' wrinkling = .true. /
&support node_set = 'rim' fixed = 'ux', 'uy', 'uz' /
&support node_set = 'edge_x0' fixed = 'ux' /
&support node_set = 'edge_y0' fixed = 'uy' /
&load type = 'pressure' pressure = 10 /
&step /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /
"""
        self.run_text(text + "&accuracy target = 5e-4 monitor = 'w' /\n", "-q")
        rows = self.rows("history")
        self.assertGreaterEqual(float(rows[-1]["mesh"]), 3)
        self.assertLess(sum(float(row["mesh"]) > 1 for row in rows), float(rows[-1]["mesh"]))
        self.run_text(text, "-q", "--refine", "3")
        self.assertAlmostEqual(float(rows[-1]["w"]) / float(self.rows("history")[-1]["w"]), 1, delta=2e-3)

    def test_path_anew(self):
        """Where the state carried over leads nowhere the path is run on the new mesh, and that is said."""
        step = "&step maximum_iterations = 3 tolerance = 'tight' maximum_cuts = 12 descent = .false. maximum_increments = 4000 /"
        out = self.run_text(DISK.format(step=step).replace("40.0", "5.0") + "&accuracy target = 1e-4 monitor = 'w' most_meshes = 2 /\n").stdout
        self.assertIn("the path is run anew", out)
        rows = [row for row in self.rows("history") if float(row["mesh"]) == 2]
        self.assertGreater(len(rows), 1)
        self.assertEqual(rows[0]["increment"], "1")
        self.assertAlmostEqual(float(rows[-1]["load_factor"]), 1.0, delta=1e-12)

    def test_concentration_at_a_hole(self):
        """Stress at a hole comes near to three times that of the sheet; the pull is what was applied, on every mesh."""
        self.run_text(HOLE + "&accuracy target = 0.004 /\n")
        history = self.rows("history")
        for row in history:
            self.assertAlmostEqual(float(row["pull"]), -20.0, delta=1e-8)
        self.assertGreater(float(history[-1]["peak"]), 2.75)
        self.assertLess(float(history[-1]["peak"]), 3.02)

    def test_limits(self):
        """What ends it before the target is said."""
        for limit, words in (("most_elements = 200", "200 are allowed (most_elements)"), ("most_meshes = 2", "2 meshes are the most"),
                             ("budget = 1e-3", "budget")):
            out = self.run_text(ROOF + f"&accuracy target = 1e-4 {limit} /\n").stdout
            self.assertIn("MISSES the target", out)
            self.assertIn(words, out)
            self.assertLessEqual(int(self.rows()[-1]["elements"]), 200)

    def test_refused(self):
        """Wrong input: line, what was found, what is expected."""
        last = len(ROOF.splitlines()) + 1
        stress = "&monitor name = 's' quantity = 'thickness_stretch' /\n"
        for text, expected in ((ROOF + "&accuracy target = 0 /\n", f"model.nml:{last}: &accuracy target"),
                               (ROOF + "&accuracy monitor = 'v' /\n", f"model.nml:{last}: &accuracy monitor: there is no monitor 'v'; there are: w"),
                               (ROOF + stress + "&accuracy monitor = 's' /\n", "found 's', which is not the mean of a displacement"),
                               (ROOF + "&accuracy budgett = 1 /\n", "budgett"),
                               (ROOF + "&accuracy /\n&accuracy /\n", "there can be only one such group"),
                               (ROOF + "&step /\n&accuracy /\n", "either all steps are linear or none"),
                               (ROOF + "&step control = 'buckling' /\n&accuracy /\n", "modes have no estimate"),
                               (ROOF + "&step control = 'dynamic' duration = 1 /\n&accuracy /\n", "a motion cannot go on"),
                               (ROOF + "&accuracy coarser = 1 /\n", f"model.nml:{last}: &accuracy coarser: linear steps follow no path: nothing would be saved"),
                               (ROOF + "&accuracy coarser = 9 /\n", f"model.nml:{last}: &accuracy coarser"),
                               (PLATE.replace("32, 16", "6, 4") + "&accuracy coarser = 2 /\n", "multiples of 4, found 6 (coarser = 2 in &accuracy)"),
                               (PLATE + "&node_set name = 'one' nodes = 1 /\n&accuracy coarser = 1 /\n", "cannot become coarser (coarser = 1 in &accuracy)"),
                               (ROOF.replace("'w'", "'mesh'") + "&accuracy /\n", "called 'mesh'"),
                               (ROOF + "&load type = 'force' node_set = 'edge_a1' vector = 1, 0, 0 /\n&accuracy /\n",
                                f"model.nml:{last}: &load: with &accuracy it cannot act at the nodes of 'edge_a1'")):
            result = self.run_text(text, code=2)
            self.assertIn(expected, result.stderr)

    def test_study_refines_as_a_whole(self):
        """A study of the same input takes no notice of the group."""
        self.run_text(ROOF + "&accuracy target = 0.001 monitor = 'w' /\n", "--levels", "2", command="study")
        self.assertEqual([row["elements"] for row in self.rows("study")], ["32", "128"])

    def test_numbers_files_and_sections(self):
        """Sets by number, two sections, a mesh that is refined beforehand: areas and loads stay, mesh by mesh."""
        text = """&mesh generator = 'rectangle' lengths = 2, 1 divisions = 4, 2 refine = 1 /
&element_set name = 'left' elements = 1, 2, 3, 4 /
&element_set name = 'right' elements = 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16 /
&node_set name = 'end' nodes = 1, 2, 3 /
&material name = 'm' law = 'linear_elastic' e = 1e5 nu = 0.3 /
&section element_set = 'right' thickness = 0.1 /
&section element_set = 'left' thickness = 0.2 /
&support node_set = 'end' type = 'clamped' /
&load type = 'pressure' pressure = 0.1 /
&load type = 'line' edge_set = 'edge_x1' vector = 0, 3, 0 /
&step /
&monitor name = 'r' quantity = 'reaction' component = 'y' node_set = 'end' /
"""
        self.run_text(text + "&accuracy target = 0.08 /\n")
        self.assertGreater(len(self.rows()), 1)
        for row in self.rows("history"):
            self.assertAlmostEqual(float(row["r"]), -3 * float(row["load_factor"]), delta=0.05)


if __name__ == "__main__":
    unittest.main(verbosity=2)
