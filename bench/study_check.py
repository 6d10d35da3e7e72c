#!/usr/bin/env python3
"""How well does `finshell study` predict? The error of the mesh that it advises against the truth: that mesh refined twice.

    bench/study_check.py [--write doc/study.md] [NAME ...]

Prints a table and, with --write, puts it between the marks in the page. FINSHELL_BIN names the program.
"""
import argparse
import csv
import os
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PROGRAM = os.environ.get("FINSHELL_BIN", ROOT / "build" / "bin" / "finshell")
# name: input, accuracy that is asked for
CASES = {
    "Scordelis-Lo roof": ("examples/scordelis_lo/input.nml", "1%"),
    "pinched hemisphere": ("examples/pinched_hemisphere/input.nml", "1%"),
    "water tank": ("examples/water_tank/input.nml", "1%"),
    "heavy elastica": ("examples/heavy_elastica/input.nml", "0.1%"),
    "rubber disk": ("examples/rubber_disk/rubber_disk.nml", "3%"),
    "valve leaflet (Gmsh)": ("bench/study/leaflet.nml", "6%"),
    "airbag": ("bench/study/airbag.nml", "10%"),
}


def rows_of(path):
    return list(csv.DictReader(path.read_text().splitlines()))


def run(folder, *arguments):
    environment = {**os.environ, "OMP_NUM_THREADS": "2" if arguments[0] == "study" else "1"}
    return subprocess.run([str(PROGRAM), *arguments, "-q", "-o", str(folder)], capture_output=True, text=True, timeout=1200, check=False,
                          env=environment).stdout


def measure(path, accuracy, folder):
    """Advised level, and of each monitor: whether it is asymptotic, predicted and true error."""
    text = run(folder, "study", str(ROOT / path), "--budget", "60")
    rows = [r for r in rows_of(next(folder.glob("*.study.csv"))) if r["state"] == "done"]
    levels = sorted({int(r["level"]) for r in rows})
    wanted = float(accuracy.rstrip("%")) / 100
    good = [n for n in levels if all(float(r["relative_error"]) <= wanted for r in rows if int(r["level"]) == n)]
    if not good:
        raise SystemExit(f"{path}: no mesh reaches {accuracy}\n{text}")
    advised = good[0]
    run(folder, "run", str(ROOT / path), "--refine", str(advised + 2))
    truth = rows_of(next(p for p in folder.glob("*.history.csv")))[-1]
    found = []
    for r in rows:
        if int(r["level"]) == advised:
            exact = float(truth[r["monitor"]])
            found.append((r["monitor"], r["asymptotic"] == "yes", float(r["relative_error"]), abs(float(r["value"]) - exact) / abs(exact)))
    return advised, levels[-1], found


def percent(x):
    return f"{100 * x:.2g} %" if x > 1e-9 else "0"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path)
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    lines = ["| input | asked | level | monitor | predicted error | true error | predicted / true |", "| --- | --- | --- | --- | --- | --- | --- |"]
    within = number = 0
    for name, (path, accuracy) in CASES.items():
        if options.names and name not in options.names:
            continue
        with tempfile.TemporaryDirectory() as folder:
            advised, _, found = measure(path, accuracy, Path(folder))
        for monitor, asymptotic, predicted, true in found:
            same = max(predicted, true) < 1e-9
            ratio = "1" if same else f"{predicted / true:.2f}" if true > 0 else "-"
            number += 1
            within += same or (true > 0 and 0.5 <= predicted / true <= 2)
            lines.append(f"| {name} | {accuracy.replace('%', ' %')} | {advised} | `{monitor}` | {percent(predicted)}{'' if asymptotic else ' (not asymptotic)'} "
                         f"| {percent(true)} | {ratio} |")
            print(lines[-1], flush=True)
    lines += ["", f"{within} of {number} monitors within a factor of 2."]
    print(lines[-1])
    if options.write:
        before, rest = options.write.read_text().split("<!-- table -->\n", 1)
        after = rest.split("<!-- end of table -->", 1)[1]
        options.write.write_text(before + "<!-- table -->\n" + "\n".join(lines) + "\n<!-- end of table -->" + after)


if __name__ == "__main__":
    main()
