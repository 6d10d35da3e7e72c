#!/usr/bin/env python3
"""The command line: several inputs, values set, what results say, help, completions and manual page from one table, exit codes."""
import csv
import os
import pty
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}
STRIP = """&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 8, 1 /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0e6 /
&section material = 'rubber' thickness = 0.1 ! a comment
/
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_x1' vector = 0.0, 0.0,
   20.0 ! upwards
/
&step load_factor = 0.5 /
&step load_factor = 1.0 /
&monitor name = 'tip' quantity = 'displacement' component = 'z' node_set = 'edge_x1' /
"""


class CommandLine(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)
        (self.path / "strip.nml").write_text(STRIP)

    def call(self, *arguments, code=0):
        run = subprocess.run([PROGRAM, *arguments], cwd=self.path, capture_output=True, text=True, check=False, timeout=300, env=ENVIRONMENT)
        self.assertEqual(run.returncode, code, run.stdout + run.stderr)
        self.assertNotIn("Backtrace", run.stderr)
        return run.stdout + run.stderr

    def refuse(self, *arguments):
        *call, words = arguments
        said = self.call(*call, code=2)
        self.assertIn(words, said)
        self.assertTrue(said.startswith("finshell: "), said)
        return said

    def tip(self, name="strip"):
        rows = list(csv.DictReader((self.path / f"{name}.history.csv").read_text().splitlines()))
        return float(rows[-1]["tip"])

    def test_wrong_command_lines(self):
        for *call, words in (
                ("a command is expected: run, check, study, mesh, check-law, convert, restart, info, history, completion or man",),
                ("solve", "strip.nml", "unknown command 'solve'; expected run, check,"),
                ("run", "the command run needs an input file"),
                ("info", "the command info needs the results of a run"),
                ("history", "the command history needs the results of a run"),
                ("check", "a.nml", "b.nml", "one input file is expected, found 'a.nml' and 'b.nml'"),
                ("restart", "a", "b.nml", "c.nml", "one input file is expected, found 'b.nml' and 'c.nml'"),
                ("info", "a", "b", "one name is expected, found 'a' and 'b'"),
                ("completion", "the command completion needs the name of a shell: bash, zsh or fish"),
                ("completion", "tcsh", "no completion for 'tcsh'; expected bash, zsh or fish"),
                ("man", "3", "the command man takes nothing, found '3'"),
                ("run", "strip.nml", "--job", "2", "unknown option '--job', did you mean '--jobs'?"),
                ("run", "strip.nml", "-x", "unknown option '-x'"),
                ("run", "strip.nml", "--quiet=1", "--quiet takes no value"),
                ("run", "strip.nml", "-o", "-o needs the name of a folder"),
                ("run", "strip.nml", "--rung=", "--rung needs a name"),
                ("run", "strip.nml", "--jobs", "0", "--jobs needs a whole number, 1 to 1024, found '0'"),
                ("run", "strip.nml", "-j", "-j needs a whole number, 1 to 1024, found ''"),
                ("run", "strip.nml", "--refine=x", "--refine needs a whole number, -10 to 10, found 'x'"),
                ("check", "strip.nml", "-j", "2", "--jobs belongs to the command run"),
                ("restart", "strip", "--set", "step.load_factor=2", "--set belongs to the commands run, check, study and mesh"),
                ("history", "strip", "--plot", "--plot needs two columns: one along, one upwards; found 0"),
                ("history", "strip", "tip", "--plot", "found 1"),
                ("run", "strip.nml", "--set", "--set needs GROUP.KEY=VALUE, as section.thickness=0.1 or step[2].load_factor=3, found ''"),
                ("run", "strip.nml", "--set", "thickness=1", "found 'thickness=1'"),
                ("run", "strip.nml", "--set", "step[].load_factor=1", "found 'step[].load_factor=1'"),
                ("run", "strip.nml", "--set", "section.thickness=\n", "needs GROUP.KEY=VALUE"),
                ("run", "strip.nml", "--set", "section.thickness=", "--set section.thickness=: a value is missing"),
                ("run", "strip.nml", "--set", "section.thickness=1,,2", "--set section.thickness=1,,2: a value is missing"),
                ("run", "strip.nml", "--set", "job.title='a", "--set job.title='a: a quote is not closed"),
                ("check", "strip.nml", "--set", "section.thickness=1,2", "several values, separated by commas, belong to the command run"),
                ("check", "strip.nml", "--set", "sections.thickness=1",
                 "--set sections.thickness=1: strip.nml has no group &sections; its groups: mesh, material, section, support, load, step, monitor"),
                ("check", "strip.nml", "--set", "step.load_factor=1", "strip.nml has 2 groups &step: say which, as step[2].load_factor"),
                ("check", "strip.nml", "--set", "step[3].load_factor=1", "strip.nml has 2 groups &step and none [3]"),
                ("check", "strip.nml", "--set", "material[steel].mu=1", "strip.nml has 1 group &material and none [steel] (their names: rubber)"),
                ("check", "strip.nml", "--set", "section.thick=1",
                 "strip.nml:4: &section: unknown key thick"),
                ("check", "strip.nml", "--set", "section.thickness=thin", "(with --set section.thickness=thin)"),
                ("run", "strip.nml", "--set", "section.thickness=" + ",".join("1" * 101), "--set", "material.mu=" + ",".join("1" * 101),
                 "--set: more than 10000 runs"),
                ("run", "strip.nml", "strip.nml", "strip.nml and strip.nml would both write strip.history.csv: give one of them another name"),
                ("run", "strip.nml", "none.nml", "cannot open the file 'none.nml'")):
            with self.subTest(call):
                self.refuse(*call, words)

    def test_pointer_to_help(self):
        self.assertTrue(self.refuse("run", "the command run needs an input file").endswith("Try: finshell --help\n"))
        (self.path / "strip.nml").write_text(STRIP.replace("20.0 !", "0.0 !"))
        self.assertIn("finshell: warning: strip.nml:6: &load: it moves nothing", self.call("check", "strip.nml"))

    def test_set(self):
        """The same as the value in the file; and the results, and what is restarted from them, keep what was set."""
        for value, text in (("section.thickness=0.2", STRIP.replace("thickness = 0.1", "thickness = 0.2")),
                            ("load.vector=0 0 -10", STRIP.replace("20.0 ! upwards", "-10.0")),
                            ("step[2].load_factor=1.5", STRIP.replace("load_factor = 1.0", "load_factor = 1.5")),
                            ("material[rubber].mu=2e6", STRIP.replace("1.0e6", "2.0e6")),
                            ("MATERIAL.Law=st_venant_kirchhoff", None),
                            ("mesh.divisions=2*4", STRIP.replace("8, 1", "4, 4")),
                            ("section.thickness=1d0", STRIP.replace("= 0.1", "= 1.0"))):
            with self.subTest(value):
                run = subprocess.run([PROGRAM, "run", "strip.nml", "-q", "--set", value], cwd=self.path, capture_output=True, text=True, check=False)
                if text is None:
                    self.assertEqual(run.returncode, 2)  # the other keys do not fit: what was set has been read
                    self.assertIn(f"(with --set {value})", run.stderr)
                    continue
                self.assertEqual(run.returncode, 0, run.stderr)
                (self.path / "other.nml").write_text(text)
                self.call("run", "other.nml", "-q")
                self.assertEqual((self.path / "strip.history.csv").read_text(), (self.path / "other.history.csv").read_text())
                self.assertIn("Set on the command line: " + value, self.call("info", "strip"))
        self.call("run", "strip.nml", "-q", "--set", "section.thickness=0.2", "--set=output.restart=every", "--set", "job.title=it's")
        before = (self.path / "strip.history.csv").read_text()
        self.assertIn("Title: it's", self.call("info", "strip").replace("''", "'"))
        self.call("restart", "strip", "--from", "2", "-q")
        self.assertEqual((self.path / "strip.history.csv").read_text(), before)
        said = self.call("check", "strip.nml", "--set", "mesh.divisions=4 2")
        self.assertIn("15 nodes", said)
        self.call("study", "strip.nml", "-q", "--set", "section.thickness=0.3", "--levels", "2")
        self.assertIn("15 nodes, 16 triangles", self.call("mesh", "strip.nml", "--set", "mesh.divisions=4 2"))

    def test_lines_stay(self):
        """Behind values over several lines that were replaced, errors have the lines of the file."""
        (self.path / "strip.nml").write_text(STRIP + "&monitor name = 'q' quantity = 'nothing' /\n")
        self.refuse("check", "strip.nml", "--set", "load.vector=0 0 1", "strip.nml:12: &monitor quantity = 'nothing'")

    def test_sweep(self):
        said = self.call("run", "strip.nml", "--set", "section.thickness=0.1,0.2", "--set", "material.mu=1e6, 2e6", "--jobs", "2")
        rows = list(csv.DictReader((self.path / "strip.sweep.csv").read_text().splitlines()))
        self.assertEqual([r["run"] for r in rows], ["strip.1", "strip.2", "strip.3", "strip.4"])
        self.assertEqual([(float(r["section.thickness"]), float(r["material.mu"])) for r in rows], [(0.1, 1e6), (0.1, 2e6), (0.2, 1e6), (0.2, 2e6)])
        for row in rows:
            self.assertEqual(row["outcome"], "done")
            self.assertEqual(float(row["load_factor"]), 1)
            self.assertEqual(float(row["tip"]), self.tip(row["run"]))
            self.assertRegex(said, re.escape(row["run"]) + rf" +done +1\.0+ +{row['increments']} +{row['iterations']} ")
        self.call("run", "strip.nml", "-q", "--set", "section.thickness=0.2", "--set", "material.mu=1e6")
        self.assertEqual(self.tip(), float(rows[2]["tip"]))
        self.assertEqual(len(re.findall(r"^\d of 4: strip\.\d done$", said, re.M)), 4)

    def test_worst_exit_code(self):
        """A run that is wrong, one that stops, one that is done."""
        for thickness, words, code in (("0.1,-1", "strip.2: strip.nml:3: &section thickness = -1: expected a number greater than", 2),
                                       ("0.1,0.2", "", 0)):
            said = self.call("run", "strip.nml", "-q", "--set", "section.thickness=" + thickness, code=code)
            self.assertIn(words, said)
            self.assertRegex(said, r"strip\.1 +done")
        said = self.call("run", "strip.nml", "-q", "--set", "step[2].maximum_increments=1,100", "--set", "step[2].first_increment=0.1", code=1)
        self.assertRegex(said, r"strip\.1 +stopped early +0\.6")
        self.assertIn("the step is not finished after 1 increments, the most that are allowed", said)
        rows = list(csv.DictReader((self.path / "strip.sweep.csv").read_text().splitlines()))
        self.assertEqual([r["outcome"] for r in rows], ["stopped early", "done"])
        for name in ("a", "b", "c"):
            (self.path / f"{name}.nml").write_text(STRIP)
        (self.path / "res").mkdir()
        said = self.call("run", "a.nml", "b.nml", "c.nml", "-o", "res", "--jobs=1")
        self.assertRegex(said, r"(?s)a +done.*b +done.*c +done")
        self.assertFalse(list(self.path.glob("res/*.sweep.csv")))
        self.assertEqual((self.path / "res/c.history.csv").read_text(), (self.path / "res/a.history.csv").read_text())

    def test_check(self):
        """Loads by hand: a line of 1, a pressure on an area of 10, a weight."""
        text = STRIP.replace("law = 'neo_hookean'", "law = 'neo_hookean' density = 3.0") + """&load type = 'pressure' pressure = 2.0 /
&load type = 'gravity' vector = 0, -9, 0 /
&load type = 'moment' node_set = 'edge_x1' vector = 1, 2, 3 total = .true. /
"""
        (self.path / "strip.nml").write_text(text)
        said = self.call("check", "strip.nml")
        for kind, force, moment in (("line, edge_x1", (0, 0, 20), (10, -200, 0)), ("pressure, all", (0, 0, 20), (10, -100, 0)),
                                    ("gravity, all", (0, -27, 0), (0, 0, -135)), ("force, edge_x1", (0, 0, 0), (1, 2, 3))):
            found = re.search(re.escape(kind) + r"\) at a factor of 1: force \((.*)\), moment about the origin \((.*)\)", said)
            self.assertTrue(found, kind + said)
            for numbers, expected in ((found[1], force), (found[2], moment)):
                for a, b in zip(numbers.split(","), expected):
                    self.assertAlmostEqual(float(a), b, delta=1e-4 * 200, msg=said)
        for words in ("18 nodes, 16 triangles, 1 connected part", "smallest angle", "edge_x1: 1 edges", "Rigid-body motions: none is free",
                      "GB of memory", "s of CPU time for a factorisation", "complete and consistent"):
            self.assertIn(words, said)
        free = STRIP.replace("mu = 1.0e6", "mu = 1.0e6 density = 1.0").replace("type = 'clamped'", "fixed = 'ux', 'uy', 'rz'") \
            .replace("&step load_factor = 0.5 /\n&step load_factor = 1.0 /", "&step control = 'frequencies' /")
        (self.path / "strip.nml").write_text(free)
        self.assertIn("Free: the supports leave a rigid-body motion free: translation along z", self.call("check", "strip.nml"))

    def test_info_and_history(self):
        self.refuse("info", "strip", "strip: there are no results of this name: no .history.csv, no .vtkhdf, no .restart")
        self.refuse("history", "strip", "strip.history.csv: cannot read the history file")
        self.call("run", "strip.nml", "-q", "--set", "job.title='A strip'")
        for name in ("strip", "strip.vtkhdf", "strip.restart", "strip.history.csv", "./strip.xdmf"):
            said = self.call("info", name)
            for words in ("Input: ", "strip.nml", "Title: A strip", "Step 2: load_factor = 1.0", "finshell 0.1.0: 18 nodes, 16 elements",
                          "On nodes: displacement", "increments", "load factor 1.000000E+00", f"tip = {self.tip():.6f}"[:12], "It ended so: done",
                          "Can go on from increment"):
                self.assertIn(words, said)
        said = self.call("history", "strip")
        rows = list(csv.DictReader((self.path / "strip.history.csv").read_text().splitlines()))
        lines = said.splitlines()
        self.assertEqual(lines[0].split(), ["increment", "load_factor", "iterations", "tip"])
        self.assertEqual(len({len(line) for line in lines}), 1)
        for line, row in zip(lines[1:], rows, strict=True):
            self.assertAlmostEqual(float(line.split()[3]), float(row["tip"]), delta=1e-6 * abs(float(row["tip"])))
        self.assertEqual(self.call("history", "strip.vtkhdf", "tip", "residual").splitlines()[0].split(), ["tip", "residual"])
        plot = self.call("history", "strip", "load_factor", "tip", "--plot")
        self.assertEqual(plot.splitlines()[0], "tip")
        self.assertGreaterEqual(plot.count("*"), 4)
        self.assertIn("load_factor", plot.splitlines()[-1])
        self.refuse("history", "strip", "tipp", "no column 'tipp', did you mean 'tip'?; columns: increment, load_factor,")
        shutil.copy(self.path / "strip.history.csv", self.path / "alone.history.csv")
        self.assertIn("it has written no fields", self.call("info", "alone"))
        said = self.call("run", "strip.nml", "-q", "--set", "step[1].maximum_increments=1", "--set", "step[1].first_increment=0.1", code=1)
        self.assertIn("It ended so: stopped early: ", self.call("info", "strip"))
        (self.path / "empty.history.csv").write_text((self.path / "strip.history.csv").read_text().splitlines()[0] + "\n")
        self.refuse("history", "empty", "empty.history.csv: no increment has converged yet")
        self.assertIn("No increment has converged.", self.call("info", "empty"))

    def test_plot_of_anything(self):
        """Constant values, missing ones, huge ones."""
        for values in (["1.0", "1.0"], ["NaN", "2.0"], ["NaN", "NaN"], ["1e300", "-1e300"], ["0.0", "0.0"], ["1e-310", "0.0"], ["-5e-3", "7.0"]):
            with self.subTest(values):
                text = "increment,load_factor,q\n" + "".join(f"{i + 1},{i}.0,{v}\n" for i, v in enumerate(values))
                (self.path / "x.history.csv").write_text(text)
                plot = self.call("history", "x", "load_factor", "q", "--plot")
                finite = sum(v != "NaN" for v in values)
                self.assertEqual(plot.count("*"), finite)
                self.assertNotIn("NaN", plot)
                if finite == 0:
                    self.assertIn("No row has both values.", plot)
                self.call("history", "x")

    def test_one_table(self):
        """Help, manual page and completions name the same commands and options; every page tells every exit code."""
        said = self.call("--help")
        options = sorted(set(re.findall(r"--[a-z-]+", said.split("\nOptions\n")[1].split("\nExit codes\n")[0])))
        commands = sorted(set(re.findall(r"^  finshell ([a-z]+)", said, re.M)))
        self.assertGreater(len(options), 11)
        self.assertGreater(len(commands), 9)
        man = self.call("man").replace(r"\-", "-")
        shells = {shell: self.call("completion", shell) for shell in ("bash", "zsh", "fish")}
        for text in (man, shells["bash"], shells["zsh"]):
            for word in commands:
                self.assertIn(word, text)
            for word in options:
                if word not in ("--help", "--version") or text is man:
                    self.assertIn(word, text)
        for word in options:
            self.assertIn("-l " + word[2:], shells["fish"])
        doc = (SOURCE / "doc" / "command_line.md").read_text()
        for word in options + ["finshell " + c for c in commands]:
            self.assertIn(word, doc)
        codes = re.findall(r"^  (\d+) +(\S.*)$", said.split("Exit codes")[1], re.M)
        self.assertEqual([c for c, text in codes], ["0", "1", "2", "3"])
        for code, text in codes:
            self.assertIn(text.replace("-", ""), man.replace("-", ""))
            self.assertIn(f"| {code} | {text} |", doc)
        self.assertEqual(self.call("-h"), said)
        self.assertEqual(self.call("help"), said)
        self.assertEqual(self.call("version"), self.call("-V"))

    def test_manual_page(self):
        (self.path / "finshell.1").write_text(self.call("man"))
        tried = 0
        for command in (["groff", "-man", "-ww", "-Tutf8", "finshell.1"], ["man", "--warnings", "-l", "finshell.1"], ["mandoc", "-Tlint", "finshell.1"]):
            if not shutil.which(command[0]):
                continue
            tried += 1
            run = subprocess.run(command, cwd=self.path, capture_output=True, text=True, check=False, env={**os.environ, "MANWIDTH": "100"})
            self.assertEqual((run.returncode, run.stderr), (0, "") if command[0] != "mandoc" else (run.returncode, run.stderr))
            if command[0] != "mandoc":
                self.assertIn("EXIT STATUS", re.sub(r"\x1b\[[0-9;]*m|.\x08", "", run.stdout))
        if tried == 0:
            self.assertTrue(self.call("man").startswith(".TH FINSHELL 1"))

    def test_completions_run(self):
        """Shells that are there read their completion; bash completes with it."""
        (self.path / "deck.inp").write_text("")
        for shell in ("bash", "zsh", "fish"):
            (self.path / shell).write_text(self.call("completion", shell))
            if shutil.which(shell):
                run = subprocess.run([shell, "-n", shell], cwd=self.path, capture_output=True, text=True, check=False)
                self.assertEqual((run.returncode, run.stderr), (0, ""))
        if not shutil.which("bash"):
            return

        def complete(*words):
            script = 'source ./bash; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _finshell; printf "%s\\n" "${COMPREPLY[@]}"'
            return subprocess.run(["bash", "-c", script, "bash", *words], cwd=self.path, capture_output=True, text=True, check=True).stdout.split()
        self.assertEqual(complete("finshell", "re"), ["restart"])
        self.assertEqual(complete("finshell", "run", "--re"), ["--refine"])
        self.assertEqual(complete("finshell", "run", "st"), ["strip.nml"])
        self.assertEqual(complete("finshell", "convert", ""), ["deck.inp"])
        self.assertEqual(complete("finshell", "completion", "z"), ["zsh"])

    def test_progress_on_a_terminal(self):
        """One line that is written anew on a terminal; none elsewhere, none with -q."""
        def seen(*more):
            leader, follower = pty.openpty()
            run = subprocess.Popen([PROGRAM, "run", "strip.nml", *more], cwd=self.path, stdout=follower, stderr=follower, env=ENVIRONMENT)
            os.close(follower)
            text = b""
            while True:
                try:
                    part = os.read(leader, 4096)
                except OSError:
                    break
                if not part:
                    break
                text += part
            os.close(leader)
            self.assertEqual(run.wait(timeout=300), 0)
            return text.decode()
        text = seen()
        lines = re.findall("\r\x1b\\[K  (step [^\r\n]*)", text)
        self.assertGreater(len(lines), 4)
        for line in lines:
            self.assertRegex(line, r"^step [12] of 2: \d{1,3} %(, about \d+ s left)?$")
        self.assertTrue(any("s left" in line for line in lines))
        self.assertIn("step 2 of 2: 100 %, about 0 s left", text)
        for line in re.findall("[^\n]*\n", text):  # nothing stays of it
            self.assertNotIn("%", line.split("\x1b[K")[-1].replace("norm: ", "%").split("%")[0])
        self.assertNotIn("\x1b", seen("-q"))
        self.assertNotIn("\x1b", self.call("run", "strip.nml"))
        self.assertIn("runs: strip.", seen("--set", "section.thickness=0.1,0.2"))


if __name__ == "__main__":
    unittest.main()
