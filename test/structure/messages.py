#!/usr/bin/env python3
"""Error messages of src/ and the tests that expect them: every sentence that a user can be told stands in some test, or in
untested_messages.txt with the reason why not.

A message is what a call of raise, complain, ... has as literals. It counts as tested when a string of a test has a part of it, of
at least LEAST characters, or it is a part of a string of a test. `python3 test/structure/messages.py` lists those that are not.
"""
import os
import re
import sys

LEAST = 9
CALL = re.compile(r"call +(?:\w+%)*(?:raise|complain|complain_about|complain_of_kind|wrong_value|refuse\w*) *\(|\bcomplaint *= *"
                  r"|\berror%message *= *|\bwrite *\(error_unit")
LITERAL = re.compile(r"'((?:[^'\n]|'')*)'|\"((?:[^\"\n]|\"\")*)\"")


def text_of(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def files_in(folder, suffixes):
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(f for f in folders if f not in ("__pycache__", "build"))
        for name in sorted(names):
            if name.endswith(suffixes):
                yield os.path.join(place, name)


def statements(text):
    """(line, statement) with continuation lines joined and comments gone."""
    joined, begun = "", 0
    for number, line in enumerate(text.splitlines(), 1):
        kept = ""
        quote = ""
        for c in line:
            if quote:
                quote = "" if c == quote else quote
            elif c in "'\"":
                quote = c
            elif c == "!":
                break
            kept += c
        kept = kept.rstrip()
        if not joined:
            begun = number
        joined += kept.lstrip().lstrip("&") if joined else kept
        if joined.endswith("&"):
            joined = joined[:-1]
            continue
        if joined.strip():
            yield begun, joined
        joined = ""


def literals(statement):
    return [(a or b).replace("''", "'").replace('""', '"') for a, b in LITERAL.findall(statement)]


def messages(root):
    """(file, line, literals) of every call that makes an error."""
    for path in files_in(os.path.join(root, "src"), (".f90", ".F90")):
        for line, statement in statements(text_of(path)):
            call = CALL.search(statement)
            if not call or "subroutine" in statement:
                continue
            # literals side by side are one sentence
            found = [p.strip(" :;,.'\"()") for p in literals(re.sub(r"(?<!')' *// *'(?!')|\" *// *\"", "", statement[call.start():]))]
            found = [p for p in found if len(re.sub(r"[^A-Za-z]", "", p)) >= 8 and " " in p.strip()]
            if found:
                yield os.path.relpath(path, root), line, found


def expectations(root):
    """All that tests may expect to be told: one text of all their strings, and the strings."""
    strings = set()
    for path in files_in(os.path.join(root, "test"), (".py", ".pf", ".c", ".sh", ".f90")):
        if os.sep + "structure" + os.sep in path:
            continue
        text = re.sub(r"['\"]\s*(?:&\s*\n\s*)?//\s*(?:&\s*\n\s*&?\s*)?['\"]", "", text_of(path))
        text = re.sub(r"\"\s*\n\s*f?\"", "", text)
        for string in re.findall(r"'((?:[^'\n]|'')*)'|\"((?:[^\"\n]|\\\"|\"\")*)\"", text):
            for part in string:
                part = part.replace("''", "'").strip(" :;,.'\"()")
                if len(part) >= LEAST and re.search("[A-Za-z]{3}", part):
                    strings.add(part)
    return strings


def is_expected(found, strings):
    for literal in found:
        for string in strings:
            if string in literal and (" " in string or len(string) > 14):
                return True
            if len(literal) >= LEAST and literal in string:
                return True
    return False


def untested(root):
    strings = expectations(root)
    return [(f, line, found) for f, line, found in messages(root) if not is_expected(found, strings)]


def excepted(path):
    """'file: part of the message' -> reason."""
    result = {}
    for line in text_of(path).splitlines():
        if line.strip() and not line.startswith("#"):
            name, part, reason = line.split(" | ")
            result[name.strip(), part.strip()] = reason.strip()
    return result


def violations(root, allowed):
    used = set()
    found = []
    for name, line, parts in untested(root):
        for key in allowed:
            if key[0] == name and any(key[1] == "*" or key[1] in p for p in parts):
                used.add(key)
                break
        else:
            found.append(f"{name}:{line}: no test expects: {' ... '.join(parts)}")
    found += [f"untested_messages.txt: {name} | {part}: not needed any more" for name, part in allowed if (name, part) not in used]
    return found


if __name__ == "__main__":
    HERE = os.path.dirname(os.path.abspath(__file__))
    ROOT = os.path.dirname(os.path.dirname(HERE))
    LIST = os.path.join(HERE, "untested_messages.txt")
    print("\n".join(violations(ROOT, excepted(LIST) if os.path.exists(LIST) else {})))
    print(len(list(messages(ROOT))), "messages", file=sys.stderr)
