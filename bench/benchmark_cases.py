"""The cases of `make benchmark`: meshes, settings, quantities, what others need for them.

Peers: CPU seconds of the whole process on one core of the machine class in doc/benchmarks.md, measured 2026-11-22 (versions there).
"""
from dataclasses import dataclass, field
from math import pi


@dataclass
class Case:
    name: str                  # of the folder in examples/
    title: str
    meshes: dict               # label -> divisions
    quantities: tuple          # columns of the history to compare
    kind: str = "end"          # end: at full load; path: arc-length, limit points; levels: load factor at given displacements;
                               # turns: path along which the load factor, a displacement, turns
    table: bool = False        # compare at every load factor of reference.csv too
    levels: str = ""           # load factors to list where there is no reference table
    spread: str = ""           # mesh on which beta0 is varied
    optimal: float = 0.0       # beta0 that is optimal for in-plane bending: (1 - 4 nu^2)/2
    column: str = ""           # kinds path, levels: column of the displacement or volume
    step: str = ""             # settings for curves
    steps: dict = field(default_factory=dict)  # other settings of &step on some meshes
    file: str = ""             # input file, where it is not NAME/input.nml
    values: dict = field(default_factory=dict)  # kind levels: value of the reference -> prescribed value
    reference: tuple = ()      # kind levels: file in test/data, columns, value of the column fibre
    fine: str = ""             # kind levels: settings for the limit points
    extra: tuple = ()          # kind levels: further prescribed values around limit points
    limits: tuple = ()         # kind levels: limit points of the reference
    target: str = ""
    note: str = ""
    diagonals: str = ""        # mesh on which all diagonals are tried
    curved: tuple = ()         # meshes on which facets and curved references are compared, structured and irregular
    gentle: str = ""           # settings of &step for that, where those of the example are too bold for some meshes
    builder: str = ""          # of benchmark_meshes, where no generator makes the mesh
    peers: tuple = ()


SQUARES = {"8x8": "8, 8", "16x16": "16, 16", "32x32": "32, 32"}
OWN = "The reference is our own solution on a fine mesh (examples/NAME/reference.csv)."
TENTHS = "0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0"
PINCHED = "control = 'displacement' node_set = 'corner_a0_y0' component = 'z' displacements = -100 load_factor = 1 first_increment = -5 maximum_iterations = 40"
SEMI_CYLINDER = PINCHED.replace("corner_a0_y0", "corner_a0_y1").replace("-100", "-260")

ARC = "control = 'displacement' node_set = 'edge_a0' component = 'z' first_increment = 0.005 largest_increment = 0.005 residual_tolerance = 1e-5 correction_tolerance = 1e-5"
VOLUMES = {stretch: round(1000 * pi / 6 * stretch ** 3, 4) for stretch in (1.1, 1.2, 1.3, 1.4, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 5.0)}

ROOF = ("At the end of the path the force is compared at a given displacement, and the path is steep there: the difference is {0} mm in W_C at the same force. About two thirds of it is "
        "the transverse shear at the point force in the table's element (as in sze35): P/(2π κ G h) ln(√(R h)/r) = {1} mm, with r = 0.74 of the size of its elements.{2}")
ROOF_A = ROOF.format("0.17", "0.11", "")
ROOF_D = ROOF.format("0.31", "0.18", " The law, St. Venant–Kirchhoff, adds 0.8 % to the force (see hinged_strip).")

# For the table at the beginning: case -> mesh
GLANCE = {"sze31": "16x1", "sze32": "32x1", "sze33": "10x80", "sze34": "16x16", "sze35": "16x24", "sze36": "40x40", "sze37": "40x40", "sze38a": "16x16", "sze38d": "16x16",
          "inflated_sphere_neo_hookean": "24x24", "fibre_arc_axial": "24x1", "fibre_arc_circumferential": "24x1", "scordelis_lo": "16x16", "pinched_cylinder": "16x16",
          "pinched_hemisphere": "16x16", "twisted_beam_thin_y": "12x2", "twisted_beam_thin_z": "12x2", "hypar_1e-2": "16x16", "hypar_1e-3": "16x16", "hypar_1e-4": "16x16",
          "hemisphere_1e3": "16x16", "hemisphere_1e4": "16x16", "heavy_elastica": "32x1", "cylinder_line_load": "32x16", "rubber_cone": "40x2", "sze32_three_turns": "48x1",
          "le1": "16x16", "sheet_with_hole": "16x12", "le3": "8x8", "le5": "40x16", "cook": "8x8", "patch_membrane": "4x4", "patch_bending": "4x4"}

