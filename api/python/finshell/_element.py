"""Sections, and elements many at a time."""
from __future__ import annotations

import ctypes
import enum
import weakref
from dataclasses import dataclass
from typing import Any, Mapping, Optional, Sequence, Tuple

import numpy as np

from ._field import fields
from ._library import (CElements, CLayer, Codes, Doubles, Status, array, check, code_pointer, library, pairs, pointer)


class Rotation(enum.IntEnum):
    """How rotations are given, and what force and tangent refer to."""

    VECTOR = 1  # total rotation vectors (n, 3, 3)
    QUATERNION = 2  # quaternions (n, 3, 4), scalar part first; force and tangent refer to spins
    INCREMENT = 3  # rotation vectors (n, 3, 3) since `state`, quaternions (n, 3, 4)


class Sheet(enum.IntEnum):
    """What a membrane that wrinkles is doing."""

    SLACK = 0
    WRINKLED = 1  # tension along the ridges only
    TAUT = 2


@dataclass
class Layer:
    """One layer of a section; angle in degrees."""

    material: str
    parameters: Mapping[str, float]
    thickness: float
    angle: float = 0.0
    points: int = 0  # 0: by the law; membranes have none
    density: float = 0.0


@dataclass
class Evaluation:
    """What `Section.evaluate` returns; what was not asked for is None."""

    energy: Optional[Doubles]  # (n,)
    force: Optional[Doubles]  # (n, 18), u1 t1 u2 t2 u3 t3; of membranes (n, 9), u1 u2 u3
    tangent: Optional[Doubles]  # (n, 18, 18); of membranes (n, 9, 9)
    codes: Codes  # (n,)


@dataclass
class Recovery:
    """What `Section.recover` returns."""

    stretch: Doubles  # (n,) thickness stretch
    membrane_force: Doubles  # (n, 3): 11, 22, 12
    moment: Doubles  # (n, 3)
    stress: Doubles  # (n, 3, 3): bottom, middle, top; 11, 22, 12
    codes: Codes  # (n,)


@dataclass
class Wrinkles:
    """What `Section.wrinkles` returns."""

    state: Codes  # (n,) of Sheet
    ridge: Doubles  # (n, 3) unit vectors along the ridges, global, deformed; zeros unless wrinkled
    codes: Codes  # (n,)


@dataclass
class Pressure:
    """What `pressure` returns."""

    volume: Doubles  # (n,) between the origin and each element, with the caps of curved ones
    force: Doubles  # (n, 18) external, u1 t1 u2 t2 u3 t3
    stiffness: Optional[Doubles]  # (n, 18, 18), its derivative (row: force)
    codes: Codes  # (n,)


class _Elements:
    """The argument block of a call, and the arrays it points to."""

    def __init__(self, X: Any, u: Any, rotations: Any, convention: Rotation, threads: int, state: Any, direction: Any,
                 normals: Any, toward: Any, straight: Any, freedoms: int = 18, layers: int = 1, thickness: Any = None,
                 offset: Any = None, growth: Any = None) -> None:
        X = array("X", X, (-1, 3, 3))
        self.n = n = len(X)
        self._arrays = {"X": X, "u": array("u", u, (n, 3, 3))}
        for name, values, shape in (("rotations", rotations, (n, 3, 4 if convention == Rotation.QUATERNION else 3)),
                                    ("state", state, (n, 3, 4)), ("direction", direction, (n, 3)), ("normals", normals, (n, 3, 3)),
                                    ("toward", toward, (n, freedoms)), ("straight", straight, (n, 3)), ("thickness", thickness, (n,)),
                                    ("offset", offset, (n,)), ("growth", growth, (n, layers, 4))):
            if values is not None:
                self._arrays[name] = array(name, values, shape, np.int32 if name == "straight" else np.float64)
        block = CElements(size=ctypes.sizeof(CElements), n=n, convention=int(convention), threads=threads,
                          **{name: a.ctypes.data for name, a in self._arrays.items()})
        self.reference = ctypes.byref(block)


