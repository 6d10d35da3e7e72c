#!/usr/bin/env python3
"""What finshell is packed by: manifests, recipes, Dockerfile and hooks parse, agree with each other and with the options of CMake."""
import importlib.util
import json
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
    import jinja2
    import yaml
except ImportError as reason:
    print(f"{reason}: tools/install_dependencies test")
    sys.exit(77)
try:
    import tomllib
except ImportError:  # Python < 3.11
    from pip._vendor import tomli as tomllib

ROOT = Path(os.environ.get("FINSHELL_SOURCE_DIR") or Path(__file__).resolve().parents[2])
sys.path.insert(0, str(ROOT / "tools"))
import wheel_licences  # noqa: E402


def text(name):
    return (ROOT / name).read_text(encoding="utf-8")


def toml(name):
    return tomllib.loads(text(name))


def found(pattern, name):
    match = re.search(pattern, text(name), re.M)
    assert match, f"{name} has nothing like {pattern}"
    return match.group(1)


VERSION = found(r"^project\(finshell VERSION (\S+)", "CMakeLists.txt")
OPTIONS = set(re.findall(r"^option\((\w+)", text("CMakeLists.txt"), re.M))


def tool(name):
    """A program beside the Python that runs the tests, or in PATH; None where it is not."""
    return shutil.which(name, path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]))


class Common(unittest.TestCase):
    def options_exist(self, words):
        """Every -DFINSHELL_... in a text is an option of CMakeLists.txt."""
        names = re.findall(r"-D(FINSHELL_\w+)", words)
        self.assertGreater(len(names), 1)
        self.assertLessEqual(set(names), OPTIONS)


