"""Pages of the interfaces, from the sources: Fortran modules by their !> comments, finshell.h, the Python package."""
import re
import textwrap
from pathlib import Path


def escaped(text):
    """Words of a comment as Markdown: what looks like markup is none."""
    return re.sub(r"(?<!`)([<>*_\[\]$|])", r"\\\1", text)


def paragraphs(lines):
    """Comment lines as Markdown: indented ones are code."""
    found, code = [], []
    for line in [*lines, ""]:
        if line.startswith("    "):
            code.append(line[4:])
            continue
        if code:
            found += ["", "```text", *code, "```", ""]
            code = []
        found.append(escaped(line))
    return "\n".join(found).strip()


class Module:
    """What a Fortran module shows: its comment, and its public procedures and types with theirs."""

    def __init__(self, text):
        self.lines = text.splitlines()
        self.name = next((m.group(1) for m in (re.match(r"module (\w+)\s*$", line) for line in self.lines) if m), None)
        self.comment, self.entries = [], []
        if self.name:
            self._read(self._public(text))

    @staticmethod
    def _public(text):
        joined = re.sub(r"&\s*(!.*)?\n(\s*!.*\n)*\s*&?", " ", text)
        names = set()
        for line in re.findall(r"^\s*public ::(.*)$", joined, re.M):
            names |= {re.sub(r"!.*|operator\(.*\)|assignment\(=\)", "", name).strip().lower() for name in line.split(",")}
        names |= {name.lower() for name in re.findall(r"^\s*(?:type|integer|real|character|logical)[^!\n]*\bpublic\b[^!\n]*::\s*(\w+)", joined, re.M)}
        return names - {""}

    def _read(self, public):
        comment, inside, depth = [], "head", 0
        number = 0
        while number < len(self.lines):
            line = self.lines[number]
            stripped = line.strip()
            if stripped.startswith("!>"):
                comment = [stripped[2:].removeprefix(" ")]
                while number + 1 < len(self.lines) and re.match(r"\s*!>", self.lines[number + 1]):
                    number += 1
                    comment.append(self.lines[number].strip()[2:].removeprefix(" "))
            elif inside == "head" and re.match(r"module \w+\s*$", line):
                self.comment, comment, inside = comment, [], "body"
            elif re.match(r"(end (subroutine|function)\b|end procedure\b)", stripped):
                depth -= 1
            elif re.match(r"(abstract )?interface\b", stripped):
                depth += 1
            elif stripped.startswith("end interface"):
                depth -= 1
            elif self._procedure(stripped):
                name = self._procedure(stripped)
                depth += 1
                if depth == 1 and name.lower() in public:
                    self.entries.append((name, comment, self._head(number, name)))
                comment = []
            elif depth == 0 and re.match(r"type\b(?!\s*\()[^!]*(::|\s)\s*\w+\s*(!.*)?$", stripped) and not stripped.startswith("type is"):
                name = re.match(r"type\b.*?(\w+)\s*(?:!.*)?$", stripped).group(1)
                end = next(i for i in range(number, len(self.lines)) if self.lines[i].strip().startswith("end type"))
                if name.lower() in public or re.search(r"\bpublic\b", stripped):
                    self.entries.append((name, comment, self.lines[number:end + 1]))
                comment, number = [], end
            elif stripped:
                comment = []
            number += 1

    @staticmethod
    def _procedure(line):
        match = re.match(r"(?:(?:pure|elemental|impure|recursive|module)\s+)*(?:(?:real|integer|logical|character|type)\s*(?:\([^)]*\))?\s+)?"
                         r"(?:subroutine|function)\s+(\w+)", line)
        return match.group(1) if match else None

    def _head(self, number, name):
        """The statement of a procedure and the declarations of its arguments."""
        head = [self.lines[number]]
        while head[-1].split("!")[0].rstrip().endswith("&"):
            number += 1
            head.append(self.lines[number])
        statement = " ".join(part.split("!")[0].strip().strip("&") for part in head)
        arguments = re.search(r"\((.*?)\)", statement)
        result = re.search(r"result\s*\((\w+)\)", statement)
        wanted = {a.strip().lower() for a in (arguments.group(1).split(",") if arguments else [])} | {(result.group(1) if result else name).lower()}
        for line in self.lines[number + 1:]:
            if re.match(r"\s*(end|contains|if|do|associate|call|select|block)\b", line):
                break
            declared = re.match(r"[^!]*::\s*([^!]*)", line)
            if declared and wanted & {re.sub(r"\(.*|=.*", "", part).strip().lower() for part in re.sub(r"\([^()]*\)", "", declared.group(1)).split(",")}:
                head.append(line)
        return head

    def page(self):
        """As Markdown; empty where nothing is public."""
        if not self.entries:
            return ""
        parts = [f"## {self.name}", paragraphs(self.comment)]
        for name, comment, head in self.entries:
            parts += [f"### {name}", paragraphs(comment), "```fortran\n" + textwrap.dedent("\n".join(head)) + "\n```"]
        return "\n\n".join(part for part in parts if part) + "\n"


