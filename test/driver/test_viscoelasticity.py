#!/usr/bin/env python3
"""Laws with states in the program: the viscoelastic one of examples/user_laws (one branch of a Prony series) against closed forms of linear
viscoelasticity, in static steps that take time, in implicit and explicit ones; restarts to the bit; what is refused."""
import csv
import math
import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}
COMPILER = shutil.which(os.environ.get("CC", "cc"))

#: A strip of length 2, width 1 and thickness 0.1 under uniaxial stress.
E, NU, G, TAU = 100.0, 0.3, 0.6, 2.0
LAW = f"&material name = 'visco' library = 'liblaws.so' law = 'prony' e = {E} nu = {NU} g = {G} tau = {TAU} density = 1.0e-6 /\n"
STRIP = """&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 4, 2 /
&section material = 'visco' thickness = 0.1 /
&support node_set = 'edge_x0' fixed = 'ux' /
&support node_set = 'edge_y0' fixed = 'uy' /
&support node_set = 'all' fixed = 'uz', 'rx', 'ry', 'rz' /
&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'edge_x1' /
"""
FORCE = "&monitor name = 'n' quantity = 'reaction' component = 'x' node_set = 'edge_x1' reduce = 'sum' /\n"
TIGHT = "tolerance = 'tight'"
#: A cantilever with a tip mass that is bent, so that increments of Newton's method have something to do.
CANTILEVER = """&mesh generator = 'rectangle' lengths = 2.0, 0.5 divisions = 4, 1 /
&section material = 'visco' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&point_mass name = 'tip' node_set = 'edge_x1' mass = 0.5 /
&load type = 'force' node_set = 'edge_x1' vector = 0.0, 0.0, {force} total = .true. /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
&monitor name = 's' quantity = 'stress' component = '11' element_set = 'all' height = 'top' reduce = 'max' /
"""


def relaxed(time, g=G, tau=TAU):
    """Stress over that at once, of a strain that is held."""
    return 1 - g + g * math.exp(-time / tau)


def crept(time, g=G, tau=TAU):
    """Strain over that at once, of a stress that is held."""
    return 1 + g / (1 - g) * (1 - math.exp(-(1 - g) * time / tau))


def swinging(stiffness, mass, start, times, g=G, tau=TAU, per_unit=4000):
    """Displacements of a mass on the spring (1 - g) x + h, dh/dt + h/tau = g dx/dt, let go from a displacement to which it has come at
    once: by the classical method of Runge and Kutta, which is exact here to 1e-10."""
    def rates(y):
        return y[1], -stiffness / mass * ((1 - g) * y[0] + y[2]), g * y[1] - y[2] / tau

    def ahead(y, k, h):
        return [a + h * b for a, b in zip(y, k)]

    y, now, found = [start, 0.0, g * start], 0.0, []
    for time in times:
        steps = max(1, math.ceil((time - now) * per_unit))
        h = (time - now) / steps
        for _ in range(steps):
            a = rates(y)
            b = rates(ahead(y, a, h / 2))
            c = rates(ahead(y, b, h / 2))
            d = rates(ahead(y, c, h))
            y = [v + h / 6 * (p + 2 * q + 2 * r + s) for v, p, q, r, s in zip(y, a, b, c, d)]
        now = time
        found.append(y[0])
    return found


