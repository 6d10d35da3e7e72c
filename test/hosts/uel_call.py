"""A host of the UEL in a few lines: builds it, calls uel_ as Abaqus does in a static step, treats rotations in the three ways."""
import ctypes
import os
import subprocess
from pathlib import Path

import numpy as np

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
ADDED, COMPOUNDED, KEPT = 1, 2, 3  # PROPS(8)


def build(folder):
    """The user element as api/abaqus/Makefile makes it."""
    subprocess.run(["make", "-s", "-C", SOURCE / "api/abaqus", f"BUILD={folder}", f"FC={os.environ['FINSHELL_FC']}",
                    f"FINSHELL_LIB={os.environ['FINSHELL_LIB']}"], check=True)
    return folder / "libfinshell_uel.so"


def build_laws(source, folder, name="liblaws.so"):
    """A shared library of laws from a source in C (doc/user_laws.md), for FINSHELL_LAWS and law 99."""
    library = folder / name
    subprocess.run([os.environ["FINSHELL_CC"], "-O2", "-fPIC", "-shared", f"-I{SOURCE / 'api'}", source, "-o", library, "-lm"], check=True)
    return library


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


class Refused(Exception):
    """PNEWDT was lowered."""


class Element:
    """uel_ with the arguments that Abaqus passes in a static step."""

    def __init__(self, library, properties, variables):
        self.call = ctypes.CDLL(str(library)).uel_
        self.properties = np.array(properties)
        self.variables = variables

    def __call__(self, number, coordinates, u, du, increment, state=None, pressure=None):
        """RHS and AMATRX. coordinates: (3, MCRD). state: SVARS, changed. pressure: load type U1 of this magnitude."""
        rhs, matrix = np.zeros((2, 18)), np.zeros((18, 18))
        energy, increments = np.zeros(8), np.zeros((2, 18))
        state = np.zeros(self.variables) if state is None else state
        increments[0] = du
        flags = np.array([1, 1, 1, 0, 0], dtype=np.int32)
        none, time = np.zeros(18), np.zeros(2)

        def i(value):
            return ctypes.byref(ctypes.c_int32(value))

        def d(value):
            return ctypes.byref(ctypes.c_double(value))

        def p(array):
            return array.ctypes.data_as(ctypes.c_void_p)

        loads = 0 if pressure is None else 1
        kind, magnitude, change = (i(1), d(pressure), d(0.0)) if loads else (None, None, None)
        smaller = ctypes.c_double(1e36)
        self.call(p(rhs), p(matrix), p(state), p(energy), i(18), i(2), i(self.variables), p(self.properties),
                  i(len(self.properties)), p(coordinates), i(coordinates.shape[1]), i(3), p(u), p(increments), p(none), p(none), i(1),
                  p(time), d(0.1), i(1), i(increment), i(number), p(none), i(loads), kind, magnitude, None, i(0), p(flags), i(18),
                  change, i(loads), ctypes.byref(smaller), None, i(0), d(1.0))
        if smaller.value < 1:
            raise Refused(f"element {number} asks for a smaller increment, {smaller.value}, with RHS(1, 1) = {rhs[0, 0]}")
        return rhs[0], matrix.T


def solve(element, rotations, points, triangles, free, loads, pressures=None, normals=None, tolerance=1e-8):
    """All unknowns (nodes, 6), and the largest corrections of each increment.

    loads: (nodes, 6) at the end of each increment in turn. normals: (elements, 3, 3), behind the coordinates of the nodes.
    """
    u = np.zeros((len(points), 6))
    states = np.zeros((len(triangles), element.variables))
    history = []
    for increment, load in enumerate(loads, 1):
        start = u.copy()
        history.append([])
        for _ in range(25):
            force, matrix = load.ravel().copy(), np.zeros((u.size, u.size))
            after = states.copy()
            for number, nodes in enumerate(triangles, 1):
                rows = (6 * nodes[:, None] + np.arange(6)).ravel()
                x = points[nodes] if normals is None else np.hstack([points[nodes], normals[number - 1]])
                r, k = element(number, np.ascontiguousarray(x), np.ascontiguousarray(u[nodes]).ravel(), (u - start)[nodes].ravel(),
                               increment, after[number - 1], None if pressures is None else pressures[increment - 1])
                force[rows] += r
                matrix[np.ix_(rows, rows)] += k
            correction = np.zeros(u.size)
            correction[free] = np.linalg.solve(matrix[np.ix_(free, free)], force[free])
            correction = correction.reshape(u.shape)
            turned = u[:, 3:] + correction[:, 3:]
            if rotations == COMPOUNDED:
                turned = np.array([log(exp(spin) @ exp(old)) for spin, old in zip(correction[:, 3:], u[:, 3:])])
            u = np.hstack([u[:, :3] + correction[:, :3], turned])
            history[-1].append(np.abs(correction).max())
            if history[-1][-1] < tolerance:
                break
        states = after
    return u, history
