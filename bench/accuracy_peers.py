#!/usr/bin/env python3
"""What other programs give for the problems of doc/accuracy.md, and at what cost: writes bench/accuracy_peers.csv.

    bench/accuracy_peers.py [--only PROBLEM,...] [--peers PEER,...] [--limit SECONDS] [--python PYTHON]

PYTHON is one that has the peers:  python3 -m venv peers && peers/bin/pip install KratosMultiphysics==10.4.4 KratosStructuralMechanicsApplication==10.4.4
KratosLinearSolversApplication==10.4.4 openseespy==3.7.1.2 ngsolve numpy;  CalculiX: apt-get install calculix-ccx.  A peer that is not there is left out, its rows stay.
One thread. CPU time is user + system of the process from after its imports (CalculiX: of ccx). Each peer takes its load in as few steps as it can: on the first
mesh of its ladder the usual steps (those of its authors or of the published curve), a half, a quarter and an eighth of them are tried, and the cheapest that reaches the load is kept.
"""
import argparse
import csv
import datetime
import json
import os
import resource
import signal
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
TABLE = HERE / "accuracy_peers.csv"
COLUMNS = ("problem", "peer", "version", "mesh", "unknowns", "steps", "iterations", "cpu_s", "values", "failed", "date", "machine")
LADDERS = {"cantilever": (4, 8, 16, 32, 64), "slit": (2, 4, 8, 16), "hemisphere": (4, 8, 16, 32, 64), "pull_out": (4, 8, 16, 24, 32), "roof": (4, 8, 16, 32),
           "line_load": (4, 8, 16, 32), "cook": (2, 4, 8, 16, 32, 64, 128), "scordelis": (4, 8, 16, 32, 64)}
# Peer: script, problems (none: all), first mesh divided by, CPU limit in seconds
PEERS = {"kratos_thin": ("kratos_shell.py", (), 1, 30), "kratos_thick": ("kratos_shell.py", (), 1, 30),
         "ccx_c3d20r": ("calculix_shell.py", tuple(p for p in LADDERS if p != "cook"), 1, 30), "ccx_cps6": ("calculix_shell.py", ("cook",), 1, 30),
         "ccx_cps8r": ("calculix_shell.py", ("cook",), 1, 30),
         "ngs_2": ("ngsolve_shell.py", (), 2, 40), "ngs_3": ("ngsolve_shell.py", (), 2, 60), "ngs_5": ("ngsolve_shell.py", ("cook",), 1, 30),
         "os_asdt3": ("opensees_shell.py", (), 1, 15), "os_nldkgt": ("opensees_shell.py", (), 1, 15), "os_mitc4": ("opensees_shell.py", ("cook", "scordelis"), 1, 15)}
VERSIONS = "import importlib.metadata as m, json; print(json.dumps({p: m.version(p) for p in ('KratosMultiphysics', 'openseespy', 'ngsolve') if p in {d.name for d in m.distributions()}}))"
USUAL_STEPS = {"cantilever": 10, "slit": 40, "hemisphere": 20, "pull_out": 40, "roof": 40, "line_load": 40}


def machine():
    for line in open("/proc/cpuinfo"):
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return "unknown"


def versions(python):
    found = json.loads(subprocess.run([python, "-c", VERSIONS], capture_output=True, text=True, check=True).stdout)
    version = {"kratos": found.get("KratosMultiphysics"), "os": found.get("openseespy"), "ngs": found.get("ngsolve"), "ccx": None}
    try:
        words = subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout.split()
        version["ccx"] = words[-1] if words else None
    except FileNotFoundError:
        pass
    return version


