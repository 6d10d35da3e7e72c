#!/usr/bin/env python3
"""Joints: ties, rigid bodies, equal displacements and linear equations, against undivided meshes and closed forms."""
import csv
import math
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

MATTER = """&material name = 'm' law = 'st_venant_kirchhoff' e = 1.2e6 nu = {nu} density = 10.0 /
&section thickness = {t} /
"""


def grid(origin, a, b, na, nb, first):
    """Nodes, triangles and edges of a parallelogram: origin + s a + t b."""
    nodes = [[origin[k] + a[k] * i / na + b[k] * j / nb for k in range(3)] for j in range(nb + 1) for i in range(na + 1)]

    def at(i, j):
        return first + j * (na + 1) + i

    triangles = []
    for j in range(nb):
        for i in range(na):
            p, q, r, s = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
            triangles += [[p, q, r], [p, r, s]]
    edges = {
        "x0": [at(0, j) for j in range(nb + 1)],
        "x1": [at(na, j) for j in range(nb + 1)],
        "y0": [at(i, 0) for i in range(na + 1)],
        "y1": [at(i, nb) for i in range(na + 1)],
    }
    return nodes, triangles, edges


def write_deck(path, sheets):
    """A deck of sheets: name -> (origin, a, b, na, nb), with node sets NAME_x0, ... and element sets NAME."""
    nodes, elements, sets = [], {}, {}
    for name, sheet in sheets.items():
        found, triangles, edges = grid(*sheet, len(nodes) + 1)
        nodes += found
        elements[name] = triangles
        sets.update({f"{name}_{edge}": members for edge, members in edges.items()})
    with open(path, "w", encoding="ascii") as f:
        f.write("*NODE\n")
        for i, x in enumerate(nodes, 1):
            f.write(f"{i}, {x[0]!r}, {x[1]!r}, {x[2]!r}\n")
        e = 0
        for name, triangles in elements.items():
            f.write(f"*ELEMENT, TYPE=S3, ELSET={name}\n")
            for triangle in triangles:
                e += 1
                f.write(f"{e}, {triangle[0]}, {triangle[1]}, {triangle[2]}\n")
        for name, members in sets.items():
            f.write(f"*NSET, NSET={name}\n")
            for i in range(0, len(members), 8):
                f.write(", ".join(map(str, members[i : i + 8])) + "\n")


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def call(self, text, threads=1, arguments=("run",)):
        (self.folder / "in.nml").write_text(text, encoding="utf-8")
        return subprocess.run(
            [os.environ["FINSHELL_BIN"], *arguments, "in.nml"],
            cwd=self.folder,
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, "OMP_NUM_THREADS": str(threads)},
        )

    def run_input(self, text, threads=1):
        """Rows of the history."""
        done = self.call(text, threads)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        with open(self.folder / "in.history.csv", encoding="ascii") as f:
            return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(f)]

    def refused(self, text, *words):
        done = self.call(text, arguments=("check",))
        self.assertNotEqual(done.returncode, 0, done.stdout)
        for word in words:
            self.assertIn(word, done.stderr)


