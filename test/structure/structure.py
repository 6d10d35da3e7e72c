"""Rules on the structure of the sources, read from their text.

1. `use` goes one way: a room uses those that src/rooms.txt allows, which stand above it there; api sits on the kernel only, but
   for api/model, which sits on the room session.
2. Kernel (math, material, section, element): no input or output, no stop, no save, no module variables; no allocation, except
   while something is set up (procedures new_* and *_parameters, components of types; the registry of laws and its lists).
3. Nothing but app prints or stops.
4. No file of src is longer than 400 lines, unless long_files.txt gives a reason.
5. Freedoms are counted by finshell_freedoms only: no literal 6, 9 or 18 above the kernel, no 18 in element and batch, but those
   of freedoms.txt, which stand for something else.
6. Test files use no name of pFUnit (pfunit_names.txt) for anything of their own: it may not compile where pFUnit is used.
"""
import os
import pathlib
import re

KERNEL = {"math", "material", "section", "element"}
OPEN_TO_API = {"base", "math", "section", "element", "batch", "pattern"}
MATERIAL_OPEN_TO_API = {"finshell_parameter", "finshell_registry", "finshell_material", "finshell_outside_law", "finshell_law_description",
                        "finshell_law_findings"}
SET_UP = {"finshell_registry", "finshell_parameter", "finshell_parameter_values", "finshell_law_description", "finshell_plugin"}  # material laws by name: never called for an element
LONGEST = 400


def text_of(path):
    """Content of a file."""
    return pathlib.Path(path).read_text(encoding="utf-8")


def statements(text):
    """(line number, statement) in lower case: comments and the inside of strings removed, continuations joined, split at ;"""
    found, current, start = [], "", 0
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("#"):
            continue
        code = re.sub(r"'[^']*'|\"[^\"]*\"", "''", line).split("!")[0].strip()
        if not code:
            continue
        if not current:
            start = number
        current += (" " if current else "") + code.lstrip("&").rstrip("&").strip()
        if code.endswith("&"):
            continue
        found += [(start, part.strip().lower()) for part in current.split(";") if part.strip()]
        current = ""
    return found


def action_of(statement):
    """What a statement does: without the condition of a one-line if."""
    if not re.match(r"if\s*\(", statement):
        return statement
    depth = 0
    for i, c in enumerate(statement):
        depth += (c == "(") - (c == ")")
        if c == ")" and depth == 0:
            return statement[i + 1:].strip()
    return statement


def fortran_files(folder):
    """Paths below a folder, sorted."""
    return sorted(os.path.join(here, name) for here, _, names in os.walk(folder) for name in names
                  if name.lower().endswith(".f90"))


def rooms_of(root):
    """Room -> rooms that it may use, in the order of src/rooms.txt."""
    rows = [line.split("|") for line in text_of(os.path.join(root, "src", "rooms.txt")).splitlines() if line.strip() and not line.startswith("#")]
    return {row[0].strip(): row[2].split() for row in rows}


def drawing(root):
    """The rooms as a text tree, each with those that it uses."""
    lines, last = [], ""
    rows = [line.split("|") for line in text_of(os.path.join(root, "src", "rooms.txt")).splitlines() if line.strip() and not line.startswith("#")]
    for room, library, used, what in ([cell.strip() for cell in row] for row in rows):
        if library != last:
            lines.append(f"lib{library}")
        last = library
        lines.append(f"  {room:<14}{what}".rstrip())
        lines.append(f"  {'':<14}<- {used or '-'}")
    return "\n".join(lines)


def rooms_violations(root):
    """A room uses rooms above it only, and every file lives in one."""
    found, seen = [], []
    rooms = rooms_of(root)
    for room, used in rooms.items():
        found += [f"src/rooms.txt: {room} uses {u}, which does not stand above it" for u in used if u not in seen]
        seen.append(room)
    for path in fortran_files(os.path.join(root, "src")):
        if layer_of(path, root) not in [*rooms, "facade"]:
            found.append(f"{os.path.relpath(path, root)}: no room of src/rooms.txt")
    return found


