#!/usr/bin/env python3
"""finshell-fit: exact parameters from exact stresses, published parameters of published data, and the program gives the stresses of the fit."""
import contextlib
import csv
import io
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "api" / "python"))
from finshell import fit as tool  # noqa: E402
from finshell._laws import LAWS, PATHS, stable_range  # noqa: E402

TRELOAR = SOURCE / "api" / "python" / "examples" / "treloar_1944_uniaxial.csv"
KAWABATA = SOURCE / "api" / "python" / "examples" / "kawabata_1981_biaxial.csv"

# Ogden, Proc. R. Soc. Lond. A 326 (1972) 565: three terms for Treloar's data in simple tension, pure shear and equibiaxial tension,
# mu in kgf/cm2 (0.0980665 MPa)
OGDEN_1972 = {"mu1": 6.3 * 0.0980665, "alpha1": 1.3, "mu2": 0.012 * 0.0980665, "alpha2": 5.0, "mu3": -0.1 * 0.0980665, "alpha3": -2.0}

EXACT = {"neo_hookean": {"mu": 0.4}, "mooney_rivlin": {"c10": 0.16, "c01": 0.02}, "yeoh": {"c1": 0.18, "c2": -1.8e-3, "c3": 4.5e-5},
         "gent": {"mu": 0.27, "jm": 85.9}, "ogden1": {"mu1": 0.6, "alpha1": 1.5},
         "ogden2": {"mu1": 0.6, "alpha1": 1.7, "mu2": -0.01, "alpha2": -2.0},
         "ogden3": {"mu1": 1.2e-3, "alpha1": 5.0, "mu2": 0.62, "alpha2": 1.3, "mu3": -0.01, "alpha3": -2.0}}

PATCH = """&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 4, 2 distortion = 0.1 /
{material}
&section material = 'rubber' thickness = 0.1 direction = 0.3, 1.0, 0.0 /
&support node_set = 'edge_x0' fixed = 'ux', 'rz' /
&support node_set = 'edge_y0' fixed = 'uy', 'rz' /
&support node_set = 'all' fixed = 'uz', 'rx', 'ry' /
&support node_set = 'edge_x1' fixed = 'rz' ux = {ux!r} /
{across}
&step tolerance = 'tight' maximum_increments = 200 /
&monitor name = 'Fx' quantity = 'reaction' component = 'x' node_set = 'edge_x1' /
&monitor name = 'Fy' quantity = 'reaction' component = 'y' node_set = 'edge_y1' /
&output every = 0 restart = 'none' /
"""


def exact_data(name, kinds=PATHS):
    found = []
    for kind in kinds:
        l1, l2 = PATHS[kind](np.linspace(1.05, 6.0 if kind == "uniaxial" else 4.5, 25))
        stress = LAWS[name].stress(EXACT[name], l1, l2)
        if kind == "uniaxial":
            stress[1] = np.nan
        found.append(tool.Data(kind, l1, l2, stress))
    return found


class Exact(unittest.TestCase):
    def test_parameters_come_back(self):
        for name, values in EXACT.items():
            for kinds in (PATHS, ("uniaxial",)):
                with self.subTest(law=name, kinds=list(kinds)):
                    found = tool.fit(LAWS[name], exact_data(name, kinds))
                    for parameter, value in values.items():
                        self.assertLess(abs(found.values[parameter] / value - 1), 1e-6)
                    self.assertLess(found.error, 1e-9)
                    self.assertEqual(tool.warnings(found), [])

    def test_standard_errors_are_those_of_many_samples(self):
        random = np.random.default_rng(1)
        found = []
        for _ in range(200):
            data = exact_data("mooney_rivlin", ("uniaxial", "pure shear"))
            for some in data:
                some.stress += random.normal(0, 0.01, some.stress.shape)
            found.append(tool.fit(LAWS["mooney_rivlin"], data))
        sample = np.array([[f.values["c10"], f.values["c01"]] for f in found])
        for i, name in enumerate(("c10", "c01")):
            self.assertAlmostEqual(np.mean([f.deviation[name] for f in found]) / sample[:, i].std(), 1, delta=0.2)
        self.assertAlmostEqual(found[0].correlation[0, 1], np.corrcoef(sample.T)[0, 1], delta=0.1)

    def test_stress_is_the_derivative_of_the_energy(self):
        def energy(name, v, l1, l2):
            l3 = 1 / (l1 * l2)
            i1, i2 = l1**2 + l2**2 + l3**2 - 3, l1**-2 + l2**-2 + l3**-2 - 3
            return {"neo_hookean": lambda: v["mu"] / 2 * i1, "mooney_rivlin": lambda: v["c10"] * i1 + v["c01"] * i2,
                    "yeoh": lambda: v["c1"] * i1 + v["c2"] * i1**2 + v["c3"] * i1**3,
                    "gent": lambda: -v["mu"] * v["jm"] / 2 * np.log(1 - i1 / v["jm"])}.get(
                        name, lambda: sum(v[f"mu{p}"] / v[f"alpha{p}"] * (l1**v[f"alpha{p}"] + l2**v[f"alpha{p}"] + l3**v[f"alpha{p}"] - 3)
                                          for p in range(1, int(name[-1]) + 1)))()

        l1, l2, h = np.array([1.3, 0.7, 2.0]), np.array([1.1, 1.9, 1.0]), 1e-30
        for name, values in EXACT.items():
            stress = LAWS[name].stress(values, l1, l2)
            np.testing.assert_allclose(stress[0], energy(name, values, l1 + h * 1j, l2).imag / h, rtol=1e-12)
            np.testing.assert_allclose(stress[1], energy(name, values, l1, l2 + h * 1j).imag / h, rtol=1e-12)


