#!/usr/bin/env python3
"""The stability bench in its long form: the tests unit.test_stability and driver.test_stability with finer scans, figures printed.

    bench/stability.py [BUILD]      BUILD: folder of a preset, default build/release

Drilling stiffness over stretches 0.2 to 6, shapes to 5 degrees, all laws; clamped and hinged patches; ring meshes of the rubber disk to
w = 40 in; one-element strips in tension; thin sphere to five times its size. `make test` runs a sample of it.
"""
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "build" / "release").resolve()
PROGRAM = next((p for p in (BUILD / "bin" / "finshell", BUILD.parent / "bin" / "finshell") if p.exists()), None)

if PROGRAM is None:
    sys.exit(f"no program finshell in {BUILD}/bin: build it first (make build)")
environment = {**os.environ, "FINSHELL_LONG": "1", "FINSHELL_SOURCE_DIR": str(ROOT), "FINSHELL_BIN": str(PROGRAM), "OMP_NUM_THREADS": "1"}
failed = [command for command in ([BUILD / "test" / "bin" / "unit.test_stability"], [sys.executable, ROOT / "test" / "driver" / "test_stability.py"])
          if subprocess.run(command, cwd=ROOT / "test", env=environment, check=False).returncode]
sys.exit(1 if failed else 0)
