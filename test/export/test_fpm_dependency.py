#!/usr/bin/env python3
"""A project of fpm that depends on api/ builds and runs the programs of the guide in Fortran and C, without HDF5 or SuiteSparse."""
import os
import shutil
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "api"))
import installed  # noqa: E402

MANIFEST = """name = "user"
[build]
auto-executables = false
[dependencies]
finshell-api = {{ path = "{path}" }}
[[executable]]
name = "in_fortran"
source-dir = "fortran"
main = "square.f90"
[[executable]]
name = "in_c"
source-dir = "c"
main = "square.c"
"""


def find_fpm():
    """fpm on the path, or beside the Python that runs this."""
    return shutil.which("fpm") or shutil.which("fpm", path=os.path.dirname(sys.executable))


class Dependency(unittest.TestCase):
    def test_programs(self):
        fpm = find_fpm()
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.relpath(os.path.join(installed.SOURCE, "api"), os.path.realpath(folder))
            with open(os.path.join(folder, "fpm.toml"), "w", encoding="utf-8") as f:
                f.write(MANIFEST.format(path=path))
            for language, name in (("fortran", "square.f90"), ("c", "square.c")):
                os.mkdir(os.path.join(folder, language))
                with open(os.path.join(folder, language, name), "w", encoding="utf-8") as f:
                    f.write(installed.programs()[language])
            environment = dict(os.environ, FPM_FC=installed.FC, FPM_CC=installed.CC, OMP_NUM_THREADS="1")
            for variable in ("FPM_FFLAGS", "FPM_CFLAGS", "FPM_LDFLAGS"):
                environment.pop(variable, None)
            options = ("--flag", "-O0")  # the numbers are those of any other flags, up to rounding
            installed.run(fpm, "build", *options, cwd=folder, env=environment)
            found = []
            for name in ("in_fortran", "in_c"):
                lines = installed.run(fpm, "run", *options, name, cwd=folder, env=environment).splitlines()
                found.append({line.split()[0]: float(line.split()[1]) for line in lines
                              if line.split() and line.split()[0] in ("energy", "force", "moment", "stiffness")})
                program = shutil.which(name, path=":".join(here for here, _, names in os.walk(folder) if name in names))
                self.assertNotRegex(installed.run("ldd", program), "hdf5|cholmod|umfpack|blas")
        self.assertEqual(len(found[0]), 4)
        for name, value in found[0].items():
            self.assertAlmostEqual(value, found[1][name], delta=1e-12, msg=name)


if __name__ == "__main__":
    if not find_fpm():
        print("fpm is not installed")
        sys.exit(77)
    unittest.main()
