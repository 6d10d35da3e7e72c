#!/usr/bin/env python3
"""Increments, iterations and last values of every input of examples/ as it stands: what a change of defaults costs or brings.

    bench/counts.py [--write FILE] [--against FILE] [--jobs N] [NAME ...]

FILE is a table (csv) of an earlier run. With --against, what differs from it is listed: counts, exit codes, and the largest relative
difference of the monitors in the last increment. FINSHELL_BIN names the program. CPU seconds mean something with one job only.
"""
import argparse
import csv
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from benchmark_run import EXAMPLES, beside, solve

COUNTS = ("exit", "increments", "iterations")
FIXED = ("increment", "load_factor", "iterations", "negative_pivots", "critical_point", "residual", "correction", "snap", "found_by", "stabilisation")


def inputs(names):
    """Name -> input file."""
    found = {str(p.relative_to(EXAMPLES).with_suffix("")).removesuffix("/input"): p for p in sorted(EXAMPLES.glob("*/*.nml"))}
    unknown = [n for n in names if n not in found]
    if unknown:
        sys.exit(f"no example {unknown[0]!r}; there are: {', '.join(found)}")
    return {n: p for n, p in found.items() if not names or n in names}


def row_of(item):
    name, path = item
    solution = solve(path.read_text(), timeout=600, files=beside(path))
    last = solution.last
    values = {k: v for k, v in last.items() if k not in FIXED}
    return {"name": name, "exit": 0 if solution.done else 1, "increments": solution.increments, "iterations": solution.iterations,
            "cpu": round(solution.cpu, 2), "load_factor": last.get("load_factor", 0.0), "negative_pivots": int(last.get("negative_pivots", -1)),
            "critical_points": sum(r.get("critical_point", 0) > 0 for r in solution.rows), "message": "" if solution.done else solution.message,
            "values": " ".join(f"{k}={v!r}" for k, v in values.items())}


def difference(a, b):
    """Largest relative difference of the values, those far below the largest of a run counted against that."""
    x, y = ({k: float(v) for k, v in (p.split("=") for p in text.split())} for text in (a, b))
    common = x.keys() & y.keys()
    floor = 1e-6 * max((abs(x[k]) for k in common), default=0.0)
    return max((abs(x[k] - y[k]) / max(abs(x[k]), floor, 1e-300) for k in common), default=0.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--against", type=Path)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    before = {r["name"]: r for r in csv.DictReader(options.against.open())} if options.against else {}
    with ThreadPoolExecutor(options.jobs) as pool:
        rows = list(pool.map(row_of, inputs(options.names).items()))
    print(f"{'example':28} exit  incr  iter  crit  neg   cpu s")
    for r in rows:
        print(f"{r['name']:28} {r['exit']:4} {r['increments']:5} {r['iterations']:5} {r['critical_points']:5} {r['negative_pivots']:4} {r['cpu']:7.2f}", end="")
        old = before.get(r["name"])
        if old:
            changed = [f"{k} {old[k]} -> {r[k]}" for k in COUNTS if str(r[k]) != old[k]]
            far = difference(old["values"], r["values"])
            print("  " + "; ".join(changed + ([f"values differ by {far:.1e}"] if far > 0 else [])), end="")
        print("" if not r["message"] else f"\n    {r['message']}")
    print(f"{'sum':28} {sum(r['exit'] for r in rows):4} {sum(r['increments'] for r in rows):5} {sum(r['iterations'] for r in rows):5} {'':10} "
          f"{sum(r['cpu'] for r in rows):7.2f}")
    if options.write:
        with options.write.open("w", newline="") as file:
            writer = csv.DictWriter(file, rows[0].keys())
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
