#!/usr/bin/env python3
"""Results of the rubber disk against the reference: a table, and three pictures.

    plot.py [FOLDER]

FOLDER (default: here) holds rubber_disk.history.csv and rubber_disk.vtkhdf; the pictures go there too:
    load_deflection.png, thickness_stretch.png, deformed_17_50_70.png
The reference (reference_at_w.csv, reference_at_p.csv) is a shell of revolution with the same kinematics, solved to 7 digits:
what a fine mesh of the element must approach. Between its rows it is interpolated (relative error about 1e-4).
"""
import argparse
import csv
import sys
from pathlib import Path

import h5py
import matplotlib

matplotlib.use("Agg")  # draws without a display
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.collections import PolyCollection  # noqa: E402
from matplotlib.colors import ListedColormap, LogNorm  # noqa: E402

HERE = Path(__file__).resolve().parent
FULL_PRESSURE = 70.0  # psi, at load factor 1
RADIUS = 7.5  # in
SHOWN = (17.0, 50.0, 70.0)  # psi: the deformed shapes of the paper
BLUE, GREY = "#1f5fa8", "#3c3c3c"

plt.rcParams.update({
    "font.family": "serif", "font.size": 10, "mathtext.fontset": "cm", "axes.linewidth": 0.7, "lines.linewidth": 1.2,
    "xtick.direction": "in", "ytick.direction": "in", "xtick.top": True, "ytick.right": True, "legend.frameon": False,
    "savefig.dpi": 200, "savefig.bbox": "tight",
})


class Missing(Exception):
    """A file, column or field that is not there."""


def read_csv(path):
    """The columns of a CSV file by name; lines that begin with # are comments, empty cells become NaN."""
    if not path.exists():
        raise Missing(f"{path}: no such file")
    with path.open(newline="") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    columns = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows[1:]])
    columns = columns.reshape(len(rows) - 1, len(rows[0]))
    return {name: columns[:, i] for i, name in enumerate(rows[0])}


class Reference:
    """Both reference tables as one curve: pressure and thickness stretch as functions of the deflection, and back."""

    def __init__(self):
        at_w, at_p = read_csv(HERE / "reference_at_w.csv"), read_csv(HERE / "reference_at_p.csv")
        w = np.concatenate([at_w["w"], at_p["w_shell"]])
        order = np.argsort(w)
        self.w = w[order]
        self.p = np.concatenate([at_w["p_shell"], at_p["p"]])[order]
        self.stretch = np.concatenate([at_w["lambda_z"], at_p["lambda_z"]])[order]

    def pressure(self, w):
        return np.exp(interpolated(np.log(w), np.log(self.w), np.log(self.p)))

    def deflection(self, p):
        return np.exp(interpolated(np.log(p), np.log(self.p), np.log(self.w)))

    def thickness_stretch(self, w):
        # -log(stretch) grows like w**2 at first
        return np.exp(-np.exp(interpolated(np.log(w), np.log(self.w), np.log(-np.log(self.stretch)))))


def interpolated(x, xs, ys):
    """Cubic through the four nearest points (two on each side where there are two); NaN outside of the table."""
    x = np.atleast_1d(np.asarray(x, dtype=float))
    first = np.clip(np.searchsorted(xs, x) - 2, 0, len(xs) - 4)
    points, values = xs[first[:, None] + np.arange(4)], ys[first[:, None] + np.arange(4)]
    y = np.zeros_like(x)
    for i in range(4):
        others = [j for j in range(4) if j != i]
        y += values[:, i] * np.prod([(x - points[:, j]) / (points[:, i] - points[:, j]) for j in others], axis=0)
    return np.where((x < xs[0] - 1e-9) | (x > xs[-1] + 1e-9), np.nan, y)


def read_history(path):
    """Pressure, deflection and thickness stretch of the loaded increments."""
    table = read_csv(path)
    absent = [name for name in ("load_factor", "w", "lambda_z") if name not in table]
    if absent:
        raise Missing(f"{path}: no column {', '.join(absent)}; found {', '.join(table)}")
    loaded = table["load_factor"] > 0
    if not loaded.any():
        raise Missing(f"{path}: no loaded increment")
    return FULL_PRESSURE * table["load_factor"][loaded], np.abs(table["w"][loaded]), table["lambda_z"][loaded]


def print_table(p, w, stretch, reference):
    """Every increment beside the reference at the same pressure, and the error of the pressure at the same deflection."""
    with np.errstate(invalid="ignore"):
        w_reference = reference.deflection(p)
        stretch_reference = reference.thickness_stretch(w_reference)
        p_error = 100 * (p / reference.pressure(w) - 1)
        w_error, stretch_error = 100 * (w / w_reference - 1), 100 * (stretch / stretch_reference - 1)
    print("Rubber disk: pole deflection w and thickness stretch lambda_z against the reference at the same pressure;")
    print("last column: error of the pressure at the same deflection.\n")
    print("  p (psi)     w (in)  reference  error %    lambda_z  reference  error %    p error %")
    for row in zip(p, w, w_reference, w_error, stretch, stretch_reference, stretch_error, p_error):
        cells = "{:9.4f}  {:9.4f}  {:9.4f}  {:7.2f}   {:9.5f}  {:9.5f}  {:7.2f}   {:9.2f}".format(*row)
        print(cells.replace("nan", "  -"))
    print()


