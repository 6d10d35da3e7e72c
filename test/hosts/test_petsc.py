"""The PETSc example on two ranks with MUMPS: cantilever and hemisphere agree with the driver."""
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

EXAMPLE = Path(os.environ["FINSHELL_SOURCE_DIR"]) / "examples/petsc"
BINARY = Path(os.environ["FINSHELL_BINARY_DIR"])
SKIPPED = 77
TOLERANCE = 1e-6


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(SKIPPED)


for tool in ("pkg-config", "mpifort", "mpiexec"):
    if not shutil.which(tool):
        skip(f"there is no {tool}")
if subprocess.run(["pkg-config", "--exists", "PETSc"]).returncode != 0:
    skip("PETSc is not there (Debian: libpetsc-real-dev)")
if "FINSHELL_BIN" not in os.environ:
    skip("the driver was not built")
try:
    import numpy as np

    import host_cases
except ImportError as missing:
    skip(missing)


def build(folder):
    """As README.md says, but against the build folder. The modules must be of the compiler that mpifort calls."""
    petsc = subprocess.run(["pkg-config", "--cflags", "--libs", "PETSc"], capture_output=True, text=True, check=True).stdout
    archive = Path(os.environ["FINSHELL_LIB"]).with_suffix(".a")
    program = folder / "shell_snes"
    done = subprocess.run(["mpifort", "-O2", "-ffree-line-length-none", f"-J{folder}", f"-I{BINARY}/modules",
                           EXAMPLE / "shell_snes.F90", "-o", program, archive, "-fopenmp", *petsc.split()],
                          capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"the example does not compile:\n{done.stdout}{done.stderr}")
    return program


def check(program, folder, name, increments, ranks):
    case = host_cases.solve(name, folder)
    output = folder / f"{name}.{ranks}.out"
    environment = dict(os.environ, OMP_NUM_THREADS="1", OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                       OMPI_MCA_rmaps_base_oversubscribe="1")
    done = subprocess.run(["mpiexec", "-n", str(ranks), program, EXAMPLE / f"{name}.txt", output, "-increments",
                           str(increments), "-snes_monitor"], env=environment, capture_output=True, text=True, timeout=300)
    if done.returncode != 0 or not output.exists():
        return [f"{name}: the example failed:\n{done.stdout[-3000:]}{done.stderr[-3000:]}"]
    points = np.loadtxt(EXAMPLE / f"{name}.txt", skiprows=2, max_rows=len(case.points))
    values = np.loadtxt(output)
    error = case.error(values[:, :3])
    turned = np.abs(values[:, 3:] - case.rotation).max()
    last = done.stdout.strip().splitlines()[-1]
    print(f"{name}: {last}, difference from the driver {error:.1e}, rotations {turned:.1e}")
    if "-v" in sys.argv:
        print(done.stdout)
    failures = []
    if not np.abs(points - case.points).max() < 1e-12:
        failures.append(f"{name}: the mesh of the example is not that of the driver")
    if not error < TOLERANCE:
        failures.append(f"{name}: the displacements differ by {error:.1e} of the largest, expected {TOLERANCE:.0e}")
    if not turned < TOLERANCE:
        failures.append(f"{name}: the rotations differ by {turned:.1e}, expected {TOLERANCE:.0e}")
    if f"on {ranks} ranks" not in last:
        failures.append(f"{name}: did not run on {ranks} ranks: {last}")
    return failures


def main():
    failures = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = build(folder)
        failures += check(program, folder, "cantilever", 10, 2)
        failures += check(program, folder, "hemisphere", 20, 2)
        failures += check(program, folder, "hemisphere", 20, 3)
    for failure in failures:
        print("FAILED", failure)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
