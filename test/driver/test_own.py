#!/usr/bin/env python3
"""Growth and thickness of elements with what else a run can do: restart, many runs, laws of shared libraries, derivatives, adaptive
meshes. Each is compared with another way of saying the same, or with what must not change."""
import csv
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}
COMPILER = shutil.which(os.environ.get("CC", "cc"))
STRIP = """&mesh generator = 'rectangle' lengths = 4.0, 1.0 divisions = 8, 2 /
&material name = 'm' {law} density = 1.0 /
&section thickness = 0.04, 0.06 {section} /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'gravity' vector = 0.0, 0.5, 3.0 constant = .true. /
&monitor name = 'tip' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
&monitor name = 'R' quantity = 'reaction' component = 'z' node_set = 'edge_x0' /
&step tolerance = 'tight' first_increment = 0.3 /
"""
GROWTH = "&growth growth = 1.05 layer = 1 /\n&growth prestretch = 1.1, 1.0 constant = .true. /\n"
RUBBER = "law = 'neo_hookean' mu = 1.0e4"


class Own(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def call(self, *arguments, code=0):
        done = subprocess.run([PROGRAM, *arguments], cwd=self.path, capture_output=True, text=True, env=ENVIRONMENT, timeout=300, check=False)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def rows(self, name):
        with (self.path / f"{name}.history.csv").open() as file:
            return [{k: float(v or "nan") for k, v in row.items()} for row in csv.DictReader(file)]

    def solve(self, text, *settings, name="a"):
        (self.path / f"{name}.nml").write_text(text)
        self.call("run", "-q", f"{name}.nml", *[word for s in settings for word in ("--set", s)])
        return self.rows(name)

    def test_files_beside_the_input(self):
        """A run goes on with the thickness, offset and growth that it had: their files are looked at again."""
        text = (STRIP.format(law=RUBBER, section="thickness_field = 't' offset_field = 'o'") + "&growth growth_field = 'g' /\n&output restart = 'every' /\n"
                + "".join(f"&field name = '{n}' file = '{n}.txt' /\n" for n in "tog"))
        files = {n: "".join(f"{a + b * i}\n" for i in range(32)) for n, a, b in (("t", 0.1, 0.001), ("o", 0.0, 1e-4), ("g", 1.0, 1e-3))}
        for n, numbers in files.items():
            (self.path / f"{n}.txt").write_text(numbers)
        whole = self.solve(text)
        self.call("restart", "-q", "a", "--from", "2")
        self.assertEqual(self.rows("a"), whole)
        for n, numbers in files.items():
            (self.path / f"{n}.txt").write_text(numbers.replace("3\n", "4\n"))
            self.assertIn("the mesh, or a file beside the input, is not that of the run of a", self.call("restart", "-q", "a", "--from", "2", code=2))
            (self.path / f"{n}.txt").write_text(numbers)

    def test_check(self):
        text = STRIP.format(law=RUBBER, section="thickness_field = 't' offset_ratio = 0.5") + GROWTH + "&field name = 't' over = 'x' points = 0, 0.15, 4, 0.05 /\n"
        (self.path / "a.nml").write_text(text)
        said = self.call("check", "a.nml")
        for words in ("Thickness of elements from 0.541667E-01 to 0.145833", "Offset of elements from 0.270833E-01 to 0.729167E-01",
                      "Growth of &growth number 1 (32 elements) at a factor of 1: along 1.05000, across 1.05000",
                      "Prestretch of &growth number 2 (32 elements) at a factor of 1: along 1.10000, across 1.00000"):
            self.assertIn(words, said)

    def test_derivatives_of_a_restart(self):
        """A run may go on with derivatives that it was not begun with."""
        text = STRIP.format(law=RUBBER, section="") + GROWTH + "&output restart = 'every' /\n"
        more = text + "&sensitivity monitor = 'tip' parameter = 'material.mu' name = 's' /\n"
        whole = self.solve(more, name="b")
        self.solve(text)
        (self.path / "more.nml").write_text(more)
        self.call("restart", "-q", "a", "more.nml", "--from", "2")
        self.assertEqual([row["s"] for row in self.rows("more")[-2:]], [row["s"] for row in whole[-2:]])

    def test_many_runs(self):
        """Values of growth and of fields, side by side, are those of runs one by one."""
        text = STRIP.format(law=RUBBER, section="thickness_field = 't'") + GROWTH + "&field name = 't' value = 0.1 /\n"
        self.solve(text, name="b")
        self.call("run", "b.nml", "--jobs", "2", "--set", "growth[1].growth=1.02,1.05", "--set", "field.value=0.08,0.1")
        self.assertEqual(self.rows("b.4"), self.rows("b"))
        self.assertEqual(self.rows("b.1"), self.solve(text, "growth[1].growth=1.02", "field.value=0.08"))

    def test_derivatives_have_no_gaps(self):
        """The state at rest has no derivatives: nothing is said of a law that ends."""
        text = STRIP.format(law=RUBBER, section="") + GROWTH + "&sensitivity monitor = 'tip' parameter = 'element_thickness' /\n"
        (self.path / "a.nml").write_text(text)
        self.assertNotIn("Missing", self.call("run", "-q", "a.nml"))

    def test_adaptive_mesh(self):
        """Refined elements have the thickness of those that they were made of: the weight stays."""
        (self.path / "t.txt").write_text("".join(f"{0.1 + 0.001 * i}\n" for i in range(32)))
        text = (STRIP.format(law=RUBBER, section="thickness_field = 't'") + GROWTH + "&field name = 't' file = 't.txt' /\n"
                "&accuracy monitor = 'tip' target = 0.003 /\n")
        rows = self.solve(text)
        self.assertGreater(rows[-1]["mesh"], 1)
        for row in rows:
            self.assertAlmostEqual(row["R"] / (-3 * 32 * 0.125 * (0.1 + 0.001 * 15.5)), 1, delta=1e-6)

    @unittest.skipUnless(COMPILER, "there is no C compiler")
    def test_law_of_a_library(self):
        """A law of a library grows, goes on after a restart to the bit, runs side by side, and has derivatives."""
        subprocess.run([COMPILER, "-O2", "-fPIC", "-shared", f"-I{SOURCE / 'api'}", SOURCE / "examples/user_laws/laws.c", "-o", self.path / "liblaws.so", "-lm"],
                       check=True)
        text = STRIP.format(law="library = 'liblaws.so' law = 'arruda_boyce' mu = 1.0e4 lock = 1.0e5", section="") + GROWTH + "&output restart = 'every' /\n"
        whole = self.solve(text)
        for mine, inside in zip(whole, self.solve(STRIP.format(law=RUBBER, section="") + GROWTH, name="b")):
            self.assertAlmostEqual(mine["tip"] / inside["tip"], 1, delta=1e-6)
        self.call("restart", "-q", "a", "--from", "2")
        self.assertEqual(self.rows("a"), whole)
        self.call("run", "a.nml", "--jobs", "2", "--set", "material.mu=1.0e4,1.2e4")
        self.assertEqual(self.rows("a.1"), whole)
        row = self.solve(text + "&sensitivity monitor = 'tip' parameter = 'material.mu' name = 's' /\n")[-1]
        near = [self.solve(text, f"material.mu={x}")[-1]["tip"] for x in (0.999e4, 1.001e4)]
        self.assertAlmostEqual(row["s"] / ((near[1] - near[0]) / 20), 1, delta=1e-5)


def dashpot(points, parameters, strain, begin):
    """S = E e + h, dh/dt + h/tau = E de/dt, implicit Euler. States: strain and h."""
    import numpy as np
    stiff, tau = parameters
    weight = 1 / (1 + points.time_step / tau)
    h = weight * (begin[3:] + stiff * (strain - begin[:3]))
    tangent = stiff * (1 + weight) * np.array([1, 1, 1, 0, 0, 0])[:, None] * np.ones(points.n)
    energy = 0.5 * stiff * (strain * strain).sum(axis=0) + 0.5 * (h * h).sum(axis=0) / stiff
    return energy, stiff * strain + h, tangent, np.concatenate([strain, h])


@unittest.skipUnless(importlib.util.find_spec("numpy") and os.environ.get("FINSHELL_LIB"), "needs numpy and the library")
class States(unittest.TestCase):
    def test_states_of_grown_sections(self):
        """A law that remembers, in a section that has grown by g all round: what it remembers counts from the stress-free state, so it is
        what it is without growth; energy is g^3 times as much, resultants per reference length g times; twice as thick, twice."""
        sys.path[:0] = [str(SOURCE / "api/python")]
        import finshell
        import numpy as np
        law = finshell.Law("dashpot", dashpot, parameters={"stiff": 10.0, "tau": None}, states=6)
        section = finshell.Section([finshell.Layer("neo_hookean", {"mu": 1.0}, 0.1), finshell.Layer(law, {"tau": 2.0}, 0.2, points=2)])
        X = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], dtype=float)
        g = 1.3
        grown = {"growth": np.tile(finshell.growth(g, g, g), (2, 2, 1))}

        def moved(a, b):
            return X, X * [a - 1, b - 1, 0], np.zeros_like(X)
        states = own = np.zeros((2, section.states))
        free = section.evaluate(*moved(g, g), states=own, **grown)
        self.assertLess(max(abs(free.force).max(), abs(free.states).max()), 1e-13)
        for step in range(4):
            when = {"time_step": 1.0 if step else 0.0, "time": float(step)}
            plain = section.evaluate(*moved(1.1, 1.0), states=states, **when)
            mine = section.evaluate(*moved(1.1 * g, g), states=own, **grown, **when)
            thick = section.evaluate(*moved(1.1 * g, g), states=own, thickness=[0.6, 0.6], **grown, **when)
            np.testing.assert_allclose(mine.states, plain.states, atol=1e-13)
            np.testing.assert_allclose(thick.states, plain.states, atol=1e-13)
            np.testing.assert_allclose(mine.energy, g**3 * plain.energy, rtol=1e-12)
            np.testing.assert_allclose(thick.energy, 2 * mine.energy, rtol=1e-12)
            states, own = plain.states, mine.states
            forces = [section.recover(*at, states=s, **more).membrane_force
                      for at, s, more in ((moved(1.1, 1.0), states, {}), (moved(1.1 * g, g), own, grown))]
            np.testing.assert_allclose(forces[1], g * forces[0], atol=1e-12)


if __name__ == "__main__":
    unittest.main()
