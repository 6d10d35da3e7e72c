#!/usr/bin/env python3
"""Inputs changed at random, namelists and meshes: refused with a sentence or taken, never a crash, a hang or a Fortran error message.

FINSHELL_FUZZ inputs (200; `make test-extremes`: more), FINSHELL_FUZZ_SEED. Seeds are the examples, the meshes of test/data and what
once failed (corpus/, which is also run as it is). A failure prints the seed and writes the input to where it says.
"""
import os
import random
import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM = os.environ["FINSHELL_BIN"]
SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
HERE = SOURCE / "test" / "fuzz"
COUNT = int(os.environ.get("FINSHELL_FUZZ", "200"))
SEED = int(os.environ.get("FINSHELL_FUZZ_SEED", "2026"))
SECONDS, BYTES = 60, 4 * 1024**3
NUMBERS = ["0", "-1", "1", "2", "-0.0", "1e308", "-1e308", "1e-320", "1e400", "NaN", "Infinity", "2147483647", "2147483648", "-2147483648", "9" * 40,
           "1e", "1.5", "0.1d3", "+3", "1_8", "0x10", "3*1.0", "1e-9", "1e12"]
STRINGS = ["''", "'all'", "'rim'", "'x'", "'clamped'", "'linear'", "'arc_length'", "'buckling'", "'S'", "'" + "a" * 300 + "'", "'\u00e4'", "'../x'", "'a''b'", "\"", "'"]
BYTES_IN = [0, 9, 10, 13, 33, 38, 39, 44, 47, 61, 127, 200, 255]
ENDS = {0: 0, 1: 0, 2: 0}  # runs and checks by exit code
CRASH = re.compile(rb"Backtrace|SIGSEGV|SIGABRT|SIGFPE|Fortran runtime error|glibc|corrupted|AddressSanitizer|runtime error:")


def limits():
    if "ASAN_OPTIONS" not in os.environ:  # the sanitizer reserves terabytes
        resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))


def changed_namelist(text, others, chance):
    """A text with one to three changes."""
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        numbers = list(re.finditer(r"(?<![\w'.])[-+]?\d[\d.]*(?:[ed][-+]?\d+)?", text))
        strings = list(re.finditer(r"'[^'\n]*'", text))
        groups = re.findall(r"&[^/]*/", text)
        kind = chance.randrange(9)
        if kind <= 1 and numbers:
            m = chance.choice(numbers)
            text = text[:m.start()] + chance.choice(NUMBERS) + text[m.end():]
        elif kind == 2 and strings:
            m = chance.choice(strings)
            text = text[:m.start()] + chance.choice(STRINGS + [s.group() for s in strings]) + text[m.end():]
        elif kind == 3 and groups:
            text = text.replace(chance.choice(groups), "", 1)
        elif kind == 4:
            more = re.findall(r"&[^/]*/", chance.choice(others))
            if more:
                text += chance.choice(more) + "\n"
        elif kind == 5:
            i, j = sorted(chance.randrange(len(text) + 1) for _ in range(2))
            text = text[:i] + text[min(j, i + 40):]
        elif kind == 6:
            i = chance.randrange(len(text) + 1)
            text = text[:i] + chr(chance.choice(BYTES_IN)) + text[i:]
        elif kind == 7:
            words = list(re.finditer(r"\b[a-z_]+\b", text))
            if words:
                a, b = chance.choice(words), chance.choice(words)
                text = text[:a.start()] + b.group() + text[a.end():]
        else:
            text = text[:chance.randrange(len(text) + 1)]
    return text


def changed_mesh(data, chance):
    data = bytearray(data)
    for _ in range(chance.choice((1, 1, 2, 3))):
        kind = chance.randrange(5)
        if not data:
            break
        i = chance.randrange(len(data))
        if kind == 0:
            data[i] = chance.choice(BYTES_IN)
        elif kind == 1:
            del data[i:i + chance.randrange(1, 60)]
        elif kind == 2:
            data = data[:i]
        elif kind == 3:
            j = chance.randrange(len(data))
            data[i:i] = data[j:j + chance.randrange(1, 80)]
        else:
            numbers = list(re.finditer(rb"[-+.\deE]+", bytes(data)))
            if numbers:
                m = chance.choice(numbers)
                data[m.start():m.end()] = chance.choice(NUMBERS).encode()
    return bytes(data)


