"""Law 99 of the UEL, a law of the shared library that FINSHELL_LAWS names: the neo-Hookean law of doc/user_laws.md gives the forces and
stiffnesses of law 2; a balloon of eight-chain rubber (examples/user_laws) is the driver's with the same library; what is wrong is refused."""
import os
import re
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

MU, LOCK, THICKNESS, INCREMENTS = 1.0e6, 2.0, 0.4, 3
NEO_HOOKEAN, OWN = 2, 99


def properties(law, rotations, *parameters):
    """PROPS: law, thickness, defaults, rotations, no direction, parameters."""
    return [law, THICKNESS, 0, 0, 0, 0, 0, rotations, 0, 0, 0, len(parameters), *parameters]


def against_law_2(uel):
    """Facet and curved element, strained and turned: law 99 beside law 2."""
    x = np.array([[3.8, 2.5, 8.9], [2.2, 2.2, 9.5], [2.6, 1.7, 9.5]])
    u = np.concatenate([[*(0.2 * np.sin(3 * p + 1)), *(0.5 * np.cos(2 * p))] for p in x])
    failures = []
    for rotations in (uel_call.ADDED, uel_call.COMPOUNDED, uel_call.KEPT):
        for coordinates in (x, np.hstack([x, x / np.linalg.norm(x, axis=1)[:, None]])):
            mine, theirs = (uel_call.Element(uel, properties(law, rotations, MU), 12)(1, coordinates, u, 0.5 * u, 1)
                            for law in (OWN, NEO_HOOKEAN))
            for name, a, b in zip(("RHS", "AMATRX"), mine, theirs):
                error = np.abs(a - b).max() / np.abs(b).max()
                print(f"PROPS(8) = {rotations}, {coordinates.shape[1]} coordinates: {name} of law 99 differs from that of law 2 by {error:.1e}")
                if not error < 1e-12:
                    failures.append(f"PROPS(8) = {rotations}: {name} of law 99 differs by {error:.1e}, expected 1e-12")
    return failures


def balloon(uel, folder, library):
    """Blown up by load type U1, beside the driver with the same law, and beside neo-Hookean rubber of the same stiffness at rest."""
    law = f"law = 'arruda_boyce' library = '{library}' mu = {MU} lock = {LOCK}"
    case, other = host_cases.solve("balloon", folder, curved=True, law=law), host_cases.solve("balloon", folder, curved=True)
    element = uel_call.Element(uel, properties(OWN, uel_call.COMPOUNDED, MU, LOCK), 12)
    free = np.ones((len(case.points), 6), dtype=bool)
    for node, dofs in case.fixed.items():
        free[node, [dof - 1 for dof in dofs]] = False
    steps = range(1, INCREMENTS + 1)
    u, history = uel_call.solve(element, uel_call.COMPOUNDED, case.points, case.triangles, free.ravel(), [np.zeros(free.shape) for _ in steps],
                                [case.pressure * k / INCREMENTS for k in steps], case.normals, tolerance=1e-10)
    error, turned, matters = case.error(u[:, :3]), np.abs(u[:, 3:] - case.rotation).max(), case.error(other.displacement)
    print(f"balloon: {sum(map(len, history))} iterations, difference from the driver {error:.1e}, rotations {turned:.1e}; the law changes "
          f"the displacements by {matters:.1e}")
    failures = []
    if not max(error, turned) < 1e-9:
        failures.append(f"the balloon differs from the driver's by {error:.1e}, rotations by {turned:.1e}, expected 1e-9")
    if not matters > 0.05:
        failures.append(f"the law changes the balloon by {matters:.1e} only")
    return failures


def refused(uel, library):
    """What a host must not take for forces: no law is named, one of three is not said, parameters too many, too few, a law with states."""
    x, u = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.zeros(18)
    failures = []
    for number, (laws, parameters) in enumerate(((None, (MU, LOCK)), (library, (MU, LOCK)),
                                                  (f"{library}#arruda_boyce", (MU, LOCK, 1.0)), (f"{library}#arruda_boyce", (MU,)),
                                                  (f"{library}#nothing", (MU, LOCK)),
                                                  (f"{library}#prony", (MU, 0.3, 0.5, 1.0))), 1):
        os.environ.pop("FINSHELL_LAWS", None)
        if laws:
            os.environ["FINSHELL_LAWS"] = str(laws)
        # a thickness of its own for each, because sections are kept
        props = properties(OWN, uel_call.ADDED, *parameters)
        props[1] += 0.01 * number
        try:
            uel_call.Element(uel, props, 12)(1, x, u, u, 1)
            failures.append(f"FINSHELL_LAWS = {laws} with the parameters {parameters} passes")
        except uel_call.Refused as answer:
            if "0.25, with RHS(1, 1) = nan" not in str(answer):
                failures.append(str(answer))
    return failures


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        uel = uel_call.build(folder)
        code = re.findall(r"^```c\n(.*?)^```", (SOURCE / "doc/user_laws.md").read_text(encoding="utf-8"), re.S | re.M)[0]
        (folder / "rubber.c").write_text(code)
        os.environ["FINSHELL_LAWS"] = str(uel_call.build_laws(folder / "rubber.c", folder, "librubber.so"))
        failures = against_law_2(uel)
        library = uel_call.build_laws(SOURCE / "examples/user_laws/laws.c", folder)
        os.environ["FINSHELL_LAWS"] = f"{library}#arruda_boyce"
        failures += balloon(uel, folder, library)
        failures += refused(uel, library)
    for failure in failures:
        print("FAILED", failure)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
