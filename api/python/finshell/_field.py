"""The list of element fields."""
from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import List, Tuple

from ._library import CField, Status, check, library

_PLACES = {1: "element", 2: "surfaces", 3: "layers"}


@dataclass(frozen=True)
class Field:
    """A field of `Section.recover_field`.

    `components`: names of the components, empty for a scalar. `at`: where an element has values: "element" (one), "surfaces" (bottom,
    middle, top of the section), "layers" (the middle of each, bottom to top).
    """

    name: str
    components: Tuple[str, ...]
    at: str
    dimension: str
    meaning: str


def fields() -> List[Field]:
    """All element fields."""
    lib, status, entry, found = library(), Status(), CField(), []
    for i in range(lib.finshell_field_count()):
        lib.finshell_field_information(i, ctypes.byref(entry), ctypes.byref(status))
        check(status)
        components = tuple(c.strip() for c in entry.components.decode().split(",") if c.strip())
        found.append(Field(entry.name.decode(), components, _PLACES[entry.at], entry.dimension.decode(), entry.meaning.decode()))
    return found
