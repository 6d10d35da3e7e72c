"""Our side of doc/accuracy.md: an input on a mesh with a preset, its error and its CPU time; references; points of peers; comparison at equal error."""
import csv
import os
import resource
import subprocess
from dataclasses import dataclass, replace
from math import exp, isfinite, log
from pathlib import Path

import benchmark_run as run
from accuracy_problems import LEVELS

HERE = Path(__file__).resolve().parent
REFERENCES, PEERS = HERE / "accuracy_references.csv", HERE / "accuracy_peers.csv"
PRESETS = ("fast", "balanced", "reference")
LIMIT = 12.0                  # CPU seconds: no mesh that is expected to take longer
GROWTH = 6.0                  # of the CPU time from one mesh to the next


@dataclass
class Point:
    """One run: mesh, CPU seconds, worst error of the monitors in per cent (None: it did not get there)."""
    mesh: str
    cpu: float
    error: float = None
    steps: int = 0
    iterations: int = 0
    values: str = ""
    failed: str = ""


@dataclass
class Reference:
    value: float
    uncertain: float          # per cent
    source: str


def references():
    """problem -> quantity -> Reference."""
    found = {}
    for row in run.table(REFERENCES):
        found.setdefault(row["problem"], {})[row["quantity"]] = Reference(float(row["value"]), float(row["uncertain_percent"]), row["source"])
    return found


def mesh_keys(mesh):
    return {"divisions": mesh} if isinstance(mesh, str) else mesh


def label(mesh):
    return mesh.replace(", ", "x") if isinstance(mesh, str) else ", ".join(f"{key} {value}" for key, value in mesh.items())


def monitors(problem, solution, exact):
    """quantity -> value at the end of a run."""
    if problem.kind == "end":
        return {q: solution.last[q] for q in exact}
    if problem.kind == "levels":
        at = {name: (solution.at(column, value), number) for name, (column, value, number) in LEVELS[problem.name].items()}
        return {name: row[number] if row else float("nan") for name, (row, number) in at.items()}
    return {"distance": run.distance_to_table(solution.rows, run.reference(problem.file.split("/")[0]), problem.column, "load_factor")}


def worst(values, exact):
    """The largest error of the monitors in per cent; a distance is one already."""
    errors = [abs(values[q]) if q == "distance" else 100 * abs(values[q] / exact[q].value - 1) for q in exact]
    return max(errors) if all(isfinite(e) for e in errors) else None


def measure(problem, mesh, preset, exact, timeout=900):
    """A Point; the preset may refine the mesh further or make it coarser."""
    text = run.with_keys((run.EXAMPLES / problem.file).read_text(), "mesh", **mesh_keys(mesh))
    if preset:
        text = run.with_keys(text, "job", accuracy=f"'{preset}'")
    if problem.step:
        text = run.with_step(text, problem.step)
    solution = run.solve(text, timeout=timeout)
    point = Point(label(mesh), solution.cpu, steps=solution.increments, iterations=solution.iterations)
    if not solution.done:
        point.failed = solution.message[:100] or "stopped"
        return point
    values = monitors(problem, solution, exact)
    point.error, point.values = worst(values, exact), " ".join(f"{k}={v:.7g}" for k, v in values.items())
    return point


def ladder(problem, preset, exact, limit=LIMIT, meshes=None):
    """Points of all meshes that are expected to stay below the limit; for the example's own mesh three times as long."""
    points = []
    for k, mesh in enumerate(meshes or problem.meshes):
        if points and GROWTH * points[-1].cpu > limit * (1 if meshes or k > problem.own else 3):
            break
        points.append(measure(problem, mesh, preset, exact))
    return points


