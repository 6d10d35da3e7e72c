"""Finding and loading libfinshell_driver (finshell_model.h)."""
from __future__ import annotations

import ctypes
import ctypes.util
import functools
import os
import sys
from typing import Any, Dict, List, Tuple

from ._library import Error, Recoverable, _folders

MODEL_ABI = 1  # of the library this package was written for

_NAMES = {"darwin": [f"libfinshell_driver.{MODEL_ABI}.dylib", "libfinshell_driver.dylib"],
          "win32": ["finshell_driver.dll", "libfinshell_driver.dll"]}.get(
              sys.platform, [f"libfinshell_driver.so.{MODEL_ABI}", "libfinshell_driver.so"])


class ModelStatus(ctypes.Structure):
    """finshell_model_status of finshell_model.h."""

    _fields_ = [("code", ctypes.c_int32), ("reserved", ctypes.c_int32), ("message", ctypes.c_char * 1016)]


class CSet(ctypes.Structure):
    """finshell_model_set."""

    _fields_ = [("name", ctypes.c_char_p), ("kind", ctypes.c_int32), ("number", ctypes.c_int32), ("members", ctypes.c_void_p)]


class CMesh(ctypes.Structure):
    """finshell_model_mesh. It holds addresses: the caller keeps the arrays."""

    _fields_ = [("size", ctypes.c_uint64), ("nodes", ctypes.c_int32), ("elements", ctypes.c_int32), ("sets", ctypes.c_int32),
                ("reserved", ctypes.c_int32), ("coordinates", ctypes.c_void_p), ("triangles", ctypes.c_void_p),
                ("set", ctypes.POINTER(CSet))]


class CSizes(ctypes.Structure):
    """finshell_model_size."""

    _fields_ = [(name, ctypes.c_int32) for name in ("nodes", "elements", "unknowns", "sections", "steps", "columns")]


class CRecord(ctypes.Structure):
    """finshell_model_record."""

    _fields_ = [*((name, ctypes.c_int32) for name in ("increment", "step", "reports", "finished", "iterations", "cuts",
                                                      "negative_pivots", "critical_point", "snap", "rounding")),
                *((name, ctypes.c_double) for name in ("load_factor", "time", "size", "proposed", "residual", "correction")),
                ("step_name", ctypes.c_char * 32), ("control", ctypes.c_char * 32)]


class CArray(ctypes.Structure):
    """finshell_model_array."""

    _fields_ = [("values", ctypes.c_void_p), ("items", ctypes.c_int32), ("places", ctypes.c_int32),
                ("components", ctypes.c_int32), ("on", ctypes.c_int32)]


def find_driver_library() -> str:
    """Path of libfinshell_driver.

    The environment variable FINSHELL_DRIVER_LIB, else beside libfinshell where FINSHELL_LIB names that, else where
    `find_library` looks.
    """
    path = os.environ.get("FINSHELL_DRIVER_LIB")
    if path:
        return path
    beside = os.path.dirname(os.environ.get("FINSHELL_LIB", ""))
    folders = [beside] if beside else []
    for folder in (*folders, *map(str, _folders())):
        for name in _NAMES:
            if os.path.exists(os.path.join(folder, name)):
                return os.path.join(folder, name)
    return ctypes.util.find_library("finshell_driver") or _NAMES[0]


_I, _P, _T, _D = ctypes.c_int32, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_double
_S, _R = ctypes.POINTER(ModelStatus), ctypes.POINTER(CRecord)
_N, _A = ctypes.POINTER(ctypes.c_int32), ctypes.POINTER(ctypes.c_void_p)
_PROTOTYPES: Dict[str, List[Any]] = {
    "abi": [],
    "create": [_T, _T, ctypes.POINTER(CMesh), _A, _S],
    "destroy": [_P, _S],
    "sizes": [_P, ctypes.POINTER(CSizes), _S],
    "text": [_P, _T, _T, _I, _N, _S],
    "mesh_arrays": [_P, _A, _A, _S],
    "set_members": [_P, _I, _T, _N, _A, _S],
    "state": [_P, _R, _S],
    "advance": [_P, _D, _R, _S],
    "set_force": [_P, _T, _I, _P, _S],
    "set_displacement": [_P, _T, _I, _I, _P, _S],
    "settle": [_P, _R, _S],
    "checkpoint": [_P, _I, _S],
    "restore": [_P, _I, _S],
    "field": [_P, _T, _I, ctypes.POINTER(CArray), _S],
    "history": [_P, _N, _N, _A, _S],
    "write": [_P, _T, _S],
}


@functools.lru_cache(maxsize=None)
def driver_library() -> Tuple[Any, str]:
    """The library, checked, and its path."""
    path = find_driver_library()
    try:
        loaded = ctypes.CDLL(path)
    except OSError as e:
        raise ImportError(f"libfinshell_driver cannot be loaded from {path}: {e}; FINSHELL_DRIVER_LIB names another place. It is "
                          "built with the driver (FINSHELL_DRIVER=ON)") from e
    for name, arguments in _PROTOTYPES.items():
        function = getattr(loaded, f"finshell_model_{name}")
        function.argtypes = arguments
        function.restype = ctypes.c_int32
    if loaded.finshell_model_abi() != MODEL_ABI:
        raise ImportError(f"{path} has the interface {loaded.finshell_model_abi()}, this package needs {MODEL_ABI}")
    return loaded, path


def call_model(name: str, *arguments: Any) -> None:
    """Call finshell_model_<name> with a status behind the arguments; an error is raised."""
    status = ModelStatus()
    code = getattr(driver_library()[0], f"finshell_model_{name}")(*arguments, ctypes.byref(status))
    if code:
        raise (Recoverable if code > 0 else Error)(code, status.message.decode(errors="replace"))
