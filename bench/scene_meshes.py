#!/usr/bin/env python3
"""Scenes of examples/ whose meshes no generator makes, as Gmsh files with their input files, in any fineness.

    scene_meshes.py      writes examples/bending_actuator and examples/stiffened_panel anew
"""
from math import cos, pi, sin
from pathlib import Path

from benchmark_meshes import gmsh

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"


class Mesh:
    """Patches of cells that share the nodes at equal places."""

    def __init__(self):
        self.nodes, self.number, self.surfaces = [], {}, {}

    def node(self, place):
        key = tuple(round(x, 9) + 0.0 for x in place)
        if key not in self.number:
            self.nodes.append(place)
            self.number[key] = len(self.nodes)
        return self.number[key]

    def patch(self, name, n, place):
        """n[0] x n[1] cells on the surface `name` (or name(i, j) of a cell), the normal along s x t; returns the numbers of the nodes."""
        number = {(i, j): self.node(place(i, j)) for i in range(n[0] + 1) for j in range(n[1] + 1)}
        for i in range(n[0]):
            for j in range(n[1]):
                a, b, c, d = number[i, j], number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]
                cut = [(a, b, c), (a, c, d)] if (i + j) % 2 == 0 else [(a, b, d), (b, c, d)]
                self.surfaces.setdefault(name(i, j) if callable(name) else name, []).extend(t for t in cut if len(set(t)) == 3)
        return number


def line(numbers):
    return list(zip(numbers, numbers[1:]))


def bending_actuator(n):
    """n[0] cells around half of the tube, n[1] along half of it: the input, and its mesh by name of the file."""
    radius, length = 6.0, 60.0
    mesh = Mesh()

    def wall(i, j):
        a = pi * i / n[0]
        return (radius * sin(a), length * j / n[1], radius * cos(a))

    def cap(i, j):
        a, r = pi * i / n[0], radius * j / (n[0] // 2)
        return (r * sin(a), length, r * cos(a))
    tube = mesh.patch(lambda i, j: "strip" if i >= 15 * n[0] // 16 else "tube", n, wall)
    end = mesh.patch("cap", (n[0], n[0] // 2), lambda i, j: cap(n[0] - i, j))
    middle = [tube[i, 0] for i in range(n[0] + 1)]
    plane = [tube[0, j] for j in range(n[1] + 1)] + [end[n[0], j] for j in range(n[0] // 2 - 1, -1, -1)] \
        + [end[0, j] for j in range(1, n[0] // 2 + 1)] + [tube[n[0], j] for j in range(n[1] - 1, -1, -1)]
    text = f"""! A soft actuator that bends: a tube of rubber with fibres around it, a strip of film along one side, closed at its ends, under pressure.
! A quarter of it: half of the section, half of the length. Mesh: bench/scene_meshes.py. N and mm.

&job title = 'Bending actuator, {n[0]} x {n[1]}' name = 'bending_actuator' /
&mesh file = 'bending_actuator.msh' crease = 'rim' /
&material name = 'rubber' law = 'neo_hookean' mu = 0.1 /
&material name = 'thread' law = 'holzapfel_gasser_ogden' c = 0.1 k1 = 120.0 k2 = 0.1 angle = 0.0 /
&material name = 'film' law = 'linear_elastic' e = 3000.0 nu = 0.3 /
&section element_set = 'tube' material = 'rubber', 'thread', 'rubber' thickness = 0.25, 0.1, 0.25 direction_axis = 0.0, 1.0, 0.0 /
&section element_set = 'strip' material = 'rubber', 'film', 'rubber' thickness = 0.25, 0.1, 0.25 direction_axis = 0.0, 1.0, 0.0 /
&section element_set = 'cap' material = 'film' thickness = 1.0 /
&support node_set = 'plane' type = 'symmetry_x' /
&support node_set = 'middle' type = 'symmetry_y' /
&support node_set = 'fixed' fixed = 'uz' /
&load type = 'pressure' pressure = 0.02 /
&step load_levels = 0.25, 0.5, 0.75, 1.0 /
&monitor name = 'v' quantity = 'displacement' component = 'y' node_set = "half_way" /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = "half_way" /
"""
    points = {"half_way": tube[n[0], n[1] // 2], "fixed": tube[n[0], 0]}
    curves = {"middle": line(middle), "plane": line(plane), "rim": line([tube[i, n[1]] for i in range(n[0] + 1)])}
    return text, {"bending_actuator.msh": gmsh(mesh.nodes, mesh.surfaces, curves, points)}


def stiffened_panel(n):
    """n[0] cells along half of the panel, n[1] across the plate (even), n[2] up the stiffener: the input, and its mesh by name of the file."""
    length, width, height = 300.0, 300.0, 40.0
    mesh = Mesh()
    plate = mesh.patch("plate", n[:2], lambda i, j: (length * i / n[0], width * j / n[1], 0.0))
    rib = mesh.patch("stiffener", (n[0], n[2]), lambda i, j: (length * i / n[0], width / 2, -height * j / n[2]))
    text = f"""! Half of a plate 600 x 300 x 4 with one stiffener 40 x 4 below it (three sheets meet at its root), clamped at its ends, under pressure. N and mm.
! Mesh: bench/scene_meshes.py.

&job title = 'Stiffened panel, {n[0]} x ({n[1]} + {n[2]})' name = 'stiffened_panel' /
&mesh file = 'stiffened_panel.msh' /
&material name = 'steel' law = 'linear_elastic' e = 210e3 nu = 0.3 /
&section material = 'steel' thickness = 4.0 /
&support node_set = 'end' type = 'clamped' /
&support node_set = 'middle' type = 'symmetry_x' /
&load type = 'pressure' element_set = 'plate' pressure = -0.1 /
&step name = 'linear' control = 'linear' /
&step name = 'large deflection' /
&monitor name = 'w_edge' quantity = 'displacement' component = 'z' node_set = 'edge' /
&monitor name = 'w_root' quantity = 'displacement' component = 'z' node_set = 'root' /
&monitor name = 'w_tip' quantity = 'displacement' component = 'z' node_set = 'tip' /
"""
    across, up = range(n[1] + 1), range(n[2] + 1)
    curves = {name: line([plate[i, j] for j in across]) + line([rib[i, j] for j in up]) for name, i in (("end", 0), ("middle", n[0]))}
    points = {"edge": plate[n[0], 0], "root": plate[n[0], n[1] // 2], "tip": rib[n[0], n[2]]}
    return text, {"stiffened_panel.msh": gmsh(mesh.nodes, mesh.surfaces, curves, points)}


BUILDERS = {"bending_actuator": bending_actuator, "stiffened_panel": stiffened_panel}
FILES = {"bending_actuator": (16, 40), "stiffened_panel": (24, 24, 4)}   # what examples/ has


def main():
    for name, n in FILES.items():
        text, files = BUILDERS[name](n)
        (EXAMPLES / name).mkdir(exist_ok=True)
        for file, content in {"input.nml": text, **files}.items():
            (EXAMPLES / name / file).write_text(content)


if __name__ == "__main__":
    main()
