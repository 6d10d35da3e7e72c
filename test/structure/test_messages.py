#!/usr/bin/env python3
"""Every error message stands in a test, or in untested_messages.txt with a reason; the rule is tested with a planted message."""
import os
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, HERE)
import messages  # noqa: E402


class Messages(unittest.TestCase):
    def test_all_are_expected(self):
        self.assertGreater(len(list(messages.messages(ROOT))), 400)
        found = messages.violations(ROOT, messages.excepted(os.path.join(HERE, "untested_messages.txt")))
        self.assertEqual(found, [], "\n" + "\n".join(found))

    def test_planted(self):
        source = "call raise(error, code, 'the glass is ' &\n   //'empty: '//text_of(n)//' drops') ! call raise('nothing here')\n"
        allowed = {("src/a.f90", "glass"): "a reason"}
        for test, exceptions, expected in (("x = 'the glass is empty'", {}, []), ('x = "is empty: 3 drops"', {}, ["src/a.f90:1"]), ("", {}, ["src/a.f90:1"]),
                                           ("", allowed, []), ("x = 'the glass is empty'", allowed, ["untested_messages.txt"])):
            with self.subTest(test, exceptions=exceptions), tempfile.TemporaryDirectory() as root:
                for name, text in (("src/a.f90", source), ("test/test_a.py", test)):
                    os.makedirs(os.path.dirname(os.path.join(root, name)), exist_ok=True)
                    with open(os.path.join(root, name), "w", encoding="utf-8") as file:
                        file.write(text)
                found = messages.violations(root, exceptions)
                self.assertEqual([f.split(": ")[0] for f in found], expected, found)


if __name__ == "__main__":
    unittest.main()
