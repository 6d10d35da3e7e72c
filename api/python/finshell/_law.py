"""Laws of one's own: Python functions, or addresses of compiled ones (numba.cfunc, cffi, ctypes), and what is found about laws."""
from __future__ import annotations

import ctypes
import traceback
from dataclasses import dataclass
from typing import Any, Callable, List, Mapping, Optional, Sequence, Union

import numpy as np

from ._library import CFinding, CLaw, CParameter, CPoints, Doubles, Status, check, library, pairs

_KINDS = {"plane": (1, 3, 6), "solid": (2, 4, 10), "incompressible": (3, 4, 10)}  # number, components of strain and of tangent
_LIMIT = 2  # FINSHELL_MATERIAL_LIMIT
_FINDINGS = 12
_D, _I, _A = ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_int32), ctypes.POINTER(CPoints)
_EVALUATE = ctypes.CFUNCTYPE(None, _A, _D, _D, _D, _D, _D, _D, _D, _I)
_STRETCH = ctypes.CFUNCTYPE(None, _A, _D, _D, _D, _D, _D, _I)


@dataclass
class Points:
    """What a law is asked: n points; time at the end of the step, and since its beginning."""

    n: int
    time: float
    time_step: float


@dataclass
class Finding:
    """One thing that `check_law` looked at; stresses in parts of the stiffness at rest."""

    name: str
    meaning: str
    found: float
    allowed: float
    passed: bool


def _view(pointer: Any, *shape: int) -> Doubles:
    return np.ctypeslib.as_array(pointer, shape)


class Law:
    """A law of one's own; `Section` takes it where it takes the name of a law.

    evaluate: a function (points, parameters, strain, begin) of arrays (components, n), which returns energy (n,), stress
    (components, n), tangent (components, n) and, of laws with states, the states at the end (states, n); points where the
    energy is NaN are refused. Or the address of a compiled function finshell_law_function of finshell.h: an integer, as
    numba's `cfunc(...).address` is (`finshell.numba_signature` is its type there). stretch likewise, for laws in the plane
    that are not incompressible: (points, parameters, strain) to stretch (n,), its first (3, n) and second derivatives (6, n).
    kind: "plane" (E11, E22, 2 E12), "solid" or "incompressible" (E11, E22, E33, 2 E12). parameters: names, with a default or
    None where a value is required. A law of Python is slow, and the threads of a call wait for each other; it must not raise:
    what it raises is printed, and the points are refused.
    """

    def __init__(self, name: str, evaluate: Union[int, Callable[..., Any]], *, kind: str = "plane",
                 parameters: Optional[Mapping[str, Optional[float]]] = None, states: int = 0, isotropic: bool = False,
                 stretch: Union[int, Callable[..., Any], None] = None) -> None:
        if kind not in _KINDS:
            raise ValueError(f"kind is {kind!r}, expected one of {', '.join(_KINDS)}")
        number, strains, tangents = _KINDS[kind]
        given = dict(parameters or {})
        self.name, self.states = name, states
        self._parameters = (CParameter * max(len(given), 1))()
        for c, (word, default) in zip(self._parameters, given.items()):
            c.name, c.required, c.default_value = word.encode(), default is None, default or 0.0
        self._kept: List[Any] = []
        self._c = CLaw(size=ctypes.sizeof(CLaw), name=name.encode(), kind=number, isotropic=isotropic, states=states,
                       parameters=len(given), parameter=self._parameters if given else None,
                       evaluate=self._address(evaluate, _EVALUATE, self._evaluation(evaluate, len(given), strains, tangents)),
                       stretch=None if stretch is None else self._address(stretch, _STRETCH, self._stretching(stretch, len(given))))
        self.reference = ctypes.byref(self._c)

    def _address(self, given: Any, kind: Any, wrapped: Callable[..., None]) -> Any:
        if isinstance(given, int):
            return given
        function = kind(wrapped)
        self._kept.append(function)
        return ctypes.cast(function, ctypes.c_void_p).value

    def _evaluation(self, law: Any, parameters: int, strains: int, tangents: int) -> Callable[..., None]:
        states = self.states

        def evaluate(at: Any, p: Any, e: Any, w: Any, s: Any, d: Any, begin: Any, end: Any, codes: Any) -> None:
            n = at.contents.n
            try:
                with np.errstate(all="ignore"):
                    found = law(Points(n, at.contents.time, at.contents.time_step), _view(p, parameters + 1)[:parameters],
                                _view(e, strains, n), _view(begin, states, n) if states else np.zeros((0, n)))
                for values, target, rows in zip(found, (w, s, d), (1, strains, tangents)):
                    _view(target, rows, n)[:] = values
                if states:
                    _view(end, states, n)[:] = found[3]
            except Exception:  # noqa: BLE001  whatever it is, it may not go through C
                traceback.print_exc()
                _view(w, 1, n)[:] = np.nan
            for i in np.flatnonzero(~np.isfinite(_view(w, n))):
                codes[i] = _LIMIT
        return evaluate

    @staticmethod
    def _stretching(law: Any, parameters: int) -> Callable[..., None]:
        def stretch(at: Any, p: Any, e: Any, value: Any, first: Any, second: Any, codes: Any) -> None:
            n = at.contents.n
            try:
                with np.errstate(all="ignore"):
                    found = law(Points(n, 0.0, 0.0), _view(p, parameters + 1)[:parameters], _view(e, 3, n))
                for values, target, rows in zip(found, (value, first, second), (1, 3, 6)):
                    _view(target, rows, n)[:] = values
            except Exception:  # noqa: BLE001
                traceback.print_exc()
                _view(value, n)[:] = np.nan
            for i in np.flatnonzero(~np.isfinite(_view(value, n))):
                codes[i] = _LIMIT
        return stretch


def check_law(law: Union[str, Law], parameters: Optional[Mapping[str, float]] = None) -> Sequence[Finding]:
    """What is found about a law, of one's own or by name ("plugin:LIBRARY#NAME" is one of a shared library)."""
    given = dict(parameters or {})
    names, values = pairs(list(given), list(given.values()))
    found, status = (CFinding * _FINDINGS)(), Status()
    library().finshell_law_check(None if isinstance(law, str) else ctypes.byref(law._c), law.encode() if isinstance(law, str) else None,
                                 len(given), names, values, found, ctypes.byref(status))
    if status.code < 0:
        check(status)
    return [Finding(f.name.decode(), f.meaning.decode(), f.found, f.allowed, bool(f.passed)) for f in found]


def numba_signature() -> Any:
    """The type of a law for numba: `@numba.cfunc(finshell.numba_signature())`; pointers, to be made arrays by numba.carray. The first
    is to a structure: n and level are its first two int32 values, time and time_step its float64 values 1 and 2."""
    from numba import types
    double, integer = types.CPointer(types.float64), types.CPointer(types.int32)
    return types.void(integer, *[double] * 7, integer)
