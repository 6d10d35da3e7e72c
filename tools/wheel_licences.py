"""Licences of what goes into a wheel beside finshell: which packages own it, their licences, their texts."""
import fnmatch
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

# Package of Debian or Ubuntu (a pattern): what it is; its licence, as SPDX says it. What is under the GPL without an exception for
# what is linked with it stands in the second list.
KNOWN = {
    "libgfortran*": ("run-time library of GNU Fortran", "GPL-3.0-or-later WITH GCC-exception-3.1"),
    "libgomp*": ("OpenMP of GCC", "GPL-3.0-or-later WITH GCC-exception-3.1"),
    "libgcc-s*": ("run-time library of GCC", "GPL-3.0-or-later WITH GCC-exception-3.1"),
    "libquadmath*": ("quadruple precision, for the library of GNU Fortran", "LGPL-2.1-or-later"),
    "libopenblas*": ("BLAS and LAPACK", "BSD-3-Clause"),
    "libblas3": ("BLAS", "BSD-3-Clause"),
    "liblapack3": ("LAPACK", "BSD-3-Clause"),
    "libarpack2*": ("ARPACK-NG: eigenvalues", "BSD-3-Clause"),
    "libmumps-seq-*": ("MUMPS: direct solver", "CECILL-C"),
    "libscotch-*": ("SCOTCH: order of equations, for MUMPS", "CECILL-C"),
    "libbz2-1.0": ("bzip2, which SCOTCH uses", "bzip2-1.0.6"),
    "liblzma5": ("XZ, which SCOTCH uses", "LicenseRef-Public-Domain"),
    "libmetis5": ("METIS: order of equations, for CHOLMOD", "Apache-2.0"),
    "libamd*": ("AMD of SuiteSparse: order of equations", "BSD-3-Clause"),
    "libcamd*": ("CAMD of SuiteSparse: order of equations", "BSD-3-Clause"),
    "libcolamd*": ("COLAMD of SuiteSparse: order of equations", "BSD-3-Clause"),
    "libccolamd*": ("CCOLAMD of SuiteSparse: order of equations", "BSD-3-Clause"),
    "libsuitesparseconfig*": ("SuiteSparse: what its parts share", "BSD-3-Clause"),
    "hdf5": ("HDF5: result files", "BSD-3-Clause"),
}
GPL = {
    "libcholmod*": ("CHOLMOD of SuiteSparse: direct solver", "LGPL-2.1-or-later AND GPL-2.0-or-later"),
    "libumfpack*": ("UMFPACK of SuiteSparse: direct solver", "GPL-2.0-or-later"),
}
INTRODUCTION = """# What is in this wheel beside finshell

finshell itself is under the MIT licence. These libraries were taken in as shared libraries (folder finshell.libs; HDF5 as part of
the program); you may replace each by another version of the same. Their licences and notices are in this folder. Their sources
are those of the Debian or Ubuntu packages with these versions.

| package | version | what it is | licence |
| --- | --- | --- | --- |
"""


@dataclass(frozen=True)
class Part:
    """A package that is in the wheel. text: the file with its licence."""

    package: str
    version: str
    purpose: str
    licence: str
    text: Path
    gpl: bool


def part(package, version, text):
    """What is known of a package; one that is not known ends the program."""
    for table, gpl in ((GPL, True), (KNOWN, False)):
        for pattern, (purpose, licence) in table.items():
            if fnmatch.fnmatchcase(package, pattern):
                if not text.is_file():
                    sys.exit(f"build_wheel: {package} is in the wheel, but its licence is not at {text}")
                return Part(package, version, purpose, licence, text, gpl)
    sys.exit(f"build_wheel: {package} has come into the wheel, and its licence is not known: read /usr/share/doc/{package}/copyright and add "
             "a line to tools/wheel_licences.py, or link without it")


def owners(names):
    """Package and version that own shared libraries, by the names of their files; asks the loader's list and dpkg."""
    listed = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True, check=True).stdout
    paths = {path.name: path for path in (Path(p).resolve() for p in re.findall(r"=> (/\S+)", listed))}
    found = {}
    for name in names:
        path = str(paths.get(name, f"/{name}"))
        # Debian's lists have some files below /lib, which is a link to /usr/lib.
        for word in (path, path.removeprefix("/usr")):
            done = subprocess.run(["dpkg-query", "-S", word], capture_output=True, text=True, check=False)
            if done.returncode == 0:
                package = done.stdout.split(":", 1)[0]
                break
        else:
            sys.exit(f"build_wheel: no package of this system owns {name}, which has come into the wheel: its licence is not known")
        version = subprocess.run(["dpkg-query", "-W", "-f", "${Version}\n", package], capture_output=True, text=True, check=True).stdout
        found[package] = version.splitlines()[0]
    return found


def parts(libraries, hdf5):
    """The packages in a wheel. libraries: the folder of those that auditwheel has taken in; hdf5: folder of HDF5 (static)."""
    names = [re.sub(r"-[0-9a-f]{8}(?=\.)", "", path.name, count=1) for path in sorted(libraries.iterdir())] # as before auditwheel
    found = {package: part(package, version, Path("/usr/share/doc", package, "copyright")) for package, version in owners(names).items()}
    header = (hdf5 / "include" / "H5public.h").read_text(encoding="utf-8", errors="replace")
    version = ".".join(re.search(rf"#define H5_VERS_{name}\s+(\d+)", header).group(1) for name in ("MAJOR", "MINOR", "RELEASE"))
    found["hdf5"] = part("hdf5", version, hdf5 / "COPYING")
    return [found[name] for name in sorted(found)]


def expression(all_parts):
    """The licence of the wheel as a whole, as SPDX says it."""
    licences = {word for p in all_parts for word in p.licence.split(" AND ")}
    return " AND ".join(["MIT", *sorted(licences)])


def add(info, metadata, all_parts):
    """Put texts and table into the folder .dist-info; returns the METADATA that name them."""
    folder = info / "licenses" / "third_party"
    folder.mkdir(parents=True, exist_ok=True)
    rows = [f"| {p.package} | {p.version} | {p.purpose} | {p.licence} |" for p in all_parts]
    (folder / "README.md").write_text(INTRODUCTION + "\n".join(rows) + "\n", encoding="utf-8")
    names = ["README.md"]
    for p in all_parts:
        names.append(f"{p.package}.txt")
        shutil.copyfile(p.text, folder / names[-1])
    lines = "".join(f"License-File: third_party/{name}\n" for name in names)
    metadata = re.sub(r"^License-Expression: .*$", f"License-Expression: {expression(all_parts)}", metadata, count=1, flags=re.M)
    return re.sub(r"^(License-File: .*\n)", rf"\1{lines}", metadata, count=1, flags=re.M)
