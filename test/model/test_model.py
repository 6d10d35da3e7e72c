#!/usr/bin/env python3
"""finshell.Model: it goes the way of the driver, bit by bit; what a host gives; arrays, files, errors, couplings."""
import contextlib
import csv
import gc
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
import types
import unittest
from pathlib import Path

try:
    import numpy as np
except ImportError:
    print("numpy is not installed")
    sys.exit(77)
if not os.environ.get("FINSHELL_DRIVER_LIB"):
    print("there is no driver")
    sys.exit(77)

SOURCE = Path(os.environ["FINSHELL_SOURCE_DIR"])
COMPILER = shutil.which(os.environ.get("CC", "cc"))
sys.path[:0] = [str(SOURCE / "api" / "python"), str(SOURCE / "api" / "python" / "examples")]
import coupled_panel  # noqa: E402
import finshell  # noqa: E402
import finshell.precice  # noqa: E402

TIP = np.array([0.0, 0.0, 0.02])


def builder(divisions=(6, 2)):
    return (finshell.Builder("A strip", name="strip").mesh(generator="rectangle", lengths=[1.0, 0.2], divisions=list(divisions))
            .material("m", law="linear_elastic", e=1e6, nu=0.3, density=1000.0).section(material="m", thickness=0.01)
            .support("edge_x0", type="clamped").monitor("w", quantity="displacement", component="z", node_set="edge_x1")
            .monitor("r", quantity="reaction", component="z", node_set="edge_x0"))


def static():
    return builder().step(name="bend", tolerance="tight")


def dynamic(**keys):
    return builder().step(**{"name": "swing", "control": "dynamic", "duration": 1.0, **keys})


