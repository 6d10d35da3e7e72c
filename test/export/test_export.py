#!/usr/bin/env python3
"""What the installed libraries show and need: functions finshell_* only, as many as the header declares; the runtimes only."""
import os
import re
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "api"))
import installed  # noqa: E402

RUNTIMES = r"(libgfortran|libgomp|libquadmath|libm|libmvec|libc|libgcc_s|libpthread|ld-linux\S*)\.so(\.\d+)?"


def symbols(path, *options):
    """Defined symbols of a library that others can link to."""
    lines = installed.run("nm", "--defined-only", "--extern-only", *options, path).splitlines()
    return {line.split()[2].split("@")[0] for line in lines if len(line.split()) == 3 and line.split()[1] != "A"}


def declarations(header):
    """Functions and structures of the header, one a line, without names of arguments and comments."""
    text = re.sub(r"/\*.*?\*/", "", header, flags=re.S)
    text = re.sub(r"^#.*$", "", text, flags=re.M)
    found = []
    for result, name, arguments in re.findall(r"^FINSHELL_API (const char \*|int32_t |void )(finshell_\w+)\(([^)]*)\);", text, re.M):
        types = [re.sub(r"\s*\w+$", "", " ".join(a.split())) for a in arguments.split(",") if a.strip() != "void"]
        found.append(f"{result.strip()} {name}({', '.join(types)})")
    for body, name in re.findall(r"typedef struct \w+ \{(.*?)\} (\w+);", text, re.S):
        found.append(f"{name}: {' '.join(body.split())}")
    for name, value in re.findall(r"(FINSHELL_\w+) = (-?\d+)", text):
        found.append(f"{name} = {value}")
    return found


