#!/usr/bin/env python3
"""Every word that the input lets one choose is described in doc/namelist.md, in the part on its group, and no other words are."""
import re
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PARTS = {  # file of src/io/input that reads groups: headings of their description
    "solver": ["job"], "preset": ["job"], "mesh": ["mesh"], "normals": ["mesh"], "section": ["material", "section"], "direction": ["section"], "support": ["support"], "load": ["load"], "growth": ["growth"], "field": ["field"], "chamber": ["chamber"], "amplitude": ["amplitude"], "joint": ["tie", "rigid_body", "equal", "equation"],
    "step": ["step"], "time_step": ["step"], "monitor": ["monitor", "probe", "output", "fields"],
    "probe": ["monitor", "probe", "output", "fields"], "output": ["monitor", "probe", "output", "fields"],
    "connector": ["spring", "bar", "cable", "dashpot", "point_mass"],
}
LISTS = {  # lists that are made elsewhere: file, pattern of the statement
    "diagonal_names": ("model/finshell_mesh_grid.f90", r"diagonal_names = ('.*?')"),
    "reduce_names": ("model/finshell_monitor.f90", r"reduce_names = ('.*?')"),
    "law_names()": ("material/finshell_registry.f90", r"parameter :: \w+\(\d*\*?\) = \[(.*?'orthotropic'.*?)\]"),
}
NOT_CHOICES = {"all", "step 1"}  # defaults of names


def joined(text):
    """Continuation lines joined."""
    return re.sub(r"&\s*\n\s*&?", "", text)


def words_of(text):
    """The words of "'a, b'" or of "len=..:: 'a', 'b'"."""
    return {word.strip() for quoted in re.findall(r"'([^']*)'", text) for word in quoted.split(",") if word.strip()}


def field_rows(sources):
    """The table of doc/namelist.md on fields, as the tables of the sources have it: a line each."""
    places = {"element": "element", "surfaces": "bottom, middle, top", "layers": "each layer"}
    found = []
    for name, components, dimension, meaning in re.findall(r"field\('(\w+)', '([^']*)', '([^']*)', \.\w+\., \w+,\s*'([^']*)'",
                                                           joined(sources["model/finshell_node_fields.f90"])):
        found.append((name, components, "node", dimension, meaning))
    for name, components, place, dimension, meaning in re.findall(r"field\('(\w+)', '([^']*)', at_(\w+), '([^']*)', \w+,\s*'([^']*)'",
                                                                  joined(sources["element/finshell_element_fields.f90"])):
        found.append((name, components, places[place], dimension, meaning))
    for name, dimension, meaning in re.findall(r"around\('(\w+)', '([^']*)',\s*'([^']*)'", joined(sources["model/finshell_result_fields.f90"])):
        found.append((name, "", "element", dimension, meaning))
    for name, dimension, meaning, components in re.findall(r"whole\('(\w+)', '([^']*)',\s*'([^']*)'(?:, '([^']*)')?",
                                                           joined(sources["model/finshell_result_fields.f90"])):
        found.append((name, components, "structure", dimension, meaning))
    for name, dimension, meaning in re.findall(r"of_connector\('(\w+)', '([^']*)',\s*'([^']*)'", joined(sources["model/finshell_result_fields.f90"])):
        found.append((name, "", "connector", dimension, meaning))
    for name, dimension, meaning in re.findall(r"through\('(\w+)', '([^']*)',\s*'([^']*)'", joined(sources["model/finshell_result_fields.f90"])):
        found.append((name, "x, y, z", "cut", dimension, meaning))
    return ["| " + " | ".join([f"`'{name}'`", ", ".join(f"`'{c.strip()}'`" for c in components.split(",") if c.strip()), *rest]) + " |"
            for name, components, *rest in found]


def choices(part, sources):
    """The words one can choose from in the groups that a file reads."""
    text = joined(sources[f"io/input/finshell_input_{part}.f90"])
    found = set()
    for given in re.findall(r"choices=('[^']*'|\w+(?:\(\))?)", text) + re.findall(r"get_component\(group, ('[^']*')", text) \
            + re.findall(r"read_choice\(group, '\w+', (\w+)", text):
        if given == "list":  # of read_choice, whose calls are looked at
            continue
        if given == "field_list":
            for row in field_rows(sources):
                found |= set(re.findall(r"`'([^'`]*)'`", row))
        elif given.startswith("'"):
            found |= words_of(given)
        elif given in LISTS:
            file, pattern = LISTS[given]
            found |= words_of(re.search(pattern, joined(sources[file]), re.S).group(1))
        else:
            found |= words_of(re.search(rf"\b{given} = ('[^']*')", text).group(1))
    return found


