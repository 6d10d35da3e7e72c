"""doc/accuracy.md: tables, figures and advice from points."""
import accuracy_run as points
from accuracy_problems import PROBLEMS

COLOURS = {"fast": "#e08214", "balanced": "#1b7837", "reference": "#2166ac"}
NAMES = {"kratos_thin": "Kratos thin triangle", "kratos_thick": "Kratos thick triangle", "ccx_c3d20r": "CalculiX C3D20R", "ccx_cps6": "CalculiX CPS6", "ccx_cps8r": "CalculiX CPS8R",
         "ngs_2": "NGSolve, order 2", "ngs_3": "NGSolve, order 3", "ngs_5": "NGSolve, order 5", "os_asdt3": "OpenSees ASDShellT3", "os_nldkgt": "OpenSees ShellNLDKGT",
         "os_mitc4": "OpenSees MITC4"}
MARKS = dict(zip(NAMES, "sD^<>PXXvh*"))
GOAL = 20


def percent(error):
    return "–" if error is None else f"{error:.3g}"


def seconds(cpu):
    return "–" if cpu is None else f"{cpu:.3f}" if cpu < 1 else f"{cpu:.3g}"


def figure(problem, ours, rivals, path):
    """Error against CPU time, both in logarithms."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    plt.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": problem.name, "font.size": 8})
    fig, axes = plt.subplots(figsize=(5.2, 3.0))
    for preset, line in ours.items():
        shown = [p for p in line if p.error is not None]
        axes.loglog([p.cpu for p in shown], [max(p.error, 1e-4) for p in shown], "o-", color=COLOURS.get(preset, "black"), lw=1.4, ms=4, label=f"finshell {preset}")
    for name, line in rivals.items():
        shown = [p for p in line if p.error is not None]
        if shown:
            axes.loglog([p.cpu for p in shown], [max(p.error, 1e-4) for p in shown], MARKS[name] + "--", color="0.45", lw=0.7, ms=4, label=NAMES[name])
    axes.set_xlabel("CPU s")
    axes.set_ylabel("error %")
    axes.minorticks_off()
    axes.grid(True, which="major", lw=0.3)
    axes.legend(fontsize=6, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    fig.tight_layout()
    fig.savefig(path, metadata={"Date": None})
    plt.close(fig)


def floor(exact):
    """The smallest error that a comparison may go by, in per cent: twice what the reference may be wrong by."""
    return 2 * max(r.uncertain for r in exact.values())


def ratio_rows(ours, rivals, exact):
    """(error, our CPU, peer, its CPU, ratio) at 1 % and at the smallest error that both reach; ours: ladders, rivals: name -> ladder."""
    rows = []
    smallest = points.common_error(ours, rivals, floor(exact))
    for error in sorted({e for e in (1.0, smallest) if e is not None}, reverse=True):
        mine, name, cost = points.compare(ours, rivals, error)
        if mine and name:
            rows.append((error, mine, name, cost, cost / mine))
    return rows


def section(problem, ours, rivals, exact, picture):
    text = [f"## {problem.title}", f"`examples/{problem.file}`, `{problem.name}` in the tables."]
    sources = {}
    for quantity, r in exact.items():
        sources.setdefault(r.source, []).append("distance" if quantity == "distance" else f"{quantity} {r.value:.9g}")
    text.append("Reference: " + "; ".join(f"{', '.join(v)} ({source})" for source, v in sources.items()) + f". Trusted to {max(r.uncertain for r in exact.values()):g} %.")
    text += [part for part in (problem.model, problem.why) if part]
    text.append(f"![{problem.name}]({picture})")
    lines = ["| mesh | " + " | ".join(f"{p}: error % | CPU s | incr. / it." for p in ours) + " |", "|---|" + "---|---|---|" * len(ours)]
    meshes = []
    for line in ours.values():
        meshes += [p.mesh for p in line if p.mesh not in meshes]
    for mesh in meshes:
        cells = []
        for line in ours.values():
            found = [p for p in line if p.mesh == mesh]
            cells += [percent(found[0].error) if not found[0].failed else "stopped", seconds(found[0].cpu), f"{found[0].steps} / {found[0].iterations}"] if found else ["", "", ""]
        lines.append(f"| {mesh} | " + " | ".join(cells) + " |")
    text.append("\n".join(lines))
    if rivals:
        lines = ["| peer | mesh: error % in CPU s |", "|---|---|"]
        for name, line in rivals.items():
            lines.append(f"| {NAMES[name]} | " + "; ".join(f"{p.mesh}: {percent(p.error)} in {seconds(p.cpu)}" if not p.failed else f"{p.mesh}: {p.failed}" for p in line) + " |")
        text.append("\n".join(lines))
    return "\n\n".join(text)


def summary(everything, rivals, exact, start):
    lines = ["| problem | error % | finshell CPU s | best peer | CPU s | ratio | at least 20 |", "|---|---|---|---|---|---|---|"]
    for problem in PROBLEMS:
        if problem.name not in everything:
            continue
        rows = ratio_rows(points.without_start(everything[problem.name].values(), start), rivals.get(problem.name, {}), exact[problem.name])
        if not rows:
            lines.append(f"| {problem.name} | | | {'no peer gets to the end' if problem.name in rivals else 'not tried' if problem.peer else 'no peer can run it'} | | | |")
        for error, mine, name, cost, ratio in rows:
            lines.append(f"| {problem.name} | {error:.3g} | {seconds(mine)} | {NAMES[name]} | {seconds(cost)} | {ratio:.3g} | {'yes' if ratio >= GOAL else f'no: {problem.less}'} |")
    return "\n".join(lines)


def aims(everything, presets):
    """Errors of the examples as they are, by preset, and the coarsest mesh that meets an aim where the example's does not."""
    aim = {"balanced": 1.0, "reference": 0.1}
    lines = ["| problem | mesh of the example | " + " | ".join(f"{p}: error % | CPU s" for p in presets) + " | balanced ≤ 1 % | reference ≤ 0.1 % |", "|---|---|" + "---|---|" * len(presets) + "---|---|"]
    for problem in PROBLEMS:
        if problem.name not in everything:
            continue
        own, cells, verdicts = points.label(problem.meshes[problem.own]), [], []
        at = {p: next((q for q in everything[problem.name][p] if q.mesh == own), None) for p in presets}
        for p in presets:
            cells += [percent(at[p].error) if at[p] else "–", seconds(at[p].cpu) if at[p] else "–"]
        for p, limit in aim.items():
            reached = next((q for q in everything[problem.name].get(p, ()) if q.error is not None and q.error <= limit), None)
            if at.get(p) and at[p].error is not None:
                verdict = "yes" if at[p].error <= limit else "no"
            else:
                verdict = "not run, see its section" if not reached else "yes, already"
            verdicts.append(verdict if verdict in ("yes", "not run, see its section") else f"{verdict}: {reached.mesh} in {seconds(reached.cpu)} s" if reached else "no, see its section")
        lines.append(f"| {problem.name} | {own} | " + " | ".join(cells + verdicts) + " |")
    return "\n".join(lines)


def choose(everything):
    """The coarsest mesh of the ladder for an error, as it is (`balanced`)."""
    lines = ["| problem | mesh for 1 % | CPU s | mesh for 0.1 % | CPU s |", "|---|---|---|---|---|"]
    for problem in PROBLEMS:
        if problem.name not in everything:
            continue
        cells = []
        for error in (1.0, 0.1):
            good = next((q for q in everything[problem.name].get("balanced", ()) if q.error is not None and q.error <= error), None)
            cells += [good.mesh, seconds(good.cpu)] if good else ["finer than were run", "–"]
        lines.append(f"| {problem.name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)
