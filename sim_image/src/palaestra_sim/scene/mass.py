"""The masses of Solids, for a physics with masses.

A Solid without a Physics node has no mass. Source: Webots reference, Physics.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.scene import meshes
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector, triple
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.scene.validation import NodeReader

DENSITY: Final = 1000.0  # kg/m3, the default of Physics.density
_FILLED: Final = {
    "box": 1.0,
    "cylinder": math.pi / 4.0,
    "ball": math.pi / 6.0,
}  # volume of a shape, as a share of the box around the shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MassProperties:
    """The mass of one Solid.

    Attributes:
        place: the frame of the Solid.
        shapes: the shapes of the Solid's boundingObject.
        mass_kg: the mass; 0 if the Solid has no Physics node, or if it has neither a mass nor a shape.
        center: the center of mass in the Solid's frame, in meters; None for the center of the shapes.
        inertia: xx, yy, zz, xy, xz, yz about the center of mass in kg m2; None for the shapes' inertia.
    """

    place: Frame
    shapes: tuple[Shape, ...] = ()
    mass_kg: float = 0.0
    center: Vector | None = None
    inertia: tuple[float, ...] | None = None


def read_matter(
    reading: NodeReader, node: SceneNode, place: Frame, shapes: Sequence[Shape]
) -> MassProperties:
    """Return the mass of the Solid at `node`."""
    mass_kg = 0.0
    center = inertia = None
    for physics in node.nodes("physics"):
        mass_kg = reading.number(physics, "mass", -1.0)
        if mass_kg < 0.0:
            density = reading.number(physics, "density", DENSITY)
            mass_kg = max(density, 0.0) * sum(map(volume_m3, shapes))
        if physics.numbers("centerOfMass"):
            center = triple(reading.vector(physics, "centerOfMass", (0.0, 0.0, 0.0)))
        if physics.numbers("inertiaMatrix"):
            inertia = reading.vector(physics, "inertiaMatrix", (0.0,) * 6)
    return MassProperties(place=place, shapes=tuple(shapes), mass_kg=mass_kg, center=center, inertia=inertia)


def volume_m3(shape: Shape) -> float:
    """Return the volume of a shape in m3."""
    x, y, z = shape.size
    if shape.mesh is not None:
        return meshes.volume_m3(shape.mesh)
    if shape.kind == "capsule":
        return math.pi / 4.0 * x * x * (z - x / 3.0)
    return x * y * z * _FILLED[shape.kind]
