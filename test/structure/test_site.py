#!/usr/bin/env python3
"""The sources of the documentation site: all pages are there and listed, and the pages of the interfaces hold what these show."""
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

ROOT = Path(os.environ.get("FINSHELL_SOURCE_DIR") or Path(__file__).resolve().parents[2])
sys.path.insert(0, str(ROOT / "doc" / "site"))
import c_headers  # noqa: E402
import interfaces  # noqa: E402
import python_package  # noqa: E402

FORTRAN = """!> What it is for.
module m
   use other, only: wp
   private
   public :: thing, &
      run ! the two
   integer, parameter, public :: n_things = 2
   !> A thing.
   type, extends(base) :: thing
      real(wp) :: size = 0 !< its size
   end type thing
contains
   !> Runs x < y:
   !>
   !>     y = 2*x
   pure function run(x, &
                     factor) result(y)
      real(wp), intent(in) :: x(:) !< where
      real(wp), intent(in), optional :: factor
      real(wp) :: y, inner
      y = inside(x)
   contains
      !> Not seen.
      pure real(wp) function inside(x)
         real(wp), intent(in) :: x(:)
      end function inside
   end function run
   !> Not seen either.
   subroutine hidden()
   end subroutine hidden
end module m
"""


class Site(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.keep = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.keep.name) / "source"
        subprocess.run([sys.executable, str(ROOT / "doc" / "site" / "assemble.py"), str(cls.folder)], check=True)
        cls.text = {str(p.relative_to(cls.folder)): p.read_text(encoding="utf-8") for p in cls.folder.rglob("*.md")}

    @classmethod
    def tearDownClass(cls):
        cls.keep.cleanup()

    def test_every_page_is_listed_once(self):
        listed = [name for text in self.text.values() for body in re.findall(r"^```\{toctree\}\n(.*?)^```", text, re.S | re.M)
                  for name in body.splitlines() if name and not name.startswith(":")]
        self.assertEqual(sorted(listed), sorted(name[:-3] for name in self.text if name != "index.md"))

    def test_links_lead_to_pages(self):
        count = 0
        for name, text in self.text.items():
            text = re.sub(r"^```.*?^```", "", text, flags=re.S | re.M)
            for link in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`\n]*`", "", text)):
                path = link.partition("#")[0]
                if path and not re.match(r"[a-z]+:", link):
                    count += 1
                    self.assertTrue((self.folder / name).parent.joinpath(path).is_file(), f"{name}: {link}")
        self.assertGreater(count, 150)

    def test_documents_and_examples_are_there(self):
        for path in (ROOT / "doc").glob("*.md"):
            self.assertIn(path.name, self.text)
        for path in (ROOT / "examples").glob("*/*.nml"):
            self.assertIn(path.read_text(encoding="utf-8").rstrip(), self.text[f"examples/{path.parent.name}.md"])

    def test_functions_of_the_headers(self):
        headers = sorted((ROOT / "api").glob("*.h"))
        self.assertIn("finshell.h", [path.name for path in headers])
        for path in headers:
            words = re.sub(r"/\*.*?\*/", "", path.read_text(encoding="utf-8"), flags=re.S)  # another reading than that of the page
            called = set(re.findall(r"^\w[\w *]*?\b(finshell_\w+)\s*\(", words, re.M))
            self.assertTrue(called, path)
            for name in called:
                self.assertIn(f"### {name}\n", self.text[f"c_{path.stem}.md"])

    def test_classes_of_the_package(self):
        page = self.text["python.md"]
        for path in (ROOT / "api" / "python" / "finshell").glob("[!_]*.py"):
            self.assertIn(f".. automodule:: finshell.{path.stem}\n", page)
        self.assertIn(".. automodule:: finshell\n", page)

    def test_public_procedures_of_the_library(self):
        facade = re.sub(r"&\s*\n", " ", (ROOT / "src" / "finshell.f90").read_text(encoding="utf-8"))
        pages = "\n".join(text for name, text in self.text.items() if name.startswith("fortran_"))
        procedures = [name.strip() for line in re.findall(r"^ +use finshell_(?!kinds|status|version)\w+, only: (.*)$", facade, re.M)
                      for name in line.split(",") if not re.search(r"n_\w+$|state_|formulation_|_t$|rotation_(vector|quaternion|increment)$", name.strip())]
        self.assertGreater(len(procedures), 20)
        for name in procedures:
            self.assertIn(f"### {name}\n", pages)

    def test_a_module(self):
        page = interfaces.Module(FORTRAN).page()
        for part in ("## m\n\nWhat it is for.", "### thing\n\nA thing.", "real(wp) :: size = 0 !< its size", "### run\n\nRuns x \\< y:",
                     "```text\ny = 2*x\n```", "pure function run(x, &\n                  factor) result(y)\n   real(wp), intent(in) :: x(:) !< where\n"
                     "   real(wp), intent(in), optional :: factor\n   real(wp) :: y, inner\n```"):
            self.assertIn(part, page)
        for part in ("hidden", "inside", "Not seen"):
            self.assertNotIn(part, page)


