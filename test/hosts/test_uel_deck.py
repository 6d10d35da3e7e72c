"""The input file for Abaqus, read and solved as its manual says, with the UEL: compounded rotations, increments, equilibrium.

Abaqus itself is not to be had here. This shows that the file is complete and consistent (nodes, elements, properties, supports,
loads), and that PROPS(8) = 2 fits a host that compounds: U(4:6) is the vector of exp(correction) R, corrections are spins.
"""
import ctypes
import os
import subprocess
import sys
import tempfile
from pathlib import Path

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])

try:
    import numpy as np

    import host_cases
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


def exp(vector):
    """Rotation matrix."""
    angle = np.linalg.norm(vector)
    x, y, z = vector
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sinc(angle / np.pi) * k + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * k @ k


def log(r):
    """Rotation vector of a matrix, for angles below pi."""
    axial = 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    sine = np.linalg.norm(axial)
    return axial * (np.arctan2(sine, 0.5 * (np.trace(r) - 1)) / sine if sine > 1e-12 else 1.0)


class Element:
    """uel_ with the arguments that Abaqus passes in a static step."""

    def __init__(self, library, properties, variables):
        self.call = ctypes.CDLL(str(library)).uel_
        self.properties = np.array(properties)
        self.variables = variables

    def __call__(self, number, coordinates, u, du, increment):
        rhs, matrix = np.zeros((2, 18)), np.zeros((18, 18))
        state, energy, increments = np.zeros(self.variables), np.zeros(8), np.zeros((2, 18))
        increments[0] = du
        flags = np.array([1, 1, 1, 0, 0], dtype=np.int32)
        none, time = np.zeros(18), np.zeros(2)

        def i(value):
            return ctypes.byref(ctypes.c_int32(value))

        def d(value):
            return ctypes.byref(ctypes.c_double(value))

        def p(array):
            return array.ctypes.data_as(ctypes.c_void_p)

        smaller = ctypes.c_double(1e36)
        self.call(p(rhs), p(matrix), p(state), p(energy), i(18), i(2), i(self.variables), p(self.properties),
                  i(len(self.properties)), p(coordinates), i(3), i(3), p(u), p(increments), p(none), p(none), i(1), p(time), d(0.1),
                  i(1), i(increment), i(number), p(none), i(0), None, None, None, i(0), p(flags), i(18), None, i(0),
                  ctypes.byref(smaller), None, i(0), d(1.0))
        if smaller.value < 1:
            sys.exit(f"FAILED element {number} asks for a smaller increment")
        return rhs[0], matrix


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
    element = Element(library, properties, int(options["USER ELEMENT"]["VARIABLES"]))
    free = np.ones((len(points), 6), dtype=bool)
    for name, first, last in data["BOUNDARY"]:
        free[sets[name], int(first) - 1:int(last)] = False
    free = free.ravel()
    load = np.zeros((len(points), 6))
    for name, component, value in data["CLOAD"]:
        load[sets[name], int(component) - 1] += float(value)
    first_increment, period = (float(w) for w in data["STATIC"][0][:2])
    u = np.zeros((len(points), 6))
    history = []
    for increment in range(1, round(period / first_increment) + 1):
        start = u.copy()
        history.append([])
        for _ in range(25):
            force, matrix = np.zeros(u.size), np.zeros((u.size, u.size))
            for number, nodes in enumerate(triangles, 1):
                rows = (6 * nodes[:, None] + np.arange(6)).ravel()
                r, k = element(number, np.ascontiguousarray(points[nodes]), np.ascontiguousarray(u[nodes]).ravel(),
                               (u - start)[nodes].ravel(), increment)
                force[rows] += r
                matrix[np.ix_(rows, rows)] += k
            correction = np.zeros(u.size)
            r = force + increment * first_increment / period * load.ravel()
            correction[free] = np.linalg.solve(matrix[np.ix_(free, free)], r[free])
            correction = correction.reshape(u.shape)
            u[:, :3] += correction[:, :3]
            for node, spin in enumerate(correction[:, 3:]):
                u[node, 3:] = log(exp(spin) @ exp(u[node, 3:]))
            history[-1].append(np.abs(correction).max())
            if history[-1][-1] < 1e-8:
                break
    return points, triangles, u, history


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        subprocess.run(["make", "-s", "-C", SOURCE / "api/abaqus", f"BUILD={folder}", f"FC={os.environ['FINSHELL_FC']}",
                        f"FINSHELL_LIB={os.environ['FINSHELL_LIB']}"], check=True)
        case = host_cases.solve("cantilever", folder)
        points, triangles, u, history = solve(read_deck(SOURCE / "api/abaqus/cantilever.inp"), folder / "libfinshell_uel.so")
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
