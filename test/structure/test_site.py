#!/usr/bin/env python3
"""The sources of the documentation site: all pages are there and listed, and the pages of the interfaces hold what these show."""
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("FINSHELL_SOURCE_DIR") or Path(__file__).resolve().parents[2])
sys.path.insert(0, str(ROOT / "doc" / "site"))
import interfaces  # noqa: E402

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

    def test_functions_of_the_header(self):
        for file, page, least in (("finshell.h", "c_header.md", 20), ("finshell_model.h", "c_model_header.md", 12)):
            header = (ROOT / "api" / file).read_text(encoding="utf-8")
            functions = set(re.findall(r"^(?:int32_t|void|const char \*)\s*(finshell_\w+)\(", header, re.M))
            self.assertGreater(len(functions), least)
            for name in functions:
                self.assertIn(f"### {name}\n", self.text[page])

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


if __name__ == "__main__":
    unittest.main()
