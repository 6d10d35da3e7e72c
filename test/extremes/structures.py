"""Structures along the axes on which inputs can be extreme, each with its exact value: what `test_extremes.py` runs.

A case ends in one of two ways: with its values within `bound` (relative to the largest), or, where `ends` says so, with exit code 1
or 2 and that sentence. Formulas: homogeneous deformation, Euler-Bernoulli beams, Kirchhoff plates, rigid motions.
"""
import math
from dataclasses import dataclass, field

RUBBER = "law = 'mooney_rivlin' c10 = 80.0 c01 = 20.0"
# Why some of these end: along the stretch the law is 1e15 times as stiff as across, in a state that rounding then decides.
LOST = "ends where the stiffness across is 1e-15 of that along the stretch"


@dataclass
class Case:
    axis: str
    value: float
    text: str
    exact: dict
    bound: float = 1e-8
    scale: float = 0.0  # what errors are relative to; 0: the largest exact value
    ends: str = ""  # part of the sentence with which the run may end
    long: bool = False  # not part of the bounded run
    files: dict = field(default_factory=dict)
    also: str = ""  # what the value does not say: for the page


def rectangle(lengths, divisions, more=""):
    return f"&mesh generator = 'rectangle' lengths = {lengths[0]!r}, {lengths[1]!r} divisions = {divisions[0]}, {divisions[1]} {more} /\n"


def monitor(name, quantity, component="", where=""):
    component = f" component = '{component}'" if component else ""
    where = f" node_set = '{where}'" if where else ""
    return f"&monitor name = '{name}' quantity = '{quantity}'{component}{where} /\n"


def stretched(stretch, law=RUBBER, thickness=0.02, lengths=(1.0, 1.0), divisions=(3, 2), mesh="", step="", normal_stress=True):
    """A sheet pulled along x, free across, kept in its plane. Monitors: force, and displacement across."""
    return (mesh or rectangle(lengths, divisions)) + f"""&material name = 'm' {law} /
&section thickness = {thickness!r} /
&support node_set = 'all' fixed = 'uz', 'rx', 'ry' /
&support node_set = 'edge_x0' fixed = 'ux', 'rz' /
&support node_set = 'edge_y0' fixed = 'uy', 'rz' /
&support node_set = 'edge_x1' fixed = 'rz' ux = {(stretch - 1) * lengths[0]!r} /
&step tolerance = 'tight' {step} /
""" + monitor("force", "reaction", "x", "edge_x1") + monitor("across", "displacement", "y", "edge_y1") + "&output every = 0 /\n"


def rubber_force(stretch, area, c10=80.0, c01=20.0):
    return 2 * area * (stretch - stretch**-2) * (c10 + c01 / stretch)


def stretches():
    for stretch in (0.05, 0.1, 0.5, 0.9, 1 - 1e-6, 1 + 1e-6, 1 + 1e-12, 1.5, 3.0, 10.0):
        # far in compression a sheet of rubber has other states: it crumples in its plane
        exact = {"force": rubber_force(stretch, 0.02), "across": stretch**-0.5 - 1}
        yield Case("stretch of a sheet of rubber", stretch, stretched(stretch), exact,
                   bound=1e-8 if abs(stretch - 1) > 1e-9 else 1e-3)


def aspects():
    for aspect in (1.0, 10.0, 100.0, 1e3, 1e4, 1e5):
        for name, lengths in (("along", (aspect, 1.0)), ("across", (1.0, aspect))):
            exact = {"force": rubber_force(2.0, 0.02 * lengths[1]), "across": (2**-0.5 - 1) * lengths[1]}
            case = Case(f"elements longer than wide, {name} the stretch of 2", aspect, stretched(2.0, lengths=lengths, divisions=(2, 2)), exact,
                        bound=max(1e-8, 1e-12 * aspect))
            # each value on its own scale
            case.exact = {k: v for k, v in exact.items() if k == "force"}
            yield case


def sizes():
    one = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
