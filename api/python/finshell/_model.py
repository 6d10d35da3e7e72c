"""A whole model, step by step: `Model` and what it is built from."""
from __future__ import annotations

import ctypes
import html
import os
from dataclasses import dataclass
from typing import Any, Callable, Dict, Iterator, List, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._driver import CArray, CMesh, CRecord, CSet, CSizes, call_model
from ._library import Doubles

Integers = NDArray[np.int32]


@dataclass(frozen=True)
class Record:
    """Where a model stands (finshell_model_record). True where the call has found something new."""

    increment: int
    step: int
    reports: int
    finished: bool
    iterations: int
    cuts: int
    negative_pivots: int
    critical_point: int
    snap: bool
    rounding: bool
    load_factor: float
    time: float
    size: float
    proposed: float
    residual: float
    correction: float
    step_name: str
    control: str

    def __bool__(self) -> bool:
        return self.reports > 0


def _record(c: CRecord) -> Record:
    values = {name: getattr(c, name) for name, _ in CRecord._fields_}
    for name in ("finished", "snap", "rounding"):
        values[name] = bool(values[name])
    for name in ("step_name", "control"):
        values[name] = values[name].decode(errors="replace")
    return Record(**values)


def _quoted(value: Any) -> str:
    """A value as a namelist has it: text, truth, number, or a list of them."""
    if isinstance(value, str):
        if "\n" in value:
            raise ValueError("a text of an input has one line")
        return "'" + value.replace("'", "''") + "'"
    if isinstance(value, (bool, np.bool_)):
        return ".true." if value else ".false."
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    return ", ".join(_quoted(v) for v in np.asarray(value).ravel().tolist())


def group(name: str, /, **keys: Any) -> str:
    """One group of an input as text: `group("load", kind="pressure", value=0.1)` is "&load kind = 'pressure', value = 0.1 /"."""
    return f"&{name}\n" + "".join(f"   {key} = {_quoted(value)}\n" for key, value in keys.items() if value is not None) + "/\n"


class Builder:
    """The text of an input, group by group, and the mesh it may have as arrays.

    Each method writes one group of doc/namelist.md with the keys it is given and returns the builder, so calls can be chained;
    `group` writes any other one. Nothing is checked before `Model` reads it, by the rules of the program.
    """

    def __init__(self, title: str = "", /, **job: Any) -> None:
        self.text = group("job", title=title, **job)
        self.mesh_arrays: Optional[Tuple[Doubles, Integers]] = None
        self.sets: List[Tuple[str, int, Integers]] = []

    def group(self, name: str, /, **keys: Any) -> "Builder":
        """Any group."""
        self.text += group(name, **keys)
        return self

    def mesh(self, coordinates: Optional[ArrayLike] = None, triangles: Optional[ArrayLike] = None, **keys: Any) -> "Builder":
        """The mesh: coordinates (n, 3) and triangles (m, 3) from 0, or the keys of &mesh (generator, file)."""
        if (coordinates is None) != (triangles is None):
            raise ValueError("a mesh has coordinates and triangles")
        if coordinates is not None and triangles is not None:
            self.mesh_arrays = (np.ascontiguousarray(coordinates, dtype=np.float64), np.ascontiguousarray(triangles, dtype=np.int32))
        return self.group("mesh", **keys)

    def node_set(self, name: str, nodes: ArrayLike) -> "Builder":
        """A set of nodes of mesh arrays, by numbers from 0 or a mask."""
        return self._set(name, 0, nodes)

    def element_set(self, name: str, elements: ArrayLike) -> "Builder":
        """A set of elements of mesh arrays, by numbers from 0 or a mask."""
        return self._set(name, 1, elements)

    def edge_set(self, name: str, edges: ArrayLike) -> "Builder":
        """A set of edges (k, 2) of mesh arrays, pairs of nodes from 0."""
        self.sets.append((name, 2, np.ascontiguousarray(edges, dtype=np.int32).reshape(-1, 2)))
        return self

    def _set(self, name: str, kind: int, members: ArrayLike) -> "Builder":
        given = np.asarray(members)
        if given.dtype == bool:
            given = np.flatnonzero(given)
        self.sets.append((name, kind, np.ascontiguousarray(given, dtype=np.int32).ravel()))
        return self

    def material(self, name: str, /, **keys: Any) -> "Builder":
        """A group &material."""
        return self.group("material", name=name, **keys)

    def section(self, **keys: Any) -> "Builder":
        """A group &section."""
        return self.group("section", **keys)

    def support(self, node_set: str, /, **keys: Any) -> "Builder":
        """A group &support of a node set."""
        return self.group("support", node_set=node_set, **keys)

    def load(self, **keys: Any) -> "Builder":
        """A group &load."""
        return self.group("load", **keys)

    def step(self, **keys: Any) -> "Builder":
        """A group &step; steps are done in the order in which they were added."""
        return self.group("step", **keys)

    def monitor(self, name: str, /, **keys: Any) -> "Builder":
        """A group &monitor, a column of the history."""
        return self.group("monitor", name=name, **keys)

    def model(self, folder: Union[str, os.PathLike[str]] = ".", **options: Any) -> "Model":
        """The model; `folder` is where file names in the text begin."""
        return Model(text=self.text, file=os.path.join(os.fspath(folder), "input"), mesh=self.mesh_arrays, sets=self.sets, **options)


