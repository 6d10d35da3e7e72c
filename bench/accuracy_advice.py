"""Words of doc/accuracy.md that do not follow from its tables."""

HEAD = """# Work and precision

Written by `make accuracy` (`bench/accuracy.py`) on {date}, {cpu}, one thread. How wrong the answer is, against the CPU time that it takes: all presets (`accuracy` of `&job`) on ladders
of meshes, and the programs that users would take instead, on the same problems. [What to choose when](#what-to-choose-when) is at the end.

- *Error*: the worst of the monitors of a problem, per cent of the reference. References are exact where there is an exact value; where the published one has too few digits or comes from one
  coarse mesh, it is the limit of fine meshes, and each section says which and how far it may be trusted (`bench/accuracy_references.csv`).
- *CPU*: user and system time of the whole process, reading and start included, without a result file. *Peers*: the same less the time of their imports (0.1 to
  0.2 s); CalculiX: of `ccx`. Each peer takes its load in the cheapest of four numbers of steps. So that like is compared with like, the start of our program ({start} s) is taken off in the
  table "At equal error", and nowhere else.
- *At equal error*: interpolated in logarithms along the best of each; at 1 %, and at the smallest error that both reach. An error that grows again on a finer mesh was small by a change of
  sign: it counts as large as on the finer ones. Nothing is extrapolated: an error that a peer did not reach in its time (10 to 40 s a run) is not compared.
- Figures of peers are stored with date, machine and version in `bench/accuracy_peers.csv`; `bench/accuracy_peers.py` measures them anew and says how to install them. Ours are run anew each time.
- *Mesh*: of the input. `fast` makes it once coarser where it can, `reference` twice finer ([namelist.md](namelist.md)), so their curves begin elsewhere.
- Ladders end where the next mesh would take more than {limit:g} s.
- What each peer can run: **Kratos** 10.4.4 (thin: ANDES and DKT; thick; corotational triangles) all elastic problems but the snap-back; **OpenSees** 3.7.1 (ASDShellT3, ShellNLDKGT, corotational)
  the same in principle; Newton converges linearly there, and many runs end on the way or in their time; **CalculiX** 2.20 the same, as C3D20R, which its S8R is expanded into (its shells hold the thickness in planes of symmetry);
  **NGSolve** 6.2 (Hellan-Herrmann-Johnson method for nonlinear Koiter shells, Neunteufel & Schöberl 2024) the same. None has rubber or tissue in shells, prescribed volumes, or an arc-length that passes limit points."""

AIMS = """The aim: `balanced` within 1 % and `reference` within 0.1 % on the mesh of the example. Where not, the mesh of the ladder that is, and its CPU time."""

ADVICE = """The meshes are those of the table (`balanced`); `fast` and `reference` are the same with a mesh once coarser and twice finer.

- Leave `accuracy` alone for design work: `balanced`, on a mesh that shows the shape of the answer (a cell turns by at most 5 to 10 degrees, three cells along the shortest wave of a
  dent), is within 1 % on all problems here but two. What is missing is the mesh, hardly ever the tolerance: on one mesh all presets agree to 0.01 %.
- `fast` for sketches, studies of parameters, and the first run of a new model: three to five times the error for a third of the time, down to 0.02 s, below which nothing gets faster.
- `reference` for the number that is reported: an error ten to thirty times smaller, for 20 to 50 times the CPU time. Where it matters in one direction only (a strip, a sector of a body
  of revolution), finer `divisions` in that direction do the same for a quarter of it.
- Stretch of rubber by more than two needs the finest meshes (`disk`): there, try `finshell study INPUT.nml` ([study.md](study.md)), which measures the error of its meshes. It is worth more than
  this page for any other problem, too.
- Large rotations of thin shells, snap-through, rubber, tissue: this program. The others take 7 to 100 times as long for the same error, or do not arrive.
- Smooth shells of stiff material under loads that can be applied in a few steps (`line_load`): elements of second and third order, shells (NGSolve) or solids (CalculiX), are the nearest rivals.
- Plane panels (`cook`): elements of second or higher order win, by any factor when digits are wanted; three-node triangles converge with h² at best, and slower at corners.
- Where sixteen to sixty cells are enough (`cantilever`, `roof`, `scordelis`) everything is done in hundredths of a second: choose by something else.
- Plates thicker than a twentieth of their span: Kratos's thick triangle or solids, as there is no transverse shear here."""
