"""OpenSees: ASDShellT3 (corotational), ShellNLDKGT; linear: ShellMITC4 too. opensees_shell.py CASE N os_asdt3|os_nldkgt|os_mitc4 CPU_LIMIT [STEPS]"""
import sys
import time

import numpy as np
import openseespy.opensees as ops
from cases import Grid
from outcome import Stepper, report

imported = time.process_time()
name, n, peer, limit = sys.argv[1], int(sys.argv[2]), sys.argv[3], float(sys.argv[4])
grid = Grid(name, n, quadrilaterals=peer == "os_mitc4")
p = grid.problem
steps = int(sys.argv[5]) if len(sys.argv) > 5 else p.steps
ops.wipe()
ops.model("basic", "-ndm", 3, "-ndf", 6)
for k, x in enumerate(grid.x):
    ops.node(k + 1, *map(float, x))
ops.section("ElasticMembranePlateSection", 1, p.e, p.nu, p.h, 0.0)
for k, nodes in enumerate(grid.elements):
    numbers = [i + 1 for i in nodes]
    if peer == "os_nldkgt":
        ops.element("ShellNLDKGT", k + 1, *numbers, 1)
    elif peer == "os_mitc4":
        ops.element("ShellMITC4", k + 1, *numbers, 1)
    else:
        ops.element("ASDShellT3", k + 1, *numbers, 1, *([] if p.linear else ["-corotational"]))
for k, dofs in grid.fix.items():
    ops.fix(k + 1, *[1 if dof in dofs else 0 for dof in range(6)])
ops.timeSeries("Linear", 1)
ops.pattern("Plain", 1, 1)
for k, f in grid.load.items():
    ops.load(k + 1, *map(float, f))
total = sum(v * v for f in grid.load.values() for v in f) ** 0.5
ops.constraints("Plain")
ops.numberer("RCM")
ops.system("UmfPack")
ops.test("NormUnbalance", 1e-5 * total, 25, 0)
ops.algorithm("Linear" if p.linear else "Newton")
ops.integrator("LoadControl", 1.0)
ops.analysis("Static")
reached = 0.0


def values():
    if p.control:
        return [ops.getTime()]
    return [factor * ops.nodeDisp(k + 1, dof + 1) for _, k, dof, factor in grid.monitors]


def attempt(level):
    global reached
    if p.control:
        place, dof, end = p.control
        ops.integrator("DisplacementControl", grid.node(place) + 1, dof + 1, (level - reached) * end)
    else:
        ops.integrator("LoadControl", level - reached)
    good = ops.analyze(1) == 0 and np.all(np.isfinite(values()))
    if good:
        reached = level
    return good, 1 if p.linear else max(ops.testIter(), 1)


stepper = Stepper(1 if p.linear else steps, limit, imported)
stepper.run(attempt)
report(grid, values(), stepper, len(grid.x) * 6)
