#!/usr/bin/env python3
"""The gallery: every example in its list exists, and one goes all the way to the page."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "doc" / "site"))
import gallery  # noqa: E402


class Gallery(unittest.TestCase):
    def test_examples_exist(self):
        names = [picture.example for picture in gallery.PICTURES]
        self.assertEqual(len(set(names)), len(names))
        for picture in gallery.PICTURES:
            self.assertTrue((SOURCE / "examples" / picture.example / picture.input).is_file(), picture)

    def test_one_picture(self):
        environment = {**os.environ, "PYTHONPATH": str(SOURCE / "api" / "python")}
        with tempfile.TemporaryDirectory() as folder:
            for words in (("gallery.py", f"{folder}/pictures", "scordelis_lo"), ("assemble.py", f"{folder}/source", f"{folder}/pictures")):
                subprocess.run([sys.executable, str(SOURCE / "doc" / "site" / words[0]), *words[1:]], check=True, env=environment, stdout=subprocess.PIPE)
            page = (Path(folder) / "source" / "gallery.md").read_text(encoding="utf-8")
            self.assertIn("](gallery/scordelis_lo.png)", page)
            self.assertIn("(examples/scordelis_lo.md)", page)
            self.assertIn("finshell-plot scordelis_lo -o scordelis_lo.png --deformed auto", page)
            self.assertGreater((Path(folder) / "source" / "gallery" / "scordelis_lo.png").stat().st_size, 20000)


if __name__ == "__main__":
    unittest.main()
