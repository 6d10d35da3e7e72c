#!/usr/bin/env python3
"""Estimated against true errors of meshes, on problems of all kinds: the tables of doc/error_estimate.md.

    bench/effectivity.py [--build BUILD] [--write] [CASE ...]      BUILD: folder of a preset, default build/release

--write puts the tables into doc/error_estimate.md, between its marks. The true error is that against a mesh that is four times finer
than the finest, or more (bench/bench_error.f90).
"""
import argparse
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DOC = ROOT / "doc" / "error_estimate.md"
BEGIN, END = "<!-- begin {} -->", "<!-- end {} -->"


def example(name, **replaced):
    """The input of an example, parts of the text replaced."""
    path = ROOT / "examples" / name
    text = (path / "input.nml" if path.is_dir() else path).read_text()
    for old, new in replaced.get("parts", ()):
        if old not in text:
            sys.exit(f"examples/{name}: no '{old}'")
        text = text.replace(old, new)
    return text


PLATE = """&material name = 'm' law = 'linear_elastic' e = 1e6 nu = 0.3 /
&section thickness = 0.01 /
"""

CLAMPED_DISK = """&mesh generator = 'disk' radius = 1 rings = 8 portion = 'quarter' /
""" + PLATE + """&support node_set = 'rim' type = 'clamped' /
&support node_set = 'edge_x0' type = 'symmetry_x' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&load type = 'traction' vector = 0, 0, 1e-3 /
&step control = 'linear' /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'centre' /
"""

SQUARE = """&mesh generator = 'rectangle' lengths = 1, 1 divisions = 8, 8 distortion = DISTORTION /
""" + PLATE + """&support node_set = 'edge_x0', 'edge_y0' type = 'hinged' /
&support node_set = 'edge_x1' type = 'symmetry_x' /
&support node_set = 'edge_y1' type = 'symmetry_y' /
&load type = 'traction' vector = 0, 0, 1e-3 /
&step control = 'linear' /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_x1_y1' /
"""

HOLE = """&mesh file = 'hole.msh' /
&material name = 'm' law = 'linear_elastic' e = 1000 nu = 0.3 /
&section thickness = 0.1 /
&support node_set = 'all' fixed = 'uz', 'rx', 'ry' /
&support node_set = 'left' fixed = 'ux', 'rz' /
&support node_set = 'lower' fixed = 'uy', 'rz' /
&load type = 'line' edge_set = 'right' vector = 0.1, 0, 0 /
&step control = 'linear' /
&node_set name = 'middle' x = 3.999, 4.001 y = -0.001, 0.001 /
&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'middle' /
"""

TWIST = """&mesh generator = 'annulus' radii = 1, 1.5 angles = 0, 360 slit = .false. divisions = 48, 4 diagonal = 'forward' /
&material name = 'm' law = 'st_venant_kirchhoff' e = 1000 nu = 0.3 /
&section SECTION thickness = 0.1 /
&support node_set = 'all' fixed = 'uz' /
&support node_set = 'edge_outer' fixed = 'ux', 'uy' /
&support node_set = 'edge_inner' fixed = 'ux' uy = 1e-3 axes = 'cylindrical' axis = 0, 0, 1 /
&step /
&monitor name = 'energy' quantity = 'energy' /
"""

# name: title, input, levels of the meshes, of the reference
CASES = {
    "patch_membrane": ("Patch test, stretching", example("patch_membrane"), (0,), 1),
    "patch_bending": ("Patch test, bending", example("patch_bending"), (0,), 1),
    "hole": ("Sheet with a circular hole, stretched", HOLE, (0, 1, 2), 4),
    "cook": ("Cook's membrane", example("cook"), (-1, 0, 1), 4),
    "clamped_disk": ("Clamped disk, uniform load", CLAMPED_DISK, (-1, 0, 1), 3),
    "square_plate": ("Hinged square plate, uniform load", SQUARE.replace("DISTORTION", "0"), (-1, 0, 1), 4),
    "square_plate_irregular": ("The same, irregular mesh", SQUARE.replace("DISTORTION", "0.2"), (-1, 0, 1), 4),
    "scordelis_lo": ("Scordelis-Lo roof", example("scordelis_lo"), (-2, -1, 0, 1), 3),
    "hemisphere": ("Pinched hemisphere with hole", example("pinched_hemisphere_hole"), (-1, 0, 1), 3),
    "pinched_cylinder": ("Pinched cylinder", example("pinched_cylinder"), (-1, 0, 1), 3),
    "twisted_beam": ("Twisted beam, thin", example("twisted_beam_thin_y"), (-1, 0, 1), 3),
    "line_load": ("Cylinder under a line load, rubber, 2 kN", example(
        "cylinder_line_load", parts=(("&step load_levels = 0.058823529411764705, 0.17647058823529413, 0.5882352941176471 /",
                                      "&step load_factor = 0.058823529411764705 /"),)), (-2, -1, 0), 2),
    "rubber_disk": ("Rubber disk, 17 psi", example("rubber_disk/rubber_disk.nml", parts=(
        ("load_levels = 0.242857142857143, 0.714285714285714 ! 17 and 50 psi", "load_factor = 0.242857142857143"),
        ("rings = 19", "rings = 8"), ("core = 6", "core = 4"))), (-1, 0, 1), 3),
    "inflated_sphere": ("Inflated sphere, neo-Hookean, stretch 1.3", example("inflated_sphere/neo_hookean.nml", parts=(
        ("volumes = 696.9100, 904.7787, 1150.3465, 1436.7550, 1767.1459, 2806.1622,", "volumes = 696.9100, 904.7787, 1150.3465"),
        ("      4188.7902, 8181.2309, 14137.1669, 33510.3216, 65449.8469\n", ""), ("divisions = 24, 24", "divisions = 8, 8"))),
        (-1, 0, 1), 3),
    "twisted_annulus": ("Twisted annulus, taut membrane", TWIST.replace("SECTION", "type = 'membrane'"), (-1, 0, 1), 3),
    "wrinkled_annulus": ("Twisted annulus, wrinkled", TWIST.replace("SECTION", "type = 'membrane' wrinkling = .true."), (-1, 0, 1), 3),
}


