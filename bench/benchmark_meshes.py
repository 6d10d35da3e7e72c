#!/usr/bin/env python3
"""Meshes that no generator makes: NAFEMS LE1 and LE5, as Gmsh files with their input files, in any fineness.

    benchmark_meshes.py      writes examples/le1 and examples/le5 anew
"""
import random
from math import cos, hypot, pi, sin
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"


def grid(n, place, diagonal="alternating", distortion=0.0, fixed=()):
    """Nodes, triangles and numbering of n[0] x n[1] cells; place(s, t) gives a point of space, s and t counted in cells.

    Nodes inside are moved by up to `distortion` of a cell, along s only where t is in `fixed` (a crease).
    """
    rng = random.Random(20260701)
    nodes, number = [], {}
    for i in range(n[0] + 1):
        for j in range(n[1] + 1):
            ds, dt = (distortion * rng.uniform(-1, 1) for _ in range(2))
            inside = 0 < i < n[0] and 0 < j < n[1]
            nodes.append(place(i + ds * inside, j + dt * (inside and j not in fixed)))
            number[i, j] = len(nodes)
    triangles = []
    for i in range(n[0]):
        for j in range(n[1]):
            a, b, c, d = number[i, j], number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]
            if diagonal == "forward" or (diagonal == "alternating" and (i + j) % 2 == 0):
                triangles += [(a, b, c), (a, c, d)]
            else:
                triangles += [(a, b, d), (b, c, d)]
    return nodes, triangles, number


def gmsh(nodes, triangles, curves, points):
    """Text of a Gmsh file (4.1): triangles on one surface, or by name of a surface; curves: name -> pairs of nodes; points: name -> node."""
    surfaces = triangles if isinstance(triangles, dict) else {"": triangles}
    named = [name for name in surfaces if name]
    names = [*points, *curves, *named]
    kind = {name: 0 for name in points} | {name: 1 for name in curves} | {name: 2 for name in named}
    low, high = (" ".join(f"{f(x[k] for x in nodes):.16g}" for k in range(3)) for f in (min, max))
    out = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", f"{len(names)}"]
    out += [f'{kind[name]} {k + 1} "{name}"' for k, name in enumerate(names)]
    out += ["$EndPhysicalNames", "$Entities", f"{len(points)} {len(curves)} {len(surfaces)} 0"]
    out += [f"{k + 1} {' '.join(f'{x:.16g}' for x in nodes[node - 1])} 1 {k + 1}" for k, node in enumerate(points.values())]
    out += [f"{k + 1} {low} {high} 1 {len(points) + k + 1} 0" for k in range(len(curves))]
    out += [f"{k + 1} {low} {high} {f'1 {names.index(name) + 1}' if name else '0'} 0" for k, name in enumerate(surfaces)]
    out += ["$EndEntities", "$Nodes", f"1 {len(nodes)} 1 {len(nodes)}", f"2 1 0 {len(nodes)}"]
    out += [str(k + 1) for k in range(len(nodes))] + [" ".join(f"{x:.16g}" for x in node) for node in nodes] + ["$EndNodes", "$Elements"]
    blocks = [(0, k + 1, 15, [(node,)]) for k, node in enumerate(points.values())]
    blocks += [(1, k + 1, 1, edges) for k, edges in enumerate(curves.values())]
    blocks += [(2, k + 1, 2, elements) for k, elements in enumerate(surfaces.values())]
    total = sum(len(block[3]) for block in blocks)
    out.append(f"{len(blocks)} {total} 1 {total}")
    tag = 0
    for dimension, entity, shape, elements in blocks:
        out.append(f"{dimension} {entity} {shape} {len(elements)}")
        for element in elements:
            tag += 1
            out.append(f"{tag} {' '.join(map(str, element))}")
    return "\n".join([*out, "$EndElements"]) + "\n"


