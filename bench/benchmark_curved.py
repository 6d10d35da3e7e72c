"""Facets or curved references: every curved case on structured and irregular meshes, without and with normals, and the element before."""
import benchmark_run as run
from benchmark_measure import WAYS, applies, measure
from benchmark_sections import percent

REFERENCES = {"facets": "facet", "curved": "auto", "curved, fitted": "fitted"}   # name -> key normals of &mesh
IRREGULAR = ("one way", "alternating", "irregular, one way", "irregular, alternating")   # of the summary


def measured(case, report):
    """For each mesh of case.curved: {(reference, way): measurements}; 'before' as recorded."""
    jobs = [(mesh, way, name) for mesh in case.curved for way in WAYS if applies(case, mesh, way) for name in REFERENCES]
    results = report.pool.map(lambda job: measure(case, job[0], job[1], REFERENCES[job[2]]), jobs)
    found = {mesh: {} for mesh in case.curved}
    for (mesh, way, name), result in zip(jobs, results):
        found[mesh][name, way] = result
        if result[0].stopped:
            report.failures.append(f"{case.name}, {mesh}, {name}, {way}: stopped at {result[0].stopped}")
    for mesh in case.curved:
        found[mesh] |= {("before", way): report.before[case.name, mesh, way] for way in WAYS if (case.name, mesh, way) in report.before}
    return found


def cell(measurement, counts=False):
    """Error, iterations, negative pivots at the end."""
    if measurement is None:
        return "–"
    negative = f", {measurement.negative} neg." if measurement.negative else ""
    if measurement.stopped:
        return f"stopped at {measurement.stopped}"
    value = percent(measurement.error) if measurement.error is not None else f"= {measurement.value:.5g}"
    return f"{value} ({measurement.iterations}{negative})" if counts else value + (f" ({negative[2:]})" if negative else "")


def section(case, report):
    """The table of one case; keeps what the summary needs."""
    found = measured(case, report)
    for mesh, results in found.items():
        quantities = [m.quantity for m in next(iter(results.values()))]
        counts = any(m.iterations > 1 for r in results.values() for m in r)
        lines = [f"Facets or curved references, {mesh}: error in per cent{' (iterations)' if counts else ''} by diagonals and mesh:", "",
                 "| reference | quantity | " + " | ".join(WAYS) + " |", "|---|---|" + "---|" * len(WAYS)]
        for name in ("before", *REFERENCES):
            for k, q in enumerate(quantities):
                cells = [results[name, way][k] if (name, way) in results else None for way in WAYS]
                lines.append(f"| {name} | {q.split(', worst')[0]} | " + " | ".join(cell(c, counts) for c in cells) + " |")
        for k, q in enumerate(quantities):
            report.curved.append((case, mesh, q, {key: r[k] for key, r in results.items()}))
        yield "\n".join(lines)


NAMES = ("before", "facets", "curved")
GROUPS = {"linear": "control = 'linear'", "pressure": "'pressure'", "nonlinear": ""}   # the first whose words the input has


def group_of(case):
    text = run.path_of(case).read_text()
    return next(name for name, words in GROUPS.items() if words in text)


def summary(report):
    """All cases in one table, and what they say together."""
    lines = ["| problem | mesh | quantity | " + " | ".join(f"{way}: {name}" for way in IRREGULAR for name in NAMES) + " |", "|---|---|---|" + "---|" * (len(IRREGULAR) * len(NAMES))]
    for case, mesh, q, results in report.curved:
        lines.append(f"| {case.name} | {mesh} | {q.split(', worst')[0]} | " + " | ".join(cell(results.get((name, way))) for way in IRREGULAR for name in NAMES) + " |")
    yield "\n".join(lines)
    columns = (*NAMES, "curved, fitted")
    lines = ["Together, where all four reach the end and there is a reference; nearer: numbers for which facets, or curved references, are more accurate:", "",
             "| problems | mesh | numbers | mean error %: " + " | ".join(columns) + " | largest: " + " | ".join(columns) + " | nearer: facets | nearer: curved |", "|---|---|---|" + "---|" * 10]
    for group in ("linear", "nonlinear", "pressure"):
        for way in IRREGULAR:
            errors = [[results.get((name, way)) for name in columns] for case, _, _, results in report.curved if group_of(case) == group]
            errors = [[abs(m.error) for m in e] for e in errors if all(m is not None and m.error is not None for m in e)]
            if not errors:
                continue
            by_name = list(zip(*errors))
            lines.append(f"| {group} | {way} | {len(errors)} | " + " | ".join(f"{sum(e) / len(e):.2f}" for e in by_name) + " | " + " | ".join(f"{max(e):.1f}" for e in by_name)
                         + f" | {sum(e[1] < e[2] - 0.005 for e in errors)} | {sum(e[2] < e[1] - 0.005 for e in errors)} |")
    yield "\n".join(lines)
