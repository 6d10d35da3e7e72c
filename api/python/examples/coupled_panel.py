"""A panel in a channel, coupled with a fluid that is heavier than the panel: two programs that iterate in every time step.

The panel, clamped at its edges, closes a channel. Before each point of it stands a column of incompressible fluid of height 0.1, so
that the fluid resists by its density times that height times the acceleration of the panel: an added mass, here ten times that of
the panel. The fluid knows nothing of the panel but its accelerations, and the panel nothing of the fluid but forces at its nodes.
With such a fluid an exchange once in a time step, or an iteration without relaxation, blows up; relaxed after Aitken (Kuettler and
Wall 2008) it converges. The whole is also solved at once: a panel with the mass of both. The two agree to the tolerance of the
iteration.

    python coupled_panel.py [divisions] [steps]
"""
from __future__ import annotations

import sys
from typing import Callable, List, Optional, Tuple

import finshell
import numpy as np

SIDE, THICKNESS, HEIGHT, FLUID, SOLID = 1.0, 0.01, 0.1, 1000.0, 1000.0  # mass of an area: 100 of the fluid, 10 of the panel
DURATION = 0.5


def panel(density: float, divisions: int, steps: int, **options: object) -> finshell.Model:
    """A quarter of the panel under a pressure that rises and falls."""
    return (finshell.Builder("Panel in a channel", name="panel")
            .mesh(generator="rectangle", lengths=[SIDE / 2, SIDE / 2], divisions=[divisions, divisions])
            .material("rubber", law="neo_hookean", mu=1.0e5, density=density)
            .section(material="rubber", thickness=THICKNESS)
            .support("edge_x1", type="clamped").support("edge_y1", type="clamped")
            .support("edge_x0", type="symmetry_x").support("edge_y0", type="symmetry_y")
            .group("amplitude", name="pulse", over="time", smooth=True, points=[0.0, 0.0, 0.1, 1.0, 0.3, 0.0])
            .load(type="pressure", pressure=200.0, amplitude="pulse")
            .step(control="dynamic", duration=DURATION, automatic=False, first_increment=DURATION / steps, rotatory=False,
                  tolerance="tight")
            .monitor("w", quantity="displacement", component="z", node_set="corner_x0_y0")
            .model(**options))


class Fluid:
    """Columns of fluid before the panel: forces at its nodes from their accelerations."""

    def __init__(self, coordinates: np.ndarray, triangles: np.ndarray) -> None:
        a, b, c = (coordinates[triangles[:, i]] for i in range(3))
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        self.mass = FLUID * HEIGHT * np.bincount(triangles.ravel(), np.repeat(area / 3, 3), len(coordinates))

    def force(self, acceleration: np.ndarray) -> np.ndarray:
        return -self.mass[:, None] * acceleration


def couple(model: finshell.Model, fluid: Fluid, steps: int, tolerance: float = 1e-9, most: int = 60) -> List[int]:
    """Step after step: forces and accelerations that fit each other. The numbers of iterations."""
    force, before, counts = np.zeros((model.nodes, 3)), np.zeros((model.nodes, 3)), []
    first = 1 / (1 + FLUID * HEIGHT / (SOLID * THICKNESS))
    for _ in range(steps):
        model.checkpoint()
        guess = 2 * force - before
        before, relaxation, last = force, first, None
        for iteration in range(1, most + 1):
            model.set_force("all", guess)
            model.advance(DURATION / steps)
            residual = fluid.force(model.field("acceleration")) - guess
            if np.linalg.norm(residual) <= tolerance * max(np.linalg.norm(guess), 1e-12):
                break
            relaxation = aitken(relaxation, residual, last)
            guess, last = guess + relaxation * residual, residual
            model.restore()
        else:
            raise RuntimeError(f"no convergence at time {model.record.time}")
        force = guess
        counts.append(iteration)
    return counts


def aitken(relaxation: float, residual: np.ndarray, last: Optional[np.ndarray]) -> float:
    """The relaxation that would have led to no residual, along the last change of it."""
    if last is None:
        return relaxation
    change = residual - last
    return -relaxation * float(np.sum(last * change) / np.sum(change * change))


def compare(divisions: int, steps: int, progress: Optional[Callable[[finshell.Model], object]] = None) -> Tuple[np.ndarray, np.ndarray, List[int]]:
    """Deflections of the coupled panel and of the one with the mass of both; iterations."""
    coupled = panel(SOLID, divisions, steps, progress=progress)
    counts = couple(coupled, Fluid(coupled.coordinates, coupled.triangles), steps)
    whole = panel(SOLID + FLUID * HEIGHT / THICKNESS, divisions, steps)
    whole.run()
    return coupled.history["w"], whole.history["w"], counts


def main() -> None:
    numbers = [int(a) for a in sys.argv[1:]]
    coupled, whole, counts = compare(*(numbers + [6, 50][len(numbers):]))
    print(f"largest deflection {abs(whole).max():.6f}, difference of the coupled one {abs(coupled - whole).max():.2e}")
    print(f"iterations in a step: {np.mean(counts):.1f}, at most {max(counts)}")


if __name__ == "__main__":
    main()