class Stability(unittest.TestCase):
    def test_neo_hookean_is_stable_as_a_material(self):
        for path in PATHS:
            self.assertEqual(stable_range(LAWS["neo_hookean"], {"mu": 1.0}, path, "drucker"), (0.1, 10.0))

    def test_dead_loads_on_a_mooney_rivlin_square(self):
        # Equibiaxial dead loads, c01 = k c10: P1 = P2 = 2 (l - l**-5) (1 + k l**2) has branches with l1 /= l2 (Kearsley 1986), where the
        # difference of dP1 - dP2 in l1 - l2 vanishes: 1 + 5 l**-6... is found here by finite differences of the stress itself
        law, values = LAWS["mooney_rivlin"], {"c10": 1.0, "c01": 0.1}
        low, high = stable_range(law, values, "equibiaxial", "hill")
        self.assertEqual(low < 0.99, True)

        def slope(s):
            d = 1e-6
            p = law.stress(values, np.array([s + d]), np.array([s - d]))
            return float(p[0, 0] - p[1, 0]) / (2 * d)

        self.assertGreater(slope(0.99 * high), 0)
        self.assertLess(slope(1.01 * high), 0)

    def test_gent_ends_where_it_locks(self):
        # uniaxial: l**2 + 2/l - 3 = jm
        values = {"mu": 1.0, "jm": 20.0}
        high = stable_range(LAWS["gent"], values, "uniaxial", "drucker")[1]
        lock = max(np.roots([1.0, 0.0, -23.0, 2.0]).real)
        self.assertAlmostEqual(high / lock, 1, delta=1e-3)

    def test_what_is_unstable_is_said(self):
        values = {"c1": 0.1, "c2": -0.02, "c3": 0.0}
        data = tool.Data("uniaxial (x.csv)", *PATHS["uniaxial"](np.linspace(1.1, 4, 20)), np.ones((2, 20)))
        found = tool.warnings(tool.Fit(LAWS["yeoh"], values, [data], {}, np.zeros((0, 0))))
        self.assertIn("unstable (Drucker) within the data", found[0])


class Measured(unittest.TestCase):
    def test_treloar_by_ogden(self):
        data = [tool.read(TRELOAR, "uniaxial")]
        published = tool.Fit(LAWS["ogden3"], OGDEN_1972, data, {}, np.zeros((0, 0)))
        stress = LAWS["ogden3"].stress(OGDEN_1972, data[0].l1, data[0].l2)[0]
        far = (data[0].l1 > 2.9) & (data[0].l1 < 7.1)  # below, another scale of the figure; above, the fit of Ogden ends
        self.assertLess(np.abs(stress / data[0].stress[0] - 1)[far].max(), 0.03)
        self.assertAlmostEqual(published.shear_modulus(), 0.4143, delta=1e-4)  # 4.225 kgf/cm2
        ours = tool.fit(LAWS["ogden3"], data)
        self.assertLess(ours.error, 0.016)
        self.assertLess(ours.error, published.error)
        self.assertLess(tool.fit(LAWS["gent"], data).error, 0.03)
        # least squares of others for the same test: mu = 0.5673 MPa, and c10 = 0.2837 where the second term is left at 0 (simcoon, its
        # example on hyperelastic models)
        self.assertAlmostEqual(tool.fit(LAWS["neo_hookean"], data).values["mu"] / 0.5673, 1, delta=0.003)
        self.assertAlmostEqual(tool.fit(LAWS["mooney_rivlin"], data).values["c10"] / 0.2837, 1, delta=0.003)
        self.assertLess(tool.fit(LAWS["yeoh"], data).error, 0.04)

    def test_kawabata_by_ogden(self):
        # another rubber and other tests: the set of 1972 is off by 3.4 %, and the best of its form must be better
        data = [tool.read(KAWABATA, "biaxial")]
        published = tool.Fit(LAWS["ogden3"], OGDEN_1972, data, {}, np.zeros((0, 0)))
        self.assertLess(published.error, 0.04)
        fits = {name: tool.fit(LAWS[name], data) for name in LAWS}
        self.assertLess(fits["ogden3"].error, 0.017)
        for better, worse in (("ogden3", "ogden2"), ("ogden2", "ogden1"), ("ogden1", "mooney_rivlin"), ("mooney_rivlin", "neo_hookean")):
            self.assertLess(fits[better].error, fits[worse].error)

    def test_bounds_keep_it_stable(self):
        data = [tool.read(TRELOAR, "uniaxial")]
        free, bound = tool.fit(LAWS["mooney_rivlin"], data, free=True), tool.fit(LAWS["mooney_rivlin"], data)
        self.assertLess(free.values["c01"], 0)
        self.assertIn("not usable", tool.warnings(free)[0])
        self.assertEqual(bound.values["c01"], 0)
        self.assertAlmostEqual(2 * bound.values["c10"], tool.fit(LAWS["neo_hookean"], data).values["mu"], delta=1e-12)
        self.assertIn("c01 at the bound 0", tool.warnings(bound)[0])


class Page(unittest.TestCase):
    """The numbers of doc/materials.md."""

    PAGE = (SOURCE / "doc" / "materials.md").read_text(encoding="utf-8")

    def rows(self, heading):
        table = self.PAGE.split(heading, 1)[1].split("\n\n", 1)[0]
        return [[cell.strip() for cell in line.strip(" |").split("|")] for line in table.splitlines() if line.startswith("| `")]

    def test_errors_of_fits(self):
        rows = self.rows("| law | Treloar 1944")
        self.assertEqual(len(rows), len(LAWS))
        data = [tool.read(TRELOAR, "uniaxial")], [tool.read(KAWABATA, "biaxial")]
        for (words, *errors), name in zip(rows, LAWS):
            for error, some in zip(errors, data):
                self.assertAlmostEqual(100 * tool.fit(LAWS[name], some).error / float(error.split()[0]), 1, delta=0.01, msg=words)

    def test_balloons(self):
        laws = [("neo_hookean", {"mu": 1.0}), ("mooney_rivlin", {"c10": 0.9, "c01": 0.1}), ("mooney_rivlin", {"c10": 0.8, "c01": 0.2}),
                ("gent", {"mu": 1.0, "jm": 80.0}), ("ogden3", OGDEN_1972)]
        rows = self.rows("| law | pressure of a sphere")
        self.assertEqual(len(rows), len(laws))
        s = np.exp(np.linspace(0, 2.2, 40001))
        for (words, *numbers), (name, values) in zip(rows, laws):
            with np.errstate(all="ignore"):
                rise = np.diff(LAWS[name].stress(values, s, s)[0] / s**2)  # p R/(2 h) = P/stretch**2
            turns = [float(s[i + 1]) for i in np.flatnonzero(np.sign(rise[1:]) * np.sign(rise[:-1]) < 0)]
            self.assertEqual(len(turns), sum(number != "–" for number in numbers[:2]), words)
            for turn, number in zip(turns, numbers):
                self.assertAlmostEqual(turn, float(number), delta=6e-4, msg=words)
            limit = stable_range(LAWS[name], values, "equibiaxial", "hill")[1]
            self.assertAlmostEqual(limit / float(numbers[2]), 1, delta=3e-3, msg=words)

    def test_published_set(self):
        line = re.search(r"&material name = 'rubber' law = 'ogden' (.*) /", self.PAGE).group(1)
        for name, value in re.findall(r"(\w+) = (\S+)", line):
            self.assertAlmostEqual(float(value) / OGDEN_1972[name], 1, delta=1e-4)


