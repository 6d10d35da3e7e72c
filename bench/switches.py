#!/usr/bin/env python3
"""What each switch costs and changes: writes the tables of doc/switches.md.

    bench/switches.py [--jobs N] [--all] [presets] [switches] [points]

presets: fast, balanced and reference over the cases of `make benchmark`: errors, iterations, CPU seconds. switches: every switch on small
meshes of some examples: iterations, what becomes of the answer, and on one of them the instructions of the whole run by valgrind's callgrind.
points: instructions of the kernel by thickness points. Without a name: all three. --all: with the cases that take minutes under reference. FINSHELL_BIN names the program.
"""
import argparse
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import exp, log
from pathlib import Path

import benchmark_measure as measure
import benchmark_run as run
import instructions
from benchmark_cases import CASES, GLANCE

PAGE = run.ROOT / "doc" / "switches.md"
KERNEL = run.PROGRAM.parent / "bench_kernel"
PRESETS = ("fast", "balanced", "reference")
COARSE = {"sze36": "24x24", "sze37": "24x24"}    # in place of the mesh of the benchmark's first table, for the sake of `reference`
LONG = ("sze36", "sze37", "sze37_0_90_0", "sze37_90_0_90", "sze38e", "rubber_cone")    # minutes under `reference`
SMALL = {"sze34": "8x8", "hemisphere_1e3": "8x8", "sze38d": "8x8", "hinged_strip": "16x1", "inflated_sphere_neo_hookean": "8x8", "cylinder_line_load": "16x8",
         "fibre_arc_axial": "24x1", "hypar_1e-3": "16x16"}
COUNTED = "sze34"          # where instructions are counted, if the switch is for all
QUIET = "every = 0"


@dataclass
class Switch:
    name: str
    group: str
    keys: dict
    only: tuple = ()           # examples; none: all
    output: str = QUIET        # keys of &output


STRESS = "fields = 'displacement', 'rotation', 'stress', 'moment', 'energy_density'"
SWITCHES = [
    Switch("`type = 'membrane'`", "section", {"type": "'membrane'"}, only=("inflated_sphere_neo_hookean",)),
    Switch("`formulation = 'P'`", "section", {"formulation": "'P'"}),
    Switch("`arc = .false.`", "section", {"arc": ".false."}),
    Switch("`beta0 = 0.01`", "section", {"beta0": "0.01"}),
    Switch("`thickness_points = 2`", "section", {"thickness_points": "2"}),
    Switch("`thickness_points = 3`", "section", {"thickness_points": "3"}),
    Switch("`thickness_points = 5`", "section", {"thickness_points": "5"}),
    Switch("`normals = 'facet'`", "mesh", {"normals": "'facet'"}),
    Switch("`mixed = .false.`", "step", {"mixed": ".false."}),
    Switch("`mixed = .true.`", "step", {"mixed": ".true."}),
    Switch("`extrapolate = .false.`", "step", {"extrapolate": ".false."}),
    Switch("`tangent_predictor = .true.`", "step", {"tangent_predictor": ".true."}),
    Switch("`tolerance = 'tight'`", "step", {"tolerance": "'tight'", "residual_tolerance": None, "correction_tolerance": None}),
    Switch("`snap = 'ignore'`", "step", {"snap": "'ignore'"}),
    Switch("`cautious = .true.`", "step", {"cautious": ".true."}),
    Switch("`locate = .true.`", "step", {"locate": ".true."}),
    Switch("`solver = 'mumps'`", "job", {"solver": "'mumps'"}),
    Switch("`solver = 'iterative'`", "job", {"solver": "'iterative'"}),
    Switch("result file, default fields", "job", {}, output=""),
    Switch("the same, `compress = 0`", "job", {}, output="compress = 0"),
    Switch("the same, `precision = 'single'`", "job", {}, output="precision = 'single'"),
    Switch("result file with rotations, stresses, moments, energies", "job", {}, output=STRESS),
]


def with_switch(text, group, keys):
    """The input with these keys; a group that is not there is made."""
    text = re.sub(r"^(&step\b[^/'\"]*)!.*$", r"\1", text, flags=re.M)
    if not re.search(rf"^&{group}\b", text, re.M):
        text += f"\n&{group} /\n"
    if group == "step" and "'linear'" in text:
        return text
    return run.with_keys(text, group, **keys) if keys else text


def without_comments(text):
    return "\n".join(line if "'" in line.partition("!")[2] else line.partition("!")[0] for line in text.splitlines()) + "\n"


def case_named(name):
    return next(c for c in CASES if c.name == name)


def answers(case, last):
    return [abs(last[q.removesuffix("_table")]) for q in (case.quantities if case.kind == "end" else ("load_factor",))]


