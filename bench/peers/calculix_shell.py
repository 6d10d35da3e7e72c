"""CalculiX: C3D20R, which its S8R is expanded into (rotations of its shells in planes of symmetry hold the thickness, too: on the quarter models S6 and S8R
are ten times too stiff); Cook's membrane: CPS6, CPS8R. CPU time of ccx.

calculix_shell.py CASE N ccx_c3d20r|ccx_cps6|ccx_cps8r CPU_LIMIT [STEPS]
"""
import os
import resource
import subprocess
import sys
import tempfile

import numpy as np
from cases import EDGES, Grid
from outcome import Stepper, report

name, n, peer, limit = sys.argv[1], int(sys.argv[2]), sys.argv[3], float(sys.argv[4])
kind = peer.split("_")[1].upper()
grid = Grid(name, n, quadratic=True, quadrilaterals=kind != "CPS6")
p = grid.problem
steps = int(sys.argv[5]) if len(sys.argv) > 5 else p.steps


def solid():
    """Layers at -h/2, 0, h/2 of the nodes (numbers k, k + N, k + 2 N; those at mid-sides have no middle one), elements, supports."""
    count = len(grid.x)
    normal = np.zeros((count, 3))
    for (i, j), k in grid.at.items():
        s, t, d = i / grid.fine[0], j / grid.fine[1], 1e-6
        a = np.array(p.map(s + d, t), dtype=float) - np.array(p.map(s - d, t), dtype=float)
        b = np.array(p.map(s, t + d), dtype=float) - np.array(p.map(s, t - d), dtype=float)
        normal[k] = np.cross(a, b) / np.linalg.norm(np.cross(a, b))
    corners = {k for (i, j), k in grid.at.items() if not i % 2 and not j % 2}
    nodes = {k + 1 + layer * count: grid.x[k] + 0.5 * (layer - 1) * p.h * normal[k] for k in range(count) for layer in range(3) if layer != 1 or k in corners}
    elements = []
    for q in grid.elements:
        low, high = [k + 1 for k in q], [k + 1 + 2 * count for k in q]
        elements.append(low[:4] + high[:4] + low[4:] + high[4:] + [k + 1 + count for k in q[:4]])
    fix = {}
    for edge, edge_kind in p.edges.items():
        every = edge_kind not in ("hinged", "diaphragm")
        for k in grid.edge(edge):
            held = [dof for dof in EDGES[edge_kind] if dof < 3]
            for layer in range(3):
                node = k + 1 + layer * count
                if node in nodes:
                    fix.setdefault(node, set()).update([dof for dof in held if edge_kind != "supported_x" or dof == 0 or layer == 1] if every or layer == 1 else [])
    for place, dof in p.fixed:
        fix.setdefault(grid.node(place) + 1 + count, set()).add(dof)
    load = {}
    for k, f in grid.load.items():
        layers = [(1, 1.0)] if k in corners else [(0, 0.5), (2, 0.5)]
        for layer, weight in layers:
            load[k + 1 + layer * count] = [weight * v for v in f[:3]]
    return nodes, elements, fix, load, lambda k: k + 1 + count


if p.plane:
    nodes, elements = {k + 1: x for k, x in enumerate(grid.x)}, [[i + 1 for i in q] for q in grid.elements]
    fix, load, middle = {k + 1: {dof for dof in dofs if dof < 2} for k, dofs in grid.fix.items()}, {k + 1: f for k, f in grid.load.items()}, lambda k: k + 1
else:
    nodes, elements, fix, load, middle = solid()
lines = ["*NODE, NSET=NALL", *(f"{k}, {x[0]:.12g}, {x[1]:.12g}, {x[2]:.12g}" for k, x in nodes.items()), f"*ELEMENT, TYPE={kind}, ELSET=EALL"]
for k, q in enumerate(elements):
    lines += [", ".join(str(i) for i in [k + 1, *q[:15]]) + ("," if len(q) > 15 else ""), *([", ".join(str(i) for i in q[15:])] if len(q) > 15 else [])]
lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{p.e:.12g}, {p.nu:.12g}", "*SOLID SECTION, ELSET=EALL, MATERIAL=M", *([f"{p.h:.12g}"] if p.plane else []), "*BOUNDARY"]
lines += [f"{k}, {dof + 1}, {dof + 1}" for k, dofs in sorted(fix.items()) for dof in sorted(dofs)]
lines += ["*STEP, INC=2000" + ("" if p.linear else ", NLGEOM"), "*STATIC", f"{1 / steps:.6g}, 1.0, 1e-5, {1 / steps:.6g}" if not p.linear else "1.0, 1.0"]
if p.control:
    place, dof, end = p.control
    lines += ["*BOUNDARY", f"{middle(grid.node(place))}, {dof + 1}, {dof + 1}, {end:.12g}", f"*NSET, NSET=DRIVEN\n{middle(grid.node(place))}", "*NODE PRINT, NSET=DRIVEN", "RF"]
else:
    lines += ["*CLOAD", *(f"{k}, {dof + 1}, {v:.12g}" for k, f in load.items() for dof, v in enumerate(f) if v)]
lines += ["*NODE FILE", "U", "*END STEP"]
with tempfile.TemporaryDirectory() as folder:
    with open(os.path.join(folder, "job.inp"), "w") as out:
        out.write("\n".join(lines) + "\n")
    seconds = int(limit)
    done = subprocess.run(["ccx", "-i", "job"], cwd=folder, capture_output=True, text=True, check=False,
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds)))
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    stepper = Stepper(1, limit, 0.0)
    attempts = os.path.join(folder, "job.sta")
    for line in open(attempts) if os.path.exists(attempts) else ():
        words = line.split()
        if len(words) >= 7 and words[0].isdigit():
            stepper.steps, stepper.iterations, stepper.level = int(words[1]), stepper.iterations + int(words[3]), float(words[4])
    moved, reading = {}, False
    results = os.path.join(folder, "job.frd")
    for line in open(results) if os.path.exists(results) else ():
        if line.startswith(" -4"):
            reading = line.split()[1] == "DISP"
        elif line.startswith(" -3"):
            reading = False
        elif reading and line.startswith(" -1"):
            moved[int(line[3:13])] = [float(line[13 + 12 * k:25 + 12 * k]) for k in range(3)]
    if p.linear and done.returncode == 0:
        stepper.level, stepper.steps, stepper.iterations = 1.0, 1, 1
    if p.control:
        words = [line.split() for line in open(os.path.join(folder, "job.dat"))] if os.path.exists(os.path.join(folder, "job.dat")) else []
        forces = [w for w in words if len(w) == 4 and w[0].isdigit()]
        values = [float(forces[-1][1 + p.control[1]]) / p.force[0][2] if forces else float("nan")]
    else:
        values = [factor * moved[middle(k)][dof] if middle(k) in moved else float("nan") for _, k, dof, factor in grid.monitors]
if stepper.level < 1 - 1e-6:
    stepper.failed = f"stops at {100 * stepper.level:.0f} % of the load" if used.ru_utime + used.ru_stime < 0.95 * seconds else f"CPU limit of {limit:g} s at {100 * stepper.level:.0f} % of the load"
report(grid, values, stepper, 3 * len(nodes), cpu=used.ru_utime + used.ru_stime)
