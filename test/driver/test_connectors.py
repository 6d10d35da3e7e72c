#!/usr/bin/env python3
"""Springs, bars, cables, dashpots and masses between nodes, and loads on edges, against closed forms; threads, restarts, messages."""
import csv
import math
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
# A plate that is held everywhere, beside which the rest stands.
GROUND = """&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 2, 1 /
&material name = 'm' law = 'linear_elastic' e = 1.0e6 nu = 0.3 density = 1 /
&section material = 'm' thickness = 0.01 /
&support node_set = 'all' type = 'clamped' /
"""
TIGHT = "tolerance = 'tight'"
MASS = GROUND + """&node name = 'm' position = 1.0, 0.0, 1.0 /
&support node_set = 'm' fixed = 'uy' /
&point_mass name = 'mass' node_set = 'm' mass = 2.0 inertia = 0.1 /
&spring name = 'k' type = 'axes' node_set = 'm' stiffness = 18.0, 8.0, 8.0 /
&spring name = 'r' type = 'rotation' node_set = 'm' stiffness = 90.0 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'm' /
"""
STRIP = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 32, 1 /
&material name = 'elastic' law = 'linear_elastic' e = 1.2e10 nu = 0.0 density = 1 /
&section material = 'elastic' thickness = 0.01 /
&support node_set = 'edge_x0' type = 'clamped' /
"""
CANOPY = """&mesh generator = 'rectangle' lengths = 4.0, 4.0 divisions = 12, 12 /
&material name = 'cloth' law = 'neo_hookean' mu = 3.3e5 density = 1 /
&section material = 'cloth' type = 'membrane' thickness = 0.001 wrinkling = .true. /
&node_set name = 'corners' nodes = 1, 13, 157, 169 /
&support node_set = 'corners' type = 'hinged' /
&cable name = 'e1' edge_set = 'edge_x0' axial_stiffness = 1e4 /
&cable name = 'e2' edge_set = 'edge_x1' axial_stiffness = 1e4 /
&cable name = 'e3' edge_set = 'edge_y0' axial_stiffness = 1e4 /
&cable name = 'e4' edge_set = 'edge_y1' axial_stiffness = 1e4 /
&load type = 'pressure' pressure = 5 /
&step /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'all' reduce = 'max' /
&monitor name = 'tension' quantity = 'connector_force' connector = 'e1' reduce = 'max' /
&output restart = 'every' /
"""


class Connectors(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def solve(self, text, *arguments, name="r", threads=1, code=0, command="run"):
        (self.path / f"{name}.nml").write_text(text)
        run = subprocess.run([PROGRAM, command, f"{name}.nml", *arguments], cwd=self.path, capture_output=True, text=True, check=False,
                             timeout=300, env={**os.environ, "OMP_NUM_THREADS": str(threads)})
        self.assertEqual(run.returncode, code, run.stdout + run.stderr)
        self.printed = run.stdout + run.stderr
        if code or command != "run":
            return []
        rows = csv.DictReader((self.path / f"{name}.history.csv").read_text().splitlines())
        return [{k: float(v) for k, v in row.items()} for row in rows]

    def near(self, found, expected, relative):
        self.assertLessEqual(abs(found - expected), relative * abs(expected), f"{found} is not {expected}")

    def test_truss_with_limit_points(self):
        """Two bars from the feet to an apex: P = 2 N(l) z/l, z the height; between its extremes the tangent has a negative pivot."""
        for law in ("st_venant_kirchhoff", "logarithmic"):
            rows = self.solve(GROUND + f"""&node name = 'apex' position = 1.0, 0.0, 0.2 /
