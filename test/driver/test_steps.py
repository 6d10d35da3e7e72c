#!/usr/bin/env python3
"""Loads and supports belong to steps: amplitudes over the load factor and over time, supports and loads that come and go."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

STRIP = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 12, 1 /
&material name = 'r' law = 'neo_hookean' mu = 1.0e6 density = 1000.0 /
&section thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'edge_x1' /
&monitor name = 'v' quantity = 'displacement' component = 'y' node_set = 'edge_x1' /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
&monitor name = 'r' quantity = 'rotation' component = 'y' node_set = 'edge_x1' /
&monitor name = 'R' quantity = 'reaction' component = 'z' node_set = 'edge_x1' /
"""
LINE = "&load type = 'line' edge_set = 'edge_x1' vector = {} /\n"
TIGHT = "tolerance = 'tight'"
# two histories beside the load factor itself
TABLES = """&amplitude name = 'late' points = 0.0, 0.0, 0.4, 0.0, 1.0, 1.0 /
&amplitude name = 'bump' points = 0.0, 0.0, 0.3, 1.0, 0.7, -1.0, 1.0, 0.0 smooth = .true. /
""" + LINE.format("0, 0, 20") + LINE.format("100, 0, 0 amplitude = 'late'") + LINE.format("0, 3, 0 amplitude = 'bump'")


