"""Words of doc/accuracy.md that do not follow from its tables."""

HEAD = """# Work and precision

Written by `make accuracy` (`bench/accuracy.py`) on {date}, {cpu}, one thread. How wrong the answer is, against the CPU time that it takes: all presets (`accuracy` of `&job`) on ladders
of meshes, and the programs that users would take instead, on the same problems. [What to choose when](#what-to-choose-when) is at the end.

- *Error*: the worst of the monitors of a problem, per cent of the reference. References are exact where there is an exact value; where the published one has too few digits or comes from one
  coarse mesh, it is the limit of fine meshes, and each section says which and how far it may be trusted (`bench/accuracy_references.csv`).
- *CPU*: user and system time of the whole process, reading and start included, without a result file. *Peers*: the same less the time of their imports (Kratos 1 to 2 s, NGSolve and OpenSees
  0.3 s); CalculiX: of `ccx`. Each peer takes its load in the cheapest of four numbers of steps. So that like is compared with like, the start of our program ({start} s) is taken off in the
  table "At equal error", and nowhere else.
- *At equal error*: interpolated in logarithms along the best of each; at 1 %, and at the smallest error that both reach. An error that grows again on a finer mesh was small by a change of
  sign: it counts as large as on the finer ones. Nothing is extrapolated: an error that a peer did not reach in its time (10 to 40 s a run) is not compared.
- Figures of peers are stored with date, machine and version in `bench/accuracy_peers.csv`; `bench/accuracy_peers.py` measures them anew and says how to install them. Ours are run anew each time.
- *Mesh*: of the input. `fast` makes it once coarser where it can, `reference` twice finer ([namelist.md](namelist.md)), so their curves begin elsewhere.
- Ladders end where the next mesh would take more than {limit:g} s.
- What each peer can run: **Kratos** 10.4.4 (thin: ANDES and DKT; thick; corotational triangles) all elastic problems but the snap-back; **OpenSees** 3.7.1 (ASDShellT3, ShellNLDKGT, corotational)
  the same in principle, its tangent is not consistent, so most runs end on the way; **CalculiX** 2.20 the same, as C3D20R, which its S8R is expanded into (its shells hold the thickness in planes of symmetry);
  **NGSolve** 6.2 (Hellan-Herrmann-Johnson method for nonlinear Koiter shells, Neunteufel & Schöberl 2024) the same. None has rubber or tissue in shells, prescribed volumes, or an arc-length that passes limit points."""

AIMS = """The aim: `balanced` within 1 % and `reference` within 0.1 % on the mesh of the example. Where not, the mesh of the ladder that is, and its CPU time."""

ADVICE = """- Leave `accuracy` alone for design work: `balanced` on a mesh that shows the shape of the answer (a cell turns by at most 5 to 10 degrees, two or three cells along the shortest
  wave of a dent) is within 1 % on nearly all problems here. What is missing is the mesh, never the tolerance: on one mesh all presets agree to a hundredth of a per cent.
- `fast` for sketches, parameter studies, and the first run of a new model: the mesh once coarser, four times the error for a fifth of the time.
- `reference` for the number that is reported: sixteen times as many triangles, an error sixteen times smaller where the solution is smooth, for twenty times the CPU time.
- Instead of believing this page for another problem: `finshell study INPUT.nml` ([study.md](study.md)) measures the error of its meshes.
- Large rotations of thin shells, snap-through, rubber, tissue: this program. Every other one here takes tens of times longer for the same error, or does not arrive.
- Plane panels and other linear problems without thin shells in bending: elements of high order (NGSolve, order 5) win, as three-node triangles converge with h² at best and with h^1.3 at a corner;
  plates where transverse shear counts (thickness over a twentieth of the span): Kratos's thick triangle or solids, as there is no transverse shear here."""