&node_set name = 'feet' nodes = 1, 5 /
&support node_set = 'apex' fixed = 'uy' /
&bar name = 'bars' node_set = 'feet' to = 'apex' axial_stiffness = 1000 law = '{law}' /
&load type = 'force' node_set = 'apex' vector = 0, 0, -1 /
&step control = 'arc_length' displacements = -0.6 node_set = 'apex' component = 'z' {TIGHT} maximum_length = 0.05 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'apex' factor = -1 /
&monitor name = 'n' quantity = 'connector_force' connector = 'bars' reduce = 'max' /
&monitor name = 'strain' quantity = 'connector_extension' connector = 'bars' reduce = 'min' /
&monitor name = 'energy' quantity = 'energy' /
""".replace(" maximum_length = 0.05", ""))
            rest = math.hypot(1, 0.2)
            snapped = 0
            for row in rows:
                z = 0.2 - row["w"]
                length = math.hypot(1, z)
                s = length / rest
                n = 1000 * (s * (s * s - 1) / 2 if law[0] == "s" else math.log(s) / s)
                self.assertAlmostEqual(row["load_factor"], -2 * n * z / length, delta=1e-8)
                self.assertAlmostEqual(row["n"], n, delta=1e-8)
                self.assertAlmostEqual(row["strain"], s - 1, delta=1e-12)
                e = (s * s - 1) / 2 if law[0] == "s" else math.log(s)
                self.assertAlmostEqual(row["energy"], 1000 * rest * e * e, delta=1e-9)
                # where the load falls
                falls = abs(z) < 0.99 * 0.2 / math.sqrt(3) * (1 if law[0] == "s" else 0.98)
                if falls:
                    snapped += 1
                    self.assertEqual(row["negative_pivots"], 1)
            self.assertGreaterEqual(snapped, 1)
            self.assertEqual(rows[0]["negative_pivots"], 0)
            self.assertEqual(rows[-1]["negative_pivots"], 0)

    def test_cable_under_point_load(self):
        rows = self.solve(GROUND + f"""&node name = 'p' position = 1.0, 0.0, 0.0001 /
&node_set name = 'ends' nodes = 1, 5 /
&cable name = 'rope' node_set = 'ends' to = 'p' axial_stiffness = 1000 /
&load type = 'force' node_set = 'p' vector = 0, 0, -5 /
&step {TIGHT} /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'p' factor = -1 /
&monitor name = 'n' quantity = 'connector_force' connector = 'rope' /
""")
        z = rows[-1]["w"] - 1e-4
        s = math.sqrt((1 + z * z) / (1 + 1e-8))
        self.near(2 * 1000 * s * (s * s - 1) / 2 * z / math.hypot(1, z), 5, 1e-8)
        self.near(rows[-1]["n"], 1000 * s * (s * s - 1) / 2, 1e-8)

    def test_catenary(self):
        """A chain of 40 links, 5 % longer than its span, under its weight: the elastic catenary with horizontal force h."""
        rows = self.solve(GROUND + f"""&node_set name = 'a' nodes = 1 /
