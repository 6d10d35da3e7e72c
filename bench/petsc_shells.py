"""What bench/petsc_iterations.py runs on one or more processes: a mesh in parts, its tangent for PETSc, and one solution, measured.

    mpirun ... petsc_shells.py '{"folder": ..., "problem": "sphere", "divisions": 40, "slenderness": 250, "method": ..., "compression": 0,
                                 "options": "words for PETSc"}'
"""
import ctypes
import glob
import json
import os
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "api/python"))
sys.path += sorted(glob.glob("/usr/lib/petscdir/petsc*/*-real/lib/python3/dist-packages"))[-1:]  # where Debian has it
os.environ.setdefault("FINSHELL_LIB", str(ROOT / "build/lib/libfinshell.so"))
try:
    import numpy as np
    import petsc4py
    from mpi4py import MPI
    from scipy.sparse import csr_matrix, diags
    import finshell
except ImportError as missing:
    sys.exit(f"bench/petsc_iterations.py needs {missing.name}, which {sys.executable} does not have; on Debian: apt-get install "
             "python3-petsc4py-real python3-mpi4py python3-scipy openmpi-bin gcc, and call it by /usr/bin/python3")

TOLERANCE, MOST = 1e-10, 1000


def sphere(n, slenderness):
    """The quarter of a hemisphere with a hole of bench/linear.py: points, triangles, what is held, section, normals."""
    i, j = np.divmod(np.arange((n + 1) ** 2), n + 1)
    azimuth, colatitude = np.radians(90 * i / n), np.radians(90 - 72 * j / n)
    x = 10 * np.stack([np.sin(colatitude) * np.cos(azimuth), np.sin(colatitude) * np.sin(azimuth), np.cos(colatitude)], 1)
    at = np.flatnonzero((i < n) & (j < n))
    triangles = np.concatenate([np.stack([at, at + n + 1, at + n + 2], 1), np.stack([at, at + n + 2, at + 1], 1)])
    held = np.zeros((len(x), 6), bool)
    held[i == 0] |= np.array([0, 1, 0, 1, 0, 1], bool)  # planes of symmetry
    held[i == n] |= np.array([1, 0, 0, 0, 1, 1], bool)
    held[0, 2] = True
    return x, triangles, held, finshell.Section("linear_elastic", {"e": 6.825e7, "nu": 0.3}, 10 / slenderness), x[triangles]


def disk(n, slenderness):
    """The quarter of a hinged disk of bench/linear.py, R / t of choice."""
    k = np.concatenate([np.full(2 * ring + 1, ring) for ring in range(n + 1)])  # ring and number round it of each node
    j = np.concatenate([np.arange(2 * ring + 1) for ring in range(n + 1)])
    angle = np.pi / 2 * j / np.maximum(2 * k, 1)
    x = 7.5 / n * np.stack([k * np.cos(angle), k * np.sin(angle), 0 * angle], 1)
    triangles = []
    for ring in range(1, n + 1):
        for s in range(2):
            inner, outer, c = (ring - 1) ** 2 + s * (ring - 1), ring ** 2 + s * ring, np.arange(ring)
            triangles += [np.stack([inner + c, outer + c, outer + c + 1], 1), np.stack([inner + c, outer + c + 1, inner + c + 1], 1)[:-1]]
    held = np.zeros((len(x), 6), bool)
    held[k == n, :3] = True
    held[(j == 0) | (k == 0)] |= np.array([0, 1, 0, 1, 0, 1], bool)
    held[(j == 2 * k) | (k == 0)] |= np.array([1, 0, 0, 0, 1, 1], bool)
    return x, np.concatenate(triangles), held, finshell.Section("mooney_rivlin", {"c10": 80.0, "c01": 20.0}, 7.5 / slenderness), None


