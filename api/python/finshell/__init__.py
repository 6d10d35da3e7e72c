"""finshell: a finite-strain triangular shell element, from Python.

    import finshell
    section = finshell.Section("mooney_rivlin", {"c10": 80.0, "c01": 20.0}, thickness=0.1)
    r = section.evaluate(X, u, t)          # arrays (n, 3, 3): reference coordinates, displacements, rotation vectors
    r.energy, r.force, r.tangent           # (n,), (n, 18), (n, 18, 18)
    section.recover_field("principal_stress", X, u, t)   # (n, 3, 2): bottom, middle, top; `finshell.fields()` lists what there is
    sheet = finshell.Section("neo_hookean", {"mu": 1.0}, 0.1, membrane=True, wrinkling=True)
    sheet.evaluate(X, u).force             # (n, 9): a membrane has no rotations

The package calls the shared library libfinshell (see `finshell.find_library` for where it is looked for) and needs numpy.
Conventions, units and codes are those of finshell.h; everything raises `Error` when it fails.
"""
from ._element import (Evaluation, Layer, Pressure, Recovery, Rotation, Section, Sheet, Wrinkles, enclosed_volume,
                       follower_pressure, growth, pressure)
from ._field import Field, fields
from ._library import ABI, Error, Recoverable, find_library, message, version
from ._material import Parameter, material_names, material_parameters
from ._rotation import (compose, rotation_exp, rotation_log, rotation_matrix, rotation_tangent, update)

__all__ = [
    "ABI", "Error", "Evaluation", "Field", "Layer", "Parameter", "Pressure", "Recoverable", "Recovery", "Rotation", "Section",
    "Sheet", "Wrinkles", "compose", "enclosed_volume", "fields", "find_library", "follower_pressure", "growth", "material_names",
    "material_parameters", "message", "pressure", "rotation_exp", "rotation_log", "rotation_matrix", "rotation_tangent", "update",
    "version",
]
__version__ = "0.1.0"
