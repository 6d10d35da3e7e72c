#!/usr/bin/env python3
"""The element in CalculiX: a cantilever, a hemisphere and the deck of doc/hosts_calculix.md, compared with our driver.

CalculiX is built from Debian's source package, into build/calculix (a minute of CPU time the first time). Skipped when the
package cannot be fetched, or a library that it needs is missing.
"""
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
from pathlib import Path

import h5py
import numpy as np

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
BINARY = Path(os.environ["FINSHELL_BINARY_DIR"])
DRIVER = os.environ.get("FINSHELL_BIN", "")
LIBRARY = Path(os.environ.get("FINSHELL_LIB", "")).parent / "libfinshell.a"
UNAVAILABLE = 3  # status of build_calculix
SKIPPED = 77
# CalculiX takes a residual below 1e-6 as zero, whatever the unit: so the unit of force is made small.
FORCE_UNIT = 1e-6


def build():
    """Path of CalculiX with our element."""
    run = subprocess.run([SOURCE / "api/calculix/build_calculix", "--cache", SOURCE / "build/calculix", "--modules",
                          BINARY / "modules", "--library", LIBRARY, "--program", BINARY / "test/bin/ccx_finshell", "--optimise", "-O0"],
                         capture_output=True, text=True, check=False)
    print(run.stderr, end="")
    if run.returncode == UNAVAILABLE:
        sys.exit(SKIPPED)
    if run.returncode != 0:
        sys.exit(f"build_calculix failed with status {run.returncode}")
    return run.stdout.split()[-1]


class Result:
    """What CalculiX printed and wrote for one deck."""

    def __init__(self, program, deck, folder, name="job", threads=1):
        Path(folder, name + ".inp").write_text(deck, encoding="ascii")
        environment = {**os.environ, "OMP_NUM_THREADS": str(threads), "CCX_NPROC_EQUATION_SOLVER": "1"}
        run = subprocess.run([program, name], cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=600)
        self.status, self.log = run.returncode, run.stdout
        self.folder, self.name = Path(folder), name

    def blocks(self, quantity):
        """Tables of NAME.dat under a heading, one for each increment: {node: values}."""
        found, current = [], None
        for line in (self.folder / (self.name + ".dat")).read_text(encoding="ascii").splitlines():
            if line.strip().startswith(quantity):
                current = {}
                found.append(current)
            elif current is not None and re.match(r"\s*\d+\s", line):
                words = line.split()
                current[int(words[0])] = np.array([float(w) for w in words[1:4]])
            elif line.strip():
                current = None
        return found

    def displacement(self, nodes):
        """Displacements at the end, (node, component)."""
        last = self.blocks("displacements")[-1]
        return np.array([last[i + 1] for i in range(nodes)])

    def iterations(self):
        """[[(residual, correction) ...] for each converged increment], both relative, from NAME.cvg."""
        increments = {}
        for line in (self.folder / (self.name + ".cvg")).read_text(encoding="ascii").splitlines():
            words = line.split()
            if len(words) == 9 and words[0].isdigit():
                increments.setdefault((int(words[1]), int(words[2])), []).append((float(words[5]) / 100, float(words[6]) / 100))
        last = {increment: attempt for increment, attempt in sorted(increments)}
        return [increments[key] for key in sorted(last.items())]


def solve(text, folder):
    """Mesh and displacements of our driver: (points, triangles, displacements)."""
    Path(folder, "model.nml").write_text(text, encoding="ascii")
    run = subprocess.run([DRIVER, "run", "model.nml"], cwd=folder, capture_output=True, text=True, check=False)
    if run.returncode != 0:
        raise AssertionError(run.stdout + run.stderr)
    with h5py.File(Path(folder, "model.vtkhdf")) as file:
        group = file["VTKHDF"]
        points = group["Points"][:]
        triangles = group["Connectivity"][:].reshape(-1, 3)
        return points, triangles, group["PointData/displacement"][-len(points):]


