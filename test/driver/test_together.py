#!/usr/bin/env python3
"""Features in one scene that were made apart: joints, connectors, chambers, steps, output, restart. Each scene is compared with
another way of saying the same, or with what must not change."""
import csv
import math
import os
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

from test_joints import grid, write_deck

PROGRAM = os.environ["FINSHELL_BIN"]
TIGHT = "residual_tolerance = 1e-11 correction_tolerance = 1e-9"
WHOLE = {"a": ((0, 0, 0), (4, 0, 0), (0, 1, 0), 8, 2)}
HALVES = {"a": ((0, 0, 0), (2, 0, 0), (0, 1, 0), 4, 2), "b": ((2, 0, 0), (2, 0, 0), (0, 1, 0), 4, 2)}
SHEET = """&mesh file = 'sheets.inp' /
&material name = 'm' law = 'st_venant_kirchhoff' e = 1.2e6 nu = 0.3 density = 10.0 /
&section thickness = 0.1 /
&support node_set = 'a_x0' type = 'clamped' /
"""
# both have the sets b_x0 (on the line between the halves) and b_x1 (the end)
UNDIVIDED = SHEET + "&node_set name = 'b_x0' x = 2.0 /\n&node_set name = 'b_x1' x = 4.0 /\n"
TIED = SHEET + "&tie node_set = 'b_x0' to_node_set = 'a_x1' /\n"
MONITORS = """&monitor name = 'x' quantity = 'displacement' component = 'x' node_set = 'b_x1' /
&monitor name = 'y' quantity = 'displacement' component = 'y' node_set = 'b_x1' /
&monitor name = 'z' quantity = 'displacement' component = 'z' node_set = 'b_x1' /
&monitor name = 'zm' quantity = 'displacement' component = 'z' node_set = 'b_x0' /
&monitor name = 'e' quantity = 'energy' /
"""
FORCE = "&load type = 'force' node_set = 'b_x1' vector = 0.0, 2.0, 10.0 total = .true. /\n"
PUSH = "&load type = 'force' node_set = 'b_x1' vector = -1.0, 0.0, 0.0 total = .true. /\n"
CONNECTORS = """&node name = 'mast' position = 2.5, 0.5, -3.0 /
&support node_set = 'mast' fixed = 'ux', 'uy', 'uz' /
&spring name = 's' type = 'axes' node_set = 'b_x0' stiffness = 3.0, 0.0, 8.0 /
&spring name = 'r' type = 'rotation' node_set = 'b_x0' stiffness = 5.0 /
&cable name = 'c' node_set = 'b_x0' to = 'mast' axial_stiffness = 20.0 tension = 0.5 /
&point_mass name = 'p' node_set = 'b_x0' mass = 0.7 inertia = 0.02 /
&load type = 'gravity' vector = 0.0, 0.0, -1.0 /
&monitor name = 'fs' quantity = 'connector_force' connector = 's' /
&monitor name = 'fc' quantity = 'connector_force' connector = 'c' /
"""
CLOCK = ("cpu_s",)


def write_gmsh(path, sheets):
    """The same as a Gmsh file, with the edge set `line` at x = 2 and the node sets as points."""
    nodes, triangles, sets = [], [], {}
    for name, sheet in sheets.items():
        found, more, edges = grid(*sheet, len(nodes) + 1)
        nodes += found
        triangles += more
        sets.update({f"{name}_{edge}": members for edge, members in edges.items()})
    inner = [i for i, x in enumerate(nodes, 1) if x[0] == 2]
    items = [f"2 2 1 1 {a} {b} {c}" for a, b, c in triangles] + [f"1 2 2 2 {a} {b}" for a, b in zip(inner, inner[1:])]
    items += [f"15 2 {tag} {tag} {node}" for tag, members in enumerate(sets.values(), 3) for node in members]
    names = ['2 1 "sheet"', '1 2 "line"', *(f'0 {tag} "{name}"' for tag, name in enumerate(sets, 3))]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(names)), *names, "$EndPhysicalNames", "$Nodes", str(len(nodes))]
    lines += [f"{i} {x!r} {y!r} {z!r}" for i, (x, y, z) in enumerate(nodes, 1)]
    lines += ["$EndNodes", "$Elements", str(len(items)), *(f"{i} {item}" for i, item in enumerate(items, 1)), "$EndElements"]
    path.write_text("\n".join(lines) + "\n")