class Model:
    """A model that is taken step by step.

        model = finshell.Model("sheet.nml")        # or Model(text=...), or Builder().mesh(...).model()
        while model.advance():                     # one increment
            print(model.record.load_factor, model.field("displacement").max())

    Arrays that `field`, `coordinates`, `triangles` and the sets return are those of the model, read-only and without a copy: a
    field gets new values when it is asked for again; `.copy()` keeps them. `progress`, where given, is called with the model
    after every increment.
    """

    def __init__(self, file: Union[None, str, os.PathLike[str]] = None, text: Optional[str] = None,
                 mesh: Optional[Tuple[ArrayLike, ArrayLike]] = None, sets: Sequence[Tuple[str, int, Any]] = (),
                 progress: Optional[Callable[["Model"], Any]] = None) -> None:
        self._handle = ctypes.c_void_p()
        if file is None and text is None:
            raise ValueError("a model is read from a file or from a text")
        given, keep = _mesh(mesh, sets)
        name = "input" if file is None else os.fspath(file)
        call_model("create", os.fsencode(name), None if text is None else text.encode(), given, ctypes.byref(self._handle))
        del keep
        self.progress = progress
        sizes = CSizes()
        call_model("sizes", self._handle, ctypes.byref(sizes))
        self.nodes, self.elements, self.unknowns, self.steps = sizes.nodes, sizes.elements, sizes.unknowns, sizes.steps
        self.record = self._state()

    # -------------------------------------------------------------- to go on

    def advance(self, size: float = 0.0) -> Record:
        """The next increment (finshell_model_advance); false when there was nothing left to do."""
        return self._go("advance", ctypes.c_double(size))

    def settle(self) -> Record:
        """Let forces and displacements that were set come in now, at rest."""
        return self._go("settle")

    def run(self) -> Record:
        """To the end of all steps."""
        while self.advance():
            pass
        return self.record

    def __iter__(self) -> Iterator[Record]:
        """Increment after increment."""
        while self.advance():
            yield self.record

    def advance_to(self, time: float) -> Record:
        """To a time, in as many increments as that takes: steps with control = 'dynamic'."""
        while self.record.time < time * (1 - 1e-12) and self.advance(time - self.record.time):
            pass
        return self.record

    def set_force(self, node_set: str, values: ArrayLike) -> None:
        """Forces at the nodes of a set, (n, 3), or (3,) for each of them; see finshell_model_set_force."""
        given = np.ascontiguousarray(values, dtype=np.float64).reshape(-1, 3)
        call_model("set_force", self._open(), node_set.encode(), len(given), given.ctypes.data)

    def set_displacement(self, node_set: str, component: Union[int, str], values: ArrayLike) -> None:
        """Displacement 'x', 'y' or 'z' of the nodes of a set, (n,) or one number, where a support holds it."""
        if isinstance(component, str):
            if component not in ("x", "y", "z"):
                raise ValueError(f"component {component!r}; expected 'x', 'y' or 'z'")
            component = "xyz".index(component)
        given = np.ascontiguousarray(values, dtype=np.float64).ravel()
        call_model("set_displacement", self._open(), node_set.encode(), component, len(given), given.ctypes.data)

    def checkpoint(self, slot: int = 0) -> None:
        """Keep the state, in memory, slot 0 to 7."""
        call_model("checkpoint", self._open(), slot)

    def restore(self, slot: int = 0) -> Record:
        """Go back to a checkpoint."""
        call_model("restore", self._open(), slot)
        self.record = self._state()
        return self.record

    # -------------------------------------------------------------- to look at

    def field(self, name: str, mode: int = 0) -> Doubles:
        """A field of the present state: (n,), (n, components), (n, places) or (n, places, components); of the whole structure a
        number or (3,). With a mode, of that linear solution or mode of the last step."""
        array = CArray()
        call_model("field", self._open(), name.encode(), mode, ctypes.byref(array))
        shape = tuple(n for n, single in ((array.items, array.on >= 3), (array.places, array.places == 1),
                                          (array.components, array.components == 1)) if not single)
        return self._view(array.values, shape, np.float64)

    @property
    def coordinates(self) -> Doubles:
        """(nodes, 3) in the reference shape."""
        pointer = ctypes.c_void_p()
        call_model("mesh_arrays", self._open(), ctypes.byref(pointer), None)
        return self._view(pointer.value, (self.nodes, 3), np.float64)

    @property
    def triangles(self) -> Integers:
        """(elements, 3) nodes, from 0."""
        pointer = ctypes.c_void_p()
        call_model("mesh_arrays", self._open(), None, ctypes.byref(pointer))
        return self._view(pointer.value, (self.elements, 3), np.int32)

    def node_set(self, name: str) -> Integers:
        """Its nodes, from 0, ascending."""
        return self._members(0, name)

    def element_set(self, name: str) -> Integers:
        """Its elements, from 0, ascending."""
        return self._members(1, name)

    @property
    def history(self) -> Dict[str, Doubles]:
        """Columns of the history so far: increment, load_factor, time, ..., monitors."""
        rows, columns, pointer = ctypes.c_int32(), ctypes.c_int32(), ctypes.c_void_p()
        call_model("history", self._open(), ctypes.byref(rows), ctypes.byref(columns), ctypes.byref(pointer))
        table = self._view(pointer.value, (rows.value, columns.value), np.float64).copy()
        return dict(zip(self.texts("columns"), table.T))

    def monitor(self, name: str) -> float:
        """The last value of a column of the history."""
        columns = self.history
        if name not in columns:
            raise KeyError(f"no monitor {name!r}; there are: {', '.join(columns)}")
        return float(columns[name][-1])

    def text(self, what: str) -> str:
        """A text of finshell_model_text."""
        length = ctypes.c_int32()
        call_model("text", self._open(), what.encode(), None, 0, ctypes.byref(length))
        buffer = ctypes.create_string_buffer(length.value + 1)
        call_model("text", self._open(), what.encode(), buffer, len(buffer), ctypes.byref(length))
        return buffer.value.decode(errors="replace")

    def texts(self, what: str) -> List[str]:
        """Its lines."""
        return self.text(what).splitlines()

    def write(self, name: Union[str, os.PathLike[str]]) -> None:
        """Write the present state to NAME.vtkhdf, NAME.xdmf and NAME.history.csv, which the first call creates."""
        call_model("write", self._open(), os.fsencode(name))

    def close(self) -> None:
        """Close result files and free the model. Arrays that were taken from it must not be used any more."""
        if self._handle:
            handle, self._handle = self._handle, ctypes.c_void_p()
            call_model("destroy", handle)

    def __enter__(self) -> "Model":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def __del__(self) -> None:
        try:
            self.close()
        except Exception:  # noqa: BLE001: there is nobody to tell; `close` does
            pass

    def __repr__(self) -> str:
        if not self._handle:
            return "<finshell.Model, closed>"
        r = self.record
        where = f"increment {r.increment}, load factor {r.load_factor:.6g}" + (f", time {r.time:.6g}" if r.time else "")
        return f"<finshell.Model {self.text('name')}: {self.nodes} nodes, {self.elements} elements, {self.unknowns} unknowns; {where}>"

    def _repr_html_(self) -> str:
        if not self._handle:
            return html.escape(repr(self))
        r = self.record
        rows: Dict[str, Any] = {
            "mesh": f"{self.nodes} nodes, {self.elements} elements, {self.unknowns} unknowns",
            "step": f"{r.step + 1} of {self.steps}: {r.step_name}" + (" (all done)" if r.finished else ""),
            "increment": r.increment, "load factor": f"{r.load_factor:.6g}"}
        if r.time:
            rows["time"] = f"{r.time:.6g}"
        columns = self.history
        for name in list(columns)[9:]:
            if len(columns[name]):
                rows[name] = f"{columns[name][-1]:.6g}"
        body = "".join(f"<tr><th>{html.escape(str(k))}</th><td>{html.escape(str(v))}</td></tr>" for k, v in rows.items())
        return f"<table><caption>{html.escape(self.text('title') or self.text('name'))}</caption>{body}</table>"

    # -------------------------------------------------------------- inside

    def _open(self) -> ctypes.c_void_p:
        if not self._handle:
            raise ValueError("the model was closed")
        return self._handle

    def _state(self) -> Record:
        record = CRecord()
        call_model("state", self._open(), ctypes.byref(record))
        return _record(record)

    def _go(self, name: str, *arguments: Any) -> Record:
        record = CRecord()
        try:
            call_model(name, self._open(), *arguments, ctypes.byref(record))
        finally:
            self.record = self._state()
        if self.progress is not None and self.record:
            self.progress(self)
        return self.record

    def _members(self, kind: int, name: str) -> Integers:
        number, pointer = ctypes.c_int32(), ctypes.c_void_p()
        call_model("set_members", self._open(), kind, name.encode(), ctypes.byref(number), ctypes.byref(pointer))
        return self._view(pointer.value, (number.value,), np.int32)

    def _view(self, address: Optional[int], shape: Tuple[int, ...], kind: Any) -> NDArray[Any]:
        """An array of the model's memory, which lives as long as the array does."""
        size = int(np.prod(shape, dtype=np.int64)) * np.dtype(kind).itemsize
        if not size or not address:
            return np.zeros(shape, dtype=kind)
        memory = (ctypes.c_char * size).from_address(address)
        memory.model = self  # type: ignore[attr-defined]
        view = np.frombuffer(memory, dtype=kind).reshape(shape)
        view.flags.writeable = False
        return view