class LikeTheDriver(unittest.TestCase):
    """One increment a call is what the program does, to the last bit."""

    CASES = ("hinged_strip", "sze38a", "breathing_sphere", "gas_balloon", "panel_bending", "spinning_ring")

    def test_history(self):
        for name in self.CASES:
            with self.subTest(example=name), tempfile.TemporaryDirectory() as folder:
                source = sorted((SOURCE / "examples" / name).glob("*.nml"))[0]
                subprocess.run([os.environ["FINSHELL_BIN"], "run", source, "-o", folder, "--quiet"], check=True, capture_output=True)
                model = finshell.Model(source)
                with open(next(Path(folder).glob("*.history.csv")), encoding="utf-8") as f:
                    rows = list(csv.DictReader(line for line in f if not line.startswith("#")))
                calls = sum(1 for _ in model)
                self.assertGreater(calls, 0)
                history, shared = model.history, 0
                for column in rows[0]:
                    if column in history and column not in ("size",):
                        expected = [float(r[column]) if r[column] else np.nan for r in rows]
                        np.testing.assert_array_equal(history[column], expected, err_msg=column)
                        shared += 1
                self.assertGreaterEqual(shared, 4)

    def test_all_kinds_of_steps(self):
        # static, in time by all schemes with damping, modes; one behind the other
        text = """&job name = 'm' /
&mesh generator = 'rectangle' lengths = 1.0, 0.2 divisions = 6, 1 /
&material name = 'm' law = 'linear_elastic' e = 1.0e5 nu = 0.3 density = 2.0 /
&section thickness = 0.02 /
&monitor name = 'v' quantity = 'velocity' component = 'z' node_set = 'corner_x1_y1' /
&monitor name = 'k' quantity = 'kinetic_energy' /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'gravity' vector = 0, 0, -1 /
&step load_factor = 1 /
&step control = 'dynamic' duration = 0.01 load_factor = 0 mass_damping = 20 stiffness_damping = 1e-4 /
&step control = 'dynamic' duration = 0.005 times = 0.005 factors = 2.0 scheme = 'conserving' output_interval = 0.001 /
&step control = 'explicit' duration = 0.005 load_factor = 0 mass_damping = 20 history_rows = 7 /
&step load_factor = 0 /
&step control = 'frequencies' modes = 2 /
&step load_factor = -1 /
&initial_velocity velocity = 0, 0, 1 /
&output energy = .true. /
"""
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "m.nml").write_text(text, encoding="utf-8")
            subprocess.run([os.environ["FINSHELL_BIN"], "run", "m.nml", "--quiet"], check=True, capture_output=True, cwd=folder)
            with open(Path(folder, "m.history.csv"), encoding="utf-8") as f:
                rows = list(csv.DictReader(f))
        model = finshell.Model(text=text)
        model.run()
        self.assertTrue(model.record.finished)
        self.assertIn("energy_residual", model.history)
        for column in set(model.history) & set(rows[0]):
            np.testing.assert_array_equal(model.history[column], [float(r[column]) for r in rows], err_msg=column)

    def test_checkpoints_change_nothing(self):
        straight, back = dynamic(duration=0.3).load(type="force", node_set="edge_x1", vector=TIP).model(), None
        straight.run()
        back = dynamic(duration=0.3).load(type="force", node_set="edge_x1", vector=TIP).model()
        while not back.record.finished:
            back.checkpoint(3)
            if back.record.increment % 3 == 0:
                back.set_force("edge_x1", -TIP)
                back.advance(0.01)
                back.advance()
                back.restore(3)
            back.advance()
        for column, values in straight.history.items():
            np.testing.assert_array_equal(values, back.history[column], err_msg=column)

    def test_back_into_what_is_let_go(self):
        # growth and a load leave before the second step, in several increments: each is gone back to, and done again
        def model():
            return (builder().load(type="gravity", vector=[0, 0, 0.3], constant=True, until_step=1).load(type="gravity", vector=[0, 0, 1e-4])
                    .group("growth", growth=[1.01, 1.0], constant=True, until_step=1).group("growth", growth=[1.02, 1.0])
                    .step(tolerance="tight").step(load_factor=2.0, tolerance="tight", maximum_iterations=6).model())
        straight, back = model(), model()
        straight.run()
        while not back.record.finished:
            back.checkpoint(1)
            back.advance()
            back.restore(1)
            back.advance()
        self.assertGreater(np.count_nonzero(straight.history["load_factor"] == 1), 2)
        for column, values in straight.history.items():
            np.testing.assert_array_equal(values, back.history[column], err_msg=column)
        np.testing.assert_array_equal(straight.field("stress"), back.field("stress"))


    @unittest.skipUnless(COMPILER, "no compiler of C")
    def test_laws_with_states(self):
        # steps that take no time, static ones that do, motions; every third increment is gone back to and done again
        text = """&job name = 'm' /
&mesh generator = 'rectangle' lengths = 1.0, 0.2 divisions = 6, 1 /
&material name = 'm' library = 'liblaws.so' law = 'prony' e = 1.0e5 nu = 0.3 g = 0.5 tau = 0.01 density = 2.0 /
&section thickness = 0.02 /
&monitor name = 'w' quantity = 'displacement' component = 'z' node_set = 'corner_x1_y1' /
&monitor name = 's' quantity = 'stress' component = '11' element_set = 'all' height = 'top' reduce = 'max' /
&support node_set = 'edge_x0' type = 'clamped' /
&load type = 'gravity' vector = 0, 0, -1 /
&step load_factor = 1 first_increment = 0.3 /
&step duration = 0.05 times = 0.02, 0.03 factors = 1.0, 0.5 /
&step control = 'dynamic' duration = 0.01 load_factor = 0 stiffness_damping = 1e-4 /
&step control = 'explicit' duration = 0.005 load_factor = 0 history_rows = 7 /
&step load_factor = -1 duration = 0.02 output_interval = 0.01 /
&output energy = .true. /
"""
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([COMPILER, "-O2", "-fPIC", "-shared", f"-I{SOURCE / 'api'}", str(SOURCE / "examples/user_laws/laws.c"), "-o", "liblaws.so",
                            "-lm"], cwd=folder, check=True)
            Path(folder, "m.nml").write_text(text, encoding="utf-8")
            subprocess.run([os.environ["FINSHELL_BIN"], "run", "m.nml", "--quiet"], check=True, capture_output=True, cwd=folder)
            with open(Path(folder, "m.history.csv"), encoding="utf-8") as f:
                rows = list(csv.DictReader(f))
            model = finshell.Model(Path(folder, "m.nml"))
        calls = 0
        while not model.record.finished:
            model.checkpoint(3)
            if calls % 3 == 0:
                model.advance()
                model.advance()
                model.restore(3)
            model.advance()
            calls += 1
        self.assertGreater(calls, 30)
        for column in set(model.history) & set(rows[0]):
            np.testing.assert_array_equal(model.history[column], [float(r[column]) for r in rows], err_msg=column)

    def test_forces_of_a_host_in_static_steps_that_take_time(self):
        model = builder().step(name="hold", duration=2.0).model()
        model.set_force("edge_x1", TIP)
        model.advance(0.5)  # comes in before the step begins
        self.assertEqual(model.record.time, 0.5)
        self.assertNotEqual(model.monitor("w"), 0)
        model.set_force("edge_x1", 2 * TIP)
        with self.assertRaisesRegex(finshell.Error, "step 'hold': forces and displacements of a host change in steps with control = 'load' and 'dynamic', "
                                                    "found 'static in time'"):
            model.advance()
        self.assertTrue(model.settle())
        model.run()
        self.assertAlmostEqual(model.record.time, 2.0)


