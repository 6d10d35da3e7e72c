"""finshell-plot: a result file as a picture (.png) or an animation (.gif, .mp4), without a display.

    finshell-plot disk.vtkhdf                                     # disk.png: the last increment, coloured by the displacement
    finshell-plot disk -o stress.png --field principal_stress --component 1 --view 30,20 --mirror xy
    finshell-plot disk -o disk.gif                                # all increments
    finshell-plot disk -o curve.png --history w load_factor       # columns of disk.history.csv

Needs h5py and matplotlib; .mp4 also ffmpeg (or the Python package imageio-ffmpeg).
"""
from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Iterable, List, Optional, Sequence, Tuple

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from ._library import Doubles
from ._raster import Colour, View, draw, view_from
from .results import History, Missing, Results, Sets, Values, beside

VIEWS = {"iso": (-60.0, 25.0), "x": (0.0, 0.0), "-x": (180.0, 0.0), "y": (90.0, 0.0), "-y": (-90.0, 0.0), "z": (-90.0, 90.0), "-z": (-90.0, -90.0)}
STILL, MOVING = (".png", ".pdf", ".svg"), (".gif", ".mp4")


@dataclass
class Options:
    """What is drawn, and how."""

    field: str = "displacement"
    component: Optional[str] = None
    deformed: Optional[float] = 1.0  # None: the largest displacement is a tenth of the size
    view: Optional[str] = None
    set: Optional[str] = None
    mirror: str = ""
    edges: Optional[bool] = None
    smooth: bool = False
    lit: bool = True
    limits: Optional[Tuple[float, float]] = None
    colours: str = "viridis"
    size: Tuple[int, int] = (1000, 750)
    title: Optional[str] = None


