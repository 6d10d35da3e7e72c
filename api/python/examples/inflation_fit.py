"""Recover c10 and c01 of a Mooney-Rivlin rubber from the inflation of a sphere: pressures measured at a few volumes.

The program solves the balloon under volume control and, with `&sensitivity`, gives the derivatives of the pressure with respect to both
parameters at each volume (doc/sensitivity.md). So Gauss-Newton needs one run an iteration, and no run for a derivative.
The measurement here is the exact curve of a thin sphere (Rivlin 1952) for c10 = 80, c01 = 20, p R/h over the stretch.

    FINSHELL_BIN=.../finshell python inflation_fit.py [cells along a side]
"""
from __future__ import annotations

import csv
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import List, Tuple

import numpy as np
from scipy.optimize import least_squares

RADIUS, THICKNESS = 10.0, 0.01
PROGRAM = os.environ.get("FINSHELL_BIN", "finshell")
INPUT = """&mesh generator = 'sphere' radius = {radius} colatitudes = 0.0, 90.0 azimuths = 0.0, 90.0 divisions = {cells}, {cells} /
&material name = 'rubber' law = 'mooney_rivlin' c10 = {c10!r} c01 = {c01!r} /
&section thickness = {thickness} /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'edge_bottom' type = 'symmetry_z' /
&load type = 'pressure' pressure = {unit} /
&step control = 'volume' volumes = {volumes} first_increment = {first} tolerance = 'tight' /
&monitor name = 'volume' quantity = 'volume' /
&sensitivity monitor = 'load_factor' parameter = 'material.c10' name = 'd_c10' scale = 1.0 /
&sensitivity monitor = 'load_factor' parameter = 'material.c01' name = 'd_c01' scale = 1.0 /
&output every = 0 restart = 'none' /
"""


class Balloon:
    """The program as a function of the two parameters; it counts its runs."""

    def __init__(self, stretches: "np.ndarray", cells: int = 12) -> None:
        self.volumes = np.pi / 6 * (RADIUS * np.asarray(stretches)) ** 3  # of an octant
        self.cells = cells
        self.runs = 0
        self._last: Tuple[Tuple[float, float], "np.ndarray"] = ((np.nan, np.nan), np.zeros((0, 3)))

    def curve(self, parameters: "np.ndarray") -> "np.ndarray":
        """p R/h at the volumes, and its derivatives with respect to c10 and c01: (volumes, 3)."""
        key = (float(parameters[0]), float(parameters[1]))
        if key != self._last[0]:
            self._last = (key, self._solve(*key))
        return self._last[1]

    def _solve(self, c10: float, c01: float) -> "np.ndarray":
        self.runs += 1
        text = INPUT.format(radius=RADIUS, thickness=THICKNESS, unit=THICKNESS / RADIUS, cells=self.cells, c10=c10, c01=c01,
                            volumes=", ".join(f"{v:.10g}" for v in self.volumes), first=float(self.volumes[0] - np.pi / 6 * RADIUS**3))
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "balloon.nml").write_text(text)
            subprocess.run([PROGRAM, "run", "--quiet", "balloon.nml"], cwd=folder, check=True, capture_output=True)
            with (Path(folder) / "balloon.history.csv").open() as file:
                rows = [[float(row[key]) for key in ("volume", "load_factor", "d_c10", "d_c01")] for row in csv.DictReader(file)]
        table = np.array(rows)
        return np.array([table[np.argmin(np.abs(table[:, 0] - v)), 1:] for v in self.volumes])


def fit(balloon: Balloon, measured: "np.ndarray", start: Tuple[float, float] = (50.0, 5.0)) -> List[float]:
    """Parameters with the least squares of relative differences of pressures."""
    found = least_squares(lambda c: balloon.curve(c)[:, 0] / measured - 1, start, jac=lambda c: balloon.curve(c)[:, 1:] / measured[:, None],
                          bounds=([1e-3, 0.0], [np.inf, np.inf]), x_scale=np.array(start), xtol=1e-10, ftol=1e-14, gtol=1e-12)
    return [float(x) for x in found.x]


def exact(stretches: "np.ndarray", c10: float = 80.0, c01: float = 20.0) -> "np.ndarray":
    """p R/h of a thin sphere."""
    return 4 * (1 / stretches - 1 / stretches**7) * (c10 + c01 * stretches**2)


if __name__ == "__main__":
    at = np.array([1.1, 1.3, 1.5, 2.0, 2.5, 3.0])
    model = Balloon(at, int(sys.argv[1]) if len(sys.argv) > 1 else 12)
    c10_found, c01_found = fit(model, exact(at))
    print(f"c10 = {c10_found:.4f} (80), c01 = {c01_found:.4f} (20) after {model.runs} runs")
