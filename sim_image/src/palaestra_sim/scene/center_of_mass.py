"""The center of mass of a node: the common center of the Solids with a mass at and inside the node.

Source: Webots reference, Physics and supervisor. A node without a mass has its center at its origin.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.mass import MassProperties, read_matter, volume_m3
from palaestra_sim.scene.meshes import middle_of_volume
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.shapes import Shape, bounding_shapes
from palaestra_sim.scene.validation import NodeReader


def center_of_mass(node: SceneNode, place: Frame) -> Vector:
    """Return the center of mass of a node in meters, in the axes of the world file.

    Args:
        node: the node.
        place: the frame of the node.
    """
    heavy = [matter for matter in _matter(node) if matter.mass_kg > 0.0]
    total_kg = sum(matter.mass_kg for matter in heavy)
    if total_kg == 0.0:
        return place.world_position
    centers = [matter.place.world_pose.carry(_center(matter)) for matter in heavy]
    x, y, z = (
        sum(matter.mass_kg * at[axis] for matter, at in zip(heavy, centers, strict=True)) / total_kg
        for axis in range(3)
    )
    return x, y, z


def _matter(node: SceneNode) -> Iterator[MassProperties]:
    """Yield the mass of each Solid at and inside a node."""
    reading = NodeReader()  # the world was checked when it was loaded
    for solid in (node, *node.descendants()):
        if solid.place is not None and not solid.left_out:
            shapes = list(bounding_shapes(reading, solid, solid.place))
            matter = read_matter(reading, solid, solid.place, shapes)
            if solid.stand_in:  # it has no Physics node, but the mass of its PROTO
                matter = replace(matter, mass_kg=reading.number(solid, "mass", 0.0))
            yield matter


def _center(matter: MassProperties) -> Vector:
    """Return the center of a Solid's mass in the axes of its frame, in meters in the world."""
    scale = matter.place.scale
    if matter.center is not None:
        x, y, z = matter.center
        return x * scale, y * scale, z * scale
    volumes = [volume_m3(shape) for shape in matter.shapes]
    if not sum(volumes):
        return 0.0, 0.0, 0.0
    middles = [_middle(shape) for shape in matter.shapes]
    x, y, z = (
        sum(volume * at[axis] for volume, at in zip(volumes, middles, strict=True)) / sum(volumes)
        for axis in range(3)
    )
    return x, y, z


def _middle(shape: Shape) -> Vector:
    """Return the center of a shape's volume in the axes of its frame."""
    if shape.mesh is None:
        return shape.local.position
    return shape.local.carry(middle_of_volume(shape.mesh))