class Section:
    """What elements are made of; immutable, shared by any number of threads."""

    def __init__(self, material: str, parameters: Mapping[str, float], thickness: float, **options: float) -> None:
        """One layer. Options: thickness_points, formulation (1: S, 2: P), beta0, arc (1 or 0), offset, density; membrane,
        wrinkling (True or False), slack."""
        names, values = pairs(list(parameters), list(parameters.values()))
        option_names, option_values = pairs(list(options), list(options.values()))
        handle, status = ctypes.c_void_p(), Status()
        library().finshell_section_create(material.encode(), len(parameters), names, values, thickness, len(options), option_names,
                                          option_values, ctypes.byref(handle), ctypes.byref(status))
        check(status)
        self._own(handle, 1)

    @classmethod
    def layered(cls, layers: Sequence[Layer], **options: float) -> "Section":
        """Layers, bottom to top. Options: formulation, beta0, arc, offset, membrane, wrinkling, slack."""
        c_layers = (CLayer * len(layers))()
        kept = []
        for c, layer in zip(c_layers, layers):
            names, values = pairs(list(layer.parameters), list(layer.parameters.values()))
            kept.append((names, values))
            c.material, c.names, c.values = layer.material.encode(), names, values
            c.parameters, c.points = len(layer.parameters), layer.points
            c.thickness, c.angle, c.density = layer.thickness, layer.angle, layer.density
        option_names, option_values = pairs(list(options), list(options.values()))
        handle, status = ctypes.c_void_p(), Status()
        library().finshell_section_create_layered(len(layers), c_layers, len(options), option_names, option_values,
                                                  ctypes.byref(handle), ctypes.byref(status))
        check(status)
        section = cls.__new__(cls)
        section._own(handle, len(layers))
        return section

    def _own(self, handle: ctypes.c_void_p, layers: int) -> None:
        self._handle, self._layers = handle, layers
        weakref.finalize(self, library().finshell_section_destroy, handle)
        self.freedoms = int(library().finshell_section_freedoms(handle, None))  # of an element: 18, of a membrane 9

    def evaluate(self, X: Any, u: Any, rotations: Any = None, convention: Rotation = Rotation.VECTOR, *, state: Any = None,
                 direction: Any = None, normals: Any = None, toward: Any = None, straight: Any = None, thickness: Any = None,
                 offset: Any = None, growth: Any = None, energy: bool = True, force: bool = True, tangent: bool = True,
                 threads: int = 1, raise_errors: bool = True) -> Evaluation:
        """Energy, force and tangent of n elements.

        X, u: (n, 3, 3) reference coordinates and displacements (element, node, component). rotations: (n, 3, 3) vectors or
        (n, 3, 4) quaternions; membranes have none. direction: (n, 3), material direction 1 (default: global x). normals:
        (n, 3, 3), normals of the surface at the nodes, of any length (default: flat facets). toward: (n, freedoms),
        displacements and spins in whose direction a law with a switch is looked at. straight: (n, 3) booleans, sides 0-1,
        1-2, 2-0 whose displacement is prescribed. thickness, offset: (n,), of the elements' own. growth: (n, layers, 4), strain
        E11, E22, 2 E12 of the stress-free state of each layer and growth of its thickness less 1 (see `growth`). threads 0: as OpenMP chooses.
        Raises Recoverable (cut the step) or Error when an element fails; with raise_errors=False failed elements have zeros
        and a code in `codes`, and only a call that is wrong as a whole raises.
        """
        m = self.freedoms
        elements = _Elements(X, u, rotations, convention, threads, state, direction, normals, toward, straight, m, self._layers, thickness,
                             offset, growth)
        n = elements.n
        result = Evaluation(np.empty(n) if energy else None, np.empty((n, m)) if force else None,
                            np.empty((n, m, m)) if tangent else None, np.zeros(n, np.int32))
        status = Status()
        library().finshell_elements_evaluate(self._handle, elements.reference, pointer(result.energy), pointer(result.force),
                                             pointer(result.tangent), code_pointer(result.codes), ctypes.byref(status))
        if raise_errors or status.index < 0:
            check(status)
        return result

    def recover(self, X: Any, u: Any, rotations: Any = None, convention: Rotation = Rotation.VECTOR, *, state: Any = None,
                direction: Any = None, normals: Any = None, straight: Any = None, thickness: Any = None, offset: Any = None,
                growth: Any = None, raise_errors: bool = True) -> Recovery:
        """Thickness stretch, resultants and Cauchy stresses of n elements; arguments as in `evaluate`."""
        elements = _Elements(X, u, rotations, convention, 1, state, direction, normals, None, straight, self.freedoms, self._layers,
                             thickness, offset, growth)
        n = elements.n
        result = Recovery(np.empty(n), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3, 3)), np.zeros(n, np.int32))
        status = Status()
        library().finshell_elements_recover(self._handle, elements.reference, pointer(result.stretch),
                                            pointer(result.membrane_force), pointer(result.moment), pointer(result.stress),
                                            code_pointer(result.codes), ctypes.byref(status))
        if raise_errors or status.index < 0:
            check(status)
        return result

    def recover_field(self, name: str, X: Any, u: Any, rotations: Any = None, convention: Rotation = Rotation.VECTOR, *,
                      state: Any = None, direction: Any = None, normals: Any = None, straight: Any = None,
                      thickness: Any = None, offset: Any = None, growth: Any = None, raise_errors: bool = True) -> Doubles:
        """An element field of `finshell.fields()`: (n, places, components), without the second for fields "at" the element and
        without the last for scalars; other arguments as in `evaluate`. Failed elements have zeros."""
        field = next((f for f in fields() if f.name == name), None)
        if field is None:
            raise ValueError(f"unknown field {name!r}, there are: {', '.join(f.name for f in fields())}")
        elements = _Elements(X, u, rotations, convention, 1, state, direction, normals, None, straight, self.freedoms, self._layers,
                             thickness, offset, growth)
        places = {"element": (), "surfaces": (3,), "layers": (self._layers,)}[field.at]
        values = np.zeros((elements.n, *places, *((len(field.components),) if field.components else ())))
        codes, status = np.zeros(elements.n, np.int32), Status()
        library().finshell_recover_field(self._handle, elements.reference, name.encode(), pointer(values), code_pointer(codes),
                                         ctypes.byref(status))
        if raise_errors or status.index < 0:
            check(status)
        return values

    def wrinkles(self, X: Any, u: Any, *, direction: Any = None, thickness: Any = None, growth: Any = None,
                 raise_errors: bool = True) -> Wrinkles:
        """Which of n membranes are slack, wrinkled or taut, and where the wrinkles run; arguments as in `evaluate`."""
        elements = _Elements(X, u, None, Rotation.VECTOR, 1, None, direction, None, None, None, self.freedoms, self._layers,
                             thickness, None, growth)
        n = elements.n
        result = Wrinkles(np.zeros(n, np.int32), np.zeros((n, 3)), np.zeros(n, np.int32))
        status = Status()
        library().finshell_elements_wrinkles(self._handle, elements.reference, code_pointer(result.state), pointer(result.ridge),
                                             code_pointer(result.codes), ctypes.byref(status))
        if raise_errors or status.index < 0:
            check(status)
        return result

    def mass(self, X: Any, *, lumped: bool = False, thickness: Any = None, offset: Any = None) -> Doubles:
        """Mass matrices (n, freedoms, freedoms) of n elements, or with `lumped` their diagonals, from the section's density."""
        X = array("X", X, (-1, 3, 3))
        elements = _Elements(X, np.zeros_like(X), None, Rotation.VECTOR, 1, None, None, None, None, None, thickness=thickness,
                             offset=offset)
        n = elements.n
        m = np.empty((n, self.freedoms) if lumped else (n, self.freedoms, self.freedoms))
        status = Status()
        library().finshell_elements_mass(self._handle, elements.reference, None if lumped else pointer(m),
                                         pointer(m) if lumped else None, None, ctypes.byref(status))
        check(status)
        return m


