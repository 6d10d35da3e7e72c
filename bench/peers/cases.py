"""The problems that other programs can run: grids, supports, loads, monitors, the same for all of them.

Loads of symmetric models are those of the inputs in examples/. A grid has (nx + 1)(ny + 1) nodes, number i (ny + 1) + j; i runs along `edges` left to right,
j bottom to top. Degrees of freedom: 0 to 2 displacements, 3 to 5 rotations about x, y, z.
"""
from dataclasses import dataclass, field
from math import cos, pi, sin

import numpy as np


@dataclass
class Problem:
    """What a peer must know. map: (s, t) in the unit square to a point; shape: n of the ladder to (nx, ny)."""
    map: callable
    shape: callable
    e: float
    nu: float
    h: float
    edges: dict                       # left, right, bottom, top -> clamped, symmetry_x/y/z, hinged, diaphragm; absent: free; supported_x: symmetry, and z held
    monitors: list                    # (name, (s, t), dof, factor)
    force: list = field(default_factory=list)   # ((s, t), dof, value)
    line: tuple = ()                  # edge, dof, force per length
    area: tuple = ()                  # dof, force per area
    fixed: list = field(default_factory=list)   # ((s, t), dof): single ones
    steps: int = 20                   # load steps of the first try; halved where Newton fails
    linear: bool = False
    plane: bool = False               # in the plane x, y only
    control: tuple = ()               # (s, t), dof, displacement: prescribed; the monitor is the load factor


EDGES = {"clamped": (0, 1, 2, 3, 4, 5), "symmetry_x": (0, 4, 5), "symmetry_y": (1, 3, 5), "symmetry_z": (2, 3, 4), "hinged": (0, 1, 2), "supported_x": (0, 2, 4, 5), "diaphragm": (0, 2)}


def arc(radius, angle, length):
    """Part of a cylinder about y: s from the crown along the circle, t along y."""
    return lambda s, t: (radius * sin(angle * s), length * t, radius * cos(angle * s))


def annulus(s, t):
    r = 6 + 4 * t
    return r * cos(2 * pi * s), r * sin(2 * pi * s), 0.0


def hemisphere(s, t):
    """s: azimuth; t: from the hole at 18 degrees to the equator."""
    colatitude = pi / 10 + (pi / 2 - pi / 10) * t
    return 10 * sin(colatitude) * cos(pi / 2 * s), 10 * sin(colatitude) * sin(pi / 2 * s), 10 * cos(colatitude)


def cook(s, t):
    low, high = 44 * s, 44 + 16 * s
    return 48 * s, low + (high - low) * t, 0.0


