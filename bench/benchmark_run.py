"""Input files of examples/ with other meshes and settings, solved by the program; histories and references read."""
import csv
import os
import re
import resource
import subprocess
import tempfile
from dataclasses import dataclass, field
from math import hypot
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "examples"
PROGRAM = Path(os.environ.get("FINSHELL_BIN") or ROOT / "build" / "bin" / "finshell").resolve()


@dataclass
class Solution:
    """What a run gave: rows of the history (numbers by name of the column), CPU seconds, whether it reached its end, last message."""
    rows: list = field(default_factory=list)
    cpu: float = 0.0
    done: bool = False
    message: str = ""

    @property
    def increments(self):
        return len(self.rows)

    @property
    def iterations(self):
        return self.tried or int(sum(r["iterations"] for r in self.rows))

    tried: int = 0             # linear solves, failed attempts included; 0: unknown

    @property
    def last(self):
        return self.rows[-1] if self.rows else {}

    def at(self, column, value):
        """The last row with this value in the column, or None."""
        found = [r for r in self.rows if abs(r[column] - value) <= 1e-5 * max(abs(value), 1e-3)]
        return found[-1] if found else None


def _group(text, name):
    """Extent of the keys of the first group of this name: behind its name, and before its closing slash."""
    start = re.search(rf"^&{name}\b", text, re.MULTILINE)
    if not start:
        raise ValueError(f"no group &{name}")
    quote, k = "", start.end()
    while True:
        c = text[k]
        if quote:
            quote = "" if c == quote else quote
        elif c in "'\"":
            quote = c
        elif c == "!":
            k = text.index("\n", k)
        elif c == "/":
            return start.end(), k
        k += 1


def with_keys(text, group, **keys):
    """The input with these keys in the first group of that name set to these values (as text); None removes a key."""
    begin, end = _group(text, group)
    inside = text[begin:end]
    for key, value in keys.items():
        inside = re.sub(rf"(?<![\w']){key}\s*=\s*('[^']*'|[^=])*?(?=\s+\w+\s*=|\s*$)", "", inside)
        if value is not None:
            inside = f"{inside.rstrip()} {key} = {value} "
    return text[:begin] + re.sub(r" {2,}", " ", inside) + text[end:]


def with_step(text, step):
    """The input with all its steps replaced by one."""
    while re.search(r"^&step\b", text, re.MULTILINE):
        begin, end = _group(text, "step")
        text = text[:begin - len("&step")] + text[end + 1:]
    return text + f"\n&step {step} /\n"


def table(path):
    """Rows of a csv file, as text; lines with # are comments."""
    return list(csv.DictReader(line for line in path.read_text().splitlines() if not line.startswith("#")))


def path_of(case):
    return EXAMPLES / (case.file or f"{case.name}/input.nml")


def beside(path):
    """The meshes that lie beside an input file, by name."""
    return {file.name: file.read_text() for file in path.parent.glob("*.msh")}


def example(name):
    return (EXAMPLES / name / "input.nml").read_text()


def data(name, fibre=None):
    """Rows of a table in test/data (or, with a slash, in examples/); with `fibre`, those that have this word in their column `fibre`."""
    folder = EXAMPLES if "/" in name else ROOT / "test" / "data"
    return [{k: float(v) for k, v in row.items() if k != "fibre"} for row in table(folder / name) if fibre is None or row["fibre"] == fibre]


def reference(name):
    """Rows of examples/NAME/reference.csv, or none."""
    path = EXAMPLES / name / "reference.csv"
    if not path.exists():
        return []
    return [{k: float(v) for k, v in row.items()} for row in table(path)]


