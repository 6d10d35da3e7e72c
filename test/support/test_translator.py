#!/usr/bin/env python3
"""The translator and the module funit, tested: what must fail does fail, with the place, and what must pass passes."""
import os
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
import translate_pf  # noqa: E402

COMPILER = os.environ.get("FINSHELL_FC", "gfortran")

HEAD = """module test_x
   use, intrinsic :: iso_fortran_env, only: real64
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_positive_inf
   use funit
   implicit none
   integer :: calls = 0
contains
"""

# body of one test, text that must be printed (None: the test must pass)
CASES = [
    ("@assertEqual(2, 1 + 1)", None),
    ("@assertEqual(2, 1 + 2, message='sum')", "test_x.pf:10: expected 2, found 3\n   sum"),
    ("@assertEqual(1.0_real64, 1.0_real64 + 1e-9_real64, tolerance=1e-8_real64)", None),
    ("@assertEqual(1.0_real64, 1.0_real64 + 1e-7_real64, tolerance=1e-8_real64)", "test_x.pf:10: expected 1.0000000000000000E+000"),
    ("@assertEqual(1.0_real64, 1.0_real64 + 1e-15_real64)", "tolerance 0.0"),
    ("@assertEqual(nan(), nan(), tolerance=1.0_real64)", "found NaN"),
    ("@assertEqual(1.0_real64, nan(), tolerance=huge(1.0_real64))", "found NaN"),
    ("@assertEqual(1.0_real64, infinity(), tolerance=huge(1.0_real64))", "found Infinity"),
    ("@assertEqual(infinity(), infinity())", None),
    ("@assertEqual([1.0_real64, 2.0_real64], [1.0_real64, 2.5_real64], tolerance=0.1_real64)", "at (2)"),
    ("@assertEqual(0.0_real64, reshape([0.0_real64, 0.0_real64, 0.0_real64, 1.0_real64], [2, 2]), tolerance=0.1_real64)", "at (2, 2)"),
    ("@assertEqual([1.0_real64, 2.0_real64], [1.0_real64], tolerance=9.0_real64)", "differ in shape"),
    ("@assertEqual([1.0_real64, 2.0_real64], [1.0_real64, nan()], tolerance=9.0_real64)", "at (2)"),
    ("@assertEqual([1, 2, 3], [1, 2, 4])", "expected 3, found 4 at (3)"),
    ("@assertEqual([1, 2, 3], [1, 2, 3])", None),
    ("@assertEqual(.true., .true.)", None),
    ("@assertEqual(.true., .false.)", "expected true , found false"),
    ("@assertEqual('abc', 'abc')", None),
    ("@assertEqual('a,(', 'b''s')", "expected \"a,(\", found \"b's\""),
    ("@assertRelativelyEqual(1e9_real64, 1.000001e9_real64, tolerance=1e-5_real64)", None),
    ("@assertRelativelyEqual(1e-9_real64, 1.1e-9_real64, tolerance=1e-5_real64)", "test_x.pf:10: expected"),
    ("@assertTrue(1 < 2)", None),
    ("@assertTrue(2 < 1, message='order')", "test_x.pf:10: expected true, found false\n   order"),
    ("@assertFalse(2 < 1)", None),
    ("@assertFalse(1 < 2)", "expected false, found true"),
    ("@assertLessThan(1.0_real64, 2.0_real64)", None),
    ("@assertLessThan(2.0_real64, 2.0_real64)", "to be less than"),
    ("@assertLessThan(nan(), 2.0_real64)", "to be less than"),
    ("@assertLessThanOrEqual(2, 2)", None),
    ("@assertLessThanOrEqual(3, 2)", "expected 3 to be at most 2"),
    ("@assertGreaterThan(2, 2)", "expected 2 to be more than 2"),
    ("@assertGreaterThan(1.0_real64, nan())", "to be more than"),
    ("@assertGreaterThanOrEqual(2, 2)", None),
    ("@assertIsNaN(nan())", None),
    ("@assertIsNaN(1.0_real64)", "expected NaN"),
    ("@assertIsFinite(1.0_real64)", None),
    ("@assertIsFinite(nan())", "expected a finite value"),
    ("calls = 1", "made no assertion"),
    ("@assertEqual(1, 2)\n      error stop 'the failed test went on'", "FAILED test_x.test_one"),
    ("@assertEqual(1, 2)\n   end subroutine test_one\n   @test\n   subroutine test_two()\n      @assertTrue(.true.)",
     "ok     test_x.test_two"),
]
TAIL = """
   end subroutine
   real(real64) function nan()
      nan = ieee_value(1.0_real64, ieee_quiet_nan)
   end function nan
   real(real64) function infinity()
      infinity = ieee_value(1.0_real64, ieee_positive_inf)
   end function infinity
end module test_x
"""


