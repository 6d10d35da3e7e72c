#!/usr/bin/env python3
"""Run the cases of examples/ and compare them with their references. Writes doc/benchmarks.md and build/benchmark.csv.

    benchmark.py [--only NAME[,NAME...]] [--no-write] [--record SOURCE]

Without --only all cases of benchmark_cases.py are run (one thread each; what has its CPU time in the tables one after the other). With --only or
--no-write doc/benchmarks.md is left alone; the tables go to the screen. The program is FINSHELL_BIN of the environment, by default build/bin/finshell.
--record writes bench/benchmark_before.csv instead, the figures to which the tables compare; SOURCE says in words which program it was.
"""
import argparse
import csv
import datetime
import os
import platform
import sys
from concurrent.futures import ThreadPoolExecutor

import benchmark_curved as curved
import benchmark_measure as measured
import benchmark_run as run
from benchmark_cases import CASES, GLANCE
from benchmark_sections import KINDS, Report, before_cells, default_section, percent

COLUMNS = ("case", "mesh", "quantity", "value", "reference", "error_percent", "increments", "iterations", "cpu_s")


def glance(report):
    """One line a problem."""
    lines = ["| problem | mesh | errors % | increments / iterations | before: errors % | before: incr. / it. | CPU s | aim |", "|---|---|---|---|---|---|---|---|"]
    for case in CASES:
        rows = [r for r in report.rows if r.case == case.name and r.mesh == GLANCE.get(case.name)]
        if not rows:
            continue
        main = [r for r in rows if r.quantity in (*case.quantities, "load_factor at the end", "largest distance to the table")]
        main = [r for r in main if r.quantity != "largest distance to the table" or case.kind == "turns"]
        if not main:    # load factors at given displacements
            main = [max((r for r in rows if not r.quantity.startswith("limit")), key=lambda r: abs(r.error_percent()))]
            errors = f"{percent(main[0].error_percent())} at most ({main[0].quantity.removeprefix('load_factor at ')})"
        else:
            errors = ", ".join(f"{r.quantity.removeprefix('load_factor at the ')} {percent(r.error_percent()) if r.error_percent() is not None else f'(= {r.value:.5g}, no reference)'}"
                               for r in main if not r.quantity.endswith("_table"))
        more = [r for r in rows if r.quantity == "largest distance to the table" and case.kind == "path"]
        errors += f"; path within {more[0].value:.2f}" if more else ""
        lines.append(f"| {case.name} | {rows[0].mesh} | {errors} | {main[0].increments} / {main[0].iterations} | {before_cells(report, case, rows[0].mesh)} | {main[0].cpu_s:.2f} | {case.target or '–'} |")
    return "\n".join(lines)


def cpu_name():
    for line in open("/proc/cpuinfo"):
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return platform.machine()


INTRODUCTION = """# Benchmarks

Written by `make benchmark` (`bench/benchmark.py`) on {date}, {cpu}, one thread, CPU time of the whole process. Every case is an input file in
`examples/`, with the mesh named here; the numbers of all tables and more are in `build/benchmark.csv`. Errors are against the reference in
`examples/CASE/reference.csv` or `test/data`. Increments and iterations are those of the settings in the example; iterations are linear solves, failed attempts included.
Default section: formulation (S), β0 = (h/l)² between 1e-5 and 0.3. In linear problems (P) with the optimal β0 is the published pair OPT (membrane) and DKT (plate).

*Before*: the element that (S) was until then, by the same inputs; {source} (`bench/benchmark_before.csv`).

*Peers*: what users would pick instead, measured on 2026-11-22, one core of a 2-core virtual machine of this kind, ±30 %: Kratos 10.4.4 (thin triangle, ANDES and
DKT, corotational), OpenSeesPy 3.7.1.2, CalculiX (S6), each with the step sizes it needs.
"""


CURVED = """Every curved case with flat facets (`normals = 'facet'`) and with curved references (`'auto'`: the exact normals of the generators, fitted ones for files; an edge at an angle stays
one), beside the element before, which had facets only. Structured meshes with one way of diagonals and alternating ones; irregular: every node inside is moved by up to a quarter of a cell
(`distortion = 0.24`), the edges stay. Error in per cent, at full load; of paths at given displacements or volumes the worst error of the load; of the rubber cone the largest distance to the
table. neg.: negative pivots at the end. A dash: the mesh has no nodes inside. All diagonals, fitted normals and iterations are in the tables of the cases."""


BETA0 = """β0 scales the higher-order stiffness of the drilling rotations. What is optimal for in-plane bending (½(1 − 4ν²)) locks curved shells that bend without
stretching: the twisted thin beam and the pinched hemispheres lose most of their deflection on coarse meshes. The default, (h/l)² of each element between 1e-5 and 0.3, keeps them, and is too soft in in-plane
bending where there are only two elements through the depth. All choices converge to the same answer; with four elements through the depth little is left of the difference.
Compare with OPT and DKT in the last column.
So: nothing for shells; for plane panels with few elements through the depth set `beta0` of the section to the optimal value. One mesh of each problem:"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="")
    parser.add_argument("--no-write", action="store_true")
    parser.add_argument("--record", metavar="SOURCE")
    options = parser.parse_args()
    if not os.access(run.PROGRAM, os.X_OK):
        sys.exit(f"{run.PROGRAM} is not there: `make build` first")
    names = [n for n in options.only.split(",") if n]
    unknown = set(names) - {c.name for c in CASES}
    if unknown:
        sys.exit(f"benchmark.py: no case {', '.join(sorted(unknown))}; there are {', '.join(c.name for c in CASES)}")
    cases = [c for c in CASES if not names or c.name in names]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        if options.record:
            measured.record(cases, pool, options.record)
        else:
            write(cases, pool, part=bool(names), on_screen=bool(names) or options.no_write)


def write(cases, pool, part, on_screen):
    report = Report(pool)
    text = []
    for case in cases:
        print(f"{case.name} ...", file=sys.stderr, flush=True)
        text.append(f"## {case.title}\n\n`{run.path_of(case).relative_to(run.ROOT)}`" + (f". Aim: {case.target}." if case.target else "."))
        text += KINDS[case.kind](case, report)
        if case.curved:
            text += curved.section(case, report)
        if case.note:
            text.append(case.note)
        if case.peers:
            text.append("Peers: " + "; ".join(case.peers) + ".")
    head = [INTRODUCTION.format(date=datetime.date.today(), cpu=cpu_name(), source=report.source)]
    if not part:
        head.append("## At a glance\n\n" + glance(report))
    if len(report.curved) > 1:
        head += ["## Facets or curved references", CURVED, *curved.summary(report)]
    text = head + text
    if len(report.spread) > 1:
        text += ["## Which β0", BETA0, *default_section(report)]
    if report.failures:
        text.append("## Runs that did not reach their end\n\n" + "\n".join(f"- {f}" for f in report.failures))
    page = "\n\n".join(part.strip("\n") for part in text) + "\n"
    build = run.ROOT / "build"
    build.mkdir(exist_ok=True)
    with (build / ("benchmark_part.csv" if part else "benchmark.csv")).open("w", newline="") as out:
        writer = csv.DictWriter(out, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(row.as_dict() for row in report.rows)
    if on_screen:
        print(page)
    else:
        (run.ROOT / "doc" / "benchmarks.md").write_text(page)
        print(f"doc/benchmarks.md and build/benchmark.csv written; {len(report.failures)} runs did not reach their end.")


if __name__ == "__main__":
    main()
