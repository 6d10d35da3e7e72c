#!/usr/bin/env python3
"""What is off is not computed: instructions of a run, procedure by procedure, counted by valgrind's callgrind."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(os.environ["FINSHELL_SOURCE_DIR"]) / "bench"))
from instructions import count  # noqa: E402

DISK = """&mesh generator = 'disk' radius = 7.5 rings = 3 portion = 'quarter' /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0 /
&section material = 'rubber' thickness = 0.5 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'pressure' pressure = 10.0 /
&step load_factor = 1.0 {step} /
&output {output} /
"""
# procedures of the program, by switch
RECOVERY = r"finshell_recovery_MOD|finshell_field_batch_MOD|finshell_element_fields_MOD_(?!element_fields(__\d)?$)|finshell_element_field_MOD_field_value"
FILES = r"finshell_results_MOD_(?!close)|finshell_xdmf_MOD_(?!close)|^H5|deflate"
ENERGIES = r"_MOD_(?!standing_)\w*energ|finshell_ledger_MOD_balance"   # what loads store is one number, summed with their forces
STABILITY = r"finshell_arpack|finshell_locate_MOD_(?!is|may|mark)"   # mark: whether there is anything to locate


@unittest.skipUnless(shutil.which("valgrind"), "valgrind is not installed")
class Off(unittest.TestCase):
    def run_with(self, output="every = 0", step="", more=""):
        """Instructions by procedure."""
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "in.nml").write_text(DISK.format(output=output, step=step) + more)
            return count([os.environ["FINSHELL_BIN"], "run", "-q", "in.nml"], folder)

    def spent(self, counts, pattern):
        return Counter({name: n for name, n in counts.items() if re.search(pattern, name)})

    def test_fields(self):
        """No result file and no monitor of elements: nothing is recovered, nothing written but the history."""
        off = self.run_with()
        self.assertGreater(sum(self.spent(off, "evaluate_block").values()), 1000)
        self.assertEqual(self.spent(off, RECOVERY), {})
        self.assertEqual(self.spent(off, FILES), {})
        moved = self.run_with("fields = 'displacement'")    # as the nodes have it
        self.assertEqual(self.spent(moved, RECOVERY), {})
        self.assertGreater(sum(self.spent(moved, FILES).values()), 1000)
        on = self.run_with("fields = 'stress'")
        self.assertGreater(sum(self.spent(on, RECOVERY).values()), 10000)
        # the price is that of the switch: what is left is the same
        rest = [sum(c.values()) - sum(self.spent(c, "|".join((RECOVERY, FILES))).values()) for c in (off, on)]
        self.assertLess(rest[0], rest[1])
        watched = self.run_with(more="&monitor name = 's' quantity = 'stress' component = '11' node_set = 'centre' /\n")
        some, every = (sum(self.spent(c, "recover_fields").values()) for c in (watched, on))
        self.assertGreater(some, 0)
        self.assertLess(some, 0.4 * every)                  # of the elements at the centre only

    def test_energies(self):
        """The stored energy is added up for the account of snaps and for monitors only."""
        off = self.run_with(step="snap = 'ignore' descent = .false.")
        self.assertEqual(self.spent(off, ENERGIES), {})
        on = self.run_with()
        self.assertGreater(sum(self.spent(on, ENERGIES).values()), 1000)
        self.assertLess(sum(on.values()), 1.02 * sum(off.values()))
        asked = self.run_with(step="snap = 'ignore' descent = .false.", more="&monitor name = 'e' quantity = 'energy' /\n")
        self.assertGreater(sum(self.spent(asked, ENERGIES).values()), 1000)

    def test_critical_points(self):
        self.assertEqual(self.spent(self.run_with(), STABILITY), {})


if __name__ == "__main__":
    unittest.main()
