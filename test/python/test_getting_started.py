#!/usr/bin/env python3
"""doc/getting_started.md in an empty folder: its files are written and its commands run, exactly as they stand there.

What `make build tools` installs is there already: the program, and Gmsh in the Python that runs the tests; the package is installed
from api/python as a wheel. Without Gmsh the test fails, unless FINSHELL_NO_GMSH says that there is none.
"""
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
from PIL import Image

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
PAGE = (SOURCE / "doc" / "getting_started.md").read_text(encoding="utf-8")
INSTALL = 'make build tools\nexport PATH="$PWD/build/bin:$PWD/build/venv/bin:$PATH"\n'


def blocks(page):
    """(language, text, name of the file that it is, if any) of each block of code."""
    found = []
    for before, language, text in re.findall(r"([^\n]*)\n\n```(\w*)\n(.*?)^```", page, re.S | re.M):
        name = re.search(r"(?:[Ww]rite this to|file) `([^`]+)`", before)
        found.append((language, text, name.group(1) if name else None))
    return found


class Guide(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        try:
            import gmsh  # noqa: F401
        except (ImportError, OSError) as reason:
            if os.environ.get("FINSHELL_NO_GMSH"):
                sys.exit(77)
            raise AssertionError(f"Gmsh cannot be loaded ({reason}); `tools/install_dependencies test` installs it. "
                                 "FINSHELL_NO_GMSH=1 in the environment skips this test") from reason
        cls.keep = tempfile.TemporaryDirectory()
        base = Path(cls.keep.name)
        cls.folder, tools, build = base / "new", base / "tools", base / "build"
        cls.folder.mkdir()
        (build / "bin").mkdir(parents=True)
        (build / "bin" / "finshell").symlink_to(os.environ["FINSHELL_BIN"])
        subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-index", "--no-deps",
                        "--no-build-isolation", "--target", str(tools), str(SOURCE / "api" / "python")], check=True)
        cls.environment = {**os.environ, "PYTHONPATH": str(tools),
                           "PATH": os.pathsep.join([str(build / "bin"), str(tools / "bin"), str(Path(sys.executable).parent), os.environ["PATH"]])}
        cls.output = {}
        for language, text, name in blocks(PAGE):
            if name:
                (cls.folder / name).write_text(text, encoding="utf-8")
            elif language == "sh" and text != INSTALL:
                for command in text.splitlines():
                    done = subprocess.run(["bash", "-c", command], cwd=cls.folder, env=cls.environment, capture_output=True, text=True, check=False)
                    cls.output[command] = done.stdout + done.stderr
                    assert done.returncode == 0, f"{command}\n{cls.output[command]}"

    @classmethod
    def tearDownClass(cls):
        cls.keep.cleanup()

    def test_installation_is_what_make_knows(self):
        self.assertIn(("sh", INSTALL, None), blocks(PAGE))
        makefile = (SOURCE / "Makefile").read_text(encoding="utf-8")
        for target in ("build", "tools"):
            self.assertRegex(makefile, rf"(?m)^{target}:")

    def test_all_commands_ran(self):
        self.assertEqual([c.split()[0] for c in self.output],
                         ["gmsh", "finshell", "finshell", *["finshell-plot"] * 4, "finshell", "finshell-plot", "finshell", "finshell-fit"])
        for word in ("complete and consistent", "Done: load factor 1.000000"):
            self.assertTrue(any(word in text for text in self.output.values()), word)

    def test_pictures_show_something(self):
        seen = []
        for name in ("inflate.png", "stretch.png", "curve.png", "patch.png", "fit.png", "inflate.gif"):
            with Image.open(self.folder / name) as image:
                pixels = np.asarray(image.convert("RGB")).astype(int)
                self.assertEqual(getattr(image, "n_frames", 1) > 3, name == "inflate.gif")
            self.assertGreater(len(np.unique(pixels.reshape(-1, 3), axis=0)), 50, name)
            self.assertGreater((pixels.min(axis=2) < 200).mean(), 0.01, name)
            seen.append(pixels.tobytes())
        self.assertEqual(len(set(seen)), len(seen))

    def test_lines_that_the_page_shows(self):
        shown = next(text for language, text, name in blocks(PAGE) if language == "text" and "load factor" in text)
        ran = next(text for command, text in self.output.items() if command.startswith("finshell run"))
        self.assertIn(shown.splitlines()[0], ran)
        for line in shown.splitlines()[1:]:  # another Gmsh makes another mesh: the first digits
            number, factor, height = line.split()[:3]
            found = next(row.split() for row in ran.splitlines() if row.split()[:1] == [number])
            self.assertEqual(float(found[1]), float(factor))
            self.assertAlmostEqual(float(found[2]) / float(height), 1, delta=0.03)

    def test_fit_gives_a_group(self):
        text = self.output["finshell-fit --uniaxial tension.csv --law mooney_rivlin --plot fit.png"]
        values = re.search(r"&material name = 'rubber' law = 'mooney_rivlin' c10 = (\S+) c01 = (\S+) /", text)
        self.assertGreater(float(values.group(1)), 0)
        self.assertGreater(float(values.group(2)), 0)


if __name__ == "__main__":
    unittest.main()