def layer_of(path, root):
    """Name of the room a file belongs to: a folder of src, 'facade', 'api' or 'main'."""
    folder = os.path.dirname(os.path.relpath(path, root)).replace(os.sep, "/")
    if folder == "src" or folder.startswith("src/"):
        return folder[4:] or "facade"
    if folder == "api/model":
        return "api/model"
    return "main" if folder.split("/")[0] in ("app", "mpi") else "api"


def arrow_allowed(user, used, module, rooms):
    """May room `user` use `module` of room `used`?"""
    if user == used:
        return True
    if user in ("facade", "api"):
        if used == "material":
            return module in MATERIAL_OPEN_TO_API or user == "facade"
        return used in OPEN_TO_API or used == "facade"
    if user == "api/model":
        return used in ("base", "model", "session")
    if user == "main":
        return used in ("base", "team", "app")
    return used in rooms.get(user, ())


def arrows(root, complete):
    """Violations of rule 1; of a complete tree also permissions that nothing uses."""
    rooms = rooms_of(root)
    files = [f for folder in ("src", "api", "app", "mpi") for f in fortran_files(os.path.join(root, folder))]
    home, uses = {}, []
    for path in files:
        layer = layer_of(path, root)
        for number, statement in statements(text_of(path)):
            m = re.match(r"module\s+(\w+)$", statement)
            if m and m.group(1) != "procedure":
                home[m.group(1)] = layer
            m = re.match(r"use\b\s*(?:,\s*(?:non_)?intrinsic\s*)?(?:::)?\s*(\w+)\s*(?:,.*)?$", statement)
            if m:
                uses.append((path, number, layer, m.group(1)))
    found = []
    made = {(layer, home[module]) for _, _, layer, module in uses if module in home}
    found += [f"src/rooms.txt: {room} does not use {u}" for room, used in rooms.items() for u in used if complete and (room, u) not in made]
    for path, number, layer, module in uses:
        if module in home and not arrow_allowed(layer, home[module], module, rooms):
            found.append(f"{os.path.relpath(path, root)}:{number}: {layer} uses {module} of {home[module]}")
    return found


def file_violations(path, root):
    """Violations of rules 2 and 3 in one file."""
    layer = layer_of(path, root)
    if layer in ("app", "main"):
        return []
    kernel = layer in KERNEL and os.path.splitext(os.path.basename(path))[0] not in SET_UP
    found = []
    procedure, in_type, in_interface, specification = "", False, False, False

    def report(number, text):
        found.append(f"{os.path.relpath(path, root)}:{number}: {text}")

    for number, s in statements(text_of(path)):
        action = action_of(s)
        if re.match(r"(print\b(?!\s*=)|write\s*\(\s*(unit\s*=\s*)?(\*|6\s*[,)]|output_unit|error_unit))", action):
            report(number, "prints")
        if re.match(r"(error\s+)?stop\b(?!\s*=)", action):
            report(number, "stops")
        if not kernel:
            continue
        if re.match(r"(abstract\s+)?interface\b", s):
            in_interface = True
        elif s.startswith("end interface"):
            in_interface = False
        elif re.match(r"type\s*(,|::|\s+(?!is\b)\w)", s) and not s.startswith("type("):
            in_type = True
        elif s.startswith("end type"):
            in_type = False
        elif re.match(r"module\s+\w+$", s) and not s.startswith("module procedure"):
            specification = True
        elif s == "contains" and not in_type:
            specification = False
        m = re.match(r"(?:[\w\s()=*,]*\s)?(?:subroutine|function)\s+(\w+)", s)
        if m and not s.startswith("end") and not in_interface:
            procedure = m.group(1)
        if re.match(r"(write|read|open|close|inquire|rewind|flush)\s*\(", action):
            report(number, "input or output in the kernel")
        if re.search(r"\bsave\b", s):
            report(number, "save in the kernel")
        allocates = re.match(r"(de)?allocate\s*\(", action) or re.search(r"(,\s*allocatable\b|^allocatable\b|\bpointer\b)", s)
        if allocates and not (re.match(r"new_|\w+_parameters$", procedure) or in_type or in_interface):
            report(number, "allocation in the kernel")
        if specification and not in_type and not in_interface and "::" in s:
            if not re.search(r"\bparameter\b", s.split("::")[0]) and not re.match(r"(public|private|use|import|procedure|generic|type)\b(?!\()", s):
                report(number, "module variable in the kernel")
    return found