HEADER = """/* What it is. */
#ifndef FINSHELL_T_H
#define FINSHELL_T_H
#ifdef __cplusplus
extern "C" {
#endif

/* A number.
 *   value [n]   what it is, and a line that is so long that it has to go on in the next one, because there is no more room
 *               here
 *   codes [n]
 * See finshell_b. Since 0.1. */
FINSHELL_API int32_t finshell_a(const double *value, int32_t *codes);

/* ------------------------------------------------------------------ more: all since 0.2
 * Of a section. Since 0.2. */

/* One. */
struct finshell_s *finshell_b(void (*call)(void), struct finshell_s *);

/* A call. */
typedef int32_t (*finshell_law)(void *data, double x);

/* A structure. */
typedef struct finshell_s {
   int32_t (*call)(int32_t); /* not a function of the library */
} finshell_s;

/* In the header. */
static inline int32_t finshell_c(int32_t i) { return finshell_b(0, 0) ? i : 0; }

/* The last one. */
void finshell_d(void);

/* A kind of function. */
typedef void finshell_kind(int32_t n, double *codes);

#ifdef __cplusplus
}
#endif
#endif
"""

PACKAGE = {"__init__.py": '"""P."""\nfrom ._a import f, g\n__all__ = ["f"]\n', "_a.py": 'def f():\n    """F."""\ndef g():\n    pass\n',
           "_private.py": "def f(): pass\n", "m.py": '"""M."""\nclass C:\n    """C."""\n    x: int  # é, a comment\n    def f(self):\n        """F."""\n'
           "    def _g(self): pass\ndef _f(): pass\n"}


class Undocumented(unittest.TestCase):
    """What is public and has no words is found."""

    def in_header(self, text):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "t.h"
            path.write_text(text)
            return [sentence.replace(f"{path}:", "") for sentence in c_headers.undocumented(path)]

    def test_header(self):
        self.assertEqual(c_headers.functions(HEADER), ["finshell_a", "finshell_b", "finshell_c", "finshell_d"])
        self.assertEqual(self.in_header(HEADER), [])
        for old, new, sentence in (
                ("/* One. */", "", "19: finshell_b has no comment of its own (one that begins a line, before it)"),
                ("/* One. */", "/* */", "19: finshell_b has no comment of its own (one that begins a line, before it)"),
                ("/* In the header. */", "", "30: finshell_c has no comment of its own (one that begins a line, before it)"),
                ("/* A call. */", "", "22: finshell_law has no comment of its own (one that begins a line, before it)"),
                ("/* A kind of function. */", "", "36: finshell_kind has no comment of its own (one that begins a line, before it)"),
                ("Since 0.1", "", "13: finshell_a has no \"Since\" with the version that brought it")):
            self.assertEqual(self.in_header(HEADER.replace(old, new)), [sentence])

    def test_page_of_a_header(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "t.h"
            path.write_text(HEADER)
            page = c_headers.page(path, c_headers.Names([path]))
        for part in ("# t.h\n", "| [finshell\\_a](#finshell_a) | A number |", "### finshell_a\n\nA number.\n\n- `value [n]`: what it is, and a line that is so "
                     "long that it has to go on in the next one, because there is no more room here\n- `codes [n]`\n\n"
                     "See [finshell\\_b](c_t.md#finshell_b). Since 0.1.\n\n```c\nFINSHELL_API int32_t finshell_a("):
            self.assertIn(part, page)
        self.assertNotIn("__cplusplus", page)
        self.assertNotIn("T_H", page)

    def in_package(self, **changes):
        with tempfile.TemporaryDirectory() as folder:
            package = Path(folder) / "p"
            package.mkdir()
            for name, text in {**PACKAGE, **{f"{name}.py": text for name, text in changes.items()}}.items():
                (package / name).write_text(text, encoding="utf-8")
            found = [sentence.replace(f"{package}/", "") for sentence in python_package.undocumented(package)]
            return found, python_package.comments(package / "m.py"), python_package.absent(package)

    def test_package(self):
        self.assertEqual(self.in_package(), ([], {("C", "x"): "é, a comment"}, []))
        for name, text, sentence in (("m", "", "m.py:1: the module p.m has no docstring"),
                                     ("m", '"""M."""\ndef f(): pass\n', "m.py:2: f has no docstring"),
                                     ("m", '"""M."""\nclass C: pass\n', "m.py:2: C has no docstring"),
                                     ("m", '"""M."""\nclass C:\n    """C."""\n    def f(self): pass\n', "m.py:4: C.f has no docstring"),
                                     ("_a", "def f(): pass\n", "_a.py:1: f has no docstring")):
            self.assertEqual(self.in_package(**{name: text})[0], [sentence])
        self.assertEqual(self.in_package(_a='import os, nosuchthing.x\ndef f():\n    """F."""\n')[2], ["nosuchthing"])

    def test_it_ends_the_making_of_the_site(self):
        with tempfile.TemporaryDirectory() as folder:
            for module in (c_headers, python_package):
                with mock.patch.object(module, "undocumented", return_value=["api/x:1: y has no words"]):
                    with self.assertRaisesRegex(SystemExit, "^api/x:1: y has no words"):
                        interfaces.write(ROOT, Path(folder))
            self.assertEqual(interfaces.write(ROOT, Path(folder))[0], "fortran")


if __name__ == "__main__":
    unittest.main()
