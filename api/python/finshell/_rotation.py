"""Finite rotations: arrays (n, 3) of rotation vectors and spins, (n, 4) of quaternions (scalar part first)."""
from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from ._library import Doubles, Status, array, check, library, pointer


def _call(name: str, n: int, *arrays: Doubles) -> None:
    status = Status()
    getattr(library(), name)(n, *(pointer(a) for a in arrays), None, ctypes.byref(status))
    check(status)


def rotation_exp(vector: Any) -> Doubles:
    """Quaternions of rotation vectors."""
    v = array("vector", vector, (-1, 3))
    q = np.empty((len(v), 4))
    _call("finshell_rotation_exp", len(v), v, q)
    return q


def rotation_log(quaternion: Any) -> Doubles:
    """Rotation vectors, no longer than pi, of quaternions."""
    q = array("quaternion", quaternion, (-1, 4))
    v = np.empty((len(q), 3))
    _call("finshell_rotation_log", len(q), q, v)
    return v


def compose(a: Any, b: Any) -> Doubles:
    """Quaternions of the rotations a b: first b, then a."""
    a = array("a", a, (-1, 4))
    b = array("b", b, (len(a), 4))
    c = np.empty((len(a), 4))
    _call("finshell_rotation_compose", len(a), a, b, c)
    return c


def update(quaternion: Any, spin: Any) -> Doubles:
    """exp(spin) quaternion, normalised, as a new array."""
    q: Doubles = array("quaternion", quaternion, (-1, 4)).copy()
    s = array("spin", spin, (len(q), 3))
    _call("finshell_rotation_update", len(q), s, q)
    return q


def rotation_matrix(quaternion: Any) -> Doubles:
    """Rotation matrices (n, 3, 3)."""
    q = array("quaternion", quaternion, (-1, 4))
    r = np.empty((len(q), 3, 3))
    _call("finshell_rotation_matrix", len(q), q, r)
    return r


def rotation_tangent(vector: Any) -> Doubles:
    """T (n, 3, 3): spin = T d vector."""
    v = array("vector", vector, (-1, 3))
    t = np.empty((len(v), 3, 3))
    _call("finshell_rotation_tangent", len(v), v, t)
    return t
