"""Find the joints of a robot that forces move, in a physics with forces.

The parts on such a joint have physics. Joints that drive or steer a wheel do not count, and joints on a wheel
do not count. The joints of a caster do not count, because a caster only follows the motion of the robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.joints import JointFrame
from palaestra_sim.scene.links import Link, link_around
from palaestra_sim.scene.mass import MassProperties, read_matter
from palaestra_sim.scene.motors import Motor
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.scene.validation import NodeReader
from palaestra_sim.scene.wheels import Driven

_CLEARANCE_M: Final = 0.01  # the end of a joint rolls on the floor if it is nearer than this to the floor


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """The parts of one robot, in the robot's own frame, with all joints as in the world file.

    Attributes:
        nodes: each node with its frame, outer nodes first.
        shapes: all shapes that can collide with something.
        wheels: the wheels that drive the robot.
        steering: the motors that steer the robot's wheels.
        measured: links whose force on the robot a sensor measures; they have no shapes and masses yet.
    """

    nodes: Sequence[tuple[SceneNode, Frame]]
    shapes: Sequence[Shape]
    wheels: Sequence[Driven]
    steering: Sequence[Motor]
    measured: Sequence[Link]

    @property
    def heavy(self) -> list[tuple[SceneNode, Frame]]:
        """The nodes with physics."""
        return [(node, place) for node, place in self.nodes if node.nodes("physics")]


def links_among(reading: NodeReader, parts: Parts) -> tuple[tuple[Link, ...], tuple[MassProperties, ...]]:
    """Return the links of a robot, outer links first, and the masses of the parts that are not on a link."""
    links = [
        Link(node=node, place=place, joint=place.joint)
        for node, place in parts.nodes
        if isinstance(place, JointFrame) and _moves(place, parts)
    ]
    links += [link for link in parts.measured if link.node.nodes("physics")]
    links.sort(key=lambda link: sum(1 for _ in link.place.chain()))
    for link in links:
        link.shapes = shapes_on(link, links, parts.shapes)
        link.matter = _matter_on(link, links, reading, parts)
        if link.joint is not None and link.joint.motor is not None:
            link.joint.motor.forceful = True
            link.joint.motor.kinematic = False
    return tuple(links), _matter_on(None, links, reading, parts)


def shapes_on(link: Link | None, links: Sequence[Link], shapes: Sequence[Shape]) -> tuple[Shape, ...]:
    """Return the distinct shapes on a link; for None, the shapes that are not on any link."""
    found = {
        (shape.node.number, shape.place): shape
        for shape in shapes
        if link_around(shape.place, links) is link and not shape.node.left_out
    }
    return tuple(found.values())


def _matter_on(
    link: Link | None, links: Sequence[Link], reading: NodeReader, parts: Parts
) -> tuple[MassProperties, ...]:
    on_it = shapes_on(link, links, parts.shapes)
    return tuple(
        read_matter(reading, node, place, [shape for shape in on_it if shape.place is place])
        for node, place in parts.heavy
        if link_around(place, links) is link
    )


def _moves(end: JointFrame, parts: Parts) -> bool:
    """Return whether forces move the end of a joint."""
    motors = [place.joint.motor for place in end.chain() if isinstance(place, JointFrame)]
    rolling = {found.motor for found in parts.wheels} | set(parts.steering)
    if any(motor in rolling for motor in motors if motor is not None):
        return False
    if not any(end in place.chain() for _, place in parts.heavy):
        return False
    return end.joint.motor is not None or not _rolls(end, parts)


def _rolls(end: JointFrame, parts: Parts) -> bool:
    """Return whether a shape on a joint reaches the floor on which the robot drives."""
    if not parts.wheels:
        return False
    floor = min(found.bottom for found in parts.wheels)
    lows = [shape.heights()[0] for shape in parts.shapes if end in shape.place.chain()]
    return min(lows, default=floor + 2.0 * _CLEARANCE_M) < floor + _CLEARANCE_M