PROBLEMS = {
    "cantilever": Problem(lambda s, t: (10 * s, t, 0.0), lambda n: (n, max(1, n // 16)), 1.2e6, 0.0, 0.1, {"left": "clamped"},
                          [("U", (1, 0), 0, -1), ("W", (1, 0), 2, 1)], line=("right", 2, 4.0), steps=10),
    "slit": Problem(annulus, lambda n: (8 * n, n), 21e6, 0.0, 0.03, {"left": "clamped"},
                    [("W_A", (1, 0), 2, 1), ("W_B", (1, 1), 2, 1)], line=("right", 2, 0.8), steps=40),
    "hemisphere": Problem(hemisphere, lambda n: (n, n), 6.825e7, 0.3, 0.04, {"left": "symmetry_y", "right": "symmetry_x"},
                          [("V_A", (0, 1), 0, 1), ("U_B", (1, 1), 1, -1)], force=[((0, 1), 0, 200.0), ((1, 1), 1, -200.0)], fixed=[((0, 1), 2)], steps=20),
    "pull_out": Problem(arc(4.953, pi / 2, 5.175), lambda n: (3 * n // 2, n), 10.5e6, 0.3125, 0.094,
                        {"left": "symmetry_x", "right": "symmetry_z", "bottom": "symmetry_y"},
                        [("U_B", (1, 0), 0, -1), ("U_C", (1, 1), 0, -1)], force=[((0, 0), 2, 10000.0)], steps=40),
    "roof": Problem(arc(2540.0, 0.1, 254.0), lambda n: (n, n), 3102.75, 0.3, 12.7, {"left": "symmetry_x", "right": "hinged", "bottom": "symmetry_y"},
                    [("load_factor", (0, 0), 2, 1)], force=[((0, 0), 2, -750.0)], control=((0, 0), 2, -29.374), steps=40),
    "line_load": Problem(arc(9.0, pi, 15.0), lambda n: (2 * n, n), 16800.0, 0.4, 0.2, {"left": "symmetry_x", "right": "supported_x", "bottom": "symmetry_y"},
                         [("u_end", (0, 1), 2, -1), ("u_mid", (0, 0), 2, -1)], line=("left", 2, -17.0 / 30), steps=40),
    "cook": Problem(cook, lambda n: (n, n), 1.0, 1 / 3, 1.0, {"left": "clamped"}, [("v", (1, 0.5), 1, 1)], line=("right", 1, 1 / 16), linear=True, plane=True),
    "scordelis": Problem(arc(25.0, 2 * pi / 9, 25.0), lambda n: (n, n), 4.32e8, 0.0, 0.25, {"left": "symmetry_x", "bottom": "symmetry_y", "top": "diaphragm"},
                         [("w", (1, 0), 2, 1)], area=(2, -90.0), linear=True),
}


class Grid:
    """Nodes x, triangles or quadrilaterals, supports {node: set of dofs}, loads {node: six numbers}; edges with mid-side nodes where `quadratic`."""

    def __init__(self, name, n, quadratic=False, quadrilaterals=False):
        self.problem = p = PROBLEMS[name]
        nx, ny = p.shape(n)
        self.nx, self.ny = nx, ny
        step = 2 if quadratic else 1
        fine_x, fine_y = step * nx, step * ny
        self.at = {}
        points = []
        for i in range(fine_x + 1):
            for j in range(fine_y + 1):
                if quadratic and quadrilaterals and i % 2 and j % 2:
                    continue    # eight nodes: none in the middle
                self.at[i, j] = len(points)
                points.append(p.map(i / fine_x, j / fine_y))
        self.x = np.array(points, dtype=float)
        self.fine = fine_x, fine_y
        self.elements = []
        for i in range(0, fine_x, step):
            for j in range(0, fine_y, step):
                a, b, c, d = (i, j), (i + step, j), (i + step, j + step), (i, j + step)
                for corners in ([(a, b, c, d)] if quadrilaterals else [(a, b, c), (a, c, d)]):
                    nodes = [self.at[k] for k in corners]
                    if quadratic:
                        nodes += [self.at[(k[0] + m[0]) // 2, (k[1] + m[1]) // 2] for k, m in zip(corners, corners[1:] + corners[:1])]
                    self.elements.append(nodes)
        self.fix, self.load = {}, {}
        for edge, kind in p.edges.items():
            for node in self.edge(edge):
                self.fix.setdefault(node, set()).update(EDGES[kind])
        for place, dof in p.fixed:
            self.fix.setdefault(self.node(place), set()).add(dof)
        if p.plane:
            for node in range(len(self.x)):
                self.fix.setdefault(node, set()).update((2, 3, 4))
        for place, dof, value in p.force:
            self.add(self.node(place), dof, value)
        if p.line:
            edge, dof, q = p.line
            nodes = self.edge(edge)
            for k in range(0, len(nodes) - step, step):
                part = nodes[k:k + step + 1]
                length = np.linalg.norm(self.x[part[-1]] - self.x[part[0]])
                for node, weight in zip(part, (1 / 6, 4 / 6, 1 / 6) if quadratic else (0.5, 0.5)):
                    self.add(node, dof, q * length * weight)
        if p.area:
            self.area_load(*p.area)
        self.monitors = [(name, self.node(place), dof, factor) for name, place, dof, factor in p.monitors]

    def add(self, node, dof, value):
        self.load.setdefault(node, [0.0] * 6)[dof] += value

    def edge(self, name):
        fx, fy = self.fine
        line = {"left": [(0, j) for j in range(fy + 1)], "right": [(fx, j) for j in range(fy + 1)],
                "bottom": [(i, 0) for i in range(fx + 1)], "top": [(i, fy) for i in range(fx + 1)]}[name]
        return [self.at[k] for k in line]

    def node(self, place):
        return self.at[round(place[0] * self.fine[0]), round(place[1] * self.fine[1])]

    def area_load(self, dof, q):
        """Consistent with flat triangles or quadrilaterals of straight sides."""
        for nodes in self.elements:
            corners = 3 if len(nodes) in (3, 6) else 4
            x = self.x[nodes[:corners]]
            area = 0.5 * np.linalg.norm(np.cross(x[1] - x[0], x[2] - x[0])) + (0.5 * np.linalg.norm(np.cross(x[2] - x[0], x[3] - x[0])) if corners == 4 else 0.0)
            weights = {3: (1 / 3,) * 3, 4: (1 / 4,) * 4, 6: (0.0,) * 3 + (1 / 3,) * 3, 8: (-1 / 12,) * 4 + (1 / 3,) * 4}[len(nodes)]
            for node, weight in zip(nodes, weights):
                self.add(node, dof, q * area * weight)
