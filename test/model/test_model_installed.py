#!/usr/bin/env python3
"""The shared library of the driver as it is installed, by pkg-config and CMake; and the calls of test_model_calls and
test_model_guards under valgrind. (The thread sanitizer would see nothing: one call of a process works at a time.)"""
import os
import re
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "api"))
import installed  # noqa: E402

if not os.environ.get("FINSHELL_DRIVER_LIB"):
    print("there is no driver")
    sys.exit(77)

CMAKE = """cmake_minimum_required(VERSION 3.25)
project(user LANGUAGES C)
find_package(finshell REQUIRED)
add_executable(strip strip.c)
target_link_libraries(strip PRIVATE finshell::finshell_model)
"""


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.keep, cls.libraries = installed.install()
        cls.environment = installed.environment(cls.libraries)
        with open(os.path.join(installed.SOURCE, "doc", "model_api.md"), encoding="utf-8") as f:
            program = re.search(r"^```c\n(.*?)^```", f.read(), re.M | re.S).group(1)
        cls.source = os.path.join(cls.keep.name, "strip.c")
        with open(cls.source, "w", encoding="utf-8") as f:
            f.write(program)

    @classmethod
    def tearDownClass(cls):
        cls.keep.cleanup()

    def test_pkg_config(self):
        flags = installed.run("pkg-config", "--cflags", "--libs", "finshell-driver", env=self.environment).split()
        program = os.path.join(self.keep.name, "strip")
        installed.run(installed.CC, self.source, "-o", program, *flags)
        self.assertIn("tip 0.6", installed.run(program, env=self.environment))

    def test_cmake(self):
        folder = os.path.join(self.keep.name, "user")
        os.makedirs(folder)
        shutil.copy(self.source, folder)
        with open(os.path.join(folder, "CMakeLists.txt"), "w", encoding="utf-8") as f:
            f.write(CMAKE)
        build = os.path.join(folder, "build")
        installed.run("cmake", "-G", "Ninja", "-S", folder, "-B", build, f"-DCMAKE_PREFIX_PATH={self.keep.name}", f"-DCMAKE_C_COMPILER={installed.CC}")
        installed.run("cmake", "--build", build)
        self.assertIn("tip 0.6", installed.run(os.path.join(build, "strip"), env=self.environment))

    def test_header_in_cpp(self):
        source = os.path.join(self.keep.name, "header.cpp")
        with open(source, "w", encoding="utf-8") as f:
            f.write("#include <finshell.h>\n#include <finshell_model.h>\nint main() { return finshell_model_abi() - FINSHELL_MODEL_ABI; }\n")
        program = os.path.join(self.keep.name, "header")
        installed.run(installed.CXX, "-Wall", "-Wextra", "-Werror", source, "-o", program,
                      *installed.run("pkg-config", "--cflags", "--libs", "finshell-driver", env=self.environment).split())
        installed.run(program, env=self.environment)


class Memory(unittest.TestCase):
    @unittest.skipUnless(shutil.which("valgrind"), "valgrind is not installed")
    def test_valgrind(self):
        for name, arguments in (("test_model_calls", ("alone",)), ("test_model_guards", ("0", "memory"))):
            with self.subTest(program=name):
                program = os.path.join(installed.BINARY, "test", "bin", "model." + name)
                done = subprocess.run(["valgrind", "--error-exitcode=9", "--leak-check=full", "--errors-for-leak-kinds=definite,indirect",
                                       "--fair-sched=yes", program, *arguments], capture_output=True, text=True, timeout=900,
                                      env={**os.environ, "OMP_NUM_THREADS": "1"}, check=False)
                self.assertEqual(done.returncode, 0, done.stdout[-2000:] + done.stderr[-6000:])


if __name__ == "__main__":
    unittest.main()
