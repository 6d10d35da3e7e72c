#!/usr/bin/env python3
"""The example of the README as a user runs it: increments, accuracy, files."""
import csv
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
INPUT = SOURCE / "examples" / "rubber_disk" / "rubber_disk.nml"


def reference():
    lines = [line for line in (SOURCE / "test" / "data" / "rubber_disk_at_w.csv").read_text().splitlines() if not line.startswith("#")]
    return {float(r["w"]): float(r["p_shell"]) for r in csv.DictReader(lines)}


class RubberDisk(unittest.TestCase):
    def solve(self, text):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "rubber_disk.nml").write_text(text)
            before = os.times()
            subprocess.run([os.environ["FINSHELL_BIN"], "run", "rubber_disk.nml"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
            after = os.times()
            self.cpu = after.children_user + after.children_system - before.children_user - before.children_system
            self.files = {f.name: f.stat().st_size for f in Path(folder).iterdir()}
            return [{k: float(v) for k, v in r.items()} for r in csv.DictReader((Path(folder) / "rubber_disk.history.csv").read_text().splitlines())]

    def test_to_70_psi_in_fewer_increments_than_the_paper(self):
        rows = self.solve(INPUT.read_text())
        self.assertLessEqual(len(rows), 7)
        self.assertLessEqual(sum(r["iterations"] for r in rows), 25)
        self.assertEqual(max(r["negative_pivots"] for r in rows), 0)
        self.assertEqual(rows[-1]["load_factor"], 1.0)
        for level in (17 / 70, 50 / 70):
            self.assertTrue(any(abs(r["load_factor"] - level) < 1e-12 for r in rows))
        self.assertLess(abs(rows[-1]["w"] / 34.71407743 - 1), 0.016)
        self.assertLess(abs(rows[-1]["lambda_z"] / 0.0313110 - 1), 0.025)
        self.assertGreater(self.files["rubber_disk.vtkhdf"], 10000)
        self.assertGreater(self.files["rubber_disk.xdmf"], 1000)

    def test_pressure_within_one_per_cent(self):
        head, rest = INPUT.read_text().split("&step", 1)
        step = ("&step control = 'displacement' node_set = 'centre' component = 'z' tolerance = 'tight' "
                "displacements = 2.0, 6.0, 10.0, 15.0, 20.0, 25.0, 30.0 /")
        rows = self.solve(head + step + rest.split("/", 1)[1])
        for w in (2.0, 6.0, 15.0, 30.0):
            row = next(r for r in rows if abs(r["w"] - w) < 1e-9 * w)
            self.assertLess(abs(70 * row["load_factor"] / reference()[w] - 1), 0.01, f"w = {w}")
        self.assertEqual(max(r["negative_pivots"] for r in rows), 0)


if __name__ == "__main__":
    unittest.main()