def fortran(root, folder):
    """A page for each room of src/rooms.txt; their names."""
    rows = [[cell.strip() for cell in line.split("|")] for line in (root / "src" / "rooms.txt").read_text(encoding="utf-8").splitlines()
            if line.strip() and not line.startswith("#")]
    names = []
    facade = (root / "src" / "finshell.f90").read_text(encoding="utf-8")
    head = [line[2:].removeprefix(" ") for line in facade.splitlines() if line.startswith("!>")]
    index = ["# Fortran modules", "", paragraphs(head), "", "| room | library | holds |", "| --- | --- | --- |"]
    for room, library, _, what in rows:
        modules = [Module(path.read_text(encoding="utf-8")) for path in sorted((root / "src" / room).glob("*.[fF]90"))]
        text = "\n".join(page for page in (module.page() for module in modules if module.name) if page)
        name = "fortran_" + room.replace("/", "_")
        index.append(f"| [{room}]({name}.md) | {library} | {escaped(what)} |" if text else f"| {room} | {library} | {escaped(what)} |")
        if text:
            (folder / f"{name}.md").write_text(f"# {room}\n\n{escaped(what[:1].upper() + what[1:])}.\n\n{text}", encoding="utf-8")
            names.append(name)
    index += ["", "```{toctree}", ":hidden:", "", *names, "```", ""]
    (folder / "fortran.md").write_text("\n".join(index), encoding="utf-8")
    return names


def c_header(root, folder, header="finshell.h", page="c_header.md"):
    """A header: its comments as words, what they stand before as code."""
    text = (root / "api" / header).read_text(encoding="utf-8")
    parts = [f"# {header}", "## Conventions"]
    for number, (comment, code) in enumerate(re.findall(r"^/\*(.*?)\*/\n?(.*?)(?=^/\*|\Z)", text, re.S | re.M)):
        lines = [re.sub(r"^ \* ?", "", line).rstrip() for line in comment.splitlines()]
        if lines[0].strip().startswith("-----"):
            parts.append("## " + lines[0].strip(" -").capitalize())
            lines = [""]
        function = re.search(r"^(?:int32_t|void|const char \*)\s*(finshell_\w+)\(", code, re.M) or re.search(r"^(?:typedef struct )(finshell_\w+)", code, re.M)
        if function:
            parts.append(f"### {function.group(1)}")
        words = " ".join(lines) if number else "\n".join(lines)
        if words.strip():
            parts.append(escaped(words.strip()) if number else "```text\n" + words.strip() + "\n```")
        if code.strip():
            parts.append("```c\n" + code.strip() + "\n```")
    (folder / page).write_text("\n\n".join(parts) + "\n", encoding="utf-8")


PYTHON = """# Python package

```{eval-rst}
.. automodule:: finshell
   :members:
   :imported-members:
   :undoc-members:

.. automodule:: finshell.precice
   :members:

.. automodule:: finshell.results
   :members:
   :exclude-members: Values

.. automodule:: finshell.fit
   :members: read, fit, Data, Fit, report, warnings
```
"""


def write(root: Path, folder: Path):
    """Write all of them; the pages for the side of the site."""
    fortran(root, folder)
    c_header(root, folder)
    c_header(root, folder, "finshell_model.h", "c_model_header.md")
    (folder / "python.md").write_text(PYTHON, encoding="utf-8")
    return ["fortran", "c_header", "c_model_header", "python"]
