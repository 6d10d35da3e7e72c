"""finshell: a finite-strain triangular shell element, from Python.

    import finshell
    section = finshell.Section("mooney_rivlin", {"c10": 80.0, "c01": 20.0}, thickness=0.1)
    r = section.evaluate(X, u, t)          # arrays (n, 3, 3): reference coordinates, displacements, rotation vectors
    r.energy, r.force, r.tangent           # (n,), (n, 18), (n, 18, 18)
    section.recover_field("principal_stress", X, u, t)   # (n, 3, 2): bottom, middle, top; `finshell.fields()` lists what there is
    plies = finshell.Section([finshell.Layer("neo_hookean", {"mu": 1.0}, 0.1), finshell.Layer("yeoh", {"c1": 1.0}, 0.2)], offset=0.05)
    plies.areal_mass, plies.stiffness, plies.layers      # what a section is
    a = finshell.Assembly(triangles, section, held=held)   # a mesh: forces by nodes, the tangent as scipy.sparse has it
    sheet = finshell.Section("neo_hookean", {"mu": 1.0}, 0.1, membrane=True, wrinkling=True)
    sheet.evaluate(X, u).force             # (n, 9): a membrane has no rotations

The package calls the shared library libfinshell (see `finshell.find_library` for where it is looked for) and needs numpy.
Conventions, units and codes are those of finshell.h; everything raises `Error` when it fails.
"""
from ._assembly import Assembled, Assembly
from ._element import (Evaluation, Pressure, Recovery, Rotation, Section, Sheet, Wrinkles, enclosed_volume,
                       follower_pressure, growth, pressure)
from ._field import Field, fields
from ._law import Finding, Law, Points, check_law, numba_signature
from ._library import ABI, Error, Recoverable, find_library, message, version
from ._driver import MODEL_ABI, find_driver_library
from ._material import Parameter, material_names, material_parameters
from ._model import Builder, Model, Record, group
from ._rotation import (compose, rotation_exp, rotation_log, rotation_matrix, rotation_tangent, update)
from ._section import Layer

__all__ = [
    "ABI", "Assembled", "Assembly", "Error", "Evaluation", "Field", "Finding", "Law", "Layer", "Parameter", "Points", "Pressure",
    "Recoverable", "Recovery", "Rotation", "Section", "Sheet", "Wrinkles", "check_law", "compose", "enclosed_volume", "fields",
    "find_library", "follower_pressure", "growth", "material_names", "material_parameters", "message", "numba_signature", "pressure",
    "rotation_exp", "rotation_log", "rotation_matrix", "rotation_tangent", "update", "version",
    # whole models, by libfinshell_driver
    "MODEL_ABI", "Builder", "Model", "Record", "find_driver_library", "group",
]
__version__ = "0.1.0"
