#!/usr/bin/env python3
"""Meshes out of result files, as they were and as they were deformed, and meshes written for others and read again."""
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np
import pyvista

GENERATORS = {
    "disk": "radius = 1.0 rings = 4 portion = 'half'",
    "rectangle": "lengths = 2.0, 1.0 divisions = 4, 3",
    "quadrilateral": "corners = 0, 0, 0,  48, 44, 0,  48, 60, 0,  0, 44, 0 divisions = 3, 3",
    "paraboloid": "lengths = 1.0, 1.0 curvatures = 2.0, -2.0, 0.0 divisions = 3, 3",
    "cylinder": "radius = 1.0 length = 2.0 angles = 0.0, 360.0 divisions = 8, 3",
    "cone": "radii = 2.0, 1.0 length = 1.0 angles = 0.0, 90.0 divisions = 4, 3",
    "sphere": "radius = 10.0 colatitudes = 18.0, 90.0 azimuths = 0.0, 90.0 divisions = 4, 4",
    "annulus": "radii = 6.0, 10.0 angles = 0.0, 300.0 divisions = 9, 2",
    "strip": "length = 12.0 width = 1.1 twist = 90.0 divisions = 6, 2",
    "hole": "lengths = 2.0, 1.0 radius = 0.3 divisions = 4, 4",
}
SETS = "&node_set name = 'some' nodes = 2, 3 /\n&element_set name = 'few' elements = 1, 2, 4 /\n"
REST = """&material name = 'm' law = 'neo_hookean' mu = 1.0e3 /
&section thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'line' edge_set = 'edge_x1' vector = 1.0, 0.0, 0.2 /
&step load_levels = 0.5, 1.0 first_increment = 0.5 automatic = .false. /
"""


def sets_of(path):
    """The sets that a result file holds: kind and name, and members (of edges: pairs without direction)."""
    found = {}
    with h5py.File(path) as file:
        group = file["finshell/sets"]
        for kind in ("node", "element", "edge"):
            ends = np.cumsum([0, *group[f"{kind}_sizes"]])
            for i, name in enumerate(group[f"{kind}_names"]):
                members = group[f"{kind}_members"][ends[i]:ends[i + 1]].tolist()
                if kind == "edge":
                    members = sorted(tuple(sorted(p)) for p in zip(members[::2], members[1::2]))
                found[kind, name.decode().strip()] = members
    return found


def mesh_of(path):
    with h5py.File(path) as file:
        return file["VTKHDF/Points"][()], file["VTKHDF/Connectivity"][()].reshape(-1, 3)


