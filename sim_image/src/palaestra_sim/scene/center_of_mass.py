"""The center of mass of a node: the common center of the Solids with a mass at and inside the node.

Source: Webots reference, Physics and supervisor. A node without a mass has its center at its origin.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector, weighted_mean
from palaestra_sim.scene.mass import MassProperties, read_matter, volume_m3
from palaestra_sim.scene.mesh_files import MeshFiles
from palaestra_sim.scene.meshes import middle_of_volume
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.shapes import Shape, bounding_shapes
from palaestra_sim.scene.validation import NodeReader


def center_of_mass(node: SceneNode, place: Frame, mesh_files: MeshFiles) -> Vector:
    """Return the center of mass of a node in meters, in the axes of the world file.

    Args:
        node: the node.
        place: the frame of the node.
        mesh_files: the mesh files that nodes of the world name.
    """
    matters = list(_matter(node, mesh_files))
    centers = [matter.place.world_pose.carry(_center(matter)) for matter in matters]
    return weighted_mean(centers, [matter.mass_kg for matter in matters]) or place.world_position


def _matter(node: SceneNode, mesh_files: MeshFiles) -> Iterator[MassProperties]:
    """Yield each mass of a Solid at and inside a node."""
    reading = NodeReader(mesh_files=mesh_files)  # the world was checked when it was loaded
    for solid in (node, *node.descendants()):
        if solid.place is not None and not solid.left_out and (solid.stand_in or solid.nodes("physics")):
            shapes = list(bounding_shapes(reading, solid, solid.place))
            matter = read_matter(reading, solid, solid.place, shapes)
            if solid.stand_in:  # it has no Physics node, but the mass of its PROTO
                matter = replace(matter, mass_kg=reading.number(solid, "mass", 0.0))
            if matter.mass_kg > 0.0:
                yield matter


def _center(matter: MassProperties) -> Vector:
    """Return the center of a Solid's mass in the axes of its frame, in meters in the world."""
    scale = matter.place.scale
    if matter.center is not None:
        x, y, z = matter.center
        return x * scale, y * scale, z * scale
    middles = [_middle(shape) for shape in matter.shapes]
    return weighted_mean(middles, [volume_m3(shape) for shape in matter.shapes]) or (0.0, 0.0, 0.0)


def _middle(shape: Shape) -> Vector:
    """Return the center of a shape's volume in the axes of its frame."""
    if shape.mesh is None:
        return shape.local.position
    return shape.local.carry(middle_of_volume(shape.mesh))
