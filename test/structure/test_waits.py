#!/usr/bin/env python3
"""No verdict depends on how fast a machine is or on chance: what tests wait for is waited for long, none compares seconds with a number, and random
numbers are those of support_element, the same in every run and everywhere (gfortran's own are not)."""
import re
import unittest
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
SHORT = re.compile(r"(?:timeout=|(?:time|perf_counter|monotonic)\(\) \+ )\d{1,2}\b")
COMPARED = re.compile(r"assertLess(?:Equal)?\([^#]*(?:\btime\.\w+\(\)|\b(?:seconds|duration|elapsed)\b)")


def found(text):
    return [line.strip() for line in text.splitlines() if SHORT.search(line) or COMPARED.search(line)]


class Waits(unittest.TestCase):
    def test_none_is_short(self):
        files = [path for path in TESTS.rglob("*.py") if path != Path(__file__).resolve()]
        self.assertGreater(len(files), 50)
        self.assertEqual({str(path): lines for path in files if (lines := found(path.read_text()))}, {}, "a guard against hanging waits 100 s or more; speed is for bench/")

    def test_random_numbers_are_reproducible(self):
        texts = {path: path.read_text() for suffix in ("pf", "f90", "F90") for path in TESTS.rglob(f"*.{suffix}")}
        self.assertGreater(sum("uniform_array" in text for text in texts.values()), 5)
        self.assertEqual([str(path) for path, text in texts.items() if "random_number" in text], [], "uniform of support_element is the same in every run")

    def test_planted(self):
        for line in ("run.wait(timeout=60)", "deadline = time.time() + 30", "self.assertLess(time.time() - began, 5)", "self.assertLess(seconds, 1.0)"):
            self.assertEqual(found(line), [line])
        for line in ("run.wait(timeout=300)", "deadline = time.time() + 300", "self.assertLess(error, 5)"):
            self.assertEqual(found(line), [])


if __name__ == "__main__":
    unittest.main()
