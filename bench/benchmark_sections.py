"""The sections of doc/benchmarks.md: one procedure for each kind of case, and what several cases have."""
from dataclasses import dataclass

import benchmark_measure as measured
import benchmark_run as run
from benchmark_measure import case_input, error_at_end, fine_levels, levels_reference, reference_at


@dataclass
class Row:
    """One compared number."""
    case: str
    mesh: str
    quantity: str
    value: float
    reference: float
    increments: int
    iterations: int
    cpu_s: float
    error: float = None    # per cent; by default of the reference

    def error_percent(self):
        if self.error is not None:
            return self.error
        if self.reference is None or self.value is None:
            return None
        return 100 * (self.value / self.reference - 1)

    def as_dict(self):
        def text(x, form):
            return "" if x is None else format(x, form)
        return {"case": self.case, "mesh": self.mesh, "quantity": self.quantity, "value": text(self.value, ".8g"), "reference": text(self.reference, ".8g"),
                "error_percent": text(self.error_percent(), ".4f"), "increments": self.increments, "iterations": self.iterations, "cpu_s": f"{self.cpu_s:.3f}"}


def percent(x, digits=2):
    return "–" if x is None else f"{x:+.{digits}f}"


class Report:
    """Rows for the csv file, and text, section by section."""

    def __init__(self, pool):
        self.rows, self.failures, self.spread, self.pool = [], [], [], pool
        self.source, self.before = measured.before()
        self.curved = []    # of benchmark_curved

    def failed(self, case, mesh, what, solution):
        self.failures.append(f"{case.name}, {mesh}, {what}: {solution.message or 'no message'}")


def solve(case, mesh, timeout=900, **settings):
    text, files = case_input(case, mesh, **settings)
    return run.solve(text, files=files, timeout=timeout)


def before_cells(report, case, mesh):
    """Errors (or values) and counts of the element before."""
    found = report.before.get((case.name, mesh, ""), [])
    if not found:
        return "– | –"
    counts = f"{found[0].increments} / {found[0].iterations}"
    if found[0].stopped:
        return f"stopped at {found[0].stopped} | {counts}"
    one = len(found) == 1
    return ", ".join((percent(m.error) if m.error is not None else f"= {m.value:.5g}") if one else
                     f"{m.quantity} {percent(m.error) if m.error is not None else f'= {m.value:.5g}'}" for m in found) + f" | {counts}"


def full_load(case, report):
    """Kind 'end': the answer at full load on every mesh, the curve on the way, and what beta0 does."""
    table = run.reference(case.name)
    lines = ["| mesh | " + " | ".join(f"{q} | error %" for q in case.quantities) + " | increments / iterations | CPU s | before: error % | before: incr. / it. |",
             "|---|" + "---|" * (2 * len(case.quantities) + 4)]
    for mesh in case.meshes:
        solution = solve(case, mesh)
        if not solution.done:
            report.failed(case, mesh, "full load", solution)
            lines.append(f"| {mesh} | " + "| " * (2 * len(case.quantities)) + f"stopped at load factor {solution.last.get('load_factor', 0):.3f} after "
                         f"{solution.increments} / {solution.iterations} | {solution.cpu:.2f} | {before_cells(report, case, mesh)} |")
            continue
        cells = []
        for q in case.quantities:
            column = q.removesuffix("_table")
            exact = reference_at(table, "load_factor", q, table[-1]["load_factor"] if len(table) == 1 else round(solution.last["load_factor"], 9)) if table else None
            row = Row(case.name, mesh, q, solution.last[column], exact, solution.increments, solution.iterations, solution.cpu, error_at_end(table, q, solution.last))
            report.rows.append(row)
            cells += [f"{row.value:.5g}", percent(row.error_percent())]
        lines.append(f"| {mesh} | " + " | ".join(cells) + f" | {solution.increments} / {solution.iterations} | {solution.cpu:.2f} | {before_cells(report, case, mesh)} |")
    yield "\n".join(lines)
    if case.table:
        yield from curve(case, table, report)
    if case.levels:
        yield from levels_without_reference(case, report)
    yield from spread(case, table, report)
    yield from diagonals(case, table, report)


