"""Pressure on curved elements through the UEL: a hemisphere with a hole is blown up, as by the driver with exact normals.

Load type U1 on elements with normals: forces, couples and load stiffness in the unknowns of each of the three treatments of
rotations. Facets beside it.
"""
import sys
import tempfile
from pathlib import Path

try:
    import numpy as np

    import host_cases
    import uel_call
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

TOLERANCE = 1e-9
INCREMENTS = 3


def check(case, library, rotations):
    """What is wrong with the answer of one treatment of rotations."""
    # law 2 (mu), thickness, defaults, rotations, no direction, one parameter
    element = uel_call.Element(library, [2, case.thickness, 0, 0, 0, 0, 0, rotations, 0, 0, 0, 1, case.young], 12)
    free = np.ones((len(case.points), 6), dtype=bool)
    for node, dofs in case.fixed.items():
        free[node, [dof - 1 for dof in dofs]] = False
    steps = range(1, INCREMENTS + 1)
    u, history = uel_call.solve(element, rotations, case.points, case.triangles, free.ravel(), [0 * free.astype(float) for _ in steps],
                                [case.pressure * k / INCREMENTS for k in steps], case.normals, tolerance=1e-10)
    error, turned = case.error(u[:, :3]), np.abs(u[:, 3:] - case.rotation).max()
    label = f"{'facets' if case.normals is None else 'curved'}, PROPS(8) = {rotations}"
    print(f"{label}: {sum(map(len, history))} iterations in {INCREMENTS} increments, difference from the driver {error:.1e}, rotations "
          f"{turned:.1e}; corrections of the last", *(f"{c:.1e}" for c in history[-1]))
    failures = []
    if not error < TOLERANCE:
        failures.append(f"{label}: the displacements differ by {error:.1e} of the largest, expected {TOLERANCE:.0e}")
    if rotations != uel_call.KEPT and not turned < TOLERANCE:
        failures.append(f"{label}: the rotations differ by {turned:.1e}, expected {TOLERANCE:.0e}")
    for number, corrections in enumerate(history, 1):
        if not corrections[-1] < max(corrections[-2] ** 1.4, 1e-11):
            failures.append(f"{label}, increment {number}: corrections {corrections[-2]:.1e}, {corrections[-1]:.1e} are not quadratic")
    return failures


def main():
    failures = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        library = uel_call.build(folder)
        flat = host_cases.solve("balloon", folder)
        curved = host_cases.solve("balloon", folder, curved=True)
        difference = curved.error(flat.displacement)
        print(f"largest displacement {np.abs(curved.displacement).max():.3f}, facets differ by {difference:.1e}, largest rotation "
              f"{np.linalg.norm(curved.rotation, axis=1).max():.2f}")
        if difference < 1e-3:
            failures.append(f"normals change the driver's answer by {difference:.1e} only")
        failures += check(flat, library, uel_call.ADDED)
        for rotations in (uel_call.ADDED, uel_call.COMPOUNDED, uel_call.KEPT):
            failures += check(curved, library, rotations)
    for failure in failures:
        print("FAILED", failure)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