def lengths(root, listed):
    """Violations of rule 4; a listed file that has become short is one as well."""
    found = []
    for path in fortran_files(os.path.join(root, "src")):
        name = os.path.relpath(path, root)
        lines = len(text_of(path).splitlines())
        if lines > LONGEST and name not in listed:
            found.append(f"{name}: {lines} lines, more than {LONGEST}")
        if lines <= LONGEST and name in listed:
            found.append(f"{name}: listed as long, has {lines} lines only")
    return found


def freedoms(root, excepted):
    """Violations of rule 5; an exception that nothing needs is one as well."""
    found, left = [], set(excepted)
    for path in fortran_files(os.path.join(root, "src")):
        layer = layer_of(path, root)
        name = os.path.relpath(path, root)
        if layer in ("facade", "base", "math", "material", "section", "io/mesh", "io/deck"):  # these files count otherwise
            continue
        count = "18" if layer in ("element", "batch") else "6|9|18"
        for number, statement in statements(text_of(path)):
            if not re.search(rf"(?<![\w.])(?<!\de[+-])({count})(?![\w.])", re.sub(r"character\s*\((len=)?\d+\)|len=\d+", "", statement)):
                continue
            used = {(f, part) for f, part in excepted if f == name and part in statement}
            left -= used
            if not used:
                found.append(f"{name}:{number}: a literal number of freedoms; see finshell_freedoms")
    return found + [f"{name}: '{part}' is excepted, but does not stand there" for name, part in sorted(left)]


def excepted_counts(path):
    """Exceptions to rule 5: lines `path: part of a statement: reason`."""
    found = set()
    for line in text_of(path).splitlines():
        if line.strip() and not line.startswith("#"):
            name, part, reason = re.match(r"(\S+): (.*): (.*)", line).groups()
            assert reason.strip(), f"no reason for {name}"
            found.add((name, part))
    return found


def long_files(path):
    """The files that may be long: lines `path: reason`."""
    listed = set()
    for line in text_of(path).splitlines():
        if line.strip() and not line.startswith("#"):
            name, reason = line.split(":", 1)
            assert reason.strip(), f"no reason for {name}"
            listed.add(name.strip())
    return listed


def pfunit_names(path):
    """The names in a file, but for lines that begin with #."""
    return {name for line in text_of(path).splitlines() if not line.startswith("#") for name in line.split()}


def taken_names(root, names):
    """Violations of rule 6. Components (a%is), keywords (is=), operators (.not.) and `type is` are no names of their own."""
    found = []
    for here, _, files in os.walk(os.path.join(root, "test")):
        for name in sorted(files):
            if not (name.endswith(".pf") or re.match(r"support_\w+\.[fF]90$", name)):
                continue
            path = os.path.join(here, name)
            for number, statement in statements(text_of(path)):
                own = re.sub(r"^@\w+|\.[a-z]+\.|\b(type|class)\s+is\b|%\s*\w+|(?<=[(,])\s*\w+\s*=(?![=>])", " ", statement)
                for word in sorted(names & set(re.findall(r"\b[a-z]\w*", own))):
                    found.append(f"{os.path.relpath(path, root)}:{number}: {word} is a name of pFUnit's")
    return found


def violations(root, listed, names=frozenset(), complete=False, excepted=frozenset()):
    """All violations below a root folder."""
    found = rooms_violations(root) + arrows(root, complete) + lengths(root, listed) + taken_names(root, names) + freedoms(root, excepted)
    for folder in ("src", "api"):
        for path in fortran_files(os.path.join(root, folder)):
            found += file_violations(path, root)
    return found


if __name__ == "__main__":  # draws the rooms anew in CONTRIBUTING.md
    ROOT = pathlib.Path(__file__).resolve().parents[2]
    page = ROOT / "CONTRIBUTING.md"
    before, rest = page.read_text(encoding="utf-8").split("```\nlibfinshell\n", 1)
    page.write_text(before + "```\n" + drawing(ROOT) + "\n```" + rest.split("```", 1)[1], encoding="utf-8")
