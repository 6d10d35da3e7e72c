#!/usr/bin/env python3
"""Strong and weak scaling of finshell_mpi: wall seconds and the memory of the largest process.

    bench/mpi_scaling.py [--triangles N] [--processes 1,2,4] [--solve linear|disk]

One step of a clamped disk under pressure: `linear`, one factorisation; `disk`, a nonlinear one in two increments. Strong: N triangles
on all numbers of processes; weak: N triangles for each process. The first line is the program finshell, on one thread. Processes
beyond the cores of the machine are marked. FINSHELL_BIN and FINSHELL_MPI_BIN name the programs.
"""
import argparse
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SERIAL = os.environ.get("FINSHELL_BIN") or str(ROOT / "build/bin/finshell")
PARALLEL = os.environ.get("FINSHELL_MPI_BIN") or str(ROOT / "build/bin/finshell_mpi")
STEPS = {"linear": "&step control = 'linear' /", "disk": "&step first_increment = 0.5 largest_increment = 0.5 /"}
INPUT = """&job name = 'disk' /
&mesh generator = 'disk' portion = 'quarter' radius = 7.5 rings = {rings} /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 80 c01 = 20 /
&section thickness = 0.5 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'pressure' pressure = 1 /
{step}
&output every = 0 /
"""


def one_process(command):
    """Run as a child of mpirun: the program, and a file with the memory that it took."""
    code = subprocess.run(command, stdout=subprocess.DEVNULL, check=False).returncode
    bytes_ = 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    Path(f"memory.{os.environ.get('OMPI_COMM_WORLD_RANK', '0')}").write_text(json.dumps(bytes_))
    sys.exit(code)


def measure(folder, processes):
    """Wall seconds, largest memory (bytes)."""
    for old in folder.glob("memory.*"):
        old.unlink()
    me = [sys.executable, __file__, "--one"]
    command = [*me, SERIAL] if processes == 0 else ["mpirun", "-n", str(processes), *me, PARALLEL]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
                   "OMPI_MCA_rmaps_base_oversubscribe": "1", "OMPI_MCA_hwloc_base_binding_policy": "none"}
    start = time.time()
    subprocess.run([*command, "run", "-q", "disk.nml"], cwd=folder, env=environment, check=True)
    return time.time() - start, max(json.loads(p.read_text()) for p in folder.glob("memory.*"))


def main():
    if sys.argv[1:2] == ["--one"]:
        one_process(sys.argv[2:])
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", type=float, default=1e5)
    parser.add_argument("--processes", default="1,2,4")
    parser.add_argument("--solve", choices=STEPS, default="linear")
    options = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    counts = [int(n) for n in options.processes.split(",")]
    print("| scaling | triangles | processes | wall s | speed-up | largest process, MB |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for scaling, sizes in (("strong", [1] * (len(counts) + 1)), ("weak", counts)):
            base = None
            for n, size in zip([0, *counts] if scaling == "strong" else counts, sizes):
                rings = round(math.sqrt(options.triangles * size / 2))
                (folder / "disk.nml").write_text(INPUT.format(rings=rings, step=STEPS[options.solve]))
                wall, memory = measure(folder, n)
                if n == 1:
                    base = wall
                label = "finshell" if n == 0 else f"{n}{' (more than cores)' if n > cores else ''}"
                gain = f"{base * (size if scaling == 'weak' else 1) / wall:.2f}" if base else ""
                print(f"| {scaling} | {options.triangles * size:.2g} | {label} | {wall:.1f} | {gain} | {memory / 1e6:.0f} |", flush=True)


if __name__ == "__main__":
    main()
