"""From a boundingObject to shapes on the floor.

Only what is upright has an outline that holds at every height: boxes and cylinders. A plane is floor.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

from palaestra_sim.stub.physics.geometry import Pose
from palaestra_sim.stub.physics.obstacles import Block, Disc, Obstacle
from palaestra_sim.stub.scene.places import Place
from palaestra_sim.stub.scene.reading import Reading
from palaestra_sim.world import Node

_UPSIDE_DOWN: Final = -1.0 + 0.5e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """A box or cylinder in the frame of its place. Meters: `size` is x, y, z or 2 r, 2 r, height."""

    kind: Literal["box", "cylinder"]
    size: tuple[float, float, float]
    local: Pose
    place: Place
    node: Node

    @property
    def pose(self) -> Pose:
        """The shape's frame in the world."""
        return self.place.world_pose.after(self.local)

    @property
    def upright(self) -> bool:
        """Whether it stands, on either end."""
        pose = self.pose
        return pose.upright or pose.rotation[8] < _UPSIDE_DOWN

    def heights(self) -> tuple[float, float]:
        """Return z of its lower and its upper end."""
        z = self.pose.position[2]
        return z - self.size[2] / 2.0, z + self.size[2] / 2.0

    def obstacle(self) -> Obstacle:
        """Return its outline, where it is now."""
        pose = self.pose
        x, y, _ = pose.position
        if self.kind == "cylinder":
            return Disc(x, y, self.size[0] / 2.0)
        return Block(x, y, pose.heading_rad, (self.size[0], self.size[1]))


def bounding_shapes(reading: Reading, owner: Node, place: Place) -> Iterator[Shape]:
    """Yield the shapes of a node's boundingObject that the stub can simulate; the others are refused."""
    for node in reading.children(owner, "boundingObject"):
        yield from _shapes(reading, node, place, Pose())


def _shapes(reading: Reading, node: Node, place: Place, frame: Pose) -> Iterator[Shape]:
    match node.type_name:
        case "Box":
            x, y, z = reading.vector(node, "size", (0.1, 0.1, 0.1))
            yield Shape(kind="box", size=(x, y, z), local=frame, place=place, node=node)
        case "Cylinder":
            width = 2.0 * reading.number(node, "radius", 1.0)
            size = (width, width, reading.number(node, "height", 2.0))
            yield Shape(kind="cylinder", size=size, local=frame, place=place, node=node)
        case "Plane":
            if not place.world_pose.after(frame).upright:
                reading.refuse(node, "a Plane that is no floor")
        case "Shape":
            for inner in reading.children(node, "geometry"):
                yield from _shapes(reading, inner, place, frame)
        case "Group" | "Pose" | "Transform":
            inside = frame.after(reading.pose(node))
            for inner in reading.children(node):
                yield from _shapes(reading, inner, place, inside)
        case other:
            reading.refuse(node, f"the stub simulates no {other} as a boundingObject")