class Host(unittest.TestCase):
    def test_forces_at_rest(self):
        inside = static().load(type="force", node_set="edge_x1", vector=TIP).model()
        inside.run()
        outside = static().model()
        outside.set_force("edge_x1", TIP)
        self.assertTrue(outside.settle())
        np.testing.assert_allclose(outside.field("displacement"), inside.field("displacement"), atol=1e-9)
        self.assertAlmostEqual(outside.monitor("r"), -0.06, delta=1e-9)
        # one set after another, values for each node, in the course of a step
        other = static().model()
        nodes = other.node_set("edge_x1")
        other.set_force("edge_x1", np.outer(np.ones(len(nodes)), TIP) / 2)
        other.advance(0.25)
        other.set_force("edge_x1", np.outer(np.ones(len(nodes)), TIP))
        other.advance(0.25)
        self.assertAlmostEqual(other.record.load_factor, 0.5)
        self.assertAlmostEqual(other.monitor("w"), inside.monitor("w"), delta=1e-9)

    def test_displacements_at_rest(self):
        inside = static().support("edge_x1", uz=0.3).model()
        inside.run()
        outside = static().support("edge_x1", fixed="uz").model()
        outside.set_displacement("edge_x1", "z", 0.3)
        outside.settle()
        np.testing.assert_allclose(outside.field("displacement"), inside.field("displacement"), atol=1e-9)
        self.assertAlmostEqual(outside.monitor("r"), inside.monitor("r"), delta=1e-8)

    def test_in_motion(self):
        # along straight lines, as an amplitude over time goes
        points = [0.0, 0.0, 0.1, 1.0, 0.3, -1.0, 1.0, -1.0]
        steps = {"automatic": False, "first_increment": 0.02, "tolerance": "tight"}
        force, motion = {"type": "force", "node_set": "edge_x1", "vector": TIP}, {"uy": 0.01}
        for what in ("force", "displacement"):
            with self.subTest(what=what):
                inside = dynamic(**steps).group("amplitude", name="a", over="time", points=points)
                outside = dynamic(**steps)
                if what == "force":
                    inside.load(**force, amplitude="a")
                else:
                    inside.support("edge_x1", **motion, amplitude="a")
                    outside.support("edge_x1", fixed="uy")
                inside, outside = inside.model(), outside.model()
                inside.run()
                while outside.record.time < 1 - 1e-9:
                    factor = np.interp(outside.record.time + 0.02, points[::2], points[1::2])
                    if what == "force":
                        outside.set_force("edge_x1", factor * TIP)
                    else:
                        outside.set_displacement("edge_x1", 1, factor * motion["uy"])
                    outside.advance(0.02)
                self.assertEqual(outside.record.increment, 50)
                largest = abs(inside.field("velocity")).max()
                self.assertGreater(largest, 1e-6)
                np.testing.assert_allclose(outside.field("displacement"), inside.field("displacement"), atol=1e-9)
                np.testing.assert_allclose(outside.field("velocity"), inside.field("velocity"), atol=1e-7 * largest)
                np.testing.assert_allclose(outside.field("reaction"), inside.field("reaction"), atol=1e-5 * abs(inside.field("reaction")).max())

    def test_times_are_met(self):
        model = dynamic(duration=0.5).model()
        model.set_force("edge_x1", 5 * TIP)
        for time in (0.1, 0.13, 0.5):
            model.advance_to(time)
            self.assertAlmostEqual(model.record.time, time, delta=1e-12)
        self.assertGreater(model.record.increment, 3)  # as accuracy asks for
        self.assertFalse(model.advance())

    def test_stages(self):
        # the host's forces stay where supports and loads come and go
        model = (static().step(name="held", tolerance="tight").support("edge_x1", fixed="uz", from_step=2).model())
        model.set_force("edge_x1", TIP)
        model.settle()
        tip = model.monitor("w")
        model.run()
        self.assertAlmostEqual(model.monitor("w"), tip, delta=1e-9)
        self.assertAlmostEqual(model.record.load_factor, 1.0)


