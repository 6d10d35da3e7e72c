"""Pages of the C headers in api/: every declaration under the comment that stands before it."""
import re
from pathlib import Path

from markup import escaped

COMMENT = re.compile(r"^/\*(.*?)\*/[^\S\n]*\n?", re.S | re.M)
FRAME = re.compile(r"^#ifdef __cplusplus\n.*?^#endif\n?|^#ifndef FINSHELL\w*_H\n#define FINSHELL\w*_H\n?|^#endif\s*\Z", re.S | re.M)

TERM = re.compile(r"\s*(\S(?:\S| \S)*?)(\s{2,})\S")
FULL = 115  # characters of a line with which the next word begins another one


class Part:
    """A comment at the beginning of a line, and the code up to the next one."""

    def __init__(self, comment, code, section):
        self.lines = [re.sub(r"^ \* ?", "", line).rstrip() for line in comment.strip("\n").splitlines()]
        self.code, self.section = FRAME.sub("", code).strip("\n"), section
        self.title = ""
        if self.lines and re.match(r" ?-{5}", self.lines[0]):
            self.title = self.lines.pop(0).strip(" -")
        self.lines = [line[1:] if line.startswith(" ") and number == 0 else line for number, line in enumerate(self.lines)]

    def words(self):
        """The comment in one line."""
        return " ".join(" ".join(self.lines).split())

    def declared(self):
        """(name, is a function) of what the code declares."""
        text = re.sub(r"/\*.*?\*/", " ", self.code, flags=re.S)
        text = re.sub(r"^\s*#(.*\\\n)*.*$", "", text, flags=re.M)
        for statement in statements(text):
            # of a pointer to a function; of a function
            name = (re.search(r"\(\s*\*\s*(finshell_\w+)\s*\)|^[^({]*\b(finshell_\w+)\s*\(", statement)
                    if statement.startswith("typedef") else None)
            if name or statement.startswith("typedef"):
                yield (name or re.search(r"(\w+)\W*$", statement)).group(name.lastindex if name else 1), False
            elif re.match(r"(struct|union)\b", statement) and "(" not in statement.partition("{")[0]:
                yield re.search(r"(finshell_\w+)", statement).group(1), False
            elif "(" in statement and not statement.startswith("enum"):
                yield re.search(r"(finshell_\w+)\s*\(", statement).group(1), True


def statements(text):
    """The statements of C at the outer level, without the `;`."""
    depth, begun = 0, ""
    for character in text:
        depth += {"{": 1, "}": -1}.get(character, 0)
        begun += character
        if depth == 0 and (character == ";" or character == "}" and re.match(r"\s*(static|inline|FINSHELL_API\s+static)\b", begun)):
            if begun.strip(" \n;"):
                yield " ".join(begun.strip(" \n;").split())
            begun = ""


def parts(text):
    """All parts of a header; each knows the part that opens its section."""
    found, section = [], None
    places = list(COMMENT.finditer(text))
    for place, following in zip(places, [*places[1:], None]):
        part = Part(place.group(1), text[place.end():following.start() if following else len(text)], section)
        section = part if part.title else section
        found.append(part)
    return found


def functions(text):
    """Names of all functions of a header."""
    return [name for part in parts(text) for name, function in part.declared() if function]


def undocumented(path):
    """Sentences: file, line and name of every type or function without a comment of its own, and every function without "Since"."""
    found, text = [], path.read_text(encoding="utf-8")
    code = re.sub(r"/\*.*?\*/", lambda comment: re.sub(r"[^\n]", " ", comment.group()), text, flags=re.S)
    for part in parts(text):
        for number, (name, function) in enumerate(part.declared()):
            at = re.search(rf"\b{name}\s*\(" if function else rf"\b{name}\b", code).start()
            place = f"{path}:{code.count(chr(10), 0, at) + 1}: {name} has no"
            if number > 0 or part.title or not part.words():
                found.append(f"{place} comment of its own (one that begins a line, before it)")
            elif function and not any(re.search(r"[Ss]ince \d+\.\d+", p.words()) for p in (part, part.section) if p):
                found.append(f"{place} \"Since\" with the version that brought it")
    return found


