"""A finshell model as a participant of preCICE (https://precice.org, version 3): forces in, displacements out.

    model = finshell.Model("panel.nml")
    finshell.precice.couple(model, "Solid", "precice-config.xml", mesh="Solid-Mesh", node_set="wet")

preCICE is asked for here and nowhere else (`pip install pyprecice`, and the library that it needs); finshell works without it.
preCICE's configuration says who iterates with whom; the model keeps and takes up its checkpoints as it is told.
"""
from __future__ import annotations

import importlib
from typing import Any, Callable, Optional

import numpy as np

from ._model import Model, Record


def couple(model: Model, participant: str, configuration: str, mesh: str, node_set: str, read: str = "Force",
           write: str = "Displacement", field: str = "displacement", static: bool = False, slot: int = 7,
           accepted: Optional[Callable[[Model], Any]] = None, module: Any = None) -> Record:
    """Take part in a coupling until it ends.

    `mesh`, `read` and `write` are names of the configuration; the vertices of the mesh are the nodes of `node_set`, in the
    reference shape. What is read are forces (3 numbers a vertex), what is written is the nodal field `field`. In a time window the
    forces grow along a straight line to what is read for its end; the model arrives there in as many increments as accuracy asks for
    (one, with automatic = .false. in &step). With `static`, the model has no inertia: it settles under the forces of each window.
    `accepted` is called with the model after each window that is not taken back, to write results for instance. `slot`: of the
    checkpoints. `module`: what stands for the module precice, in tests.
    """
    if module is None:
        try:
            module = importlib.import_module("precice")
        except ImportError as e:
            raise ImportError("finshell.precice needs the Python bindings of preCICE: pip install pyprecice, with libprecice 3 "
                              "(https://precice.org)") from e
    nodes = model.node_set(node_set)
    coupling = module.Participant(participant, configuration, 0, 1)
    if coupling.get_mesh_dimensions(mesh) != 3:
        raise ValueError(f"the mesh {mesh!r} has {coupling.get_mesh_dimensions(mesh)} dimensions; a shell has 3")
    vertices = coupling.set_mesh_vertices(mesh, model.coordinates[nodes])

    def tell() -> None:
        coupling.write_data(mesh, write, vertices, model.field(field)[nodes])

    if coupling.requires_initial_data():
        tell()
    coupling.initialize()
    try:
        while coupling.is_coupling_ongoing():
            if coupling.requires_writing_checkpoint():
                model.checkpoint(slot)
            window = coupling.get_max_time_step_size()
            model.set_force(node_set, np.asarray(coupling.read_data(mesh, read, vertices, window)))
            _through(model, window, static)
            tell()
            coupling.advance(window)
            if coupling.requires_reading_checkpoint():
                model.restore(slot)
            elif accepted is not None:
                accepted(model)
    finally:
        coupling.finalize()
    return model.record


def _through(model: Model, window: float, static: bool) -> None:
    """To the end of a time window."""
    if static:
        model.settle()
        return
    end = model.record.time + window
    model.advance_to(end)
    if model.record.time < end - 1e-9 * window:
        raise ValueError(f"the steps of the model end at time {model.record.time:g}, the coupling goes on to {end:g}: give &step a "
                         "longer duration")
