#!/usr/bin/env python3
"""Work and precision: error against CPU time of the presets and of other programs. Writes doc/accuracy.md, its figures, and build/accuracy.csv.

    accuracy.py [--only PROBLEM,...] [--presets PRESET,...] [--limit SECONDS] [--page] [--store FILE]

Ours are run anew, one thread, one after the other (five minutes on a machine that is idle); figures of peers are those of bench/accuracy_peers.csv (bench/accuracy_peers.py).
With --only or --presets tables go to the screen and the page stays; --page runs nothing and writes the page from FILE, by default build/accuracy.csv. The program is FINSHELL_BIN, by default
build/bin/finshell.
"""
import argparse
import datetime
import os
import sys
from pathlib import Path

import accuracy_page as page
import accuracy_run as points
import benchmark_run as run
from accuracy_advice import ADVICE, AIMS, HEAD
from accuracy_peers import machine
from accuracy_problems import PROBLEMS


def solve(problems, presets, exact, limit, store):
    """problem -> preset -> Points; kept in the file one by one."""
    found = {}
    for problem in problems:
        found[problem.name] = {}
        for preset in presets:
            found[problem.name][preset] = line = points.ladder(problem, preset, exact[problem.name], limit)
            for p in line:
                print(f"{problem.name} {preset} {p.mesh}: {p.failed or page.percent(p.error) + ' %'}, {p.cpu:.3f} s, {p.steps}/{p.iterations}", file=sys.stderr, flush=True)
            points.keep_points(store, {problem.name: {preset: line}})
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="")
    parser.add_argument("--presets", default="")
    parser.add_argument("--limit", type=float, default=points.LIMIT)
    parser.add_argument("--page", action="store_true")
    parser.add_argument("--store", type=Path, default=run.ROOT / "build" / "accuracy.csv")
    options = parser.parse_args()
    if not os.access(run.PROGRAM, os.X_OK):
        sys.exit(f"{run.PROGRAM} is not there: `make build` first")
    names, presets = [n for n in options.only.split(",") if n], [p for p in options.presets.split(",") if p] or list(points.PRESETS)
    for word, known in [(n, [p.name for p in PROBLEMS]) for n in names] + [(p, points.PRESETS) for p in presets]:
        if word not in known:
            sys.exit(f"accuracy.py: {word} is not known; there are {', '.join(known)}")
    problems = [p for p in PROBLEMS if not names or p.name in names]
    exact = points.references()
    rivals = points.peers(exact)
    part = bool(names or options.presets)
    found = points.read_points(options.store) if options.page else solve(problems, presets, exact, options.limit, options.store)
    missing = [f"{p.name} {preset}" for p in problems for preset in presets if preset not in found.get(p.name, {})]
    if missing:
        sys.exit(f"accuracy.py: {options.store} has no {', '.join(missing)}: run without --page first")
    start = points.start()
    text = [HEAD.format(date=datetime.date.today(), cpu=machine(), limit=options.limit, start=f"{start:.3f}"), "## At equal error", page.summary(found, rivals, exact, start), "## The aims of the presets", AIMS, page.aims(found, presets)]
    pictures = run.ROOT / "doc" / "pictures"
    for problem in problems:
        name = f"accuracy_{problem.name}.svg"
        text.append(page.section(problem, found[problem.name], rivals.get(problem.name, {}), exact[problem.name], f"pictures/{name}"))
        if not part:
            page.figure(problem, found[problem.name], rivals.get(problem.name, {}), pictures / name)
    text += ["## What to choose when", page.choose(found), ADVICE]
    whole = "\n\n".join(part_.strip("\n") for part_ in text) + "\n"
    if part:
        print(whole)
    else:
        (run.ROOT / "doc" / "accuracy.md").write_text(whole)
        print(f"doc/accuracy.md and its figures written from {options.store}.")


if __name__ == "__main__":
    main()
