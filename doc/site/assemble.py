#!/usr/bin/env python3
"""The sources of the documentation site: doc/, README, examples/ and pages of the interfaces, with links between them.

    assemble.py FOLDER [PICTURES]

FOLDER is made anew. PICTURES: a folder that `gallery.py` has filled; without it the gallery has words only.
Links to pages of the site stay links; those to other files of the repository become plain words.
"""
import json
import os
import re
import shutil
import sys
from pathlib import Path

import interfaces

ROOT = Path(__file__).resolve().parents[2]
GUIDE = ("getting_started", "meshes", "materials", "user_laws", "controls", "steps", "growth", "joints", "connectors", "chambers", "results", "command_line", "troubleshooting", "namelist")
METHODS = ("theory", "path_following", "relaxation", "dynamics", "explicit", "study", "adaptive", "error_estimate", "sensitivity", "switches", "parallel")
LINK = re.compile(r"(!?\[[^\]]*\])\(([^)\s]+)\)")


def pages():
    """Path of every page in the repository -> its path in the site."""
    found = {Path("README.md"): Path("index.md"), Path("CONTRIBUTING.md"): Path("contributing.md"), Path("CHANGELOG.md"): Path("changelog.md"),
             Path("LICENSE"): None}
    for path in sorted((ROOT / "doc").glob("*.md")):
        found[path.relative_to(ROOT)] = Path(path.name)
    for path in sorted({p.parent / "README.md" for p in (ROOT / "examples").glob("*/*.nml")} | set((ROOT / "examples").glob("*/README.md"))):
        found[path.relative_to(ROOT)] = Path("examples") / f"{path.parent.name}.md"
    for path in sorted((ROOT / "api").rglob("README.md")):
        found[path.relative_to(ROOT)] = Path("hosts") / f"{path.parent.name}.md"
    return {old: new for old, new in found.items() if new}


def outside_of_code(text, change):
    """Apply `change` to what is no block of code."""
    parts = re.split(r"(^```.*?^```[^\n]*\n)", text, flags=re.S | re.M)
    return "".join(part if i % 2 else change(part) for i, part in enumerate(parts))


def relinked(text, old, new, known):
    """The text of page `old` with links as they are from page `new` of the site."""
    def target(match):
        words, link = match.groups()
        path, _, anchor = link.partition("#")
        if not path or re.match(r"[a-z]+:", link):
            return match.group(0)
        place = Path(os.path.normpath(old.parent / path))
        page = known.get(place) or known.get(place / "README.md")
        if page:
            return f"{words}({os.path.relpath(page, new.parent)}{'#' + anchor if anchor else ''})"
        if place.parts[:2] == ("doc", "pictures"):
            return f"{words}({os.path.relpath(Path('pictures', *place.parts[2:]), new.parent)})"
        return words.strip("![]")

    return outside_of_code(text, lambda part: LINK.sub(target, part))


def tree(caption, names):
    """A list of pages for the side of the site."""
    return f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n" + "\n".join(names) + "\n```\n"


def example(path, text):
    """The page of an example: its README, its inputs and its programs."""
    return text.rstrip() + "\n" + "".join(f"\n`{p.relative_to(ROOT)}`:\n\n```{language}\n{p.read_text(encoding='utf-8').rstrip()}\n```\n"
                                         for pattern, language in (("*.nml", "fortran"), ("host*.py", "python"), ("host*.cpp", "cpp"), ("problems.h", "cpp"))
                                         for p in sorted(path.parent.glob(pattern)))


def gallery(folder, pictures):
    """The page of pictures, and the pictures."""
    lines = ["# Gallery", "", "Examples of the repository, drawn by `finshell-plot`. The pictures are made by `make gallery`."]
    index = Path(pictures) / "gallery.json" if pictures else None
    if not index or not index.is_file():
        return "\n".join([*lines, "", "They have not been made yet.", ""])
    (folder / "gallery").mkdir()
    for entry in json.loads(index.read_text(encoding="utf-8")):
        shutil.copy(Path(pictures) / entry["file"], folder / "gallery" / entry["file"])
        lines += ["", f"## {entry['title']}", "", f"![{entry['title']}](gallery/{entry['file']})", "",
                  f"{entry['text']} [Input and references](examples/{entry['example']}.md).", "", f"```sh\n{entry['command']}\n```"]
    return "\n".join(lines) + "\n"


def main():
    folder, pictures = Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else None
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    shutil.copytree(ROOT / "doc" / "pictures", folder / "pictures")
    known = pages()
    listed = {str(new.with_suffix("")) for new in known.values()}
    for old, new in known.items():
        text = (ROOT / old).read_text(encoding="utf-8") if (ROOT / old).is_file() else f"# {old.parent.name}\n"
        if old.parts[0] == "examples":
            text = example(ROOT / old, text)
        text = relinked(text, old, new, known)
        (folder / new).parent.mkdir(exist_ok=True)
        (folder / new).write_text(text, encoding="utf-8")
    api = interfaces.write(ROOT, folder)
    (folder / "gallery.md").write_text(gallery(folder, pictures), encoding="utf-8")
    examples = sorted(name for name in listed if name.startswith("examples/"))
    (folder / "examples.md").write_text("# Examples\n\n```{toctree}\n:maxdepth: 1\n\n" + "\n".join(examples) + "\n```\n", encoding="utf-8")
    hosts = ["hosts", "hosts_calculix", *sorted(name for name in listed if name.startswith("hosts/"))]
    rest = sorted(listed - {"index", "contributing", "changelog", *GUIDE, *METHODS, *examples, *hosts, "c_api", "model_api", "packages"})
    with (folder / "index.md").open("a", encoding="utf-8") as index:
        index.write(tree("Guide", GUIDE) + tree("Pictures", ["gallery", "examples"]) + tree("Methods", METHODS) + tree("Measured", rest)
                    + tree("Library", ["c_api", "model_api", *api, *hosts]) + tree("Project", ["packages", "contributing", "changelog"]))


if __name__ == "__main__":
    main()
