#!/usr/bin/env python3
"""Files of meshes through the program: one plate in every format gives one answer; orientation, sets of the boundary, junctions."""
import csv
import math
import os
import struct
import subprocess
import tempfile
import unittest
from pathlib import Path

N = 4  # cells along each side of the plate, 2 x 1
REST = """&material name = 'm' law = 'linear_elastic' e = 1000.0 nu = 0.3 /
&section thickness = 0.05 /
&support node_set = '{0}' type = 'clamped' /
&load type = 'pressure' pressure = 0.001 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'all' /
&step control = 'linear' /
"""


def nodes():
    return [(2 * i / N, j / N, 0.0) for j in range(N + 1) for i in range(N + 1)]


def cells():
    return [(j * (N + 1) + i + 1, j * (N + 1) + i + 2, (j + 1) * (N + 1) + i + 2, (j + 1) * (N + 1) + i + 1)
            for j in range(N) for i in range(N)]


def triangles():
    return [t for a, b, c, d in cells() for t in ((a, b, c), (a, c, d))]


def msh41(elements, kind):
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$Nodes", f"1 {len(nodes())} 1 {len(nodes())}", f"2 1 0 {len(nodes())}"]
    lines += [str(i + 1) for i in range(len(nodes()))] + ["{} {} {}".format(*x) for x in nodes()]
    lines += ["$EndNodes", "$Elements", f"1 {len(elements)} 1 {len(elements)}", f"2 1 {kind} {len(elements)}"]
    return "\n".join(lines + [" ".join(map(str, (i + 1, *e))) for i, e in enumerate(elements)] + ["$EndElements", ""])


