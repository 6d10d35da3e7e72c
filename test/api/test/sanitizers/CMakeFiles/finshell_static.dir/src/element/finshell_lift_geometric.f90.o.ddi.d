/work/main/src/element/finshell_lift_geometric.f90:
