#!/usr/bin/env python3
"""A few problems of examples/ on coarse meshes: errors, increments, iterations, limit points stay what doc/benchmarks.md says."""
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.environ["FINSHELL_SOURCE_DIR"], "bench"))
sys.dont_write_bytecode = True
import benchmark_measure as measured  # noqa: E402
import benchmark_meshes as meshes  # noqa: E402
import benchmark_run as run  # noqa: E402
from benchmark_cases import CASES  # noqa: E402


class Benchmarks(unittest.TestCase):
    def solve(self, name, **mesh):
        text = run.example(name)
        solution = run.solve(run.with_keys(text, "mesh", **mesh) if mesh else text, files=run.beside(run.EXAMPLES / name / "input.nml"))
        self.assertTrue(solution.done, solution.message)
        return solution

    def check(self, solution, reference, percent, **value):
        for name, exact in value.items():
            self.assertLess(abs(solution.last[name] / exact - 1), percent / 100, f"{name} = {solution.last[name]}, {reference}: {exact}")

    def test_cantilever_in_one_increment(self):
        solution = self.solve("sze31")
        self.check(solution, "elastica", 0.25, U=3.289343183651, W=6.699862719241)
        self.assertEqual(solution.increments, 1)
        self.assertLessEqual(solution.iterations, 12)

    def test_end_moment_full_circle(self):
        solution = self.solve("sze32", divisions="32, 1")
        self.check(solution, "circle", 1.0, U=12.0)
        self.assertLess(abs(solution.last["W"]), 0.05)

    def test_hemisphere(self):
        solution = self.solve("sze34", divisions="8, 8")
        self.check(solution, "Sze", 5.0, V_A=4.067, U_B=8.178)
        self.assertLessEqual(solution.increments, 2)
        self.assertLessEqual(solution.iterations, 20)

    def test_pull_out(self):
        solution = self.solve("sze35")
        self.check(solution, "Sze", 1.0, U_B=4.551, U_C=3.269)
        # fine meshes of any kind end 1.1 % below the table
        self.check(solution, "Sze", 1.7, W_A=2.768)
        self.assertLessEqual(solution.increments, 2)
        self.assertLessEqual(solution.iterations, 20)

    def test_roof_through_its_limit_points(self):
        text = run.with_keys(run.example("sze38a"), "mesh", divisions="8, 8")
        solution = run.solve(run.with_keys(text, "step", largest_increment="0.2"))
        self.assertTrue(solution.done, solution.message)
        upper, lower = run.extremes(solution.rows, "W_C", "load_factor")
        self.assertLess(abs(upper[1] - 0.744), 0.012)
        self.assertLess(abs(lower[1] - 0.172), 0.008)
        self.assertTrue(any(row["negative_pivots"] == 1 for row in solution.rows))

    def test_roof_with_snap_back(self):
        text = run.with_keys(run.example("sze38d"), "mesh", divisions="8, 8")
        solution = run.solve(run.with_keys(text, "step", largest_increment="0.1"))
        self.assertTrue(solution.done, solution.message)
        self.check(solution, "Sze", 5.0, load_factor=1.0313)
        self.assertLess(min(row["load_factor"] for row in solution.rows), -0.06)
        self.assertTrue(any(b["W_C"] < a["W_C"] for a, b in zip(solution.rows, solution.rows[1:])), "the displacement turns back")

    def test_laminates_differ_as_their_stiffness(self):
        along, across = (self.solve(name, divisions="8, 8").last["load_factor"] for name in ("sze38b", "sze38c"))
        self.assertLess(along, 0.7 * across)

    def test_patches(self):
        self.check(self.solve("patch_membrane"), "exact", 1e-8, N_11=10.0, u_y=2.5e-4)
        self.check(self.solve("patch_bending"), "exact", 1e-8, M_11=-1 / 1200, w=0.01875)

    def test_linear_problems(self):
        self.check(self.solve("cook"), "reference", 2.0, v=23.96)
        self.check(self.solve("scordelis_lo"), "reference", 0.5, w=-0.302)
        self.check(self.solve("pinched_cylinder"), "series", 0.5, w=-1.82488e-5)
        self.check(self.solve("pinched_hemisphere"), "reference", 0.5, u=0.0924)
        self.check(self.solve("twisted_beam_thin_y"), "reference", 4.5, u=0.001294)

    def errors(self, name, mesh, way, normals):
        """Errors in per cent."""
        case = next(c for c in CASES if c.name == name)
        found = measured.measure(case, mesh, way, normals)
        self.assertFalse(found[0].stopped, f"{name}, {mesh}, {way}, {normals}: stopped at {found[0].stopped}")
        self.assertEqual(found[0].negative, 0)
        return [m.error for m in found]

    def test_curved_references_do_not_lock_on_any_mesh(self):
        # aims: 1 % (thin twisted beam), 3 % (hemispheres), 3 and 10 % (hyperbolic paraboloids 1e-3, 1e-4): met with diagonals one way, as generators have
        # them by default; the last two are missed by up to 0.4 and 1.9 on alternating and irregular ones, so the limits there are what is measured
        for name, mesh, one_way, structured, irregular in (
                ("twisted_beam_thin_y", "12x2", 1.0, 1.0, 1.0), ("twisted_beam_thin_z", "12x2", 1.0, 1.0, 1.0), ("pinched_hemisphere", "8x8", 3.0, 3.0, 3.0),
                ("pinched_hemisphere_hole", "8x8", 3.0, 3.0, 3.0), ("le3", "8x8", 3.0, 3.0, 3.0), ("hypar_1e-2", "16x16", 3.0, 3.0, 3.0),
                ("hypar_1e-3", "16x16", 3.0, 3.2, 3.4), ("hypar_1e-4", "16x16", 10.0, 10.0, 12.0)):
            for way, (_, distortion) in measured.WAYS.items():
                limit = irregular if distortion else one_way if way in ("one way", "other way") else structured
                for normals in ("exact", "auto"):
                    for error in self.errors(name, mesh, way, normals):
                        self.assertLess(abs(error), limit, f"{name}, {way}, {normals}")

    def test_thin_hemispheres(self):
        for name, aim in (("hemisphere_1e3", 3.0), ("hemisphere_1e4", 4.0)):
            for way in ("one way", "irregular, one way"):
                self.assertLess(max(map(abs, self.errors(name, "16x16", way, "exact"))), aim + 1.5 * way.startswith("irr"), f"{name}, {way}")

    def test_elastica_under_its_own_weight(self):
        self.check(self.solve("heavy_elastica"), "exact", 0.1, x_tip=-8.92579564, drop=9.56769196, slope=1.57034729)

    def test_loads_that_follow(self):
        self.check(self.solve("water_tank"), "membrane theory", 0.4, bottom=1.635e-4, middle=8.175e-5, hoop=392400)
        self.check(self.solve("beam_on_foundation"), "Hetenyi", 0.4, w=1e-3, moment=2, energy=2e-3)
        ring = self.solve("spinning_ring")
        self.check(ring, "closed form", 0.02, u=0.2)
        for row in ring.rows:
            self.assertLess(abs(row["u"] / ((1 + 0.44 * row["load_factor"]) ** 0.5 - 1) - 1), 5e-4)

    def test_roll_up_with_16_elements_a_turn(self):
        self.check(self.solve("sze32_three_turns", divisions="48, 1"), "three circles", 0.5, U=12.0)

    def test_cylinder_under_a_line_load(self):
        for normals in ("'facet'", "'exact'"):
            self.check(self.solve("cylinder_line_load", normals=normals), "solid", 1.0, u_end=15.5404, u_mid=15.46483)

    def test_cone_through_all_its_turns(self):
        solution = self.solve("rubber_cone")
        reference = run.reference("rubber_cone")
        self.assertLess(run.distance_to_table(solution.rows, reference, "F", "load_factor"), 0.7)
        turns = [u for _, u in run.extremes(solution.rows, "F", "load_factor")]
        self.assertEqual(len(turns), 6)
        for u, exact in zip(turns, (1.8488, 0.1838, 1.8648, 0.1583, 1.8539, 0.1848)):
            self.assertLess(abs(u - exact), 0.004)

    def test_stresses_of_nafems(self):
        self.check(self.solve("le1"), "NAFEMS", 6.5, sigma_yy=92.7)
        stress = {}
        for n in ((20, 8), (40, 16), (80, 32)):
            text, files = meshes.le5(n)
            stress[n[0]] = run.solve(text, files=files).last["sigma_xx"]
        self.assertLess(abs(stress[80] / -108 - 1), 0.08)
        text, files = meshes.le5((40, 16), "forward", 0.24)
        facets, curved = (run.solve(run.with_keys(text, "mesh", normals=normals), files=files).last["sigma_xx"] for normals in ("'facet'", "'auto'"))
        self.assertEqual(facets, curved, "flat parts stay flat")

    def test_examples_are_what_the_builders_write(self):
        for name, n in meshes.FILES.items():
            text, files = meshes.BUILDERS[name](n)
            for file, content in {"input.nml": text, **files}.items():
                self.assertEqual((run.EXAMPLES / name / file).read_text(), content, f"examples/{name}/{file}: python3 bench/benchmark_meshes.py")


if __name__ == "__main__":
    unittest.main()
