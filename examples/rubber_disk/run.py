#!/usr/bin/env python3
"""Solve the rubber disk, print its results beside the reference, and draw the pictures.

    run.py [OUTPUT_FOLDER]

The program is FINSHELL_BIN of the environment, by default build/bin/finshell; the output goes to build/examples/rubber_disk.
"""
import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent


def main():
    if len(sys.argv) > 2 or "--help" in sys.argv or "-h" in sys.argv:
        sys.exit(__doc__)
    program = Path(os.environ.get("FINSHELL_BIN") or ROOT / "build" / "bin" / "finshell").resolve()
    if not os.access(program, os.X_OK) or program.is_dir():
        sys.exit(f"run.py: {program} is not there: build it first with `make build`, or name it in FINSHELL_BIN")
    folder = Path(sys.argv[1] if len(sys.argv) == 2 else ROOT / "build" / "examples" / "rubber_disk").resolve()
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("rubber_disk.*"):
        old.unlink()
    status = subprocess.run([program, "run", HERE / "rubber_disk.nml"], cwd=folder, check=False).returncode
    if status != 0:
        sys.exit(f"run.py: finshell ended with status {status}, see above; what it wrote until then is in {folder}")
    sys.stdout.flush()
    status = subprocess.run([sys.executable, HERE / "plot.py", folder], check=False).returncode
    if status != 0:
        sys.exit(f"run.py: the pictures could not be drawn, see above; the results are in {folder}")
    print(f"\nAll results: {folder}")


if __name__ == "__main__":
    main()
