#!/usr/bin/env python3
"""Laws of shared libraries: the program runs with them, restarts to the bit, checks them, and says what is wrong; in Python a law of
one's own, by itself and compiled by numba where it is there."""
import csv
import ctypes
import importlib.util
import math
import os
import re
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
STRIP = """&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 4, 2 /
&material name = 'rubber' {law} /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_x1' vector = 5.0, 0.0, 0.2 /
&step load_factor = 1.0 first_increment = 0.25 largest_increment = 0.25 /
&monitor name = 'tip' quantity = 'displacement' component = 'x' node_set = 'edge_x1' /
"""
OTHER = """
#include "finshell_law.h"
static void nothing(const finshell_points *at, const double *p, const double *e, double *w, double *s, double *d, const double *b,
                    double *end, int32_t *codes) { (void)p; (void)e; (void)w; (void)s; (void)d; (void)b; (void)end; codes[at->n - 1] = 2; codes[0] = 2; }
static const finshell_law only[] = {{sizeof(finshell_law), "only", FINSHELL_LAW_PLANE, 1, 0, 0, NULL, nothing, NULL, NULL}};
FINSHELL_LAWS(only)
"""


@unittest.skipUnless(COMPILER, "no compiler of C")
class Library(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.path = Path(folder.name)
        (cls.path / "other.c").write_text(OTHER)
        (cls.path / "none.c").write_text("int nothing;\n")
        for source, name in ((SOURCE / "examples/user_laws/laws.c", "liblaws.so"), ("other.c", "libother.so"), ("none.c", "libnone.so")):
            subprocess.run([COMPILER, "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared", f"-I{SOURCE / 'api'}", str(source), "-o", name, "-lm"],
                           cwd=cls.path, check=True)

    def call(self, *arguments, code=0):
        run = subprocess.run([PROGRAM, *arguments], cwd=self.path, capture_output=True, text=True, check=False, timeout=300, env=ENVIRONMENT)
        self.assertEqual(run.returncode, code, run.stdout + run.stderr)
        return run.stdout + run.stderr

    def solve(self, name, law, *arguments):
        (self.path / f"{name}.nml").write_text(STRIP.format(law=law))
        self.call("run", "-q", f"{name}.nml", *arguments)
        with open(self.path / f"{name}.history.csv", encoding="utf-8") as f:
            return list(csv.DictReader(f))

    def test_a_long_chain_is_neo_hookean(self):
        # chains that never lock: the first term of the series alone
        theirs = self.solve("theirs", "law = 'neo_hookean' mu = 100.0")
        mine = self.solve("mine", "library = 'liblaws.so' law = 'arruda_boyce' mu = 100.0 lock = 1.0e6")
        self.assertGreater(float(mine[-1]["tip"]), 0.1)
        self.assertAlmostEqual(float(mine[-1]["tip"]) / float(theirs[-1]["tip"]), 1, delta=1e-8)
        stiffer = self.solve("stiffer", "library = 'liblaws.so' law = 'arruda_boyce' mu = 100.0 lock = 1.5")
        self.assertLess(float(stiffer[-1]["tip"]), 0.99 * float(mine[-1]["tip"]))

    def test_restart_is_the_same_to_the_bit(self):
        law = "library = 'liblaws.so' law = 'lee_sacks' c0 = 80.0 c1 = 3.0 c2 = 2.0"
        whole = self.solve("whole", law)
        (self.path / "part.nml").write_text(STRIP.format(law=law) + "&output restart = 'every' /\n")
        self.call("run", "-q", "part.nml")
        self.call("restart", "-q", "part", "--from", "2")
        with open(self.path / "part.history.csv", encoding="utf-8") as f:
            self.assertEqual(list(csv.DictReader(f))[-1]["tip"], whole[-1]["tip"])

    @unittest.skipUnless(shutil.which("c++"), "no compiler of C++")
    def test_in_c_plus_plus(self):
        (self.path / "other.cpp").write_text(OTHER)
        subprocess.run(["c++", "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared", f"-I{SOURCE / 'api'}", "other.cpp", "-o", "libplus.so"],
                       cwd=self.path, check=True)
        self.assertIn("material law 'only': it cannot be evaluated at rest", self.call("check-law", "libplus.so", code=2))

    @unittest.skipUnless(os.environ.get("FINSHELL_MPI_BIN") and shutil.which("mpirun"), "no finshell_mpi")
    def test_many_processes(self):
        one = self.solve("one", "library = 'liblaws.so' law = 'arruda_boyce' mu = 100.0 lock = 2.0")
        (self.path / "two").mkdir()
        subprocess.run(["mpirun", "--allow-run-as-root", "--oversubscribe", "-n", "2", os.environ["FINSHELL_MPI_BIN"], "run", "-q", "-o", "two", "one.nml"],
                       cwd=self.path, check=True, capture_output=True, timeout=300, env=ENVIRONMENT)
        with open(self.path / "two" / "one.history.csv", encoding="utf-8") as f:
            self.assertAlmostEqual(float(list(csv.DictReader(f))[-1]["tip"]), float(one[-1]["tip"]), delta=1e-12)

    def test_guide(self):
        code = re.findall(r"^```c\n(.*?)^```", (SOURCE / "doc/user_laws.md").read_text(encoding="utf-8"), re.S | re.M)[0]
        (self.path / "rubber.c").write_text(code)
        subprocess.run([COMPILER, "-O3", "-Wall", "-Werror", "-fPIC", "-shared", f"-I{SOURCE / 'api'}", "rubber.c", "-o", "librubber.so"],
                       cwd=self.path, check=True)
        self.assertIn("Law rubber with mu = 1.00000\n  ok    rest ", self.call("check-law", "librubber.so"))

    def test_check_law(self):
        said = self.call("check-law", "liblaws.so#lee_sacks")
        self.assertIn("Law lee_sacks with c0 = 10.0000", said)
        self.assertEqual(said.count("\n  ok "), 12)
        self.assertIn("It remembers 6 numbers at each point", self.call("check-law", "liblaws.so#prony", "e=10", "g=0.5", "tau=1"))
        self.assertIn("Law yeoh with", self.call("check-law", "yeoh"))

    def test_the_library_of_the_environment(self):
        # what hosts without room for a path do: CalculiX writes names in capitals
        run = {"cwd": self.path, "capture_output": True, "text": True, "check": False, "timeout": 60}
        said = subprocess.run([PROGRAM, "check-law", "PLUGIN#LEE_SACKS"], env={**ENVIRONMENT, "FINSHELL_LAWS": "./liblaws.so"}, **run)
        self.assertEqual(said.returncode, 0, said.stderr)
        self.assertIn("Law lee_sacks with", said.stdout)
        said = subprocess.run([PROGRAM, "check-law", "plugin"], env={k: v for k, v in ENVIRONMENT.items() if k != "FINSHELL_LAWS"}, **run)
        self.assertEqual(said.returncode, 2)
        self.assertIn("the law 'plugin' is one of the library that the environment variable FINSHELL_LAWS names, and that is not set", said.stderr)

    def test_refusals(self):
        for arguments, words in ((("check-law",), "the command check-law needs the name of a law: of the program, or LIBRARY#LAW"),
                                 (("check-law", "yeoh", "c1"), "a parameter is expected as NAME=VALUE, found 'c1'"),
                                 (("check-law", "yeoh", "c1=x"), "a parameter is expected as NAME=VALUE, found 'c1=x'"),
                                 (("check-law", "yeo"), "unknown material law 'yeo'"),
                                 (("check-law", "liblaws.so"), "which law is not said; laws: arruda_boyce, lee_sacks, prony"),
                                 (("check-law", "liblaws.so#x"), "there is no law 'x'; laws: arruda_boyce, lee_sacks, prony"),
                                 (("check-law", "libother.so"), "material law 'only': it cannot be evaluated at rest"),
                                 (("check-law", "libnone.so"), "it has no function finshell_law_1"),
                                 (("check-law", "nowhere.so"), "it cannot be loaded")):
            with self.subTest(words):
                self.assertIn(words, self.call(*arguments, code=2))
        for law, words in (("library = 'nowhere.so'", "bad.nml:2: &material library: library of laws"),
                           ("library = 'liblaws.so'", "which law is not said"),
                           ("library = 'liblaws.so' law = 'arruda_boyce' mu = 1.0", "bad.nml:2: &material: material law 'arruda_boyce': parameter 'lock' is missing; the law takes mu, lock"),
                           ("library = 'liblaws.so' law = 'arruda_boyce' mu = 1.0 lock = 2 nu = 3", "nu")):
            with self.subTest(words):
                (self.path / "bad.nml").write_text(STRIP.format(law=law))
                said = self.call("run", "bad.nml", code=2)
                self.assertIn(words, said)
                self.assertIn("bad.nml:2: ", said)


@unittest.skipUnless(COMPILER and importlib.util.find_spec("numpy"), "no compiler of C, or no numpy")
class MFront(unittest.TestCase):
    """The adapter to MGIS, with a stand-in for it (test/mgis)."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.adapter = os.path.join(folder.name, "libfinshell_mgis.so")
        common = [COMPILER, "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared", f"-I{SOURCE / 'api'}", f"-I{SOURCE / 'test/mgis'}"]
        subprocess.run([*common, str(SOURCE / "test/mgis/mgis.c"), str(SOURCE / "api/mfront/finshell_mgis.c"), "-o", cls.adapter, "-lm"], check=True)
        sys.path.insert(0, str(SOURCE / "api/python"))

    def law(self, behaviour):
        return f"plugin:{self.adapter}#stand-in:{behaviour}"

    def test_neo_hookean_is_that_of_the_library(self):
        import finshell
        import numpy as np
        values = {"mu": 100.0, "lambda": 150.0}
        self.assertEqual([f.name for f in finshell.check_law(self.law("NeoHookean"), values) if not f.passed], [])
        X = np.array([[[0, 0, 0], [1, 0, 0], [0.2, 1, 0.1]]], dtype=float)
        u = 0.2 * np.sin(7 * X + 1)
        t = 0.1 * np.cos(5 * X)
        mine, theirs = (finshell.Section(law, values, thickness=0.1).evaluate(X, u, t) for law in (self.law("NeoHookean"), "compressible_neo_hookean"))
        self.assertAlmostEqual(mine.energy[0] / theirs.energy[0], 1, delta=1e-12)
        self.assertLess(abs(mine.force - theirs.force).max() / abs(theirs.force).max(), 1e-11)
        self.assertLess(abs(mine.tangent - theirs.tangent).max() / abs(theirs.tangent).max(), 1e-8)

    def test_internal_variables_are_states(self):
        import finshell
        import numpy as np
        section = finshell.Section(self.law("Maxwell"), {"mu": 100.0, "lambda": 150.0, "part": 0.6, "tau": 2.0}, thickness=0.1)
        self.assertEqual(section.states, 3 * 3 * 22)
        X = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], dtype=float)
        u = np.zeros_like(X)
        u[:, :, 0] = 0.1 * X[:, :, 0] + 0.05 * X[:, :, 1]
        u[:, :, 1] = 0.05 * X[:, :, 0]  # symmetric: the stiffness against drilling does not relax
        states, first, now = np.zeros((1, section.states)), None, 0.0
        for step in (0.0, 0.5, 2.0, 0.1):
            now += step
            r = section.evaluate(X, u, np.zeros_like(X), states=states, time=now, time_step=step)
            first = r.force if first is None else first
            self.assertLess(abs(r.force - (0.4 + 0.6 * math.exp(-now / 2)) * first).max() / abs(first).max(), 1e-9)
            states = r.states

    def test_refusals(self):
        import finshell
        for name, words in (("x", "'x' names no behaviour, expected LIBRARY:BEHAVIOUR"),
                            ("stand-in:Other", "behaviour 'stand-in:Other': the library has no such behaviour")):
            with self.assertRaisesRegex(finshell.Error, words):
                finshell.check_law(f"plugin:{self.adapter}#{name}")


@unittest.skipUnless(importlib.util.find_spec("numpy"), "no numpy")
class Python(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        sys.path[:0] = [str(SOURCE / "api/python"), str(SOURCE / "examples/user_laws")]
        import fung
        cls.fung = fung

    def square(self, stretch):
        import numpy as np
        X = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], dtype=float)
        u = np.zeros_like(X)
        u[:, :, 0] = (stretch - 1) * X[:, :, 0]
        return X, u, np.zeros_like(X)

    def test_fung(self):
        import finshell
        self.assertEqual([f.name for f in finshell.check_law(self.fung.law, self.fung.ARTERY) if not f.passed], [])
        section = finshell.Section(self.fung.law, self.fung.ARTERY, thickness=0.1)
        force = section.recover(*self.square(1.5)).membrane_force[0]
        e = 0.5 * (1.5**2 - 1)
        scale = 0.1 * 26.95 * e * math.exp(0.9925 * e * e)
        self.assertAlmostEqual(force[0], 0.9925 * scale, delta=1e-12)
        self.assertAlmostEqual(force[1], 0.0749 * scale, delta=1e-12)
        with self.assertRaises(finshell.Recoverable):
            section.evaluate(*self.square(8.0))

    def test_guide(self):
        import finshell
        import numpy as np
        code = re.findall(r"^```python\n(.*?)^```", (SOURCE / "doc/user_laws.md").read_text(encoding="utf-8"), re.S | re.M)[0]
        names = {}
        exec(compile(code, "user_laws.md", "exec"), names)  # noqa: S102  our own text
        theirs = finshell.Section("neo_hookean", {"mu": 1.0}, thickness=0.1).evaluate(*self.square(1.2))
        mine = names["section"].evaluate(*self.square(1.2))
        self.assertLess(np.abs(mine.tangent - theirs.tangent).max(), 1e-13)

    def test_a_layer_and_states(self):
        import finshell
        import numpy as np

        def dashpot(points, parameters, strain, begin):  # S = E e + h, dh/dt + h/tau = E de/dt, implicit Euler
            stiff, tau = parameters
            weight = 1 / (1 + points.time_step / tau)
            h = weight * (begin[3:] + stiff * (strain - begin[:3]))
            tangent = stiff * (1 + weight) * np.array([1, 1, 1, 0, 0, 0])[:, None] * np.ones(points.n)
            energy = 0.5 * (strain * (stiff * strain)).sum(axis=0) + 0.5 * (h * h).sum(axis=0) / stiff
            return energy, stiff * strain + h, tangent, np.concatenate([strain, h])

        law = finshell.Law("dashpot", dashpot, parameters={"stiff": 10.0, "tau": None}, states=6)
        section = finshell.Section([finshell.Layer("neo_hookean", {"mu": 1.0}, 0.1), finshell.Layer(law, {"tau": 2.0}, 0.2, points=2)])
        self.assertEqual(section.states, 3 * 2 * 6)
        states, forces = np.zeros((2, section.states)), []
        for step in range(4):
            result = section.evaluate(*self.square(1.1), states=states, time_step=1.0 if step else 0.0, time=float(step))
            forces.append(result.force[0, 6])
            states = result.states
        drops = [a - b for a, b in zip(forces, forces[1:])]
        for a, b in zip(drops, drops[1:]):
            self.assertAlmostEqual(b / a, 1 / 1.5, delta=1e-9)
        with self.assertRaisesRegex(finshell.Error, "states_begin is NULL"):
            section.evaluate(*self.square(1.1))

    def test_a_law_that_raises(self):
        import finshell

        def broken(points, parameters, strain, begin):
            raise RuntimeError("on purpose")

        with self.assertRaisesRegex(finshell.Error, "cannot be evaluated at rest"):
            with open(os.devnull, "w", encoding="utf-8") as nowhere:
                kept, sys.stderr = sys.stderr, nowhere
                try:
                    finshell.Section(finshell.Law("broken", broken), {}, thickness=1.0)
                finally:
                    sys.stderr = kept
        with self.assertRaisesRegex(ValueError, "kind is 'flat'"):
            finshell.Law("flat", broken, kind="flat")

    @unittest.skipUnless(COMPILER, "no compiler of C")
    def test_an_address(self):
        import finshell
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "libone.so")
            code = (SOURCE / "examples/user_laws/laws.c").read_text().replace("static void arruda_boyce", "void arruda_boyce")
            Path(folder, "one.c").write_text(code)
            subprocess.run([COMPILER, "-O2", "-fPIC", "-shared", f"-I{SOURCE / 'api'}", "one.c", "-o", path, "-lm"], cwd=folder, check=True)
            address = ctypes.cast(ctypes.CDLL(path).arruda_boyce, ctypes.c_void_p).value
            law = finshell.Law("chains", address, kind="incompressible", isotropic=True, parameters={"mu": None, "lock": None})
            mine = finshell.Section(law, {"mu": 2.0, "lock": 5.0}, thickness=0.1).evaluate(*self.square(1.3))
            theirs = finshell.Section(f"plugin:{path}#arruda_boyce", {"mu": 2.0, "lock": 5.0}, thickness=0.1).evaluate(*self.square(1.3))
            self.assertTrue((mine.force == theirs.force).all() and (mine.tangent == theirs.tangent).all())

    @unittest.skipUnless(importlib.util.find_spec("numba"), "no numba")
    def test_numba(self):
        import finshell
        import numba

        @numba.cfunc(finshell.numba_signature())
        def rubber(at, p, e, w, s, d, begin, end, codes):
            n, mu = numba.carray(at, 2)[0], p[0]
            for i in range(n):
                w[i] = mu * (e[i] + e[n + i] + e[2 * n + i])
                s[i] = s[n + i] = s[2 * n + i] = mu
                s[3 * n + i] = 0.0
                for k in range(10):
                    d[k * n + i] = 0.0

        law = finshell.Law("rubber", rubber.address, kind="incompressible", isotropic=True, parameters={"mu": None})
        mine = finshell.Section(law, {"mu": 2.0}, thickness=0.1).evaluate(*self.square(1.3))
        theirs = finshell.Section("neo_hookean", {"mu": 2.0}, thickness=0.1).evaluate(*self.square(1.3))
        self.assertLess(abs(mine.force - theirs.force).max(), 1e-13)


if __name__ == "__main__":
    unittest.main()