class Arrays(unittest.TestCase):
    def test_views(self):
        model = static().load(type="force", node_set="edge_x1", vector=TIP).model()
        first = model.field("displacement")
        self.assertFalse(first.flags.owndata or first.flags.writeable)
        self.assertEqual((first.shape, abs(first).max()), ((21, 3), 0.0))
        model.run()
        self.assertIs(type(model.field("energy").item()), float)
        second = model.field("displacement")
        np.testing.assert_array_equal(first, second)
        self.assertGreater(first[:, 2].max(), 0.3)
        self.assertEqual(model.field("membrane_force").shape, (24, 3))
        self.assertEqual(model.field("principal_stress").shape, (24, 3, 2))
        self.assertEqual(model.field("thickness_stretch").shape, (24,))
        self.assertEqual(model.coordinates.shape, (21, 3))
        self.assertEqual(model.triangles.min(), 0)
        self.assertEqual(len(model.element_set("all")), 24)
        del model, second
        gc.collect()
        self.assertGreater(first[:, 2].max(), 0.3)  # the array keeps the model

    def test_every_field(self):
        model = dynamic(duration=0.1).load(type="force", node_set="edge_x1", vector=TIP).model()
        model.advance()
        read = 0
        for name in model.texts("fields"):
            try:
                values = model.field(name)
                self.assertIn(len(values) if values.ndim else 1, (21, 24, 3, 1), name)
                read += 1
            except finshell.Error as e:
                self.assertRegex(str(e), "connector or a cut")
        self.assertGreater(read, 20)

    def test_modes(self):
        model = builder().step(control="frequencies", modes=3).model()
        self.assertEqual(model.advance().reports, 3)
        shapes = [model.field("displacement", mode=i).copy() for i in (1, 2, 3)]
        for shape in shapes:
            self.assertAlmostEqual(np.linalg.norm(shape, axis=1).max(), 1.0, delta=1e-9)
        self.assertEqual(abs(model.field("displacement")).max(), 0)

    def test_mesh_arrays(self):
        made = builder().load(type="pressure", pressure=1e-3).step(tolerance="tight").model()
        made.run()
        given = finshell.Builder("arrays").mesh(made.coordinates, made.triangles)
        given.node_set("root", made.coordinates[:, 0] < 1e-9).node_set("tip", made.node_set("edge_x1"))
        given.element_set("sheet", np.arange(made.elements))
        model = (given.material("m", law="linear_elastic", e=1e6, nu=0.3, density=1000.0)
                 .section(material="m", thickness=0.01, element_set="sheet").support("root", type="clamped")
                 .load(type="pressure", pressure=1e-3).monitor("w", quantity="displacement", component="z", node_set="tip")
                 .step(tolerance="tight").model())
        model.run()
        np.testing.assert_allclose(model.field("displacement"), made.field("displacement"), atol=1e-12)

    def test_results(self):
        with tempfile.TemporaryDirectory() as folder:
            model = static().load(type="force", node_set="edge_x1", vector=TIP).group("output", fields=["displacement", "membrane_force"]).model()
            name = Path(folder, "part")
            model.write(name)
            for _ in model:
                model.write(name)
            with self.assertRaisesRegex(finshell.Error, "one set of files"):
                model.write(Path(folder, "other"))
            count = model.record.increment
            model.close()
            self.assertEqual({p.name for p in Path(folder).iterdir()}, {"part.vtkhdf", "part.xdmf", "part.history.csv"})
            rows = [line for line in name.with_suffix(".history.csv").read_text().splitlines() if not line.startswith("#")]
            self.assertEqual(len(rows), count + 1)
            shown = subprocess.run([os.environ["FINSHELL_BIN"], "info", name.with_suffix(".vtkhdf")], check=True, capture_output=True, text=True)
            self.assertIn("membrane_force", shown.stdout)
        with self.assertRaises(finshell.Error), static().model() as model:
            model.write("/no/such/folder/part")


