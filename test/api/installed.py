"""The library, installed into a folder of its own; the programs of doc/c_api.md."""
import os
import re
import subprocess
import tempfile

SOURCE = os.environ.get("FINSHELL_SOURCE_DIR") or os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BINARY = os.environ.get("FINSHELL_BINARY_DIR", "")
FC = os.environ.get("FINSHELL_FC", "gfortran")
CC = os.environ.get("FINSHELL_CC", "gcc")
CXX = os.environ.get("CXX", "g++")


def run(*command, **options):
    """Output of a command; its whole output in the error when it fails."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, **options)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))} returned {done.returncode}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def install():
    """Install into a temporary folder; (folder object, folder of the libraries)."""
    folder = tempfile.TemporaryDirectory()
    run("cmake", "--install", BINARY, "--prefix", folder.name)
    for here, _, names in os.walk(folder.name):
        if "libfinshell.so" in names:
            return folder, here
    raise AssertionError("no shared library was installed")


def environment(libraries):
    """Environment in which the installed library is found."""
    return dict(os.environ, PKG_CONFIG_PATH=os.path.join(libraries, "pkgconfig"), LD_LIBRARY_PATH=libraries, OMP_NUM_THREADS="1")


def programs():
    """Language: program, of the guide."""
    with open(os.path.join(SOURCE, "doc", "c_api.md"), encoding="utf-8") as f:
        text = f.read().split("### Building")[0]
    return dict(re.findall(r"^```(c|fortran|python)\n(.*?)^```$", text, re.M | re.S))


def fragment(title):
    """The lines of C in a section of the guide."""
    with open(os.path.join(SOURCE, "doc", "c_api.md"), encoding="utf-8") as f:
        return re.search(rf"## {title}.*?\n.*?```c\n(.*?)^```$", f.read(), re.M | re.S).group(1)


def fragments(title, language="c"):
    """All lines of a language in a section of the guide."""
    with open(os.path.join(SOURCE, "doc", "c_api.md"), encoding="utf-8") as f:
        section = re.search(rf"^## {title}.*?\n(.*?)^## ", f.read() + "## ", re.M | re.S).group(1)
    return "".join(re.findall(rf"^```{language}\n(.*?)^```$", section, re.M | re.S))
