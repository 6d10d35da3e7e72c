"""Words of comments as Markdown."""
import re


def escaped(text):
    """What looks like markup is none."""
    return re.sub(r"(?<!`)([<>*_\[\]$|])", r"\\\1", text)
