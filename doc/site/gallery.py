#!/usr/bin/env python3
"""Runs chosen examples and draws them by finshell-plot.

    gallery.py FOLDER [EXAMPLE...]

FOLDER gets the pictures and gallery.json, from which assemble.py makes a page. The program is FINSHELL_BIN.
"""
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import List, NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PLOT = [sys.executable, "-m", "finshell.plot"]


class Picture(NamedTuple):
    """An example and how it is drawn."""

    example: str
    title: str
    text: str
    words: List[str]
    input: str = "input.nml"
    ending: str = ".png"


PICTURES = [
    Picture("rubber_disk", "Rubber disk, inflated until it is thirty times thinner", "A quarter was modelled.",
            ["--mirror", "xy", "--size", "700x525", "--rate", "2"], "rubber_disk.nml", ".gif"),
    Picture("airbag", "Square airbag", "Two flat sheets, sewn together and inflated; a tension field stands for wrinkles.", ["--mirror", "xyz"]),
    Picture("sze33", "Slit annular plate under a line force", "One lip is held, the other lifted.", ["--view=-60,30"]),
    Picture("sze34", "Hemisphere with a hole, pulled and pushed", "A quarter was modelled.", ["--mirror", "xy", "--view=-60,30"]),
    Picture("sze35", "Pull-out of an open cylinder", "An octant was modelled.", ["--mirror", "xyz", "--view=-50,20"]),
    Picture("sze36", "Pinched cylinder with diaphragms", "An octant was modelled.", ["--mirror", "xyz", "--view=-30,25"]),
    Picture("sze37", "Half a cylinder, pressed at its end", "A half of it was modelled.", ["--mirror", "x", "--view=40,25"]),
    Picture("sze32", "Strip rolled up by a moment", "The displacement is that from the flat strip.", ["--view=-70,20"]),
    Picture("bending_actuator", "Soft actuator that bends", "A quarter was modelled.", ["--mirror", "xy", "--view=20,15"]),
    Picture("valve_leaflet", "Leaflet of a heart valve, snapped shut", "One of three.", ["--view=-60,35"]),
    Picture("stiffened_panel", "Stiffened panel under pressure", "A half was modelled; displacements are magnified.",
            ["--mirror", "x", "--view=-50,-25", "--deformed", "auto"]),
    Picture("cylinder_line_load", "Rubber cylinder under a line load", "A quarter was modelled.", ["--mirror", "xy", "--view=-50,20"]),
    Picture("sheet_with_hole", "Sheet with a hole", "A quarter was modelled.", ["--mirror", "xy", "--view", "z", "--component", "x"]),
    Picture("scordelis_lo", "Roof of Scordelis and Lo", "A quarter; displacements are magnified.", ["--deformed", "auto", "--view=-60,30"]),
    Picture("spherical_cap_dynamic", "Spherical cap under a sudden pressure", "Motion in time.",
            ["--mirror", "xy", "--deformed", "auto", "--size", "600x450"], ending=".gif"),
]


def draw(picture: Picture, folder: Path) -> dict:
    """Run the example and draw it; its entry on the page."""
    file = picture.example + picture.ending
    with tempfile.TemporaryDirectory() as work:
        source = ROOT / "examples" / picture.example / picture.input
        run = subprocess.run([os.environ["FINSHELL_BIN"], "run", "--quiet", str(source), "-o", work], capture_output=True, text=True, check=False)
        if run.returncode not in (0, 1):
            sys.exit(f"gallery.py: {source} ended with {run.returncode}:\n{run.stdout}{run.stderr}")
        name = next(Path(work).glob("*.vtkhdf")).stem
        words = ["-o", str(folder / file), *picture.words]
        subprocess.run([*PLOT, str(Path(work) / name), *words], check=True, stdout=subprocess.DEVNULL)
    command = f"finshell run {picture.input}\nfinshell-plot {name} -o {file} {' '.join(picture.words)}"
    return {"example": picture.example, "file": file, "title": picture.title, "text": picture.text, "command": command}


def main():
    folder, chosen = Path(sys.argv[1]).resolve(), sys.argv[2:]
    folder.mkdir(parents=True, exist_ok=True)
    entries = []
    for picture in PICTURES:
        if chosen and picture.example not in chosen:
            continue
        begun = time.time()
        entries.append(draw(picture, folder))
        print(f"{picture.example:<24}{time.time() - begun:6.1f} s")
    (folder / "gallery.json").write_text(json.dumps(entries, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
