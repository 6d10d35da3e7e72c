#!/usr/bin/env python3
"""Decks written here, solved by CalculiX and, converted, by finshell: steps with loads of their own, amplitudes, ties, rigid bodies, plane elements."""
import csv
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

MATERIAL = ["*MATERIAL, NAME=m", "*ELASTIC", "1000., 0.3", "*DENSITY", "1e-3"]
PRINT = ["*NODE PRINT, NSET=corner, FREQUENCY=1000", "U", "*END STEP"]
AROUND = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1))


class Strip:
    """Rectangle of nx x ny elements of eight nodes."""

    def __init__(self, nx, ny, length, width, kind, name="sheet", first=1, x=0.0):
        self.nx, self.ny, self.first, self.number, self.cards = nx, ny, first, {}, ["*NODE"]
        for j in range(2 * ny + 1):
            for i in range(2 * nx + 1):
                if not (i % 2 and j % 2):
                    self.number[i, j] = first + len(self.number)
                    self.cards.append(f"{self.number[i, j]}, {x + length * i / (2 * nx)!r}, {width * j / (2 * ny)!r}, 0.")
        self.cards.append(f"*ELEMENT, TYPE={kind}, ELSET={name}")
        for j in range(ny):
            for i in range(nx):
                nodes = [str(self.number[2 * i + a, 2 * j + b]) for a, b in AROUND]
                self.cards.append(", ".join([str(self.element(i, j)), *nodes]))
        self.cards += [f"*{'SHELL' if kind[0] == 'S' else 'SOLID'} SECTION, ELSET={name}, MATERIAL=m", "0.1"]

    def element(self, i, j):
        return self.first + i + self.nx * j

    def side(self, i):
        return [self.number[2 * i, j] for j in range(2 * self.ny + 1)]


def nset(name, nodes):
    return [f"*NSET, NSET={name}", *(f"{n}," for n in nodes)]


def step(*cards, control=("*STATIC", "0.25, 1.")):
    return ["*STEP, NLGEOM, INC=1000", *control, *cards, *PRINT]


