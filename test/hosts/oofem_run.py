"""Solves an input file with OOFEM and writes all nodal unknowns: oofem_run.py INPUT OUTPUT NODES."""
import json
import sys

import oofem

problem = oofem.InstanciateProblem(oofem.OOFEMTXTDataReader(sys.argv[1]), oofem.problemMode.processor, 0, None, False)
problem.checkProblemConsistency()
problem.solveYourself()
step = problem.giveCurrentStep()
domain = problem.giveDomain(1)
total = oofem.ValueModeType.VM_Total
dofs = [oofem.DofIDItem.D_u, oofem.DofIDItem.D_v, oofem.DofIDItem.D_w,
        oofem.DofIDItem.R_u, oofem.DofIDItem.R_v, oofem.DofIDItem.R_w]
values = []
for number in range(1, int(sys.argv[3]) + 1):
    node = domain.giveDofManager(number)
    values.append([node.giveDofWithID(dof).giveUnknown(total, step) for dof in dofs])
with open(sys.argv[2], "w") as file:
    json.dump(values, file)