class TestTies(Case):
    WHOLE = {"a": ((0, 0, 0), (4, 0, 0), (0, 1, 0), 8, 2)}
    HALVES = {"a": ((0, 0, 0), (2, 0, 0), (0, 1, 0), 4, 2), "b": ((2, 0, 0), (2, 0, 0), (0, 1, 0), 4, 2)}

    def bent(self, sheets, end, tie="", threads=1, extra=""):
        write_deck(self.folder / "sheets.inp", sheets)
        return self.run_input(
            "&mesh file = 'sheets.inp' /\n"
            + MATTER.format(nu=0.3, t=0.1)
            + tie
            + f"""
&support node_set = 'a_x0' type = 'clamped' /
&load type = 'force' node_set = '{end}' vector = 0.0, 2.0, 10.0 /
&step tolerance = 'tight' /
&monitor name = 'y' quantity = 'displacement' component = 'y' node_set = '{end}' /
&monitor name = 'z' quantity = 'displacement' component = 'z' node_set = '{end}' /
&monitor name = 'm' quantity = 'reaction_moment' component = 'y' node_set = 'a_x0' /
"""
            + extra,
            threads,
        )

    def test_halves_are_the_whole(self):
        whole = self.bent(self.WHOLE, "a_x1")
        tied = self.bent(self.HALVES, "b_x1", "&tie node_set = 'b_x0' to_node_set = 'a_x1' /")
        other = self.bent(self.HALVES, "b_x1", "&tie node_set = 'a_x1' to_node_set = 'b_x0' /")
        for key in ("y", "z", "m"):
            self.assertAlmostEqual(tied[-1][key] / whole[-1][key], 1, delta=1e-10)
            self.assertAlmostEqual(other[-1][key] / whole[-1][key], 1, delta=1e-10)

    def test_supports_of_tied_nodes(self):
        """A support may be given on either side, or on both."""
        whole = self.bent(self.WHOLE, "a_x1", extra="&support node_set = 'a_y0' fixed = 'uy' /\n")
        for sets in ("'a_y0', 'b_y0'", "'b_y0', 'a_y0'"):
            tied = self.bent(
                self.HALVES,
                "b_x1",
                "&tie node_set = 'b_x0' to_node_set = 'a_x1' /",
                extra=f"&support node_set = {sets} fixed = 'uy' /\n",
            )
            self.assertAlmostEqual(tied[-1]["z"] / whole[-1]["z"], 1, delta=1e-10)

    def test_modes(self):
        """Frequencies about a bent state are those of the undivided mesh."""
        found = []
        for sheets, end, tie in ((self.WHOLE, "a_x1", ""), (self.HALVES, "b_x1", "&tie node_set = 'b_x0' to_node_set = 'a_x1' /")):
            found.append(self.bent(sheets, end, tie, extra="&step control = 'frequencies' modes = 4 /\n"))
            found[-1] = [row["load_factor"] for row in found[-1][-4:]]
        for whole, tied in zip(*found, strict=True):
            self.assertAlmostEqual(tied / whole, 1, delta=1e-7)

    def test_restart(self):
        """A longer input goes on bit for bit."""
        text = (
            "&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 20, 2 /\n"
            + MATTER.format(nu=0.0, t=0.01)
            + """&node name = 'hub' position = 10.0, 0.5, 0.1 /
&rigid_body node_set = 'edge_x1' reference = 'hub' /
&support node_set = 'edge_x0' type = 'clamped' /
&support node_set = 'hub' ry = -1.0 fixed = 'rx', 'rz', 'uy' /
&step load_factor = 1.0 /
&monitor name = 'x' quantity = 'displacement' component = 'x' node_set = 'hub' /
"""
        )
        longer = text + "&step load_factor = 2.0 /\n"
        whole = self.run_input(longer)
        self.run_input(text)
        done = self.call(longer, arguments=("restart", "in"))
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        with open(self.folder / "in.history.csv", encoding="ascii") as f:
            rows = [float(row["x"]) for row in csv.DictReader(f)]
        self.assertEqual(rows, [row["x"] for row in whole])

    def test_threads(self):
        """A mesh large enough for two threads: the same bits."""
        sheets = {"a": ((0, 0, 0), (2, 0, 0), (0, 1, 0), 50, 25), "b": ((2, 0, 0), (2, 0, 0), (0, 1, 0), 46, 22)}
        tie = "&tie node_set = 'b_x0' to_element_set = 'a' /"
        one = self.bent(sheets, "b_x1", tie, threads=1)
        two = self.bent(sheets, "b_x1", tie, threads=2)
        self.assertEqual([(r["y"], r["z"], r["m"]) for r in one], [(r["y"], r["z"], r["m"]) for r in two])

    def test_other_mesh(self):
        """Bending across a tie of meshes that do not match: within the error of the meshes."""
        whole = self.bent({"a": ((0, 0, 0), (4, 0, 0), (0, 1, 0), 16, 4)}, "a_x1")
        sheets = {"a": ((0, 0, 0), (2, 0, 0), (0, 1, 0), 8, 4), "b": ((2, 0, 0), (2, 0, 0), (0, 1, 0), 9, 4)}
        tied = self.bent(sheets, "b_x1", "&tie node_set = 'b_x0' to_element_set = 'a' /")
        self.assertAlmostEqual(tied[-1]["z"] / whole[-1]["z"], 1, delta=2e-3)

    def test_patch_across_a_tie(self):
        """Constant strain passes a tie of a mesh twice as fine: a strip in tension, without drilling."""
        write_deck(
            self.folder / "sheets.inp",
            {"a": ((0, 0, 0), (2, 0, 0), (0, 1, 0), 4, 2), "b": ((2, 0, 0), (2, 0, 0), (0, 1, 0), 5, 4)},
        )
        row = self.run_input(
            "&mesh file = 'sheets.inp' /\n"
            + MATTER.format(nu=0.0, t=0.1)
            + """&tie node_set = 'b_x0' to_element_set = 'a' rotations = .false. /
&support node_set = 'a_x0' type = 'clamped' /
&support node_set = 'all' fixed = 'rx', 'ry', 'rz' /
&support node_set = 'b_x1' ux = 0.4 /
&step tolerance = 'tight' /
&monitor name = 'n' quantity = 'reaction' component = 'x' node_set = 'b_x1' /
&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'a_x1' /
"""
        )[-1]
        stretch = 1.1
        self.assertAlmostEqual(row["u"], 0.2, delta=1e-9)
        self.assertAlmostEqual(row["n"], 1.2e6 * 0.1 * 0.5 * (stretch**2 - 1) * stretch, delta=1e-4)

    def test_hinge(self):
        """Two halves on three lines of support, tied without rotation: each is a beam of its own."""
        write_deck(self.folder / "sheets.inp", self.HALVES)
        text = (
            "&mesh file = 'sheets.inp' /\n"
            + MATTER.format(nu=0.0, t=0.1)
            + """&tie node_set = 'b_x0' to_node_set = 'a_x1' {} /
&support node_set = 'a_x0' type = 'hinged' /
&support node_set = 'b_x1', 'a_x1' fixed = 'uz' /
&load type = 'moment' node_set = 'b_x1' vector = 0.0, 1.0e-4, 0.0 total = .true. /
&step control = 'linear' /
&monitor name = 'ry' quantity = 'rotation' component = 'y' node_set = 'b_x1' /
"""
        )
        hinged = self.run_input(text.format("rotations = .false."))[-1]["ry"]
        tied = self.run_input(text.format(""))[-1]["ry"]
        self.assertAlmostEqual(hinged, 1e-4 * 2 / (3 * 100), delta=5e-2 * hinged)
        self.assertAlmostEqual(tied / hinged, 0.875, delta=1e-2)

    def test_past_a_limit_point(self):
        """Negative pivots and the path of a panel that snaps through are those of the undivided mesh."""

        def arch(parts):
            nodes = [
                (10 * math.sin(0.1 * (x - 2)), y, 10 * math.cos(0.1 * (x - 2)))
                for part in parts
                for y in (0, 1)
                for x in part
            ]
            with open(self.folder / "arch.inp", "w", encoding="ascii") as f:
                f.write("*NODE\n")
                for i, x in enumerate(nodes, 1):
                    f.write(f"{i}, {x[0]!r}, {x[1]!r}, {x[2]!r}\n")
                f.write("*ELEMENT, TYPE=S3, ELSET=arch\n")
                e, first = 0, 1
                for part in parts:
                    n = len(part)
                    for i in range(n - 1):
                        p = first + i
                        for triangle in ((p, p + 1, p + n + 1), (p, p + n + 1, p + n)):
                            e += 1
                            f.write(f"{e}, {triangle[0]}, {triangle[1]}, {triangle[2]}\n")
                    first += 2 * n
                ends = [1, 1 + len(parts[0]), first - 1, first - 1 - len(parts[-1])]
                top = [len(parts[0]), 2 * len(parts[0])]
                if len(parts) == 1:
                    top = [1 + len(parts[0]) // 2, 1 + len(parts[0]) // 2 + len(parts[0])]
                other = [2 * len(parts[0]) + 1, 2 * len(parts[0]) + 1 + len(parts[-1])]
                for name, members in (("ends", ends), ("top", top), ("other", other if len(parts) > 1 else top)):
                    f.write(f"*NSET, NSET={name}\n" + ", ".join(map(str, members)) + "\n")

        def snap(tie):
            return self.run_input(
                "&mesh file = 'arch.inp' normals = 'facet' /\n"
                + MATTER.format(nu=0.0, t=0.02)
                + tie
                + """&support node_set = 'ends' type = 'hinged' /
&load type = 'force' node_set = 'top' vector = 0.0, 0.0, -1.0 /
&step control = 'displacement' node_set = 'top' component = 'z' displacements = -0.05, -0.1, -0.15, -0.2, -0.3, -0.36 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'top' /
"""
            )

        half = 6
        line = [4 * i / (2 * half) for i in range(2 * half + 1)]
        arch([line])
        whole = snap("")
        arch([line[: half + 1], line[half:]])
        tied = snap("&tie node_set = 'other' to_node_set = 'top' /\n")
        for key in ("load_factor", "negative_pivots", "w"):
            for a, b in zip(whole, tied, strict=True):
                self.assertAlmostEqual(a[key], b[key], delta=1e-6 * max(1, abs(a[key])))
        self.assertGreater(max(row["negative_pivots"] for row in tied), 0)


class TestRigidBodies(Case):
    def test_rolled_by_a_moment(self):
        """M L/(EI) = angle, the moment on the reference node of a rigid end."""
        rows = self.run_input(
            "&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 20, 2 /\n"
            + MATTER.format(nu=0.0, t=0.01)
            + f"""&node name = 'hub' position = 10.0, 0.5, 0.0 /
&rigid_body node_set = 'edge_x1' reference = 'hub' /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'moment' node_set = 'hub' vector = 0.0, {-2 * math.pi * 0.1 / 10}, 0.0 /
&step tolerance = 'tight' /
&monitor name = 'x' quantity = 'displacement' component = 'x' node_set = 'hub' /
&monitor name = 'r' quantity = 'rotation' component = 'y' node_set = 'hub' /
"""
        )
        self.assertAlmostEqual(rows[-1]["x"], -10, delta=1e-2)
        self.assertAlmostEqual(rows[-1]["r"], 0, delta=1e-3)

    def test_rolled_by_its_rotation(self):
        rows = self.run_input(
            "&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 20, 2 /\n"
            + MATTER.format(nu=0.0, t=0.01)
            + """&node name = 'hub' position = 10.0, 0.5, 0.0 /
&rigid_body node_set = 'edge_x1' reference = 'hub' /
&support node_set = 'edge_x0' type = 'clamped' /
&support node_set = 'hub' ry = -1.0 fixed = 'rx', 'rz', 'uy' /
&step load_factor = 6.283185307179586 tolerance = 'tight' /
&monitor name = 'x' quantity = 'displacement' component = 'x' node_set = 'hub' /
&monitor name = 'm' quantity = 'reaction_moment' component = 'y' node_set = 'hub' /
"""
        )
        self.assertAlmostEqual(rows[-1]["x"], -10, delta=1e-2)
        for row in rows:
            self.assertAlmostEqual(row["m"] / (-0.1 / 10 * row["load_factor"]), 1, delta=2e-3)

    def test_several_turns(self):
        """Both ends of a sheet turn five times half about an axis beside it: nothing strains."""
        row = self.run_input(
            "&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 4, 2 /\n"
            + MATTER.format(nu=0.3, t=0.1)
            + """&node name = 'left' position = -1.0, 0.5, 0.3 /
&node name = 'right' position = 3.0, 0.5, 0.3 /
&rigid_body node_set = 'edge_x0' reference = 'left' /
&rigid_body node_set = 'edge_x1' reference = 'right' /
&support node_set = 'left', 'right' rx = 1.0 fixed = 'ux', 'uy', 'uz', 'ry', 'rz' /
&step load_factor = 15.707963267948966 tolerance = 'tight' /
&monitor name = 'e' quantity = 'energy' /
&monitor name = 'z' quantity = 'displacement' component = 'z' node_set = 'edge_x0' /
"""
        )[-1]
        self.assertLess(row["e"], 1e-18)
        self.assertAlmostEqual(row["z"], 0.6, delta=1e-12)

    def test_free_rotation(self):
        """A body about a node outside it: momenta, and the energy."""
        for options, accuracy in (("scheme = 'conserving' tolerance = 'tight'", 1e-10), ("", 2e-2)):
            rows = self.run_input(
                "&mesh generator = 'rectangle' lengths = 3.0, 1.0 divisions = 6, 2 /\n"
                + MATTER.format(nu=0.3, t=0.1)
                + f"""&node name = 'hub' position = 0.5, -0.4, 0.3 /
&rigid_body node_set = 'all' reference = 'hub' /
&initial_velocity node_set = 'all' spin = 1.0, 3.0, 0.5 /
&step control = 'dynamic' duration = 5.0 {options} /
"""
            )
            for key in ("momentum", "angular_momentum"):
                start = [rows[0][f"{key}_{c}"] for c in "xyz"]
                for row in rows:
                    change = [row[f"{key}_{c}"] - s for c, s in zip("xyz", start, strict=True)]
                    self.assertLess(math.hypot(*change), accuracy * math.hypot(*start), key)
            self.assertAlmostEqual(rows[-1]["kinetic_energy"] / rows[0]["kinetic_energy"], 1, delta=2e-3)


class TestEquations(Case):
    STRIP = (
        "&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 4, 2 /\n"
        + MATTER.format(nu=0.3, t=0.1)
        + "&support node_set = 'all' fixed = 'uz', 'rx', 'ry', 'rz' /\n"
    )

    def test_periodic_strip(self):
        """A cell between two edges whose displacements differ by those of a node that a support moves; free above and below."""
        row = self.run_input(
            self.STRIP
            + """&node name = 'd' position = 2.0, 2.0, 0.0 /
&equation node_set = 'edge_x1', 'edge_x0', 'd' components = 'ux', 'ux', 'ux' coefficients = 1, -1, -1 /
&equation node_set = 'edge_x1', 'edge_x0', 'd' components = 'uy', 'uy', 'uy' coefficients = 1, -1, -1 /
&support node_set = 'corner_x0_y0' fixed = 'ux', 'uy' /
&support node_set = 'd' ux = 0.2 fixed = 'uy', 'uz' /
&step tolerance = 'tight' /
&monitor name = 'n' quantity = 'reaction' component = 'x' node_set = 'd' /
&monitor name = 'v' quantity = 'displacement' component = 'y' node_set = 'corner_x1_y1' /
"""
        )[-1]
        e11 = 0.5 * (1.1**2 - 1)
        self.assertAlmostEqual(row["n"], 1.2e6 * 0.1 * e11 * 1.1, delta=1e-5)
        self.assertAlmostEqual(row["v"], math.sqrt(1 - 2 * 0.3 * e11) - 1, delta=1e-9)

    def test_equal(self):
        """An edge that stays straight under a force on one of its nodes is pulled as by its sum."""
        row = self.run_input(
            self.STRIP
            + """&equal node_set = 'edge_x1' components = 'ux' /
&support node_set = 'edge_x0' fixed = 'ux' /
&support node_set = 'corner_x0_y0' fixed = 'uy' /
&load type = 'force' node_set = 'corner_x1_y1' vector = 1.0e-3, 0.0, 0.0 /
&step control = 'linear' /
&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'corner_x1_y0' /
"""
        )[-1]
        self.assertAlmostEqual(row["u"] / (1e-3 * 2 / (1.2e6 * 0.1)), 1, delta=1e-9)

    def test_deck(self):
        """*EQUATION becomes &equation, over two lines too; rotations are not taken, and said so."""
        write_deck(self.folder / "d.inp", {"a": ((0, 0, 0), (2, 0, 0), (0, 1, 0), 4, 2)})
        with open(self.folder / "d.inp", "a", encoding="ascii") as f:
            f.write("*MATERIAL, NAME=m\n*ELASTIC\n1.2e6, 0.3\n*SHELL SECTION, ELSET=a, MATERIAL=m\n0.1\n")
            f.write("*BOUNDARY\na_x0, 1, 6\n*EQUATION\n2\n5, 3, 1., 15, 3, -1.\n3\n5, 1, 1.\n15, 1, -2., 10, 1, 1.\n")
            f.write("*EQUATION\n2\n5, 4, 1., 15, 4, -1.\n*EQUATION\n3\n5, 1, 1.\n")
            f.write("*STEP\n*STATIC\n*CLOAD\n5, 3, 1e-3\n*END STEP\n")
        done = subprocess.run(
            [os.environ["FINSHELL_BIN"], "convert", "d.inp"], cwd=self.folder, capture_output=True, text=True, check=False
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        text = (self.folder / "d.nml").read_text(encoding="utf-8")
        self.assertEqual(text.count("&equation"), 2, text)
        self.assertIn("components = 'ux', 'ux', 'ux' coefficients = 1", text)
        self.assertIn("degrees of freedom 1 to 3 are expected: rotations do not add", text)
        self.assertIn("it ends before its last term", text)
        monitors = "".join(
            f"&node_set name = 'n{n}' nodes = {n} /\n"
            f"&monitor name = 'z{n}' quantity = 'displacement' component = 'z' node_set = 'n{n}' /\n"
            for n in (5, 15)
        )
        row = self.run_input(text + monitors)[-1]
        self.assertAlmostEqual(row["z5"] / row["z15"], 1, delta=1e-12)

    def test_redundant(self):
        text = (
            self.STRIP
            + """&equal node_set = 'edge_x1' components = 'ux' /
&equation node_set = 'corner_x1_y0', 'corner_x1_y1' components = 'ux', 'ux' coefficients = 2, -2 /
&support node_set = 'edge_x0' type = 'clamped' /
&support node_set = 'corner_x1_y1' ux = 0.1 /
&step /
"""
        )
        done = self.call(text)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("in.nml:6: &equation: it says what supports or other equations say already", done.stderr + done.stdout)


class TestRefusals(Case):
    SHEET = "&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 4, 2 /\n" + MATTER.format(nu=0.3, t=0.1)
    CLAMP = "&support node_set = 'edge_x0' type = 'clamped' /\n&step /\n"
    HUB = "&node name = 'hub' position = 3.0, 0.5, 0.0 /\n"

    def test_contradiction(self):
        self.refused(
            self.SHEET
            + "&equal node_set = 'edge_x1' components = 'ux' /\n&support node_set = 'corner_x1_y1' ux = 0.1 /\n"
            + "&support node_set = 'corner_x1_y0' ux = 0.2 /\n"
            + self.CLAMP,
            "in.nml:4: &equal: it contradicts the supports",
            "ux of node",
        )

    def test_depends_twice(self):
        self.refused(
            self.SHEET
            + self.HUB
            + "&node name = 'two' position = 3.0, 0.5, 1.0 /\n"
            + "&rigid_body node_set = 'edge_x1' reference = 'hub' /\n&rigid_body node_set = 'edge_x1' reference = 'two' /\n"
            + self.CLAMP,
            "in.nml:7: &rigid_body: node 13 depends on others already, by in.nml:6: &rigid_body",
        )

    def test_held(self):
        self.refused(
            self.SHEET + self.HUB + "&rigid_body node_set = 'edge_x0' reference = 'hub' /\n" + self.CLAMP,
            "in.nml:5: &rigid_body: node 1 depends on node 16, and a support holds it, too (ux",
        )

    def test_equation_of_a_body(self):
        self.refused(
            self.SHEET
            + self.HUB
            + "&rigid_body node_set = 'edge_x1' reference = 'hub' /\n&equal node_set = 'edge_x1' components = 'uz' /\n"
            + self.CLAMP,
            "&equal: node",
            "name what it depends on, node 16, instead",
        )

    def test_circle(self):
        self.refused(
            self.SHEET
            + "&rigid_body node_set = 'corner_x1_y0' reference = 'corner_x1_y1' /\n"
            + "&rigid_body node_set = 'corner_x1_y1' reference = 'corner_x1_y0' /\n"
            + self.CLAMP,
            "depends on itself",
        )

    def test_axes(self):
        self.refused(
            self.SHEET
            + "&equal node_set = 'edge_x1' components = 'uz' /\n"
            + "&support node_set = 'edge_x1' fixed = 'ux' axes = 'given' axis_1 = 0.6, 0.8, 0.0 axis_2 = 0, 0, 1 /\n"
            + self.CLAMP,
            "is held in axes of its own, and equations are between global components",
        )

    def test_no_partner(self):
        self.refused(
            self.SHEET + "&tie node_set = 'edge_x1' to_node_set = 'edge_x0' /\n" + self.CLAMP,
            "in.nml:4: &tie node_set: node 13 has no partner in 'edge_x0'",
        )
        self.refused(
            self.SHEET + "&tie node_set = 'edge_x1' to_element_set = 'all' /\n" + self.CLAMP,
            "belongs to 'all' itself",
        )
        self.refused(
            self.SHEET + "&tie node_set = 'edge_x1' to_node_set = 'nobody' /\n" + self.CLAMP, "there is no node set 'nobody'"
        )
        self.refused(
            self.SHEET + "&tie node_set = 'edge_x1' to_element_set = 'nobody' /\n" + self.CLAMP,
            "there is no element set 'nobody'",
        )
        self.refused(
            self.SHEET + "&tie node_set = 'edge_x1' /\n" + self.CLAMP, "to_node_set or to_element_set is expected"
        )

    def test_reference(self):
        self.refused(
            self.SHEET + "&rigid_body node_set = 'edge_x1' reference = 'hub' /\n" + self.CLAMP,
            "there is no node set or &node 'hub'",
        )
        self.refused(
            self.SHEET + "&rigid_body node_set = 'edge_x1' reference = 'edge_y0' /\n" + self.CLAMP,
            "'edge_y0' has 5 nodes; the name of a &node or of a node set with one node is expected",
        )
        self.refused(
            self.SHEET + self.HUB + "&rigid_body node_set = 'hub' reference = 'hub' /\n" + self.CLAMP,
            "no node beside the reference node",
        )

    def test_terms(self):
        for words, message in (
            ("node_set = 'edge_x1', 'edge_y0' components = 'ux', 'ux' coefficients = 1, 1", "of equally many are expected"),
            ("node_set = 'edge_x1', 'edge_x0' components = 'ux' coefficients = 1, 1", "one for each is expected"),
            ("node_set = 'edge_x1', 'edge_x0' components = 'ux', 'ux' coefficients = 1, 0", "coefficients other than zero"),
            ("node_set = 'edge_x1' components = 'ux' coefficients = 1", "two or more terms"),
        ):
            self.refused(self.SHEET + f"&equation {words} /\n" + self.CLAMP, message)
        self.refused(
            self.SHEET + "&equal node_set = 'corner_x1_y1' components = 'ux' /\n" + self.CLAMP, "two or more are expected"
        )

    def test_not_with(self):
        joint = self.HUB + "&rigid_body node_set = 'edge_x1' reference = 'hub' /\n"
        self.refused(
            self.SHEET + joint + "&support node_set = 'edge_x0' type = 'clamped' /\n&step control = 'explicit' duration = 1 /\n",
            "explicit steps do not know &tie",
        )
        self.refused(self.SHEET + joint + "&accuracy error = 0.1 /\n" + self.CLAMP, "&accuracy changes it from run to run")

    def test_mechanism(self):
        self.refused(
            self.SHEET + self.HUB + "&rigid_body node_set = 'edge_x1' reference = 'hub' /\n&step /\n",
            "the supports and joints leave a rigid-body motion free: all six",
        )


if __name__ == "__main__":
    unittest.main()
