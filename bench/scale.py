#!/usr/bin/env python3
"""What an analysis costs and how that grows: 10^3 to 10^6 triangles, disk, cylinder and hemisphere, part by part.

    bench/scale.py [--triangles 1e3,1e4,1e5,1e6] [--meshes disk,cylinder,hemisphere] [--nonlinear 1e6] [--threads 1] [--write] [--note TEXT]

Each line is a process of its own (bench_scale): set-up (input, mesh, equations, pattern), assembly of force and tangent, ordering,
factorisation, solution, output (the result file is begun), increment (one is written), in seconds of CPU time; then the memory of the factors and of the whole
process. Exponents are those of the growth from one line to the next. --nonlinear: the program finshell on the hemisphere, two increments.
--write puts the tables with machine and date into doc/performance.md. FINSHELL_BIN names the program finshell; bench_scale is
expected beside it. 10^6 triangles take some 10 GB and ten minutes.
"""
import argparse
import datetime
import math
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FINSHELL = os.environ.get("FINSHELL_BIN") or str(ROOT / "build/bin/finshell")
PROGRAM = Path(FINSHELL).with_name("bench_scale")
DOCUMENT = ROOT / "doc/performance.md"
PARTS = ["set-up", "assembly", "ordering", "factorisation", "solution", "output", "increment"]
DISK = """&mesh generator = 'disk' portion = 'quarter' radius = 7.5 rings = {n} /
&material name = 'rubber' law = 'mooney_rivlin' c10 = 80 c01 = 20 /
&section thickness = 0.5 /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'pressure' pressure = 1 /
"""
CYLINDER = """&mesh generator = 'cylinder' radius = 300.0 length = 300.0 angles = 0.0, 90.0 divisions = {n}, {n} diagonal = 'alternating' /
&material name = 'elastic' law = 'linear_elastic' e = 3e6 nu = 0.3 /
&section thickness = 3.0 /
&support node_set = 'edge_a0' type = 'symmetry_x' /
&support node_set = 'edge_a1' type = 'symmetry_z' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&support node_set = 'edge_y1' fixed = 'ux', 'uz' /
&load type = 'force' node_set = 'corner_a0_y0' vector = 0.0, 0.0, -0.25 /
"""
HEMISPHERE = """&mesh generator = 'sphere' radius = 10.0 colatitudes = 18.0, 90.0 azimuths = 0.0, 90.0 divisions = {n}, {n} /
&material name = 'elastic' law = 'linear_elastic' e = 6.825e7 nu = 0.3 /
&section thickness = 0.04 /
&support node_set = 'edge_a0' type = 'symmetry_y' /
&support node_set = 'edge_a1' type = 'symmetry_x' /
&support node_set = 'corner_a0_bottom' fixed = 'uz' /
&load type = 'force' node_set = 'corner_a0_bottom' vector = 1.0, 0.0, 0.0 /
&load type = 'force' node_set = 'corner_a1_bottom' vector = 0.0, -1.0, 0.0 /
"""
MESHES = {"disk": DISK, "cylinder": CYLINDER, "hemisphere": HEMISPHERE}
LINEAR, NONLINEAR = "&step control = 'linear' /\n", "&step first_increment = 0.5 largest_increment = 0.5 mixed = .true. /\n"


def run(command, folder, threads):
    """Standard output, wall seconds, CPU seconds, largest memory (bytes) of a command."""
    environment = {**os.environ, "OMP_NUM_THREADS": str(threads)}
    with subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True) as process:
        start = time.time()
        text = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{' '.join(command)}: exit code {process.returncode}\n{text}")
    return text, time.time() - start, usage.ru_utime + usage.ru_stime, 1024 * usage.ru_maxrss


def write_input(folder, name, triangles, step):
    """A mesh of about so many triangles."""
    (folder / "scale.nml").write_text("&job name = 'scale' /\n" + MESHES[name].format(n=max(2, round(math.sqrt(triangles / 2)))) + step)


def measure(folder, name, triangles, threads):
    """Seconds of CPU time by part, and sizes."""
    write_input(folder, name, triangles, LINEAR)
    text, wall, cpu, memory = run([str(PROGRAM), "scale.nml"], folder, threads)
    lines = [line.split() for line in text.splitlines()]
    found = {words[0]: float(words[2]) for words in lines if words[0] in PARTS}
    size = next(words for words in lines if words[0] == "size")
    found.update(triangles=int(size[1]), unknowns=int(size[2]), factor=float(size[4]), memory=memory, wall=wall, cpu=cpu,
                 file=(folder / "scale.vtkhdf").stat().st_size)
    return found


