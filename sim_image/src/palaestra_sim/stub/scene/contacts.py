"""Where robots touch obstacles and each other, as a supervisor asks for it.

The floor is no obstacle here: wheels roll on it without contact points.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

from palaestra_sim.stub.physics.geometry import Vector
from palaestra_sim.stub.physics.obstacles import Disc, Obstacle
from palaestra_sim.stub.scene.nodes.scene_node import SceneNode
from palaestra_sim.stub.scene.robot import Robot
from palaestra_sim.stub.scene.shapes import Shape

_TOUCH_M: Final = 1e-6  # a robot rests at the surface that pushed it out, give or take rounding


class ContactPoint(NamedTuple):
    """A point at which two nodes touch, in meters in the world."""

    point: Vector
    nodes: tuple[SceneNode, SceneNode]


def contact_points(robots: Sequence[Robot], solids: Sequence[Shape]) -> Iterator[ContactPoint]:
    """Yield where robots touch now: at the lowest height that both sides have."""
    for index, robot in enumerate(robots):
        for disc, part, bottom, top in _parts(robot):
            for shape in solids:
                low, high = shape.heights()
                if low < top and bottom < high and (point := _touched(disc, shape.obstacle())):
                    yield ContactPoint((*point, max(low, bottom)), (_solid(part), _solid(shape.node)))
            for other in robots[index + 1 :]:
                for other_disc, other_part, low, high in _parts(other):
                    if low < top and bottom < high and (point := _touched(disc, other_disc)):
                        yield ContactPoint((*point, max(low, bottom)), (_solid(part), _solid(other_part)))


def _parts(robot: Robot) -> Iterator[tuple[Disc, SceneNode, float, float]]:
    """Yield each cylinder of a robot, with the node that it is of, its lower and its upper end."""
    if robot.body is None:
        return
    low, high = robot.parts.heights
    height = robot.place.world_pose.position[2]
    for disc, shape in zip(robot.body.discs, robot.parts.rim, strict=True):
        yield disc, shape.node, low + height, high + height


def _touched(disc: Disc, obstacle: Obstacle) -> tuple[float, float] | None:
    contact = obstacle.contact(disc.x, disc.y, disc.radius + _TOUCH_M)
    if contact is None:
        return None
    return disc.x - contact[0] * disc.radius, disc.y - contact[1] * disc.radius


def _solid(node: SceneNode) -> SceneNode:
    """Return the Solid, Robot or device whose boundingObject has a node."""
    around = (node, *node.ancestors())
    return next((it for it in around if it.place is not None and not it.outline), node)
