#!/usr/bin/env python3
"""`check` finds what `run` would refuse, with file and line; loads that do nothing are named; resources that are not there cost a sentence."""
import os
import resource
import subprocess
import tempfile
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
MESH = "&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 4, 1 /\n"
REST = """&material name = 'rubber' law = 'neo_hookean' mu = 1.0e6 /
&section material = 'rubber' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
"""
FORCE = "&load type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0, 1.0 /\n"
TIP = "node_set = 'edge_x1' component = 'z' displacements = 0.1"


class Check(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def run_text(self, text, command="check", memory=None, threads=None):
        (Path(self.folder.name) / "model.nml").write_text(text)
        preexec = (lambda: resource.setrlimit(resource.RLIMIT_AS, (memory, memory))) if memory else None
        environment = {**os.environ, **({"OMP_NUM_THREADS": threads} if threads else {})}
        return subprocess.run([PROGRAM, command, "-q", "model.nml"], cwd=self.folder.name, capture_output=True, text=True, timeout=300, check=False,
                              preexec_fn=preexec, env=environment)

    def test_crossed_cells(self):
        """Crossed cells longer than wide are named before the run; others, and other diagonals, are not."""
        for divisions, diagonal, warned in (("8, 16", "cross", True), ("16, 8", "cross", True), ("20, 2", "cross", False), ("8, 16", "alternating", False)):
            mesh = MESH.replace("4, 1", divisions).replace(" /", f" diagonal = '{diagonal}' /")
            result = self.run_text(mesh + REST + FORCE + "&step /\n")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual("crossed cells" in result.stderr, warned, (divisions, diagonal, result.stderr))

    def refuse(self, text, *words):
        """Refused by check and by run, in the same sentence, and nothing is written."""
        messages = []
        for command in ("check", "run"):
            result = self.run_text(text, command)
            self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
            self.assertEqual(result.stdout, "")
            messages.append(result.stderr)
            self.assertEqual([p.name for p in Path(self.folder.name).iterdir()], ["model.nml"])
        self.assertEqual(messages[0], messages[1])
        self.assertEqual(len(messages[0].strip().splitlines()), 1, messages[0])
        for word in words:
            self.assertIn(word, messages[0])

    def steps(self, step, words, load=FORCE, line=None):
        lines = len((MESH + REST + load).splitlines())
        with self.subTest(step=step, load=load):
            self.refuse(MESH + REST + load + f"&step {step} /\n", f"model.nml:{line or lines + 1}: ", *words)

    def test_steps_that_cannot_be_followed(self):
        self.steps("control = 'volume' volumes = 1.0", ["no pressure scales"])
        self.steps("control = 'volume' volumes = 1.0", ["do not enclose a volume"], "&load type = 'pressure' pressure = 1.0 /\n")
        self.steps("control = 'arc_length' volumes = 1.0", ["no pressure scales"])
        self.steps("control = 'displacement' node_set = 'edge_x0' component = 'z' displacements = 0.1", ["edge_x0", "held by the supports"])
        self.steps("node_set = 'edge_x0' component = 'x' displacements = 0.1", ["held by the supports"])
        self.steps("control = 'displacement' node_set = 'edge_x9' component = 'z' displacements = 0.1", ["edge_x9", "edge_x1"])
        self.steps("load_factor = 0.5 /\n&step control = 'volume' volumes = 1.0", ["no pressure scales"], line=7)

    def test_steps_that_need_a_load(self):
        held = "&load type = 'force' node_set = 'edge_x0' vector = 0.0, 0.0, 1.0 /\n"
        for load in ("", held, FORCE.replace("1.0 /", "1.0 constant = .true. /"), FORCE.replace("1.0 /", "0.0 /"),
                     "&load type = 'pressure' pressure = 0.0 /\n", "&load type = 'moment' node_set = 'edge_x0' vector = 0.0, 1.0, 0.0 /\n"):
            for step, name in (("control = 'buckling'", "buckling"), ("control = 'arc_length'", "arc-length"),
                               ("control = 'displacement' " + TIP, "displacement control")):
                self.steps(step, [name, "needs a load"], load)

    def test_moment_that_is_not_conservative(self):
        self.steps("control = 'buckling'", ["buckling: a moment acts at node 9"], FORCE + "&load type = 'moment' node_set = 'corner_x1_y0' vector = 0.0, 1.0, 0.0 /\n")

    def test_loads_have_their_line(self):
        self.steps("load_factor = 1.0", ["&load: the pressure on 'all' has no symmetric"],
                   FORCE + "&load type = 'pressure' pressure = 1.0 stiffness = 'symmetric' /\n", line=6)

    def test_unknown_sets_everywhere(self):
        good = MESH + REST + FORCE + "&step /\n"
        for group in ("&load type = 'force' node_set = 'nowhere' vector = 1.0, 0.0, 0.0 /", "&load type = 'line' edge_set = 'nowhere' vector = 1.0, 0.0, 0.0 /",
                      "&load type = 'pressure' element_set = 'nowhere' pressure = 1.0 /", "&support node_set = 'nowhere' type = 'clamped' /",
                      "&step " + TIP.replace("edge_x1", "nowhere") + " /", "&step control = 'volume' volumes = 1.0 element_set = 'nowhere' /",
                      "&monitor name = 'a' quantity = 'reaction' component = 'x' node_set = 'nowhere' /",
                      "&monitor name = 'a' quantity = 'thickness_stretch' element_set = 'nowhere' /", "&node_set name = 'a' node_set = 'nowhere' /",
                      "&node_set name = 'a' element_set = 'nowhere' /", "&element_set name = 'a' element_set = 'nowhere' /",
                      "&section thickness = 1.0 element_set = 'nowhere' /"):
            with self.subTest(group=group):
                self.refuse(good + group + "\n", "model.nml:7: ", "nowhere", "edge_x0" if "edge_set" in group else "all")

    def warned(self, text, *words, commands=("check", "run")):
        for command in commands:
            result = self.run_text(text, command)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(result.stderr.count("warning"), 1 if words else 0, result.stderr)
            for word in words:
                self.assertIn(word, result.stderr)

    def test_what_does_nothing_is_named(self):
        self.warned(MESH + REST + "&step /\n", "model.nml: nothing acts")
        self.warned(MESH + REST + FORCE + FORCE.replace("edge_x1", "edge_x0") + "&step /\n", "model.nml:6: &load: it moves nothing")
        self.warned(MESH + REST + FORCE.replace("1.0 /", "0.0 /") + "&step /\n", "model.nml:5: &load: it moves nothing")
        self.warned(MESH + REST + FORCE + "&step /\n")
        self.warned(MESH + REST + "&support node_set = 'edge_x1' uz = 0.1 /\n&step /\n")
        # held along the turned axis in which the force acts; free along the other one
        axes = "axes = 'given' axis_1 = 1.0, 1.0, 0.0 axis_2 = -1.0, 1.0, 0.0 /\n"
        force = "&load type = 'force' node_set = 'edge_x1' vector = 1.0, {}, 0.0 /\n&step /\n"
        self.warned(MESH + REST + "&support node_set = 'edge_x1' fixed = 'ux' " + axes + force.format("1.0"), "model.nml:6: &load: it moves nothing",
                    commands=["check"])
        self.warned(MESH + REST + "&support node_set = 'edge_x1' fixed = 'ux' " + axes + force.format("0.99"))

    def test_threads(self):
        good = MESH + REST + FORCE + "&step /\n"
        self.refuse("&job threads = 100000 /\n" + good, "model.nml:1: ", "threads", "1024")
        for text, threads in (("&job threads = 1024 /\n" + good, None), (good, "100000")):
            result = self.run_text(text, "run", threads=threads)
            self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_models_too_large(self):
        """Refused before anything is made of them: in no more CPU time than a few runs of a small model."""
        def spent():
            usage = resource.getrusage(resource.RUSAGE_CHILDREN)
            return usage.ru_utime + usage.ru_stime

        start = spent()
        self.run_text(MESH + REST + FORCE + "&step /\n")
        small = spent() - start
        for size in ("1000, 1000", "100000, 100000", "46000, 46000"):
            start = spent()
            result = self.run_text(MESH.replace("4, 1", size) + REST + FORCE + "&step /\n", memory=4_000_000_000)
            self.assertLess(spent() - start, 10 * small)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn("model.nml:1: &mesh: the model has", result.stderr)
            self.assertIn("GB of memory", result.stderr)
            self.assertEqual(len(result.stderr.strip().splitlines()), 1, result.stderr)
        disk = "&mesh generator = 'disk' radius = 1.0 rings = 2000 /\n"
        self.assertIn("GB of memory", self.run_text(disk + REST + FORCE + "&step /\n", memory=4_000_000_000).stderr)

    def test_out_of_memory(self):
        """Wherever it runs out: a sentence, no backtrace, no signal."""
        text = MESH.replace("4, 1", "60, 30") + REST + FORCE + "&step control = 'linear' /\n"
        codes = set()
        for megabytes in (70, 90, 110, 130, 150, 170, 200, 250, 400):
            result = self.run_text(text, "run", memory=megabytes * 1_000_000, threads="1")
            codes.add(result.returncode)
            self.assertIn(result.returncode, (0, 1, 2, 127), f"{megabytes} MB: {result.stderr}")
            self.assertNotIn("Backtrace", result.stderr)
            if result.returncode:
                self.assertRegex(result.stderr.lower(), "memory|thread creation failed|cannot allocate|error while loading")
        self.assertIn(0, codes)


if __name__ == "__main__":
    unittest.main()
