"""NGSolve with elements of finshell: its mesh, numbering, sparse matrix, UMFPACK and Newton; the elements are ours.

    python ngsolve_shell.py CASE.npz     a case of ../cases.py
"""
import sys
from pathlib import Path

import netgen.meshing as netgen
import ngsolve
import numpy as np
from ngsolve.solvers import Newton

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import cases  # noqa: E402


def surface(points, triangles):
    """A mesh of NGSolve that is a surface in space."""
    mesh = netgen.Mesh(dim=3)
    numbers = [mesh.Add(netgen.MeshPoint(netgen.Pnt(*point))) for point in points]
    face = mesh.Add(netgen.FaceDescriptor(surfnr=1, domin=1, bc=1))
    for triangle in triangles:
        mesh.Add(netgen.Element2D(face, [numbers[node] for node in triangle]))
    return ngsolve.Mesh(mesh)


class Equations:
    """What NGSolve's Newton asks of a BilinearForm."""

    condense = False

    def __init__(self, case, space):
        self.case, self.shell, self.factor = case, cases.Shell(case), 0.0
        # of an element: 18 numbers, component by component; ours are node by node
        self.dofs = np.array([space.GetDofNrs(ngsolve.ElementId(ngsolve.BND, e)) for e in range(len(case.triangles))])
        self.dofs = self.dofs.reshape(-1, 6, 3).transpose(0, 2, 1).reshape(-1, 18)
        self.of_node = np.zeros((len(case.points), 6), int)
        self.of_node[case.triangles.ravel()] = self.dofs.reshape(-1, 6)
        self.rows, self.columns = np.repeat(self.dofs, 18, axis=1).ravel(), np.tile(self.dofs, (1, 18)).ravel()

    def AssembleLinearization(self, vector):
        """The matrix at a state; the residual comes with it."""
        x = vector.FV().NumPy()
        force, tangent = self.shell.equations(x[self.dofs].reshape(-1, 3, 6), self.factor)
        self.residual = np.bincount(self.dofs.ravel(), force.ravel(), len(x))
        self.residual[self.of_node] -= self.factor * self.case.forces
        triplets = self.rows.tolist(), self.columns.tolist(), tangent.ravel().tolist()
        self.mat = ngsolve.la.SparseMatrixd.CreateFromCOO(*triplets, len(x), len(x))

    def Apply(self, _, result):
        """The residual; Newton has called AssembleLinearization at the same state."""
        result.FV().NumPy()[:] = self.residual


def main():
    case = cases.load(sys.argv[1])
    print("NGSolve", ngsolve.__version__, flush=True)
    scalar = ngsolve.H1(surface(case.points, case.triangles), order=1)
    space = ngsolve.FESpace([scalar] * 6)
    equations, state, free = Equations(case, space), ngsolve.GridFunction(space), ngsolve.BitArray(space.ndof)
    free.Set()
    for dof in equations.of_node[case.held]:
        free.Clear(int(dof))
    for factor in case.steps:
        equations.factor, errors = factor, []
        failed, iterations = Newton(equations, state, freedofs=free, inverse="umfpack", maxerr=1e-8, maxit=30, printing=False,
                                    callback=lambda _, error: errors.append(error))
        print(f"load factor {factor:.6f}: {iterations} iterations,", " ".join(f"{e:.1e}" for e in errors))
        if failed:
            sys.exit("no convergence")
        cases.report(case, factor, state.vec.FV().NumPy()[equations.of_node[:, :3]])


if __name__ == "__main__":
    main()