def curve(case, table, report):
    """Largest deviation over the load factors of the reference table."""
    factors = [r["load_factor"] for r in table if 0 < r["load_factor"] <= 1 + 1e-12]
    mesh = list(case.meshes)[1 if len(case.meshes) > 2 else 0]
    step = f"load_levels = {', '.join(f'{f:.12g}' for f in factors)} residual_tolerance = 1e-5 correction_tolerance = 1e-5 {case.step or 'mixed = .true.'}"
    solution = solve(case, mesh, step=step)
    if not solution.done:
        report.failed(case, mesh, "curve", solution)
    parts = []
    for q in case.quantities:
        column = q.removesuffix("_table")
        pairs = [(solution.at("load_factor", r["load_factor"]), r) for r in table if r["load_factor"] in factors]
        scale = max(abs(r[q]) for _, r in pairs)
        deviations = [(100 * (found[column] - r[q]) / scale, r["load_factor"]) for found, r in pairs if found]
        if not deviations:
            continue
        worst, where = max(deviations, key=lambda d: abs(d[0]))
        missing = "" if len(deviations) == len(pairs) else f", {len(pairs) - len(deviations)} of {len(pairs)} points not reached"
        parts.append(f"{q} {worst:+.2f} % (load factor {where:g}{missing})")
        report.rows.append(Row(case.name, mesh, f"{q} curve", worst, None, solution.increments, solution.iterations, solution.cpu, error=worst))
    yield (f"Whole curve, {mesh}, {len(factors)} load levels, tolerance 1e-5 ({solution.increments} increments, {solution.iterations} iterations, {solution.cpu:.2f} s): "
           f"largest deviation, in per cent of the largest value of the table: {'; '.join(parts)}.")


def levels_without_reference(case, report):
    mesh = list(case.meshes)[-1]
    solution = solve(case, mesh, step=f"load_levels = {case.levels} {case.step}")
    if not solution.done:
        report.failed(case, mesh, "levels", solution)
    factors = [float(f) for f in case.levels.split(",")]
    lines = [f"Curve, {mesh} ({solution.increments} increments, {solution.iterations} iterations, {solution.cpu:.1f} s):", "",
             "| load factor | " + " | ".join(f"{f:g}" for f in factors) + " |", "|---|" + "---|" * len(factors)]
    for q in case.quantities:
        values = [solution.at("load_factor", f) for f in factors]
        lines.append(f"| {q} | " + " | ".join(f"{r[q]:.2f}" if r else "–" for r in values) + " |")
        report.rows += [Row(case.name, mesh, f"{q} at {f:g}", r[q], None, solution.increments, solution.iterations, solution.cpu)
                        for f, r in zip(factors, values) if r]
    yield "\n".join(lines)


SPREAD = (("(S), by the rule", None, None), ("(S), β0 = 0.01", 0.01, None), ("(S), 0.05", 0.05, None), ("(S), optimal", "optimal", None), ("(P), optimal", "optimal", "P"))


def error_of(case, table, q, solution):
    """Error of a quantity at the end, per cent, or None."""
    if not solution.done:
        return None
    if case.kind == "path":
        return 100 * (solution.last["load_factor"] / table[-1]["load_factor"] - 1)
    return error_at_end(table, q, solution.last)


def section_keys(case, beta0, formulation):
    keys = {}
    if beta0 is not None:
        keys["beta0"] = f"{case.optimal if beta0 == 'optimal' else beta0}"
    if formulation is not None:
        keys["formulation"] = f"'{formulation}'"
    return keys


SPREAD = (("(S), by the rule", None, None), ("(S), β0 = 0.01", 0.01, None), ("(S), 0.05", 0.05, None), ("(S), optimal", "optimal", None), ("(P), optimal", "optimal", "P"))


def spread(case, table, report):
    """Errors for several beta0. In linear problems (P) with the optimal beta0 is the published OPT membrane with DKT."""
    if not case.spread:
        return
    lines = [f"Error in per cent by section (optimal for in-plane bending: β0 = {case.optimal:.4g}):", "",
             "| mesh | quantity | " + " | ".join(name for name, _, _ in SPREAD) + " |", "|---|---|" + "---|" * len(SPREAD)]
    quantities = [q for q in case.quantities if not q.endswith("_table")]
    for mesh in case.meshes if case.spread == "all" else case.spread.split(","):
        errors = {q: [] for q in quantities}
        for solution in report.pool.map(lambda s: solve(case, mesh, section=section_keys(case, *s[1:]), timeout=120), SPREAD):
            for q in quantities:
                errors[q].append(error_of(case, table, q, solution))
        for q in quantities:
            name = "load factor at the end" if case.kind == "path" else q
            lines.append(f"| {mesh} | {name} | " + " | ".join("stopped" if e is None else percent(e) for e in errors[q]) + " |")
            report.spread.append((case, mesh, q, errors[q]))
    yield "\n".join(lines)


def diagonals(case, table, report):
    """Errors for the four ways to cut cells into triangles."""
    if not case.diagonals:
        return
    ways = ("alternating", "forward", "backward", "cross")
    lines = [f"Error in per cent by diagonals, {case.diagonals} (`cross` has twice as many triangles):", "", "| quantity | " + " | ".join(ways) + " |", "|---|" + "---|" * len(ways)]
    solutions = list(report.pool.map(lambda way: solve(case, case.diagonals, diagonal=f"'{way}'", timeout=120), ways))
    for q in case.quantities:
        lines.append(f"| {q} | " + " | ".join(percent(error_of(case, table, q, s)) for s in solutions) + " |")
    yield "\n".join(lines)


