#!/usr/bin/env python3
"""Uniaxial tension of a distorted mesh against the closed form, for Ogden's law with exponents up to those of skin, and beyond."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

CASE = (Path(os.environ["FINSHELL_SOURCE_DIR"]) / "test" / "cases" / "ogden26_uniaxial.nml").read_text(encoding="utf-8")


class Uniaxial(unittest.TestCase):
    def stretched(self, mu, alpha, stretch):
        """Last row of the history."""
        text = CASE.replace("mu1=0.076923076923076927 alpha1=26.0", f"mu1={mu!r} alpha1={alpha!r}").replace("ux=2.0", f"ux={2 * stretch - 2!r}")
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "case.nml").write_text(text)
            run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "case.nml"], cwd=folder, capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
            with open(Path(folder) / "case.history.csv", encoding="utf-8") as file:
                row = list(csv.DictReader(file))[-1]
        return {key: float(value) for key, value in row.items() if value}

    def test_force_and_contraction(self):
        for alpha, stretch in ((1.3, 3.0), (26.0, 1.5), (26.0, 2.0), (-26.0, 1.5), (60.0, 1.2), (26.0, 0.8), (100.0, 1.1)):
            with self.subTest(alpha=alpha, stretch=stretch):
                mu = 2.0 / alpha
                row = self.stretched(mu, alpha, stretch)
                force = 0.1 * mu * (stretch**(alpha - 1) - stretch**(-alpha / 2 - 1))
                self.assertEqual(row["load_factor"], 1.0)
                self.assertLess(abs(row["F"] / force - 1), 1e-9)
                self.assertLess(abs(row["v"] - (stretch**-0.5 - 1)), 1e-6)


if __name__ == "__main__":
    unittest.main()