1
2 1 "all_of_it"
$EndPhysicalNames
$Entities
0 0 1 0
1 0 0 0 1 1 0 1 1 0
$EndEntities
$Nodes
1 3 1 3
2 1 0 3
1
2
3
0 0 0
1 0 0
0 1 0
$EndNodes
$Elements
1 1 1 1
2 1 2 1
1 1 2 3
$EndElements
"""
    text = f"""&mesh file = 'one.msh' /
&node_set name = 'edge_x0' x = 0.0 /
&node_set name = 'edge_y0' y = 0.0 /
&node_set name = 'edge_x1' x = 1.0 /
&node_set name = 'edge_y1' y = 1.0 /
"""
    exact = {"force": rubber_force(2.0, 0.02) / 2}
    yield Case("number of elements", 1, stretched(2.0, mesh=text), exact, files={"one.msh": one})
    for n, longer in ((1, False), (10, False), (100, False), (300, True)):
        exact = {"force": rubber_force(2.0, 0.02), "across": 2**-0.5 - 1}
        yield Case("number of elements", 2 * n**2, stretched(2.0, divisions=(n, n)), exact, long=longer)


def bulk():
    for ratio in (1.0, 1e2, 1e4, 1e6, 1e8, 1e10):
        law = f"law = 'compressible_neo_hookean' mu = 1.0 lambda = {ratio!r}"
        stretch = 2.0
        exact_force, across = compressible(stretch, ratio)
        yield Case("lambda over mu, stretch of 2", ratio, stretched(stretch, law), {"force": 0.02 * exact_force, "across": across - 1})


def compressible(stretch, ratio):
    """Nominal stress and transverse stretch in uniaxial tension, mu = 1: mu (c^2 - 1) + lambda ln J = 0, J = stretch c^2."""
    y = -math.log(stretch)  # ln c^2
    for _ in range(100):
        y -= (math.expm1(y) + ratio * (math.log(stretch) + y)) / (math.exp(y) + ratio)
    return stretch - math.exp(y) / stretch, math.exp(y / 2)


def laws_next_to_their_ends():
    jm = 10.0
    for gap in (0.5, 0.1, 0.01, 0.001, 2e-4, -0.1):
        invariant, stretch = 3 + jm * (1 - gap), math.sqrt(3 + jm * (1 - gap))
        for _ in range(60):
            stretch -= (stretch**2 + 2 / stretch - invariant) / (2 * stretch - 2 / stretch**2)
        force = 0.02 * (stretch - stretch**-2) / gap
        yield Case("distance from the lock of Gent's law", gap, stretched(stretch, f"law = 'gent' mu = 1.0 jm = {jm}"), {"force": force},
                   ends="the law gent ends" if gap < 0 else "")
    for alpha in (2.0, 10.0, 26.0, 50.0, 100.0, -26.0):
        stretch = 1.5
        force = 0.02 * 2 / alpha * (stretch**(alpha - 1) - stretch**(-alpha / 2 - 1))
        yield Case("exponent of Ogden's law, stretch of 1.5", alpha, stretched(stretch, f"law = 'ogden' mu1 = {2 / alpha!r} alpha1 = {alpha}"), {"force": force},
                   ends="failed too often" if alpha > 90 else "", also=LOST)
    for exponent in (0.1, 1.0, 10.0, 30.0, 50.0, 100.0):
        stretch, k1, c = 1.2, 1.0, 1.0
        k2 = exponent / (stretch**2 - 1)**2
        force = 0.02 * (c * (stretch - stretch**-2) + 4 * k1 * (stretch**2 - 1) * math.exp(exponent) * stretch)
        law = f"law = 'holzapfel_gasser_ogden' c = {c} k1 = {k1} k2 = {k2!r} angle = 0.0"
        yield Case("exponent of the fibres, stretch of 1.2", exponent, stretched(stretch, law), {"force": force},
                   ends="failed too often" if exponent > 25 else "", also=LOST)   # at 30 one run in eight ends so, as rounding has it


def cantilever(unit=1.0, modulus=2e5, force=0.02, corner=(0.0, 0.0, 0.0), step="tolerance = 'tight'"):
    """A strip, 10 by 1 by 0.1, under a force at its end."""
    x, y, z = corner
    corners = [(0, 0), (10, 0), (10, 1), (0, 1)]
    text = ", ".join(f"{x + unit * a!r}, {y + unit * b!r}, {z!r}" for a, b in corners)
    return f"""&mesh generator = 'quadrilateral' corners = {text} divisions = 10, 1 /
