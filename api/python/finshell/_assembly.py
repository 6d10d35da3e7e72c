"""Assembly: from the elements to the structure, in threads, with the matrix as scipy has it."""
from __future__ import annotations

import ctypes
import weakref
from dataclasses import dataclass
from typing import Any, Optional, Sequence, Tuple, Union

import numpy as np

from ._element import Rotation, Section
from ._library import CElements, CMesh, Codes, Doubles, Status, array, check, code_pointer, library, pointer


@dataclass
class Assembled:
    """What the calls of an Assembly return; what was not asked for is None."""

    force: Optional[Doubles]  # (nodes, nodal) at all nodes, held or not
    matrix: Any = None  # scipy.sparse.csr_matrix (rows, rows), or its upper triangle
    energy: Optional[float] = None
    codes: Optional[Codes] = None  # (elements,)


class Assembly:
    """The layout of a mesh: rows of its freedoms, pattern of its matrix, order of its sums. Immutable, shared by any number of threads.

        a = Assembly(triangles, section, held=held)
        r = a.evaluate(X, u, t)                            # X, u, t: (nodes, 3)
        a.pressure(p, X, u, t, factor=-1, into=r)          # residual r.force and tangent r.matrix
        du = a.to_nodes(scipy.sparse.linalg.spsolve(r.matrix, -a.to_rows(r.force)))

    All sums are the same to the last bit for any number of threads (0: as OpenMP chooses).
    """

    def __init__(self, triangles: Any, sections: Union[Section, Sequence[Section]], *, nodes: Optional[int] = None,
                 section_of: Any = None, held: Any = None, freedoms: Any = None, rows: Optional[int] = None, pattern: Any = None,
                 upper: bool = False, nodal: int = 0) -> None:
        """triangles: (elements, 3) nodes from 0. sections: one, or several with section_of (elements,). nodes: their number (default: as
        the triangles need). held: (nodes, nodal), true where a freedom has no row. freedoms: (nodes, nodal) rows of a matrix of your
        own, -1: none; rows: how many it has; pattern: (indptr, indices) of it. upper: the upper triangle alone. nodal: 6, or 3 (membranes
        alone, and then the default)."""
        self.sections = [sections] if isinstance(sections, Section) else list(sections)
        t = array("triangles", triangles, (-1, 3), np.int32)
        self.elements = len(t)
        self.nodes = int(t.max(initial=-1)) + 1 if nodes is None else nodes
        self.nodal = nodal or (3 if self.sections and all(s.freedoms == 9 for s in self.sections) else 6)
        self.upper = upper
        kept = {"triangles": t}
        for name, values, shape in (("sections", section_of, (self.elements,)), ("held", held, (self.nodes, self.nodal)),
                                    ("freedoms", freedoms, (self.nodes, self.nodal))):
            if values is not None:
                kept[name] = array(name, values, shape, np.int32)
        if pattern is not None:
            kept["starts"] = array("indptr", pattern[0], (-1,), np.int64)
            kept["columns"] = array("indices", pattern[1], (-1,), np.int32)
            if rows is None:
                rows = len(kept["starts"]) - 1
            if len(kept["starts"]) != rows + 1 or len(kept["columns"]) != kept["starts"][-1]:
                raise ValueError(f"indptr must have {rows + 1} entries, and indices as many as its last one says")
        mesh = CMesh(size=ctypes.sizeof(CMesh), nodes=self.nodes, elements=self.elements, nodal=self.nodal, triangle=int(upper),
                     rows=rows or 0, **{name: a.ctypes.data for name, a in kept.items()})
        handle, status = ctypes.c_void_p(), Status()
        library().finshell_assembly_create(ctypes.byref(mesh), len(self.sections), self._list(), ctypes.byref(handle),
                                           ctypes.byref(status))
        check(status)
        self._handle = handle
        weakref.finalize(self, library().finshell_assembly_destroy, handle)
        count, entries = ctypes.c_int32(), ctypes.c_int64()
        library().finshell_assembly_size(handle, None, ctypes.byref(count), ctypes.byref(entries), None)
        self.rows, self.entries = count.value, entries.value
        self.freedoms = np.empty((self.nodes, self.nodal), np.int32)  # the row of each freedom, -1: none
        library().finshell_assembly_freedoms(handle, code_pointer(self.freedoms), None)
        wide = self.entries > np.iinfo(np.int32).max
        self.indptr, self.indices = (np.empty(n, np.int64 if wide else np.int32) for n in (self.rows + 1, self.entries))
        pattern_of = library().finshell_assembly_pattern_64 if wide else library().finshell_assembly_pattern
        kind = ctypes.POINTER(ctypes.c_int64 if wide else ctypes.c_int32)
        pattern_of(handle, self.indptr.ctypes.data_as(kind), self.indices.ctypes.data_as(kind), None)

    def __repr__(self) -> str:
        return f"<Assembly of {self.elements} elements, {self.nodes} nodes: {self.rows} rows, {self.entries} entries>"

    def _list(self) -> Any:
        return (ctypes.c_void_p * len(self.sections))(*(s._handle.value for s in self.sections))

    def to_rows(self, nodal: Any) -> Doubles:
        """The rows (rows,) of values by nodes (nodes, nodal), as a solver takes them."""
        values, has = np.zeros(self.rows), self.freedoms >= 0
        values[self.freedoms[has]] = array("values", nodal, (self.nodes, self.nodal))[has]
        return values

    def to_nodes(self, values: Any) -> Doubles:
        """Values by nodes (nodes, nodal) of those by rows (rows,); 0 where a freedom has none."""
        return np.where(self.freedoms >= 0, np.append(array("values", values, (self.rows,)), 0.0)[self.freedoms], 0.0)

    def matrix(self, values: Optional[Doubles] = None) -> Any:
        """A scipy.sparse.csr_matrix with these values (default: zeros). Nothing is copied, and the pattern is this object's."""
        from scipy.sparse import csr_matrix
        values = np.zeros(self.entries) if values is None else values
        made = csr_matrix((values, self.indices, self.indptr), (self.rows, self.rows), copy=False)
        made.has_sorted_indices = made.has_canonical_format = True
        return made

    def _block(self, X: Any, u: Any, rotations: Any, convention: Rotation, threads: int, **others: Any) -> Tuple[Any, Any]:
        """The argument block, and the arrays that it points to."""
        n, m = self.nodes, self.elements
        shapes = {"X": (n, 3), "u": (n, 3), "rotations": (n, 4 if convention == Rotation.QUATERNION else 3), "state": (n, 4),
                  "toward": (n, self.nodal), "direction": (m, 3), "normals": (m, 3, 3), "straight": (m, 3)}
        kept = {name: array(name, values, shapes[name], np.int32 if name == "straight" else np.float64)
                for name, values in {"X": X, "u": u, "rotations": rotations, **others}.items() if values is not None}
        return CElements(size=ctypes.sizeof(CElements), n=m, convention=int(convention), threads=threads,
                         **{name: a.ctypes.data for name, a in kept.items()}), kept

    def _results(self, into: Optional[Assembled], force: bool, matrix: bool) -> Assembled:
        """Arrays that a call adds to."""
        r = into or Assembled(None)
        if force and r.force is None:
            r.force = np.zeros((self.nodes, self.nodal))
        if matrix and r.matrix is None:
            r.matrix = self.matrix()
        if force and (r.force.shape != (self.nodes, self.nodal) or r.force.dtype != np.float64 or not r.force.flags.c_contiguous):
            raise ValueError(f"into.force must be an array of doubles of the shape {(self.nodes, self.nodal)}")
        if matrix and (len(r.matrix.data) != self.entries or r.matrix.data.dtype != np.float64):
            raise ValueError("into.matrix must be one that this assembly made")
        r.codes = np.zeros(self.elements, np.int32)
        return r

    def _call(self, name: str, r: Assembled, raise_errors: bool, *arguments: Any) -> Assembled:
        status = Status()
        getattr(library(), name)(self._handle, *arguments, code_pointer(r.codes), ctypes.byref(status))
        if raise_errors or (status.code and status.index < 0):
            check(status)
        return r

    def evaluate(self, X: Any, u: Any, rotations: Any = None, convention: Rotation = Rotation.VECTOR, *, state: Any = None,
                 direction: Any = None, normals: Any = None, toward: Any = None, straight: Any = None, force: bool = True,
                 tangent: bool = True, threads: int = 1, into: Optional[Assembled] = None, raise_errors: bool = True) -> Assembled:
        """Energy, internal forces and tangent.

        By nodes: X, u (nodes, 3), rotations (nodes, 3) or quaternions (nodes, 4), state (nodes, 4), toward (nodes, nodal). By elements, as
        in Section.evaluate: direction, normals, straight. into: what an earlier call returned, to which is added.
        """
        r = self._results(into, force, tangent)
        block, kept = self._block(X, u, rotations, convention, threads, state=state, direction=direction, normals=normals,
                                  toward=toward, straight=straight)
        energy = ctypes.c_double()
        self._call("finshell_assembly_evaluate", r, raise_errors, len(self.sections), self._list(), ctypes.byref(block),
                   ctypes.byref(energy), pointer(r.force if force else None), pointer(r.matrix.data if tangent else None))
        r.energy = energy.value
        return r

    def pressure(self, pressure: Any, X: Any, u: Any, rotations: Any = None, convention: Rotation = Rotation.VECTOR, *,
                 state: Any = None, normals: Any = None, straight: Any = None, symmetric: bool = False, origin: Any = None,
                 factor: float = 1.0, stiffness: bool = True, threads: int = 1, into: Optional[Assembled] = None,
                 raise_errors: bool = True) -> Assembled:
        """factor times the forces of a pressure (elements,) and their derivative; with -1 they belong to residual and tangent."""
        r = self._results(into, True, stiffness)
        block, kept = self._block(X, u, rotations, convention, threads, state=state, normals=normals, straight=straight)
        p = array("pressure", np.broadcast_to(pressure, self.elements), (self.elements,))
        return self._call("finshell_assembly_pressure", r, raise_errors, ctypes.byref(block), pointer(p), int(symmetric),
                          pointer(None if origin is None else array("origin", origin, (3,))), factor, pointer(r.force),
                          pointer(r.matrix.data if stiffness else None))

    def volume(self, X: Any, u: Any, rotations: Any = None, convention: Rotation = Rotation.VECTOR, *, state: Any = None,
               normals: Any = None, straight: Any = None, side: Any = None, origin: Any = None,
               threads: int = 1) -> Tuple[float, Doubles]:
        """Volume behind the elements and its gradient (nodes, nodal). side (elements,): 1, -1 where an element looks inwards, 0 where it
        does not belong to the chamber."""
        r = self._results(None, True, False)
        block, kept = self._block(X, u, rotations, convention, threads, state=state, normals=normals, straight=straight)
        weight = None if side is None else array("side", np.broadcast_to(side, self.elements), (self.elements,))
        volume = ctypes.c_double()
        self._call("finshell_assembly_volume", r, True, ctypes.byref(block), pointer(weight),
                   pointer(None if origin is None else array("origin", origin, (3,))), ctypes.byref(volume), pointer(r.force))
        assert r.force is not None
        return volume.value, r.force

    def mass(self, X: Any, *, lumped: bool = False, factor: float = 1.0, into: Optional[Assembled] = None) -> Any:
        """factor times the consistent mass matrix, or with `lumped` the diagonal (nodes, nodal) of the lumped one. With into it is added
        to its matrix, or its force."""
        r = self._results(into, lumped, not lumped)
        block, kept = self._block(X, None, None, Rotation.VECTOR, 1)
        self._call("finshell_assembly_mass", r, True, len(self.sections), self._list(), ctypes.byref(block), factor,
                   pointer(r.force if lumped else None), pointer(None if lumped else r.matrix.data))
        return r.force if lumped else r.matrix

    def traction(self, X: Any, traction: Any, *, factor: float = 1.0, into: Optional[Assembled] = None) -> Doubles:
        """Forces (nodes, nodal) of dead tractions (elements, 3) per reference area, or of one (3,) on all."""
        r = self._results(into, True, False)
        x = array("X", X, (self.nodes, 3))
        q = array("traction", np.broadcast_to(traction, (self.elements, 3)), (self.elements, 3))
        self._call("finshell_assembly_traction", r, True, pointer(x), pointer(q), factor, pointer(r.force))
        assert r.force is not None
        return r.force

    def gravity(self, X: Any, acceleration: Any, *, factor: float = 1.0, into: Optional[Assembled] = None) -> Doubles:
        """Weight (nodes, nodal): the densities of the sections times an acceleration (3,)."""
        r = self._results(into, True, False)
        block, kept = self._block(X, None, None, Rotation.VECTOR, 1)
        g = array("acceleration", acceleration, (3,))
        self._call("finshell_assembly_gravity", r, True, len(self.sections), self._list(), ctypes.byref(block), pointer(g), factor,
                   pointer(r.force))
        assert r.force is not None
        return r.force

    def line_load(self, element: Any, side: Any, load: Any, X: Any, u: Any, rotations: Any = None,
                  convention: Rotation = Rotation.VECTOR, *, state: Any = None, straight: Any = None, factor: float = 1.0,
                  stiffness: bool = True, into: Optional[Assembled] = None) -> Assembled:
        """factor times the forces of dead loads (n, 3) per reference length on sides 0, 1, 2 (nodes 0-1, 1-2, 2-0) of elements (n,), and
        their derivative."""
        r = self._results(into, True, stiffness)
        block, kept = self._block(X, u, rotations, convention, 1, state=state, straight=straight)
        e = array("element", element, (-1,), np.int32)
        s = array("side", np.broadcast_to(side, len(e)), (len(e),), np.int32)
        q = array("load", np.broadcast_to(load, (len(e), 3)), (len(e), 3))
        r.codes = np.zeros(len(e), np.int32)
        return self._call("finshell_assembly_line_load", r, True, ctypes.byref(block), len(e), code_pointer(e), code_pointer(s),
                          pointer(q), factor, pointer(r.force), pointer(r.matrix.data if stiffness else None))
