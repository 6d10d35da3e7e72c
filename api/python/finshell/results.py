"""Result files: NAME.vtkhdf, NAME.history.csv beside it, and the sets of NAME.msh.

    results = Results("disk.vtkhdf")
    results.points, results.triangles            # (n, 3), (m, 3)
    results.displacement(results.last)           # (n, 3)
    results.field("stress_middle", results.last) # (m, 3)
    History("disk").column("w")                  # of every increment

Needs h5py. Whatever is not there raises `Missing` with a sentence that says what is.
"""
from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Tuple, Union

import h5py
import numpy as np

from ._library import Doubles

ENDINGS = (".vtkhdf", ".history.csv", ".xdmf", ".restart", ".lock")
NOT_AXES = {"principal_stretch": ("1", "2"), "principal_stress": ("1", "2"), "fibre_stretch": ("1", "2"),
            **dict.fromkeys(("membrane_force", "moment", "stress", "strain", "curvature", "material_stress"), ("11", "22", "12"))}


class Missing(Exception):
    """A file, field, column, set or increment that is not there."""


class Values(NamedTuple):
    """A field as numbers for a picture."""

    name: str  # of field and component
    values: Doubles  # (nodes,) or (elements,)
    on_nodes: bool


def stem(path: Union[str, Path]) -> Path:
    """The NAME of result files, from the path of any of them or from NAME itself."""
    text = str(path)
    for ending in ENDINGS:
        if text.endswith(ending):
            return Path(text[: -len(ending)])
    return Path(text)


def beside(path: Union[str, Path], ending: str) -> Path:
    """The result file of this ending."""
    base = stem(path)
    return base.with_name(base.name + ending)


def components_of(name: str, count: int) -> List[str]:
    """What the components of a field are called."""
    base = re.sub(r"_(bottom|middle|top|layer\d+)$", "", name)
    return list(NOT_AXES.get(base, ("x", "y", "z")))[:count]


class Results:
    """The mesh and the fields of a result file."""

    def __init__(self, path: Union[str, Path]) -> None:
        self.path = beside(path, ".vtkhdf")
        if not self.path.is_file():
            raise Missing(f"{self.path}: no such file")
        try:
            self._file = h5py.File(self.path, "r")
            root = self._root = self._file["VTKHDF"]
            self.points: Doubles = root["Points"][:]
            self.triangles = root["Connectivity"][:].reshape(-1, 3)
            self.steps = int(root["Steps"].attrs["NSteps"])
        except (OSError, KeyError, ValueError) as reason:
            raise Missing(f"{self.path}: not a result file of finshell, or just being written ({reason})") from reason
        if self.steps == 0:
            raise Missing(f"{self.path}: no increment is in it yet")
        self.last = self.steps - 1
        self.load_factor: Doubles = self._per_step("FieldData/load_factor")
        self.time: Optional[Doubles] = self._per_step("FieldData/time") if "FieldData/time" in root else None
        increments = self._file.get("finshell/history/increment")
        self.increments = np.asarray(increments[: self.steps] if increments is not None and len(increments) >= self.steps
                                     else np.arange(self.steps), dtype=int)
        names = {group: sorted(root[group]) for group in ("PointData", "CellData")}
        self.node_fields, self.element_fields = names["PointData"], names["CellData"]

    def _per_step(self, name: str) -> Doubles:
        return self._root[name][: self.steps] if name in self._root else np.arange(self.steps, dtype=float)

    @property
    def title(self) -> str:
        """That of the input, or the name of the file."""
        text = self._file["finshell/input"][()] if "finshell/input" in self._file else b""
        text = text.decode("utf-8", "replace") if isinstance(text, bytes) else str(text)
        found = re.search(r"^[^!\n]*\btitle\s*=\s*(?:'((?:[^'\n]|'')*)'|\"((?:[^\"\n]|\"\")*)\")", text, re.I | re.M)
        title = (found.group(1) or found.group(2) or "").replace("''", "'").strip() if found else ""
        return title or stem(self.path).name

    def step_of(self, increment: int) -> int:
        """The set of fields that belongs to an increment; a negative one counts from the end."""
        if increment < 0 and -increment <= self.steps:
            return self.steps + increment
        found = np.flatnonzero(self.increments == increment)
        if len(found) == 0:
            raise Missing(f"{self.path}: no fields of increment {increment}; there are those of {shortened(self.increments)}")
        return int(found[-1])

    def displacement(self, step: int) -> Doubles:
        """(nodes, 3)."""
        return self.field("displacement", step)

    def field(self, name: str, step: int) -> Doubles:
        """A field at a step: (nodes or elements, components), without the second for scalars."""
        for group, names, count in (("PointData", self.node_fields, len(self.points)),
                                    ("CellData", self.element_fields, len(self.triangles))):
            if name in names:
                offsets = self._root.get(f"Steps/{group}Offsets/{name}")
                first = int(offsets[step]) if offsets is not None else step * count
                return self._root[f"{group}/{name}"][first:first + count]
        raise Missing(f"{self.path}: no field '{name}'; there are {', '.join(self.node_fields + self.element_fields)}")

    def resolve(self, name: str) -> str:
        """The name of a field in the file: `stress` is `stress_middle`, `fibre_stretch` is that of the first layer."""
        fields = self.node_fields + self.element_fields
        for candidate in (name, f"{name}_middle", f"{name}_layer1"):
            if candidate in fields:
                return candidate
        raise Missing(f"{self.path}: no field '{name}'; there are {', '.join(fields)}")

    def values(self, name: str, component: Optional[str], step: int) -> Values:
        """One number for each node or element. Without a component: the length of a vector, the first value of others."""
        name = self.resolve(name)
        array = self.field(name, step)
        on_nodes = name in self.node_fields
        if array.ndim == 1:
            if component not in (None, "magnitude"):
                raise Missing(f"{self.path}: the field '{name}' has no components, so none is called '{component}'")
            return Values(name, array, on_nodes)
        names = components_of(name, array.shape[1])
        component = component or ("magnitude" if names[0] == "x" else names[0])
        if component == "magnitude" and names[0] == "x":
            return Values(f"{name}, magnitude", np.linalg.norm(array, axis=1), on_nodes)
        if component not in names:
            known = names + (["magnitude"] if names[0] == "x" else [])
            raise Missing(f"{self.path}: the field '{name}' has no component '{component}'; there are {', '.join(known)}")
        return Values(f"{name} {component}", array[:, names.index(component)], on_nodes)

    def elements_of(self, name: str, sets: "Sets") -> "np.ndarray":
        """Which triangles belong to a set: those of an element set, or those that touch a node of another one."""
        if name == "all":
            return np.ones(len(self.triangles), bool)
        if name in sets.triangles:
            wanted = {tuple(sorted(corners)) for corners in sets.triangles[name]}
            return np.array([tuple(sorted(corners)) in wanted for corners in self.triangles.tolist()])
        if name in sets.nodes:
            return np.asarray(np.isin(self.triangles, sets.nodes[name]).any(axis=1))
        known = sorted({"all", *sets.triangles, *sets.nodes})
        raise Missing(f"{sets.path}: no set '{name}'; there are {', '.join(known)}")


