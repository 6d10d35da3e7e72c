#!/usr/bin/env python3
"""Iterative solvers of PETSc for tangents of thin shells: BDDC, algebraic multigrid, and a factor of the whole for comparison.

    bench/petsc_iterations.py [--problem sphere|disk] [--divisions 40,129] [--slenderness 250,2500,25000] [--subdomains 4,16,64]
                              [--methods "NAME;..."] [--compression C] [--seconds S] [--options "words for PETSc"]

A row for each solution to 1e-10: iterations, size of the coarse problem, seconds of CPU time of set-up and iteration and the memory
they take, summed over all processes, and how far the largest displacement is from that by the factor (which has its own error).
A subdomain is a process, and there may be many more of them than cores: processes that wait are put to sleep and not counted.
--compression: the tangent of a shell all of whose points have gone C thicknesses to the origin; indefinite if C is large enough.

Debian: apt-get install python3-petsc4py-real python3-mpi4py python3-scipy openmpi-bin gcc, then /usr/bin/python3
bench/petsc_iterations.py. FINSHELL_LIB: the library, default build/lib/libfinshell.so.
"""
import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import petsc_shells  # says what is missing
import numpy as np

FACTOR = "-{0}pc_type cholesky -{0}pc_factor_mat_solver_type mumps "
# What the neighbours of an edge share is one constraint for each rigid mode; nodes where more than two meet are held.
AVERAGES = ("-pc_type bddc -pc_bddc_vertex_size 6 -pc_bddc_use_edges -pc_bddc_use_faces -pc_bddc_coarse_pc_type telescope "
            "-pc_bddc_coarse_pc_telescope_reduction_factor {processes} "
            + "".join(FACTOR.format(f"pc_bddc_{part}_") for part in ("dirichlet", "neumann", "coarse_telescope")))
DELUXE = AVERAGES + "-pc_bddc_use_deluxe_scaling -sub_schurs_mat_solver_type mumps "
ADAPTIVE = DELUXE + "-pc_bddc_adaptive_threshold "
METHODS = {  # BDDC takes a process for each subdomain, the others have one
    "factor": "-ksp_type preonly " + FACTOR.format(""),
    "factor in another order": "-mat_mumps_icntl_7 0 -ksp_type preonly " + FACTOR.format(""),
    "BDDC averages": AVERAGES,
    "BDDC deluxe": DELUXE,
    "BDDC adaptive 10": ADAPTIVE + "10",
    "BDDC adaptive 2": ADAPTIVE + "2",
    "GAMG": "-pc_type gamg",
    "GAMG with SOR": "-pc_type gamg -pc_gamg_threshold 0.02 -mg_levels_pc_type sor -mg_levels_ksp_max_it 4",
    "hypre": "-pc_type hypre",
    "ML": "-pc_type ml",
    "BDDC deluxe, indefinite": DELUXE + "-sub_schurs_posdef 0",
    "BDDC adaptive 2, unloaded": ADAPTIVE + "2",  # of the definite tangent without compression
}
# Open MPI polls while it waits. With this it sleeps, and says how much time polling and sleeping took all the same.
NAP = """
#include <time.h>
static double waiting, last;
static double cpu(void) { struct timespec t; clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t); return t.tv_sec + 1e-9 * t.tv_nsec; }
double waited(void) { return waiting; }
int sched_yield(void)
{
   struct timespec nap = {0, 50000};
   double now = cpu(), polled = now - last;
   nanosleep(&nap, 0);
   last = cpu();
   waiting += last - now + (polled < 3e-5 ? polled : 0);
   return 0;
}
"""


def row(folder, options, method, processes, n, slenderness):
    """A row of the table."""
    asked = {"folder": folder, "problem": options.problem, "divisions": int(n), "slenderness": float(slenderness), "method": method,
             "compression": options.compression, "options": f"{METHODS[method].format(processes=processes)} {options.options}"}
    command = ["timeout", options.seconds, "mpirun", "-x", f"LD_PRELOAD={folder}/nap.so", "-n", str(processes),
               sys.executable, petsc_shells.__file__, json.dumps(asked)]
    settings = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
                "OMPI_MCA_rmaps_base_oversubscribe": "1", "OMPI_MCA_hwloc_base_binding_policy": "none", "OMPI_MCA_mpi_yield_when_idle": "1"}
    name = f"| {options.problem} | {slenderness} | {method} | {processes} |"
    run = subprocess.run(command, env={**os.environ, **settings}, check=False, capture_output=True, text=True)
    if run.returncode:
        where = re.findall(r"\[\d+\] (\w+)\(\) at", run.stderr)  # PETSc's calls, the innermost last
        why = f"stops in {where[-1]}" if where else " ".join(run.stderr.split())[:300]
        return f"{name} " + (f"no result in {options.seconds} s of the clock" if run.returncode == 124 else why)
    found, view = json.loads(Path(folder, "found.json").read_text()), Path(folder, "view").read_text()
    coarse = re.search(r"interface (\d+) coarse (\d+)", view)
    negative = re.search(r"INFOG\(12\).*: (\d+)", view) if options.compression and "factor" in method else None
    note = f"{coarse[2]} of {coarse[1]}" if coarse else f"{negative[1]} negative pivots" if negative else ""
    stopped = "" if found["converged"] else f", to {found['reached']:.0e}"
    u, exact = np.load(f"{folder}/{method}.npy"), np.load(f"{folder}/factor.npy")
    (setup, kept, most, largest), (solution, more, *_) = found["measures"]
    return (f"{name} {found['unknowns']} | {found['iterations']}{stopped} | {note} | {setup:.2f} | {solution:.2f} | {kept + more:.0f} | "
            f"{most:.0f} | {largest:.0f} | {abs(u - exact).max() / abs(exact).max():.0e} |")


def table(options):
    """All rows; the factor comes first in each problem."""
    absent = [name for name in ("mpirun", "cc", os.environ["FINSHELL_LIB"]) if not shutil.which(name) and not Path(name).is_file()]
    if absent:
        sys.exit(f"petsc_iterations.py needs {' and '.join(absent)}: apt-get install openmpi-bin gcc; make build; or FINSHELL_LIB for the library")
    unknown = [name for name in options.methods.split(";") if name not in METHODS]
    if unknown:
        sys.exit(f"--methods: {'; '.join(unknown)} not known; known are: {'; '.join(METHODS)}")
    print("| problem | R / t | method | processes | unknowns | iterations | coarse, of the interface | set-up, s | solution, s | MB kept | MB most "
          "| largest process | difference |\n|" + "---|" * 13)
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "nap.c").write_text(NAP)
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", f"{folder}/nap.so", f"{folder}/nap.c"], check=True)
        for n in options.divisions.split(","):
            for slenderness in options.slenderness.split(","):
                for method in dict.fromkeys(["factor", *options.methods.split(";")]):
                    for processes in map(int, options.subdomains.split(",") if "BDDC" in method else "1"):
                        print(row(folder, options, method, processes, n, slenderness), flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problem", default="sphere", choices=petsc_shells.PROBLEMS)
    for word, default in (("divisions", "40,129"), ("slenderness", "250,2500,25000"), ("subdomains", "4,16,64"), ("seconds", "600"),
                          ("methods", ";".join(name for name in METHODS if "," not in name)), ("options", "")):
        parser.add_argument(f"--{word}", default=default)
    parser.add_argument("--compression", type=float, default=0.0)
    table(parser.parse_args())