def small_input(name, switch=None):
    """A small example with a switch."""
    text = without_comments(measure.case_input(case_named(name), SMALL[name])[0])
    text = re.sub(r"^&output\b[^/]*/", "", text, flags=re.M)
    text = run.with_keys(with_switch(text, "job", {}), "job", name="'case'")
    if switch:
        text = with_switch(text, switch.group, switch.keys)
    return text + f"\n&output {switch.output if switch else QUIET} /\n"


def spent(name, switch=None):
    """Instructions of the whole run of a small example; None where it stops."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "case.nml").write_text(small_input(name, switch))
        try:
            return sum(instructions.count([run.PROGRAM, "run", "-q", "case.nml"], folder).values())
        except RuntimeError:
            return None


def tried(name, switch=None):
    """(iterations, answers) of a small example; None where it does not reach its end."""
    solution = run.solve(small_input(name, switch), timeout=60)
    return (solution.iterations, answers(case_named(name), solution.last)) if solution.done else None


def switches(pool):
    plain = dict(zip(SMALL, pool.map(tried, SMALL)))
    jobs = [(name, s) for s in SWITCHES for name in SMALL if not s.only or name in s.only]
    found = dict(zip(((n, s.name) for n, s in jobs), pool.map(lambda job: tried(*job), jobs)))
    counted = [(s.only or (COUNTED,))[0] for s in SWITCHES]
    base = dict(zip(sorted(set(counted)), pool.map(spent, sorted(set(counted)))))
    price = list(pool.map(spent, counted, SWITCHES))
    lines = ["Default: " + "; ".join(f"{n} {SMALL[n]}: {p[0]} iterations" for n, p in plain.items()) + ". "
             + "; ".join(f"{n}: {b / 1e6:.0f} million instructions" for n, b in base.items()) + ".", "",
             f"| switch | instructions / default ({COUNTED}) | iterations / default: mean | least | most | largest change of the answer % | where |", "|---|---|---|---|---|---|---|"]
    for s, name, paid in zip(SWITCHES, counted, price):
        names = [n for n in SMALL if not s.only or n in s.only]
        done = [n for n in names if found[n, s.name]]
        stopped = [n for n in names if not found[n, s.name]]
        rounds = [found[n, s.name][0] / plain[n][0] for n in done]
        change = {n: max(100 * abs(a / b - 1) if abs(b) > 1e-12 else 0.0 for a, b in zip(found[n, s.name][1], plain[n][1])) for n in done}
        worst = max(change, key=change.get, default="")
        where = (worst if change.get(worst, 0) > 5e-5 else "") + ("; stops: " + ", ".join(stopped) if stopped else "")
        lines.append(f"| {s.name} | {f'{paid / base[name]:.3f}' if paid else 'stops'} | {exp(sum(map(log, rounds)) / len(rounds)) if rounds else 0:.2f} | "
                     f"{min(rounds, default=0):.2f} | {max(rounds, default=0):.2f} | {change.get(worst, 0):.4f} | {where.removeprefix('; ')} |")
    return lines


def preset_run(job):
    """(numbers of the benchmark, elements, iterations, CPU seconds, message) of a case under a preset."""
    case, name, keys = job
    mesh = COARSE.get(case.name) or GLANCE.get(case.name) or list(case.meshes)[min(1, len(case.meshes) - 1)]
    total = None
    for step in (None, measure.fine_levels(case)) if case.kind == "levels" else (None,):
        text, files = measure.case_input(case, mesh, step=step)
        text = with_switch(without_comments(text), "job", {"accuracy": f"'{name}'"})
        if keys:
            text = run.with_keys(text, "mesh", **keys)
        solution = run.solve(text, files=files, timeout=400)
        total = total or solution
        if not solution.done:
            return mesh, None, total.iterations, total.cpu, solution.message[-80:]
    return mesh, measure.numbers(case, solution), total.iterations, total.cpu, ""


def presets(pool, everything=False):
    cases = [c for c in CASES if everything or c.name not in LONG]
    jobs = [(c, name, None) for c in cases for name in PRESETS] + [(c, "reference", {"refine": "1"}) for c in cases]
    jobs.sort(key=lambda j: j[1] != "reference" or bool(j[2]))
    found = dict(zip(((c.name, name, bool(k)) for c, name, k in jobs), pool.map(preset_run, jobs)))
    head = [f"{name}: {what}" for name in PRESETS for what in ("error %", "to the limit %", "iterations", "CPU s")]
    lines = ["| problem | mesh | quantity | " + " | ".join(head) + " |", "|---" * (3 + len(head)) + "|"]
    within = {name: [0, 0, 0, 0] for name in PRESETS}
    price = {name: [] for name in PRESETS}
    far = {name: [] for name in PRESETS}
    for c in cases:
        runs = {name: found[c.name, name, False] for name in PRESETS}
        middle = found[c.name, "reference", True]
        some = next((r[1] for r in runs.values() if r[1]), [])
        for name in PRESETS:
            if runs[name][1] and runs["balanced"][1]:
                price[name].append((runs[name][3] / runs["balanced"][3], runs[name][2] / max(1, runs["balanced"][2])))
        for k in range(len(some)):
            limit = None
            if middle[1] and runs["reference"][1] and c.kind in ("end", "path"):
                v1, v2 = middle[1][k][1], runs["reference"][1][k][1]
                limit = v2 + (v2 - v1) / 3
                if abs(limit) < 1e-3 * max(abs(n[1]) for n in some):
                    limit = None
            row = []
            for name in PRESETS:
                mesh, numbers, iterations, cpu, message = runs[name]
                if numbers is None:
                    row += [f"stops: {message}", "", f"{iterations}", f"{cpu:.2f}"]
                    continue
                error, off = numbers[k][2], None if limit is None else 100 * (numbers[k][1] / limit - 1)
                row += ["–" if error is None else f"{error:+.2f}", "–" if off is None else f"{off:+.2f}", str(iterations) if k == 0 else "", f"{cpu:.2f}" if k == 0 else ""]
                aim = 0.1 if name == "reference" else 1.0
                for i, e in ((0, error), (2, off)):
                    if e is not None:
                        within[name][i] += abs(e) <= aim
                        within[name][i + 1] += 1
                if (off is not None and abs(off) > aim) or (off is None and error is not None and abs(error) > aim):
                    far[name].append(f"{c.name} {numbers[k][0].split(',')[0]} {off if off is not None else error:+.2f}")
            lines.append(f"| {c.name if k == 0 else ''} | {runs['balanced'][0] if k == 0 else ''} | {some[k][0].split(',')[0]} | " + " | ".join(row) + " |")
    lines += ["", "| preset | CPU / balanced: mean | least | most | iterations / balanced: mean | within 1 % (`reference`: 0.1 %) of the published values | the same, of the limit of refinement |", "|---|---|---|---|---|---|---|"]
    for name in PRESETS:
        cpu, its = zip(*price[name])
        a = within[name]
        lines.append(f"| `{name}` | {exp(sum(map(log, cpu)) / len(cpu)):.2f} | {min(cpu):.2f} | {max(cpu):.1f} | {exp(sum(map(log, its)) / len(its)):.2f} | {a[0]} of {a[1]} | {a[2]} of {a[3]} |")
    lines += ["", *(f"Farther than that under `{name}` (from the limit where there is one): {'; '.join(far[name]) or 'none'}." for name in PRESETS[1:])]
    return lines


def points(pool):
    """Instructions of an element of a linear law by thickness points: the difference of two runs."""
    def kernel(level, elements, n):
        return sum(instructions.count([KERNEL, "points", str(level), str(elements), str(n)]).values())
    numbers, levels = (1, 2, 3, 5, 9), {"energy": 0, "force": 1, "force + tangent": 2}
    jobs = [(level, e, n) for level in levels.values() for n in numbers for e in (640, 1280)]
    found = dict(zip(jobs, pool.map(lambda j: kernel(*j), jobs)))
    each = {(level, n): (found[level, 1280, n] - found[level, 640, n]) / 640 for level in levels.values() for n in numbers}
    lines = ["| | " + " | ".join(f"{n} points" for n in numbers) + " | a point | all points of 3 | without any: times cheaper |", "|---" * (len(numbers) + 4) + "|"]
    for name, level in levels.items():
        a = (each[level, 9] - each[level, 1]) / 8
        lines.append(f"| {name} | " + " | ".join(f"{each[level, n]:.0f}" for n in numbers)
                     + f" | {a:.0f} | {100 * 3 * a / each[level, 3]:.1f} % | {each[level, 3] / (each[level, 3] - 3 * a):.2f} |")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("tables", nargs="*", metavar="presets, switches, points")
    options = parser.parse_args()
    makers = {"presets": presets, "switches": switches, "points": points}
    if set(options.tables) - set(makers):
        parser.error(f"there is no table {min(set(options.tables) - set(makers))!r}; there are: {', '.join(makers)}")
    for name in options.tables or makers:
        with ThreadPoolExecutor(options.jobs) as pool:
            lines = "\n".join(makers[name](pool, *([options.all] if name == "presets" else [])))
        page, begin, end = PAGE.read_text(), f"<!-- {name}: bench/switches.py -->\n", f"\n<!-- end of {name} -->"
        before, rest = page.split(begin)
        PAGE.write_text(before + begin + lines + rest[rest.index(end):])


if __name__ == "__main__":
    try:
        main()
    except subprocess.CalledProcessError as error:
        sys.exit(str(error))