def _mesh(mesh: Optional[Tuple[ArrayLike, ArrayLike]], sets: Sequence[Tuple[str, int, Any]]) -> Tuple[Any, Any]:
    """The structure for the call, and what has to be kept while it lasts."""
    if mesh is None:
        if sets:
            raise ValueError("sets go with the arrays of a mesh; others are groups of the text")
        return None, None
    coordinates = np.ascontiguousarray(mesh[0], dtype=np.float64)
    triangles = np.ascontiguousarray(mesh[1], dtype=np.int32)
    if coordinates.ndim != 2 or coordinates.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise ValueError(f"a mesh is coordinates (n, 3) and triangles (m, 3), found {coordinates.shape} and {triangles.shape}")
    given = (CSet * len(sets))()
    kept = [np.ascontiguousarray(members, dtype=np.int32) for _, _, members in sets]
    for c, (name, kind, _), members in zip(given, sets, kept):
        c.name, c.kind, c.number, c.members = name.encode(), kind, len(members), members.ctypes.data
    whole = CMesh(size=ctypes.sizeof(CMesh), nodes=len(coordinates), elements=len(triangles), sets=len(sets),
                  coordinates=coordinates.ctypes.data, triangles=triangles.ctypes.data, set=given)
    return ctypes.byref(whole), (whole, coordinates, triangles, given, kept)
