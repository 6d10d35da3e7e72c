#!/usr/bin/env python3
"""The Python package: it says what the header says, passes arrays on as they are, and raises what the library reports."""
import ctypes
import gc
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

try:
    import numpy as np
except ImportError:
    print("numpy is not installed")
    sys.exit(77)

SOURCE = os.environ.get("FINSHELL_SOURCE_DIR") or os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PACKAGE = os.path.join(SOURCE, "api", "python")
sys.path.insert(0, PACKAGE)
import finshell  # noqa: E402
from finshell import _library  # noqa: E402

SQUARE = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], dtype=float)


def rubber(**options):
    return finshell.Section("mooney_rivlin", {"c10": 80.0, "c01": 20.0}, 0.1, **options)


def bent():
    u, t = np.zeros((2, 3, 3)), np.zeros((2, 3, 3))
    u[:, :, 0] = 0.2 * SQUARE[:, :, 0]
    t[:, :, 1] = -0.1 * SQUARE[:, :, 0]
    return u, t


class Header(unittest.TestCase):
    """Prototypes and structures agree with finshell.h."""

    def setUp(self):
        with open(os.path.join(SOURCE, "api", "finshell.h"), encoding="utf-8") as f:
            self.text = re.sub(r"/\*.*?\*/", "", f.read(), flags=re.S)

    def test_prototypes(self):
        kinds = {"int32_t": ctypes.c_int32, "double": ctypes.c_double, "const double *": _library._D, "double *": _library._D,
                 "int32_t *": _library._C, "finshell_status *": _library._S, "const char *": ctypes.c_char_p, "char *": ctypes.c_char_p,
                 "const finshell_section *": ctypes.c_void_p, "finshell_section *": ctypes.c_void_p,
                 "finshell_section **": ctypes.POINTER(ctypes.c_void_p), "const char *const *": _library._N,
                 "finshell_section_builder *": ctypes.c_void_p, "finshell_section_builder **": ctypes.POINTER(ctypes.c_void_p), "const finshell_elements *": _library._E,
                 "const finshell_law *": ctypes.POINTER(_library.CLaw), "finshell_law_finding *": ctypes.POINTER(_library.CFinding),
                 "finshell_properties *": ctypes.POINTER(_library.CProperties), "finshell_layer *": ctypes.POINTER(_library.CLayer),
                 "finshell_parameter *": ctypes.POINTER(_library.CParameter),
                 "finshell_field_entry *": ctypes.POINTER(_library.CField), "void": None, "const int32_t *": _library._C,
                 "const finshell_mesh *": _library._M, "int64_t *": _library._L, "const finshell_section *const *": _library._H,
                 "const finshell_assembly *": ctypes.c_void_p, "finshell_assembly *": ctypes.c_void_p, "finshell_assembly **": _library._H}
        found = re.findall(r"^FINSHELL_API (const char \*|int32_t |void )(finshell_\w+)\(([^)]*)\);", self.text, re.M)
        self.assertEqual({name for _, name, _ in found}, set(_library._PROTOTYPES))
        for result, name, arguments in found:
            with self.subTest(name=name):
                types = [] if arguments == "void" else [
                    kinds[re.sub(r"\s*\w+$", "", " ".join(a.split())).replace(" *", " *")] for a in arguments.split(",")]
                self.assertEqual(_library._PROTOTYPES[name], (kinds[result.strip()], types))

    def test_structures(self):
        for name, structure in (("status", _library.Status), ("parameter", _library.CParameter), ("properties", _library.CProperties), ("layer", _library.CLayer),
                                ("elements", _library.CElements), ("points", _library.CPoints), ("law", _library.CLaw),
                                ("law_finding", _library.CFinding), ("mesh", _library.CMesh), ("field_entry", _library.CField)):
            fields = re.search(rf"typedef struct finshell_{name} \{{(.*?)\}}", self.text, re.S).group(1)
            names = [re.search(r"(\w+)(\[\d+\])?$", f.strip()).group(1) for f in fields.split(";") if f.strip()]
            self.assertEqual([f[0] for f in structure._fields_], names)
        self.assertEqual(ctypes.sizeof(_library.Status), 256)

    def test_numbers(self):
        self.assertEqual([int(n) for n in finshell.version().split(".")], [_library.library().finshell_version_number() // d % 100 for d in (10000, 100, 1)])
        self.assertEqual(finshell.ABI, int(re.search(r"define FINSHELL_ABI\s+(\d+)", self.text).group(1)))
        for rotation in finshell.Rotation:
            self.assertIn(f"FINSHELL_ROTATION_{rotation.name} = {rotation.value}", self.text)
        for sheet in finshell.Sheet:
            self.assertIn(f"FINSHELL_SHEET_{sheet.name} = {sheet.value}", self.text)
        self.assertEqual(finshell.version(), finshell.__version__)
        self.assertEqual(finshell.message(0), "done")


class Elements(unittest.TestCase):
    def test_what_is_asked_for(self):
        u, t = bent()
        section = rubber()
        everything = section.evaluate(SQUARE, u, t)
        self.assertEqual([everything.energy.shape, everything.force.shape, everything.tangent.shape], [(2,), (2, 18), (2, 18, 18)])
        self.assertGreater(everything.energy.min(), 0)
        alone = section.evaluate(SQUARE, u, t, energy=False, tangent=False)
        self.assertIsNone(alone.energy)
        self.assertIsNone(alone.tangent)
        np.testing.assert_allclose(alone.force, everything.force, atol=1e-12)
        nothing = section.evaluate(np.zeros((0, 3, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3, 3)))
        self.assertEqual(nothing.energy.shape, (0,))

    def test_any_memory_layout(self):
        u, t = bent()
        section = rubber()
        expected = section.evaluate(SQUARE, u, t).force
        found = section.evaluate(np.asfortranarray(SQUARE), u[::-1][::-1], t.astype(np.float32).tolist()).force
        np.testing.assert_allclose(found, expected, atol=1e-6)
        self.assertTrue((section.evaluate(np.asfortranarray(SQUARE), u[::-1][::-1], t.tolist()).force == expected).all())

    def test_conventions(self):
        u, t = bent()
        section = rubber()
        q = finshell.rotation_exp(t.reshape(-1, 3)).reshape(2, 3, 4)
        identity = np.tile([1.0, 0, 0, 0], (2, 3, 1))
        energies = [section.evaluate(SQUARE, u, t).energy, section.evaluate(SQUARE, u, q, finshell.Rotation.QUATERNION).energy,
                    section.evaluate(SQUARE, u, t, finshell.Rotation.INCREMENT, state=identity).energy,
                    section.evaluate(SQUARE, u, 0 * t, finshell.Rotation.INCREMENT, state=q).energy]
        for energy in energies:
            np.testing.assert_allclose(energy, energies[0], rtol=1e-12)

    def test_errors(self):
        u, t = bent()
        section = rubber()
        with self.assertRaisesRegex(ValueError, r"u has the shape \(2, 3\), expected \(2, 3, 3\)"):
            section.evaluate(SQUARE, u[:, 0], t)
        with self.assertRaisesRegex(ValueError, r"rotations has the shape .*, expected \(2, 3, 4\)"):
            section.evaluate(SQUARE, u, t, finshell.Rotation.QUATERNION)
        with self.assertRaisesRegex(finshell.Error, "state is NULL"):
            section.evaluate(SQUARE, u, t, finshell.Rotation.INCREMENT)
        with self.assertRaisesRegex(finshell.Error, "known laws are"):
            finshell.Section("cheese", {}, 0.1)
        with self.assertRaisesRegex(finshell.Error, "unknown option 'points'"):
            rubber(points=3)
        with self.assertRaisesRegex(finshell.Error, "layer 2: thickness is"):
            finshell.Section([finshell.Layer("neo_hookean", {"mu": 1.0}, h) for h in (1.0, -1.0)])
        u[1, 2] = u[1, 1] + SQUARE[1, 1] - SQUARE[1, 2]
        with self.assertRaises(finshell.Recoverable) as caught:
            section.evaluate(SQUARE, u, t)
        self.assertEqual((caught.exception.code, caught.exception.index, caught.exception.failed), (1, 1, 1))
        result = section.evaluate(SQUARE, u, t, raise_errors=False)
        self.assertEqual(result.codes.tolist(), [0, 1])
        self.assertEqual(abs(result.tangent[1]).max(), 0)
        u[0, 0, 0] = np.nan
        with self.assertRaises(finshell.Error) as caught:
            section.evaluate(SQUARE, u, t)
        self.assertNotIsInstance(caught.exception, finshell.Recoverable)
        self.assertEqual((caught.exception.code, caught.exception.index, caught.exception.failed), (-3, 0, 2))

    def test_normals(self):
        u, t = bent()
        section = rubber()
        flat = np.tile([0, 0, 2.0], (2, 3, 1))
        curved = flat + 0.3 * np.random.default_rng(3).normal(size=flat.shape)
        a, b = section.evaluate(SQUARE, u, t), section.evaluate(SQUARE, u, t, normals=flat)
        self.assertTrue((a.tangent == b.tangent).all() and (a.force == b.force).all() and (a.energy == b.energy).all())
        c = section.evaluate(SQUARE, u, t, normals=curved, threads=2)
        self.assertFalse((a.force == c.force).any())
        np.testing.assert_allclose(section.evaluate(SQUARE, u, t, normals=(3 * curved).tolist()).force, c.force, atol=1e-12)
        self.assertTrue((section.recover(SQUARE, u, t).moment == section.recover(SQUARE, u, t, normals=flat).moment).all())
        self.assertFalse((section.recover(SQUARE, u, t).moment == section.recover(SQUARE, u, t, normals=curved).moment).all())
        with self.assertRaisesRegex(ValueError, r"normals has the shape \(2, 3\), expected \(2, 3, 3\)"):
            section.evaluate(SQUARE, u, t, normals=flat[:, 0])
        curved[1, 2] = [1, 0, -1]
        for call in (section.evaluate, section.recover):
            with self.assertRaisesRegex(finshell.Error, r"element 1 \(from 0\): the normal at node 2 \(from 0\) is 135.0 degrees") as caught:
                call(SQUARE, u, t, normals=curved)
            self.assertEqual((caught.exception.code, caught.exception.index, caught.exception.failed), (-1, 1, 1))

    def test_thickness_offset_growth(self):
        u, t = bent()
        thick, off = np.array([0.2, 0.05]), np.array([0.0, 0.01])
        r = rubber().evaluate(SQUARE, u, t, thickness=thick, offset=off)
        m = finshell.Section("mooney_rivlin", {"c10": 80, "c01": 20}, 0.1, density=3).mass(SQUARE, lumped=True, thickness=thick, offset=off)
        for e in range(2):
            own = finshell.Section("mooney_rivlin", {"c10": 80, "c01": 20}, thick[e], offset=off[e], density=3)
            one = own.evaluate(SQUARE, u, t)
            np.testing.assert_allclose(r.force[e], one.force[e], atol=1e-10 * abs(one.force).max())
            np.testing.assert_allclose(m[e], own.mass(SQUARE, lumped=True)[e], rtol=1e-13)
        # stretched by 1.25 before it was built in; and grown to where it is
        stretched = finshell.growth([0.8, 0.8], thickness=1.5625)[:, None, :]
        self.assertEqual(stretched.shape, (2, 1, 4))
        force = rubber().recover(SQUARE, 0 * u, 0 * t, growth=stretched).stress[:, 1]
        # Mooney-Rivlin, equibiaxial
        s = 2 * (80 * (1.25**2 - 1.25**-4) + 20 * (1.25**4 - 1.25**-2))
        np.testing.assert_allclose(force, np.tile([s, s, 0], (2, 1)), atol=1e-9)
        grown = finshell.growth(1.1, 0.9, 1.2) * np.ones((2, 1, 4))
        there = SQUARE * np.array([1.1, 0.9, 1]) - SQUARE
        result = rubber().evaluate(SQUARE, there, 0 * t, growth=grown)
        self.assertLess(abs(result.force).max(), 1e-11)
        np.testing.assert_allclose(rubber().recover(SQUARE, there, 0 * t, growth=grown).stretch, 1.2)
        np.testing.assert_allclose(rubber().recover_field("principal_stretch", SQUARE, there, 0 * t, growth=grown), 1.0)
        with self.assertRaisesRegex(ValueError, r"growth has the shape \(2, 4\), expected \(2, 1, 4\)"):
            rubber().evaluate(SQUARE, u, t, growth=grown[:, 0])
        with self.assertRaisesRegex(finshell.Error, r"element 1 \(from 0\): its thickness is -1"):
            rubber().evaluate(SQUARE, u, t, thickness=[0.1, -1])

    def test_curved_golden(self):
        with open(os.path.join(SOURCE, "test", "data", "element_golden_curved.txt"), encoding="utf-8") as f:
            lines = [line.split(None, 1) for line in f if not line.startswith("#")]
        cases = [dict(lines[i:i + 8]) for i in range(0, len(lines), 8)]
        self.assertEqual(len(cases), 16)
        for case in cases:
            law = ("mooney_rivlin", {"c10": 80.0, "c01": 20.0}) if "mooney_rivlin c10=80 c01=20" in case["case"] else \
                ("st_venant_kirchhoff", {"e": 1000.0, "nu": 0.3})
            self.assertIn("formulation: S; arc: 1; beta0: 0.01", case["case"])
            X, m, u, q, energy, force, triangle = (np.array(case[k].split(), float) for k in ("X", "m", "u", "q", "energy", "force", "tangent"))
            r = finshell.Section(*law, 0.1, beta0=0.01, thickness_points=2).evaluate(
                X.reshape(1, 3, 3), u.reshape(1, 3, 3), q.reshape(1, 3, 4), finshell.Rotation.QUATERNION, normals=m.reshape(1, 3, 3))
            np.testing.assert_allclose(r.energy, energy, rtol=2e-12)
            np.testing.assert_allclose(r.force[0], force, rtol=0, atol=2e-12 * abs(force).max())
            np.testing.assert_allclose(r.tangent[0][np.tril_indices(18)], triangle, rtol=0, atol=2e-12 * abs(triangle).max())

    def test_straight_sides(self):
        # a side that is not bent: its drilling rotations do no work through the displacement along it
        u, t = bent()
        t[:, :, 2] = 0.1 * np.arange(3)
        section = rubber()
        free, none = section.evaluate(SQUARE, u, t).force, section.evaluate(SQUARE, u, t, straight=np.zeros((2, 3))).force
        self.assertTrue((free == none).all())
        one = section.evaluate(SQUARE, u, t, straight=[[False, True, False], [False, False, False]]).force
        self.assertTrue((one[1] == free[1]).all())
        self.assertFalse((one[0] == free[0]).any())
        self.assertFalse((section.recover(SQUARE, u, t, straight=np.ones((2, 3))).membrane_force
                          == section.recover(SQUARE, u, t).membrane_force).any())

    def test_toward(self):
        section = finshell.Section("holzapfel_2005", {"mu": 1.0, "k1": 10.0, "k2": 1.0, "rho": 0.1}, 0.1)
        rest, motion = np.zeros((2, 3, 3)), np.zeros((2, 18))
        slack = section.evaluate(SQUARE, rest, rest).tangent
        motion[:, [6, 12]] = 0.01  # nodes 1 and 2 of the first triangle along its fibres
        taut = section.evaluate(SQUARE, rest, rest, toward=motion).tangent
        self.assertGreater(taut[0, 6, 6], 1.5 * slack[0, 6, 6])
        np.testing.assert_allclose(section.evaluate(SQUARE, rest, rest, toward=-motion).tangent[0], slack[0], atol=1e-12)
        with self.assertRaisesRegex(finshell.Error, "NaN"):
            section.evaluate(SQUARE, rest, rest, toward=motion * np.nan)

    def test_mass(self):
        section = rubber(density=3.0)
        m, lumped = section.mass(SQUARE), section.mass(SQUARE, lumped=True)
        along = np.tile([1.0, 0, 0, 0, 0, 0], 3)
        self.assertAlmostEqual(sum(along @ k @ along for k in m), 0.3, places=14)
        self.assertAlmostEqual((lumped @ along).sum(), 0.3, places=14)
        self.assertGreater(np.linalg.eigvalsh(m[0]).min(), 0)

    def test_membranes(self):
        sheet = finshell.Section("neo_hookean", {"mu": 2.0}, 0.1, membrane=True, wrinkling=True, density=3.0)
        plain = finshell.Section("neo_hookean", {"mu": 2.0}, 0.1, membrane=True, wrinkling=False)
        self.assertEqual((sheet.freedoms, plain.freedoms, rubber().freedoms), (9, 9, 18))
        for l1, l2, state in ((1.5, 0.6, finshell.Sheet.WRINKLED), (1.2, 1.1, finshell.Sheet.TAUT), (0.9, 0.8, finshell.Sheet.SLACK)):
            u = SQUARE * np.array([l1 - 1, l2 - 1, 0])
            r = sheet.evaluate(SQUARE, u)
            self.assertEqual((r.force.shape, r.tangent.shape), ((2, 9), (2, 9, 9)))
            for j in range(9):
                d = np.zeros(9)
                d[j] = 1e-6
                ahead, behind = (sheet.evaluate(SQUARE, u + s * d.reshape(3, 3), tangent=False) for s in (1, -1))
                np.testing.assert_allclose(r.force[:, j], (ahead.energy - behind.energy) / 2e-6, atol=1e-9)
                np.testing.assert_allclose(r.tangent[:, :, j], (ahead.force - behind.force) / 2e-6, atol=1e-8)
            found = sheet.wrinkles(SQUARE, u)
            np.testing.assert_array_equal(found.state, state)
            along = [1, 0, 0] if state == finshell.Sheet.WRINKLED else [0, 0, 0]
            np.testing.assert_allclose(np.abs(found.ridge), [along, along], atol=1e-14)
            np.testing.assert_array_equal(plain.wrinkles(SQUARE, u).state, finshell.Sheet.TAUT)
            np.testing.assert_array_equal(sheet.recover(SQUARE, u).moment, 0)
            np.testing.assert_array_equal(sheet.recover_field("membrane_force", SQUARE, u), sheet.recover(SQUARE, u).membrane_force)
            np.testing.assert_array_equal(sheet.recover_field("wrinkle_state", SQUARE, u), state)
            np.testing.assert_array_equal(sheet.recover_field("wrinkle_ridge", SQUARE, u), found.ridge)
        u = SQUARE * np.array([0.5, -0.4, 0])
        np.testing.assert_allclose(sheet.evaluate(SQUARE, u).energy, 0.05 * (1.5**2 + 2 / 1.5 - 3), atol=1e-7)
        np.testing.assert_allclose(sheet.recover(SQUARE, u).stretch, 1.5**-0.5, rtol=1e-14)
        self.assertGreater(plain.evaluate(SQUARE, u).energy[0], sheet.evaluate(SQUARE, u).energy[0] + 0.01)
        np.testing.assert_array_equal(sheet.evaluate(SQUARE, u, 0 * u).tangent, sheet.evaluate(SQUARE, u).tangent)
        self.assertAlmostEqual(sheet.mass(SQUARE, lumped=True).sum(), 3 * 0.3, places=14)
        self.assertAlmostEqual(sheet.mass(SQUARE).sum(), 3 * 0.3, places=14)
        layers = [finshell.Layer("neo_hookean", {"mu": 2.0}, 0.05)] * 2
        two = finshell.Section(layers, membrane=True, wrinkling=True, slack=1e-6)
        np.testing.assert_allclose(two.evaluate(SQUARE, u).force, sheet.evaluate(SQUARE, u).force, atol=1e-15)
        self.assertEqual(two.evaluate(SQUARE, u, toward=np.ones((2, 9))).force.shape, (2, 9))
        # the volume behind membranes: rotations of zeros will do, however they are turned
        for angle in (0.5, np.pi, 6.0):
            turn = finshell.rotation_matrix(finshell.rotation_exp([[0.3, angle, 0.1]]))[0]
            x = 1.1 * SQUARE @ turn.T + np.array([0.1, 0.2, 0.5])
            volume = sum(np.dot(a, np.cross(b, c)) / 6 for a, b, c in x)
            self.assertAlmostEqual(finshell.enclosed_volume(SQUARE, x - SQUARE, 0 * x), volume, places=14)

    def test_what_a_section_is(self):
        plies = [finshell.Layer("orthotropic", {"e1": 3300.0, "e2": 1100.0, "nu12": 0.25, "g12": 660.0}, 0.1, angle, density=2.0) for angle in (0.0, 90.0)]
        s = finshell.Section(plies, offset=0.05, formulation=2)
        self.assertEqual((s.freedoms, s.formulation, s.isotropic, s.membrane, s.wrinkling, s.offset), (18, 2, False, False, False, 0.05))
        self.assertAlmostEqual(s.thickness, 0.2, places=15)
        self.assertAlmostEqual(s.areal_mass, 0.4, places=15)
        self.assertAlmostEqual(s.first_moment, 0.4 * 0.05, places=15)
        self.assertAlmostEqual(s.rotatory_inertia, 0.4 * (0.2**2 / 12 + 0.05**2), places=15)
        self.assertEqual([(layer.material, layer.thickness, layer.angle, layer.points, layer.density) for layer in s.layers],
                         [("orthotropic", 0.1, angle, 2, 2.0) for angle in (0.0, 90.0)])
        self.assertLessEqual(plies[0].parameters.items(), s.layers[0].parameters.items())
        again = finshell.Section(s.layers, offset=s.offset, formulation=s.formulation)
        u, t = bent()
        np.testing.assert_array_equal(again.evaluate(SQUARE, u, t).tangent, s.evaluate(SQUARE, u, t).tangent)
        q = np.array([3300, 1100]) / (1 - 0.25**2 / 3)
        k = s.stiffness
        np.testing.assert_allclose(k[:3, :3], 0.1 * np.array([[q.sum(), 0.5 * q[1], 0], [0.5 * q[1], q.sum(), 0], [0, 0, 1320]]), atol=1e-11)
        np.testing.assert_allclose(k[0, 3], 0.05 * 0.1 * q.sum() + 0.05 * 0.1 * (q[1] - q[0]), rtol=1e-12)
        np.testing.assert_array_equal(k, k.T)
        self.assertEqual(repr(s), "<Section of a shell: orthotropic 0.1, orthotropic 0.1 at 90>")
        sheet = finshell.Section("neo_hookean", {"mu": 2.0}, 0.1, membrane=True, wrinkling=True, density=3)
        self.assertEqual(repr(sheet), "<Section of a wrinkling membrane: neo_hookean 0.1>")
        self.assertTrue(sheet.isotropic and sheet.membrane and sheet.wrinkling and sheet.freedoms == 9)
        self.assertEqual(sheet.layers, (finshell.Layer("neo_hookean", {"mu": 2.0}, 0.1, density=3.0),))
        np.testing.assert_array_equal(sheet.stiffness[3:], 0)
        with self.assertRaisesRegex(finshell.Error, "a section needs at least one layer"):
            finshell.Section([])
        with self.assertRaisesRegex(finshell.Error, "layer 2: unknown material law 'cheese'"):
            finshell.Section([*s.layers[:1], finshell.Layer("cheese", {}, 0.1)])

    def test_errors_of_membranes(self):
        u, _ = bent()
        with self.assertRaisesRegex(finshell.Error, "only a membrane has the option 'wrinkling': give membrane = 1, too"):
            rubber(wrinkling=True)
        with self.assertRaisesRegex(finshell.Error, "a membrane has no option 'offset': it does not bend"):
            rubber(membrane=True, offset=0.1)
        with self.assertRaisesRegex(finshell.Error, "layer 1: points is 3, and a membrane has none"):
            finshell.Section([finshell.Layer("neo_hookean", {"mu": 1.0}, 0.1, points=3)], membrane=True)
        with self.assertRaisesRegex(finshell.Error, "rotations is NULL"):
            rubber().evaluate(SQUARE, u)
        with self.assertRaisesRegex(finshell.Error, "the section is that of a shell"):
            rubber().wrinkles(SQUARE, u)
        with self.assertRaisesRegex(ValueError, r"toward has the shape \(2, 18\), expected \(2, 9\)"):
            rubber(membrane=True).evaluate(SQUARE, u, toward=np.ones((2, 18)))

    def test_pressure(self):
        u, _ = bent()
        u += 0.1 * np.random.default_rng(1).normal(size=u.shape)
        for symmetric in (False, True):
            f, k = finshell.follower_pressure(2.0, SQUARE, u, symmetric=symmetric, origin=[0.1, 0.2, 0.3])
            for j in range(9):
                d = np.zeros(9)
                d[j] = 1e-6
                difference = [finshell.follower_pressure(2.0, SQUARE, u + s * d.reshape(3, 3), symmetric=symmetric,
                                                         origin=[0.1, 0.2, 0.3], stiffness=False)[0] for s in (1, -1)]
                np.testing.assert_allclose(k[:, :, j], (difference[0] - difference[1]) / 2e-6, atol=1e-8)
            self.assertEqual(np.allclose(k, k.transpose(0, 2, 1)), symmetric)

    def test_pressure_on_elements(self):
        u, t = bent()
        rng = np.random.default_rng(1)
        u += 0.1 * rng.normal(size=u.shape)
        origin = [0.1, 0.2, 0.3]
        tilted = np.array([0, 0, 1.0]) + 0.2 * rng.uniform(-1, 1, u.shape)
        moves = np.arange(18) % 6 < 3
        for symmetric in (False, True):
            f, k = finshell.follower_pressure(2.0, SQUARE, u, symmetric=symmetric, origin=origin)
            for keywords in ({}, {"normals": np.tile([0, 0, 3.0], (2, 3, 1))}):
                flat = finshell.pressure(2.0, SQUARE, u, t, symmetric=symmetric, origin=origin, **keywords)
                np.testing.assert_array_equal(flat.force[:, moves], f)
                np.testing.assert_array_equal(flat.force[:, ~moves], 0)
                np.testing.assert_array_equal(flat.stiffness[:, moves][:, :, moves], k)
            curved = finshell.pressure([2.0, 2.0], SQUARE, u, t, normals=tilted, symmetric=symmetric, origin=origin)
            self.assertGreater(np.abs(curved.force[:, ~moves]).max(), 1e-3)
            for j in range(18):
                d = np.zeros((2, 3, 6))
                d.reshape(2, 18)[:, j] = 1e-6
                ahead, behind = (finshell.pressure(2.0, SQUARE, u + s * d[:, :, :3], t + s * d[:, :, 3:], normals=tilted,
                                                   symmetric=symmetric, origin=origin, stiffness=False) for s in (1, -1))
                self.assertIsNone(ahead.stiffness)
                np.testing.assert_allclose(curved.stiffness[:, :, j], (ahead.force - behind.force) / 2e-6, atol=1e-8)
                if symmetric:
                    np.testing.assert_allclose(curved.force[:, j], (ahead.volume - behind.volume) / 1e-6, atol=1e-8)
            volume = finshell.enclosed_volume(SQUARE, u, finshell.rotation_exp(t.reshape(-1, 3)).reshape(2, 3, 4),
                                              finshell.Rotation.QUATERNION, normals=tilted, origin=origin)
            self.assertAlmostEqual(volume, curved.volume.sum(), places=14)
            self.assertNotAlmostEqual(volume, finshell.enclosed_volume(SQUARE, u, t, origin=origin), places=3)
        with self.assertRaisesRegex(finshell.Error, "normal at node 2 .* is zero"):
            finshell.pressure(1.0, SQUARE, u, t, normals=tilted * np.array([1, 1, 0])[None, :, None])
        with self.assertRaises(ValueError):
            finshell.enclosed_volume(SQUARE, u, t, origin=[1.0, 2.0])
        failed = finshell.pressure(np.array([1.0, np.nan]), SQUARE, u, t, raise_errors=False)
        self.assertEqual((list(failed.codes), failed.force[1].any(), failed.force[0].any()), ([0, -3], False, True))

    def test_recovery_of_a_pure_stretch(self):
        stretch = 1.3
        u = np.zeros((2, 3, 3))
        u[:, :, 0] = (stretch - 1) * SQUARE[:, :, 0]
        r = rubber().recover(SQUARE, u, np.zeros((2, 3, 3)))
        thickness = 1 / stretch
        np.testing.assert_allclose(r.stretch, thickness, rtol=1e-12)
        # incompressible Mooney-Rivlin, width kept: sigma_11 = 2 (c10 + c01) (l^2 - 1/l^2)
        np.testing.assert_allclose(r.stress[:, :, 0], 200 * (stretch**2 - thickness**2), rtol=1e-10)
        # second Piola-Kirchhoff resultant: N = h sigma_11 / l^2 (J = 1)
        np.testing.assert_allclose(r.membrane_force[:, 0], 0.1 * 200 * (1 - thickness**4), rtol=1e-10)
        np.testing.assert_allclose(r.moment, 0, atol=1e-12)

    def test_fields_by_name(self):
        table = {f.name: f for f in finshell.fields()}
        self.assertEqual(table["stress"].components, ("11", "22", "12"))
        self.assertEqual((table["stress"].at, table["fibre_stretch"].at, table["energy_density"].at), ("surfaces", "layers", "element"))
        u, t = bent()
        section = rubber()
        r = section.recover(SQUARE, u, t)
        np.testing.assert_array_equal(section.recover_field("stress", SQUARE, u, t), r.stress)
        np.testing.assert_array_equal(section.recover_field("moment", SQUARE, u, t), r.moment)
        np.testing.assert_array_equal(section.recover_field("thickness_stretch", SQUARE, u, t), r.stretch)
        values = np.linalg.eigvalsh(r.stress[:, :, [0, 2, 2, 1]].reshape(2, 3, 2, 2))[:, :, ::-1]
        np.testing.assert_allclose(section.recover_field("principal_stress", SQUARE, u, t), values, rtol=1e-12, atol=1e-12)
        density = section.recover_field("energy_density", SQUARE, u, t)
        np.testing.assert_allclose(density * 0.5 * 0.1, section.evaluate(SQUARE, u, t).energy, rtol=1e-12)
        layer = finshell.Layer("st_venant_kirchhoff", {"e": 1000.0, "nu": 0.3}, 0.05)
        two = finshell.Section([layer, layer])
        self.assertEqual(two.recover_field("material_stress", SQUARE, u, t).shape, (2, 2, 3))
        self.assertEqual(two.recover_field("strain", SQUARE[:0], u[:0], t[:0]).shape, (0, 3, 3))
        with self.assertRaisesRegex(ValueError, "unknown field 'colour', there are: .*strain"):
            section.recover_field("colour", SQUARE, u, t)
        u[1, 0, 0] = np.nan
        with self.assertRaises(finshell.Error):
            section.recover_field("strain", SQUARE, u, t)
        self.assertTrue((section.recover_field("strain", SQUARE, u, t, raise_errors=False)[1] == 0).all())

    def test_layers(self):
        layer = finshell.Layer("st_venant_kirchhoff", {"e": 1000.0, "nu": 0.3}, 0.05, angle=30.0)
        u, t = bent()
        two = finshell.Section([layer, layer]).evaluate(SQUARE, u, t).energy
        one = finshell.Section("st_venant_kirchhoff", {"e": 1000.0, "nu": 0.3}, 0.1).evaluate(SQUARE, u, t).energy
        np.testing.assert_allclose(two, one, rtol=1e-12)

    def test_rotations(self):
        rng = np.random.default_rng(2)
        v, w = rng.uniform(-1.5, 1.5, size=(5, 3)), rng.normal(size=(5, 3))
        q = finshell.rotation_exp(v)
        np.testing.assert_allclose(finshell.rotation_log(q), v, atol=1e-14)
        moved = finshell.update(q, w)
        np.testing.assert_allclose(moved, finshell.compose(finshell.rotation_exp(w), q), atol=1e-14)
        a, b = finshell.rotation_matrix(finshell.rotation_exp(w)), finshell.rotation_matrix(q)
        np.testing.assert_allclose(finshell.rotation_matrix(moved), a @ b, atol=1e-14)
        np.testing.assert_allclose(finshell.rotation_tangent(v) @ v[:, :, None], v[:, :, None], atol=1e-14)

    def test_materials(self):
        self.assertIn("mooney_rivlin", finshell.material_names())
        for name in finshell.material_names():
            parameters = finshell.material_parameters(name)
            values = {p.name: p.example for p in parameters if p.required or p.example != p.default}
            self.assertIsInstance(finshell.Section(name, values, 0.1), finshell.Section)
        with self.assertRaises(finshell.Error):
            finshell.material_parameters("cheese")

    def test_sections_are_freed_once(self):
        for _ in range(100):
            rubber()
        gc.collect()
        section = rubber()
        self.assertGreater(section.evaluate(SQUARE, *bent()).energy.sum(), 0)


class Finding(unittest.TestCase):
    """Where the library is looked for."""

    def python(self, code, folder=PACKAGE, **environment):
        full = dict(os.environ, PYTHONPATH=folder, **environment)
        return subprocess.run([sys.executable, "-c", code], env=full, capture_output=True, text=True, timeout=100, check=False)

    def test_environment_variable(self):
        done = self.python("import finshell; finshell.version()", FINSHELL_LIB="/nowhere/libfinshell.so")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("set FINSHELL_LIB", done.stderr)

    def test_another_abi(self):
        done = self.python("from finshell import _library as l; l.ABI = 99; l.library()")
        self.assertIn(f"has the ABI number {finshell.ABI}, this package needs 99", done.stderr)

    @unittest.skipUnless(os.environ.get("FINSHELL_LIB"), "needs FINSHELL_LIB")
    def test_beside_the_package(self):
        with tempfile.TemporaryDirectory() as folder:
            copy = os.path.join(os.path.realpath(folder), "finshell")
            shutil.copytree(os.path.join(PACKAGE, "finshell"), copy)
            library = os.path.join(copy, f"libfinshell.so.{finshell.ABI}")
            shutil.copy(os.environ["FINSHELL_LIB"], library)
            done = self.python("import finshell; print(finshell.version(), finshell.find_library())", folder, FINSHELL_LIB="")
            self.assertEqual(done.stdout.split(), [finshell.__version__, library], msg=done.stderr)


    @unittest.skipUnless(os.environ.get("FINSHELL_LIB"), "needs FINSHELL_LIB")
    def test_where_it_is_installed(self):
        # by pkg-config: a folder that nothing else knows
        with tempfile.TemporaryDirectory() as folder:
            folder = os.path.realpath(folder)
            library = os.path.join(folder, f"libfinshell.so.{finshell.ABI}")
            shutil.copy(os.environ["FINSHELL_LIB"], library)
            with open(os.path.join(folder, "finshell.pc"), "w", encoding="utf-8") as f:
                f.write(f"libdir={folder}\nName: finshell\nDescription: a test\nVersion: 1\n")
            done = self.python("import finshell; print(finshell.version(), finshell.find_library())", FINSHELL_LIB="",
                               PKG_CONFIG_PATH=folder)
            self.assertEqual(done.stdout.split()[0], finshell.__version__, msg=done.stderr)
            if not os.path.exists(f"/usr/local/lib/libfinshell.so.{finshell.ABI}"):
                self.assertEqual(done.stdout.split()[1], library)


@unittest.skipUnless(importlib.util.find_spec("flit_core"), "flit_core is not installed")
class Wheel(unittest.TestCase):
    """pip install api/python: the package whole, and nothing left in the sources."""

    def test_wheel(self):
        def listing():
            return sorted(os.path.join(here, n) for here, folders, names in os.walk(PACKAGE) for n in folders + names
                          if "__pycache__" not in os.path.join(here, n))
        before = listing()
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps",
                                   "--no-build-isolation", "--target", folder, PACKAGE], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, msg=done.stderr)
            installed = {n for n in os.listdir(os.path.join(folder, "finshell")) if n != "__pycache__"}
        self.assertEqual(installed, {n for n in os.listdir(os.path.join(PACKAGE, "finshell")) if n != "__pycache__"})
        self.assertEqual(listing(), before)