def small(text):
    """Examples with fewer cells: what is run, not only checked."""
    return re.sub(r"divisions\s*=\s*\d+\s*,\s*\d+", "divisions = 4, 4", re.sub(r"rings\s*=\s*\d+", "rings = 3", re.sub(r"core\s*=\s*\d+", "core = 2", text)))


def complaint(folder, command):
    """What is wrong with how the program ends; empty: nothing."""
    try:
        done = subprocess.run([PROGRAM, command, "model.nml"], cwd=folder, capture_output=True, check=False, timeout=SECONDS, preexec_fn=limits,
                              env={**os.environ, "OMP_NUM_THREADS": "1"})
    except subprocess.TimeoutExpired:
        return "" if command == "run" else f"{command}: not done after {SECONDS} s"
    if done.returncode not in (0, 1, 2):
        return f"{command}: exit code {done.returncode}: {done.stderr[-300:]!r}"
    ENDS[done.returncode] += 1
    if CRASH.search(done.stderr + done.stdout):
        return f"{command}: {done.stderr[-300:]!r}"
    if done.returncode and not done.stderr.startswith(b"finshell: "):
        return f"{command}: exit code {done.returncode} without a sentence: {done.stderr[-300:]!r}"
    for history in Path(folder).glob("*.history.csv"):
        rows = history.read_text().splitlines()
        if any(re.search(r"nan|inf", row.split(",")[1], re.IGNORECASE) for row in rows[1:]):
            return f"{command}: NaN in the history"
    return ""


def main():
    texts = [small(p.read_text()) for p in sorted(SOURCE.glob("examples/*/*.nml"))]
    meshes = [p.read_bytes() for p in sorted(SOURCE.glob("test/data/*.msh"))]
    base = "&mesh file = 'mesh.msh' /\n&material name = 'm' law = 'neo_hookean' mu = 1.0 /\n&section thickness = 0.1 /\n" \
        "&support node_set = 'all' type = 'clamped' /\n&step control = 'linear' /\n"
    inputs = []
    for path in sorted((HERE / "corpus").iterdir()):
        is_mesh = path.suffix == ".msh"
        inputs.append((path.name, base if is_mesh else path.read_text(), path.read_bytes() if is_mesh else None))
        (meshes if is_mesh else texts).append(path.read_bytes() if is_mesh else path.read_text())
    chance = random.Random(SEED)
    for i in range(COUNT):
        if i % 3 == 2:
            inputs.append((f"{SEED}.{i}", base, changed_mesh(chance.choice(meshes), chance)))
        else:
            inputs.append((f"{SEED}.{i}", changed_namelist(chance.choice(texts), texts, chance), None))
    failures = []
    for number, (name, text, mesh) in enumerate(inputs):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "model.nml").write_text(text, encoding="utf-8", errors="surrogateescape")
            if mesh is not None:
                (Path(folder) / "mesh.msh").write_bytes(mesh)
            wrong = complaint(folder, "check") or (complaint(folder, "run") if number % 2 == 0 else "")
        if wrong:
            kept = Path(tempfile.gettempdir()) / f"finshell_fuzz_{name}"
            kept.write_bytes(text.encode(errors="surrogateescape") if mesh is None else mesh)
            failures.append(f"{name}: {wrong}; input: {kept}")
    print(f"{len(inputs)} inputs, seed {SEED}; done, ended, refused: {ENDS}")
    if min(ENDS[0], ENDS[2]) < len(inputs) // 20:
        failures.append("too few inputs are taken, or too few refused: nothing is tried")
    if failures:
        sys.exit("\n".join(failures))


main()