def deck(points, triangles, material, constants, thickness, supports, loads, step):
    """Input of CalculiX. supports: [(node, first, last dof)]; loads: [(node, dof, value)]; nodes from 0."""
    # of a number CalculiX reads twenty characters
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{i + 1}, " + ", ".join(f"{c:.13e}" for c in p) for i, p in enumerate(points)]
    lines += ["*USER ELEMENT, TYPE=US3F, NODES=3, INTEGRATION POINTS=3, MAXDOF=6", "*ELEMENT, TYPE=US3F, ELSET=SHELL"]
    lines += [f"{e + 1}, " + ", ".join(str(n + 1) for n in t) for e, t in enumerate(triangles)]
    lines += [f"*MATERIAL, NAME={material}", f"*USER MATERIAL, CONSTANTS={len(constants)}"]
    lines += [", ".join(f"{c:.12g}" for c in constants)]
    lines += ["*USER SECTION, ELSET=SHELL, MATERIAL=" + material + ", CONSTANTS=8", f"{thickness}, 0, 0, 0, 0, 0, 0, 0"]
    lines += ["*BOUNDARY"] + [f"{n + 1}, {a}, {b}" for n, a, b in supports]
    lines += ["*STEP, NLGEOM, INC=1000", "*STATIC", step]
    lines += ["*CONTROLS, PARAMETERS=FIELD", "1e-10, 1e-8, , , 1e-10, 1e-5, 1e-3, 1e-16"]
    lines += ["*CONTROLS, PARAMETERS=TIME INCREMENTATION", "10, 12, 30, 40, 14, 8, , 5, , ", "0.25, 0.5, 0.75, 0.85, , , 1.5, "]
    lines += ["*CLOAD"] + [f"{n + 1}, {d}, {v:.12g}" for n, d, v in loads]
    lines += ["*NODE PRINT, NSET=ALL, FREQUENCY=1000", "U"]
    lines += ["*NODE FILE", "U", "*END STEP", ""]
    return "\n".join(lines)


def blocks_of(page, language):
    """The blocks of a language in doc/hosts_calculix.md."""
    return re.findall(rf"```{language}\n(.*?)```", (SOURCE / "doc" / page).read_text(encoding="utf-8"), re.DOTALL)


CANTILEVER = """
&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 16, 1 /
&material name = 'm' law = 'st_venant_kirchhoff' e = 1.2e6 nu = 0.0 /
&section thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'force' node_set = 'edge_x1' vector = 0.0, 0.0, 4.0 total = .true. /
&step residual_tolerance = 1e-10 correction_tolerance = 1e-8 /
"""

HEMISPHERE = """
&mesh generator = 'sphere' radius = 10.0 colatitudes = 18.0, 90.0 azimuths = 0.0, 90.0 divisions = 8, 8 normals = 'facet' /
&material name = 'm' law = 'st_venant_kirchhoff' e = 6.825e7 nu = 0.3 /
&section thickness = 0.04 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'mid_top' fixed = 'uz' /
&load type = 'force' node_set = 'corner_a0_bottom' vector = 200.0, 0.0, 0.0 /
&load type = 'force' node_set = 'corner_a1_bottom' vector = 0.0, -200.0, 0.0 /
&step residual_tolerance = 1e-10 correction_tolerance = 1e-8 /
"""


