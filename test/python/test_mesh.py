#!/usr/bin/env python3
"""finshell-mesh: files of every kind become meshes that finshell reads, with their sets."""
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

sys.path.insert(0, str(Path(os.environ["FINSHELL_SOURCE_DIR"]) / "api" / "python"))
from finshell import _programs  # noqa: E402

try:
    import meshio
    from finshell import mesh as converter
except ImportError:
    meshio = None

REST = """&material name = 'm' law = 'linear_elastic' e = 1.0 nu = 0.3 /
&section thickness = 0.1 /
&support node_set = 'all' fixed = 'rz' /
&step control = 'linear' /
"""
POINTS = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0.5], [9, 9, 9]], float)


class Program(unittest.TestCase):
    def setUp(self):
        self.keep = tempfile.TemporaryDirectory()
        self.folder = Path(self.keep.name)
        self.addCleanup(self.keep.cleanup)

    def call(self, *arguments, code=0):
        out = io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
            self.assertEqual(converter.main([str(a) for a in arguments]), code, out.getvalue())
        return out.getvalue()

    def sets(self, name):
        """What finshell finds in a mesh: 'name: number' and the first line of its report."""
        (self.folder / "t.nml").write_text(f"&job name = 'out' /\n&mesh file = '{name}' /\n" + REST)
        done = subprocess.run([os.environ["FINSHELL_BIN"], "mesh", "t.nml"], cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return [line.strip() for line in done.stdout.splitlines()]

    def test_missing_package(self):
        out = io.StringIO()
        with mock.patch.object(_programs, "import_module", side_effect=ImportError("No module named 'meshio'")), contextlib.redirect_stderr(out):
            self.assertEqual(_programs.mesh(), 2)
        self.assertIn("`pip install meshio`", out.getvalue())

    @unittest.skipUnless(meshio, "meshio is not installed")
    def test_kinds(self):
        """Triangles and quadrilaterals through every kind of file that a surface comes in."""
        cells = [("triangle", np.array([[0, 1, 4], [0, 4, 3]])), ("quad", np.array([[1, 2, 5, 4]]))]
        for ending in ("vtu", "vtk", "ply", "obj", "off", "xdmf"):
            with self.subTest(ending):
                some = cells[:1] if ending in ("off", "obj") else cells
                meshio.write(self.folder / f"in.{ending}", meshio.Mesh(POINTS, some))
                self.call(self.folder / f"in.{ending}", self.folder / "in.msh")
                said = self.sets("in.msh")
                n = 4 if len(some) == 2 else 2
                self.assertTrue(said[0].startswith(f"{n + 2} nodes, {n} triangles, 1 connected part"), said[0])

    @unittest.skipUnless(meshio, "meshio is not installed")
    def test_sets(self):
        """Integer arrays are sets; others are not."""
        cells = [("triangle", np.array([[0, 1, 4], [0, 4, 3]])), ("quad", np.array([[1, 2, 5, 4]])), ("line", np.array([[0, 3], [2, 5]])),
                 ("tetra", np.array([[0, 1, 4, 6]]))]
        mesh = meshio.Mesh(POINTS, cells, point_data={"tip": np.array([0, 0, 1, 0, 0, 1, 0]), "height": POINTS[:, 2], "vector": POINTS.astype(int)},
                           cell_data={"part": [np.array([3, 3]), np.array([7]), np.array([3, 3]), np.array([9])],
                                      "soft": [np.array([1, 0]), np.array([1]), np.array([0, 0]), np.array([0])],
                                      "root": [np.array([0, 0]), np.array([0]), np.array([1, 0]), np.array([0])]})
        meshio.write(self.folder / "in.vtu", mesh)
        self.assertIn("1 cells that are no surfaces", self.call(self.folder / "in.vtu", self.folder / "in.msh"))
        said = self.sets("in.msh")
        for line in ("tip: 2", "part_3: 2", "part_7: 2", "soft: 3", "root: 1 edges", "part_3: 2 edges"):
            self.assertIn(line, said)
        self.assertFalse([line for line in said if line.startswith(("height", "vector", "part_9"))])

    @unittest.skipUnless(meshio, "meshio is not installed")
    def test_round_trip(self):
        """VTU as finshell writes it comes back with all sets; VTU of VTK and Gmsh files do as well."""
        (self.folder / "g.nml").write_text("&mesh generator = 'hole' lengths = 2, 1 radius = 0.3 divisions = 4, 4 /\n&node_set name = 'some' nodes = 2, 3 /\n"
                                           "&element_set name = 'far' x = 1.0, 2.0 /\n" + REST)
        subprocess.run([os.environ["FINSHELL_BIN"], "mesh", "--format=vtu,msh", "g.nml"], cwd=self.folder, capture_output=True, check=True)
        def of_sets(name):  # elements come in another order: the worst one may be another
            return sorted(line for line in self.sets(name)[:-1] if not line.startswith("Sides"))
        wanted = of_sets("g.msh")
        self.call(self.folder / "g.vtu", self.folder / "again.msh")
        self.assertEqual(wanted, of_sets("again.msh"))
        self.assertIn("far: 8", wanted)

    @unittest.skipUnless(meshio, "meshio is not installed")
    def test_wrong(self):
        (self.folder / "bad.vtu").write_text("no XML")
        (self.folder / "what.xyz").write_text("")
        meshio.write(self.folder / "lines.vtu", meshio.Mesh(POINTS, [("line", np.array([[0, 1]]))]))
        broken = POINTS.copy()
        broken[1, 1] = np.nan
        meshio.write(self.folder / "nan.vtu", meshio.Mesh(broken, [("triangle", np.array([[0, 1, 4]]))]))
        for name, out, words in (("none.ply", "o.msh", "there is no such file"), ("bad.vtu", "o.msh", "bad.vtu: "), ("what.xyz", "o.msh", "what.xyz: "),
                                 ("lines.vtu", "o.msh", "there are no triangles or quadrilaterals"), ("nan.vtu", "o.msh", "are no numbers"),
                                 ("bad.vtu", "o.stl", "ends with .msh, found")):
            with self.subTest(name):
                said = self.call(self.folder / name, self.folder / out, code=2)
                self.assertIn("finshell-mesh: ", said)
                self.assertIn(words, said)
                self.assertFalse((self.folder / out).exists())


if __name__ == "__main__":
    unittest.main()
