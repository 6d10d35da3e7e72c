#!/usr/bin/env python3
"""Cost of an implicit increment in time beside a static one: instructions of the spherical cap, quarter, N x N.

    bench/dynamics.py [N]

Counted by callgrind, as the difference of runs of 5 and of 15 increments of one size, so that reading and setting up do not count. FINSHELL_BIN names the program.
"""
import os
import sys
import tempfile
from pathlib import Path

from benchmark_run import EXAMPLES, solve, with_step
from instructions import count

FEW, MANY = 5, 15
STATIC = "automatic = .false. first_increment = {size} load_factor = {end}"
MOVING = "control = 'dynamic' automatic = .false. first_increment = {size} duration = {end} scheme = '{scheme}'"


def cost(text, step, size, **keys):
    """Instructions and iterations of an increment."""
    found = []
    for increments in (FEW, MANY):
        case = with_step(text, step.format(size=size, end=size * increments, **keys))
        solution = solve(case)
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "input.nml").write_text(case)
            total = sum(count([os.environ["FINSHELL_BIN"], "run", "input.nml", "-q"], folder).values())
        found.append((total, solution.iterations, solution.increments))
    (a, i, n), (b, j, m) = found
    return (b - a) / (m - n), (j - i) / (m - n)


def main():
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 16
    text = (EXAMPLES / "spherical_cap_dynamic/input.nml").read_text().replace("divisions = 16, 16", f"divisions = {n}, {n}")
    text = text.replace("every = 20", "every = 0")
    rows = {"static, load control": cost(text, STATIC, 0.02),
            "generalised alpha": cost(text, MOVING, 2e-6, scheme="generalised_alpha"),
            "conserving": cost(text, MOVING, 2e-6, scheme="conserving")}
    base = rows["static, load control"]
    print(f"{'':22} instructions/increment  iterations  ratio  ratio per iteration")
    for name, (instructions, iterations) in rows.items():
        print(f"{name:22} {instructions:22.4g} {iterations:11.2f} {instructions / base[0]:6.2f} {instructions / iterations * base[1] / base[0]:20.2f}")


if __name__ == "__main__":
    main()