def solve(python, problem, peer, n, limit, steps=None):
    """The report of a peer (peers/outcome.py), or one that says that it broke."""
    script = HERE / "peers" / PEERS[peer][0]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "CCX_NPROC_STIFFNESS": "1",
                   "CCX_NPROC_EQUATION_SOLVER": "1", "NUMBER_OF_CPUS": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    command = [python, str(script), problem, str(n), peer, str(limit), *([str(steps)] if steps else [])]
    try:
        run = subprocess.run(command, capture_output=True, text=True, check=False, env=environment, timeout=1800,
                             preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (int(1.5 * limit) + 5, int(1.5 * limit) + 5)))
    except subprocess.TimeoutExpired:
        run = subprocess.CompletedProcess(command, 1, "", "not done in half an hour")
    for line in run.stdout.splitlines():
        if line.startswith("JSON "):
            return json.loads(line[5:])
    if run.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return {"mesh": f"n={n}", "failed": f"not done in {limit:g} s", "cpu": float(limit), "values": {}, "steps": 0, "iterations": 0, "unknowns": 0}
    last = (run.stderr.strip().splitlines() or ["ends without a word"])[-1]
    return {"mesh": f"n={n}", "failed": last[:120], "cpu": 0.0, "values": {}, "steps": 0, "iterations": 0, "unknowns": 0}


def ladder(python, problem, peer, limit):
    """Reports of a peer on finer and finer meshes, until the next is expected to exceed the limit or two in a row fail."""
    _, _, coarser, own_limit = PEERS[peer]
    limit = min(limit, own_limit)
    meshes = [max(1, n // coarser) for n in LADDERS[problem]] if problem != "cook" else list(LADDERS[problem])
    steps = None
    if problem in USUAL_STEPS:
        tried = {}
        for part in (1, 2, 4, 8):
            count = max(1, USUAL_STEPS[problem] // part)
            report = solve(python, problem, peer, meshes[0], limit, count)
            if not report["failed"]:
                tried[count] = report["cpu"]
        steps = min(tried, key=tried.get) if tried else None
    found, failures = [], 0
    for n in meshes:
        report = solve(python, problem, peer, n, limit, steps)
        found.append(report)
        failures = failures + 1 if report["failed"] else 0
        print(problem, peer, report["mesh"], f"{report['cpu']:.3f} s", report["values"], report["failed"], flush=True)
        if failures == 2 or 5 * report["cpu"] > limit:
            break
    return found


def stored():
    return list(csv.DictReader(line for line in TABLE.read_text().splitlines() if not line.startswith("#"))) if TABLE.exists() else []


def write(rows):
    with TABLE.open("w", newline="") as out:
        out.write("# Written by bench/accuracy_peers.py, which says how. values: monitors as name=value. failed: why the load was not reached; the values are then those of where it ended.\n")
        writer = csv.DictWriter(out, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(LADDERS))
    parser.add_argument("--peers", default=",".join(PEERS))
    parser.add_argument("--limit", type=float, default=60)
    parser.add_argument("--python", default=sys.executable)
    options = parser.parse_args()
    for word, known in [(w, LADDERS) for w in options.only.split(",")] + [(w, PEERS) for w in options.peers.split(",")]:
        if word not in known:
            sys.exit(f"accuracy_peers.py: {word} is not known; there are {', '.join(known)}")
    version = versions(options.python)
    for problem in options.only.split(","):
        for peer in options.peers.split(","):
            program = peer.split("_")[0]
            if version[program] is None or (PEERS[peer][1] and problem not in PEERS[peer][1]):
                continue
            common = {"problem": problem, "peer": peer, "version": version[program], "date": str(datetime.date.today()), "machine": machine()}
            new = [{**common, "mesh": r["mesh"], "unknowns": r["unknowns"], "steps": r["steps"], "iterations": r["iterations"], "cpu_s": f"{r['cpu']:.3f}",
                    "values": " ".join(f"{k}={v:.8g}" for k, v in r["values"].items()), "failed": r["failed"]} for r in ladder(options.python, problem, peer, options.limit)]
            write([row for row in stored() if (row["problem"], row["peer"]) != (problem, peer)] + new)


if __name__ == "__main__":
    main()
