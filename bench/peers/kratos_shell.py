"""Kratos Multiphysics: thin (ANDES membrane, DKT plate) and thick triangles, corotational. kratos_shell.py CASE N kratos_thin|kratos_thick CPU_LIMIT [STEPS]"""
import sys
import time

import KratosMultiphysics as KM
import KratosMultiphysics.LinearSolversApplication as LS
import KratosMultiphysics.StructuralMechanicsApplication as SM
import numpy as np
from cases import Grid
from outcome import Stepper, report

KM.Logger.GetDefaultOutput().SetSeverity(KM.Logger.Severity.WARNING)
imported = time.process_time()
name, n, peer, limit = sys.argv[1], int(sys.argv[2]), sys.argv[3], float(sys.argv[4])
grid = Grid(name, n)
p = grid.problem
steps = int(sys.argv[5]) if len(sys.argv) > 5 else p.steps
model = KM.Model()
part = model.CreateModelPart("shell")
part.SetBufferSize(2)
for variable in (KM.DISPLACEMENT, KM.ROTATION, KM.REACTION, KM.REACTION_MOMENT, KM.VOLUME_ACCELERATION, SM.POINT_LOAD, SM.POINT_MOMENT):
    part.AddNodalSolutionStepVariable(variable)
properties = part.GetProperties()[1]
for variable, value in ((KM.YOUNG_MODULUS, p.e), (KM.POISSON_RATIO, p.nu), (KM.THICKNESS, p.h), (KM.DENSITY, 1.0)):
    properties.SetValue(variable, value)
properties.SetValue(KM.CONSTITUTIVE_LAW, SM.LinearElasticPlaneStress2DLaw())
for k, x in enumerate(grid.x):
    part.CreateNewNode(k + 1, *map(float, x))
DOFS = [KM.DISPLACEMENT_X, KM.DISPLACEMENT_Y, KM.DISPLACEMENT_Z, KM.ROTATION_X, KM.ROTATION_Y, KM.ROTATION_Z]
REACTIONS = [KM.REACTION_X, KM.REACTION_Y, KM.REACTION_Z, KM.REACTION_MOMENT_X, KM.REACTION_MOMENT_Y, KM.REACTION_MOMENT_Z]
for dof, reaction in zip(DOFS, REACTIONS):
    KM.VariableUtils().AddDof(dof, reaction, part)
kind = "ShellThinElementCorotational3D3N" if peer == "kratos_thin" else "ShellThickElementCorotational3D3N"
for k, nodes in enumerate(grid.elements):
    part.CreateNewElement(kind, k + 1, [i + 1 for i in nodes], properties)
for k, dofs in grid.fix.items():
    for dof in dofs:
        part.Nodes[k + 1].Fix(DOFS[dof])
loads = []
if p.control:
    place, control_dof, end = p.control
    driven = part.Nodes[grid.node(place) + 1]
    driven.Fix(DOFS[control_dof])
else:
    for k, f in grid.load.items():
        part.CreateNewCondition("PointLoadCondition3D1N", k + 1, [k + 1], properties)
        loads.append((part.Nodes[k + 1], f[:3]))
scheme = KM.ResidualBasedIncrementalUpdateStaticScheme()
# A prescribed displacement leaves no residual to compare with.
criterion = KM.DisplacementCriteria(1e-5, 1e-12) if p.control else KM.ResidualCriteria(1e-5, 1e-12)
criterion.SetEchoLevel(0)
builder = KM.ResidualBasedBlockBuilderAndSolver(LS.SparseLUSolver())
strategy = KM.ResidualBasedNewtonRaphsonStrategy(part, scheme, criterion, builder, 1 if p.linear else 25, bool(p.control), False, True)
strategy.SetEchoLevel(0)
strategy.Initialize()


def values():
    if p.control:
        return [driven.GetSolutionStepValue(REACTIONS[control_dof]) / p.force[0][2]]
    return [factor * part.Nodes[k + 1].GetSolutionStepValue(DOFS[dof]) for _, k, dof, factor in grid.monitors]


def keep():
    return [(list(node.GetSolutionStepValue(KM.DISPLACEMENT)), list(node.GetSolutionStepValue(KM.ROTATION))) for node in part.Nodes]


def put_back(saved):
    for node, (u, r) in zip(part.Nodes, saved):
        node.SetSolutionStepValue(KM.DISPLACEMENT, 0, u)
        node.SetSolutionStepValue(KM.ROTATION, 0, r)
        node.X, node.Y, node.Z = node.X0 + u[0], node.Y0 + u[1], node.Z0 + u[2]
    scheme.InitializeSolutionStep(part, strategy.GetSystemMatrix(), strategy.GetSolutionVector(), strategy.GetSystemVector())


def attempt(level):
    """(converged, iterations) of a step to this load factor, or part of the prescribed displacement."""
    saved = keep()
    part.CloneTimeStep(level)
    part.ProcessInfo[KM.STEP] += 1
    for node, f in loads:
        node.SetSolutionStepValue(SM.POINT_LOAD, 0, [level * v for v in f])
    if p.control:
        driven.SetSolutionStepValue(DOFS[control_dof], 0, level * end)
    strategy.InitializeSolutionStep()
    strategy.Predict()
    good = strategy.SolveSolutionStep() or p.linear
    iterations = part.ProcessInfo[KM.NL_ITERATION_NUMBER]
    if good and np.all(np.isfinite(values())):
        strategy.FinalizeSolutionStep()
        return True, iterations
    put_back(saved)
    return False, iterations


stepper = Stepper(1 if p.linear else steps, limit, imported)
stepper.run(attempt)
report(grid, values(), stepper, len(grid.x) * 6)