@unittest.skipUnless(hasattr(os, "fork"), "this system has no fork")
class Fork(unittest.TestCase):
    def test_threads_before_and_after_a_fork(self):
        # the threads of OpenMP stay behind in the parent; a child that waited for them would never end
        code = """
import finshell, numpy as np, os, sys
X = np.tile(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.]]), (2000, 1, 1))
u = 0.1 * np.sin(np.arange(X.size).reshape(X.shape))
section = finshell.Section("neo_hookean", {"mu": 1.0}, 0.1)
expected = section.evaluate(X, u, 0 * u, threads=2).tangent
child = os.fork()
for threads in (2, 0, 1):
    same = (section.evaluate(X, u, 0 * u, threads=threads).tangent == expected).all()
    if not same: os._exit(1)
if child == 0: os._exit(0)
print(os.waitpid(child, 0)[1])
"""
        environment = dict(os.environ, PYTHONPATH=PACKAGE, OMP_NUM_THREADS="2")
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual((done.returncode, done.stdout), (0, "0\n"), msg=done.stderr)


@unittest.skipUnless(importlib.util.find_spec("scipy"), "scipy is not installed")
class Example(unittest.TestCase):
    """examples/cantilever.py against the elastica (test/data/elastica_cantilever_end_shear.csv, force 4); examples/hemisphere.py
    against its own limit."""

    @classmethod
    def setUpClass(cls):
        sys.path.insert(0, os.path.join(PACKAGE, "examples"))

    def test_hemisphere(self):
        import hemisphere
        for cells, facets, normals in ((4, 0.3, 0.05), (8, 0.06, 0.007)):
            self.assertLess(abs(hemisphere.deflection(cells, True) / 0.0935 - 1), normals)
            self.assertGreater(abs(hemisphere.deflection(cells, False) / 0.0935 - 1), facets)

    def test_cantilever(self):
        import cantilever
        with open(os.path.join(SOURCE, "test", "data", "elastica_cantilever_end_shear.csv"), encoding="utf-8") as f:
            lines = [line.split(",") for line in f.read().split()]
        row = dict(zip(lines[0], map(float, lines[-1])))
        self.assertEqual(row["P"], 4.0)
        exact = np.array([-row["U_ext"], row["W_ext"]])
        tips = []
        for along in (10, 20):
            tip, history = cantilever.cantilever(along)
            self.assertLess(abs(tip[1]), 0.02)
            tips.append(tip[[0, 2]])
            for step, residuals in enumerate(history[3:]):
                # quadratic convergence at the end: the last residual is about the square of the one before, or rounding
                self.assertLess(residuals[-1], max(1e-8, 100 * residuals[-2] ** 2), msg=f"step {step + 4}: {residuals}")
                self.assertLessEqual(len(residuals), 12)
        np.testing.assert_allclose(tips[1], exact, rtol=2e-3)
        # the error falls with the square of the element size
        np.testing.assert_allclose((4 * tips[1] - tips[0]) / 3, exact, rtol=2e-4)


if __name__ == "__main__":
    unittest.main()