class Manners(unittest.TestCase):
    def test_texts(self):
        seen = []
        model = static().load(type="force", node_set="edge_x1", vector=TIP).model(progress=lambda m: seen.append(m.record.increment))
        self.assertIn("21 nodes", repr(model))
        model.run()
        self.assertEqual(seen, list(range(1, model.record.increment + 1)))
        self.assertIn("<td>1</td>", model._repr_html_())
        self.assertIn("A strip", model._repr_html_())
        self.assertEqual(model.texts("steps"), ["bend"])
        self.assertIn("edge_x1", model.texts("node_sets"))
        model.close()
        self.assertIn("closed", repr(model))
        with self.assertRaisesRegex(ValueError, "closed"):
            model.advance()

    def test_quoting(self):
        self.assertEqual(finshell.group("job", title="it's", threads=2, fast=True, x=[1.5, 2]), "&job\n   title = 'it''s'\n   threads = 2\n"
                         "   fast = .true.\n   x = 1.5, 2.0\n/\n")
        with self.assertRaises(ValueError):
            finshell.group("job", title="two\nlines")

    def test_errors(self):
        with self.assertRaisesRegex(finshell.Error, r"input:\d+: &material: unknown key colour"):
            builder().material("n", law="neo_hookean", mu=1.0, colour=1).step().model()
        with self.assertRaisesRegex(finshell.Error, "&sensitivity: derivatives stand in the results of the program; a model that is taken step by step has none: leave the group out, or use the program"):
            static().group("sensitivity", monitor="w", parameter="section.thickness").model()
        with self.assertRaisesRegex(finshell.Error, r"input:\d+: &accuracy: a model that is taken step by step keeps its mesh"):
            static().group("accuracy", monitor="w").model()
        with self.assertRaisesRegex(finshell.Error, "nowhere.nml"):
            finshell.Model("nowhere.nml")
        for wrong in ({}, {"text": "&job /", "mesh": ([[0, 0]], [[0, 1, 2]])}, {"text": "&job /", "sets": [("a", 0, [1])]}):
            with self.assertRaises(ValueError):
                finshell.Model(**wrong)
        with self.assertRaises(ValueError):
            finshell.Builder().mesh(coordinates=[[0, 0, 0]])
        with self.assertRaisesRegex(KeyError, "there are: increment"):
            static().model().monitor("nobody")
        with self.assertRaises(ValueError):
            static().model().set_displacement("edge_x1", "w", 1)

    def test_header(self):
        """Prototypes and structures agree with finshell_model.h."""
        from finshell import _driver
        text = re.sub(r"/\*.*?\*/", "", (SOURCE / "api" / "finshell_model.h").read_text(encoding="utf-8"), flags=re.S)
        found = re.findall(r"^int32_t finshell_model_(\w+)\(([^)]*)\);", text, re.M)
        self.assertEqual({name for name, _ in found}, set(_driver._PROTOTYPES))
        for name, arguments in found:
            expected = 0 if arguments == "void" else len(arguments.split(","))
            self.assertEqual(len(_driver._PROTOTYPES[name]), expected, name)
        for name, structure in (("status", _driver.ModelStatus), ("set", _driver.CSet), ("mesh", _driver.CMesh), ("size", _driver.CSizes),
                                ("record", _driver.CRecord), ("array", _driver.CArray)):
            body = re.search(rf"typedef struct finshell_model_{name} \{{(.*?)\}}", text, re.S).group(1)
            members = [m for line in body.split(";") for m in re.findall(r"(\w+)(?:\[\d+\])?\s*(?:,|$)", line.strip())]
            self.assertEqual(members, [n for n, _ in structure._fields_], name)

    def test_since(self):
        header = (SOURCE / "api" / "finshell_model.h").read_text(encoding="utf-8")
        for name in re.findall(r"^int32_t (finshell_model_\w+)\(", header, re.M):
            comment = header.split(f"int32_t {name}(")[0].rpartition("/*")[2]
            self.assertRegex(" ".join(comment.split()), r"Since \d+\.\d+\. \*/$", name)

    def test_exports(self):
        shown = subprocess.run(["nm", "-D", "--defined-only", os.environ["FINSHELL_DRIVER_LIB"]], check=True, capture_output=True, text=True)
        names = {line.split()[2].split("@")[0] for line in shown.stdout.splitlines() if line.split()[1] != "A"}
        header = (SOURCE / "api" / "finshell_model.h").read_text(encoding="utf-8")
        self.assertEqual(names, set(re.findall(r"^int32_t (finshell_model_\w+)\(", header, re.M)))

    def test_no_library(self):
        done = subprocess.run([sys.executable, "-c", "import finshell; finshell.Model('x.nml')"], capture_output=True, text=True, check=False,
                              env={**os.environ, "FINSHELL_DRIVER_LIB": "/no/such.so", "PYTHONPATH": str(SOURCE / "api" / "python")})
        self.assertIn("FINSHELL_DRIVER_LIB names another place", done.stderr)

    def test_two_libraries(self):
        # elements and models in one process
        section = finshell.Section("neo_hookean", {"mu": 1.0}, 0.1)
        self.assertEqual(section.evaluate(np.eye(3)[None], np.zeros((1, 3, 3)), np.zeros((1, 3, 3))).energy[0], 0)


