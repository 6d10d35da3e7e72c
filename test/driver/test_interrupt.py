#!/usr/bin/env python3
"""Ctrl-C: a run stops after its increment with everything saved, goes on bit for bit, and says so by its exit code."""
import os
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}
MONITOR = "&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /\n"
DISK = """&job name = 'r' /
&mesh generator = 'disk' radius = 7.5 rings = 12 portion = 'quarter' /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0 density = 1.0e-3 /
&section thickness = 0.5 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'pressure' pressure = 10.0 /
""" + MONITOR
CASES = {
    "volume": DISK + "&step control = 'volume' volumes = 60.0, 150.0 first_increment = 1.0 largest_increment = 1.0 /\n",
    "constant": DISK + "&load type = 'traction' vector = 0, 0, 1.0 constant = .true. /\n"
                       "&step control = 'arc_length' load_factor = 0.5 first_increment = 0.004 largest_increment = 0.004 /\n",
    "dynamic": DISK + "&step control = 'dynamic' duration = 0.2 first_increment = 0.001 automatic = .false. maximum_increments = 9999 /\n",
    "explicit": DISK.replace("= 10.0 /", "= 0.5 /") + "&step control = 'explicit' duration = 1.0 history_rows = 7 maximum_increments = 1000000 /\n",
}


def started(folder, *arguments):
    """The program, with signals as a shell leaves them."""
    def default():
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
    return subprocess.Popen([PROGRAM, *arguments], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=default,
                            env=ENVIRONMENT)