def solve(text, output=False, timeout=900, files=None):
    """Run an input file with one thread and without result file; files: others that it needs, by name."""
    with tempfile.TemporaryDirectory() as folder:
        text = with_keys(text, "job", name="'case'")
        if not output and not re.search(r"^&output\b", text, re.MULTILINE):
            text += "\n&output every = 0 /\n"
        for name, content in {**(files or {}), "case.nml": text}.items():
            (Path(folder) / name).write_text(content)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        try:
            run = subprocess.run([PROGRAM, "run", "--quiet", "case.nml"], cwd=folder, capture_output=True, text=True, check=False, timeout=timeout,
                                 env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})
            done, message = run.returncode == 0, run.stdout + run.stderr
        except subprocess.TimeoutExpired:
            done, message = False, f"not finished after {timeout} s"
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        history = Path(folder) / "case.history.csv"
        rows = [{k: float(v) for k, v in r.items()} for r in table(history)] if history.exists() else []
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    tried = re.search(r"increments, (\d+) iterations", message)
    solution = Solution(rows, cpu, done, message.strip().splitlines()[-1] if message.strip() else "")
    solution.tried = int(tried.group(1)) if tried else 0
    return solution


def extremes(rows, x, y):
    """Turning points of y along the path, by parabolas over the length of the path: pairs (x, y) in the order of passing.

    A maximum and a minimum that follow each other within 2 % of the largest are a ripple and left out.
    """
    found = []
    wide, high = (max((abs(r[column]) for r in rows), default=0.0) or 1.0 for column in (x, y))
    for a, b, c in zip(rows, rows[1:], rows[2:]):
        if (b[y] - a[y]) * (c[y] - b[y]) < 0:
            s = [-hypot((b[x] - a[x]) / wide, (b[y] - a[y]) / high), 0.0, hypot((c[x] - b[x]) / wide, (c[y] - b[y]) / high)]
            peak = parabola_peak(s, [a[y], b[y], c[y]])
            found.append((lagrange(s, [a[x], b[x], c[x]], peak), lagrange(s, [a[y], b[y], c[y]], peak)))
    ripple = 0.02 * max((abs(p) for _, p in found), default=0.0)
    k = 0
    while k + 1 < len(found):
        if abs(found[k + 1][1] - found[k][1]) < ripple:
            kept = found[k + 2:k + 3]    # of the two maxima or minima around it the further one
            if kept and (kept[0][1] - found[k][1]) * (found[k + 1][1] - found[k][1]) > 0:
                del found[k + 1:k + 3]
            else:
                del found[k:k + 2]
            k = 0
        else:
            k += 1
    return found


def lagrange(s, f, t):
    total = 0.0
    for i in range(3):
        term = f[i]
        for j in range(3):
            if j != i:
                term *= (t - s[j]) / (s[i] - s[j])
        total += term
    return total


def parabola_peak(s, f):
    d1, d2 = (f[1] - f[0]) / (s[1] - s[0]), (f[2] - f[1]) / (s[2] - s[1])
    curvature = (d2 - d1) / (s[2] - s[0])
    return 0.5 * (s[0] + s[1]) - 0.5 * d1 / curvature


def distance_to_path(rows, x, y, point, scale_x, scale_y):
    """Distance of a point to the polyline of the path, in scaled coordinates."""
    px, py = point[0] / scale_x, point[1] / scale_y
    best = float("inf")
    path = [(r[x] / scale_x, r[y] / scale_y) for r in rows]
    for (ax, ay), (bx, by) in zip(path, path[1:]):
        dx, dy = bx - ax, by - ay
        length = dx * dx + dy * dy
        t = 0.0 if length == 0 else min(1.0, max(0.0, ((px - ax) * dx + (py - ay) * dy) / length))
        best = min(best, hypot(px - ax - t * dx, py - ay - t * dy))
    return best


def distance_to_table(rows, table, x, y):
    """Largest distance of a point of the table to the path from the origin, x and y divided by the largest values of the table; per cent."""
    scale_x, scale_y = (max(abs(r[column]) for r in table) for column in (x, y))
    start = [{x: 0.0, y: 0.0}]
    return max(100 * distance_to_path(start + rows, x, y, (r[x], r[y]), scale_x, scale_y) for r in table)