def bisect(points, parts):
    """The part of each point: recursive coordinate bisection across the longest side."""
    part = np.zeros(len(points), int)
    if parts > 1:
        longest = np.argmax(np.ptp(points, axis=0))
        order = np.argsort(points[:, longest], kind="stable")
        halves = np.split(order, [len(order) * (parts // 2) // parts])
        part[halves[0]] = bisect(points[halves[0]], parts // 2)
        part[halves[1]] = parts // 2 + bisect(points[halves[1]], parts - parts // 2)
    return part


def subdomain_matrix(mine, nodes, problem, compression):
    """Tangent of the triangles `mine` at their `nodes`, six rows each; a held freedom has a diagonal entry alone."""
    x, triangles, held, section, normals = problem
    x, held = x[nodes], held[nodes].ravel()
    u = -compression * section.layers[0].thickness / np.linalg.norm(x, axis=1).max() * x
    k = finshell.Assembly(np.searchsorted(nodes, triangles[mine]), section).evaluate(
        x, u, 0 * x, normals=None if normals is None else normals[mine]).matrix
    modes = rigid_modes(x + u)
    if compression == 0 and abs(k @ modes).max() > TOLERANCE * (abs(k) @ abs(modes)).max():
        sys.exit("rigid motions bring forces: these are not the modes of this tangent")
    free = diags(1.0 - held)
    return csr_matrix(free @ k @ free + diags(held * k.diagonal().max()))


def rigid_modes(x):
    """Three translations and three rotations by the six freedoms of points x: (6 nodes, 6)."""
    modes = np.zeros((len(x), 6, 6))
    for axis in range(3):
        spin = np.eye(3)[axis]
        modes[:, axis, axis] = 1
        modes[:, :3, 3 + axis], modes[:, 3 + axis, 3 + axis] = np.cross(spin, x), 1
    return modes.reshape(-1, 6)


class Divided:
    """A mesh in parts, one for each process, numbered so that each process owns the nodes of its part."""

    def __init__(self, comm, problem):
        x, triangles = problem[:2]
        part = bisect(x[triangles].mean(axis=1), comm.size)
        self.comm, self.problem, self.mine = comm, problem, np.flatnonzero(part == comm.rank)
        owner, number = np.full(len(x), comm.size), np.empty(len(x), np.int32)
        np.minimum.at(owner, triangles, part[:, None])
        order = np.argsort(owner, kind="stable")
        number[order] = np.arange(len(x))
        self.nodes, self.owned = np.unique(triangles[self.mine]), order[owner[order] == comm.rank]
        # One unknown at a time: of blocks BDDC would make six fields, each with constraints and eigenproblems of its own.
        rows = 6 * number[self.nodes][:, None] + np.arange(6, dtype=np.int32)
        self.rows = PETSc.LGMap().create(rows.ravel(), comm=comm)

    def matrix(self, compression, whole):
        """The tangent, assembled over the processes or (whole = False) left to them."""
        k = subdomain_matrix(self.mine, self.nodes, self.problem, compression)
        a = PETSc.Mat().create(self.comm)
        a.setSizes([(6 * len(self.owned), 6 * len(self.problem[0]))] * 2)
        a.setType("is")
        a.setLGMap(self.rows, self.rows)
        a.setISLocalMat(PETSc.Mat().createAIJ(k.shape, csr=(k.indptr, k.indices, k.data), comm=MPI.COMM_SELF))
        a.assemble()
        if whole:
            a = a.convert("aij", PETSc.Mat())
            a.setBlockSize(6)
        a.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        a.setOption(PETSc.Mat.Option.SPD, compression == 0)
        modes = []
        for mode in rigid_modes(self.problem[0][self.owned] - self.problem[0].mean(axis=0)).T:
            modes.append(self.vector(mode))
            for w in modes[:-1]:
                modes[-1].axpy(-modes[-1].dot(w), w)
            modes[-1].normalize()
        a.setNearNullSpace(PETSc.NullSpace().create(vectors=modes, comm=self.comm))
        return a

    def vector(self, values):
        """A vector of the values at the owned nodes."""
        return PETSc.Vec().createWithArray(np.array(values).ravel(), comm=self.comm)

    def solver(self, method, compression):
        """CG, which looks at the energy of the error, or GMRES; what PETSc is told comes last."""
        a = self.matrix(compression, "BDDC" not in method)
        ksp = PETSc.KSP().create(self.comm)
        ksp.setOperators(a, self.matrix(0, False) if "unloaded" in method else a)
        ksp.setTolerances(rtol=TOLERANCE, atol=0, max_it=MOST)
        ksp.setType("gmres" if compression else "cg")
        ksp.setNormType(PETSc.KSP.NormType.PRECONDITIONED if compression else PETSc.KSP.NormType.NATURAL)
        ksp.setGMRESRestart(300)
        ksp.setConvergenceHistory(MOST + 1)
        if "BDDC" in method:
            held = np.flatnonzero(self.problem[2][self.nodes]).astype(np.int32)
            ksp.pc.setType("bddc")
            ksp.pc.setBDDCDirichletBoundariesLocal(PETSc.IS().createGeneral(held, comm=MPI.COMM_SELF))
        ksp.setFromOptions()
        return ksp


def warm_up(comm):
    """Libraries, their buffers and those of messages are there before memory is measured."""
    ones = np.arange(51, dtype=np.int32)
    pc = PETSc.PC().create(MPI.COMM_SELF)
    pc.setOperators(PETSc.Mat().createAIJ((50, 50), csr=(ones, ones[:-1], np.ones(50)), comm=MPI.COMM_SELF))
    pc.setType("cholesky")
    pc.setFactorSolverType("mumps")
    pc.setUp()
    comm.alltoall([bytes(1000)] * comm.size)


def memory():
    """Megabytes of this process: its own now, and the most it had since this was asked."""
    ctypes.CDLL(None).malloc_trim(0)
    lines = dict(line.split(":") for line in Path("/proc/self/status").read_text().splitlines())
    now, resident, most = (float(lines[name].split()[0]) / 1024 for name in ("RssAnon", "VmRSS", "VmHWM"))
    Path("/proc/self/clear_refs").write_text("5")
    return np.array([now, now + most - resident])


def measured(comm, call):
    """Seconds of CPU time without waiting, megabytes kept, most megabytes: summed over the processes; the most of one process."""
    waited = ctypes.CDLL(None).waited
    waited.restype = ctypes.c_double
    before, start = memory(), time.process_time() - waited()
    call()
    seconds, after = time.process_time() - waited() - start, memory()
    values = np.array([seconds, *(after - before[0])])
    return [*comm.allreduce(values), comm.allreduce(values[2], MPI.MAX)]


def solve(folder, problem, divisions, slenderness, method, compression):
    """One solution. Files in the folder: found.json, view (what PETSc says of it), METHOD.npy (displacements)."""
    comm, problem = MPI.COMM_WORLD, PROBLEMS[problem](divisions, slenderness)
    divided, held = Divided(comm, problem), problem[2]
    warm_up(comm)
    ksp, right = divided.solver(method, compression), np.sin(1 + np.arange(held.size)).reshape(-1, 6) * ~held
    b, y = divided.vector(right[divided.owned]), divided.vector(0 * right[divided.owned])
    measures = measured(comm, ksp.setUp), measured(comm, lambda: ksp.solve(b, y))
    ksp.view(PETSc.Viewer().createASCII(f"{folder}/view", comm=comm))
    parts = comm.gather((divided.owned, y.getArray().reshape(-1, 6)[:, :3]))
    if comm.rank == 0:
        u = np.empty((len(held), 3))
        for nodes, values in parts:
            u[nodes] = values
        np.save(f"{folder}/{method}", u)
        history = ksp.getConvergenceHistory()
        Path(folder, "found.json").write_text(json.dumps({
            "unknowns": int((~held).sum()), "iterations": ksp.getIterationNumber(), "converged": ksp.getConvergedReason() > 0,
            "reached": float(history[-1] / history[0]) if len(history) else 0.0, "measures": measures}))


PROBLEMS = {"sphere": sphere, "disk": disk}

if __name__ == "__main__":
    given = json.loads(sys.argv[1])
    petsc4py.init(given.pop("options").split())
    from petsc4py import PETSc
    solve(**given)
