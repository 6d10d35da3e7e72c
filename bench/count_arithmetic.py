#!/usr/bin/env python3
"""Counts the floating-point operations of one element, from executed instructions.

usage: bench/count_arithmetic.py [--check]

Builds the kernel and bench_kernel as scalar code without fused operations (gfortran -O1, SSE2) in a temporary directory and runs it
under valgrind --tool=callgrind. The executions of add, sub, mul, div and sqrt in double precision are summed, packed ones times two;
the count per element is the difference of two run lengths. Writes bench/arithmetic.inc; with --check compares instead,
exit code 1 when a figure there is off by more than 2 %. Needs gfortran, valgrind, objdump.
"""
import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FIGURES = ROOT / "bench" / "arithmetic.inc"
FOLDERS = ("base", "math", "material", "section", "element", "batch")
FLAGS = "-std=f2018 -cpp -ffree-line-length-none -O1 -fno-tree-vectorize -ffp-contract=off -fno-math-errno -fno-trapping-math -fno-pie"
LEVELS = ("energy", "force", "tangent")
SHORT, LONG = 64, 192  # elements
WIDTH = {f"{operation}{kind}": width for operation in ("add", "sub", "mul", "div", "sqrt") for kind, width in (("sd", 1), ("pd", 2))}


def in_order(files):
    """Sources in an order in which they compile: a module before its users."""
    text = {file: file.read_text() for file in files}
    owner = {m[1].lower(): f for f, t in text.items() for m in re.finditer(r"^ *module +(?!procedure)(\w+)", t, re.M | re.I)}
    ordered = []

    def visit(file):
        if file in ordered:
            return
        for module in re.findall(r"^ *use +(\w+)", text[file], re.M | re.I):
            if owner.get(module.lower(), file) != file:
                visit(owner[module.lower()])
        ordered.append(file)

    for file in sorted(files):
        visit(file)
    return ordered


def build(folder):
    """The scalar bench_kernel."""
    sources = [f for name in FOLDERS for f in (ROOT / "src" / name).iterdir() if f.suffix in (".f90", ".F90")]
    sources = in_order(sources + [ROOT / "bench" / "bench_kernel.f90"])
    objects = [folder / f"{file.stem}.o" for file in (ROOT / "src" / "base").glob("*.c")]
    for compiled in objects:
        subprocess.run(["gcc", "-O1", "-c", "-o", str(compiled), str(ROOT / "src" / "base" / f"{compiled.stem}.c")], check=True)
    subprocess.run(["gfortran", *FLAGS.split(), "-no-pie", "-o", "bench", *map(str, sources + objects)], cwd=folder, check=True)
    return folder / "bench"


def operations(program):
    """Address -> flop of an instruction."""
    listing = subprocess.run(["objdump", "-d", "--no-show-raw-insn", str(program)], check=True, capture_output=True, text=True).stdout
    found = re.findall(r"^ *([0-9a-f]+):\s+v?(\w+)", listing, re.M)
    return {int(address, 16): WIDTH[name] for address, name in found if name in WIDTH}


def executed_flop(program, flop, level, elements):
    """Flop of one run."""
    out = program.parent / f"{level}.{elements}"
    subprocess.run(["valgrind", "--tool=callgrind", "--dump-instr=yes", "--compress-pos=no", "--compress-strings=no",
                    f"--callgrind-out-file={out}", str(program), "count", str(level), str(elements)],
                   check=True, capture_output=True)
    total, own, after_call = 0, False, False
    for line in out.read_text().splitlines():
        if line.startswith("ob="):
            own = line.endswith("/" + program.name)
        elif line.startswith("calls="):
            after_call = True  # the next line holds what was called, counted there
        elif line.startswith("0x"):
            if own and not after_call:
                address, _, count = line.split()
                total += flop.get(int(address, 16), 0) * int(count)
            after_call = False
    return total


def count():
    """Flop per element for each level."""
    with tempfile.TemporaryDirectory() as folder:
        program = build(Path(folder))
        flop = operations(program)
        return {name: round((executed_flop(program, flop, level, LONG) - executed_flop(program, flop, level, SHORT)) / (LONG - SHORT))
                for level, name in enumerate(LEVELS)}


def main():
    """Counts, then writes or checks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare with bench/arithmetic.inc instead of writing it")
    check = parser.parse_args().check
    counted = count()
    text = FIGURES.read_text()
    stale = False
    for name, value in counted.items():
        entry = re.search(rf"flop_{name} = (\d+)", text)
        stale = stale or abs(int(entry[1]) - value) > 0.02 * value
        print(f"{name:8}{value:7} flop per element, {int(entry[1])} in {FIGURES.name}")
        text = text.replace(entry[0], f"flop_{name} = {value}")
    if check:
        print("off by more than 2 %: run bench/count_arithmetic.py" if stale else "up to date")
        return int(stale)
    FIGURES.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
