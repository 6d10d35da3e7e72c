"""finshell-fit: the parameters of a law from measured stresses, as a group &material that can be pasted into an input.

    finshell-fit --uniaxial treloar.csv                     # all laws, best last; the group of the last one
    finshell-fit --uniaxial ut.csv --equibiaxial et.csv --pure-shear ps.csv --law ogden2
    finshell-fit --biaxial kawabata.csv --law mooney_rivlin --plot fit.png

A file has rows of numbers; lines that begin with # and one heading are passed over. Columns: stretch and nominal stress (force per
reference area) of --uniaxial, --equibiaxial and --pure-shear; the two stretches and the two nominal stresses of --biaxial (a stress
that was not measured is left empty). With --cauchy stresses are true ones, with --strain the first columns are strains.

Every file counts alike, by its squared errors in parts of its mean square; with --relative every value by its own error in parts of
itself. Mooney-Rivlin has c10, c01 >= 0 and Ogden mu alpha >= 0 in every term, which makes them stable (Drucker) at any stretch;
--free leaves these bounds out. Laws are incompressible. Needs scipy; --plot needs matplotlib.
"""
from __future__ import annotations

import argparse
import csv
import itertools
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np
from scipy.optimize import least_squares, nnls

from ._laws import LAWS, PATHS, Law, stable_range
from ._library import Doubles

LARGEST = 20.0  # exponent of Ogden's law
KINDS = ("uniaxial", "equibiaxial", "pure_shear", "biaxial")


class Refused(Exception):
    """Data that make no sense, said in a sentence."""


@dataclass
class Data:
    """Measured nominal stresses at stretches in the plane."""

    name: str
    l1: Doubles
    l2: Doubles
    stress: Doubles  # (2, n); NaN: not measured
    along_path: Optional[str] = None  # one of `PATHS`
    weight: Doubles = field(init=False)  # (2, n)

    def __post_init__(self) -> None:
        known = np.isfinite(self.stress)
        self.weight = np.where(known, 1 / np.sqrt(np.sum(self.stress[known]**2)), 0.0)

    def relative(self) -> None:
        """Weigh every value by itself."""
        known = np.isfinite(self.stress) & (self.stress != 0)
        self.weight = np.where(known, 1 / (np.abs(np.where(known, self.stress, 1.0)) * np.sqrt(known.sum())), 0.0)


