#!/usr/bin/env python3
"""Links of the documentation: files and headings that are named exist; what the troubleshooting page quotes is said by the program."""
import os
import re
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("FINSHELL_SOURCE_DIR") or Path(__file__).resolve().parents[2])
LINK = re.compile(r"!?\[(?:[^\]\[]|\[[^\]]*\])*\]\(([^)\s]+)\)")


def words(text):
    """A page without blocks of code and code in lines."""
    return re.sub(r"`[^`\n]*`", "", re.sub(r"^```.*?^```", "", text, flags=re.S | re.M))


def anchors(text):
    """The anchors of a page's headings, as GitHub and MyST make them."""
    found = set()
    for heading in re.findall(r"^#+ +(.*?) *$", re.sub(r"^```.*?^```", "", text, flags=re.S | re.M), re.M):
        heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").lower()
        slug = re.sub(r"[^\w\- ]", "", heading).replace(" ", "-")
        number, name = 0, slug
        while name in found:
            number += 1
            name = f"{slug}-{number}"
        found.add(name)
    return found


def broken(path, text):
    """Links of a page that lead nowhere."""
    found = []
    for link in LINK.findall(words(text)):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        place = (path.parent / name).resolve() if name else path
        if not place.exists():
            found.append(f"{path.relative_to(ROOT)}: {link} does not exist")
        elif anchor and (place.suffix != ".md" or anchor not in anchors(text if place == path else place.read_text(encoding="utf-8"))):
            found.append(f"{path.relative_to(ROOT)}: {link} has no such heading")
    return found


def pages():
    return [p for p in [*ROOT.glob("*.md"), *(ROOT / "doc").glob("*.md"), *(ROOT / "examples").glob("*/*.md"), *(ROOT / "api").glob("*/*.md"),
                        *(ROOT / "bench").glob("**/*.md"), *(ROOT / "test").glob("**/*.md")]]


def said():
    """What the program can say: its strings, with what is put between them left out."""
    text = "\n".join(p.read_text(encoding="utf-8") for p in sorted((ROOT / "src").rglob("*.[fF]90")))
    text = re.sub(r"&\s*\n\s*&?", "", text)
    text = re.sub(r"(['\"])\s*//\s*(['\"])", "", text)
    return text.replace("''", "'")


def unsaid(page, program):
    """Quotes of a page that the program does not say."""
    return [quote for quote in re.findall(r"^> (.*?)$", page, re.M) if quote not in program]


class Links(unittest.TestCase):
    def test_all_lead_somewhere(self):
        self.assertGreater(len(pages()), 60)
        self.assertGreater(sum(len(LINK.findall(words(p.read_text(encoding="utf-8")))) for p in pages()), 200)
        self.assertEqual([line for path in pages() for line in broken(path, path.read_text(encoding="utf-8"))], [])

    def test_a_wrong_one_is_noticed(self):
        path = ROOT / "doc" / "study.md"
        self.assertEqual(broken(path, "[a](nothing.md) [b](namelist.md#mesh) [c](namelist.md#meshes) `[d](x)`\n```\n[e](y)\n```\n"),
                         ["doc/study.md: nothing.md does not exist", "doc/study.md: namelist.md#meshes has no such heading"])
        self.assertEqual(broken(path, "## Of *two* `words`\n[a](#of-two-words)\n"), [])
        self.assertEqual(anchors("# A, b\n# A b\n"), {"a-b", "a-b-1"})

    def test_quotes_are_said(self):
        page, program = (ROOT / "doc" / "troubleshooting.md").read_text(encoding="utf-8"), said()
        self.assertGreater(len(re.findall(r"^> ", page, re.M)), 20)
        self.assertEqual(unsaid(page, program), [])
        self.assertEqual(unsaid("> the structure has no feet\n", program), ["the structure has no feet"])


if __name__ == "__main__":
    unittest.main()
