"""The input file for Abaqus, read and solved as its manual says, with the UEL: compounded rotations, increments, equilibrium.

Abaqus itself is not to be had here. This shows that the file is complete and consistent (nodes, elements, properties, supports,
loads), and that PROPS(8) = 2 fits a host that compounds: U(4:6) is the vector of exp(correction) R, corrections are spins.
"""
import os
import sys
import tempfile
from pathlib import Path

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])

try:
    import numpy as np

    import host_cases
    import uel_call
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)


def read_deck(path):
    """Keywords in order: (name, options, data lines as lists of text)."""
    blocks = []
    for line in path.read_text().splitlines():
        if line.startswith("**") or not line.strip():
            continue
        words = [word.strip() for word in line.split(",")]
        if line.startswith("*"):
            options = dict((w.split("=") + [""])[:2] for w in words[1:])
            blocks.append((words[0][1:].upper(), options, []))
        else:
            blocks[-1][2].append([word for word in words if word])
    return blocks


def solve(blocks, library):
    """Displacements (nodes, 3), and the largest corrections of each increment."""
    data = {name: lines for name, _, lines in blocks}
    options = {name: option for name, option, _ in blocks}
    sets = {option["NSET"]: [int(w) - 1 for line in lines for w in line] for name, option, lines in blocks if name == "NSET"}
    points = np.array([[float(w) for w in line[1:]] for line in data["NODE"]])
    triangles = np.array([[int(w) - 1 for w in line[1:]] for line in data["ELEMENT"]])
    properties = [float(w) for line in data["UEL PROPERTY"] for w in line]
    if len(properties) != int(options["USER ELEMENT"]["PROPERTIES"]) or properties[7] != 2:
        sys.exit(f"FAILED the properties of the input file are {properties}")
    element = uel_call.Element(library, properties, int(options["USER ELEMENT"]["VARIABLES"]))
    free = np.ones((len(points), 6), dtype=bool)
    for name, first, last in data["BOUNDARY"]:
        free[sets[name], int(first) - 1:int(last)] = False
    free = free.ravel()
    load = np.zeros((len(points), 6))
    for name, component, value in data["CLOAD"]:
        load[sets[name], int(component) - 1] += float(value)
    first_increment, period = (float(w) for w in data["STATIC"][0][:2])
    increments = round(period / first_increment)
    u, history = uel_call.solve(element, uel_call.COMPOUNDED, points, triangles, free,
                                [load * k * first_increment / period for k in range(1, increments + 1)])
    return points, triangles, u, history


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        library = uel_call.build(folder)
        case = host_cases.solve("cantilever", folder)
        points, triangles, u, history = solve(read_deck(SOURCE / "api/abaqus/cantilever.inp"), library)
    failures = []
    if not (np.abs(points - case.points).max() < 1e-12 and np.array_equal(triangles, case.triangles)):
        failures.append("the mesh of the input file is not that of the driver")
    error = case.error(u[:, :3])
    turned = np.abs(u[:, 3:] - case.rotation).max()
    print(f"{sum(map(len, history))} iterations in {len(history)} increments, difference from the driver {error:.1e}, "
          f"rotations {turned:.1e}")
    if "-v" in sys.argv:
        print("corrections of the last increment:", *(f"{c:.1e}" for c in history[-1]))
    if not max(error, turned) < 1e-6:
        failures.append(f"the result differs by {error:.1e}, rotations by {turned:.1e}, expected 1e-6")
    for number, corrections in enumerate(history, 1):
        if not corrections[-1] < max(corrections[-2] ** 1.4, 1e-11):
            failures.append(f"increment {number}: corrections {corrections[-2]:.1e}, {corrections[-1]:.1e} are not quadratic")
    for failure in failures:
        print("FAILED", failure)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
