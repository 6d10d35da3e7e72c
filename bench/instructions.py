"""Instructions that a program executes, counted by valgrind's callgrind: they do not depend on what else the machine does."""
import os
import subprocess
import tempfile
from collections import Counter
from pathlib import Path


def count(command, folder=None):
    """Instructions by procedure, each without what it calls; one thread. The sum is what the whole run takes."""
    with tempfile.TemporaryDirectory() as place:
        out = Path(place) / "callgrind"
        run = subprocess.run(["valgrind", "--tool=callgrind", "--compress-strings=no", "--compress-pos=no", f"--callgrind-out-file={out}", *command],
                             cwd=folder, capture_output=True, text=True, check=False, env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})
        if run.returncode:
            raise RuntimeError(run.stdout + run.stderr)
        found, name, called = Counter(), "", False
        for line in out.read_text().splitlines():
            if line.startswith("fn="):
                name = line[3:]
            elif line.startswith("calls="):
                called = True    # the next line holds what was called, counted there
            elif line[:1].isdigit():
                if not called:
                    found[name] += int(line.split()[1])
                called = False
    return found