def number(value):
    """Three digits."""
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def exponent(before, after, key):
    """Of the growth with the number of triangles; times below a hundredth of a second say nothing."""
    if before[key] < 0.01:
        return ""
    return f"{math.log(after[key] / before[key]) / math.log(after['triangles'] / before['triangles']):.2f}"


def parts_table(name, triangles, threads, folder):
    """Lines of the table of a mesh, printed as they come."""
    titles = ["triangles", "unknowns", *PARTS, "set-up + assembly / factorisation", "factors MB", "memory MB", "result file MB"]
    lines = [f"{name.capitalize()}:", "", "| " + " | ".join(titles) + " |", "|" + "---|" * len(titles)]
    print("\n".join(lines), flush=True)
    before = None
    for n in triangles:
        row = measure(folder, name, n, threads)
        share = (row["set-up"] + row["assembly"]) / row["factorisation"]
        words = [f"{row['triangles']}", f"{row['unknowns']}", *[number(row[part]) for part in PARTS], f"{100 * share:.0f} %",
                 *[number(row[key] / 1e6) for key in ("factor", "memory", "file")]]
        new = []
        if before:
            keys = [*PARTS, None, "factor", "memory", "file"]
            new.append("| *exponent* | | " + " | ".join(exponent(before, row, key) if key else "" for key in keys) + " |")
        new.append("| " + " | ".join(words) + " |")
        print("\n".join(new), flush=True)
        lines += new
        before = row
    return lines


def nonlinear_table(triangles, threads, folder):
    """The hemisphere in two increments, by the program itself."""
    lines = ["Hemisphere, nonlinear, two increments, by the program `finshell`:", "",
             "| triangles | threads | increments | iterations | CPU s | wall s | memory MB | result file MB |", "|---|---|---|---|---|---|---|---|"]
    print("\n".join(lines), flush=True)
    for n in triangles:
        write_input(folder, "hemisphere", n, NONLINEAR)
        text, wall, cpu, memory = run([FINSHELL, "run", "scale.nml"], folder, threads)
        elements = re.search(r"(\d+) elements", text).group(1)
        increments, iterations = re.search(r"(\d+) increments, (\d+) iterations", text).groups()
        lines.append(f"| {elements} | {threads} | {increments} | {iterations} | {number(cpu)} | {number(wall)} | {memory / 1e6:.0f} | "
                     f"{(folder / 'scale.vtkhdf').stat().st_size / 1e6:.0f} |")
        print(lines[-1], flush=True)
    return lines


def machine():
    """Processor, cores, memory, date."""
    text = Path("/proc/cpuinfo").read_text(encoding="ascii") if Path("/proc/cpuinfo").exists() else ""
    model = re.search(r"model name\s*: (.*)", text)
    wide = "AVX-512" if "avx512f" in text else "AVX2" if "avx2" in text else "SSE2"
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return (f"{model.group(1) if model else 'unknown processor'}, {len(os.sched_getaffinity(0))} cores, {wide}, {memory:.0f} GiB, "
            f"{datetime.date.today().isoformat()}")


def store(lines):
    """Between the marks in the document."""
    text = DOCUMENT.read_text(encoding="utf-8")
    new = re.sub(r"(<!-- bench/scale.py -->\n).*(<!-- end of bench/scale.py -->)", lambda m: m[1] + "\n".join(lines) + "\n" + m[2], text, flags=re.S)
    if new == text:
        sys.exit(f"{DOCUMENT}: no marks of bench/scale.py")
    DOCUMENT.write_text(new, encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", default="1e3,1e4,1e5,1e6")
    parser.add_argument("--meshes", default=",".join(MESHES))
    parser.add_argument("--nonlinear", default="1e6", help="numbers of triangles, or none")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--note", default="", help="text beside machine and date")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    sizes, nonlinear = ([float(n) for n in text.split(",") if text != "none"] for text in (options.triangles, options.nonlinear))
    lines = [f"Measured on {machine()}, {options.threads} thread{'s' if options.threads > 1 else ''}{'; ' * bool(options.note)}{options.note}.", ""]
    print("\n".join(lines), flush=True)
    with tempfile.TemporaryDirectory() as name:
        for mesh in options.meshes.split(","):
            lines += [*parts_table(mesh, sizes, options.threads, Path(name)), ""]
        if nonlinear:
            lines += nonlinear_table(nonlinear, options.threads, Path(name))
    if options.write:
        store(lines)


if __name__ == "__main__":
    main()