&node_set name = 'b' nodes = 5 /
&cable name = 'chain' node_set = 'a' to = 'b' divisions = 40 axial_stiffness = 1e5 length_ratio = 1.05 mass_per_length = 1.05 /
&load type = 'gravity' vector = 0, 0, -10 /
&step {TIGHT} /
&monitor name = 'sag' quantity = 'displacement' component = 'z' node_set = 'chain' factor = -1 reduce = 'min' /
&monitor name = 'least' quantity = 'connector_force' connector = 'chain' reduce = 'min' /
""")
        w, half, ea = 10.0, 1.05, 1e5
        low, high = 1.0, 100.0
        for _ in range(200):
            h = (low + high) / 2
            low, high = (h, high) if h * half / ea + h / w * math.asinh(w * half / h) < 1 else (low, h)
        self.near(rows[-1]["sag"], w * half**2 / (2 * ea) + h / w * (math.hypot(1, w * half / h) - 1), 5e-4)
        self.near(rows[-1]["least"], h, 1e-3)

    def test_oscillator(self):
        """x = (v/w) sin w t, w = 2: implicit steps are of second order; frequencies; explicit steps."""
        errors = []
        for n in (50, 100, 200):
            rows = self.solve(MASS + "&initial_velocity node_set = 'm' velocity = 0, 0, 2 /\n&step control = 'dynamic' duration = 3 "
                              f"first_increment = {3 / n} automatic = .false. /\n")
            errors.append(rows[-1]["w"] - math.sin(6))
            self.near(rows[-1]["kinetic_energy"] + rows[-1]["stored_energy"], 4, 1e-3)
        self.assertTrue(3.8 < errors[0] / errors[1] < 4.2 and 3.8 < errors[1] / errors[2] < 4.2, errors)
        errors = []
        for n in (100, 200):
            rows = self.solve(MASS + "&initial_velocity node_set = 'm' velocity = 0, 0, 2 /\n&step control = 'explicit' duration = 3 "
                              f"largest_increment = {3 / n} /\n")
            errors.append(rows[-1]["w"] - math.sin(6))
            self.assertAlmostEqual(rows[-1]["kinetic_energy"] + rows[-1]["stored_energy"], 4, delta=5e-3)
            self.assertAlmostEqual(rows[-1]["work"], 0, delta=1e-12)
        self.assertLess(abs(errors[1]), 2e-2)
        self.assertGreater(abs(errors[0] / errors[1]), 1.8)
        self.solve(MASS + "&initial_velocity node_set = 'm' velocity = 0, 0, 2 /\n&step control = 'explicit' duration = 20 /\n")
        rows = self.solve(MASS + "&step control = 'frequencies' modes = 4 /\n")
        for row, expected in zip(rows, (2, 3, 30, 30)):
            self.near(row["load_factor"], expected / (2 * math.pi), 1e-10)

    def test_damped_oscillator(self):
        d = 1.6 / 4
        w = math.sqrt(4 - d * d)
        exact = 2 / w * math.exp(-2.5 * d) * math.sin(2.5 * w)
        for kind in ("type = 'axes' viscosity = 0, 0, 1.6", "type = 'line' anchor = 1, 0, -5 viscosity = 1.6"):
            text = MASS + f"&dashpot name = 'c' node_set = 'm' {kind} /\n&initial_velocity node_set = 'm' velocity = 0, 0, 2 /\n"
            errors = []
            for n in (100, 200):
                rows = self.solve(text + f"&step control = 'dynamic' duration = 2.5 first_increment = {2.5 / n} automatic = .false. /\n")
                errors.append(rows[-1]["w"] - exact)
                self.near(rows[-1]["kinetic_energy"] + rows[-1]["stored_energy"] + rows[-1]["damped"], 4, 1e-3)
            self.assertTrue(3.5 < errors[0] / errors[1] < 4.5, errors)
            errors = []
            for n in (200, 400):
                rows = self.solve(text + f"&step control = 'explicit' duration = 2.5 largest_increment = {2.5 / n} /\n")
                errors.append(rows[-1]["w"] - exact)
            self.assertTrue(1.7 < errors[0] / errors[1] < 2.3, errors)
            self.assertLess(abs(errors[1]), 1e-2)
        # a strong one shortens the increment: the motion stays stable
        text = text.replace("viscosity = 1.6", "viscosity = 1000")
        rows = self.solve(text + "&step control = 'explicit' duration = 1 /\n")
        self.assertLess(abs(rows[-1]["w"]), 5e-3)
        self.solve(text.replace("&initial_velocity node_set = 'm' velocity = 0, 0, 2 /\n", "&load type = 'force' node_set = 'm' vector = 0, 0, 1 /\n")
                   + "&step /\n", command="check")
        self.assertIn("a &dashpot acts in steps in time only", self.printed)

    def test_pendulum(self):
        """A mass on a cable, let go level with its pin: on the other side after 2 K(1/sqrt 2) sqrt(L/g)."""
        half = 2 * 1.8540746773013719 / math.sqrt(9.81)
        for control in ("dynamic", "explicit"):
            rows = self.solve(GROUND + f"""&node name = 'bob' position = 1.0, 0.0, 0.0 /
&node_set name = 'pin' nodes = 1 /
&point_mass name = 'mass' node_set = 'bob' mass = 1 /
&cable name = 'rope' node_set = 'pin' to = 'bob' axial_stiffness = 1.0e5 /
&load type = 'gravity' vector = 0, 0, -9.81 constant = .true. /
&monitor name = 'x' quantity = 'displacement' component = 'x' node_set = 'bob' /
&monitor name = 'z' quantity = 'displacement' component = 'z' node_set = 'bob' /
&step control = '{control}' duration = {half} /
""")
            self.near(rows[-1]["x"], -2, 3e-3)
            self.assertLess(abs(rows[-1]["z"]), 3e-2)

    def test_mass_on_a_cantilever(self):
        """Strip of mass M = 10 with m = 20 at its tip: 1 + cos b cosh b + m/M b (cos b sinh b - sin b cosh b) = 0, w^2 = EI b^4/(M L^3)."""
        rows = self.solve(STRIP.replace("density = 1 ", "density = 100 ")
                          + "&point_mass name = 'm' node_set = 'edge_x1' mass = 20 total = .true. /\n&step control = 'frequencies' modes = 1 /\n")
        low, high = 0.1, 1.8
        for _ in range(100):
            b = (low + high) / 2
            value = 1 + math.cos(b) * math.cosh(b) + 2 * b * (math.cos(b) * math.sinh(b) - math.sin(b) * math.cosh(b))
            low, high = (b, high) if value > 0 else (low, b)
        self.near(rows[0]["load_factor"], math.sqrt(1000 * b**4 / (10 * 1000)) / (2 * math.pi), 1e-3)

    def test_buckling_of_two_bars(self):
        """Two bars of length 1 in line, pressed at one end; a spring k across at the hinge: P = k/2, and the other k across for the second mode."""
        rows = self.solve(GROUND + """&node name = 'hinge' position = 0, 0, 2 /