class Interrupt(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)

    def solve(self, *arguments, code=0):
        run = subprocess.run([PROGRAM, *arguments], cwd=self.path, capture_output=True, text=True, check=False, timeout=300, env=ENVIRONMENT)
        self.assertEqual(run.returncode, code, run.stdout + run.stderr)
        return run.stdout + run.stderr

    def rows(self, folder):
        return len((self.path / folder / "r.history.csv").read_text().splitlines()) - 1

    def interrupt_after(self, run, rows, folder, how=signal.SIGINT):
        """Send a signal once the history has so many rows; exit code and what was said."""
        while run.poll() is None:
            try:
                if self.rows(folder) >= rows:
                    break
            except FileNotFoundError:
                pass
            time.sleep(0.001)
        run.send_signal(how)
        said = "".join(run.communicate(timeout=120))
        return run.returncode, said

    def test_stops_and_goes_on(self):
        for number, (name, text) in enumerate(CASES.items()):
            for output in ("", "&output restart = 'every' every = 3 /\n") if name == "volume" else ("",):
                with self.subTest(name, output=output):
                    for folder in ("whole", "parts"):
                        shutil.rmtree(self.path / folder, ignore_errors=True)
                        (self.path / folder).mkdir()
                    (self.path / "r.nml").write_text(text + output)
                    self.solve("run", "r.nml", "-q", "-o", "whole")
                    code, said = self.interrupt_after(started(self.path, "run", "r.nml", "-q", "-o", "parts"), 2, "parts",
                                                      signal.SIGTERM if number % 2 else signal.SIGINT)
                    self.assertEqual(code, 3, said)
                    self.assertIn("finshell: interrupted: finshell restart parts/r goes on from here", said)
                    self.assertIn("STOPPED EARLY", said)
                    self.assertIn("It ended so: interrupted", self.solve("info", "parts/r"))
                    first = self.rows("parts")
                    self.assertGreaterEqual(first, 2)
                    self.assertLess(first, self.rows("whole"))
                    # once more, then to the end
                    code, said = self.interrupt_after(started(self.path, "restart", "parts/r", "-q"), first + 1, "parts")
                    self.assertEqual(code, 3, said)
                    self.assertLess(self.rows("parts"), self.rows("whole"))
                    self.solve("restart", "parts/r.vtkhdf", "-q")
                    self.assertIn("It ended so: done", self.solve("info", "parts/r"))
                    self.assertEqual((self.path / "parts/r.history.csv").read_text(), (self.path / "whole/r.history.csv").read_text())

    def test_explicit_between_rows(self):
        """An explicit step does not wait for its next row, which may be far."""
        text = CASES["explicit"].replace("rings = 12", "rings = 8")
        (self.path / "whole").mkdir()
        (self.path / "r.nml").write_text(text)
        began = time.time()
        self.solve("run", "r.nml", "-q", "-o", "whole")
        duration = time.time() - began
        (self.path / "parts").mkdir()
        stopped = 0
        for part in (0.3, 0.5, 0.7, 0.2, 0.1, 0.05):
            if stopped == 2:
                break
            shutil.rmtree(self.path / "parts")
            (self.path / "parts").mkdir()
            run = started(self.path, "run", "r.nml", "-q", "-o", "parts")
            time.sleep(part * duration)
            run.send_signal(signal.SIGINT)
            run.communicate(timeout=300)
            if run.returncode == 3:
                stopped += 1
                self.solve("restart", "parts/r", "-q")
            elif run.returncode == -signal.SIGINT:  # before it watched
                continue
            self.assertEqual((self.path / "parts/r.history.csv").read_text(), (self.path / "whole/r.history.csv").read_text())
        self.assertEqual(stopped, 2)

    def test_twice_is_at_once(self):
        (self.path / "r.nml").write_text(CASES["volume"].replace("rings = 12", "rings = 60"))
        run = started(self.path, "run", "r.nml")
        while run.poll() is None and not (self.path / "r.history.csv").exists():
            time.sleep(0.001)
        run.send_signal(signal.SIGINT)
        said = ""
        for line in run.stderr:
            said += line
            if "finshell: stops after this increment; once more: at once" in line:  # before that the two could arrive as one
                run.send_signal(signal.SIGINT)
        run.communicate(timeout=300)
        self.assertEqual(run.returncode, -signal.SIGINT, said)
        self.assertIn("finshell: stops after this increment; once more: at once", said)
        self.assertIn("It was killed.", self.solve("info", "r"))

    def test_without_a_restart(self):
        (self.path / "r.nml").write_text(CASES["volume"] + "&output restart = 'none' /\n")
        code, said = self.interrupt_after(started(self.path, "run", "r.nml", "-q"), 2, ".")
        self.assertEqual(code, 3, said)
        self.assertIn("this run cannot go on, as it keeps nothing for a restart (restart = 'none' in &output)", said)

    def test_ignored(self):
        """Who ignores Ctrl-C when the program starts (nohup) does not want it to stop."""
        (self.path / "r.nml").write_text(CASES["volume"])
        run = subprocess.Popen([PROGRAM, "run", "r.nml", "-q"], cwd=self.path, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
                               env=ENVIRONMENT, stdout=subprocess.DEVNULL)
        while run.poll() is None and not (self.path / "r.history.csv").exists():
            time.sleep(0.001)
        run.send_signal(signal.SIGINT)
        self.assertEqual(run.wait(timeout=300), 0)

    def test_several(self):
        """All that run stop, the others do not start; each goes on by itself."""
        text = CASES["volume"].replace("rings = 12", "rings = 24")
        (self.path / "r.nml").write_text(text)
        run = started(self.path, "run", "r.nml", "--set", "section.thickness=0.5,0.6,0.7", "--jobs", "2")
        while run.poll() is None and not all((self.path / f"r.{i}.history.csv").exists() for i in (1, 2)):
            time.sleep(0.001)
        run.send_signal(signal.SIGINT)
        said = "".join(run.communicate(timeout=120))
        self.assertEqual(run.returncode, 3, said)
        self.assertRegex(said, r"r\.1 +interrupted")
        self.assertRegex(said, r"r\.3 +not started")
        self.assertIn("r.1: interrupted: finshell restart r.1 goes on from here", said)
        self.assertFalse((self.path / "r.3.history.csv").exists())
        self.solve("restart", "r.2", "-q")
        self.solve("run", "r.nml", "-q", "--set", "section.thickness=0.6", "--set", "job.name=whole")
        self.assertEqual((self.path / "r.2.history.csv").read_text(), (self.path / "whole.history.csv").read_text())

    def test_study(self):
        (self.path / "r.nml").write_text(CASES["volume"])
        run = started(self.path, "study", "r.nml")
        while run.poll() is None and not (self.path / "r.study/level_0.history.csv").exists():
            time.sleep(0.001)
        run.send_signal(signal.SIGINT)
        said = "".join(run.communicate(timeout=120))
        self.assertEqual(run.returncode, 3, said)
        self.assertIn("interrupted", said)


if __name__ == "__main__":
    unittest.main()
