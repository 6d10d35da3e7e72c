"""The problems that are solved through every host, with the mesh and the answer of the driver."""
import os
import re
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

STEP = "&step load_factor = 1.0 tolerance = 'tight' residual_tolerance = 1e-10 correction_tolerance = 1e-9 /\n"

CANTILEVER = """
&mesh generator = 'rectangle' lengths = 10.0, 1.0 divisions = 16, 1 /
&material name = 'elastic' law = 'st_venant_kirchhoff' e = 1.2e6 nu = 0.0 /
&section material = 'elastic' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'force' node_set = 'edge_x1' vector = 0.0, 0.0, 4.0 total = .true. /
&output fields = 'rotation' /
""" + STEP

HEMISPHERE = """
&mesh generator = 'sphere' radius = 10.0 colatitudes = 18.0, 90.0 azimuths = 0.0, 90.0 divisions = 8, 8 normals = '{normals}' /
&material name = 'elastic' law = 'st_venant_kirchhoff' e = 6.825e7 nu = 0.3 /
&section material = 'elastic' thickness = 0.04 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'corner_a0_bottom' fixed = 'uz' /
&load type = 'force' node_set = 'corner_a0_bottom' vector = 200.0, 0.0, 0.0 /
&load type = 'force' node_set = 'corner_a1_bottom' vector = 0.0, -200.0, 0.0 /
&output fields = 'rotation' /
""" + STEP

BALLOON = """
&mesh generator = 'sphere' radius = 10.0 colatitudes = 18.0, 90.0 azimuths = 0.0, 90.0 divisions = 4, 4 normals = '{normals}' /
&material name = 'rubber' law = 'neo_hookean' mu = 1.0e6 /
&section material = 'rubber' thickness = 0.4 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'edge_bottom' type = 'symmetry_z' /
&load type = 'pressure' pressure = 3.0e4 /
&output fields = 'rotation' /
""" + STEP


@dataclass
class Case:
    """Nodes and elements count from 0; degrees of freedom are 1 to 6."""

    name: str
    young: float  # or the shear modulus of the balloon, which is of rubber
    poisson: float
    thickness: float
    points: np.ndarray
    triangles: np.ndarray
    displacement: np.ndarray  # of the driver, (nodes, 3)
    rotation: np.ndarray  # rotation vectors of the driver, (nodes, 3)
    normals: np.ndarray | None = None  # at the nodes of the elements, (elements, 3, 3), of curved ones
    fixed: dict[int, set[int]] = field(default_factory=dict)  # node: degrees of freedom
    loads: list[tuple[int, tuple[float, float, float]]] = field(default_factory=list)
    pressure: float = 0.0

    def hold(self, nodes, dofs):
        for node in nodes:
            self.fixed.setdefault(int(node), set()).update(dofs)

    def error(self, displacement):
        """Largest difference from the driver over its largest displacement."""
        return np.abs(displacement - self.displacement).max() / np.abs(self.displacement).max()


def solve(name, folder, curved=False, law=None):
    """The case, solved by the driver in the given folder; `curved`: hemisphere and balloon with their normals; `law`: keys of &material
    instead of the law and the parameters above."""
    folder = Path(folder)
    text = {"cantilever": CANTILEVER, "hemisphere": HEMISPHERE, "balloon": BALLOON}[name].format(normals="exact" if curved else "facet")
    if law:
        text = re.sub(r"law = .* /\n", law + " /\n", text, count=1)
    (folder / f"{name}.nml").write_text(text)
    run = subprocess.run([os.environ["FINSHELL_BIN"], "run", f"{name}.nml"], cwd=folder, capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"the driver failed:\n{run.stdout}{run.stderr}")
    with h5py.File(folder / f"{name}.vtkhdf") as file:
        grid = file["VTKHDF"]
        points = grid["Points"][:]
        triangles = grid["Connectivity"][:].reshape(-1, 3)
        last = grid["Steps/PointDataOffsets/displacement"][-1]
        displacement = grid["PointData/displacement"][last:last + len(points)]
        rotation = grid["PointData/rotation"][last:last + len(points)]
    x, y, z = points.T
    if name == "cantilever":
        case = Case(name, 1.2e6, 0.0, 0.1, points, triangles, displacement, rotation)
        case.hold(np.flatnonzero(x < 1e-6), {1, 2, 3, 4, 5, 6})
        end = np.flatnonzero(x > 10.0 - 1e-6)
        case.loads = [(int(node), (0.0, 0.0, 4.0 / len(end))) for node in end]
    elif name == "balloon":
        case = Case(name, 1.0e6, 0.0, 0.4, points, triangles, displacement, rotation, points[triangles] if curved else None)
        case.hold(np.flatnonzero(np.abs(y) < 1e-6), {2, 4, 6})
        case.hold(np.flatnonzero(np.abs(x) < 1e-6), {1, 5, 6})
        case.hold(np.flatnonzero(np.abs(z) < 1e-6), {3, 4, 5})
        case.pressure = 3.0e4
    else:
        case = Case(name, 6.825e7, 0.3, 0.04, points, triangles, displacement, rotation, points[triangles] if curved else None)
        case.hold(np.flatnonzero(np.abs(y) < 1e-6), {2, 4, 6})
        case.hold(np.flatnonzero(np.abs(x) < 1e-6), {1, 5, 6})
        a = int(np.argmax(x - 1e3 * (np.abs(y) + np.abs(z))))
        b = int(np.argmax(y - 1e3 * (np.abs(x) + np.abs(z))))
        case.hold([a], {3})
        case.loads = [(a, (200.0, 0.0, 0.0)), (b, (0.0, -200.0, 0.0))]
    return case
