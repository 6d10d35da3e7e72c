#!/usr/bin/env python3
"""Turn one pFUnit file (.pf) into a Fortran program that uses finshell's own module funit.

    translate_pf.py INPUT.pf OUTPUT.F90

Line markers tell the compiler where each line comes from, so its messages point into the .pf file.
Understood: @test, @test(ifdef=NAME), @test(ifndef=NAME), @before, @after, @suite (ignored) and the assertions below, each
on one line. Anything else that begins with @ is an error, as is a test that pFUnit would not find.
"""
import os
import re
import sys

ASSERTIONS = {  # lower-case name: (name, least number of arguments)
    name.lower(): (name, arguments)
    for name, arguments in (
        ("assertEqual", 2), ("assertRelativelyEqual", 3), ("assertTrue", 1), ("assertFalse", 1),
        ("assertLessThan", 2), ("assertLessThanOrEqual", 2), ("assertGreaterThan", 2), ("assertGreaterThanOrEqual", 2),
        ("assertIsNaN", 1), ("assertIsFinite", 1), ("assertFail", 0),
    )
}


class PfError(Exception):
    """A .pf file that cannot be translated."""


def split_arguments(text):
    """Split an argument list at its outer commas; None when brackets or quotes do not match."""
    arguments, depth, quote, start = [], 0, None, 0
    for i, c in enumerate(text):
        if quote:
            if c == quote:
                quote = None
        elif c in "'\"":
            quote = c
        elif c in "([":
            depth += 1
        elif c in ")]":
            depth -= 1
            if depth < 0:
                return None
        elif c == "," and depth == 0:
            arguments.append(text[start:i].strip())
            start = i + 1
    if depth or quote:
        return None
    last = text[start:].strip()
    if last or arguments:
        arguments.append(last)
    return arguments


def fold(text, width=128):
    """A statement on lines of at most `width` columns and an &, broken at blanks outside of quotes."""
    lines = []
    while len(text) > width:
        at, quote = 0, None
        for i, c in enumerate(text[:width]):
            if quote:
                quote = None if c == quote else quote
            elif c in "'\"":
                quote = c
            elif c == " " and text[:i].strip():
                at = i
        if not at:
            break
        lines.append(text[:at] + " &")
        text = "   " + text[at:].lstrip()
    return lines + [text]


def translate(lines, file_name):
    """The Fortran text for the lines of a .pf file."""
    base = os.path.basename(file_name)
    path = os.path.abspath(file_name).replace("\\", "/")
    out, tests = [], []
    module = before = after = None
    pending = None  # annotation that waits for its subroutine: (kind, condition, line)

    def fail(number, text):
        raise PfError(f"{file_name}:{number}: {text}")

    for number, raw in enumerate(lines, 1):
        line = raw.rstrip("\n")
        code = line.strip()
        annotation = re.match(r"@(\w+)\s*(?:\((.*)\))?\s*$", code)
        if code.startswith("@") and not annotation:
            fail(number, f"not an annotation on one line: {code}")
        if annotation:
            name, arguments = annotation.group(1), annotation.group(2)
            kind = name.lower()
            if kind in ("test", "before", "after"):
                if pending:
                    fail(number, f"@{pending[0]} of line {pending[2]} has no subroutine")
                condition = None
                if arguments:
                    m = re.match(r"(ifdef|ifndef)\s*=\s*(\w+)\s*$", arguments.strip(), re.I)
                    if not m or kind != "test":
                        fail(number, f"option not understood: @{name}({arguments})")
                    condition = (m.group(1).lower(), m.group(2))
                pending = (kind, condition, number)
                out.append("")
            elif kind == "suite":
                out.append("")
            elif kind in ASSERTIONS:
                proper, least = ASSERTIONS[kind]
                parts = split_arguments(arguments or "")
                if parts is None or len(parts) < least or (parts and not all(parts)):
                    fail(number, f"arguments of @{name} not understood; each assertion stands on one line")
                comma = "," if parts else ""
                out += [*fold(f"call {proper}({', '.join(parts)}{comma}&"),
                        f"   location=SourceLocation('{base}', {number})); if (anyExceptions()) return",
                        f'# {number + 1} "{path}"']
            else:
                fail(number, f"annotation @{name} is not one of those that finshell's tests use")
            continue
        m = re.match(r"module\s+(\w+)\s*(?:!.*)?$", code, re.I)
        if m and m.group(1).lower() != "procedure" and module is None:
            module = m.group(1)
            if module.lower() != os.path.splitext(base)[0].lower():
                fail(number, f"module {module} must be named as its file")
        m = re.match(r"subroutine\s+(\w+)\s*(?:\(([^)]*)\))?\s*(?:!.*)?$", code, re.I)
        if pending and m:
            kind, condition, _ = pending
            pending = None
            if m.group(2) and m.group(2).strip():
                fail(number, f"{m.group(1)} must not take arguments")
            if kind == "test":
                if m.group(1).lower() in (t[0].lower() for t in tests):
                    fail(number, f"two tests are named {m.group(1)}")
                tests.append((m.group(1), condition))
            elif kind == "before":
                before = m.group(1)
            else:
                after = m.group(1)
        elif pending and code and not code.startswith("!"):
            fail(number, f"@{pending[0]} of line {pending[2]} must stand before a subroutine without arguments")
        elif re.match(r"(call\s+)?assert[a-z]+\s*\(", code, re.I):
            fail(number, "an assertion without its @ would not return on failure")
        out.append(line)
    if pending:
        fail(pending[2], f"@{pending[0]} has no subroutine")
    if module is None:
        fail(1, "no module")
    if not tests:
        fail(1, "no @test")

    program = [f"program run_{module}"[:63], f"   use {module}", "   use funit, only: funit_begin, funit_run, funit_finish",
               "   implicit none", f"   call funit_begin('{module}')"]
    fixtures = (f", before={before}" if before else "") + (f", after={after}" if after else "")
    for name, condition in tests:
        call = f"   call funit_run('{name}', {name}{fixtures})"
        program += [f"#{condition[0]} {condition[1]}", call, "#endif"] if condition else [call]
    program += ["   call funit_finish()", "end program"]
    return "\n".join([f'# 1 "{path}"', *out, f'# 1 "{os.path.basename(file_name)}.program"', *program]) + "\n"


def main(arguments):
    """Command line."""
    if len(arguments) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        with open(arguments[0], encoding="utf-8") as file:
            text = translate(file.readlines(), arguments[0])
    except (PfError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    with open(arguments[1], "w", encoding="utf-8") as file:
        file.write(text)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