def finish(figure, path):
    figure.savefig(path)
    plt.close(figure)
    return path


def plot_load_deflection(path, p, w, reference):
    """Pressure against the deflection of the centre (figure 3b of the paper)."""
    figure, axes = plt.subplots(figsize=(4.8, 3.6))
    fine = np.geomspace(reference.w[0], reference.w[-1], 400)
    axes.plot(np.r_[0, fine], np.r_[0, reference.pressure(fine)], color=GREY, lw=0.8, zorder=1)
    axes.plot(reference.w, reference.p, "o", color=GREY, mfc="white", ms=5, mew=0.8, zorder=2,
              label="reference (shell of revolution)")
    axes.plot(np.r_[0, w], np.r_[0, p], ".", color=BLUE, ms=7, zorder=3, label=f"finshell, {len(p)} increments")
    axes.set_xlabel("vertical displacement at the disk centre (in)")
    axes.set_ylabel("pressure (psi)")
    axes.set_xlim(0, 1.04 * max(reference.w[-1], w.max()))
    axes.set_ylim(0, 1.06 * max(reference.p[-1], p.max()))
    axes.legend(loc="lower right")
    return finish(figure, path)


def plot_thickness_stretch(path, w, stretch, reference):
    """Thickness stretch at the centre against the deflection (figure 5 of the paper), in the inset on a logarithmic scale."""
    figure, axes = plt.subplots(figsize=(4.8, 3.6))
    inset = axes.inset_axes([0.46, 0.34, 0.5, 0.42])
    fine = np.geomspace(reference.w[0], reference.w[-1], 400)
    for frame, size in ((axes, 1.0), (inset, 0.7)):
        frame.plot(np.r_[0, fine] / RADIUS, np.r_[1, reference.thickness_stretch(fine)], color=GREY, lw=0.8, zorder=1)
        frame.plot(reference.w / RADIUS, reference.stretch, "o", color=GREY, mfc="white", ms=5 * size, mew=0.8, zorder=2,
                   label="reference (shell of revolution)")
        frame.plot(np.r_[0, w] / RADIUS, np.r_[1, stretch], ".", color=BLUE, ms=7 * size, zorder=3, label="finshell")
        frame.set_xlim(0, 1.04 * max(reference.w[-1], w.max()) / RADIUS)
    axes.set_xlabel(r"vertical displacement at the disk centre / $R$ (–)")
    axes.set_ylabel(r"thickness stretch at the disk centre $\lambda_Z$ (–)")
    axes.set_ylim(0, 1.05)
    axes.legend(loc="upper right")
    inset.set_yscale("log")
    inset.set_ylim(0.02, 1.3)
    inset.set_yticks([0.03, 0.1, 0.3, 1], ["0.03", "0.1", "0.3", "1"])
    inset.minorticks_off()
    inset.tick_params(labelsize=8)
    return finish(figure, path)


class Shapes:
    """Deformed shapes from the result file, one for each pressure that is asked for."""

    def __init__(self, path):
        if not path.exists():
            raise Missing(f"{path}: no such file")
        self.path = path
        with h5py.File(path) as file:
            grid = file["VTKHDF"]
            steps = int(grid["Steps"].attrs["NSteps"])
            self.x = grid["Points"][:]
            self.triangles = grid["Connectivity"][:].reshape(-1, 3)
            self.pressure = FULL_PRESSURE * grid["FieldData/load_factor"][:steps]
            if steps == 0 or "PointData/displacement" not in grid:
                raise Missing(f"{path}: no step with the point field displacement")
            self.u = grid["PointData/displacement"][: steps * len(self.x)].reshape(steps, len(self.x), 3)
            self.stretch = None
            if "CellData/thickness_stretch" in grid:
                self.stretch = grid["CellData/thickness_stretch"][: steps * len(self.triangles)].reshape(steps, -1)

    def at(self, pressure):
        """Points, thickness stretch and pressure of the step nearest to `pressure`; says so when it is not exactly there."""
        step = int(np.argmin(abs(self.pressure - pressure)))
        found = self.pressure[step]
        if abs(found - pressure) > 1e-6 * FULL_PRESSURE:
            print(f"{self.path.name}: no step at {pressure:g} psi; the nearest, at {found:.4g} psi, is drawn", file=sys.stderr)
        points = self.x + self.u[step]
        if points[np.argmax(abs(self.u[step, :, 2])), 2] < 0:
            points = points * [1, 1, -1]  # the disk bulges upward
        return points, None if self.stretch is None else self.stretch[step], found

    def mirrors(self):
        """Factors and swaps that complete the model (a whole, half, quarter or eighth disk) to the full disk."""
        angle = np.degrees(np.arctan2(self.x[:, 1], self.x[:, 0]))[np.hypot(self.x[:, 0], self.x[:, 1]) > 1e-6 * RADIUS]
        width = angle.max() - angle.min()
        copies = [np.eye(3)]
        if width < 60:
            copies += [m[:, [1, 0, 2]] for m in copies]
        if width < 120:
            copies += [m @ np.diag([-1, 1, 1]) for m in copies]
        if width < 240:
            copies += [m @ np.diag([1, -1, 1]) for m in copies]
        return copies