&node name = 'foot' position = 0, 0, 1 /
&node name = 'head' position = 0, 0, 3 /
&support node_set = 'foot' fixed = 'ux', 'uy', 'uz' /
&support node_set = 'head' fixed = 'ux', 'uy' /
&bar name = 'low' node_set = 'foot' to = 'hinge' axial_stiffness = 1e6 /
&bar name = 'high' node_set = 'hinge' to = 'head' axial_stiffness = 1e6 /
&spring name = 'k' type = 'axes' node_set = 'hinge' stiffness = 40, 60, 0 /
&load type = 'force' node_set = 'head' vector = 0, 0, -1 /
&step control = 'buckling' modes = 2 /
""")
        self.near(rows[0]["load_factor"], 20, 1e-6)
        self.near(rows[1]["load_factor"], 30, 1e-6)

    def test_preload_and_tables(self):
        """Without load: where the preload rests. A table with a falling part, along the path."""
        rows = self.solve(MASS.replace("stiffness = 18.0, 8.0, 8.0", "stiffness = 18.0, 8.0, 8.0 preload = 0, 0, 4.0")
                          + f"&load type = 'force' node_set = 'm' vector = 0, 0, 4 /\n&step load_levels = 0.5, 1.0 {TIGHT} /\n")
        self.assertAlmostEqual(next(r["w"] for r in rows if r["load_factor"] == 0.5), -0.25, delta=1e-9)
        self.assertAlmostEqual(rows[-1]["w"], 0, delta=1e-9)
        table = GROUND + f"""&node name = 'm' position = 1.0, 0.0, 1.0 /
&support node_set = 'm' fixed = 'ux', 'uy' /
&spring name = 'k' type = 'axis' direction = 0, 0, 2 node_set = 'm' extensions = -1, 0, 1, 2, 3 forces = -2, 0, 2, 1, 4 /
&load type = 'force' node_set = 'm' vector = 0, 0, 1 /
&step control = 'displacement' displacements = 0.5, 1.5, 2.5, 3.5 node_set = 'm' component = 'z' {TIGHT} /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'm' /
&monitor name = 'f' quantity = 'connector_force' connector = 'k' /
&monitor name = 'energy' quantity = 'energy' /
"""
        rows = self.solve(table)
        for row in rows:
            w = row["w"]
            force, energy = ((2 * w, w * w) if w < 1 else (3 - w, 1 + (1 + w) * 0 + (w - 1) * (2 + 3 - w) / 2) if w < 2
                             else (1 + 3 * (w - 2), 2.5 + (w - 2) * (1 + 1.5 * (w - 2))))
            self.assertAlmostEqual(row["f"], force, delta=1e-8)
            self.assertAlmostEqual(row["load_factor"], force, delta=1e-8)
            self.assertAlmostEqual(row["energy"], energy, delta=1e-8)

    def test_rolled_by_line_moments(self):
        """2 pi EI/L at the end: a circle, its tip back at the clamp; dead, and about the edge that turns with it."""
        for load in ("vector = 0.0, -628.3185307179587, 0.0", "about_edge = -628.3185307179587"):
            rows = self.solve(STRIP + f"""&load type = 'line_moment' edge_set = 'edge_x1' {load} /