class Scene:
    """What all pictures of a result file have in common: triangles, view, window, colours."""

    def __init__(self, results: Results, steps: Sequence[int], options: Options) -> None:
        self.results, self.options = results, options
        self.elements = np.ones(len(results.triangles), bool)
        if options.set:
            self.elements = results.elements_of(options.set, Sets(results))
            if not self.elements.any():
                raise Missing(f"{results.path}: the set '{options.set}' has no triangles")
        self.scale = self._scale(steps)
        self._arrange(results.triangles[self.elements], steps)
        shapes = [self.points(step) for step in steps]
        low = np.min([s.min(axis=0) for s in shapes], axis=0)
        high = np.max([s.max(axis=0) for s in shapes], axis=0)
        self.view = self._view(high - low)
        flat = [np.array([s @ self.view.across, s @ self.view.up]) for s in shapes]
        self.low, self.high = np.min([f.min(axis=1) for f in flat], axis=0), np.max([f.max(axis=1) for f in flat], axis=0)
        fields = [self.values(step) for step in steps]
        self.label = fields[0].name
        self.limits = options.limits or self._limits(fields)

    def _arrange(self, triangles: "np.ndarray", steps: Sequence[int]) -> None:
        """What is drawn, with mirror images: from which nodes (`source`, times `factor`) and elements it comes."""
        self.source = np.unique(triangles)
        self.triangles = np.searchsorted(self.source, triangles)
        self.factor = np.ones((len(self.source), 3))
        self.copies = 1
        far = np.abs(self.results.points)
        for step in steps:
            far = np.maximum(far, np.abs(self.results.points + self.scale * self.results.displacement(step)))
        far = far > 1e-6 * np.ptp(self.results.points, axis=0).max()
        for axis in map("xyz".index, self.options.mirror):
            image = np.flatnonzero(far[self.source, axis])  # nodes that stay in the plane are their own images
            number = np.arange(len(self.source))
            number[image] = len(self.source) + np.arange(len(image))
            self.triangles = np.concatenate([self.triangles, number[self.triangles][:, ::-1]])
            self.source = np.concatenate([self.source, self.source[image]])
            self.factor = np.concatenate([self.factor, self.factor[image] * np.where(np.arange(3) == axis, -1.0, 1.0)])
            self.copies *= 2

    def _scale(self, steps: Sequence[int]) -> float:
        if self.options.deformed is not None:
            return self.options.deformed
        largest = max(float(np.abs(self.results.displacement(step)).max()) for step in steps)
        return 0.1 * float(np.ptp(self.results.points, axis=0).max()) / largest if largest > 0 else 1.0

    def _view(self, extent: Doubles) -> View:
        name = self.options.view or ("z" if extent[2] <= 1e-6 * extent.max() else "iso")
        if name in VIEWS:
            return view_from(*VIEWS[name])
        try:
            azimuth, elevation = (float(word) for word in name.split(","))
        except ValueError:
            raise Missing(f"no view '{name}'; there are {', '.join(VIEWS)}, and AZIMUTH,ELEVATION in degrees") from None
        return view_from(azimuth, elevation)

    def _limits(self, fields: Iterable[Values]) -> Tuple[float, float]:
        finite = [v.values[np.isfinite(v.values)] for v in fields]
        finite = [v for v in finite if v.size]
        if not finite:
            return 0.0, 1.0
        return float(min(v.min() for v in finite)), float(max(v.max() for v in finite))

    def values(self, step: int) -> Values:
        """The field on the nodes or triangles that are drawn."""
        found = self.results.values(self.options.field, self.options.component, step)
        if found.on_nodes:
            return found._replace(values=found.values[self.source])
        values = np.tile(found.values[self.elements], self.copies)
        if not self.options.smooth:
            return found._replace(values=values)
        known = np.isfinite(values)
        count, total = np.zeros(len(self.source)), np.zeros(len(self.source))
        np.add.at(count, self.triangles[known], 1.0)
        np.add.at(total, self.triangles[known], values[known, None])
        return Values(found.name + ", means at nodes", np.where(count > 0, total / np.maximum(count, 1), np.nan), True)

    def points(self, step: int) -> Doubles:
        """(nodes that are drawn, 3)."""
        return (self.results.points + self.scale * self.results.displacement(step))[self.source] * self.factor

    def figure(self, step: int) -> Figure:
        """One picture with its colour bar."""
        options = self.options
        width, height = options.size
        figure = blank(width, height)
        box = (0.03, 0.05, 0.79, 0.84)
        pixels = int(width * box[2]), int(height * box[3])
        extent = np.maximum(self.high - self.low, 1e-300)
        per_pixel = 1.06 * max(extent[0] / pixels[0], extent[1] / pixels[1])
        centre = (self.low + self.high) / 2
        values = self.values(step)
        palette = colormaps[options.colours].with_extremes(bad=(0.75, 0.75, 0.75))
        norm = Normalize(*self.limits) if self.limits[1] > self.limits[0] else Normalize(self.limits[0] - 0.5, self.limits[0] + 0.5)
        picture = draw(self.points(step), self.triangles, Colour(values.values, values.on_nodes, norm, palette), self.view, *pixels,
                       (float(centre[0]), float(centre[1]), float(per_pixel)), options.edges, options.lit)
        axes = figure.add_axes(box)
        axes.imshow(picture, interpolation="nearest", aspect="equal")
        axes.axis("off")
        bar = figure.colorbar(ScalarMappable(norm, palette), cax=figure.add_axes((0.85, 0.2, 0.022, 0.55)))
        bar.outline.set_linewidth(0.5)
        bar.set_label(values.name.replace("_", " "))
        figure.text(0.03, 0.95, options.title if options.title is not None else self.results.title, fontsize=13)
        figure.text(0.03, 0.915, self.caption(step), fontsize=9, color="0.35")
        self._axes(figure)
        return figure

    def caption(self, step: int) -> str:
        """Increment, time, load factor and scale in words."""
        time = "" if self.results.time is None else f"time {self.results.time[step]:.4g}, "
        text = f"increment {self.results.increments[step]}, {time}load factor {self.results.load_factor[step]:.5g}"
        return text if self.scale == 1.0 else f"{text}, displacements × {self.scale:.3g}"

    def _axes(self, figure: Figure) -> None:
        size, (width, height) = 34.0, self.options.size
        axes = figure.add_axes((0.84, 0.02, 0.14, 0.14 * width / height), frameon=False, xticks=[], yticks=[], xlim=(-1.5, 1.5), ylim=(-1.5, 1.5))
        order = np.argsort(self.view.toward)  # what points away from the eye is drawn first
        for axis in order:
            x, y = float(self.view.across[axis]), float(self.view.up[axis])
            if np.hypot(x, y) < 0.05:
                continue
            axes.annotate("", (x, y), (0, 0), arrowprops={"arrowstyle": "-|>", "lw": 1.0, "color": "0.25", "shrinkA": 0, "shrinkB": 0,
                                                       "mutation_scale": size / 4})
            axes.text(1.25 * x, 1.25 * y, "xyz"[axis], ha="center", va="center", fontsize=9, color="0.25")


def blank(width: int, height: int) -> Figure:
    """An empty picture of so many pixels; its letters grow with the root of its width."""
    dpi = 100 * np.sqrt(width / 1000)
    figure = Figure(figsize=(width / dpi, height / dpi), dpi=dpi)
    FigureCanvasAgg(figure)
    return figure


