"""Pages of the Python package: which modules are public, and what in them has no docstring."""
import ast
import importlib.util
from pathlib import Path


def modules(package):
    """Public modules, by the name in `import`: the package itself, and its files without an underscore."""
    found = [(package.name, package / "__init__.py")]
    return found + [(f"{package.name}.{path.stem}", path) for path in sorted(package.glob("*.py")) if not path.name.startswith("_")]


def parsed(path):
    """The syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def exported(tree):
    """Names in __all__; None where there is no such list."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and any(getattr(target, "id", "") == "__all__" for target in node.targets):
            return ast.literal_eval(node.value)
    return None


def definitions(package):
    """(file, node) of every public function and class; what the package imports from its own modules counts where it is defined."""
    for name, path in modules(package):
        tree = parsed(path)
        names = exported(tree)
        yield from ((path, node) for node in tree.body if is_public(node) and (names is None or node.name in names))
        if name != package.name:
            continue
        for node in tree.body:
            if isinstance(node, ast.ImportFrom) and node.level == 1 and node.module:
                source = package / f"{node.module}.py"
                wanted = {alias.name for alias in node.names if (alias.asname or alias.name) in (names or [])}
                yield from ((source, found) for found in parsed(source).body if is_public(found) and found.name in wanted)


def is_public(node):
    """Whether it is a function or class with a name that everybody may use."""
    return isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)) and not node.name.startswith("_")


def undocumented(package):
    """Sentences: file, line and name of everything public without a docstring."""
    found = [f"{path}:1: the module {name} has no docstring" for name, path in modules(package)
             if not ast.get_docstring(parsed(path))]
    for path, node in definitions(package):
        members = [member for member in node.body if is_public(member)] if isinstance(node, ast.ClassDef) else []
        for name, what in [(node.name, node), *((f"{node.name}.{member.name}", member) for member in members)]:
            if not ast.get_docstring(what):
                found.append(f"{path}:{what.lineno}: {name} has no docstring")
    return sorted(set(found))


def comments(path):
    """(class, attribute) -> the comment behind the line of an attribute, which Sphinx knows with `#:` only."""
    text = path.read_text(encoding="utf-8")
    lines, found = text.splitlines(), {}
    for node in ast.parse(text).body:
        for line in node.body if isinstance(node, ast.ClassDef) else []:
            target = line.target if isinstance(line, ast.AnnAssign) else line.targets[0] if isinstance(line, ast.Assign) else None
            comment = lines[line.end_lineno - 1].encode()[line.end_col_offset:].decode().strip()  # columns count bytes
            if isinstance(target, ast.Name) and comment.startswith("#"):
                found[node.name, target.id] = comment.lstrip("#:").strip()
    return found


def absent(package):
    """Modules that the package imports and that are not installed: optional ones, which the documentation does without."""
    names = set()
    for path in package.glob("*.py"):
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.Import):
                names |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names.add(node.module.partition(".")[0])
    return sorted(name for name in names if importlib.util.find_spec(name) is None)


def page(package):
    """The page, for autodoc."""
    parts = ["# Python package"]
    for name, _ in modules(package):
        options = ["members", "undoc-members"] + (["imported-members"] if name == package.name else [])
        lines = [f".. automodule:: {name}", *(f"   :{option}:" for option in options)]
        parts += [f"## {name}", "\n".join(["```{eval-rst}", *lines, "```"])]
    return "\n\n".join(parts) + "\n"


def write(root: Path, folder: Path):
    """Write the page; its name, and what is undocumented."""
    package = root / "api" / "python" / "finshell"
    (folder / "python.md").write_text(page(package), encoding="utf-8")
    return ["python"], undocumented(package)
