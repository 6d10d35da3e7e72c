"""The problems that the hosts solve, from examples/ of this repository, with the answers of the driver.

    cases.py FOLDER      writes hemisphere.npz and disk.npz; the driver is FINSHELL_BIN (needs h5py)

hemisphere: pinched, 512 facets of linear elastic shell, in twenty steps of its forces (examples/sze34: Sze, Liu & Lo 2004, 3.4).
disk: rubber, blown up by a pressure that follows it, 384 facets, to 17 and to 50 psi (examples/rubber_disk: Caselli & Bisegna).

A host reads a case by `load`, asks `Shell` for the equations of its elements, and tells by `report` how far its displacements are
from those of the driver.
"""
from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "api" / "python"))
import finshell  # noqa: E402

LIMIT = 1e-9  # of the difference from the driver, over the largest displacement
TIGHT = ["--set", "step.tolerance='tight'", "--set", "step.residual_tolerance=1e-11", "--set", "step.correction_tolerance=1e-10"]


def driver(example, name):
    """What an example gives: nodes, triangles, load factors, and displacements at each of them."""
    from finshell.results import Results
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "--quiet", str(ROOT / "examples" / example), "-o", folder, *TIGHT],
                             capture_output=True, text=True, check=False)
        if run.returncode != 0:
            sys.exit(f"cases.py: the driver failed:\n{run.stdout}{run.stderr}")
        results = Results(Path(folder) / name)
        return results.points, results.triangles, results.load_factor, [results.displacement(step) for step in range(results.steps)]


def quarter(points):
    """Which of the six freedoms of the nodes two planes of symmetry hold: displacements along, rotations about other axes than
    their normals."""
    held = np.zeros((len(points), 6), bool)
    for axis in (0, 1):
        held[np.ix_(np.abs(points[:, axis]) < 1e-9, [axis] + [3 + k for k in range(3) if k != axis])] = True
    return held


def hemisphere():
    """The case, as arrays."""
    points, triangles, factor, displacement = driver("sze34/input.nml", "sze34")
    held, forces = quarter(points), np.zeros((len(points), 6))
    pulled, pushed = (int(np.argmin(np.linalg.norm(points - 10.0 * np.eye(3)[axis], axis=1))) for axis in (0, 1))
    held[pulled, 2] = True
    forces[pulled, 0], forces[pushed, 1] = 200.0, -200.0
    return {"law": "linear_elastic", "names": ["e", "nu"], "values": [6.825e7, 0.3], "thickness": 0.04,
            "points": points, "triangles": triangles, "held": held, "forces": forces, "pressure": 0.0,
            "normals": points[triangles],  # of a sphere about the origin; their length does not matter
            "straight": np.zeros(triangles.shape, int), "steps": np.linspace(0.05, 1.0, 20),
            "compared": [1.0], "displacement": [displacement[np.argmin(np.abs(factor - 1.0))]]}


def disk():
    """The case, as arrays."""
    points, triangles, factor, displacement = driver("rubber_disk/rubber_disk.nml", "rubber_disk")
    held, rim = quarter(points), np.hypot(points[:, 0], points[:, 1]) > 7.5 * (1 - 1e-9)
    held[np.ix_(rim, [0, 1, 2])] = True  # hinged
    compared = [17 / 70, 50 / 70]
    return {"law": "mooney_rivlin", "names": ["c10", "c01"], "values": [80.0, 20.0], "thickness": 0.5,
            "points": points, "triangles": triangles, "held": held, "forces": np.zeros((len(points), 6)), "pressure": 70.0,
            "normals": np.tile([0.0, 0.0, 1.0], (len(triangles), 3, 1)),
            # sides on the rim are held along both of their normals, so neither drilling rotations nor slopes bend them
            "straight": 2 * (rim[triangles] & rim[np.roll(triangles, -1, axis=1)]),
            "steps": np.concatenate([[0.1, 0.3, 1, 3, 8], np.linspace(17, 50, 12)]) / 70,
            "compared": compared, "displacement": [displacement[np.argmin(np.abs(factor - level))] for level in compared]}


def load(path):
    """A case as an object. In step k forces and pressure are multiplied by steps[k]; displacement (levels, nodes, 3) is that of the
    driver at the load factors `compared`."""
    with np.load(path) as file:
        return SimpleNamespace(**{name: values.item() if values.ndim == 0 else values for name, values in file.items()})


class Shell:
    """The elements of a case, or some of them, in unknowns that a host may add up: displacements and total rotation vectors."""

    def __init__(self, case, elements=slice(None)):
        names = [str(name) for name in case.names]
        self.section = finshell.Section(case.law, dict(zip(names, case.values)), case.thickness)
        self.X, self.pressure = case.points[case.triangles[elements]], case.pressure
        self.curved = {"normals": case.normals[elements], "straight": case.straight[elements]}

    def equations(self, unknowns, factor):
        """Residual (n, 18) of the elements, inner less outer forces, and its derivative (n, 18, 18).

        unknowns (n, 3, 6): element, node, displacement and rotation vector; in this order the 18 are those of the residual."""
        motion = self.X, unknowns[..., :3], unknowns[..., 3:]
        inside = self.section.evaluate(*motion, energy=False, **self.curved)
        if not self.pressure:
            return inside.force, inside.tangent
        outside = finshell.pressure(self.pressure * factor, *motion, **self.curved)
        return inside.force - outside.force, inside.tangent - outside.stiffness


def report(case, factor, displacement):
    """Print the difference from the driver at a load factor where its answer is known; it ends the program if larger than LIMIT."""
    for level, expected in zip(case.compared, case.displacement):
        if abs(level - factor) < 1e-12:
            largest = np.abs(expected).max()
            difference = np.abs(displacement - expected).max() / largest
            print(f"load factor {factor:.6f}: largest displacement {largest:.9f}, difference from the driver {difference:.1e}",
                  flush=True)
            if not difference < LIMIT:
                sys.exit(f"the largest difference from the driver is {difference:.1e} of {largest}, the limit is {LIMIT:.0e}")


if __name__ == "__main__":
    for make in (hemisphere, disk):
        np.savez(Path(sys.argv[1]) / f"{make.__name__}.npz", **make())
