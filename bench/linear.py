#!/usr/bin/env python3
"""What the linear solvers cost, as the table of doc/performance.md: definite against indefinite matrices of disks and spheres of four sizes.

    bench/linear.py [SOLVER [LOW_RANK]]      one thread; SOLVER as in &job, default auto
"""
import os
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM = Path(__file__).resolve().parents[1] / "build" / "bin" / "bench_linear"
DISK = """&mesh generator = 'disk' radius = 7.5 rings = {n} portion = 'quarter' /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0 /
&section material = 'rubber' thickness = 0.5 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'pressure' pressure = 70.0 /
&step load_factor = 1.0 /
"""
SPHERE = """&mesh generator = 'sphere' radius = 10.0 colatitudes = 18.0, 90.0 azimuths = 0.0, 90.0 divisions = {n}, {n} diagonal = 'forward' /
&material name = 'elastic' law = 'linear_elastic' e = 6.825e7 nu = 0.3 /
&section material = 'elastic' thickness = 0.04 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'corner_a0_bottom' fixed = 'uz' /
&load type = 'force' node_set = 'corner_a0_bottom' vector = 0.003125, 0.0, 0.0 /
&step /
"""


def main(words):
    print("| problem | unknowns | ordering | definite | indefinite | indefinite / definite | solution | GB definite | GB indefinite |\n"
          "|---|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name, text in (("disk", DISK), ("sphere", SPHERE)):
            for n in (17, 41, 129, 225):
                path = Path(folder) / "input.nml"
                path.write_text(text.format(n=n))
                line = subprocess.run([PROGRAM, path, *(words or ["auto"])], env={**os.environ, "OMP_NUM_THREADS": "1"}, check=True,
                                      capture_output=True, text=True).stdout.split()
                ordering, definite, indefinite, solution = (float(word) for word in line[2:6])
                print(f"| {name} | {int(line[0]):,} | {ordering:.3f} | {definite:.3f} | {indefinite:.3f} | {indefinite/definite:.2f} | {solution:.3f} | "
                      f"{line[7]} | {line[8]} |".replace(",", " "), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
