#!/usr/bin/env python3
"""The adapters of api/hosts: hemisphere and rubber disk in NGSolve and DOLFINx, whichever is installed, are the driver's to 1e-9.

With FINSHELL_HOSTS=required (`make test-hosts`) one that is not installed is an error. FINSHELL_DOLFINX_PYTHON: a Python that has
dolfinx, otherwise that of the system."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

HOSTS = Path(os.environ["FINSHELL_SOURCE_DIR"]) / "api" / "hosts"
REQUIRED = os.environ.get("FINSHELL_HOSTS") == "required"
DOLFINX = os.environ.get("FINSHELL_DOLFINX_PYTHON", "/usr/bin/python3")
RANKS = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1"}
sys.path.insert(0, str(HOSTS))


def missing(reason):
    """End: with an error where the hosts must be there."""
    print(reason)
    sys.exit(1 if REQUIRED else 77)


def has(python, module):
    """Whether a Python has a module."""
    try:
        return subprocess.run([python, "-c", f"import {module}"], capture_output=True, check=False).returncode == 0
    except OSError:
        return False


class Hosts(unittest.TestCase):
    """Every host solves every case."""

    @classmethod
    def setUpClass(cls):
        cls.keep = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.keep.name)
        subprocess.run([sys.executable, HOSTS / "cases.py", cls.folder], check=True)

    @classmethod
    def tearDownClass(cls):
        cls.keep.cleanup()

    def run_host(self, program, case):
        """Its status, output and errors."""
        done = subprocess.run([*program, self.folder / f"{case}.npz"], env={**os.environ, **RANKS}, capture_output=True, text=True,
                              check=False, timeout=600)
        return done.returncode, done.stdout, done.stderr

    def check(self, module, python, *words):
        if not has(python, module):
            (self.fail if REQUIRED else self.skipTest)(f"{python} has no {module}")
        program = [*words, python, HOSTS / module / f"{module}_shell.py"]
        for case, compared in (("hemisphere", 1), ("disk", 2)):
            with self.subTest(case=case):
                status, output, errors = self.run_host(program, case)
                print(f"{case}: {' '.join(map(str, words))}\n{output}")
                self.assertEqual(status, 0, output + errors)
                self.assertEqual(output.count("difference from the driver"), compared)

    def test_ngsolve(self):
        self.check("ngsolve", sys.executable)

    def test_dolfinx(self):
        self.check("dolfinx", DOLFINX)

    def test_dolfinx_on_two_ranks(self):
        self.check("dolfinx", DOLFINX, "mpiexec", "-n", "2")


class Report(unittest.TestCase):
    """What the programs end with is an error when it is wrong."""

    def test_a_difference_is_an_error(self):
        case = cases.SimpleNamespace(compared=[1.0], displacement=[np.array([[0.0, 2.0, 0.0]])])
        cases.report(case, 1.0, np.array([[1e-10, 2.0, 0.0]]))
        cases.report(case, 0.5, np.array([[1.0, 2.0, 0.0]]))  # nothing to compare with
        for wrong in (np.array([[1e-8, 2.0, 0.0]]), np.full((1, 3), np.nan)):
            with self.assertRaisesRegex(SystemExit, "largest difference from the driver"):
                cases.report(case, 1.0, wrong)


if "FINSHELL_BIN" not in os.environ:
    missing("the driver was not built")
try:
    import cases
    import h5py  # noqa: F401
    import numpy as np
except ImportError as reason:
    missing(reason)
if not (REQUIRED or has(sys.executable, "ngsolve") or has(DOLFINX, "dolfinx")):
    missing("neither NGSolve nor DOLFINx is installed")

if __name__ == "__main__":
    unittest.main()