class Guide(unittest.TestCase):
    """The programs of doc/model_api.md, taken from the text."""

    def setUp(self):
        text = (SOURCE / "doc" / "model_api.md").read_text(encoding="utf-8")
        self.programs = dict(re.findall(r"^```(python|c)\n(.*?)^```", text, re.M | re.S))
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def tip(self, printed):
        return float(re.search(r"^tip (\S+)$", printed, re.M).group(1))

    def test_both(self):
        library = Path(os.environ["FINSHELL_DRIVER_LIB"]).parent
        source, program = Path(self.folder.name, "strip.c"), Path(self.folder.name, "strip")
        source.write_text(self.programs["c"], encoding="utf-8")
        subprocess.run([os.environ["FINSHELL_CC"], "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", f"-I{SOURCE / 'api'}", source, "-o", program,
                        f"-L{library}", "-lfinshell_driver"], check=True)
        run = subprocess.run([program], check=True, capture_output=True, text=True, env={**os.environ, "LD_LIBRARY_PATH": str(library)})
        with contextlib.redirect_stdout(io.StringIO()) as out:
            exec(compile(self.programs["python"], "model_api.md", "exec"), {})  # noqa: S102: our own text
        self.assertGreater(self.tip(run.stdout), 0.3)
        self.assertEqual(self.tip(run.stdout), self.tip(out.getvalue()))


class Coupling(unittest.TestCase):
    def test_panel(self):
        coupled, whole, counts = coupled_panel.compare(4, 20)
        self.assertEqual(len(counts), 20)
        self.assertGreater(max(counts), 3)
        self.assertGreater(abs(whole).max(), 0.05)
        np.testing.assert_allclose(coupled, whole, atol=1e-8)

    def test_without_relaxation_it_blows_up(self):
        model = coupled_panel.panel(coupled_panel.SOLID, 4, 20)
        fluid = coupled_panel.Fluid(model.coordinates, model.triangles)
        model.checkpoint()
        sizes, force = [], np.zeros((model.nodes, 3))
        for _ in range(5):
            model.set_force("all", force)
            model.advance(coupled_panel.DURATION / 20)
            residual = fluid.force(model.field("acceleration")) - force
            sizes.append(np.linalg.norm(residual))
            force = force + residual
            model.restore()
        self.assertGreater(sizes[-1], 10 * sizes[0])

    def test_main(self):
        with contextlib.redirect_stdout(io.StringIO()) as out:
            sys.argv[1:] = ["3", "5"]
            coupled_panel.main()
        self.assertIn("iterations in a step", out.getvalue())