def curves(path: Path, x: str, names: Sequence[str], options: Options) -> Figure:
    """Columns of the history over another column."""
    history = History(path)
    across = history.column(x)
    width, height = options.size
    figure = blank(width, height)
    axes = figure.add_subplot()
    for name in names:
        axes.plot(across, history.column(name), marker="o", ms=4, lw=1.4, label=name)
    axes.set_xlabel(x)
    axes.set_ylabel(names[0] if len(names) == 1 else "")
    if len(names) > 1:
        axes.legend(frameon=False)
    axes.grid(color="0.9")
    axes.set_axisbelow(True)
    title = options.title
    if title is None:
        title = Results(path).title if beside(path, ".vtkhdf").is_file() else history.path.name
    axes.set_title(title, loc="left", fontsize=13)
    return figure


def pixels_of(figure: Figure) -> "np.ndarray":
    """(height, width, 3) bytes of a figure."""
    canvas = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def animate(figures: Iterable[Figure], path: Path, rate: float) -> None:
    """Write pictures one after the other."""
    if path.suffix == ".gif":
        from PIL import Image  # matplotlib needs it as well

        frames = [Image.fromarray(pixels_of(figure)) for figure in figures]
        # one table of colours for all pictures: a colour counts by the root of how often it occurs, so that rare ones have a place
        codes, count = np.unique(np.concatenate([np.asarray(f, dtype=np.uint32).reshape(-1, 3) @ (65536, 256, 1) for f in frames]), return_counts=True)
        many = np.repeat(codes, np.ceil(np.sqrt(count)).astype(int))
        seen = np.stack([many >> 16, many >> 8 & 255, many & 255], axis=1).astype(np.uint8)
        table = Image.fromarray(seen[None]).quantize(colors=256, method=Image.Quantize.MEDIANCUT)
        colours = np.array(table.getpalette()).reshape(-1, 3)
        colours[colours.min(axis=1) > 240] = 255  # white stays white; the look-up of colours is coarse
        table.putpalette(colours.ravel().tolist())
        frames = [frame.quantize(palette=table, dither=Image.Dither.FLOYDSTEINBERG) for frame in frames]
        times = [round(1000 / rate)] * (len(frames) - 1) + [max(1000, round(1000 / rate))]
        frames[0].save(path, save_all=True, append_images=frames[1:], duration=times, loop=0)
        return
    writer: Optional[subprocess.Popen] = None
    for figure in figures:
        frame = pixels_of(figure)
        frame = np.ascontiguousarray(frame[: frame.shape[0] // 2 * 2, : frame.shape[1] // 2 * 2])
        if writer is None:
            writer = subprocess.Popen(
                [ffmpeg(), "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{frame.shape[1]}x{frame.shape[0]}",
                 "-r", str(rate), "-i", "-", "-pix_fmt", "yuv420p", str(path)], stdin=subprocess.PIPE)
        assert writer.stdin is not None
        writer.stdin.write(frame.tobytes())
    if writer is not None:
        writer.communicate()
        if writer.returncode != 0:
            raise Missing(f"{path}: ffmpeg could not write it, see above")


def ffmpeg() -> str:
    """Path of the program."""
    found = shutil.which("ffmpeg")
    if found:
        return found
    try:
        import imageio_ffmpeg
    except ImportError:
        raise Missing("an .mp4 needs ffmpeg: install it, or `pip install imageio-ffmpeg`, or take .gif") from None
    return imageio_ffmpeg.get_ffmpeg_exe()


def chosen_steps(results: Results, wanted: Optional[str], moving: bool, path: Path) -> List[int]:
    """The sets of fields that are drawn."""
    wanted = wanted or ("all" if moving else "last")
    if wanted == "all":
        if not moving:
            raise Missing(f"{path}: a picture shows one increment; for all of them name a file that ends in .gif or .mp4")
        return list(range(results.steps))
    if wanted == "last":
        return [results.last]
    try:
        return [results.step_of(int(wanted))]
    except ValueError:
        raise Missing(f"--increment '{wanted}': found no whole number, 'last' or 'all'") from None


def parser() -> argparse.ArgumentParser:
    """What the command line may have."""
    p = argparse.ArgumentParser(prog="finshell-plot", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("results", type=Path, metavar="RESULTS", help="NAME, NAME.vtkhdf or another of its files")
    p.add_argument("-o", "--output", type=Path, metavar="FILE", help=f"{', '.join(STILL + MOVING)}; default NAME.png")
    p.add_argument("--field", default="displacement", metavar="NAME", help="any field in the file; `stress` means stress_middle")
    p.add_argument("--component", metavar="C", help="x, y, z, magnitude; 11, 22, 12; 1, 2: as doc/namelist.md has them")
    p.add_argument("--increment", metavar="N", help="a number, last or all; -2: the last but one. Default: last; of an animation all")
    p.add_argument("--deformed", default="1", metavar="SCALE", help="displacements times this; 0: the reference; auto: made visible")
    p.add_argument("--view", metavar="V", help="iso, x, -x, y, -y, z, -z (from there), or AZIMUTH,ELEVATION in degrees (--view=-60,20)")
    p.add_argument("--set", metavar="NAME", help="elements of this set only (of NAME.msh, which `finshell mesh` writes)")
    p.add_argument("--mirror", default="", metavar="AXES", help="complete a part: xy adds the images behind x = 0 and y = 0")
    p.add_argument("--edges", action=argparse.BooleanOptionalAction, default=None, help="lines of the mesh; default: if there is room")
    p.add_argument("--smooth", action="store_true", help="element fields: means at the nodes instead of one value an element")
    p.add_argument("--unlit", action="store_true", help="colours exactly as in the bar")
    p.add_argument("--range", nargs=2, type=float, metavar=("LOW", "HIGH"), help="of the colours")
    p.add_argument("--colours", default="viridis", metavar="NAME", help="a colour map of matplotlib")
    p.add_argument("--size", default="1000x750", metavar="WxH", help="in pixels")
    p.add_argument("--title", help="instead of that of the input")
    p.add_argument("--rate", type=float, default=8.0, metavar="R", help="pictures a second")
    p.add_argument("--history", nargs="+", metavar="COLUMN", help="X Y...: columns Y of NAME.history.csv over column X")
    return p


def options_of(arguments: argparse.Namespace) -> Options:
    """The options, checked."""
    try:
        deformed = None if arguments.deformed == "auto" else float(arguments.deformed)
    except ValueError:
        raise Missing(f"--deformed '{arguments.deformed}': found no number, and not 'auto'") from None
    try:
        width, height = (int(word) for word in arguments.size.split("x"))
    except ValueError:
        raise Missing(f"--size '{arguments.size}': expected WIDTHxHEIGHT in pixels, like 1000x750") from None
    if not (100 <= width <= 10000 and 100 <= height <= 10000):
        raise Missing(f"--size '{arguments.size}': expected 100 to 10000 pixels")
    if set(arguments.mirror) - set("xyz"):
        raise Missing(f"--mirror '{arguments.mirror}': expected letters out of x, y, z")
    if arguments.colours not in colormaps:
        raise Missing(f"--colours '{arguments.colours}': matplotlib has no such map; viridis, plasma, cividis, coolwarm are some")
    if arguments.range and not arguments.range[0] < arguments.range[1]:
        raise Missing("--range: the first number must be below the second")
    if not 0.1 <= arguments.rate <= 100:
        raise Missing(f"--rate {arguments.rate:g}: expected 0.1 to 100 pictures a second")
    return Options(arguments.field, arguments.component, deformed, arguments.view, arguments.set, arguments.mirror, arguments.edges,
                   arguments.smooth, not arguments.unlit, tuple(arguments.range) if arguments.range else None, arguments.colours,
                   (width, height), arguments.title)


def make(arguments: argparse.Namespace) -> Path:
    """Draw what was asked for; the path of the file."""
    path = arguments.output or beside(arguments.results, ".png")
    if path.suffix not in STILL + MOVING:
        raise Missing(f"{path}: the name of a picture ends in one of {', '.join(STILL + MOVING)}")
    options = options_of(arguments)
    moving = path.suffix in MOVING
    if arguments.history:
        if len(arguments.history) < 2 or moving:
            raise Missing("--history X Y...: expected two columns or more, and no animation")
        curves(arguments.results, arguments.history[0], arguments.history[1:], options).savefig(path)
        return path
    results = Results(arguments.results)
    steps = chosen_steps(results, arguments.increment, moving, path)
    scene = Scene(results, steps, options)
    if moving:
        animate((scene.figure(step) for step in steps), path, arguments.rate)
    else:
        scene.figure(steps[0]).savefig(path)
    return path


def main(words: Optional[Sequence[str]] = None) -> int:
    """The program; its exit code."""
    words = list(sys.argv[1:] if words is None else words)
    for i in range(len(words) - 1):  # `--view -60,20` too: argparse takes the second word for an option
        if words[i] == "--view":
            words[i:i + 2] = ["--view=" + words[i + 1]]
            break
    arguments = parser().parse_args(words)
    try:
        print(make(arguments))
    except Missing as reason:
        print(f"finshell-plot: {reason}", file=sys.stderr)
        return 2
    except OSError as reason:
        print(f"finshell-plot: {reason.filename or arguments.results}: {reason.strerror or reason}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