class Calculix(unittest.TestCase):
    """Problems solved by CalculiX and by the driver on the same mesh."""

    program = ""

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="finshell_calculix_")
        self.addCleanup(shutil.rmtree, self.folder)

    def cantilever(self, step="0.1, 1.", threads=1, name="cantilever", **changes):
        """Result of CalculiX and the displacements of the driver."""
        points, triangles, u = solve(CANTILEVER, self.folder)
        clamped = [(i, 1, 6) for i in np.flatnonzero(points[:, 0] < 1e-9)]
        loads = [(i, 3, 2 / FORCE_UNIT) for i in np.flatnonzero(points[:, 0] > 10 - 1e-9)]
        text = deck(points, triangles, "ST_VENANT_KIRCHHOFF-STEEL", [1.2e6 / FORCE_UNIT, 0], 0.1, clamped, loads, step)
        for old, new in changes.get("replace", ()):
            self.assertIn(old, text)
            text = text.replace(old, new)
        return Result(self.program, text, self.folder, name, threads), points, u

    def check_agreement(self, result, u):
        """Displacements of all nodes, to 1e-6 of the largest; they are printed with seven digits."""
        self.assertEqual(result.status, 0, result.log[-2000:])
        difference = np.abs(result.displacement(len(u)) - u).max() / np.abs(u).max()
        print(f"{result.name}: largest displacement {np.abs(u).max():.6f}, relative difference {difference:.1e}")
        self.assertLess(difference, 1e-6)

    def check_quadratic(self, result):
        """The largest correction c of an iteration, relative to the increment, against those before it.

        In thin shells iterations with large bending and large membrane corrections alternate, so the two before it count: the bound
        is 20 max(c1, c2)^2; and once both are below 1e-4, the next one is a thousand times smaller than the last, or round-off. A
        tangent that is wrong by one per cent gains a factor of 100 in each iteration and fails this.
        """
        increments = result.iterations()
        self.assertGreater(len(increments), 3)
        for increment in increments:
            corrections = [correction for _, correction in increment]
            self.assertLess(corrections[-1], 1e-6)
            for first, second, third in zip(corrections, corrections[1:], corrections[2:]):
                if max(first, second) < 1e-2:
                    self.assertLess(third, max(20 * max(first, second) ** 2, 1e-11), increment)
                if max(first, second) < 1e-4:
                    self.assertLess(third, max(1e-3 * second, 1e-11), increment)

    def test_cantilever(self):
        result, _, u = self.cantilever()
        self.check_agreement(result, u)
        self.check_quadratic(result)

    def test_hemisphere(self):
        points, triangles, u = solve(HEMISPHERE, self.folder)
        polar, azimuth = math.radians(18), math.radians(45)
        top = 10 * np.array([math.sin(polar) * math.cos(azimuth), math.sin(polar) * math.sin(azimuth), math.cos(polar)])
        number = {name: int(np.argmin(np.linalg.norm(points - place, axis=1)))
                  for name, place in (("top", top), ("a", [10, 0, 0]), ("b", [0, 10, 0]))}
        supports = [(i, d, d) for i in np.flatnonzero(np.abs(points[:, 1]) < 1e-9) for d in (2, 4, 6)]
        supports += [(i, d, d) for i in np.flatnonzero(np.abs(points[:, 0]) < 1e-9) for d in (1, 5, 6)]
        supports.append((number["top"], 3, 3))
        loads = [(number["a"], 1, 200 / FORCE_UNIT), (number["b"], 2, -200 / FORCE_UNIT)]
        text = deck(points, triangles, "ST_VENANT_KIRCHHOFF", [6.825e7 / FORCE_UNIT, 0.3], 0.04, supports, loads, "0.05, 1.")
        result = Result(self.program, text, self.folder, "hemisphere")
        self.check_agreement(result, u)
        self.check_quadratic(result)
        self.assertGreater(u[number["a"], 0], 3)

    def test_rotation_beyond_pi(self):
        """Roll-up by a moment to nine tenths of a circle, kept in its plane: there the rotation vector is an angle."""
        moment = 0.9 * 2 * math.pi * 1.2e6 * 0.1**3 / 12 / 10
        model = CANTILEVER.replace("'force'", "'moment'").replace("0.0, 0.0, 4.0", f"0.0, {-moment:.12f}, 0.0")
        model = model.replace("&load", "&support node_set = 'all' fixed = 'uy', 'rx', 'rz' /\n&load").replace("1e-10", "1e-8")
        points, triangles, u = solve(model, self.folder)
        supports = [(i, 1, 6) for i in np.flatnonzero(points[:, 0] < 1e-9)]
        supports += [(i, d, d) for i in np.flatnonzero(points[:, 0] > 1e-9) for d in (2, 4, 6)]
        loads = [(i, 5, -moment / 2 / FORCE_UNIT) for i in np.flatnonzero(points[:, 0] > 10 - 1e-9)]
        text = deck(points, triangles, "ST_VENANT_KIRCHHOFF", [1.2e6 / FORCE_UNIT, 0], 0.1, supports, loads, "0.05, 1.")
        result = Result(self.program, text, self.folder, "rolled_up")
        self.check_agreement(result, u)
        self.assertLess(u[-1, 0], -10, "the end has turned back")

    def test_threads(self):
        texts = []
        for threads in (1, 2, 4):
            result, _, _ = self.cantilever(threads=threads, name=f"threads_{threads}")
            self.assertEqual(result.status, 0)
            texts.append(Path(self.folder, result.name + ".dat").read_text(encoding="ascii"))
        self.assertEqual(texts[1:], texts[:-1])

    def test_linear_step(self):
        """Without NLGEOM: beam theory, and proportional to the load."""
        result, points, _ = self.cantilever(replace=[("*STEP, NLGEOM", "*STEP")])
        self.assertEqual(result.status, 0, result.log[-2000:])
        tip = result.displacement(len(points))[-2:, 2].mean()
        self.assertAlmostEqual(tip / (4 * 10**3 / (3 * 1.2e6 * 0.1**3 / 12)), 1, delta=0.01)

    def test_frequency(self):
        """First bending frequency of the cantilever against Euler-Bernoulli; the density fits FORCE_UNIT."""
        density = 1.0e-3
        result, _, _ = self.cantilever(replace=[
            ("*USER SECTION", f"*DENSITY\n{density / FORCE_UNIT}\n*USER SECTION"), ("*STATIC\n0.1, 1.\n", "*FREQUENCY\n5\n"),
            ("*STEP, NLGEOM, INC=1000", "*STEP")])
        self.assertEqual(result.status, 0, result.log[-2000:])
        text = Path(self.folder, "cantilever.dat").read_text(encoding="ascii")
        found = float(re.search(r"^\s+1\s+\S+\s+\S+\s+(\S+)", text, re.MULTILINE).group(1))
        expected = 1.87510407**2 / (2 * math.pi) * math.sqrt(1.2e6 * 0.1**2 / 12 / density / 10**4)
        self.assertAlmostEqual(found / expected, 1, delta=0.01)

    def test_increment_is_cut(self):
        """Gent's law locks: the whole load at once overshoots the limit, the element asks for less, and the load is reached."""
        points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
        supports = [(0, 1, 6), (3, 1, 1), (3, 3, 6), (1, 2, 6), (2, 3, 6)]
        mu, jm, stretch, thickness = 2.0e5, 10.0, 3.5, 0.1
        i1 = stretch**2 + 2 / stretch
        force = mu * jm / (jm - i1 + 3) * (stretch - stretch**-2) * thickness
        loads = [(1, 1, force / 2), (2, 1, force / 2)]
        text = deck(points, [[0, 1, 2], [0, 2, 3]], "GENT", [mu, jm], thickness, supports, loads, "1., 1.")
        text = text.replace("*NODE FILE", "*EL PRINT, ELSET=SHELL, FREQUENCY=1000\nS\n*NODE FILE")
        result = Result(self.program, text, self.folder)
        self.assertEqual(result.status, 0, result.log[-2000:])
        self.assertIn("decrease requested by a material user routine", result.log)
        u = result.displacement(4)
        self.assertAlmostEqual(u[1, 0], stretch - 1, delta=2e-6)
        self.assertAlmostEqual(u[2, 1], stretch**-0.5 - 1, delta=2e-6)
        printed = Path(self.folder, "job.dat").read_text(encoding="ascii")
        rows = re.findall(r"^ +[12] +[123] +(\S+) +(\S+) +\S+ +(\S+)", printed, re.MULTILINE)
        self.assertEqual(len(rows), 6)
        stress = np.array(rows, float) / (force * stretch / thickness)
        self.assertLess(np.abs(stress - [1, 0, 0]).max(), 1e-5, "Cauchy stress: force over current cross section")

    def test_law_of_a_library(self):
        """PLUGIN#LAW: the eight-chain model of examples/user_laws, with the parameters of the deck, beside the driver with the same library."""
        library = Path(self.folder, "liblaws.so")
        subprocess.run([os.environ["FINSHELL_CC"], "-O2", "-fPIC", "-shared", f"-I{SOURCE / 'api'}", SOURCE / "examples/user_laws/laws.c",
                        "-o", library, "-lm"], check=True)
        elastic = "law = 'st_venant_kirchhoff' e = 1.2e6 nu = 0.0"
        strip = CANTILEVER.replace("10.0, 1.0", "2.0, 1.0").replace("16, 1", "4, 1").replace("0.0, 0.0, 4.0", "1e5, 0.0, 2e3")
        _, _, plain = solve(strip.replace(elastic, "law = 'neo_hookean' mu = 4e5"), self.folder)
        points, triangles, u = solve(strip.replace(elastic, f"law = 'arruda_boyce' library = '{library}' mu = 4e5 lock = 2.0"), self.folder)
        self.assertGreater(np.abs(u - plain).max() / np.abs(u).max(), 0.05, "the law is to matter")
        supports = [(i, 1, 6) for i in np.flatnonzero(points[:, 0] < 1e-9)]
        loads = [(i, d, f / 2 / FORCE_UNIT) for i in np.flatnonzero(points[:, 0] > 2 - 1e-9) for d, f in ((1, 1e5), (3, 2e3))]
        text = deck(points, triangles, "PLUGIN#ARRUDA_BOYCE-RUBBER", [4e5 / FORCE_UNIT, 2.0], 0.1, supports, loads, "0.1, 1.")
        with unittest.mock.patch.dict(os.environ, FINSHELL_LAWS=str(library)):
            self.check_agreement(Result(self.program, text, self.folder, "own_law"), u)
        result = Result(self.program, text, self.folder, "no_laws")
        self.assertNotEqual(result.status, 0)
        self.assertIn("variable FINSHELL_LAWS names, and that is not set", result.log)

    def test_wrong_input(self):
        """What is wrong is said, and CalculiX stops."""
        for old, new, message in (
            ("ST_VENANT_KIRCHHOFF-STEEL", "RUBBER", "known laws are mooney_rivlin"),
            ("CONSTANTS=2\n1.2e+12, 0", "CONSTANTS=1\n1.2e+12", "parameter 'nu' is missing"),
            ("CONSTANTS=2\n1.2e+12, 0", "CONSTANTS=3\n1.2e+12, 0, 0", "3 constants, but the law takes 2"),
            ("0.1, 0, 0, 0,", "0.1, 0.5, 0, 0,", "points"),
            ("0.1, 0, 0, 0,", "-0.1, 0, 0, 0,", "thickness"),
            ("INTEGRATION POINTS=3", "INTEGRATION POINTS=1", "INTEGRATION POINTS=3, MAXDOF=6, NODES=3 expected"),
            ("*USER MATERIAL, CONSTANTS=2", "*ELASTIC", "*USER MATERIAL expected"),
            ("*CLOAD", "*DLOAD\nSHELL, P, 1.\n*CLOAD", "distributed loads"),
            ("*CLOAD", "*DLOAD\nSHELL, GRAV, 9.81, 0., 0., -1.\n*CLOAD", "distributed loads"),
            ("*STATIC\n0.1, 1.\n", "*BUCKLE\n1\n", "buckling steps are not supported"),
        ):
            with self.subTest(new=new):
                density = ("*USER SECTION", "*DENSITY\n1.\n*USER SECTION")
                result, _, _ = self.cantilever(replace=[density, (old, new)])
                self.assertNotEqual(result.status, 0)
                self.assertIn(message, result.log)

    def test_deck_of_the_manual(self):
        """doc/hosts_calculix.md: deck and input of the driver describe the same."""
        (text,), (model,) = blocks_of("hosts_calculix.md", "text"), blocks_of("hosts_calculix.md", "fortran")
        self.assertEqual(text, (SOURCE / "api/calculix/strip.inp").read_text(encoding="ascii"))
        _, _, u = solve(model, self.folder)
        result = Result(self.program, text, self.folder, "strip")
        self.check_agreement(result, u)
        stress = Path(self.folder, "strip.dat").read_text(encoding="ascii")
        self.assertIn("stresses", stress)


if __name__ == "__main__":
    Calculix.program = build()
    unittest.main(verbosity=2)
