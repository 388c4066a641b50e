"""Read the shapes of a boundingObject."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import IDENTITY, Matrix, Pose, Vector, minus
from palaestra_sim.scene.meshes import Mesh, box_of, face_set, placed
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.old_axes import standing
from palaestra_sim.scene.validation import NodeReader

_ALONG_AN_AXIS: Final = frozenset(("Capsule", "Cylinder"))
_FLAT: Final = 0.9999  # cosine of the largest slope of a floor, less than a degree
_ALONG: Final = 1.0 - 0.5e-6  # minimum z of a unit vector that is vertical to within a milliradian
_LEAST_M: Final = 1e-3  # minimum length of a side of the box around points
_ACROSS: Final = 1e-3  # maximum z of a unit vector that is level to within a milliradian

Kind = Literal["box", "cylinder", "ball", "capsule", "mesh"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """A box, cylinder, ball, capsule or mesh, at a pose `local` in the frame `place`.

    Attributes:
        size: x, y, z in meters; for round shapes 2 r, 2 r, height; the height of a capsule includes its caps.
        mesh: the triangles of the kind "mesh", with their middle at the origin.
    """

    kind: Kind
    size: Vector
    local: Pose
    place: Frame
    node: SceneNode
    mesh: Mesh | None = None

    @property
    def pose(self) -> Pose:
        """The pose of the shape in the world, in the axes of the ground."""
        return self.place.ground_pose.after(self.local)

    @property
    def upright(self) -> bool:
        """Whether one of the shape's axes is vertical, so that its outline is the same at every height.

        A ball, a mesh and a shape that `lies` count as upright too. So does every shape of a stand-in,
        because stand-ins are approximations: a tilted stand-in has the outline of an upright stand-in.
        """
        rotation = self.pose.rotation
        return (
            self.kind in {"ball", "mesh"}
            or any(abs(rotation[6 + axis]) > _ALONG for axis in range(3))
            or self.lies
            or any(around.stand_in for around in self.node.ancestors())
        )

    @property
    def lies(self) -> bool:
        """Whether the shape is round about a level axis."""
        return self.kind in {"cylinder", "capsule"} and abs(self.pose.rotation[8]) < _ACROSS

    @property
    def prismatic(self) -> bool:
        """Whether the outline from above is the same at each height between the lower and the upper end."""
        return self.kind == "box" or (self.kind == "cylinder" and not self.lies)

    def heights(self) -> tuple[float, float]:
        """Return z of the shape's lower end and of its upper end."""
        pose = self.pose
        z, half = pose.position[2], self.half_along(pose.rotation, 2)
        return z - half, z + half

    def half_along(self, rotation: Matrix, axis: int) -> float:
        """Return half the shape's length along axis 0, 1 or 2 of a frame; its rotation is in this frame."""
        if self.kind == "ball":
            return self.size[2] / 2.0
        if self.kind == "capsule":
            straight = max(self.size[2] - self.size[0], 0.0)
            return (straight * abs(rotation[3 * axis + 2]) + self.size[0]) / 2.0
        if self.kind == "cylinder":
            along = min(1.0, abs(rotation[3 * axis + 2]))
            return (self.size[2] * along + self.size[0] * math.sqrt(1.0 - along * along)) / 2.0
        return sum(abs(rotation[3 * axis + side]) * self.size[side] for side in range(3)) / 2.0


def bounding_shapes(reading: NodeReader, owner: SceneNode, place: Frame) -> Iterator[Shape]:
    """Yield the shapes of a node's boundingObject that can be simulated; refuse the other shapes."""
    grown = _Grown(Pose(), (place.scale, place.scale, place.scale))
    for node in owner.nodes("boundingObject"):
        yield from _shapes(reading, node, place, grown)


class _Grown(NamedTuple):
    """A frame inside a boundingObject, and the factors by which it scales its contents along its axes."""

    frame: Pose
    scale: Vector

    def at(self, position: Vector) -> Pose:
        """Return the pose of a frame at a position in this frame, with the same axes."""
        x, y, z = (at * factor for at, factor in zip(position, self.scale, strict=True))
        return self.frame.after(Pose((x, y, z)))

    def inside(self, pose: Pose, scale: Vector) -> _Grown:
        """Return the frame of a node in this frame; the node must not be rotated if `even` is False."""
        x, y, z = (factor * inner for factor, inner in zip(self.scale, scale, strict=True))
        return _Grown(self.at(pose.position).after(Pose(rotation=pose.rotation)), (x, y, z))

    @property
    def even(self) -> bool:
        """Whether all factors are equal, so that angles are kept."""
        return self.scale[0] == self.scale[1] == self.scale[2]