def described(headings, document):
    """The words in quotes in the first two columns of the tables below these headings."""
    found = set()
    for heading in headings:
        part = re.search(rf"^## {heading}$(.*?)(?=^## |\Z)", document, re.S | re.M).group(1)
        for line in part.splitlines():
            if line.startswith("|"):
                found |= set(re.findall(r"`'([^'`]*)'`", "|".join(line.split("|")[1:3])))
    return found - NOT_CHOICES


def differences(sources, document):
    """What stands in one place only."""
    found = []
    for headings in {tuple(h) for h in PARTS.values()}:
        inside = {word for part, names in PARTS.items() if set(names) <= set(headings) for word in choices(part, sources)}
        if any(set(headings) < set(other) for other in PARTS.values()):
            continue
        outside = described(headings, document)
        found += [f"&{'/&'.join(headings)}: '{word}' is not described" for word in sorted(inside - outside)]
        found += [f"&{'/&'.join(headings)}: '{word}' is described but not known" for word in sorted(outside - inside)]
    return found


class Choices(unittest.TestCase):
    def setUp(self):
        self.sources = {str(p.relative_to(ROOT / "src")): p.read_text() for p in (ROOT / "src").rglob("*.f90")}
        self.document = (ROOT / "doc" / "namelist.md").read_text()

    def test_choices_and_documentation_agree(self):
        self.assertEqual(differences(self.sources, self.document), [])

    def test_table_of_fields_is_that_of_the_sources(self):
        part = re.search(r"^## fields$(.*?)(?=^## |\Z)", self.document, re.S | re.M).group(1)
        rows = [line for line in part.splitlines() if line.startswith("| `")]
        self.assertEqual(rows, field_rows(self.sources))
        number = sum(int(re.search(rf"{name} = (\d+)", self.sources[file]).group(1)) for file, name in
                     (("element/finshell_element_fields.f90", "n_element_fields"), ("model/finshell_node_fields.f90", "n_node_fields")))
        self.assertEqual(len(rows), number + 12)

    def test_every_list_is_seen(self):
        count = sum(len(choices(part, self.sources)) for part in PARTS)
        self.assertGreater(count, 85)
        for file, text in self.sources.items():
            if "choices=" in text and not re.search(r"subroutine (get|to)_\w*string|get_component\(", text):
                self.assertIn(re.sub(r"io/input/finshell_input_(\w+)\.f90", r"\1", file), PARTS, f"{file} reads choices: add it here")

    def test_a_word_more_is_noticed(self):
        for part, old, new in (("mesh", "strip, hole'", "strip, hole, torus'"), ("monitor", "bottom, middle, top'", "bottom, middle, top, outside'"),
                               ("step", "'paper, tight'", "'paper, tight, loose'"), ("support", "symmetry, components'", "symmetry, spring, components'"),
                               ("load", "centrifugal, foundation'", "centrifugal, wind, foundation'")):
            name = f"io/input/finshell_input_{part}.f90"
            self.assertIn(old, self.sources[name])
            self.assertEqual(len(differences({**self.sources, name: self.sources[name].replace(old, new)}, self.document)), 1)
        for file, old, new in (("material/finshell_registry.f90", "'linear_elastic', 'orthotropic'", "'linear_elastic', 'hencky', 'orthotropic'"),
                               ("model/finshell_monitor.f90", "max, min'", "max, min, median'"),
                               ("model/finshell_node_fields.f90", "field('reaction',", "field('reactions',"),
                               ("element/finshell_element_fields.f90", "field('moment', '11, 22, 12'", "field('moment', '11, 22, 13'")):
            self.assertIn(old, self.sources[file])
            self.assertIn(len(differences({**self.sources, file: self.sources[file].replace(old, new)}, self.document)), (1, 2))
        self.assertEqual(len(differences(self.sources, self.document.replace("`'annulus'`, ", "", 1))), 1)
        self.assertEqual(len(differences(self.sources, self.document.replace("`'annulus'`, ", "`'annulus'`, `'torus'`, ", 1))), 1)


if __name__ == "__main__":
    unittest.main()
