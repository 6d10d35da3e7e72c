"""The list of material laws."""
from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import List

from ._library import CParameter, Status, check, library


@dataclass(frozen=True)
class Parameter:
    """A parameter of a material law; `default` has no meaning when it is required."""

    name: str
    meaning: str
    required: bool
    default: float
    example: float


def material_names() -> List[str]:
    """Names of all material laws."""
    lib, status, buffer, names = library(), Status(), ctypes.create_string_buffer(64), []
    for i in range(lib.finshell_material_count()):
        lib.finshell_material_name(i, buffer, len(buffer), ctypes.byref(status))
        check(status)
        names.append(buffer.value.decode())
    return names


def material_parameters(material: str) -> List[Parameter]:
    """Parameters of a law."""
    lib, status, found, p = library(), Status(), [], CParameter()
    n = lib.finshell_material_parameter_count(material.encode(), ctypes.byref(status))
    check(status)
    for i in range(n):
        lib.finshell_material_parameter(material.encode(), i, ctypes.byref(p), ctypes.byref(status))
        check(status)
        found.append(Parameter(p.name.decode(), p.meaning.decode(), bool(p.required), p.default_value, p.example))
    return found
