#!/usr/bin/env python3
"""Double against quadruple precision on random elements of every law, shells, membranes and membranes that wrinkle (see
precision_sample.f90 and precision_reference.f90).

FINSHELL_PRECISION_BLOCKS blocks of eight elements per law and parameter set (8; `make test-extremes`: more), FINSHELL_PRECISION_SEED.
"""
import os
import subprocess
import sys
import tempfile
from pathlib import Path

programs = Path(os.environ["FINSHELL_BINARY_DIR"]) / "test" / "bin"
blocks = os.environ.get("FINSHELL_PRECISION_BLOCKS", "8")
seed = os.environ.get("FINSHELL_PRECISION_SEED", "2026")
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "elements"
    subprocess.run([programs / "precision_sample", file, blocks, seed], check=True)
    run = subprocess.run([programs / "precision_reference", file, "all"], capture_output=True, text=True, check=False)
print(run.stdout)
lines = [line for line in run.stdout.splitlines() if not line.startswith(" ")]
evaluated = sum(int(line[24:32]) - int(line[32:40]) for line in lines[1:])
print(f"{evaluated} elements evaluated, {len(lines) - 1} kinds of section, laws and parameter sets")
if run.returncode or len(lines) < 75 or evaluated < 500 * int(blocks):
    print(run.stderr)
    sys.exit("double precision has lost digits, or too little was compared")
