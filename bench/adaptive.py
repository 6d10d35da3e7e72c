#!/usr/bin/env python3
"""Error over CPU time: meshes refined as a whole against meshes refined where it pays (&accuracy).

    bench/adaptive.py [--cases disk,roof,...] [--repeat 3] [--write] [--note TEXT]

Each point is a process of its own on one thread: of the uniform ones `finshell run --refine N`, of the adaptive ones a run with a smaller
target. Its CPU time is that of the process, the least of --repeat. Errors are those of the last mesh against a reference: published, closed
form, or extrapolated from the finest meshes of both kinds, which the table says. The ratio is that of the CPU time to that of uniform
refinement at equal error, interpolated between its meshes; ladder: to that of this mesh and all coarser ones. --write puts the tables into doc/adaptive.md.
"""
import argparse
import csv
import datetime
import math
import os
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FINSHELL = os.environ.get("FINSHELL_BIN") or str(ROOT / "build/bin/finshell")
DOCUMENT = ROOT / "doc/adaptive.md"
SHEET = """&mesh generator = 'hole' lengths = 30, 20 radius = 1 {mesh} /
&material name = 'elastic' law = 'linear_elastic' e = 1e3 nu = 0.3 /
&section thickness = 1 direction = 1, 0, 0 /
&support node_set = 'all' fixed = 'uz', 'rx', 'ry' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'line' edge_set = 'edge_x1' vector = 1.0, 0, 0 /
&step control = 'linear' /
&monitor name = 'peak' quantity = 'membrane_force' component = '11' node_set = 'corner_hole_x0' /
&monitor name = 'opening' quantity = 'displacement' component = 'x' node_set = 'corner_hole_y0' /
"""


class Case:
    """A job on its coarsest mesh: whether its solution is local, its monitor, how fine uniform meshes go, targets, the reference."""

    def __init__(self, title, local, text, monitor, levels, targets, reference=None, source="", goal=None):
        self.title, self.local, self.text, self.monitor, self.levels = title, local, text, monitor, levels
        self.targets, self.reference, self.source = targets, reference, source
        self.goal = monitor if goal is None else goal


def example(name, *changes):
    """The input of an example with other divisions."""
    file = next((ROOT / "examples" / name).glob("*.nml"))
    text = file.read_text()
    for old, new in changes:
        if not re.search(old, text):
            sys.exit(f"{file} has no {old}")
        text = re.sub(old, new, text)
    return text


def cases():
    """All of them, by name."""
    half = [2.0**-k for k in range(4, 13)]
    return {
        "disk": Case("Rubber disk, 70 psi (rim layer)", True, example("rubber_disk", (r"rings = 19", "rings = 4"), (r"core = 6.*", "core = 2")),
                     "w", 4, half[2:8]),
        "hole": Case("Stretched sheet with a hole, opening, mesh graded to the hole", True, SHEET.format(mesh="divisions = 8, 6"), "opening", 5, half[:7]),
        "hole_plain": Case("Stretched sheet with a hole, opening, equal cells outwards", True, SHEET.format(mesh="divisions = 8, 6 grading = 1"),
                           "opening", 5, half[:7], 0.0030111, "from the graded meshes"),
        "hole_peak": Case("Stretched sheet with a hole, peak stress, energy norm", True, SHEET.format(mesh="divisions = 8, 6 grading = 1"), "peak", 6,
                          half[2:6], 3.0078, "Heywood", goal=""),
        "roof": Case("Scordelis-Lo roof, linear", False, example("scordelis_lo", ("divisions = 16, 16", "divisions = 4, 4")), "w", 4, half[:7], -0.300591, "uniform meshes of 32 768 elements"),
        "hemisphere": Case("Pinched hemisphere, linear", True, example("pinched_hemisphere", ("divisions = 16, 16", "divisions = 4, 4")), "u", 5, half[:8]),
        "hemisphere_large": Case("Hemisphere with a hole, large displacements (Sze 3.4)", False,
                                 example("sze34", (r"divisions = \d+, \d+", "divisions = 4, 4")), "V_A", 5, half[:8]),
    }