class Participant:
    """Stands in for preCICE: the fluid of the panel, iterated by Aitken's relaxation in windows of one step, or nothing but a force
    where it is told so. It takes only what version 3 takes and refuses calls out of order."""

    windows, steps, force, dimensions = 20, 20, None, 3

    def __init__(self, name, configuration, rank, size):
        assert (name, configuration, rank, size) == ("Solid", "config.xml", 0, 1)
        self.window, self.state, self.asked, self.log = 0, "new", set(), []
        type(self).last = self

    def get_mesh_dimensions(self, mesh):
        return self.dimensions

    def set_mesh_vertices(self, mesh, positions):
        assert self.state == "new" and positions.shape[1] == 3
        self.guess, self.before, self.relaxation, self.residual = np.zeros(positions.shape), np.zeros(positions.shape), 1 / 11, None
        return np.arange(len(positions))

    def requires_initial_data(self):
        assert self.state == "new"
        return True

    def initialize(self):
        self.state, self.fresh = "running", True

    def is_coupling_ongoing(self):
        return self.window < self.windows

    def get_max_time_step_size(self):
        return coupled_panel.DURATION / self.steps

    def requires_writing_checkpoint(self):
        answer, self.fresh = self.fresh, False
        return answer

    def read_data(self, mesh, name, ids, relative):
        assert self.state == "running" and (mesh, name) == ("Solid-Mesh", "Force") and relative == self.get_max_time_step_size()
        return self.guess if self.force is None else np.broadcast_to(self.force, self.guess.shape)

    def write_data(self, mesh, name, ids, values):
        assert (mesh, name) == ("Solid-Mesh", "Displacement") and values.shape == self.guess.shape
        self.values = values.copy()

    def advance(self, size):
        assert self.state == "running" and not self.fresh
        self.back = False
        if self.force is None:
            residual = self.fluid.force(self.values) - self.guess
            if np.linalg.norm(residual) > 1e-9 * max(np.linalg.norm(self.guess), 1e-12):
                self.relaxation = coupled_panel.aitken(self.relaxation, residual, self.residual)
                self.guess, self.residual, self.back = self.guess + self.relaxation * residual, residual, True
        if not self.back:
            self.guess, self.before = 2 * self.guess - self.before, self.guess
            self.window, self.fresh, self.relaxation, self.residual = self.window + 1, True, 1 / 11, None

    def requires_reading_checkpoint(self):
        return self.back

    def finalize(self):
        self.state = "ended"


class Precice(unittest.TestCase):
    def couple(self, model, participant, **options):
        return finshell.precice.couple(model, "Solid", "config.xml", mesh="Solid-Mesh", node_set="all",
                                       module=types.SimpleNamespace(Participant=participant), **options)

    def test_implicit(self):
        model, times = coupled_panel.panel(coupled_panel.SOLID, 4, 20), []
        participant = type("Wet", (Participant,), {"fluid": coupled_panel.Fluid(model.coordinates, model.triangles)})
        record = self.couple(model, participant, field="acceleration", accepted=lambda m: times.append(m.record.time))
        np.testing.assert_allclose(times, coupled_panel.DURATION / 20 * np.arange(1, 21))
        self.assertAlmostEqual(record.time, coupled_panel.DURATION)
        self.assertEqual(participant.last.state, "ended")
        whole = coupled_panel.panel(coupled_panel.SOLID + coupled_panel.FLUID * coupled_panel.HEIGHT / coupled_panel.THICKNESS, 4, 20)
        whole.run()
        np.testing.assert_allclose(model.history["w"], whole.history["w"], atol=1e-8)

    def test_static(self):
        model = static().model()
        self.couple(model, type("Dead", (Participant,), {"force": [0.0, 0.0, 1e-4], "windows": 2}), static=True)
        self.assertAlmostEqual(model.monitor("r"), -21e-4, delta=1e-9)
        self.assertGreater(model.monitor("w"), 1e-4)

    def test_refusals(self):
        short = coupled_panel.panel(coupled_panel.SOLID, 3, 20)
        participant = type("Long", (Participant,), {"force": [0.0, 0.0, 0.0], "windows": 21})
        with self.assertRaisesRegex(ValueError, "longer duration"):
            self.couple(short, participant)
        self.assertEqual(participant.last.state, "ended")
        with self.assertRaisesRegex(ValueError, "2 dimensions"):
            self.couple(short, type("Flat", (Participant,), {"dimensions": 2}))
        if "precice" not in sys.modules:
            sys.modules["precice"] = None  # as where it is not installed
            try:
                with self.assertRaisesRegex(ImportError, "pyprecice"):
                    finshell.precice.couple(short, "Solid", "config.xml", mesh="Solid-Mesh", node_set="all")
            finally:
                del sys.modules["precice"]


if __name__ == "__main__":
    unittest.main()