class Steps(unittest.TestCase):
    def run_text(self, text, code=0):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "s.nml").write_text(text)
            run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "s.nml"], cwd=folder, capture_output=True, text=True, check=False,
                                 env={**os.environ, "OMP_NUM_THREADS": "1"})
            self.assertEqual(run.returncode, code, run.stdout + run.stderr)
            if code == 2:
                return run.stderr
            return [{k: float(v) for k, v in row.items()} for row in csv.DictReader((Path(folder) / "s.history.csv").read_text().splitlines())]

    def check_equal(self, a, b, delta=1e-7, names="uvwr"):
        for name in names:
            self.assertAlmostEqual(a[name], b[name], delta=delta, msg=name)

    def refusal(self, text, *words):
        message = self.run_text(text, code=2)
        for word in words:
            self.assertIn(word, message)

    # amplitudes over the load factor

    def test_own_histories(self):
        rows = self.run_text(STRIP + TABLES + f"&step {TIGHT} /\n")
        levels = [row["load_factor"] for row in rows]
        for corner in (0.3, 0.4, 0.7):
            self.assertEqual(min(levels, key=lambda x: abs(x - corner)), corner)
        for row in rows:
            t = row["load_factor"]
            self.assertAlmostEqual(row["factor_late"], max(0, (t - 0.4) / 0.6), delta=1e-14)
        at = {row["load_factor"]: row for row in rows}
        self.assertEqual((at[0.3]["factor_bump"], at[0.7]["factor_bump"], at[1]["factor_bump"]), (1, -1, 0))
        # elastic states do not depend on the way: each load with a case of its own gives the same
        own = LINE.format("0, 0, 20") + LINE.format("100, 0, 0 case = 'late'") + LINE.format("0, 3, 0 case = 'bump'")
        cases = self.run_text(STRIP + own + f"&step load_factor = 0.7 {TIGHT} /\n&step case = 'late' load_factor = 0.5 {TIGHT} /\n"
                              f"&step case = 'bump' load_factor = -1 {TIGHT} /\n")
        self.check_equal(at[0.7], cases[-1])

    def test_the_unknown_of_arc_length(self):
        load = self.run_text(STRIP + TABLES + f"&step {TIGHT} /\n")
        arc = self.run_text(STRIP + TABLES + f"&step control = 'arc_length' load_factor = 1.0 {TIGHT} /\n")
        by_displacement = self.run_text(STRIP + TABLES.replace("late' points = 0.0, 0.0, 0.4, 0.0", "late' points = 0.0, 0.0, 0.25, 0.0")
                                        + f"&step control = 'displacement' node_set = 'edge_x1' component = 'z' displacements = 4.0 {TIGHT} /\n")
        at = {row["load_factor"]: row for row in load}
        on_arc = {row["load_factor"]: row for row in arc}
        for corner in (0.3, 0.4, 0.7, 1.0):
            self.check_equal(at[corner], on_arc[corner], 1e-6)
        self.assertAlmostEqual(by_displacement[-1]["w"], 4.0, delta=1e-9)

    def test_moved_supports_follow(self):
        support = "&support node_set = 'edge_x1' ux = 0.5 {} /\n&support node_set = 'edge_x1' fixed = 'uy' uz = 1.0 {} /\n"
        push = "&load type = 'traction' vector = 0, 0, 0.5 /\n"
        one = self.run_text(STRIP + push + support.format("amplitude = 'a'", "amplitude = 'b'")
                            + "&amplitude name = 'a' points = 0, 0, 0.5, 1, 1, 0.6 /\n&amplitude name = 'b' points = 0, 0, 0.5, 0, 1, 1 /\n"
                            + f"&step {TIGHT} /\n")
        two = self.run_text(STRIP + push + support.format("case = 'a'", "case = 'b'")
                            + f"&step {TIGHT} /\n&step case = 'a' load_factor = 0.6 {TIGHT} /\n&step case = 'b' {TIGHT} /\n")
        self.check_equal(one[-1], two[-1], names="uvwrR")
        self.assertAlmostEqual(one[-1]["u"], 0.3, delta=1e-12)

    def test_over_a_case(self):
        """An amplitude over the factor of a case follows it, whichever case a step changes."""
        rows = self.run_text(STRIP + LINE.format("0, 0, 20") + LINE.format("0, 3, 0 case = 'side' amplitude = 'twice'")
                             + "&amplitude name = 'twice' points = 0, 0, 1, 2 /\n"
                             + f"&step case = 'side' {TIGHT} /\n&step {TIGHT} /\n&step case = 'side' load_factor = 0.5 {TIGHT} /\n")
        plain = self.run_text(STRIP + LINE.format("0, 0, 20") + LINE.format("0, 3, 0") + f"&step {TIGHT} /\n")
        self.assertEqual([row["factor_side.twice"] for row in rows if row["load_factor"] == 1][:1], [2])
        self.check_equal(rows[-1], plain[-1])

    def test_begins_in_full(self):
        """A table that does not begin with 0 is brought in before the step."""
        rows = self.run_text(STRIP + LINE.format("0, 0, 20 amplitude = 'down'") + LINE.format("0, 3, 0")
                             + f"&amplitude name = 'down' points = 0, 1, 1, 0.5 /\n&step {TIGHT} /\n")
        before = next(row for row in rows if row["load_factor"] == 0)
        full = self.run_text(STRIP + LINE.format("0, 0, 20") + f"&step {TIGHT} /\n")
        last = self.run_text(STRIP + LINE.format("0, 0, 10") + LINE.format("0, 3, 0") + f"&step {TIGHT} /\n")
        self.check_equal(before, full[-1])
        self.check_equal(rows[-1], last[-1])

    def test_linear_and_buckling_go_along_the_slope(self):
        push = LINE.format("-1, 0, 0 amplitude = 'twice'")
        rows = self.run_text(STRIP + push + "&amplitude name = 'twice' points = 0, 0, 9, 18 /\n&step control = 'linear' /\n&step control = 'buckling' modes = 1 /\n")
        plain = self.run_text(STRIP + LINE.format("-2, 0, 0") + "&step control = 'linear' /\n&step control = 'buckling' modes = 1 /\n")
        self.assertAlmostEqual(rows[0]["u"] / plain[0]["u"], 1, delta=1e-12)
        self.assertAlmostEqual(rows[1]["load_factor"] / plain[1]["load_factor"], 1, delta=1e-9)

    # over time

    def test_time(self):
        inline = "times = 0.1, 0.25 factors = 1.0, -0.5 smooth = .true."
        table = "&amplitude name = 't' over = 'time' points = 0, 0, 0.1, 1, 0.25, -0.5 smooth = .true. /\n"
        for control in ("dynamic", "explicit"):
            step = f"&step control = '{control}' duration = 0.3 {{}} /\n"
            rows = self.run_text(STRIP + LINE.format("0, 0, 2") + step.format(inline))
            named = self.run_text(STRIP + table + LINE.format("0, 0, 2") + step.format("amplitude = 't'"))
            own = self.run_text(STRIP + table + LINE.format("0, 0, 2 amplitude = 't'") + step.format("load_factor = 0"))
            self.assertEqual([row["w"] for row in rows], [row["w"] for row in named])
            self.assertAlmostEqual(own[-1]["w"], rows[-1]["w"], delta=1e-9)
            self.assertAlmostEqual(own[-1]["work"], rows[-1]["work"], delta=1e-6 * abs(rows[-1]["work"]))
            self.assertTrue(any(abs(row["time"] - 0.1) < 1e-12 for row in own) or control == "explicit")

    def test_supports_in_time(self):
        support = "&support node_set = 'edge_x1' fixed = 'ux', 'uy' uz = 0.5 {} /\n"
        table = "&amplitude name = 't' {} points = 0, 0, 0.05, 1 smooth = .true. /\n"
        for control in ("dynamic", "explicit"):
            step = f"&step control = '{control}' duration = 0.1 {{}} /\n"
            rows = self.run_text(STRIP + support.format("") + step.format("times = 0.05 factors = 1 smooth = .true."))
            own = self.run_text(STRIP + table.format("over = 'time'") + support.format("amplitude = 't'") + step.format(""))
            # over a load factor that goes as the time does
            over = self.run_text(STRIP + table.format("") + support.format("amplitude = 't'") + step.format("times = 0.1 factors = 0.1"))
            for other in (own, over):
                self.assertAlmostEqual(other[-1]["w"], 0.5, delta=1e-12)
                self.assertAlmostEqual(other[-1]["kinetic_energy"] / rows[-1]["kinetic_energy"], 1, delta=1e-6)
                self.assertAlmostEqual(other[-1]["work"] / rows[-1]["work"], 1, delta=1e-6)

    def test_time_stands_still_in_static_steps(self):
        rows = self.run_text(STRIP + LINE.format("0, 0, 10 amplitude = 't'") + "&amplitude name = 't' over = 'time' points = 0, 0, 0.1, 1 /\n"
                             + "&step control = 'dynamic' duration = 0.05 mass_damping = 5 /\n&step load_factor = 0 tolerance = 'tight' /\n")
        still = self.run_text(STRIP + LINE.format("0, 0, 5") + f"&step {TIGHT} /\n")
        self.check_equal(rows[-1], still[-1])

    # supports and loads that come and go

    def test_a_support_goes(self):
        push = "&load type = 'traction' vector = 0.0, 0.0, -10.0 /\n"
        held = "&support node_set = 'edge_x1' fixed = 'ux', 'uy', 'uz' until_step = 1 /\n"
        rows = self.run_text(STRIP + push + held + f"&step {TIGHT} /\n&step {TIGHT} /\n")
        free = self.run_text(STRIP + push + f"&step {TIGHT} /\n")
        fixed = self.run_text(STRIP + push + held.replace("until_step = 1", "") + f"&step {TIGHT} /\n")
        before = next(row for row in rows if row["load_factor"] == 1)
        self.check_equal(before, fixed[-1], names="uvwrR")
        self.check_equal(rows[-1], free[-1])
        self.assertLess(abs(rows[-1]["R"]), 1e-8 * abs(before["R"]))

    def test_the_path_goes_on_without_a_jump(self):
        """A first increment on the way shows it: half of the reaction is half let go."""
        push = "&load type = 'traction' vector = 0.0, 0.0, -0.01 /\n"
        held = "&support node_set = 'edge_x1' fixed = 'uz' until_step = 1 /\n"
        rows = self.run_text(STRIP + push + held + f"&step {TIGHT} /\n&step load_factor = 2 {TIGHT} first_increment = 0.5 /\n")
        doubled = self.run_text(STRIP + push + f"&step load_factor = 2 {TIGHT} /\n")
        self.check_equal(rows[-1], doubled[-1])

    def test_a_support_comes_where_the_node_is(self):
        push = LINE.format("0, 0, 20")
        clamp = "&support node_set = 'edge_x1' fixed = 'ux', 'uy', 'uz', 'rx', 'ry', 'rz' from_step = 2 /\n"
        rows = self.run_text(STRIP + push + clamp + f"&step {TIGHT} /\n&step load_factor = 0 {TIGHT} /\n")
        before = next(row for row in rows if row["load_factor"] == 1)
        self.assertGreater(before["w"], 3)
        self.check_equal(rows[-1], before, 1e-10)
        self.assertGreater(abs(rows[-1]["R"]), 1)

    def test_it_moves_from_there(self):
        """Values count from where the node is, and from the factor that is there: 0.3 further, and a tenth of a radian."""
        push = LINE.format("0, 0, 20")
        clamp = "&support node_set = 'edge_x1' fixed = 'ux', 'uy', 'rx', 'rz' uz = 0.3 ry = 0.1 case = 'more' from_step = 2 /\n"
        rows = self.run_text(STRIP + push + clamp + f"&step {TIGHT} /\n&step case = 'more' {TIGHT} /\n")
        before = [row for row in rows if row["factor_more"] == 0][-1]
        self.assertAlmostEqual(rows[-1]["w"] - before["w"], 0.3, delta=1e-12)
        self.assertAlmostEqual(rows[-1]["r"] - before["r"], 0.1, delta=1e-5)
        back = self.run_text(STRIP + push + clamp + f"&step {TIGHT} /\n&step case = 'more' {TIGHT} /\n&step case = 'more' load_factor = 0 {TIGHT} /\n")
        self.check_equal(back[-1], before, 1e-9)

    def test_loads_come_and_go(self):
        loads = LINE.format("0, 0, 5") + LINE.format("0, 3, 0 from_step = 2") + "&load type = 'pressure' pressure = 4.0 until_step = 2 /\n"
        rows = self.run_text(STRIP + loads + f"&step {TIGHT} /\n&step {TIGHT} /\n&step {TIGHT} /\n")
        both = self.run_text(STRIP + LINE.format("0, 0, 5") + LINE.format("0, 3, 0") + f"&step {TIGHT} /\n")
        self.check_equal(rows[-1], both[-1])

    def test_let_go_in_a_motion(self):
        """A step in time begins with what has gone: the strip swings about its free state."""
        push = "&load type = 'traction' vector = 0.0, 0.0, -0.01 constant = .true. /\n"
        held = "&support node_set = 'edge_x1' fixed = 'uz' until_step = 1 /\n"
        rows = self.run_text(STRIP + push + held + f"&step load_factor = 0 {TIGHT} /\n&step control = 'dynamic' load_factor = 0 duration = 150.0 /\n")
        free = self.run_text(STRIP + push + f"&step load_factor = 0 {TIGHT} /\n")[-1]["w"]
        ws = [row["w"] for row in rows if row["time"] > 0]
        self.assertLess(min(ws), 1.5 * free)
        self.assertGreater(max(rows, key=lambda row: row["kinetic_energy"])["kinetic_energy"], 0)

    def test_modes_of_a_stage(self):
        step = "&step control = 'frequencies' modes = 1 /\n"
        end = "&support node_set = 'edge_x1' type = 'hinged' {} /\n"
        rows = self.run_text(STRIP + end.format("from_step = 2") + step + step)
        free = self.run_text(STRIP + step)
        held = self.run_text(STRIP + end.format("") + step)
        self.assertAlmostEqual(rows[0]["load_factor"] / free[0]["load_factor"], 1, delta=1e-9)
        self.assertAlmostEqual(rows[1]["load_factor"] / held[0]["load_factor"], 1, delta=1e-9)

    # refusals

    def test_refusals(self):
        line = LINE.format("0, 0, 1 {}")
        step = "&step /\n"
        self.refusal(STRIP + line.format("amplitude = 'x'") + step, "s.nml:10", "no &amplitude 'x'", "(none)")
        self.refusal(STRIP + "&amplitude name = 'x' points = 0, 0, 1 /\n" + step, "s.nml:10", "3 numbers", "a load factor, and a factor")
        self.refusal(STRIP + "&amplitude name = 'x' points = 0, 0, 0, 1 /\n" + step, "s.nml:10", "have to rise")
        self.refusal(STRIP + "&amplitude name = 'x' over = 'time' points = -1, 0, 0, 1 /\n" + step, "s.nml:10", "not negative")
        table = "&amplitude name = 'x' points = 0, 1, 1, 1 /\n"
        timed = "&amplitude name = 'x' over = 'time' points = 0, 0, 1, 1 /\n"
        self.refusal(STRIP + table + table + step, "s.nml:11", "in line 10 already")
        self.refusal(STRIP + table + line.format("amplitude = 'x' constant = .true.") + step, "s.nml:11", "constant")
        self.refusal(STRIP + timed + line.format("amplitude = 'x' case = 'c'") + step, "s.nml:11", "has no case")
        self.refusal(STRIP + table + "&support node_set = 'edge_x1' uz = 1 amplitude = 'x' /\n" + step, "s.nml:11", "would jump")
        self.refusal(STRIP + table + line.format("") + "&step control = 'dynamic' duration = 1 amplitude = 'x' /\n", "s.nml:12", "over = 'time'")
        self.refusal(STRIP + timed + line.format("") + "&step control = 'dynamic' duration = 1 amplitude = 'x' load_factor = 2 /\n", "s.nml:12", "given over time by the amplitude")
        self.refusal(STRIP + line.format("from_step = 2") + step, "s.nml:10", "from_step")
        self.refusal(STRIP + line.format("until_step = 2") + step, "s.nml:10", "1 steps; 2")
        self.refusal(STRIP + line.format("from_step = 2 until_step = 1") + step + step, "s.nml:10", "before from_step")
        self.refusal(STRIP + "&support node_set = 'edge_x1' uz = 1 constant = .true. from_step = 2 /\n" + step + step, "s.nml:10", "never move")
        floating = STRIP.replace("type = 'clamped'", "type = 'clamped' until_step = 1") + line.format("") + step + step
        self.refusal(floating, "s.nml:12", "&step")
        contradiction = "&support node_set = 'edge_x1' uz = 1 from_step = 2 /\n&support node_set = 'edge_x1' uz = 2 from_step = 2 /\n"
        self.refusal(STRIP + contradiction + step + step, "s.nml:11", "one value")
        self.refusal(STRIP + line.format("until_step = 1") + "&accuracy target = 0.1 /\n" + step + step, "s.nml:11", "come or go")


if __name__ == "__main__":
    unittest.main()