def growth(along: Any = 1.0, across: Any = None, thickness: Any = 1.0) -> Doubles:
    """Rows (..., 4) of `growth` for stretches of the stress-free state along and across the material direction, and of the thickness.

    across: default as along. A sheet that has been stretched by s before it was built in has 1 / s.
    """
    g, h, t = np.broadcast_arrays(np.asarray(along, float), np.asarray(along if across is None else across, float),
                                  np.asarray(thickness, float))
    return np.stack([0.5 * (g - 1) * (g + 1), 0.5 * (h - 1) * (h + 1), np.zeros_like(g), t - 1], axis=-1)


def follower_pressure(pressure: Any, X: Any, u: Any, *, symmetric: bool = False, origin: Any = None,
                      stiffness: bool = True) -> Tuple[Doubles, Optional[Doubles]]:
    """Nodal forces (n, 9) of a follower pressure (n,) on flat facets, and their derivative (n, 9, 9) with respect to u (row: force).

    symmetric: gradient of p times the volume seen from `origin`, with a symmetric stiffness.
    """
    X = array("X", X, (-1, 3, 3))
    n = len(X)
    p, u = array("pressure", np.broadcast_to(pressure, n), (n,)), array("u", u, (n, 3, 3))
    force, k = np.empty((n, 9)), np.empty((n, 9, 9)) if stiffness else None
    status = Status()
    library().finshell_pressure_load(n, pointer(p), pointer(X), pointer(u), int(symmetric),
                                pointer(_origin(origin)), pointer(force), pointer(k),
                                None, ctypes.byref(status))
    check(status)
    return force, None if k is None else k.transpose(0, 2, 1)  # the library stores columns


