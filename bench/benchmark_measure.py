"""One run of a case: which input, and what is measured of its end. Figures of the element before, as they were recorded."""
import csv
from dataclasses import dataclass

import benchmark_meshes as meshes
import benchmark_run as run

BEFORE = run.ROOT / "bench" / "benchmark_before.csv"
# Ways to mesh a curved case: name -> diagonal, distortion. 0.24: nodes are moved by up to a quarter of a cell.
WAYS = {"one way": ("forward", 0.0), "other way": ("backward", 0.0), "alternating": ("alternating", 0.0), "crossed": ("cross", 0.0),
        "irregular, one way": ("forward", 0.24), "irregular, alternating": ("alternating", 0.24)}


@dataclass
class Measurement:
    """One number at the end of a run."""
    quantity: str
    value: float = None        # None: the run did not reach its end
    error: float = None        # per cent; None: no reference
    increments: int = 0
    iterations: int = 0
    negative: int = 0          # negative pivots at the end
    stopped: str = ""          # where


def case_input(case, mesh, *, step=None, section=None, **keys):
    """The input of a case on one of its meshes, and the files it needs; keys: other keys of &mesh, as text; step: in place of the steps."""
    if case.builder:
        shape = {}
        if "diagonal" in keys:
            shape["diagonal"] = keys.pop("diagonal").strip("'")
        if "distortion" in keys:
            shape["distortion"] = float(keys.pop("distortion"))
        text, files = meshes.BUILDERS[case.builder](tuple(int(n) for n in case.meshes[mesh].split(",")), **shape)
    else:
        text, files = run.with_keys(run.path_of(case).read_text(), "mesh", divisions=case.meshes[mesh]), {}
    if keys:
        text = run.with_keys(text, "mesh", **keys)
    if section:
        text = run.with_keys(text, "section", **section)
    if step is None:
        step = case.steps.get(mesh)
    return (run.with_step(text, step) if step else text), files


def way_keys(way, normals=None):
    """Keys of &mesh for one of WAYS and a kind of normals."""
    diagonal, distortion = WAYS[way]
    keys = {"diagonal": f"'{diagonal}'"}
    if distortion:
        keys["distortion"] = f"{distortion}"
    if normals:
        keys["normals"] = f"'{normals}'"
    return keys


def applies(case, mesh, way):
    """Not to a mesh that has no node inside, which stays as it is; crossed cells only of generators."""
    if case.builder and WAYS[way][0] == "cross":
        return False
    return not WAYS[way][1] or min(int(n) for n in case.meshes[mesh].split(",")) > 1


def reference_at(table, column, quantity, value):
    for row in table:
        if quantity in row and abs(row[column] - value) < 1e-9:
            return row[quantity]
    return None


def error_at_end(table, quantity, last):
    """Per cent of the reference at the load factor of the end; of its largest value on the way, where it is next to nothing. None: no reference."""
    column = quantity.removesuffix("_table")
    exact = reference_at(table, "load_factor", quantity, table[-1]["load_factor"] if len(table) == 1 else round(last["load_factor"], 9)) if table else None
    if exact is None:
        return None
    scale = max(abs(r[quantity]) for r in table)
    return 100 * (last[column] - exact) / (exact if abs(exact) > 1e-6 * scale else scale)


def levels_reference(case):
    file, x, y, *fibre = case.reference
    return {row[x]: row[y] for row in run.data(file, fibre=fibre[0] if fibre else None)}


def fine_levels(case):
    """&step of a path of small increments through all values of a case of kind 'levels'."""
    sign = -1 if case.column == "w" else 1
    return f"{case.fine} {', '.join(f'{sign * v:.10g}' for v in sorted([*case.values.values(), *case.extra]))}"


def numbers(case, solution):
    """(quantity, value, error in per cent) at the end of a run."""
    table, last = run.reference(case.name), solution.last
    if case.kind == "end":
        return [(q, last[q], error_at_end(table, q, last)) for q in case.quantities if not q.endswith("_table")]
    if case.kind == "path":
        end = last["load_factor"]
        return [("load factor at the end", end, 100 * (end / table[-1]["load_factor"] - 1) if table else None)]
    if case.kind == "turns":
        return [("largest distance to the table", *[run.distance_to_table(solution.rows, table, case.column, "load_factor")] * 2)]
    exact = levels_reference(case)
    errors = [(100 * (found["load_factor"] / exact[label] - 1), label) for label, value in case.values.items() if (found := solution.at(case.column, value))]
    worst = max(errors, key=lambda e: abs(e[0]))
    return [(f"load factor, worst (at {case.reference[1]} {worst[1]:g})", solution.at(case.column, case.values[worst[1]])["load_factor"], worst[0])]


def measure(case, mesh, way=None, normals=None, timeout=120):
    """What the case gives; counts are those by the settings of its example, or of case.gentle."""
    text, files = case_input(case, mesh, step=case.gentle or None, **way_keys(way, normals)) if way else case_input(case, mesh)
    solution = run.solve(text, files=files, timeout=timeout)
    counts = {"increments": solution.increments, "iterations": solution.iterations, "negative": max(int(solution.last.get("negative_pivots", 0)), 0)}
    if solution.done and case.kind == "levels" and not way:    # as the tables do
        solution = run.solve(case_input(case, mesh, step=fine_levels(case))[0], timeout=timeout)
    if solution.done:
        return [Measurement(q, value, error, **counts) for q, value, error in numbers(case, solution)]
    stopped = f"{solution.last.get('load_factor', 0):.3g}" if solution.rows else solution.message[-60:]
    return [Measurement(q, stopped=stopped, **counts) for q in case.quantities if not q.endswith("_table")]


COLUMNS = ("case", "mesh", "way", "quantity", "value", "error_percent", "increments", "iterations", "negative_pivots", "stopped")


def record(cases, pool, source):
    """Write BEFORE: what the program gives on all meshes and in all ways, with the normals it has by default."""
    jobs = [(case, mesh, way) for case in cases for mesh in case.meshes
            for way in [None, *([w for w in WAYS if mesh in case.curved and applies(case, mesh, w)])]]
    results = pool.map(lambda job: measure(*job), jobs)
    with BEFORE.open("w", newline="") as out:
        out.write(f"# {source}\n")
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(COLUMNS)
        for (case, mesh, way), found in zip(jobs, results):
            for m in found:
                writer.writerow([case.name, mesh, way or "", m.quantity, "" if m.value is None else f"{m.value:.8g}", "" if m.error is None else f"{m.error:.4f}",
                                 m.increments, m.iterations, m.negative, m.stopped])


def before():
    """(what the figures are, dict from case, mesh, way to measurements) of the file BEFORE."""
    found = {}
    for row in run.table(BEFORE):
        number = {k: float(row[c]) if row[c] else None for k, c in (("value", "value"), ("error", "error_percent"))}
        found.setdefault((row["case"], row["mesh"], row["way"]), []).append(Measurement(
            row["quantity"], **number, increments=int(row["increments"]), iterations=int(row["iterations"]), negative=int(row["negative_pivots"]), stopped=row["stopped"]))
    return BEFORE.read_text().splitlines()[0].removeprefix("# "), found