def read_rows(path: Path, most: int) -> Doubles:
    """Rows of numbers; empty cells are NaN."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as reason:
        raise Refused(f"{path}: cannot be read ({getattr(reason, 'strerror', None) or reason})") from None
    rows: List[List[float]] = []
    heading = False
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        cells = next(csv.reader([line])) if "," in line else line.replace(";", " ").split()
        try:
            row = [float(cell) if cell.strip() else np.nan for cell in cells]
        except ValueError:
            if rows or heading:
                raise Refused(f"{path}, line {number}: found '{line.strip()}', expected {most} numbers") from None
            heading = True
            continue
        if len(row) != most:
            raise Refused(f"{path}, line {number}: found {len(row)} columns, expected {most}")
        if np.isinf(row).any() or np.isnan(row[:most // 2]).any():
            raise Refused(f"{path}, line {number}: found '{line.strip()}', expected numbers")
        rows.append(row)
    if not rows:
        raise Refused(f"{path}: no row of numbers is in it")
    return np.array(rows)


def read(path: Path, kind: str, cauchy: bool = False, strain: bool = False) -> Data:
    """The data of a file; kind: one of `KINDS`."""
    rows = read_rows(path, 4 if kind == "biaxial" else 2)
    stretches = rows[:, : rows.shape[1] // 2] + (1.0 if strain else 0.0)
    if (stretches <= 0).any():
        raise Refused(f"{path}: found the stretch {stretches.min():g}, expected numbers above 0" + ("" if strain else " (strains need --strain)"))
    if kind == "biaxial":
        l1, l2, stress = stretches[:, 0], stretches[:, 1], rows[:, 2:].T
    else:
        l1, l2 = PATHS[kind.replace("_", " ")](stretches[:, 0])
        stress = np.stack([rows[:, 1], rows[:, 1] if kind == "equibiaxial" else np.full(len(rows), np.nan)])
    if cauchy:
        stress = stress / np.stack([l1, l2])
    if not np.isfinite(stress).any() or not (np.abs(stress[np.isfinite(stress)]) > 0).any():
        raise Refused(f"{path}: no stress other than 0 is in it")
    word = kind.replace("_", " ")
    return Data(f"{word} ({path.name})", l1, l2, stress, word if word in PATHS else None)


@dataclass
class Fit:
    """A law with its parameters, and how well it meets the data."""

    law: Law
    values: Dict[str, float]
    data: Sequence[Data]
    deviation: Dict[str, float]  # standard errors of the parameters
    correlation: Doubles

    def errors(self) -> List[Tuple[str, float, float]]:
        """Of each file: root mean square in parts of that of the stresses, largest error in the unit of stress."""
        found = []
        for data in self.data:
            known = np.isfinite(data.stress)
            miss = (self.law.stress(self.values, data.l1, data.l2) - data.stress)[known]
            found.append((data.name, float(np.sqrt(np.sum(miss**2) / np.sum(data.stress[known]**2))), float(np.abs(miss).max())))
        return found

    @property
    def error(self) -> float:
        """Root of the mean of the squared errors of all files."""
        return float(np.sqrt(np.mean([e**2 for _, e, _ in self.errors()])))

    def shear_modulus(self) -> float:
        """At no strain."""
        v = self.values
        if self.law.word == "ogden":
            return 0.5 * sum(v[m] * v[a] for m, a in zip(self.law.linear, self.law.others))
        return v.get("mu", 0.0) + 2 * (v.get("c1", 0.0) + v.get("c10", 0.0) + v.get("c01", 0.0))

    def material(self, name: str = "rubber") -> str:
        """The group for an input."""
        words = " ".join(f"{p} = {self.values[p]:.10g}" for p in self.law.parameters if self.law.word != "ogden" or self.values[f"mu{p[-1]}"] != 0)
        return f"&material name = '{name}' law = '{self.law.word}' {words} /"


def fit(law: Law, data: Sequence[Data], free: bool = False) -> Fit:
    """The parameters with the least squares. Those that are linear follow from the others; these are sought from many starts.

    free: without c10, c01 >= 0 and mu alpha >= 0.
    """
    weights = np.concatenate([d.weight.ravel() for d in data])
    keep = weights > 0
    target = np.concatenate([np.where(d.weight > 0, d.stress, 0.0).ravel() for d in data])[keep] * weights[keep]
    if len(target) < len(law.parameters):
        raise Refused(f"{law.name} has {len(law.parameters)} parameters, and there are {len(target)} stresses only")

    def columns(others: Doubles) -> Doubles:
        terms = [law.basis(d.l1, d.l2, others.tolist()).reshape(len(law.linear), -1) for d in data]
        return (np.concatenate(terms, axis=1)[:, keep] * weights[keep]).T

    def linear(others: Doubles) -> Tuple[Doubles, Doubles]:
        a = columns(others)
        size = np.linalg.norm(a, axis=0) * (np.where(others < 0, -1.0, 1.0) if law.word == "ogden" else 1.0)
        a = a / np.where(size != 0, size, 1.0)
        used = np.ones(len(size), bool)
        if not free and law.word in ("ogden", "mooney_rivlin"):
            used = nnls(a, target)[0] > 0
        solution = np.zeros(len(size))
        solution[used] = np.linalg.lstsq(a[:, used], target, rcond=1e-13)[0]
        return solution / np.where(size != 0, size, 1.0), a @ solution - target

    others = np.array([])
    if law.others:
        scale = Search(law, data)
        solutions = []
        for start in scale.starts():
            solutions.append(least_squares(lambda q: linear(scale.others(q))[1], start, method="trf", x_scale=1.0, xtol=1e-15, ftol=1e-15, gtol=1e-15,
                                           bounds=scale.bounds(), max_nfev=400))
        others = scale.others(min(solutions, key=lambda found: float(found.cost)).x)
    factors = linear(others)[0]
    if law.word == "ogden":
        order = np.lexsort((-others, factors == 0))
        others, factors = others[order], factors[order]
    values = {**dict(zip(law.linear, map(float, factors))), **dict(zip(law.others, map(float, others)))}
    result = Fit(law, values, data, {}, np.zeros((0, 0)))
    result.deviation, result.correlation = spread(result, weights, keep, target)
    return result


class Search:
    """Parameters that are not linear as numbers of order one, and where to begin."""

    def __init__(self, law: Law, data: Sequence[Data]) -> None:
        self.law, self.n = law, len(law.others)
        self.most = max(float(np.max(d.l1**2 + d.l2**2 + 1 / (d.l1 * d.l2)**2 - 3)) for d in data)

    def others(self, q: Doubles) -> Doubles:
        """Gent: jm behind the largest I1 - 3 of the data. Ogden: the exponents themselves."""
        return self.most * (1 + np.exp(q)) if self.law.word == "gent" else np.asarray(q)

    def bounds(self) -> Tuple[float, float]:
        """Of the numbers that are sought."""
        return (-14.0, 14.0) if self.law.word == "gent" else (-LARGEST, LARGEST)

    def starts(self) -> List[Doubles]:
        """Where the search begins."""
        if self.law.word == "gent":
            return [np.array([q]) for q in (-6.0, -3.0, -1.0, 1.0, 4.0)]
        grid = {1: (-8.0, -2.0, 1.3, 3.0, 8.0), 2: (-6.0, -2.0, 1.3, 4.0, 9.0), 3: (-5.0, -1.7, 1.2, 4.0, 9.0)}[self.n]
        return [np.array(some) for some in itertools.combinations(grid, self.n)]


def spread(fitted: Fit, weights: Doubles, keep: "np.ndarray", target: Doubles) -> Tuple[Dict[str, float], Doubles]:
    """Standard errors of the parameters and their correlations, from the derivatives of the stresses at the solution."""
    law, names = fitted.law, fitted.law.parameters
    rows = []
    for name in names:
        moved: Dict[str, complex] = {**fitted.values, name: fitted.values[name] + 1e-30j}
        stress = [law.stress(moved, d.l1 + 0j, d.l2 + 0j).imag.ravel() / 1e-30 for d in fitted.data]  # type: ignore[arg-type]
        rows.append(np.concatenate(stress)[keep] * weights[keep])
    jacobian = np.array(rows).T
    model = np.concatenate([law.stress(fitted.values, d.l1, d.l2).ravel() for d in fitted.data])[keep] * weights[keep]
    variance = float(np.sum((model - target)**2)) / max(len(target) - len(names), 1)
    size = np.linalg.norm(jacobian, axis=0)
    size = np.where(size > 0, size, 1.0)
    inverse = np.linalg.pinv((jacobian / size).T @ (jacobian / size), rcond=1e-15)
    root = np.sqrt(np.maximum(np.diag(inverse), 1e-300))
    return dict(zip(names, map(float, np.sqrt(variance) * root / size))), inverse / np.outer(root, root)


def report(fitted: Fit) -> str:
    """A fit in words."""
    lines = [f"{fitted.law.name}: error {100 * fitted.error:.3g} % (root mean square), shear modulus {fitted.shear_modulus():.5g}"]
    if len(fitted.data) > 1:
        lines += [f"   {name}: {100 * error:.3g} %, at most {largest:.4g}" for name, error, largest in fitted.errors()]
    for name in fitted.law.parameters:
        lines.append(f"   {name:<7}{fitted.values[name]: .7g} ± {fitted.deviation[name]:.2g}")
    if len(fitted.law.parameters) > 1:
        upper = np.abs(np.triu(fitted.correlation, 1))
        i, j = np.unravel_index(np.argmax(upper), upper.shape)
        text = f"   strongest correlation: {fitted.law.parameters[i]} and {fitted.law.parameters[j]}, {fitted.correlation[i, j]:.4f}"
        lines.append(text + (": these data hardly tell them apart" if upper[i, j] > 0.99 else ""))
    for which, meaning in (("drucker", "stable material (Drucker)"), ("hill", "stable under dead loads in the plane (Hill)")):
        parts = []
        for path in PATHS:
            low, high = stable_range(fitted.law, fitted.values, path, which)
            parts.append(f"{path} {low:.3g} to {high:.3g}")
        lines.append(f"   {meaning}, stretch 0.1 to 10: {', '.join(parts)}")
    lines += [f"   {line}" for line in warnings(fitted)]
    return "\n".join(lines)


def warnings(fitted: Fit) -> List[str]:
    """What speaks against using the fit."""
    found = []
    if not fitted.shear_modulus() > 0:
        found.append("not usable: no positive shear modulus at no strain; the program refuses it")
        return found
    if fitted.law.name == "yeoh" and fitted.values["c1"] <= 0:
        found.append("not usable: c1 is not positive; the program refuses it")
    zero = [p for p in fitted.law.linear if fitted.values[p] == 0 and fitted.law.word in ("ogden", "mooney_rivlin")]
    if zero:
        found.append(f"{', '.join(zero)} at the bound 0: a law with fewer parameters does as well, or other tests are needed")
    ends = [p for p in fitted.law.others if fitted.law.word == "ogden" and abs(fitted.values[p]) > 0.999 * LARGEST]
    if ends or fitted.law.word == "gent" and fitted.values["jm"] > 1e4:
        found.append(f"{', '.join(ends) or 'jm'} at the end of its range: these data do not know it")
    for data in fitted.data:
        with np.errstate(all="ignore"):
            tensor = fitted.law.stiffness(fitted.values, data.l1, data.l2)[1]
        smallest = np.linalg.eigvalsh(tensor)[:, 0]
        if (smallest <= 0).any():
            found.append(f"unstable (Drucker) within the data: {data.name}, first at the stretch {data.l1[np.flatnonzero(smallest <= 0)[0]]:.4g}")
    return found


def plot(fits: Sequence[Fit], data: Sequence[Data], path: Path) -> None:
    """Data and laws as a picture."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    def label(fitted: Fit) -> str:
        return f"{fitted.law.name} ({100 * fitted.error:.2g} %)"

    figure = Figure(figsize=(5.2 * len(data), 4.4), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    for axes, some in zip(np.atleast_1d(figure.subplots(1, len(data), squeeze=False)[0]), data):
        if some.along_path:
            axes.plot(some.l1, some.stress[0], "o", mfc="none", color="0.3", ms=5, label="measured")
            for fitted in fits:
                s = np.linspace(min(1.0, some.l1.min()), max(1.0, some.l1.max()), 200)
                axes.plot(s, fitted.law.stress(fitted.values, *PATHS[some.along_path](s))[0], lw=1.4, label=label(fitted))
            axes.set(xlabel="stretch", ylabel="nominal stress")
        else:
            for fitted in fits:
                axes.plot(some.stress.ravel(), fitted.law.stress(fitted.values, some.l1, some.l2).ravel(), ".", ms=4, label=label(fitted))
            axes.plot(*[[np.nanmin(some.stress), np.nanmax(some.stress)]] * 2, color="0.3", lw=0.8)
            axes.set(xlabel="nominal stress, measured", ylabel="nominal stress, by the law")
        axes.set_title(some.name, fontsize=10)
        axes.grid(color="0.9")
        axes.legend(frameon=False, fontsize=8)
    figure.savefig(path)


def parser() -> argparse.ArgumentParser:
    """What the command line may have."""
    p = argparse.ArgumentParser(prog="finshell-fit", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for kind in KINDS:
        p.add_argument(f"--{kind.replace('_', '-')}", type=Path, action="append", default=[], metavar="FILE", dest=kind)
    p.add_argument("--law", action="append", choices=[*LAWS, "all"], help="may be given several times; default: all")
    p.add_argument("--name", default="rubber", help="of the material")
    p.add_argument("--cauchy", action="store_true", help="stresses are true ones")
    p.add_argument("--strain", action="store_true", help="strains instead of stretches")
    p.add_argument("--relative", action="store_true", help="weigh every value by itself")
    p.add_argument("--free", action="store_true", help="without the bounds that keep Mooney-Rivlin and Ogden stable")
    p.add_argument("--most", type=float, metavar="STRETCH", help="leave out what is stretched more")
    p.add_argument("--plot", type=Path, metavar="FILE", help="draw data and laws (.png, .pdf, .svg)")
    return p


def collect(arguments: argparse.Namespace) -> List[Data]:
    """The data of all files that are named."""
    data = [read(path, kind, arguments.cauchy, arguments.strain) for kind in KINDS for path in getattr(arguments, kind)]
    if not data:
        raise Refused("no data: name a file by --uniaxial, --equibiaxial, --pure-shear or --biaxial")
    if arguments.most:
        for i, some in enumerate(data):
            near = (some.l1 <= arguments.most) & (some.l2 <= arguments.most)
            if not near.any():
                raise Refused(f"{some.name}: nothing is stretched less than --most {arguments.most:g}")
            data[i] = Data(some.name, some.l1[near], some.l2[near], some.stress[:, near], some.along_path)
    if arguments.relative:
        for some in data:
            some.relative()
    return data


def main(words: Optional[Sequence[str]] = None) -> int:
    """The program; its exit code."""
    arguments = parser().parse_args(words)
    names = list(LAWS) if not arguments.law or "all" in arguments.law else list(dict.fromkeys(arguments.law))
    try:
        data = collect(arguments)
        fits = []
        for name in names:
            try:
                fits.append(fit(LAWS[name], data, arguments.free))
            except Refused:
                if len(names) == 1:
                    raise
        if not fits:
            raise Refused("too few stresses for any of these laws")
        fits.sort(key=lambda f: -f.error)
        for fitted in fits:
            print(report(fitted))
            print(f"   {fitted.material(arguments.name)}\n")
        if arguments.plot:
            plot(fits, data, arguments.plot)
            print(arguments.plot)
    except (Refused, ValueError) as reason:
        print(f"finshell-fit: {reason}", file=sys.stderr)
        return 2
    except OSError as reason:
        print(f"finshell-fit: {reason.filename}: {reason.strerror}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