class Results(unittest.TestCase):
    def setUp(self):
        self.keep = tempfile.TemporaryDirectory()
        self.folder = Path(self.keep.name)
        self.addCleanup(self.keep.cleanup)

    def run_it(self, *arguments, code=0):
        done = subprocess.run([os.environ["FINSHELL_BIN"], *arguments], cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def write(self, name, mesh, rest=REST, sets=""):
        (self.folder / f"{name}.nml").write_text(f"&job name = '{name}' /\n&mesh {mesh} /\n{sets}{rest}")

    def solve(self, name, mesh, **more):
        self.write(name, mesh, **more)
        self.run_it("run", "-q", f"{name}.nml")
        return self.folder / f"{name}.vtkhdf"

    def first(self):
        return self.solve("a", "generator = 'rectangle' lengths = 2, 1 divisions = 4, 2", sets=SETS,
                          rest=REST + "&output /\n&output name = 'part' element_set = 'few' /\n")

    def test_reference(self):
        """The same mesh, sets and answer; further sets are those of all meshes from files."""
        first = self.first()
        second = self.solve("b", "file = 'a.vtkhdf'")
        for one, other in zip(mesh_of(first), mesh_of(second)):
            np.testing.assert_array_equal(one, other)
        old, new = sets_of(first), sets_of(second)
        self.assertTrue({("node", "some"), ("element", "few"), ("edge", "edge_x0")} <= set(old))
        self.assertEqual(old, {k: v for k, v in new.items() if k in old})
        self.assertIn(("edge", "boundary_1"), new)
        with h5py.File(first) as one, h5py.File(second) as other:
            np.testing.assert_allclose(one["VTKHDF/PointData/displacement"], other["VTKHDF/PointData/displacement"], rtol=1e-9, atol=1e-12)
        third = self.solve("c", "file = 'b.vtkhdf'")  # automatic sets are there already: they stay
        self.assertEqual(new, sets_of(third))

    def test_part(self):
        """The file of a part has what of the sets lies in it."""
        self.first()
        x, triangles = mesh_of(self.folder / "a.part.vtkhdf")
        whole_x, whole = mesh_of(self.folder / "a.vtkhdf")
        np.testing.assert_array_equal(x[triangles], whole_x[whole[[0, 1, 3]]])
        inside, all_sets = sets_of(self.folder / "a.part.vtkhdf"), sets_of(self.folder / "a.vtkhdf")
        self.assertEqual(inside["element", "few"], [0, 1, 2])
        wanted = {tuple(x) for x in whole_x[np.unique(whole[[0, 1, 3]])]} & {tuple(x) for x in whole_x[all_sets["node", "some"]]}
        self.assertEqual({tuple(v) for v in x[inside["node", "some"]]}, wanted)
        self.assertNotIn(("edge", "edge_x1"), inside)
        self.write("p", "file = 'a.part.vtkhdf'", rest=REST.replace("edge_set = 'edge_x1'", "edge_set = 'boundary'"))
        self.assertIn("few: 3", self.run_it("mesh", "p.nml"))

    def test_deformed(self):
        first = self.first()
        with h5py.File(first) as file:
            x = file["VTKHDF/Points"][()]
            u = file["VTKHDF/PointData/displacement"][()].reshape(-1, *x.shape)
            increments = file["finshell/history/increment"][()]
        self.assertEqual(increments.tolist(), [0, 1, 2])
        for more, step in (("deformed = .true.", 2), ("increment = 1", 1), ("increment = 2 deformed = .true.", 2), ("increment = 0", 0),
                           ("deformed = .false.", 0)):
            with self.subTest(more):
                y, _ = mesh_of(self.solve("d", f"file = 'a.vtkhdf' {more}"))
                np.testing.assert_allclose(y, x + u[step], rtol=0, atol=1e-15)

    def test_single_precision_and_scale(self):
        self.solve("s", "generator = 'rectangle' lengths = 2, 1 divisions = 4, 2", rest=REST + "&output precision = 'single' compress = 0 /\n")
        y, _ = mesh_of(self.solve("t", "file = 's.vtkhdf' deformed = .true. scale = 2.0"))
        with h5py.File(self.folder / "s.vtkhdf") as file:
            x = file["VTKHDF/Points"][()]
            np.testing.assert_allclose(y, 2 * (x + file["VTKHDF/PointData/displacement"][-len(x):]), rtol=0, atol=1e-14)

    def test_older_files(self):
        """Without sets: those that all meshes from files have."""
        first = self.first()
        with h5py.File(first, "r+") as file:
            del file["finshell/sets"]
        self.write("o", "file = 'a.vtkhdf'", rest=REST.replace("edge_x0", "boundary_1_4").replace("edge_x1", "boundary_1_2"))
        self.assertIn("boundary_1_4: 2 edges", self.run_it("mesh", "o.nml"))

    def test_loose_nodes(self):
        """Nodes of no triangle are not part of the mesh, nor are their sets."""
        self.solve("l", "generator = 'rectangle' lengths = 2, 1 divisions = 4, 2",
                   rest=REST + "&node name = 'pin' position = 5, 0, 0 /\n&spring name = 's' type = 'line' node_set = 'edge_x1' to = 'pin' stiffness = 1.0 /\n")
        x, _ = mesh_of(self.solve("m", "file = 'l.vtkhdf'"))
        self.assertEqual(len(x), 15)

    def test_restart(self):
        """A run on a mesh of results goes on; not if the file has another mesh by then, nor over its own mesh."""
        self.first()
        shutil.copy(self.folder / "a.vtkhdf", self.folder / "mesh.vtkhdf")
        self.write("r", "file = 'mesh.vtkhdf' deformed = .true.", rest=REST + "&output restart = 'every' /\n")
        self.run_it("run", "-q", "r.nml")
        with h5py.File(self.folder / "r.vtkhdf") as file:
            whole = file["VTKHDF/PointData/displacement"][()]
        self.run_it("restart", "-q", "r", "--from", "1")
        with h5py.File(self.folder / "r.vtkhdf") as file:
            np.testing.assert_array_equal(whole, file["VTKHDF/PointData/displacement"][()])
        with h5py.File(self.folder / "mesh.vtkhdf", "r+") as file:
            file["VTKHDF/PointData/displacement"][-1, 2] += 1e-3
        self.assertIn("mesh", self.run_it("restart", "-q", "r", "--from", "1", code=2))
        self.write("a", "file = 'a.vtkhdf'")
        self.assertIn("would replace the file that the mesh is read from", self.run_it("run", "-q", "a.nml", code=2))
        self.assertEqual(len(mesh_of(self.folder / "a.vtkhdf")[0]), 15)

    def test_wrong_files(self):
        first = self.first()

        def refused(words, mesh="file = 'w.vtkhdf'", change=None):
            with self.subTest(words):
                if change:
                    shutil.copy(first, self.folder / "w.vtkhdf")
                    with h5py.File(self.folder / "w.vtkhdf", "r+") as file:
                        change(file)
                self.write("w", mesh)
                said = self.run_it("check", "w.nml", code=2)
                self.assertIn("w.nml:2", said)
                self.assertIn(words, said)

        def put(path, value, at=0):
            def change(file):
                file[path][at] = value
            return change

        def without(path):
            def change(file):
                del file[path]
            return change

        def version(file):
            file["VTKHDF"].attrs["Version"] = [3, 1]
        (self.folder / "w.vtkhdf").write_text("no HDF5")
        refused("it is not an HDF5 file, or it is damaged; expected is a result file of finshell")
        refused("cannot open the result file", "file = 'none.vtkhdf'")
        refused("finshell has not written this file; expected is NAME.vtkhdf of a run", change=without("finshell"))
        refused("VTKHDF of version 3.1", change=version)
        refused("increment 7 is not in the file; expected is one of 0, 1, 2", "file = 'w.vtkhdf' increment = 7", lambda file: None)
        refused("cannot find the dataset", "file = 'w.vtkhdf' deformed = .true.", without("VTKHDF/PointData/displacement"))
        refused("node 3 is at a place that is no number", change=put("VTKHDF/Points", np.nan, 2))
        refused("finite coordinates and displacements", "file = 'w.vtkhdf' deformed = .true.", put("VTKHDF/PointData/displacement", np.inf, -1))
        refused("a triangle has a node that the file does not have; it has 15 nodes", change=put("VTKHDF/Connectivity", 15))
        refused("expected are triangles", change=put("VTKHDF/Types", 9))
        refused("node sets of the file are damaged", change=put("finshell/sets/node_members", 15))
        refused("edge sets of the file are damaged", change=put("finshell/sets/edge_sizes", 1))
        refused("element sets of the file are damaged", change=put("finshell/sets/element_members", -1))
        refused("deformed = .true. is expected", "file = 'w.vtkhdf' increment = 1 deformed = .false.", lambda file: None)
        refused("only a result file of finshell", "file = 'w.msh' increment = 1")
        refused("only a result file of finshell", "file = 'w.msh' deformed = .true.")
        refused("there is no increment in the file", "file = 'w.vtkhdf' deformed = .true.",
                lambda file: file["VTKHDF/Steps"].attrs.__setitem__("NSteps", 0))
        refused("the displacements of the file are damaged", "file = 'w.vtkhdf' deformed = .true.",
                lambda file: file["VTKHDF/PointData/displacement"].resize((20, 3)))


class Formats(Results):
    """`finshell mesh --format`."""
    test_reference = test_part = test_deformed = test_single_precision_and_scale = test_older_files = test_loose_nodes = None
    test_restart = test_wrong_files = None

    def generate(self, generator):
        self.write("g", f"generator = '{generator}' {GENERATORS[generator]}", sets=SETS,
                   rest=REST.replace("node_set = 'edge_x0'", "node_set = 'some'").replace(
                       "type = 'line' edge_set = 'edge_x1' vector = 1.0, 0.0, 0.2", "type = 'pressure' pressure = 0.0"))
        self.assertIn("Written: g.msh, g.vtu, g.inp", self.run_it("mesh", "--format", "msh,vtu,inp", "g.nml"))

    def read_again(self, name):
        self.write("h", f"file = '{name}'", rest=REST.replace("node_set = 'edge_x0'", "node_set = 'some'").replace(
            "type = 'line' edge_set = 'edge_x1' vector = 1.0, 0.0, 0.2", "type = 'pressure' pressure = 0.0"))
        self.run_it("run", "-q", "h.nml")
        return *mesh_of(self.folder / "h.vtkhdf"), sets_of(self.folder / "h.vtkhdf")

    def test_every_generator(self):
        for generator in GENERATORS:
            with self.subTest(generator):
                self.generate(generator)
                self.run_it("run", "-q", "g.nml")
                x, triangles = mesh_of(self.folder / "g.vtkhdf")
                sets = sets_of(self.folder / "g.vtkhdf")
                y, again, deck_sets = self.read_again("g.inp")
                np.testing.assert_allclose(x, y, rtol=1e-13, atol=0)  # 20 characters are what CalculiX reads of a number
                np.testing.assert_array_equal(x[abs(x) > 0.01], y[abs(x) > 0.01])
                np.testing.assert_array_equal(triangles, again)
                self.assertEqual(sets, {k: v for k, v in deck_sets.items() if k in sets})
                y, again, msh_sets = self.read_again("g.msh")
                np.testing.assert_array_equal(x, y)
                self.assertEqual({tuple(t) for t in triangles.tolist()}, {tuple(t) for t in again.tolist()})
                self.assertTrue(set(sets) <= set(msh_sets))
                grid = pyvista.read(self.folder / "g.vtu")
                np.testing.assert_array_equal(grid.points, x)
                np.testing.assert_array_equal(grid.cells_dict[5], triangles)
                lines = grid.cells_dict.get(3, np.zeros((0, 2), int))
                for (kind, name), members in sets.items():
                    if kind == "node":
                        self.assertEqual(np.flatnonzero(grid.point_data[name]).tolist(), members)
                    elif kind == "element":
                        self.assertEqual(np.flatnonzero(grid.cell_data[name][:len(triangles)]).tolist(), members)
                    else:
                        inside = lines[grid.cell_data[name][len(triangles):] == 1]
                        self.assertEqual(sorted(tuple(sorted(p)) for p in inside.tolist()), members)

    def test_calculix(self):
        """CalculiX reads the deck, its sets and its surfaces, and pulls the strip by F L / (E A)."""
        ccx = shutil.which("ccx")
        if not ccx:
            self.skipTest("no CalculiX")
        self.write("k", "generator = 'rectangle' lengths = 10, 1 divisions = 20, 2", sets=SETS, rest="""&material name = 'm' law = 'linear_elastic' e = 1000.0 nu = 0.0 /
&section thickness = 0.1 /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'force' node_set = 'edge_x1' vector = 1.0, 0.0, 0.0 total = .true. /
&monitor name = 'w' quantity = 'displacement' component = 'x' node_set = 'edge_x1' /
&step control = 'linear' /
""")
        self.run_it("mesh", "--format=inp", "k.nml")
        deck = (self.folder / "k.inp").read_text()
        self.assertIn("*SURFACE, NAME=edge_x1, TYPE=ELEMENT", deck)
        (self.folder / "ccx.inp").write_text(deck + """*MATERIAL, NAME=m
*ELASTIC
1000., 0.
*SHELL SECTION, ELSET=all, MATERIAL=m
0.1
*BOUNDARY
edge_x0, 1, 6
*STEP
*STATIC
*DLOAD
few, P, 0.0
*CLOAD
edge_x1, 1, 0.3333333333
*NODE PRINT, NSET=edge_x1
U
*END STEP
""")
        done = subprocess.run([ccx, "ccx"], cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertNotIn("*ERROR", done.stdout)
        tip = [float(line.split()[1]) for line in (self.folder / "ccx.dat").read_text().splitlines() if len(line.split()) == 4]
        self.assertEqual(len(tip), 3)
        self.assertAlmostEqual(np.mean(tip) / (1.0 * 10 / (1000 * 0.1)), 1.0, delta=0.01)

    def test_wrong(self):
        self.generate("rectangle")
        for value in ("stl", "", "msh,", "msh vtu", ",msh", "mshvtu"):
            said = self.run_it("mesh", f"--format={value}", "g.nml", code=2)
            self.assertIn(f"--format needs msh, vtu or inp, or several of them with commas between, found '{value}'", said)
        self.assertIn("belongs to the command mesh", self.run_it("run", "--format=vtu", "g.nml", code=2))
        for ending in ("vtu", "inp"):
            self.run_it("mesh", f"--format={ending}", "g.nml")  # ours is replaced
            (self.folder / f"g.{ending}").write_text("of somebody\n" * 5)
            said = self.run_it("mesh", f"--format={ending}", "g.nml", code=2)
            self.assertIn(f"g.{ending}: ", said)
            self.assertIn("the file is there already, and finshell has not written it; take another name", said)
        (self.folder / "g.nml").write_text((self.folder / "g.nml").read_text().replace("'some'", "'so, me'"))
        self.assertIn("the set 'so, me' cannot be written: names in a deck have 1 to 80 characters", self.run_it("mesh", "--format=inp", "g.nml", code=2))
        (self.folder / "g.vtu").unlink()
        (self.folder / "g.nml").write_text((self.folder / "g.nml").read_text().replace("'so, me'", "'a<b & \"c'"))
        self.run_it("mesh", "--format=vtu", "g.nml")
        self.assertIn('a<b & "c', pyvista.read(self.folder / "g.vtu").point_data)


if __name__ == "__main__":
    unittest.main()
