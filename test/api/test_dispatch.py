#!/usr/bin/env python3
"""One library for several processors: what is common runs on any x86-64, each copy of the kernel refers to itself alone, and all
copies give the same results up to rounding."""
import os
import re
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import installed  # noqa: E402

FOLDER = os.path.join(installed.BINARY, "dispatch")
LIBRARY = os.environ.get("FINSHELL_LIB", "")
LEVELS = (1, 3, 4)
# Every law through a stretched, bent and twisted patch: level, then all numbers as they are in memory.
PROGRAM = """
import finshell, numpy as np
from finshell import _library
rng = np.random.default_rng(1)
X = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]) + 0.1 * rng.normal(size=(20, 3, 3))
u, t = 0.1 * rng.normal(size=(20, 3, 3)), 0.3 * rng.normal(size=(20, 3, 3))
numbers = []
for name in finshell.material_names():
    values = {p.name: p.example for p in finshell.material_parameters(name) if p.required or p.example != p.default}
    r = finshell.Section(name, values, 0.1).evaluate(X, u, t)
    numbers += [r.energy, r.force.ravel(), r.tangent.ravel()]
print(_library.library().finshell_cpu_level(), np.concatenate(numbers).tobytes().hex())
"""


class Dispatch(unittest.TestCase):
    def test_copies_refer_to_themselves(self):
        for level in LEVELS:
            needed = installed.run("nm", "--undefined-only", os.path.join(FOLDER, f"kernel_{level}.o"))
            self.assertEqual(re.findall(r"\S*finshell\S*", needed), [])

    def test_common_part_runs_on_any_processor(self):
        # the names of the registers that only AVX and AVX-512 have
        archive = os.path.join(os.path.dirname(LIBRARY), "libfinshell.a")
        wide = set()
        for part in re.split(r"\n(?=\S+:\s+file format)", installed.run("objdump", "-d", "--no-show-raw-insn", archive)):
            if re.search(r"%[yz]mm\d|\tv[a-z0-9]+ .*%xmm", part):
                wide.add(re.match(r"\s*(?:In archive .*\n\n)?(\S+):", part).group(1))
        self.assertEqual(wide, {"kernel_3.o", "kernel_4.o"})

    def test_levels_agree(self):
        import numpy as np
        found = {}
        for wanted in LEVELS:
            environment = dict(os.environ, FINSHELL_CPU_LEVEL=str(wanted), PYTHONPATH=os.path.join(installed.SOURCE, "api", "python"))
            level, numbers = installed.run(sys.executable, "-c", PROGRAM, env=environment).split()
            self.assertLessEqual(int(level), wanted)
            found[int(level)] = np.frombuffer(bytes.fromhex(numbers))
        self.assertIn(1, found)
        for level, numbers in found.items():
            with self.subTest(level=level):
                scale = np.abs(found[1]).max()
                np.testing.assert_allclose(numbers, found[1], rtol=1e-10, atol=1e-13 * scale)
                # fused multiply-adds round differently: so these are other instructions indeed
                self.assertEqual((numbers == found[1]).all(), level == 1)

    def test_a_wrong_level_is_ignored(self):
        environment = dict(os.environ, PYTHONPATH=os.path.join(installed.SOURCE, "api", "python"))
        show = "from finshell import _library; print(_library.library().finshell_cpu_level())"
        best = installed.run(sys.executable, "-c", show, env={k: v for k, v in environment.items() if k != "FINSHELL_CPU_LEVEL"})
        for wrong in ("", "2", "9", "x86-64", "11", "-1"):
            self.assertEqual(installed.run(sys.executable, "-c", show, env=dict(environment, FINSHELL_CPU_LEVEL=wrong)), best)


if __name__ == "__main__":
    if not os.path.isdir(FOLDER):
        print("the library was compiled for one processor")
        sys.exit(77)
    unittest.main()