&material name = 'm' law = 'linear_elastic' e = {modulus!r} nu = 0.3 /
&section thickness = {0.1 * unit!r} /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'force' node_set = 'edge_x1' total = .true. vector = 0.0, 0.0, {force!r} /
&step {step} /
""" + monitor("u", "displacement", "x", "edge_x1") + monitor("w", "displacement", "z", "edge_x1") + "&output every = 0 /\n"


# The cantilever in the units 1 (quadruple precision is not at hand: what other units must repeat). Set by test_extremes.
BASE = {}


def units():
    for power in (-70, -59, -30, -12, -6, 6, 12, 30, 59, 70):
        unit = 10.0**power
        yield Case("unit of length", unit, cantilever(unit, force=0.02 * unit**2), {k: v * unit for k, v in BASE.items()},
                   ends="take another unit of length" if abs(power) > 60 else "")
    for power in (-290, -100, -30, -12, -6, 6, 12, 30, 100, 290):
        modulus = 2 * 10.0**power
        yield Case("unit of stress", 10.0**power, cantilever(modulus=modulus, force=1e-7 * modulus), BASE)
    for distance in (1e3, 1e6, 1e9, 1e12):
        yield Case("distance from the origin", distance, cantilever(corner=(distance, -distance, distance)), BASE, bound=max(1e-8, 2e-15 * distance),
                   also="displacements relative to the strip, whose coordinates are rounded by 1e-16 of the distance")


def loads(slope):
    # What a small load does is in proportion to it.
    for force in (1e-300, 1e-100, 1e-30, 1e-12, 1e-6):
        yield Case("load, relative to one that bends the strip", force, cantilever(force=force), {"w": slope * force}, bound=1e-6)
    for force in (1e3, 1e6, 1e12, 1e100):
        yield Case("load, relative to one that bends the strip", force, cantilever(force=force), {}, ends=" ")


def thin_plates():
    """A square plate, simply supported, under pressure: 0.00406235 q a^4/D (Timoshenko and Woinowsky-Krieger, table 8)."""
    for thickness in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8):
        stiffness = 2e5 * thickness**3 / 12 / (1 - 0.09)
        pressure = 1e-3 * stiffness
        text = rectangle((0.5, 0.5), (16, 16)) + f"""&material name = 'm' law = 'linear_elastic' e = 2.0e5 nu = 0.3 /
&section thickness = {thickness!r} /
&support node_set = 'edge_x0' fixed = 'ux', 'uy', 'uz', 'rx' /
&support node_set = 'edge_y0' fixed = 'ux', 'uy', 'uz', 'ry' /
&support node_set = 'edge_x1' type = 'symmetry_x' /
&support node_set = 'edge_y1' type = 'symmetry_y' /
&load type = 'pressure' pressure = {pressure!r} /
&step control = 'linear' /
""" + monitor("w", "displacement", "z", "corner_x1_y1") + "&output every = 0 /\n"
        yield Case("thickness of a plate over its side", thickness, text, {"w": 0.00406235 * pressure / stiffness}, bound=4e-3,
                   also="mesh of 16 × 16 on a quarter")


def thin_strips(rows):
    """The elastica under an end force (rows: P L^2/EI, u, w of length 10)."""
    load, u, w = rows
    for thickness in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        stiffness = 1.2e6 * thickness**3 / 12
        text = rectangle((10.0, 1.0), (32, 1)) + f"""&material name = 'm' law = 'linear_elastic' e = 1.2e6 nu = 0.0 /
