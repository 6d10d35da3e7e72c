"""Finding and loading libfinshell; what all calls share."""
from __future__ import annotations

import ctypes
import ctypes.util
import os
import pathlib
import shutil
import subprocess
import sys
import sysconfig
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
Codes = NDArray[np.int32]

ABI = 2  # of the library this package was written for

_NAMES = {"darwin": [f"libfinshell.{ABI}.dylib", "libfinshell.dylib"], "win32": ["finshell.dll", "libfinshell.dll"]}.get(
    sys.platform, [f"libfinshell.so.{ABI}", "libfinshell.so"])


class Status(ctypes.Structure):
    """finshell_status of finshell.h."""

    _fields_ = [("code", ctypes.c_int32), ("index", ctypes.c_int32), ("failed", ctypes.c_int32), ("message", ctypes.c_char * 244)]


class CLayer(ctypes.Structure):
    """finshell_layer of finshell.h."""

    _fields_ = [("material", ctypes.c_char_p), ("names", ctypes.POINTER(ctypes.c_char_p)),
                ("values", ctypes.POINTER(ctypes.c_double)), ("parameters", ctypes.c_int32), ("points", ctypes.c_int32),
                ("thickness", ctypes.c_double), ("angle", ctypes.c_double), ("density", ctypes.c_double)]


class CParameter(ctypes.Structure):
    """finshell_parameter of finshell.h."""

    _fields_ = [("name", ctypes.c_char * 32), ("meaning", ctypes.c_char * 128), ("default_value", ctypes.c_double),
                ("example", ctypes.c_double), ("required", ctypes.c_int32), ("padding", ctypes.c_int32)]


class CField(ctypes.Structure):
    """finshell_field_entry of finshell.h."""

    _fields_ = [("name", ctypes.c_char * 32), ("components", ctypes.c_char * 32), ("dimension", ctypes.c_char * 32),
                ("meaning", ctypes.c_char * 128), ("number", ctypes.c_int32), ("at", ctypes.c_int32)]


_POINTERS = ("X", "u", "rotations", "state", "direction", "normals", "toward", "straight")


class CElements(ctypes.Structure):
    """finshell_elements of finshell.h. It holds addresses: the caller keeps the arrays."""

    _fields_ = [("size", ctypes.c_uint64), ("n", ctypes.c_int32), ("convention", ctypes.c_int32), ("threads", ctypes.c_int32),
                ("reserved", ctypes.c_int32), *((name, ctypes.c_void_p) for name in _POINTERS)]


class CMesh(ctypes.Structure):
    """finshell_mesh of finshell.h. It holds addresses: the caller keeps the arrays."""

    _fields_ = [("size", ctypes.c_uint64),
                *((name, ctypes.c_int32) for name in ("nodes", "elements", "nodal", "triangle", "rows", "reserved")),
                *((name, ctypes.c_void_p) for name in ("triangles", "sections", "held", "freedoms", "starts", "columns"))]


class Error(Exception):
    """A call failed. `code` as in finshell.h, `index`: the element, or -1; `failed`: number of elements that failed."""

    def __init__(self, code: int, text: str, index: int = -1, failed: int = 0) -> None:
        super().__init__(text)
        self.code = code
        self.index = index
        self.failed = failed


class Recoverable(Error):
    """A call failed because of the state (code > 0): cut the step and try again."""


def _folders() -> Iterator[pathlib.Path]:
    """Folders to look into, in turn: of this package, of this Python, of programs installed by hand, of pkg-config."""
    here = pathlib.Path(__file__).resolve().parent
    yield from (here, here.parent)
    triplet = sysconfig.get_config_var("MULTIARCH") or ""
    for prefix in dict.fromkeys((sys.prefix, sys.base_prefix, "/usr/local", "/usr")):
        for name in ("lib", "lib64", os.path.join("lib", triplet)):
            yield pathlib.Path(prefix, name)
    if shutil.which("pkg-config"):
        done = subprocess.run(["pkg-config", "--variable=libdir", "finshell"], capture_output=True, text=True, check=False)
        if done.returncode == 0:
            yield pathlib.Path(done.stdout.strip())


