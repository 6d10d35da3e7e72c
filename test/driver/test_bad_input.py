#!/usr/bin/env python3
"""Wrong input is answered with file, line, what was found and what was expected, and with exit code 2; nothing is lost."""
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
DATA = Path(os.environ["FINSHELL_SOURCE_DIR"]) / "test" / "data"
GOOD = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 1 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0e6 /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'force' node_set = 'edge_x1' vector = 0.0, 0.0, 1.0 total = .true. /
&step load_factor = 1.0 /
&monitor name = 'tip' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
"""
MESH = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
1
2 1 "sheet"
$EndPhysicalNames
$Entities
0 0 1 0
1 0 0 0 1 1 0 1 1 0
$EndEntities
$Nodes
1 {n} 1 {n}
2 1 0 {n}
{numbers}
{points}
$EndNodes
$Elements
1 {m} 1 {m}
2 1 2 {m}
{triangles}
$EndElements
"""


def gmsh(points, triangles):
    return MESH.format(n=len(points), m=len(triangles), numbers="\n".join(str(i + 1) for i in range(len(points))),
                       points="\n".join("{} {} {}".format(*p) for p in points),
                       triangles="\n".join("{} {} {} {}".format(i + 1, *t) for i, t in enumerate(triangles)))


class BadInput(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def run_text(self, text, command="run", name="model.nml"):
        path = Path(self.folder.name) / name
        path.write_text(text)
        return subprocess.run([PROGRAM, command, name], cwd=self.folder.name, capture_output=True, text=True, timeout=300, check=False)

    def refuse(self, text, *words, code=2, command="run"):
        result = self.run_text(text, command)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)
        self.assertNotIn("Backtrace", result.stderr)
        return result

    def swap(self, old, new):
        self.assertIn(old, GOOD)
        return GOOD.replace(old, new)

    def test_the_good_one_is_good(self):
        self.assertEqual(self.run_text(GOOD).returncode, 0)
        self.assertEqual(self.run_text(GOOD, "check").returncode, 0)

    def test_unknown_group(self):
        self.refuse(GOOD + "&suport node_set = 'all' /\n", "model.nml:8", "suport", "support")

    def test_unknown_key(self):
        self.refuse(self.swap("thickness = 0.1", "thicknes = 0.1"), "model.nml:3", "thicknes", "thickness")

    def test_wrong_type(self):
        self.refuse(self.swap("thickness = 0.1", "thickness = 'thin'"), "model.nml:3", "thickness", "thin")

    def test_unterminated_group(self):
        self.refuse(GOOD.replace("component = 'z' node_set = 'edge_x1' /", "component = 'z' node_set = 'edge_x1'"), "model.nml:7", "monitor")

    def test_monitors(self):
        def monitor(keys):
            return GOOD + "&monitor name = 'q' " + keys + " /\n"
        self.refuse(monitor("quantity = 'strains' component = '11'"), "model.nml:8", "did you mean 'strain'?")
        self.refuse(monitor("quantity = 'strain'"), "model.nml:8", "component")
        self.refuse(monitor("quantity = 'strain' component = '33'"), "model.nml:8", "11, 22, 12")
        self.refuse(monitor("quantity = 'strain' component = '11' height = 'outside'"), "model.nml:8", "bottom, middle, top")
        self.refuse(monitor("quantity = 'moment' component = '11' height = 'top'"), "model.nml:8", "height")
        self.refuse(monitor("quantity = 'material_stress' component = '11' layer = 2"), "model.nml:8", "layer")
        self.refuse(monitor("quantity = 'energy' reduce = 'max'"), "model.nml:8", "reduce")
        self.refuse(monitor("quantity = 'energy_density' reduce = 'median'"), "model.nml:8", "mean, sum, max, min")
        self.refuse(GOOD + "&output fields = 'energy' /\n", "model.nml:8", "energy_density")

    def test_motion(self):
        good = GOOD.replace("mu = 1.0e6", "mu = 1.0e6 density = 1.0")
        motion = good + "&step control = 'dynamic' duration = 1.0 /\n"
        self.refuse(good + "&initial_velocity velocity = 1, 0, 0 /\n", "model.nml:8: &initial_velocity", "no step goes through time", "'dynamic'")
        self.refuse(motion + "&initial_velocity spin = 0, 0, 0 /\n", "model.nml:9: &initial_velocity", "zero")
        self.refuse(motion + "&initial_velocity spin = 1, 0 /\n", "model.nml:9: &initial_velocity spin", "3")
        self.refuse(motion + "&initial_velocity node_set = 'corner' spin = 1, 0, 0 /\n", "model.nml:9", "corner_x0_y0")
        self.refuse(motion + "&accuracy target = 0.1 /\n", "model.nml:9: &accuracy", "no step goes through time")
        self.refuse(motion + "&monitor name = 'damped' quantity = 'time' /\n", "model.nml:9: &monitor name", "a column 'damped' of its own")
        self.refuse(good + "&monitor name = 'snap' quantity = 'time' /\n", "model.nml:8: &monitor name", "a column 'snap' of its own")
        self.refuse(motion + "&monitor name = 'p' quantity = 'momentum' /\n", "model.nml:9", "component")
        for control in ("linear", "buckling", "frequencies"):
            self.refuse(motion + f"&step control = '{control}' /\n", "model.nml:9: &step: " + control, "in motion", "control = 'load'")
        self.refuse(GOOD + "&step control = 'explicit' duration = 1.0 /\n", "model.nml:8: &step: explicit", "density")

    def test_velocities_of_what_is_held(self):
        text = GOOD.replace("mu = 1.0e6", "mu = 1.0e6 density = 1.0") + "&step control = 'dynamic' duration = 1.0 /\n"
        result = self.run_text(text + "&initial_velocity node_set = 'edge_x0' velocity = 1, 2, 3 /\n", "check")
        self.assertEqual(result.returncode, 0)
        self.assertIn("&initial_velocity: it moves nothing", result.stderr)
        no_load = "\n".join(line for line in text.splitlines() if "&load" not in line) + "\n"
        self.assertIn("nothing acts", self.run_text(no_load, "check").stderr)
        self.assertEqual(self.run_text(no_load + "&initial_velocity velocity = 0, 0, 3 /\n", "check").stderr, "")

    def test_missing_input_file(self):
        result = subprocess.run([PROGRAM, "run", "absent.nml"], cwd=self.folder.name, capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 2)
        self.assertIn("absent.nml", result.stderr)

    def test_missing_mesh_file(self):
        self.refuse(self.swap("generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 1", "file = 'absent.msh'"), "absent.msh")

    def test_unknown_set_lists_the_known(self):
        self.refuse(self.swap("node_set = 'edge_x0'", "node_set = 'edge_x9'"), "model.nml:4", "edge_x9", "edge_x0")

    def test_empty_set(self):
        self.refuse(GOOD + "&node_set name = 'nothing' box = 100.0, 101.0, 0.0, 1.0, 0.0, 1.0 /\n", "model.nml:8")

    def test_unknown_material_and_law(self):
        self.refuse(self.swap("material = 'rubber' thickness", "material = 'steel' thickness"), "model.nml:3", "steel", "rubber")
        self.refuse(self.swap("law = 'neo_hookean'", "law = 'neo_hook'"), "model.nml:2", "neo_hook", "neo_hookean")

    def test_material_parameter(self):
        self.refuse(self.swap("mu = 1.0e6", "mu = -1.0"), "model.nml:2", "mu")

    def test_negative_thickness(self):
        self.refuse(self.swap("thickness = 0.1", "thickness = -0.1"), "model.nml:3", "thickness")

    def test_degenerate_triangle(self):
        mesh = gmsh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0)], [(1, 2, 3), (1, 4, 2)])
        (Path(self.folder.name) / "bad.msh").write_text(mesh)
        self.refuse(self.swap("generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 1", "file = 'bad.msh'"), "bad.msh", "element 2", "degenerate")

    def test_inverted_triangle(self):
        mesh = gmsh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], [(1, 2, 3), (2, 3, 4)])
        (Path(self.folder.name) / "bad.msh").write_text(mesh)
        self.refuse(self.swap("generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 1", "file = 'bad.msh'"), "bad.msh")

    def test_meshes_that_contradict_themselves(self):
        for name, words in (("elcountless", ("elcountless.msh:88: there are 25 elements", "announces 26")),
                            ("lineoff", ("edge set 'c'", "node 1 to node 21", "no edge of an element")),
                            ("flipped", ("element 1 (tag 2) and element 4 (tag 5)", "opposite orientation", "orient = .true."))):
            shutil.copy(DATA / (name + ".msh"), self.folder.name)
            self.refuse(self.swap("generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 1", f"file = '{name}.msh'"), "model.nml:1", *words)

    def test_empty_physical_group(self):
        text = gmsh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(1, 2, 3)]).replace('1\n2 1 "sheet"', '2\n2 1 "sheet"\n1 7 "rim"')
        (Path(self.folder.name) / "rim.msh").write_text(text)
        self.refuse(self.swap("generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 1", "file = 'rim.msh'").replace("edge_x0", "rim"),
                    "model.nml:4", "'rim'", "no elements")

    def test_duplicate_node(self):
        mesh = gmsh([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)], [(1, 2, 3), (5, 4, 3)])
        (Path(self.folder.name) / "bad.msh").write_text(mesh)
        self.refuse(self.swap("generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 1", "file = 'bad.msh'"), "bad.msh", "2", "5", "are duplicates, both at (")

    def test_free_rigid_body_mode_is_named(self):
        free = self.swap("&support node_set = 'edge_x0' type = 'clamped' /", "&support node_set = 'edge_x0' fixed = 'uy', 'uz', 'rx', 'ry', 'rz' /")
        self.refuse(free, "translation", "x")
        hinge = self.swap("type = 'clamped'", "type = 'hinged'")
        self.refuse(hinge, "rotation", "y")

    def test_load_factor_out_of_reach_keeps_what_was_reached(self):
        # a neo-Hookean balloon cap beyond its pressure maximum under load control
        text = """&mesh generator = 'disk' radius = 1.0 rings = 4 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0 /
&section material = 'rubber' thickness = 0.01 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'pressure' pressure = 1.0 /
&step load_factor = 1.0 first_increment = 0.002 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /
"""
        result = self.run_text(text)
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        self.assertIn("load factor", result.stderr)
        self.assertIn("STOPPED EARLY", result.stdout)
        rows = (Path(self.folder.name) / "model.history.csv").read_text().strip().split("\n")
        self.assertGreater(len(rows), 2)
        self.assertNotIn("NaN", rows[-1])
        self.assertTrue((Path(self.folder.name) / "model.vtkhdf").stat().st_size > 1000)

    def test_command_line(self):
        for arguments, words in (([], "command"), (["walk"], "walk"), (["run"], "input file"), (["check", "a", "b"], "'b'"),
                                 (["run", "--fast", "a"], "--fast")):
            result = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False)
            self.assertEqual(result.returncode, 2)
            self.assertIn(words, result.stderr)
        for option, words in (("--help", "finshell run"), ("--version", "finshell ")):
            result = subprocess.run([PROGRAM, option], capture_output=True, text=True, check=False)
            self.assertEqual(result.returncode, 0)
            self.assertIn(words, result.stdout)

    def test_unwritable_folder(self):
        path = Path(self.folder.name) / "model.nml"
        path.write_text(GOOD)
        result = subprocess.run([PROGRAM, "run", "-o", "no_such_folder", "model.nml"], cwd=self.folder.name, capture_output=True, text=True,
                                check=False)
        self.assertEqual(result.returncode, 2)
        self.assertIn("no_such_folder", result.stderr)


if __name__ == "__main__":
    unittest.main()