&section thickness = {thickness!r} /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'force' node_set = 'edge_x1' total = .true. vector = 0.0, 0.0, {load * stiffness / 100!r} /
&step /
""" + monitor("u", "displacement", "x", "edge_x1") + monitor("w", "displacement", "z", "edge_x1") + "&output every = 0 /\n"
        yield Case("thickness of a bent strip, length 10", thickness, text, {"u": -u, "w": w}, bound=3e-3, also="mesh of 32 × 1",
                   ends="all but lost in the rounding" if thickness < 2e-6 else "")


def flat_membranes(slope):
    """A flat disk without bending to speak of: Hencky's limit, w0/a = 0.653 (p a/E h)^(1/3), of small loads."""
    for thickness in (1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12):
        for name, section in (("shell", ""), ("membrane", "type = 'membrane'")):
            pressure = 1e-6 * 2e5 * thickness
            text = f"""&mesh generator = 'disk' radius = 1.0 rings = 16 core = 6 portion = 'eighth' grading = 0.3 /
&material name = 'm' law = 'linear_elastic' e = 2.0e5 nu = 0.3 /
&section {section} thickness = {thickness!r} /
&support node_set = 'rim' type = 'hinged' /
&support node_set = 'edge_y0' type = 'symmetry_y' /
&support node_set = 'edge_diagonal' type = 'symmetry' normal = 1.0, -1.0, 0.0 /
&load type = 'pressure' pressure = {pressure!r} /
&step /
""" + monitor("w", "displacement", "z", "centre") + "&output every = 0 /\n"
            bound = 6e-3 if thickness < 1e-3 or section else 0.02
            yield Case(f"thickness over radius of a flat disk under pressure, {name}", thickness, text, {"w": slope * 1e-2}, bound=bound)


def rigid_rotations():
    turns = [1e-12, 1e-6, 1.0, math.pi - 1e-6, math.pi - 1e-9, math.pi, math.pi + 1e-9, 2 * math.pi - 1e-9, 2 * math.pi, 2 * math.pi + 1e-9,
             20 * math.pi, 200 * math.pi]
    for angle in turns:
        text = rectangle((10.0, 2.0), (6, 2)) + f"""&material name = 'm' law = 'linear_elastic' e = 2.0e5 nu = 0.3 /
&section thickness = 0.05 /
&support node_set = 'edge_x0' fixed = 'ux', 'uy', 'uz', 'rx', 'rz' ry = {angle!r} /
&step tolerance = 'tight' maximum_increments = 10000 /
""" + monitor("x", "displacement", "x", "edge_x1") + monitor("z", "displacement", "z", "edge_x1") + "&output every = 0 /\n"
        exact = {"x": 10 * (math.cos(angle) - 1), "z": -10 * math.sin(angle)}
        yield Case("rotation of a clamp that nothing resists (rad)", angle, text, exact, scale=min(10.0, 10 * angle), bound=1e-9, long=angle > 7)


def rolled_strips():
    """A strip whose ends are turned against each other, one free to follow: moment EI a/L, energy EI a^2/2L; and back."""
    for turns, longer in ((0.5, False), (1, False), (3, True), (10, True)):
        angle, length, thickness = 2 * math.pi * turns, 10.0 * max(1, turns), 0.01
        stiffness = 1.2e6 * thickness**3 / 12
        elements = 20 * max(1, int(turns))
        for back in (False, True):
            text = rectangle((length, 1.0), (elements, 1)) + f"""&material name = 'm' law = 'linear_elastic' e = 1.2e6 nu = 0.0 /
&section thickness = {thickness!r} /
&support node_set = 'edge_x0' type = 'clamped' /
&support node_set = 'all' fixed = 'uy', 'rx', 'rz' /
&support node_set = 'edge_x1' ry = {-angle!r} /
&step maximum_increments = 100000 /
""" + ("&step load_factor = 0.0 maximum_increments = 100000 /\n" if back else "") \
                + monitor("moment", "reaction_moment", "y", "edge_x1") + monitor("energy", "energy") + "&output every = 0 /\n"
            exact = {"moment": 0.0, "energy": 0.0} if back else {"energy": stiffness * angle**2 / length / 2}
            yield Case("turns of a strip that is rolled up" + (", and back" if back else ""), turns, text, exact,
                       bound=1e-4 if back else 1e-3, scale=stiffness * angle**2 / length / 2, long=longer, also="20 elements a turn; of 100 turns 72 are reached, then the tangent has 1355 negative pivots: not part of the run, which takes 3471 increments")