&step mixed = .true. load_levels = 0.5, 1.0 /
&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'edge_x1' /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
""")
            half = next(r for r in rows if r["load_factor"] == 0.5)
            self.near(half["u"], -10, 5e-3)
            self.near(half["w"], 20 / math.pi, 5e-3)
            self.near(rows[-1]["u"], -10, 5e-3)
            self.assertLess(abs(rows[-1]["w"]), 0.02)
            self.assertNotIn("SNAP", self.printed)

    def test_patch_under_follower_load(self):
        """A force in the plane on the edge of a strip: constant tension, to rounding."""
        rows = self.solve("""&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 4, 2 /
&material name = 'm' law = 'linear_elastic' e = 1.0e6 nu = 0.3 /
&section thickness = 0.1 /
&support node_set = 'edge_x0' fixed = 'ux', 'uz', 'ry' /
&support node_set = 'corner_x0_y0' fixed = 'uy', 'rx' /
&load type = 'follower_line' edge_set = 'edge_x1' in_plane = 10 /
&step control = 'linear' /
&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'edge_x1' /
&monitor name = 'most' quantity = 'membrane_force' component = '11' element_set = 'all' reduce = 'max' /
&monitor name = 'least' quantity = 'membrane_force' component = '11' element_set = 'all' reduce = 'min' /
""")
        self.near(rows[-1]["u"], 2e-4, 1e-9)
        self.near(rows[-1]["most"], 10, 1e-9)
        self.near(rows[-1]["least"], 10, 1e-9)

    def test_explicit_on_a_foundation(self):
        """What a foundation stores is not work of loads: the energy of a free sheet on springs stays."""
        rows = self.solve("""&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 2, 1 /
&material name = 'm' law = 'linear_elastic' e = 1.0e4 nu = 0.3 density = 10 /
&section thickness = 0.1 /
&load type = 'foundation' vector = 4.0, 4.0, 4.0 /
&initial_velocity node_set = 'all' velocity = 0, 0, 1 /
&step control = 'explicit' duration = 3.0 largest_increment = 0.003 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'all' /
""")
        self.assertAlmostEqual(rows[-1]["w"], math.sin(6) / 2, delta=3e-3)
        self.assertAlmostEqual(rows[-1]["kinetic_energy"] + rows[-1]["stored_energy"], 1, delta=1e-3)
        self.assertAlmostEqual(rows[-1]["work"], 0, delta=1e-10)

    def test_ring_under_follower_load(self):
        """A ring buckles under a force along its normal at 3 EI/R^3: deflections under a small disturbance grow as 1/(q - q0)."""
        rows = self.solve(f"""&mesh generator = 'cylinder' radius = 10 length = 1 angles = 0, 90 divisions = 40, 1 /
&material name = 'm' law = 'linear_elastic' e = 1.2e10 nu = 0.0 /
&section thickness = 0.1 /
&support node_set = 'all' fixed = 'uy' /
&support node_set = 'edge_a0' type = 'symmetry_x' /
&support node_set = 'edge_a1' type = 'symmetry_z' /
&load type = 'force' node_set = 'edge_a0' vector = 0, 0, -0.01 constant = .true. /
&load type = 'follower_line' edge_set = 'edge_y0' normal = -1500 /
&load type = 'follower_line' edge_set = 'edge_y1' normal = -1500 /
&step load_levels = 0.6, 0.8, 0.9 {TIGHT} /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_a0' /
&monitor name = 'v' quantity = 'displacement' component = 'x' node_set = 'edge_a1' /
""")
        # w less the even shortening
        at = {f: next(r["w"] - r["v"] for r in rows if r["load_factor"] == f) for f in (0.8, 0.9)}
        limit = (0.9 * at[0.9] - 0.8 * at[0.8]) / (at[0.9] - at[0.8])
        self.near(limit, 1.0, 1e-2)

    def test_canopy(self):
        """A membrane between cables along its edges, by the defaults; the same on two threads, and after a restart."""
        self.solve(CANOPY)
        rows = (self.path / "r.history.csv").read_text()
        self.assertLess(sum(int(line.split(",")[2]) for line in rows.splitlines()[1:]), 100)
        self.solve(CANOPY, threads=2)
        self.assertEqual((self.path / "r.history.csv").read_text(), rows)
        subprocess.run([PROGRAM, "restart", "r.vtkhdf", "--from", "4", "-q"], cwd=self.path, check=True, capture_output=True)
        self.assertEqual((self.path / "r.history.csv").read_text(), rows)

    def test_motion_goes_on(self):
        for control in ("dynamic", "explicit"):
            text = MASS + ("&dashpot name = 'c' node_set = 'm' type = 'axes' viscosity = 0, 0, 1.6 /\n&output restart = 'every' /\n"
                           f"&initial_velocity node_set = 'm' velocity = 0, 0, 2 /\n&step control = '{control}' duration = 2.5 /\n")
            self.solve(text)
            rows = (self.path / "r.history.csv").read_text()
            subprocess.run([PROGRAM, "restart", "r.vtkhdf", "--from", "3", "-q"], cwd=self.path, check=True, capture_output=True)
            self.assertEqual((self.path / "r.history.csv").read_text(), rows)

    def test_parts_hold_each_other(self):
        """A plate hung on springs from a node; what they leave free is named."""
        sheet = """&mesh generator = 'rectangle' lengths = 3.0, 2.0 divisions = 3, 2 /