class Sets:
    """The sets of NAME.msh, as `finshell mesh INPUT.nml` writes it beside the results (MSH 4.1, text)."""

    def __init__(self, results: Results) -> None:
        self.path = beside(results.path, ".msh")
        if not self.path.is_file():
            raise Missing(f"{self.path}: no such file, so no sets are known; `finshell mesh INPUT.nml` writes it")
        self.triangles: Dict[str, List[List[int]]] = {}
        self.nodes: Dict[str, List[int]] = {}
        try:
            sections = self._sections(self.path.read_text(encoding="utf-8"))
            self._read(sections)
            same = self._same_nodes(sections["Nodes"], results.points)
        except (KeyError, IndexError, ValueError, StopIteration) as reason:
            raise Missing(f"{self.path}: not a mesh as `finshell mesh INPUT.nml` writes it") from reason
        if not same:
            raise Missing(f"{self.path}: not the mesh of the results; `finshell mesh INPUT.nml` writes it")

    @staticmethod
    def _sections(text: str) -> Dict[str, List[str]]:
        return {name: body.strip().splitlines() for name, body in re.findall(r"^\$(\w+)\n(.*?)^\$End\1", text, re.S | re.M)}

    @staticmethod
    def _same_nodes(lines: List[str], points: Doubles) -> bool:
        rest = iter(lines)
        blocks, count = (int(word) for word in next(rest).split()[:2])
        found = np.full((len(points), 3), np.nan)
        if count != len(points):
            return False
        for _ in range(blocks):
            number = int(next(rest).split()[3])
            tags = [int(next(rest)) - 1 for _ in range(number)]
            if number:
                if max(tags) >= count:
                    return False
                found[tags] = [[float(word) for word in next(rest).split()] for _ in range(number)]
        return bool(np.abs(found - points).max() <= 1e-9 * np.abs(points).max())

    def _read(self, sections: Dict[str, List[str]]) -> None:
        physical: Dict[Tuple[int, int], str] = {}
        for line in sections.get("PhysicalNames", [])[1:]:
            first, second, quoted = line.split(maxsplit=2)
            physical[int(first), int(second)] = quoted.strip('"')
        lines = iter(sections["Entities"])
        named: Dict[Tuple[int, int], List[str]] = {}
        for dimension, count in enumerate(int(word) for word in next(lines).split()):
            for _ in range(count):
                words = next(lines).split()
                at = 4 if dimension == 0 else 7
                tags = [abs(int(tag)) for tag in words[at + 1:at + 1 + int(words[at])]]
                named[dimension, int(words[0])] = [physical[dimension, tag] for tag in tags if (dimension, tag) in physical]
        lines = iter(sections["Elements"])
        for _ in range(int(next(lines).split()[0])):
            dimension, entity, _kind, count = (int(word) for word in next(lines).split())
            corners = [[int(word) - 1 for word in next(lines).split()[1:]] for _ in range(count)]
            for name in named.get((dimension, entity), []):
                if dimension == 2:
                    self.triangles.setdefault(name, []).extend(corners)
                else:
                    self.nodes.setdefault(name, []).extend(node for some in corners for node in some)


class History:
    """The columns of NAME.history.csv."""

    def __init__(self, path: Union[str, Path]) -> None:
        self.path = beside(path, ".history.csv")
        if not self.path.is_file():
            raise Missing(f"{self.path}: no such file")
        with self.path.open(newline="", encoding="utf-8") as file:
            rows = [row for row in csv.reader(file) if row]
        if len(rows) < 2:
            raise Missing(f"{self.path}: no increment is in it yet")
        self.names = rows[0]
        self._rows = [row for row in rows[1:] if len(row) == len(rows[0])]  # the last one may be half written

    def column(self, name: str) -> Doubles:
        """One value for each increment; NaN where there is none."""
        if name not in self.names:
            raise Missing(f"{self.path}: no column '{name}'; there are {', '.join(self.names)}")
        at = self.names.index(name)
        return np.array([float(row[at]) if row[at].strip() else np.nan for row in self._rows])


def shortened(numbers: "np.ndarray") -> str:
    """A list of whole numbers for a message."""
    words = [str(n) for n in numbers]
    return ", ".join(words if len(words) <= 12 else [*words[:5], "...", *words[-3:]])
