"""finshell-mesh IN OUT.msh: a mesh of any kind that meshio reads (VTU, VTP, OBJ, PLY, ...) as a Gmsh file that finshell reads.

Surfaces (triangles, quadrilaterals, of second order too), lines and points are kept. Sets come along: integer arrays on points and
cells (an array of 0 and 1 is one set of its name, in another each value is a set NAME_VALUE), sets of meshio, physical groups of Gmsh.
"""
from __future__ import annotations

import argparse
import sys
from pathlib import Path

import meshio
import numpy as np

# cells of meshio: dimension, type in Gmsh, whose order of nodes meshio shares for these
CELLS = {"vertex": (0, 15), "line": (1, 1), "line3": (1, 8), "triangle": (2, 2), "quad": (2, 3), "triangle6": (2, 9), "quad8": (2, 16),
         "quad9": (2, 10)}
MOST_VALUES = 100  # of an array that means sets: others are numbers of things


def _sets_of(name: str, values: np.ndarray, names: dict) -> dict[str, np.ndarray]:
    """The sets that an integer array means; {}: it means none."""
    if values.ndim != 1 or not np.issubdtype(values.dtype, np.integer) and values.dtype != bool:
        return {}
    found = np.unique(values)
    if set(found.tolist()) <= {0, 1}:
        return {name: values == 1}
    if len(found) > MOST_VALUES:
        return {}
    return {names.get(int(v), f"{name}_{v}"): values == v for v in found if not (v == 0 and name == "gmsh:physical")}


def sets_of(mesh) -> tuple[dict[str, np.ndarray], list[dict[str, np.ndarray]]]:
    """Sets of points, and for each block of cells its sets: name and which are members."""
    groups = {(int(v[1]), int(v[0])): k for k, v in mesh.field_data.items() if np.size(v) == 2}
    points = {}
    for name, values in mesh.point_data.items():
        points.update(_sets_of(name, np.asarray(values), {}))
    for name, members in getattr(mesh, "point_sets", {}).items():
        points[name] = np.isin(np.arange(len(mesh.points)), members)
    blocks = []
    # an array has its meaning from all blocks together
    whole = {name: np.concatenate([np.asarray(a) for a in arrays]) for name, arrays in mesh.cell_data.items() if name != "gmsh:geometrical"}
    ends = np.cumsum([0] + [len(b.data) for b in mesh.cells])
    for i, block in enumerate(mesh.cells):
        dimension = CELLS.get(block.type, (-1, 0))[0]
        here = {}
        for name, values in whole.items():
            named = {tag: k for (d, tag), k in groups.items() if d == dimension} if name == "gmsh:physical" else {}
            here.update({k: v[ends[i]:ends[i + 1]] for k, v in _sets_of(name, values, named).items()})
        for name, members in getattr(mesh, "cell_sets", {}).items():
            if members[i] is not None and not name.startswith("gmsh:"):
                here[name] = np.isin(np.arange(len(block.data)), members[i])
        blocks.append(here)
    return points, blocks


def write_msh(path: Path, mesh) -> str:
    """Write MSH 4.1 in text; what was left out comes back as a sentence, '' if nothing was."""
    x = np.zeros((len(mesh.points), 3))
    x[:, :np.shape(mesh.points)[1]] = mesh.points
    if not np.isfinite(x).all():
        raise ValueError("a point has coordinates that are no numbers")
    point_sets, block_sets = sets_of(mesh)
    names: dict[tuple[int, str], int] = {}
    entities: dict[int, list[tuple[int, tuple[int, ...]]]] = {0: [], 1: [], 2: []}
    elements, left_out, surfaces = [], 0, 0

    def add(kind, cells, sets):
        """Cells of the same sets are an entity."""
        dimension, number = CELLS[kind]
        sets = {k: v for k, v in sets.items() if v.any()}
        member = np.array([v for v in sets.values()], dtype=bool).reshape(len(sets), len(cells)).T
        tags = [names.setdefault((dimension, k), len(names) + 1) for k in sets]
        for row in np.unique(member, axis=0):
            these = cells[(member == row).all(axis=1)]
            entities[dimension].append((len(entities[dimension]) + 1, tuple(t for t, yes in zip(tags, row) if yes)))
            elements.append((dimension, entities[dimension][-1][0], number, these))

    for block, sets in zip(mesh.cells, block_sets):
        if block.type not in CELLS:
            left_out += len(block.data)
        elif len(block.data):
            surfaces += CELLS[block.type][0] == 2 and len(block.data)
            add(block.type, np.asarray(block.data), sets)
    if not surfaces:
        raise ValueError(f"there are no triangles or quadrilaterals ({left_out} other cells)")
    in_sets = np.flatnonzero(np.any(list(point_sets.values()), axis=0)) if point_sets else np.array([], int)
    if len(in_sets):
        add("vertex", in_sets[:, None], {k: v[in_sets] for k, v in point_sets.items()})
    box = " ".join(repr(float(v)) for v in (*x.min(axis=0), *x.max(axis=0)))
    count = sum(len(e[3]) for e in elements)
    with open(path, "w", encoding="utf-8") as file:
        print("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames", len(names), sep="\n", file=file)
        for (dimension, name), tag in names.items():
            print(f'{dimension} {tag} "{name}"', file=file)
        print("$EndPhysicalNames\n$Entities", " ".join(str(len(entities[d])) for d in range(3)) + " 0", sep="\n", file=file)
        for d in range(3):
            for tag, groups in entities[d]:
                print(tag, box if d else "0 0 0", len(groups), *groups, *([0] if d else []), file=file)
        print(f"$EndEntities\n$Nodes\n1 {len(x)} 1 {len(x)}\n2 {entities[2][0][0]} 0 {len(x)}", file=file)
        file.writelines(f"{i + 1}\n" for i in range(len(x)))
        file.writelines(f"{a!r} {b!r} {c!r}\n" for a, b, c in x.tolist())
        print(f"$EndNodes\n$Elements\n{len(elements)} {count} 1 {count}", file=file)
        n = 0
        for dimension, entity, number, cells in elements:
            print(dimension, entity, number, len(cells), file=file)
            for row in (cells + 1).tolist():
                n += 1
                print(n, *row, file=file)
        print("$EndElements", file=file)
    return f"{left_out} cells that are no surfaces, lines or points were left out" if left_out else ""


def main(arguments: list[str] | None = None) -> int:
    """finshell-mesh."""
    parser = argparse.ArgumentParser(prog="finshell-mesh", description=__doc__.split("\n\n")[0], epilog=__doc__.split("\n\n")[1])
    parser.add_argument("input", type=Path, help="a file that meshio reads")
    parser.add_argument("output", type=Path, help="OUT.msh")
    given = parser.parse_args(arguments)
    try:
        if given.output.suffix != ".msh":
            raise ValueError(f"the name of the new file ends with .msh, found '{given.output}'")
        if not given.input.is_file():
            raise ValueError("there is no such file")
        mesh = meshio.read(given.input)
        said = write_msh(given.output, mesh)
    except (Exception, SystemExit) as reason:  # readers of meshio raise anything, and some leave
        print(f"finshell-mesh: {given.input}: {reason or 'meshio does not read it'}", file=sys.stderr)
        return 2
    print(f"{given.output}: {len(mesh.points)} points" + (f"; {said}" if said else ""))
    return 0


if __name__ == "__main__":
    sys.exit(main())
