#!/usr/bin/env python3
"""finshell convert: what becomes of steps, amplitudes, joints and plane elements, and that all else is named with its line."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

NX, NY = 4, 2
SHEET = ["*NODE", *(f"{1 + i + 10 * j}, {i}., {j / NY}, 0." for j in range(NY + 1) for i in range(NX + 1)), "91, 4.5, 0.5, 0.", "92, 4.5, 0.5, 0."]
CELLS = [", ".join(map(str, (1 + i + NX * j, *(1 + i + a + 10 * (j + b) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))))))
         for j in range(NY) for i in range(NX)]
SETS = ["*NSET, NSET=root", "1, 11, 21", "*NSET, NSET=tip", "5, 15, 25", "*NSET, NSET=mid", "3, 13, 23", "*NSET, NSET=turn", "92",
        "*ELSET, ELSET=end", "4, 8", "*MATERIAL, NAME=m", "*ELASTIC", "1000., 0.3", "*DENSITY", "1e-3"]
SHELL = [*SHEET, "*ELEMENT, TYPE=S4, ELSET=all_of_it", *CELLS, *SETS, "*SHELL SECTION, ELSET=all_of_it, MATERIAL=m", "0.1",
         "*BOUNDARY", "root, 1, 6"]
PLANE = [*SHEET, "*ELEMENT, TYPE=CPS4, ELSET=all_of_it", *CELLS, *SETS, "*SOLID SECTION, ELSET=all_of_it, MATERIAL=m", "0.1",
         "*BOUNDARY", "root, 1, 2"]


def step(*cards, control=("*STATIC",), more=", NLGEOM"):
    return ["*STEP" + more, *control, *cards, "*END STEP"]


class Decks(unittest.TestCase):
    def convert(self, cards, run=True, monitors=""):
        """The groups of the namelist, what is said, and the rows of the history."""
        with tempfile.TemporaryDirectory() as folder:
            def call(*words):
                return subprocess.run([os.environ["FINSHELL_BIN"], *words], cwd=folder, capture_output=True, text=True, check=False)
            (Path(folder) / "d.inp").write_text("\n".join(cards) + "\n")
            made = call("convert", "d.inp")
            self.assertEqual(made.returncode, 0, made.stderr)
            text = (Path(folder) / "d.nml").read_text()
            rows = []
            if run:
                (Path(folder) / "d.nml").write_text(text + monitors)
                ran = call("run", "-q", "d.nml")
                self.assertEqual(ran.returncode, 0, text + ran.stderr)
                rows = list(csv.DictReader((Path(folder) / "d.history.csv").read_text().splitlines()))
            return [line for line in text.splitlines() if not line.startswith("!")], made.stdout, rows

    def holds(self, cards, *lines, absent=(), run=True):
        groups, said, _ = self.convert(cards, run)
        for line in lines:
            self.assertIn(line, groups)
        for word in absent:
            self.assertNotIn(word, "\n".join(groups))
        return said

    def names(self, cards, run=True, **expected):
        """Exactly these are named as not taken: part of the card -> words behind its keyword; lines of the deck count from 1."""
        _, said, _ = self.convert(cards, run)
        rows = [row for row in said.splitlines() if row.startswith("d.inp:")]
        self.assertEqual(len(rows), len(expected), said)
        for row, words in zip(rows, expected.values()):
            self.assertIn(words, row)
            self.assertIn(row.split("*")[1].split(":")[0], " ".join(cards[:int(row.split(":")[1])]))

    def test_one_step_needs_no_table(self):
        self.holds([*SHELL, *step("*CLOAD", "tip, 3, 1e-4")], "&load type = 'force' node_set = 'tip' vector = .0, .0, 1.0E-04 /",
                   "&support node_set = 'root' type = 'clamped' /", "&step control = 'load' /", absent=("amplitude", "_step"))

    def test_loads_of_one_step_add_up(self):
        monitor = "&monitor name = 'f' quantity = 'reaction' component = 'z' node_set = 'root' reduce = 'sum' /\n"
        _, _, rows = self.convert([*SHELL, *step("*CLOAD", "tip, 3, 1e-4", "5, 3, 2e-4", "tip, 3, 1e-4")], monitors=monitor)
        self.assertAlmostEqual(float(rows[-1]["f"]) / -8e-4, 1, delta=2e-3)

    def test_a_part_of_a_set_is_replaced(self):
        monitor = "&monitor name = 'f' quantity = 'reaction' component = 'z' node_set = 'root' reduce = 'sum' /\n"
        cards = [*SHELL, *step("*CLOAD", "tip, 3, 1e-4"), *step("*CLOAD", "5, 3, -1e-4"), *step("*CLOAD, OP=NEW", "tip, 3, 3e-4")]
        groups, said, rows = self.convert(cards, monitors=monitor)
        self.assertNotIn("NOT TAKEN", said)
        for at, total in ((1, 3e-4), (2, 1e-4), (3, 9e-4)):
            row = next(row for row in rows if abs(float(row["load_factor"]) - at) < 1e-9)
            self.assertAlmostEqual(float(row["f"]) / -total, 1, delta=5e-3, msg="\n".join(groups))

    def test_linear_steps_are_apart(self):
        self.holds([*SHELL, *step("*CLOAD", "tip, 3, 1e-4", more=""), *step("*CLOAD", "tip, 3, 2e-4", more=""), *step(more="")],
                   "&load type = 'force' node_set = 'tip' vector = .0, .0, 1.0E-04 until_step = 1 /",
                   "&load type = 'force' node_set = 'tip' vector = .0, .0, 2.0E-04 from_step = 2 /", absent=("amplitude",))

    def test_a_prestressed_plate_buckles(self):
        cards = [*SHELL, *step("*CLOAD", "tip, 1, -1e-4"), *step("*CLOAD", "tip, 1, -1e-3", control=("*BUCKLE", "1")),
                 *step("*CLOAD", "tip, 3, 1e-4")]
        _, said, rows = self.convert(cards)
        self.assertNotIn("NOT TAKEN", said)
        # three nodes, EI pi^2/(4 L^2) within the Poisson effect; it counts from the load factor 1 of the step before
        euler = 3.1416**2 * 1000 * 0.1**3 / 12 / 4 / 16
        buckling = [float(row["load_factor"]) for row in rows if float(row["load_factor"]) > 2.5][0]
        self.assertAlmostEqual((3e-4 + 3e-3 * (buckling - 1)) / euler, 1.04, delta=0.06)
        self.assertAlmostEqual(float(rows[-1]["load_factor"]), 2, delta=1e-9)

    def test_perturbations_of_a_linear_preload(self):
        cards = [*SHELL, *step("*CLOAD", "tip, 1, -1e-4", more=""), *step("*CLOAD", "tip, 1, -1e-3", control=("*BUCKLE", "1"), more=""),
                 *step("*CLOAD", "tip, 3, 1e-4", more=", PERTURBATION")]
        self.names(cards, linear="a linear step among others")
        monitor = "&monitor name = 'f' quantity = 'reaction' component = 'z' node_set = 'root' reduce = 'sum' /\n"
        self.assertAlmostEqual(float(self.convert(cards, monitors=monitor)[2][-1]["f"]) / -3e-4, 1, delta=1e-6)

    def test_explicit_steps(self):
        cards = [*SHELL, "*AMPLITUDE, NAME=a", "0., 0., 0.01, 1., 0.02, 0.", *step("*CLOAD, AMPLITUDE=a", "tip, 3, 1e-4", control=("*DYNAMIC, EXPLICIT", ", 0.02"))]
        _, said, rows = self.convert(cards)
        self.assertNotIn("NOT TAKEN", said)
        self.assertAlmostEqual(float(rows[-1]["time"]), 0.02, delta=1e-9)
        halfway = min(rows, key=lambda row: abs(float(row["time"]) - 0.01))
        self.assertGreater(float(halfway["factor_history_1"]), 0.97)
        self.assertLess(abs(float(rows[-1]["factor_history_1"])), 1e-9)

    def test_riks_after_a_preload(self):
        self.holds([*SHELL, *step("*CLOAD", "tip, 1, 1e-3"), *step("*CLOAD", "tip, 3, 1e-4", control=("*STATIC, RIKS", "0.1, 1., , , 2."))],
                   "&load type = 'force' node_set = 'tip' vector = .0, .0, 1.0E-04 case = 'step_2' /",
                   "&step control = 'arc_length' case = 'step_2' first_increment = .1 load_factor = 2.0 /")

    def test_amplitudes(self):
        table = ["*AMPLITUDE, NAME=a, TIME=TOTAL TIME", "0., 0., 1., 1., 3., 2.,", "7., 0."]
        self.holds([*SHELL, *table, *step("*CLOAD, AMPLITUDE=A", "tip, 3, 1e-4", control=("*STATIC", "0.5, 2.")), *step(control=("*STATIC", "1., 2."))],
                   "&amplitude name = 'history_1' points = .0, .0,  .5, .5,  1.5, 1.0,  2.0, .75 /",
                   "&step control = 'load' load_factor = 1.0 first_increment = .25 /")
        # a sudden load stays, one with a table follows it
        self.holds([*SHELL, *table, *step("*CLOAD", "tip, 3, 1e-4", "*DLOAD, AMPLITUDE=a", "end, P, 1e-5", control=("*DYNAMIC", "0.05, 0.5"))],
                   "&amplitude name = 'history_1' points = .0, 1.0,  1.0, 1.0 /", "&load type = 'pressure' element_set = 'end' pressure = 5.0E-06 /",
                   "&step control = 'dynamic' duration = .5 first_increment = .05 times = .5 factors = 1.0 /")
        self.names([*SHELL, "*AMPLITUDE, NAME=s, DEFINITION=SMOOTH STEP", "0., 0., 1., 1.", "*AMPLITUDE, NAME=o", "0., 0., 0., 1.", "*AMPLITUDE, NAME=x",
                    "0., 0., 1.", "*AMPLITUDE, NAME=y", "0., 0., q, 1.", "*AMPLITUDE, NAME=v, VALUE=ABSOLUTE", "0., 0., 1., 1.",
                    *step("*CLOAD, AMPLITUDE=s", "tip, 3, 1e-5", "*CLOAD, AMPLITUDE=o", "tip, 3, 1e-5", "*CLOAD, AMPLITUDE=x", "tip, 3, 1e-5",
                          "*CLOAD, AMPLITUDE=y", "tip, 3, 1e-5", "*CLOAD, AMPLITUDE=none", "tip, 3, 1e-5", "*CLOAD, AMPLITUDE=v", "tip, 3, 1e-5")],
                   s="DEFINITION = SMOOTH STEP", o="its times do not ascend", x="pairs of time and factor", y="'q' is no number",
                   none="there is no *AMPLITUDE 'none'", v="VALUE = ABSOLUTE")

    def test_supports(self):
        self.holds([*SHELL, *step("*BOUNDARY", "tip, 3, , 0.1"), *step("*BOUNDARY, OP=NEW", "root, ENCASTRE")],
                   "&support node_set = 'tip' uz = .1 amplitude = 'history_1' until_step = 1 /", "&support node_set = 'root' type = 'clamped' /")
        self.names([*SHELL, *step("*CLOAD", "tip, 3, 1e-4"), *step("*BOUNDARY", "mid, 3"), *step("*BOUNDARY, FIXED", "tip, 3")],
                   late="a support that comes with a later step")
        self.names([*SHELL, *step("*BOUNDARY", "tip, 3, 3, 0.01", control=("*DYNAMIC", "0.05, 0.5"))], jump="a support that jumps")
        self.names([*SHELL, *step("*CLOAD", "tip, 3, 1e-5"), *step("*BOUNDARY, FIXED", "tip, 3, 3, 0.1", control=("*STATIC, RIKS", "0.1, 1., , , 1."))],
                   run=False, riks="a support that moves in a step of RIKS")

    def test_joints(self):
        for cards in (["*RIGID BODY, NSET=tip, REF NODE=91"], ["*SURFACE, NAME=s, TYPE=NODE", "tip", "*COUPLING, REF NODE=91, SURFACE=s", "*KINEMATIC", "1, 6"],
                      ["*KINEMATIC COUPLING, REF NODE=91", "tip, 1, 6"]):
            with self.subTest(cards[-1]):
                name = "s" if "SURFACE" in cards[0] else "tip"
                said = self.holds([*SHELL, *cards, *step("*CLOAD", "91, 3, 1e-4")], f"&rigid_body node_set = '{name}' reference = 'node_91' /",
                                  "&node name = 'node_91' position = 4.5, .5, .0 /")
                self.assertNotIn("NOT TAKEN", said)
        self.holds([*SHELL, "*RIGID BODY, ELSET=end, REF NODE=91, ROT NODE=92", *step("*CLOAD", "turn, 2, 1e-4", "*BOUNDARY", "92, 1, 3")],
                   "&load type = 'moment' node_set = 'node_91' vector = .0, 1.0E-04, .0 /", "&node_set name = 'nodes_of_end' element_set = 'end' /",
                   "&support node_set = 'node_91' fixed = 'rx' 'ry' 'rz' /", run=False)
        self.holds([*SHELL, "*KINEMATIC COUPLING, REF NODE=15", "tip, 1, 3", *step("*CLOAD", "15, 3, 1e-4")],
                   "&rigid_body node_set = 'part_1' reference = 'node_15' rotations = .false. /")
        self.holds([*SHELL, "*MPC", "PIN, 5, 25", "BEAM, 15, 91", *step("*CLOAD", "91, 3, 1e-4")],
                   "&equation node_set = 'node_5', 'node_25' components = 'uz', 'uz' coefficients = 1.0, -1.0 /",
                   "&rigid_body node_set = 'node_15' reference = 'node_91' /")
        self.names([*SHELL, "*MPC", "TIE, 5, 25", "LINK, 5, 25", "*KINEMATIC COUPLING, REF NODE=91", "tip, 1, 2", "*TIE, NAME=t", "tip, none",
                    "*RIGID BODY, NSET=none, REF NODE=91", "*TIE, CYCLIC SYMMETRY, NAME=u", "tip, root", "*DISTRIBUTING COUPLING",
                    *step("*CLOAD", "tip, 3, 1e-4")],
                   tie="TIE of nodes that are not at one place", link="BEAM, TIE or PIN", plane="in all displacements", none="two surfaces",
                   body="NSET or ELSET", cyclic="CYCLIC SYMMETRY", distributing="*DISTRIBUTING COUPLING")

    def test_temperatures(self):
        model = ["*NODE, NSET=NALL", "1, 0, 0, 0", "2, 5, 0, 0", "3, 10, 0, 0", "4, 0, 1, 0", "5, 5, 1, 0", "6, 10, 1, 0",
                 "*ELEMENT, TYPE=S4, ELSET=EALL", "1, 1, 2, 5, 4", "2, 2, 3, 6, 5", "*NSET, NSET=LEFT", "1, 4", "*NSET, NSET=RIGHT", "3, 6",
                 "*MATERIAL, NAME=STEEL", "*ELASTIC", "1000., 0.0", "*EXPANSION, ZERO=20.", "1e-4",
                 "*MATERIAL, NAME=PLY", "*ELASTIC", "1000., 0.0", "*EXPANSION, TYPE=ORTHO", "1e-4, 2e-4, 3e-4",
                 "*SHELL SECTION, ELSET=EALL, COMPOSITE", "0.1, 3, STEEL, 0.0", "0.1, 3, PLY, 90.0",
                 "*BOUNDARY", "NALL, 2, 6", "LEFT, 1, 1", "*INITIAL CONDITIONS, TYPE=TEMPERATURE", "NALL, 20."]
        ends = "&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'RIGHT' /\n"
        groups, said, rows = self.convert([*model, *step("*TEMPERATURE", "NALL, 70."), *step("*TEMPERATURE", "RIGHT, 120.")], monitors=ends)
        self.assertNotIn("*", said.replace("*TEMPERATURE", "*T") if "NOT TAKEN" in said else "")
        self.assertIn("&growth element_set = 'EALL' layer = 1 expansion = 1.0E-04 temperature = 100.0 temperature_field = 'heated_RIGHT' amplitude = 'history_1' /", groups)
        self.assertTrue(any("layer = 2 expansion = 1.0E-04 2.0E-04 3.0E-04 temperature = 50.0" in line for line in groups))
        # the ply lies across: 2e-4 along x; the mean of both layers, rotations held
        at = {float(row["load_factor"]): float(row["u"]) for row in rows}
        self.assertAlmostEqual(at[1.0], 1.5e-4 * 50 * 10, delta=1e-3 * 1.5e-4 * 500)
        self.assertAlmostEqual(at[2.0], 1.5e-4 * (50 * 5 + 75 * 5), delta=1e-2 * 1.5e-4 * 625)
        self.names([*model, *step("*TEMPERATURE", "NALL, 70., 3.0", "NONE, 1.0")], a="a gradient through the thickness", b="'NONE': nodes of a shell")
        self.names([*model, "LEFT, 30.", *step("*TEMPERATURE", "NALL, 70.")], a="nodes that begin at different temperatures: they count from")
        self.names([*model, *step("*TEMPERATURE, FILE=heat", "")], run=False, a="temperatures of a file or of a program")
        self.names([*model, "*AMPLITUDE, NAME=UP", "0., 0., 1., 1.", *step("*TEMPERATURE, AMPLITUDE=UP", "NALL, 70.")],
                   a="AMPLITUDE where the initial temperature is not zero")
        self.names([*model[:17], "*EXPANSION, TYPE=ANISO", "1e-4", *model[19:], *step("*TEMPERATURE", "NALL, 70.")], a="one coefficient, or three with TYPE = ORTHO")

    def test_ties(self):
        def shifted(row, by, x):
            fields = row.split(", ")
            return ", ".join([str(int(fields[0]) + by), f"{float(fields[1][:-1]) + x}", *fields[2:]])
        other = ["*NODE", *(shifted(row, 100, 4) for row in SHEET[1:-2]), "*ELEMENT, TYPE=S4, ELSET=more",
                 *(", ".join(str(int(n) + 100) for n in row.split(", ")) for row in CELLS),
                 "*SHELL SECTION, ELSET=more, MATERIAL=m", "0.1", "*NSET, NSET=side", "101, 111, 121"]
        load = step("*CLOAD", "115, 3, 1e-4")
        self.holds([*SHELL, *other, "*SURFACE, NAME=s, TYPE=NODE", "side", "*SURFACE, NAME=m", "end, SPOS", "*TIE, NAME=t, ADJUST=NO", "s, m", *load],
                   "&tie node_set = 's' to_element_set = 'm' /")
        self.holds([*SHELL, *other, "*SURFACE, NAME=s, TYPE=NODE", "side", "*SURFACE, NAME=m, TYPE=NODE", "tip",
                    "*TIE, NAME=t, POSITION TOLERANCE=0.1", "s, m", *load], "&tie node_set = 's' to_node_set = 'm' tolerance = .1 adjust = .true. /")
        self.holds([*SHELL, *other, "*MPC", "TIE, 101, 5", "TIE, 111, 15", "TIE, 121, 25", *load], "&tie node_set = 'node_101' to_node_set = 'node_5' /")

    def test_plane_elements(self):
        said = self.holds([*PLANE, *step("*DLOAD", "end, P2, -1.", "4, EDNOR1, 0.5")], "&support node_set = 'all' fixed = 'uz' 'rx' 'ry' /",
                          "&load type = 'follower_line' edge_set = 'end_side_2' in_plane = .1 /",
                          "&load type = 'follower_line' edge_set = '4_side_1' in_plane = -.5 /")
        self.assertNotIn("NOT TAKEN", said)
        self.holds([*PLANE, "*SURFACE, NAME=right", "end, S2", *step("*DSLOAD", "right, P, -1.")],
                   "&load type = 'follower_line' edge_set = 'right' in_plane = .1 /")
        # nodes that go with a reference node are held by it
        self.holds([*PLANE, "*RIGID BODY, NSET=tip, REF NODE=91", *step("*CLOAD", "91, 2, 1e-3")],
                   "&support node_set = 'node_91' fixed = 'uz' 'rx' 'ry' /")
        self.names([*SHELL, *step("*CLOAD", "tip, 3, 1e-5", "*DLOAD", "end, P2, -1.")], side="pressure on a side is for plane elements")
        self.names([card.replace("CPS4", "CPE4") for card in PLANE] + step("*DLOAD", "end, P2, -1."), strain="plane strain")
        # a bar under its own uniform tension: u = p L/E
        monitor = "&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'tip' /\n"
        cards = [card.replace("root, 1, 2", "root, 1\n1, 2") for card in PLANE] + step("*DLOAD", "end, P2, -1.", more="")
        self.assertAlmostEqual(float(self.convert(cards, monitors=monitor)[2][0]["u"]), 4 / 1000, delta=1e-9)


if __name__ == "__main__":
    unittest.main()
