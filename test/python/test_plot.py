#!/usr/bin/env python3
"""finshell-plot: pictures are read back; what stands where, in which colour, and what it says of what is not there."""
import contextlib
import io
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import numpy as np
from matplotlib import colormaps
from PIL import Image

sys.path.insert(0, str(Path(os.environ["FINSHELL_SOURCE_DIR"]) / "api" / "python"))
from finshell import _programs, _raster, plot  # noqa: E402

# a strip of a quarter, pulled along x: the displacement grows from 0 to 1 from left to right; half of it has no fibres, so no stretch of them
INPUT = """&job title = 'A strip, ''pulled''' name = 'strip' /
&mesh generator = 'rectangle' lengths = 2.0, 1.0 divisions = 8, 4 /
&element_set name = 'right' x = 1.0, 2.0 /
&element_set name = 'left' x = 0.0, 1.0 /
&material name = 'plain' law = 'neo_hookean' mu = 1.0 /
&material name = 'fibres' law = 'holzapfel_gasser_ogden' c = 1.0 k1 = 0.1 k2 = 1.0 angle = 0.0 /
&section material = 'plain' thickness = 0.1 element_set = 'left' /
&section material = 'fibres' thickness = 0.1 element_set = 'right' /
&support node_set = 'edge_x0' fixed = 'ux' /
&support node_set = 'edge_y0' fixed = 'uy' /
&support node_set = 'all' fixed = 'uz', 'rx', 'ry' /
&support node_set = 'edge_x1' ux = 1.0 /
&step load_levels = 0.25, 0.5, 0.75 first_increment = 0.25 automatic = .false. /
&monitor name = 'F' quantity = 'reaction' component = 'x' node_set = 'edge_x1' /
&monitor name = 'u' quantity = 'displacement' component = 'x' node_set = 'edge_x1' /
&output fields = 'stress', 'fibre_stretch' every = 2 /
"""
GREY = (191, 191, 191)


def close(colour, wanted, by=12):
    return np.abs(np.asarray(colour, float) - np.asarray(wanted, float)).max() <= by


def viridis(share):
    return np.array(colormaps["viridis"](share)[:3]) * 255