&material name = 'm' law = 'linear_elastic' e = 1.0e6 nu = 0.3 density = 1 /
&section material = 'm' thickness = 0.1 /
&node name = 'hook' position = 0, 0, 5 /
&load type = 'gravity' vector = 0, 0, -1 /
&step /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_x0_y0' /
"""
        held = "&support node_set = 'hook' fixed = 'ux', 'uy', 'uz' /\n"
        joints = ("&spring name = 'a' type = 'axes' node_set = 'corner_x0_y0' to = 'hook' stiffness = 10 /\n"
                  "&spring name = 't' type = 'rotation' node_set = 'corner_x0_y0' stiffness = 1e4 /\n")
        rows = self.solve(sheet + held + joints)
        self.near(rows[-1]["w"], -0.06, 1e-6)
        self.solve(sheet + held + joints.splitlines()[0] + "\n", code=2, command="check")
        self.assertIn("rotation about", self.printed)
        self.solve(sheet + held + joints.replace("stiffness = 10", "stiffness = 10, 10, 0"), code=2, command="check")
        self.assertIn("translation along z", self.printed)
        self.solve(sheet + joints, code=2, command="check")
        self.assertIn("springs and bars leave a rigid-body motion free", self.printed)

    def test_deck(self):
        """Springs, a mass and a truss of a deck, on nodes that have no shell; what is not taken is named."""
        deck = """*NODE
1, 0,0,0
2, 1,0,0
3, 1,1,0
4, 0,1,0
5, 1,0,2
6, 1,1,2
*ELEMENT, TYPE=S4, ELSET=SH
1, 1,2,3,4
*ELEMENT, TYPE=SPRINGA, ELSET=SP
2, 2,5
*ELEMENT, TYPE=SPRING1, ELSET=S1
3, 3
*ELEMENT, TYPE=MASS, ELSET=MM
4, 3
*ELEMENT, TYPE=T3D2, ELSET=TR
5, 3,6
*ELEMENT, TYPE=DASHPOTA, ELSET=NONE
6, 4,6
*MATERIAL, NAME=EL
*ELASTIC
1e6, 0.3
*DENSITY
2.
*SHELL SECTION, ELSET=SH, MATERIAL=EL
0.01
*SPRING, ELSET=SP