def contrasts():
    """Two halves in a row, one of them stiffer, pulled, and bent by an end force."""
    for contrast in (1e-12, 1e-8, 1e-4, 1.0, 1e4, 1e8, 1e12):
        text = rectangle((10.0, 1.0), (20, 1)) + f"""&element_set name = 'root' x = 0.0, 5.0 /
&element_set name = 'tip' x = 5.0, 10.0 /
&material name = 'a' law = 'linear_elastic' e = 1.2e6 nu = 0.0 /
&material name = 'b' law = 'linear_elastic' e = {1.2e6 * contrast!r} nu = 0.0 /
&section element_set = 'root' material = 'a' thickness = 0.1 /
&section element_set = 'tip' material = 'b' thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
"""
        force = 1e-4 * 100 * min(1.0, contrast)
        bent = force * (5.0**3 / 3 / contrast + (10.0**3 - 5.0**3) / 3) / 100
        yield Case("modulus of the outer half over the inner, bending", contrast,
                   text + f"&load type = 'force' node_set = 'edge_x1' total = .true. vector = 0.0, 0.0, {force * 1e-3!r} /\n&step tolerance = 'tight' /\n"
                   + monitor("w", "displacement", "z", "edge_x1") + "&output every = 0 /\n", {"w": bent * 1e-3}, bound=3e-3, also="mesh of 20 × 1",
                   ends="singular" if contrast > 1e10 else "")
        pull = 1.2e5 * 1e-6 * min(1.0, contrast)
        yield Case("modulus of the outer half over the inner, tension", contrast,
                   text + f"&load type = 'line' edge_set = 'edge_x1' vector = {pull!r}, 0.0, 0.0 /\n&step tolerance = 'tight' /\n"
                   + monitor("u", "displacement", "x", "edge_x1") + "&output every = 0 /\n",
                   {"u": sum(5 * svk_strain(pull / 1.2e5 / c) for c in (1.0, contrast))}, bound=1e-6,
                   ends="singular" if contrast > 1e10 else "")


def svk_strain(force):
    """Elongation e of a bar of stiffness 1 with nominal stress (1 + e) (e + e^2/2) = force."""
    e = force
    for _ in range(50):
        e -= ((1 + e) * (e + e * e / 2) - force) / (1 + 3 * e + 1.5 * e * e)
    return e


def without_support():
    """Exactly singular from the start: named, not solved."""
    for number, held in enumerate(("", "&support node_set = 'edge_x0' type = 'hinged' /\n",
                                   "&support node_set = 'edge_x0' fixed = 'ux', 'uz', 'rx', 'ry', 'rz' /\n")):
        text = rectangle((10.0, 1.0), (10, 1)) + "&material name = 'm' law = 'linear_elastic' e = 2.0e5 nu = 0.3 /\n&section thickness = 0.1 /\n" \
            + held + "&load type = 'force' node_set = 'edge_x1' total = .true. vector = 0.0, 0.0, 1.0 /\n&step /\n"
        yield Case("too few supports: none, a hinge, all but uy", number, text, {}, ends="leave a rigid-body motion free")


def all_cases(elastica, hencky, slope):
    for axis in (stretches(), aspects(), sizes(), bulk(), laws_next_to_their_ends(), units(), loads(slope), thin_plates(), thin_strips(elastica),
                 flat_membranes(hencky), rigid_rotations(), rolled_strips(), contrasts(), without_support()):
        yield from axis