def default_section(report):
    """What beta0 costs and gains, over all problems where it was varied."""
    chosen = [(case, mesh, q, errors) for case, mesh, q, errors in report.spread if None not in errors and not case.name.startswith("patch")]
    lines = ["| problem | mesh | quantity | " + " | ".join(name for name, _, _ in SPREAD) + " |", "|---|---|---|" + "---|" * len(SPREAD)]
    seen = set()
    for case, mesh, q, errors in chosen:
        middle = list(case.meshes)[len(case.meshes) // 2] if case.spread == "all" else mesh
        if mesh == middle and case.name not in seen:
            seen.add(case.name)
            name = "load factor at the end" if case.kind == "path" else q
            lines.append(f"| {case.name} | {mesh} | {name} | " + " | ".join(percent(e) for e in errors) + " |")
    mean = [sum(abs(errors[k]) for _, _, _, errors in chosen) / max(len(chosen), 1) for k in range(len(SPREAD))]
    worst = [max((errors[k] for _, _, _, errors in chosen), key=abs, default=0.0) for k in range(len(SPREAD))]
    best = [sum(abs(errors[k]) <= min(map(abs, errors)) + 1e-9 for _, _, _, errors in chosen) for k in range(len(SPREAD))]
    lines += ["| all runs | | mean of the absolute errors | " + " | ".join(f"{m:.2f}" for m in mean) + " |", "| | | largest error | " + " | ".join(percent(w) for w in worst) + " |",
              f"| | | runs (of {len(chosen)}) where it is the best | " + " | ".join(str(n) for n in best) + " |"]
    yield "\n".join(lines)


def fine_path(case, w_end):
    node_set = "node_set = 'corner_a0_y0' component = 'z'"
    return lambda mesh: solve(case, mesh, step=f"control = 'arc_length' first_increment = 0.02 {node_set} displacements = {-w_end:g} "
                                               f"largest_increment = {PATH_INCREMENT} {case.step}")


PATH_INCREMENT = "0.05"


def roof(case, report):
    """Kind 'path': the fewest increments, then a fine path whose limit points and distance to the table are measured."""
    table = run.reference(case.name)
    w_end = table[-1]["W_C"] if table else {"b": 30.0, "c": 30.0, "e": 38.45, "f": 38.45}[case.name[-1]]
    solve_fine = fine_path(case, w_end)
    yield ("The path by default settings as in the example, then a fine one for the limit points (W_C, load factor) and the largest distance of a point of the "
           "reference table to the path, load factor and W_C both divided by their largest value.")
    lines = ["| mesh | load factor at the end | error % | increments / iterations | CPU s | limit points | distance to the table % | fine path: increments / iterations | before: error % | before: incr. / it. |",
             "|---|---|---|---|---|---|---|---|---|---|"]
    for mesh in case.meshes:
        quick = solve(case, mesh)
        end = Row(case.name, mesh, "load_factor at the end", quick.last.get("load_factor"), table[-1]["load_factor"] if table else None,
                  quick.increments, quick.iterations, quick.cpu)
        if quick.done:
            report.rows.append(end)
        else:
            report.failed(case, mesh, "path", quick)
        fine = solve_fine(mesh)
        if not fine.done:
            report.failed(case, mesh, "fine path", fine)
        points = run.extremes(fine.rows, "W_C", "load_factor")
        folder = run.ROOT / "build" / "benchmark"
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / f"{case.name}_{mesh}_path.csv").open("w") as out:
            out.write("load_factor,W_C\n" + "".join(f"{r['load_factor']:.6f},{r['W_C']:.5f}\n" for r in fine.rows))
        distance = None
        if table:
            distance = run.distance_to_table(fine.rows, table, "W_C", "load_factor")
            report.rows.append(Row(case.name, mesh, "largest distance to the table", distance, None, fine.increments, fine.iterations, fine.cpu, error=distance))
        exact = run.extremes(table, "W_C", "load_factor") if table else []
        for k, (w, p) in enumerate(points):
            ref = exact[k] if len(exact) == len(points) else (None, None)
            report.rows.append(Row(case.name, mesh, f"limit point {k + 1} load_factor", p, ref[1], fine.increments, fine.iterations, fine.cpu))
            report.rows.append(Row(case.name, mesh, f"limit point {k + 1} W_C", w, ref[0], fine.increments, fine.iterations, fine.cpu))
        limits = ", ".join(f"({w:.2f}, {p:.4f})" for w, p in points) or "none"
        cell = "–" if distance is None else f"{distance:.2f}"
        status = f"{end.value:.4f} | {percent(end.error_percent())}" if quick.done else f"stopped at W_C = {quick.last.get('W_C', 0):.2f} | –"
        lines.append(f"| {mesh} | {status} | {quick.increments} / {quick.iterations} | {quick.cpu:.2f} | {limits} | {cell} | {fine.increments} / {fine.iterations} | {before_cells(report, case, mesh)} |")
    if table:
        exact = run.extremes(table, "W_C", "load_factor")
        lines.append(f"| table | {table[-1]['load_factor']:.4f} | | | | " + ", ".join(f"({w:.2f}, {p:.4f})" for w, p in exact) + " | | | | |")
    yield "\n".join(lines)
    yield from spread(case, table, report)