def view(elevation=17.0, azimuth=-62.0):
    """Orthographic view: the unit vectors across and up in the picture, and toward the eye."""
    e, a = np.radians([elevation, azimuth])
    across = np.array([-np.sin(a), np.cos(a), 0])
    toward = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    return across, np.cross(toward, across), toward


def outside(corners):
    """Unit normals of triangles (n, 3, 3) that form a dome, pointing away from its axis and base."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    inner = np.array([0, 0, 0.35 * corners[:, :, 2].max()])
    sign = np.sign(np.einsum("ij,ij->i", normal, corners.mean(axis=1) - inner))
    return normal * np.where(sign == 0, 1, sign)[:, None]


def plot_deformed(path, shapes):
    """The deformed disk at 17, 50 and 70 psi (figure 4 of the paper), at one scale."""
    drawn = [shapes.at(p) for p in SHOWN]
    colours = ListedColormap(plt.get_cmap("viridis")(np.linspace(1.0, 0.22, 256)))
    coloured = shapes.stretch is not None
    norm = LogNorm(min(s.min() for _, s, _ in drawn), 1.0) if coloured else None
    light = np.array([0.25, -0.65, 0.72])
    across, up, toward = view()
    figure, axes = plt.subplots(figsize=(8.2, 4.6))
    gap, edge, low, top = 2.0, 0.0, -0.5 * RADIUS, 0.0
    for points, stretch, pressure in drawn:
        mirrors = shapes.mirrors()
        corners = np.concatenate([(points @ m)[shapes.triangles] for m in mirrors])
        normals = outside(corners)
        shift = edge - (corners @ across).min()
        base = colours(norm(np.tile(stretch, len(mirrors))))[:, :3] if coloured else np.array([[0.55, 0.68, 0.85]])
        face = base * (0.62 + 0.38 * np.clip(normals @ light, 0, 1))[:, None]
        # faces turned to the eye, from the farthest to the nearest; first without lines, a little larger, to close all seams
        order = np.argsort((corners @ toward).mean(axis=1))
        order = order[normals[order] @ toward > 0]
        flat = np.stack([corners @ across + shift, corners @ up], axis=-1)[order]
        axes.add_collection(PolyCollection(flat, facecolors=face[order], edgecolors=face[order], linewidths=0.5))
        axes.add_collection(PolyCollection(flat, facecolors="none", edgecolors=(0, 0, 0, 0.3), linewidths=0.2))
        edge, top = flat[:, :, 0].max() + gap, max(top, flat[:, :, 1].max())
        label = f"{pressure:.4g} psi\n" + rf"$w$ = {np.ptp(points[:, 2]):.1f} in"
        axes.text(shift, low - 0.8, label, ha="center", va="top", linespacing=1.5)
    # scale bar, in the empty corner above the smallest shape
    axes.plot([0, 10], [top - 2, top - 2], color="black", lw=1.5, solid_capstyle="butt")
    for end in (0, 10):
        axes.plot([end, end], [top - 2.5, top - 1.5], color="black", lw=0.8)
    axes.text(5, top - 2.9, "10 in", ha="center", va="top")
    axes.set_xlim(-1, edge - gap + 1)
    axes.set_ylim(low - 6, top + 1)
    axes.set_aspect("equal")
    axes.axis("off")
    if coloured:
        bar = figure.colorbar(plt.cm.ScalarMappable(norm, colours), ax=axes, shrink=0.6, pad=0.02, aspect=25)
        ticks = [t for t in (0.03, 0.05, 0.1, 0.2, 0.5, 1.0) if t >= 0.999 * norm.vmin]
        bar.set_ticks(ticks, labels=[f"{t:g}" for t in ticks])
        bar.ax.minorticks_off()
        bar.set_label(r"thickness stretch $\lambda_Z$ (–)")
    return finish(figure, path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("."))
    folder = parser.parse_args().folder
    try:
        reference = Reference()
        p, w, stretch = read_history(folder / "rubber_disk.history.csv")
        print_table(p, w, stretch, reference)
        pictures = [
            plot_load_deflection(folder / "load_deflection.png", p, w, reference),
            plot_thickness_stretch(folder / "thickness_stretch.png", w, stretch, reference),
            plot_deformed(folder / "deformed_17_50_70.png", Shapes(folder / "rubber_disk.vtkhdf")),
        ]
    except Missing as reason:
        sys.exit(f"plot.py: {reason}")
    for picture in pictures:
        print(picture)


if __name__ == "__main__":
    main()
