#!/usr/bin/env python3
"""Elements and structures along the axes on which inputs can be extreme: digits kept, iterations, where it ends and how it says so.

    test_extremes.py [--all] [--page FILE]

`make test` runs a bounded part, `make test-extremes` all, and writes doc/extremes.md. Fails where a value is wrong without a word,
where an element keeps fewer than 8 digits for no reason of its input, where a run ends otherwise than expected, or writes NaN.
"""
import argparse
import csv
import math
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import structures

FINSHELL = os.environ["FINSHELL_BIN"]
PROGRAMS = Path(os.environ["FINSHELL_BINARY_DIR"]) / "test" / "bin"
DATA = Path(os.environ["FINSHELL_SOURCE_DIR"]) / "test" / "data"
PATIENCE = 300  # seconds of the clock: what takes longer on a busy machine hangs
SENTENCE = {-2: "no area, or a size beyond 1e-60 to 1e60", 1: "the element has collapsed", 2: "the material law cannot be evaluated at this strain",
            3: "a nodal rotation relative to its element nears pi"}


def run(case, seconds):
    """Exit code, last sentence, values of the monitors, increments, iterations."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "case.nml").write_text(case.text)
        for name, text in case.files.items():
            (Path(folder) / name).write_text(text)
        try:
            done = subprocess.run([FINSHELL, "run", "case.nml"], cwd=folder, capture_output=True, text=True, check=False, timeout=seconds,
                                  env={**os.environ, "OMP_NUM_THREADS": "1"})
        except subprocess.TimeoutExpired:
            return -1, f"not done after {seconds} s", {}, 0, 0
        history = Path(folder) / "case.history.csv"
        rows = list(csv.DictReader(history.read_text().splitlines())) if history.exists() else []
    values = {k: float(v) for k, v in rows[-1].items()} if rows else {}
    counts = re.search(r"(\d+) increments?, (\d+) iterations?", done.stdout)
    sentence = [line for line in done.stderr.splitlines() if line.strip()]
    return done.returncode, " ".join(sentence), values, *(map(int, counts.groups()) if counts else (0, 0))


def judge(case, seconds=PATIENCE):
    """Error (None where the run ended early), a line for the page, and what is wrong."""
    code, sentence, values, increments, iterations = run(case, seconds)
    wrong = ""
    if any(math.isnan(v) or math.isinf(v) for v in values.values()):
        return None, "NaN", "writes NaN"
    if code == 0:
        scale = case.scale or max((abs(v) for v in case.exact.values()), default=1.0)
        error = max((abs(values[k] - v) / scale for k, v in case.exact.items()), default=0.0)
        if case.ends and not case.exact:
            return error, f"{increments}/{iterations}", ""
        if not error <= case.bound:
            wrong = f"error {error:.1e}, expected {case.bound:.0e}; {sentence}"
        return error, f"{increments}/{iterations}", wrong
    if not case.ends or case.ends not in sentence or code not in (1, 2):
        wrong = f"ends with {code}: {sentence}"
    return None, sentence, wrong


def elements():
    """Lines of precision_reference for the axes: axis -> list of (value, refused of eight, code, error, reason)."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "axes"
        subprocess.run([PROGRAMS / "precision_axes", file], check=True)
        done = subprocess.run([PROGRAMS / "precision_reference", file, "all"], capture_output=True, text=True, check=False)
    axes = {}
    for line in done.stdout.splitlines()[1:]:
        words = line.split(maxsplit=11)
        refused, code, _, count = map(int, words[:4])
        axes.setdefault(words[11], []).append((float(words[10]), refused, count, code, max(map(float, words[4:7])), int(words[7]) + int(words[8])))
    return axes, done.returncode


def number(value):
    text = f"{value:.10g}"
    return text if len(text) < 8 else f"{value:.3g}" if abs(value - float(f"{value:.3g}")) <= 1e-12 * abs(value) else f"{value:.12g}"


def digits(error):
    return "16" if error < 1e-16 else f"{-math.log10(error):.1f}"