CASES = [
    Case("sze31", "Cantilever under an end shear force (Sze, Liu & Lo 3.1)", {"8x1": "8, 1", "16x1": "16, 1", "32x1": "32, 1"}, ("U", "W", "U_table", "W_table"),
         table=True, spread="16x1", optimal=0.5, target="16x1: at most 0.25 %, 1 increment, 12 iterations",
         peers=("Kratos thin triangle 16x1: +0.1/+0.1 %, 10 steps, 50 iterations, 0.5 s", "OpenSees ASDShellT3: stalls at 68 % of the load",
                "CalculiX S6: 0.0/0.0 %, 50 iterations, 0.75 s")),
    Case("sze32", "Cantilever under an end moment, full circle (Sze, Liu & Lo 3.2)", {"16x1": "16, 1", "32x1": "32, 1"}, ("U", "W"),
         table=True, spread="16x1", optimal=0.5, target="full circle, and on to three turns",
         note="The facets bend along their chord, which is shorter than the arc: the error falls as h²; 22° an element are coarse.",
         peers=("Kratos thin triangle: 0.0 %, 100 iterations, 0.8 s", "OpenSees ASDShellT3: 0.0 %, 60 iterations")),
    Case("sze32_three_turns", "Cantilever under an end moment, three turns", {"32x1": "32, 1", "48x1": "48, 1", "64x1": "64, 1", "128x1": "128, 1"}, ("U", "W"),
         note="Held in its plane. Where only the loaded edge is held, the wound-up strip becomes unstable (negative pivots) at load factors between 2.3 and 2.8: wound by "
              "more than two turns, a strip can get rid of turns by moving sideways."),
    Case("sze33", "Slit annular plate (Sze, Liu & Lo 3.3)", {"6x30": "30, 6", "10x80": "80, 10", "16x128": "128, 16"}, ("W_A", "W_B"),
         table=True, spread="10x80", optimal=0.5, steps={"6x30": "first_increment = 0.05 mixed = .true. rotation_limit = 0.2"}, target="10x80: at most 0.5 %, 6 increments, 60 iterations",
         peers=("Kratos thin triangle 6x30: −3.0/−2.4 %, 395 iterations, 13 s; 10x80: −0.5/−0.4 %, 260 iterations, 37 s",
                "OpenSees ASDShellT3: 13 % of the load in 40 s", "CalculiX S6: −8.8/−7.4 %, 30 s")),
    Case("sze34", "Hemisphere with 18° hole (Sze, Liu & Lo 3.4)", {"8x8": "8, 8", "16x16": "16, 16", "32x32": "32, 32"}, ("V_A", "U_B"),
         table=True, spread="8x8", optimal=0.32, diagonals="16x16", target="8x8: at most 5 %; 16x16: at most 1 %; full load in at most 2 increments, 20 iterations",
         peers=("Kratos thin triangle 8x8: −30/−45 %, 1.2 s; 16x16: −6.3/−11.9 %, 121 iterations, 5.6 s; 32x32: −0.5/−1.7 %, 117 iterations, 31 s",
                "OpenSees ASDShellT3 8x8: −32/−48 %", "CalculiX S6 8x8: −36/−50 % (whole shell)"), curved=("8x8", "16x16")),
    Case("sze35", "Pull-out of an open cylinder (Sze, Liu & Lo 3.5)", {"8x12": "12, 8", "16x24": "24, 16", "24x36": "36, 24", "32x48": "48, 32"}, ("W_A", "U_B", "U_C"),
         table=True, step="mixed = .false.", spread="8x12", optimal=0.3047, note="W_A settles 1.0 % below the table. The table's element is flexible in transverse shear, under which the deflection at a point force grows like "
              "P/(2π κ G h) ln(l/r): P/(2π κ G h) = 0.0203 here; with l = √(R h) = 0.68, and r = 0.16, of the size of an element of the table's mesh (0.22), that is 0.029 "
              "or 1.05 % of W_A, the whole difference (r is fitted; its logarithm is not sensitive). At B and C, away from the force, there is none.",
         target="16x24: U_B, U_C at most 1 %, full load in at most 2 increments, 20 iterations",
         peers=("Kratos thin triangle 16x24: −1.2/+0.2/+0.3 %, 216 iterations, 14 s; 24x36: −1.2/0.0/+0.4 %, 172 iterations, 32 s",
                "OpenSees ASDShellT3: 51 % of the load in 40 s", "CalculiX S6: −35 % and worse"), curved=("8x12", "16x24")),
    *[Case(f"hemisphere_{r}", f"Hemisphere with 18° hole, R/t = {r}", SQUARES, ("V_A", "U_B"),
           curved=("8x8", "16x16"), target="the deflections stay what they are at R/t = 250", note=OWN) for r in ("1e3", "1e4")],
    Case("sze36", "Pinched cylinder with end diaphragms (Sze, Liu & Lo 3.6)", {"16x16": "16, 16", "24x24": "24, 24", "40x40": "40, 40"}, ("W_A", "U_B"),
         levels=TENTHS, step=PINCHED, curved=("24x24",), note=OWN,
         gentle=f"{PINCHED.replace('-5', '-10')} wanted_iterations = 10"),
    Case("sze37", "Pinched semi-cylinder, isotropic (Sze, Liu & Lo 3.7)", {"16x16": "16, 16", "24x24": "24, 24", "40x40": "40, 40"}, ("W_A",),
         levels=TENTHS, step=SEMI_CYLINDER, curved=("24x24",), note=OWN),
    Case("sze37_0_90_0", "Pinched semi-cylinder, laminate 0/90/0", {"16x16": "16, 16", "24x24": "24, 24", "40x40": "40, 40"}, ("W_A",),
         levels=TENTHS, step=SEMI_CYLINDER, curved=("24x24",), note=OWN),
    Case("sze37_90_0_90", "Pinched semi-cylinder, laminate 90/0/90", {"16x16": "16, 16", "24x24": "24, 24", "40x40": "40, 40"}, ("W_A",),
         levels=TENTHS, step=SEMI_CYLINDER, curved=("24x24",), note=OWN),
    Case("sze38a", "Hinged roof, h = 12.7, isotropic (Sze, Liu & Lo 3.8)", {"8x8": "8, 8", "16x16": "16, 16", "32x32": "32, 32"}, ("W_C",),
         kind="path", column="W_C", spread="8x8", optimal=0.32, note=ROOF_A,
         target="the whole published path",
         peers=("Kratos thin triangle: bounces at the first limit point", "OpenSees: arc-length bounces; displacement control passes",
                "CalculiX S6: no arc-length"), curved=("8x8",)),
    Case("sze38b", "Hinged roof, h = 12.7, laminate 0/90/0", {"8x8": "8, 8", "16x16": "16, 16", "32x32": "32, 32"}, ("W_C",), kind="path", column="W_C"),
    Case("sze38c", "Hinged roof, h = 12.7, laminate 90/0/90", {"8x8": "8, 8", "16x16": "16, 16", "32x32": "32, 32"}, ("W_C",), kind="path", column="W_C"),
    Case("sze38d", "Hinged roof, h = 6.35, isotropic (Sze, Liu & Lo 3.8)", {"8x8": "8, 8", "16x16": "16, 16", "32x32": "32, 32"}, ("W_C",),
         kind="path", column="W_C", spread="8x8", optimal=0.32, note=ROOF_D,
         target="the whole published path, snap-back included",
         peers=("Kratos thin triangle: bounces at the first limit point", "OpenSees: arc-length bounces", "CalculiX S6: no arc-length"), curved=("8x8",)),
    Case("sze38e", "Hinged roof, h = 6.35, laminate 0/90/0", {"8x8": "8, 8", "16x16": "16, 16", "32x32": "32, 32"}, ("W_C",), kind="path", column="W_C"),
    Case("sze38f", "Hinged roof, h = 6.35, laminate 90/0/90", {"8x8": "8, 8", "16x16": "16, 16", "32x32": "32, 32"}, ("W_C",), kind="path", column="W_C"),
    Case("hinged_strip", "Hinged strip, plane bending through two limit points", {"16x1": "16, 1", "32x1": "32, 1", "64x1": "64, 1"}, ("load_factor",), kind="levels",
         column="w", values={w: w for w in (2.0, 5.0, 7.5, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0)},
         reference=("hinged_strip/reference.csv", "w", "load_factor"), fine=f"{ARC.replace('0.005', '0.5')} displacements =",
         note="What is left under refinement is the law: the reference is linear in the stretch λ, N = E A ε with ε = λ − 1, where St. Venant–Kirchhoff has E A (ε + 1.5 ε²); "
              "ε is −0.14 % at w = 7.5 and 0.6 % at w = 40. "
              "The hinge holds the rotations across its line; `type = 'hinged'`, which leaves the drilling rotation free, gives the same to 1e-6.", curved=("16x1",)),
    *[Case(f"inflated_sphere_{law}", f"Inflated sphere past its largest pressure, {title}", {"8x8": "8, 8", "16x16": "16, 16", "24x24": "24, 24", "32x32": "32, 32"},
           ("load_factor",), kind="levels", file=f"inflated_sphere/{law}.nml", column="volume", values=VOLUMES, reference=("inflated_sphere_analytic.csv", "stretch", column),
           fine="control = 'volume' first_increment = 50 tolerance = 'tight' volumes =", extra=(1340, 1365, 1380, 1390, 1405, 1430),
           target="past the pressure maximum, to five times the radius", curved=("8x8",))
      for law, title, column in (("neo_hookean", "neo-Hookean", "pR_over_mu_h_NH"), ("mooney_rivlin", "Mooney–Rivlin", "pR_over_h_MR80_20_psi"))],
    Case("fibre_arc_axial", "Fibre arc, axial fibres (Caselli & Bisegna 3.2)", {"24x1": "24, 1", "48x1": "48, 1", "96x1": "96, 1"}, ("load_factor",), kind="levels",
         file="fibre_arc/axial.nml", column="w", values={w: w for w in (1.05, 1.1, 1.15, 1.2, 1.25, 1.3, 1.35, 1.4, 1.45)}, reference=("fibre_arc_at_w.csv", "w", "p", "axial"),
         fine=f"{ARC} displacements =", limits=((0.103, 0.233), (0.161, 0.084), (0.430, 0.263), (0.973, -0.212)),
         note="There are several branches here; the second limit point is at a smaller w than that of the reference, on every mesh and with displacement control and arc-length alike.",
         target="2 % where it may be judged; all limit points; at most 41 increments, 189 iterations (the paper's)", curved=("24x1",)),
    Case("fibre_arc_circumferential", "Fibre arc, circumferential fibres (Caselli & Bisegna 3.2)", {"24x1": "24, 1", "48x1": "48, 1", "96x1": "96, 1"}, ("load_factor",), kind="levels",
         file="fibre_arc/circumferential.nml", column="w",
         values={w: w for w in (0.05, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 0.9, 1.0, 1.1, 1.15, 1.2, 1.25, 1.3, 1.35, 1.4, 1.45)},
         reference=("fibre_arc_at_w.csv", "w", "p", "circumferential"), fine=f"{ARC} displacements =", limits=((0.412, 0.528), (0.906, -0.461)),
         target="2 % where it may be judged; all limit points; at most 32 increments, 148 iterations (the paper's)", curved=("24x1",)),
    Case("heavy_elastica", "Heavy elastica: cantilever under its own weight", {"16x1": "16, 1", "32x1": "32, 1", "64x1": "64, 1"}, ("x_tip", "drop", "slope"), table=True,
         note="At the largest weights the strip hangs from a bend that is a sixth of its length."),
    Case("cylinder_line_load", "Hyperelastic cylinder under a line load", {"16x8": "16, 8", "32x16": "32, 16", "64x32": "64, 32"}, ("u_end", "u_mid"), table=True,
         curved=("16x8", "32x16"), note="The reference may be trusted to 1 %."),
    Case("rubber_cone", "Collapse of a rubber cone", {"20x2": "2, 20", "40x2": "2, 40", "80x2": "2, 80"}, ("load_factor",), kind="turns", column="F", curved=("20x2",),
         limits=((1.8488, -0.1864), (0.1838, 0.4607), (1.8648, -0.7200), (0.1583, 0.7462), (1.8539, -0.5023), (0.1848, 0.1928)),
         target="the whole path with its six turning points", note="Distance of a point of the table to the path, force and displacement both divided by their largest value."),
    Case("scordelis_lo", "Scordelis–Lo roof, linear", {"4x4": "4, 4", "8x8": "8, 8", "16x16": "16, 16", "32x32": "32, 32"}, ("w",), spread="all", optimal=0.5, curved=("8x8",)),
    Case("pinched_cylinder", "Pinched cylinder with diaphragms, linear", {"4x4": "4, 4", "8x8": "8, 8", "16x16": "16, 16", "32x32": "32, 32"}, ("w",), spread="all", optimal=0.32, curved=("8x8",)),
    Case("pinched_hemisphere", "Pinched hemisphere, closed, linear", {"4x4": "4, 4", "8x8": "8, 8", "16x16": "16, 16", "32x32": "32, 32"}, ("u",), spread="all", optimal=0.32, curved=("8x8",), target="8x8: at most 3 %, structured and irregular"),
    Case("pinched_hemisphere_hole", "Pinched hemisphere with hole, linear", {"4x4": "4, 4", "8x8": "8, 8", "16x16": "16, 16", "32x32": "32, 32"}, ("u",), spread="all", optimal=0.32, curved=("8x8",), target="8x8: at most 3 %, structured and irregular"),
    *[Case(f"twisted_beam_{t}_{d}", f"Twisted beam, {t}, force along {d}, linear", {"12x2": "12, 2", "24x4": "24, 4", "48x8": "48, 8"}, ("u",), spread="all", optimal=0.4032, diagonals="24x4", curved=("12x2",),
           target="12x2: at most 1 % on all diagonals, structured and irregular" if t == "thin" else "")
      for t in ("thick", "thin") for d in "yz"],
    *[Case(f"hypar_{t}", f"Clamped hyperbolic paraboloid, t/L = {t}, linear", SQUARES, ("w", "energy"), curved=("16x16",), target=aim)
      for t, aim in (("1e-2", ""), ("1e-3", "16x16: at least 0.97 of the deflection"), ("1e-4", "16x16: at least 0.9 of the deflection"))],
    Case("le1", "NAFEMS LE1, elliptic plate, linear", SQUARES, ("sigma_yy",), builder="le1",
         note="The stress is the mean of the elements that touch the point; their centroids lie a third of a cell inside, which is most of the error."),
    Case("sheet_with_hole", "Stretched sheet with a hole, linear", {"16x12": "16, 12", "32x24": "32, 24", "64x48": "64, 48"}, ("peak",),
         note="The stress is the mean of the elements that touch the point, as in LE1."),
    Case("le3", "NAFEMS LE3, hemisphere under point loads, linear", SQUARES, ("u",), curved=("8x8",)),
    Case("le5", "NAFEMS LE5, Z section, linear", {"20x8": "20, 8", "40x16": "40, 16", "80x32": "80, 32"}, ("sigma_xx",), builder="le5",
         note="The stress is the mean of the elements that touch the point, as in LE1. All parts are flat: curved references change nothing, to the last bit."),
    Case("cook", "Cook's membrane, linear", {"2x2": "2, 2", "4x4": "4, 4", "8x8": "8, 8", "16x16": "16, 16", "32x32": "32, 32"}, ("v",), spread="all", optimal=0.2777778),
    Case("panel_bending", "Cantilever panel in in-plane bending, linear", {"8x2": "8, 2", "16x4": "16, 4", "32x8": "32, 8"}, ("v",), spread="all", optimal=0.375, diagonals="8x2"),
    Case("patch_membrane", "Membrane patch test", {"4x4": "4, 4"}, ("N_11", "u_y"), spread="all", optimal=0.375),
    Case("patch_bending", "Bending patch test", {"4x4": "4, 4"}, ("M_11", "w"), spread="all", optimal=0.375),
]