@unittest.skipUnless(COMPILER, "no compiler of C")
class Viscoelasticity(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.path = Path(folder.name)
        subprocess.run([COMPILER, "-O2", "-fPIC", "-shared", f"-I{SOURCE / 'api'}", str(SOURCE / "examples/user_laws/laws.c"), "-o", "liblaws.so", "-lm"],
                       cwd=cls.path, check=True)

    def call(self, *arguments, code=0):
        run = subprocess.run([PROGRAM, *arguments], cwd=self.path, capture_output=True, text=True, check=False, timeout=300, env=ENVIRONMENT)
        self.assertEqual(run.returncode, code, run.stdout + run.stderr)
        return run.stdout + run.stderr

    def solve(self, text, name="r"):
        (self.path / f"{name}.nml").write_text(text)
        self.call("run", "-q", f"{name}.nml")
        with open(self.path / f"{name}.history.csv", encoding="utf-8") as f:
            return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(f)]

    def refused(self, text, *words):
        (self.path / "bad.nml").write_text(text)
        said = self.call("run", "bad.nml", code=2)
        for word in words:
            self.assertIn(word, said)

    # ------------------------------------------------------------------ static steps

    def test_relaxation(self):
        """A strip that is stretched at once by a tenth and held: force and stress relax as the law does, whatever the increments."""
        rows = self.solve(LAW + STRIP + FORCE + f"""&support node_set = 'edge_x1' ux = 0.2 /
&monitor name = 's' quantity = 'stress' component = '11' element_set = 'all' height = 'top' /
&step {TIGHT} /
&step duration = 6.0 output_times = 0.1, 3.3 {TIGHT} /
""")
        at_once = [r for r in rows if r["time"] == 0][-1]
        self.assertAlmostEqual(at_once["n"] / (E * (0.1 + 0.1**2 / 2) * 0.1 * 1.1), 1, delta=1e-12)
        held = [r for r in rows if r["time"] > 0]
        self.assertGreater(len(held), 5)
        for r in held:
            self.assertAlmostEqual(r["n"] / at_once["n"], relaxed(r["time"]), delta=1e-11)
            self.assertAlmostEqual(r["s"] / at_once["s"], relaxed(r["time"]), delta=1e-11)
            self.assertEqual(r["snap"], 0)

    def test_relaxation_in_bending(self):
        rows = self.solve(LAW + CANTILEVER.format(force=0) + f"""&support node_set = 'edge_x1' fixed = 'uy' uz = 0.6 /
&monitor name = 'f' quantity = 'reaction' component = 'z' node_set = 'edge_x1' reduce = 'sum' /
&step {TIGHT} /
&step duration = 5.0 {TIGHT} /
""")
        at_once = [r for r in rows if r["time"] == 0][-1]
        held = [r for r in rows if r["time"] > 0]
        for name, most in (("f", 2e-4), ("s", 1e-3)):
            # all relaxes but the stiffness against drilling and twist, a small part of the whole, and about the same one at all times
            parts = [(r[name] / at_once[name] - relaxed(r["time"])) / (1 - relaxed(r["time"])) for r in held if r["time"] > 0.1]
            self.assertLess(max(parts), most)
            self.assertGreater(min(parts), -most)
            self.assertLess(max(parts) - min(parts), 0.2 * most)

    def test_creep_is_of_second_order(self):
        force = 1e-8
        errors = []
        for h in (1.0, 0.5, 0.25):
            rows = self.solve(LAW + STRIP + f"""&load type = 'line' edge_set = 'edge_x1' vector = {force}, 0, 0 /
&step {TIGHT} /
&step duration = 8.0 automatic = .false. first_increment = {h} {TIGHT} /
""")
            at_once = 2 * force / 0.1 / E
            self.assertAlmostEqual([r for r in rows if r["time"] == 0][-1]["u"] / at_once, 1, delta=1e-8)
            errors.append(max(abs(r["u"] / at_once - crept(r["time"])) for r in rows if r["time"] > 0))
        self.assertLess(errors[0], 3e-3)
        for coarse, fine in zip(errors, errors[1:]):
            self.assertGreater(coarse / fine, 3.7)
            self.assertLess(coarse / fine, 4.3)

    def test_automatic_increments(self):
        """Creep after a load that is held, unloaded and held again: increments grow where nothing happens, and are short behind corners."""
        rows = self.solve(LAW + STRIP + f"""&load type = 'line' edge_set = 'edge_x1' vector = 1.0e-8, 0, 0 /
&step {TIGHT} /
&step duration = 60.0 times = 40.0, 40.1 factors = 1.0, 0.0 {TIGHT} /
""")
        at_once = 2e-8 / 0.1 / E
        worst = 0.0
        for r in rows:
            if 0 < r["time"] <= 40:
                worst = max(worst, abs(r["u"] / at_once - crept(r["time"])))
        self.assertLess(worst, 2e-3)
        rest = [r for r in rows if r["time"] > 40.1]
        for r in rest:  # as if the load had been taken away at the middle of the ramp
            self.assertAlmostEqual(r["u"] / at_once, crept(r["time"]) - crept(r["time"] - 40.05), delta=2e-3)
        self.assertLess(len(rows), 120)
        times = [r["time"] for r in rows]
        steps = [b - a for a, b in zip(times, times[1:])]
        self.assertGreater(max(steps), 5 * min(s for s in steps if s > 0))

    def test_displacement_and_volume_control(self):
        """What is prescribed goes over time; held, all stresses relax alike, so shapes stay and the load is what answers."""
        load = "&load type = 'line' edge_set = 'edge_x1' vector = 1.0, 0, 0 /\n"
        watched = "control = 'displacement' node_set = 'edge_x1' component = 'x' "
        rows = self.solve(LAW + STRIP + load + f"&step {watched} displacements = 0.2 {TIGHT} /\n&step {watched} displacements = 0.2 duration = 5.0 {TIGHT} /\n")
        at_once = [r for r in rows if r["time"] == 0][-1]
        held = [r for r in rows if r["time"] > 0]
        self.assertEqual(held[-1]["time"], 5)
        for r in held:
            self.assertAlmostEqual(r["load_factor"] / at_once["load_factor"], relaxed(r["time"]), delta=1e-9)
            self.assertAlmostEqual(r["u"], 0.2, delta=1e-9)
        # at an even rate through two values; by times of their own
        for times, expected in (("", (1.0, 4.0)), ("times = 3.0, 4.0", (3.0, 4.0))):
            rows = self.solve(LAW + STRIP + load + f"&step {watched} displacements = 0.5e-8, 2e-8 {times} duration = 4.0 {TIGHT} /\n")
            for u, time in zip((0.5e-8, 2e-8), expected):
                self.assertAlmostEqual(min(rows, key=lambda r: abs(r["u"] - u))["time"], time, delta=1e-6)
            if not times:
                stress = E * 1e-8 * (1 - G + G * TAU / 4 * (1 - math.exp(-4 / TAU)))
                self.assertAlmostEqual(rows[-1]["load_factor"] / (stress * 0.1), 1, delta=1e-6)
        disk = """&mesh generator = 'disk' radius = 7.5 rings = 4 portion = 'quarter' /
&section material = 'visco' thickness = 0.5 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'pressure' pressure = 1.0 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /
&step control = 'volume' volumes = 60.0 first_increment = 15.0 """ + TIGHT + """ /
&step control = 'volume' volumes = 60.0 duration = 5.0 """ + TIGHT + " /\n"
        rows = self.solve(LAW + disk)
        at_once = [r for r in rows if r["time"] == 0][-1]
        held = [r for r in rows if r["time"] > 0]
        self.assertEqual(held[-1]["time"], 5)
        for r in held:
            self.assertAlmostEqual(r["load_factor"] / at_once["load_factor"], relaxed(r["time"]), delta=1e-3)
            self.assertAlmostEqual(r["w"] / at_once["w"], 1, delta=1e-3)

    def test_creep_buckling(self):
        """A shallow arch snaps in time under more than 1 - g times the load under which it would snap at once, and never under less. When it
        does is a matter of the increments to second order; with inertia it goes on."""
        arch = """&mesh generator = 'cylinder' radius = 2540.0 length = 254.0 angles = 0.0, 5.72957795 divisions = 6, 6 /
&section material = 'visco' thickness = 12.7 /
&support node_set = 'edge_a1' fixed = 'ux', 'uy', 'uz' /
&support node_set = 'edge_a0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'force' node_set = 'corner_a0_y0' vector = 0, 0, -1000 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_a0_y0' /
"""
        law = "&material name = 'visco' library = 'liblaws.so' law = 'prony' e = 3102.75 nu = 0.3 g = 0.4 tau = 1.0 density = 1.0e-7 /\n"
        rows = self.solve(law + arch + "&step control = 'arc_length' first_increment = 0.1 node_set = 'corner_a0_y0' component = 'z' displacements = -14 locate = .true. /\n")
        limit = max(r["load_factor"] for r in rows)
        self.assertAlmostEqual(limit, 0.56, delta=0.03)
        rows = self.solve(law + arch + f"&step load_factor = {0.6 * 0.98 * limit} /\n&step load_factor = {0.6 * 0.98 * limit} duration = 400.0 /\n")
        self.assertEqual(rows[-1]["time"], 400)
        self.assertGreater(rows[-1]["w"], -14)
        times = []
        for tolerance in (1e-3, 1e-4):
            (self.path / "snap.nml").write_text(law + arch + f"&step load_factor = {0.8 * limit} /\n"
                                                f"&step load_factor = {0.8 * limit} duration = 400.0 time_tolerance = {tolerance} /\n")
            said = self.call("run", "snap.nml", code=1)
            self.assertIn("where a structure snaps, control = 'dynamic' goes on", said)
            times.append(float(re.search(r"step 'step 2' at time (\S+): an increment of", said).group(1)))
        self.assertAlmostEqual(times[0] / times[1], 1, delta=2e-3)
        rows = self.solve(law + arch + f"&step load_factor = {0.8 * limit} /\n"
                          f"&step control = 'dynamic' load_factor = {0.8 * limit} duration = {2 * times[1]} mass_damping = 10.0 /\n")
        self.assertLess(next(r["time"] for r in rows if r["w"] < -14), 1.5 * times[1])
        self.assertGreater(min(r["w"] for r in rows if r["time"] < 0.95 * times[1]), -14)

    def test_guide(self):
        """The strip of doc/user_laws.md: loaded at once, held, unloaded, left alone."""
        guide = (SOURCE / "doc/user_laws.md").read_text(encoding="utf-8")
        text = next(block for block in guide.split("```fortran\n")[1:] if block.startswith("&mesh")).split("```")[0]
        rows = self.solve(text)
        at_once = 2 * 1e-5 / 0.1 / E
        ends = [next(r for r in rows if r["time"] == time and r["load_factor"] == factor) for time, factor in ((0, 1), (10, 1), (10, 0), (40, 0))]
        for r, expected in zip(ends, (1, crept(10), crept(10) - 1, (crept(10) - 1) * math.exp(-(1 - G) * 30 / TAU))):
            self.assertAlmostEqual(r["u"] / at_once, expected, delta=1e-3)
        self.assertIn(f"= {at_once * crept(10):.3e}".replace("e-0", "e-"), guide)

    def test_rates(self):
        """Stretched at a constant rate: N = k ((1 - g) e + g e' tau (1 - exp(-t/tau)))."""
        for duration in (0.02, 2.0, 200.0):
            rows = self.solve(LAW + STRIP + FORCE + f"&support node_set = 'edge_x1' ux = 2.0e-8 /\n&step duration = {duration} {TIGHT} /\n")
            last = rows[-1]
            expected = E * 0.1 * 1e-8 * (1 - G + G * TAU / duration * (1 - math.exp(-duration / TAU)))
            self.assertAlmostEqual(last["n"] / expected, 1, delta=1e-7)
            self.assertAlmostEqual(last["time"], duration)

    def test_without_duration_no_time_passes(self):
        """The answer at once is that of the elastic law, whatever the control, and loads that come and go leave nothing behind."""
        text = CANTILEVER + """&step load_factor = 0.5 {t} /
&step control = 'arc_length' load_factor = 0.8 {t} /
&step control = 'displacement' node_set = 'edge_x1' component = 'z' displacements = 0.8 {t} /
&step control = 'relax' load_factor = 0.5 {t} /
&step control = 'linear' /
&step control = 'frequencies' modes = 2 /
&step load_factor = 0.0 snap = 'ignore' {t} /
"""
        text = text.format(force=0.06, t=TIGHT)
        rows = self.solve(LAW + text)
        elastic = self.solve(f"&material name = 'visco' law = 'linear_elastic' e = {E} nu = {NU} density = 1.0e-6 /\n" + text)
        self.assertEqual(len(rows), len(elastic))
        for a, b in zip(rows, elastic):
            self.assertAlmostEqual(a["w"], b["w"], delta=1e-6)
            self.assertAlmostEqual(a["load_factor"] / (b["load_factor"] or 1), 1 if b["load_factor"] else 0, delta=1e-6)
        self.assertAlmostEqual(rows[-1]["w"], 0, delta=1e-8)
        self.assertGreater(max(r["w"] for r in rows), 0.5)

    def test_frequencies_are_those_at_once(self):
        """Also where the structure has relaxed: small vibrations are fast."""
        modes = "&step control = 'frequencies' modes = 1 /\n"
        rows = self.solve(LAW + CANTILEVER.format(force=1e-6) + f"&step {TIGHT} /\n" + modes + f"&step duration = 20 {TIGHT} /\n" + modes)
        first, second = [r["load_factor"] for r in rows if r["load_factor"] not in (1.0, 0.0) and r["time"] in (0.0, 20.0) and r["residual"] == 0][-2:]
        self.assertAlmostEqual(first / second, 1, delta=1e-6)

    def test_amplitudes_over_time(self):
        """Any law: loads that follow tables over time go along in static steps that take time."""
        common = f"&material name = 'visco' law = 'linear_elastic' e = {E} nu = {NU} /\n" + STRIP
        rows = self.solve(common + f"""&load type = 'line' edge_set = 'edge_x1' vector = 0.5, 0, 0 amplitude = 'a' /
&amplitude name = 'a' over = 'time' points = 0, 0, 1, 0.4, 3, 1 /
&step duration = 3.0 output_times = 2.0 {TIGHT} /
""")
        there = self.solve(common + f"&load type = 'line' edge_set = 'edge_x1' vector = 0.5, 0, 0 /\n&step load_levels = 0.4, 0.7, 1.0 {TIGHT} /\n")
        for time, factor in ((1, 0.4), (2, 0.7), (3, 1.0)):
            a = next(r for r in rows if abs(r["time"] - time) < 1e-9)
            b = next(r for r in there if abs(r["load_factor"] - factor) < 1e-9)
            self.assertAlmostEqual(a["u"] / b["u"], 1, delta=1e-7)

    def test_what_is_left_out_of_balance_is_no_motion(self):
        """A hold behind a step of loose tolerance, thin and bent far: nothing moves, so increments grow to the end."""
        rows = self.solve(f"&material name = 'visco' law = 'linear_elastic' e = {1e3 * E} nu = {NU} density = 1.0 /\n"
                          + CANTILEVER.format(force=0.06).replace("thickness = 0.1", "thickness = 0.01")
                          + "&step residual_tolerance = 0.05 correction_tolerance = 0.05 /\n&step duration = 5.0 /\n")
        held = [r for r in rows if r["time"] > 0]
        self.assertEqual(held[-1]["time"], 5)
        self.assertLess(len(held), 20)
        self.assertLess(max(abs(r["w"] - held[0]["w"]) for r in held), 1e-6)
        self.assertGreater(abs(held[0]["w"]), 0.3)

    # ------------------------------------------------------------------ steps with inertia

    def check_swinging(self, bends, step, increments, order, coarse):
        """The mass of a strip without mass of its own, let go: against one mass on the one spring, which is found by a static step."""
        force = 1e-7
        g, tau = 0.3, 0.5
        law = LAW.replace(f"g = {G} tau = {TAU} density = 1.0e-6", f"g = {g} tau = {tau} density = {1e-9 if bends else 1e-6}")
        if bends:
            text = CANTILEVER.format(force=force).replace("mass = 0.5", "mass = 2.0e-3").replace("'edge_x1'", "'corner_x1_y0'")
            name, mass = "w", 2e-3
        else:
            text = STRIP.replace("fixed = 'uz', 'rx'", "fixed = 'uy', 'uz', 'rx'").replace("4, 2", "4, 1") + f"""&point_mass name = 'tip' node_set = 'edge_x1' mass = 0.75 /
&load type = 'force' node_set = 'edge_x1' vector = {force}, 0, 0 total = .true. /
"""
            name, mass = "u", 1.5
        errors = []
        for h in increments:
            rows = self.solve(law + text + f"&step {TIGHT} /\n" + step.format(h=h) + "&output energy = .true. /\n")
            start = [r for r in rows if r["time"] == 0][-1][name]
            rows = [r for r in rows if r["time"] > 0]
            expected = swinging(force / start, mass, start, [r["time"] for r in rows], g, tau)
            errors.append(max(abs(r[name] - x) for r, x in zip(rows, expected)) / abs(start))
            last = rows[-1]
            begun = 0.5 * force * start
            there = last["kinetic_energy"] + last["stored_energy"]
            self.assertLess(there, 0.6 * begun)
            # what is missing is what the law has dissipated
            self.assertAlmostEqual((there - last["energy_residual"]) / begun, 1, delta=0.01)
        self.assertLess(errors[0], coarse)
        for a, b in zip(errors, errors[1:]):
            self.assertAlmostEqual(math.log2(a / b), order, delta=0.2)

    def test_implicit(self):
        for bends in (False, True):
            for scheme in ("generalised_alpha", "conserving"):
                with self.subTest(bends=bends, scheme=scheme):
                    self.check_swinging(bends, "&step control = 'dynamic' scheme = '" + scheme + "' rotatory = .false. load_factor = 0 duration = 4.0 "
                                        "automatic = .false. first_increment = {h} " + TIGHT + " /\n", (0.04, 0.02, 0.01), 2, 5e-3)

    def test_implicit_with_automatic_increments(self):
        self.check_swinging(False, "&step control = 'dynamic' load_factor = 0 duration = 4.0 time_tolerance = {h} /\n", (1e-4,), 2, 1e-3)

    def test_explicit(self):
        self.check_swinging(False, "&step control = 'explicit' load_factor = 0 duration = 4.0 largest_increment = {h} /\n", (1e-2,), 2, 1e-4)

    # ------------------------------------------------------------------ going on

    def test_restart_is_the_same_to_the_bit(self):
        text = LAW + CANTILEVER.format(force=0.06) + "&output restart = 'every' energy = .true. /\n"
        ends = {"static": "&step first_increment = 0.25 /\n&step control = 'displacement' node_set = 'edge_x1' component = 'z' displacements = 0.3 /\n",
                "watched": "&step control = 'displacement' node_set = 'edge_x1' component = 'z' displacements = 0.3 /\n"
                           "&step control = 'displacement' node_set = 'edge_x1' component = 'z' displacements = 0.2, 0.2, 0.5 times = 0.5, 1.5, 2.0 duration = 3.0 /\n",
                "timed": "&step load_factor = 0.5 /\n&step load_factor = 1.0 duration = 3.0 first_increment = 0.2 /\n&step duration = 4.0 times = 1.0, 1.5 factors = 1.0, 0.2 /\n",
                "dynamic": "&step load_factor = 0.7 /\n&step duration = 1.0 load_factor = 0.7 first_increment = 0.2 /\n&step control = 'dynamic' load_factor = 0.2 duration = 3.0"
                           " stiffness_damping = 0.01 /\n&step load_factor = 0.1 duration = 1.0 first_increment = 0.3 /\n",
                "explicit": "&step load_factor = 0.7 /\n&step control = 'explicit' load_factor = 0.5 duration = 0.03 history_rows = 5 /\n&step load_factor = 0.1 /\n"}
        cut = 0
        for name, steps in ends.items():
            rows = self.solve(text + steps, name)
            whole = (self.path / f"{name}.history.csv").read_text()
            printed = self.call("run", f"{name}.nml")
            cut += sum(int(line.split(", ")[2].split()[0]) for line in printed.splitlines() if " iterations, " in line and " cuts, " in line)
            kept = 0
            for row in rows[:-1]:
                at = str(int(row["increment"]))
                shutil.rmtree(self.path / "again", ignore_errors=True)
                (self.path / "again").mkdir()
                for file in self.path.glob(f"{name}.*"):
                    shutil.copy(file, self.path / "again")
                run = subprocess.run([PROGRAM, "restart", "-q", f"again/{name}", "--from", at], cwd=self.path, capture_output=True, text=True, check=False, timeout=300, env=ENVIRONMENT)
                if "cannot restart from increment" in run.stderr:  # at rest after a motion
                    continue
                self.assertEqual(run.returncode, 0, run.stderr)
                kept += 1
                with self.subTest(name, at=at):
                    self.assertEqual((self.path / f"again/{name}.history.csv").read_text(), whole)
            self.assertGreaterEqual(kept, len(rows) - 3)
        self.assertGreater(cut, 0)

    # ------------------------------------------------------------------ refusals

    def test_refusals(self):
        load = "&load type = 'line' edge_set = 'edge_x1' vector = 0.1, 0, 0 /\n"
        common = LAW + STRIP + load
        self.refused(common + "&step control = 'arc_length' duration = 2.0 /\n",
                     "bad.nml:9: &step duration: of static steps those with control = 'load', 'displacement' and 'volume' can take time, found 'arc_length'")
        self.refused(common + "&step control = 'relax' duration = 2.0 /\n", "'volume' can take time, found 'relax'")
        watched = "control = 'displacement' node_set = 'edge_x1' component = 'x' displacements = 0.1, 0.2"
        self.refused(common + f"&step {watched} times = 1.0 duration = 2.0 /\n", "bad.nml:9: &step times: there are 1 times for 2 values of what is prescribed")
        self.refused(common + f"&step {watched} times = 2.0, 1.0 duration = 2.0 /\n", "bad.nml:9: &step times: times have to rise")
        self.refused(common.replace(load, "") + f"&step {watched} duration = 2.0 /\n", "needs a load or a moved support that follows the load factor")
        self.refused(common + "&step duration = 0 /\n", "bad.nml:9: &step duration")
        self.refused(common + "&step duration = 1 load_levels = 0.5 /\n", "load_levels")
        self.refused(common + "&step /\n&accuracy target = 0.1 /\n", "bad.nml:10: &accuracy: what laws with states remember cannot go on from mesh to mesh")
        self.refused(common + "&step /\n&sensitivity monitor = 'u' parameter = 'section.thickness' /\n", "laws with states remember the way that led to a state")
        self.refused(common.replace("thickness = 0.1", "thickness = 0.1 type = 'membrane'") + "&step /\n", "a membrane takes no law with states, as 'prony' is: take a shell")
        self.refused(common + "&step duration = 1 times = 0.0, 1.0 factors = 0.5, 1.0 /\n",
                     "the load factor jumps from 0.000000E+00 to 5.000000E-01 where the step begins, which takes no time: a step control = 'load' without duration goes there at once")


if __name__ == "__main__":
    unittest.main(verbosity=2)