class Manifests(Common):
    def test_one_version(self):
        self.assertEqual({
            "fpm.toml": toml("fpm.toml")["version"], "api/fpm.toml": toml("api/fpm.toml")["version"],
            "pyproject.toml": toml("pyproject.toml")["project"]["version"],
            "api/python/pyproject.toml": toml("api/python/pyproject.toml")["project"]["version"],
            "__init__.py": found(r'^__version__ = "(.*)"', "api/python/finshell/__init__.py"),
            "finshell_version.f90": found(r"version = '(.*)'", "src/base/finshell_version.f90"),
            "finshell.h": found(r'^#define FINSHELL_VERSION "(.*?)"', "api/finshell.h"),
            "CITATION.cff": str(yaml.safe_load(text("CITATION.cff"))["version"]),
            "recipe.yaml": yaml.safe_load(text("packaging/conda/recipe.yaml"))["context"]["version"],
            "package.py": found(r'^    version\("(.*?)"', "packaging/spack/package.py"),
        }, {name: VERSION for name in ("fpm.toml", "api/fpm.toml", "pyproject.toml", "api/python/pyproject.toml", "__init__.py",
                                       "finshell_version.f90", "finshell.h", "CITATION.cff", "recipe.yaml", "package.py")})

    def test_fields_that_the_registry_of_fpm_asks_for(self):
        for name in ("fpm.toml", "api/fpm.toml"):
            manifest = toml(name)
            for field in ("name", "version", "license", "author", "maintainer", "copyright", "description"):
                self.assertIsInstance(manifest.get(field), str, f"{name}: {field}")
                self.assertTrue(manifest[field].strip(), f"{name}: {field}")
            for field in ("keywords", "categories"):
                self.assertTrue(manifest.get(field) and all(isinstance(word, str) for word in manifest[field]), f"{name}: {field}")
            self.assertRegex(manifest["name"], r"^[A-Za-z][A-Za-z0-9_-]*$")
            self.assertRegex(manifest["version"], r"^\d+\.\d+\.\d+$")
            self.assertIn(manifest["copyright"].removeprefix("Copyright "), text("LICENSE"))
            for dependency, value in manifest.get("dependencies", {}).items():
                self.assertTrue(value == "*" or "path" in value, f"{name}: {dependency}")

    def test_both_python_manifests_say_the_same(self):
        whole, alone = toml("pyproject.toml")["project"], toml("api/python/pyproject.toml")["project"]
        for field in ("name", "version", "requires-python", "dependencies", "optional-dependencies", "scripts"):
            self.assertEqual(whole[field], alone[field], field)
        presets = {p["name"] for p in json.loads(text("CMakePresets.json"))["configurePresets"]}
        build = toml("pyproject.toml")["tool"]["scikit-build"]
        self.assertEqual(build["cmake"]["args"], ["--preset=wheel"])
        self.assertIn("wheel", presets)
        self.assertEqual(build["build"]["targets"], build["install"]["components"])
        self.assertIn(f"add_custom_target({build['build']['targets'][0]})", text("cmake/wheel.cmake"))
        self.assertTrue((ROOT / build["wheel"]["packages"][0] / "__init__.py").is_file())

    def test_citation(self):
        cff = yaml.safe_load(text("CITATION.cff"))
        for field in ("cff-version", "message", "title", "authors"):
            self.assertTrue(cff.get(field), field)
        self.assertEqual((cff["cff-version"], cff["type"], cff["license"]), ("1.2.0", "software", "MIT"))
        for entry in cff["references"]:
            for field in ("type", "title", "authors"):
                self.assertTrue(entry.get(field), field)
            for author in entry["authors"]:
                self.assertTrue({"family-names", "given-names"} <= set(author) or "name" in author)
        if tool("cffconvert"):
            done = subprocess.run([tool("cffconvert"), "--validate", "-i", str(ROOT / "CITATION.cff")], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


class Recipes(Common):
    def test_conda(self):
        raw = text("packaging/conda/recipe.yaml")
        context = yaml.safe_load(raw)["context"]
        environment = jinja2.Environment(variable_start_string="${{", variable_end_string="}}", undefined=jinja2.StrictUndefined)
        functions = {"compiler": lambda name: f"{name}_compiler", "stdlib": lambda name: f"{name}_stdlib",
                     "pin_subpackage": lambda name, **_: name}
        recipe = yaml.safe_load(environment.from_string(raw).render(**context, **functions))
        self.assertEqual(recipe["schema_version"], 1)
        self.assertEqual(recipe["recipe"]["version"], VERSION)
        names = [output["package"]["name"] for output in recipe["outputs"]]
        self.assertEqual(names, ["libfinshell", "finshell"])
        source = (ROOT / "packaging" / "conda" / recipe["source"]["path"]).resolve()
        self.assertEqual(source, ROOT.resolve())
        for output in recipe["outputs"]:
            self.options_exist(" ".join(output["build"]["script"]))
            self.assertTrue((ROOT / output["about"]["license_file"]).is_file())
            self.assertEqual(output["about"]["license"], "MIT")
            self.assertLessEqual({"build", "host"}, set(output["requirements"]))
            self.assertTrue(output["tests"])
        whole = recipe["outputs"][1]
        self.assertEqual(whole["build"]["python"]["entry_points"], [f"{k} = {v}" for k, v in toml("pyproject.toml")["project"]["scripts"].items()])
        project = toml("pyproject.toml")["project"]
        wanted = {re.match(r"[\w-]+", d).group(0) for d in project["dependencies"] + project["optional-dependencies"]["tools"]}
        given = {re.match(r"[\w-]+", d).group(0).replace("matplotlib-base", "matplotlib") for d in whole["requirements"]["run"]}
        self.assertLessEqual(wanted, given)
        # without SuiteSparse MUMPS is what solves
        self.assertIn("-DFINSHELL_SUITESPARSE=OFF", " ".join(whole["build"]["script"]))
        self.assertIn("mumps-seq", whole["requirements"]["host"])

    def test_spack(self):
        said = types.SimpleNamespace(depends=[], variants={}, versions=[])

        class When:
            def __enter__(self):
                return self

            def __exit__(self, *_):
                return False

        def passing(*_, **__):
            return lambda function: function

        class CMakePackage:
            def define(self, name, value):
                return f"-D{name}={'ON' if value is True else 'OFF' if value is False else value}"

            def define_from_variant(self, name, variant):
                return self.define(name, said.variants[variant])

        module = types.ModuleType("spack.package")
        module.__dict__.update(
            CMakePackage=CMakePackage, PythonExtension=type("PythonExtension", (), {}), when=lambda *_: When(), run_after=passing,
            on_package_attributes=passing, license=lambda name, **_: self.assertEqual(name, "MIT"), generator=lambda *_: None,
            version=lambda number, **_: said.versions.append(number), variant=lambda name, default, description: said.variants.update({name: default}),
            depends_on=lambda spec, **_: said.depends.append(spec), extends=lambda spec, **_: said.depends.append(spec),
            conflicts=lambda *_, **__: None)
        sys.modules["spack"], sys.modules["spack.package"] = types.ModuleType("spack"), module
        self.addCleanup(lambda: [sys.modules.pop(name) for name in ("spack", "spack.package")])
        spec = importlib.util.spec_from_file_location("finshell_spack", ROOT / "packaging" / "spack" / "package.py")
        loaded = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(loaded)
        self.assertEqual(said.versions, [VERSION])
        arguments = loaded.Finshell().cmake_args()
        self.options_exist(" ".join(arguments))
        names = {re.match(r"[\w-]+", d).group(0) for d in said.depends}
        # a solver that is switched on is depended on, and the other way round
        self.assertEqual("-DFINSHELL_SUITESPARSE=ON" in arguments, "suite-sparse" in names)
        self.assertEqual("-DFINSHELL_MUMPS=ON" in arguments, "mumps" in names)
        self.assertLessEqual({"hdf5", "lapack", "arpack-ng", "cmake", "c", "fortran"}, names)
        python = {re.match(r"[\w-]+", d).group(0) for d in toml("pyproject.toml")["project"]["dependencies"]
                  + toml("pyproject.toml")["project"]["optional-dependencies"]["tools"]}
        self.assertLessEqual({f"py-{name}" for name in python}, names)
        self.assertIn(f"cmake@{found(r'^cmake_minimum_required.VERSION ([0-9.]+)', 'CMakeLists.txt')}:", said.depends)


class Docker(Common):
    def setUp(self):
        lines = re.sub(r"\\\n", " ", "\n".join(l for l in text("packaging/docker/Dockerfile").splitlines() if not l.startswith("#")))
        self.steps = [(line.split(None, 1)[0], line.split(None, 1)[1]) for line in lines.splitlines() if line.strip()]

    def test_instructions(self):
        known = {"FROM", "RUN", "COPY", "WORKDIR", "ENV", "USER", "ENTRYPOINT", "CMD"}
        self.assertLessEqual({name for name, _ in self.steps}, known)
        stages = [re.match(r"(\S+)(?: AS (\w+))?$", rest).groups() for name, rest in self.steps if name == "FROM"]
        self.assertEqual(len(stages), 2)
        self.assertEqual(stages[0][0], stages[1][0], "one system builds and runs")
        for name, rest in self.steps:
            if name == "COPY" and "--from=" in rest:
                self.assertIn(re.search(r"--from=(\w+)", rest).group(1), [stage for _, stage in stages])
            if name in ("ENTRYPOINT", "CMD"):
                self.assertTrue(json.loads(rest))
            if name == "RUN":
                subprocess.run(["bash", "-n", "-c", rest], check=True)
        self.options_exist(" ".join(rest for name, rest in self.steps if name == "RUN"))

    def test_packages_exist(self):
        installs = [re.search(r"apt-get install (.*?)(?:&&|$)", rest).group(1).split() for name, rest in self.steps
                    if name == "RUN" and "apt-get install" in rest]
        self.assertEqual(len(installs), 2)
        packages = {word for words in installs for word in words if not word.startswith("-")}
        listed = re.search(r"^   build\)\n(.*?);;", text("tools/install_dependencies"), re.M | re.S).group(1)
        needed = set(re.search(r"system\+=\((.*?)\)", listed, re.S).group(1).split()) - {"libsuitesparse-dev"}
        self.assertLessEqual(needed, set(installs[0]))
        release = Path("/etc/os-release")
        if not tool("apt-cache") or "bookworm" not in (release.read_text(encoding="utf-8") if release.is_file() else ""):
            self.skipTest("the packages are those of Debian 12, which this is not")
        known = subprocess.run(["apt-cache", "pkgnames"], capture_output=True, text=True, check=True).stdout.split()
        self.assertEqual(packages - set(known), set())


class Hooks(Common):
    def test_pre_commit(self):
        config = yaml.safe_load(text(".pre-commit-config.yaml"))
        hooks = [hook for repo in config["repos"] for hook in repo["hooks"]]
        self.assertEqual({repo["repo"] for repo in config["repos"]}, {"local"})
        for hook in hooks:
            self.assertLessEqual({"id", "name", "entry", "language"}, set(hook))
            for word in hook["entry"].split():
                if word.startswith("tools/"):
                    self.assertTrue(os.access(ROOT / word, os.X_OK), word)
            re.compile(hook.get("files", ""))
        lint = next(hook for hook in hooks if hook["id"] == "lint")
        for name in ("src/finshell.f90", "test/unit/test_mesh.pf", "CMakeLists.txt", "test/CMakeLists.txt", "api/finshell.h"):
            self.assertTrue(re.search(lint["files"], name), name)
        if tool("pre-commit"):
            subprocess.run([tool("pre-commit"), "validate-config", str(ROOT / ".pre-commit-config.yaml")], check=True)

    def test_matrix_of_compilers(self):
        def matrix(*words):
            return subprocess.run([str(ROOT / "tools" / "ci_matrix"), *words], capture_output=True, text=True, check=False)

        done = matrix("--list")
        self.assertEqual(done.returncode, 0, done.stderr)
        for name in done.stdout.split():
            kind, number = name.split("-")
            self.assertGreaterEqual(int(number), {"gfortran": 12, "flang": 19}[kind])
        done = matrix("ifort")
        self.assertEqual(done.returncode, 2)
        self.assertIn("what is ifort?", done.stderr)


class Licences(Common):
    """tools/wheel_licences.py, which puts licences into wheels."""

    def test_known_and_unknown(self):
        self.assertFalse(wheel_licences.part("libgfortran5", "12", ROOT / "LICENSE").gpl)
        self.assertTrue(wheel_licences.part("libumfpack5", "5.12", ROOT / "LICENSE").gpl)
        with self.assertRaisesRegex(SystemExit, "libcurl4 has come into the wheel, and its licence is not known"):
            wheel_licences.part("libcurl4", "7", ROOT / "LICENSE")
        with self.assertRaisesRegex(SystemExit, "its licence is not at"):
            wheel_licences.part("libmetis5", "5", ROOT / "no such file")

    @unittest.skipUnless(tool("dpkg-query"), "owners of libraries are asked of dpkg")
    def test_owners_of_libraries(self):
        self.assertIn("libc6", wheel_licences.owners(["libc.so.6"]))
        with self.assertRaisesRegex(SystemExit, "no package of this system owns libnothing.so.7"):
            wheel_licences.owners(["libnothing.so.7"])

    def test_only_the_second_list_is_gpl(self):
        for table, gpl in ((wheel_licences.KNOWN, False), (wheel_licences.GPL, True)):
            for _, licence in table.values():
                without = re.sub(r"GPL-3.0-or-later WITH GCC-exception-3.1|LGPL-\S+", "", licence)
                self.assertEqual("GPL" in without, gpl, licence)

    def test_metadata(self):
        parts = [wheel_licences.part(name, "1", ROOT / "LICENSE") for name in ("libgfortran5", "libgomp1", "libumfpack5")]
        with tempfile.TemporaryDirectory() as folder:
            info = Path(folder)
            metadata = wheel_licences.add(info, "Name: x\nLicense-Expression: MIT\nLicense-File: LICENSE\n\nwords\n", parts)
            for name in re.findall(r"^License-File: (third_party/.*)$", metadata, re.M):
                self.assertTrue((info / "licenses" / name).is_file(), name)
            self.assertIn("| libumfpack5 | 1 | UMFPACK", (info / "licenses" / "third_party" / "README.md").read_text(encoding="utf-8"))
        self.assertEqual(metadata.count("License-File: "), 5)
        self.assertIn("License-Expression: MIT AND GPL-2.0-or-later AND GPL-3.0-or-later WITH GCC-exception-3.1\n", metadata)


if __name__ == "__main__":
    unittest.main()