class Export(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.keep, cls.libraries = installed.install()
        with open(os.path.join(cls.keep.name, "include", "finshell.h"), encoding="utf-8") as f:
            cls.header = f.read()
        cls.declared = set(re.findall(r"^FINSHELL_API (?:const char \*|int32_t |void )(finshell_\w+)\(", cls.header, re.M))
        cls.shared = os.path.join(cls.libraries, "libfinshell.so")

    @classmethod
    def tearDownClass(cls):
        cls.keep.cleanup()

    def test_shared_library_is_the_header(self):
        self.assertGreaterEqual(len(self.declared), 19)
        self.assertEqual(symbols(self.shared, "-D"), self.declared)

    def test_every_function_has_the_macro(self):
        text = re.sub(r"/\*.*?\*/|^#.*?(?<!\\)$", "", self.header, flags=re.S | re.M)
        functions = re.findall(r"^(?!typedef)(.*?)\b(finshell_\w+)\(", text, re.M)  # no types of functions
        self.assertEqual({name for _, name in functions}, self.declared)
        self.assertEqual({before.split()[0] for before, _ in functions}, {"FINSHELL_API"})

    def test_macro_on_systems(self):
        # what the preprocessor makes of it where the compiler is another one
        expected = {(): '__attribute__((visibility("default")))', ("-U__GNUC__",): "", ("-D_WIN32",): "__declspec(dllimport)",
                    ("-D_WIN32", "-DFINSHELL_BUILDING"): "__declspec(dllexport)", ("-D_WIN32", "-DFINSHELL_STATIC"): "",
                    ("-DFINSHELL_API=mine",): "mine"}
        header = os.path.join(self.keep.name, "include", "finshell.h")
        for options, macro in expected.items():
            with self.subTest(options=options):
                # types of the C library are not asked for
                text = installed.run(installed.CC, "-E", "-P", *options, "-D_STDINT_H", "-D_GCC_WRAP_STDINT_H", header)
                self.assertIn(f"{macro} int32_t finshell_abi(void);".strip(), [" ".join(line.split()) for line in text.splitlines()])

    def test_static_library(self):
        shown = symbols(os.path.join(self.libraries, "libfinshell.a"))
        self.assertEqual({s for s in shown if s.startswith("finshell_")}, self.declared)
        # beside them: what Fortran modules and critical regions of OpenMP export, all with our name
        foreign = {s for s in shown if not re.match(r"(finshell_|__finshell_\w+_MOD_|\.gomp_critical_user_finshell_)", s)}
        self.assertEqual(foreign, set())

    def test_no_name_is_a_module(self):
        # names of modules and of C functions share one name space; compilers take one for the other
        modules = {name[:-4] for _, _, names in os.walk(os.path.join(installed.SOURCE, "src")) for name in names}
        self.assertIn("finshell_mass", modules)
        self.assertEqual(self.declared & modules, set())

    def test_runtimes_only(self):
        needed = re.findall(r"NEEDED\s+(\S+)", installed.run("objdump", "-p", self.shared))
        self.assertIn("libgfortran.so.5", needed)
        self.assertEqual([n for n in needed if not re.fullmatch(RUNTIMES, n)], [])

    def test_abi_number(self):
        abi = re.search(r"#define FINSHELL_ABI (\d+)", self.header).group(1)
        soname = re.search(r"SONAME\s+(\S+)", installed.run("objdump", "-p", self.shared)).group(1)
        self.assertEqual(soname, f"libfinshell.so.{abi}")
        self.assertTrue(os.path.islink(self.shared))
        self.assertTrue(os.path.exists(os.path.join(self.libraries, soname)))

    def test_abi_is_kept(self):
        # as long as FINSHELL_ABI is the same, every declaration recorded for it is still there; new ones may come, and members at the
        # end of a structure that begins with its size
        abi = re.search(r"#define FINSHELL_ABI (\d+)", self.header).group(1)
        with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), f"abi_{abi}.txt"), encoding="utf-8") as f:
            recorded = f.read().splitlines()
        self.assertGreater(len(recorded), 20)
        found = declarations(self.header)
        self.assertIn("finshell_elements: uint64_t size;", "\n".join(recorded))
        self.assertEqual([d for d in recorded if d not in found and not (": uint64_t size;" in d and any(f.startswith(d) for f in found))],
                         [])

    def test_versions_agree(self):
        version = re.search(r'#define FINSHELL_VERSION "([\d.]+)"', self.header).group(1)
        numbers = [int(re.search(rf"#define FINSHELL_VERSION_{part} (\d+)\n", self.header).group(1)) for part in ("MAJOR", "MINOR", "PATCH")]
        self.assertEqual(".".join(map(str, numbers)), version)
        with open(os.path.join(installed.SOURCE, "src", "base", "finshell_version.f90"), encoding="utf-8") as f:
            self.assertEqual(int(re.search(r"version_number = (\d+)", f.read()).group(1)), numbers[0] * 10000 + numbers[1] * 100 + numbers[2])
        self.assertEqual(installed.run("pkg-config", "--modversion", "finshell", env=installed.environment(self.libraries)).strip(),
                         version)
        for name, pattern in (("src/base/finshell_version.f90", r"version = '([\d.]+)'"), ("api/fpm.toml", r'version = "([\d.]+)"'),
                              ("fpm.toml", r'version = "([\d.]+)"'), ("CMakeLists.txt", r"project\(finshell VERSION ([\d.]+)"),
                              ("api/python/pyproject.toml", r'version = "([\d.]+)"'),
                              ("api/python/finshell/__init__.py", r'__version__ = "([\d.]+)"')):
            with self.subTest(name=name), open(os.path.join(installed.SOURCE, name), encoding="utf-8") as f:
                self.assertEqual(re.search(pattern, f.read()).group(1), version)

    def test_every_function_says_since_when(self):
        blocks = re.split(r"\n\n", self.header)
        for name in self.declared:
            with self.subTest(name=name):
                block = next(b for b in blocks if re.search(rf"^FINSHELL_API (const char [*]|int32_t |void ){name}[(]", b, re.M))
                comment = block.split(f"{name}(")[0]
                self.assertIn("*/", comment)
                if name.startswith("finshell_rotation_"):
                    self.assertIn("All since 0.1.", self.header)
                else:
                    self.assertRegex(re.sub(r"\s*\n \*\s*", " ", comment), r"Since \d+\.\d+\.")

    def test_executable_stack_is_not_needed(self):
        flags = subprocess.run(["readelf", "-lW", self.shared], capture_output=True, text=True, check=True).stdout
        self.assertRegex(flags, r"GNU_STACK.* RW ")


if __name__ == "__main__":
    unittest.main()