class Names:
    """Where functions and types of all headers are explained."""

    def __init__(self, headers):
        self.page = {name: f"{page_name(path)}.md" for path in headers
                     for part in parts(path.read_text(encoding="utf-8")) for name, _ in part.declared()}

    def linked(self, text, own=""):
        """Words of a comment as Markdown, with links to what is explained elsewhere than under `own`."""
        def link(word):
            return f"[{escaped(word)}]({self.page[word]}#{word})" if word in self.page and word != own else escaped(word)

        return "".join(link(word) for word in re.split(r"(?<!\w)(finshell_\w+)", text))


def page_name(path):
    """Of the page of a header."""
    return "c_" + path.stem


def items(lines):
    """Comment lines as (indent, text): a new entry at every list item, a continuation joined to the one before; code as it is."""
    found, column, code = [], 0, False
    for number, line in enumerate(lines):
        indent = len(line) - len(line.lstrip())
        if not line:
            found.append((0, ""))
            continue
        if indent >= 3 and number and not lines[number - 1] or code and indent >= 3:
            code = True
            found.append((-1, line[3:]))
            continue
        code = False
        term = TERM.match(line)
        deeper = found and found[-1][1] and indent > found[-1][0] and (indent >= column > 0 or not term and found[-1][0] > 0)
        plain = found and found[-1][1] and indent == found[-1][0] == 0
        # in the column of an item without a term, whose last line had no room for this word
        before = lines[number - 1] if number else ""
        same_column = indent == len(before) - len(before.lstrip()) > 0 and not term and not TERM.match(before)
        full = same_column and len(f"{before} {line.split()[0]}") > FULL
        if deeper or plain or full:
            found[-1] = (found[-1][0], f"{found[-1][1]} {line.strip()}")
            continue
        column = term.end() - 1 if term else 0
        text = line.strip()
        found.append((indent, f"{term.group(1)}\0{text[term.end(2) - indent:]}" if term else text))
    return found


def prose(lines, names, own=""):
    """A comment as Markdown: indented lines become lists, `term  what it is` an item with the term first."""
    out, levels, code = [], [], []
    for indent, text in [*items(lines), (0, "")]:
        if indent < 0:
            code.append(text)
            continue
        if code:
            out += ["", "```c", *code, "```", ""]
            code = []
        if indent == 0:
            levels = []
            out += ["", names.linked(text, own)] if text else [""]
            continue
        levels = [level for level in levels if level < indent] + [indent]
        if len(levels) == 1 and out and not re.match(r"\s*- ", out[-1]):
            out.append("")
        term, _, what = text.removeprefix("- ").partition("\0")
        bare = re.fullmatch(r"[\w*]+(, [\w*]+)*( (\[\w+\])+)?", term)  # an argument and nothing about it
        words = f"`{term}`: {names.linked(what, own)}" if what else f"`{term}`" if bare else names.linked(term, own)
        out.append("  " * (len(levels) - 1) + "- " + words)
    return re.sub(r"\n{3,}", "\n\n", "\n".join(out)).strip()


def page(path, names):
    """The page of a header."""
    found = parts(path.read_text(encoding="utf-8"))
    index = ["| | |", "| --- | --- |"]
    body = ["## Conventions"]
    for part in found:
        if part.title:
            body.append("## " + part.title[:1].upper() + part.title[1:])
        declared = [name for name, _ in part.declared()]
        if declared and not part.title:
            body.append(f"### {declared[0]}")
            first = re.split(r"(?<=[.:;])\s", part.words())[0].rstrip(".:;")
            index.append(f"| [{escaped(declared[0])}](#{declared[0]}) | {escaped(first)} |")
        if part.words():
            body.append(prose(part.lines, names, declared[0] if declared else ""))
        if part.code.strip():
            body.append("```c\n" + part.code + "\n```")
    return "\n\n".join([f"# {path.name}", "\n".join(index), *body]) + "\n"


def write(root: Path, folder: Path):
    """Write the pages of all headers; their names, and what is undocumented."""
    headers = sorted((root / "api").glob("*.h"))
    names = Names(headers)
    for path in headers:
        (folder / f"{page_name(path)}.md").write_text(page(path, names), encoding="utf-8")
    return [page_name(path) for path in headers], [line for path in headers for line in undocumented(path)]