def prescribed(case, report):
    """Kind 'levels': the load factor at given displacements or volumes, and the limit points."""
    reference = levels_reference(case)
    lines = ["| mesh | increments / iterations | CPU s | reached | " + f"error % at {case.reference[1]} " + " | ".join(f"{v:g}" for v in case.values) + " | before: worst error % | before: incr. / it. |",
             "|---|---|---|---|---|---|" + "---|" * len(case.values)]
    limits = ["| mesh | limit points (" + case.column + ", load factor) | increments |", "|---|---|---|"]
    for mesh in case.meshes:
        quick = solve(case, mesh)
        if not quick.done:
            report.failed(case, mesh, "path", quick)
        fine = solve(case, mesh, step=fine_levels(case))
        if not fine.done:
            report.failed(case, mesh, "fine path", fine)
        cells = []
        for label, value in case.values.items():
            found = fine.at(case.column, value)
            row = Row(case.name, mesh, f"load_factor at {case.reference[1]} {label:g}", found and found["load_factor"], reference[label],
                      quick.increments, quick.iterations, quick.cpu)
            cells.append(percent(row.error_percent()) if found else "–")
            if found:
                report.rows.append(row)
        points = run.extremes([dict.fromkeys(quick.last, 0.0), *fine.rows], case.column, "load_factor")
        for k, (w, p) in enumerate(points):
            ref = case.limits[k] if len(case.limits) == len(points) else (None, None)
            report.rows.append(Row(case.name, mesh, f"limit point {k + 1} {case.column}", w, ref[0], fine.increments, fine.iterations, fine.cpu))
            report.rows.append(Row(case.name, mesh, f"limit point {k + 1} load_factor", p, ref[1], fine.increments, fine.iterations, fine.cpu))
        found = ", ".join(f"({w:.4g}, {p:.4g})" for w, p in points) or "none"
        limits.append(f"| {mesh} | {found} | {fine.increments} |")
        lines.append(f"| {mesh} | {quick.increments} / {quick.iterations} | {quick.cpu:.2f} | {case.column} = {quick.last.get(case.column, 0):.4g}{'' if quick.done else ' (stopped)'} | "
                     + " | ".join(cells) + f" | {before_cells(report, case, mesh)} |")
    if case.limits:
        limits.append("| reference | " + ", ".join(f"({w:g}, {p:g})" for w, p in case.limits) + " | |")
    yield "\n".join(lines)
    yield "On a path of small increments (of which the errors above are taken):\n\n" + "\n".join(limits)




def turns(case, report):
    """Kind 'turns': a path whose prescribed displacement, the load factor, turns several times."""
    table = run.reference(case.name)
    lines = [f"| mesh | increments / iterations | CPU s | distance to the table % | turning points (load factor, {case.column}) | before: distance % | before: incr. / it. |",
             "|---|---|---|---|---|---|---|"]
    for mesh in case.meshes:
        solution = solve(case, mesh)
        if not solution.done:
            report.failed(case, mesh, "path", solution)
        distance = run.distance_to_table(solution.rows, table, case.column, "load_factor")
        points = run.extremes(solution.rows, case.column, "load_factor")
        report.rows.append(Row(case.name, mesh, "largest distance to the table", distance, None, solution.increments, solution.iterations, solution.cpu, error=distance))
        lines.append(f"| {mesh} | {solution.increments} / {solution.iterations} | {solution.cpu:.2f} | {distance:.2f} | {', '.join(f'({p:.4f}, {w:.4f})' for w, p in points)} | "
                     f"{before_cells(report, case, mesh)} |")
    lines.append("| reference | | | | " + ", ".join(f"({p:g}, {w:g})" for p, w in case.limits) + " | | |")
    yield "\n".join(lines)


KINDS = {"end": full_load, "path": roof, "levels": prescribed, "turns": turns}