def cpu_of(command, folder):
    """CPU seconds of a process, and what it wrote."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, cwd=folder, env={**os.environ, "OMP_NUM_THREADS": "1"}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)} failed:\n{done.stdout}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def last_row(file):
    with open(file) as stream:
        return list(csv.DictReader(stream))[-1]


def elements_of(folder, text, level):
    """Number of elements of a uniform mesh."""
    Path(folder, "check.nml").write_text(text)
    output = subprocess.run([FINSHELL, "check", "check.nml", "--refine", str(level)], cwd=folder, stdout=subprocess.PIPE, text=True).stdout
    return int(re.search(r"(\d+) elements", output).group(1))


def solve(case, repeat):
    """Points (elements, value, CPU seconds) of uniform and of adaptive runs; the latter with target, estimate and meshes."""
    text = re.sub(r"name\s*=\s*'[^']*'\s*/", "/", case.text, count=1) if case.text.lstrip().startswith("&job") else case.text
    text = re.sub(r"(&job[^/]*?)name = '\w+'", r"\1", text)
    uniform, adaptive = [], []
    with tempfile.TemporaryDirectory() as folder:
        plain = text + "&output every = 0 /\n"
        for level in range(case.levels + 1):
            Path(folder, "uniform.nml").write_text(plain)
            seconds = min(cpu_of([FINSHELL, "run", "uniform.nml", "-q", "--refine", str(level)], folder) for _ in range(repeat))
            value = float(last_row(f"{folder}/uniform.history.csv")[case.monitor])
            uniform.append((elements_of(folder, text, level), value, seconds))
        for target in case.targets:
            goal = f"monitor = '{case.goal}'" if case.goal else ""
            Path(folder, "adaptive.nml").write_text(plain + f"&accuracy target = {target} {goal} most_elements = 300000 /\n")
            seconds = min(cpu_of([FINSHELL, "run", "adaptive.nml", "-q"], folder) for _ in range(repeat))
            row = last_row(f"{folder}/adaptive.meshes.csv")
            value = float(last_row(f"{folder}/adaptive.history.csv")[case.monitor])
            adaptive.append((int(row["elements"]), value, seconds, target, float(row["estimate"]), int(row["mesh"])))
    return uniform, adaptive


def extrapolated(uniform):
    """The limit of the last three uniform meshes by Richardson, of their own order."""
    a, b, c = (point[1] for point in uniform[-3:])
    rate = (b - a)/(c - b)
    return c + (c - b)/(rate - 1) if rate > 1 else c


def uniform_cost(uniform, reference, error):
    """CPU seconds at which uniform refinement has this error, on lines of log over log; beyond its finest mesh along the last line."""
    points = [(abs(value - reference), seconds) for _, value, seconds in uniform]
    for (e1, c1), (e2, c2) in list(zip(points, points[1:])):
        if e2 <= error <= e1:
            break
    else:
        if error > points[0][0]:
            return points[0][1]
        (e1, c1), (e2, c2) = points[-2:]
    return math.exp(math.log(c1) + (math.log(c2) - math.log(c1))*(math.log(error) - math.log(e1))/(math.log(e2) - math.log(e1)))


def table(case, uniform, adaptive):
    """Markdown of one case."""
    reference = case.reference if case.reference is not None else extrapolated(uniform)
    lines = [f"### {case.title}", "", f"Reference {reference:.6g} ({case.source or 'extrapolated from the finest uniform meshes'}).", "",
             "| meshes | target | elements | error | estimate | CPU s | CPU of uniform at this error | ratio | ladder |", "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"]
    for elements, value, seconds in uniform:
        lines.append(f"| uniform | – | {elements} | {abs(value/reference - 1):.2e} | – | {seconds:.2f} | – | – | – |")
    ladder = [(elements, value, sum(point[2] for point in uniform[:i + 1])) for i, (elements, value, _) in enumerate(uniform)]
    for elements, value, seconds, target, estimate, meshes in adaptive:
        error = max(abs(value - reference), 1e-12)
        cost = uniform_cost(uniform, reference, error)
        all_costs = uniform_cost(ladder, reference, error)
        lines.append(f"| {meshes} | {target:.2g} | {elements} | {abs(value/reference - 1):.2e} | {estimate:.2e} | {seconds:.2f} | {cost:.2f} | {seconds/cost:.2f} | {seconds/all_costs:.2f} |")
    return lines + [""]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", default="")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--note", default="")
    options = parser.parse_args()
    known = cases()
    lines = []
    for name in options.cases.split(",") if options.cases else known:
        uniform, adaptive = solve(known[name], options.repeat)
        part = table(known[name], uniform, adaptive)
        print("\n".join(part), flush=True)
        lines += part
    if not options.write:
        return
    text = DOCUMENT.read_text()
    start, end = "<!-- measured by bench/adaptive.py -->", "<!-- end -->"
    stamp = f"{datetime.date.today()}, one thread, least of {options.repeat}. {options.note}".strip()
    head, rest = text.split(start)
    DOCUMENT.write_text(head + start + "\n" + stamp + "\n\n" + "\n".join(lines) + end + rest.split(end)[1])


if __name__ == "__main__":
    main()