class Pictures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.keep = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.keep.name)
        (cls.folder / "strip.nml").write_text(INPUT)
        for word in ("run", "mesh"):
            done = subprocess.run([os.environ["FINSHELL_BIN"], word, "strip.nml"], cwd=cls.folder, capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stdout + done.stderr

    @classmethod
    def tearDownClass(cls):
        cls.keep.cleanup()

    def call(self, *words, name="strip"):
        """Exit code, and what was printed."""
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = plot.main([str(self.folder / name), *words])
        return code, out.getvalue() + err.getvalue()

    def picture(self, *words, ending=".png"):
        """Pixels of what a call draws (height, width, 3)."""
        path = self.folder / f"picture{ending}"
        path.unlink(missing_ok=True)
        code, text = self.call("-o", str(path), *words)
        self.assertEqual((code, text), (0, f"{path}\n"))
        with Image.open(path) as image:
            return np.asarray(image.convert("RGB")).astype(int)

    def shape(self, *words):
        """Without light and lines: the part of the picture that the structure fills, and its rows and columns."""
        whole = self.picture("--unlit", "--no-edges", "--size", "600x450", *words)
        inner = whole[54:-20, 20:490]
        some = np.flatnonzero((inner.min(axis=2) < 240).any(axis=0)), np.flatnonzero((inner.min(axis=2) < 240).any(axis=1))
        return inner[some[1][0]:some[1][-1] + 1, some[0][0]:some[0][-1] + 1]

    def test_colours_follow_the_field(self):
        part = self.shape("--component", "x")
        height, width = part.shape[:2]
        self.assertTrue(440 < width < 455)  # it fills the picture
        for share in (0.02, 0.98):
            self.assertTrue(close(part[height // 2, int(share * width)], viridis(share)), share)
        middle = part[height // 2, :, 1]  # green grows all along viridis
        self.assertTrue((np.diff(middle[5:-5]) >= -1).all())

    def test_shape_is_deformed(self):
        for words, ratio in (((), 3 / np.sqrt(2 / 3)), (("--deformed", "0"), 2.0), (("--increment", "0"), 2.0)):
            part = self.shape("--component", "x", *words)
            self.assertAlmostEqual(part.shape[1] / part.shape[0] / ratio, 1, delta=0.08, msg=words)
        self.assertGreater(self.shape("--deformed", "auto").shape[0], 180)

    def test_light_and_lines_change_it(self):
        plain, lit = self.picture("--unlit", "--no-edges"), self.picture("--no-edges")
        lined = self.picture("--unlit", "--edges")
        self.assertGreater((plain != lit).any(axis=2).sum(), 10000)
        self.assertGreater((plain != lined).any(axis=2).sum(), 1000)
        self.assertLess((plain != lined).any(axis=2).sum(), 100000)

    def test_views(self):
        above, below = self.shape("--deformed", "0", "--component", "x", "--view", "z"), self.shape("--deformed", "0", "--component", "x", "--view", "-z")
        self.assertEqual(above.shape, below.shape)
        self.assertLess(np.abs(above[5:-5, 5:-5] - below[-6:4:-1, 5:-5]).max(), 12)  # from below, y points down
        for words in (("--view", "-90,90"), ("--view=-90,90",)):
            np.testing.assert_array_equal(self.shape("--deformed", "0", "--component", "x", *words), above)
        self.assertLess(self.shape("--deformed", "0", "--view", "-60,25").shape[0], 0.8 * above.shape[0])

    def test_missing_values_are_grey(self):
        part = self.shape("--field", "fibre_stretch", "--component", "1")
        height, width = part.shape[:2]
        self.assertTrue(close(part[height // 2, width // 10], GREY, 3))
        self.assertFalse(close(part[height // 2, 9 * width // 10], GREY, 20))

    def test_constant_field_and_smoothing(self):
        flat, smooth = self.shape("--field", "stress"), self.shape("--field", "stress", "--smooth")
        # constants of elements have few colours, means at nodes have many
        self.assertLess(len(np.unique(flat.reshape(-1, 3), axis=0)) * 2, len(np.unique(smooth.reshape(-1, 3), axis=0)))

    def test_set(self):
        whole, right = self.shape("--deformed", "0"), self.shape("--deformed", "0", "--set", "right")
        self.assertAlmostEqual(whole.shape[1] / whole.shape[0], 2, delta=0.05)
        self.assertAlmostEqual(right.shape[1] / right.shape[0], 1, delta=0.05)
        edge = self.shape("--deformed", "0", "--set", "edge_x1")
        self.assertLess(edge.shape[1] / edge.shape[0], 0.5)

    def test_mirror(self):
        part = self.shape("--mirror", "xy", "--deformed", "0")
        self.assertAlmostEqual(part.shape[1] / part.shape[0], 2, delta=0.05)
        inner = part[3:-3, 3:-3]
        self.assertLess(np.abs(inner - inner[:, ::-1]).mean(), 4)
        self.assertLess(np.abs(inner - inner[::-1]).mean(), 4)
        # nodes in the plane are one: no line of a free edge runs through the middle
        middle, beside = part[:, part.shape[1] // 2], part[:, part.shape[1] // 2 + 9]
        self.assertLess(np.abs(middle[5:-5] - beside[5:-5]).max(), 40)

    def test_range_and_size(self):
        part = self.shape("--component", "x", "--range", "0", "10")
        self.assertTrue(close(part[part.shape[0] // 2, -5], viridis(0.1)))
        self.assertEqual(self.picture("--size", "400x300").shape, (300, 400, 3))

    def test_animation(self):
        path = self.folder / "strip.gif"
        self.assertEqual(self.call("-o", str(path), "--size", "400x300"), (0, f"{path}\n"))
        with Image.open(path) as image:
            frames = []
            for i in range(image.n_frames):
                image.seek(i)
                frames.append(np.asarray(image.convert("RGB")).astype(int))
        self.assertEqual(len(frames), 5)  # 0 and the four load levels
        for frame in frames:
            self.assertTrue(close(frame[2, 2], (255, 255, 255), 0))
        for one, other in zip(frames, frames[1:]):
            self.assertGreater((np.abs(one - other).max(axis=2) > 40).sum(), 300)
        with mock.patch("shutil.which", return_value=None), mock.patch.dict(sys.modules, {"imageio_ffmpeg": None}):
            self.refused("an .mp4 needs ffmpeg", "-o", "strip.mp4", "--size", "400x300")

    def test_film_goes_to_ffmpeg(self):
        script = self.folder / "ffmpeg"  # takes the pictures and writes how many bytes these are
        script.write_text("#!/bin/sh\nfor path; do :; done\nwc -c > \"$path\"\n")
        script.chmod(0o755)
        path = self.folder / "strip.mp4"
        with mock.patch.dict(os.environ, {"PATH": f"{self.folder}:{os.environ['PATH']}"}):
            self.assertEqual(self.call("-o", str(path), "--size", "401x301")[0], 0)
        self.assertEqual(int(path.read_text()), 5 * 400 * 300 * 3)

    def test_history(self):
        picture = self.picture("--history", "u", "F")
        blue = (np.abs(picture - np.array([31, 119, 180])).max(axis=2) < 30)
        self.assertGreater(blue.sum(), 500)
        where = np.argwhere(blue)
        left, right = where[where[:, 1].argmin()], where[where[:, 1].argmax()]
        self.assertGreater(left[0], right[0] + 200)  # the force grows
        self.picture("--history", "load_factor", "u", "F")

    def test_title_is_that_of_the_input(self):
        self.assertEqual(plot.Results(self.folder / "strip").title, "A strip, 'pulled'")

    def refused(self, sentence, *words, name="strip"):
        code, text = self.call(*words, name=name)
        self.assertEqual(code, 2, text)
        self.assertTrue(text.startswith("finshell-plot: "), text)
        self.assertIn(sentence, text)
        self.assertEqual(text.count("\n"), 1, text)

    def test_refusals(self):
        self.refused("no field 'temperature'; there are displacement, fibre_stretch_layer1, stress_bottom, stress_middle, stress_top",
                     "--field", "temperature")
        self.refused("no component 'w'; there are x, y, z, magnitude", "--component", "w")
        self.refused("no component 'x'; there are 11, 22, 12", "--field", "stress", "--component", "x")
        self.refused("no fields of increment 9; there are those of 0, 1, 2, 3, 4", "--increment", "9")
        self.refused("found no whole number, 'last' or 'all'", "--increment", "first")
        self.refused("a picture shows one increment", "--increment", "all")
        self.refused("no set 'top'; there are all, ", "--set", "top")
        self.refused("no view 'above'; there are iso, x", "--view", "above")
        self.refused("nothing.vtkhdf: no such file", name="nothing")
        self.refused("nothing.history.csv: no such file", "--history", "u", "F", name="nothing")
        self.refused("no column 'G'; there are increment, load_factor", "--history", "u", "G")
        self.refused("expected two columns", "--history", "u")
        self.refused("ends in one of .png", "-o", "strip.bmp")
        self.refused("'auto'", "--deformed", "much")
        self.refused("expected WIDTHxHEIGHT", "--size", "large")
        self.refused("expected 100 to 10000", "--size", "10x10")
        self.refused("out of x, y, z", "--mirror", "w")
        self.refused("no such map", "--colours", "none of these")
        self.refused("below the second", "--range", "2", "1")
        self.refused("pictures a second", "--rate", "0")
        self.refused("No such file", "-o", str(self.folder / "no" / "where.png"))
        (self.folder / "half.vtkhdf").write_bytes((self.folder / "strip.vtkhdf").read_bytes()[:3000])
        self.refused("not a result file of finshell", name="half")

    def test_without_its_packages(self):
        for program, package in (("plot", "h5py"), ("plot", "matplotlib"), ("fit", "scipy.optimize")):
            error = io.StringIO()
            with mock.patch.dict(sys.modules, {package: None}), contextlib.redirect_stderr(error):
                for name in ("finshell.plot", "finshell.results", "finshell.fit"):
                    sys.modules.pop(name, None)
                self.assertEqual(getattr(_programs, program)(), 2)
            self.assertRegex(error.getvalue(), rf"^finshell-{program}: .*{package}.*; `pip install h5py matplotlib scipy` installs what it needs\n$")

    def test_sets_of_another_mesh(self):
        text = (self.folder / "strip.msh").read_text()
        (self.folder / "other.vtkhdf").write_bytes((self.folder / "strip.vtkhdf").read_bytes())
        self.refused("so no sets are known; `finshell mesh INPUT.nml` writes it", "--set", "right", name="other")
        (self.folder / "other.msh").write_text(text.replace("2.0000000000000000E+000", "2.5000000000000000E+000"))
        self.refused("not the mesh of the results", "--set", "right", name="other")
        (self.folder / "other.msh").write_text(text[:900])
        self.refused("not a mesh as", "--set", "right", name="other")


class Raster(unittest.TestCase):
    def test_nearest_is_seen(self):
        square = np.array([[2, 2], [18, 2], [18, 18], [2, 18]], float)
        xy = np.concatenate([square[[0, 1, 2]][None], square[[0, 2, 3]][None]] * 2)
        # two squares that cut each other along the middle: each is seen where it is nearer
        tilt = np.array([1.0, -1.0, -1.0, 1.0])
        depth = np.concatenate([tilt[[[0, 1, 2], [0, 2, 3]]], -tilt[[[0, 1, 2], [0, 2, 3]]]])
        seen = _raster.rasterise(xy, depth, 20, 20)
        self.assertEqual(len(seen.pixel), 16 * 16)
        self.assertTrue((seen.weight >= -1e-9).all())
        left = seen.pixel % 20 < 10
        self.assertTrue((seen.face[left] < 2).all() and (seen.face[~left] >= 2).all())

    def test_many_small_triangles_in_parts(self):
        n = 200
        x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
        points = np.stack([x.ravel(), y.ravel()], axis=1)
        at = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
        triangles = np.concatenate([np.stack([at, at + 1, at + n + 2], 1), np.stack([at, at + n + 2, at + n + 1], 1)])
        whole = _raster.rasterise(points[triangles], np.zeros((2 * n * n, 3)), n, n)
        self.assertEqual(len(whole.pixel), n * n)
        with mock.patch.object(_raster, "CHUNK", 999):
            parts = _raster.rasterise(points[triangles], np.zeros((2 * n * n, 3)), n, n)
        np.testing.assert_array_equal(whole.face, parts.face)

    def test_normals_are_smooth_but_at_creases(self):
        a = np.linspace(0, np.pi / 2, 10)
        points = np.concatenate([np.stack([np.cos(a), np.sin(a), 0 * a], 1), np.stack([np.cos(a), np.sin(a), 1 + 0 * a], 1)])
        i = np.arange(9)
        triangles = np.concatenate([np.stack([i, i + 1, i + 11], 1), np.stack([i + 11, i, i + 10], 1)[:, ::-1]])  # turned against each other
        n = _raster.corner_normals(points, triangles)
        inner = (triangles % 10 > 0) & (triangles % 10 < 9)
        exact = points[triangles] * [1, 1, 0]
        self.assertGreater(np.abs(np.einsum("ijk,ijk->ij", n, exact))[inner].min(), 0.999)
        box = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
        corner = _raster.corner_normals(box, np.array([[0, 1, 2], [0, 3, 1]]))
        np.testing.assert_allclose(np.abs(corner[0]), [[0, 0, 1]] * 3, atol=1e-15)

    def test_free_edges(self):
        points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
        np.testing.assert_array_equal(_raster.sharp_edges(points, np.array([[0, 1, 2], [0, 2, 3]])), [[True, False, True], [True, True, False]])


if __name__ == "__main__":
    unittest.main()
