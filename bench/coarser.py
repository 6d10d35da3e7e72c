#!/usr/bin/env python3
"""What the way costs on the mesh itself and on a coarser one (&accuracy coarser), counted in factorisations of that mesh.

    bench/coarser.py [--problems hemisphere,pull_out,...] [--levels 1,2,3] [--write] [--note TEXT]

Default steps, one thread, no result file. Each run is a process of its own, and its CPU time is all of it: reading, meshes, orderings, the way. Beside it stands that of
one factorisation of the definite tangent at rest of the same mesh (bench_scale, same hour). Difference: of the monitor, from the way on the mesh itself.
--write puts the table into doc/adaptive.md.
"""
import argparse
import csv
import re
import sys
import tempfile
from pathlib import Path

from scale import FINSHELL, HEMISPHERE, PROGRAM, ROOT, machine, number, run

DOCUMENT = ROOT / "doc/adaptive.md"
FORCE_200 = (("1.0, 0.0, 0.0", "200.0, 0.0, 0.0"), ("0.0, -1.0, 0.0", "0.0, -200.0, 0.0"))


def example(name, *changes):
    """The input of an example, without its steps, with other numbers."""
    text = next((ROOT / "examples" / name).glob("*.nml")).read_text(encoding="utf-8")
    text = re.sub(r"&step.*?/\s*(!.*)?\n", "", text, flags=re.S)
    for old, new in changes:
        if not re.search(old, text):
            sys.exit(f"{name} has no {old}")
        text = re.sub(old, new, text)
    return text


def hemisphere(n):
    """The scale problem under the load of the example."""
    text = HEMISPHERE.format(n=n)
    for old, new in FORCE_200:
        text = text.replace(old, new)
    return text + "&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'corner_a0_bottom' /\n"


PROBLEMS = {
    "hemisphere": ("Hemisphere with a hole, R/t = 250, 64×64", lambda: example("sze34", ("divisions = 16, 16", "divisions = 64, 64")), "V_A"),
    "thin": ("the same, R/t = 1000", lambda: example("hemisphere_1e3", ("divisions = 16, 16", "divisions = 64, 64")), None),
    "pull_out": ("Pull-out of a cylinder, 96×64", lambda: example("sze35", ("divisions = 24, 16", "divisions = 96, 64")), "W_A"),
    "slit": ("Slit annular plate, 160×16", lambda: example("sze33", ("divisions = 80, 10", "divisions = 160, 16")), None),
    "disk": ("Rubber disk to 70 psi, 72 rings", lambda: example("rubber_disk", ("rings = 19", "rings = 72"), ("core = 6", "core = 24")), "w"),
    "large_hemisphere": ("Hemisphere, 224×224", lambda: hemisphere(224), "u"),
    "large_disk": ("Rubber disk to 70 psi, 224 rings",
                   lambda: example("rubber_disk", ("rings = 19", "rings = 224"), (r"core = 6[^\n]*", "")), "w"),
}


def follow(folder, text, levels):
    """CPU seconds, iterations on each mesh, elements, last row of the history."""
    group = f"&accuracy coarser = {levels} /\n" if levels else ""
    (folder / "way.nml").write_text(re.sub(r"&job.*?/\s*\n", "", text, flags=re.S) + "&job name = 'way' /\n&step /\n&output every = 0 /\n" + group,
                                    encoding="utf-8")
    out, _, cpu, _ = run([FINSHELL, "run", "way.nml"], folder, 1)
    with (folder / "way.history.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    later = [row["iterations"] for row in rows if float(row.get("mesh", 1)) > 1]
    total = int(re.search(r"increments, (\d+) iterations", out)[1])
    return cpu, [total - sum(map(int, later)), *later], re.findall(r"(\d+) elements", out)[0 if not levels else -1], rows[-1]


def factorisation(folder, text):
    """CPU seconds of one."""
    (folder / "one.nml").write_text(re.sub(r"&job.*?/\s*\n", "", text, flags=re.S) + "&job name = 'one' /\n&step control = 'linear' /\n", encoding="utf-8")
    out, _, _, _ = run([str(PROGRAM), "one.nml"], folder, 1)
    return float(re.search(r"^factorisation\s+\S+\s+(\S+)", out, re.M)[1])


def lines_of(key, levels, folder):
    """Rows of the table of a problem."""
    title, make, monitor = PROBLEMS[key]
    text = make()
    monitor = monitor or re.search(r"&monitor name = '(\w+)'", text)[1]
    one = factorisation(folder, text)
    direct = None
    for level in (0, *levels):
        cpu, iterations, elements, last = follow(folder, text, level)
        value = float(last[monitor])
        difference = "" if direct is None else f"{abs(value / direct - 1):.0e}"
        direct = value if direct is None else direct
        name = f"{title} ({elements} triangles, a factorisation {number(one)} s)" if not level else ""
        yield f"| {name} | {level} | {' + '.join(map(str, iterations))} | {number(cpu)} | {cpu / one:.1f} | {difference} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problems", default=",".join(PROBLEMS))
    parser.add_argument("--levels", default="1,2,3")
    parser.add_argument("--note", default="", help="text beside machine and date")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    lines = [f"Measured on {machine()}, one thread{'; ' * bool(options.note)}{options.note}.", "",
             "| problem | `coarser` | iterations, mesh by mesh | CPU s | in factorisations | difference |", "|---|---|---|---|---|---|"]
    print("\n".join(lines), flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for key in options.problems.split(","):
            for line in lines_of(key, [int(n) for n in options.levels.split(",")], Path(folder)):
                print(line, flush=True)
                lines.append(line)
    if options.write:
        text = DOCUMENT.read_text(encoding="utf-8")
        new = re.sub(r"(<!-- bench/coarser.py -->\n).*(<!-- end of bench/coarser.py -->)", lambda m: m[1] + "\n".join(lines) + "\n" + m[2], text, flags=re.S)
        if new == text:
            sys.exit(f"{DOCUMENT}: no marks of bench/coarser.py")
        DOCUMENT.write_text(new, encoding="utf-8")


if __name__ == "__main__":
    main()