10.
*SPRING, ELSET=S1
3
20.
*MASS, ELSET=MM
5.
*SOLID SECTION, ELSET=TR, MATERIAL=EL
0.001
*BOUNDARY
1, 1, 6
4, 1, 6
5, 1, 3
6, 1, 3
*STEP, NLGEOM
*STATIC
*CLOAD
2, 3, 0.01
*END STEP
"""
        (self.path / "d.inp").write_text(deck)
        subprocess.run([PROGRAM, "convert", "d.inp"], cwd=self.path, check=True, capture_output=True)
        text = (self.path / "d.nml").read_text()
        for group in ("&node name = 'node_5' position = 1.0, .0, 2.0 /",
                      "&spring type = 'line' stiffness = 10.0 name = 'element_2' node_set = 'node_2' to = 'node_5' /",
                      "&spring type = 'axis' direction = .0, .0, 1.0 stiffness = 20.0 name = 'element_3' node_set = 'node_3' /",
                      "&point_mass mass = 5.0 name = 'element_4' node_set = 'node_3' /",
                      "&bar young = 1.0E+06 area = 1.0E-03 mass_per_length = .002 name = 'element_5' node_set = 'node_3' to = 'node_6' /",
                      "&support node_set = 'node_6' fixed = 'ux' 'uy' 'uz' /", "d.inp:18: *ELEMENT: there is no *DASHPOT"):
            self.assertIn(group, text)
        rows = self.solve(text.replace("&step", "&monitor name = 'f' quantity = 'connector_force' connector = 'element_2' /\n&step"), name="s")
        self.assertTrue(-0.01 < rows[-1]["f"] < 0)

    def test_messages(self):
        node = "&node name = 'n' position = 0, 0, 1 /\n&step /\n&load type = 'force' node_set = 'n' vector = 0, 0, 1 /\n"
        spring = "&spring name = 's' node_set = 'n' "
        for group, words in (
                ("", "node 7 belongs to no element"),
                (spring + "type = 'axes' stiffness = 1, 2 /", "one number is expected, or three; 2 were given"),
                (spring + "type = 'axes' stiffness = -1 /", "it is not negative; -1"),
                (spring + "type = 'axes' stiffness = 0 /", "it is zero along all axes"),
                (spring + "type = 'axes' stiffness = 1 to = 'nowhere' /", "there is no node set 'nowhere'"),
                (spring + "type = 'axes' stiffness = 1 to = 'n' /", "node 7 would be joined to itself"),
                (spring + "type = 'axis' stiffness = 1 direction = 0, 0, 0 /", "is no direction"),
                (spring + "type = 'line' stiffness = 1 anchor = 0, 0, 1 /", "coincide, so it has no direction"),
                (spring + "type = 'line' stiffness = 1 /", "the key anchor is required"),
                (spring + "type = 'axis' direction = 0, 0, 1 extensions = 0, 0 forces = 1, 2 /", "extensions rise from point to point"),
                (spring + "type = 'axis' direction = 0, 0, 1 extensions = 0 forces = 1 /", "a table has two points or more; 1"),
                (spring + "type = 'axis' direction = 0, 0, 1 extensions = 0, 1 forces = 0, 0 /", "all forces of the table are zero"),
                (spring + "type = 'axis' direction = 0, 0, 1 extensions = 0, 1 forces = 0, 1 tension_only = T /", "leave the key out"),
                ("&spring name = 's' node_set = 'edge_x0' to = 'edge_y0' type = 'axes' stiffness = 1 /", "one node is expected, or as many"),
                (2 * (spring + "type = 'axes' stiffness = 1 /\n"), "there is a connector 's' already"),
                ("&cable name = 'c' node_set = 'n' to = 'corner_x0_y0' axial_stiffness = 1 tension = 1 length_ratio = 1 /", "either tension or"),
                ("&cable name = 'c' node_set = 'n' to = 'corner_x0_y0' axial_stiffness = 1 tension = -0.1 /", "it acts in tension only; -1.000000E-01"),
                ("&bar name = 'c' node_set = 'n' to = 'corner_x0_y0' axial_stiffness = 1 law = 'logarithmic' tension = 1 /", "no such force"),
                ("&bar name = 'n' node_set = 'n' to = 'corner_x0_y0' axial_stiffness = 1 divisions = 3 /", "the nodes between the pieces are to have"),
                ("&monitor name = 'f' quantity = 'connector_force' connector = 'x' /", "there is no spring, bar or cable 'x'"),
                ("&point_mass name = 'm' node_set = 'n' mass = 0 /", "mass"),
        ):
            self.solve(GROUND + node + group + "\n", code=2, command="check")
            self.assertIn(words, self.printed)
        for control, words in (("dynamic", "can move but has no mass"), ("explicit", "can move but has no mass")):
            self.solve(GROUND + node.replace("&step /", f"&step control = '{control}' duration = 1 /") + spring
                       + "type = 'axes' stiffness = 1 /\n", code=2)
            self.assertIn(words, self.printed)
        self.solve(GROUND + node.replace("&step /", "&step control = 'explicit' duration = 1 /") + spring
                   + "type = 'rotation' stiffness = 1 /\n&point_mass name = 'm' node_set = 'n' mass = 1 /\n", code=2)


if __name__ == "__main__":
    unittest.main()
