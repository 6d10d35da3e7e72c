"""What a section is made of: making one, and asking one."""
from __future__ import annotations

import ctypes
import weakref
from dataclasses import dataclass
from typing import Dict, Mapping, Optional, Sequence, Tuple, Union, overload

import numpy as np

from ._law import Law
from ._library import CLayer, CProperties, Doubles, Status, check, library, pairs, pointer


@dataclass
class Layer:
    """One layer of a section; angle in degrees."""

    material: Union[str, Law]
    parameters: Mapping[str, float]
    thickness: float
    angle: float = 0.0
    points: int = 0  # 0: by the law; membranes have none
    density: float = 0.0


def _one_layer(material: str, parameters: Mapping[str, float], thickness: float, options: Mapping[str, float]) -> ctypes.c_void_p:
    """The handle of a section of one layer, which shares the options of the section."""
    names, values = pairs(list(parameters), list(parameters.values()))
    option_names, option_values = pairs(list(options), list(options.values()))
    handle, status = ctypes.c_void_p(), Status()
    library().finshell_section_create(material.encode(), len(parameters), names, values, thickness, len(options), option_names,
                                      option_values, ctypes.byref(handle), ctypes.byref(status))
    check(status)
    return handle


def _layered(layers: Sequence[Layer], options: Mapping[str, float]) -> ctypes.c_void_p:
    """The handle of a section of layers."""
    lib, builder, handle, status = library(), ctypes.c_void_p(), ctypes.c_void_p(), Status()
    lib.finshell_builder_begin(ctypes.byref(builder), ctypes.byref(status))
    check(status)
    for layer in layers:  # a failure comes back from the last call
        lib.finshell_builder_layer(builder, layer.thickness, layer.angle, layer.points, layer.density, None)
        names, values = pairs(list(layer.parameters), list(layer.parameters.values()))
        if isinstance(layer.material, Law):
            lib.finshell_builder_own_law(builder, layer.material.reference, len(layer.parameters), names, values, None)
        else:
            lib.finshell_builder_law(builder, layer.material.encode(), len(layer.parameters), names, values, None)
    for name, value in options.items():
        lib.finshell_builder_option(builder, name.encode(), value, None)
    lib.finshell_builder_build(builder, ctypes.byref(handle), ctypes.byref(status))
    lib.finshell_builder_destroy(builder)
    check(status)
    return handle


class SectionBase:
    """The handle of a section and what it knows of itself."""

    @overload
    def __init__(self, material: Union[str, Law], parameters: Mapping[str, float], thickness: float, **options: float) -> None: ...

    @overload
    def __init__(self, material: Sequence[Layer], **options: float) -> None: ...

    def __init__(self, material: Union[str, Law, Sequence[Layer]], parameters: Optional[Mapping[str, float]] = None,
                 thickness: float = 0.0, **options: float) -> None:
        """One layer, of a law, its parameters and a thickness; or a list of layers (`Layer`), bottom to top.

        Options: formulation (1: S, 2: P), beta0, arc (1 or 0), offset, membrane, wrinkling (True or False), slack; of one layer
        given by its law thickness_points and density, too.
        """
        if isinstance(material, str):
            self._handle = _one_layer(material, parameters or {}, thickness, options)
        elif isinstance(material, Law):
            one = Layer(material, parameters or {}, thickness, points=int(options.pop("thickness_points", 0)),
                        density=options.pop("density", 0.0))
            self._handle = _layered([one], options)
        else:
            self._handle = _layered(material, options)
        layers = [] if isinstance(material, (str, Law)) else material
        self._laws = [material, *(layer.material for layer in layers)]  # what C points into
        weakref.finalize(self, library().finshell_section_destroy, self._handle)
        p, status = CProperties(size=ctypes.sizeof(CProperties)), Status()
        library().finshell_section_properties(self._handle, ctypes.byref(p), ctypes.byref(status))
        check(status)
        self._properties = p
        self._states = int(library().finshell_section_states(self._handle, None))

    @property
    def freedoms(self) -> int:
        """Freedoms of an element: 18, of a membrane 9."""
        return int(self._properties.freedoms)

    @property
    def states(self) -> int:
        """State variables of an element, of laws that have them (doc/user_laws.md)."""
        return self._states

    @property
    def formulation(self) -> int:
        """1: (S), 2: (P)."""
        return int(self._properties.formulation)

    @property
    def isotropic(self) -> bool:
        """No layer depends on the material direction."""
        return bool(self._properties.isotropic)

    @property
    def membrane(self) -> bool:
        """It has no stiffness in bending, and its elements no rotations."""
        return bool(self._properties.membrane)

    @property
    def wrinkling(self) -> bool:
        """It wrinkles instead of bearing compression."""
        return bool(self._properties.wrinkling)

    @property
    def thickness(self) -> float:
        """Of all layers."""
        return float(self._properties.thickness)

    @property
    def offset(self) -> float:
        """Height of the middle above the surface of the nodes."""
        return float(self._properties.offset)

    @property
    def areal_mass(self) -> float:
        """Mass per reference area."""
        return float(self._properties.areal_mass)

    @property
    def first_moment(self) -> float:
        """Integral of density times height above the surface of the nodes, through the thickness."""
        return float(self._properties.first_moment)

    @property
    def rotatory_inertia(self) -> float:
        """Integral of density times the square of the height above the surface of the nodes."""
        return float(self._properties.rotatory_inertia)

    @property
    def layers(self) -> Tuple[Layer, ...]:
        """The layers, bottom to top: with all parameters, also those that were left out, and the points that the law has chosen."""
        lib, status, found = library(), Status(), []
        for i in range(self._properties.layers):
            c = CLayer(size=ctypes.sizeof(CLayer))
            lib.finshell_section_layer(self._handle, i, ctypes.byref(c), ctypes.byref(status))
            check(status)
            parameters: Dict[str, float] = {}
            name, value = ctypes.create_string_buffer(64), ctypes.c_double()
            for j in range(c.parameters):
                lib.finshell_section_parameter(self._handle, i, j, name, len(name), ctypes.byref(value), ctypes.byref(status))
                check(status)
                parameters[name.value.decode()] = value.value
            found.append(Layer(c.law.decode(), parameters, c.thickness, c.angle, c.points, c.density))
        return tuple(found)

    @property
    def stiffness(self) -> Doubles:
        """(6, 6) at rest, about the surface of the nodes, in material axes: (N11, N22, N12, M11, M22, M12) from (E11, E22, 2 E12,
        K11, K22, 2 K12), as (A, B; B, D) in the theory of laminates."""
        matrix, status = np.empty((6, 6)), Status()
        library().finshell_section_stiffness(self._handle, pointer(matrix), ctypes.byref(status))
        check(status)
        return matrix

    def __repr__(self) -> str:
        kind = "wrinkling membrane" if self.wrinkling else "membrane" if self.membrane else "shell"
        layers = ", ".join(f"{layer.material} {layer.thickness:g}" + (f" at {layer.angle:g}" if layer.angle else "") for layer in self.layers)
        return f"<Section of a {kind}: {layers}>"
