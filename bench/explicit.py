#!/usr/bin/env python3
"""What an increment of an explicit step costs: ns for each element, of shells and membranes on meshes of many sizes, by one and two
threads, beside the force of the kernel alone in the same run (build/bin/bench_explicit).

    bench/explicit.py            the table
    bench/explicit.py --sample   100 000 triangles, some hundred increments: what `make benchmark` runs
    bench/explicit.py --full     100 000 triangles, 10 000 increments
    bench/explicit.py --write    the table into doc/explicit.md

A square sheet of rubber, hinged at its edges, under a sudden follower pressure on all elements."""
import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = Path(os.environ.get("FINSHELL_BENCH", ROOT / "build/bin/bench_explicit"))
DIVISIONS = {1000: 22, 10000: 70, 100000: 224}
INPUT = """&mesh generator = 'rectangle' lengths = 1.0, 1.0 divisions = {n}, {n} /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 4e5 c01 = 1e5 density = 1000 /
&section type = '{kind}' thickness = 0.005 /
&support node_set = 'edge_x0', type = 'hinged' /
&support node_set = 'edge_x1', type = 'hinged' /
&support node_set = 'edge_y0', type = 'hinged' /
&support node_set = 'edge_y1', type = 'hinged' /
&load type = 'pressure' pressure = 1000 /
&step control = 'explicit' duration = {duration} history_rows = 20 /
&output every = 0 /
"""
BEGIN, END = "<!-- bench/explicit.py -->", "<!-- end -->"


def measure(kind, triangles, increments, threads):
    """Numbers of bench_explicit by name: the wall, then CPU."""
    n = DIVISIONS[triangles]
    # 0.9 of the stable increment of this sheet, on edges of length 1/n
    duration = increments * (7.1e-3 if kind == "shell" else 1.2e-2) / n
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sheet.nml"
        path.write_text(INPUT.format(n=n, kind=kind, duration=duration))
        environment = dict(os.environ, OMP_NUM_THREADS=str(threads), OMP_WAIT_POLICY="passive")
        run = subprocess.run([PROGRAM, path, str(threads)], capture_output=True, text=True, check=False, env=environment)
    if run.returncode:
        sys.exit(f"{PROGRAM.name}: {run.stderr}")
    return {line.split()[0]: [float(word) for word in line.split()[1:]] for line in run.stdout.splitlines()}


def table(sizes, increments, counts):
    lines = ["| elements | triangles | increments | threads | kernel's force | forces added up | increment, all included | increment / kernel |",
             "| --- | --- | --- | --- | --- | --- | --- | --- |"]
    for kind in ("shell", "membrane"):
        for triangles in sizes:
            for threads in counts:
                found = measure(kind, triangles, increments(triangles), threads)
                # CPU time is what a busy machine does not change; of several threads it is that of all
                kernel, assembly, step = (found[name][1] for name in ("kernel", "assembly", "step"))
                lines.append(f"| {kind} | {int(found['elements'][0])} | {int(found['increments'][0])} | {threads} | {kernel:.0f} | {assembly:.0f} "
                             f"| {step:.0f} | {step / kernel:.2f} |")
                print(lines[-1], flush=True)
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for option in ("--sample", "--full", "--write"):
        parser.add_argument(option, action="store_true")
    options = parser.parse_args()
    if options.sample or options.full:
        for kind in ("shell", "membrane"):
            found = measure(kind, 100000, 10000 if options.full else 200, 1)
            print(f"explicit, {kind}: {int(found['elements'][0])} triangles, {int(found['increments'][0])} increments: "
                  f"{found['step'][1]:.0f} ns of CPU time per element and increment; kernel's force {found['kernel'][1]:.0f} ns")
        return
    lines = table((1000, 10000, 100000), lambda triangles: 3000 if triangles < 100000 else 1000, (1, 2))
    if options.write:
        page = ROOT / "doc/explicit.md"
        text = page.read_text()
        before, rest = text.split(BEGIN)
        page.write_text(before + BEGIN + "\n" + "\n".join(lines) + "\n" + END + rest.split(END)[1])


if __name__ == "__main__":
    main()