def write_hole(file):
    """A quarter of the square |x|, |y| <= 4 with a hole of radius 1: 12 x 8 cells between hole and sides, wider outwards."""
    around, out = 12, 8
    nodes, number = [], {}
    for i in range(around + 1):
        a = 0.5 * math.pi * i / around
        c, s = math.cos(a), math.sin(a)
        far = 4 / max(c, s)
        for k in range(out + 1):
            r = 1 + (far - 1) * (k / out) ** 1.5
            number[i, k] = len(nodes) + 1
            nodes.append((r * c, r * s))
    triangles = []
    for i in range(around):
        for k in range(out):
            p, q, r, s = number[i, k], number[i, k + 1], number[i + 1, k + 1], number[i + 1, k]
            triangles += [(p, q, r), (p, r, s)] if (i + k) % 2 else [(p, q, s), (q, r, s)]
    lines = {1: [(number[around, k], number[around, k + 1]) for k in range(out)],
             2: [(number[0, k], number[0, k + 1]) for k in range(out)],
             3: [(number[i, out], number[i + 1, out]) for i in range(around // 2)]}
    blocks = [(2, 1, 2, triangles)] + [(1, tag, 1, ends) for tag, ends in lines.items()]
    count = sum(len(block[3]) for block in blocks)
    text = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", "4", '1 1 "left"', '1 2 "lower"', '1 3 "right"', '2 4 "sheet"',
            "$EndPhysicalNames", "$Entities", "0 3 1 0", *(f"{tag} 0 0 0 4 4 0 1 {tag} 0" for tag in lines), "1 0 0 0 4 4 0 1 4 0",
            "$EndEntities", "$Nodes", f"1 {len(nodes)} 1 {len(nodes)}", f"2 1 0 {len(nodes)}", *(str(i + 1) for i in range(len(nodes))),
            *(f"{x:.17g} {y:.17g} 0" for x, y in nodes), "$EndNodes", "$Elements", f"{len(blocks)} {count} 1 {count}"]
    tag = 0
    for dimension, entity, kind, members in blocks:
        text.append(f"{dimension} {entity} {kind} {len(members)}")
        for ends in members:
            tag += 1
            text.append(f"{tag} " + " ".join(map(str, ends)))
    file.write_text("\n".join([*text, "$EndElements", ""]))


def measure(program, folder, name):
    """A row for each mesh: numbers as bench_error prints them."""
    _, text, levels, reference = CASES[name]
    (folder / f"{name}.nml").write_text(text)
    for level in levels:
        run = subprocess.run([program, f"{name}.nml", str(level), str(reference)], cwd=folder, capture_output=True, text=True, check=False,
                             env={**os.environ, "OMP_NUM_THREADS": os.environ.get("OMP_NUM_THREADS", "1")})
        if run.returncode:
            sys.exit(f"{name}, level {level}: {run.stderr.strip()}")
        yield [None if x == "-" else float(x) for x in run.stdout.split()]


def put(text, mark, table):
    """The text with what stands between two marks replaced."""
    begin, end = BEGIN.format(mark), END.format(mark)
    head, rest = text.split(begin)
    return f"{head}{begin}\n{table}\n{end}{rest.split(end)[1]}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=ROOT / "build" / "release")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("cases", nargs="*", metavar="CASE")
    options = parser.parse_args()
    build = options.build.resolve()
    program = next((p for p in (build / "bin" / "bench_error", build.parent / "bin" / "bench_error") if p.exists()), None)
    if program is None:
        sys.exit(f"no program bench_error in {build}/bin: build it first (make build)")
    energy = ["| problem | elements | true error % | estimate % | effectivity | membrane | bending |", "| --- | --- | --- | --- | --- | --- | --- |"]
    goals = ["| problem | elements | true error % | estimate % | bound % |", "| --- | --- | --- | --- | --- |"]
    outside = []
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        write_hole(folder / "hole.msh")
        for name in options.cases or CASES:
            title = full = CASES[name][0]
            for row in measure(program, folder, name):
                elements, estimate, true, ratio, membrane, bending = row[:6]
                exact = true < 1e-8
                parts = [f"{x:.2f}" if x > 0 and not exact else "–" for x in (ratio, membrane, bending)]
                energy.append(f"| {title} | {elements:.0f} | {100 * true:.3g} | {100 * estimate:.3g} | " + " | ".join(parts) + " |")
                print(energy[-1], flush=True)
                if not exact and not 0.5 <= ratio <= 2:
                    outside.append(f"{full}, {elements:.0f} elements: {ratio:.2f}")
                if row[6] is not None and not exact:
                    value, off, change, bound = row[6:]
                    scale = 100 / abs(value + off)
                    goals.append(f"| {title} | {elements:.0f} | {scale * off:.3g} | {scale * change:.3g} | {scale * bound:.3g} |")
                    print("   monitor:", goals[-1], flush=True)
                title = ""
    print("outside of 0.5 to 2:", "; ".join(outside) or "none")
    if options.write:
        DOC.write_text(put(put(DOC.read_text(), "energy", "\n".join(energy)), "goals", "\n".join(goals)))


if __name__ == "__main__":
    main()