def pressure(pressure: Any, X: Any, u: Any, rotations: Any, convention: Rotation = Rotation.VECTOR, *, state: Any = None,
             normals: Any = None, straight: Any = None, symmetric: bool = False, origin: Any = None, stiffness: bool = True,
             raise_errors: bool = True) -> Pressure:
    """Pressure (n,) on n elements, flat or with `normals` curved, in the unknowns of the elements; the volume behind them.

    Motion, normals and sides as in `Section.evaluate`; with formulation (P) leave normals out. symmetric: gradient of p times
    the volume seen from `origin`, with a symmetric stiffness; else the facets have p A n / 3 at each node.
    """
    elements = _Elements(X, u, rotations, convention, 1, state, None, normals, None, straight)
    n = elements.n
    p = array("pressure", np.broadcast_to(pressure, n), (n,))
    result = Pressure(np.empty(n), np.empty((n, 18)), np.empty((n, 18, 18)) if stiffness else None, np.zeros(n, np.int32))
    status = Status()
    library().finshell_elements_pressure(elements.reference, pointer(p), int(symmetric), pointer(_origin(origin)),
                                         pointer(result.volume), pointer(result.force), pointer(result.stiffness),
                                         code_pointer(result.codes), ctypes.byref(status))
    if raise_errors or status.index < 0:
        check(status)
    return result


def enclosed_volume(X: Any, u: Any, rotations: Any, convention: Rotation = Rotation.VECTOR, *, state: Any = None,
                    normals: Any = None, straight: Any = None, origin: Any = None) -> float:
    """The volume between n elements, flat or with `normals` curved, and an origin: the one that a closed surface encloses."""
    elements = _Elements(X, u, rotations, convention, 1, state, None, normals, None, straight)
    volume, codes, status = np.empty(elements.n), np.zeros(elements.n, np.int32), Status()
    library().finshell_elements_pressure(elements.reference, None, 0, pointer(_origin(origin)), pointer(volume), None, None,
                                         code_pointer(codes), ctypes.byref(status))
    check(status)
    return float(volume.sum())


def _origin(origin: Any) -> Optional[Doubles]:
    return None if origin is None else array("origin", origin, (3,))
