#!/usr/bin/env python3
"""bench/scale.py measures all parts on small meshes."""
import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

SCRIPT = Path(os.environ["FINSHELL_SOURCE_DIR"], "bench", "scale.py")
if not Path(os.environ["FINSHELL_BIN"]).with_name("bench_scale").exists():
    sys.exit(77)


def run(*options):
    return subprocess.run([sys.executable, str(SCRIPT), *options], capture_output=True, text=True, check=False, timeout=100)


class Scale(unittest.TestCase):
    def test_tables(self):
        result = run("--triangles", "200,800", "--nonlinear", "200")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        rows = [[word.strip() for word in line.strip("|").split("|")] for line in result.stdout.splitlines() if re.match(r"\| \d", line)]
        self.assertEqual([row[0] for row in rows], ["200", "800"] * 3 + ["200"])
        for row in rows[:-1]:
            self.assertEqual(len(row), 13)
            self.assertTrue(all(float(word.rstrip(" %")) >= 0 for word in row), row)
            self.assertGreater(float(row[11]), float(row[10]), "the whole process has more than the factors")
        self.assertEqual(rows[-1][2], "2", "increments")


if __name__ == "__main__":
    unittest.main()