def find_library() -> str:
    """Path of libfinshell.

    The environment variable FINSHELL_LIB, else beside this package, else in the folders of libraries of this Python (sys.prefix)
    and of the system, else where pkg-config has it, else what the loader finds (LD_LIBRARY_PATH).
    """
    path = os.environ.get("FINSHELL_LIB")
    if path:
        return path
    for folder in _folders():
        for name in _NAMES:
            if (folder / name).exists():
                return str(folder / name)
    return ctypes.util.find_library("finshell") or _NAMES[0]


_D, _I, _P, _S = ctypes.POINTER(ctypes.c_double), ctypes.c_int32, ctypes.c_void_p, ctypes.POINTER(Status)
_N = ctypes.POINTER(ctypes.c_char_p)
_C = ctypes.POINTER(ctypes.c_int32)
_E = ctypes.POINTER(CElements)
_M = ctypes.POINTER(CMesh)
_L = ctypes.POINTER(ctypes.c_int64)
_H = ctypes.POINTER(_P)
_PROTOTYPES: Dict[str, Tuple[Any, List[Any]]] = {
    "finshell_abi": (_I, []),
    "finshell_version_text": (ctypes.c_char_p, []),
    "finshell_cpu_level": (_I, []),
    "finshell_message": (_I, [_I, ctypes.c_char_p, _I]),
    "finshell_material_count": (_I, []),
    "finshell_material_name": (_I, [_I, ctypes.c_char_p, _I, _S]),
    "finshell_material_parameter_count": (_I, [ctypes.c_char_p, _S]),
    "finshell_material_parameter": (_I, [ctypes.c_char_p, _I, ctypes.POINTER(CParameter), _S]),
    "finshell_section_create": (_I, [ctypes.c_char_p, _I, _N, _D, ctypes.c_double, _I, _N, _D, ctypes.POINTER(_P), _S]),
    "finshell_section_create_layered": (_I, [_I, ctypes.POINTER(CLayer), _I, _N, _D, ctypes.POINTER(_P), _S]),
    "finshell_section_destroy": (None, [_P]),
    "finshell_section_freedoms": (_I, [_P, _S]),
    "finshell_elements_evaluate": (_I, [_P, _E, _D, _D, _D, _C, _S]),
    "finshell_elements_recover": (_I, [_P, _E, _D, _D, _D, _D, _C, _S]),
    "finshell_elements_wrinkles": (_I, [_P, _E, _C, _D, _C, _S]),
    "finshell_elements_pressure": (_I, [_E, _D, _I, _D, _D, _D, _D, _C, _S]),
    "finshell_evaluate": (_I, [_P, _I, _D, _D, _D, _I, _D, _D, _D, _D, _D, _C, _I, _S]),
    "finshell_recover": (_I, [_P, _I, _D, _D, _D, _I, _D, _D, _D, _D, _D, _D, _C, _S]),
    "finshell_mass_matrix": (_I, [_P, _I, _D, _D, _D, _C, _S]),
    "finshell_pressure_load": (_I, [_I, _D, _D, _D, _I, _D, _D, _D, _C, _S]),
    "finshell_assembly_create": (_I, [_M, _I, _H, _H, _S]),
    "finshell_assembly_destroy": (None, [_P]),
    "finshell_assembly_size": (_I, [_P, _C, _C, _L, _S]),
    "finshell_assembly_freedoms": (_I, [_P, _C, _S]),
    "finshell_assembly_pattern": (_I, [_P, _C, _C, _S]),
    "finshell_assembly_pattern_64": (_I, [_P, _L, _L, _S]),
    "finshell_assembly_evaluate": (_I, [_P, _I, _H, _E, _D, _D, _D, _C, _S]),
    "finshell_assembly_pressure": (_I, [_P, _E, _D, _I, _D, ctypes.c_double, _D, _D, _C, _S]),
    "finshell_assembly_volume": (_I, [_P, _E, _D, _D, _D, _D, _C, _S]),
    "finshell_assembly_mass": (_I, [_P, _I, _H, _E, ctypes.c_double, _D, _D, _C, _S]),
    "finshell_assembly_traction": (_I, [_P, _D, _D, ctypes.c_double, _D, _C, _S]),
    "finshell_assembly_gravity": (_I, [_P, _I, _H, _E, _D, ctypes.c_double, _D, _C, _S]),
    "finshell_assembly_line_load": (_I, [_P, _E, _I, _C, _C, _D, ctypes.c_double, _D, _D, _C, _S]),
    "finshell_field_count": (_I, []),
    "finshell_field_information": (_I, [_I, ctypes.POINTER(CField), _S]),
    "finshell_recover_field": (_I, [_P, _E, ctypes.c_char_p, _D, _C, _S]),
    "finshell_rotation_exp": (_I, [_I, _D, _D, _C, _S]),
    "finshell_rotation_log": (_I, [_I, _D, _D, _C, _S]),
    "finshell_rotation_compose": (_I, [_I, _D, _D, _D, _C, _S]),
    "finshell_rotation_update": (_I, [_I, _D, _D, _C, _S]),
    "finshell_rotation_matrix": (_I, [_I, _D, _D, _C, _S]),
    "finshell_rotation_tangent": (_I, [_I, _D, _D, _C, _S]),
}
_loaded: Optional[ctypes.CDLL] = None