class Program(unittest.TestCase):
    """The driver gives the stresses of the law that was fitted, from the group that the tool prints."""

    def call(self, *words):
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = tool.main([str(word) for word in words])
        return code, out.getvalue() + err.getvalue()

    def patch(self, material, l1, l2):
        """Nominal stresses of a patch of elements that is stretched so."""
        across = f"&support node_set = 'edge_y1' fixed = 'rz' uy = {l2 - 1!r} /" if l2 else ""
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "patch.nml").write_text(PATCH.format(material=material, ux=2 * l1 - 2, across=across))
            run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "patch.nml"], cwd=folder, capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            with open(Path(folder) / "patch.history.csv", encoding="utf-8") as file:
                row = list(csv.DictReader(file))[-1]
        return float(row["Fx"]) / 0.1, float(row["Fy"]) / 0.2

    def test_patch(self):
        code, text = self.call("--biaxial", KAWABATA)
        self.assertEqual(code, 0, text)
        groups = re.findall(r"^ +(&material .*/)$", text, re.M)
        self.assertEqual(len(groups), len(LAWS))
        data = [tool.read(KAWABATA, "biaxial")]
        for name in LAWS:
            found = tool.fit(LAWS[name], data)
            self.assertIn(found.material(), groups)
            for l1, l2 in ((2.5, None), (2.2, 1.18), (1.9, 1.9)):
                with self.subTest(law=name, stretches=(l1, l2)):
                    stress = self.patch(found.material(), l1, l2)
                    wanted = LAWS[name].stress(found.values, np.array([l1]), np.array([l2 or l1**-0.5]))[:, 0]
                    self.assertAlmostEqual(stress[0] / wanted[0], 1, delta=2e-8)
                    if l2:
                        self.assertAlmostEqual(stress[1] / wanted[1], 1, delta=2e-8)

    def test_picture(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "fit.png"
            code, text = self.call("--biaxial", KAWABATA, "--uniaxial", TRELOAR, "--law", "ogden2", "--plot", path)
            self.assertEqual((code, text.splitlines()[-1]), (0, str(path)))
            self.assertGreater(path.stat().st_size, 10000)

    def refused(self, sentence, *words):
        code, text = self.call(*words)
        self.assertEqual(code, 2, text)
        self.assertTrue(text.startswith("finshell-fit: "), text)
        self.assertIn(sentence, text)
        self.assertEqual(text.count("\n"), 1, text)

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "data.csv"

            def write(text):
                path.write_text(text)
                return path

            law = ("--law", "neo_hookean")
            values = EXACT["neo_hookean"]
            for words, convert in (((), lambda s, p: (s, p)), (("--strain",), lambda s, p: (s - 1, p)), (("--cauchy",), lambda s, p: (s, s * p))):
                rows = [(s, float(LAWS["neo_hookean"].stress(values, np.array([s]), np.array([s]))[0, 0])) for s in (1.2, 1.5, 2.0)]
                for between in (", ", " ", ";"):
                    body = "\n".join(between.join(f"{x:.15g}" for x in convert(*row)) for row in rows)
                    code, text = self.call("--equibiaxial", write(f"# a comment\nstretch{between}stress\n{body}\n"), *law, *words)
                    self.assertEqual(code, 0, text)
                    self.assertIn("mu = 0.4 ", text)
            self.assertIn("error", self.call("--uniaxial", TRELOAR, "--most", "3", "--relative", *law)[1])
            self.refused("no data: name a file")
            self.refused("cannot be read (No such file", "--uniaxial", folder + "/none.csv")
            self.refused("data.csv: no row of numbers", "--uniaxial", write("# nothing\n"))
            self.refused("data.csv, line 2: found 'a, b', expected 2 numbers", "--uniaxial", write("1.1, 2\na, b\n"))
            self.refused("data.csv, line 1: found 3 columns, expected 2", "--uniaxial", write("1.1, 2, 3\n"))
            self.refused("data.csv, line 1: found 2 columns, expected 4", "--biaxial", write("1.1, 2\n"))
            self.refused("line 1: found ', 2', expected numbers", "--uniaxial", write(", 2\n"))
            self.refused("found the stretch 0, expected numbers above 0 (strains need --strain)", "--uniaxial", write("0, 0\n1, 3\n"))
            self.refused("no stress other than 0", "--uniaxial", write("1.1, 0\n"))
            self.refused("ogden3 has 6 parameters, and there are 1 stresses only", "--uniaxial", write("1.1, 1\n"), "--law", "ogden3")
            self.refused("nothing is stretched less than --most 1", "--uniaxial", write("1.1, 1\n"), "--most", "1")


if __name__ == "__main__":
    unittest.main()
