"""The contact points of robots with obstacles and with each other, for requests of a supervisor.

Contacts with the floor are not reported: in the stub, wheels roll without contact points.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.physics import ContactPoint, Figure
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.stub.body import StubBody
from palaestra_sim.stub.obstacles import Disc, FlatObstacle
from palaestra_sim.stub.outline import obstacle

_TOUCH_M: Final = 1e-6  # tolerance: because of rounding, a robot may rest this far from a surface


def contact_points(
    robots: Sequence[tuple[Figure, StubBody]], solids: Sequence[Shape]
) -> Iterator[ContactPoint]:
    """Yield the current contact points of robots, each at the lowest height that both shapes have."""
    for index, (robot, body) in enumerate(robots):
        for disc, part, bottom, top in _parts(robot, body):
            for shape in solids:
                low, high = shape.heights()
                if low < top and bottom < high and (point := _touched(disc, obstacle(shape))):
                    yield ContactPoint((*point, max(low, bottom)), (_solid(part), _solid(shape.node)))
            for other, other_body in robots[index + 1 :]:
                for other_disc, other_part, low, high in _parts(other, other_body):
                    if low < top and bottom < high and (point := _touched(disc, other_disc)):
                        yield ContactPoint((*point, max(low, bottom)), (_solid(part), _solid(other_part)))


def _parts(robot: Figure, body: StubBody) -> Iterator[tuple[Disc, SceneNode, float, float]]:
    """Yield each cylinder of a robot, its node, and the heights of its lower and its upper end."""
    low, high = body.heights
    height = robot.place.height_m
    for disc, shape in zip(body.discs, body.rim, strict=True):
        yield disc, shape.node, low + height, high + height


def _touched(disc: Disc, outline: FlatObstacle) -> tuple[float, float] | None:
    contact = outline.contact(disc.x, disc.y, disc.radius + _TOUCH_M)
    if contact is None:
        return None
    return disc.x - contact[0] * disc.radius, disc.y - contact[1] * disc.radius


def _solid(node: SceneNode) -> SceneNode:
    """Return the Solid, Robot or device whose boundingObject contains a node."""
    around = (node, *node.ancestors())
    return next((it for it in around if it.place is not None and not it.outline), node)
