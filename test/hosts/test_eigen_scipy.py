#!/usr/bin/env python3
"""The hosts of examples/hosts, in C++ with Eigen and in Python with scipy: hemisphere and disk agree with the driver."""
import csv
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
HOSTS = SOURCE / "examples" / "hosts"
LIBRARY = Path(os.environ.get("FINSHELL_LIB", ""))
CXX = shutil.which(os.environ.get("CXX", "g++"))
EIGEN = next((p for p in ("/usr/include/eigen3", "/usr/local/include/eigen3", os.environ.get("EIGEN3_INCLUDE_DIR", "")) if p and Path(p).is_dir()), None)
TOLERANCE = 1e-9
LINES = 80
DECKS = {"hemisphere": """
&mesh generator = 'sphere' radius = 10.0 colatitudes = 18.0, 90.0 azimuths = 0.0, 90.0 divisions = 16, 16 diagonal = 'forward' /
&material name = 'elastic' law = 'linear_elastic' e = 6.825e7 nu = 0.3 /
&section material = 'elastic' thickness = 0.04 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'corner_a0_bottom' fixed = 'uz' /
&load type = 'force' node_set = 'corner_a0_bottom' vector = 200.0, 0.0, 0.0 /
&load type = 'force' node_set = 'corner_a1_bottom' vector = 0.0, -200.0, 0.0 /
&step residual_tolerance = 1e-13 correction_tolerance = 1e-12 /
&monitor name = 'pulled' quantity = 'displacement' component = 'x' node_set = 'corner_a0_bottom' /
&monitor name = 'pushed' quantity = 'displacement' component = 'y' node_set = 'corner_a1_bottom' factor = -1.0 /
""", "disk": """
&mesh generator = 'disk' portion = 'quarter' radius = 7.5 rings = 12 /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0 /
&section material = 'rubber' thickness = 0.5 /
&support node_set = 'rim', type = 'hinged' /
&support node_set = 'edge_x0', type = 'symmetry_x' /
&support node_set = 'edge_y0', type = 'symmetry_y' /
&load type = 'pressure' pressure = 17.0 /
&step residual_tolerance = 1e-13 correction_tolerance = 1e-12 /
&monitor name = 'centre' quantity = 'displacement' component = 'z' node_set = 'centre' /
&monitor name = 'volume' quantity = 'volume' /
"""}


@unittest.skipUnless("FINSHELL_BIN" in os.environ, "the driver was not built")
class Hosts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.keep = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.keep.name)
        cls.expected = {}
        for name, deck in DECKS.items():
            (cls.folder / f"{name}.nml").write_text(deck, encoding="utf-8")
            subprocess.run([os.environ["FINSHELL_BIN"], "run", f"{name}.nml"], cwd=cls.folder, check=True, capture_output=True)
            with open(cls.folder / f"{name}.history.csv", encoding="utf-8") as f:
                cls.expected[name] = {k: v for k, v in list(csv.DictReader(f))[-1].items() if k in ("pulled", "pushed", "centre", "volume")}

    @classmethod
    def tearDownClass(cls):
        cls.keep.cleanup()

    def agree(self, command, volume, **environment):
        for name, expected in self.expected.items():
            with self.subTest(problem=name):
                done = subprocess.run([*command, name], capture_output=True, text=True, env=dict(os.environ, **environment))
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
                found = dict(line.split() for line in done.stdout.splitlines())
                self.assertEqual(set(found), set(expected) - set(() if volume else ("volume",)))
                for key, value in found.items():
                    self.assertLess(abs(float(value) / float(expected[key]) - 1), TOLERANCE, f"{key}: {value}, {expected[key]}")

    def test_they_are_short(self):
        for name in ("host.py", "host.cpp"):
            self.assertLessEqual(len((HOSTS / name).read_text(encoding="utf-8").splitlines()), LINES, name)

    def test_python(self):
        try:
            import numpy, scipy  # noqa: E401,F401
        except ImportError as missing:
            self.skipTest(str(missing))
        self.agree([sys.executable, HOSTS / "host.py"], True, PYTHONPATH=str(SOURCE / "api" / "python"))

    @unittest.skipUnless(CXX and EIGEN, "there is no C++ compiler or no Eigen (Debian: libeigen3-dev)")
    def test_cpp(self):
        program = self.folder / "host"
        done = subprocess.run([CXX, "-std=c++17", "-O1", "-Wall", "-Wextra", f"-I{SOURCE / 'api'}", f"-I{EIGEN}", HOSTS / "host.cpp", "-o", program,
                               LIBRARY, f"-Wl,-rpath,{LIBRARY.parent}"], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.agree([program], False)


if __name__ == "__main__":
    unittest.main()