class Case(unittest.TestCase):
    def setUp(self):
        self.path = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def call(self, *arguments, code=0, threads=1):
        run = subprocess.run([PROGRAM, *arguments], cwd=self.path, capture_output=True, text=True, check=False, timeout=120,
                             env={**os.environ, "OMP_NUM_THREADS": str(threads)})
        self.assertEqual(run.returncode, code, run.stdout + run.stderr)
        return run.stdout + run.stderr

    def rows(self):
        with open(self.path / "r.history.csv", encoding="ascii") as file:
            return [{k: float(v) for k, v in row.items() if k not in CLOCK} for row in csv.DictReader(file)]

    def solve(self, text, sheets=None, threads=1):
        if sheets:
            write_deck(self.path / "sheets.inp", sheets)
            write_gmsh(self.path / "sheets.msh", sheets)
        (self.path / "r.nml").write_text(text)
        self.call("run", "r.nml", threads=threads)
        return self.rows()

    def same(self, a, b, delta=1e-8, names=None):
        """The last rows agree, relative to the value or to 1e-3 of the largest."""
        names = names or [k for k in a[-1] if k in b[-1] and k not in ("increment", "iterations", "cuts", "residual", "correction")]
        for name in names:
            size = max(abs(a[-1][name]), abs(b[-1][name]), 1e-3)
            self.assertLess(abs(a[-1][name] - b[-1][name]), delta * size, f"{name}: {a[-1][name]} {b[-1][name]}")

    def both(self, rest, delta=1e-8, names=None):
        """The undivided sheet, and its tied halves: the same."""
        whole = self.solve(UNDIVIDED + MONITORS + rest, WHOLE)
        tied = self.solve(TIED + MONITORS + rest, HALVES)
        self.same(whole, tied, delta, names)
        return whole, tied

    def goes_on(self, text, sheets=None, at=None):
        """Restart from the middle, bit for bit; and two threads say the same."""
        text += "" if "restart =" in text else "&output restart = 'every' /\n"
        rows = self.solve(text, sheets)
        whole = self.rows()
        for number in at or (len(rows) // 2,):
            self.call("restart", "-q", "r", "--from", str(int(rows[number - 1]["increment"])))
            self.assertEqual(repr(self.rows()), repr(whole))
        self.assertEqual(repr(self.solve(text, threads=2)), repr(whole))
        return rows


class Tied(Case):
    def test_connectors(self):
        """Springs, a cable and masses on nodes that depend on others: at rest, in motion, modes, and after a restart."""
        _, tied = self.both(FORCE + CONNECTORS + f"&step {TIGHT} /\n")
        self.assertGreater(abs(tied[-1]["fc"]), 0.5)
        self.both(FORCE + CONNECTORS + f"&step {TIGHT} /\n&step control = 'frequencies' modes = 3 /\n", 1e-6, ["load_factor"])
        self.both(FORCE + CONNECTORS + f"&step control = 'dynamic' duration = 0.3 first_increment = 0.02 automatic = .false. {TIGHT} /\n", 1e-7,
                  ["x", "y", "z", "zm", "e", "fs", "fc", "kinetic_energy", "work"])
        self.goes_on(TIED + MONITORS + FORCE + CONNECTORS + "&step /\n&step control = 'dynamic' duration = 0.1 /\n", HALVES)

    def test_ways_of_solving(self):
        """Every control and kind of load across the tie; dashpots on it."""
        names = ["x", "y", "z", "zm", "e"]
        moved = "&step control = 'dynamic' duration = 0.2 first_increment = 0.02 automatic = .false. " + TIGHT + " /\n&output energy = .true. /\n"
        dashpots = ("&dashpot name = 'd' type = 'axes' node_set = 'b_x0' viscosity = 3.0 /\n"
                    "&dashpot name = 't' type = 'rotation' node_set = 'b_x0' viscosity = 1.0 /\n")
        for rest, more in ((FORCE + CONNECTORS + f"&step control = 'relax' {TIGHT} /\n", []),
                           (FORCE + CONNECTORS + f"&step mixed = .true. {TIGHT} /\n", []),
                           (FORCE + CONNECTORS + f"&step control = 'arc_length' load_factor = 1.0 {TIGHT} /\n", []),
                           (FORCE + CONNECTORS + "&step control = 'displacement' node_set = 'b_x0' component = 'z' displacements = 0.1, 0.2 " + TIGHT + " /\n",
                            ["load_factor"]),
                           (FORCE + CONNECTORS + "&step control = 'linear' /\n", ["fs", "fc"]),
                           (FORCE + CONNECTORS + dashpots + moved, ["kinetic_energy", "work"]),
                           (FORCE + f"&load type = 'foundation' normal = 3.0 tangential = 1.0 /\n&step {TIGHT} /\n", []),
                           (f"&load type = 'pressure' pressure = 3.0 /\n&step {TIGHT} /\n", []),
                           (FORCE + f"&imperfection wave_length = 1.0 amplitudes = 0.05 /\n&step {TIGHT} /\n", [])):
            with self.subTest(rest):
                self.both(rest, 1e-5, names + more)

    def test_energy(self):
        """What is left of the balance falls with the square of the increments, and is that of the undivided sheet."""
        left = []
        for size in (0.1, 0.05):
            step = f"&step first_increment = {size} automatic = .false. {TIGHT} /\n&output energy = .true. /\n"
            whole, tied = self.both(FORCE + CONNECTORS.replace("tension = 0.5 ", "") + step, 1e-8, ["stored_energy", "work", "z"])
            self.assertAlmostEqual(whole[-1]["energy_residual"] / tied[-1]["energy_residual"], 1, delta=1e-5)
            left.append(tied[-1]["energy_residual"] / tied[-1]["work"])
        self.assertLess(abs(left[1]), 2e-2)
        self.assertAlmostEqual(left[0] / left[1], 4, delta=0.5)

    def test_energy_of_tension(self):
        """The balance begins with what tension in the reference state stores, N = E A (l^2 - 1) l/2."""
        rows = self.solve(TIED + MONITORS + FORCE + CONNECTORS + f"&output energy = .true. /\n&step {TIGHT} /\n", HALVES)
        low, high = 1.0, 1.1
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if 10 * (middle**2 - 1) * middle < 0.5 else (low, middle)
        start = sum(20 * math.dist((2, y, 0), (2.5, 0.5, -3)) / low * (low**2 - 1)**2 / 8 for y in (0, 0.5, 1))
        self.assertGreater(start, 0.01)
        for row in rows:
            self.assertAlmostEqual(row["energy_residual"], row["stored_energy"] - row["work"] - start, delta=1e-12)

    def test_section_force(self):
        """Through a cut along a tie, and the end of a sheet that hangs on it."""
        monitors = "".join(f"&monitor name = 'S{c}' quantity = 'section_force' component = '{c}' element_set = 'b' node_set = 'b_x0' /\n"
                           f"&monitor name = 'R{c}' quantity = 'reaction' component = '{c}' node_set = 'a_x0' /\n" for c in "xyz")
        rows = self.solve(TIED + MONITORS + FORCE + monitors + f"&step {TIGHT} /\n", HALVES)
        for c, force in zip("xyz", (0, 2, 10)):
            self.assertAlmostEqual(rows[-1]["R" + c], -force, delta=1e-7)
            self.assertAlmostEqual(abs(rows[-1]["S" + c]), force, delta=1e-7)

    def test_buckling(self):
        self.both(PUSH + "&step control = 'buckling' modes = 3 /\n", 1e-7, ["load_factor"])

    def test_follower_line(self):
        """Arc-length with a load that turns with the tied edge."""
        step = FORCE.replace("10.0", "1.0") + f"&step control = 'arc_length' load_factor = 1.0 {TIGHT} /\n"
        load = "&load type = 'follower_line' edge_set = '{}' normal = {} tangential = {} /\n"
        whole = self.solve(UNDIVIDED.replace(".inp", ".msh") + MONITORS + load.format("line", 4, 0) + step, WHOLE)
        for tie in (TIED, TIED.replace("'b_x0' to", "'c' to").replace("'a_x1'", "'b_x0'").replace("'c'", "'a_x1'")):
            text = tie + MONITORS + load.format("boundary_1_2", 2, 0) + load.format("boundary_2_4", 2, 0) + step
            tied = self.solve(text, HALVES)
            self.same(whole, tied, 1e-7, ["x", "y", "z", "zm", "e"])
        self.goes_on(text, HALVES)

    def test_support_that_goes(self):
        """From a master, and from a node that depends on one: the end is that without the support."""
        free = self.solve(TIED + MONITORS + FORCE + f"&step {TIGHT} /\n", HALVES)
        for name in ("a_x1", "b_x0"):
            text = TIED + MONITORS + FORCE + f"&support node_set = '{name}' fixed = 'uz', 'ry' until_step = 1 /\n&step {TIGHT} /\n&step {TIGHT} /\n"
            rows = self.solve(text, HALVES)
            self.same(free, rows, 1e-7, ["x", "y", "z", "zm", "e"])
            self.assertLess(abs(next(r["zm"] for r in rows if r["load_factor"] == 1)), 1e-12)
            self.goes_on(text, HALVES, at=(2, len(rows) - 1))

    def test_imperfection(self):
        text = PUSH + "&imperfection step = 1 amplitudes = 0.05 /\n&step control = 'buckling' modes = 1 /\n&step load_factor = 20.0 {TIGHT} /\n"
        self.both(text.replace("{TIGHT}", TIGHT), 1e-6, ["x", "e"])

    def test_interrupted_before_a_stage(self):
        """Ctrl-C in the first step, while a support is still there that goes in the second; the run goes on bit for bit."""
        text = (TIED + MONITORS + FORCE + "&support node_set = 'a_x1' fixed = 'uz' until_step = 1 /\n"
                "&step first_increment = 0.002 automatic = .false. /\n&step load_factor = 1.1 first_increment = 0.01 automatic = .false. /\n")
        whole = self.solve(text, HALVES)
        for end in (".history.csv", ".restart", ".vtkhdf"):
            (self.path / ("r" + end)).unlink()
        run = subprocess.Popen([PROGRAM, "run", "-q", "r.nml"], cwd=self.path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                               env={**os.environ, "OMP_NUM_THREADS": "1"}, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
        deadline = time.time() + 300
        while run.poll() is None and time.time() < deadline:
            if (self.path / "r.history.csv").exists() and len((self.path / "r.history.csv").read_text().splitlines()) > 3:
                break
            time.sleep(0.001)
        run.send_signal(signal.SIGINT)
        said = "".join(run.communicate(timeout=300))
        self.assertEqual(run.returncode, 3, said)
        self.assertLess(self.rows()[-1]["load_factor"], 1)
        self.call("restart", "-q", "r")
        self.assertEqual(repr(self.rows()), repr(whole))

    def test_study(self):
        """Totals stay when meshes are refined: springs and forces `total` on the nodes of a tie and beside it."""
        text = (TIED + MONITORS + FORCE + "&spring name = 's' type = 'axes' node_set = 'b_x1' stiffness = 2.0 total = .true. /\n"
                "&monitor name = 'R' quantity = 'reaction' component = 'z' node_set = 'a_x0' /\n&step control = 'linear' /\n")
        write_deck(self.path / "sheets.inp", HALVES)
        (self.path / "r.nml").write_text(text)
        self.assertIn("Monitor R", self.call("study", "r.nml", "--levels", "2"))
        for more in ((), ("--refine", "1"), ("--refine", "2")):
            self.call("run", "r.nml", *more)
            last = self.rows()[-1]
            self.assertAlmostEqual(last["R"] + 10 - 2 * last["z"], 0, delta=0.02)

    def test_set_and_commands(self):
        self.solve(TIED + MONITORS + FORCE + CONNECTORS + f"&step {TIGHT} /\n", HALVES)
        stiff = self.rows()
        self.call("run", "r.nml", "--set", "spring[s].stiffness=30 0 80", "--set", "cable.tension=1.5", "--set", "node.position=2.5 0.5 -4.0")
        text = (self.path / "r.nml").read_text()
        changed = self.rows()
        self.assertNotAlmostEqual(stiff[-1]["z"], changed[-1]["z"], delta=1e-3)
        text = text.replace("3.0, 0.0, 8.0", "30 0 80").replace("tension = 0.5", "tension = 1.5").replace("2.5, 0.5, -3.0", "2.5 0.5 -4.0")
        self.assertEqual(repr(self.solve(text)), repr(changed))
        self.assertIn("It ended so: done", self.call("info", "r"))
        self.assertIn("fc", self.call("history", "r", "fc", "z"))
        said = self.call("check", "r.nml")
        self.assertIn("force (0, 0, -6.10000)", said)
        self.assertIn("Rigid-body motions: none is free", said)


class Rigid(Case):
    """A rigid end whose reference is a node of the mesh, or a node beside it at the same place."""
    BODY = SHEET + "&node_set name = 'corner' point = 4.0, 0.0, 0.0 /\n"
    OWN = BODY + "&rigid_body node_set = 'b_x1' reference = 'corner' /\n&node_set name = 'b_x1' x = 4.0 /\n"
    HUB = BODY + "&node name = 'hub' position = 4.0, 0.0, 0.0 /\n&rigid_body node_set = 'b_x1' reference = 'hub' /\n&node_set name = 'b_x1' x = 4.0 /\n"
    MORE = CONNECTORS.replace("'b_x0'", "'{0}'") + """&load type = 'force' node_set = '{0}' vector = 0.0, 2.0, 10.0 /
&load type = 'moment' node_set = '{0}' vector = 1.0, 0.0, 0.0 /
&monitor name = 'x' quantity = 'displacement' component = 'x' node_set = '{0}' /
&monitor name = 'z' quantity = 'displacement' component = 'z' node_set = '{0}' /
&monitor name = 'r' quantity = 'rotation' component = 'x' node_set = '{0}' /
&monitor name = 'zm' quantity = 'displacement' component = 'z' node_set = 'b_x1' /
&monitor name = 'e' quantity = 'energy' /
"""
    NAMES = ["x", "z", "r", "zm", "e", "fs", "fc"]

    def test_connectors(self):
        """On the reference node, and on one that depends on it."""
        for step, names in ((f"&step {TIGHT} /\n", self.NAMES),
                            (f"&step control = 'dynamic' duration = 0.3 first_increment = 0.02 automatic = .false. {TIGHT} /\n", self.NAMES),
                            (f"&step control = 'dynamic' scheme = 'conserving' duration = 0.3 first_increment = 0.02 automatic = .false. {TIGHT} /\n",
                             [*self.NAMES, "kinetic_energy", "work"])):
            with self.subTest(step):
                own = self.solve(self.OWN + self.MORE.format("corner") + step, WHOLE)
                for name in ("hub", "corner"):
                    self.same(own, self.solve(self.HUB + self.MORE.format(name) + step, WHOLE), 1e-6, names)
        calm = self.MORE.replace("&load type = 'moment'", "!")
        step = f"&step {TIGHT} /\n&step control = 'frequencies' modes = 3 /\n"
        self.same(self.solve(self.OWN + calm.format("corner") + step, WHOLE), self.solve(self.HUB + calm.format("hub") + step, WHOLE), 1e-6, ["load_factor"])
        self.goes_on(self.HUB + self.MORE.format("corner") + "&step /\n&step control = 'dynamic' duration = 0.1 /\n", WHOLE)

    def test_rotation_by_an_amplitude(self):
        """Forth and back along a table: where the table is at 0.5 of its rotation, so is the sheet."""
        text = (self.HUB + MONITORS.replace("'b_x0'", "'mid'") + "&node_set name = 'mid' x = 2.0 /\n&output energy = .true. restart = 'every' /\n"
                "&support node_set = 'hub' ry = {} fixed = 'rx', 'rz', 'uy' {} /\n" + FORCE.replace("b_x1", "hub")
                + "&monitor name = 'm' quantity = 'reaction_moment' component = 'y' node_set = 'hub' /\n")
        rows = self.goes_on(text.format(-2.0, "amplitude = 'a'") + "&amplitude name = 'a' points = 0, 0, 0.5, 1, 1, 0.25 /\n"
                            + f"&step {TIGHT} largest_increment = 0.05 /\n", WHOLE)
        plain = self.solve(text.format(-0.5, "") + f"&step {TIGHT} /\n", WHOLE)
        self.same(plain, rows, 1e-7, ["x", "y", "z", "zm", "e", "m"])
        self.assertLess(abs(rows[-1]["energy_residual"]), 2e-2 * max(abs(row["work"]) for row in rows))

    def test_momenta(self):
        """A rigid sheet with a heavy node outside it flies: what it has stays."""
        rows = self.goes_on("""&mesh generator = 'rectangle' lengths = 3.0, 1.0 divisions = 6, 2 /
&material name = 'm' law = 'st_venant_kirchhoff' e = 1.2e6 nu = 0.3 density = 10.0 /
&section thickness = 0.1 /
&node name = 'hub' position = 0.5, -0.4, 0.3 /
&rigid_body node_set = 'edge_x0' reference = 'hub' /
&point_mass name = 'p' node_set = 'hub' mass = 2.0 inertia = 0.3 /
&point_mass name = 'q' node_set = 'corner_x0_y1' mass = 1.0 /
&initial_velocity node_set = 'all' velocity = 1.0, 0.0, 0.0 spin = 1.0, 3.0, 0.5 /
&step control = 'dynamic' duration = 1.0 scheme = 'conserving' """ + TIGHT + " /\n", at=(5,))
        for key in ("momentum", "angular_momentum"):
            start = [rows[0][f"{key}_{c}"] for c in "xyz"]
            for row in rows:
                change = math.dist([row[f"{key}_{c}"] for c in "xyz"], start)
                self.assertLess(change, 1e-9 * math.hypot(*start), key)

    def test_displacement_of_the_reference(self):
        text = self.HUB + MONITORS.replace("'b_x0'", "'hub'") + FORCE.replace("b_x1", "hub")
        rows = self.solve(text + f"&step control = 'displacement' node_set = 'hub' component = 'z' displacements = 0.5, 1.0 {TIGHT} /\n", WHOLE)
        self.assertAlmostEqual(rows[-1]["zm"], 1, delta=1e-9)
        again = self.solve(text + f"&step load_factor = {rows[-1]['load_factor']!r} {TIGHT} /\n")
        self.same(rows, again, 1e-7, ["x", "y", "z", "e"])

    def test_released(self):
        """A support of the reference node goes: the end is that without it; let go into a motion, the energy stays."""
        text = self.HUB + MONITORS.replace("'b_x0'", "'hub'") + "&output energy = .true. restart = 'every' /\n"
        free = self.solve(text + FORCE.replace("b_x1", "hub") + f"&step {TIGHT} /\n", WHOLE)
        held = FORCE.replace("b_x1", "hub") + "&support node_set = 'hub' uz = 0.5 ry = -0.2 fixed = 'rx', 'rz' until_step = 1 /\n"
        rows = self.solve(text + held + f"&step {TIGHT} /\n&step {TIGHT} /\n")
        self.same(free, rows, 1e-7, ["x", "y", "z", "zm", "e"])
        rows = self.goes_on(text + f"&support node_set = 'hub' uz = 0.5 until_step = 1 /\n&step {TIGHT} /\n&step control = 'dynamic' duration = 0.1 "
                            f"scheme = 'conserving' first_increment = 0.005 automatic = .false. {TIGHT} /\n", WHOLE)
        energy = [row["e"] + row["kinetic_energy"] for row in rows if row["time"] > 0]
        self.assertGreater(energy[-1], 0.1)
        self.assertAlmostEqual(max(energy) / min(energy), 1, delta=1e-9)


def box(path, n, top="shared", m=None):
    """A cube with outward normals; its top on the same nodes, on nodes of its own at the same places, or finer (m) on its own."""
    nodes, index, sets = [], {}, {"bottom": [], "sides": [], "top": []}

    def node(part, x):
        key = (part if top == "own" else "", *(round(c, 9) for c in x))
        if key not in index:
            nodes.append(x)
            index[key] = len(nodes)
        return index[key]

    def face(name, origin, a, b, k):
        part = "top" if name == "top" else "rest"

        def at(i, j):
            return node(part, [origin[c] + a[c] * i / k + b[c] * j / k for c in range(3)])
        for i in range(k):
            for j in range(k):
                p, q, r, s = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
                sets[name] += [(p, q, r), (p, r, s)]

    face("bottom", (0, 0, 0), (0, 1, 0), (1, 0, 0), n)
    face("sides", (0, 0, 0), (1, 0, 0), (0, 0, 1), n)
    face("sides", (1, 0, 0), (0, 1, 0), (0, 0, 1), n)
    face("sides", (1, 1, 0), (-1, 0, 0), (0, 0, 1), n)
    face("sides", (0, 1, 0), (0, -1, 0), (0, 0, 1), n)
    face("top", (0, 0, 1), (1, 0, 0), (0, 1, 0), m or n)
    lines = ["*NODE", *(f"{i}, {x[0]!r}, {x[1]!r}, {x[2]!r}" for i, x in enumerate(nodes, 1))]
    e = 0
    for name, triangles in sets.items():
        lines.append(f"*ELEMENT, TYPE=S3, ELSET={name}")
        for triangle in triangles:
            e += 1
            lines.append(f"{e}, {triangle[0]}, {triangle[1]}, {triangle[2]}")
    members = {name: sorted({v for t in triangles for v in t}) for name, triangles in sets.items()}
    on_top = {tuple(x) for x in (nodes[v - 1] for v in members["top"]) if x[0] in (0, 1) or x[1] in (0, 1)}
    members["rim"] = [v for v in members["top"] if tuple(nodes[v - 1]) in on_top]
    members["edge"] = [v for v in members["sides"] if nodes[v - 1][2] == 1]
    for name, found in members.items():
        lines.append(f"*NSET, NSET={name}n")
        lines += [", ".join(map(str, found[i:i + 8])) for i in range(0, len(found), 8)]
    path.write_text("\n".join(lines) + "\n")


class Chambers(Case):
    BOX = """&mesh file = 'box.inp' normals = 'facet' /
&material name = 'm' law = 'neo_hookean' mu = 1.0 density = 1.0 /
&section thickness = 0.05 /
&support node_set = 'bottomn' type = 'clamped' /
&node_set name = 'up' z = 1.0 /
&monitor name = 'z' quantity = 'displacement' component = 'z' node_set = 'up' reduce = 'max' /
&monitor name = 'e' quantity = 'energy' /
"""
    GAS = "&chamber name = 'g' fluid = 'gas' ambient = 0.1 inflow = 0.3 /\n"
    TIE = "&tie node_set = 'rimn' to_node_set = 'edgen' /\n"

    def solve_box(self, text, *arguments):
        box(self.path / "box.inp", *arguments)
        return self.solve(text)

    NAMES = ["z", "e", "pressure_g", "volume_g"]

    def test_tied_wall(self):
        """A lid on nodes of its own, tied: as on the same nodes, by gas and by volume control, at rest and in motion."""
        step = f"&step {TIGHT} /\n"
        whole = self.solve_box(self.BOX + self.GAS + step, 3)
        tied = self.solve_box(self.BOX + self.TIE + self.GAS + step, 3, "own")
        self.same(whole, tied, 1e-8, self.NAMES)
        self.assertGreater(whole[-1]["z"], 0.05)
        by_elements = self.TIE.replace("to_node_set = 'edgen'", "to_element_set = 'sides'")
        self.same(whole, self.solve_box(self.BOX + by_elements + self.GAS + step, 3, "own"), 1e-6, self.NAMES)
        pressure = "&load type = 'pressure' pressure = 1.0 /\n"
        step = f"&step control = 'volume' volumes = 1.05, 1.1 {TIGHT} /\n"
        whole = self.solve_box(self.BOX + pressure + step, 3)
        tied = self.solve_box(self.BOX + self.TIE + pressure + step, 3, "own")
        self.same(whole, tied, 1e-8, ["z", "e", "load_factor"])
        step = f"&step control = 'dynamic' duration = 0.4 first_increment = 0.02 automatic = .false. {TIGHT} /\n&output energy = .true. /\n"
        whole = self.solve_box(self.BOX + self.GAS + step, 3)
        tied = self.solve_box(self.BOX + self.TIE + self.GAS + step, 3, "own")
        self.same(whole, tied, 1e-6, [*self.NAMES, "kinetic_energy", "work"])

    def test_finer_lid(self):
        """A lid of a mesh twice as fine, tied to the sides: close to the lid that fits, and the same as a prescribed pressure."""
        own = self.solve_box(self.BOX + self.GAS + f"&step {TIGHT} /\n", 4)
        tie = self.TIE.replace("to_node_set = 'edgen'", "to_element_set = 'sides'")
        finer = self.solve_box(self.BOX + tie + self.GAS + f"&step {TIGHT} /\n", 4, "own", 8)
        self.same(own, finer, 0.1, self.NAMES)
        pressure = f"&load type = 'pressure' pressure = {finer[-1]['pressure_g']!r} /\n"
        self.same(finer, self.solve(self.BOX + tie + pressure + f"&step {TIGHT} /\n"), 1e-7, ["z", "e"])
        self.assertAlmostEqual((finer[-1]["pressure_g"] + 0.1) * finer[-1]["volume_g"], 0.1 * 1.3, delta=1e-9)

    def test_ways_of_solving(self):
        for gas, step, names in ((self.GAS, f"&step control = 'relax' {TIGHT} /\n", self.NAMES),
                                 (self.GAS, f"&step control = 'arc_length' load_factor = 1.0 {TIGHT} /\n", self.NAMES),
                                 (self.GAS, f"&step {TIGHT} /\n&step control = 'frequencies' modes = 3 /\n", ["load_factor"]),
                                 (self.GAS, "&step control = 'linear' /\n", self.NAMES),
                                 ("&chamber name = 'g' fluid = 'liquid' inflow = 0.05 /\n", f"&step {TIGHT} /\n", self.NAMES),
                                 ("&chamber name = 'g' fluid = 'liquid' inflow = 0.05 /\n",
                                  f"&step control = 'dynamic' duration = 0.2 first_increment = 0.02 automatic = .false. {TIGHT} /\n", self.NAMES),
                                 ("&load type = 'hydrostatic' level = 0.9 weight = 0.1 /\n", f"&step {TIGHT} /\n", ["z", "e"])):
            with self.subTest(step):
                whole = self.solve_box(self.BOX + gas + step, 3)
                self.same(whole, self.solve_box(self.BOX + self.TIE + gas + step, 3, "own"), 1e-4, names)

    def test_motion_keeps_the_balance(self):
        """By the conserving scheme nothing of the energy is lost, with gas behind a tied lid."""
        rows = self.solve_box(self.BOX + self.TIE + self.GAS + "&output energy = .true. /\n&step control = 'dynamic' scheme = 'conserving' duration = 0.2 "
                              f"first_increment = 0.005 automatic = .false. {TIGHT} /\n", 3, "own")
        self.assertGreater(rows[-1]["work"], 1e-4)
        for row in rows:
            self.assertAlmostEqual(row["stored_energy"] + row["kinetic_energy"], row["work"], delta=1e-9 * rows[-1]["work"])

    def test_twisted_plate(self):
        """A rigid lid turned forth and back by a table over gas: the same under the pressure that is found."""
        box(self.path / "box.inp", 3)
        text = (self.BOX + "&node name = 'hub' position = 0.5, 0.5, 1.0 /\n&rigid_body node_set = 'topn' reference = 'hub' /\n"
                "&support node_set = 'hub' rz = 0.4 fixed = 'ux', 'uy', 'rx', 'ry' amplitude = 'a' /\n"
                "&amplitude name = 'a' points = 0, 0, 0.5, 1.5, 1, 1 /\n&output energy = .true. restart = 'every' /\n"
                "&monitor name = 'm' quantity = 'reaction_moment' component = 'z' node_set = 'hub' /\n")
        rows = self.goes_on(text + self.GAS + f"&step {TIGHT} /\n")
        self.assertLess(abs(rows[-1]["energy_residual"]), 0.05 * rows[-1]["work"])
        pressure = f"&load type = 'pressure' pressure = {rows[-1]['pressure_g']!r} /\n"
        self.same(rows, self.solve(text + pressure + f"&step {TIGHT} /\n"), 1e-7, ["z", "e", "m"])

    def test_all_at_once(self):
        """A tied lid, a heavy hub on a spring, a gas that follows a table, supports that go, four controls: restart and threads."""
        box(self.path / "box.inp", 3, "own")
        text = (self.BOX + self.TIE + self.GAS.replace("/", "amplitude = 'a' /") + "&amplitude name = 'a' points = 0, 0, 0.5, 1, 2, 0.5 /\n"
                "&node name = 'hub' position = 0.5, 0.5, 1.3 /\n&node_set name = 'mid' point = 0.6666666666666666, 0.6666666666666666, 1.0 /\n"
                "&rigid_body node_set = 'mid' reference = 'hub' /\n"
                "&spring name = 's' type = 'line' node_set = 'hub' anchor = 0.5, 0.5, 3.0 stiffness = 0.2 /\n"
                "&point_mass name = 'p' node_set = 'hub' mass = 0.1 inertia = 0.01 /\n"
                "&support node_set = 'hub' fixed = 'ux', 'uy' until_step = 1 /\n&support node_set = 'edgen' fixed = 'ux' until_step = 2 /\n"
                "&output energy = .true. restart = 'every' /\n"
                "&step /\n&step load_factor = 1.5 /\n&step control = 'arc_length' load_factor = 2.0 /\n&step control = 'dynamic' duration = 0.2 /\n")
        (self.path / "r.nml").write_text(text)
        self.call("check", "r.nml")
        rows = self.solve(text)
        for row in rows:
            self.assertAlmostEqual((row["pressure_g"] + 0.1) * row["volume_g"], 0.1 * row["amount_g"], delta=1e-9)
        self.goes_on(text, at=(2, len(rows) // 2, len(rows) - 3))

    def test_refined(self):
        """`--refine` and `study` on a tied lid and on a rigid one: as with the mesh made so."""
        step = self.GAS + f"&step {TIGHT} /\n"
        self.solve_box(self.BOX + self.TIE + step, 2, "own")
        self.call("run", "r.nml", "--refine", "1")
        tied = self.rows()
        self.solve_box(self.BOX + step, 2)
        self.call("run", "r.nml", "--refine", "1")
        self.same(tied, self.rows(), 1e-7, self.NAMES)
        plate = "&node name = 'hub' position = 0.5, 0.5, 1.2 /\n&rigid_body node_set = 'topn' reference = 'hub' /\n"
        self.solve_box(self.BOX + plate + step, 2)
        self.call("run", "r.nml", "--refine", "1")
        refined = self.rows()
        self.same(refined, self.solve_box(self.BOX + plate + step, 4), 1e-7, ["pressure_g", "volume_g", "e"])
        self.assertIn("Monitor z", self.call("study", "r.nml", "--levels", "2"))

    def test_not_closed(self):
        """A lid that lies on the walls, and is tied at one corner only: no volume, and said so."""
        box(self.path / "box.inp", 3, "own")
        text = self.BOX + "&node_set name = 'corner' nodes = 53 /\n&tie node_set = 'corner' to_node_set = 'edgen' /\n&support node_set = 'topn' fixed = 'ux' /\n"
        (self.path / "r.nml").write_text(text + "&step /\n")
        self.call("check", "r.nml")
        (self.path / "r.nml").write_text(text + self.GAS + "&step /\n")
        self.assertIn("the elements do not enclose a volume", self.call("check", "r.nml", code=2))

    def test_rigid_end_plate(self):
        """The lid a rigid body, with a spring and a mass on its reference: the springs bear what the walls do not; as with a lid 50 times as thick."""
        plate = ("&node name = 'hub' position = 0.5, 0.5, 1.2 /\n&rigid_body node_set = 'topn' reference = 'hub' /\n"
                 "&spring name = 's' type = 'axes' node_set = 'hub' stiffness = 0.0, 0.0, 0.4 /\n"
                 "&point_mass name = 'p' node_set = 'hub' mass = 0.1 inertia = 0.01 /\n"
                 "&monitor name = 'f' quantity = 'connector_force' connector = 's' /\n"
                 "&monitor name = 'R' quantity = 'reaction' component = 'z' node_set = 'bottomn' /\n"
                 "&monitor name = 'h' quantity = 'displacement' component = 'z' node_set = 'hub' /\n"
                 "&monitor name = 't' quantity = 'rotation' component = 'x' node_set = 'hub' /\n")
        rows = self.solve_box(self.BOX + plate + self.GAS + f"&step {TIGHT} /\n", 3)
        last = rows[-1]
        self.assertAlmostEqual((last["pressure_g"] + 0.1) * last["volume_g"], 0.1 * 1.3, delta=1e-9)
        self.assertAlmostEqual(last["z"], last["h"], delta=1e-3)
        pressure = f"&load type = 'pressure' pressure = {last['pressure_g']!r} /\n"
        self.same(rows, self.solve(self.BOX + plate + pressure + f"&step {TIGHT} /\n"), 1e-7, ["z", "e", "h", "f", "R"])
        thick = self.BOX.replace("&section thickness = 0.05 /", "&section thickness = 0.05 element_set = 'bottom', 'sides' /\n&section thickness = 1.0 element_set = 'top' /")
        other = plate.replace("&rigid_body node_set = 'topn' reference = 'hub' /", "&rigid_body node_set = 'middle' reference = 'hub' /\n&node_set name = 'middle' point = 0.5, 0.5, 1.0 /")
        step = self.GAS + f"&step {TIGHT} /\n"
        rigid, stiff = self.solve_box(self.BOX + plate + step, 4), self.solve_box(thick + other + step, 4)
        self.same(rigid, stiff, 2e-3, ["pressure_g", "volume_g"])
        self.same(rigid, stiff, 0.1, ["h", "f"])
        self.goes_on(self.BOX + plate + self.GAS + "&output energy = .true. restart = 'every' /\n&step /\n&step control = 'dynamic' duration = 0.3 /\n")

    def test_energy(self):
        left = []
        for size in (0.1, 0.05):
            rows = self.solve_box(self.BOX + self.TIE + self.GAS + f"&output energy = .true. /\n&step first_increment = {size} automatic = .false. {TIGHT} /\n", 3, "own")
            left.append(rows[-1]["energy_residual"] / rows[-1]["work"])
        self.assertLess(abs(left[1]), 2e-3)
        self.assertAlmostEqual(left[0] / left[1], 4, delta=0.3)

    def test_amplitudes_and_stages(self):
        """A load on the lid by a table, and supports that go: an elastic state does not depend on the way."""
        push = "&load type = 'force' node_set = 'topn' vector = 0, 0, -0.02 total = .true. {} /\n"
        table = "&amplitude name = 'a' points = 0, 0, 0.5, 1, 1, 0.5 /\n"
        held = "&support node_set = 'edgen' fixed = 'ux', 'uy' until_step = 1 /\n"
        plain = self.solve_box(self.BOX + self.GAS + push.format("").replace("0.02", "0.01") + f"&step {TIGHT} /\n", 3)
        rows = self.solve_box(self.BOX + self.GAS + push.format("amplitude = 'a'") + table + held + f"&step {TIGHT} /\n&step {TIGHT} /\n", 3)
        self.same(plain, rows, 1e-7, self.NAMES)
        rows = self.goes_on(self.BOX + self.GAS + push.format("amplitude = 'a'") + table + held + "&step /\n&step /\n", at=(2, len(rows) - 1))
        # of the inflow itself
        half = self.solve(self.BOX + self.GAS.replace("0.3", "0.15") + f"&step {TIGHT} /\n")
        rows = self.goes_on(self.BOX + self.GAS.replace("/", "amplitude = 'a' /") + table + f"&step {TIGHT} /\n")
        self.same(half, rows, 1e-7, [*self.NAMES, "amount_g"])


if __name__ == "__main__":
    unittest.main()
