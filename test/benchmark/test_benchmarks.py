#!/usr/bin/env python3
"""A few problems of examples/ on coarse meshes: errors, increments, iterations, limit points stay what doc/benchmarks.md says."""
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.environ["FINSHELL_SOURCE_DIR"], "bench"))
sys.dont_write_bytecode = True
import benchmark_run as run  # noqa: E402


class Benchmarks(unittest.TestCase):
    def solve(self, name, **mesh):
        text = run.example(name)
        solution = run.solve(run.with_keys(text, "mesh", **mesh) if mesh else text)
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


if __name__ == "__main__":
    unittest.main()