class Answers(unittest.TestCase):
    def compare(self, cards, delta, components="xyz", said=""):
        """Displacements of the set `corner` at the end of each step, relative to the largest of CalculiX in that step. The namelist."""
        with tempfile.TemporaryDirectory() as folder:
            def call(*command):
                return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=300,
                                      env={**os.environ, "OMP_NUM_THREADS": "1"})
            (Path(folder) / "d.inp").write_text("\n".join(cards) + "\n")
            call("ccx", "-i", "d")
            rows = [row.split() for row in (Path(folder) / "d.dat").read_text().splitlines()]
            theirs = [[float(value) for value in row[1:]] for row in rows if len(row) == 4 and row[0].isdigit()]
            converted = call(os.environ["FINSHELL_BIN"], "convert", "d.inp")
            self.assertEqual(converted.returncode, 0, converted.stderr)
            self.assertEqual("NOT TAKEN" in converted.stdout, said != "", converted.stdout)
            self.assertIn(said, converted.stdout)
            text = (Path(folder) / "d.nml").read_text()
            with (Path(folder) / "d.nml").open("a") as file:
                for c in "xyz":
                    file.write(f"&monitor name = '{c}' quantity = 'displacement' component = '{c}' node_set = 'corner' /\n")
            ran = call(os.environ["FINSHELL_BIN"], "run", "-q", "d.nml")
            self.assertEqual(ran.returncode, 0, text + ran.stderr)
            history = list(csv.DictReader((Path(folder) / "d.history.csv").read_text().splitlines()))
        steps = sum(card == "*END STEP" for card in cards)
        self.assertEqual(len(theirs), steps)
        ends = [float(factor) for factor in re.findall(r"^&step.*(?:load_factor|factors) = ([\d.]+)", text, re.MULTILINE)]
        if ends:
            ours = [next(row for row in history if abs(float(row["load_factor"]) - end) < 1e-9) for end in ends]
        else:
            ours = history[-steps:]
        for mine, other in zip(ours, theirs):
            largest = max(abs(value) for value in other)
            for c, value in zip("xyz", other):
                if c in components:
                    self.assertAlmostEqual(float(mine[c]) / largest, value / largest, delta=delta, msg=text)
        return text

    def test_loads_replaced_and_taken_away(self):
        sheet = Strip(16, 4, 4.0, 1.0, "S8R")
        tip = sheet.side(16)
        text = self.compare([
            *sheet.cards, *nset("root", sheet.side(0)), *nset("tip", tip), *nset("corner", [tip[-1]]), *MATERIAL, "*BOUNDARY", "root, 1, 6",
            *step("*CLOAD", "tip, 3, 0.0001", "*DLOAD", "sheet, P, 0.0005"),
            *step("*CLOAD, OP=NEW", "tip, 2, 0.001"),
            *step("*CLOAD", "corner, 3, 0.002", "tip, 2, 0.", "*DLOAD, OP=NEW", "sheet, P, 0.0001"),
        ], 0.012)
        self.assertIn("points = .0, .0,  1.0, 1.0,  2.0, 1.0,  3.0, .2", text)

    def test_linear_steps(self):
        sheet = Strip(16, 4, 4.0, 1.0, "S8R")
        tip = sheet.side(16)
        cards = [*sheet.cards, *nset("root", sheet.side(0)), *nset("tip", tip), *nset("corner", [tip[-1]]), *MATERIAL, "*BOUNDARY", "root, 1, 6",
                 *step("*CLOAD", "tip, 3, 0.0001"), *step("*CLOAD", "corner, 3, -0.0002"), *step("*CLOAD, OP=NEW", "*DLOAD", "sheet, P, 1e-4")]
        text = self.compare([card.replace(", NLGEOM", "") for card in cards], 0.01)
        self.assertNotIn("amplitude", text)

    def test_supports_that_go(self):
        sheet = Strip(16, 8, 2.0, 1.0, "CPS8")
        tip = sheet.side(16)
        text = self.compare([
            *sheet.cards, *nset("root", sheet.side(0)), *nset("tip", tip), *nset("corner", [tip[-1]]), *MATERIAL, "*BOUNDARY", "root, 1, 2",
            *step("*BOUNDARY", "tip, 1, 1, 0.05", "*CLOAD", "tip, 2, 0.05"),
            *step("*BOUNDARY", "tip, 1, 1, 0.02"),
            *step("*BOUNDARY, OP=NEW", "root, 1, 2"),
        ], 0.01)
        self.assertIn("until_step = 2", text)

    def test_amplitudes(self):
        sheet = Strip(12, 4, 4.0, 1.0, "CPS8")
        tip = sheet.side(12)
        head = [*sheet.cards, *nset("root", sheet.side(0)), *nset("tip", tip), *nset("corner", [tip[-1]]), *MATERIAL, "*BOUNDARY", "root, 1, 2"]
        self.compare([
            *head, "*AMPLITUDE, NAME=own", "0., 0., 0.5, 1., 1., 0.5", "*AMPLITUDE, NAME=whole, TIME=TOTAL TIME", "0., 0., 1.5, 1., 2., 0.25",
            *step("*CLOAD, AMPLITUDE=own", "tip, 2, 0.01", "*CLOAD, AMPLITUDE=whole", "tip, 1, 0.02"), *step("*CLOAD", "tip, 2, -0.01"),
        ], 0.012)
        self.compare([
            *head, "*AMPLITUDE, NAME=own", "0., 0., 0.02, 1., 0.04, 0.5", "*AMPLITUDE, NAME=whole, TIME=TOTAL TIME",
            "0., 0., 0.06, 1., 0.08, 0.5",
            *step("*CLOAD, AMPLITUDE=own", "tip, 2, 0.003", "*CLOAD, AMPLITUDE=whole", "tip, 1, 0.01",
                  control=("*DYNAMIC, DIRECT, ALPHA=0.", "0.0005, 0.04")),
            *step("*CLOAD", "tip, 2, -0.003", control=("*DYNAMIC, DIRECT, ALPHA=0.", "0.0005, 0.04")),
        ], 0.005)

    def test_tie(self):
        left = Strip(8, 6, 2.0, 1.0, "CPS8", "left")
        right = Strip(16, 12, 2.0, 1.0, "CPS8", "right", first=1000, x=2.0)
        tip = right.side(16)
        text = self.compare([
            *left.cards, *right.cards, *nset("root", left.side(0)), *nset("corner", [tip[-1]]), *MATERIAL,
            "*SURFACE, NAME=slave", *(f"{right.element(0, j)}, S4" for j in range(12)),
            "*SURFACE, NAME=master", *(f"{left.element(7, j)}, S2" for j in range(6)),
            "*TIE, NAME=joint, POSITION TOLERANCE=0.01", "slave, master", "*BOUNDARY", "root, 1, 2",
            *step("*DLOAD", *(f"{right.element(i, 11)}, P3, 0.1" for i in range(16))),
        ], 0.01)
        self.assertIn("&tie node_set = 'slave' to_element_set = 'part_1' tolerance = .01 adjust = .true. /", text)

    def test_rigid_body(self):
        sheet = Strip(16, 8, 4.0, 1.0, "CPS8")
        tip = sheet.side(16)
        cards = [*sheet.cards, "*NODE, NSET=hub", "9001, 4.5, 0.75, 0.", "*NODE, NSET=turn", "9002, 4.5, 0.75, 0.",
                 *nset("root", sheet.side(0)), *nset("tip", tip), *nset("corner", [tip[-1]]), *MATERIAL,
                 "*RIGID BODY, NSET=tip, REF NODE=9001, ROT NODE=9002", "*BOUNDARY", "root, 1, 2"]
        cards += step("*CLOAD", "hub, 2, 0.05", "turn, 3, 0.05")
        text = self.compare([card.replace(", NLGEOM", "") for card in cards], 0.01)
        self.assertIn("&load type = 'moment' node_set = 'node_9001' vector = .0, .0, .05 /", text)

    def test_plane_sheet(self):
        sheet = Strip(16, 8, 2.0, 1.0, "CPS8")
        tip = sheet.side(16)
        cards = [*sheet.cards, *nset("root", sheet.side(0)), *nset("corner", [tip[-1]]), *MATERIAL,
                 "*ELSET, ELSET=last", *(f"{sheet.element(15, j)}," for j in range(8)),
                 "*ELSET, ELSET=upper", *(f"{sheet.element(i, 7)}," for i in range(16)), "*BOUNDARY", "root, 1, 2",
                 *step("*DLOAD", "last, P2, -10.", "upper, P3, 3.", control=("*STATIC",))]
        text = self.compare([card.replace(", NLGEOM", "") for card in cards], 0.01)
        self.assertIn("&support node_set = 'all' fixed = 'uz' 'rx' 'ry' /", text)
        self.assertIn("&load type = 'follower_line' edge_set = 'last_side_2' in_plane = 1.0 /", text)


if __name__ == "__main__":
    if not shutil.which("ccx"):
        print("skipped: apt-get install calculix-ccx")
        sys.exit(77)
    unittest.main()