class Translator(unittest.TestCase):
    """Compiled and run: the whole way from a .pf file to an exit status."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        for name in ("funit_core", "funit"):
            cls.compile(os.path.join(HERE, name + ".f90"), "-c", "-o", name + ".o")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def compile(cls, *arguments):
        command = [COMPILER, "-ffpe-trap=invalid,zero,overflow", "-fcheck=all", *arguments]
        done = subprocess.run(command, cwd=cls.folder.name, capture_output=True, text=True, check=False)
        if done.returncode:
            raise AssertionError(done.stderr)

    def run_pf(self, text, *flags, arguments=()):
        """Translate, compile and run; the finished process."""
        source = os.path.join(self.folder.name, "test_x.pf")
        with open(source, "w", encoding="utf-8") as file:
            file.write(text)
        target = os.path.join(self.folder.name, "test_x.F90")
        self.assertEqual(translate_pf.main([source, target]), 0)
        self.compile("-o", "test_x", target, "funit.o", "funit_core.o", *flags)
        return subprocess.run([os.path.join(self.folder.name, "test_x"), *arguments], capture_output=True, text=True, check=False)

    def test_assertions(self):
        for body, expected in CASES:
            done = self.run_pf(HEAD + "   @test\n   subroutine test_one()\n      " + body + TAIL)
            with self.subTest(body=body):
                if expected is None:
                    self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
                    self.assertIn("1 tests, 1 assertions, 0 tests failed", done.stdout)
                else:
                    self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
                    self.assertIn(expected, done.stdout)
                    self.assertIn("1 tests failed", done.stdout)

    def test_fixtures_conditions_and_selection(self):
        text = HEAD + """   @before
   subroutine prepare()
      calls = calls + 1
   end subroutine prepare
   @after
   subroutine tidy()
      calls = calls + 10
   end subroutine tidy
   @test
   subroutine test_first()
      @assertEqual(1, calls)
   end subroutine test_first
   @test
   subroutine test_second()
      @assertEqual(12, calls)
   end subroutine test_second
   @test(ifdef=HAVE_MORE)
   subroutine test_third()
      @assertEqual(23, calls)
   end subroutine test_third
end module test_x
"""
        done = self.run_pf(text)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("2 tests, 2 assertions", done.stdout)
        done = self.run_pf(text, "-DHAVE_MORE")
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("3 tests, 3 assertions", done.stdout)
        done = self.run_pf(text, arguments=["test_first"])
        self.assertIn("1 tests, 1 assertions", done.stdout)
        self.assertEqual(self.run_pf(text, arguments=["test_absent"]).returncode, 2)

    def test_what_cannot_be_translated(self):
        test = "   @test\n   subroutine test_one()\n"
        for body, message in (
            (test + "      @assertEqal(1, 1)", "test_x.pf:10: annotation @assertEqal"),
            (test + "      @assertEqual(1, &\n         1)", "test_x.pf:10: "),
            (test + "      @assertEqual(1)", "arguments of @assertEqual"),
            (test + "      call assertEqual(1, 1)", "without its @"),
            ("   @test(npes=[1])\n   subroutine test_one()\n", "option not understood"),
            ("   @test\n   subroutine test_one(a)\n", "must not take arguments"),
            ("   @test\n   integer function test_one()\n", "must stand before a subroutine"),
            ("   subroutine test_one()\n", "no @test"),
            (test + "   end subroutine\n" + test, "two tests are named test_one"),
        ):
            with self.subTest(body=body), self.assertRaisesRegex(translate_pf.PfError, message):
                translate_pf.translate((HEAD + body + TAIL).splitlines(), "test_x.pf")
        with self.assertRaisesRegex(translate_pf.PfError, "must be named as its file"):
            translate_pf.translate((HEAD + test + TAIL).splitlines(), "test_y.pf")

    def test_lines_stay_short_and_keep_their_numbers(self):
        assertion = "      @assertTrue(" + "1 == 1 .and. " * 20 + "'" + "a b " * 20 + "' /= '', message='" + "long text, " * 8 + "')"
        lines = (HEAD + "   @test\n   subroutine test_one()\n" + assertion + "\n      no_such = 1" + TAIL).splitlines()
        text = translate_pf.translate(lines, "test_x.pf")
        self.assertGreater(len(assertion), 300)
        self.assertLessEqual(max(map(len, text.splitlines())), 132)
        self.assertIn("location=SourceLocation('test_x.pf', 10)", text)
        with open(os.path.join(self.folder.name, "test_x.F90"), "w", encoding="utf-8") as file:
            file.write(text)
        with self.assertRaisesRegex(AssertionError, r"test_x\.pf:11:"):
            self.compile("-c", "test_x.F90")


if __name__ == "__main__":
    unittest.main()
