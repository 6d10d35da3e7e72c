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
        self.assertIn("meshio convert", self.solve("a.vtu", "", code=2))

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


if __name__ == "__main__":
    unittest.main()
