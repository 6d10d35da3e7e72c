"""Sphinx with MyST, for the sources that doc/site/assemble.py has put together (`make site`)."""
import re
import sys
from pathlib import Path

from sphinx.ext.autodoc.mock import mock
from sphinx.pycode import ModuleAnalyzer

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "api" / "python"), str(ROOT / "doc" / "site")]
import python_package  # noqa: E402

PACKAGE = ROOT / "api" / "python" / "finshell"

project = "finshell"
author = "the authors of finshell"
extensions = ["myst_parser", "sphinx.ext.autodoc"]
myst_heading_anchors = 4
html_theme = "furo"
html_title = "finshell"
html_show_copyright = False
html_show_sphinx = False
html_copy_source = False
html_show_sourcelink = False
pygments_style = "friendly"
autodoc_mock_imports = python_package.absent(PACKAGE)
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autoclass_content = "both"
suppress_warnings = ["misc.highlighting_failure"]  # namelists are shown as Fortran, which they nearly are
nitpicky = False
smartquotes = False


def indented_is_code(app, what, name, obj, options, lines):
    """Docstrings are written for help(): what is indented after an empty line is code."""
    marked = []
    for number, line in enumerate(lines):
        if line.startswith("    ") and number and not lines[number - 1].strip():
            marked += ["::", ""]
        marked.append(line)
    lines[:] = marked


def short_arrays(app, what, name, obj, options, signature, returns):
    """Types of arrays of numpy by the names that the sources have for them."""
    def short(text):
        for kind, alias in (("float64", "Doubles"), ("int32", "Codes")):
            text = text and re.sub(rf"(~?numpy\.)?ndarray\[(~?typing\.)?tuple\[(~?typing\.)?Any, \.\.\.\], (~?numpy\.)?dtype\[(~?numpy\.)?{kind}\]\]", alias, text)
        return text

    return short(signature), short(returns)


def attributes_have_comments(app):
    """The comment behind an attribute is its documentation, as if it began with `#:`."""
    for path in PACKAGE.glob("*.py"):
        with mock(autodoc_mock_imports):
            analyzer = ModuleAnalyzer.for_module("finshell" if path.stem == "__init__" else f"finshell.{path.stem}")
        analyzer.analyze()
        analyzer.attr_docs.update({place: [text, ""] for place, text in python_package.comments(path).items()})


def setup(app):
    """Called by Sphinx."""
    app.connect("builder-inited", attributes_have_comments)
    app.connect("autodoc-process-signature", short_arrays)
    app.connect("autodoc-process-docstring", indented_is_code)