def library() -> ctypes.CDLL:
    """The library, loaded at the first call. Raises OSError when it is not found or does not fit."""
    global _loaded
    if _loaded is None:
        path = find_library()
        try:
            lib = ctypes.CDLL(path)
        except OSError as e:
            raise OSError(f"libfinshell cannot be loaded ({e}): build and install it, or set FINSHELL_LIB to its path") from e
        lib.finshell_abi.restype = ctypes.c_int32
        if lib.finshell_abi() != ABI:
            raise OSError(f"{path} has the ABI number {lib.finshell_abi()}, this package needs {ABI}")
        for name, (restype, argtypes) in _PROTOTYPES.items():
            function = getattr(lib, name)
            function.restype, function.argtypes = restype, argtypes
        _loaded = lib
    return _loaded


def check(status: Status) -> None:
    """Raise what a status tells."""
    if status.code == 0:
        return
    kind = Recoverable if status.code > 0 else Error
    raise kind(status.code, status.message.decode(), status.index, status.failed)


def array(name: str, values: Any, shape: Tuple[int, ...], kind: Any = np.float64) -> NDArray[Any]:
    """Contiguous numbers, doubles unless `kind` says otherwise, of a given shape (-1: any length)."""
    a = np.ascontiguousarray(values, dtype=kind)
    if a.ndim != len(shape) or any(s not in (-1, n) for s, n in zip(shape, a.shape)):
        expected = str(shape).replace("-1", "n")
        raise ValueError(f"{name} has the shape {a.shape}, expected {expected}")
    return a


def pointer(a: Optional[Doubles]) -> Any:
    """The data of an array, NULL for None."""
    return None if a is None else a.ctypes.data_as(_D)


def code_pointer(codes: Codes) -> Any:
    """The data of an array of codes."""
    return codes.ctypes.data_as(_C)


def pairs(names: Sequence[str], values: Sequence[float]) -> Tuple[Any, Any]:
    """C arrays of names and values; the caller keeps them while they are used."""
    n = len(names)
    return (ctypes.c_char_p * n)(*(s.encode() for s in names)), (ctypes.c_double * n)(*values)


def version() -> str:
    """Version of the library."""
    return str(library().finshell_version_text().decode())


def message(code: int) -> str:
    """A sentence for a return code."""
    buffer = ctypes.create_string_buffer(256)
    library().finshell_message(code, buffer, len(buffer))
    return buffer.value.decode()
