"""Incompressible isotropic laws in plane stress and principal axes: nominal stresses, and how stable they are.

The same laws and parameters as those of the program (doc/namelist.md), for fits and ranges; elements are the library's.
Stresses are linear in some parameters of every law (`linear`), which a fit then need not search.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Dict, Sequence, Tuple

import numpy as np

from ._library import Doubles

Stress = Tuple[np.ndarray, np.ndarray]
# stresses for unit values of the linear parameters: (terms, 2, n), from stretches (2, n) and the parameters that are not linear
Basis = Callable[[np.ndarray, np.ndarray, Sequence[float]], np.ndarray]


def invariants(l1: np.ndarray, l2: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """I1 - 3, and the derivatives of I1 (2, n) by the stretches in the plane."""
    l3 = 1 / (l1 * l2)
    return l1**2 + l2**2 + l3**2 - 3, np.stack([2 * (l1 - l3**2 / l1), 2 * (l2 - l3**2 / l2)])


def neo_hookean(l1: np.ndarray, l2: np.ndarray, _: Sequence[float]) -> np.ndarray:
    """W = mu/2 (I1 - 3)."""
    return 0.5 * invariants(l1, l2)[1][None]


def mooney_rivlin(l1: np.ndarray, l2: np.ndarray, _: Sequence[float]) -> np.ndarray:
    """W = c10 (I1 - 3) + c01 (I2 - 3)."""
    d1 = invariants(l1, l2)[1]
    return np.stack([d1, d1 * np.stack([l2**2, l1**2])])


def yeoh(l1: np.ndarray, l2: np.ndarray, _: Sequence[float]) -> np.ndarray:
    """W = c1 (I1 - 3) + c2 (I1 - 3)**2 + c3 (I1 - 3)**3."""
    i1, d1 = invariants(l1, l2)
    return np.stack([d1, 2 * i1 * d1, 3 * i1**2 * d1])


def gent(l1: np.ndarray, l2: np.ndarray, others: Sequence[float]) -> np.ndarray:
    """W = -mu jm/2 ln(1 - (I1 - 3)/jm); NaN where the law has ended."""
    i1, d1 = invariants(l1, l2)
    left = others[0] - i1
    left = np.where(np.real(left) > 0, left, np.nan)
    return (0.5 * others[0] / left * d1)[None]


def ogden(l1: np.ndarray, l2: np.ndarray, others: Sequence[float]) -> np.ndarray:
    """W = sum of mu/alpha (l1**alpha + l2**alpha + l3**alpha - 3)."""
    l3 = 1 / (l1 * l2)
    return np.stack([np.stack([l1**(a - 1) - l3**a / l1, l2**(a - 1) - l3**a / l2]) for a in others])


@dataclass(frozen=True)
class Law:
    """A law of the program."""

    name: str
    linear: Tuple[str, ...]  # parameters in which stresses are linear
    others: Tuple[str, ...]
    basis: Basis

    @property
    def word(self) -> str:
        """What the program calls it."""
        return "ogden" if self.name.startswith("ogden") else self.name

    @property
    def parameters(self) -> Tuple[str, ...]:
        """All, in the order of the program."""
        pairs = [name for pair in zip(self.linear, self.others) for name in pair]
        return tuple(pairs) if self.word == "ogden" else self.linear + self.others

    def stress(self, values: Dict[str, float], l1: np.ndarray, l2: np.ndarray) -> np.ndarray:
        """(2, n) nominal stresses at stretches in the plane; nothing acts on the faces."""
        terms = self.basis(np.asarray(l1), np.asarray(l2), [values[name] for name in self.others])
        return np.tensordot(np.array([values[name] for name in self.linear]), terms, axes=1)

    def stiffness(self, values: Dict[str, float], l1: Doubles, l2: Doubles) -> Tuple[Doubles, Doubles]:
        """(n, 2, 2): second derivatives of W by the stretches (Hill), and by their logarithms (Drucker). By complex steps: exact."""
        step = 1e-30
        columns = [self.stress(values, l1 + 1j * step * (i == 0), l2 + 1j * step * (i == 1)).imag / step for i in (0, 1)]
        hill = np.stack(columns, axis=1).transpose(2, 0, 1)
        stress = self.stress(values, l1, l2)
        stretch = np.stack([l1, l2], axis=1)
        drucker = hill * stretch[:, :, None] * stretch[:, None, :]
        for i in (0, 1):
            drucker[:, i, i] += stress[i] * stretch[:, i]
        return hill, drucker


LAWS: Dict[str, Law] = {law.name: law for law in (
    Law("neo_hookean", ("mu",), (), neo_hookean),
    Law("mooney_rivlin", ("c10", "c01"), (), mooney_rivlin),
    Law("yeoh", ("c1", "c2", "c3"), (), yeoh),
    Law("gent", ("mu",), ("jm",), gent),
    *(Law(f"ogden{n}", tuple(f"mu{i}" for i in range(1, n + 1)), tuple(f"alpha{i}" for i in range(1, n + 1)), ogden) for n in (1, 2, 3)))}

PATHS: Dict[str, Callable[[np.ndarray], Tuple[np.ndarray, np.ndarray]]] = {
    "uniaxial": lambda s: (s, s**-0.5),
    "equibiaxial": lambda s: (s, s),
    "pure shear": lambda s: (s, np.ones_like(s)),
}


def stable_range(law: Law, values: Dict[str, float], path: str, which: str, low: float = 0.1, high: float = 10.0) -> Tuple[float, float]:
    """The stretches around 1, between low and high, where the law is stable: which = 'hill' under dead loads, 'drucker'."""
    ends = []
    for end in (low, high):
        s = np.exp(np.linspace(0.0, np.log(end), 4001))
        with np.errstate(all="ignore"):
            tensor = law.stiffness(values, *PATHS[path](s))[0 if which == "hill" else 1]
        smallest = 0.5 * (tensor[:, 0, 0] + tensor[:, 1, 1]) - np.hypot(0.5 * (tensor[:, 0, 0] - tensor[:, 1, 1]), tensor[:, 0, 1])
        bad = np.flatnonzero(~(smallest > 0))
        ends.append(float(s[max(bad[0] - 1, 0)]) if len(bad) else end)
    return ends[0], ends[1]