def element_table(axis, rows):
    kept = ["refused" if refused == count else digits(error) + ("*" if reasons else "") for _, refused, count, _, error, reasons in rows]
    codes = sorted({code for _, refused, _, code, _, _ in rows if refused})
    lines = [f"**{axis}**", "", "| | " + " | ".join(number(r[0]) for r in rows) + " |", "|---" * (len(rows) + 1) + "|", "| digits | " + " | ".join(kept) + " |"]
    if codes:
        lines += ["", "refused: " + "; ".join(SENTENCE[code] for code in codes)]
    return lines + [""]


def structure_table(axis, rows):
    lines = [f"**{axis}**" + (f" ({rows[0][0].also})" if rows[0][0].also else ""), "",
             "| | " + " | ".join(number(case.value) for case, _, _ in rows) + " |", "|---" * (len(rows) + 1) + "|",
             "| error | " + " | ".join("ends" if error is None else f"{error:.0e}" if case.exact else "done" for case, error, _ in rows) + " |",
             "| increments/iterations | " + " | ".join("" if error is None else line for _, error, line in rows) + " |"]
    for case, error, line in rows:
        if error is None:
            lines += ["", f"{number(case.value)}: {line}"]
    return lines + [""]


PAGE = """# The extremes

Where double precision, the element and the solver end, and with which sentence. Made by `make test-extremes` (`make test` runs most of it); do not edit.

## Elements

Eight random triangles at each value, sides about 1, h/L 0.02, stretched by 1.1 and 0.95, turned by 1 rad, nodes turned further by 0.02 rad, incompressible Mooney-Rivlin; but for what the axis changes.
Digits: the least of energy, force and tangent, against the same sources in quadruple precision fed with the same doubles. A star: fewer than 8 in some element because the input itself, rounded in its last place,
says no more. Refused: with a code and a sentence, never a number.

"""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--all", action="store_true", default=os.environ.get("FINSHELL_EXTREMES") == "all")
    parser.add_argument("--page", default=os.environ.get("FINSHELL_EXTREMES_PAGE"))
    options = parser.parse_args()
    failures = []
    axes, code = elements()
    if code or sum(map(len, axes.values())) < 200:
        failures.append(f"elements: precision_reference ends with {code}, {sum(map(len, axes.values()))} values")

    _, _, base, _, _ = run(structures.Case("", 0, structures.cantilever(), {}), PATIENCE)
    _, _, linear, _, _ = run(structures.Case("", 0, structures.cantilever(step="control = 'linear'", force=1.0), {}), PATIENCE)
    structures.BASE.update({k: base[k] for k in "uw"})
    slope = linear["w"]
    rows = list(csv.DictReader((DATA / "elastica_cantilever_end_shear.csv").read_text().splitlines()))
    elastica = next((float(r["P"]), float(r["U_inext"]), float(r["W_inext"])) for r in rows if float(r["P"]) == 4.0)
    cases = [c for c in structures.all_cases(elastica, 0.653, slope) if options.all or not c.long]
    with ThreadPoolExecutor(os.cpu_count() if options.all else 1) as pool:
        results = list(pool.map(lambda c: judge(c, 3600 if c.long else PATIENCE), cases))
    tables = {}
    for case, (error, line, wrong) in zip(cases, results):
        tables.setdefault(case.axis, []).append((case, error, line))
        if wrong:
            failures.append(f"{case.axis}, {number(case.value)}: {wrong}")
    if options.page:
        lines = PAGE.splitlines()
        for axis, values in axes.items():
            lines += element_table(axis, values)
        lines += ["## Structures", "", "Error relative to the exact value (or to the same structure in other units), on the mesh at hand where one is named; increments and iterations; where a run ends, its sentence.", ""]
        for axis, values in tables.items():
            lines += structure_table(axis, values)
        Path(options.page).write_text("\n".join(lines).rstrip() + "\n")
    print(f"{sum(map(len, axes.values()))} values on {len(axes)} axes of elements, {len(cases)} structures on {len(tables)} axes")
    if failures:
        sys.exit("\n".join(failures))


main()
