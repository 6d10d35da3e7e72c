#!/usr/bin/env python3
"""Jumps to another branch: refined first, then named or refused; steps that are only long are left alone."""
import csv
import os
import subprocess
import tempfile
import unittest
from math import cos, radians, sin
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
ROWS, CELLS, ANGLE = 40, 2, 6.0
# Axisymmetric reference with facet kinematics: downward force on the whole circle where the top has moved down by u; turning point at u = 1.8488.
CONE_FORCE = {0.1: 0.17051, 0.2: 0.0902943, 0.3: 0.0334675, 1.2: 0.036089, 1.3: 0.0422107, 1.4: 0.0448205, 1.5: 0.0401384, 1.8: -0.101506}
CONE_TURN = 1.8488
CONE = f"""&mesh file = 'cone.msh' /
&material name = 'rubber' law = 'ogden' mu1 = 6.3 alpha1 = 1.3 mu2 = 0.012 alpha2 = 5.0 mu3 = -0.1 alpha3 = -2.0 /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'bottom' fixed = 'ux', 'uy', 'uz', 'rx', 'rz' axes = 'cylindrical' axis = 0.0, 0.0, 1.0 /
&support node_set = 'top' fixed = 'ux', 'uy', 'rx', 'rz' uz = -1.0 axes = 'cylindrical' axis = 0.0, 0.0, 1.0 /
&support node_set = 'side_0' type = 'symmetry' normal = {sin(radians(ANGLE / 2)):.15g}, {cos(radians(ANGLE / 2)):.15g}, 0.0 /
&support node_set = 'side_1' type = 'symmetry' normal = {-sin(radians(ANGLE / 2)):.15g}, {cos(radians(ANGLE / 2)):.15g}, 0.0 /
&step load_factor = 1.8 load_levels = {', '.join(str(u) for u in CONE_FORCE if u < 1.8)} /
{{step}}
&monitor name = 'F' quantity = 'reaction' component = 'z' node_set = 'top' factor = {-360 / ANGLE} /
&output every = 0 /
"""
ELASTICA = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 32, 1 /
&material name = 'm' law = 'st_venant_kirchhoff' e = 12 nu = 0.0 /
&section material = 'm' thickness = 1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_x1' vector = 0, 0, 0.04 /
&step {step} /
&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'edge_x1' factor = -1.0 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
&output every = 0 /
"""
ROOF = """&mesh generator = 'cylinder' radius = 2540.0 length = 254.0 angles = 0.0, 5.729577951308232 divisions = 8, 8 /
&material name = 'elastic' law = 'linear_elastic' e = 3102.75 nu = 0.3 /
&section material = 'elastic' thickness = 12.7 /
&support node_set = 'edge_a1' fixed = 'ux', 'uy', 'uz', 'rx', 'rz' /
&support node_set = 'edge_a0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'force' node_set = 'corner_a0_y0' vector = 0.0, 0.0, -750.0 /
&step {step} /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_a0_y0' factor = -1.0 /
&output every = 0 /
"""


def write_cone(path):
    """A sector of the frustum, bottom radius 2, top radius 1, height 1."""
    wide = CELLS + 1
    nodes = [((2 - i / ROWS) * cos(a), (2 - i / ROWS) * sin(a), i / ROWS)
             for i in range(ROWS + 1) for a in (radians(ANGLE) * (j / CELLS - 0.5) for j in range(wide))]
    triangles = []
    for i in range(ROWS):
        for j in range(CELLS):
            a, b, c, d = (r * wide + s + 1 for r, s in ((i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)))
            triangles += [(a, b, c), (a, c, d)] if (i + j) % 2 == 0 else [(a, b, d), (b, c, d)]
    edges = [[(j + 1, j + 2) for j in range(CELLS)], [(ROWS * wide + j + 1, ROWS * wide + j + 2) for j in range(CELLS)],
             [(i * wide + 1, (i + 1) * wide + 1) for i in range(ROWS)], [((i + 1) * wide, (i + 2) * wide) for i in range(ROWS)]]
    names = "".join(f'1 {k + 1} "{n}"\n' for k, n in enumerate(("bottom", "top", "side_0", "side_1")))
    curves = "".join(f"{k} -3 -3 -3 3 3 3 1 {k} 0\n" for k in (1, 2, 3, 4))
    blocks, count = [], 0
    for dimension, tag, kind, items in [(1, k + 1, 1, e) for k, e in enumerate(edges)] + [(2, 1, 2, triangles)]:
        blocks.append(f"{dimension} {tag} {kind} {len(items)}")
        for item in items:
            count += 1
            blocks.append(" ".join(map(str, (count, *item))))
    lines = [f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n4\n{names}$EndPhysicalNames",
             f"$Entities\n0 4 1 0\n{curves}1 -3 -3 -3 3 3 3 0 0\n$EndEntities",
             f"$Nodes\n1 {len(nodes)} 1 {len(nodes)}\n2 1 0 {len(nodes)}", *(str(k + 1) for k in range(len(nodes))),
             *("{:.15g} {:.15g} {:.15g}".format(*p) for p in nodes), "$EndNodes",
             f"$Elements\n{len(edges) + 1} {count} 1 {count}", *blocks, "$EndElements"]
    path.write_text("\n".join(lines) + "\n")


class Snap(unittest.TestCase):
    def solve(self, text, code=0):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "in.nml").write_text(text)
            if "cone.msh" in text:
                write_cone(Path(folder) / "cone.msh")
            run = subprocess.run([PROGRAM, "run", "in.nml"], cwd=folder, capture_output=True, text=True, timeout=300, check=False)
            history = next(Path(folder).glob("*.history.csv"))
            rows = [{k: float(v) for k, v in r.items()} for r in csv.DictReader(history.read_text().splitlines())]
        if code is not None:
            self.assertEqual(run.returncode, code, run.stdout + run.stderr)
        self.assertEqual("SNAPPED" in run.stdout, any(r["snap"] for r in rows))
        self.assertEqual(run.stdout.count("SNAP: this state"), sum(r["snap"] > 0 for r in rows))
        return rows, run

    def check_cone(self, rows):
        for u, force in CONE_FORCE.items():
            row = [r for r in rows if abs(r["load_factor"] - u) < 1e-12][0]
            self.assertAlmostEqual(row["F"], force, delta=0.02 * abs(force) + 0.0015, msg=f"at u = {u}")

    def test_support_past_a_turning_point(self):
        """The top of a rubber cone moves past the turning point of its path: the jump begins there and is named."""
        rows, run = self.solve(CONE.format(step="&step load_factor = 1.95 /"))
        self.check_cone(rows)
        at = [i for i, r in enumerate(rows) if r["snap"]]
        self.assertEqual(len(at), 1)
        self.assertAlmostEqual(rows[at[0] - 1]["load_factor"], CONE_TURN, delta=0.004)
        self.assertIn("work and stored energy differ by", run.stdout)
        self.assertIn(f"the first is number {at[0] + 1} ", run.stdout)

    def test_support_past_a_turning_point_refused(self):
        rows, run = self.solve(CONE.format(step="&step load_factor = 1.95 snap = 'refuse' /"), code=1)
        self.check_cone(rows)
        self.assertAlmostEqual(rows[-1]["load_factor"], CONE_TURN, delta=0.004)
        self.assertIn("what is prescribed turns round here. control = 'arc_length' follows the path", run.stderr)

    def test_support_past_a_turning_point_ignored(self):
        rows, _ = self.solve(CONE.format(step="&step load_factor = 1.95 snap = 'ignore' /"))
        self.assertEqual(sum(r["snap"] for r in rows), 0)

    def test_arc_length_takes_the_turn(self):
        rows, _ = self.solve(CONE.format(step="&step control = 'arc_length' load_levels = 1.845 first_increment = 0.02 load_factor = 0.2 /"))
        self.assertEqual(sum(r["snap"] for r in rows), 0)
        self.assertAlmostEqual(max(r["load_factor"] for r in rows), CONE_TURN, delta=0.004)
        self.assertGreater(rows[-1]["F"], 0.3)     # far from the path that led here, whose force is 0.09

    def test_thick_elastica(self):
        """Elements as thick as long: right on every way to the full load, and nothing snaps; the elastica has 3.302 and 6.74."""
        for step in ("", "snap = 'refuse'", "growth = 1.5", "first_increment = 0.05", "control = 'arc_length'"):
            with self.subTest(step):
                rows, _ = self.solve(ELASTICA.format(step=step))
                self.assertEqual(sum(r["snap"] for r in rows), 0)
                self.assertAlmostEqual(rows[-1]["u"], 3.30, delta=0.02)
                self.assertAlmostEqual(rows[-1]["w"], 6.74, delta=0.03)

    def test_snap_through_under_load(self):
        """The hinged roof under a dead load jumps at its limit load, 0.74, and stays on the way below it."""
        rows, _ = self.solve(ROOF.format(step=""))
        at = [i for i, r in enumerate(rows) if r["snap"]]
        self.assertEqual(len(at), 1)
        self.assertAlmostEqual(rows[at[0] - 1]["load_factor"], 0.74, delta=0.04)
        rows, run = self.solve(ROOF.format(step="snap = 'refuse'"), code=1)
        self.assertAlmostEqual(rows[-1]["load_factor"], 0.74, delta=0.04)
        self.assertIn("arc_length", run.stderr)
        rows, _ = self.solve(ROOF.format(step="control = 'arc_length'"))
        self.assertEqual(sum(r["snap"] for r in rows), 0)

    def test_support_under_a_thin_roof(self):
        """The middle of the thin roof moves past the snap-back of its path near 17; the thicker roof has none."""
        support = "&support node_set = 'corner_a0_y0' uz = -30.0 /"
        load = next(line for line in ROOF.splitlines() if line.startswith("&load"))
        for step in ("", "tolerance = 'tight'", "mixed = .true."):
            with self.subTest(step):
                rows, _ = self.solve(ROOF.replace(load, support).replace("12.7", "6.35").replace("8, 8", "12, 12").format(step=step))
                at = [i for i, r in enumerate(rows) if r["snap"]]
                self.assertEqual(len(at), 1)
                self.assertAlmostEqual(rows[at[0] - 1]["w"], 17.0, delta=0.5)
                rows, _ = self.solve(ROOF.replace(load, support).format(step=step))
                self.assertEqual(sum(r["snap"] for r in rows), 0)

    def test_long_increments_are_no_snaps(self):
        for name in ("sze31", "sze34", "sze35", "sze32", "hinged_strip"):
            with self.subTest(name):
                rows, _ = self.solve((SOURCE / "examples" / name / "input.nml").read_text() + "\n&output every = 0 /\n")
                self.assertEqual([r["snap"] for r in rows if r["snap"] > 0], [])
                self.assertLessEqual(len(rows), 8)

    def test_roof_is_not_skipped(self):
        """Between deflections of 18 and 38 the path of this laminate goes back to 11, through two more limit points."""
        rows, _ = self.solve((SOURCE / "examples/sze38e/input.nml").read_text() + "\n&output every = 0 /\n")
        w = [r["W_C"] for r in rows]
        first = next(i for i, x in enumerate(w) if x > 16)
        self.assertLess(min(w[first:]), 12)     # the path goes back before it goes on
        self.assertEqual(sum(r["snap"] for r in rows), 0)


if __name__ == "__main__":
    unittest.main()