def msh22(elements):
    lines = ["$Comments", "by hand", "$EndComments", "$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(nodes()))]
    lines += [f"{i + 1} {x} {y} {z}" for i, (x, y, z) in enumerate(nodes())]
    lines += ["$EndNodes", "$Elements", str(len(elements))]
    return "\n".join(lines + [" ".join(map(str, (i + 1, 2, 2, 1, 1, *e))) for i, e in enumerate(elements)] + ["$EndElements", ""])


def stl_text():
    x = nodes()
    facets = ["facet normal 0 0 1\n outer loop\n" + "".join("  vertex {} {} {}\n".format(*x[i - 1]) for i in t)
              + " endloop\nendfacet\n" for t in triangles()]
    return "solid plate\n" + "".join(facets) + "endsolid plate\n"


def stl_binary():
    x = nodes()
    body = b"".join(struct.pack("<12fH", 0, 0, 1, *(c for i in t for c in x[i - 1]), 0) for t in triangles())
    return b"solid, though in bytes".ljust(80) + struct.pack("<I", len(triangles())) + body


def deck(kind="S3", elements=None, further=""):
    lines = ["** by hand", "*HEADING", "a plate", "*NODE, NSET=NALL"]
    lines += [f"{i + 1}, {x}, {y}, {z}" for i, (x, y, z) in enumerate(nodes())]
    lines += [f"*ELEMENT, TYPE={kind}, ELSET=EALL"]
    lines += [", ".join(map(str, (i + 1, *e))) for i, e in enumerate(elements or triangles())]
    lines += ["*NSET, NSET=Root, GENERATE", f"1, {1 + N * (N + 1)}, {N + 1}", "*ELEMENT, TYPE=C3D4", "900, 1, 2, 3, 4", further, ""]
    return "\n".join(lines)


class MeshFiles(unittest.TestCase):
    def solve(self, name, content, support="boundary_1_4", more="", code=0, rest=REST, command="run"):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / name
            if isinstance(content, bytes):
                path.write_bytes(content)
            else:
                path.write_text(content)
            (Path(folder) / "t.nml").write_text(f"&mesh file = '{name}' {more} /\n" + rest.format(support))
            run = subprocess.run([os.environ["FINSHELL_BIN"], command, "t.nml"], cwd=folder, capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, code, run.stdout + run.stderr)
            if code or command != "run":
                return run.stdout + run.stderr
            rows = list(csv.DictReader((Path(folder) / "t.history.csv").read_text().splitlines()))
            return float(rows[-1]["w"]), run.stdout

    def test_one_plate(self):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "t.nml").write_text(f"&mesh generator = 'rectangle' lengths = 2, 1 divisions = {N}, {N} diagonal = 'forward' /\n"
                                                + REST.format("edge_x0"))
            subprocess.run([os.environ["FINSHELL_BIN"], "run", "-q", "t.nml"], cwd=folder, check=True)
            right = float(list(csv.DictReader((Path(folder) / "t.history.csv").read_text().splitlines()))[-1]["w"])
        for name, content, support in (("a.msh", msh41(triangles(), 2), "boundary_1_4"), ("b.msh", msh22(triangles()), "boundary_1_4"),
                                       ("c.msh", msh41(cells(), 3), "boundary_1_4"), ("d.stl", stl_text(), "boundary_1_4"),
                                       ("e.STL", stl_binary(), "boundary_1_4"), ("f.inp", deck(), "Root"),
                                       ("g.inp", deck("S4R", cells()), "Root")):
            with self.subTest(name):
                w, printed = self.solve(name, content, support)
                self.assertAlmostEqual(w / right, 1.0, delta=1e-6 if name.lower().endswith("stl") else 1e-12)
                if name in ("c.msh", "g.inp"):
                    self.assertIn(f"{N * N} quadrilaterals were cut", printed)
                if name.endswith("inp"):
                    self.assertIn("1 elements that are no surfaces were left out", printed)

    def test_sides_of_shells(self):
        """S3 to S6 are sides of shells in CalculiX, S1 to S4 those of plane elements; faces make an element set."""
        further = "*SURFACE, NAME=Side, TYPE=ELEMENT\n1, {}\n3, {}"
        for kind, elements, face, words in (("S3", None, "S3", "Side: 2 edges"), ("S4", cells(), "S6", "Side: 2 edges"), ("S3", None, "SPOS", "Side: 2\n"),
                                            ("CPS3", None, "S3", "Side: 2 edges")):
            with self.subTest(kind=kind, face=face):
                self.assertIn(words, self.solve("s.inp", deck(kind, elements, further.format(face, face)), "Root", command="mesh"))

    def test_written_mesh(self):
        """What `finshell mesh` says and writes: the file is a mesh of the same sets, and gives the same answer."""
        model = f"&job name = 'p' /\n&mesh generator = 'hole' lengths = 2, 1 radius = 0.3 divisions = 4, 4 /\n"
        model += "&element_set name = 'far' x = 1.0, 2.0 /\n&node_set name = 'some' x = 0.0, 0.5 /\n" + REST.format("edge_x0").replace(
            "element_set = 'all'", "element_set = 'far'")
        with tempfile.TemporaryDirectory() as folder:
            def run(*arguments, code=0):
                result = subprocess.run([os.environ["FINSHELL_BIN"], *arguments], cwd=folder, capture_output=True, text=True, check=False)
                self.assertEqual(result.returncode, code, result.stdout + result.stderr)
                return result.stdout + result.stderr
            (Path(folder) / "p.nml").write_text(model)
            said = run("mesh", "p.nml")
            for words in ("1 connected part, area 1.93", "x from 0.0", "to 2.0", "smallest angle", "0 edges of more than two", "free edges", "  far: ", "  some: ",
                          "Written: p.msh"):
                self.assertIn(words, said.replace("E+00", "").replace(".000000", ".0"))
            run("run", "-q", "p.nml")
            (Path(folder) / "again.nml").write_text("&mesh file = 'p.msh' /\n" + "\n".join(
                line for line in model.splitlines() if not line.startswith(("&job", "&mesh", "&node_set", "&element_set"))))
            run("run", "-q", "again.nml")
            rows = [list(csv.DictReader((Path(folder) / f"{name}.history.csv").read_text().splitlines()))[-1] for name in ("p", "again")]
            self.assertAlmostEqual(float(rows[0]["w"]) / float(rows[1]["w"]), 1, delta=1e-9)
            again = run("mesh", "again.nml", "-o", ".")
            for line in said.splitlines():
                if line.startswith("  "):
                    self.assertIn(line, again)
            # a mesh that finshell has not written stays what it is, above all the one that the input reads
            foreign = "".join((Path(folder) / "p.msh").read_text().splitlines(keepends=True)[3:])
            (Path(folder) / "again.msh").write_text(foreign)
            self.assertIn("again.msh: the file is there already, and finshell has not written it; take another name", run("mesh", "again.nml", code=2))
            self.assertEqual((Path(folder) / "again.msh").read_text(), foreign)
            self.assertIn("cannot" if os.getuid() else "nowhere", run("mesh", "p.nml", "-o", "nowhere", code=2) + "cannot")

    def test_deck(self):
        further = ("*ELSET, ELSET=first\n1, 2,\n 3\n*ELSET, ELSET=more\nfirst, 4\n*SURFACE, NAME=tip\n"
                   + "".join(f"{2 * (N * j + N) - 1}, E2\n" for j in range(N)) + "*SURFACE, TYPE=NODE, NAME=rooty\nroot")
        load = REST.replace("&load", "&load type = 'traction' element_set = 'more' vector = 0, 0, 0.001 /\n"
                                     "&load type = 'line' edge_set = 'tip' vector = 0, 0, 0.01 /\n&load")
        self.solve("a.inp", deck(further=further), "rooty", rest=load)
        for text, message in ((deck(further="*NSET, NSET=x\nnone"), "found 'none' where a number or the name of a set"),
                              (deck(further="*ELEMENT, TYPE=S3\n77, 1, 2"), "has its number and 3 nodes, found 2 nodes"),
                              (deck(further="*ELEMENT, TYPE=S3\n1, 1, 2, 3"), "the element 1 is there twice"),
                              (deck(further="*ELEMENT, TYPE=S3\n77, 1, 2, 99"), "element 77 refers to the node 99, which does not exist"),
                              (deck(further="*NODE\n5, x"), "a node number and up to three coordinates are expected"),
                              (deck(further="*INCLUDE, INPUT=none.inc"), "none.inc"),
                              (deck(further="*INCLUDE, INPUT=a.inp"), "does one include itself?"),
                              ("*NODE\n1, 0, 0, 0\n", "the deck has no shells"), ("no deck\n", "this is no deck"), ("", "no shells")):
            with self.subTest(message):
                self.assertIn(message, self.solve("a.inp", text, code=2))

    def test_deck_from_parts(self):
        part = "*PART, NAME=p\n" + deck() + "*END PART\n*ASSEMBLY, NAME=a\n*INSTANCE, NAME=i, PART=p\n{}*END INSTANCE\n" \
            "*NSET, NSET=rim, INSTANCE=i\n1\n*NSET, NSET=again\ni.rim\n*END ASSEMBLY\n"
        self.solve("a.inp", part.format(""), "Root")
        self.assertIn("an instance that is moved", self.solve("a.inp", part.format("1.0, 0., 0.\n"), code=2))

    def test_stl_refusals(self):
        for text, message in (("", "the file is empty"), ("solid\nendsolid\n", "has no triangles"),
                              ("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 z\n", "a.stl:4: found 'z' where a number"),
                              ("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "the file ends too early"),
                              ("rubbish", "a.stl:1: found 'rubbish' where solid is expected")):
            with self.subTest(message):
                self.assertIn(message, self.solve("a.stl", text, code=2))
        said = self.solve("a.vtu", "", code=2)
        self.assertIn("files of this kind are not read; make a Gmsh file of it: finshell-mesh", said)
        self.assertIn("finshell-mesh a.vtu a.msh", said)

    def test_orientation(self):
        turned = [t if i % 3 else t[::-1] for i, t in enumerate(triangles())]
        self.assertIn("orient = .true.", self.solve("a.msh", msh41(turned, 2), code=2))
        w, _ = self.solve("a.msh", msh41(triangles(), 2))
        for more, sign in (("orient = .true.", 1), ("orient_toward = 1, 0.5, 9", 1), ("orient_toward = 1, 0.5, -9", -1),
                           ("orient = .true. flip = .true.", -1)):
            # the loop of the boundary runs the other way round where triangles are turned: its sides are numbered the other way
            again, _ = self.solve("a.msh", msh41(turned, 2), "boundary_1_4" if sign > 0 else "boundary_1_1", more)
            self.assertAlmostEqual(again / w, sign, delta=1e-9, msg=more)
        strip = [(math.cos(2 * math.pi * i / 12) * (3 + s * math.cos(math.pi * i / 12)),
                  math.sin(2 * math.pi * i / 12) * (3 + s * math.cos(math.pi * i / 12)), s * math.sin(math.pi * i / 12))
                 for i in range(12) for s in (-1, 1)]
        ends = [(2 * i + 1, 2 * i + 2, 2 * i + 3, 2 * i + 4) if i < 11 else (23, 24, 2, 1) for i in range(12)]
        moebius = "*NODE\n" + "".join(f"{i + 1}, {x}, {y}, {z}\n" for i, (x, y, z) in enumerate(strip)) + "*ELEMENT, TYPE=S3\n" \
            + "".join(f"{2 * i + 1}, {a}, {b}, {c}\n{2 * i + 2}, {b}, {d}, {c}\n" for i, (a, b, c, d) in enumerate(ends))
        self.assertIn("one side only", self.solve("m.inp", moebius, code=2, more="orient = .true."))

    def test_junction(self):
        """A third plate, on which nothing acts, at the joint of two changes nothing; three plates share a load by their stiffness."""
        def frame(third):
            text = "*NODE\n"
            lines = {}
            for name, points in (("a", [(-1 + i / 4, 0.0) for i in range(5)]), ("b", [(0.0, -i / 4) for i in range(1, 5)]),
                                 ("c", [(i / 4, 0.0) for i in range(1, 5)])):
                for x, z in points:
                    for y in (0, 0.5):
                        lines.setdefault(name, []).append(len(text.splitlines()))
                        text += f"{len(text.splitlines())}, {x}, {y}, {z}\n"
            joint = lines["a"][-2:]
            text += "*ELEMENT, TYPE=S3, ELSET=E\n"
            e = 0
            for name in "abc" if third else "ab":
                strip = lines[name] if name == "a" else joint + lines[name]
                for k in range(0, len(strip) - 2, 2):
                    for t in ((strip[k], strip[k + 2], strip[k + 3]), (strip[k], strip[k + 3], strip[k + 1])):
                        e += 1
                        text += f"{e}, {t[0]}, {t[1]}, {t[2]}\n"
            return text + "*NSET, NSET=root\n{}, {}\n*NSET, NSET=tip\n{}, {}\n".format(*lines["a"][:2], *lines["b"][-2:])
        rest = """&material name = 'm' law = 'linear_elastic' e = 1000.0 nu = 0.0 /
&section thickness = 0.1 /
&support node_set = 'root' type = 'clamped' /
&support node_set = 'all' fixed = 'uy', 'rx', 'rz' /
&load type = 'force' node_set = 'tip' vector = 0.05, 0, 0 /
&monitor name = 'w' quantity = 'displacement' component = 'x' node_set = 'tip' /
&step control = 'load' tolerance = 'tight' /
"""
        two, _ = self.solve("a.inp", frame(False), rest=rest)
        three, _ = self.solve("a.inp", frame(True), rest=rest)
        # cells cut one way twist by a little, which the third plate resists
        self.assertAlmostEqual(three / two, 1, delta=1e-4)
        # an angle of two legs: P L^3/3EI of the second and P L^2 . L/EI by the rotation of the joint
        self.assertAlmostEqual(self.solve("a.inp", frame(True), rest=rest.replace("'load'", "'linear'").replace("tolerance = 'tight'", ""))[0],
                               0.1 * (1 / 3 + 1) / (1000 * 0.5 * 0.1**3 / 12), delta=0.1)
        held = rest.replace("&load", "&support node_set = 'junction' fixed = 'ux', 'uz' /\n&load")
        self.solve("a.inp", frame(True), rest=held)
        self.assertIn("more than two triangles meet", self.solve("a.inp", frame(True), code=2, rest=rest + "&accuracy target = 0.1 /\n"))


    def test_conversion(self):
        """A deck as a namelist: what is taken gives the answers of theory, what is not is said with its line."""
        model = deck("S4", cells()).replace("*NSET, NSET=Root", "*NSET, NSET=tip, GENERATE\n{0}, {1}, {0}\n*NSET, NSET=Root".format(N + 1, (N + 1)**2))
        corner = (N + 1)**2
        def convert(cards, more=""):
            with tempfile.TemporaryDirectory() as folder:
                (Path(folder) / "d.inp").write_text(model + cards)
                command = [os.environ["FINSHELL_BIN"], "convert", "d.inp"]
                run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
                self.assertEqual(run.returncode, 0, run.stderr)
                text = (Path(folder) / "d.nml").read_text()
                self.assertEqual(subprocess.run(command, cwd=folder, capture_output=True, check=False).returncode, 2)  # it is there
                (Path(folder) / "d.nml").write_text(text + more)
                again = subprocess.run([os.environ["FINSHELL_BIN"], "run", "d.nml"], cwd=folder, capture_output=True, text=True, check=False)
                self.assertEqual(again.returncode, 0, text + again.stderr)
                rows = list(csv.DictReader((Path(folder) / "d.history.csv").read_text().splitlines()))
                return rows, text, run.stdout
        # uniform tension of an Ogden rubber: the stretch by bisection; Abaqus' constants are 2 mu/alpha of ours
        constants = ((63.0, 1.3), (-1.0, -2.0))
        low, high = 1.0, 2.0
        for _ in range(60):
            middle = (low + high) / 2
            force = sum(2 * m / a * (middle**(a - 1) - middle**(-a / 2 - 1)) for m, a in constants)
            low, high = (middle, high) if force < 16 else (low, middle)
        loads = f"tip, 1, {0.8 / N}\n{N + 1}, 1, {-0.4 / N}\n{corner}, 1, {-0.4 / N}\n"
        monitors = "".join(f"&monitor name = '{c}' quantity = 'displacement' component = '{c}' node_set = 'tip' /\n" for c in "xz")
        monitors += f"&node_set name = 'corner' nodes = {corner} /\n&monitor name = 'y' quantity = 'displacement' component = 'y' node_set = 'corner' /\n"
        rubber = ("*MATERIAL, NAME=Rubber\n*HYPERELASTIC, OGDEN, N=2\n63.0, 1.3, -1.0, -2.0, 1e-5, 0.\n*DENSITY\n1e-3\n"
                  "*SHELL SECTION, ELSET=Eall, MATERIAL=rubber\n0.05, 5\n*BOUNDARY\nroot, 1\n1, 2\nNALL, 3, 6\n"
                  "*AMPLITUDE, NAME=a\n0., 0., 1., 1.\n")
        step = "*STEP, NLGEOM\n*STATIC\n0.25, 1.\n{}\n{}*END STEP\n"
        rows, text, printed = convert(rubber + step.format("*CLOAD, AMPLITUDE=a", loads), monitors)
        self.assertAlmostEqual(float(rows[-1]["x"]), 2 * (low - 1), delta=1e-6)
        self.assertAlmostEqual(float(rows[-1]["y"]), low**-0.5 - 1, delta=1e-6)
        self.assertIn("*HYPERELASTIC: compressibility", printed)
        self.assertIn("*HYPERELASTIC: compressibility", text)
        self.assertNotIn("amplitude", text)   # a straight line is what the load factor does
        self.assertIn("density = 1.0E-03", text)
        # pressure: along the normal on elements, against it on their outer side; supports by name; layers, directions, offset
        plate = ("*MATERIAL, NAME=ply\n*ELASTIC, TYPE=LAMINA\n25., 1., 0.25, 0.5, 0.5, 0.2\n*ORIENTATION, NAME=o\n0., 1., 0., -1., 0., 0.\n3, 0.\n"
                 "*SURFACE, NAME=top\neall, SPOS\n*BOUNDARY\nroot, ENCASTRE\n{}, XSYMM\n" + "*SHELL SECTION, ELSET=Eall, COMPOSITE{}\n"
                 "0.01, 3, ply, 0.\n0.03, 3, ply, 90.\n*STEP\n*STATIC\n").format("tip", "{}")
        values = []
        for card, offset in (("*DLOAD\neall, P, 0.001\n", ""), ("*DSLOAD\ntop, P, -0.001\n", ""), ("*DLOAD\neall, P, 0.001\n", ", ORIENTATION=o")):
            rows, text, printed = convert(plate.format(offset) + card + "*END STEP\n*STEP\n*STATIC\n*DLOAD\neall, P, 1.\n*END STEP\n", monitors)
            values.append(float(rows[0]["z"]))
            self.assertNotIn("NOT TAKEN", printed)
            self.assertEqual(text.count("control = 'linear'"), 2)
            self.assertEqual([text.count(f"{key} = ") for key in ("until_step", "from_step")], [1, 1])
        self.assertAlmostEqual(values[0], values[1], delta=1e-12)
        self.assertGreater(values[0], 0)
        self.assertIn("direction = .0, 1.0, .0", text)
        for card, group in (("*BUCKLE\n3", "control = 'buckling' modes = 3"), ("*FREQUENCY\n5", "control = 'frequencies' modes = 5"),
                            ("*STATIC, RIKS\n0.1, 1., , , 2.5", "control = 'arc_length' first_increment = .1 load_factor = 2.5"),
                            ("*DYNAMIC\n0.1, 2.", "control = 'dynamic' duration = 2.0 first_increment = .1")):
            with tempfile.TemporaryDirectory() as folder:
                (Path(folder) / "d.inp").write_text(model + rubber + f"*STEP, NLGEOM\n{card}\n*DLOAD\nEall, P, 1.\n*END STEP\n")
                subprocess.run([os.environ["FINSHELL_BIN"], "convert", "d.inp"], cwd=folder, capture_output=True, check=True)
                self.assertIn(group, (Path(folder) / "d.nml").read_text())
        # the stiff layer lies across in the other direction: plies of 25 and 1 change places
        self.assertNotAlmostEqual(values[2] / values[0], 1, delta=0.01)
        self.assertIn("offset = -.01", convert(plate.format(", OFFSET=0.25") + "*DLOAD\n, P, 0.001\n*END STEP\n")[1])


if __name__ == "__main__":
    unittest.main()
