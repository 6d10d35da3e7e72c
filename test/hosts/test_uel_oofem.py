"""The UEL under a host that was not written for it: cantilever and hemisphere in OOFEM agree with the driver.

OOFEM (PyPI) calls the routine uel_ of a shared library. Its fault: it passes two coordinates a node and writes the third node's
behind the end of the array. So the coordinates come through PROPS, and `pad_malloc.c` is preloaded.
"""
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
SKIPPED = 77
TOLERANCE = 1e-6

try:
    import numpy as np

    import host_cases
    import uel_call
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(SKIPPED)
if subprocess.run([sys.executable, "-c", "import oofem"], capture_output=True).returncode != 0:
    print("skipped: OOFEM is not there (tools/install_dependencies test)")
    sys.exit(SKIPPED)


def build(folder):
    """The user element as api/abaqus/Makefile makes it, and the shim."""
    uel_call.build(folder)
    subprocess.run([os.environ["FINSHELL_CC"], "-shared", "-fPIC", "-O1", "-o", folder / "pad_malloc.so",
                    HERE / "pad_malloc.c"], check=True)


def input_of(case, folder, increments, rotations):
    """An input file of OOFEM. Sets of equal supports and loads become one boundary condition each."""
    nodes, elements = len(case.points), len(case.triangles)
    conditions, sets = [], []

    def add_set(members):
        sets.append(f"Set {len(sets) + 1} nodes {len(members)} " + " ".join(str(m + 1) for m in members))
        return len(sets)

    groups = {}
    for node, dofs in case.fixed.items():
        groups.setdefault(tuple(sorted(dofs)), []).append(node)
    for dofs, members in groups.items():
        conditions.append(f"BoundaryCondition {len(conditions) + 1} loadTimeFunction 1 dofs {len(dofs)} "
                          f"{' '.join(map(str, dofs))} values {len(dofs)} {' '.join('0.' for _ in dofs)} "
                          f"set {add_set(members)}")
    for node, force in case.loads:
        conditions.append(f"NodalLoad {len(conditions) + 1} loadTimeFunction 1 dofs 6 1 2 3 4 5 6 Components 6 "
                          f"{force[0]!r} {force[1]!r} {force[2]!r} 0. 0. 0. set {add_set([node])}")
    # law 1 (e, nu), thickness, defaults, rotations, no direction, two parameters
    section = [1, case.thickness, 0, 0, 0, 0, 0, rotations, 0, 0, 0, 2, case.young, case.poisson]
    lines = [f"{case.name}.out", case.name,
             f"NonLinearStatic nsteps {increments} controlmode 1 rtolf 1e-10 rtold 1e-9 maxiter 50 stiffmode 1 manrmsteps 1 "
             "smtype 1 lstype 0 nmodules 0",
             "domain 3dShell", "OutputManager",
             f"ndofman {nodes} nelem {elements} ncrosssect 1 nmat 1 nbc {len(conditions)} nic 0 nltf 1 nset {len(sets)}"]
    for i, p in enumerate(case.points, 1):
        lines.append(f"node {i} coords 3 {' '.join(repr(float(c)) for c in p)}")
    for i, triangle in enumerate(case.triangles, 1):
        curved = [] if case.normals is None else case.normals[i - 1].ravel()
        properties = [float(v) for v in [*section, *case.points[triangle].ravel(), *curved]]
        lines.append(f"AbaqusUserElement {i} nodes 3 {' '.join(str(n + 1) for n in triangle)} coords 6 dofs 6 1 2 3 4 5 6 "
                     f"crosssect 1 mat 1 numsvars 12 properties {len(properties)} {' '.join(map(repr, properties))} type 1 "
                     f"uel \"{folder}/libfinshell_uel.so\"")
    lines += ["SimpleCS 1 material 1", "IsoLE 1 d 0. E 1. n 0. tAlpha 0.", *conditions,
              # with controlmode 1 each step adds its load to what is there
              f"ConstantFunction 1 f(t) {1.0 / increments!r}", *sets]
    path = folder / f"{case.name}.in"
    path.write_text("\n".join(lines) + "\n")
    return path


def run(case, folder, increments, rotations):
    """All nodal unknowns at the end, and for each increment residuals and corrections, the largest of the six components."""
    path = input_of(case, folder, increments, rotations)
    output = folder / f"{case.name}.json"
    environment = dict(os.environ, LD_PRELOAD=str(folder / "pad_malloc.so"))
    done = subprocess.run([sys.executable, HERE / "oofem_run.py", path, output, str(len(case.points))], cwd=folder,
                          env=environment, capture_output=True, text=True)
    if done.returncode != 0 or not output.exists():
        sys.exit(f"OOFEM failed:\n{done.stdout[-4000:]}{done.stderr[-4000:]}")
    history = []
    for line in (done.stdout + done.stderr).splitlines():
        if "ForceError" in line:
            history.append([])
        pairs = re.findall(r"[DR]_[uvw]: *\*?(\S+) +\*?(\S+)", line)
        if line.startswith("NRSolver:") and pairs:
            history[-1].append(np.array(pairs, dtype=float).max(axis=0))
    return np.array(json.loads(output.read_text())), [np.array(h) for h in history]


def check(case, folder, increments, rotations):
    values, history = run(case, folder, increments, rotations)
    error = case.error(values[:, :3])
    label = f"{case.name}{'' if case.normals is None else ', curved'}, rotations {('added', 'compounded', 'kept in SVARS')[rotations - 1]}"
    print(f"{label}: {sum(len(h) - 1 for h in history)} iterations in {len(history)} increments, "
          f"difference from the driver {error:.1e}")
    if "-v" in sys.argv:
        for iteration, (residual, correction) in enumerate(history[-1]):
            print(f"   {iteration}  residual {residual:.1e}  correction {correction:.1e}")
    failures = []
    if not error < TOLERANCE:
        failures.append(f"{label}: the displacements differ by {error:.1e} of the largest, expected {TOLERANCE:.0e}")
    if rotations == 1:
        difference = np.abs(values[:, 3:] - case.rotation).max()
        if not difference < TOLERANCE:
            failures.append(f"{label}: the rotations differ by {difference:.1e}, expected {TOLERANCE:.0e}")
    if len(history) != increments or any(len(steps) < 2 for steps in history):
        failures.append(f"{label}: {len(history)} increments in the log of OOFEM, expected {increments} with iterations")
        return failures
    for number, steps in enumerate(history, 1):
        # quadratic: the number of right digits doubles; 1.4 leaves room for the factor before the square
        last = int(np.argmax(steps[1:, 1] < 1e-8)) + 1
        before, after = steps[last - 1:last + 1, 1]
        if not after < max(before**1.4, 1e-11):
            failures.append(f"{label}, increment {number}: corrections {before:.1e}, {after:.1e} are not quadratic")
    return failures


def main():
    failures = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        build(folder)
        cantilever = host_cases.solve("cantilever", folder)
        hemisphere = host_cases.solve("hemisphere", folder)
        failures += check(cantilever, folder, 10, 1)
        failures += check(hemisphere, folder, 20, 1)
        failures += check(host_cases.solve("hemisphere", folder, curved=True), folder, 20, 1)
        failures += check(cantilever, folder, 10, 3)
    for failure in failures:
        print("FAILED", failure)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