def le1(n, diagonal="alternating", distortion=0.0):
    """NAFEMS LE1, n[0] cells around and n[1] across: the input, and its mesh by name of the file."""
    def place(s, t):
        a, r = 0.5 * pi * s / n[0], (t / n[1]) ** 1.5   # finer at the hole
        return ((2 + 1.25 * r) * cos(a), (1 + 1.75 * r) * sin(a), 0.0)
    nodes, triangles, number = grid(n, place, diagonal, distortion)
    triangles = [(a, c, b) for a, b, c in triangles]
    outer = [(number[i, n[1]], number[i + 1, n[1]]) for i in range(n[0])]
    curves = {"on_x": [(number[0, j], number[0, j + 1]) for j in range(n[1])], "on_y": [(number[n[0], j], number[n[0], j + 1]) for j in range(n[1])]}
    curves |= {f"outer_{k + 1}": [edge] for k, edge in enumerate(outer)}
    loads = []
    for k, (p, q) in enumerate(outer):
        dx, dy = (nodes[q - 1][m] - nodes[p - 1][m] for m in range(2))
        loads.append(f"&load type = 'line' edge_set = 'outer_{k + 1}' vector = {1e6 * dy / hypot(dx, dy):.10g}, {-1e6 * dx / hypot(dx, dy):.10g}, 0.0 /")
    text = f"""! NAFEMS LE1: a quarter of an elliptic plate with an elliptic hole, 10 MPa outward on the outer edge, linear; N and m.
! Written by bench/benchmark_meshes.py, as is the mesh: every side of the outer edge has its own load, normal to it.

&job title = 'NAFEMS LE1, {n[0]} x {n[1]}' name = 'le1' /
&mesh file = 'le1.msh' /
&material name = 'elastic' law = 'linear_elastic' e = 210e9 nu = 0.3 /
&section material = 'elastic' thickness = 0.1 direction = 0.0, 1.0, 0.0 /
&support node_set = 'all' fixed = 'uz', 'rx', 'ry' /   ! plane
&support node_set = 'on_x' type = 'symmetry_y' /
&support node_set = 'on_y' type = 'symmetry_x' /
""" + "\n".join(loads) + """
&step control = 'linear' /
&monitor name = 'sigma_yy' quantity = 'membrane_force' component = '11' node_set = 'D' factor = 1e-5 /   ! MPa, of the elements that touch (2, 0)
"""
    return text, {"le1.msh": gmsh(nodes, triangles, curves, {"D": number[0, 0]})}


def le5(n, diagonal="forward", distortion=0.0):
    """NAFEMS LE5, n[0] cells along and n[1] around, a multiple of 4: the input, and its mesh by name of the file."""
    k = n[1] // 4

    def place(s, t):
        w = t / k   # flange 0 to 1, web 1 to 3, flange 3 to 4
        return (10.0 * s / n[0], 1.0 - min(w, 1.0) - max(w - 3.0, 0.0), 1.0 - min(max(w - 1.0, 0.0), 2.0))
    nodes, triangles, number = grid(n, place, diagonal, distortion, fixed=(k, 3 * k))
    ends = {"clamp": (0, range(4 * k)), "end_top": (n[0], range(k)), "end_bottom": (n[0], range(3 * k, 4 * k))}
    curves = {name: [(number[i, j], number[i, j + 1]) for j in cells] for name, (i, cells) in ends.items()}
    text = f"""! NAFEMS LE5: cantilever with a Z section, twisted by two shear forces of 0.6 MN in its flanges, linear; N and m. Mesh: bench/benchmark_meshes.py.

&job title = 'NAFEMS LE5, {n[0]} x {n[1]}' name = 'le5' /
&mesh file = 'le5.msh' /
&material name = 'elastic' law = 'linear_elastic' e = 210e9 nu = 0.3 /
&section material = 'elastic' thickness = 0.1 /
&support node_set = 'clamp' type = 'clamped' /
&load type = 'line' edge_set = 'end_top' vector = 0.0, 0.6e6, 0.0 /
&load type = 'line' edge_set = 'end_bottom' vector = 0.0, -0.6e6, 0.0 /
&step control = 'linear' /
&monitor name = 'sigma_xx' quantity = 'membrane_force' component = '11' node_set = 'A' factor = 1e-5 /   ! MPa, of the elements that touch A
"""
    return text, {"le5.msh": gmsh(nodes, triangles, curves, {"A": number[n[0] // 4, 0]})}


BUILDERS = {"le1": le1, "le5": le5}
FILES = {"le1": (16, 16), "le5": (40, 16)}   # what examples/ has


def main():
    for name, n in FILES.items():
        text, files = BUILDERS[name](n)
        for file, content in {"input.nml": text, **files}.items():
            (EXAMPLES / name / file).write_text(content)


if __name__ == "__main__":
    main()
