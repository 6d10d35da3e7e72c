"""Sphinx with MyST, for the sources that doc/site/assemble.py has put together (`make site`)."""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "api" / "python"))

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
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
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


def setup(app):
    """Called by Sphinx."""
    app.connect("autodoc-process-signature", short_arrays)
    app.connect("autodoc-process-docstring", indented_is_code)