def peers(exact):
    """problem -> peer -> Points, of the stored table."""
    found = {}
    for row in run.table(PEERS):
        point = Point(row["mesh"], float(row["cpu_s"]), steps=int(row["steps"]), iterations=int(row["iterations"]), values=row["values"], failed=row["failed"])
        values = dict(pair.split("=") for pair in row["values"].split())
        if not row["failed"]:
            point.error = worst({k: float(v) for k, v in values.items()}, exact[row["problem"]])
        found.setdefault(row["problem"], {}).setdefault(row["peer"], []).append(point)
    return found


def start(times=9):
    """CPU seconds of a start of the program that does nothing: the least of some."""
    found = []
    for _ in range(times):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([run.PROGRAM, "--version"], capture_output=True, check=True, env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        found.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(found)


def without_start(lines, seconds):
    """The ladders without the start of the program, as those of peers are without their imports."""
    return [[replace(p, cpu=max(p.cpu - seconds, 1e-3)) for p in line] for line in lines]


def settled(line):
    """(CPU, error) of a ladder from coarse to fine. An error that grows again on a finer mesh was small by a change of sign: it counts as large as on all finer meshes."""
    found, worst_finer = [], 1e-4
    for p in reversed([p for p in line if p.error is not None]):
        worst_finer = max(worst_finer, p.error)
        found.append((max(p.cpu, 1e-3), worst_finer))
    return found


def frontier(lines):
    """(CPU, error) of the runs of some ladders that no cheaper one beats, from cheap to exact."""
    found = []
    for cpu, error in sorted(point for line in lines for point in settled(line)):
        if not found or error < found[-1][1]:
            found.append((cpu, error))
    return found


def cpu_at(lines, error):
    """CPU seconds for an error, interpolated along the frontier in logarithms; None: not reached. A coarser mesh than the first is not assumed to be cheaper."""
    line = frontier(lines)
    if not line or line[-1][1] > error * (1 + 1e-9):
        return None
    if line[0][1] <= error:
        return line[0][0]
    for (c0, e0), (c1, e1) in zip(line, line[1:]):
        if e1 <= error * (1 + 1e-9):
            return exp(log(c0) + (log(c1) - log(c0)) * min(1.0, (log(e0) - log(error)) / (log(e0) - log(e1))))
    return None


def compare(ours, rivals, error):
    """(our CPU, name of the cheapest peer, its CPU) at this error; None where one does not reach it. ours: ladders; rivals: name -> ladder."""
    costs = {name: cost for name, line in rivals.items() if (cost := cpu_at([line], error)) is not None}
    best = min(costs, key=costs.get) if costs else None
    return cpu_at(ours, error), best, costs.get(best)


def common_error(ours, rivals, floor):
    """The smallest error that we and at least one peer reach, not below what the reference can tell; None: no peer."""
    best, mine = frontier(rivals.values()), frontier(ours)
    return max(mine[-1][1], best[-1][1], floor) if best and mine else None


COLUMNS = ("problem", "preset", "mesh", "cpu_s", "error_percent", "increments", "iterations", "values", "failed")


def read_points(path):
    """problem -> preset -> Points of a file that was written by keep_points."""
    found = {}
    for row in run.table(path) if path.exists() else ():
        point = Point(row["mesh"], float(row["cpu_s"]), float(row["error_percent"]) if row["error_percent"] else None, int(row["increments"]), int(row["iterations"]),
                      row["values"], row["failed"])
        found.setdefault(row["problem"], {}).setdefault(row["preset"], []).append(point)
    return found


def keep_points(path, new):
    """Write points, those of the file that are not among the new ones too."""
    found = read_points(path)
    for problem, lines in new.items():
        found.setdefault(problem, {}).update(lines)
    path.parent.mkdir(exist_ok=True)
    with path.open("w", newline="") as out:
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(COLUMNS)
        for problem, lines in found.items():
            for preset, line in lines.items():
                for p in line:
                    writer.writerow((problem, preset, p.mesh, f"{p.cpu:.4f}", "" if p.error is None else f"{p.error:.5f}", p.steps, p.iterations, p.values, p.failed))