def _shapes(reading: NodeReader, node: SceneNode, place: Frame, grown: _Grown) -> Iterator[Shape]:
    match node.type_name:
        case "Shape":
            for inner in node.nodes("geometry"):
                yield from _shapes(reading, inner, place, grown)
        case "Group" | "Pose" | "Transform":
            pose, scale = reading.pose(node), reading.scale(node)
            if min(scale) <= 0.0 or not (grown.even or pose.rotation == IDENTITY):
                reading.lacks(node, f"a {node.type_name} with a scale that distorts the shapes in it")
                return
            for inner in node.nodes():
                yield from _shapes(reading, inner, place, grown.inside(pose, scale))
        case "Plane":
            # A ceiling is ignored, because it is above all objects on the floor.
            local = standing(node, grown.frame)
            normal = place.ground_pose.after(local).rotation[8]
            if abs(normal) < _FLAT:
                reading.lacks(node, "a Plane that is neither a floor nor a ceiling")
            elif normal > 0.0 and not any(around.type_name == "Robot" for around in node.ancestors()):
                reading.floors.append((place, local))
        case "IndexedFaceSet" | "Mesh":
            triangles = _faces if node.type_name == "IndexedFaceSet" else _of_file
            yield from triangles(reading, node, place, grown)
        case _:
            yield from _solid(reading, node, place, grown)


def _solid(reading: NodeReader, node: SceneNode, place: Frame, grown: _Grown) -> Iterator[Shape]:
    """Yield the shape of a Box, Cylinder, Capsule or Sphere."""
    kind: Kind = "cylinder"
    local = standing(node, grown.frame) if node.type_name in _ALONG_AN_AXIS else grown.frame
    if node.type_name == "Box":
        kind = "box"
        x, y, z = reading.vector(node, "size", (0.1, 0.1, 0.1))
    elif node.type_name == "Cylinder":
        x = y = 2.0 * reading.number(node, "radius", 1.0)
        z = reading.number(node, "height", 2.0)
    elif node.type_name == "Capsule":
        kind = "capsule"
        x = y = 2.0 * reading.number(node, "radius", 1.0)
        z = reading.number(node, "height", 2.0) + x
    elif node.type_name == "Sphere":
        kind = "ball"
        x = y = z = 2.0 * reading.number(node, "radius", 1.0)
    else:
        reading.lacks(node, f"{reading.simulator} simulates no {node.type_name} as a boundingObject")
        return
    if kind != "box" and not grown.even:
        reading.lacks(node, f"a {node.type_name} that a scale distorts")
        return
    along, across, up = grown.scale
    size = (x * along, y * across, z * up)
    yield Shape(kind=kind, size=size, local=local, place=place, node=node)


def _faces(reading: NodeReader, node: SceneNode, place: Frame, grown: _Grown) -> Iterator[Shape]:
    """Yield the triangles of an IndexedFaceSet; without faces, the box around its points."""
    points = [number for coordinate in node.nodes("coord") for number in coordinate.numbers("point") or ()]
    if not points or len(points) % 3:
        reading.refuse(node, "an IndexedFaceSet without points", "give it a Coordinate with points")
        return
    written = face_set(node)
    mesh = None if written is None else placed(written, grown.scale)
    if mesh is None:  # the face set has no usable face
        middle, size = box_of(list(zip(points[0::3], points[1::3], points[2::3], strict=True)))
        x, y, z = (max(it * factor, _LEAST_M) for it, factor in zip(size, grown.scale, strict=True))
        yield Shape(kind="box", size=(x, y, z), local=grown.at(middle), place=place, node=node)
        return
    yield _centered(mesh, node, place, grown)


def _of_file(reading: NodeReader, node: SceneNode, place: Frame, grown: _Grown) -> Iterator[Shape]:
    """Yield the triangles of a Mesh."""
    try:
        mesh = placed(reading.mesh_files.mesh_of(node), grown.scale)
    except ValueError as error:
        reading.lacks(node, f"the Mesh of a boundingObject: {error}")
        return
    if mesh is None:
        reading.lacks(node, "the Mesh of a boundingObject: all its triangles have the area 0")
        return
    yield _centered(mesh, node, place, grown)


def _centered(mesh: Mesh, node: SceneNode, place: Frame, grown: _Grown) -> Shape:
    """Return the shape of a scaled mesh."""
    middle, size = box_of(mesh.points)
    centered = Mesh(tuple(minus(point, middle) for point in mesh.points), mesh.triangles)
    local = grown.frame.after(Pose(middle))
    return Shape(kind="mesh", size=size, local=local, place=place, node=node, mesh=centered)
