#!/usr/bin/env python3
"""Every function of the C headers is called by a program that guards it: flags and traps, 64 threads, fork, valgrind, sanitizers
(test/*/test_*guards.c, with a table of entries), or stands with a reason in unguarded_functions.txt."""
import os
import re
import sys
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("FINSHELL_SOURCE_DIR") or Path(__file__).resolve().parents[2])
sys.path.insert(0, str(ROOT / "doc" / "site"))
import c_headers  # noqa: E402


def entries(text):
    """Names in the table of a program, and those among them whose entry does not call the function."""
    text = re.sub(r"/\*.*?\*/", " ", text, flags=re.S)
    names = re.findall(r"\bENTRY\((\w+)\)", re.sub(r"^#.*", "", text, flags=re.M))
    bodies = dict(re.findall(r"^static void (\w+)\(const world \*w, results \*r\)\n\{\n(.*?)^\}", text, re.S | re.M))
    return names, [name for name in names if not re.search(rf"\bfinshell_{name}\(", bodies.get(name, ""))]


def excepted(text):
    """The functions of the list -> their reasons."""
    lines = [line.split(maxsplit=1) for line in text.splitlines() if line.strip() and not line.startswith("#")]
    return {words[0]: words[1] if len(words) > 1 else "" for words in lines}


def faults(headers, programs, exceptions):
    """Sentences: what is not guarded, what is in the list for nothing."""
    found, guarded = [], set()
    for text in programs:
        names, idle = entries(text)
        guarded |= {f"finshell_{name}" for name in names}
        found += [f"the entry {name} does not call finshell_{name}" for name in idle]
        found += [f"the table has {name} twice" for name in sorted({name for name in names if names.count(name) > 1})]
    functions = {name for text in headers for name in c_headers.functions(text)}
    found += [f"{name} is in no table of test/*/test_*guards.c" for name in sorted(functions - guarded - set(exceptions))]
    found += [f"{name} is in a table, and no function of a header" for name in sorted(guarded - functions)]
    idle = set(exceptions) & guarded | set(exceptions) - functions
    found += [f"{name} need not be in unguarded_functions.txt" for name in sorted(idle)]
    return found + [f"{name} has no reason in unguarded_functions.txt" for name, reason in exceptions.items() if not reason]


class Guards(unittest.TestCase):
    """The project, and planted faults."""

    def test_every_function_is_guarded(self):
        headers = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "api").glob("*.h"))]
        programs = sorted((ROOT / "test").glob("*/test_*guards.c"))
        listed = (ROOT / "test" / "structure" / "unguarded_functions.txt").read_text(encoding="utf-8")
        found = faults(headers, [path.read_text(encoding="utf-8") for path in programs], excepted(listed))
        self.assertEqual(found, [], "\n" + "\n".join(found))
        for path in programs:  # of models one call works at a time: there is nothing that threads could race for
            watched, times = {"api": ("test_sanitizers.py", 2), "model": ("test_model_installed.py", 1)}[path.parent.name]
            text = path.with_name(watched).read_text(encoding="utf-8")
            self.assertGreaterEqual(text.count(f'("{path.stem}", ('), times, f"{path.stem}: memory, and threads")

    def test_planted(self):
        header = "/* A. Since 0.1. */\nint32_t finshell_a(void);\n\n/* B. Since 0.1. */\nvoid finshell_b(int32_t);\n"
        body = "static void {0}(const world *w, results *r)\n{{\n   finshell_{0}();\n}}\n\n"
        program = "#define ENTRY(name) name\n" + body.format("a") + body.format("b") + "ENTRY(a), ENTRY(b),\n"
        self.assertEqual(faults([header], [program], {}), [])
        for old, new, exceptions, sentence in (
                ("ENTRY(b),", "", {}, "finshell_b is in no table of test/*/test_*guards.c"),
                ("ENTRY(b),", "/* ENTRY(b) */", {}, "finshell_b is in no table of test/*/test_*guards.c"),
                ("ENTRY(b),", "ENTRY(b), ENTRY(b),", {}, "the table has b twice"),
                ("finshell_b()", "finshell_a()", {}, "the entry b does not call finshell_b"),
                ("", "", {"finshell_b": "why not"}, "finshell_b need not be in unguarded_functions.txt"),
                ("", "", {"finshell_c": "why not"}, "finshell_c need not be in unguarded_functions.txt"),
                ("ENTRY(b),", "", {"finshell_b": ""}, "finshell_b has no reason in unguarded_functions.txt")):
            self.assertEqual(faults([header], [program.replace(old, new) if old else program], exceptions), [sentence])
        self.assertEqual(faults([header.replace("void finshell_b(int32_t);", "")], [program], {}),
                         ["finshell_b is in a table, and no function of a header"])
        self.assertEqual(excepted("# no\n\nf why not\ng\n"), {"f": "why not", "g": ""})


if __name__ == "__main__":
    unittest.main()
