#!/usr/bin/env python3
"""The C tests under valgrind's memcheck and with the address and undefined-behaviour sanitizers: no error, no leak.

The library is built anew for each (kept in the build folder, so the second run is quick): valgrind knows no 512-bit instructions.
"""
import glob
import os
import shutil
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import installed  # noqa: E402

PROGRAMS = (("test_capi_errors", ()), ("test_capi_physics", ()), ("test_capi_batch", ("19",)))  # a few elements are enough


def build(name, flags):
    """Library and test programs compiled with some flags; the folder they are in."""
    folder = os.path.join(installed.BINARY, "test", name)
    installed.run("cmake", "-G", "Ninja", "-S", installed.SOURCE, "-B", folder, "-DFINSHELL_DRIVER=OFF", "-DFINSHELL_TESTS=OFF",
                  "-DCMAKE_BUILD_TYPE=None", f"-DCMAKE_Fortran_COMPILER={installed.FC}", f"-DCMAKE_C_COMPILER={installed.CC}",
                  f"-DCMAKE_Fortran_FLAGS=-std=f2018 -fimplicit-none -ffree-line-length-none {flags}")
    installed.run("cmake", "--build", folder, "--target", "finshell_static")
    library = glob.glob(os.path.join(folder, "**", "libfinshell.a"), recursive=True)[0]
    for program, _ in PROGRAMS:
        installed.run(installed.CC, "-std=c99", "-Wall", "-Wextra", *flags.split(), f"-I{installed.SOURCE}/api",
                      os.path.join(installed.SOURCE, "test", "api", program + ".c"), library, "-o", os.path.join(folder, program),
                      "-lgfortran", "-lgomp", "-lpthread", "-lm")
    return folder


class Clean(unittest.TestCase):
    def run_all(self, folder, *before, **environment):
        for program, arguments in PROGRAMS:
            with self.subTest(program=program):
                output = installed.run(*before, os.path.join(folder, program), *arguments, env=dict(os.environ, **environment))
                self.assertIn(" 0 failures", output)

    def test_sanitizers(self):
        folder = build("sanitizers", "-g -O1 -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all")
        self.run_all(folder, UBSAN_OPTIONS="print_stacktrace=1", ASAN_OPTIONS="detect_leaks=1:detect_stack_use_after_return=1")

    @unittest.skipUnless(shutil.which("valgrind"), "valgrind is not installed")
    def test_memcheck(self):
        folder = build("memcheck", "-g -O1")
        self.run_all(folder, "valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full",
                     "--errors-for-leak-kinds=definite,indirect", "--fair-sched=yes")


if __name__ == "__main__":
    unittest.main()
