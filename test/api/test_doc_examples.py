#!/usr/bin/env python3
"""The programs of doc/c_api.md, taken from the text, built against the installed library and run: all print the same numbers."""
import os
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import installed  # noqa: E402

CMAKE = """cmake_minimum_required(VERSION 3.25)
project(user LANGUAGES {language})
find_package(finshell REQUIRED)
add_executable(program {source})
target_link_libraries(program PRIVATE finshell::{library})
"""


def numbers(output):
    return {line.split()[0]: float(line.split()[1]) for line in output.splitlines()}


class Examples(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.keep, cls.libraries = installed.install()
        cls.folder = cls.keep.name
        cls.programs = installed.programs()
        for language, name in (("c", "square.c"), ("c", "square.cpp"), ("fortran", "square.f90"), ("python", "square.py")):
            with open(os.path.join(cls.folder, name), "w", encoding="utf-8") as f:
                f.write(cls.programs[language])
        cls.environment = installed.environment(cls.libraries)
        cls.results = {}

    @classmethod
    def tearDownClass(cls):
        cls.keep.cleanup()

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def pkg_config(self, *options, package="finshell"):
        return installed.run("pkg-config", *options, package, env=self.environment).split()

    def check(self, output):
        """The numbers of the program in C, by pkg-config, and those of another one agree."""
        if not self.results:
            installed.run(installed.CC, "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", *self.pkg_config("--cflags"),
                          self.path("square.c"), "-o", self.path("square_c"), *self.pkg_config("--libs"))
            self.results.update(numbers(installed.run(self.path("square_c"), env=self.environment)))
        found = numbers(output)
        self.assertEqual(list(found), ["energy", "force", "moment", "stiffness"])
        for name, value in found.items():
            self.assertAlmostEqual(value, self.results[name], delta=1e-13 * abs(self.results["stiffness"]), msg=name)
        return found

    def test_programs_are_short(self):
        self.assertEqual(sorted(self.programs), ["c", "fortran", "python"])
        for language, text in self.programs.items():
            with self.subTest(language=language):
                self.assertLessEqual(len(text.splitlines()), 40)

    def test_static_library_from_c(self):
        for name, options in (("archive", ()), ("static", ("-static",))):
            with self.subTest(name=name):
                flags = self.pkg_config(*(["--static"] if options else []), "--cflags", "--libs", package="finshell-static")
                program = self.path("square_" + name)
                installed.run(installed.CC, "-std=c99", *options, self.path("square.c"), "-o", program, *flags)
                self.check(installed.run(program, env=self.environment))
                self.assertNotIn("libfinshell", installed.run("objdump", "-p", program))

    def test_fortran_by_pkg_config(self):
        program = self.path("square_fortran")
        installed.run(installed.FC, self.path("square.f90"), "-o", program,
                      *self.pkg_config("--cflags", "--libs", package="finshell-static"))
        self.check(installed.run(program, env=self.environment))

    def test_c_plus_plus(self):
        installed.run(installed.CXX, "-std=c++11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", *self.pkg_config("--cflags"),
                      self.path("square.cpp"), "-o", self.path("square_cpp"), *self.pkg_config("--libs"))
        self.check(installed.run(self.path("square_cpp"), env=self.environment))

    def test_python(self):
        environment = dict(self.environment, PYTHONPATH=os.path.join(installed.SOURCE, "api", "python"),
                           FINSHELL_LIB=os.path.join(self.libraries, "libfinshell.so"))
        found = self.check(installed.run(sys.executable, self.path("square.py"), env=environment))
        # 20 % stretch of a Mooney-Rivlin sheet: the energy of stretching alone, width kept, thickness 1/1.2
        i1 = 1.2**2 + 1 + 1.2**-2
        stretching = 0.1 * (80 + 20) * (i1 - 3)
        self.assertLess(abs(found["energy"] / stretching - 1), 0.02)

    def test_by_cmake(self):
        # a project in C alone needs no Fortran compiler
        for language, source, library in (("C", "square.c", "finshell"), ("C", "square.c", "finshell_static"),
                                          ("Fortran", "square.f90", "finshell_static")):
            with self.subTest(language=language, library=library):
                folder = self.path(f"cmake {language} {library}")
                os.mkdir(folder)
                with open(os.path.join(folder, "CMakeLists.txt"), "w", encoding="utf-8") as f:
                    f.write(CMAKE.format(language=language, source=f"../{source}", library=library))
                build = os.path.join(folder, "build")
                installed.run("cmake", "-G", "Ninja", "-S", folder, "-B", build, f"-DCMAKE_PREFIX_PATH={self.folder}",
                              *([f"-DCMAKE_Fortran_COMPILER={installed.FC}"] if "Fortran" in language else []),
                              *([f"-DCMAKE_C_COMPILER={installed.CC}"] if "C" in language.split() else []))
                installed.run("cmake", "--build", build)
                self.check(installed.run(os.path.join(build, "program"), env=self.environment))

    def run_fragment(self, title, before="", printed=""):
        """The lines of C of a section of the guide, with what they take for granted; what they print."""
        with open(self.path("fragment.c"), "w", encoding="utf-8") as f:
            f.write("#include <finshell.h>\n#include <stdio.h>\nint main(void)\n{\nint32_t code; finshell_section *section;\n"
                    "finshell_status status;\n" + before + installed.fragment(title) + printed +
                    'finshell_section_destroy(section);\nprintf("%s", status.message);\nreturn code;\n}\n')
        installed.run(installed.CC, "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", *self.pkg_config("--cflags"),
                      self.path("fragment.c"), "-o", self.path("fragment"), *self.pkg_config("--libs"))
        return installed.run(self.path("fragment"), env=self.environment)

    def test_layers_of_the_guide(self):
        self.assertEqual(self.run_fragment("Layers"), "")

    def test_section_of_the_guide(self):
        before = """const char *names[] = {"c10", "c01"}, *options[] = {"density"};
const double values[] = {80.0, 20.0}, density[] = {3.0};
code = finshell_section_create("mooney_rivlin", 2, names, values, 0.1, 1, options, density, &section, &status);
"""
        self.assertEqual(self.run_fragment("What a section is", before),
                         "1 layers, mass 0.3, in tension 80, in bending 0.0666667\nmooney_rivlin: 0.1\n   c10 = 80\n   c01 = 20\n")

    def test_normals_of_the_guide(self):
        # a sphere blown up by 1 %: N = E h / (1 - nu) times the Green-Lagrange strain, everywhere, and no bending
        before = """const char *names[] = {"e", "nu"};
const double values[] = {1000.0, 0.3};
const double X[1][3][3] = {{{6, 0, 8}, {0, 6, 8}, {0, 0, 10}}};
double u[1][3][3], t[1][3][3] = {{{0}}}, energy[1], force[1][18], tangent[1][18][18], membrane_force[1][3];
for (int i = 0; i < 3; i++) for (int c = 0; c < 3; c++) u[0][i][c] = 0.01 * X[0][i][c];
code = finshell_section_create("linear_elastic", 2, names, values, 0.1, 0, NULL, NULL, &section, &status);
"""
        printed = 'printf("%.12f %.12f", membrane_force[0][0], membrane_force[0][1]);\n'
        for value in self.run_fragment("Curved shells", before, printed).split():
            self.assertAlmostEqual(float(value), 1000 * 0.1 / 0.7 * 0.5 * (1.01**2 - 1), delta=1e-11)

    def test_membranes_of_the_guide(self):
        with open(self.path("strip.c"), "w", encoding="utf-8") as f:
            f.write(installed.fragment("Membranes"))
        installed.run(installed.CC, "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", *self.pkg_config("--cflags"),
                      self.path("strip.c"), "-o", self.path("strip"), *self.pkg_config("--libs"))
        found = numbers(installed.run(self.path("strip"), env=self.environment))
        self.assertEqual(found["wrinkled"], 1)
        self.assertAlmostEqual(found["energy"], 0.1 * (1.5**2 + 2 / 1.5 - 3), delta=1e-7)
        self.assertAlmostEqual(found["force"], 0.1 * 2 * (1.5 - 1.5**-2), delta=1e-14)


if __name__ == "__main__":
    unittest.main()
