#!/usr/bin/env python3
"""The rules of structure.py hold for the sources; and each rule is tested with a planted violation."""
import os
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, HERE)
import structure  # noqa: E402


class Sources(unittest.TestCase):
    """The project itself."""

    def test_sources_are_seen(self):
        self.assertGreater(len(structure.fortran_files(os.path.join(ROOT, "src"))), 10)

    def test_drawing(self):
        """CONTRIBUTING.md draws the rooms as they are."""
        self.assertTrue(structure.drawing(ROOT) in structure.text_of(os.path.join(ROOT, "CONTRIBUTING.md")),
                        "CONTRIBUTING.md is not what src/rooms.txt says: python3 test/structure/structure.py")

    def test_no_violation(self):
        found = structure.violations(ROOT, structure.long_files(os.path.join(HERE, "long_files.txt")),
                                     structure.pfunit_names(os.path.join(HERE, "pfunit_names.txt")), complete=True,
                                     excepted=structure.excepted_counts(os.path.join(HERE, "freedoms.txt")))
        self.assertEqual(found, [], "\n" + "\n".join(found))


class Planted(unittest.TestCase):
    """A small tree of sources with one violation at a time."""

    CLEAN = {
        "src/base/finshell_kinds.F90": "module finshell_kinds\n integer, parameter, public :: wp = 8\nend module\n",
        "src/base/finshell_text.f90": "module finshell_text\ncontains\n subroutine t(b)\n  character(9) :: b\n"
                                      "  write (b, '(a)') 'stop; print *'\n end subroutine\nend module\n",
        "src/material/finshell_law.f90": "module finshell_law\n use finshell_kinds, only: wp\nend module\n",
        "src/material/finshell_registry.f90": "module finshell_registry\n use finshell_law\ncontains\n subroutine pick(l)\n"
                                              "  class(*), allocatable :: l\n  allocate (l, source=1)\n end subroutine\nend module\n",
        "src/section/finshell_section.f90": "module finshell_section\n use finshell_kinds, only: &\n  & wp\n"
                                            " type :: section_t\n  class(*), allocatable :: law\n end type\ncontains\n"
                                            " subroutine new_section(s)\n  type(section_t) :: s\n  allocate (s%law, source=1)\n"
                                            " end subroutine\n pure function stress(x) result(y)\n  real :: x, y\n  y = x ! stop\n"
                                            " end function\nend module\n",
        "src/batch/finshell_batch.f90": "module finshell_batch\n use finshell_section\nend module\n",
        "src/model/finshell_mesh.f90": "module finshell_mesh\n use finshell_section\nend module\n",
        "src/path/finshell_newton.f90": "module finshell_newton\n use finshell_mesh\nend module\n",
        "src/analysis/finshell_buckling.f90": "module finshell_buckling\n use finshell_newton\n use finshell_batch\nend module\n",
        "src/io/results/finshell_results.f90": "module finshell_results\n use finshell_mesh\nend module\n",
        "src/rooms.txt": structure.text_of(os.path.join(ROOT, "src", "rooms.txt")),
        "src/app/finshell_driver.f90": "module finshell_driver\n use finshell_results\n use finshell_newton\ncontains\n subroutine run()\n"
                                       "  print *, 1\n  error stop 1\n end subroutine\nend module\n",
        "src/finshell.f90": "module finshell\n use finshell_batch\n use finshell_registry\nend module\n",
        "api/finshell_api.f90": "module finshell_api\n use finshell_batch\n use finshell_registry\nend module\n",
        "app/main.f90": "program main\n use finshell_driver\n call run()\n stop 1\nend program\n",
    }

    def found(self, changes, listed=(), names=frozenset(), excepted=frozenset()):
        """Violations in the clean tree after some files were replaced or added."""
        with tempfile.TemporaryDirectory() as root:
            for name, text in {**self.CLEAN, **changes}.items():
                path = os.path.join(root, name)
                os.makedirs(os.path.dirname(path), exist_ok=True)
                with open(path, "w", encoding="utf-8") as file:
                    file.write(text)
            return structure.violations(root, set(listed), names, excepted=excepted)

    def test_clean_tree(self):
        self.assertEqual(self.found({}), [])

    def planted(self, path, text, message):
        """Exactly one violation, at the right place."""
        found = self.found({path: text})
        self.assertEqual(len(found), 1, found)
        self.assertTrue(found[0].startswith(path), found)
        self.assertIn(message, found[0])

    def test_arrows(self):
        for user, path, used in (
            ("base", "src/base/finshell_kinds.F90", "finshell_law"), ("material", "src/material/finshell_law.f90", "finshell_section"),
            ("batch", "src/batch/finshell_batch.f90", "finshell_mesh"), ("model", "src/model/finshell_mesh.f90", "finshell_newton"),
            ("path", "src/path/finshell_newton.f90", "finshell_results"), ("path", "src/path/finshell_newton.f90", "finshell_batch"),
            ("path", "src/path/finshell_newton.f90", "finshell_buckling"), ("io/results", "src/io/results/finshell_results.f90", "finshell_newton"),
            ("io/results", "src/io/results/finshell_results.f90", "finshell_driver"), ("api", "api/finshell_api.f90", "finshell_mesh"),
            ("api", "api/finshell_api.f90", "finshell_law"), ("facade", "src/finshell.f90", "finshell_mesh"),
            ("main", "app/main.f90", "finshell_newton"), ("section", "src/section/finshell_section.f90", "finshell_batch"),
        ):
            with self.subTest(user=user, used=used):
                kind = "program" if user == "main" else "module"
                name = os.path.basename(path).split(".")[0]
                self.planted(path, f"{kind} {name}\n use, non_intrinsic :: {used.upper()}, &\n  only: x\nend {kind}\n", f"{user} uses {used}")

    def test_rooms(self):
        rooms = self.CLEAN["src/rooms.txt"]
        self.assertIn("material uses section, which does not stand above it", self.found({"src/rooms.txt": rooms.replace("| base math    ", "| base math section", 1)})[0])
        self.planted("src/attic/finshell_old.f90", "module finshell_old\nend module\n", "no room")

    def test_kernel(self):
        for line, message in (
            ("write (unit, *) x", "input or output"), ("if (x > 0) read (5, *) x", "input or output"), ("open (newunit=i, file=n)", "input or output"),
            ("real, save :: y", "save in the kernel"), ("real, allocatable :: y(:)", "allocation in the kernel"),
            ("allocate (y(3))", "allocation in the kernel"), ("if (x > 0) allocate (y(3))", "allocation in the kernel"),
            ("real, pointer :: y(:)", "allocation in the kernel"),
        ):
            with self.subTest(line=line):
                self.planted("src/section/finshell_section.f90", f"module finshell_section\ncontains\n pure subroutine f(x)\n  {line}\n"
                             " end subroutine\nend module\n", message)
        self.planted("src/material/finshell_law.f90", "module finshell_law\n real :: count = 0\ncontains\nend module\n", "module variable")

    def test_only_app_prints_or_stops(self):
        for line, message in (
            ("print *, x", "prints"), ("write (*, '(a)') x", "prints"), ("if (x > 0) write (output_unit, *) x", "prints"),
            ("stop", "stops"), ("if (x > 0) error stop 'no'", "stops"), ("x = 1; error stop", "stops"),
        ):
            for path in ("src/path/finshell_newton.f90", "src/base/finshell_text.f90", "api/finshell_api.f90"):
                name = os.path.basename(path).split(".")[0]
                with self.subTest(line=line, path=path):
                    self.planted(path, f"module {name}\ncontains\n subroutine f(x)\n  {line}\n end subroutine\nend module\n", message)

    def test_length(self):
        long = {"src/model/finshell_mesh.f90": "module finshell_mesh\n" + "! line\n" * 400 + "end module\n"}
        self.assertIn("402 lines", self.found(long)[0])
        self.assertEqual(self.found(long, ["src/model/finshell_mesh.f90"]), [])
        self.assertIn("listed as long", self.found({}, ["src/model/finshell_mesh.f90"])[0])

    def test_counts_of_freedoms(self):
        for line in ("allocate (f(6, nodes))", "k(18, 18) = 0", "x = m(4:6, i)", "do i = 1, 6", "p = 6*(i - 1) + 1", "f = reshape(f, [9])", "n = i/18"):
            with self.subTest(line=line):
                self.planted("src/path/finshell_newton.f90", f"module finshell_newton\ncontains\n subroutine f(x)\n  {line}\n end subroutine\nend module\n",
                             "a literal number of freedoms")
        for line in ("x = 1.0e-6*y(16)", "x = 6.0 + 0.18", "s = '(6, 18)' ! 18", "character(len=6) :: s", "character(9) :: s", "n6 = n_18", "c = f([character(len=9) :: 'a'])"):
            with self.subTest(line=line):
                self.assertEqual(self.found({"src/path/finshell_newton.f90": f"module finshell_newton\ncontains\n subroutine f(x)\n  {line}\n"
                                             " end subroutine\nend module\n"}), [])
        batch = {"src/batch/finshell_batch.f90": "module finshell_batch\n integer, parameter :: n = 18, m = 6\nend module\n"}
        self.assertEqual(len(self.found(batch)), 1)
        self.assertEqual(self.found(batch, excepted={("src/batch/finshell_batch.f90", "n = 18")}), [])
        self.assertIn("does not stand there", self.found({}, excepted={("src/batch/finshell_batch.f90", "n = 18")})[0])

    def test_names_of_pfunit(self):
        names = structure.pfunit_names(os.path.join(HERE, "pfunit_names.txt"))
        self.assertLessEqual({"is", "run", "equal_to", "assertequal", "every_item"}, names)
        start = "module test_a\n use funit\ncontains\n @test\n subroutine test_b()\n  class(*), allocatable :: l\n"
        for line, name in (("integer, allocatable :: is(:)", "is"), ("call run(1)", "run"), ("real :: x, &\n near", "near"), ("@assertEqual(1, is)", "is"),
                           ("x = not(y)", "not"), ("associate (test => x)", "test")):
            with self.subTest(line=line):
                found = self.found({"test/unit/test_a.pf": f"{start}  {line}\n end subroutine\nend module\n"}, names=names)
                self.assertEqual(found, [f"test/unit/test_a.pf:7: {name} is a name of pFUnit's"])
        for line in ("self%is = 1", "call f(x, is=1)", "@assertEqual(1, x) ! is", "select type (l)\n  type is (real)\n  class is (t)\n  end select",
                     "s = 'run'", "isnt = running"):
            with self.subTest(line=line):
                self.assertEqual(self.found({"test/unit/test_a.pf": f"{start}  {line}\n end subroutine\nend module\n"}, names=names), [])
        self.assertEqual(len(self.found({"test/support/support_a.f90": "module support_a\n real :: near\nend module\n"}, names=names)), 1)


if __name__ == "__main__":
    unittest.main()
