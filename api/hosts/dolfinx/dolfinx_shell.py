"""DOLFINx with elements of finshell: its mesh and its partition, its numbering, the pattern of its matrix, SNES and MUMPS of PETSc.

    [mpiexec -n RANKS] python3 dolfinx_shell.py CASE.npz     a case of ../cases.py
"""
import sys
from pathlib import Path

import dolfinx
import dolfinx.fem.petsc
import numpy as np
import ufl
from mpi4py import MPI
from petsc4py import PETSc

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import cases  # noqa: E402

OPTIONS = {"snes_linesearch_type": "basic", "snes_rtol": 0, "snes_stol": 0, "snes_divergence_tolerance": -1, "snes_max_it": 30,
           "ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"}


class Equations:
    """What SNES asks for. Each rank has the elements of its part of the mesh."""

    def __init__(self, case):
        root = MPI.COMM_WORLD.rank == 0
        points, triangles = (case.points, case.triangles) if root else (np.zeros((0, 3)), np.zeros((0, 3), int))
        cell = ufl.Cell("triangle", geometric_dimension=3)
        surface = ufl.Mesh(ufl.VectorElement("Lagrange", cell, 1))
        mesh = dolfinx.mesh.create_mesh(MPI.COMM_WORLD, triangles.astype(np.int64), points, surface)
        space = dolfinx.fem.FunctionSpace(mesh, ufl.VectorElement("Lagrange", cell, 1, dim=6))
        own = mesh.topology.index_map(2).size_local
        self.nodes = space.dofmap.list.array.reshape(-1, 3)[:own]  # of the elements of this rank, in its numbering: blocks of six
        # the elements and nodes of the case that they are
        self.case, self.shell, self.factor = case, cases.Shell(case, np.array(mesh.topology.original_cell_index[:own])), 0.0
        self.node_of_case = np.zeros(space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, int)
        geometry = np.array(mesh.geometry.dofmap.array).reshape(-1, 3)
        self.node_of_case[space.dofmap.list.array] = np.array(mesh.geometry.input_global_indices)[geometry.ravel()]
        self.own = space.dofmap.index_map.size_local
        self.held = np.flatnonzero(case.held[self.node_of_case[:self.own]]).astype(np.int32)
        self.state = dolfinx.la.create_petsc_vector(space.dofmap.index_map, 6)
        form = ufl.inner(ufl.TrialFunction(space), ufl.TestFunction(space)) * ufl.dx
        self.matrix = dolfinx.fem.petsc.create_matrix(dolfinx.fem.form(form))

    def of_elements(self, x):
        """Residuals and tangents of the elements of this rank at a state."""
        x.copy(self.state)
        self.state.ghostUpdate(addv=PETSc.InsertMode.INSERT, mode=PETSc.ScatterMode.FORWARD)
        with self.state.localForm() as local:
            return self.shell.equations(local.array_r.reshape(-1, 6)[self.nodes], self.factor)

    def residual(self, _, x, result):
        """For SNES; where a freedom is held the equation is that it stays 0."""
        force, _ = self.of_elements(x)
        with result.localForm() as local:  # with the copies of nodes that belong to other ranks
            local.set(0.0)
            np.add.at(local.array_w.reshape(-1, 6), self.nodes.ravel(), force.reshape(-1, 6))
        result.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        result.array_w[:] -= self.factor * self.case.forces[self.node_of_case[:self.own]].ravel()
        result.array_w[self.held] = x.array_r[self.held]

    def tangent(self, _, x, matrix, __):
        """For SNES."""
        _, tangent = self.of_elements(x)
        matrix.zeroEntries()
        for nodes, values in zip(self.nodes, tangent):
            matrix.setValuesBlockedLocal(nodes, nodes, values, addv=PETSc.InsertMode.ADD)
        matrix.assemble()
        matrix.zeroRowsColumnsLocal(self.held)

    def displacement(self, x):
        """Displacements of all nodes of the case, on every rank."""
        found = np.zeros((len(self.case.points), 3))
        found[self.node_of_case[:self.own]] = x.array_r.reshape(-1, 6)[:, :3]
        return MPI.COMM_WORLD.allreduce(found)


def main():
    case = cases.load(sys.argv[1])
    first = MPI.COMM_WORLD.rank == 0
    equations = Equations(case)
    x, errors = equations.state.duplicate(), []
    snes = PETSc.SNES().create(MPI.COMM_WORLD)
    snes.setFunction(equations.residual, x.duplicate())
    snes.setJacobian(equations.tangent, equations.matrix)
    snes.setMonitor(lambda _, __, norm: errors.append(norm))
    options = PETSc.Options()
    for name, value in {**OPTIONS, "snes_atol": 1e-8 if case.pressure else 1e-6}.items():
        options[name] = value
    snes.setFromOptions()
    if first:
        print("DOLFINx", dolfinx.__version__, "PETSc", ".".join(map(str, PETSc.Sys.getVersion())), MPI.COMM_WORLD.size, "ranks")
    for factor in case.steps:
        equations.factor = factor
        errors.clear()
        snes.solve(None, x)
        if first:
            print(f"load factor {factor:.6f}: {snes.getIterationNumber()} iterations,", " ".join(f"{e:.1e}" for e in errors))
        if snes.getConvergedReason() <= 0:
            sys.exit(f"no convergence: reason {snes.getConvergedReason()}")
        displacement = equations.displacement(x)
        if first:
            cases.report(case, factor, displacement)


if __name__ == "__main__":
    main()
